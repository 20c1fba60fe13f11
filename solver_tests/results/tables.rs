//! Tables of a results file as CSV.

use riprap::results::{Column, Existing, Reader, Writer, write_tables};

use crate::two_grains::*;

/// Every number of a small file comes back from its tables; vectors and stresses have a column a component.
#[test]
fn every_table_goes_out_with_its_units() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("two.vtkhdf");
    write_small_file(&path);
    let reader = Reader::open(&path).expect("opens");
    let files = write_tables(&reader, dir.path(), "two").unwrap_or_else(|e| panic!("{e}"));
    let names: Vec<_> = files.iter().map(|file| file.file_name().unwrap().to_string_lossy()).collect();
    assert_eq!(names, ["two_grains.csv", "two_grains_states.csv", "two_contacts.csv"]);
    let table = |at: usize| -> Vec<Vec<String>> {
        let text = std::fs::read_to_string(&files[at]).expect("a table");
        text.lines().map(|line| line.split(',').map(String::from).collect()).collect()
    };
    let column = |table: &[Vec<String>], name: &str| -> Vec<f64> {
        let at = table[0]
            .iter()
            .position(|known| known == name)
            .unwrap_or_else(|| panic!("{name}: {:?}", table[0]));
        table[1..].iter().map(|row| row[at].parse().expect("a number")).collect()
    };
    assert_eq!(column(&table(0), "volume [m3]"), reader.floats("grains/volume").expect("volumes"));
    // Three states of two grains, grain by grain within a state.
    let states = table(1);
    assert_eq!(column(&states, "state [1]"), [0.0, 0.0, 1.0, 1.0, 2.0, 2.0]);
    assert_eq!(column(&states, "grain [1]"), [0.0, 1.0, 0.0, 1.0, 0.0, 1.0]);
    let stress = reader.floats("grains/stress").expect("stresses");
    let shear: Vec<f64> = stress.chunks(6).map(|stress| stress[5]).collect();
    assert_eq!(column(&states, "stress_xz [Pa]"), shear);
    let contacts = table(2);
    assert_eq!(column(&contacts, "state [1]").last(), Some(&2.0));
    let force = reader.floats("contacts/2/force").expect("forces");
    assert_eq!(column(&contacts, "force_z [N]").last(), Some(&force[2]));
}

/// `/stages` and the groups within `/breakage` are tables of their own.
#[test]
fn stages_and_gradings_go_out_too() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("x.vtkhdf");
    let mut writer = Writer::create(&path, &case_record(), Existing::Refuse).expect("a new file");
    for (stage, angle) in [("stages/0", 0.1), ("stages/1", 0.7)] {
        let column = Column::floats("peak_friction_angle", "rad", "angle", vec![angle]);
        writer.write_table(stage, &[column]).expect("a stage");
    }
    // Quantities of rock have units of their own.
    for (quantity, unit, mean) in [("rock/poissons_ratio", "1", 0.25), ("rock/tensile_strength", "Pa", 5e6)] {
        let columns =
            [Column::floats("mean", unit, "mean", vec![mean]), Column::integers("values", "cells", vec![3])];
        writer.write_table(quantity, &columns).expect("a quantity");
    }
    writer.write_table("breakage", &[Column::floats("hardin", "1", "B_r", vec![0.125])]).expect("indices");
    let sizes = Column::floats("size", "m", "sieve", vec![0.02, 0.04]);
    writer.write_table("breakage/grading", &[sizes]).expect("a grading");
    writer.commit().expect("commit");
    drop(writer);
    let reader = Reader::open(&path).expect("opens");
    write_tables(&reader, dir.path(), "x").unwrap_or_else(|e| panic!("{e}"));
    for (name, expected) in [
        ("stages", "stage [1],peak_friction_angle [rad]\n0,0.1\n1,0.7\n"),
        ("rock", "quantity,unit,mean,values [1]\npoissons_ratio,1,0.25,3\ntensile_strength,Pa,5000000.0,3\n"),
        ("breakage", "hardin [1]\n0.125\n"),
        ("breakage_grading", "size [m]\n0.02\n0.04\n"),
    ] {
        let text = std::fs::read_to_string(dir.path().join(format!("x_{name}.csv"))).expect("a table");
        assert_eq!(text, expected, "{name}");
    }
}
