//! The report of one or several results files: charts as SVG and PNG, pictures as PNG, and one HTML page that holds all of
//! them and the specimen to be turned, and needs nothing else.
//!
//! [`write_report`] is the whole of it. What is drawn is worked out by one file a subject (`curves`, `strength`, `energy`,
//! `grading`, `fabric`, `cost`, `bodies`, `picture`), laid out by `chart` into a `drawing`, and painted by plotters; pictures are rasterised in
//! `raster`. SI units inside; strains and stresses count compression positive, as in `/history`.

mod axis;
mod bodies;
pub mod chart;
mod columns;
mod cost;
mod curves;
mod decimal;
mod drawing;
mod energy;
mod fabric;
mod grading;
mod heading;
mod hyperbola;
mod image;
mod laboratory;
mod lettering;
mod note;
mod page;
pub mod palette;
mod parting;
mod picture;
mod raster;
mod run;
mod sheet;
mod strength;
mod surface;
mod viewer;

pub use axis::{Axis, duration, short};
pub use energy::SOUND;
pub use heading::heading;
pub use laboratory::read_laboratory;
pub use run::{Run, safe};
pub use sheet::{Row, Sheet};

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

use chart::Chart;
use drawing::{Drawing, PRINT};
use laboratory::read_laboratories;
pub use page::Section;

use page::Page;

/// What a report came to.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    /// The page.
    pub page: PathBuf,
    /// Everything that was written, the page included.
    pub files: Vec<PathBuf>,
    /// What was left out, and why.
    pub remarks: Vec<String>,
}

/// Writes the report of results files into `folder`, which is made if needed. With a `width` [m], charts beside the page are
/// so wide, for the column of a paper, with letters of 9 points.
///
/// # Errors
/// Files that cannot be read or written; a laboratory table at fault.
pub fn write_report(
    files: &[PathBuf],
    laboratory: &[PathBuf],
    folder: &Path,
    width: Option<f64>,
) -> Result<Report> {
    let runs = Run::open_all(files)?;
    let labels: Vec<String> = runs.iter().map(|run| run.label.clone()).collect();
    let (curves, remarks) = read_laboratories(laboratory, &labels)?;
    std::fs::create_dir_all(folder).map_err(|e| Error::io("create", folder, e))?;
    let width = width.map(|width| width * PIXELS_PER_METRE);
    let mut output = Output { folder, width, report: Report { remarks, ..Report::default() } };
    let mut page = Page::new(&runs)?;

    let overlay = curves::chart(&runs, &curves)?;
    if overlay.is_none() && !curves.is_empty() {
        output.report.remarks.push("no run has strains: the laboratory's curves are not shown".into());
    }
    if let Some(chart) = overlay {
        let caption = curves::caption(&runs)?;
        page.sections.push(Section::Chart(output.chart("stress_strain", &chart)?, caption));
    }
    if let Some((chart, caption)) = strength::circles(&runs)? {
        page.sections.push(Section::Chart(output.chart("strength", &chart)?, caption));
    }
    if let Some(chart) = strength::paths(&runs)? {
        let caption = "From the start of the run; void ratio inside the cover.";
        page.sections.push(Section::Chart(output.chart("stress_path", &chart)?, caption.into()));
    }
    page.sections.extend(hyperbola::sections(&runs)?);
    let all: Vec<&Run> = runs.iter().collect();
    if let Some(chart) = energy::chart(&all)? {
        let mut remarks = Vec::new();
        for run in &runs {
            let stack = energy::stack(run)?;
            let name = if runs.len() > 1 { format!("{}: ", run.label) } else { String::new() };
            remarks.push(format!("{name}{}", energy::remark(&stack)));
        }
        page.sections.push(Section::Chart(output.chart("energy", &chart)?, remarks.join(" ")));
    }
    for run in &runs {
        output.one_run(run, &mut page)?;
    }
    let target = folder.join("report.html");
    output.write(&target, page.to_html().as_bytes())?;
    output.report.page = target;
    Ok(output.report)
}

/// Writes a chart as `<stem>.svg` and `<stem>.png` into `folder`, and returns the SVG.
pub fn write_chart(folder: &Path, stem: &str, chart: &Chart) -> Result<String> {
    Output { folder, width: None, report: Report::default() }.chart(stem, chart)
}

/// Writes a page of tables and charts.
///
/// # Errors
/// A file that cannot be written.
pub fn write_page(path: &Path, title: &str, sections: Vec<Section>) -> Result<()> {
    let page = Page::of(title.to_string(), sections).to_html();
    std::fs::write(path, page).map_err(|e| Error::io("write", path, e))
}

/// A pixel of charts and pages is 1/96 of an inch.
const PIXELS_PER_METRE: f64 = 96.0 / 0.0254;

/// Where things go.
struct Output<'a> {
    folder: &'a Path,
    /// Of charts in files of their own [px].
    width: Option<f64>,
    report: Report,
}

impl Output<'_> {
    fn write(&mut self, path: &Path, bytes: &[u8]) -> Result<()> {
        std::fs::write(path, bytes).map_err(|e| Error::io("write", path, e))?;
        self.report.files.push(path.to_path_buf());
        Ok(())
    }

    fn chart(&mut self, stem: &str, chart: &Chart) -> Result<String> {
        let drawing = chart.draw();
        let Some(width) = self.width else { return self.drawing(stem, &drawing) };
        self.drawing(stem, &chart.of_width(width).draw())?;
        drawing.to_svg()
    }

    fn drawing(&mut self, stem: &str, drawing: &Drawing) -> Result<String> {
        let svg = drawing.to_svg()?;
        self.write(&self.folder.join(format!("{stem}.svg")), svg.as_bytes())?;
        let png = drawing.to_print()?.to_png_of(PRINT)?;
        self.write(&self.folder.join(format!("{stem}.png")), &png)?;
        Ok(svg)
    }

    /// What is shown of each run by itself.
    fn one_run(&mut self, run: &Run, page: &mut Page) -> Result<()> {
        page.sections.push(Section::Heading(run.label.clone()));
        for picture in picture::pictures(run)? {
            let png = picture.image.to_png()?;
            self.write(&self.folder.join(format!("{}.png", picture.stem)), &png)?;
            page.sections.push(Section::Picture(png, picture.image.width / 2, picture.caption));
        }
        if let Some(view) = viewer::view(run)? {
            page.sections.push(Section::View(view));
        }
        if run.is_scene() {
            for (stem, chart, left_out) in bodies::charts(run)? {
                let caption = match left_out {
                    0 => String::new(),
                    n => format!("The {n} bodies with the smallest values are left out."),
                };
                let svg = self.chart(&format!("{stem}_{}", run.stem), &chart)?;
                page.sections.push(Section::Chart(svg, caption));
            }
        } else {
            if let Some(chart) = grading::chart(run)? {
                let svg = self.chart(&format!("grading_{}", run.stem), &chart)?;
                let caption = "Sieve size: the intermediate diameter of the ellipsoid that a grain is drawn on; where grains broke, \
                     the square opening that a grain or a part of one goes through.";
                page.sections.push(Section::Chart(svg, caption.into()));
            }
            let fabrics = fabric::fabrics(run)?;
            if let Some(chart) = fabric::chart(run, &fabrics) {
                let svg = self.chart(&format!("forces_{}", run.stem), &chart)?;
                let caption = "Contacts between grains, each pair once, by the sum of its normal forces; those with the plates \
                     are left out.";
                page.sections.push(Section::Chart(svg, caption.into()));
            }
            if let Some(rose) = fabric::roses(run, &fabrics) {
                let svg = self.drawing(&format!("fabric_{}", run.stem), &rose)?;
                let caption = "Per solid angle, over an isotropic fabric (the dashed circle). Anisotropy: vertical minus \
                     horizontal principal value of the mean of n ⊗ n.";
                page.sections.push(Section::Chart(svg, caption.into()));
            }
        }
        if let Some(chart) = cost::chart(run)? {
            let svg = self.chart(&format!("convergence_{}", run.stem), &chart)?;
            page.sections.push(Section::Chart(svg, String::new()));
        }
        page.sections.push(Section::Case(run.given.clone()));
        Ok(())
    }
}
