//! How good the choice of an estimator is that a run makes by itself: the default beside photons,
//! paths and complete paths, in shipped scenes and in random rooms and cells, on one thread.
//!
//!     cargo bench --bench choices -- --seconds 2.5 --rooms 0..100 --cells 0..20
//!
//! Each way gets about the same CPU time. Its cost at a face is the relative variance times the CPU
//! time, and a line has the median over the faces that all ways have found: the sensors' fronts, and
//! what surfaces absorb. Last come the CPU time of the default over that of as many photons, which
//! counted work is to predict as 1, and the face at which the default is farthest above photons.

#[allow(dead_code, reason = "tests use the rest")]
#[path = "../tests/common.rs"]
mod common;
#[allow(dead_code, reason = "tests use the rest")]
#[path = "../tests/world.rs"]
mod world;

#[path = "../tests/random_scenes"]
mod random {
    pub mod cell;
    mod daylight;
    mod dice;
    mod lamp;
    #[allow(dead_code, reason = "tests use the rest")]
    pub mod room;
}

use std::{fs, ops::Range, path::Path, time::Instant};

use phylux::{
    Control, Estimator, LoadedScene, RunResult, Settings, load, simulate,
    transport::{NearestCount, PhotonCount, ThreadCount},
};

const SHIPPED: [&str; 7] = [
    "box.json",
    "growth-room.json",
    "growth-chamber.json",
    "greenhouse.json",
    "greenhouse-day.json",
    "agrivoltaic.json",
    "canopy.json",
];
const WAYS: [(&str, Estimator); 3] = [
    ("photons", Estimator::Photons),
    ("paths", Estimator::Paths),
    ("complete", Estimator::Complete),
];
/// Histories of the run that measures the speed.
const FIRST: u64 = 20_000;

/// What a run has found at each face and in each band, its relative variance, and its CPU time, s.
struct Done {
    relative: Vec<Option<f64>>,
    seconds: f64,
    photons: u64,
    estimator: Estimator,
}

/// A scene's line of the table.
struct Line {
    name: String,
    chosen: Estimator,
    /// Cost of the default, then of the other ways; `None` where a way cannot run.
    costs: [Option<f64>; 4],
    time: f64,
    worst: f64,
}

impl Line {
    /// Returns the cost of the default over that of the best way.
    fn over_best(&self) -> Option<f64> {
        let best = self.costs.iter().flatten().copied().reduce(f64::min)?;
        Some(self.costs[0]? / best)
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let option = |name: &str| {
        let at = arguments.iter().position(|argument| argument == name)?;
        arguments.get(at + 1).map(String::as_str)
    };
    // among all benchmarks, of which a filter may want others, it takes too long
    let Some(seconds) = option("--seconds") else {
        println!("choices: left out; `cargo bench --bench choices -- --seconds 2.5` runs it");
        return;
    };
    let seconds = seconds.parse().expect("seconds");
    let range = |name: &str| option(name).map_or(0..0, range);
    println!("scene,chosen,default,photons,paths,complete,default/best,time/photons,worst/photons");
    let shipped: Vec<Line> = SHIPPED
        .iter()
        .map(|name| {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
            line(name, &load(&path).expect("a shipped scene"), seconds)
        })
        .collect();
    summary("shipped scenes", &shipped);
    let rooms = range("--rooms").map(|number| ("room", number, random::room::room(number)));
    let cells = range("--cells").map(|number| {
        let share = number.is_multiple_of(2);
        ("cell", number, random::cell::cell(number, share))
    });
    let random: Vec<Line> = rooms
        .chain(cells)
        .map(|(kind, number, world)| {
            let scene = world.write();
            let loaded = load(&scene.path("scene.json")).expect("a random scene");
            line(&format!("{kind} {number}"), &loaded, seconds)
        })
        .collect();
    summary("random scenes", &random);
}

fn range(text: &str) -> Range<u64> {
    let (first, end) = text.split_once("..").expect("a range, as 0..100");
    first.parse().expect("a number")..end.parse().expect("a number")
}

/// Runs a scene in all ways, and prints its line.
fn line(name: &str, loaded: &LoadedScene, seconds: f64) -> Line {
    let ways = WAYS.map(|(_, estimator)| for_seconds(loaded, estimator, seconds));
    // a default run is asked for the photons that take so long
    let photons = ways[0].as_ref().map_or(FIRST, |done| done.photons);
    let default = run(loaded, Estimator::Auto, photons).expect("a default run");
    let all = [Some(&default), ways[0].as_ref(), ways[1].as_ref(), ways[2].as_ref()];
    let is_found = |face: &usize| all.iter().flatten().all(|done| done.relative[*face].is_some());
    let faces: Vec<usize> = (0..default.relative.len()).filter(is_found).collect();
    let cost = |done: &Done, face: usize| done.relative[face].expect("found") * done.seconds;
    let costs = all.map(|done| {
        let done = done?;
        median(faces.iter().map(|&face| cost(done, face)).collect())
    });
    let above = |face: &usize| {
        let photons = all[1].map_or(f64::NAN, |done| cost(done, *face));
        cost(&default, *face) / photons
    };
    let line = Line {
        name: name.into(),
        chosen: default.estimator,
        costs,
        time: default.seconds / all[1].map_or(f64::NAN, |done| done.seconds),
        worst: faces.iter().map(above).fold(f64::NAN, f64::max),
    };
    let costs = line.costs.map(|cost| cost.map_or(String::new(), |cost| format!("{cost:.3e}")));
    println!(
        "{name},{},{},{:.2},{:.2},{:.2}",
        line.chosen,
        costs.join(","),
        line.over_best().unwrap_or(f64::NAN),
        line.time,
        line.worst
    );
    line
}

/// Runs so many histories that they take about so long. `None` where this way cannot run the scene.
fn for_seconds(loaded: &LoadedScene, estimator: Estimator, seconds: f64) -> Option<Done> {
    let first = run(loaded, estimator, FIRST)?;
    let more = (seconds / first.seconds.max(0.01)).max(1.0);
    run(loaded, estimator, (first.photons as f64 * more) as u64)
}

fn run(loaded: &LoadedScene, estimator: Estimator, photons: u64) -> Option<Done> {
    let settings = Settings {
        estimator,
        photons: PhotonCount::new(photons).ok(),
        threads: ThreadCount::ONE,
        k: Some(NearestCount::NONE),
        tolerance: None,
        max_time: None,
        ..loaded.settings.clone()
    };
    let began = cpu_seconds();
    let simulation = simulate(&loaded.scene, &settings, &Control::default()).ok()?;
    let seconds = cpu_seconds() - began;
    let result = RunResult::new(&simulation);
    let relative = |mean: f64, error: Option<f64>| {
        error.filter(|_| mean > 0.0).map(|error| (error / mean).powi(2))
    };
    let of_captor = |captor: &phylux::results::CaptorResult| {
        let front = (&captor.front.flux, &captor.front.flux_se);
        let absorbed = captor.absorbed.as_ref().zip(captor.absorbed_se.as_ref());
        let (means, errors) = absorbed.unwrap_or(front);
        means.iter().zip(errors).map(|(&mean, &error)| relative(mean, error)).collect::<Vec<_>>()
    };
    Some(Done {
        relative: result.captors.iter().flat_map(of_captor).collect(),
        seconds,
        photons,
        estimator: result.estimator,
    })
}

/// Returns the CPU time of this process, s, where the system tells it, and the time otherwise.
fn cpu_seconds() -> f64 {
    thread_local!(static BEGAN: Instant = Instant::now());
    // user time is the twelfth field after the name of the program, in hundredths of a second
    let user = fs::read_to_string("/proc/self/stat").ok().and_then(|stat| {
        let (_, fields) = stat.rsplit_once(") ")?;
        fields.split(' ').nth(11)?.parse::<f64>().ok()
    });
    user.map_or_else(|| BEGAN.with(|began| began.elapsed().as_secs_f64()), |ticks| 0.01 * ticks)
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Prints the median, the 90th percentile and the worst of some lines.
fn summary(what: &str, lines: &[Line]) {
    let print = |figure: &str, of: &dyn Fn(&Line) -> Option<f64>| {
        let found = lines.iter().filter_map(|line| Some((of(line)?, line.name.as_str())));
        let mut values: Vec<(f64, &str)> = found.filter(|(value, _)| value.is_finite()).collect();
        values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let at = |share: f64| values.get((share * values.len() as f64) as usize);
        let (Some(half), Some(most), Some(worst)) = (at(0.5), at(0.9), values.last()) else {
            return;
        };
        println!(
            "{what}, {figure}: median {:.2}, 90th percentile {:.2}, worst {:.2} ({})",
            half.0, most.0, worst.0, worst.1
        );
    };
    print("default over the best", &Line::over_best);
    print("time over that of photons", &|line| Some(line.time));
    print("worst face over photons", &|line| Some(line.worst));
}
