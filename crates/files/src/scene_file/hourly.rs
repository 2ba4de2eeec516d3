//! Loads the sun and the sky of a period as several lights, such that the light of each hour is a
//! weighted sum of theirs (as `phylux year` needs them).

use super::{
    daylight::Sky,
    hourly_lights::{ByHour, HourlyLight, HourlySun, SkyDivision},
    loader::Loader,
    spec::*,
};
use phylux_core::{
    error::Result,
    scene::{
        daylight::{
            DaylightSource, Hour, HourlyPart, InfiniteLight, InfinitePart, mean_direct,
            sky_by_hour, suns_by_hour,
        },
        world::LightPart,
    },
};

impl Loader<'_> {
    /// Adds the lights that stand for a sun or a sky; returns false for any other light.
    pub(super) fn load_by_hour(
        &mut self,
        pointer: &str,
        file: &LightSpec,
        sky: &Sky,
        ByHour { division, shares }: ByHour,
    ) -> Result<bool> {
        let (name, given, ground, through) = match file {
            LightSpec::Sun(SunSpec { name, irradiance, ground, through, .. }) => {
                (name.as_deref().unwrap_or("sun"), irradiance, ground, through)
            }
            LightSpec::Sky(SkySpec { name, irradiance, ground, through, .. }) => {
                (name.as_deref().unwrap_or("sky"), irradiance, ground, through)
            }
            _ => return Ok(false),
        };
        if through.is_some() {
            return Err(self
                .error(format!("{pointer}/through"), "by the hour light comes from everywhere")
                .remedy("leave it out"));
        }
        if !sky.is_period {
            return Err(self
                .error("/time", "an instant, and not the hours of a period")
                .remedy("give \"year\" or {\"from\", \"to\"}, and a weather file"));
        }
        if given.is_some() {
            return Err(self
                .error(format!("{pointer}/irradiance"), "by the hour light comes from the weather")
                .remedy("leave it out, and name a weather file"));
        }
        let mut hours = self.weather(pointer, sky)?.to_vec();
        for (slot, share) in self.hourly.slots.iter().zip(shares.into_iter().flatten()) {
            let Some(hour) = slot.hour.and_then(|h| hours.get_mut(h)) else { continue };
            hour.weight *= share;
            if *share <= 0.0 {
                (hour.direct_normal, hour.diffuse_horizontal) = (0.0, 0.0);
            }
        }
        let hours = &hours[..];
        self.hourly.hours = hours.to_vec();
        self.hourly.north = sky.north;
        let (parts, of_ground, source, share) = match file {
            LightSpec::Sun(light) => {
                let half_angle = self.half_angle(pointer, light)?;
                let shares = self.shares(pointer, &light.share, DaylightSource::Sun)?;
                self.hourly.suns.push(HourlySun { half_angle, shares });
                let parts = suns_by_hour(hours, half_angle, sky.latitude, sky.north);
                let horizontal = |h: &Hour| mean_direct(&[Hour { weight: 1.0, ..*h }]);
                (parts, HourlyPart::ground(hours, horizontal), DaylightSource::Sun, &light.share)
            }
            LightSpec::Sky(light) => {
                let fine = if division == SkyDivision::Reinhart { 2 } else { 1 };
                let model = self.sky_model(pointer, light)?;
                let parts = sky_by_hour(model, hours, sky.north, fine);
                let ground = HourlyPart::ground(hours, |hour| hour.diffuse_horizontal);
                (parts, ground, DaylightSource::Sky, &light.share)
            }
            _ => return Ok(false),
        };
        let shares = self.shares(pointer, share, source)?;
        if let LightSpec::Sky(_) = file {
            self.hourly.skies.push(shares.clone());
        }
        let first = self.parts.lights.len();
        for (i, mut part) in parts.into_iter().enumerate() {
            part.beside.iter_mut().flat_map(|b| &mut b.from).for_each(|(light, _)| *light += first);
            self.add_hourly(pointer, format!("{name}/{i}"), part, shares.clone())?;
        }
        if let (Some(ground), Some(part)) = (ground, of_ground) {
            let reflectance = self.per_band(&format!("{pointer}/ground"), ground, 1.0)?;
            let shares = shares.iter().zip(reflectance).map(|(share, r)| share * r).collect();
            self.add_hourly(pointer, format!("{name}/ground"), part, shares)?;
        }
        Ok(true)
    }

    fn add_hourly(
        &mut self,
        pointer: &str,
        name: String,
        part: HourlyPart,
        shares: Vec<f64>,
    ) -> Result<()> {
        let strength = shares.iter().map(|share| share * part.mean).collect();
        let light = self.parts.lights.len();
        let infinite = InfinitePart::new(part.shape, strength);
        let source = InfiniteLight::new(name.clone(), self.bands(), vec![infinite]);
        self.hourly.lights.push(HourlyLight { light, factors: part.factors, beside: part.beside });
        self.add_light(pointer, LightPart::new(name, source))
    }

    /// Refuses a scene that is to be loaded by the hour but has neither sun nor sky. Where all of
    /// its light is dark, as in a polar night, it gets a light without power.
    pub(super) fn check_hourly(&mut self) -> Result<()> {
        if self.files.sources.by_hour.is_none() {
            return Ok(());
        }
        if !self.hourly.slots.is_empty() {
            if self.parts.lights.is_empty() {
                self.told.warn("/lights", "no light comes from them in this period: it is dark");
                let dark = InfiniteLight::new("daylight".into(), self.bands(), Vec::new());
                self.hourly.lights.push(HourlyLight {
                    light: 0,
                    factors: Vec::new(),
                    beside: Vec::new(),
                });
                self.add_light("/lights", LightPart::new("daylight", dark))?;
            }
            return Ok(());
        }
        Err(self
            .error("/lights", "neither sun nor sky, of which there could be a year")
            .remedy("add lights of type `sun` and `sky`, `weather` with a file, and `time`"))
    }
}
