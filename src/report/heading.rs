//! Headings of tables: the name of a column and its unit, in the ways in which sheets of several countries put them.

/// Units, as [`plain_unit`], that stand behind a slash, a comma or "in"; in brackets anything may be one.
const UNITS: [&str; 17] = [
    "%", "1", "-", "pa", "kpa", "mpa", "kn/m2", "n/mm2", "psi", "ksi", "kgf/cm2", "m", "cm", "mm", "um",
    "in", "ft",
];

/// A heading as a name and a unit, if it has one: `name [unit]`, `name (unit)`, those in full-width brackets, `name/unit`, `name, unit`, `name in unit`.
/// Brackets about a name as in `(σ1-σ3)/kPa` stay with it.
pub fn heading(cell: &str) -> (&str, Option<&str>) {
    let cell = cell.trim_matches(['"', ' ', '\t']);
    let bracket = |c: char| matches!(c, '[' | '(' | '（' | '［');
    let closed = cell.ends_with([']', ')', '）', '］']);
    let opens = if closed { cell.rfind(bracket) } else { None };
    if let Some(at) = opens.filter(|at| *at > 0) {
        let unit = cell[at..].trim_matches(|c| bracket(c) || matches!(c, ']' | ')' | '）' | '］')).trim();
        return (cell[..at].trim(), Some(unit));
    }
    for mark in ["/", ",", "，", " in "] {
        let parts = cell
            .match_indices(mark)
            .find_map(|(at, _)| Some((&cell[..at], known_unit(&cell[at + mark.len()..])?)));
        if let Some((name, unit)) = parts {
            return (name.trim(), Some(unit));
        }
    }
    match cell.split_once(bracket).filter(|_| opens.is_none()) {
        Some((name, unit)) if !name.is_empty() => (name.trim(), Some(unit.trim())),
        Some(_) | None => (cell, None),
    }
}

fn known_unit(text: &str) -> Option<&str> {
    Some(text.trim()).filter(|unit| UNITS.contains(&plain_unit(unit).as_str()))
}

/// A unit by the letters that tell it from others: `KPa`, `kN/m²`, `kN/m^2`, `％` and `inch` are `kpa`, `kn/m2`, `kn/m2`, `%` and `in`.
pub fn plain_unit(unit: &str) -> String {
    let unit = unit.to_lowercase().replace(['^', ' '], "");
    let unit = unit.replace('²', "2").replace('％', "%").replace(['µ', 'μ'], "u");
    if unit == "inch" { "in".into() } else { unit }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heading_is_a_name_and_a_unit() {
        for (cell, name, unit) in [
            ("sieve [mm]", "sieve", Some("mm")),
            ("\"Axial strain (%)\"", "Axial strain", Some("%")),
            ("轴向应变（%）", "轴向应变", Some("%")),
            ("轴向应变/%", "轴向应变", Some("%")),
            ("(σ1-σ3)/kPa", "(σ1-σ3)", Some("kPa")),
            ("(σ1-σ3) [kN/m²]", "(σ1-σ3)", Some("kN/m²")),
            ("q / kN/m2", "q", Some("kN/m2")),
            ("q/kgf/cm^2", "q", Some("kgf/cm^2")),
            ("q in psi", "q", Some("psi")),
            ("sieve, inch", "sieve", Some("inch")),
            ("Siebweite in mm", "Siebweite", Some("mm")),
            ("Осевая деформация, %", "Осевая деформация", Some("%")),
            ("(σ1-σ3)", "(σ1-σ3)", None),
            ("axial_strain []", "axial_strain", Some("")),
            ("passing", "passing", None),
            ("stress/strain", "stress/strain", None),
            ("x [mm", "x", Some("mm")),
            ("", "", None),
            ("(", "(", None),
        ] {
            assert_eq!(heading(cell), (name, unit), "{cell}");
        }
    }
}
