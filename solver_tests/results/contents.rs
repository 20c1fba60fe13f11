//! Names, units and values in a results file; files that are not one, or an older one.

use std::path::Path;

use riprap::results::{CaseRecord, Existing, Outcome, Reader, Summary, Writer, journal, write_history_csv};

use crate::two_grains::*;

#[test]
fn h5py_finds_names_units_and_shapes() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("two.h5");
    write_small_file(&path);
    // The names are written out here, apart from the program's table: they are the contract.
    let program = r#"
import sys, h5py, numpy
names = '''stage increment axial_strain radial_strain volumetric_strain axial_stress confining_pressure
    deviatoric_stress mean_stress void_ratio coordination_number sliding_fraction failed_points deleted_cells
    fragments augmentations newton_iterations factorisations cuts wall_time out_of_balance max_penetration
    energy_external energy_elastic energy_friction energy_damage energy_stabilisation energy_membrane
    energy_error'''.split()
file = h5py.File(sys.argv[1])
for name in names:
    dataset = file['history'][name]
    assert dataset.shape == (12,), name
    assert isinstance(dataset.attrs['units'], str) and dataset.attrs['units'], name
    assert isinstance(dataset.attrs['long_name'], str) and dataset.attrs['long_name'], name
for name in names:
    if name.startswith('energy'):
        assert file['history'][name].attrs['units'] == 'J'
assert file['history/axial_stress'].attrs['units'] == 'Pa'
assert list(file['history/increment']) == list(range(1, 13))
assert numpy.allclose(file['history/axial_strain'], numpy.arange(1, 13) * 1e-3, rtol=1e-15)
assert numpy.isnan(file['history/void_ratio'][0])
for body in ('left', 'right'):
    for name in 'position rotation displacement force moment reaction_force reaction_moment'.split():
        assert file['bodies'][body][name].shape == (12, 3)
        assert file['bodies'][body][name].attrs['units']
assert list(file['bodies/left/displacement'][:, 0]) == list(range(1, 13))
assert file['grains/volume'].shape == (2,)
assert file['grains/position'].shape == (3, 2, 3) and file['grains/position'][2, 1].tolist() == [1, 0, 2]
assert file['grains/stress'].shape == (3, 2, 6) and file['grains/stress'][2, 1].tolist() == [-1e6, -2e6, 1, 0, 0, 2]
assert file['grains/damage_max'].shape == (3, 2)
assert file['contacts/2/force'].shape == (1, 3)
assert file['case/seed'][()] == 20110105 and file['case/threads'][()] == 2
assert file['case/given'].asstr()[()].endswith('as given')
assert 'Körner' in file['case/title'].asstr()[()]
for name in ('completed', 'version', 'commit', 'host'):
    assert file['case'][name].asstr()[()]
assert file['status'].asstr()[()] == 'finished'
assert file['status'].attrs['reason'] == 'end of the case'
assert file['status'].attrs['last_good_increment'] == 12
print('read')
"#;
    assert_eq!(run_python(&python, program, &[path.to_str().expect("path")]).trim(), "read");
}

#[test]
fn any_seed_comes_back() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("seed.h5");
    let record = CaseRecord { seed: u64::MAX, ..case_record() };
    let writer = Writer::create(&path, &record, Existing::Refuse).expect("a file");
    drop(writer);
    let summary = Reader::open(&path).and_then(|reader| Summary::of(&reader)).expect("summary");
    assert_eq!(summary.seed, u64::MAX);
    assert!(summary.to_string().contains("seed 18446744073709551615"), "{summary}");
}

#[test]
fn summary_and_csv_say_what_is_in_the_file() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("two.h5");
    let mesh = write_small_file(&path);
    let reader = Reader::open(&path).expect("opens");
    let summary = Summary::of(&reader).expect("summary");
    assert_eq!((summary.status.as_str(), summary.increments, summary.states.len()), ("finished", 12, 3));
    assert_eq!((summary.grains, summary.cells, summary.points), (2, mesh.cells(), mesh.points()));
    assert_eq!(summary.bodies, ["left", "right"]);
    assert_eq!(summary.contact_states, ["0", "1", "2"]);
    let json: serde_json::Value = serde_json::from_str(&summary.to_json()).expect("JSON");
    assert_eq!(json["last_good_increment"], 12);
    assert!(summary.to_string().contains("two grains"));
    let mut csv = Vec::new();
    write_history_csv(&reader, &mut csv, Path::new("-")).expect("export");
    let csv = String::from_utf8(csv).expect("text");
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines.len(), 13);
    assert!(lines[0].starts_with("stage [1],increment [1],time [1],axial_strain [1]"), "{}", lines[0]);
    let strain: f64 = lines[12].split(',').nth(3).expect("column").parse().expect("number");
    assert_eq!(strain, history_row(12).axial_strain);
}

/// Later versions add columns; what an earlier one wrote is still read.
#[test]
fn file_without_the_newest_columns_is_read() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("older.h5");
    write_small_file(&path);
    hdf5::File::open_rw(&path).and_then(|file| file.unlink("history/energy_gap")).expect("column taken out");
    let reader = Reader::open(&path).expect("opens");
    assert_eq!(reader.increments().expect("rows"), 12);
    assert!(reader.history("energy_gap").expect("column").iter().all(|value| value.is_nan()));
    assert_eq!(reader.history("energy_gap").expect("column").len(), 12);
    assert!(reader.history("energy_gape").is_err());
    assert!(Summary::of(&reader).expect("summary").last.iter().all(|last| last.name != "energy_gap"));
    let mut csv = Vec::new();
    write_history_csv(&reader, &mut csv, Path::new("-")).expect("export");
    let csv = String::from_utf8(csv).expect("text");
    assert!(csv.lines().all(|line| line.split(',').count() == riprap::results::HISTORY.len() - 1));
}

#[test]
fn existing_file_is_kept_unless_replaced() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("kept.h5");
    std::fs::write(&path, "precious").expect("file");
    let refused = Writer::create(&path, &case_record(), Existing::Refuse).err().expect("a refusal");
    assert!(refused.to_string().contains("--force"), "{refused}");
    assert_eq!(std::fs::read(&path).expect("file"), b"precious");
    drop(Writer::create(&path, &case_record(), Existing::Replace).expect("replaced"));
    assert_eq!(Reader::open(&path).expect("opens").increments().expect("rows"), 0);
}

#[test]
fn dropping_a_writer_does_not_commit() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("dropped.h5");
    let mesh = block_of_grains([2, 1, 1]);
    let mut writer = Writer::create(&path, &case_record(), Existing::Refuse).expect("a new file");
    writer.set_mesh(mesh.clone()).expect("mesh");
    writer.append(&history_row(1), &[]).expect("row");
    writer.commit().expect("commit");
    let committed = std::fs::metadata(&path).expect("file").len();
    writer.append(&history_row(2), &[]).expect("row");
    writer.save_state(&Fields::new(&mesh, 1).at(2)).expect("state");
    writer.save_restart(2, &[1; 100_000]).expect("restart");
    drop(writer);
    assert_eq!(std::fs::metadata(&path).expect("file").len(), committed);
    assert!(!journal::path_of(&path).exists());
    let summary = Summary::of(&Reader::open(&path).expect("opens")).expect("summary");
    assert_eq!((summary.increments, summary.states.len(), summary.restart_increment), (1, 0, None));
}

#[test]
fn foreign_and_damaged_files_are_errors() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("bad.h5");
    let message = |path: &Path| match Reader::open(path).and_then(|reader| Summary::of(&reader)) {
        Ok(_) => panic!("{} was accepted", path.display()),
        Err(error) => error.to_string(),
    };
    assert!(message(&path).contains("no such file"));
    std::fs::write(&path, "not HDF5").expect("file");
    assert!(message(&path).contains("not an HDF5 file"), "{}", message(&path));
    write_small_file(&dir.path().join("good.h5"));
    let good = std::fs::read(dir.path().join("good.h5")).expect("file");
    // Cut anywhere or overwritten anywhere: an error or a summary, never a panic.
    for share in [1, 5, 20, 50, 80, 99] {
        std::fs::write(&path, &good[..good.len() * share / 100]).expect("file");
        let _ = message(&path);
    }
    for share in 0..40 {
        let mut bytes = good.clone();
        let start = good.len() * share / 40;
        let end = (start + 64).min(good.len());
        bytes[start..end].fill(0xa5);
        std::fs::write(&path, &bytes).expect("file");
        let _ = Reader::open(&path).and_then(|reader| Summary::of(&reader));
    }
}

#[test]
fn breakage_is_written_as_tables() {
    use riprap::specimen::breakage::{GrainFate, Piece, measure};
    let piece = |size: f64, volume: f64| Piece { size, volume };
    let broken = GrainFate {
        before: piece(0.04, 8.0),
        pieces: vec![piece(0.03, 5.0), piece(0.02, 2.0)],
        came_apart: true,
        crushed_volume: 1.0,
        damaged_volume: 3.0,
    };
    let fates = [broken, GrainFate::whole(piece(0.02, 2.0))];
    let breakage = measure(&fates, &[0.01, 0.025, 0.04]).expect("measures");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("breakage.h5");
    let mut writer = Writer::create(&path, &case_record(), Existing::Refuse).expect("a new file");
    writer.write_breakage(&breakage).expect("written");
    writer.commit().expect("commit");
    writer.finish(Outcome::Finished, "end of the case", 0).expect("end");
    drop(writer);
    let reader = Reader::open(&path).expect("a file");
    assert_eq!(reader.floats("breakage/marsal").expect("an index"), [breakage.marsal]);
    assert_eq!(reader.floats("breakage/grading/passing_before").expect("a curve"), [0.0, 0.2, 1.0]);
    assert_eq!(reader.floats("breakage/grading/passing_after").expect("a curve"), [0.1, 0.5, 1.0]);
    assert_eq!(reader.integers("breakage/classes/broken").expect("numbers"), [0, 1]);
    assert_eq!(reader.integers("breakage/fragments").expect("a number"), [2]);
    assert_eq!(reader.text_attribute("breakage/weibull_scale", "units").expect("units"), "m");
    assert!(reader.floats("breakage/hardin").expect("an index")[0] > 0.0);
}

/// What users read has every column of the history, with its unit.
#[test]
fn the_page_on_results_has_every_column() {
    let page = include_str!("../../docs/results_file.md");
    let (_, page) = page.split_once("\n## /history\n").expect("its section");
    for column in riprap::results::HISTORY {
        let name = format!("`{}`", column.name);
        let mut rows = page.lines().filter_map(|line| line.strip_prefix("| ")).map(|row| row.split(" | "));
        let unit = rows.find_map(|mut row| row.next().filter(|names| names.contains(&name)).and(row.next()));
        assert_eq!(unit, Some(column.units), "{name}");
    }
}
