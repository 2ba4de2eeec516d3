//! Benchmarks of the library; benches/README.md says how to run them and what each one measures.

mod events;
mod map;
mod rays;
mod runs;
mod scenes;

fn main() {
    divan::main();
}
