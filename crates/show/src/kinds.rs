//! What a material stands for, such as a leaf or soil: it gives a picture its typical colours where
//! bands are too broad to tell them.

use glam::Vec3;

use phylux_core::scene::{
    material::{Material, Scatterer},
    world::NamedMaterial,
};

/// What a material stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// Leaves, stems and other green parts of plants.
    Plant,
    /// Soil, and what plants grow in.
    Soil,
    /// Wood, bark and straw.
    Wood,
    /// Pots and bricks of fired clay.
    Clay,
    /// Metal and mirrors.
    Metal,
    /// Glass, water and whatever else one sees through.
    Glass,
    /// Walls and all else.
    Other,
}

/// Words in the names of materials, in small letters, and what such a material stands for.
const WORDS: [(Kind, &[&str]); 6] = [
    (
        Kind::Plant,
        &[
            "leaf", "leaves", "stem", "petiole", "plant", "canopy", "crop", "grass", "turf",
            "foliage", "lettuce", "shoot", "vein", "moss", "lawn", "needle",
        ],
    ),
    (Kind::Soil, &["soil", "ground", "earth", "peat", "substrate", "compost", "humus"]),
    (Kind::Wood, &["wood", "bark", "trunk", "straw", "branch", "timber", "twig"]),
    (Kind::Clay, &["pot", "clay", "terracotta", "brick"]),
    (Kind::Metal, &["alumin", "steel", "metal", "zinc", "reflector"]),
    (Kind::Other, &["screen", "wall", "paint", "film"]),
];

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 7] =
        [Self::Plant, Self::Soil, Self::Wood, Self::Clay, Self::Metal, Self::Glass, Self::Other];

    /// Returns what a material stands for. Its name tells, if one of its words begins with a word
    /// that is known; if none does, a material of type `leaf` is a plant, a mirror is metal, and
    /// one that can be seen through is glass.
    pub fn of(NamedMaterial { name, material }: &NamedMaterial) -> Self {
        if material.is_clear() {
            return Self::Glass;
        }
        match (Self::named(name), material) {
            (Some(kind), _) => kind,
            (None, Material::Leaf(_)) => Self::Plant,
            (None, _) if !material.is_diffuse() => Self::Metal,
            (None, _) => Self::Other,
        }
    }

    /// Returns what a name tells, if one of its words begins with a word that is known.
    fn named(name: &str) -> Option<Self> {
        let name = name.to_lowercase();
        let words = || name.split(|c: char| !c.is_alphabetic());
        let begins = |known: &&str| words().any(|word| word.starts_with(known));
        let known = WORDS.iter().find(|(_, known)| known.iter().any(begins));
        known.map(|(kind, _)| *kind)
    }

    /// Returns the name of the kind, as in the key of a picture.
    pub fn name(self) -> &'static str {
        match self {
            Self::Plant => "plants",
            Self::Soil => "soil",
            Self::Wood => "wood",
            Self::Clay => "clay",
            Self::Metal => "metal",
            Self::Glass => "glass",
            Self::Other => "other",
        }
    }

    /// Returns the reflectance that things of this kind typically have at a wavelength, nm, relative
    /// to their brightest in 400 to 700 nm. Leaves are green: chlorophyll takes blue and red, and
    /// hardly the light about 550 nm. Soil, wood and clay reflect the more the longer the waves. All
    /// else is grey.
    pub fn reflectance(self, nm: f32) -> f32 {
        let bell = |middle: f32, width: f32| (-0.5 * ((nm - middle) / width).powi(2)).exp();
        let rise = |from: f32, to: f32| {
            let t = ((nm - from) / (to - from)).clamp(0.0, 1.0);
            t * t * (3.0 - 2.0 * t)
        };
        match self {
            Self::Plant => {
                let edge = rise(685.0, 740.0);
                (0.26 + 0.74 * bell(553.0, 38.0) + 0.16 * bell(615.0, 40.0)).max(edge * 2.0)
            }
            Self::Soil => 0.36 + 0.64 * rise(400.0, 700.0),
            Self::Wood => 0.30 + 0.70 * rise(390.0, 680.0),
            Self::Clay => 0.22 + 0.78 * rise(500.0, 640.0),
            Self::Metal | Self::Glass | Self::Other => 1.0,
        }
    }

    /// Returns a clear colour for the kind in drawings on a dark ground, linear sRGB.
    pub fn mark(self) -> Vec3 {
        crate::picture::linear(match self {
            Self::Plant => Vec3::new(0.45, 0.90, 0.42),
            Self::Soil => Vec3::new(0.83, 0.55, 0.33),
            Self::Wood => Vec3::new(0.96, 0.76, 0.42),
            Self::Clay => Vec3::new(0.98, 0.45, 0.36),
            Self::Metal => Vec3::new(0.55, 0.72, 1.0),
            Self::Glass => Vec3::new(0.42, 0.95, 1.0),
            Self::Other => Vec3::new(0.78, 0.68, 1.0),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names tell what a material stands for, in whatever case, with whatever stands around them.
    #[test]
    fn names_tell_kinds() {
        for (name, kind) in [
            ("Stem_2", Some(Kind::Plant)),
            ("young leaf", Some(Kind::Plant)),
            ("dark soil", Some(Kind::Soil)),
            ("pale wood", Some(Kind::Wood)),
            ("pot", Some(Kind::Clay)),
            ("aluminium", Some(Kind::Metal)),
            ("screen", Some(Kind::Other)),
            ("spot", None),
            ("", None),
        ] {
            assert_eq!(Kind::named(name), kind, "{name}");
        }
    }
}
