//! Are azimuths what they are said to be? The surface itself tells.
//!
//! The normals that photometric stereo finds on the frontal view belong to a surface, so their slopes (p, q) must have
//! no curl. Under a wrong reading of the lights' azimuth they get one: mirrored lights mirror one slope, turned lights turn
//! them. A turn by 180 degrees only makes hills of valleys, which no curl tells.
//!
//! The views are read against the surface found so: in a rectified image what lies above the plane appears
//! displaced away from the camera, by h tan(theta_v). The direction in which each view is displaced, as a function of the
//! azimuth given, is a turn or a mirroring of it. If the surface is inside out, so is the displacement: a turn of
//! lights and views together by 180 degrees stays unseen, one of either alone is found.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Complex, SMatrix, SVector};
use serde_json::{Value, json};

use super::finding::{Check, Finding, Severity, confidence, round};
use super::plane::{Plane, height_of_slopes};
use super::statistics::Statistics;
use crate::method::stereo::Stereo;
use crate::words::counted;

/// Name of the check.
pub const NAME: &str = "azimuth";

/// Codes of findings that light and view azimuths contradict each other.
pub(crate) const APART: [&str; 3] = ["view-azimuth-mirrored", "light-azimuth-mirrored", "azimuths-disagree"];

/// Least side of the plane, texels.
const LEAST_SIDE: usize = 24;

/// The most frontal view may lie this far from the normal, degrees.
const FRONTAL_DEG: f64 = 20.0;

/// Root mean square slope below which a surface is taken for flat.
const LEAST_SLOPE: f64 = 0.005;

/// Share of curl above which the normals belong to no surface under a reading.
const INTEGRABLE: f64 = 0.35;

/// Another reading is the right one if it leaves so many times less curl.
const BETTER: f64 = 1.6;

/// Share of curl up to which the height is known well enough to tell what it displaces.
const KNOWN: f64 = 0.1;

/// Views between these elevations show parallax without hiding too much, degrees.
const PARALLAX_DEG: (f64, f64) = (10.0, 62.0);

/// Fewer such views say nothing.
const LEAST_VIEWS: usize = 4;

/// Views must agree this well (1 = all displaced in the very direction) to be heard ...
const AGREEMENT: f64 = 0.85;

/// ... this many times better than under the mirrored reading ...
const AGREEMENT_BETTER: f64 = 1.5;

/// ... near a multiple of a right angle, degrees ...
const NEAR_RIGHT_ANGLE_DEG: f64 = 25.0;

/// ... and by a displacement that is about that of the height: these bounds on their ratio.
const PARALLAX_RATIO: (f64, f64) = (0.2, 2.5);

/// How directions must be changed to be right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reading {
    AsGiven,
    /// phi becomes -phi.
    Mirrored,
    /// phi becomes 90 - phi.
    Transposed,
    /// phi becomes phi + 90.
    Turned,
}

const READINGS: [Reading; 4] = [Reading::AsGiven, Reading::Mirrored, Reading::Transposed, Reading::Turned];

impl Reading {
    fn name(self) -> &'static str {
        match self {
            Self::AsGiven => "as given",
            Self::Mirrored => "mirrored",
            Self::Transposed => "transposed",
            Self::Turned => "turned by 90 degrees",
        }
    }

    /// The same change to views: whether it mirrors, and by how many right angles it turns after that.
    fn as_of_views(self) -> (bool, i64) {
        match self {
            Self::AsGiven => (false, 0),
            Self::Mirrored => (true, 0),
            Self::Transposed => (true, 1),
            Self::Turned => (false, 1),
        }
    }

    /// The slopes of the surface if the lights are to be read so.
    fn slopes(self, p: &Plane, q: &Plane) -> (Plane, Plane) {
        let minus = |plane: &Plane| Plane::new(plane.size, plane.values.iter().map(|value| -value).collect());
        match self {
            Self::AsGiven => (p.clone(), q.clone()),
            Self::Mirrored => (p.clone(), minus(q)),
            Self::Transposed => (q.clone(), p.clone()),
            Self::Turned => (minus(q), p.clone()),
        }
    }
}

/// How the azimuths of the views must be changed to fit the surface.
#[derive(Clone, Copy, Debug)]
struct ViewReading {
    mirrored: bool,
    /// phi becomes +-phi + quarter * 90 degrees.
    quarter: i64,
    agreement: f64,
    evidence: [f64; 5],
}

/// What the frontal view shows.
struct Surface {
    p: Plane,
    q: Plane,
    slope: f64,
    curl: [f64; 4],
}

/// Looks at the azimuths of lights and views.
pub fn check(statistics: &Statistics) -> Check {
    match surface(statistics) {
        Err(reason) => Check::not_checked(NAME, reason),
        Ok(surface) => judge(statistics, &surface),
    }
}

/// Name and curl of every reading, for the picture and the table.
fn curls(curl: [f64; 4]) -> Value {
    READINGS
        .iter()
        .zip(curl)
        .map(|(reading, curl)| (reading.name().to_owned(), json!(round(curl, 3))))
        .collect::<serde_json::Map<_, _>>()
        .into()
}

fn judge(statistics: &Statistics, surface: &Surface) -> Check {
    let best = (0..4).min_by(|&a, &b| surface.curl[a].total_cmp(&surface.curl[b])).unwrap_or(0);
    let (given, least) = (surface.curl[0], surface.curl[best]);
    if least > INTEGRABLE {
        return Check::not_checked(
            NAME,
            format!(
                "normals of the frontal view have curl under every reading (least {least:.2}): noise, or no relief"
            ),
        );
    }
    // How many times less curl the other readings leave.
    let times = given / least.max(1e-9);
    if best != 0 && times < BETTER {
        return Check::not_checked(
            NAME,
            format!(
                "no reading of the lights makes clearly better normals (curl {given:.2} as given, {least:.2} at best)"
            ),
        );
    }
    let lights = READINGS[best];
    let views = views(statistics, surface, lights);
    let second = (1..4).map(|n| surface.curl[n]).fold(f64::INFINITY, f64::min);
    let told = match &views {
        Ok(views) => format!("views agree {:.2}", views.agreement),
        Err(reason) => format!("views against lights not checked: {reason}"),
    };
    let unsure = if best == 0 && second < BETTER * given.max(1e-9) {
        "; mirrored lights would leave as little: the relief runs in one direction"
    } else {
        ""
    };
    let detail = format!("curl {given:.3} as given, {second:.3} otherwise at best{unsure}; {told}");
    let findings: Vec<Finding> = finding(lights, views.as_ref().ok(), surface, times).into_iter().collect();
    // As given, the alarm is as near as the second best reading.
    let alarm = if best == 0 { given / second.max(1e-9) / BETTER } else { times / BETTER };
    Check::done(NAME, detail, alarm, findings)
}

/// Slopes by photometric stereo on the frontal view, and the curl that each reading leaves.
fn surface(statistics: &Statistics) -> Result<Surface, String> {
    let lights = &statistics.lights;
    let size = statistics.window;
    if size.height.min(size.width) < LEAST_SIDE {
        return Err(format!("images of {} are smaller than {LEAST_SIDE} texels", statistics.size));
    }
    let frontal_deg = statistics.views[statistics.frontal].theta_rad.to_degrees();
    if frontal_deg > FRONTAL_DEG {
        return Err(format!(
            "the most frontal view lies at {frontal_deg:.0} degrees, expected {FRONTAL_DEG} at most"
        ));
    }
    let stereo = Stereo::new(lights).map_err(|error| error.to_string())?;
    let (mut p, mut q) = (Vec::with_capacity(size.texels()), Vec::with_capacity(size.texels()));
    for texel in statistics.frontal_luminance.chunks_exact(lights.len()) {
        let intensities: Vec<f64> = texel.iter().map(|&value| f64::from(value)).collect();
        let [x, y, z] = stereo.normal(&intensities).map(f64::from);
        let z = z.max(0.1);
        p.push(-x / z);
        q.push(-y / z);
    }
    let (p, q) = (Plane::new(size, p).smoothed(), Plane::new(size, q).smoothed());
    let slope = (p.variance() + q.variance()).sqrt();
    if slope < LEAST_SLOPE {
        return Err(format!("the surface is flat: slopes of {slope:.4} only"));
    }
    let [px, py, qx, qy] = [p.slope_x(), p.slope_y(), q.slope_x(), q.slope_y()].map(|plane| plane.inner(2));
    let energy = |value: &dyn Fn(usize) -> f64| (0..px.len()).map(|n| value(n).powi(2)).sum::<f64>();
    let all: f64 = [&px, &py, &qx, &qy].into_iter().flatten().map(|value| value * value).sum();
    let curl = [
        energy(&|n| py[n] - qx[n]),
        energy(&|n| py[n] + qx[n]),
        energy(&|n| qy[n] - px[n]),
        energy(&|n| qy[n] + px[n]),
    ]
    .map(|curl| curl / all.max(1e-300));
    Ok(Surface { p, q, slope, curl })
}

/// Reads the views against the surface that the lights show.
fn views(statistics: &Statistics, surface: &Surface, lights: Reading) -> Result<ViewReading, String> {
    let curl = surface.curl.iter().copied().fold(f64::INFINITY, f64::min);
    if curl > KNOWN {
        return Err(format!("with a curl of {curl:.2} the height is not known well enough"));
    }
    let (p, q) = lights.slopes(&surface.p, &surface.q);
    let height = height_of_slopes(&p, &q).details(12);
    let picture = |view: usize| {
        let values =
            statistics.view_means[view].iter().map(|&value| f64::from(value).max(1e-4).ln()).collect();
        Plane::new(statistics.window, values).smoothed().details(6)
    };
    let frontal = picture(statistics.frontal);
    let (along_x, along_y) = (frontal.slope_x(), frontal.slope_y());
    let border = 3;
    let parallax_x = height.zip(&along_x, |h, slope| h * slope).inner(border);
    let parallax_y = height.zip(&along_y, |h, slope| h * slope).inner(border);
    // Beside being displaced, a view is lit otherwise: slopes and contrast take their part.
    let columns = [parallax_x, parallax_y, p.inner(border), q.inner(border), frontal.inner(border)];
    let moment =
        SMatrix::<f64, 5, 5>::from_fn(|a, b| columns[a].iter().zip(&columns[b]).map(|(a, b)| a * b).sum());
    let inverse = moment.try_inverse().ok_or("the frontal view has no texture to be displaced")?;
    let mut displaced = Vec::new();
    for (view, direction) in statistics.views.iter().enumerate() {
        let theta_deg = direction.theta_rad.to_degrees();
        if view == statistics.frontal || !(PARALLAX_DEG.0..=PARALLAX_DEG.1).contains(&theta_deg) {
            continue;
        }
        let difference = picture(view).zip(&frontal, |a, b| a - b).inner(border);
        let right =
            SVector::<f64, 5>::from_fn(|a, _| columns[a].iter().zip(&difference).map(|(a, d)| a * d).sum());
        let found = inverse * right / direction.theta_rad.tan();
        displaced.push((direction.phi_rad, Complex::new(found[0], found[1])));
    }
    if displaced.len() < LEAST_VIEWS {
        return Err(format!("{} with parallax, expected {LEAST_VIEWS}", counted(displaced.len(), "view")));
    }
    let count = displaced.len() as f64;
    let length = displaced.iter().map(|(_, by)| by.norm()).sum::<f64>() / count;
    let fit = |sign: f64| {
        displaced.iter().map(|(phi, by)| by * Complex::new(0.0, -sign * phi).exp()).sum::<Complex<f64>>()
            / count
    };
    let (plain, mirrored) = (fit(1.0), fit(-1.0));
    let is_mirrored = mirrored.norm() > plain.norm();
    let (best, other) = if is_mirrored { (mirrored, plain) } else { (plain, mirrored) };
    let agreement = best.norm() / length.max(1e-300);
    let quarter = (best.arg() / FRAC_PI_2).round();
    let off_deg = (best.arg() - quarter * FRAC_PI_2).abs().to_degrees();
    if agreement < AGREEMENT
        || best.norm() < AGREEMENT_BETTER * other.norm()
        || off_deg > NEAR_RIGHT_ANGLE_DEG
    {
        return Err(format!(
            "parallax is not clear (agreement {agreement:.2} at {:.0} degrees)",
            best.arg().to_degrees()
        ));
    }
    if !(PARALLAX_RATIO.0..=PARALLAX_RATIO.1).contains(&best.norm()) {
        return Err(format!("parallax is {:.2} times what the relief makes", best.norm()));
    }
    let evidence =
        [best.norm(), agreement, other.norm() / length, best.arg().rem_euclid(TAU).to_degrees(), off_deg];
    Ok(ViewReading { mirrored: is_mirrored, quarter: (quarter as i64).rem_euclid(4), agreement, evidence })
}

/// What is wrong, if anything is.
fn finding(lights: Reading, views: Option<&ViewReading>, surface: &Surface, times: f64) -> Option<Finding> {
    let follow = |views: &ViewReading| (views.mirrored, views.quarter) == lights.as_of_views();
    let (code, message, repair) =
        if views.is_none_or(follow) { together(lights, views.is_some())? } else { apart(lights, *views?) };
    let times = if lights == Reading::AsGiven {
        views.map_or(1.0, |views| views.agreement / AGREEMENT * 2.0)
    } else {
        times / BETTER
    };
    Some(Finding {
        code,
        severity: Severity::Fault,
        confidence: confidence(times),
        message,
        evidence: json!({
            "curl": curls(surface.curl),
            "slope_rms": round(surface.slope, 4),
            "lights": lights.name(),
            "views": views.map(|views| json!({
                "mirrored": views.mirrored,
                "turn_deg": 90 * views.quarter,
                "parallax_over_height": round(views.evidence[0], 3),
                "agreement": round(views.evidence[1], 3),
                "agreement_mirrored": round(views.evidence[2], 3),
                "angle_deg": round(views.evidence[3], 1),
            })),
        }),
        repair: repair.map(str::to_owned),
        directions: Vec::new(),
    })
}

/// Code, message and repair where the views are wrong in the same way as the lights, or do not tell.
fn together(lights: Reading, views: bool) -> Option<(&'static str, String, Option<&'static str>)> {
    let by = if views {
        "lights by the curl of the normals, views by their parallax"
    } else {
        "by the curl of the normals; of the views the data do not tell"
    };
    match lights {
        Reading::AsGiven => None,
        Reading::Mirrored => {
            Some(("azimuth-mirrored", format!("azimuths run clockwise: {by}"), Some("--azimuth mirrored")))
        }
        Reading::Transposed => Some((
            "images-transposed",
            format!("rows and columns of the images are exchanged: {by}"),
            Some("--transpose"),
        )),
        Reading::Turned => Some((
            "images-turned",
            format!(
                "images are turned by 90 degrees against the directions: {by}; a further turn by 180 degrees \
                 would only make hills of valleys, which this does not tell"
            ),
            Some("--turn 90"),
        )),
    }
}

/// The same where lights and views are wrong in different ways.
fn apart(lights: Reading, views: ViewReading) -> (&'static str, String, Option<&'static str>) {
    let exact = |option| (views.quarter == 0).then_some(option);
    match (lights, views.mirrored) {
        (Reading::AsGiven, true) => (
            APART[0],
            "the views' azimuth runs clockwise, the lights' does not".to_owned(),
            exact("--azimuth mirrored-views"),
        ),
        (Reading::Mirrored, false) => (
            APART[1],
            "the lights' azimuth runs clockwise, the views' does not".to_owned(),
            exact("--azimuth mirrored-lights"),
        ),
        _ => (
            APART[2],
            format!(
                "lights are to be read {}, views {}turned by {} degrees: their azimuths do not start at one side",
                lights.name(),
                if views.mirrored { "mirrored and " } else { "" },
                90 * views.quarter
            ),
            None,
        ),
    }
}
