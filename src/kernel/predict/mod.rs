//! Lossless prediction of the samples of a chunk: what is left packs to a half or a quarter.
//!
//! A chunk is [y, x, light, channel]. Each channel becomes its difference from another ([`split`](Kernel::split)),
//! each sample its difference from what its neighbours in the plane of its light predict, and that residual its
//! difference from what the residuals of neighbouring lights predict ([`mode`]). All arithmetic is on whole
//! numbers modulo 2^bits, so every kernel gives the same bytes. `docs/reference/codec.md` has it step by step.

mod channels;
mod deltas;
mod forward;
mod inverse;
mod lane;
pub mod mode;

pub use super::Kernel;
use super::dispatch;
use channels::{join, split};
pub use lane::Lane;
use mode::{DISTANCES, Mode};

/// Samples beyond the end of a plane that kernels may overwrite.
pub(crate) const SLACK: usize = 32;

/// Extent of a chunk without its channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Rows of texels.
    pub rows: usize,
    /// Columns of texels.
    pub columns: usize,
    /// Lights of each texel.
    pub lights: usize,
}

impl Shape {
    /// Samples of one channel.
    pub fn samples(self) -> usize {
        self.rows * self.columns * self.lights
    }
}

/// What the bits of a sample mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Numbers {
    /// Whole numbers without sign.
    Integer,
    /// IEEE floating point.
    Float,
}

/// All ones where a sample of a row is predicted from the lights at each distance.
type Masks<T> = [Vec<T>; DISTANCES.len()];

fn masks<T: Lane>(shape: Shape) -> Masks<T> {
    DISTANCES.map(|distance| {
        let light = |light: usize| {
            let between = light % (2 * distance) == distance && light + distance < shape.lights;
            if between { T::default().minus(T::at(1, 0)) } else { T::default() }
        };
        (0..shape.columns * shape.lights).map(|n| light(n % shape.lights)).collect()
    })
}

/// Prediction of chunks of one shape, with its buffers.
pub struct Predictor<T> {
    kernel: Kernel,
    shape: Shape,
    channels: usize,
    numbers: Numbers,
    masks: Masks<T>,
    planes: Vec<T>,
    forward: forward::Scratch<T>,
    inverse: inverse::Scratch<T>,
}

impl<T: Lane> Predictor<T> {
    /// A predictor of chunks of this shape, none of whose extents is 0.
    pub fn new(kernel: Kernel, shape: Shape, channels: usize, numbers: Numbers) -> Self {
        assert!(shape.samples() * channels > 0, "an empty chunk");
        Self {
            kernel,
            shape,
            channels,
            numbers,
            masks: masks(shape),
            planes: vec![T::default(); (shape.samples() + SLACK) * channels],
            forward: forward::Scratch::default(),
            inverse: inverse::Scratch::default(),
        }
    }

    /// Residuals of a chunk of little-endian samples in C order: for each channel [`Lane::BYTES`] planes of bytes, the
    /// highest first, written to `residuals`; and how each channel was predicted.
    ///
    /// # Panics
    /// Unless both have as many bytes as the chunk has.
    pub fn forward(&mut self, samples: &[u8], residuals: &mut [u8], modes: &mut Vec<Mode>) {
        let bytes = self.shape.samples() * T::BYTES;
        assert_eq!((samples.len(), residuals.len()), (bytes * self.channels, bytes * self.channels));
        self.kernel.split(samples, self.channels, self.numbers, &mut self.planes);
        modes.clear();
        let planes = self.planes.chunks_exact(self.shape.samples() + SLACK);
        for (plane, residuals) in planes.zip(residuals.chunks_exact_mut(bytes)) {
            modes.push(self.kernel.residuals(plane, self.shape, &self.masks, &mut self.forward, residuals));
        }
    }

    /// Inverse of [`Self::forward`].
    ///
    /// # Panics
    /// Unless `modes` has one for each channel and the others as many bytes as the chunk has.
    pub fn inverse(&mut self, residuals: &[u8], modes: &[Mode], samples: &mut [u8]) {
        let bytes = self.shape.samples() * T::BYTES;
        assert_eq!((samples.len(), residuals.len()), (bytes * self.channels, bytes * self.channels));
        assert_eq!(modes.len(), self.channels);
        let planes = self.planes.chunks_exact_mut(self.shape.samples() + SLACK);
        for ((plane, residuals), &mode) in planes.zip(residuals.chunks_exact(bytes)).zip(modes) {
            self.kernel.samples(residuals, self.shape, mode, &self.masks, &mut self.inverse, plane);
        }
        self.kernel.join(&mut self.planes, self.channels, self.numbers, samples);
    }
}

/// Differences that stock Zarr readers undo, of chunks of one shape of whole numbers.
pub struct Deltas<T> {
    kernel: Kernel,
    shape: Shape,
    channels: usize,
    planes: Vec<T>,
}

impl<T: Lane> Deltas<T> {
    /// Differences of chunks of this shape, none of whose extents is 0.
    pub fn new(kernel: Kernel, shape: Shape, channels: usize) -> Self {
        assert!(shape.samples() * channels > 0, "an empty chunk");
        Self { kernel, shape, channels, planes: vec![T::default(); (shape.samples() + SLACK) * channels] }
    }

    /// Differences of a chunk of little-endian samples in C order, as planes of bytes, the lowest first.
    ///
    /// # Panics
    /// Unless both have as many bytes as the chunk has.
    pub fn forward(&mut self, samples: &[u8], bytes: &mut [u8]) {
        let expected = self.shape.samples() * T::BYTES * self.channels;
        assert_eq!((samples.len(), bytes.len()), (expected, expected));
        self.kernel.deltas(samples, self.shape, self.channels, &mut self.planes, bytes);
    }

    /// Inverse of [`Self::forward`].
    ///
    /// # Panics
    /// Unless both have as many bytes as the chunk has.
    pub fn inverse(&mut self, bytes: &[u8], samples: &mut [u8]) {
        let expected = self.shape.samples() * T::BYTES * self.channels;
        assert_eq!((samples.len(), bytes.len()), (expected, expected));
        self.kernel.sums(bytes, self.shape, self.channels, &mut self.planes, samples);
    }
}

/// The same code for each kernel: written so that compilers make vectors of it, as wide as the kernel allows.
macro_rules! kernels {
    ($(fn $name:ident = $plain:path; ($($argument:ident: $type:ty),*) $(-> $result:ty)?;)*) => {
        impl Kernel {$(
            fn $name<T: Lane>(self, $($argument: $type),*) $(-> $result)? {
                #[cfg(target_arch = "x86_64")]
                #[target_feature(enable = "avx2")]
                fn avx2<T: Lane>($($argument: $type),*) $(-> $result)? { $plain($($argument),*) }
                // AVX-512 gains nothing.
                dispatch!(self; $plain($($argument),*), avx2($($argument),*), avx2($($argument),*))
            }
        )*}
    };
}
kernels! {
    fn split = split; (samples: &[u8], channels: usize, numbers: Numbers, planes: &mut [T]);
    fn join = join; (planes: &mut [T], channels: usize, numbers: Numbers, samples: &mut [u8]);
    fn residuals = forward::residuals; (plane: &[T], shape: Shape, masks: &Masks<T>, scratch: &mut forward::Scratch<T>, bytes: &mut [u8]) -> Mode;
    fn samples = inverse::samples; (bytes: &[u8], shape: Shape, mode: Mode, masks: &Masks<T>, scratch: &mut inverse::Scratch<T>, plane: &mut [T]);
    fn deltas = deltas::forward; (samples: &[u8], shape: Shape, channels: usize, planes: &mut [T], bytes: &mut [u8]);
    fn sums = deltas::inverse; (bytes: &[u8], shape: Shape, channels: usize, planes: &mut [T], samples: &mut [u8]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Hash;

    /// A smooth surface with noise, or noise alone, in `bytes` bytes a sample.
    fn chunk(shape: Shape, channels: usize, bytes: usize, noise: u32) -> Vec<u8> {
        let hash = Hash::new(3, noise);
        let count = shape.samples() * channels;
        let sample = |n: usize| {
            let (channel, light) = (n % channels, n / channels % shape.lights);
            let texel = n / channels / shape.lights;
            let (x, y) = (texel % shape.columns, texel / shape.columns);
            let smooth = (7 * x + 5 * y * (1 + light % 3) + 11 * light + 40 * channel) as u32;
            let grain = hash.words(n as u32, 0, 0)[0];
            let value = smooth.wrapping_mul(if bytes > 1 { 97 } else { 1 });
            value.wrapping_add(if noise == 0 { grain } else { grain % noise }).to_le_bytes()
        };
        (0..count).flat_map(|n| sample(n).into_iter().take(bytes)).collect()
    }

    fn check<T: Lane>(shape: Shape, channels: usize, numbers: Numbers, noise: u32) {
        let samples = chunk(shape, channels, T::BYTES, noise);
        let mut plain = None;
        for kernel in Kernel::available() {
            let mut predictor = Predictor::<T>::new(kernel, shape, channels, numbers);
            let (mut residuals, mut modes) = (vec![0; samples.len()], Vec::new());
            predictor.forward(&samples, &mut residuals, &mut modes);
            let mut back = vec![0; samples.len()];
            predictor.inverse(&residuals, &modes, &mut back);
            assert!(back == samples, "{kernel:?} {shape:?} {channels} {numbers:?} {modes:?}");
            match &plain {
                None => plain = Some((residuals, modes)),
                Some(plain) => assert!(*plain == (residuals, modes), "{kernel:?} {shape:?} {channels}"),
            }
        }
    }

    #[test]
    fn every_kernel_gives_the_plain_residuals_and_the_samples_back() {
        for (rows, columns, lights) in
            [(16, 16, 81), (8, 8, 25), (1, 1, 1), (1, 7, 3), (5, 1, 2), (3, 4, 40), (2, 9, 33)]
        {
            let shape = Shape { rows, columns, lights };
            for channels in [1, 2, 3, 5] {
                for noise in [0, 3, 19] {
                    check::<u8>(shape, channels, Numbers::Integer, noise);
                    check::<u16>(shape, channels, Numbers::Integer, noise);
                    check::<u16>(shape, channels, Numbers::Float, noise);
                    check::<u32>(shape, channels, Numbers::Float, noise);
                }
            }
        }
    }

    /// `values` [shape] as an array of which axis n is axis order[n].
    fn transpose<T: Copy>(values: &[T], shape: &[usize], order: &[usize]) -> (Vec<T>, Vec<usize>) {
        let strides: Vec<usize> = (0..shape.len()).map(|axis| shape[axis + 1..].iter().product()).collect();
        let new: Vec<usize> = order.iter().map(|&axis| shape[axis]).collect();
        let place = |mut n: usize| {
            let axes = order.iter().rev();
            axes.map(|&axis| (n % shape[axis] * strides[axis], n /= shape[axis]).0).sum::<usize>()
        };
        ((0..values.len()).map(|n| values[place(n)]).collect(), new)
    }

    fn check_deltas<T: Lane>(shape: Shape, channels: usize) {
        let samples = chunk(shape, channels, T::BYTES, 9);
        let difference = |values: &[T]| -> Vec<T> {
            let before = std::iter::once(T::default()).chain(values.iter().copied());
            values.iter().zip(before).map(|(&value, before)| value.minus(before)).collect()
        };
        // As the module says it: axes y, x, l, c.
        let mut values: Vec<T> = samples.chunks_exact(T::BYTES).map(T::from_le).collect();
        if channels > 1 {
            values = difference(&values);
        }
        let extent = [shape.rows, shape.columns, shape.lights, channels];
        let (values, extent) = transpose(&values, &extent, &[3, 0, 2, 1]);
        let (values, extent) = transpose(&difference(&values), &extent, &[0, 2, 3, 1]);
        let (values, _) = transpose(&difference(&values), &extent, &[0, 2, 3, 1]);
        let expected: Vec<u8> =
            (0..T::BYTES).flat_map(|place| values.iter().map(move |value| value.byte(place))).collect();
        for kernel in Kernel::available() {
            let mut deltas = Deltas::<T>::new(kernel, shape, channels);
            let (mut bytes, mut back) = (vec![0; samples.len()], vec![0; samples.len()]);
            deltas.forward(&samples, &mut bytes);
            assert!(bytes == expected, "{kernel:?} {shape:?} {channels}");
            deltas.inverse(&bytes, &mut back);
            assert!(back == samples, "{kernel:?} {shape:?} {channels}");
        }
    }

    #[test]
    fn differences_are_those_of_transpositions_and_flat_deltas() {
        for (rows, columns, lights) in [(16, 16, 81), (3, 5, 7), (2, 2, 1), (1, 4, 3), (4, 1, 2)] {
            for channels in [1, 2, 3] {
                let shape = Shape { rows, columns, lights };
                check_deltas::<u8>(shape, channels);
                check_deltas::<u16>(shape, channels);
            }
        }
    }

    #[test]
    fn every_mode_can_be_undone() {
        let shape = Shape { rows: 4, columns: 5, lights: 19 };
        let residuals = chunk(shape, 3, 1, 0);
        for mode in (0..=u8::MAX).filter_map(Mode::from_byte) {
            let mut first = None;
            for kernel in Kernel::available() {
                let mut predictor = Predictor::<u8>::new(kernel, shape, 3, Numbers::Integer);
                let mut samples = vec![0; residuals.len()];
                predictor.inverse(&residuals, &[mode; 3], &mut samples);
                assert!(*first.get_or_insert_with(|| samples.clone()) == samples, "{mode:?} {kernel:?}");
            }
        }
    }
}
