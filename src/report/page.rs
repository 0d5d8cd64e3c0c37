//! The report of runs as one HTML file that needs no other and fetches nothing.

use std::path::Path;

use maud::{Markup, html};

use super::figures::{Figure, MAIN, Study, figures};
use super::headline::{OF_BARS, headlines};
use super::output::{self, replace};
use super::plot::standalone;
use super::quantity::{CYCLES, shown};
use super::template::{Page, Part, Section, Warning, drawings};
use super::warnings::warnings;
use super::{ReportError, RunTables};
use super::{differences, results, sections};

/// What there is to say of some runs.
pub struct Report {
    title: String,
    /// Sentences on the runs, each with its name where there are several.
    headlines: Vec<(Option<String>, String)>,
    lead: Vec<String>,
    warnings: Vec<Warning>,
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
        let study = Study::of(runs)?;
        let lead = study.runs.iter().map(|run| {
            let cycles = run.column("cycles").and_then(|all| all.last().copied());
            let after = cycles.map_or(String::new(), |cycles| {
                format!(" after {}", shown(cycles, CYCLES))
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
        section.html = html! {
            (section.html)
            details {
                summary { "The runs" } "\n"
                @for text in each { p.lead { (text) } "\n" }
            } "\n"
        };
        self.first = Some(section);
    }

    /// Says before the captions of figures, by their names, what they may be laid beside.
    pub fn add_comparisons(&mut self, others: &[(&str, &str)], source: &str) {
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

    /// What became of the joints, and which runs these are.
    fn lead(&self) -> Markup {
        html! {
            @for (name, text) in &self.headlines {
                p.headline { @if let Some(name) = name { strong { (name) } ": " } (text) } "\n"
            }
            @if self.headlines.iter().any(|(_, text)| text.contains('±')) {
                p.note { (OF_BARS) } "\n"
            }
            @for text in &self.lead { p.lead { (text) } "\n" }
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

/// The drawings of a figure, its caption, and where its data are.
fn content(figure: &Figure) -> Markup {
    let named = figure.drawings.iter().enumerate();
    let mut named = named.map(|(k, drawing)| (format!("t-{}-{k}", figure.id), drawing));
    let each = figure.drawings.len() / figure.states.len().max(1);
    html! {
        @if figure.states.is_empty() {
            (drawings(named))
        } @else {
            details.states {
                summary { "States of wear" }
                @for state in &figure.states {
                    div.state { p { (state) } (drawings(named.by_ref().take(each))) }
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
