//! Loads what stands at the head of a scene file: bands, sums, settings and camera.

use glam::DVec3;

use super::{loader::Loader, spec::*};
use phylux_core::{
    error::Result,
    math::spectrum::MAX_BANDS,
    scene::{camera::View, world::Band},
    transport::settings::{Checked, Settings},
};

impl Loader<'_> {
    pub(super) fn load_bands(&mut self, file: &SceneSpec) -> Result<()> {
        let Some(bands) = &file.bands else {
            self.bands = 1;
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
        self.bands = bands.len();
        self.load_sums(file)
    }

    pub(super) fn settings(&self, file: &SettingsSpec) -> Result<Settings> {
        let default = Settings::default();
        let wrong = |key: &str, why: String| self.error(format!("/settings/{key}"), why);
        let count = |key: &str, count: Option<Count>, check: fn(u64) -> Checked<usize>| {
            count.map(|n| check(n.0).map_err(|why| wrong(key, why))).transpose()
        };
        if file.splitting.is_some() {
            let problem =
                "photons are no longer split: flights aimed at the sensors find them better";
            return Err(wrong("splitting", problem.into())
                .remedy("take it out; `guiding` says whether flights are aimed"));
        }
        Ok(Settings {
            estimator: file.estimator,
            photons: file
                .photons
                .map(|n| Settings::check_photons(n.0).map_err(|why| wrong("photons", why)))
                .transpose()?,
            seed: file.seed.unwrap_or(default.seed),
            k: count("k", file.k, Settings::check_k)?,
            map_photons: count("map_photons", file.map_photons, Settings::check_map_photons)?
                .unwrap_or(default.map_photons),
            guiding: file.guiding,
            tolerance: file
                .tolerance
                .map(|t| Settings::check_tolerance(t).map_err(|why| wrong("tolerance", why)))
                .transpose()?,
            tolerance_limit: None,
            of: Vec::new(),
            max_time: file
                .max_time
                .map(|t| Settings::check_max_time(t).map_err(|why| wrong("max_time", why)))
                .transpose()?,
            by_light: false,
            threads: count("threads", file.threads, Settings::check_threads)?.unwrap_or(0),
        })
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
