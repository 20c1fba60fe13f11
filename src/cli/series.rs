//! `riprap study` and `riprap batch`: series of runs, each a process of its own.

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::Value;

use crate::case::{Case, Geometry, RawCase, StageCase, parse_override};
use crate::error::Error;
use crate::report::chart::Chart;
use crate::report::{Section, duration, write_chart, write_page};
use crate::study::launch::{Event, Launch, Standing, generate};
use crate::study::outcome::{Figures, compared};
use crate::study::plan::read_plan;
use crate::study::vary::{Setting, Vary};
use crate::study::{Member, Refusal, chart, plan, safe, slurm, table};

use super::arguments::{Batch, Study};
use super::commands::{Ended, checked};
use super::exit::{Ending, Failure};
use super::interrupt;
use super::terminal::{complain, folded, note, say};

pub fn study(arguments: &Study) -> Ended {
    let (source, case) = checked(&arguments.input, None)?;
    let settings = arguments.vary.settings(&source, &case, &arguments.values)?;
    let folder =
        arguments.out.clone().unwrap_or_else(|| beside(&arguments.input.case, arguments.vary.word()));
    // The member's process reads the case file anew, so that it needs what --set said here too.
    let given: Vec<_> =
        arguments.input.overrides.iter().filter_map(|text| parse_override(text).ok()).collect();
    let specimen = match shares_specimen(&case, arguments.vary) && settings.len() > 1 {
        true => Member::new("specimen", &source, given.clone(), &folder).ok(),
        false => None,
    };
    let (members, mut kept) =
        members_of(arguments.vary, settings, &source, &given, specimen.as_ref(), &folder)?;
    if let Some(specimen) = &specimen {
        note(&format!("one specimen for all: {}", specimen.results.display()));
        generate(&program()?, specimen, arguments.threads, arguments.force)?;
    }
    let whole = launch(&members, arguments.jobs, arguments.threads, arguments.force)?;
    let figures: Vec<Figures> = members.iter().map(Figures::of).collect();
    let built = arguments.vary.as_built(&mut kept, &figures);
    show_study(&case, arguments.vary, &kept, built.as_deref(), &figures, &folder)?;
    Ok(conclude(whole, &members, &figures))
}

/// A member for each setting that riprap can run, on the `specimen` where they share one; what is left out is noted.
fn members_of(
    vary: Vary,
    settings: Vec<Setting>,
    source: &RawCase,
    given: &[(String, Value)],
    specimen: Option<&Member>,
    folder: &Path,
) -> Result<(Vec<Member>, Vec<Setting>), Error> {
    let (mut members, mut kept) = (Vec::new(), Vec::new());
    let mut faults = Vec::new();
    for setting in settings {
        let name = format!("{}_{}", vary.word(), setting.label);
        let mut overrides = given.to_vec();
        overrides.extend(setting.overrides.iter().cloned());
        if let Some(specimen) = specimen {
            let file = std::path::absolute(&specimen.results).unwrap_or_else(|_| specimen.results.clone());
            overrides.push(("/start_from".into(), file.to_string_lossy().into()));
        }
        match Member::new(&name, source, overrides, folder) {
            Ok(member) => {
                members.push(member);
                kept.push(setting);
            }
            Err(Refusal::Unsupported(faults)) => {
                let (word, label) = (vary.word(), &setting.label);
                note(&format!("left out: {word} {label}, since riprap cannot do it yet:"));
                faults.iter().for_each(|fault| note(&format!("  {fault}")));
            }
            Err(refusal @ Refusal::Faulty(_)) => plan::list(&name, &refusal, &mut faults),
        }
    }
    if !faults.is_empty() {
        return Err(Error::Case { file: source.file.clone(), faults });
    }
    if members.is_empty() {
        return Err(Error::Usage(format!("--vary {}: nothing is left to run", vary.word())));
    }
    Ok((members, kept))
}

/// Tables and charts of a study, on the terminal and in its folder; `built` is what was varied as it came out.
fn show_study(
    case: &Case,
    vary: Vary,
    kept: &[Setting],
    built: Option<&[f64]>,
    figures: &[Figures],
    folder: &Path,
) -> Result<(), Error> {
    let quantities = compared(figures);
    let heading = vary.heading(case);
    let mut values = table::study(heading, kept, figures, &quantities);
    if let Some(built) = built {
        values.insert_column(1, "as built [1]", built);
    }
    let turned = values.turned();
    say(&format!("{}\n\n{}", case.title, turned.to_markdown()));
    values.write_csv(&folder.join("study.csv"))?;
    let mut sections = vec![Section::Table(turned.header, turned.rows)];
    let ensemble = vary == Vary::Seed;
    let (second, file) = match ensemble {
        true => (table::scatter(&quantities), "scatter.csv"),
        false => (table::orders(kept, &quantities), "order.csv"),
    };
    if ensemble || kept.iter().any(|setting| setting.size.is_some()) {
        say(&format!("\n{}", second.to_list()));
        let numbers = if ensemble { second.clone() } else { table::order_numbers(kept, &quantities) };
        numbers.write_csv(&folder.join(file))?;
        sections.push(Section::Table(second.header, second.rows));
    }
    let mut draw = |stem: &str, chart: Option<Chart>, caption: &str| -> Result<(), Error> {
        if let Some(chart) = chart {
            sections.push(Section::Chart(write_chart(folder, stem, &chart)?, caption.into()));
            note(&folder.join(format!("{stem}.png")).display().to_string());
        }
        Ok(())
    };
    draw(
        "curves",
        chart::curves(kept, figures, ensemble),
        "Strains count from the end of the consolidation.",
    )?;
    if !ensemble {
        let caption =
            "Orders after Roache (1994), from the three finest values; from one triple an order is a hint.";
        draw("convergence", chart::convergence(heading, kept, &quantities), caption)?;
        let chart = chart::speed_and_accuracy(heading, kept, figures, &quantities);
        draw("speed_accuracy", chart, "Further down is better, further left is faster.")?;
    }
    let page = folder.join("study.html");
    write_page(&page, &format!("{}: {heading} varied", case.title), sections)?;
    say(&format!("\n{}", page.display()));
    Ok(())
}

/// Whether all members of a study begin with the specimen as generated, which is made once then. Their bits are those of runs by themselves.
fn shares_specimen(case: &Case, vary: Vary) -> bool {
    let consolidates = matches!(case.stages.first(), Some(StageCase::Consolidate { .. }));
    let is_specimen = matches!(case.geometry, Geometry::Specimen(_));
    let same = match vary {
        Vary::Increment | Vary::Tolerance | Vary::Stabilisation | Vary::Fidelity | Vary::Penalty => true,
        Vary::Mesh | Vary::Seed => false,
    };
    same && is_specimen && consolidates && case.start_from.is_none()
}

pub fn batch(arguments: &Batch) -> Ended {
    let plan = read_plan(&arguments.plan, arguments.out.as_deref()).map_err(Failure::of_input)?;
    let jobs = arguments.jobs.map(usize::from).or(plan.jobs);
    let mut plan = plan;
    plan.threads = arguments.threads.map_or(plan.threads, usize::from);
    if arguments.slurm {
        let program = program()?;
        let (script, answer) = slurm::submit(&plan, &program, jobs, arguments.force)?;
        match answer {
            Some(answer) => note(&answer),
            None => note("there is no sbatch here: the script is written and not submitted"),
        }
        say(&script.display().to_string());
        return Ok(Ending::Done);
    }
    if arguments.commands {
        let path = slurm::write_commands(&plan, &program()?, arguments.force)?;
        say(&path.display().to_string());
        return Ok(Ending::Done);
    }
    let members = match arguments.only {
        None => plan.members,
        // A job array's last task may have fewer than the others.
        Some((first, last)) => match plan.members.get(first..=last.min(plan.members.len().saturating_sub(1)))
        {
            Some(members) if !members.is_empty() => members.to_vec(),
            _ => {
                let last = plan.members.len().saturating_sub(1);
                let message = format!("--only {first}: the plan has members 0 to {last}");
                return Err(Error::Usage(message).into());
            }
        },
    };
    if arguments.list {
        members.iter().for_each(|member| say(&member.name));
        return Ok(Ending::Done);
    }
    // A task of a job array has the cores of one member.
    let jobs = if arguments.only.is_some() { arguments.jobs.map(usize::from) } else { jobs };
    let whole = match arguments.summary {
        true => true,
        false => launch(&members, jobs.unwrap_or(1), plan.threads, arguments.force)?,
    };
    let figures: Vec<Figures> = members.iter().map(Figures::of).collect();
    if arguments.summary && !figures.iter().any(Figures::has_begun) {
        let plan = arguments.plan.display();
        let out = arguments.out.as_ref().map_or(String::new(), |out| format!(" --out {}", out.display()));
        complain(&format!("{plan}: none of its members has run yet; riprap batch {plan}{out} runs them"));
        return Ok(Ending::Stopped);
    }
    if arguments.only.is_none() {
        let summary = table::batch(&members, &figures);
        say(&summary.to_table_or_list());
        summary.write_csv(&plan.out.join("summary.csv"))?;
    }
    Ok(conclude(whole, &members, &figures))
}

fn program() -> Result<PathBuf, Error> {
    std::env::current_exe().map_err(|e| Error::io("find", Path::new("the riprap program"), e))
}

/// Runs what has to be run, and tells.
fn launch(members: &[Member], jobs: usize, threads: usize, force: bool) -> Result<bool, Error> {
    interrupt::listen();
    let program = program()?;
    let launch = Launch { program: &program, jobs, threads, force, stop: &interrupt::requested };
    let all = members.len();
    let (mut begun, mut skipped, mut ended) = (0, 0, 0);
    let start = Instant::now();
    launch.run(members, &mut |event| match event {
        Event::Skipped(member, standing) => {
            begun += 1;
            skipped += 1;
            let how = match standing {
                Standing::Finished => "is finished",
                Standing::Stopped(_) => "stopped short before and would again",
                Standing::Running => "is being run by another process",
                Standing::New | Standing::Broken { .. } | Standing::Foreign | Standing::Unreadable(_) => {
                    "is there"
                }
            };
            note(&format!("[{begun}/{all}] {} {how}: left as it is", member.name));
        }
        Event::Started(member) => {
            begun += 1;
            note(&format!("[{begun}/{all}] {}", member.name));
        }
        Event::Ended(member, code, line) => {
            ended += 1;
            let how = match code {
                Some(0) => "finished".to_string(),
                Some(130) => "interrupted".to_string(),
                Some(code) => format!("exit code {code}: {line}"),
                None => format!("a signal: {line}"),
            };
            let left = all - skipped - ended;
            let time = start.elapsed().as_secs_f64() * left as f64 / ended as f64;
            let time =
                if left > 0 { format!("; {left} left, about {}", duration(time)) } else { String::new() };
            note(&folded(&format!("{}: {how}{time}", member.name), 4));
        }
    })
}

fn conclude(whole: bool, members: &[Member], figures: &[Figures]) -> Ending {
    if !whole {
        return Ending::Interrupted;
    }
    let short: Vec<&str> = members
        .iter()
        .zip(figures)
        .filter(|(_, figures)| !figures.is_finished())
        .map(|(member, _)| member.name.as_str())
        .collect();
    if short.is_empty() {
        return Ending::Done;
    }
    let shown = short.iter().take(10).copied().collect::<Vec<_>>().join(", ");
    let more = if short.len() > 10 { ", …" } else { "" };
    let idle = match figures.iter().filter(|figures| !figures.has_begun()).count() {
        0 => String::new(),
        idle => format!("; {idle} of them not begun"),
    };
    let (short, all) = (short.len(), members.len());
    complain(&format!("{short} of {all} runs did not reach the end of their case{idle}:"));
    note(&folded(&format!("    {shown}{more}"), 4));
    Ending::Stopped
}

/// `results/<case>_<what is varied>` beside the case.
fn beside(case: &Path, word: &str) -> PathBuf {
    let stem = case.file_stem().unwrap_or(case.as_os_str()).to_string_lossy();
    case.parent().unwrap_or(Path::new("")).join("results").join(safe(&format!("{stem}_{word}")))
}
