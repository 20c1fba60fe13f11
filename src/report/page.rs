//! The HTML page: one file that needs no other, readable in any browser, on paper and without colours.

use std::fmt::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use crate::error::Result;
use crate::results::{escaped, fixed};

use super::axis::{duration, short};
use super::cost::Cost;
use super::grading;
use super::run::{Largest, Run};
use super::strength;
use super::viewer::{SCRIPT, View};

/// A part of the page.
pub enum Section {
    Heading(String),
    /// An SVG and its caption.
    Chart(String, String),
    /// The names of its columns, and its rows.
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
    /// Names of the columns and rows of the overview.
    overview: (Vec<String>, Vec<(String, Vec<String>)>),
    /// Runs that are not finished, with the reason.
    warnings: Vec<String>,
    pub sections: Vec<Section>,
}

const STYLE: &str = "\
body{font:16px/1.5 'DejaVu Sans',Verdana,Helvetica,Arial,sans-serif;color:#222;background:#fff;max-width:1020px;margin:2em auto;padding:0 1em}
h1{font-size:1.6em;margin-bottom:.2em}h2{font-size:1.25em;margin-top:2.2em;border-bottom:1px solid #ccc;padding-bottom:.2em;break-after:avoid}
figure{margin:1.2em 0;break-inside:avoid}figure svg,figure img{max-width:100%;height:auto;display:block}
figcaption{color:#555;font-size:.85em;margin:.3em 0 0 1em}
table{border-collapse:collapse;font-size:.88em;margin:1em 0;display:block;overflow-x:auto}
th,td{text-align:left;padding:.25em .9em .25em 0;border-bottom:1px solid #e2e2e2;vertical-align:top}
thead th{border-bottom:1.5px solid #555}tbody th{font-weight:normal;color:#555;white-space:nowrap}
.warning{border-left:5px solid #D55E00;background:#fdf1e8;padding:.5em 1em;margin:1em 0}
details{margin:1em 0}summary{cursor:pointer}pre{font-size:.82em;background:#f6f6f6;padding:1em;overflow-x:auto;white-space:pre-wrap}
footer{margin-top:3em;color:#777;font-size:.8em}
figure.viewer canvas{width:100%;height:560px;border:1px solid #e2e2e2;cursor:grab;touch-action:none}
figure.viewer .controls{display:flex;flex-wrap:wrap;gap:.4em 1.2em;align-items:center;font-size:.88em;margin-bottom:.4em}
figure.viewer input[type=range]{width:16em}
@media print{figure.viewer{display:none}body{max-width:none;margin:0}details{display:none}}";

impl Page {
    pub fn new(runs: &[Run]) -> Result<Page> {
        let title = match runs {
            [run] if !run.summary.title.is_empty() => run.summary.title.clone(),
            [run] => run.label.clone(),
            runs => format!("{} runs", runs.len()),
        };
        let mut warnings = Vec::new();
        let mut lines = Vec::new();
        for (at, run) in runs.iter().enumerate() {
            let summary = &run.summary;
            if summary.status != "finished" {
                let reason = if summary.reason.is_empty() { "no reason is given" } else { &summary.reason };
                warnings.push(format!(
                    "{}: {} after increment {} ({reason}). What is shown ends there.",
                    run.label, summary.status, summary.last_good_increment
                ));
            }
            lines.extend(overview(run)?.into_iter().map(|line| (at, line)));
        }
        let mut rows: Vec<(String, Vec<String>)> = Vec::new();
        for (at, (name, value)) in lines {
            let known = rows.iter().position(|(known, _)| *known == name);
            let row = known.unwrap_or_else(|| {
                rows.push((name, vec!["–".to_string(); runs.len()]));
                rows.len() - 1
            });
            rows[row].1[at] = value;
        }
        let labels = runs.iter().map(|run| run.label.clone()).collect();
        Ok(Page { title, overview: (labels, rows), warnings, sections: Vec::new() })
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
        let head =
            if labels.len() > 1 { "<th></th>".to_string() + &cells(labels, "th") } else { String::new() };
        let row = |(name, values): &(String, Vec<String>)| {
            format!("<th>{}</th>{}", escaped(name), cells(values, "td"))
        };
        html += &table(&head, rows.iter().map(row));
        html.push('\n');
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
            Section::Table(header, rows) => {
                let rows = rows.iter().map(|row| cells(row, "td"));
                writeln!(html, "{}", table(&cells(header, "th"), rows))
            }
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

fn cells(texts: &[String], tag: &str) -> String {
    texts.iter().map(|text| format!("<{tag}>{}</{tag}>", escaped(text))).collect()
}

/// A table of the cells of its header, if it has one, and of its rows.
fn table(head: &str, rows: impl Iterator<Item = String>) -> String {
    let head = if head.is_empty() { String::new() } else { format!("<thead><tr>{head}</tr></thead>\n") };
    let body: String = rows.map(|row| format!("<tr>{row}</tr>\n")).collect();
    format!("<table>\n{head}<tbody>\n{body}</tbody>\n</table>")
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

/// The overview's lines on a run: name and value.
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
        line("grains, cells", format!("{}, {}", s.grains, s.cells));
    }
    if run.is_scene() {
        line("bodies", s.bodies.join(", "));
    } else {
        let curve = run.shearing()?.curve;
        if let Some((at, largest)) = curve.largest() {
            let [q, strain] = [1e-6 * curve.deviatoric_stress[at], 100.0 * curve.axial_strain[at]];
            let name = if largest == Largest::Peak { "peak of q" } else { "largest q" };
            let text = format!("{} MPa at {} % axial strain{}", short(q), short(strain), largest.remark());
            line(name, text);
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
            overview: (vec![title.clone(); 2], vec![(title.clone(), vec![title.clone(); 2])]),
            warnings: vec![title.clone()],
            sections: vec![
                Section::Heading(title.clone()),
                Section::Case(title.clone()),
                Section::Table(vec![title.clone()], vec![vec![title.clone()]]),
            ],
        };
        assert!(!page.to_html().contains("<script"));
    }
}
