//! No files import each other in a circle.
//!
//! A name that a file passes on (`pub use`) counts as imported from where it is defined. Tests do not count.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::{Token, module_path, source_files, tokens};

/// One name that a file imports.
#[derive(Debug)]
struct Import {
    path: Vec<String>,
    /// What the file calls it; `*` for all of a module.
    name: String,
    /// Whether others may import it from here.
    passed_on: bool,
}

/// A file as the search for circles sees it, tests left out.
struct Source {
    imports: Vec<Import>,
    /// Every path outside imports.
    paths: Vec<Vec<String>>,
    /// Every word outside imports.
    words: BTreeSet<String>,
}

impl Source {
    fn read(text: &str) -> Self {
        let tokens = without_tests(tokens(text));
        let text = |k: usize| tokens.get(k).map_or("", |token| token.text.as_str());
        let mut source = Source { imports: vec![], paths: vec![], words: BTreeSet::new() };
        let mut k = 0;
        while k < tokens.len() {
            if text(k) == "use" && text(k + 1) != "<" {
                let passed_on = k > 0 && matches!(text(k - 1), "pub" | ")");
                k = source.read_import(&tokens, k + 1, &[], passed_on);
                continue;
            }
            let mut path = vec![text(k).to_string()];
            while text(k + 1) == ":" && text(k + 2) == ":" && is_name(text(k + 3)) {
                k += 3;
                path.push(text(k).to_string());
            }
            source.words.extend(path.iter().cloned());
            source.paths.push(path);
            k += 1;
        }
        source.paths.retain(|path| path.len() > 1);
        source
    }

    /// Reads the tree of an import from token `k` on, behind `before`. Returns the token behind it.
    fn read_import(&mut self, tokens: &[Token], mut k: usize, before: &[String], passed_on: bool) -> usize {
        let text = |k: usize| tokens.get(k).map_or("", |token| token.text.as_str());
        let mut path = before.to_vec();
        loop {
            match text(k) {
                "{" => {
                    k += 1;
                    while !matches!(text(k), "}" | "") {
                        k = self.read_import(tokens, k, &path, passed_on);
                        k += usize::from(text(k) == ",");
                    }
                    return k + 1;
                }
                "self" if !path.is_empty() => {}
                word => path.push(word.to_string()),
            }
            k += 1;
            if text(k) != ":" {
                break;
            }
            k += 2;
        }
        let mut name = path.last().cloned().unwrap_or_default();
        if text(k) == "as" {
            name = text(k + 1).to_string();
            k += 2;
        }
        self.imports.push(Import { path, name, passed_on });
        k
    }
}

fn is_name(word: &str) -> bool {
    word.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// The tokens but those of inline modules for tests.
fn without_tests(tokens: Vec<Token>) -> Vec<Token> {
    let test: Vec<&str> = "# [ cfg ( test ) ] mod".split(' ').collect();
    let is_test = |k: usize| {
        let found = tokens.get(k..k + test.len());
        let body = tokens.get(k + test.len() + 1).is_some_and(|token| token.text == "{");
        body && found.is_some_and(|found| found.iter().zip(&test).all(|(token, word)| token.text == **word))
    };
    let (mut kept, mut k) = (vec![], 0);
    while k < tokens.len() {
        if !is_test(k) {
            kept.push(tokens[k].clone());
            k += 1;
            continue;
        }
        k += test.len() + 2;
        let mut depth = 1;
        while depth > 0 && k < tokens.len() {
            depth += i32::from(tokens[k].text == "{") - i32::from(tokens[k].text == "}");
            k += 1;
        }
    }
    kept
}

/// The files of the house by their module paths.
struct House(BTreeMap<Vec<String>, (String, Source)>);

impl House {
    fn new(files: impl Iterator<Item = (PathBuf, String)>) -> Self {
        let read = |(file, text): (PathBuf, String)| {
            (module_path(&file), (file.display().to_string(), Source::read(&text)))
        };
        House(files.map(read).collect())
    }

    /// The module that a path in module `from` leads to, through what modules pass on.
    fn target(&self, from: &[String], path: &[String]) -> Option<Vec<String>> {
        let (first, mut rest) = path.split_first()?;
        let mut at = match first.as_str() {
            "crate" => vec![],
            "self" => from.to_vec(),
            "super" => from[..from.len().checked_sub(1)?].to_vec(),
            child => {
                Some([from, &[child.to_string()]].concat()).filter(|child| self.0.contains_key(child))?
            }
        };
        while let Some((word, behind)) = rest.split_first() {
            let inner = [&at[..], std::slice::from_ref(word)].concat();
            if word == "super" {
                at.pop()?;
            } else if self.0.contains_key(&inner) {
                at = inner;
            } else {
                let (_, source) = self.0.get(&at)?;
                let passed = source.imports.iter().find(|import| import.name == *word);
                return match passed {
                    Some(import) if import.path != *path => {
                        self.target(&at, &[&import.path[..], behind].concat()).or(Some(at))
                    }
                    _ => Some(at),
                };
            }
            rest = behind;
        }
        Some(at)
    }

    /// The modules that a module needs.
    fn needs(&self, module: &[String], source: &Source) -> BTreeSet<Vec<String>> {
        let counts = |import: &&Import| !import.passed_on || source.words.contains(&import.name);
        let imports = source.imports.iter().filter(counts).map(|import| &import.path);
        let mut needs: BTreeSet<_> =
            imports.chain(&source.paths).filter_map(|path| self.target(module, path)).collect();
        needs.remove(module);
        needs
    }

    /// Files that reach each other by imports, each group and all groups in alphabetic order.
    fn circles(&self) -> Vec<Vec<String>> {
        let needs: BTreeMap<_, _> =
            self.0.iter().map(|(module, (_, source))| (module, self.needs(module, source))).collect();
        let reach = |start: &Vec<String>| {
            let (mut seen, mut open) = (BTreeSet::new(), vec![start]);
            while let Some(next) = open.pop() {
                let ahead = needs.get(next).into_iter().flatten();
                open.extend(ahead.filter(|module| seen.insert((*module).clone())));
            }
            seen
        };
        let reached: BTreeMap<_, _> = needs.keys().map(|module| (*module, reach(module))).collect();
        let name = |module: &Vec<String>| self.0[module].0.clone();
        let circle = |(module, ahead): (&&Vec<String>, &BTreeSet<Vec<String>>)| -> Vec<String> {
            let back = |other: &&Vec<String>| reached.get(*other).is_some_and(|seen| seen.contains(*module));
            let mut files: Vec<String> = ahead.iter().filter(back).map(name).collect();
            files.sort();
            files
        };
        let found: BTreeSet<_> = reached.iter().map(circle).filter(|files| files.len() > 1).collect();
        found.into_iter().collect()
    }
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = vec![];
    source_files(&src, &mut files);
    let read = |file: PathBuf| {
        let text = std::fs::read_to_string(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        (file.strip_prefix(&src).expect("a file below src").to_path_buf(), text)
    };
    let outer = |file: &PathBuf| !file.ends_with("lib.rs") && !file.ends_with("main.rs");
    let found = House::new(files.into_iter().filter(outer).map(read)).circles();
    let lines: String = found.iter().map(|files| format!("\n  {files:?}")).collect();
    assert!(found.is_empty(), "circles:{lines}");
}

mod scanner {
    use super::*;

    fn circles_of(files: &[(&str, &str)]) -> Vec<Vec<String>> {
        House::new(files.iter().map(|(file, text)| (PathBuf::from(file), text.to_string()))).circles()
    }

    #[test]
    fn files_that_reach_each_other_are_a_circle() {
        let one_way =
            [("a/mod.rs", "mod b; mod c;"), ("a/b.rs", "use super::c::C;"), ("a/c.rs", "struct C;")];
        assert!(circles_of(&one_way).is_empty());
        let back = ("a/c.rs", "fn f() -> super::d::D { }");
        let there = ("a/d.rs", "use crate::a::b;");
        assert_eq!(circles_of(&[one_way[0], one_way[1], back, there]), [["a/b.rs", "a/c.rs", "a/d.rs"]]);
    }

    #[test]
    fn what_a_file_passes_on_is_imported_from_where_it_is_defined() {
        let child = ("a/b.rs", "use super::{D as E, other::F};");
        let front = "mod b; mod c; pub use c::{C as D}; pub use b::B;";
        assert!(circles_of(&[("a/mod.rs", front), child, ("a/c.rs", "")]).is_empty());
        assert_eq!(circles_of(&[("a/mod.rs", front), child, ("a/c.rs", "use crate::a::B;")]).len(), 1);
        // Here it needs what it passes on, and the child needs what it defines.
        let needing = "mod b; pub use b::B; struct D(B);";
        assert_eq!(circles_of(&[("a/mod.rs", needing), child]), [["a/b.rs", "a/mod.rs"]]);
        let calling = "mod b; struct D; fn f() { b::g() }";
        assert_eq!(circles_of(&[("a.rs", calling), child]), [["a.rs", "a/b.rs"]]);
    }

    #[test]
    fn tests_make_no_circle() {
        let tested = "#[cfg(test)] mod tests { use super::*; use crate::a::c::C; fn f() { } } fn g() {}";
        assert!(circles_of(&[("a/b.rs", tested), ("a/c.rs", "use super::b::g;")]).is_empty());
        let behind = format!("{tested} use super::c::C;");
        assert_eq!(circles_of(&[("a/b.rs", &behind), ("a/c.rs", "use super::b::g;")]).len(), 1);
    }
}
