use std::path::PathBuf;

use btfkit::run::shard::Shard;
use btfkit::stage::partial::Sharing;
use clap::Args;

/// Options of a command whose result is a few figures, and whose work many jobs share.
#[derive(Args)]
pub(super) struct SharingArgs {
    /// Keep what single parts of the work found in this folder, so that many jobs share the work and a stopped one goes on
    #[arg(long, value_name = "DIR")]
    partial: Option<PathBuf>,
    /// Do only part K of N of the work, K from 0, in any order; `env` takes both from the variables of Slurm or MPI
    #[arg(long, requires = "partial", value_name = "K/N|env", default_value = "0/1")]
    shard: Shard,
    /// Do nothing of the work, only put together what is in the folder
    #[arg(long, requires = "partial", conflicts_with = "shard")]
    reduce: bool,
}

impl SharingArgs {
    /// Where results are kept, and what is done; none where the work is not shared.
    pub(super) fn sharing(&self) -> Option<Sharing> {
        let folder = self.partial.clone()?;
        Some(Sharing { folder, shard: (!self.reduce).then_some(self.shard) })
    }

    /// Whether the same command goes on where it was stopped.
    pub(super) fn goes_on(&self) -> bool {
        self.partial.is_some()
    }
}
