//! What each subcommand does.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::case::{self, Case, FileKind, RawCase, parse_override, read, refuse_input, unsupported};
use crate::error::Error;
use crate::linalg;
use crate::report::{duration, write_report};
use crate::results::{
    Existing, Reader, Summary, results_file, write_bodies_csv, write_history_csv, write_network, write_stl,
    write_tables, write_vtu_series,
};
use crate::setup::rock_samples;
use crate::simulation::{self, End, Options, Outcome, generate_specimen, missing_start};
use crate::study::plan;
use crate::verification::{Finding, PROBLEMS, Problem};

use super::arguments::{CaseInput, Check, Export, Info, Report, Run, Specimen, Target, Verify};
use super::exit::{Ending, Failure};
use super::interrupt;
use super::machine;
use super::progress::Progress;
use super::terminal::{complain, note, say};

/// Stack of a worker thread [bytes], as much as the main thread usually has: the run is on one of them.
const STACK: usize = 8 << 20;

pub type Ended = Result<Ending, Failure>;

pub fn run(arguments: &Run) -> Ended {
    let threads = set_threads(arguments.target.threads)?;
    let fidelity = arguments.fidelity.as_ref().map(|level| format!("/solver/fidelity=\"{level}\""));
    let source = given(&arguments.input, fidelity)?;
    let case = checked_with_start(&source)?;
    machine::check_memory(&case, machine::memory())?;
    let out = arguments.out.clone().unwrap_or_else(|| default_target(&arguments.input.case));
    let mut options = Options {
        profile: arguments.profile,
        audit: arguments.audit,
        ..options(out, &arguments.target, threads)
    };
    if arguments.resume {
        options.existing = Existing::Continue;
    }
    let mut progress = Progress::new(&arguments.target);
    progress.title(&case, folder_of(&source), &options);
    interrupt::listen();
    // On one of the pool's own threads, so that no call has to wait for another thread to wake up.
    let outcome = rayon::scope(|_| simulation::run(&case, &source, &options, &mut progress))?;
    let ending = conclude(&mut progress, &outcome, &options);
    if arguments.profile {
        note(&outcome.profile.to_string());
    }
    Ok(ending)
}

pub fn specimen(arguments: &Specimen) -> Ended {
    let threads = set_threads(arguments.target.threads)?;
    let (source, case) = checked(&arguments.input, None)?;
    machine::check_memory(&case, machine::memory())?;
    let options = options(arguments.out.clone(), &arguments.target, threads);
    let mut progress = Progress::new(&arguments.target);
    progress.title(&case, folder_of(&source), &options);
    let outcome = rayon::scope(|_| generate_specimen(&case, &source, &options, &mut progress))?;
    Ok(conclude(&mut progress, &outcome, &options))
}

fn conclude(progress: &mut Progress, outcome: &Outcome, options: &Options) -> Ending {
    progress.ended(outcome, options);
    match &outcome.end {
        End::Finished => Ending::Done,
        End::Interrupted => Ending::Interrupted,
        End::Stopped { reason } => {
            complain(&format!(
                "stopped after increment {}: {reason}; {} holds everything up to there",
                outcome.increments,
                options.out.display()
            ));
            if let Some(dossier) = &outcome.dossier {
                note(&dossier.to_string());
            }
            Ending::Stopped
        }
    }
}

pub fn check(arguments: &Check) -> Ended {
    let failed = |error: Error| Failure { error, ending: Ending::CheckFailed };
    // An unreadable file is bad input as ever.
    let source = given(&arguments.input, None)?;
    let case = checked_with_start(&source).map_err(failed)?;
    simulation::check_start(&case, &source).map_err(failed)?;
    let memory = machine::memory();
    let fits = machine::check_memory(&case, memory);
    if arguments.full {
        say(&format!("{:#}", case.completed()));
    } else {
        let but = if fits.is_ok() { "" } else { ", but too large for this machine" };
        say(&format!("{}: sound{but}", arguments.input.case.display()));
        say(&case.estimate().to_string());
        case.remarks().iter().for_each(|remark| say(remark));
        case.remarks_on_meshes(folder_of(&source)).iter().for_each(|remark| say(remark));
        // What is refused is said below.
        case.burdens(memory.filter(|_| fits.is_ok())).iter().for_each(|burden| say(burden));
        for drawn in rock_samples::expected(&case).map_err(failed)? {
            say(&drawn.to_string());
        }
    }
    fits.map_err(failed)?;
    let faults = unsupported(&case);
    if !faults.is_empty() {
        complain("sound, but riprap cannot run all of it yet:");
        return Err(failed(Error::Case { file: source.file, faults }));
    }
    Ok(Ending::Done)
}

pub fn info(arguments: &Info) -> Ended {
    refuse_input(&arguments.file, FileKind::Results)?;
    let reader = Reader::open(&arguments.file)?;
    // Before its numbers are shown.
    let verified = arguments.verify.then(|| reader.verify()).transpose()?;
    let summary = Summary { verified, ..Summary::of(&reader)? };
    match arguments.json {
        true => say(&summary.to_json()),
        false => say(summary.to_string().trim_end()),
    }
    Ok(Ending::Done)
}

pub fn export(arguments: &Export) -> Ended {
    if [&arguments.csv, &arguments.vtu, &arguments.vtp, &arguments.stl].iter().all(|wish| wish.is_none()) {
        let message = "nothing to export: one or more of --csv DIR, --vtu DIR, --vtp DIR, --stl DIR";
        return Err(Error::Usage(message.into()).into());
    }
    refuse_input(&arguments.file, FileKind::Results)?;
    let reader = Reader::open(&arguments.file)?;
    let stem = arguments.file.file_stem().unwrap_or(arguments.file.as_os_str()).to_string_lossy();
    if let Some(folder) = &arguments.csv {
        std::fs::create_dir_all(folder).map_err(|e| Error::io("create", folder, e))?;
        let write = |name: String, table: fn(&Reader, &mut File, &Path) -> Result<(), Error>| {
            let target = folder.join(name);
            let mut file = File::create(&target).map_err(|e| Error::io("write", &target, e))?;
            table(&reader, &mut file, &target)?;
            say(&target.display().to_string());
            Ok::<(), Error>(())
        };
        write(format!("{stem}.csv"), write_history_csv)?;
        if !reader.members("bodies")?.is_empty() {
            write(format!("{stem}_bodies.csv"), write_bodies_csv)?;
        }
        for table in write_tables(&reader, folder, &stem)? {
            say(&table.display().to_string());
        }
    }
    if let Some(folder) = &arguments.vtu {
        say(&write_vtu_series(&reader, folder, &stem)?.display().to_string());
    }
    if let Some(folder) = &arguments.vtp {
        say(&write_network(&reader, folder, &stem)?.display().to_string());
    }
    if let Some(folder) = &arguments.stl {
        let (all, bodies) = write_stl(&reader, folder, &stem)?;
        say(&format!("{} ({bodies} bodies, and each in a file of its own)", all.display()));
    }
    Ok(Ending::Done)
}

pub fn report(arguments: &Report) -> Ended {
    arguments.files.iter().try_for_each(|file| refuse_input(file, FileKind::Results))?;
    arguments.laboratory.iter().try_for_each(|file| refuse_input(file, FileKind::Table))?;
    let beside = || {
        let mut name = arguments.files[0].with_extension("").into_os_string();
        name.push("_report");
        PathBuf::from(name)
    };
    let folder = arguments.out.clone().unwrap_or_else(beside);
    let width = arguments.width.map(|width| 1e-3 * f64::from(width));
    let written = write_report(&arguments.files, &arguments.laboratory, &folder, width)?;
    for remark in &written.remarks {
        note(&format!("riprap: {remark}"));
    }
    say(&written.page.display().to_string());
    Ok(Ending::Done)
}

pub fn verify(arguments: &Verify) -> Ended {
    let wanted = |problem: &&Problem| {
        arguments.only.is_empty() || arguments.only.iter().any(|name| problem.name.contains(name.as_str()))
    };
    let problems: Vec<&Problem> = PROBLEMS.iter().filter(wanted).collect();
    if problems.is_empty() {
        let names: Vec<&str> = PROBLEMS.iter().map(|problem| problem.name).collect();
        let message =
            format!("--only {}: no such problem; there are {}", arguments.only.join(" "), names.join(", "));
        return Err(Error::Usage(message).into());
    }
    if arguments.list {
        problems.iter().for_each(|problem| say(&format!("{:<22} {}", problem.name, problem.title)));
        return Ok(Ending::Done);
    }
    set_threads(arguments.threads)?;
    let start = Instant::now();
    say(&Finding::header());
    let (mut passed, mut failed) = (0, 0);
    for problem in problems {
        for finding in rayon::scope(|_| problem.solve()) {
            say(&finding.to_string());
            *if finding.passed() { &mut passed } else { &mut failed } += 1;
        }
    }
    say(&format!("{passed} passed, {failed} failed, in {}", duration(start.elapsed().as_secs_f64())));
    Ok(if failed == 0 { Ending::Done } else { Ending::CheckFailed })
}

pub fn schema(of_plans: bool) -> Ended {
    let schema = if of_plans { plan::schema() } else { case::schema() };
    say(&format!("{schema:#}"));
    Ok(Ending::Done)
}

/// The case as given, overrides applied, and checked.
pub fn checked(input: &CaseInput, extra: Option<String>) -> Result<(RawCase, Case), Failure> {
    let source = given(input, extra)?;
    let case = source.check()?;
    Ok((source, case))
}

/// The case as given, overrides applied.
fn given(input: &CaseInput, extra: Option<String>) -> Result<RawCase, Failure> {
    let mut source = read(&input.case).map_err(Failure::of_input)?;
    plan::refuse_plan(&source)?;
    let (mut overrides, mut faults) = (Vec::new(), Vec::new());
    for argument in input.overrides.iter().chain(&extra) {
        match parse_override(argument) {
            Ok(parsed) => overrides.push(parsed),
            Err(fault) => faults.push(fault),
        }
    }
    source.set(&overrides);
    source.faults.extend(faults);
    Ok(source)
}

/// Where the mesh files of a case are relative to.
fn folder_of(source: &RawCase) -> &Path {
    source.file.parent().unwrap_or(Path::new(""))
}

/// Checks a case that is to run. A start that is not there is named along with its other faults; of a sound case it is looked at by whoever
/// needs it.
fn checked_with_start(source: &RawCase) -> Result<Case, Error> {
    source.check().map_err(|error| match error {
        Error::Case { file, mut faults } => {
            let named = faults.iter().any(|fault| fault.path == "$.start_from");
            faults.extend(missing_start(source).filter(|_| !named));
            Error::Case { file, faults }
        }
        other => other,
    })
}

/// `results/<name>.vtkhdf` beside the case, or an older `.h5` there.
fn default_target(case: &Path) -> PathBuf {
    let name = case.file_stem().unwrap_or(case.as_os_str());
    results_file(&case.parent().unwrap_or(Path::new("")).join("results"), name)
}

fn options(out: PathBuf, target: &Target, threads: usize) -> Options {
    let existing = if target.force { Existing::Replace } else { Existing::Refuse };
    Options { out, existing, threads, profile: false, audit: false }
}

/// Sets how many threads work, before the first of them does; without a wish, one a core.
fn set_threads(wanted: Option<u16>) -> Result<usize, Failure> {
    let threads = match wanted {
        Some(threads) => usize::from(threads),
        None => std::thread::available_parallelism().map_or(1, |n| n.get()),
    };
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .stack_size(STACK)
        .build_global()
        .map_err(|e| Error::Usage(format!("cannot start {threads} threads: {e}")))?;
    linalg::factorise_sequentially();
    Ok(threads)
}
