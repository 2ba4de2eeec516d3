//! Reads the intensities of ANSI/IES TM-33 (2018, 2022 and 2023): photons, radiant power or light as
//! the eye sees it, at angles C (`h`) and V (`v`).

use std::path::Path;

use super::{
    file::{FETCH, FluxUnit, MOST, MeasuredLamp, Photometry},
    symmetry::{Plane, Symmetry, symmetry_of},
};
use crate::{
    input::quoted,
    xml::{self, Element},
};
use phylux_core::error::{Error, Result, some};

/// The kinds of intensities, best first: the name of the element of each, that of the table in it,
/// that of its flux, and the unit of this flux.
const KINDS: [([&str; 3], FluxUnit); 3] = [
    (["PhotonData", "PhotonIntensity", "PhotonFlux"], FluxUnit::Micromole),
    (["RadiantData", "RadiantIntensity", "RadiantFlux"], FluxUnit::Watt),
    (["LuminousData", "LuminousIntensity", "LuminousFlux"], FluxUnit::Lumen),
];

/// How far the integral of the intensities may lie from the flux that the file states.
const SAME: f64 = 0.03;

pub(super) fn read(bytes: &[u8], path: &Path) -> Result<Photometry> {
    let root = xml::parse(bytes, path)?;
    if !root.name.starts_with("IESTM33") {
        let problem = format!("its outermost element is {}, not that of TM-33", quoted(&root.name));
        return Err(root.error(path, problem).remedy(
            "intensities are read from TM-33, LM-63 (.ies) and EULUMDAT (.ldt); a TM-27 has a \
             spectrum only",
        ));
    }
    let equipment = root.first("Equipment").and_then(|part| part.first("Gonioradiometer"));
    if let Some(kind) = equipment.and_then(|meter| meter.first("Type"))
        && !kind.text.trim_end().ends_with('C')
    {
        let problem = format!("angles of the type {}, must be C", quoted(&kind.text));
        return Err(kind.error(path, problem).remedy("export it with type C coordinates"));
    }
    let lamps = root.all("Emitter").filter_map(|emitter| read_emitter(emitter, path).transpose());
    let lamps = lamps.collect::<Result<Vec<_>>>()?;
    if lamps.is_empty() {
        let problem =
            "no emitter with `PhotonIntensity`, `RadiantIntensity` or `LuminousIntensity`";
        return Err(root.error(path, problem).remedy("export it with intensities"));
    }
    let usual = (lamps.len() == 1).then_some(0);
    Ok(Photometry { lamps, usual })
}

/// Reads an emitter; `None` if it has no intensities.
fn read_emitter(emitter: &Element, path: &Path) -> Result<Option<MeasuredLamp>> {
    let best = KINDS.iter().find_map(|(names, unit)| {
        let data = emitter.first(names[0])?;
        Some((data, data.first(names[1])?, names, *unit))
    });
    let Some((data, table, names, unit)) = best else { return Ok(None) };
    let planes = Planes::read(table, path)?;
    let number = |element: &Element, what: &str| element.number(path, &element.text, what);
    let multiplier = table.first("Multiplier").map(|m| number(m, "the multiplier")).transpose()?;
    let scale = multiplier.unwrap_or(1.0);
    if !(1e-30..=1e30).contains(&scale) {
        return Err(table.error(path, format!("a multiplier of {scale}")).remedy(FETCH));
    }
    let flux = data.first(names[2]).map(|flux| number(flux, "the flux")).transpose()?;
    let absolute = ["Absolute", "AbsolutePhotometry"].iter().find_map(|name| table.first(name));
    let relative = absolute.is_some_and(|word| word.text.eq_ignore_ascii_case("false"));
    let lamp = MeasuredLamp::new(path, planes.planes, planes.symmetry, &planes.v)?;
    let mut lamp = lamp.scaled(path, scale)?;
    match flux {
        Some(flux) if relative => {
            if !(1e-30..1e30).contains(&flux) {
                let problem = format!("a flux of {flux} {}", unit.name());
                return Err(data.error(path, problem).remedy(FETCH));
            }
            lamp.flux = flux;
        }
        None if relative => {
            let problem = format!("relative intensities, and no `{}`", names[2]);
            return Err(table.error(path, problem).remedy("export it with absolute intensities"));
        }
        Some(flux) if (lamp.flux / flux - 1.0).abs() > SAME => lamp.notes.push(format!(
            "its intensities come to {:.4} {}, which is taken; the flux that it states is {flux}",
            lamp.flux,
            unit.name()
        )),
        _ => {}
    }
    if let Some(factor) = emitter.first("BallastFactor")
        && number(factor, "the ballast factor")? != 1.0
    {
        lamp.notes.push(format!("its ballast factor of {} is not applied", factor.text));
    }
    if let Some(quantity) = emitter.first("Quantity")
        && number(quantity, "the quantity")? != 1.0
    {
        lamp.notes.push(format!(
            "it has {} emitters of one kind: its flux is taken as that of all together",
            quantity.text
        ));
    }
    let end = |name| data.first(name).map(|nm| number(nm, "the wavelength")).transpose();
    lamp.range = match (end("MinWavelength")?, end("MaxWavelength")?) {
        (Some(from), Some(to)) if unit != FluxUnit::Lumen => {
            if !(from < to && from >= 0.0) {
                let problem = format!("a flux from {from} to {to} nm");
                return Err(data.error(path, problem).remedy(FETCH));
            }
            Some([from, to])
        }
        _ => None,
    };
    Ok(Some(MeasuredLamp { unit, ..lamp }))
}

/// The intensities of a table, by planes of C.
struct Planes {
    v: Vec<f64>,
    planes: Vec<Plane>,
    symmetry: Symmetry,
}

impl Planes {
    fn read(table: &Element, path: &Path) -> Result<Self> {
        let error = |problem: String| table.error(path, problem).remedy(FETCH);
        let mut rows: Vec<(f64, f64, f64)> = Vec::new();
        for row in table.all("IntData") {
            let angle = |name: &str, what: &str| row.number(path, row.attribute(name), what);
            let (c, v) = (angle("h", "the angle h")?, angle("v", "the angle v")?);
            let value = row.number(path, &row.text, "the intensity")?;
            if value < 0.0 {
                let problem = format!("an intensity of {value}, must be at least 0");
                return Err(row.error(path, problem).remedy(FETCH));
            }
            rows.push((c, v, value));
        }
        let sorted = |of: fn(&(f64, f64, f64)) -> f64| {
            let mut angles: Vec<f64> = rows.iter().map(of).collect();
            angles.sort_by(f64::total_cmp);
            angles.dedup();
            angles
        };
        let (c, v) = (sorted(|row| row.0), sorted(|row| row.1));
        if c.is_empty() {
            return Err(error("no `IntData` in it".into()));
        }
        if c.len().saturating_mul(v.len()) > MOST {
            let problem = format!("{} x {} angles, more than {MOST} intensities", c.len(), v.len());
            return Err(error(problem));
        }
        for (name, angles) in [("NumberHorz", &c), ("NumberVert", &v)] {
            if let Some(count) = table.first(name)
                && count.number(path, &count.text, "the number of angles")? != angles.len() as f64
            {
                let problem = format!("`{name}` is {}, but there are {}", count.text, angles.len());
                return Err(count.error(path, problem).remedy(FETCH));
            }
        }
        rows.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut planes = Vec::with_capacity(c.len());
        let mut rows = rows.into_iter().peekable();
        for &c in &c {
            let mut values = Vec::with_capacity(v.len());
            for &v in &v {
                match rows.next_if(|row| row.0 == c && row.1 == v) {
                    Some((_, _, value)) => values.push(value),
                    None => return Err(error(format!("no intensity at h = {c}, v = {v}"))),
                }
                if rows.peek().is_some_and(|row| row.0 == c && row.1 == v) {
                    return Err(error(format!("two intensities at h = {c}, v = {v}")));
                }
            }
            planes.push(Plane { c, values });
        }
        let Some(symmetry) = symmetry_of(&c) else {
            let angles = some(&c, 6);
            return Err(table.error(path, format!("horizontal angles {angles}")).remedy(
                "they go from 0 to 90, 180 or 360, or from 90 to 270, or all around, or there is one",
            ));
        };
        check_symmetry(table, path, symmetry)?;
        Ok(Self { v, planes, symmetry })
    }
}

/// Checks that the symmetry that a table names is the one that its angles have.
fn check_symmetry(table: &Element, path: &Path, symmetry: Symmetry) -> Result<()> {
    let Some(named) = table.first("Symm") else { return Ok(()) };
    let word: String = named.text.split([' ', '_']).collect();
    let known = [
        ("SymmFull", Symmetry::Axial),
        ("SymmQuad", Symmetry::Quadrant),
        ("SymmBi0", Symmetry::At0),
        ("SymmBi90", Symmetry::At90),
        ("SymmNone", Symmetry::None),
    ];
    let known = known.into_iter().find(|(name, _)| name.eq_ignore_ascii_case(&word));
    let wrong = |problem: String| -> Error {
        named.error(path, problem).remedy("export it with intensities all around")
    };
    match known {
        // a table may go all around although it is symmetric
        Some((_, one)) if one == symmetry || symmetry == Symmetry::None => Ok(()),
        Some(_) => {
            let problem = format!("`Symm` is {}, which its angles h are not", quoted(&named.text));
            Err(wrong(problem))
        }
        None => Err(wrong(format!("a `Symm` of {}", quoted(&named.text)))),
    }
}
