//! Shape quality of tetrahedra: radius ratio and dihedral angles.
//!
//! The radius ratio is `3 r / R` (inscribed over circumscribed sphere): 1 for the regular
//! tetrahedron, 0 for a flat one. Source: Shewchuk (2002), "What is a good linear finite element?",
//! Table 2.

use crate::mesh::tet10::Mesh;
use crate::tensor::Vec3;

/// Shape of one tetrahedron.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellQuality {
    /// `3 r / R`, in 0..=1; negative volume gives -1.
    pub radius_ratio: f64,
    /// Smallest angle between two facets [rad].
    pub smallest_dihedral: f64,
    /// Largest angle between two facets [rad].
    pub largest_dihedral: f64,
}

/// Shape of the worst cells of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QualityReport {
    pub cells: usize,
    pub nodes: usize,
    pub worst_radius_ratio: f64,
    pub mean_radius_ratio: f64,
    /// [rad]
    pub smallest_dihedral: f64,
    /// [rad]
    pub largest_dihedral: f64,
}

impl CellQuality {
    pub fn of(corners: &[Vec3; 4]) -> Self {
        let [a, b, c, d] = corners;
        let outward = [
            (c - b).cross(&(d - b)),
            (d - a).cross(&(c - a)),
            (b - a).cross(&(d - a)),
            (c - a).cross(&(b - a)),
        ];
        let (mut smallest, mut largest) = (std::f64::consts::PI, 0.0_f64);
        for i in 0..4 {
            for j in 0..i {
                let angle = std::f64::consts::PI - outward[i].angle(&outward[j]);
                smallest = smallest.min(angle);
                largest = largest.max(angle);
            }
        }
        CellQuality {
            radius_ratio: radius_ratio(corners),
            smallest_dihedral: smallest,
            largest_dihedral: largest,
        }
    }
}

impl QualityReport {
    pub fn of(mesh: &Mesh) -> Self {
        let mut report = QualityReport {
            cells: mesh.cells.len(),
            nodes: mesh.nodes.len(),
            worst_radius_ratio: 1.0,
            mean_radius_ratio: 0.0,
            smallest_dihedral: std::f64::consts::PI,
            largest_dihedral: 0.0,
        };
        for cell in mesh.cell_ids() {
            let quality = CellQuality::of(&mesh.corners(cell));
            report.worst_radius_ratio = report.worst_radius_ratio.min(quality.radius_ratio);
            report.mean_radius_ratio += quality.radius_ratio / mesh.cells.len() as f64;
            report.smallest_dihedral = report.smallest_dihedral.min(quality.smallest_dihedral);
            report.largest_dihedral = report.largest_dihedral.max(quality.largest_dihedral);
        }
        report
    }
}

/// `3 r / R` of a tetrahedron; -1 where its volume is not positive (or not a number).
pub fn radius_ratio([a, b, c, d]: &[Vec3; 4]) -> f64 {
    let (u, v, w) = (b - a, c - a, d - a);
    let (vw, wu, uv) = (v.cross(&w), w.cross(&u), u.cross(&v));
    let six_volumes = u.dot(&vw);
    if six_volumes <= 0.0 || six_volumes.is_nan() {
        return -1.0;
    }
    // r = 3 V / S; R = |u^2 (v x w) + v^2 (w x u) + w^2 (u x v)| / (12 V).
    let twice_surface = vw.norm() + wu.norm() + uv.norm() + (v - u).cross(&(w - u)).norm();
    let inscribed = six_volumes / twice_surface;
    let circumscribed =
        (vw * u.norm_squared() + wu * v.norm_squared() + uv * w.norm_squared()).norm() / (2.0 * six_volumes);
    3.0 * inscribed / circumscribed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regular_and_corner_tetrahedra() {
        let p = |x: f64, y: f64, z: f64| Vec3::new(x, y, z);
        let regular = [p(1., 1., 1.), p(-1., 1., -1.), p(1., -1., -1.), p(-1., -1., 1.)];
        let quality = CellQuality::of(&regular);
        assert!((quality.radius_ratio - 1.0).abs() < 1e-14, "{quality:?}");
        assert!((quality.smallest_dihedral - (1.0_f64 / 3.0).acos()).abs() < 1e-14);
        assert!((quality.largest_dihedral - (1.0_f64 / 3.0).acos()).abs() < 1e-14);
        // Corner of a cube: r = 1/(3 + sqrt 3), R = sqrt(3)/2.
        let corner = [p(0., 0., 0.), p(1., 0., 0.), p(0., 1., 0.), p(0., 0., 1.)];
        let quality = CellQuality::of(&corner);
        assert!((quality.radius_ratio - 6.0 / (3.0_f64.sqrt() * (3.0 + 3.0_f64.sqrt()))).abs() < 1e-14);
        assert!((quality.largest_dihedral - std::f64::consts::FRAC_PI_2).abs() < 1e-14);
        let [a, b, c, d] = corner;
        assert_eq!(radius_ratio(&[a, c, b, d]), -1.0);
    }
}
