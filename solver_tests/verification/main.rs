//! Problems with a known answer, one file a problem. Each head gives problem, source, formula and
//! tolerance with its reason. Where a table of numbers helps, a test prints it (`--nocapture`).

#[path = "../audited.rs"]
mod audited;

mod asperities;
mod block_pushed_along_plane;
mod broken_between_plates;
mod condensed_grain;
mod contact_patch;
mod crossed_edges;
mod crushed_bodies;
mod damage_law;
mod damaged_grain;
mod fidelity_changes;
mod full_grain;
mod grain_meshes;
mod hertz;
mod lost_contacts;
mod membrane_balloon;
mod membrane_cylinder;
mod newton_order;
mod penalty_independence;
mod press;
mod rattler;
mod scene_rows;
mod sliding_over_facets;
mod smooth_core;
mod softening_bar;
mod two_cubes;
mod wedge_between_walls;
