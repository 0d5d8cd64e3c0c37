//! What the collected runs of a campaign say together.

use std::collections::BTreeMap;

use super::collect::{INDEX, WEAR_ITERATION};
use super::error::CampaignError;
use super::folder::{About, Folder, Section};
use super::statistics::{
    self, SampleStatistics, at, classes, crossed_share, drawn_share, rank_correlation, spread,
    variance, variance_share,
};
use super::table::Campaign;
use crate::tables::{Nullable, Table, TableError, TableName};

/// Columns of a summary that are reported, where runs have them.
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
/// Points of a band over the cycles, beside 0: evenly spaced in their logarithm, as wear goes.
const POINTS: usize = 32;
/// A band has a point where at least this part of the runs has come to.
const LEAST_PART: f64 = 0.5;

/// A figure of the runs that have it.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Column of the summary.
    pub name: &'static str,
    /// At the end of every run, by its place among the [`CollectedRuns::rows`]; none where it has no such figure.
    pub ends: Vec<Option<f64>>,
    /// Of these.
    pub spread: SampleStatistics,
    /// Over the cycles.
    pub band: Vec<(f64, SampleStatistics)>,
}

/// How a figure depends on a key.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// The figure.
    pub figure: &'static str,
    /// The key.
    pub key: String,
    /// Runs that have both, each draw counting once however many points of a grid it meets.
    pub count: usize,
    /// Spearman's rank correlation; none for a key that is no number.
    pub rank: Option<f64>,
    /// First-order Sobol index.
    pub share: Option<f64>,
}

/// The runs that were collected.
#[derive(Debug, Clone, PartialEq)]
pub struct CollectedRuns {
    /// Their rows in the campaign, ascending.
    pub rows: Vec<usize>,
    /// Cycles at the end of each, where it wears.
    pub cycles: Vec<Option<f64>>,
}

/// What is reported.
#[derive(Debug, Clone, PartialEq)]
pub struct Findings {
    /// The runs.
    pub runs: CollectedRuns,
    /// The figures that there are.
    pub figures: Vec<Figure>,
    /// Of every figure that varies to every key that does.
    pub sensitivities: Vec<Sensitivity>,
}

/// The numbers of a column; of a flag 0 and 1.
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
    /// Reads what is collected.
    ///
    /// # Errors
    /// [`CampaignError::NothingCollected`], and those of reading shards.
    pub fn of(
        folder: &Folder,
        about: &About,
        campaign: &Campaign,
    ) -> Result<Findings, CampaignError> {
        let wanted =
            |name: &str| FIGURES.contains(&name) || [INDEX, WEAR_ITERATION, CYCLES].contains(&name);
        let found = folder.scan(campaign, &wanted)?;
        let nothing = || CampaignError::NothingCollected {
            path: folder.root.clone(),
        };
        let Some(Nullable::I64(index)) = found.get(INDEX) else {
            return Err(nothing());
        };
        // Rows of a run stand together, in the order of their iterations.
        let mut of_runs: BTreeMap<usize, (usize, usize)> = BTreeMap::new();
        for (row, index) in index.iter().enumerate() {
            let Some(index) = index.and_then(|index| usize::try_from(index).ok()) else {
                continue;
            };
            if index < campaign.rows.len() {
                of_runs.entry(index).or_insert((row, row)).1 = row;
            }
        }
        if of_runs.is_empty() {
            return Err(nothing());
        }
        let cycles = found.get(CYCLES).map(numbers).unwrap_or_default();
        let cycles_of = |row: usize| cycles.get(row).copied().flatten();
        let runs = CollectedRuns {
            rows: of_runs.keys().copied().collect(),
            cycles: of_runs.values().map(|(_, last)| cycles_of(*last)).collect(),
        };
        let grid = grid(
            &runs.cycles,
            of_runs.values().filter_map(|(first, last)| {
                (*first < *last).then(|| cycles_of(first + 1)).flatten()
            }),
        );
        let mut figures = Vec::new();
        for name in FIGURES {
            let Some(values) = found.get(name).map(numbers) else {
                continue;
            };
            let ends: Vec<Option<f64>> = of_runs.values().map(|(_, last)| values[*last]).collect();
            let known: Vec<f64> = ends.iter().copied().flatten().collect();
            let Some(spread) = spread(&known) else {
                continue;
            };
            let courses: Vec<Vec<[f64; 2]>> = of_runs
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
                spread,
            });
        }
        let sensitivities = sensitivities(campaign, about, &runs.rows, &figures);
        Ok(Findings {
            runs,
            figures,
            sensitivities,
        })
    }

    /// The tables `campaign_figure`, `campaign_band` and `campaign_sensitivity`.
    ///
    /// # Errors
    /// [`TableError`]
    pub fn tables(&self) -> Result<[Table; 3], TableError> {
        let all = self.figures.iter();
        let left = all.flat_map(|f| f.band.iter().map(|(_, s)| f.spread.count - s.count));
        let left: Vec<i64> = left.map(|runs| runs as i64).collect();
        let spreads = |name: TableName, of: &[(&'static str, Option<f64>, SampleStatistics)]| {
            let all = |of_one: &dyn Fn(&SampleStatistics) -> f64| -> Vec<f64> {
                of.iter().map(|(.., spread)| of_one(spread)).collect()
            };
            let names: Vec<String> = of.iter().map(|(name, ..)| (*name).to_owned()).collect();
            let mut table = Table::builder(name).column("figure", names);
            let cycles: Vec<f64> = of.iter().filter_map(|(_, cycles, _)| *cycles).collect();
            if name == TableName::CampaignBand {
                table = table.column("cycles", cycles);
            }
            let counts: Vec<i64> = of.iter().map(|(.., s)| s.count as i64).collect();
            table = table.column("runs", counts);
            if name == TableName::CampaignBand {
                table = table.column("ended_before", left.clone());
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
        let ends: Vec<_> = figures.clone().map(|f| (f.name, None, f.spread)).collect();
        let band = figures.flat_map(|f| f.band.iter().map(|(x, s)| (f.name, Some(*x), *s)));
        let band: Vec<_> = band.collect();
        let of = |text: &dyn Fn(&Sensitivity) -> String| -> Vec<String> {
            self.sensitivities.iter().map(text).collect()
        };
        let all = || self.sensitivities.iter();
        let sensitivity = Table::builder(TableName::CampaignSensitivity)
            .column("figure", of(&|s| s.figure.to_owned()))
            .column("key", of(&|s| s.key.clone()))
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

/// Numbers of cycles at which bands are told: 0, and from the median of the first steps to the longest run; none without wear.
fn grid(ends: &[Option<f64>], firsts: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut firsts: Vec<f64> = firsts.filter(|first| *first > 0.0).collect();
    firsts.sort_by(f64::total_cmp);
    let most = ends.iter().copied().flatten().fold(0.0, f64::max);
    let Some(&least) = firsts.get(firsts.len() / 2).filter(|least| **least < most) else {
        return Vec::new();
    };
    let step = (most / least).ln() / (POINTS - 1) as f64;
    let inner = (0..POINTS - 1).map(|k| least * (k as f64 * step).exp());
    // The last is the very end, where rounding would leave most runs out.
    [0.0].into_iter().chain(inner).chain([most]).collect()
}

fn band(courses: &[Vec<[f64; 2]>], grid: &[f64], count: usize) -> Vec<(f64, SampleStatistics)> {
    let point = |x: &f64| {
        let values: Vec<f64> = courses.iter().filter_map(|course| at(course, *x)).collect();
        let spread = spread(&values)?;
        (spread.count as f64 >= LEAST_PART * count as f64).then_some((*x, spread))
    };
    grid.iter().filter_map(point).collect()
}

/// A figure that varies by less than this part of its mean does so by rounding.
const VARIES: f64 = 1e-9;
/// Of draws that cross a grid or a list, at least this part must have ended in every run.
const LEAST_WHOLE: f64 = 0.5;

/// The rows of a campaign as points of one of its sections (p) and of others (q).
struct Crossing {
    /// `rows[p][q]`: the rows there; more than one where q is a draw, and a third section is averaged over.
    rows: Vec<Vec<Vec<usize>>>,
}

/// Values at the points of a [`Crossing`] that are whole.
struct Crossed {
    /// A row of each p.
    rows: Vec<usize>,
    /// `y[p][q]`.
    y: Vec<Vec<f64>>,
    /// Variance of all runs there.
    whole: f64,
}

/// Of so many lines those that have at least half as many runs as the one that has most.
fn begun(lines: usize, runs: impl Fn(usize) -> usize) -> Vec<usize> {
    let counts: Vec<usize> = (0..lines).map(runs).collect();
    let most = counts.iter().copied().max().unwrap_or(0);
    (0..lines)
        .filter(|line| most > 0 && 2 * counts[*line] >= most)
        .collect()
}

/// Place of a section's point in the index of a row.
pub(super) fn point(sections: &[Section], section: usize, row: usize) -> usize {
    let stride: usize = sections[section + 1..].iter().map(|s| s.points).product();
    row / stride % sections[section].points
}

impl Crossing {
    /// Of a section with the others; none where there is none.
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

    /// Where some runs lack the figure, draws of which any does are left out.
    fn whole(&self, y: &BTreeMap<usize, f64>, is_random: bool) -> Option<Crossed> {
        let (points, columns) = (self.rows.len(), self.rows.first()?.len());
        let mean = |rows: &[usize]| -> Option<f64> {
            let values: Option<Vec<f64>> = rows.iter().map(|row| y.get(row).copied()).collect();
            let values = values.filter(|values| !values.is_empty())?;
            Some(values.iter().sum::<f64>() / values.len() as f64)
        };
        let all: Vec<Vec<Option<f64>>> = (self.rows.iter())
            .map(|of_point| of_point.iter().map(|rows| mean(rows)).collect())
            .collect();
        let is_there = |p: usize, q: usize| all[p][q].is_some();
        // Points that were hardly begun are no part of it, as the other roughnesses where one was run.
        let begun_p = begun(points, |p| (0..columns).filter(|q| is_there(p, *q)).count());
        let begun_q = begun(columns, |q| (0..points).filter(|p| is_there(*p, q)).count());
        let begun = begun_p.len() * begun_q.len();
        let (mut kept_p, mut kept_q) = (begun_p, begun_q);
        match is_random {
            true => kept_p.retain(|p| kept_q.iter().all(|q| is_there(*p, *q))),
            false => kept_q.retain(|q| kept_p.iter().all(|p| is_there(*p, *q))),
        }
        let kept = kept_p.len() * kept_q.len();
        if kept == 0 || (kept as f64) < LEAST_WHOLE * begun as f64 {
            return None;
        }
        let of_point = |p: &usize| kept_q.iter().filter_map(|q| all[*p][*q]).collect();
        let mut runs: Vec<f64> = Vec::new();
        for (p, q) in kept_p
            .iter()
            .flat_map(|p| kept_q.iter().map(move |q| (*p, *q)))
        {
            runs.extend(self.rows[p][q].iter().filter_map(|row| y.get(row)));
        }
        Some(Crossed {
            rows: kept_p.iter().map(|p| self.rows[*p][kept_q[0]][0]).collect(),
            y: kept_p.iter().map(of_point).collect(),
            whole: variance(&runs),
        })
    }
}

/// A key at some rows: its numbers, if it is no name.
fn numbers_at(campaign: &Campaign, k: usize, rows: &[usize]) -> Option<Vec<f64>> {
    // The number of a seed is a name.
    let is_name = campaign.keys[k].name.ends_with("seed");
    let x: Option<Vec<f64>> = (rows.iter())
        .map(|row| campaign.rows[*row].values[k].number())
        .collect();
    x.filter(|_| !is_name)
}

/// A class for each value of a key.
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

/// Classes of a key that is drawn: of a number equally filled ones.
fn classes_at(campaign: &Campaign, k: usize, rows: &[usize]) -> Vec<usize> {
    match numbers_at(campaign, k, rows) {
        Some(x) => classes(&x),
        None => classes_by_value(campaign, k, rows),
    }
}

fn sensitivities(
    campaign: &Campaign,
    about: &About,
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
    let mut found = Vec::new();
    for figure in figures {
        if figure.spread.most - figure.spread.least <= VARIES * figure.spread.mean.abs() {
            continue;
        }
        let ends = rows.iter().zip(&figure.ends);
        let known: BTreeMap<usize, f64> = ends
            .filter_map(|(row, end)| Some((*row, end.filter(|v| v.is_finite())?)))
            .collect();
        let all: Vec<usize> = known.keys().copied().collect();
        let y: Vec<f64> = known.values().copied().collect();
        for (k, key) in campaign.keys.iter().enumerate() {
            let section = section_of(&key.name);
            let crossing = section.and_then(|section| crossings[section].as_ref());
            let is_random = section.is_some_and(|section| sections[section].is_random);
            let (count, rank, share) = match crossing {
                None => {
                    let rank = numbers_at(campaign, k, &all).and_then(|x| rank_correlation(&x, &y));
                    (
                        all.len(),
                        rank,
                        variance_share(&classes_at(campaign, k, &all), &y),
                    )
                }
                Some(crossing) => match crossing.whole(&known, is_random) {
                    None => (0, None, None),
                    // A draw is one sample however often it is repeated.
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
                        let rank =
                            numbers_at(campaign, k, &all).and_then(|x| rank_correlation(&x, &y));
                        (
                            all.len(),
                            rank,
                            crossed_share(&classes, &crossed.y, crossed.whole),
                        )
                    }
                },
            };
            found.push(Sensitivity {
                figure: figure.name,
                key: key.name.clone(),
                count,
                rank,
                share,
            });
        }
    }
    found
}
