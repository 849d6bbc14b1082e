//! A reading of an archive as the options of the command line that ask for it: what users are told of a store, and
//! what repairs one.

use super::reading::{Adaptation, Reading, Side, Type};
use crate::color::Transfer;

impl Adaptation {
    /// The options that ask for this, each with its value; none where nothing is mended.
    pub fn options(&self) -> Vec<String> {
        // Every field by its name, so that a new one is not forgotten.
        let Self {
            drop_views,
            drop_lights,
            swap,
            elevations,
            mirrored,
            turn_deg,
            transpose,
            cosine_excluded,
            transfer,
            samples,
        } = self;
        let of_side = |side: &Side, word: &str| match side {
            Side::Both => word.to_owned(),
            Side::Lights => format!("{word}-lights"),
            Side::Views => format!("{word}-views"),
        };
        let one_by_one: [Option<String>; 8] = [
            swap.then(|| "--swap".to_owned()),
            elevations.as_ref().map(|side| format!("--polar {}", of_side(side, "elevation"))),
            mirrored.as_ref().map(|side| format!("--azimuth {}", of_side(side, "mirrored"))),
            (*turn_deg != 0).then(|| format!("--turn {turn_deg}")),
            transpose.then(|| "--transpose".to_owned()),
            cosine_excluded.then(|| "--cosine excluded".to_owned()),
            transfer.map(|curve| {
                format!("--transfer {}", if curve == Transfer::Linear { "linear" } else { "srgb" })
            }),
            samples.map(|name| format!("--samples {}", of_type(name))),
        ];
        let dropped = |option: &str, numbers: &[usize]| -> Vec<String> {
            numbers.iter().map(|number| format!("{option} {number}")).collect()
        };
        let dropped = [dropped("--drop-view", drop_views), dropped("--drop-light", drop_lights)].concat();
        one_by_one.into_iter().flatten().chain(dropped).collect()
    }
}

impl Reading {
    /// The options that ask for this, but for those that say where the directions stand.
    pub fn options(&self) -> Vec<String> {
        let Self { adaptation, order, bottom_row_first, columns_as_rows } = self;
        let mut all = adaptation.options();
        all.extend(order.as_ref().map(|order| format!("--order {order}")));
        all.extend(bottom_row_first.then(|| "--rows reversed".to_owned()));
        all.extend(columns_as_rows.then(|| "--hdr atrium".to_owned()));
        all
    }
}

fn of_type(name: Type) -> &'static str {
    match name {
        Type::U8 => "u8",
        Type::U16 => "u16",
        Type::F16 => "f16",
        Type::F32 => "f32",
    }
}
