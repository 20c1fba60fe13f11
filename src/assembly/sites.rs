//! Where the points lie that span a contact's site.

use crate::contact::force::SitePoints;
use crate::contact::{ContactShape, Corner, Site};
use crate::tensor::{Pose, Vec3};

/// In space; `corners` are the core vertices of either body there.
pub(super) fn site_points(
    site: &Site,
    shapes: [&ContactShape; 2],
    corners: [&[Vec3]; 2],
    poses: [&Pose; 2],
) -> SitePoints {
    let place = |side: usize, vertices: &[u32; 3]| vertices.map(|v| corners[side][v as usize]);
    let (a, b) = (place(0, &site.on_a), place(1, &site.on_b));
    let mut points = SitePoints { a, b, normals: [Vec3::zeros(); 2] };
    if let Some([a, b]) = facing_corners(site, shapes) {
        points.a[1] = points.a[0] + poses[0].rotation * a.axis;
        points.b[1] = points.b[0] + poses[1].rotation * b.axis;
    }
    points
}

/// The corners of two vertices that face each other, where both are sharp.
pub(super) fn facing_corners(site: &Site, shapes: [&ContactShape; 2]) -> Option<[Corner; 2]> {
    if (site.count_a, site.count_b) != (1, 1) {
        return None;
    }
    let [a, b] = [(0, site.on_a), (1, site.on_b)]
        .map(|(side, vertices)| shapes[side].corners.get(vertices[0] as usize).copied().flatten());
    Some([a?, b?])
}
