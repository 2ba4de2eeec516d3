//! How the command line reads the choices that the library offers, with a sentence for each.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use phylux_core::transport::settings::{Estimator, Guiding};

/// Reads an estimator by its name.
pub fn estimator() -> impl TypedValueParser<Value = Estimator> {
    one_of([
        (
            "photons",
            Estimator::Photons,
            "Photons are traced from the lights and counted where they arrive",
        ),
        ("paths", Estimator::Paths, "Paths are traced backward, from the captors to the lights"),
        (
            "complete",
            Estimator::Complete,
            "Paths, and beside them photons that count where they bring light which paths cannot find",
        ),
        (
            "auto",
            Estimator::Auto,
            "The default: a short trial chooses photons or complete paths, whichever take less work; --photons N is the work of N photons",
        ),
    ])
}

/// Reads by its name the help that photons get.
pub fn guiding() -> impl TypedValueParser<Value = Guiding> {
    one_of([
        ("off", Guiding::Off, "None: photons are left to chance"),
        (
            "aim",
            Guiding::Aim,
            "Flights are aimed at virtual captors, from wherever a photon is emitted or scattered diffusely",
        ),
        (
            "full",
            Guiding::Full,
            "As `aim`, and photons are also split or ended depending on how much light at a place \
             matters to the captors",
        ),
        ("auto", Guiding::Auto, "A short trial chooses the cheapest of `off`, `aim` and `full`"),
    ])
}

/// Reads one of the `choices` of the library by its name; `help` has a sentence for each.
pub fn explained<T: Copy + Send + Sync + 'static, const N: usize>(
    choices: [(&'static str, T); N],
    help: [&'static str; N],
) -> impl TypedValueParser<Value = T> {
    let mut help = help.into_iter();
    one_of(choices.map(|(name, value)| (name, value, help.next().unwrap_or_default())))
}

/// Reads one of the `choices` of the library, whose names say all.
pub fn named<T: Copy + Send + Sync + 'static, const N: usize>(
    choices: [(&'static str, T); N],
) -> impl TypedValueParser<Value = T> {
    one_of(choices.map(|(name, value)| (name, value, "")))
}

/// Reads one of `choices`: a name, its value, and what it means, if this is said.
fn one_of<T: Copy + Send + Sync + 'static, const N: usize>(
    choices: [(&'static str, T, &'static str); N],
) -> impl TypedValueParser<Value = T> {
    let named = choices.map(|(name, _, help)| match help {
        "" => PossibleValue::new(name),
        help => PossibleValue::new(name).help(help),
    });
    PossibleValuesParser::new(named).map(move |given| {
        let chosen = choices.iter().find(|(name, ..)| *name == given);
        chosen.expect("the parser lets known names through alone").1
    })
}
