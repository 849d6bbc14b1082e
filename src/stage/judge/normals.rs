//! The normal map judged as two pictures, n_x and n_y, against normals of the real crops by photometric stereo.

use super::crops::Crops;
use super::report::{NormalRows, Normals};
use super::subject::Subject;
use super::whole::Material;
use crate::error::Result;
use crate::likeness::{Judge, Lightness};
use crate::run::Context;
use crate::run::progress::Counted;
use crate::shape::Size;
use crate::stage::normals;
use crate::store::measurement::Measurement;
use crate::store::model::normals::NormalsRecipe;
use crate::store::model::{Model, Stage};

/// Components are judged in hundredths, so that they are about as large as L*.
const SCALE: f64 = 100.0;

/// Judges them, or says why it cannot.
///
/// # Errors
/// Those of reading.
pub(super) fn judge(
    subject: &Subject,
    model: &Model,
    measurement: &Measurement,
    material: &Material<'_>,
    crops: &Crops,
    context: &Context<'_>,
) -> Result<Normals> {
    let absent = |reason: &str| Ok(Normals::Absent { reason: reason.to_owned() });
    if !model.has(Stage::Normals)? {
        return absent("the model has no normals: run `btf normals`");
    }
    let tile = model.normals()?;
    let size = Size::new(crops.side, crops.side);
    let mut enlarged = Vec::new();
    for &window in &crops.enlarged {
        enlarged.push(match subject.normals(window)? {
            Some(kept) => kept,
            None => match subject.texels(window, material.clusters, material.tile)?.source {
                Some(source) => source.iter().map(|&texel| tile[texel as usize]).collect(),
                None => return absent("it keeps neither sources nor normals: enlarge with --keep-normals"),
            },
        });
    }
    let NormalsRecipe { robust, .. } = model.recipe(Stage::Normals)?;
    let view = normals::frontal_view(measurement);
    let rows = crops.reals.len() * crops.side;
    context.progress.begin("normals", rows as u64, Counted::Items("rows"));
    let measured: Vec<Vec<[f32; 3]>> = crops
        .reals
        .iter()
        .map(|&window| normals::of_window(measurement, view, robust, window, context))
        .collect::<Result<_>>()?;
    context.progress.end();
    let component = |normals: &[[f32; 3]], size: Size, axis: usize| {
        Lightness::new(size, normals.iter().map(|normal| SCALE * f64::from(normal[axis])).collect())
    };
    let component_of = |normals: &[Vec<[f32; 3]>], axis: usize| -> Vec<Lightness> {
        normals.iter().map(|normals| component(normals, size, axis)).collect()
    };
    let judged = |axis: usize| -> Result<NormalRows> {
        let judge = Judge::new(&component_of(&measured, axis))?;
        let exemplar = component(&tile, material.tile, axis).part(material.exemplar);
        Ok(NormalRows {
            own: (&crops.judge(&judge, &crops.of_repeated(&exemplar))?).into(),
            enlarged: (&crops.judge(&judge, &component_of(&enlarged, axis))?).into(),
        })
    };
    // A surface without relief has normals without contrast.
    match context.compute(|| Ok((judged(0)?, judged(1)?))) {
        Ok((x, y)) => Ok(Normals::Judged {
            against: "normals of the real crops, measured".to_owned(),
            x: Box::new(x),
            y: Box::new(y),
        }),
        Err(error) => {
            let error: crate::error::Error = error;
            absent(&error.to_string())
        }
    }
}
