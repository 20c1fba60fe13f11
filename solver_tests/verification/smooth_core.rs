//! A smooth round core in rubber under pressure: see `verification::cores` for the problem, its source and
//! its tolerances.

use riprap::verification::cores::{HELD, RADIUS, Rims, SIZES, WRAPPED, Wrapped};

#[test]
fn core_feels_the_pressure_and_the_tension() {
    let stretched = Wrapped { stretch: 1.05, pressure: 0.3e6, ..WRAPPED[1] };
    let flush = Wrapped { rims: Rims::Flush, ..WRAPPED[3] };
    for wrapped in [stretched, flush] {
        let (off, _) = wrapped.excess().expect("a core").expect("laid");
        assert!(off.abs() < HELD, "{wrapped:?}: {off}");
    }
}

/// What a sheet kept half the rubber's thickness off the core has too much: `t / 2R`, whatever the pressure.
#[test]
fn thickness_of_the_rubber_adds_its_half_over_the_radius() {
    for wrapped in [WRAPPED[0], WRAPPED[2]] {
        let felt = wrapped.lie(SIZES[1], 0.0).expect("a core").expect("laid");
        let more = felt.stress / wrapped.pressure - 1.0;
        let expected = 0.5 * wrapped.thickness / RADIUS;
        // Overlap, tension and sides of the polygon are each 1e-3 at most, five millimetres of 2 MPa have a tension of 3e-3 if they are stretched by 1e-3.
        assert!((more - expected).abs() < 4e-3, "{wrapped:?}: {more} {expected}");
    }
}
