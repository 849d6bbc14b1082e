//! Folders and zips of pictures whose names hold angles in any other way than UBO2003's.
//!
//! A [`Pattern`] says where: `{theta_v}_{phi_v}_{theta_i}_{phi_i}.exr`. The user gives one, or [`recognise`]
//! finds one by the labels in the names. Frame and angles as everywhere: theta from the normal, phi
//! counter-clockwise from +x (right) as seen in the picture.

mod pattern;
mod recognise;

pub use crate::file_name::natural_order;
pub use pattern::Pattern;
pub use recognise::{recognise, unread_behind};
