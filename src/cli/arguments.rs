//! The arguments of the `riprap` command, and the help that teaches them.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

const EXAMPLES: &str = "\
Examples:
  riprap run cases/quick_start.json                 the whole test, into cases/results/quick_start.h5
  riprap check cases/quick_start.json               what is wrong with a case, or what it would build
  riprap run my.json --set '/stages/0/pressure=0.4 MPa' --out p0400.h5
  riprap info cases/results/quick_start.h5          what is in a results file
  riprap schema > riprap.schema.json                for editors that complete and check JSON

Exit codes: 0 done, 1 a check failed, 2 bad usage or input, 3 stopped short of the case's end,
4 file trouble, 130 interrupted.";

#[derive(Debug, Parser)]
#[command(name = "riprap", version, about, after_help = EXAMPLES, max_term_width = 110)]
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
    /// Export a results file
    Export(Export),
    /// Print the JSON Schema of case files
    Schema,
}

const RUN_EXAMPLES: &str = "\
Examples:
  riprap run cases/quick_start.json
  riprap run cases/quick_start.json --set /seed=7 --out seed7.h5
  riprap run cases/quick_start.json --set '/stages/0/pressure=1.6 MPa' --set /stages/1/axial_strain=0.1 --force
  riprap run cases/quick_start.json --progress json | jq .deviatoric_stress

Ctrl-C finishes the increment at hand and leaves a whole file (exit code 130); a second one stops at once,
and the file then ends with the last accepted increment.";

const CHECK_EXAMPLES: &str = "\
Examples:
  riprap check cases/quick_start.json
  riprap check cases/quick_start.json --full        every value in force, defaults included";

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
    /// The results file (default: results/<name of the case>.h5 beside the case)
    #[arg(long, value_name = "FILE.h5")]
    pub out: Option<PathBuf>,
    /// How grains deform, in place of the case's /solver/fidelity
    #[arg(long, value_name = "LEVEL", value_parser = ["auto", "rigid", "condensed", "full"])]
    pub fidelity: Option<String>,
    /// Continues an interrupted run (not built yet)
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,
    /// Says at the end where time and memory went, and keeps it in the file (/profile)
    #[arg(long)]
    pub profile: bool,
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
    #[arg(long, value_name = "FILE.h5")]
    pub out: PathBuf,
    #[command(flatten)]
    pub target: Target,
}

#[derive(Debug, Args)]
pub struct Info {
    /// The results file
    #[arg(value_name = "FILE.h5")]
    pub file: PathBuf,
    /// For machines
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Export {
    /// The results file
    #[arg(value_name = "FILE.h5")]
    pub file: PathBuf,
    /// Writes the history as CSV, units in the header, into this directory
    #[arg(long, value_name = "DIR", required_unless_present = "vtu")]
    pub csv: Option<PathBuf>,
    /// Writes the fields as a .vtu series into this directory (not built yet)
    #[arg(long, value_name = "DIR")]
    pub vtu: Option<PathBuf>,
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
