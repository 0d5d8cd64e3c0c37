//! Loads, moments and relative displacements over the cycle of a converged response, per element and in total.

pub use super::line::Line;
use crate::threads::Threads;

use super::contact_element::{ContactElement, ElementCycle, ElementState};
use super::{DynamicsError, Sampling};

/// Whole joint at the samples of one cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct JointCycle {
    /// Area-weighted mean displacement of the elements, `[x, y, n]` \[m\].
    pub displacement: Vec<[f64; 3]>,
    /// Sum of `[T_x, T_y, N]` \[N\]; N includes the preload.
    pub force: Vec<[f64; 3]>,
    /// Moment of the contact forces about the origin of the positions, `[Σ yN, −Σ xN, Σ (xT_y − yT_x)]` \[N m\].
    pub moment: Vec<[f64; 3]>,
    /// Energy that each element dissipates per cycle, from samples \[J\].
    pub dissipated_energy: Vec<f64>,
    /// Line that approximates the motion of the elements.
    pub line: Line,
    /// Force along the line \[N\]: the sum over the elements of the force along the line's direction of each element.
    /// If the joint moves by the reach of the line, the work of `force_along` equals the work of all element forces.
    pub force_along: Vec<f64>,
}

impl JointCycle {
    /// Returns the half ranges of the moments about x, y and the normal, divided by `moment`. The reference `moment`
    /// \[N m\] is a load times a lever.
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

/// Ratio of two works of friction for each element. The numerator is the work in the response. The denominator is the
/// work on a straight way between two ends and back, under the loads at rest.
///
/// The ratio shows the effect of the varying load, and of the motion away from the line between the ends.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkBetweenEnds {
    /// The ratio for each element, at most [`LARGEST_PART`]; 1 for elements that dissipate nothing between the ends.
    pub part: Vec<f64>,
    /// The ratio for all elements together, at most [`LARGEST_PART`].
    pub work_part: f64,
    /// Sum of the energy changes that the ratios cause in all elements, divided by the dissipation of all elements.
    pub changed_share: f64,
    /// Dissipation that the ratios do not represent, divided by the dissipation of all elements. Some elements slip
    /// only because their normal load varies, and do not slip on the straight way between the ends.
    pub unrepresented_share: f64,
    /// Work of friction between the ends, for each element \[J\].
    pub energy: Vec<f64>,
    /// Force of all elements along the line at the first end of the line, under the loads at rest, as
    /// [`JointCycle::force_along`] \[N\].
    pub force_along: f64,
    /// Ratio of two forces along the line. The numerator is the half range of the force in the response. The
    /// denominator is the force between the ends of the line, under the loads at rest. The ratio is at most
    /// [`LARGEST_PART`].
    pub force_part: f64,
    /// The line between the ends.
    pub line: Line,
    /// Normal approach of each element relative to the position of the element at rest, at both ends of the line \[m\].
    pub approach: [Vec<f64>; 2],
}

/// Upper limit of the ratios: an element that hardly slips between the ends has no meaningful ratio.
pub const LARGEST_PART: f64 = 4.0;

impl WorkBetweenEnds {
    /// Computes the work of elements between the ends of the line of their `cycle`, which `displacement` causes.
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
        type ElementRow<'a> = (&'a ContactElement, (&'a [f64], &'a [f64; 2]));
        let ratio_of_element = |((element, (row, direction)), &energy): (ElementRow, &f64)| {
            let displacement = sampling.synthesise(row);
            let (d, e) = (displacement[top], displacement[bottom]);
            approach[0].push(d[2]);
            approach[1].push(e[2]);
            let half = [0.5 * (d[0] - e[0]), 0.5 * (d[1] - e[1])];
            let ends = [[half[0], half[1], 0.0], [-half[0], -half[1], 0.0]];
            let straight_cycle = element.cycle(&ends);
            let between = straight_cycle.dissipated_energy;
            energy_between.push(between);
            let [along_x, along_y, _] = straight_cycle.force[0];
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
        let part = part
            .zip(&cycle.dissipated_energy)
            .map(ratio_of_element)
            .collect();
        let share_of_total = |energy: f64| match all > 0.0 {
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
            changed_share: share_of_total(changed),
            unrepresented_share: share_of_total(untold),
            energy: energy_between,
            force_along,
            force_part: match force_along > 0.0 {
                true => {
                    let response_half_range = half_range(cycle.force_along.iter().copied());
                    (response_half_range / force_along).min(LARGEST_PART)
                }
                false => 1.0,
            },
            line: line.clone(),
            approach,
        }
    }
}

/// Returns half the difference between the largest and the smallest value; 0 without values.
pub fn half_range(values: impl IntoIterator<Item = f64>) -> f64 {
    let ends = (f64::INFINITY, f64::NEG_INFINITY);
    let (least, largest) = values
        .into_iter()
        .fold(ends, |(a, b), v| (a.min(v), b.max(v)));
    0.5 * (largest - least).max(0.0)
}

/// Returns the weights of the elements in means over the joint: by area, or equal weights if the elements have no area.
pub(super) fn weights(elements: &[ContactElement]) -> impl Iterator<Item = f64> {
    let area: f64 = elements.iter().map(|e| e.area).sum();
    let equal_share = 1.0 / elements.len() as f64;
    let shares = elements.iter();
    shares.map(move |e| {
        if area > 0.0 {
            e.area / area
        } else {
            equal_share
        }
    })
}

/// Summary of a cycle of the joint. Amplitudes are half of the range over the cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct JointSummary {
    /// Worst state of every element.
    pub states: Vec<ElementState>,
    /// Amplitude of the area-weighted mean displacement, `[x, y, n]` \[m\].
    pub displacement: [f64; 3],
    /// Smallest amplitude of an element, `[x, y, n]` \[m\].
    pub least_displacement: [f64; 3],
    /// Largest amplitude of an element, `[x, y, n]` \[m\].
    pub largest_displacement: [f64; 3],
    /// Amplitude of the total normal load over the total preload; 0 without preload.
    pub normal_load: f64,
    /// Largest amplitude of an element's normal load over its own preload, among elements with a preload.
    pub largest_normal_load: f64,
}

impl JointSummary {
    /// Returns the number of elements whose worst state is `state`.
    pub fn count(&self, state: ElementState) -> usize {
        self.states.iter().filter(|s| **s == state).count()
    }
}

/// Computes the cycle of every element at the samples of `sampling`. The samples can be finer than the sampling of the
/// balance.
///
/// `displacement` has three rows of coefficients per element; later rows are ignored \[m\].
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

/// Computes the cycle of the joint at the samples of `sampling`, with the elements at `positions` (x, y) \[m\]. All
/// arguments except `positions` have the same meaning as the arguments of [`element_cycles`].
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

/// Number of elements whose cycles a thread computes at a time.
const AT_ONCE: usize = 16;

/// Computes the cycle of [`joint_cycle`] on threads.
///
/// # Errors
/// As [`joint_cycle`].
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
    let chunks = elements
        .chunks(AT_ONCE)
        .zip(displacement.chunks(width * AT_ONCE));
    let cycles = threads.map(chunks, |(elements, rows)| -> Vec<_> {
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
