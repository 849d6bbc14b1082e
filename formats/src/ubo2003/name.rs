//! File names: reading the variants found in the wild, writing the published form.

use super::Angles;
use crate::behind::{Digits, KNOWN_FORMS, Unit, unit_behind};
use crate::fields::NumberPrefix;
use crate::file_name::{base, picture_stem};
use crate::words::counted;
use crate::{Doubt, Error, ErrorKind, Result};

/// The labels of the four angles.
const KEYS: [[u8; 2]; 4] = [TL, PL, TV, PV];
const TL: [u8; 2] = *b"tl";
const PL: [u8; 2] = *b"pl";
const TV: [u8; 2] = *b"tv";
const PV: [u8; 2] = *b"pv";

/// An angle and what follows it.
type Number<'a> = (f64, &'a str);

/// What the name of an image says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageName {
    /// The leading number, where the name has one. It follows from the directions and is not relied on.
    pub number: Option<u32>,
    /// Direction to the light.
    pub light: Angles,
    /// Direction to the viewer.
    pub view: Angles,
}

/// Reads the name of an image, or `None` if it is not one.
///
/// Only what follows the last `/` or `\` counts. It must end in a picture's extension (jpg, jpeg, png, tif,
/// tiff, hdr, exr) and have each of `tl`, `pl`, `tv`, `pv` once, followed by an angle in degrees with or
/// without decimals; theta in 0..=90, phi any (it may be negative). Case, order, separators, and whatever
/// else the name holds, do not matter, but for what stands right behind an angle (`tl7,5`, `tl7_5`): see
/// [`expect_known`]; and no unit other than degrees (`tl0.26rad`).
///
/// ```
/// use btfkit_formats::ubo2003::{Angles, parse_name};
///
/// let name = parse_name("UBO/tv000_pv000/00081 tl015 pl060 tv000 pv000.jpg").unwrap();
/// assert_eq!(name.number, Some(81));
/// assert_eq!(Some(name.light), Angles::new(15.0, 60.0));
/// assert_eq!(parse_name("img_tv0_pv0_tl15_pl60.JPG").unwrap().light, name.light);
/// assert_eq!(parse_name("readme.txt"), None);
/// ```
pub fn parse_name(path: &str) -> Option<ImageName> {
    let stem = base(picture_stem(path)?);
    Some(ImageName {
        number: leading_number(stem),
        light: Angles::new(angle(stem, TL)?, angle(stem, PL)?)?,
        view: Angles::new(angle(stem, TV)?, angle(stem, PV)?)?,
    })
}

/// What is odd about the angles of a name that has all four labels: such a name is no image, or an image of another
/// direction than it seems.
pub fn doubt(path: &str) -> Option<Doubt> {
    let stem = base(picture_stem(path)?);
    let light = Doubt::of_angles(angle(stem, TL)?, angle(stem, PL)?);
    let view = Doubt::of_angles(angle(stem, TV)?, angle(stem, PV)?);
    match light {
        Some(light) => Some(light.or_worse(view)),
        None => view,
    }
}

/// That no picture's name has the labels, but something behind an angle that is not known: `tl7,5`, `tl7p5`, `tl7_5`,
/// `tl7point5`, `tl4.5e+01`, `tl5gon`. Such a name is no image, and a caller does well not to pass over it.
///
/// # Errors
/// [`ErrorKind::Unsupported`]: the name, what was found, and the forms that are read.
pub fn expect_known(path: &str) -> Result<()> {
    let Some(stem) = picture_stem(path).map(base) else { return Ok(()) };
    let numbers: Option<Vec<Number<'_>>> = KEYS.iter().map(|&key| angle_and_rest(stem, key)).collect();
    let unread = numbers
        .into_iter()
        .flatten()
        .find_map(|(value, rest)| unit_behind(rest, Digits::Doubted).err().map(|unknown| (value, unknown)));
    match unread {
        Some((value, unknown)) => {
            let found = format!("the name {path:?} with {unknown:?} behind the angle {value}");
            Err(Error::new(ErrorKind::Unsupported, found, KNOWN_FORMS))
        }
        None => Ok(()),
    }
}

fn leading_number(stem: &str) -> Option<u32> {
    let rest = stem.trim_start_matches(|c: char| c.is_ascii_digit());
    stem.strip_suffix(rest)?.parse().ok()
}

/// The number after `key`, which must occur once. A key starts where no letter stands before it, so `atl5` has
/// none.
fn angle(stem: &str, key: [u8; 2]) -> Option<f64> {
    let (angle, rest) = angle_and_rest(stem, key)?;
    unit_behind(rest, Digits::Doubted).is_ok_and(|unit| unit == Unit::Degrees).then_some(angle)
}

/// That number, and what follows it.
fn angle_and_rest(stem: &str, key: [u8; 2]) -> Option<Number<'_>> {
    let bytes = stem.as_bytes();
    let is_key = |(_, pair): &(usize, &[u8])| pair.eq_ignore_ascii_case(&key);
    let starts_word = |(at, _): &(usize, &[u8])| {
        let before = at.checked_sub(1).and_then(|at| bytes.get(at));
        !before.is_some_and(|byte| byte.is_ascii_alphabetic() || !byte.is_ascii())
    };
    let mut numbers =
        bytes.windows(2).enumerate().filter(is_key).filter(starts_word).filter_map(|(at, _)| {
            let text = stem.get(at.checked_add(2)?..)?;
            let (number, rest) = text.split_at_checked(NumberPrefix::of(text)?.all)?;
            Some((number.parse().ok()?, rest))
        });
    match (numbers.next(), numbers.next()) {
        (Some(number), None) => Some(number),
        _ => None,
    }
}

/// The published path of an image, `tvTTT_pvPPP/NNNNN tlTTT plPPP tvTTT pvPPP.jpg`, where the number is
/// `n_views * light_index + view_index`. Other readers cut the name at fixed places, so nothing may vary.
///
/// # Errors
///
/// [`ErrorKind::Argument`]: an angle that is not a whole number of degrees, a view index of `n_views` or more,
/// or a number above 99999.
///
/// ```
/// use btfkit_formats::ubo2003::{directions_81, write_name};
///
/// # fn main() -> Result<(), btfkit_formats::Error> {
/// let d = directions_81();
/// assert_eq!(write_name(1, d[1], 0, d[0], 81)?, "tv000_pv000/00081 tl015 pl000 tv000 pv000.jpg");
/// # Ok(())
/// # }
/// ```
pub fn write_name(
    light_index: u32,
    light: Angles,
    view_index: u32,
    view: Angles,
    n_views: u32,
) -> Result<String> {
    let argument = |found: String, expected| Error::new(ErrorKind::Argument, found, expected);
    if view_index >= n_views {
        return Err(argument(
            format!("view {view_index} of {n_views}"),
            "an index below the number of views",
        ));
    }
    let product = n_views.checked_mul(light_index);
    let number =
        product.and_then(|product| product.checked_add(view_index)).filter(|&number| number <= 99999);
    let Some(number) = number else {
        let found = format!("light {light_index} and view {view_index} of {n_views}");
        return Err(argument(found, "an image number of at most 99999"));
    };
    for angle in [light.theta_deg(), light.phi_deg(), view.theta_deg(), view.phi_deg()] {
        if angle.fract() != 0.0 {
            return Err(argument(format!("an angle of {}", counted(angle, "degree")), "whole degrees"));
        }
    }
    let (tl, pl) = (light.theta_deg(), light.phi_deg());
    let (tv, pv) = (view.theta_deg(), view.phi_deg());
    Ok(format!("tv{tv:03}_pv{pv:03}/{number:05} tl{tl:03} pl{pl:03} tv{tv:03} pv{pv:03}.jpg"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variants_of_one_name() {
        let expected = ImageName {
            number: None,
            light: Angles::new(15.0, 60.0).unwrap(),
            view: Angles::new(30.0, 330.0).unwrap(),
        };
        for name in [
            "tl015 pl060 tv030 pv330.jpg",
            "img_tv30_pv330_tl15_pl60.jpg",
            "TL15-PL60-TV30-PV330.JPEG",
            "a/b\\c/tv030_pv330/tl15.0_pl60.000 tv30.0_pv330.0.Jpg",
            "tl015pl060tv030pv-30.jpg",
            "tl15__pl420__tv30__pv690.jpeg",
            "wood tl15 pl60 tv30 pv330 rectified.jpg",
            "stl9 tl15 pl60 tv30 pv330.jpg",
            "CEILING_HDR/tl015 pl060 tv030 pv330.hdr",
            "tv30.000_pv330.000_tl15.000_pl60.000.EXR",
            "tl15 pl60 tv30 pv330.png",
            "tl15 pl60 tv30 pv330.TIFF",
        ] {
            assert_eq!(parse_name(name), Some(expected), "{name:?}");
        }
    }

    #[test]
    fn decimals_and_numbers_are_kept() {
        let name = parse_name("06560 tl37.5 pl7.25 tv0 pv123.jpg").unwrap();
        assert_eq!(name.number, Some(6560));
        assert_eq!((name.light.theta_deg(), name.light.phi_deg()), (37.5, 7.25));
        assert_eq!((name.view.theta_deg(), name.view.phi_deg()), (0.0, 0.0), "one direction at the pole");
        assert_eq!(parse_name("99999999999 tl1 pl1 tv1 pv1.jpg").unwrap().number, None);
    }

    #[test]
    fn names_that_are_no_image() {
        for name in [
            "",
            ".jpg",
            "00000.jpg",
            "tl015 pl000 tv000.jpg",
            "tl015 pl000 tv000 pv.jpg",
            "tl015 pl000 tv000 pv000",
            "tl015 pl000 tv000 pv000.gif",
            "__MACOSX/tv000_pv000/._00000 tl000 pl000 tv000 pv000.jpg",
            "tl015 pl000 tv000 pv000.jpg.txt",
            "tl015 pl000 tv000 pv000.jpg/",
            "tl015 pl000/tv000 pv000.jpg",
            "tl015 tl030 pl000 tv000 pv000.jpg",
            "tl091 pl000 tv000 pv000.jpg",
            "tl-15 pl000 tv000 pv000.jpg",
            "xtl15 pl000 tv000 pv000.jpg",
            "étl15 pl000 tv000 pv000.jpg",
            "tl7,5_pl0_tv22,5_pv90.jpg",
            "tl7_pl0_tv22_pv90,5.jpg",
            "tl7p5_pl0_tv22p5_pv90.jpg",
            "tl7-5_pl0_tv22-5_pv90.jpg",
            "tl7_5_pl0_tv22_5_pv90.jpg",
            "tl4.5e+01_pl0_tv22_pv90.jpg",
            "tl7d5_pl0_tv22d5_pv90.jpg",
            "tl7\u{66b}5_pl0_tv22_pv90.jpg",
            "tl0.26rad_pl1.57rad_tv0rad_pv0rad.jpg",
            "tl15_pl0_tv22_pv0.5rad.jpg",
            "tl15 gon pl0 tv22 pv0.jpg",
            "tl4point5_pl0_tv22_pv90.jpg",
            "tl4 .5_pl0_tv22_pv90.jpg",
            "tl4_pl0_tv22_pv90x10.jpg",
            "tl0.1rev pl0 tv22 pv90.jpg",
        ] {
            assert_eq!(parse_name(name), None, "{name:?}");
        }
    }

    #[test]
    fn names_that_would_be_read_by_half() {
        for name in [
            "a/tl7,5_pl0_tv22,5_pv90.jpg",
            "tl7_pl0_tv22_pv90_5.png",
            "tl7 pl0 tv2 5 pv90.png",
            "tl7d5 pl0 tv2 pv90.png",
            "tl7point5 pl0 tv2 pv90.png",
            "tl7 pl0..5 tv2 pv90.png",
            "tl7 pl0 tv2 pv0.5pi.png",
        ] {
            assert!(expect_known(name).is_err(), "{name:?}");
        }
        for name in
            ["00000 tl007 pl000 tv022 pv090.jpg", "tl7.5_pl0_tv22_pv90 b.jpg", "tl7,5.jpg", "a5.jpg", "x"]
        {
            assert!(expect_known(name).is_ok(), "{name:?}");
        }
    }

    #[test]
    fn written_names_are_exact_and_read_back() {
        let d = super::super::directions_81();
        assert_eq!(
            write_name(0, d[0], 8, d[8], 81).unwrap(),
            "tv030_pv030/00008 tl000 pl000 tv030 pv030.jpg"
        );
        assert_eq!(
            write_name(80, d[80], 80, d[80], 81).unwrap(),
            "tv075_pv345/06560 tl075 pl345 tv075 pv345.jpg"
        );
        for (l, &light) in d.iter().enumerate() {
            for (v, &view) in d.iter().enumerate() {
                let (light_index, view_index) = (u32::try_from(l).unwrap(), u32::try_from(v).unwrap());
                let name = write_name(light_index, light, view_index, view, 81).unwrap();
                let number = Some(81 * light_index + view_index);
                assert_eq!(parse_name(&name), Some(ImageName { number, light, view }));
            }
        }
    }

    #[test]
    fn names_that_cannot_be_written() {
        let whole = Angles::new(15.0, 0.0).unwrap();
        let fraction = Angles::new(7.5, 0.0).unwrap();
        assert!(write_name(0, fraction, 0, whole, 81).is_err());
        assert!(write_name(0, whole, 0, fraction, 81).is_err());
        assert!(write_name(0, whole, 81, whole, 81).is_err());
        assert!(write_name(u32::MAX, whole, 0, whole, 81).is_err());
        assert!(write_name(99999, whole, 0, whole, 1).is_ok());
        assert!(write_name(100_000, whole, 0, whole, 1).is_err());
    }
}
