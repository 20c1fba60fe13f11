//! What a plan tells a cluster: its key `slurm`.

use serde_json::Value;

use crate::case::{path_of_key, shown};
use crate::error::{Fault, Faults};

/// Members of a task; more are taken for a slip.
const MOST: usize = 100_000;

pub const SLURM_KEYS: [&str; 7] =
    ["time", "memory", "partition", "options", "members_per_task", "setup", "program"];

/// What a cluster is told.
#[derive(Debug, Clone, PartialEq)]
pub struct Slurm {
    pub time: Option<String>,
    pub memory: Option<String>,
    pub partition: Option<String>,
    /// Further options of sbatch, as they are.
    pub options: Vec<String>,
    /// Members that a task runs one after the other.
    pub members_per_task: usize,
    /// Lines of shell before riprap is started.
    pub setup: Vec<String>,
    /// The words of shell that start riprap there, in place of the path of this program.
    pub program: Option<String>,
}

impl Default for Slurm {
    fn default() -> Self {
        let (time, memory, partition, program) = (None, None, None, None);
        Slurm { time, memory, partition, options: vec![], members_per_task: 1, setup: vec![], program }
    }
}

/// Reads a plan's `slurm`.
pub fn slurm_of(value: Option<&Value>, faults: &mut Vec<Fault>) -> Slurm {
    let map = match value {
        None => return Slurm::default(),
        Some(Value::Object(map)) => map,
        Some(other) => {
            let accepted = format!("an object with the keys {}", SLURM_KEYS.join(", "));
            faults.fault("$.slurm", shown(other), "is no object", accepted);
            return Slurm::default();
        }
    };
    // A line break would end the comment that Slurm reads.
    let line = |value: &Value, place: String, faults: &mut Vec<Fault>| match value {
        Value::String(text) if !text.contains(['\n', '\r']) && !text.is_empty() => Some(text.clone()),
        other => {
            faults.fault(place, shown(other), "is no line of text", "a text in quotes");
            None
        }
    };
    let mut text =
        |key: &str| map.get(key).and_then(|value| line(value, path_of_key("$.slurm", key), faults));
    let [time, memory, partition, program] = ["time", "memory", "partition", "program"].map(&mut text);
    let mut lines = |key: &str| match map.get(key) {
        None => Vec::new(),
        Some(Value::Array(items)) => {
            let item = |(at, item)| line(item, format!("$.slurm.{key}[{at}]"), faults);
            items.iter().enumerate().filter_map(item).collect()
        }
        Some(other) => {
            let place = path_of_key("$.slurm", key);
            faults.fault(place, shown(other), "is no list", "a list of texts");
            Vec::new()
        }
    };
    let [options, setup] = ["options", "setup"].map(&mut lines);
    let members_per_task = match map.get("members_per_task").map(|value| (value, value.as_u64())) {
        None => 1,
        Some((_, Some(count))) if (1..=MOST as u64).contains(&count) => count as usize,
        Some((value, _)) => {
            let accepted = format!("a whole number from 1 to {MOST}");
            faults.fault("$.slurm.members_per_task", shown(value), "is out of range", accepted);
            1
        }
    };
    Slurm { time, memory, partition, options, members_per_task, setup, program }
}
