//! Where a curve of a laboratory table has to be parted: where its strain falls back far, since several curves are joined there; and in riprap's own
//! history behind the consolidation, where strains begin anew.
//!
//! A history does not name its stages. But the volume at which its volume strain is zero, over that of the solids,
//!
//! ```text
//! (1 + void_ratio) / ((1 - volumetric_strain) cover_volume_ratio)
//! ```
//!
//! is the same in all rows whose strains count from one state.

/// A strain below this share of the largest may fall back: so does noise at the start of a test.
const BEGUN: f64 = 0.05;
/// Above what rounding in a spreadsheet changes, below what a consolidation does.
const ROUNDING: f64 = 1e-5;

/// Of a row of our own history: its stage, and the volume at zero strain over that of the solids.
pub type Origin = [f64; 2];

/// The origin of a row from its stage, void ratio and cover's volume ratio, and from its volume strain.
pub fn origin([stage, void_ratio, cover_volume_ratio]: [f64; 3], volumetric_strain: f64) -> Origin {
    [stage, (1.0 + void_ratio) / ((1.0 - volumetric_strain) * cover_volume_ratio)]
}

/// The first row behind the consolidation, if there is one.
pub fn restart(origins: &[Origin]) -> Option<usize> {
    let is_anew = |pair: &[Origin]| {
        let [[stage, volume], [next, new]] = [pair[0], pair[1]];
        next != stage && (new / volume - 1.0).abs() > ROUNDING
    };
    origins.windows(2).position(is_anew).map(|at| at + 1)
}

/// Rows in which a strain has fallen back by more than half of what it had reached, among those that have a value.
pub fn falls(strains: &[f64], values: &[f64]) -> Vec<usize> {
    let rows = strains.iter().map(|strain| strain.abs()).zip(values).enumerate();
    let rows = rows.filter(|(_, (strain, value))| strain.is_finite() && value.is_finite());
    let rows: Vec<(usize, f64)> = rows.map(|(row, (strain, _))| (row, strain)).collect();
    let largest = rows.iter().map(|(_, strain)| *strain).fold(0.0, f64::max);
    let (mut found, mut reached) = (Vec::new(), 0.0_f64);
    for (row, strain) in rows {
        if reached > BEGUN * largest && strain < 0.5 * reached {
            found.push(row);
            reached = 0.0;
        }
        reached = reached.max(strain);
    }
    found
}

/// Whether the cells of a column change in these rows and in no others; an empty one is as the one above.
pub fn changes_there<'a>(cells: impl Iterator<Item = &'a str>, falls: &[usize]) -> bool {
    let mut above = "";
    let mut changes = Vec::new();
    for (row, cell) in cells.enumerate().filter(|(_, cell)| !cell.is_empty()) {
        if cell != above && row > 0 {
            changes.push(row);
        }
        above = cell;
    }
    changes == falls
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strains_begin_anew_where_their_origin_changes_between_stages() {
        // A specimen of void ratio 0.5, consolidated by 1 %, sheared and unloaded.
        let rows = [(0.0, 0.0), (0.0, 0.01), (1.0, 0.002), (1.0, 0.004), (2.0, 0.003)];
        let row = |(at, (stage, strain)): (usize, (f64, f64))| {
            let before = if at < 2 { 1.0 } else { 1.0 - 0.01 };
            origin([stage, 1.5 * before * (1.0 - strain) - 1.0, 1.0], strain)
        };
        let origins: Vec<Origin> = rows.into_iter().enumerate().map(row).collect();
        assert_eq!(restart(&origins), Some(2));
        assert_eq!(restart(&origins[2..]), None);
        assert_eq!(restart(&[]), None);
    }

    #[test]
    fn strains_that_fall_back_far_are_found() {
        let found = |strains: &[f64]| falls(strains, &vec![1.0; strains.len()]);
        assert_eq!(found(&[0.0, 1.0, 3.0, 0.0, 2.0, 3.0, 0.1]), [3, 6]);
        // A loop, and noise at the start.
        assert_eq!(found(&[0.0, 0.02, 0.0, 1.0, 3.0, 2.0, 4.0]), Vec::<usize>::new());
        // Two quantities below each other in one table.
        let nan = f64::NAN;
        assert_eq!(falls(&[0.0, 1.0, 0.0, 1.0], &[5.0, 6.0, nan, nan]), Vec::<usize>::new());
    }

    #[test]
    fn a_column_parts_curves_where_it_changes_with_them() {
        let parts = |cells: [&'static str; 5]| changes_there(cells.into_iter(), &[3]);
        assert!(parts(["A", "A", "A", "B", "B"]) && parts(["A", "", "", "B", ""]));
        assert!(!parts(["A", "A", "B", "B", "B"]) && !parts(["1", "2", "3", "4", "5"]) && !parts([""; 5]));
    }
}
