//! Roughness without the form: deviation of heights from their Gaussian mean (ISO 16610-61).

/// The weight of the filter is exp(−π (x / (α λ))²).
const ALPHA: f64 = 0.469_718_639_1;

/// Computes Rq \[m\], Sk and Ku [A eq. 4.1, 4.2] of the deviations of heights from their local mean.
///
/// The mean and the moments include only heights of cells with `kept`. The grid has `cells` with spacings `steps`, x
/// slowest. The filter halves the amplitude at the wavelength `cutoff`.
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
    let mean = gaussian_sums(field(&|k| heights[k]), cells, steps, cutoff);
    let weight = gaussian_sums(field(&|_| 1.0), cells, steps, cutoff);
    let indices = (0..heights.len()).filter(|k| kept[*k]);
    let deviations: Vec<f64> = indices.map(|k| heights[k] - mean[k] / weight[k]).collect();
    moments(&deviations)
}

/// Computes Rq, Sk and Ku [A eq. 4.1, 4.2].
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

/// Computes weighted sums along x, then along y.
fn gaussian_sums(field: Vec<f64>, [nx, ny]: [usize; 2], steps: [f64; 2], cutoff: f64) -> Vec<f64> {
    let along = |field: &[f64], count: usize, stride: usize, step: f64| {
        let reach = (cutoff / step).ceil() as usize;
        let weight = |k: usize| {
            let part = k as f64 * step / (ALPHA * cutoff);
            (-std::f64::consts::PI * part * part).exp()
        };
        let weights: Vec<f64> = (0..=reach).map(weight).collect();
        let mut sums = vec![0.0; field.len()];
        for (index, sum) in sums.iter_mut().enumerate() {
            let centre = index / stride % count;
            let (first, last) = (
                centre.saturating_sub(reach),
                (centre + reach).min(count - 1),
            );
            for neighbour in first..=last {
                *sum += weights[centre.abs_diff(neighbour)]
                    * field[index - centre * stride + neighbour * stride];
            }
        }
        sums
    };
    let along_x = along(&field, nx, ny, steps[0]);
    along(&along_x, ny, 1, steps[1])
}
