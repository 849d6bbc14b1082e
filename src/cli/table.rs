//! Tables of text.

use super::terminal::{of_output, pieces, width_of};

/// Columns between cells.
const GAP: usize = 2;

/// The narrowest column that prose is wrapped in.
const LEAST_PROSE: usize = 16;

/// Columns as wide as their widest cell: numbers flush right, prose flush left. On a terminal the widest column of
/// prose is wrapped where the table would be too wide.
pub(super) fn table(rows: &[Vec<String>]) -> String {
    laid_out(rows, of_output())
}

fn laid_out(rows: &[Vec<String>], room: Option<usize>) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let cells = |column: usize| rows.iter().filter_map(move |row| row.get(column));
    let mut widths: Vec<usize> =
        (0..columns).map(|column| cells(column).map(|cell| width_of(cell)).max().unwrap_or(0)).collect();
    // A word over numbers is their heading.
    let numbers: Vec<bool> = (0..columns)
        .map(|column| {
            let heading = usize::from(rows.len() > 1);
            column > 0 && cells(column).skip(heading).all(|cell| is_number(cell))
        })
        .collect();
    let prose = (0..columns).filter(|&column| !numbers[column]).max_by_key(|&column| widths[column]);
    let wide = widths.iter().sum::<usize>() + GAP * columns.saturating_sub(1);
    if let (Some(room), Some(prose)) = (room, prose)
        && wide > room
    {
        widths[prose] = widths[prose].saturating_sub(wide - room).max(LEAST_PROSE.min(widths[prose]));
    }
    let line = |cells: &[&str]| {
        let mut line = String::new();
        for (column, (cell, &width)) in cells.iter().zip(&widths).enumerate() {
            let space = " ".repeat(width.saturating_sub(width_of(cell)));
            let gap = if column > 0 { " ".repeat(GAP) } else { String::new() };
            let (before, after) = if numbers[column] { (space.as_str(), "") } else { ("", space.as_str()) };
            line.push_str(&format!("{gap}{before}{cell}{after}"));
        }
        line.trim_end().to_owned()
    };
    let mut lines = Vec::new();
    for row in rows {
        let broken: Vec<Vec<String>> =
            row.iter().zip(&widths).map(|(cell, &width)| pieces(cell, width, width)).collect();
        for number in 0..broken.iter().map(Vec::len).max().unwrap_or(1) {
            let cells: Vec<&str> =
                broken.iter().map(|pieces| pieces.get(number).map_or("", String::as_str)).collect();
            lines.push(line(&cells));
        }
    }
    lines.join("\n")
}

/// Whether a cell is a number, perhaps with its unit or a ratio, or stands for one that is not there.
fn is_number(cell: &str) -> bool {
    let (number, unit) = cell.split_once(' ').unwrap_or((cell, ""));
    let digits = number.trim_start_matches(['-', '+']);
    let is_numeric = digits.starts_with(|c: char| c.is_ascii_digit())
        && digits.chars().all(|c| c.is_ascii_digit() || ".,:e-".contains(c));
    (is_numeric || matches!(number, "" | "-" | "nan" | "inf" | "NaN")) && unit.len() <= 3
}

/// A row from anything that can be shown; a cell is one line.
macro_rules! row {
    ($($cell:expr),* $(,)?) => { vec![$(btfkit::text::escaped(&format!("{}", $cell)).into_owned()),*] };
}
pub(super) use row;

#[cfg(test)]
mod tests {
    use super::laid_out;

    #[test]
    fn numbers_stand_flush_right_and_prose_flush_left() {
        let rows =
            [row!["name", "count", "what"], row!["a", 7, "few"], row!["long name", 1000, "many of them"]];
        let expected = "\
name       count  what
a              7  few
long name   1000  many of them";
        assert_eq!(laid_out(&rows, None), expected);
        // Without a heading, as `btf info` has it.
        let rows = [row!["kind", "archive"], row!["views", "9, theta 0 to 75"], row!["white", 1]];
        assert_eq!(laid_out(&rows, None), "kind   archive\nviews  9, theta 0 to 75\nwhite  1");
        let rows = [row!["size", "PSNR"], row!["1.5 MiB", "-"], row!["200 KiB", "31.20"]];
        assert_eq!(laid_out(&rows, None), "size      PSNR\n1.5 MiB      -\n200 KiB  31.20");
    }

    #[test]
    fn prose_is_wrapped_in_its_column_where_there_is_no_room() {
        let rows = [
            row!["check", "alarm", "why"],
            row!["gamma", "12 %", "curve of the lights fits well with what was measured"],
            row!["black", "3 %", "none"],
        ];
        let expected = "\
check  alarm  why
gamma   12 %  curve of the lights fits
              well with what was
              measured
black    3 %  none";
        assert_eq!(laid_out(&rows, Some(38)), expected);
        for room in 1..120 {
            let told = laid_out(&rows, Some(room));
            let mut words: Vec<&str> = told.split_whitespace().collect();
            let mut all: Vec<&str> = rows.iter().flatten().flat_map(|cell| cell.split_whitespace()).collect();
            words.sort_unstable();
            all.sort_unstable();
            assert_eq!(words, all);
            let fits = told.lines().all(|line| line.len() <= room);
            assert!(fits || room < 30, "{room}: {told}");
        }
    }
}
