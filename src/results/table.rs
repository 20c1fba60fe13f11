//! A named table of equally long columns: `/grains` (static), `/contacts/<state>`, `/breakage`.

/// One column of a table; it becomes one dataset with `units` and `long_name`.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    pub name: String,
    /// Unit as text; `1` for a pure number.
    pub units: String,
    pub long_name: String,
    pub data: ColumnData,
}

/// The numbers of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum ColumnData {
    Floats(Vec<f64>),
    Integers(Vec<i64>),
    /// A dataset of shape (rows, 3).
    Vectors(Vec<[f64; 3]>),
}

impl Column {
    pub fn floats(name: &str, units: &str, long_name: &str, values: impl IntoIterator<Item = f64>) -> Self {
        Self::new(name, units, long_name, ColumnData::Floats(values.into_iter().collect()))
    }

    /// Of a table of one row.
    pub fn number(name: &str, units: &str, long_name: &str, value: f64) -> Self {
        Self::floats(name, units, long_name, [value])
    }

    /// Whole numbers; one that 64 bits do not hold is the largest of these.
    pub fn integers(name: &str, long_name: &str, values: impl IntoIterator<Item: TryInto<i64>>) -> Self {
        let values = values.into_iter().map(|value| value.try_into().unwrap_or(i64::MAX));
        Self::new(name, "1", long_name, ColumnData::Integers(values.collect()))
    }

    /// Of a table of one row.
    pub fn count(name: &str, long_name: &str, value: impl TryInto<i64>) -> Self {
        Self::integers(name, long_name, [value])
    }

    pub fn vectors(
        name: &str,
        units: &str,
        long_name: &str,
        values: impl IntoIterator<Item = [f64; 3]>,
    ) -> Self {
        Self::new(name, units, long_name, ColumnData::Vectors(values.into_iter().collect()))
    }

    fn new(name: &str, units: &str, long_name: &str, data: ColumnData) -> Self {
        Column { name: name.into(), units: units.into(), long_name: long_name.into(), data }
    }

    pub fn rows(&self) -> usize {
        match &self.data {
            ColumnData::Floats(values) => values.len(),
            ColumnData::Integers(values) => values.len(),
            ColumnData::Vectors(values) => values.len(),
        }
    }
}
