//! The features of a pair that are in reach of each other in one configuration.

use crate::contact::features::{Feature, Site, closest_on_segments, closest_on_triangle, spanned};
use crate::contact::search::{ContactShape, PairFeatures, approach};
use crate::tensor::{Pose, Vec3};

/// Clearances are measured anew where the two bodies have come this share of their list's skin.
const MEASURED_ANEW: f64 = 0.2;
/// A way in space of this share of the skin is taken for the way against each other.
const UNSEEN: f64 = 0.02;

/// How far the listed features of a pair were apart in a configuration, and the vertices that span them: what cannot have come near since needs no look, and
/// what is looked at lies close together.
#[derive(Debug, Clone, Default)]
pub struct Clearances {
    /// In the order of the list.
    features: Vec<Listed>,
    /// The least of their distances [m].
    smallest: f64,
    /// Facets that vertices may be nearest to, those of one vertex after the other's.
    facets: Vec<NearFacet>,
    at: Option<[Pose; 2]>,
}

#[derive(Debug, Clone, Copy)]
struct Listed {
    /// Of the cores [m].
    distance: f64,
    spans: Spans,
}

/// What a listed feature lies between.
#[derive(Debug, Clone, Copy)]
enum Spans {
    /// A vertex of the body `own`, 0 or 1, and a range of the facets that it may be nearest to.
    Vertex { own: u32, vertex: u32, facets: [u32; 2] },
    /// Two edges and their ends on either body.
    Edges { numbers: [u32; 2], ends: [[u32; 2]; 2] },
}

#[derive(Debug, Clone, Copy)]
struct NearFacet {
    vertices: [u32; 3],
    /// Of the vertex of the other body [m].
    distance: f64,
}

impl Clearances {
    /// Forgets them, as the list has changed.
    pub fn clear(&mut self) {
        self.at = None;
        self.features.clear();
        self.facets.clear();
    }

    /// By how much features may have come nearer at most [m]; `None` where all are to be measured.
    fn closer(&mut self, pair: &PairFeatures, Placed { shapes, poses, .. }: &Placed<'_>) -> Option<f64> {
        let enough = UNSEEN * pair.skin;
        let way = |at: &[Pose; 2]| approach(*shapes, [&at[0], &at[1]], *poses, enough);
        let known = self.at.as_ref().map(way).filter(|way: &f64| *way < MEASURED_ANEW * pair.skin);
        if known.is_none() {
            self.at = Some(poses.map(Pose::clone));
            if self.features.is_empty() {
                self.list(pair, *shapes);
            }
        }
        known
    }

    /// Lists the features of a pair, nothing of which has been measured.
    fn list(&mut self, pair: &PairFeatures, shapes: [&ContactShape; 2]) {
        let cores = shapes.map(|shape| &shape.rounded.core);
        for (own, list) in [(0, &pair.vertices_of_a), (1, &pair.vertices_of_b)] {
            for reach in list {
                let from = self.facets.len() as u32;
                self.facets.extend(reach.facets.iter().map(|facet| NearFacet {
                    vertices: cores[1 - own].facets[*facet as usize].map(|v| v as u32),
                    distance: 0.0,
                }));
                let facets = [from, self.facets.len() as u32];
                let spans = Spans::Vertex { own: own as u32, vertex: reach.vertex, facets };
                self.features.push(Listed { distance: 0.0, spans });
            }
        }
        let ends = |side: usize, edge: u32| cores[side].edges[edge as usize].vertices.map(|v| v as u32);
        self.features.extend(pair.edges.iter().map(|&(i, j)| Listed {
            distance: 0.0,
            spans: Spans::Edges { numbers: [i, j], ends: [ends(0, i), ends(1, j)] },
        }));
    }
}

/// The two bodies of a pair where they are.
#[derive(Clone, Copy)]
pub struct Placed<'a> {
    pub shapes: [&'a ContactShape; 2],
    /// Core vertices in space [m].
    pub corners: [&'a [Vec3]; 2],
    pub poses: [&'a Pose; 2],
}

/// Calls `visit` with the site of each feature pair of `pair` that is closer than `reach` [m] beyond the rounding radii, and with its number in the list,
/// in a fixed order. Returns the smallest core distance [m].
pub fn visit_sites(
    placed: &Placed<'_>,
    pair: &PairFeatures,
    clearances: &mut Clearances,
    reach: f64,
    mut visit: impl FnMut(Site, usize),
) -> f64 {
    let Placed { shapes, corners, .. } = *placed;
    let closer = clearances.closer(pair, placed);
    let limit = shapes[0].rounded.radius + shapes[1].rounded.radius + reach;
    let Clearances { features, smallest, facets, .. } = clearances;
    // What the nearest feature is within.
    let mut within = closer.map_or(f64::INFINITY, |closer| *smallest + closer);
    let mut nearest = f64::INFINITY;
    for (number, Listed { distance: last, spans }) in features.iter_mut().enumerate() {
        let least = closer.map_or(0.0, |closer| *last - closer);
        if least >= limit && least > within {
            continue;
        }
        let (distance, site) = match *spans {
            Spans::Vertex { own, vertex, facets: [from, to] } => {
                let (own, facets) = (own as usize, &mut facets[from as usize..to as usize]);
                let p = &corners[own][vertex as usize];
                let (distance, piece, count) = nearest_facet(p, facets, corners[1 - own], closer);
                let alone = [vertex, 0, 0];
                let site = if own == 0 {
                    let feature = Feature::VertexOfA(vertex);
                    Site { feature, on_a: alone, on_b: piece, count_a: 1, count_b: count }
                } else {
                    let feature = Feature::VertexOfB(vertex);
                    Site { feature, on_a: piece, on_b: alone, count_a: count, count_b: 1 }
                };
                (distance, Some(site))
            }
            Spans::Edges { numbers: [i, j], ends: [on_a, on_b] } => {
                let ([p0, p1], [q0, q1]) =
                    (on_a.map(|v| &corners[0][v as usize]), on_b.map(|v| &corners[1][v as usize]));
                let (s, t) = closest_on_segments(p0, p1, q0, q1);
                let distance = ((p0 + (p1 - p0) * s) - (q0 + (q1 - q0) * t)).norm();
                let inside = |s: f64| s > 1e-12 && s < 1.0 - 1e-12;
                let [on_a, on_b] = [on_a, on_b].map(|[from, to]| [from, to, 0]);
                let site = Site { feature: Feature::Edges(i, j), on_a, on_b, count_a: 2, count_b: 2 };
                (distance, (inside(s) && inside(t)).then_some(site))
            }
        };
        if closer.is_none() {
            *last = distance;
        }
        nearest = nearest.min(distance);
        within = within.min(distance);
        if let Some(site) = site.filter(|_| distance < limit) {
            visit(site, number);
        }
    }
    if closer.is_none() {
        *smallest = nearest;
    }
    nearest
}

/// The piece nearest to `p` of a body with these `corners` that is known by `facets`, as [`nearest_of`] gives it. Those that cannot have it, having come `closer`
/// [m] at most since they were measured, are passed over.
fn nearest_facet(
    p: &Vec3,
    facets: &mut [NearFacet],
    corners: &[Vec3],
    closer: Option<f64>,
) -> (f64, [u32; 3], u8) {
    let Some(closer) = closer else {
        let measured = facets.iter_mut().map(|facet| (facet.vertices, Some(&mut facet.distance)));
        return nearest_of(p, measured, corners);
    };
    let within = facets.iter().map(|facet| facet.distance).fold(f64::INFINITY, f64::min) + closer;
    let can_have_it = facets.iter().filter(|facet| facet.distance - closer <= within);
    nearest_of(p, can_have_it.map(|facet| (facet.vertices, None)), corners)
}

/// The piece (vertex, edge or facet) of `shape` nearest to `p` among `facets`: how far it is [m], its vertices, and their number.
pub fn nearest_piece(
    p: &Vec3,
    shape: &ContactShape,
    facets: &[u32],
    corners: &[Vec3],
) -> (f64, [u32; 3], u8) {
    let vertices = |facet: &u32| shape.rounded.core.facets[*facet as usize].map(|v| v as u32);
    nearest_of(p, facets.iter().map(|facet| (vertices(facet), None)), corners)
}

/// The same of facets of these vertices, without any of the core's only one; puts down how far each is where there is a place for it.
fn nearest_of<'a>(
    p: &Vec3,
    facets: impl Iterator<Item = ([u32; 3], Option<&'a mut f64>)>,
    corners: &[Vec3],
) -> (f64, [u32; 3], u8) {
    let mut best = (f64::INFINITY, [0; 3], 0);
    for (vertices, place) in facets {
        let (closest, spans) = closest_on_triangle(p, vertices.map(|v| &corners[v as usize]));
        let distance = (closest - p).norm();
        if distance < best.0 {
            let (piece, count) = spanned(vertices, spans);
            best = (distance, piece, count);
        }
        if let Some(place) = place {
            *place = distance;
        }
    }
    if best.2 == 0 { ((p - corners[0]).norm(), [0; 3], 1) } else { best }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Polyhedron, RoundedBody};

    const RADIUS: f64 = 2e-3;
    const SKIN: f64 = 1.2e-3;

    fn octahedron(size: f64) -> ContactShape {
        let corners: Vec<Vec3> = (0..3)
            .flat_map(|k| [-1.0, 1.0].map(|sign| Vec3::ith(k, sign * size * (1.0 + 0.1 * k as f64))))
            .collect();
        let core = Polyhedron::convex_hull(&corners).expect("an octahedron");
        ContactShape::new(RoundedBody { core, radius: RADIUS })
    }

    /// What was measured once must not hide a feature that has come in reach since, nor the nearest one.
    #[test]
    fn what_cannot_have_come_near_is_all_that_is_passed_over() {
        let shapes = [octahedron(20e-3), octahedron(23e-3)];
        let mut poses = [Pose::identity(), Pose::identity()];
        poses[1] = poses[1].moved(&Vec3::new(18e-3, 19e-3, 20e-3), &Vec3::new(0.3, 0.2, -0.4));
        let corners = |poses: &[Pose; 2]| {
            let of = |side: usize| {
                let own = shapes[side].rounded.core.vertices.iter();
                own.map(|v: &Vec3| poses[side].to_space(v)).collect::<Vec<_>>()
            };
            [of(0), of(1)]
        };
        let see = |pair: &PairFeatures, poses: &[Pose; 2], clearances: &mut Clearances| {
            let [a, b] = corners(poses);
            let (shapes, poses) = ([&shapes[0], &shapes[1]], [&poses[0], &poses[1]]);
            let placed = Placed { shapes, corners: [&a, &b], poses };
            let mut seen = Vec::new();
            let nearest =
                visit_sites(&placed, pair, clearances, 0.0, |site, number| seen.push((site, number)));
            (seen, nearest)
        };
        // To where the rounded surfaces touch, and then to and fro.
        let listed = |poses: &[Pose; 2]| {
            PairFeatures::list(&shapes, &corners(poses), poses, (0, 1), [2.0 * RADIUS + SKIN, 0.0])
        };
        let along = Vec3::new(18.0, 19.0, 20.0).normalize();
        for _ in 0..8 {
            let (_, apart) = see(&listed(&poses), &poses, &mut Clearances::default());
            assert!(apart.is_finite(), "nothing is near");
            poses[1] = poses[1].moved(&(along * (2.0 * RADIUS - apart)), &Vec3::zeros());
        }
        let pair = PairFeatures::list(&shapes, &corners(&poses), &poses, (0, 1), [SKIN, 0.0]);
        let (first, mut clearances) = (poses, Clearances::default());
        let (mut touched, mut passed_over) = (0, 0);
        for k in 0..200 {
            let share = |speed: f64| (speed * f64::from(k)).sin();
            let way = Vec3::new(share(0.11), share(0.17), share(0.23)) * (0.25 * SKIN);
            let turn = Vec3::new(share(0.07), share(0.29), share(0.13)) * (0.1 * SKIN / 23e-3);
            poses[1] = first[1].moved(&way, &turn);
            let measured = see(&pair, &poses, &mut Clearances::default());
            let found = see(&pair, &poses, &mut clearances);
            assert_eq!(found, measured, "{k}");
            touched += usize::from(!found.0.is_empty());
            passed_over += usize::from(clearances.at.as_ref().is_some_and(|at| at[1] != poses[1]));
        }
        assert!(touched > 20 && touched < 180 && passed_over > 50, "{touched} {passed_over}");
    }
}
