//! The pages: their lengths, their links, and that what they name is there.
//!
//! A page that grows past its limit is a notebook again. A path, a link or a heading that is named and does not exist sends a reader nowhere.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

mod case_keys;

/// Most words of a page; a word is what stands between two spaces.
const LIMITS: [(&str, usize); 8] = [
    ("README.md", 500),
    ("ARCHITECTURE.md", 1500),
    ("docs/glossary.md", 500),
    ("docs/formulation.md", 3500),
    ("docs/solver.md", 1500),
    ("docs/validity.md", 1000),
    ("cases/shuibuya/README.md", 800),
    ("docs/decisions/README.md", 300),
];
const DECISION_LIMIT: usize = 300;
const CHANGE_LIMIT: usize = 25;

/// Folders at the top that pages and comments name paths in.
const FOLDERS: [&str; 7] = ["src", "docs", "cases", "scripts", "benchmarks", "solver_tests", "examples"];

/// Texts that are not in the repository.
const ELSEWHERE: [&str; 2] = ["FORMULATION", "the founding text"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// Files with this ending below a folder, as paths from the root. Records of runs are as they were when they were made.
fn files(folder: &str, ending: &str) -> Vec<String> {
    let mut found = vec![];
    let mut folders = vec![root().join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
            let path = entry.expect("an entry").path();
            let inside = path.strip_prefix(root()).expect("below the root").to_string_lossy().into_owned();
            let hidden = inside.rsplit('/').next().is_some_and(|name| name.starts_with('.'));
            if path.is_dir() && !hidden && inside != "target" && inside != "benchmarks/runs" {
                folders.push(path);
            } else if path.is_file() && inside.ends_with(ending) {
                found.push(inside);
            }
        }
    }
    found.sort();
    found
}

fn words(text: &str) -> usize {
    text.split_whitespace().count()
}

/// Headings of a page as the ends of links to them.
fn anchors(text: &str) -> BTreeSet<String> {
    let headings = text.lines().filter(|line| line.starts_with('#'));
    let anchor = |line: &str| {
        let title = line.trim_start_matches('#').trim().to_lowercase();
        let kept = title.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
        kept.map(|c| if c == ' ' { '-' } else { c }).collect()
    };
    headings.map(anchor).collect()
}

/// Targets of Markdown's links and pictures that are not on the web.
fn links(text: &str) -> Vec<String> {
    let target = |rest: &str| rest.split([')', ' ']).next().unwrap_or_default().to_string();
    text.split("](").skip(1).map(target).filter(|link| !link.contains("://")).collect()
}

/// Paths in the repository that a text names, whether as a link or not; those with a blank to fill in, and results of runs, left out.
fn named_paths(text: &str) -> Vec<String> {
    let is_part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.' | '/');
    let mut found = vec![];
    for folder in FOLDERS {
        for (at, _) in text.match_indices(&format!("{folder}/")) {
            let before = text[..at].chars().next_back();
            if before.is_some_and(|c| is_part(c) && c != '/') || text[..at].ends_with("://") {
                continue;
            }
            // Relative to somewhere else, unless it climbs to the root.
            if before == Some('/') && !text[..at].ends_with("../") && !text[..at].ends_with(" /") {
                continue;
            }
            let length = text[at..].find(|c| !is_part(c)).unwrap_or(text.len() - at);
            let path = text[at..at + length].trim_end_matches(['.', '/', '-']);
            let next = text[at + length..].chars().next();
            let open = next.is_some_and(|c| matches!(c, '<' | '*' | '{' | '$' | '…' | '='));
            let made = path.starts_with("cases/") && path.split('/').any(|part| part == "results");
            if !open && !made {
                found.push(path.to_string());
            }
        }
    }
    found
}

/// What a page names and is not there.
fn missing(page: &str, text: &str) -> Vec<String> {
    let folder = root().join(page).parent().map(Path::to_path_buf).unwrap_or_default();
    let mut faults = vec![];
    for link in links(text) {
        let (path, anchor) =
            link.split_once('#').map_or((link.as_str(), None), |(path, anchor)| (path, Some(anchor)));
        let target: PathBuf = if path.is_empty() { root().join(page) } else { folder.join(path) };
        if !target.exists() {
            faults.push(format!("{page}: the link {link} leads nowhere"));
        } else if let Some(anchor) = anchor {
            let there = std::fs::read_to_string(&target).is_ok_and(|text| anchors(&text).contains(anchor));
            if !there {
                faults.push(format!("{page}: the link {link} names no heading of that page"));
            }
        }
    }
    let paths: BTreeSet<String> = named_paths(text).into_iter().collect();
    let absent = paths.iter().filter(|path| !root().join(path).exists());
    faults.extend(absent.map(|path| format!("{page}: {path} is not there")));
    faults
}

#[test]
fn pages_are_no_longer_than_they_may_be() {
    let mut faults = vec![];
    let mut check = |page: &str, limit: usize| {
        let count = words(&read(page));
        if count > limit {
            faults.push(format!("{page}: {count} words, more than {limit}"));
        }
    };
    LIMITS.iter().for_each(|(page, limit)| check(page, *limit));
    for page in files("docs/decisions", ".md") {
        check(&page, DECISION_LIMIT);
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn changes_are_told_in_a_line() {
    let text = read("CHANGELOG.md");
    let mut faults = vec![];
    for line in text.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
        if !line.starts_with("- ") {
            faults.push(format!("neither a heading nor an entry: {line}"));
        } else if words(&line[2..]) > CHANGE_LIMIT {
            faults.push(format!("{} words, more than {CHANGE_LIMIT}: {line}", words(&line[2..])));
        }
    }
    assert!(faults.is_empty(), "CHANGELOG.md:\n{}", faults.join("\n"));
    assert!(text.contains("## Unreleased") && text.contains("## 0.2.0"));
}

#[test]
fn every_decision_has_a_number_and_a_status() {
    let mut numbers = BTreeSet::new();
    let pages: Vec<String> =
        files("docs/decisions", ".md").into_iter().filter(|page| !page.ends_with("README.md")).collect();
    assert!(pages.len() > 40, "only {} decisions", pages.len());
    for page in pages {
        let name = page.rsplit('/').next().unwrap_or_default();
        let number = name.get(..4).and_then(|digits| digits.parse::<u32>().ok());
        let number = number.filter(|_| name[4..].starts_with('-'));
        let number = number.unwrap_or_else(|| panic!("{page}: the name is no NNNN-name.md"));
        assert!(numbers.insert(number), "{page}: the number {number} is taken");
        let text = read(&page);
        assert!(text.starts_with("# "), "{page}: begins without a title");
        assert!(text.to_lowercase().contains("status"), "{page}: no status");
    }
}

#[test]
fn what_pages_name_is_there() {
    let mut faults = vec![];
    let mut pages = files("", ".md");
    assert!(pages.len() > 50, "only {} pages", pages.len());
    pages.retain(|page| page != "CHANGELOG.md");
    for page in &pages {
        faults.extend(missing(page, &read(page)));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn comments_name_texts_that_are_there() {
    let mut faults = vec![];
    for folder in ["src", "solver_tests", "benchmarks", "examples"] {
        for file in files(folder, ".rs").into_iter().filter(|file| file != "solver_tests/pages/main.rs") {
            for (number, line) in read(&file).lines().enumerate() {
                let Some((_, comment)) = line.split_once("//") else { continue };
                let mut fault = |text: String| faults.push(format!("{file}:{}: {text}", number + 1));
                for name in ELSEWHERE.iter().filter(|name| comment.contains(**name)) {
                    fault(format!("{name} is not in the repository"));
                }
                if comment.contains("ARCHITECTURE.md,") || comment.contains("ARCHITECTURE,") {
                    fault("name the page or decision itself: ARCHITECTURE.md has no such section".into());
                }
                let absent = |path: &&String| !root().join(path).exists();
                named_paths(comment)
                    .iter()
                    .filter(absent)
                    .for_each(|path| fault(format!("{path} is not there")));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// The keys in `docs/case_file.md` are those of the reader's own table.
#[test]
fn case_file_page_has_every_key() {
    const PAGE: &str = "docs/case_file.md";
    const MARK: &str = "<!-- Below: written by RIPRAP_REWRITE=1 cargo test --release --test pages -->\n";
    let text = read(PAGE);
    let (head, below) = text.split_once(MARK).unwrap_or_else(|| panic!("{PAGE}: no line {MARK}"));
    let current = case_keys::tables(&riprap::case::schema());
    if below != current && std::env::var_os("RIPRAP_REWRITE").is_some() {
        std::fs::write(root().join(PAGE), format!("{head}{MARK}{current}")).expect("written");
        return;
    }
    assert!(below == current, "{PAGE} is stale: run this test with RIPRAP_REWRITE=1");
    for key in ["void_ratio", "recovery_in_compression", "drop_after_peak", "restart_every", "gent_limit"] {
        assert!(current.contains(&format!("| `{key}` |")), "{key}");
    }
}

/// A format is read or written if a test says so: each that the table names is there.
#[test]
fn every_format_has_its_test() {
    let sources: String =
        ["src", "solver_tests"].iter().flat_map(|folder| files(folder, ".rs")).map(|f| read(&f)).collect();
    let page = read("docs/install.md");
    let (_, tables) = page.split_once("## Formats").expect("the tables");
    let (tables, _) = tables.split_once("\n## ").expect("their end");
    let rows: Vec<&str> =
        tables.lines().filter(|line| line.starts_with("| ") && line.contains('`')).collect();
    assert!(rows.len() > 10, "only {} formats", rows.len());
    for row in rows {
        let cell = row.trim_end_matches([' ', '|']).rsplit(" | ").next().unwrap_or_default();
        let tests: Vec<&str> = cell.split('`').skip(1).step_by(2).collect();
        assert!(!tests.is_empty(), "no test: {row}");
        for test in tests {
            assert!(sources.contains(&format!("fn {test}()")), "there is no test {test}");
        }
    }
}

/// Windows runs no shell scripts: its targets have a cmake of their own, by the names that the crate `cmake` looks for first.
#[test]
fn windows_is_not_sent_to_a_shell_script() {
    let config = read(".cargo/config.toml");
    let value = |name: &str| {
        let mut lines = config.lines().filter_map(|line| line.split_once('='));
        lines.find(|(key, _)| key.trim() == name).map(|(_, value)| value.trim().to_string())
    };
    assert!(value("CMAKE").is_some_and(|value| value.contains("scripts/cmake")), "{config}");
    assert!(read("scripts/cmake").starts_with("#!/bin/sh"));
    for target in ["x86_64-pc-windows-msvc", "aarch64-pc-windows-msvc", "x86_64-pc-windows-gnu"] {
        let name = format!("CMAKE_{}", target.replace('-', "_"));
        assert_eq!(value(&name).as_deref(), Some("\"cmake\""), "{name}");
    }
}

/// The case in the first tutorial is the file that its commands run.
#[test]
fn tutorial_shows_the_case_that_it_runs() {
    let page = read("docs/tutorials/lab_sheet.md");
    let shown =
        page.split("```jsonc\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a block of jsonc");
    let parse =
        |text: &str| riprap::case::RawCase::parse(Path::new("shown"), text).unwrap_or_else(|e| panic!("{e}"));
    let check = |text: &str| parse(text).check().unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(check(shown), check(&read("cases/tutorials/lab_sheet.json")));
}

/// What the tutorials tell to type runs.
#[test]
#[ignore = "takes minutes: scripts/release.sh runs it"]
fn tutorials_run_as_they_tell() {
    let found = Command::new(root().join("scripts/python_env")).output().expect("a Python");
    let python = String::from_utf8(found.stdout).expect("a path");
    let mut typing = Command::new(python.trim());
    typing.arg(root().join("scripts/try_tutorials.py")).arg(env!("CARGO_BIN_EXE_riprap"));
    assert!(typing.status().expect("started").success());
}

mod scanner {
    use super::*;

    #[test]
    fn a_link_that_leads_nowhere_is_found() {
        assert_eq!(
            missing("README.md", "[a](docs/solver.md) [b](https://example.org/no)"),
            Vec::<String>::new()
        );
        assert_eq!(missing("README.md", "[a](docs/nothing.md)").len(), 2);
        assert_eq!(missing("docs/solver.md", "[a](../nothing.md)").len(), 1);
        assert_eq!(missing("README.md", "[a](docs/results_file.md#history)"), Vec::<String>::new());
        assert_eq!(missing("README.md", "[a](docs/results_file.md#no-such-thing)").len(), 1);
    }

    #[test]
    fn a_path_that_is_named_and_not_there_is_found() {
        assert_eq!(
            missing("README.md", "see `src/lib.rs`, and `src/lip.rs`."),
            ["README.md: src/lip.rs is not there"]
        );
        assert_eq!(
            named_paths("into cases/results/a.h5, solver_tests/verification/<problem>.rs, my_src/a"),
            Vec::<String>::new()
        );
        assert_eq!(named_paths("(`../src/model/mod.rs`)."), ["src/model/mod.rs"]);
    }

    #[test]
    fn headings_are_anchors() {
        assert!(anchors("# A\n## Status and exit codes\n").contains("status-and-exit-codes"));
    }
}
