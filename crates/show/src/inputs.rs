//! Inputs of a scene as people call them.

use phylux_results::result::LightNames;

/// Returns an input, given as a pointer into the scene file, in words:
/// `/materials/leaf/back/reflectance` is `leaf, back, reflectance`, and `/lights/0/power` is
/// `light 0, power`.
pub(crate) fn plain(pointer: &str) -> String {
    let text = match pointer.strip_prefix("/lights/") {
        Some(light) => {
            let is_number = light.split('/').next().is_some_and(|of| of.parse::<u32>().is_ok());
            format!("{}{}", if is_number { "light " } else { "" }, light.replace('/', ", "))
        }
        None => pointer.trim_start_matches("/materials/").replace(['/', '#'], ", "),
    };
    text.replace("~1", "/").replace("~0", "~")
}

/// Returns an input, or inputs that vary together, in words, with the names of lights: those of one
/// thing have its name once, as in `leaf, reflectance and transmittance`.
pub(crate) fn named(parameters: &str, lights: &LightNames) -> String {
    let all: Vec<String> = lights.pointers(parameters).map(|one| plain(&one)).collect();
    let parts: Option<Vec<(&str, &str)>> = all.iter().map(|one| one.rsplit_once(", ")).collect();
    match parts.as_deref() {
        Some([(thing, _), others @ ..]) if others.iter().all(|(of, _)| of == thing) => {
            let own: Vec<&str> = parts.iter().flatten().map(|(_, own)| *own).collect();
            format!("{thing}, {}", own.join(" and "))
        }
        _ => all.join(" with "),
    }
}

#[cfg(test)]
mod tests {
    use phylux_results::result::LightNames;

    use super::{named, plain};

    #[test]
    fn inputs_that_vary_together() {
        let lights = LightNames::of(&[]);
        for (inputs, words) in [
            (
                "/materials/leaf/reflectance, /materials/leaf/transmittance",
                "leaf, reflectance and transmittance",
            ),
            (
                "/materials/wall/reflectance, /lights/0/power",
                "wall, reflectance with light 0, power",
            ),
            ("/materials/wall/reflectance", "wall, reflectance"),
            (
                "/materials/leaf, young/reflectance, /materials/leaf, young/transmittance",
                "leaf, young, reflectance and transmittance",
            ),
        ] {
            assert_eq!(named(inputs, &lights), words);
        }
    }

    #[test]
    fn inputs_in_words() {
        for (pointer, words) in [
            ("/materials/leaf/back/reflectance", "leaf, back, reflectance"),
            ("/materials/a~1b#reflected", "a/b, reflected"),
            ("/lights/0/power", "light 0, power"),
            ("/lights/3", "light 3"),
            ("/lights/row 1, lamp~0#2/power", "row 1, lamp~#2, power"),
            ("glass#tint", "glass, tint"),
        ] {
            assert_eq!(plain(pointer), words);
        }
    }
}
