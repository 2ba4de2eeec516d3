//! File formats: turns the bytes of files into the types of the modules above and back, and checks
//! all input.
//!
//! The folders and files named after a format hold one format each: scenes (`scene_file`) and the
//! files that a scene names (`mesh_file`, `obj`, `captor_csv`, `instance_csv`, [`weather`], `environment_map`,
//! `photometry`, `scatter_table`, `spectrum_file`, `rad`, pictures of `mask`), sweeps
//! (`sweep_file`), results
//! (`result_file`), tables of how light reaches a captor (`histories_csv`), shards and checkpoints (`work_file`) of runs (`run_work`) and of years
//! (`year_work`), tables
//! of hours (`year_table`), controls of lamps (`control_file`), readings and calibrations
//! (`measured_csv`, `calibration_file`). `json`, `csv_table`, `csv_text`, [`iso8601`] and `xml`
//! serve several of them.
//!
//! Read `input`, `json` and `scene_file` first. Nothing here draws pictures. Every error of
//! input names the file and the place in it. Most reading and writing of files goes through
//! `input` and `output`; `written` knows the files that a command has written into a folder.

#![deny(unsafe_code)]

pub mod calibration_file;
pub mod captor_csv;
pub mod control_file;
pub mod csv_table;
pub mod csv_text;
pub mod environment_map;
pub mod held_file;
pub mod histories_csv;
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
pub mod run_work;
pub mod scatter_table;
pub mod scene_file;
pub mod spectrum_file;
pub mod sweep_file;
pub mod unfinished;
pub mod weather;
pub mod work_file;
pub mod written;
pub mod xml;
pub mod year_table;
pub mod year_work;

pub use control_file::{
    ControlFile, DimFile, LampControl, SeriesFile, StateControl, TrackerControl, Turn, WhenKeys,
};
pub use json::read_arguments;
pub use measured_csv::{MeasuredAt, MeasuredRow, parse as parse_readings};
pub use obj::{Mesh, MeshGroup};
pub use output::{FilesRead, OutputFile};
pub use result_file::{OutputFolder, parse_json, read_json, write_csv, write_json};
pub use scene_file::{
    HourlyLight, HourlyLights, HourlySun, InMemory, LoadedScene, OpenField, SceneBuilder,
    SceneSource, SkyDivision, SpectrumAverage, TableNote, load, load_by_hour, load_from, load_with,
    spec,
};
pub use sweep_file::{Parameter, Run, Sweep};
pub use work_file::TableSettings;
pub use year_table::{Face, YearTable};
