//! One-axis trackers: objects that turn to the sun, with backtracking (Anderson and Mikofski 2020,
//! Slope-aware backtracking for single-axis trackers, NREL/TP-5K00-76626).

use glam::DVec3;
use serde_json::Value;

use phylux_core::{
    error::{Error, Result},
    math::geometry::Transform,
};
use phylux_files::{control_file::TrackerControl, input::quoted, scene_file::HourlyLights};

/// How an object can turn: its axis, where it looks at the angle 0, at right angles to the axis, and
/// where it turns from there.
#[derive(Clone, Copy, Debug)]
struct Joint {
    zero: DVec3,
    aside: DVec3,
}

impl Joint {
    /// Finds how the angle at this place of a scene turns its object.
    fn of(document: &Value, pointer: &str) -> std::result::Result<Self, &'static str> {
        let none = "is not an angle of the scene";
        let (angles, which) = pointer.rsplit_once('/').ok_or(none)?;
        let angles = document.pointer(angles).and_then(Value::as_array).ok_or(none)?;
        let angles: Vec<f64> = angles.iter().filter_map(Value::as_f64).collect();
        let mut angles: [f64; 3] = angles.try_into().map_err(|_| none)?;
        let which: usize = which.parse().map_err(|_| none)?;
        let looks = |angle: f64, angles: &mut [f64; 3]| {
            *angles.get_mut(which)? = angle;
            Some(Transform::new(1.0, DVec3::from(*angles), DVec3::ZERO).turned(DVec3::Z))
        };
        let mut at = |angle| looks(angle, &mut angles).ok_or(none);
        // what turns is the part at right angles to the axis, by a quarter and by a half of a turn
        let (up, quarter, half) = (at(0.0)?, at(90.0)?, at(180.0)?);
        let zero = 0.5 * (up - half);
        let aside = quarter - 0.5 * (up + half);
        match zero.length() > 1e-6 {
            true => Ok(Self { zero: zero.normalize(), aside: aside.normalize() }),
            false => Err("turns the object about the line along which it looks"),
        }
    }

    /// Returns the angle at which the object looks to the sun as far as it can, deg.
    fn toward(&self, sun: DVec3) -> f64 {
        sun.dot(self.aside).atan2(sun.dot(self.zero)).to_degrees()
    }
}

/// Returns the angle to which rows of this ground coverage ratio turn back from the `ideal` angle,
/// deg, such that they just do not shade each other; `None` if they do not shade each other there.
fn turned_back(ideal: f64, coverage: f64) -> Option<f64> {
    let shade = ideal.to_radians().cos().abs() / coverage;
    (shade < 1.0).then(|| ideal - ideal.signum() * shade.acos().to_degrees())
}

/// Returns for each hour the angle of a tracker, deg. Error: what it turns is no angle of the scene,
/// or turns in another way than the rest of it.
pub(super) fn angles(
    tracker: &TrackerControl,
    document: &Value,
    hourly: &HourlyLights,
    wrong: &dyn Fn(&str, String) -> Error,
) -> Result<Vec<f64>> {
    let mut joint: Option<Joint> = None;
    for pointer in tracker.turn.all() {
        let own = Joint::of(document, pointer).map_err(|why| {
            wrong("/turn", format!("{} {why}", quoted(pointer))).remedy(
                "let the object have `\"rotate_deg\": [0, 0, 0]` and look up with all angles 0",
            )
        })?;
        let first = joint.get_or_insert(own);
        if first.zero.dot(own.zero) < 1.0 - 1e-9 || first.aside.dot(own.aside) < 1.0 - 1e-9 {
            let problem = format!("{} turns about another axis", quoted(pointer));
            return Err(wrong("/turn", problem).remedy("give it a tracker of its own"));
        }
    }
    let Some(joint) = joint else { return Ok(Vec::new()) };
    if tracker.backtrack.is_some() && joint.aside.z.abs() > 1e-6 {
        let problem = "rows turn back only from where they lie flat across their axis";
        return Err(wrong("/backtrack", problem.into()).remedy("leave it out"));
    }
    let [step, limit, rest] = tracker.angles();
    let of = |slot: &phylux_files::weather::Slot| {
        let Some(hour) = slot.hour.map(|h| &hourly.hours[h]) else { return rest };
        let ideal = joint.toward(hour.sun.direction(hourly.north));
        let back = tracker.backtrack.and_then(|coverage| turned_back(ideal, coverage));
        // a row that is flatter than it may be shades no other
        let rounded = match back {
            Some(back) => (back / step + back.signum() * 1e-9).trunc(),
            None => (ideal / step).round(),
        };
        // 0 has no sign
        (step * rounded).clamp(-limit, limit) + 0.0
    };
    Ok(hourly.slots.iter().map(of).collect())
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn rows_turn_back_until_they_do_not_shade_each_other() {
        assert_eq!(turned_back(50.0, 0.4), None);
        for ideal in [-85f64, -70.0, 67.0, 88.0] {
            let angle = turned_back(ideal, 0.4).unwrap();
            assert!(angle.abs() < ideal.abs() && angle * ideal >= 0.0, "{ideal}: {angle}");
            // seen from the sun, the width of a row is the distance of rows
            let width = 0.4 * (ideal - angle).to_radians().cos();
            assert!((width - ideal.to_radians().cos()).abs() < 1e-12, "{ideal}: {angle}");
        }
    }

    #[test]
    fn joints_are_those_of_the_transform() {
        let joint = |angles: Value, which: usize| {
            let document = json!({ "a": angles });
            Joint::of(&document, &format!("/a/{which}"))
        };
        // about an axis to the north it looks to the east at 90 degrees
        let north = joint(json!([0, -30, 0]), 1).unwrap();
        assert!(
            (north.zero - DVec3::Z).length() < 1e-12 && (north.aside - DVec3::X).length() < 1e-12
        );
        assert!((north.toward(DVec3::new(1.0, 5.0, 1.0)) - 45.0).abs() < 1e-12);
        // about one to the west, it looks to the north; a tilted axis stays at right angles
        let west = joint(json!([0, 0, 90]), 1).unwrap();
        assert!((west.aside - DVec3::Y).length() < 1e-12);
        let tilted = joint(json!([20, 0, 0]), 2).unwrap();
        assert!(tilted.zero.z.abs() < 1e-12 && tilted.aside.dot(tilted.zero).abs() < 1e-12);
        assert!(joint(json!([0, 0, 0]), 2).is_err());
        assert!(joint(json!([0, 0]), 1).is_err() && joint(json!([0, 0, 0]), 7).is_err());
    }
}
