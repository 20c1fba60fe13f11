//! A grain that damages: its rock cell by cell, a damage state at every integration point, and the flexibility that follows.
//!
//! Within an increment the caller alternates: forces on the surface → [`DamagedGrain::propose`] (strains at the points, more damage,
//! at most so much at a time) → [`DamagedGrain::refresh`] (a new factor, if damage moved; not needed where only strains are asked for). All of that is
//! trial; only [`DamagedGrain::commit`] keeps it, and [`DamagedGrain::reject`] forgets it without a trace. Between two proposals damage is frozen, so
//! the grain is linear. Trial damage grows monotonically from the committed one.
//!
//! A failed point gives no stress. A cell all of whose points have failed is deleted after the commit
//! ([`DamagedGrain::break_up`]): its nodes leave the system and what falls apart becomes grains of their own. Until then failed points keep [`HELD`] of
//! their stiffness in the factor, since a cell with some failed points has nodes that nothing else holds: a force on such a node finds
//! next to no resistance, instead of a singular matrix.
//!
//! Source: Ma, Zhou, Chang & Zhou (2011), section 2.3, for failing points and deleted cells.

use std::borrow::Cow;
use std::sync::Arc;

use nalgebra::Vector6;

use crate::element::{POINT_COUNT, StraightTet10};
use crate::error::{Error, Result};
use crate::grain::condensed::CondensedGrain;
use crate::grain::pace::{FLIPPING, Pace};
use crate::grain::stiffness::sound;
use crate::grain::surface::SurfacePoint;
use crate::material::secant::HELD;
use crate::material::{DamageLaw, DamageState, Elastic, Secant};
use crate::mesh::{CellId, Mesh};
use crate::tensor::Vec3;

/// Parts below this share of the grain as generated are given up, unless the rock says otherwise.
const LEAST_SHARE: f64 = 0.02;

/// Where a grain comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ancestry {
    /// Number of the grain of the specimen that this was part of.
    pub origin: u32,
    /// Number of the body that broke, if this is a fragment.
    pub parent: Option<u32>,
    /// 0 for a grain as generated, 1 for a part of it, 2 for a part of a part.
    pub generation: u32,
}

impl Ancestry {
    /// Of a grain as generated.
    pub const fn of_grain(number: u32) -> Self {
        Ancestry { origin: number, parent: None, generation: 0 }
    }
}

/// What a proposal did to the trial damage.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DamageChange {
    /// Largest change of a point's stress that was applied, over that of sound rock.
    pub applied: f64,
    /// Largest change that the limit held back.
    pub held_back: f64,
    /// Points whose cracks open and close in turn without settling: their change has been damped to nothing.
    pub flipping: usize,
    /// Points that failed in this proposal.
    pub newly_failed: usize,
    /// Cells without a working point, all of them since the last commit.
    pub failed_cells: usize,
}

/// What a commit kept.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DamageCommit {
    /// Energy that damage set free since the last commit [J]: [`DamageLaw::dissipation`] over the strains going straight from each proposal to the next.
    pub dissipated: f64,
    /// Elastic energy now [J].
    pub elastic: f64,
    pub newly_failed: usize,
    /// Cells without a working point: [`DamagedGrain::break_up`] will delete them.
    pub failed_cells: usize,
    /// Elastic energy of the accepted state that left with points that failed in it [J]: part of `dissipated`, no more of `elastic`.
    pub removed: f64,
}

/// Damage of a grain, in numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DamageSummary {
    /// Volume-weighted mean of d.
    pub mean: f64,
    pub largest: f64,
    pub failed_points: usize,
    pub points: usize,
    /// Volume with d above 0 [m^3].
    pub damaged_volume: f64,
}

/// What a body comes from; see the fields of [`DamagedGrain`].
#[derive(Debug, Clone)]
pub(super) struct Past {
    pub origin_cells: Vec<CellId>,
    pub ancestry: Ancestry,
    pub origin: Arc<Mesh>,
    pub offset: Vec3,
    pub lasting: bool,
    pub least_share: f64,
    pub rubble: Option<Arc<Vec<CellId>>>,
}

/// States of all points and the factor that goes with them.
#[derive(Debug, Clone)]
pub(super) struct Condition {
    pub states: Vec<[DamageState; POINT_COUNT]>,
    /// Stiffnesses as they stand in the factor, but for failed points, which have none.
    pub points: Vec<[Secant; POINT_COUNT]>,
    pub condensed: Arc<CondensedGrain>,
    /// Whether damage never moved, so that `condensed` is the grain as it was first made.
    pub sound: bool,
}

/// A crushable meshed grain in body coordinates.
#[derive(Debug, Clone)]
pub struct DamagedGrain {
    pub(super) laws: Arc<Vec<DamageLaw>>,
    pub(super) elements: Arc<Vec<StraightTet10>>,
    pub(super) density: f64,
    pub(super) committed: Condition,
    trial: Condition,
    /// The trial damage moved since its factor was made.
    stale: bool,
    pace: Vec<[Pace; POINT_COUNT]>,
    /// Energy that the proposals since the last commit set free [J].
    freed: f64,
    pub(super) dissipated: f64,
    /// For each cell, its number in the mesh of the grain as generated.
    pub(super) origin_cells: Arc<Vec<CellId>>,
    pub(super) ancestry: Ancestry,
    /// The mesh of the grain as generated.
    pub(super) origin: Arc<Mesh>,
    /// Where the reference point of the body coordinates lies in those of the grain as generated [m].
    pub(super) offset: Vec3,
    /// Whether points that fail keep what the threshold leaves them until the commit.
    pub(super) lasting: bool,
    /// Parts below this share of the grain as generated are given up.
    pub(super) least_share: f64,
    /// Failed cells that this body goes on taking room with ([`Self::keeping_rubble`]), as [`Self::origin_cells`]; `None` where they leave.
    pub(super) rubble: Option<Arc<Vec<CellId>>>,
    /// Displacement of the nodes in the last committed state, before points that failed in it were taken out [m].
    displaced: Vec<Vec3>,
}

/// Strains at the points of a cell.
pub(super) type Strained = [Vector6<f64>; POINT_COUNT];

/// Condenses with failed points held.
fn condense(
    mesh: Mesh,
    laws: &[DamageLaw],
    density: f64,
    points: &[[Secant; POINT_COUNT]],
) -> Result<CondensedGrain> {
    let elastic: Vec<Elastic> = laws.iter().map(|law| *law.elastic()).collect();
    CondensedGrain::with_damage_on_demand(mesh, &elastic, density, &held(points))
}

fn held(points: &[[Secant; POINT_COUNT]]) -> Vec<[Secant; POINT_COUNT]> {
    points.iter().map(|points| points.each_ref().map(|point| point.at_least(HELD))).collect()
}

/// The kernel of each cell.
pub(super) fn elements_of(mesh: &Mesh) -> Result<Vec<StraightTet10>> {
    mesh.cell_ids()
        .map(|cell| {
            StraightTet10::new(&mesh.corners(cell)).ok_or_else(|| Error::Mesh {
                name: "grain".into(),
                message: format!("cell {} has no volume", cell.index()),
            })
        })
        .collect()
}

/// Cells of the mesh as generated, `offset` being the new reference point.
pub(super) fn placed(origin: &Mesh, cells: &[CellId], offset: &Vec3) -> Result<Mesh> {
    let (mut mesh, _) = origin.part(cells)?;
    mesh.nodes.iter_mut().for_each(|node| *node -= offset);
    Ok(mesh)
}

impl DamagedGrain {
    /// A sound grain with one law a cell and a uniform `density` [kg/m^3].
    ///
    /// Errors ([`Error::Mesh`]) as [`CondensedGrain::new`].
    pub fn new(mesh: Mesh, laws: Vec<DamageLaw>, density: f64, ancestry: Ancestry) -> Result<Self> {
        let states = vec![[DamageState::default(); POINT_COUNT]; laws.len()];
        Self::with_states(mesh, laws, density, states, ancestry)
    }

    /// A grain whose points have a history: one that goes on from a restart. Points that have failed stay so.
    ///
    /// Errors ([`Error::Mesh`]) as [`Self::new`], and where there is not one state a point.
    pub fn with_states(
        mesh: Mesh,
        laws: Vec<DamageLaw>,
        density: f64,
        states: Vec<[DamageState; POINT_COUNT]>,
        ancestry: Ancestry,
    ) -> Result<Self> {
        if states.len() != laws.len() {
            let message = format!("has {} laws and {} damage states", laws.len(), states.len());
            return Err(Error::Mesh { name: "grain".into(), message });
        }
        let points: Vec<[Secant; POINT_COUNT]> =
            laws.iter().zip(&states).map(|(law, states)| states.map(|state| law.secant(&state))).collect();
        let condensed = Arc::new(condense(mesh, &laws, density, &points)?);
        let sound = states.iter().flatten().all(|state| *state == DamageState::default());
        Self::first(laws, density, Condition { states, points, condensed, sound }, ancestry, false)
    }

    /// A sound grain over the one that it is condensed to already, which it uses until damage moves. Its mesh is that of the
    /// grain as generated. Points that fail keep what the threshold leaves them until the commit, so that within an increment a surface
    /// under load gives way by a finite amount.
    ///
    /// Errors ([`Error::Mesh`]) where there is not one law a cell.
    pub fn over(
        condensed: Arc<CondensedGrain>,
        laws: Vec<DamageLaw>,
        density: f64,
        ancestry: Ancestry,
    ) -> Result<Self> {
        let cells = condensed.mesh().cells.len();
        if cells != laws.len() {
            let message = format!("has {cells} cells and {} laws", laws.len());
            return Err(Error::Mesh { name: "grain".into(), message });
        }
        let states = vec![[DamageState::default(); POINT_COUNT]; cells];
        let condition = Condition { states, points: sound(cells), condensed, sound: true };
        Self::first(laws, density, condition, ancestry, true)
    }

    fn first(
        laws: Vec<DamageLaw>,
        density: f64,
        condition: Condition,
        ancestry: Ancestry,
        lasting: bool,
    ) -> Result<Self> {
        let origin = condition.condensed.shared_mesh().clone();
        let origin_cells = origin.cell_ids().collect();
        let offset = Vec3::zeros();
        let least_share = LEAST_SHARE;
        let past = Past { origin_cells, ancestry, origin, offset, lasting, least_share, rubble: None };
        Self::assemble(laws, density, condition, past)
    }

    pub(super) fn assemble(
        laws: Vec<DamageLaw>,
        density: f64,
        committed: Condition,
        past: Past,
    ) -> Result<Self> {
        let Past { origin_cells, ancestry, origin, offset, lasting, least_share, rubble } = past;
        let elements = elements_of(committed.condensed.mesh())?;
        Ok(DamagedGrain {
            pace: vec![[Pace::default(); POINT_COUNT]; laws.len()],
            laws: Arc::new(laws),
            elements: Arc::new(elements),
            density,
            trial: committed.clone(),
            committed,
            stale: false,
            freed: 0.0,
            dissipated: 0.0,
            origin_cells: Arc::new(origin_cells),
            ancestry,
            origin,
            offset,
            lasting,
            least_share,
            rubble,
            displaced: Vec::new(),
        })
    }

    /// What a body of these of its cells takes over from it.
    pub(super) fn past(&self, origin_cells: Vec<CellId>) -> Past {
        Past {
            origin_cells,
            ancestry: self.ancestry,
            origin: self.origin.clone(),
            offset: self.offset,
            lasting: self.lasting,
            least_share: self.least_share,
            rubble: self.rubble.clone(),
        }
    }

    /// The same with points that carry nothing from the moment they fail, for nodal contact, which does not mind how far a surface gives way.
    pub fn failing_at_once(mut self) -> Self {
        self.lasting = false;
        self
    }

    /// The same of which parts below this share of the grain as generated are given up.
    pub fn losing_below(mut self, share: f64) -> Self {
        self.least_share = share;
        self
    }

    /// Volume of the smallest part that goes on as a body [m^3].
    pub fn least_volume(&self) -> f64 {
        self.least_share * self.origin.volume()
    }

    /// The same with failed cells that stay where they are as rubble: they carry no stress in the mesh any more, but go on taking their room
    /// in the contact body of the part that they hang on to.
    pub fn keeping_rubble(mut self) -> Self {
        self.rubble = Some(Arc::default());
        self
    }

    /// Whether failed cells stay as rubble.
    pub const fn keeps_rubble(&self) -> bool {
        self.rubble.is_some()
    }

    /// Failed cells that stay with this body, as [`Self::origin_cells`].
    pub fn rubble(&self) -> &[CellId] {
        self.rubble.as_ref().map_or(&[], |cells| &cells[..])
    }

    /// Volume of its rock and its rubble [m^3].
    pub fn room(&self) -> f64 {
        self.mesh().volume() + self.rubble().iter().map(|&cell| self.origin.cell_volume(cell)).sum::<f64>()
    }

    /// Its cells and its rubble, in body coordinates.
    pub fn mesh_with_rubble(&self) -> Result<Cow<'_, Mesh>> {
        if self.rubble().is_empty() {
            return Ok(Cow::Borrowed(self.mesh()));
        }
        let mut cells = [self.origin_cells(), self.rubble()].concat();
        cells.sort_unstable();
        placed(&self.origin, &cells, &self.offset).map(Cow::Owned)
    }

    /// Whether damage never moved: then [`Self::condensed`] is the grain as it was first made.
    pub const fn is_sound(&self) -> bool {
        self.committed.sound
    }

    /// Displacement of the nodes in the state last committed, before points that failed in it were taken out [m]; empty before.
    pub fn displaced(&self) -> &[Vec3] {
        &self.displaced
    }

    /// The mesh of the grain as generated.
    pub const fn generated(&self) -> &Arc<Mesh> {
        &self.origin
    }

    /// Where the reference point of the body coordinates lies in those of the grain as generated [m].
    pub const fn offset(&self) -> Vec3 {
        self.offset
    }

    /// The grain's flexibility with the trial damage as of the last [`Self::refresh`].
    pub fn condensed(&self) -> &Arc<CondensedGrain> {
        &self.trial.condensed
    }

    /// The flexibility of the cells that are left, all of them sound.
    ///
    /// Errors ([`Error::Mesh`]) as [`CondensedGrain::new`].
    pub fn as_sound(&self) -> Result<CondensedGrain> {
        self.condensed_alike(self.mesh().clone(), &self.laws, &sound(self.laws.len()))
    }

    pub fn mesh(&self) -> &Mesh {
        self.committed.condensed.mesh()
    }

    pub fn law(&self, cell: CellId) -> &DamageLaw {
        &self.laws[cell.index()]
    }

    /// Committed states of the integration points of each cell.
    pub fn states(&self) -> &[[DamageState; POINT_COUNT]] {
        &self.committed.states
    }

    /// Committed stiffness of each point.
    pub fn points(&self) -> &[[Secant; POINT_COUNT]] {
        &self.committed.points
    }

    /// For each cell, its number in the mesh of the grain as generated.
    pub fn origin_cells(&self) -> &[CellId] {
        &self.origin_cells
    }

    /// Whether it has lost cells.
    pub fn is_parted(&self) -> bool {
        self.origin_cells.len() < self.origin.cells.len()
    }

    pub const fn ancestry(&self) -> &Ancestry {
        &self.ancestry
    }

    /// What is left of the stiffness of the rock below a facet of the surface, with the trial damage: the mean over the points of its cell of the
    /// part of the energy that sound rock would store. 1 for sound rock.
    pub fn stiffness_left(&self, facet: u32) -> f64 {
        let cell = self.mesh().surface[facet as usize].cell;
        self.trial.points[cell.index()].iter().map(Secant::share).sum::<f64>() / POINT_COUNT as f64
    }

    /// Energy that damage has set free in all commits since this body exists [J].
    pub const fn dissipated(&self) -> f64 {
        self.dissipated
    }

    fn strains(&self, cell: usize, u: &[Vec3]) -> Strained {
        let nodal = self.mesh().cells[cell].map(|node| u[node.index()]);
        self.elements[cell].strains(&nodal)
    }

    /// Moves the trial damage towards what the strains under `loads` (forces [N] on surface points) ask for. No damage grows by more than
    /// `max_change`: where one point asks for more, all grow in proportion, so that the weakest leads and others can unload before
    /// they break.
    ///
    /// The caller goes on until `applied` is below its tolerance and nothing is held back.
    pub fn propose(&mut self, loads: &[(SurfacePoint, Vec3)], max_change: f64) -> Result<DamageChange> {
        self.propose_beyond(loads, max_change, 0.0)
    }

    /// As [`Self::propose`], but a point whose stress would change by no more than `least_change` of that of sound rock, and does not fail, keeps it until more has
    /// come together: a grain that hardly softens stays as it is.
    pub fn propose_beyond(
        &mut self,
        loads: &[(SurfacePoint, Vec3)],
        max_change: f64,
        least_change: f64,
    ) -> Result<DamageChange> {
        let u = self.displacements(loads)?;
        self.propose_at(
            (0..self.laws.len()).map(|cell| self.strains(cell, &u)).collect(),
            max_change,
            least_change,
        )
    }

    /// As [`Self::propose_beyond`], at the strains of all cells.
    pub(super) fn propose_at(
        &mut self,
        strains: Vec<Strained>,
        max_change: f64,
        least_change: f64,
    ) -> Result<DamageChange> {
        if let Some(cell) = strains.iter().position(|points| points.iter().flatten().any(|e| !e.is_finite()))
        {
            let message = format!("the strain in cell {cell} is not finite");
            return Err(Error::Mesh { name: "grain".into(), message });
        }
        let points = strains.iter().zip(&self.trial.states).zip(self.laws.iter());
        let growth = points.flat_map(|((strains, states), law)| {
            strains.iter().zip(states).map(|(e, state)| law.growth(e, state))
        });
        let most = growth.fold(0.0, f64::max);
        let share = if most > max_change { max_change / most } else { 1.0 };
        let mut change = DamageChange { held_back: (1.0 - share) * most, ..Default::default() };
        for cell in 0..self.laws.len() {
            let law = &self.laws[cell];
            let volume = self.elements[cell].point_volume();
            for point in 0..POINT_COUNT {
                let old = self.trial.states[cell][point];
                let (rock, strain) = (law.elastic(), &strains[cell][point]);
                if old.failed {
                    self.trial.states[cell][point].strain = *strain;
                    continue;
                }
                let new = law.advance_partly(strain, &old, share);
                let before = &self.trial.points[cell][point];
                let wanted = law.secant(&DamageState { strain: *strain, ..new });
                let asked = before.change_to(&wanted, rock, strain);
                let after = if new.failed {
                    let last = if self.lasting { before.share().min(1.0 - law.threshold()) } else { 0.0 };
                    Some(Secant::of_share(last))
                } else if asked.abs() <= least_change {
                    None
                } else {
                    // Closing and opening cracks change it too.
                    let limit = self.pace[cell][point].next(asked, max_change);
                    if limit < FLIPPING {
                        change.flipping += 1;
                        None
                    } else {
                        change.held_back = change.held_back.max(asked.abs() - limit);
                        Some(before.towards(&wanted, limit / asked.abs(), rock))
                    }
                };
                change.newly_failed += usize::from(new.failed);
                self.freed += volume * law.dissipation(&old, &new);
                if let (true, Some(after)) = (new.failed, &after) {
                    // What it keeps goes with the commit.
                    self.freed -= volume * after.energy_density(rock, &new.strain);
                }
                self.trial.states[cell][point] = new;
                if let Some(after) = after.filter(|after| after != before) {
                    change.applied = change.applied.max(before.change_to(&after, rock, strain).abs());
                    self.stale = true;
                    self.trial.points[cell][point] = after;
                }
            }
            change.failed_cells += usize::from(self.trial.states[cell].iter().all(|state| state.failed));
        }
        Ok(change)
    }

    /// Displacement of every node [m] under `loads` with the trial damage. Where that has moved since the factor was made a new one is made only if the
    /// old one is too far off: damage moves some times in an increment.
    fn displacements(&mut self, loads: &[(SurfacePoint, Vec3)]) -> Result<Vec<Vec3>> {
        if self.stale {
            let product = |out: &mut [f64], u: &[f64]| self.multiply(out, u);
            if let Some(u) = self.trial.condensed.displacements_without_factor(loads, product) {
                return Ok(u);
            }
            self.refresh()?;
        }
        Ok(self.trial.condensed.nodal_displacements(loads))
    }

    /// The stiffness with the trial damage times displacements of all nodes, as it would be factored.
    fn multiply(&self, out: &mut [f64], u: &[f64]) {
        out.fill(0.0);
        let cells = self.mesh().cells.iter().zip(self.elements.iter()).zip(self.laws.iter());
        for (((nodes, element), law), points) in cells.zip(&self.trial.points) {
            let nodal = nodes.map(|node| Vec3::from_column_slice(&u[3 * node.index()..3 * node.index() + 3]));
            let strains = element.strains(&nodal);
            let stresses =
                std::array::from_fn(|p| points[p].at_least(HELD).stress(law.elastic(), &strains[p]));
            let mut forces = [Vec3::zeros(); 10];
            element.add_forces(&mut forces, &stresses);
            for (node, force) in nodes.iter().zip(&forces) {
                out[3 * node.index()..3 * node.index() + 3]
                    .iter_mut()
                    .zip(force)
                    .for_each(|(f, own)| *f += own);
            }
        }
    }

    /// What points keep of their stiffness in the factor of the last [`Self::refresh`].
    pub(super) fn held_points(&self) -> Vec<[Secant; POINT_COUNT]> {
        held(&self.trial.points)
    }

    /// Makes a new factor if the trial damage moved; returns whether it did.
    ///
    /// Errors ([`Error::Mesh`]) where what is left cannot be factored: reject the increment.
    pub fn refresh(&mut self) -> Result<bool> {
        if !self.stale {
            return Ok(false);
        }
        // A sound grain is condensed in another way.
        let known = Some(&self.trial.condensed).filter(|_| !self.trial.sound);
        let softer = match known.and_then(|known| known.with_points(&held(&self.trial.points))) {
            Some(softer) => softer,
            None => self.condensed_alike(self.mesh().clone(), &self.laws, &self.trial.points),
        };
        self.trial.condensed = Arc::new(softer?);
        self.trial.sound = false;
        self.stale = false;
        Ok(true)
    }

    /// Condenses a part or another state of this grain, with failed points held; contact forces act on patches if they do here.
    pub(super) fn condensed_alike(
        &self,
        mesh: Mesh,
        laws: &[DamageLaw],
        points: &[[Secant; POINT_COUNT]],
    ) -> Result<CondensedGrain> {
        let on_points = condense(mesh, laws, self.density, points)?;
        Ok(if self.is_on_patches() { on_points.on_patches() } else { on_points })
    }

    /// Whether contact forces act on patches of its surface.
    pub fn is_on_patches(&self) -> bool {
        self.committed.condensed.is_on_patches()
    }

    /// Forgets the trial damage.
    pub fn reject(&mut self) {
        if self.stale || !Arc::ptr_eq(&self.trial.condensed, &self.committed.condensed) {
            self.trial = self.committed.clone();
        } else {
            // No damage moved, but strains were written down.
            self.trial.states.clone_from(&self.committed.states);
            self.trial.points.clone_from(&self.committed.points);
        }
        self.stale = false;
        self.settle();
    }

    /// Begins a new step.
    fn settle(&mut self) {
        self.freed = 0.0;
        self.pace.iter_mut().for_each(|pace| *pace = [Pace::default(); POINT_COUNT]);
    }

    /// Keeps the trial damage, with the strains under the accepted `loads`.
    pub fn commit(&mut self, loads: &[(SurfacePoint, Vec3)]) -> Result<DamageCommit> {
        let u = self.displacements(loads)?;
        let strains = (0..self.laws.len()).map(|cell| self.strains(cell, &u)).collect();
        self.commit_at(u, strains)
    }

    /// As [`Self::commit`], with the displacements of all nodes [m] and the strains of all cells.
    pub(super) fn commit_at(&mut self, u: Vec<Vec3>, strains: Vec<Strained>) -> Result<DamageCommit> {
        let mut kept = DamageCommit::default();
        let mut lost = 0.0;
        for (cell, strains) in strains.into_iter().enumerate() {
            let law = &self.laws[cell];
            let volume = self.elements[cell].point_volume();
            for (point, strain) in strains.into_iter().enumerate() {
                let (from, to) = (&self.committed.states[cell][point], &mut self.trial.states[cell][point]);
                let after = &self.trial.points[cell][point];
                to.strain = strain;
                kept.newly_failed += usize::from(to.failed && !from.failed);
                let stored = after.energy_density(law.elastic(), &to.strain);
                kept.elastic += volume * stored;
                if to.failed && after.share() > 0.0 {
                    lost += volume * stored;
                    self.trial.points[cell][point] = Secant::of_share(0.0);
                    self.stale = true;
                }
            }
            kept.failed_cells += usize::from(self.trial.states[cell].iter().all(|state| state.failed));
        }
        kept.dissipated = self.freed + lost;
        kept.elastic -= lost;
        kept.removed = lost;
        self.displaced = u;
        self.refresh()?;
        self.settle();
        self.committed = self.trial.clone();
        self.dissipated += kept.dissipated;
        Ok(kept)
    }

    /// Elastic energy of the committed state [J], from the strains and stiffnesses of the points.
    pub fn elastic_energy(&self) -> f64 {
        self.energy_of(&self.mesh().cell_ids().collect::<Vec<_>>())
    }

    /// Stresses [Pa] at the integration points of the committed state; zero at failed ones.
    pub fn stresses(&self) -> Vec<[Vector6<f64>; POINT_COUNT]> {
        let cell = |k: usize| {
            std::array::from_fn(|p| {
                let strain = &self.committed.states[k][p].strain;
                self.committed.points[k][p].stress(self.laws[k].elastic(), strain)
            })
        };
        (0..self.laws.len()).map(cell).collect()
    }

    /// Cells without a working point, which [`Self::break_up`] deletes.
    pub fn failed_cells(&self) -> usize {
        self.committed.states.iter().filter(|points| points.iter().all(|state| state.failed)).count()
    }

    /// Numbers of the committed damage.
    pub fn summary(&self) -> DamageSummary {
        let mut summary = DamageSummary {
            mean: 0.0,
            largest: 0.0,
            failed_points: 0,
            points: POINT_COUNT * self.laws.len(),
            damaged_volume: 0.0,
        };
        let mut volume = 0.0;
        for (cell, states) in self.committed.states.iter().enumerate() {
            let share = self.elements[cell].point_volume();
            for state in states {
                // The larger of both histories, whether or not cracks are closed just now.
                let [d_t, d_c] = self.laws[cell].parts(state);
                let d = if state.failed { 1.0 } else { d_t.max(d_c) };
                volume += share;
                summary.mean += share * d;
                summary.largest = summary.largest.max(d);
                summary.failed_points += usize::from(state.failed);
                summary.damaged_volume += if d > 0.0 { share } else { 0.0 };
            }
        }
        summary.mean /= volume;
        summary
    }
}
