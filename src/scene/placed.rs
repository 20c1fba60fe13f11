//! A body of a scene as the model wants it.

use crate::contact::law::Friction;
use crate::error::{Error, Result};
use crate::geometry::{Polyhedron, RoundedBody};
use crate::model::{Body, BodyKind, Breakage, Deformation, STIFFNESS_RATIO};
use crate::scene::parameters::{SceneBody, SceneShape};

/// The body, and its rounded shape for contact.
pub(super) fn placed(body: &SceneBody, friction: &Friction) -> Result<(Body, RoundedBody)> {
    let (nominal, shape, volume) = match &body.shape {
        SceneShape::Polyhedron { nominal, rounding } => {
            let shape = RoundedBody::inset(nominal, *rounding)
                .map_err(|e| Error::Mesh { name: body.name.clone(), message: e.to_string() })?;
            (nominal.clone(), shape, nominal.volume())
        }
        SceneShape::Rounded { nominal, rounded } => (nominal.clone(), rounded.clone(), nominal.volume()),
        SceneShape::Sphere(radius) => {
            let volume = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
            (Polyhedron::point(), RoundedBody::sphere(*radius), volume)
        }
    };
    let size = (6.0 * volume / std::f64::consts::PI).cbrt();
    let modulus = body.youngs_modulus / (1.0 - body.poissons_ratio.powi(2));
    let mut placed = Body {
        name: body.name.clone(),
        kind: if body.fixed { BodyKind::Fixed } else { BodyKind::Placed },
        stiffness: if body.unyielding { f64::INFINITY } else { STIFFNESS_RATIO * modulus * size },
        limit_pressure: body.limit_pressure,
        friction: Some(body.friction.unwrap_or(*friction)),
        mass: body.density * volume,
        centre_of_mass: nominal.centroid(),
        offset: body.offset,
        deformation: match (&body.full, &body.grain) {
            (Some(full), _) => Deformation::full(full.clone()),
            (None, Some(grain)) => Deformation::condensed(grain.clone()),
            (None, None) => Deformation::Rigid,
        },
        breakage: match &body.damaged {
            Some(damaged) if body.grain.is_some() => Breakage::Softening(damaged.clone()),
            Some(damaged) => Breakage::Brittle(damaged.clone()),
            None => Breakage::Never,
        },
        rotation_scale: 0.5 * size,
        nominal,
    };
    if body.rests {
        placed.rest();
    }
    Ok((placed, shape))
}
