//! Kernels of a half space: displacement at a point under unit traction on a rectangular cell.
//!
//! The kernels are integrals over the cell. The integrands are 1/r, x²/r³, y²/r³ and xy/r³ [A eq. 2.3–2.4; Love 1929;
//! Johnson, Contact Mechanics, §3.2 and §3.6]. The integrals of x/r² and y/r² give the tangential displacement under
//! pressure and the normal displacement under shear.

/// Distance in cell lengths beyond which [`gauss`] replaces the closed forms. Cancellation causes an error of (r/cell)²
/// · 1e-16 in the closed forms. The error of [`gauss`] with four points per side is (cell/2r)⁸ ≈ 1e-12.
const FAR: f64 = 16.0;

/// Gauss–Legendre abscissae on (−1, 1) and weights.
const GAUSS: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
    (-0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
];

/// Four integrals over one cell \[m\].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CellIntegrals {
    /// ∫ 1/r dA.
    pub inverse: f64,
    /// ∫ x²/r³ dA.
    pub xx: f64,
    /// ∫ y²/r³ dA.
    pub yy: f64,
    /// ∫ xy/r³ dA.
    pub xy: f64,
}

/// Computes the integrals over a cell of size `dx` × `dy` \[m\]. The vector from the point of displacement to the
/// centre of the cell is (x, y).
pub fn cell_integrals(x: f64, y: f64, dx: f64, dy: f64) -> CellIntegrals {
    if x.hypot(y) > FAR * dx.max(dy) {
        gauss(x, y, dx, dy)
    } else {
        closed(x, y, dx, dy)
    }
}

fn closed(x: f64, y: f64, dx: f64, dy: f64) -> CellIntegrals {
    let mut sum = CellIntegrals::default();
    for (px, sx) in [(x + 0.5 * dx, 1.0), (x - 0.5 * dx, -1.0)] {
        for (py, sy) in [(y + 0.5 * dy, 1.0), (y - 0.5 * dy, -1.0)] {
            let sign: f64 = sx * sy;
            // y·asinh(x/|y|) is y·ln(x + r) without a term that cancels between the corners. The term y·asinh(x/|y|) is
            // 0 at y = 0.
            let xx = if py == 0.0 {
                0.0
            } else {
                py * (px / py.abs()).asinh()
            };
            let yy = if px == 0.0 {
                0.0
            } else {
                px * (py / px.abs()).asinh()
            };
            sum.inverse += sign * (xx + yy);
            sum.xx += sign * xx;
            sum.yy += sign * yy;
            sum.xy -= sign * px.hypot(py);
        }
    }
    sum
}

fn gauss(x: f64, y: f64, dx: f64, dy: f64) -> CellIntegrals {
    let mut sum = CellIntegrals::default();
    for (a, wa) in GAUSS {
        let px = x + 0.5 * dx * a;
        for (b, wb) in GAUSS {
            let py = y + 0.5 * dy * b;
            let square = px * px + py * py;
            let inverse = wa * wb * 0.25 * dx * dy / square.sqrt();
            sum.inverse += inverse;
            sum.xx += inverse * px * px / square;
            sum.yy += inverse * py * py / square;
            sum.xy += inverse * px * py / square;
        }
    }
    sum
}

/// Computes ∫ x/r² dA and ∫ y/r² dA \[m\] over a cell of size `dx` × `dy` \[m\]. The vector from the point of
/// displacement to the centre of the cell is (x, y).
///
/// The first integral is exactly odd in x, and exactly 0 at x = 0. The second integral is exactly odd in y, and exactly
/// 0 at y = 0.
pub fn coupling_integrals(x: f64, y: f64, dx: f64, dy: f64) -> [f64; 2] {
    if x.hypot(y) > FAR * dx.max(dy) {
        coupling_gauss(x, y, dx, dy)
    } else {
        [coupling_closed(x, y, dx, dy), coupling_closed(y, x, dy, dx)]
    }
}

/// Computes ∫ x/r² dA from ½ y ln r² + x arctan(y/x) at the four corners. A term of the antiderivative that cancels
/// between the corners is omitted.
fn coupling_closed(x: f64, y: f64, dx: f64, dy: f64) -> f64 {
    // Any length may scale r. The cell's own length keeps the logarithms, and thus their cancellation, small.
    let unit = dx * dy;
    let mut sum = 0.0;
    for (py, sy) in [(y + 0.5 * dy, 1.0), (y - 0.5 * dy, -1.0)] {
        for (px, sx) in [(x + 0.5 * dx, 1.0), (x - 0.5 * dx, -1.0)] {
            let logarithm = if py == 0.0 {
                0.0
            } else {
                0.5 * py * ((px * px + py * py) / unit).ln()
            };
            let angle = if px == 0.0 {
                0.0
            } else {
                px * (py / px).atan()
            };
            sum += sx * sy * (logarithm + angle);
        }
    }
    sum
}

fn coupling_gauss(x: f64, y: f64, dx: f64, dy: f64) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for (a, wa) in GAUSS {
        let px = x + 0.5 * dx * a;
        for (b, wb) in GAUSS {
            let py = y + 0.5 * dy * b;
            let weight = wa * wb * 0.25 * dx * dy / (px * px + py * py);
            sum[0] += weight * px;
            sum[1] += weight * py;
        }
    }
    sum
}
