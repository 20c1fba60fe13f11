//! A table as a spreadsheet saves it: rows of cells, parted by commas, semicolons or tabs. Empty rows and lines that begin with # are left out.

/// The rows of a table, its header among them.
pub struct Sheet {
    pub separator: u8,
    pub rows: Vec<Row>,
}

/// Number of the line in the file, and cells.
pub type Row = (usize, csv::StringRecord);

impl Sheet {
    /// The rows of a text, parted by what its first line names or its header has; otherwise the line at fault and what is wrong there.
    pub fn parse(text: &str) -> Result<Sheet, (usize, String)> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let (said, text) = separator_line(text);
        let is_content = |line: &&str| !line.trim().is_empty() && !line.trim().starts_with('#');
        let header = text.lines().find(is_content).unwrap_or("");
        let found = [';', '\t', ','].into_iter().find(|c| header.contains(*c));
        let separator = match said.or(found).map(u8::try_from) {
            None => b',',
            Some(Ok(separator)) if separator.is_ascii() => separator,
            Some(_) => return Err((1, "names a separator that is no comma, semicolon or tab".into())),
        };
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(separator)
            .has_headers(false)
            .flexible(true)
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .from_reader(text.as_bytes());
        let line_of = |position: Option<&csv::Position>| position.map_or(1, |at| line_at(text, at));
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|e| (line_of(e.position()), e.to_string()))?;
            let is_remark = record.get(0).is_some_and(|first| first.starts_with('#'));
            if !is_remark && record.iter().any(|cell| !cell.is_empty()) {
                rows.push((line_of(record.position()), record));
            }
        }
        Ok(Sheet { separator, rows })
    }
}

/// The line of the file on which a record begins. The reader stands behind the record before: above empty lines and remarks, and within a line break
/// of two characters.
fn line_at(text: &str, at: &csv::Position) -> usize {
    let rest = text.get(at.byte() as usize..).unwrap_or("");
    let passed = rest.lines().take_while(|line| line.is_empty() || line.starts_with('#'));
    at.line() as usize + passed.count()
}

/// What a table's first line says that its cells are parted by, as Excel writes and reads it ("sep=;"), and the text with that line emptied.
fn separator_line(text: &str) -> (Option<char>, &str) {
    let line = text.lines().next().unwrap_or("");
    let plain = line.trim_matches([' ', '"']).to_ascii_lowercase();
    let mut said = plain.strip_prefix("sep=").unwrap_or("").chars();
    match (said.next(), said.next()) {
        (Some(separator), None) => (Some(separator), &text[line.len()..]),
        _ => (None, text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_know_their_lines_however_these_end() {
        let text = "sep=;\n# by hand\n\na;b\n1;2\n\"of two\nlines\";3\n# more\n\n;\n4;5";
        for text in [text.to_string(), text.replace('\n', "\r\n")] {
            let sheet = Sheet::parse(&text).expect("a sheet");
            let lines: Vec<usize> = sheet.rows.iter().map(|(line, _)| *line).collect();
            assert_eq!(lines, [4, 5, 6, 11], "{text:?}");
        }
    }

    #[test]
    fn the_line_that_names_the_separator_is_taken_out() {
        assert_eq!(separator_line("sep=;\r\na;b"), (Some(';'), "\r\na;b"));
        assert_eq!(separator_line("\"SEP=\t\"\na"), (Some('\t'), "\na"));
        for text in ["", "a;b\nsep=;", "sep=;;\na", "separation [mm];b"] {
            assert_eq!(separator_line(text), (None, text));
        }
    }
}
