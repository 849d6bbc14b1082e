//! The hot loops: plain Rust, always compiled and always the reference, beside SIMD chosen at run time.

pub mod absolute_difference;
pub mod predict;

/// Instructions to use, chosen once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// Whatever the program was compiled for.
    Plain,
    /// AVX2. (AVX-512 was measured for predictions: 5 % slower.)
    #[cfg(target_arch = "x86_64")]
    #[non_exhaustive] // so that only `available` can vouch for it
    Avx2,
}

impl Kernel {
    /// Every kernel that this machine can run, plain first, fastest last.
    pub fn available() -> Vec<Self> {
        #[allow(unused_mut)] // grows on x86 only
        let mut kernels = vec![Self::Plain];
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            kernels.push(Self::Avx2);
        }
        kernels
    }

    /// The fastest of them; `BTFKIT_KERNEL=plain` lowers the choice, to corner a fault.
    pub fn fastest() -> Self {
        let lowered = std::env::var_os("BTFKIT_KERNEL").is_some_and(|name| name == "plain");
        if lowered { Self::Plain } else { Self::available().last().copied().unwrap_or(Self::Plain) }
    }
}
