//! One HDF5 file with the arrays and attributes of the store.

use super::{Options, Source, Written};
use crate::archive::hdf5::Writer;
use crate::error::Result;
use crate::run::progress::Counted;
use crate::run::{Context, read_ahead};

pub(super) fn write(source: &Source, options: &Options, context: &Context<'_>) -> Result<Written> {
    let description = source.description();
    let contents = description.contents("measurement store".to_owned());
    let mut writer =
        Writer::create(&options.output, &contents, &source.attributes()?)?.with_existing(context.existing);
    let whole = description.size.window();
    context.progress.begin("export", description.views.len() as u64, Counted::Items("views"));
    let codes = (description.size.texels() * description.lights.len()) as u64;
    let in_flight = read_ahead::in_flight(context.work_bytes(), description.view_bytes() + codes);
    let read = |view| {
        let samples = source.read_reflectance(view, whole)?;
        Ok((view, samples, source.read_luminance(view, whole)?))
    };
    read_ahead::for_each(context, in_flight, 0..description.views.len(), read, |(view, samples, codes)| {
        writer.write_view(view, &samples, Some(&codes))?;
        context.progress.advance(1);
        Ok(())
    })?;
    let made = writer.finish()?;
    Ok((made, Vec::new()))
}
