//! Scenes on which methods fail. Each head says what goes wrong with naive methods and what is to
//! come out.

#[path = "../scene_builder.rs"]
mod scene_builder;

mod cut_leaves_no_trace;
mod huge_increment;
mod rolling_over_an_edge;
mod vertex_on_vertex;
