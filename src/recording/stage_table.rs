//! `/stages/<index>`: the curve of a stage in a few numbers.

use crate::results::Column;
use crate::triaxial::StageSummary;

/// One row. The confinement of a stage that `consolidates` changes: it has no moduli.
pub fn columns(s: &StageSummary, consolidates: bool) -> Vec<Column> {
    let [initial, half_way] = if consolidates { [f64::NAN; 2] } else { [s.initial_modulus, s.half_modulus] };
    let number = Column::number;
    let half = "secant modulus from the start of the stage to half the rise of the deviatoric stress to its peak (E50); none of a consolidation";
    let residual = "mean mobilised friction angle over the last tenth of the stage's axial strain, where q has lost 2 % of its peak by then";
    let first = "first tangent modulus of the stage; none of a consolidation";
    vec![
        number("peak_deviatoric_stress", "Pa", "largest deviatoric stress of the stage", s.peak[0]),
        number("peak_axial_strain", "1", "axial strain at the largest deviatoric stress", s.peak[1]),
        number("peak_friction_angle", "rad", "largest mobilised friction angle", s.peak_friction_angle),
        number("residual_friction_angle", "rad", residual, s.residual_friction_angle),
        number("initial_modulus", "Pa", first, initial),
        number("half_modulus", "Pa", half, half_way),
        number("largest_dilatancy_angle", "rad", "largest dilatancy angle", s.largest_dilatancy_angle),
    ]
}
