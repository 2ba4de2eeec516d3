//! Completes the half-planes in the file of a symmetric lamp to the whole circle.

/// Intensities at all vertical angles for one horizontal angle C, `c`, degrees.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plane {
    pub(super) c: f64,
    pub(super) values: Vec<f64>,
}

/// How the intensities of the given half-planes repeat around the circle; C in degrees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Symmetry {
    /// All half-planes are like the first.
    Axial,
    /// C from 0 to 90, mirrored at both planes.
    Quadrant,
    /// C from 0 to 180, mirrored at the plane of C = 0 and 180.
    At0,
    /// C from 90 to 270, mirrored at the plane of C = 90 and 270.
    At90,
    /// C from 0 to 360, or to the last half-plane before 360.
    None,
}

/// Returns the symmetry that rising horizontal angles imply: there is one angle, or they go from 0 to
/// 90, 180 or 360, or from 90 to 270, or all around with no larger gap between the last and the
/// first than elsewhere. `None` for other angles, or none.
pub(super) fn symmetry_of(c: &[f64]) -> Option<Symmetry> {
    let (&first, &last) = (c.first()?, c.last()?);
    let step = c.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    match (first, last) {
        _ if c.len() == 1 => Some(Symmetry::Axial),
        (0.0, 90.0) => Some(Symmetry::Quadrant),
        (0.0, 180.0) => Some(Symmetry::At0),
        (90.0, 270.0) => Some(Symmetry::At90),
        (0.0.., ..=360.0) if first + 360.0 - last <= step * (1.0 + 1e-9) => Some(Symmetry::None),
        _ => None,
    }
}

/// Angles that differ by less than this are equal, degrees.
const SAME: f64 = 1e-9;

/// Returns the horizontal angles from 0 to 360, degrees, and the intensities there, plane by plane.
pub(super) fn round(given: Vec<Plane>, symmetry: Symmetry) -> (Vec<f64>, Vec<f64>) {
    let mirrors: &[fn(f64) -> f64] = match symmetry {
        Symmetry::Axial => {
            let values = given.into_iter().next().map_or(Vec::new(), |plane| plane.values);
            return (vec![0.0, 360.0], [values.clone(), values].concat());
        }
        Symmetry::Quadrant => &[|c| c, |c| 180.0 - c, |c| 180.0 + c, |c| 360.0 - c],
        Symmetry::At0 => &[|c| c, |c| 360.0 - c],
        Symmetry::At90 => &[|c| c, |c| 180.0 - c],
        Symmetry::None => &[|c| c],
    };
    let mut planes: Vec<Plane> = Vec::with_capacity(mirrors.len() * given.len() + 2);
    for mirror in mirrors {
        planes.extend(given.iter().map(|plane| {
            let c = mirror(plane.c);
            Plane { c: if c < 0.0 { c + 360.0 } else { c }, values: plane.values.clone() }
        }));
    }
    planes.sort_by(|a, b| a.c.total_cmp(&b.c));
    planes.dedup_by(|b, a| b.c - a.c < SAME);
    close(&mut planes);
    let c = planes.iter().map(|plane| plane.c).collect();
    (c, planes.into_iter().flat_map(|plane| plane.values).collect())
}

/// Adds the planes at 0 and 360 if they are missing, interpolated between the last and the first
/// plane.
fn close(planes: &mut Vec<Plane>) {
    let (Some(first), Some(last)) = (planes.first().cloned(), planes.last().cloned()) else {
        return;
    };
    let (at_start, at_end) = (first.c < SAME, last.c > 360.0 - SAME);
    let seam = match (at_start, at_end) {
        (true, _) => first.values,
        (false, true) => last.values,
        (false, false) => {
            let gap = first.c + 360.0 - last.c;
            let part = (360.0 - last.c) / gap;
            let pairs = last.values.iter().zip(&first.values);
            pairs.map(|(a, b)| (1.0 - part) * a + part * b).collect()
        }
    };
    match at_start {
        true => planes[0].c = 0.0,
        false => planes.insert(0, Plane { c: 0.0, values: seam.clone() }),
    }
    match (at_end, planes.last_mut()) {
        (true, Some(last)) => last.c = 360.0,
        _ => planes.push(Plane { c: 360.0, values: seam }),
    }
}
