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
    pub fn floats(name: &str, units: &str, long_name: &str, values: Vec<f64>) -> Self {
        Self::new(name, units, long_name, ColumnData::Floats(values))
    }

    pub fn integers(name: &str, long_name: &str, values: Vec<i64>) -> Self {
        Self::new(name, "1", long_name, ColumnData::Integers(values))
    }

    pub fn vectors(name: &str, units: &str, long_name: &str, values: Vec<[f64; 3]>) -> Self {
        Self::new(name, units, long_name, ColumnData::Vectors(values))
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
