//! What pictures say of turning and of colours beside their pixels: told alike by all formats, and applied by none.

use std::io::Write;

use btfkit_formats::jpeg::EncodeOptions;
use btfkit_formats::picture::{PictureHeader, check, decode, header};
use btfkit_formats::{Limits, Samples};

use crate::picture_files::{Png, Tiff, png_chunk, tiff_samples};
use crate::support::jpeg_of;

/// What header and check say alike.
fn said(bytes: &[u8]) -> PictureHeader {
    let found = header(bytes, &Limits::default()).unwrap();
    assert_eq!(check(bytes, &Limits::default()).unwrap(), found);
    found
}

fn samples(bytes: &[u8]) -> Samples {
    decode(bytes, &Limits::default()).unwrap().samples
}

/// An ICC profile of nothing but a name, of version 2 or 4.
fn icc(name: &str, version: u8) -> Vec<u8> {
    let data = if version == 2 {
        [&b"desc\0\0\0\0"[..], &(name.len() as u32 + 1).to_be_bytes(), name.as_bytes(), b"\0"].concat()
    } else {
        let text: Vec<u8> = name.encode_utf16().flat_map(u16::to_be_bytes).collect();
        let head =
            [&b"mluc\0\0\0\0\0\0\0\x01\0\0\0\x0CenUS"[..], &(text.len() as u32).to_be_bytes()].concat();
        [&head[..], &28u32.to_be_bytes(), &text].concat()
    };
    let tags = [&2u32.to_be_bytes()[..], b"cprt", &[0; 8], b"desc"].concat();
    let at = 128 + tags.len() as u32 + 8;
    [vec![0; 128], tags, at.to_be_bytes().to_vec(), (data.len() as u32).to_be_bytes().to_vec(), data].concat()
}

fn zlib(data: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(data).unwrap();
    encoder.finish().unwrap()
}

fn iccp(profile: &[u8]) -> Vec<u8> {
    png_chunk(b"iCCP", &[&b"ICC profile\0\0"[..], &zlib(profile)].concat())
}

fn png(chunks: &[Vec<u8>]) -> Vec<u8> {
    Png { before: chunks.concat(), ..Png::new(6, 4, 8, 2, false) }.bytes()
}

fn segment(code: u8, data: &[u8]) -> Vec<u8> {
    [&[0xFF, code][..], &(data.len() as u16 + 2).to_be_bytes(), data].concat()
}

fn jpeg(segments: &[Vec<u8>]) -> Vec<u8> {
    let plain = jpeg_of(16, 8, 3, &EncodeOptions::UBO2003);
    [&plain[..2], &segments.concat(), &plain[2..]].concat()
}

fn tiff(tags: &[(u16, Vec<u64>)]) -> Vec<u8> {
    let mut tiff = Tiff::new((4, 4, 3), 8, 1, 4);
    for (tag, values) in tags {
        tiff.set(*tag, values);
    }
    let samples = tiff_samples(&tiff, 48, "u8");
    tiff.with_strips(&samples, 4, false).bytes()
}

/// Bytes as the numbers of a little-endian tag.
fn words(bytes: &[u8]) -> Vec<u64> {
    bytes
        .chunks(4)
        .map(|part| part.iter().rev().fold(0, |value, &byte| (value << 8) | u64::from(byte)))
        .collect()
}

fn exif_of_colours(space: u8) -> Vec<u8> {
    // The directory at 8 leads to one at 26.
    let first = b"MM\0*\0\0\0\x08\0\x01\x87\x69\0\x04\0\0\0\x01\0\0\0\x1A\0\0\0\0";
    [&first[..], b"\0\x01\xA0\x01\0\x03\0\0\0\x01", &[space, space, 0, 0], &[0; 4]].concat()
}

/// An OpenEXR picture with attributes: name, type, value.
fn exr(attributes: &[(&str, &str, &[u8])]) -> Vec<u8> {
    let plain = crate::picture_files::exr_with_attributes(["R", "G", "B"], None, None);
    let one = |(name, kind, value): &(&str, &str, &[u8])| {
        let len = (value.len() as u32).to_le_bytes();
        [name.as_bytes(), b"\0", kind.as_bytes(), b"\0", &len, value].concat()
    };
    let more: Vec<u8> = attributes.iter().flat_map(one).collect();
    // The offset of the only chunk, which follows it.
    let is_table = |at: &usize| plain[*at..*at + 8] == (*at as u64 + 8).to_le_bytes();
    let table = (8..plain.len() - 8).find(is_table).unwrap();
    let offset = (table + 8 + more.len()) as u64;
    // What an attribute says that is there already is said anew.
    let mut head = plain[8..table].to_vec();
    for (name, _, value) in attributes {
        if let Some(at) = memchr::memmem::find(&head, format!("{name}\0").as_bytes()) {
            let start = at + name.len() + 1 + "float\0".len() + 4;
            head[start..start + value.len()].copy_from_slice(value);
            return [&plain[..8], &head, &plain[table..]].concat();
        }
    }
    [&plain[..8], &more, &head, &offset.to_le_bytes(), &plain[table + 8..]].concat()
}

#[test]
fn pixels_that_are_not_square_are_told_by_every_format() {
    use crate::picture_files::{HdrCoding, RGBE, hdr_of, rgbe};
    let phys = |x: u32, y: u32| png_chunk(b"pHYs", &[&x.to_be_bytes()[..], &y.to_be_bytes(), &[1]].concat());
    let jfif = |x: u16, y: u16| {
        segment(0xE0, &[&b"JFIF\0\x01\x02\x01"[..], &x.to_be_bytes(), &y.to_be_bytes(), &[0, 0]].concat())
    };
    let hdr = |line: &str| hdr_of(&format!("{RGBE}{line}"), "-Y 1 +X 8", &rgbe(8), 8, HdrCoding::Flat);
    for (bytes, place) in [
        (png(&[phys(100, 200)]), "pHYs"),
        (png(&[png_chunk(b"sCAL", b"\x012.0\x001e0")]), "sCAL"),
        (jpeg(&[jfif(36, 72)]), "JFIF"),
        (tiff(&[(282, vec![50]), (283, vec![100])]), "resolutions"),
        (tiff(&[(33550, vec![2, 1, 0])]), "ModelPixelScale"),
        (exr(&[("pixelAspectRatio", "float", &2f32.to_le_bytes())]), "pixelAspectRatio"),
        (hdr("PIXASPECT=0.5\n"), "PIXASPECT"),
        (hdr("pixaspect = 0.25\nPIXASPECT=2\n"), "PIXASPECT"),
    ] {
        let [told] = said(&bytes).remarks.try_into().unwrap();
        assert!(told.contains("2.0000 times as wide as high") && told.contains(place), "{told}");
    }
    for bytes in [
        png(&[phys(100, 100)]),
        png(&[phys(0, 1)]),
        jpeg(&[jfif(72, 72)]),
        jpeg(&[jfif(0, 0)]),
        tiff(&[(282, vec![72]), (283, vec![72])]),
        exr(&[("pixelAspectRatio", "float", &1f32.to_le_bytes())]),
        hdr("PIXASPECT=1\n"),
    ] {
        assert!(said(&bytes).remarks.is_empty());
    }
}

#[test]
fn what_pictures_say_of_their_colours_by_name_is_told() {
    let text = |key: &str, value: &str| png(&[png_chunk(b"tEXt", format!("{key}\0{value}").as_bytes())]);
    let xmp = |packet: &str| {
        jpeg(&[segment(0xE1, &[b"http://ns.adobe.com/xap/1.0/\0", packet.as_bytes()].concat())])
    };
    for (bytes, told) in [
        (exr(&[("oiio:ColorSpace", "string", b"sRGB")]), Some("the colour space \"sRGB\"")),
        (exr(&[("colorInteropID", "string", b"lin_ap1_scene")]), Some("the colour space \"lin_ap1_scene\"")),
        (exr(&[("oiio:ColorSpace", "string", b"lin_rec709")]), None),
        (exr(&[("oiio:ColorSpace", "string", b"Linear")]), None),
        (exr(&[("oiio:ColorSpace", "int", &[0; 4])]), None),
        (text("oiio:ColorSpace", "lin_rec709"), Some("the colour space \"lin_rec709\"")),
        (text("oiio:ColorSpace", "sRGB"), None),
        (
            png(&[png_chunk(b"pCAL", b"albedo\0\0\0\0\0")]),
            Some("a calibration of sample values \"albedo\" (pCAL)"),
        ),
        (
            xmp("<x photoshop:ICCProfile=\"Adobe RGB (1998)\"/>"),
            Some("the ICC profile \"Adobe RGB (1998)\" (XMP)"),
        ),
        (
            xmp("<x xmlns:e=\"http://ns.adobe.com/exif/1.0/\" e:ColorSpace=\"2\"/>"),
            Some("the Exif colour space 2 (Adobe RGB)"),
        ),
        (xmp("<x photoshop:ICCProfile=\"sRGB IEC61966-2.1\" exif:ColorSpace=\"1\"/>"), None),
    ] {
        assert_eq!(said(&bytes).profile.as_deref(), told);
    }
    let white = exr(&[("whiteLuminance", "float", &80f32.to_le_bytes())]);
    assert!(said(&white).remarks[0].contains("a white of 80 cd/m2 (whiteLuminance) is not applied"));
    assert!(said(&exr(&[("whiteLuminance", "float", &1f32.to_le_bytes())])).remarks.is_empty());
}

#[test]
fn crops_and_scales_of_a_tiff_are_told() {
    let gdal = |text: &str| {
        let mut text = text.as_bytes().to_vec();
        text.resize(text.len().next_multiple_of(4), 0);
        words(&text)
    };
    let item = |role: &str, value: &str| {
        format!("<GDALMetadata><Item name=\"X\" sample='0' role='{role}'>{value}</Item>")
    };
    for (tag, values, told) in [
        (50719, vec![1, 0], "the crop's origin [1.0, 0.0] (DNG)"),
        (50720, vec![3, 4], "the crop's size [3.0, 4.0] (DNG)"),
        (50829, vec![0, 0, 4, 3], "the active area [0.0, 0.0, 4.0, 3.0] (DNG)"),
        (42113, gdal("-9999"), "samples of \"-9999\" are no data"),
        (42112, gdal(&item("scale", "0.1")), "the scale and the offset"),
        (42112, gdal(&item("offset", "5")), "the scale and the offset"),
    ] {
        let [found] = said(&tiff(&[(tag, values)])).remarks.try_into().unwrap();
        assert!(found.contains(told), "{found}");
    }
    for (tag, values) in [
        (50719, vec![0, 0]),
        (50720, vec![4, 4]),
        (50829, vec![0, 0, 4, 4]),
        (42112, gdal(&item("scale", "1"))),
        (42112, gdal(&item("offset", "0.0"))),
        (42112, gdal("<Item name=\"AREA\">7</Item>")),
    ] {
        assert!(said(&tiff(&[(tag, values)])).remarks.is_empty(), "{tag}");
    }
}

#[test]
fn profiles_other_than_srgb_are_told() {
    for version in [2, 4] {
        let (adobe, srgb) = (icc("Adobe RGB (1998)", version), icc("sRGB IEC61966-2.1", version));
        let parts = |profile: &[u8]| {
            let (first, second) = profile.split_at(150);
            [(1u8, first), (2, second)]
                .map(|(n, part)| segment(0xE2, &[&b"ICC_PROFILE\0"[..], &[n, 2], part].concat()))
        };
        let icc_tag = |profile: &[u8]| tiff(&[(34675, words(profile))]);
        for bytes in [png(&[iccp(&adobe)]), jpeg(&parts(&adobe)), icc_tag(&adobe)] {
            assert_eq!(said(&bytes).profile.unwrap(), "the ICC profile \"Adobe RGB (1998)\"");
        }
        for bytes in [png(&[iccp(&srgb)]), jpeg(&parts(&srgb)), icc_tag(&srgb)] {
            assert_eq!(said(&bytes).profile, None);
        }
        for end in [0, 100, 131, 140, adobe.len() - 6] {
            for bytes in [png(&[iccp(&adobe[..end])]), icc_tag(&adobe[..end.max(4)])] {
                assert!(said(&bytes).profile.unwrap().contains("without a readable name"), "{end}");
            }
        }
        assert_eq!(samples(&png(&[iccp(&adobe)])), samples(&png(&[])));
        assert_eq!(samples(&jpeg(&parts(&adobe))), samples(&jpeg(&[])));
        assert_eq!(samples(&icc_tag(&adobe)), samples(&tiff(&[])));
    }
    assert_eq!(said(&tiff(&[(301, vec![1])])).profile.unwrap(), "a transfer function of its own");
}

#[test]
fn colour_spaces_of_exif_count_where_no_profile_does() {
    let of_png = |space| png(&[png_chunk(b"eXIf", &exif_of_colours(space))]);
    let of_jpeg = |space| segment(0xE1, &[b"Exif\0\0", &exif_of_colours(space)[..]].concat());
    for bytes in [of_png(0xFF), jpeg(&[of_jpeg(0xFF)])] {
        assert!(said(&bytes).profile.unwrap().contains("uncalibrated"));
    }
    for bytes in [of_png(0), jpeg(&[of_jpeg(0)]), png(&[]), jpeg(&[]), tiff(&[])] {
        assert_eq!(said(&bytes).profile, None);
    }
    let srgb = segment(0xE2, &[&b"ICC_PROFILE\0\x01\x01"[..], &icc("sRGB", 2)].concat());
    assert_eq!(said(&jpeg(&[of_jpeg(0xFF), srgb])).profile, None);
}

#[test]
fn of_the_words_of_a_png_the_strongest_counts() {
    let gamma = |value: u32| png_chunk(b"gAMA", &value.to_be_bytes());
    let primaries = |first: u32| {
        let list = [first, 32_900, 64_000, 33_000, 30_000, 60_000, 15_000, 6_000];
        png_chunk(b"cHRM", &list.map(u32::to_be_bytes).concat())
    };
    let cicp = |points: [u8; 4]| png_chunk(b"cICP", &points);
    let srgb = png_chunk(b"sRGB", &[0]);
    for (chunks, told) in [
        (vec![gamma(45_455)], None),
        (vec![gamma(45_455), primaries(31_270)], None),
        (vec![gamma(100_000)], Some("the gamma 1.00000 (gAMA)")),
        (vec![gamma(55_556)], Some("the gamma 0.55556 (gAMA)")),
        (vec![gamma(100_000), srgb.clone()], None),
        (
            vec![primaries(34_000)],
            Some("the primaries 0.6400 0.3300 0.3000 0.6000 0.1500 0.0600 0.3400 0.3290"),
        ),
        (vec![primaries(34_000), gamma(100_000)], Some("the gamma 1.00000 (gAMA)")),
        (vec![cicp([9, 16, 0, 1])], Some("the code points [9, 16, 0, 1] (cICP)")),
        (vec![cicp([9, 16, 0, 1]), srgb.clone()], Some("the code points [9, 16, 0, 1] (cICP)")),
        (vec![cicp([1, 13, 0, 1]), iccp(&icc("Display P3", 4))], None),
        (vec![srgb, iccp(&icc("Display P3", 4))], Some("the ICC profile \"Display P3\"")),
        (vec![gamma(100_000), iccp(&icc("sRGB v4", 4))], None),
    ] {
        assert_eq!(said(&png(&chunks)).profile.as_deref(), told);
    }
}

#[test]
fn a_turn_is_told_wherever_it_stands() {
    let exif = b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0";
    let attribute = b"<rdf:Description tiff:Orientation=\"6\" x=\"1\"/>";
    let element = b"<tiff:Orientation>\n 6 </tiff:Orientation>";
    let renamed =
        b"<x xmlns:a = 'http://ns.adobe.com/tiff/1.0/'><a:Orientation q:t=\"u\">6</a:Orientation></x>";
    let raw = |kind: &str, data: &[u8]| {
        let digits: String = data.iter().map(|byte| format!("{byte:02x}")).collect();
        format!("\n{kind}\n {:8}\n{}\n{}\n", data.len(), &digits[..10], &digits[10..])
    };
    let app1 = raw("exif", &[b"Exif\0\0", &exif[..]].concat());
    let raw_xmp = raw("xmp", element);
    let itxt = |packed: bool, text: &[u8]| {
        let text = if packed { zlib(text) } else { text.to_vec() };
        png_chunk(b"iTXt", &[&b"XML:com.adobe.xmp\0"[..], &[u8::from(packed), 0], b"en\0\0", &text].concat())
    };
    let named = |key: &str, text: &[u8]| [format!("Raw profile type {key}\0").as_bytes(), text].concat();
    let mut all = vec![
        tiff(&[(700, words(attribute))]),
        tiff(&[(274, vec![6])]),
        tiff(&[(700, words(renamed))]),
        exr(&[("Orientation", "int", &6i32.to_le_bytes())]),
    ];
    all.extend(
        [&attribute[..], element, renamed]
            .map(|packet| jpeg(&[segment(0xE1, &[b"http://ns.adobe.com/xap/1.0/\0", packet].concat())])),
    );
    all.extend(
        [
            png_chunk(b"eXIf", exif),
            png_chunk(b"eXIf", &[b"Exif\0\0", &exif[..]].concat()),
            itxt(true, renamed),
            itxt(false, attribute),
            itxt(true, element),
            png_chunk(b"tEXt", &named("exif", app1.as_bytes())),
            png_chunk(b"tEXt", &named("APP1", app1.as_bytes())),
            png_chunk(b"zTXt", &named("exif", &[&[0], &zlib(app1.as_bytes())[..]].concat())),
            png_chunk(b"tEXt", &named("xmp", raw_xmp.as_bytes())),
        ]
        .map(|chunk| png(&[chunk])),
    );
    for (number, bytes) in all.iter().enumerate() {
        assert_eq!(said(bytes).orientation, 6, "{number}");
    }
    for text in [
        &b"<x a:Orientation=\"6\"/>"[..],
        b"<x xmlns:a='http://ns.other/' a:Orientation=\"6\"/>",
        b"",
        b"tiff:Orientation",
        b"tiff:Orientation=\"\"",
        b"tiff:Orientation=\"9\"",
        b"Orientation=6",
    ] {
        assert_eq!(said(&png(&[itxt(false, text)])).orientation, 1);
        assert_eq!(said(&tiff(&[(700, words(text))])).orientation, 1);
    }
    assert_eq!(said(&png(&[png_chunk(b"tEXt", b"Comment\0tiff:Orientation=\"6\"")])).orientation, 1);
    assert_eq!(samples(&all[0]), samples(&tiff(&[])));
    assert_eq!(samples(&all[3]), samples(&exr(&[])));
}

#[test]
fn levels_of_black_and_white_are_told() {
    // Of rationals the helper writes the halves, so that these are whole numbers of a list here.
    let full = vec![0, 255, 0, 255, 0, 255];
    for tags in [
        vec![],
        vec![(281, vec![255])],
        vec![(281, vec![200])],
        vec![(532, full.clone())],
        vec![(50714, vec![0, 0, 0])],
        vec![(50717, vec![255; 3])],
    ] {
        assert_eq!(said(&tiff(&tags)).profile, None);
    }
    for (tags, told) in [
        (vec![(532, vec![16, 235, 0, 255, 0, 255])], "the reference black and white [16.0, 235.0, 0"),
        (vec![(532, vec![0])], "the reference black and white [0.0]"),
        (vec![(50714, vec![0, 4, 0])], "the black level [0.0, 4.0, 0.0]"),
        (vec![(50717, vec![200])], "the white level [200.0]"),
        (vec![(50712, vec![0, 1])], "a linearization table"),
        (vec![(281, vec![127])], "the largest sample value [127.0]"),
        (vec![(291, vec![0])], "a grey response curve"),
        (vec![(50714, vec![9]), (50717, vec![200])], "the black level [9.0], with the white level [200.0]"),
        (
            vec![(34675, words(&icc("Adobe RGB", 2))), (50717, vec![200])],
            "the ICC profile \"Adobe RGB\", with the white level [200.0]",
        ),
    ] {
        let found = said(&tiff(&tags)).profile.unwrap();
        assert!(found.contains(told), "{found}");
        assert_eq!(samples(&tiff(&tags)), samples(&tiff(&[])));
    }
}

#[test]
fn primaries_are_told_by_every_format_that_has_them() {
    use crate::picture_files::{HdrCoding, RGBE, exr_with_attributes, hdr_of, rgbe};
    let (srgb, p3) = (
        [0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329f32],
        [0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.329],
    );
    let told = Some("the primaries 0.6800 0.3200 0.2650 0.6900 0.1500 0.0600 0.3127 0.3290");
    let hdr = |format: &str, primaries: [f32; 8]| {
        let primaries = primaries.map(|value| value.to_string()).join(" ");
        let lines = format!("{format}PRIMARIES= {primaries}\n");
        hdr_of(&lines, "-Y 1 +X 8", &rgbe(8), 8, HdrCoding::Flat)
    };
    let exr = |names: [&str; 3], primaries| exr_with_attributes(names, Some(primaries), None);
    for (bytes, told) in [
        (hdr(RGBE, srgb), None),
        (hdr(RGBE, p3), told),
        (hdr("FORMAT=32-bit_rle_xyze\n", p3), None),
        (exr(["R", "G", "B"], srgb), None),
        (exr(["R", "G", "B"], p3), told),
        (exr(["X", "Y", "Z"], p3), None),
        // Whole numbers stand in for fractions.
        (
            tiff(&[(319, vec![1, 0, 0, 1, 0, 0])]),
            Some("the primaries 1.0000 0.0000 0.0000 1.0000 0.0000 0.0000"),
        ),
    ] {
        assert_eq!(said(&bytes).profile.as_deref(), told);
    }
    let odd = hdr_of(&format!("{RGBE}PRIMARIES=sRGB\n"), "-Y 1 +X 8", &rgbe(8), 8, HdrCoding::Flat);
    assert!(said(&odd).profile.unwrap().contains("primaries"));
}

/// Exif data of one entry in the first directory, or in the one that it leads to: a tag of rationals in hundredths.
fn exif_of_number(tag: u16, hundredths: &[u32], below: bool) -> Vec<u8> {
    let count = (hundredths.len() as u32).to_be_bytes();
    let numbers: Vec<u8> =
        hundredths.iter().flat_map(|n| [n.to_be_bytes(), 100u32.to_be_bytes()].concat()).collect();
    let entry = |at: u32| {
        [&b"\0\x01"[..], &tag.to_be_bytes(), b"\0\x05", &count, &at.to_be_bytes(), &[0; 4]].concat()
    };
    let head = b"MM\0*\0\0\0\x08";
    match below {
        false => [&head[..], &entry(26), &numbers].concat(),
        true => {
            let first = b"\0\x01\x87\x69\0\x04\0\0\0\x01\0\0\0\x1A\0\0\0\0";
            [&head[..], first, &entry(44), &numbers].concat()
        }
    }
}

#[test]
fn metadata_that_change_what_samples_mean_are_told_by_every_format() {
    let text = |key: &str, value: &str| png(&[png_chunk(b"tEXt", format!("{key}\0{value}").as_bytes())]);
    let in_jpeg = |block: &[u8]| jpeg(&[segment(0xE1, &[b"Exif\0\0", block].concat())]);
    let in_png = |block: &[u8]| png(&[png_chunk(b"eXIf", block)]);
    let described = |description: &str| {
        let mut text = description.as_bytes().to_vec();
        text.resize(text.len().next_multiple_of(4), 0);
        tiff(&[(270, words(&text))])
    };
    let gamma = exif_of_number(42240, &[220], true);
    let white = exif_of_number(318, &[31, 32], false);
    for (bytes, told) in [
        (text("Gamma", "2.2"), "Gamma \"2.2\""),
        (text("exif:Orientation", "6"), "exif:Orientation \"6\""),
        (exr(&[("oiio:Gamma", "float", &2.4f32.to_le_bytes())]), "oiio:Gamma \"2.4\""),
        (exr(&[("Orientation", "string", b"rotated 90 CW")]), "Orientation"),
        (exr(&[("xmp", "string", b"<x/>")]), "xmp"),
        (exr(&[("ICCProfile", "uint8[4]", &[0; 4])]), "ICCProfile"),
        (exr(&[("expTime", "float", &0.5f32.to_le_bytes())]), "the exposure that expTime states"),
        (in_jpeg(&gamma), "Gamma \"2.2\""),
        (in_png(&gamma), "Gamma \"2.2\""),
        (in_jpeg(&white), "WhitePoint \"0.31 0.32\""),
        (in_png(&white), "WhitePoint"),
        (tiff(&[(340, vec![16, 16, 16])]), "SMinSampleValue \"16 16 16\""),
        (tiff(&[(341, vec![235, 235, 235])]), "SMaxSampleValue"),
        (tiff(&[(50730, vec![1])]), "the exposure that BaselineExposure states"),
        (described("ImageJ=1.53t\nimages=1\ncf=0\nc0=2\nc1=3\nvunit=OD\n"), "ImageJ:CalibrationFunction"),
        (described("<?xml?><OME><Image><Pixels SignificantBits=\"6\"/></OME>"), "OME:SignificantBits \"6\""),
    ] {
        let remarks = said(&bytes).remarks;
        let [found] = remarks.as_slice() else { panic!("{told}: {remarks:?}") };
        assert!(found.contains(told) && found.contains("not applied"), "{found}, expected {told}");
    }
    assert!(said(&tiff(&[(318, vec![1, 1])])).profile.unwrap().contains("the white point"));
    for bytes in [
        text("Gamma", "1.0"),
        text("Software", "GIMP"),
        exr(&[("oiio:Gamma", "float", &1f32.to_le_bytes())]),
        in_jpeg(&exif_of_number(42240, &[100], true)),
        tiff(&[(340, vec![0, 0, 0]), (341, vec![255, 255, 255])]),
        described("ImageJ=1.53t\nimages=1\nunit=mm\n"),
        described("<OME><Image><Pixels SignificantBits=\"8\"/></OME>"),
    ] {
        assert_eq!(said(&bytes).remarks, [""; 0]);
    }
}
