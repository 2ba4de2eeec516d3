//! The transforms of `xform`.

use glam::{DAffine3, DMat3, DVec3};

/// Copies that one command may make.
pub const MOST_COPIES: usize = 100_000;

/// What a command asks for.
#[derive(Clone, Debug, Default)]
pub struct Xform<'a> {
    /// Where the copies go.
    pub copies: Vec<DAffine3>,
    /// What goes before their identifiers, with a dot.
    pub prefix: Option<&'a str>,
    /// What their surfaces are made of.
    pub modifier: Option<&'a str>,
    /// Whether surfaces are turned over.
    pub inverted: bool,
    /// The files, none for what follows on the standard input.
    pub files: Vec<&'a str>,
}

/// Reads the arguments after `xform`; the error is the problem alone.
pub fn xform<'a>(arguments: &[&'a str]) -> Result<Xform<'a>, String> {
    let mut asked = Xform { copies: vec![DAffine3::IDENTITY], ..Xform::default() };
    // of the repetition that is being read: how often, and what each adds
    let (mut times, mut step) = (None, DAffine3::IDENTITY);
    let mut words = arguments.iter().copied().peekable();
    while let Some(word) = words.next_if(|word| word.starts_with('-')) {
        let mut number = || -> Result<f64, String> {
            let text = words.next().unwrap_or_default();
            let number = text.parse().ok().filter(|x: &f64| x.is_finite());
            number.ok_or_else(|| format!("`{word}` without its numbers"))
        };
        let mirror =
            |axis: DVec3| DAffine3::from_mat3(DMat3::from_diagonal(DVec3::ONE - 2.0 * axis));
        let next = match word {
            "-t" => DAffine3::from_translation(DVec3::new(number()?, number()?, number()?)),
            "-rx" => DAffine3::from_rotation_x(number()?.to_radians()),
            "-ry" => DAffine3::from_rotation_y(number()?.to_radians()),
            "-rz" => DAffine3::from_rotation_z(number()?.to_radians()),
            "-s" => {
                let scale = number()?;
                if scale <= 0.0 {
                    return Err("`-s` with a scale that is not above 0".into());
                }
                DAffine3::from_scale(DVec3::splat(scale))
            }
            "-mx" => mirror(DVec3::X),
            "-my" => mirror(DVec3::Y),
            "-mz" => mirror(DVec3::Z),
            "-a" | "-i" => {
                let count = number()?;
                if !(1.0..=MOST_COPIES as f64).contains(&count) || count.fract() != 0.0 {
                    return Err(format!("`{word}` is no number of copies from 1 to {MOST_COPIES}"));
                }
                asked.repeat(times.take(), step)?;
                times = Some((count as usize, word == "-a"));
                step = DAffine3::IDENTITY;
                continue;
            }
            "-n" => {
                asked.prefix = Some(words.next().ok_or("`-n` without a name")?);
                continue;
            }
            "-m" => {
                asked.modifier = Some(words.next().ok_or("`-m` without a modifier")?);
                continue;
            }
            "-I" => {
                asked.inverted = !asked.inverted;
                continue;
            }
            "-e" | "-c" => continue,
            _ => return Err(format!("the option `{word}` of xform is not known")),
        };
        step = next * step;
    }
    asked.repeat(times, step)?;
    asked.files = words.collect();
    Ok(asked)
}

impl Xform<'_> {
    /// Takes up a part of the arguments: done so many times in turn, of which an array keeps each, beginning with none.
    fn repeat(&mut self, times: Option<(usize, bool)>, step: DAffine3) -> Result<(), String> {
        let (times, is_array) = times.unwrap_or((1, false));
        let mut powers = vec![DAffine3::IDENTITY];
        for _ in 0..times {
            let last = powers[powers.len() - 1];
            powers.push(step * last);
        }
        // an array of n has 0 to n - 1 steps, an iteration n of them
        let kept = if is_array { &powers[..times] } else { &powers[times..] };
        if self.copies.len() * kept.len() > MOST_COPIES {
            return Err(format!("more than {MOST_COPIES} copies"));
        }
        let after =
            |copy: &DAffine3| kept.iter().map(move |power| *power * *copy).collect::<Vec<_>>();
        self.copies = self.copies.iter().flat_map(after).collect();
        match self.copies.iter().all(|copy| copy.is_finite()) {
            true => Ok(()),
            false => Err("a transform that is not finite".into()),
        }
    }
}
