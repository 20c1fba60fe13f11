//! A drawing as a list of marks, and its way into SVG and PNG.
//!
//! Charts are laid out once, in pixels of [`Drawing::size`] with y downwards; both formats are painted from the same
//! marks by plotters' backends. Those take whole pixels, so marks are painted four times larger: an SVG is then exact to
//! a quarter of a pixel, and a PNG, averaged over two by two, has twice the drawing's pixels and smooth edges. For print marks are
//! painted larger still. Texts are measured and rasterised with the embedded font; an SVG leaves them as text.

use std::sync::OnceLock;

use plotters::prelude::{BitMapBackend, DrawingBackend, RGBColor, SVGBackend, ShapeStyle};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontStyle, FontTransform, IntoFont, TextStyle, register_font};

use crate::error::{Error, Result};

use super::image::Image;
use super::palette::{Colour, Dash, Stroke, WHITE};

/// Backend pixels per drawing pixel, but for print.
const SCALE: f64 = 4.0;
/// Backend pixels averaged along a PNG pixel's edge.
const AVERAGED: usize = 2;
/// PNG pixels per drawing pixel.
pub const PNG_SCALE: f64 = SCALE / AVERAGED as f64;
/// Pixels an inch of a drawing, and of its PNG in print.
const PER_INCH: f64 = 96.0;
pub const PRINT: f64 = 300.0;

const FONT: &str = "sans-serif";
/// What viewers of an SVG take: nearly the widths of the embedded font.
const SVG_FONTS: &str = "DejaVu Sans, Verdana, Helvetica, Arial, sans-serif";
static FONT_BYTES: &[u8] = include_bytes!("font/DejaVuSans-subset.ttf");
/// Height of the font's line over its em, which is what ab_glyph scales by.
const LINE_OVER_EM: f64 = 1.164;
/// What plotters-svg divides sizes by.
const SVG_OVER_EM: f64 = 1.24;

/// Where a text lies about its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    Left,
    Middle,
    Right,
}

/// Something drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Mark {
    Line {
        points: Vec<[f64; 2]>,
        stroke: Stroke,
    },
    Area {
        points: Vec<[f64; 2]>,
        colour: Colour,
        opacity: f64,
    },
    Disc {
        centre: [f64; 2],
        radius: f64,
        colour: Colour,
    },
    /// `at` is at half the height of the letter x; a turned text reads upwards.
    Text {
        at: [f64; 2],
        text: String,
        size: f64,
        colour: Colour,
        anchor: Anchor,
        turned: bool,
    },
}

/// A picture in the making.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Drawing {
    /// Width and height [px].
    pub size: [f64; 2],
    pub marks: Vec<Mark>,
}

impl Drawing {
    pub fn new(width: f64, height: f64) -> Self {
        Drawing { size: [width, height], marks: Vec::new() }
    }

    /// A line; it breaks where a point is not finite.
    pub fn line(&mut self, points: &[[f64; 2]], stroke: Stroke) {
        for run in points.split(|p| !p[0].is_finite() || !p[1].is_finite()) {
            if run.len() > 1 {
                self.marks.push(Mark::Line { points: run.to_vec(), stroke });
            }
        }
    }

    pub fn area(&mut self, points: Vec<[f64; 2]>, colour: Colour, opacity: f64) {
        if points.len() > 2 && points.iter().flatten().all(|x| x.is_finite()) {
            self.marks.push(Mark::Area { points, colour, opacity });
        }
    }

    pub fn disc(&mut self, centre: [f64; 2], radius: f64, colour: Colour) {
        if centre.iter().all(|x| x.is_finite()) {
            self.marks.push(Mark::Disc { centre, radius, colour });
        }
    }

    pub fn text(&mut self, at: [f64; 2], text: &str, size: f64, colour: Colour, anchor: Anchor) {
        self.marks.push(Mark::Text { at, text: drawable(text), size, colour, anchor, turned: false });
    }

    pub fn turned_text(&mut self, at: [f64; 2], text: &str, size: f64, colour: Colour) {
        let anchor = Anchor::Middle;
        self.marks.push(Mark::Text { at, text: drawable(text), size, colour, anchor, turned: true });
    }

    /// The drawing as an SVG document.
    pub fn to_svg(&self) -> Result<String> {
        let mut text = String::new();
        let [width, height] = self.backend_size(SCALE);
        {
            let mut backend = SVGBackend::with_string(&mut text, (width, height));
            background(&mut backend)?;
            for mark in &self.marks {
                paint(&mut backend, mark, Format::Svg, SCALE)?;
            }
            backend.present().map_err(|e| fault(&e))?;
        }
        // Shown at the drawing's size; the view box keeps the finer pixels.
        let [shown_width, shown_height] = self.size.map(f64::ceil);
        let text = text.replacen(
            &format!("width=\"{width}\" height=\"{height}\""),
            &format!("width=\"{shown_width}\" height=\"{shown_height}\""),
            1,
        );
        Ok(text.replace(&format!("font-family=\"{FONT}\""), &format!("font-family=\"{SVG_FONTS}\"")))
    }

    /// The drawing as pixels, [`PNG_SCALE`] times as many as its own along each edge. `under` is put below it, its
    /// upper left corner at a point of the drawing, its pixels those of the result times [`AVERAGED`].
    pub fn to_image(&self, under: &[([f64; 2], Image)]) -> Result<Image> {
        self.painted(SCALE, under)
    }

    /// The drawing as pixels of a figure in print, [`PRINT`] an inch.
    pub fn to_print(&self) -> Result<Image> {
        self.painted(PRINT / PER_INCH * AVERAGED as f64, &[])
    }

    fn painted(&self, scale: f64, under: &[([f64; 2], Image)]) -> Result<Image> {
        let [width, height] = self.backend_size(scale);
        let mut image = Image::new(width as usize, height as usize, WHITE);
        for (at, picture) in under {
            image.put([(at[0] * scale) as usize, (at[1] * scale) as usize], picture);
        }
        {
            let mut backend = BitMapBackend::with_buffer(&mut image.pixels, (width, height));
            for mark in &self.marks {
                paint(&mut backend, mark, Format::Bitmap, scale)?;
            }
            backend.present().map_err(|e| fault(&e))?;
        }
        Ok(image.averaged(AVERAGED))
    }

    fn backend_size(&self, scale: f64) -> [u32; 2] {
        // Whole averages.
        let whole = |x: f64| (x * scale / AVERAGED as f64).ceil() as u32 * AVERAGED as u32;
        self.size.map(|x| whole(x.ceil().clamp(1.0, 8192.0)))
    }
}

/// Width of a text [px], as wide as the embedded font makes it.
pub fn text_width(text: &str, size: f64) -> f64 {
    let _ = font_is_there();
    // In large pixels, since the layout counts whole ones.
    let measured = (FONT, 100.0 * LINE_OVER_EM).into_font().box_size(text);
    measured.map_or(0.6 * size * text.chars().count() as f64, |(width, _)| f64::from(width) * size / 100.0)
}

/// A text without the control characters that no SVG may hold.
fn drawable(text: &str) -> String {
    text.replace(char::is_control, "\u{fffd}")
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Svg,
    Bitmap,
}

fn font_is_there() -> Result<()> {
    static REGISTERED: OnceLock<bool> = OnceLock::new();
    let registered = REGISTERED.get_or_init(|| register_font(FONT, FontStyle::Normal, FONT_BYTES).is_ok());
    match registered {
        true => Ok(()),
        false => Err(Error::Usage("the font of the charts cannot be read: please report this".into())),
    }
}

fn fault(error: &impl std::fmt::Display) -> Error {
    Error::Usage(format!("a chart cannot be drawn: {error}"))
}

fn background<B: DrawingBackend>(backend: &mut B) -> Result<()> {
    let (width, height) = backend.get_size();
    let white = ShapeStyle::from(&RGBColor(255, 255, 255)).filled();
    backend.draw_rect((0, 0), (width as i32, height as i32), &white, true).map_err(|e| fault(&e))
}

/// `scale` is the backend's pixels per drawing pixel.
fn paint<B: DrawingBackend>(backend: &mut B, mark: &Mark, format: Format, scale: f64) -> Result<()> {
    let place = |p: &[f64; 2]| ((p[0] * scale).round() as i32, (p[1] * scale).round() as i32);
    let rgb = |c: Colour| RGBColor(c.0, c.1, c.2);
    match mark {
        Mark::Line { points, stroke } => {
            let width = (stroke.width * scale).round().max(1.0);
            let style = ShapeStyle::from(&rgb(stroke.colour)).stroke_width(width as u32);
            for piece in dashed(points, stroke.dash) {
                // The bitmap's own thick lines have gaps and spikes at sharp turns.
                if format == Format::Bitmap && width > 1.5 {
                    let piece: Vec<[f64; 2]> = piece.iter().map(|p| p.map(|x| x * scale)).collect();
                    thick_line(backend, &piece, 0.5 * width, stroke.colour)?;
                    continue;
                }
                backend.draw_path(piece.iter().map(place), &style).map_err(|e| fault(&e))?;
            }
            Ok(())
        }
        Mark::Area { points, colour, opacity } => {
            let style = ShapeStyle::from(&rgb(*colour).mix(*opacity)).filled();
            backend.fill_polygon(points.iter().map(place), &style).map_err(|e| fault(&e))
        }
        Mark::Disc { centre, radius, colour } => {
            let radius = (radius * scale).round().max(1.0) as u32;
            let style = ShapeStyle::from(&rgb(*colour)).filled();
            backend.draw_circle(place(centre), radius, &style, true).map_err(|e| fault(&e))
        }
        Mark::Text { at, text, size, colour, anchor, turned } => {
            font_is_there()?;
            let em = size * scale;
            let h_pos = match anchor {
                Anchor::Left => HPos::Left,
                Anchor::Middle => HPos::Center,
                Anchor::Right => HPos::Right,
            };
            let transform = if *turned { FontTransform::Rotate270 } else { FontTransform::None };
            let font_size = em * if format == Format::Svg { SVG_OVER_EM } else { LINE_OVER_EM };
            let font = (FONT, font_size).into_font().transform(transform);
            let colour = rgb(*colour);
            let style = TextStyle::from(font).color(&colour).pos(Pos::new(h_pos, VPos::Center));
            let (mut x, mut y) = place(at);
            if format == Format::Bitmap {
                // plotters sets the baseline at half the size below a box of size / 1.24.
                let lift = 0.27 * em - font_size * (0.5 - 0.5 / SVG_OVER_EM);
                match turned {
                    true => x += lift.round() as i32,
                    false => y += lift.round() as i32,
                }
            }
            backend.draw_text(text, &style, (x, y)).map_err(|e| fault(&e))
        }
    }
}

/// A line as quads and discs of its half width, all in backend pixels.
fn thick_line<B: DrawingBackend>(
    backend: &mut B,
    points: &[[f64; 2]],
    half: f64,
    colour: Colour,
) -> Result<()> {
    let style = ShapeStyle::from(&RGBColor(colour.0, colour.1, colour.2)).filled();
    let whole = |x: f64, y: f64| (x.round() as i32, y.round() as i32);
    for (at, pair) in points.windows(2).enumerate() {
        let [a, b] = [pair[0], pair[1]];
        let along = [b[0] - a[0], b[1] - a[1]];
        let length = along[0].hypot(along[1]);
        if length < 1e-9 {
            continue;
        }
        let [x, y] = [-along[1] * half / length, along[0] * half / length];
        let corners = [
            whole(a[0] + x, a[1] + y),
            whole(b[0] + x, b[1] + y),
            whole(b[0] - x, b[1] - y),
            whole(a[0] - x, a[1] - y),
        ];
        backend.fill_polygon(corners, &style).map_err(|e| fault(&e))?;
        if at > 0 && half >= 1.0 {
            backend.draw_circle(whole(a[0], a[1]), half as u32, &style, true).map_err(|e| fault(&e))?;
        }
    }
    Ok(())
}

/// The pieces of a line that a dash leaves.
fn dashed(points: &[[f64; 2]], dash: Dash) -> Vec<Vec<[f64; 2]>> {
    if dash.is_empty() || dash.iter().any(|&length| length <= 0.0) {
        return vec![points.to_vec()];
    }
    let Some(&first) = points.first() else { return Vec::new() };
    let mut pieces = vec![vec![first]];
    let (mut number, mut left) = (0, dash[0]);
    for pair in points.windows(2) {
        let (mut from, to) = (pair[0], pair[1]);
        loop {
            let rest = (to[0] - from[0]).hypot(to[1] - from[1]);
            if rest <= left {
                left -= rest;
                if number % 2 == 0
                    && let Some(piece) = pieces.last_mut()
                {
                    piece.push(to);
                }
                break;
            }
            let share = left / rest;
            from = [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])];
            match number % 2 == 0 {
                true => {
                    if let Some(piece) = pieces.last_mut() {
                        piece.push(from);
                    }
                }
                false => pieces.push(vec![from]),
            }
            number += 1;
            left = dash[number % dash.len()];
        }
    }
    pieces.retain(|piece| piece.len() > 1);
    pieces
}

#[cfg(test)]
mod tests {
    use super::super::palette::{DASHED, FULL, INK};
    use super::*;

    #[test]
    fn dashes_have_their_lengths() {
        let pieces = dashed(&[[0.0, 0.0], [3.0, 0.0], [40.0, 0.0]], DASHED);
        let ends: Vec<[f64; 2]> =
            pieces.iter().map(|piece| [piece[0][0], piece[piece.len() - 1][0]]).collect();
        assert_eq!(ends, [[0.0, 7.0], [10.5, 17.5], [21.0, 28.0], [31.5, 38.5]]);
        assert_eq!(dashed(&[[0.0, 0.0], [3.0, 0.0]], FULL).len(), 1);
    }

    #[test]
    fn lines_break_where_there_is_no_number() {
        let mut drawing = Drawing::new(10.0, 10.0);
        let nan = f64::NAN;
        drawing.line(&[[0.0, 0.0], [1.0, 1.0], [nan, 2.0], [3.0, 3.0], [4.0, nan]], Stroke::thin(INK));
        assert_eq!(drawing.marks.len(), 1);
    }

    #[test]
    fn both_formats_show_the_same_place() {
        let mut drawing = Drawing::new(40.0, 20.0);
        drawing.area(vec![[10.0, 5.0], [30.0, 5.0], [30.0, 15.0], [10.0, 15.0]], INK, 1.0);
        let image = drawing.to_image(&[]).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!((image.width, image.height), (80, 40));
        assert_eq!(image.at(40, 20), INK);
        assert_eq!(image.at(4, 4), WHITE);
        // 300 an inch where the drawing has 96.
        let print = drawing.to_print().unwrap_or_else(|e| panic!("{e}"));
        assert_eq!((print.width, print.height), (125, 63));
        assert_eq!([print.at(62, 31), print.at(6, 6)], [INK, WHITE]);
        let svg = drawing.to_svg().unwrap_or_else(|e| panic!("{e}"));
        assert!(svg.contains(r#"width="40" height="20" viewBox="0 0 160 80""#), "{svg}");
        assert!(svg.contains(r#"points="40,20 120,20 120,60 40,60 ""#), "{svg}");
    }

    #[test]
    fn texts_are_measured_and_escaped() {
        let (narrow, wide) = (text_width("iii", 10.0), text_width("WWW", 10.0));
        // DejaVu Sans: i is 0.278 em wide, W 0.989 em.
        assert!((narrow - 8.34).abs() < 0.2 && (wide - 29.7).abs() < 0.3, "{narrow} {wide}");
        let mut drawing = Drawing::new(50.0, 20.0);
        drawing.text([5.0, 10.0], "a<b&c", 10.0, INK, Anchor::Left);
        drawing.turned_text([5.0, 10.0], "a\u{1b}[31m\u{7}", 10.0, INK);
        let svg = drawing.to_svg().unwrap_or_else(|e| panic!("{e}"));
        assert!(!svg.contains(|c: char| c.is_control() && c != '\n'), "{svg:?}");
        assert!(svg.contains("a&lt;b&amp;c") && !svg.contains("a<b"), "{svg}");
    }
}
