//! What a problem finds, and one line of the table: a quantity, what it should be and what came out.

use std::fmt;
use std::time::{Duration, Instant};

use crate::verification::Run;

/// By how much a computed quantity may miss its reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tolerance {
    /// Over the size of the reference.
    Relative(f64),
    /// In the unit of the quantity.
    Absolute(f64),
    /// In the unit of the quantity; more than the reference is no error.
    Short(f64),
}

/// A quantity of a problem against its reference.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Name of the problem.
    pub problem: &'static str,
    pub quantity: String,
    pub reference: f64,
    pub computed: f64,
    /// Computed less reference, over the reference where the tolerance is relative; 0 above a reference that is a least.
    pub error: f64,
    pub tolerance: f64,
    pub factorisations: usize,
    pub time: Duration,
    /// How a run ended that should not have ended so; empty else.
    pub note: String,
}

impl Finding {
    /// Not a number is a miss.
    pub fn passed(&self) -> bool {
        self.error.abs() <= self.tolerance
    }

    pub fn verdict(&self) -> &'static str {
        if self.passed() { "pass" } else { "FAIL" }
    }

    /// What stands where in the two lines that [`fmt::Display`] writes; a terminal of 80 columns has room for them.
    pub fn header() -> String {
        format!(
            "      {:<19} quantity\n      {:>13} {:>13} {:>9} {:>9} {:>7} {:>8}",
            "problem", "reference", "computed", "error", "tolerance", "factor.", "time"
        )
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{:<5} {:<19} {}", self.verdict(), self.problem, self.quantity)?;
        write!(
            f,
            "      {:>13} {:>13} {:>9.1e} {:>9.1e} {:>7} {:>6.2} s",
            number(self.reference),
            number(self.computed),
            self.error,
            self.tolerance,
            self.factorisations,
            self.time.as_secs_f64()
        )?;
        if !self.note.is_empty() {
            write!(f, "\n      {}", self.note)?;
        }
        Ok(())
    }
}

/// Six digits, with an exponent where they need one.
fn number(x: f64) -> String {
    if x == 0.0 || (1e-3..1e6).contains(&x.abs()) { format!("{x:.6}") } else { format!("{x:.6e}") }
}

/// What a quantity took: factorisations and time, and what is to be noted; without a note from those two or the time alone.
#[derive(Debug, Clone, Default)]
pub struct Cost {
    factorisations: usize,
    time: Duration,
    note: String,
}

impl From<(usize, Duration, String)> for Cost {
    fn from((factorisations, time, note): (usize, Duration, String)) -> Self {
        Cost { factorisations, time, note }
    }
}

impl From<(usize, Duration)> for Cost {
    fn from((factorisations, time): (usize, Duration)) -> Self {
        Cost { factorisations, time, note: String::new() }
    }
}

impl From<Duration> for Cost {
    fn from(time: Duration) -> Self {
        (0, time).into()
    }
}

impl Run {
    /// What the run took, with a note.
    pub fn cost(&self, note: String) -> Cost {
        (self.factorisations(), self.time, note).into()
    }
}

/// What a problem has found so far.
#[derive(Debug)]
pub struct Findings {
    problem: &'static str,
    list: Vec<Finding>,
}

impl Findings {
    /// Nothing yet of the problem of this name.
    pub fn of(problem: &'static str) -> Self {
        Findings { problem, list: Vec::new() }
    }

    pub fn into_list(self) -> Vec<Finding> {
        self.list
    }

    /// A quantity that took so much.
    pub fn compare(
        &mut self,
        quantity: impl Into<String>,
        computed: f64,
        reference: f64,
        tolerance: Tolerance,
        cost: impl Into<Cost>,
    ) {
        let Cost { factorisations, time, note } = cost.into();
        let (error, tolerance) = match tolerance {
            Tolerance::Relative(share) => ((computed - reference) / reference.abs(), share),
            Tolerance::Absolute(amount) => (computed - reference, amount),
            Tolerance::Short(amount) => {
                (if computed > reference { 0.0 } else { computed - reference }, amount)
            }
        };
        let (problem, quantity) = (self.problem, quantity.into());
        let finding =
            Finding { problem, quantity, reference, computed, error, tolerance, factorisations, time, note };
        self.list.push(finding);
    }

    /// A quantity of a run that should have finished: a miss where it did not.
    pub fn of_run(
        &mut self,
        quantity: impl Into<String>,
        run: &Run,
        computed: f64,
        reference: f64,
        tolerance: Tolerance,
    ) {
        let computed = if run.finished() { computed } else { f64::NAN };
        self.compare(quantity, computed, reference, tolerance, run.cost(run.trouble()));
    }

    /// Whether something stands (1) or falls (0). An audit's fault is a miss either way.
    pub fn stands(&mut self, what: impl Into<String>, run: &Run, stands: bool, expected: bool) {
        let computed = if run.fault.is_some() { f64::NAN } else { f64::from(stands) };
        let note = if stands == expected { String::new() } else { run.trouble() };
        let what = format!("{}: {}", what.into(), if expected { "stands" } else { "falls" });
        let tolerance = Tolerance::Absolute(0.0);
        self.compare(what, computed, f64::from(expected), tolerance, run.cost(note));
    }
}

/// The larger of an error and those before it; not a number where one of them is not.
pub fn worse(before: f64, error: f64) -> f64 {
    if error <= before || before.is_nan() { before } else { error }
}

/// Runs `work` and says how long it took.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let start = Instant::now();
    let done = work();
    (done, start.elapsed())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finding(error: f64) -> Finding {
        Finding {
            problem: "x",
            quantity: "force".into(),
            reference: 1.0,
            computed: 1.0 + error,
            error,
            tolerance: 1e-3,
            factorisations: 3,
            time: Duration::from_millis(20),
            note: String::new(),
        }
    }

    #[test]
    fn misses_and_nonsense_fail() {
        assert!(finding(1e-3).passed() && finding(-1e-3).passed());
        for error in [1.1e-3, -1.1e-3, f64::NAN, f64::INFINITY] {
            assert!(!finding(error).passed(), "{error}");
            assert!(finding(error).to_string().contains("FAIL"));
        }
    }

    #[test]
    fn a_finding_fits_a_terminal() {
        let widest = Finding {
            problem: "face_centred_cubic",
            quantity: "x".repeat(48),
            reference: -1.234_567e-12,
            computed: -f64::MAX,
            factorisations: 1_000_000,
            time: Duration::from_secs(99_999),
            ..finding(f64::MAX)
        };
        for text in [Finding::header(), widest.to_string()] {
            assert_eq!(text.lines().count(), 2);
            assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
        }
        // Numbers stand below their names.
        let ends = |text: &str, word: &str| text.find(word).map(|at| at + word.len());
        let shown = finding(0.5).to_string();
        let below = |text: &str| text.lines().nth(1).unwrap_or_default().to_string();
        assert_eq!(ends(&below(&Finding::header()), "computed"), ends(&below(&shown), "1.500000"));
    }

    #[test]
    fn only_what_falls_short_misses_a_least() {
        let mut findings = Findings::of("x");
        for computed in [3.4, 2.9, 2.8, f64::NAN] {
            findings.compare("order", computed, 3.0, Tolerance::Short(0.15), Duration::ZERO);
        }
        let list = findings.into_list();
        assert!(list[0].computed == 3.4 && list[0].error == 0.0);
        let passed: Vec<bool> = list.iter().map(Finding::passed).collect();
        assert_eq!(passed, [true, true, false, false]);
    }

    #[test]
    fn nonsense_is_not_forgotten() {
        for errors in [[f64::NAN, 1.0, 2.0], [1.0, f64::NAN, 2.0], [1.0, 2.0, f64::NAN]] {
            assert!(errors.into_iter().fold(0.0, worse).is_nan(), "{errors:?}");
        }
        assert_eq!([1.0, 3.0, 2.0].into_iter().fold(0.0, worse), 3.0);
    }
}
