//! Whole files: what comes back, and what does not.
#![allow(clippy::unwrap_used, clippy::panic)]

use btfkit_packed::{Component, Direction, Ending, Model, Target, outline, pack, unpack};

/// A model with smooth parts, noise, and directions on rings or anywhere.
fn model(size: [usize; 2], counts: [usize; 3], components: usize) -> Model {
    let mut state = 7u32;
    let mut noise = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1u32 << 24) - 0.5
    };
    let [views, lights, channels] = counts;
    let direction = |n: usize| Direction {
        theta_deg: f64::from((n % 7) as f32 * 12.5),
        phi_deg: f64::from((n as f32 * 137.5) % 360.0),
    };
    let list = |count: usize| (0..count).map(direction).collect::<Vec<_>>();
    let brdf = views * lights * channels;
    let mean = (0..brdf).map(|n| 120.0 + 60.0 * ((n / channels) as f64 * 0.1).sin() + noise()).collect();
    let components = (0..components).map(|k| {
        let strength = 900.0 / (k as f64 + 1.0).powi(2);
        let mut basis: Vec<f64> = (0..brdf).map(|n| ((n * (k + 2)) as f64 * 0.03).cos() + noise()).collect();
        let norm = basis.iter().map(|v| v * v).sum::<f64>().sqrt();
        basis.iter_mut().for_each(|value| *value /= norm);
        let texels = size[0] * size[1];
        let wave = |n: usize| ((n % size[1]) as f64 * 0.4 * (k + 1) as f64).sin();
        Component { basis, coefficients: (0..texels).map(|n| strength * (wave(n) + noise())).collect() }
    });
    let components = components.collect();
    let channels = (0..channels).map(|n| format!("{}", 400 + 10 * n)).collect();
    let texts = vec![("licence".to_owned(), "CC0-1.0".to_owned())];
    Model { size, wraps: true, views: list(views), lights: list(lights), channels, texts, mean, components }
}

/// A model whose texels are of few kinds, as after a vector quantisation.
fn quantised(size: [usize; 2], kinds: usize) -> Model {
    let given = model(size, [6, 7, 3], 6);
    let kind = |texel: usize| (texel * texel / 5 + texel / size[1] * 3) % kinds;
    let components = given.components.iter().map(|part| Component {
        coefficients: (0..size[0] * size[1])
            .map(|texel| part.coefficients[kind(texel) * 7 % part.coefficients.len()])
            .collect(),
        basis: part.basis.clone(),
    });
    Model { components: components.collect(), ..given }
}

/// Squared error between two models' values.
fn error(a: &Model, b: &Model) -> f64 {
    let value = |model: &Model, texel: usize, place: usize| {
        let parts = model.components.iter().map(|part| part.coefficients[texel] * part.basis[place]);
        model.mean[place] + parts.sum::<f64>()
    };
    let all = (0..a.texels()).flat_map(|texel| (0..a.brdf()).map(move |place| (texel, place)));
    all.map(|(texel, place)| (value(a, texel, place) - value(b, texel, place)).powi(2)).sum()
}

#[test]
fn a_model_comes_back_as_good_as_is_said_with_what_is_said_of_it() {
    for (size, counts, components) in
        [([16, 24], [9, 13, 3], 5), ([7, 5], [1, 30, 1], 3), ([1, 1], [6, 6, 4], 1), ([20, 20], [4, 4, 3], 0)]
    {
        let model = model(size, counts, components);
        for target in [Target::Bytes(1500), Target::Decibels(45.0)] {
            let packed = pack(&model, Some(0.0), target).unwrap();
            let found = unpack(&packed.bytes).unwrap();
            assert_eq!(found.ending, Ending::Whole);
            let back = &found.model;
            assert_eq!((back.size, back.wraps, &back.texts), (model.size, true, &model.texts));
            assert_eq!((&back.views, &back.channels), (&model.views, &model.channels));
            let mse = error(&model, back) / (model.texels() * model.brdf()) as f64;
            let decibels = 10.0 * (255.0f64.powi(2) / mse).log10();
            // These components are not quite orthogonal, and one texel has nothing to be wrong about.
            assert!(
                decibels > 100.0 || (decibels - packed.decibels).abs() < 0.6,
                "{decibels} {}",
                packed.decibels
            );
            match target {
                Target::Bytes(bytes) => assert!(packed.bytes.len() <= bytes),
                Target::Decibels(wanted) => assert!(packed.decibels >= wanted && decibels > wanted - 0.6),
            }
            assert_eq!(pack(&model, Some(0.0), target).unwrap().bytes, packed.bytes);
        }
    }
}

#[test]
fn texels_of_few_kinds_take_a_palette() {
    let given = quantised([24, 26], 30);
    for target in [Target::Bytes(2600), Target::Decibels(40.0)] {
        let packed = pack(&given, Some(0.0), target).unwrap();
        let found = unpack(&packed.bytes).unwrap();
        let centres = outline(&packed.bytes).unwrap().centres;
        assert!(centres.is_some_and(|centres| (20..=30).contains(&centres)), "{centres:?}");
        let mse = error(&given, &found.model) / (given.texels() * given.brdf()) as f64;
        let decibels = 10.0 * (255.0f64.powi(2) / mse).log10();
        assert!((decibels - packed.decibels).abs() < 0.6, "{decibels} {}", packed.decibels);
        assert_eq!(pack(&given, Some(0.0), target).unwrap().bytes, packed.bytes);
    }
    // A texture of smooth waves does not.
    let smooth = pack(&model([24, 26], [6, 7, 3], 3), Some(0.0), Target::Bytes(1200)).unwrap();
    assert_eq!(outline(&smooth.bytes).unwrap().centres, None);
}

#[test]
fn every_cut_gives_the_sections_before_it_or_an_error() {
    for model in [model([16, 16], [6, 6, 3], 4), quantised([24, 24], 30)] {
        cut_everywhere(&model);
    }
}

fn cut_everywhere(model: &Model) {
    let packed = pack(model, Some(0.0), Target::Bytes(1400)).unwrap();
    let whole = unpack(&packed.bytes).unwrap();
    assert!(whole.planes.len() >= 4);
    let mut before = f64::INFINITY;
    for plane in &whole.planes {
        let part = unpack(&packed.bytes[..plane.end]).unwrap();
        let error = error(model, &part.model);
        assert!(error < before && part.planes.last() == Some(plane));
        before = error;
    }
    for length in 0..packed.bytes.len() {
        let sections = whole.planes.iter().filter(|plane| plane.end <= length).count();
        match unpack(&packed.bytes[..length]) {
            Ok(found) => {
                assert_eq!(found.planes, whole.planes[..sections]);
                assert_eq!(found.ending, Ending::Cut(whole.planes[sections - 1].end));
            }
            Err(error) => assert!(sections == 0 && error.offset.is_some(), "{length}: {error}"),
        }
    }
    let mut longer = packed.bytes.clone();
    longer.push(0);
    assert!(unpack(&longer).unwrap_err().to_string().contains("behind the last section"));
}

#[test]
fn every_flipped_bit_is_an_error_or_a_shorter_prefix() {
    for (model, bytes) in [(model([8, 8], [5, 5, 3], 3), 700), (quantised([24, 24], 30), 1200)] {
        flip_everywhere(&model, bytes);
    }
}

fn flip_everywhere(model: &Model, bytes: usize) {
    let packed = pack(model, Some(0.0), Target::Bytes(bytes)).unwrap();
    let whole = unpack(&packed.bytes).unwrap();
    for bit in 0..8 * packed.bytes.len() {
        let mut bytes = packed.bytes.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        let before = whole.planes.iter().filter(|plane| plane.end <= bit / 8).count();
        match unpack(&bytes) {
            Ok(found) => {
                assert!(found.ending != Ending::Whole && found.planes == whole.planes[..before], "{bit}");
            }
            Err(_) => assert_eq!(before, 0, "{bit}"),
        }
    }
}

/// Puts the right checksums into a file that somebody else put together.
fn with_checksums(mut bytes: Vec<u8>) -> Vec<u8> {
    let header = 22 + u32::from_le_bytes(bytes[18..22].try_into().unwrap()) as usize;
    let put = |bytes: &mut Vec<u8>, from: usize, to: usize| {
        if let Some(covered) = bytes.get(from..to).map(crc32fast::hash)
            && let Some(place) = bytes.get_mut(to..to + 4)
        {
            place.copy_from_slice(&covered.to_le_bytes());
        }
    };
    put(&mut bytes, 0, header);
    let (mut at, mut before) = (header + 4, 0);
    if bytes[4] == 2
        && let Some(length) = bytes.get(at + 2..at + 6)
    {
        let end = at + 6 + u32::from_le_bytes(length.try_into().unwrap()) as usize;
        put(&mut bytes, at, end);
        at = end.saturating_add(4);
    }
    while let Some(head) = bytes.get(at..at + 6) {
        let length = u32::from_le_bytes(head[..4].try_into().unwrap()) as usize;
        let count = u16::from_le_bytes(head[4..].try_into().unwrap());
        let end = at + 8 + 2 * usize::from(count.saturating_sub(before)) + length;
        put(&mut bytes, at, end);
        (at, before) = (end + 4, count);
    }
    bytes
}

#[test]
fn files_with_right_checksums_and_wrong_contents_are_read_or_refused_in_little_time() {
    for (model, bytes, least) in
        [(model([8, 8], [5, 5, 3], 3), 700, 500), (quantised([24, 24], 30), 1200, 200)]
    {
        spoil(&model, bytes, least);
    }
}

fn spoil(model: &Model, bytes: usize, least: usize) {
    let packed = pack(model, Some(0.0), Target::Bytes(bytes)).unwrap();
    assert_eq!(with_checksums(packed.bytes.clone()), packed.bytes);
    let mut state = 3u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as usize
    };
    let mut read = 0;
    for _ in 0..1500 {
        let mut bytes = packed.bytes.clone();
        for _ in 0..1 + next() % 3 {
            let at = next() % bytes.len();
            bytes[at] = next() as u8;
        }
        if let Ok(found) = unpack(&with_checksums(bytes)) {
            found.model.check().unwrap();
            read += 1;
        }
    }
    assert!(read > least, "{read}");
}

#[test]
fn numbers_that_no_values_can_be_made_of_are_refused_by_whoever_meets_them_first() {
    let given = model([8, 8], [5, 5, 3], 3);
    let packed = pack(&given, Some(0.0), Target::Bytes(700)).unwrap();
    let forged = |at: usize, with: &[u8]| {
        let mut bytes = packed.bytes.clone();
        bytes[at..at + with.len()].copy_from_slice(with);
        with_checksums(bytes)
    };
    // The step lies at byte 14: beyond all numbers, and so large that what it makes of them is.
    for (step, told) in
        [(f32::MAX, "byte 14: found a step of 3.4"), (f32::INFINITY, "a step of inf"), (0.0, "a step of 0")]
    {
        let file = forged(14, &step.to_le_bytes());
        assert!(unpack(&file).unwrap_err().to_string().contains(told), "{:?}", unpack(&file));
        assert!(outline(&file).unwrap_err().to_string().contains(told));
    }
    let file = forged(14, &(1e19f32).to_le_bytes());
    let error = unpack(&file).unwrap_err().to_string();
    assert!(error.contains("expected finite numbers, of at most"), "{error}");
    // Components of the first section, behind the header and the length of the section.
    let header = 22 + u32::from_le_bytes(packed.bytes[18..22].try_into().unwrap()) as usize + 4;
    for count in [65u16, 65535] {
        let bytes = packed.bytes[..header + 4].to_vec();
        let bytes =
            [&bytes[..], &count.to_le_bytes(), &[0; 2], &vec![0; 2 * usize::from(count) + 4]].concat();
        let mut bytes = bytes;
        bytes[header..header + 4].fill(0);
        let file = with_checksums(bytes);
        let told = format!("found {count} components, expected at most 64");
        assert!(unpack(&file).unwrap_err().to_string().contains(&told), "{:?}", unpack(&file));
        assert!(outline(&file).unwrap_err().to_string().contains(&told));
    }
    let mut large = given.clone();
    large.mean[7] = 1e20;
    assert!(
        pack(&large, Some(0.0), Target::Bytes(999)).unwrap_err().to_string().contains("1e20 of the mean")
    );
}

#[test]
fn an_outline_says_what_unpacking_gives_and_takes() {
    for (size, counts, components) in
        [([16, 24], [9, 13, 3], 5), ([1, 300], [2, 400, 1], 3), ([97, 89], [4, 4, 1], 2)]
    {
        let packed = pack(&model(size, counts, components), Some(0.0), Target::Bytes(4000)).unwrap();
        let (outline, found) = (outline(&packed.bytes).unwrap(), unpack(&packed.bytes).unwrap());
        let model = &found.model;
        assert_eq!((outline.size, outline.wraps, &outline.texts), (model.size, model.wraps, &model.texts));
        assert_eq!(
            (&outline.views, &outline.lights, &outline.channels),
            (&model.views, &model.lights, &model.channels)
        );
        assert_eq!((outline.planes.clone(), outline.ending), (found.planes.clone(), found.ending));
        assert_eq!(outline.components(), model.components.len());
        let numbers = (model.components.len() + 1) * (model.brdf() + model.texels());
        assert!(outline.memory_bytes() as usize >= packed.bytes.len() + 20 * numbers);
    }
}

#[test]
fn what_cannot_be_reached_is_said() {
    let given = model([8, 8], [5, 5, 3], 2);
    let error = |target| pack(&given, Some(1e6), target).unwrap_err().to_string();
    assert!(error(Target::Bytes(10)).contains("expected at least"), "{}", error(Target::Bytes(10)));
    assert!(error(Target::Decibels(90.0)).contains("expected at most"), "{}", error(Target::Decibels(90.0)));
    let mut broken = given.clone();
    broken.mean[3] = f64::NAN;
    assert!(pack(&broken, Some(0.0), Target::Bytes(999)).unwrap_err().to_string().contains("NaN"));
    // A file that has everything is not made longer.
    let all = pack(&given, Some(0.0), Target::Bytes(1 << 30)).unwrap();
    assert!(all.decibels > 60.0 && all.bytes.len() < 40_000, "{} {}", all.decibels, all.bytes.len());
}

/// A model of whole numbers alone, the same on every machine.
fn fixture() -> Model {
    let direction = |theta: u32, phi: u32| Direction { theta_deg: theta.into(), phi_deg: phi.into() };
    let views =
        [(0, 0), (30, 0), (30, 90), (30, 180), (30, 270), (60, 45)].map(|(t, p)| direction(t, p)).to_vec();
    let lights = [(15, 0), (15, 120), (15, 240), (45, 10), (45, 190)].map(|(t, p)| direction(t, p)).to_vec();
    let brdf = views.len() * lights.len() * 3;
    let mixed = |n: usize, k: usize| f64::from((n * n * (k + 3) + 31 * n + 7 * k) as u32 % 97) - 48.0;
    let components = (0..4).map(|k| {
        let basis: Vec<f64> = (0..brdf).map(|n| mixed(n / (4 - k), k)).collect();
        let length = basis.iter().map(|v| v * v).sum::<f64>().sqrt();
        let strength = f64::from(100u32 >> k);
        let texel = |n: usize| strength * (mixed(n / 14, k) + mixed(n % 14 / 3, k + 5)) / 8.0;
        Component {
            basis: basis.iter().map(|v| v / length).collect(),
            coefficients: (0..10 * 14).map(texel).collect(),
        }
    });
    Model {
        size: [10, 14],
        wraps: true,
        components: components.collect(),
        mean: (0..brdf).map(|n| 100.0 + mixed(n / 3, 1) + (n % 3) as f64).collect(),
        views,
        lights,
        channels: ["R", "G", "B"].map(String::from).to_vec(),
        texts: vec![("licence".to_owned(), "CC0-1.0".to_owned()), ("samples".to_owned(), "uint8".to_owned())],
    }
}

/// What the fixture unpacks to, as other decoders compare it: mean, bases, coefficients.
fn numbers(model: &Model) -> Vec<f64> {
    let parts = model.components.iter().flat_map(|part| part.basis.iter().chain(&part.coefficients));
    model.mean.iter().chain(parts).copied().collect()
}

/// The same with a tile of few kinds of texels, which takes a palette.
fn palette_fixture() -> Model {
    let given = fixture();
    let texels = 26 * 22;
    let components = given.components.into_iter().map(|part| Component {
        coefficients: (0..texels).map(|n| part.coefficients[(n * n / 9 + n / 22 * 3) % 23 * 6]).collect(),
        basis: part.basis,
    });
    Model { size: [26, 22], components: components.collect(), ..given }
}

/// The format is frozen: what this version writes, others must read, and the other way round. Written anew with
/// BTFKIT_WRITE_FIXTURES=1, for a new version of the format.
#[test]
fn the_fixtures_are_what_is_written_and_read_as_they_did() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures");
    for (name, model, has_palette) in [("small", fixture(), false), ("palette", palette_fixture(), true)] {
        let (file, values) = (folder.join(format!("{name}.btfc")), folder.join(format!("{name}.f64")));
        let packed = pack(&model, Some(0.0), Target::Decibels(32.0)).unwrap();
        if std::env::var_os("BTFKIT_WRITE_FIXTURES").is_some() {
            let found = numbers(&unpack(&packed.bytes).unwrap().model);
            std::fs::write(&values, found.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>()).unwrap();
            std::fs::write(&file, &packed.bytes).unwrap();
        }
        let written = std::fs::read(&file).unwrap();
        assert!(written == packed.bytes, "{name}: the bytes that are written have changed");
        let unpacked = unpack(&written).unwrap();
        assert_eq!(outline(&written).unwrap().centres.is_some(), has_palette);
        let found = numbers(&unpacked.model);
        let expected = std::fs::read(&values).unwrap();
        assert_eq!(8 * found.len(), expected.len());
        let (expected, _) = expected.as_chunks::<8>();
        let near = |(found, bytes): (&f64, &[u8; 8])| (found - f64::from_le_bytes(*bytes)).abs() < 1e-9;
        assert!(found.iter().zip(expected).all(near), "{name}");
    }
}
