//! Any lines as names: no panic, angles in their ranges, and a report that adds up.
#![no_main]

use btfkit_formats::ubo2003::{Catalogue, parse_name, write_name};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    for name in text.lines() {
        let Some(image) = parse_name(name) else { continue };
        for angles in [image.light, image.view] {
            assert!((0.0..=90.0).contains(&angles.theta_deg()));
            assert!((0.0..360.0).contains(&angles.phi_deg()));
        }
        if let Ok(written) = write_name(0, image.light, 0, image.view, 1) {
            let again = parse_name(&written).unwrap();
            assert_eq!((again.light, again.view, again.number), (image.light, image.view, Some(0)));
        }
    }
    match Catalogue::from_names(text.lines()) {
        Ok(catalogue) => {
            let images = catalogue.views().len() * catalogue.lights().len();
            assert_eq!(images + catalogue.ignored(), text.lines().count());
        }
        Err(errors) => {
            let doubled: usize = errors.duplicates.iter().map(|d| d.names.len() - 1).sum();
            let pairs = errors.views as u64 * errors.lights as u64;
            assert_eq!((errors.images - doubled) as u64 + errors.missing_count, pairs);
            assert!(errors.missing.len() as u64 <= errors.missing_count);
            assert!(errors.to_string().starts_with("found"));
        }
    }
});
