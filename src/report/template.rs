//! Template of all pages.
//!
//! Templates escape all text. [`Page::html`] makes the control characters of the whole page visible.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::Drawing;
use super::plot::style_sheet;
use super::script::{SCRIPT, policy};
use super::text::escape_controls;

/// Section of a page.
#[derive(Debug, Clone)]
pub struct Section {
    /// Anchor.
    pub id: &'static str,
    /// Heading.
    pub title: String,
    /// Content below the heading.
    pub html: Markup,
}

/// Warning on a page.
#[derive(Debug, Clone, PartialEq)]
pub struct Warning {
    /// Text of the warning.
    pub text: String,
    /// Anchors of the figures and sections that the warning concerns. The page shows the warning at the first anchor in
    /// `places` that the page has. A page without the anchors shows the warning on top.
    pub places: &'static [&'static str],
}

/// Part of a page, in the order of the page.
pub enum Part<'a> {
    /// A section.
    Section(&'a Section),
    /// Figures under one heading. The anchors of figures have the prefix `fig-`. The figures of a page are numbered
    /// consecutively.
    Figures {
        /// Anchor of the group.
        id: &'static str,
        /// Heading of the group.
        title: &'static str,
        /// Figures of the group, at least one.
        figures: Vec<Section>,
    },
}

/// Self-contained page, which fetches nothing.
pub struct Page<'a> {
    /// Title of the window and first heading.
    pub title: &'a str,
    /// Content below the title.
    pub lead: Markup,
    /// All warnings.
    pub warnings: &'a [Warning],
    /// The content.
    pub parts: Vec<Part<'a>>,
}

impl Page<'_> {
    /// Returns the page as one HTML file.
    pub fn html(&self) -> String {
        let contents = self.contents();
        let place = |warning: &Warning| {
            let mut places = warning.places.iter();
            places.find(|place| contents.iter().any(|(anchor, _)| anchor == *place))
        };
        // Warnings at an anchor, or on top.
        let warnings = |anchor: Option<&str>| -> Vec<&Warning> {
            let all = self.warnings.iter();
            all.filter(|warning| place(warning).copied() == anchor)
                .collect()
        };
        let banners = |anchor: Option<&str>| {
            html! { @for warning in warnings(anchor) { p.banner { (warning.text) } "\n" } }
        };
        let mut numbers = 1..;
        let mut figure = |figure: &Section| {
            let anchor = format!("fig-{}", figure.id);
            html! {
                figure id=(anchor) {
                    h3 { (numbers.next().unwrap_or(0)) ". " (figure.title) } "\n"
                    (banners(Some(&anchor))) (figure.html)
                } "\n"
            }
        };
        let version = env!("CARGO_PKG_VERSION");
        let page = html! {
            (DOCTYPE) "\n"
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width,initial-scale=1";
                    meta name="generator" content={ "fretwear " (version) };
                    meta http-equiv="Content-Security-Policy" content=(policy());
                    title { (self.title) }
                    link rel="icon" href="data:,";
                    style { "\n" (PreEscaped(style_sheet())) (PreEscaped(include_str!("page.css"))) } "\n"
                }
                body { "\n"
                    header { h1 { (self.title) } "\n" (self.lead) (banners(None)) } "\n"
                    nav aria-label="Contents" {
                        ol {
                            @for (anchor, title) in &contents {
                                li {
                                    a href={ "#" (anchor) } { (title) }
                                    @if !warnings(Some(anchor)).is_empty() { " " small.warned { "warning" } }
                                } "\n"
                            }
                        }
                    } "\n"
                    main {
                        @for part in &self.parts {
                            @match part {
                                Part::Section(section) => section id=(section.id) {
                                    h2 { (section.title) } "\n"
                                    (banners(Some(section.id))) (section.html)
                                },
                                Part::Figures { id, title, figures } => section id=(id) {
                                    h2 { (title) } "\n"
                                    @for section in figures { (figure(section)) }
                                },
                            } "\n"
                        }
                    } "\n"
                    footer { "fretwear " (version) } "\n"
                    script { (PreEscaped(SCRIPT)) } "\n"
                }
            } "\n"
        };
        escape_controls(&page.into_string())
    }

    /// Returns the anchors and titles of all sections and figures.
    fn contents(&self) -> Vec<(String, &str)> {
        let each = self.parts.iter().flat_map(|part| match part {
            Part::Section(section) => vec![(section.id.to_owned(), section.title.as_str())],
            Part::Figures { figures, .. } => {
                let figures = figures.iter();
                figures
                    .map(|figure| (format!("fig-{}", figure.id), figure.title.as_str()))
                    .collect()
            }
        });
        each.collect()
    }
}

/// Returns a block of drawings, each with its anchor.
pub fn drawings<'a>(drawings: impl Iterator<Item = (String, &'a Drawing)>) -> Markup {
    html! {
        div.drawings { "\n" @for (id, drawing) in drawings { (drawing.inline(&id)) "\n" } } "\n"
    }
}
