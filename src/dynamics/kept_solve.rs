//! A solve of the harmonic balance that an interrupted start may have made: what Newton's method led to, as it is kept.

use super::aft::InterfaceElement;
use super::newton_step::{Condition, Frame, State};
use super::{DynamicsError, Energy, HarmonicBalance, Response};
use crate::journal::{Inputs, Reader, Writer};

/// What is kept of a solve.
const FOUND: u64 = 0;
const NOT_CONVERGED: u64 = 1;
/// Another error, which is met again at little cost.
const REFUSED: u64 = 2;

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// Converges `state` at the load `factor`, unless an earlier start has.
    pub(super) fn newton(
        &self,
        state: State,
        factor: f64,
        condition: &Condition,
    ) -> Result<Response, DynamicsError> {
        self.newton_to(self.settings.tolerance, state, factor, condition)
    }

    /// Converges `state` at the load `factor` to `tolerance`, at least that of the settings, unless an earlier start has.
    pub(super) fn newton_to(
        &self,
        tolerance: f64,
        state: State,
        factor: f64,
        condition: &Condition,
    ) -> Result<Response, DynamicsError> {
        let tolerance = tolerance.max(self.settings.tolerance);
        if !self.journal.is_open() {
            return self.newton_from(&mut None, tolerance, state, factor, condition);
        }
        let inputs = self.inputs(&state, factor, condition, tolerance);
        if let Some(kept) = self.journal.take(&inputs) {
            // What is not read is refused again, and stands there already.
            let read = self.read(&kept);
            return read.unwrap_or_else(|| {
                self.newton_from(&mut None, tolerance, state, factor, condition)
            });
        }
        let before = self.effort.spent();
        let result = self.newton_from(&mut None, tolerance, state, factor, condition);
        let spent = self.effort.spent() - before;
        self.journal.add(&inputs, &written(&result, spent));
        result
    }

    /// Converges `state` with the frame of an earlier solve nearby, which is not kept in a journal.
    pub(super) fn newton_from(
        &self,
        frame: &mut Option<Frame>,
        tolerance: f64,
        state: State,
        factor: f64,
        condition: &Condition,
    ) -> Result<Response, DynamicsError> {
        let converge = || self.converge(state, factor, condition, tolerance, frame);
        self.threads.within(converge)
    }

    /// The two branches that `work` leads to, unless an earlier start has followed them; `by` are the numbers that they depend on.
    pub(super) fn kept_branches(
        &self,
        by: &[f64],
        work: impl FnOnce() -> Option<[Vec<Response>; 2]>,
    ) -> Option<[Vec<Response>; 2]> {
        if !self.journal.is_open() {
            return work();
        }
        let inputs = Inputs::default().numbers(by).numbers(&self.load_rows);
        if let Some(kept) = self.journal.take(&inputs)
            && let Some(read) = self.read_branches(&kept)
        {
            return read;
        }
        let before = self.effort.spent();
        let found = work();
        let mut out = Writer::default();
        out.count(self.effort.spent() - before);
        for branch in found.iter().flatten() {
            out.count(branch.len() as u64);
            branch.iter().for_each(|response| write(&mut out, response));
        }
        self.journal.add(&inputs, &out.0);
        found
    }

    /// None of what was not written for this balance; none within of what is not found.
    fn read_branches(&self, kept: &[u8]) -> Option<Option<[Vec<Response>; 2]>> {
        let mut reader = Reader(kept);
        let spent = reader.count()?;
        let mut found = None;
        if !reader.0.is_empty() {
            let mut branch = || {
                let count = reader.count()?;
                let responses = (0..count).map(|_| self.read_response(&mut reader));
                responses.collect::<Option<Vec<_>>>()
            };
            found = Some([branch()?, branch()?]);
        }
        if !reader.0.is_empty() {
            return None;
        }
        self.effort.add(spent);
        Some(found)
    }

    fn inputs(&self, state: &State, factor: f64, condition: &Condition, tolerance: f64) -> Inputs {
        let conditions = match condition {
            Condition::Frequency => vec![],
            Condition::Linear {
                terms,
                by_omega,
                value,
            } => {
                let terms = terms.iter().flat_map(|term| {
                    let [a, b] = term.weights;
                    [term.port as f64, term.slot as f64, a, b]
                });
                terms.chain([*by_omega, *value]).collect()
            }
        };
        Inputs::default()
            .numbers(&[state.omega, factor, tolerance])
            .numbers(&conditions)
            .numbers(&self.load_rows)
            .numbers(&state.contact)
            .flags(&state.active)
    }

    /// None of what was not written for this balance.
    fn read(&self, kept: &[u8]) -> Option<Result<Response, DynamicsError>> {
        let mut reader = Reader(kept);
        let kind = reader.count()?;
        let spent = reader.count()?;
        let result = match kind {
            FOUND => Ok(self.read_response(&mut reader)?),
            NOT_CONVERGED => Err(DynamicsError::NotConverged {
                frequency: reader.number()?,
                load_factor: reader.number()?,
                iterations: reader.count()? as usize,
                correction: reader.number()?,
                tolerance: reader.number()?,
                active: reader.count()? as usize,
                elements: reader.count()? as usize,
            }),
            _ => return None,
        };
        if !reader.0.is_empty() {
            return None;
        }
        self.effort.add(spent);
        Some(result)
    }

    fn read_response(&self, reader: &mut Reader<'_>) -> Option<Response> {
        let n = self.harmonics().coefficients();
        let elements = self.elements.len();
        Some(Response {
            omega: reader.number()?,
            load_factor: reader.number()?,
            iterations: reader.count()? as usize,
            correction: reader.number()?,
            closure: reader.number()?,
            energy: Energy {
                input: reader.number()?,
                friction: reader.number()?,
                viscous: reader.number()?,
                hysteretic: reader.number()?,
            },
            displacement: reader.numbers(self.model.ports() * n)?,
            force: reader.numbers(3 * elements * n)?,
            active: (0..elements)
                .map(|_| Some(reader.count()? != 0))
                .collect::<Option<_>>()?,
        })
    }
}

fn write(out: &mut Writer, response: &Response) {
    out.numbers(&[response.omega, response.load_factor]);
    out.count(response.iterations as u64);
    let energy = &response.energy;
    out.numbers(&[response.correction, response.closure]);
    let Energy {
        input,
        friction,
        viscous,
        hysteretic,
    } = *energy;
    out.numbers(&[input, friction, viscous, hysteretic]);
    out.numbers(&response.displacement);
    out.numbers(&response.force);
    let active = response.active.iter();
    active.for_each(|active| out.count(u64::from(*active)));
}

fn written(result: &Result<Response, DynamicsError>, spent: u64) -> Vec<u8> {
    let mut out = Writer::default();
    match result {
        Ok(response) => {
            out.count(FOUND);
            out.count(spent);
            write(&mut out, response);
        }
        Err(DynamicsError::NotConverged {
            frequency,
            load_factor,
            iterations,
            correction,
            tolerance,
            active,
            elements,
        }) => {
            out.count(NOT_CONVERGED);
            out.count(spent);
            out.numbers(&[*frequency, *load_factor]);
            out.count(*iterations as u64);
            out.numbers(&[*correction, *tolerance]);
            out.count(*active as u64);
            out.count(*elements as u64);
        }
        Err(_) => {
            out.count(REFUSED);
            out.count(spent);
        }
    }
    out.0
}
