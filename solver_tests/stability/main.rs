//! Scenes on which methods fail. Each head says what goes wrong with naive methods and what is to
//! come out.

#[path = "../audited.rs"]
mod audited;

mod column_of_five;
mod cut_leaves_no_trace;
mod falls_across_a_gap;
mod force_curve_is_continuous;
mod huge_increment;
mod light_and_heavy;
mod random_scenes;
mod rolling_over_an_edge;
mod scale_does_not_matter;
mod unlike_bodies;
mod vertex_on_vertex;
mod wedge_pulled_out;
