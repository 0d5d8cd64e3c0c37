//! Bytes of the files of a run's iterations, table by table as they are written: dense columns of doubles that do not compress
//! to much less than they are, sparse ones that hold what is in contact or worn, and the fixed size of small files.

use crate::scene::Scene;

/// A column of a value in every cell of a rough contact (gap, slip path) after compression, and of a sphere's.
const DENSE: f64 = 6.75;
const SMOOTH: f64 = 3.1;
/// A value of a sparse column, with its share of what tells the others away.
const SPARSE: f64 = 8.2;
const WORN: f64 = 8.5;
/// Files of an iteration whose size hardly varies: with a surface, of a cycle, of wear, of a vibration; and of curves.
const STATIC: f64 = 21e3;
const CYCLE: f64 = 7e3;
const WEAR: f64 = 9.5e3;
const VIBRATION: f64 = 40e3;
const LEDGER: f64 = 7e3;
const CURVE: f64 = 1.7e3;
/// A forced response, and the response of the worn joint with it.
const FORCED: f64 = 10e3;
const WORN_RESPONSE: f64 = 5e3;
/// A row of the response, of a contact element and of a point of the joint's cycle.
const RESPONSE_ROW: f64 = 25.0;
const ELEMENT: f64 = 2.5;

/// What the bytes depend on.
pub(super) struct Files {
    pub cells: f64,
    /// Tangential axes; none without a cycle.
    pub axes: Option<f64>,
    pub smooth: bool,
    pub worn: bool,
    pub contact_elements: f64,
}

impl Files {
    /// An iteration whose contact has this part of the joint.
    pub fn iteration(&self, scene: &Scene, area: f64) -> f64 {
        let vibration = scene.dynamics.as_ref().map_or(0.0, |dynamics| {
            let ports = 3.0 * self.contact_elements + 3.0;
            let response = RESPONSE_ROW * ports * dynamics.harmonics.len() as f64;
            VIBRATION + response + ELEMENT * self.contact_elements
        });
        if self.cells == 0.0 {
            return vibration;
        }
        let dense = if self.smooth { SMOOTH } else { DENSE };
        // Pressure; of a cycle the shear along each axis and the energy besides.
        let (dense_fields, sparse_fields) = match self.axes {
            None => (1.0, 1.0),
            Some(axes) => (2.0, 2.0 + axes),
        };
        let fields = self.cells * (dense_fields * dense + sparse_fields * SPARSE * area);
        let cycle = self.axes.map_or(0.0, |_| CYCLE);
        let worn = if self.worn {
            WEAR + WORN * area * self.cells
        } else {
            0.0
        };
        let ledger = if vibration > 0.0 { LEDGER } else { 0.0 };
        STATIC + fields + cycle + worn + vibration + ledger
    }

    /// The curves of an iteration that has them.
    pub fn curves(&self) -> f64 {
        CURVE * if self.axes.is_some() { 2.0 } else { 1.0 }
    }

    /// A forced response, of a worn joint or the unworn one.
    pub fn forced(&self, worn: bool) -> f64 {
        FORCED + if worn { WORN_RESPONSE } else { 0.0 }
    }
}
