//! Headings of tables: the name of a column and its unit, in the ways in which sheets of several countries put them.

use crate::quantity::Dimension;

/// A heading as a name and a unit, if it has one: `name [unit]`, `name (unit)`, those in full-width brackets, `name/unit`, `name, unit`, `name in unit`.
/// In brackets anything may be a unit, else a share, a stress or a length. Brackets about a name as in `(σ1-σ3)/kPa` stay with it.
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
    let lengths_and_stresses = [Dimension::Length, Dimension::Pressure];
    let is_known = |unit: &&str| {
        share_of_one(unit).is_some() || lengths_and_stresses.iter().any(|of| of.si_of(unit).is_some())
    };
    Some(text.trim()).filter(is_known)
}

/// How many of one a unit of a share is: `%`, or none by the name of `1` or `-`.
pub fn share_of_one(unit: &str) -> Option<f64> {
    match unit {
        "1" | "-" => Some(1.0),
        unit => Dimension::None.si_of(unit),
    }
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
