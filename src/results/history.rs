//! The rows of `/history`, `/bodies/<name>` and `/grains`. One table each gives a row's fields, the names of the
//! datasets, their units and their long names, so that they cannot drift apart.

use crate::tensor::Vec3;

/// What one dataset of numbers is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quantity {
    pub name: &'static str,
    /// Unit as text; `1` for a pure number.
    pub units: &'static str,
    pub long_name: &'static str,
    /// Counted, not measured: stored as 64-bit integers.
    pub integer: bool,
    /// Numbers of one: 1 of a scalar, 3 of a vector, 6 of a symmetric tensor.
    pub width: usize,
}

/// One number of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    Float(f64),
    Integer(i64),
}

/// What a field of a row can be: how many numbers, of which kind, and what stands for one that is not there.
trait Field: Sized {
    const INTEGER: bool = false;
    const WIDTH: usize = 1;
    const NONE: Self;
    fn put(self, numbers: &mut Vec<Value>);
}

impl Field for f64 {
    const NONE: f64 = f64::NAN;
    fn put(self, numbers: &mut Vec<Value>) {
        numbers.push(Value::Float(self));
    }
}

impl Field for i64 {
    const INTEGER: bool = true;
    const NONE: i64 = 0;
    fn put(self, numbers: &mut Vec<Value>) {
        numbers.push(Value::Integer(self));
    }
}

impl Field for [f64; 6] {
    const WIDTH: usize = 6;
    const NONE: [f64; 6] = [f64::NAN; 6];
    fn put(self, numbers: &mut Vec<Value>) {
        numbers.extend(self.map(Value::Float));
    }
}

impl Field for Vec3 {
    const WIDTH: usize = 3;
    const NONE: Vec3 = Vec3::new(f64::NAN, f64::NAN, f64::NAN);
    fn put(self, numbers: &mut Vec<Value>) {
        numbers.extend(self.iter().map(|x| Value::Float(*x)));
    }
}

macro_rules! rows {
    ($(#[$row_doc:meta])* $row:ident, $(#[$table_doc:meta])* $table:ident;
     $($name:ident: $kind:ty, $units:literal, $long_name:literal;)*) => {
        $(#[$row_doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Default)]
        pub struct $row {
            $(#[doc = concat!($long_name, ", in `", $units, "`")] pub $name: $kind,)*
        }

        $(#[$table_doc])*
        pub const $table: &[Quantity] = &[$(Quantity {
            name: stringify!($name),
            units: $units,
            long_name: $long_name,
            integer: <$kind as Field>::INTEGER,
            width: <$kind as Field>::WIDTH,
        },)*];

        impl $row {
            /// A row of which nothing is known: no number where one is measured, zero where one is counted.
            pub const UNKNOWN: $row = $row { $($name: <$kind as Field>::NONE,)* };

            /// The row's numbers in the order of its table, those of a vector one after the other.
            pub fn values(&self) -> Vec<Value> {
                let mut values = Vec::new();
                $(Field::put(self.$name, &mut values);)*
                values
            }
        }
    };
}

rows! {
    /// One body after one accepted increment. Vectors are in space axes, moments about the body's reference point.
    BodyRow,
    /// The datasets of `/bodies/<name>`, each of shape (increments, 3).
    BODY_QUANTITIES;
    position: Vec3, "m", "position of the reference point";
    rotation: Vec3, "rad", "rotation vector from body axes to space axes";
    displacement: Vec3, "m", "displacement of the reference point since the start";
    force: Vec3, "N", "resultant of the contact forces on the body";
    moment: Vec3, "N m", "moment of the contact forces on the body about its reference point";
    reaction_force: Vec3, "N", "force that the body's prescription exerts on it";
    reaction_moment: Vec3, "N m", "moment that the body's prescription exerts on it";
}

rows! {
    /// One grain in one saved state.
    GrainRow,
    /// The per-state datasets of `/grains`, each of shape (states, grains) or (states, grains, width).
    GRAIN_QUANTITIES;
    position: Vec3, "m", "position of the reference point";
    rotation: Vec3, "rad", "rotation vector from body axes to space axes";
    stress: [f64; 6], "Pa", "mean Cauchy stress xx yy zz xy yz xz from the forces on the surface, tension positive; of a grain that came apart its first part's";
    damage_mean: f64, "1", "volume-weighted mean of the damage variable";
    damage_max: f64, "1", "largest damage variable in the grain";
    failed_fraction: f64, "1", "failed share of the integration points";
    fragments: i64, "1", "connected parts of the grain, 1 for a whole one";
    local_shear_strain: f64, "1", "sqrt(2/3 e:e) of the deviatoric strain since strains count, from how the grain's neighbours moved";
    local_volumetric_strain: f64, "1", "volumetric strain since strains count, from how the grain's neighbours moved, compression positive";
    turn: f64, "rad", "angle by which the grain has turned since strains count";
    level: i64, "1", "how the grain deforms: 0 rigid with local compliance, 1 condensed, 2 full";
}

rows! {
    /// One accepted increment. What a run does not have is NaN (a scene has no `void_ratio`).
    HistoryRow,
    /// The datasets of `/history`, in order.
    HISTORY;
    stage: i64, "1", "stage, counted from 0 as in the case file";
    increment: i64, "1", "accepted increment, counted from 1 over all stages";
    time: f64, "1", "stages completed plus the completed share of the present one";
    axial_strain: f64, "1", "axial strain since the start of the consolidation, from the first later stage on since its end; compression positive";
    radial_strain: f64, "1", "radial strain (volumetric - axial) / 2 since the start of the consolidation, from the first later stage on since its end; compression positive";
    volumetric_strain: f64, "1", "volumetric strain since the start of the consolidation, from the first later stage on since its end; compression positive";
    axial_stress: f64, "Pa", "axial stress, compression positive";
    confining_pressure: f64, "Pa", "confining pressure, compression positive";
    deviatoric_stress: f64, "Pa", "deviatoric stress q, axial stress minus confining pressure";
    mean_stress: f64, "Pa", "mean stress p, compression positive";
    stress_ratio: f64, "1", "stress ratio q/p";
    void_ratio: f64, "1", "void ratio, volume of voids over volume of solids, in the volume that the cover encloses; rock that was crushed counts as solid";
    void_ratio_nominal: f64, "1", "void ratio between the walls that the specimen was compacted in, carried on with the change of the cover's volume; rock that was crushed counts as solid";
    cover_volume_ratio: f64, "1", "volume in covers laid anew over that in those they replaced, all since strains are zero: strains are carried over these jumps, the void ratio is not; 1 where none was";
    axial_stress_contacts: f64, "Pa", "axial stress from contact forces (Love-Weber), compression positive";
    radial_stress_contacts: f64, "Pa", "mean radial stress from contact forces (Love-Weber) and the pressure on the cover's rims, compression positive";
    end_friction: f64, "Pa", "what friction on the end plates adds to the radial stress from contact forces";
    membrane_stress: f64, "Pa", "what a rubber membrane adds to the radial stress from contact forces: its tension, and the pressure on its middle, which is farther out than the grains";
    membrane_axial_stress: f64, "Pa", "what a rubber membrane adds to the axial stress from contact forces, beside the ram";
    stress_disagreement: f64, "1", "larger difference of the stresses from contact forces to those of plate and membrane, and of pressure, end friction and membrane, over the mean stress";
    control_error: f64, "1", "by how much what the stage prescribes is missed, relative";
    tangent_modulus: f64, "Pa", "slope of q over the axial strain, over the stage's last 0.1 % of axial strain, at least four increments";
    secant_modulus: f64, "Pa", "change of q over that of the axial strain since the start of the stage";
    dilatancy_angle: f64, "rad", "dilatancy angle psi, sin psi = -d/(2 - d) with the slope d of volumetric over axial strain, taken as the tangent modulus is; positive where the volume grows; none where the specimen is unloaded";
    friction_angle: f64, "rad", "mobilised friction angle phi, sin phi = q/(2 confining pressure + q)";
    peak_friction_angle: f64, "rad", "largest mobilised friction angle since strains count";
    coordination_number: f64, "1", "contacts per grain, plates included";
    mechanical_coordination_number: f64, "1", "contacts per grain that has at least two, plates included";
    rattlers: i64, "1", "grains with fewer than two contacts";
    sliding_fraction: f64, "1", "share of the contact points that slide";
    fabric_xx: f64, "1", "fabric tensor, mean of n n over the contacts between grains, xx";
    fabric_yy: f64, "1", "fabric tensor, yy";
    fabric_zz: f64, "1", "fabric tensor, zz";
    fabric_xy: f64, "1", "fabric tensor, xy";
    fabric_yz: f64, "1", "fabric tensor, yz";
    fabric_xz: f64, "1", "fabric tensor, xz";
    fabric_anisotropy: f64, "1", "fabric zz less the mean of xx and yy";
    contact_force_mean: f64, "N", "mean contact force between grains";
    contact_force_max: f64, "N", "largest contact force between grains";
    contact_force_variation: f64, "1", "standard deviation of the contact forces between grains over their mean";
    strong_fraction: f64, "1", "share of the contacts between grains that carry more than the mean force";
    chained_fraction: f64, "1", "share of the grains in force chains: at least three grains in a row that carry more than the mean, pressed along it within 45 degrees";
    radial_strain_1: f64, "1", "radial strain 1 - sqrt(A / A0) of the lowest of five slices by its cross-section A, compression positive";
    radial_strain_2: f64, "1", "radial strain of the second of five slices from the bottom";
    radial_strain_3: f64, "1", "radial strain of the middle one of five slices";
    radial_strain_4: f64, "1", "radial strain of the fourth of five slices from the bottom";
    radial_strain_5: f64, "1", "radial strain of the uppermost of five slices";
    mean_rotation: f64, "rad", "mean angle by which grains have turned since strains count";
    strain_localisation: f64, "1", "0 where the shear strain around all grains is the same, towards 1 where few see it all";
    dead_fraction: f64, "1", "share of the grains around which the shear strain is below a third of the mean";
    cone_shear: f64, "1", "mean shear strain around the grains in cones of 45 degrees on the plates over that around the others; towards 0 where the cones are dead";
    band_flatness: f64, "1", "spread of the shear strain across the layer that fits it best over that along it; 1 where it is even, towards 0 in a shear band";
    band_inclination: f64, "rad", "angle of that layer to the horizontal; means little where band_flatness is near 1";
    plate_tilt: f64, "rad", "angle by which the top plate is tilted";
    failed_points: i64, "1", "integration points that have failed, so far";
    deleted_cells: i64, "1", "cells that have been deleted, so far";
    fragments: i64, "1", "parts that are left of grains that came apart";
    broken_grains: i64, "1", "grains of a specimen that came apart or of which nothing is left, so far";
    breakage_marsal: f64, "1", "Marsal's B_g over the sieves of the grading; specimens of rock with damage";
    breakage_hardin: f64, "1", "Hardin's relative breakage B_r; specimens of rock with damage";
    breakage_einav: f64, "1", "Einav's breakage B; specimens of rock with damage";
    damaged_share: f64, "1", "share of the solid volume with damage, crushed volume included";
    crushed_share: f64, "1", "share of the solid volume in deleted cells and parts given up";
    condensed_bodies: i64, "1", "bodies that are condensed, behind this increment";
    promoted: i64, "1", "bodies made condensed in this increment or behind it, where fidelity is chosen";
    demoted: i64, "1", "bodies made rigid behind this increment, where fidelity is chosen";
    repeats: i64, "1", "times this increment was repeated with more condensed bodies";
    fidelity_error: f64, "1", "estimated relative error of the contact forces by rigid bodies, where fidelity is chosen";
    resting_utilisation: f64, "1", "largest effective strain in a rigid body over its damage threshold, where fidelity is chosen";
    transition_jump: f64, "1", "largest change of a contact force by changes of fidelity, over the mean contact force";
    augmentations: i64, "1", "augmentations in this increment";
    newton_iterations: i64, "1", "Newton iterations on all unknowns in this increment";
    factorisations: i64, "1", "factorisations of all unknowns in this increment";
    snapped: i64, "1", "1 where more was still moving at the end of this increment than solver.stabilisation asks for, damage or gaps had not settled, or it took many steps to rest; in a scene, where it snapped to another equilibrium, so that its energy is known by balance only";
    cuts: i64, "1", "times this increment was cut before it was accepted";
    wall_time: f64, "s", "wall-clock time since the start of the run";
    solving_time: f64, "s", "wall-clock time of all increments so far, without what came before them and without the file";
    out_of_balance: f64, "1", "largest force out of balance on a body over the mean contact force; on a body of a scene that carries less than that, over what it carries";
    unrest: f64, "1", "mean force out of balance on a body over the mean contact force (unbalanced force ratio)";
    max_penetration: f64, "m", "largest penetration of two bodies";
    energy_external: f64, "J", "work done on the specimen from outside, since the start";
    energy_elastic: f64, "J", "elastic energy stored in grains and contacts, less that at the start";
    energy_friction: f64, "J", "energy dissipated by friction, since the start";
    energy_damage: f64, "J", "energy dissipated by damage, crushing included, since the start";
    energy_crushing_contacts: f64, "J", "part of energy_damage: work of indentation, what contacts of asperities crushed of the rock, since the start";
    energy_crushing: f64, "J", "part of energy_damage: what contacts on failed rock had stored, and the work done against their forces while these are taken away, since the start";
    energy_stabilisation: f64, "J", "work of the forces out of balance, summed step by step: of the drag on what moves; in a scene also what snaps set free, since the start";
    energy_reshaped: f64, "J", "energy that contacts gained where breaking changed the shapes of bodies, which came from nowhere, since the start";
    energy_membrane: f64, "J", "elastic energy stored in the membrane";
    energy_gap: f64, "1", "energy error of this increment over the larger of the work that ram and pressure exchanged in it and what it lost";
    energy_error: f64, "J", "external work minus all other energies";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_names_are_unique_and_described() {
        for (at, quantity) in HISTORY.iter().enumerate() {
            assert!(!quantity.units.is_empty() && !quantity.long_name.is_empty(), "{}", quantity.name);
            assert!(HISTORY[..at].iter().all(|other| other.name != quantity.name), "{}", quantity.name);
        }
    }

    #[test]
    fn unknown_rows_say_so() {
        assert!(HistoryRow::UNKNOWN.void_ratio.is_nan() && HistoryRow::UNKNOWN.cuts == 0);
    }

    #[test]
    fn row_values_follow_the_table() {
        let row = HistoryRow { stage: 3, energy_error: -2.5, ..HistoryRow::default() };
        let values = row.values();
        assert_eq!(values.len(), HISTORY.len());
        assert_eq!(values[0], Value::Integer(3));
        assert_eq!(values[values.len() - 1], Value::Float(-2.5));
        for (value, quantity) in values.iter().zip(HISTORY) {
            assert_eq!(matches!(value, Value::Integer(_)), quantity.integer, "{}", quantity.name);
        }
    }
}
