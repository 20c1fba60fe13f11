//! Two cubes, one turned on the other, between a fixed plate and a driven one: what the tests of fidelities press and push.

use riprap::material::Elastic;
use riprap::mesh::{Mesh, cuboid_mesh};
use riprap::scene::{SceneBody, SceneParameters};
use riprap::verification::bodies::{HELD, body, cuboid, drive, fixed, load, scene};

/// [m]
pub const EDGE: f64 = 0.03;

/// The mesh of a cube, and the rock of its cells.
pub fn meshed() -> (Mesh, Vec<Elastic>) {
    let mesh = cuboid_mesh([EDGE; 3], 0.5 * EDGE).expect("a mesh");
    let rock = vec![Elastic::new(30e9, 0.2).expect("allowed"); mesh.cells.len()];
    (mesh, rock)
}

/// The scene: bodies 1 and 2 are the cubes, given their fidelity by `made`, body 3 is the plate that goes by `way` [m].
pub fn between_plates(
    friction: f64,
    increments: usize,
    way: [f64; 3],
    made: impl Fn(SceneBody) -> SceneBody,
) -> SceneParameters {
    let cube = |name, z: f64, turn: f64| made(body(name, cuboid([EDGE; 3]), [0.0, 0.0, z], [0.0, 0.0, turn]));
    let plate = |name, z: f64| body(name, cuboid([0.1, 0.1, 0.02]), [0.0, 0.0, z], [0.0, 0.0, 0.2]);
    let bodies = vec![
        fixed(plate("bottom", -0.01)),
        cube("lower", 0.5 * EDGE, 0.1),
        cube("upper", 1.5 * EDGE, 0.6),
        plate("top", 2.0 * EDGE + 0.01),
    ];
    scene(bodies, friction, vec![load(increments, "top", drive(way.map(Some), HELD))])
}
