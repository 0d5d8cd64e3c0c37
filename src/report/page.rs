//! Report on runs as one self-contained HTML file, which fetches nothing.

use std::path::Path;

use maud::{Markup, html};

use super::figures::{Figure, MAIN, ReportedRuns, figures};
use super::headline::{ERROR_BAR_NOTE, headlines};
use super::output::{self, replace};
use super::plot::standalone;
use super::quantity::{CYCLES, with_best_unit};
use super::template::{Page, Part, Section, Warning, drawings};
use super::warnings::warnings;
use super::{ReportError, RunTables};
use super::{differences, results, sections};

/// Report on one or several runs.
pub struct Report {
    title: String,
    /// Headlines of the runs, each with the label of its run if there are several.
    headlines: Vec<(Option<String>, String)>,
    lead: Vec<String>,
    warnings: Vec<Warning>,
    /// Section that precedes all others.
    first: Option<Section>,
    differences: Option<Section>,
    results: Section,
    figures: Vec<Figure>,
    sections: Vec<Section>,
}

impl Report {
    /// Reads the tables of the runs and draws the figures of the report.
    ///
    /// # Errors
    /// Returns [`ReportError`] if the program cannot read a table or cannot draw a figure.
    pub fn new(runs: &[RunTables]) -> Result<Report, ReportError> {
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
        let study = ReportedRuns::read(runs)?;
        let lead = study.runs.iter().map(|run| {
            let cycles = run.column("cycles").and_then(|all| all.last().copied());
            let after = cycles.map_or(String::new(), |cycles| {
                format!(" after {}", with_best_unit(cycles, CYCLES))
            });
            let title = match runs {
                [_] => String::new(),
                _ => format!(", {}", title_of(run.tables)),
            };
            let latest = run.tables.latest();
            format!("{}{title}: iteration {latest}{after}", run.folder())
        });
        Ok(Report {
            title,
            headlines: headlines(&study)?,
            lead: lead.collect(),
            warnings: warnings(&study)?,
            first: None,
            differences: differences::section(runs, &study.labels()),
            results: results::results(runs)?,
            figures: figures(&study)?,
            sections: sections::sections(runs)?,
        })
    }

    /// Returns the figures in the order of the page.
    pub fn figures(&self) -> &[Figure] {
        &self.figures
    }

    /// Adds a section after the figures, before the sections on the computation.
    pub fn add_section(&mut self, section: Section) {
        self.sections.insert(0, section);
    }

    /// Sets the title of the page and a first section. The headlines of the runs move into a folded part of that
    /// section.
    pub fn set_title_and_first_section(&mut self, title: &str, mut section: Section) {
        self.title = title.to_owned();
        let headlines = std::mem::take(&mut self.headlines).into_iter();
        let headlines = headlines.map(|(name, text)| match name {
            Some(name) => format!("{name}: {text}"),
            None => text,
        });
        let each = std::mem::take(&mut self.lead).into_iter().chain(headlines);
        section.html = html! {
            (section.html)
            details {
                summary { "The runs" } "\n"
                @for text in each { p.lead { (text) } "\n" }
            } "\n"
        };
        self.first = Some(section);
    }

    /// Prefixes the captions of figures, selected by their ids, with the figure of `source` to compare them with.
    pub fn add_comparisons(&mut self, others: &[(&str, &str)], source: &str) {
        for figure in &mut self.figures {
            if let Some((_, other)) = others.iter().find(|(name, _)| *name == figure.id) {
                figure
                    .caption
                    .insert_str(0, &format!("Compare with {other} of {source}. "));
            }
        }
    }

    /// Returns the page as HTML.
    pub fn html(&self) -> String {
        let (main, more) = self.figures.split_at(self.figures.len().min(MAIN));
        let groups = [
            ("figures", "Main figures", main),
            ("more-figures", "Further figures", more),
        ];
        let figures = groups.into_iter().filter(|(.., own)| !own.is_empty());
        let figures = figures.map(|(id, title, own)| Part::Figures {
            id,
            title,
            figures: own
                .iter()
                .map(|figure| Section {
                    id: figure.id,
                    title: figure.title.clone(),
                    html: content(figure),
                })
                .collect(),
        });
        let before = self.first.iter().chain(&self.differences);
        let after = self.sections.iter().chain([&self.results]);
        let page = Page {
            title: &self.title,
            lead: self.lead(),
            warnings: &self.warnings,
            parts: before
                .map(Part::Section)
                .chain(figures)
                .chain(after.map(Part::Section))
                .collect(),
        };
        page.html()
    }

    /// Returns the headlines and the list of runs.
    fn lead(&self) -> Markup {
        html! {
            @for (name, text) in &self.headlines {
                p.headline { @if let Some(name) = name { strong { (name) } ": " } (text) } "\n"
            }
            @if self.headlines.iter().any(|(_, text)| text.contains('±')) {
                p.note { (ERROR_BAR_NOTE) } "\n"
            }
            @for text in &self.lead { p.lead { (text) } "\n" }
        }
    }

    /// Writes the page to a file that the user names, as [`output::write`] does.
    ///
    /// # Errors
    /// Returns [`ReportError::Io`] if the function cannot write a file.
    pub fn write(&self, path: &Path) -> Result<(), ReportError> {
        let written = output::write(path, self.html().as_bytes());
        written.map(drop).map_err(io_error(path))
    }

    /// Writes the page, and replaces an existing file. A symbolic link is replaced, not followed.
    ///
    /// # Errors
    /// Returns [`ReportError::Io`] if the function cannot write a file.
    pub fn replace(&self, path: &Path) -> Result<(), ReportError> {
        replace(path, self.html().as_bytes()).map_err(io_error(path))
    }

    /// Writes each figure into a separate file `NAME.svg` in `folder`. The function creates the folder and overwrites
    /// existing files.
    ///
    /// # Errors
    /// Returns [`ReportError::Io`] if the function cannot write a file.
    pub fn write_svgs(&self, folder: &Path) -> Result<(), ReportError> {
        std::fs::create_dir_all(folder).map_err(|source| ReportError::Io {
            path: folder.to_owned(),
            source,
        })?;
        for figure in &self.figures {
            let path = folder.join(format!("{}.svg", figure.id));
            let drawing = standalone(&figure.title, &figure.drawings);
            replace(&path, drawing.as_bytes()).map_err(io_error(&path))?;
        }
        Ok(())
    }
}

pub(super) fn io_error(path: &Path) -> impl FnOnce(std::io::Error) -> ReportError {
    let path = path.to_owned();
    move |source| ReportError::Io { path, source }
}

/// Returns the drawings of a figure, its caption and the source of its data.
fn content(figure: &Figure) -> Markup {
    let drawings_by_id = figure.drawings.iter().enumerate();
    let mut drawings_by_id =
        drawings_by_id.map(|(k, drawing)| (format!("t-{}-{k}", figure.id), drawing));
    let each = figure.drawings.len() / figure.states.len().max(1);
    html! {
        @if figure.states.is_empty() {
            (drawings(drawings_by_id))
        } @else {
            details.states {
                summary { "States of wear" }
                @for state in &figure.states {
                    div.state { p { (state) } (drawings(drawings_by_id.by_ref().take(each))) }
                }
            }
        }
        figcaption {
            p { (figure.caption) } "\n"
            p.data {
                "Data: "
                @for (k, (table, columns)) in figure.sources.iter().enumerate() {
                    @if k > 0 { ", " }
                    code { (table) } " (" (columns.join(", ")) ")"
                }
                ". " code { (figure.query) }
            }
        }
    }
}
