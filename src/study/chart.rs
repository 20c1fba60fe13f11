//! Charts of a study: speed against accuracy, and the curves of an ensemble with their scatter.

use crate::report::Axis;
use crate::report::chart::{Arrangement, Chart, Layer, Panel};
use crate::report::palette::{BLACK, BLUE, Colour, GREY, Stroke};

use super::order::{Order, observed};
use super::outcome::{Figure, Figures, at_strain, common_strain, curve_difference};
use super::table::{mean_and_deviation, series};
use super::vary::Setting;

/// How far each member is from the best there is, and what that is. For specimens the difference of the curves q(strain) from
/// the last member's; for scenes that of the first figure from its value at size zero, or from the last member's.
pub fn errors(settings: &[Setting], all: &[Figures], compared: &[Figure]) -> (Vec<f64>, String) {
    let strain = common_strain(all);
    if strain > 0.0 {
        let reference = all.iter().rposition(|f| f.largest_strain() >= strain * (1.0 - 1e-9));
        let Some(reference) = reference else { return (vec![f64::NAN; all.len()], String::new()) };
        let each = |(at, f): (usize, &Figures)| match at == reference {
            true => f64::NAN,
            false => curve_difference(f, &all[reference], strain),
        };
        let label = settings.get(reference).map_or("", |setting| &setting.label);
        let name = format!("rms difference of q(strain) from {label} [1]");
        return (all.iter().enumerate().map(each).collect(), name);
    }
    let Some(figure) = compared.first() else { return (vec![f64::NAN; all.len()], String::new()) };
    let series = series(settings, figure);
    let last = figure.values.iter().rposition(|value| value.is_finite());
    let (limit, of) = match (observed(&series), last) {
        (Order::Observed { limit, .. }, _) if limit.is_finite() && limit != 0.0 => {
            (limit, "size zero".to_string())
        }
        (_, Some(last)) => {
            (figure.values[last], settings.get(last).map_or(String::new(), |s| s.label.clone()))
        }
        (_, None) => (f64::NAN, String::new()),
    };
    let each = |value: &f64| {
        let error = ((value - limit) / limit).abs();
        if error > 0.0 { error } else { f64::NAN }
    };
    let short_name = figure.name.split(" [").next().unwrap_or(&figure.name);
    (figure.values.iter().map(each).collect(), format!("{short_name}: difference from {of} [1]"))
}

/// Speed against accuracy; `None` with fewer than two points. Time is that of the increments: specimens are made once and used often.
pub fn speed_and_accuracy(
    heading: &str,
    settings: &[Setting],
    all: &[Figures],
    compared: &[Figure],
) -> Option<Chart> {
    let (errors, name) = errors(settings, all, compared);
    let unknown = |f: &Figures| f.wall_time.is_finite() && !f.solving_time.is_finite();
    let (time, axis): (fn(&Figures) -> f64, _) = match all.iter().any(unknown) {
        true => (|f| f.wall_time, "wall time [s]"),
        false => (|f| f.solving_time, "time of the increments [s]"),
    };
    let points: Vec<([f64; 2], &str)> = settings
        .iter()
        .zip(all)
        .zip(&errors)
        .map(|((setting, f), error)| ([time(f), *error], setting.label.as_str()))
        .filter(|(p, _)| p.iter().all(|x| x.is_finite() && *x > 0.0))
        .collect();
    if points.len() < 2 {
        return None;
    }
    let reach = |axis: usize| {
        let all = points.iter().map(|(p, _)| p[axis]);
        (all.clone().fold(f64::INFINITY, f64::min), all.fold(0.0, f64::max))
    };
    let ((fast, slow), (good, bad)) = (reach(0), reach(1));
    let x = Axis::new(axis).logarithmic().from(fast / 1.6).to(slow * 1.6);
    // Room for the notes above the points.
    let y = Axis::new(name).logarithmic().from(good / 1.6).to(bad * 2.0);
    let mut panel = Panel::new(x, y);
    let line = points.iter().map(|(p, _)| *p).collect::<Vec<_>>();
    let stroke = Stroke { width: 1.2, ..Stroke::of(0) };
    panel.layers.push(Layer::Curve { label: String::new(), points: line.clone(), stroke });
    panel.layers.push(Layer::Points { label: String::new(), points: line, colour: BLUE, radius: 4.0 });
    for (at, label) in points {
        panel.layers.push(Layer::Note { at, text: label.into(), colour: BLACK });
    }
    let title = format!("Speed against accuracy: {heading}");
    Some(Chart::new(title, vec![panel], Arrangement::Stacked, [640.0, 420.0]))
}

/// Error of each figure over the size that goes to zero: from its value at size zero where an order is observed, else from
/// that of the finest. `None` where no figure has two such points.
pub fn convergence(heading: &str, settings: &[Setting], compared: &[Figure]) -> Option<Chart> {
    let x = Axis::new(size_name(heading, settings)).logarithmic();
    let mut panel = Panel::new(x, Axis::new("relative error [1]").logarithmic());
    for (number, figure) in compared.iter().enumerate() {
        let series = series(settings, figure);
        let finest = series.iter().filter(|(_, value)| value.is_finite()).min_by(|a, b| a.0.total_cmp(&b.0));
        let Some(&(_, finest)) = finest else { continue };
        let (limit, how) = match observed(&series) {
            Order::Observed { order, limit } if order.is_finite() => (limit, format!("order {order:.1}")),
            _ => (finest, "no order; from the finest".to_string()),
        };
        let error = |(size, value): &(f64, f64)| [*size, ((value - limit) / limit).abs()];
        let points: Vec<[f64; 2]> =
            series.iter().map(error).filter(|p| p.iter().all(|x| x.is_finite() && *x > 0.0)).collect();
        if points.len() < 2 {
            continue;
        }
        let name = figure.name.split(" [").next().unwrap_or(&figure.name);
        let stroke = Stroke::of(number);
        panel.layers.push(Layer::Curve { label: format!("{name}: {how}"), points: points.clone(), stroke });
        let label = String::new();
        panel.layers.push(Layer::Points { label, points, colour: stroke.colour, radius: 4.0 });
    }
    if panel.layers.is_empty() {
        return None;
    }
    Some(Chart::new("Error against what is refined", vec![panel], Arrangement::Stacked, [640.0, 420.0]))
}

/// What goes to zero: the value that is varied, its inverse where that is a number of increments, or something that follows from it.
fn size_name(heading: &str, settings: &[Setting]) -> String {
    let is = |of: fn(f64) -> f64| {
        let same = |setting: &Setting| match (setting.label.parse::<f64>(), setting.size) {
            (Ok(value), Some(size)) => (of(value) / size - 1.0).abs() < 1e-6,
            (Err(_), _) | (_, None) => false,
        };
        // Of the exact one, at zero, no number can be said.
        settings.iter().filter(|setting| setting.size != Some(0.0)).all(same)
    };
    let name = heading.split(" [").next().unwrap_or(heading);
    match (is(|value| value), is(|value| 1.0 / value)) {
        (true, _) => heading.to_string(),
        (false, true) => format!("1 / {name} [1]"),
        (false, false) => format!("size that follows from {name}"),
    }
}

/// All members' curves q(strain) and volume strain, with mean and standard deviation; `None` without strains.
pub fn curves(settings: &[Setting], all: &[Figures], ensemble: bool) -> Option<Chart> {
    let strain = common_strain(all);
    if !(strain > 0.0) {
        return None;
    }
    let mut top = Panel::new(Axis::new("axial strain [%]"), Axis::new("deviatoric stress q [MPa]"));
    let mut bottom = Panel::new(Axis::new("axial strain [%]"), Axis::new("volume strain [%], contraction +"));
    bottom.weight = 0.72;
    for (panel, factor, stress) in [(&mut top, 1e-6, true), (&mut bottom, 100.0, false)] {
        let values =
            |f: &Figures| if stress { f.deviatoric_stress.clone() } else { f.volumetric_strain.clone() };
        if ensemble {
            let (low, high, mean) = band(all, strain, factor, &values);
            let pale = Colour(0xC9, 0xDF, 0xEE);
            panel.layers.push(Layer::Band { label: "± standard deviation".into(), low, high, colour: pale });
            let stroke = Stroke { width: 2.6, ..Stroke::of(0) };
            panel.layers.push(Layer::Curve { label: "mean".into(), points: mean, stroke });
        }
        for (number, (setting, f)) in settings.iter().zip(all).enumerate() {
            let points = f.strain.iter().zip(values(f)).map(|(e, v)| [100.0 * e, factor * v]).collect();
            let (label, stroke) = match ensemble {
                true => ("members".to_string(), Stroke { width: 0.9, ..Stroke::thin(GREY) }),
                false => (setting.label.clone(), Stroke { width: 1.6, ..Stroke::of(number) }),
            };
            panel.layers.push(Layer::Curve { label, points, stroke });
        }
    }
    let title = if ensemble { format!("{} members", all.len()) } else { "Curves of the study".to_string() };
    Some(Chart::new(title, vec![top, bottom], Arrangement::Stacked, [720.0, 600.0]))
}

type Points = Vec<[f64; 2]>;

/// Lower and upper end of the band and the mean, up to the strain that all members reached.
fn band(
    all: &[Figures],
    strain: f64,
    factor: f64,
    values: &dyn Fn(&Figures) -> Vec<f64>,
) -> (Points, Points, Points) {
    const STEPS: usize = 150;
    let columns: Vec<Vec<f64>> = all.iter().map(values).collect();
    let (mut low, mut high, mut mean) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..=STEPS {
        let at = strain * k as f64 / STEPS as f64;
        let there = all.iter().zip(&columns).map(|(f, column)| factor * at_strain(&f.strain, column, at));
        let there: Vec<f64> = there.filter(|x| x.is_finite()).collect();
        let (middle, deviation) = mean_and_deviation(&there);
        if middle.is_finite() && deviation.is_finite() {
            low.push([100.0 * at, middle - deviation]);
            high.push([100.0 * at, middle + deviation]);
            mean.push([100.0 * at, middle]);
        }
    }
    (low, high, mean)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a scene whose specimens took most of the time, and one of whose files may be of an earlier version.
    fn chart(last_solving_time: f64) -> Chart {
        let setting = |label: &str| Setting { label: label.into(), size: None, overrides: Vec::new() };
        let figures = |wall_time, solving_time| Figures { wall_time, solving_time, ..Figures::default() };
        let all = [figures(61.0, 1.0), figures(62.0, 2.0), figures(64.0, last_solving_time)];
        let compared = [Figure { name: "force [N]".into(), values: vec![1.1, 1.01, 1.0] }];
        speed_and_accuracy("x", &["a", "b", "c"].map(setting), &all, &compared).expect("a chart")
    }

    #[test]
    fn errors_of_second_order_fall_by_four() {
        let setting = |size: f64| Setting { label: size.to_string(), size: Some(size), overrides: vec![] };
        let sizes = [4e-4, 2e-4, 1e-4];
        let clean = Figure { name: "q [Pa]".into(), values: sizes.map(|h| 5.0 + 1e6 * h * h).to_vec() };
        let ragged = Figure { name: "e [1]".into(), values: vec![1.0, 2.0, 1.5] };
        let chart = convergence("increment", &sizes.map(setting), &[clean, ragged]).expect("a chart");
        let [Layer::Curve { label, points, .. }, _, Layer::Curve { label: other, points: two, .. }, _] =
            &chart.panels[0].layers[..]
        else {
            panic!("{:?}", chart.panels[0].layers)
        };
        assert!(label == "q: order 2.0" && (points[0][1] / points[1][1] - 4.0).abs() < 1e-4, "{points:?}");
        assert!(other == "e: no order; from the finest" && two.len() == 2, "{other} {two:?}");
        assert_eq!(chart.panels[0].x.label, "increment");
        // Strict balance has no place on a logarithmic axis, and is not what the others converge to by themselves.
        let exact = Setting { label: "null".into(), size: Some(0.0), overrides: vec![] };
        let settings = [&sizes.map(setting)[..], &[exact]].concat();
        let with = Figure { name: "q [Pa]".into(), values: vec![5.16, 5.04, 5.01, 4.9] };
        let chart = convergence("unrest", &settings, &[with]).expect("a chart");
        let Layer::Curve { label, points, .. } = &chart.panels[0].layers[0] else {
            panic!("{:?}", chart.panels[0].layers)
        };
        assert!(label == "q: order 2.0" && points.len() == 3, "{label} {points:?}");
        assert_eq!(chart.panels[0].x.label, "unrest");
        let counted = |n: f64| Setting { label: n.to_string(), size: Some(1.0 / n), overrides: vec![] };
        assert_eq!(size_name("increments [1]", &[20.0, 40.0].map(counted)), "1 / increments [1]");
    }

    #[test]
    fn speed_is_that_of_the_increments() {
        let times = |chart: &Chart| -> Vec<f64> {
            let points = |layer: &Layer| match layer {
                Layer::Points { points, .. } => points.iter().map(|[time, _]| *time).collect(),
                _ => Vec::new(),
            };
            chart.panels[0].layers.iter().flat_map(points).collect()
        };
        let of_increments = chart(4.0);
        assert_eq!(times(&of_increments), [1.0, 2.0]);
        assert_eq!(of_increments.panels[0].x.label, "time of the increments [s]");
        let of_runs = chart(f64::NAN);
        assert_eq!(times(&of_runs), [61.0, 62.0]);
        assert_eq!(of_runs.panels[0].x.label, "wall time [s]");
    }
}
