//! Results files, cases and plans from strangers.

use hdf5::{Extent, File};
use riprap::results::{Reader, Writer};

use crate::place::{Place, assert_same_bits};

/// A copy of the scene's file with something in it that riprap never writes.
fn changed(place: &Place, change: impl FnOnce(&File)) {
    let copied = place.path("x.h5");
    std::fs::copy(place.path("scene.h5"), &copied).expect("a copy");
    let file = File::open_rw(&copied).expect("opens");
    change(&file);
    file.close().expect("closed");
}

#[test]
fn what_riprap_never_writes_is_refused_before_it_is_read() {
    let place = Place::new();
    place.reference("scene");
    std::fs::write(place.path("secret"), [7_u8; 800]).expect("a file");
    let secret = place.path("secret").to_string_lossy().into_owned();
    let scene = place.path("scene.h5").to_string_lossy().into_owned();
    type Change<'a> = Box<dyn FnOnce(&File) + 'a>;
    let changes: Vec<(&str, &str, Change<'_>)> = vec![
        (
            "VTKHDF/CellData/stolen",
            "lies in another file",
            Box::new(|file| {
                let made = file.new_dataset::<f64>().shape(100).external(&secret, 0, 800);
                made.create("VTKHDF/CellData/stolen").expect("made");
            }),
        ),
        (
            "bodies/elsewhere",
            "is a link to elsewhere",
            Box::new(|file| file.link_external(&scene, "/bodies/block", "bodies/elsewhere").expect("made")),
        ),
        (
            "bodies/soft",
            "is a link to elsewhere",
            Box::new(|file| file.link_soft("/bodies", "bodies/soft").expect("made")),
        ),
        (
            "bodies/loop",
            "lies within itself",
            Box::new(|file| file.link_hard("/bodies", "bodies/loop").expect("made")),
        ),
        (
            "history/axial_strain",
            "claims a shape",
            Box::new(|file| {
                file.dataset("history/axial_strain").expect("there").resize(1 << 31).expect("resized")
            }),
        ),
        (
            "claimed",
            "claims a shape",
            Box::new(|file| {
                let shape = hdf5::Extents::from(vec![Extent::resizable(1 << 40)]);
                let made = file.new_dataset_builder().chunk(64).empty::<f64>().shape(shape);
                made.create("claimed").expect("made");
            }),
        ),
        (
            "filtered",
            "needs a filter",
            Box::new(|file| {
                let made = file.new_dataset_builder().chunk(64).nbit().empty::<i64>().shape(64);
                made.create("filtered").expect("made");
            }),
        ),
    ];
    for (name, says, change) in changes {
        changed(&place, change);
        for command in [
            &["info", "x.h5"][..],
            &["export", "x.h5", "--csv", "csv", "--vtu", "vtu", "--vtp", "vtp", "--stl", "stl"],
            &["report", "x.h5", "--out", "page"],
            &["run", "scene.json", "--out", "x.h5", "--resume"],
        ] {
            let told = place.ends_with(4, command);
            assert!(
                told.contains("x.h5") && told.contains(name) && told.contains(says),
                "{command:?}: {told}"
            );
        }
    }
    assert!(!place.path("vtu").exists() && !place.path("csv").exists(), "something was written");
}

/// A flip anywhere behind the head is found by --verify, and no damaged number is exported.
#[test]
fn every_flipped_bit_is_found() {
    let place = Place::new();
    place.reference("scene");
    let whole = std::fs::read(place.path("scene.h5")).expect("the file");
    let head = 4096;
    let mut exported = 0;
    for flip in 0..120_usize {
        let at = head + (flip.wrapping_mul(2_654_435_769) >> 5) % (whole.len() - head);
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (flip % 8);
        std::fs::write(place.path("x.h5"), &bytes).expect("written");
        let found = Reader::open(&place.path("x.h5")).and_then(|reader| reader.verify());
        assert!(found.is_err(), "bit {} of byte {at}", flip % 8);
        // What can be read has the right numbers, or the flip is in what is not read: padding, dates, names.
        if flip % 4 == 0 {
            let export = ["export", "x.h5", "--csv", "csv"];
            let ended = place.command(&export).output().expect("starts");
            match ended.status.code() {
                Some(0) => {
                    exported += 1;
                    let same = |name: &str, of: &str| {
                        let (a, b) = (place.path(&format!("csv/x{name}")), place.path(of));
                        std::fs::read(a).expect("written") == std::fs::read(b).expect("written")
                    };
                    if exported == 1 {
                        place.ends_with(0, &["export", "scene.h5", "--csv", "whole"]);
                    }
                    assert!(same(".csv", "whole/scene.csv"), "byte {at}: wrong numbers with exit 0");
                    assert!(
                        same("_bodies.csv", "whole/scene_bodies.csv"),
                        "byte {at}: wrong numbers with exit 0"
                    );
                }
                Some(4) => {}
                code => panic!("byte {at}: {code:?}: {}", String::from_utf8_lossy(&ended.stderr)),
            }
            // Pictures and meshes, too: no reader of a damaged mesh or network panics.
            for ways in [&["--vtu", "vtu"], &["--vtp", "vtp"], &["--stl", "stl"]] {
                let ended = place.command(&[&["export", "x.h5"], &ways[..]].concat()).output();
                let ended = ended.expect("starts");
                let said = String::from_utf8_lossy(&ended.stderr);
                assert!(matches!(ended.status.code(), Some(0 | 4)), "byte {at}, {ways:?}: {said}");
            }
        }
    }
    place.ends_with(0, &["info", "scene.h5", "--verify"]);
}

/// A file that somebody puts in the place of one that is being written, cuts, or writes to, ends the run and stays as it is.
#[test]
fn a_file_changed_under_its_writer_is_told_and_left_alone() {
    let place = Place::new();
    place.reference("scene");
    let foreign = vec![5_u8; 3_000_000];
    for how in ["replaced", "rewritten", "cut", "removed"] {
        let path = place.path("x.h5");
        place.lay_begun("scene", "x.h5");
        let (mut writer, _) = Writer::resume(&path).unwrap_or_else(|e| panic!("{e}"));
        match how {
            "replaced" => {
                std::fs::write(place.path("other"), &foreign).expect("written");
                std::fs::rename(place.path("other"), &path).expect("moved");
            }
            "rewritten" => std::fs::write(&path, &foreign).expect("written"),
            "cut" => std::fs::OpenOptions::new()
                .write(true)
                .open(&path)
                .and_then(|file| file.set_len(9000))
                .expect("cut"),
            _ => std::fs::remove_file(&path).expect("removed"),
        }
        let there = std::fs::read(&path).ok();
        let told = writer.commit().expect_err(how).to_string();
        assert!(told.contains("x.h5"), "{how}: {told}");
        drop(writer);
        assert!(std::fs::read(&path).ok() == there, "{how}: it was touched");
        assert!(!place.path("x.h5.journal").exists(), "{how}");
        let _ = std::fs::remove_file(&path);
    }
    // Moved away, not damaged: the run ends, and its file goes on under its new name.
    place.lay_begun("scene", "x.h5");
    let (mut writer, _) = Writer::resume(&place.path("x.h5")).unwrap_or_else(|e| panic!("{e}"));
    std::fs::rename(place.path("x.h5"), place.path("y.h5")).expect("moved");
    assert!(writer.commit().is_err());
    drop(writer);
    place.ends_with(0, &["run", "scene.json", "--out", "y.h5", "--resume", "--quiet"]);
    assert_same_bits(&place.open("scene.h5"), &place.open("y.h5"));
}

const BODY: &str = "=cmd|calc!A0";

#[test]
fn titles_and_names_reach_no_terminal_page_or_spreadsheet_as_commands() {
    let place = Place::new();
    let case = format!(
        r#"{{"title": "a\u001b]0;owned\u0007\u001b[31mred<script>", "scene": {{"bodies": [{{"name": "{BODY}", "shape": {{"box": [1, 1, 1]}}}}]}},
        "rock": {{"density": 2700, "youngs_modulus": 3e10, "poissons_ratio": 0.2}}, "contact": {{"friction": 0.5}},
        "stages": [{{"kind": "load", "increments": 3, "bodies": {{"{BODY}": {{"displacement": [0.001, 0, 0]}}}}}}]}}"#
    );
    std::fs::write(place.path("c.json"), case).expect("a case");
    let plain = |bytes: &[u8], what: &str| {
        let text = String::from_utf8_lossy(bytes);
        let obeyed = |c: char| c.is_control() && c != '\n' && c != '\t';
        assert!(!text.contains(obeyed), "{what}: {text:?}");
    };
    for command in [
        &["check", "c.json"][..],
        &["run", "c.json", "--out", "x.h5"],
        &["info", "x.h5"],
        &["report", "x.h5", "--out", "page"],
        &["export", "x.h5", "--csv", "csv", "--vtu", "vtu"],
    ] {
        let ended = place.command(command).output().expect("starts");
        assert!(ended.status.success(), "{command:?}: {}", String::from_utf8_lossy(&ended.stderr));
        plain(&[ended.stdout, ended.stderr].concat(), &format!("{command:?}"));
    }
    for entry in std::fs::read_dir(place.path("page")).expect("the report") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|e| e == "svg" || e == "html") {
            let bytes = std::fs::read(&path).expect("written");
            plain(&bytes, &path.display().to_string());
            assert!(!String::from_utf8_lossy(&bytes).contains("red<script>"), "{}", path.display());
        }
    }
    let table = std::fs::read_to_string(place.path("csv/x_bodies.csv")).expect("a table");
    assert!(table.lines().skip(1).all(|line| line.starts_with("'=cmd")), "{table}");
}

/// A device has no end and a pipe no beginning: what a case or a plan names is a file of a sensible size.
#[test]
fn what_is_named_is_a_file_and_not_endless() {
    let place = Place::new();
    let scene = |shape: &str| {
        format!(
            r#"{{"scene": {{"bodies": [{{"name": "b", "shape": {shape}}}]}},
            "rock": {{"density": 2700, "youngs_modulus": 3e10, "poissons_ratio": 0.2}}, "contact": {{"friction": 0.5}},
            "stages": [{{"kind": "load", "increments": 1}}]}}"#
        )
    };
    let specimen = |grading: &str| {
        format!(
            r#"{{"specimen": {{"grains": 20, "aspect": 2, "void_ratio": 0.9, "grading": {grading}}},
            "rock": {{"density": 2700, "youngs_modulus": 3e10, "poissons_ratio": 0.2}}, "contact": {{"friction": 0.5}},
            "stages": [{{"kind": "consolidate", "pressure": 1e5}}]}}"#
        )
    };
    for kind in ["device", "pipe", "large"] {
        // By all endings that a case takes.
        for ending in ["vtu", "msh", "stl", "obj", "ply", "csv", "json"] {
            let path = place.path(&format!("{kind}.{ending}"));
            match kind {
                "device" => std::os::unix::fs::symlink("/dev/zero", &path).expect("a link"),
                "pipe" => {
                    let made = std::process::Command::new("mkfifo").arg(&path).status();
                    assert!(made.expect("mkfifo").success());
                }
                // Of no length on the disk.
                _ => std::fs::File::create(&path).and_then(|file| file.set_len(1 << 40)).expect("made"),
            }
        }
        let cases =
            ["vtu", "msh"].map(|ending| scene(&format!(r#"{{"mesh": "{kind}.{ending}"}}"#))).into_iter();
        let hulls = ["vtu", "msh", "stl", "obj", "ply"]
            .map(|ending| scene(&format!(r#"{{"hull": {{"file": "{kind}.{ending}", "unit": "mm"}}}}"#)));
        let gradings =
            [format!(r#""{kind}.csv""#), format!(r#"{{"file": "{kind}.csv"}}"#)].map(|g| specimen(&g));
        let plans = [
            format!(r#"{{"case": "{kind}.json"}}"#),
            format!(r#"{{"cases": ["scene.json", "{kind}.json"]}}"#),
        ];
        let commands = [(&["check"][..], &[][..], 1), (&["batch"], &["--list"], 2)];
        let cases: Vec<String> = cases.chain(hulls).chain(gradings).collect();
        for (texts, (command, more, code)) in [cases, plans.to_vec()].iter().zip(commands) {
            for text in texts {
                std::fs::write(place.path("c.json"), text).expect("a case");
                let (told, took) = place.ends_soon(code, &[command, &["c.json"], more].concat());
                let named = told.contains("$.") && told.contains(kind);
                let why = ["is no file", "it is no file", "has more than", "is not there"];
                assert!(named && why.iter().any(|why| told.contains(why)), "{text}: {told}");
                assert!(took < 5.0, "{text}: {took} s");
            }
        }
    }
    // What a user names may be a pipe, and a device ends.
    let told = place.ends_soon(2, &["check", "device.json"]).0;
    assert!(told.contains("more than 64 MiB"), "{told}");
    let fed = std::process::Command::new("sh")
        .current_dir(place.path(""))
        .args(["-c", "cat scene.json | \"$0\" check /dev/stdin"])
        .arg(place.command(&[]).get_program())
        .output()
        .expect("sh");
    assert!(fed.status.success(), "{}", String::from_utf8_lossy(&fed.stderr));
}

/// No output over any file that the run reads, whatever it is called.
#[test]
fn a_run_does_not_write_over_what_it_reads() {
    let place = Place::new();
    let mesh = "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\"><UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">\
        <Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points>\
        <Cells><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray>\
        <DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4</DataArray>\
        <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>";
    let case = r#"{"scene": {"bodies": [{"name": "g", "shape": {"mesh": "g.vtu"}}]},
        "rock": {"density": 2700, "youngs_modulus": 3e10, "poissons_ratio": 0.2}, "contact": {"friction": 0.5},
        "stages": [{"kind": "load", "increments": 1}]}"#;
    for (out, case_file) in [("g.vtu", "m.json"), ("m.json", "m.json"), ("m", "m.new"), ("n", "n.journal")] {
        std::fs::write(place.path("g.vtu"), mesh).expect("a mesh");
        std::fs::write(place.path(case_file), case).expect("a case");
        let told = place.ends_with(2, &["run", case_file, "--out", out, "--force"]);
        assert!(told.contains("is what the run reads"), "{told}");
        assert_eq!(std::fs::read_to_string(place.path("g.vtu")).expect("there"), mesh);
        assert_eq!(std::fs::read_to_string(place.path(case_file)).expect("there"), case);
    }
    // What a case brings in is put in its place before the check, and read all the same.
    let scan = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    let hull = case.replace(r#"{"mesh": "g.vtu"}"#, r#"{"hull": {"file": "g.obj", "unit": "cm"}}"#);
    let table = "sieve [mm],passing [%]\n60,100\n40,0\n";
    let graded = r#"{"specimen": {"grains": 20, "aspect": 2, "void_ratio": 0.9, "grading": "g.csv"},
        "rock": {"density": 2700, "youngs_modulus": 3e10, "poissons_ratio": 0.2}, "contact": {"friction": 0.5},
        "stages": [{"kind": "consolidate", "pressure": 1e5}]}"#;
    for (file, contents, case) in [("g.obj", scan, hull.as_str()), ("g.csv", table, graded)] {
        std::fs::write(place.path(file), contents).expect("a file");
        std::fs::write(place.path("b.json"), case).expect("a case");
        let told = place.ends_with(2, &["run", "b.json", "--out", file, "--force"]);
        assert!(told.contains("is what the run reads"), "{told}");
        assert_eq!(std::fs::read_to_string(place.path(file)).expect("there"), contents);
    }
}

/// What only a run refused, behind the specimen or without a path.
#[test]
fn check_refuses_what_run_would() {
    let place = Place::new();
    let case = |shape: &str, more: &str| {
        format!(
            r#"{{"scene": {{"bodies": [{{"name": "b", "shape": {shape}{more}}}]}},
            "rock": {{"density": 2700, "youngs_modulus": 3e10, "poissons_ratio": 0.2}}, "contact": {{"friction": 0.5}},
            "stages": [{{"kind": "load", "increments": 1}}]}}"#
        )
    };
    let around = |count: usize| {
        let corner = |k: usize| {
            let angle = std::f64::consts::TAU * (k / 2) as f64 / (count / 2) as f64;
            format!("[{}, {}, {}]", angle.cos(), angle.sin(), k % 2)
        };
        format!(r#"{{"polyhedron": [{}]}}"#, (0..count).map(corner).collect::<Vec<_>>().join(", "))
    };
    let fine = r#", "fidelity": "condensed", "mesh_size": 0.012"#;
    let weibull = r#"/rock/poissons_ratio={"mean": 0, "weibull_shape": 50}"#;
    for (text, set, path, says) in [
        (case(r#"{"box": [1, 1, 1]}"#, fine), "/seed=1", "$.scene.bodies[0].mesh_size", "at most 2000000"),
        (case(&around(1002), ""), "/seed=1", "$.scene.bodies[0].shape.polyhedron", "at most 1000"),
        (case(r#"{"box": [1, 1, 1]}"#, ""), weibull, "$.rock.poissons_ratio.mean", "a mean above 0"),
    ] {
        std::fs::write(place.path("c.json"), text).expect("a case");
        for (command, code) in [(&["check", "c.json"][..], 1), (&["run", "c.json", "--out", "x.h5"], 2)] {
            let told = place.ends_with(code, &[command, &["--set", set]].concat());
            assert!(told.contains(path) && told.contains(says), "{command:?}: {told}");
        }
        assert!(!place.path("x.h5").exists());
    }
    std::fs::write(place.path("c.json"), case(&around(24), "")).expect("a case");
    place.ends_with(0, &["check", "c.json"]);
}

/// A plan's text that became a command of the cluster's shell.
#[test]
fn no_text_of_a_plan_becomes_a_command() {
    let place = Place::new();
    for (out, code) in [("r\\ntouch PWNED\\n#", 2), ("r'; touch PWNED; '", 0)] {
        std::fs::write(place.path("plan.json"), format!(r#"{{"case": "scene.json", "out": "{out}"}}"#))
            .expect("a plan");
        // Where sbatch is not found, the script is written and not submitted.
        let ended =
            place.command(&["batch", "plan.json", "--slurm"]).env("PATH", "").output().expect("starts");
        assert_eq!(ended.status.code(), Some(code), "{}", String::from_utf8_lossy(&ended.stderr));
        if code == 0 {
            let script = std::fs::read_to_string(place.path(out).join("array.sh")).expect("a script");
            let comments = script.lines().skip(1).take_while(|line| line.is_empty() || line.starts_with('#'));
            assert!(comments.filter(|line| line.contains("PWNED")).all(|line| line.starts_with("#SBATCH")));
        }
    }
    assert!(!place.path("PWNED").exists());
}
