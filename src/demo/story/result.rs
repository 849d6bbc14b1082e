//! What the model gives: the enlarged material, where it is weak, sizes, and the commands.

use crate::demo::figures::{BLOCK, Figures, Grey};
use crate::demo::pictures::{Lit, Subject};
use crate::demo::story::{Block, Grid, Section, Table, directions, per_direction, shot, text};
use crate::demo::{Settings, names};

pub(super) fn comparison(figures: &Figures, settings: &Settings) -> Section {
    let size = settings.enlarged;
    let [row, column] = figures.companion_origin;
    let intro = format!(
        "<p>The same area, {size} texels, covered in four ways. The two repetitions show measured samples, the \
         two enlargements show the model. The second tile has the borders of the first, and the region at \
         row {row}, column {column} of the measurement as its interior, joined by minimum-error paths on all \
         four sides (seam visibility {:.2}); which tile stands where is drawn by chance.</p>\
         <p>The paper synthesises normals as a Gaussian random field and takes for each the cluster that fits its \
         neighbours. Statistics are kept, shapes are not. The coherent rule, the default of <code>btf enlarge</code>, \
         makes every texel a texel of the tile whose neighbours continue it as they do in the tile: shapes are kept, \
         and nothing repeats as a whole.</p>",
        figures.companion_visibility
    );
    let shots = vec![
        shot(
            "one-tile",
            Subject::OneTile,
            "<b>One tile</b> repeated",
            "The plane covered by repeating one tile",
        ),
        shot(
            "two-tiles",
            Subject::TwoTiles,
            "<b>Two tiles</b> placed by chance",
            "The plane covered by two tiles placed by chance",
        ),
        shot(
            "enlarged-by-paper",
            Subject::ByPaper,
            "<b>Enlarged by the paper's rule</b>",
            "The plane covered by the index that the paper's rule makes",
        ),
        shot(
            "enlarged",
            Subject::ENLARGED,
            "<b>Enlarged by the coherent rule</b>",
            "The plane covered by the index that the coherent rule makes",
        ),
    ];
    let tiles = vec![
        shot("first-tile", Subject::Tile, "<b>The first tile</b>", "The first tile"),
        shot("second-tile", Subject::Companion, "<b>The second tile</b>", "The second tile"),
        shot(
            "second-tile-interior",
            Subject::CompanionInterior,
            "<b>Its interior</b>, tinted: beyond the paths it is the first tile",
            "The second tile with its own interior tinted",
        ),
    ];
    Section {
        title: "Tiling against enlargement",
        blocks: vec![text(intro), Block::Pictures(Grid::Large, shots), Block::Pictures(Grid::Small, tiles)],
    }
}

pub(super) fn lights(settings: &Settings) -> Section {
    let lit = |light, view| Lit { view, light };
    let normal = (0.0, 0.0);
    let pairs = [
        (lit((0.0, 0.0), normal), "Frontal light"),
        (lit((45.0, 100.0), normal), "Light from above"),
        (lit((60.0, 180.0), normal), "Light from the left"),
        (lit((75.0, 270.0), normal), "Grazing light from below"),
        (lit((37.0, 53.0), normal), "A light that was not measured"),
        (lit((45.0, 180.0), (60.0, 0.0)), "Another view, towards the light"),
    ];
    let intro = format!(
        "<p>One enlarged index, {} texels, under other lights and from another view: each texel's value is \
         looked up in the representative of its cluster (equation (27)), between measured directions mixed \
         from the three nearest views and lights in linear light. Tilted views are shown rectified, as they \
         were measured.</p>",
        settings.enlarged
    );
    Section {
        title: "The enlarged material under other lights",
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
        "<p>The shares of the clusters in the enlarged index overlap with those in the tile by <b>{:.0} %</b> with \
         the coherent rule and by <b>{:.0} %</b> with the paper's (100 %: the same shares); {} and {} of the {} \
         clusters are not used at all. Under the light of the comparison, the spread of the means of {BLOCK} × \
         {BLOCK} squares is <b>{:.2}</b> and <b>{:.2}</b> times the tile's: above 1, a picture has patches or \
         streaks that are larger than those of the material.</p>\
         <p>The paper's rule (25) takes, of the candidates, the cluster nearest to those at left and above. Average \
         clusters are near to all others, so they crowd out rare ones such as grooves and highlights, and a region \
         that has begun goes on along the scan.</p>\
         <p>What both share: the reflectance of each texel is measured, not made. What the coherent rule cannot do: \
         show what the tile has not. Where pieces of the tile meet, a long structure may step aside; a larger tile \
         has fewer such places.</p>",
        100.0 * enlarged.histogram_overlap,
        100.0 * by_paper.histogram_overlap,
        enlarged.unused_clusters,
        by_paper.unused_clusters,
        figures.cluster.clusters,
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
        caption: format!("Grey in display levels (0 to 255), {}", directions(Lit::REFERENCE)),
        head: vec!["Picture", "Mean", "Spread", "Spread of the squares' means"],
        rows: vec![
            row("Tile, measured", measured),
            row("Tile, by the model", modelled),
            row("Enlarged by the coherent rule", enlarged.grey),
            row("Enlarged by the paper's rule", by_paper.grey),
        ],
    };
    Section { title: "How near the result comes", blocks: vec![text(intro), Block::Table(table)] }
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
        caption: "Compression, each ratio with its ledger".to_owned(),
        head: vec!["Kept", "Bytes", "Counted against", "Bytes", "Ratio"],
        rows: vec![
            row(tile, with_tile_index, "the tile, raw".to_owned(), ledger.tile),
            row(tile, with_tile_index, whole.to_owned(), ledger.measurement),
            row(enlarged, with_enlarged_index, whole.to_owned(), ledger.measurement),
            row(enlarged, with_enlarged_index, "the enlarged BTF, raw".to_owned(), ledger.enlarged),
            row(
                "the paper's ledger: index of 4 bytes a texel",
                as_in_paper,
                "ten tiles, raw".to_owned(),
                10 * ledger.tile,
            ),
        ],
    };
    let note = format!(
        "<p>The same model gives every one of these ratios, so a ratio without its ledger says nothing. \
         \"Raw\" is {} bytes a texel, all pairs of directions, 8-bit RGB. The paper's \"approximately \
         1/200\" sets ten tiles of 2.4 GB in all (137 × 142 texels each, which would be 3.8 GB raw) against \
         9.3 MB, which is its representatives with a 4-byte index of 1024 × 1024. Only the last row counts \
         ours in that way.</p>",
        ledger.texel
    );
    let [archive, measurement, model, enlarged] = ledger.on_disk;
    let disk = Table {
        caption: "On this disk".to_owned(),
        head: vec!["File or folder", "Bytes"],
        rows: [
            (format!("{} (JPEG)", names::ARCHIVE), archive),
            (format!("{} (samples and L*, lossless)", names::MEASUREMENT), measurement),
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
    let intro = "<p>Typed in the demo's folder, these name the same steps with the same settings: what is \
                 done is found done (only the first makes its archive anew). For an archive of your own, \
                 leave out the first line and give its name to the second, in another folder.</p>";
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
        format!("btf compare {model} {measurement} --picture compare.png"),
        format!("btf appearance {model}"),
        format!("btf enlarge {model} {enlarged} --size {size} {seed}"),
        format!("btf enlarge {model} {by_paper} --size {size} {seed} {paper}"),
        format!("btf image {enlarged} --light 45,100 --view 0,0 --out enlarged.png"),
        format!("btf image {model} --what normals --out normals.png"),
    ];
    Section { title: "The same by hand", blocks: vec![text(intro), Block::Commands(lines)] }
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
