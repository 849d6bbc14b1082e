//! Any first line as a pattern, any lines as names: no panic, and a recognised pattern fits every picture.
#![no_main]

use btfkit_formats::named::{Pattern, recognise};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let mut lines = text.lines();
    if let Some(pattern) = lines.next().and_then(|line| Pattern::parse(line).ok()) {
        assert_eq!(Pattern::parse(&pattern.to_string()).unwrap(), pattern);
        for pair in lines.clone().filter_map(|name| pattern.angles(name)) {
            assert!((0.0..=90.0).contains(&pair.light.theta_deg()));
            assert!(pattern.has_view() || pair.view.theta_deg() == 0.0);
        }
    }
    if let Ok(pattern) = recognise(lines.clone()) {
        let fitting = lines.filter(|name| pattern.angles(name).is_some()).count();
        assert!(fitting > 0);
        assert_eq!(Pattern::parse(&pattern.to_string()).unwrap(), pattern);
    }
});
