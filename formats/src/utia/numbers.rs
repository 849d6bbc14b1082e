//! Types of samples, and their bytes as [`Samples`].

use crate::{SampleType, Samples, f16};

/// Type of a stored sample, little-endian.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Number {
    U8,
    U16,
    U32,
    U64,
    I8,
    I16,
    I32,
    I64,
    F16,
    F32,
    F64,
}

impl Number {
    /// By the ids of MIF and of the library that writes BIG.
    pub(crate) fn from_library_id(id: u64) -> Option<Number> {
        use Number::{F16, F32, F64, I8, I16, I32, I64, U8, U16, U32, U64};
        let list = [U8, U16, U32, U64, I8, I16, I32, I64, F16, F32, F64];
        usize::try_from(id).ok()?.checked_sub(1).and_then(|place| list.get(place).copied())
    }

    /// By the ids of the document of BIG 3.0. Its id 12, one bit a sample, is not among them.
    pub(crate) fn from_document_id(id: u64) -> Option<Number> {
        use Number::{F16, F32, F64, I8, I16, I32, I64, U8, U16, U32, U64};
        let list = [F16, F32, F64, I8, U8, I16, U16, I32, U32, I64, U64];
        usize::try_from(id).ok()?.checked_sub(1).and_then(|place| list.get(place).copied())
    }

    pub(crate) fn bytes(self) -> usize {
        match self {
            Number::U8 | Number::I8 => 1,
            Number::U16 | Number::I16 | Number::F16 => 2,
            Number::U32 | Number::I32 | Number::F32 => 4,
            Number::U64 | Number::I64 | Number::F64 => 8,
        }
    }

    pub(crate) fn is_float(self) -> bool {
        matches!(self, Number::F16 | Number::F32 | Number::F64)
    }

    /// The type that keeps this one as it is, or f32.
    pub(crate) fn sample_type(self) -> SampleType {
        match self {
            Number::U8 => SampleType::U8,
            Number::U16 => SampleType::U16,
            Number::F16 => SampleType::F16,
            _ => SampleType::F32,
        }
    }

    /// The type that all of `numbers` are read as.
    pub(crate) fn common_sample_type(numbers: impl IntoIterator<Item = Number>) -> SampleType {
        let mut types = numbers.into_iter().map(Number::sample_type);
        let first = types.next().unwrap_or(SampleType::F32);
        if types.all(|other| other == first) { first } else { SampleType::F32 }
    }

    /// One sample as f32: whole numbers as fractions of the largest of their type.
    fn to_f32(self, bytes: &[u8]) -> f32 {
        fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
            bytes.try_into().unwrap_or([0; N])
        }
        let value = match self {
            Number::U8 => f64::from(u8::from_le_bytes(array(bytes))) / f64::from(u8::MAX),
            Number::U16 => f64::from(u16::from_le_bytes(array(bytes))) / f64::from(u16::MAX),
            Number::U32 => f64::from(u32::from_le_bytes(array(bytes))) / f64::from(u32::MAX),
            Number::U64 => u64::from_le_bytes(array(bytes)) as f64 / u64::MAX as f64,
            Number::I8 => f64::from(i8::from_le_bytes(array(bytes))) / f64::from(i8::MAX),
            Number::I16 => f64::from(i16::from_le_bytes(array(bytes))) / f64::from(i16::MAX),
            Number::I32 => f64::from(i32::from_le_bytes(array(bytes))) / f64::from(i32::MAX),
            Number::I64 => i64::from_le_bytes(array(bytes)) as f64 / i64::MAX as f64,
            Number::F16 => f64::from(f16::from_le_bytes(array(bytes))),
            Number::F32 => f64::from(f32::from_le_bytes(array(bytes))),
            Number::F64 => f64::from_le_bytes(array(bytes)),
        };
        value as f32
    }

    /// Appends whole samples of this type, which [`Number::common_sample_type`] has joined to `samples`. Floats are divided by
    /// `unit`, the value of reflectance 1, where they are read as f32.
    pub(crate) fn append(self, samples: &mut Samples, bytes: &[u8], unit: f32) {
        let unit = if self.is_float() { unit } else { 1.0 };
        match samples {
            Samples::U8(list) => list.extend(bytes),
            Samples::U16(list) => {
                list.extend(bytes.as_chunks().0.iter().map(|&pair| u16::from_le_bytes(pair)));
            }
            Samples::F16(list) => {
                list.extend(bytes.as_chunks().0.iter().map(|&pair| f16::from_le_bytes(pair)));
            }
            Samples::F32(list) => {
                list.extend(bytes.chunks_exact(self.bytes()).map(|one| self.to_f32(one) / unit));
            }
        }
    }
}

/// An empty list of a type, with room.
pub(crate) fn with_capacity(sample_type: SampleType, count: usize) -> Samples {
    match sample_type {
        SampleType::U8 => Samples::U8(Vec::with_capacity(count)),
        SampleType::U16 => Samples::U16(Vec::with_capacity(count)),
        SampleType::F16 => Samples::F16(Vec::with_capacity(count)),
        SampleType::F32 => Samples::F32(Vec::with_capacity(count)),
    }
}
