//! Pictures of the photons themselves.

use glam::Vec3;

use super::{
    arguments::By,
    task::{Made, Task, photons},
};
use phylux_core::error::Result;
use phylux_show::{
    picture::Legend,
    render::{Viewpoint, path_dots, photon_dots},
};

impl Task<'_> {
    pub fn photons(&self) -> Result<Made> {
        let light = self.light()?;
        let mut picture = self.pale(Viewpoint::surface, |_, _| None)?;
        let dots = self.watched("photons", |control| {
            photon_dots(&light, &self.viewpoint, self.settings.threads.get(), control)
        })?;
        let map = &light.map;
        let power = |i: usize| {
            let power = map.power(i);
            self.band.bands.iter().map(|&b| f64::from(power[b])).sum::<f64>() / map.histories as f64
        };
        let (what, unit) = match self.arguments.colour {
            By::Power => ("photon power", self.scene.quantity().unit_names().flux),
            By::Bounce => ("bounces", "".into()),
        };
        let value = |i: usize| match self.arguments.colour {
            By::Power => power(i),
            By::Bounce => f64::from(map.ways()[i].bounces),
        };
        // few photons are scattered often, so those do not stretch the scale
        let share = if self.arguments.colour == By::Bounce { 0.95 } else { 0.999 };
        let values: Vec<f64> = dots.iter().map(|dot| value(dot.index)).collect();
        let most = values.iter().copied().fold(0.0, f64::max);
        let scale = self.scale(values, share);
        let size = (picture.width / 400).max(1);
        let mut draw = |at: [f32; 2], colour| {
            let [x, y] = at.map(|x| x as usize);
            for i in 0..size * size {
                picture.set(x + i % size, y + i / size, colour);
            }
        };
        // a photon without power in the chosen bands is not drawn
        for dot in dots.iter().filter(|dot| power(dot.index) > 0.0) {
            draw(dot.at, scale.colour(value(dot.index)));
        }
        const PATH: Vec3 = Vec3::new(0.85, 0.1, 0.1);
        let (paths, seed) = (self.arguments.paths, self.settings.seed);
        let path_dots = self.watched("paths", |control| {
            path_dots(self.scene, &self.viewpoint, paths, seed, control)
        })?;
        for dot in path_dots {
            draw(dot.at, PATH);
        }
        let mut legend = self.legend(what, &unit, scale, most);
        if self.arguments.colour == By::Bounce {
            legend = Legend { title: vec![what.into()], whole: true, ..legend };
        }
        let words = format!("{}, {} of them seen\n", photons(&light), dots.len());
        Ok(Made { picture: picture.with_bar(&legend)?, pixels: None, words })
    }
}
