//! How large the store of an archive will be, from a few chunks of one view.

use crate::archive::Source;
use crate::error::Result;
use crate::run::Context;
use crate::shape::{Size, Window};
use crate::stage::import;
use crate::store::measurement::encoded_bytes;
use crate::store::measurement::gather::Images;
use crate::zarr::codec::Chain;

/// Chunks that are encoded, spread over the plane.
const CHUNKS: usize = 16;

/// Estimated bytes of the store: chunks of the middle view are encoded, the rest is taken to pack alike.
/// Decodes the images of that view.
pub fn store_bytes(source: &dyn Source, codec: Chain, context: &Context<'_>) -> Result<u64> {
    let description = import::describe(source, 1.0);
    let view = description.views.len() / 2;
    let images =
        context.install(|| import::read_view(source, view, 1.0, context).map(|(images, _)| images))?;
    let images = Images::new(description.size, description.n_channels(), description.sample_type, images)?;
    let codes = description.codes()?;
    let side = description.chunk_side();
    let Size { height, width } = description.size;
    let across = width.div_ceil(side);
    let all = height.div_ceil(side) * across;
    let step = all.div_ceil(CHUNKS);
    let (mut encoded, mut chunks) = (0, 0);
    for chunk in (step / 2..all).step_by(step) {
        let window =
            Window { y: chunk / across * side, x: chunk % across * side, size: Size::new(side, side) };
        encoded += encoded_bytes(&description, codec, &codes, &images, window)?;
        chunks += 1;
    }
    Ok((encoded as f64 / f64::from(chunks.max(1)) * (all * description.views.len()) as f64) as u64)
}
