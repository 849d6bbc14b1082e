//! What was measured on one sheet: brightness of all images, what in it neighbours do not promise, the normals.

use super::exposure;
use super::finding::{Finding, round};
use super::statistics::Statistics;
use crate::method::stereo::Stereo;
use crate::picture::drawing::Canvas;
use crate::picture::{Picture, false_color};
use crate::shape::Size;
use btfkit_formats::Direction;

/// Side that each panel is magnified to or towards, pixels.
const PANEL: usize = 440;
/// Space around panels, room for captions and numbers.
const MARGIN: usize = 44;
/// Height of a line of text.
const LINE: usize = 14;
/// Largest jump in the map of outliers, natural logarithm: half of again or two thirds of the light.
const LARGEST_JUMP: f64 = 0.4;

const MARK: [f32; 3] = [0.95, 0.1, 0.75];

/// The sheet. Findings are marked in the map of outliers.
pub fn sheet(statistics: &Statistics, findings: &[&Finding]) -> Picture {
    let brightness = brightness(statistics);
    let outliers = outliers(statistics, findings);
    let (frontal, normals) = frontal(statistics);
    let panels = [brightness, outliers, frontal, normals];
    let widths = [panels[0].width().max(panels[2].width()), panels[1].width().max(panels[3].width())];
    let heights = [panels[0].height().max(panels[1].height()), panels[2].height().max(panels[3].height())];
    let mut canvas = Canvas::new(Size::new(heights[0] + heights[1], widths[0] + widths[1]));
    for (number, panel) in panels.iter().enumerate() {
        let (column, row) = (number % 2, number / 2);
        panel.draw(
            &mut canvas,
            if row == 1 { heights[0] } else { 0 },
            if column == 1 { widths[0] } else { 0 },
        );
    }
    canvas.into_picture()
}

/// A picture with a caption above, a line of explanation below and numbers at its sides.
struct Panel {
    caption: String,
    below: Vec<String>,
    picture: Picture,
    /// Rows and columns where rings of directions begin, in pixels of the picture, and their elevations.
    rows: Vec<(usize, String)>,
    columns: Vec<(usize, String)>,
    /// Colours from first to last with what they mean.
    scale: Option<(Picture, String, String)>,
}

impl Panel {
    fn plain(caption: &str, below: Vec<String>, picture: Picture) -> Self {
        Self {
            caption: caption.to_owned(),
            below,
            picture,
            rows: Vec::new(),
            columns: Vec::new(),
            scale: None,
        }
    }

    fn width(&self) -> usize {
        let text = self.below.iter().chain([&self.caption]).map(|line| 8 * line.len()).max().unwrap_or(0);
        2 * MARGIN + self.picture.size.width.max(text)
    }

    fn height(&self) -> usize {
        MARGIN + self.picture.size.height + (self.below.len() + 3) * LINE
    }

    fn draw(&self, canvas: &mut Canvas, top: usize, left: usize) {
        let (y, x) = (top + MARGIN, left + MARGIN);
        canvas.text(top + 12, x, &self.caption);
        canvas.put(y, x, &self.picture);
        for (at, label) in &self.rows {
            canvas.text(y + at, x - 8 * label.len() - 4, label);
        }
        for (at, label) in &self.columns {
            canvas.text(y - 11, x + at, label);
        }
        let mut below = y + self.picture.size.height + 6;
        if let Some((colors, first, last)) = &self.scale {
            canvas.text(below, x, first);
            canvas.put(below, x + 8 * first.len() + 6, colors);
            canvas.text(below, x + 8 * first.len() + 12 + colors.size.width, last);
            below += LINE;
        }
        for line in &self.below {
            canvas.text(below, x, line);
            below += LINE;
        }
    }
}

/// A map over all images, view by view downwards, light by light to the right.
fn map(statistics: &Statistics, colors: Vec<[f32; 3]>) -> (Picture, usize) {
    let size = Size::new(statistics.views.len(), statistics.lights.len());
    let factor = (PANEL / size.height.max(size.width)).max(1);
    (Picture::display(size, colors).magnified(factor), factor)
}

/// Where rings of elevation begin, as far apart as text needs.
fn rings(directions: &[Direction], factor: usize, apart: usize) -> Vec<(usize, String)> {
    let mut labels: Vec<(usize, String)> = Vec::new();
    for (number, direction) in directions.iter().enumerate() {
        let label = format!("{:.0}", direction.theta_rad.to_degrees());
        let new = labels.last().is_none_or(|(at, last)| *last != label && number * factor >= at + apart);
        if new {
            labels.push((number * factor, label));
        }
    }
    labels
}

fn brightness(statistics: &Statistics) -> Panel {
    let logarithms: Vec<f64> = statistics.images.iter().map(|image| image.mean.max(1e-6).log2()).collect();
    let most = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let least = logarithms.iter().copied().fold(f64::INFINITY, f64::min).clamp(most - 8.0, most - 0.1);
    let color = |value: f64| ramp(&BRIGHTNESS, (value - least) / (most - least));
    let (picture, factor) = map(statistics, logarithms.iter().map(|&value| color(value)).collect());
    Panel {
        caption: "Mean luminance, logarithmic".to_owned(),
        below: vec!["down: views, right: lights; numbers: theta in degrees".to_owned()],
        rows: rings(&statistics.views, factor, 10),
        columns: rings(&statistics.lights, factor, 20),
        scale: Some((bar(&BRIGHTNESS), format!("{:.3}", least.exp2()), format!("{:.3}", most.exp2()))),
        picture,
    }
}

fn outliers(statistics: &Statistics, findings: &[&Finding]) -> Panel {
    let lights = statistics.lights.len();
    let jumps = exposure::jumps(statistics);
    let color = |value: f64| ramp(&JUMPS, 0.5 + 0.5 * value / LARGEST_JUMP);
    let mut colors: Vec<[f32; 3]> = match &jumps {
        Some(jumps) => jumps.iter().map(|&jump| color(jump)).collect(),
        None => vec![[0.9; 3]; statistics.images.len()],
    };
    let mut marked = 0;
    for place in findings.iter().flat_map(|finding| &finding.directions) {
        let concerns = |at: usize| {
            place.view.is_none_or(|view| view == at / lights)
                && place.light.is_none_or(|light| light == at % lights)
        };
        marked += 1;
        (0..colors.len()).filter(|&at| concerns(at)).for_each(|at| colors[at] = MARK);
    }
    let (picture, factor) = map(statistics, colors);
    let what = if jumps.is_some() {
        "Outliers: brightness over neighbours and images alike"
    } else {
        "Outliers (directions too sparse for jumps)"
    };
    let percent = |jump: f64| format!("x{}", round(jump.exp(), 2));
    Panel {
        caption: what.to_owned(),
        below: vec![format!("magenta: places of findings ({marked})")],
        rows: rings(&statistics.views, factor, 10),
        columns: rings(&statistics.lights, factor, 20),
        scale: Some((bar(&JUMPS), percent(-LARGEST_JUMP), percent(LARGEST_JUMP))),
        picture,
    }
}

/// Mean over the lights of the most frontal view, and its normals as the directions are given.
fn frontal(statistics: &Statistics) -> (Panel, Panel) {
    let size = statistics.window;
    let factor = (PANEL / size.height.max(size.width)).max(1);
    let mean = &statistics.view_means[statistics.frontal];
    let most = mean.iter().copied().fold(1e-6, f32::max);
    let grey = Picture::linear(size, mean.iter().map(|&value| [value / most; 3]).collect()).as_display();
    let (theta, phi) = statistics.views[statistics.frontal].degrees();
    let name = format!("view {} ({theta:.0}, {phi:.0}), middle {size} texels", statistics.frontal);
    let texels = statistics.frontal_luminance.chunks_exact(statistics.lights.len());
    let (normals, told) = match Stereo::new(&statistics.lights) {
        Ok(stereo) => {
            let normal =
                |texel: &[f32]| stereo.normal(&texel.iter().map(|&v| f64::from(v)).collect::<Vec<f64>>());
            (texels.map(normal).collect(), "red: facing right, green: facing up".to_owned())
        }
        Err(_) => (vec![[0.0, 0.0, 1.0]; size.texels()], "lights do not span space: no normals".to_owned()),
    };
    let normals = false_color::normals(size, &steeper(&normals));
    (
        Panel::plain("Frontal view, mean over lights", vec![name], grey.magnified(factor)),
        Panel::plain(
            "Normals as the directions are given",
            vec![told, "bumps should be red at their right, green at their top".to_owned()],
            normals.magnified(factor),
        ),
    )
}

/// Normals with slopes scaled so that flat materials show theirs.
fn steeper(normals: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let square: f32 = normals.iter().map(|[x, y, _]| x * x + y * y).sum();
    let spread = (square / normals.len().max(1) as f32).sqrt();
    let gain = if spread > 1e-6 { (0.4 / spread).max(1.0) } else { 1.0 };
    normals
        .iter()
        .map(|&[x, y, z]| {
            let (x, y) = (gain * x, gain * y);
            let length = (x * x + y * y + z * z).sqrt();
            [x / length, y / length, z / length]
        })
        .collect()
}

/// Dark blue over green to yellow: lightness grows evenly.
const BRIGHTNESS: [[f32; 3]; 5] =
    [[0.27, 0.0, 0.33], [0.23, 0.32, 0.55], [0.13, 0.57, 0.55], [0.37, 0.79, 0.38], [0.99, 0.91, 0.15]];

/// Blue over white to red.
const JUMPS: [[f32; 3]; 3] = [[0.1, 0.3, 0.75], [0.97, 0.97, 0.97], [0.8, 0.15, 0.1]];

/// The colour at 0..1 of a row of colours.
fn ramp(colors: &[[f32; 3]], at: f64) -> [f32; 3] {
    let place = at.clamp(0.0, 1.0) * (colors.len() - 1) as f64;
    let first = (place as usize).min(colors.len() - 2);
    let share = (place - first as f64) as f32;
    std::array::from_fn(|c| colors[first][c] * (1.0 - share) + colors[first + 1][c] * share)
}

fn bar(colors: &[[f32; 3]]) -> Picture {
    let size = Size::new(8, 160);
    Picture::display(size, (0..size.texels()).map(|n| ramp(colors, (n % 160) as f64 / 159.0)).collect())
}
