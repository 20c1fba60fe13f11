//! The tet10 cell on problems with known displacement fields: see `verification::cells` for the problems and
//! where the tolerances come from.

use riprap::verification::cells::{bending, convergence, patch};

#[test]
fn patch_test_six_constant_strain_modes() {
    for mode in 0..6 {
        let errors = patch(mode);
        assert!(errors.iter().all(|error| *error < 1e-10), "mode {mode}: {errors:?}");
    }
}

#[test]
fn quadratic_patch_test_pure_bending() {
    let errors = bending();
    assert!(errors.iter().all(|error| *error < 1e-9), "{errors:?}");
}

#[test]
fn manufactured_solution_converges() {
    let [displacement, energy] = convergence();
    println!("observed orders: L2 {displacement:.3}, energy {energy:.3}");
    assert!(displacement > 2.85, "L2 order {displacement}");
    assert!(energy > 1.85, "energy order {energy}");
}
