//! Tells the program which commit its sources are of, as `RIPRAP_COMMIT`: the last one that touched them, with
//! `+changes` where they differ from it. Warns where cmake is missing or too old for the HDF5 that is built along.
//!
//! Runs again only when sources change, when they are compiled anew in any case: a commit of something else rebuilds
//! nothing. A `RIPRAP_COMMIT` in the environment (a packager's) goes before; outside a git checkout there is none.

use std::path::Path;
use std::process::Command;

const SOURCES: [&str; 4] = ["src", "build.rs", "Cargo.toml", "Cargo.lock"];

/// The oldest cmake that builds the bundled HDF5.
const CMAKE: [u32; 2] = [3, 26];

fn main() {
    check_cmake();
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

/// Warns of a cmake that will not do. In the checkout `.cargo/config.toml` names one that will, for Windows the one on the PATH; a build from another
/// folder does not see that file. Cargo runs this beside the builds of the dependencies, so all that can be done here is to say what to do.
fn check_cmake() {
    // The builds of dependencies look for these in this order.
    let of_target = format!("CMAKE_{}", std::env::var("TARGET").unwrap_or_default().replace('-', "_"));
    for name in [of_target.as_str(), "CMAKE"] {
        println!("cargo::rerun-if-env-changed={name}");
    }
    let named = std::env::var_os(&of_target);
    if named.is_none() && std::env::var_os("CMAKE").is_some() {
        return;
    }
    let program = named.unwrap_or_else(|| "cmake".into());
    let found = Command::new(program).arg("--version").output().ok().filter(|output| output.status.success());
    let version = found.and_then(|output| version_in(&String::from_utf8_lossy(&output.stdout)));
    if version.is_some_and(|version| version >= CMAKE) {
        return;
    }
    let found =
        version.map_or("none was found".to_string(), |[major, minor]| format!("{major}.{minor} was found"));
    println!(
        "cargo::warning=HDF5 is built along and needs cmake {}.{} or newer; {found}. Ways out: `pip install 'cmake>=3.26'`, or build in riprap's own \
         folder, where scripts/cmake gets one (not on Windows), or set {of_target} to the path of one (docs/install.md)",
        CMAKE[0], CMAKE[1]
    );
}

/// The numbers in `cmake version 3.31.6`.
fn version_in(text: &str) -> Option<[u32; 2]> {
    let mut numbers = text.split_whitespace().nth(2)?.split('.').map(|part| part.parse().ok());
    Some([numbers.next()??, numbers.next()??])
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
