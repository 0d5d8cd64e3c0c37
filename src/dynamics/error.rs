//! Errors of the computation of a steady response.

use crate::linalg::LinalgError;

/// Error of the computation of a steady response.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DynamicsError {
    /// A number lies outside of the allowed range of the number.
    #[error("{name} is {value:e}; it must be {expected}")]
    OutOfRange {
        /// Name of the number.
        name: &'static str,
        /// Value of the number.
        value: f64,
        /// The allowed values.
        expected: &'static str,
    },
    /// A parameter of a contact element lies outside of the allowed range of the parameter.
    #[error("contact element {element}: {name} is {value:e}; it must be {expected}")]
    Element {
        /// Index of the element.
        element: usize,
        /// Name of the number.
        name: &'static str,
        /// Value of the number.
        value: f64,
        /// The allowed values.
        expected: &'static str,
    },
    /// A container has a length that does not match the other inputs.
    #[error("the {what} has {found} entries; {expected} are needed")]
    Length {
        /// Name of the container.
        what: &'static str,
        /// Length of the container.
        found: usize,
        /// The required length.
        expected: usize,
    },
    /// A set of harmonics that lacks the mean or repeats a harmonic.
    #[error(
        "the harmonics {found:?} cannot be used: they must be different and one of them must be 0"
    )]
    Harmonics {
        /// The harmonics in the input.
        found: Vec<u32>,
    },
    /// A harmonic that a computation needs but the set lacks.
    #[error("harmonic {order} is needed by the {by} but the response has the harmonics {found:?}")]
    HarmonicMissing {
        /// The required order.
        order: u32,
        /// Name of the computation that needs the missing harmonic.
        by: &'static str,
        /// The harmonics in the set.
        found: Vec<u32>,
    },
    /// Fewer samples per cycle than the highest harmonic needs.
    #[error(
        "{samples} samples per cycle alias harmonic {highest}: use more than {least}, and many more to resolve friction"
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
        /// Name of the matrix.
        what: &'static str,
        /// The error of the linear algebra.
        source: LinalgError,
    },
    /// An excitation at an undamped resonance, where no steady response exists.
    #[error(
        "an undamped resonance at {frequency:.6} Hz has no steady response; move the frequency or damp the structure"
    )]
    Undamped {
        /// Frequency of the harmonic \[Hz\].
        frequency: f64,
    },
    /// The reduced structure omits a mode at or below the frequency of the drive.
    #[error(
        "{key} reaches {to:.1} Hz, but the reduced structure omits a mode at or below {frequency:.1} Hz: raise dynamics.modes, or lower {key}"
    )]
    CutOff {
        /// The key of the scene that gives the frequency of the drive.
        key: &'static str,
        /// Upper bound of the frequency of the omitted mode \[Hz\].
        frequency: f64,
        /// Frequency of the drive, or the largest frequency of the range of the drive \[Hz\].
        to: f64,
    },
    /// A mean force on a rigid body motion without support.
    #[error(
        "the mean force of {force:.6e} N moves the structure as a rigid body without support: support the structure, or give the joint a preload or friction"
    )]
    Unsupported {
        /// Generalised force on the rigid body motion, whose largest port displacement is scaled to 1 \[N\].
        force: f64,
    },
    /// Newton's method did not converge.
    #[error(
        "no steady state was found at {frequency:.6} Hz and load factor {load_factor}: the correction is {correction:.3e} after {iterations} iterations and must be {tolerance:.1e} or less ({active} of {elements} elements are active)"
    )]
    NotConverged {
        /// Frequency \[Hz\].
        frequency: f64,
        /// Applied share of the load.
        load_factor: f64,
        /// Number of Newton iterations at the load factor `load_factor`.
        iterations: usize,
        /// Relative correction of the last iteration.
        correction: f64,
        /// The required correction.
        tolerance: f64,
        /// Number of elements that slip or open.
        active: usize,
        /// Number of all elements.
        elements: usize,
    },
    /// The search for steady states reached the limit of its evaluations.
    #[error(
        "the search for steady states stopped at {frequency:.6} Hz, as it reached its limit of evaluations; narrow dynamics.frequency"
    )]
    EvaluationLimit {
        /// Frequency \[Hz\].
        frequency: f64,
    },
    /// An element whose friction force is not periodic.
    #[error(
        "contact element {element} has no steady cycle: after {cycles} cycles its friction force still changes by {change:.3e} of the joint's largest friction force per cycle, and {tolerance:.1e} is allowed; change the samples per cycle or the load"
    )]
    NotClosed {
        /// Index of the element.
        element: usize,
        /// Change over the last cycle, relative to the largest friction force of the joint.
        change: f64,
        /// Number of simulated cycles.
        cycles: usize,
        /// The largest allowed change.
        tolerance: f64,
    },
    /// The Krylov solver did not solve the linear system of a Newton step.
    #[error(
        "the Krylov solver stopped at a relative residual of {residual:.3e} after {iterations} iterations, and {tolerance:.1e} is allowed; contact springs far stiffer than the structure cause this: lower contact.kt and contact.kn if they are given, or use fewer contact elements"
    )]
    Krylov {
        /// Number of iterations.
        iterations: usize,
        /// Relative residual of the last iteration.
        residual: f64,
        /// The required relative residual.
        tolerance: f64,
    },
    /// No resonance in the searched range.
    #[error(
        "no {what} between {from:.6} and {to:.6} Hz: widen the search range dynamics.frequency"
    )]
    NoResonance {
        /// Name of the missing resonance or branch, for example `"phase resonance"` or `"peak"`.
        what: &'static str,
        /// Start of the range \[Hz\].
        from: f64,
        /// End of the range \[Hz\].
        to: f64,
    },
    /// The tracked resonance does not exist with the new contact elements; the range has another resonance.
    #[error(
        "the phase resonance, last at {before:.6} Hz, does not exist with these contact elements: near that frequency the displacement no longer lags \
         the force by 90°. The resonance at {found:.6} Hz in the range of dynamics.frequency is another one. Continue from the worn state with `--from` \
         and another drive, response or range of dynamics.frequency"
    )]
    ResonanceLost {
        /// Frequency of the tracked resonance \[Hz\].
        before: f64,
        /// Frequency of the other resonance, which the solver found in place of the tracked resonance \[Hz\].
        found: f64,
    },
    /// The solver could not track the phase resonance up to the full load. Above the last load with a resonance, the
    /// joint can slide as a whole. Another resonance can also replace the tracked resonance above the last load.
    #[error(
        "the phase resonance could not be tracked up to the full load: the last one, at {part:.4} of the load, is at {frequency:.6} Hz with {:.0} % of the sliders slipping; lower the amplitudes in `dynamics.force`, raise the friction limit (`contact.normal_load`), or use other `dynamics.harmonics`; at a larger load the resonance may lie outside of `dynamics.frequency` (last attempt: {last})",
        100.0 * slipping, part = load_factor
    )]
    ResonanceNotTracked {
        /// Frequency of the last resonance \[Hz\].
        frequency: f64,
        /// Share of the load at the last resonance.
        load_factor: f64,
        /// Share of the sliders that slip or open at the last resonance.
        slipping: f64,
        /// Error of the last attempt at a larger load.
        last: Box<DynamicsError>,
    },
    /// The continuation stopped because the step of the continuation became too small.
    #[error(
        "the continuation stopped at {frequency:.6} Hz: the step fell to {step:.3e}, below {least:.1e} (last: {last})"
    )]
    StepTooSmall {
        /// Frequency of the last converged point \[Hz\].
        frequency: f64,
        /// The arc length of the failed step.
        step: f64,
        /// The smallest allowed arc length.
        least: f64,
        /// Error of the last attempt.
        last: Box<DynamicsError>,
    },
}

impl DynamicsError {
    /// Returns true if a solver failed although a solution is possible. Another tolerance, range or start can lead to a
    /// solution.
    pub fn is_not_converged(&self) -> bool {
        matches!(
            self,
            DynamicsError::NotConverged { .. }
                | DynamicsError::EvaluationLimit { .. }
                | DynamicsError::Krylov { .. }
                | DynamicsError::NoResonance { .. }
                | DynamicsError::ResonanceLost { .. }
                | DynamicsError::ResonanceNotTracked { .. }
                | DynamicsError::StepTooSmall { .. }
        )
    }

    /// Returns a function that adds the name of a matrix to an error of the linear algebra.
    pub(super) fn matrix_error(what: &'static str) -> impl Fn(LinalgError) -> DynamicsError {
        move |source| DynamicsError::Matrix { what, source }
    }

    /// Returns true if a matrix is singular.
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
