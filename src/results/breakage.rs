//! `/breakage`: grading before and after, indices and fits, as tables.

use crate::error::Result;
use crate::specimen::breakage::{Breakage, Fit};

use super::table::Column;
use super::writer::Writer;

/// The tables of `/breakage`: group and columns.
///
/// `/breakage`: one row with the indices and fits (NaN where a fit needs more sizes). `/breakage/grading`: a row a sieve, finer ones than the grading's included. `/breakage/classes`: a row
/// a size class with grains (the last upper sieve may be infinite).
pub fn breakage_tables(breakage: &Breakage) -> Vec<(&'static str, Vec<Column>)> {
    let one = Column::number;
    let fit = |fit: &Option<Fit>, value: fn(&Fit) -> f64| fit.as_ref().map_or(f64::NAN, value);
    let (lognormal, weibull) = (&breakage.lognormal, &breakage.weibull);
    let indices = vec![
        one("marsal", "1", "Marsal's B_g over the sieves of the grading", breakage.marsal),
        one("hardin", "1", "Hardin's relative breakage B_r", breakage.hardin),
        one("einav", "1", "Einav's breakage B", breakage.einav),
        one(
            "damaged_share",
            "1",
            "share of the solid volume with damage, crushed volume included",
            breakage.damaged_share,
        ),
        one(
            "crushed_share",
            "1",
            "share of the solid volume in deleted cells and parts given up",
            breakage.crushed_share,
        ),
        Column::count("fragments", "pieces that are left of grains that came apart", breakage.fragments),
        one(
            "lognormal_mean",
            "1",
            "fit of the pieces' sizes: mean of ln(size / 1 m)",
            fit(lognormal, |f| f.scale),
        ),
        one(
            "lognormal_deviation",
            "1",
            "fit of the pieces' sizes: standard deviation of ln size",
            fit(lognormal, |f| f.shape),
        ),
        one(
            "lognormal_distance",
            "1",
            "Kolmogorov distance of the lognormal fit",
            fit(lognormal, |f| f.distance),
        ),
        one("weibull_scale", "m", "fit of the pieces' sizes: Weibull scale", fit(weibull, |f| f.scale)),
        one("weibull_shape", "1", "fit of the pieces' sizes: Weibull shape", fit(weibull, |f| f.shape)),
        one("weibull_distance", "1", "Kolmogorov distance of the Weibull fit", fit(weibull, |f| f.distance)),
    ];
    let grading = vec![
        Column::floats("size", "m", "sieve (square opening)", breakage.sieves.clone()),
        Column::floats(
            "passing_before",
            "1",
            "mass fraction passing before the test",
            breakage.passing_before.clone(),
        ),
        Column::floats(
            "passing_after",
            "1",
            "mass fraction passing now, crushed volume as fines",
            breakage.passing_after.clone(),
        ),
    ];
    let classes = || breakage.classes.iter();
    let broken = vec![
        Column::floats("size_from", "m", "lower sieve of the class", classes().map(|c| c.sizes[0])),
        Column::floats("size_to", "m", "upper sieve of the class", classes().map(|c| c.sizes[1])),
        Column::integers("grains", "grains of this size before the test", classes().map(|c| c.grains)),
        Column::integers("broken", "of these, grains that came apart", classes().map(|c| c.broken)),
    ];
    vec![("breakage", indices), ("breakage/grading", grading), ("breakage/classes", broken)]
}

impl Writer {
    /// Writes `/breakage`; once, at the end of a run or a stage.
    pub fn write_breakage(&mut self, breakage: &Breakage) -> Result<()> {
        breakage_tables(breakage).iter().try_for_each(|(group, columns)| self.write_table(group, columns))
    }
}
