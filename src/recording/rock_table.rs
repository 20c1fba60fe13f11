//! `/rock`: what the cells of all bodies have drawn from the rock's laws.

use crate::material::{Drawn, Property};
use crate::results::Column;

/// `/rock/<quantity>`: one row each.
pub fn tables(drawn: &[Drawn]) -> Vec<(String, Vec<Column>)> {
    let table = |drawn: &Drawn| {
        let (name, units) = match drawn.property {
            Property::YoungsModulus => ("youngs_modulus", "Pa"),
            Property::PoissonsRatio => ("poissons_ratio", "1"),
            Property::CompressiveStrength => ("compressive_strength", "Pa"),
            Property::TensileStrength => ("tensile_strength", "Pa"),
        };
        let number =
            |column: &str, long_name: &str, value| Column::floats(column, units, long_name, vec![value]);
        let columns = vec![
            Column::integers("values", "cells with a value of their own", vec![drawn.values as i64]),
            Column::integers(
                "rejected",
                "draws thrown away and made again, since no rock has such a value",
                vec![drawn.rejected as i64],
            ),
            number(
                "mean_asked",
                "mean that the law was asked for, over the cells where bodies have laws of their own",
                drawn.asked,
            ),
            number("mean", "mean of the values, before a reference size scales strengths", drawn.mean),
            number("deviation", "standard deviation of the values", drawn.deviation),
            number("smallest", "smallest value", drawn.range[0]),
            number("largest", "largest value", drawn.range[1]),
        ];
        (format!("rock/{name}"), columns)
    };
    drawn.iter().map(table).collect()
}
