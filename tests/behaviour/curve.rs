//! The curve of error against compression, as table, JSON and chart.

use serde_json::Value;

use crate::fixture::{btf, fail, fixture, succeed, tree};

#[test]
fn a_curve_falls_is_drawn_and_leaves_the_model_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("curve.png");
    let curve = || {
        let mut command = btf();
        command.arg("curve").args([fixture().measurement(), fixture().model()]);
        command
    };
    let before = tree(&fixture().model());
    let told: Value =
        serde_json::from_str(&succeed(curve().args(["--most", "64", "--json", "--out"]).arg(&out))).unwrap();
    assert!(tree(&fixture().model()) == before, "the model is another");

    let points = told["points"].as_array().unwrap();
    let column = |name: &str| -> Vec<f64> { points.iter().map(|p| p[name].as_f64().unwrap()).collect() };
    assert_eq!(column("clusters"), [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0]);
    let errors = column("mean_lightness_error");
    assert!(errors.windows(2).all(|pair| pair[1] < 1.01 * pair[0]), "{errors:?}");
    assert!(errors[6] < 0.5 * errors[0] && errors[6] > 0.0, "{errors:?}");
    // Of 9 x 19 images in three 8-bit channels, each cluster; and a byte a texel of the tile.
    let texels = told["tile_texels"].as_f64().unwrap();
    let raw = f64::from(56 * 48 * 9 * 19 * 3);
    for (clusters, (bytes, ratio)) in
        column("clusters").iter().zip(column("bytes").into_iter().zip(column("ratio")))
    {
        assert_eq!(bytes, clusters * f64::from(9 * 19 * 3) + texels);
        assert!((ratio * bytes / raw - 1.0).abs() < 1e-12);
    }

    let file = std::io::BufReader::new(std::fs::File::open(&out).unwrap());
    let info = png::Decoder::new(file).read_info().unwrap();
    assert_eq!((info.info().width, info.info().height), (900, 600));

    let table = succeed(curve().args(["--most", "64", "--threads", "1"]));
    let last = table.lines().nth(7).unwrap();
    assert!(last.starts_with("64 ") && last.contains(&format!("{:.3}", errors[6])), "{table}");
    assert!(fail(curve().args(["--most", "1"]), 2).contains("expected 2 to"));
}
