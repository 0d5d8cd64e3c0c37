//! Surveys that were made, for the next stage that wants one of the same balance.

use std::cell::RefCell;
use std::collections::VecDeque;

use super::contact_element::ContactElement;
use super::survey::Survey;
use super::{HarmonicBalance, Harmonics, Settings};

/// Surveys that are kept: of the harmonics of a scene, of more of them, and one that was made in vain.
const KEPT: usize = 3;

/// The last surveys of a vibration. A clone has none: it may be of another structure.
#[derive(Debug, Default)]
pub struct Surveyed {
    kept: RefCell<VecDeque<Kept>>,
}

#[derive(Debug)]
struct Kept {
    elements: Vec<ContactElement>,
    harmonics: Harmonics,
    settings: Settings,
    loads: Vec<f64>,
    survey: Survey,
    /// Units of effort that it took.
    spent: u64,
}

impl Clone for Surveyed {
    fn clone(&self) -> Surveyed {
        Surveyed::default()
    }
}

impl Surveyed {
    /// The survey of a balance, which counts as if it were made again: what follows does not depend on who made it.
    pub(super) fn of(&self, balance: &HarmonicBalance<ContactElement>) -> Option<Survey> {
        let all = self.kept.borrow();
        let kept = all.iter().find(|kept| {
            kept.elements == balance.elements()
                && kept.harmonics == *balance.harmonics()
                && kept.settings == balance.settings
                && kept.loads == balance.load_rows
        })?;
        balance.effort.add_units(kept.spent);
        Some(kept.survey.clone())
    }

    pub(super) fn keep(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        survey: &Survey,
        spent: u64,
    ) {
        let mut all = self.kept.borrow_mut();
        all.truncate(KEPT - 1);
        all.push_front(Kept {
            elements: balance.elements().to_vec(),
            harmonics: balance.harmonics().clone(),
            settings: balance.settings,
            loads: balance.load_rows.clone(),
            survey: survey.clone(),
            spent,
        });
    }
}
