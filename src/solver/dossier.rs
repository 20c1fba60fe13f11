//! What is known of an increment that could not be solved, for whoever has to find out why.

use std::fmt;
use std::sync::Arc;

use crate::assembly::{Contacts, PairWork};
use crate::contact::Feature;
use crate::contact::law::CORE_FLOOR;
use crate::grain::DamagedGrain;
use crate::model::{Body, Model};
use crate::solver::{IncrementReport, Settings, StepStatus};

/// Entries of the residual history that are shown when printed; all are kept.
const SHOWN: usize = 12;

/// The state in which the solver gave an increment up.
#[derive(Debug, Clone, PartialEq)]
pub struct Dossier {
    /// None where bodies came too close for any balance to be looked at.
    pub worst_body: Option<WorstBody>,
    /// The most overlapped contact of that body, or of all where it has none.
    pub worst_contact: Option<ContactReport>,
    /// Force out of balance at each augmentation over the mean contact force.
    pub history: Vec<f64>,
    /// Contacts below their friction bound, and at it.
    pub sticking: usize,
    pub sliding: usize,
    /// Of all attempts at the increment, cut or not.
    pub factorisations: usize,
    /// Why there is no balance, where that is known.
    pub cause: Option<String>,
    /// What to try, most promising first.
    pub advice: Vec<String>,
}

/// Contacts that overlap by more than this share of their roundings have used them up: corners and edges of cores come to lie on each other.
const USED_UP: f64 = 0.5;

/// Cores nearer than this share of their roundings hold a solve up: every step that brings them below [`CORE_FLOOR`] is refused.
const HELD_UP: f64 = 1.1 * CORE_FLOOR;

/// The body that is worst out of balance.
#[derive(Debug, Clone, PartialEq)]
pub struct WorstBody {
    pub name: String,
    /// Its force out of balance over the mean contact force.
    pub out_of_balance: f64,
    /// Contacts that it has.
    pub touching: usize,
}

/// One contact.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactReport {
    pub bodies: [String; 2],
    pub feature: Feature,
    /// [m]; negative in overlap.
    pub gap: f64,
    /// Sum of the two roundings [m].
    pub roundings: f64,
    /// Normal and friction force [N].
    pub force: [f64; 2],
    /// Of the pair since it touched, and of this contact in the increment [m].
    pub slip: [f64; 2],
}

impl Dossier {
    /// `contacts` are those of the configuration that `report` ended with.
    pub fn of(model: &Model, contacts: &Contacts, report: &IncrementReport, settings: &Settings) -> Self {
        let worst = report.balance.worst_body;
        let name = |body: usize| model.bodies.get(body).map_or("a membrane node".into(), |b| b.name.clone());
        let sliding = contacts.active().filter(|(_, point)| point.evaluation.slides()).count();
        let all = contacts.active().count();
        let deepest = |of: &dyn Fn(&PairWork) -> bool| {
            let own = contacts.active().filter(|(pair, _)| of(pair));
            own.min_by(|(_, x), (_, y)| x.evaluation.gap.total_cmp(&y.evaluation.gap))
        };
        let has = |pair: &PairWork| pair.a() == worst || pair.b() == worst;
        let worst_contact = deepest(&has).or_else(|| deepest(&|_| true)).map(|(pair, point)| {
            let e = &point.evaluation;
            ContactReport {
                bodies: [name(pair.a()), name(pair.b())],
                feature: point.site.feature,
                gap: e.gap,
                roundings: point.state.radii,
                force: [e.pressure, e.friction.norm()],
                slip: [pair.carried.slip, e.slip()],
            }
        });
        let out_of_balance = report.balance.out_of_balance;
        let worst_body = out_of_balance.is_finite().then(|| WorstBody {
            name: name(worst),
            out_of_balance,
            touching: contacts.active().filter(|(pair, _)| has(pair)).count(),
        });
        let mut dossier = Dossier {
            worst_body,
            worst_contact,
            history: report.history.clone(),
            sticking: all - sliding,
            sliding,
            factorisations: report.counters.factorisations,
            cause: None,
            advice: Vec::new(),
        };
        let spent = report.augmentations >= settings.max_augmentations;
        dossier.advice = dossier.what_to_try(&report.status, spent, settings);
        if let Some(body) = model.bodies.iter().find(|body| hangs_by_failed_rock(body)) {
            let what = format!(
                "fidelity \"condensed\" for {:?}: finite strains need not settle where a body hangs by rock that failed",
                body.name
            );
            dossier.advice.insert(0, what);
        }
        let rounding = Unresolved::of(model, report);
        if rounding.share > WORTH_A_WORD * settings.force_tolerance {
            dossier.advice.insert(0, format!("softer rock or a larger solver.force_tolerance: {rounding}"));
        }
        let overlaps = contacts.active().map(|(_, point)| -point.evaluation.gap / point.state.radii);
        let overlap = overlaps.filter(|share| share.is_finite()).fold(0.0, f64::max);
        dossier.cause = if rounding.share > settings.force_tolerance {
            Some(format!("double precision does not resolve these forces: {rounding}"))
        } else if overlap > USED_UP {
            Some(format!(
                "rock is too soft or contact.rounding too small for these forces: a contact overlaps by {:.0} % of its roundings",
                100.0 * overlap
            ))
        } else {
            let bent = contacts.pairs.iter().find_map(|pair| bent_too_far(model, pair));
            bent.map(|[way, overlap, roundings]| {
                dossier.advice = vec!["a larger contact.rounding, stiffer rock or a lower load".into()];
                format!(
                    "contact.rounding is too small for bodies that deform so much: two have come nearer by {way:.1e} m of the {roundings:.1e} m \
                     that theirs are, though their deformed surfaces overlap by {overlap:.1e} m only"
                )
            })
        };
        dossier
    }

    /// `spent` says whether it took all augmentations that it may.
    fn what_to_try(&self, status: &StepStatus, spent: bool, settings: &Settings) -> Vec<String> {
        let mut advice = Vec::new();
        if matches!(status, StepStatus::TooClose(_) | StepStatus::Overlapping { .. }) {
            advice
                .push("smaller increments (a smaller solver.increment_min lets them be cut further)".into());
            return advice;
        }
        let best = self.history.iter().copied().fold(f64::INFINITY, f64::min);
        let last = self.history.last().copied().unwrap_or(f64::INFINITY);
        if spent && last < 0.1 && last <= 1.5 * best {
            advice.push(format!(
                "a larger solver.max_augmentations (now {}): the forces were still coming into balance",
                settings.max_augmentations
            ));
        }
        if let Some(WorstBody { name, touching: 0, .. }) = &self.worst_body {
            advice.push(format!("holding {name:?}, or loading it only once it touches: nothing bears it"));
        } else if 2 * self.sliding > self.sticking {
            advice.push(format!(
                "whether there is an equilibrium at all: {} of {} contacts slide; with more friction or less load there may be",
                self.sliding,
                self.sliding + self.sticking
            ));
        }
        if let Some(contact) = &self.worst_contact
            && -contact.gap > 0.25 * contact.roundings
        {
            advice.push("a lower load, stiffer rock or a larger rounding: a contact is overlapped by a quarter of its roundings".into());
        }
        advice.push("smaller increments (more of them, or a smaller solver.increment_min)".into());
        advice
    }

    /// The residual history in a line.
    pub fn history_line(&self) -> String {
        self.history.iter().map(|r| format!("{r:.2e}")).collect::<Vec<_>>().join(" ")
    }
}

/// Of a body of which all nodes move and some points have failed.
fn hangs_by_failed_rock(body: &Body) -> bool {
    let has_failed = |grain: &Arc<DamagedGrain>| grain.summary().failed_points > 0;
    body.full().is_some() && body.softens_with_damage() && body.damaged().is_some_and(has_failed)
}

/// How far a pair's undeformed bodies overlap, their deformed surfaces, and their roundings [m], where the first has used up the roundings and the
/// second has not.
fn bent_too_far(model: &Model, pair: &PairWork) -> Option<[f64; 3]> {
    let bends = [pair.a(), pair.b()].iter().any(|&body| model.bodies[body].flexibility().is_some());
    let roundings = pair.roundings(model);
    let overlap = pair.active().map(|point| -point.evaluation.gap).fold(0.0, f64::max);
    let bent = bends && pair.nearest < HELD_UP * roundings && overlap < USED_UP * roundings;
    bent.then_some([roundings - pair.nearest, overlap, roundings])
}

/// Share of the force tolerance above which rounding is told of.
const WORTH_A_WORD: f64 = 0.1;

/// What double precision leaves unknown of forces: positions are known to half a unit in their last place, and the stiffest pair's force to that
/// times its stiffness.
struct Unresolved {
    /// Of the farthest body [m].
    distance: f64,
    /// Over the least force that any body is judged by.
    share: f64,
}

impl Unresolved {
    fn of(model: &Model, report: &IncrementReport) -> Self {
        let distance = report.poses.iter().map(|pose| pose.position.norm()).fold(0.0, f64::max);
        let stiffnesses = model.bodies.iter().map(|body| body.stiffness).filter(|k| k.is_finite());
        let force = 0.5 * stiffnesses.fold(0.0, f64::max) * 0.5 * f64::EPSILON * distance;
        let share = force / report.balance.least_force;
        Unresolved { distance, share: if share.is_finite() { share } else { 0.0 } }
    }
}

impl fmt::Display for Unresolved {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Unresolved { distance, share } = self;
        write!(
            f,
            "positions of {distance:.1e} m in double precision leave {share:.1e} of the mean contact force unknown at the stiffest contact"
        )
    }
}

impl fmt::Display for ContactReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b] = &self.bodies;
        let what = match self.feature {
            Feature::VertexOfA(vertex) => format!("vertex {vertex} of the first on the second"),
            Feature::VertexOfB(vertex) => format!("vertex {vertex} of the second on the first"),
            Feature::Edges(i, j) => format!("edge {i} on edge {j}"),
            Feature::Faces(i, j, point) => format!("face {i} on face {j}, point {point}"),
        };
        write!(
            f,
            "{a} on {b}, {what}: gap {:.3e} m of {:.3e} m rounding, normal force {:.3e} N, friction {:.3e} N, slip of \
             the pair {:.3e} m, in this increment {:.3e} m",
            self.gap, self.roundings, self.force[0], self.force[1], self.slip[0], self.slip[1]
        )
    }
}

impl fmt::Display for Dossier {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Dossier { worst_body, history, sticking, sliding, .. } = self;
        if let Some(WorstBody { name, out_of_balance, touching }) = worst_body {
            writeln!(f, "worst body      {name}: {out_of_balance:.2e} out of balance, {touching} contacts")?;
        }
        if let Some(contact) = &self.worst_contact {
            writeln!(f, "worst contact   {contact}")?;
        }
        writeln!(f, "contacts        {sticking} stick, {sliding} slide")?;
        if !history.is_empty() {
            let skipped = history.len().saturating_sub(SHOWN);
            let shown: Vec<String> = history[skipped..].iter().map(|r| format!("{r:.1e}")).collect();
            let before = if skipped > 0 { "… " } else { "" };
            let count = history.len();
            writeln!(f, "out of balance  {before}{} ({count} augmentations)", shown.join(" "))?;
        }
        write!(f, "to try          {}", self.advice.join("; "))
    }
}
