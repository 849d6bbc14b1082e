//! MIF files: images, the XML that describes them, and all that is refused.

use btfkit_formats::mif::{Mif, Options, recognise};
use btfkit_formats::utia::Order;
use btfkit_formats::{Error, ErrorKind, Images, Limits, SampleType, Samples};

use crate::utia_files::{IMAGE_OF, PAIRS, mif_chunk, mif_file, mif_image, words};

const HEIGHT: u64 = 2;
const WIDTH: u64 = 3;

/// The sample of an image, row, column and plane; all differ.
fn sample(image: u64, row: u64, column: u64, plane: u64) -> u64 {
    1 + plane + 3 * (column + WIDTH * (row + HEIGHT * image))
}

/// Three planes of one image as f32.
fn floats(image: u64) -> Vec<u8> {
    let mut out = Vec::new();
    for row in 0..HEIGHT {
        for column in 0..WIDTH {
            (0..3).for_each(|plane| out.extend((sample(image, row, column, plane) as f32).to_le_bytes()));
        }
    }
    out
}

fn image(index: u64, number: u64) -> Vec<u8> {
    mif_image(index, 10, [HEIGHT, WIDTH, 3], &floats(number))
}

/// The items of [`PAIRS`], the last first.
fn items() -> String {
    let item = |(index, [tv, pv, ti, pi]): (usize, &[f64; 4])| {
        format!(
            r#"<directions-item index="{index}">
                 <direction index="0" type="source" theta="{ti:.6}" phi="{pi:.6}"/>
                 <direction index="1" type="sensor" theta="{tv:.6}" phi="{pv:.6}" />
               </directions-item>"#
        )
    };
    PAIRS.iter().enumerate().rev().map(item).collect()
}

/// As the library writes it: directions and colours by reference.
fn description(btf: &str) -> String {
    format!(
        r#"<?xml version="1.0"?>
<mif>
  <colors id="colors0"><color_space>XYZ</color_space><illuminant>D65</illuminant></colors>
  <btf id="btf0"><name>cloth</name><colors reference="colors0" />{btf}</btf>
  <directions id="directions0" type="list" units="deg" count="6">{}</directions>
</mif>"#,
        items()
    )
}

const REFERENCE: &str = r#"<directions type="list" reference="directions0" count="6" />"#;
const MAP: &str = "<index-map>10, 7, 11, 2, 30, 0</index-map>";
const MAPPED: [u64; 6] = [10, 7, 11, 2, 30, 0];

fn xml(text: &str) -> Vec<u8> {
    mif_chunk(1, text.as_bytes())
}

/// Images under the numbers of [`MAP`], free space and an unknown chunk among them, the XML in the middle.
fn plain(text: &str) -> Vec<u8> {
    let mut chunks: Vec<Vec<u8>> =
        MAPPED.iter().enumerate().map(|(i, &index)| image(index, i as u64)).collect();
    chunks.insert(1, mif_chunk(u64::MAX, &[7; 5]));
    chunks.insert(3, xml(text));
    chunks.insert(3, mif_chunk(77, &[1; 3]));
    mif_file(&chunks)
}

fn usual() -> Vec<u8> {
    plain(&description(&format!("{REFERENCE}{MAP}")))
}

fn open(bytes: &[u8]) -> Result<Mif, Error> {
    Mif::open(bytes, &Options::default(), &Limits::default())
}

fn ordered(order: Order) -> Options {
    let mut options = Options::default();
    options.order = order;
    options
}

fn of_btf(id: &str) -> Options {
    let mut options = Options::default();
    options.btf = Some(id.to_owned());
    options
}

/// All images of a file must be those of [`sample`], divided by `unit`.
fn assert_samples(bytes: &[u8], mif: &Mif, unit: f32) {
    let contents = mif.contents();
    assert_eq!((contents.width, contents.height), (WIDTH as u32, HEIGHT as u32));
    for (view, images) in IMAGE_OF.iter().enumerate() {
        for light in 0..3 {
            let found = mif.read_images(bytes, view, light..3).unwrap().to_f32();
            let mut expected = Vec::new();
            for &image in &images[light..] {
                for row in 0..HEIGHT {
                    for column in 0..WIDTH {
                        expected.extend(
                            (0..3).map(|plane| sample(image as u64, row, column, plane) as f32 / unit),
                        );
                    }
                }
            }
            assert_eq!(found, expected);
        }
    }
}

#[test]
fn a_file_with_a_list_of_directions_is_read() {
    let bytes = usual();
    assert!(recognise(&bytes) && !recognise(b"MIF FIL"));
    let mif = open(&bytes).unwrap();
    assert_samples(&bytes, &mif, 100.0);
    let contents = mif.contents();
    let degrees = |list: &[btfkit_formats::Direction]| -> Vec<(f64, f64)> {
        list.iter().map(|d| (d.theta_rad.to_degrees().round(), d.phi_rad.to_degrees().round())).collect()
    };
    assert_eq!(degrees(&contents.views), [(15.0, 30.0), (45.0, 270.0)]);
    assert_eq!(degrees(&contents.lights), [(0.0, 0.0), (60.0, 120.0), (75.0, 345.0)]);
    assert_eq!(contents.channels, ["X", "Y", "Z"]);
    assert_eq!((contents.sample_type, contents.linear), (SampleType::F32, true));
    assert!(contents.assumptions.iter().any(|text| text.contains("divided by 100")));
    let remarks = [("btf", "btf0"), ("name", "cloth"), ("illuminant", "D65")];
    assert_eq!(contents.remarks, remarks.map(|(name, value)| (name.to_owned(), value.to_owned())));
}

#[test]
fn images_may_be_found_by_an_offset() {
    let text = description(&format!("{REFERENCE}<index-offset>4</index-offset>"));
    let mut chunks: Vec<Vec<u8>> = (0..6).map(|i| image(i + 4, i)).collect();
    chunks.push(image(1, 99));
    chunks.push(xml(&(text + "\0\0")));
    // Free space may go on to the end of the file.
    chunks.push(words(&[u64::MAX, u64::MAX]));
    chunks.push(vec![9; 11]);
    let bytes = mif_file(&chunks);
    let mif = open(&bytes).unwrap();
    assert_samples(&bytes, &mif, 100.0);
    assert!(mif.contents().remarks.contains(&("other images".to_owned(), "1".to_owned())));
}

#[test]
fn directions_may_stand_in_the_btf_in_radians_or_as_half_vectors() {
    let mut list = String::new();
    for [tv, pv, ti, pi] in PAIRS {
        let [tv, pv, ti, pi] = [tv, pv, ti, pi].map(f64::to_radians);
        list += &format!(
            r#"<directions-item units="rad"><direction type="sensor" theta="{tv:?}" phi="{pv:?}"/>
               <direction type="source" theta="{ti:?}" phi="{pi:?}"/></directions-item>"#
        );
    }
    let bytes =
        plain(&description(&format!(r#"<directions type="list" units="deg">{list}</directions>{MAP}"#)));
    let mif = open(&bytes).unwrap();
    assert_samples(&bytes, &mif, 100.0);

    // A half vector at theta 20, phi 90, differences in its plane: light and view 10 degrees on either side.
    let item = r#"<directions-item><direction type="half-angle" theta="20" phi="90"/>
                  <direction type="difference-angle" theta="10" phi="0"/></directions-item>"#;
    let text = description(&format!(r#"<directions type="list">{item}</directions>"#));
    let bytes = mif_file(&[image(0, 0), xml(&text)]);
    let mif = open(&bytes).unwrap();
    let angles =
        |d: btfkit_formats::Direction| (d.theta_rad.to_degrees().round(), d.phi_rad.to_degrees().round());
    assert_eq!(angles(mif.contents().lights[0]), (30.0, 90.0));
    assert_eq!(angles(mif.contents().views[0]), (10.0, 90.0));
}

#[test]
fn planes_take_their_names_from_the_colours() {
    let named = |colors: &str| {
        let text = description(&format!("{REFERENCE}{MAP}"));
        let text = text.replace(r#"<color_space>XYZ</color_space>"#, colors);
        let bytes = plain(&text);
        let mif = open(&bytes).unwrap();
        let unit = if mif.contents().channels == ["X", "Y", "Z"] { 100.0 } else { 1.0 };
        assert_samples(&bytes, &mif, unit);
        mif.contents().channels.clone()
    };
    assert_eq!(named("<color_space>sRGB</color_space>"), ["R", "G", "B"]);
    assert_eq!(named(""), ["X", "Y", "Z"]);
    let channels = r#"<channels><channel index="1" label="520nm"/><channel index="0" label="500nm"/>
                      <channel index="2" label="540nm"/></channels>"#;
    assert_eq!(named(channels), ["500", "520", "540"]);
    // Labels of some planes only are no names for all.
    assert_eq!(named(r#"<channels><channel index="0" label="500nm"/></channels>"#), ["X", "Y", "Z"]);
}

#[test]
fn types_of_samples_are_kept_or_joined() {
    let one = |data_type: u64, bytes: &[u8]| {
        let text = r#"<mif><btf id="b"><directions type="list"><directions-item>
            <direction type="source" theta="0" phi="0"/><direction type="sensor" theta="0" phi="0"/>
            </directions-item></directions></btf></mif>"#;
        let bytes = mif_file(&[mif_image(0, data_type, [1, 1, 1], bytes), xml(text)]);
        open(&bytes).unwrap().read_images(&bytes, 0, 0..1).unwrap()
    };
    assert_eq!(one(1, &[200]), Samples::U8(vec![200]));
    assert_eq!(one(2, &50_000u16.to_le_bytes()), Samples::U16(vec![50_000]));
    assert_eq!(one(3, &u32::MAX.to_le_bytes()), Samples::F32(vec![1.0]));
    assert_eq!(one(4, &u64::MAX.to_le_bytes()), Samples::F32(vec![1.0]));
    assert_eq!(one(5, &(-127i8).to_le_bytes()), Samples::F32(vec![-1.0]));
    assert_eq!(one(6, &i16::MAX.to_le_bytes()), Samples::F32(vec![1.0]));
    assert_eq!(one(7, &i32::MAX.to_le_bytes()), Samples::F32(vec![1.0]));
    assert_eq!(one(8, &i64::MAX.to_le_bytes()), Samples::F32(vec![1.0]));
    assert_eq!(one(9, &[0, 0x3e]).to_f32(), [1.5]);
    assert_eq!(one(10, &2.5f32.to_le_bytes()), Samples::F32(vec![2.5]));
    assert_eq!(one(11, &2.5f64.to_le_bytes()), Samples::F32(vec![2.5]));
}

/// Images of one grey pixel, their number its value, and this XML.
fn numbered(count: u64, text: Option<&str>) -> Vec<u8> {
    let mut chunks: Vec<Vec<u8>> =
        (0..count).map(|i| mif_image(i, 2, [1, 1, 1], &(i as u16).to_le_bytes())).collect();
    chunks.extend(text.map(xml));
    mif_file(&chunks)
}

#[test]
fn orders_may_be_named_by_the_file_or_by_the_caller() {
    let named = |name: &str| format!(r#"<mif><btf id="b"><directions type="list" {name}/></btf></mif>"#);
    let last = |bytes: &[u8], options: &Options| {
        let mif = Mif::open(bytes, options, &Limits::default()).unwrap();
        let (views, lights) = (mif.contents().views.len(), mif.contents().lights.len());
        (views, lights, mif.read_images(bytes, views - 1, lights - 2..lights - 1).unwrap())
    };
    let ubo = (81, 81, Samples::U16(vec![6559]));
    let uniform = (60, 61, Samples::U16(vec![3658]));
    let none = Options::default();
    assert_eq!(last(&numbered(6561, Some(&named(r#"name="UBO81x81""#))), &none), ubo);
    assert_eq!(
        last(&numbered(3660, Some(&named(r#"name="Uniform" stepTheta="15.0" stepPhi="30.0""#))), &none),
        uniform
    );
    assert_eq!(last(&numbered(6561, Some(&named(""))), &ordered(Order::Ubo81)), ubo);
    assert_eq!(last(&numbered(6561, None), &ordered(Order::Ubo81)), ubo);
    assert_eq!(last(&numbered(3660, None), &ordered(Order::Uniform)), uniform);

    let refused = |bytes: &[u8], options: &Options, kind: ErrorKind| {
        let error = Mif::open(bytes, options, &Limits::default()).unwrap_err();
        assert_eq!(error.kind(), kind, "{error}");
    };
    refused(&numbered(6561, None), &none, ErrorKind::Unsupported);
    refused(&numbered(6561, Some(&named(""))), &none, ErrorKind::Unsupported);
    refused(&numbered(6561, Some(&named(r#"name="CoatingRegular""#))), &none, ErrorKind::Unsupported);
    refused(&numbered(3660, Some(&named(r#"name="Uniform" stepPhi="15""#))), &none, ErrorKind::Unsupported);
    refused(&numbered(6560, Some(&named(r#"name="UBO81x81""#))), &none, ErrorKind::Malformed);
    refused(&numbered(6560, None), &ordered(Order::Ubo81), ErrorKind::Argument);
    refused(&numbered(6561, Some(&named(r#"name="UBO81x81""#))), &ordered(Order::Ubo81), ErrorKind::Argument);
    refused(&usual(), &ordered(Order::Ubo81), ErrorKind::Argument);
}

#[test]
fn one_of_several_is_chosen() {
    let text = description(&format!("{REFERENCE}{MAP}"));
    let second = format!(r#"</btf><btf id="btf1">{REFERENCE}<index-offset>100</index-offset></btf>"#);
    let bytes = plain(&text.replacen("</btf>", &second, 1));
    let error = open(&bytes).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Argument);
    assert!(error.to_string().contains(r#"one of "btf0", "btf1""#), "{error}");
    let mif = Mif::open(&bytes, &of_btf("btf0"), &Limits::default()).unwrap();
    assert_samples(&bytes, &mif, 100.0);
    let error = Mif::open(&bytes, &of_btf("btf1"), &Limits::default()).unwrap_err();
    assert!(error.to_string().contains("no image 100"), "{error}");
    let error = Mif::open(&bytes, &of_btf("btf2"), &Limits::default()).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Argument, "{error}");
}

#[test]
fn wrong_descriptions_are_refused_with_a_reason() {
    let item = |light: &str| {
        format!(
            r#"<directions type="list"><directions-item index="0">{light}</directions-item></directions>"#
        )
    };
    let source = r#"<direction type="source" theta="0" phi="0"/>"#;
    let sensor = r#"<direction type="sensor" theta="0" phi="0"/>"#;
    let cases = [
        (MAP.to_owned(), "without directions"),
        (format!(r#"<directions reference="directions9"/>{MAP}"#), "directions9"),
        (format!("{REFERENCE}<index-map>10, 7, 11, 2</index-map>"), "an index-map of 4 images"),
        (format!("{REFERENCE}<index-map>10, 7, 11, 2, x, 0</index-map>"), "other things"),
        (format!("{REFERENCE}<index-map>10, 7, 11, 2, 31, 0</index-map>"), "no image 31"),
        (
            format!("{REFERENCE}<index-offset>18446744073709551615</index-offset>"),
            "from 18446744073709551615 on",
        ),
        (format!("{REFERENCE}<index-offset>-1</index-offset>"), "an index-offset"),
        (
            format!(
                r#"{REFERENCE}{MAP}<mipmap type="isotropic"><item level="0"/><item level="1"/></mipmap>"#
            ),
            "2 mipmap levels",
        ),
        (item(source), "of other directions"),
        (item(&format!("{source}{source}")), "two directions of type \"source\""),
        (item(&format!(r#"{source}<direction type="camera" theta="0" phi="0"/>"#)), "\"camera\""),
        (item(&format!(r#"{source}<direction type="sensor" theta="0"/>"#)), "phi \"\""),
        (
            item(&format!(r#"{source}<direction type="sensor" theta="nan" phi="0"/>"#)),
            "image 0 of a direction",
        ),
        (
            item(&format!(r#"{source}<direction type="sensor" theta="100" phi="0"/>"#)),
            "image 0 of a direction",
        ),
        (
            item(&format!(r#"{source}<direction type="sensor" theta="1" phi="0" units="gon"/>"#)),
            "units \"gon\"",
        ),
        (item(&format!("{source}{sensor}")).replace(r#"index="0""#, r#"index="1""#), "directions-item 1"),
        (item(&format!("{source}{sensor}")).replace("list", "grid"), "type \"grid\""),
        (format!("{REFERENCE}{MAP}<a>"), "breaks its rules"),
        (format!("{REFERENCE}{MAP}<a b='1' b='2'/>"), "breaks its rules"),
        (format!("{REFERENCE}{MAP}<a xmlns:q='u'/>"), "namespaces"),
        (
            format!(
                "{REFERENCE}{MAP}<a {}/>",
                (0..300).map(|i| format!("a{i} =\n '{i}' ")).collect::<String>()
            ),
            "very many attributes",
        ),
    ];
    for (btf, part) in cases {
        let bytes = plain(&description(&btf));
        let error = open(&bytes).unwrap_err();
        assert!(error.to_string().contains(part), "{part}: {error}");
        assert_ne!(error.kind(), ErrorKind::Argument, "{error}");
    }
    let laughs = r#"<!DOCTYPE m [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]><mif>&b;</mif>"#;
    assert!(open(&plain(laughs)).unwrap_err().to_string().contains("breaks its rules"));
    let error = open(&plain("<mif><btf>\u{fffd}</btf></mif>")).unwrap_err();
    assert!(error.to_string().contains("without directions"), "{error}");
    let mut latin = description("");
    latin.push_str("<!-- x -->");
    let mut bytes = latin.into_bytes();
    *bytes.iter_mut().rev().find(|byte| **byte == b'x').unwrap() = 0xE9;
    assert!(open(&mif_file(&[mif_chunk(1, &bytes)])).unwrap_err().to_string().contains("not UTF-8"));

    // Nothing but depth and number: no stack overflows, and what is too much is said to be.
    let deep = format!("<mif>{}{}</mif>", "<a>".repeat(200_000), "</a>".repeat(200_000));
    assert!(open(&mif_file(&[xml(&deep)])).unwrap_err().to_string().contains("without a btf element"));
    let mut limits = Limits::default();
    limits.max_entries = 1000;
    let error = Mif::open(&mif_file(&[xml(&deep)]), &Options::default(), &limits).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Limit, "{error}");
    let mut limits = Limits::default();
    limits.max_entry_bytes = 1000;
    let error = Mif::open(&usual(), &Options::default(), &limits).unwrap_err();
    assert!(error.to_string().contains("max_entry_bytes"), "{error}");
}

#[test]
fn wrong_chunks_are_refused_with_a_reason() {
    let text = description(&format!("{REFERENCE}{MAP}"));
    let cases: [(Vec<u8>, &str); 14] = [
        (words(&[0x454C_4946_2046_494D, 8, 2]), "version 2"),
        (words(&[0x454C_4946_2046_494D, 16, 1, 0]), "a first chunk of 16 bytes"),
        (mif_file(&[]), "without XML"),
        (mif_file(&[xml(&text)]), "no image 10"),
        (mif_file(&[xml(&text), xml(&text)]), "a second chunk of XML"),
        (mif_file(&[image(3, 0), image(3, 0)]), "image 3 a second time"),
        (mif_file(&[words(&[1, 1 << 63])]), "are left"),
        (mif_file(&[words(&[u64::MAX, u64::MAX - 1])]), "are left"),
        (mif_file(&[mif_image(0, 12, [2, 3, 3], &floats(0))]), "data type 12"),
        (mif_file(&[mif_image(0, 10, [2, 3, 4], &floats(0))]), "an image of 3 x 2 x 4 in 72 bytes"),
        (mif_file(&[mif_image(0, 10, [0, 3, 3], &[])]), "3 x 0"),
        (mif_file(&[mif_image(0, 10, [1 << 31, 1 << 31, 1], &[])]), "max_pixels_per_image"),
        (mif_file(&[mif_image(0, 11, [1, 1, 1 << 62], &[])]), "max_channels"),
        (mif_file(&[mif_chunk(0, &[0; 47])]), "more bytes"),
    ];
    for (bytes, part) in cases {
        let error = open(&bytes).unwrap_err();
        assert!(error.to_string().contains(part), "{part}: {error}");
    }
    let mut chunks: Vec<Vec<u8>> = MAPPED.iter().map(|&index| image(index, 0)).collect();
    chunks[3] = mif_image(MAPPED[3], 10, [WIDTH, HEIGHT, 3], &floats(0));
    chunks.push(xml(&text));
    assert!(open(&mif_file(&chunks)).unwrap_err().to_string().contains("[3, 2, 3]"));

    let mut limits = Limits::default();
    limits.max_entries = 100;
    let error = Mif::open(&numbered(101, None), &Options::default(), &limits).unwrap_err();
    assert!(error.to_string().contains("max_entries"), "{error}");
}

#[test]
fn a_file_cut_anywhere_is_an_error() {
    let whole = usual();
    for end in 0..whole.len() {
        assert!(open(&whole[..end]).is_err(), "{end} of {}", whole.len());
    }
    let mut longer = whole;
    longer.push(0);
    assert!(open(&longer).is_err());
}

#[test]
fn a_flipped_bit_never_panics() {
    let whole = usual();
    let mut read = 0;
    for bit in 0..whole.len() * 8 {
        let mut flipped = whole.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        if let Ok(mif) = open(&flipped) {
            let lights = mif.contents().lights.len();
            let images = mif.read_images(&flipped, 0, 0..lights).unwrap();
            assert!(images.len() <= 8 * flipped.len());
            read += 1;
        }
    }
    assert!(read > 8 * 6 * 72 && read < 8 * whole.len(), "{read} of {}", 8 * whole.len());
}

#[test]
fn requests_that_cannot_be_met_are_refused() {
    let bytes = usual();
    let mif = open(&bytes).unwrap();
    for (view, lights, bytes) in [(2, 0..1, &bytes[..]), (0, 2..4, &bytes), (0, 0..1, &bytes[1..])] {
        assert_eq!(mif.read_images(bytes, view, lights).unwrap_err().kind(), ErrorKind::Argument);
    }
    let mut limits = Limits::default();
    limits.max_decoded_bytes = 2 * 3 * 3 * 4;
    let mif = Mif::open(&bytes, &Options::default(), &limits).unwrap();
    assert_eq!(mif.read_images(&bytes, 0, 1..2).unwrap().len(), 18);
    assert_eq!(mif.read_images(&bytes, 0, 1..3).unwrap_err().kind(), ErrorKind::Limit);
}
