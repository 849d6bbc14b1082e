//! What the model gives: the enlarged material, where it is weak, sizes, and the commands.

use crate::demo::figures::{BLOCK, Figures, Grey};
use crate::demo::pictures::{Lit, Subject};
use crate::demo::story::{Block, Grid, Section, Table, directions, per_direction, shot, text};
use crate::demo::{Settings, names};

pub(super) fn comparison(figures: &Figures, settings: &Settings) -> Section {
    let size = settings.enlarged;
    let [row, column] = figures.second_tile_origin;
    let intro = format!(
        "<p>The same area of {size} texels, covered in four ways. The first two lay measured tiles side by \
         side. The other two show the model. The second tile has the borders of the first, so both join in any \
         order. Its interior comes from another place of the measurement, at row {row} and column {column}. \
         Neighbours across its seams differ {:.2} times as much as elsewhere. A random number decides which \
         tile stands where.</p>\
         <p>The <b>paper's method</b> draws normals from the random field and takes, for each of them, a cluster \
         whose normals are near and which fits the neighbours chosen before. Statistics are kept, shapes are not. \
         The <b>default method</b> of <code>btf enlarge</code>, the coherent rule, makes every texel of the surface \
         a texel of the tile, and neighbours continue each other as they do in the tile. Shapes are kept, and \
         there is no regular repeat.</p>",
        figures.second_tile_visibility
    );
    let shots = vec![
        shot(
            "one-tile",
            Subject::OneTile,
            "<b>One tile</b>, repeated: it comes back in rows and columns",
            "The surface covered by repeating one tile",
        ),
        shot(
            "two-tiles",
            Subject::TwoTiles,
            "<b>Two tiles</b>, placed at random: their common borders still come back",
            "The surface covered by two tiles placed at random",
        ),
        shot(
            "enlarged-by-paper",
            Subject::ByPaper,
            "<b>Enlarged by the paper's method</b>: no repeat, but shapes are lost",
            "The surface as the paper's method makes it",
        ),
        shot(
            "enlarged",
            Subject::ENLARGED,
            "<b>Enlarged by the default method</b>: shapes are kept, without a regular repeat",
            "The surface as the default method makes it",
        ),
    ];
    let tiles = vec![
        shot("first-tile", Subject::Tile, "<b>The first tile</b>", "The first tile"),
        shot("second-tile", Subject::SecondTile, "<b>The second tile</b>", "The second tile"),
        shot(
            "second-tile-interior",
            Subject::SecondTileInside,
            "<b>Its interior</b>, tinted; the rest is the first tile",
            "The second tile with its own interior tinted",
        ),
    ];
    Section {
        title: "Enlarging, and what is gained over tiles",
        blocks: vec![text(intro), Block::Pictures(Grid::Large, shots), Block::Pictures(Grid::Small, tiles)],
    }
}

pub(super) fn lights(settings: &Settings) -> Section {
    let lit = |light, view| Lit { view, light };
    let normal = (0.0, 0.0);
    let pairs = [
        (lit((0.0, 0.0), normal), "Frontal light"),
        (lit((45.0, 100.0), normal), "Light from the top"),
        (lit((60.0, 180.0), normal), "Light from the left"),
        (lit((75.0, 270.0), normal), "Grazing light from the bottom"),
        (lit((37.0, 53.0), normal), "A light between the measured ones"),
        (lit((45.0, 180.0), (60.0, 0.0)), "A low view, towards the light"),
    ];
    let intro = format!(
        "<p>One surface of {} texels under six lights. Only the number of a cluster is stored for each texel, \
         and the model knows how that cluster looks under every measured light and view. For directions in \
         between, the three nearest views and lights are mixed. Pictures from low views are shown rectified, \
         as photographs of the measurement are.</p>",
        settings.enlarged
    );
    Section {
        title: "The surface under other lights",
        blocks: vec![
            text(intro),
            Block::Pictures(
                Grid::Large,
                per_direction("enlarged", "Enlarged material", &pairs, Subject::Enlarged),
            ),
        ],
    }
}

pub(super) fn likeness(figures: &Figures) -> Section {
    let [measured, modelled] = figures.greys;
    let (enlarged, by_paper) = (&figures.enlarged, &figures.by_paper);
    let intro = format!(
        "<p><b>Does every cluster keep its share?</b> In the tile, each cluster covers some share of the texels. \
         The surface of the default method agrees with these shares to <b>{:.0} %</b>, that of the paper's method to \
         <b>{:.0} %</b> (100 % would be equal shares). Of the {} clusters, the default method leaves {} unused, \
         the paper's method {}.</p>\
         <p><b>Are there patches that the material does not have?</b> Take the mean brightness of each square of \
         {BLOCK} × {BLOCK} texels. It varies <b>{:.2}</b> times as much as in the tile with the default method, and \
         <b>{:.2}</b> times with the paper's. Above 1, a surface has larger patches or streaks than the material.</p>\
         <p>Why the paper's method makes them: of the candidates it takes the cluster that is nearest to those at \
         the left and above. Average clusters are near to all others, so they crowd out rare ones such as grooves \
         and highlights, and a patch that has begun goes on.</p>\
         <p>What the default method cannot do: show anything that the tile does not have. Where pieces of the tile \
         meet, a long line may step aside. A larger tile has fewer such places.</p>",
        100.0 * enlarged.histogram_overlap,
        100.0 * by_paper.histogram_overlap,
        figures.cluster.clusters,
        enlarged.unused_clusters,
        by_paper.unused_clusters,
        enlarged.grey.block_spread / measured.block_spread,
        by_paper.grey.block_spread / measured.block_spread,
    );
    let row = |name: &str, grey: Grey| {
        vec![
            name.to_owned(),
            format!("{:.1}", grey.mean),
            format!("{:.1}", grey.spread),
            format!("{:.1}", grey.block_spread),
        ]
    };
    let table = Table {
        caption: format!("Brightness in display levels, 0 to 255; {}", directions(Lit::REFERENCE)),
        head: vec!["Picture", "Mean", "Standard deviation", "Standard deviation of the squares' means"],
        rows: vec![
            row("Tile, measured", measured),
            row("Tile, by the model", modelled),
            row("Enlarged by the default method", enlarged.grey),
            row("Enlarged by the paper's method", by_paper.grey),
        ],
    };
    Section {
        title: "How near the surface comes to the material",
        blocks: vec![text(intro), Block::Table(table)],
    }
}

pub(super) fn sizes(figures: &Figures) -> Section {
    let ledger = &figures.ledger;
    let with_tile_index = ledger.representatives + ledger.tile_index;
    let with_enlarged_index = ledger.representatives + ledger.enlarged_index;
    let as_in_paper = ledger.representatives + 4 * ledger.enlarged_texels;
    let row = |kept: &str, bytes: u64, against: String, raw: u64| {
        vec![
            kept.to_owned(),
            bytes_text(bytes),
            against,
            bytes_text(raw),
            format!("1 : {:.0}", raw as f64 / bytes as f64),
        ]
    };
    let (tile, enlarged) = ("representatives + tile index", "representatives + enlarged index");
    let whole = "the whole measurement, raw";
    let table = Table {
        caption: "Compression: what is kept, and what it is compared with".to_owned(),
        head: vec!["Kept", "Bytes", "Compared with", "Bytes", "Ratio"],
        rows: vec![
            row(tile, with_tile_index, "the tile, raw".to_owned(), ledger.tile),
            row(tile, with_tile_index, whole.to_owned(), ledger.measurement),
            row(enlarged, with_enlarged_index, whole.to_owned(), ledger.measurement),
            row(enlarged, with_enlarged_index, "the enlarged BTF, raw".to_owned(), ledger.enlarged),
            row(
                "as the paper counts: an index of 4 bytes per texel",
                as_in_paper,
                "ten tiles, raw".to_owned(),
                10 * ledger.tile,
            ),
        ],
    };
    let note = format!(
        "<p>One model gives all of these ratios, so a ratio means nothing unless it says what was counted. \
         Raw means {} bytes per texel: 8-bit RGB under all pairs of directions. The paper states \
         \"approximately 1/200\". It compares ten tiles of 2.4 GB in all (137 × 142 texels each, which would be \
         3.8 GB raw) with 9.3 MB: representatives, and an index of 4 bytes per texel for 1024 × 1024 texels. Only \
         the last row counts in that way.</p>",
        ledger.texel
    );
    let [archive, measurement, model, enlarged] = ledger.on_disk;
    let disk = Table {
        caption: "Sizes on disk".to_owned(),
        head: vec!["File or folder", "Bytes"],
        rows: [
            (format!("{} (photographs, JPEG)", names::ARCHIVE), archive),
            (format!("{} (samples and lightness, without loss)", names::MEASUREMENT), measurement),
            (format!("{} (all of the model)", names::MODEL), model),
            (format!("{} (index, and which texel of the tile each texel is)", names::ENLARGED), enlarged),
        ]
        .map(|(name, bytes)| vec![name, bytes_text(bytes)])
        .into(),
    };
    Section {
        title: "Sizes and compression",
        blocks: vec![Block::Table(table), text(note), Block::Table(disk)],
    }
}

pub(super) fn commands(settings: &Settings) -> Section {
    let [archive, measurement, model, enlarged, by_paper] =
        [names::ARCHIVE, names::MEASUREMENT, names::MODEL, names::ENLARGED, names::BY_PAPER];
    let Settings { sample, directions, clusters, passes, tolerance, candidates, seed, .. } = *settings;
    let (material, size) = (settings.material(), settings.enlarged);
    let intro = "<p>These commands are the steps of this page with the same settings. In the demo's folder they \
                 find everything done already. For an archive of your own, go to another folder, leave out the \
                 first line, and put the archive's name into the second.</p>";
    let seed = format!("--seed {seed}");
    let directions = format!("--views {directions} --lights {directions}");
    let limits = format!("--passes {passes} --tolerance {tolerance}");
    let paper = format!("--method paper --candidates {candidates} --keep-normals");
    let lines = vec![
        format!("btf sample {archive} --material {material} --size {sample} {directions} {seed}"),
        format!("btf import {archive} {measurement}"),
        format!("btf tile {measurement} {model} --tile cut {seed}"),
        format!("btf cluster {measurement} {model} --clusters {clusters} --centre median {limits} {seed}"),
        format!("btf normals {measurement} {model}"),
        format!("btf fit {model} --mrf 3d"),
        format!("btf compare {measurement} {model} --picture compare.png"),
        format!("btf appearance {model}"),
        format!("btf enlarge {model} {enlarged} --size {size} {seed}"),
        format!("btf enlarge {model} {by_paper} --size {size} {seed} {paper}"),
        format!("btf image {enlarged} --light 45,100 --view 0,0 --out enlarged.png"),
        format!("btf image {model} --what normals --out normals.png"),
    ];
    Section { title: "The commands", blocks: vec![text(intro), Block::Commands(lines)] }
}

/// Bytes with a decimal unit, as the paper counts.
fn bytes_text(bytes: u64) -> String {
    let (unit, scale) = match bytes {
        1_000_000_000.. => ("GB", 1e9),
        1_000_000.. => ("MB", 1e6),
        1_000.. => ("kB", 1e3),
        _ => return format!("{bytes} B"),
    };
    format!("{:.2} {unit}", bytes as f64 / scale)
}
