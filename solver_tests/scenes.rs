//! A scene's results file holds what the scene driver found. What each case of `cases/scenes/` has to come to is judged in `ladder`.

use std::path::{Path, PathBuf};

use riprap::results::{Existing, Reader};
use riprap::simulation::{End, Observer, Options, run, scene};
use riprap::triaxial::StageEnd;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/scenes")
}

#[test]
fn results_hold_every_body() {
    let file = folder().join("push.json");
    let case = riprap::case::read(&file).and_then(|raw| raw.check()).unwrap_or_else(|e| panic!("{e}"));
    let results = tempfile::tempdir().expect("a folder");
    let path = results.path().join("push.h5");
    let mut pushes = vec![];
    let end = scene::run(&case, &folder(), |_, row| {
        pushes.push(row.bodies[1].reaction_force.x);
        true
    });
    assert_eq!(end.unwrap_or_else(|e| panic!("{e}")), StageEnd::Finished);
    struct Nobody;
    impl Observer for Nobody {}
    let raw = riprap::case::read(&file).unwrap_or_else(|e| panic!("{e}"));
    let options =
        Options { out: path.clone(), existing: Existing::Refuse, threads: 1, profile: false, audit: false };
    let outcome = run(&case, &raw, &options, &mut Nobody).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(outcome.end, End::Finished);
    let reader = Reader::open(&path).unwrap_or_else(|e| panic!("{e}"));
    let read = reader.floats("bodies/block/reaction_force").unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(read.iter().step_by(3).copied().collect::<Vec<_>>(), pushes);
    assert_eq!(reader.increments().unwrap_or_default(), 105);
    assert_eq!(reader.members("bodies").unwrap_or_default(), ["plane", "block"]);
}
