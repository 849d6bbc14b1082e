//! Mending what is known to be wrong with an archive while it is read: directions that are mirrored, turned or
//! exchanged, elevations in the place of polar angles, images that are transposed, a cosine that is missing, samples of
//! an unwanted type.

use std::ops::Range;
use std::path::Path;

use btfkit_formats::{About, Contents, SampleType, Samples, f16};

use super::{Adaptation, Reading, Source};
use crate::color::{LightnessCodes, Remarkable, Transfer};
use crate::error::{Error, Result};
use crate::run::Context;

impl Adaptation {
    /// What it does to an archive: whatever asks for what the archive is already is left out, and what the archive
    /// asks for itself is put in. So different words for the same bytes are the same.
    fn effective(mut self, of: &Contents) -> Self {
        for numbers in [&mut self.drop_views, &mut self.drop_lights] {
            numbers.sort_unstable();
            numbers.dedup();
        }
        self.cosine_excluded |= !of.cosine_included;
        self.transfer = self.transfer.filter(|&transfer| (transfer == Transfer::Linear) != of.linear);
        self.samples = self.samples.filter(|&name| SampleType::from(name) != of.sample_type);
        self
    }
}

/// The source as it should have been.
///
/// # Errors
/// A view or light to drop that there is none of, none left, or elevations that are one direction.
pub(super) fn adapt(inner: Box<dyn Source>, reading: Reading) -> Result<Box<dyn Source>> {
    let of = inner.contents();
    let adaptation = reading.adaptation.effective(of);
    let reading = Reading { adaptation: adaptation.clone(), ..reading };
    let cosine = adaptation.cosine_excluded;
    let wanted = adaptation.samples.map_or(of.sample_type, SampleType::from);
    if reading == Reading::default() {
        return Ok(inner);
    }
    let mut contents = of.clone();
    // What an option says is no longer assumed.
    contents.assumptions.retain(|assumption| match assumption.about {
        About::Azimuths => adaptation.mirrored.is_none() && adaptation.turn_deg == 0,
        About::Cosine => !(adaptation.cosine_excluded && of.cosine_included),
        About::Transfer => adaptation.transfer.is_none(),
        About::Views | About::Other => true,
    });
    let [kept_lights, kept_views] = adaptation.kept(of, inner.path())?;
    let [mut lights, mut views] = adaptation.directions(of, inner.path())?;
    lights = kept_lights.iter().map(|&light| lights[light]).collect();
    views = kept_views.iter().map(|&view| views[view]).collect();
    (contents.lights, contents.views) = (lights, views);
    if adaptation.transpose {
        (contents.width, contents.height) = (contents.height, contents.width);
    }
    if let Some(transfer) = adaptation.transfer {
        contents.linear = transfer == Transfer::Linear;
    }
    contents.sample_type = wanted;
    contents.cosine_included = true;
    let cosines = cosine.then(|| contents.lights.iter().map(|light| light.vector()[2]).collect());
    Ok(Box::new(Adapted {
        inner,
        contents,
        kept_views,
        kept_lights,
        swap: adaptation.swap,
        transpose: adaptation.transpose,
        cosines,
        reading,
    }))
}

struct Adapted {
    inner: Box<dyn Source>,
    contents: Contents,
    /// The inner source's number of each view (of each light, where they are exchanged).
    kept_views: Vec<usize>,
    /// The same of each light.
    kept_lights: Vec<usize>,
    swap: bool,
    transpose: bool,
    /// What each light's samples are multiplied by, in linear light.
    cosines: Option<Vec<f64>>,
    reading: Reading,
}

impl Source for Adapted {
    fn path(&self) -> &Path {
        self.inner.path()
    }

    fn contents(&self) -> &Contents {
        &self.contents
    }

    fn lights_at_once(&self) -> usize {
        if self.swap { 1 } else { self.inner.lights_at_once() }
    }

    fn bytes_beside_image(&self) -> u64 {
        self.inner.bytes_beside_image()
    }

    fn read_images(&self, view: usize, lights: Range<usize>) -> Result<Samples> {
        Ok(self.converted(&self.mended(view, lights.clone())?, lights.start))
    }

    fn read_counted(
        &self,
        view: usize,
        lights: Range<usize>,
        white: f64,
    ) -> Result<(Samples, Option<Remarkable>)> {
        let Contents { linear, channels, sample_type, .. } = &self.contents;
        let samples = self.mended(view, lights.clone())?;
        let before = samples.sample_type();
        if before == *sample_type {
            return Ok((self.converted(&samples, lights.start), None));
        }
        let transfer = if *linear { Transfer::Linear } else { Transfer::Srgb };
        let codes = LightnessCodes::new(transfer, before, channels, white)?;
        let as_found = match &self.cosines {
            Some(_) => self.with_cosines(&samples, before, lights.start),
            None => samples.clone(),
        };
        let found = codes.fill(&as_found, &mut vec![0; as_found.len() / channels.len()]);
        Ok((self.converted(&samples, lights.start), Some(found)))
    }

    fn reading(&self) -> Reading {
        self.reading.clone()
    }

    fn notes(&self) -> Vec<String> {
        self.inner.notes()
    }

    fn check(&self, context: &Context<'_>) -> Result<String> {
        self.inner.check(context)
    }
}

impl Adapted {
    /// Images in their own type, of the right directions and the right way round.
    fn mended(&self, view: usize, lights: Range<usize>) -> Result<Samples> {
        let view = *self.kept_views.get(view).ok_or_else(|| Error::internal(format!("no view {view}")))?;
        let lights = self.kept_lights.get(lights).ok_or_else(|| Error::internal("no such lights"))?;
        let read = |run: &[usize]| match run {
            [first, .., last] if !self.swap => self.inner.read_images(view, *first..last + 1),
            [light] if !self.swap => self.inner.read_images(view, *light..light + 1),
            lights => {
                let mut samples = Samples::none(self.inner.contents().sample_type);
                for &light in lights {
                    samples.append(&self.inner.read_images(light, view..view + 1)?);
                }
                Ok(samples)
            }
        };
        // Lights that follow each other in the archive are read at once.
        let mut runs = lights.chunk_by(|a, b| a + 1 == *b);
        let mut samples =
            runs.next().map_or_else(|| Ok(Samples::none(self.inner.contents().sample_type)), read)?;
        for run in runs {
            samples.append(&read(run)?);
        }
        let Contents { width, height, channels, .. } = &self.contents;
        if self.transpose {
            samples = transposed(&samples, *height as usize, *width as usize, channels.len());
        }
        Ok(samples)
    }

    /// Images as they are to be stored; the first is that of light `first`.
    fn converted(&self, samples: &Samples, first: usize) -> Samples {
        let wanted = self.contents.sample_type;
        match &self.cosines {
            Some(_) => self.with_cosines(samples, wanted, first),
            None if samples.sample_type() == wanted => samples.clone(),
            None => mapped(samples, wanted, |_, value| value),
        }
    }

    /// The cosine of each light multiplied in, where it is to be.
    fn with_cosines(&self, samples: &Samples, sample_type: SampleType, first: usize) -> Samples {
        let Contents { width, height, channels, linear, .. } = &self.contents;
        let image = *width as usize * *height as usize * channels.len();
        let transfer = if *linear { Transfer::Linear } else { Transfer::Srgb };
        let cosine = |at: usize| self.cosines.as_ref().map_or(1.0, |cosines| cosines[first + at / image]);
        mapped(samples, sample_type, |at, value| transfer.encode(transfer.decode(value) * cosine(at)))
    }
}

/// Images of `height` rows and `width` columns out of images of `width` rows and `height` columns.
fn transposed(samples: &Samples, height: usize, width: usize, channels: usize) -> Samples {
    let image = height * width * channels;
    let images = samples.len() / image.max(1);
    let pixels = (0..images).flat_map(|n| {
        (0..height).flat_map(move |y| {
            (0..width).map(move |x| {
                let at = n * image + (x * height + y) * channels;
                at..at + channels
            })
        })
    });
    samples.select(pixels).unwrap_or_else(|| Samples::none(samples.sample_type()))
}

/// Samples of a type, each a function of its place and its value on the scale where 1.0 is reflectance 1.
/// Integers are rounded and clipped; finite values beyond halves become the largest half.
fn mapped(samples: &Samples, sample_type: SampleType, of: impl Fn(usize, f64) -> f64) -> Samples {
    let values = (0..samples.len()).map(|at| of(at, samples.value(at).unwrap_or(0.0)));
    match sample_type {
        SampleType::U8 => Samples::U8(values.map(|v| (255.0 * v).round() as u8).collect()),
        SampleType::U16 => Samples::U16(values.map(|v| (65535.0 * v).round() as u16).collect()),
        SampleType::F16 => Samples::F16(values.map(half).collect()),
        SampleType::F32 => Samples::F32(values.map(|v| v as f32).collect()),
    }
}

/// The nearest half; of finite values never infinity.
pub(crate) fn half(value: f64) -> f16 {
    let nearest = f16::from_f64(value);
    if value.is_finite() && nearest.is_infinite() { f16::MAX.copysign(nearest) } else { nearest }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use btfkit_formats::Direction;

    use super::*;
    use crate::store::measurement::{Side, Type};

    fn adapted(
        inner: Box<dyn Source>,
        adaptation: impl std::borrow::Borrow<Adaptation>,
    ) -> Result<Box<dyn Source>> {
        adapt(inner, Reading { adaptation: adaptation.borrow().clone(), ..Reading::default() })
    }

    /// 2 views, 3 lights, 2 rows, 3 columns, one channel: every sample tells its place.
    struct Made(Contents);

    fn made(cosine_included: bool) -> Box<dyn Source> {
        let directions =
            |n: u32| (0..n).map(|k| Direction::from_degrees(60.0, 30.0 * f64::from(k))).collect();
        Box::new(Made(Contents {
            format: "made".to_owned(),
            width: 3,
            height: 2,
            channels: vec!["Y".to_owned()],
            sample_type: SampleType::U8,
            views: directions(2),
            lights: directions(3),
            linear: true,
            cosine_included,
            assumptions: Vec::new(),
            remarks: Vec::new(),
        }))
    }

    impl Source for Made {
        fn path(&self) -> &Path {
            Path::new("made")
        }
        fn contents(&self) -> &Contents {
            &self.0
        }
        fn lights_at_once(&self) -> usize {
            2
        }
        fn read_images(&self, view: usize, lights: Range<usize>) -> Result<Samples> {
            let sample = |light: usize, at: usize| (100 * view + 20 * light + at) as u8;
            Ok(Samples::U8(lights.flat_map(|light| (0..6).map(move |at| sample(light, at))).collect()))
        }
        fn check(&self, _: &Context<'_>) -> Result<String> {
            Ok(String::new())
        }
    }

    #[test]
    fn nothing_to_do_is_nothing_done() {
        let source = adapted(made(true), Adaptation::default()).unwrap();
        assert_eq!(source.lights_at_once(), 2);
        assert_eq!(source.read_images(1, 2..3).unwrap(), Samples::U8(vec![140, 141, 142, 143, 144, 145]));
    }

    #[test]
    fn views_and_lights_are_exchanged_dropped_mirrored_and_turned() {
        let adaptation = Adaptation {
            swap: true,
            drop_views: vec![1],
            mirrored: Some(Side::Lights),
            turn_deg: 90,
            ..Adaptation::default()
        };
        let source = adapted(made(true), adaptation).unwrap();
        let degrees = |list: &[Direction]| list.iter().map(|d| d.degrees().1.round()).collect::<Vec<_>>();
        assert_eq!(degrees(&source.contents().views), [90.0, 150.0]);
        assert_eq!(degrees(&source.contents().lights), [90.0, 60.0]);
        let Samples::U8(found) = source.read_images(1, 0..2).unwrap() else { unreachable!() };
        assert_eq!((found[0], found[6]), (40, 140), "view 1 of the result was light 2");
        assert!(adapted(made(true), Adaptation { drop_views: vec![2], ..Adaptation::default() }).is_err());
    }

    #[test]
    fn images_are_transposed_and_converted() {
        let adaptation = Adaptation { transpose: true, samples: Some(Type::F32), ..Adaptation::default() };
        let source = adapted(made(true), adaptation).unwrap();
        assert_eq!((source.contents().width, source.contents().height), (2, 3));
        let found = source.read_images(0, 1..2).unwrap();
        let expected: Vec<f32> = [20, 23, 21, 24, 22, 25].iter().map(|&s| s as f32 / 255.0).collect();
        assert_eq!(found, Samples::F32(expected));
    }

    #[test]
    fn what_a_conversion_hides_is_counted_before_it() {
        /// One image of two texels.
        struct Floats(Contents, [f32; 2]);
        impl Source for Floats {
            fn path(&self) -> &Path {
                Path::new("floats")
            }
            fn contents(&self) -> &Contents {
                &self.0
            }
            fn lights_at_once(&self) -> usize {
                1
            }
            fn read_images(&self, _: usize, _: Range<usize>) -> Result<Samples> {
                Ok(Samples::F32(self.1.to_vec()))
            }
            fn check(&self, _: &Context<'_>) -> Result<String> {
                Ok(String::new())
            }
        }
        let of = |samples: [f32; 2], wanted: Type| {
            let contents = Contents {
                width: 2,
                height: 1,
                sample_type: SampleType::F32,
                ..made(true).contents().clone()
            };
            let source: Box<dyn Source> = Box::new(Floats(contents, samples));
            let source =
                adapted(source, Adaptation { samples: Some(wanted), ..Adaptation::default() }).unwrap();
            source.read_counted(0, 0..1, 1.0).unwrap()
        };
        let counted = |clipped, not_finite, negative| Some(Remarkable { clipped, not_finite, negative });
        for wanted in [Type::U8, Type::U16, Type::F16] {
            assert_eq!(of([3.0, 0.5], wanted).1, counted(1, 0, 0), "{wanted:?}");
            assert_eq!(of([-0.5, f32::NAN], wanted).1, counted(0, 1, 1), "{wanted:?}");
        }
        assert_eq!(of([7e4, -7e4], Type::F16), (Samples::F16(vec![f16::MAX, f16::MIN]), counted(1, 0, 1)));
        assert_eq!(of([0.5, 0.25], Type::F32).1, None, "nothing is converted");
    }

    #[test]
    fn a_missing_cosine_is_multiplied_in() {
        for source in [
            adapted(made(false), Adaptation::default()),
            adapted(made(true), Adaptation { cosine_excluded: true, ..Adaptation::default() }),
        ] {
            let source = source.unwrap();
            assert!(source.contents().cosine_included);
            // cos 60 degrees is one half.
            assert_eq!(source.read_images(1, 2..3).unwrap(), Samples::U8(vec![70, 71, 71, 72, 72, 73]));
        }
    }
}
