//! How near a sound grain is to its first damage under forces on its surface.

use crate::element::StraightTet10;
use crate::grain::damaged::DamagedGrain;
use crate::grain::surface::SurfacePoint;
use crate::tensor::Vec3;

impl DamagedGrain {
    /// The largest effective strain at an integration point over the strain at which damage sets in there, under `loads` (forces [N] on
    /// surface points) and with the committed damage: exact for a sound grain, 1 where the first point starts to damage.
    pub fn utilisation(&self, loads: &[(SurfacePoint, Vec3)]) -> f64 {
        if loads.is_empty() {
            return 0.0;
        }
        let u = self.committed.condensed.nodal_displacements(loads);
        let mut largest = 0.0_f64;
        let cells = self.mesh().cells.iter().zip(self.elements.iter()).zip(self.laws.iter());
        for ((nodes, element), law) in cells {
            let element: &StraightTet10 = element;
            for strain in element.strains(&nodes.map(|node| u[node.index()])) {
                largest = largest.max(law.utilisation(&strain, largest));
            }
        }
        largest
    }
}
