//! The arguments of the `riprap` command, and the help that teaches them.

use std::path::PathBuf;
use std::sync::LazyLock;

use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;

use crate::results::{COMMIT, VERSION};
use crate::study::vary::Vary;

const EXAMPLES: &str = "\
Examples:
  riprap run cases/quick_start.json         into cases/results/quick_start.vtkhdf
  riprap check cases/quick_start.json       what is wrong, or what would be built
  riprap run my.json --set '/stages/0/pressure=0.4 MPa' --out p0400.vtkhdf
  riprap info cases/results/quick_start.vtkhdf            what is in it
  riprap report cases/results/quick_start.vtkhdf --out report
  riprap verify                             problems with known answers
  riprap schema > riprap.schema.json        for editors that check JSON

Exit codes: 0 done, 1 a check failed, 2 bad usage or input, 3 stopped short of
the case's end, 4 file trouble, 130 interrupted.

RIPRAP_LOG=debug (error, warn, info, debug, trace) tells what the solver does.";

/// The version and the commit of the sources.
static VERSION_LINE: LazyLock<String> = LazyLock::new(|| format!("{VERSION} ({COMMIT})"));

#[derive(Debug, Parser)]
#[command(name = "riprap", version = VERSION_LINE.as_str(), about, after_help = EXAMPLES, max_term_width = 110)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a case: specimen, stages, results file
    #[command(after_help = RUN_EXAMPLES)]
    Run(Run),
    /// Check a case: list every fault, or say what it would build
    #[command(after_help = CHECK_EXAMPLES)]
    Check(Check),
    /// Generate a case's specimen only, with its statistics
    Specimen(Specimen),
    /// Say what is in a results file
    Info(Info),
    /// Export a results file: tables, fields, contacts, grains
    #[command(after_help = EXPORT_EXAMPLES)]
    Export(Export),
    /// Run a case several times with one thing varied: table, order of convergence, speed against accuracy
    #[command(after_help = STUDY_EXAMPLES)]
    Study(Study),
    /// Run many cases, each as a process of its own
    #[command(after_help = BATCH_EXAMPLES)]
    Batch(Batch),
    /// Draw charts and pictures of results files, with one page that holds them all
    #[command(after_help = REPORT_EXAMPLES)]
    Report(Report),
    /// Compute problems with known answers and print their table; exit code 1 if one fails
    Verify(Verify),
    /// Print the JSON Schema of case files
    Schema {
        /// Of plans of batches instead
        #[arg(long)]
        plan: bool,
    },
    /// Print what completes commands and options in a shell
    #[command(after_help = COMPLETIONS_EXAMPLES)]
    Completions {
        /// The shell that is to complete them
        shell: Shell,
    },
    /// Write manual pages, one a command, into a folder
    #[command(after_help = MAN_EXAMPLES)]
    Man {
        /// Where riprap.1 and riprap-<command>.1 are written; the folder is made where it is missing
        #[arg(value_name = "DIR")]
        folder: PathBuf,
    },
}

const COMPLETIONS_EXAMPLES: &str = "\
Examples:
  riprap completions bash > ~/.local/share/bash-completion/completions/riprap
  riprap completions zsh > _riprap                  in a folder of $fpath";

const MAN_EXAMPLES: &str = "\
Examples:
  riprap man ~/.local/share/man/man1 && man riprap-run";

const EXPORT_EXAMPLES: &str = "\
Examples:
  riprap export run.vtkhdf --csv tables             history, grains, contacts, breakage
  riprap export run.vtkhdf --vtu states --vtp contacts --stl grains";

const RUN_EXAMPLES: &str = "\
Examples:
  riprap run cases/quick_start.json
  riprap run cases/quick_start.json --set /seed=7 --out seed7.vtkhdf
  riprap run cases/quick_start.json --set '/stages/0/pressure=1.6 MPa' --set /stages/1/axial_strain=0.1 --force
  riprap run cases/quick_start.json --progress json | jq .deviatoric_stress

  riprap run cases/quick_start.json --resume           goes on where a run was interrupted or killed

Ctrl-C finishes the increment at hand, or gives it up after 2 s, and leaves a restart point (exit code 130); a second
one stops at once, and the file then ends with the last accepted increment. Either run is continued by --resume.";

const CHECK_EXAMPLES: &str = "\
Examples:
  riprap check cases/quick_start.json
  riprap check cases/quick_start.json --full        every value in force, defaults included";

const REPORT_EXAMPLES: &str = "\
Examples:
  riprap report run.vtkhdf --out report                 charts (SVG, PNG) and report/report.html
  riprap report p0400.vtkhdf p0800.vtkhdf --out report --lab measured.csv
  riprap report run.vtkhdf --width 84               charts for a column of a journal, letters of 9 points

The table of --lab has a header line that names its columns, each with its unit:
  curve, axial_strain [%], deviatoric_stress [MPa], volumetric_strain [%]
`curve` tells several curves apart; one of the last two columns is enough; compression counts positive.";

const STUDY_EXAMPLES: &str = "\
Examples:
  riprap study cases/quick_start.json --vary increment
  riprap study cases/quick_start.json --vary tolerance --values 1e-2,1e-3,1e-4 --out study
  riprap study cases/quick_start.json --vary stabilisation --values 1e-2,3e-3,1e-3,null
  riprap study cases/quick_start.json --vary seed --values 1,2,3,4,5 --jobs 2
  riprap study cases/scenes/push.json --vary increment --values 50,100,200

Every value has its own results file in --out. A study that was broken off goes on when it is started again.
Wall times are comparable only with --jobs 1 on a machine that is otherwise idle.";

const BATCH_EXAMPLES: &str = "\
Examples:
  riprap batch plan.json --jobs 4
  riprap batch plan.json --slurm                    writes a job array and submits it where there is sbatch
  riprap batch plan.json --commands                 writes commands.txt: parallel -j 4 < commands.txt
  riprap batch plan.json --summary                  the table of what has been run so far

A plan names a case (or a list \"cases\") and what to change in it:
  {\"case\": \"quick_start.json\",
   \"set\": {\"/stages/1/axial_strain\": 0.02},
   \"grid\": {\"/stages/0/pressure\": [\"0.4 MPa\", \"0.8 MPa\"], \"/contact/friction\": [0.5, 0.65]},
   \"seeds\": {\"from\": 1, \"count\": 5},
   \"out\": \"results/friction\", \"jobs\": 2, \"threads\": 1}
Every combination is run. What is finished is left as it is when the batch is started again.";

#[derive(Debug, Args)]
pub struct CaseInput {
    /// The case file (JSON; comments allowed)
    #[arg(value_name = "CASE")]
    pub case: PathBuf,
    /// Overrides a value of the case file; may be given more than once
    #[arg(long = "set", value_name = "/json/pointer=VALUE")]
    pub overrides: Vec<String>,
}

#[derive(Debug, Args)]
pub struct Target {
    /// Replaces the results file if it exists
    #[arg(long)]
    pub force: bool,
    /// Threads to use (default: all cores); results do not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Shows no progress; errors still show
    #[arg(long, conflicts_with = "progress")]
    pub quiet: bool,
    /// How to show progress (default: bar on a terminal, else plain)
    #[arg(long, value_enum, value_name = "HOW")]
    pub progress: Option<ProgressKind>,
}

#[derive(Debug, Args)]
pub struct Run {
    #[command(flatten)]
    pub input: CaseInput,
    /// The results file (default: results/<name of the case>.vtkhdf beside the case)
    #[arg(short, long, value_name = "FILE.vtkhdf")]
    pub out: Option<PathBuf>,
    /// How grains deform, in place of the case's /solver/fidelity
    #[arg(long, value_name = "LEVEL", value_parser = ["auto", "rigid", "condensed", "full"])]
    pub fidelity: Option<String>,
    /// Continues an interrupted, killed or stopped run from its last restart point, to the same bits; begins it
    /// where there is no results file, and does nothing where it is finished
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,
    /// Says at the end where time and memory went; a run from its start also keeps it in the file (/profile)
    #[arg(long)]
    pub profile: bool,
    /// Checks every accepted state once more for overlaps that no contact knows of and stops at the first; says of scenes
    /// whether another balance is near
    #[arg(long)]
    pub audit: bool,
    #[command(flatten)]
    pub target: Target,
}

#[derive(Debug, Args)]
pub struct Check {
    #[command(flatten)]
    pub input: CaseInput,
    /// Prints the case with every default filled in, in SI units
    #[arg(long)]
    pub full: bool,
}

#[derive(Debug, Args)]
pub struct Specimen {
    #[command(flatten)]
    pub input: CaseInput,
    /// The results file: grains, meshes and statistics, no increments
    #[arg(short, long, value_name = "FILE.vtkhdf")]
    pub out: PathBuf,
    #[command(flatten)]
    pub target: Target,
}

#[derive(Debug, Args)]
pub struct Info {
    /// The results file
    #[arg(value_name = "FILE.vtkhdf")]
    pub file: PathBuf,
    /// For machines
    #[arg(long)]
    pub json: bool,
    /// Read all of it and check its checksums
    #[arg(long)]
    pub verify: bool,
}

#[derive(Debug, Args)]
pub struct Export {
    /// The results file
    #[arg(value_name = "FILE.vtkhdf")]
    pub file: PathBuf,
    /// Writes the history, and what there is of bodies, grains, stages, contacts, gradings and breakage, as CSV, units in
    /// the header, into this directory
    #[arg(long, value_name = "DIR")]
    pub csv: Option<PathBuf>,
    /// Writes the saved states as .vtu files and a .pvd that lists them into this directory; points are moved
    #[arg(long, value_name = "DIR")]
    pub vtu: Option<PathBuf>,
    /// Writes the contacts of the saved states as lines between centres, .vtp files and a .pvd, into this directory
    #[arg(long, value_name = "DIR")]
    pub vtp: Option<PathBuf>,
    /// Writes grains or bodies of the last saved state as .stl files, all in one and each in its own, into this directory; in metres
    #[arg(long, value_name = "DIR")]
    pub stl: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct Study {
    #[command(flatten)]
    pub input: CaseInput,
    /// What to vary: increment, mesh, tolerance, stabilisation, fidelity, penalty or seed
    #[arg(long, value_name = "WHAT", value_parser = varied)]
    pub vary: Vary,
    /// The values it takes (default: some around the case's own)
    #[arg(long, value_name = "A,B,C", value_delimiter = ',')]
    pub values: Vec<String>,
    /// Folder of the results files, tables and charts (default: results/<case>_<what> beside the case)
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Runs at a time
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = number)]
    pub jobs: usize,
    /// Threads of each run
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = number)]
    pub threads: usize,
    /// Runs again what is finished, and replaces files of other cases
    #[arg(long)]
    pub force: bool,
}

fn varied(word: &str) -> Result<Vary, String> {
    let known = Vary::WORDS.into_iter().find(|(known, _)| *known == word).map(|(_, vary)| vary);
    let all = || Vary::WORDS.map(|(known, _)| known).join(", ");
    known.ok_or_else(|| format!("accepted: {}", all()))
}

fn number(text: &str) -> Result<usize, String> {
    text.parse()
        .ok()
        .filter(|n| (1..=1024).contains(n))
        .ok_or_else(|| "a whole number from 1 to 1024".to_string())
}

/// The first and the last of some members.
fn members(text: &str) -> Result<(usize, usize), String> {
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    match (first.parse(), last.parse()) {
        (Ok(first), Ok(last)) if first <= last => Ok((first, last)),
        _ => Err("a member's number, or two of them: 3, 10-19".to_string()),
    }
}

#[derive(Debug, Args)]
pub struct Batch {
    /// The plan (JSON; comments allowed)
    #[arg(value_name = "PLAN.json")]
    pub plan: PathBuf,
    /// Folder of the results files, in place of the plan's
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Runs at a time, in place of the plan's
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
    /// Threads of each run, in place of the plan's
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Runs again what is finished, and replaces files of other cases
    #[arg(long)]
    pub force: bool,
    /// Writes a Slurm job array instead, and submits it where there is sbatch; a job behind it writes the table
    #[arg(long)]
    pub slurm: bool,
    /// Writes commands instead, a line for each member or for the plan's members_per_task, for GNU parallel, PBS and LSF
    #[arg(long, conflicts_with = "slurm")]
    pub commands: bool,
    /// Writes the table of what there is instead, and runs nothing
    #[arg(long, conflicts_with_all = ["slurm", "commands", "force"])]
    pub summary: bool,
    /// Lists the members instead
    #[arg(long, conflicts_with_all = ["slurm", "commands", "summary"])]
    pub list: bool,
    /// Runs these members alone, counted from 0
    #[arg(long, value_name = "K|K-L", value_parser = members, conflicts_with_all = ["slurm", "commands", "summary"])]
    pub only: Option<(usize, usize)>,
}

#[derive(Debug, Args)]
pub struct Verify {
    /// Only the problems whose name holds this; may be given more than once
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// Lists the problems instead
    #[arg(long)]
    pub list: bool,
    /// Threads to use (default: all cores); results do not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

#[derive(Debug, Args)]
pub struct Report {
    /// Results files; several are overlaid
    #[arg(value_name = "FILE.vtkhdf", required = true)]
    pub files: Vec<PathBuf>,
    /// Where charts and report.html go (default: <name of the first file>_report beside it)
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Measured curves to overlay; may be given more than once
    #[arg(long = "lab", value_name = "CURVES.csv")]
    pub laboratory: Vec<PathBuf>,
    /// Width of the charts in files of their own, 60 to 400 millimetres: 84 or 174 for the columns of many journals; roses keep theirs
    #[arg(long, value_name = "MM", value_parser = clap::value_parser!(u16).range(60..=400))]
    pub width: Option<u16>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ProgressKind {
    /// One line per increment
    Plain,
    /// A bar with the remaining time
    Bar,
    /// One JSON object per line, on standard output
    Json,
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn help_says_what_every_argument_is() {
        for command in Arguments::command().get_subcommands() {
            for argument in command.get_arguments() {
                let help = argument.get_help().map(|help| help.to_string()).unwrap_or_default();
                assert!(!help.is_empty(), "{} {}", command.get_name(), argument.get_id());
            }
        }
    }
}
