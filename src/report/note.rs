//! Where a word stands beside its point: clear of lines, of marks and words, and within its panel.

/// Left, top, right and bottom [px].
pub type Rect = [f64; 4];

/// From a point to the word above or below it [px].
const ABOVE: f64 = 7.0;
const ASIDE: f64 = 8.0;
/// What a line of letters of 12 needs above its point [px].
pub const ROOM: f64 = 20.0;

/// The middle of a word of this width and height beside `at`; the first of above, to its sides, below that is clear, else the least crowded. A line is
/// as high as its letters.
///
/// `lines` are polylines, a mark one of a single point; `taken` are words that are there.
pub fn place(at: [f64; 2], size: [f64; 2], lines: &[Vec<[f64; 2]>], taken: &[Rect], panel: Rect) -> [f64; 2] {
    let [half, up] = [0.5 * size[0], ABOVE + 0.5 * size[1]];
    let side = half + ASIDE;
    let (least, most) = (panel[0] + half + 3.0, (panel[2] - half - 3.0).max(panel[0] + half + 3.0));
    let above = [at[0].clamp(least, most), at[1] - up];
    let others =
        [[side, -8.0], [-side, -8.0], [side, 8.0], [-side, 8.0], [0.0, up], [side, 0.0], [-side, 0.0]];
    let places = std::iter::once(above).chain(others.map(|by| [at[0] + by[0], at[1] + by[1]]));
    let crowd = |middle: &[f64; 2]| -> usize {
        let rect = around(*middle, size);
        let outside = rect[0] < panel[0] || rect[2] > panel[2] || rect[3] > panel[3];
        let struck: usize = lines.iter().map(|line| crossings(line, rect)).sum();
        let covered = taken.iter().filter(|word| overlap(**word, rect)).count();
        struck + 10 * covered + 100 * usize::from(outside)
    };
    // The first of the best.
    places.min_by_key(crowd).unwrap_or(above)
}

/// What a word covers.
pub fn around(middle: [f64; 2], [width, height]: [f64; 2]) -> Rect {
    let (x, y) = (0.5 * width + 1.0, 0.5 * height);
    [middle[0] - x, middle[1] - y, middle[0] + x, middle[1] + y]
}

fn overlap(a: Rect, b: Rect) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

/// Pieces of a polyline that touch a box.
fn crossings(line: &[[f64; 2]], rect: Rect) -> usize {
    match line {
        [point] => usize::from(touches(*point, *point, rect)),
        line => line.windows(2).filter(|pair| touches(pair[0], pair[1], rect)).count(),
    }
}

/// Whether a segment touches a box (Liang & Barsky 1984).
fn touches(a: [f64; 2], b: [f64; 2], rect: Rect) -> bool {
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for axis in 0..2 {
        let (low, high, way) = (rect[axis], rect[axis + 2], b[axis] - a[axis]);
        if !way.is_finite() {
            return false;
        }
        if way.abs() < 1e-12 {
            if a[axis] < low || a[axis] > high {
                return false;
            }
            continue;
        }
        let ends = [(low - a[axis]) / way, (high - a[axis]) / way];
        from = from.max(ends[0].min(ends[1]));
        to = to.min(ends[0].max(ends[1]));
    }
    from <= to
}

#[cfg(test)]
mod tests {
    use super::*;

    const PANEL: Rect = [0.0, 0.0, 400.0, 300.0];

    #[test]
    fn segments_and_boxes() {
        let rect = [10.0, 10.0, 20.0, 20.0];
        assert!(touches([0.0, 15.0], [30.0, 15.0], rect) && touches([12.0, 12.0], [13.0, 13.0], rect));
        assert!(!touches([0.0, 25.0], [30.0, 25.0], rect) && !touches([0.0, 18.0], [12.0, 30.0], rect));
        assert!(!touches([0.0, f64::NAN], [30.0, 15.0], rect));
        assert!(crossings(&[[15.0, 15.0]], rect) == 1 && crossings(&[[9.0, 15.0]], rect) == 0);
    }

    /// Along lines in all directions, no word is struck through, and none leaves the panel or lies on another.
    #[test]
    fn words_are_clear_of_lines() {
        for k in 0..12 {
            let (sin, cos) = (f64::from(k) * std::f64::consts::PI / 6.0).sin_cos();
            let line: Vec<[f64; 2]> =
                (-2..=2).map(|n| f64::from(n) * 50.0).map(|s| [200.0 + s * cos, 150.0 + s * sin]).collect();
            let mut lines: Vec<Vec<[f64; 2]>> = line.iter().map(|point| vec![*point]).collect();
            lines.push(line.clone());
            let mut taken = Vec::new();
            for at in line {
                let rect = around(place(at, [40.0, 12.0], &lines, &taken, PANEL), [40.0, 12.0]);
                assert_eq!(lines.iter().map(|line| crossings(line, rect)).sum::<usize>(), 0, "{k} {at:?}");
                assert!(taken.iter().all(|word| !overlap(*word, rect)), "{k} {at:?}");
                assert!(rect[0] >= 0.0 && rect[2] <= 400.0);
                taken.push(rect);
            }
        }
    }

    #[test]
    fn a_word_near_the_edge_stays_inside() {
        let [x, y] = place([1.0, 100.0], [60.0, 12.0], &[], &[], PANEL);
        assert_eq!([x, y], [33.0, 87.0]);
        // Of three lines its lowest is as near.
        let [x, y] = place([1.0, 100.0], [60.0, 42.0], &[], &[], PANEL);
        assert_eq!([x, y + 15.0], [33.0, 87.0]);
    }
}
