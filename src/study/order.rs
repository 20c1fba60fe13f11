//! Observed order of convergence from three sizes, and the value at size zero.
//!
//! Source: Richardson (1911); Roache (1994), J. Fluids Eng. 116:405-413, eqs. for a ratio that need not be constant:
//! `(f1 - f2) / (f2 - f3) = (h1^p - h2^p) / (h2^p - h3^p)` with `h1 > h2 > h3`.

/// What three values of a series say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Order {
    /// The error falls like `size^order`; `limit` is the value at size zero. An order above 20 is infinite here, and its
    /// limit not a number.
    Observed { order: f64, limit: f64 },
    /// All values are the same to rounding: what is varied does not act.
    Same,
    /// Differences change their sign.
    NotMonotone,
    /// Differences do not become smaller.
    NotConverging,
    /// Fewer than three values.
    TooFew,
}

/// Differences below this share of the values are rounding.
const ROUNDING: f64 = 1e-12;
/// Beyond, an order is an accident of three values.
const HIGHEST: f64 = 20.0;

/// The order of the three finest of a series of (size, value).
pub fn observed(series: &[(f64, f64)]) -> Order {
    let mut series: Vec<(f64, f64)> =
        series.iter().copied().filter(|(h, f)| h.is_finite() && *h > 0.0 && f.is_finite()).collect();
    series.sort_by(|a, b| b.0.total_cmp(&a.0));
    series.dedup_by(|a, b| a.0 == b.0);
    let [.., (h1, f1), (h2, f2), (h3, f3)] = series[..] else { return Order::TooFew };
    let scale = f1.abs().max(f2.abs()).max(f3.abs());
    let (coarse, fine) = (f1 - f2, f2 - f3);
    if coarse.abs() <= ROUNDING * scale && fine.abs() <= ROUNDING * scale {
        return Order::Same;
    }
    if coarse * fine <= 0.0 {
        return Order::NotMonotone;
    }
    // Monotone in p; at p = 0 the ratio is that of the logarithms.
    let ratio = |p: f64| {
        // Sizes over the middle one: powers stay in range.
        let (a, c) = (h1 / h2, h3 / h2);
        (a.powf(p) - 1.0) / (1.0 - c.powf(p))
    };
    let wanted = coarse / fine;
    let (mut low, mut high) = (1e-6, HIGHEST);
    if wanted <= ratio(low) {
        return Order::NotConverging;
    }
    if wanted >= ratio(high) {
        return Order::Observed { order: f64::INFINITY, limit: f64::NAN };
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        match ratio(middle) < wanted {
            true => low = middle,
            false => high = middle,
        }
    }
    let order = 0.5 * (low + high);
    let limit = f3 - fine / ((h2 / h3).powf(order) - 1.0);
    Order::Observed { order, limit }
}

/// The order of each three neighbours of a series that have one of at most 20, coarsest first.
pub fn of_triples(series: &[(f64, f64)]) -> Vec<f64> {
    let mut sizes: Vec<(f64, f64)> = series.iter().copied().filter(|(_, f)| f.is_finite()).collect();
    sizes.sort_by(|a, b| b.0.total_cmp(&a.0));
    let order = |three: &[(f64, f64)]| match observed(three) {
        Order::Observed { order, .. } => Some(order).filter(|order| order.is_finite()),
        Order::Same | Order::NotMonotone | Order::NotConverging | Order::TooFew => None,
    };
    sizes.windows(3).filter_map(order).collect()
}

/// Roache's grid convergence index of the finest value, as a share of it: 1.25 times the difference from the value at size
/// zero. Not a number without a limit.
pub fn convergence_index(order: Order, finest: f64) -> f64 {
    match order {
        Order::Observed { limit, .. } => 1.25 * ((limit - finest) / finest).abs(),
        Order::Same | Order::NotMonotone | Order::NotConverging | Order::TooFew => f64::NAN,
    }
}

impl std::fmt::Display for Order {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Order::Observed { order, .. } if order.is_infinite() => write!(f, "above {HIGHEST}"),
            Order::Observed { order, .. } => write!(f, "{order:.2}"),
            Order::Same => f.write_str("no order: the values are the same"),
            Order::NotMonotone => f.write_str("no order: not monotone"),
            Order::NotConverging => f.write_str("no order: differences do not shrink"),
            Order::TooFew => f.write_str("no order: fewer than three values"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_order_and_the_limit_of_synthetic_series() {
        for order in [0.5, 1.0, 2.0, 3.3] {
            for sizes in [[0.4, 0.2, 0.1], [1.0, 0.3, 0.2], [0.9, 0.5, 0.01]] {
                for sign in [1.0, -1.0] {
                    let value = |h: f64| 7.0 + sign * 2.0 * h.powf(order);
                    // Differences of 1e-6 of the values and more: their rounding of 1e-16 is 1e-10 of those.
                    // The first is far off and must not count; the order given is of no consequence.
                    let mut series: Vec<(f64, f64)> = sizes.iter().map(|&h| (h, value(h))).collect();
                    series.push((50.0, -300.0));
                    series.reverse();
                    match observed(&series) {
                        Order::Observed { order: found, limit } => {
                            assert!((found - order).abs() < 1e-6, "{order} {sizes:?}: {found}");
                            assert!((limit - 7.0).abs() < 1e-8, "{order} {sizes:?}: {limit}");
                        }
                        other => panic!("{order} {sizes:?}: {other}"),
                    }
                }
            }
        }
    }

    #[test]
    fn every_triple_of_a_clean_series_has_its_order() {
        let series: Vec<(f64, f64)> =
            [0.8, 0.4, 0.2, 0.1, 0.05].iter().map(|&h: &f64| (h, 3.0 + h * h)).collect();
        let orders = of_triples(&series);
        assert!(orders.len() == 3 && orders.iter().all(|order| (order - 2.0).abs() < 1e-6), "{orders:?}");
        // 1.25 h^2 over the finest value.
        let index = convergence_index(observed(&series), 3.0025);
        assert!((index / (1.25 * 0.0025 / 3.0025) - 1.0).abs() < 1e-5, "{index}");
        assert!(convergence_index(Order::NotMonotone, 1.0).is_nan());
    }

    #[test]
    fn an_order_that_is_an_accident_has_no_limit() {
        let series = [(0.4, 2.0), (0.2, 1.0 + 1e-8), (0.1, 1.0)];
        let order = observed(&series);
        assert!(matches!(order, Order::Observed { order, limit } if order.is_infinite() && limit.is_nan()));
        assert!(order.to_string() == "above 20" && convergence_index(order, 1.0).is_nan());
        assert!(of_triples(&series).is_empty());
    }

    #[test]
    fn says_where_there_is_none() {
        for (values, expected) in [
            ([1.0, 2.0, 1.5], Order::NotMonotone),
            ([1.0, 2.0, 2.0], Order::NotMonotone),
            ([1.0, 2.0, 4.0], Order::NotConverging),
            ([1.0, 2.0, 3.0], Order::NotConverging),
            ([3.0, 3.0, 3.0], Order::Same),
            ([3.0, f64::NAN, 2.0], Order::TooFew),
        ] {
            let series: Vec<(f64, f64)> = [0.4, 0.2, 0.1].into_iter().zip(values).collect();
            assert_eq!(observed(&series), expected, "{values:?}");
        }
        assert_eq!(observed(&[(0.1, 1.0), (0.1, 2.0), (0.2, 3.0)]), Order::TooFew);
    }
}
