//! Results: the numbers that a run has found, with standard errors.
//!
//! Read `result` first: it makes results from sums, groups them, rescales lamps and warns.
//! `quantity` is the registry of what they say of light, from which tables are made. `flat` holds the
//! same numbers as arrays. `histories` says how light reaches a captor. `compare` compares two
//! results. `year_facts` tells of the tables of a year. `calibration` holds factors on the powers of
//! lamps that were found from readings.
//!
//! Nothing in this crate reads or writes files.

#![deny(unsafe_code)]

pub mod calibration;
pub mod compare;
pub mod flat;
pub mod histories;
pub mod lists;
pub mod quantity;
pub mod result;
pub mod year_facts;

pub use calibration::{
    Calibration, EvenPowers, Lit, Model, ModelErrors, ReadingResult, SlopeIntercept, Varied,
};
pub use compare::{Comparison, Difference};
pub use flat::FlatResult;
pub use histories::{HistoriesBand, HistoriesLine, HistoriesPart, HistoriesResult};
pub use quantity::{Column, Errors, Measure, Per, QUANTITIES, Quantity, When};
pub use result::{
    Absorbed, AbsorbedByFace, Account, BandResult, BudgetResult, ByLight, CanopyResult,
    CaptorResult, DarkResult, Deviations, Electricity, Energy, Extras, FaceResult, Factor,
    FactorErrors, GroupElectricity, GroupResult, InputResult, LampElectricity, LayerResult,
    LightSensitivity, MapResult, NearestResult, OfLights, Own, PerBand, PerKwh, PlaneElectricity,
    Provenance, RatioResult, RatioSensitivity, Ratios, Row, RunResult, RunSettings,
    SensitivityResult, Share, Shares, SumUnit, ToleranceResult, UncertainInput, Uniformity,
    Warning, Whole, WorstResult,
};
pub use year_facts::YearFacts;
