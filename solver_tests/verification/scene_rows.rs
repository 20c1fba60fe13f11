//! The scene of a case, and the rows of its run.

use std::path::Path;

use riprap::case::Case;
use riprap::loading::StageEnd;
use riprap::scene::{Row, Scene};
use riprap::setup::scene_parameters;

pub fn scene(case: &Case) -> Scene {
    Scene::new(&scene_parameters(case, Path::new("")).expect("parameters")).expect("a sound scene")
}

/// All rows, or as many as `most`.
pub fn rows(scene: &mut Scene, most: usize) -> (Vec<Row>, StageEnd) {
    let mut rows = Vec::new();
    let end = scene.run(|_, row| {
        rows.push(row.clone());
        rows.len() < most
    });
    (rows, end)
}
