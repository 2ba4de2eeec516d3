//! Reads the transforms of the command `xform`.

use glam::{DAffine3, DMat3, DVec3};

/// The largest number of copies that one command may make.
pub const MOST_COPIES: usize = 100_000;

/// The arguments of a command `xform`.
#[derive(Clone, Debug, Default)]
pub struct Xform<'a> {
    /// The transform of each copy.
    pub copies: Vec<DAffine3>,
    /// The text that is put before the identifiers of surfaces, followed by a dot.
    pub prefix: Option<&'a str>,
    /// The material that replaces those of the surfaces.
    pub modifier: Option<&'a str>,
    /// Whether the fronts of surfaces are turned to the other side.
    pub inverted: bool,
    /// The files; empty where the command reads the standard input.
    pub files: Vec<&'a str>,
}

/// Reads the arguments after `xform`; the error is the problem alone, without its place.
pub fn xform<'a>(arguments: &[&'a str]) -> Result<Xform<'a>, String> {
    let mut asked = Xform { copies: vec![DAffine3::IDENTITY], ..Xform::default() };
    // the repetition that is being read: how often it applies, and the transform of one step
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
    /// Applies a part of the arguments to the copies: its `step` is repeated `times` times. An
    /// iteration keeps only the last result; an array keeps one copy for each number of steps,
    /// beginning with none.
    fn repeat(&mut self, times: Option<(usize, bool)>, step: DAffine3) -> Result<(), String> {
        let (times, is_array) = times.unwrap_or((1, false));
        let mut powers = vec![DAffine3::IDENTITY];
        for _ in 0..times {
            let last = powers[powers.len() - 1];
            powers.push(step * last);
        }
        // an array of n has copies after 0 to n - 1 steps, an iteration one after n steps
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
