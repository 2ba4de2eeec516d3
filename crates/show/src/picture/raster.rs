//! Turns drawings in SVG into pixels (resvg), with letters of its own: those of the system would
//! make other pictures on other machines.

use std::sync::{Arc, LazyLock};

use resvg::{
    tiny_skia::{Color, Pixmap, Transform},
    usvg::{Options, Tree, fontdb::Database},
};

use super::Picture;
use phylux_core::error::{Error, Result};

/// The letters (Arimo; its licence is beside it).
const LETTERS: &[u8] = include_bytes!("arimo.ttf");

static FONTS: LazyLock<Arc<Database>> = LazyLock::new(|| {
    let mut fonts = Database::new();
    fonts.load_font_data(LETTERS.to_vec());
    fonts.set_sans_serif_family("Arimo");
    Arc::new(fonts)
});

impl Picture {
    /// Pixels to the inch in print.
    pub const PRINT: f32 = 300.0;

    /// Makes a picture of a drawing on white, with so many pixels to the inch (a pixel of the
    /// drawing is 1/96 inch). Error: the text is no drawing, or it is too large.
    pub fn of_svg(svg: &str, per_inch: f32) -> Result<Self> {
        let failed = |problem: String| Error::run("picture", problem);
        let options = Options { fontdb: FONTS.clone(), ..Options::default() };
        let tree = Tree::from_str(svg, &options).map_err(|e| failed(e.to_string()))?;
        let scale = per_inch / options.dpi;
        let [width, height] = [tree.size().width(), tree.size().height()]
            .map(|side| (side * scale).round().max(1.0) as u32);
        let pixels = Pixmap::new(width, height);
        let mut pixels =
            pixels.ok_or_else(|| failed(format!("{width} x {height} pixels are too many")))?;
        pixels.fill(Color::WHITE);
        resvg::render(&tree, Transform::from_scale(scale, scale), &mut pixels.as_mut());
        let (opaque, _) = pixels.data().as_chunks::<4>();
        let rgb = opaque.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect();
        Ok(Self { width: width as usize, height: height as usize, rgb })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A drawing of an inch has 300 pixels, letters among them, and what is no drawing is refused.
    #[test]
    fn a_drawing_has_its_letters() {
        let svg = |text: &str| {
            format!(
                "<svg width=\"1in\" height=\"0.5in\" viewBox=\"0 0 96 48\" \
                 xmlns=\"http://www.w3.org/2000/svg\"><text x=\"5\" y=\"40\" font-size=\"30\" \
                 font-family=\"Arial, sans-serif\">{text}</text></svg>"
            )
        };
        let drawn = |text: &str| {
            let picture = Picture::of_svg(&svg(text), Picture::PRINT).expect("a picture");
            assert_eq!((picture.width, picture.height), (300, 150));
            picture.rgb().iter().filter(|c| **c < 128).count()
        };
        assert_eq!(drawn(""), 0);
        let (one, two) = (drawn("µ"), drawn("µµ"));
        assert!(one > 300 && two == 2 * one || two > one + one / 2, "{one} {two}");
        assert!(Picture::of_svg("no drawing", Picture::PRINT).is_err());
    }
}
