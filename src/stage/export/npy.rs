//! One array for numpy, [view, light, y, x, channel], two with its directions, and the names of its channels.

use std::io::Write;

use btfkit_formats::npy::{channels_file, directions_file, header, sample_bytes};

use super::{Options, Source, Written, for_each_view};
use crate::color::Transfer;
use crate::disk::output;
use crate::error::{Error, Result};
use crate::run::Context;

pub(super) fn write(source: &Source, options: &Options, context: &Context<'_>) -> Result<Written> {
    let description = source.description();
    let (height, width) = (description.size.height, description.size.width);
    let shape = [description.views.len(), description.lights.len(), height, width, description.n_channels()];
    let failed = |error| Error::io("write", &options.output, error);
    // No name is taken before all files are ready; the array comes last: when it is there, so are the others.
    let directions = [("views.npy", &description.views), ("lights.npy", &description.lights)];
    let beside = directions.map(|(name, list)| (name, directions_file(list)));
    let beside = beside.into_iter().chain([("channels.txt", channels_file(&description.channels))]);
    let mut files = beside
        .map(|(ending, bytes)| {
            output::prepare_bytes(&options.output.with_extension(ending), context.existing, &bytes)
        })
        .collect::<Result<Vec<_>>>()?;
    files.push(output::prepare(&options.output, context.existing, |output| {
        output.write_all(&header(shape.map(|n| n as u64), description.sample_type)).map_err(failed)?;
        for_each_view(source, context, |_, images| output.write_all(&sample_bytes(&images)).map_err(failed))
    })?);
    let made = output::publish_all(files)?;
    let floats = matches!(description.sample_type.name(), "float16" | "float32");
    let native = if floats { Transfer::Linear } else { Transfer::Srgb };
    let mut warnings = Vec::new();
    if description.transfer != native {
        let curve = if floats { "srgb" } else { "linear" };
        warnings.push(format!("arrays do not hold their transfer curve: import it with --transfer {curve}"));
    }
    Ok((made, warnings))
}
