//! The scene as it stands before a photon flies: the surfaces and what they do with light
//! (`material`), the lights (`light`, and sun and sky in [`daylight`]), the captors
//! (`captor`), the camera (`camera`), and the validated [`world::Scene`], which arranges all of
//! them for the tracing of rays (`bvh`), where it repeats in a `lattice`, and where copies share
//! their triangles as `instances`. `patches` and `tiles` divide surfaces into pieces:
//! for photon maps on surfaces, and for display. `stand` holds what is summed of plants as a whole,
//! and `parameter` the factors on light on which a run says how its results depend.
//!
//! Read `material` and `light` for the physics, then `world`. Code that follows light further than
//! one interaction, or that reads a file, may not enter.

pub mod bvh;
pub mod camera;
pub mod captor;
pub mod daylight;
pub mod instances;
pub mod lattice;
pub mod light;
pub mod material;
pub mod parameter;
pub mod patches;
pub mod stand;
pub mod tiles;
pub mod world;

pub use bvh::Kernel;
pub use camera::{Camera, View};
pub use captor::{CHANNELS, Captor, CaptorKind, Channel, Response, Sensor};
pub use lattice::{Lattice, Period};
pub use light::{
    Area, Cone, Emission, EmittedRadiance, EmitterHit, Intensity, IntensityTable, IsotropicLine,
    Lamp, Light, LightHit, LightSample, LightSource, Luminaire, LuminaireArea, Start, Strata,
    Toward, Tube, Unplaced,
};
pub use material::{
    Basis, Bsdf, BsdfFaces, BsdfSample, Cover, CoverRow, Dielectric, FaceValues, Interaction,
    Lambert, Leaf, LeafFace, LeafSpectra, LobeKind, Material, Mirror, PairValues, Pane, Phong,
    PhongFractions, Prospect, Scatterer, Table, Transport,
};
pub use parameter::{Factor, Parameter, ParameterIndex, Parameters, Sent};
pub use patches::Patches;
pub use world::{
    Arrived, Asked, Band, BandRatio, BandSum, CaptorPart, CopyPart, Crossing, LightPart,
    NamedMaterial, Scene, SceneParts, SharedCopy, SharedPart, Standing, Surface, SurfaceHit,
    SurfacePart, Triangles,
};
