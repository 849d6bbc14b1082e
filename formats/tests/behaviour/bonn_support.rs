//! Small `.btf` files, field by field, independently of the writer under test.

use btfkit_formats::f16;

/// A file's header and what its samples are, before any colour model.
#[derive(Clone)]
pub(crate) struct Btf {
    pub(crate) version: u32,
    pub(crate) cosine: u32,
    pub(crate) xml: Vec<u8>,
    pub(crate) channels: Vec<String>,
    pub(crate) views: Vec<(f32, f32)>,
    pub(crate) lights: Vec<(f32, f32)>,
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) rotations: Vec<[f32; 9]>,
    pub(crate) rank: usize,
}

/// A list of directions, all different.
pub(crate) fn directions(number: usize) -> Vec<(f32, f32)> {
    (0..number).map(|i| (0.05 * i as f32, 0.3 * i as f32 - 1.0)).collect()
}

pub(crate) fn names(names: &[&str]) -> Vec<String> {
    names.iter().map(|&name| name.to_owned()).collect()
}

impl Btf {
    /// Not a multiple of any block, more lights than views.
    pub(crate) fn medium() -> Btf {
        Btf { lights: directions(6), width: 23, height: 5, rank: 11, ..Btf::small() }
    }

    pub(crate) fn small() -> Btf {
        Btf {
            version: 4,
            cosine: 1,
            xml: Vec::new(),
            channels: names(&["R", "G", "B"]),
            views: directions(2),
            lights: directions(3),
            width: 4,
            height: 2,
            rotations: Vec::new(),
            rank: 2,
        }
    }

    pub(crate) fn pixels(&self) -> usize {
        (self.width * self.height) as usize
    }

    /// Signature to rotations. `with_rotations` says whether their field is there.
    pub(crate) fn head(&self, signature: &str, with_rotations: bool) -> Vec<u8> {
        let mut out = self.description(signature);
        self.put_directions(&mut out);
        put_u32s(&mut out, &[self.width, self.height]);
        if with_rotations {
            self.put_rotations(&mut out);
        }
        out
    }

    fn description(&self, signature: &str) -> Vec<u8> {
        let mut fields = Vec::new();
        put_u32s(&mut fields, &[self.version]);
        for text in ["dome", "", "flash"] {
            let mut field = text.as_bytes().to_vec();
            field.resize(80, 0);
            fields.extend(field);
        }
        put_f32s(&mut fields, &[12.5, 1.0, 1.0, 1.0]);
        if self.version > 1 {
            put_u32s(&mut fields, &[self.cosine]);
        }
        if self.version > 2 {
            put_u32s(&mut fields, &[self.xml.len() as u32]);
            fields.extend(&self.xml);
        }
        if self.version > 3 {
            put_u32s(&mut fields, &[self.channels.len() as u32]);
            for name in &self.channels {
                put_u32s(&mut fields, &[name.len() as u32]);
                fields.extend(name.as_bytes());
            }
        }
        let mut out = signature.as_bytes().to_vec();
        put_u32s(&mut out, &[fields.len() as u32 + 4]);
        out.extend(fields);
        out
    }

    pub(crate) fn put_directions(&self, out: &mut Vec<u8>) {
        put_u32s(out, &[self.views.len() as u32]);
        for &(theta, phi) in &self.views {
            put_f32s(out, &[theta, phi]);
            put_u32s(out, &[self.lights.len() as u32]);
            for &(theta, phi) in &self.lights {
                put_f32s(out, &[theta, phi]);
            }
        }
    }

    fn put_rotations(&self, out: &mut Vec<u8>) {
        put_u32s(out, &[self.rotations.len() as u32]);
        for rotation in &self.rotations {
            put_f32s(out, rotation);
        }
    }

    /// A component of a direction pair in a channel: a multiple of 1/4, so that all sums are exact in f16.
    pub(crate) fn left(&self, view: usize, light: usize, channel: usize, component: usize) -> f64 {
        quarter(view * 31 + light * 7 + channel * 3 + component * 5)
    }

    /// A component of a pixel. `channel` is 0 where all channels share it.
    pub(crate) fn right(&self, pixel: usize, channel: usize, component: usize) -> f64 {
        quarter(pixel * 11 + channel * 2 + component * 13 + 1)
    }

    fn product(&self, [view, light, pixel]: [usize; 3], channel: usize, right_channel: usize) -> f64 {
        let components = 0..self.rank;
        components.map(|k| self.left(view, light, channel, k) * self.right(pixel, right_channel, k)).sum()
    }

    /// What a DFMF file of colour model 0 holds.
    pub(crate) fn dfmf_value(&self, at: [usize; 3], channel: usize) -> f64 {
        self.product(at, channel, channel)
    }

    /// What an FMF file holds, before its range is expanded.
    pub(crate) fn fmf_value(&self, at: [usize; 3], channel: usize) -> f64 {
        self.product(at, channel, 0)
    }

    /// What a PVF file holds: its left rows are lights and channels.
    pub(crate) fn pvf_value(&self, at: [usize; 3], channel: usize) -> f64 {
        let [view, light, _] = at;
        self.product(at, channel, 0) + self.mean(view, light, channel)
    }

    fn mean(&self, view: usize, left: usize, channel: usize) -> f64 {
        quarter(view * 3 + left * 5 + channel)
    }

    /// All images of a view, `[light, pixel, channel]`.
    pub(crate) fn images(&self, view: usize, value: impl Fn([usize; 3], usize) -> f64) -> Vec<f32> {
        let mut samples = Vec::new();
        for light in 0..self.lights.len() {
            for pixel in 0..self.pixels() {
                for channel in 0..self.channels.len() {
                    samples.push(value([view, light, pixel], channel) as f32);
                }
            }
        }
        samples
    }

    /// All direction pairs, views outermost.
    fn pairs(&self) -> impl Iterator<Item = (usize, usize)> {
        let lights = self.lights.len();
        (0..self.views.len()).flat_map(move |view| (0..lights).map(move |light| (view, light)))
    }

    /// The payload of a DFMF file.
    pub(crate) fn dfmf(&self, size: u8, model: i32, transposed: bool) -> Vec<u8> {
        let mut out = Vec::new();
        put_u32s(&mut out, &[self.rank as u32]);
        out.extend(model.to_le_bytes());
        put_f32s(&mut out, &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        for channel in 0..self.channels.len() {
            let directions = self.matrix(self.pairs(), |(v, l), k| self.left(v, l, channel, k));
            let pixels = self.matrix(0..self.pixels(), |pixel, k| self.right(pixel, channel, k));
            put_product(&mut out, size, self.rank, transposed, directions, pixels);
        }
        out
    }

    /// The payload of an FMF file, from the rank on.
    pub(crate) fn fmf(&self, size: u8, transposed: bool) -> Vec<u8> {
        let mut out = Vec::new();
        put_u32s(&mut out, &[self.rank as u32]);
        // Transposed, the channel is on the side of the pixels; the value is the same function of all five.
        let channels = 0..self.channels.len();
        let (directions, pixels) = if transposed {
            let rows = (0..self.pixels()).flat_map(|p| channels.clone().map(move |c| (p, c)));
            let pixels = self.matrix(rows, |(pixel, c), k| self.right(pixel, c, k));
            (self.matrix(self.pairs(), |(v, l), k| self.left(v, l, 0, k)), pixels)
        } else {
            let rows = self.pairs().flat_map(|pair| channels.clone().map(move |c| (pair, c)));
            let directions = self.matrix(rows, |((v, l), c), k| self.left(v, l, c, k));
            (directions, self.matrix(0..self.pixels(), |pixel, k| self.right(pixel, 0, k)))
        };
        put_product(&mut out, size, self.rank, transposed, directions, pixels);
        out
    }

    /// What a transposed FMF file holds.
    pub(crate) fn transposed_fmf_value(&self, at: [usize; 3], channel: usize) -> f64 {
        self.product(at, 0, channel)
    }

    /// The slots of a PVF file.
    pub(crate) fn pvf_slots(&self, size: u8, transposed: bool) -> Vec<u8> {
        let mut out = Vec::new();
        let (lights, pixels, channels) = (self.lights.len(), self.pixels(), self.channels.len());
        for view in 0..self.views.len() {
            let (left, right) = if transposed { (pixels, lights) } else { (lights, pixels) };
            let rows = || (0..left).flat_map(|row| (0..channels).map(move |c| (row, c)));
            out.push(size);
            put_u32s(&mut out, &[self.rank as u32, right as u32, (left * channels) as u32]);
            put_scalars(&mut out, size, &vec![1.0; self.rank]);
            let means: Vec<f64> = rows().map(|(row, c)| self.mean(view, row, c)).collect();
            put_scalars(&mut out, size, &means);
            let (components, weights) = if transposed {
                let components = self.matrix(rows(), |(pixel, c), k| self.right(pixel, c, k));
                (components, self.matrix(0..lights, |light, k| self.left(view, light, 0, k)))
            } else {
                let components = self.matrix(rows(), |(light, c), k| self.left(view, light, c, k));
                (components, self.matrix(0..pixels, |pixel, k| self.right(pixel, 0, k)))
            };
            put_scalars(&mut out, size, &components);
            put_scalars(&mut out, size, &weights);
        }
        out
    }

    /// What a transposed PVF file holds: its left rows are pixels and channels.
    pub(crate) fn transposed_pvf_value(&self, at: [usize; 3], channel: usize) -> f64 {
        let [view, _, pixel] = at;
        self.product(at, 0, channel) + self.mean(view, pixel, channel)
    }

    /// The payload of a PVF file with a common header.
    pub(crate) fn pvf(&self, size: u8, transposed: bool) -> Vec<u8> {
        let mut out = Vec::new();
        put_u32s(&mut out, &[self.rank as u32, self.views.len() as u32]);
        out.extend(self.pvf_slots(size, transposed));
        out
    }

    /// A whole BDI file of chunks of one scan line; `present` says which pixels are there.
    pub(crate) fn bdi(&self, compression: u8, present: impl Fn(usize) -> bool) -> Vec<u8> {
        let mut out = self.head("!BDIF06R2!", false);
        put_u32s(&mut out, &[1]);
        out.push(compression);
        out.extend((0..self.pixels()).map(|pixel| u8::from(present(pixel))));
        self.put_rotations(&mut out);
        let stored: Vec<usize> =
            (0..self.pixels()).filter(|&pixel| compression != 2 || present(pixel)).collect();
        for chunk in stored.chunks(self.width as usize) {
            let mut bytes = Vec::new();
            for &pixel in chunk {
                for (view, light) in self.pairs() {
                    for channel in 0..self.channels.len() {
                        let value = self.dfmf_value([view, light, pixel], channel);
                        bytes.extend(f16::from_f64(value).to_le_bytes());
                    }
                }
            }
            put_u32s(&mut out, &[bytes.len() as u32]);
            out.extend(bytes);
        }
        out
    }

    fn matrix<R: Copy>(&self, rows: impl Iterator<Item = R>, entry: impl Fn(R, usize) -> f64) -> Vec<f64> {
        rows.flat_map(|row| (0..self.rank).map(move |k| (row, k))).map(|(row, k)| entry(row, k)).collect()
    }
}

fn quarter(hash: usize) -> f64 {
    f64::from(((hash * 2_654_435_761) >> 7) as u8) % 9.0 / 4.0 - 1.0
}

fn put_product(out: &mut Vec<u8>, size: u8, rank: usize, transposed: bool, a: Vec<f64>, b: Vec<f64>) {
    let (left, right) = if transposed { (b, a) } else { (a, b) };
    out.push(size);
    put_u32s(out, &[rank as u32, (left.len() / rank) as u32, (right.len() / rank) as u32]);
    put_scalars(out, size, &vec![1.0; rank]);
    put_scalars(out, size, &left);
    put_scalars(out, size, &right);
}

pub(crate) fn put_u32s(out: &mut Vec<u8>, values: &[u32]) {
    out.extend(values.iter().flat_map(|value| value.to_le_bytes()));
}

pub(crate) fn put_f32s(out: &mut Vec<u8>, values: &[f32]) {
    out.extend(values.iter().flat_map(|value| value.to_le_bytes()));
}

pub(crate) fn put_scalars(out: &mut Vec<u8>, size: u8, values: &[f64]) {
    for &value in values {
        match size {
            2 => out.extend(f16::from_f64(value).to_le_bytes()),
            4 => out.extend((value as f32).to_le_bytes()),
            _ => out.extend(value.to_le_bytes()),
        }
    }
}
