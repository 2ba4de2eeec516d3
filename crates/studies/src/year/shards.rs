//! The shards of a year, which were traced on several machines.

use std::path::{Path, PathBuf};

use crate::join::check_complete;
use phylux_core::{
    error::{Error, Result},
    transport::shard::Shard,
};
use phylux_files::{
    work_file::WorkHead,
    year_work::{YearSettings, YearWork},
};

/// All shards of one year.
pub struct YearShards {
    /// The shards, in order.
    pub files: Vec<YearWork>,
    /// The year that they belong to.
    pub head: WorkHead,
    /// The settings that its light depends on.
    pub settings: YearSettings,
}

impl YearShards {
    /// Opens the files `shards`. Errors: one of them cannot be read or is no shard of a year; they
    /// are of different years; some are missing or given twice.
    pub fn open(shards: &[PathBuf]) -> Result<Self> {
        let files = shards.iter().map(|path| YearWork::shard(path));
        let mut files: Vec<(YearWork, Shard)> = files.collect::<Result<_>>()?;
        let Some((first, shard)) = files.first() else {
            return Err(Error::input("merge", "no files").remedy("name those of all shards"));
        };
        let (head, of) = (first.head.clone(), shard.of());
        let settings = head.settings(first.path())?;
        for (file, shard) in &files {
            file.check(&head)?;
            let problem = match () {
                () if shard.of() != of => "is of another number of shards",
                () if file.head.tables != head.tables => "was traced for other tables",
                () => continue,
            };
            let problem = format!("{problem} than {}", first.path().display());
            return Err(
                Error::input(file.path().display(), problem).remedy("merge the shards of one year")
            );
        }
        files.sort_by_key(|(_, shard)| shard.index());
        let all: Vec<(Shard, &Path)> = files.iter().map(|(f, shard)| (*shard, f.path())).collect();
        check_complete(&all, of)?;
        Ok(Self { files: files.into_iter().map(|(file, _)| file).collect(), head, settings })
    }
}
