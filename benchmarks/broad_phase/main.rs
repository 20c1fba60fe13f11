//! How does the cost of an increment grow with the number of bodies, and what of it is searching?
//!
//! - `grains`: hulls of the Shuibuya law's shape (8 to 16 vertices, rounding 2 %), one class of 20 to 40 mm, each turned at random in a cell of
//!   a cubic lattice 0.9 of the mean size apart. Searching anew (broad phase and lists of features) and evaluating again at the
//!   same places with the lists that are there. They are a packing's neighbours, not a packing: the times are meant.
//! - `increment`: balls in a cube between six plates, squeezed by one increment through the solver to a force tolerance of 1e-3, with search, contacts,
//!   tangents, factorisation and the sweep for what would be passed through.
//!
//! CPU seconds of the process, on one thread (`RAYON_NUM_THREADS=1`).
//!
//! `cargo bench --bench broad_phase [-- BODIES_ALONG_AN_EDGE ...]` prints CSV: one row a size, kind and repetition.

use std::time::Instant;

use riprap::assembly::{Contacts, Kernel};
use riprap::model::Committed;
use riprap::scene::{Scene, SceneShape};
use riprap::specimen::shape::{ShapeLaw, WithinClass, grain};
use riprap::verification::arrays::cubic;
use riprap::verification::bodies::{body, scene};

const REPETITIONS: usize = 3;
const SIZES: [f64; 2] = [0.02, 0.04];
/// Of the lattice, over the mean size.
const SPACING: f64 = 0.9;

fn main() {
    let words: Vec<usize> =
        std::env::args().filter(|a| a != "--bench").skip(1).filter_map(|a| a.parse().ok()).collect();
    let edges = if words.is_empty() { vec![5, 7, 10, 13, 16] } else { words };
    println!("kind,bodies,repetition,search_s,evaluation_s,increment_s,pairs,points,factorisations");
    for n in edges {
        for repetition in 0..REPETITIONS {
            grains(n, repetition);
            increment(n, repetition);
        }
    }
}

/// User and system time of the process [s].
fn cpu() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after = stat.rsplit(')').next().unwrap_or_default();
    let ticks: f64 = after.split_whitespace().skip(11).take(2).filter_map(|w| w.parse::<f64>().ok()).sum();
    ticks / 100.0
}

fn grains(n: usize, repetition: usize) {
    let law = ShapeLaw {
        vertices: [8, 16],
        vertex_separation: 0.45,
        rounding: 0.02,
        within_class: WithinClass::Number,
        library: Vec::new(),
    };
    let spacing = SPACING * 0.5 * (SIZES[0] + SIZES[1]);
    let bodies = (0..n.pow(3))
        .map(|k| {
            let shape = grain(&law, SIZES, 0, 1, k as u64).expect("a shape");
            let place = [k % n, k / n % n, k / n / n].map(|i| i as f64 * spacing);
            let turn = [0.7, 1.3, 2.1].map(|f| (f * k as f64).sin() * 1.5);
            let shape = SceneShape::Rounded { nominal: shape.nominal, rounded: shape.rounded };
            body(&format!("grain {k}"), shape, place, turn)
        })
        .collect();
    let scene = Scene::new(&scene(bodies, 0.5, vec![])).expect("a sound scene");
    let committed = Committed::new(scene.committed.poses.clone());
    let mut contacts = Contacts::default();
    contacts.start(&scene.model, &committed);
    // Some of the grains reach into each other; all are evaluated before that is said.
    let evaluate = |contacts: &mut Contacts| {
        let begun = cpu();
        let _ = contacts.evaluate(&scene.model, &committed, &committed.poses);
        cpu() - begun
    };
    let first = evaluate(&mut contacts);
    let rounds = 1 + 20_000 / n.pow(3);
    let again = (0..rounds).map(|_| evaluate(&mut contacts)).sum::<f64>() / rounds as f64;
    let points: usize = contacts.pairs.iter().map(|pair| pair.active().count()).sum();
    let pairs = contacts.pairs.len();
    println!("grains,{},{repetition},{:.4},{again:.5},,{pairs},{points},", n.pow(3), first - again);
}

fn increment(n: usize, repetition: usize) {
    let mut parameters = cubic(n, 1e-3);
    parameters.stages[0].increments = 1;
    let mut scene = Scene::new(&parameters).expect("a sound scene");
    let (mut factorisations, mut points) = (0, 0);
    let (begun, clock) = (cpu(), Instant::now());
    let end = scene.run(|_, row| {
        factorisations = row.counters.factorisations;
        points = row.measures.points;
        true
    });
    let whole = cpu() - begun;
    // Searches are timed by the wall clock: their share of it, of the CPU time.
    let search = scene.contacts.timings.seconds(Kernel::Search);
    let share = search / clock.elapsed().as_secs_f64() * whole;
    let pairs = scene.contacts.pairs.len();
    eprintln!("{} balls: {end:?}", n.pow(3));
    println!("increment,{},{repetition},{share:.4},,{whole:.4},{pairs},{points},{factorisations}", n.pow(3));
}
