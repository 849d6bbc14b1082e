//! An adaptive binary range coder of 32 bits, after that of LZMA, and its probabilities: each bit narrows a range of
//! numbers by how likely it is, and the bytes are a number in the range that is left.

/// Bits of a probability in the coder.
const BITS: u32 = 15;

/// The range never stays below this.
const LEAST: u32 = 1 << 24;

/// How fast the two estimates follow in the end: each takes 2^-shift of the way to what was seen.
const SHIFTS: [u8; 2] = [4, 7];

/// Bits after which nothing changes any more.
const SETTLED: usize = 120;

/// The shifts of both estimates for each of the first bits. They begin low, so that estimates begin as averages of
/// what was seen.
const FIRST_SHIFTS: [[u8; 2]; SETTLED + 1] = {
    let mut shifts = [SHIFTS; SETTLED + 1];
    let mut seen = 0;
    while seen < SETTLED {
        let most = match seen {
            0 => 1,
            1..4 => 2,
            4..9 => 3,
            9..20 => 4,
            20..60 => 5,
            _ => 6,
        };
        let mut estimate = 0;
        while estimate < 2 {
            if SHIFTS[estimate] > most {
                shifts[seen][estimate] = most;
            }
            estimate += 1;
        }
        seen += 1;
    }
    shifts
};

/// The probability of a 0, as two estimates of 16 bits; the coder takes their mean.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Probability {
    estimates: [u16; 2],
    /// Bits that were seen, up to [`SETTLED`].
    seen: u8,
}

impl Default for Probability {
    fn default() -> Self {
        Self { estimates: [1 << 15; 2], seen: 0 }
    }
}

impl Probability {
    /// Of 1 << BITS; never 0 or all.
    #[inline]
    fn of_zero(self) -> u32 {
        let [fast, slow] = self.estimates.map(u32::from);
        ((fast + slow) >> (17 - BITS)).clamp(16, (1 << BITS) - 16)
    }

    #[inline]
    fn learn(&mut self, bit: bool) {
        let seen = usize::from(self.seen).min(SETTLED);
        self.seen += u8::from(seen < SETTLED);
        // A 0 does to what is missing to 65535 what a 1 does to the estimate.
        let turned = if bit { 0 } else { u16::MAX };
        for (estimate, shift) in self.estimates.iter_mut().zip(FIRST_SHIFTS[seen]) {
            let from = *estimate ^ turned;
            *estimate = (from - (from >> shift)) ^ turned;
        }
    }
}

/// The probability of a 0 in the middle between two.
fn mean(pair: &[&mut Probability; 2]) -> u32 {
    let [a, b] = [pair[0].of_zero(), pair[1].of_zero()];
    (a + b) / 2
}

/// Codes one bit after another: both ways share the code that says which.
pub(crate) trait Coder {
    /// A bit of a known probability, which learns from it. An encoder takes `wanted`, a decoder tells.
    fn bit(&mut self, probability: &mut Probability, wanted: bool) -> bool;

    /// A bit of two known probabilities, of which the mean is taken.
    fn bit_of_two(&mut self, pair: [&mut Probability; 2], wanted: bool) -> bool;

    /// A bit that is as likely 0 as 1.
    fn even(&mut self, wanted: bool) -> bool;
}

/// Bits to bytes.
#[derive(Debug)]
pub(crate) struct Encoder {
    low: u64,
    range: u32,
    /// The byte that a carry may still change, and how many 255 follow it. Before the first byte there is none.
    cache: Option<u8>,
    full: usize,
    bytes: Vec<u8>,
}

/// Where an encoder was.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mark {
    low: u64,
    range: u32,
    cache: Option<u8>,
    full: usize,
    length: usize,
}

impl Encoder {
    pub(crate) fn new() -> Self {
        Self { low: 0, range: u32::MAX, cache: None, full: 0, bytes: vec![] }
    }

    /// Where it is.
    pub(crate) fn mark(&self) -> Mark {
        let &Self { low, range, cache, full, ref bytes } = self;
        Mark { low, range, cache, full, length: bytes.len() }
    }

    /// Forgets what came after a mark.
    pub(crate) fn return_to(&mut self, mark: Mark) {
        self.bytes.truncate(mark.length);
        (self.low, self.range, self.cache, self.full) = (mark.low, mark.range, mark.cache, mark.full);
    }

    /// Bits so far.
    pub(crate) fn bits(&self) -> f64 {
        8.0 * (self.bytes.len() + self.full) as f64 + 32.0 - libm::log2(f64::from(self.range))
    }

    /// The bytes. Zeros at the end are left out: a decoder reads zeros beyond it.
    pub(crate) fn finish(mut self) -> Vec<u8> {
        // Of the numbers in the range, the one with most zeros at the end.
        for zeros in (0..32).rev() {
            let mask = (1u64 << zeros) - 1;
            let round = (self.low + mask) & !mask;
            if round < self.low + u64::from(self.range) {
                self.low = round;
                break;
            }
        }
        (0..5).for_each(|_| self.shift());
        while self.bytes.last() == Some(&0) {
            self.bytes.pop();
        }
        self.bytes
    }

    fn shift(&mut self) {
        let carry = (self.low >> 32) as u8;
        if carry == 1 || self.low < 0xff00_0000 {
            if let Some(cache) = self.cache {
                self.bytes.push(cache.wrapping_add(carry));
            }
            self.bytes.extend(core::iter::repeat_n(0xff_u8.wrapping_add(carry), self.full));
            self.full = 0;
            self.cache = Some((self.low >> 24) as u8);
        } else {
            self.full += 1;
        }
        self.low = (self.low << 8) & 0xffff_ffff;
    }

    fn split(&mut self, bound: u32, bit: bool) {
        if bit {
            self.low += u64::from(bound);
            self.range -= bound;
        } else {
            self.range = bound;
        }
        while self.range < LEAST {
            self.range <<= 8;
            self.shift();
        }
    }
}

impl Coder for Encoder {
    fn bit(&mut self, probability: &mut Probability, wanted: bool) -> bool {
        self.split((self.range >> BITS) * probability.of_zero(), wanted);
        probability.learn(wanted);
        wanted
    }

    fn bit_of_two(&mut self, pair: [&mut Probability; 2], wanted: bool) -> bool {
        let of_zero = mean(&pair);
        self.split((self.range >> BITS) * of_zero, wanted);
        pair.into_iter().for_each(|probability| probability.learn(wanted));
        wanted
    }

    fn even(&mut self, wanted: bool) -> bool {
        self.split(self.range >> 1, wanted);
        wanted
    }
}

/// Bytes to bits. Beyond their end it reads zeros, so that any bytes decode to something.
pub(crate) struct Decoder<'a> {
    code: u32,
    range: u32,
    bytes: core::slice::Iter<'a, u8>,
}

impl<'a> Decoder<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        let mut decoder = Self { code: 0, range: u32::MAX, bytes: bytes.iter() };
        (0..4).for_each(|_| decoder.code = decoder.code << 8 | decoder.next());
        decoder
    }

    fn next(&mut self) -> u32 {
        self.bytes.next().map_or(0, |&byte| u32::from(byte))
    }

    #[inline]
    fn split(&mut self, bound: u32) -> bool {
        let bit = self.code >= bound;
        if bit {
            self.code -= bound;
            self.range -= bound;
        } else {
            self.range = bound;
        }
        while self.range < LEAST {
            self.range <<= 8;
            self.code = self.code << 8 | self.next();
        }
        bit
    }
}

impl Coder for Decoder<'_> {
    #[inline]
    fn bit(&mut self, probability: &mut Probability, _: bool) -> bool {
        let bit = self.split((self.range >> BITS) * probability.of_zero());
        probability.learn(bit);
        bit
    }

    #[inline]
    fn bit_of_two(&mut self, pair: [&mut Probability; 2], _: bool) -> bool {
        let bit = self.split((self.range >> BITS) * mean(&pair));
        pair.into_iter().for_each(|probability| probability.learn(bit));
        bit
    }

    #[inline]
    fn even(&mut self, _: bool) -> bool {
        self.split(self.range >> 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bits that are 1 about once in `rarity`, and at the end long runs of the unlikely bit: carries and full bytes.
    fn bits(rarity: u32) -> Vec<bool> {
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            state >> 8
        };
        let drawn = (0..50_000).map(|_| next().is_multiple_of(rarity));
        drawn.chain((0..2000).map(|n| n % 300 < 290)).collect()
    }

    #[test]
    fn bits_come_back_in_nearly_as_many_as_their_entropy() {
        for rarity in [2, 3, 20, 1000] {
            let bits = bits(rarity);
            let mut encoder = Encoder::new();
            let mut probability = Probability::default();
            for (n, &bit) in bits.iter().enumerate() {
                encoder.bit(&mut probability, bit);
                encoder.even(n % 3 == 0);
                if n % 1000 == 999 {
                    // What is taken back leaves no trace.
                    let (mark, kept) = (encoder.mark(), probability);
                    (0..700).for_each(|k| _ = encoder.bit(&mut probability, k % 5 == 0));
                    encoder.return_to(mark);
                    probability = kept;
                }
            }
            let counted = encoder.bits();
            let bytes = encoder.finish();
            assert!((counted / 8.0 - bytes.len() as f64).abs() < 5.0, "{counted} {}", bytes.len());
            let p = 1.0 / f64::from(rarity);
            let entropy = 50_000.0 * -(p * p.log2() + (1.0 - p) * (1.0 - p).log2().max(-9.0));
            assert!(counted < 1.04 * entropy + 52_000.0 + 1200.0, "{rarity}: {counted} {entropy}");
            let mut decoder = Decoder::new(&bytes);
            let mut probability = Probability::default();
            for (n, &bit) in bits.iter().enumerate() {
                assert_eq!(decoder.bit(&mut probability, false), bit, "{n}");
                assert_eq!(decoder.even(false), n % 3 == 0);
            }
        }
    }
}
