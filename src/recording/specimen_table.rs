//! `/grains` and `/specimen`: the grains as generated, and what the specimen is like.

use crate::case::{Case, Fidelity};
use crate::material::Drawn;
use crate::mesh::{Mesh, QualityReport};
use crate::results::Column;
use crate::specimen::Specimen;
use crate::specimen::statistics::Histogram;

/// A specimen as generated.
#[derive(Debug, Clone, Copy)]
pub struct Generated<'a> {
    pub specimen: &'a Specimen,
    /// A mesh of each grain.
    pub meshes: &'a [Mesh],
    /// What the cells of all grains have drawn from the laws of their rock.
    pub drawn: &'a [Drawn],
    /// Mean Young's modulus [Pa] and Poisson's ratio of each grain.
    pub means: &'a [Vec<f64>; 2],
}

/// The static columns of `/grains`.
pub fn grains(case: &Case, generated: &Generated<'_>) -> Vec<Column> {
    let Generated { specimen, meshes, means: [moduli, ratios], .. } = *generated;
    let grains = &specimen.grains;
    let count = grains.len();
    let volumes: Vec<f64> = grains.iter().map(|g| g.nominal.volume()).collect();
    let semi_axes = grains.iter().map(|g| {
        let mut axes = g.semi_axes;
        axes.sort_by(|a, b| b.total_cmp(a));
        axes
    });
    let rock = &case.rock;
    let level = match case.fidelity_of_grains() {
        Fidelity::Auto | Fidelity::Rigid => 0,
        Fidelity::Condensed => 1,
        Fidelity::Full => 2,
    };
    vec![
        Column::floats("mass", "kg", "mass", volumes.iter().map(|v| rock.density * v)),
        Column::floats("volume", "m3", "volume of the nominal polyhedron", volumes),
        Column::floats(
            "sieve_size",
            "m",
            "sieve size: intermediate diameter of the generating ellipsoid; of a given grain the smallest square hole that it passes",
            grains.iter().map(|g| g.sieve_size),
        ),
        Column::vectors(
            "semi_axes",
            "m",
            "semi-axes of the generating ellipsoid, largest first; of a given grain its half extents along its principal axes",
            semi_axes,
        ),
        Column::floats(
            "rounding",
            "m",
            "radius of the rounded edges and corners",
            grains.iter().map(|g| g.rounded.radius),
        ),
        Column::integers(
            "size_class",
            "size class, 0 the coarsest, as in /specimen/grading",
            grains.iter().map(|g| g.class),
        ),
        Column::integers(
            "vertices",
            "vertices of the polyhedron",
            grains.iter().map(|g| g.nominal.vertices.len()),
        ),
        Column::integers(
            "facets",
            "triangular facets of the polyhedron",
            grains.iter().map(|g| g.nominal.facets.len()),
        ),
        Column::integers("cells", "cells of the mesh", meshes.iter().map(|mesh| mesh.cells.len())),
        Column::floats(
            "mean_youngs_modulus",
            "Pa",
            "Young's modulus of the grain, mean over its cells",
            moduli.iter().copied(),
        ),
        Column::floats(
            "mean_poissons_ratio",
            "1",
            "Poisson's ratio of the grain, mean over its cells",
            ratios.iter().copied(),
        ),
        Column::integers(
            "fidelity",
            "how the grain deforms at first: 0 rigid with local compliance, 1 condensed, 2 full",
            vec![level; count],
        ),
    ]
}

/// Tables of `/specimen`, each with its group.
pub fn specimen(specimen: &Specimen, meshes: &[Mesh]) -> Vec<(String, Vec<Column>)> {
    let s = &specimen.statistics;
    let summary = [packing(specimen), mesh_quality(meshes)].concat();
    let class = |of: fn(&crate::specimen::statistics::ClassStatistics) -> f64| -> Vec<f64> {
        s.classes.iter().map(of).collect()
    };
    let largest = class(|c| c.sizes[0].max(c.sizes[1]));
    let smallest = class(|c| c.sizes[0].min(c.sizes[1]));
    let grading = vec![
        Column::floats("smallest_size", "m", "smallest sieve size of the class", smallest),
        Column::floats("largest_size", "m", "largest sieve size of the class", largest),
        Column::integers("grains", "grains of the class", s.classes.iter().map(|c| c.grains)),
        Column::floats("mass_fraction_asked", "1", "mass fraction asked", class(|c| c.mass_fraction[0])),
        Column::floats("mass_fraction", "1", "mass fraction achieved", class(|c| c.mass_fraction[1])),
    ];
    let mut tables = vec![("specimen".to_string(), summary), ("specimen/grading".to_string(), grading)];
    for (name, long_name, histogram) in [
        ("elongation", "intermediate over long semi-axis", &s.elongation),
        ("flatness", "short over intermediate semi-axis", &s.flatness),
        ("sphericity", "surface of the ball of equal volume over the grain's", &s.sphericity),
        ("vertices", "vertices", &s.vertices),
        ("facets", "facets", &s.facets),
        (
            "square_opening",
            "smallest square hole that the grain passes over its sieve size",
            &s.square_opening,
        ),
    ] {
        tables.push((format!("specimen/{name}"), distribution(long_name, histogram)));
    }
    tables
}

/// Size, density and contacts, and how the packing was reached.
fn packing(specimen: &Specimen) -> Vec<Column> {
    let s = &specimen.statistics;
    let (number, count) = (Column::number, Column::count);
    let contact = "gap below 1e-3 of the smaller sieve size";
    vec![
        number("diameter", "m", "diameter of the specimen as generated", specimen.diameter),
        number("height", "m", "height of the specimen as generated", specimen.height),
        number("void_ratio", "1", "void ratio of the specimen as generated", s.void_ratio),
        number("loosest_void_ratio", "1", "void ratio of the loosest packing found", s.loosest_void_ratio),
        number("compaction_friction", "1", "friction at which compaction ended", s.compaction_friction),
        count("compaction_steps", "time steps of the compaction", s.compaction_steps),
        number("solid_volume", "m3", "volume of all grains", s.solid_volume),
        number("grain_scale", "1", "factor on all grains to meet the asked diameter", s.grain_scale),
        number("coordination_number", "1", &format!("contacts per grain, {contact}"), s.coordination_number),
        number(
            "coordination_number_without_rattlers",
            "1",
            &format!("contacts per grain that is no rattler, {contact}"),
            s.coordination_number_without_rattlers,
        ),
        count("rattlers", "grains with fewer than 3 contacts, wall and plates included", s.rattlers),
        count("contacts", &format!("pairs of grains in contact, {contact}"), s.contacts),
        number(
            "worst_overlap_gjk",
            "1",
            "largest overlap over the smaller sieve size, by GJK",
            s.worst_overlap[0],
        ),
        number(
            "worst_overlap_separating_axis",
            "1",
            "largest overlap over the smaller sieve size, by separating axis and pairs of features",
            s.worst_overlap[1],
        ),
        number(
            "overlap_before_relaxation",
            "1",
            "largest overlap as compaction left it",
            s.overlap_before_relaxation,
        ),
        number(
            "wall_protrusion",
            "m",
            "largest distance by which a grain passes the cylinder",
            s.wall_protrusion,
        ),
        number(
            "plate_protrusion",
            "m",
            "largest distance by which a grain passes a plate",
            s.plate_protrusion,
        ),
    ]
}

/// Of the meshes of all grains.
fn mesh_quality(meshes: &[Mesh]) -> Vec<Column> {
    let quality: Vec<QualityReport> = meshes.iter().map(QualityReport::of).collect();
    let over = |of: fn(&QualityReport) -> f64, fold: fn(f64, f64) -> f64| {
        quality.iter().map(of).reduce(fold).unwrap_or(f64::NAN)
    };
    let cells: usize = quality.iter().map(|q| q.cells).sum();
    let mean_ratio =
        quality.iter().map(|q| q.mean_radius_ratio * q.cells as f64).sum::<f64>() / cells.max(1) as f64;
    let (number, count) = (Column::number, Column::count);
    vec![
        count("cells", "cells of all grains", cells),
        count("nodes", "nodes of all grains", quality.iter().map(|q| q.nodes).sum::<usize>()),
        number(
            "worst_radius_ratio",
            "1",
            "worst 3 r / R of a cell, 1 for the regular tetrahedron",
            over(|q| q.worst_radius_ratio, f64::min),
        ),
        number("mean_radius_ratio", "1", "mean 3 r / R of all cells", mean_ratio),
        number(
            "smallest_dihedral",
            "rad",
            "smallest angle between two facets of a cell",
            over(|q| q.smallest_dihedral, f64::min),
        ),
        number(
            "largest_dihedral",
            "rad",
            "largest angle between two facets of a cell",
            over(|q| q.largest_dihedral, f64::max),
        ),
    ]
}

fn distribution(long_name: &str, histogram: &Histogram) -> Vec<Column> {
    let width = (histogram.high - histogram.low) / histogram.counts.len().max(1) as f64;
    let edge = |shift: usize| -> Vec<f64> {
        (0..histogram.counts.len()).map(|k| histogram.low + (k + shift) as f64 * width).collect()
    };
    vec![
        Column::floats("low", "1", &format!("lower end of the interval: {long_name}"), edge(0)),
        Column::floats("high", "1", &format!("upper end of the interval: {long_name}"), edge(1)),
        Column::integers("count", "grains in the interval", histogram.counts.iter().copied()),
    ]
}
