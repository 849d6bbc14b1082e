//! The three sizes of scalars that a factorisation is stored in.

use half::slice::HalfFloatSliceExt;

use crate::words::counted;
use crate::{Error, ErrorKind, Result, f16};

/// Type of the numbers in the matrices of a file, little-endian.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Scalar {
    /// IEEE half precision, 2 bytes; up to 65504.
    F16,
    /// IEEE single precision, 4 bytes.
    F32,
    /// IEEE double precision, 8 bytes; read as f32.
    F64,
}

impl Scalar {
    /// Bytes of one scalar, which is also its code in the file.
    pub fn bytes(self) -> usize {
        match self {
            Scalar::F16 => 2,
            Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Scalar::F16 => "f16",
            Scalar::F32 => "f32",
            Scalar::F64 => "f64",
        }
    }

    pub(super) fn from_code(code: u8) -> Result<Self> {
        match code {
            2 => Ok(Scalar::F16),
            4 => Ok(Scalar::F32),
            8 => Ok(Scalar::F64),
            other => {
                Err(Error::malformed(format!("scalars of {}", counted(other, "byte")), "2, 4 or 8 bytes"))
            }
        }
    }

    /// Reads one scalar into each place of `out`; `bytes` holds as many. `halves` is room that is used again.
    pub(super) fn decode(self, bytes: &[u8], out: &mut [f32], halves: &mut Vec<f16>) {
        match self {
            Scalar::F16 => {
                let pairs = bytes.as_chunks::<2>().0.iter();
                halves.clear();
                halves.extend(pairs.map(|&pair| f16::from_le_bytes(pair)).take(out.len()));
                if halves.len() == out.len() {
                    halves.convert_to_f32_slice(out);
                }
            }
            Scalar::F32 => {
                for (value, &four) in out.iter_mut().zip(bytes.as_chunks::<4>().0) {
                    *value = f32::from_le_bytes(four);
                }
            }
            Scalar::F64 => {
                for (value, &eight) in out.iter_mut().zip(bytes.as_chunks::<8>().0) {
                    *value = f64::from_le_bytes(eight) as f32;
                }
            }
        }
    }

    /// Appends one scalar, or says that it has no room for the value.
    pub(super) fn encode(self, value: f64, out: &mut Vec<u8>) -> Result<()> {
        let finite = match self {
            Scalar::F16 => {
                let half = f16::from_f64(value);
                out.extend(half.to_le_bytes());
                half.is_finite()
            }
            Scalar::F32 => {
                let single = value as f32;
                out.extend(single.to_le_bytes());
                single.is_finite()
            }
            Scalar::F64 => {
                out.extend(value.to_le_bytes());
                value.is_finite()
            }
        };
        if finite {
            return Ok(());
        }
        let expected = format!("a finite number in the range of {}", self.name());
        Err(Error::new(ErrorKind::Argument, value.to_string(), expected))
    }
}
