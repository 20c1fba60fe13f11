//! The results file: one HDF5 file that is written increment by increment, read back, summed up
//! and exported. Names, units and signs in it are a contract (docs/results_file.md).
//!
//! - [`Writer`] takes plain data (no solver types), keeps `/VTKHDF` valid after every saved state
//!   and makes every [`Writer::commit`] all or nothing, whatever kills the process (see [`journal`]).
//! - [`Reader`] opens a finished, killed or still growing file; [`Summary`] is what `riprap info` prints.
//! - [`write_history_csv`] exports the history, [`write_tables`] the other tables, [`write_vtu_series`] the saved states, [`write_network`] their contacts, [`write_stl`] the bodies.
//!
//! SI units. Strains, `deviatoric_stress` and `mean_stress` in `/history` count compression positive;
//! stresses in `/VTKHDF` count tension positive.

mod breakage;
mod checksum;
mod fields;
mod head;
mod history;
mod inspect;
pub mod journal;
mod lock;
mod network;
mod number;
mod pairs;
mod reader;
mod record;
mod resume;
mod scales;
mod states;
mod store;
mod summary;
mod table;
mod tables;
mod verify;
mod vtkhdf;
mod vtu;
mod writer;

pub use breakage::breakage_tables;
pub use fields::{CellKind, FieldMesh, FieldState, von_mises};
pub use head::is_results;
pub use history::{
    BODY_QUANTITIES, BodyRow, GRAIN_QUANTITIES, GrainRow, HISTORY, HistoryRow, Quantity, Value,
};
pub use lock::check_unused;
pub use network::{write_network, write_stl};
pub use number::{counted, fixed};
pub use pairs::ContactPair;
pub use reader::{NumberKind, Reader, Restart};
pub use record::{COMMIT, CaseRecord, ENDINGS, Outcome, Status, VERSION, host, results_file};
pub use resume::put_back;
pub use states::{SavedCells, SavedState};
pub use summary::{Named, Summary};
pub use table::{Column, ColumnData};
pub use tables::{plain_cell, write_bodies_csv, write_history_csv, write_tables};
pub use verify::Verified;
pub use vtu::{escaped, write_vtu_series};
pub use writer::{Existing, Writer};
