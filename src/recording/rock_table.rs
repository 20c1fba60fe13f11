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
        let number = |column: &str, long_name: &str, value| Column::number(column, units, long_name, value);
        let columns = vec![
            Column::count("values", "cells with a value of their own", drawn.values),
            Column::count(
                "rejected",
                "draws thrown away and made again, since no rock has such a value",
                drawn.rejected,
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
