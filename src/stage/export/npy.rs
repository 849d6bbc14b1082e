//! One array for numpy, [view, light, y, x, channel], two with its directions, and the names of its channels.

use std::io::Write;

use btfkit_formats::npy::{channels_file, directions_file, header, sample_bytes};

use super::{Options, Written, for_each_view};
use crate::color::Transfer;
use crate::error::{Error, Result};
use crate::run::Context;
use crate::store::measurement::Measurement;
use crate::store::output;

pub(super) fn write(measurement: &Measurement, options: &Options, context: &Context<'_>) -> Result<Written> {
    let description = measurement.description();
    let (height, width) = (description.size.height, description.size.width);
    let shape = [description.views.len(), description.lights.len(), height, width, description.n_channels()];
    let failed = |error| Error::io("write", &options.output, error);
    // Beside the array first: when the array is there, so are they.
    for (kind, list) in [("views", &description.views), ("lights", &description.lights)] {
        let beside = options.output.with_extension(format!("{kind}.npy"));
        output::write_new(&beside, context.existing, &directions_file(list))?;
    }
    let beside = options.output.with_extension("channels.txt");
    output::write_new(&beside, context.existing, &channels_file(&description.channels))?;
    let made = output::write_whole(&options.output, context.existing, |output| {
        output.write_all(&header(shape.map(|n| n as u64), description.sample_type)).map_err(failed)?;
        for_each_view(measurement, context, |_, images| {
            output.write_all(&sample_bytes(&images)).map_err(failed)
        })
    })?;
    let floats = matches!(description.sample_type.name(), "float16" | "float32");
    let native = if floats { Transfer::Linear } else { Transfer::Srgb };
    let mut warnings = Vec::new();
    if description.transfer != native {
        let curve = if floats { "srgb" } else { "linear" };
        warnings.push(format!("arrays do not hold their transfer curve: import it with --transfer {curve}"));
    }
    Ok((made, warnings))
}
