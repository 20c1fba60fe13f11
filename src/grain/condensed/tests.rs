//! Condensed grains against their full solution, symmetry, uniform stress, patches.
use nalgebra::{DMatrix, DVector};

use super::*;
use crate::element::tet10::mass_share;
use crate::geometry::Polyhedron;
use crate::grain::stiffness::sound;
use crate::mesh::{cuboid_mesh, grain_mesh};
use crate::tensor::draws;

const DENSITY: f64 = 2700.0;

fn shape() -> Polyhedron {
    let points: Vec<Vec3> = [
        [9.0, 1.0, 2.0],
        [-8.0, 3.0, -1.0],
        [1.0, 11.0, 3.0],
        [2.0, -10.0, 1.0],
        [0.0, 2.0, 14.0],
        [-1.0, 1.0, -13.0],
        [7.0, 6.0, -6.0],
        [-6.0, -6.0, 7.0],
        [6.0, -5.0, -7.0],
        [-5.0, 7.0, 6.0],
    ]
    .iter()
    .map(|p| Vec3::from(*p) * 1e-3)
    .collect();
    let hull = Polyhedron::convex_hull(&points).expect("a hull");
    hull.translated(&-hull.centroid())
}

fn rocks(count: usize) -> Vec<Elastic> {
    (0..count).map(|k| Elastic::new(30e9 * (1.0 + 0.2 * (k as f64).sin()), 0.2).expect("allowed")).collect()
}

fn grain() -> CondensedGrain {
    let mesh = grain_mesh(&shape(), 38).expect("a mesh");
    let rock = rocks(mesh.cells.len());
    CondensedGrain::new(mesh, &rock, DENSITY).expect("a grain")
}

fn loads(grain: &CondensedGrain) -> Vec<(SurfacePoint, Vec3)> {
    let mut draw = draws(3);
    (0..9)
        .map(|_| {
            let place = Vec3::new(draw(), draw(), draw()) * 0.04;
            (grain.locate(&place), Vec3::new(draw(), draw(), draw()) * 1e3)
        })
        .collect()
}

#[test]
fn a_grain_softened_again_has_the_bits_of_one_made_anew() {
    let mesh = grain_mesh(&shape(), 38).expect("a mesh");
    let rock = rocks(mesh.cells.len());
    let points = |k: usize| -> Vec<[Secant; POINT_COUNT]> {
        let of_cell = |cell: usize| Secant::of_share(1.0 / (1 + (cell * k) % 5) as f64);
        (0..rock.len()).map(|cell| std::array::from_fn(|_| of_cell(cell))).collect()
    };
    let make =
        |k| CondensedGrain::with_damage_on_demand(mesh.clone(), &rock, DENSITY, &points(k)).expect("a grain");
    let again = make(1).with_points(&points(3)).expect("on demand").expect("a grain");
    let anew = make(3);
    let loads = loads(&anew);
    assert_eq!(again.nodal_displacements(&loads), anew.nodal_displacements(&loads));
    assert_ne!(make(1).nodal_displacements(&loads), anew.nodal_displacements(&loads));
    assert!(grain().with_points(&points(1)).is_none());
}

/// Dense reference: `[K, M R; R^T M, 0]` with `u` and the accelerations unknown.
fn full_solution(grain: &CondensedGrain, loads: &[(SurfacePoint, Vec3)]) -> Vec<Vec3> {
    let mesh = grain.mesh();
    let n = 3 * mesh.nodes.len();
    let mut k = DMatrix::zeros(n, n);
    let mut m = DMatrix::zeros(n, n);
    let mut r = DMatrix::zeros(n, 6);
    for cell in mesh.cell_ids() {
        let element = StraightTet10::new(&mesh.corners(cell)).expect("a cell");
        let mut local = [[Mat3::zeros(); 10]; 10];
        element.add_stiffness(&mut local, grain.rock(cell), &[Secant::SOUND; 4]);
        let nodes = mesh.cells[cell.index()];
        for i in 0..10 {
            for j in 0..10 {
                let at = (3 * nodes[i].index(), 3 * nodes[j].index());
                let mut view = k.fixed_view_mut::<3, 3>(at.0, at.1);
                view += local[i][j];
                let mut view = m.fixed_view_mut::<3, 3>(at.0, at.1);
                view += Mat3::from_diagonal_element(DENSITY * element.volume * mass_share(i, j));
            }
        }
    }
    for (node, x) in mesh.nodes.iter().enumerate() {
        for axis in 0..3 {
            r[(3 * node + axis, axis)] = 1.0;
            let turn = Vec3::ith(axis, 1.0).cross(&(x - grain.mass_properties().centroid));
            r.fixed_view_mut::<3, 1>(3 * node, 3 + axis).copy_from(&turn);
        }
    }
    let mr = &m * &r;
    let mass = r.transpose() * &mr;
    let properties = grain.mass_properties();
    assert!((mass[(0, 0)] / properties.mass - 1.0).abs() < 1e-12);
    assert!((mass.fixed_view::<3, 3>(3, 3) - properties.inertia).norm() < 1e-12 * properties.inertia.norm());
    assert!(mass.fixed_view::<3, 3>(0, 3).norm() < 1e-14 * properties.mass);
    // Scaled so that both blocks weigh alike in the pivoting.
    let scale = k[(0, 0)] / mr.amax();
    let mut system = DMatrix::zeros(n + 6, n + 6);
    system.view_mut((0, 0), (n, n)).copy_from(&k);
    system.view_mut((0, n), (n, 6)).copy_from(&(&mr * scale));
    system.view_mut((n, 0), (6, n)).copy_from(&(mr.transpose() * scale));
    let mut rhs = DVector::zeros(n + 6);
    for (point, force) in loads {
        for &(node, weight) in &point.shares {
            let node = grain.surface().nodes()[node as usize].index();
            for axis in 0..3 {
                rhs[3 * node + axis] += weight * force[axis];
            }
        }
    }
    let x = system.lu().solve(&rhs).expect("a regular system");
    (0..mesh.nodes.len()).map(|node| Vec3::new(x[3 * node], x[3 * node + 1], x[3 * node + 2])).collect()
}

/// Of the field of these nodal displacements [J].
fn strain_energy(grain: &CondensedGrain, nodal: &[Vec3]) -> f64 {
    let mut energy = 0.0;
    for cell in grain.mesh().cell_ids() {
        let element = StraightTet10::new(&grain.mesh().corners(cell)).expect("a cell");
        let u = grain.mesh().cells[cell.index()].map(|node| nodal[node.index()]);
        for l in &crate::element::POINTS {
            energy +=
                grain.rock(cell).energy_density(&element.strain(l, &u)) * element.volume / POINT_COUNT as f64;
        }
    }
    energy
}

fn largest(u: &[Vec3]) -> f64 {
    u.iter().map(Vec3::norm).fold(0.0, f64::max)
}

#[test]
fn condensed_equals_full_solution() {
    let grain = grain();
    let loads = loads(&grain);
    let full = full_solution(&grain, &loads);
    let nodal = grain.nodal_displacements(&loads);
    let scale = largest(&full);
    for (a, b) in full.iter().zip(&nodal) {
        assert!((a - b).norm() < 1e-8 * scale);
    }
    let mut work = 0.0;
    for (point, force) in &loads {
        let u: Vec3 = loads.iter().map(|(place, force)| grain.flexibility(point, place) * force).sum();
        let expected: Vec3 =
            point.shares.iter().map(|&(k, w)| full[grain.surface().nodes()[k as usize].index()] * w).sum();
        assert!((expected - u).norm() < 1e-8 * scale);
        work += 0.5 * force.dot(&u);
    }
    assert!((grain.elastic_energy(&loads) / work - 1.0).abs() < 1e-10);
    // The strain energy of the recovered field is that same energy.
    let strain_energy = strain_energy(&grain, &nodal);
    assert!((strain_energy / work - 1.0).abs() < 1e-9, "{strain_energy} {work}");
}

#[test]
fn flexibility_is_symmetric_and_positive() {
    symmetric_and_positive(&grain());
    symmetric_and_positive(&grain().on_patches());
}

fn symmetric_and_positive(grain: &CondensedGrain) {
    let points: Vec<SurfacePoint> = loads(grain).iter().map(|(point, _)| point.clone()).collect();
    // Maxwell and Betti: the displacement at a under a force at b, and the other way round.
    for a in &points {
        for b in &points {
            let (ab, ba) = (grain.flexibility(a, b), grain.flexibility(b, a));
            assert!((ab - ba.transpose()).norm() < 1e-12 * ab.norm().max(grain.flexibility(a, a).norm()));
        }
    }
    let n = grain.surface().nodes().len();
    let mut c = DMatrix::zeros(3 * n, 3 * n);
    for i in 0..n {
        for j in 0..n {
            c.fixed_view_mut::<3, 3>(3 * i, 3 * j).copy_from(&grain.surface_block(i, j));
        }
    }
    assert!((&c - c.transpose()).norm() == 0.0);
    let values = c.symmetric_eigenvalues();
    assert!(values.min() > -1e-12 * values.max(), "{} {}", values.min(), values.max());
}

#[test]
fn balanced_rigid_loads_do_nothing_and_mean_motion_is_zero() {
    let grain = grain();
    let u = grain.nodal_displacements(&loads(&grain));
    let (mut mean, mut turn) = (Vec3::zeros(), Vec3::zeros());
    for cell in grain.mesh().cell_ids() {
        let nodes = grain.mesh().cells[cell.index()];
        let volume = grain.mesh().cell_volume(cell);
        for i in 0..10 {
            for j in 0..10 {
                let share = volume * mass_share(i, j);
                let x = grain.mesh().nodes[nodes[j].index()] - grain.mass_properties().centroid;
                mean += u[nodes[i].index()] * share;
                turn += x.cross(&u[nodes[i].index()]) * share;
            }
        }
    }
    let volume = grain.mesh().volume();
    assert!(mean.norm() < 1e-12 * volume * largest(&u));
    assert!(turn.norm() < 1e-12 * volume * largest(&u) * 0.01);
}

#[test]
fn uniform_traction_gives_uniform_stress() {
    // sigma n on every facet, as consistent nodal loads of a constant traction: a third of the
    // facet's force on each mid-side node, none on the corners.
    let mesh = grain_mesh(&shape(), 38).expect("a mesh");
    let rock = vec![Elastic::new(30e9, 0.2).expect("allowed"); mesh.cells.len()];
    let grain = CondensedGrain::new(mesh, &rock, DENSITY).expect("a grain");
    let sigma = Mat3::new(-3e6, 1e6, 0.5e6, 1e6, -1e6, 0.2e6, 0.5e6, 0.2e6, 2e6);
    let mut loads = Vec::new();
    for facet in &grain.mesh().surface {
        let [a, b, c] = [0, 1, 2].map(|k| grain.mesh().nodes[facet.nodes[k].index()]);
        let area = (b - a).cross(&(c - a)) * 0.5;
        for k in 3..6 {
            let middle = grain.mesh().nodes[facet.nodes[k].index()];
            loads.push((grain.locate(&middle), sigma * area / 3.0));
        }
    }
    let u = grain.nodal_displacements(&loads);
    for stress in grain.cell_stresses(&u).iter().flatten() {
        let found = Mat3::new(
            stress[0], stress[3], stress[5], stress[3], stress[1], stress[4], stress[5], stress[4], stress[2],
        );
        assert!((found - sigma).norm() < 1e-9 * sigma.norm(), "{found}");
    }
}

/// Work of forces on what is felt where they act is twice the strain energy of the field that they cause.
#[test]
fn forces_on_patches_do_the_work_that_is_stored() {
    let grain = grain().on_patches();
    let loads = loads(&grain);
    let nodal = grain.nodal_displacements(&loads);
    let stored = strain_energy(&grain, &nodal);
    assert!((grain.elastic_energy(&loads) / stored - 1.0).abs() < 1e-9);
    let mut field = Vec::new();
    grain.surface_field_into(&mut field, &loads);
    let felt =
        |place: &SurfacePoint| -> Vec3 { place.shares.iter().map(|&(k, w)| field[k as usize] * w).sum() };
    let work: f64 = loads.iter().map(|(place, force)| 0.5 * force.dot(&felt(place))).sum();
    assert!((work / stored - 1.0).abs() < 1e-9, "{work} {stored}");
}

#[test]
fn on_demand_equals_dense() {
    on_demand_is(|grain| grain);
    on_demand_is(CondensedGrain::on_patches);
}

fn on_demand_is(made: fn(CondensedGrain) -> CondensedGrain) {
    let mesh = cuboid_mesh([0.02, 0.01, 0.015], 0.005).expect("a mesh");
    let rock = rocks(mesh.cells.len());
    let dense = CondensedGrain::new(mesh, &rock, DENSITY).expect("a grain");
    let lazy = CondensedGrain::stressed(dense.mesh().clone(), &rock, DENSITY).expect("a grain");
    let (dense, lazy) = (made(dense), made(lazy));
    let loads = loads(&dense);
    for (a, _) in &loads {
        for (b, _) in &loads {
            let expected = dense.flexibility(a, b);
            assert!((lazy.flexibility(a, b) - expected).norm() < 1e-10 * dense.flexibility(a, a).norm());
        }
    }
    let (u, v) = (dense.nodal_displacements(&loads), lazy.nodal_displacements(&loads));
    let scale = largest(&u);
    assert!(u.iter().zip(&v).all(|(u, v)| (u - v).norm() < 1e-10 * scale));
}

/// What a continued run solves for alone has the bits of what the first run solved for together.
#[test]
fn columns_do_not_depend_on_what_is_solved_for_with_them() {
    let mesh = cuboid_mesh([0.012; 3], 0.002).expect("a mesh");
    let rock = rocks(mesh.cells.len());
    let grain = CondensedGrain::stressed(mesh, &rock, DENSITY).expect("a grain");
    let Flexibility::OnDemand { held, .. } = &grain.flexibility else { panic!("it is not dense") };
    let forces: Vec<Vec<(u32, f64)>> =
        (0..45).map(|k| (0..8).map(|j| (7 * k + j, 0.05 * f64::from(j + 1))).collect()).collect();
    let forces: Vec<&[(u32, f64)]> = forces.iter().map(|force| &force[..]).collect();
    let together = held.columns(grain.surface(), &forces);
    for (force, column) in forces.iter().zip(&together) {
        assert_eq!(held.columns(grain.surface(), &[force])[0], *column);
        let alone = held.column(grain.surface(), force);
        let scale = alone.iter().map(|block| block.norm()).fold(0.0, f64::max);
        assert!(alone.iter().zip(column).all(|(a, b)| (a - b).norm() < 1e-10 * scale));
    }
    let few = held.columns(grain.surface(), &forces[3..10]);
    assert_eq!(few[..], together[3..10]);
}

/// Blocks of a grain of very many nodes, asked for at once and one by one.
#[test]
fn blocks_do_not_depend_on_who_asks_first() {
    let mesh = cuboid_mesh([0.012; 3], 0.002).expect("a mesh");
    let rock = rocks(mesh.cells.len());
    let made = || CondensedGrain::stressed(mesh.clone(), &rock, DENSITY).expect("a grain");
    for (one, other) in [(made(), made()), (made().on_patches(), made().on_patches())] {
        assert!(one.surface().nodes().len() > DENSE_SURFACE_NODES);
        let points: Vec<SurfacePoint> = loads(&one).into_iter().map(|(point, _)| point).collect();
        let places: Vec<&SurfacePoint> = points.iter().collect();
        let at_once = one.flexibilities(&places);
        for (k, block) in at_once.iter().enumerate() {
            let (i, j) = (k / places.len(), k % places.len());
            let alone = other.flexibility(places[i.max(j)], places[i.min(j)]);
            assert_eq!(*block, if i > j { alone } else { alone.transpose() }, "{i} {j}");
        }
    }
}

#[test]
fn grain_is_small() {
    let memory = grain().memory();
    assert!(memory < 400_000, "{memory} bytes");
}

#[test]
fn grains_can_be_shared_between_threads() {
    fn shared<T: Send + Sync>() {}
    shared::<CondensedGrain>();
}

#[test]
fn unusable_grains_are_refused() {
    let mesh = grain_mesh(&shape(), 38).expect("a mesh");
    let rock = rocks(mesh.cells.len());
    assert!(CondensedGrain::new(mesh.clone(), &rock[1..], DENSITY).is_err());
    assert!(CondensedGrain::new(mesh.clone(), &rock, 0.0).is_err());
    let gone = vec![[const { Secant::of_share(0.0) }; POINT_COUNT]; rock.len()];
    assert!(CondensedGrain::with_damage_on_demand(mesh, &rock, DENSITY, &gone).is_err());
}

/// Between points and forces that are spread, at once and one by one, kept or not.
#[test]
fn flexibilities_are_those_of_each_pair() {
    let dense = grain();
    let points = sound(dense.mesh().cells.len());
    let rock: Vec<Elastic> = dense.mesh().cell_ids().map(|cell| *dense.rock(cell)).collect();
    let on_demand =
        CondensedGrain::with_damage_on_demand(dense.mesh().clone(), &rock, 2700.0, &points).expect("a grain");
    for grain in [&dense, &on_demand] {
        let points: Vec<SurfacePoint> = loads(grain).iter().map(|(point, _)| point.clone()).collect();
        let spread = |over: &[SurfacePoint]| {
            let mut shares = std::collections::BTreeMap::new();
            for (node, share) in over.iter().flat_map(|point| &point.shares) {
                *shares.entry(*node).or_insert(0.0) += share / over.len() as f64;
            }
            SurfacePoint { shares: shares.into_iter().collect(), ..over[0].clone() }
        };
        let places = [spread(&points[..2]), points[0].clone(), spread(&points), points[2].clone()];
        let places: Vec<&SurfacePoint> = places.iter().collect();
        assert!(places[0].shares.len() > OF_POINT && places[2].shares.len() > places[0].shares.len());
        let first = grain.flexibilities(&places);
        assert_eq!(first, grain.flexibilities(&places));
        let scale = first.iter().map(|block| block.norm()).fold(0.0, f64::max);
        for (k, block) in first.iter().enumerate() {
            let expected = grain.flexibility(places[k / 4], places[k % 4]);
            assert!((block - expected).norm() < 1e-11 * scale, "{k}: {block} {expected}");
        }
    }
}
