//! Roles of runs in a study, from their scenes.

use super::evidence::Evidence;

/// Roughness of most figures of the paper \[m\].
pub const MAIN: f64 = 5e-6;
/// Harmonics of the paper.
const HARMONICS: &str = "[0,1,2,3]";

/// Runs of one joint with one law of contact elements, by their roles.
#[derive(Debug, Clone, Default)]
pub struct Study<'a> {
    /// Name in words: law of contact elements, update, and seed if there are several.
    pub name: String,
    /// Elastic runs that differ by roughness, smoothest first. The series omits runs with model updates if the study
    /// has runs without model updates.
    pub roughness_series: Vec<&'a Evidence>,
    /// Main run, which most figures show: Rq 5 µm, or the nearest roughness.
    pub main: Option<&'a Evidence>,
    /// Main run with the explicit algorithm.
    pub explicit: Option<&'a Evidence>,
    /// Main run without and with a pressure cap, or runs of another roughness if only that has both.
    pub plastic: Option<[&'a Evidence; 2]>,
    /// Main runs with updates, the finest criterion first.
    pub updated: Vec<&'a Evidence>,
    /// Main runs with more harmonics, fewest first.
    pub harmonics: Vec<&'a Evidence>,
    /// Run with updates of contact elements with individual stiffness.
    pub tangent_run: Option<&'a Evidence>,
    /// Runs of spheres with different pressure caps: the run without a cap first, then the runs by decreasing cap.
    pub spheres: Vec<&'a Evidence>,
    /// All runs of the study.
    pub all: Vec<&'a Evidence>,
}

/// Groups runs by a key, in their order.
fn groups<'a>(runs: &[&'a Evidence], key: impl Fn(&Evidence) -> String) -> Vec<Vec<&'a Evidence>> {
    let mut groups: Vec<(String, Vec<&Evidence>)> = Vec::new();
    for &run in runs {
        let key = key(run);
        match groups.iter_mut().find(|(other, _)| *other == key) {
            Some((_, group)) => group.push(run),
            None => groups.push((key, vec![run])),
        }
    }
    groups.into_iter().map(|(_, group)| group).collect()
}

fn is_same(a: Option<f64>, b: Option<f64>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => (a / b - 1.0).abs() < 1e-6,
        (a, b) => a.is_none() && b.is_none(),
    }
}

fn is_never(run: &Evidence) -> bool {
    run.scene.update == "never"
}

/// Returns the studies among runs, in the order of their first runs.
///
/// A study consists of the runs of one joint, one law of contact elements and one seed. The paper's runs have no model
/// updates. If some groups of runs contain a run without model updates, only these groups are studies. Runs of other
/// laws then belong to the studies of the same joint. Spheres belong to all studies.
pub fn studies<'a>(runs: &[&'a Evidence]) -> Vec<Study<'a>> {
    let (spheres, joints): (Vec<&Evidence>, Vec<&Evidence>) =
        runs.iter().copied().partition(|run| run.scene.sphere);
    let mut all = groups(&joints, |run| {
        let scene = &run.scene;
        format!("{}|{}|{:?}", scene.base, scene.law, scene.seed)
    });
    let has_setting = |group: &Vec<&Evidence>| group.iter().any(|run| is_never(run));
    let mut other_runs: Vec<&Evidence> = Vec::new();
    if all.iter().any(has_setting) {
        let (settings, others): (Vec<_>, Vec<_>) = all.into_iter().partition(has_setting);
        all = settings;
        other_runs = others.into_iter().flatten().collect();
    }
    if all.is_empty() && !spheres.is_empty() {
        all.push(Vec::new());
    }
    let seeds = groups(&joints, |run| format!("{:?}", run.scene.seed)).len() > 1;
    all.into_iter()
        .map(|group| study(&group, &other_runs, &spheres, seeds))
        .collect()
}

fn study<'a>(
    group: &[&'a Evidence],
    other_runs: &[&'a Evidence],
    spheres: &[&'a Evidence],
    seeds: bool,
) -> Study<'a> {
    let update = match group.iter().any(|run| is_never(run)) {
        true => "never",
        false => group
            .first()
            .map_or("never", |run| run.scene.update.as_str()),
    };
    let has_paper_harmonics =
        |run: &&&Evidence| run.scene.harmonics.is_empty() || run.scene.harmonics == HARMONICS;
    // If no run has the paper's harmonics, the first run determines them.
    let reference = group.iter().find(has_paper_harmonics).or(group.first());
    let harmonics = reference.map_or("", |run| run.scene.harmonics.as_str());
    let plain: Vec<&Evidence> = (group.iter().copied())
        .filter(|run| run.scene.harmonics == harmonics)
        .collect();
    let mut rough: Vec<&Evidence> = (plain.iter().copied())
        .filter(|run| run.scene.update == update && run.scene.pressure_cap.is_none())
        .filter(|run| run.cycles().is_some() || run.scene.rq.is_some())
        .collect();
    // Of two runs with the same roughness, the one that is not explicit is kept.
    rough.sort_by(|a, b| {
        let key = |run: &Evidence| {
            (
                run.scene.rq.unwrap_or(f64::INFINITY),
                run.scene.explicit.is_some(),
            )
        };
        key(a).partial_cmp(&key(b)).expect("roughnesses are finite")
    });
    rough.dedup_by(|a, b| is_same(a.scene.rq, b.scene.rq));
    let distance = |run: &Evidence| {
        run.scene
            .rq
            .map_or(f64::INFINITY, |rq| (rq / MAIN).ln().abs())
    };
    let main = (rough.iter().copied()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
    let rq = main.and_then(|main| main.scene.rq);
    let is_main = |run: &Evidence| is_same(run.scene.rq, rq);
    let main_runs: Vec<&Evidence> = plain.iter().copied().filter(|run| is_main(run)).collect();
    let elastic = |run: &&Evidence| run.scene.pressure_cap.is_none();
    let find = |fits: &dyn Fn(&Evidence) -> bool| main_runs.iter().copied().find(|run| fits(run));
    let explicit = find(&|run| {
        run.scene.explicit.is_some()
            && run.scene.update == update
            && run.scene.pressure_cap.is_none()
    });
    let mut capped_runs: Vec<&Evidence> = (plain.iter().copied())
        .filter(|run| run.scene.update == update && run.scene.pressure_cap.is_some())
        .collect();
    capped_runs.sort_by_key(|run| !is_main(run));
    let plastic = capped_runs.iter().find_map(|plastic| {
        let has_same_rq = |run: &&&Evidence| is_same(run.scene.rq, plastic.scene.rq);
        rough
            .iter()
            .find(has_same_rq)
            .map(|elastic| [*elastic, *plastic])
    });
    let mut updated: Vec<&Evidence> = (main_runs.iter().copied())
        .filter(elastic)
        .filter(|run| !is_never(run) && run.scene.vibrates && run.scene.explicit.is_none())
        .collect();
    let change = |run: &Evidence| run.scene.stiffness_change.unwrap_or(f64::INFINITY);
    updated.sort_by(|a, b| change(a).total_cmp(&change(b)));
    updated.dedup_by(|a, b| a.scene.update == b.scene.update);
    let orders = |run: &Evidence| run.scene.harmonics.matches(',').count();
    let mut more: Vec<&Evidence> = (group.iter().copied())
        .filter(elastic)
        .filter(|run| is_main(run) && run.scene.update == update)
        .filter(|run| main.is_some_and(|main| orders(run) > orders(main)))
        .collect();
    more.sort_by_key(|run| orders(run));
    let base = main.map_or("", |main| main.scene.base.as_str());
    let local = (group.iter().chain(other_runs).copied())
        .filter(|run| run.scene.base == base && run.scene.tangent)
        .find(|run| run.local.is_some());
    let spheres = sphere_series(spheres);
    let parts = [explicit, local].into_iter().flatten();
    let mut all: Vec<&Evidence> = rough.clone();
    all.extend(plastic.map(|[_, plastic]| plastic));
    for run in parts.chain(updated.iter().chain(&more).chain(&spheres).copied()) {
        if !all.iter().any(|listed| std::ptr::eq(*listed, run)) {
            all.push(run);
        }
    }
    Study {
        name: name(main, update, seeds),
        roughness_series: rough,
        main,
        explicit,
        plastic,
        updated,
        harmonics: more,
        tangent_run: local,
        spheres,
        all,
    }
}

fn name(main: Option<&Evidence>, update: &str, seeds: bool) -> String {
    let Some(main) = main else {
        return "spheres".to_owned();
    };
    let mut words = match main.scene.law.as_str() {
        "" => vec!["motion as given".to_owned()],
        law => vec![law.to_owned()],
    };
    if main.scene.vibrates {
        words.push(match update {
            "never" => "never updated".to_owned(),
            _ => main
                .scene
                .stiffness_change
                .map_or("updated".to_owned(), |change| {
                    format!("updated at {}", super::words::percent(change))
                }),
        });
    }
    if seeds && let Some(seed) = main.scene.seed {
        words.push(format!("seed {seed}"));
    }
    words.join("; ")
}

/// Returns spheres that only differ by their pressure cap: without a cap first, then by decreasing cap. The list is
/// empty if there are fewer than two.
fn sphere_series<'a>(spheres: &[&'a Evidence]) -> Vec<&'a Evidence> {
    let mut sets = groups(spheres, |run| run.scene.base.clone());
    for set in &mut sets {
        let cap = |run: &Evidence| run.scene.pressure_cap.unwrap_or(f64::INFINITY);
        set.sort_by(|a, b| cap(b).total_cmp(&cap(a)));
        set.dedup_by(|a, b| a.scene.pressure_cap == b.scene.pressure_cap);
    }
    sets.retain(|set| set.len() > 1 && set[0].scene.pressure_cap.is_none());
    sets.into_iter().next().unwrap_or_default()
}
