//! Benchmarks. How to run them and what each tells: benches/README.md.

mod events;
mod map;
mod rays;
mod runs;
mod scenes;

fn main() {
    divan::main();
}
