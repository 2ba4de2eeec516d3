//! A study of the k-nearest estimate: its bias and spread against k, number of photons, shape of
//! the captor and gradient of the light, and other kernels on the same photons. Its findings are in
//! docs/notes/nearest.md.

use std::{borrow::Cow, collections::BTreeMap, f64::consts::PI};

use glam::{DVec3, Vec3};
use phylux::{
    Control, LoadedScene, RunResult, Settings, Simulation,
    math::Triangle,
    transport::{Neighbour, PhotonCount},
};
use serde_json::json;

use crate::{
    common::TestScene,
    world::{Mesh, Point, World},
};

const KS: [usize; 9] = [10, 20, 50, 100, 200, 500, 1_000, 2_000, 5_000];
const ARRIVALS: [f64; 5] = [1e2, 1e3, 1e4, 1e5, 1e6];
const UP: Point = [0.0, 0.0, 1.0];

/// Returns the number of seeds for a case with this many arrivals, which is lower where there are
/// many.
fn seeds(arrivals: f64) -> u64 {
    match arrivals {
        ..5e4 => 100,
        ..5e5 => 60,
        _ => 10,
    }
}

/// The weight of a photon as a function of its squared distance over that of the k-th photon.
type Kernel = fn(f64) -> f64;
const KERNELS: [(&str, Kernel); 5] = [
    ("constant", |_| 1.0),
    ("Epanechnikov", |u| 1.0 - u),
    ("cone", |u| 1.0 - u.sqrt()),
    ("biweight", |u| (1.0 - u) * (1.0 - u)),
    // Jensen 2001, section 7.2.2
    ("Gaussian", |u| 1.0 - (-0.5 * 1.953 * u).exp_m1() / (-1.953f64).exp_m1()),
];

/// One captor in light that is known exactly.
struct Case {
    name: String,
    world: World,
    /// Irradiance at the captor's query point, W/m2.
    truth: f64,
    /// Height of the lamp above the middle of a square, in sides of the square; `None` in other
    /// light.
    height: Option<f64>,
    /// Whether the irradiance is uniform over the whole captor.
    uniform: bool,
}

/// Returns a captor under a Lambertian sheet of the same shape or another, 1e-5 m above it.
fn under_sheet(name: &str, captor: &Mesh, lamp: Mesh, truth: f64, uniform: bool) -> Case {
    let lamp = lamp.flipped().shifted([0.0, 0.0, 1e-5]);
    let world = World::new().captor("captor", captor).lamp("lamp", &lamp, 1.0);
    Case { name: name.into(), world, truth, height: None, uniform }
}

/// Returns a captor under a spot of intensity 1 W/sr that lights all of it.
fn under_spot(name: String, captor: &Mesh, lamp: Point, query: Point, half_angle: f64) -> Case {
    let power = 2.0 * PI * (1.0 - half_angle.cos());
    let light = json!({ "type": "spot", "position": lamp, "direction": [0, 0, -1],
                        "half_angle_deg": half_angle.to_degrees(), "power": power });
    let distance = DVec3::from(lamp).distance(DVec3::from(query));
    let world = World::new().captor("captor", captor).light(light);
    Case { name, world, truth: lamp[2] / distance.powi(3), height: None, uniform: false }
}

fn cases() -> Vec<Case> {
    let square = Mesh::square([0.0; 3], UP, 1.0);
    let beam =
        |width: f64, length: f64| Mesh::rectangle([0.0; 3], [length, 0.0, 0.0], [0.0, width, 0.0]);
    let strip = beam(0.02, 1.0);
    let short = Mesh::rectangle([0.0, 0.1, 0.0], [0.1, 0.0, 0.0], [0.0, 0.4, 0.0]);
    let angle = beam(0.1, 1.0).and(short);
    let small = Mesh::disc([0.0; 3], UP, 0.005);
    let mut all = vec![
        under_sheet("square, uniform", &square, square.clone(), 1.0, true),
        under_sheet("strip 1 x 0.02, uniform", &strip, strip.clone(), 50.0, true),
        under_sheet("L of width 0.1, uniform", &angle, angle.clone(), 1.0 / 0.14, true),
        under_sheet("disc of 1 cm, uniform", &small, small.clone(), 1.0 / (PI * 2.5e-5), true),
    ];
    for h in [2.0, 1.0, 0.5, 0.2, 0.1] {
        let cone = (0.7072f64 / h).atan();
        let case = under_spot(format!("lamp at {h} sides"), &square, [0.0, 0.0, h], [0.0; 3], cone);
        all.push(Case { height: Some(h), ..case });
    }
    for edge in [0.1, 0.02] {
        let width = 0.5 + edge;
        let lit = Mesh::rectangle([-edge, -0.5, 0.0], [width, 0.0, 0.0], [0.0, 1.0, 0.0]);
        let name = format!("shadow {edge} sides away");
        all.push(under_sheet(&name, &square, lit, 1.0 / width, false));
    }
    // the centroid of the L is outside it, so the query point is on the edge of the long arm
    let query = [(0.1 * 0.5 + 0.04 * 0.05) / 0.14, 0.1, 0.0];
    let lamp = [query[0], 0.4, 0.3];
    all.push(under_spot("L of width 0.1, lamp aside".into(), &angle, lamp, query, 1.4));
    all
}

/// A loaded scene, and the point at which its captor is queried.
struct Run {
    scene: LoadedScene,
    query: Vec3,
}

impl Run {
    fn new(files: &TestScene) -> Self {
        let scene = phylux::load(&files.path("scene.json")).unwrap_or_else(|e| panic!("{e}"));
        let captor = &scene.scene.captors()[0];
        let center = (captor.center - scene.scene.center()).as_vec3();
        let triangles = scene.scene.triangles_of(captor);
        let near = triangles.iter().map(|t| t.nearest_point(center));
        let distance = |p: &Vec3| p.distance_squared(center);
        let query = near.min_by(|p, q| distance(p).total_cmp(&distance(q))).expect("a triangle");
        Self { query, scene }
    }

    fn simulate(&self, photons: u64, seed: u64) -> Simulation<'_> {
        let settings =
            Settings { photons: PhotonCount::new(photons).ok(), seed, ..Settings::default() };
        let control = Control::default();
        let done = phylux::simulate(&self.scene.scene, &settings, &control);
        done.unwrap_or_else(|e| panic!("{e}"))
    }

    fn triangles(&self) -> Cow<'_, [Triangle]> {
        self.scene.scene.triangles_of(&self.scene.scene.captors()[0])
    }

    /// Returns, for each kernel, the sum of the weights of the photons nearer than the k-th,
    /// divided by the integral of the kernel over the part of the captor within the distance of the
    /// k-th (1/m2). The integral treats a kernel as a stack of rings.
    fn densities(&self, nearest: &[Neighbour], k: usize) -> [f64; KERNELS.len()] {
        const RINGS: usize = 64;
        let r2 = nearest[k - 1].distance2;
        let area_within = |ring: usize| {
            let radius = (r2 * ring as f32 / RINGS as f32).sqrt();
            let area = |t: &Triangle| f64::from(t.area_in_ball(self.query, radius));
            self.triangles().iter().map(area).sum::<f64>()
        };
        let areas: Vec<f64> = (0..=RINGS).map(area_within).collect();
        KERNELS.map(|(_, kernel)| {
            let ring =
                |i: usize| kernel((i as f64 + 0.5) / RINGS as f64) * (areas[i + 1] - areas[i]);
            let whole: f64 = (0..RINGS).map(ring).sum();
            let weight = |near: &Neighbour| kernel(f64::from(near.distance2) / f64::from(r2));
            nearest[..k - 1].iter().map(weight).sum::<f64>() / whole
        })
    }
}

/// Relative errors of one estimate over the seeds.
#[derive(Clone, Default)]
struct Errors(Vec<f64>);

impl Errors {
    fn bias(&self) -> f64 {
        self.0.iter().sum::<f64>() / self.0.len() as f64
    }

    fn spread(&self) -> f64 {
        let bias = self.bias();
        let squares: f64 = self.0.iter().map(|e| (e - bias).powi(2)).sum();
        (squares / (self.0.len() as f64 - 1.0)).sqrt()
    }

    /// Returns the standard error of the bias.
    fn of_bias(&self) -> f64 {
        self.spread() / (self.0.len() as f64).sqrt()
    }

    fn rms(&self) -> f64 {
        (self.0.iter().map(|e| e * e).sum::<f64>() / self.0.len() as f64).sqrt()
    }
}

/// What all seeds of a case with a given number of arrivals found.
struct Cell<'a> {
    case: &'a Case,
    arrivals: f64,
    /// For each k: the errors with each kernel, and the mean squared radius.
    by_k: BTreeMap<usize, ([Errors; KERNELS.len()], f64)>,
    /// Errors of the program's own estimate, with the k that it chose.
    chosen: Errors,
    k: f64,
    /// Errors of the mean irradiance over the captor.
    whole: Errors,
}

impl<'a> Cell<'a> {
    fn new(case: &'a Case, run: &Run, photons: u64, arrivals: f64) -> Self {
        let count = seeds(arrivals);
        let none = Errors::default;
        let mut cell =
            Cell { case, arrivals, by_k: BTreeMap::new(), chosen: none(), k: 0.0, whole: none() };
        for seed in 1..=count {
            let simulation = run.simulate(photons, seed);
            let result = RunResult::new(&simulation);
            let face = &result.captors[0].front;
            let own = face.knn.as_ref().and_then(|knn| knn.as_ref()).expect("photons");
            let map = simulation.map().expect("a map");
            let nearest = map.nearest(0, run.query, KS[KS.len() - 1]);
            let error = |irradiance: f64| irradiance / case.truth - 1.0;
            cell.whole.0.push(error(face.irradiance[0]));
            cell.chosen.0.push(error(own.irradiance[0]));
            cell.k += own.k as f64 / count as f64;
            // all photons carry the same power
            let power = f64::from(map.power(0)[0]) / map.histories as f64;
            for k in KS.into_iter().filter(|k| *k <= nearest.len()) {
                let (errors, r2) = cell.by_k.entry(k).or_default();
                for (errors, density) in errors.iter_mut().zip(run.densities(&nearest, k)) {
                    errors.0.push(error(density * power));
                }
                *r2 += f64::from(nearest[k - 1].distance2) / count as f64;
            }
            if own.k < nearest.len() {
                let same = run.densities(&nearest, own.k)[0] * power / own.irradiance[0] - 1.0;
                assert!(same.abs() < 1e-4, "{}: the program is off by {same}", case.name);
            }
        }
        // drops each k for which some seeds had too few photons
        cell.by_k.retain(|_, (errors, _)| errors[0].0.len() == count as usize);
        cell
    }

    fn print(&self) {
        let row = |what: String, errors: &Errors| {
            print!(
                "{:>22} {:>+8.2} ± {:<5.2} {:>7.2} {:>7.2}",
                what,
                100.0 * errors.bias(),
                100.0 * errors.of_bias(),
                100.0 * errors.spread(),
                100.0 * errors.rms()
            );
        };
        println!(
            "\n{}, {:.0e} arrivals, {} seeds, %",
            self.case.name,
            self.arrivals,
            self.whole.0.len()
        );
        println!("{:>22} {:>16} {:>7} {:>7}   rms of other kernels", "k", "bias", "spread", "rms");
        for (k, (errors, _)) in &self.by_k {
            row(k.to_string(), &errors[0]);
            let others = errors[1..].iter().map(|e| format!("{:.2}", 100.0 * e.rms()));
            println!("   {}", others.collect::<Vec<_>>().join("  "));
        }
        row(format!("default: {:.0}", self.k), &self.chosen);
        println!();
        row("mean of the captor".into(), &self.whole);
        println!();
    }

    /// Returns the lowest RMS error of a kernel over all k.
    fn best(&self, kernel: usize) -> f64 {
        self.by_k.values().map(|(errors, _)| errors[kernel].rms()).fold(f64::INFINITY, f64::min)
    }

    /// Returns the RMS error with this k or, where there are fewer photons, that of the mean over
    /// the captor.
    fn rms(&self, k: usize) -> f64 {
        self.by_k.get(&k).map_or_else(|| self.whole.rms(), |(errors, _)| errors[0].rms())
    }
}

/// Returns the second moment of a kernel over that of a uniform disc, and the variance of an
/// estimate with it over that with the constant kernel.
fn moments(kernel: Kernel) -> [f64; 2] {
    let mean = |f: &dyn Fn(f64) -> f64| crate::exact::integral(0.0, 1.0, 2_000, f);
    let whole = mean(&kernel);
    [2.0 * mean(&|u| u * kernel(u)) / whole, mean(&|u| kernel(u).powi(2)) / (whole * whole)]
}

fn geometric_mean(ratios: &[f64]) -> f64 {
    (ratios.iter().map(|ratio| ratio.ln()).sum::<f64>() / ratios.len() as f64).exp()
}

/// In uniform light the estimate has no bias with any shape, k or kernel, and its relative spread
/// is sqrt(c / (k - 2)), where c depends on the kernel. Under a lamp at height h the bias of a disc
/// of radius r is -3 m r^2 / (4 h^2), to second order, where m is the kernel's second moment. In
/// light that varies, the error with the default k is nearer to that of the best k than the error
/// with any fixed k is, and no kernel at its best k has an error that is lower than the constant
/// kernel's by more than a tenth.
///
/// Seeds 1 to 100 (60 with 1e5 arrivals, 10 with 1e6); standard errors as printed. Some 900
/// comparisons of the bias within 6 standard errors (Student's t: odds of a false alarm 3e-8 each
/// with 99 degrees of freedom; 2e-4 each with 9, for 200 comparisons, which are not independent),
/// and 100 of the spread within 5 standard errors of it.
#[test]
#[ignore = "takes minutes: .ci/nightly runs it"]
fn nightly_bias_and_spread_against_k() {
    let cases = cases();
    let mut cells = Vec::new();
    for case in &cases {
        let run = Run::new(&case.world.write());
        let simulation = run.simulate(100_000, 1_000);
        let trial = simulation.map().expect("a map");
        let share = trial.count(0) as f64 / trial.histories as f64;
        let most = if case.height.is_some() { ARRIVALS.len() } else { ARRIVALS.len() - 1 };
        for arrivals in &ARRIVALS[..most] {
            let cell = Cell::new(case, &run, (arrivals / share).round() as u64, *arrivals);
            cell.print();
            cells.push(cell);
        }
    }
    theory_holds(&cells);
    cells.retain(|cell| !cell.case.uniform);
    default_k_is_near_the_best(&cells);
    kernels_gain_little(&cells);
}

fn theory_holds(cells: &[Cell]) {
    let (mut wrong, mut compared, mut worst) = (Vec::new(), 0, 0f64);
    let all =
        cells.iter().flat_map(|cell| cell.by_k.iter().map(move |(k, found)| (cell, k, found)));
    for (cell, &k, (errors, r2)) in all {
        for ((name, kernel), errors) in KERNELS.iter().zip(errors) {
            let [moment, noise] = moments(*kernel);
            let what = format!("{}, {:.0e}, {k}, {name}", cell.case.name, cell.arrivals);
            let (bias, error) = (errors.bias(), errors.of_bias());
            let within = |expected: f64, allowed: f64| (bias - expected).abs() <= allowed;
            let holds = match cell.case.height {
                Some(h) => {
                    let due = -0.75 * moment * r2 / (h * h) * (k as f64 - 1.0) / k as f64;
                    // not compared where third-order terms matter or the disc reaches beyond the
                    // square
                    let far = due < -0.1 || r2.sqrt() > 0.5;
                    far || within(due, 6.0 * error + 0.2 * due.abs())
                }
                None => !cell.case.uniform || within(0.0, 6.0 * error),
            };
            if !holds {
                wrong.push(format!("{what}: bias {bias} +- {error}"));
            }
            if cell.case.uniform {
                compared += 1;
                worst = worst.max((bias / error).abs());
            }
            // here the ball lies inside the captor and holds few of its photons
            let few = k as f64 / cell.arrivals < 0.1;
            if cell.case.name.starts_with("square") && few && (50..=1_000).contains(&k) {
                let ratio = errors.spread() / (noise / (k as f64 - 2.0)).sqrt();
                let allowed = 0.05 + 5.0 * (0.5 / (errors.0.len() as f64 - 1.0)).sqrt();
                let holds = (ratio - 1.0).abs() < allowed;
                if !holds {
                    wrong.push(format!("{what}: spread {ratio} times the expected"));
                }
            }
        }
    }
    println!("\nuniform light: largest of {compared} biases {worst:.1} standard errors");
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

fn default_k_is_near_the_best(cells: &[Cell]) {
    println!("\nlight that varies: rms error over that of the best k, geometric mean and most");
    let over_best = |what: &str, rms: &dyn Fn(&Cell) -> f64| {
        let ratio = |cell: &Cell| rms(cell) / cell.best(0).min(cell.whole.rms());
        let ratios: Vec<f64> = cells.iter().map(ratio).collect();
        let (mean, most) = (geometric_mean(&ratios), ratios.into_iter().fold(0.0, f64::max));
        println!("{what:>8} {mean:>6.2} {most:>6.2}");
        (mean, most)
    };
    let (mean, most) = over_best("default", &|cell| cell.chosen.rms());
    assert!(mean < 1.5 && most < 6.0, "{mean} {most}");
    for k in KS {
        let fixed = over_best(&k.to_string(), &|cell| cell.rms(k)).0;
        assert!(mean < fixed, "{mean}, with k = {k} {fixed}");
    }
}

fn kernels_gain_little(cells: &[Cell]) {
    println!("\nbest error of a kernel over that of the constant one: geometric mean");
    for (i, (name, kernel)) in KERNELS.into_iter().enumerate() {
        let few = cells.iter().filter(|cell| cell.arrivals < 5e5);
        let gain = geometric_mean(&few.map(|c| c.best(i) / c.best(0)).collect::<Vec<_>>());
        let [moment, noise] = moments(kernel);
        let (theory, root) = ((moment * noise).cbrt(), noise.sqrt());
        println!(
            "{name:>14} {gain:.3}, in theory {theory:.3}; \
             noise at the same k x {root:.3}, bias x {moment:.3}"
        );
        assert!(gain > 0.9, "{name}: {gain}");
    }
}
