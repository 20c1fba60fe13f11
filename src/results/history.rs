//! `/history`: one row per accepted increment. The one table below gives the row's fields, the names
//! of the datasets, their units and their long names, so that they cannot drift apart.

/// What one dataset of numbers is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quantity {
    pub name: &'static str,
    /// Unit as text; `1` for a pure number.
    pub units: &'static str,
    pub long_name: &'static str,
    /// Counted, not measured: stored as 64-bit integers.
    pub integer: bool,
}

/// One number of a history row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    Float(f64),
    Integer(i64),
}

impl From<f64> for Value {
    fn from(value: f64) -> Self {
        Value::Float(value)
    }
}

impl From<i64> for Value {
    fn from(value: i64) -> Self {
        Value::Integer(value)
    }
}

/// Whether a field's type is an integer, for the table.
trait Counted {
    const INTEGER: bool;
}
impl Counted for f64 {
    const INTEGER: bool = false;
}
impl Counted for i64 {
    const INTEGER: bool = true;
}

macro_rules! history {
    ($($name:ident: $kind:ty, $units:literal, $long_name:literal;)*) => {
        /// One accepted increment. What a run does not have is NaN (a scene has no `void_ratio`).
        #[derive(Debug, Clone, Copy, PartialEq, Default)]
        pub struct HistoryRow {
            $(#[doc = concat!($long_name, ", in `", $units, "`")] pub $name: $kind,)*
        }

        /// The datasets of `/history`, in order.
        pub const HISTORY: &[Quantity] = &[$(Quantity {
            name: stringify!($name),
            units: $units,
            long_name: $long_name,
            integer: <$kind as Counted>::INTEGER,
        },)*];

        impl HistoryRow {
            /// The row's numbers in the order of [`HISTORY`].
            pub fn values(&self) -> Vec<Value> {
                vec![$(self.$name.into(),)*]
            }
        }
    };
}

history! {
    stage: i64, "1", "stage, counted from 0 as in the case file";
    increment: i64, "1", "accepted increment, counted from 1 over all stages";
    time: f64, "1", "stages completed plus the completed share of the present one";
    axial_strain: f64, "1", "axial strain since the start of the consolidation, from the first later stage on since its end; compression positive";
    radial_strain: f64, "1", "radial strain since the start of the consolidation, from the first later stage on since its end; compression positive";
    volumetric_strain: f64, "1", "volumetric strain since the start of the consolidation, from the first later stage on since its end; compression positive";
    axial_stress: f64, "Pa", "axial stress, compression positive";
    confining_pressure: f64, "Pa", "confining pressure, compression positive";
    deviatoric_stress: f64, "Pa", "deviatoric stress q, axial stress minus confining pressure";
    mean_stress: f64, "Pa", "mean stress p, compression positive";
    void_ratio: f64, "1", "void ratio, volume of voids over volume of solids";
    coordination_number: f64, "1", "mean number of grains that a grain touches";
    sliding_fraction: f64, "1", "share of the contact points that slide";
    failed_points: i64, "1", "integration points that have failed, so far";
    deleted_cells: i64, "1", "cells that have been deleted, so far";
    fragments: i64, "1", "fragments split off by deletion, so far";
    augmentations: i64, "1", "augmentations in this increment";
    newton_iterations: i64, "1", "Newton iterations in this increment";
    factorisations: i64, "1", "factorisations in this increment";
    cuts: i64, "1", "times this increment was cut before it was accepted";
    wall_time: f64, "s", "wall-clock time since the start of the run";
    out_of_balance: f64, "1", "out-of-balance force over the mean contact force";
    max_penetration: f64, "m", "largest penetration of two bodies";
    energy_external: f64, "J", "work done on the specimen from outside, since the start";
    energy_elastic: f64, "J", "elastic energy stored in grains and contacts, less that at the start";
    energy_friction: f64, "J", "energy dissipated by friction, since the start";
    energy_damage: f64, "J", "energy dissipated by damage, since the start";
    energy_stabilisation: f64, "J", "energy set free in increments that snapped, where numerical stabilisation stands in for motion, since the start";
    energy_membrane: f64, "J", "elastic energy stored in the membrane";
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
