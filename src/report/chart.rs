//! Charts: panels of curves, bands, bars and points over axes, laid out into a `Drawing`.
//!
//! Panels stand below or beside each other and line up. The legend has rows of its own above them, so that it never covers
//! data. Nothing here knows what is shown: that is `curves`, `energy`, `fabric` and the like.

use super::axis::{Axis, Scale};
use super::drawing::{Anchor, Drawing, text_width};
use super::note;
use super::palette::{AXIS, BLACK, Colour, GRID, INK, Stroke, WHITE};

const TITLE_SIZE: f64 = 15.0;
const LABEL_SIZE: f64 = 13.0;
const TICK_SIZE: f64 = 12.0;
/// Of most charts [px].
pub const WIDTH: f64 = 720.0;
/// Height of a legend's row [px].
const LEGEND_ROW: f64 = 21.0;
/// Length of a legend's sample [px].
const SAMPLE: f64 = 30.0;

/// Something over the axes of a panel.
#[derive(Debug, Clone, PartialEq)]
pub enum Layer {
    /// Points joined by a line; it breaks where one is not finite.
    Curve { label: String, points: Vec<[f64; 2]>, stroke: Stroke },
    /// Points each by itself.
    Points { label: String, points: Vec<[f64; 2]>, colour: Colour, radius: f64 },
    /// Between two curves over the same abscissae; named inside where it is thick enough.
    Band { label: String, low: Vec<[f64; 2]>, high: Vec<[f64; 2]>, colour: Colour },
    /// A level across the panel.
    Level { label: String, value: f64, stroke: Stroke },
    /// A word beside a point, above it where there is room.
    Note { at: [f64; 2], text: String, colour: Colour },
}

/// One pair of axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Above the panel; may be empty.
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    pub layers: Vec<Layer>,
    /// Share of the height among stacked panels.
    pub weight: f64,
}

impl Panel {
    pub fn new(x: Axis, y: Axis) -> Self {
        Panel { title: String::new(), x, y, layers: Vec::new(), weight: 1.0 }
    }
}

/// How panels stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arrangement {
    /// Below each other over one common abscissa, which the lowest names.
    Stacked,
    /// Side by side, each with its own axes, so many in a row.
    Beside(usize),
}

/// A chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    pub title: String,
    pub panels: Vec<Panel>,
    pub arrangement: Arrangement,
    /// Width and height of the panels with their labels [px]; title and legend come on top.
    pub size: [f64; 2],
    /// Where a unit has to be as long on both axes: what of the size is beside the axes [px].
    pub beside: Option<[f64; 2]>,
}

/// Panels beside each other are no narrower than this [px].
const NARROWEST: f64 = 290.0;
/// A narrow chart is not lower than this share of its height.
const LOWEST: f64 = 0.6;

/// Where a panel's axes are [px].
#[derive(Debug, Clone, Copy)]
struct Frame {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

/// A panel's axes, and where they are.
#[derive(Clone, Copy)]
struct Axes<'a> {
    frame: Frame,
    x: &'a Scale,
    y: &'a Scale,
}

impl Axes<'_> {
    /// Of an abscissa [px].
    fn across(&self, value: f64) -> f64 {
        self.frame.left + self.x.share(value) * (self.frame.right - self.frame.left)
    }

    /// Of an ordinate [px].
    fn up(&self, value: f64) -> f64 {
        self.frame.bottom - self.y.share(value) * (self.frame.bottom - self.frame.top)
    }

    fn place(&self, point: &[f64; 2]) -> [f64; 2] {
        [self.across(point[0]), self.up(point[1])]
    }
}

impl Chart {
    pub fn new(
        title: impl Into<String>,
        panels: Vec<Panel>,
        arrangement: Arrangement,
        size: [f64; 2],
    ) -> Self {
        Chart { title: title.into(), panels, arrangement, size, beside: None }
    }

    /// The same for a page's column so wide [px], its letters as large; panels that would be too narrow stand below each other.
    pub fn of_width(&self, width: f64) -> Chart {
        let share = width / self.size[0];
        let mut chart = self.clone();
        let mut height = self.size[1] * share.max(LOWEST);
        if let Arrangement::Beside(columns) = self.arrangement {
            let columns = columns.clamp(1, self.panels.len().max(1));
            let fit = ((width / NARROWEST) as usize).clamp(1, columns);
            let rows = |columns: usize| self.panels.len().div_ceil(columns) as f64;
            height = self.size[1] * share.clamp(LOWEST, 1.0) / rows(columns).max(1.0) * rows(fit);
            chart.arrangement = Arrangement::Beside(fit);
        }
        if let Some([x, y]) = self.beside {
            height = y + (self.size[1] - y) * (width - x) / (self.size[0] - x);
        }
        chart.size = [width, height];
        chart
    }

    /// Lays the chart out.
    pub fn draw(&self) -> Drawing {
        let width = self.size[0];
        let legend = self.legend(width);
        let title_height = if self.title.is_empty() { 10.0 } else { 38.0 };
        let legend_height = LEGEND_ROW * legend.len() as f64;
        let head = title_height + legend_height;
        let mut drawing = Drawing::new(width, head + self.size[1]);
        if !self.title.is_empty() {
            let title = shortened(&self.title, TITLE_SIZE, width - 24.0);
            drawing.text([14.0, 22.0], &title, TITLE_SIZE, BLACK, Anchor::Left);
        }
        for (row, entries) in legend.iter().enumerate() {
            let mut x = 16.0;
            let y = title_height + LEGEND_ROW * (row as f64 + 0.5);
            for (layer, label) in entries {
                sample(&mut drawing, layer, [x, y]);
                drawing.text([x + SAMPLE + 7.0, y], label, TICK_SIZE, INK, Anchor::Left);
                x += entry_width(label);
            }
        }
        let scales = self.scales();
        for (panel, frame, (x, y), below) in self.frames(&scales, head) {
            panel.draw(&mut drawing, Axes { frame, x, y }, below);
        }
        drawing
    }

    fn scales(&self) -> Vec<(Scale, Scale)> {
        let common = match self.arrangement {
            Arrangement::Stacked => self.panels.first().map(|first| {
                let all = self.panels.iter().flat_map(|panel| panel.values(0));
                Scale::of(&first.x, all, 8)
            }),
            Arrangement::Beside(_) => None,
        };
        let rows = match self.arrangement {
            Arrangement::Stacked => self.panels.len(),
            Arrangement::Beside(columns) => self.panels.len().div_ceil(columns.max(1)),
        };
        let columns = self.panels.len().div_ceil(rows.max(1)).max(1);
        let weights: f64 = self.panels.iter().map(|panel| panel.weight).sum();
        let wide = self.size[0] / columns as f64 / 95.0;
        let each = |panel: &Panel| {
            let share = match self.arrangement {
                Arrangement::Stacked => panel.weight / weights.max(1e-9),
                Arrangement::Beside(_) => 1.0 / rows.max(1) as f64,
            };
            let tall = self.size[1] * share / 52.0;
            let x = common
                .clone()
                .unwrap_or_else(|| Scale::of(&panel.x, panel.values(0).into_iter(), wide as usize));
            (x, Scale::of(&panel.y, panel.values(1).into_iter(), tall as usize))
        };
        self.panels.iter().map(each).collect()
    }

    /// Each panel with its frame, its scales and whether its abscissa is named.
    fn frames<'a>(
        &'a self,
        scales: &'a [(Scale, Scale)],
        head: f64,
    ) -> Vec<(&'a Panel, Frame, (&'a Scale, &'a Scale), bool)> {
        let margin = |y: &Scale| {
            let widest = y.labels().iter().map(|label| text_width(label, TICK_SIZE)).fold(0.0, f64::max);
            widest + 42.0
        };
        let left = scales.iter().map(|(_, y)| margin(y)).fold(0.0, f64::max);
        let [width, height] = self.size;
        let (right, below) = (22.0, 52.0);
        let title = |panel: &Panel| if panel.title.is_empty() { 8.0 } else { 26.0 };
        let mut frames = Vec::new();
        match self.arrangement {
            Arrangement::Stacked => {
                let gaps: f64 = self.panels.iter().map(title).sum::<f64>() + 8.0 * self.panels.len() as f64;
                let weights: f64 = self.panels.iter().map(|panel| panel.weight).sum();
                let free = (height - below - gaps).max(10.0);
                let mut top = head;
                for (at, (panel, (x, y))) in self.panels.iter().zip(scales).enumerate() {
                    top += title(panel);
                    let bottom = top + free * panel.weight / weights.max(1e-9);
                    let frame = Frame { left, right: width - right, top, bottom };
                    frames.push((panel, frame, (x, y), at + 1 == self.panels.len()));
                    top = bottom + 8.0;
                }
            }
            Arrangement::Beside(columns) => {
                let columns = columns.clamp(1, self.panels.len().max(1));
                let rows = self.panels.len().div_ceil(columns);
                let cell = [width / columns as f64, height / rows.max(1) as f64];
                for (at, (panel, (x, y))) in self.panels.iter().zip(scales).enumerate() {
                    let corner = [(at % columns) as f64 * cell[0], head + (at / columns) as f64 * cell[1]];
                    let frame = Frame {
                        left: corner[0] + left,
                        right: corner[0] + cell[0] - right,
                        top: corner[1] + title(panel),
                        bottom: corner[1] + cell[1] - below,
                    };
                    frames.push((panel, frame, (x, y), true));
                }
            }
        }
        frames
    }

    /// The legend's entries in rows, each name once; none where there is nothing to tell apart.
    fn legend(&self, width: f64) -> Vec<Vec<(&Layer, String)>> {
        let mut entries: Vec<(&Layer, String)> = Vec::new();
        for layer in self.panels.iter().flat_map(|panel| &panel.layers) {
            let label = layer.label();
            if !label.is_empty() && !entries.iter().any(|(_, known)| known == label) {
                entries.push((layer, label.to_string()));
            }
        }
        let mut rows: Vec<Vec<(&Layer, String)>> = Vec::new();
        let mut used = f64::INFINITY;
        let mut cut: Vec<String> = Vec::new();
        for (layer, label) in entries {
            let short = legend_text(&label, width, 0.0);
            let alike = cut.iter().filter(|known| **known == short).count();
            // Where entries are alike their difference is in what was cut.
            let number = format!(" ({})", alike + 1);
            let label = match alike {
                0 => short.clone(),
                _ => legend_text(&label, width, text_width(&number, TICK_SIZE)) + &number,
            };
            cut.push(short);
            let needed = entry_width(&label);
            match rows.last_mut() {
                Some(row) if used + needed <= width - 16.0 => row.push((layer, label)),
                _ => {
                    rows.push(vec![(layer, label)]);
                    used = 16.0;
                }
            }
            used += needed;
        }
        rows
    }
}

fn entry_width(label: &str) -> f64 {
    SAMPLE + 7.0 + text_width(label, TICK_SIZE) + 22.0
}

/// The text, cut with an ellipsis to `width` [px].
pub fn fitted(text: &str, size: f64, width: f64) -> String {
    if text_width(text, size) <= width {
        return text.to_string();
    }
    let mut kept: String = text.to_string();
    while !kept.is_empty() && text_width(&kept, size) + size > width {
        kept.pop();
    }
    kept.trim_end().to_string() + "…"
}

/// The text, its middle cut out to `width` [px], since names often differ at their ends.
fn shortened(text: &str, size: f64, width: f64) -> String {
    if text_width(text, size) <= width {
        return text.to_string();
    }
    let letters: Vec<char> = text.chars().collect();
    let cut = |kept: usize| -> String {
        let (head, tail) = (&letters[..kept.div_ceil(2)], &letters[letters.len() - kept / 2..]);
        let [head, tail] = [head, tail].map(|part| part.iter().collect::<String>());
        format!("{}…{}", head.trim_end(), tail.trim_start())
    };
    let fits = |kept: &usize| text_width(&cut(*kept), size) <= width;
    cut((0..letters.len()).rev().find(fits).unwrap_or(0))
}

/// What the legend of a chart `width` wide shows of a label that leaves `room` for more [px].
pub fn legend_text(label: &str, width: f64, room: f64) -> String {
    shortened(label, TICK_SIZE, width - 32.0 - SAMPLE - 24.0 - room)
}

fn sample(drawing: &mut Drawing, layer: &Layer, [x, y]: [f64; 2]) {
    match layer {
        Layer::Curve { stroke, .. } | Layer::Level { stroke, .. } => {
            drawing.line(&[[x, y], [x + SAMPLE, y]], *stroke);
        }
        Layer::Points { colour, radius, .. } => drawing.disc([x + 0.5 * SAMPLE, y], *radius, *colour),
        Layer::Band { colour, .. } => {
            drawing.area(rectangle(x + 6.0, y - 6.0, x + SAMPLE, y + 6.0), *colour, 1.0);
        }
        Layer::Note { .. } => {}
    }
}

fn rectangle(left: f64, top: f64, right: f64, bottom: f64) -> Vec<[f64; 2]> {
    vec![[left, top], [right, top], [right, bottom], [left, bottom]]
}

impl Layer {
    fn label(&self) -> &str {
        match self {
            Layer::Curve { label, .. }
            | Layer::Points { label, .. }
            | Layer::Band { label, .. }
            | Layer::Level { label, .. } => label,
            Layer::Note { .. } => "",
        }
    }

    /// Its abscissae (axis 0) or ordinates (axis 1).
    fn values(&self, axis: usize) -> Vec<f64> {
        let of = |points: &[[f64; 2]]| points.iter().map(|p| p[axis]).collect::<Vec<_>>();
        match self {
            Layer::Curve { points, .. } | Layer::Points { points, .. } => of(points),
            Layer::Band { low, high, .. } => [of(low), of(high)].concat(),
            Layer::Level { value, .. } if axis == 1 => vec![*value],
            Layer::Level { .. } | Layer::Note { .. } => Vec::new(),
        }
    }

    fn draw(&self, drawing: &mut Drawing, axes: Axes<'_>) {
        let Frame { left, right, .. } = axes.frame;
        let place = |p: &[f64; 2]| axes.place(p);
        match self {
            Layer::Band { low, high, colour, .. } => {
                let outline: Vec<_> = low.iter().chain(high.iter().rev()).map(place).collect();
                drawing.area(outline, *colour, 1.0);
                drawing.line(
                    &high.iter().map(place).collect::<Vec<_>>(),
                    Stroke { width: 1.2, ..Stroke::thin(WHITE) },
                );
            }
            Layer::Level { value, stroke, .. } => {
                drawing.line(&[[left, axes.up(*value)], [right, axes.up(*value)]], *stroke);
            }
            Layer::Curve { points, stroke, .. } => {
                drawing.line(&points.iter().map(place).collect::<Vec<_>>(), *stroke);
            }
            Layer::Points { points, colour, radius, .. } => {
                for point in points {
                    drawing.disc(place(point), *radius, *colour);
                }
            }
            Layer::Note { .. } => {}
        }
    }
}

/// The lines behind everything.
fn draw_grid(drawing: &mut Drawing, axes: Axes<'_>) {
    let Axes { frame: Frame { left, right, top, bottom }, x, y } = axes;
    let (across, up) = (|x| axes.across(x), |y| axes.up(y));
    let faint = Stroke { width: 0.5, ..Stroke::thin(GRID) };
    for (x, y, stroke) in [(&x.minor, &y.minor, faint), (&x.ticks, &y.ticks, Stroke::thin(GRID))] {
        for &value in x {
            drawing.line(&[[across(value), top], [across(value), bottom]], stroke);
        }
        for &value in y {
            drawing.line(&[[left, up(value)], [right, up(value)]], stroke);
        }
    }
    // Zero is worth a line where values lie on both of its sides.
    if !y.logarithmic && y.low < 0.0 && y.high > 0.0 {
        drawing.line(&[[left, up(0.0)], [right, up(0.0)]], Stroke::thin(AXIS));
    }
}

impl Panel {
    /// All abscissae (axis 0) or ordinates (axis 1).
    pub fn values(&self, axis: usize) -> Vec<f64> {
        self.layers.iter().flat_map(|layer| layer.values(axis)).collect()
    }

    /// The largest ordinate; minus infinity where there is none.
    pub fn highest(&self) -> f64 {
        self.values(1).into_iter().filter(|x| x.is_finite()).fold(f64::NEG_INFINITY, f64::max)
    }

    fn draw(&self, drawing: &mut Drawing, axes: Axes<'_>, below: bool) {
        let place = |p: &[f64; 2]| axes.place(p);
        draw_grid(drawing, axes);
        for layer in &self.layers {
            layer.draw(drawing, axes);
        }
        self.notes(drawing, axes.frame, &place);
        // Where there are curves a name would lie on one.
        let curves = self.layers.iter().any(|layer| matches!(layer, Layer::Curve { .. }));
        for layer in self.layers.iter().filter(|_| !curves) {
            name_inside(drawing, layer, &place);
        }
        self.draw_axes(drawing, axes, below);
    }

    /// Both axes with their ticks and labels, named below where that is asked for, and the title.
    fn draw_axes(&self, drawing: &mut Drawing, axes: Axes<'_>, below: bool) {
        let Axes { frame: Frame { left, right, top, bottom }, x, y } = axes;
        let (across, up) = (|x| axes.across(x), |y| axes.up(y));
        let axis = Stroke { width: 1.2, ..Stroke::thin(AXIS) };
        drawing.line(&[[left, top], [left, bottom], [right, bottom]], axis);
        for (&value, label) in y.ticks.iter().zip(y.labels()) {
            drawing.line(&[[left - 4.0, up(value)], [left, up(value)]], axis);
            drawing.text([left - 8.0, up(value)], label, TICK_SIZE, INK, Anchor::Right);
        }
        let mut free = f64::NEG_INFINITY;
        for (&value, label) in x.ticks.iter().zip(x.labels()) {
            drawing.line(&[[across(value), bottom], [across(value), bottom + 4.0]], axis);
            let half = 0.5 * text_width(label, TICK_SIZE);
            // A label that would touch the one before is left out.
            if below && across(value) - half > free {
                drawing.text([across(value), bottom + 15.0], label, TICK_SIZE, INK, Anchor::Middle);
                free = across(value) + half + 6.0;
            }
        }
        if below {
            let middle = 0.5 * (left + right);
            drawing.text([middle, bottom + 36.0], &self.x.label, LABEL_SIZE, INK, Anchor::Middle);
        }
        let widest = y.labels().iter().map(|label| text_width(label, TICK_SIZE)).fold(0.0, f64::max);
        let label = fitted(&self.y.label, LABEL_SIZE, bottom - top + 30.0);
        drawing.turned_text([left - widest - 24.0, 0.5 * (top + bottom)], &label, LABEL_SIZE, INK);
        if !self.title.is_empty() {
            let title = fitted(&self.title, LABEL_SIZE, right - left + 20.0);
            drawing.text([left, top - 12.0], &title, LABEL_SIZE, BLACK, Anchor::Left);
        }
    }

    /// Words beside their points, clear of curves, marks and each other.
    fn notes(&self, drawing: &mut Drawing, frame: Frame, place: &impl Fn(&[f64; 2]) -> [f64; 2]) {
        let mut lines: Vec<Vec<[f64; 2]>> = Vec::new();
        for layer in &self.layers {
            match layer {
                Layer::Curve { points, .. } => lines.push(points.iter().map(place).collect()),
                Layer::Points { points, .. } => lines.extend(points.iter().map(|point| vec![place(point)])),
                Layer::Band { .. } | Layer::Level { .. } | Layer::Note { .. } => {}
            }
        }
        let panel = [frame.left, frame.top, frame.right, frame.bottom];
        let mut taken = Vec::new();
        for layer in &self.layers {
            let Layer::Note { at, text, colour } = layer else { continue };
            let width = text_width(text, TICK_SIZE);
            let middle = note::place(place(at), width, TICK_SIZE, &lines, &taken, panel);
            taken.push(note::around(middle, width, TICK_SIZE));
            drawing.text(middle, text, TICK_SIZE, *colour, Anchor::Middle);
        }
    }
}

/// Writes a band's name where the band is thickest, if it fits.
fn name_inside(drawing: &mut Drawing, layer: &Layer, place: &impl Fn(&[f64; 2]) -> [f64; 2]) {
    let Layer::Band { label, low, high, colour } = layer else { return };
    let half = 0.5 * text_width(label, TICK_SIZE) + 6.0;
    let pairs: Vec<([f64; 2], [f64; 2])> = low.iter().map(place).zip(high.iter().map(place)).collect();
    let (Some(first), Some(last)) = (pairs.first(), pairs.last()) else { return };
    // Room over the width of the word: the band must hold it everywhere below it.
    let room = |x: f64| {
        let under = pairs.iter().filter(|(a, _)| (a[0] - x).abs() <= half);
        let (top, bottom) = under.fold((f64::NEG_INFINITY, f64::INFINITY), |(top, bottom), (low, high)| {
            (top.max(high[1]), bottom.min(low[1]))
        });
        (bottom - top, 0.5 * (top + bottom))
    };
    let (from, to) = (first.0[0] + half, last.0[0] - half);
    let middle = 0.5 * (from + to);
    // Nearly as thick will do, if it is nearer to the middle.
    let merit = |thick: f64, x: f64| thick.min(60.0) - 0.02 * (x - middle).abs();
    let best = (0..=40)
        .map(|k| from + (to - from) * f64::from(k) / 40.0)
        .filter(|&x| x >= from && x <= to)
        .map(|x| (room(x), x))
        .filter(|((thick, _), _)| thick.is_finite())
        .max_by(|a, b| merit(a.0.0, a.1).total_cmp(&merit(b.0.0, b.1)));
    if let Some(((thick, y), x)) = best
        && thick >= 17.0
    {
        let Colour(r, g, b) = *colour;
        let light = 0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b);
        let ink = if light > 120.0 { BLACK } else { WHITE };
        drawing.text([x, y], label, TICK_SIZE, ink, Anchor::Middle);
    }
}

#[cfg(test)]
mod tests {
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
                            false => [
                                at[0] - shift * long,
                                at[1] - half,
                                at[0] + (1.0 - shift) * long,
                                at[1] + half,
                            ],
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
                    "{text}"
                );
                for (b, other) in &boxes[..k] {
                    let apart = a[0] >= b[2] || b[0] >= a[2] || a[1] >= b[3] || b[1] >= a[3];
                    assert!(apart, "{arrangement:?}: {text:?} {a:?} on {other:?} {b:?}");
                }
            }
        }
    }

    #[test]
    fn long_texts_are_cut() {
        let cut = fitted(&"very ".repeat(60), 12.0, 200.0);
        assert!(cut.ends_with('…') && text_width(&cut, 12.0) <= 200.0, "{cut}");
        let cut = shortened(&format!("first {}last", "very ".repeat(60)), 12.0, 200.0);
        assert!(cut.starts_with("first ") && cut.ends_with(" last"), "{cut}");
        assert!(cut.contains('…') && text_width(&cut, 12.0) <= 200.0, "{cut}");
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
        let mut labels: Vec<String> =
            chart.legend(WIDTH).into_iter().flatten().map(|(_, label)| label).collect();
        assert!(labels.iter().all(|label| entry_width(label) <= WIDTH - 16.0), "{labels:?}");
        labels.dedup();
        assert_eq!(labels.len(), 3, "{labels:?}");
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
}
