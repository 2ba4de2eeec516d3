//! Plots of the folder of a year: columns of months, carpets of hours, the course of a day.

use std::{collections::HashMap, path::Path};

use super::{
    carpet::{Carpet, Carpets, Cell},
    chosen::parted,
    colours::Names,
    drawing::{Drawn, Plot},
    field::median,
    months::{DailyLight, OfId},
    rows::rows_of,
};
use crate::{
    chart::{Chart, Series, Stroke},
    picture::Scale,
};
use phylux_core::{
    error::{Error, Result, Words, call, setting},
    math::pattern::{self, apart},
    words,
};
use phylux_files::year_table::{Face, YearFolder, YearTable};
use phylux_results::{result::light_name, year_facts::YearFacts};

/// The most captors or groups of a chart, and of carpets.
const CHARTED: usize = 6;
const CARPETS: usize = 4;

/// The kinds of plot of a year.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum YearPlotKind {
    /// Daily light integrals: the mean of each month with its error and the range of its days.
    Months,
    /// The light of every hour as a colour, hours of the day over days.
    Carpet,
    /// The light of a day, hour by hour.
    Day,
}

/// A request for a plot of a year.
#[derive(Clone, Copy, Debug)]
pub struct YearPlotRequest<'a> {
    /// The kind of plot; `None` stands for the months or, if there is but one day, for this.
    pub kind: Option<YearPlotKind>,
    /// The light that is plotted.
    pub face: Face,
    /// Name of a band or sum; `None` stands for the last one.
    pub band: Option<&'a str>,
    /// Only captors and groups whose ids fit one of these patterns, in which `*` stands for any
    /// characters; a pattern that no id fits may be several, with commas between them. None are all.
    pub captors: &'a [String],
    /// The day, such as `2005-06-21`; `None` stands for the one with the most light.
    pub day: Option<&'a str>,
    /// Ends of the colour bar of carpets.
    pub range: Option<(f64, f64)>,
}

impl Plot {
    /// Makes a plot of the year that `phylux year` wrote into a folder. Errors: the folder does not
    /// hold a year, or not what is asked for.
    pub fn of_year(folder: &Path, request: &YearPlotRequest) -> Result<Self> {
        let year = YearFolder::open(folder)?;
        let read = |name| YearTable::read(folder, name, request.face);
        let kind = match request.kind {
            Some(kind) => kind,
            None if read("days")?.times.len() == 1 => YearPlotKind::Day,
            None => YearPlotKind::Months,
        };
        match kind {
            YearPlotKind::Months => {
                let (months, days) = (read("months")?, read("days")?);
                let chosen = Chosen::new(&year, &months, request, CHARTED)?;
                let daylight = match request.face {
                    Face::Front => YearFolder::daylight(folder, chosen.name)?,
                    Face::Back | Face::Absorbed => HashMap::new(),
                };
                months_plot(&year.facts, &months, &days, &chosen, &daylight)
            }
            YearPlotKind::Carpet => {
                let hours = read("hours")?;
                let chosen = Chosen::new(&year, &hours, request, CARPETS)?;
                carpet(&year.facts, &hours, &chosen, request)
            }
            YearPlotKind::Day => {
                let hours = read("hours")?;
                let chosen = Chosen::new(&year, &hours, request, CHARTED)?;
                day(&year.facts, &hours, &chosen, request)
            }
        }
    }
}

/// What is plotted of a table.
struct Chosen<'t> {
    /// Index and name of the band or sum.
    band: usize,
    name: &'t str,
    /// Places of the captors and groups in the table.
    ids: Vec<usize>,
    /// The colour of each.
    colours: Vec<usize>,
    /// What was left out.
    notes: Vec<Words>,
    /// Words for the light, where it is not that on the front.
    face: &'static str,
    /// The name of the light, with the face.
    light: String,
}

impl<'t> Chosen<'t> {
    fn new(
        year: &'t YearFolder,
        table: &'t YearTable,
        request: &YearPlotRequest,
        most: usize,
    ) -> Result<Self> {
        let band = match request.band {
            Some(name) => table.bands.iter().position(|band| band == name).ok_or_else(|| {
                let problem = format!("{} has no band or sum `{name}`", table.path.display());
                Error::input(setting("band"), problem)
                    .remedy(format!("there are {}", table.bands.join(", ")))
            })?,
            None => table.bands.len() - 1,
        };
        let counts = |id: usize| !table.value(0, id, band)[0].is_nan();
        let all = || (0..table.ids.len()).filter(|&id| counts(id));
        let fits = |wanted: &str, id: usize| pattern::fits(wanted, &table.ids[id]);
        let patterns = parted(request.captors, |wanted| all().any(|id| fits(wanted, id)));
        let mut ids: Vec<usize> = match patterns.is_empty() {
            false => {
                let wanted = |&id: &usize| patterns.iter().any(|wanted| fits(wanted, id));
                all().filter(wanted).collect()
            }
            true => {
                let groups = all().filter(|&id| year.is_group(&table.ids[id]));
                let name = |&id: &usize| table.ids[id].as_str();
                let members = |&id: &usize| year.members(&table.ids[id]);
                let groups = apart(groups.collect(), name, members, year.captors());
                if groups.is_empty() { all().collect() } else { groups }
            }
        };
        let unknown = patterns.iter().find(|wanted| !all().any(|id| fits(wanted, id)));
        if ids.is_empty() || unknown.is_some() {
            let word = request.face.word();
            let problem = match unknown {
                Some(wanted) => format!("no captor or group `{wanted}` with light of `{word}`"),
                None => format!("no captor or group with light of `{word}`"),
            };
            let example = table.ids.first().map_or("", String::as_str);
            return Err(Error::input(setting("captors"), problem).remedy(format!(
                "write an id as it stands in {}, say `{example}`, or a pattern with `*`",
                table.path.display()
            )));
        }
        let mut notes = Vec::new();
        if ids.len() > most {
            let count = ids.len();
            notes.push(words![
                format!(
                    "{count} captors and groups, of which the first {most} are drawn: choose with "
                ),
                setting("captors")
            ]);
            // those that are named outright are wanted rather than those that a pattern fits
            let named = |id: usize| patterns.contains(&table.ids[id].as_str());
            ids = named_first(ids, named).take(most).collect();
        }
        let drawn: Vec<&str> = ids.iter().map(|&id| table.ids[id].as_str()).collect();
        let colours = Names::of(year.ids()).colours(&drawn);
        let face = match request.face {
            Face::Front => "",
            Face::Back => " on backs",
            Face::Absorbed => " absorbed",
        };
        let name = &table.bands[band];
        let facts = &year.facts;
        let of = facts.bands.iter().position(|band| band.name == *name);
        let light = match (request.face, of) {
            (Face::Absorbed, _) if facts.bands.len() > 1 => format!("absorbed, {name}"),
            (Face::Absorbed, _) => "absorbed".into(),
            (_, None) => format!("{name}{face}"),
            (_, of) => format!("{}{face}", light_name(&facts.bands, of, &facts.unit.flux)),
        };
        Ok(Self { band, name, ids, colours, notes, face, light })
    }
}

/// Puts what is named before the rest, both in their order.
fn named_first(ids: Vec<usize>, named: impl Fn(usize) -> bool) -> impl Iterator<Item = usize> {
    let (first, rest): (Vec<usize>, Vec<usize>) = ids.into_iter().partition(|&id| named(id));
    first.into_iter().chain(rest)
}

fn months_plot(
    facts: &YearFacts,
    months: &YearTable,
    days: &YearTable,
    chosen: &Chosen,
    daylight: &HashMap<(String, String), f64>,
) -> Result<Plot> {
    let same = months.ids == days.ids && months.bands == days.bands;
    if !same {
        return Err(Error::input(days.path.display(), "has other captors than the months")
            .remedy(words!["write both again with ", call("year")]));
    }
    let values = |table: &YearTable, id: usize| -> Vec<[f64; 2]> {
        (0..table.times.len()).map(|t| table.value(t, id, chosen.band).map(f64::from)).collect()
    };
    // of all days or of none
    let own = |id: &String| {
        let of = |day: &String| daylight.get(&(id.clone(), day.clone())).copied();
        days.times.iter().map(of).collect::<Option<Vec<f64>>>().unwrap_or_default()
    };
    let of = |(&id, &colour): (&usize, &usize)| OfId {
        id: months.ids[id].clone(),
        colour,
        months: values(months, id),
        days: values(days, id),
        daylight: own(&months.ids[id]),
    };
    let light = DailyLight {
        band: format!("{}{}", chosen.name, chosen.face),
        unit: facts.unit.dli.clone().unwrap_or_default().into_owned(),
        months: months.times.clone(),
        days: days.times.clone(),
        of: chosen.ids.iter().zip(&chosen.colours).map(of).collect(),
    };
    Ok(Plot { drawn: Drawn::Charts(vec![light.chart()]), notes: chosen.notes.clone() })
}

fn carpet(
    facts: &YearFacts,
    hours: &YearTable,
    chosen: &Chosen,
    request: &YearPlotRequest,
) -> Result<Plot> {
    let rows = rows_of(hours)?;
    let mut days: Vec<(i64, String)> = Vec::new();
    for row in &rows {
        if days.last().is_none_or(|(last, _)| *last < row.number) {
            days.push((row.number, row.day.into()));
        }
    }
    let day_of = |number: i64| days.binary_search_by_key(&number, |(number, _)| *number).ok();
    let carpet = |&id: &usize| {
        let mut cells = Vec::new();
        for (t, row) in rows.iter().enumerate() {
            let value = f64::from(hours.value(t, id, chosen.band)[0]);
            // a row that goes on beyond midnight is a part of two days
            for (number, from, to) in row.by_day() {
                cells.extend(day_of(number).map(|day| Cell { day, from, to, value }));
            }
        }
        let found = (0..rows.len()).map(|t| hours.value(t, id, chosen.band).map(f64::from));
        let errors = found.filter(|[value, _]| *value > 0.0).map(|[value, error]| error / value);
        let error = median(errors.filter(|error| error.is_finite()).collect());
        Carpet { id: hours.ids[id].clone(), error, cells }
    };
    let carpets: Vec<Carpet> = chosen.ids.iter().map(carpet).collect();
    let values = carpets.iter().flat_map(|c| c.cells.iter().map(|cell| cell.value));
    let scale = match request.range {
        Some((low, high)) => Scale::new(low, high, false)?,
        // few hours that outshine all others, or are rough, do not darken the rest
        None => Scale::of(values.collect(), 0.995, false),
    };
    let label = format!("{}, {}", chosen.light, facts.irradiance(chosen.name));
    let days = days.into_iter().map(|(_, name)| name).collect();
    let title = format!("{} of every hour", chosen.light);
    let drawn = Drawn::Carpets(Carpets { title, carpets, days, scale, label });
    Ok(Plot { drawn, notes: chosen.notes.clone() })
}

fn day(
    facts: &YearFacts,
    hours: &YearTable,
    chosen: &Chosen,
    request: &YearPlotRequest,
) -> Result<Plot> {
    let rows = rows_of(hours)?;
    let value = |t: usize, id: usize| hours.value(t, id, chosen.band).map(f64::from);
    let day = match request.day {
        Some(day) => day,
        None => {
            let mut best = ("", 0.0);
            let mut now = ("", 0.0);
            for (t, row) in rows.iter().enumerate() {
                if now.0 != row.day {
                    now = (row.day, 0.0);
                }
                now.1 += row.length * chosen.ids.iter().map(|&id| value(t, id)[0]).sum::<f64>();
                best = if best.0.is_empty() || now.1 > best.1 { now } else { best };
            }
            best.0
        }
    };
    let own: Vec<usize> = (0..rows.len()).filter(|&t| rows[t].day == day).collect();
    if own.is_empty() {
        let (first, last) =
            (rows.first().map_or("", |row| row.day), rows.last().map_or("", |row| row.day));
        return Err(Error::input(setting("day"), format!("the year has no day `{day}`"))
            .remedy(format!("name one from {first} to {last}")));
    }
    let mut chart = Chart {
        title: format!("{} on {day}", chosen.light),
        x: "hour of the day".into(),
        x_names: (0..=4).map(|i| (6.0 * f64::from(i), (6 * i).to_string())).collect(),
        x_ends: Some([0.0, 24.0]),
        y: format!("{}, {}", chosen.light, facts.irradiance(chosen.name)),
        linear_x: true,
        linear_y: true,
        ..Chart::default()
    };
    let lit = |&t: &usize, id: usize| value(t, id)[0] > 0.0;
    // hours that are dark for all are one line, on which no marks lie
    let dark = |t: &usize| !chosen.ids.iter().any(|&id| lit(t, id));
    let ends = own.iter().map(|t| {
        let y = if dark(t) { 0.0 } else { f64::NAN };
        [(rows[*t].hour, y), (rows[*t].hour + rows[*t].length, y)]
    });
    let night: Vec<(f64, f64)> = ends.flatten().collect();
    if night.iter().any(|(_, y)| *y == 0.0) {
        let (name, colour) = (None, Series::GREY);
        chart.series.push(Series { name, colour, stroke: Stroke::Plain, points: night });
    }
    for (&id, &colour) in chosen.ids.iter().zip(&chosen.colours) {
        let at = |&t: &usize| (rows[t].hour + 0.5 * rows[t].length, value(t, id));
        let points = own.iter().map(|t| (at(t), lit(t, id)));
        let points = points.map(|((x, [y, _]), lit)| (x, if lit { y } else { f64::NAN })).collect();
        // the line goes on to the hours without light beside them
        let near = |i: usize| own[i.saturating_sub(1)..own.len().min(i + 2)].iter();
        let joined = own.iter().enumerate().map(|(i, t)| {
            let (x, [y, _]) = at(t);
            (x, if near(i).any(|t| lit(t, id)) { y } else { f64::NAN })
        });
        let joined = joined.collect();
        let ends = own.iter().map(at).filter(|(_, [_, error])| *error > 0.0);
        let bars = ends.flat_map(|(x, [y, error])| [(x, y - error), (x, y + error)]).collect();
        let name = (chosen.ids.len() > 1).then(|| hours.ids[id].clone());
        chart.series.push(Series { name: None, colour, stroke: Stroke::Plain, points: joined });
        chart.series.push(Series { name, colour, stroke: Stroke::Line, points });
        chart.series.push(Series { name: None, colour, stroke: Stroke::Bars, points: bars });
    }
    if let [id] = chosen.ids[..] {
        chart.title += &format!(", {}", hours.ids[id]);
    }
    Ok(Plot { drawn: Drawn::Charts(vec![chart]), notes: chosen.notes.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn named_captors_come_first() {
        let found: Vec<usize> = named_first((0..6).collect(), |id| id == 4 || id == 2).collect();
        assert_eq!(found, [2, 4, 0, 1, 3, 5]);
    }
}
