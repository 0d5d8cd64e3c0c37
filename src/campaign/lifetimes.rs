//! Cycles after which the runs of a campaign reach a milestone, for each point of its grid and its list.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::collect::{INDEX, WEAR_ITERATION};
use super::error::CampaignError;
use super::findings::{numbers, point};
use super::folder::{CampaignFolder, Section, StoredCampaign};
use super::rows::State;
use super::statistics::QUANTILES;
use super::survival::{Lifetime, Quantile, Survival};
use super::table::Campaign;
use crate::milestones::{Figure, Milestone, States};
use crate::store::{Layout, RealFileSystem, RunReader};
use crate::tables::Nullable;

/// Histories of the runs of a campaign, as far as they have been computed.
pub struct Histories {
    /// States of each run, by row index.
    runs: BTreeMap<usize, States>,
    /// Rows that are complete but not collected.
    pub uncollected: Vec<usize>,
    /// Rows that have started but have no readable state.
    pub without_state: Vec<usize>,
}

/// Lifetimes to a milestone at one point of the grid and the list.
#[derive(Debug, Clone, PartialEq)]
pub struct Lifetimes {
    /// Keys of the point, each with its value.
    pub keys: Vec<(String, String)>,
    /// Number of runs at the point that have the figure of the milestone.
    pub runs: usize,
    /// Number of runs at the point whose nominal value reaches the milestone.
    pub passed: usize,
    /// Largest number of cycles of the runs at the point.
    pub end: f64,
    /// Shares of the runs that reach the milestone within `end` cycles. The first share uses the latest crossing of
    /// each run, the second share the nominal crossing, the third share the earliest crossing. The error bars of a run
    /// determine the latest and the earliest crossing of the run.
    pub share_within: [f64; 3],
    /// Quantiles of the earliest crossings. `latest` has the quantiles of the latest crossings.
    pub earliest: Vec<Quantile>,
    pub latest: Vec<Quantile>,
}

impl Histories {
    /// Reads the shards, and the folders of runs that have failed or are not complete.
    ///
    /// # Errors
    /// The errors of reading shards.
    pub fn of(folder: &CampaignFolder, campaign: &Campaign) -> Result<Histories, CampaignError> {
        let wanted =
            |name: &str| States::COLUMNS.contains(&name) || [INDEX, WEAR_ITERATION].contains(&name);
        let scanned_columns = folder.scan(campaign, &wanted)?;
        let columns: BTreeMap<&str, Vec<Option<f64>>> = scanned_columns
            .iter()
            .map(|(name, values)| (name.as_str(), numbers(values)))
            .collect();
        let mut runs: BTreeMap<usize, States> = BTreeMap::new();
        if let Some(Nullable::I64(index)) = scanned_columns.get(INDEX) {
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
                State::Complete => uncollected.push(index),
                State::Incomplete | State::Failed => match incomplete_run_states(folder, index) {
                    Some(states) => drop(runs.insert(index, states)),
                    None => without.push(index),
                },
            }
        }
        Ok(Histories {
            runs,
            uncollected,
            without_state: without,
        })
    }

    /// Number of runs with a history.
    pub fn len(&self) -> usize {
        self.runs.len()
    }

    /// True if no run has a history.
    pub fn is_empty(&self) -> bool {
        self.runs.is_empty()
    }

    /// Computes the lifetimes at each point of the grid and the list. Points whose runs lack the figure are left out.
    pub fn lifetimes(
        &self,
        about: &StoredCampaign,
        campaign: &Campaign,
        milestone: &Milestone,
    ) -> Vec<Lifetimes> {
        let sections = &about.sections[..];
        let fixed: Vec<usize> = (0..sections.len())
            .filter(|section| !is_draw(&sections[*section]))
            .collect();
        let mut points: BTreeMap<Vec<usize>, Vec<usize>> = BTreeMap::new();
        for index in self.runs.keys() {
            let point_of_row = fixed
                .iter()
                .map(|section| point(sections, *section, *index));
            points
                .entry(point_of_row.collect())
                .or_default()
                .push(*index);
        }
        let keys = |index: usize| -> Vec<(String, String)> {
            let names = fixed.iter().flat_map(|section| &sections[*section].keys);
            let key_with_value = |name: &String| {
                let at = campaign.keys.iter().position(|key| key.name == *name)?;
                Some((name.clone(), campaign.rows[index].values[at].text()))
            };
            names.filter_map(key_with_value).collect()
        };
        let all = points.into_values().filter_map(|rows| {
            let first = *rows.first()?;
            let runs = rows.iter().map(|row| &self.runs[row]);
            lifetimes_of_point(runs, milestone, keys(first))
        });
        all.collect()
    }

    /// Returns true if any run has the figure.
    pub fn has(&self, figure: Figure) -> bool {
        self.runs.values().any(|run| run.history(figure).is_ok())
    }
}

/// Returns true for draws, and for sections that vary only seeds.
fn is_draw(section: &Section) -> bool {
    section.is_random || section.keys.iter().all(|key| key.ends_with("seed"))
}

/// Reads the states of a run that is not complete. Returns `None` if no state can be read.
fn incomplete_run_states(folder: &CampaignFolder, index: usize) -> Option<States> {
    let root = folder.run(index);
    if !Layout::at(&root).has_record() {
        return None;
    }
    let reader = RunReader::open(Arc::new(RealFileSystem), &root).ok()?;
    let states = States::read(&reader).ok()?;
    states.cycles().map(|_| states)
}

fn lifetimes_of_point<'a>(
    runs: impl Iterator<Item = &'a States>,
    milestone: &Milestone,
    keys: Vec<(String, String)>,
) -> Option<Lifetimes> {
    let mut lives: [Vec<Lifetime>; 3] = Default::default();
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
            lives.push(Lifetime {
                cycles: time.unwrap_or(history.end()),
                passed: time.is_some(),
            });
        }
    }
    let [earliest, nominal, latest] = lives.each_ref().map(|lives| Survival::estimate(lives));
    if nominal.runs == 0 {
        return None;
    }
    let quantiles = |survival: &Survival| QUANTILES.map(|part| survival.quantile(part)).to_vec();
    Some(Lifetimes {
        keys,
        runs: nominal.runs,
        passed: lives[1].iter().filter(|life| life.passed).count(),
        end,
        share_within: [&latest, &nominal, &earliest].map(|survival| survival.share_passed(end)),
        earliest: quantiles(&earliest),
        latest: quantiles(&latest),
    })
}
