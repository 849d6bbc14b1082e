//! A set is complete or the report says all that is wrong with it.

use btfkit_formats::ubo2003::{directions_81, write_name};
use btfkit_formats::{Angles, Catalogue, CatalogueErrors, Pair};

/// The names of a published set with these numbers of views and lights.
fn names(views: usize, lights: usize) -> Vec<String> {
    let d = directions_81();
    let mut names = Vec::new();
    for (l, &light) in d.iter().take(lights).enumerate() {
        for (v, &view) in d.iter().take(views).enumerate() {
            names.push(write_name(l as u32, light, v as u32, view, 81).unwrap());
        }
    }
    names
}

fn catalogue(names: &[String]) -> Result<Catalogue, Box<CatalogueErrors>> {
    Catalogue::from_names(names.iter().map(String::as_str))
}

#[test]
fn a_full_set_is_in_the_published_order() {
    let names = names(81, 81);
    let found = catalogue(&names).unwrap();
    assert_eq!(found.views(), directions_81());
    assert_eq!(found.lights(), directions_81());
    for view in 0..81 {
        for light in 0..81 {
            assert_eq!(found.image(view, light), Some(81 * light + view));
        }
    }
    assert_eq!((found.image(81, 0), found.image(0, 81)), (None, None));
    assert_eq!(found.image(usize::MAX, 80), None);
}

#[test]
fn the_order_of_names_does_not_matter() {
    let mut names = names(5, 7);
    names.sort_by_key(|name| name.bytes().rev().collect::<Vec<u8>>());
    names.insert(3, "readme.txt".into());
    names.push("Thumbs.db".into());
    let found = catalogue(&names).unwrap();
    assert_eq!((found.views().len(), found.lights().len(), found.ignored()), (5, 7, 2));
    for (view, &v) in found.views().iter().enumerate() {
        for (light, &l) in found.lights().iter().enumerate() {
            let expected = write_name(light as u32, l, view as u32, v, 81).unwrap();
            assert_eq!(names[found.image(view, light).unwrap()], expected);
        }
    }
}

#[test]
fn one_view_with_many_lights_is_a_set() {
    let found = catalogue(&names(1, 81)).unwrap();
    assert_eq!((found.views().len(), found.lights().len()), (1, 81));
}

#[test]
fn all_holes_are_reported() {
    let mut names = names(6, 6);
    let lost: Vec<String> = [35, 20, 3].map(|i| names.remove(i)).into();
    let errors = *catalogue(&names).unwrap_err();
    assert_eq!((errors.images, errors.views, errors.lights), (33, 6, 6));
    assert_eq!((errors.missing.len(), errors.missing_count, errors.duplicates.len()), (3, 3, 0));
    let mut expected: Vec<_> =
        lost.iter().map(|name| btfkit_formats::ubo2003::parse_name(name).unwrap()).collect();
    expected.sort_by_key(|name| (name.view, name.light));
    for (pair, name) in errors.missing.iter().zip(expected) {
        assert_eq!((pair.view, pair.light), (name.view, name.light));
    }
}

#[test]
fn all_duplicates_are_reported_with_their_names() {
    let mut names = names(3, 3);
    names.push("copy of tl15 pl0 tv0 pv0.JPG".into());
    names.push("tl0 pl90 tv0 pv180.jpeg".into());
    names.push("x tl0 tv0 pl0 pv0.jpeg".into());
    let errors = *catalogue(&names).unwrap_err();
    assert_eq!((errors.missing_count, errors.duplicates.len()), (0, 2));
    assert_eq!(errors.duplicates[0].names, [&names[0], &names[10], &names[11]].map(Clone::clone));
    assert_eq!(errors.duplicates[1].names, [&names[3], &names[9]].map(Clone::clone));
    let text = errors.to_string();
    for name in [&names[0], &names[3], &names[9], &names[10], &names[11]] {
        assert!(text.contains(name.as_str()), "{text}");
    }
}

#[test]
fn the_report_names_twenty_and_counts_the_rest() {
    let mut names = names(81, 81);
    names.drain(1000..1020);
    let text = catalogue(&names).unwrap_err().to_string();
    assert_eq!(text.matches("\n  tl").count(), 20, "{text}");
    assert!(!text.contains("more"), "{text}");
    names.drain(2000..2005);
    let text = catalogue(&names).unwrap_err().to_string();
    assert!(text.contains("missing: 25\n"), "{text}");
    assert_eq!(text.matches("\n  tl").count(), 20, "{text}");
    assert!(text.ends_with("\n  and 5 more"), "{text}");
}

#[test]
fn no_image_at_all_is_an_error() {
    let errors = catalogue(&["readme.txt".into()]).unwrap_err();
    assert_eq!((errors.images, errors.ignored), (0, 1));
    assert!(errors.to_string().contains("no image among 1 name,"));
    assert!(catalogue(&[]).is_err());
}

#[test]
fn a_few_names_cannot_ask_for_a_huge_list() {
    let names: Vec<String> = (0..3000u32)
        .map(|i| format!("tl{} pl0 tv{} pv0.jpg", 1.0 + f64::from(i) / 100.0, 1.0 + f64::from(i) / 100.0))
        .collect();
    let errors = catalogue(&names).unwrap_err();
    assert_eq!(errors.missing_count, 3000 * 3000 - 3000);
    assert_eq!(errors.missing.len(), 65_536);
}

#[test]
fn one_pair_in_two_formats_is_a_duplicate() {
    let mut names = names(2, 2);
    names.push(names[1].replace(".jpg", ".hdr"));
    let errors = *catalogue(&names).unwrap_err();
    assert_eq!((errors.missing_count, errors.duplicates.len()), (0, 1));
    assert_eq!(errors.duplicates[0].names, [&names[1], &names[4]].map(Clone::clone));
}

#[test]
fn a_set_may_be_spread_over_containers() {
    let names = names(3, 5);
    let of_view = |view: usize| names.iter().skip(view).step_by(3);
    let views = [of_view(2), of_view(0), of_view(1)];
    let chained: Vec<&str> = views.into_iter().flatten().map(String::as_str).collect();
    let found = Catalogue::from_names(chained.iter().copied()).unwrap();
    for (view, first) in [(0, 5), (1, 10), (2, 0)] {
        let positions: Vec<_> = (0..5).map(|light| found.image(view, light).unwrap()).collect();
        assert_eq!(positions, (first..first + 5).collect::<Vec<_>>());
    }
}

/// A set of one view from its lights.
fn of_lights(lights: &[(f64, f64)]) -> Result<Catalogue, Box<CatalogueErrors>> {
    let pair =
        |&(theta, phi): &(f64, f64)| Pair { view: Angles::FRONTAL, light: Angles::new(theta, phi).unwrap() };
    Catalogue::from_pairs(lights.iter().map(|light| ("some name", Some(pair(light)))))
}

#[test]
fn directions_that_differ_by_rounding_are_one() {
    const ROUNDING_DEG: f64 = 4e-5;
    for (theta, phi) in [(15.0, 60.0), (75.0, 0.0), (90.0, 360.0), (1.0, 180.0)] {
        for (near_theta, near_phi) in
            [(theta - ROUNDING_DEG, phi), (theta, phi - ROUNDING_DEG), (theta, phi + ROUNDING_DEG)]
        {
            let errors = of_lights(&[(theta, phi), (near_theta, near_phi)]).unwrap_err();
            assert_eq!(
                (errors.lights, errors.duplicates.len()),
                (1, 1),
                "{theta} {phi} {near_theta} {near_phi}"
            );
        }
        let apart = of_lights(&[(theta, phi), (theta - 2.0 * ROUNDING_DEG, phi)]).unwrap();
        assert_eq!(apart.lights().len(), 2);
    }
    // A phi just below 360 is near to 0, whatever lies between.
    let ring = [(75.0, 0.0), (75.0, 120.0), (75.0, 240.0), (75.0, 360.0 - ROUNDING_DEG)];
    assert_eq!(of_lights(&ring).unwrap_err().lights, 3);
    // At the pole every phi is one direction, and nearly so beside it.
    assert_eq!(of_lights(&[(0.0, 0.0), (ROUNDING_DEG, 77.0), (0.0, 190.0)]).unwrap_err().lights, 1);
    // A large step of phi is a small one near the pole.
    assert_eq!(of_lights(&[(1e-3, 60.0), (1e-3, 60.5)]).unwrap_err().lights, 1);
    assert_eq!(of_lights(&[(1.0, 60.0), (1.0, 60.5)]).unwrap().lights().len(), 2);
}

#[test]
fn noise_of_theta_does_not_disturb_the_order_of_a_ring() {
    let found = of_lights(&[(30.0, 0.0), (15.00002, 10.0), (15.0, 200.0), (15.00001, 100.0)]).unwrap();
    let phis: Vec<f64> = found.lights().iter().map(|light| light.phi_deg()).collect();
    assert_eq!(phis, [10.0, 100.0, 200.0, 0.0]);
    assert_eq!(found.lights()[0].theta_deg(), 15.00002, "what was given is kept");
    let positions: Vec<_> = (0..4).map(|light| found.image(0, light).unwrap()).collect();
    assert_eq!(positions, [1, 3, 2, 0]);
}

#[test]
fn a_picture_that_is_alone_is_named() {
    let mut names = names(6, 6);
    let wrong = names[20].replace("pl120", "pl201");
    assert_ne!(wrong, names[20]);
    names[20].clone_from(&wrong);
    let errors = *catalogue(&names).unwrap_err();
    assert_eq!(errors.lone, std::slice::from_ref(&wrong));
    let words = format!("the only picture of its light or view, so perhaps misnamed: 1\n  {wrong:?}");
    assert!(errors.to_string().contains(&words), "{errors}");
    // Where every light and view has one picture only, none is.
    let two = [self::names(2, 2)[0].clone(), self::names(2, 2)[3].clone()];
    assert_eq!(catalogue(&two).unwrap_err().lone, [""; 0]);
}
