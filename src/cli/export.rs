//! `phylux export`: writes a scene and its light for other programs.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::{
    render::range,
    rendered::{self, Source},
};
use phylux_core::{
    error::{Error, Result},
    scene::world::Scene,
};
use phylux_show::{
    export::{Colours, ExportFormat, check_export, write_export},
    following::Following,
};

#[derive(Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    source: Source,
    /// File to write; its ending chooses the form: .vtp, .vtu (all values, for ParaView), .glb
    /// (coloured by one value, for Blender and browsers), .ply (photons)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Quantity that the colours of a .glb show [default: irradiance]
    #[arg(long, value_enum)]
    quantity: Option<Quantity>,
    /// Band, or sum over bands, of a .glb [default: the first sum, or the first band]
    #[arg(long, value_name = "NAME")]
    band: Option<String>,
    /// Values at the first and the last colour of a .glb [default: 0 to the value that 99 % are
    /// below]
    #[arg(long, value_name = "LOW:HIGH", value_parser = range)]
    range: Option<(f64, f64)>,
    /// Colour a .glb by the logarithm of the values
    #[arg(long)]
    log: bool,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Quantity {
    /// Light that arrives at each face
    Irradiance,
    /// Light that surfaces absorb, per area
    Absorbed,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let format = ExportFormat::of(&arguments.output)?;
    let colours = Colours {
        absorbed: arguments.quantity.map(|quantity| quantity == Quantity::Absorbed),
        band: arguments.band.clone(),
        range: arguments.range,
        log: arguments.log,
    };
    colours.check(format)?;
    let photons = format == ExportFormat::Ply;
    if photons && !arguments.source.traces() {
        return Err(Error::input("--no-trace", "a .ply holds photons, and none would be traced")
            .remedy("leave it out"));
    }
    let check = |scene: &Scene| check_export(scene, format, &colours);
    rendered::write(
        &arguments.source,
        &[],
        &arguments.output,
        photons,
        &check,
        &|_| Ok(Following::default()),
        |rendered, writer| write_export(rendered, format, &colours, writer),
    )
}
