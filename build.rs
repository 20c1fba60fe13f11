//! Tells the program which commit its sources are of, as `RIPRAP_COMMIT`: the last one that touched them, with
//! `+changes` where they differ from it.
//!
//! Runs again only when sources change, when they are compiled anew in any case: a commit of something else rebuilds
//! nothing. A `RIPRAP_COMMIT` in the environment (a packager's) goes before; outside a git checkout there is none.

use std::path::Path;
use std::process::Command;

const SOURCES: [&str; 4] = ["src", "build.rs", "Cargo.toml", "Cargo.lock"];

fn main() {
    for source in SOURCES {
        println!("cargo::rerun-if-changed={source}");
    }
    println!("cargo::rerun-if-env-changed=RIPRAP_COMMIT");
    if std::env::var_os("RIPRAP_COMMIT").is_some() {
        return;
    }
    if let Some(commit) = commit() {
        println!("cargo::rustc-env=RIPRAP_COMMIT={commit}");
    }
}

fn commit() -> Option<String> {
    let here = std::env::var_os("CARGO_MANIFEST_DIR")?;
    let top = git(&["rev-parse", "--show-toplevel"])?;
    // A copy of the sources inside another project's checkout is not of that project's commits.
    if Path::new(&here).canonicalize().ok()? != Path::new(&top).canonicalize().ok()? {
        return None;
    }
    let commit = git(&[&["log", "-1", "--format=%h", "--abbrev=12", "--"], &SOURCES[..]].concat())?;
    let changed = git(&[&["status", "--porcelain", "--"], &SOURCES[..]].concat())?;
    match (commit.is_empty(), changed.is_empty()) {
        (true, _) => None,
        (false, true) => Some(commit),
        (false, false) => Some(format!("{commit}+changes")),
    }
}

/// What git says; `None` where it is missing or unhappy.
fn git(arguments: &[&str]) -> Option<String> {
    // Without this, `status` would write to the index, under the feet of whoever works in the checkout.
    let output = Command::new("git").env("GIT_OPTIONAL_LOCKS", "0").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_string())
}
