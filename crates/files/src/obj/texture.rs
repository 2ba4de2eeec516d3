//! The texture coordinates of an OBJ file, and what an MTL file says of a texture.

use glam::DVec2;

use super::{cut, lines::values, tangents::each_face};
use crate::{input::quoted, mask::Channel};

/// Returns the texture coordinates of the corners of each triangle of a file that
/// [`ObjFile::parse`](super::ObjFile::parse) has accepted, in the order of its parts; `None` where a
/// corner has none, or has one that is not a number.
pub fn textures(bytes: &[u8]) -> Vec<Option<[DVec2; 3]>> {
    let mut found = Vec::new();
    each_face(bytes, |polygon, texture| {
        for triangle in cut(polygon) {
            let [a, b, c] = triangle.map(|i| texture[i].filter(|t| t.is_finite()));
            found.push(a.zip(b).zip(c).map(|((a, b), c)| [a, b, c]));
        }
    });
    found
}

/// A texture as an MTL file names it: `map_d -s 2 2 -clamp on leaf.png`.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureMap {
    /// File name, as written.
    pub file: String,
    /// Factor of the texture coordinates (`-s`).
    pub scale: DVec2,
    /// What is added to the texture coordinates after that (`-o`).
    pub offset: DVec2,
    /// Whether the texels of the border go on outside the picture (`-clamp on`).
    pub clamp: bool,
    /// What is added to values, and the factor that they have before (`-mm`).
    pub range: [f64; 2],
    /// The channel (`-imfchan`), if one is named.
    pub channel: Option<Channel>,
}

impl TextureMap {
    /// Reads options and file name. Error, in words: an option is not known, not supported or
    /// without its value, or there is no file name.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut map = Self {
            file: String::new(),
            scale: DVec2::ONE,
            offset: DVec2::ZERO,
            clamp: false,
            range: [0.0, 1.0],
            channel: None,
        };
        let mut rest = text.trim();
        while rest.starts_with('-') {
            let option = word(&mut rest);
            match option.to_ascii_lowercase().as_str() {
                "-s" => map.scale = pair(option, &mut rest, 1.0)?,
                "-o" => map.offset = pair(option, &mut rest, 0.0)?,
                "-t" => {
                    if pair(option, &mut rest, 0.0)? != DVec2::ZERO {
                        return Err("`-t` (turbulence) is not supported".into());
                    }
                }
                "-mm" => map.range = [number(option, &mut rest)?, number(option, &mut rest)?],
                "-clamp" => {
                    map.clamp = match word(&mut rest) {
                        "on" => true,
                        "off" => false,
                        other => {
                            return Err(format!("`-clamp` {}, must be on or off", quoted(other)));
                        }
                    }
                }
                "-imfchan" => {
                    map.channel = Some(match word(&mut rest) {
                        "r" => Channel::Red,
                        "g" => Channel::Green,
                        "b" => Channel::Blue,
                        "m" => Channel::Alpha,
                        "l" => Channel::Luminance,
                        other => {
                            let other = quoted(other);
                            return Err(format!("`-imfchan` {other}, must be r, g, b, m or l"));
                        }
                    });
                }
                // these change how a texture is filtered, which a threshold has no use for
                "-blendu" | "-blendv" | "-cc" | "-boost" | "-texres" | "-bm" | "-type" => {
                    word(&mut rest);
                }
                _ => return Err(format!("the option {} is not known", quoted(option))),
            }
        }
        let name = rest.split(" #").next().unwrap_or_default().trim();
        map.file = name.trim_matches('"').to_string();
        if map.file.is_empty() {
            return Err("there is no file name".into());
        }
        Ok(map)
    }

    /// Returns where on the picture a texture coordinate lies.
    pub fn place(&self, at: DVec2) -> DVec2 {
        at * self.scale + self.offset
    }
}

/// Takes the next word off a text.
fn word<'a>(rest: &mut &'a str) -> &'a str {
    let found = values(rest).next().unwrap_or_default();
    let after = rest.find(found).map_or("", |at| &rest[at + found.len()..]);
    *rest = after.trim_start();
    found
}

fn number(option: &str, rest: &mut &str) -> Result<f64, String> {
    let text = word(rest);
    let found = text.parse().ok().filter(|x: &f64| x.is_finite());
    found.ok_or_else(|| format!("{} {}, must be a number", quoted(option), quoted(text)))
}

/// Takes one to three numbers u, v, w off a text. A v that is missing is `otherwise`.
fn pair(option: &str, rest: &mut &str, otherwise: f64) -> Result<DVec2, String> {
    let mut found = DVec2::new(number(option, rest)?, otherwise);
    for i in 1..3 {
        match values(rest).next().and_then(|text| text.parse::<f64>().ok()) {
            Some(_) if i == 2 => _ = number(option, rest)?,
            Some(_) => found.y = number(option, rest)?,
            None => break,
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_come_before_the_file() {
        let plain = TextureMap::parse("leaf 2.png # green").unwrap();
        assert_eq!((plain.file.as_str(), plain.channel), ("leaf 2.png", None));
        assert_eq!(plain.place(DVec2::new(0.25, 3.0)), DVec2::new(0.25, 3.0));
        let all = "-s 2 3 1 -o 0.5 -clamp on -mm 0 2 -imfchan m -blendu off \"a b.tga\"";
        let all = TextureMap::parse(all).unwrap();
        assert_eq!(all.place(DVec2::ONE), DVec2::new(2.5, 3.0));
        assert_eq!((all.file.as_str(), all.clamp, all.range), ("a b.tga", true, [0.0, 2.0]));
        assert_eq!(all.channel, Some(Channel::Alpha));
        for (text, problem) in [
            ("", "no file name"),
            ("-s", "must be a number"),
            ("-o nan 1 a.png", "must be a number"),
            ("-clamp a.png", "must be on or off"),
            ("-imfchan z a.png", "must be r, g, b, m or l"),
            ("-t 1 0 0 a.png", "turbulence"),
            ("-glow 1 a.png", "`-glow` is not known"),
        ] {
            let error = TextureMap::parse(text).unwrap_err();
            assert!(error.contains(problem), "{text}: {error}");
        }
    }
}
