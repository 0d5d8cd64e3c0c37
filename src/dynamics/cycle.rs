//! Loads, moments and relative displacements over the cycle of a converged response: per element and in total.

pub use super::line::Line;
use crate::threads::Threads;

use super::contact_element::{ContactElement, ElementCycle, ElementState};
use super::{DynamicsError, Sampling};

/// The whole joint at the samples of one cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct JointCycle {
    /// Area-weighted mean displacement of the elements, `[x, y, n]` \[m\].
    pub displacement: Vec<[f64; 3]>,
    /// Sum of `[T_x, T_y, N]` \[N\], N with the preload.
    pub force: Vec<[f64; 3]>,
    /// Sum of moments about the origin of the positions, `[Σ yN, −Σ xN, Σ (xT_y − yT_x)]` \[N m\].
    pub moment: Vec<[f64; 3]>,
    /// Energy that each element dissipates in one cycle, from samples \[J\].
    pub dissipated_energy: Vec<f64>,
    /// The line that the elements all but follow.
    pub line: Line,
    /// Force along it: the sum over the elements of the force of each along the line's direction of that element, whose work over the reach is
    /// that of all elements \[N\].
    pub force_along: Vec<f64>,
}

impl JointCycle {
    /// Half ranges of the moments about x, y and the normal, in parts of `moment` (a load times a lever) \[N m\].
    pub fn moment_variation(&self, moment: f64) -> [f64; 3] {
        [0, 1, 2].map(|d| {
            if moment > 0.0 {
                half_range(self.moment.iter().map(|m| m[d])) / moment
            } else {
                0.0
            }
        })
    }
}

/// The work of friction of each element in a response, over that on the way to and fro between two ends under the loads at rest: what the
/// variation of its load makes of it, and what it does beside the line between the ends.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkBetweenEnds {
    /// That part, element by element, at most [`LARGEST_PART`]; 1 of elements that dissipate nothing between the ends.
    pub part: Vec<f64>,
    /// The work of friction of all elements together in the response, over that between the ends, at most [`LARGEST_PART`].
    pub work_part: f64,
    /// What the parts change, element by element, in parts of what all dissipate.
    pub changed: f64,
    /// What elements dissipate and no part tells, likewise: they slip only since their load varies.
    pub untold: f64,
    /// The work of friction between the ends, element by element \[J\].
    pub energy: Vec<f64>,
    /// What all carry along the line between the ends at the first of them, under the loads at rest, as [`JointCycle::force_along`] \[N\].
    pub force_along: f64,
    /// Half range of the force along the line in the response, over that between the ends under the loads at rest, at most
    /// [`LARGEST_PART`].
    pub force_part: f64,
    /// The line between the ends.
    pub line: Line,
    /// By how much each element is closer than at rest, at both ends \[m\].
    pub approach: [Vec<f64>; 2],
}

/// The largest part: an element that hardly slips between the ends tells little by it.
pub const LARGEST_PART: f64 = 4.0;

impl WorkBetweenEnds {
    /// Of elements with this `displacement` and the `cycle` that they make of it, between the ends of its line.
    pub fn of(
        elements: &[ContactElement],
        displacement: &[f64],
        sampling: &Sampling,
        cycle: &JointCycle,
    ) -> Self {
        let line = &cycle.line;
        let [top, bottom] = line.ends;
        let (mut all, mut changed, mut untold, mut force_along) = (0.0, 0.0, 0.0, 0.0);
        let rows = displacement.chunks(3 * sampling.harmonics().coefficients());
        let rows = rows.zip(&line.direction);
        let mut approach = [Vec::new(), Vec::new()];
        let mut energy_between = Vec::with_capacity(elements.len());
        type OfElement<'a> = (&'a ContactElement, (&'a [f64], &'a [f64; 2]));
        let of_element = |((element, (row, direction)), &energy): (OfElement, &f64)| {
            let displacement = sampling.synthesise(row);
            let (d, e) = (displacement[top], displacement[bottom]);
            approach[0].push(d[2]);
            approach[1].push(e[2]);
            let half = [0.5 * (d[0] - e[0]), 0.5 * (d[1] - e[1])];
            let ends = [[half[0], half[1], 0.0], [-half[0], -half[1], 0.0]];
            let to_and_fro = element.cycle(&ends);
            let between = to_and_fro.dissipated_energy;
            energy_between.push(between);
            let [along_x, along_y, _] = to_and_fro.force[0];
            force_along += along_x * direction[0] + along_y * direction[1];
            let part = match between > 0.0 {
                true => (energy / between).min(LARGEST_PART),
                false => 1.0,
            };
            all += energy;
            changed += ((part - 1.0) * between).abs();
            untold += (energy - part * between).abs();
            part
        };
        let part = elements.iter().zip(rows);
        let part = part.zip(&cycle.dissipated_energy).map(of_element).collect();
        let of_all = |energy: f64| match all > 0.0 {
            true => energy / all,
            false => 0.0,
        };
        let between: f64 = energy_between.iter().sum();
        WorkBetweenEnds {
            part,
            work_part: match between > 0.0 {
                true => (all / between).min(LARGEST_PART),
                false => 1.0,
            },
            changed: of_all(changed),
            untold: of_all(untold),
            energy: energy_between,
            force_along,
            force_part: match force_along > 0.0 {
                true => {
                    let real = half_range(cycle.force_along.iter().copied());
                    (real / force_along).min(LARGEST_PART)
                }
                false => 1.0,
            },
            line: line.clone(),
            approach,
        }
    }
}

/// Half of what lies between the least and the largest value; 0 of none.
pub fn half_range(values: impl IntoIterator<Item = f64>) -> f64 {
    let ends = (f64::INFINITY, f64::NEG_INFINITY);
    let (least, largest) = values
        .into_iter()
        .fold(ends, |(a, b), v| (a.min(v), b.max(v)));
    0.5 * (largest - least).max(0.0)
}

/// Shares of the elements in means over the joint: by area, or alike if they have none.
pub(super) fn weights(elements: &[ContactElement]) -> impl Iterator<Item = f64> {
    let area: f64 = elements.iter().map(|e| e.area).sum();
    let alike = 1.0 / elements.len() as f64;
    let shares = elements.iter();
    shares.map(move |e| if area > 0.0 { e.area / area } else { alike })
}

/// A cycle of the joint in few numbers. Amplitudes are half of the range over the cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct JointSummary {
    /// The worst state of every element.
    pub states: Vec<ElementState>,
    /// Amplitude of the area-weighted mean displacement, `[x, y, n]` \[m\].
    pub displacement: [f64; 3],
    /// The least amplitude of an element, `[x, y, n]` \[m\].
    pub least_displacement: [f64; 3],
    /// The largest amplitude of an element, `[x, y, n]` \[m\].
    pub largest_displacement: [f64; 3],
    /// Amplitude of the total normal load over the total preload; 0 without preload.
    pub normal_load: f64,
    /// The largest amplitude of an element's normal load over its own preload, of those that have one.
    pub largest_normal_load: f64,
}

impl JointSummary {
    /// Number of elements whose worst state is `state`.
    pub fn count(&self, state: ElementState) -> usize {
        self.states.iter().filter(|s| **s == state).count()
    }
}

/// The cycle of every element at the samples of `sampling`, which may be finer than those of the balance that gave the
/// displacement: three rows of coefficients an element, and what comes after them is not read \[m\].
pub fn element_cycles(
    elements: &[ContactElement],
    displacement: &[f64],
    sampling: &Sampling,
) -> Vec<ElementCycle> {
    let rows = displacement.chunks(3 * sampling.harmonics().coefficients());
    let pairs = elements.iter().zip(rows);
    pairs
        .map(|(element, row)| element.cycle(&sampling.synthesise(row)))
        .collect()
}

/// The cycle of the joint at the samples of `sampling`, with the elements at `positions` (x, y) \[m\]; arguments as of
/// [`element_cycles`].
///
/// # Errors
/// [`DynamicsError::Length`] unless there is a position for every element.
pub fn joint_cycle(
    elements: &[ContactElement],
    displacement: &[f64],
    sampling: &Sampling,
    positions: &[[f64; 2]],
) -> Result<JointCycle, DynamicsError> {
    joint_cycle_on(
        &Threads::default(),
        elements,
        displacement,
        sampling,
        positions,
    )
}

/// Elements whose cycles a thread takes at a time.
const AT_ONCE: usize = 16;

/// The cycle of [`joint_cycle`], found on threads.
///
/// # Errors
/// As there.
pub fn joint_cycle_on(
    threads: &Threads,
    elements: &[ContactElement],
    displacement: &[f64],
    sampling: &Sampling,
    positions: &[[f64; 2]],
) -> Result<JointCycle, DynamicsError> {
    if positions.len() != elements.len() {
        return Err(DynamicsError::Length {
            what: "list of positions of the elements",
            found: positions.len(),
            expected: elements.len(),
        });
    }
    let samples = sampling.samples();
    let shares: Vec<f64> = weights(elements).collect();
    let line = Line::of(&shares, displacement, sampling);
    let mut joint = JointCycle {
        displacement: vec![[0.0; 3]; samples],
        force: vec![[0.0; 3]; samples],
        moment: vec![[0.0; 3]; samples],
        dissipated_energy: Vec::with_capacity(elements.len()),
        force_along: vec![0.0; samples],
        line,
    };
    let width = 3 * sampling.harmonics().coefficients();
    let some = elements
        .chunks(AT_ONCE)
        .zip(displacement.chunks(width * AT_ONCE));
    let cycles = threads.map(some, |(elements, rows)| -> Vec<_> {
        let pairs = elements.iter().zip(rows.chunks(width));
        pairs
            .map(|(element, row)| {
                let displacement = sampling.synthesise(row);
                let cycle = element.cycle(&displacement);
                (displacement, cycle)
            })
            .collect()
    });
    let cycles = cycles.into_iter().flatten().zip(shares).zip(positions);
    for (k, (((displacement, cycle), weight), [x, y])) in cycles.enumerate() {
        let [along_x, along_y] = joint.line.direction[k];
        joint.dissipated_energy.push(cycle.dissipated_energy);
        for j in 0..samples {
            let [tx, ty, n] = cycle.force[j];
            for d in 0..3 {
                joint.displacement[j][d] += weight * displacement[j][d];
                joint.force[j][d] += cycle.force[j][d];
            }
            joint.force_along[j] += tx * along_x + ty * along_y;
            joint.moment[j][0] += y * n;
            joint.moment[j][1] -= x * n;
            joint.moment[j][2] += x * ty - y * tx;
        }
    }
    Ok(joint)
}
