//! Charts: panels of curves, bands, bars and points over axes, laid out into a `Drawing`.
//!
//! Panels stand below or beside each other and line up. The legend has rows of its own above them, so that it never covers
//! data. Nothing here knows what is shown: that is `curves`, `energy`, `fabric` and the like.

use super::axis::{Axis, Scale};
use super::drawing::{Anchor, Drawing, text_width};
use super::lettering::{folded, least_width, shortened, wrapped};
use super::note;
use super::palette::{AXIS, BLACK, Colour, GRID, INK, Stroke, WHITE};

const TITLE_SIZE: f64 = 15.0;
const LABEL_SIZE: f64 = 13.0;
const TICK_SIZE: f64 = 12.0;
/// Of most charts [px].
pub const WIDTH: f64 = 720.0;
/// Height of a title's line, and of a legend's row of one line [px].
const TITLE_LINE: f64 = 19.0;
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
    /// Words beside a point, above it where there is room; a line break parts their lines.
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

/// Right of a panel, and below its axis [px].
const RIGHT: f64 = 22.0;
const BELOW: f64 = 52.0;
/// What of a panel's width with its labels is beside its axes at most, about; titles and names of abscissae have the rest [px].
const SIDE: f64 = 100.0;
/// By how much the name of an ordinate may be longer than its axis, and from a text's first line to a second [px].
const OVERHANG: f64 = 30.0;
const LINE: f64 = 15.0;
/// Panels beside each other are no narrower than this [px].
const NARROWEST: f64 = 290.0;
/// A narrow chart is not lower than this share of its height, nor than the names of its ordinates ask for.
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
        chart.size[0] = width;
        let mut height = self.size[1] * share.max(LOWEST);
        if let Arrangement::Beside(columns) = self.arrangement {
            let columns = columns.clamp(1, self.panels.len().max(1));
            let fit = ((width / NARROWEST) as usize).clamp(1, columns);
            let rows = |columns: usize| self.panels.len().div_ceil(columns) as f64;
            height = self.size[1] * share.clamp(LOWEST, 1.0) / rows(columns).max(1.0) * rows(fit);
            chart.arrangement = Arrangement::Beside(fit);
        }
        chart.size[1] = height.max(chart.least_height());
        if let Some([x, y]) = self.beside {
            let lines = chart.below() - BELOW;
            let tall = |beside: f64| lines + y + (self.size[1] - y) * (width - beside) / (self.size[0] - x);
            chart.size[1] = tall(x);
            // Its room is none of the axes'.
            chart.size[1] = tall(x + chart.second_line());
        }
        chart.fold_notes();
        chart
    }

    /// Folds notes to the width of their panels. Ordinates with an end of their own get room for them above their points.
    fn fold_notes(&mut self) {
        let (room, heights) = (self.room(), self.heights());
        for (panel, height) in self.panels.iter_mut().zip(heights) {
            for layer in &mut panel.layers {
                let Layer::Note { at, text, .. } = layer else { continue };
                let lines = folded(text, TICK_SIZE, room - 20.0);
                let share = (note::ROOM + LINE * (lines.len() as f64 - 1.0)) / height;
                *text = lines.join("\n");
                if let (Some(high), false) = (&mut panel.y.high, panel.y.logarithmic) {
                    let low = panel.y.low.unwrap_or(0.0);
                    *high = high.max(low + (at[1] - low) / (1.0 - share).max(0.3));
                }
            }
        }
    }

    /// The height at which no name of an ordinate need be cut [px].
    fn least_height(&self) -> f64 {
        let needed = |panel: &Panel| (least_width(&panel.y.label, LABEL_SIZE) + 1.0 - OVERHANG).max(0.0);
        match self.arrangement {
            Arrangement::Stacked => {
                let weights = self.weights();
                let free = self.panels.iter().map(|panel| needed(panel) * weights / panel.weight.max(1e-9));
                self.below() + self.gaps() + free.fold(0.0, f64::max)
            }
            Arrangement::Beside(_) => {
                let cell = self.panels.iter().map(|panel| self.above(panel) + needed(panel) + self.below());
                self.rows() * cell.fold(0.0, f64::max)
            }
        }
    }

    /// How long the ordinates of the panels are [px].
    fn heights(&self) -> Vec<f64> {
        let height = |panel: &Panel| match self.arrangement {
            Arrangement::Stacked => {
                (self.size[1] - self.below() - self.gaps()).max(10.0) * panel.weight / self.weights()
            }
            Arrangement::Beside(_) => self.size[1] / self.rows() - self.above(panel) - self.below(),
        };
        self.panels.iter().map(height).collect()
    }

    /// The room of the second line of an ordinate's name, where one needs it [px].
    fn second_line(&self) -> f64 {
        let mut panels = self.panels.iter().zip(self.heights());
        let is_needed =
            panels.any(|(panel, height)| text_width(&panel.y.label, LABEL_SIZE) > height + OVERHANG);
        if is_needed { LINE } else { 0.0 }
    }

    fn weights(&self) -> f64 {
        self.panels.iter().map(|panel| panel.weight).sum::<f64>().max(1e-9)
    }

    /// Of stacked panels, what is above and between them [px].
    fn gaps(&self) -> f64 {
        self.panels.iter().map(|panel| self.above(panel) + 8.0).sum()
    }

    /// What is above a panel's axes [px].
    fn above(&self, panel: &Panel) -> f64 {
        match self.title_of(panel).len() {
            0 => 8.0,
            lines => 26.0 + LINE * (lines - 1) as f64,
        }
    }

    /// What is below axes whose abscissa is named [px].
    fn below(&self) -> f64 {
        let lines = self.panels.iter().map(|panel| self.name_of_abscissa(panel).len()).max();
        BELOW + LINE * (lines.unwrap_or(1) as f64 - 1.0)
    }

    /// The lines of a panel's title; none without one.
    fn title_of(&self, panel: &Panel) -> Vec<String> {
        match panel.title.as_str() {
            "" => Vec::new(),
            title => in_lines(title, LABEL_SIZE, self.room()),
        }
    }

    /// The lines of the name of a panel's abscissa.
    fn name_of_abscissa(&self, panel: &Panel) -> Vec<String> {
        in_lines(&panel.x.label, LABEL_SIZE, self.room())
    }

    /// Width of a panel's texts [px].
    fn room(&self) -> f64 {
        self.size[0] / self.columns() as f64 - SIDE
    }

    /// Panels beside each other.
    fn columns(&self) -> usize {
        match self.arrangement {
            Arrangement::Stacked => 1,
            Arrangement::Beside(columns) => columns.clamp(1, self.panels.len().max(1)),
        }
    }

    /// Rows of panels beside each other.
    fn rows(&self) -> f64 {
        self.panels.len().div_ceil(self.columns()).max(1) as f64
    }

    /// Lays the chart out.
    pub fn draw(&self) -> Drawing {
        let width = self.size[0];
        let legend = self.legend(width);
        let title = match self.title.as_str() {
            "" => Vec::new(),
            title => in_lines(title, TITLE_SIZE, width - 24.0),
        };
        let mut head = if title.is_empty() { 10.0 } else { 19.0 + TITLE_LINE * title.len() as f64 };
        let legend_height: f64 = legend.iter().map(|row| row_height(row)).sum();
        let mut drawing = Drawing::new(width, head + legend_height + self.size[1]);
        for (at, line) in title.iter().enumerate() {
            drawing.text([14.0, 22.0 + TITLE_LINE * at as f64], line, TITLE_SIZE, BLACK, Anchor::Left);
        }
        for row in &legend {
            draw_row(&mut drawing, row, head + 0.5 * LEGEND_ROW);
            head += row_height(row);
        }
        let scales = self.scales();
        for (panel, frame, (x, y), is_named) in self.frames(&scales, head) {
            let name = if is_named { self.name_of_abscissa(panel) } else { Vec::new() };
            panel.draw(&mut drawing, Axes { frame, x, y }, &name);
            let title = self.title_of(panel);
            for (at, line) in title.iter().enumerate() {
                let place = [frame.left, frame.top - 12.0 - LINE * (title.len() - 1 - at) as f64];
                drawing.text(place, line, LABEL_SIZE, BLACK, Anchor::Left);
            }
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
        let (heights, second_line) = (self.heights(), self.second_line());
        let margin = |y: &Scale| {
            let widest = y.labels().iter().map(|label| text_width(label, TICK_SIZE)).fold(0.0, f64::max);
            widest + 42.0 + second_line
        };
        let left = scales.iter().map(|(_, y)| margin(y)).fold(0.0, f64::max);
        let [width, height] = self.size;
        let mut frames = Vec::new();
        match self.arrangement {
            Arrangement::Stacked => {
                let mut top = head;
                for (at, (panel, (x, y))) in self.panels.iter().zip(scales).enumerate() {
                    top += self.above(panel);
                    let bottom = top + heights[at];
                    let frame = Frame { left, right: width - RIGHT, top, bottom };
                    frames.push((panel, frame, (x, y), at + 1 == self.panels.len()));
                    top = bottom + 8.0;
                }
            }
            Arrangement::Beside(_) => {
                let columns = self.columns();
                let cell = [width / columns as f64, height / self.rows()];
                for (at, (panel, (x, y))) in self.panels.iter().zip(scales).enumerate() {
                    let corner = [(at % columns) as f64 * cell[0], head + (at / columns) as f64 * cell[1]];
                    let top = corner[1] + self.above(panel);
                    let frame = Frame {
                        left: corner[0] + left,
                        right: corner[0] + cell[0] - RIGHT,
                        top,
                        bottom: top + heights[at],
                    };
                    frames.push((panel, frame, (x, y), true));
                }
            }
        }
        frames
    }

    /// The legend's entries in rows, each name once; none where there is nothing to tell apart.
    fn legend(&self, width: f64) -> Vec<Vec<Entry<'_>>> {
        let mut entries: Vec<(&Layer, String)> = Vec::new();
        for layer in self.panels.iter().flat_map(|panel| &panel.layers) {
            let label = layer.label();
            if !label.is_empty() && !entries.iter().any(|(_, known)| known == label) {
                entries.push((layer, label.to_string()));
            }
        }
        let mut rows: Vec<Vec<Entry<'_>>> = Vec::new();
        let mut used = f64::INFINITY;
        let mut cut: Vec<String> = Vec::new();
        // What is whole in most charts is so in a narrow one, in more lines.
        let most = width.max(WIDTH);
        for (layer, label) in entries {
            let short = legend_text(&label, most, 0.0);
            let alike = cut.iter().filter(|known| **known == short).count();
            // Where entries are alike their difference is in what was cut.
            let number = format!(" ({})", alike + 1);
            let label = match alike {
                0 => short.clone(),
                _ => legend_text(&label, most, text_width(&number, TICK_SIZE)) + &number,
            };
            cut.push(short);
            let lines = folded(&label, TICK_SIZE, room_of_entry(width));
            let needed = entry_width(&lines);
            match rows.last_mut() {
                Some(row) if used + needed <= width - 16.0 => row.push((layer, lines)),
                _ => {
                    rows.push(vec![(layer, lines)]);
                    used = 16.0;
                }
            }
            used += needed;
        }
        rows
    }
}

/// An entry of a legend: what it is of, and the lines of its label.
type Entry<'a> = (&'a Layer, Vec<String>);

fn entry_width(lines: &[String]) -> f64 {
    let widest = lines.iter().map(|line| text_width(line, TICK_SIZE)).fold(0.0, f64::max);
    SAMPLE + 7.0 + widest + 22.0
}

/// Height of a legend's row [px].
fn row_height(row: &[Entry<'_>]) -> f64 {
    let lines = row.iter().map(|(_, lines)| lines.len()).max().unwrap_or(1);
    LEGEND_ROW + LINE * (lines as f64 - 1.0)
}

/// Draws a legend's row, its first line at a height [px].
fn draw_row(drawing: &mut Drawing, row: &[Entry<'_>], y: f64) {
    let mut x = 16.0;
    for (layer, lines) in row {
        sample(drawing, layer, [x, y]);
        for (at, line) in lines.iter().enumerate() {
            let place = [x + SAMPLE + 7.0, y + LINE * at as f64];
            drawing.text(place, line, TICK_SIZE, INK, Anchor::Left);
        }
        x += entry_width(lines);
    }
}

/// A text in lines of this width [px]; what is longer than most charts are wide is cut in its middle first.
fn in_lines(text: &str, size: f64, width: f64) -> Vec<String> {
    folded(&shortened(text, size, width.max(WIDTH)), size, width)
}

/// What the legend of a chart `width` wide shows of a label that leaves `room` for more [px].
pub fn legend_text(label: &str, width: f64, room: f64) -> String {
    shortened(label, TICK_SIZE, room_of_entry(width) - room)
}

/// Width of a label in the legend of a chart `width` wide [px].
fn room_of_entry(width: f64) -> f64 {
    width - 32.0 - SAMPLE - 24.0
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

    fn draw(&self, drawing: &mut Drawing, axes: Axes<'_>, name: &[String]) {
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
        self.draw_axes(drawing, axes, name);
    }

    /// Both axes with their ticks and labels; the abscissa's are left out where its name is.
    fn draw_axes(&self, drawing: &mut Drawing, axes: Axes<'_>, name: &[String]) {
        let Axes { frame: Frame { left, right, top, bottom }, x, y } = axes;
        let (across, up) = (|x| axes.across(x), |y| axes.up(y));
        let axis = Stroke { width: 1.2, ..Stroke::thin(AXIS) };
        drawing.line(&[[left, top], [left, bottom], [right, bottom]], axis);
        // A label that would touch the one before is left out: from the high end, since decades are crowded below their powers.
        let mut free = f64::NEG_INFINITY;
        for (&value, label) in y.ticks.iter().zip(y.labels()).rev() {
            drawing.line(&[[left - 4.0, up(value)], [left, up(value)]], axis);
            if up(value) >= free {
                drawing.text([left - 8.0, up(value)], label, TICK_SIZE, INK, Anchor::Right);
                free = up(value) + TICK_SIZE;
            }
        }
        let mut free = f64::INFINITY;
        for (&value, label) in x.ticks.iter().zip(x.labels()).rev() {
            drawing.line(&[[across(value), bottom], [across(value), bottom + 4.0]], axis);
            let half = 0.5 * text_width(label, TICK_SIZE);
            if !name.is_empty() && across(value) + half < free {
                drawing.text([across(value), bottom + 15.0], label, TICK_SIZE, INK, Anchor::Middle);
                free = across(value) - half - 6.0;
            }
        }
        for (at, line) in name.iter().enumerate() {
            let place = [0.5 * (left + right), bottom + 36.0 + LINE * at as f64];
            drawing.text(place, line, LABEL_SIZE, INK, Anchor::Middle);
        }
        let widest = y.labels().iter().map(|label| text_width(label, TICK_SIZE)).fold(0.0, f64::max);
        // It reads upwards: the first line is the outer one.
        let lines = wrapped(&self.y.label, LABEL_SIZE, bottom - top + OVERHANG);
        for (at, line) in lines.iter().rev().enumerate() {
            let place = [left - widest - 24.0 - LINE * at as f64, 0.5 * (top + bottom)];
            drawing.turned_text(place, line, LABEL_SIZE, INK);
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
            let words: Vec<&str> = text.split('\n').collect();
            let width = words.iter().map(|line| text_width(line, TICK_SIZE)).fold(0.0, f64::max);
            let below = 0.5 * LINE * (words.len() as f64 - 1.0);
            let size = [width, TICK_SIZE + 2.0 * below];
            let [x, y] = note::place(place(at), size, &lines, &taken, panel);
            taken.push(note::around([x, y], size));
            for (at, line) in words.iter().enumerate() {
                let place = [x, y - below + LINE * at as f64];
                drawing.text(place, line, TICK_SIZE, *colour, Anchor::Middle);
            }
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
mod tests;
