//! Pictures against closed forms, and objects against what they must not do.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::sync::atomic::AtomicBool;

use btfkit_formats::Direction;

use super::camera::{Camera, Ray, View};
use super::corner::Corner;
use super::light::{Light, Place};
use super::mesh::Mesh;
use super::surface::Surface;
use super::texture::Texture;
use super::{Background, Environment, Scene, interior, render};
use crate::method::value::evaluator::Evaluator;
use crate::method::value::table::ClusterTable;
use crate::method::value::triangulation::triangulate;
use crate::picture::Picture;
use crate::run::budget::{Allowance, Room};
use crate::run::{Context, progress::Silent};
use crate::shape::Size;
use crate::vector::{Vector, along, dot, unit};

fn room() -> Room {
    Room::new(Allowance::new(64 << 20))
}

const SIZE: Size = Size { height: 48, width: 48 };

/// One cluster under the 81 directions of Bonn whose value depends on the light alone.
fn material(value: impl Fn(Vector) -> [f32; 3]) -> Evaluator {
    let angles = btfkit_formats::ubo2003::directions_81();
    let directions: Vec<Direction> =
        angles.iter().map(|a| Direction::from_degrees(a.theta_deg(), a.phi_deg())).collect();
    let triangles = triangulate(&directions);
    let mut table = ClusterTable::new(81, 81);
    table.push_colors((0..81 * 81).map(|pair| value(directions[pair % 81].vector())));
    Evaluator::new((&directions, &triangles), (&directions, &triangles), table)
}

fn white() -> Evaluator {
    material(|light| [light[2] as f32; 3])
}

/// Where the light comes from in the frame of the surface, as a colour.
fn compass() -> Evaluator {
    material(|[x, y, z]| [x, y, z].map(|value| (0.5 + 0.5 * value) as f32))
}

fn scene(surface: Surface, lights: Vec<Light>) -> Scene {
    let background = Background::Grey(0.0);
    Scene { surface, lights, background, shadows: true, density: 64.0, origin: [0.0; 2], turn_rad: 0.0 }
}

fn shown(scene: &Scene, evaluator: &Evaluator, eye: Vector, threads: usize) -> Picture {
    let stop = AtomicBool::new(false);
    let context = Context::new(&Silent, &stop, threads, 1 << 30).unwrap();
    let view = View { eye, target: [0.0; 3], up: [0.0, 1.0, 0.0], fov_deg: 30.0, orthographic: true };
    let camera = Camera::new(view, SIZE).unwrap();
    let texture = Texture::Whole { size: Size::new(1, 1), wraps: true, index: vec![0] };
    render(scene, &camera, (evaluator, &texture), SIZE, 1, &context).unwrap().picture
}

/// The ray through the middle of a pixel of such a picture from the front, and where it meets the sphere.
fn on_sphere(pixel: usize) -> Option<Vector> {
    let step = 2.0 * 15f64.to_radians().tan() * 4.0 / 48.0;
    let x = ((pixel % 48) as f64 + 0.5 - 24.0) * step;
    let y = (24.0 - (pixel / 48) as f64 - 0.5) * step;
    let square = 1.0 - x * x - y * y;
    (square > 0.0).then(|| [x, y, square.sqrt()])
}

#[test]
fn a_lambertian_sphere_is_the_cosine() {
    let light = Direction::from_degrees(50.0, 120.0);
    let scene = scene(Surface::Sphere, vec![Light::far(light)]);
    let picture = shown(&scene, &white(), [0.0, 0.0, 4.0], 2);
    let mut seen = 0;
    for (n, pixel) in picture.pixels.iter().enumerate() {
        let expected = on_sphere(n).map_or(0.0, |point| dot(point, light.vector()).max(0.0));
        // Between measured directions the cosine is mixed of those around it: below 1.5 % less.
        assert!((f64::from(pixel[0]) - expected).abs() < 0.016, "{n}: {} {expected}", pixel[0]);
        seen += usize::from(expected > 0.0);
    }
    assert!(seen > 700, "{seen}");
    assert_eq!(shown(&scene, &white(), [0.0, 0.0, 4.0], 1), picture, "other threads, another picture");
}

#[test]
fn a_light_at_a_point_falls_with_the_square_of_the_distance() {
    let lamp = [1.0, 0.5, 3.0];
    let picture = shown(&scene(Surface::Sphere, vec![Light::at(lamp)]), &white(), [0.0, 0.0, 4.0], 2);
    for (n, pixel) in picture.pixels.iter().enumerate() {
        let Some(point) = on_sphere(n) else { continue };
        let way = along(lamp, -1.0, point);
        let expected = dot(point, unit(way).unwrap()).max(0.0) * dot(lamp, lamp) / dot(way, way);
        assert!((f64::from(pixel[1]) - expected).abs() < 0.03, "{n}: {} {expected}", pixel[1]);
    }
}

/// A Radiance picture of so many rows and twice as many columns.
fn radiance(rows: usize, value: impl Fn(usize, usize) -> [u8; 4]) -> Vec<u8> {
    let mut bytes = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {rows} +X {}\n", 2 * rows).into_bytes();
    bytes.extend((0..rows * rows * 2).flat_map(|n| value(n / (2 * rows), n % (2 * rows))));
    bytes
}

#[test]
fn light_of_one_from_everywhere_makes_white_white_and_a_spot_is_a_light() {
    // 128 / 256 * 2^(129 - 128) = 1.
    let even = Environment::read(&radiance(3, |_, _| [128, 128, 128, 129]), 30.0, &mut room()).unwrap();
    let even = scene(Surface::Sphere, even.lights(600));
    let picture = shown(&even, &white(), [0.0, 0.0, 4.0], 2);
    // A picture so coarse has few lights, all of whose directions count.
    let middle = picture.pixels[24 * 48 + 24];
    assert!(middle.iter().all(|value| (0.8..1.2).contains(value)), "{middle:?}");
    let fine = Environment::read(&radiance(64, |_, _| [128, 128, 128, 129]), 0.0, &mut room()).unwrap();
    let fine = scene(Surface::Sphere, fine.lights(512));
    for (n, pixel) in shown(&fine, &white(), [0.0, 0.0, 4.0], 2).pixels.iter().enumerate() {
        assert!(on_sphere(n).is_none() || (0.94..1.03).contains(&pixel[0]), "{n}: {pixel:?}");
    }
    // Row 16 of 64 is 45 degrees up, column 32 of 128 is to the left, and turned by a quarter it is behind.
    for (turn, expected) in [(0.0, [-0.707, 0.707, 0.0]), (90.0, [0.0, 0.707, -0.707])] {
        let spot =
            radiance(64, |row, column| if (row, column) == (15, 31) { [200, 0, 0, 150] } else { [0; 4] });
        let spot = Environment::read(&spot, turn, &mut room()).unwrap();
        let lights = spot.lights(64);
        assert_eq!(lights.len(), 1);
        let Place::Far(direction) = lights[0].place else { panic!("an environment is far away") };
        assert!(dot(direction, unit(expected).unwrap()) > 0.998, "{direction:?}");
        assert!(lights[0].color[0] > 0.0 && lights[0].color[1] == 0.0);
        assert!(spot.seen(direction)[0] > 0.0, "what lights is seen where it is");
    }
    assert!(Environment::read(b"no picture", 0.0, &mut room()).is_err());
}

/// A square of two triangles in the plane z = 0 whose texture coordinates are given by place.
fn square(texture: impl Fn(f64, f64) -> [f64; 2], tangent: Option<(Vector, f64)>) -> Vec<[Corner; 3]> {
    let corner = |x: f64, y: f64| Corner {
        place: [x, y, 0.0],
        texture: texture(x, y),
        normal: Some([0.0, 0.0, 1.0]),
        tangent,
    };
    let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    vec![[a, b, c], [a, c, d]]
}

/// A binary glTF of triangles, with their tangents if they have any. `x` is the factor of a matrix on its x.
fn glb(triangles: &[[Corner; 3]], x: f64) -> Vec<u8> {
    let corners: Vec<&Corner> = triangles.iter().flatten().collect();
    let tangents = corners[0].tangent.is_some();
    let numbers: [(&str, &str, Vec<f64>); 4] = [
        ("POSITION", "VEC3", corners.iter().flat_map(|corner| corner.place).collect()),
        ("NORMAL", "VEC3", corners.iter().flat_map(|corner| corner.normal.unwrap()).collect()),
        ("TEXCOORD_0", "VEC2", corners.iter().flat_map(|c| [c.texture[0], 1.0 - c.texture[1]]).collect()),
        (
            "TANGENT",
            "VEC4",
            corners.iter().filter_map(|c| c.tangent).flat_map(|([x, y, z], w)| [x, y, z, w]).collect(),
        ),
    ];
    let numbers = &numbers[..if tangents { 4 } else { 3 }];
    let (mut blob, mut views, mut accessors, mut names) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (n, (name, kind, values)) in numbers.iter().enumerate() {
        let bytes = 4 * values.len();
        views.push(format!(r#"{{"buffer":0,"byteOffset":{},"byteLength":{bytes}}}"#, blob.len()));
        let bounds = r#","min":[-1,-1,0],"max":[1,1,0]"#;
        let bounds = if *name == "POSITION" { bounds } else { "" };
        let count = corners.len();
        accessors.push(format!(
            r#"{{"bufferView":{n},"componentType":5126,"count":{count},"type":"{kind}"{bounds}}}"#
        ));
        names.push(format!(r#""{name}":{n}"#));
        blob.extend(values.iter().flat_map(|&value| (value as f32).to_le_bytes()));
    }
    let (views, accessors, names) = (views.join(","), accessors.join(","), names.join(","));
    let mut text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0,"scale":[{x},1,1]}}],"meshes":[{{"primitives":[{{"attributes":{{{names}}}}}]}}],"buffers":[{{"byteLength":{}}}],"bufferViews":[{views}],"accessors":[{accessors}]}}"#,
        blob.len()
    );
    text.push_str(&" ".repeat((4 - text.len() % 4) % 4));
    in_one_file(&text, &blob)
}

/// A description, of a multiple of four bytes, and the numbers that it speaks of.
fn in_one_file(text: &str, blob: &[u8]) -> Vec<u8> {
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend(((28 + text.len() + blob.len()) as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", text.as_bytes()), (b"BIN\0", blob)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

/// A Wavefront OBJ of triangles.
fn obj(triangles: &[[Corner; 3]]) -> Vec<u8> {
    let mut text = String::new();
    for corner in triangles.iter().flatten() {
        let ([x, y, z], [u, v]) = (corner.place, corner.texture);
        text.push_str(&format!("v {x} {y} {z}\nvt {u} {v}\nvn 0 0 1\n"));
    }
    for n in 0..triangles.len() {
        let [a, b, c] = [3 * n + 1, 3 * n + 2, 3 * n + 3];
        text.push_str(&format!("f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}\n"));
    }
    text.into_bytes()
}

#[test]
fn the_material_lies_as_the_texture_does_also_turned_and_mirrored() {
    type Case = (fn(f64, f64) -> [f64; 2], (Vector, f64), [[f64; 2]; 2]);
    // How the texture lies, its tangent, and its right and up in the world.
    let cases: [Case; 4] = [
        (|x, y| [x, y], ([1.0, 0.0, 0.0], 1.0), [[1.0, 0.0], [0.0, 1.0]]),
        (|x, y| [-x, y], ([-1.0, 0.0, 0.0], -1.0), [[-1.0, 0.0], [0.0, 1.0]]),
        (|x, y| [y, -x], ([0.0, 1.0, 0.0], 1.0), [[0.0, 1.0], [-1.0, 0.0]]),
        (|x, y| [x, -y], ([1.0, 0.0, 0.0], -1.0), [[1.0, 0.0], [0.0, -1.0]]),
    ];
    let light = Direction::from_degrees(45.0, 30.0);
    let [lx, ly, lz] = light.vector();
    for (n, (texture, tangent, [right, up])) in cases.into_iter().enumerate() {
        let plain = square(texture, None);
        let with_tangents = square(texture, Some(tangent));
        let files = [
            ("corners", Mesh::new(plain.clone())),
            ("corners with tangents", Mesh::new(with_tangents.clone())),
            ("obj", Mesh::read("a.obj", &obj(&plain), &mut room())),
            ("glb", Mesh::read("a.glb", &glb(&plain, 1.0), &mut room())),
            ("glb with tangents", Mesh::read("a.GLB", &glb(&with_tangents, 1.0), &mut room())),
        ];
        for (what, mesh) in files {
            let scene = scene(Surface::Mesh(mesh.unwrap()), vec![Light::far(light)]);
            let pixel = shown(&scene, &compass(), [0.0, 0.0, 4.0], 1).pixels[24 * 48 + 24];
            let local = [right[0] * lx + right[1] * ly, up[0] * lx + up[1] * ly, lz];
            for (found, expected) in pixel.iter().zip(local) {
                let expected = 0.5 + 0.5 * expected;
                assert!((f64::from(*found) - expected).abs() < 0.02, "case {n}, {what}: {pixel:?} {local:?}");
            }
        }
    }
    // An object that its node mirrors is mirrored with its texture, and keeps its front.
    let mesh = Mesh::read("a.glb", &glb(&square(|x, y| [x, y], None), -1.0), &mut room()).unwrap();
    let scene = scene(Surface::Mesh(mesh), vec![Light::far(light)]);
    let pixel = shown(&scene, &compass(), [0.0, 0.0, 4.0], 1).pixels[24 * 48 + 24];
    assert!((f64::from(pixel[0]) - (0.5 - 0.5 * lx)).abs() < 0.02, "{pixel:?}");
}

#[test]
fn what_lies_between_a_place_and_its_light_makes_shadow() {
    let lift = |z: f64, half: f64| {
        let mut triangles = square(|x, y| [x, y], None);
        for corner in triangles.iter_mut().flatten() {
            corner.place = [corner.place[0] * half, corner.place[1] * half, z];
        }
        triangles
    };
    let both: Vec<[Corner; 3]> = [lift(0.0, 1.0), lift(0.5, 0.3)].concat();
    let light = Direction::from_degrees(45.0, 0.0);
    let mut scene = scene(Surface::Mesh(Mesh::new(both).unwrap()), vec![Light::far(light)]);
    let dark = |picture: &Picture| picture.pixels.iter().filter(|pixel| pixel[0] < 0.1).count();
    let shadowed = shown(&scene, &white(), [0.0, 0.0, 4.0], 1);
    scene.shadows = false;
    let bare = shown(&scene, &white(), [0.0, 0.0, 4.0], 1);
    // The small square hides a square of its size; about half of that is seen beside it.
    assert!((40..160).contains(&(dark(&shadowed) - dark(&bare))), "{} {}", dark(&shadowed), dark(&bare));
}

#[test]
fn damaged_meshes_are_refused_or_read_and_never_more() {
    let triangles = square(|x, y| [x, y], Some(([1.0, 0.0, 0.0], 1.0)));
    for (name, bytes) in [("a.glb", glb(&triangles, 1.0)), ("a.obj", obj(&triangles))] {
        for end in 0..bytes.len() {
            let _ = Mesh::read(name, &bytes[..end], &mut room());
        }
        for at in 0..bytes.len() {
            for bit in 0..8 {
                let mut flipped = bytes.clone();
                flipped[at] ^= 1 << bit;
                let _ = Mesh::read(name, &flipped, &mut room());
            }
        }
    }
    let text =
        |text: &str| Mesh::read("a.obj", text.as_bytes(), &mut room()).err().map(|error| error.to_string());
    assert!(
        text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").is_some_and(|told| told.contains("texture coordinates"))
    );
    let mixed = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\nf 1/1 2 3/1\n";
    assert!(text(mixed).is_some_and(|told| told.contains("line 6: a face")), "{:?}", text(mixed));
    assert!(text("").is_some_and(|told| told.contains("without triangles")));
    assert!(text("v 0 0 0\nv nan 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n").is_some());
    assert!(Mesh::read("a.stl", b"solid", &mut room()).is_err());
    // A tree as deep as it gets: places that halve again and again.
    let deep = |n: i32| {
        let corner = |x: f64, y: f64| Corner {
            place: [x * 0.5f64.powi(n), y * 0.5f64.powi(n), 0.0],
            ..Corner::default()
        };
        [corner(1.0, 0.0), corner(1.5, 0.0), corner(1.0, 0.5)]
    };
    let mesh = Surface::Mesh(Mesh::new((0..400).map(deep).collect()).unwrap());
    let straight = |x: f64| Ray { origin: [x, 0.0, 1.0], direction: [0.0, 0.0, -1.0] };
    assert!((0..200).filter_map(|n| mesh.hit(&straight(f64::from(n) / 100.0 - 1.0))).count() > 0);
}

/// A triangle with indices: positions, texture coordinates and indices lie one behind the other, the indices as U32 of
/// 0, 1 and 2.
fn triangle_glb(change: impl Fn(String) -> String) -> Vec<u8> {
    let places = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].map(f32::to_le_bytes);
    let textures = [0.0f32, 0.0, 1.0, 0.0, 0.0, 1.0].map(f32::to_le_bytes);
    let indices = [0u32, 1, 2].map(u32::to_le_bytes);
    let blob = [&places.concat()[..], &textures.concat(), &indices.concat()].concat();
    let text = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"indices":2}]}],
        "buffers":[{"byteLength":72}],"bufferViews":[{"buffer":0,"byteLength":36},
        {"buffer":0,"byteOffset":36,"byteLength":24},{"buffer":0,"byteOffset":60,"byteLength":12}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
        {"bufferView":1,"componentType":5126,"count":3,"type":"VEC2"},
        {"bufferView":2,"componentType":5125,"count":3,"type":"SCALAR"}]}"#;
    let mut text = change(text.to_owned());
    text.push_str(&" ".repeat((4 - text.len() % 4) % 4));
    in_one_file(&text, &blob)
}

#[test]
fn numbers_of_a_glb_are_of_the_kind_that_its_standard_says() {
    let told = |change: &dyn Fn(String) -> String| {
        let mesh = Mesh::read("a.glb", &triangle_glb(change), &mut room());
        mesh.map_or_else(|error| error.to_string(), |mesh| format!("{} read", mesh.triangles()))
    };
    let instead = |from: &'static str, to: &'static str| told(&|text: String| text.replacen(from, to, 1));
    assert_eq!(told(&|text| text), "1 read");
    for (kind, name) in [("5126", "F32"), ("5120", "I8"), ("5122", "I16")] {
        let found = told(&|text| text.replacen("5125", kind, 1));
        let expected =
            format!("accessor 2: got 1 value of {name} for an index, expected one of U8, U16 or U32");
        assert!(found.contains(&expected), "{found}");
    }
    let found = instead(r#""type":"SCALAR""#, r#""type":"SCALAR","normalized":true"#);
    assert!(found.contains("U32, normalized, for an index"), "{found}");
    let found = instead(r#""count":3,"type":"SCALAR""#, r#""count":1,"type":"VEC3""#);
    assert!(found.contains("got 3 values of U32 for an index"), "{found}");
    let found = instead("VEC3", "VEC2");
    assert!(found.contains("accessor 0: got 2 values of F32 for a vertex, expected Vec3"), "{found}");
    let found = told(&|text| text.replacen("VEC2", "SCALAR", 1));
    assert!(found.contains("accessor 1: got 1 value of F32 for a vertex, expected Vec2"), "{found}");
    let found = instead("5126", "5125");
    assert!(found.contains("got 3 values of U32 for a vertex"), "{found}");
}

#[test]
fn a_glb_beyond_memory_is_refused_before_it_is_decoded() {
    let told = |change: &dyn Fn(String) -> String| {
        Mesh::read("a.glb", &triangle_glb(change), &mut room()).err().map(|error| error.to_string())
    };
    // A description of many nodes; a mesh that is there many times; primitives without a triangle.
    let nodes = told(&|text| text.replacen("{\"mesh\":0}", &vec!["{}"; 200_000].join(","), 1)).unwrap();
    assert!(nodes.contains("the description of a mesh") && nodes.contains("64 MiB are allowed"), "{nodes}");
    let primitive = r#"{"attributes":{"POSITION":0,"TEXCOORD_0":1},"indices":2}"#;
    let large = || Room::new(Allowance::new(400 << 20));
    for count in ["3", "1"] {
        let change = |text: String| {
            let nodes = text.replacen("\"nodes\":[0]", &format!("\"nodes\":[{}]", all(5000)), 1);
            let nodes = nodes.replacen("{\"mesh\":0}", &vec!["{\"mesh\":0}"; 5000].join(","), 1);
            let nodes = nodes.replacen(primitive, &vec![primitive; 5000].join(","), 1);
            nodes.replacen(
                "\"count\":3,\"type\":\"SCALAR\"",
                &format!("\"count\":{count},\"type\":\"SCALAR\""),
                1,
            )
        };
        let found = Mesh::read("a.glb", &triangle_glb(change), &mut large()).err().unwrap().to_string();
        assert!(found.contains("a mesh of") && found.contains("400 MiB are allowed"), "{count}: {found}");
    }
    let mut room = room();
    Mesh::read("a.glb", &triangle_glb(|text| text), &mut room).unwrap();
    assert!(room.left() < super::tests::room().left(), "a mesh takes of the room");
}

/// The numbers up to one, with commas.
fn all(count: usize) -> String {
    (0..count).map(|n| n.to_string()).collect::<Vec<_>>().join(",")
}

#[test]
fn light_from_opposite_sides_is_not_lost_where_one_light_stands_for_both() {
    // Two spots on the horizon, left and right of the middle; and the same light from everywhere.
    let spots = |row: usize, column: usize| match (row, column) {
        (31 | 32, 32 | 96) => [200, 200, 200, 140],
        _ => [0; 4],
    };
    let even = |_: usize, _: usize| [128, 128, 128, 129];
    for picture in [radiance(64, spots), radiance(64, even)] {
        let environment = Environment::read(&picture, 0.0, &mut room()).unwrap();
        let energy = |count: usize| environment.lights(count).iter().map(|light| light.color[1]).sum::<f64>();
        assert!(energy(256) > 0.0);
        for count in [1, 2, 3] {
            assert!((energy(count) / energy(256) - 1.0).abs() < 1e-9, "{count}: {}", energy(count));
            let shines = |light: &Light| match light.place {
                Place::Far(direction) => environment.seen(direction)[1] > 0.0,
                Place::At(_) => false,
            };
            assert!(environment.lights(1).iter().all(shines), "a light from where there is none");
        }
    }
}

#[test]
fn an_environment_beyond_memory_is_refused_before_it_is_decoded() {
    let picture = radiance(64, |_, _| [128, 128, 128, 129]);
    let small = Allowance::new((12 << 20) + 200_000);
    let told = Environment::read(&picture, 0.0, &mut Room::new(small)).err().unwrap().to_string();
    assert!(told.contains("an environment of 128 x 64 takes 13 MiB"), "{told}");
}

#[test]
fn the_interior_has_a_front_and_its_texture_one_size() {
    let mesh = Surface::Mesh(interior::mesh(&mut Room::new(Allowance::new(256 << 20))).unwrap());
    let eye = [0.4, 1.2, 4.0];
    let mut seen = 0;
    for n in 0..900 {
        let target = [f64::from(n % 30) / 15.0 - 1.0, f64::from(n / 30) / 15.0 - 1.0, 0.0];
        let ray = Ray { origin: eye, direction: unit(along(target, -1.0, eye)).unwrap() };
        let Some(hit) = mesh.hit(&ray) else { continue };
        seen += 1;
        assert!(dot(hit.normal, ray.direction) <= 0.0);
        let Ray { origin, direction } = ray;
        let beside = Ray { origin, direction: unit(along(direction, 1e-4, [1.0, 0.3, 0.0])).unwrap() };
        let Some(next) = mesh.hit(&beside).filter(|next| (next.distance - hit.distance).abs() < 1e-3) else {
            continue;
        };
        let way = along(next.point, -1.0, hit.point);
        let texture = (next.place[0] - hit.place[0]).hypot(next.place[1] - hit.place[1]);
        let ratio = texture / dot(way, way).sqrt();
        // Stretched where a bolster or a hood is lifted, never torn.
        assert!((0.3..3.0).contains(&ratio), "{ratio} at {:?}", hit.point);
    }
    assert!(seen > 250, "{seen}");
}

#[test]
fn a_ray_within_the_side_of_a_box_and_a_tangent_along_the_normal_leave_no_hole() {
    // Two strips that meet at x = 0: the boxes of both end there, and the ray runs along that side.
    let strip = |x: f64, tangent: Option<(Vector, f64)>| {
        let corner = |x: f64, y: f64| Corner {
            place: [x, y, 0.0],
            texture: [x, y],
            normal: Some([0.0, 0.0, 1.0]),
            tangent,
        };
        [
            [corner(0.0, -1.0), corner(x, -1.0), corner(x, 1.0)],
            [corner(0.0, -1.0), corner(x, 1.0), corner(0.0, 1.0)],
        ]
    };
    for tangent in [None, Some(([0.0, 0.0, 1.0], 1.0))] {
        let triangles = [strip(-1.0, tangent), strip(1.0, tangent)].concat();
        let mesh = Surface::Mesh(Mesh::new(triangles).unwrap());
        for y in [-0.4, 0.0, 0.3] {
            let ray = Ray { origin: [0.0, y, 4.0], direction: [0.0, 0.0, -1.0] };
            assert!(mesh.hit(&ray).is_some(), "{tangent:?}, y {y}");
        }
    }
}
