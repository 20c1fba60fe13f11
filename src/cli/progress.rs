//! Shows a run as it goes on: a bar, lines for people, or lines for machines.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Map, Value, json};

use crate::case::Case;
use crate::loading::StageEnd;
use crate::material::Drawn;
use crate::report::{SOUND, duration, short};
use crate::results::{HISTORY, HistoryRow, Value as Number, counted, fixed};
use crate::setup::PlannedStage;
use crate::simulation::{
    End, Observer, Options, Outcome, Resumption, Seating, SpecimenReport, StageReport, Step,
};
use crate::solver::StopSignal;
use crate::specimen::Phase;
use crate::specimen::statistics::ClassStatistics;
use crate::triaxial::{Path, Stage, Steps, Until};

use super::arguments::{ProgressKind, Target};
use super::interrupt;
use super::terminal::{complain, folded, note, say};

/// How often lines tell of a specimen being generated.
const SPECIMEN_PAUSE: Duration = Duration::from_secs(5);
/// The bar's steps per nominal increment.
const BAR_STEPS: f64 = 100.0;

enum Display {
    Quiet,
    Plain,
    Bar(ProgressBar),
    Json,
}

/// The observer of the command line.
pub struct Progress {
    display: Display,
    told: Instant,
    phase: Option<Phase>,
    /// When the increment at hand began.
    begun: Instant,
    /// Energy error of an increment over its work from which on it is counted.
    energy_tolerance: f64,
    /// Whether no increment has been accepted yet.
    is_first: bool,
}

impl Progress {
    pub fn new(target: &Target) -> Self {
        let on_terminal = std::io::stderr().is_terminal();
        let display = match target.progress {
            _ if target.quiet => Display::Quiet,
            Some(ProgressKind::Plain) => Display::Plain,
            Some(ProgressKind::Json) => Display::Json,
            Some(ProgressKind::Bar) => Display::Bar(bar()),
            None if on_terminal => Display::Bar(bar()),
            None => Display::Plain,
        };
        Progress {
            display,
            told: Instant::now(),
            phase: None,
            begun: Instant::now(),
            energy_tolerance: 0.0,
            is_first: true,
        }
    }

    /// `folder` is where the case's mesh files are relative to.
    pub fn title(&mut self, case: &Case, folder: &std::path::Path, options: &Options) {
        let (title, threads) = (&case.title, options.threads);
        self.energy_tolerance = case.solver.energy_tolerance;
        self.tell(
            || {
                let (out, threads) = (options.out.display(), counted(threads, "thread"));
                format!("{title}\n{:<12} {out}, {threads}", "into")
            },
            || json!({"event": "begin", "title": title, "file": options.out, "threads": threads}),
        );
        for remark in case.remarks().into_iter().chain(case.remarks_on_meshes(folder)) {
            let plain = || folded(&format!("{:<12} {remark}", "note"), 13);
            self.tell(plain, || json!({"event": "remark", "text": remark}));
        }
    }

    pub fn ended(&self, outcome: &Outcome, options: &Options) {
        if let Display::Bar(bar) = &self.display {
            bar.finish_and_clear();
        }
        let (status, reason) = match &outcome.end {
            End::Finished => ("finished", None),
            End::Interrupted => ("interrupted", None),
            End::Stopped { reason } => ("stopped", Some(reason)),
        };
        let (increments, time) = (outcome.increments, outcome.wall_time);
        match &self.display {
            Display::Quiet => {}
            Display::Plain | Display::Bar(_) => {
                let (increments, time) = (counted(increments, "increment"), duration(time.as_secs_f64()));
                note(&format!("{status:<12} {increments} in {time}"));
                say(&options.out.display().to_string());
            }
            Display::Json => say(&json!({
                "event": "end", "status": status, "reason": reason, "increments": increments,
                "wall_time": time.as_secs_f64(), "file": options.out,
            })
            .to_string()),
        }
    }

    /// A line, in the form that is wanted.
    fn tell(&self, plain: impl FnOnce() -> String, machine: impl FnOnce() -> Value) {
        match &self.display {
            Display::Quiet => {}
            Display::Plain => note(&plain()),
            Display::Bar(bar) => bar.suspend(|| note(&plain())),
            Display::Json => say(&machine().to_string()),
        }
    }

    /// Says where and by what the state was written that the run goes on from: worth knowing even where no progress is
    /// shown.
    fn warn_of_origin(&self, host: Option<&str>, version: Option<&str>) {
        if let Some(host) = host {
            complain(&format!(
                "the run was begun on {host}: on another kind of processor the last bits may differ"
            ));
        }
        if let Some(version) = version {
            complain(&format!("the restart point was written by {version}: this one may compute other bits"));
        }
    }
}

impl Observer for Progress {
    fn building(&mut self, now: bool) {
        interrupt::set_phase(if now { interrupt::Phase::Building } else { interrupt::Phase::Other });
    }

    fn specimen_progress(&mut self, phase: Phase, share: f64) {
        interrupt::set_phase(interrupt::Phase::Generating);
        let new = self.phase != Some(phase);
        self.phase = Some(phase);
        let name = match phase {
            Phase::Shapes => "shapes",
            Phase::Placement => "placement",
            Phase::Compaction => "compaction",
            Phase::Relaxation => "relaxation",
            Phase::Statistics => "statistics",
        };
        if let Display::Bar(bar) = &self.display {
            if new {
                bar.set_prefix(format!("specimen, {name}"));
                set_style(bar, COUNTING);
                bar.reset();
            }
            bar.set_length(1000);
            bar.set_position((1000.0 * share) as u64);
            return;
        }
        if self.told.elapsed() >= SPECIMEN_PAUSE {
            self.told = Instant::now();
            self.tell(
                || format!("{:<15} {name} {:3.0} %", "specimen", 100.0 * share),
                || json!({"event": "specimen_progress", "phase": name, "share": share}),
            );
        }
    }

    fn specimen_ready(&mut self, report: &SpecimenReport) {
        interrupt::set_phase(interrupt::Phase::Other);
        self.tell(|| specimen_lines(report), || specimen_json(report));
        match &self.display {
            Display::Bar(bar) => {
                bar.set_prefix("seating");
                set_style(bar, WAITING);
                bar.reset();
            }
            Display::Plain => note(&format!("{:<15} until forces on grains balance", "seating")),
            Display::Quiet | Display::Json => {}
        }
    }

    fn rock_drawn(&mut self, drawn: &[Drawn]) {
        for drawn in drawn.iter().filter(|drawn| drawn.rejected > 0) {
            self.tell(
                || folded(&format!("{:<15} {drawn}", "rock"), 16),
                || {
                    json!({
                        "event": "rock", "quantity": drawn.property.name(), "values": drawn.values,
                        "rejected": drawn.rejected, "mean": drawn.mean, "mean_asked": drawn.asked,
                    })
                },
            );
        }
    }

    fn seated(&mut self, seating: &Seating) {
        self.begun = Instant::now();
        let Seating { out_of_balance, factorisations, relaxation_steps, .. } = *seating;
        self.tell(
            || {
                format!(
                    "{:<15} out of balance by {out_of_balance:.0e}, {relaxation_steps} explicit steps, {factorisations} fact",
                    "seating"
                )
            },
            || {
                json!({
                    "event": "seated", "out_of_balance": out_of_balance, "factorisations": factorisations,
                    "falling_steps": relaxation_steps,
                })
            },
        );
    }

    fn stage_begun(&mut self, stage: &PlannedStage) {
        interrupt::set_phase(interrupt::Phase::Solving);
        if let Display::Bar(bar) = &self.display {
            bar.set_prefix(stage.kind);
            set_style(bar, COUNTING);
            if stage.index == 0 {
                bar.reset();
            }
        }
        self.tell(
            || match stage.stage {
                None => format!("{:<15} in {:.0} increments", stage.kind, stage.increments),
                Some(run) => format!("{:<15} {}", stage.kind, plan_line(&run)),
            },
            || json!({"event": "stage_begun", "stage": stage.index, "kind": stage.kind}),
        );
    }

    fn step_accepted(&mut self, step: &Step<'_>) {
        let seconds = self.begun.elapsed().as_secs_f64();
        self.begun = Instant::now();
        match &self.display {
            Display::Quiet => {}
            Display::Plain => note(&step_line(step, seconds)),
            Display::Bar(bar) => {
                bar.set_length((BAR_STEPS * step.total) as u64);
                bar.set_position((BAR_STEPS * step.done) as u64);
                if std::mem::take(&mut self.is_first) {
                    // What was done before says nothing of the speed.
                    bar.reset_eta();
                }
                bar.set_message(bar_message(step.row));
            }
            Display::Json => say(&step_json(step, seconds).to_string()),
        }
    }

    fn stage_ended(&mut self, report: &StageReport<'_>) {
        interrupt::set_phase(interrupt::Phase::Other);
        let (r, work) = (report, report.work);
        let (end, reason) = match r.end {
            StageEnd::Finished => ("finished", None),
            StageEnd::Interrupted => ("interrupted", None),
            StageEnd::Stopped { reason } => ("stopped", Some(reason)),
        };
        self.tell(
            || {
                let (kind, time) = (r.stage.kind, duration(work.wall_time.as_secs_f64()));
                if work.increments == 0 {
                    return format!("{kind:<15} {end} without an increment in {time}");
                }
                let each = work.factorisations as f64 / work.increments as f64;
                format!(
                    "{kind:<15} {end} after {} increments in {time}, {each:.1} fact each\n{}",
                    work.increments,
                    energy_lines(work.energy_error.abs(), work.poorly_closed, self.energy_tolerance),
                )
            },
            || {
                json!({
                    "event": "stage_ended", "stage": r.stage.index, "kind": r.stage.kind, "end": end,
                    "reason": reason, "increments": work.increments, "factorisations": work.factorisations,
                    "energy_error": work.energy_error, "poorly_closed": work.poorly_closed,
                    "wall_time": work.wall_time.as_secs_f64(), "writing_time": work.writing_time.as_secs_f64(),
                    "states": work.states,
                })
            },
        );
    }

    fn resumed(&mut self, how: &Resumption) {
        match how {
            Resumption::Anew { reason } => self.tell(
                || format!("{:<12} from the start: {reason}", "begins"),
                || json!({"event": "resumed", "increment": 0, "reason": reason}),
            ),
            Resumption::Finished { increments } => self.tell(
                || format!("{:<12} already, {increments} increments: nothing is left to do", "finished"),
                || json!({"event": "resumed", "increment": increments, "finished": true}),
            ),
            Resumption::Started { file, consolidated, host, version } => {
                self.warn_of_origin(host.as_deref(), version.as_deref());
                let file = file.display();
                let which = if *consolidated { "consolidated specimen" } else { "specimen, as generated," };
                self.tell(
                    || format!("{:<12} from the {which} in {file}", "starts"),
                    || {
                        json!({
                            "event": "started", "file": file.to_string(), "consolidated": consolidated,
                            "host": host, "version": version,
                        })
                    },
                );
            }
            Resumption::After { increment, dropped, damaged, host, version } => {
                // Worth knowing even where no progress is shown.
                for what in damaged {
                    complain(&format!("{what}; going on from an older restart point"));
                }
                self.warn_of_origin(host.as_deref(), version.as_deref());
                self.tell(
                    || {
                        let again = match dropped {
                            0 => String::new(),
                            n => format!("; {n} increments behind it are computed again"),
                        };
                        format!("{:<12} after increment {increment}{again}", "continues")
                    },
                    || {
                        json!({
                            "event": "resumed", "increment": increment, "dropped": dropped, "damaged": damaged,
                            "host": host, "version": version,
                        })
                    },
                );
            }
        }
    }

    fn stop_requested(&self) -> bool {
        interrupt::requested()
    }

    fn stop_signal(&self) -> StopSignal {
        interrupt::signal()
    }
}

/// How far something is, in 80 columns with strain and q behind it, and no more; and that something goes on whose end nobody knows.
const COUNTING: &str = "{prefix:<20} [{bar:12}] {percent:>3} %  {eta:>4} left  {wide_msg}";
const WAITING: &str = "{prefix:<20} {spinner} {elapsed}";

fn bar() -> ProgressBar {
    let bar = ProgressBar::new(1000);
    // Before anything is drawn: the library's own style is another.
    set_style(&bar, WAITING);
    bar.set_prefix("start");
    bar.enable_steady_tick(Duration::from_millis(500));
    bar
}

fn set_style(bar: &ProgressBar, template: &str) {
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.progress_chars("=> "));
    }
}

fn bar_message(row: &HistoryRow) -> String {
    let (ea, q) = (fixed(100.0 * row.axial_strain, 2), fixed(1e-6 * row.deviatoric_stress, 3));
    match row.axial_strain.is_nan() {
        true => format!("{} aug {} fact", row.augmentations, row.factorisations),
        false => format!("ea {ea} %  q {q} MPa"),
    }
}

/// What a specimen came to, its grading and the shape of its grains included.
fn specimen_lines(r: &SpecimenReport) -> String {
    let missed = match r.void_ratio_is_missed() {
        true => format!(" (asked: {:.3})", r.void_ratio_asked),
        false => String::new(),
    };
    let class = |class: &ClassStatistics| {
        let [a, b] = class.sizes.map(|size| short(1e3 * size));
        let [asked, achieved] = class.mass_fraction.map(|share| 100.0 * share);
        format!("{a}-{b} mm {achieved:.1} % of the mass (asked: {asked:.1}) in {} grains", class.grains)
    };
    let [gjk, axis] = r.worst_overlap;
    let size = format!("{:.1} x {:.1} mm", 1e3 * r.diameter, 1e3 * r.height);
    let found = [
        format!("{} grains, {size}, void ratio {:.3}{missed}", r.grains, r.void_ratio),
        format!("{:.1} contacts a grain, {} rattlers", r.coordination_number, r.rattlers),
        r.classes.iter().map(class).collect::<Vec<_>>().join(", "),
        format!("shape in the mean: elongation {:.2}, flatness {:.2},", r.elongation, r.flatness),
        format!("sphericity {:.2}, {:.1} vertices", r.sphericity, r.vertices),
        format!("{} cells, worst radius ratio {:.2}", r.cells, r.worst_radius_ratio),
        format!("worst overlap {:.0e} of a grain; {}", gjk.max(axis), duration(r.wall_time.as_secs_f64())),
    ];
    let lines = found.map(|line| folded(&format!("{:<15} {line}", ""), 16));
    lines.join("\n").replacen(&" ".repeat(8), "specimen", 1)
}

fn specimen_json(r: &SpecimenReport) -> Value {
    let class = |class: &ClassStatistics| {
        let [smallest, largest] = class.sizes;
        let [asked, achieved] = class.mass_fraction;
        json!({
            "smallest_size": smallest, "largest_size": largest, "grains": class.grains,
            "mass_fraction_asked": asked, "mass_fraction": achieved,
        })
    };
    let [gjk, axis] = r.worst_overlap;
    json!({
        "event": "specimen", "grains": r.grains, "cells": r.cells, "nodes": r.nodes,
        "diameter": r.diameter, "height": r.height, "void_ratio": r.void_ratio,
        "void_ratio_asked": r.void_ratio_asked,
        "coordination_number": r.coordination_number, "rattlers": r.rattlers,
        "grading": r.classes.iter().map(class).collect::<Vec<_>>(),
        "elongation": r.elongation, "flatness": r.flatness, "sphericity": r.sphericity, "vertices": r.vertices,
        "worst_overlap_gjk": gjk, "worst_overlap_separating_axis": axis,
        "worst_radius_ratio": r.worst_radius_ratio, "wall_time": r.wall_time.as_secs_f64(),
    })
}

/// What a stage of a specimen is about to do.
fn plan_line(stage: &Stage) -> String {
    let path = match stage.path {
        Path::Stress { axial, radial } if axial == radial => format!("to {:.3} MPa", 1e-6 * axial),
        Path::Stress { axial, radial } => {
            format!("to {:.3} MPa axial, {:.3} MPa radial", 1e-6 * axial, 1e-6 * radial)
        }
        Path::Shear { deviatoric_stress } => format!("to q = {:.3} MPa", 1e-6 * deviatoric_stress),
        Path::Strain { .. } if stage.until.must => {
            format!("to q = {:.3} MPa", 1e-6 * stage.until.deviatoric_stress.unwrap_or(0.0))
        }
        Path::Strain { axial_strain, .. } => format!("by {:.2} %", 100.0 * axial_strain),
        Path::Return { .. } => "to where unloading began".into(),
        Path::Hold => "as it is".into(),
    };
    match stage.steps {
        Steps::Count(count) => format!("{path} in {count} increments"),
        Steps::Strain { nominal, .. } => format!("{path} in increments of {:.3} %", 100.0 * nominal),
    }
}

/// What the energy that no row of the ledger accounts for, as a share of a stage's work, means to a reader; where it is not sound, how many increments,
/// `poor` of them, missed more than `tolerance` of their own.
fn energy_lines(error: f64, poor: usize, tolerance: f64) -> String {
    let indent = " ".repeat(16);
    let share = |value: f64| format!("{} %", short(100.0 * value));
    let told = format!("{indent}energy: {} of work unaccounted for;", share(error));
    if error < SOUND {
        return format!("{told} below {} is sound", share(SOUND));
    }
    let lines = format!("{told}\n{indent}distrust stresses by as much: smaller increments close it");
    match poor {
        0 => lines,
        poor => {
            format!("{lines}\n{indent}in {} more than {} each", counted(poor, "increment"), share(tolerance))
        }
    }
}

/// How much of its stage is done: nominal increments, or, where it may end before its path does, a share.
fn how_far(step: &Step<'_>) -> String {
    if step.stage.stage.is_some_and(|stage| stage.until != Until::default()) {
        return format!("{:.1} %", 100.0 * step.progress);
    }
    // Increments that were cut make fractions of the nominal ones.
    let done = step.progress * step.stage.increments;
    let done = match (done - done.round()).abs() < 1e-6 {
        true => format!("{done:.0}"),
        false => format!("{done:.1}"),
    };
    format!("{done}/{:.0}", step.stage.increments.ceil())
}

/// One line per increment, in columns.
fn step_line(step: &Step<'_>, seconds: f64) -> String {
    let (row, of) = (step.row, how_far(step));
    let state = match step.stage.stage {
        Some(_) => format!(
            "ea {:>6} %  ev {:>6} %  q {:>7} MPa",
            fixed(100.0 * row.axial_strain, 3),
            fixed(100.0 * row.volumetric_strain, 3),
            fixed(1e-6 * row.deviatoric_stress, 3)
        ),
        None => format!("out of balance {:.1e}  work {:9.3e} J", row.out_of_balance, row.energy_external),
    };
    let cuts = if row.cuts > 0 { format!("  cut {}x", row.cuts) } else { String::new() };
    format!("{:<11} {of:>9}  {state}  {:>3} fact {seconds:5.1} s{cuts}", step.stage.kind, row.factorisations)
}

fn step_json(step: &Step<'_>, seconds: f64) -> Value {
    let mut line = Map::new();
    line.insert("event".into(), "increment".into());
    line.insert("kind".into(), step.stage.kind.into());
    line.insert("progress".into(), step.progress.into());
    line.insert("done".into(), (step.done / step.total).into());
    line.insert("seconds".into(), seconds.into());
    for (quantity, value) in HISTORY.iter().zip(step.row.values()) {
        let value = match value {
            Number::Float(value) => value.into(),
            Number::Integer(value) => value.into(),
        };
        line.insert(quantity.name.into(), value);
    }
    Value::Object(line)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::triaxial::Lateral;

    #[test]
    fn energy_is_judged_in_eighty_columns() {
        for (error, poor, says) in [
            (3.5e-4, 75, "energy: 0.035 % of work unaccounted for; below 1 % is sound"),
            (0.00512, 12_345, "below 1 % is sound"),
            (0.0512, 0, "distrust stresses by as much: smaller increments"),
            (0.0512, 12_345, "in 12345 increments more than 0.1 % each"),
            (0.0512, 1, "in 1 increment more"),
        ] {
            let lines = energy_lines(error, poor, 1e-3);
            assert!(lines.contains(says), "{lines}");
            assert!(lines.lines().all(|line| line.chars().count() <= 80), "{lines}");
        }
        // Where the sum is sound single increments are no reason to worry.
        assert_eq!(energy_lines(3.5e-4, 75, 1e-3).lines().count(), 1);
        assert!(!energy_lines(0.0512, 75, 1e-3).contains("sound"));
    }

    fn fits_a_terminal(text: &str) {
        assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    }

    #[test]
    fn increments_and_specimens_are_told_in_eighty_columns() {
        let row = HistoryRow {
            axial_strain: 0.15,
            volumetric_strain: -0.012345,
            mean_stress: 12.3456e6,
            deviatoric_stress: -1e-3,
            sliding_fraction: 1.0,
            augmentations: 123,
            factorisations: 123,
            out_of_balance: 1e-3,
            energy_external: -1.234e-5,
            ..HistoryRow::UNKNOWN
        };
        let mut stage = shear(Until::default());
        for says in ["q   0.000 MPa", "work -1.234e-5 J"] {
            let step = Step { stage: &stage, progress: 0.2525, done: 0.0, total: 1.0, row: &row };
            let line = step_line(&step, 12.345);
            fits_a_terminal(&line);
            assert!(line.contains(says), "{line}");
            stage.stage = None;
        }
        // What the bar leaves of 80 columns.
        assert!(bar_message(&row).chars().count() <= 26, "{}", bar_message(&row));
        let class = ClassStatistics { sizes: [0.0375, 0.0625], grains: 3643, mass_fraction: [0.1234; 2] };
        let report = SpecimenReport {
            grains: 3643,
            cells: 138_434,
            nodes: 346_000,
            diameter: 0.3,
            height: 0.65,
            void_ratio: 0.658,
            void_ratio_asked: 0.6,
            coordination_number: 5.2,
            rattlers: 321,
            classes: vec![class.clone(), class],
            elongation: 0.92,
            flatness: 0.91,
            sphericity: 0.85,
            vertices: 12.0,
            worst_overlap: [3e-5; 2],
            worst_radius_ratio: 0.15,
            wall_time: Duration::from_secs(4000),
        };
        fits_a_terminal(&specimen_lines(&report));
    }

    fn shear(until: Until) -> PlannedStage {
        let path = Path::Strain { axial_strain: 0.1, lateral: Lateral::Pressure };
        let steps = Steps::Strain { nominal: 5e-4, largest: 5e-4, growth: 1.0 };
        PlannedStage { index: 0, kind: "shear", stage: Some(Stage { path, steps, until }), increments: 200.0 }
    }

    #[test]
    fn stages_that_may_end_early_count_no_increments() {
        let row = HistoryRow::UNKNOWN;
        let how_far = |until: Until, progress: f64| {
            let stage = shear(until);
            super::how_far(&Step { stage: &stage, progress, done: 0.0, total: 1.0, row: &row })
        };
        assert_eq!(how_far(Until::default(), 0.25), "50/200");
        assert_eq!(how_far(Until::default(), 0.2525), "50.5/200");
        let landing = Until { deviatoric_stress: Some(1e6), ..Until::default() };
        // It landed, wherever on the path that was.
        assert_eq!(how_far(landing, 1.0), "100.0 %");
        assert_eq!(how_far(Until { drop_after_peak: Some(0.1), ..landing }, 0.25), "25.0 %");
    }
}
