//! The plot of what the leaves of each layer absorbed.

use super::{
    chosen::{Chosen, error_bar, nothing},
    drawing::{Drawn, Plot},
};
use crate::chart::{Chart, Series, Stroke};
use phylux_core::{
    error::{Result, setting},
    words,
};

/// Draws power per area of leaf over height, as steps with errors, and the share of the light that
/// the plants take, where it is known, as the title.
pub(super) fn layers(chosen: &Chosen) -> Result<Plot> {
    let Some(all) = &chosen.result.extras.layers else {
        let remedy = words![
            "give the scene `\"layers\": {\"dz\": 0.1}`, or plot something else (",
            setting("show"),
            ")"
        ];
        return Err(nothing("there are no layers", remedy));
    };
    let (mut steps, mut bars) = (Vec::new(), Vec::new());
    for layer in all.iter().filter(|layer| layer.area > 0.0) {
        let per_area = |power: f64| power / layer.area;
        let value = per_area(layer.absorbed[chosen.band]);
        let error = layer.absorbed_se[chosen.band].map(per_area);
        steps.extend([(value, layer.from), (value, layer.to)]);
        bars.extend(error_bar(0.5 * (layer.from + layer.to), value, error, true));
    }
    if steps.is_empty() {
        let remedy = "give the plants `\"captor\": true` in the scene";
        return Err(nothing("no surface captor is in any layer", remedy));
    }
    let band = chosen.band_name();
    let canopy = chosen.result.extras.canopy.as_ref().map(|canopy| canopy.absorbed[chosen.band]);
    let title = match canopy {
        Some(share) => format!("the plants absorb {:.1} % of {band}", 100.0 * share),
        None => format!("absorbed by layers{}", chosen.of_band()),
    };
    let chart = Chart {
        title,
        x: format!("absorbed per area of leaf, {}", chosen.per_area()),
        y: "height z, m".into(),
        linear_x: true,
        linear_y: true,
        amounts_across: true,
        series: vec![
            Series { name: None, colour: 0, stroke: Stroke::Bars, points: bars },
            Series { name: None, colour: 0, stroke: Stroke::Plain, points: steps },
        ],
        ..Chart::default()
    };
    Ok(Plot { drawn: Drawn::Charts(vec![chart]), notes: Vec::new() })
}
