//! Twenty grains of weak rock at 2.5 MPa, eight packings, sheared to 10 %: collapse after collapse, none of which may stop the run. Before grains fell
//! in pieces under a driven plate one packing of eight stopped.

use std::path::Path;

use riprap::case::read;
use riprap::results::{Existing, HistoryRow};
use riprap::simulation::{End, Observer, Options, Step, run};
use serde_json::{Value, json};

/// Energy that no row accounts for at the end, over the work.
const CLOSED: f64 = 1e-2;

#[derive(Default)]
struct Last(Option<HistoryRow>);

impl Observer for Last {
    fn step_accepted(&mut self, step: &Step<'_>) {
        assert!(step.row.out_of_balance < 1e-3, "{:?}", step.row);
        self.0 = Some(*step.row);
    }
}

fn sheared(seed: u64, rubble: &str) -> HistoryRow {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/crushing/weak_specimen.json");
    let mut raw = read(&file).unwrap_or_else(|e| panic!("{e}"));
    let set: [(&str, Value); 4] = [
        ("/specimen/grains", json!(20)),
        ("/seed", json!(seed)),
        ("/solver/rough_tolerance", json!(null)),
        ("/rock/damage/rubble", json!(rubble)),
    ];
    raw.set(&set.map(|(at, to)| (at.to_string(), to)));
    let case = raw.check().unwrap_or_else(|e| panic!("{e}"));
    let folder = tempfile::tempdir().expect("a folder");
    let options = Options {
        out: folder.path().join("weak.h5"),
        existing: Existing::Refuse,
        threads: 1,
        profile: false,
        audit: false,
    };
    let mut last = Last::default();
    let outcome = run(&case, &raw, &options, &mut last).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(outcome.end, End::Finished, "seed {seed}, rubble {rubble}");
    last.0.expect("rows")
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
