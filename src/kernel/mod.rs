//! The hot loops: plain Rust, always compiled and always the reference, beside SIMD chosen at run time.

pub(crate) mod absolute_difference;
pub mod bounds;
pub mod car;
pub mod coherent;
pub(crate) mod collapse;
pub mod counting;
pub mod noise;
pub(crate) mod philox;
pub mod predict;
pub mod project;
pub(crate) mod ranking;

/// Instructions to use, chosen once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// Whatever the program was compiled for.
    Plain,
    /// AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    #[non_exhaustive] // so that only `available` can vouch for it
    Avx2,
    /// AVX-512 (F, BW and VL), and AVX2 where loops gain nothing from longer vectors.
    #[cfg(target_arch = "x86_64")]
    #[non_exhaustive]
    Avx512,
}

impl Kernel {
    /// Every kernel that this machine can run, plain first, fastest last.
    pub fn available() -> Vec<Self> {
        #[allow(unused_mut)] // grows on x86 only
        let mut kernels = vec![Self::Plain];
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
            kernels.push(Self::Avx2);
            let found = |features: [bool; 3]| features == [true; 3];
            if found([
                std::arch::is_x86_feature_detected!("avx512f"),
                std::arch::is_x86_feature_detected!("avx512bw"),
                std::arch::is_x86_feature_detected!("avx512vl"),
            ]) {
                kernels.push(Self::Avx512);
            }
        }
        kernels
    }

    /// The fastest of them; `BTFKIT_KERNEL=plain` or `avx2` lowers the choice, to corner a fault.
    pub fn fastest() -> Self {
        let lowered = std::env::var("BTFKIT_KERNEL").unwrap_or_default();
        let available = Self::available();
        let named = available.iter().find(|kernel| format!("{kernel:?}").eq_ignore_ascii_case(&lowered));
        named.or(available.last()).copied().unwrap_or(Self::Plain)
    }
}

/// The value of one of three calls, by the kernel: the plain one, one compiled with AVX2, one compiled with AVX-512.
/// Where longer vectors gain nothing, the last two are the same. All choices between kernels are made here.
macro_rules! dispatch {
    ($kernel:expr; $plain:expr, $avx2:expr, $avx512:expr $(,)?) => {
        match $kernel {
            $crate::kernel::Kernel::Plain => $plain,
            #[cfg(target_arch = "x86_64")]
            #[allow(unsafe_code)]
            // SAFETY: a kernel is only ever constructed after its features were found.
            $crate::kernel::Kernel::Avx2 => unsafe { $avx2 },
            #[cfg(target_arch = "x86_64")]
            #[allow(unsafe_code)]
            // SAFETY: as above; what has AVX-512 has AVX2.
            $crate::kernel::Kernel::Avx512 => unsafe { $avx512 },
        }
    };
}
pub(crate) use dispatch;

/// Defines a function for each kernel from one body of plain Rust: compiled once for the target and once more for
/// each set of instructions, chosen by `kernel`. The body is what the compiler vectorises.
macro_rules! compiled_for_each_kernel {
    ($(#[$meta:meta])* $vis:vis fn $name:ident($($argument:ident: $kind:ty),* $(,)?) $(-> $result:ty)? = $body:path) => {
        $(#[$meta])*
        $vis fn $name(kernel: $crate::kernel::Kernel, $($argument: $kind),*) $(-> $result)? {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma")]
            fn avx2($($argument: $kind),*) $(-> $result)? {
                $body($($argument),*)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f,avx512bw,avx512vl,fma")]
            fn avx512($($argument: $kind),*) $(-> $result)? {
                $body($($argument),*)
            }
            $crate::kernel::dispatch!(kernel; $body($($argument),*), avx2($($argument),*), avx512($($argument),*))
        }
    };
}
pub(crate) use compiled_for_each_kernel;
