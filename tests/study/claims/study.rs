//! Artificial study in which each claim holds.

use std::collections::BTreeMap;

use fretwear::study::claims::{
    Columns, ElementDistribution, Evidence, HysteresisLoop, Moment, Setting, WornSurface,
};

pub const CYCLES: [f64; 8] = [0.0, 2e4, 1e5, 1e6, 2e6, 5e6, 8e6, 1e7];
/// Area of the joint \[m²\].
const AREA: f64 = 1.5e-3;
/// Worn volume per energy \[m³/J\].
const ALPHA: f64 = 2e-15;
const FINITE: f64 = 0.824;

/// Exponential change from one value to another with the time constant `length` in cycles.
fn settling(from: f64, to: f64, length: f64) -> impl Fn(f64) -> f64 {
    move |n| to + (from - to) * (-n / length).exp()
}

pub fn columns<const N: usize>(columns: [(&str, Vec<f64>); N]) -> Columns {
    columns
        .map(|(name, values)| (name.to_owned(), values))
        .into()
}

/// Hysteresis loop with a given energy: stick with `slope` up to the part `sharp` of `force`, then partial slip, then gross slip.
pub fn sliding_loop(energy: f64, force: f64, slope: f64, sharp: f64) -> HysteresisLoop {
    let area = |cycle: &HysteresisLoop| {
        let (u, f) = (&cycle.displacement, &cycle.load);
        let next = |k: usize| (k + 1) % u.len();
        let parts = (0..u.len()).map(|k| u[k] * f[next(k)] - u[next(k)] * f[k]);
        0.5 * parts.sum::<f64>().abs()
    };
    // The additional energy is gross slip at both ends.
    let least = 2.0 * force / slope;
    let rest = energy - area(&loop_of(least, force, slope, sharp));
    loop_of(least + rest / (4.0 * force), force, slope, sharp)
}

fn loop_of(amplitude: f64, force: f64, slope: f64, sharp: f64) -> HysteresisLoop {
    let most = sharp * force;
    let stick = (force + most) / slope;
    let slip = stick + 3.0 * (force - most) / slope;
    let half = [(0.0, force), (stick, -most), (slip, -force)];
    let back = half.map(|(way, load)| (amplitude - way, load));
    let forth = half.map(|(way, load)| (way - amplitude, -load));
    let (displacement, load) = back.into_iter().chain(forth).unzip();
    HysteresisLoop { displacement, load }
}

/// Run with a roughness in µm.
pub fn run(name: &str, rq: f64) -> Evidence {
    let series = |value: &dyn Fn(f64) -> f64| CYCLES.map(value).to_vec();
    let kn = settling(4.8e9 - 0.18e9 * rq, 5.0e9 - 2e6 * rq, 2e5);
    let rate = settling(1e-18 * (600.0 + 40.0 * rq), 1e-18 * (480.0 + 2.0 * rq), 3e5);
    let unworn_area = 0.2 / (1.0 + rq);
    let area = move |n: f64| match rq {
        ..2.0 => settling(unworn_area, 0.9, 3e5)(n),
        _ => unworn_area + 0.4 * n / 1e7,
    };
    let volumes: Vec<f64> = series(&|n| 5e-16 * n);
    let volume = volumes[volumes.len() - 1];
    let mut n_cycles = vec![0.0];
    n_cycles.extend(CYCLES.windows(2).map(|pair| pair[1] - pair[0]));
    let mut updated = vec![0.0; CYCLES.len()];
    updated[0] = 1.0;
    let all = |value: f64| vec![value; CYCLES.len()];
    let summary = columns([
        ("cycles", CYCLES.to_vec()),
        ("n_cycles", n_cycles),
        ("wear_rate", series(&rate)),
        ("dissipated_energy", series(&|n| rate(n) / ALPHA)),
        (
            "dissipated_energy_total",
            volumes.iter().map(|v| v / ALPHA).collect(),
        ),
        ("mean_height", volumes.iter().map(|v| -v / AREA).collect()),
        ("wear_volume", volumes),
        ("contact_area_fraction", series(&area)),
        ("max_pressure", series(&settling(3e9, 1e8, 1e6))),
        ("kn", series(&kn)),
        ("kt", series(&|n| FINITE * kn(n))),
        ("rq", series(&|n| 1e-6 * rq * (1.0 - 0.5 * n / 1e7))),
        ("sk", series(&settling(-0.03, -1.0, 1e5))),
        ("ku", series(&settling(2.95, 5.0, 1e6))),
        ("updated", updated),
        ("error_normal", all(1e-7)),
        ("error_tangential", all(1e-4)),
    ]);
    Evidence {
        name: name.to_owned(),
        scene: setting(rq),
        done: true,
        area: Some(AREA),
        summary,
        response: columns([
            ("displacement_amplitude", all(1e-6 * (8.0 + 0.7 * rq))),
            ("displacement_spread", all(0.02)),
            ("input_energy", all(0.6)),
            ("friction_energy", all(0.2)),
            ("sticking_elements", all(50.0)),
        ]),
        worn_response: columns([
            ("cycles", vec![0.0, 1e7]),
            (
                "resonance_frequency",
                vec![950.0 - 2.0 * rq, 965.0 - 0.2 * rq],
            ),
            ("peak_frequency", vec![950.0 - 2.0 * rq, 965.0 - 0.02 * rq]),
            (
                "peak_amplitude",
                vec![1e-6 * (80.0 - 2.0 * rq), 1e-6 * (87.0 - 0.1 * rq)],
            ),
            ("friction_energy", vec![0.2 + 1e-3 * rq, 0.19]),
            ("input_energy", vec![0.25, 0.26]),
            ("viscous_energy", vec![0.05, 0.07]),
            ("wear_volume", vec![0.0, volume]),
            ("place", vec![0.0, (CYCLES.len() - 1) as f64]),
        ]),
        step: Columns::new(),
        formless: columns([
            ("rq", series(&|n| 1e-6 * rq * (1.0 - 0.5 * n / 1e7))),
            ("sk", series(&settling(-0.03, -1.0, 1e5))),
            ("ku", series(&settling(2.95, 5.0, 1e6))),
        ]),
        local: None,
        // 231 steps of 0.1 µm
        depth_rate: all(2.31e-12),
        worn: Some(WornSurface {
            least_growth: 0.0,
            deepest: 2e-5,
            volume,
            never_touched: 1000,
            never_touched_depth: 0.0,
            rule_error: 0.0,
        }),
        first: Moment {
            high_pressure: 2e9,
            mean_pressure: 2e8,
            section_peaks: vec![2e9; 5],
            share_at_cap: 0.0,
            load: 3e4,
            peak_dissipation: 0.5,
            hysteresis: Some(sliding_loop(rate(0.0) / ALPHA, 1.8e4, 3e9, 0.8)),
            normal_load: Some([3e4, 100.0]),
            displacement: Some([1e-6, 1e-5]),
            fine_over_elements: BTreeMap::new(),
            moments: Some([10.0, 1.0]),
        },
        last: Moment {
            high_pressure: 5e7,
            mean_pressure: 2e7,
            section_peaks: vec![5e7; 5],
            load: 3e4,
            peak_dissipation: 0.5,
            hysteresis: Some(sliding_loop(rate(1e7) / ALPHA, 1.8e4, 4e9, 0.95)),
            ..Moment::default()
        },
        sliding: {
            let mut sliding = all(1.0);
            sliding[0] = 0.989;
            sliding
        },
        seconds: 60.0,
        modes: Some(36),
    }
}

fn setting(rq: f64) -> Setting {
    Setting {
        base: "lap joint".to_owned(),
        rq: Some(1e-6 * rq),
        correlation_length: Some([5e-4; 2]),
        law: "total, by_load".to_owned(),
        seed: Some(1),
        side: Some(0.04),
        length: Some(0.04),
        update: "never".to_owned(),
        vibrates: true,
        harmonics: "[0,1,2,3]".to_owned(),
        coefficient: Some(ALPHA),
        cycles: Some(10_000_000),
        friction_coefficient: Some(0.6),
        normal_load: 3e4,
        poisson_ratio: Some(0.3),
        tolerances: [1e-6, 1e-3],
        ..Setting::default()
    }
}

/// Run with an update criterion and one update.
fn updated(name: &str, change: f64) -> Evidence {
    let mut run = run(name, 5.0);
    run.scene.stiffness_change = Some(change);
    run.scene.update = format!("{change}");
    let flags = run.summary.get_mut("updated").expect("a column");
    flags[3] = 1.0;
    // The cycle before an update dissipates more energy than the cycle after it.
    let energies = run.summary["dissipated_energy"].iter();
    let end_energy = energies.map(|energy| 1.05 * energy).collect();
    run.step = columns([("end_energy", end_energy)]);
    run
}

fn plastic() -> Evidence {
    let mut run = run("plastic", 5.0);
    run.scene.pressure_cap = Some(6e8);
    run.first.share_at_cap = 0.5;
    let mut scale = |name: &str, factors: [f64; 2]| {
        let values = run.summary.get_mut(name).expect("a column");
        for (value, factor) in values.iter_mut().zip(factors) {
            *value *= factor;
        }
    };
    scale("dissipated_energy", [1.1, 1.1]);
    scale("contact_area_fraction", [1.02, 1.0]);
    scale("kn", [0.98, 1.0]);
    let pressure = run.summary.get_mut("max_pressure").expect("a column");
    pressure.iter_mut().for_each(|p| *p = p.min(6e8));
    run
}

/// Published explicit run: 231 steps, each with the number of cycles for a depth of 0.1 µm.
fn explicit() -> Evidence {
    let mut run = run("explicit", 5.0);
    run.scene.explicit = Some(1e-7);
    let steps: Vec<f64> = (0..231).map(|k| 43_000.0 + 3.0 * f64::from(k)).collect();
    run.depth_rate = steps.iter().map(|n| 1e-7 / (n + 0.5)).collect();
    run.depth_rate.push(1e-12);
    let mut cycles = vec![0.0];
    cycles.extend(steps.iter().scan(0.0, |sum, n| {
        *sum += n;
        Some(*sum)
    }));
    // The tests use only the steps of this run.
    run.summary = columns([
        ("cycles", cycles),
        ("n_cycles", [&[0.0], &steps[..]].concat()),
        ("wear_volume", vec![0.0, 1e-10]),
        ("dissipated_energy_total", vec![0.0, 1e-10 / ALPHA]),
    ]);
    let worn = run.worn.as_mut().expect("it wears");
    (worn.volume, worn.deepest) = (1e-10, 2.2e-5);
    run
}

fn sphere(name: &str, cap: Option<f64>, area: f64) -> Evidence {
    let mut run = Evidence {
        name: name.to_owned(),
        done: true,
        ..Evidence::default()
    };
    (run.scene.base, run.scene.sphere) = ("sphere".to_owned(), true);
    (run.scene.pressure_cap, run.scene.normal_load) = (cap, 90.0);
    run.scene.tolerances = [1e-6, 1e-3];
    run.first.load = 90.0;
    run.first.share_at_cap = if cap.is_some() { 0.2 } else { 0.0 };
    run.summary = columns([
        ("max_pressure", vec![cap.unwrap_or(9e8)]),
        ("contact_area_fraction", vec![area]),
        ("error_normal", vec![1e-7]),
    ]);
    run
}

/// Run with harmonics up to a given order.
fn finer(name: &str, highest: usize) -> Evidence {
    let mut run = run(name, 5.0);
    let orders: Vec<String> = (0..=highest).map(|order| order.to_string()).collect();
    run.scene.harmonics = format!("[{}]", orders.join(","));
    run
}

/// Run whose contact elements have individual stiffnesses.
fn tangent() -> Evidence {
    let mut run = updated("tangent", 0.1);
    (run.scene.law, run.scene.tangent) = ("tangent".to_owned(), true);
    let local = |kn: [f64; 3], density: f64| ElementDistribution {
        kn: kn.into(),
        density: vec![density; 3],
    };
    run.local = Some([local([1e7; 3], 5e13), local([0.8e7, 0.8e7, 3e7], 1e13)]);
    run
}

/// Runs for all claims.
pub fn all() -> Vec<Evidence> {
    vec![
        run("rq5", 5.0),
        run("rq05", 0.5),
        run("rq1", 1.0),
        run("rq10", 10.0),
        plastic(),
        updated("u05", 0.05),
        updated("u10", 0.1),
        updated("u20", 0.2),
        explicit(),
        finer("finer", 5),
        finer("finest", 7),
        tangent(),
        sphere("sphere", None, 0.1),
        sphere("sphere600", Some(6e8), 0.11),
        sphere("sphere450", Some(4.5e8), 0.13),
    ]
}
