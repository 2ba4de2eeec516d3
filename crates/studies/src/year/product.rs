//! The light of all hours: what the lights bring times how strong they are, and the light straight
//! from the sun, for some captors or groups at a time.

use std::{
    ops::Range,
    path::Path,
    sync::atomic::{AtomicBool, AtomicU64, Ordering},
};

use rayon::prelude::*;

use super::{
    hours::Period,
    interpolated::{FACTOR, HOURS, bends, of_a_photon},
    kept::Kept,
    matrix::Matrix,
    part::Part,
    places::{Of, Places, RATIO},
    responses::Responses,
    strengths::{Strengths, Table, add},
    value::Value,
};
use phylux_core::{
    error::{Error, NOTHING_WRITTEN, Result},
    scene::captor::{CHANNELS, Channel},
    transport::{
        direct_sun::SunRays,
        simulate::{Control, Progress},
    },
};
use phylux_results::result::FEW_HISTORIES;

/// Number of hours that are multiplied at once.
const SLOTS: usize = 256;
/// What is to be found.
pub(super) struct Wanted<'a> {
    /// For each id, its place in the table of hours.
    pub hours: Vec<Option<usize>>,
    /// For each slot, its row in the table of hours; `None` where nothing shines.
    pub rows: Vec<Option<usize>>,
    /// How long the sun is above the horizon in each slot, h.
    pub sun_up: Vec<f64>,
    pub periods: Vec<Period>,
    /// Ids and a band for which daylight alone is added up in the first periods, as many as
    /// are given.
    pub daylight: (Vec<usize>, usize, usize),
    pub rays: SunRays,
    pub kept: Kept<'a>,
    pub folder: &'a Path,
}

/// The light of the hours and periods. Where there is no sun, the sunlit share is not a number.
pub(super) struct Found {
    /// For each row of [`Wanted::rows`] the values of the ids that are wanted by the hour.
    pub hours: Matrix,
    /// For each period the values of all ids.
    pub periods: Matrix,
    /// Number of ids at which hours are less sure because they are interpolated than by chance.
    pub interpolated: usize,
    /// Number of ids, of those that are wanted by the hour, at which few photons make up the light of
    /// most hours.
    pub by_few: usize,
    /// For each id of [`Wanted::daylight`] and each of the periods, daylight alone.
    pub daylight: Vec<Vec<f64>>,
}

/// The product for one year.
pub(super) struct Product<'a> {
    parts: &'a [Part<'a>],
    places: &'a Places,
    wanted: &'a Wanted<'a>,
    strengths: Vec<Strengths>,
    /// The slots in which anything shines.
    slots: Vec<usize>,
    /// Those of them that are looked at for the warning of interpolation, as places among `slots`.
    looked_at: Vec<usize>,
    done: AtomicU64,
    control: &'a Control<'a>,
}

/// The values of a block of ids.
struct Block {
    ids: Range<usize>,
    /// For each part and id a row for each sun: straight sunlight.
    direct: Vec<Vec<Vec<[f32; 2]>>>,
    /// Row by row, those of its ids that are wanted by the hour.
    hours: Vec<[f32; 2]>,
    /// Period by period, its ids.
    periods: Vec<[f32; 2]>,
    interpolated: usize,
    by_few: usize,
    daylight: Vec<(usize, Vec<f64>)>,
}

/// What the hours that are looked at say of the errors of one value of an id.
#[derive(Clone, Default)]
struct Looked {
    /// Sum of the squares of what hours may be off because they are interpolated.
    off: f64,
    /// Sum of their variances by chance, and by what few photons and points leave unknown.
    noise: f64,
    /// Number of hours with light, and of those in which few photons make it up.
    lit: usize,
    by_few: usize,
}

impl Looked {
    /// Adds an hour: its value, the square of what it may be off because it is interpolated, and its
    /// variance by the chance of photons, without that of the rays to the sun.
    fn add(&mut self, value: &Value, off: f64, by_photons: f64) {
        self.off += off;
        self.noise += value.variance;
        if value.mean > 0.0 {
            self.lit += 1;
            // n photons of like energy have a variance of their mean squared over n
            let is_few = by_photons * FEW_HISTORIES as f64 > value.mean * value.mean;
            self.by_few += usize::from(is_few);
        }
    }
}

impl<'a> Product<'a> {
    pub fn new(
        parts: &'a [Part<'a>],
        places: &'a Places,
        wanted: &'a Wanted<'a>,
        control: &'a Control<'a>,
    ) -> Self {
        let lit = (0..wanted.rows.len()).filter(|&slot| wanted.rows[slot].is_some());
        let slots: Vec<usize> = lit.collect();
        let sunny = |&i: &usize| parts.iter().any(|part| part.suns[slots[i]].is_some());
        let sunny: Vec<usize> = (0..slots.len()).filter(sunny).collect();
        let step = sunny.len().div_ceil(HOURS).max(1);
        Self {
            strengths: parts
                .iter()
                .map(|part| Strengths::new(part, &wanted.periods, &slots))
                .collect(),
            looked_at: sunny.into_iter().step_by(step).collect(),
            parts,
            places,
            wanted,
            slots,
            done: AtomicU64::new(0),
            control,
        }
    }

    /// Returns for each period the mean power of all lights, in bands and sums: W or umol/s.
    pub fn powers(&self) -> Vec<Vec<f64>> {
        let scene = self.parts[0].scene;
        let of = |(p, period): (usize, &Period)| {
            let weight: f64 = period.slots.iter().map(|(_, weight)| weight).sum();
            let mut power = vec![0.0; scene.bands().len()];
            for (part, strengths) in self.parts.iter().zip(&self.strengths) {
                for (light, strength) in strengths.periods.of(p) {
                    add(&mut power, strength / weight, &part.scene.lights()[light].power);
                }
            }
            scene.with_sums(&power)
        };
        self.wanted.periods.iter().enumerate().map(of).collect()
    }

    /// Finds all light. Error: `control` stopped the work, or the disk is full.
    pub fn find(&self) -> Result<Found> {
        let Self { parts, places, wanted, .. } = self;
        let columns = wanted.hours.iter().flatten().count() * places.row();
        let mut found = Found {
            hours: Matrix::new(self.slots.len(), columns, wanted.folder)?,
            periods: Matrix::new(
                wanted.periods.len(),
                places.ids.len() * places.row(),
                wanted.folder,
            )?,
            interpolated: 0,
            by_few: 0,
            daylight: vec![Vec::new(); wanted.daylight.0.len()],
        };
        let groups = places.ids.len() - places.captors;
        // means and variances, for each part and group a row for each sun
        let of_groups =
            |part: &Part| vec![vec![Value::default(); part.lights.len() * places.row()]; groups];
        let mut of_groups: Vec<Vec<Vec<Value>>> = parts.iter().map(of_groups).collect();
        let blocks: Vec<(usize, Range<usize>)> = places.blocks().into_iter().enumerate().collect();
        let of_captors = blocks.partition_point(|(_, ids)| ids.start < places.captors);
        let (of_captors, others) = blocks.split_at(of_captors);
        let wave = 2 * rayon::current_num_threads();
        for blocks in of_captors.chunks(wave) {
            let done: Vec<Block> = blocks
                .par_iter()
                .map(|(block, ids)| {
                    self.block(*block, ids.clone(), self.direct_of_captors(ids.clone())?)
                })
                .collect::<Result<_>>()?;
            for block in done {
                for ((part, groups), direct) in parts.iter().zip(&mut of_groups).zip(&block.direct)
                {
                    self.add_to_groups(part, groups, block.ids.clone(), direct);
                }
                self.put(&block, &mut found)?;
            }
        }
        for (block, ids) in others {
            let rows = |groups: &Vec<Vec<Value>>| {
                let own = &groups[ids.start - places.captors..ids.end - places.captors];
                own.iter().map(|row| row.iter().map(|value| value.pair()).collect()).collect()
            };
            let direct = of_groups.iter().map(rows).collect();
            let block = self.block(*block, ids.clone(), direct)?;
            self.put(&block, &mut found)?;
        }
        Ok(found)
    }

    fn direct_of_captors(&self, ids: Range<usize>) -> Result<Vec<Vec<Vec<[f32; 2]>>>> {
        let of_part = |part: &Part<'a>| {
            ids.clone().into_par_iter().map(|captor| self.direct(part, captor)).collect()
        };
        let direct = self.parts.iter().map(of_part).collect::<Result<_>>()?;
        stopped(self.control.stop)?;
        Ok(direct)
    }

    fn direct(&self, part: &Part, captor: usize) -> Result<Vec<[f32; 2]>> {
        let Wanted { rays, kept, .. } = *self.wanted;
        let rows = part.direct(captor, self.places, rays, kept, self.control.stop)?;
        let suns: usize = self.parts.iter().map(|part| part.lights.len()).sum();
        let points = |suns: usize| suns as u64 * rays.count();
        let done = self.done.fetch_add(points(part.lights.len()), Ordering::Relaxed);
        let photons = done + points(part.lights.len());
        let of = Some(points(suns) * self.places.captors as u64);
        (self.control.progress)(Progress { photons, of, worst: None });
        Ok(rows)
    }

    /// Adds the sunlight of some captors to that of their groups, by their areas.
    fn add_to_groups(
        &self,
        part: &Part,
        groups: &mut [Vec<Value>],
        ids: Range<usize>,
        direct: &[Vec<[f32; 2]>],
    ) {
        let places = self.places;
        for (captor, rows) in ids.zip(direct) {
            let own = part.areas[captor];
            let of = part.scene.captors()[captor].groups.iter();
            for id in of.filter_map(|&group| places.id_of_group[group]) {
                let (sums, all) = (&mut groups[id - places.captors], part.areas[id]);
                let share = |c: usize| if all[c] > 0.0 { own[c] / all[c] } else { 0.0 };
                let shares: [f64; CHANNELS.len()] = std::array::from_fn(share);
                let row = places.row();
                for (sums, values) in sums.chunks_mut(row).zip(rows.chunks(row)) {
                    for (i, (sum, &[mean, error])) in sums.iter_mut().zip(values).enumerate() {
                        let channel = if i + 1 == row { 0 } else { i / places.columns };
                        sum.add(shares[channel], f64::from(mean), f64::from(error));
                    }
                }
            }
        }
    }

    fn put(&self, block: &Block, found: &mut Found) -> Result<()> {
        let (row, ids) = (self.places.row(), &block.ids);
        let wide = ids.len() * row;
        for (p, values) in block.periods.chunks(wide).enumerate() {
            found.periods.write(p, ids.start * row, values)?;
        }
        let own = self.wanted.hours[ids.clone()].iter().flatten();
        if let Some(first) = own.clone().next() {
            for (h, values) in block.hours.chunks(own.count() * row).enumerate() {
                found.hours.write(h, first * row, values)?;
            }
        }
        found.interpolated += block.interpolated;
        found.by_few += block.by_few;
        for (i, daylight) in &block.daylight {
            found.daylight[*i].clone_from(daylight);
        }
        Ok(())
    }

    fn block(
        &self,
        block: usize,
        ids: Range<usize>,
        direct: Vec<Vec<Vec<[f32; 2]>>>,
    ) -> Result<Block> {
        let (places, wanted) = (self.places, self.wanted);
        let (light, row) = (places.light(), places.row());
        let width = ids.len() * light;
        let periods = wanted.periods.len();
        let read = |part: &Part| Responses::read(&part.responses, block);
        let responses: Vec<Responses> = self.parts.iter().map(read).collect::<Result<_>>()?;
        let all: Vec<usize> = (0..periods).collect();
        let [means, variances] = self.of_parts(&responses, |strengths| &strengths.periods, &all);
        let mut sums = vec![[f32::NAN; 2]; periods * ids.len() * row];
        for (p, period) in wanted.periods.iter().enumerate() {
            for i in 0..ids.len() {
                let at = p * width + i * light;
                let mut values: Vec<Value> = (at..at + light)
                    .map(|at| Value { mean: means[at], variance: variances[at] })
                    .collect();
                let sunlit = self.add_direct(&mut values, &direct, i, &period.slots);
                let out = &mut sums[(p * ids.len() + i) * row..][..row];
                values.iter().chain(&sunlit).zip(out).for_each(|(v, out)| *out = v.pair());
            }
        }
        let mut block = Block {
            daylight: self.daylight(&ids, &responses, &direct),
            hours: Vec::new(),
            periods: sums,
            interpolated: 0,
            by_few: 0,
            ids,
            direct,
        };
        self.hours(&mut block, &responses);
        Ok(block)
    }

    /// Adds the sunlight of some hours, each with a weight, to the values of an id of a block.
    /// Returns the mean sunlit share over the time in which the sun shines.
    fn add_direct(
        &self,
        values: &mut [Value],
        direct: &[Vec<Vec<[f32; 2]>>],
        id: usize,
        slots: &[(usize, f64)],
    ) -> Option<Value> {
        let (row, light) = (self.places.row(), self.places.light());
        let (mut sunlit, mut time) = (Value::default(), 0.0);
        for (part, direct) in self.parts.iter().zip(direct) {
            for &(slot, weight) in slots {
                let Some(sun) = part.suns[slot] else { continue };
                let own = &direct[id][sun * row..][..row];
                let share = weight * part.shares[slot];
                for (value, &[mean, error]) in values.iter_mut().zip(&own[..light]) {
                    value.add(share, f64::from(mean), f64::from(error));
                }
                let sun_up = self.wanted.sun_up[slot] * part.shares[slot];
                let [mean, error] = own[light].map(f64::from);
                sunlit.add(sun_up, mean, error);
                time += sun_up;
            }
        }
        (time > 0.0)
            .then(|| Value { mean: sunlit.mean / time, variance: sunlit.variance / time / time })
    }

    /// Returns the means and variances of the light of all parts at some times of one of their
    /// tables, for each time and value of `responses`.
    fn of_parts(
        &self,
        responses: &[Responses],
        table: impl Fn(&Strengths) -> &Table,
        times: &[usize],
    ) -> [Vec<f64>; 2] {
        let each = self.strengths.iter().zip(responses);
        let each = each.map(|(strengths, own)| table(strengths).times(times, own));
        let added = |mut sums: [Vec<f64>; 2], own: [Vec<f64>; 2]| {
            sums.iter_mut().zip(&own).for_each(|(sums, own)| add(sums, 1.0, own));
            sums
        };
        each.reduce(added).unwrap_or_default()
    }

    /// Fills in the hours of a block, as far as they are wanted.
    fn hours(&self, block: &mut Block, responses: &[Responses]) {
        let (places, wanted) = (self.places, self.wanted);
        let light = places.light();
        let ids = block.ids.clone();
        let width = ids.len() * light;
        let chosen: Vec<usize> =
            (0..ids.len()).filter(|i| wanted.hours[ids.start + i].is_some()).collect();
        let needed: Vec<usize> = match chosen.is_empty() {
            true => self.looked_at.clone(),
            false => (0..self.slots.len()).collect(),
        };
        let mut looked_at = vec![false; self.slots.len()];
        self.looked_at.iter().for_each(|&i| looked_at[i] = true);
        let bends: Vec<Vec<Vec<f64>>> =
            self.parts.iter().zip(responses).map(|(part, own)| bends(part.hourly, own)).collect();
        let photons: Vec<Vec<f64>> =
            self.parts.iter().zip(responses).map(|(part, own)| of_a_photon(part, own)).collect();
        // columns of light, without those that ratios are made of
        let of_light = places.columns - RATIO * places.ratios.len();
        // to which the share of the area is not known
        let half_a_point = 0.5 / wanted.rays.count() as f64;
        let mut looked = vec![Looked::default(); width];
        for chunk in needed.chunks(SLOTS) {
            let [means, variances] = self.of_parts(responses, |strengths| &strengths.hours, chunk);
            let mut off = vec![0.0; chunk.len() * width];
            for (part, bends) in self.parts.iter().zip(&bends) {
                for (&i, off) in chunk.iter().zip(off.chunks_mut(width)) {
                    for &(l, weight) in &part.weights[self.slots[i]] {
                        add(off, FACTOR * weight, &bends[l]);
                    }
                }
            }
            for (c, &slot) in chunk.iter().enumerate() {
                let largest: Vec<f64> =
                    self.parts.iter().map(|part| part.largest_photon(self.slots[slot])).collect();
                for i in 0..ids.len() {
                    let at = c * width + i * light;
                    let mut values: Vec<Value> = (at..at + light)
                        .map(|at| Value { mean: means[at], variance: variances[at] })
                        .collect();
                    let one = [(self.slots[slot], 1.0)];
                    let mut sunlit = self.add_direct(&mut values, &block.direct, i, &one);
                    for (j, value) in values.iter_mut().enumerate() {
                        // ratios are told by how their parts vary together, to which this adds nothing
                        if j % places.columns < of_light {
                            let share = sunlit.map_or(0.0, |sunlit| sunlit.mean);
                            if share > 0.0 {
                                let direct = value.mean - means[at + j];
                                value.variance += (direct / share * half_a_point).powi(2);
                            }
                            for (of, power) in photons.iter().zip(&largest) {
                                value.variance += (of[i * light + j] * power).powi(2);
                            }
                        }
                        let more = off[at + j] * off[at + j];
                        if looked_at[slot] {
                            looked[i * light + j].add(value, more, variances[at + j]);
                        }
                        value.variance += more;
                    }
                    if let Some(sunlit) = &mut sunlit {
                        sunlit.variance += half_a_point * half_a_point;
                    }
                    if wanted.hours[ids.start + i].is_some() {
                        let sunlit = sunlit.map_or([f32::NAN; 2], Value::pair);
                        block.hours.extend(values.into_iter().map(Value::pair).chain([sunlit]));
                    }
                }
            }
        }
        let of = |i: usize| &looked[i * light..][..light];
        let is_wide = |i: &usize| of(*i).iter().any(|looked| looked.off > looked.noise);
        let is_by_few = |i: &&usize| of(**i).iter().any(|looked| 2 * looked.by_few > looked.lit);
        block.interpolated = (0..ids.len()).filter(is_wide).count();
        block.by_few = chosen.iter().filter(is_by_few).count();
    }

    /// Adds up daylight alone for those ids of a block for which it is wanted.
    fn daylight(
        &self,
        ids: &Range<usize>,
        responses: &[Responses],
        direct: &[Vec<Vec<[f32; 2]>>],
    ) -> Vec<(usize, Vec<f64>)> {
        let (wanted, band, periods) = &self.wanted.daylight;
        let mut found = Vec::new();
        for (i, id) in wanted.iter().enumerate().filter(|(_, id)| ids.contains(id)) {
            let (id, row) = (id - ids.start, self.places.row());
            let place = id * self.places.light() + band;
            let of = |period: &Period| {
                let mut sum = 0.0;
                for ((part, own), direct) in self.parts.iter().zip(responses).zip(direct) {
                    for &(slot, share) in &period.slots {
                        for &(light, weight) in &part.weights[slot] {
                            if part.is_daylight[light] {
                                sum += share * weight * own.means_of(light)[place];
                            }
                        }
                        if let Some(sun) = part.suns[slot] {
                            let value = f64::from(direct[id][sun * row + band][0]);
                            sum += share * part.shares[slot] * value;
                        }
                    }
                }
                sum
            };
            found.push((i, self.wanted.periods[..*periods].iter().map(of).collect()));
        }
        found
    }
}

/// Returns daylight on the front of an id in a band, for each slot. Error: the work was stopped.
pub(super) fn daylight_at(
    parts: &[Part],
    places: &Places,
    (id, band): (usize, usize),
    rays: SunRays,
    kept: Kept,
    control: &Control,
) -> Result<Vec<f64>> {
    let mut sums = vec![0.0; parts[0].weights.len()];
    let captors: Vec<usize> = match places.of[id] {
        Of::Captor(captor) => vec![captor],
        Of::Group(group) => std::mem::take(&mut places.members()[group]),
    };
    let suns: usize = parts.iter().map(|part| part.lights.len()).sum();
    let done = AtomicU64::new(0);
    for part in parts {
        let fronts = (0..part.responses.lights()).map(|l| part.front(places, l, id, band));
        let fronts: Vec<f64> = fronts.collect::<Result<_>>()?;
        let direct = |&captor: &usize| {
            let rows = part.direct(captor, places, rays, kept, control.stop);
            let own = part.lights.len() as u64 * rays.count();
            let photons = done.fetch_add(own, Ordering::Relaxed) + own;
            let of = Some((suns * captors.len()) as u64 * rays.count());
            (control.progress)(Progress { photons, of, worst: None });
            rows
        };
        let rows: Vec<Vec<[f32; 2]>> = captors.par_iter().map(direct).collect::<Result<_>>()?;
        stopped(control.stop)?;
        let area: f64 = captors.iter().map(|&c| part.scene.captors()[c].area).sum();
        for (slot, sum) in sums.iter_mut().enumerate() {
            let lights = part.weights[slot].iter();
            *sum += lights.map(|&(light, weight)| weight * fronts[light]).sum::<f64>();
            let Some(sun) = part.suns[slot] else { continue };
            let place = sun * places.row() + Channel::Front as usize * places.columns + band;
            for (&captor, rows) in captors.iter().zip(&rows) {
                let share = part.shares[slot] * part.scene.captors()[captor].area / area;
                *sum += share * f64::from(rows[place][0]);
            }
        }
    }
    Ok(sums)
}

fn stopped(stop: &AtomicBool) -> Result<()> {
    match stop.load(Ordering::Relaxed) {
        true => Err(Error::interrupted("run", NOTHING_WRITTEN)),
        false => Ok(()),
    }
}
