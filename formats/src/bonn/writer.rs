//! Writing DFMF and FMF, front to back.

use std::collections::VecDeque;
use std::io::Write;

use super::color::ColorModel;
use super::header::TEXT_BYTES;
use super::scalar::Scalar;
use crate::words::counted;
use crate::{Direction, Error, ErrorKind, Result};

/// Version of the common header; the one that names the channels.
const VERSION: u32 = 4;

/// Scalars that are put into bytes before they are written.
const BATCH: usize = 1 << 14;

/// What the header of a file says.
#[derive(Debug, Clone, PartialEq)]
pub struct Description {
    /// Device that measured, at most 80 bytes.
    pub measurement_setup: String,
    /// Sensor, at most 80 bytes.
    pub image_sensor: String,
    /// Light source, at most 80 bytes.
    pub light_source: String,
    /// Scale of the plane; 0 if it is not known.
    pub pixels_per_mm: f32,
    /// Whether the cosine of the light's polar angle is in the data.
    pub cosine_included: bool,
    /// Names of the channels: "R", "G", "B", or wavelengths in nanometres.
    pub channels: Vec<String>,
    /// Directions to the viewer.
    pub views: Vec<Direction>,
    /// Directions to the light, the same for every view.
    pub lights: Vec<Direction>,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// Writes a factorised container to any [`Write`]; nothing but a few rows is ever held. Buffer a file.
///
/// The header is written at once. Then all scalars are pushed, in pieces of any size, in the order of the file:
/// for each channel of a DFMF, or once for a FMF, first U, then S*V, both row by row, every row having as many
/// scalars as there are singular values. Row numbers are
///
/// | container | row of U | row of S*V |
/// | --- | --- | --- |
/// | DFMF | view * lights + light | y * width + x |
/// | FMF | (view * lights + light) * channels + channel | y * width + x |
///
/// with y = 0 at the top. A stored sample is the inner product of its two rows.
///
/// ```
/// use btfkit_formats::bonn::{Archive, Description, OpenOptions, Scalar, Writer};
/// use btfkit_formats::{Direction, Images, Limits, Samples};
///
/// # fn main() -> Result<(), btfkit_formats::Error> {
/// let frontal = vec![Direction::from_degrees(0.0, 0.0)];
/// let description = Description {
///     measurement_setup: String::new(),
///     image_sensor: String::new(),
///     light_source: String::new(),
///     pixels_per_mm: 0.0,
///     cosine_included: true,
///     channels: vec!["Y".to_owned()],
///     views: frontal.clone(),
///     lights: frontal,
///     width: 2,
///     height: 1,
/// };
/// let mut writer = Writer::fmf(Vec::new(), &description, Scalar::F32, &[1.0], false)?;
/// writer.push(&[0.5])?; // U: one row of one scalar
/// writer.push(&[1.0, 3.0])?; // S*V: two pixels
/// let file = writer.finish()?;
/// let archive = Archive::open(&file, &OpenOptions::default(), &Limits::default())?;
/// assert_eq!(archive.read_images(&file, 0, 0..1)?, Samples::F32(vec![0.5, 1.5]));
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Writer<W: Write> {
    output: W,
    scalar: Scalar,
    /// Products that have not been begun.
    products: VecDeque<Product>,
    /// Scalars that the product in work still lacks.
    lacking: u64,
    written: u64,
    bytes: Vec<u8>,
}

/// Everything of a product up to its matrices, and their size.
#[derive(Debug)]
struct Product {
    head: Vec<u8>,
    scalars: u64,
}

impl<W: Write> Writer<W> {
    /// Starts a DFMF file (`!DFMF08FCR`) of one scalar type. `singular_values` holds a list for each channel,
    /// whose length is the channel's rank. The values pushed are those of the colour model: see
    /// [`ColorModel::apply`].
    ///
    /// # Errors
    /// [`ErrorKind::Argument`]: something that the format cannot hold, or a colour model other than RGB and
    /// 11. [`ErrorKind::Io`]: the output failed.
    pub fn dfmf(
        output: W,
        description: &Description,
        scalar: Scalar,
        model: &ColorModel,
        singular_values: &[Vec<f64>],
    ) -> Result<Self> {
        model.apply(&mut [])?;
        let channels = description.channels.len();
        if singular_values.len() != channels {
            let found = format!("{} of singular values", counted(singular_values.len(), "list"));
            return Err(argument(found, format!("{channels}, one for each channel")));
        }
        model.check_channels(channels).map_err(|error| argument(error.to_string(), "channels that fit"))?;
        let (directions, pixels) = description.sizes()?;
        let mut head = description.head("!DFMF08FCR")?;
        let largest = singular_values.iter().map(Vec::len).max().unwrap_or(0);
        put_u32(&mut head, number(largest, "components")?);
        head.extend(model.describe().0.to_le_bytes());
        // Mean and matrix of the principal components, which these models have not.
        for value in [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0] {
            head.extend(value.to_le_bytes());
        }
        let mut products = VecDeque::new();
        for values in singular_values {
            products.push_back(Product::new(head, scalar, values, directions, pixels)?);
            head = Vec::new();
        }
        Self::start(output, scalar, products)
    }

    /// Starts a FMF file: `!FMF06FCR`, or with `log` `!FMF12FCER`, whose flag says that the logarithms
    /// ln(sample + 1e-5) are stored. The number of singular values is the rank.
    ///
    /// # Errors
    /// As [`Writer::dfmf`].
    pub fn fmf(
        output: W,
        description: &Description,
        scalar: Scalar,
        singular_values: &[f64],
        log: bool,
    ) -> Result<Self> {
        let (directions, pixels) = description.sizes()?;
        let rows = number(description.channels.len(), "channels")?.checked_mul(directions);
        let rows = rows.ok_or_else(|| argument("more than 2^32 - 1 rows", "rows that 32 bits count"))?;
        let mut head = description.head(if log { "!FMF12FCER" } else { "!FMF06FCR" })?;
        if log {
            head.push(1);
            put_u32(&mut head, 1);
        }
        put_u32(&mut head, number(singular_values.len(), "components")?);
        let product = Product::new(head, scalar, singular_values, rows, pixels)?;
        Self::start(output, scalar, VecDeque::from([product]))
    }

    fn start(output: W, scalar: Scalar, products: VecDeque<Product>) -> Result<Self> {
        let mut writer = Writer { output, scalar, products, lacking: 0, written: 0, bytes: Vec::new() };
        writer.next_product()?;
        Ok(writer)
    }

    /// Begins the next product, if there is one.
    fn next_product(&mut self) -> Result<bool> {
        let Some(product) = self.products.pop_front() else { return Ok(false) };
        self.write(&product.head)?;
        self.lacking = product.scalars;
        Ok(true)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<()> {
        self.output.write_all(bytes).map_err(|error| Error::io("writing the container", error))?;
        self.written = self.written.saturating_add(u64::try_from(bytes.len()).unwrap_or(u64::MAX));
        Ok(())
    }

    /// Appends the next scalars.
    ///
    /// # Errors
    /// [`ErrorKind::Argument`]: a value that is not finite or beyond the range of the scalar type (65504 for
    /// f16), more values than the file has. [`ErrorKind::Io`]: the output failed. The file cannot be
    /// continued after an error.
    pub fn push(&mut self, values: &[f64]) -> Result<()> {
        let mut rest = values;
        while !rest.is_empty() {
            if self.lacking == 0 && !self.next_product()? {
                let found = format!("{} more than the file has", counted(rest.len(), "value"));
                return Err(argument(found, "the end of the values"));
            }
            let fitting = usize::try_from(self.lacking).unwrap_or(usize::MAX).min(BATCH);
            let (now, later) = rest.split_at(rest.len().min(fitting));
            let mut bytes = std::mem::take(&mut self.bytes);
            bytes.clear();
            for &value in now {
                self.scalar.encode(value, &mut bytes).map_err(|error| error.at(self.written))?;
            }
            self.write(&bytes)?;
            self.bytes = bytes;
            self.lacking = self.lacking.saturating_sub(u64::try_from(now.len()).unwrap_or(u64::MAX));
            rest = later;
        }
        Ok(())
    }

    /// Flushes and returns the output. A file that is dropped without this call may be cut short.
    ///
    /// # Errors
    /// [`ErrorKind::Argument`]: values are missing. [`ErrorKind::Io`]: the output failed.
    pub fn finish(mut self) -> Result<W> {
        let later = self.products.iter().fold(0u64, |sum, product| sum.saturating_add(product.scalars));
        let lacking = self.lacking.saturating_add(later);
        if lacking > 0 {
            return Err(argument("the end of the values", format!("{lacking} more")));
        }
        self.output.flush().map_err(|error| Error::io("writing the container", error))?;
        Ok(self.output)
    }
}

impl Product {
    fn new(
        mut head: Vec<u8>,
        scalar: Scalar,
        singular_values: &[f64],
        left: u32,
        right: u32,
    ) -> Result<Product> {
        let rank = number(singular_values.len(), "components")?;
        head.push(u8::try_from(scalar.bytes()).unwrap_or(u8::MAX));
        for size in [rank, left, right] {
            put_u32(&mut head, size);
        }
        for &value in singular_values {
            scalar.encode(value, &mut head)?;
        }
        let rows = u64::from(left).saturating_add(u64::from(right));
        Ok(Product { head, scalars: rows.saturating_mul(u64::from(rank)) })
    }
}

impl Description {
    /// What keeps btf-extractor 1.7 (and the viewers made of the same code) from opening a file with this
    /// header, scalar type and largest rank: a clause each, none if nothing does.
    pub fn obstacles_elsewhere(&self, scalar: Scalar, rank: usize) -> Vec<String> {
        let mut list = Vec::new();
        let (views, lights, channels) = (self.views.len(), self.lights.len(), self.channels.len());
        if views != lights {
            list.push(format!(
                "it takes the number of lights ({lights}) for that of views, of which there are {views}"
            ));
        }
        if channels != 3 {
            list.push(format!("it reads 3 channels only, and there are {channels}"));
        }
        let pixels = u64::from(self.width).saturating_mul(u64::from(self.height));
        let bytes = [lights, channels, rank, scalar.bytes()];
        let bytes = bytes.map(|number| u64::try_from(number).unwrap_or(u64::MAX));
        let [lights, channels, rank, scalar] = bytes;
        let rows = pixels.max(lights.saturating_mul(lights));
        let bytes = [channels, rank, scalar].into_iter().fold(rows, u64::saturating_mul);
        if bytes > u64::from(u32::MAX) {
            list.push(format!("it counts bytes in 32 bits, and the larger matrices have {bytes}"));
        }
        list
    }

    /// Direction pairs and pixels.
    fn sizes(&self) -> Result<(u32, u32)> {
        let views = number(self.views.len(), "views")?;
        let lights = number(self.lights.len(), "lights")?;
        let pixels = self.width.checked_mul(self.height).filter(|&pixels| pixels > 0);
        let directions = views.checked_mul(lights);
        directions.zip(pixels).ok_or_else(|| {
            let found = format!("{views} x {lights} directions, {} x {} pixels", self.width, self.height);
            argument(found, "1 to 2^32 - 1 of both")
        })
    }

    /// Signature to rotations, of which there are none.
    fn head(&self, signature: &str) -> Result<Vec<u8>> {
        let mut fields = Vec::new();
        put_u32(&mut fields, VERSION);
        for text in [&self.measurement_setup, &self.image_sensor, &self.light_source] {
            let padding = TEXT_BYTES.checked_sub(text.len());
            let padding = padding.ok_or_else(|| argument(format!("{text:?}"), "at most 80 bytes"))?;
            fields.extend(text.as_bytes());
            fields.resize(fields.len().saturating_add(padding), 0);
        }
        for value in [self.pixels_per_mm, 1.0, 1.0, 1.0] {
            fields.extend(value.to_le_bytes());
        }
        put_u32(&mut fields, u32::from(self.cosine_included));
        put_u32(&mut fields, 0); // no XML
        put_u32(&mut fields, number(self.channels.len(), "channels")?);
        for name in &self.channels {
            put_u32(&mut fields, number(name.len(), "letters of a channel's name")?);
            fields.extend(name.as_bytes());
        }
        let mut head = signature.as_bytes().to_vec();
        put_u32(&mut head, number(fields.len().saturating_add(4), "bytes")?);
        head.extend(fields);

        let lights: Vec<[u8; 8]> = self.lights.iter().map(angles).collect::<Result<_>>()?;
        put_u32(&mut head, number(self.views.len(), "views")?);
        for view in &self.views {
            head.extend(angles(view)?);
            put_u32(&mut head, number(lights.len(), "lights")?);
            head.extend(lights.as_flattened());
        }
        for size in [self.width, self.height, 0] {
            put_u32(&mut head, size);
        }
        Ok(head)
    }
}

fn angles(direction: &Direction) -> Result<[u8; 8]> {
    let &Direction { theta_rad, phi_rad } = direction;
    if !(0.0..=std::f64::consts::PI).contains(&theta_rad) || !phi_rad.is_finite() {
        let found = format!("a direction of theta {theta_rad}, phi {phi_rad}");
        return Err(argument(found, "radians, theta in 0..=pi"));
    }
    let mut bytes = [0; 8];
    let angles = [theta_rad, phi_rad].map(|angle| (angle as f32).to_le_bytes());
    bytes.copy_from_slice(angles.as_flattened());
    Ok(bytes)
}

fn put_u32(out: &mut Vec<u8>, value: u32) {
    out.extend(value.to_le_bytes());
}

/// A count, at least one, that 32 bits hold.
fn number(count: usize, what: &str) -> Result<u32> {
    let number = u32::try_from(count).ok().filter(|&number| number > 0);
    number.ok_or_else(|| argument(format!("{count} {what}"), "1 to 2^32 - 1"))
}

fn argument(found: impl Into<Box<str>>, expected: impl Into<std::borrow::Cow<'static, str>>) -> Error {
    Error::new(ErrorKind::Argument, found, expected)
}
