//! Tables, light lists and named pictures: from text to a complete set, and texts that are damaged.

use btfkit_formats::named::{Pattern, recognise};
use btfkit_formats::{Angles, Catalogue, Limits, Pair, rti, table};

/// Three views, each under two lights.
const TABLE: &str = "file,theta_i,phi_i,theta_v,phi_v\n\
    b/0.png,15,90,30,0\nb/1.png,0,0,30,0\na/0.png,15,90,0,0\na/1.png,0,0,0,0\nc/0.png,15,90,30,180\nc/1.png,0,0,30,180\n";

const LIST: &str = "3\nlamp 1.png 0.5 0 0.5\r\nlamp 2.png 0 -2 2\r\nlamp 3.png 0 0 1\r\n";

#[test]
fn a_table_is_a_complete_set() {
    let table = table::read(TABLE.as_bytes(), &Limits::default()).unwrap();
    let set =
        Catalogue::from_pairs(table.rows.iter().map(|row| (row.file.as_str(), Some(row.pair)))).unwrap();
    assert_eq!((set.views().len(), set.lights().len()), (3, 2));
    let files = |view| [0, 1].map(|light| table.rows[set.image(view, light).unwrap()].file.as_str());
    assert_eq!(
        [files(0), files(1), files(2)],
        [["a/1.png", "a/0.png"], ["b/1.png", "b/0.png"], ["c/1.png", "c/0.png"]]
    );
}

#[test]
fn a_light_list_is_a_set_of_one_view() {
    let list = rti::read_lp(LIST.as_bytes(), &Limits::default()).unwrap();
    let pair = |light| Some(Pair { view: Angles::FRONTAL, light });
    let files = list.lamps.iter().map(|lamp| (lamp.file.as_deref().unwrap(), pair(lamp.light)));
    let set = Catalogue::from_pairs(files).unwrap();
    assert_eq!(set.views(), [Angles::FRONTAL]);
    assert_eq!([0, 1, 2].map(|light| set.image(0, light).unwrap()), [2, 0, 1]);
}

#[test]
fn recognised_names_are_a_complete_set() {
    let names: Vec<String> = [(0, 0), (30, 0), (30, 180)]
        .iter()
        .flat_map(|(tv, pv)| {
            [(15, 90), (60, 10)].map(|(ti, pi)| format!("w/v{tv}_{pv}/{ti}l l{ti}_{pi}.png"))
        })
        .collect();
    let names: Vec<&str> = names.iter().map(String::as_str).chain(["w/notes.txt"]).collect();
    let pattern = recognise(names.iter().copied()).unwrap();
    assert_eq!(pattern, Pattern::parse("v{theta_v}_{phi_v}/{n}l l{theta_i}_{phi_i}").unwrap());
    let set = Catalogue::from_pairs(names.iter().map(|&name| (name, pattern.angles(name)))).unwrap();
    assert_eq!((set.views().len(), set.lights().len(), set.ignored()), (3, 2, 1));
}

/// Reads a text, cut at every byte and with every bit flipped, and hands out what was read.
fn damage<T>(text: &str, read: impl Fn(&[u8]) -> Option<T>, mut check: impl FnMut(T, Option<usize>)) {
    for end in 0..text.len() {
        if let Some(found) = read(&text.as_bytes()[..end]) {
            check(found, Some(end));
        }
    }
    for bit in 0..text.len() * 8 {
        let mut bytes = text.as_bytes().to_vec();
        bytes[bit / 8] ^= 1 << (bit % 8);
        if let Some(found) = read(&bytes) {
            check(found, None);
        }
    }
}

/// A list that ends in the middle of a number cannot be told from one that ends with it; the rows before are whole.
#[test]
fn a_damaged_table_gives_no_rows_that_it_does_not_have() {
    let limits = Limits::default();
    let whole = table::read(TABLE.as_bytes(), &limits).unwrap();
    damage(
        TABLE,
        |bytes| table::read(bytes, &limits).ok(),
        |table, cut| {
            assert!(table.rows.len() <= whole.rows.len() + 1);
            if cut.is_some() {
                let whole_rows = table.rows.len() - 1;
                assert_eq!(table.rows[..whole_rows], whole.rows[..whole_rows]);
            }
        },
    );
}

#[test]
fn a_damaged_light_list_gives_no_lights_that_it_does_not_have() {
    let limits = Limits::default();
    let whole = rti::read_lp(LIST.as_bytes(), &limits).unwrap();
    damage(
        LIST,
        |bytes| rti::read_lp(bytes, &limits).ok(),
        |list, cut| {
            assert!(list.lamps.len() <= whole.lamps.len() + 1);
            assert!(
                list.lamps.len() == whole.lamps.len() || !list.warnings.is_empty(),
                "a lost light is told"
            );
            if cut.is_some() {
                let whole_lamps = list.lamps.len() - 1;
                assert_eq!(list.lamps[..whole_lamps], whole.lamps[..whole_lamps]);
            }
        },
    );
}

#[test]
fn a_damaged_pattern_is_an_error_or_another_pattern() {
    const PATTERN: &str = "v{theta_v}_{phi_v:rad}/{*} {n}_{x_i},{y_i},{z_i}.exr";
    let pair = Pattern::parse(PATTERN).unwrap().angles("v30_1.5/a b 7_0,0.5,0.5.exr").unwrap();
    assert_eq!((pair.view.theta_deg(), pair.light.theta_deg()), (30.0, 45.0));
    let read = |bytes: &[u8]| Pattern::parse(std::str::from_utf8(bytes).ok()?).ok();
    damage(PATTERN, read, |pattern, _| {
        assert_eq!(Pattern::parse(&pattern.to_string()).unwrap(), pattern);
        let _ = pattern.angles("v30_1.5/a b 7_0,0.5,0.5.exr");
    });
}
