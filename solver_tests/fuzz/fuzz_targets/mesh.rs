//! A mesh file of any kind: the first byte says which.
#![no_main]

use libfuzzer_sys::fuzz_target;
use riprap::mesh::file::read_mesh;
use riprap::mesh::formats::read_points;

fuzz_target!(|bytes: &[u8]| {
    let Some((kind, content)) = bytes.split_first() else { return };
    let ending = ["vtu", "msh", "stl", "obj", "ply"][usize::from(*kind) % 5];
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join(format!("body.{ending}"));
    std::fs::write(&file, content).expect("a file");
    if let Ok(mesh) = read_mesh(&file) {
        assert!(mesh.volume().is_finite());
    }
    let _ = read_points(&file);
});
