//! Settings of the model update that decide its results.

/// Settings of the laws of contact elements, of the extrapolation of their motion, and of the criterion of an update.
///
/// `tests/constants/sensitivity.csv` has the effect of each when it is halved or doubled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UpdateSettings {
    /// Longest step, as a fraction of the motion. With chords of a tenth, the energy of a joint that slips little is wrong
    /// by a hundredth; lifted corners correct most of that.
    pub longest_step: f64,
    /// Fraction of the motion at which the loading ends. While a response is computed, elements may move beyond the end of
    /// the motion.
    pub loading_end: f64,
    /// Elements that move less than this fraction of the largest motion keep the law of the push. The force of such an
    /// element depends on its neighbours and not on its own motion.
    pub least_reach: f64,
    /// Last slope of a backbone that is below its strength at its last corner, relative to the slope before.
    pub last_slope: f64,
    /// Smallest level, relative to the displacement at which the contact would slide if nothing slid before.
    pub least_level: f64,
    /// Bound on the number of levels. The ratio keeps its bound over a range of 600 to 1.
    pub max_levels: usize,
    /// Depth up to which a slider has a counterpart beyond the edge of the contact, relative to the depth of the element.
    /// Depth is load over stiffness.
    pub closing_depth: f64,
    /// Largest multiple of the last change by which the motion is extrapolated.
    pub max_multiple: f64,
    /// A larger change of the amplitude, relative to it, is not extrapolated: the joint begins to behave differently.
    pub largest_change: f64,
    /// Excess of the volume growth over its limit, relative to the limit, up to which the update is still on time.
    pub volume_growth_margin: f64,
}

impl UpdateSettings {
    /// The settings of every run. Results are stored without them, so that a run does not mix several.
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
