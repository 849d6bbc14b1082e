//! The same coefficients in every arrangement of scans that a sequential JPEG may have decode to the same samples.

use btfkit_formats::jpeg::{check, decode};
use btfkit_formats::{ErrorKind, Limits};

type Block = [i16; 64];

/// A picture as its coefficients: the blocks of each component in rows, those beyond the picture too.
struct Coefficients {
    width: u16,
    height: u16,
    /// Sampling factors of each component, and the largest.
    factors: Vec<(usize, usize)>,
    most: (usize, usize),
    blocks: Vec<Vec<Block>>,
}

impl Coefficients {
    fn new(width: u16, height: u16, factors: &[(usize, usize)]) -> Coefficients {
        let most = (factors.iter().map(|f| f.0).max().unwrap(), factors.iter().map(|f| f.1).max().unwrap());
        let mut made = Coefficients { width, height, factors: factors.to_vec(), most, blocks: Vec::new() };
        let (across, down) = made.units();
        let mut state = 12345u32;
        let mut random = |below: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            i16::try_from((state >> 8) % below).unwrap()
        };
        made.blocks = factors
            .iter()
            .map(|&(h, v)| {
                let block = |_| {
                    let mut block = [0; 64];
                    block[0] = random(800) - 400;
                    for _ in 0..4 {
                        block[usize::try_from(1 + random(63)).unwrap()] = random(81) - 40;
                    }
                    block
                };
                (0..across * h * down * v).map(block).collect()
            })
            .collect();
        made
    }

    fn units(&self) -> (usize, usize) {
        let units = |length: u16, most: usize| usize::from(length).div_ceil(8 * most);
        (units(self.width, self.most.0), units(self.height, self.most.1))
    }

    /// The blocks of a scan in its order, each with its component, unit by unit.
    fn order(&self, scan: &[usize]) -> Vec<Vec<(usize, &Block)>> {
        let (across, down) = self.units();
        let at = |component: usize, row: usize, column: usize| {
            (component, &self.blocks[component][row * across * self.factors[component].0 + column])
        };
        if let &[only] = scan {
            let (h, v) = self.factors[only];
            let rows = (usize::from(self.height) * v).div_ceil(8 * self.most.1);
            let columns = (usize::from(self.width) * h).div_ceil(8 * self.most.0);
            return (0..rows * columns).map(|n| vec![at(only, n / columns, n % columns)]).collect();
        }
        let unit = |n: usize| {
            let (row, column) = (n / across, n % across);
            let of = |&component: &usize| {
                let (h, v) = self.factors[component];
                (0..h * v)
                    .map(move |k| at(component, row * v + k / h, column * h + k % h))
                    .collect::<Vec<_>>()
            };
            scan.iter().flat_map(of).collect()
        };
        (0..across * down).map(unit).collect()
    }

    /// A sequential JPEG of these scans; 0 is no restarts.
    fn written(&self, scans: &[&[usize]], restart: u16) -> Vec<u8> {
        let mut out = vec![0xFF, 0xD8];
        let segment = |out: &mut Vec<u8>, code: u8, data: &[u8]| {
            out.extend([0xFF, code]);
            out.extend(u16::try_from(data.len() + 2).unwrap().to_be_bytes());
            out.extend(data);
        };
        segment(&mut out, 0xDB, &[&[0][..], &[1; 64]].concat());
        let mut frame = vec![8];
        frame.extend(self.height.to_be_bytes());
        frame.extend(self.width.to_be_bytes());
        frame.push(u8::try_from(self.factors.len()).unwrap());
        for (id, &(h, v)) in (1u8..).zip(&self.factors) {
            frame.extend([id, u8::try_from(h << 4 | v).unwrap(), 0]);
        }
        segment(&mut out, 0xC0, &frame);
        // Codes of one length: 12 sizes of means; 16 runs of 10 sizes, the end of a block and 16 zeros.
        let table = |slot: u8, length: usize, symbols: &[u8]| {
            let mut counts = [0; 16];
            counts[length - 1] = u8::try_from(symbols.len()).unwrap();
            [&[slot][..], &counts, symbols].concat()
        };
        let means: Vec<u8> = (0..12).collect();
        let others: Vec<u8> =
            (0..=255).filter(|s| matches!(s & 15, 1..=10) || matches!(s, 0 | 0xF0)).collect();
        segment(&mut out, 0xC4, &table(0, 4, &means));
        segment(&mut out, 0xC4, &table(0x10, 8, &others));
        if restart > 0 {
            segment(&mut out, 0xDD, &restart.to_be_bytes());
        }
        for scan in scans {
            let mut head = vec![u8::try_from(scan.len()).unwrap()];
            head.extend(scan.iter().flat_map(|&c| [u8::try_from(c + 1).unwrap(), 0]));
            head.extend([0, 63, 0]);
            segment(&mut out, 0xDA, &head);
            let mut bits = Bits { out: &mut out, held: 0, count: 0 };
            let mut means = [0; 4];
            for (number, unit) in self.order(scan).into_iter().enumerate() {
                if restart > 0 && number > 0 && number % usize::from(restart) == 0 {
                    bits.fill();
                    let marker = (number / usize::from(restart) - 1) % 8;
                    bits.out.extend([0xFF, 0xD0 + u8::try_from(marker).unwrap()]);
                    means = [0; 4];
                }
                for (component, block) in unit {
                    bits.block(block, &mut means[component], &others);
                }
            }
            bits.fill();
        }
        out.extend([0xFF, 0xD9]);
        out
    }
}

struct Bits<'a> {
    out: &'a mut Vec<u8>,
    held: u32,
    count: u32,
}

impl Bits<'_> {
    fn push(&mut self, value: u32, length: u32) {
        for place in (0..length).rev() {
            self.held = self.held << 1 | (value >> place & 1);
            self.count += 1;
            if self.count == 8 {
                let byte = u8::try_from(self.held & 255).unwrap();
                self.out.push(byte);
                self.out.extend((byte == 255).then_some(0));
                self.count = 0;
            }
        }
    }

    fn fill(&mut self) {
        while self.count > 0 {
            self.push(1, 1);
        }
    }

    fn number(value: i32) -> (u32, u32) {
        let size = 32 - value.unsigned_abs().leading_zeros();
        let bits = if value < 0 { value + (1 << size) - 1 } else { value };
        (u32::try_from(bits).unwrap(), size)
    }

    fn block(&mut self, block: &Block, mean: &mut i32, symbols: &[u8]) {
        let (bits, size) = Self::number(i32::from(block[0]) - *mean);
        *mean = i32::from(block[0]);
        self.push(size, 4);
        self.push(bits, size);
        let code = |symbol: u32| {
            let at = symbols.iter().position(|&known| u32::from(known) == symbol).unwrap();
            u32::try_from(at).unwrap()
        };
        let mut run = 0;
        for &value in &block[1..] {
            if value == 0 {
                run += 1;
                continue;
            }
            while run > 15 {
                self.push(code(0xF0), 8);
                run -= 16;
            }
            let (bits, size) = Self::number(i32::from(value));
            self.push(code(run << 4 | size), 8);
            self.push(bits, size);
            run = 0;
        }
        if run > 0 {
            self.push(code(0), 8);
        }
    }
}

const SIZES: [(u16, u16); 9] =
    [(1, 1), (8, 8), (9, 17), (16, 16), (17, 16), (24, 40), (33, 31), (40, 1), (1, 40)];
const FACTORS: [[(usize, usize); 3]; 9] = [
    [(1, 1), (1, 1), (1, 1)],
    [(2, 1), (1, 1), (1, 1)],
    [(1, 2), (1, 1), (1, 1)],
    [(2, 2), (1, 1), (1, 1)],
    [(4, 1), (1, 1), (1, 1)],
    [(4, 2), (1, 1), (1, 1)],
    [(2, 1), (2, 1), (2, 1)],
    [(2, 2), (1, 2), (1, 2)],
    [(2, 2), (2, 1), (1, 2)],
];
const SCANS: [&[&[usize]]; 7] = [
    &[&[0], &[1], &[2]],
    &[&[2], &[0], &[1]],
    &[&[0], &[1, 2]],
    &[&[1, 2], &[0]],
    &[&[0, 1], &[2]],
    &[&[0, 2], &[1]],
    &[&[0, 1, 2]],
];

fn samples(bytes: &[u8]) -> Vec<u8> {
    check(bytes, &Limits::default()).unwrap();
    decode(bytes, &Limits::default()).unwrap().samples
}

#[test]
fn scans_in_any_arrangement_are_the_picture_interleaved() {
    for (width, height) in SIZES {
        for factors in FACTORS {
            let picture = Coefficients::new(width, height, &factors);
            let expected = samples(&picture.written(&[&[0, 1, 2]], 0));
            for scans in SCANS {
                for restart in [0, 1, 3] {
                    let found = samples(&picture.written(scans, restart));
                    assert_eq!(found, expected, "{width} x {height}, {factors:?}, {scans:?}, {restart}");
                }
            }
        }
    }
}

/// The same file with the ids R, G and B.
fn named_rgb(plain: &[u8]) -> Vec<u8> {
    let mut bytes = plain.to_vec();
    let after = |code: u8| {
        let markers = plain.windows(2).enumerate().filter(move |(_, pair)| *pair == [0xFF, code]);
        markers.map(|(at, _)| at + 4)
    };
    let frame = after(0xC0).next().unwrap();
    let scans = after(0xDA).flat_map(|at| (0..usize::from(plain[at])).map(move |n| at + 1 + 2 * n));
    for at in (0..3).map(|n| frame + 6 + 3 * n).chain(scans) {
        bytes[at] = b"RGB"[usize::from(plain[at]) - 1];
    }
    bytes
}

#[test]
fn ids_of_colours_count_where_no_segment_does_however_scans_are_arranged() {
    let picture = Coefficients::new(17, 9, &[(1, 1); 3]);
    let insert = |bytes: &[u8], segment: &[u8]| [&bytes[..2], segment, &bytes[2..]].concat();
    let jfif = b"\xFF\xE0\0\x10JFIF\0\x01\x01\0\0\x01\0\x01\0\0";
    let adobe = |transform: u8| [b"\xFF\xEE\0\x0EAdobe\0\x64\0\0\0\0", &[transform][..]].concat();
    for scans in [&[&[0, 1, 2][..]][..], &[&[0], &[1], &[2]], &[&[0, 1], &[2]], &[&[1, 2], &[0]]] {
        let plain = picture.written(scans, 0);
        let named = named_rgb(&plain);
        let (ycbcr, rgb) = (samples(&plain), samples(&insert(&plain, &adobe(0))));
        assert_ne!(ycbcr, rgb);
        assert_eq!(samples(&named), rgb, "{scans:?}");
        assert_eq!(samples(&insert(&named, jfif)), ycbcr, "{scans:?}");
        assert_eq!(samples(&insert(&named, &adobe(1))), ycbcr, "{scans:?}");
        assert_eq!(samples(&insert(&insert(&named, &adobe(0)), jfif)), ycbcr, "{scans:?}");
    }
}

#[test]
fn factors_that_all_components_share_mean_nothing() {
    for (width, height) in SIZES {
        let expected = samples(&Coefficients::new(width, height, &[(1, 1)]).written(&[&[0]], 0));
        for factor in [(2, 2), (1, 4), (3, 1), (4, 3)] {
            let mut picture = Coefficients::new(width, height, &[(1, 1)]);
            (picture.factors, picture.most) = (vec![factor], factor);
            // A scan of one component is in the order of its blocks, whatever the factors.
            let across = picture.units().0 * factor.0;
            let old = Coefficients::new(width, height, &[(1, 1)]);
            let (columns, rows) = old.units();
            let mut blocks = vec![[0; 64]; across * picture.units().1 * factor.1];
            for row in 0..rows {
                for column in 0..columns {
                    blocks[row * across + column] = old.blocks[0][row * columns + column];
                }
            }
            picture.blocks = vec![blocks];
            assert_eq!(samples(&picture.written(&[&[0]], 0)), expected, "{width} x {height}, {factor:?}");
        }
        // More blocks than a unit of several components may have: only in scans of their own.
        let picture = Coefficients::new(width, height, &[(2, 2); 3]);
        let apart = picture.written(&[&[0], &[1], &[2]], 2);
        assert_eq!(samples(&apart), samples(&picture.written(&[&[1], &[2], &[0]], 0)));
        let together = picture.written(&[&[0, 1, 2]], 0);
        assert_eq!(decode(&together, &Limits::default()).unwrap_err().kind(), ErrorKind::Malformed);
    }
}

#[test]
fn other_samplings_are_refused() {
    for factors in [
        [(1, 1), (2, 1), (2, 1)],
        [(1, 1), (2, 2), (2, 2)],
        [(1, 1), (1, 1), (2, 2)],
        [(3, 1), (1, 1), (1, 1)],
    ] {
        let picture = Coefficients::new(33, 31, &factors);
        for scans in SCANS {
            let error = decode(&picture.written(scans, 0), &Limits::default()).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Unsupported, "{factors:?}: {error}");
        }
    }
}

#[test]
fn scattered_scans_that_are_cut_or_too_long_are_refused() {
    let picture = Coefficients::new(33, 31, &FACTORS[3]);
    let whole = picture.written(SCANS[0], 0);
    let scans: Vec<usize> =
        whole.windows(2).enumerate().filter(|(_, pair)| *pair == [0xFF, 0xDA]).map(|(at, _)| at).collect();
    for end in [scans[1], scans[2], whole.len() - 2] {
        // Twenty bytes of the scan are gone, and it is still long enough for one bit a code.
        let cut = [&whole[..end - 20], &whole[end..]].concat();
        let error = decode(&cut, &Limits::default()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Malformed, "{error}");
        let long = [&whole[..end], &[0; 20], &whole[end..]].concat();
        let error = decode(&long, &Limits::default()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Malformed, "{error}");
    }
}
