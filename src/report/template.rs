//! The template of all pages.
//!
//! Templates escape all text. [`Page::html`] also makes control characters visible, in the whole page at once.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::Drawing;
use super::plot::style_sheet;
use super::script::{SCRIPT, policy};
use super::text::visible;

/// A section of a page.
#[derive(Debug, Clone)]
pub struct Section {
    /// Anchor.
    pub id: &'static str,
    /// Heading.
    pub title: String,
    /// Content below the heading.
    pub html: Markup,
}

/// A warning on a page.
#[derive(Debug, Clone, PartialEq)]
pub struct Warning {
    /// Its sentence.
    pub text: String,
    /// Anchors of the figures and sections that it concerns. The page shows it in the first of these that it has, and on top without any.
    pub places: &'static [&'static str],
}

/// A part of a page, in the order of the page.
pub enum Part<'a> {
    /// A section.
    Section(&'a Section),
    /// Figures under one heading. Their anchors have `fig-` in front; they are numbered through the page.
    Figures {
        /// Anchor of all.
        id: &'static str,
        /// Heading of all.
        title: &'static str,
        /// At least one.
        figures: Vec<Section>,
    },
}

/// A page that needs no other file and fetches nothing.
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
    /// The page as one HTML file.
    pub fn html(&self) -> String {
        let contents = self.contents();
        let place = |warning: &Warning| {
            let mut places = warning.places.iter();
            places.find(|place| contents.iter().any(|(anchor, _)| anchor == *place))
        };
        // Those of a place, or on top.
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
                                    @for one in figures { (figure(one)) }
                                },
                            } "\n"
                        }
                    } "\n"
                    footer { "fretwear " (version) } "\n"
                    script { (PreEscaped(SCRIPT)) } "\n"
                }
            } "\n"
        };
        visible(&page.into_string())
    }

    /// Anchors and titles of all sections and figures.
    fn contents(&self) -> Vec<(String, &str)> {
        let each = self.parts.iter().flat_map(|part| match part {
            Part::Section(section) => vec![(section.id.to_owned(), section.title.as_str())],
            Part::Figures { figures, .. } => {
                let figures = figures.iter();
                figures
                    .map(|one| (format!("fig-{}", one.id), one.title.as_str()))
                    .collect()
            }
        });
        each.collect()
    }
}

/// Drawings beside and below each other. `id` begins their anchors.
pub fn drawings<'a>(drawings: impl Iterator<Item = (String, &'a Drawing)>) -> Markup {
    html! {
        div.drawings { "\n" @for (id, drawing) in drawings { (drawing.inline(&id)) "\n" } } "\n"
    }
}
