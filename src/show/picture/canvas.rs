//! Charts as pixels: a backend of plotters that draws on a [`Picture`] with twice the resolution
//! that the chart is laid out for.

use std::convert::Infallible;

use glam::Vec3;
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
    text_anchor::{HPos, VPos},
};

use super::{PAPER, Picture};

/// Number of pixels across and down for each pixel of the chart's layout.
const FINE: i32 = 2;
/// The letters of all texts.
const LETTERS: RasterHeight = RasterHeight::Size24;

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

/// A picture that charts are drawn on.
pub struct Canvas<'a> {
    pixels: Pixels<'a>,
}

impl<'a> Canvas<'a> {
    /// Makes a blank picture for a chart of this width and height in pixels, with twice as many
    /// pixels across and down.
    pub fn paper((width, height): (u32, u32)) -> Picture {
        let [width, height] = [width, height].map(|side| side as usize * FINE as usize);
        Picture::new(width, std::iter::repeat_n(PAPER, width * height))
    }

    /// Draws on a picture made by [`paper`](Self::paper).
    pub fn new(picture: &'a mut Picture) -> Self {
        Self { pixels: Pixels(picture) }
    }
}

/// The pixels of the picture at their own resolution.
struct Pixels<'a>(&'a mut Picture);

impl Pixels<'_> {
    fn fill(&mut self, from: BackendCoord, to: BackendCoord, colour: BackendColor) -> Drawn {
        let (width, height) = (self.0.width as i32, self.0.height as i32);
        let (left, right) = (from.0.clamp(0, width), to.0.clamp(0, width));
        let (top, bottom) = (from.1.clamp(0, height), to.1.clamp(0, height));
        if colour.alpha < 1.0 {
            let mut places = (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y)));
            return places.try_for_each(|place| self.draw_pixel(place, colour));
        }
        let (r, g, b) = colour.rgb;
        for y in top..bottom {
            let row = 3 * (y * width) as usize;
            let pixels = &mut self.0.rgb[row + 3 * left as usize..row + 3 * right as usize];
            pixels.as_chunks_mut::<3>().0.fill([r, g, b]);
        }
        Ok(())
    }
}

/// A stroke with its width in pixels of the finer picture.
struct Stroke {
    colour: BackendColor,
    width: u32,
}

impl Stroke {
    fn of(style: &impl BackendStyle) -> Self {
        Self { colour: style.color(), width: style.stroke_width() * FINE as u32 }
    }
}

impl BackendStyle for Stroke {
    fn color(&self) -> BackendColor {
        self.colour
    }

    fn stroke_width(&self) -> u32 {
        self.width
    }
}

fn fine((x, y): BackendCoord) -> BackendCoord {
    (x.saturating_mul(FINE), y.saturating_mul(FINE))
}

impl DrawingBackend for Pixels<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        (self.0.width as u32, self.0.height as u32)
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, (x, y): BackendCoord, colour: BackendColor) -> Drawn {
        let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else { return Ok(()) };
        if x < self.0.width && y < self.0.height {
            let at = 3 * (y * self.0.width + x);
            let below = Vec3::from_array([0, 1, 2].map(|c| f32::from(self.0.rgb[at + c]))) / 255.0;
            let (r, g, b) = colour.rgb;
            let above = Vec3::new(r.into(), g.into(), b.into()) / 255.0;
            self.0.set(x, y, below.lerp(above, colour.alpha.clamp(0.0, 1.0) as f32));
        }
        Ok(())
    }
}

impl DrawingBackend for Canvas<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        let (width, height) = self.pixels.get_size();
        (width / FINE as u32, height / FINE as u32)
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, point: BackendCoord, colour: BackendColor) -> Drawn {
        let (x, y) = fine(point);
        (0..FINE * FINE)
            .try_for_each(|i| self.pixels.draw_pixel((x + i % FINE, y + i / FINE), colour))
    }

    fn draw_line<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
    ) -> Drawn {
        self.draw_path([from, to], style)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Drawn {
        if fill {
            // filling a whole page pixel by pixel would take seconds
            return self.pixels.fill(fine(from), fine(to), style.color());
        }
        let corners = [from, (to.0, from.1), to, (from.0, to.1), from];
        self.draw_path(corners, style)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        let style = Stroke::of(style);
        let points: Vec<BackendCoord> = path.into_iter().map(fine).collect();
        // each piece is drawn by itself: a broken line drawn as one outline has gaps where it turns
        // back
        points
            .windows(2)
            .filter(|ends| ends[0] != ends[1])
            .try_for_each(|ends| self.pixels.draw_path(ends.iter().copied(), &style))
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        centre: BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Drawn {
        self.pixels.draw_circle(fine(centre), radius * FINE as u32, &Stroke::of(style), fill)
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        corners: I,
        style: &S,
    ) -> Drawn {
        self.pixels.fill_polygon(corners.into_iter().map(fine), &Stroke::of(style))
    }

    fn draw_text<T: BackendTextStyle>(
        &mut self,
        text: &str,
        style: &T,
        position: BackendCoord,
    ) -> Drawn {
        let letter = get_raster_width(FontWeight::Regular, LETTERS);
        let [width, height] =
            [letter * text.chars().count(), LETTERS.val()].map(|side| side as i32);
        let anchor = style.anchor();
        let left = match anchor.h_pos {
            HPos::Left => 0,
            HPos::Center => -width / 2,
            HPos::Right => -width,
        };
        let top = match anchor.v_pos {
            VPos::Top => 0,
            VPos::Center => -height / 2,
            VPos::Bottom => -height,
        };
        let (turn, colour, (x0, y0)) = (style.transform(), style.color(), fine(position));
        for (i, c) in text.chars().enumerate() {
            let known = |c| get_raster(c, FontWeight::Regular, LETTERS);
            let Some(raster) = known(c).or_else(|| known('?')) else { continue };
            for (row, pixels) in raster.rows().enumerate() {
                for (column, ink) in pixels.iter().enumerate().filter(|(_, ink)| **ink > 0) {
                    let across = left + (i * letter + column) as i32;
                    let (x, y) = turn.transform(across, top + row as i32);
                    let colour = colour.mix(f64::from(*ink) / 255.0);
                    self.pixels.draw_pixel((x0 + x, y0 + y), colour)?;
                }
            }
        }
        Ok(())
    }

    fn estimate_text_size<T: BackendTextStyle>(
        &self,
        text: &str,
        _: &T,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        let letter = get_raster_width(FontWeight::Regular, LETTERS);
        let width = letter * text.chars().count() / FINE as usize;
        Ok((width as u32, LETTERS.val() as u32 / FINE as u32))
    }
}
