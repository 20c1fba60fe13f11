//! Reports, studies and batches from outside: what is drawn is what the file says, the page needs nothing but itself, and
//! series go on where they were broken off.
//!
//! Reports are made of files written here, with curves that are known; studies and batches run a scene of two blocks (a third of
//! a second).

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use riprap::report::write_report;
use riprap::results::{
    CaseRecord, CellKind, Column, Existing, FieldMesh, FieldState, HistoryRow, Outcome, Reader, Writer,
};
use riprap::tensor::Vec3;

const CASE: &str = r#"{"title": "<b>Known & made</b>", "solver": {"force_tolerance": 1e-3},
    "specimen": {"grading": [[0.06, 1.0], [0.04, 0.0]]}}"#;

/// q of the made run [Pa]: a parabola with its peak of 3.2 MPa at 4 % strain.
fn stress(strain: f64) -> f64 {
    3.2e6 * (1.0 - (strain / 0.04 - 1.0).powi(2))
}

/// Two tetrahedra, a grain each, one above the other.
fn mesh() -> FieldMesh {
    let mut mesh = FieldMesh::new();
    let part = mesh.add_part("grains");
    for grain in 0..2 {
        let at = Vec3::new(0.0, 0.0, 0.05 * grain as f64);
        let corners = [[0.0, 0.0, 0.0], [0.05, 0.0, 0.0], [0.0, 0.05, 0.0], [0.0, 0.0, 0.05]];
        let nodes = corners.map(|corner| mesh.add_point(&(at + Vec3::from(corner))));
        mesh.add_cell(CellKind::Tetrahedron, &nodes, part, Some(grain), 30e9).expect("a cell");
    }
    mesh
}

/// The increment of a consolidation, and those of the shearing behind it.
fn row(increment: i64) -> HistoryRow {
    let strain = 1e-3 * (increment - 1) as f64;
    let work = 10.0 * increment as f64;
    HistoryRow {
        stage: i64::from(increment > 1),
        increment,
        time: increment as f64 / 51.0,
        // At the end of the consolidation strains are its own, and begin anew behind it.
        axial_strain: if increment == 1 { 0.012 } else { strain },
        volumetric_strain: if increment == 1 { 0.03 } else { 0.2 * strain },
        deviatoric_stress: stress(strain),
        confining_pressure: 0.8e6,
        mean_stress: 0.8e6 + stress(strain) / 3.0,
        peak_friction_angle: if increment == 1 { f64::NAN } else { 0.75 },
        void_ratio: 0.4,
        factorisations: 3,
        augmentations: 2,
        cuts: i64::from(increment == 7),
        out_of_balance: 1e-4,
        wall_time: 0.5 * increment as f64,
        energy_external: work,
        energy_elastic: 0.25 * work,
        energy_friction: 0.75 * work,
        ..HistoryRow::default()
    }
}

/// A run of a consolidation and a shearing to 5 % in 50 increments, two grains, damage, contacts, breakage.
fn write_made_run(path: &Path, outcome: Outcome) {
    write_run_of(path, outcome, &["consolidate", "shear"], "<b>Known & made</b>");
}

/// The same, of other stages, under another title.
fn write_run_of(path: &Path, outcome: Outcome, stages: &[&str], title: &str) {
    let rows: Vec<HistoryRow> = (1..=51).map(row).collect();
    write_rows(path, outcome, (stages, title), &rows, &[(1, &[("half_modulus", 2.5e8)])]);
}

/// The same of other rows, with numbers of stages.
fn write_rows(
    path: &Path,
    outcome: Outcome,
    (stages, title): (&[&str], &str),
    rows: &[HistoryRow],
    numbers: &[(usize, &[(&str, f64)])],
) {
    let record = CaseRecord {
        title: title.into(),
        given: CASE.into(),
        completed: CASE.into(),
        seed: 1,
        threads: 1,
        stages: stages.iter().map(|kind| kind.to_string()).collect(),
    };
    let mut writer = Writer::create(path, &record, Existing::Refuse).expect("a new file");
    writer.set_mesh(mesh()).expect("a mesh");
    let sizes = Column::floats("sieve_size", "m", "sieve size", vec![0.045, 0.055]);
    let masses = Column::floats("mass", "kg", "mass", vec![1.0, 3.0]);
    writer.write_table("grains", &[sizes, masses]).expect("grains");
    let save = |writer: &mut Writer, increment: u64, state: usize| {
        let moved: Vec<Vec3> =
            (0..8).map(|point| Vec3::new(0.0, 0.0, -1e-3 * (increment * point) as f64)).collect();
        let fields = FieldState {
            time: if increment == 1 { 1.0 } else { 2.0 },
            increment,
            displacement: &moved,
            damage: &[0.0, 0.4],
            failed: &[false, false],
            fragment: &[0, 1],
            stress: &[[0.0; 6]; 2],
            fidelity: &[0, 1],
        };
        writer.save_state(&fields).expect("a state");
        let contacts = [
            Column::integers("body_a", "a", vec![0, 0, -1]),
            Column::integers("body_b", "b", vec![1, 1, 1]),
            Column::vectors("normal", "1", "n", vec![[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
            Column::floats("normal_force", "N", "f", vec![100.0, 300.0, 7.0]),
        ];
        writer.write_table(&format!("contacts/{state}"), &contacts).expect("contacts");
    };
    for row in rows {
        writer.append(row, &[]).expect("a row");
        if row.increment == 1 {
            save(&mut writer, 1, 0);
        }
    }
    save(&mut writer, 51, 1);
    let grading = [
        Column::floats("size", "m", "sieve", vec![0.02, 0.04, 0.06]),
        Column::floats("passing_before", "1", "before", vec![0.0, 0.1, 1.0]),
        Column::floats("passing_after", "1", "after", vec![0.2, 0.5, 1.0]),
    ];
    writer.write_table("breakage", &[Column::floats("hardin", "1", "B_r", vec![0.125])]).expect("indices");
    writer.write_table("breakage/grading", &grading).expect("grading");
    for (stage, numbers) in numbers {
        let columns: Vec<Column> =
            numbers.iter().map(|(name, value)| Column::floats(name, "1", name, vec![*value])).collect();
        writer.write_table(&format!("stages/{stage}"), &columns).expect("a stage");
    }
    writer
        .finish(outcome, if outcome == Outcome::Stopped { "no convergence" } else { "" }, 51)
        .expect("an end");
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The points of the lines of a colour in an SVG, in its pixels.
fn lines(svg: &str, colour: &str) -> Vec<Vec<[f64; 2]>> {
    let of = |tag: &str| {
        let (_, points) = tag.split_once("points=\"")?;
        let pairs = points.split('"').next()?.split_whitespace();
        pairs
            .map(|pair| {
                let (x, y) = pair.split_once(',')?;
                Some([x.parse().ok()?, y.parse().ok()?])
            })
            .collect()
    };
    svg.lines().filter(|line| line.contains(&format!("stroke=\"{colour}\""))).filter_map(of).collect()
}

/// Labels of ticks with their places in an SVG: (text, x, y).
fn texts(svg: &str) -> Vec<(String, f64, f64)> {
    let number = |tag: &str, name: &str| -> Option<f64> {
        tag.split_once(&format!(" {name}=\""))?.1.split('"').next()?.parse().ok()
    };
    svg.split("<text")
        .skip(1)
        .filter_map(|piece| {
            let (tag, rest) = piece.split_once('>')?;
            let text = rest.split("</text>").next()?.trim().to_string();
            Some((text, number(tag, "x")?, number(tag, "y")?))
        })
        .collect()
}

#[test]
fn the_curve_is_where_the_ticks_say() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("made.h5");
    write_made_run(&file, Outcome::Finished);
    let out = folder.path().join("report");
    write_report(&[file], &[], &out, None).unwrap_or_else(|e| panic!("{e}"));
    let svg = read(&out.join("stress_strain.svg"));
    let texts = texts(&svg);
    let at = |label: &str| -> Vec<[f64; 2]> {
        texts.iter().filter(|(text, ..)| text == label).map(|(_, x, y)| [*x, *y]).collect()
    };
    // Of the two curves of 51 points the upper panel's comes first.
    let curve = lines(&svg, "#0072B2").into_iter().find(|line| line.len() > 40).expect("a curve");
    assert_eq!(curve.len(), 51, "one point an increment, led by the consolidation's end");
    // Ticks: x of 2 % and 4 % strain; y of 1 and 3 MPa in the upper panel.
    let lowest = |label: &str| at(label).into_iter().max_by(|a, b| a[1].total_cmp(&b[1])).expect("a tick");
    let x = |label: &str| lowest(label)[0];
    let y = |label: &str| at(label).iter().map(|p| p[1]).min_by(f64::total_cmp).expect("a tick");
    let strain_of = |px: f64| 2.0 + 2.0 * (px - x("2.0")) / (x("4.0") - x("2.0"));
    let stress_of = |py: f64| 1.0 + 2.0 * (py - y("1.0")) / (y("3.0") - y("1.0"));
    for (number, point) in curve.iter().enumerate() {
        let strain = 1e-3 * number as f64;
        // A quarter of a pixel in some hundred.
        assert!((strain_of(point[0]) - 100.0 * strain).abs() < 0.01, "{number}: {}", strain_of(point[0]));
        assert!(
            (stress_of(point[1]) - 1e-6 * stress(strain)).abs() < 0.02,
            "{number}: {}",
            stress_of(point[1])
        );
    }
    assert!(svg.contains("3.2 MPa at 4 %"), "the peak is named");
}

#[test]
fn the_page_needs_nothing_but_itself() {
    let folder = tempfile::tempdir().expect("a folder");
    let (one, two) = (folder.path().join("one.h5"), folder.path().join("two.h5"));
    write_made_run(&one, Outcome::Finished);
    write_made_run(&two, Outcome::Stopped);
    let table = folder.path().join("lab.csv");
    std::fs::write(&table, "axial_strain [%], deviatoric_stress [MPa]\n0,0\n2,2.5\n4,3\n").expect("a table");
    let peaks = folder.path().join("peaks.csv");
    std::fs::write(&peaks, "curve, axial_strain [%], deviatoric_stress [MPa]\nsource: peak, 3, 3.5\n")
        .expect("a table");
    let out = folder.path().join("report");
    let report = write_report(&[one, two], &[table, peaks], &out, None).unwrap_or_else(|e| panic!("{e}"));
    assert!(report.files.iter().all(|file| file.exists()));
    let html = read(&report.page);
    // Nothing is fetched: no address at all but SVG's own name.
    let rest = html.replace("http://www.w3.org/2000/svg", "");
    for forbidden in ["http:", "https:", "<link", "<iframe", "@import", "url(", "src=\"/", "file:"] {
        assert!(!rest.contains(forbidden), "the page has {forbidden}");
    }
    // Scripts are the viewer, once, and the data of each run, which cannot end the script that holds them.
    let scripts: Vec<&str> =
        rest.split("<script").skip(1).map(|s| s.split("</script").next().unwrap()).collect();
    let viewers: Vec<_> = scripts.iter().filter_map(|script| script.strip_prefix('>')).collect();
    let data: Vec<_> =
        scripts.iter().filter_map(|script| script.strip_prefix(" type=\"application/json\">")).collect();
    assert_eq!((viewers.len(), data.len(), scripts.len()), (1, 2, 3));
    for reaching in ["fetch(", "XMLHttpRequest", "WebSocket", "EventSource", "sendBeacon", "import", "eval("]
    {
        assert!(!viewers[0].contains(reaching), "the viewer has {reaching}");
    }
    for data in data {
        assert!(!data.contains('<') && serde_json::from_str::<serde_json::Value>(data).is_ok(), "{data:.80}");
    }
    for source in rest.split("src=\"").skip(1) {
        assert!(source.starts_with("data:image/png;base64,"), "{}", &source[..40.min(source.len())]);
    }
    // What users wrote stays text.
    assert!(!html.contains("<b>") && html.contains("&lt;b&gt;Known &amp; made&lt;/b&gt;"));
    assert!(html.contains("stopped after increment 51 (no convergence)"));
    assert!(html.contains("3.2 MPa at 4 % axial strain") && html.contains("laboratory, lab"));
    assert!(html.contains("source: peak"), "a table names its curves");
    // q = 3.2 MPa at 0.8 MPa: sin(phi) = 3.2 / 4.8.
    for part in ["<td>43°</td>", "E50", "250 MPa", "<td>0.8 MPa</td>", "without cohesion: φ = 41.8°"] {
        assert!(html.contains(part), "the page lacks {part}");
    }
    assert!(html.contains("Hardin") && html.contains("0.125"));
    for part in
        ["<svg", "Where the work goes", "Grading: ", "after the test", "Contact normals", "damage at the end"]
    {
        assert!(html.contains(part), "the page lacks {part}");
    }
    // A picture of every kind is a PNG beside it.
    for stem in [
        "stress_strain",
        "strength",
        "stress_path",
        "energy",
        "specimen_one",
        "damage_two",
        "grading_one",
        "fabric_two",
        "convergence_one",
    ] {
        let bytes = std::fs::read(out.join(format!("{stem}.png"))).unwrap_or_else(|e| panic!("{stem}: {e}"));
        assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n", "{stem}");
    }
}

/// A hold in front of the shearing says nothing of its strength, an unloading behind it nothing of its moduli.
#[test]
fn angles_and_moduli_are_those_of_the_shearing() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("held.h5");
    let staged = |increment: i64| HistoryRow {
        stage: [1, 6, 45].iter().filter(|last| increment > **last).count() as i64,
        ..row(increment)
    };
    let rows: Vec<HistoryRow> = (1..=51).map(staged).collect();
    let hold = [("initial_modulus", 9e9), ("half_modulus", 8e9), ("largest_dilatancy_angle", 1.2)];
    let shear = [
        ("initial_modulus", 4e8),
        ("half_modulus", 2.5e8),
        ("largest_dilatancy_angle", 10f64.to_radians()),
        ("residual_friction_angle", 0.6),
    ];
    let unload = [("initial_modulus", 7e9), ("residual_friction_angle", 0.1)];
    let stages = ["consolidate", "hold", "shear", "unload"];
    let numbers = [(1, &hold[..]), (2, &shear[..]), (3, &unload[..])];
    write_rows(&file, Outcome::Finished, (&stages, "Held"), &rows, &numbers);
    let report =
        write_report(&[file], &[], &folder.path().join("report"), None).unwrap_or_else(|e| panic!("{e}"));
    let html = read(&report.page);
    for (name, value) in [
        ("friction angle, largest", "43°"),
        ("friction angle, residual", "34.4°, stage 2"),
        ("dilatancy angle, largest", "10°, stage 2"),
        ("initial tangent modulus", "400 MPa, stage 2"),
        ("E50", "250 MPa, stage 2"),
    ] {
        assert!(html.contains(&format!("<td>{value}</td>")), "{name}: not {value}");
    }
}

/// Grains squeezed between rigid walls, or held, stand at rest: their circle touches no line of failure.
#[test]
fn what_is_not_sheared_is_left_out_of_the_line_of_failure() {
    let folder = tempfile::tempdir().expect("a folder");
    let page = |stage: &str| {
        let file = folder.path().join(format!("{stage}.h5"));
        write_run_of(&file, Outcome::Finished, &["consolidate", stage], stage);
        let report =
            write_report(&[file], &[], &folder.path().join("report"), None).unwrap_or_else(|e| panic!("{e}"));
        read(&report.page)
    };
    for stage in ["oedometer", "hold", "consolidate"] {
        let page = page(stage);
        let left_out = format!("no failure: the line leaves out {stage}.");
        assert!(page.contains(&left_out) && !page.contains("φ = "), "{stage}");
        // A consolidation alone has no end of it but its last row. Two points of a pair are one contact.
        assert_eq!(page.contains("consolidated (1 contacts"), stage != "consolidate", "{stage}");
    }
    for stage in ["shear", "reload"] {
        let page = page(stage);
        assert!(!page.contains("no failure") && page.contains("φ = 41.8°"), "{stage}");
    }
}

/// A chart for a column of 84 mm: its SVG is as wide, its PNG in print.
#[test]
fn charts_are_as_wide_as_a_column() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("made.vtkhdf");
    write_made_run(&file, Outcome::Finished);
    ends_with(0, folder.path(), &["report", "made.vtkhdf", "--width", "84"]);
    let out = folder.path().join("made_report");
    assert!(read(&out.join("stress_strain.svg")).contains("width=\"318\""));
    let png = std::fs::read(out.join("stress_strain.png")).expect("a picture");
    let number = |at: usize| u32::from_be_bytes(png[at..at + 4].try_into().expect("four bytes"));
    let physical = png.windows(4).position(|name| name == b"pHYs").expect("its pixels a metre");
    let millimetres = 1e3 * f64::from(number(16)) / f64::from(number(physical + 4));
    assert!((millimetres - 84.0).abs() < 0.5, "{millimetres}");
    // 300 an inch.
    assert_eq!(number(physical + 4), 11811);
    let svg = read(&out.join("stress_strain.svg"));
    assert!(svg.contains("contraction +") && svg.contains("volume strain [%],"), "an axis has lost its name");
}

/// Strains of a run without a stage behind the consolidation, or without one, count from its start.
#[test]
fn captions_say_what_strains_count_from() {
    let folder = tempfile::tempdir().expect("a folder");
    let captions = |name: &str, stages: &[&str]| -> String {
        let file = folder.path().join(name);
        write_run_of(&file, Outcome::Finished, stages, "A test");
        let report =
            write_report(&[file], &[], &folder.path().join("report"), None).unwrap_or_else(|e| panic!("{e}"));
        read(&report.page)
    };
    let whole = captions("whole.h5", &["consolidate", "shear"]);
    assert!(whole.contains("Strains count from the end of the consolidation;"));
    assert!(whole.contains("have moved since it was consolidated"));
    for stages in [&["shear", "shear"][..], &["consolidate", "consolidate"]] {
        let page = captions(&format!("{}.h5", stages[0]), stages);
        assert!(page.contains("Strains count from the start of the run;"), "{stages:?}");
        assert!(!page.contains("since it was start"), "{stages:?}");
    }
    // Beside each other, by name.
    let files = ["whole.h5", "shear.h5"].map(|name| folder.path().join(name));
    let report =
        write_report(&files, &[], &folder.path().join("report"), None).unwrap_or_else(|e| panic!("{e}"));
    assert!(read(&report.page).contains("those of shear from the start of the run"));
}

/// Titles that differ only where a legend cuts them give way to the files' names, those that differ at their ends do not.
#[test]
fn long_titles_are_told_apart() {
    let folder = tempfile::tempdir().expect("a folder");
    let far = "a title that says more than a legend has room for, ".repeat(4);
    let legend = |numbers: [&str; 2], title: &dyn Fn(&str) -> String| -> Vec<String> {
        let files = numbers.map(|number| folder.path().join(format!("run_{number}.h5")));
        for (file, number) in files.iter().zip(numbers) {
            write_run_of(file, Outcome::Finished, &["consolidate", "shear"], &title(number));
        }
        let out = folder.path().join("report");
        write_report(&files, &[], &out, None).unwrap_or_else(|e| panic!("{e}"));
        texts(&read(&out.join("stress_strain.svg"))).into_iter().map(|(text, ..)| text).collect()
    };
    let ends = legend(["1", "2"], &|number| format!("{far}number {number}"));
    for end in ["number 1", "number 2"] {
        assert_eq!(ends.iter().filter(|text| text.ends_with(end)).count(), 1, "{ends:?}");
    }
    let middles = legend(["3", "4"], &|number| format!("{far}number {number}, {far}"));
    for stem in ["run_3", "run_4"] {
        assert_eq!(middles.iter().filter(|text| *text == stem).count(), 1, "{middles:?}");
    }
}

/// q and volume strain read at strains of their own: every other cell is empty, and either has its line.
#[test]
fn measured_lines_join_their_own_points() {
    let folder = tempfile::tempdir().expect("a folder");
    let (file, table) = (folder.path().join("run.h5"), folder.path().join("lab.csv"));
    write_made_run(&file, Outcome::Finished);
    let header = "axial_strain [%], deviatoric_stress [MPa], volumetric_strain [%], u [kPa]";
    std::fs::write(&table, format!("{header}\n0,0,\n1,,0.2\n2,2,\n3,,0.5\n4,3,\n5,,0.7\n")).expect("a table");
    let out = folder.path().join("report");
    let report = write_report(&[file], &[table], &out, None).unwrap_or_else(|e| panic!("{e}"));
    let told = &report.remarks[0];
    assert!(told.ends_with("lab.csv: columns not used: u [kPa]"), "{told}");
    let svg = read(&out.join("stress_strain.svg"));
    // Other black lines (axes, ticks) are of two or three points, too, but not this far along.
    let long = |line: &&Vec<[f64; 2]>| line.len() == 3 && line[0][0] < line[1][0] && line[1][0] < line[2][0];
    assert_eq!(lines(&svg, "#000000").iter().filter(long).count(), 2);
}

/// What is wrong with a file is an error that names it, never a panic.
#[test]
fn files_without_runs_are_errors_and_empty_runs_are_reports() {
    let folder = tempfile::tempdir().expect("a folder");
    let (missing, text) = (folder.path().join("none.h5"), folder.path().join("text.h5"));
    std::fs::write(&text, "no results").expect("a file");
    let out = folder.path().join("report");
    for file in [missing, text] {
        let message =
            write_report(std::slice::from_ref(&file), &[], &out, None).expect_err("no report").to_string();
        assert!(message.contains(&*file.file_name().expect("a name").to_string_lossy()), "{message}");
    }
    let empty = folder.path().join("empty.h5");
    let record = CaseRecord { completed: "{}".into(), stages: vec!["shear".into()], ..CaseRecord::default() };
    drop(Writer::create(&empty, &record, Existing::Refuse).expect("a new file"));
    let report = write_report(&[empty], &[], &out, None).unwrap_or_else(|e| panic!("{e}"));
    assert!(read(&report.page).contains("killed"));
    // A specimen as generated.
    let specimen = folder.path().join("specimen.h5");
    let mut writer = Writer::create(&specimen, &record, Existing::Refuse).expect("a new file");
    writer
        .write_table("specimen", &[Column::floats("void_ratio", "1", "void ratio", vec![0.45])])
        .expect("a table");
    writer.finish(Outcome::Finished, "", 0).expect("an end");
    drop(writer);
    let report = write_report(&[specimen], &[], &out, None).unwrap_or_else(|e| panic!("{e}"));
    let page = read(&report.page);
    assert!(page.contains("<th>void ratio, generated</th><td>0.45</td>"), "{page}");
    assert!(page.contains("<th>increments</th><td>0</td>") && !page.contains("factorisations"), "{page}");
}

/// Two blocks, the upper pressed and pushed over the lower.
const SCENE: &str = r#"{"title": "Push", "scene": {"bodies": [
        {"name": "plane", "shape": {"box": [1.0, 1.0, 0.1]}, "position": [0, 0, -0.05], "fixed": true},
        {"name": "block", "shape": {"box": [0.1, 0.1, 0.1]}, "position": [0, 0, 0.05]}]},
    "rock": {"density": 2180, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2},
    "contact": {"friction": 0.65, "residual_friction": 0.2, "weakening_distance": "50 um"},
    "stages": [{"kind": "load", "increments": 2, "bodies": {"block": {"force": [0, 0, "-1 kN"]}}},
               {"kind": "load", "increments": 40, "bodies": {"block": {"displacement": ["0.5 mm", null, null], "rotation": [0, 0, 0]}}}],
    "solver": {"fidelity": "rigid"}}"#;

fn riprap(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_riprap"));
    command.current_dir(folder).args(arguments).output().expect("riprap starts")
}

#[track_caller]
fn ends_with(code: i32, folder: &Path, arguments: &[&str]) -> (String, String) {
    let output = riprap(folder, arguments);
    let [stdout, stderr] =
        [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    assert_eq!(output.status.code(), Some(code), "riprap {arguments:?}\n{stdout}\n{stderr}");
    (stdout, stderr)
}

fn scene() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("push.json"), SCENE).expect("a case");
    folder
}

fn external_work(path: PathBuf) -> f64 {
    let reader = Reader::open(&path).unwrap_or_else(|e| panic!("{e}"));
    *reader.history("energy_external").expect("work").last().expect("a row")
}

/// The weakened coefficient of friction lags by an increment, so that the work is of first order in its length, and
/// its limit is the area below the law: 0.2 kN x 0.5 mm + 0.45 kN x 50 um x (1 - exp(-10)) = 0.1225 J, less the elastic stretch and
/// more the pressing.
#[test]
fn a_study_finds_the_order_and_goes_on_where_it_was() {
    let folder = scene();
    let study = ["study", "push.json", "--vary", "increment", "--values", "40,80,160", "--out", "study"];
    let (stdout, stderr) = ends_with(0, folder.path(), &study);
    assert!(stderr.contains("[3/3] increment_160"), "{stderr}");
    let order = read(&folder.path().join("study/order.csv"));
    let row = order.lines().find(|line| line.starts_with("external work")).expect("the work's order");
    let order: f64 =
        row.split(',').nth(1).expect("an order").parse().unwrap_or_else(|e| panic!("{row}: {e}"));
    // First order; three values that are not small see it within a quarter.
    assert!((order - 1.0).abs() < 0.25, "{row}");
    assert!(stdout.contains("| 160 "), "{stdout}");
    let page = read(&folder.path().join("study/study.html"));
    assert!(page.contains("its GCI [%]") && page.contains("Error against "), "{page:.2000}");
    for file in
        ["study.csv", "convergence.png", "speed_accuracy.svg", "speed_accuracy.png", "increment_40.vtkhdf"]
    {
        assert!(folder.path().join("study").join(file).exists(), "{file}");
    }
    // Again: nothing is run, and one that was lost alone is.
    std::fs::remove_file(folder.path().join("study/increment_80.vtkhdf")).expect("a file to lose");
    let (_, stderr) = ends_with(0, folder.path(), &study);
    assert_eq!(stderr.matches("is finished: left as it is").count(), 2, "{stderr}");
    // What is left alone is told first.
    assert!(stderr.contains("[3/3] increment_80\n"), "{stderr}");
    // Files of another case are not taken for this one's.
    let changed = [&study[..], &["--set", "/contact/friction=0.5"]].concat();
    let (_, stderr) = ends_with(2, folder.path(), &changed);
    assert!(stderr.contains("holds another case") && stderr.contains("--force"), "{stderr}");
}

/// The specimen is generated once, and the members are what runs by themselves would be.
#[test]
fn a_study_of_tolerances_has_one_specimen() {
    let folder = tempfile::tempdir().expect("a folder");
    let case = r#"{"title": "Sixteen grains", "seed": 4,
        "specimen": {"grains": 16, "aspect": 1.5, "grading": [["60 mm", 1.0], ["40 mm", 0.0]], "void_ratio": 0.9,
                     "unreachable": "nearest", "cells_per_grain": 24},
        "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2}, "contact": {"friction": 0.5},
        "stages": [{"kind": "consolidate", "pressure": "0.4 MPa"},
                   {"kind": "shear", "axial_strain": 0.001, "increment": 1e-4}]}"#;
    std::fs::write(folder.path().join("tiny.json"), case).expect("a case");
    let study = ["study", "tiny.json", "--vary", "tolerance", "--values", "1e-2,1e-3", "--out", "study"];
    let (_, stderr) = ends_with(0, folder.path(), &study);
    assert!(stderr.contains("one specimen for all"), "{stderr}");
    let alone =
        ["run", "tiny.json", "--set", "/solver/force_tolerance=1e-2", "--out", "alone.vtkhdf", "--quiet"];
    ends_with(0, folder.path(), &alone);
    let stress = |file: &str| {
        let reader = riprap::results::Reader::open(&folder.path().join(file)).expect("a run");
        reader.history("deviatoric_stress").expect("stresses")
    };
    assert_eq!(stress("study/tolerance_1e-2.vtkhdf"), stress("alone.vtkhdf"));
    let (_, stderr) = ends_with(0, folder.path(), &study);
    assert_eq!(stderr.matches("is finished: left as it is").count(), 2, "{stderr}");
}

#[test]
fn shells_and_man_know_the_commands() {
    let folder = scene();
    for shell in ["bash", "zsh", "fish"] {
        let (script, _) = ends_with(0, folder.path(), &["completions", shell]);
        assert!(script.contains("resume"), "{shell}: {script:.200}");
    }
    ends_with(0, folder.path(), &["man", "man1"]);
    assert!(read(&folder.path().join("man1/riprap-run.1")).contains("resume"));
}

#[test]
fn what_cannot_be_varied_is_said_by_name() {
    let folder = scene();
    let (_, stderr) = ends_with(2, folder.path(), &["study", "push.json", "--vary", "penalty"]);
    assert!(
        stderr.contains("--vary penalty") && stderr.contains("no body of the case is condensed"),
        "{stderr}"
    );
    let (_, stderr) = ends_with(2, folder.path(), &["study", "push.json", "--vary", "mesh"]);
    assert!(stderr.contains("--vary mesh"), "{stderr}");
    let (_, stderr) = ends_with(2, folder.path(), &["study", "push.json", "--vary", "increments"]);
    assert!(
        stderr.contains("increment, mesh, tolerance, stabilisation, fidelity, penalty, seed"),
        "{stderr}"
    );
    let (_, stderr) =
        ends_with(2, folder.path(), &["study", "push.json", "--vary", "tolerance", "--values", "1e-3,x"]);
    assert!(stderr.contains("\"x\" is not a positive number"), "{stderr}");
    let (stdout, stderr) = ends_with(
        0,
        folder.path(),
        &["study", "push.json", "--vary", "fidelity", "--values", "rigid,auto", "--out", "f"],
    );
    assert!(stdout.contains("| rigid ") && stdout.contains("| auto "), "{stdout}{stderr}");
}

#[test]
fn a_batch_says_why_a_member_has_no_results() {
    let folder = scene();
    let case = r#"{"specimen": {"grains": 16, "aspect": 1.5, "grading": [["60 mm", 1.0], ["40 mm", 0.0]], "void_ratio": 0.3},
                   "contact": {"friction": 0.5},
                   "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2, "damage": null},
                   "stages": [{"kind": "consolidate", "pressure": "0.4 MPa"}]}"#;
    std::fs::write(folder.path().join("dense.json"), case).expect("a case");
    std::fs::write(folder.path().join("plan.json"), r#"{"case": "dense.json"}"#).expect("a plan");
    let mut command = Command::new(env!("CARGO_BIN_EXE_riprap"));
    let output = command.current_dir(folder.path()).args(["batch", "plan.json"]).output().expect("riprap");
    assert!(!output.status.success());
    let summary = read(&folder.path().join("results/plan/summary.csv"));
    assert!(
        summary.contains(",failed,") && summary.contains("$.specimen.void_ratio: 0.3 cannot be reached"),
        "{summary}"
    );
    let (_, stderr) = ends_with(2, folder.path(), &["batch", "none.json"]);
    assert!(stderr.contains("none.json"), "{stderr}");
    // One kind of file for another.
    write_made_run(&folder.path().join("made.vtkhdf"), Outcome::Finished);
    for (command, file, says) in [
        ("batch", "dense.json", "riprap run dense.json"),
        ("run", "plan.json", "riprap batch plan.json"),
        ("check", "plan.json", "riprap batch plan.json"),
        ("run", "made.vtkhdf", "riprap info made.vtkhdf"),
        ("batch", "made.vtkhdf", "riprap info made.vtkhdf"),
    ] {
        let (_, stderr) = ends_with(2, folder.path(), &[command, file]);
        assert!(stderr.contains(says), "{stderr}");
    }
}

#[test]
fn a_batch_runs_its_members_and_goes_on_where_it_was() {
    let folder = scene();
    let plan = r#"{"case": "push.json", // comments are allowed
        "set": {"/stages/1/increments": 20},
        "grid": {"/contact/friction": [0.65, 0.4], "/contact/residual_friction": [0.2, 0.1]}, "jobs": 2}"#;
    std::fs::write(folder.path().join("plan.json"), plan).expect("a plan");
    let (stdout, _) = ends_with(0, folder.path(), &["batch", "plan.json"]);
    let results = folder.path().join("results/plan");
    let summary = read(&results.join("summary.csv"));
    assert_eq!(summary.lines().count(), 5, "{summary}");
    assert!(summary.lines().skip(1).all(|line| line.contains(",finished,")), "{summary}");
    // What differs has a column each, what all have in common has none.
    assert!(summary.starts_with("name,/contact/friction,/contact/residual_friction,status,"), "{summary}");
    assert!(summary.contains("\npush_friction=0.4_residual_friction=0.1,0.4,0.1,finished,"), "{summary}");
    assert!(stdout.contains("push_friction=0.65_residual_friction=0.1"), "{stdout}");
    // Less friction, less work: the members are what they are called.
    let work = |peak: &str, residual: &str| {
        external_work(results.join(format!("push_friction={peak}_residual_friction={residual}.vtkhdf")))
    };
    assert!(work("0.65", "0.2") > work("0.65", "0.1") && work("0.65", "0.1") > work("0.4", "0.1"));
    // The same number as a run by itself.
    let set = ["--set", "/stages/1/increments=20", "--set", "/contact/friction=0.4"];
    ends_with(0, folder.path(), &[&["run", "push.json", "--out", "alone.h5", "--quiet"][..], &set].concat());
    assert_eq!(work("0.4", "0.2"), external_work(folder.path().join("alone.h5")));
    let (_, stderr) = ends_with(0, folder.path(), &["batch", "plan.json"]);
    assert_eq!(stderr.matches("left as it is").count(), 4, "{stderr}");
    // One of an array, and the array.
    let (_, stderr) = ends_with(0, folder.path(), &["batch", "plan.json", "--only", "2", "--force"]);
    assert!(stderr.contains("[1/1] push_friction=0.65_residual_friction=0.1"), "{stderr}");
    ends_with(2, folder.path(), &["batch", "plan.json", "--only", "4"]);
    let (_, stderr) = ends_with(0, folder.path(), &["batch", "plan.json", "--only", "3-9"]);
    assert_eq!(stderr.matches("left as it is").count(), 1, "{stderr}");
    // The table of what is there, and a line a member for other schedulers.
    std::fs::remove_file(results.join("summary.csv")).expect("the table");
    ends_with(0, folder.path(), &["batch", "plan.json", "--summary"]);
    assert_eq!(read(&results.join("summary.csv")).matches(",finished,").count(), 4);
    ends_with(0, folder.path(), &["batch", "plan.json", "--commands"]);
    let commands = read(&results.join("commands.txt"));
    assert!(commands.lines().count() == 4 && commands.ends_with(" --threads 1 --only 3\n"), "{commands}");
    let mut command = Command::new(env!("CARGO_BIN_EXE_riprap"));
    // A cluster's sbatch must not be found by a test.
    let output = command
        .current_dir(folder.path())
        .env("PATH", folder.path())
        .args(["batch", "plan.json", "--slurm"])
        .output()
        .expect("riprap starts");
    assert!(output.status.success());
    assert!(read(&results.join("array.sh")).contains("--array=0-3%2"));
}

#[test]
fn a_member_that_fails_is_told_and_the_others_are_run() {
    let folder = scene();
    let plan = r#"{"cases": ["push.json", {"name": "loose", "case": "push.json",
        "set": {"/stages/0/bodies/block": {"force": [0, 0, "1 kN"]}, "/stages/0/increments": 1, "/solver/max_augmentations": 1,
                "/solver/max_newton_iterations": 1}}]}"#;
    std::fs::write(folder.path().join("plan.json"), plan).expect("a plan");
    let (stdout, stderr) = ends_with(3, folder.path(), &["batch", "plan.json", "--out", "out"]);
    assert!(stdout.starts_with("push\n    status: finished; "), "{stdout}");
    let loose = stdout.split_once("\nloose\n").map_or("", |(_, behind)| behind);
    assert!(loose.contains("status: stopped"), "{stdout}");
    assert!(
        stderr.contains("loose: exit code 3") && stderr.contains("1 of 2 runs did not reach"),
        "{stderr}"
    );
}
