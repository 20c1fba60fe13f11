//! Runs that are killed, interrupted or damaged, and go on: a results file opens whatever happened, a continued run
//! comes to the same bits as one that nothing happened to, and trouble with files ends in exit code 4.
//!
//! The specimen has sixteen grains and is generated twice; bits are compared, never numbers with a tolerance.

#![cfg(unix)]

mod damage;
mod hostile;
#[cfg(target_os = "linux")]
mod injected;
mod kills;
mod mutated;
mod place;
mod start;
mod trouble;
