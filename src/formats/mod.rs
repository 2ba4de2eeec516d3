//! Bytes to the types above, and back, with all checking of input: scenes ([`scene_file`], [`obj`],
//! [`captor_csv`], [`weather`], [`environment_map`],
//! [`photometry`], [`spectrum_file`]), sweeps, results, the parts of a run, the control of lamps.
//! [`input`] and [`output`] are the only ways to
//! the disk; an error names the file and the place in it.

pub mod calibration_file;
pub mod captor_csv;
pub mod checkpoint_file;
pub mod control_file;
pub mod csv_table;
pub mod csv_text;
pub mod environment_map;
pub mod hours_file;
pub mod input;
pub mod iso8601;
pub mod json;
pub mod measured_csv;
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
pub mod weather;
