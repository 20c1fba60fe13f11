//! A cover as plain numbers, for a restart point: one that was laid anew has nodes and facets that follow from nothing else.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::model::cover::{CoverNode, DrapeStatistics, PressureCover};
use crate::tensor::Vec3;

/// See [`PressureCover::stored`].
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StoredCover {
    /// Body and point of each node.
    glued: Vec<u32>,
    #[serde(with = "crate::tensor::stored")]
    points: Vec<Vec3>,
    /// Node, and body and point of the plate that holds its height.
    plates: Vec<(u32, u32, [f64; 3])>,
    facets: Vec<[u32; 3]>,
    side_facets: u32,
    rims: [Range<u32>; 2],
    statistics: DrapeStatistics,
}

impl PressureCover {
    pub fn stored(&self) -> StoredCover {
        StoredCover {
            glued: self.nodes.iter().map(|node| node.body as u32).collect(),
            points: self.nodes.iter().map(|node| node.point).collect(),
            plates: (self.plates.iter())
                .map(|(node, plate)| (*node as u32, plate.body as u32, plate.point.into()))
                .collect(),
            facets: self.facets.iter().map(|facet| facet.map(|node| node as u32)).collect(),
            side_facets: self.side_facets as u32,
            rims: self.rims.clone().map(|rim| rim.start as u32..rim.end as u32),
            statistics: self.statistics,
        }
    }

    /// The cover that was stored, over `carriers` bodies and nodes.
    ///
    /// # Errors
    /// [`Error::Specimen`] where it is none.
    pub fn restored(stored: &StoredCover, carriers: usize) -> Result<Self> {
        let count = stored.glued.len();
        let fits = stored.points.len() == count
            && stored.glued.iter().all(|body| (*body as usize) < carriers)
            && (stored.plates.iter())
                .all(|(node, body, _)| (*node as usize) < count && (*body as usize) < carriers)
            && stored.facets.iter().flatten().all(|node| (*node as usize) < count)
            && stored.side_facets as usize <= stored.facets.len()
            && stored.rims.iter().all(|rim| rim.start < rim.end && rim.end as usize <= count);
        if !fits {
            return Err(Error::Specimen("the cover is not the one that was stored".into()));
        }
        let node = |(body, point): (&u32, &Vec3)| CoverNode { body: *body as usize, point: *point };
        let nodes = stored.glued.iter().zip(&stored.points).map(node).collect();
        let plate = |(node, body, point): &(u32, u32, [f64; 3])| {
            (*node as usize, CoverNode { body: *body as usize, point: (*point).into() })
        };
        let plates = stored.plates.iter().map(plate).collect();
        let facets: Vec<[usize; 3]> =
            stored.facets.iter().map(|facet| facet.map(|node| node as usize)).collect();
        let (side, caps) = facets.split_at(stored.side_facets as usize);
        let rims = stored.rims.clone().map(|rim| rim.start as usize..rim.end as usize);
        Self::closed(nodes, plates, side.to_vec(), caps.to_vec(), rims, stored.statistics)
    }
}
