//! What a geotechnical reader looks for first: stresses, void ratio, angles and moduli of the shearing, Mohr's circles at
//! the largest deviatoric stress with the line of Mohr and Coulomb, stress paths.
//!
//! Compression positive, SI inside. The line over several runs is the least-squares line through the tops (s, t) of their
//! circles, t = a + s sin(phi), c = a / cos(phi) (Lambe & Whitman 1969, Soil Mechanics, ch. 11).

use crate::error::Result;

use super::axis::{Axis, short};
use super::chart::{Arrangement, Chart, Layer, Panel};
use super::curves::joined;
use super::palette::{DASHED, INK, Stroke};
use super::run::{Largest, Run, Shearing};

/// Confining pressures that differ by less than this share are one, and tell no cohesion.
const SAME_PRESSURE: f64 = 0.05;
/// Stages whose first slope and secant are moduli of a shearing.
const SHEARS: [&str; 4] = ["shear", "stress_shear", "constant_volume", "constant_p"];
/// Stages without a dilatancy of shearing.
const STANDING: [&str; 2] = ["consolidate", "hold"];
/// Points of half a circle.
const ARC: usize = 90;
/// Width and height of the circles' chart [px], and what of it is beside the axes: a circle has to be round.
const SIZE: [f64; 2] = [720.0, 384.0];
const BESIDE: [f64; 2] = [92.0, 68.0];

/// A stress circle: smallest and largest principal stress [Pa].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    pub minor: f64,
    pub major: f64,
}

/// The line of Mohr and Coulomb.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Envelope {
    /// [Pa]
    pub cohesion: f64,
    /// [rad]
    pub friction_angle: f64,
}

impl Circle {
    fn centre(self) -> f64 {
        0.5 * (self.major + self.minor)
    }

    fn radius(self) -> f64 {
        0.5 * (self.major - self.minor)
    }
}

/// Whether these confining pressures [Pa] are more than one.
pub fn differ(pressures: impl Iterator<Item = f64> + Clone) -> bool {
    let most = pressures.clone().fold(0.0, f64::max);
    most - pressures.fold(f64::INFINITY, f64::min) > SAME_PRESSURE * most
}

/// The line that these circles touch, or nearly: without cohesion where they are of one pressure. `None` without circles, or
/// where no line rises.
pub fn envelope(circles: &[Circle]) -> Option<Envelope> {
    let count = circles.len() as f64;
    let mean = |of: fn(Circle) -> f64| circles.iter().map(|c| of(*c)).sum::<f64>() / count;
    let (s, t) = (mean(Circle::centre), mean(Circle::radius));
    let (sine, at_zero) = if differ(circles.iter().map(|c| c.minor)) {
        let along: f64 = circles.iter().map(|c| (c.centre() - s).powi(2)).sum();
        let across: f64 = circles.iter().map(|c| (c.centre() - s) * (c.radius() - t)).sum();
        (across / along, t - across / along * s)
    } else {
        (t / s, 0.0)
    };
    (sine > 0.0 && sine < 1.0).then(|| {
        let friction_angle = sine.asin();
        Envelope { cohesion: at_zero / friction_angle.cos(), friction_angle }
    })
}

/// The circle of a run at its largest deviatoric stress behind the consolidation.
pub fn circle(run: &Run, shearing: &Shearing) -> Result<Option<Circle>> {
    let Some((at, _)) = shearing.curve.largest() else { return Ok(None) };
    let minor = run.column("confining_pressure")?[shearing.rows[at]];
    let circle = Circle { minor, major: minor + shearing.curve.deviatoric_stress[at] };
    Ok((minor > 0.0 && circle.major > minor).then_some(circle))
}

/// A void ratio inside the cover, with the nominal one of the whole cylinder behind it where that is another.
fn void_ratios(inside: f64, nominal: f64) -> String {
    let [inside, nominal] = [inside, nominal].map(|e| if e.is_finite() { short(e) } else { String::new() });
    match nominal.is_empty() || nominal == inside {
        true => format!("{inside} inside the cover"),
        false => format!("{inside} inside the cover; nominal, of the whole cylinder: {nominal}"),
    }
}

/// The overview's lines on the density and strength of a specimen: name and value, empty where there is none.
pub fn overview(run: &Run) -> Result<Vec<(String, String)>> {
    let mut lines = Vec::new();
    let shearing = run.shearing()?;
    let mut line = |name: &str, value: String| lines.push((name.to_string(), value));
    let number = |value: Option<f64>, units: &str| {
        let known = value.filter(|value| value.is_finite());
        known.map_or(String::new(), |value| format!("{}{units}", short(value)))
    };
    let confining = run.column("confining_pressure")?;
    let at_largest = shearing.curve.largest().map(|(at, _)| 1e-6 * confining[shearing.rows[at]]);
    line("confining pressure", number(at_largest, " MPa"));
    line("void ratio, generated", number(stored(run, "specimen/void_ratio")?, ""));
    let void_ratio = run.column("void_ratio")?;
    // Files of older versions have none.
    let nominal = run.column("void_ratio_nominal").unwrap_or_else(|_| vec![f64::NAN; void_ratio.len()]);
    let (first, last) = (shearing.rows.first(), shearing.rows.last());
    let behind = shearing.behind_consolidation;
    for (name, row) in [
        ("void ratio, consolidated", first.filter(|_| behind)),
        ("void ratio at first", first.filter(|_| !behind)),
        ("void ratio at the end", last),
    ] {
        let known = row.filter(|row| void_ratio[**row].is_finite());
        line(name, known.map_or(String::new(), |row| void_ratios(void_ratio[*row], nominal[*row])));
    }
    lines.extend(angles(run, &shearing)?);
    lines.extend(moduli(run)?);
    Ok(lines)
}

/// The largest and residual angles behind the consolidation, as the overview's lines.
fn angles(run: &Run, shearing: &Shearing) -> Result<Vec<(String, String)>> {
    let (leading, kinds) = (run.leading_consolidations(), &run.summary.stages);
    if leading >= kinds.len() {
        return Ok(Vec::new());
    }
    let degrees = |angle: f64| format!("{}°", short(angle.to_degrees()));
    let peaks = run.column("peak_friction_angle")?;
    let peak = shearing.rows.iter().rev().map(|row| peaks[*row]).find(|angle| angle.is_finite());
    let mut residual = String::new();
    if let Some(stage) = stage_of_largest(run, shearing)?.filter(|stage| *stage >= leading)
        && let Some(angle) = of_stage(run, stage, "residual_friction_angle")?
    {
        residual = in_stage(run, degrees(angle), stage);
    }
    let mut dilatancy: Option<(f64, usize)> = None;
    for stage in (leading..kinds.len()).filter(|stage| !STANDING.contains(&kinds[*stage].as_str())) {
        if let Some(angle) = of_stage(run, stage, "largest_dilatancy_angle")?
            && dilatancy.is_none_or(|(largest, _)| angle > largest)
        {
            dilatancy = Some((angle, stage));
        }
    }
    let dilatancy = dilatancy.map_or(String::new(), |(angle, stage)| in_stage(run, dilation(angle), stage));
    let lines = [
        ("friction angle, largest", peak.map_or(String::new(), degrees)),
        ("friction angle, residual", residual),
        ("dilatancy angle, largest", dilatancy),
    ];
    Ok(lines.map(|(name, value)| (name.to_string(), value)).into())
}

/// The largest dilatancy angle [rad] in words: where the volume never grows there is none.
fn dilation(largest: f64) -> String {
    match largest > 0.0 {
        true => format!("{}°", short(largest.to_degrees())),
        false => "none: contracts throughout".into(),
    }
}

/// The moduli of the first stage that shears, as the overview's lines.
fn moduli(run: &Run) -> Result<Vec<(String, String)>> {
    let kinds = &run.summary.stages;
    let Some(stage) = kinds.iter().position(|kind| SHEARS.contains(&kind.as_str())) else {
        return Ok(Vec::new());
    };
    let mut lines = Vec::new();
    for (dataset, name) in [("initial_modulus", "initial tangent modulus"), ("half_modulus", "E50")] {
        let told = of_stage(run, stage, dataset)?.map(|modulus| format!("{} MPa", short(1e-6 * modulus)));
        lines.push((name.to_string(), told.map_or(String::new(), |told| in_stage(run, told, stage))));
    }
    Ok(lines)
}

/// A number of `/stages/<stage>`, where the stage has it.
fn of_stage(run: &Run, stage: usize, dataset: &str) -> Result<Option<f64>> {
    stored(run, &format!("stages/{stage}/{dataset}"))
}

/// A single number of the file, where it has it.
fn stored(run: &Run, place: &str) -> Result<Option<f64>> {
    if !run.reader.has(place) {
        return Ok(None);
    }
    Ok(run.reader.floats(place)?.first().copied().filter(|value| value.is_finite()))
}

/// A value, with its stage where that is not the first behind the consolidation.
fn in_stage(run: &Run, value: String, stage: usize) -> String {
    if stage == run.leading_consolidations() { value } else { format!("{value}, stage {stage}") }
}

/// The stage in which the deviatoric stress is largest.
fn stage_of_largest(run: &Run, shearing: &Shearing) -> Result<Option<usize>> {
    let Some((at, _)) = shearing.curve.largest() else { return Ok(None) };
    Ok(Some(run.column("stage")?[shearing.rows[at]] as usize))
}

/// Whether the largest deviatoric stress is one of shearing: that of a consolidation, a hold or an oedometer is no failure.
fn is_sheared(run: &Run, shearing: &Shearing) -> Result<bool> {
    let kind = stage_of_largest(run, shearing)?.and_then(|stage| run.summary.stages.get(stage));
    Ok(kind.is_some_and(|kind| kind == "reload" || SHEARS.contains(&kind.as_str())))
}

/// What the caption says of the line of a cohesion [Pa] and a friction angle [rad].
fn line_in_words(cohesion: f64, friction_angle: f64) -> String {
    let angle = short(friction_angle.to_degrees());
    if cohesion == 0.0 {
        return format!(" The line without cohesion: φ = {angle}°.");
    }
    let meaning = match cohesion > 0.0 {
        true => "Rock has no cohesion: c stands for an envelope that bends.",
        false => {
            "c is negative: φ grows with the pressure here, by chance or where q still rises; rather take each run's own φ, \
             or φ0 and Δφ."
        }
    };
    let cohesion = short(1e-6 * cohesion);
    format!(" The line through their tops (least squares): φ = {angle}°, c = {cohesion} MPa. {meaning}")
}

/// What the caption says of runs whose circles are no failures, and of those whose largest q is their last.
fn remarks(confined: &[&str], rising: &[&str]) -> String {
    let mut said = String::new();
    if !rising.is_empty() {
        said += &format!(" Still rising, q at the end: {}.", rising.join(", "));
    }
    if !confined.is_empty() {
        let confined = confined.join(", ");
        said += &format!(" What is not sheared is at no failure: the line leaves out {confined}.");
    }
    said
}

/// The circles of all specimens and the line that they touch, with its caption; `None` where no run was sheared.
pub fn circles(runs: &[Run]) -> Result<Option<(Chart, String)>> {
    let (mut found, mut failures) = (Vec::new(), Vec::new());
    let (mut confined, mut rising) = (Vec::new(), Vec::new());
    for (number, run) in runs.iter().enumerate().filter(|(_, run)| !run.is_scene()) {
        let shearing = run.shearing()?;
        if let Some(circle) = circle(run, &shearing)? {
            match (is_sheared(run, &shearing)?, shearing.curve.largest()) {
                (true, Some((_, Largest::AtEnd))) => {
                    failures.push(circle);
                    rising.push(run.label.as_str());
                }
                (true, _) => failures.push(circle),
                (false, _) => confined.push(run.label.as_str()),
            }
            found.push((number, run, circle));
        }
    }
    let all = found.iter().map(|(_, _, circle)| circle.major);
    let reach = 1.06e-6 * all.fold(0.0, f64::max);
    if !(reach > 0.0) {
        return Ok(None);
    }
    let [wide, tall] = [SIZE[0] - BESIDE[0], SIZE[1] - BESIDE[1]];
    let x = Axis::new("normal stress [MPa]").from(0.0).to(reach);
    let mut panel = Panel::new(x, Axis::new("shear stress [MPa]").from(0.0).to(reach * tall / wide));
    for (number, run, circle) in found {
        let point = |k: usize| {
            let (sine, cosine) = (std::f64::consts::PI * k as f64 / ARC as f64).sin_cos();
            [1e-6 * (circle.centre() - circle.radius() * cosine), 1e-6 * circle.radius() * sine]
        };
        let points = (0..=ARC).map(point).collect();
        panel.layers.push(Layer::Curve { label: run.label.clone(), points, stroke: Stroke::of(number) });
    }
    let mut caption = "Mohr's circles at the largest q of each run.".to_string();
    if let Some(Envelope { cohesion, friction_angle }) = envelope(&failures) {
        let stress = |normal: f64| [normal, 1e-6 * cohesion + normal * friction_angle.tan()];
        let end = (reach * tall / wide - 1e-6 * cohesion) / friction_angle.tan();
        let start = (-1e-6 * cohesion / friction_angle.tan()).max(0.0);
        let points = vec![stress(start), stress(end.min(reach))];
        let stroke = Stroke { width: 1.4, dash: DASHED, ..Stroke::thin(INK) };
        panel.layers.push(Layer::Curve { label: "Mohr-Coulomb".into(), points, stroke });
        caption += &line_in_words(cohesion, friction_angle);
    }
    caption += &remarks(&confined, &rising);
    let chart = Chart::new("Strength", vec![panel], Arrangement::Stacked, SIZE);
    Ok(Some((Chart { beside: Some(BESIDE), ..chart }, caption)))
}

/// Stress paths q(p) and void ratio over p, from the start of the runs; `None` where no specimen has them.
pub fn paths(runs: &[Run]) -> Result<Option<Chart>> {
    let mean = || Axis::new("mean stress p [MPa]");
    let mut path = Panel::new(mean(), Axis::new("q [MPa]"));
    let mut volume = Panel::new(mean().logarithmic(), Axis::new("void ratio e [1]"));
    let mut drawn = false;
    for (number, run) in runs.iter().enumerate().filter(|(_, run)| !run.is_scene()) {
        let p = run.column("mean_stress")?;
        let q = joined(&p, 1e-6, &run.column("deviatoric_stress")?, 1e-6);
        let e = joined(&p, 1e-6, &run.column("void_ratio")?, 1.0);
        drawn |= q.iter().filter(|point| point[0] > 0.0 && point[1].is_finite()).count() > 1;
        let (label, stroke) = (run.label.clone(), Stroke::of(number));
        path.layers.push(Layer::Curve { label: label.clone(), points: q, stroke });
        volume.layers.push(Layer::Curve { label, points: e, stroke });
    }
    let (title, panels) = ("Stress path and void ratio", vec![path, volume]);
    Ok(drawn.then(|| Chart::new(title, panels, Arrangement::Beside(2), [720.0, 320.0])))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The circle of pressure `minor` that touches the line of c and phi.
    fn touching(minor: f64, c: f64, phi: f64) -> Circle {
        let factor = (1.0 + phi.sin()) / (1.0 - phi.sin());
        Circle { minor, major: factor * minor + 2.0 * c * factor.sqrt() }
    }

    #[test]
    fn circles_that_touch_a_line_give_that_line() {
        let (c, phi) = (2e4, 0.7);
        let three = [2e5, 4e5, 8e5].map(|minor| touching(minor, c, phi));
        let found = envelope(&three).expect("a line");
        assert!((found.cohesion / c - 1.0).abs() < 1e-9 && (found.friction_angle - phi).abs() < 1e-12);
    }

    #[test]
    fn a_void_ratio_of_the_whole_cylinder_is_told_where_it_is_another() {
        assert_eq!(void_ratios(0.4, 0.4), "0.4 inside the cover");
        assert_eq!(void_ratios(0.4, f64::NAN), "0.4 inside the cover");
        assert!(void_ratios(0.382, 0.45).ends_with("cylinder: 0.45"));
    }

    #[test]
    fn what_is_no_failure_is_said() {
        assert_eq!(remarks(&[], &[]), "");
        let said = remarks(&["held"], &["short", "shorter"]);
        assert!(
            said.contains("q at the end: short, shorter.") && said.contains("leaves out held."),
            "{said}"
        );
    }

    #[test]
    fn a_specimen_that_only_contracts_has_no_dilatancy_angle() {
        assert_eq!(dilation(0.2), "11.5°");
        assert_eq!(dilation(-1.2), "none: contracts throughout");
    }

    #[test]
    fn a_negative_cohesion_is_told_and_explained() {
        // The friction angle grows with the pressure.
        let found = envelope(&[touching(4e5, 0.0, 0.6), touching(16e5, 0.0, 0.7)]).expect("a line");
        let said = line_in_words(found.cohesion, found.friction_angle);
        assert!(found.cohesion < 0.0 && said.contains("c = −") && said.contains("c is negative"), "{said}");
        let said = line_in_words(1e5, 0.7);
        assert!(said.contains("c = 0.1 MPa. Rock has no cohesion"), "{said}");
        assert_eq!(line_in_words(0.0, 0.7), " The line without cohesion: φ = 40.1°.");
    }

    #[test]
    fn one_pressure_tells_no_cohesion() {
        let found = envelope(&[touching(4e5, 0.0, 0.6), touching(4.04e5, 0.0, 0.6)]).expect("a line");
        assert!(found.cohesion == 0.0 && (found.friction_angle - 0.6).abs() < 1e-12);
        assert_eq!(envelope(&[]), None);
    }
}
