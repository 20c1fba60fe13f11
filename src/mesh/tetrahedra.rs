//! The linear tetrahedral mesh that generators work on: each point knows the boundary planes it
//! must stay on, so that bisection and smoothing keep the volume of the body.

use crate::mesh::quality::radius_ratio;
use crate::tensor::Vec3;

/// Where a point may go.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Freedom {
    /// On the boundary planes listed (ascending): one plane leaves two directions, two leave the
    /// line where they meet, three or more fix the point. None: inside, free.
    Planes(Vec<u32>),
    /// On the sphere of this radius about the origin.
    Sphere(f64),
}

/// Tetrahedra with positive volume, and the cells around each point.
#[derive(Debug, Clone)]
pub(crate) struct Tetrahedra {
    pub points: Vec<Vec3>,
    pub freedom: Vec<Freedom>,
    pub cells: Vec<[u32; 4]>,
    /// Cells around each point, in the order in which they were made.
    pub around: Vec<Vec<u32>>,
    /// Outward unit normals of the boundary planes.
    pub planes: Vec<Vec3>,
}

impl Tetrahedra {
    pub fn new(points: Vec<Vec3>, freedom: Vec<Freedom>, cells: Vec<[u32; 4]>, planes: Vec<Vec3>) -> Self {
        let mut around = vec![Vec::new(); points.len()];
        for (index, cell) in cells.iter().enumerate() {
            for &point in cell {
                around[point as usize].push(index as u32);
            }
        }
        Tetrahedra { points, freedom, cells, around, planes }
    }

    pub fn corners(&self, cell: u32) -> [Vec3; 4] {
        self.cells[cell as usize].map(|point| self.points[point as usize])
    }

    pub fn quality(&self, cell: u32) -> f64 {
        radius_ratio(&self.corners(cell))
    }

    /// Worst radius ratio of the cells around `point`.
    pub fn quality_around(&self, point: u32) -> f64 {
        self.around[point as usize].iter().map(|&cell| self.quality(cell)).fold(1.0, f64::min)
    }

    /// Worst radius ratio of all cells.
    pub fn worst_quality(&self) -> f64 {
        (0..self.cells.len() as u32).map(|cell| self.quality(cell)).fold(1.0, f64::min)
    }

    pub fn length(&self, a: u32, b: u32) -> f64 {
        (self.points[a as usize] - self.points[b as usize]).norm()
    }

    /// Whether two joined points lie on one boundary plane or sphere: in a convex body their edge does too.
    pub fn on_boundary(&self, a: u32, b: u32) -> bool {
        match self.common_freedom(a, b) {
            Freedom::Planes(planes) => !planes.is_empty(),
            Freedom::Sphere(_) => true,
        }
    }

    /// Freedom of a point half-way between two.
    fn common_freedom(&self, a: u32, b: u32) -> Freedom {
        match (&self.freedom[a as usize], &self.freedom[b as usize]) {
            (Freedom::Planes(p), Freedom::Planes(q)) => {
                Freedom::Planes(p.iter().filter(|plane| q.contains(plane)).copied().collect())
            }
            (Freedom::Sphere(p), Freedom::Sphere(_)) => Freedom::Sphere(*p),
            (Freedom::Sphere(_), Freedom::Planes(_)) | (Freedom::Planes(_), Freedom::Sphere(_)) => {
                Freedom::Planes(Vec::new())
            }
        }
    }

    /// Number of cells that have both points.
    pub fn cells_at_edge(&self, a: u32, b: u32) -> usize {
        self.around[a as usize].iter().filter(|&&cell| self.cells[cell as usize].contains(&b)).count()
    }

    /// Bisects the edge: every cell around it is cut in two. Returns the new point.
    pub fn split_edge(&mut self, a: u32, b: u32) -> u32 {
        let middle = self.points.len() as u32;
        let freedom = self.common_freedom(a, b);
        let mut position = (self.points[a as usize] + self.points[b as usize]) * 0.5;
        if let Freedom::Sphere(radius) = freedom {
            // Two ends of a diameter never share an edge here, so the norm is not zero.
            position *= radius / position.norm();
        }
        self.points.push(position);
        self.freedom.push(freedom);
        self.around.push(Vec::new());
        let cut: Vec<u32> = self.around[a as usize]
            .iter()
            .copied()
            .filter(|&cell| self.cells[cell as usize].contains(&b))
            .collect();
        for cell in cut {
            let old = self.cells[cell as usize];
            let new = self.cells.len() as u32;
            self.cells.push(old.map(|point| if point == a { middle } else { point }));
            self.cells[cell as usize] = old.map(|point| if point == b { middle } else { point });
            self.around[b as usize].retain(|&other| other != cell);
            self.around[b as usize].push(new);
            for point in old {
                if point != a && point != b {
                    self.around[point as usize].push(new);
                }
            }
            self.around[middle as usize].extend([cell, new]);
        }
        middle
    }

    /// The nearest allowed place to `wanted` for `point`, or `None` if it is fixed.
    pub fn allowed(&self, point: u32, wanted: &Vec3) -> Option<Vec3> {
        let here = &self.points[point as usize];
        match &self.freedom[point as usize] {
            Freedom::Sphere(radius) => {
                let norm = wanted.norm();
                (norm > 0.0).then(|| wanted * (radius / norm))
            }
            Freedom::Planes(planes) => match planes[..] {
                [] => Some(*wanted),
                [plane] => {
                    let normal = &self.planes[plane as usize];
                    let step = wanted - here;
                    Some(here + step - normal * normal.dot(&step))
                }
                [first, second] => {
                    let line = self.planes[first as usize].cross(&self.planes[second as usize]);
                    let along = line.try_normalize(0.0)?;
                    Some(here + along * along.dot(&(wanted - here)))
                }
                _ => None,
            },
        }
    }
}
