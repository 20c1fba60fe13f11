//! What the members of a series came to, read from their results files.

use crate::error::Result;
use crate::report::Run;

use super::Member;
use super::launch::{last_line, log_of};

/// A member that has a results file, and the figures to compare it by.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figures {
    /// `finished`, `stopped`, `interrupted`, `running`, `killed`; `failed` or `not run` without a file.
    pub status: String,
    pub reason: String,
    pub increments: usize,
    pub factorisations: f64,
    pub cuts: f64,
    /// [s]
    pub wall_time: f64,
    /// Axial strain, deviatoric stress [Pa] and volumetric strain behind the consolidation; empty for scenes.
    pub strain: Vec<f64>,
    pub deviatoric_stress: Vec<f64>,
    pub volumetric_strain: Vec<f64>,
    /// Last external work and friction energy [J].
    pub external_work: f64,
    pub friction_energy: f64,
    /// Scenes: how far each body has moved [m].
    pub bodies: Vec<(String, f64)>,
}

/// A figure of every member; NaN for those that have none.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// With its unit.
    pub name: String,
    pub values: Vec<f64>,
}

impl Figures {
    /// # Errors
    /// A results file that is there and cannot be read.
    pub fn of(member: &Member) -> Result<Figures> {
        if !member.results.exists() {
            let log = log_of(member);
            let status = if log.exists() { "failed" } else { "not run" };
            return Ok(Figures { status: status.into(), reason: last_line(&log), ..Figures::nothing() });
        }
        let run = Run::open(&member.results)?;
        let sum = |name: &str| -> Result<f64> { Ok(run.column(name)?.iter().sum()) };
        let last = |name: &str| -> Result<f64> { Ok(run.column(name)?.last().copied().unwrap_or(f64::NAN)) };
        let mut figures = Figures {
            status: run.summary.status.clone(),
            reason: run.summary.reason.clone(),
            increments: run.rows,
            factorisations: sum("factorisations")?,
            cuts: sum("cuts")?,
            wall_time: last("wall_time")?,
            external_work: last("energy_external")?,
            friction_energy: last("energy_friction")?,
            ..Figures::default()
        };
        if run.is_scene() {
            for body in &run.summary.bodies {
                let moved = run.reader.floats(&format!("bodies/{body}/displacement"))?;
                let moved = run.rows.checked_sub(1).and_then(|row| moved.chunks_exact(3).nth(row));
                let far = moved.map_or(f64::NAN, |u| u.iter().map(|x| x * x).sum::<f64>().sqrt());
                figures.bodies.push((body.clone(), far));
            }
        } else {
            let curve = run.shearing()?.from_start();
            figures.strain = curve.axial_strain;
            figures.deviatoric_stress = curve.deviatoric_stress;
            figures.volumetric_strain = curve.volumetric_strain;
        }
        Ok(figures)
    }

    fn nothing() -> Figures {
        let nan = f64::NAN;
        Figures { wall_time: nan, external_work: nan, friction_energy: nan, ..Figures::default() }
    }

    /// Whether it ran to the end of its case.
    pub fn is_finished(&self) -> bool {
        self.status == "finished"
    }

    pub fn last_strain(&self) -> f64 {
        self.strain.last().copied().unwrap_or(f64::NAN)
    }

    /// Largest deviatoric stress up to `strain`, the one there by interpolation included, and the strain where it is met.
    pub fn peak(&self, strain: f64) -> Option<(f64, f64)> {
        let upto = self.strain.iter().copied().zip(self.deviatoric_stress.iter().copied());
        let end = (strain, at_strain(&self.strain, &self.deviatoric_stress, strain));
        upto.filter(|(e, _)| *e <= strain * (1.0 + 1e-9))
            .chain([end])
            .filter(|(_, q)| q.is_finite())
            .map(|(e, q)| (q, e))
            .max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Mean deviatoric stress over the strain up to `strain`: the work of shearing over the strain [Pa]; NaN where it did not get there.
    pub fn mean_stress_to(&self, strain: f64) -> f64 {
        if self.strain.last().is_none_or(|last| *last < strain * (1.0 - 1e-9)) {
            return f64::NAN;
        }
        let mut work = 0.0;
        for (pair, q) in self.strain.windows(2).zip(self.deviatoric_stress.windows(2)) {
            let (from, to) = (pair[0], pair[1].min(strain));
            if to > from {
                let end = q[0] + (q[1] - q[0]) * (to - from) / (pair[1] - pair[0]);
                work += 0.5 * (q[0] + end) * (to - from);
            }
        }
        work / strain
    }
}

/// A column at a strain, linear between rows; NaN outside.
pub fn at_strain(strain: &[f64], values: &[f64], wanted: f64) -> f64 {
    let reach = wanted.abs() * 1e-9;
    for (pair, value) in strain.windows(2).zip(values.windows(2)) {
        if pair[0] <= wanted + reach && wanted <= pair[1] + reach && pair[1] > pair[0] {
            let share = ((wanted - pair[0]) / (pair[1] - pair[0])).clamp(0.0, 1.0);
            return value[0] + share * (value[1] - value[0]);
        }
    }
    f64::NAN
}

/// The strain that all members with strains have reached; NaN where none has any.
pub fn common_strain(all: &[Figures]) -> f64 {
    all.iter().map(Figures::last_strain).filter(|strain| *strain > 0.0).fold(f64::NAN, f64::min)
}

/// What is compared across the members.
pub fn compared(all: &[Figures]) -> Vec<Figure> {
    let mut figures = Vec::new();
    let mut add = |name: String, of: &dyn Fn(&Figures) -> f64| {
        figures.push(Figure { name, values: all.iter().map(of).collect() });
    };
    let strain = common_strain(all);
    if strain > 0.0 {
        let at = format!("at {:.4} % strain", 100.0 * strain);
        add(format!("mean q to {:.4} % strain [MPa]", 100.0 * strain), &|f| 1e-6 * f.mean_stress_to(strain));
        add(format!("q {at} [MPa]"), &|f| 1e-6 * at_strain(&f.strain, &f.deviatoric_stress, strain));
        add(format!("volume strain {at} [%]"), &|f| {
            100.0 * at_strain(&f.strain, &f.volumetric_strain, strain)
        });
        add("peak q up to there [MPa]".into(), &|f| f.peak(strain).map_or(f64::NAN, |(q, _)| 1e-6 * q));
        add("strain at that peak [%]".into(), &|f| f.peak(strain).map_or(f64::NAN, |(_, e)| 100.0 * e));
        return figures;
    }
    // Of a scene only what reached its end can be compared.
    let ended = |f: &Figures, value: f64| if f.is_finished() { value } else { f64::NAN };
    add("external work [J]".into(), &|f| ended(f, f.external_work));
    add("friction energy [J]".into(), &|f| ended(f, f.friction_energy));
    let names: Vec<String> = all.iter().find(|f| !f.bodies.is_empty()).map_or_else(Vec::new, |f| {
        let moving = f.bodies.iter().filter(|(_, far)| *far > 0.0);
        moving.map(|(name, _)| name.clone()).collect()
    });
    for name in names {
        add(format!("{name} moved [mm]"), &|f| {
            let far =
                f.bodies.iter().find(|(known, _)| *known == name).map_or(f64::NAN, |(_, far)| 1e3 * far);
            ended(f, far)
        });
    }
    figures
}

/// How far a member's curve q(strain) is from another's: root mean square of the difference up to `strain` over that of
/// the other.
pub fn curve_difference(one: &Figures, reference: &Figures, strain: f64) -> f64 {
    const POINTS: usize = 400;
    let (mut difference, mut size) = (0.0, 0.0);
    for k in 0..=POINTS {
        let at = strain * k as f64 / POINTS as f64;
        let [a, b] = [one, reference].map(|f| at_strain(&f.strain, &f.deviatoric_stress, at));
        difference += (a - b) * (a - b);
        size += b * b;
    }
    (difference / size).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figures(strain: &[f64], q: &[f64]) -> Figures {
        Figures {
            status: "finished".into(),
            strain: strain.to_vec(),
            deviatoric_stress: q.to_vec(),
            volumetric_strain: vec![0.0; q.len()],
            ..Figures::default()
        }
    }

    #[test]
    fn runs_are_compared_over_the_strain_they_share() {
        let short = figures(&[0.0, 0.01], &[0.0, 2e6]);
        let long = figures(&[0.0, 0.02, 0.03], &[0.0, 4e6, 9e6]);
        let all = [short.clone(), long.clone()];
        assert_eq!(common_strain(&all), 0.01);
        let compared = compared(&all);
        // Both lie on one line up to there.
        assert!(compared[0].values.iter().all(|q| (q - 1.0).abs() < 1e-12), "{compared:?}");
        assert!(compared[1].values.iter().all(|q| (q - 2.0).abs() < 1e-12), "{compared:?}");
        assert!(curve_difference(&short, &long, 0.01) < 1e-12);
        let doubled = figures(&[0.0, 0.02], &[0.0, 8e6]);
        assert!((curve_difference(&doubled, &long, 0.01) - 1.0).abs() < 1e-12);
    }

    /// Rows need not lie at the strain that all have reached, and a member may have none.
    #[test]
    fn the_end_counts_for_the_peak_and_nothing_is_not_zero() {
        let rising = figures(&[0.0, 0.01, 0.02], &[0.0, 2e6, 4e6]);
        assert_eq!(rising.peak(0.015), Some((3e6, 0.015)));
        let none = figures(&[], &[]);
        assert!(none.mean_stress_to(0.015).is_nan() && none.peak(0.015).is_none());
        assert!(rising.mean_stress_to(0.021).is_nan());
    }

    #[test]
    fn the_mean_is_the_area_over_the_strain() {
        let f = figures(&[0.0, 0.01, 0.02], &[0.0, 4e6, 4e6]);
        assert!((f.mean_stress_to(0.02) - 3e6).abs() < 1e-6);
        assert!((f.mean_stress_to(0.015) - (0.5 * 4e6 * 0.01 + 4e6 * 0.005) / 0.015).abs() < 1e-6);
        assert_eq!(f.peak(0.005), Some((2e6, 0.005)));
    }
}
