//! One-axis trackers in a control file.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::input::quoted;
use phylux_core::error::{Error, Result, number};

/// Objects that turn about one axis such that their upper faces look to the sun as far as they can.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrackerControl {
    /// The place (a JSON pointer) of the angle that turns, such as
    /// "/objects/4/transform/rotate_deg/1", or a list of them for objects that turn together. At 0
    /// the objects look up.
    pub turn: Turn,
    /// Angles are rounded to multiples of this, deg (default 5); there is a scene for each angle.
    pub step_deg: Option<f64>,
    /// The largest angle to either side, deg (default 60).
    pub limit_deg: Option<f64>,
    /// Ground coverage ratio, the width of a row over the distance of rows: where rows would shade
    /// each other, they turn back until they just do not (default: they do not turn back).
    pub backtrack: Option<f64>,
    /// The angle while the sun is down, deg (default 0).
    pub rest_deg: Option<f64>,
}

/// One place, or several.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "must be a place such as \"/objects/4/transform/rotate_deg/1\", or a list of them"
)]
pub enum Turn {
    /// One place.
    One(String),
    /// Several places.
    Several(Vec<String>),
}

impl Turn {
    /// Returns the places.
    pub fn all(&self) -> &[String] {
        match self {
            Self::One(place) => std::slice::from_ref(place),
            Self::Several(places) => places,
        }
    }
}

impl TrackerControl {
    /// Returns the step, the limit and the angle at rest, deg.
    pub fn angles(&self) -> [f64; 3] {
        let Self { step_deg, limit_deg, rest_deg, .. } = self;
        [step_deg.unwrap_or(5.0), limit_deg.unwrap_or(60.0), rest_deg.unwrap_or(0.0)]
    }

    pub(super) fn check(&self, place: &dyn Fn(&str) -> String) -> Result<()> {
        let [step, limit, rest] = self.angles();
        let backtrack = self.backtrack.unwrap_or(0.5);
        let wrong = [
            ("/step_deg", step, (1.0..=45.0).contains(&step), "1 to 45"),
            ("/limit_deg", limit, limit > 0.0 && limit <= 90.0, "above 0 and at most 90"),
            ("/rest_deg", rest, (-90.0..=90.0).contains(&rest), "-90 to 90"),
            ("/backtrack", backtrack, backtrack > 0.0 && backtrack < 1.0, "between 0 and 1"),
        ];
        if let Some((key, value, _, range)) = wrong.iter().find(|(_, _, right, _)| !right) {
            let problem = format!("{}, must be {range}", number(*value));
            return Err(Error::input(place(key), problem).remedy("correct it"));
        }
        let is_angle = |pointer: &String| {
            let end = pointer.rsplit_once("/transform/rotate_deg/").map(|(_, axis)| axis);
            pointer.starts_with("/objects/")
                && end.is_some_and(|end| ["0", "1", "2"].contains(&end))
        };
        let other = self.turn.all().iter().find(|pointer| !is_angle(pointer));
        match (other, self.turn.all().is_empty()) {
            (None, false) => Ok(()),
            (other, _) => {
                let problem = match other {
                    Some(other) => format!("{} is no angle of an object", quoted(other)),
                    None => "names nothing that turns".into(),
                };
                Err(Error::input(place("/turn"), problem)
                    .remedy("write a place such as \"/objects/4/transform/rotate_deg/1\""))
            }
        }
    }
}
