//! The captors whose light a page follows: which, with how many photons, and what was found.

use phylux_core::{
    error::{Error, Result, setting},
    scene::world::Scene,
    transport::{
        histories::{Goal, Histories, trace_histories},
        settings::{PhotonCount, Settings},
        simulate::Control,
    },
};

/// Up to this many captors of a scene are followed without being named, with at most so many photons.
const MOST_UNNAMED: usize = 64;
const UNNAMED_PHOTONS: u64 = 500_000;
/// Limits on the captors whose light a page follows, on the lines of a captor, and on all lines.
const MOST_CAPTORS: usize = 1000;
const MOST_LINES_EACH: usize = 200;
const MOST_LINES: usize = 10_000;

/// The captors whose light a page follows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Following {
    captors: Vec<usize>,
    /// The most photons to trace for it; `None`: as many as the settings say.
    most: Option<u64>,
}

/// How light reaches these captors.
#[derive(Clone, Debug)]
pub struct Followed {
    /// Index of the band or sum by which lines are drawn: the first sum or, without sums, the first
    /// band.
    pub column: usize,
    /// The captors, each with its histories.
    pub captors: Vec<(usize, Histories)>,
}

impl Following {
    /// Chooses the captors whose light a page follows: those that are `named` or, if none are, all
    /// captors of a scene that has at most 64. Error: more than 1000 captors are named.
    pub fn of(scene: &Scene, named: Option<&[usize]>) -> Result<Self> {
        let captors = scene.captors().len();
        match named {
            None if captors <= MOST_UNNAMED => {
                Ok(Self { captors: (0..captors).collect(), most: Some(UNNAMED_PHOTONS) })
            }
            None => Ok(Self::default()),
            Some(named) if named.len() <= MOST_CAPTORS => {
                Ok(Self { captors: named.to_vec(), most: None })
            }
            Some(named) => {
                let named = named.len();
                let problem = format!(
                    "names {named} captors, and a page follows the light of at most {MOST_CAPTORS}"
                );
                Err(Error::input(setting("to"), problem)
                    .remedy("name a captor, or a smaller group"))
            }
        }
    }

    /// Returns the most lines of each captor.
    fn lines(&self) -> usize {
        MOST_LINES_EACH.min(MOST_LINES / self.captors.len().max(1))
    }

    /// Follows the light of the captors with the photons of the settings. `None` where there are no
    /// captors. Errors: those of [`trace_histories`].
    pub fn follow(
        &self,
        scene: &Scene,
        settings: &Settings,
        control: &Control,
    ) -> Result<Option<Followed>> {
        if self.captors.is_empty() {
            return Ok(None);
        }
        let asked = settings.photons_or_default();
        let least = scene.sources() as u64;
        let photons = self.most.map_or(asked, |most| asked.min(most).max(least));
        let settings = Settings { photons: PhotonCount::new(photons).ok(), ..settings.clone() };
        let column = if scene.sums().is_empty() { 0 } else { scene.bands().len() };
        let goal = |captor: &usize| Goal { captors: vec![*captor], face: None };
        let goals: Vec<Goal> = self.captors.iter().map(goal).collect();
        let found = trace_histories(scene, &goals, (column, self.lines()), &settings, control)?;
        Ok(Some(Followed { column, captors: self.captors.iter().copied().zip(found).collect() }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_captors_have_fewer_lines_each() {
        let lines = |captors: usize| Following { captors: vec![0; captors], most: None }.lines();
        assert_eq!([1, 50, 64, 1000].map(lines), [200, 200, 156, 10]);
    }
}
