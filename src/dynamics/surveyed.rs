//! Surveys that were made, and what was found to bounce, for the next stage that wants one of the same balance.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::sync::Arc;

use super::bouncing::Bouncing;
use super::contact_element::ContactElement;
use super::survey::Survey;
use super::two_springs::TwoSprings;
use super::vibration::Vibration;
use super::{HarmonicBalance, Harmonics, Load, SecondOrder, Settings};

/// Surveys that are kept: of the harmonics of a scene, of more of them, and one that was made in vain.
const KEPT: usize = 3;

/// The last surveys of a vibration. A clone has none: it may be of another structure.
#[derive(Debug, Default)]
pub struct Surveyed {
    kept: RefCell<VecDeque<Kept>>,
    bouncing: RefCell<Option<Arc<Bouncing>>>,
}

impl Surveyed {
    /// What bounces over a range of angular frequencies: what was found last time, if it was the same.
    pub(super) fn bouncing(&self, bouncer: &TwoSprings, range: (f64, f64)) -> Arc<Bouncing> {
        let mut kept = self.bouncing.borrow_mut();
        match &*kept {
            Some(found) if found.of == *bouncer && found.range == range => found.clone(),
            _ => kept.insert(Arc::new(bouncer.bouncing(range))).clone(),
        }
    }
}

#[derive(Debug)]
struct Kept {
    of: Inputs,
    survey: Survey,
    /// Units of effort that it took.
    spent: u64,
}

/// All that a survey follows from.
#[derive(Debug, PartialEq)]
struct Inputs {
    model: SecondOrder,
    loads: Vec<Load>,
    inertial_loads: Vec<Load>,
    load_rows: Vec<f64>,
    response_port: usize,
    range: (f64, f64),
    points: Option<usize>,
    elements: Vec<ContactElement>,
    harmonics: Harmonics,
    /// Those of the vibration: a survey with more of them may cost less.
    asked: Harmonics,
    settings: Settings,
}

impl Inputs {
    fn of(vibration: &Vibration, balance: &HarmonicBalance<ContactElement>) -> Inputs {
        Inputs {
            model: vibration.model.clone(),
            loads: vibration.loads.clone(),
            inertial_loads: vibration.inertial_loads.clone(),
            load_rows: balance.load_rows.clone(),
            response_port: vibration.response_port,
            range: vibration.range,
            points: vibration.points,
            elements: balance.elements().to_vec(),
            harmonics: balance.harmonics().clone(),
            asked: vibration.harmonics.clone(),
            settings: balance.settings,
        }
    }
}

impl Clone for Surveyed {
    fn clone(&self) -> Surveyed {
        Surveyed::default()
    }
}

impl Vibration {
    /// The survey of a balance that was made, which counts as if it were made again: what follows does not depend on who made it.
    pub(super) fn kept_survey(&self, balance: &HarmonicBalance<ContactElement>) -> Option<Survey> {
        let of = Inputs::of(self, balance);
        let mut all = self.surveyed.kept.borrow_mut();
        let place = all.iter().position(|kept| kept.of == of)?;
        let kept = all.remove(place)?;
        balance.effort.add_units(kept.spent);
        let survey = kept.survey.clone();
        all.push_front(kept);
        Some(survey)
    }

    /// Keeps the survey of a balance, which has taken so many units of effort.
    pub(super) fn keep_survey(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        survey: &Survey,
        spent: u64,
    ) {
        let mut all = self.surveyed.kept.borrow_mut();
        all.truncate(KEPT - 1);
        all.push_front(Kept {
            of: Inputs::of(self, balance),
            survey: survey.clone(),
            spent,
        });
    }
}
