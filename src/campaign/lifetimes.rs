//! After how many cycles the runs of a campaign pass a milestone: of each point of its grid and of its list by itself.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::collect::{INDEX, WEAR_ITERATION};
use super::error::CampaignError;
use super::findings::{numbers, point};
use super::folder::{About, Folder, Section};
use super::rows::State;
use super::statistics::QUANTILES;
use super::survival::{Life, Quantile, Survival};
use super::table::Campaign;
use crate::milestones::{Figure, Milestone, States};
use crate::store::{Layout, RealFileSystem, RunReader};
use crate::tables::Nullable;

/// The runs of a campaign as far as they are known.
pub struct Histories {
    /// By the index of the row.
    runs: BTreeMap<usize, States>,
    /// Rows that have ended and are not collected.
    pub uncollected: Vec<usize>,
    /// Rows that are begun and have no state of which anything is known.
    pub without: Vec<usize>,
}

/// What a milestone is in one point of the grid and of the list.
#[derive(Debug, Clone, PartialEq)]
pub struct Lifetimes {
    /// The keys of the point, each with its value.
    pub keys: Vec<(String, String)>,
    /// Runs that were followed.
    pub runs: usize,
    /// Those of them that pass, by the value.
    pub passed: usize,
    /// Cycles to which the last of them was followed.
    pub end: f64,
    /// Part of the runs that passes within them: with the bars late, by the value, and with the bars early.
    pub within: [f64; 3],
    /// Quantiles of the earliest and of the latest cycles.
    pub earliest: Vec<Quantile>,
    pub latest: Vec<Quantile>,
}

impl Histories {
    /// Reads the shards, and the folders of runs that have failed or not ended.
    ///
    /// # Errors
    /// Those of reading shards.
    pub fn of(folder: &Folder, campaign: &Campaign) -> Result<Histories, CampaignError> {
        let wanted =
            |name: &str| States::COLUMNS.contains(&name) || [INDEX, WEAR_ITERATION].contains(&name);
        let found = folder.scan(campaign, &wanted)?;
        let columns: BTreeMap<&str, Vec<Option<f64>>> = found
            .iter()
            .map(|(name, values)| (name.as_str(), numbers(values)))
            .collect();
        let mut runs: BTreeMap<usize, States> = BTreeMap::new();
        if let Some(Nullable::I64(index)) = found.get(INDEX) {
            for (row, index) in index.iter().enumerate() {
                let index = index.and_then(|index| usize::try_from(index).ok());
                let index = index.filter(|index| *index < campaign.rows.len());
                let Some(index) = index else { continue };
                let states = runs.entry(index).or_default();
                states.add(|name| columns.get(name)?.get(row).copied().flatten());
            }
        }
        let (mut uncollected, mut without) = (Vec::new(), Vec::new());
        for (index, state) in folder.states(campaign.rows.len())?.into_iter().enumerate() {
            if runs.contains_key(&index) {
                continue;
            }
            match state {
                State::Waiting => {}
                State::Done => uncollected.push(index),
                State::Begun | State::Failed => match begun(folder, index) {
                    Some(states) => drop(runs.insert(index, states)),
                    None => without.push(index),
                },
            }
        }
        Ok(Histories {
            runs,
            uncollected,
            without,
        })
    }

    /// Number of runs.
    pub fn len(&self) -> usize {
        self.runs.len()
    }

    /// True if no run is known.
    pub fn is_empty(&self) -> bool {
        self.runs.is_empty()
    }

    /// What a milestone is in each point of the grid and of the list; a point whose runs have no such figure is left out.
    pub fn lifetimes(
        &self,
        about: &About,
        campaign: &Campaign,
        milestone: &Milestone,
    ) -> Vec<Lifetimes> {
        let sections = &about.sections[..];
        let fixed: Vec<usize> = (0..sections.len())
            .filter(|section| !is_draw(&sections[*section]))
            .collect();
        let mut points: BTreeMap<Vec<usize>, Vec<usize>> = BTreeMap::new();
        for index in self.runs.keys() {
            let of_row = fixed
                .iter()
                .map(|section| point(sections, *section, *index));
            points.entry(of_row.collect()).or_default().push(*index);
        }
        let keys = |index: usize| -> Vec<(String, String)> {
            let names = fixed.iter().flat_map(|section| &sections[*section].keys);
            let of = |name: &String| {
                let at = campaign.keys.iter().position(|key| key.name == *name)?;
                Some((name.clone(), campaign.rows[index].values[at].text()))
            };
            names.filter_map(of).collect()
        };
        let all = points.into_values().filter_map(|rows| {
            let first = *rows.first()?;
            let runs = rows.iter().map(|row| &self.runs[row]);
            of_runs(runs, milestone, keys(first))
        });
        all.collect()
    }

    /// True if any run has a figure.
    pub fn has(&self, figure: Figure) -> bool {
        self.runs.values().any(|run| run.history(figure).is_ok())
    }
}

/// True of draws, and of seeds, which are names of draws.
fn is_draw(section: &Section) -> bool {
    section.is_random || section.keys.iter().all(|key| key.ends_with("seed"))
}

/// What a run that has not ended has come to; none of one without a state that can be read.
fn begun(folder: &Folder, index: usize) -> Option<States> {
    let root = folder.run(index);
    if !Layout::at(&root).has_record() {
        return None;
    }
    let reader = RunReader::open(Arc::new(RealFileSystem), &root).ok()?;
    let states = States::of(&reader).ok()?;
    states.cycles().map(|_| states)
}

fn of_runs<'a>(
    runs: impl Iterator<Item = &'a States>,
    milestone: &Milestone,
    keys: Vec<(String, String)>,
) -> Option<Lifetimes> {
    let mut lives: [Vec<Life>; 3] = Default::default();
    let mut end = 0.0_f64;
    for run in runs {
        let Ok(history) = run.history(milestone.figure) else {
            continue;
        };
        end = end.max(history.end());
        let level = milestone.level(*history.values.first()?);
        let crossing = history.crossing(level).unwrap_or_default();
        let times = [crossing.earliest, crossing.nominal, crossing.latest];
        for (lives, time) in lives.iter_mut().zip(times) {
            lives.push(Life {
                cycles: time.unwrap_or(history.end()),
                passed: time.is_some(),
            });
        }
    }
    let [earliest, nominal, latest] = lives.each_ref().map(|lives| Survival::of(lives));
    if nominal.runs == 0 {
        return None;
    }
    let quantiles = |of: &Survival| QUANTILES.map(|part| of.quantile(part)).to_vec();
    Some(Lifetimes {
        keys,
        runs: nominal.runs,
        passed: lives[1].iter().filter(|life| life.passed).count(),
        end,
        within: [&latest, &nominal, &earliest].map(|of| of.passed(end)),
        earliest: quantiles(&earliest),
        latest: quantiles(&latest),
    })
}
