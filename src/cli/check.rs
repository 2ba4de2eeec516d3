//! `phylux check`

use std::path::Path;

use crate::{error::Result, scene_file};

pub(super) fn check(path: &Path) -> Result<()> {
    let loaded = scene_file::load(path)?;
    super::warn(&loaded.warnings);
    super::print(&format!("{}\n", loaded.scene.name))
}
