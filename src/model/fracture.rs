//! Takes failed cells out of the model: a grain that loses cells gets a smaller body, one that comes apart becomes several.
//!
//! The largest part keeps the number of the body that broke, the others go behind all bodies, each with its reference point at its own centroid
//! (the largest of a body that stages name at the whole's) and its frame at its mean motion. Surfaces keep their place in space (to second order
//! in the displacements), and a cover's nodes stay at their material points, so nothing does work here. What is too small to be a body, or
//! leaves nothing to touch, is given up and counted. Brittle bodies are rigid meanwhile (they have to rest), and what bends of their parts later
//! are the cells that are left, as sound rock. Where failed cells stay as rubble ([`DamagedGrain::keeping_rubble`]) a grain in one part keeps
//! its shape, and several share it. What contacts of a body remember whose shape changed goes with its features;
//! [`crate::assembly::Contacts::inherit`] puts it into those of the new shape.

use std::sync::Arc;

use crate::contact::ContactShape;
use crate::contact::memory::{PairKey, PairMemory};
use crate::element::POINT_COUNT;
use crate::error::{Error, Result};
use crate::geometry::rounded::{HalfSpace, facet_planes, intersection, plain_hull};
use crate::geometry::separation::separating_axis;
use crate::geometry::{Polyhedron, RoundedBody};
use crate::grain::hulls::{self, contact_shapes};
use crate::grain::{BreakUp, DamagedGrain, Fragment};
use crate::mesh::Mesh;
use crate::model::cover::CoverNode;
use crate::model::{Body, BodyKind, Breakage, Committed, Deformation, Model};
use crate::tensor::{Pose, Rotation, Vec3};

/// Hulls that differ by less than this share of their volume are the same.
const SAME_VOLUME: f64 = 1e-6;
/// Cores of a new part and a neighbour are at least this share of their roundings apart.
const DEEPEST: f64 = 0.6;
/// Projections of a corner onto the planes between its part and others.
const PROJECTIONS: usize = 8;
/// Corners closer than this share of the body's size are the same.
const SAME_CORNER: f64 = 1e-9;

/// What breaking did to one body.
#[derive(Debug, Clone, PartialEq)]
pub struct Fracture {
    pub body: usize,
    /// The bodies that it is now, itself first; none where nothing is left.
    pub parts: Vec<usize>,
    pub deleted_cells: usize,
    /// Volume of deleted cells and of parts that were given up [m^3].
    pub crushed_volume: f64,
    pub lost_parts: usize,
    /// Elastic energy that went with deleted cells and lost parts [J].
    pub lost_energy: f64,
    /// What its contacts remembered, where its shape has changed and with it the features that they are known by: taken out of the committed memory.
    pub former: Vec<(PairKey, PairMemory)>,
}

/// How a fragment goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum GoesOn {
    /// As the body that it was part of, of which it is all that is left.
    Alone,
    /// As that body, with its reference point.
    InPlace,
    /// With its centroid as reference point.
    Apart,
}

/// A part ready to be a body.
struct Part {
    grain: DamagedGrain,
    nominal: Polyhedron,
    shape: ContactShape,
    pose: Pose,
    field: Vec<Vec3>,
    /// Its reference point in the coordinates of the body that broke [m].
    point: Vec3,
}

/// How far the damage of a model has come.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct DamageCounts {
    /// Integration points that have failed, those of deleted cells included.
    pub failed_points: usize,
    /// Cells deleted or given up with a part.
    pub deleted_cells: usize,
    /// Bodies that are left of grains that came apart.
    pub fragments: usize,
}

impl Model {
    /// Whether there are bodies that can break (or could, before nothing was left of them).
    pub fn can_break(&self) -> bool {
        self.generated.iter().any(Option::is_some)
    }

    /// Notes the cells that damage begins with; once, when the bodies are complete.
    pub fn begin_damage(&mut self) {
        let generated = |body: &Body| Some(body.damaged()?.generated().clone());
        self.generated = self.bodies.iter().map(generated).collect();
    }

    /// The bodies that each grain as generated is now.
    pub fn parts(&self) -> Vec<Vec<usize>> {
        let mut parts = vec![Vec::new(); self.generated.len()];
        for (index, body) in self.bodies.iter().enumerate() {
            let Some(grain) = body.damaged() else { continue };
            if let Some(parts) = parts.get_mut(grain.ancestry().origin as usize) {
                parts.push(index);
            }
        }
        parts
    }

    /// Whether these are, or this is, what is left of a grain that came apart.
    pub fn came_apart(&self, parts: &[usize]) -> bool {
        let generation = |part: &usize| self.bodies[*part].damaged().map(|it| it.ancestry().generation);
        parts.len() > 1 || parts.iter().filter_map(generation).any(|generation| generation > 0)
    }

    pub fn damage_counts(&self) -> DamageCounts {
        let mut counts = DamageCounts::default();
        for (first, parts) in self.generated.iter().zip(self.parts()) {
            let Some(first) = first else { continue };
            let alive = parts.iter().filter_map(|part| self.bodies[*part].damaged());
            let (mut cells, mut failed) = (0, 0);
            for grain in alive {
                cells += grain.states().len();
                failed += grain.states().iter().flatten().filter(|state| state.failed).count();
            }
            let deleted = first.cells.len() - cells;
            counts.failed_points += failed + POINT_COUNT * deleted;
            counts.deleted_cells += deleted;
            counts.fragments += if self.came_apart(&parts) { parts.len() } else { 0 };
        }
        counts
    }

    /// Poses of the body coordinates as generated, in which meshes stay where they were: those of a part lie off its own by its offset.
    pub fn frames(&self, poses: &[Pose]) -> Vec<Pose> {
        let frame = |(body, pose): (&Body, &Pose)| match body.frame_offset() {
            offset if offset != Vec3::zeros() => Pose::new(pose.to_space(&-offset), pose.rotation),
            _ => *pose,
        };
        let nodes = poses.iter().skip(self.bodies.len());
        self.bodies.iter().zip(poses).map(frame).chain(nodes.copied()).collect()
    }

    /// Makes the damage of an accepted increment the bodies' own; `None` where a body cannot break.
    pub fn take_damage(&mut self, grains: &[Option<Arc<DamagedGrain>>]) {
        for (body, grain) in self.bodies.iter_mut().zip(grains) {
            if let Some(grain) = grain {
                if !grain.is_sound() && body.is_elastic() && body.softens_with_damage() {
                    body.deformation = body.deformation.damaged(grain);
                }
                body.breakage = body.breakage.of(grain.clone());
            }
        }
    }

    /// Deletes the cells all of whose points have failed. `displacements` are those of the nodes of each body to be broken up [m], in its
    /// own frame. The largest part of a body that `keeps` its reference point has that of the whole, the others their centroids.
    ///
    /// # Errors
    /// [`crate::error::Error::Mesh`] where a part cannot be made.
    pub fn break_up(
        &mut self,
        committed: &mut Committed,
        displacements: &[Vec<Vec3>],
        keeps: impl Fn(usize) -> bool,
    ) -> Result<Vec<Fracture>> {
        let mut fractures = Vec::new();
        for index in 0..self.bodies.len() {
            let Some(displacements) = displacements.get(index).filter(|u| !u.is_empty()) else { continue };
            fractures.extend(self.break_body(index, committed, displacements, keeps(index))?);
        }
        Ok(fractures)
    }

    /// Breaks up one body; `None` where it stays what it is.
    fn break_body(
        &mut self,
        index: usize,
        committed: &mut Committed,
        displacements: &[Vec3],
        keeps: bool,
    ) -> Result<Option<Fracture>> {
        let Some(grain) = self.bodies[index].damaged().cloned() else { return Ok(None) };
        let brittle = self.bodies[index].is_brittle();
        let broken = grain.break_up_from(displacements, index as u32, grain.least_volume())?;
        let Some(broken) = broken else { return Ok(None) };
        let mut fracture = Fracture {
            body: index,
            parts: vec![],
            deleted_cells: broken.deleted.len(),
            crushed_volume: broken.deleted_volume + broken.lost_volume,
            lost_parts: broken.lost.len(),
            lost_energy: broken.lost_energy,
            former: vec![],
        };
        let poses = &committed.poses[..];
        let parts = self.parts_of(index, &broken, displacements, (poses, keeps), &mut fracture)?;
        let bodies = self.bodies.len();
        let mut points: Vec<Vec3> = parts.iter().map(|part| part.point).collect();
        let stays = parts.is_empty() && grain.keeps_rubble();
        let changed = match &parts[..] {
            [] => !stays,
            [part] => part.nominal != self.bodies[index].nominal,
            _ => true,
        };
        if changed {
            let is_its = |(a, b): &PairKey| *a as usize == index || *b as usize == index;
            fracture.former = committed.memory.extract_if(.., |key, _| is_its(key)).collect();
            committed.memory.renew_features_of(index);
        }
        committed.fields.resize(self.bodies.len(), Vec::new());
        if stays {
            let body = &mut self.bodies[index];
            (body.deformation, body.breakage) = (Deformation::Rigid, Breakage::Rubble);
            fracture.parts.push(index);
            points.push(Vec3::zeros());
        } else if parts.is_empty() {
            self.remove(index);
        }
        if parts.is_empty() {
            committed.fields[index].clear();
        }
        for (number, part) in parts.into_iter().enumerate() {
            let Part { grain, nominal, shape, pose, field, .. } = part;
            let deformation = self.deformation_of_part(index, &grain)?;
            let body = self.body_of(index, number, grain, nominal, deformation);
            if number == 0 {
                self.bodies[index] = body;
                self.shapes[index] = shape;
                committed.poses[index] = pose;
                committed.fields[index] = field;
                fracture.parts.push(index);
            } else {
                fracture.parts.push(self.bodies.len());
                committed.poses.insert(self.bodies.len(), pose);
                self.bodies.push(body);
                self.shapes.push(shape);
                committed.fields.push(field);
            }
        }
        self.make_room(bodies)?;
        self.glue_anew(&fracture, &points, &committed.poses)?;
        if brittle {
            // A rigid body stores nothing.
            fracture.lost_energy = 0.0;
        }
        Ok(Some(fracture))
    }

    /// The parts that body `index` comes apart into; what contact cannot handle goes into `fracture` as debris.
    fn parts_of(
        &self,
        index: usize,
        broken: &BreakUp,
        displacements: &[Vec3],
        (poses, keeps): (&[Pose], bool),
        fracture: &mut Fracture,
    ) -> Result<Vec<Part>> {
        let mut parts = Vec::new();
        let meshes = broken.fragments.iter().map(|fragment| fragment.grain.mesh_with_rubble());
        let meshes: Vec<_> = meshes.collect::<Result<_>>()?;
        let meshes: Vec<&Mesh> = meshes.iter().map(|mesh| &**mesh).collect();
        let alone = meshes.len() == 1;
        for (shape, fragment) in contact_shapes(&meshes).into_iter().zip(&broken.fragments) {
            let goes_on = match alone {
                true => GoesOn::Alone,
                false if keeps && parts.is_empty() => GoesOn::InPlace,
                false => GoesOn::Apart,
            };
            let made =
                shape.and_then(|shape| self.part(index, fragment, shape, displacements, poses, goes_on));
            match made {
                Ok(part) => parts.push(part),
                // A body that contact cannot handle (too thin, say) is debris.
                Err(reason) => {
                    tracing::debug!(body = self.bodies[index].name, %reason, "a part is given up");
                    fracture.lost_parts += 1;
                    fracture.crushed_volume += fragment.grain.mesh().volume();
                    fracture.lost_energy += fragment.grain.elastic_energy();
                }
            }
        }
        Ok(parts)
    }

    /// A fragment of body `index`.
    fn part(
        &self,
        index: usize,
        fragment: &Fragment,
        shape: hulls::ContactShape,
        displacements: &[Vec3],
        poses: &[Pose],
        goes_on: GoesOn,
    ) -> Result<Part> {
        let (old, pose) = (&self.bodies[index].nominal, &poses[index]);
        let centroid = fragment.grain.condensed().mass_properties().centroid;
        let (alone, apart) = (goes_on == GoesOn::Alone, goes_on == GoesOn::Apart);
        let point = if apart { centroid } else { Vec3::zeros() };
        // What was cut off before stays off.
        let mut nominal = match intersection(&shape.nominal, &facet_planes(old)) {
            Ok(nominal) => nominal,
            Err(_) if alone => old.clone(),
            Err(error) => return Err(error),
        };
        let same = (nominal.volume() - old.volume()).abs() < SAME_VOLUME * old.volume();
        let unchanged = alone && (same || fragment.grain.keeps_rubble());
        let too_thin = hulls::rounded(&nominal, self.shapes[index].rounded.radius)
            .is_ok_and(|rounded| rounded.radius < self.shapes[index].rounded.radius);
        let shape = if unchanged {
            nominal = old.clone();
            self.shapes[index].clone()
        } else {
            match self
                .trimmed(index, nominal, &shape.planes, poses)
                .and_then(|trimmed| self.fitted(index, trimmed, poses))
            {
                Ok((fitted, rounded)) => {
                    nominal = fitted.translated(&-point);
                    let rounded = RoundedBody { core: rounded.core.translated(&-point), ..rounded };
                    ContactShape::new(rounded).faced_as(&self.shapes[index], &point)
                }
                // What no smaller shape can be made for keeps the one it had.
                Err(_) if alone && !too_thin => {
                    nominal = old.clone();
                    self.shapes[index].clone()
                }
                Err(error) => return Err(error),
            }
        };
        let grain = if apart { fragment.grain.moved_to(&point)? } else { fragment.grain.clone() };
        let turn = Rotation::from_scaled_axis(fragment.rotation);
        let moved = centroid + fragment.translation + turn * (point - centroid);
        let back = turn.inverse();
        let displaced = |node: usize| {
            let x = fragment.grain.mesh().nodes[node];
            let u = displacements[fragment.nodes[node].index()];
            back * (x + u - moved) - (x - point)
        };
        let condensed = grain.condensed();
        let field = if self.bodies[index].is_brittle() {
            Vec::new()
        } else if self.bodies[index].full().is_some() {
            let nodal: Vec<Vec3> = (0..fragment.nodes.len()).map(displaced).collect();
            [condensed.felt(&nodal), nodal].concat()
        } else {
            condensed.surface().nodes().iter().map(|node| displaced(node.index())).collect()
        };
        Ok(Part {
            grain,
            nominal,
            shape,
            pose: Pose::new(pose.position + pose.rotation * moved, pose.rotation * turn),
            field,
            point,
        })
    }

    /// A smaller `nominal` of body `index`, its new corners drawn back to where neighbours have pressed into the old one: a surface that was
    /// behind and is met now begins without a force, or it would spend energy that nobody put in. `planes` divide the part from others.
    fn trimmed(
        &self,
        index: usize,
        nominal: Polyhedron,
        planes: &[HalfSpace],
        poses: &[Pose],
    ) -> Result<Polyhedron> {
        let (old, pose) = (&self.bodies[index].nominal, &poses[index]);
        let same = SAME_CORNER * old.bounding_radius();
        let is_new = |v: &Vec3| old.vertices.iter().all(|corner| (corner - v).norm() > same);
        let mut corners = nominal.vertices.clone();
        // Drawn back, a corner slides along the planes between this part and others: behind them they are.
        let kept = |mut corner: Vec3| {
            for _ in 0..PROJECTIONS {
                for plane in planes {
                    corner -= plane.normal * (plane.normal.dot(&corner) - plane.offset).max(0.0);
                }
            }
            corner
        };
        for (other, body) in self.bodies.iter().enumerate() {
            let reach = old.bounding_radius() + body.nominal.bounding_radius();
            let near = (poses[other].position - pose.position).norm() < reach;
            if other == index || body.kind == BodyKind::Gone || body.nominal.vertices.len() < 4 || !near {
                continue;
            }
            let found = separating_axis(&nominal, pose, &body.nominal, &poses[other]);
            if found.gap < 0.0 {
                let normal = pose.rotation.inverse() * found.direction;
                let support =
                    nominal.vertices.iter().map(|v| normal.dot(v)).fold(f64::NEG_INFINITY, f64::max);
                for corner in corners.iter_mut().filter(|corner| is_new(corner)) {
                    let way = (normal.dot(corner) - support - found.gap).max(0.0);
                    if way > 0.0 {
                        *corner = kept(*corner - normal * way);
                    }
                }
            }
        }
        if corners == nominal.vertices { Ok(nominal) } else { plain_hull(&corners) }
    }

    /// `nominal` of body `index` rounded, cut where it would reach further into a neighbour than contact can carry: along the plane
    /// that touches the neighbour.
    fn fitted(
        &self,
        index: usize,
        mut nominal: Polyhedron,
        poses: &[Pose],
    ) -> Result<(Polyhedron, RoundedBody)> {
        let radius = self.shapes[index].rounded.radius;
        let thin =
            || Error::Mesh { name: self.bodies[index].name.clone(), message: "a part is too thin".into() };
        let mut rounded = hulls::rounded(&nominal, radius)?;
        for (other, body) in self.bodies.iter().enumerate() {
            let shape = &self.shapes[other];
            let reach = nominal.bounding_radius() + shape.outer_radius();
            let far = (poses[other].position - poses[index].position).norm() > reach;
            let plate = body.kind == BodyKind::Plate;
            if other == index
                || body.kind == BodyKind::Gone
                || (far && !plate)
                || shape.rounded.core.facets.is_empty()
            {
                continue;
            }
            let axis = separating_axis(&rounded.core, &poses[index], &shape.rounded.core, &poses[other]);
            let radii = radius + shape.rounded.radius;
            if axis.gap < DEEPEST * radii {
                let normal = poses[index].rotation.inverse() * axis.direction;
                let support =
                    rounded.core.vertices.iter().map(|v| normal.dot(v)).fold(f64::NEG_INFINITY, f64::max);
                let plane = HalfSpace { normal, offset: support + radius - (radii - axis.gap) };
                nominal = intersection(&nominal, &[plane])?;
                rounded = hulls::rounded(&nominal, radius)?;
            }
        }
        if rounded.radius < radius { Err(thin()) } else { Ok((nominal, rounded)) }
    }

    /// How a part `grain` of body `index` deforms.
    fn deformation_of_part(&self, index: usize, grain: &DamagedGrain) -> Result<Deformation> {
        let old = &self.bodies[index];
        match old.is_brittle() {
            true => old.deformation.of_part(|| Ok(Arc::new(grain.as_sound()?))),
            false => Ok(old.deformation.of_part(|| Ok(grain.condensed().clone()))?.damaged(grain)),
        }
    }

    pub(super) fn body_of(
        &self,
        index: usize,
        number: usize,
        grain: DamagedGrain,
        nominal: Polyhedron,
        deformation: Deformation,
    ) -> Body {
        let old = &self.bodies[index];
        let mass = grain.condensed().mass_properties();
        let room = grain.room();
        let size = (6.0 * room / std::f64::consts::PI).cbrt();
        Body {
            name: if number == 0 { old.name.clone() } else { format!("{}.{}", old.name, self.bodies.len()) },
            kind: if number == 0 { old.kind } else { old.kind.of_part() },
            // The stiffness of a contact goes with the size.
            stiffness: old.stiffness * (0.5 * size / old.rotation_scale),
            limit_pressure: old.limit_pressure,
            friction: old.friction,
            mass: mass.mass * (room / grain.mesh().volume()),
            centre_of_mass: mass.centroid,
            offset: old.offset,
            rotation_scale: 0.5 * size,
            deformation,
            breakage: old.breakage.of(Arc::new(grain)),
            nominal,
        }
    }

    pub(super) fn remove(&mut self, index: usize) {
        let body = &mut self.bodies[index];
        (body.kind, body.mass) = (BodyKind::Gone, 0.0);
        (body.deformation, body.breakage) = (Deformation::Rigid, Breakage::Never);
    }

    /// Has the nodes of a membrane stand behind the bodies again, of which there were `before`.
    fn make_room(&mut self, before: usize) -> Result<()> {
        let more = self.bodies.len() - before;
        let Some(membrane) = self.membrane.as_mut().filter(|_| more > 0) else { return Ok(()) };
        membrane.stand_behind(self.bodies.len());
        if let Some(cover) = &self.cover {
            let moved = cover.glued_anew(|node| {
                let CoverNode { body, point } = cover.nodes()[node];
                (if body < before { body } else { body + more }, point)
            })?;
            self.cover = Some(moved);
        }
        Ok(())
    }

    /// Hands the cover's nodes on a body that broke to the nearest of its parts, at their material points; where nothing is left,
    /// to the nearest grain.
    fn glue_anew(&mut self, fracture: &Fracture, points: &[Vec3], poses: &[Pose]) -> Result<()> {
        let Some(cover) = &self.cover else { return Ok(()) };
        if !cover.nodes().iter().any(|node| node.body == fracture.body) {
            return Ok(());
        }
        let bodies = &self.bodies;
        let distance = |body: usize, x: &Vec3| {
            let surface = bodies[body].stressed_surface();
            surface.map_or(f64::INFINITY, |surface| (surface.locate(x).position - x).norm())
        };
        let nearest = |candidates: &mut dyn Iterator<Item = (usize, Vec3)>| {
            candidates.min_by(|(a, x), (b, y)| distance(*a, x).total_cmp(&distance(*b, y)).then(a.cmp(b)))
        };
        // Where a node of nothing lies in space is known from the pose that is left of its body.
        let glue = |node: usize| {
            let node = &cover.nodes()[node];
            if node.body != fracture.body {
                return (node.body, node.point);
            }
            let parts = fracture.parts.iter().zip(points).map(|(part, point)| (*part, node.point - point));
            let space = poses[node.body].to_space(&node.point);
            let others = (0..bodies.len())
                .filter(|body| bodies[*body].kind == BodyKind::Grain)
                .map(|body| (body, poses[body].to_body(&space)));
            nearest(&mut parts.into_iter())
                .or_else(|| nearest(&mut others.into_iter()))
                .unwrap_or((node.body, node.point))
        };
        let glued = cover.glued_anew(glue)?;
        self.cover = Some(glued);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::ContactLaw;
    use crate::contact::law::Friction;
    use crate::geometry::Polyhedron;

    /// A neighbour pressed in further than a part is thick draws its inner corners back, but not into the part behind.
    #[test]
    fn a_trimmed_part_stays_on_its_side_of_the_plane() {
        let block = |name| Body::block(name, BodyKind::Placed, [2.0; 3], 0.1, 1.0);
        let (bodies, shapes) = [block("breaks"), block("neighbour")].into_iter().unzip();
        let model = Model::new(bodies, shapes, ContactLaw::SAMPLE, Friction::constant(0.5));
        let at = |x: f64| Pose::new(Vec3::new(x, 0.0, 0.0), Rotation::identity());
        // The part from x = 0.9 on, the neighbour's face at 0.7.
        let part = Polyhedron::cuboid([0.1, 2.0, 2.0]).expect("a box").translated(&Vec3::new(0.95, 0.0, 0.0));
        let plane = HalfSpace { normal: -Vec3::x(), offset: -0.9 };
        let trimmed = model.trimmed(0, part.clone(), &[plane], &[at(0.0), at(1.7)]);
        let lowest = |body: &Polyhedron| body.vertices.iter().map(|v| v.x).fold(f64::INFINITY, f64::min);
        assert!(lowest(&trimmed.expect("a part")) > lowest(&part) - 1e-9);
    }
}
