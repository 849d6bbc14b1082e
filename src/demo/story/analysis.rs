//! From the measurement to the model: what was measured, the tile, its clusters, its normals.

use crate::demo::Settings;
use crate::demo::figures::Figures;
use crate::demo::pictures::{DIFFERENCE_GAIN, Lit, Subject};
use crate::demo::story::{Block, Grid, Section, Table, per_direction, shot, text};

pub(super) fn measured(settings: &Settings) -> Section {
    let lit = |light, view| Lit { view, light };
    let pairs = [
        (Lit::REFERENCE, "High light"),
        (lit((75.0, 90.0), (0.0, 0.0)), "Grazing light from the top"),
        (lit((45.0, 180.0), (45.0, 0.0)), "Light and view opposite, where highlights are"),
        (lit((15.0, 0.0), (75.0, 270.0)), "Low view from the bottom"),
    ];
    let count = settings.directions * settings.directions;
    let intro = format!(
        "<p>The archive holds {count} photographs of {size} texels: {n} views, each under {n} lights. All are \
         rectified, so the same pixel always shows the same point of the material, which is called a texel. \
         Here the photographs are rendered from a random relief, with shadows, masking and gloss, so that the \
         demo needs no download. All later steps treat them as a real measurement. A direction is given by \
         its angle θ from the surface normal and its azimuth φ, counter-clockwise from the right.</p>",
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
        "<p>From the measurement a patch of {width} × {height} texels is cut so that it can be laid beside \
         itself: its left border continues its right one, and its top its bottom. The cut follows the path \
         where it shows least, and on either side of it whole measured texels are taken, never mixtures. \
         Neighbours across the seams differ <b>{:.2}</b> times as much as neighbours elsewhere. Without the \
         cut it would be {:.2} times; 1 would be invisible.</p>",
        report.seam_visibility, report.uncut_visibility
    );
    let shots = vec![
        shot("tile", Subject::Tile, format!("<b>The tile</b>, {width} × {height}"), "The seamless tile"),
        shot(
            "tile-seams",
            Subject::Seams,
            "<b>Its seams</b>: orange texels come from beyond the right border of the patch, blue ones from \
             beyond the bottom, violet ones from beyond both",
            "The tile with the texels from beyond its borders tinted",
        ),
        shot(
            "patch-repeated",
            Subject::PatchRepeated,
            "<b>The patch 3 × 3, without the cut</b>: its borders show as straight lines",
            "The uncut patch repeated three by three, with visible borders",
        ),
        shot(
            "tile-repeated",
            Subject::TileRepeated,
            "<b>The tile 3 × 3</b>: no borders show, but one sees that it repeats",
            "The tile repeated three by three",
        ),
    ];
    Section { title: "The tile", blocks: vec![text(intro), Block::Pictures(Grid::Small, shots)] }
}

pub(super) fn clusters(figures: &Figures) -> Section {
    let report = &figures.cluster;
    let error = report.passes.last().map_or(0.0, |pass| pass.mean_lightness_error);
    let intro = format!(
        "<p>Texels that look alike under all views and lights are put into one cluster: <b>{} clusters</b>, \
         found in {} passes over the texels. Texels are compared by their lightness L* under all pairs of \
         directions; grazing views count less. The mean difference of a texel from the centre of its cluster \
         is <b>{error:.3}</b>, and from the measured texel that represents the cluster {:.3}. A difference of \
         1 is just visible.</p>",
        report.clusters,
        report.passes.len(),
        report.representative_lightness_error
    );
    let shots = vec![
        shot(
            "clusters",
            Subject::Clusters,
            "<b>Clusters</b> in false colours, from blue for the darkest to yellow for the lightest",
            "Cluster of each texel of the tile in false colours",
        ),
        shot("tile-measured", Subject::Tile, "<b>Measured</b>", "The measured tile"),
        shot(
            "tile-modelled",
            Subject::Modelled,
            "<b>By the model</b>: each texel shows the representative of its cluster",
            "The tile reconstructed from clusters and representatives",
        ),
        shot(
            "tile-difference",
            Subject::Difference,
            format!("<b>Their difference</b>, {DIFFERENCE_GAIN} times as strong; grey where there is none"),
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
            "Errors of the model over the tile under all lights (CIEDE2000 over {} texels)",
            figures.compare.colour_texels
        ),
        head: vec!["View θ", "Views", "Mean |ΔL*|", "PSNR, dB", "Mean CIEDE2000", "95 % are below"],
        rows: rows.collect(),
    };
    Section {
        title: "The clusters",
        blocks: vec![text(intro), Block::Pictures(Grid::Small, shots), Block::Table(table)],
    }
}

pub(super) fn normals(figures: &Figures) -> Section {
    let intro = format!(
        "<p>Only the paper's way to enlarge needs this step. The direction of the surface at each texel, its \
         normal, is estimated from the pictures under the {} lights of the frontal view. A random field ({}) \
         is fitted to these normals, from which normals for a surface of any size can be drawn. As a check: \
         normals deviate from their mean by {:.1}° in the tile, and by <b>{:.1}°</b> where they are drawn \
         (root mean square).</p>",
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
            "<b>Drawn from the random field</b>, at the same scale: how much normals vary is kept, and over \
             which distances, but shapes are not",
            "Normal map drawn from the random field, in false colours",
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
        caption: "Levels of the random field; 0 is the finest".to_owned(),
        head: vec!["Level", "Texels", "Neighbours", "Spectral radius (stable below 1)"],
        rows: rows.collect(),
    };
    let mut blocks = vec![text(intro), Block::Pictures(Grid::Small, shots), Block::Table(table)];
    for (number, level) in figures.field.levels.iter().enumerate() {
        if let Some(note) = &level.note {
            blocks.push(text(format!("<p>To keep level {number} stable: {note}.</p>")));
        }
    }
    Section { title: "Normals and the random field", blocks }
}
