//! Condensed grains against solutions that share nothing with the condensation but the element.
//!
//! - Same loads on the full mesh, held at six other supports: stresses and relative displacements agree to
//!   1e-8 relative (the condensation is exact, what is left is rounding times the condition of K).
//! - A grain cut in two by deleting cells: two parts, each with exactly six rigid modes.
//! - Hertz pressure on the pole of a sphere: the dent `u(0) - u(a) = pi p0 a (1 - nu^2) / (4 E)` of the half-space
//!   (Johnson 1985, eq. 3.41a). The sphere is a half-space up to terms of relative order a/R = 0.0204: that is the
//!   tolerance, and the mesh has to be fine enough not to need it.

use nalgebra::DMatrix;

use riprap::grain::CondensedGrain;
use riprap::grain::stiffness::{sound, stiffness_matrix};
use riprap::material::Elastic;
use riprap::mesh::{NearPoint, grain_mesh, sphere_mesh};
use riprap::tensor::Vec3;

use riprap::verification::grains::{condensed_against_full, rocks, sample_grain};

#[test]
fn condensed_equals_full_under_the_same_loads() {
    let [stress, full, condensed] = condensed_against_full();
    assert!(stress < 1e-8 && full < 1e-8 && condensed < 1e-10, "{stress:e} {full:e} {condensed:e}");
}

#[test]
fn grain_cut_in_two_gives_two_grains() {
    let mesh = grain_mesh(&sample_grain([16.0, 13.0]), 90).expect("a mesh");
    // Delete every cell that meets the plane z = 0.
    let alive: Vec<bool> = mesh
        .cell_ids()
        .map(|cell| {
            let z = mesh.corners(cell).map(|p| p.z);
            z.iter().all(|z| *z > 0.0) || z.iter().all(|z| *z < 0.0)
        })
        .collect();
    let parts: Vec<_> = mesh
        .connected_parts_of(|cell| alive[cell.index()])
        .into_iter()
        .filter(|part| part.len() > 1)
        .collect();
    assert!(parts.len() >= 2, "two caps are left");
    for cells in &parts {
        let (part, origin) = mesh.part(cells).expect("a part");
        assert!(origin.iter().zip(&part.nodes).all(|(old, x)| mesh.nodes[old.index()] == *x));
        let volume: f64 = cells.iter().map(|cell| mesh.cell_volume(*cell)).sum();
        assert!((part.volume() / volume - 1.0).abs() < 1e-12);
        let rock = rocks(&part);
        let k = stiffness_matrix(&part, &rock, &sound(rock.len())).expect("a stiffness");
        let dense = DMatrix::from_fn(k.size(), k.size(), |i, j| k.get(i, j));
        let mut values: Vec<f64> = dense.symmetric_eigenvalues().iter().copied().collect();
        values.sort_by(f64::total_cmp);
        let largest = values[values.len() - 1];
        assert!(values[5].abs() < 1e-12 * largest, "six rigid modes: {:e}", values[5] / largest);
        assert!(values[6] > 1e-9 * largest, "no seventh: {:e}", values[6] / largest);
        CondensedGrain::new(part, &rock, 2700.0).expect("a grain of its own");
    }
}

#[test]
fn hertz_pressure_dents_the_sphere_as_the_half_space() {
    let (radius, a, p0) = (12e-3, 0.2449e-3, 406.1e6);
    let near =
        NearPoint { point: Vec3::new(0.0, 0.0, radius), radius: 1.3 * a, mesh_size: a / 2.0, growth: 1.0 };
    let mesh = sphere_mesh(radius, 6e-3, Some(&near)).expect("a mesh");
    let rock = Elastic::new(30e9, 0.2).expect("allowed");
    let laws = vec![rock; mesh.cells.len()];
    let grain = CondensedGrain::new(mesh, &laws, 2700.0).expect("a grain");
    let at = |x: f64, y: f64| grain.locate(&Vec3::new(x, y, (radius * radius - x * x - y * y).sqrt()));
    // The pressure integrated over the facets, 100 equal triangles each. (Forces at a few hundred points
    // would not do: the dent between them is less than under the pressure.)
    let parts = 10;
    let mut loads = Vec::new();
    for facet in &grain.mesh().surface {
        let [p, q, r] = [0, 1, 2].map(|k| grain.mesh().nodes[facet.nodes[k].index()]);
        if [p, q, r].iter().all(|x| x.z < 0.0 || x.xy().norm() > 2.0 * a) {
            continue;
        }
        let area = 0.5 * (q - p).cross(&(r - p)).norm() / (parts * parts) as f64;
        for (i, j) in (0..parts).flat_map(|i| (0..2 * (parts - i) - 1).map(move |j| (i, j))) {
            // Row i of the subdivision; even j point up, odd ones down.
            let third = if j % 2 == 0 { 1.0 / 3.0 } else { 2.0 / 3.0 };
            let s = (i as f64 + third) / parts as f64;
            let t = ((j / 2) as f64 + third) / parts as f64;
            let x = p + (q - p) * s + (r - p) * t;
            let inside = 1.0 - x.xy().norm_squared() / (a * a);
            if inside > 0.0 {
                loads.push((grain.locate(&x), Vec3::new(0.0, 0.0, -p0 * inside.sqrt() * area)));
            }
        }
    }
    let force: f64 = loads.iter().map(|(_, force)| -force.z).sum();
    let total = 2.0 / 3.0 * std::f64::consts::PI * p0 * a * a;
    assert!((force / total - 1.0).abs() < 2e-3, "{force} {total}");
    let u = grain.nodal_displacements(&loads);
    let down = |x: f64, y: f64| -> f64 {
        let point = at(x, y);
        let sum: f64 =
            point.shares.iter().map(|&(k, w)| u[grain.surface().nodes()[k as usize].index()].z * w).sum();
        -sum
    };
    let rim: f64 = (0..16)
        .map(|k| {
            let angle = std::f64::consts::TAU * k as f64 / 16.0;
            down(a * angle.cos(), a * angle.sin()) / 16.0
        })
        .sum();
    let dent = down(0.0, 0.0) - rim;
    let expected = std::f64::consts::PI * p0 * a / (4.0 * rock.contact_modulus());
    println!(
        "{} nodes: dent {dent:.4e} m, half-space {expected:.4e} m ({:+.2} %); pole {:.4e} m, half-space {:.4e} m",
        grain.mesh().nodes.len(),
        100.0 * (dent / expected - 1.0),
        down(0.0, 0.0),
        2.0 * expected
    );
    assert!((dent / expected - 1.0).abs() < a / radius, "{dent:e} {expected:e}");
}
