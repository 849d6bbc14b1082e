//! A small MLVQ database, written field by field, independently of the reader.

/// Values of one table of real numbers: byte q stands for min + q (max - min) / 256.
#[derive(Clone)]
pub(crate) struct Reals {
    pub(crate) columns: usize,
    pub(crate) min: f32,
    pub(crate) max: f32,
    pub(crate) q: Vec<u8>,
}

/// Values of one table of whole numbers, with the range that its header claims.
#[derive(Clone)]
pub(crate) struct Ints {
    pub(crate) columns: usize,
    pub(crate) values: Vec<i32>,
}

/// All that a database holds. Sizes of tables are taken from the tables.
#[derive(Clone)]
pub(crate) struct Sketch {
    pub(crate) width: usize,
    pub(crate) slices_6d: Ints,
    pub(crate) scale_6d: Reals,
    pub(crate) luminance_1d: Reals,
    pub(crate) colors: Reals,
    pub(crate) color_rows: Ints,
    pub(crate) slices_2d: Ints,
    pub(crate) scale_2d: Reals,
    pub(crate) colors_2d: Ints,
    pub(crate) indices_2d: Ints,
    pub(crate) slices_3d: Ints,
    pub(crate) scale_3d: Reals,
    pub(crate) slices_4d: Ints,
    pub(crate) scale_4d: Reals,
    /// Lines of the header by number, in place of the right ones.
    pub(crate) lines: Vec<(usize, String)>,
}

pub(crate) fn reals(columns: usize, min: f32, max: f32, q: &[u8]) -> Reals {
    Reals { columns, min, max, q: q.to_vec() }
}

pub(crate) fn constant(columns: usize, rows: usize, value: f32) -> Reals {
    Reals { columns, min: value, max: value, q: vec![0; columns * rows] }
}

pub(crate) fn ints(columns: usize, values: &[i32]) -> Ints {
    Ints { columns, values: values.to_vec() }
}

/// 3 x 2 pixels, one 4D function; 5 nodes of beta, 3 of alpha, 3 of view theta, 4 of view phi. Everything is
/// grey of luminance 100 and every factor 1.
pub(crate) fn grey() -> Sketch {
    Sketch {
        width: 3,
        slices_6d: ints(3, &[1; 6]),
        scale_6d: constant(3, 2, 1.0),
        luminance_1d: constant(5, 1, 0.2),
        colors: constant(2, 1, 128.0),
        color_rows: ints(5, &[0; 5]),
        slices_2d: ints(3, &[0; 3]),
        scale_2d: constant(3, 1, 500.0),
        colors_2d: ints(3, &[0; 3]),
        indices_2d: ints(2, &[0; 2]),
        slices_3d: ints(3, &[0; 3]),
        scale_3d: constant(3, 1, 1.0),
        slices_4d: ints(4, &[0; 4]),
        scale_4d: constant(4, 1, 1.0),
        lines: Vec::new(),
    }
}

impl Reals {
    fn rows(&self) -> usize {
        self.q.len() / self.columns
    }

    fn bytes(&self) -> Vec<u8> {
        let mut out = Vec::new();
        out.extend(self.min.to_le_bytes());
        out.extend(self.max.to_le_bytes());
        out.extend((self.rows() as i32).to_le_bytes());
        out.extend((self.columns as i32).to_le_bytes());
        out.extend(&self.q);
        out.resize(16 + 4 * (self.q.len() * 8 / 32 + 1), 0);
        out
    }
}

impl Ints {
    fn rows(&self) -> usize {
        self.values.len() / self.columns
    }

    fn bytes(&self) -> Vec<u8> {
        let (min, max) = (*self.values.iter().min().unwrap(), *self.values.iter().max().unwrap());
        let mut bits_of_one = 0;
        while (1i64 << bits_of_one) <= i64::from(max - min) {
            bits_of_one += 1;
        }
        let mut bits = Vec::new();
        for value in &self.values {
            bits.extend((0..bits_of_one).map(|bit| (value - min) >> bit & 1 == 1));
        }
        let mut packed = vec![0u8; 4 * (bits.len() / 32 + 1)];
        for (at, _) in bits.iter().enumerate().filter(|(_, bit)| **bit) {
            packed[at / 8] |= 1 << (at % 8);
        }
        let mut out = Vec::new();
        out.extend(min.to_le_bytes());
        out.extend(max.to_le_bytes());
        out.extend(packed);
        out
    }
}

impl Sketch {
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let height = self.slices_6d.rows();
        let mut lines: Vec<String> =
            ["4627", "1", "./01base/grey/", "1", "1", "1", "0", "0", "2", "81", "81", "32"]
                .map(String::from)
                .to_vec();
        lines.push(format!(
            "1 {} 0 {} 0 {} 0 {} 0 0 0 0",
            self.luminance_1d.columns, self.scale_2d.columns, self.scale_3d.columns, self.scale_4d.columns
        ));
        lines.push("0 0 0 0 0 0 0 0 0 0".into());
        lines.push(format!(
            "{} {} {} {} {} {} {} 0 {} 0",
            self.luminance_1d.rows(),
            self.colors.rows(),
            self.color_rows.rows(),
            self.indices_2d.rows(),
            self.slices_2d.rows(),
            self.colors_2d.rows(),
            self.slices_3d.rows(),
            self.slices_4d.rows(),
        ));
        lines.push(
            "2 0.006500 0.900000 0.005200 0.005850 0.950000 0.920000 0.005980 0.970000 0.900000 1.0 0.0"
                .into(),
        );
        lines.push(String::new());
        lines.push(format!("grey ./in/grey/ ./out/grey/ ./tmp/grey/ 0 0 {height} {} 0.000000", self.width));
        for (number, line) in &self.lines {
            lines[*number] = line.clone();
        }
        let mut out = Vec::new();
        for line in lines {
            out.extend(line.as_bytes());
            out.push(b'\n');
        }
        out.extend(self.slices_6d.bytes());
        out.extend(self.scale_6d.bytes());
        out.extend(self.luminance_1d.bytes());
        out.extend(self.colors.bytes());
        out.extend(self.color_rows.bytes());
        out.extend(self.slices_2d.bytes());
        out.extend(self.scale_2d.bytes());
        out.extend(self.colors_2d.bytes());
        out.extend(self.indices_2d.bytes());
        out.extend(self.slices_3d.bytes());
        out.extend(self.scale_3d.bytes());
        out.extend(self.slices_4d.bytes());
        out.extend(self.scale_4d.bytes());
        out
    }
}
