//! Patches of parallel faces among the contacts of a pair of bodies; see [`crate::contact::face`].

use crate::assembly::ContactPoint;
use crate::contact::face::{flat_share, look_at_each_other, may_face};
use crate::contact::force::{self, Kinematics, SitePoints, Tangent};
use crate::contact::memory::{PairKey, PairMemory};
use crate::contact::mortar::{MortarNode, SLID};
use crate::contact::patch::{self, FacesInSpace};
use crate::contact::search::PairFeatures;
use crate::contact::{ContactShape, Face, Feature, Mortar, Site};
use crate::grain::Surface;
use crate::model::Model;
use crate::tensor::{Pose, Vec3};

/// Two faces that are parallel enough to share a patch.
#[derive(Debug, Clone)]
pub(super) struct Facing<'a> {
    pub numbers: (u32, u32),
    faces: [&'a Face; 2],
    /// Outwards, in space.
    pub normals: [Vec3; 2],
    /// Of half the angles of their cones.
    pub cosines: [f64; 2],
    /// How much of their patch is flat on both sides; not zero.
    pub g: f64,
}

/// All of a pair of bodies at these poses.
pub(super) fn facings<'a>(model: &'a Model, features: &PairFeatures, poses: [&Pose; 2]) -> Vec<Facing<'a>> {
    let shapes = [&model.shapes[features.a as usize], &model.shapes[features.b as usize]];
    let facing = |&(i, j): &(u32, u32)| {
        let faces = [&shapes[0].faces[i as usize], &shapes[1].faces[j as usize]];
        let normals = [poses[0].rotation * faces[0].normal, poses[1].rotation * faces[1].normal];
        let cosines = faces.map(|face| face.cosine);
        let face = may_face(&normals[0], &normals[1], 0.0) && look_at_each_other(faces, poses);
        let g = if face { flat_share(faces, poses) } else { 0.0 };
        (g > 0.0).then_some(Facing { numbers: (i, j), faces, normals, cosines, g })
    };
    features.faces().iter().filter_map(facing).collect()
}

/// The faces whose patch takes over from a contact of other features.
pub(super) fn of_contact<'a, 'b>(
    facings: &'b [Facing<'a>],
    site: &Site,
    sites: &SitePoints,
) -> Option<&'b Facing<'a>> {
    if facings.is_empty() {
        return None;
    }
    let (_, normal) = force::place(site, sites, 0.0);
    let within = |facing: &&Facing<'_>| {
        normal.dot(&facing.normals[0]) > facing.cosines[0]
            && -normal.dot(&facing.normals[1]) > facing.cosines[1]
    };
    facings.iter().find(within)
}

impl<'a> Facing<'a> {
    /// A point of the patch: one of the second body against the first one's plane.
    pub fn site(&self, point: u32) -> Site {
        let feature = Feature::Faces(self.numbers.0, self.numbers.1, point);
        Site { feature, on_a: [0; 3], on_b: [0; 3], count_a: 3, count_b: 1 }
    }

    pub fn mortar(&self, poses: [&Pose; 2], surfaces: [Option<&Surface>; 2]) -> Mortar {
        Mortar::new(self.numbers, self.faces, poses, surfaces)
    }

    /// Where a node of the patch is on the cores of the bodies.
    pub fn sites(&self, poses: [&Pose; 2], node: &MortarNode, shapes: [&ContactShape; 2]) -> SitePoints {
        let [first, second] = self.faces;
        let [inner, outer] = [0, 1].map(|side| shapes[side].rounded.radius);
        let span = first.area.sqrt();
        let corner = first.ring[0] - first.normal * inner;
        let a = [corner, corner + first.axes[0] * span, corner + first.axes[1] * span];
        let b = second.point(node.at) - second.normal * outer;
        SitePoints {
            a: a.map(|p| poses[0].to_space(&p)),
            b: [poses[1].to_space(&b); 3],
            normals: self.normals,
        }
    }

    pub fn in_space(&self, poses: [&Pose; 2]) -> FacesInSpace<'a> {
        FacesInSpace::new(self.faces, poses, self.g)
    }
}

/// Appends the tangents of the patches among `points`, which are in the order of their pairs of faces behind all others, of rigid bodies.
pub(super) fn patch_tangents_into(
    tangents: &mut Vec<Tangent>,
    model: &Model,
    features: &PairFeatures,
    points: &[ContactPoint],
    poses: [&Pose; 2],
    kinematics: [&Kinematics; 2],
) {
    let law = model.law.of_patches();
    for facing in facings(model, features, poses) {
        let first = points.iter().position(|p| p.site.feature == facing.site(0).feature);
        let Some(own) = first.and_then(|first| points.get(first..first + patch::POINTS)) else { continue };
        let states = std::array::from_fn(|k| own[k].state);
        if let Some(of_patch) = patch::tangents(&law, &facing.in_space(poses), kinematics, &states) {
            tangents.extend(of_patch);
        }
    }
}

/// Finds the nodes of meshed patches anew whose faces have slid, with what they remember.
pub(super) fn renew_mortars(memory: &mut PairMemory, model: &Model, (a, b): PairKey, poses: &[Pose]) {
    let bodies = [a as usize, b as usize];
    let (shapes, poses) = (bodies.map(|body| &model.shapes[body]), bodies.map(|body| &poses[body]));
    let slack = SLID * shapes[0].rounded.radius.min(shapes[1].rounded.radius);
    for known in &mut memory.mortars {
        let (Some(first), Some(second)) =
            (shapes[0].faces.get(known.faces.0 as usize), shapes[1].faces.get(known.faces.1 as usize))
        else {
            continue;
        };
        if known.slid([first, second], poses) <= slack {
            continue;
        }
        let surfaces = bodies.map(|body| model.bodies[body].meshed_surface());
        let renewed = Mortar::new(known.faces, [first, second], poses, surfaces);
        let of_these = |feature: Feature| matches!(feature, Feature::Faces(i, j, _) if (i, j) == known.faces);
        let (old, mut points): (Vec<_>, Vec<_>) =
            memory.points.iter().copied().partition(|point| of_these(point.feature));
        points.extend(renewed.remember(known, &old));
        points.sort_by_key(|point| point.feature);
        memory.points = points;
        *known = renewed;
    }
}

#[cfg(test)]
mod tests;
