//! The report of runs as one HTML file that needs no other and fetches nothing.

use std::path::Path;

use super::figures::{Figure, MAIN, Study, figures};
use super::headline::{OF_BARS, headlines};
use super::html::{Section, escaped};
use super::output::{self, replace};
use super::plot::{standalone, style_sheet};
use super::quantity::{self, CYCLES, shown};
use super::script::{SCRIPT, policy};
use super::text::continuation;
use super::{ReportError, RunTables, numbers};
use super::{differences, results, sections};
use crate::tables::TableName;

const STYLE: &str = include_str!("page.css");

/// What there is to say of some runs.
pub struct Report {
    title: String,
    /// Sentences on the runs, each with its name where there are several.
    headlines: Vec<(Option<String>, String)>,
    lead: Vec<String>,
    banners: Vec<String>,
    /// What stands before everything else.
    first: Option<Section>,
    differences: Option<Section>,
    results: Section,
    figures: Vec<Figure>,
    sections: Vec<Section>,
}

impl Report {
    /// Reads the runs and draws their figures.
    ///
    /// # Errors
    /// [`ReportError`] for a table that cannot be read and for a figure that cannot be drawn.
    pub fn of(runs: &[RunTables]) -> Result<Report, ReportError> {
        let title_of = |run: &RunTables| match &run.recipe().title {
            Some(title) => title.clone(),
            None => run.name().to_owned(),
        };
        let title = match runs {
            [run] => title_of(run),
            runs => {
                let names: Vec<&str> = runs.iter().map(RunTables::name).collect();
                format!("Comparison of {} runs: {}", runs.len(), names.join(", "))
            }
        };
        let (mut lead, mut banners) = (Vec::new(), Vec::new());
        for run in runs {
            let summary = run.series(TableName::Summary)?.unwrap_or_default();
            let cycles = numbers(&summary, "cycles").and_then(|cycles| cycles.last().copied());
            let volume = numbers(&summary, "wear_volume").and_then(|volume| volume.last().copied());
            let after = cycles.map_or(String::new(), |cycles| {
                format!(" after {}", shown(cycles, CYCLES))
            });
            let title = match runs {
                [_] => String::new(),
                _ => format!(", {}", title_of(run)),
            };
            lead.push(format!(
                "{}{title}: iteration {}{after}",
                run.root().display(),
                run.latest()
            ));
            banners.extend(progress(run, cycles, volume)?);
            let name = match runs {
                [_] => String::new(),
                _ => format!("{}: ", run.name()),
            };
            banners.extend(run.warnings().map(|warning| format!("{name}{warning}")));
            banners.extend(run.damage().iter().map(|damage| {
                format!("Damaged: {damage}; the iterations from there on are left out.")
            }));
        }
        let study = Study::of(runs)?;
        Ok(Report {
            title,
            headlines: headlines(&study)?,
            lead,
            banners,
            first: None,
            differences: differences::section(runs, &study.labels()),
            results: results::results(runs)?,
            figures: figures(&study)?,
            sections: sections::sections(runs)?,
        })
    }

    /// The figures, in their order.
    pub fn figures(&self) -> &[Figure] {
        &self.figures
    }

    /// Adds a part after the figures, before what tells of the computation.
    pub fn add(&mut self, section: Section) {
        self.sections.insert(0, section);
    }

    /// Gives the page another title, and a part that comes first. What is said of each run stands folded below that part.
    pub fn begin(&mut self, title: &str, mut section: Section) {
        self.title = title.to_owned();
        let said = std::mem::take(&mut self.headlines).into_iter();
        let said = said.map(|(name, text)| match name {
            Some(name) => format!("{name}: {text}"),
            None => text,
        });
        let each = std::mem::take(&mut self.lead).into_iter().chain(said);
        let each: String = each
            .map(|text| format!("<p class=\"lead\">{}</p>\n", escaped(&text)))
            .collect();
        section.html += &format!("<details>\n<summary>The runs</summary>\n{each}</details>\n");
        self.first = Some(section);
    }

    /// Says before the captions of figures, by their names, what they may be laid beside.
    pub fn lay_beside(&mut self, others: &[(&str, &str)], source: &str) {
        for figure in &mut self.figures {
            if let Some((_, other)) = others.iter().find(|(name, _)| *name == figure.id) {
                figure
                    .caption
                    .insert_str(0, &format!("Beside {other} of {source}. "));
            }
        }
    }

    /// The page.
    pub fn html(&self) -> String {
        let title = escaped(&self.title);
        let paragraphs = |class: &str, texts: &[String]| -> String {
            let each = texts.iter();
            each.map(|text| format!("<p class=\"{class}\">{}</p>\n", escaped(text)))
                .collect()
        };
        let (main, more) = self.figures.split_at(self.figures.len().min(MAIN));
        let mut contents: Vec<(String, String)> = Vec::new();
        let of_differences = self.first.iter().chain(&self.differences);
        contents.extend(of_differences.map(|s| (s.id.to_owned(), s.title.clone())));
        let of_figures = self.figures.iter();
        contents.extend(of_figures.map(|f| (format!("fig-{}", f.id), f.title.clone())));
        let of_sections = self.sections.iter().chain([&self.results]);
        contents.extend(of_sections.map(|s| (s.id.to_owned(), s.title.clone())));
        let contents: String = contents
            .iter()
            .map(|(id, title)| format!("<li><a href=\"#{id}\">{}</a></li>\n", escaped(title)))
            .collect();
        let drawn = |id: &str, title: &str, begin: usize, figures: &[Figure]| -> String {
            if figures.is_empty() {
                return String::new();
            }
            let each = figures.iter().enumerate();
            let each: String = each.map(|(k, one)| figure(begin + k, one)).collect();
            format!("<section id=\"{id}\">\n<h2>{title}</h2>\n{each}</section>\n")
        };
        let differences = self.first.iter().chain(&self.differences);
        let differences: String = differences.map(section).collect();
        let figures = drawn("figures", "Main figures", 1, main)
            + &drawn("more-figures", "Further figures", 1 + main.len(), more);
        let sections = self.sections.iter().chain([&self.results]);
        let sections: String = sections.map(section).collect();
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n\
             <meta name=\"generator\" content=\"fretwear {version}\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
             <title>{title}</title>\n<link rel=\"icon\" href=\"data:,\">\n<style>\n{}{STYLE}</style>\n</head>\n<body>\n\
             <header>\n<h1>{title}</h1>\n{}{}{}</header>\n\
             <nav aria-label=\"Contents\">\n<ol>\n{contents}</ol>\n</nav>\n<main>\n{differences}{figures}{sections}</main>\n\
             <footer>fretwear {version}</footer>\n<script>{SCRIPT}</script>\n</body>\n</html>\n",
            style_sheet(),
            self.headline(),
            paragraphs("lead", &self.lead),
            paragraphs("banner", &self.banners),
            version = env!("CARGO_PKG_VERSION"),
            policy = policy(),
        )
    }

    /// What became of the joints, on top of the page.
    fn headline(&self) -> String {
        let each = self.headlines.iter().map(|(name, text)| {
            let name = name.as_ref().map_or(String::new(), |name| {
                format!("<strong>{}</strong>: ", escaped(name))
            });
            format!("<p class=\"headline\">{name}{}</p>\n", escaped(text))
        });
        let each: String = each.collect();
        match each.contains('±') {
            true => format!("{each}<p class=\"note\">{OF_BARS}</p>\n"),
            false => each,
        }
    }

    /// Writes the page to a file that its reader names, as [`output::write`] does.
    ///
    /// # Errors
    /// [`ReportError::Io`]
    pub fn write(&self, path: &Path) -> Result<(), ReportError> {
        let written = output::write(path, self.html().as_bytes());
        written.map(drop).map_err(failed(path))
    }

    /// Writes the page in place of a file that is there. A link under its name is replaced, not followed.
    ///
    /// # Errors
    /// [`ReportError::Io`]
    pub fn replace(&self, path: &Path) -> Result<(), ReportError> {
        replace(path, self.html().as_bytes()).map_err(failed(path))
    }

    /// Writes every figure as an SVG of its own, `NAME.svg`, into a folder, which is made. Files that are there are replaced.
    ///
    /// # Errors
    /// [`ReportError::Io`]
    pub fn write_svgs(&self, folder: &Path) -> Result<(), ReportError> {
        std::fs::create_dir_all(folder).map_err(|source| ReportError::Io {
            path: folder.to_owned(),
            source,
        })?;
        for figure in &self.figures {
            let path = folder.join(format!("{}.svg", figure.id));
            let drawing = standalone(&figure.title, &figure.drawings);
            replace(&path, drawing.as_bytes()).map_err(failed(&path))?;
        }
        Ok(())
    }
}

pub(super) fn failed(path: &Path) -> impl FnOnce(std::io::Error) -> ReportError {
    let path = path.to_owned();
    move |source| ReportError::Io { path, source }
}

/// How far a run is that has not come to its end.
fn progress(
    run: &RunTables,
    cycles: Option<f64>,
    volume: Option<f64>,
) -> Result<Option<String>, ReportError> {
    let (Some(wear), Some(cycles), Some(volume)) = (&run.recipe().wear, cycles, volume) else {
        return Ok(None);
    };
    if wear.is_reached(cycles as u64, volume) {
        return Ok(None);
    }
    let holder = run.reader().holder();
    let running = holder.map_err(|source| ReportError::Run {
        run: run.root().to_owned(),
        source,
    })?;
    let state = match running {
        Some(_) => "is running".to_owned(),
        None => format!(
            "stopped before its end (`{}` goes on)",
            continuation(run.root())
        ),
    };
    let part = |done: f64, end: f64| shown(done / end, quantity::SHARE);
    let far = match (wear.cycles, wear.volume) {
        (Some(end), _) => format!(
            "{} of {}, {}",
            shown(cycles, CYCLES),
            shown(end as f64, CYCLES),
            part(cycles, end as f64)
        ),
        (None, Some(end)) => format!(
            "{} of {}, {}",
            shown(volume, quantity::VOLUME),
            shown(end, quantity::VOLUME),
            part(volume, end)
        ),
        (None, None) => shown(cycles, CYCLES),
    };
    Ok(Some(format!(
        "In progress: {} {state}. Iteration {}, {far}.",
        run.name(),
        run.latest()
    )))
}

fn section(section: &Section) -> String {
    format!(
        "<section id=\"{}\">\n<h2>{}</h2>\n{}</section>\n",
        section.id,
        escaped(&section.title),
        section.html
    )
}

fn figure(number: usize, figure: &Figure) -> String {
    let drawings: String = figure
        .drawings
        .iter()
        .enumerate()
        .map(|(k, drawing)| drawing.inline(&format!("t-{}-{k}", figure.id)) + "\n")
        .collect();
    let sources: Vec<String> = figure
        .sources
        .iter()
        .map(|(table, columns)| format!("<code>{table}</code> ({})", columns.join(", ")))
        .collect();
    format!(
        "<figure id=\"fig-{}\">\n<h3>{}. {}</h3>\n<div class=\"drawings\">\n{drawings}</div>\n<figcaption>\n<p>{}</p>\n\
         <p class=\"data\">Data: {}. <code>{}</code></p>\n</figcaption>\n</figure>\n",
        figure.id,
        number,
        escaped(&figure.title),
        escaped(&figure.caption),
        sources.join(", "),
        escaped(&figure.query)
    )
}
