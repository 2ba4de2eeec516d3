//! The values that must meet a tolerance: those of all faces, or of what was named instead.

use super::Run;
use crate::{
    error::{Error, Result},
    math::pattern,
    scene::{
        captor::{Captor, CaptorKind, Channel},
        world::Scene,
    },
    transport::settings::Target,
};

/// A face of a captor or group, or what it absorbs, that must meet the tolerance in a band, or in
/// all.
#[derive(Clone, Copy)]
pub(super) struct Watched {
    /// Index of the captor, or the number of captors plus the index of the group.
    pub captor: usize,
    pub face: Channel,
    /// Index of the band; `None` means all bands and sums.
    pub band: Option<usize>,
    /// Index of the channel in the totals.
    pub channel: usize,
    /// Area, m2.
    pub area: f64,
    pub on_surface: bool,
}

impl Watched {
    fn of_captor(index: usize, captor: &Captor, face: Channel, band: Option<usize>) -> Self {
        Self {
            captor: index,
            face,
            band,
            channel: captor.first_channel + face as usize,
            area: captor.area,
            on_surface: captor.kind == CaptorKind::Surface,
        }
    }
}

impl Run<'_> {
    /// Returns what must meet the tolerance. Error: something was named that is not in the scene.
    pub(super) fn watched(&self) -> Result<Vec<Watched>> {
        let scene = self.scene;
        if self.settings.of.is_empty() {
            let faces = scene.captors().iter().enumerate().flat_map(|(index, captor)| {
                let faces = captor.kind.faces().iter();
                faces.map(move |&face| Watched::of_captor(index, captor, face, None))
            });
            return Ok(faces.collect());
        }
        let mut watched = Vec::new();
        for target in &self.settings.of {
            watched.extend(of_target(scene, target)?);
        }
        watched.sort_by_key(|watched| (watched.channel, watched.band));
        // where all bands are watched, no single one is watched again
        watched.dedup_by(|b, a| a.channel == b.channel && (a.band.is_none() || a.band == b.band));
        Ok(watched)
    }
}

/// Returns the captors and groups that fit the pattern of `target` and count its quantity.
fn of_target(scene: &Scene, target: &Target) -> Result<Vec<Watched>> {
    let Target { pattern, quantity, band } = target;
    let wrong = |problem: String| Error::input("of", problem);
    let band = match band {
        None => None,
        Some(name) => Some(scene.band_names().position(|band| band == name).ok_or_else(|| {
            let names: Vec<&str> = scene.band_names().take(20).collect();
            wrong(format!("no band `{name}`")).remedy(format!("there are {}", names.join(", ")))
        })?),
    };
    let mut groups: Vec<Option<Watched>> = vec![None; scene.groups().len()];
    let mut found = Vec::new();
    for (index, captor) in scene.captors().iter().enumerate() {
        if *quantity as usize >= captor.kind.channels() {
            continue;
        }
        let one = Watched::of_captor(index, captor, *quantity, band);
        if pattern::fits(pattern, &captor.id) {
            found.push(one);
        }
        for &group in &captor.groups {
            let whole = groups[group].get_or_insert(Watched {
                captor: scene.captors().len() + group,
                channel: scene.first_channel_of_group(group) + *quantity as usize,
                area: 0.0,
                on_surface: true,
                ..one
            });
            whole.area += one.area;
            whole.on_surface &= one.on_surface;
        }
    }
    let fitting = groups.into_iter().zip(scene.groups());
    let fitting = fitting.filter(|(_, name)| pattern::fits(pattern, name));
    found.extend(fitting.filter_map(|(group, _)| group));
    if found.is_empty() {
        let problem = format!("no captor and no group like `{pattern}` counts this quantity");
        return Err(wrong(problem).remedy(
            "`*` stands for any characters; quantities are irradiance, back (of surfaces, and of sensors whose `sides` \
            are both) and absorbed (of surfaces)",
        ));
    }
    Ok(found)
}
