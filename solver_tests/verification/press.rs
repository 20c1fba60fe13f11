//! A press as a scene (`cases/crushing`), from the case file on.
//!
//! - Block between smooth plates: `F = E A u / L` of the mean modulus to 2 % (cells scatter with shape 20: 6 % each, so 0.6 % for the mean of a hundred; the
//!   mesh's own variation of stress takes the rest) and the peak between the weakest cell's strength times the area and the mean strength's.
//! - The plates meet only what their faces cover; nothing comes from nowhere (1e-3 of the work).
//! - A body that comes apart goes on as bodies of its own, and a stored state goes on to the same bits, breaking included.

use std::path::Path;

use serde_json::{Value, json};

use crate::scene_rows::{rows, scene};
use riprap::case::{Case, RawCase};
use riprap::loading::StageEnd;
use riprap::scene::{Row, SceneState};

fn case(text: &str, changes: &[(&str, Value)]) -> Case {
    let mut raw = RawCase::parse(Path::new("press.json"), text).expect("JSON");
    raw.set(&changes.iter().map(|(at, value)| (at.to_string(), value.clone())).collect::<Vec<_>>());
    raw.check().unwrap_or_else(|error| panic!("{error}"))
}

/// Force on the upper plate, the third body [N].
fn force(row: &Row) -> f64 {
    row.bodies[2].contact_force.z
}

#[test]
fn block_carries_its_strength_over_its_face() {
    let case = case(include_str!("../../cases/crushing/uniaxial_block.json"), &[]);
    let (found, end) = rows(&mut scene(&case), usize::MAX);
    assert_eq!(end, StageEnd::Finished);
    let (area, length) = (4e-4, 40e-3);
    let first = &found[3];
    let expected = 30e9 * area * -first.bodies[2].displacement.z / length;
    println!("block: {:.1} N at {:.1} N of the mean modulus", force(first), expected);
    assert!((force(first) / expected - 1.0).abs() < 0.02);
    let peak = found.iter().map(force).fold(0.0, f64::max);
    println!("block: peak {:.3} of f_c A, {} rows", peak / (60e6 * area), found.len());
    assert!(peak < 60e6 * area && peak > 0.5 * 60e6 * area, "{peak}");
    let last = &found[found.len() - 1];
    assert!(force(last) < 0.2 * peak && last.damage.failed_points > 0);
    for row in &found {
        let ledger = &row.ledger;
        assert!(ledger.error().abs() < 1e-3 * ledger.external, "{ledger:?}");
        assert!((row.bodies[0].contact_force.z + force(row)).abs() < 1e-6 * peak, "the plates balance");
        assert!(row.bodies[0].displacement.norm() == 0.0, "the lower plate is fixed");
    }
}

/// Plates push nodes, whatever contacts of bodies would go by: the same bits, and a remark that the key decides nothing.
#[test]
fn asperities_change_nothing_in_a_press() {
    let text = include_str!("../../cases/crushing/grain_between_plates.json");
    let first_rows = |changes: &[(&str, Value)]| {
        let case = case(text, changes);
        let told = case.remarks().iter().any(|remark| remark.contains("contact.normal \"asperity\" decides"));
        (rows(&mut scene(&case), 3).0, told)
    };
    let (by_springs, silent) = first_rows(&[]);
    let (by_asperities, told) = first_rows(&[("/contact/normal", json!("asperity"))]);
    assert!(force(&by_springs[2]) > 0.0 && by_springs == by_asperities);
    assert!(!silent && told);
}

#[test]
fn small_faces_meet_what_they_cover() {
    let changes =
        [("/stages/0/increments", json!(400)), ("/stages/0/bodies/top/displacement/2", json!("-4 um"))];
    let case = case(include_str!("../../cases/crushing/point_load.json"), &changes);
    let mut scene = scene(&case);
    let (found, _) = rows(&mut scene, 3);
    assert!(force(&found[2]) > 0.0);
    let pressing = scene.pressing.as_ref().expect("a press");
    assert!(!pressing.pushes().is_empty());
    for (_, push) in pressing.pushes() {
        assert!(push.at.x.abs() < 2.1e-3 && push.at.y.abs() < 2.1e-3, "{:?}", push.at);
    }
}

#[test]
fn a_broken_grain_goes_on_and_a_stored_state_goes_on_to_the_same_bits() {
    let case = case(include_str!("../../cases/crushing/grain_between_plates.json"), &[]);
    let mut whole = scene(&case);
    let (all, end) = rows(&mut whole, usize::MAX);
    let last = &all[all.len() - 1];
    let peak = all.iter().map(force).fold(0.0, f64::max);
    println!(
        "grain: {} rows, peak {peak:.0} N, {:?}, {} bodies, {end:?}",
        all.len(),
        last.damage,
        whole.model.bodies.len()
    );
    assert_eq!(end, StageEnd::Finished);
    assert!(last.damage.deleted_cells > 0, "{:?}", last.damage);
    let deleting = all.iter().position(|row| row.damage.deleted_cells > 0).expect("cells go");
    let mut stops = vec![deleting.saturating_sub(1).max(1), deleting + 1, deleting + 2];
    if let Some(apart) = all.iter().position(|row| row.damage.fragments > 0) {
        stops.push(apart + 1);
    }
    for stop in stops.into_iter().filter(|stop| *stop < all.len()) {
        let mut part = scene(&case);
        let (first, _) = rows(&mut part, stop);
        assert_eq!(first, all[..stop]);
        let bytes = postcard::to_allocvec(&part.state()).expect("bytes");
        let mut fresh = scene(&case);
        let state: SceneState<'_> = postcard::from_bytes(&bytes).expect("a state");
        assert!(fresh.restore(state).expect("grains"), "another scene");
        let (rest, _) = rows(&mut fresh, all.len() - stop);
        assert_eq!(rest.len(), all.len() - stop);
        assert!(rest == all[stop..], "from row {stop}");
        assert!(fresh.committed == whole.committed);
    }
}

#[test]
fn what_does_not_go_with_a_press_is_refused() {
    let text = include_str!("../../cases/crushing/uniaxial_block.json");
    for (pointer, value, path) in [
        ("/scene/press/body", json!("blok"), "$.scene.press.body"),
        ("/scene/press/top", json!("bottom"), "$.scene.press"),
        ("/scene/bodies/1/fidelity", json!("rigid"), "$.scene.bodies[1].fidelity"),
        ("/scene/bodies/0/fixed", json!(false), "$.scene.bodies[0].fixed"),
        ("/scene/bodies/2/shape", json!({"sphere": "5 mm"}), "$.scene.bodies[2].shape"),
        ("/scene/gravity", json!([0, 0, -9.81]), "$.scene.gravity"),
        ("/rock/damage", json!(null), "$.rock.damage"),
        // So small that all points would seem to flip.
        ("/solver/damage_change", json!(5e-4), "$.solver.damage_change"),
        ("/stages/0/bodies/top/displacement/0", json!("1 mm"), "$.stages[0].bodies.top.displacement"),
        ("/stages/0/bodies/block", json!({"displacement": [0, 0, "1 mm"]}), "$.stages[0].bodies.block"),
    ] {
        let value_of_file: Value = RawCase::parse(Path::new("press.json"), text).expect("JSON").value;
        let mut raw = RawCase::parse(Path::new("press.json"), &value_of_file.to_string()).expect("JSON");
        raw.set(&[(pointer.to_string(), value)]);
        let error = raw.check().expect_err(pointer).to_string();
        assert!(error.contains(path), "{pointer}: {error}");
    }
}
