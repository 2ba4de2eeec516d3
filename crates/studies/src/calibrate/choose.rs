//! The choice of the model. Each block of readings is left out in turn and predicted from the
//! others. The simplest model is chosen whose mean loss is within one standard error of the
//! smallest (Hastie, Tibshirani and Friedman, The Elements of Statistical Learning, 2nd ed.,
//! section 7.10).

use super::fit::{Fit, Point};
use phylux_results::calibration::{Model, ModelErrors};

/// Measures how well `model` predicts each block from the others.
pub fn blocked(
    model: Model,
    points: &[&Point],
    blocks: usize,
    size: [usize; 2],
    prior: Option<f64>,
) -> ModelErrors {
    let [lamps, bands] = size;
    let numbers = match model {
        Model::Common => 1,
        Model::Bands => bands,
        Model::Product => lamps + bands - 1,
        Model::Lamps => lamps * bands,
    };
    let predict = |others: &[&Point], left_out: &[&Point]| {
        // without a prior, an error is only known if there are more readings than numbers to fit
        let enough = prior.is_some() || model != Model::Lamps || {
            (0..bands).all(|b| others.iter().filter(|p| p.band == b).count() > lamps)
        };
        let fit = Fit::new(model, others, size, prior).ok().filter(|_| enough)?;
        Some(left_out.iter().map(|point| fit.predict(std::slice::from_ref(point)).value).collect())
    };
    let Some(predicted) = each_block(points, blocks, predict) else {
        return ModelErrors {
            model,
            numbers,
            blocked_loss: None,
            blocked_loss_se: None,
            blocked_rmse: vec![None; bands],
        };
    };
    let mut losses = vec![[0.0; 2]; blocks];
    for (point, value) in points.iter().zip(&predicted) {
        losses[point.block][0] += (value / point.value - 1.0).powi(2);
        losses[point.block][1] += 1.0;
    }
    let losses: Vec<f64> = losses.iter().map(|[sum, count]| sum / count).collect();
    let n = losses.len() as f64;
    let mean = losses.iter().sum::<f64>() / n;
    let squares: f64 = losses.iter().map(|loss| (loss - mean).powi(2)).sum();
    ModelErrors {
        model,
        numbers,
        blocked_loss: Some(mean),
        blocked_loss_se: Some((squares / (n * (n - 1.0))).sqrt()),
        blocked_rmse: relative_rmse(points, &predicted, bands),
    }
}

/// Predicts all points, each from the points of the other blocks. `None` if there are fewer than
/// two blocks, or if `predict` fails for one.
pub fn each_block(
    points: &[&Point],
    blocks: usize,
    predict: impl Fn(&[&Point], &[&Point]) -> Option<Vec<f64>>,
) -> Option<Vec<f64>> {
    let mut predicted = vec![0.0; points.len()];
    if blocks < 2 {
        return None;
    }
    for block in 0..blocks {
        let (left_out, others): (Vec<usize>, Vec<usize>) =
            (0..points.len()).partition(|&i| points[i].block == block);
        let of = |chosen: &[usize]| chosen.iter().map(|&i| points[i]).collect::<Vec<_>>();
        let values = predict(&of(&others), &of(&left_out))?;
        left_out.iter().zip(values).for_each(|(&i, value)| predicted[i] = value);
    }
    Some(predicted)
}

/// Returns the simplest model that is within one standard error of the best. `compared` is in the
/// order of simplicity.
pub fn simplest(compared: &[ModelErrors]) -> Option<Model> {
    let of = |m: &ModelErrors| Some((m.model, m.blocked_loss?, m.blocked_loss_se?));
    let known: Vec<(Model, f64, f64)> = compared.iter().filter_map(of).collect();
    let best = known.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    known.iter().find(|(_, loss, _)| *loss <= best.1 + best.2).map(|(model, ..)| *model)
}

/// Returns the root of the mean squared error over the mean reading, per band; `None` in a band
/// without readings.
pub fn relative_rmse(points: &[&Point], predicted: &[f64], bands: usize) -> Vec<Option<f64>> {
    let of_band = |band| {
        let mine = points.iter().zip(predicted).filter(|(point, _)| point.band == band);
        let (mut count, mut squares, mut sum) = (0.0, 0.0, 0.0);
        for (point, value) in mine {
            count += 1.0;
            squares += (value - point.value).powi(2);
            sum += point.value;
        }
        (count > 0.0).then(|| f64::sqrt(squares / count) / (sum / count))
    };
    (0..bands).map(of_band).collect()
}

/// Returns slope and intercept of measured over simulated values in one band, by least squares.
/// `None` for fewer than two different simulated values.
pub fn line(points: &[&Point], band: usize) -> Option<[f64; 2]> {
    let mine = || points.iter().filter(|p| p.band == band);
    let x = |p: &Point| p.of_lamps.iter().sum::<f64>();
    let n = mine().count() as f64;
    let mean_x = mine().map(|p| x(p)).sum::<f64>() / n;
    let mean_y = mine().map(|p| p.value).sum::<f64>() / n;
    let spread: f64 = mine().map(|p| (x(p) - mean_x).powi(2)).sum();
    let slope = mine().map(|p| (x(p) - mean_x) * (p.value - mean_y)).sum::<f64>() / spread;
    (n > 1.0 && spread > 0.0).then_some([slope, mean_y - slope * mean_x])
}

/// Returns the values of such lines at `points`. `None` if one of the bands of the points has no
/// line.
pub fn on_lines(lines: &[Option<[f64; 2]>], points: &[&Point]) -> Option<Vec<f64>> {
    let value = |point: &&Point| {
        let [slope, intercept] = lines[point.band]?;
        Some(slope * point.of_lamps.iter().sum::<f64>() + intercept)
    };
    points.iter().map(value).collect()
}
