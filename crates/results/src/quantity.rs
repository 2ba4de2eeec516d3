//! The registry of quantities: what results say of light, each declared once.
//!
//! From [`QUANTITIES`] results are checked, compared, shown, written to tables and given to Python,
//! and the tables of `docs/results.md` are held to it. Quantities that programs compute with are fields of
//! the results; all others are kept by [`Own`](crate::result::Own) under their names, so that a new
//! one is an entry here and the line that finds it.

use crate::lists::{are_errors, are_values};
use crate::result::{AbsorbedByFace, FaceResult, Ratios, Row, RunResult, Uniformity};

/// What results say of the light on a face, or on a captor, group or layer as a whole.
#[derive(Debug)]
pub struct Quantity {
    /// Its name in tables, and its key in JSON where [`Own`](crate::result::Own) keeps it.
    pub name: &'static str,
    /// Name of arrays of it.
    pub array: &'static str,
    /// What it has a value for.
    pub per: Per,
    /// What it is measured in.
    pub measure: Measure,
    /// Which errors it has.
    pub errors: Errors,
    /// Which results have it.
    pub when: When,
    /// The part of the rows of captors and layers in which tables have it.
    pub captor_rows: Option<u8>,
    /// The part of the rows of a group of several captors.
    pub group_rows: Option<u8>,
    /// Whether results are compared by it.
    pub is_compared: bool,
    /// Whether the value of a group is the mean over the areas of its captors, with independent
    /// errors; else it is found by itself.
    pub is_mean: bool,
    /// One sentence for the schema, where [`Own`](crate::result::Own) keeps it.
    pub meaning: &'static str,
    /// Its keys and its meaning in the tables of `docs/results.md`.
    pub docs: [&'static str; 2],
    find: Find,
}

/// What a quantity has a value for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Per {
    /// Each band and each sum over bands.
    Band,
    /// Each ratio of sums.
    Ratio,
    /// The place, whatever the light.
    Place,
}

/// What a quantity is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// Power, W or umol/s.
    Flux,
    /// Power per area.
    Irradiance,
    /// Power per area and solid angle.
    Radiance,
    /// Daily light integral.
    Dli,
    /// A share or ratio.
    Number,
}

/// Which errors a quantity has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Errors {
    /// None is known.
    No,
    /// By the noise of the simulation.
    Chance,
    /// Also by inputs that are uncertain.
    Inputs,
}

/// Which results have a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum When {
    /// All.
    Always,
    /// Those with a unit of daily light integrals.
    Daily,
    /// Those with ratios.
    Ratios,
    /// Those that have found a value.
    Found,
}

/// How a quantity is found in results.
#[derive(Debug)]
enum Find {
    Face(for<'a> fn(&'a FaceResult) -> Option<Column<'a>>),
    Whole(for<'a> fn(&Row<'a>) -> Option<Column<'a>>),
    /// Of a captor or group as a whole, by face.
    ByFace(for<'a> fn(&Row<'a>) -> Option<[Column<'a>; 2]>),
    Own,
}

/// The values of a quantity at a place, by band or ratio.
#[derive(Clone, Copy, Debug)]
pub struct Column<'a> {
    values: Values<'a>,
    errors: Option<&'a [Option<f64>]>,
    model: Option<&'a [f64]>,
}

/// Values, all of which are known, or some not.
#[derive(Clone, Copy, Debug)]
enum Values<'a> {
    Known(&'a [f64]),
    Perhaps(&'a [Option<f64>]),
}

/// Returns an entry of a quantity of faces, of which all else is as most often.
const fn of_faces(
    name: &'static str,
    measure: Measure,
    find: for<'a> fn(&'a FaceResult) -> Option<Column<'a>>,
) -> Quantity {
    Quantity { measure, ..entry(name, Find::Face(find)) }
}

const fn entry(name: &'static str, find: Find) -> Quantity {
    Quantity {
        name,
        array: name,
        per: Per::Band,
        measure: Measure::Number,
        errors: Errors::Chance,
        when: When::Found,
        captor_rows: None,
        group_rows: None,
        is_compared: false,
        is_mean: false,
        meaning: "",
        docs: [""; 2],
        find,
    }
}

/// All quantities, in the order of tables.
pub static QUANTITIES: [Quantity; 14] = [
    Quantity {
        errors: Errors::Inputs,
        when: When::Always,
        captor_rows: Some(0),
        ..of_faces("flux", Measure::Flux, |face| {
            let found = Column::known(&face.flux, Some(&face.flux_se));
            Some(found.with(face.flux_model_se.as_deref().map(|of| &of.0)))
        })
    },
    Quantity {
        errors: Errors::Inputs,
        when: When::Always,
        captor_rows: Some(0),
        is_compared: true,
        docs: ["`irradiance`, `irradiance_se`", "flux / area: the mean over the captor"],
        ..of_faces("irradiance", Measure::Irradiance, |face| {
            let found = Column::known(&face.irradiance, Some(&face.irradiance_se));
            Some(found.with(face.irradiance_model_se.as_deref().map(|of| &of.0)))
        })
    },
    Quantity {
        when: When::Daily,
        captor_rows: Some(0),
        docs: [
            "`dli`, `dli_se`",
            "daily light integral, mol/m²/d, over a [period](scene-format.md#daylight): 0.0864 × \
             irradiance; of less than a day the sum, 0.0036 × irradiance × hours. In scenes in \
             umol/s, for bands and sums within 400 to 700 nm (else null) and [sums with \
             weights](scene-format.md#sums-and-ratios) of your own; sums of photons by wavelength \
             (`YPF`, `ePAR`, ...) in any scene, lumens never",
        ],
        ..of_faces("dli", Measure::Dli, |face| {
            Some(Column::perhaps(
                face.dli.as_ref()?,
                face.dli_se.as_ref().map(|errors| &errors[..]),
            ))
        })
    },
    Quantity {
        captor_rows: Some(0),
        ..of_faces("knn_irradiance", Measure::Irradiance, |face| {
            let nearest = face.knn.as_ref()?.as_ref()?;
            Some(Column::known(&nearest.irradiance, Some(&nearest.irradiance_se)))
        })
    },
    Quantity {
        captor_rows: Some(0),
        ..of_faces("knn_radiance", Measure::Radiance, |face| {
            let nearest = face.knn.as_ref()?.as_ref()?;
            Some(Column::known(nearest.radiance.as_ref()?, nearest.radiance_se.as_deref()))
        })
    },
    Quantity {
        errors: Errors::No,
        ..of_faces("irradiance_min", Measure::Irradiance, |face| {
            Some(Column::known(face.min.as_ref()?, None))
        })
    },
    Quantity {
        errors: Errors::No,
        ..of_faces("irradiance_max", Measure::Irradiance, |face| {
            Some(Column::known(face.max.as_ref()?, None))
        })
    },
    Quantity {
        group_rows: Some(1),
        docs: ["`min_over_mean`", "the lowest irradiance of a captor over the mean of the group"],
        ..of_faces("min_over_mean", Measure::Number, |face| {
            let Uniformity { min_over_mean, min_over_mean_se, .. } = face.uniformity.as_deref()?;
            Some(Column::perhaps(min_over_mean, Some(min_over_mean_se)))
        })
    },
    Quantity {
        group_rows: Some(1),
        docs: [
            "`cv`",
            "coefficient of variation: the standard deviation of the captors' irradiances, \
             weighted by their areas, over the mean",
        ],
        ..of_faces("cv", Measure::Number, |face| {
            let Uniformity { cv, cv_se, .. } = face.uniformity.as_deref()?;
            Some(Column::perhaps(cv, Some(cv_se)))
        })
    },
    Quantity {
        measure: Measure::Flux,
        errors: Errors::Inputs,
        when: When::Always,
        captor_rows: Some(0),
        is_compared: true,
        ..entry("absorbed", Find::Whole(|row| row.absorbed))
    },
    Quantity {
        array: "ratios",
        per: Per::Ratio,
        errors: Errors::Inputs,
        when: When::Ratios,
        captor_rows: Some(1),
        group_rows: Some(2),
        docs: [
            "`ratio`",
            "numerator / denominator of the light that arrived (was absorbed); null where the \
             denominator found nothing",
        ],
        ..of_faces("ratio", Measure::Number, |face| face.ratios.as_deref().map(Column::of_ratios))
    },
    Quantity {
        array: "absorbed_ratios",
        per: Per::Ratio,
        errors: Errors::Inputs,
        when: When::Ratios,
        captor_rows: Some(1),
        group_rows: Some(2),
        ..entry("absorbed_ratio", Find::Whole(|row| row.absorbed_ratios.map(Column::of_ratios)))
    },
    Quantity {
        measure: Measure::Flux,
        captor_rows: Some(2),
        group_rows: Some(3),
        docs: [
            "`absorbed_by_face`",
            "with [`absorbed_by_face`](scene-format.md#top-level): what was absorbed of the light \
             on `front` and `back` (with `_se`, which are not independent)",
        ],
        ..entry(
            "absorbed_by_face",
            Find::ByFace(|row| {
                let AbsorbedByFace { front, front_se, back, back_se } = row.absorbed_by_face?;
                Some([Column::known(front, Some(front_se)), Column::known(back, Some(back_se))])
            }),
        )
    },
    Quantity {
        per: Per::Place,
        captor_rows: Some(3),
        group_rows: Some(0),
        is_mean: true,
        meaning: "Fraction of the area on which the sun shines, where the scene asks for it.",
        docs: [
            "`sunlit`, `sunlit_se`",
            "with [`sunlit`](scene-format.md#top-level): the fraction of the area that has a \
             straight path to the sun, also through thin panes, by one of its faces or by the \
             front of a sensor that counts one side; of groups the mean over their area. By shadow \
             rays from 72 points (fewer with more than 5,000 captors, at least 8): two in each of \
             36 even parts, whose differences give the error; it is at least one point",
        ],
        ..entry("sunlit", Find::Own)
    },
];

/// The number that stands for a place as a whole, behind those of its front and back.
pub const WHOLE: usize = 2;

impl Quantity {
    /// Returns the quantity with this name. Panics where none has it.
    pub fn named(name: &str) -> &'static Self {
        let found = QUANTITIES.iter().find(|quantity| quantity.name == name);
        found.unwrap_or_else(|| panic!("no quantity `{name}`"))
    }

    /// Returns the quantities that results keep under their names.
    pub fn own() -> impl Iterator<Item = &'static Self> {
        QUANTITIES.iter().filter(|quantity| quantity.is_own())
    }

    /// Returns whether results keep it under its name.
    pub fn is_own(&self) -> bool {
        matches!(self.find, Find::Own)
    }

    /// Returns whether it is an estimate from the nearest photons.
    pub fn is_nearest(&self) -> bool {
        self.name.starts_with("knn_")
    }

    /// Returns whether each face has a value.
    pub fn is_of_faces(&self) -> bool {
        matches!(self.find, Find::Face(_) | Find::ByFace(_))
    }

    /// Returns the number of values at a place, or at a face.
    pub fn width(&self, bands: usize, ratios: usize) -> usize {
        match self.per {
            Per::Band => bands,
            Per::Ratio => ratios,
            Per::Place => 1,
        }
    }

    /// Returns the name of a value, that of a band, sum or ratio.
    pub fn entry<'r>(&self, result: &'r RunResult, entry: usize) -> &'r str {
        match self.per {
            Per::Band => &result.bands[entry].name,
            Per::Ratio => &result.ratios[entry].name,
            Per::Place => "",
        }
    }

    /// Returns the values at a face of a place: front (0), back (1) or the [`WHOLE`].
    pub fn at<'a>(&self, row: &Row<'a>, face: usize) -> Option<Column<'a>> {
        match (&self.find, face) {
            (Find::Face(find), 0 | 1) => find(row.faces[face]?),
            (Find::ByFace(find), 0 | 1) => Some(find(row)?[face]),
            (Find::Whole(find), WHOLE) => find(row),
            (Find::Own, WHOLE) => row.own?.get(self.name),
            _ => None,
        }
    }
}

impl<'a> Column<'a> {
    /// Makes a column of known values and their standard errors.
    pub fn known(values: &'a [f64], errors: Option<&'a [Option<f64>]>) -> Self {
        Self { values: Values::Known(values), errors, model: None }
    }

    /// Makes a column of which some values may be unknown.
    pub fn perhaps(values: &'a [Option<f64>], errors: Option<&'a [Option<f64>]>) -> Self {
        Self { values: Values::Perhaps(values), errors, model: None }
    }

    fn of_ratios(found: &'a Ratios) -> Self {
        let column = Self::perhaps(&found.ratio, Some(&found.ratio_se));
        column.with(found.ratio_model_se.as_deref().map(|of| &of.0))
    }

    /// Adds standard deviations by inputs that are uncertain.
    pub fn with(self, model: Option<&'a Vec<f64>>) -> Self {
        Self { model: model.map(Vec::as_slice), ..self }
    }

    /// Returns whether there are so many values, with errors, and all numbers are possible.
    pub fn is_valid(&self, width: usize) -> bool {
        let values = match self.values {
            Values::Known(values) => are_values(values, width),
            Values::Perhaps(values) => are_errors(values, width),
        };
        values
            && self.errors.is_none_or(|errors| are_errors(errors, width))
            && self.model.is_none_or(|model| are_values(model, width))
    }

    /// Returns a value, where it is known.
    pub fn value(&self, entry: usize) -> Option<f64> {
        match self.values {
            Values::Known(values) => values.get(entry).copied(),
            Values::Perhaps(values) => values.get(entry).copied().flatten(),
        }
    }

    /// Returns the standard error of a value, and its standard deviation by uncertain inputs, where
    /// they are known.
    pub fn errors(&self, entry: usize) -> [Option<f64>; 2] {
        let error = self.errors.and_then(|errors| errors.get(entry).copied().flatten());
        [error, self.model.and_then(|model| model.get(entry).copied())]
    }
}
