//! Statistics of the collected runs of a campaign.

use std::collections::BTreeMap;

use super::collect::{INDEX, WEAR_ITERATION};
use super::error::CampaignError;
use super::folder::{CampaignFolder, Section, StoredCampaign};
use super::statistics::{
    self, SampleStatistics, classes, crossed_share, drawn_share, first_order_index, interpolate,
    rank_correlation, sample_statistics, variance,
};
use super::table::Campaign;
use crate::tables::{Nullable, Table, TableError, TableName};

/// Columns of the figures. The findings report each of these figures that the runs have.
pub const FIGURES: [&str; 16] = [
    "wear_volume",
    "largest_depth",
    "depth_99",
    "wear_rate",
    "dissipated_energy",
    "dissipated_energy_total",
    "loaded_area_fraction",
    "max_pressure",
    "normal_load",
    "approach",
    "rq",
    "kn",
    "kt",
    "resonance_frequency",
    "peak_frequency",
    "peak_amplitude",
];

const CYCLES: &str = "cycles";
/// Number of points of a band over the cycles, without the point at 0. The points are evenly spaced in the logarithm,
/// as wear is.
const POINTS: usize = 32;
/// Smallest share of the runs that must reach a point of a band. If fewer runs reach the point, the band excludes the
/// point.
const LEAST_PART: f64 = 0.5;

/// Statistics of a figure over all runs that have the figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Name of the column.
    pub name: &'static str,
    /// Value at the end of every run, in the order of [`CollectedRuns::rows`]. The value is `None` for a run that lacks
    /// the figure.
    pub ends: Vec<Option<f64>>,
    /// Statistics of `ends`.
    pub statistics: SampleStatistics,
    /// Statistics at numbers of cycles: pairs of cycles and statistics.
    pub band: Vec<(f64, SampleStatistics)>,
}

/// Sensitivity of a figure to a key.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// The figure.
    pub figure: &'static str,
    /// The key.
    pub key: String,
    /// Number of samples. A draw counts once, even if it is repeated at several points of a grid.
    pub count: usize,
    /// Spearman's rank correlation. `None` if the key is not a number.
    pub rank: Option<f64>,
    /// First-order Sobol index.
    pub share: Option<f64>,
}

/// Collected runs of a campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct CollectedRuns {
    /// Row indices in the campaign, ascending.
    pub rows: Vec<usize>,
    /// Cycles at the end of each run. `None` without wear.
    pub cycles: Vec<Option<f64>>,
}

/// Statistics and sensitivities of a campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Findings {
    /// Collected runs.
    pub runs: CollectedRuns,
    /// Figures that the runs have.
    pub figures: Vec<Figure>,
    /// Sensitivity of each varying figure to each varying key.
    pub sensitivities: Vec<Sensitivity>,
}

/// Returns the numbers of a column. A flag becomes 0 or 1, a text `None`.
pub(super) fn numbers(values: &Nullable) -> Vec<Option<f64>> {
    match values {
        Nullable::F64(values) => values.clone(),
        Nullable::I64(values) => values.iter().map(|v| v.map(|v| v as f64)).collect(),
        Nullable::I32(values) => values.iter().map(|v| v.map(f64::from)).collect(),
        Nullable::Bool(values) => values
            .iter()
            .map(|v| v.map(|v| f64::from(u8::from(v))))
            .collect(),
        Nullable::Text(values) => vec![None; values.len()],
    }
}

impl Findings {
    /// Reads the shards and computes the statistics.
    ///
    /// # Errors
    /// [`CampaignError::NothingCollected`], and the errors of reading shards.
    pub fn of(
        folder: &CampaignFolder,
        about: &StoredCampaign,
        campaign: &Campaign,
    ) -> Result<Findings, CampaignError> {
        let wanted =
            |name: &str| FIGURES.contains(&name) || [INDEX, WEAR_ITERATION, CYCLES].contains(&name);
        let columns = folder.scan(campaign, &wanted)?;
        let nothing = || CampaignError::NothingCollected {
            path: folder.root.clone(),
        };
        let Some(Nullable::I64(index)) = columns.get(INDEX) else {
            return Err(nothing());
        };
        // First and last table row of each run: the rows of a run are contiguous and sorted by iteration.
        let mut row_spans: BTreeMap<usize, (usize, usize)> = BTreeMap::new();
        for (row, index) in index.iter().enumerate() {
            let Some(index) = index.and_then(|index| usize::try_from(index).ok()) else {
                continue;
            };
            if index < campaign.rows.len() {
                row_spans.entry(index).or_insert((row, row)).1 = row;
            }
        }
        if row_spans.is_empty() {
            return Err(nothing());
        }
        let cycles = columns.get(CYCLES).map(numbers).unwrap_or_default();
        let cycles_of = |row: usize| cycles.get(row).copied().flatten();
        let runs = CollectedRuns {
            rows: row_spans.keys().copied().collect(),
            cycles: row_spans
                .values()
                .map(|(_, last)| cycles_of(*last))
                .collect(),
        };
        let grid = grid(
            &runs.cycles,
            row_spans.values().filter_map(|(first, last)| {
                (*first < *last).then(|| cycles_of(first + 1)).flatten()
            }),
        );
        let mut figures = Vec::new();
        for name in FIGURES {
            let Some(values) = columns.get(name).map(numbers) else {
                continue;
            };
            let ends: Vec<Option<f64>> =
                row_spans.values().map(|(_, last)| values[*last]).collect();
            let end_values: Vec<f64> = ends.iter().copied().flatten().collect();
            let Some(spread) = sample_statistics(&end_values) else {
                continue;
            };
            let courses: Vec<Vec<[f64; 2]>> = row_spans
                .values()
                .map(|(first, last)| {
                    let rows = *first..=*last;
                    rows.filter_map(|row| Some([cycles_of(row)?, values[row]?]))
                        .collect()
                })
                .collect();
            figures.push(Figure {
                name,
                band: band(&courses, &grid, spread.count),
                ends,
                statistics: spread,
            });
        }
        let sensitivities = sensitivities(campaign, about, &runs.rows, &figures);
        Ok(Findings {
            runs,
            figures,
            sensitivities,
        })
    }

    /// Builds the tables `campaign_figure`, `campaign_band` and `campaign_sensitivity`.
    ///
    /// # Errors
    /// [`TableError`]
    pub fn tables(&self) -> Result<[Table; 3], TableError> {
        let all = self.figures.iter();
        let ended_before =
            all.flat_map(|f| f.band.iter().map(|(_, s)| f.statistics.count - s.count));
        let ended_before: Vec<i64> = ended_before.map(|runs| runs as i64).collect();
        let spreads =
            |name: TableName, entries: &[(&'static str, Option<f64>, SampleStatistics)]| {
                let all = |statistic: &dyn Fn(&SampleStatistics) -> f64| -> Vec<f64> {
                    entries
                        .iter()
                        .map(|(.., spread)| statistic(spread))
                        .collect()
                };
                let names: Vec<String> = entries
                    .iter()
                    .map(|(name, ..)| (*name).to_owned())
                    .collect();
                let mut table = Table::builder(name).column("figure", names);
                let cycles: Vec<f64> = entries
                    .iter()
                    .filter_map(|(_, cycles, _)| *cycles)
                    .collect();
                if name == TableName::CampaignBand {
                    table = table.column("cycles", cycles);
                }
                let counts: Vec<i64> = entries.iter().map(|(.., s)| s.count as i64).collect();
                table = table.column("runs", counts);
                if name == TableName::CampaignBand {
                    table = table.column("ended_before", ended_before.clone());
                }
                table = table
                    .column("mean", all(&|s| s.mean))
                    .column("sd", all(&|s| s.sd))
                    .column("least", all(&|s| s.least));
                for (k, part) in statistics::QUANTILES.iter().enumerate() {
                    let name = format!("q{:02}", (100.0 * part).round());
                    table = table.column(&name, all(&|s| s.quantiles[k]));
                }
                table.column("most", all(&|s| s.most)).build()
            };
        let figures = self.figures.iter();
        let ends: Vec<_> = figures
            .clone()
            .map(|f| (f.name, None, f.statistics))
            .collect();
        let band = figures.flat_map(|f| f.band.iter().map(|(x, s)| (f.name, Some(*x), *s)));
        let band: Vec<_> = band.collect();
        let texts = |text: &dyn Fn(&Sensitivity) -> String| -> Vec<String> {
            self.sensitivities.iter().map(text).collect()
        };
        let all = || self.sensitivities.iter();
        let sensitivity = Table::builder(TableName::CampaignSensitivity)
            .column("figure", texts(&|s| s.figure.to_owned()))
            .column("key", texts(&|s| s.key.clone()))
            .column("runs", all().map(|s| s.count as i64).collect::<Vec<i64>>())
            .column("rank", all().map(|s| s.rank).collect::<Vec<Option<f64>>>())
            .column(
                "share",
                all().map(|s| s.share).collect::<Vec<Option<f64>>>(),
            )
            .build()?;
        Ok([
            spreads(TableName::CampaignFigure, &ends)?,
            spreads(TableName::CampaignBand, &band)?,
            sensitivity,
        ])
    }
}

/// Returns the numbers of cycles at which the bands are computed. A band begins at 0 cycles. The other points extend
/// from the median of the first steps of the runs to the end of the longest run. Without wear, the function returns an
/// empty list.
fn grid(ends: &[Option<f64>], firsts: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut firsts: Vec<f64> = firsts.filter(|first| *first > 0.0).collect();
    firsts.sort_by(f64::total_cmp);
    let most = ends.iter().copied().flatten().fold(0.0, f64::max);
    let Some(&least) = firsts.get(firsts.len() / 2).filter(|least| **least < most) else {
        return Vec::new();
    };
    let step = (most / least).ln() / (POINTS - 1) as f64;
    let inner = (0..POINTS - 1).map(|k| least * (k as f64 * step).exp());
    // Use the exact end as the last point: a rounded value could lie beyond the end of the runs.
    [0.0].into_iter().chain(inner).chain([most]).collect()
}

fn band(courses: &[Vec<[f64; 2]>], grid: &[f64], count: usize) -> Vec<(f64, SampleStatistics)> {
    let point = |x: &f64| {
        let values: Vec<f64> = courses
            .iter()
            .filter_map(|course| interpolate(course, *x))
            .collect();
        let spread = sample_statistics(&values)?;
        (spread.count as f64 >= LEAST_PART * count as f64).then_some((*x, spread))
    };
    grid.iter().filter_map(point).collect()
}

/// Smallest ratio of a figure's range to its mean. With a smaller ratio, the figure varies only by rounding.
const SMALLEST_VARIATION: f64 = 1e-9;
/// Smallest share of a crossing that must be complete for an estimate.
const LEAST_WHOLE: f64 = 0.5;

/// Table of the row indices of a campaign. Each line belongs to a point p of one section. Each column belongs to a
/// point q of the other sections.
struct Crossing {
    /// `rows[p][q]`: row indices. If q is a random draw, `rows[p][q]` contains a row for each point of the remaining
    /// sections. [`Crossing::whole`] averages the rows in `rows[p][q]`.
    rows: Vec<Vec<Vec<usize>>>,
}

/// Values of the complete part of a [`Crossing`].
struct Crossed {
    /// One row index for each p.
    rows: Vec<usize>,
    /// `y[p][q]`.
    y: Vec<Vec<f64>>,
    /// Variance of the figure over all runs in the complete part of the crossing.
    whole: f64,
}

/// Returns the lines that have at least half as many runs as the line with the most runs.
fn well_filled_lines(lines: usize, runs: impl Fn(usize) -> usize) -> Vec<usize> {
    let counts: Vec<usize> = (0..lines).map(runs).collect();
    let most = counts.iter().copied().max().unwrap_or(0);
    (0..lines)
        .filter(|line| most > 0 && 2 * counts[*line] >= most)
        .collect()
}

/// Returns the point of a section at a row index.
pub(super) fn point(sections: &[Section], section: usize, row: usize) -> usize {
    let stride: usize = sections[section + 1..].iter().map(|s| s.points).product();
    row / stride % sections[section].points
}

impl Crossing {
    /// Crosses a section with the others. Returns `None` if no other section has more than one point.
    fn of(sections: &[Section], section: usize, rows: usize) -> Option<Crossing> {
        let others = || (0..sections.len()).filter(|other| *other != section);
        if others().all(|other| sections[other].points < 2) {
            return None;
        }
        let drawn =
            others().find(|other| sections[*other].is_random && sections[*other].points > 1);
        let columns = match drawn {
            Some(drawn) => sections[drawn].points,
            None => others().map(|other| sections[other].points).product(),
        };
        let mut crossing = vec![vec![Vec::new(); columns]; sections[section].points];
        for row in 0..rows {
            let q = match drawn {
                Some(drawn) => point(sections, drawn, row),
                None => others().fold(0, |q, other| {
                    q * sections[other].points + point(sections, other, row)
                }),
            };
            crossing[point(sections, section, row)][q].push(row);
        }
        Some(Crossing { rows: crossing })
    }

    /// Returns the complete part of the crossing. If a run lacks the figure, `whole` omits all runs of the same random
    /// draw.
    fn whole(&self, y: &BTreeMap<usize, f64>, is_random: bool) -> Option<Crossed> {
        let (points, columns) = (self.rows.len(), self.rows.first()?.len());
        let mean = |rows: &[usize]| -> Option<f64> {
            let values: Option<Vec<f64>> = rows.iter().map(|row| y.get(row).copied()).collect();
            let values = values.filter(|values| !values.is_empty())?;
            Some(values.iter().sum::<f64>() / values.len() as f64)
        };
        let all: Vec<Vec<Option<f64>>> = (self.rows.iter())
            .map(|values_of_point| values_of_point.iter().map(|rows| mean(rows)).collect())
            .collect();
        let is_there = |p: usize, q: usize| all[p][q].is_some();
        // Ignore points with few runs, for example other roughnesses of which only one run was made.
        let filled_p =
            well_filled_lines(points, |p| (0..columns).filter(|q| is_there(p, *q)).count());
        let filled_q =
            well_filled_lines(columns, |q| (0..points).filter(|p| is_there(*p, q)).count());
        let filled = filled_p.len() * filled_q.len();
        let (mut selected_p, mut selected_q) = (filled_p, filled_q);
        match is_random {
            true => selected_p.retain(|p| selected_q.iter().all(|q| is_there(*p, *q))),
            false => selected_q.retain(|q| selected_p.iter().all(|p| is_there(*p, *q))),
        }
        let selected = selected_p.len() * selected_q.len();
        if selected == 0 || (selected as f64) < LEAST_WHOLE * filled as f64 {
            return None;
        }
        let values_of_point = |p: &usize| selected_q.iter().filter_map(|q| all[*p][*q]).collect();
        let mut runs: Vec<f64> = Vec::new();
        for (p, q) in selected_p
            .iter()
            .flat_map(|p| selected_q.iter().map(move |q| (*p, *q)))
        {
            runs.extend(self.rows[p][q].iter().filter_map(|row| y.get(row)));
        }
        Some(Crossed {
            rows: selected_p
                .iter()
                .map(|p| self.rows[*p][selected_q[0]][0])
                .collect(),
            y: selected_p.iter().map(values_of_point).collect(),
            whole: variance(&runs),
        })
    }
}

/// Returns the numbers of a key at some rows. Returns `None` if a value is a text, or if the key is a seed.
fn numbers_at(campaign: &Campaign, k: usize, rows: &[usize]) -> Option<Vec<f64>> {
    // Treat a seed as a name, because the size of a seed has no meaning.
    let is_name = campaign.keys[k].name.ends_with("seed");
    let x: Option<Vec<f64>> = (rows.iter())
        .map(|row| campaign.rows[*row].values[k].number())
        .collect();
    x.filter(|_| !is_name)
}

/// Assigns one class to each value of a key.
fn classes_by_value(campaign: &Campaign, k: usize, rows: &[usize]) -> Vec<usize> {
    let texts: Vec<String> = (rows.iter())
        .map(|row| campaign.rows[*row].values[k].text())
        .collect();
    let mut words = texts.clone();
    words.sort();
    words.dedup();
    let place = |text| words.binary_search(text).unwrap_or(0);
    texts.iter().map(place).collect()
}

/// Assigns classes to a key that is drawn. Numbers get classes of equal size.
fn classes_at(campaign: &Campaign, k: usize, rows: &[usize]) -> Vec<usize> {
    match numbers_at(campaign, k, rows) {
        Some(x) => classes(&x),
        None => classes_by_value(campaign, k, rows),
    }
}

fn sensitivities(
    campaign: &Campaign,
    about: &StoredCampaign,
    rows: &[usize],
    figures: &[Figure],
) -> Vec<Sensitivity> {
    let sections = &about.sections[..];
    let section_of = |key: &str| {
        sections
            .iter()
            .position(|s| s.keys.iter().any(|own| own == key))
    };
    let crossings: Vec<Option<Crossing>> = (0..sections.len())
        .map(|section| Crossing::of(sections, section, about.rows))
        .collect();
    let mut results = Vec::new();
    for figure in figures {
        if figure.statistics.most - figure.statistics.least
            <= SMALLEST_VARIATION * figure.statistics.mean.abs()
        {
            continue;
        }
        let ends = rows.iter().zip(&figure.ends);
        let value_of_row: BTreeMap<usize, f64> = ends
            .filter_map(|(row, end)| Some((*row, end.filter(|v| v.is_finite())?)))
            .collect();
        let value_rows: Vec<usize> = value_of_row.keys().copied().collect();
        let y: Vec<f64> = value_of_row.values().copied().collect();
        for (k, key) in campaign.keys.iter().enumerate() {
            let section = section_of(&key.name);
            let crossing = section.and_then(|section| crossings[section].as_ref());
            let is_random = section.is_some_and(|section| sections[section].is_random);
            let (count, rank, share) = match crossing {
                None => {
                    let rank =
                        numbers_at(campaign, k, &value_rows).and_then(|x| rank_correlation(&x, &y));
                    (
                        value_rows.len(),
                        rank,
                        first_order_index(&classes_at(campaign, k, &value_rows), &y),
                    )
                }
                Some(crossing) => match crossing.whole(&value_of_row, is_random) {
                    None => (0, None, None),
                    // A draw is one sample, however often it is repeated.
                    Some(Crossed { rows, y, whole }) if is_random => {
                        let means: Vec<f64> = (y.iter())
                            .map(|of_draw| of_draw.iter().sum::<f64>() / of_draw.len() as f64)
                            .collect();
                        let x = numbers_at(campaign, k, &rows);
                        let share = drawn_share(&classes_at(campaign, k, &rows), &y, whole);
                        (
                            rows.len(),
                            x.and_then(|x| rank_correlation(&x, &means)),
                            share,
                        )
                    }
                    Some(crossed) => {
                        let classes = classes_by_value(campaign, k, &crossed.rows);
                        let rank = numbers_at(campaign, k, &value_rows)
                            .and_then(|x| rank_correlation(&x, &y));
                        (
                            value_rows.len(),
                            rank,
                            crossed_share(&classes, &crossed.y, crossed.whole),
                        )
                    }
                },
            };
            results.push(Sensitivity {
                figure: figure.name,
                key: key.name.clone(),
                count,
                rank,
                share,
            });
        }
    }
    results
}
