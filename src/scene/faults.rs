//! What is wrong with a scene, gathered: whoever has made three mistakes is told of three.

use super::error::{Place, Problem, SceneError};

/// More faults than a person mends in one go are not looked for.
pub const MOST: usize = 50;

/// Faults that are found one after another.
#[derive(Debug, Default)]
pub struct Faults(Vec<SceneError>);

impl Faults {
    /// The value, if there is one; else its faults are noted.
    pub fn keep<T>(&mut self, found: Result<T, SceneError>) -> Option<T> {
        match found {
            Ok(value) => Some(value),
            Err(error) => {
                let left = MOST - self.0.len();
                self.0.extend(error.into_each().take(left));
                None
            }
        }
    }

    /// True once no more are noted.
    pub fn is_full(&self) -> bool {
        self.0.len() >= MOST
    }

    /// All of them as one error, as they were found; nothing if there are none.
    pub fn end(self) -> Result<(), SceneError> {
        let mut faults = self.0.into_iter();
        match faults.next() {
            None => Ok(()),
            Some(first) => Err(SceneError {
                also: faults.collect(),
                ..first
            }),
        }
    }

    /// The faults as one error for who has to mend them: the first of each key, in the order of the lines, and without those that follow
    /// from another one; nothing if there are none.
    pub fn end_sorted(mut self) -> Result<(), SceneError> {
        let blamed: Vec<String> = self.0.iter().filter_map(blamed).collect();
        self.0.retain(|fault| !is_absent(fault, &blamed));
        let mut told: Vec<(Place, Option<String>)> = Vec::new();
        self.0.retain(|fault| {
            let key = fault.problem.key_and_value().0.map(str::to_owned);
            let about = (fault.place.clone(), key);
            let is_new = !told.contains(&about);
            told.push(about);
            is_new
        });
        self.0.sort_by_key(rank);
        self.end()
    }
}

/// What is missing for this fault alone: the key that an unknown one was probably meant to be, or all of a section that is none.
fn blamed(fault: &SceneError) -> Option<String> {
    match fault.problem.as_ref() {
        Problem::UnknownKey { nearest, .. } => nearest.clone(),
        Problem::Type { key, .. } => Some(key.clone()),
        _ => None,
    }
}

/// True of what is missing only since something else is wrong.
fn is_absent(fault: &SceneError, blamed: &[String]) -> bool {
    let is_blamed = |name: &str| blamed.iter().any(|key| key == name);
    match fault.problem.as_ref() {
        Problem::Missing { key, section, .. } => is_blamed(key) || is_blamed(section),
        Problem::MissingSection { section, .. } => is_blamed(section),
        _ => false,
    }
}

/// Files before the command line, lines in their order, and what stands nowhere behind what does.
fn rank(fault: &SceneError) -> (bool, String, usize) {
    match &fault.place {
        Place::File { path, line } => {
            let path = path.to_string_lossy().into_owned();
            (false, path, line.unwrap_or(usize::MAX))
        }
        Place::Set(_) => (true, String::new(), 0),
    }
}

/// Results all of which are wanted: their values, or the faults of each.
pub trait All {
    /// The values.
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
                $(let $name = faults.keep($name);)+
                faults.end()?;
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
