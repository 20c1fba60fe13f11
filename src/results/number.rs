//! Numbers as people read them.

/// A number with so many decimals, without the sign of what is zero or rounds to it: a sum over nothing is -0.
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| matches!(c, '0' | '.')) => digits.into(),
        Some(_) | None => text,
    }
}

/// So many of what one is called: "1 thread", "2 threads".
pub fn counted(number: impl std::fmt::Display, one: &str) -> String {
    let number = number.to_string();
    let ending = if number == "1" { "" } else { "s" };
    format!("{number} {one}{ending}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_no_several() {
        let said = [0, 1, 2].map(|number| counted(number, "thread"));
        assert_eq!(said, ["0 threads", "1 thread", "2 threads"]);
    }

    #[test]
    fn zero_has_no_sign() {
        let nothing: f64 = Vec::<f64>::new().into_iter().sum();
        let shown = [(nothing, 0), (-0.0, 2), (-0.004, 2), (-0.006, 2), (3.0, 0), (f64::NEG_INFINITY, 1)]
            .map(|(value, decimals)| fixed(value, decimals));
        assert_eq!(shown, ["0", "0.00", "0.00", "-0.01", "3", "-inf"]);
    }
}
