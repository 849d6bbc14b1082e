//! Lists of directions in a file: as rings, one by one, or the same as the list before.

use crate::bytes::Reader;
use crate::error::{Error, Result};
use crate::model::Direction;

const RINGS: u8 = 0;
const LIST: u8 = 1;
const SAME: u8 = 2;

/// Degrees within which a direction is that of a ring.
const ON_RING: f64 = 1e-7;

/// Directions of one theta, evenly spaced from an azimuth on.
struct Ring {
    theta_deg: f32,
    phi_deg: f32,
    count: u16,
}

impl Ring {
    fn direction(&self, number: usize) -> Direction {
        let turn = 360.0 * number as f64 / f64::from(self.count);
        Direction { theta_deg: f64::from(self.theta_deg), phi_deg: f64::from(self.phi_deg) + turn }
    }

    fn directions(&self) -> impl Iterator<Item = Direction> + '_ {
        (0..usize::from(self.count)).map(|number| self.direction(number))
    }
}

/// A list as rings, where it is one of rings.
fn rings_of(list: &[Direction]) -> Option<Vec<Ring>> {
    let ring = |list: &[Direction]| {
        let [theta_deg, phi_deg] = [list[0].theta_deg, list[0].phi_deg].map(|angle| angle as f32);
        let ring = Ring { theta_deg, phi_deg, count: u16::try_from(list.len()).ok()? };
        let near = |a: f64, b: f64| (a - b).abs() < ON_RING;
        let fits = |(found, given): (Direction, &Direction)| {
            near(found.theta_deg, given.theta_deg) && near(found.phi_deg, given.phi_deg)
        };
        let all = ring.directions().zip(list).all(fits);
        all.then_some(ring)
    };
    list.chunk_by(|a, b| (a.theta_deg - b.theta_deg).abs() < ON_RING).map(ring).collect()
}

/// Appends a list; `before` is one that it may be the same as.
pub(crate) fn write(bytes: &mut Vec<u8>, list: &[Direction], before: Option<&[Direction]>) {
    if before == Some(list) {
        bytes.push(SAME);
    } else if let Some(rings) = rings_of(list).filter(|rings| 10 * rings.len() < 8 * list.len()) {
        bytes.push(RINGS);
        bytes.extend((rings.len() as u16).to_le_bytes());
        for Ring { theta_deg, phi_deg, count } in rings {
            bytes.extend(theta_deg.to_le_bytes());
            bytes.extend(phi_deg.to_le_bytes());
            bytes.extend(count.to_le_bytes());
        }
    } else {
        bytes.push(LIST);
        bytes.extend((list.len() as u16).to_le_bytes());
        for direction in list {
            bytes.extend((direction.theta_deg as f32).to_le_bytes());
            bytes.extend((direction.phi_deg as f32).to_le_bytes());
        }
    }
}

/// Reads a list of 1 to `most` directions.
///
/// # Errors
/// Lists that are longer or empty, and angles that are none.
pub(crate) fn read(
    reader: &mut Reader<'_>,
    before: Option<&[Direction]>,
    most: usize,
) -> Result<Vec<Direction>> {
    let start = reader.at();
    let list: Vec<Direction> = match reader.u8()? {
        RINGS => {
            let mut list = vec![];
            for _ in 0..reader.u16()? {
                let ring = Ring { theta_deg: reader.f32()?, phi_deg: reader.f32()?, count: reader.u16()? };
                list.extend(ring.directions().take(most + 1 - list.len().min(most)));
            }
            list
        }
        LIST => (0..reader.u16()?)
            .map(|_| {
                let [theta_deg, phi_deg] = [reader.f32()?, reader.f32()?].map(f64::from);
                Ok(Direction { theta_deg, phi_deg })
            })
            .collect::<Result<_>>()?,
        SAME => before.map(<[Direction]>::to_vec).unwrap_or_default(),
        kind => return Err(Error::new(format!("a list of directions of kind {kind}"), "0, 1 or 2").at(start)),
    };
    if list.is_empty() || list.len() > most {
        return Err(Error::new(format!("{} directions", list.len()), format!("1 to {most}")).at(start));
    }
    let valid = |direction: &&Direction| {
        (0.0..=90.5).contains(&direction.theta_deg) && (0.0..=720.0).contains(&direction.phi_deg)
    };
    match list.iter().find(|direction| !valid(direction)) {
        None => Ok(list),
        Some(Direction { theta_deg, phi_deg }) => Err(Error::new(
            format!("the direction theta {theta_deg}, phi {phi_deg}"),
            "theta from 0 to 90 and phi from 0 to 360 degrees",
        )
        .at(start)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written_and_read(list: &[Direction], before: Option<&[Direction]>) -> (usize, Vec<Direction>) {
        let mut bytes = vec![];
        write(&mut bytes, list, before);
        let mut reader = Reader::new(&bytes);
        let found = read(&mut reader, before, 100).unwrap();
        assert_eq!(reader.left(), 0);
        (bytes.len(), found)
    }

    #[test]
    fn rings_take_few_bytes_and_any_list_comes_back() {
        let rings: Vec<Direction> = [(0.0, 1), (15.0, 6), (60.0, 20)]
            .into_iter()
            .flat_map(|(theta_deg, count)| {
                (0..count)
                    .map(move |k| Direction { theta_deg, phi_deg: 360.0 * f64::from(k) / f64::from(count) })
            })
            .collect();
        assert_eq!(written_and_read(&rings, None), (33, rings.clone()));
        assert_eq!(written_and_read(&rings, Some(&rings)), (1, rings.clone()));
        let mut list = rings.clone();
        list[3].phi_deg += 0.25;
        assert_eq!(written_and_read(&list, Some(&rings)), (3 + 27 * 8, list));
    }

    #[test]
    fn lists_that_cannot_be_are_refused() {
        for bytes in [
            &[SAME][..],
            &[7],
            &[LIST, 0, 0],
            &[LIST, 2, 0, 0, 0],
            &[RINGS, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 255, 255],
            &[LIST, 1, 0, 0, 0, 192, 127, 0, 0, 0, 0],
        ] {
            assert!(read(&mut Reader::new(bytes), None, 100).is_err(), "{bytes:?}");
        }
    }
}
