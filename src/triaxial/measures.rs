//! Stress and strain of the specimen as a whole, and what else is measured on an accepted increment.
//! Compression positive.

use serde::{Deserialize, Serialize};

use crate::assembly::Contacts;
use crate::model::BodyKind;
use crate::tensor::{Pose, Vec3};
use crate::triaxial::chains::{body_stresses, chained_fraction};
use crate::triaxial::deformation::{LocalStrain, Neighbourhood, SLICES, Unevenness, slice_strains};
use crate::triaxial::drive::Origin;
use crate::triaxial::network::{
    Network, end_friction, mean_stress, membrane_stress, outside_forces, pair_forces,
};
use crate::triaxial::rig::Rig;
use crate::triaxial::zones::Zones;

/// Stresses and strains of an increment.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Measures {
    pub axial_strain: f64,
    pub radial_strain: f64,
    pub volumetric_strain: f64,
    /// [Pa]
    pub axial_stress: f64,
    /// [Pa]
    pub confining_pressure: f64,
    /// Axial stress less confining pressure, `q` [Pa]: the ram's force over the current area.
    pub deviatoric_stress: f64,
    /// `p = (axial + 2 confining) / 3` [Pa]
    pub mean_stress: f64,
    /// Of the volume that the cover encloses.
    pub void_ratio: f64,
    /// The void ratio between the walls that the specimen was compacted in, carried on with the change of the
    /// cover's volume since it was draped.
    pub void_ratio_nominal: f64,
    /// What new covers enclosed over what those did that they replaced, all since strains are zero: strains are carried over these jumps, the void
    /// ratio is not, so `(1 + e) / (1 + e_0)` is `1 - volumetric_strain` times this.
    pub cover_volume_ratio: f64,
}

/// Stress from contact forces, beside what plates and pressure say.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ContactStress {
    /// [Pa]
    pub axial: f64,
    /// Mean over the horizontal directions [Pa].
    pub radial: f64,
    /// What friction on the plates adds to the mean radial stress [Pa].
    pub end_friction: f64,
    /// What a rubber membrane adds to it [Pa].
    pub membrane: f64,
    /// What it adds to the axial stress, beside the ram [Pa].
    pub membrane_axial: f64,
    /// The larger difference to the axial stress of plate and membrane, and to pressure, end friction and membrane, over the
    /// mean stress.
    pub disagreement: f64,
}

/// What else is known of an accepted increment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Picture {
    pub contact_stress: ContactStress,
    pub network: Network,
    /// Share of the grains that are in force chains.
    pub chained_fraction: f64,
    pub unevenness: Unevenness,
    pub zones: Zones,
    /// Radial strain of slices of equal height, from the bottom.
    pub slices: [f64; SLICES],
    /// Angle of the top plate's axis to the specimen's [rad].
    pub tilt: f64,
}

/// The state at which strains are zero.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Zero {
    /// [m]
    pub height: f64,
    /// [m^3]
    pub volume: f64,
    /// Of new covers over those that they replaced ([`Measures::cover_volume_ratio`]).
    cover_volume_ratio: f64,
    /// Cross-sections of the slices [m^2].
    areas: [f64; SLICES],
    pub neighbourhood: Neighbourhood,
}

impl Zero {
    /// The rig as it stands.
    pub fn of(rig: &Rig) -> Self {
        let poses = &rig.committed.poses;
        // Grains come first; those that broke are seen by the frames of their largest parts.
        let grains = rig.model.bodies.iter().take_while(|body| body.kind != BodyKind::Plate);
        let diameter = |volume: f64| (6.0 * volume / std::f64::consts::PI).cbrt();
        let diameters: Vec<f64> = grains.map(|body| diameter(body.nominal.volume())).collect();
        Zero {
            height: rig.height(poses),
            volume: rig.volume(poses),
            cover_volume_ratio: 1.0,
            areas: section_areas(rig, poses),
            neighbourhood: Neighbourhood::new(&rig.model.frames(poses), &diameters),
        }
    }
}

impl Zero {
    /// Has the rig lay a new cover where the old one is folded; strains go on from what they are, though the new one encloses another
    /// volume.
    pub(super) fn mend(&mut self, rig: &mut Rig) {
        let before = (rig.volume(&rig.committed.poses), section_areas(rig, &rig.committed.poses));
        if rig.mend_cover() {
            let jump = rig.volume(&rig.committed.poses) / before.0;
            self.volume *= jump;
            self.cover_volume_ratio *= jump;
            let now = section_areas(rig, &rig.committed.poses);
            for (area, (now, before)) in self.areas.iter_mut().zip(now.iter().zip(&before.1)) {
                *area *= now / before;
            }
        }
    }
}

fn section_areas(rig: &Rig, poses: &[Pose]) -> [f64; SLICES] {
    let mut areas = [f64::NAN; SLICES];
    if let Some(cover) = &rig.model.cover {
        cover.section_areas_into(&mut areas, poses);
    }
    if let Some(wall) = &rig.model.wall {
        areas.fill(wall.volume(poses) / wall.height(poses));
    }
    areas
}

impl Measures {
    /// `state` is that of the increment.
    pub fn of(rig: &Rig, state: &Origin, zero: &Zero) -> Self {
        let axial_strain = 1.0 - state.height / zero.height;
        let volumetric_strain = 1.0 - state.volume / zero.volume;
        let (p, q) = (state.pressure, state.deviatoric_stress);
        Measures {
            axial_strain,
            radial_strain: 0.5 * (volumetric_strain - axial_strain),
            volumetric_strain,
            axial_stress: p + q,
            confining_pressure: p,
            deviatoric_stress: q,
            mean_stress: p + q / 3.0,
            void_ratio: state.volume / rig.solid_volume - 1.0,
            void_ratio_nominal: rig.nominal_ratio * state.volume / rig.solid_volume - 1.0,
            cover_volume_ratio: zero.cover_volume_ratio,
        }
    }
}

impl Picture {
    /// `contacts` were last evaluated at `poses`, under what `measures` says.
    pub fn of(
        rig: &Rig,
        contacts: &Contacts,
        poses: &[Pose],
        measures: &Measures,
        zero: &Zero,
        local_strains: &[LocalStrain],
    ) -> Self {
        let pairs = pair_forces(contacts);
        let volume = rig.volume(poses);
        let outside = outside_forces(&rig.model, contacts, poses, measures.confining_pressure);
        let stress = mean_stress(&rig.model, &pairs, &outside, poses, volume);
        let (axial, radial) = (stress[(2, 2)], 0.5 * (stress[(0, 0)] + stress[(1, 1)]));
        let end_friction = end_friction(&pairs, &[rig.bottom, rig.top], volume);
        let sheet = rig.model.membrane.as_ref();
        let (pressure, inside) = (measures.confining_pressure, rig.rubber_inside());
        let of_sheet = |sheet| membrane_stress(sheet, &contacts.membrane, pressure, volume, inside);
        let [membrane, membrane_axial] = sheet.map_or([0.0; 2], of_sheet);
        let off = (axial - measures.axial_stress - membrane_axial)
            .abs()
            .max((radial - measures.confining_pressure - end_friction - membrane).abs());
        let is_grain: Vec<bool> = rig.model.bodies.iter().map(|body| body.kind == BodyKind::Grain).collect();
        let volumes: Vec<Option<f64>> = (rig.model.bodies.iter())
            .map(|body| (body.kind == BodyKind::Grain).then(|| body.nominal.volume()))
            .collect();
        let positions: Vec<Vec3> = poses[..volumes.len()].iter().map(|pose| pose.position).collect();
        let stresses = body_stresses(&pairs, &outside, &positions, &volumes);
        let radius = (zero.volume / (std::f64::consts::PI * zero.height)).sqrt();
        let upright = poses[rig.top].rotation * Vec3::z();
        Picture {
            contact_stress: ContactStress {
                axial,
                radial,
                end_friction,
                membrane,
                membrane_axial,
                disagreement: off / measures.mean_stress.abs(),
            },
            network: Network::of(&pairs, &is_grain),
            chained_fraction: chained_fraction(&pairs, &stresses, &positions, &volumes),
            unevenness: Unevenness::of(local_strains),
            zones: Zones::of(&zero.neighbourhood.positions(), local_strains, zero.height, radius),
            slices: slice_strains(&zero.areas, &section_areas(rig, poses)),
            tilt: upright.angle(&Vec3::z()),
        }
    }
}
