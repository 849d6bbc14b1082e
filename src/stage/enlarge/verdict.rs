//! Does an enlargement look like its tile? Cheap measures on a window in its middle; `btf judge` measures more.

use serde::Serialize;

use super::Subject;
use crate::error::Result;
use crate::likeness::Lightness;
use crate::likeness::copies::LargestCopy;
use crate::likeness::verdict::{Tally, Verdict as Counted, WINDOW_SIDE, excess_peak};
use crate::shape::Size;
use crate::stage::judge::frontal_pair;
use crate::store::enlarged::{Enlarged, Method};
use crate::store::model::Stage;

/// Shares of clusters in common below which rare parts of the material are being lost.
const LEAST_SHARES: f64 = 0.9;

/// Excess of the autocorrelation's peak above which repetition can be seen; as far below zero, order is lost.
const MOST_EXCESS: f64 = 0.15;

/// Share of the window in one unbroken copy above which an enlargement is mostly a copy.
const MOST_COPY: f64 = 0.25;

/// Share of the measured plane from which on a larger tile gains little.
const NEARLY_ALL: f64 = 0.6;

/// Share of the tile that may be black from everywhere: a mask or a border, and no material.
const MOST_BLACK: f64 = 0.25;

/// L* codes up to this one are black, of 255.
const BLACK_CODE: u8 = 3;

/// What the cheap measures say of an enlargement.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// Shares and copies in the window.
    #[serde(flatten)]
    pub counted: Counted,
    /// By how much the largest autocorrelation at shifts of 12 texels or more exceeds the tile's.
    pub excess_peak: f64,
    /// Share of the tile whose texels are black from all views and under all lights.
    pub black: f64,
    /// What makes the enlargement look unlike its tile, and what to do about it.
    pub warnings: Vec<String>,
}

impl Subject {
    /// The verdict on an output; none on one that other runs have not finished yet, or that is smaller than the tile:
    /// the shares of a part are its own.
    pub(super) fn verdict(&self, output: &Enlarged, method: Method) -> Result<Option<Verdict>> {
        let most = Size::new(WINDOW_SIDE, WINDOW_SIDE);
        let [window, part] = [output.size(), self.tile].map(|plane| plane.middle(most));
        let is_smaller = window.size.height < part.size.height || window.size.width < part.size.width;
        if is_smaller || !output.is_whole() {
            return Ok(None);
        }
        let (index, source) = (output.read(window)?, output.read_source(window)?);
        let tile = self.model.index()?;
        let wraps = self.model.tile()?.wraps;
        let copy = source.is_some().then(|| LargestCopy::new(self.tile.window(), self.tile.width, wraps));
        let mut tally = Tally::new(&tile, self.clusters.clusters, copy);
        for y in 0..window.size.height {
            let row = y * window.size.width..(y + 1) * window.size.width;
            tally.push(&index[row.clone()], source.as_ref().map_or(&[], |source| &source[row]));
        }
        let lightness = self.lightness()?;
        let picture = |size: Size, index: &[u16]| {
            let code = |&cluster: &u16| lightness.get(usize::from(cluster)).copied().unwrap_or_default();
            Lightness::of_codes(size, index.iter().map(code))
        };
        let black = self.black(&tile)?;
        let tile = picture(self.tile, &tile).part(part);
        let excess_peak = excess_peak(&picture(window.size, &index), &tile);
        let report = self.model.tile_report()?;
        let [of_tile, of_plane] =
            [report.size, report.measurement_size].map(|[height, width]| height * width);
        let more = if of_tile as f64 > NEARLY_ALL * of_plane as f64 {
            "measure a larger part of the material"
        } else {
            "make the model of a larger tile (btf model MEASUREMENT MODEL --force with --tile WIDTHxHEIGHT, or none for the \
             whole plane)"
        };
        let mut verdict = Verdict { counted: tally.verdict(), excess_peak, black, warnings: Vec::new() };
        verdict.warnings = verdict.warnings(method, more, &self.lattice_advice()?);
        Ok(Some(verdict))
    }

    /// What to do where an enlargement is less regular than its tile.
    fn lattice_advice(&self) -> Result<String> {
        let found = if self.model.has(Stage::Appearance)? {
            self.model.appearance_report()?.found
        } else {
            "none".to_owned()
        };
        let why = match found.as_str() {
            "none" => {
                "no lattice was found, or none was wanted; if you know the steps of its cells, name them"
            }
            _ => "the lattice that was found may be wrong; if you know the steps of its cells, name them",
        };
        let model = self.model.path().display();
        Ok(format!("{why} (btf appearance {model} --force --lattice 'dy,dx;dy,dx')"))
    }

    /// Share of the texels of a tile whose clusters are black from everywhere.
    fn black(&self, tile: &[u16]) -> Result<f64> {
        let [views, lights] = self.model.directions()?;
        let brdf = (views.len() * lights.len()).max(1);
        let centres = self.model.centres()?;
        let is_black: Vec<bool> =
            centres.chunks(brdf).map(|codes| codes.iter().all(|&code| code <= BLACK_CODE)).collect();
        let black = tile.iter().filter(|&&cluster| is_black.get(usize::from(cluster)) == Some(&true)).count();
        Ok(black as f64 / tile.len().max(1) as f64)
    }

    /// L* code of each cluster, from the most frontal view under its lowest light, which shows relief.
    fn lightness(&self) -> Result<Vec<u8>> {
        let [views, lights] = self.model.directions()?;
        let [view, light] = frontal_pair(&views, &lights)?;
        let brdf = views.len() * lights.len();
        let first = view * lights.len() + light;
        Ok(self.model.centres()?.into_iter().skip(first).step_by(brdf).collect())
    }
}

impl Verdict {
    /// What is wrong, each with what to do: `more` is how to come by a larger tile, `lattice` what to do about order that
    /// is lost.
    fn warnings(&self, method: Method, more: &str, lattice: &str) -> Vec<String> {
        let coherent = method == Method::Coherent;
        let advise = |advice: String| if coherent { advice } else { "take --method coherent".to_owned() };
        let mut warnings = Vec::new();
        if self.counted.shares < LEAST_SHARES {
            warnings.push(format!(
                "only {:.0} % of the clusters' shares are those of the tile, rare ones are being lost: {}",
                100.0 * self.counted.shares,
                advise(more.to_owned())
            ));
        }
        if self.excess_peak < -MOST_EXCESS {
            warnings.push(format!(
                "it is less regular than the tile by {:.2}: {}",
                -self.excess_peak,
                advise(lattice.to_owned())
            ));
        }
        if self.black > MOST_BLACK {
            warnings.push(format!(
                "{:.0} % of the tile are black from everywhere, and as much of the enlargement: crop the pictures to the \
                 material and import them again",
                100.0 * self.black
            ));
        }
        let copies = self.counted.largest_copy.is_some_and(|copy| copy > MOST_COPY);
        if copies || self.excess_peak > MOST_EXCESS {
            let what =
                if copies { "a large part is one copy of the tile" } else { "it repeats more than the tile" };
            warnings.push(format!("{what}: {}", advise(format!("{more}, or take a larger --jitter"))));
        }
        warnings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_fault_has_its_warning_and_none_is_none() {
        let of = |shares, excess_peak, largest_copy, method| {
            let counted = Counted { shares, largest_copy };
            Verdict { counted, excess_peak, black: 0.0, warnings: Vec::new() }.warnings(
                method,
                "more",
                "name its lattice: --lattice",
            )
        };
        let coherent = |shares, peak, copy| of(shares, peak, copy, Method::Coherent);
        assert!(coherent(0.95, 0.0, Some(0.02)).is_empty());
        for (shares, peak, copy, told) in [
            (0.85, 0.0, None, "85 %"),
            (0.95, -0.3, None, "--lattice"),
            (0.95, 0.3, Some(0.02), "repeats more"),
            (0.95, 0.0, Some(0.5), "one copy"),
        ] {
            let warnings = coherent(shares, peak, copy);
            assert!(warnings.len() == 1 && warnings[0].contains(told), "{warnings:?}");
        }
        assert!(of(0.5, 0.0, None, Method::Paper)[0].ends_with("take --method coherent"));
    }
}
