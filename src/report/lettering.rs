//! Texts that have to fit: cut at their ends, cut in their middles, or in lines.

use super::drawing::text_width;

/// The text, cut with an ellipsis to `width` [px].
pub fn fitted(text: &str, size: f64, width: f64) -> String {
    if text_width(text, size) <= width {
        return text.to_string();
    }
    let mut kept: String = text.to_string();
    while !kept.is_empty() && text_width(&kept, size) + size > width {
        kept.pop();
    }
    kept.trim_end().to_string() + "…"
}

/// The text, its middle cut out to `width` [px], since names often differ at their ends.
pub fn shortened(text: &str, size: f64, width: f64) -> String {
    if text_width(text, size) <= width {
        return text.to_string();
    }
    let letters: Vec<char> = text.chars().collect();
    let cut = |kept: usize| -> String {
        let (head, tail) = (&letters[..kept.div_ceil(2)], &letters[letters.len() - kept / 2..]);
        let [head, tail] = [head, tail].map(|part| part.iter().collect::<String>());
        format!("{}…{}", head.trim_end(), tail.trim_start())
    };
    let fits = |kept: &usize| text_width(&cut(*kept), size) <= width;
    cut((0..letters.len()).rev().find(fits).unwrap_or(0))
}

/// The text in one line, or in two where it does not fit into `width` [px]; lines that are longer still are cut.
pub fn wrapped(text: &str, size: f64, width: f64) -> Vec<String> {
    match text_width(text, size) <= width {
        true => vec![text.to_string()],
        false => halves(text, size).into_iter().map(|line| fitted(line, size, width)).collect(),
    }
}

/// The text in as many lines as it takes for none to be wider than `width` [px]: parted at spaces, words that are wider still anywhere.
pub fn folded(text: &str, size: f64, width: f64) -> Vec<String> {
    let fits = |line: &str| text_width(line, size) <= width;
    if fits(text) {
        return vec![text.to_string()];
    }
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        if let Some(line) = lines.last_mut().filter(|line| fits(&format!("{line} {word}"))) {
            *line = format!("{line} {word}");
            continue;
        }
        let mut piece = String::new();
        for letter in word.chars() {
            if !piece.is_empty() && !fits(&format!("{piece}{letter}")) {
                lines.push(std::mem::take(&mut piece));
            }
            piece.push(letter);
        }
        lines.push(piece);
    }
    lines
}

/// The width at which [`wrapped`] need not cut [px].
pub fn least_width(text: &str, size: f64) -> f64 {
    halves(text, size).into_iter().map(|line| text_width(line, size)).fold(0.0, f64::max)
}

/// The text in two lines, the wider one as narrow as can be; at a comma where there is one, in one line where there is no space.
fn halves(text: &str, size: f64) -> Vec<&str> {
    let spaces: Vec<usize> = text.match_indices(' ').map(|(at, _)| at).collect();
    let commas: Vec<usize> = spaces.iter().copied().filter(|at| text[..*at].ends_with(',')).collect();
    let wider = |at: &usize| text_width(&text[..*at], size).max(text_width(&text[*at + 1..], size));
    let places = if commas.is_empty() { spaces } else { commas };
    match places.into_iter().min_by(|a, b| wider(a).total_cmp(&wider(b))) {
        Some(at) => vec![&text[..at], &text[at + 1..]],
        None => vec![text],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_texts_are_cut() {
        let cut = fitted(&"very ".repeat(60), 12.0, 200.0);
        assert!(cut.ends_with('…') && text_width(&cut, 12.0) <= 200.0, "{cut}");
        let cut = shortened(&format!("first {}last", "very ".repeat(60)), 12.0, 200.0);
        assert!(cut.starts_with("first ") && cut.ends_with(" last"), "{cut}");
        assert!(cut.contains('…') && text_width(&cut, 12.0) <= 200.0, "{cut}");
    }

    #[test]
    fn folded_texts_lose_nothing() {
        for text in
            ["0.702 MPa at 0.6 %, at the end: still rising", "cases/results/pressures/lab_sheet_pressure"]
        {
            let lines = folded(text, 12.0, 110.0);
            assert!(lines.len() > 1 && lines.iter().all(|line| text_width(line, 12.0) <= 110.0), "{lines:?}");
            assert_eq!(lines.concat().replace(' ', ""), text.replace(' ', ""));
        }
        assert_eq!(folded("two  words", 12.0, 110.0), ["two  words"]);
        assert_eq!(folded("ab", 12.0, 1.0), ["a", "b"]);
    }

    #[test]
    fn texts_are_parted_where_they_are_narrowest() {
        let name = "volume strain [%], contraction +";
        assert_eq!(wrapped(name, 13.0, 400.0), [name]);
        assert_eq!(wrapped(name, 13.0, 150.0), ["volume strain [%],", "contraction +"]);
        let least = least_width(name, 13.0);
        assert!(wrapped(name, 13.0, least).iter().all(|line| !line.ends_with('…')));
        assert!(wrapped(name, 13.0, least - 20.0)[0].ends_with('…'));
        assert_eq!(
            wrapped("normal force over its mean [1]", 13.0, 150.0),
            ["normal force", "over its mean [1]"]
        );
        assert_eq!(wrapped("one", 13.0, 1.0), ["…"]);
    }
}
