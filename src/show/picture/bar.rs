//! The colour bar beside a picture.

use super::{
    INK, Picture, Scale, TextSize,
    scale::{colour_at, label},
};

/// The text and the scale of a colour bar.
#[derive(Clone, Debug)]
pub struct Legend {
    /// Lines above the bar: the quantity, the band, the unit.
    pub title: Vec<String>,
    /// The numbers along the bar.
    pub scale: Scale,
}

/// Least height of a picture with a bar, pixels.
const LEAST_HEIGHT: usize = 200;

impl Picture {
    /// Returns the picture with a colour bar to its right.
    pub fn with_bar(&self, legend: &Legend) -> Self {
        let size = TextSize::of(self.height);
        let (em, line) = (size.width(), size.height() + size.height() / 8);
        let most = (self.height.max(LEAST_HEIGHT)) / (3 * line);
        let ticks: Vec<(f64, String)> =
            legend.scale.ticks(most.min(10)).into_iter().map(|tick| (tick, label(tick))).collect();
        let bar = 2 * em;
        let (margin, tick) = (2 * em, em / 2 + 1);
        let letters = |text: &String| text.chars().count();
        let labels = ticks.iter().map(|(_, text)| letters(text)).max().unwrap_or(0) * em;
        let title = legend.title.iter().map(letters).max().unwrap_or(0) * em;
        let inner = title.max(bar + 2 * tick + labels);
        let mut picture = self.widened(inner + 2 * margin, LEAST_HEIGHT);

        let left = self.width + margin;
        for (i, text) in legend.title.iter().enumerate() {
            picture.text(left, line / 2 + i * line, size, text);
        }
        let top = line * (legend.title.len() + 1) + line / 2;
        let bottom = picture.height.saturating_sub(line);
        let height = bottom.saturating_sub(top).max(2);
        for y in 0..height {
            let colour = colour_at(1.0 - y as f64 / (height - 1) as f64);
            (0..bar).for_each(|x| picture.set(left + x, top + y, colour));
        }
        for (value, text) in ticks {
            let y =
                top + ((1.0 - legend.scale.place(value)) * (height - 1) as f64).round() as usize;
            (0..tick).for_each(|x| picture.set(left + bar + x, y, INK));
            picture.text(left + bar + 2 * tick, y.saturating_sub(size.height() / 2), size, &text);
        }
        picture
    }
}
