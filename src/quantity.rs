//! Units of cases and sheets. A quantity of a case is a plain SI number, or a string with its unit such as `"0.8 MPa"`.

use serde_json::Value;

/// What a quantity measures; its SI unit is what plain numbers are in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    None,
    Length,
    Pressure,
    Angle,
    Force,
    Moment,
    Density,
    EnergyPerArea,
    Acceleration,
}

use Dimension::*;

/// A pound force over a square inch [Pa].
const PSI: f64 = 4.448_221_615_260_5 / (0.0254 * 0.0254);

/// Unit as written (after [`plain_spelling`]), its dimension, and its value in SI.
const UNITS: &[(&str, Dimension, f64)] = &[
    ("%", None, 1e-2),
    ("m", Length, 1.0),
    ("cm", Length, 1e-2),
    ("mm", Length, 1e-3),
    ("um", Length, 1e-6),
    ("nm", Length, 1e-9),
    ("km", Length, 1e3),
    ("in", Length, 0.0254),
    ("inch", Length, 0.0254),
    ("ft", Length, 0.3048),
    ("Pa", Pressure, 1.0),
    ("kPa", Pressure, 1e3),
    ("MPa", Pressure, 1e6),
    ("GPa", Pressure, 1e9),
    ("bar", Pressure, 1e5),
    ("N/m2", Pressure, 1.0),
    ("kN/m2", Pressure, 1e3),
    ("N/mm2", Pressure, 1e6),
    ("psi", Pressure, PSI),
    ("ksi", Pressure, 1e3 * PSI),
    ("kgf/cm2", Pressure, 98066.5),
    ("rad", Angle, 1.0),
    ("mrad", Angle, 1e-3),
    ("deg", Angle, std::f64::consts::PI / 180.0),
    ("°", Angle, std::f64::consts::PI / 180.0),
    ("N", Force, 1.0),
    ("mN", Force, 1e-3),
    ("kN", Force, 1e3),
    ("MN", Force, 1e6),
    ("Nm", Moment, 1.0),
    ("Nmm", Moment, 1e-3),
    ("kNm", Moment, 1e3),
    ("MNm", Moment, 1e6),
    ("kg/m3", Density, 1.0),
    ("g/cm3", Density, 1e3),
    ("t/m3", Density, 1e3),
    ("J/m2", EnergyPerArea, 1.0),
    ("kJ/m2", EnergyPerArea, 1e3),
    ("N/m", EnergyPerArea, 1.0),
    ("N/mm", EnergyPerArea, 1e3),
    ("m/s2", Acceleration, 1.0),
    ("mm/s2", Acceleration, 1e-3),
];

impl Dimension {
    /// The unit of plain numbers; empty for a dimensionless quantity.
    pub fn si_unit(self) -> &'static str {
        match self {
            None => "",
            Length => "m",
            Pressure => "Pa",
            Angle => "rad",
            Force => "N",
            Moment => "N m",
            Density => "kg/m3",
            EnergyPerArea => "J/m2",
            Acceleration => "m/s2",
        }
    }

    /// With its article, for messages: "a pressure".
    pub fn name(self) -> &'static str {
        match self {
            None => "a number",
            Length => "a length",
            Pressure => "a pressure",
            Angle => "an angle",
            Force => "a force",
            Moment => "a moment",
            Density => "a density",
            EnergyPerArea => "an energy per area",
            Acceleration => "an acceleration",
        }
    }

    /// A quantity as a user would write it.
    pub fn example(self) -> &'static str {
        match self {
            None => "0.5",
            Length => "\"300 mm\"",
            Pressure => "\"0.8 MPa\"",
            Angle => "\"30 deg\"",
            Force => "\"2 kN\"",
            Moment => "\"5 N m\"",
            Density => "\"2180 kg/m3\"",
            EnergyPerArea => "\"50 J/m2\"",
            Acceleration => "\"9.81 m/s2\"",
        }
    }

    /// Units that may be written after the number.
    pub fn units(self) -> impl Iterator<Item = &'static str> {
        UNITS.iter().filter(move |unit| unit.1 == self).map(|unit| unit.0)
    }

    /// How many of SI a unit is, in the ways in which sheets put it: `KPa`, `kN/m²`, `％`.
    pub fn si_of(self, unit: &str) -> Option<f64> {
        let same =
            |known: &&(&str, Dimension, f64)| known.1 == self && sheet_unit(known.0) == sheet_unit(unit);
        UNITS.iter().find(same).map(|known| known.2)
    }

    /// What a message offers: `a pressure, as "0.8 MPa" or a number in Pa`.
    pub fn accepted(self) -> String {
        match self {
            None => "a number".into(),
            _ => format!("{}, as {} or a number in {}", self.name(), self.example(), self.si_unit()),
        }
    }
}

/// The SI value of `value`; otherwise what is wrong with it, as a clause.
pub fn read(value: &Value, dimension: Dimension) -> Result<f64, String> {
    match value {
        Value::Number(number) => match number.as_f64() {
            Some(x) if x.is_finite() => Ok(x),
            _ => Err("is not a finite number".into()),
        },
        Value::String(text) => read_text(text, dimension),
        Value::Null => Err(format!("is null where {} is needed", dimension.name())),
        Value::Bool(_) => Err(format!("is a true/false where {} is needed", dimension.name())),
        Value::Array(_) => Err(format!("is a list where {} is needed", dimension.name())),
        Value::Object(_) => Err(format!("is an object where {} is needed", dimension.name())),
    }
}

fn read_text(text: &str, dimension: Dimension) -> Result<f64, String> {
    let text = text.trim();
    let bare = text.trim_start_matches(['+', '-']).to_ascii_lowercase();
    if ["nan", "inf", "infinity"].iter().any(|word| bare == *word || bare.starts_with(&format!("{word} "))) {
        return Err("is not a finite number".into());
    }
    let (digits, rest) = text.split_at(number_length(text));
    let Ok(number) = digits.parse::<f64>() else {
        return Err(format!("is not {}: it does not begin with a number", dimension.name()));
    };
    if !number.is_finite() {
        return Err("is not a finite number".into());
    }
    if rest.starts_with(',') {
        return Err("has a comma in its number: write a decimal point, and no thousands separators".into());
    }
    let unit = plain_spelling(rest);
    if unit.is_empty() {
        return match dimension {
            None => Ok(number),
            _ => Err(format!("has no unit: write one of {}, or a plain number", list(dimension.units()))),
        };
    }
    match UNITS.iter().find(|known| known.0 == unit) {
        Some((_, found, factor)) if *found == dimension => {
            let si = number * factor;
            if si.is_finite() { Ok(si) } else { Err("is not a finite number".into()) }
        }
        Some((_, found, _)) => Err(format!("is {} where {} is needed", found.name(), dimension.name())),
        Option::None => Err(match nearest_unit(&unit, dimension) {
            Some(near) => format!("has the unknown unit \"{}\": did you mean \"{near}\"?", rest.trim()),
            Option::None => format!("has the unknown unit \"{}\"", rest.trim()),
        }),
    }
}

/// Bytes of the decimal number at the start of `text`. An `e` counts only with digits after it.
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits = |from: usize| bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let mut end = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    end += digits(end);
    if bytes.get(end) == Some(&b'.') {
        end += 1 + digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits((end + 1 + sign).min(bytes.len()));
        if exponent > 0 {
            end += 1 + sign + exponent;
        }
    }
    end
}

/// A unit by the letters that tell it from others where small and large ones are mixed up: `KPa` and `kN/m²` are `kpa` and `kn/m2`.
fn sheet_unit(unit: &str) -> String {
    plain_spelling(unit).to_lowercase()
}

/// `N·m`, `N*m` and `N m` are `Nm`; `kg/m^3` and `kg/m³` are `kg/m3`; both micro signs are `u`; `％` is `%`.
fn plain_spelling(unit: &str) -> String {
    unit.chars()
        .filter(|c| !c.is_whitespace() && !matches!(c, '*' | '^' | '·' | '⋅'))
        .map(|c| match c {
            'µ' | 'μ' => 'u',
            '²' => '2',
            '³' => '3',
            '％' => '%',
            other => other,
        })
        .collect()
}

fn nearest_unit(unit: &str, dimension: Dimension) -> Option<&'static str> {
    let distance = |known: &str| {
        if known.eq_ignore_ascii_case(unit) { 0 } else { strsim::damerau_levenshtein(known, unit) }
    };
    dimension
        .units()
        .map(|known| (distance(known), known))
        .filter(|(d, _)| *d <= 2)
        .min()
        .map(|(_, known)| known)
}

fn list(words: impl Iterator<Item = &'static str>) -> String {
    words.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use serde_json::json;

    #[test]
    fn units_are_read_in_every_spelling() {
        let cases = [
            (json!("0.8 MPa"), Pressure, 0.8e6),
            (json!("300mm"), Length, 0.3),
            (json!(" 30 deg "), Angle, 30.0_f64.to_radians()),
            (json!("50 µm"), Length, 50e-6),
            (json!("50 μm"), Length, 50e-6),
            (json!("-2 kN"), Force, -2e3),
            (json!("1e3 N·m"), Moment, 1e3),
            (json!("2 N m"), Moment, 2.0),
            (json!("2.18 g/cm^3"), Density, 2180.0),
            (json!("2180 kg/m³"), Density, 2180.0),
            (json!("1.5e-1 kJ/m2"), EnergyPerArea, 150.0),
            (json!("9.81 m/s²"), Acceleration, 9.81),
            (json!("2.4 in"), Length, 0.06096),
            (json!("3inch"), Length, 0.0762),
            (json!("2 ft"), Length, 0.6096),
            (json!("58 psi"), Pressure, 58.0 * 6_894.757_293_168_361),
            (json!("5 ksi"), Pressure, 5e3 * 6_894.757_293_168_361),
            (json!("8 kgf/cm2"), Pressure, 784_532.0),
            (json!("8 kgf/cm^2"), Pressure, 784_532.0),
            (json!("8 kgf/cm²"), Pressure, 784_532.0),
            (json!("15 %"), None, 0.15),
            (json!("0.65"), None, 0.65),
            (json!(800000), Pressure, 8e5),
        ];
        for (value, dimension, expected) in cases {
            let found = read(&value, dimension).unwrap_or_else(|problem| panic!("{value}: {problem}"));
            assert!((found - expected).abs() <= 1e-15 * expected.abs(), "{value}: {found}, not {expected}");
        }
    }

    #[test]
    fn what_is_wrong_is_said() {
        let cases = [
            (json!("300 mm"), Pressure, "is a length where a pressure is needed"),
            (json!("0.8 Mpa"), Pressure, "did you mean \"MPa\"?"),
            (json!("0.8 furlongs"), Length, "unknown unit \"furlongs\""),
            (json!("2 feet"), Length, "did you mean \"ft\"?"),
            (json!("58 kpsi"), Pressure, "did you mean \"ksi\"?"),
            (json!("58 psi"), Length, "is a pressure where a length is needed"),
            (json!("0.8"), Pressure, "has no unit"),
            (json!("0,8 MPa"), Pressure, "comma"),
            (json!("NaN"), None, "not a finite number"),
            (json!("-Infinity MPa"), Pressure, "not a finite number"),
            (json!("1e999 Pa"), Pressure, "not a finite number"),
            (json!("much"), Pressure, "does not begin with a number"),
            (json!(""), Pressure, "does not begin with a number"),
            (json!([1]), Pressure, "is a list where a pressure is needed"),
            (json!(true), None, "true/false where a number"),
        ];
        for (value, dimension, expected) in cases {
            let problem = read(&value, dimension).expect_err("a fault");
            assert!(problem.contains(expected), "{value}: {problem}");
        }
    }

    proptest! {
        #[test]
        fn no_text_panics(text in ".{0,20}") {
            for dimension in [None, Length, Moment] {
                let _ = read(&Value::String(text.clone()), dimension);
            }
        }
    }
}
