//! Grains that break, rigid ones and ones that bend. Reference: a strength that nothing reaches gives the bits of grains that cannot break. Weak rock
//! crushes on, increment after increment, without a stop: every accepted state is in balance, no bodies overlap but as contacts know, and the energy is
//! accounted for; a run that goes on from a stored state has the bits of one that was not interrupted.

use std::collections::BTreeSet;
use std::sync::Arc;

use riprap::assembly::{ContactPoint, PairWork};
use riprap::contact::memory::{Crushable, PairKey};
use riprap::element::Strains;
use riprap::grain::{Ancestry, CondensedGrain, DamagedGrain};
use riprap::loading::StageEnd;
use riprap::material::{DamageLaw, DamageParameters, DamageState, Elastic};
use riprap::mesh::CellId;
use riprap::model::fracture::Fracture;
use riprap::model::{BodyKind, DamageCounts, Deformation};
use riprap::solver::fidelity::change;
use riprap::solver::{Stabilisation, audit};
use riprap::tensor::Vec3;
use riprap::triaxial::{Cover, Lateral, Rig, RigState, Rims, Row, Test};

use crate::behind::with_asperities;
use crate::ready::{
    PRESSURE, condensed_grains, consolidate, drive, rig, rubber, run, seat, specimen, try_to_consolidate,
    try_to_consolidate_seated,
};
use crate::resolved::fully;

const PRESSED: Cover = Cover::Pressure(Rims::Bonded);

#[derive(Clone, Copy)]
struct Kind {
    /// How grains deform; rigid ones are so in their contacts.
    deforms: fn(Arc<CondensedGrain>) -> Deformation,
    /// Whether what fails stays as rubble, or leaves.
    keeps_rubble: bool,
    /// Whether contacts are asperities, behind which forces act on patches.
    crushes: bool,
    cover: Cover,
}

const RIGID: Kind =
    Kind { deforms: |_| Deformation::Rigid, keeps_rubble: false, crushes: false, cover: PRESSED };
const BENDING: Kind = Kind { deforms: Deformation::condensed, ..RIGID };
const FULL: Kind = Kind { deforms: |grain| fully(grain, Strains::Finite), ..RIGID };

/// The rig around sixteen grains whose rock has this tensile strength [Pa], a tenth of that in compression.
fn breakable(tensile: f64, kind: Kind) -> Rig {
    breakable_by_cells(&|_, _| tensile, kind)
}

/// The same with strengths by grain and cell.
fn breakable_by_cells(tensile: &dyn Fn(usize, usize) -> f64, kind: Kind) -> Rig {
    let parameters = DamageParameters::default();
    let elastic = Elastic::new(3e10, 0.2).expect("allowed");
    let law =
        |strength: f64| DamageLaw::new(elastic, strength, 10.0 * strength, &parameters, 0.01).expect("a law");
    let rig = rig(kind.cover);
    let mut rig = if kind.crushes { with_asperities(rig) } else { rig };
    let grains = condensed_grains(&rig, 38).into_iter().enumerate().map(|(index, condensed)| {
        let ancestry = Ancestry::of_grain(index as u32);
        let laws = (0..condensed.mesh().cells.len()).map(|cell| law(tensile(index, cell))).collect();
        let damaged = DamagedGrain::over(condensed.clone(), laws, 2700.0, ancestry).expect("a grain");
        let damaged = if kind.keeps_rubble { damaged.keeping_rubble() } else { damaged };
        ((kind.deforms)(condensed), Some(Arc::new(damaged)))
    });
    rig.make(grains);
    rig
}

/// Consolidates; grains that bend are seated as rigid ones, as `simulation::seating` does it.
fn compressed(rig: &mut Rig, increments: usize) -> (Test, Vec<Row>) {
    let (test, rows, end) = try_to_compress(rig, increments);
    assert_eq!(end, StageEnd::Finished);
    (test, rows)
}

/// The same, wherever it ends.
fn try_to_compress(rig: &mut Rig, increments: usize) -> (Test, Vec<Row>, StageEnd) {
    let Some(elasticity) = rig.stiffen() else { return try_to_consolidate(rig, increments) };
    let mut test = Test::new(rig);
    assert!(seat(rig, &mut test));
    rig.soften(elasticity);
    let (rows, end) = try_to_consolidate_seated(rig, &mut test, increments);
    (test, rows, end)
}

#[test]
fn grains_that_cannot_break_give_the_bits_of_rigid_ones() {
    strength_that_nothing_reaches(RIGID, rig(PRESSED));
}

#[test]
fn grains_that_bend_and_cannot_break_give_the_bits_of_unbreakable_ones() {
    for kind in [BENDING, FULL] {
        let mut unbreakable = rig(PRESSED);
        let bodies = breakable(1e12, kind).model.bodies;
        unbreakable.make(bodies.into_iter().map(|body| (body.deformation, None)).take(16));
        strength_that_nothing_reaches(kind, unbreakable);
    }
}

fn strength_that_nothing_reaches(kind: Kind, unbreakable: Rig) {
    let results = [unbreakable, breakable(1e12, kind)].map(|mut rig| {
        let (mut test, mut rows) = compressed(&mut rig, 6);
        let (sheared, end) = run(&mut rig, &mut test, &drive(4e-4, Lateral::Pressure));
        assert_eq!(end, StageEnd::Finished);
        rows.extend(sheared);
        (rows, rig.committed)
    });
    assert_eq!(results[1].0[7].damage, DamageCounts::default());
    // As text, which tells every bit and lets what is no number equal itself.
    assert_eq!(format!("{:?}", results[0]), format!("{:?}", results[1]));
}

/// What is lost of the weak specimen's work without an account: the issue asks for 1e-2.
const CLOSED: f64 = 1e-2;
/// Tensile strengths [Pa] about that at which a mean contact force of 0.4 MPa times the grains' size squared begins to break them. Half of sixteen grains
/// may fall down at once, which has no rest nearby, or loses energy unseen where a body goes some roundings in one step (8 % of the work with the first
/// strength): one of them has to come through.
const WEAK: [f64; 2] = [1.5e6, 1.65e6];

#[test]
fn weak_grains_break_on_and_a_stored_state_goes_on_to_the_same_bits() {
    break_on(RIGID);
}

/// Contacts soften where their bodies are, displacements included: what that frees is booked in full, and so is what bodies that bend store at its start.
#[test]
fn energy_closes_while_contacts_of_bending_grains_soften() {
    let mut rig = breakable(4e6, Kind { keeps_rubble: true, crushes: true, ..BENDING });
    rig.settings.stabilisation = Stabilisation::Unrest(3e-3);
    let (mut test, before) = compressed(&mut rig, 6);
    let (rows, end) = run(&mut rig, &mut test, &drive(4e-3, Lateral::Pressure));
    assert_eq!(end, StageEnd::Finished);
    let [before, after] = [&before, &rows].map(|rows| &rows[rows.len() - 1].ledger);
    let [work, error, softened] = [
        after.external - before.external,
        after.error() - before.error(),
        after.damage - after.indentation - (before.damage - before.indentation),
    ];
    println!("{work:e}, {error:e}, {softened:e}, {}", rows.len());
    assert!(softened > 3e-3 * work, "{softened:e} of {work:e}");
    assert!(error.abs() < 1e-3 * work, "{error:e} of {work:e}");
}

/// As rigid ones: they bend between collapses, and what is left of them afterwards.
#[test]
fn weak_grains_that_bend_break_on_and_a_stored_state_goes_on_to_the_same_bits() {
    let mut whole = break_on(BENDING);
    let broken = |body: &&riprap::model::Body| body.damaged().is_some_and(|grain| grain.is_parted());
    let broken: Vec<_> = whole.model.bodies.iter().filter(broken).collect();
    assert!(!broken.is_empty() && broken.iter().all(|body| body.is_elastic()), "{}", broken.len());

    // They rest in collapses and wake behind them: forces stay as they are, to rounding, in contacts on rock that has softened, too.
    let softened = whole.committed.memory.values().flat_map(|pair| &pair.points);
    assert!(softened.filter(|point| point.stiffness_left < 1.0).count() >= 3);
    let bends = |body: &usize| whole.model.bodies[*body].is_elastic();
    let grains: Vec<usize> = (0..whole.model.bodies.len()).filter(bends).collect();
    let changed = [[&[][..], &grains], [&grains, &[][..]]].map(|changes| {
        change(&mut whole.model, &mut whole.committed, &mut whole.contacts, PRESSURE, changes)
    });
    for done in &changed {
        assert!(done.woken + done.rested == grains.len() && done.jump < 1e-9, "{done:?}");
    }
    let [rested, woken] = changed.map(|done| done.energy);
    println!("energy {rested:e} and {woken:e} J");
    assert!((rested + woken).abs() < 1e-9 * rested.abs(), "{rested:e} {woken:e}");
}

/// The same behind asperities, rigid and bending. What contacts remember to have crushed, those of new shapes included, their features know.
#[test]
fn weak_grains_behind_asperities_break_on_and_a_stored_state_goes_on_to_the_same_bits() {
    for kind in [RIGID, BENDING] {
        let memory = break_on(Kind { crushes: true, ..kind }).committed.memory;
        let points = memory.iter().flat_map(|(key, pair)| pair.points.iter().map(|point| (*key, point)));
        let crushed = points.filter(|(_, point)| point.depth > 0.0);
        let mut known = 0;
        for (key, point) in crushed {
            let place = Crushable::of((key, point.feature)).expect("a corner or two edges");
            assert!(memory.crushed.get(&place).is_some_and(|depth| *depth >= point.depth), "{place:?}");
            known += 1;
        }
        assert!(known > 20, "{known}");
    }
}

/// The same of grains all of whose nodes move, whose parts do so, too. Where they rest and wake forces stay as they are, but for finite strains.
#[test]
fn weak_full_grains_break_on_and_a_stored_state_goes_on_to_the_same_bits() {
    let mut rig = broken(1.8e6, Kind { crushes: true, ..FULL }).expect("comes to its end");
    let is_parted = |body: &&riprap::model::Body| body.damaged().is_some_and(|grain| grain.is_parted());
    let parted: Vec<_> = rig.model.bodies.iter().filter(is_parted).collect();
    assert!(!parted.is_empty() && parted.iter().all(|body| body.full().is_some()), "{}", parted.len());
    let full = |body: &usize| rig.model.bodies[*body].full().is_some();
    let grains: Vec<usize> = (0..rig.model.bodies.len()).filter(full).collect();
    for changes in [[&[][..], &grains], [&grains, &[][..]]] {
        let done = change(&mut rig.model, &mut rig.committed, &mut rig.contacts, PRESSURE, changes);
        println!("{done:?}");
        assert!(done.woken + done.rested == grains.len() && done.jump < 1e-4, "{done:?}");
    }
}

/// A force between two bodies as committed, on the first of them [N], and where it acts [m].
struct Force {
    bodies: [usize; 2],
    point: Vec3,
    force: Vec3,
}

fn forces(rig: &mut Rig) -> Vec<Force> {
    let Rig { model, committed, contacts, .. } = rig;
    contacts.start(model, committed);
    contacts.evaluate(model, committed, &committed.poses).expect("no overlap");
    let force = |(pair, point): (&PairWork, &ContactPoint)| {
        let e = &point.evaluation;
        let force = Vec3::new(e.wrench[0], e.wrench[1], e.wrench[2]);
        Force { bodies: [pair.a(), pair.b()], point: e.point, force }
    };
    contacts.active().map(force).collect()
}

/// What one body exerts on another [N].
fn exerted(forces: &[Force], by: usize, on: usize) -> Vec3 {
    let sign = |force: &Force| match force.bodies {
        bodies if bodies == [on, by] => 1.0,
        bodies if bodies == [by, on] => -1.0,
        _ => 0.0,
    };
    forces.iter().map(|force| force.force * sign(force)).sum()
}

/// A sheared rig of unbreakable grains at rest, in whose contacts friction holds.
fn sheared(kind: Kind) -> Rig {
    let mut rig = breakable(1e12, kind);
    let (mut test, _) = compressed(&mut rig, 6);
    let (_, end) = run(&mut rig, &mut test, &drive(1e-3, Lateral::Pressure));
    assert_eq!(end, StageEnd::Finished);
    let grains: Vec<usize> = (0..specimen().grains.len()).collect();
    change(&mut rig.model, &mut rig.committed, &mut rig.contacts, PRESSURE, [&[], &grains]);
    rig
}

/// A grain that loses a corner, all cells around it, has a new shape, and its contacts new features. Reference: where the corner is nowhere near, rigid grains and
/// grains at rest for a collapse bear on each other as before, along the normal and across it. (The latter would jump to that of rigid grains overlapping by all
/// that bent, half as much again, and friction would be gone.)
#[test]
fn a_new_shape_leaves_the_forces_of_contacts_that_it_is_nowhere_near() {
    for kind in [RIGID, BENDING] {
        let mut rig = sheared(kind);
        let before = forces(&mut rig);
        let mut changes = Vec::new();
        for body in 0..specimen().grains.len() {
            let whole = rig.model.bodies[body].damaged().cloned().expect("breakable");
            let (nominal, pose) = (&rig.model.bodies[body].nominal, rig.committed.poses[body]);
            let size = rig.model.bodies[body].rotation_scale;
            for lost in &nominal.vertices {
                let is_lost =
                    |cell: CellId| whole.mesh().corners(cell).iter().any(|x| (x - lost).norm() < 1e-9);
                let (mut broken, fracture) = without(&rig, body, is_lost);
                if broken.model.bodies[body].nominal == *nominal {
                    continue;
                }
                broken.model.bodies[body].rest();
                broken.contacts.forget_bodies();
                broken.contacts.inherit(&broken.model, &mut broken.committed, &[fracture]);
                let after = forces(&mut broken);
                let lost = pose.to_space(lost);
                let is_far =
                    |force: &&Force| force.bodies.contains(&body) && (force.point - lost).norm() > size;
                for [a, b] in before.iter().filter(is_far).map(|force| force.bodies) {
                    let was = exerted(&before, a, b);
                    changes.push((exerted(&after, a, b) - was).norm() / was.norm());
                }
            }
        }
        changes.sort_by(f64::total_cmp);
        let at = |share: f64| changes[(share * changes.len() as f64) as usize];
        println!("{} forces; median change {:.3}, nine tenths {:.3}", changes.len(), at(0.5), at(0.9));
        assert!(changes.len() > 50 && at(0.5) < 0.05, "{} {}", changes.len(), at(0.5));
    }
}

/// Of a grain that comes apart other bodies are left, with other numbers. Reference: where a body becomes one of the same shape behind all others, which turns
/// its contacts with those between, forces stay as they are.
#[test]
fn contacts_of_a_part_go_on_with_their_bodies_the_other_way_round() {
    let mut rig = sheared(RIGID);
    let before = forces(&mut rig);
    for body in [3, 8, 15] {
        let mut rig = rig.clone();
        let part = rig.model.bodies.len();
        let is_its = |(a, b): &PairKey| *a as usize == body || *b as usize == body;
        let former = rig.committed.memory.extract_if(.., |key, _| is_its(key)).collect();
        let (copy, shape) = (rig.model.bodies[body].clone(), rig.model.shapes[body].clone());
        rig.model.bodies.push(copy);
        rig.model.shapes.push(shape);
        rig.model.bodies[body].kind = BodyKind::Gone;
        rig.committed.poses.push(rig.committed.poses[body]);
        rig.committed.fields.push(Vec::new());
        rig.contacts.forget_bodies();
        let fracture = Fracture {
            body,
            parts: vec![part],
            deleted_cells: 0,
            crushed_volume: 0.0,
            lost_parts: 0,
            lost_energy: 0.0,
            former,
        };
        rig.contacts.inherit(&rig.model, &mut rig.committed, &[fracture]);
        // Its number is behind all others: in contacts with bodies that were behind it the two change places.
        let turned = before.iter().filter(|force| force.bodies[0] == body).count();
        let after = forces(&mut rig);
        let others = before.iter().filter_map(|force| match force.bodies {
            [a, b] if a == body => Some(b),
            [a, b] if b == body => Some(a),
            _ => None,
        });
        let mut most = 0.0f64;
        for other in others {
            let [was, is] = [exerted(&before, body, other), exerted(&after, part, other)];
            most = most.max((is - was).norm() / was.norm());
        }
        assert!(turned > 0 && most < 1e-6, "{body}: {turned} turned, {most:e}");
    }
}

/// As under a pressure that acts on the grains themselves: the sheet follows what is left of them.
#[test]
fn weak_grains_break_on_in_rubber_and_a_stored_state_goes_on_to_the_same_bits() {
    break_on(Kind { cover: rubber(), ..RIGID });
}

/// The rig where the rock of `body` in `is_lost` cells has failed and is broken up.
fn without(rig: &Rig, body: usize, is_lost: impl Fn(CellId) -> bool) -> (Rig, Fracture) {
    cut(rig, body, is_lost, false)
}

/// The same of a body that `keeps` its reference point.
fn cut(rig: &Rig, body: usize, is_lost: impl Fn(CellId) -> bool, keeps: bool) -> (Rig, Fracture) {
    let mut rig = rig.clone();
    let whole = rig.model.bodies[body].damaged().cloned().expect("breakable");
    let mesh = whole.mesh();
    let failed = DamageState { failed: true, ..DamageState::default() };
    let state = |cell: CellId| if is_lost(cell) { failed } else { DamageState::default() };
    let states = mesh.cell_ids().map(|cell| [state(cell); 4]).collect();
    let laws = mesh.cell_ids().map(|cell| *whole.law(cell)).collect();
    let origin = Ancestry::of_grain(body as u32);
    let cut = DamagedGrain::with_states(mesh.clone(), laws, 2700.0, states, origin);
    let cut = cut.expect("a grain").losing_below(1e-9);
    rig.model.bodies[body].breakage = rig.model.bodies[body].breakage.of(Arc::new(cut));
    let mut displacements = vec![Vec::new(); rig.model.bodies.len()];
    displacements[body] = vec![Vec3::zeros(); mesh.nodes.len()];
    let mut fractures = rig.model.break_up(&mut rig.committed, &displacements, |_| keeps).expect("parts");
    (rig, fractures.remove(0))
}

/// Cells across a grain fail; most are too coarse for that to leave two parts that are thick enough.
fn halved(rig: &Rig, keeps: bool) -> (Rig, Fracture) {
    let across = |(body, axis, off): (usize, usize, f64)| {
        let whole = rig.model.bodies[body].damaged().cloned().expect("breakable");
        let mesh = whole.mesh();
        let is_across = |cell: CellId| {
            let heights = mesh.corners(cell).map(|p| p[axis] - mesh.centroid()[axis] - off);
            heights.iter().any(|z| *z <= 0.0) && heights.iter().any(|z| *z >= 0.0)
        };
        let (rig, fracture) = cut(rig, body, is_across, keeps);
        (fracture.parts.len() > 1).then_some((rig, fracture))
    };
    let planes = || (0..3).flat_map(|axis| [-6e-3, -3e-3, 0.0, 3e-3, 6e-3].map(|off| (axis, off)));
    let mut cuts =
        (0..specimen().grains.len()).flat_map(|body| planes().map(move |(axis, off)| (body, axis, off)));
    cuts.find_map(across).expect("two parts")
}

/// What stages say of a driven body is of its reference point, and nothing holds what comes off a fixed one. Reference: nothing has moved.
#[test]
fn a_named_body_keeps_its_frame_and_a_fixed_one_lets_go_of_parts() {
    let whole = breakable(1e12, RIGID);
    for keeps in [true, false] {
        let (_, of_grain) = halved(&whole, keeps);
        let mut fixed = whole.clone();
        fixed.model.bodies[of_grain.body].kind = BodyKind::Fixed;
        let (rig, fracture) = halved(&fixed, keeps);
        let [first, others @ ..] = &fracture.parts[..] else { panic!("no parts") };
        assert_eq!((*first, rig.model.bodies[*first].kind), (fracture.body, BodyKind::Fixed));
        assert!(others.iter().all(|part| rig.model.bodies[*part].kind == BodyKind::Placed));
        let [before, after] = [&whole, &rig].map(|rig| rig.committed.poses[*first]);
        let moved = (after.position - before.position).norm();
        assert!(if keeps { moved < 1e-12 } else { moved > 1e-4 }, "{keeps}: {moved}");
        // The rock itself is where it was.
        let at = |rig: &Rig| {
            let grain = rig.model.bodies[*first].damaged().expect("rock");
            rig.committed.poses[*first].to_space(&grain.mesh().nodes[0])
        };
        let whole_grain = whole.model.bodies[*first].damaged().expect("rock");
        let nodes = whole_grain.mesh().nodes.iter().map(|node| before.to_space(node));
        let nearest = nodes.map(|node| (node - at(&rig)).norm()).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-12, "{keeps}: {nearest}");
    }
}

/// A grain that comes apart puts bodies in front of the sheet's nodes. Reference: nothing but their numbers changes. Then the specimen finds a balance.
#[test]
fn a_grain_in_rubber_comes_apart() {
    let mut rig = breakable(1e12, Kind { cover: rubber(), ..RIGID });
    let (mut test, _) = consolidate(&mut rig, 4);
    let sheet = |rig: &Rig| {
        let (mut positions, membrane) = (Vec::new(), rig.model.membrane.as_ref().expect("there"));
        membrane.positions_into(&mut positions, &rig.committed.poses);
        positions
    };
    let before = (rig.model.bodies.len(), sheet(&rig), rig.volume(&rig.committed.poses));
    let (halves, fracture) = halved(&rig, false);
    let more = fracture.parts.len() - 1;
    rig = halves;
    assert_eq!(rig.model.bodies.len(), before.0 + more);
    assert_eq!(rig.committed.poses.len(), rig.model.carriers());
    assert!(sheet(&rig) == before.1 && rig.volume(&rig.committed.poses) == before.2);
    let (rows, end) = run(&mut rig, &mut test, &drive(1e-4, Lateral::Pressure));
    assert_eq!(end, StageEnd::Finished);
    for row in &rows {
        assert!(row.out_of_balance < 1e-3 && row.damage.fragments == more + 1, "{row:?}");
    }
}

/// As without; and no room is lost: a grain that never came apart has the contact body that it was generated with, and its cells and its
/// rubble are all cells.
#[test]
fn weak_grains_that_stay_as_rubble_keep_their_room() {
    let kind = Kind { keeps_rubble: true, ..RIGID };
    let whole = break_on(kind);
    let before = breakable(WEAK[0], kind).model;
    let mut crushed = 0;
    for (index, first) in before.bodies.iter().enumerate() {
        let (Some(generated), Some(grain)) = (first.damaged(), whole.model.bodies[index].damaged()) else {
            continue;
        };
        if grain.ancestry().generation == 0 {
            crushed += grain.rubble().len();
            assert!(whole.model.bodies[index].nominal == first.nominal, "{index}");
            let share = grain.room() / generated.room();
            assert!((share - 1.0).abs() < 1e-12, "{index}: {share}");
        }
    }
    assert!(crushed >= 1);
}

/// Shears weak grains until some have lost cells; where it ended.
fn break_on(kind: Kind) -> Rig {
    WEAK.iter().find_map(|tensile| broken(*tensile, kind)).expect("a strength at which it comes to its end")
}

/// `None` where a collapse does not come to rest, or does not close its energy.
fn broken(tensile: f64, kind: Kind) -> Option<Rig> {
    let came_through = |end: &StageEnd| match end {
        StageEnd::Finished => true,
        StageEnd::Stopped { reason } => {
            assert!(reason.contains("out of balance"), "{reason}");
            println!("{tensile:e} Pa: {reason}");
            false
        }
        StageEnd::Interrupted => panic!("nobody interrupted"),
    };
    let mut whole = breakable(tensile, kind);
    let (mut test, mut rows, end) = try_to_compress(&mut whole, 6);
    if !came_through(&end) {
        return None;
    }
    let stage = drive(1e-3, Lateral::Pressure);
    let mut stored: Option<(Vec<u8>, Test, usize)> = None;
    let end = test.run(&mut whole, &stage, &mut |rig, step| {
        rows.push(step.row.clone());
        let fault = audit::fault(&rig.model, &rig.contacts, &rig.committed.poses);
        assert!(fault.is_none(), "{fault:?}");
        if stored.is_none() && !rig.failing.is_empty() {
            let bytes = postcard::to_allocvec(&rig.state()).expect("bytes");
            stored = Some((bytes, step.test.clone(), rows.len()));
        }
        true
    });
    if !came_through(&end) {
        return None;
    }
    let last: &Row = &rows[rows.len() - 1];
    assert!(last.damage.deleted_cells >= 3, "{:?}", last.damage);
    for row in &rows {
        assert!(row.out_of_balance < 1e-3 && row.max_penetration < 1e-3, "{row:?}");
    }
    // One volume: void ratio and strain tell the same, but for what covers laid anew jumped by.
    let volume = |row: &Row| {
        let m = &row.measures;
        (1.0 + m.void_ratio) / ((1.0 - m.volumetric_strain) * m.cover_volume_ratio)
    };
    // Strains count anew once, behind the consolidation.
    let breaks = rows.windows(2).filter(|two| (volume(&two[1]) / volume(&two[0]) - 1.0).abs() > 1e-12);
    assert!(breaks.count() <= 1);
    assert!(last.ledger.damage > 0.0, "{:?}", last.ledger);
    let closes = last.ledger.error().abs() < CLOSED * last.ledger.external.abs();
    if !closes {
        println!("{tensile:e} Pa: {:?}", last.ledger);
        return None;
    }

    let (bytes, mut test, done) = stored.expect("cells failed in the shear");
    let mut fresh = breakable(tensile, kind);
    let state: RigState<'_> = postcard::from_bytes(&bytes).expect("a state");
    assert!(fresh.restore(state).expect("grains"), "another specimen");
    let (rest, end) = run(&mut fresh, &mut test, &stage);
    assert_eq!(end, StageEnd::Finished);
    assert_eq!(format!("{rest:?}"), format!("{:?}", &rows[done..]));
    assert!(fresh.committed == whole.committed);
    Some(whole)
}

/// Grains that bend go on bending in their new shapes. Reference: contacts of the grains that lost cells bear as before, in the median; without its displacement
/// a grain would be in its neighbours by all that it had bent.
#[test]
fn grains_that_bend_keep_what_their_contacts_bear_when_they_break() {
    let mut changes = Vec::new();
    for tensile in WEAK {
        let mut rig = breakable(tensile, BENDING);
        let (mut test, _, end) = try_to_compress(&mut rig, 6);
        if end != StageEnd::Finished {
            continue;
        }
        test.run(&mut rig, &drive(1e-3, Lateral::Pressure), &mut |rig, _| {
            let failing: BTreeSet<usize> = rig.failing.bodies().collect();
            let mut rig = rig.clone();
            let before = forces(&mut rig);
            let known = !failing.is_empty() && rig.break_up().is_ok();
            let after = if known { forces(&mut rig) } else { return true };
            let its = before.iter().filter(|force| force.bodies.iter().any(|body| failing.contains(body)));
            let pairs: BTreeSet<[usize; 2]> = its.map(|force| force.bodies).collect();
            changes.extend(pairs.into_iter().map(|[a, b]| {
                let was = exerted(&before, a, b);
                (exerted(&after, a, b) - was).norm() / was.norm()
            }));
            changes.len() < 100
        });
    }
    changes.sort_by(f64::total_cmp);
    let at = |share: f64| changes[(share * changes.len() as f64) as usize];
    println!("{} forces; a quarter change by {:.3}, half by {:.3}", changes.len(), at(0.25), at(0.5));
    assert!(changes.len() > 20 && at(0.5) < 0.1, "{} {}", changes.len(), at(0.5));
}

/// In stabilised increments what contacts on failed rock lose is booked where it fails, and not again while what they held moves. Where most of the
/// work is lost in one fall, more of it than that goes unseen.
#[test]
fn what_fails_is_booked_once() {
    let kind = Kind { crushes: true, keeps_rubble: true, ..RIGID };
    let mut calm = 0;
    for rock in 0..6 {
        let mut rig = breakable_by_cells(&|grain, cell| 0.5 * draw(rock)(grain, cell), kind);
        rig.settings.stabilisation = Stabilisation::Unrest(3e-3);
        let (mut test, _) = compressed(&mut rig, 6);
        let (rows, end) = run(&mut rig, &mut test, &drive(2e-3, Lateral::Pressure));
        assert_eq!(end, StageEnd::Finished);
        let ledger = &rows[rows.len() - 1].ledger;
        if ledger.stabilisation < 0.25 * ledger.external {
            calm += 1;
            assert!(ledger.crushing > 0.0, "rock {rock}: {ledger:?}");
            let error = ledger.error() / ledger.external;
            assert!(error.abs() < CLOSED, "rock {rock}: {error}, {ledger:?}");
        }
    }
    assert!(calm >= 4, "{calm}");
}

/// Strengths of rock number `draw` [Pa]: from 3 to 7.5 MPa, another in each cell.
fn draw(draw: usize) -> impl Fn(usize, usize) -> f64 {
    move |grain, cell| {
        let phase = 12.9898 * grain as f64 + 78.233 * cell as f64 + 37.719 * draw as f64;
        WEAK[0] * (2.0 + 3.0 * (43758.5453 * phase.sin()).rem_euclid(1.0))
    }
}

/// Half the limit on how far damage moves at once. Until a point fails, q is the same to 1 % of its largest: a point may go too far by half the
/// difference of the limits, which is 1.3 % of the stiffness of a contact on its cell, and such contacts are few. What breaks after it is
/// another path of an unstable process, so there only the number of cells lost in four rocks is compared: the means may differ by no
/// more than the rocks do among themselves.
#[test]
fn half_the_limit_of_damage_breaks_as_many_cells() {
    let mut lost = [[0.0; 4]; 2];
    let mut compared = 0;
    for number in 0..4 {
        let [full, half] = [0.2, 0.1].map(|limit| {
            let mut rig = breakable_by_cells(&draw(number), RIGID);
            rig.settings.damage.max_change = limit;
            let (mut test, mut rows) = consolidate(&mut rig, 6);
            let (sheared, end) = run(&mut rig, &mut test, &drive(1.5e-3, Lateral::Pressure));
            assert_eq!(end, StageEnd::Finished);
            rows.extend(sheared);
            rows
        });
        let whole = |row: &&Row| row.damage.failed_points == 0;
        let sound: Vec<(&Row, &Row)> =
            full.iter().take_while(whole).zip(half.iter().take_while(whole)).collect();
        let q = |row: &Row| row.measures.deviatoric_stress;
        let largest = full.iter().map(q).fold(0.0, f64::max);
        compared += sound.iter().filter(|(row, _)| q(row) > 0.1 * largest).count();
        for (a, b) in sound {
            assert!((q(a) - q(b)).abs() < 1e-2 * largest, "{:e} {:e} of {largest:e}", q(a), q(b));
        }
        for (lost, rows) in lost.iter_mut().zip([&full, &half]) {
            lost[number] = rows[rows.len() - 1].damage.deleted_cells as f64;
        }
    }
    assert!(compared >= 2, "{compared} rows under shear");
    let mean = |lost: &[f64; 4]| lost.iter().sum::<f64>() / 4.0;
    let spread = |lost: &[f64; 4]| (lost.iter().map(|l| (l - mean(lost)).powi(2)).sum::<f64>() / 3.0).sqrt();
    assert!(mean(&lost[0]) >= 3.0, "{lost:?}");
    assert!((mean(&lost[0]) - mean(&lost[1])).abs() <= spread(&lost[0]).max(spread(&lost[1])), "{lost:?}");
}

/// A grain at the side that has turned about itself takes its part of the cover with it, inside out. A new cover lies outside again, and the nominal
/// volume, the cover's in another measure, goes on.
#[test]
fn a_folded_cover_is_laid_anew() {
    let mut rig = rig(Cover::Pressure(Rims::Bonded));
    assert!(!rig.mend_cover(), "nothing is folded");
    let side = (0..16)
        .max_by(|a, b| {
            let radius = |i: &usize| rig.committed.poses[*i].position.xy().norm();
            radius(a).total_cmp(&radius(b))
        })
        .expect("grains");
    let pose = rig.committed.poses[side];
    rig.committed.poses[side] = pose.moved(&Vec3::zeros(), &Vec3::new(0.0, 0.0, std::f64::consts::PI));
    let folded = |rig: &Rig| rig.model.cover.as_ref().expect("a cover").inward_facets(&rig.committed.poses);
    assert!(folded(&rig) > 0);
    let nominal = rig.nominal_ratio * rig.volume(&rig.committed.poses);
    assert!(rig.mend_cover());
    assert_eq!(folded(&rig), 0);
    assert!((rig.nominal_ratio * rig.volume(&rig.committed.poses) / nominal - 1.0).abs() < 1e-12);
}
