//! An archive in one file that computes or cuts out its images on demand.

use std::ops::Range;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use btfkit_formats::npy::{self, Beside};
use btfkit_formats::utia::Order;
use btfkit_formats::{
    ContainerKind, Contents, Direction, ErrorKind, Images, Limits, Samples, big, bonn, directions, mif, mlvq,
};

use super::packed::PackedArchive;
use super::{HEAD_BYTES, Options, Source, digest_of, files, read_beside};
use crate::disk::mapped::MappedFile;
use crate::error::{BEGIN_AGAIN, Error, Result};
use crate::run::Context;
use crate::store::measurement::Type;

/// Groups that the lights of a view are read in: enough for some threads, few enough that what a group has
/// in common (a block of factors, say) is worked out seldom.
const GROUPS: usize = 8;

/// What to do where a file does not name its directions: UTIA's have an order of images.
const ORDER_OF_IMAGES: &str = "--order says in which order its images are: ubo81 or uniform";

/// The same of arrays, which have lists beside them.
const LISTS: &str = "write NAME.lights.npy and NAME.views.npy beside it; or, if its directions are the 81 or the 151 that are \
     published, in their order: --order ubo81 or --order bonn151";

/// A container, and the type that its samples are best kept as where that is not their own.
pub(super) struct Recognised {
    pub(super) source: Box<dyn Source>,
    pub(super) samples: Option<Type>,
    /// The options that it has a use for.
    pub(super) uses: &'static [&'static str],
}

impl Recognised {
    fn of(source: impl Source + 'static, uses: &'static [&'static str]) -> Self {
        Self { source: Box::new(source), samples: None, uses }
    }
}

/// Opens a file that is a container by its first bytes; `None` if it is none.
pub(super) fn recognise(path: &Path, options: &Options, limits: &Limits) -> Result<Option<Recognised>> {
    let head = files::read_head(path, HEAD_BYTES)?;
    if head.starts_with(&btfkit_packed::MAGIC) {
        return Ok(Some(Recognised::of(PackedArchive::open(path)?, &[])));
    }
    let Some(kind) = ContainerKind::recognise(&head) else { return Ok(None) };
    let open = match kind {
        ContainerKind::Bonn => open_bonn,
        ContainerKind::Mlvq => open_mlvq,
        ContainerKind::Big => open_big,
        ContainerKind::Mif => open_mif,
        ContainerKind::Npy => open_npy,
        ContainerKind::Hdf5 => open_hdf5,
    };
    open(path, options, limits).map(Some)
}

fn open_bonn(path: &Path, options: &Options, limits: &Limits) -> Result<Recognised> {
    let mut how = bonn::OpenOptions::default();
    how.rows = options.rows;
    let container =
        Container::open(path, |_| None, |bytes| Ok(Box::new(bonn::Archive::open(bytes, &how, limits)?)))?;
    Ok(Recognised::of(container, &["--rows"]))
}

fn open_mlvq(path: &Path, _: &Options, limits: &Limits) -> Result<Recognised> {
    let known = zero_bytes_beside(path)?;
    let place = zero_bytes_place(path);
    let way_out = format!(
        "{} says that; take the line out, or move the file away: a rule then tells the bytes apart",
        place.display()
    );
    let open = |bytes: &[u8]| -> btfkit_formats::Result<Box<dyn Images>> {
        Ok(Box::new(mlvq::Database::open(bytes, &known, limits)?))
    };
    let container = Container::open(path, |error| asks(error).then_some(way_out.as_str()), open)?;
    let source = Container { beside: vec![place], ..container };
    Ok(Recognised { samples: Some(Type::U8), ..Recognised::of(source, &[]) })
}

fn open_big(path: &Path, options: &Options, limits: &Limits) -> Result<Recognised> {
    let mut how = big::Options::default();
    how.order = order(options)?;
    let open = |bytes: &[u8]| -> btfkit_formats::Result<Box<dyn Images>> {
        Ok(Box::new(big::Big::open(bytes, &how, limits)?))
    };
    Ok(Recognised::of(Container::open(path, |error| way_out_of(options, error), open)?, &["--order"]))
}

fn open_mif(path: &Path, options: &Options, limits: &Limits) -> Result<Recognised> {
    let mut how = mif::Options::default();
    how.order = order(options)?;
    let open = |bytes: &[u8]| -> btfkit_formats::Result<Box<dyn Images>> {
        Ok(Box::new(mif::Mif::open(bytes, &how, limits)?))
    };
    Ok(Recognised::of(Container::open(path, |error| way_out_of(options, error), open)?, &["--order"]))
}

/// Whether an error is about what else must be said of a file.
fn asks(error: &btfkit_formats::Error) -> bool {
    error.kind() == ErrorKind::Argument
}

/// What to do about the directions of a BIG or MIF file, where an error is about the order of its images.
fn way_out_of(options: &Options, error: &btfkit_formats::Error) -> Option<&'static str> {
    let about_order =
        ["order of images", "for the order"].iter().any(|words| error.to_string().contains(words));
    about_order.then_some(match options.order {
        Some(_) => "leave out --order, or name another one: ubo81 or uniform",
        None => ORDER_OF_IMAGES,
    })
}

fn open_npy(path: &Path, options: &Options, limits: &Limits) -> Result<Recognised> {
    let beside = directions_beside(path, options, limits)?;
    let has_lists =
        ["views", "lights"].into_iter().all(|kind| path.with_extension(format!("{kind}.npy")).is_file());
    let open = |bytes: &[u8]| -> btfkit_formats::Result<Box<dyn Images>> {
        Ok(Box::new(npy::Archive::open(bytes, beside, limits)?))
    };
    Ok(Recognised::of(
        Container::open(path, |error| asks(error).then_some(LISTS), open)?,
        if has_lists { &[] } else { &["--order"] },
    ))
}

#[cfg(feature = "hdf5")]
fn open_hdf5(path: &Path, _: &Options, limits: &Limits) -> Result<Recognised> {
    Ok(Recognised::of(super::hdf5::source::Hdf5::open(path, limits)?, &[]))
}

#[cfg(not(feature = "hdf5"))]
fn open_hdf5(path: &Path, _: &Options, _: &Limits) -> Result<Recognised> {
    Err(crate::archive::hdf5::not_built_in(path))
}

/// The order of images that the user names for a BIG or MIF file.
fn order(options: &Options) -> Result<Order> {
    match options.order.as_deref() {
        None => Ok(Order::Stated),
        Some("ubo81") => Ok(Order::Ubo81),
        Some("uniform") => Ok(Order::Uniform),
        Some(name) => Err(Error::new(
            crate::ErrorKind::Usage,
            format!("got the order {name:?}, expected ubo81 or uniform"),
        )),
    }
}

/// Where a database's list of ambiguous bytes lies, if there is one.
fn zero_bytes_place(path: &Path) -> PathBuf {
    path.with_file_name("zero_bytes.txt")
}

/// What is known of the ambiguous bytes of a database, from `zero_bytes.txt` in its folder.
fn zero_bytes_beside(path: &Path) -> Result<mlvq::ZeroBytes> {
    let file = zero_bytes_place(path);
    if !file.is_file() {
        return Ok(mlvq::ZeroBytes::default());
    }
    let bytes = read_beside(&file)?;
    let text =
        btfkit_formats::text::utf8(&bytes).map_err(|error| Error::from(error).context(file.display()))?;
    mlvq::ZeroBytes::parse(&String::from_utf8_lossy(&text)).map_err(|error| {
        Error::from(error)
            .context(file.display())
            .hint("mend the line, or move the file away: a rule then tells the bytes apart")
    })
}

/// The directions of `NAME.npy`: `NAME.views.npy` and `NAME.lights.npy`, or a published list that the user names.
fn directions_beside(path: &Path, options: &Options, limits: &Limits) -> Result<Beside> {
    let list = |kind: &str| -> Result<Option<Vec<Direction>>> {
        let file = path.with_extension(format!("{kind}.npy"));
        if !file.is_file() {
            return Ok(None);
        }
        let found = npy::directions(&read_beside(&file)?, limits);
        found.map(Some).map_err(|error| Error::from(error).context(file.display()))
    };
    let names = path.with_extension("channels.txt");
    let channels = match names.is_file() {
        true => {
            let found = npy::channels(&read_beside(&names)?);
            Some(found.map_err(|error| Error::from(error).context(names.display()))?)
        }
        false => None,
    };
    let mut beside = Beside { views: list("views")?, lights: list("lights")?, channels };
    if let Some(name) = &options.order {
        let published = directions::published(name).ok_or_else(|| {
            Error::new(crate::ErrorKind::Usage, format!("got the list {name:?}, expected ubo81 or bonn151"))
        })?;
        let published: Vec<Direction> =
            published.into_iter().map(btfkit_formats::Angles::direction).collect();
        beside.lights.get_or_insert_with(|| published.clone());
        beside.views.get_or_insert(published);
    }
    Ok(beside)
}

/// A container, mapped.
struct Container {
    path: PathBuf,
    file: MappedFile,
    images: Box<dyn Images>,
    /// What the file was when it was opened.
    opened: State,
    /// Files beside it that its samples depend on, those that are there.
    beside: Vec<PathBuf>,
}

/// By what a file is told from another one, or from itself after it was written to: device, number, size, times of the
/// last change of its bytes and of anything else.
type State = [i64; 7];

fn state_of(path: &Path) -> Result<State> {
    let data = std::fs::metadata(path).map_err(|error| Error::io("read", path, error))?;
    let [device, number, size] = [data.dev(), data.ino(), data.size()].map(|value| value as i64);
    Ok([device, number, size, data.mtime(), data.mtime_nsec(), data.ctime(), data.ctime_nsec()])
}

impl Container {
    /// Maps a file and opens it by `open`; `way_out` is what to do about an error, if more must be said of the file, or
    /// less.
    fn open<'a>(
        path: &Path,
        way_out: impl Fn(&btfkit_formats::Error) -> Option<&'a str>,
        open: impl FnOnce(&[u8]) -> btfkit_formats::Result<Box<dyn Images>>,
    ) -> Result<Self> {
        files::regular(path)?;
        let opened = state_of(path)?;
        let file = MappedFile::open(path).map_err(|error| Error::io("read", path, error))?;
        let images = open(file.as_ref()).map_err(|error| {
            let way_out = way_out(&error);
            let error = Error::from(error).context(path.display());
            match way_out {
                Some(way_out) => error.hint(way_out),
                None => error,
            }
        })?;
        Ok(Self { path: path.to_owned(), file, images, opened, beside: Vec::new() })
    }

    /// Checks that what was read is of the file that was opened: images of two would make one measurement.
    ///
    /// # Errors
    /// Where it was written to or replaced meanwhile.
    fn expect_unchanged(&self) -> Result<()> {
        if state_of(&self.path)? == self.opened {
            return Ok(());
        }
        Err(Error::input(format!("{}: the file was changed while it was read", self.path.display()))
            .hint(BEGIN_AGAIN))
    }
}

impl Source for Container {
    fn path(&self) -> &Path {
        &self.path
    }

    fn contents(&self) -> &Contents {
        self.images.contents()
    }

    fn lights_at_once(&self) -> usize {
        self.contents().lights.len().div_ceil(GROUPS)
    }

    fn read_images(&self, view: usize, lights: Range<usize>) -> Result<Samples> {
        let samples = self.images.read_images(self.file.as_ref(), view, lights);
        // Pages that were read count as resident; the next group maps them again.
        self.file.release(0..self.file.as_ref().len());
        let samples = samples.map_err(|error| Error::from(error).context(self.path.display()))?;
        self.expect_unchanged()?;
        Ok(samples)
    }

    fn check(&self, context: &Context<'_>) -> Result<String> {
        let mut digest = digest_of(&self.path, context)?;
        for beside in self.beside.iter().filter(|beside| beside.is_file()) {
            digest = format!("{digest} {}", digest_of(beside, context)?);
        }
        self.expect_unchanged()?;
        Ok(digest)
    }
}
