//! The pictures that were judged, side by side: a real crop, the enlargement alone, and with the model.

use super::report::{Report, Row};
use crate::likeness::Lightness;
use crate::picture::Picture;
use crate::picture::drawing::Canvas;
use crate::shape::Size;

/// Pixels around pictures.
const MARGIN: usize = 12;

/// Height of a line of text.
const LINE: usize = 14;

/// Pictures are magnified to about so many pixels.
const PANEL: usize = 256;

/// The pictures of one pair of directions, as far as there are any.
pub(super) struct Panels {
    pub(super) real: Lightness,
    pub(super) alone: Option<Lightness>,
    pub(super) with_model: Lightness,
}

/// The sheet, one row a pair.
pub(super) fn sheet(panels: &[Panels], report: &Report) -> Picture {
    let factor = (PANEL / report.crop).max(1);
    let side = report.crop * factor;
    let (row, column) = (side + MARGIN + 2 * LINE, side + MARGIN);
    let mut canvas = Canvas::new(Size::new(panels.len() * row + MARGIN, 3 * column + MARGIN));
    for (number, (panels, pair)) in panels.iter().zip(&report.pairs).enumerate() {
        let top = MARGIN + number * row;
        let [view, light] =
            [pair.view_deg, pair.light_deg].map(|[theta, phi]| format!("{theta:.0},{phi:.0}"));
        let j = |row: &Row| format!("J {:.2}, {}", row.j, row.worst);
        let texts = [
            [format!("view {view} light {light}"), "a real crop".to_owned()],
            ["the enlargement alone".to_owned(), pair.rows.alone.as_ref().map(j).unwrap_or_default()],
            ["with the model's clusters".to_owned(), j(&pair.rows.with_model)],
        ];
        let pictures = [Some(&panels.real), panels.alone.as_ref(), Some(&panels.with_model)];
        for (place, (picture, texts)) in pictures.into_iter().zip(texts).enumerate() {
            let left = MARGIN + place * column;
            let Some(picture) = picture else { continue };
            for (line, text) in texts.iter().enumerate() {
                canvas.text(top + line * LINE, left, text);
            }
            canvas.put(top + 2 * LINE, left, &grey(picture).magnified(factor));
        }
    }
    canvas.into_picture()
}

/// L* as the grey that a display shows of it, near enough.
fn grey(picture: &Lightness) -> Picture {
    let pixels = picture.values.iter().map(|value| [(value / 100.0) as f32; 3]).collect();
    Picture::display(picture.size, pixels)
}
