//! The shapes and meshes of a scene's bodies, from what its case says.

use std::path::Path;

use crate::case::{BodyCase, Case, GRAIN_CELLS, ShapeCase};
use crate::error::{Error, Result};
use crate::geometry::Polyhedron;
use crate::mesh::file::read_mesh;
use crate::mesh::{Mesh, NearPoint, cuboid_mesh, grain_mesh, polyhedron_mesh, sphere_mesh};
use crate::specimen::shape::lying_grain;
use crate::tensor::Vec3;

/// Cells of a polyhedron whose case gives no `mesh_size`, where it is only shown.
const CELLS: usize = 24;
/// Growth of the cells with the distance from where a mesh is refined.
const REFINED_GROWTH: f64 = 0.6;
/// The polyhedron that body number `index` is, in body coordinates; `None` for a sphere and for a mesh file.
///
/// # Errors
/// `Error::Mesh` where it has no volume, `Error::Specimen` where no grain is found.
pub fn polyhedron(case: &Case, index: usize, body: &BodyCase) -> Result<Option<Polyhedron>> {
    Ok(Some(match &body.shape {
        ShapeCase::Box(size) => Polyhedron::cuboid(*size)?,
        ShapeCase::Cylinder { radius, length, sides } => Polyhedron::cylinder(*radius, *length, *sides)?,
        ShapeCase::Polyhedron(points) => {
            let points: Vec<Vec3> = points.iter().map(|p| Vec3::from(*p)).collect();
            Polyhedron::convex_hull(&points)?
        }
        ShapeCase::Grain(sizes) => lying_grain(*sizes, case.contact.rounding, case.seed, index as u64)?,
        ShapeCase::Sphere(_) | ShapeCase::Mesh(_) => return Ok(None),
    }))
}

/// The mesh of body number `index`, which deforms. `folder` is where mesh files are relative to.
///
/// # Errors
/// `Error::Mesh` naming the body, `Error::Io` where a file cannot be read.
pub fn body_mesh(case: &Case, index: usize, body: &BodyCase, folder: &Path) -> Result<Mesh> {
    // A mesh file has its own cells.
    let size = body.cell_size().unwrap_or(f64::INFINITY);
    let named = |error| match error {
        Error::Mesh { message, .. } => Error::Mesh { name: body.name.clone(), message },
        other => other,
    };
    let made = match (&body.shape, polyhedron(case, index, body).map_err(named)?) {
        (ShapeCase::Box(edges), _) => cuboid_mesh(*edges, size),
        (ShapeCase::Sphere(radius), _) => {
            let near = body.refine.map(|refine| NearPoint {
                point: Vec3::from(refine.point),
                radius: refine.radius,
                mesh_size: refine.mesh_size,
                growth: REFINED_GROWTH,
            });
            sphere_mesh(*radius, size, near.as_ref())
        }
        (ShapeCase::Grain(_), Some(hull)) if body.mesh_size.is_none() => grain_mesh(&hull, GRAIN_CELLS),
        (ShapeCase::Mesh(file), _) => return read_mesh(&folder.join(file)),
        (ShapeCase::Grain(_) | ShapeCase::Polyhedron(_) | ShapeCase::Cylinder { .. }, hull) => hull
            .ok_or_else(|| Error::Usage(format!("{:?} has no shape", body.name)))
            .and_then(|hull| polyhedron_mesh(&hull, size)),
    };
    made.map_err(named)
}

/// A coarse mesh of body number `index` to show it by; `None` where the generator cannot mesh that.
///
/// # Errors
/// As [`body_mesh`].
pub fn shown_mesh(case: &Case, index: usize, body: &BodyCase, folder: &Path) -> Result<Option<Mesh>> {
    let made = match (&body.shape, polyhedron(case, index, body)?) {
        (ShapeCase::Mesh(file), _) => return read_mesh(&folder.join(file)).map(Some),
        (ShapeCase::Box(size), _) => cuboid_mesh(*size, size.iter().copied().fold(0.0, f64::max)),
        (ShapeCase::Sphere(radius), _) => sphere_mesh(*radius, 0.5 * radius, None),
        (ShapeCase::Polyhedron(_) | ShapeCase::Cylinder { .. } | ShapeCase::Grain(_), Some(hull)) => {
            grain_mesh(&hull, CELLS)
        }
        (ShapeCase::Polyhedron(_) | ShapeCase::Cylinder { .. } | ShapeCase::Grain(_), None) => {
            return Ok(None);
        }
    };
    // The mesh is for the eye only: a body that resists it is shown by its facets.
    Ok(made.ok())
}
