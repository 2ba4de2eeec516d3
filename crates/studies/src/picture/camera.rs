//! The camera of a picture: what is asked of it, joined with the camera of the scene.

use glam::DVec3;

use phylux_core::{
    error::{Error, Result, setting},
    scene::camera::View,
    words,
};
use phylux_files::scene_file::LoadedScene;
use phylux_show::render::Viewpoint;

/// Where a picture is seen from. For what is not given, the scene's camera is taken, or one is
/// chosen.
#[derive(Clone, Copy, Debug, Default)]
pub struct PictureCamera {
    /// Where the camera is, in the scene's unit of length.
    pub position: Option<DVec3>,
    /// The point in the middle of the picture.
    pub look_at: Option<DVec3>,
    /// Direction that points up in the picture.
    pub up: Option<DVec3>,
    /// Angle of view from left to right across the picture, degrees.
    pub fov_deg: Option<f64>,
    /// Width of the picture, pixels.
    pub width: Option<u64>,
    /// Height of the picture, pixels.
    pub height: Option<u64>,
}

impl PictureCamera {
    /// Returns the camera that looks at the scene. Error: its directions do not fit, or the scene
    /// cannot be seen with it.
    pub(super) fn viewpoint<'a>(&self, loaded: &'a LoadedScene) -> Result<Viewpoint<'a>> {
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
            Error::input("camera", why)
                .remedy(words!["move one of them, or give another ", setting("up")])
        })?;
        let viewpoint = Viewpoint::new(scene, &seen)?;
        let chosen = view.is_none() && self.position.is_none();
        Ok(if chosen { viewpoint.cut_open() } else { viewpoint })
    }
}
