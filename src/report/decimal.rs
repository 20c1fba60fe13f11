//! Numbers of a table whose decimals are behind a point or, as spreadsheets write them in most of Europe, behind a comma.

/// What parts whole numbers from decimals in a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Decimals {
    Point,
    Comma,
}

impl Decimals {
    /// What the cells of a table's number columns say, its cells being parted by `separator`; the fault of one that says the contrary, with its
    /// line. A cell with both marks says which of them parts thousands. A semicolon is what spreadsheets part cells by where the comma is taken, and the point
    /// may part thousands there; behind a tab or in quotes "1,250" may be a thousand.
    pub(super) fn of<'a>(
        cells: impl Iterator<Item = (usize, &'a str)> + Clone,
        separator: u8,
    ) -> Result<Self, (usize, String)> {
        let with_both = cells.clone().find_map(|(line, cell)| Some((line, cell, Self::of_both(cell)?)));
        if let Some((line, cell, decimals)) = with_both {
            let other =
                cells.clone().find(|(_, cell)| cell.contains(['.', ',']) && decimals.number(cell).is_err());
            return other.map_or(Ok(decimals), |(at, other)| {
                Err((line.max(at), format!("mixes decimal points and commas ({cell:?}, {other:?})")))
            });
        }
        let (mut point, mut comma, mut unclear, mut unclear_point) = (None, None, None, None);
        for (line, cell) in cells {
            if cell.contains('.') {
                match separator == b';' && may_be_thousands(cell, '.') {
                    true => unclear_point.get_or_insert((line, cell)),
                    false => point.get_or_insert((line, cell)),
                };
            }
            match cell.matches(',').count() {
                1 if separator == b';' || !may_be_thousands(cell, ',') => {
                    comma.get_or_insert((line, cell));
                }
                1 => {
                    unclear.get_or_insert((line, cell));
                }
                _ => {}
            }
        }
        let is_unclear = |(line, cell): (usize, &str), instead: &str| {
            Err((line, format!("{cell:?} may be a thousand or have three decimals; write {instead}")))
        };
        match (point.or(unclear_point), comma, unclear) {
            (Some((first, one)), Some((line, other)), _)
            | (Some((first, one)), None, Some((line, other))) => {
                Err((line.max(first), format!("mixes decimal points ({one:?}) and commas ({other:?})")))
            }
            (None, None, Some(cell)) => {
                is_unclear(cell, "decimals behind a point, or semicolons between the cells")
            }
            (Some(cell), None, None) if point.is_none() => {
                is_unclear(cell, "decimals behind a comma, or commas between the cells")
            }
            (None, Some(_), _) => Ok(Decimals::Comma),
            (_, None, None) => Ok(Decimals::Point),
        }
    }

    /// What a cell with points and commas says: the mark of the decimals is its last and stands there once.
    fn of_both(cell: &str) -> Option<Self> {
        let decimals = if cell.rfind('.')? > cell.rfind(',')? { Decimals::Point } else { Decimals::Comma };
        decimals.number(cell).is_ok().then_some(decimals)
    }

    /// The number in a cell, finite or not a number; the other mark may part thousands before the decimals.
    pub(super) fn number(self, cell: &str) -> Result<f64, String> {
        let (decimal, thousands) = match self {
            Decimals::Point => ('.', ','),
            Decimals::Comma => (',', '.'),
        };
        let (whole, behind) = match cell.split_once(decimal) {
            Some((whole, behind)) => (whole, format!(".{behind}")),
            None => (cell, String::new()),
        };
        let whole = match may_be_thousands(whole, thousands) {
            true => whole.replace(thousands, ""),
            false => whole.to_string(),
        };
        let is_strange = whole.contains(thousands);
        match format!("{whole}{behind}").parse::<f64>() {
            // Our own export writes NaN for what a row does not have.
            Ok(value) if !is_strange && (value.is_finite() || value.is_nan()) => Ok(value),
            _ => Err(format!("{cell:?} is no number")),
        }
    }
}

/// Whether this mark may part thousands: one to three digits before it, three behind each, no zero first.
fn may_be_thousands(cell: &str, mark: char) -> bool {
    let Some((before, behind)) = cell.trim_start_matches(['-', '+']).split_once(mark) else { return false };
    let digits = |text: &str| text.bytes().all(|c| c.is_ascii_digit());
    (1..=3).contains(&before.len())
        && digits(before)
        && !before.starts_with('0')
        && behind.split(mark).all(|group| group.len() == 3 && digits(group))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(cells: &[&str], separator: u8) -> Result<Decimals, (usize, String)> {
        Decimals::of(cells.iter().copied().enumerate(), separator)
    }

    #[test]
    fn what_parts_decimals_is_read_from_the_cells() {
        assert_eq!(of(&["0", "12", "", "NaN"], b';'), Ok(Decimals::Point));
        assert_eq!(of(&["0.5", "1e-3"], b','), Ok(Decimals::Point));
        assert_eq!(of(&["0", "0,5"], b';'), Ok(Decimals::Comma));
        assert_eq!(of(&["1,250", "7"], b';'), Ok(Decimals::Comma));
        assert_eq!(of(&["1,250", "-0,125"], b'\t'), Ok(Decimals::Comma));
        // Which mark parts thousands is plain where there are both.
        assert_eq!(of(&["1.250,5", "1.980", "7"], b';'), Ok(Decimals::Comma));
        assert_eq!(of(&["1,250", "-1,234,567.5"], b','), Ok(Decimals::Point));
        // A point that parts no thousands says what the others do.
        assert_eq!(of(&["1.250", "0.750"], b';'), Ok(Decimals::Point));
        assert_eq!(of(&["1.250", "7"], b','), Ok(Decimals::Point));
        for (cells, separator, line, says) in [
            (&["1,250", "7"][..], b'\t', 0, "may be a thousand"),
            (&["7", "-1.250"], b';', 1, "decimals behind a comma"),
            (&["1.250", "0,5"], b';', 1, "mixes"),
            (&["0.5", "0,5"], b';', 1, "mixes"),
            (&["0", "1,250", "0.5"], b'\t', 2, "mixes"),
            (&["1.250,5", "0.5"], b';', 1, "mixes"),
            (&["1,250.5", "0,5"], b'\t', 1, "mixes"),
            (&["12.50,5"], b';', 0, "mixes"),
        ] {
            let (at, message) = of(cells, separator).expect_err("refused");
            assert!(at == line && message.contains(says), "{cells:?}: {at}: {message}");
        }
    }

    #[test]
    fn numbers_are_read_as_they_are_written() {
        assert_eq!(Decimals::Comma.number("-3,25e-2"), Ok(-0.0325));
        assert_eq!(Decimals::Comma.number("17"), Ok(17.0));
        assert_eq!(Decimals::Comma.number("-1.980,5"), Ok(-1980.5));
        assert_eq!(Decimals::Point.number("1,234,567.5"), Ok(1_234_567.5));
        assert!(Decimals::Comma.number("19.80,5").is_err() && Decimals::Point.number("1,250,5").is_err());
        assert!(Decimals::Comma.number("1,2,3").is_err() && Decimals::Comma.number("inf").is_err());
        assert!(Decimals::Point.number("3,25").is_err() && Decimals::Point.number("3,").is_err());
        assert!(Decimals::Point.number("NaN").is_ok_and(f64::is_nan));
    }
}
