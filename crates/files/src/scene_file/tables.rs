//! Loads measured materials: files of a scattering function, and covers by the angle of incidence.

use std::path::Path;

use super::{loader::Loader, notes::TableNote, numbers::single, spec::*};
use crate::scatter_table::{self, ScatterTable, Side, Wanted};
use phylux_core::{
    error::Result,
    scene::material::{Bsdf, Cover, CoverRow, Material},
};

/// The most angles of incidence of a cover.
const MAX_ANGLES: usize = 1000;

/// A mean difference of f(i, o) and f(o, i), relative to their mean, above this leads to a warning.
const NOT_RECIPROCAL: f64 = 0.05;

impl Loader<'_> {
    /// Loads a measured material: the file that it names, or a cover.
    pub(super) fn table_material(&mut self, pointer: &str, file: &TableSpec) -> Result<Material> {
        let Some(name) = &file.file else {
            if file.reciprocal.is_some() {
                return Err(self
                    .error(format!("{pointer}/reciprocal"), "goes with `file` only")
                    .remedy("leave it out"));
            }
            return self.cover(pointer, file);
        };
        let by_angle = [
            ("angles_deg", file.angles_deg.is_some()),
            ("direct", file.direct.is_some()),
            ("diffuse", file.diffuse.is_some()),
            ("reflectance", file.reflectance.is_some()),
        ];
        let remedy = "give the file, or the values by angle";
        self.refuse_given(pointer, &by_angle, "does not go with `file`", remedy)?;
        let path = self.files.sibling(name);
        let bytes = self.files.bytes(&format!("{pointer}/file"), &path)?;
        self.table_file(pointer, &path, &bytes, file.reciprocal == Some(true), Side::Outside)
    }

    /// Loads a scattering function from the `bytes` of the file at `path`, for a material at
    /// `place`. In a file of WINDOW, `front` says which side of the device is the front here.
    pub(super) fn table_file(
        &mut self,
        place: &str,
        path: &Path,
        bytes: &[u8],
        reciprocal: bool,
        front: Side,
    ) -> Result<Material> {
        let names = self.band_names();
        let limits = self.parts.bands.iter().map(|band| Some([band.from_nm?, band.to_nm?]));
        let limits: Vec<Option<[f64; 2]>> = limits.collect();
        let wanted = Wanted { bands: &names, limits: &limits, named: self.bands_named, front };
        let ScatterTable { mut faces, mut warnings, tolerated } =
            scatter_table::parse(bytes, path, wanted)?;
        let found = faces.reciprocity();
        if reciprocal {
            faces.make_reciprocal();
        }
        let made = Bsdf::tolerating(tolerated, &faces, &names);
        let (bsdf, most) = made.map_err(|problem| problem.at(path.display()))?;
        if most > Bsdf::ROUNDED {
            let problem = format!(
                "of the light from one direction {most:.4} goes on, more than comes: all values are \
                 scaled by {:.4}",
                1.0 / most
            );
            warnings.push(problem);
        }
        for warning in warnings {
            self.told.warn(path.display(), warning);
        }
        if found.error > NOT_RECIPROCAL && !reciprocal {
            let problem = format!(
                "f(i, o) and f(o, i) differ by {:.1} % of their mean, which no surface does: `\"reciprocal\": true` takes the \
                mean of both (docs/scene-format.md#table)",
                100.0 * found.error
            );
            self.told.warn(path.display(), problem);
        }
        self.told.tables.push(TableNote { pointer: place.into(), reciprocity: found.error });
        Ok(Material::Table(bsdf.into()))
    }

    /// Loads a cover, whose values are given by the angle of incidence.
    fn cover(&mut self, pointer: &str, file: &TableSpec) -> Result<Material> {
        let Some(angles) = &file.angles_deg else {
            return Err(self.error(pointer, "a table with neither `file` nor `angles_deg`").remedy(
                "name a file, or give the angles of incidence with `direct`, `diffuse` or both at each",
            ));
        };
        if file.direct.is_none() && file.diffuse.is_none() {
            return Err(self
                .error(pointer, "neither `direct` nor `diffuse`")
                .remedy("give the transmittance at each angle, straight on or scattered"));
        }
        if angles.is_empty() || angles.len() > MAX_ANGLES {
            let problem = format!("{} angles, must be 1 to {MAX_ANGLES}", angles.len());
            return Err(self
                .error(format!("{pointer}/angles_deg"), problem)
                .remedy("0, 20, 40, 60 and 80 degrees do for most covers"));
        }
        for (i, pair) in angles.windows(2).enumerate() {
            if pair[1] <= pair[0] {
                let place = format!("{pointer}/angles_deg/{}", i + 1);
                let problem = format!("{} after {}: angles rise", pair[1], pair[0]);
                return Err(self.error(place, problem).remedy("sort the entries by angle"));
            }
        }
        for (i, angle) in angles.iter().enumerate() {
            self.in_range(&format!("{pointer}/angles_deg/{i}"), *angle, 0.0, 90.0)?;
        }
        let [direct, diffuse, reflectance] = [
            ("direct", &file.direct),
            ("diffuse", &file.diffuse),
            ("reflectance", &file.reflectance),
        ]
        .map(|(key, values)| self.by_angle(pointer, key, values.as_deref(), angles.len()));
        let rows = angles.iter().zip(direct?).zip(diffuse?).zip(reflectance?);
        let rows = rows.map(|(((&angle_deg, direct), diffuse), reflectance)| CoverRow {
            angle_deg,
            direct,
            diffuse,
            reflectance,
        });
        let cover = Cover::new(rows.collect(), &self.band_names());
        let place = self.place(pointer);
        Ok(Material::Table(cover.map_err(|problem| problem.at(place))?.into()))
    }

    /// Returns one fraction per band at each of `angles` angles; all are 0 where `values` is
    /// `None`.
    fn by_angle(
        &self,
        pointer: &str,
        key: &str,
        values: Option<&[PerBand]>,
        angles: usize,
    ) -> Result<Vec<Vec<f32>>> {
        let Some(values) = values else { return Ok(vec![vec![0.0; self.bands()]; angles]) };
        if values.len() != angles {
            let s = if values.len() == 1 { "y" } else { "ies" };
            let problem = format!("{} entr{s} for {angles} angles", values.len());
            return Err(self
                .error(format!("{pointer}/{key}"), problem)
                .remedy("give one entry per angle, a number or one number per band"));
        }
        let entry = |(i, value): (usize, &PerBand)| {
            Ok(single(&self.per_band(&format!("{pointer}/{key}/{i}"), value, 1.0)?))
        };
        values.iter().enumerate().map(entry).collect()
    }
}
