//! Softening behind a peak: the power law of one direction, and its exponent from a fracture energy (crack band).
//!
//! `d = 1 - (e0 / theta)^N` for `theta > e0`. Sources: see [`crate::material::damage`]; Bazant & Oh (1983), "Crack band theory for fracture of
//! concrete", Mater. Struct. 16:155-177.

use crate::material::{Elastic, MaterialError};

/// How stress falls behind a peak.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Softening {
    /// N, above 1.
    Exponent(f64),
    /// Crack band: energy [J/m^2] that opening one crack through a cell takes. N follows from it and the size
    /// of the cell (Bazant & Oh 1983).
    FractureEnergy(f64),
}

/// Onset and softening in one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Branch {
    /// Strain e0 at the peak.
    pub onset: f64,
    /// N.
    pub exponent: f64,
}

impl Branch {
    /// `d = 1 - (e0 / theta)^N`.
    pub(super) fn damage(&self, theta: f64) -> f64 {
        if theta > self.onset { 1.0 - (self.onset / theta).powf(self.exponent) } else { 0.0 }
    }
}

/// Energy per volume under the uniaxial curve up to failure, over `E e0^2`:
/// `1/2 + (1 - q^(2 - N)) / (N - 2)` with `q = (1 - threshold)^(-1/N)`; `1/2 + ln q` at N = 2.
/// Falls from `q - 1/2` at N = 1 to 1/2.
fn relative_energy(exponent: f64, threshold: f64) -> f64 {
    let log_q = -(-threshold).ln_1p() / exponent;
    let s = exponent - 2.0;
    // (1 - exp(-s ln q)) / s, whose limit at s = 0 is ln q.
    let tail =
        if (s * log_q).abs() < 1e-8 { log_q * (1.0 - 0.5 * s * log_q) } else { -(-s * log_q).exp_m1() / s };
    0.5 + tail
}

impl Softening {
    /// The branch for `strength` [Pa] in a cell of `size` [m].
    pub(super) fn branch(
        &self,
        kind: &'static str,
        strength: f64,
        elastic: &Elastic,
        size: f64,
        threshold: f64,
    ) -> Result<Branch, MaterialError> {
        if !(strength > 0.0 && strength.is_finite()) {
            return Err(MaterialError::Strength { kind, value: strength });
        }
        let youngs_modulus = elastic.youngs_modulus();
        let onset = strength / youngs_modulus;
        match *self {
            Softening::Exponent(exponent) => {
                if !(exponent > 1.0 && exponent.is_finite()) {
                    return Err(MaterialError::Exponent(exponent));
                }
                Ok(Branch { onset, exponent })
            }
            Softening::FractureEnergy(energy) => {
                if !(energy > 0.0 && energy.is_finite()) {
                    return Err(MaterialError::FractureEnergy(energy));
                }
                if !(size > 0.0 && size.is_finite()) {
                    return Err(MaterialError::CellSize(size));
                }
                let scale = strength * onset * size;
                let wanted = energy / scale;
                let (steep, gentle) =
                    (relative_energy(MOST_EXPONENT, threshold), relative_energy(LEAST_EXPONENT, threshold));
                if !(wanted >= steep) {
                    let largest = size * wanted / steep;
                    return Err(MaterialError::CellTooLarge { kind, size, largest, energy, strength });
                }
                if !(wanted <= gentle) {
                    let smallest = size * wanted / gentle;
                    return Err(MaterialError::CellTooSmall { kind, size, smallest, energy, strength });
                }
                // Bisection on ln N: the relative energy falls monotonically.
                let (mut low, mut high) = (LEAST_EXPONENT.ln(), MOST_EXPONENT.ln());
                for _ in 0..80 {
                    let middle = 0.5 * (low + high);
                    if relative_energy(middle.exp(), threshold) > wanted {
                        low = middle;
                    } else {
                        high = middle;
                    }
                }
                Ok(Branch { onset, exponent: (0.5 * (low + high)).exp() })
            }
        }
    }
}

/// Exponents that a fracture energy may lead to. Above 100 softening is a vertical drop within 5 % of the peak strain.
const LEAST_EXPONENT: f64 = 1.001;
const MOST_EXPONENT: f64 = 100.0;

/// Size [m] of a tetrahedral cell for crack-band regularisation, `(6 V)^(1/3)`: the edge of the brick of which it is a
/// sixth. A plane crack runs through cells whose volumes add up to its area times their mean width (over all
/// directions), which for a regular tetrahedron is 1.86 V^(1/3), 2 % from the 1.82 here.
pub fn crack_band_size(cell_volume: f64) -> f64 {
    (6.0 * cell_volume).cbrt()
}
