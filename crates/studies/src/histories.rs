//! On which ways light reaches a captor or a group of captors.

use phylux_core::{
    error::{Error, Result, Words, call, nearest, setting},
    scene::{captor::Channel, world::Scene},
    transport::{
        histories::{Goal, trace_histories},
        settings::{Checked, PhotonCount, Settings, ThreadCount},
        simulate::Control,
    },
    words,
};
use phylux_files::scene_file::LoadedScene;
use phylux_results::histories::HistoriesResult;
use phylux_show::following::Following;

/// Fewer histories than this find shares too roughly to rely on their errors.
const FEW: u64 = 100;

/// Whose light is followed, and how.
#[derive(Clone, Debug)]
pub struct HistoriesJob {
    /// The captor, or the group of captors.
    pub to: String,
    /// The face at which light counts; `None` for all that count light.
    pub face: Option<Channel>,
    /// Band, or sum over bands, by which lines are drawn; `None` for the first sum, or the first
    /// band.
    pub band: Option<String>,
    /// The most histories that are kept as lines.
    pub lines: usize,
    /// Number of photons; where it, the seed or the number of threads is not given, the scene's
    /// holds.
    pub photons: Option<PhotonCount>,
    /// Seed of the random numbers.
    pub seed: Option<u64>,
    /// Number of threads.
    pub threads: Option<ThreadCount>,
}

impl HistoriesJob {
    /// The usual number of lines.
    pub const LINES: usize = 500;
    const MOST_LINES: u64 = 100_000;
    /// The faces, by their names.
    pub const FACES: [(&'static str, Option<Channel>); 3] =
        [("front", Some(Channel::Front)), ("back", Some(Channel::Back)), ("both", None)];

    /// Checks a number of lines. Error: they are too many.
    pub fn lines(number: u64) -> Checked<usize> {
        match number {
            lines @ ..=Self::MOST_LINES => Ok(lines as usize),
            _ => Err(format!("must be at most {}", Self::MOST_LINES)),
        }
    }

    /// Follows the light that is asked for. Errors: there is no such captor, face or band; those of
    /// [`trace_histories`].
    pub fn found(&self, loaded: &LoadedScene, control: &Control) -> Result<HistoriesResult> {
        let LoadedScene { scene, settings: of_scene, .. } = loaded;
        let goal = goal(scene, &self.to, self.face)?;
        let column = column(scene, self.band.as_deref())?;
        let settings = Settings {
            photons: self.photons.or(of_scene.photons),
            seed: self.seed.unwrap_or(of_scene.seed),
            threads: self.threads.unwrap_or(of_scene.threads),
            ..of_scene.clone()
        };
        let goals = std::slice::from_ref(&goal);
        let found = trace_histories(scene, goals, (column, self.lines), &settings, control);
        let found = found.map_err(|error| match (&*error.place(), self.photons) {
            ("photons", Some(_)) => error.at(setting("photons")),
            _ => loaded.placed(error),
        })?;
        Ok(HistoriesResult::new(scene, &self.to, &goal, column, settings.seed, &found[0]))
    }
}

/// Returns the captor, or the captors of the group, of this name. Errors: there is none; it counts no
/// light at its back, where that is asked for.
fn goal(scene: &Scene, name: &str, face: Option<Channel>) -> Result<Goal> {
    let captors = scene.captors();
    let own = captors.iter().position(|captor| captor.id == name);
    let group = scene.groups().iter().position(|group| group == name);
    let chosen: Vec<usize> = match (own, group) {
        (Some(captor), _) => vec![captor],
        (None, Some(group)) => {
            (0..captors.len()).filter(|c| captors[*c].groups.contains(&group)).collect()
        }
        (None, None) => {
            let problem = format!("the scene has no captor or group `{name}`");
            let ids = captors.iter().map(|captor| captor.id.as_str());
            let near = nearest(name, scene.groups().iter().map(String::as_str).chain(ids));
            let otherwise = match captors.is_empty() {
                true => words!["it has no captors: add one"],
                false => words![call("run"), " and ", call("check"), " name them"],
            };
            return Err(Error::input(setting("to"), problem).did_you_mean(near, otherwise));
        }
    };
    if face == Some(Channel::Back) && !chosen.iter().any(|c| captors[*c].kind.has_back()) {
        let problem = format!("`{name}` counts no light at its back");
        return Err(Error::input(setting("face"), problem).remedy(words![
            "leave ",
            setting("face"),
            " out"
        ]));
    }
    Ok(Goal { captors: chosen, face })
}

/// Returns the captors whose light a page follows: those of this name or, without a name, all of a
/// scene that has few. Errors: there is no captor or group of this name; there are too many of them.
pub fn following(scene: &Scene, name: Option<&str>) -> Result<Following> {
    let named = name.map(|name| goal(scene, name, None)).transpose()?;
    Following::of(scene, named.as_ref().map(|goal| &*goal.captors))
}

/// Returns the index of the band or sum of this name; without a name that of the first sum, or of the
/// first band. Error: there is none.
fn column(scene: &Scene, name: Option<&str>) -> Result<usize> {
    let Some(name) = name else {
        return Ok(if scene.sums().is_empty() { 0 } else { scene.bands().len() });
    };
    scene.band_names().position(|band| band == name).ok_or_else(|| {
        Error::input(setting("band"), format!("the scene has no band `{name}`"))
            .did_you_mean(nearest(name, scene.band_names()), "name one of /bands or /sums")
    })
}

/// Returns what is to be said where little light has come.
pub fn warnings(result: &HistoriesResult) -> Vec<Words> {
    let HistoriesResult { to, photons, whole, .. } = result;
    let text = match whole.histories {
        0 => words![
            format!("no light has come to {to} in {photons} photons: trace more, or see by "),
            call("check"),
            " and ",
            call("view"),
            " whether a light can reach it"
        ],
        few @ ..FEW => words![
            format!(
                "only {few} histories have come to {to}, so that shares and their errors are rough: trace more \
                 photons ("
            ),
            setting("photons"),
            ")"
        ],
        _ => return Vec::new(),
    };
    vec![text]
}
