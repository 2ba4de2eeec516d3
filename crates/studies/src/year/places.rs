//! The captors and groups whose light is found, and how their values stand in rows.

use std::{collections::HashSet, ops::Range};

use glam::DVec3;

use phylux_core::{
    math::units::Quantity,
    scene::{
        captor::{CHANNELS, CaptorKind, Channel},
        world::Scene,
    },
};
use phylux_results::result::{BandResult, RatioResult, band_results};

/// The number of columns from which a ratio is found.
pub(super) const RATIO: usize = 3;

/// Number of captors or groups whose light is found at a time.
pub(super) const BLOCK: usize = 16;

/// What an id stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Of {
    /// A captor, by its index.
    Captor(usize),
    /// A group, by its index.
    Group(usize),
}

/// A captor, or a group, which has no place.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    pub kind: &'static str,
    pub center: Option<DVec3>,
    pub normal: Option<DVec3>,
    /// Names of its groups.
    pub groups: Vec<String>,
}

impl Shape {
    fn new(scene: &Scene, of: Of) -> Self {
        let Of::Captor(captor) = of else {
            return Self { kind: "group", center: None, normal: None, groups: Vec::new() };
        };
        let captor = &scene.captors()[captor];
        let groups = captor.groups.iter().map(|&g| scene.groups()[g].clone()).collect();
        let kind = match captor.kind {
            CaptorKind::Virtual { .. } => "virtual",
            CaptorKind::Surface => "surface",
        };
        let (center, normal) = (Some(captor.center), Some(captor.normal));
        Self { kind, center, normal, groups }
    }
}

/// The captors, then the groups that have no captor's id, and how their values stand in a row: id
/// by id; for each id channel by channel, as many as any captor has; for each channel the bands and
/// then the sums over bands. A row of results has one more value for each id, that of [`OWN`](super::value::OWN).
#[derive(Clone, Debug)]
pub struct Places {
    /// Ids of captors, then of groups.
    pub ids: Vec<String>,
    pub(super) of: Vec<Of>,
    /// Number of captors among the ids.
    pub captors: usize,
    /// Number of channels: fronts, backs, absorbed light.
    pub(super) channels: usize,
    /// Number of bands and sums, and of the sums that ratios are made of.
    pub(super) columns: usize,
    /// The ratios. The last columns are the numerator, the denominator and the sum of both
    /// for each.
    pub ratios: Vec<RatioResult>,
    /// For each id the area that counts for each channel, m2: 0 where nothing counts.
    pub(super) areas: Vec<[f64; CHANNELS.len()]>,
    /// What each id is, and where.
    pub(super) shapes: Vec<Shape>,
    /// For each captor the groups that it belongs to.
    groups: Vec<Vec<usize>>,
    /// For each group, the id that stands for it.
    pub(super) id_of_group: Vec<Option<usize>>,
}

impl Places {
    pub(super) fn new(scene: &Scene) -> Self {
        let known: HashSet<&str> =
            scene.captors().iter().map(|captor| captor.id.as_str()).collect();
        let groups =
            (0..scene.groups().len()).filter(|&g| !known.contains(scene.groups()[g].as_str()));
        let captors = scene.captors().len();
        let mut id_of_group = vec![None; scene.groups().len()];
        groups.clone().enumerate().for_each(|(i, group)| id_of_group[group] = Some(captors + i));
        let of: Vec<Of> = (0..captors).map(Of::Captor).chain(groups.map(Of::Group)).collect();
        let area = |area: f64, kind: CaptorKind| {
            CHANNELS.map(|c| if (c as usize) < kind.channels() { area } else { 0.0 })
        };
        let mut of_groups = vec![[0.0; CHANNELS.len()]; scene.groups().len()];
        for captor in scene.captors() {
            for &group in &captor.groups {
                let own = area(captor.area, captor.kind);
                of_groups[group].iter_mut().zip(own).for_each(|(sum, area)| *sum += area);
            }
        }
        Self {
            ids: of
                .iter()
                .map(|of| match *of {
                    Of::Captor(captor) => scene.captors()[captor].id.clone(),
                    Of::Group(group) => scene.groups()[group].clone(),
                })
                .collect(),
            areas: of
                .iter()
                .map(|of| match *of {
                    Of::Captor(c) => area(scene.captors()[c].area, scene.captors()[c].kind),
                    Of::Group(group) => of_groups[group],
                })
                .collect(),
            id_of_group,
            groups: scene.captors().iter().map(|captor| captor.groups.clone()).collect(),
            shapes: of.iter().map(|&of| Shape::new(scene, of)).collect(),
            of,
            captors,
            channels: scene.captors().iter().map(|c| c.kind.channels()).max().unwrap_or(1),
            columns: scene.bands().len() + scene.sums().len(),
            ratios: RatioResult::all(scene),
        }
    }

    /// Returns the bands and sums of a year and, for each, whether it has a daily light integral.
    pub(super) fn bands(&self, scene: &Scene) -> (Vec<BandResult>, Vec<bool>) {
        let mut bands = band_results(scene);
        bands.truncate(self.columns - RATIO * self.ratios.len());
        // a sum with a unit of its own is not in MJ
        let integrated = |band: &BandResult| match scene.quantity() {
            Quantity::Watt => band.unit.is_none(),
            Quantity::Micromole => band.has_dli(&bands, true),
        };
        let integrated = bands.iter().map(integrated).collect();
        (bands, integrated)
    }

    /// Returns the first captor or group that another scene does not have in the same place, with the
    /// same faces and members, or that only the other has.
    pub(super) fn differs<'p>(&'p self, other: &'p Self) -> Option<&'p str> {
        let ids = self.ids.iter().zip(&other.ids).enumerate();
        let mut others = ids.filter(|(i, (a, b))| {
            a != b
                || CHANNELS.iter().any(|&c| self.has(*i, c) != other.has(*i, c))
                || self.groups.get(*i) != other.groups.get(*i)
        });
        let more = || self.ids.get(other.ids.len()).or(other.ids.get(self.ids.len()));
        others.next().map(|(_, (a, _))| a).or_else(more).map(String::as_str)
    }

    /// Returns for each group its captors, by their indices.
    pub(super) fn members(&self) -> Vec<Vec<usize>> {
        let mut members = vec![Vec::new(); self.id_of_group.len()];
        for (captor, groups) in self.groups.iter().enumerate() {
            groups.iter().for_each(|&group| members[group].push(captor));
        }
        members
    }

    /// Returns the blocks of ids whose light is found at a time. None has both captors and groups.
    pub(super) fn blocks(&self) -> Vec<Range<usize>> {
        let of = |from: usize, to: usize| {
            (from..to).step_by(BLOCK).map(move |start| start..(start + BLOCK).min(to))
        };
        of(0, self.captors).chain(of(self.captors, self.ids.len())).collect()
    }

    /// Returns the numbers of values of the blocks, without its own.
    pub(super) fn widths(&self) -> Vec<usize> {
        self.blocks().iter().map(|ids| ids.len() * self.light()).collect()
    }

    /// Returns the block that an id is in, and its place there.
    pub(super) fn block_of(&self, id: usize) -> (usize, usize) {
        match id.checked_sub(self.captors) {
            None => (id / BLOCK, id % BLOCK),
            Some(group) => (self.captors.div_ceil(BLOCK) + group / BLOCK, group % BLOCK),
        }
    }

    /// Returns the number of values of an id without its own.
    pub(super) fn light(&self) -> usize {
        self.channels * self.columns
    }

    /// Returns the number of values of an id.
    pub(super) fn row(&self) -> usize {
        self.light() + 1
    }

    /// Returns whether light is counted in a channel of an id.
    pub fn has(&self, id: usize, channel: Channel) -> bool {
        self.areas[id][channel as usize] > 0.0
    }

    /// Returns the index of a channel of an id in the totals of a run.
    pub(super) fn channel(&self, scene: &Scene, id: usize, channel: Channel) -> usize {
        channel as usize
            + match self.of[id] {
                Of::Captor(captor) => scene.captors()[captor].first_channel,
                Of::Group(group) => scene.first_channel_of_group(group),
            }
    }
}
