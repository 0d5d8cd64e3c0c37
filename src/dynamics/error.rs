//! What can go wrong in the computation of a steady response.

use crate::linalg::LinalgError;

/// A steady response that could not be computed, or a question that has no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DynamicsError {
    /// A number out of its range.
    #[error("{name} is {value:e}; it must be {expected}")]
    OutOfRange {
        /// What the number is.
        name: &'static str,
        /// The value found.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// A parameter of a contact element out of its range.
    #[error("contact element {element}: {name} is {value:e}; it must be {expected}")]
    Element {
        /// Index of the element.
        element: usize,
        /// What the number is.
        name: &'static str,
        /// The value found.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// A container whose length does not fit the others.
    #[error("the {what} has {found} entries; {expected} are needed")]
    Length {
        /// Name of the container.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length that fits.
        expected: usize,
    },
    /// A set of harmonics without the mean, or with one twice.
    #[error(
        "the harmonics {found:?} cannot be used: they must be different and one of them must be 0"
    )]
    Harmonics {
        /// The harmonics as given.
        found: Vec<u32>,
    },
    /// A harmonic that something needs and the set does not have.
    #[error("harmonic {order} is needed by the {by} but the response has the harmonics {found:?}")]
    HarmonicMissing {
        /// The order needed.
        order: u32,
        /// What needs it.
        by: &'static str,
        /// The harmonics there are.
        found: Vec<u32>,
    },
    /// Fewer samples per cycle than the highest harmonic needs.
    #[error(
        "{samples} samples per cycle alias harmonic {highest}: more than {least} are needed, and many more resolve friction"
    )]
    Samples {
        /// Samples per cycle.
        samples: usize,
        /// The highest harmonic.
        highest: u32,
        /// Twice the highest harmonic.
        least: usize,
    },
    /// A matrix that cannot be factorized.
    #[error("the {what}: {source}")]
    Matrix {
        /// Which matrix.
        what: &'static str,
        /// What is wrong with it.
        source: LinalgError,
    },
    /// An excitation at a resonance that nothing damps: there is no steady response.
    #[error(
        "an undamped resonance at {frequency:.6} Hz has no steady response; move the frequency or damp the structure"
    )]
    Undamped {
        /// Frequency of the harmonic \[Hz\].
        frequency: f64,
    },
    /// A mode up to the frequency of the drive that the reduced structure does not keep.
    #[error(
        "{key} reaches {to:.1} Hz, and a mode at {frequency:.1} Hz or below is beyond the modes that are kept: raise dynamics.modes, or lower {key}"
    )]
    CutOff {
        /// The key that gives the frequency of the drive.
        key: &'static str,
        /// Upper bound of its frequency \[Hz\].
        frequency: f64,
        /// Frequency of the drive, the largest of a range \[Hz\].
        to: f64,
    },
    /// A mean force that nothing holds.
    #[error(
        "the mean force of {force:.6e} N moves the structure as a rigid body, and nothing holds it there: support it, or give the joint a preload or friction"
    )]
    Unsupported {
        /// Generalised force on the free motion, its largest port displacement scaled to 1 \[N\].
        force: f64,
    },
    /// Newton's method found no steady state.
    #[error(
        "no steady state at {frequency:.6} Hz and load factor {load_factor}: correction {correction:.3e} after {iterations} iterations, {tolerance:.1e} asked ({active} of {elements} elements active)"
    )]
    NotConverged {
        /// Frequency \[Hz\].
        frequency: f64,
        /// Share of the load that was being applied.
        load_factor: f64,
        /// Iterations spent at this load factor.
        iterations: usize,
        /// Relative Newton correction left.
        correction: f64,
        /// The correction asked for.
        tolerance: f64,
        /// Elements that slip or open.
        active: usize,
        /// All elements.
        elements: usize,
    },
    /// A search that has cost as much as it may.
    #[error(
        "the search for steady states was ended at {frequency:.6} Hz, as it had cost as much as it may; more is found where dynamics.frequency is narrower"
    )]
    Spent {
        /// Frequency \[Hz\].
        frequency: f64,
    },
    /// An element whose friction force does not come back to itself over a cycle.
    #[error(
        "contact element {element} has no steady cycle yet: after {cycles} cycles its friction force changes by {change:.3e} of the joint's largest from one to the next, {tolerance:.1e} asked; other samples per cycle or another load avoid the standstill"
    )]
    NotClosed {
        /// Index of the element.
        element: usize,
        /// Change over the last cycle relative to the largest friction force of the joint.
        change: f64,
        /// Cycles tried.
        cycles: usize,
        /// The change asked for.
        tolerance: f64,
    },
    /// The linear system of a Newton step was not solved.
    #[error(
        "the Krylov solver stopped at a relative residual of {residual:.3e} after {iterations} iterations, {tolerance:.1e} asked, as contact springs far stiffer than the structure make it; lower contact.kt and contact.kn if they are given, or take fewer contact elements"
    )]
    Krylov {
        /// Iterations spent.
        iterations: usize,
        /// Relative residual reached.
        residual: f64,
        /// Relative residual asked for.
        tolerance: f64,
    },
    /// No resonance where one was looked for.
    #[error(
        "no {what} between {from:.6} and {to:.6} Hz, which is where dynamics.frequency has it looked for: widen it"
    )]
    NoResonance {
        /// `"phase resonance"` or `"peak"`.
        what: &'static str,
        /// Start of the range \[Hz\].
        from: f64,
        /// End of the range \[Hz\].
        to: f64,
    },
    /// A resonance that is gone with new contact elements, where the range has another one.
    #[error(
        "the phase resonance that was followed, last at {before:.6} Hz, is lost with these contact elements: the displacement is nowhere near it 90° behind \
         the force any more. What dynamics.frequency has besides is another resonance, at {found:.6} Hz. Take the worn state on with `--from` and \
         another drive, response or range of dynamics.frequency"
    )]
    Lost {
        /// Frequency of the resonance before \[Hz\].
        before: f64,
        /// Frequency of the one that was found \[Hz\].
        found: f64,
    },
    /// A load at which the phase resonance ends: beyond, the joint slides as a whole and is none of the structure any more, or another resonance
    /// takes over that no rising load leads to.
    #[error(
        "no phase resonance could be followed to the whole load: the last one, at {part:.4} of it, is at {frequency:.6} Hz with {:.0} % of the sliders slipping; lower the amplitudes in `dynamics.force`, raise what friction holds (`contact.normal_load`), or give other `dynamics.harmonics`; beyond that load it may lie outside of `dynamics.frequency` (last attempt: {last})",
        100.0 * slipping, part = load_factor
    )]
    Overloaded {
        /// Frequency of the last resonance that was found \[Hz\].
        frequency: f64,
        /// Its share of the load.
        load_factor: f64,
        /// Share of the sliders of the contact elements that slip or open there.
        slipping: f64,
        /// Why there is none at a little more.
        last: Box<DynamicsError>,
    },
    /// A continuation whose step became too small.
    #[error(
        "the continuation stopped at {frequency:.6} Hz: the step fell to {step:.3e}, below {least:.1e} (last: {last})"
    )]
    StepTooSmall {
        /// Frequency of the last converged point \[Hz\].
        frequency: f64,
        /// The arc length that failed.
        step: f64,
        /// The least arc length.
        least: f64,
        /// Why the last attempt failed.
        last: Box<DynamicsError>,
    },
}

impl DynamicsError {
    /// True where a solver found no answer that may exist: another tolerance, range or start may help.
    pub fn is_not_converged(&self) -> bool {
        matches!(
            self,
            DynamicsError::NotConverged { .. }
                | DynamicsError::Spent { .. }
                | DynamicsError::Krylov { .. }
                | DynamicsError::NoResonance { .. }
                | DynamicsError::Lost { .. }
                | DynamicsError::Overloaded { .. }
                | DynamicsError::StepTooSmall { .. }
        )
    }

    /// Names the matrix that linear algebra complains about.
    pub(super) fn of_matrix(what: &'static str) -> impl Fn(LinalgError) -> DynamicsError {
        move |source| DynamicsError::Matrix { what, source }
    }

    /// Whether a matrix turned out to be singular.
    pub(super) fn is_singular(&self) -> bool {
        matches!(
            self,
            DynamicsError::Matrix {
                source: LinalgError::Singular { .. },
                ..
            } | DynamicsError::Undamped { .. }
        )
    }
}
