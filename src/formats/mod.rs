//! File formats: turns the bytes of files into the types of the modules above and back, and checks
//! all input.
//!
//! The folders and files named after a format hold one format each: scenes ([`scene_file`]) and the
//! files that a scene names ([`mesh_file`], [`obj`], [`captor_csv`], [`instance_csv`], [`weather`], [`environment_map`],
//! [`photometry`], [`scatter_table`], [`spectrum_file`], [`rad`], pictures of [`mask`]), sweeps
//! ([`sweep_file`]), results
//! ([`result_file`]), shards and checkpoints of a run ([`shard_file`], [`checkpoint_file`]), tables
//! of hours ([`hours_file`]), controls of lamps ([`control_file`]), readings and calibrations
//! ([`measured_csv`], [`calibration_file`]). [`json`], [`csv_table`], [`csv_text`] and [`iso8601`]
//! serve several of them.
//!
//! Read [`input`], [`json`] and [`scene_file`] first. Nothing here draws pictures. Every error of
//! input names the file and the place in it. Most reading and writing of files goes through
//! [`input`] and [`output`]; [`written`] knows the files that a command has written into a folder.

pub mod calibration_file;
pub mod captor_csv;
pub mod checkpoint_file;
pub mod control_file;
pub mod csv_table;
pub mod csv_text;
pub mod environment_map;
pub mod hours_file;
pub mod input;
pub mod instance_csv;
pub mod iso8601;
pub mod json;
pub mod mask;
pub mod measured_csv;
pub mod mesh_file;
pub mod obj;
pub mod output;
pub mod photometry;
pub mod rad;
pub mod result_file;
pub mod scatter_table;
pub mod scene_file;
pub mod shard_file;
pub mod spectrum_file;
#[cfg(test)]
pub mod spoil;
pub mod sweep_file;
pub mod unfinished;
pub mod weather;
pub mod written;
