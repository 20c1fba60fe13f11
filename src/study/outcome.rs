//! What the members of a series came to, read from their results files.

use crate::error::{Error, Result};
use crate::report::Run;

use super::Member;
use super::launch::{last_line, log_of};

/// Status of a member that has neither results nor a log.
const NOT_RUN: &str = "not run";

/// A member that has a results file, and the figures to compare it by.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figures {
    /// `finished`, `stopped`, `interrupted`, `running`, `killed`; `failed` or `not run` without a file; `unreadable`.
    pub status: String,
    pub reason: String,
    pub increments: usize,
    pub factorisations: f64,
    pub cuts: f64,
    /// Since the start of the run [s].
    pub wall_time: f64,
    /// Of the increments alone [s]; not a number in files of versions that did not write it.
    pub solving_time: f64,
    /// Axial strain, deviatoric stress [Pa] and volumetric strain behind the consolidation; empty for scenes.
    pub strain: Vec<f64>,
    pub deviatoric_stress: Vec<f64>,
    pub volumetric_strain: Vec<f64>,
    /// Last external work and friction energy [J].
    pub external_work: f64,
    pub friction_energy: f64,
    /// Cells of a grain as built, mean over the specimen's grains; NaN for scenes.
    pub cells_of_a_grain: f64,
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
    /// Of a member; one whose file cannot be read has the reason and no figures.
    pub fn of(member: &Member) -> Figures {
        if !member.results.exists() {
            let log = log_of(member);
            let status = if log.exists() { "failed" } else { NOT_RUN };
            return Figures { status: status.into(), reason: last_line(&log), ..Figures::nothing() };
        }
        let unreadable = |error: Error| Figures {
            status: "unreadable".into(),
            reason: error.to_string(),
            ..Figures::nothing()
        };
        Figures::read(member).unwrap_or_else(unreadable)
    }

    fn read(member: &Member) -> Result<Figures> {
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
            solving_time: last("solving_time")?,
            external_work: last("energy_external")?,
            friction_energy: last("energy_friction")?,
            cells_of_a_grain: cells_of_a_grain(&run)?,
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
            let curve = run.shearing()?.into_curve();
            figures.strain = curve.axial_strain;
            figures.deviatoric_stress = curve.deviatoric_stress;
            figures.volumetric_strain = curve.volumetric_strain;
        }
        Ok(figures)
    }

    fn nothing() -> Figures {
        let nan = f64::NAN;
        Figures {
            wall_time: nan,
            solving_time: nan,
            external_work: nan,
            friction_energy: nan,
            cells_of_a_grain: nan,
            ..Figures::default()
        }
    }

    /// Whether it has run at all.
    pub fn has_begun(&self) -> bool {
        self.status != NOT_RUN
    }

    /// Whether it ran to the end of its case.
    pub fn is_finished(&self) -> bool {
        self.status == "finished"
    }

    /// Strain of the last row; of a run that ends by unloading not the largest.
    pub fn last_strain(&self) -> f64 {
        self.strain.last().copied().unwrap_or(f64::NAN)
    }

    /// Largest strain reached; NaN without rows.
    pub fn largest_strain(&self) -> f64 {
        self.strain.iter().copied().fold(f64::NAN, f64::max)
    }

    /// Strain and deviatoric stress [Pa] along the way up to where `strain` is first reached, the point there by interpolation;
    /// `None` where it never is. What was unloaded and loaded again on the way is in it; what came behind is not, even where
    /// it went back below `strain`, so that members that go on otherwise are compared over the same way.
    fn way_to(&self, strain: f64) -> Option<Vec<[f64; 2]>> {
        let (at, share) = arrival(&self.strain, strain)?;
        let row = |k: usize| [self.strain[k], self.deviatoric_stress[k]];
        let mut way: Vec<[f64; 2]> = (0..=at).map(row).collect();
        let ([_, from], [_, to]) = (row(at), row(at + 1));
        way.push([strain, from + share * (to - from)]);
        Some(way)
    }

    /// Largest deviatoric stress [Pa] of all rows and the strain where it is met.
    pub fn peak(&self) -> Option<(f64, f64)> {
        let rows = self.strain.iter().zip(&self.deviatoric_stress);
        highest(rows.map(|(e, q)| [*e, *q]))
    }

    /// Largest deviatoric stress [Pa] on the way to where `strain` is first reached, the one there by interpolation included, and
    /// the strain where it is met.
    pub fn peak_to(&self, strain: f64) -> Option<(f64, f64)> {
        highest(self.way_to(strain)?.into_iter())
    }

    /// Mean deviatoric stress up to `strain`: the work of shearing, the integral of q over the strain with its sign, along the way
    /// to where `strain` is first reached, over that strain [Pa]; NaN where it did not get there. On a way that never turns that is the
    /// mean of the curve; a loop of unloading and reloading adds what it encloses and no more.
    pub fn mean_stress_to(&self, strain: f64) -> f64 {
        let Some(way) = self.way_to(strain) else { return f64::NAN };
        let work: f64 =
            way.windows(2).map(|pair| 0.5 * (pair[0][1] + pair[1][1]) * (pair[1][0] - pair[0][0])).sum();
        work / strain
    }
}

fn cells_of_a_grain(run: &Run) -> Result<f64> {
    if !run.reader.has("grains/cells") {
        return Ok(f64::NAN);
    }
    let cells = run.reader.integers("grains/cells")?;
    // None is no number.
    Ok(cells.iter().sum::<i64>() as f64 / cells.len() as f64)
}

/// Largest deviatoric stress of points of strain and stress, and the strain there.
fn highest(points: impl Iterator<Item = [f64; 2]>) -> Option<(f64, f64)> {
    let finite = points.filter(|[_, q]| q.is_finite());
    finite.map(|[e, q]| (q, e)).max_by(|a, b| a.0.total_cmp(&b.0))
}

/// The row behind which strains first rise to `wanted`, and the share of the way to the next row; `None` outside.
fn arrival(strain: &[f64], wanted: f64) -> Option<(usize, f64)> {
    let reach = wanted.abs() * 1e-9;
    let arrives = |pair: &[f64]| pair[0] <= wanted + reach && wanted <= pair[1] + reach && pair[1] > pair[0];
    let at = strain.windows(2).position(arrives)?;
    let share = (wanted - strain[at]) / (strain[at + 1] - strain[at]);
    Some((at, share.clamp(0.0, 1.0)))
}

/// A column where a strain is first reached, linear between rows; NaN outside.
pub fn at_strain(strain: &[f64], values: &[f64], wanted: f64) -> f64 {
    arrival(strain, wanted).map_or(f64::NAN, |(at, share)| values[at] + share * (values[at + 1] - values[at]))
}

/// The strain that all members with strains have reached, also those that end by unloading; NaN where none has any.
pub fn common_strain(all: &[Figures]) -> f64 {
    all.iter().map(Figures::largest_strain).filter(|strain| *strain > 0.0).fold(f64::NAN, f64::min)
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
        add("peak q up to there [MPa]".into(), &|f| f.peak_to(strain).map_or(f64::NAN, |(q, _)| 1e-6 * q));
        add("strain at that peak [%]".into(), &|f| f.peak_to(strain).map_or(f64::NAN, |(_, e)| 100.0 * e));
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

    /// One torn file must not hide what the others came to.
    #[test]
    fn a_file_that_cannot_be_read_is_a_row_with_its_reason() {
        let folder = tempfile::tempdir().expect("a folder");
        let member = Member::sample("a", folder.path());
        std::fs::write(&member.results, "torn").expect("written");
        let figures = Figures::of(&member);
        assert!(figures.status == "unreadable" && figures.reason.contains("a.vtkhdf"), "{figures:?}");
        assert!(figures.wall_time.is_nan() && !figures.is_finished());
    }

    /// Rows need not lie at the strain that all have reached, and a member may have none.
    #[test]
    fn the_end_counts_for_the_peak_and_nothing_is_not_zero() {
        let rising = figures(&[0.0, 0.01, 0.02], &[0.0, 2e6, 4e6]);
        assert_eq!(rising.peak_to(0.015), Some((3e6, 0.015)));
        let none = figures(&[], &[]);
        assert!(none.mean_stress_to(0.015).is_nan() && none.peak_to(0.015).is_none());
        assert!(rising.mean_stress_to(0.021).is_nan());
    }

    #[test]
    fn the_mean_is_the_area_over_the_strain() {
        let f = figures(&[0.0, 0.01, 0.02], &[0.0, 4e6, 4e6]);
        assert!((f.mean_stress_to(0.02) - 3e6).abs() < 1e-6);
        assert!((f.mean_stress_to(0.015) - (0.5 * 4e6 * 0.01 + 4e6 * 0.005) / 0.015).abs() < 1e-6);
        assert_eq!(f.peak_to(0.005), Some((2e6, 0.005)));
    }

    /// Elastic at 1 GPa to 2 % and to a q of 20 MPa, back along 2 GPa to 1.5 %, up again along 1 GPa, 15 MPa at 2 % and 20 MPa at 2.5 %,
    /// and on at 20 MPa to 4 %.
    fn looping() -> Figures {
        figures(&[0.0, 0.01, 0.02, 0.015, 0.02, 0.025, 0.04], &[0.0, 10e6, 20e6, 10e6, 15e6, 20e6, 20e6])
    }

    #[test]
    fn work_of_a_loop_counts_with_its_sign() {
        let f = looping();
        let near = |strain: f64, work: f64| {
            let found = f.mean_stress_to(strain) * strain;
            assert!((found / work - 1.0).abs() < 1e-12, "to {strain}: {found} for {work}");
        };
        // A triangle as long as nothing is unloaded, also where the loop comes by again.
        near(0.015, 0.5 * 15e6 * 0.015);
        near(0.02, 0.5 * 20e6 * 0.02);
        // Less 15 MPa over 0.5 % of unloading, more 15 MPa over 1 % of reloading.
        near(0.025, 200e3 - 75e3 + 150e3);
        near(0.04, 200e3 - 75e3 + 150e3 + 20e6 * 0.015);
        // Unloaded and reloaded on one line: as if it had never been.
        let elastic = figures(&[0.0, 0.02, 0.01, 0.03], &[0.0, 2e6, 1e6, 3e6]);
        assert!((elastic.mean_stress_to(0.03) - 1.5e6).abs() < 1e-6);
    }

    #[test]
    fn a_run_that_ends_by_unloading_is_compared_up_to_its_turn() {
        let turned = figures(&[0.0, 0.02, 0.019], &[0.0, 4e6, 0.0]);
        let all = [turned.clone(), figures(&[0.0, 0.03], &[0.0, 6e6]), looping()];
        assert_eq!(common_strain(&all), 0.02);
        assert_eq!((turned.last_strain(), turned.peak()), (0.019, Some((4e6, 0.02))));
        let compared = compared(&all);
        let values = |at: usize| compared[at].values.iter().map(|x| x.round()).collect::<Vec<_>>();
        assert_eq!(values(0), [2.0, 2.0, 10.0]);
        assert_eq!(values(1), [4.0, 4.0, 20.0]);
        // What is behind the turn does not count, though its strains are smaller.
        let higher = figures(&[0.0, 0.02, 0.01, 0.03], &[0.0, 4e6, 9e6, 9e6]);
        assert_eq!(higher.peak_to(0.02), Some((4e6, 0.02)));
        assert!(curve_difference(&turned, &all[1], 0.02) < 1e-12);
    }
}
