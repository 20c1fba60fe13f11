//! A stage resolved against the state it starts from: the loads and prescribed motions at any share
//! of it. Compression positive, forces on the top plate upwards.

use serde::{Deserialize, Serialize};

use crate::loading::{Pace, Portion};
use crate::model::{Control, Controlled, Loads};
use crate::tensor::Vector6;
use crate::triaxial::rig::Rig;
use crate::triaxial::stage::{Lateral, Path, Stage, Steps};

/// Prescribed kinematic quantities are met to this share of an increment's axial strain.
pub const CONTROL_TOLERANCE: f64 = 1e-3;

/// A pressure that follows from something else may not fall below this share of that at the start of the stage.
const LEAST_PRESSURE: f64 = 1e-3;

/// Where a stage starts: what of the state its path depends on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// [m]
    pub height: f64,
    /// [m^3]
    pub volume: f64,
    /// [Pa]
    pub pressure: f64,
    /// [Pa]
    pub deviatoric_stress: f64,
    /// Position of the top plate's reference point along z [m].
    pub top: f64,
    /// Whether the top plate was loaded, not driven.
    pub loaded: bool,
}

/// A stage under way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Drive {
    pub origin: Origin,
    kind: Kind,
    /// Height that strains count from [m].
    height: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
enum Kind {
    /// Pressure and deviatoric stress at the end [Pa].
    Loaded { pressure: f64, deviatoric_stress: f64 },
    /// Travel of the top plate [m], upwards.
    Driven { travel: f64, lateral: Lateral },
}

/// The state that loads are computed from: the one before the increment, or a better guess.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Guess {
    /// Cross-section [m^2].
    pub area: f64,
    /// [Pa]
    pub pressure: f64,
    /// [Pa]
    pub deviatoric_stress: f64,
}

impl Drive {
    /// Strains count from `height` [m]; `turning` is the height [m] to which [`Path::Return`] leads.
    pub fn new(stage: &Stage, origin: Origin, height: f64, turning: Option<f64>) -> Self {
        let driven = |travel: f64, lateral: Lateral| Kind::Driven { travel, lateral };
        let kind = match stage.path {
            Path::Stress { axial, radial } => {
                Kind::Loaded { pressure: radial, deviatoric_stress: axial - radial }
            }
            Path::Shear { deviatoric_stress } => {
                Kind::Loaded { pressure: origin.pressure, deviatoric_stress }
            }
            Path::Strain { axial_strain, lateral } => driven(-axial_strain * height, lateral),
            Path::Return { lateral } => driven(turning.map_or(0.0, |height| height - origin.height), lateral),
            Path::Hold if origin.loaded => {
                Kind::Loaded { pressure: origin.pressure, deviatoric_stress: origin.deviatoric_stress }
            }
            Path::Hold => driven(0.0, Lateral::Pressure),
        };
        Drive { origin, kind, height }
    }

    /// Axial strain of the whole path, shortening positive; zero where the plate is loaded.
    pub fn axial_strain(&self) -> f64 {
        match self.kind {
            Kind::Loaded { .. } => 0.0,
            Kind::Driven { travel, .. } => -travel / self.height,
        }
    }

    /// Deviatoric stress that a loaded plate is to reach [Pa], where that is more than there was.
    pub fn asked_stress(&self) -> Option<f64> {
        match self.kind {
            Kind::Loaded { deviatoric_stress, .. } => {
                (deviatoric_stress > self.origin.deviatoric_stress).then_some(deviatoric_stress)
            }
            Kind::Driven { .. } => None,
        }
    }

    /// To what a pressure that follows from something else may fall [Pa]; one that the stage prescribes may fall to anything.
    pub fn least_pressure(&self) -> f64 {
        match self.kind {
            Kind::Loaded { .. } | Kind::Driven { lateral: Lateral::Pressure, .. } => 0.0,
            Kind::Driven { .. } => LEAST_PRESSURE * self.origin.pressure,
        }
    }

    /// Whether the pressure follows from the volume under the cover.
    pub fn prescribes_volume(&self) -> bool {
        matches!(self.kind, Kind::Driven { lateral: Lateral::Volume | Lateral::Area, .. })
    }

    /// Whether each increment has to come to rest: nothing drives the specimen, or it is unloaded.
    pub fn comes_to_rest(&self) -> bool {
        match self.kind {
            Kind::Loaded { pressure, deviatoric_stress } => {
                pressure <= self.origin.pressure && deviatoric_stress <= self.origin.deviatoric_stress
            }
            Kind::Driven { travel, .. } => travel >= 0.0,
        }
    }

    pub fn is_loaded(&self) -> bool {
        matches!(self.kind, Kind::Loaded { .. })
    }

    /// Step control over the path; `smallest` is a share of the nominal increment.
    pub fn pace(&self, steps: &Steps, smallest: f64) -> Pace {
        match *steps {
            Steps::Count(count) => {
                let nominal = 1.0 / count.max(1) as f64;
                Pace::new(nominal, smallest * nominal, nominal)
            }
            Steps::Strain { nominal, largest, growth } => {
                let strain = self.axial_strain().abs().max(f64::MIN_POSITIVE);
                // Sizes, whichever way the plate goes.
                let share = (nominal.abs() / strain).min(1.0);
                Pace::new(share, smallest * share, (largest.abs() / strain).min(1.0)).growing_by(growth)
            }
        }
    }

    /// Motion of the top plate since the start of the stage [m] at the share `to`, where it is driven.
    pub fn lift(&self, to: f64) -> Option<f64> {
        match self.kind {
            Kind::Loaded { .. } => None,
            Kind::Driven { travel, .. } => Some(to * travel),
        }
    }

    /// Loads at the end of an increment.
    pub fn loads(&self, rig: &Rig, Portion { share, to }: Portion, guess: &Guess) -> Loads {
        let up = |force: f64| Vector6::new(0.0, 0.0, force, 0.0, 0.0, 0.0);
        let origin = &self.origin;
        match self.kind {
            Kind::Loaded { pressure, deviatoric_stress } => {
                let at = |from: f64, end: f64| from + to * (end - from);
                let mut loads = rig.loads(true, at(origin.pressure, pressure));
                loads.applied[rig.top] = up(-at(origin.deviatoric_stress, deviatoric_stress) * guess.area);
                loads
            }
            Kind::Driven { lateral: Lateral::Pressure, .. } => rig.loads(false, origin.pressure),
            Kind::Driven { travel, lateral: Lateral::MeanStress } => {
                // The factor is q: the plate needs -q A, and the pressure that keeps p is p - q / 3.
                let mean = origin.pressure + origin.deviatoric_stress / 3.0;
                let mut loads = rig.loads(true, mean);
                loads.control = Some(Control {
                    pressure: -1.0 / 3.0,
                    applied: vec![(rig.top, up(-guess.area))],
                    of: Controlled::Position { body: rig.top, axis: 2 },
                    target: origin.top + to * travel,
                    tolerance: CONTROL_TOLERANCE * share * travel.abs(),
                    guess: guess.deviatoric_stress,
                });
                loads
            }
            Kind::Driven { travel, lateral: Lateral::Volume | Lateral::Area } => {
                let mut loads = rig.loads(false, 0.0);
                loads.control = Some(Control {
                    pressure: 1.0,
                    applied: Vec::new(),
                    of: Controlled::Volume,
                    // The control sees the whole of what is enclosed.
                    target: self.volume(to).unwrap_or(origin.volume) + rig.rubber_inside(),
                    tolerance: CONTROL_TOLERANCE * share * travel.abs() / origin.height * origin.volume,
                    guess: guess.pressure,
                });
                loads
            }
        }
    }

    /// Volume prescribed at the share `to` [m^3], where one is.
    fn volume(&self, to: f64) -> Option<f64> {
        let Origin { height, volume, .. } = self.origin;
        match self.kind {
            Kind::Driven { lateral: Lateral::Volume, .. } => Some(volume),
            Kind::Driven { travel, lateral: Lateral::Area } => Some(volume * (1.0 + to * travel / height)),
            Kind::Driven { lateral: Lateral::Pressure | Lateral::MeanStress, .. } | Kind::Loaded { .. } => {
                None
            }
        }
    }

    /// Pressure [Pa] in force at the share `to`, given the control's `factor`.
    pub fn pressure(&self, to: f64, factor: f64) -> f64 {
        let origin = &self.origin;
        match self.kind {
            Kind::Loaded { pressure, .. } => origin.pressure + to * (pressure - origin.pressure),
            Kind::Driven { lateral: Lateral::Pressure, .. } => origin.pressure,
            Kind::Driven { lateral: Lateral::MeanStress, .. } => {
                origin.pressure + (origin.deviatoric_stress - factor) / 3.0
            }
            Kind::Driven { lateral: Lateral::Volume | Lateral::Area, .. } => factor,
        }
    }

    /// By how much what the stage prescribes is missed at the share `to`, relative: stresses to the
    /// larger of their value and the pressure, the volume to the volume that an increment of `share`
    /// sweeps, the position of the plate to its travel in it. `state` is what was measured.
    pub fn miss(&self, Portion { share, to }: Portion, state: &Origin) -> f64 {
        let origin = &self.origin;
        let relative = |is: f64, should: f64, to: f64| (is - should).abs() / to.max(f64::MIN_POSITIVE);
        let position = |travel: f64| relative(state.top, origin.top + to * travel, share * travel.abs());
        match self.kind {
            Kind::Loaded { pressure, deviatoric_stress } => {
                let at = |from: f64, end: f64| from + to * (end - from);
                let p = at(origin.pressure, pressure);
                let q = at(origin.deviatoric_stress, deviatoric_stress);
                relative(state.pressure, p, p).max(relative(state.deviatoric_stress, q, q.abs().max(p)))
            }
            Kind::Driven { travel: 0.0, .. } => relative(state.top, origin.top, origin.height),
            Kind::Driven { travel, lateral: Lateral::Pressure } => {
                relative(state.pressure, origin.pressure, origin.pressure).max(position(travel))
            }
            Kind::Driven { travel, lateral: Lateral::MeanStress } => {
                let mean = |o: &Origin| o.pressure + o.deviatoric_stress / 3.0;
                relative(mean(state), mean(origin), mean(origin)).max(position(travel))
            }
            Kind::Driven { travel, lateral: Lateral::Volume | Lateral::Area } => {
                let swept = share * travel.abs() / origin.height * origin.volume;
                let volume = self.volume(to).unwrap_or(origin.volume);
                relative(state.volume, volume, swept).max(position(travel))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_prescribed_pressure_may_fall_to_anything() {
        let least = |kind: Kind| {
            let origin = Origin {
                height: 0.6,
                volume: 0.04,
                pressure: 1e7,
                deviatoric_stress: 0.0,
                top: 0.6,
                loaded: false,
            };
            Drive { origin, kind, height: 0.6 }.least_pressure()
        };
        let driven = |lateral: Lateral| Kind::Driven { travel: -0.01, lateral };
        // From 10 MPa to 5 kPa: a thousandth was taken for a collapse.
        assert_eq!(least(Kind::Loaded { pressure: 5e3, deviatoric_stress: 0.0 }), 0.0);
        assert_eq!(least(driven(Lateral::Pressure)), 0.0);
        for follows in [Lateral::Volume, Lateral::Area, Lateral::MeanStress] {
            assert_eq!(least(driven(follows)), 1e4);
        }
    }
}
