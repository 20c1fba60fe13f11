//! What breaking has made of a model's bodies, for a restart point.

use std::borrow::Cow;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::contact::ContactShape;
use crate::error::Result;
use crate::geometry::{Polyhedron, RoundedBody};
use crate::grain::{DamagedGrain, StoredGrain};
use crate::model::cover::StoredCover;
use crate::model::{Body, BodyKind, Breakage, Deformation, Model, PressureCover};
use crate::tensor::Vec3;

/// The bodies that can break, and the cover's nodes; empty where nothing can.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct StoredBodies<'a> {
    /// In the order of the bodies; `None` for those that cannot break.
    bodies: Vec<Option<StoredBody<'a>>>,
    /// Where there is one.
    cover: Option<StoredCover>,
    /// The bodies that rest.
    resting: Vec<u32>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct StoredBody<'a> {
    name: Cow<'a, str>,
    nominal: Cow<'a, Polyhedron>,
    rounded: Cow<'a, RoundedBody>,
    patched: Vec<bool>,
    stiffness: f64,
    rotation_scale: f64,
    mass: f64,
    #[serde(with = "crate::tensor::stored")]
    centre_of_mass: Vec3,
    /// `None` where no rock is left.
    grain: Option<StoredGrain>,
    is_rubble: bool,
}

impl Model {
    /// What [`Model::restore_bodies`] takes.
    pub fn stored_bodies(&self) -> StoredBodies<'_> {
        let rests = |(index, body): (usize, &Body)| body.is_resting().then_some(index as u32);
        let resting = self.bodies.iter().enumerate().filter_map(rests).collect();
        if !self.can_break() {
            return StoredBodies { resting, ..StoredBodies::default() };
        }
        let stored = self.bodies.iter().zip(&self.shapes).map(|(body, shape)| {
            let grain = body.damaged().map(|grain| grain.stored());
            let breakable = grain.is_some() || body.is_rubble() || body.kind == BodyKind::Gone;
            breakable.then(|| StoredBody {
                name: Cow::Borrowed(&body.name),
                nominal: Cow::Borrowed(&body.nominal),
                rounded: Cow::Borrowed(&shape.rounded),
                patched: shape.patched(),
                stiffness: body.stiffness,
                rotation_scale: body.rotation_scale,
                mass: body.mass,
                centre_of_mass: body.centre_of_mass,
                grain,
                is_rubble: body.is_rubble(),
            })
        });
        let cover = self.cover.as_ref().map(PressureCover::stored);
        StoredBodies { bodies: stored.collect(), cover, resting }
    }

    /// Takes stored bodies; `false`, and nothing is changed, where they are another model's. This model is as generated.
    ///
    /// # Errors
    /// [`crate::error::Error::Mesh`] where a grain cannot be made anew.
    pub fn restore_bodies(&mut self, stored: StoredBodies<'_>) -> Result<bool> {
        let resting = stored.resting.clone();
        let woken = self.bodies.iter_mut().map(Body::wake).filter(|woken| *woken).count();
        if !self.restore_breakable(stored)? {
            return Ok(false);
        }
        let mut fits = resting.is_empty() || woken > 0;
        for index in resting {
            fits &= self.bodies.get_mut(index as usize).is_some_and(Body::rest);
        }
        Ok(fits)
    }

    fn restore_breakable(&mut self, stored: StoredBodies<'_>) -> Result<bool> {
        if !self.can_break() || stored.bodies.is_empty() {
            return Ok(self.can_break() != stored.bodies.is_empty());
        }
        let cover_fits = stored.cover.is_some() == self.cover.is_some();
        let bodies_fit = stored.bodies.len() >= self.bodies.len()
            && stored.bodies.iter().zip(&self.generated).all(|(a, b)| a.is_some() == b.is_some())
            && stored.bodies[self.bodies.len()..].iter().all(Option::is_some);
        if !cover_fits || !bodies_fit {
            return Ok(false);
        }
        let first = self.bodies.clone();
        let mut made: Vec<Option<Arc<DamagedGrain>>> = Vec::with_capacity(stored.bodies.len());
        for body in &stored.bodies {
            let Some(grain) = body.as_ref().and_then(|body| body.grain.as_ref()) else {
                made.push(None);
                continue;
            };
            let first = first.get(grain.origin() as usize).and_then(Body::damaged);
            let Some(first) = first.filter(|first| first.is_sound()) else { return Ok(false) };
            made.push(Some(Arc::new(first.restored(grain)?)));
        }
        for (index, (stored, grain)) in stored.bodies.into_iter().zip(made).enumerate() {
            let Some(stored) = stored else { continue };
            if index >= self.bodies.len() {
                let origin = grain.as_ref().map_or(0, |grain| grain.ancestry().origin as usize);
                let kind = first[origin].kind.of_part();
                self.bodies.push(Body { kind, ..first[origin].clone() });
                self.shapes.push(self.shapes[origin].clone());
            }
            let body = &mut self.bodies[index];
            body.name = stored.name.into_owned();
            body.nominal = stored.nominal.into_owned();
            body.stiffness = stored.stiffness;
            body.rotation_scale = stored.rotation_scale;
            body.mass = stored.mass;
            body.centre_of_mass = stored.centre_of_mass;
            match grain {
                Some(grain) => {
                    // A sound grain keeps what it was condensed to, and a brittle one while it is whole; a rigid one has nothing.
                    if body.is_elastic() && body.softens_with_damage() {
                        let part = || Ok(grain.condensed().clone());
                        body.deformation = body.deformation.of_part(part)?.damaged(&grain);
                    } else if body.is_elastic() && grain.is_parted() {
                        body.deformation = body.deformation.of_part(|| Ok(Arc::new(grain.as_sound()?)))?;
                    }
                    body.breakage = body.breakage.of(grain);
                }
                None => {
                    body.deformation = Deformation::Rigid;
                    if stored.is_rubble {
                        body.breakage = Breakage::Rubble;
                    } else {
                        (body.breakage, body.kind) = (Breakage::Never, BodyKind::Gone);
                    }
                }
            }
            let shape = ContactShape::new(stored.rounded.into_owned());
            self.shapes[index] = shape.with_patched(&stored.patched);
        }
        if let Some(membrane) = &mut self.membrane {
            membrane.stand_behind(self.bodies.len());
        }
        if let Some(cover) = &stored.cover {
            self.cover = Some(PressureCover::restored(cover, self.carriers())?);
        }
        Ok(true)
    }
}
