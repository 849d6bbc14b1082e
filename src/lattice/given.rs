//! Lattices as text: `none`, `dy,dx` for ribs, `dy,dx;dy,dx` for cells, and `auto` where the lattice is to be found.

use std::fmt;
use std::str::FromStr;

use super::Lattice;

/// Which lattice to use.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum LatticeChoice {
    /// The one that is found.
    #[default]
    Auto,
    /// This one.
    Given(Lattice),
}

impl FromStr for Lattice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "none" {
            return Ok(Self::None);
        }
        let vector = |part: &str| -> Option<[f64; 2]> {
            let (dy, dx) = part.split_once(',')?;
            Some([dy.trim().parse().ok()?, dx.trim().parse().ok()?])
        };
        let vectors: Option<Vec<_>> = text.split(';').map(vector).collect();
        let expected =
            || format!("expected none, dy,dx or dy,dx;dy,dx in texels, such as 15.2,0;0,18.4, got {text:?}");
        Self::try_from(vectors.ok_or_else(expected)?)
    }
}

impl fmt::Display for Lattice {
    /// What [`FromStr`] reads. A precision, as in `{:.2}`, rounds to so many decimals.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let vectors = self.vectors();
        if vectors.is_empty() {
            return f.write_str("none");
        }
        for (number, [dy, dx]) in vectors.into_iter().enumerate() {
            f.write_str(if number > 0 { ";" } else { "" })?;
            match f.precision() {
                // Adding 0 turns -0.00 into 0.00.
                Some(decimals) => {
                    let unit = libm::pow(10.0, decimals as f64);
                    let [dy, dx] = [dy, dx].map(|n| (n * unit).round() / unit + 0.0);
                    write!(f, "{dy:.decimals$},{dx:.decimals$}")?;
                }
                None => write!(f, "{dy},{dx}")?,
            }
        }
        Ok(())
    }
}

impl FromStr for LatticeChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            _ => text.parse().map(Self::Given),
        }
    }
}

impl fmt::Display for LatticeChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Given(lattice) => lattice.fmt(f),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn texts_come_back_as_they_went() {
        for text in ["auto", "none", "0,23.12", "15.2,0;0,18.4", "5.94,-8.22;12.55,7.54"] {
            assert_eq!(text.parse::<LatticeChoice>().unwrap().to_string(), text);
        }
        assert_eq!("none".parse(), Ok(LatticeChoice::Given(Lattice::None)));
        assert_eq!(" 0, 23.5".parse(), Ok(Lattice::OneDirection { period: [0.0, 23.5] }));
        assert_eq!(format!("{:.1}", "-0.04,23.12;0.26,3".parse::<Lattice>().unwrap()), "0.0,23.1;0.3,3.0");
    }

    #[test]
    fn what_is_no_lattice_is_refused() {
        for text in
            ["", "7", "1,2,3", "a,b", "0,0", "0,nan", "inf,0", "0,0.5", "1,2;2,4", "5,0;0,5;5,5", "1e9,0"]
        {
            assert!(text.parse::<LatticeChoice>().is_err(), "{text}");
        }
        assert!("1,2,3".parse::<Lattice>().unwrap_err().contains("1,2,3"));
    }

    #[test]
    fn a_report_holds_a_list_of_vectors() {
        let lattice: Lattice = "15.2,0;0,18.4".parse().unwrap();
        let text = serde_json::to_string(&lattice).unwrap();
        assert_eq!(text, "[[15.2,0.0],[0.0,18.4]]");
        assert_eq!(serde_json::from_str::<Lattice>(&text).unwrap(), lattice);
        assert_eq!(serde_json::to_string(&Lattice::None).unwrap(), "[]");
        assert!(serde_json::from_str::<Lattice>("[[0.0,0.0]]").is_err());
    }
}
