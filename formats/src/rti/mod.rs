//! Reflectance transformation imaging: photographs from one fixed view under many lights.

mod lp;

pub use lp::{Lamp, LightList, read_lp};
