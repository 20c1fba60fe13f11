//! Colours and dashes of all charts.
//!
//! Source: Okabe & Ito (2008), "Color Universal Design": told apart with any kind of colour vision.
//! In print and in greyscale the dashes tell curves apart, lightness and labels tell areas apart.

/// Red, green, blue, 0 to 255 each (sRGB).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Colour(pub u8, pub u8, pub u8);

pub const BLACK: Colour = Colour(0, 0, 0);
pub const WHITE: Colour = Colour(255, 255, 255);
/// Of text and ticks.
pub const INK: Colour = Colour(0x26, 0x26, 0x26);
/// Of axes and rules.
pub const AXIS: Colour = Colour(0x66, 0x66, 0x66);
pub const GRID: Colour = Colour(0xE3, 0xE3, 0xE3);
pub const GREY: Colour = Colour(0xBB, 0xBB, 0xBB);
pub const BLUE: Colour = Colour(0x00, 0x72, 0xB2);
pub const VERMILLION: Colour = Colour(0xD5, 0x5E, 0x00);
pub const GREEN: Colour = Colour(0x00, 0x9E, 0x73);
pub const PURPLE: Colour = Colour(0xCC, 0x79, 0xA7);
pub const ORANGE: Colour = Colour(0xE6, 0x9F, 0x00);
pub const SKY: Colour = Colour(0x56, 0xB4, 0xE9);

const CURVES: [Colour; 7] = [BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK];

/// On and off lengths [px]; none is a full line.
pub type Dash = &'static [f64];

pub const FULL: Dash = &[];
pub const DASHED: Dash = &[7.0, 3.5];
pub const DOTTED: Dash = &[1.8, 3.0];
const DASHES: [Dash; 5] = [FULL, DASHED, DOTTED, &[9.0, 3.0, 1.8, 3.0], &[13.0, 4.0]];

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    pub colour: Colour,
    /// [px]
    pub width: f64,
    pub dash: Dash,
}

impl Stroke {
    /// Of the curve with this number; 35 differ.
    pub fn of(number: usize) -> Stroke {
        let colour = CURVES[number % CURVES.len()];
        Stroke { colour, width: 2.0, dash: DASHES[number % DASHES.len()] }
    }

    pub const fn thin(colour: Colour) -> Stroke {
        Stroke { colour, width: 1.0, dash: FULL }
    }
}

/// Red, green and blue of viridis (van der Walt & Smith 2015), 0 to 255 each, at even shares from 0 to 1.
pub const VIRIDIS: [[f64; 3]; 9] = [
    [68.0, 1.0, 84.0],
    [71.0, 44.0, 122.0],
    [59.0, 81.0, 139.0],
    [44.0, 113.0, 142.0],
    [33.0, 144.0, 141.0],
    [39.0, 173.0, 129.0],
    [92.0, 200.0, 99.0],
    [170.0, 220.0, 50.0],
    [253.0, 231.0, 37.0],
];

/// The same of a scale from nearly white over orange to dark red.
pub const HEAT: [[f64; 3]; 6] = [
    [247.0, 238.0, 222.0],
    [253.0, 212.0, 158.0],
    [252.0, 165.0, 100.0],
    [234.0, 101.0, 65.0],
    [189.0, 33.0, 25.0],
    [105.0, 0.0, 10.0],
];

/// [`VIRIDIS`] at `share` from 0 to 1: evenly lighter from dark blue to yellow, in greyscale too.
pub fn viridis(share: f64) -> Colour {
    interpolated(&VIRIDIS, share)
}

/// [`HEAT`] at `share` from 0 to 1: evenly darker.
pub fn heat(share: f64) -> Colour {
    interpolated(&HEAT, share)
}

fn interpolated(stops: &[[f64; 3]], share: f64) -> Colour {
    let last = stops.len() - 1;
    let place = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) * last as f64 };
    let at = (place as usize).min(last - 1);
    let part = place - at as f64;
    let mixed = |k: usize| (stops[at][k] + part * (stops[at + 1][k] - stops[at][k])).round() as u8;
    Colour(mixed(0), mixed(1), mixed(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lightness(colour: Colour) -> f64 {
        0.299 * f64::from(colour.0) + 0.587 * f64::from(colour.1) + 0.114 * f64::from(colour.2)
    }

    #[test]
    fn scales_are_monotone_in_greyscale() {
        for k in 0..100 {
            let [a, b] = [k, k + 1].map(|k| f64::from(k) / 100.0);
            assert!(lightness(viridis(b)) >= lightness(viridis(a)) - 0.6, "{a}");
            assert!(lightness(heat(b)) <= lightness(heat(a)) + 0.6, "{a}");
        }
    }

    #[test]
    fn curves_differ_in_colour_and_dash_together() {
        for a in 0..35 {
            for b in 0..a {
                assert_ne!(Stroke::of(a), Stroke::of(b), "{a} {b}");
            }
        }
    }

    #[test]
    fn no_share_leaves_the_scale() {
        assert_eq!(viridis(-1.0), viridis(0.0));
        assert_eq!(viridis(f64::INFINITY), viridis(1.0));
        assert_eq!(viridis(f64::NAN), viridis(0.0));
    }
}
