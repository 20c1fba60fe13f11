//! The house rules that a machine can check: layers, circles, printing, packages in one room, names, sizes.
//!
//! `src/lib.rs` lists the rooms in layer order; a room refers only to rooms listed above it. The
//! scan reads tokens, not text, so that comments, doc links and strings never count. ARCHITECTURE.md
//! has the table of rooms. The scanner's own tests below show that each rule can fail.

mod circles;

use std::path::{Path, PathBuf};

/// Longer files are to be cut at a seam.
const MOST_LINES: usize = 700;

/// Names that say nothing about what is inside.
const EMPTY_NAMES: [&str; 9] =
    ["util", "utils", "utilities", "common", "helper", "helpers", "base", "misc", "stuff"];

const PRINTING: [&str; 5] = ["print", "println", "eprint", "eprintln", "dbg"];

/// The one room that may print.
const PRINTING_ROOM: &str = "cli";

/// Packages that only one room may name.
const OWNED_PACKAGES: [(&str, &str); 6] = [
    ("faer", "linalg"),
    ("sprs", "linalg"),
    ("metis_sys", "linalg"),
    ("hdf5", "results"),
    ("hdf5_sys", "results"),
    ("clap", PRINTING_ROOM),
];

#[derive(Debug, Clone, PartialEq)]
struct Token {
    text: String,
    line: usize,
}

/// Identifiers and single punctuation characters; comments, strings, characters and lifetimes are left out.
fn tokens(source: &str) -> Vec<Token> {
    let letters: Vec<char> = source.chars().collect();
    let at = |k: usize| letters.get(k).copied().unwrap_or('\0');
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut found = vec![];
    let (mut k, mut line) = (0, 1);
    while k < letters.len() {
        let start = k;
        match at(k) {
            '/' if at(k + 1) == '/' => {
                while k < letters.len() && at(k) != '\n' {
                    k += 1;
                }
            }
            '/' if at(k + 1) == '*' => {
                let mut depth = 0;
                loop {
                    match (at(k), at(k + 1)) {
                        ('/', '*') => (depth, k) = (depth + 1, k + 2),
                        ('*', '/') => (depth, k) = (depth - 1, k + 2),
                        _ => k += 1,
                    }
                    if depth == 0 || k >= letters.len() {
                        break;
                    }
                }
            }
            '"' => k = end_of_string(&letters, k),
            '\'' => {
                // A character ends with a quote; a lifetime does not.
                if at(k + 1) == '\\' {
                    k += 3;
                    while k < letters.len() && at(k) != '\'' {
                        k += 1;
                    }
                    k += 1;
                } else if at(k + 2) == '\'' {
                    k += 3;
                } else {
                    k += 1;
                    while is_word(at(k)) {
                        k += 1;
                    }
                }
            }
            c if is_word(c) => {
                while is_word(at(k)) {
                    k += 1;
                }
                let word: String = letters[start..k].iter().collect();
                let raw = word.ends_with('r') && word.len() <= 2;
                let hashes = (k..).take_while(|&m| at(m) == '#').count();
                if raw && at(k + hashes) == '"' {
                    let close: Vec<char> = std::iter::once('"').chain(vec!['#'; hashes]).collect();
                    k += hashes + 1;
                    while k < letters.len() && !letters[k..].starts_with(&close) {
                        k += 1;
                    }
                    k += close.len();
                } else if at(k) == '"' && word.len() == 1 {
                    k = end_of_string(&letters, k);
                } else {
                    found.push(Token { text: word, line });
                }
            }
            c => {
                if !c.is_whitespace() {
                    found.push(Token { text: c.to_string(), line });
                }
                k += 1;
            }
        }
        line += letters[start..k.min(letters.len())].iter().filter(|&&c| c == '\n').count();
    }
    found
}

fn end_of_string(letters: &[char], open: usize) -> usize {
    let mut k = open + 1;
    while k < letters.len() && letters[k] != '"' {
        k += if letters[k] == '\\' { 2 } else { 1 };
    }
    k + 1
}

/// The rooms in layer order, from the text of `lib.rs`.
fn rooms(lib: &str) -> Vec<String> {
    let tokens = tokens(lib);
    tokens.windows(3).filter(|w| w[0].text == "mod" && w[2].text == ";").map(|w| w[1].text.clone()).collect()
}

/// Module path of a file below `src`: `contact/pair.rs` is `["contact", "pair"]`.
fn module_path(file: &Path) -> Vec<String> {
    let mut path: Vec<String> =
        file.with_extension("").iter().map(|part| part.to_string_lossy().into_owned()).collect();
    if path.last().is_some_and(|last| last == "mod") {
        path.pop();
    }
    path
}

/// What a file below `src` does against the rules, one line each.
fn faults(file: &Path, source: &str, rooms: &[String]) -> Vec<String> {
    let path = module_path(file);
    let Some(room) = path.first() else { return vec![] };
    let Some(layer) = rooms.iter().position(|listed| listed == room) else {
        return vec![format!("src/{}: lib.rs does not list the room `{room}`", file.display())];
    };
    let mut faults = vec![];
    let mut fault = |line: usize, text: String| faults.push(format!("src/{}:{line}: {text}", file.display()));

    for part in path.iter().filter(|part| EMPTY_NAMES.contains(&part.as_str())) {
        fault(1, format!("`{part}` says nothing about what is inside; name the file after its main type"));
    }
    let lines = source.lines().count();
    if lines > MOST_LINES {
        fault(lines, format!("{lines} lines, more than {MOST_LINES}; look for the seam and cut there"));
    }

    let tokens = tokens(source);
    let text = |k: usize| tokens.get(k).map_or("", |token| token.text.as_str());
    let path_goes_on = |k: usize| text(k) == ":" && text(k + 1) == ":";
    let path_comes_before = |k: usize| k >= 2 && text(k - 1) == ":" && text(k - 2) == ":";
    // Brace depths at which inline modules opened: `super` inside them means less.
    let (mut depth, mut inline) = (0_usize, Vec::<usize>::new());
    for (k, Token { text: word, line }) in tokens.iter().enumerate() {
        match word.as_str() {
            "{" => {
                depth += 1;
                if k >= 2 && text(k - 2) == "mod" {
                    inline.push(depth);
                    if EMPTY_NAMES.contains(&text(k - 1)) {
                        fault(*line, format!("`mod {}` says nothing about what is inside", text(k - 1)));
                    }
                }
            }
            "}" => {
                if inline.last() == Some(&depth) {
                    inline.pop();
                }
                depth = depth.saturating_sub(1);
            }
            "crate" if path_goes_on(k + 1) => {
                if let Some(problem) = fault_of_import(room, layer, text(k + 3), rooms) {
                    fault(*line, problem);
                }
            }
            "super" if !path_comes_before(k) => {
                let mut climbs = 1;
                while path_goes_on(k + 3 * climbs - 2) && text(k + 3 * climbs) == "super" {
                    climbs += 1;
                }
                if climbs >= path.len() + inline.len() {
                    fault(*line, "`super` leaves the room: write `crate::room::…`".into());
                }
            }
            macro_name
                if PRINTING.contains(&macro_name)
                    && text(k + 1) == "!"
                    && text(k + 2) != "="
                    && room != PRINTING_ROOM =>
            {
                fault(*line, format!("`{macro_name}!` in the library: return it, or give it to an observer"));
            }
            package if path_goes_on(k + 1) && !path_comes_before(k) => {
                if let Some((_, owner)) = OWNED_PACKAGES.iter().find(|(name, _)| *name == package)
                    && room != owner
                {
                    fault(*line, format!("only the room `{owner}` uses `{package}`"));
                }
            }
            _ => {}
        }
    }
    faults
}

/// What is wrong with a path into a room `target` out of `room`, which is number `layer` of the `rooms`.
fn fault_of_import(room: &str, layer: usize, target: &str, rooms: &[String]) -> Option<String> {
    match rooms.iter().position(|listed| listed == target) {
        Some(other) if other <= layer => None,
        Some(_) => Some(format!(
            "`{room}` refers to `{target}`, which lib.rs lists below it: move what is shared \
             down into a room above `{room}`, or hand it in as an argument"
        )),
        None if target == "{" || target == "*" => {
            Some("write one `use crate::room::…` per room, so that this test sees it".into())
        }
        None => Some(format!("`crate::{target}` is no room that lib.rs lists")),
    }
}

fn source_files(folder: &Path, found: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    for entry in entries {
        let path = entry.expect("a directory entry").path();
        if path.is_dir() {
            source_files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    found.sort();
}

#[test]
fn the_house_is_in_order() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let read =
        |path: &Path| std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let rooms = rooms(&read(&src.join("lib.rs")));
    assert!(rooms.len() > 10, "found only {rooms:?} in lib.rs");
    let mut files = vec![];
    source_files(&src, &mut files);
    assert!(files.len() > rooms.len(), "found only {} files", files.len());
    let mut found = vec![];
    for file in &files {
        let inside = file.strip_prefix(&src).expect("a file below src");
        if inside != Path::new("lib.rs") && inside != Path::new("main.rs") {
            found.extend(faults(inside, &read(file), &rooms));
        }
    }
    let mut beside = vec![];
    for folder in ["solver_tests", "benchmarks", "examples"] {
        source_files(&Path::new(env!("CARGO_MANIFEST_DIR")).join(folder), &mut beside);
    }
    for file in beside {
        let lines = read(&file).lines().count();
        if lines > MOST_LINES {
            found.push(format!("{}: {lines} lines, more than {MOST_LINES}", file.display()));
        }
    }
    assert!(found.is_empty(), "{} against the house rules:\n  {}", found.len(), found.join("\n  "));
}

mod scanner {
    use super::*;

    fn faults_in(file: &str, source: &str) -> Vec<String> {
        let rooms = ["error", "geometry", "contact", "solver", "results", "cli"].map(String::from);
        faults(Path::new(file), source, &rooms)
    }

    #[track_caller]
    fn one_fault(file: &str, source: &str, says: &str) {
        let found = faults_in(file, source);
        assert!(found.len() == 1 && found[0].contains(says), "{found:?} should say {says:?} once");
    }

    #[track_caller]
    fn no_fault(file: &str, source: &str) {
        assert_eq!(faults_in(file, source), Vec::<String>::new());
    }

    #[test]
    fn reads_the_rooms_in_order() {
        let lib =
            "//! pub mod ghost;\npub mod error;\npub mod geometry;\n#[cfg(test)]\nmod tests { }\nmod cli;";
        assert_eq!(rooms(lib), ["error", "geometry", "cli"]);
    }

    #[test]
    fn downward_and_own_references_pass() {
        no_fault("contact/pair.rs", "use crate::geometry::Polyhedron;\nuse crate::contact::Gap;");
        no_fault("cli/mod.rs", "pub(crate) fn f() { crate::solver::advance(); }");
    }

    #[test]
    fn an_upward_reference_fails_with_its_line() {
        one_fault(
            "contact/pair.rs",
            "use crate::geometry::X;\n\nuse crate::solver::Y;",
            "contact/pair.rs:3: `contact`",
        );
        one_fault("geometry.rs", "fn f() -> crate::contact::Gap { }", "geometry.rs:1: ");
        one_fault("error.rs", "#[cfg(test)] mod tests { use crate::geometry::X; }", "`geometry`");
    }

    #[test]
    fn what_the_scan_cannot_follow_fails() {
        one_fault("contact/mod.rs", "use crate::{error::Error, solver::Y};", "one `use");
        one_fault("contact/mod.rs", "use crate::*;", "one `use");
        one_fault("contact/mod.rs", "use crate::Thing;", "no room");
        one_fault("contact/mod.rs", "use super::solver::Y;", "leaves the room");
        one_fault("contact/pair.rs", "use super::super::solver::Y;", "leaves the room");
        one_fault("contact/pair.rs", "mod tests { use super::super::super::solver::Y; }", "leaves the room");
        one_fault("ghost/mod.rs", "", "does not list");
    }

    #[test]
    fn super_inside_the_room_passes() {
        no_fault("contact/pair.rs", "use super::Gap;");
        no_fault("contact/mod.rs", "mod tests { use super::*; fn f() { if a { } } }");
        no_fault("contact/pair.rs", "mod tests { use super::super::Gap; }");
        // The inline module is closed again before the second one.
        one_fault("contact/mod.rs", "mod tests { use super::*; } use super::solver::Y;", "leaves the room");
    }

    #[test]
    fn comments_strings_and_characters_do_not_count() {
        no_fault(
            "error.rs",
            "//! See [`crate::solver`] and println!(\"\").\n/* crate::cli /* nested */ dbg!() */",
        );
        no_fault(
            "error.rs",
            r####"const A: &str = "crate::solver \" println!()"; const B: &[u8] = b"dbg!()";"####,
        );
        no_fault("error.rs", r####"const A: &str = r#"println!("crate::solver")"#;"####);
        // Neither a quote as a character nor a lifetime opens anything.
        one_fault(
            "error.rs",
            "const Q: char = '\"'; fn f<'a>() { println!(\"\") } const R: char = '\\'';",
            "println",
        );
    }

    #[test]
    fn printing_fails_outside_the_command_line() {
        for name in PRINTING {
            one_fault("solver/mod.rs", &format!("fn f() {{ {name}!(\"x\"); }}"), name);
            no_fault("cli/mod.rs", &format!("fn f() {{ {name}!(\"x\"); }}"));
        }
        no_fault("solver/mod.rs", "fn f(print: bool) -> bool { print != true }");
        no_fault("solver/mod.rs", "fn f() { write!(out, \"\"); }");
    }

    #[test]
    fn a_package_stays_in_its_room() {
        one_fault("solver/mod.rs", "use hdf5::File;", "only the room `results`");
        no_fault("results/mod.rs", "use hdf5::File;");
        no_fault("solver/mod.rs", "use crate::geometry::hdf5::File;");
    }

    #[test]
    fn empty_names_and_long_files_fail() {
        one_fault("solver/util.rs", "", "says nothing");
        one_fault("solver/helpers/mod.rs", "", "says nothing");
        one_fault("solver/mod.rs", "mod common { }", "says nothing");
        one_fault("solver/mod.rs", &"\n".repeat(MOST_LINES + 1), "look for the seam");
        no_fault("solver/mod.rs", &"\n".repeat(MOST_LINES));
    }
}
