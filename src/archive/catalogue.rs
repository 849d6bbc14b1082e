//! Which file is the image of which directions: by a table, a light list, or the names themselves.

use std::path::Path;

use btfkit_formats::named::{self, Pattern};
use btfkit_formats::{
    Angles, Assumption, Catalogue, CatalogueErrors, Doubt, Limits, Pair, Without, rti, table, ubo2003,
};

use super::files::{Files, has_extension, is_picture};
use super::matching::{Listed, Matcher};
use super::{Options, list_of_bounded_size, read_beside, unnamed};
use crate::error::{Error, ErrorKind, Result};
use crate::words::counted;

/// A complete set of images, how it was found, and what had to be assumed.
pub(super) struct Found {
    pub(super) catalogue: Catalogue,
    pub(super) format: String,
    pub(super) assumptions: Vec<Assumption>,
    /// How many of the files are lists that were read: no images, and not ignored.
    pub(super) lists: usize,
}

/// What to do where names tell nothing.
const NAMES: &str = "expected names like `00081 tl015 pl000 tv000 pv000.jpg`; --pattern \
     '{theta_v}_{phi_v}_{theta_i}_{phi_i}.png' says where the angles stand, --table FILE.csv lists them, \
     docs/formats/folders.md lists the fields";

fn frontal() -> Assumption {
    Assumption::views("there are no view directions: one frontal view")
}

/// Sorts out the files of an archive.
///
/// # Errors
/// Names every missing and every duplicate image; or says why the names tell nothing.
pub(super) fn find(archive: &Path, files: &Files, options: &Options, limits: &Limits) -> Result<Found> {
    let complete = |pairs: Vec<Option<Pair>>| {
        // A picture that gives no direction may be one that is missing.
        let left = left_out(files, pairs.iter().map(Option::is_none));
        let shown: Vec<String> = (0..files.len()).map(|number| files.shown(number)).collect();
        let [lights, views] = options.adaptation.dropped().map(<[usize]>::to_vec);
        Catalogue::from_pairs_without(shown.iter().map(String::as_str).zip(pairs), &Without { views, lights })
            .map_err(|errors| incomplete(archive, &errors, left, options.adaptation.swap))
    };
    if let Some(path) = &options.table {
        let table = table::read(&read_beside(path)?, limits)
            .map_err(|error| Error::from(error).context(path.display()))?;
        let rows = table
            .rows
            .iter()
            .map(|row| (Listed { file: &row.file, path: &row.path }, row.pair, row.line as usize))
            .collect();
        let (pairs, remark) = match_files(path, files, rows)?;
        let catalogue = complete(pairs)?;
        let mut assumptions = if table.has_view { Vec::new() } else { vec![frontal()] };
        assumptions.extend(remark.map(Assumption::from));
        let lists = files.names().filter(|name| Path::new(name) == path).count();
        return Ok(Found { catalogue, format: "pictures with a table".to_owned(), assumptions, lists });
    }
    if let Some(text) = &options.pattern {
        let pattern = Pattern::parse(text).map_err(|error| {
            Error::usage(format!("--pattern {text:?}: {error}"))
                .hint("docs/formats/folders.md says how patterns are written")
        })?;
        require_fit(&pattern, files).map_err(|error| error.context(archive.display()))?;
        return by_pattern(archive, &pattern, files, complete);
    }
    let lists: Vec<usize> = match files.named_list() {
        Some(named) => vec![named],
        None => (0..files.len()).filter(|&number| has_extension(files.name(number), "lp")).collect(),
    };
    if !lists.is_empty() {
        return by_light_lists(files, &lists, limits, complete);
    }
    for name in files.names() {
        let unread =
            |error| Error::from(error).context(archive.display()).hint(for_unread_angles(name, files));
        ubo2003::expect_known(name).map_err(unread)?;
    }
    let pairs: Vec<Option<Pair>> = files.names().map(of_ubo2003_name).collect();
    if pairs.iter().any(Option::is_some) {
        let turns = expect_possible(archive, files, ubo2003::doubt)?;
        return Ok(Found {
            catalogue: complete(pairs)?,
            format: "pictures named as in UBO2003".to_owned(),
            assumptions: turns.into_iter().collect(),
            lists: 0,
        });
    }
    let pattern = named::recognise(files.names()).map_err(|error| {
        if let Some(foreign) = files.foreign() {
            return Error::input(foreign).context(archive.display());
        }
        let unread = files.names().find(|name| named::unread_behind(name).is_some());
        Error::from(error)
            .context(archive.display())
            .hint(unread.map_or(NAMES.to_owned(), |name| for_unread_angles(name, files)))
    })?;
    by_pattern(archive, &pattern, files, complete)
}

/// What to do about a name with something behind an angle that is not known; digits may be a fraction or a counter. A
/// pattern is advised only if it reads all pictures.
fn for_unread_angles(name: &str, files: &Files) -> String {
    let reads_all = |pattern: &Pattern| {
        let pairs = files.names().map(|name| (name, pattern.angles(name)));
        let unread = files.names().any(|name| is_picture(name) && pattern.angles(name).is_none());
        !unread && Catalogue::from_pairs(pairs).is_ok()
    };
    match without_counter(name).filter(reads_all) {
        Some(pattern) => {
            format!(
                "rename the pictures; or if the last digits only count: --pattern '{pattern}'; or list the angles by --table FILE.csv"
            )
        }
        None => "rename the pictures, or list their angles by --table FILE.csv".to_owned(),
    }
}

/// The pattern of a name that ends in a counter, if there is one when that is left out.
fn without_counter(name: &str) -> Option<Pattern> {
    let (stem, ending) = name.rsplit_once('.')?;
    let before = stem.trim_end_matches(|c: char| c.is_ascii_digit());
    let head = before.strip_suffix(['_', '-', ' ']).filter(|_| before.len() < stem.len())?;
    let pattern = named::recognise([format!("{head}.{ending}").as_str()]).ok()?;
    Pattern::parse(&format!("{pattern}{}{{n}}", &before[head.len()..])).ok()
}

/// That a pattern which the user gives fits any picture.
fn require_fit(pattern: &Pattern, files: &Files) -> Result<()> {
    let Some(first) = files.names().find(|name| is_picture(name)) else { return Ok(()) };
    if files.names().any(|name| pattern.angles(name).is_some() || pattern.doubt(name).is_some()) {
        return Ok(());
    }
    let found = format!("no name fits the pattern {:?}; the first picture is {first:?}", pattern.to_string());
    Err(Error::input(found).hint(
        "numbers take all digits, theta is 0 to 90 degrees ({theta_i:rad} for radians), {*} stands for any text and \
         {n} for digits that do not matter",
    ))
}

/// Refuses names whose angles no direction has; tells of those that are beyond a whole turn.
///
/// # Errors
/// Names the pictures.
fn expect_possible(
    archive: &Path,
    files: &Files,
    doubt: impl Fn(&str) -> Option<Doubt>,
) -> Result<Option<Assumption>> {
    let (mut impossible, mut turns) = (Vec::new(), Vec::new());
    for name in files.names() {
        match doubt(name) {
            Some(Doubt::Impossible(what)) => impossible.push(format!("{name:?} ({what})")),
            Some(Doubt::WholeTurns(what)) => turns.push(format!("{name:?} ({what})")),
            None => {}
        }
    }
    let some = |list: &[String]| {
        let more = list.len().saturating_sub(NAMED);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        format!("{}{more}", list.iter().take(NAMED).cloned().collect::<Vec<_>>().join(", "))
    };
    if !impossible.is_empty() {
        let found = format!(
            "{}: {} with angles that no direction has, expected theta 0 to 90 degrees: {}",
            archive.display(),
            counted(impossible.len(), "picture"),
            some(&impossible)
        );
        return Err(Error::input(found).hint(
            "correct the names; or move these pictures away; or list those that count by --table FILE.csv",
        ));
    }
    Ok((!turns.is_empty()).then(|| {
        format!("azimuths beyond 360 degrees are read without their whole turns: {}", some(&turns)).into()
    }))
}

fn by_pattern(
    archive: &Path,
    pattern: &Pattern,
    files: &Files,
    complete: impl Fn(Vec<Option<Pair>>) -> Result<Catalogue>,
) -> Result<Found> {
    let turns = expect_possible(archive, files, |name| pattern.doubt(name))?;
    let catalogue = complete(files.names().map(|name| pattern.angles(name)).collect())?;
    let mut assumptions = vec![Assumption::from(format!("names follow the pattern {pattern}"))];
    if !pattern.has_view() {
        assumptions.push(frontal());
    }
    assumptions.extend(turns);
    Ok(Found { catalogue, format: "pictures named by a pattern".to_owned(), assumptions, lists: 0 })
}

fn of_ubo2003_name(name: &str) -> Option<Pair> {
    ubo2003::parse_name(name).map(|image| Pair { view: image.view, light: image.light })
}

/// What a light list says: the pair of each file, and what had to be assumed.
struct Lights {
    pairs: Vec<Option<Pair>>,
    assumptions: Vec<Assumption>,
}

/// The set that the light lists of an archive describe. Several may be there if they say the same.
fn by_light_lists(
    files: &Files,
    lists: &[usize],
    limits: &Limits,
    complete: impl Fn(Vec<Option<Pair>>) -> Result<Catalogue>,
) -> Result<Found> {
    let mut read: Option<(usize, Result<Lights>)> = None;
    for &list in lists {
        let lights = read_light_list(files, list, limits);
        let Some((first, earlier)) = &read else {
            read = Some((list, lights));
            continue;
        };
        let same = matches!((earlier, &lights), (Ok(a), Ok(b)) if a.pairs == b.pairs);
        if !same {
            let found =
                format!("{} and {} are two light lists that differ", files.shown(*first), files.shown(list));
            let hint = match files.is_zipped(*first) || files.is_zipped(list) {
                true => "unpack the archive to a folder, and import the list there that is meant".to_owned(),
                false => format!(
                    "import the one that is meant, with the pictures beside it: btf import {:?}",
                    files.name(list)
                ),
            };
            return Err(Error::input(found).hint(hint));
        }
    }
    let Some((_, lights)) = read else { return Err(Error::internal("no light list")) };
    let Lights { pairs, mut assumptions } = lights?;
    assumptions.insert(0, frontal());
    let format = "RTI light list (.lp)".to_owned();
    Ok(Found { catalogue: complete(pairs)?, format, assumptions, lists: lists.len() })
}

fn read_light_list(files: &Files, list: usize, limits: &Limits) -> Result<Lights> {
    let name = files.name(list);
    let bytes = files.bytes(list)?;
    list_of_bounded_size(name, &bytes)?;
    let lights = rti::read_lp(&bytes, limits).map_err(|error| error.in_entry(name))?;
    let frontal = |light: Angles| Pair { view: Angles::FRONTAL, light };
    let named: Option<Vec<(Listed<'_>, Pair, usize)>> = lights
        .lamps
        .iter()
        .map(|lamp| {
            let listed = Listed { file: lamp.file.as_deref()?, path: &lamp.path };
            Some((listed, frontal(lamp.light), lamp.line))
        })
        .collect();
    let (pairs, remark) = match named {
        Some(rows) => match_files(Path::new(name), files, rows)?,
        None => {
            unnamed::in_order(name, files, lights.lamps.iter().map(|lamp| frontal(lamp.light)).collect())?
        }
    };
    Ok(Lights {
        pairs,
        assumptions: lights.warnings.into_iter().chain(remark).map(Assumption::from).collect(),
    })
}

/// The pair of each file that a list names, and a remark on names that differ; the list lies at `list`.
fn match_files(
    list: &Path,
    files: &Files,
    rows: Vec<(Listed<'_>, Pair, usize)>,
) -> Result<(Vec<Option<Pair>>, Option<String>)> {
    let folder = list.parent().unwrap_or(Path::new(""));
    let shown = |number| files.shown(number);
    let matcher = Matcher::new(files.names(), &shown);
    let mut pairs = vec![None; files.len()];
    let mut lines = vec![0; files.len()];
    let (mut different, mut example) = (0, None);
    for (listed, pair, line) in rows {
        let found = matcher
            .find(&listed, folder)
            .map_err(|error| error.context(format!("{}, line {line}", list.display())))?;
        if pairs[found.number].is_some() {
            let name = files.shown(found.number);
            let twice =
                format!("{}: the lines {} and {line} mean {name}", list.display(), lines[found.number]);
            return Err(Error::input(twice).hint("each picture has one line"));
        }
        (pairs[found.number], lines[found.number]) = (Some(pair), line);
        if let Some(differs) = found.differs {
            different += 1;
            let name = Path::new(files.name(found.number)).file_name().unwrap_or_default().to_string_lossy();
            example.get_or_insert_with(|| format!("{:?} is {name:?}, which differs {differs}", listed.file));
        }
    }
    let remark = example.map(|example| {
        let names = counted(different, "name");
        format!("{names} in {} not quite as the pictures have it: {example}", list.display())
    });
    Ok((pairs, remark))
}

/// Names of pictures that a note or an error lists.
const NAMED: usize = 4;

/// What to know of pictures that are left out, as nothing gives their directions; `left` says it of each file.
pub(super) fn left_out(files: &Files, left: impl Iterator<Item = bool>) -> Option<String> {
    let names: Vec<String> = (0..files.len())
        .zip(left)
        .filter(|&(number, left)| left && is_picture(files.name(number)))
        .map(|(number, _)| format!("{:?}", files.shown(number)))
        .collect();
    let more = if names.len() > NAMED { format!(" and {} more", names.len() - NAMED) } else { String::new() };
    let shown = names.iter().take(NAMED).cloned().collect::<Vec<_>>().join(", ");
    (!names.is_empty())
        .then(|| format!("left out, as they have no direction or one that is dropped: {shown}{more}"))
}

/// What is missing or too often there, and how to go on without it; `swap` if what is called light is the view.
fn incomplete(archive: &Path, errors: &CatalogueErrors, left_out: Option<String>, swap: bool) -> Error {
    if errors.images == 0 && errors.views.min(errors.lights) == 0 && errors.ignored == 0 {
        return Error::usage(format!("{}: no view or no light is left", archive.display()));
    }
    let lines: Vec<String> = errors.to_string().lines().map(str::to_owned).chain(left_out).collect();
    let mut options = ["--drop-view", "--drop-light"];
    if swap {
        options.reverse();
    }
    let spared: Vec<String> = [&errors.spare_views, &errors.spare_lights]
        .into_iter()
        .zip(options)
        .flat_map(|(spare, option)| {
            spare.iter().map(move |(number, angles)| format!("{option} {number} ({})", angles.direction()))
        })
        .collect();
    let hint = match spared.as_slice() {
        [] => "expected one picture for each pair of directions".to_owned(),
        list => format!("put them there; or go on without: {}", list.join(" ")),
    };
    Error::list(ErrorKind::Input, lines).context(archive.display()).hint(hint)
}
