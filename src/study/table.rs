//! Tables as Markdown and CSV.

use std::path::Path;

use crate::error::{Error, Result};
use crate::report::short;
use crate::results::plain_cell;

use super::Member;
use super::order::{Order, convergence_index, observed, of_triples};
use super::outcome::{Figure, Figures, common_strain};
use super::vary::Setting;

/// Columns of a terminal.
const TERMINAL: usize = 80;

/// A table of texts.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    pub header: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// In Markdown, columns as wide as their widest cell. Those that a terminal has no room for stand in tables below, each with the first column.
    pub fn to_markdown(&self) -> String {
        let cells: Vec<Vec<String>> = std::iter::once(&self.header)
            .chain(&self.rows)
            .map(|row| row.iter().map(|cell| cell.replace('|', "\\|").replace('\n', " ")).collect())
            .collect();
        let widths: Vec<usize> = (0..self.header.len())
            .map(|column| {
                let all = cells.iter().map(|row| row.get(column).map_or(0, |cell| cell.chars().count()));
                all.max().unwrap_or(0).max(3)
            })
            .collect();
        let table = |columns: &Vec<usize>| {
            let line = |row: &Vec<String>| {
                let padded = columns.iter().map(|&k| (widths[k], row.get(k).map_or("", |c| c)));
                let padded: Vec<String> = padded.map(|(width, cell)| format!("{cell:width$}")).collect();
                format!("| {} |", padded.join(" | "))
            };
            let rule: Vec<String> = columns.iter().map(|&k| "-".repeat(widths[k])).collect();
            let mut lines = vec![line(&cells[0]), format!("| {} |", rule.join(" | "))];
            lines.extend(cells[1..].iter().map(line));
            lines.join("\n")
        };
        side_by_side(&widths).iter().map(table).collect::<Vec<_>>().join("\n\n")
    }

    /// As one table where a terminal has room for all columns, else as a list.
    pub fn to_table_or_list(&self) -> String {
        let table = self.to_markdown();
        let fits = |line: &str| !line.is_empty() && line.chars().count() <= TERMINAL;
        if table.lines().all(fits) { table } else { self.to_list() }
    }

    /// Each row as its first cell, and indented below it what the others say, at most 80 columns wide where single cells are.
    pub fn to_list(&self) -> String {
        let mut lines = Vec::new();
        for row in &self.rows {
            lines.extend(row.first().cloned());
            let mut line = String::new();
            for (name, cell) in self.header.iter().zip(row).skip(1).filter(|(_, cell)| !cell.is_empty()) {
                let said = format!("{name}: {cell}");
                if !line.is_empty() && line.chars().count() + said.chars().count() + 4 > TERMINAL {
                    lines.push(std::mem::take(&mut line));
                }
                line += if line.is_empty() { "    " } else { "; " };
                line += &said;
            }
            lines.push(line);
        }
        lines.join("\n")
    }

    /// Rows for columns, so that it is as wide as it has rows.
    pub fn turned(&self) -> Table {
        let all: Vec<&Vec<String>> = std::iter::once(&self.header).chain(&self.rows).collect();
        let line = |k: usize| all.iter().map(|row| row.get(k).cloned().unwrap_or_default()).collect();
        Table { header: line(0), rows: (1..self.header.len()).map(line).collect() }
    }

    /// Puts a column of numbers behind the first `at`.
    pub fn insert_column(&mut self, at: usize, name: &str, values: &[f64]) {
        self.header.insert(at, name.into());
        for (row, value) in self.rows.iter_mut().zip(values) {
            row.insert(at, number(*value));
        }
    }

    pub fn write_csv(&self, path: &Path) -> Result<()> {
        let write = || -> csv::Result<()> {
            let mut writer = csv::WriterBuilder::new().flexible(true).from_path(path)?;
            for row in std::iter::once(&self.header).chain(&self.rows) {
                writer.write_record(row.iter().map(|cell| plain_cell(cell).into_owned()))?;
            }
            Ok(writer.flush()?)
        };
        write().map_err(|e| Error::io("write", path, e.into()))
    }
}

/// Columns of these widths that fit a terminal side by side, in groups that all begin with the first column.
fn side_by_side(widths: &[usize]) -> Vec<Vec<usize>> {
    // Behind the first bar each column has two blanks and a bar.
    let wide = |columns: &[usize]| 1 + columns.iter().map(|&k| widths[k] + 3).sum::<usize>();
    let mut groups: Vec<Vec<usize>> = vec![(0..widths.len().min(1)).collect()];
    for column in 1..widths.len() {
        let last = groups.len() - 1;
        let with = [&groups[last][..], &[column]].concat();
        if groups[last].len() == 1 || wide(&with) <= TERMINAL {
            groups[last] = with;
        } else {
            groups.push(vec![0, column]);
        }
    }
    groups
}

/// As many digits as a comparison needs; nothing for what is not there.
fn number(value: f64) -> String {
    let plain = |text: &str| text.trim_end_matches('0').trim_end_matches('.').to_string();
    match value {
        x if !x.is_finite() => String::new(),
        // Without a sign of its own: a sum over nothing is -0.
        x if x == 0.0 || x.abs() >= 0.1 => plain(&format!("{:.6}", x + 0.0)),
        x if x.abs() >= 1e-3 => plain(&format!("{x:.8}")),
        x => {
            let text = format!("{x:.6e}");
            let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
            format!("{}e{exponent}", plain(digits))
        }
    }
}

fn counted(value: f64) -> String {
    if value.is_finite() { format!("{:.0}", value + 0.0) } else { String::new() }
}

fn seconds(value: f64) -> String {
    if value.is_finite() { format!("{value:.1}") } else { String::new() }
}

/// One row a value of what is varied.
pub fn study(heading: &str, settings: &[Setting], all: &[Figures], compared: &[Figure]) -> Table {
    let mut header = vec![heading.to_string(), "status".into()];
    header.extend(compared.iter().map(|figure| figure.name.clone()));
    let cost = ["increments", "factorisations", "cuts", "wall time [s]", "time of the increments [s]"];
    header.extend(cost.map(String::from));
    let rows = settings
        .iter()
        .zip(all)
        .enumerate()
        .map(|(at, (setting, figures))| {
            let mut row = vec![setting.label.clone(), figures.status.clone()];
            row.extend(compared.iter().map(|figure| number(figure.values[at])));
            row.push(figures.increments.to_string());
            row.push(counted(figures.factorisations));
            row.push(counted(figures.cuts));
            row.extend([figures.wall_time, figures.solving_time].map(seconds));
            row
        })
        .collect();
    Table { header, rows }
}

/// What the values of a figure say of their order; not a number where they say nothing.
struct Convergence {
    order: Order,
    /// Of each three neighbours that have one, and how many threes there are.
    triples: Vec<f64>,
    possible: usize,
    /// At size zero.
    limit: f64,
    /// How far the finest value may be from it, and its grid convergence index [%].
    error: f64,
    index: f64,
}

impl Convergence {
    fn of(settings: &[Setting], figure: &Figure) -> Self {
        let series = series(settings, figure);
        let order = observed(&series);
        let finest = series.iter().rev().find(|(_, value)| value.is_finite()).map_or(f64::NAN, |(_, v)| *v);
        let limit = match order {
            Order::Observed { limit, .. } => limit,
            Order::Same | Order::NotMonotone | Order::NotConverging | Order::TooFew => f64::NAN,
        };
        Convergence {
            order,
            triples: of_triples(&series),
            possible: series.iter().filter(|(_, value)| value.is_finite()).count().saturating_sub(2),
            limit,
            error: 100.0 * ((finest - limit) / limit).abs(),
            index: 100.0 * convergence_index(order, finest),
        }
    }

    /// The smallest and the largest order of the triples.
    fn range(&self) -> [f64; 2] {
        [f64::min, f64::max].map(|end| self.triples.iter().copied().fold(f64::NAN, end))
    }
}

/// One row a figure: the order observed from the three finest values, that of all neighbours, the value at size zero, and how far
/// the finest may be from it.
pub fn orders(settings: &[Setting], compared: &[Figure]) -> Table {
    let header = [
        "figure",
        "observed order",
        "of all triples",
        "at size zero",
        "error of the finest [%]",
        "its GCI [%]",
    ];
    let rows = compared
        .iter()
        .map(|figure| {
            let found = Convergence::of(settings, figure);
            let [least, most] = found.range();
            let range = match (found.possible, found.triples.len()) {
                (0 | 1, _) => String::new(),
                (all, 0) => format!("none of {all}"),
                (all, some) => format!("{least:.2} to {most:.2} ({some} of {all})"),
            };
            let percent = |value: f64| if value.is_finite() { short(value) } else { String::new() };
            let (order, limit) = (found.order.to_string(), number(found.limit));
            vec![figure.name.clone(), order, range, limit, percent(found.error), percent(found.index)]
        })
        .collect();
    Table { header: header.map(String::from).to_vec(), rows }
}

/// The same for programs: a number or nothing in each column of numbers, and why there is no order in one of its own.
pub fn order_numbers(settings: &[Setting], compared: &[Figure]) -> Table {
    let header = [
        "figure",
        "observed order",
        "least of all triples",
        "most of all triples",
        "triples with an order",
        "triples",
        "at size zero",
        "error of the finest [%]",
        "its GCI [%]",
        "remark",
    ];
    let rows = compared
        .iter()
        .map(|figure| {
            let found = Convergence::of(settings, figure);
            let (order, remark) = match found.order {
                Order::Observed { order, .. } if order.is_finite() => (number(order), String::new()),
                other => (String::new(), other.to_string()),
            };
            let mut row = vec![figure.name.clone(), order];
            row.extend(found.range().map(number));
            row.extend([found.triples.len(), found.possible].map(|count| count.to_string()));
            row.extend([found.limit, found.error, found.index].map(number));
            row.push(remark);
            row
        })
        .collect();
    Table { header: header.map(String::from).to_vec(), rows }
}

/// A figure over what goes to zero; what is at zero is left out.
pub fn series(settings: &[Setting], figure: &Figure) -> Vec<(f64, f64)> {
    let sized = settings.iter().zip(&figure.values);
    sized.filter_map(|(setting, value)| Some((setting.size.filter(|size| *size > 0.0)?, *value))).collect()
}

/// One row a figure: mean and scatter over the members.
pub fn scatter(compared: &[Figure]) -> Table {
    let header = ["figure", "members", "mean", "standard deviation", "variation [%]", "least", "most"];
    let rows = compared
        .iter()
        .map(|figure| {
            let values: Vec<f64> = figure.values.iter().copied().filter(|x| x.is_finite()).collect();
            let (mean, deviation) = mean_and_deviation(&values);
            let least = values.iter().copied().fold(f64::NAN, f64::min);
            let most = values.iter().copied().fold(f64::NAN, f64::max);
            vec![
                figure.name.clone(),
                values.len().to_string(),
                number(mean),
                number(deviation),
                number(100.0 * deviation / mean.abs()),
                number(least),
                number(most),
            ]
        })
        .collect();
    Table { header: header.map(String::from).to_vec(), rows }
}

/// Mean and sample standard deviation; NaN for too few values.
pub fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
    (mean, if values.len() > 1 { (squares / (count - 1.0)).sqrt() } else { f64::NAN })
}

/// One row a member of a batch.
pub fn batch(members: &[Member], all: &[Figures]) -> Table {
    let scenes = !(common_strain(all) > 0.0);
    let mut header: Vec<String> = ["name", "status", "increments", "cuts"].map(String::from).to_vec();
    match scenes {
        true => header.extend(["external work [J]", "friction energy [J]"].map(String::from)),
        false => header.extend(
            ["axial strain [%]", "peak q [MPa]", "peak at [%]", "last q [MPa]", "last volume strain [%]"]
                .map(String::from),
        ),
    }
    header.extend(["factorisations", "wall time [s]", "reason"].map(String::from));
    let varied = varied(members);
    header.splice(1..1, varied.iter().map(|pointer| pointer.to_string()));
    let rows = members
        .iter()
        .zip(all)
        .map(|(member, f)| {
            let mut row =
                vec![member.name.clone(), f.status.clone(), f.increments.to_string(), counted(f.cuts)];
            if scenes {
                row.extend([number(f.external_work), number(f.friction_energy)]);
            } else {
                let peak = f.peak().unwrap_or((f64::NAN, f64::NAN));
                let last = |values: &[f64]| values.last().copied().unwrap_or(f64::NAN);
                row.extend(
                    [
                        100.0 * f.last_strain(),
                        1e-6 * peak.0,
                        100.0 * peak.1,
                        1e-6 * last(&f.deviatoric_stress),
                        100.0 * last(&f.volumetric_strain),
                    ]
                    .map(number),
                );
            }
            row.extend([counted(f.factorisations), seconds(f.wall_time), f.reason.clone()]);
            row.splice(1..1, varied.iter().map(|pointer| overridden(member, pointer)));
            row
        })
        .collect();
    Table { header, rows }
}

/// The JSON pointers whose values are not the same in all members, in the order in which they come up.
fn varied(members: &[Member]) -> Vec<&str> {
    let mut pointers: Vec<&str> = Vec::new();
    for (pointer, _) in members.iter().flat_map(|member| &member.overrides) {
        if !pointers.contains(&pointer.as_str()) {
            pointers.push(pointer);
        }
    }
    let differs = |pointer: &&str| {
        let mut values = members.iter().map(|member| overridden(member, pointer));
        let first = values.next();
        values.any(|value| Some(value) != first)
    };
    pointers.into_iter().filter(differs).collect()
}

/// What a member puts in place of the case's value: texts as they are, else JSON; nothing where it leaves the case's.
fn overridden(member: &Member, pointer: &str) -> String {
    let value = member.overrides.iter().rev().find(|(at, _)| at == pointer).map(|(_, value)| value);
    value.map_or_else(String::new, |value| value.as_str().map_or_else(|| value.to_string(), str::to_string))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markdown_and_csv() {
        let table = Table {
            header: vec!["a".into(), "b, c".into()],
            rows: vec![vec!["1|2".into(), "say \"x\"".into()], vec!["3".into(), String::new()]],
        };
        let file = tempfile::NamedTempFile::new().expect("a file");
        table.write_csv(file.path()).expect("written");
        let text = std::fs::read_to_string(file.path()).expect("the table");
        assert_eq!(text, "a,\"b, c\"\n1|2,\"say \"\"x\"\"\"\n3,\n");
        assert_eq!(
            table.to_markdown(),
            "| a    | b, c    |\n| ---- | ------- |\n| 1\\|2 | say \"x\" |\n| 3    |         |"
        );
    }

    /// Seven values of a study do not fit side by side, nor do the columns of a batch.
    #[test]
    fn tables_fit_a_terminal() {
        let texts = |count: usize, text: &dyn Fn(usize) -> String| (0..count).map(text).collect::<Vec<_>>();
        let study = Table {
            header: texts(8, &|k| if k == 0 { "increment [1]".into() } else { format!("{k}e-4") }),
            rows: vec![
                texts(8, &|k| {
                    if k == 0 {
                        "volume strain at 15.0000 % strain [%]".into()
                    } else {
                        format!("-0.11234{k}")
                    }
                }),
                texts(8, &|k| if k == 0 { "status".into() } else { "finished".into() }),
            ],
        };
        let text = study.to_markdown();
        assert!(text.lines().all(|line| line.chars().count() <= TERMINAL), "{text}");
        let tables: Vec<&str> = text.split("\n\n").collect();
        assert!(
            tables.len() == 3 && tables.iter().all(|table| table.starts_with("| increment [1] ")),
            "{text}"
        );
        // Each value once, below its heading.
        for k in 1..8 {
            let holds = |table: &&&str| {
                table.contains(&format!(" {k}e-4 ")) && table.contains(&format!(" -0.11234{k} "))
            };
            assert_eq!(tables.iter().filter(holds).count(), 1, "{k}: {text}");
        }
        let batch = Table {
            header: texts(7, &|k| format!("column {k} [MPa]")),
            rows: vec![texts(7, &|k| format!("{k}.123456")); 2],
        };
        let list = batch.to_table_or_list();
        assert!(list.starts_with("0.123456\n    column 1 [MPa]: 1.123456; "), "{list}");
        assert!(list.lines().all(|line| line.chars().count() <= TERMINAL), "{list}");
        let narrow =
            Table { header: texts(3, &|k| format!("c{k}")), rows: vec![texts(3, &|k| k.to_string())] };
        assert!(narrow.to_table_or_list().starts_with("| c0 "));
        // What is too wide by itself stands alone.
        assert_eq!(side_by_side(&[40, 60, 10, 10]), [vec![0, 1], vec![0, 2, 3]]);
        assert_eq!(side_by_side(&[3]), [vec![0]]);
    }

    #[test]
    fn a_column_goes_where_it_is_told() {
        let texts = |row: &[&str]| row.iter().map(|text| text.to_string()).collect::<Vec<_>>();
        let mut table =
            Table { header: texts(&["a", "b"]), rows: vec![texts(&["1", "2"]), texts(&["3", "4"])] };
        table.insert_column(1, "x", &[36.25, f64::NAN]);
        assert_eq!(table.header, ["a", "x", "b"]);
        assert_eq!(table.rows, [texts(&["1", "36.25", "2"]), texts(&["3", "", "4"])]);
    }

    #[test]
    fn a_turned_table_has_its_header_as_its_first_column() {
        let texts = |row: &[&str]| row.iter().map(|text| text.to_string()).collect::<Vec<_>>();
        let table = Table { header: texts(&["a", "b"]), rows: vec![texts(&["1", "2"]), texts(&["3", "4"])] };
        let turned = table.turned();
        assert_eq!((turned.header, turned.rows), (texts(&["a", "1", "3"]), vec![texts(&["b", "2", "4"])]));
    }

    #[test]
    fn a_list_fits_a_terminal() {
        let texts = |row: &[&str]| row.iter().map(|text| text.to_string()).collect::<Vec<_>>();
        let header = orders(&[], &[]).header;
        let first = texts(&[
            "mean q to 15.0000 % strain [MPa]",
            "2.09",
            "1.80 to 2.20 (3 of 4)",
            "0.211187",
            "0.117",
            "0.146",
        ]);
        let second = texts(&["strain at that peak [%]", "no order: the values are the same", "", "", "", ""]);
        let list = Table { header, rows: vec![first, second] }.to_list();
        let lines: Vec<&str> = list.lines().collect();
        assert_eq!(lines[0], "mean q to 15.0000 % strain [MPa]");
        assert!(
            list.contains("observed order: 2.09; ") && list.contains("its GCI [%]: 0.146\nstrain"),
            "{list}"
        );
        assert_eq!(*lines.last().expect("lines"), "    observed order: no order: the values are the same");
        assert!(lines.iter().all(|line| line.chars().count() <= TERMINAL), "{list}");
    }

    /// Three values that agree by accident are no proof that the finest is exact.
    #[test]
    fn an_order_above_the_highest_gives_no_error() {
        let setting = |size| Setting { label: String::new(), size: Some(size), overrides: vec![] };
        let figure = Figure { name: "q".into(), values: vec![2.0, 1.0 + 1e-8, 1.0] };
        let table = orders(&[0.4, 0.2, 0.1].map(setting), &[figure]);
        assert_eq!(table.rows[0], ["q", "above 20", "", "", "", ""]);
    }

    /// The printed table has powers of ten and reasons; a program reads numbers.
    #[test]
    fn programs_find_numbers_in_columns_of_numbers() {
        let setting = |size| Setting { label: String::new(), size: Some(size), overrides: vec![] };
        let settings = [0.4, 0.2, 0.1].map(setting);
        let figure = |name: &str, error: f64, values: [f64; 3]| Figure {
            name: name.into(),
            values: values.map(|value| 1.0 + error * value).to_vec(),
        };
        let compared = [
            figure("close", 1e-6, [4.0, 2.0, 1.0]),
            figure("not", 1.0, [1.0, 2.0, 1.5]),
            figure("accident", 1.0, [1.0, 1e-8, 0.0]),
        ];
        let shown = orders(&settings, &compared);
        assert!(shown.rows[0][4].contains("10⁻⁴") && shown.rows[2][1] == "above 20", "{shown:?}");
        let table = order_numbers(&settings, &compared);
        assert!(table.rows.iter().all(|row| row.len() == table.header.len()), "{table:?}");
        for row in &table.rows {
            let numbers = &row[1..row.len() - 1];
            assert!(numbers.iter().all(|cell| cell.is_empty() || cell.parse::<f64>().is_ok()), "{row:?}");
        }
        let column = |at: usize| -> Vec<&str> { table.rows.iter().map(|row| row[at].as_str()).collect() };
        assert_eq!(column(9), ["", "no order: not monotone", "above 20"]);
        assert_eq!((column(4), column(5)), (vec!["1", "0", "0"], vec!["1"; 3]));
        let error: f64 = table.rows[0][7].parse().expect("a number");
        assert!((error / 1e-4 - 1.0).abs() < 1e-3, "{error}");
    }

    /// Increments in strict balance are the limit itself, of size zero, which no order can be observed with.
    #[test]
    fn a_size_of_zero_is_left_out_of_the_order() {
        let setting = |size| Setting { label: String::new(), size: Some(size), overrides: vec![] };
        let rows = |sizes: &[f64], values: &[f64]| {
            let settings: Vec<Setting> = sizes.iter().copied().map(setting).collect();
            orders(&settings, &[Figure { name: "q".into(), values: values.to_vec() }]).rows
        };
        let without = rows(&[0.4, 0.2, 0.1], &[1.16, 1.04, 1.01]);
        assert_eq!(rows(&[0.4, 0.2, 0.1, 0.0], &[1.16, 1.04, 1.01, 0.9]), without);
        assert!(without[0][1].starts_with('2'), "{without:?}");
    }

    #[test]
    fn small_numbers_keep_their_digits() {
        let numbers = [-0.0, 12.5, -0.25, 0.09, 2.041_234_56e-4, -3e-9, 1.0 / 3.0, f64::NAN];
        let shown = ["0", "12.5", "-0.25", "0.09", "2.041235e-4", "-3e-9", "0.333333", ""];
        assert_eq!(numbers.map(number), shown);
    }

    #[test]
    fn scatter_of_known_numbers() {
        let figure = Figure { name: "x".into(), values: vec![2.0, 4.0, f64::NAN, 6.0] };
        let table = scatter(&[figure]);
        assert_eq!(table.rows[0], ["x", "3", "4", "2", "50", "2", "6"]);
    }
}
