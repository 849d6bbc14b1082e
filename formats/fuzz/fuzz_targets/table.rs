//! Any bytes as a table: no panic, files inside the folder and each once, and a report on its pairs that adds up.
#![no_main]

use btfkit_formats::{Catalogue, Limits, table};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let mut limits = Limits::default();
    limits.max_entries = 1000;
    let Ok(table) = table::read(bytes, &limits) else { return };
    assert!((1..=1000).contains(&table.rows.len()));
    assert!(table.rows.windows(2).all(|pair| pair[0].line <= pair[1].line));
    for row in &table.rows {
        assert!(!row.file.is_empty() && !row.file.starts_with('/') && !row.file.contains('\\'));
        assert!(row.file.split('/').all(|part| part != ".." && !part.is_empty()));
    }
    let files = table.rows.iter().map(|row| (row.file.as_str(), Some(row.pair)));
    match Catalogue::from_pairs(files) {
        Ok(set) => assert_eq!(set.views().len() * set.lights().len(), table.rows.len()),
        Err(errors) => {
            let doubled: usize = errors.duplicates.iter().map(|d| d.names.len() - 1).sum();
            let pairs = errors.views as u64 * errors.lights as u64;
            assert_eq!((errors.images - doubled) as u64 + errors.missing_count, pairs);
        }
    }
});
