//! Settings of the model update that decide its results.

/// Settings of the model update: the laws of the contact elements, the extrapolation of the motion, and the update
/// criterion.
///
/// `tests/constants/sensitivity.csv` lists the effect of halving or doubling each setting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UpdateSettings {
    /// Longest step, as a fraction of the motion. With steps of a tenth of the motion, the energy of a joint with
    /// little slip has an error of 1 %. Lifted corners of the backbone correct most of this error.
    pub longest_step: f64,
    /// Fraction of the motion at which the loading ends. While a response is computed, elements may move beyond the end of
    /// the motion.
    pub loading_end: f64,
    /// An element keeps the law of the push if the element moves less than this fraction of the largest element motion.
    /// The force of an element that hardly moves depends on the motion of its neighbours.
    pub least_reach: f64,
    /// Ratio of the last slope of a backbone to its second-last slope. The ratio applies if the force at the last
    /// corner is below the strength of the element.
    pub last_slope: f64,
    /// Smallest level, relative to the displacement at which the contact would slide if nothing slid before.
    pub least_level: f64,
    /// Bound on the number of levels. The ratio of successive levels stays within `RATIO` if the largest displacement
    /// is at most 600 times the smallest displacement.
    pub max_levels: usize,
    /// Depth limit for the counterpart of a slider, relative to the depth of the element. A slider at a smaller depth
    /// has a counterpart beyond the edge of the contact. The depth of an element is the load divided by the normal
    /// stiffness.
    pub closing_depth: f64,
    /// Largest multiple of the last change by which the motion is extrapolated.
    pub max_multiple: f64,
    /// Largest relative change of the amplitude that the extrapolation continues. After a larger change, the joint
    /// begins to behave differently.
    pub largest_change: f64,
    /// Permitted excess of the volume growth at an update, divided by the limit of the growth.
    pub volume_growth_margin: f64,
}

impl UpdateSettings {
    /// The settings of every run. Stored results do not record the settings, so all results of a run must use the same
    /// settings.
    pub const DEFAULT: UpdateSettings = UpdateSettings {
        longest_step: 0.125,
        loading_end: 1.25,
        least_reach: 0.02,
        last_slope: 0.5,
        least_level: 0.1,
        max_levels: 12,
        closing_depth: 1.0,
        max_multiple: 2.0,
        largest_change: 0.25,
        volume_growth_margin: 0.15,
    };
}
