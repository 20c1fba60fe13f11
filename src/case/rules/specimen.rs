//! Rules of the specimen: grading and size.

use serde_json::{Value, json};

use crate::error::Faults;

use crate::geometry::Polyhedron;
use crate::specimen::SpecimenSize;
use crate::specimen::size::CONSISTENCY;

use crate::tensor::Vec3;

use super::super::size::{MeanGrains, with_mass};
use super::super::walk::{Walker, number};

/// Largest sieve size over the smaller of diameter and height.
const LARGEST_GRAIN: f64 = 0.8;
const USUAL_GRAIN: f64 = 0.2;

/// More grains are a slip of the pen, a forgotten unit most likely.
const MOST_GRAINS: f64 = 1e7;

/// A grading from small to large is turned round; sieves beyond its grains are left out.
pub fn derive(specimen: &mut Value) {
    if let Some(points) = specimen.pointer_mut("/grading").and_then(Value::as_array_mut) {
        let passing = |point: &Value| point[1].as_f64();
        if let (Some(first), Some(last)) = (points.first().and_then(passing), points.last().and_then(passing))
            && first < last
        {
            points.reverse();
        }
    }
    if let Ok(grading) = serde_json::from_value::<Vec<[f64; 2]>>(specimen["grading"].clone()) {
        specimen["grading"] = json!(with_mass(&grading));
    }
}

/// The mean grains, which the built case needs too, if they are sound.
pub fn check(specimen: &Value, rounding: Option<f64>, walker: &mut Walker) -> Option<MeanGrains> {
    let grading = grading(specimen, walker);
    let grains = mean_grains(specimen, grading.as_deref(), rounding, walker);
    let largest = grading.and_then(|grading| grading.first().map(|point| point[0]));
    size(specimen, grains.as_ref(), largest, walker);
    grains
}

fn mean_grains(
    specimen: &Value,
    grading: Option<&[[f64; 2]]>,
    rounding: Option<f64>,
    walker: &mut Walker,
) -> Option<MeanGrains> {
    let place = "$.specimen.vertices";
    let count = |i: usize| specimen["vertices"][i].as_u64().map(|n| n as usize);
    let (fewest, most) = (count(0)?, count(1)?);
    let found = format!("[{fewest}, {most}]");
    if fewest > most {
        walker.fault(place, found, "has the larger number first", "[fewest, most]");
        return None;
    }
    let within_class = serde_json::from_value(specimen["within_class"].clone()).ok()?;
    let shapes: Vec<Vec<[f64; 3]>> = match &specimen["shapes"] {
        Value::Null => Vec::new(),
        given => serde_json::from_value(given.clone()).ok()?,
    };
    let separation = number(specimen, "vertex_separation")?;
    match MeanGrains::new(grading?, within_class, [fewest, most], separation, (&shapes, rounding?)) {
        Ok(grains) => match specimen["packing"]["grains"].as_array() {
            Some(packed) => Some(grains.filling(packed.len(), solid_volume(packed)?)),
            None => Some(grains),
        },
        Err(problem) if !shapes.is_empty() => {
            let accepted = "shapes less flat, or a smaller contact.rounding";
            let found = format!("{} shapes", shapes.len());
            walker.fault("$.specimen.shapes", found, format!("makes no grains: {problem}"), accepted);
            None
        }
        Err(problem) => {
            let accepted = "fewer vertices or a smaller vertex_separation";
            walker.fault(place, found, format!("makes no grains: {problem}"), accepted);
            None
        }
    }
}

/// Of the hulls of a packing's grains [m3].
fn solid_volume(packed: &[Value]) -> Option<f64> {
    let volume = |grain: &Value| -> Option<f64> {
        let corners: Vec<[f64; 3]> = serde_json::from_value(grain["vertices"].clone()).ok()?;
        let corners: Vec<Vec3> = corners.into_iter().map(Vec3::from).collect();
        Some(Polyhedron::convex_hull(&corners).ok()?.volume())
    };
    packed.iter().map(volume).sum()
}

/// The grading, if nothing is wrong with it.
fn grading(specimen: &Value, walker: &mut Walker) -> Option<Vec<[f64; 2]>> {
    let place = "$.specimen.grading";
    let points = specimen["grading"].as_array()?;
    let points: Vec<[f64; 2]> =
        points.iter().map(|point| Some([point[0].as_f64()?, point[1].as_f64()?])).collect::<Option<_>>()?;
    let (first, last) = (*points.first()?, *points.last()?);
    let shown = |p: [f64; 2]| format!("[{} m, {}]", p[0], p[1]);
    for pair in points.windows(2) {
        if pair[1][0] >= pair[0][0] {
            let problem = format!("is not monotone: {} follows {}", shown(pair[1]), shown(pair[0]));
            walker.fault(place, shown(pair[1]), problem, "sizes that fall from point to point");
        } else if pair[1][1] > pair[0][1] {
            let problem = format!("is not monotone: {} follows {}", shown(pair[1]), shown(pair[0]));
            walker.fault(place, shown(pair[1]), problem, "a passing share that falls with the size");
        }
    }
    if first[1] != 1.0 {
        let problem = format!("must begin with 1 passing at the largest size, not {}", first[1]);
        walker.fault(place, shown(first), problem, format!("[{} m, 1]", first[0]));
    }
    if last[1] != 0.0 {
        let problem = format!("must end with 0 passing at the smallest size, not {}", last[1]);
        let accepted = format!(
            "[{size} m, 0]; or {{\"points\": [...], \"finest\": \"{size} m\"}}, which leaves out what is finer",
            size = last[0]
        );
        walker.fault(place, shown(last), problem, accepted);
    }
    walker.is_clean(place).then_some(points)
}

fn size(specimen: &Value, grains: Option<&MeanGrains>, largest: Option<f64>, walker: &mut Walker) {
    let place = "$.specimen";
    let given = ["diameter", "height", "grains", "aspect"];
    if given.iter().any(|key| !walker.is_clean(&format!("{place}.{key}"))) {
        return;
    }
    let [diameter, height, count, aspect] = given.map(|key| number(specimen, key));
    let found: Vec<&str> = given.into_iter().filter(|key| !specimen[*key].is_null()).collect();
    let accepted =
        "diameter and height (the number of grains follows), or grains and aspect (the size follows)";
    let (d, h) = match (diameter, height, count, aspect) {
        (Some(d), Some(h), ..) => (d, h),
        (_, _, Some(n), Some(aspect)) => match (grains, number(specimen, "void_ratio")) {
            (Some(grains), Some(e)) => {
                let plan = grains.plan(SpecimenSize::Grains { count: n as usize, aspect }, e);
                (plan.diameter, plan.height)
            }
            _ => return,
        },
        _ => {
            let found = if found.is_empty() { "nothing".into() } else { found.join(", ") };
            walker.fault(place, found, "is not sized", accepted);
            return;
        }
    };
    if let (Some(grains), Some(e)) = (grains, number(specimen, "void_ratio")) {
        let count = grains.number(d, h, e) as f64;
        if count > MOST_GRAINS {
            let problem = format!("holds {count:.1e} grains of this grading (a plain number is in m)");
            let (found, accepted) = (format!("{d} m x {h} m"), format!("at most {MOST_GRAINS:.0e} grains"));
            walker.fault(place, found, problem, accepted);
            return;
        }
    }
    let agree = |a: f64, b: f64| (a / b - 1.0).abs() <= CONSISTENCY;
    let mut differ = |key: &str, value: f64, expected: f64, why: &str| {
        if !agree(value, expected) {
            let problem = format!("disagrees with {why}, by which it would be {expected:.4}");
            let accepted = format!("within 5 % of {expected:.4}, or no {key}");
            walker.fault(format!("{place}.{key}"), value, problem, accepted);
        }
    };
    match (diameter, height) {
        (Some(d), Some(h)) => {
            if let Some(aspect) = aspect {
                differ("aspect", aspect, h / d, "height over diameter");
            }
            if let (Some(n), Some(grains), Some(e)) = (count, grains, number(specimen, "void_ratio")) {
                let expected = grains.number(d, h, e) as f64;
                differ("grains", n, expected, "diameter, height, void_ratio and grading");
            }
        }
        (Some(given), None) => differ("diameter", given, d, "grains, aspect, void_ratio and grading"),
        (None, Some(given)) => differ("height", given, h, "grains, aspect, void_ratio and grading"),
        (None, None) => {}
    }
    if let Some(largest) = largest
        && largest > LARGEST_GRAIN * d.min(h)
    {
        let problem =
            format!("has grains of {largest:.4} m, too large for a specimen {d:.4} m wide and {h:.4} m high");
        let mut accepted =
            "a largest size of at most 0.8 of the diameter and of the height (laboratories keep to a fifth)"
                .to_string();
        if let (Some(n), None, None, true) = (count, diameter, height, specimen["packing"].is_null()) {
            // Of equal shape: as many as its volume is larger.
            let for_share = |share: f64| (n * (largest / (share * d.min(h))).powi(3)).ceil();
            let (enough, usual) = (for_share(LARGEST_GRAIN), for_share(USUAL_GRAIN));
            accepted +=
                &format!("; about {enough} grains of this grading make one so large, {usual} for a fifth");
        }
        walker.fault(format!("{place}.grading"), format!("{largest} m"), problem, accepted);
    }
}

#[cfg(test)]
mod tests {
    use crate::case::checked;

    #[test]
    fn too_few_grains_are_told_how_many_would_do() {
        let text = r#"{"specimen": {"grains": 3, "aspect": 2, "void_ratio": 0.6, "grading": [["60 mm", 1], ["40 mm", 0]]},
            "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2}, "contact": {"friction": 0.65},
            "stages": [{"kind": "consolidate", "pressure": "0.8 MPa"}]}"#;
        let said = checked(text, &[]).expect_err("too few").to_string();
        let words: Vec<&str> = said.split("; about ").nth(1).expect("a number").split(' ').collect();
        let enough = format!("/specimen/grains={}", words[0]);
        assert!(checked(text, &[&enough]).is_ok(), "{said}");
        assert!(said.contains("for a fifth"), "{said}");
    }
}
