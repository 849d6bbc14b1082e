//! Which coefficients of a component have been sent, and to which bit.

/// The first scan that broke the order, in words.
type Complaint = String;

/// For each of the 64 coefficients in zigzag order, the lowest bit sent so far; `None` before the first
/// scan that carries it (ITU-T T.81, G.1.1).
#[derive(Debug, Clone)]
pub(super) struct Progress([Option<u8>; 64]);

/// Spectral selection and successive approximation of a scan, as in its header.
#[derive(Debug, Clone, Copy)]
pub(super) struct Band {
    /// First coefficient, Ss.
    pub(super) first: u8,
    /// Last coefficient, Se.
    pub(super) last: u8,
    /// Bit down to which the coefficients were known before, Ah; 0 for a first scan.
    pub(super) high: u8,
    /// Bit down to which they are known afterwards, Al.
    pub(super) low: u8,
}

impl Progress {
    pub(super) fn new() -> Self {
        Progress([None; 64])
    }

    /// Takes a scan's band into account.
    pub(super) fn send(&mut self, band: Band) -> Result<(), Complaint> {
        let dc_known = self.0.first().is_some_and(Option::is_some);
        if band.first > 0 && !dc_known {
            return Err("coefficients before the mean (DC) of the component".into());
        }
        let range = usize::from(band.first)..=usize::from(band.last);
        for (k, state) in self.0.iter_mut().enumerate().filter(|(k, _)| range.contains(k)) {
            let in_order = match *state {
                None => band.high == 0,
                Some(known) => band.high == known && band.low.checked_add(1) == Some(band.high),
            };
            if !in_order {
                let before = state.map_or("not at all".into(), |bit| format!("to bit {bit}"));
                return Err(format!(
                    "coefficient {k}, sent {before} before, from bit {} to {}",
                    band.high, band.low
                ));
            }
            *state = Some(band.low);
        }
        Ok(())
    }

    /// The first coefficient that is not known to its last bit.
    pub(super) fn first_incomplete(&self) -> Option<usize> {
        self.0.iter().position(|state| *state != Some(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn band(first: u8, last: u8, high: u8, low: u8) -> Band {
        Band { first, last, high, low }
    }

    #[test]
    fn a_sequential_scan_completes_at_once_and_only_once() {
        let mut progress = Progress::new();
        assert_eq!(progress.first_incomplete(), Some(0));
        progress.send(band(0, 63, 0, 0)).unwrap();
        assert_eq!(progress.first_incomplete(), None);
        assert!(progress.send(band(0, 63, 0, 0)).is_err());
    }

    #[test]
    fn successive_approximation_must_go_bit_by_bit() {
        let mut progress = Progress::new();
        assert!(progress.send(band(1, 63, 0, 0)).is_err(), "AC before DC");
        progress.send(band(0, 0, 0, 1)).unwrap();
        progress.send(band(1, 5, 0, 2)).unwrap();
        progress.send(band(6, 63, 0, 0)).unwrap();
        assert!(progress.clone().send(band(1, 5, 2, 0)).is_err(), "two bits at once");
        assert!(progress.clone().send(band(1, 5, 0, 2)).is_err(), "a second first scan");
        assert!(progress.clone().send(band(1, 6, 2, 1)).is_err(), "coefficient 6 is complete");
        progress.send(band(1, 5, 2, 1)).unwrap();
        progress.send(band(0, 0, 1, 0)).unwrap();
        assert_eq!(progress.first_incomplete(), Some(1));
        progress.send(band(1, 5, 1, 0)).unwrap();
        assert_eq!(progress.first_incomplete(), None);
    }
}
