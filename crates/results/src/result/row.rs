//! The rows of the table of results.

use super::{Absorbed, AbsorbedByFace, FaceResult, LayerResult, OfLights, Own, Ratios, Whole};
use crate::quantity::Column;
use phylux_core::{math::stats::Estimate, scene::captor::Channel};

/// A row of the table of results: a captor, a group or a layer, or what it has of one light.
#[derive(Clone, Copy, Debug, Default)]
pub struct Row<'a> {
    /// Its one-sided area, m2.
    pub area: f64,
    /// Its front and, where it counts the back, that.
    pub faces: [Option<&'a FaceResult>; 2],
    /// Power that it absorbed.
    pub absorbed: Option<Column<'a>>,
    /// The parts of it by face.
    pub absorbed_by_face: Option<&'a AbsorbedByFace>,
    /// Ratios of it.
    pub absorbed_ratios: Option<&'a Ratios>,
    /// Power that it absorbed of each light.
    pub by_light: Option<&'a OfLights<Absorbed>>,
    /// Further quantities.
    pub own: Option<&'a Own>,
}

impl Whole {
    /// Returns the row of a captor or group with these faces.
    pub(super) fn row<'a>(&'a self, area: f64, faces: [Option<&'a FaceResult>; 2]) -> Row<'a> {
        let errors = self.absorbed_se.as_deref();
        let absorbed = self.absorbed.as_deref().map(|values| Column::known(values, errors));
        Row {
            area,
            faces,
            absorbed: absorbed.map(|column| column.with(self.absorbed_model_se.as_ref())),
            absorbed_by_face: self.absorbed_by_face.as_deref(),
            absorbed_ratios: self.absorbed_ratios.as_deref(),
            by_light: self.by_light.as_ref(),
            own: Some(&self.own),
        }
    }
}

impl LayerResult {
    /// Returns its row in the table of results.
    pub fn row(&self) -> Row<'_> {
        let absorbed = Some(Column::known(&self.absorbed, Some(&self.absorbed_se)));
        Row { area: self.area, absorbed, own: Some(&self.own), ..Row::default() }
    }
}

impl<'a> Row<'a> {
    /// Returns what it has of one light, by its index.
    pub fn of_light(self, light: usize) -> Self {
        let face = |face: &'a FaceResult| face.by_light.as_ref()?.get_index(light);
        let part = self.by_light.and_then(|lights| lights.get_index(light));
        Self {
            area: self.area,
            faces: self.faces.map(|of| of.and_then(face)),
            by_light: None,
            own: self.own,
            ..part.map(Absorbed::row).unwrap_or_default()
        }
    }

    /// Returns the irradiance on a face, or the absorbed power per area, in a band or sum, W/m2 or
    /// umol/m2/s.
    pub fn per_area(&self, channel: Channel, band: usize) -> Option<Estimate> {
        let face = |face: usize| {
            let FaceResult { irradiance, irradiance_se, .. } = self.faces[face]?;
            Some((Column::known(irradiance, Some(irradiance_se)), 1.0))
        };
        let (column, area) = match channel {
            Channel::Front => face(0)?,
            Channel::Back => face(1)?,
            Channel::Absorbed => (self.absorbed?, self.area),
        };
        let error = column.errors(band)[0];
        let mean = column.value(band)? / area;
        Some(Estimate { mean, standard_error: error.map(|error| error / area) })
    }

    /// Returns it and what it has of each light.
    pub fn parts(self) -> impl Iterator<Item = Self> {
        let of_faces = self.faces.iter().flatten().filter_map(|face| face.by_light.as_ref());
        let lights =
            of_faces.map(|lights| lights.len()).chain(self.by_light.map(OfLights::len)).max();
        std::iter::once(self).chain((0..lights.unwrap_or(0)).map(move |light| self.of_light(light)))
    }
}

impl Absorbed {
    fn row(&self) -> Row<'_> {
        Row {
            absorbed: Some(Column::known(&self.absorbed, Some(&self.absorbed_se))),
            absorbed_by_face: self.absorbed_by_face.as_deref(),
            absorbed_ratios: self.absorbed_ratios.as_deref(),
            ..Row::default()
        }
    }
}
