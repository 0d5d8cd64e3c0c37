//! Collects the faults of a scene, so that all of them are reported at once.

use super::error::{Place, Problem, SceneError};

/// Most faults that are collected and reported.
pub const MOST: usize = 50;

/// Faults in the order in which they are found.
#[derive(Debug, Default)]
pub struct Faults(Vec<SceneError>);

impl Faults {
    /// Returns the value of a result, or records its faults.
    pub fn value_or_record<T>(&mut self, result: Result<T, SceneError>) -> Option<T> {
        match result {
            Ok(value) => Some(value),
            Err(error) => {
                let left = MOST - self.0.len();
                self.0.extend(error.into_each().take(left));
                None
            }
        }
    }

    /// True if no further faults are recorded.
    pub fn is_full(&self) -> bool {
        self.0.len() >= MOST
    }

    /// Returns all faults as one error, in the order in which they were found, or `Ok` without faults.
    pub fn into_result(self) -> Result<(), SceneError> {
        let mut faults = self.0.into_iter();
        match faults.next() {
            None => Ok(()),
            Some(first) => Err(SceneError {
                also: faults.collect(),
                ..first
            }),
        }
    }

    /// Returns the faults as one error, sorted by line. The error contains only the first fault of each key, and omits
    /// faults that result from other faults. Returns `Ok` without faults.
    pub fn end_sorted(mut self) -> Result<(), SceneError> {
        let blamed_names: Vec<String> = self.0.iter().filter_map(blamed_name).collect();
        self.0.retain(|fault| !is_consequence(fault, &blamed_names));
        let mut reported: Vec<(Place, Option<String>)> = Vec::new();
        self.0.retain(|fault| {
            let key = fault.problem.key_and_value().0.map(str::to_owned);
            let subject = (fault.place.clone(), key);
            let is_new = !reported.contains(&subject);
            reported.push(subject);
            is_new
        });
        self.0.sort_by_key(rank);
        self.into_result()
    }
}

/// Returns the name of a key or section that is missing only because of `fault`. For a misspelt key, the name is the
/// key that the user meant. For a section with a wrong value, the name is the section.
fn blamed_name(fault: &SceneError) -> Option<String> {
    match fault.problem.as_ref() {
        Problem::UnknownKey { nearest, .. } => nearest.clone(),
        Problem::Type { key, .. } => Some(key.clone()),
        _ => None,
    }
}

/// True for a missing key or section that another fault explains.
fn is_consequence(fault: &SceneError, blamed_names: &[String]) -> bool {
    let is_blamed = |name: &str| blamed_names.iter().any(|key| key == name);
    match fault.problem.as_ref() {
        Problem::Missing { key, section, .. } => is_blamed(key) || is_blamed(section),
        Problem::MissingSection { section, .. } => is_blamed(section),
        _ => false,
    }
}

/// Sorting key of a fault: files before the command line, then lines in order. A fault without a line comes last in its
/// file.
fn rank(fault: &SceneError) -> (bool, String, usize) {
    match &fault.place {
        Place::File { path, line } => {
            let path = path.to_string_lossy().into_owned();
            (false, path, line.unwrap_or(usize::MAX))
        }
        Place::Set(_) => (true, String::new(), 0),
    }
}

/// Combines several results: returns the values of all results, or the faults of all failed results.
pub trait All {
    /// The tuple of values.
    type Values;

    /// See [`All`].
    fn all(self) -> Result<Self::Values, SceneError>;
}

macro_rules! all {
    ($($name:ident),+) => {
        impl<$($name),+> All for ($(Result<$name, SceneError>,)+) {
            type Values = ($($name,)+);

            #[allow(non_snake_case)]
            fn all(self) -> Result<Self::Values, SceneError> {
                let ($($name,)+) = self;
                let mut faults = Faults::default();
                $(let $name = faults.value_or_record($name);)+
                faults.into_result()?;
                match ($($name,)+) {
                    ($(Some($name),)+) => Ok(($($name,)+)),
                    _ => unreachable!("what has no value has a fault"),
                }
            }
        }
    };
}

all!(A, B);
all!(A, B, C);
all!(A, B, C, D);
all!(A, B, C, D, E);
all!(A, B, C, D, E, F);
