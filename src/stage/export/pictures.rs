//! A picture for each pair of directions: JPEGs in a zip as UBO2003 has them, EXRs or PNGs in a folder.

use std::path::{Path, PathBuf};

use btfkit_formats::jpeg::{self, EncodeOptions};
use btfkit_formats::picture::{self, Picture};
use btfkit_formats::ubo2003::{Angles, write_name};
use btfkit_formats::zip::ZipWriter;
use btfkit_formats::{Direction, SampleType, Samples};
use rayon::prelude::*;

use super::{Options, Source, Written, for_each_view, linear};
use crate::color::srgb_encode_u8;
use crate::disk::output;
use crate::error::{Error, Result};
use crate::run::Context;
use crate::stage::loss::{self, Beyond, Takes};
use crate::store::measurement::Description;

/// Format of the pictures in a folder.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum FileKind {
    Exr,
    Png,
}

/// A zip of JPEGs with UBO2003's names.
pub(super) fn ubo2003(source: &Source, options: &Options, context: &Context<'_>) -> Result<Written> {
    let description = source.description();
    let whole_degrees = |list: &[Direction]| -> Result<Vec<Angles>> {
        list.iter()
            .map(|direction| {
                let (theta, phi) = direction.degrees();
                let whole = |angle: f64| Some(angle.round()).filter(|round| (angle - round).abs() < 1e-6);
                whole(theta).zip(whole(phi)).and_then(|(theta, phi)| Angles::new(theta, phi)).ok_or_else(
                    || {
                        Error::input(format!("{direction}: names of UBO2003 hold whole degrees only"))
                            .hint("export to a folder of EXRs or PNGs instead")
                    },
                )
            })
            .collect()
    };
    let (views, lights) = (whole_degrees(&description.views)?, whole_degrees(&description.lights)?);
    let encoding = EncodeOptions { quality: options.quality, ..EncodeOptions::UBO2003 };
    let channels: u8 = if description.n_channels() == 1 { 1 } else { 3 };
    let (width, height) = (description.size.width as u32, description.size.height as u32);
    let takes = Takes { bits: 8, names: false, mixes: true, linear: true };
    let mut notes = loss::of_format(description, takes);
    let beyond = Beyond::default();
    let made = output::write_whole(&options.output, context.existing, |output| {
        let mut zip = ZipWriter::new(output);
        for_each_view(source, context, |view, images| {
            let display = display_codes(&images, description, &beyond)?;
            let image = display.len() / lights.len();
            let encoded: Vec<Vec<u8>> = context.install(|| {
                let images = display.par_chunks_exact(image);
                images
                    .map(|samples| Ok(jpeg::encode(samples, width, height, channels, &encoding)?))
                    .collect::<Result<_>>()
            })?;
            for (light, bytes) in encoded.iter().enumerate() {
                let name =
                    write_name(light as u32, lights[light], view as u32, views[view], views.len() as u32)?;
                zip.write_entry(&name, bytes)?;
            }
            Ok(())
        })?;
        zip.finish()?;
        Ok(())
    })?;
    notes.extend(beyond.notes());
    Ok((made, notes))
}

/// 8-bit sRGB values of samples: grey or R, G, B. What they do not hold is counted.
fn display_codes(images: &Samples, description: &Description, beyond: &Beyond) -> Result<Vec<u8>> {
    let plain = description.n_channels() == 1 || description.channels == ["R", "G", "B"];
    if let (Samples::U8(list), true, crate::color::Transfer::Srgb) = (images, plain, description.transfer) {
        return Ok(list.clone());
    }
    let decoder = description.decoder()?;
    let channels = description.n_channels();
    let kept = if channels == 1 { 1 } else { 3 };
    let pixels = (0..images.len()).step_by(channels);
    let values: Vec<f64> = pixels.flat_map(|at| decoder.rgb(images, at).into_iter().take(kept)).collect();
    beyond.count_not_finite(loss::not_finite(images));
    beyond.count(values.iter().copied());
    Ok(values.into_iter().map(srgb_encode_u8).collect())
}

/// A folder of pictures, one folder a view, named by their angles in degrees: light fastest.
pub(super) fn folder(
    source: &Source,
    options: &Options,
    kind: FileKind,
    context: &Context<'_>,
) -> Result<Written> {
    let description = source.description();
    let integers = matches!(description.sample_type, SampleType::U8 | SampleType::U16);
    if kind == FileKind::Png && (!integers || !matches!(description.n_channels(), 1 | 3)) {
        return Err(Error::input(format!(
            "PNGs hold integers of 1 or 3 channels, the samples are {} of {}",
            description.sample_type.name(),
            description.n_channels()
        ))
        .hint("export to a folder of EXRs instead"));
    }
    let notes = match kind {
        FileKind::Exr => Vec::new(),
        FileKind::Png => {
            loss::of_format(description, Takes { bits: 16, names: false, mixes: false, linear: false })
        }
    };
    let made = output::write_whole_folder(&options.output, context.existing, |root| {
        for_each_view(source, context, |view, images| {
            let image = images.len() / description.lights.len();
            context.install(|| {
                description.lights.par_iter().enumerate().try_for_each(|(light, direction)| {
                    let samples = images.select(std::iter::once(light * image..(light + 1) * image));
                    let samples = samples.ok_or_else(|| Error::internal("an image without samples"))?;
                    let name = name(description.views[view], *direction, kind);
                    root.put(&name, &picture_bytes(samples, description, kind)?)
                })
            })
        })
    })?;
    Ok((made, notes))
}

fn picture_bytes(samples: Samples, description: &Description, kind: FileKind) -> Result<Vec<u8>> {
    let samples = if kind == FileKind::Exr { linear(&samples, description.transfer) } else { samples };
    let picture = Picture {
        width: description.size.width as u32,
        height: description.size.height as u32,
        channels: description.channels.clone(),
        samples,
    };
    Ok(match kind {
        FileKind::Exr => picture::exr::encode(&picture, picture::exr::Compression::Zip)?,
        FileKind::Png => picture::png::encode(&picture)?,
    })
}

/// `tvT_pvP/tvT_pvP_tlT_plP.exr`, degrees to nine decimals without needless zeros.
fn name(view: Direction, light: Direction, kind: FileKind) -> PathBuf {
    let text = |direction: Direction, side: char| {
        let round = |angle: f64| (angle * 1e9).round() / 1e9;
        let (theta, phi) = direction.degrees();
        format!("t{side}{}_p{side}{}", round(theta), round(phi.rem_euclid(360.0)))
    };
    let extension = if kind == FileKind::Exr { "exr" } else { "png" };
    let (view, light) = (text(view, 'v'), text(light, 'l'));
    Path::new(&view).join(format!("{view}_{light}.{extension}"))
}
