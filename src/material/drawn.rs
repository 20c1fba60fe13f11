//! What the cells of all bodies have drawn from the laws of one property: how many values, how many thrown
//! away, their spread.
//!
//! A law may reach where no rock is (a normal one below zero, say). Such draws are thrown away and made
//! again, which shifts the mean.

use crate::material::field::{Field, Property};

/// Draws of one property over the cells of all bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drawn {
    pub property: Property,
    /// Values in use, and draws thrown away.
    pub values: u64,
    pub rejected: u64,
    /// The mean that the laws were asked for (over the cells), that of the values, their standard deviation
    /// and range [Pa, or 1 for Poisson's ratio].
    pub asked: f64,
    pub mean: f64,
    pub deviation: f64,
    pub range: [f64; 2],
}

impl Drawn {
    /// Of the fields of all bodies, each with the mean that its law was asked for; `None` where these have no
    /// values.
    pub fn over(property: Property, fields: &[(f64, Field)]) -> Option<Self> {
        // Away from which squares are summed, so that little is lost.
        let (middle, _) = fields.first()?;
        let (mut values, mut rejected) = (0, 0);
        let (mut asked, mut sum, mut squares) = (0.0, 0.0, 0.0);
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for (mean, field) in fields {
            values += field.values.len() as u64;
            rejected += field.rejected;
            asked += mean * field.values.len() as f64;
            for &value in &field.values {
                sum += value - middle;
                squares += (value - middle).powi(2);
                range = [range[0].min(value), range[1].max(value)];
            }
        }
        if values == 0 {
            return None;
        }
        let (count, mean) = (values as f64, sum / values as f64);
        Some(Drawn {
            property,
            values,
            rejected,
            asked: asked / count,
            mean: middle + mean,
            deviation: (squares / count - mean * mean).max(0.0).sqrt(),
            range,
        })
    }
}

impl std::fmt::Display for Drawn {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let draws = self.values + self.rejected;
        write!(
            f,
            "{}: {} of {draws} draws are impossible and made again, which changes the mean by {:+.2} %",
            self.property.name(),
            self.rejected,
            100.0 * (self.mean / self.asked - 1.0)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_pooled_over_all_their_cells() {
        let field = |values: &[f64], rejected| Field { values: values.to_vec(), rejected };
        let property = Property::YoungsModulus;
        let fields = [(2.0, field(&[1.0, 2.0, 3.0], 1)), (6.0, field(&[6.0], 2))];
        let drawn = Drawn::over(property, &fields).expect("four values");
        // Means 12 / 4 asked and found; squares (1 + 4 + 9 + 36) / 4 - 9 = 3.5. All exact in binary but the
        // root.
        let expected = Drawn {
            property,
            values: 4,
            rejected: 3,
            asked: 3.0,
            mean: 3.0,
            deviation: 3.5_f64.sqrt(),
            range: [1.0, 6.0],
        };
        assert_eq!(drawn, expected);
        assert_eq!(Drawn::over(property, &[]), None);
        assert_eq!(Drawn::over(property, &[(1.0, field(&[], 0))]), None);
    }
}
