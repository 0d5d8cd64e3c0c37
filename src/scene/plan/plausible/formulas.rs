//! Formulas of figures that are too long for a row of the table of figures.

use std::f64::consts::{PI, TAU};

use super::say::{
    Figure, GPA, MM, N, N_PER_UM, UM, number, over, over_estimate, part, short, worded,
};
use super::setup::{NORMAL, Setup};
use crate::material::Elastic;
use crate::structure::resonator::Resonator;
use crate::wear::Channel;

/// Longest side of a joint \[m\].
pub const LONGEST_SIDE: f64 = 2.0;

/// Absolute value of Poisson's ratio, with all digits.
pub fn poisson(body: Elastic) -> Option<Figure> {
    let size = body.poisson_ratio.abs();
    worded(size, format!("{size}"))
}

/// Speed of longitudinal waves in a bar.
pub fn speed_of_sound(setup: &Setup) -> Option<Figure> {
    let material = setup.resonator?.material;
    let square = material.elastic.youngs_modulus / material.density;
    number(square.sqrt())
}

/// Stiffness of a single node of the mesh with all others fixed, over Young's modulus and the node distance.
pub fn node_stiffness(setup: &Setup) -> Option<Figure> {
    let import = setup.recipe.structure.as_ref()?.source.import()?;
    let modulus = setup.recipe.contact()?.least_modulus();
    number(import.apparent_modulus? / modulus)
}

/// Number of lengths of a resonator.
pub const LENGTHS: usize = 11;

/// Length of a resonator over the side of its joint. The index `place` counts the lengths of the resonator in ascending
/// order.
pub fn dimension(setup: &Setup, place: usize) -> Option<Figure> {
    let resonator = setup.resonator?;
    let mut lengths: [_; LENGTHS] = [
        ("structure.depth", resonator.depth),
        ("structure.stub_length", resonator.stub_length),
        ("structure.gap_length", resonator.gap_length),
        ("structure.block_length", resonator.block_length),
        ("structure.block_height", resonator.block_height),
        ("structure.leaf_thickness", resonator.leaf_thickness),
        ("structure.window_length", resonator.window_length),
        ("structure.window_height", resonator.window_height),
        ("structure.frame_height", resonator.frame_height),
        ("structure.wall_thickness", resonator.wall_thickness),
        ("structure.head_thickness", resonator.head_thickness),
    ];
    lengths.sort_by(|a, b| a.1.total_cmp(&b.1));
    let (key, length) = lengths[place];
    let figure = over(length, joint_side(resonator), MM)?;
    let key = Some(key);
    Some(Figure { key, ..figure })
}

fn joint_side(resonator: &Resonator) -> f64 {
    (resonator.lap_length * resonator.arm_height).sqrt()
}

/// Stiffness of a body as wide as the joint of a resonator \[N/m\].
pub fn body_stiffness(setup: &Setup) -> Option<f64> {
    let resonator = setup.resonator?;
    Some(resonator.material.elastic.youngs_modulus * joint_side(resonator))
}

/// Number of map points along the sides of the joint.
pub fn points(setup: &Setup) -> Option<Figure> {
    let [x, y] = setup.map?.fit.points.map(rounded);
    let words = format!("{} × {}", short(x), short(y));
    worded(x.min(y), words)
}

/// Spacing of the map points along x over the spacing along y.
pub fn aspect(setup: &Setup) -> Option<Figure> {
    number(rounded(setup.map?.fit.aspect))
}

/// Bounds of [`aspect`]. Only a surface map that states no spacing must have nearly square cells.
pub fn aspect_bounds(setup: &Setup) -> Option<[f64; 2]> {
    setup.map?.fit.is_assumed.then_some([0.5, 2.0])
}

/// Autocorrelation of a map at a distance of two points, along the axis with the smaller value.
pub fn correlation(setup: &Setup) -> Option<Figure> {
    let both = setup.map?.fit.correlation.into_iter().flatten();
    number(both.min_by(f64::total_cmp)?)
}

/// Rounds a sum of spacings, which is not exact.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// Side of the joint that is further outside its bounds.
pub fn side(setup: &Setup) -> Option<Figure> {
    let [x, y] = setup.face?.surface.size;
    let longest = Some(x.max(y)).filter(|side| *side > LONGEST_SIDE);
    let words = format!("{} × {} mm", short(x * 1e3), short(y * 1e3));
    worded(longest.unwrap_or(x.min(y)), words)
}

/// Diameter of the hole over the side of a cell.
pub fn hole(setup: &Setup) -> Option<Figure> {
    let face = setup.face?;
    over(face.surface.cells.hole_diameter()?, face.cell(), MM)
}

/// Bounds of Rq: the size of an atom, and the side of the joint \[m\]. A face that is exactly flat in its file has no
/// lower bound.
pub fn rq_bounds(setup: &Setup) -> Option<[f64; 2]> {
    let face = setup.face?;
    let least = if face.rq? == 0.0 { 0.0 } else { 1e-10 };
    Some([least, face.side()])
}

/// Cells per shorter correlation length, and longer correlation lengths per side.
pub fn asperities(setup: &Setup) -> Option<[f64; 2]> {
    let surface = setup.face?.surface;
    let (grid, [x, y]) = (surface.grid(), surface.size);
    let [along_x, along_y] = surface.heights.correlation_length()?;
    let cells = (along_x / grid.dx).min(along_y / grid.dy);
    let many = (x / along_x).min(y / along_y);
    Some([cells, many])
}

/// Mean pressure over contact modulus and slope. A small value is half the touching fraction of the face.
pub fn closure(setup: &Setup) -> Option<f64> {
    let face = setup.face?;
    Some(face.mean_pressure()? / face.modulus() / face.slope?)
}

/// Number of cells in contact.
pub fn touching(setup: &Setup) -> Option<Figure> {
    let face = setup.face?;
    let capped = face.contact.conditions.pressure_cap.map_or(0.0, |cap| {
        face.contact.conditions.normal_load / (cap * face.surface.grid().cell_area())
    });
    let kept = face.surface.kept as f64;
    let cells = (2.0 * closure(setup)? * kept).min(kept).max(capped);
    worded(cells, format!("some {} of {kept}", short(cells)))
}

/// Contact radius of a sphere under a given load \[m\].
pub fn hertz_radius(setup: &Setup) -> Option<f64> {
    let face = setup.face?;
    face.mean_pressure().and(face.contact_radius())
}

/// Peak pressure of the Hertz contact over the contact modulus.
pub fn hertz_pressure(setup: &Setup) -> Option<Figure> {
    let (face, radius) = (setup.face?, hertz_radius(setup)?);
    let peak = 1.5 * face.contact.conditions.normal_load / (PI * radius * radius);
    part(peak, face.modulus(), GPA)
}

/// Cells per Hertz contact radius.
pub fn hertz_cells(setup: &Setup) -> Option<Figure> {
    let grid = setup.face?.surface.grid();
    number(hertz_radius(setup)? / grid.dx.max(grid.dy))
}

/// Stiffness of the bolt over the stiffness of bodies as wide as the joint.
pub fn bolt(setup: &Setup) -> Option<Figure> {
    let face = setup.face?;
    let bodies = face.modulus() * face.width();
    over_estimate(face.contact.conditions.bolt_stiffness?, bodies, N_PER_UM)
}

/// Coefficient of friction.
pub fn friction(setup: &Setup) -> Option<Figure> {
    let [mu, limit] = setup.friction()?;
    let words = format!("{mu} (friction holds {} N)", short(limit));
    worded(mu, words)
}

/// Largest force \[N\] and moment \[N m\] of a motion.
fn largest(setup: &Setup) -> [f64; 2] {
    let largest = |channel: &Channel| match channel {
        Channel::Force(values) => values.iter().fold(0.0f64, |m, v| m.max(v.abs())),
        Channel::Displacement(_) => 0.0,
    };
    let motion = setup.motion;
    let forces = motion.drive.iter().map(largest);
    let moment = motion.rotation.as_ref().map_or(0.0, largest);
    [forces.fold(0.0, f64::max), moment]
}

/// Largest force over the friction limit.
pub fn pull(setup: &Setup) -> Option<Figure> {
    let limit = setup.face?.limit().filter(|limit| *limit > 0.0)?;
    let [force, _] = largest(setup);
    number(force / limit).filter(|_| force > 0.0)
}

/// Largest moment over the friction limit, if there is no force.
pub fn twist(setup: &Setup) -> Option<Figure> {
    let face = setup.face?;
    let limit = face.limit().filter(|limit| *limit > 0.0)?;
    let [force, moment] = largest(setup);
    // The friction moment of a disc as wide as the joint has an arm of two thirds of its radius.
    let arm = face.width() / 3.0;
    number(moment / (limit * arm)).filter(|_| force == 0.0 && moment > 0.0)
}

/// Mean load of a motion over `contact.normal_load`, if they differ.
pub fn mean_load(setup: &Setup) -> Option<Figure> {
    let (mean, load) = (setup.motion.mean_load, setup.given_load?);
    let is_own = (mean / load - 1.0).abs() > 1e-6;
    over(mean, load, N).filter(|_| load > 0.0 && is_own)
}

/// Estimated motion at which the joint begins to slide \[m\].
pub fn onset(setup: &Setup) -> Option<f64> {
    let face = setup.face?;
    let mu = face.contact.friction_coefficient.filter(|mu| *mu > 0.0)?;
    // Asperities deform by µ Rq / 2, and the bodies under them as under a punch as wide as the contact.
    let asperities = mu * face.rq.unwrap_or(0.0) / 2.0;
    Some(asperities + mu * face.contact.conditions.normal_load / (face.modulus() * face.width()))
}

/// Damping ratio of the dashpots of an oscillator. Without a spring there is no ratio.
pub fn dashpots(setup: &Setup) -> Option<Figure> {
    let ratio = setup.oscillator?.dashpot_ratio();
    number(ratio).filter(|_| ratio.is_finite())
}

/// Sum of the harmonic forces that load the friction contact, and the friction limit \[N\].
pub fn forces(setup: &Setup) -> Option<[f64; 2]> {
    let response = setup.response?;
    let [_, limit] = setup.friction().filter(|[_, limit]| *limit > 0.0)?;
    // A mass that moves only along the normal causes no friction.
    let causes_friction = |axis: usize| setup.oscillator.is_none() || axis != NORMAL;
    let harmonic = response.forces.iter();
    let harmonic = harmonic.filter(|force| force.harmonic > 0 && causes_friction(force.port.axis));
    let ground = response.base.filter(|base| causes_friction(base.axis));
    let ground = ground.and_then(|base| {
        let source = &setup.recipe.structure.as_ref()?.source;
        let [mass, _, _] = source.oscillator_along(base.axis)?;
        Some(base.force(mass, response.frequencies_in_force()?[1]))
    });
    let force = harmonic.map(|f| f.amplitude.abs()).sum::<f64>() + ground.unwrap_or(0.0);
    (force != 0.0 || setup.oscillator.is_none()).then_some([force, limit])
}

/// The force at resonance over the friction limit. `None` if the damping depends on the frequency, or if the frequency
/// is given.
pub fn at_resonance(setup: &Setup) -> Option<Figure> {
    let [force, limit] = forces(setup)?;
    let (response, axis) = (setup.response?, setup.oscillator);
    if response.at_frequency.is_some() {
        return None;
    }
    let dashpots = axis.map_or(0.0, |axis| axis.dashpot_ratio());
    let damping = response.damping_ratio + 0.5 * response.loss_factor + dashpots;
    if damping == 0.0 || response.rayleigh.is_some() {
        return None;
    }
    // A resonance multiplies the force by 1 / 2ζ. The springs carry a part of it.
    let share = axis.map_or(1.0, |axis| axis.contact / (axis.contact + axis.stiffness));
    number(force / limit * share * (0.5 / damping).max(1.0))
}

/// Contact stiffness of an oscillator over the stiffness of its springs.
pub fn over_springs(setup: &Setup) -> Option<Figure> {
    let axis = setup.oscillator.filter(|axis| axis.stiffness > 0.0)?;
    setup.springs()?;
    over(axis.contact, axis.stiffness, N_PER_UM)
}

/// Frequency range of the search for a resonance; `None` if the frequency is given.
fn range(setup: &Setup) -> Option<[f64; 2]> {
    let response = setup
        .response
        .filter(|response| response.at_frequency.is_none());
    response?.frequency
}

/// Distance of the frequency range from the resonances of an oscillator, without contact and stuck, as a ratio.
pub fn resonance_distance_oscillator(setup: &Setup) -> Option<Figure> {
    let (axis, [low, high]) = (setup.oscillator?, range(setup)?);
    let frequency = |stiffness: f64| (stiffness / axis.mass).sqrt() / TAU;
    let (free, stuck) = (
        frequency(axis.stiffness),
        frequency(axis.stiffness + axis.contact),
    );
    let ratio_to_resonance = match (high < free, low > stuck) {
        (true, _) => high / free,
        (_, true) => low / stuck,
        _ => 1.0,
    };
    let is_sprung = stuck > 0.0;
    let [ratio, low, high, free, stuck] = [ratio_to_resonance, low, high, free, stuck].map(short);
    let words =
        format!("{ratio} ({low} to {high} Hz; {free} Hz free of the contact, {stuck} Hz stuck)");
    worded(ratio_to_resonance, words).filter(|_| is_sprung)
}

/// Distance of the frequency range from the first frequency of a bar as long as the resonator, as a ratio.
pub fn resonance_distance_bar(setup: &Setup) -> Option<Figure> {
    let [low, high] = range(setup)?;
    let first = setup.resonator?.bar_frequency();
    // A range that begins below the first frequency is judged by its upper end.
    let ratio_to_first = if high < first { high } else { low } / first;
    let [ratio, low, high, first] = [ratio_to_first, low, high, first].map(short);
    worded(
        ratio_to_first,
        format!("{ratio} ({low} to {high} Hz over some {first} Hz)"),
    )
}

/// Mass of an oscillator or a resonator.
pub fn mass(setup: &Setup) -> Option<Figure> {
    let oscillator = setup.oscillator.map(|axis| axis.mass);
    number(oscillator.or(setup.resonator.map(Resonator::rough_mass))?)
}

/// Depth of an explicit wear step over Rq.
pub fn wear_step(setup: &Setup) -> Option<Figure> {
    let wear = setup.recipe.wear.as_ref()?;
    let rq = setup.face?.rq.filter(|rq| *rq > 0.0)?;
    let step = wear.depth_step.filter(|_| wear.scheme.is_explicit())?;
    part(step, rq, UM)
}

/// Worn depth over Rq, if the joint slides by its whole motion.
pub fn worn(setup: &Setup) -> Option<Figure> {
    let (face, wear) = (setup.face?, setup.recipe.wear.as_ref()?);
    let (cycles, slid) = (wear.cycles? as f64, setup.displacement_half_range()?);
    let area = face.contact_radius().map_or(face.area(), |a| PI * a * a);
    let depth = wear.coefficient * 4.0 * face.limit()? * slid * cycles / area;
    part(depth, face.roughness(), UM)
}

/// Mean depth of the requested wear volume over the side of the joint.
pub fn requested_depth(setup: &Setup) -> Option<Figure> {
    let face = setup.face?;
    let depth = setup.recipe.wear.as_ref()?.volume? / face.area();
    let value = depth / face.side();
    let [ratio, um, rq] = [value, depth * 1e6, depth / face.roughness()].map(short);
    worded(value, format!("{ratio} ({um} µm, {rq} Rq)"))
}

/// Bounds of [`requested_depth`]: a mean depth of a hundred Rq over the side of the joint.
pub fn hundred_rq(setup: &Setup) -> Option<[f64; 2]> {
    let face = setup.face?;
    Some([0.0, 1e2 * face.roughness() / face.side()])
}
