//! The HTML page: one file that needs no other, readable in any browser, on paper and without colours.

use std::fmt::Write as _;
use std::ops::Range;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use crate::error::Result;
use crate::results::{escaped, fixed};

use super::axis::{duration, short};
use super::cost::Cost;
use super::grading;
use super::run::{Curve, Largest, Run};
use super::strength;
use super::viewer::{SCRIPT, View};

/// A part of the page.
pub enum Section {
    Heading(String),
    /// An SVG and its caption.
    Chart(String, String),
    /// The names of its columns, and its rows; the first column stands in front of each part of a table that is too wide.
    Table(Vec<String>, Vec<Vec<String>>),
    /// A PNG, its width on the page [px] and its caption.
    Picture(Vec<u8>, usize, String),
    /// The specimen or scene, to be turned.
    View(View),
    /// A case file as given.
    Case(String),
}

/// The page in the making.
pub struct Page {
    title: String,
    /// Names of the runs, and rows of the overview, each led by its name.
    overview: (Vec<String>, Vec<Vec<String>>),
    /// Runs that are not finished, with the reason.
    warnings: Vec<String>,
    pub sections: Vec<Section>,
}

const STYLE: &str = "\
body{font:16px/1.5 'DejaVu Sans',Verdana,Helvetica,Arial,sans-serif;color:#222;background:#fff;max-width:1020px;margin:2em auto;padding:0 1em}
h1,h2,figcaption{overflow-wrap:anywhere}h1{font-size:1.6em;margin-bottom:.2em}h2{font-size:1.25em;margin-top:2.2em;border-bottom:1px solid #ccc;padding-bottom:.2em;break-after:avoid}
figure{margin:1.2em 0;break-inside:avoid}figure svg,figure img{max-width:100%;height:auto;display:block}
figcaption{color:#555;font-size:.85em;margin:.3em 0 0 1em}
table{border-collapse:collapse;font-size:.88em;margin:1em 0;display:block;overflow-x:auto}
th,td{text-align:left;padding:.25em .9em .25em 0;border-bottom:1px solid #e2e2e2;vertical-align:top}
thead th{border-bottom:1.5px solid #555}tbody th{font-weight:normal;color:#555;white-space:nowrap}
.long{overflow-wrap:anywhere;min-width:8em}
.warning{border-left:5px solid #D55E00;background:#fdf1e8;padding:.5em 1em;margin:1em 0}
details{margin:1em 0}summary{cursor:pointer}pre{font-size:.82em;background:#f6f6f6;padding:1em;overflow-x:auto;white-space:pre-wrap}
footer{margin-top:3em;color:#777;font-size:.8em}
figure.viewer canvas{width:100%;height:560px;border:1px solid #e2e2e2;cursor:grab;touch-action:pan-y}
figure.viewer .controls{display:flex;flex-wrap:wrap;gap:.4em 1.2em;align-items:center;font-size:.88em;margin-bottom:.4em}
figure.viewer input[type=range]{width:16em}
@media print{figure.viewer{display:none}body{max-width:none;margin:0}details{display:none}
table{display:table;font-size:.7em}tr{break-inside:avoid}}";

/// Letters beside the first column that fit across a page on paper, and what is between two columns.
const ACROSS: usize = 84;
const BETWEEN: usize = 2;
/// Letters of a word that is kept whole.
const WHOLE: usize = 14;

impl Page {
    pub fn new(runs: &[Run]) -> Result<Page> {
        let title = match runs {
            [run] if !run.summary.title.is_empty() => run.summary.title.clone(),
            [run] => run.label.clone(),
            runs => format!("{} runs", runs.len()),
        };
        let (mut warnings, mut told) = (Vec::new(), Vec::new());
        for run in runs {
            let summary = &run.summary;
            if summary.status != "finished" {
                let reason = if summary.reason.is_empty() { "no reason is given" } else { &summary.reason };
                warnings.push(format!(
                    "{}: {} after increment {} ({reason}). What is shown ends there.",
                    run.label, summary.status, summary.last_good_increment
                ));
            }
            told.push(overview(run)?);
        }
        let labels = runs.iter().map(|run| run.label.clone()).collect();
        Ok(Page { title, overview: (labels, merged(&told)), warnings, sections: Vec::new() })
    }

    /// A page of tables and charts without runs of its own.
    pub fn of(title: String, sections: Vec<Section>) -> Page {
        Page { title, overview: (Vec::new(), Vec::new()), warnings: Vec::new(), sections }
    }

    pub fn to_html(&self) -> String {
        let mut html = String::new();
        // Writing into a text does not fail.
        let _ = write!(
            html,
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
             content=\"width=device-width,initial-scale=1\">\n<title>{}</title>\n<style>\n{STYLE}\n</style>\n</head>\n<body>\n\
             <h1>{}</h1>\n",
            escaped(&self.title),
            escaped(&self.title)
        );
        for warning in &self.warnings {
            let _ = writeln!(html, "<p class=\"warning\">{}</p>", escaped(warning));
        }
        let (labels, rows) = &self.overview;
        let head = if labels.len() > 1 { [vec![String::new()], labels.clone()].concat() } else { Vec::new() };
        html += &table(&head, rows, "th");
        for section in &self.sections {
            section.write(&mut html);
        }
        if self.sections.iter().any(|section| matches!(section, Section::View(_))) {
            let _ = writeln!(html, "<script>\n{SCRIPT}</script>");
        }
        let version = env!("CARGO_PKG_VERSION");
        let _ = write!(html, "<footer>Written by riprap {version}.</footer>\n</body>\n</html>\n");
        html
    }
}

impl Section {
    fn write(&self, html: &mut String) {
        let _ = match self {
            Section::Heading(text) => writeln!(html, "<h2>{}</h2>", escaped(text)),
            Section::Chart(svg, caption) => {
                writeln!(html, "<figure>\n{}{}</figure>", svg.trim_start(), figcaption(caption))
            }
            Section::Table(header, rows) => write!(html, "{}", table(header, rows, "td")),
            Section::Picture(png, width, caption) => writeln!(
                html,
                "<figure><img width=\"{width}\" alt=\"{}\" src=\"data:image/png;base64,{}\">{}</figure>",
                escaped(caption),
                STANDARD.encode(png),
                figcaption(caption)
            ),
            Section::View(view) => writeln!(html, "{}", viewer(view)),
            Section::Case(text) => writeln!(
                html,
                "<details><summary>The case file as given</summary><pre>{}</pre></details>",
                escaped(text)
            ),
        };
    }
}

/// The lines of several runs as rows of a table, each led by its name: one that only later runs have stands where they have it, one that none fills is
/// left out.
fn merged(told: &[Vec<(String, String)>]) -> Vec<Vec<String>> {
    let mut rows: Vec<Vec<String>> = Vec::new();
    for (at, lines) in told.iter().enumerate() {
        let mut next = 0;
        for (name, value) in lines {
            let row = rows.iter().position(|row| row[0] == *name).unwrap_or_else(|| {
                rows.insert(next, [vec![name.clone()], vec![String::new(); told.len()]].concat());
                next
            });
            rows[row][1 + at].clone_from(value);
            next = row + 1;
        }
    }
    rows.retain(|row| row[1..].iter().any(|value| !value.is_empty()));
    for value in rows.iter_mut().flat_map(|row| row.iter_mut().skip(1)).filter(|value| value.is_empty()) {
        value.push('–');
    }
    rows
}

/// A table of a header, if it has one, and of rows whose first cells are in `lead`; what is too wide for a page goes on below.
fn table(header: &[String], rows: &[Vec<String>], lead: &str) -> String {
    let all = || rows.iter().map(Vec::as_slice).chain([header]);
    let columns = all().map(<[String]>::len).max().unwrap_or(0);
    let widest = |at: usize| all().filter_map(|row| Some(longest_word(row.get(at)?))).max().unwrap_or(0);
    let widths: Vec<usize> = (1..columns).map(|at| widest(at).min(WHOLE) + BETWEEN).collect();
    parts(&widths).into_iter().map(|part| part_of_table(header, rows, lead, &part)).collect()
}

/// The columns behind the first, which are so wide in letters, in parts that fit across a page.
fn parts(widths: &[usize]) -> Vec<Range<usize>> {
    let (mut parts, mut part, mut used) = (Vec::new(), 1..1, 0);
    for (at, &width) in widths.iter().enumerate() {
        if used + width > ACROSS && !part.is_empty() {
            parts.push(std::mem::replace(&mut part, at + 1..at + 1));
            used = 0;
        }
        part.end = at + 2;
        used += width;
    }
    parts.push(part);
    parts
}

/// The first column and some of the others.
fn part_of_table(header: &[String], rows: &[Vec<String>], lead: &str, part: &Range<usize>) -> String {
    let cells = |texts: &[String], lead: &str, tag: &str| -> String {
        let inside = texts.iter().enumerate().filter(|(at, _)| *at == 0 || part.contains(at));
        inside.map(|(at, text)| cell(text, if at == 0 { lead } else { tag })).collect()
    };
    let head = match header {
        [] => String::new(),
        header => format!("<thead><tr>{}</tr></thead>\n", cells(header, "th", "th")),
    };
    let body: String = rows.iter().map(|row| format!("<tr>{}</tr>\n", cells(row, lead, "td"))).collect();
    format!("<table>\n{head}<tbody>\n{body}</tbody>\n</table>\n")
}

/// A cell; words that would widen its column, as those of a path, may be broken.
fn cell(text: &str, tag: &str) -> String {
    let class = if longest_word(text) > WHOLE { " class=\"long\"" } else { "" };
    format!("<{tag}{class}>{}</{tag}>", escaped(text))
}

/// Letters of the longest word of a text.
fn longest_word(text: &str) -> usize {
    text.split_whitespace().map(|word| word.chars().count()).max().unwrap_or(0)
}

/// The controls, the canvas and the data of a view; without scripts its caption alone.
fn viewer(view: &View) -> String {
    let choice = |name: &str| format!("<option value=\"{name}\">{name}</option>");
    let damage = if view.has_damage { choice("damage") } else { String::new() };
    let forces = match view.has_forces {
        true => "<label><input type=\"checkbox\" name=\"forces\"> forces</label>",
        false => "",
    };
    // Nothing in the data may end the script that holds it.
    let data = view.data.to_string().replace('<', "\\u003c");
    format!(
        "<figure class=\"viewer\"><div class=\"controls\"><label>state <input type=\"range\" name=\"state\" min=\"0\" value=\"0\" \
         aria-label=\"saved state\"></label><label>colour <select name=\"paint\">{}{}{damage}</select></label>{forces}<span class=\"label\" \
         aria-live=\"polite\"></span></div><canvas role=\"img\" aria-label=\"the specimen in three dimensions\"></canvas>\
         <script type=\"application/json\">{data}</script>{}</figure>",
        choice("rock"),
        choice("displacement"),
        figcaption(&view.caption)
    )
}

fn figcaption(caption: &str) -> String {
    match caption {
        "" => String::new(),
        caption => format!("<figcaption>{}</figcaption>", escaped(caption)),
    }
}

/// The largest deviatoric stress in words.
fn largest_stress(curve: &Curve, at: usize, largest: Largest) -> String {
    let [q, strain] = [1e-6 * curve.deviatoric_stress[at], 100.0 * curve.axial_strain[at]];
    format!("{} MPa at {} % axial strain{}", short(q), short(strain), largest.remark())
}

/// The overview's lines on a run: name and value. Of names that one run has and another lacks, all that may be in a row are told, empty where there is
/// no value: so all runs have them in one order.
fn overview(run: &Run) -> Result<Vec<(String, String)>> {
    let s = &run.summary;
    let cost = Cost::of(run)?;
    let mut lines: Vec<(String, String)> = Vec::new();
    let mut line = |name: &str, value: String| lines.push((name.into(), value));
    let reason = if s.reason.is_empty() { String::new() } else { format!(": {}", s.reason) };
    line("file", s.file.display().to_string());
    line("status", format!("{}{reason}", s.status));
    line("stages", s.stages.join(", "));
    if s.grains > 0 {
        line("grains, their cells", format!("{}, {}", s.grains, s.grain_cells));
    }
    if run.is_scene() {
        line("bodies", s.bodies.join(", "));
    } else {
        let curve = run.shearing()?.curve;
        for (name, is_peak) in [("peak of q", true), ("largest q", false)] {
            let found = curve.largest().filter(|(_, largest)| (*largest == Largest::Peak) == is_peak);
            line(name, found.map_or(String::new(), |(at, largest)| largest_stress(&curve, at, largest)));
        }
        if let Some(last) = curve.axial_strain.len().checked_sub(1) {
            let of = |values: &[f64], factor: f64| short(factor * values[last]);
            line("axial strain at the end", format!("{} %", of(&curve.axial_strain, 100.0)));
            line("volume strain there", format!("{} %", of(&curve.volumetric_strain, 100.0)));
            line("q there", format!("{} MPa", of(&curve.deviatoric_stress, 1e-6)));
        }
        lines.extend(strength::overview(run)?);
    }
    let mut line = |name: &str, value: String| lines.push((name.into(), value));
    for (name, value) in grading::indices(run)? {
        line(name, short(value));
    }
    line("increments", cost.increments.to_string());
    // A specimen alone has none.
    if cost.increments > 0 {
        for (name, sum) in [("factorisations", cost.factorisations), ("augmentations", cost.augmentations)] {
            let each = short(sum / cost.increments as f64);
            line(name, format!("{}, {each} an increment", fixed(sum, 0)));
        }
        line("cuts", fixed(cost.cuts, 0));
        line("worst out of balance", short(cost.out_of_balance));
    }
    line("wall time", duration(cost.wall_time));
    line("seed", s.seed.to_string());
    line("riprap", format!("{} ({})", s.riprap_version, s.riprap_commit));
    line("host, threads", format!("{}, {}", s.host, s.threads));
    Ok(lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_cannot_leave_their_place() {
        let title = "<script>alert(1)</script>".to_string();
        let page = Page {
            title: title.clone(),
            overview: (vec![title.clone(); 2], vec![vec![title.clone(); 3]]),
            warnings: vec![title.clone()],
            sections: vec![
                Section::Heading(title.clone()),
                Section::Case(title.clone()),
                Section::Table(vec![title.clone()], vec![vec![title.clone()]]),
            ],
        };
        assert!(!page.to_html().contains("<script"));
    }

    #[test]
    fn rows_that_the_first_run_lacks_stand_in_their_places() {
        let lines = |told: &[(&str, &str)]| -> Vec<(String, String)> {
            told.iter().map(|(name, value)| (name.to_string(), value.to_string())).collect()
        };
        let end = ("riprap", "0.2");
        let first = lines(&[("file", "a"), ("peak of q", "3"), ("largest q", ""), ("residual", ""), end]);
        let told = [("file", "b"), ("bodies", "x"), ("peak of q", ""), ("largest q", "2"), ("E50", "5"), end];
        let rows = merged(&[first, lines(&told)]);
        let names: Vec<&str> = rows.iter().map(|row| row[0].as_str()).collect();
        assert_eq!(names, ["file", "bodies", "peak of q", "largest q", "E50", "riprap"]);
        assert_eq!(rows[3], ["largest q", "–", "2"]);
    }

    #[test]
    fn wide_tables_go_on_below_and_long_words_may_be_broken() {
        let path = |run: usize| format!("{run}/{}", "x".repeat(40));
        let row = [vec!["file".to_string()], (0..12).map(path).collect()].concat();
        let html = table(&[], &[row], "th");
        // Five words of 14 letters each with a gap of two in 84.
        assert_eq!((html.matches("<table>").count(), html.matches("<th>file</th>").count()), (3, 3));
        assert_eq!(html.matches("<td class=\"long\">").count(), 12);
        // Numbers are never broken.
        assert!(!table(&[], &[vec!["1.23456·10⁻¹²".into(); 9]], "td").contains("long"));
        assert_eq!((parts(&[8; 9]).len(), parts(&[9; 12]).len()), (1, 2));
    }
}
