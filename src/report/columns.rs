//! Columns of a laboratory table: which of them is which quantity, by the names that sheets of several countries give them, and what makes their cells SI.

use crate::quantity::Dimension;
use crate::results::HISTORY;

use super::heading::{heading, share_of_one};

pub const COLUMNS: [&str; 6] =
    ["curve", "axial_strain", "deviatoric_stress", "volumetric_strain", "major_stress", "minor_stress"];
/// What else sheets call the columns: in small letters, without spaces, points, commas, underscores, brackets and hyphens (a minus included).
const NAMES: [&[&str]; 6] = [
    // Of several that a sheet has, the first here counts.
    &[
        "curve",
        "test",
        "specimen",
        "sample",
        "versuch",
        "versuchs",
        "probe",
        "proben",
        "probekörper",
        "prüfkörper",
        "kurve",
        "曲线",
        "试样",
        "试件",
        "土样",
        "试验",
        "series",
        "run",
        "group",
        "serie",
        "reihe",
        "messreihe",
        "gruppe",
        "系列",
        "组",
        "组别",
        "编号",
    ],
    &[
        "axialstrain",
        "axstrain",
        "eps1",
        "epsilon1",
        "ε1",
        "e1",
        "εa",
        "epsa",
        "epsilona",
        "ea",
        "axialdehnung",
        "axialedehnung",
        "axialestauchung",
        "stauchung",
        "轴向应变",
        "轴应变",
    ],
    &[
        "deviatoricstress",
        "deviatorstress",
        "devstress",
        "deviator",
        "q",
        "sigma1sigma3",
        "s1s3",
        "σ1σ3",
        "principalstressdifference",
        "stressdifference",
        "deviatorspannung",
        "偏应力",
        "偏差应力",
        "主应力差",
    ],
    &[
        "volumetricstrain",
        "volumestrain",
        "volstrain",
        "volumechange",
        "volchange",
        "epsv",
        "epsvol",
        "epsilonv",
        "εv",
        "εvol",
        "ev",
        "volumendehnung",
        "volumenänderung",
        "体变",
        "体变率",
        "体应变",
        "体积应变",
    ],
    // Whose difference is the deviatoric stress.
    &["majorstress", "majorprincipalstress", "sigma1", "σ1", "s1"],
    &["minorstress", "minorprincipalstress", "sigma3", "σ3", "s3"],
];
/// What may stand behind such a name: "Test no.".
const NUMBERS: [&str; 7] = ["no", "nr", "number", "nummer", "id", "name", "号"];
/// Where a row has the columns, and what makes their cells SI.
pub type Places = [Option<(usize, f64)>; 6];

/// Where a header has the columns, and what is wrong with it. A column that is called so and has no unit of its quantity counts only where no other
/// has one: a volume change in cm³ beside the strain in %.
pub fn places_of(header: &csv::StringRecord) -> (Places, Vec<String>) {
    let (mut places, mut told): (Places, Vec<(usize, String)>) = Default::default();
    for (number, place) in places.iter_mut().enumerate() {
        let called_so = header.iter().enumerate().map(|(at, cell)| (at, heading(cell)));
        let (mut known, mut unknown, mut rank) = (Vec::new(), Vec::new(), usize::MAX);
        for (at, (name, unit)) in called_so {
            let Some((_, own)) = column_of(name).filter(|(column, _)| *column == number) else { continue };
            // A specimen may have a group or a number beside it.
            if number == 0 && own > rank {
                continue;
            }
            if number == 0 && own < rank {
                known.clear();
            }
            rank = own;
            match factor(number, unit) {
                Ok(factor) => known.push((at, factor)),
                Err(fault) => unknown.push((at, fault)),
            }
        }
        if known.len() > 1 {
            told.push((number, format!("has two columns {}", COLUMNS[number])));
        }
        *place = known.first().copied();
        if let (None, Some((at, fault))) = (*place, unknown.into_iter().next()) {
            told.push((number, fault));
            *place = Some((at, f64::NAN));
        }
    }
    // Both principal stresses stand in for their difference, one says nothing.
    if places[2].is_some() || places[4].is_none() || places[5].is_none() {
        (places[4], places[5]) = (None, None);
        told.retain(|(number, _)| *number < 4);
    }
    let mut faults: Vec<String> = told.into_iter().map(|(_, fault)| fault).collect();
    let names: Vec<&str> = header.iter().map(|cell| heading(cell).0).collect();
    let found = names.join(", ");
    if places[1].is_none() {
        faults.push(format!("has no column axial_strain (found: {found})"));
    }
    if places[2].is_none() && places[3].is_none() && places[4].is_none() {
        let problem = "has neither a column deviatoric_stress nor volumetric_strain";
        faults.push(format!("{problem} (found: {found})"));
    }
    (places, faults)
}

/// Whether the column in a place is one of those that are read.
pub fn is_used(places: &Places, at: usize) -> bool {
    places.iter().flatten().any(|(place, _)| *place == at)
}

/// Headings of columns that are not among `places` and that riprap does not write itself.
pub fn unused(header: &csv::StringRecord, places: &Places) -> Vec<String> {
    let is_ours = |cell: &str| HISTORY.iter().any(|quantity| quantity.name == heading(cell).0);
    let others = header.iter().enumerate().filter(|(at, cell)| !is_used(places, *at) && !cell.is_empty());
    others.filter(|(_, cell)| !is_ours(cell)).map(|(_, cell)| cell.to_string()).collect()
}

/// The number of a column by its name or another usual one, and the place of that among its names.
fn column_of(name: &str) -> Option<(usize, usize)> {
    let left_out = |c: &char| !matches!(c, ' ' | '.' | ',' | '_' | '-' | '−' | '–' | '(' | ')' | '（' | '）');
    let plain: String = name.to_lowercase().chars().filter(left_out).collect();
    // A word may have its symbol behind it: "Axial strain ε1".
    let rank = |names: &[&str]| {
        let is_behind = |rest: &str| rest.is_empty() || names.contains(&rest) || NUMBERS.contains(&rest);
        names.iter().position(|word| plain.strip_prefix(*word).is_some_and(is_behind))
    };
    NAMES.iter().enumerate().find_map(|(number, &names)| Some((number, rank(names)?)))
}

/// What makes the cells of a column SI.
fn factor(number: usize, unit: Option<&str>) -> Result<f64, String> {
    let known = match number {
        0 => return Ok(1.0),
        2 | 4 | 5 => unit.and_then(|unit| Dimension::Pressure.si_of(unit)),
        _ => unit.and_then(share_of_one),
    };
    known.ok_or_else(|| {
        let column = COLUMNS[number];
        let of_shares = ["%", "1"];
        let units: Vec<&str> = match number {
            2 | 4 | 5 => Dimension::Pressure.units().collect(),
            _ => of_shares.into(),
        };
        let accepted = units.iter().map(|name| format!("[{name}]")).collect::<Vec<_>>().join(", ");
        match unit {
            None | Some("") => format!("column {column} has no unit (accepted: {accepted} behind its name)"),
            Some(unit) => format!("{column}: unit [{unit}] is unknown (accepted: {accepted})"),
        }
    })
}
