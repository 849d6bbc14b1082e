//! What the zero bytes of the tables of real numbers stand for.
//!
//! A zero byte is the minimum of its table or its maximum. Three facts tell them apart:
//!
//! 1. Each table has an entry at its minimum and one at its maximum, by the definition of both.
//! 2. A 1D luminance function is a density: its row sums to 1, up to the quantisation.
//! 3. A scale was chosen so that the function that it scales keeps the mean of the function that was measured. What
//!    was measured is continuous: over alpha, view theta, view phi, and over the surface. So the scaled mean at the
//!    entry should be the mean of the scaled means beside it. A colour, likewise, is near to those that stand beside it
//!    in functions over beta.
//!
//! Facts 2 and 3 give for every entry a wanted value; the nearer end of the range is taken. If that leaves a table
//! without one of its ends, the entry that was decided most narrowly goes the other way.

use super::functions::Functions;
use super::table::FloatTable;
use crate::words::counted;
use crate::{Error, ErrorKind, Result};

/// Tables that have zero bytes, by the names in the encoder's text files.
const TABLES: [&str; 6] = ["PDF6Dscale", "PDF1Dslice", "colors", "PDF2Dscale", "PDF3Dscale", "PDF4Dscale"];

/// What is known from elsewhere about zero bytes, in place of the rule.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ZeroBytes {
    entries: Vec<Entry>,
}

#[derive(Debug, Clone, PartialEq)]
struct Entry {
    table: &'static str,
    row: usize,
    column: usize,
    value: f64,
}

impl ZeroBytes {
    /// Reads lines `table row column value`, with anything after the fourth word; `#` starts a comment. Tables are
    /// `PDF6Dscale`, `PDF1Dslice`, `colors`, `PDF2Dscale`, `PDF3Dscale` and `PDF4Dscale`, rows and columns count from
    /// 0, and the value is the table's minimum or maximum.
    ///
    /// # Errors
    /// [`ErrorKind::Malformed`], with the byte where the line starts: another table, a word missing, not a number, an
    /// entry twice.
    ///
    /// ```
    /// use btfkit_formats::mlvq::ZeroBytes;
    ///
    /// let known = ZeroBytes::parse("# table row col value source\nPDF3Dscale 266 0 0.824761 text\n").unwrap();
    /// assert_eq!(known.len(), 1);
    /// assert!(ZeroBytes::parse("PDF5Dscale 0 0 1.0").is_err());
    /// ```
    pub fn parse(text: &str) -> Result<ZeroBytes> {
        let mut entries: Vec<Entry> = Vec::new();
        let mut at = 0usize;
        for line in text.split_inclusive('\n') {
            let wrong =
                |expected: &'static str| Error::malformed(format!("{:?}", line.trim()), expected).at(at);
            let content = line.split('#').next().unwrap_or_default().trim();
            if !content.is_empty() {
                let mut words = content.split_whitespace();
                let table = words.next().and_then(|word| TABLES.into_iter().find(|&table| table == word));
                let row = words.next().and_then(|word| word.parse().ok());
                let column = words.next().and_then(|word| word.parse().ok());
                let value = words.next().and_then(|word| word.parse().ok()).filter(|v: &f64| v.is_finite());
                let (Some(table), Some(row), Some(column), Some(value)) = (table, row, column, value) else {
                    return Err(wrong("a table of real numbers, row, column, value"));
                };
                entries.push(Entry { table, row, column, value });
            }
            at = at.saturating_add(line.len());
        }
        entries.sort_by(|a, b| (a.table, a.row, a.column).cmp(&(b.table, b.row, b.column)));
        let twice = entries
            .iter()
            .zip(entries.iter().skip(1))
            .find(|(a, b)| (a.table, a.row, a.column) == (b.table, b.row, b.column));
        if let Some((entry, _)) = twice {
            let found = format!("{} {} {} twice", entry.table, entry.row, entry.column);
            return Err(Error::malformed(found, "each entry once"));
        }
        Ok(ZeroBytes { entries })
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// What is known about one entry: whether it is the maximum.
    fn known(&self, table: &FloatTable, name: &str, place: usize) -> Option<bool> {
        let (row, column) = table.position(place);
        let key = (name, row, column);
        let found = self.entries.binary_search_by(|entry| (entry.table, entry.row, entry.column).cmp(&key));
        let entry = self.entries.get(found.ok()?)?;
        Some(position_of(table, entry.value) > 0.5)
    }

    /// Every entry must be of the table. About a zero byte it must name one of its two values; about another one, or in
    /// a table of one value, it changes nothing and must only say what is there.
    fn check(&self, table: &FloatTable, name: &str) -> Result<()> {
        // Half a step of the quantisation, and what a text of six decimals leaves of a value.
        let range = f64::from(table.max) - f64::from(table.min);
        let near = |value: f64, wanted: f32| {
            let wanted = f64::from(wanted);
            (value - wanted).abs() <= (range / 512.0).max(1e-5 * wanted.abs()).max(1e-6)
        };
        for entry in self.entries.iter().filter(|entry| entry.table == name) {
            let about = format!("the line {name} {} {} {}", entry.row, entry.column, entry.value);
            if entry.column >= table.columns || entry.row >= table.rows {
                let expected = format!(
                    "places in the table's {} and {}",
                    counted(table.rows, "row"),
                    counted(table.columns, "column")
                );
                return Err(Error::new(ErrorKind::Argument, about, expected));
            }
            let place = entry.row.saturating_mul(table.columns).saturating_add(entry.column);
            if table.is_zero_byte(place) {
                if !near(entry.value, table.min) && !near(entry.value, table.max) {
                    let expected = format!("the value {} or {}", table.min, table.max);
                    return Err(Error::new(ErrorKind::Argument, about, expected));
                }
            } else if !near(entry.value, table.get(entry.row, entry.column)) {
                let expected = format!(
                    "the value {}, as that byte is not ambiguous",
                    table.get(entry.row, entry.column)
                );
                return Err(Error::new(ErrorKind::Argument, about, expected));
            }
        }
        Ok(())
    }
}

/// Where a value lies between a table's minimum (0) and its maximum (1).
fn position_of(table: &FloatTable, value: f64) -> f64 {
    (value - f64::from(table.min)) / (f64::from(table.max) - f64::from(table.min))
}

/// How many zero bytes there were, and how they were resolved.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Resolved {
    pub(super) known: usize,
    pub(super) by_rule: usize,
}

/// Resolves the zero bytes of one table; `wanted` is the value that an entry should be near to.
fn resolve(
    table: &mut FloatTable,
    name: &str,
    given: &ZeroBytes,
    wanted: impl Fn(&FloatTable, usize) -> Option<f64>,
) -> Result<Resolved> {
    given.check(table, name)?;
    let mut resolved = Resolved::default();
    let (mut any_min, mut any_max) = (false, false);
    let mut narrowest: Option<(f64, usize, bool)> = None;
    let mut decided = Vec::with_capacity(table.zeros.len());
    for &place in &table.zeros {
        let to_max = if let Some(to_max) = given.known(table, name, place) {
            resolved.known = resolved.known.saturating_add(1);
            to_max
        } else {
            resolved.by_rule = resolved.by_rule.saturating_add(1);
            let position = wanted(table, place).map_or(0.5, |value| position_of(table, value));
            let margin = (position - 0.5).abs();
            let to_max = position > 0.5;
            if narrowest.is_none_or(|(least, ..)| margin < least) {
                narrowest = Some((margin, place, to_max));
            }
            to_max
        };
        any_min |= !to_max;
        any_max |= to_max;
        decided.push((place, to_max));
    }
    for (place, to_max) in decided {
        table.set(place, to_max);
    }
    if let Some((_, place, to_max)) = narrowest.filter(|_| !(any_min && any_max) && table.zeros.len() > 1) {
        table.set(place, !to_max);
    }
    Ok(resolved)
}

/// The mean of `value` at places that are not zero bytes themselves.
fn mean_of_resolved(
    table: &FloatTable,
    places: impl Iterator<Item = (usize, usize)>,
    value: impl Fn(usize, usize) -> f64,
) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for (row, column) in places {
        let place = row.saturating_mul(table.columns).saturating_add(column);
        if !table.is_zero_byte(place) {
            sum += value(row, column);
            count += 1.0;
        }
    }
    (count > 0.0).then(|| sum / count)
}

/// Columns beside `column`, across the border if the row closes on itself.
fn beside(column: usize, columns: usize, closed: bool) -> impl Iterator<Item = usize> {
    let last = columns.saturating_sub(1);
    let before = column.checked_sub(1).or(closed.then_some(last));
    let after = if column < last { column.checked_add(1) } else { closed.then_some(0) };
    before.into_iter().chain(after)
}

/// The scale that makes the scaled mean at an entry the mean of those beside it in its row; `means` are
/// the means of the functions that the row scales.
fn continuous_scale(
    table: &FloatTable,
    place: usize,
    closed: bool,
    means: impl Fn(usize, usize) -> f64,
) -> Option<f64> {
    let (row, column) = table.position(place);
    let places = beside(column, table.columns, closed).map(|column| (row, column));
    let target = mean_of_resolved(table, places, |row, column| {
        means(row, column) * f64::from(table.get(row, column))
    })?;
    let mean = means(row, column);
    (mean > 0.0).then(|| target / mean)
}

/// Means over each row of `scale` times the mean of what it scales.
fn scaled_means(scale: &FloatTable, means: impl Fn(usize, usize) -> f64) -> Vec<f64> {
    let rows = scale.rows().enumerate().map(|(row, scales)| {
        let sum: f64 = scales.iter().enumerate().map(|(column, &s)| f64::from(s) * means(row, column)).sum();
        sum / scale.columns as f64
    });
    rows.collect()
}

fn at(list: &[f64], place: usize) -> f64 {
    list.get(place).copied().unwrap_or(0.0)
}

/// Resolves all zero bytes, from the innermost functions outwards, since means of one level rest on those below.
pub(super) fn resolve_all(tables: &mut Functions, given: &ZeroBytes) -> Result<Resolved> {
    let mut total = Resolved::default();
    let mut add = |resolved: Resolved| {
        total.known = total.known.saturating_add(resolved.known);
        total.by_rule = total.by_rule.saturating_add(resolved.by_rule);
    };
    // While a row is summed its own zero bytes stand for the minimum, which is what `read` set.
    add(resolve(&mut tables.luminance_1d, "PDF1Dslice", given, |table, place| {
        let (row, _) = table.position(place);
        let sum: f64 = table.rows().nth(row)?.iter().map(|&v| f64::from(v)).sum();
        Some(f64::from(table.min) + 1.0 - sum)
    })?);
    let neighbours = color_neighbours(tables);
    add(resolve(&mut tables.colors, "colors", given, |_, place| {
        neighbours.get(place).and_then(|&(sum, count)| (count > 0.0).then(|| sum / count))
    })?);
    add(resolve(&mut tables.scale_2d, "PDF2Dscale", given, |table, place| {
        continuous_scale(table, place, false, |_, _| 1.0)
    })?);
    let luminances_2d = scaled_means(&tables.scale_2d, |_, _| 1.0);
    let means_2d: Vec<f64> = tables
        .indices_2d
        .rows()
        .enumerate()
        .map(|(i, _)| at(&luminances_2d, tables.indices_2d.get(i, 0)))
        .collect();

    let slices = &tables.slices_3d;
    let mean = |row, column| at(&means_2d, slices.get(row, column));
    add(resolve(&mut tables.scale_3d, "PDF3Dscale", given, |table, place| {
        continuous_scale(table, place, false, mean)
    })?);
    let means_3d = scaled_means(&tables.scale_3d, mean);

    let slices = &tables.slices_4d;
    let mean = |row, column| at(&means_3d, slices.get(row, column));
    add(resolve(&mut tables.scale_4d, "PDF4Dscale", given, |table, place| {
        continuous_scale(table, place, true, mean)
    })?);
    let means_4d = scaled_means(&tables.scale_4d, mean);

    let slices = &tables.slices_6d;
    let mean = |row, column| at(&means_4d, slices.get(row, column));
    add(resolve(&mut tables.scale_6d, "PDF6Dscale", given, |table, place| {
        let (row, column) = table.position(place);
        let vertical = beside(row, table.rows, false).map(|row| (row, column));
        let places = beside(column, table.columns, false).map(|column| (row, column)).chain(vertical);
        let target = mean_of_resolved(table, places, |row, column| {
            mean(row, column) * f64::from(table.get(row, column))
        })?;
        (mean(row, column) > 0.0).then(|| target / mean(row, column))
    })?);
    Ok(total)
}

/// For every entry of the colour table, sum and number of the resolved entries that stand beside its colour in
/// functions over beta.
fn color_neighbours(tables: &Functions) -> Vec<(f64, f64)> {
    let colors = &tables.colors;
    let mut sums = vec![(0.0, 0.0); colors.values.len()];
    let mut note = |color: u32, beside: u32| {
        let (Ok(color), Ok(beside)) = (usize::try_from(color), usize::try_from(beside)) else { return };
        for column in 0..colors.columns {
            let place = |row: usize| row.saturating_mul(colors.columns).saturating_add(column);
            if color != beside
                && !colors.is_zero_byte(place(beside))
                && let Some((sum, count)) = sums.get_mut(place(color))
            {
                *sum += f64::from(colors.get(beside, column));
                *count += 1.0;
            }
        }
    };
    for row in tables.color_rows.rows() {
        for (&a, &b) in row.iter().zip(row.iter().skip(1)) {
            note(a, b);
            note(b, a);
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Limits;
    use crate::mlvq::header::Header;
    use crate::reader::Reader;

    /// Tables as the rule resolves them, and what the text copies say; nothing where the measured files are not beside
    /// the checkout.
    fn resolved_by_rule(material: &str) -> Option<(Functions, ZeroBytes)> {
        let data = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/mlvq-btf");
        let bytes = std::fs::read(data.join(material).join("binary.btf")).ok()?;
        let text = std::fs::read_to_string(data.join(material).join("zero_bytes.txt")).unwrap();
        let mut reader = Reader::new(&bytes);
        let header = Header::read(&mut reader, &Limits::default()).unwrap();
        let mut functions = Functions::read(&mut reader, &header).unwrap();
        resolve_all(&mut functions, &ZeroBytes::default()).unwrap();
        Some((functions, ZeroBytes::parse(&text).unwrap()))
    }

    #[test]
    fn rule_agrees_with_the_text_copies() {
        // Two factors of corduroy, of 2 % at one azimuth of the view, go against their neighbours.
        let against = ["PDF4Dscale 529 3", "PDF4Dscale 642 3"];
        for (material, count, expected) in [
            ("alu", 19, &[][..]),
            ("corduroy", 13, &against[..]),
            ("impalla", 15, &[]),
            ("wallpaper", 17, &[]),
        ] {
            let Some((tables, text)) = resolved_by_rule(material) else { return };
            assert_eq!(text.len(), count, "{material}");
            let wrong = text.entries.iter().filter(|entry| {
                let table = match entry.table {
                    "PDF6Dscale" => &tables.scale_6d,
                    "PDF1Dslice" => &tables.luminance_1d,
                    "colors" => &tables.colors,
                    "PDF2Dscale" => &tables.scale_2d,
                    "PDF3Dscale" => &tables.scale_3d,
                    _ => &tables.scale_4d,
                };
                let found = f64::from(table.get(entry.row, entry.column));
                (position_of(table, found) - position_of(table, entry.value)).abs() > 0.5
            });
            let names: Vec<String> = wrong.map(|e| format!("{} {} {}", e.table, e.row, e.column)).collect();
            assert_eq!(names, expected, "{material}");
        }
    }
}
