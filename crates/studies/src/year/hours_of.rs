//! The captors and groups whose light is kept for each hour.

use super::places::Places;
use phylux_core::{
    error::{Error, Result, setting},
    math::pattern,
};

/// The captors and groups whose light is kept for each hour.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum HoursOf {
    /// All of them; only groups if there are more than [`HoursOf::ALL`].
    #[default]
    Usual,
    /// All of them.
    All,
    /// Groups.
    Groups,
    /// None.
    None,
    /// Those whose id or name fits this pattern, in which `*` stands for any characters.
    Like(String),
}

impl HoursOf {
    /// The largest number of captors and groups all of whose hours are kept unless that is asked
    /// for.
    pub const ALL: usize = 1000;

    /// Reads `groups`, `all`, `none`, or a pattern.
    pub fn parse(text: &str) -> std::result::Result<Self, String> {
        Ok(match text {
            "" => return Err("is empty: say groups, all, none, or a pattern of ids".into()),
            "all" => Self::All,
            "groups" => Self::Groups,
            "none" => Self::None,
            pattern => Self::Like(pattern.into()),
        })
    }

    /// Returns the text that is [parsed](Self::parse) to this; `None` for the usual ones.
    pub fn text(&self) -> Option<String> {
        match self {
            Self::Usual => None,
            Self::All => Some("all".into()),
            Self::Groups => Some("groups".into()),
            Self::None => Some("none".into()),
            Self::Like(pattern) => Some(pattern.clone()),
        }
    }

    /// Returns for each id whether its hours are wanted. Error: a pattern that nothing fits.
    pub(super) fn chosen(&self, places: &Places) -> Result<Vec<bool>> {
        let all = places.ids.len();
        let from = |first: usize| (0..all).map(|id| id >= first).collect();
        Ok(match self {
            Self::All => from(0),
            Self::Usual if all <= Self::ALL => from(0),
            Self::Usual | Self::Groups => from(places.captors),
            Self::None => from(all),
            Self::Like(pattern) => {
                let chosen: Vec<bool> =
                    places.ids.iter().map(|id| pattern::fits(pattern, id)).collect();
                if !chosen.contains(&true) {
                    let problem = format!("no captor and no group like `{pattern}`");
                    return Err(Error::input(setting("hours"), problem)
                        .remedy("`*` stands for any characters; or say groups, all or none"));
                }
                chosen
            }
        })
    }
}
