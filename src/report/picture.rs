//! Pictures of a specimen or a scene, side by side on one scale, with captions and a scale of colours.

use crate::error::Result;
use crate::tensor::Vec3;

use super::axis::{Axis, Scale, short};
use super::drawing::{Anchor, Drawing, PNG_SCALE};
use super::image::Image;
use super::lettering::fitted;
use super::palette::{AXIS, BLACK, Colour, INK, Stroke, heat, viridis};
use super::raster::{View, picture};
use super::run::Run;
use super::surface::{Quantity, Standing, Triangle, numbers, of_bodies, pose_of};

/// Where a specimen is looked at from.
const TOWARDS_VIEWER: [f64; 3] = [0.45, -1.0, 0.28];
/// Sections are seen straight on.
const TOWARDS_SECTION: [f64; 3] = [0.0, -1.0, 0.0];
/// Pixels rasterised per pixel of the drawing: those of the backend, averaged with it.
const FINE: f64 = 2.0 * PNG_SCALE;

/// Greys and browns of broken rock.
const ROCK: [Colour; 10] = [
    Colour(0xB9, 0xA8, 0x8F),
    Colour(0xA3, 0x8F, 0x74),
    Colour(0x8C, 0x7B, 0x66),
    Colour(0xC9, 0xBC, 0xA6),
    Colour(0x9B, 0x9A, 0x94),
    Colour(0x7F, 0x7A, 0x72),
    Colour(0xB3, 0xA7, 0x9A),
    Colour(0xD3, 0xC7, 0xB1),
    Colour(0x87, 0x70, 0x57),
    Colour(0xA9, 0xA4, 0x9B),
];
const PLATE: Colour = Colour(0xD0, 0xD6, 0xDD);

/// How the triangles of a view are coloured.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Paint {
    /// Each grain its own shade of rock.
    Rock,
    Displacement,
    Damage,
}

/// One of the pictures.
struct Shot {
    caption: String,
    triangles: Vec<Triangle>,
    towards: [f64; 3],
    paint: Paint,
}

impl Shot {
    fn of_rock(caption: String, triangles: Vec<Triangle>) -> Shot {
        Shot { caption, triangles, towards: TOWARDS_VIEWER, paint: Paint::Rock }
    }
}

/// A finished picture: its name, what it shows, its pixels.
pub struct Picture {
    pub stem: String,
    pub caption: String,
    pub image: Image,
}

/// All pictures of a run; none where no state was saved.
pub fn pictures(run: &Run) -> Result<Vec<Picture>> {
    if run.is_scene() {
        return Ok(scene(run)?.into_iter().collect());
    }
    let states = run.reader.saved_states()?;
    let Some(last) = states.len().checked_sub(1) else { return Ok(Vec::new()) };
    let cells = run.reader.saved_cells()?;
    let leading = run.leading_consolidations();
    // The first state after the consolidation, whose end strains count from.
    let first =
        states.iter().position(|s| s.time >= leading as f64 - 1e-9).filter(|&at| at < last).unwrap_or(0);
    let name = |state: usize| -> Result<String> {
        let increments = run.column("increment")?;
        let strain = run.column("axial_strain")?;
        let row = increments.iter().position(|&n| n as u64 == states[state].increment);
        let strain = row.and_then(|row| strain.get(row)).filter(|strain| strain.is_finite());
        Ok(match (states[state].increment, leading, strain) {
            (0, ..) => "start".into(),
            (_, 1.., _) if (states[state].time - leading as f64).abs() <= 1e-9 => "consolidated".into(),
            (_, _, Some(strain)) => format!("axial strain {} %", short(100.0 * strain)),
            (increment, ..) => format!("increment {increment}"),
        })
    };
    let before = Standing::of(&run.reader, &cells, first)?;
    let after = Standing::of(&run.reader, &cells, last)?;
    let distance: Vec<f64> = before.points.iter().zip(&after.points).map(|(a, b)| (b - a).norm()).collect();
    let middle = section_plane(&cells.points);
    let whole_and_cut = |name: &str, paint: Paint, quantity: Quantity<'_>| {
        let shot = |caption: String, plane: Option<f64>, towards: [f64; 3]| Shot {
            caption,
            triangles: after.triangles(quantity, plane),
            towards,
            paint,
        };
        [
            shot(name.into(), None, TOWARDS_VIEWER),
            shot(format!("section: {name}"), Some(middle), TOWARDS_SECTION),
        ]
    };
    let since = name(first)?;
    let mut shots = vec![Shot::of_rock(name(first)?, before.triangles(Quantity::Nothing, None))];
    if first < last {
        shots.push(Shot::of_rock(name(last)?, after.triangles(Quantity::Nothing, None)));
        shots.extend(whole_and_cut("displacement", Paint::Displacement, Quantity::OnPoints(&distance)));
    }
    let mut pictures = Vec::new();
    let moved = (first < last).then_some(&*since);
    let about = format!("{}: {}", run.label, of_specimen(moved));
    pictures.extend(composed(&format!("specimen_{}", run.stem), &about, &shots));
    let damage = run.reader.saved_field("CellData", "damage", last)?;
    let failed = run.reader.saved_field("CellData", "failed", last)?;
    let deleted = failed.iter().filter(|failed| **failed > 0.5).count();
    if damage.iter().any(|&d| d > 1e-6) || deleted > 0 {
        let shots = whole_and_cut("damage", Paint::Damage, Quantity::OnCells(&damage));
        let about = format!("{}: damage at the end; {deleted} cells are deleted", run.label);
        pictures.extend(composed(&format!("damage_{}", run.stem), &about, &shots));
    }
    Ok(pictures)
}

/// What a specimen's picture shows; `since` names the state that displacements count from.
fn of_specimen(since: Option<&str>) -> String {
    match since {
        None => "the specimen".into(),
        Some("start") => "the specimen, and how far its grains have moved since the start".into(),
        Some("consolidated") => {
            "the specimen, and how far its grains have moved since it was consolidated".into()
        }
        Some(state) => format!("the specimen, and how far its grains have moved since {state}"),
    }
}

/// Through the middle of all points [m].
fn section_plane(points: &[Vec3]) -> f64 {
    let low = points.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    let high = points.iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max);
    0.5 * (low + high)
}

/// The bodies of a scene at its start and at its end.
fn scene(run: &Run) -> Result<Option<Picture>> {
    let bodies = run.case.pointer("/scene/bodies").and_then(|value| value.as_array());
    let given = |name: &str| {
        let body = bodies?.iter().find(|body| body.get("name").and_then(|n| n.as_str()) == Some(name))?;
        Some(pose_of(numbers(body.get("position")?)?, numbers(body.get("rotation")?)?))
    };
    let mut last = Vec::new();
    for body in &run.summary.bodies {
        let row = |quantity: &str| -> Result<Option<[f64; 3]>> {
            let values = run.reader.floats(&format!("bodies/{body}/{quantity}"))?;
            let row = run.rows.checked_sub(1).and_then(|row| values.chunks_exact(3).nth(row));
            Ok(row.map(|x| [x[0], x[1], x[2]]))
        };
        if let (Some(position), Some(rotation)) = (row("position")?, row("rotation")?) {
            last.push((body.clone(), pose_of(position, rotation)));
        }
    }
    let end = |name: &str| last.iter().find(|(known, _)| known == name).map(|(_, pose)| *pose);
    let (triangles, left_out) = of_bodies(&run.case, given)?;
    let mut shots = vec![Shot::of_rock("start".into(), triangles)];
    if run.rows > 0 {
        shots.push(Shot::of_rock("end".into(), of_bodies(&run.case, end)?.0));
    }
    let mut about = format!("{}: the bodies", run.label);
    if left_out > 0 {
        about.push_str(&format!("; {left_out} whose shapes are mesh files or random grains are not shown"));
    }
    Ok(composed(&format!("scene_{}", run.stem), &about, &shots))
}

/// The pictures beside each other; `None` where there is nothing to see.
fn composed(stem: &str, about: &str, shots: &[Shot]) -> Option<Picture> {
    let mut size = [0.0_f64; 2];
    let mut views = Vec::new();
    for shot in shots {
        let view = View::from(Vec3::from(shot.towards));
        let [low, high] = view.extent(&shot.triangles);
        if !low.iter().chain(&high).all(|x| x.is_finite()) {
            return None;
        }
        size = [size[0].max(high[0] - low[0]), size[1].max(high[1] - low[1])];
        views.push((view, low, high));
    }
    // Common middles, so that the pictures can be compared, for those who look the same way.
    for at in 0..views.len() {
        let alike: Vec<_> = (0..views.len()).filter(|&k| shots[k].towards == shots[at].towards).collect();
        let (low, high) = (
            [0, 1].map(|k| alike.iter().map(|&v| views[v].1[k]).fold(f64::INFINITY, f64::min)),
            [0, 1].map(|k| alike.iter().map(|&v| views[v].2[k]).fold(f64::NEG_INFINITY, f64::max)),
        );
        views[at].0.middle = [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])];
        size = [size[0].max(high[0] - low[0]), size[1].max(high[1] - low[1])];
    }
    if shots.is_empty() || size.iter().any(|&s| s <= 0.0) {
        return None;
    }
    // So that one picture fits into 480 by 440 pixels, four into 1000.
    let room = [(1000.0 / shots.len() as f64 - 16.0).min(480.0), 440.0];
    let scale = 0.98 * (room[0] / size[0]).min(room[1] / size[1]);
    let cell = [(size[0] * scale / 0.98 + 14.0).ceil().max(150.0), (size[1] * scale / 0.98).ceil()];
    let painted = shots.iter().find(|shot| shot.paint != Paint::Rock).map(|shot| shot.paint);
    let bar = if painted.is_some() { 92.0 } else { 0.0 };
    let head = 34.0;
    let mut drawing = Drawing::new(cell[0] * shots.len() as f64 + bar, head + cell[1] + 8.0);
    let top = limit(shots);
    let mut under = Vec::new();
    for (at, (shot, (mut view, ..))) in shots.iter().zip(views).enumerate() {
        view.scale = scale * FINE;
        let pixels = cell.map(|length| (length * FINE) as usize);
        let colour = |owner: i64, value: f64| match (owner, shot.paint) {
            (..0, _) => PLATE,
            // A fixed shuffle, so that neighbours in number differ.
            (_, Paint::Rock) => ROCK[(owner as usize).wrapping_mul(7_919) / 3 % ROCK.len()],
            (_, Paint::Displacement) => viridis(value / top),
            (_, Paint::Damage) => heat(value),
        };
        let image = picture(&shot.triangles, &view, pixels, (1.1 * FINE) as usize, &colour);
        let left = cell[0] * at as f64;
        under.push(([left, head], image));
        let caption = fitted(&shot.caption, 13.0, cell[0] - 6.0);
        drawing.text([left + 0.5 * cell[0], 18.0], &caption, 13.0, BLACK, Anchor::Middle);
    }
    if let Some(paint) = painted {
        let (label, high, to_colour): (&str, f64, fn(f64) -> Colour) = match paint {
            Paint::Damage => ("damage [1]", 1.0, heat),
            Paint::Displacement | Paint::Rock => ("displacement [mm]", 1e3 * top, viridis),
        };
        let left = cell[0] * shots.len() as f64 + 14.0;
        let (from, to) = (head + 0.84 * cell[1], head + 0.2 * cell[1]);
        const STEPS: usize = 96;
        for step in 0..STEPS {
            let y = |k: usize| from + (to - from) * k as f64 / STEPS as f64;
            let (low, high) = (y(step), y(step + 1) - 0.3);
            let outline = vec![[left, low], [left + 14.0, low], [left + 14.0, high], [left, high]];
            drawing.area(outline, to_colour((step as f64 + 0.5) / STEPS as f64), 1.0);
        }
        let scale = Scale::of(&Axis::new("").from(0.0).to(high), std::iter::empty(), 5);
        for (&value, text) in scale.ticks.iter().zip(scale.labels()) {
            let y = from + (to - from) * scale.share(value);
            drawing.line(&[[left + 14.0, y], [left + 18.0, y]], Stroke::thin(AXIS));
            drawing.text([left + 22.0, y], text, 11.0, INK, Anchor::Left);
        }
        drawing.turned_text([left + 66.0, 0.5 * (from + to)], label, 12.0, INK);
    }
    let image = drawing.to_image(&under).ok()?;
    Some(Picture { stem: stem.into(), caption: about.into(), image })
}

/// The upper end of the displacement's colours: what 99.5 % of the corners on grains stay below.
fn limit(shots: &[Shot]) -> f64 {
    let mut values: Vec<f64> = shots
        .iter()
        .filter(|shot| shot.paint == Paint::Displacement)
        .flat_map(|shot| &shot.triangles)
        .filter(|triangle| triangle.owner >= 0)
        .flat_map(|triangle| triangle.values)
        .filter(|value| value.is_finite())
        .collect();
    values.sort_by(f64::total_cmp);
    let at = (values.len() as f64 * 0.995) as usize;
    values.get(at.min(values.len().saturating_sub(1))).copied().unwrap_or(0.0).max(1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn captions_read_as_sentences() {
        for (since, end) in [
            (None, "the specimen"),
            (Some("start"), "moved since the start"),
            (Some("consolidated"), "moved since it was consolidated"),
            (Some("axial strain 2 %"), "moved since axial strain 2 %"),
        ] {
            assert!(of_specimen(since).ends_with(end), "{since:?}: {}", of_specimen(since));
        }
    }
}
