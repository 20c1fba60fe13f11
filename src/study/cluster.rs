//! What a plan tells a cluster: its key `slurm`.

use serde::Deserialize;

use crate::case::{Form, Key};

/// What a cluster is told.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct Slurm {
    pub time: Option<String>,
    pub memory: Option<String>,
    pub partition: Option<String>,
    /// Further options of sbatch, as they are.
    pub options: Vec<String>,
    /// Members that a task runs one after the other; 0 is 1.
    pub members_per_task: usize,
    /// Lines of shell before riprap is started.
    pub setup: Vec<String>,
    /// The words of shell that start riprap there, in place of the path of this program.
    pub program: Option<String>,
}

/// Keys of a plan's `slurm`. A line break would end the comment that Slurm reads.
pub(super) static SLURM: &[Key] = &[
    Key::optional("time", Form::Line, "Limit of a task, as sbatch takes it."),
    Key::optional("memory", Form::Line, "Of a task, as sbatch takes it."),
    Key::optional("partition", Form::Line, "Of the cluster, as sbatch takes it."),
    Key::default("options", Form::List(&Form::Line, 0), "[]", "Further options of sbatch, as they are."),
    Key::default(
        "members_per_task",
        Form::Count(1, 100_000),
        "1",
        "Members that a task runs one after the other.",
    ),
    Key::default("setup", Form::List(&Form::Line, 0), "[]", "Lines of shell before riprap is started."),
    Key::optional(
        "program",
        Form::Line,
        "The words of shell that start riprap there; default: the path of this program.",
    ),
];
