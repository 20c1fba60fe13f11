//! A file that is gone on with.

use std::path::Path;

use riprap::results::{Column, Existing, Outcome, Reader, Writer};

use crate::two_grains::*;

#[test]
fn resumed_file_equals_an_uninterrupted_one() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let mesh = block_of_grains([2, 1, 1]);
    let go_on = |writer: &mut Writer, from: usize, to: usize| {
        for increment in from..=to {
            writer.append(&history_row(increment), &[body_row(increment), body_row(0)]).expect("row");
            if increment % 4 == 0 {
                writer.save_state(&Fields::new(&mesh, increment / 4).at(increment)).expect("state");
                writer.save_grains(&[grain_row(0, increment), grain_row(1, increment)]).expect("grains");
                let table = [Column::integers("first", "first grain", vec![increment as i64])];
                writer.write_table(&format!("contacts/{}", increment / 4 - 1), &table).expect("contacts");
                writer.save_restart(increment as u64, &increment.to_le_bytes()).expect("restart");
            }
            writer.commit().expect("commit");
        }
    };
    let begin = |path: &Path| {
        let mut writer = Writer::create(path, &case_record(), Existing::Refuse).expect("a new file");
        writer.set_mesh(mesh.clone()).expect("mesh");
        // Not in alphabetical order, and not to be put into it.
        writer.set_bodies(&["wedge", "base"]).expect("bodies");
        writer
    };
    let whole = dir.path().join("whole.h5");
    let mut writer = begin(&whole);
    go_on(&mut writer, 1, 20);
    writer.finish(Outcome::Finished, "", 20).expect("end");
    drop(writer);

    let parts = dir.path().join("parts.h5");
    let mut writer = begin(&parts);
    go_on(&mut writer, 1, 10);
    // More that was never committed.
    writer.append(&history_row(11), &[body_row(11), body_row(0)]).expect("row");
    drop(writer);
    let (mut writer, restart) = Writer::resume(&parts).expect("resumes");
    assert!(writer.set_bodies(&["base", "wedge"]).is_err(), "other bodies are refused");
    writer.set_bodies(&["wedge", "base"]).expect("the same bodies");
    assert!(writer.set_mesh(block_of_grains([1, 1, 1])).is_err(), "another mesh is refused");
    writer.set_mesh(mesh.clone()).expect("the same mesh");
    assert_eq!((restart.increment, restart.rows, restart.states), (8, 8, 2));
    assert_eq!(restart.bytes, 8_usize.to_le_bytes());
    go_on(&mut writer, 9, 13);
    writer.set_dossier(&[("advice", "smaller increments".into())]).expect("dossier");
    writer.finish(Outcome::Stopped, "not in balance", 13).expect("end");
    drop(writer);
    let (mut writer, restart) = Writer::resume(&parts).expect("resumes");
    assert_eq!(restart.increment, 12);
    go_on(&mut writer, 13, 20);
    writer.finish(Outcome::Finished, "", 20).expect("end");
    drop(writer);

    let (a, b) = (Reader::open(&whole).expect("opens"), Reader::open(&parts).expect("opens"));
    for name in [
        "history/increment",
        "history/axial_strain",
        "bodies/wedge/position",
        "bodies/base/position",
        "grains/position",
        "grains/stress",
        "contacts/4/first",
        "VTKHDF/PointData/displacement",
        "VTKHDF/CellData/stress",
        "VTKHDF/Steps/Values",
        "VTKHDF/Steps/CellDataOffsets/stress",
    ] {
        assert_eq!(a.floats(name).expect("numbers"), b.floats(name).expect("numbers"), "{name}");
    }
    assert_eq!(a.members("contacts").expect("names"), b.members("contacts").expect("names"));
    assert_eq!(a.status().expect("status"), b.status().expect("status"));
    assert!(b.text_attribute("status", "advice").is_err(), "why it stopped before is no matter now");
}
