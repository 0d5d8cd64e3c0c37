//! Report on the runs of a campaign.
//!
//! The report shows the final figures, the bands of the figures over the cycles, and the failed runs. The report in
//! addition shows the sensitivity of each figure to each key.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use maud::html;

use super::ReportError;
use super::output;
use super::page::io_error;
use super::plot::{Axis, Band, Chart, Curve, Drawing, Mark, style_of_run};
use super::quantity::{
    ENERGY, FORCE, FREQUENCY, LENGTH, PRESSURE, SHARE, STIFFNESS, Units, VOLUME, VOLUME_RATE,
    significant_digits, unit_of, with_unit,
};
use super::table::table;
use super::template::{Page, Part, Section, drawings};
use super::text::NONE;
use crate::campaign::statistics::{SampleStatistics, rank_threshold, share_threshold};
use crate::campaign::{
    Campaign, Failure, Figure, Findings, ResolvedValue, Sensitivity, State, StoredCampaign,
};
use crate::tables::{Provenance, TableError, to_parquet};

/// Maximum number of scatter charts (a figure over its most influential key).
const SCATTERS: usize = 6;
/// Maximum number of points of a scatter chart. More points would only slow down the page.
const POINTS: usize = 1500;
/// Smallest Sobol index that makes a key influential, if its rank correlation is not above chance.
const LEAST_SHARE: f64 = 0.05;
/// Maximum number of listed rows per reason of failure.
const NAMED: usize = 20;

/// Columns of the table `summary`, each with the title and the units of the column.
const NAMES: [(&str, &str, Units); 16] = [
    ("wear_volume", "worn volume", VOLUME),
    ("largest_depth", "largest depth", LENGTH),
    ("depth_99", "depth of 1 %", LENGTH),
    ("wear_rate", "wear rate", VOLUME_RATE),
    ("dissipated_energy", "friction of a cycle", ENERGY),
    ("dissipated_energy_total", "friction in all", ENERGY),
    ("loaded_area_fraction", "loaded area", SHARE),
    ("max_pressure", "largest pressure", PRESSURE),
    ("normal_load", "normal load", FORCE),
    ("approach", "approach", LENGTH),
    ("rq", "Rq of the worn face", LENGTH),
    ("kn", "normal stiffness kn", STIFFNESS),
    ("kt", "tangential stiffness kt", STIFFNESS),
    ("resonance_frequency", "resonance", FREQUENCY),
    ("peak_frequency", "frequency of the peak", FREQUENCY),
    ("peak_amplitude", "amplitude of the peak", LENGTH),
];

/// Returns the title of a figure.
pub fn title(figure: &str) -> &str {
    let entry = NAMES.iter().find(|(column, ..)| *column == figure);
    entry.map_or(figure, |(_, title, _)| title)
}

fn units(figure: &str) -> Units {
    let entry = NAMES.iter().find(|(column, ..)| *column == figure);
    entry.map_or(super::quantity::NUMBER, |(.., units)| units)
}

/// Data of the report on a campaign.
pub struct CampaignReport<'a> {
    /// Title, scene and program version of the campaign.
    pub about: &'a StoredCampaign,
    /// The plan: keys and rows.
    pub campaign: &'a Campaign,
    /// State of each row.
    pub states: &'a [State],
    /// Number of each failed row, and the reason for the failure.
    pub failures: &'a [(usize, Failure)],
    /// Statistics of the collected runs.
    pub findings: &'a Findings,
}

fn share_text(share: f64) -> String {
    format!("{}\u{a0}%", significant_digits(100.0 * share, 2))
}

/// Formats the mean, standard deviation and 5 %, 50 % and 95 % quantiles of a figure in one unit.
pub fn figure_row(figure: &Figure) -> [String; 5] {
    let unit = unit_of(units(figure.name), figure.statistics.mean.abs());
    let SampleStatistics {
        mean,
        sd,
        quantiles: [low, _, median, _, high],
        ..
    } = figure.statistics;
    [mean, sd, low, median, high].map(|value| with_unit(value, unit))
}

/// Formats the rank correlation and the Sobol index of a figure and a key.
pub fn sensitivity_text(sensitivity: &Sensitivity) -> String {
    let rank = sensitivity.rank.map(|rank| {
        let sign = if rank < 0.0 { "−" } else { "+" };
        format!("{sign}{:.2}", rank.abs())
    });
    let share = sensitivity.share.map(share_text);
    let parts: Vec<String> = rank.into_iter().chain(share).collect();
    match parts.is_empty() {
        true => NONE.to_owned(),
        false => parts.join(", "),
    }
}

impl CampaignReport<'_> {
    /// Returns the keys that influence a figure, the most influential one first.
    pub fn influential_keys(&self, figure: &str) -> Vec<&Sensitivity> {
        let all = self.findings.sensitivities.iter();
        let mut influential: Vec<&Sensitivity> = all
            .filter(|s| s.figure == figure)
            .filter(|s| {
                let rank = s.rank.map_or(0.0, f64::abs);
                let share = s.share.unwrap_or(0.0);
                rank > rank_threshold(s.count) || share >= LEAST_SHARE.max(share_threshold(s.count))
            })
            .collect();
        influential.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
        influential
    }

    /// Returns a text with the number of collected runs and the numbers of failed, incomplete and waiting rows.
    pub fn counts(&self) -> String {
        let rows_in = |state: State| self.states.iter().filter(|own| **own == state).count();
        let mut parts = vec![format!(
            "{} runs collected of {} rows",
            self.findings.runs.rows.len(),
            self.states.len()
        )];
        let counts = [
            (rows_in(State::Failed), "failed"),
            (rows_in(State::Incomplete), "begun and not ended"),
            (rows_in(State::Waiting), "not begun"),
        ];
        let nonzero = counts.into_iter().filter(|(count, _)| *count > 0);
        parts.extend(nonzero.map(|(count, what)| format!("{count} {what}")));
        parts.join(", ")
    }

    fn final_figures(&self) -> Section {
        let heads = [
            "figure",
            "runs",
            "mean",
            "deviation",
            "5 %",
            "median",
            "95 %",
        ];
        let rows = self.findings.figures.iter().map(|figure| {
            let [mean, sd, low, median, high] = figure_row(figure);
            let name = title(figure.name).to_owned();
            let count = figure.statistics.count.to_string();
            vec![name, count, mean, sd, low, median, high]
        });
        let rows: Vec<Vec<String>> = rows.collect();
        Section {
            id: "ends",
            title: "Figures at the last iteration".to_owned(),
            html: html! {
                (table(&heads, &rows, true))
                p.note {
                    "Each run is at its last iteration. Deviation is the standard deviation over the runs. 5 % of the runs lie below \
                     the value at 5 %. The error bars of single runs are in their tables."
                } "\n"
            },
        }
    }

    fn sensitivities(&self) -> Section {
        let keys: Vec<&String> = self.campaign.keys.iter().map(|key| &key.name).collect();
        let mut heads = vec!["figure".to_owned()];
        heads.extend(keys.iter().map(|key| (*key).clone()));
        let all = &self.findings.sensitivities;
        let rows = self.findings.figures.iter().filter_map(|figure| {
            let own: Vec<&Sensitivity> = all.iter().filter(|s| s.figure == figure.name).collect();
            if own.is_empty() {
                return None;
            }
            let cell = |key: &&String| {
                let sensitivity = own.iter().find(|s| s.key == **key);
                sensitivity.map_or(NONE.to_owned(), |s| sensitivity_text(s))
            };
            let cells = keys.iter().map(cell);
            Some(
                [title(figure.name).to_owned()]
                    .into_iter()
                    .chain(cells)
                    .collect(),
            )
        });
        let rows: Vec<Vec<String>> = rows.collect();
        let counts = all.iter().map(|s| s.count).filter(|count| *count > 0);
        let count = counts.min().unwrap_or(0);
        let chance = rank_threshold(count);
        Section {
            id: "sensitivity",
            title: "Which key moves which figure".to_owned(),
            html: html! {
                (table(&heads, &rows, true))
                p.note { (format!(
                    "The first number is Spearman’s rank correlation, −1 to +1: positive if the figure rises with the key. For {count} \
                     runs or draws, values up to ±{chance:.2} may be chance. The second number is the first-order Sobol index: the part of the figure’s variance \
                     that the key alone explains. It is estimated from these runs by classes of the key, and corrected for chance. If the indices of a \
                     row sum to less than 100 %, the rest comes from interactions of keys, or from inputs that do not vary independently here."
                )) } "\n"
            },
        }
    }

    fn keys(&self) -> Section {
        let rows = self.campaign.keys.iter().enumerate().map(|(k, key)| {
            let values = || self.campaign.rows.iter().map(|row| &row.values[k]);
            let mut texts: Vec<String> = values().map(ResolvedValue::text).collect();
            let numbers: Option<Vec<f64>> = values().map(ResolvedValue::number).collect();
            texts.sort();
            texts.dedup();
            let [from, to] = match numbers {
                Some(numbers) => {
                    let least = numbers.iter().copied().fold(f64::INFINITY, f64::min);
                    let most = numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                    [significant_digits(least, 4), significant_digits(most, 4)]
                }
                None => [texts[0].clone(), texts[texts.len() - 1].clone()],
            };
            vec![key.name.clone(), texts.len().to_string(), from, to]
        });
        Section {
            id: "keys",
            title: "Keys that vary".to_owned(),
            html: html! {
                (table(&["key", "values", "from", "to"], &rows.collect::<Vec<_>>(), true))
                p.note {
                    "In SI units. The scene is " (self.about.scene_name) "; planned by fretwear " (self.about.program_version) "."
                } "\n"
            },
        }
    }

    fn failed(&self) -> Option<Section> {
        let mut reasons: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
        for (index, failure) in self.failures {
            reasons.entry(&failure.message).or_default().push(*index);
        }
        let rows: Vec<Vec<String>> = reasons
            .into_iter()
            .map(|(reason, rows)| {
                let shown: Vec<String> = rows.iter().take(NAMED).map(ToString::to_string).collect();
                let more = if rows.len() > NAMED { ", …" } else { "" };
                let settings = self.campaign.rows[rows[0]].settings.join(", ");
                let of_first = format!("{settings} (row {})", rows[0]);
                vec![
                    reason.to_owned(),
                    rows.len().to_string(),
                    format!("{}{more}", shown.join(", ")),
                    of_first,
                ]
            })
            .collect();
        let heads = ["reason", "rows", "which", "keys of the first"];
        (!rows.is_empty()).then(|| Section {
            id: "failed",
            title: "Runs that failed".to_owned(),
            html: table(&heads, &rows, false),
        })
    }

    /// Draws the quantile bands of a figure over the cycles.
    fn band(&self, figure: &Figure) -> Option<Drawing> {
        // The bands of a figure that is the same in all runs have no width.
        let varies = |(_, s): &(f64, SampleStatistics)| s.most > s.least;
        if figure.band.len() < 2 || !figure.band.iter().any(varies) {
            return None;
        }
        let largest = figure.band.iter().map(|(_, s)| s.quantiles[4].abs());
        let unit = unit_of(units(figure.name), largest.fold(0.0, f64::max));
        let curve =
            |name: &str, style: usize, mark: Mark, value: &dyn Fn(&SampleStatistics) -> f64| {
                let points = figure.band.iter().map(|(x, s)| [*x, value(s) / unit.size]);
                Curve {
                    mark,
                    ..Curve::line(name, style_of_run(style), points.collect())
                }
            };
        let band = |name: &str, style: usize, [low, high]: [usize; 2]| {
            let points = figure.band.iter();
            let points = points.map(|(x, s)| {
                [
                    *x,
                    s.quantiles[low] / unit.size,
                    s.quantiles[high] / unit.size,
                ]
            });
            Band {
                name: name.to_owned(),
                style: style_of_run(style),
                points: points.collect(),
            }
        };
        let bands = vec![
            band("5 % to 95 %", 1, [0, 4]),
            band("25 % to 75 %", 2, [1, 3]),
        ];
        let curves = vec![
            curve("median", 0, Mark::Line, &|s| s.quantiles[2]),
            curve("mean", 3, Mark::Thin, &|s| s.mean),
        ];
        let positive = figure.band.iter().map(|(x, _)| *x).filter(|x| *x > 0.0);
        let least = positive.fold(f64::INFINITY, f64::min);
        let chart = Chart {
            title: title(figure.name).to_owned(),
            x: Axis {
                label: "cycles".to_owned(),
                log: true,
                zero: Some(10f64.powf(least.log10().ceil() - 1.0)),
                range: None,
            },
            y: Axis {
                label: axis_label(title(figure.name), unit.symbol),
                ..Axis::default()
            },
            bands,
            curves,
            ..Chart::default()
        };
        Some(chart.draw())
    }

    /// Draws a figure over a key, one point per run.
    fn scatter(&self, figure: &Figure, key: &Sensitivity) -> Option<Drawing> {
        let mut keys = self.campaign.keys.iter();
        let k = keys.position(|own| own.name == key.key)?;
        let unit = unit_of(units(figure.name), figure.statistics.most.abs());
        let rows = self.findings.runs.rows.iter().zip(&figure.ends);
        let points: Vec<[f64; 2]> = rows
            .filter_map(|(row, end)| {
                let x = self.campaign.rows[*row].values[k].number()?;
                Some([x, (*end)? / unit.size])
            })
            .collect();
        if points.len() < 2 {
            return None;
        }
        let every = points.len().div_ceil(POINTS);
        let points = points.into_iter().step_by(every).collect();
        let chart = Chart {
            title: format!("{} over {}", title(figure.name), key.key),
            x: Axis {
                label: format!("{}, SI units", key.key),
                ..Axis::default()
            },
            y: Axis {
                label: axis_label(title(figure.name), unit.symbol),
                ..Axis::default()
            },
            curves: vec![Curve {
                mark: Mark::Points,
                ..Curve::line("", style_of_run(1), points)
            }],
            ..Chart::default()
        };
        Some(chart.draw())
    }

    /// Returns the page as one self-contained HTML file.
    pub fn html(&self) -> String {
        let figures = &self.findings.figures;
        let (mut bands, mut scatters) = (Vec::new(), Vec::new());
        for (k, figure) in figures.iter().enumerate() {
            let band = self.band(figure);
            bands.extend(band.map(|drawing| (format!("band-{k}"), drawing)));
            let mut movers = self.influential_keys(figure.name).into_iter();
            if scatters.len() < SCATTERS
                && let Some(key) = movers.find(|s| s.rank.is_some())
            {
                let scatter = self.scatter(figure, key);
                scatters.extend(scatter.map(|drawing| (format!("scatter-{k}"), drawing)));
            }
        }
        let section = |id: &'static str, title: &str, charts: &[(String, Drawing)], note: &str| {
            let each = charts.iter().map(|(id, drawing)| (id.clone(), drawing));
            (!charts.is_empty()).then(|| Section {
                id,
                title: title.to_owned(),
                html: html! { (drawings(each)) p.note { (note) } "\n" },
            })
        };
        let bands = section(
            "bands",
            "Bands over the cycles",
            &bands,
            "At each number of cycles the bands include all runs that have reached it, and at least half of all runs must have reached it. Values between two iterations are interpolated linearly.",
        );
        let scatters = section(
            "over-keys",
            "Figures over the keys that move them most",
            &scatters,
            "One point per run.",
        );
        let sections = [
            Some(self.final_figures()),
            bands,
            Some(self.sensitivities()),
            scatters,
            self.failed(),
            Some(self.keys()),
        ];
        let page = Page {
            title: &self.about.title,
            lead: html! { p.lead { (self.counts()) } "\n" },
            warnings: &[],
            parts: sections.iter().flatten().map(Part::Section).collect(),
        };
        page.html()
    }

    /// Writes the page of the report, and writes the tables of the report into the folder of the page. Returns the
    /// paths of the files, the page first.
    ///
    /// The page is `named`, written as by [`output::write`], or else `report.html` in `folder`. If `named` is a device
    /// or a pipe, no tables are written.
    ///
    /// # Errors
    /// Returns [`ReportError`].
    pub fn write(&self, named: Option<&Path>, folder: &Path) -> Result<Vec<PathBuf>, ReportError> {
        let page = named.map_or_else(|| folder.join("report.html"), Path::to_owned);
        let html = self.html();
        let file = match named {
            Some(page) => output::write(page, html.as_bytes()),
            None => output::replace(&page, html.as_bytes()).map(|()| Some(page.clone())),
        };
        let file = file.map_err(io_error(&page))?;
        let mut written = vec![page];
        let Some(file) = file else {
            return Ok(written);
        };
        let table_error = |source: TableError| ReportError::Table {
            path: file.clone(),
            source: Box::new(source),
        };
        let provenance = Provenance {
            // A campaign has many scenes.
            scene_hash: String::new(),
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
        };
        for table in self.findings.tables().map_err(table_error)? {
            let bytes = to_parquet(&table, &provenance).map_err(table_error)?;
            let path = file.with_file_name(format!("{}.parquet", table.schema().name));
            output::replace(&path, &bytes).map_err(io_error(&path))?;
            written.push(path);
        }
        Ok(written)
    }
}

/// Ranks keys: the larger of the Sobol index and the squared rank correlation.
fn strength(sensitivity: &Sensitivity) -> f64 {
    let by_rank = sensitivity.rank.map_or(0.0, |rank| rank * rank);
    sensitivity.share.unwrap_or(0.0).max(by_rank)
}

fn axis_label(name: &str, symbol: &str) -> String {
    match symbol {
        "" => name.to_owned(),
        symbol => format!("{name}, {symbol}"),
    }
}
