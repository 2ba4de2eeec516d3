//! Loads the sun, the sky and environment maps: where and when the scene is, its weather, and the
//! lights that follow from these.

use std::{f64::consts::PI, sync::Arc};

use glam::DVec3;

use super::{loader::Loader, spec::*};
use crate::{
    environment_map::Panorama,
    iso8601::parse_time,
    weather::{Period, Site, Stamp, Weather},
};
use phylux_core::{
    error::Result,
    math::units::Quantity,
    scene::daylight::{
        DaylightSource, Hour, InfiniteLight, InfinitePart, InfiniteShape, RadianceMap, SkyModel,
        SunCourse, SunPosition, Suns, Timestamp, WAVELENGTHS, azimuth_of, band_share, eccentricity,
        mean_direct, mean_sky, mean_sun,
    },
};

/// What daylight is like in the open, for people to check.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenField {
    /// Position of the sun; `None` for a period, and where the scene does not say it.
    pub sun: Option<SunPosition>,
    /// Broadband irradiances by the weather, W/m2, as means over the period: direct on a plane that
    /// faces the sun, direct on a horizontal plane, diffuse on a horizontal plane. `None` where the
    /// scene has no weather.
    pub weather: Option<[f64; 3]>,
}

impl OpenField {
    /// Photon flux density from 400 to 700 nm on a horizontal plane in the open, umol/m2/s, by the
    /// standard's spectra of direct and diffuse light; `None` where the scene has no weather.
    pub fn ppfd(&self) -> Option<f64> {
        let [_, direct, diffuse] = self.weather?;
        let share = |source| band_share(source, Quantity::Micromole, 400.0, 700.0);
        Some(direct * share(DaylightSource::Sun)? + diffuse * share(DaylightSource::Sky)?)
    }
}

/// When and where the scene is, and its weather.
pub(super) struct Sky {
    /// Azimuth of north, rad, clockwise from +y.
    pub(super) north: f64,
    /// Latitude, rad; 0 where it is not known.
    pub(super) latitude: f64,
    /// Position of the sun, if the scene says it; `None` for a period.
    sun: Option<SunPosition>,
    pub(super) is_period: bool,
    /// Hours of the weather, without the dark hours of a weather file; `None` where the scene has
    /// no weather.
    hours: Option<Vec<Hour>>,
}

impl LightSpec {
    /// Returns the name of a sun or a sky that has no `ground`.
    pub(super) fn without_ground(&self) -> Option<String> {
        match self {
            Self::Sun(SunSpec { name, ground: None, .. }) => {
                Some(name.clone().unwrap_or("sun".into()))
            }
            Self::Sky(SkySpec { name, ground: None, .. }) => {
                Some(name.clone().unwrap_or("sky".into()))
            }
            _ => None,
        }
    }
}

impl Loader<'_> {
    /// Reads what the scene says about daylight; `None` for a scene without sun, sky or environment
    /// map.
    pub(super) fn load_sky(&mut self, file: &SceneSpec) -> Result<Option<Sky>> {
        let keys = [
            ("site", file.site.is_some()),
            ("time", file.time.is_some()),
            ("weather", file.weather.is_some()),
            ("sun_at", file.sun_at.is_some()),
        ];
        if !file.lights.iter().any(LightSpec::is_infinite) {
            let remedy = "add a light of type `sun` or `sky`, or leave it out";
            return self.refuse_given("", &keys, "no light uses it", remedy).map(|()| None);
        }
        let north = file.site.as_ref().and_then(|site| site.north).map_or(DVec3::Y, DVec3::from);
        if !(north.truncate().length() > 0.0 && north.is_finite()) {
            return Err(self
                .error("/site/north", "does not point to a side")
                .remedy("say where north is: [0, 1, 0] is +y; +z is up"));
        }
        let mut sky = Sky {
            north: azimuth_of(north),
            latitude: 0.0,
            sun: None,
            is_period: false,
            hours: None,
        };
        let weather = match &file.weather {
            Some(WeatherSpec { file: Some(name), .. }) => Some(self.weather_file(file, name)?),
            _ => None,
        };
        let site = self.site(file, weather.as_ref())?;
        sky.latitude = site.map_or(0.0, |site| site.latitude.to_radians());
        let when = self.when(file)?;
        if let Some(at) = &file.sun_at {
            if file.time.is_some() {
                return Err(self
                    .error("/sun_at", "both `sun_at` and `time`")
                    .remedy("say where the sun stands, or when it is"));
            }
            self.in_range("/sun_at/elevation_deg", at.elevation_deg, -90.0, 90.0)?;
            self.in_range("/sun_at/azimuth_deg", at.azimuth_deg, -360.0, 360.0)?;
            let [elevation, azimuth] = [at.elevation_deg, at.azimuth_deg].map(f64::to_radians);
            sky.sun = Some(SunPosition { elevation, azimuth });
        }
        match when {
            Some(Period::Instant(time)) => {
                let site = site.ok_or_else(|| {
                    self.error("/time", "the scene does not say where it is")
                        .remedy("add `\"site\": {\"latitude\": ..., \"longitude\": ...}`")
                })?;
                let [latitude, longitude] = [site.latitude, site.longitude].map(f64::to_radians);
                sky.sun = Some(SunPosition::at(time, latitude, longitude));
            }
            Some(_) => sky.is_period = true,
            None => {}
        }
        let steady = |light: &&LightSpec| !matches!(light, LightSpec::Sun(_) | LightSpec::Sky(_));
        if sky.is_period
            && self.files.sources.by_hour.is_none()
            && file.lights.iter().any(|light| steady(&light))
        {
            let problem = "lamps and environment maps shine the whole period, nights included; a \
                           year with a control file switches lamps by the hour";
            self.told.warn("/time", problem);
        }
        sky.hours = match (&file.weather, weather) {
            (None, _) => None,
            (Some(given), Some(weather)) => {
                let (Some(when), Some(site)) = (when, site) else {
                    return Err(self
                        .error("/weather/file", "a weather file needs `time`, and a place")
                        .remedy(
                            "add `time` (an instant, {\"from\", \"to\"} or \"year\") and `site`",
                        ));
                };
                Some(self.hours_of_file(&weather, given, when, site)?)
            }
            (Some(given), None) => Some(vec![self.given_hour(given, &sky, when)?]),
        };
        Ok(Some(sky))
    }

    fn weather_file(&self, file: &SceneSpec, name: &str) -> Result<Weather> {
        let stamp = file.weather.as_ref().and_then(|weather| weather.stamp);
        let stamp = stamp.map(|stamp| match stamp {
            StampSpec::Start => Stamp::Start,
            StampSpec::Middle => Stamp::Middle,
            StampSpec::End => Stamp::End,
        });
        let path = self.files.sibling(name);
        if let Some(table) = name.strip_prefix("table:") {
            return Weather::parse(self.files.table("/weather/file", table)?, &path, stamp);
        }
        Weather::parse(&self.files.bytes("/weather/file", &path)?, &path, stamp)
    }

    /// Returns where the scene is: what the scene file says, or else what its weather file says.
    fn site(&mut self, file: &SceneSpec, weather: Option<&Weather>) -> Result<Option<Site>> {
        let of_file = weather.and_then(|weather| weather.site);
        let Some(site) = &file.site else { return Ok(of_file) };
        let (latitude, longitude) = match (site.latitude, site.longitude) {
            (None, None) => return Ok(of_file),
            (Some(latitude), Some(longitude)) => (latitude, longitude),
            _ => {
                return Err(self
                    .error("/site", "only one of `latitude` and `longitude`")
                    .remedy("give both, in degrees; north and east are positive"));
            }
        };
        self.in_range("/site/latitude", latitude, -90.0, 90.0)?;
        self.in_range("/site/longitude", longitude, -180.0, 180.0)?;
        if let Some(other) = of_file
            && (other.latitude - latitude).abs().max((other.longitude - longitude).abs()) > 0.5
        {
            let problem = format!(
                "the weather is of another place: latitude {}, longitude {}",
                other.latitude, other.longitude
            );
            self.told.warn("/site", problem);
        }
        Ok(Some(Site { latitude, longitude }))
    }

    fn when(&self, file: &SceneSpec) -> Result<Option<Period>> {
        let time = |pointer: &str, text: &str| -> Result<Timestamp> {
            parse_time(text, self.place(pointer))
        };
        Ok(match &file.time {
            None => None,
            Some(TimeSpec::Text(text)) if text == "year" => Some(Period::Year),
            Some(TimeSpec::Text(text)) => Some(Period::Instant(time("/time", text)?)),
            Some(TimeSpec::Span { from, to }) => {
                Some(Period::Span { from: time("/time/from", from)?, to: time("/time/to", to)? })
            }
        })
    }

    fn hours_of_file(
        &mut self,
        weather: &Weather,
        given: &WeatherSpec,
        when: Period,
        site: Site,
    ) -> Result<Vec<Hour>> {
        if given.direct_normal.is_some() || given.diffuse_horizontal.is_some() {
            return Err(self
                .error("/weather", "both a `file` and irradiances")
                .remedy("leave out one of them"));
        }
        let shift = given.shift_h.unwrap_or(0.0);
        self.in_range("/weather/shift_h", shift, -24.0, 24.0)?;
        let selected = weather.select(when, site, shift)?;
        let said = weather.notes.iter().cloned().chain(selected.warnings());
        for warning in said.chain(weather.clock_warnings(site, shift)) {
            self.told.warn("/weather/file", warning);
        }
        self.parts.period_h = Some(selected.length).filter(|_| !selected.slots.is_empty());
        self.hourly.slots = selected.slots;
        Ok(selected.hours)
    }

    /// Returns the weather that the scene file itself gives, as a single hour.
    fn given_hour(&self, given: &WeatherSpec, sky: &Sky, when: Option<Period>) -> Result<Hour> {
        let keys = [("stamp", given.stamp.is_some()), ("shift_h", given.shift_h.is_some())];
        self.refuse_given("/weather", &keys, "goes with `file` only", "leave it out")?;
        let (Some(direct), Some(diffuse)) = (given.direct_normal, given.diffuse_horizontal) else {
            return Err(self
                .error("/weather", "neither `file` nor `direct_normal` and `diffuse_horizontal`")
                .remedy("give both irradiances of the whole spectrum, W/m2, or a file"));
        };
        self.in_range("/weather/direct_normal", direct, 0.0, 2000.0)?;
        self.in_range("/weather/diffuse_horizontal", diffuse, 0.0, 2000.0)?;
        if sky.is_period {
            return Err(self
                .error("/weather", "a period needs a weather file")
                .remedy("name one as `file`, or give `time` as an instant"));
        }
        let Some(sun) = sky.sun else {
            return Err(self
                .error("/weather", "the scene does not say where the sun stands")
                .remedy("add `site` and `time`, or `sun_at`"));
        };
        if direct > 0.0 && sun.elevation <= 0.0 {
            let below = -sun.elevation.to_degrees();
            let problem =
                format!("direct light, but the sun stands {below:.2} degrees below the horizon");
            return Err(self
                .error("/weather/direct_normal", problem)
                .remedy("correct the time and its offset, the site or the weather"));
        }
        let eccentricity = match when {
            Some(Period::Instant(time)) => eccentricity(time.date()),
            _ => 1.0,
        };
        Ok(Hour {
            weight: 1.0,
            sun,
            course: SunCourse::still(sun),
            eccentricity,
            direct_normal: direct,
            diffuse_horizontal: diffuse,
        })
    }

    pub(super) fn open_field(&self, sky: &Sky) -> OpenField {
        let weather = sky.hours.as_ref().map(|hours| {
            let sum = |of: &dyn Fn(&Hour) -> f64| hours.iter().map(|h| h.weight * of(h)).sum();
            let normal = sum(&|h| h.direct_normal);
            [normal, mean_direct(hours), sum(&|h| h.diffuse_horizontal)]
        });
        OpenField { sun: sky.sun, weather }
    }

    /// Returns the half angle of a sun's disc, rad.
    pub(super) fn half_angle(&self, pointer: &str, light: &SunSpec) -> Result<f64> {
        let half_angle = light.half_angle_deg.unwrap_or(0.2666);
        self.in_range(&format!("{pointer}/half_angle_deg"), half_angle, 0.0, 5.0)?;
        Ok(half_angle.to_radians())
    }

    pub(super) fn sun_light(
        &mut self,
        pointer: &str,
        light: &SunSpec,
        sky: &Sky,
    ) -> Result<InfiniteLight> {
        let half_angle = self.half_angle(pointer, light)?;
        let (suns, normal, horizontal) = match &light.irradiance {
            Some(irradiance) => {
                self.refuse_share(pointer, &light.share)?;
                let sun = self.position(pointer, sky)?;
                let normal = self.per_band(&format!("{pointer}/irradiance"), irradiance, 1e9)?;
                if normal.iter().any(|&e| e > 0.0) && sun.elevation <= 0.0 {
                    let below = -sun.elevation.to_degrees();
                    let problem = format!("the sun stands {below:.2} degrees below the horizon");
                    return Err(self
                        .error(format!("{pointer}/irradiance"), problem)
                        .remedy("correct the time and its offset, the site or `sun_at`"));
                }
                let suns = Suns::new(half_angle, [(sun.direction(sky.north), 1.0)]);
                let sine = sun.elevation.sin();
                let horizontal = normal.iter().map(|e| e * sine).collect();
                (suns, normal, horizontal)
            }
            None => {
                let hours = self.weather(pointer, sky)?;
                let shares = self.shares(pointer, &light.share, DaylightSource::Sun)?;
                let direct = mean_direct(hours);
                let horizontal: Vec<f64> = shares.iter().map(|share| share * direct).collect();
                match mean_sun(hours, half_angle, sky.north) {
                    Some((suns, mean)) => {
                        let normal = shares.iter().map(|share| share * mean).collect();
                        (Some(suns), normal, horizontal)
                    }
                    None => (None, shares, horizontal),
                }
            }
        };
        let suns = suns.filter(|_| normal.iter().any(|&e| e > 0.0));
        let sun = suns.map(|suns| InfinitePart::new(InfiniteShape::Suns(Arc::new(suns)), normal));
        self.with_ground(pointer, "sun", sun, &light.ground, &horizontal)
    }

    pub(super) fn sky_light(
        &mut self,
        pointer: &str,
        light: &SkySpec,
        sky: &Sky,
    ) -> Result<InfiniteLight> {
        let model = self.sky_model(pointer, light)?;
        let (map, horizontal) = match &light.irradiance {
            Some(irradiance) => {
                self.refuse_share(pointer, &light.share)?;
                if model == SkyModel::Perez {
                    return Err(self
                        .error(
                            format!("{pointer}/irradiance"),
                            "the sky of Perez follows from the weather",
                        )
                        .remedy("name another `model`, or give `weather`"));
                }
                let horizontal =
                    self.per_band(&format!("{pointer}/irradiance"), irradiance, 1e9)?;
                let sun = match model.has_sun() {
                    true => self.position(pointer, sky)?,
                    false => SunPosition { elevation: 0.0, azimuth: 0.0 },
                };
                let hour = Hour {
                    weight: 1.0,
                    sun,
                    course: SunCourse::still(sun),
                    eccentricity: 1.0,
                    direct_normal: 0.0,
                    diffuse_horizontal: 1.0,
                };
                (mean_sky(model, &[hour], sky.north).map(|(map, _)| map), horizontal)
            }
            None => {
                let hours = self.weather(pointer, sky)?;
                let shares = self.shares(pointer, &light.share, DaylightSource::Sky)?;
                let found = mean_sky(model, hours, sky.north);
                let mean = found.as_ref().map_or(0.0, |(_, mean)| *mean);
                let some_direct = hours.iter().any(|hour| hour.direct_normal > 0.0);
                if mean == 0.0 && some_direct {
                    self.told.warn(pointer, "direct light but no diffuse: there is no sky");
                }
                (found.map(|(map, _)| map), shares.iter().map(|share| share * mean).collect())
            }
        };
        let map = map.filter(|_| horizontal.iter().any(|&e| e > 0.0));
        let part =
            map.map(|map| InfinitePart::new(InfiniteShape::Map(Arc::new(map)), horizontal.clone()));
        self.with_ground(pointer, "sky", part, &light.ground, &horizontal)
    }

    pub(super) fn sky_model(&self, pointer: &str, light: &SkySpec) -> Result<SkyModel> {
        if (light.model == SkyModelSpec::Cie) != light.cie_type.is_some() {
            let problem = "`cie_type` (1 to 15) goes with the model `cie`, and only with it";
            return Err(self.error(pointer, problem).remedy("give both, or neither"));
        }
        Ok(match light.model {
            SkyModelSpec::Uniform => SkyModel::Uniform,
            SkyModelSpec::Overcast => SkyModel::Overcast,
            SkyModelSpec::Perez => SkyModel::Perez,
            SkyModelSpec::Cie => {
                let kind = light.cie_type.map_or(0, |kind| kind.0);
                self.in_range(&format!("{pointer}/cie_type"), kind as f64, 1.0, 15.0)?;
                SkyModel::Cie(kind as u8)
            }
        })
    }

    /// Makes a light of `part` and of what the ground below the horizon reflects of the light of
    /// `part`, whose irradiance of an open horizontal plane is `horizontal`, per band.
    fn with_ground(
        &mut self,
        pointer: &str,
        name: &str,
        part: Option<InfinitePart>,
        ground: &Option<PerBand>,
        horizontal: &[f64],
    ) -> Result<InfiniteLight> {
        if part.is_none() {
            self.told.warn(pointer, "no light comes from it: it is dark");
        }
        let mut parts: Vec<InfinitePart> = part.into_iter().collect();
        if let Some(ground) = ground {
            let reflectance = self.per_band(&format!("{pointer}/ground"), ground, 1.0)?;
            let radiance: Vec<f64> =
                reflectance.iter().zip(horizontal).map(|(r, e)| r * e / PI).collect();
            if radiance.iter().any(|&l| l > 0.0) {
                let below = RadianceMap::below_horizon();
                parts.push(InfinitePart::new(InfiniteShape::Map(Arc::new(below)), radiance));
            }
        }
        Ok(InfiniteLight::new(name.into(), self.bands(), parts))
    }

    pub(super) fn environment_light(
        &mut self,
        pointer: &str,
        light: &EnvironmentSpec,
        sky: &Sky,
    ) -> Result<InfiniteLight> {
        let path = self.files.sibling(&light.file);
        let place = format!("{pointer}/file");
        let bytes = self.files.bytes(&place, &path)?;
        let heading = light.heading_deg.unwrap_or(0.0);
        self.in_range(&format!("{pointer}/heading_deg"), heading, -360.0, 360.0)?;
        let scale = match &light.scale {
            Some(scale) => self.per_band(&format!("{pointer}/scale"), scale, 1e9)?,
            None => vec![1.0; self.bands()],
        };
        let names: Vec<&str> = self.parts.bands.iter().map(|band| band.name.as_str()).collect();
        let heading = sky.north + heading.to_radians();
        let picture = Panorama::parse(&bytes, &path)?;
        drop(bytes);
        let map = picture.map(&path, &names, heading, &scale)?;
        let notes = picture.notes(&names);
        drop(picture);
        notes.into_iter().for_each(|note| self.told.warn(path.display(), note));
        let mut strength = vec![1.0; self.bands()];
        if let Some(irradiance) = &light.irradiance {
            if light.scale.is_some() {
                return Err(self
                    .error(pointer, "both `scale` and `irradiance`")
                    .remedy("give one of them"));
            }
            strength = self.per_band(&format!("{pointer}/irradiance"), irradiance, 1e9)?;
            let found = map.irradiance(DVec3::Z);
            for (b, strength) in strength.iter_mut().enumerate() {
                let found = found.get(b).or(found.first()).copied().unwrap_or(0.0);
                if *strength > 0.0 && found <= 0.0 {
                    let problem = format!("the upper half of the map is black in band {b}");
                    return Err(self
                        .error(format!("{pointer}/irradiance"), problem)
                        .remedy("use `scale`, or another map"));
                }
                *strength = if found > 0.0 { *strength / found } else { 0.0 };
            }
        }
        if map.is_dark() {
            self.told.warn(pointer, "no light comes from it: it is black");
        }
        let part = InfinitePart::new(InfiniteShape::Map(Arc::new(map)), strength);
        Ok(InfiniteLight::new("environment".into(), self.bands(), vec![part]))
    }

    /// Returns the position of the sun, for a light whose irradiance is given.
    fn position(&self, pointer: &str, sky: &Sky) -> Result<SunPosition> {
        if sky.is_period {
            return Err(self
                .error(format!("{pointer}/irradiance"), "a period needs a weather file")
                .remedy("give `time` as an instant, or leave `irradiance` to the weather"));
        }
        sky.sun.ok_or_else(|| {
            self.error(pointer, "the scene does not say where the sun stands")
                .remedy("add `site` and `time`, or `sun_at`")
        })
    }

    pub(super) fn weather<'s>(&self, pointer: &str, sky: &'s Sky) -> Result<&'s [Hour]> {
        sky.hours.as_deref().ok_or_else(|| {
            self.error(pointer, "neither `irradiance` nor weather")
                .remedy("add `weather` to the scene, or `irradiance` to the light")
        })
    }

    fn refuse_share(&self, pointer: &str, share: &Option<PerBand>) -> Result<()> {
        match share {
            None => Ok(()),
            Some(_) => Err(self
                .error(format!("{pointer}/share"), "both `share` and `irradiance`")
                .remedy("`share` goes with the weather alone")),
        }
    }

    /// Returns, per band, the amount of the scene's quantity per W of the whole spectrum.
    pub(super) fn shares(
        &self,
        pointer: &str,
        share: &Option<PerBand>,
        source: DaylightSource,
    ) -> Result<Vec<f64>> {
        let quantity = self.parts.quantity;
        if let Some(share) = share {
            let most = match quantity {
                Quantity::Watt => 1.0,
                Quantity::Micromole => 100.0,
            };
            return self.per_band(&format!("{pointer}/share"), share, most);
        }
        let [first, last] = WAVELENGTHS;
        let of = |(b, band): (usize, &phylux_core::scene::world::Band)| {
            let found = match (band.from_nm, band.to_nm) {
                (Some(from), Some(to)) => band_share(source, quantity, from, to),
                _ => None,
            };
            found.ok_or_else(|| {
                let problem = format!("band `{}` needs its part of daylight", band.name);
                self.error(format!("/bands/{b}"), problem).remedy(format!(
                    "give it `from_nm` and `to_nm` within {first} to {last}, or the light a `share`"
                ))
            })
        };
        self.parts.bands.iter().enumerate().map(of).collect()
    }
}
