//! Bouncing: periodic motions along the normal of a mass that moves there by itself, in and out of contact. No branch over frequency need
//! lead to them, nor a motion from rest. They are near the motions without load and damping that a load keeps up, grow with damping from those without it,
//! or are what is left of the bouncing under a larger load when that is lowered again. The path of each is followed to where it is highest.

use num_complex::Complex64;

use super::bouncing_path::{Bounce, Path};
use super::contact_element::ContactElement;
use super::effort::BOUNCING;
use super::periodic::{Asked, Periodic};
use super::survey::{EFFORT, OTHER, PROBES, Survey, first_harmonic, is_near, over, start_of};
use super::time_integration::Motion;
use super::two_springs::{Drive, State, TwoSprings};
use super::vibration::Vibration;
use super::{DynamicsError, HarmonicBalance, Load, Response, SecondOrder};

/// Direction of the normal among the ports of a contact element.
pub(super) const NORMAL: usize = 2;
/// Speeds at which resonant motions cross the edge of the contact, in parts of the largest that damping allows.
const PARTS: [f64; 3] = [1.0, 0.7, 0.3];
/// Motions without damping are looked for at frequencies whose ratio is this at most, but at no more than so many: closed paths may be as narrow.
const UNDAMPED: f64 = 1.03;
const MOST_UNDAMPED: usize = 40;
/// Least factor of the loads from which they are lowered, what they do to the load of the closed contact there, relative to its rest, and
/// steps down to their own size.
const LEAST_FACTOR: f64 = 2.5;
const OPENS: f64 = 2.0;
const LEVELS: usize = 11;
/// Periods that are waited at a level where no periodic motion is near, and evaluations of a motion that they and all of a frequency may take: a
/// stiff contact swings often in a period.
const WAITED: usize = 300;
const WAITING: usize = 150_000;
const LOWERING: usize = 600_000;
/// How far beyond the ends of a range motions are begun from, and followed, as factors: a path may turn back a little inside of an end.
const BEYOND: f64 = 1.05;
const AWAY: f64 = 1.3;
/// Evaluations of a motion that a path may take.
const FOLLOWING: usize = 800_000;
/// Evaluations of all that is begun in one way, and of the paths from there on: a million takes a quarter of a second.
const BEGINNING: usize = 3_600_000;
const PATHS: usize = 4 * BEGINNING;
/// Share of the contact's stiffness that the spring of an open mass has at least.
const SOFT: f64 = 1e-9;

/// Where what bounces is begun from.
enum Begin {
    /// The state at the phase 0, at an angular frequency.
    Near(f64, State),
    /// The motions without damping at an angular frequency.
    Undamped(f64),
    /// What a larger load leaves at an angular frequency.
    Lowered(f64),
}

impl Begin {
    /// The motions that are found from there, and the evaluations that they took.
    fn found(&self, bouncer: &TwoSprings) -> (Vec<Bounce>, usize) {
        let (found, evaluations) = match *self {
            Begin::Near(omega, state) => bouncer.bounce(omega, state),
            Begin::Undamped(omega) => return bouncer.grown_from_undamped(omega),
            Begin::Lowered(omega) => lowered(bouncer, omega),
        };
        (found.into_iter().collect(), evaluations)
    }
}

/// All that was found to bounce over a range, by itself: as no harmonics have a part in it, it is looked for once.
#[derive(Debug)]
pub(super) struct Bouncing {
    /// What bounces, and angular frequencies over which it was looked for.
    pub(super) of: TwoSprings,
    pub(super) range: (f64, f64),
    /// Motions, each with the number of its path; none where the contact stays closed or open.
    motions: Vec<(Bounce, Option<usize>)>,
    paths: Vec<Path>,
    /// Whether what is begun from had cost enough, and whether what was found had, before its path was followed.
    is_cut: bool,
    is_left: bool,
}

impl TwoSprings {
    /// What bounces over a range of angular frequencies.
    pub(super) fn bouncing(&self, range: (f64, f64)) -> Bouncing {
        let within = (range.0 / AWAY, range.1 * AWAY);
        let mut out = Bouncing {
            of: self.clone(),
            range,
            motions: Vec::new(),
            paths: Vec::new(),
            is_cut: false,
            is_left: false,
        };
        for way in self.begins(range) {
            let mut evaluations = 0;
            for begin in way {
                if evaluations > BEGINNING {
                    out.is_cut = true;
                    break;
                }
                let (found, needed) = begin.found(self);
                evaluations += needed;
                for motion in found {
                    if out.paths.iter().any(|path| path.has(&motion)) {
                        continue;
                    }
                    if evaluations > PATHS {
                        out.is_left = true;
                        break;
                    }
                    let number = motion.shape.bounces().then(|| {
                        let (path, needed) = self.path(&motion, within, range, FOLLOWING);
                        evaluations += needed;
                        out.paths.push(path);
                        out.paths.len() - 1
                    });
                    out.motions.push((motion, number));
                }
            }
        }
        out
    }

    /// What motions are begun from, in three ways.
    fn begins(&self, range: (f64, f64)) -> [Vec<Begin>; 3] {
        let (from, to) = range;
        let within = (from / AWAY, to * AWAY);
        let resonant = self.resonant(&PARTS);
        let near = |(omega, _): &(f64, State)| (within.0..=within.1).contains(omega);
        let resonant = resonant.into_iter().filter(near);
        let resonant = resonant.map(|(omega, state)| Begin::Near(omega, state));
        let beyond = (from / BEYOND, to * BEYOND);
        let parts = ((beyond.1 / beyond.0).ln() / UNDAMPED.ln()).ceil();
        let parts = (parts as usize).min(MOST_UNDAMPED);
        let mut undamped: Vec<usize> = (0..=parts).collect();
        let at = |k: usize| beyond.0 * (beyond.1 / beyond.0).powf(k as f64 / parts as f64);
        // Those of the range, far from each other, first.
        undamped.sort_by_key(|k| {
            let is_beyond = !(from..=to).contains(&at(*k));
            (is_beyond, std::cmp::Reverse(k.trailing_zeros()))
        });
        let undamped = undamped.into_iter().map(|k| Begin::Undamped(at(k)));
        let lowered = over(range, PROBES).chain([beyond.0, beyond.1]);
        [
            resonant.collect(),
            undamped.collect(),
            lowered.map(Begin::Lowered).collect(),
        ]
    }
}

impl Vibration {
    /// Adds to a survey the responses that bounce and that no branch of it leads to; none of a structure whose normal motion depends on
    /// others.
    ///
    /// # Errors
    /// Those of [`Self::branch_through`].
    pub(super) fn look_for_bouncing(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        survey: &mut Survey,
    ) -> Result<(), DynamicsError> {
        let Some(bouncer) = self.bouncer(balance) else {
            return Ok(());
        };
        let known = self.surveyed.bouncing(&bouncer, self.range);
        survey.is_cut |= known.is_cut;
        if known.is_left {
            survey.leave(self.reach_within(balance, self.range));
        }
        balance.effort.allow(BOUNCING);
        // What comes after all is spent is left as high as it may be.
        for (motion, number) in &known.motions {
            if let Some(number) = number {
                self.add_path(balance, survey, &bouncer, &known.paths[*number])?;
            }
            if (self.range.0..=self.range.1).contains(&motion.omega) {
                self.add_bouncing(balance, survey, &bouncer, motion)?;
            }
        }
        survey.is_cut |= balance.effort.is_spent();
        self.look_across(balance, survey, &bouncer, &known.paths);
        Ok(())
    }

    /// Adds what is highest on a path of motions that bounce.
    fn add_path(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        survey: &mut Survey,
        bouncer: &TwoSprings,
        path: &Path,
    ) -> Result<(), DynamicsError> {
        let is_along = self.response_port == NORMAL;
        let top = path.top(self.range);
        if let Some(top) = top {
            self.add_bouncing(balance, survey, bouncer, top)?;
            // What is highest along the normal need not be along another axis, and what nothing damps may be larger without bound.
            let is_top = path.is_whole && is_along && bouncer.damping > 0.0;
            let top = [top.omega, top.shape.first_harmonic];
            survey.tops.extend(is_top.then_some(top));
        }
        // Along the normal the highest motion of the part that was followed stands for the rest: of hundreds of drawn oscillators none had a
        // higher one.
        let is_undamped = bouncer.damping == 0.0 && top.is_some();
        if is_undamped || !path.is_whole && !is_along {
            survey.leave(self.reach_within(balance, self.range));
        }
        Ok(())
    }

    /// Adds a motion that bounces, unless a branch has it.
    fn add_bouncing(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        survey: &mut Survey,
        bouncer: &TwoSprings,
        motion: &Bounce,
    ) -> Result<(), DynamicsError> {
        let (omega, size) = (motion.omega, motion.shape.first_harmonic);
        let known = survey.amplitudes(balance, NORMAL, omega);
        let is_known = |size: f64| {
            known
                .iter()
                .any(|known| (size / known - 1.0).abs() <= OTHER)
        };
        if is_known(size) {
            return Ok(());
        }
        let Some(bouncing) = self.with_all_axes(balance, motion, None, Asked::Stability) else {
            survey.leave(self.reach_of(balance, bouncer, motion));
            return Ok(());
        };
        let of = |response: &Response| first_harmonic(balance, &response.displacement, NORMAL);
        match balance.solve(omega, Some(&start_of(&bouncing))) {
            // Of few harmonics it may differ from its motion in time.
            Ok(response) if is_near(of(&response), size) && is_known(of(&response)) => {}
            Ok(response) if is_near(of(&response), size) => {
                let branch = self.branch_through(balance, &response)?;
                survey.branches.push(branch);
            }
            // With few harmonics the balance may have no such response.
            _ => survey.motions.push(bouncing),
        }
        Ok(())
    }

    /// The motion of all coordinates of which the normal one bounces, the others near those of another motion, or from rest; none where it is not found.
    pub(super) fn with_all_axes(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        motion: &Bounce,
        others: Option<&Motion>,
        asked: Asked,
    ) -> Option<Periodic> {
        // Under loads of even orders alone it has no first harmonic.
        let size = motion.shape.half_range;
        let time = self.in_time(balance)?;
        let coordinate = alone_on_the_normal(&self.model)?;
        let n = self.model.mass.rows();
        let mut start = others.cloned().unwrap_or_else(|| time.rest());
        (start.values[coordinate], start.values[n + coordinate]) =
            (motion.state[0], motion.state[1]);
        let sizes = self.coordinate_sizes(balance, motion.omega, (coordinate, size));
        let scales = time.scales_by(motion.omega, &sizes);
        let harmonics = balance.harmonics();
        let effort = EFFORT.min(balance.effort.steps_left());
        let near = time.near_by(motion.omega, &start, &scales, harmonics, asked, effort);
        balance.effort.add_steps(time.steps());
        let near = near.ok().flatten()?;
        let [z, v] = [coordinate, n + coordinate].map(|k| near.motion.values[k]);
        let apart = (z - motion.state[0]).hypot((v - motion.state[1]) / motion.omega);
        (apart <= OTHER * size).then_some(near)
    }

    /// The mass on its normal; none where the normal motion depends on others, its contact is not one spring, no load moves it, or damping
    /// lets nothing swing.
    pub(super) fn bouncer(&self, balance: &HarmonicBalance<ContactElement>) -> Option<TwoSprings> {
        let k = alone_on_the_normal(&self.model)?;
        let [element] = balance.elements() else {
            return None;
        };
        let [slider] = element.sliders[..] else {
            return None;
        };
        let kn = slider.normal_stiffness;
        if kn == 0.0 || !element.springs.is_empty() {
            return None;
        }
        let share = |load: &Load| self.model.basis.at(load.port, k);
        let steady = self.loads.iter().filter(|load| load.harmonic == 0);
        let steady: f64 = steady.map(|load| share(load) * load.cosine).sum();
        let waves = |loads: &[Load]| -> Vec<(u32, Complex64)> {
            let moving = loads
                .iter()
                .filter(|load| load.harmonic > 0 && share(load) != 0.0);
            moving
                .map(|load| {
                    let force = Complex64::new(load.cosine, -load.sine);
                    (load.harmonic, share(load) * force)
                })
                .collect()
        };
        let (mass, damping) = (self.model.mass.at(k, k), self.model.damping.at(k, k));
        let open = self.model.stiffness.at(k, k).max(SOFT * kn);
        let bouncer = TwoSprings {
            mass,
            damping,
            stiffness: [open, open + kn],
            steady: [steady + slider.normal_load, steady + kn * slider.gap],
            edge: slider.gap - slider.normal_load / kn,
            loads: waves(&self.loads),
            inertial_loads: waves(&self.inertial_loads),
        };
        (bouncer.is_loaded() && bouncer.swings()).then_some(bouncer)
    }
}

/// The coordinate that the normal displacement of the first contact element is, where no other coordinate depends on it or shares in it.
pub(super) fn alone_on_the_normal(model: &SecondOrder) -> Option<usize> {
    if model.residual.is_some() || model.contact_dofs <= NORMAL {
        return None;
    }
    let n = model.mass.rows();
    let row = model.basis.row(NORMAL);
    let k = row.iter().position(|share| *share != 0.0)?;
    let only = |row: &[f64]| row.iter().enumerate().all(|(i, v)| i == k || *v == 0.0);
    let is_alone = (0..NORMAL).all(|port| model.basis.at(port, k) == 0.0)
        && only(row)
        && row[k] == 1.0
        && [&model.mass, &model.damping, &model.stiffness]
            .iter()
            .all(|matrix| only(matrix.row(k)) && (0..n).all(|i| i == k || matrix.at(i, k) == 0.0));
    is_alone.then_some(k)
}

/// The periodic motion that is left when larger loads are lowered to their own size, if there is one; and the evaluations that it took.
fn lowered(bouncer: &TwoSprings, omega: f64) -> (Option<Bounce>, usize) {
    let own = Drive::new(bouncer, omega, 1.0);
    let [pressed, moved] = own.of_closed();
    let most = (OPENS * pressed / moved).max(LEAST_FACTOR);
    let (mut state, mut evaluations) = ([0.0; 2], 0);
    let mut is_periodic = false;
    for level in 0..=LEVELS {
        let factor = most.powf(1.0 - level as f64 / LEVELS as f64);
        let drive = Drive::new(bouncer, omega, factor);
        let found = match level {
            0 => None,
            _ => drive.periodic(state),
        };
        let found = found.or_else(|| {
            let begun = drive.evaluations();
            let mut periods = (0..WAITED).take_while(|_| drive.evaluations() - begun < WAITING);
            state = periods.try_fold(state, |state, _| drive.period(state))?;
            drive.periodic(state)
        });
        is_periodic = found.is_some();
        state = found.unwrap_or(state);
        evaluations += drive.evaluations();
        if evaluations > LOWERING {
            return (None, evaluations);
        }
    }
    if !is_periodic {
        return (None, evaluations);
    }
    let (found, needed) = bouncer.bounce(omega, state);
    (found, evaluations + needed)
}

#[cfg(test)]
mod tests {
    use super::super::time_integration::TimeModel;
    use super::super::{Harmonics, Oscillator, Slider};
    use super::*;

    /// Over a period in which the contact opens and closes, the motion from spring to spring is that of the integration in time.
    #[test]
    fn a_period_from_spring_to_spring_is_that_in_time() {
        const RANGE: (f64, f64) = (200.0, 400.0);
        // What integration in time leaves.
        const INTEGRATED: f64 = 1e-6;
        let oscillator = Oscillator {
            mass: [1.0, 1.0, 0.7],
            damping: [2.0, 2.0, 3.0],
            stiffness: [1e5, 1e5, 4e4],
            element: ContactElement {
                springs: Vec::new(),
                area: 0.0,
                friction_coefficient: 0.0,
                law: Default::default(),
                sliders: vec![Slider {
                    normal_load: 30.0,
                    gap: 0.0,
                    tangential_stiffness: 1e5,
                    normal_stiffness: 9e5,
                }],
            },
        };
        let third = Load {
            harmonic: 3,
            ..Oscillator::load(NORMAL, 9.0, 0.4)
        };
        let loads = vec![Oscillator::load(NORMAL, 80.0, 0.9), third];
        let vibration = Vibration {
            model: oscillator.model().expect("an oscillator"),
            loads: loads.clone(),
            inertial_loads: Vec::new(),
            response_port: NORMAL,
            harmonics: Harmonics::up_to(3),
            settings: Default::default(),
            range: RANGE,
            points: None,
            gauge: Default::default(),
            journal: Default::default(),
            surveyed: Default::default(),
        };
        let balance = vibration
            .balance(vec![oscillator.element.clone()])
            .expect("a balance");
        let bouncer = vibration.bouncer(&balance).expect("it moves by itself");
        let time = TimeModel::new(&vibration.model, balance.elements(), &loads).expect("in time");
        let (mut opens, n) = (false, 3);
        for state in [[1e-5, 0.02], [-3e-4, 0.1], [-2e-3, -0.5]] {
            let drive = Drive::new(&bouncer, RANGE.0, 1.0);
            let there = drive.period(state).expect("few events");
            let mut motion = time.rest();
            (motion.values[NORMAL], motion.values[n + NORMAL]) = (state[0], state[1]);
            let scales = time.scales(RANGE.0, 1e-3);
            time.period(RANGE.0, &mut motion, &scales, None)
                .expect("few steps");
            let in_time = [motion.values[NORMAL], motion.values[n + NORMAL]];
            for (k, size) in [1e-3, 1e-3 * RANGE.0].into_iter().enumerate() {
                let off = (there[k] - in_time[k]).abs() / size;
                assert!(off < INTEGRATED, "{there:?} {in_time:?}");
            }
            opens |= there[0] < bouncer.edge || state[0] < bouncer.edge;
        }
        assert!(opens);
    }
}
