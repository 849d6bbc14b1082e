//! Bonn's factorised containers, exact or of a chosen rank, of linear reflectance with the cosine in it.

mod factor;

use std::io::Write;

use btfkit_formats::bonn::{self, ColorModel, Scalar, Writer};
use btfkit_formats::{SampleType, Samples};

use super::{Options, Source, Written, for_each_view, linear};
use crate::disk::output;
use crate::error::{Error, Result};
use crate::run::Context;
use crate::run::progress::{Counted, Stage};
use crate::shape::Window;
use crate::words::counted;
use factor::{Block, Factors, Identity, Size, identity_rows};

/// Memory that a band of rows may take while it is turned, bytes.
const BAND_LIMIT_BYTES: usize = 256 << 20;

/// Rows of a band: a row of chunks, which are decoded whole.
const BAND_ROWS: usize = 16;

/// One factorisation a channel.
pub(super) fn dfmf(source: &Source, options: &Options, context: &Context<'_>) -> Result<Written> {
    let description = describe(source);
    let scalar = scalar(source);
    let channels = description.channels.len();
    let size = matrix_size(source, 1);
    let factors: Option<Vec<Factors>> = options
        .rank
        .map(|rank| (0..channels).map(|c| truncated(source, Part::Channel(c), rank, context)).collect())
        .transpose()?;
    let values = match &factors {
        Some(factors) => factors.iter().map(|factors| factors.singular_values.clone()).collect(),
        None => vec![vec![1.0; size.full_rank()]; channels],
    };
    let rank = values.iter().map(Vec::len).max().unwrap_or(0);
    let made = output::write_whole(&options.output, context.existing, |output| {
        let mut writer = Writer::dfmf(output, &description, scalar, &ColorModel::Rgb, &values)?;
        match &factors {
            Some(factors) => factors.iter().try_for_each(|factors| push(&mut writer, factors))?,
            None => {
                (0..channels).try_for_each(|c| push_exact(&mut writer, source, Part::Channel(c), context))?;
            }
        }
        writer.finish()?;
        Ok(())
    })?;
    Ok((made, notes(&description, scalar, rank, size)))
}

/// One factorisation of all channels.
pub(super) fn fmf(source: &Source, options: &Options, context: &Context<'_>) -> Result<Written> {
    let description = describe(source);
    let scalar = scalar(source);
    let size = matrix_size(source, description.channels.len());
    let factors = options.rank.map(|rank| truncated(source, Part::All, rank, context)).transpose()?;
    let values = factors.as_ref().map_or(vec![1.0; size.full_rank()], |f| f.singular_values.clone());
    let made = output::write_whole(&options.output, context.existing, |output| {
        let mut writer = Writer::fmf(output, &description, scalar, &values, false)?;
        match &factors {
            Some(factors) => push(&mut writer, factors)?,
            None => push_exact(&mut writer, source, Part::All, context)?,
        }
        writer.finish()?;
        Ok(())
    })?;
    Ok((made, notes(&description, scalar, values.len(), size)))
}

/// What is not held, and what other programs will not like.
fn notes(description: &bonn::Description, scalar: Scalar, rank: usize, size: Size) -> Vec<String> {
    let elsewhere = description.obstacles_elsewhere(scalar, rank).into_iter();
    let mut notes: Vec<String> = elsewhere
        .map(|obstacle| format!("the program btf-extractor cannot read this file: {obstacle}"))
        .collect();
    if rank < size.full_rank() {
        notes.push(format!("not held: all but {} of {}", counted(rank, "component"), size.full_rank()));
    }
    notes
}

/// Which channels a factorisation is of.
#[derive(Clone, Copy)]
enum Part {
    Channel(usize),
    All,
}

impl Part {
    /// The part's channels.
    fn channels(self, all: usize) -> std::ops::Range<usize> {
        match self {
            Self::Channel(channel) => channel..channel + 1,
            Self::All => 0..all,
        }
    }
}

fn describe(source: &Source) -> bonn::Description {
    let description = source.description();
    bonn::Description {
        measurement_setup: String::new(),
        image_sensor: String::new(),
        light_source: String::new(),
        pixels_per_mm: 0.0,
        cosine_included: true,
        channels: description.channels.clone(),
        views: description.views.clone(),
        lights: description.lights.clone(),
        width: description.size.width as u32,
        height: description.size.height as u32,
    }
}

/// Halves hold what halves or 8 bits held; anything else needs floats.
fn scalar(source: &Source) -> Scalar {
    match source.description().sample_type {
        SampleType::U8 | SampleType::F16 => Scalar::F16,
        SampleType::U16 | SampleType::F32 => Scalar::F32,
    }
}

/// Rows are (view * lights + light) * channels + channel, columns pixels.
fn matrix_size(source: &Source, channels: usize) -> Size {
    let description = source.description();
    Size {
        rows: description.views.len() * description.lights.len() * channels,
        columns: description.size.texels(),
    }
}

fn push<W: Write>(writer: &mut Writer<W>, factors: &Factors) -> Result<()> {
    writer.push(&factors.directions)?;
    Ok(writer.push(&factors.pixels)?)
}

/// The identity and the matrix, row by row of both.
fn push_exact<W: Write>(
    writer: &mut Writer<W>,
    source: &Source,
    part: Part,
    context: &Context<'_>,
) -> Result<()> {
    let all = source.description().n_channels();
    let size = matrix_size(source, part.channels(all).len());
    let identity = || identity_rows(size.full_rank());
    match Identity::of(size) {
        Identity::Directions => {
            identity().try_for_each(|row| writer.push(&row))?;
            push_by_pixel(writer, source, part, context)
        }
        Identity::Pixels => {
            for_each_view(source, context, |_, images| {
                let images = linear(&images, source.description().transfer);
                rows_of_view(source, part, &images).try_for_each(|row| Ok(writer.push(&row)?))
            })?;
            identity().try_for_each(|row| Ok(writer.push(&row)?))
        }
    }
}

/// Columns of the matrix one after another: all directions of each pixel.
fn push_by_pixel<W: Write>(
    writer: &mut Writer<W>,
    source: &Source,
    part: Part,
    context: &Context<'_>,
) -> Result<()> {
    let description = source.description();
    let (size, texel, all) = (description.size, description.texel_samples(), description.n_channels());
    let row_bytes = size.width * description.views.len() * description.texel_bytes();
    let rows = (BAND_LIMIT_BYTES / row_bytes.max(1)).clamp(1, BAND_ROWS);
    context.progress.begin("export", size.height as u64, Counted::Items("rows"));
    for y in (0..size.height).step_by(rows) {
        context.check_stop()?;
        let height = rows.min(size.height - y);
        let window = Window { y, x: 0, size: crate::shape::Size::new(height, size.width) };
        let views: Vec<Samples> = (0..description.views.len())
            .map(|view| Ok(linear(&source.read_reflectance(view, window)?, description.transfer)))
            .collect::<Result<_>>()?;
        let mut pixel = Vec::new();
        for at in 0..window.size.texels() {
            pixel.clear();
            for view in &views {
                for light in 0..description.lights.len() {
                    let first = at * texel + light * all;
                    pixel.extend(part.channels(all).map(|c| view.value(first + c).unwrap_or(0.0)));
                }
            }
            writer.push(&pixel)?;
        }
        context.progress.advance(height as u64);
    }
    Ok(())
}

/// Rows of the matrix that one view's linear images give.
fn rows_of_view<'a>(
    source: &Source,
    part: Part,
    images: &'a Samples,
) -> impl Iterator<Item = Vec<f64>> + use<'a> {
    let (lights, all) = (source.description().lights.len(), source.description().n_channels());
    let pixels = source.description().size.texels();
    (0..lights).flat_map(move |light| {
        part.channels(all).map(move |c| {
            let at = |pixel: usize| (light * pixels + pixel) * all + c;
            (0..pixels).map(|pixel| images.value(at(pixel)).unwrap_or(0.0)).collect()
        })
    })
}

fn truncated(source: &Source, part: Part, rank: usize, context: &Context<'_>) -> Result<Factors> {
    let description = source.description();
    let part_channels = part.channels(description.n_channels()).len();
    let size = matrix_size(source, part_channels);
    if rank > size.full_rank() {
        return Err(Error::usage(format!("got --rank {rank}, the rank is at most {}", size.full_rank())));
    }
    let options = factor::Options::default();
    let rows = description.lights.len() * part_channels;
    // Every pass reads the measurement once; of several channels, each has its passes.
    let (before, parts) = match part {
        Part::Channel(channel) => (channel * options.passes(), description.n_channels()),
        Part::All => (0, 1),
    };
    let (mut number, of) = (before, parts * options.passes());
    let factors = factor::truncated(size, rank, &options, |visit| {
        if number > before {
            context.progress.end();
        }
        number += 1;
        context.progress.stage(Some(Stage { number, of, name: "factorise" }));
        for_each_view(source, context, |view, images| {
            let images = linear(&images, description.transfer);
            let values: Vec<f32> = rows_of_view(source, part, &images).flatten().map(|v| v as f32).collect();
            visit(Block { rows: view * rows..(view + 1) * rows, columns: 0..size.columns, values: &values })
        })?;
        // What follows a pass takes long with many columns, and counts nothing.
        context.progress.begin("decompose", 1, Counted::Items("matrices"));
        Ok(())
    })?;
    context.progress.end();
    context.progress.stage(None);
    Ok(factors)
}
