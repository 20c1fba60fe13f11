//! Lines on standard output and standard error, safe for a terminal.

use std::borrow::Cow;
use std::io::{Error, Write};
use std::sync::OnceLock;

use crate::error::{by_number, is_obeyed};

/// Columns of a terminal.
const WIDTH: usize = 80;

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

/// A line folded between words at the width of a terminal, with so many blanks before those that follow the first.
pub fn folded(line: &str, indent: usize) -> String {
    let (mut folded, mut column) = (String::new(), 0);
    for (at, word) in line.split(' ').enumerate() {
        let length = word.chars().count();
        if at > 0 && column + 1 + length > WIDTH {
            folded.push('\n');
            folded.push_str(&" ".repeat(indent));
            column = indent;
        } else if at > 0 {
            folded.push(' ');
            column += 1;
        }
        folded.push_str(word);
        column += length;
    }
    folded
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
    fn lines_are_folded_between_words() {
        assert_eq!(folded("note         short", 13), "note         short");
        let long = format!("note  {} end", ["word"; 16].join(" "));
        let lines: Vec<String> = folded(&long, 6).lines().map(String::from).collect();
        assert_eq!(lines.join("").replace("      ", " "), long);
        assert_eq!(lines.iter().map(|line| line.len()).collect::<Vec<_>>(), [80, 14]);
        // A path stays whole.
        let path = "x".repeat(100);
        assert_eq!(folded(&format!("into {path} done"), 2), format!("into\n  {path}\n  done"));
    }

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
