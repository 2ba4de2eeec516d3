//! Loads what stands at the head of a scene file: bands, sums, settings and camera.

use glam::DVec3;

use super::{loader::Loader, spec::*};
use phylux_core::{
    error::{Error, Result},
    math::spectrum::MAX_BANDS,
    scene::{camera::View, world::Band},
    transport::settings::{
        MapLimit, NearestCount, PhotonCount, Settings, ThreadCount, TimeLimit, Tolerance,
    },
};

impl Loader<'_> {
    pub(super) fn load_bands(&mut self, file: &SceneSpec) -> Result<()> {
        let Some(bands) = &file.bands else {
            self.parts.bands = vec![Band { name: "all".into(), from_nm: None, to_nm: None }];
            return self.load_sums(file);
        };
        if bands.is_empty() || bands.len() > MAX_BANDS {
            let problem = format!("{} bands, must be 1 to {MAX_BANDS}", bands.len());
            return Err(self.error("/bands", problem).remedy("leave it out for a single band"));
        }
        for (i, band) in bands.iter().enumerate() {
            let pointer = format!("/bands/{i}");
            if bands[..i].iter().any(|other| other.name == band.name) {
                return Err(self
                    .error(pointer, format!("a second band named `{}`", band.name))
                    .remedy("give each band a name of its own"));
            }
            let band = Band { name: band.name.clone(), from_nm: band.from_nm, to_nm: band.to_nm };
            for (key, nm) in [("from_nm", band.from_nm), ("to_nm", band.to_nm)] {
                let pointer = format!("{pointer}/{key}");
                nm.map_or(Ok(()), |nm| self.in_range(&pointer, nm, 0.0, f64::MAX))?;
            }
            band.check().map_err(|problem| problem.at(self.place(pointer)))?;
            self.parts.bands.push(band);
        }
        self.load_sums(file)
    }

    pub(super) fn settings(&self, file: &SettingsSpec) -> Result<Settings> {
        let default = Settings::default();
        if file.splitting.is_some() {
            let problem =
                "photons are no longer split: flights aimed at the sensors find them better";
            return Err(self
                .error("/settings/splitting", problem)
                .remedy("take it out; `guiding` says whether flights are aimed"));
        }
        Ok(Settings {
            estimator: file.estimator,
            photons: self.setting(file.photons, |n| PhotonCount::new(n.0))?,
            seed: file.seed.unwrap_or(default.seed),
            k: self.setting(file.k, |n| NearestCount::new(n.size()))?,
            map_photons: self
                .setting(file.map_photons, |n| MapLimit::new(n.size()))?
                .unwrap_or(default.map_photons),
            guiding: file.guiding,
            tolerance: self.setting(file.tolerance, Tolerance::new)?,
            tolerance_limit: None,
            of: Vec::new(),
            max_time: self.setting(file.max_time, TimeLimit::new)?,
            by_light: false,
            threads: self
                .setting(file.threads, |n| ThreadCount::new(n.size()))?
                .unwrap_or(default.threads),
        })
    }

    /// Makes a number of the settings; its errors name it as their place.
    fn setting<N, T>(&self, given: Option<N>, make: impl Fn(N) -> Result<T>) -> Result<Option<T>> {
        let placed = |error: Error| {
            let place = self.place(format!("/settings/{}", error.place()));
            error.at(place)
        };
        given.map(make).transpose().map_err(placed)
    }

    pub(super) fn view(&self, camera: &CameraSpec) -> Result<View> {
        let point = |p: [f64; 3]| DVec3::from(p) * self.metres;
        let pixels = |key: &str, count: Option<Count>, usual: usize| {
            let Some(count) = count else { return Ok(usual) };
            let most = View::MOST_PIXELS as f64;
            self.in_range(&format!("/camera/{key}"), count.0 as f64, 1.0, most)?;
            Ok(count.0 as usize)
        };
        let view = View {
            position: point(camera.position),
            look_at: point(camera.look_at),
            up: camera.up.map_or(DVec3::Z, DVec3::from),
            fov_deg: camera.fov_deg.unwrap_or(View::FOV_DEG),
            width: pixels("width", camera.width, View::SIZE.0)?,
            height: pixels("height", camera.height, View::SIZE.1)?,
        };
        view.check_directions()
            .map_err(|why| self.error("/camera", why).remedy("move one of them"))?;
        View::check_fov(view.fov_deg)
            .map_err(|why| self.error("/camera/fov_deg", why).remedy("45 is usual"))?;
        Ok(view)
    }
}
