//! The field of one band: the causal neighbourhood of the highest evidence that the band can carry and that gives a
//! stable field, and its estimates.

use nalgebra::DMatrix;

use super::super::model::{CarKind, Level, Options};
use super::super::raster::{Boundary, Field};
use super::budget::{affords, balance, joint_channels};
use super::car::{Moments, Positions, Posterior, Prior};
use super::neighbourhood;
use super::stability::STABLE_RADIUS;
use crate::error::{Error, Result};

/// Factor by which a field that no neighbourhood makes stable is damped, again and again.
const DAMPING: f64 = 0.95;

/// One band: choice of the neighbourhood, estimates, stability.
pub(super) fn fit_level(band: &Field, options: &Options) -> Result<Level> {
    let size = [band.height, band.width];
    let mut sets = neighbourhood::nested();
    let count = sets.iter().take_while(|set| affords(size, band.channels, set, options)).count();
    sets.truncate(count.max(1));
    let (samples, parameters) = balance(size, band.channels, &sets[0], options);
    if samples < parameters {
        return Err(Error::input(format!(
            "{} x {} texels give {samples} samples for the {parameters} parameters of the smallest neighbourhood",
            size[0], size[1]
        )));
    }
    let (band, _) = band.centred();
    let joint = joint_channels(options.kind, band.channels);
    let prior = Prior::weak(band.second_moments().trace() / band.channels as f64, joint);
    let parts: Vec<Field> = match options.kind {
        CarKind::Car3d => vec![band],
        CarKind::Car2d => (0..band.channels).map(|channel| band.channel(channel)).collect(),
    };
    let evidence = log_evidence(&parts, &sets, &prior, options.boundary)?;
    // The first of the highest: ties go to the smaller set.
    let best = (0..sets.len()).fold(0, |best, n| if evidence[n] > evidence[best] { n } else { best });
    let mut tried = Vec::new();
    for n in (0..=best).rev() {
        let moments = accumulate(&parts, &sets[n], options.boundary)?;
        let mut level = estimate(&moments, &sets[n], &prior, options.kind)?;
        level.size = size;
        level.log_evidence = evidence[n];
        let mut damped = "";
        if level.radius >= STABLE_RADIUS {
            tried.push(format!("{} neighbours have radius {:.4}", sets[n].len(), level.radius));
            if n > 0 {
                continue;
            }
            damp(&mut level, &moments, options.kind)?;
            damped = ", Gamma damped";
        }
        let (sites, radius) = (sets[n].len(), level.radius);
        level.note = (!tried.is_empty())
            .then(|| format!("{}: {sites} taken{damped}, radius {radius:.4}", tried.join(", ")));
        return Ok(level);
    }
    Err(Error::internal("no neighbourhood to choose from"))
}

/// The estimates for one neighbourhood; size and evidence are left to the caller.
fn estimate(moments: &[Moments], set: &[[i32; 2]], prior: &Prior, kind: CarKind) -> Result<Level> {
    let posteriors = moments.iter().map(|m| Posterior::new(m, prior)).collect::<Result<Vec<_>>>()?;
    let gamma = stacked(&posteriors.iter().map(|p| p.gamma.clone()).collect::<Vec<_>>());
    let sigma = stacked(&posteriors.iter().map(Posterior::sigma).collect::<Vec<_>>());
    if !gamma.iter().chain(sigma.iter()).all(|value| value.is_finite()) {
        return Err(Error::input("the values are too large to square"));
    }
    let mut level = Level {
        neighbourhood: set.to_vec(),
        gamma,
        sigma,
        prior: *prior,
        gain: 1.0,
        log_evidence: 0.0,
        radius: 0.0,
        size: [0, 0],
        note: None,
    };
    level.radius = level.measure_radius(kind)?;
    Ok(level)
}

/// Evidence of every nested set over the positions of the largest, summed over the parts.
fn log_evidence(
    parts: &[Field],
    sets: &[Vec<[i32; 2]>],
    prior: &Prior,
    boundary: Boundary,
) -> Result<Vec<f64>> {
    let Some(largest) = sets.last() else { return Ok(Vec::new()) };
    let moments = accumulate(parts, largest, boundary)?;
    let score = |set: &Vec<[i32; 2]>| {
        moments.iter().map(|m| Posterior::new(&m.leading(set.len()), prior)?.log_evidence()).sum()
    };
    sets.iter().map(score).collect()
}

fn accumulate(parts: &[Field], sites: &[[i32; 2]], boundary: Boundary) -> Result<Vec<Moments>> {
    let positions = Positions::new(boundary, sites);
    parts.iter().map(|part| Moments::accumulate(part, sites, positions)).collect()
}

/// The matrices one below the other.
fn stacked(parts: &[DMatrix<f64>]) -> DMatrix<f64> {
    let rows: Vec<_> = parts.iter().flat_map(DMatrix::row_iter).collect();
    DMatrix::from_rows(&rows)
}

/// Scales Gamma until the field is stable, with the noise that the data then leave unexplained.
fn damp(level: &mut Level, moments: &[Moments], kind: CarKind) -> Result<()> {
    while level.radius >= STABLE_RADIUS {
        level.gamma *= DAMPING;
        level.radius = level.measure_radius(kind)?;
    }
    let rows = level.gamma.nrows() / moments.len();
    let residual = |(n, m): (usize, &Moments)| {
        m.residual_covariance(&level.gamma.rows(n * rows, rows).into_owned(), &level.prior)
    };
    level.sigma = stacked(&moments.iter().enumerate().map(residual).collect::<Vec<_>>());
    Ok(())
}
