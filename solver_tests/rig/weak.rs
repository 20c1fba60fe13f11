//! Twenty grains of weak rock at 2.5 MPa, eight packings, sheared to 10 %: collapse after collapse, none of which may stop the run.

use riprap::results::HistoryRow;
use serde_json::json;

use crate::recorded::rows_of;

/// Energy that no row accounts for at the end, over the work.
const CLOSED: f64 = 1e-2;

fn sheared(seed: u64, rubble: &str) -> HistoryRow {
    let set =
        [("/specimen/grains", json!(20)), ("/seed", json!(seed)), ("/rock/damage/rubble", json!(rubble))];
    let rows = rows_of("crushing/weak_specimen.json", &set);
    *rows.last().expect("rows")
}

#[test]
#[ignore = "four minutes of a core"]
fn weak_specimens_come_to_their_end() {
    for rubble in ["removed", "kept"] {
        for seed in 1..=8 {
            let row = sheared(seed, rubble);
            assert!((row.axial_strain - 0.1).abs() < 1e-9 && row.deleted_cells > 0, "{row:?}");
            assert!(row.energy_error.abs() < CLOSED * row.energy_external, "seed {seed}, {rubble}: {row:?}");
        }
    }
}
