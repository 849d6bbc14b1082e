//! From the measurement to the model: what was measured, the tile, its clusters, its normals.

use crate::demo::Settings;
use crate::demo::figures::Figures;
use crate::demo::pictures::{DIFFERENCE_GAIN, Lit, Subject};
use crate::demo::story::{Block, Grid, Section, Table, per_direction, shot, text};

pub(super) fn measured(settings: &Settings) -> Section {
    let lit = |light, view| Lit { view, light };
    let pairs = [
        (Lit::REFERENCE, "Reference"),
        (lit((75.0, 90.0), (0.0, 0.0)), "Grazing light from above"),
        (lit((45.0, 180.0), (45.0, 0.0)), "Near the mirror direction"),
        (lit((15.0, 0.0), (75.0, 270.0)), "Tilted view from below"),
    ];
    let count = settings.directions * settings.directions;
    let intro = format!(
        "<p>The archive holds {count} photographs of {size} texels: {n} lights for each of {n} views, \
         rectified, in the layout of the Bonn UBO2003 sets. The material is rendered from a seeded height \
         field with shadows, masking and gloss, so the demo needs no download; every later step reads the \
         archive as it would a measured one. Directions are the polar angle θ from the surface normal and the \
         azimuth φ, counter-clockwise from the right.</p>",
        size = settings.sample,
        n = settings.directions,
    );
    Section {
        title: "The measurement",
        blocks: vec![
            text(intro),
            Block::Pictures(
                Grid::Small,
                per_direction("measured", "Measured material", &pairs, Subject::Measured),
            ),
        ],
    }
}

pub(super) fn tile(figures: &Figures) -> Section {
    let report = &figures.tile;
    let [height, width] = report.size;
    let intro = format!(
        "<p>A patch of {width} × {height} texels is cut so that its left border continues its right one and \
         its top its bottom one. Texels are taken whole, from one side or the other of a minimum-error path, \
         so the tile is a map of measured texels. The step across its seams is <b>{:.2}</b> times that \
         between ordinary neighbours; repeated without the cut it is {:.2} (1 cannot be told from the \
         material).</p>",
        report.seam_visibility, report.uncut_visibility
    );
    let shots = vec![
        shot("tile", Subject::Tile, format!("<b>The tile</b>, {width} × {height}"), "The seamless tile"),
        shot(
            "tile-seams",
            Subject::Seams,
            "<b>Its seams</b>: orange was taken from beyond the right border of the patch, blue from beyond \
             the bottom one, violet from beyond both",
            "The tile with the texels from beyond its borders tinted",
        ),
        shot(
            "patch-repeated",
            Subject::PatchRepeated,
            "<b>The patch 3 × 3, not cut</b>: its borders show as straight lines",
            "The uncut patch repeated three by three, with visible borders",
        ),
        shot(
            "tile-repeated",
            Subject::TileRepeated,
            "<b>The tile 3 × 3</b>: it joins itself, but it repeats",
            "The tile repeated three by three",
        ),
    ];
    Section { title: "The tile", blocks: vec![text(intro), Block::Pictures(Grid::Small, shots)] }
}

pub(super) fn clusters(figures: &Figures) -> Section {
    let report = &figures.cluster;
    let error = report.passes.last().map_or(0.0, |pass| pass.mean_lightness_error);
    let intro = format!(
        "<p>The tile's texels are clustered by their whole reflectance, L* under all pairs of directions, \
         views weighted by the cosine of their polar angle (equation (1)): <b>{} clusters</b> after {} passes, \
         {} of a single texel. The objective, the mean weighted |ΔL*| of a texel, is <b>{error:.3}</b> from \
         the centres and {:.3} from the representatives, the measured colour BRDFs that stand for the \
         clusters.</p>",
        report.clusters,
        report.passes.len(),
        report.single_texel_clusters,
        report.representative_lightness_error
    );
    let shots = vec![
        shot(
            "clusters",
            Subject::Clusters,
            "<b>Clusters</b> in false colours",
            "Cluster of each texel of the tile in false colours",
        ),
        shot("tile-measured", Subject::Tile, "<b>Measured</b>", "The measured tile"),
        shot(
            "tile-modelled",
            Subject::Modelled,
            "<b>By the model</b>: each texel shows its cluster's representative",
            "The tile re-made from clusters and representatives",
        ),
        shot(
            "tile-difference",
            Subject::Difference,
            format!("<b>Difference</b>, {DIFFERENCE_GAIN} times, around mid grey"),
            "Difference of model and measurement",
        ),
    ];
    let rows = figures.compare.elevations.iter().chain([&figures.compare.all]).map(|errors| {
        vec![
            errors.view_theta_deg.map_or("all".to_owned(), |theta| format!("{theta}°")),
            errors.views.to_string(),
            format!("{:.3}", errors.lightness),
            errors.psnr_text(),
            format!("{:.3}", errors.ciede2000),
            format!("{:.2}", errors.ciede2000_95),
        ]
    });
    let table = Table {
        caption: format!(
            "The tile by the model against the measured tile, all lights (CIEDE2000 over {} texels)",
            figures.compare.colour_texels
        ),
        head: vec!["View θ", "Views", "Mean |ΔL*|", "PSNR, dB", "CIEDE2000", "95 % of it"],
        rows: rows.collect(),
    };
    Section {
        title: "Clusters and representatives",
        blocks: vec![text(intro), Block::Pictures(Grid::Small, shots), Block::Table(table)],
    }
}

pub(super) fn normals(figures: &Figures) -> Section {
    let intro = format!(
        "<p>Photometric stereo under the {} lights of the frontal view gives the tile's normal map. A \
         pyramid of causal autoregressive fields ({}) is fitted to it, each level with the neighbourhood \
         of highest evidence, and synthesises normals for a plane of any size. Their root mean square angle \
         from the mean normal is {:.1}° in the tile and <b>{:.1}°</b> synthesised.</p>",
        figures.normals.lights, figures.field.mrf, figures.normals.spread_deg, figures.synthesised_spread_deg
    );
    let shots = vec![
        shot(
            "normals",
            Subject::Normals,
            "<b>Normal map of the tile</b>: x in red, y in green, z in blue",
            "Normal map of the tile in false colours",
        ),
        shot(
            "normals-synthesised",
            Subject::SynthesisedNormals,
            "<b>Synthesised normals</b>, the first part of the plane at the same scale: a Gaussian field \
             keeps second-order statistics, not shapes",
            "Synthesised normal map in false colours",
        ),
    ];
    let rows = figures.field.levels.iter().enumerate().map(|(number, level)| {
        vec![
            number.to_string(),
            format!("{} × {}", level.size[1], level.size[0]),
            level.eta.to_string(),
            format!("{:.3}", level.radius),
        ]
    });
    let table = Table {
        caption: "Levels of the random field, 0 the finest".to_owned(),
        head: vec!["Level", "Texels", "Neighbours η", "Spectral radius (stable below 1)"],
        rows: rows.collect(),
    };
    let mut blocks = vec![text(intro), Block::Pictures(Grid::Small, shots), Block::Table(table)];
    for (number, level) in figures.field.levels.iter().enumerate() {
        if let Some(note) = &level.note {
            blocks.push(text(format!("<p>Level {number}, to be stable: {note}.</p>")));
        }
    }
    Section { title: "Normals and their synthesis", blocks }
}
