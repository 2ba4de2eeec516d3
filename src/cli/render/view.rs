//! The camera of a picture: its options, and how they are joined with the camera of the scene.

use clap::Args;
use glam::DVec3;

use phylux_core::{
    error::{Error, Result},
    scene::camera::View,
    transport::settings::Checked,
};
use phylux_files::scene_file::LoadedScene;
use phylux_show::render::Viewpoint;

/// Options of the camera. For those that are not given, the scene's camera is taken, or one is
/// chosen.
#[derive(Args)]
pub struct ViewArguments {
    /// Where the camera is, in the scene's unit of length [default: the scene's camera, or outside
    /// with the surfaces in the way cut off]
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    position: Option<DVec3>,
    /// The point in the middle of the picture [default: the camera's, or the middle of the scene]
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    look_at: Option<DVec3>,
    /// Direction that points up in the picture [default: the camera's, or 0,0,1]
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    up: Option<DVec3>,
    /// Angle of view from left to right across the picture, degrees [default: the camera's, or 45]
    #[arg(long, value_name = "DEGREES", value_parser = fov, allow_hyphen_values = true)]
    fov_deg: Option<f64>,
    /// Width of the picture in pixels [default: the camera's, or 800]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=View::MOST_PIXELS))]
    width: Option<u64>,
    /// Height of the picture in pixels [default: the camera's, or 600]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=View::MOST_PIXELS))]
    height: Option<u64>,
}

fn point(text: &str) -> Checked<DVec3> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|n| n.trim().parse().ok().filter(|n: &f64| n.is_finite())).collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) => Ok(DVec3::new(x, y, z)),
        _ => Err("must be three numbers with commas between them, as 1,-2,0.5".into()),
    }
}

fn fov(text: &str) -> Checked<f64> {
    View::check_fov(text.parse().map_err(|_| "must be a number")?)
}

impl ViewArguments {
    /// Returns the camera that looks at the scene. Error: its directions do not fit, or the scene
    /// cannot be seen with it.
    pub fn viewpoint<'a>(&self, loaded: &'a LoadedScene) -> Result<Viewpoint<'a>> {
        let LoadedScene { scene, unit, view, .. } = loaded;
        let pixels = |asked: Option<u64>, own: usize| asked.map_or(own, |n| n as usize);
        let (width, height) = view.map_or(View::SIZE, |view| (view.width, view.height));
        let size = (pixels(self.width, width), pixels(self.height, height));
        let base = match view {
            Some(view) => *view,
            None => Viewpoint::choose_view(scene, size, self.fov_deg.unwrap_or(View::FOV_DEG))?,
        };
        let metres = |point: DVec3| point * unit.metres();
        let seen = View {
            position: self.position.map_or(base.position, metres),
            look_at: self.look_at.map_or(base.look_at, metres),
            up: self.up.unwrap_or(base.up),
            fov_deg: self.fov_deg.unwrap_or(base.fov_deg),
            width: size.0,
            height: size.1,
        };
        seen.check_directions().map_err(|why| {
            Error::input("camera", why).remedy("move one of them, or give another --up")
        })?;
        let viewpoint = Viewpoint::new(scene, &seen)?;
        let chosen = view.is_none() && self.position.is_none();
        Ok(if chosen { viewpoint.cut_open() } else { viewpoint })
    }
}
