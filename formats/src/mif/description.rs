//! What the XML says of the images: which belong together, under which directions, in which colours.

use roxmltree::{Document, Node};

use super::Options;
use crate::ubo2003::Angles;
use crate::utia::{Order, Pair, below_the_surface, light_and_view};
use crate::words::counted;
use crate::{Direction, Error, ErrorKind, Result};

/// One BTF of a file.
pub(super) struct Description {
    pub(super) pairs: Vec<Pair>,
    /// Numbers of the images, one for each pair.
    pub(super) images: Vec<u64>,
    pub(super) color_space: String,
    /// Labels of all planes.
    pub(super) labels: Option<Vec<String>>,
    pub(super) assumptions: Vec<String>,
    pub(super) remarks: Vec<(String, String)>,
}

/// What a file says without saying it: the published viewer knows nothing else.
const DEFAULT_COLOR_SPACE: &str = "XYZ";

impl Description {
    /// Of a file without XML, if the caller knows the order of its images.
    pub(super) fn of_images(order: Order, images: usize) -> Result<Description> {
        let pairs = order.pairs();
        if pairs.is_empty() {
            let expected = "a description, or an order of images from the caller";
            return Err(Error::new(ErrorKind::Unsupported, "a MIF file without XML", expected));
        }
        if pairs.len() != images {
            let expected = format!("{} for the order {order:?}", pairs.len());
            return Err(Error::new(ErrorKind::Argument, counted(images, "image"), expected));
        }
        Ok(Description {
            images: numbered_from(0, pairs.len())?,
            pairs,
            color_space: DEFAULT_COLOR_SPACE.to_owned(),
            labels: None,
            assumptions: vec![said_by_the_caller(order)],
            remarks: Vec::new(),
        })
    }
}

fn said_by_the_caller(order: Order) -> String {
    format!("The directions are those of the order {order:?}, as the caller said.")
}

fn numbered_from(first: u64, count: usize) -> Result<Vec<u64>> {
    let end = u64::try_from(count).ok().and_then(|count| first.checked_add(count));
    let Some(end) = end else {
        return Err(Error::malformed(format!("images from {first} on"), "numbers below 2^64"));
    };
    Ok((first..end).collect())
}

fn malformed(found: String, expected: &'static str) -> Error {
    Error::malformed(found, expected)
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|child| child.has_tag_name(name))
}

fn children<'a, 'i>(node: Node<'a, 'i>, name: &'static str) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(move |child| child.has_tag_name(name))
}

fn text<'a>(node: Node<'a, '_>) -> &'a str {
    node.text().unwrap_or_default().trim()
}

/// The element that a child refers to: a sibling of the `btf` of the same name and of that id, or the child itself.
fn referred<'a, 'i>(root: Node<'a, 'i>, node: Node<'a, 'i>, name: &'static str) -> Result<Node<'a, 'i>> {
    let Some(id) = node.attribute("reference") else { return Ok(node) };
    children(root, name)
        .find(|other| other.attribute("id") == Some(id))
        .ok_or_else(|| malformed(format!("a reference to {name} {id:?}"), "the id of an element"))
}

pub(super) fn read(tree: &Document<'_>, options: &Options) -> Result<Description> {
    let root = tree.root_element();
    let btf = chosen(root, options.btf.as_deref())?;
    refuse_mipmaps(btf)?;
    let Some(own) = child(btf, "directions") else {
        return Err(malformed("a btf element without directions".to_owned(), "a list of directions"));
    };
    let list = referred(root, own, "directions")?;
    let mut assumptions = Vec::new();
    let mut pairs = listed(list)?;
    if pairs.is_empty() {
        // A reference repeats the name of what it refers to.
        let name = list.attribute("name").or(own.attribute("name")).unwrap_or_default();
        let named = Order::from_name(name).filter(|&order| order != Order::Uniform || is_usual_uniform(list));
        pairs = match (named, options.order) {
            (Some(order), Order::Stated) => order.pairs(),
            (None, order) if order != Order::Stated => {
                assumptions.push(said_by_the_caller(order));
                order.pairs()
            }
            (None, _) => {
                let found = format!("directions {name:?} without a list");
                let expected = "a list, the names UBO81x81 or Uniform, or an order of images from the caller";
                return Err(Error::new(ErrorKind::Unsupported, found, expected));
            }
            (Some(_), _) => return Err(stated_already(options.order)),
        };
    } else if options.order != Order::Stated {
        return Err(stated_already(options.order));
    }
    let images = images(btf, pairs.len())?;
    let colors = match child(btf, "colors") {
        Some(node) => Some(referred(root, node, "colors")?),
        None => None,
    };
    let space =
        colors.and_then(|node| child(node, "color_space")).map(text).filter(|space| !space.is_empty());
    let mut remarks = Vec::new();
    let illuminant = colors.and_then(|node| child(node, "illuminant")).map(text);
    let id = btf.attribute("id");
    for (name, value) in [("btf", id), ("name", child(btf, "name").map(text)), ("illuminant", illuminant)] {
        if let Some(value) = value.filter(|value| !value.is_empty()) {
            remarks.push((name.to_owned(), value.to_owned()));
        }
    }
    Ok(Description {
        pairs,
        images,
        color_space: space.unwrap_or(DEFAULT_COLOR_SPACE).to_owned(),
        labels: colors.and_then(labels),
        assumptions,
        remarks,
    })
}

fn stated_already(order: Order) -> Error {
    let found = format!("an order of images, {order:?}, for a file that has directions");
    Error::new(ErrorKind::Argument, found, "the order that is stated")
}

/// The `btf` element of an id, or the only one.
fn chosen<'a, 'i>(root: Node<'a, 'i>, id: Option<&str>) -> Result<Node<'a, 'i>> {
    let all: Vec<Node<'_, '_>> = children(root, "btf").collect();
    let name = |node: &Node<'a, 'i>| format!("{:?}", node.attribute("id").unwrap_or_default());
    let names = || all.iter().map(name).take(10).collect::<Vec<_>>().join(", ");
    match (id, all.as_slice()) {
        (None, [only]) => Ok(*only),
        (_, []) => Err(malformed("XML without a btf element".to_owned(), "at least one")),
        (None, several) => Err(Error::new(
            ErrorKind::Argument,
            format!("{} and none chosen", counted(several.len(), "btf element")),
            format!("one of {}", names()),
        )),
        (Some(id), _) => all.iter().find(|node| node.attribute("id") == Some(id)).copied().ok_or_else(|| {
            Error::new(ErrorKind::Argument, format!("the btf element {id:?}"), format!("one of {}", names()))
        }),
    }
}

/// Levels of a pyramid packed into one image; one level is the image.
fn refuse_mipmaps(btf: Node<'_, '_>) -> Result<()> {
    let levels = child(btf, "mipmap").map_or(0, |mipmap| children(mipmap, "item").count());
    if levels > 1 {
        let found = format!("images of {}", counted(levels, "mipmap level"));
        return Err(Error::new(ErrorKind::Unsupported, found, "images of one level"));
    }
    Ok(())
}

fn is_usual_uniform(directions: Node<'_, '_>) -> bool {
    let is = |name, step: f64| {
        directions.attribute(name).is_none_or(|value| value.parse::<f64>().is_ok_and(|value| value == step))
    };
    is("stepTheta", 15.0) && is("stepPhi", 30.0)
}

fn labels(colors: Node<'_, '_>) -> Option<Vec<String>> {
    let channels = children(child(colors, "channels")?, "channel");
    let mut labels: Vec<(u64, &str)> = channels
        .map(|channel| Some((channel.attribute("index")?.parse().ok()?, channel.attribute("label")?)))
        .collect::<Option<_>>()?;
    labels.sort_by_key(|&(index, _)| index);
    let in_order = labels.iter().enumerate().all(|(place, &(index, _))| u64::try_from(place) == Ok(index));
    let name = |label: &str| label.strip_suffix("nm").unwrap_or(label).trim().to_owned();
    (in_order && !labels.is_empty()).then(|| labels.iter().map(|&(_, label)| name(label)).collect())
}

/// Numbers of the images: a map, or from an offset on.
fn images(btf: Node<'_, '_>, count: usize) -> Result<Vec<u64>> {
    if let Some(map) = child(btf, "index-map") {
        let numbers: Option<Vec<u64>> =
            text(map).split(',').map(|number| number.trim().parse().ok()).collect();
        return match numbers {
            Some(numbers) if numbers.len() == count => Ok(numbers),
            Some(numbers) => Err(Error::malformed(
                format!("an index-map of {}", counted(numbers.len(), "image")),
                format!("{count}, as there are directions"),
            )),
            None => Err(malformed("an index-map of other things".to_owned(), "whole numbers and commas")),
        };
    }
    let first = match child(btf, "index-offset").map(text) {
        Some(offset) => {
            offset.parse().map_err(|_| malformed(format!("an index-offset {offset:?}"), "a whole number"))?
        }
        None => 0,
    };
    numbered_from(first, count)
}

/// All items of a list, in the order of their indices.
fn listed(list: Node<'_, '_>) -> Result<Vec<Pair>> {
    if list.attribute("type").is_some_and(|kind| kind != "list") {
        let found = format!("directions of type {:?}", list.attribute("type").unwrap_or_default());
        return Err(Error::new(ErrorKind::Unsupported, found, "list"));
    }
    let items: Vec<Node<'_, '_>> = children(list, "directions-item").collect();
    let mut pairs = vec![None; items.len()];
    for (place, &item) in items.iter().enumerate() {
        let index = match item.attribute("index") {
            Some(index) => {
                index.parse().map_err(|_| malformed(format!("item {index:?}"), "a whole number"))?
            }
            None => place,
        };
        match pairs.get_mut(index) {
            Some(slot @ None) => *slot = Some(pair(item, list, index)?),
            Some(_) => return Err(malformed(format!("directions-item {index} twice"), "once")),
            None => {
                let expected = format!("less than {}", items.len());
                return Err(Error::malformed(format!("directions-item {index}"), expected));
            }
        }
    }
    Ok(pairs.into_iter().flatten().collect())
}

/// Light and view of one item: a source and a sensor, or a half and a difference vector.
fn pair(item: Node<'_, '_>, list: Node<'_, '_>, index: usize) -> Result<Pair> {
    let (mut source, mut sensor, mut half, mut difference) = (None, None, None, None);
    for node in children(item, "direction") {
        let kind = node.attribute("type").unwrap_or_default();
        let slot = match kind {
            "source" => &mut source,
            "sensor" => &mut sensor,
            "half-angle" => &mut half,
            "difference-angle" | "diff-angle" => &mut difference,
            other => return Err(malformed(format!("a direction of type {other:?}"), "source or sensor")),
        };
        if slot.is_some() {
            let found = format!("directions-item {index} with two directions of type {kind:?}");
            return Err(Error::new(ErrorKind::Unsupported, found, "one of each"));
        }
        let units = [node, item, list].iter().find_map(|node| node.attribute("units")).unwrap_or("deg");
        *slot = Some(degrees(node, units)?);
    }
    let pair = match (source, sensor, half, difference) {
        (Some(light), Some(view), None, None) => {
            let angles = |(theta, phi)| Angles::new(theta, phi);
            angles(view).zip(angles(light)).map(|(view, light)| Pair { view, light })
        }
        (None, None, Some(half), Some(difference)) => {
            let direction = |(theta, phi)| Direction::from_degrees(theta, phi);
            light_and_view(direction(half), direction(difference))
        }
        _ => {
            let found = format!("directions-item {index} of other directions");
            return Err(malformed(found, "a source and a sensor, or a half-angle and a difference-angle"));
        }
    };
    pair.ok_or_else(|| malformed(below_the_surface(index), "theta from 0 to 90 degrees"))
}

/// theta and phi in degrees.
fn degrees(node: Node<'_, '_>, units: &str) -> Result<(f64, f64)> {
    let angle = |name: &str| {
        let value = node.attribute(name).unwrap_or_default();
        value.trim().parse::<f64>().map_err(|_| malformed(format!("{name} {value:?}"), "a number"))
    };
    let (theta, phi) = (angle("theta")?, angle("phi")?);
    match units {
        "deg" => Ok((theta, phi)),
        "rad" => Ok((theta.to_degrees(), phi.to_degrees())),
        other => Err(Error::new(ErrorKind::Unsupported, format!("units {other:?}"), "deg or rad")),
    }
}
