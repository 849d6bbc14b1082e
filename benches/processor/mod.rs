//! Time of the processor, which hardly depends on who else uses the machine.

use std::fs;

/// Nanoseconds that this thread has run.
fn cpu_ns() -> f64 {
    let text = fs::read_to_string("/proc/thread-self/schedstat").expect("a kernel that counts");
    text.split(' ').next().and_then(|field| field.parse().ok()).expect("a count")
}

/// The median over some runs of processor time for each item, nanoseconds. A run repeats the work until many ticks have
/// passed, by which the kernel counts.
pub(crate) fn median_ns(items: usize, mut work: impl FnMut()) -> f64 {
    const RUNS: usize = 7;
    const RUN_NS: f64 = 3e8;
    work();
    let mut run = || {
        let (start, mut count) = (cpu_ns(), 0);
        loop {
            work();
            count += 1;
            let passed = cpu_ns() - start;
            if passed > RUN_NS {
                return passed / (count * items) as f64;
            }
        }
    };
    let mut times: Vec<f64> = (0..RUNS).map(|_| run()).collect();
    times.sort_by(f64::total_cmp);
    times[RUNS / 2]
}
