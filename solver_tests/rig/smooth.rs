//! Plates without friction, the cover's rims sliding along them.
//!
//! Nothing but the pressure then holds the specimen sideways, and that has no resultant: so it stays where it is, and the radial stress
//! from contact forces is the confining pressure itself.

use riprap::loading::StageEnd;
use riprap::tensor::Vec3;
use riprap::triaxial::{Cover, Lateral, Path, Rig, Rims, Stage, Steps, Until};

use crate::ready::{PRESSURE, consolidate, rig_on, run};

fn middle(rig: &Rig) -> Vec3 {
    let grains = &rig.committed.poses[..rig.bottom.min(rig.top)];
    grains.iter().map(|pose| pose.position).sum::<Vec3>() / grains.len() as f64
}

#[test]
fn a_specimen_between_smooth_plates_is_sheared_where_it_stands() {
    let mut rig = rig_on(0.0, Cover::Pressure(Rims::Sliding));
    let before = middle(&rig);
    let (mut test, mut rows) = consolidate(&mut rig, 6);
    let path = Path::Strain { axial_strain: 5e-3, lateral: Lateral::Pressure };
    let shear = Stage {
        path,
        steps: Steps::Strain { nominal: 2.5e-4, largest: 2.5e-4, growth: 1.0 },
        until: Until::default(),
    };
    let (sheared, end) = run(&mut rig, &mut test, &shear);
    assert_eq!(end, StageEnd::Finished);
    rows.extend(sheared);
    for row in &rows {
        let (measures, contacts) = (&row.measures, &row.picture.contact_stress);
        assert!(
            contacts.end_friction.abs() < 1e-9 * PRESSURE,
            "{} Pa of end friction",
            contacts.end_friction
        );
        let radial = contacts.radial / measures.confining_pressure;
        assert!((radial - 1.0).abs() < 1e-3, "radial stress {radial} of the pressure");
        let axial = contacts.axial / measures.axial_stress;
        assert!((axial - 1.0).abs() < 1e-3, "axial stress {axial} of the plates'");
    }
    let drift = (middle(&rig) - before).xy().norm();
    assert!(drift < 2e-3, "the specimen went {drift} m sideways");
}
