//! A measurement as one array.

use std::ops::Range;

use half::f16;

use super::header::{Header, Scalar, elements, write};
use crate::catalogue::repeated_direction;
use crate::directions::published_name;
use crate::file_name::repeated;
use crate::text::utf8;
use crate::words::counted;
use crate::{
    Angles, Assumption, Contents, Direction, Error, ErrorKind, Images, Limits, Result, SampleType, Samples,
};

/// An array `[view, light, y, x, channel]` of uint8, uint16, float16, float32 or float64, in C order, row 0
/// at the top. float64 is read as float32.
#[derive(Debug, Clone)]
pub struct Archive {
    header: Header,
    contents: Contents,
    /// Samples of one image.
    image_samples: u64,
    max_decoded_bytes: u64,
}

/// Directions that lie beside an array, or a published list that the user names
/// ([`published`](crate::directions::published)), as the array itself has none.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Beside {
    /// Of the views; may be missing for an array of a single view, which is frontal then.
    pub views: Option<Vec<Direction>>,
    /// Of the lights.
    pub lights: Option<Vec<Direction>>,
    /// Names of the channels; without them one is Y, three are R, G, B, and others have no meaning.
    pub channels: Option<Vec<String>>,
}

/// The names of channels in a text, one a line, as [`channels_file`] writes it.
///
/// # Errors
/// [`ErrorKind::Malformed`]: not UTF-8 (or UTF-16 with its mark), an empty name, a name twice.
pub fn channels(text: &[u8]) -> Result<Vec<String>> {
    let Ok(text) = String::from_utf8(utf8(text)?.into_owned()) else {
        return Err(Error::malformed("a list of channels that is not UTF-8", "UTF-8"));
    };
    let names: Vec<String> = text.trim_end().lines().map(|line| line.trim().to_owned()).collect();
    if names.iter().any(String::is_empty) {
        return Err(Error::malformed("a channel without a name", "one name a line"));
    }
    match repeated(names.iter().map(String::as_str)) {
        Some((first, again)) => {
            let found =
                format!("one name in the lines {} and {}", first.saturating_add(1), again.saturating_add(1));
            Err(Error::malformed(found, "every channel once"))
        }
        None => Ok(names),
    }
}

/// The text that lies beside an array for the names of its channels.
pub fn channels_file(names: &[String]) -> Vec<u8> {
    names.iter().flat_map(|name| [name.as_bytes(), b"\n"].concat()).collect()
}

impl Archive {
    /// Reads the header and takes the directions; samples are read on demand.
    ///
    /// # Errors
    /// [`ErrorKind::Malformed`]: a damaged header, or other data than the shape says. [`ErrorKind::Unsupported`]: another type or
    /// number of axes, Fortran order. [`ErrorKind::Limit`]: sizes beyond the limits. [`ErrorKind::Argument`]:
    /// directions that are missing. [`ErrorKind::Malformed`] also: directions that are too few or many, double, or point into
    /// the surface; too few or many names of channels.
    pub fn open(bytes: &[u8], beside: Beside, limits: &Limits) -> Result<Archive> {
        let header = Header::read(bytes)?;
        let [views, lights, height, width, channels] = header.shape[..] else {
            let found = format!("an array of {}", counted(header.shape.len(), "dimension"));
            return Err(Error::new(ErrorKind::Unsupported, found, "the axes view, light, y, x, channel"));
        };
        if header.shape.contains(&0) {
            return Err(Error::malformed(
                format!("an empty array {:?}", header.shape),
                "at least one sample",
            ));
        }
        let within = |what: &str, found: u64, most: u64| {
            let expected = format!("at most {most}");
            if found <= most {
                Ok(())
            } else {
                Err(Error::new(ErrorKind::Limit, format!("{found} {what}"), expected))
            }
        };
        within("views", views, limits.max_directions)?;
        within("lights", lights, limits.max_directions)?;
        within("channels", channels, limits.max_channels)?;
        within("pixels in an image", height.saturating_mul(width), limits.max_pixels_per_image)?;
        header.data(bytes)?;

        let frontal = vec![Angles::FRONTAL.direction()];
        let assumed_view = beside.views.is_none() && views == 1;
        let given_views = beside.views.or(assumed_view.then_some(frontal));
        let sample_type = sample_type(header.scalar);
        let linear = matches!(sample_type, SampleType::F16 | SampleType::F32);
        let contents = Contents {
            format: format!("numpy array, {}", sample_type.name()),
            width: side(width)?,
            height: side(height)?,
            channels: named(channels, beside.channels)?,
            sample_type,
            views: checked("views", views, given_views)?,
            lights: checked("lights", lights, beside.lights)?,
            linear,
            cosine_included: true,
            assumptions: assumptions(linear, assumed_view),
            remarks: Vec::new(),
        };
        let image_samples = height.saturating_mul(width).saturating_mul(channels);
        Ok(Archive { header, contents, image_samples, max_decoded_bytes: limits.max_decoded_bytes })
    }
}

impl Images for Archive {
    fn contents(&self) -> &Contents {
        &self.contents
    }

    fn read_images(&self, bytes: &[u8], view: usize, lights: Range<usize>) -> Result<Samples> {
        let (n_views, n_lights) = (self.contents.views.len(), self.contents.lights.len());
        if view >= n_views || lights.start > lights.end || lights.end > n_lights {
            let found = format!("view {view}, lights {}..{}", lights.start, lights.end);
            let expected =
                format!("one of {} and some of {}", counted(n_views, "view"), counted(n_lights, "light"));
            return Err(Error::new(ErrorKind::Argument, found, expected));
        }
        let data = self.header.data(bytes)?;
        let image = usize::try_from(self.image_samples).ok();
        let at = |light: usize| {
            let images = view.checked_mul(n_lights)?.checked_add(light)?;
            images.checked_mul(image?)?.checked_mul(self.header.scalar.bytes())
        };
        let wanted = at(lights.start).zip(at(lights.end)).and_then(|(start, end)| data.get(start..end));
        let wanted = wanted.ok_or_else(|| {
            Error::malformed(
                format!("{} of data", counted(data.len(), "byte")),
                "those of the images asked for",
            )
        })?;
        if u64::try_from(wanted.len()).unwrap_or(u64::MAX) > self.max_decoded_bytes {
            let found = format!("{} of samples at once", counted(wanted.len(), "byte"));
            return Err(Error::new(ErrorKind::Limit, found, format!("at most {}", self.max_decoded_bytes)));
        }
        let big = self.header.big_endian;
        Ok(match self.header.scalar {
            Scalar::U8 => Samples::U8(wanted.to_vec()),
            Scalar::U16 => Samples::U16(elements(wanted, big, u16::from_le_bytes, u16::from_be_bytes)),
            Scalar::F16 => Samples::F16(elements(wanted, big, f16::from_le_bytes, f16::from_be_bytes)),
            Scalar::F32 => Samples::F32(elements(wanted, big, f32::from_le_bytes, f32::from_be_bytes)),
            Scalar::F64 => {
                let narrow = |of: fn([u8; 8]) -> f64| move |bytes| of(bytes) as f32;
                Samples::F32(elements(wanted, big, narrow(f64::from_le_bytes), narrow(f64::from_be_bytes)))
            }
        })
    }
}

/// The start of a file of an array `[view, light, y, x, channel]`; the samples follow, as [`sample_bytes`]
/// gives them. Version 1.0, little-endian, C order, aligned to 64 bytes.
pub fn header(shape: [u64; 5], sample_type: SampleType) -> Vec<u8> {
    let scalar = match sample_type {
        SampleType::U8 => Scalar::U8,
        SampleType::U16 => Scalar::U16,
        SampleType::F16 => Scalar::F16,
        SampleType::F32 => Scalar::F32,
    };
    write(&shape, scalar)
}

/// Samples as they follow one another in a file, little-endian.
pub fn sample_bytes(samples: &Samples) -> Vec<u8> {
    match samples {
        Samples::U8(list) => list.clone(),
        Samples::U16(list) => list.iter().flat_map(|sample| sample.to_le_bytes()).collect(),
        Samples::F16(list) => list.iter().flat_map(|sample| sample.to_le_bytes()).collect(),
        Samples::F32(list) => list.iter().flat_map(|sample| sample.to_le_bytes()).collect(),
    }
}

fn sample_type(scalar: Scalar) -> SampleType {
    match scalar {
        Scalar::U8 => SampleType::U8,
        Scalar::U16 => SampleType::U16,
        Scalar::F16 => SampleType::F16,
        Scalar::F32 | Scalar::F64 => SampleType::F32,
    }
}

fn side(pixels: u64) -> Result<u32> {
    u32::try_from(pixels)
        .map_err(|_| Error::new(ErrorKind::Limit, format!("{pixels} rows or columns"), "at most 2^32 - 1"))
}

fn named(count: u64, given: Option<Vec<String>>) -> Result<Vec<String>> {
    let Some(names) = given else { return Ok(channel_names(count)) };
    if u64::try_from(names.len()).ok() == Some(count) {
        return Ok(names);
    }
    let found = format!("{} of channels in NAME.channels.txt", counted(names.len(), "name"));
    Err(Error::malformed(found, format!("{count} as in the array; mend that file, or move it away")))
}

fn channel_names(count: u64) -> Vec<String> {
    match count {
        1 => vec!["Y".to_owned()],
        3 => ["R", "G", "B"].map(str::to_owned).to_vec(),
        _ => (0..count).map(|channel| format!("channel {channel}")).collect(),
    }
}

/// The directions of one axis, as many as the axis is long and no two alike.
fn checked(axis: &str, count: u64, given: Option<Vec<Direction>>) -> Result<Vec<Direction>> {
    let wrong = |found: String, expected: String| Err(Error::malformed(found, expected));
    let Some(list) = given else {
        let published = usize::try_from(count).ok().and_then(published_name);
        let published =
            published.map(|name| format!(", or the published list {name} named")).unwrap_or_default();
        let expected =
            format!("the directions of the {axis} beside the array, in NAME.{axis}.npy{published}");
        let found = format!("{count} {axis} without directions");
        return Err(Error::new(ErrorKind::Argument, found, expected));
    };
    if u64::try_from(list.len()).ok() != Some(count) {
        let found = format!("{} of {axis} beside the array", counted(list.len(), "direction"));
        return wrong(
            found,
            format!("{count} as in the array, of NAME.{axis}.npy or the list that was named"),
        );
    }
    let angles: Option<Vec<Angles>> = list.iter().copied().map(Angles::from_direction).collect();
    let Some(angles) = angles else {
        return wrong(format!("{axis} that point into the surface"), "theta in 0..=pi/2 radians".to_owned());
    };
    match repeated_direction(&angles) {
        Some((first, again)) => {
            wrong(format!("{axis} {first} and {again} in one direction"), "a direction for each".to_owned())
        }
        None => Ok(list),
    }
}

fn assumptions(linear: bool, assumed_view: bool) -> Vec<Assumption> {
    let transfer = if linear {
        "Samples are floating-point, so they are taken to be proportional to reflectance."
    } else {
        "Samples are integers, so they are taken to be display values (sRGB)."
    };
    let mut list = vec![
        Assumption::transfer(transfer),
        Assumption::cosine("The cosine of the light's polar angle is taken to be in the samples."),
        "Row 0 is taken to be the top.".into(),
    ];
    if assumed_view {
        list.push(Assumption::views("The one view is taken to be frontal."));
    }
    list
}
