//! Which file is the image of which directions: by a table, a light list, or the names themselves.

use std::path::Path;

use btfkit_formats::named::{self, Pattern, natural_order};
use btfkit_formats::{Angles, Catalogue, CatalogueErrors, Limits, Pair, rti, table, ubo2003};

use super::files::{Files, has_extension, is_picture};
use super::matching::{Listed, Matcher};
use super::{Options, list_of_bounded_size, read_beside};
use crate::error::{Error, ErrorKind, Result};
use crate::words::counted;

/// A complete set of images, how it was found, and what had to be assumed.
pub(super) struct Found {
    pub(super) catalogue: Catalogue,
    pub(super) format: String,
    pub(super) assumptions: Vec<String>,
}

/// What to do where names tell nothing.
const NAMES: &str = "expected names like `00081 tl015 pl000 tv000 pv000.jpg`; --pattern \
     '{theta_v}_{phi_v}_{theta_i}_{phi_i}.png' says where the angles stand, --table FILE.csv lists them, \
     docs/formats/folders.md lists the fields";

const FRONTAL: &str = "there are no view directions: one frontal view";

/// Sorts out the files of an archive.
///
/// # Errors
/// Names every missing and every duplicate image; or says why the names tell nothing.
pub(super) fn find(archive: &Path, files: &Files, options: &Options, limits: &Limits) -> Result<Found> {
    let complete = |pairs: Vec<Option<Pair>>| {
        // A picture that gives no direction may be one that is missing.
        let left = left_out(files, pairs.iter().map(Option::is_none));
        let shown: Vec<String> = (0..files.len()).map(|number| files.shown(number)).collect();
        Catalogue::from_pairs(shown.iter().map(String::as_str).zip(pairs))
            .map_err(|errors| incomplete(archive, &errors, left))
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
        let mut assumptions = if table.has_view { Vec::new() } else { vec![FRONTAL.to_owned()] };
        assumptions.extend(remark);
        return Ok(Found { catalogue, format: "pictures with a table".to_owned(), assumptions });
    }
    if let Some(text) = &options.pattern {
        let pattern = Pattern::parse(text).map_err(|error| {
            Error::usage(format!("--pattern {text:?}: {error}"))
                .hint("docs/formats/folders.md says how patterns are written")
        })?;
        require_fit(&pattern, files).map_err(|error| error.context(archive.display()))?;
        return by_pattern(&pattern, files, complete);
    }
    let lists: Vec<usize> = match files.named_list() {
        Some(named) => vec![named],
        None => (0..files.len()).filter(|&number| has_extension(files.name(number), "lp")).collect(),
    };
    if !lists.is_empty() {
        return by_light_lists(files, &lists, limits, complete);
    }
    for name in files.names() {
        let unread = |error| Error::from(error).context(archive.display()).hint(for_unread_angles(name));
        ubo2003::expect_known(name).map_err(unread)?;
    }
    let pairs: Vec<Option<Pair>> = files.names().map(of_ubo2003_name).collect();
    if pairs.iter().any(Option::is_some) {
        return Ok(Found {
            catalogue: complete(pairs)?,
            format: "pictures named as in UBO2003".to_owned(),
            assumptions: Vec::new(),
        });
    }
    let pattern = named::recognise(files.names()).map_err(|error| {
        if let Some(foreign) = files.foreign() {
            return Error::input(foreign).context(archive.display());
        }
        let unread = files.names().find(|name| named::unread_behind(name).is_some());
        Error::from(error).context(archive.display()).hint(unread.map_or(NAMES.to_owned(), for_unread_angles))
    })?;
    by_pattern(&pattern, files, complete)
}

/// What to do about a name with something behind an angle that is not known; digits may be a fraction or a counter.
fn for_unread_angles(name: &str) -> String {
    let pattern = match without_counter(name) {
        Some(pattern) => format!("if the last digits only count: --pattern '{pattern}'"),
        None => "say by --pattern 'tl{theta_i}_pl{phi_i}_tv{theta_v}_pv{phi_v}_{n}' where the angles stand"
            .to_owned(),
    };
    format!("rename the pictures; or {pattern}; or list the angles by --table FILE.csv")
}

/// The pattern of a name that ends in a counter, if there is one when that is left out.
fn without_counter(name: &str) -> Option<String> {
    let (stem, ending) = name.rsplit_once('.')?;
    let before = stem.trim_end_matches(|c: char| c.is_ascii_digit());
    let head = before.strip_suffix(['_', '-', ' ']).filter(|_| before.len() < stem.len())?;
    let pattern = named::recognise([format!("{head}.{ending}").as_str()]).ok()?;
    Some(format!("{pattern}{}{{n}}", &before[head.len()..]))
}

/// That a pattern which the user gives fits any picture.
fn require_fit(pattern: &Pattern, files: &Files) -> Result<()> {
    let Some(first) = files.names().find(|name| is_picture(name)) else { return Ok(()) };
    if files.names().any(|name| pattern.angles(name).is_some()) {
        return Ok(());
    }
    let found = format!("no name fits the pattern {:?}; the first picture is {first:?}", pattern.to_string());
    Err(Error::input(found).hint(
        "numbers take all digits, theta is 0 to 90 degrees ({theta_i:rad} for radians), {*} stands for any text and \
         {n} for digits that do not matter",
    ))
}

fn by_pattern(
    pattern: &Pattern,
    files: &Files,
    complete: impl Fn(Vec<Option<Pair>>) -> Result<Catalogue>,
) -> Result<Found> {
    let catalogue = complete(files.names().map(|name| pattern.angles(name)).collect())?;
    let mut assumptions = vec![format!("names follow the pattern {pattern}")];
    if !pattern.has_view() {
        assumptions.push(FRONTAL.to_owned());
    }
    Ok(Found { catalogue, format: "pictures named by a pattern".to_owned(), assumptions })
}

fn of_ubo2003_name(name: &str) -> Option<Pair> {
    ubo2003::parse_name(name).map(|image| Pair { view: image.view, light: image.light })
}

/// What a light list says: the pair of each file, and what had to be assumed.
struct Lights {
    pairs: Vec<Option<Pair>>,
    assumptions: Vec<String>,
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
    assumptions.insert(0, FRONTAL.to_owned());
    Ok(Found { catalogue: complete(pairs)?, format: "RTI light list (.lp)".to_owned(), assumptions })
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
        None => in_order(name, files, lights.lamps.iter().map(|lamp| frontal(lamp.light)).collect())?,
    };
    Ok(Lights { pairs, assumptions: lights.warnings.into_iter().chain(remark).collect() })
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

/// Pictures in the order of the numbers in their names are the lights of a list without names.
fn in_order(list: &str, files: &Files, lights: Vec<Pair>) -> Result<(Vec<Option<Pair>>, Option<String>)> {
    let mut pictures: Vec<usize> =
        (0..files.len()).filter(|&number| is_picture(files.name(number))).collect();
    pictures.sort_by(|&a, &b| natural_order(files.name(a), files.name(b)));
    if pictures.len() != lights.len() {
        return Err(Error::input(format!(
            "{list}: got {} without names and {}, expected as many",
            counted(lights.len(), "light"),
            counted(pictures.len(), "picture")
        )));
    }
    let neighbours = || pictures.iter().zip(pictures.iter().skip(1));
    let name = |number: usize| files.name(number);
    let small = |number: usize| name(number).to_lowercase();
    let unsure = |&(&a, &b): &(&usize, &usize)| natural_order(&small(a), &small(b)).is_ge();
    if let Some((&a, &b)) = neighbours().find(unsure) {
        let found = format!(
            "{list}: lights without names, and {} and {}, of which either may be first",
            name(a),
            name(b)
        );
        return Err(Error::input(found).hint("put the names of the pictures into the list"));
    }
    let other_digits = |name: &str| name.contains(|c: char| c.is_numeric() && !c.is_ascii_digit());
    if let Some(&number) = pictures.iter().find(|&&number| other_digits(name(number))) {
        let found = format!(
            "{list}: lights without names, and {}, whose number has digits other than 0 to 9",
            name(number)
        );
        return Err(Error::input(found).hint("put the names of the pictures into the list"));
    }
    let ends = pictures.first().zip(pictures.last());
    let remark = ends.map(|(&first, &last)| {
        format!(
            "the list has no names: its lights are those of the pictures in the order of the numbers in their names, from {} to {}",
            name(first),
            name(last)
        )
    });
    let mut pairs = vec![None; files.len()];
    for (number, pair) in pictures.into_iter().zip(lights) {
        pairs[number] = Some(pair);
    }
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
    (!names.is_empty()).then(|| format!("pictures without directions are left out: {shown}{more}"))
}

fn incomplete(archive: &Path, errors: &CatalogueErrors, left_out: Option<String>) -> Error {
    let lines: Vec<String> = errors.to_string().lines().map(str::to_owned).chain(left_out).collect();
    Error::list(ErrorKind::Input, lines)
        .context(archive.display())
        .hint("expected one picture for each pair of directions")
}
