//! Which faces of a body share patches with others'.
//!
//! Of a part of a body those that lie in faces of the whole: these are faces of the rock. The other faces of its shape span what a crack
//! has left, which others meet at its corners and edges.

use crate::contact::face::{FLAT, Face};
use crate::contact::search::ContactShape;
use crate::tensor::Vec3;

/// A part's face lies in one of the whole's to this (angle in rad). Both are means of facets within [`FLAT`] of a plane, but not of the same ones.
const SAME_NORMAL: f64 = 1e-4;

impl ContactShape {
    /// Has all its faces share patches.
    #[must_use]
    pub fn faced(mut self) -> Self {
        self.faces = Face::of(&self.rounded);
        self
    }

    /// Has those of its faces share patches that lie in ones of `whole` which do; the frame of `whole` lies off its own by `offset` [m].
    #[must_use]
    pub fn faced_as(mut self, whole: &ContactShape, offset: &Vec3) -> Self {
        let reach = 4.0 * FLAT * whole.bounding_radius;
        let lies_in = |own: &Face, face: &Face| {
            let away = face.normal.dot(&(own.ring[0] + offset - face.ring[0]));
            (own.normal - face.normal).norm() < SAME_NORMAL && away.abs() < reach
        };
        let of_rock = |own: &Face| whole.faces.iter().any(|face| lies_in(own, face));
        self.faces = Face::of(&self.rounded).into_iter().filter(of_rock).collect();
        self
    }

    /// Which of its faces share patches; empty where none does.
    pub fn patched(&self) -> Vec<bool> {
        match self.faces.is_empty() {
            true => Vec::new(),
            false => Face::of(&self.rounded).iter().map(|face| self.faces.contains(face)).collect(),
        }
    }

    /// Has these of its faces share patches ([`Self::patched`]).
    #[must_use]
    pub fn with_patched(mut self, patched: &[bool]) -> Self {
        if !patched.is_empty() {
            let all = Face::of(&self.rounded).into_iter().zip(patched);
            self.faces = all.filter_map(|(face, is_patched)| is_patched.then_some(face)).collect();
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rounded::{HalfSpace, facet_planes, intersection};
    use crate::geometry::{Polyhedron, RoundedBody};
    use crate::tensor::Rotation;

    const ROUNDING: f64 = 1e-3;

    fn shape(nominal: &Polyhedron) -> ContactShape {
        ContactShape::new(RoundedBody::inset(nominal, ROUNDING).expect("fits"))
    }

    /// A box cut askew, and along its top a little below that: four of the six faces are the box's.
    #[test]
    fn a_part_has_the_faces_of_the_whole_but_not_those_of_its_crack() {
        let whole = Polyhedron::cuboid([0.04, 0.03, 0.02]).expect("a box");
        let askew = HalfSpace { normal: Vec3::new(1.0, 0.3, 0.2).normalize(), offset: 2e-3 };
        let lower = HalfSpace { normal: Vec3::z(), offset: 9.9e-3 };
        let nominal =
            intersection(&whole, &[vec![askew, lower], facet_planes(&whole)].concat()).expect("a part");
        let offset = Vec3::new(-7e-3, 1e-3, 2e-3);
        let whole = shape(&whole).faced();
        let part = shape(&nominal.translated(&-offset)).faced_as(&whole, &offset);
        assert_eq!(whole.faces.len(), 6);
        let has = |normal: Vec3| part.faces.iter().any(|face| (face.normal - normal).norm() < 1e-9);
        for normal in [-Vec3::x(), Vec3::y(), -Vec3::y(), -Vec3::z()] {
            assert!(has(normal), "{normal}");
        }
        assert_eq!(part.faces.len(), 4);
        assert_eq!(part.patched().len(), 6);
        assert_eq!(ContactShape::new(part.rounded.clone()).with_patched(&part.patched()), part);
        // Planes of files with few digits are means over facets, and a part has other ones.
        let lean = Rotation::from_scaled_axis(Vec3::new(5e-6, 5e-6, 0.0));
        let leaning = nominal.vertices.iter().map(|vertex| lean * vertex).collect();
        let leaning = Polyhedron::from_facets(leaning, nominal.facets.clone()).expect("a part");
        let leaning = shape(&leaning.translated(&-offset)).faced_as(&whole, &offset);
        assert_eq!(leaning.faces.len(), 4);
        // A body whose faces carry by corners has parts that do.
        let blunt = ContactShape { faces: Vec::new(), ..whole };
        let of_blunt = part.faced_as(&blunt, &offset);
        assert!(of_blunt.faces.is_empty() && of_blunt.patched().is_empty());
    }
}
