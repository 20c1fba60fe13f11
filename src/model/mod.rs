//! The assembled scene: bodies with their shapes and stiffnesses, what is prescribed and loaded,
//! and the committed state that only an accepted increment changes.

pub mod body;
pub mod cover;
pub mod fracture;
pub mod loads;
pub mod membrane;
mod pieces;
pub mod state;
pub mod stored;
pub mod wall;

pub use body::{Body, BodyKind, Breakage, Deformation, Flexibility, STIFFNESS_RATIO};
pub use loads::{Control, Controlled, Loads};
pub use state::{Committed, Counters};
pub use stored::StoredBodies;

pub use cover::PressureCover;
pub use fracture::{DamageCounts, Fracture};
pub use membrane::{Membrane, MembraneParameters};
pub use wall::RigidWall;

use std::sync::Arc;

use crate::contact::face::FaceContact;
use crate::contact::law::Friction;
use crate::contact::{Asperity, ContactLaw, ContactShape, Feature, NormalLaw};
use crate::mesh::Mesh;
use crate::tensor::{self, Pose};

/// Stiffness of the rounded shell of a condensed body at a contact over the stiffness that stands for
/// the whole body where it is rigid. Its compliance adds to the flexibility of the mesh.
pub const SHELL_STIFFNESS: f64 = 4.0;

/// What is computed: bodies, their shapes and what confines them. Between increments it changes where bodies break, wake or rest and where a cover
/// is laid anew; never within one.
#[derive(Debug, Clone)]
pub struct Model {
    pub bodies: Vec<Body>,
    /// The bodies' shapes, in the same order.
    pub shapes: Vec<ContactShape>,
    pub law: ContactLaw,
    /// What bears the normal force between rigid bodies.
    pub normal: NormalLaw,
    /// Friction where neither body has its own.
    pub friction: Friction,
    /// Cover that carries a pressure, where there is one.
    pub cover: Option<PressureCover>,
    /// Rubber membrane, where there is one; the cover is then on its nodes.
    pub membrane: Option<Membrane>,
    /// Rigid wall in the place of a cover, where there is one.
    pub wall: Option<RigidWall>,
    /// The mesh of each body that can break as it was generated; `None` of those that cannot.
    pub generated: Vec<Option<Arc<Mesh>>>,
}

impl Model {
    /// Bodies that nothing confines and that have not begun to break.
    pub fn new(bodies: Vec<Body>, shapes: Vec<ContactShape>, law: ContactLaw, friction: Friction) -> Self {
        Model {
            bodies,
            shapes,
            law,
            normal: NormalLaw::Spring,
            friction,
            cover: None,
            membrane: None,
            wall: None,
            generated: Vec::new(),
        }
    }

    /// Stiffness of a contact between two bodies [N/m]: theirs in series; rigid plates give none.
    pub fn contact_stiffness(&self, a: usize, b: usize) -> f64 {
        let compliance = 1.0 / self.bodies[a].stiffness + 1.0 / self.bodies[b].stiffness;
        1.0 / compliance
    }

    /// Stiffness of the contact's own spring between two bodies [N/m]: as [`Self::contact_stiffness`],
    /// an elastic body with its shell alone.
    pub fn contact_spring(&self, a: usize, b: usize) -> f64 {
        1.0 / (self.shell_compliance(a) + self.shell_compliance(b))
    }

    /// What a body yields at a contact by the contact's own spring [m/N]: where it deforms, its shell. An asperity is the same whether it does or not.
    fn shell_compliance(&self, body: usize) -> f64 {
        let has_shell = self.normal == NormalLaw::Spring && self.bodies[body].is_elastic();
        1.0 / (self.bodies[body].stiffness * if has_shell { SHELL_STIFFNESS } else { 1.0 })
    }

    /// By how much less a body yields by the spring of a contact where it deforms than where it is rigid [m/N], in a patch per pressure [m^3/N].
    pub fn spares(&self, body: usize, feature: Feature) -> f64 {
        let own = &self.bodies[body];
        match (feature, self.normal) {
            (Feature::Faces(..), _) => {
                (own.rotation_scale - self.shapes[body].rounded.radius) / own.plane_strain_modulus()
            }
            (Feature::VertexOfA(_) | Feature::VertexOfB(_) | Feature::Edges(..), NormalLaw::Asperity) => 0.0,
            (Feature::VertexOfA(_) | Feature::VertexOfB(_) | Feature::Edges(..), NormalLaw::Spring) => {
                (1.0 - 1.0 / SHELL_STIFFNESS) / own.stiffness
            }
        }
    }

    /// Whether bodies that deform are displaced by the forces of the step before: asperities yield so much more that few steps bring them to agree.
    pub fn follows_by_steps(&self) -> bool {
        self.normal == NormalLaw::Asperity && self.has_elastic()
    }

    /// Whether bodies that deform are displaced by augmentations of their contacts' forces: behind springs.
    pub fn waits_for_augmentations(&self) -> bool {
        self.normal == NormalLaw::Spring && self.has_elastic()
    }

    /// Stiffness of the patch that two parallel faces share, per area [N/m^3]: of each body a layer in simple compression, of a rigid
    /// one half its size thick, of one whose mesh deforms the rounding, which is outside of the mesh's corners.
    pub fn patch_stiffness(&self, a: usize, b: usize) -> f64 {
        1.0 / (self.layer_compliance(a) + self.layer_compliance(b))
    }

    /// What a body yields in a patch per pressure [m^3/N].
    fn layer_compliance(&self, body: usize) -> f64 {
        let (shape, body) = (&self.shapes[body], &self.bodies[body]);
        let layer = if body.is_elastic() { shape.rounded.radius } else { body.rotation_scale };
        layer / body.plane_strain_modulus()
    }

    /// The law of contacts at a feature.
    pub fn law_at(&self, feature: Feature) -> ContactLaw {
        match feature {
            Feature::Faces(..) => self.law.of_patches(),
            Feature::VertexOfA(_) | Feature::VertexOfB(_) | Feature::Edges(..) => self.law,
        }
    }

    /// Has this bear the normal force between bodies.
    pub fn with_normal(self, normal: NormalLaw) -> Self {
        Model { normal, ..self }
    }

    /// The asperity by which two bodies meet at a feature: a corner is as sharp as its own body, whatever it meets, so that nothing jumps where it slides
    /// from a face over an edge; two balls have both their curvatures. `None` where a spring bears.
    pub fn asperity(&self, [a, b]: [usize; 2], feature: Feature) -> Option<Asperity> {
        let bodies = [a, b].map(|i| &self.bodies[i]);
        if self.normal == NormalLaw::Spring {
            return None;
        }
        let [first, second] = bodies.map(Body::plane_strain_modulus);
        let modulus = 1.0 / (1.0 / first + 1.0 / second);
        // The weaker one is crushed.
        let limit = bodies[0].limit_pressure.min(bodies[1].limit_pressure);
        let shapes = [a, b].map(|i| &self.shapes[i]);
        let radii = shapes.map(|shape| shape.rounded.radius);
        let tip = |side: usize, vertex: u32| {
            let balls = shapes.iter().all(|shape| shape.is_point());
            let radius = if balls { 1.0 / (1.0 / radii[0] + 1.0 / radii[1]) } else { radii[side] };
            Asperity::tip(modulus, limit, radius, shapes[side].corner_spread[vertex as usize])
        };
        match feature {
            Feature::VertexOfA(vertex) => Some(tip(0, vertex)),
            Feature::VertexOfB(vertex) => Some(tip(1, vertex)),
            Feature::Edges(i, j) => {
                let spreads = [shapes[0].edge_spread[i as usize], shapes[1].edge_spread[j as usize]];
                Some(Asperity::crossed_edges(modulus, limit, radii, spreads))
            }
            Feature::Faces(..) => None,
        }
    }

    /// Has parallel faces of bodies carry by this.
    pub fn with_faces(mut self, faces: FaceContact) -> Self {
        match faces {
            FaceContact::Corners => {}
            FaceContact::Area => self.shapes = self.shapes.into_iter().map(ContactShape::faced).collect(),
        }
        self
    }

    /// What is left of a contact's spring where the two bodies' rock has kept the shares
    /// `stiffness_left` of its stiffness: what a contact of rigid bodies yields more is the same where they
    /// deform.
    pub fn softened_share(&self, [a, b]: [usize; 2], feature: Feature, stiffness_left: [f64; 2]) -> f64 {
        if stiffness_left == [1.0; 2] {
            return 1.0;
        }
        let sides = [(a, stiffness_left[0]), (b, stiffness_left[1])].map(|(body, left)| {
            let it = &self.bodies[body];
            let (rigid, own) = match feature {
                Feature::Faces(..) => {
                    (it.rotation_scale / it.plane_strain_modulus(), self.layer_compliance(body))
                }
                Feature::VertexOfA(_) | Feature::VertexOfB(_) | Feature::Edges(..) => {
                    (1.0 / it.stiffness, self.shell_compliance(body))
                }
            };
            [own, own - rigid + rigid / left]
        });
        (sides[0][0] + sides[1][0]) / (sides[0][1] + sides[1][1])
    }

    /// Whether any body deforms, condensed or full.
    pub fn has_elastic(&self) -> bool {
        self.bodies.iter().any(Body::is_elastic)
    }

    /// The friction between two bodies: a body's own where it has one, the weaker where both have.
    pub fn friction_between(&self, a: usize, b: usize) -> Friction {
        match (self.bodies[a].friction, self.bodies[b].friction) {
            (None, None) => self.friction,
            (Some(own), None) | (None, Some(own)) => own,
            (Some(x), Some(y)) => {
                if x.peak <= y.peak {
                    x
                } else {
                    y
                }
            }
        }
    }

    /// A stiffness typical of the model's contacts [N/m]: the median over bodies that have one.
    pub fn typical_stiffness(&self) -> f64 {
        tensor::median(self.bodies.iter().map(|b| b.stiffness).filter(|k| k.is_finite()))
            .map_or(1e8, |k| 0.5 * k)
    }

    /// A size typical of the model's bodies [m]: twice the median of their rotation scales.
    pub fn typical_size(&self) -> f64 {
        let grains = self.bodies.iter().filter(|b| b.kind != BodyKind::Plate);
        tensor::median(grains.map(|b| b.rotation_scale)).map_or(0.0, |scale| 2.0 * scale)
    }

    /// Everything that has a pose: the bodies, then the free nodes of the membrane or the wall.
    pub fn carriers(&self) -> usize {
        let nodes = self.membrane.as_ref().map_or(0, Membrane::free_nodes);
        self.bodies.len() + nodes + usize::from(self.wall.is_some())
    }

    /// Whether a carrier is a node of the membrane.
    pub fn is_node(&self, carrier: usize) -> bool {
        (self.bodies.len()..self.carriers()).contains(&carrier) && self.wall.is_none()
    }

    /// Volume inside of what confines the side [m^3]; zero where nothing does.
    pub fn enclosed_volume(&self, poses: &[Pose]) -> f64 {
        let covered = self.cover.as_ref().map(|cover| cover.volume(poses));
        covered.or_else(|| self.wall.as_ref().map(|wall| wall.volume(poses))).unwrap_or(0.0)
    }

    /// Whether bodies are set and driven by hand.
    pub fn is_of_a_scene(&self) -> bool {
        self.bodies.iter().any(|body| body.kind == BodyKind::Placed)
    }

    /// What drags on a carrier, over the weight of its drag [N/m]: a typical contact stiffness.
    pub fn holding_stiffness(&self, carrier: usize, typical: f64) -> f64 {
        match &self.membrane {
            Some(membrane) if self.is_node(carrier) => membrane.contact.stiffness,
            Some(_) | None => typical,
        }
    }

    /// Whether all that moves are rigid bodies: none deforms, and there is no membrane and no wall.
    pub fn is_of_rigid_bodies(&self) -> bool {
        !self.has_elastic() && self.membrane.is_none() && self.wall.is_none()
    }

    /// Whether anything may come of two bodies' nearness: both are there, and not both are supports.
    pub fn can_meet(&self, a: usize, b: usize) -> bool {
        let [a, b] = [a, b].map(|i| self.bodies[i].kind);
        a != BodyKind::Gone && b != BodyKind::Gone && !(a.is_support() && b.is_support())
    }

    /// What is between the bounding spheres of two bodies, roundings included [m]; negative where these overlap.
    pub fn between_spheres(&self, poses: &[Pose], a: usize, b: usize) -> f64 {
        let shapes = [a, b].map(|i| &self.shapes[i]);
        let radii = shapes[0].rounded.radius + shapes[1].rounded.radius;
        let reach = shapes[0].bounding_radius + shapes[1].bounding_radius + radii;
        (poses[a].position - poses[b].position).norm() - reach
    }

    /// The smallest rounding radius of the model [m]; no motion of one iteration exceeds it.
    pub fn smallest_rounding(&self) -> f64 {
        let there = self.shapes.iter().zip(&self.bodies).filter(|(_, body)| body.kind != BodyKind::Gone);
        there.map(|(shape, _)| shape.rounded.radius).fold(f64::INFINITY, f64::min)
    }
}
