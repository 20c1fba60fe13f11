//! Lines on standard output and standard error, safe for a terminal.

use std::borrow::Cow;
use std::io::{Error, Write};
use std::sync::OnceLock;

use crate::error::{by_number, is_obeyed};

static UNSAID: OnceLock<Error> = OnceLock::new();

/// The first trouble with standard output.
pub fn unsaid() -> Option<&'static Error> {
    UNSAID.get()
}

/// A line on standard output; what keeps it from there is told at the end.
pub fn say(text: &str) {
    if let Err(error) = writeln!(std::io::stdout().lock(), "{}", harmless(text)) {
        UNSAID.get_or_init(|| error);
    }
}

/// An error on standard error.
pub fn complain(text: &str) {
    note(&format!("riprap: {text}"));
}

/// A line on standard error.
pub fn note(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{}", harmless(text));
}

/// A text as a terminal may see it: titles and names are from case files and results files, which others made. Characters that a
/// terminal obeys, and those that turn the direction of writing, are shown by their numbers, as JSON writes them.
fn harmless(text: &str) -> Cow<'_, str> {
    let obeyed = |c: char| is_obeyed(c) && c != '\n' && c != '\t';
    if !text.contains(obeyed) {
        return text.into();
    }
    let shown = |c: char| if obeyed(c) { by_number(c) } else { c.to_string() };
    text.chars().map(shown).collect::<String>().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_terminal_obeys_no_title() {
        let hostile = "a\u{1b}]0;owned\u{7}\u{1b}[31mred\u{9b}2J\r\u{202e}cod\u{7f}";
        assert_eq!(
            harmless(hostile),
            "a\\u001b]0;owned\\u0007\\u001b[31mred\\u009b2J\\u000d\\u202ecod\\u007f"
        );
        assert_eq!(harmless("q = 0,8 MPa\n\tSchüttung 试验"), "q = 0,8 MPa\n\tSchüttung 试验");
    }
}
