//! What a chart's layout keeps to.

use super::super::drawing::Mark;
use super::super::palette::{BLUE, FULL};
use super::*;

const SIZE: [f64; 2] = [WIDTH, 460.0];

fn curve(points: &[[f64; 2]]) -> Layer {
    let stroke = Stroke { colour: BLUE, width: 2.0, dash: FULL };
    Layer::Curve { label: "a curve".into(), points: points.to_vec(), stroke }
}

fn lines(drawing: &Drawing, colour: Colour) -> Vec<Vec<[f64; 2]>> {
    let of = |mark: &Mark| match mark {
        Mark::Line { points, stroke } if stroke.colour == colour => Some(points.clone()),
        _ => None,
    };
    drawing.marks.iter().filter_map(of).collect()
}

/// Ticks' labels and the curve agree on where a value lies.
#[test]
fn data_lie_where_the_ticks_say() {
    let mut panel = Panel::new(Axis::new("x"), Axis::new("y"));
    panel.layers.push(curve(&[[0.0, 0.0], [1.0, 10.0], [2.0, 20.0]]));
    let drawing = Chart::new("t", vec![panel], Arrangement::Stacked, SIZE).draw();
    let curves = lines(&drawing, BLUE);
    // The first is the legend's sample.
    let points = &curves[1];
    let at = |wanted: &str, axis: usize| -> Vec<f64> {
        let of = |mark: &Mark| match mark {
            Mark::Text { at, text, .. } if text == wanted => Some(at[axis]),
            _ => None,
        };
        drawing.marks.iter().filter_map(of).collect()
    };
    assert!(at("1.0", 0).iter().any(|x| (x - points[1][0]).abs() < 1e-9), "{:?}", at("1.0", 0));
    assert!(at("10", 1).iter().any(|y| (y - points[1][1]).abs() < 1e-9), "{:?}", at("10", 1));
    // Straight data make a straight line: the mapping is linear.
    let [a, b, c] = [points[0], points[1], points[2]];
    assert!((a[0] + c[0] - 2.0 * b[0]).abs() < 1e-9 && (a[1] + c[1] - 2.0 * b[1]).abs() < 1e-9);
    assert!(a[0] < c[0] && a[1] > c[1], "x to the right, y upwards");
}

/// No two texts of a crowded chart touch, and none leaves it.
#[test]
fn texts_do_not_overlap() {
    let mut panels = Vec::new();
    for at in 0..4 {
        let mut panel = Panel::new(Axis::new("abscissa [m]"), Axis::new("ordinate [N]"));
        panel.title = format!("panel {at}");
        for number in 0..9 {
            let points = (0..5).map(|k| [f64::from(k) * 1234.5, f64::from(k * number) * 1e-4]).collect();
            let label = format!("a run with a rather long name, number {number}");
            panel.layers.push(Layer::Curve { label, points, stroke: Stroke::of(number as usize) });
        }
        panels.push(panel);
    }
    for arrangement in [Arrangement::Stacked, Arrangement::Beside(2)] {
        let drawing = Chart::new("A title", panels.clone(), arrangement, [720.0, 620.0]).draw();
        apart(&drawing);
    }
}

/// Fails where a text leaves the drawing or touches another.
fn apart(drawing: &Drawing) {
    let boxes: Vec<([f64; 4], String)> = drawing
        .marks
        .iter()
        .filter_map(|mark| match mark {
            Mark::Text { at, text, size, anchor, turned, .. } => {
                let (long, half) = (text_width(text, *size), 0.36 * size);
                let shift = match anchor {
                    Anchor::Left => 0.0,
                    Anchor::Middle => 0.5,
                    Anchor::Right => 1.0,
                };
                let rect = match turned {
                    false => [at[0] - shift * long, at[1] - half, at[0] + (1.0 - shift) * long, at[1] + half],
                    true => [at[0] - half, at[1] - 0.5 * long, at[0] + half, at[1] + 0.5 * long],
                };
                Some((rect, text.clone()))
            }
            _ => None,
        })
        .collect();
    for (k, (a, text)) in boxes.iter().enumerate() {
        assert!(
            a[0] >= 0.0 && a[2] <= drawing.size[0] && a[1] >= 0.0 && a[3] <= drawing.size[1],
            "{text} leaves {:?}",
            drawing.size
        );
        for (b, other) in &boxes[..k] {
            let apart = a[0] >= b[2] || b[0] >= a[2] || a[1] >= b[3] || b[1] >= a[3];
            assert!(apart, "{text:?} {a:?} on {other:?} {b:?}");
        }
    }
}

/// At the width of a column, and at the least there may be, long texts take more lines, and none is cut.
#[test]
fn texts_are_whole_in_a_column() {
    let [title, label] =
        ["Contact forces: 80 grains at 0.8 MPa", "near the largest q, 0.6 % (213 contacts, mean 1.2 kN)"];
    let [name, note] =
        ["axial strain travelled, unloading included [%]", "0.702 MPa at 0.6 %, at the end: still rising"];
    let mut density = Panel::new(Axis::new(name), Axis::new("probability density [1]").logarithmic());
    let points = vec![[0.0, 0.1], [3.0, 0.05], [6.0, 0.03]];
    density.layers.push(Layer::Curve { label: label.into(), points, stroke: Stroke::of(0) });
    let mut stress = Panel::new(Axis::new("axial strain [%]"), Axis::new("q [MPa]").to(0.76));
    stress.title = title.into();
    stress.layers.push(curve(&[[0.0, 0.0], [0.3, 0.4], [0.6, 0.7]]));
    stress.layers.push(Layer::Note { at: [0.6, 0.7], text: note.into(), colour: BLUE });
    for width in [227.0, 317.0] {
        for (panel, whole) in [(&density, [title, label, name]), (&stress, [title, title, note])] {
            let chart = Chart::new(title, vec![panel.clone()], Arrangement::Stacked, [WIDTH, 360.0]);
            let drawing = chart.of_width(width).draw();
            apart(&drawing);
            let of = |mark: &Mark| match mark {
                Mark::Text { text, .. } => Some(text.clone()),
                _ => None,
            };
            let texts: Vec<String> = drawing.marks.iter().filter_map(of).collect();
            let all = texts.concat().replace(' ', "");
            assert!(whole.iter().all(|text| all.contains(&text.replace(' ', ""))), "{width}: {texts:?}");
            assert!(!all.contains('…'), "{texts:?}");
            // Of a crowded decade's labels its power stays.
            let has = |label: &str| texts.iter().any(|text| text == label);
            assert!(panel.y.label == "q [MPa]" || (has("0.1") && !has("0.09")), "{texts:?}");
        }
    }
}

/// Names of curves that differ only in what does not fit are still told apart.
#[test]
fn no_two_entries_of_a_legend_are_alike() {
    let mut panel = Panel::new(Axis::new("x"), Axis::new("y"));
    for letter in ["a", "b", "c"] {
        let far = "far ".repeat(60);
        let label = format!("{far}{letter} {far}");
        let (points, stroke) = (vec![[0.0, 0.0], [1.0, 1.0]], Stroke::of(0));
        panel.layers.push(Layer::Curve { label, points, stroke });
    }
    let chart = Chart::new("t", vec![panel], Arrangement::Stacked, SIZE);
    let mut labels: Vec<Vec<String>> =
        chart.legend(WIDTH).into_iter().flatten().map(|(_, lines)| lines).collect();
    assert!(labels.iter().all(|label| entry_width(label) <= WIDTH - 16.0), "{labels:?}");
    labels.dedup();
    assert_eq!(labels.len(), 3, "{labels:?}");
}

/// At the width of a column no name of an axis is cut, and none leaves the chart.
#[test]
fn names_of_ordinates_are_whole_in_a_column() {
    let panel = |name: &str, weight: f64| {
        let layers = vec![curve(&[[0.0, -0.0125], [1.0, 0.0125]])];
        Panel { layers, weight, ..Panel::new(Axis::new("axial strain [%]"), Axis::new(name)) }
    };
    let names = ["deviatoric stress q [MPa]", "volume strain [%], contraction +"];
    let panels = vec![panel(names[0], 1.0), panel(names[1], 0.72)];
    for arrangement in [Arrangement::Stacked, Arrangement::Beside(2)] {
        let chart = Chart::new("t", panels.clone(), arrangement, [WIDTH, 340.0]);
        let drawing = chart.of_width(317.0).draw();
        let mut found: Vec<(f64, &str)> = Vec::new();
        for mark in &drawing.marks {
            if let Mark::Text { at, text, turned: true, .. } = mark {
                found.push((at[0], text.as_str()));
            }
        }
        assert!(found.iter().all(|(x, text)| *x > 6.0 && !text.contains('…')), "{found:?}");
        let all: Vec<&str> = found.iter().map(|(_, text)| *text).collect();
        for word in names.iter().flat_map(|name| name.split(' ')) {
            assert!(all.iter().any(|line| line.contains(word)), "{word}: {all:?}");
        }
    }
}

#[test]
fn in_a_column_circles_are_round_and_panels_below_each_other() {
    let arc = |k: usize| (std::f64::consts::PI * k as f64 / 60.0).sin_cos();
    let circle: Vec<[f64; 2]> = (0..=60).map(arc).map(|(sine, cosine)| [1.0 - cosine, sine]).collect();
    let (x, y) = (Axis::new("x").from(0.0).to(2.2), Axis::new("y").from(0.0).to(2.2 * 316.0 / 628.0));
    let panel = Panel { layers: vec![curve(&circle)], ..Panel::new(x, y) };
    let mut chart = Chart::new("", vec![panel.clone()], Arrangement::Stacked, [720.0, 384.0]);
    chart.beside = Some([92.0, 68.0]);
    for width in [720.0, 317.0] {
        let drawn = lines(&chart.of_width(width).draw(), BLUE);
        let reach = |axis: usize| {
            let all = drawn.iter().flatten().map(|p| p[axis]);
            all.clone().fold(f64::MIN, f64::max) - all.fold(f64::MAX, f64::min)
        };
        assert!((reach(0) / reach(1) / 2.0 - 1.0).abs() < 0.08, "{width}: {} {}", reach(0), reach(1));
    }
    let pair = Chart::new("", vec![panel.clone(), panel], Arrangement::Beside(2), SIZE).of_width(317.0);
    assert!(pair.arrangement == Arrangement::Beside(1) && pair.size[1] > 500.0, "{:?}", pair.size);
}
