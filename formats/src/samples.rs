//! Samples of the types that measurements come in.

use std::ops::Range;

pub use half::f16;

/// Type of one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum SampleType {
    /// 8-bit, 255 is reflectance 1 (or display white).
    U8,
    /// 16-bit, 65535 is reflectance 1 (or display white).
    U16,
    /// IEEE half precision, 1.0 is reflectance 1.
    F16,
    /// IEEE single precision, 1.0 is reflectance 1.
    F32,
}

impl SampleType {
    /// Bytes of one sample.
    pub fn bytes(self) -> usize {
        match self {
            SampleType::U8 => 1,
            SampleType::U16 | SampleType::F16 => 2,
            SampleType::F32 => 4,
        }
    }

    /// The name that numpy and Zarr use.
    pub fn name(self) -> &'static str {
        match self {
            SampleType::U8 => "uint8",
            SampleType::U16 => "uint16",
            SampleType::F16 => "float16",
            SampleType::F32 => "float32",
        }
    }
}

/// A list of samples of one type; what the order means, the one who hands it out says.
#[derive(Debug, Clone, PartialEq)]
pub enum Samples {
    /// See [`SampleType::U8`].
    U8(Vec<u8>),
    /// See [`SampleType::U16`].
    U16(Vec<u16>),
    /// See [`SampleType::F16`].
    F16(Vec<f16>),
    /// See [`SampleType::F32`].
    F32(Vec<f32>),
}

impl Samples {
    /// Type of the samples.
    pub fn sample_type(&self) -> SampleType {
        match self {
            Samples::U8(_) => SampleType::U8,
            Samples::U16(_) => SampleType::U16,
            Samples::F16(_) => SampleType::F16,
            Samples::F32(_) => SampleType::F32,
        }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        match self {
            Samples::U8(list) => list.len(),
            Samples::U16(list) => list.len(),
            Samples::F16(list) => list.len(),
            Samples::F32(list) => list.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One sample on the scale where 1.0 is reflectance 1 (or display white): integers are divided by their
    /// largest value. No transfer curve is undone. `None` beyond the end.
    pub fn value(&self, at: usize) -> Option<f64> {
        match self {
            Samples::U8(list) => list.get(at).map(|&s| f64::from(s) / 255.0),
            Samples::U16(list) => list.get(at).map(|&s| f64::from(s) / 65535.0),
            Samples::F16(list) => list.get(at).map(|&s| s.to_f64()),
            Samples::F32(list) => list.get(at).map(|&s| f64::from(s)),
        }
    }

    /// The samples of some ranges, one after another; `None` where one reaches beyond the end.
    pub fn select(&self, ranges: impl Iterator<Item = Range<usize>>) -> Option<Samples> {
        fn selected<T: Copy>(list: &[T], ranges: impl Iterator<Item = Range<usize>>) -> Option<Vec<T>> {
            let mut found = Vec::new();
            for range in ranges {
                found.extend_from_slice(list.get(range)?);
            }
            Some(found)
        }
        Some(match self {
            Samples::U8(list) => Samples::U8(selected(list, ranges)?),
            Samples::U16(list) => Samples::U16(selected(list, ranges)?),
            Samples::F16(list) => Samples::F16(selected(list, ranges)?),
            Samples::F32(list) => Samples::F32(selected(list, ranges)?),
        })
    }

    /// Adds samples of the same type at the end; returns whether the types agree.
    pub fn append(&mut self, more: &Samples) -> bool {
        match (self, more) {
            (Samples::U8(list), Samples::U8(more)) => list.extend_from_slice(more),
            (Samples::U16(list), Samples::U16(more)) => list.extend_from_slice(more),
            (Samples::F16(list), Samples::F16(more)) => list.extend_from_slice(more),
            (Samples::F32(list), Samples::F32(more)) => list.extend_from_slice(more),
            _ => return false,
        }
        true
    }

    /// No samples, of a type.
    pub fn none(sample_type: SampleType) -> Samples {
        match sample_type {
            SampleType::U8 => Samples::U8(Vec::new()),
            SampleType::U16 => Samples::U16(Vec::new()),
            SampleType::F16 => Samples::F16(Vec::new()),
            SampleType::F32 => Samples::F32(Vec::new()),
        }
    }

    /// All samples as f32 on the scale where 1.0 is reflectance 1 (or display white): integers are divided by
    /// their largest value. No transfer curve is undone.
    pub fn to_f32(&self) -> Vec<f32> {
        match self {
            Samples::U8(list) => list.iter().map(|&s| f32::from(s) / 255.0).collect(),
            Samples::U16(list) => list.iter().map(|&s| f32::from(s) / 65535.0).collect(),
            Samples::F16(list) => list.iter().map(|&s| s.to_f32()).collect(),
            Samples::F32(list) => list.clone(),
        }
    }
}
