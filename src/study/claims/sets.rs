//! Which runs belong together, by their scenes.

use super::evidence::Evidence;

/// Runs of the same key, in their order.
fn groups<'a>(runs: &[&'a Evidence], key: impl Fn(&Evidence) -> String) -> Vec<Vec<&'a Evidence>> {
    let mut groups: Vec<(String, Vec<&Evidence>)> = Vec::new();
    for &run in runs {
        let key = key(run);
        match groups.iter_mut().find(|(known, _)| *known == key) {
            Some((_, group)) => group.push(run),
            None => groups.push((key, vec![run])),
        }
    }
    groups.into_iter().map(|(_, group)| group).collect()
}

/// What of a scene is the same in a study of roughness, plasticity and updates, with some of that.
fn key(run: &Evidence, rq: bool, cap: bool, update: bool) -> String {
    let scene = &run.scene;
    let part = |same: bool, text: String| if same { text } else { String::new() };
    [
        scene.base.clone(),
        scene.harmonics.clone(),
        part(rq, format!("{:?}", scene.rq)),
        part(cap, format!("{:?}", scene.pressure_cap)),
        part(update, scene.update.clone()),
    ]
    .join("|")
}

/// Runs that differ by roughness alone, smoothest first; two at least. Those that were never updated, because their scene says so
/// or their criterion never called for it, belong together too: they are what the paper shows.
pub fn by_roughness<'a>(runs: &[&'a Evidence]) -> Vec<Vec<&'a Evidence>> {
    let rough: Vec<&Evidence> = runs
        .iter()
        .copied()
        .filter(|run| run.scene.rq.is_some())
        .collect();
    let mut sets = groups(&rough, |run| key(run, false, true, true));
    let unchanged: Vec<&Evidence> = rough
        .iter()
        .copied()
        .filter(|run| run.updates() == 0)
        .collect();
    sets.extend(groups(&unchanged, |run| key(run, false, true, false)));
    for set in &mut sets {
        set.sort_by(|a, b| {
            let rq = a.scene.rq.partial_cmp(&b.scene.rq);
            rq.expect("roughnesses are finite")
        });
        set.dedup_by(|a, b| a.scene.rq == b.scene.rq);
    }
    sets.retain(|set| set.len() > 1);
    // A set says nothing beside one that has all its runs.
    let names =
        |set: &Vec<&Evidence>| -> Vec<String> { set.iter().map(|run| run.name.clone()).collect() };
    let all: Vec<Vec<String>> = sets.iter().map(names).collect();
    let mut place = 0;
    sets.retain(|set| {
        let own = names(set);
        let within = |(other, larger): (usize, &Vec<String>)| {
            let inside = own.iter().all(|name| larger.contains(name));
            inside && (larger.len() > own.len() || other < place)
        };
        let keep = !all.iter().enumerate().any(within);
        place += 1;
        keep
    });
    sets
}

/// Runs that differ by their criterion of the model update alone, the finest first and none last; two at least.
pub fn by_update<'a>(runs: &[&'a Evidence]) -> Vec<Vec<&'a Evidence>> {
    let vibrating: Vec<&Evidence> = runs
        .iter()
        .copied()
        .filter(|run| run.scene.vibrates)
        .collect();
    let mut sets = groups(&vibrating, |run| key(run, true, true, false));
    for set in &mut sets {
        let size = |run: &Evidence| run.scene.stiffness_change.unwrap_or(f64::INFINITY);
        set.sort_by(|a, b| size(a).total_cmp(&size(b)));
        set.dedup_by(|a, b| a.scene.update == b.scene.update);
    }
    sets.retain(|set| set.len() > 1);
    sets
}

/// Pairs of a rough run without and with a pressure cap that differ by that alone.
pub fn plastic_pairs<'a>(runs: &[&'a Evidence]) -> Vec<[&'a Evidence; 2]> {
    let mut pairs = Vec::new();
    for &plastic in runs
        .iter()
        .filter(|run| run.scene.pressure_cap.is_some() && !run.scene.sphere)
    {
        let elastic = runs.iter().find(|run| {
            run.scene.pressure_cap.is_none()
                && key(run, true, false, true) == key(plastic, true, false, true)
        });
        pairs.extend(elastic.map(|&elastic| [elastic, plastic]));
    }
    pairs
}

/// Spheres that differ by their pressure cap alone: that without one first, then from the largest cap down; two at least.
pub fn capped_spheres<'a>(runs: &[&'a Evidence]) -> Vec<Vec<&'a Evidence>> {
    let spheres: Vec<&Evidence> = runs
        .iter()
        .copied()
        .filter(|run| run.scene.sphere)
        .collect();
    let mut sets = groups(&spheres, |run| key(run, true, false, true));
    for set in &mut sets {
        let cap = |run: &Evidence| run.scene.pressure_cap.unwrap_or(f64::INFINITY);
        set.sort_by(|a, b| cap(b).total_cmp(&cap(a)));
        set.dedup_by(|a, b| a.scene.pressure_cap == b.scene.pressure_cap);
    }
    sets.retain(|set| set.len() > 1 && set[0].scene.pressure_cap.is_none());
    sets
}

/// Runs with the harmonics of the paper (0 to 3), each with one of more harmonics that differs by that alone.
pub fn by_harmonics<'a>(runs: &[&'a Evidence]) -> Vec<[&'a Evidence; 2]> {
    const OF_THE_PAPER: &str = "[0,1,2,3]";
    let same = |run: &Evidence| {
        let mut run = run.scene.clone();
        run.harmonics.clear();
        format!(
            "{}|{:?}|{:?}|{}",
            run.base, run.rq, run.pressure_cap, run.update
        )
    };
    let mut pairs = Vec::new();
    for &few in runs
        .iter()
        .filter(|run| run.scene.harmonics == OF_THE_PAPER)
    {
        let many = runs.iter().filter(|many| {
            many.scene.harmonics.len() > few.scene.harmonics.len() && same(many) == same(few)
        });
        let most = many.max_by_key(|many| many.scene.harmonics.len());
        pairs.extend(most.map(|&many| [few, many]));
    }
    pairs
}
