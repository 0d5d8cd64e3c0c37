//! Sums and extremes over fields, in a fixed order. Several partial results avoid waiting for each addition.

/// Number of partial results.
pub(crate) const LANES: usize = 8;

/// Returns Σ term(aₖ, bₖ) over two fields of equal length, for several terms in one pass.
pub(crate) fn sums<const TERMS: usize>(
    a: &[f64],
    b: &[f64],
    term: impl Fn(f64, f64) -> [f64; TERMS],
) -> [f64; TERMS] {
    assert_eq!(a.len(), b.len(), "field lengths");
    let mut lanes = [[0.0; LANES]; TERMS];
    let (chunks_a, chunks_b) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let (rest_a, rest_b) = (chunks_a.remainder(), chunks_b.remainder());
    for (a, b) in chunks_a.zip(chunks_b) {
        for k in 0..LANES {
            let terms = term(a[k], b[k]);
            for (lanes, term) in lanes.iter_mut().zip(terms) {
                lanes[k] += term;
            }
        }
    }
    for (k, (a, b)) in rest_a.iter().zip(rest_b).enumerate() {
        for (lanes, term) in lanes.iter_mut().zip(term(*a, *b)) {
            lanes[k] += term;
        }
    }
    lanes.map(|lanes| lanes.iter().sum())
}

/// Returns Σ aₖ bₖ.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    sums(a, b, |a, b| [a * b])[0]
}

/// Returns Σ aₖ.
pub(crate) fn sum(a: &[f64]) -> f64 {
    sums(a, a, |a, _| [a])[0]
}

/// Returns the smallest and the largest value, and (∞, −∞) for an empty slice. The result is meaningless if a value is
/// NaN.
pub(crate) fn extremes(a: &[f64]) -> (f64, f64) {
    let (mut low, mut high) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
    let chunks = a.chunks_exact(LANES);
    let rest = chunks.remainder();
    for a in chunks {
        for k in 0..LANES {
            low[k] = if a[k] < low[k] { a[k] } else { low[k] };
            high[k] = if a[k] > high[k] { a[k] } else { high[k] };
        }
    }
    let low = low
        .iter()
        .chain(rest)
        .copied()
        .fold(f64::INFINITY, f64::min);
    let high = high
        .iter()
        .chain(rest)
        .copied()
        .fold(f64::NEG_INFINITY, f64::max);
    (low, high)
}
