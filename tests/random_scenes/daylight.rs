//! The daylight of a random room.

use serde_json::{Value, json};

use super::room::Room;

/// Rows and columns of an environment map.
const TEXELS: [usize; 2] = [4, 8];

impl Room {
    /// Adds the sky or an environment map, and in half of the cases the sun, either from everywhere
    /// or through openings only. A scene has at most one of each.
    pub(super) fn daylight(&mut self) {
        if std::mem::replace(&mut self.by_day, true) {
            return;
        }
        // the three colours of a picture are one band or three bands
        let may_be_map = matches!(self.bands, 1 | 3);
        let around = match may_be_map && self.dice.chance(0.6) {
            true => self.map(),
            false => self.sky(),
        };
        self.infinite_light(around);
        if self.dice.chance(0.5) {
            let half_angle = self.dice.one_of(&[0.0, 0.2666, 3.0]);
            let irradiance = self.dice.magnitude(1.0, 100.0);
            self.infinite_light(json!({ "type": "sun", "irradiance": irradiance,
                                   "half_angle_deg": half_angle }));
        }
        let [up, around] = [self.dice.between(5.0, 85.0), self.dice.between(0.0, 360.0)];
        let sun_at = json!({ "elevation_deg": up, "azimuth_deg": around });
        self.world = self.world.clone().with("sun_at", sun_at);
    }

    fn sky(&mut self) -> Value {
        let irradiance = self.dice.magnitude(3.0, 30.0);
        let mut sky = json!({ "type": "sky", "irradiance": irradiance,
            "model": self.dice.one_of(&["uniform", "overcast", "cie"]),
            "ground": self.dice.one_of(&[0.0, 0.3]) });
        if sky["model"] == "cie" {
            sky["cie_type"] = json!(1 + self.dice.below(15));
        }
        sky
    }

    /// Returns an environment map with different texels in each colour, some of them black. If
    /// there are smooth objects in the room, the texels differ less, because paths find bright
    /// texels in mirrors by chance only.
    fn map(&mut self) -> Value {
        let [rows, columns] = TEXELS;
        let darkest = if self.smooth { 125 } else { 118 };
        let mut texels = String::new();
        for texel in 0..rows * columns {
            for _ in 0..3 {
                let black = texel > 0 && self.dice.chance(0.2);
                texels.push(if black { '\0' } else { char::from(64 + self.dice.below(64) as u8) });
            }
            // the exponent; as all bytes are below 128, the file is valid text
            texels.push(char::from(darkest + self.dice.below(128 - usize::from(darkest)) as u8));
        }
        let map = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {rows} +X {columns}\n{texels}");
        self.world = self.world.clone().with_file("map.hdr", &map);
        let strength = self.dice.one_of(&["scale", "irradiance"]);
        json!({ "type": "environment", "file": "map.hdr", strength: self.per_band(3.0, 30.0),
                "heading_deg": self.dice.between(-180.0, 180.0) })
    }

    /// Adds a light that is infinitely far away.
    fn infinite_light(&mut self, mut light: Value) {
        if self.dice.chance(0.4) {
            light["name"] = json!(format!("{} through", light["type"].as_str().expect("a type")));
            light["through"] = self.openings();
        }
        self.world = self.world.clone().light(light);
    }

    /// Returns polygons in front of one or more of the sides without a wall, each smaller or larger
    /// than the side.
    fn openings(&mut self) -> Value {
        let all = (0..6).map(|face| (face / 2, face % 2 == 1));
        let mut sides: Vec<_> = all.filter(|side| !self.walls.contains(side)).collect();
        sides.truncate(1 + self.dice.below(sides.len()));
        let mut polygons = Vec::new();
        for side in sides {
            let away = self.size.min_element() * self.dice.magnitude(1e-3, 0.2);
            let [s, t] = [(); 2].map(|()| self.dice.between(0.4, 0.6));
            let [half_s, half_t] = [(); 2].map(|()| self.dice.between(0.2, 0.6));
            // counter-clockwise seen from outside
            let mut corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            if side.1 {
                corners.reverse();
            }
            polygons.push(corners.map(|(u, v)| {
                let (corner, inward) = self.on_wall(side, s + u * half_s, t + v * half_t);
                self.place(corner - away * inward)
            }));
        }
        json!(polygons)
    }
}
