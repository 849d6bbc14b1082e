//! What the containers of UTIA (Prague), [`big`](crate::big) and [`mif`](crate::mif), have in common.

mod colors;
mod grid;
mod half_difference;
mod numbers;
mod opened;
mod order;

use crate::Assumption;
pub(crate) use colors::{Colors, transfer};
pub(crate) use grid::{Grid, Pair};
pub(crate) use half_difference::{below_the_surface, light_and_view};
pub(crate) use numbers::{Number, with_capacity};
pub(crate) use opened::Opened;
pub use order::Order;

/// What both readers have to assume, as neither format says it.
pub(crate) fn assumptions() -> [Assumption; 2] {
    [
        Assumption::azimuths(
            "Azimuths run counter-clockwise from the right-hand side of the image; the format does not say.",
        ),
        Assumption::cosine(
            "The cosine of the light's angle is in the samples, as the published viewer takes them.",
        ),
    ]
}
