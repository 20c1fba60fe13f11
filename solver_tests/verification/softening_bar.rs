//! Energy that it takes to pull a bar of tet10 cells apart, on three meshes.
//!
//! nu = 0, ends tied along its axis, the middle layer of bricks 2 % weaker. The cells soften unevenly inside (four points each, quadratic displacement), so
//! the crack is narrower than its layer and takes less than `G_f A`, by the same share on every mesh: the shares agree within 2 %.
//!
//! Bazant & Oh (1983), "Crack band theory for fracture of concrete", Mater. Struct. 16:155-177.

use riprap::crushing::{Grip, Memory, Patches};
use riprap::grain::{Ancestry, DamagedGrain};
use riprap::material::{DamageLaw, DamageParameters, Elastic};
use riprap::mesh::{CellId, Mesh, cuboid_mesh};
use riprap::verification::crush::{Ending, Record, bench};
use riprap::verification::damage::{E, F_BAR as F_T, LENGTH, meshed_bar, share_of_band};

fn report(what: &str, bricks: usize, record: &Record) {
    let last = record.rows[record.rows.len() - 1];
    println!(
        "{what}, {bricks} bricks: {} rows to {:.2e} m, peak {:.4} f_t A, damage {:.6e} J, elastic {:.1e}, stabilisation {:.2e}, failed {}, deleted {}, {} factors, {}",
        record.rows.len(),
        last.travel,
        record.peak() / (F_T * (LENGTH / bricks as f64).powi(2)),
        last.damage,
        last.elastic,
        last.stabilisation,
        last.failed_points,
        last.deleted_cells,
        record.rows.iter().map(|row| row.factorisations).sum::<usize>(),
        match &record.ending {
            Ending::Finished => "finished".into(),
            Ending::Softened => "softened".into(),
            Ending::Broken(parts) => format!("broken into {}", parts.fragments.len()),
            Ending::Gone => "gone".into(),
            Ending::Stalled { reason } => format!("stalled: {reason}"),
        }
    );
}

#[test]
fn meshed_bars_take_the_same_share_on_every_mesh() {
    let share = |bricks: usize| {
        let record = meshed_bar(bricks);
        let area = (LENGTH / bricks as f64).powi(2);
        report("crack band, w_c = 0", bricks, &record);
        // The increments near the peak are 1/14 of its elongation.
        assert!((record.peak() / (0.98 * F_T * area) - 1.0).abs() < 1.0 / 14.0);
        share_of_band(&record, bricks)
    };
    let shares = [3, 5, 9].map(share);
    println!("damage energy over G_f A: {shares:.3?}");
    for found in shares {
        assert!((found / shares[0] - 1.0).abs() < 0.02 && found < 1.02, "{shares:?}");
    }
}

/// The middle of a bar that lost both its ends: no plate ties its own highest and lowest nodes.
#[test]
fn a_loose_middle_is_tied_to_no_plate() {
    let edge = LENGTH / 3.0;
    let mesh = cuboid_mesh([edge, edge, LENGTH], edge).expect("a mesh");
    let elastic = Elastic::new(E, 0.0).expect("allowed");
    let law = DamageLaw::new(elastic, F_T, 20.0 * F_T, &DamageParameters::default(), edge).expect("a law");
    let grain = |mesh: Mesh| {
        let laws = vec![law; mesh.cells.len()];
        DamagedGrain::new(mesh, laws, 2700.0, Ancestry::of_grain(0)).expect("a grain")
    };
    let height = |cell: CellId| mesh.corners(cell).iter().map(|p| p.z / 4.0).sum::<f64>();
    let cells: Vec<CellId> = mesh.cell_ids().filter(|cell| height(*cell).abs() < 0.5 * edge).collect();
    let (middle, nodes) = mesh.part(&cells).expect("a part");
    let (whole, middle) = (grain(mesh.clone()), grain(middle));
    let mut bench = bench(&whole, Grip::Tied);
    bench.plates[1].height += 1e-6;
    let pulled = bench.contact(&whole, &Patches::of(&whole, None), &Memory::default()).expect("a state");
    assert!(pulled.force() < 0.0);
    let memory = pulled.memory.carried_over(&whole, &middle, &nodes);
    let loose = bench.contact(&middle, &Patches::of(&middle, None), &memory).expect("a state");
    assert!(loose.pushes.is_empty(), "{:?}", loose.pushes);
}
