//! Turns the types of the file into parameters and points, and checks everything.

use std::{collections::HashSet, fmt::Display};

use serde_json::Value;

use super::{
    design::{self, Choices, Points},
    format::{CombineFile, FullFile, SampleFile, SampleKind, SweepFile, VaryFile, Whole},
    parameter::{BALANCE, COLUMNS, Parameter, X, expression, is_numbers},
};
use crate::{input::quoted, json};
use phylux_core::{
    error::{Error, Problem, Result, nearest},
    math::expression::Expression,
};

/// The largest number of runs of a sweep.
const MAX_RUNS: u64 = 1_000_000;
/// The largest number of values in all runs of a sweep together.
const MAX_VALUES: u64 = 10_000_000;
/// The longest value, as JSON, bytes.
const MAX_VALUE: usize = 10_000;
/// The greatest length of the name of a parameter and of a pointer, bytes.
const MAX_NAME: usize = 1_000;
/// The largest number of pointers of a scene that are compared to find the nearest one.
const MAX_POINTERS: usize = 5_000;
/// Places of the seed, which cannot be parameters because `seeds` varies the seed.
const SEED: [&str; 2] = ["/settings", "/settings/seed"];

/// A sweep file and its scene while they are read.
pub struct Reader<'a> {
    /// Name of the sweep file.
    pub name: &'a str,
    /// The scene as written.
    pub scene: &'a Value,
}

impl Reader<'_> {
    /// Returns the parameters and the points of the design, which say which values go together.
    pub fn design(&self, file: &SweepFile, seeds: u64) -> Result<(Vec<Parameter>, Points)> {
        if file.vary.is_empty() {
            let example = "name a place of the scene, such as \"/lights/0/power\": [40, 60]";
            return Err(self.error("/vary", "nothing varies").remedy(example));
        }
        if seeds == 0 {
            return Err(self.error("/seeds", "0, must be at least 1").remedy("leave it out for 1"));
        }
        let mut parameters: Vec<Parameter> = Vec::new();
        let (mut choices, mut values) = (Vec::new(), 0u64);
        for (name, vary) in &file.vary {
            let at = self.places(name, vary)?;
            values += match vary {
                VaryFile::Full(FullFile { steps: Some(steps), .. }) => steps.0,
                _ => 0,
            };
            if values > MAX_VALUES {
                let problem = format!("the steps are more than {MAX_VALUES} values together");
                return Err(self.vary(name, problem).remedy("take fewer"));
            }
            choices.push(self.choices(name, vary)?);
            let name = name.clone();
            parameters.push(Parameter { name, at, values: Vec::new(), is_read: false });
        }
        self.check_apart(&parameters)?;
        let points = match file.combine {
            CombineFile::Whole(combine) => {
                let names = file.vary.keys();
                let lists = names.zip(choices).map(|(name, choices)| match choices {
                    Choices::Listed(values) => Ok(values),
                    Choices::Between(..) => Err(self
                        .vary(name, "`from` and `to` without `steps`")
                        .remedy("say how many values; only a sample does without")),
                });
                let lists = lists.collect::<Result<Vec<_>>>()?;
                let lengths: Vec<usize> = lists.iter().map(Vec::len).collect();
                for (parameter, values) in parameters.iter_mut().zip(lists) {
                    parameter.values = values;
                }
                self.whole(combine, &parameters, &lengths, seeds)?
            }
            CombineFile::Sample(sample) => self.sample(sample, &mut parameters, choices, seeds)?,
        };
        self.check_expressions(&mut parameters)?;
        Ok((parameters, points))
    }

    /// Checks the expressions at places with numbers: they must be valid and use only names of
    /// parameters whose values are numbers. Marks the parameters that they use. A parameter without
    /// a place must be used by an expression.
    fn check_expressions(&self, parameters: &mut [Parameter]) -> Result<()> {
        let mut read = HashSet::new();
        for parameter in parameters.iter() {
            let is_number = |place: &String| self.scene.pointer(place).is_some_and(is_numbers);
            if !parameter.at.iter().any(is_number) {
                continue;
            }
            for text in parameter.values.iter().filter_map(expression) {
                let shown = quoted(&format!("={text}"));
                let wrong = |problem: Problem| {
                    problem.of(&shown).at(json::place(self.name, &vary_pointer(&parameter.name)))
                };
                for name in Expression::parse(text).map_err(wrong)?.names() {
                    self.check_name(name, parameters).map_err(wrong)?;
                    read.insert(name.to_string());
                }
            }
        }
        for parameter in parameters {
            parameter.is_read = read.contains(&parameter.name);
            if parameter.at.is_empty() && !parameter.is_read {
                let remedy = "give `at`, a list of JSON pointers such as [\"/lights/0/power\"], name the parameter \
                              by its pointer, or read it in an expression of another, as in \"=x + rise\"";
                return Err(self
                    .vary(&parameter.name, "does not say where in the scene its value goes")
                    .remedy(remedy));
            }
        }
        Ok(())
    }

    /// Checks a name in an expression: it must be `x`, or a parameter whose values are numbers.
    fn check_name(&self, name: &str, all: &[Parameter]) -> std::result::Result<(), Problem> {
        if name == X {
            return Ok(());
        }
        let Some(other) = all.iter().find(|other| other.name == name) else {
            let problem = format!("there is no parameter {}", quoted(name));
            return Err(Problem::new(
                problem,
                "x is what stands in the scene; other names are parameters",
            ));
        };
        match other.values.iter().all(Value::is_number) {
            true => Ok(()),
            false => Err(Problem::new(
                format!("a value of {} is no number", quoted(name)),
                "expressions read parameters whose values are numbers",
            )),
        }
    }

    fn whole(
        &self,
        combine: Whole,
        parameters: &[Parameter],
        lengths: &[usize],
        seeds: u64,
    ) -> Result<Points> {
        if let (Whole::Zip, Some(other)) = (combine, lengths.iter().position(|l| *l != lengths[0]))
        {
            let problem = format!(
                "zip takes values in pairs, but {} has {} and {} has {}",
                quoted(&parameters[0].name),
                lengths[0],
                quoted(&parameters[other].name),
                lengths[other]
            );
            return Err(self
                .error("/combine", problem)
                .remedy("give each the same number of values"));
        }
        let points = match combine {
            Whole::Zip => Some(lengths[0] as u64),
            Whole::Grid => lengths.iter().try_fold(1u64, |n, l| n.checked_mul(*l as u64)),
        };
        self.check_size(points, seeds, lengths.len())?;
        Ok(design::whole(combine, lengths))
    }

    fn sample(
        &self,
        sample: SampleFile,
        parameters: &mut [Parameter],
        choices: Vec<Choices>,
        seeds: u64,
    ) -> Result<Points> {
        let count = sample.count.0;
        if count == 0 {
            return Err(self
                .error("/combine/count", "0, must be at least 1")
                .remedy("say how many points"));
        }
        self.check_size(Some(count), seeds, parameters.len())?;
        if sample.sample == SampleKind::Sobol {
            let problem = if count > design::SOBOL_POINTS as u64 {
                Some(format!("{count} points, at most {}", design::SOBOL_POINTS))
            } else if parameters.len() > design::SOBOL_DIMENSIONS {
                Some(format!(
                    "{} parameters, at most {}",
                    parameters.len(),
                    design::SOBOL_DIMENSIONS
                ))
            } else {
                None
            };
            if let Some(problem) = problem {
                return Err(self.error("/combine", problem).remedy("latin-hypercube takes more"));
            }
        }
        let seed = sample.seed.unwrap_or(1);
        let columns = design::sample(sample.sample, count as usize, parameters.len(), seed);
        let mut points = vec![Vec::with_capacity(parameters.len()); count as usize];
        for ((parameter, choices), column) in parameters.iter_mut().zip(choices).zip(columns) {
            let index = |u: f64, n: usize| ((u * n as f64) as usize).min(n - 1) as u32;
            match choices {
                Choices::Listed(values) => {
                    let n = values.len();
                    parameter.values = values;
                    points.iter_mut().zip(column).for_each(|(point, u)| point.push(index(u, n)));
                }
                Choices::Between(from, to) => {
                    parameter.values =
                        column.iter().map(|u| design::between(from, to, *u)).collect();
                    points.iter_mut().enumerate().for_each(|(i, point)| point.push(i as u32));
                }
            }
        }
        Ok(points)
    }

    fn check_size(&self, points: Option<u64>, seeds: u64, parameters: usize) -> Result<()> {
        let runs = points.and_then(|points| points.checked_mul(seeds));
        let most = MAX_RUNS.min(MAX_VALUES / parameters as u64);
        match runs {
            Some(runs) if runs <= most => Ok(()),
            _ => {
                let many = runs.map_or("more than 1e19".into(), |runs| runs.to_string());
                let problem = format!("{many} runs, must be at most {most}");
                let remedy =
                    "take fewer values, or \"combine\": {\"sample\": \"sobol\", \"count\": 256}";
                Err(self.error("", problem).remedy(remedy))
            }
        }
    }

    /// Returns the places in the scene that take a parameter's value.
    fn places(&self, name: &str, vary: &VaryFile) -> Result<Vec<String>> {
        if name.is_empty() || name.len() > MAX_NAME || name.contains(char::is_control) {
            return Err(self
                .vary(name, "a name must be a short text on one line")
                .remedy("rename it"));
        }
        if COLUMNS.contains(&name) || BALANCE.iter().any(|word| name.starts_with(word)) {
            return Err(self
                .vary(name, "the tables have a column of this name")
                .remedy("rename it"));
        }
        let at = match vary {
            VaryFile::Full(FullFile { at: Some(at), .. }) if !at.is_empty() => at.clone(),
            _ if name.starts_with('/') => vec![name.to_string()],
            // without a place, an expression must use the parameter
            _ => Vec::new(),
        };
        let mut all = Vec::new();
        for place in &at {
            match self.all_like(place) {
                found if found.is_empty() => {
                    self.check_place(name, place)?;
                    all.push(place.clone());
                }
                found => all.extend(found),
            }
        }
        Ok(all)
    }

    /// Returns the places in the scene that a pointer with `*` instead of an index or a name stands
    /// for. The result is empty if the pointer has no `*`, or if there is no such place.
    fn all_like(&self, pattern: &str) -> Vec<String> {
        let steps: Vec<&str> = pattern.split('/').skip(1).collect();
        if !pattern.starts_with('/') || !steps.contains(&"*") {
            return Vec::new();
        }
        let mut found = vec![(String::new(), self.scene)];
        for step in steps {
            let mut next = Vec::new();
            for (at, value) in found {
                let named = entries(value).filter(|(key, _)| step == "*" || step == key);
                next.extend(named.map(|(key, inner)| (format!("{at}/{key}"), inner)));
            }
            found = next;
        }
        found.into_iter().map(|(at, _)| at).collect()
    }

    /// Checks that no place is set twice, neither directly nor as a part of another place.
    fn check_apart(&self, parameters: &[Parameter]) -> Result<()> {
        let mut places = HashSet::new();
        let all = || parameters.iter().flat_map(|p| p.at.iter().map(move |at| (p, at.as_str())));
        for (parameter, place) in all() {
            if !places.insert(place) {
                return Err(self
                    .vary(&parameter.name, format!("{place} is set twice"))
                    .remedy("set each place once"));
            }
        }
        for (parameter, place) in all() {
            let mut outer = place.match_indices('/').skip(1).map(|(end, _)| &place[..end]);
            if let Some(outer) = outer.find(|outer| places.contains(outer)) {
                return Err(self
                    .vary(
                        &parameter.name,
                        format!("{place} is a part of {outer}, which is set too"),
                    )
                    .remedy("set one of them"));
            }
        }
        Ok(())
    }

    fn check_place(&self, name: &str, place: &str) -> Result<()> {
        if SEED.contains(&place) {
            return Err(self.vary(name, format!("{place} cannot vary")).remedy(
                "`seeds` repeats each run with other seeds; other settings vary one by one",
            ));
        }
        if !place.starts_with('/') {
            return Err(self
                .vary(name, format!("{} is no JSON pointer", quoted(place)))
                .remedy("begin it with /, as in /lights/0/power"));
        }
        if self.scene.pointer(place).is_some() {
            return Ok(());
        }
        let mut all = Vec::new();
        pointers(self.scene, &mut String::new(), &mut all);
        let problem = format!("the scene has no {}", quoted(place));
        let error = self.vary(name, problem);
        Err(match nearest(place, all.iter().map(String::as_str)) {
            Some(near) => error.remedy(format!("the nearest that it has is {near}")),
            None => error.remedy("name a place that it has, as in /lights/0/power"),
        })
    }

    fn choices(&self, name: &str, vary: &VaryFile) -> Result<Choices> {
        let full = match vary {
            VaryFile::List(values) => return self.listed(name, values),
            VaryFile::Full(full) => full,
        };
        match full {
            FullFile { values: Some(values), from: None, to: None, steps: None, .. } => {
                self.listed(name, values)
            }
            FullFile { values: None, from: Some(from), to: Some(to), steps, .. } => {
                let Some(steps) = steps else { return Ok(Choices::Between(*from, *to)) };
                if !(2..=MAX_RUNS).contains(&steps.0) {
                    let problem = format!("{} steps, must be 2 to {MAX_RUNS}", steps.0);
                    return Err(self.vary(name, problem).remedy("both ends are among them"));
                }
                Ok(Choices::Listed(design::steps(*from, *to, steps.0 as usize)))
            }
            _ => Err(self
                .vary(name, "needs `values`, or `from` and `to`, and not both")
                .remedy("for example {\"from\": 0, \"to\": 10, \"steps\": 11}")),
        }
    }

    fn listed(&self, name: &str, values: &[Value]) -> Result<Choices> {
        if values.is_empty() {
            return Err(self.vary(name, "has no values").remedy("list at least one"));
        }
        if values.iter().any(|value| value.is_null() || value.to_string().len() > MAX_VALUE) {
            return Err(self
                .vary(name, format!("a value is null, or longer than {MAX_VALUE} bytes"))
                .remedy("give numbers, texts or short arrays"));
        }
        Ok(Choices::Listed(values.iter().map(plain).collect()))
    }

    /// Returns an error at a JSON pointer of the sweep file.
    fn error(&self, pointer: &str, problem: impl Display) -> Error {
        Error::input(json::place(self.name, pointer), problem)
    }

    /// Returns an error at a parameter.
    fn vary(&self, name: &str, problem: impl Display) -> Error {
        self.error(&vary_pointer(name), problem)
    }
}

/// Returns the place of a parameter in the sweep file, as it is shown to the user.
fn vary_pointer(name: &str) -> String {
    format!("/vary: {}", quoted(name))
}

/// Turns numbers such as 40.0 into 40, so that both count as the same value.
fn plain(value: &Value) -> Value {
    match value {
        Value::Number(n) if n.is_f64() => n.as_f64().map_or(value.clone(), design::number),
        Value::Array(values) => values.iter().map(plain).collect(),
        Value::Object(map) => map.iter().map(|(key, v)| (key.clone(), plain(v))).collect(),
        other => other.clone(),
    }
}

/// Collects the pointers to everything inside `value`, which is at the pointer `at`; stops at
/// [`MAX_POINTERS`].
fn pointers(value: &Value, at: &mut String, found: &mut Vec<String>) {
    let whole = at.len();
    for (key, inner) in entries(value) {
        if found.len() == MAX_POINTERS {
            return;
        }
        at.push('/');
        at.push_str(&key);
        found.push(at.clone());
        pointers(inner, at, found);
        at.truncate(whole);
    }
}

/// Returns the entries of an object or array, each with its step in a pointer.
fn entries(value: &Value) -> Box<dyn Iterator<Item = (String, &Value)> + '_> {
    match value {
        Value::Object(map) => Box::new(map.iter().map(|(key, v)| (json::escaped(key), v))),
        Value::Array(list) => Box::new(list.iter().enumerate().map(|(i, v)| (i.to_string(), v))),
        _ => Box::new(std::iter::empty()),
    }
}
