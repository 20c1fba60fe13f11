//! The language in which [`super::table`] says what a case file may contain.
//!
//! One table of forms is the source of the checks ([`super::walk`]), the defaults, the error
//! messages and the JSON Schema ([`super::schema`]), so that these cannot drift apart.

use crate::quantity::Dimension;

/// What a value of the case file must look like.
#[derive(Debug, Clone, Copy)]
pub enum Form {
    /// A plain SI number or a string with a unit.
    Quantity(Dimension, Range),
    /// A whole number from the first to the second, both included.
    Count(u64, u64),
    Text,
    /// A text that is not empty and has no line break.
    Line,
    Flag,
    /// One of a few words.
    Choice(&'static [&'static str]),
    /// A list with one form per place.
    Tuple(&'static [Form]),
    /// A list of at least so many items of one form.
    List(&'static Form, usize),
    /// Known keys only.
    Object(&'static [Key]),
    /// Exactly one of the known keys.
    OneOf(&'static [Key]),
    /// An object whose `kind` decides on its other keys.
    Kinds(&'static [Kind]),
    /// An object with names chosen by the user, its values of one form.
    Named(&'static Form),
    /// A material quantity: an object with a `mean` (the first of these keys) and its scatter,
    /// or the plain mean, which then has none.
    Scattered(&'static [Key]),
    /// An object that overrides some of these keys, none of which is needed or completed.
    Overrides(&'static [Key]),
    /// The first form, which may be given as the second, too: `bring` has put that in its place before.
    OrBrought(&'static Form, &'static Form),
    /// What `bring` has put in another's place before; where it is still there it has a fault already.
    Brought(&'static Form),
    /// An object with JSON pointers as its keys, its values of one form.
    ByPointer(&'static Form),
    Nullable(&'static Form),
    Any,
    /// The first of these that fits.
    Either(&'static [Form]),
}

/// A key of an object.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    pub name: &'static str,
    pub form: Form,
    pub need: Need,
    /// One sentence for the JSON Schema.
    pub about: &'static str,
}

/// Whether a key must be there, and what holds if it isn't.
#[derive(Debug, Clone, Copy)]
pub enum Need {
    Required,
    Optional,
    /// The default as JSON text, which is checked like a value from the file.
    Default(&'static str),
    /// The default follows from other keys, as the text says.
    Derived(&'static str),
}

/// An alternative of [`Form::Kinds`]: an object with this `kind`, or, where it needs no other key, the word alone.
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    pub name: &'static str,
    pub about: &'static str,
    /// The keys beside `kind`.
    pub keys: &'static [Key],
}

impl Kind {
    /// Whether its word alone says it all.
    pub fn is_word(&self) -> bool {
        self.keys.iter().all(|key| !matches!(key.need, Need::Required))
    }
}

/// An interval of numbers, in SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    pub low: f64,
    /// Whether `low` itself is excluded.
    pub above: bool,
    pub high: f64,
    /// Whether `high` itself is excluded.
    pub below: bool,
}

/// From `low` to `high`, both included.
pub const fn within(low: f64, high: f64) -> Range {
    Range { low, above: false, high, below: false }
}

/// Above zero, up to `high`.
pub const fn positive(high: f64) -> Range {
    Range { low: 0.0, above: true, high, below: false }
}

impl Range {
    /// What is wrong with `x`, as a clause with the unit of plain numbers.
    pub fn problem(&self, x: f64, dimension: Dimension) -> Option<String> {
        let unit = match dimension.si_unit() {
            "" => String::new(),
            unit => format!(" {unit}"),
        };
        if x < self.low || (self.above && x == self.low) {
            Some(match (self.low, self.above) {
                (0.0, true) => "must be positive".into(),
                (0.0, false) => "must not be negative".into(),
                (low, true) => format!("must be above {}{unit}", plain(low)),
                (low, false) => format!("must be at least {}{unit}", plain(low)),
            })
        } else if x > self.high || (self.below && x == self.high) {
            let bound = if self.below { "below" } else { "at most" };
            Some(format!("must be {bound} {}{unit}", plain(self.high)))
        } else {
            None
        }
    }

    /// For messages: "from 1000 up to 1e13 Pa".
    pub fn describe(&self, dimension: Dimension) -> String {
        let unit = match dimension.si_unit() {
            "" => String::new(),
            unit => format!(" {unit}"),
        };
        let low = if self.above { "above" } else { "from" };
        let high = if self.below { "to below" } else { "up to" };
        format!("{low} {} {high} {}{unit}", plain(self.low), plain(self.high))
    }
}

/// Short: 1e13, not 10000000000000.
pub(super) fn plain(x: f64) -> String {
    if x != 0.0 && (x.abs() >= 1e5 || x.abs() < 1e-3) { format!("{x:e}") } else { format!("{x}") }
}

/// A number of a message, its digits written out where these are few: 1e-320 has 320 zeros.
pub(super) fn written(x: f64) -> String {
    if x != 0.0 && !(1e-9..1e15).contains(&x.abs()) { format!("{x:e}") } else { format!("{x}") }
}

impl Key {
    pub const fn required(name: &'static str, form: Form, about: &'static str) -> Key {
        Key { name, form, need: Need::Required, about }
    }

    pub const fn optional(name: &'static str, form: Form, about: &'static str) -> Key {
        Key { name, form, need: Need::Optional, about }
    }

    pub const fn default(name: &'static str, form: Form, json: &'static str, about: &'static str) -> Key {
        Key { name, form, need: Need::Default(json), about }
    }

    pub const fn derived(name: &'static str, form: Form, from: &'static str, about: &'static str) -> Key {
        Key { name, form, need: Need::Derived(from), about }
    }
}

impl Form {
    /// What a message offers in place of a value that doesn't fit.
    pub fn accepted(&self) -> String {
        match self {
            Form::Quantity(dimension, range) => {
                format!("{}, {}", dimension.accepted(), range.describe(*dimension))
            }
            Form::Count(low, u64::MAX) => format!("a whole number, at least {low}"),
            Form::Count(low, high) => format!("a whole number from {low} to {high}"),
            Form::Text => "a text in quotes".into(),
            Form::Line => "a text in quotes, not empty and without line breaks".into(),
            Form::Flag => "true or false".into(),
            Form::Choice(words) => quoted(words.iter().copied()),
            Form::Tuple(items) => match items.first() {
                Some(first) => format!("a list of {}, each {}", items.len(), first.accepted()),
                None => "an empty list".into(),
            },
            Form::List(item, 0) => format!("a list, each {}", item.accepted()),
            Form::List(item, least) => {
                format!("a list of at least {least}, each {}", item.accepted())
            }
            Form::Object(keys) | Form::Overrides(keys) => format!("an object with the keys {}", names(keys)),
            Form::OneOf(keys) => format!("an object with one of the keys {}", names(keys)),
            Form::Kinds(kinds) => {
                let object =
                    format!("an object with a \"kind\" of {}", quoted(kinds.iter().map(|kind| kind.name)));
                let words = quoted(kinds.iter().filter(|kind| kind.is_word()).map(|kind| kind.name));
                if words.is_empty() { object } else { format!("{object}, or alone the word {words}") }
            }
            Form::Named(_) => "an object with names as its keys".into(),
            Form::ByPointer(form) => {
                format!("an object with JSON pointers as its keys, each with {}", form.accepted())
            }
            Form::Any => "any value".into(),
            Form::Scattered(keys) => {
                let mean = keys.first().map(|mean| mean.form.accepted()).unwrap_or_default();
                format!("{mean}, or an object with the keys {}", names(keys))
            }
            Form::OrBrought(form, other) => format!("{}, or {}", form.accepted(), other.accepted()),
            Form::Brought(form) => form.accepted(),
            Form::Nullable(form) => format!("null, or {}", form.accepted()),
            Form::Either(forms) => forms.iter().map(Form::accepted).collect::<Vec<_>>().join(", or "),
        }
    }
}

/// Words in quotes for a message.
fn quoted(words: impl Iterator<Item = &'static str>) -> String {
    words.map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(", ")
}

/// The names of keys for a message.
pub fn names(keys: &[Key]) -> String {
    keys.iter().map(|key| key.name).collect::<Vec<_>>().join(", ")
}
