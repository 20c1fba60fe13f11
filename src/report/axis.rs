//! Axes: ranges, ticks and their labels.

use crate::results::fixed;

/// An axis of a panel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Axis {
    /// With its unit in brackets.
    pub label: String,
    /// Ends; where `None`, from the data.
    pub low: Option<f64>,
    pub high: Option<f64>,
    pub logarithmic: bool,
    /// No tick between whole numbers.
    pub whole: bool,
}

impl Axis {
    pub fn new(label: impl Into<String>) -> Self {
        Axis { label: label.into(), ..Axis::default() }
    }

    pub fn from(mut self, low: f64) -> Self {
        self.low = Some(low);
        self
    }

    pub fn to(mut self, high: f64) -> Self {
        self.high = Some(high);
        self
    }

    pub fn logarithmic(mut self) -> Self {
        self.logarithmic = true;
        self
    }

    pub fn whole(mut self) -> Self {
        self.whole = true;
        self
    }
}

/// An axis with its range settled.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    pub low: f64,
    pub high: f64,
    pub logarithmic: bool,
    /// Labelled.
    pub ticks: Vec<f64>,
    /// Unlabelled, between those.
    pub minor: Vec<f64>,
    labels: Vec<String>,
}

impl Scale {
    /// The scale of an axis for these values; what is not finite, or not positive on a logarithmic axis, does not count.
    /// `wanted` ticks, about.
    pub fn of(axis: &Axis, values: impl Iterator<Item = f64>, wanted: usize) -> Scale {
        let counts = |x: &f64| x.is_finite() && (!axis.logarithmic || *x > 0.0);
        let (mut low, mut high) = values
            .filter(counts)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        if low > high {
            (low, high) = if axis.logarithmic { (1.0, 10.0) } else { (0.0, 1.0) };
        }
        let settled = |given: Option<f64>, found: f64| given.filter(counts).unwrap_or(found);
        (low, high) = (settled(axis.low, low), settled(axis.high, high));
        match axis.logarithmic {
            true => Self::logarithmic(axis, low, high, wanted.max(2)),
            false => Self::linear(axis, low, high, wanted.max(2)),
        }
    }

    fn linear(axis: &Axis, mut low: f64, mut high: f64, wanted: usize) -> Scale {
        // A range that rounding could not tell from a point is widened.
        let size = low.abs().max(high.abs());
        if high - low <= 1e-9 * size || high <= low {
            let half = if size > 0.0 { 0.05 * size } else { 0.5 };
            (low, high) = (low - half, high + half);
        }
        let mut step = nice_step((high - low) / wanted as f64);
        if axis.whole {
            step = step.max(1.0).round();
        }
        // The data end inside the panel, not on its edge.
        let room = 0.04 * (high - low);
        if axis.low.is_none() {
            // What rounding leaves below zero is no reason to leave it.
            low = if low >= -0.01 * room && low <= room { 0.0 } else { low - room };
        }
        if axis.high.is_none() {
            high = if high <= 0.01 * room && high >= -room { 0.0 } else { high + room };
        }
        let first = (low / step - 1e-6).ceil();
        let last = (high / step + 1e-6).floor();
        let count = (last - first).clamp(0.0, 100.0) as usize;
        let ticks: Vec<f64> = (0..=count).map(|k| (first + k as f64) * step).collect();
        let labels = ticks.iter().map(|&tick| label(tick, step)).collect();
        Scale { low, high, logarithmic: false, ticks, minor: Vec::new(), labels }
    }

    fn logarithmic(axis: &Axis, mut low: f64, mut high: f64, wanted: usize) -> Scale {
        if high < low * 1.000_001 {
            (low, high) = (low / 2.0, high * 2.0);
        }
        let room = (high / low).powf(0.04);
        low = if axis.low.is_none() { low / room } else { low };
        high = if axis.high.is_none() { high * room } else { high };
        let decades = (low.log10() - 1e-9).ceil() as i32..=(high.log10() + 1e-9).floor() as i32;
        let many = decades.clone().count();
        let inside = |x: &f64| *x >= low * 0.999_999 && *x <= high * 1.000_001;
        let within = |factors: &[f64]| -> Vec<f64> {
            let all = decades.start() - 1..=*decades.end();
            all.flat_map(|d| factors.iter().map(move |f| f * 10_f64.powi(d))).filter(inside).collect()
        };
        let every = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0];
        let (ticks, labels): (Vec<f64>, Vec<String>) = if many >= 3 {
            let stride = many.div_ceil(8);
            decades.clone().step_by(stride).map(|d| (10_f64.powi(d), power(d))).unzip()
        } else {
            let mut factors: &[f64] = if many == 2 { &[1.0, 2.0, 5.0] } else { &every };
            // A wide part of a decade has no room for nine labels.
            if many < 2 && high / low > 5.0 {
                factors = &[1.0, 2.0, 3.0, 5.0];
            }
            let ticks = within(factors);
            match ticks.len() {
                0 | 1 => {
                    let scale = Self::linear(&Axis { logarithmic: false, ..axis.clone() }, low, high, 3);
                    let inside = scale.ticks.into_iter().zip(scale.labels).filter(|(t, _)| inside(t));
                    inside.unzip()
                }
                _ => ticks.into_iter().map(|tick| (tick, short(tick))).unzip(),
            }
        };
        // Where decades are narrower than ticks are wanted their parts would be a grey band.
        let roomy = (high / low).log10() <= wanted as f64 + 1.0;
        let minor = if roomy { within(&every) } else { within(&[1.0]) };
        Scale { low, high, logarithmic: true, ticks, minor, labels }
    }

    pub fn labels(&self) -> &[String] {
        &self.labels
    }

    /// Where a value lies: 0 at the low end, 1 at the high end; not finite for what the scale cannot show.
    pub fn share(&self, value: f64) -> f64 {
        match self.logarithmic {
            false => (value - self.low) / (self.high - self.low),
            true if value > 0.0 => (value / self.low).ln() / (self.high / self.low).ln(),
            true => f64::NAN,
        }
    }
}

/// 1, 2 or 5 times a power of ten, next to `rough`.
fn nice_step(rough: f64) -> f64 {
    if !(rough.is_finite() && rough > 0.0) {
        return 1.0;
    }
    let power = 10_f64.powf(rough.log10().floor());
    let factor = rough / power;
    let nice = match factor {
        f if f <= 1.5 => 1.0,
        f if f <= 3.2 => 2.0,
        f if f <= 7.5 => 5.0,
        _ => 10.0,
    };
    nice * power
}

/// A tick's label, with the decimals that the step needs.
fn label(tick: f64, step: f64) -> String {
    let size = tick.abs().max(step);
    if size >= 1e6 || step < 1e-5 {
        return scientific(tick);
    }
    let decimals = (-step.log10() - 1e-9).ceil().clamp(0.0, 8.0) as usize;
    minus(&fixed(tick, decimals))
}

/// A number in few characters.
pub fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let size = value.abs();
    if !(1e-3..1e5).contains(&size) {
        return scientific(value);
    }
    let decimals = (2 - size.log10().floor() as i32).clamp(0, 8) as usize;
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    minus(text)
}

/// Seconds as people read them.
pub fn duration(seconds: f64) -> String {
    match seconds {
        t if !t.is_finite() => "–".into(),
        t if t < 120.0 => format!("{t:.1} s"),
        t if t < 7200.0 => format!("{:.0} min {:02.0} s", (t / 60.0).floor(), (t % 60.0).floor()),
        t => format!("{:.0} h {:02.0} min", (t / 3600.0).floor(), (t % 3600.0 / 60.0).floor()),
    }
}

fn scientific(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let text = format!("{value:.2e}");
    let Some((mantissa, exponent)) = text.split_once('e') else { return text };
    let mantissa = mantissa.trim_end_matches('0').trim_end_matches('.');
    match (mantissa, exponent.parse::<i32>()) {
        ("1", Ok(exponent)) => power(exponent),
        (_, Ok(exponent)) => minus(&format!("{mantissa}·{}", power(exponent))),
        (_, Err(_)) => text,
    }
}

fn power(exponent: i32) -> String {
    let raised = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        // The others stand in a row.
        c => c.to_digit(10).and_then(|d| char::from_u32(0x2070 + d)).unwrap_or(c),
    };
    format!("10{}", exponent.to_string().chars().map(raised).collect::<String>())
}

/// With a minus sign as wide as a plus sign.
fn minus(text: &str) -> String {
    text.replacen('-', "−", 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scale(axis: Axis, values: &[f64]) -> Scale {
        Scale::of(&axis, values.iter().copied(), 6)
    }

    #[test]
    fn ticks_are_round_and_labelled_alike() {
        let s = scale(Axis::new("x"), &[0.0, 3.0]);
        assert_eq!(s.labels(), ["0.0", "0.5", "1.0", "1.5", "2.0", "2.5", "3.0"]);
        assert!(s.low == 0.0 && s.high > 3.0 && (s.share(s.high) - 1.0).abs() < 1e-15);
        let s = scale(Axis::new("x"), &[-0.0012, 0.0034]);
        assert_eq!(s.labels(), ["−0.001", "0.000", "0.001", "0.002", "0.003"]);
    }

    #[test]
    fn logarithmic_decades() {
        let s = scale(Axis::new("x").logarithmic(), &[1e-4, 0.0, -1.0, f64::NAN, 20.0]);
        assert_eq!(s.labels(), ["10⁻⁴", "10⁻³", "10⁻²", "10⁻¹", "10⁰", "10¹"]);
        assert!((s.share((s.low * s.high).sqrt()) - 0.5).abs() < 1e-12);
        assert!(s.share(0.0).is_nan());
        let s = scale(Axis::new("x").logarithmic(), &[40.0, 60.0]);
        assert_eq!(s.labels(), ["40", "50", "60"]);
    }

    /// A row that balances to 1e-11 makes eight decades, which have no room for lines within them.
    #[test]
    fn narrow_decades_have_no_lines_inside() {
        let s = Scale::of(&Axis::new("x").logarithmic(), [1e-11, 1e-3].into_iter(), 3);
        assert!(s.minor.len() <= 10, "{:?}", s.minor);
        assert!(s.minor.iter().all(|x| (x.log10() - x.log10().round()).abs() < 1e-9), "{:?}", s.minor);
        let s = Scale::of(&Axis::new("x").logarithmic(), [1e-5, 1e-3].into_iter(), 3);
        assert!(s.minor.len() > 15, "{:?}", s.minor);
    }

    #[test]
    fn odd_data_still_make_a_scale() {
        for values in [&[][..], &[f64::NAN], &[5.0], &[0.0, 0.0], &[1e300, -1e300], &[1.0, 1.0 + 1e-15]] {
            for axis in [Axis::new("x"), Axis::new("x").logarithmic(), Axis::new("x").whole()] {
                let s = scale(axis, values);
                assert!(s.low < s.high && s.low.is_finite() && s.high.is_finite(), "{values:?} {s:?}");
                assert_eq!(s.ticks.len(), s.labels().len());
            }
        }
    }

    #[test]
    fn short_numbers() {
        for (value, text) in
            [(0.0, "0"), (2.5, "2.5"), (-120.0, "−120"), (1e-5, "10⁻⁵"), (2.5e7, "2.5·10⁷"), (0.012, "0.012")]
        {
            assert_eq!(short(value), text);
        }
    }

    #[test]
    fn times_as_people_read_them() {
        assert_eq!(duration(86.8), "86.8 s");
        assert_eq!(duration(1500.0), "25 min 00 s");
        assert_eq!(duration(f64::NAN), "–");
    }
}
