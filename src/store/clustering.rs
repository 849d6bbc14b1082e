//! The state of a clustering on its way: a group for each pass, so that it goes on where it was stopped, and groups of
//! partial sums, so that many processes can share a pass.
//!
//! | array | shape | type |
//! | --- | --- | --- |
//! | `pass_<p>/centres` | [cluster, view, light] | u8, the L* codes that pass p assigns to |
//! | `pass_<p>/index` | [slot] | u16, the assignment that the pass before made, of the texels that it went over; a slot is a texel's place in the order of reading |
//! | `pass_<p>/part_<n>/index` | [slot] | u16, what pass p assigned in part n |
//! | `pass_<p>/part_<n>/texels`, `counts` | [cluster], [cluster, count] | u32, what centres follow from |
//!
//! The attributes of a group are written last: a group without them is not done.

use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::disk::lock::Lock;
use crate::error::{Error, Result};
use crate::method::cluster::centre::CentreRule;
use crate::method::cluster::lloyd::Pass;
use crate::method::cluster::nearest::{Farthest, Near, nearer};
use crate::method::cluster::search::Trial;
use crate::method::cluster::tally::Tally;
use crate::run::Context;
use crate::zarr::{Layout, Store};

/// The attribute `kind` of a clustering on its way.
pub const KIND: &str = "clustering";

/// The passes of a clustering.
pub(crate) struct Passes {
    store: Store,
    _lock: Lock,
}

/// What a pass begins with.
#[derive(Clone, Debug)]
pub struct State {
    /// Centres [cluster, view, light].
    pub centres: Vec<u8>,
    /// The assignment that the pass before made, by slot, of the texels that it went over; none before the first pass.
    pub index: Vec<u16>,
    /// How it came here.
    pub history: History,
}

/// How a clustering went before a pass.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct History {
    /// Passes over all texels.
    pub passes: Vec<Pass>,
    /// Passes over mini-batches before these.
    #[serde(default)]
    pub batches: Vec<BatchPass>,
    /// How many of the first blocks the pass goes over, where it is a mini-batch; all where there is none.
    #[serde(default)]
    pub batch: Option<usize>,
    /// Texels of the initial clustering.
    pub sample_texels: usize,
    /// Passes over these.
    pub sample_passes: Vec<Pass>,
    /// What numbers of clusters left of these, where one was searched.
    pub trials: Vec<Trial>,
    /// What numbers of clusters left of all texels that were too few.
    pub attempts: Vec<Trial>,
}

/// One pass over a mini-batch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BatchPass {
    /// Texels of the mini-batch.
    pub texels: usize,
    /// What it found.
    #[serde(flatten)]
    pub pass: Pass,
}

impl History {
    /// Slots that the pass before went over.
    fn slots_before(&self, all: usize) -> usize {
        if self.passes.is_empty() { self.batches.last().map_or(0, |batch| batch.texels) } else { all }
    }
}

/// What a pass found in a part of the texels that it goes over, or in all of them.
#[derive(Clone, Debug)]
pub struct Found {
    /// The assignment, by slot.
    pub index: Vec<u16>,
    /// What the centres follow from.
    pub tally: Tally,
    /// The texel nearest to each centre.
    pub nearest: Vec<Near>,
    /// The texels farthest from theirs.
    pub farthest: Farthest,
    /// Sum of the distances of each cluster's texels.
    pub distances: Vec<u64>,
    /// Texels that changed their cluster.
    pub moved: usize,
}

impl Found {
    /// Sum of the distances.
    pub fn objective(&self) -> u64 {
        // What lies on disk may be anything.
        self.distances.iter().fold(0, |sum, &distance| sum.saturating_add(distance))
    }

    /// Together with what was found in the part that follows.
    #[must_use]
    pub fn with(mut self, next: Self) -> Self {
        self.index.extend(next.index);
        self.tally.merge(&next.tally);
        self.nearest = nearer(self.nearest, next.nearest);
        self.farthest.add(next.farthest.texels().iter().copied());
        let sums = self.distances.iter_mut().zip(next.distances);
        sums.for_each(|(sum, more)| *sum = sum.saturating_add(more));
        self.moved += next.moved;
        self
    }
}

/// What the attributes of a part hold of a [`Found`].
#[derive(Serialize, Deserialize)]
struct PartAttributes {
    nearest: Vec<Near>,
    farthest: Vec<Near>,
    distances: Vec<u64>,
    moved: usize,
}

fn pass_name(pass: usize) -> String {
    format!("pass_{pass:04}")
}

fn part_name(pass: usize, part: usize) -> String {
    format!("{}/part_{part:05}", pass_name(pass))
}

impl Passes {
    /// Begins the passes of a recipe at `path`, or goes on with them.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Recipe`] where another recipe's lie there.
    pub(crate) fn create(path: &Path, recipe: &Value, context: &Context<'_>) -> Result<Self> {
        let mut store = Store::at(path);
        let lock = store.begin_by_recipe(KIND, recipe, json!({}), context)?;
        Ok(Self { store, _lock: lock })
    }

    /// Removes all of it, as far as no other process is writing there: what is left is never read again, and
    /// removed by whoever comes next.
    pub(crate) fn remove(path: &Path) {
        let _ = std::fs::remove_dir_all(path);
    }

    /// The latest pass that can begin.
    pub(crate) fn latest(&self) -> Result<Option<usize>> {
        let entries = match std::fs::read_dir(self.store.path()) {
            Ok(entries) => entries,
            Err(error) => return Err(Error::io("list", self.store.path(), error)),
        };
        let number = |name: &str| name.strip_prefix("pass_")?.parse::<usize>().ok();
        let mut passes: Vec<usize> =
            entries.flatten().filter_map(|entry| number(&entry.file_name().to_string_lossy())).collect();
        passes.sort_unstable();
        for &pass in passes.iter().rev() {
            if self.attributes::<History>(&pass_name(pass))?.is_some() {
                return Ok(Some(pass));
            }
        }
        Ok(None)
    }

    /// What a pass begins with; `brdf` are its views and lights, `slots` those of all texels.
    pub(crate) fn state(&self, pass: usize, brdf: [usize; 2], slots: usize) -> Result<State> {
        let name = pass_name(pass);
        let history = self.attributes(&name)?.ok_or_else(|| {
            Error::missing(format!("{}: {name} is not there yet", self.store.path().display()))
                .hint("sum up the pass before it first: --step reduce")
        })?;
        let (_, centres) = self.store.read::<u8>(&format!("{name}/centres"), &[0, brdf[0], brdf[1]])?;
        let clusters = centres.len() / (brdf[0] * brdf[1]);
        let history: History = history;
        let before = history.slots_before(slots);
        let index = if before == 0 {
            Vec::new()
        } else {
            self.store.read::<u16>(&format!("{name}/index"), &[before])?.1
        };
        if before > slots {
            return Err(self.damaged(&name, "a mini-batch of more texels than there are"));
        }
        if index.iter().any(|&cluster| usize::from(cluster) >= clusters) {
            return Err(self.damaged(&name, "a cluster beyond the last"));
        }
        Ok(State { centres, index, history })
    }

    /// Writes what a pass begins with, and removes what the passes before it left.
    pub(crate) fn write_state(&self, pass: usize, brdf: [usize; 2], state: &State) -> Result<()> {
        let name = pass_name(pass);
        let shape = [state.centres.len() / (brdf[0] * brdf[1]), brdf[0], brdf[1]];
        let layout = Layout::small::<u8>(&["cluster", "view", "light"], &shape);
        self.store.write(&format!("{name}/centres"), &layout, &state.centres)?;
        if !state.index.is_empty() {
            let layout = Layout::small::<u16>(&["slot"], &[state.index.len()]);
            self.store.write(&format!("{name}/index"), &layout, &state.index)?;
        }
        self.write_attributes(&name, &state.history)?;
        for before in 0..pass {
            Self::remove(&self.store.path().join(pass_name(before)));
        }
        Ok(())
    }

    /// Whether a part of a pass is done.
    pub(crate) fn has_part(&self, pass: usize, part: usize) -> Result<bool> {
        Ok(self.attributes::<PartAttributes>(&part_name(pass, part))?.is_some())
    }

    /// What a pass found in a part of `slots` slots.
    pub(crate) fn part(
        &self,
        pass: usize,
        part: usize,
        slots: usize,
        rule: CentreRule,
        stride: usize,
    ) -> Result<Found> {
        let name = part_name(pass, part);
        let PartAttributes { nearest, farthest, distances, moved } =
            self.attributes(&name)?.ok_or_else(|| {
                Error::missing(format!("{}: {name} is not there yet", self.store.path().display()))
                    .hint("run the shards that are missing: --step assign")
            })?;
        let (_, index) = self.store.read::<u16>(&format!("{name}/index"), &[slots])?;
        let (_, texels) = self.store.read::<u32>(&format!("{name}/texels"), &[nearest.len()])?;
        let (_, counts) = self.store.read::<u32>(&format!("{name}/counts"), &[nearest.len(), 0])?;
        let whole = texels.iter().map(|&texels| u64::from(texels)).sum::<u64>() == slots as u64
            && distances.len() == nearest.len()
            && index.iter().all(|&cluster| usize::from(cluster) < nearest.len());
        let tally = Tally::from_parts(rule, stride, texels, counts).filter(|_| whole);
        let tally = tally.ok_or_else(|| self.damaged(&name, "its arrays do not fit together"))?;
        Ok(Found { index, tally, nearest, farthest: Farthest::of(farthest), distances, moved })
    }

    /// Writes what a pass found in a part.
    pub(crate) fn write_part(&self, pass: usize, part: usize, found: &Found) -> Result<()> {
        let name = part_name(pass, part);
        let (texels, counts) = found.tally.parts();
        let layout = Layout::small::<u16>(&["slot"], &[found.index.len()]);
        self.store.write(&format!("{name}/index"), &layout, &found.index)?;
        let layout = Layout::small::<u32>(&["cluster"], &[texels.len()]);
        self.store.write(&format!("{name}/texels"), &layout, texels)?;
        let layout =
            Layout::small::<u32>(&["cluster", "count"], &[texels.len(), counts.len() / texels.len()]);
        self.store.write(&format!("{name}/counts"), &layout, counts)?;
        let attributes = PartAttributes {
            nearest: found.nearest.clone(),
            farthest: found.farthest.texels().to_vec(),
            distances: found.distances.clone(),
            moved: found.moved,
        };
        self.write_attributes(&name, &attributes)
    }

    fn write_attributes(&self, group: &str, attributes: &impl Serialize) -> Result<()> {
        match serde_json::to_value(attributes) {
            Ok(Value::Object(attributes)) => self.store.write_group(group, attributes),
            _ => Err(Error::internal("attributes that are no JSON object")),
        }
    }

    /// The attributes of a group; `None` where it is not done.
    fn attributes<T: DeserializeOwned>(&self, group: &str) -> Result<Option<T>> {
        let Some(found) = self.store.group(group)? else { return Ok(None) };
        serde_json::from_value(Value::Object(found))
            .map(Some)
            .map_err(|error| self.damaged(group, &error.to_string()))
    }

    fn damaged(&self, group: &str, what: &str) -> Error {
        Error::input(format!("{}: {group}: {what}", self.store.path().display()))
            .hint("delete this folder and run the command that made it again")
    }
}
