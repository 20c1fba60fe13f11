//! Restart points: everything that later increments depend on, as bytes, and when the file gets one.
//!
//! The bytes are postcard's: a header with riprap's version and commit, then the state. Which increments
//! have a restart point in the file changes nothing but where a killed run goes on, so it may depend on time.

use std::path::Path;
use std::time::{Duration, Instant};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::results::{COMMIT, VERSION, Writer};

/// Rises whenever the bytes come to mean something else.
const FORMAT: u32 = 26;
/// A restart point is due after so long, however few increments there were.
const LONGEST: Duration = Duration::from_secs(30);
/// Time between two restart points over the time that writing one takes, at least.
const COST_FACTOR: u32 = 50;

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Header {
    format: u32,
    version: String,
    commit: String,
}

impl Header {
    fn own() -> Self {
        Header { format: FORMAT, version: VERSION.into(), commit: COMMIT.into() }
    }
}

/// Writes a state over `bytes`.
pub fn encode_into(bytes: &mut Vec<u8>, state: &impl Serialize, file: &Path) -> Result<()> {
    let mut kept = std::mem::take(bytes);
    kept.clear();
    let written = postcard::to_extend(&Header::own(), kept).and_then(|head| postcard::to_extend(state, head));
    *bytes = written.map_err(|e| fault(file, format!("cannot be put into bytes: {e}")))?;
    Ok(())
}

/// The state in `bytes` of `file`, and the version and commit that wrote it where they are not ours.
///
/// # Errors
/// `Error::Results` where the bytes are of another format or no such state.
pub fn decode<T: DeserializeOwned>(bytes: &[u8], file: &Path) -> Result<(T, Option<String>)> {
    let own = Header::own();
    let (header, rest) = postcard::take_from_bytes::<Header>(bytes)
        .map_err(|e| fault(file, format!("is no restart point of riprap: {e}")))?;
    let other = format!("riprap {} ({})", header.version, header.commit);
    let foreign = |why: String| {
        let message = format!(
            "was written by {other} and cannot be read by riprap {VERSION} ({COMMIT}): {why}; \
             continue with that version, or --force runs the case again from its start"
        );
        fault(file, message)
    };
    if header.format != FORMAT {
        return Err(foreign(format!("its format is {}, not {FORMAT}", header.format)));
    }
    match postcard::take_from_bytes::<T>(rest) {
        Ok((state, [])) => Ok((state, (header != own).then_some(other))),
        Ok((_, left)) => Err(foreign(format!("{} bytes are left over", left.len()))),
        Err(e) => Err(foreign(e.to_string())),
    }
}

pub fn fault(file: &Path, message: impl Into<String>) -> Error {
    Error::Results { file: file.to_path_buf(), dataset: "restart".into(), message: message.into() }
}

/// Holds the state after the last accepted increment and writes it when it is due.
#[derive(Debug)]
pub struct RestartKeeper {
    /// Increments between two restart points in the file.
    every: usize,
    latest: Vec<u8>,
    increment: u64,
    /// Whether the file lacks `latest`.
    unwritten: bool,
    /// Increments since the last one written.
    since: usize,
    written: Instant,
    cost: Duration,
}

impl RestartKeeper {
    pub fn new(every: usize) -> Self {
        RestartKeeper {
            every,
            latest: Vec::new(),
            increment: 0,
            unwritten: false,
            since: 0,
            written: Instant::now(),
            cost: Duration::ZERO,
        }
    }

    /// Takes the state after an accepted increment.
    pub fn hold(&mut self, increment: u64, state: &impl Serialize, file: &Path) -> Result<()> {
        encode_into(&mut self.latest, state, file)?;
        self.increment = increment;
        self.unwritten = true;
        self.since += 1;
        Ok(())
    }

    pub fn is_due(&self) -> bool {
        let elapsed = self.written.elapsed();
        (self.since >= self.every || elapsed >= LONGEST) && elapsed >= COST_FACTOR * self.cost
    }

    /// Writes and commits what is held, unless the file has it. Before rows or states that are to be
    /// forgotten in a continued run, since a restart point keeps what is in the file when it is written.
    pub fn write(&mut self, writer: &mut Writer) -> Result<()> {
        if !self.unwritten {
            return Ok(());
        }
        let begun = Instant::now();
        writer.save_restart(self.increment, &self.latest)?;
        writer.commit()?;
        self.cost = begun.elapsed();
        self.written = Instant::now();
        self.unwritten = false;
        self.since = 0;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_of_another_format_or_length_are_refused() {
        let file = Path::new("x.h5");
        let mut bytes = Vec::new();
        encode_into(&mut bytes, &(7_u64, 0.1_f64), file).expect("bytes");
        let (state, other) = decode::<(u64, f64)>(&bytes, file).expect("the state");
        assert_eq!((state, other), ((7, 0.1), None));
        for wrong in [&bytes[..bytes.len() - 1], &[&bytes[..], &[0]].concat(), &[], &[200; 40]] {
            assert!(decode::<(u64, f64)>(wrong, file).is_err());
        }
        bytes[0] = 99;
        let message = decode::<(u64, f64)>(&bytes, file).expect_err("another format").to_string();
        assert!(message.contains("format is 99"), "{message}");
    }

    #[test]
    fn a_restart_point_is_due_by_count_unless_it_costs_too_much() {
        let mut keeper = RestartKeeper::new(2);
        for expected in [false, true] {
            keeper.hold(1, &1_u8, Path::new("x.h5")).expect("bytes");
            assert_eq!(keeper.is_due(), expected);
        }
        keeper.cost = Duration::from_secs(3600);
        assert!(!keeper.is_due());
    }
}
