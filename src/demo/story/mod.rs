//! What the page says, section by section: text, pictures and tables filled with the run's figures.

mod analysis;
mod result;

use crate::demo::Settings;
use crate::demo::figures::Figures;
use crate::demo::pictures::{Lit, Subject};
use crate::demo::times::Step;

/// A section of the page.
pub(super) struct Section {
    pub(super) title: &'static str,
    pub(super) blocks: Vec<Block>,
}

impl Section {
    /// Its pictures, in order.
    pub(super) fn shots(&self) -> impl Iterator<Item = &Shot> {
        self.blocks.iter().flat_map(|block| match block {
            Block::Pictures(_, shots) => shots.as_slice(),
            _ => &[],
        })
    }
}

/// A part of a section. Texts and captions are HTML.
pub(super) enum Block {
    Text(String),
    Pictures(Grid, Vec<Shot>),
    Table(Table),
    /// Lines to type.
    Commands(Vec<String>),
}

/// How wide the pictures of a grid are.
#[derive(Clone, Copy)]
pub(super) enum Grid {
    /// Four or five a row.
    Small,
    /// Two or three a row.
    Large,
}

/// A picture to make.
pub(super) struct Shot {
    /// File name without its ending.
    pub(super) file: String,
    pub(super) subject: Subject,
    pub(super) caption: String,
    /// What is seen, for those who do not see it.
    pub(super) alt: String,
}

/// A table; the first column is its rows' heads.
pub(super) struct Table {
    pub(super) caption: String,
    pub(super) head: Vec<&'static str>,
    pub(super) rows: Vec<Vec<String>>,
}

fn shot(file: &str, subject: Subject, caption: impl Into<String>, alt: impl Into<String>) -> Shot {
    Shot { file: file.to_owned(), subject, caption: caption.into(), alt: alt.into() }
}

fn text(html: impl Into<String>) -> Block {
    Block::Text(html.into())
}

/// The page's title.
pub(super) fn title(settings: &Settings) -> String {
    let count = settings.directions * settings.directions;
    format!("From {count} photographs of {} to a surface of any size", settings.material())
}

/// The story of a run, but for its times.
pub(super) fn sections(figures: &Figures, settings: &Settings) -> Vec<Section> {
    vec![
        analysis::measured(settings),
        analysis::tile(figures),
        analysis::clusters(figures),
        analysis::normals(figures),
        result::comparison(figures, settings),
        result::lights(settings),
        result::likeness(figures),
        result::sizes(figures),
        result::commands(settings),
    ]
}

/// "light 15°, 0°; view 0°, 0°".
fn directions(Lit { view, light }: Lit) -> String {
    format!("light {}°, {}°; view {}°, {}°", light.0, light.1, view.0, view.1)
}

/// A picture per pair of directions, named after them.
fn per_direction(
    name: &str,
    what: &str,
    pairs: &[(Lit, &str)],
    subject: impl Fn(Lit) -> Subject,
) -> Vec<Shot> {
    pairs
        .iter()
        .map(|&(lit, word)| {
            let Lit { view, light } = lit;
            let file = format!("{name}-light-{}-{}-view-{}-{}", light.0, light.1, view.0, view.1);
            let caption = format!("<b>{word}</b>: {}", directions(lit));
            shot(&file, subject(lit), caption, format!("{what}, {}", directions(lit)))
        })
        .collect()
}

/// The times of the run.
pub(super) fn times(steps: &[Step]) -> Section {
    let total: f64 = steps.iter().map(|step| step.seconds).sum();
    let row = |name: &str, seconds: f64| vec![name.to_owned(), format!("{seconds:.2}")];
    let rows = steps.iter().map(|step| row(&step.name, step.seconds)).chain([row("all", total)]);
    let table = Table {
        caption: "Time of each step".to_owned(),
        head: vec!["Step", "Seconds"],
        rows: rows.collect(),
    };
    let note = "<p>Seconds on the machine that made this page. A step that was finished by an earlier run keeps \
                the time of that run.</p>";
    Section { title: "How long it took", blocks: vec![text(note), Block::Table(table)] }
}
