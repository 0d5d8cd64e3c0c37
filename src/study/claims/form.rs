//! Roughness without the form: what is left of heights beside their Gaussian mean (ISO 16610-61).

/// Weight of the filter is exp(−π (x / (α λ))²).
const ALPHA: f64 = 0.469_718_639_1;

/// Rq \[m\], Sk and Ku [A eq. 4.1, 4.2] of what heights differ by from the mean around them. Heights stand where `kept`, on `cells` of
/// these `steps`, x slow; `cutoff` is the wavelength of which half remains.
pub fn roughness(
    heights: &[f64],
    kept: &[bool],
    cells: [usize; 2],
    steps: [f64; 2],
    cutoff: f64,
) -> [f64; 3] {
    let field = |value: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let each = kept.iter().enumerate();
        each.map(|(k, kept)| if *kept { value(k) } else { 0.0 })
            .collect()
    };
    let mean = blurred(field(&|k| heights[k]), cells, steps, cutoff);
    let weight = blurred(field(&|_| 1.0), cells, steps, cutoff);
    let left = (0..heights.len()).filter(|k| kept[*k]);
    let left: Vec<f64> = left.map(|k| heights[k] - mean[k] / weight[k]).collect();
    moments(&left)
}

/// Rq, Sk and Ku [A eq. 4.1, 4.2].
pub fn moments(values: &[f64]) -> [f64; 3] {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let moment = |power: i32| values.iter().map(|v| (v - mean).powi(power)).sum::<f64>() / n;
    let variance = moment(2);
    [
        variance.sqrt(),
        moment(3) / variance.powf(1.5),
        moment(4) / (variance * variance),
    ]
}

/// Weighted sums along x, then along y.
fn blurred(field: Vec<f64>, [nx, ny]: [usize; 2], steps: [f64; 2], cutoff: f64) -> Vec<f64> {
    let along = |field: &[f64], count: usize, stride: usize, step: f64| {
        let reach = (cutoff / step).ceil() as usize;
        let weight = |k: usize| {
            let part = k as f64 * step / (ALPHA * cutoff);
            (-std::f64::consts::PI * part * part).exp()
        };
        let weights: Vec<f64> = (0..=reach).map(weight).collect();
        let mut sums = vec![0.0; field.len()];
        for (at, sum) in sums.iter_mut().enumerate() {
            let own = at / stride % count;
            let (first, last) = (own.saturating_sub(reach), (own + reach).min(count - 1));
            for other in first..=last {
                *sum += weights[own.abs_diff(other)] * field[at - own * stride + other * stride];
            }
        }
        sums
    };
    let once = along(&field, nx, ny, steps[0]);
    along(&once, ny, 1, steps[1])
}
