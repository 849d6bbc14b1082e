//! Clusters of more texels than go into memory at once: the same whatever memory, threads, shards and interruptions.

use std::path::{Path, PathBuf};
use std::process::Command;

use btfkit::method::cluster::points::Arrangement;
use btfkit::stage::cluster::{Ended, Report};
use btfkit::store::measurement::Measurement;
use btfkit::store::model::{Model, Stage};

use crate::fixture::{assert_same, btf, fail, fixture, succeed};

/// Recipe of the clusterings here: a sample far smaller than the plane, so that passes go over all texels.
const RECIPE: [&str; 8] = ["--clusters", "20", "--sample", "200", "--passes", "6", "--tolerance", "0"];

/// A model of the fixture's whole plane, not clustered yet.
fn plane(folder: &Path, name: &str) -> PathBuf {
    let model = folder.join(name);
    succeed(btf().arg("tile").args([&fixture().measurement(), &model]).args(["--tile", "none"]));
    model
}

fn cluster(model: &Path) -> Command {
    let mut command = btf();
    command.arg("cluster").args([&fixture().measurement(), model]).args(RECIPE);
    command
}

/// Where the first centres come from: by default, which is a sample, or from mini-batches.
const FIRSTS: [&[&str]; 2] = [&[], &["--first", "minibatch"]];

fn report(model: &Path) -> Report {
    Model::open(model).unwrap().report(Stage::Cluster).unwrap()
}

#[test]
fn threads_kernels_and_memory_change_no_byte() {
    for first in FIRSTS {
        let folder = tempfile::tempdir().unwrap();
        let [one, three] = ["one", "three"].map(|name| plane(folder.path(), name));
        // Little memory keeps neither blocks nor more than a few columns of bounds.
        let little = ["--threads", "1", "--memory", "68MiB"];
        succeed(cluster(&one).args(first).args(little).env("BTFKIT_KERNEL", "plain"));
        succeed(cluster(&three).args(first).args(["--threads", "3", "--memory", "4GiB"]));
        assert_same(&one, &three);
        let report = report(&one);
        assert!(report.passes.len() == 6, "{report:?}");
        assert!(report.batches.is_empty() == first.is_empty());
        assert_eq!(report.sample_texels, 200);
        assert!(!one.join("clustering").exists());
        fail(cluster(&plane(folder.path(), "none")).args(first).args(["--memory", "20MiB"]), 2);
    }
}

#[test]
fn mini_batches_double_and_each_pass_of_one_lowers_its_objective() {
    let folder = tempfile::tempdir().unwrap();
    let model = plane(folder.path(), "model");
    let options = ["--clusters", "20", "--sample", "80", "--passes", "6", "--tolerance", "0"];
    let mut command = btf();
    command.arg("cluster").args([&fixture().measurement(), &model]).args(options);
    succeed(command.args(["--first", "minibatch"]));
    let Report { batches, sample_texels, .. } = report(&model);
    let texels = fixture_texels();
    assert!(sample_texels == 80 && batches[0].texels >= 8 * sample_texels);
    assert!(batches.windows(2).any(|pair| pair[1].texels > pair[0].texels), "{batches:?}");
    for pair in batches.windows(2) {
        let (before, after) = (pair[0].texels, pair[1].texels);
        assert!(after == before || (after >= 2 * before && after < texels), "{batches:?}");
        assert!(after > before || pair[1].pass.objective <= pair[0].pass.objective, "{batches:?}");
        // Texels that join count as moved, those that stay go on with their clusters.
        assert!(after == before || pair[1].pass.moved >= after - before, "{batches:?}");
    }
    let moved = batches.iter().filter(|batch| batch.pass.moved == batch.texels).count();
    assert_eq!(moved, 1, "{batches:?}");
    assert!(2 * batches.last().unwrap().texels >= texels - 256);
}

fn fixture_texels() -> usize {
    Measurement::open(&fixture().measurement()).unwrap().description().size.texels()
}

#[test]
fn mini_batches_also_serve_where_all_texels_fit() {
    let folder = tempfile::tempdir().unwrap();
    let command = |name: &str, more: &[&str]| {
        let model = plane(folder.path(), name);
        let measurement = fixture().measurement();
        succeed(btf().arg("cluster").args([&measurement, &model]).args(["--clusters", "20"]).args(more));
        report(&model)
    };
    let all = command("all", &[]);
    let whole = command("whole", &["--first", "minibatch"]);
    assert_eq!((all.sample_texels, whole.sample_texels), (0, 0));
    assert_eq!(all.passes, whole.passes);
    let batches = command("batches", &["--first", "minibatch", "--sample", "300"]);
    assert!(batches.sample_texels == 300 && !batches.batches.is_empty());
    let error = |report: &Report| report.passes.last().unwrap().mean_lightness_error;
    assert!(error(&batches) <= 1.02 * error(&all), "{} against {}", error(&batches), error(&all));
    fail(
        btf()
            .arg("cluster")
            .args([&fixture().measurement(), &plane(folder.path(), "x")])
            .args(["--first", "all"]),
        2,
    );
}

#[test]
fn any_number_of_shards_gives_the_bytes_of_one_process() {
    for (first, shards) in [(0, 1), (0, 2), (0, 7), (0, 40), (1, 1), (1, 5)] {
        let folder = tempfile::tempdir().unwrap();
        let whole = plane(folder.path(), "whole");
        succeed(cluster(&whole).args(FIRSTS[first]));
        let model = plane(folder.path(), &format!("shards-{shards}"));
        let step = |step: &str, more: &[&str]| {
            let mut command = cluster(&model);
            command.args(FIRSTS[first]).args(["--step", step]).args(more);
            command
        };
        fail(&mut step("assign", &[]), 66);
        succeed(&mut step("prepare", &[]));
        fail(&mut step("reduce", &[]), 66);
        for pass in 0..6 + report(&whole).batches.len() {
            let pass = pass.to_string();
            // Backwards, and the first one twice: two runs of one shard are normal on a cluster.
            for shard in (0..shards).rev().chain([0]) {
                succeed(&mut step("assign", &["--pass", &pass, "--shard", &format!("{shard}/{shards}")]));
            }
            succeed(&mut step("reduce", &["--pass", &pass]));
            succeed(&mut step("reduce", &["--pass", &pass]));
        }
        assert_same(&model, &whole);
        let told = succeed(&mut step("assign", &["--pass", "99"]));
        assert!(told.contains("20"), "{told}");
    }
}

#[test]
fn a_missing_or_torn_part_is_never_summed_up() {
    let folder = tempfile::tempdir().unwrap();
    let model = plane(folder.path(), "model");
    succeed(cluster(&model).args(["--step", "prepare"]));
    succeed(cluster(&model).args(["--step", "assign", "--shard", "0/2"]));
    assert!(fail(cluster(&model).args(["--step", "reduce"]), 66).contains("part_00001"));
    succeed(cluster(&model).args(["--step", "assign", "--shard", "1/2"]));
    let part = model.join("clustering/pass_0000/part_00001");
    for (file, cut) in
        [("counts/c/0/0", true), ("index/c/0", true), ("zarr.json", true), ("counts/c/0/0", false)]
    {
        let bytes = std::fs::read(part.join(file)).unwrap();
        let mut damaged = bytes.clone();
        if cut {
            damaged.truncate(bytes.len() / 2);
        } else {
            damaged[bytes.len() / 2] ^= 4;
        }
        std::fs::write(part.join(file), &damaged).unwrap();
        fail(cluster(&model).args(["--step", "reduce"]), 65);
        std::fs::write(part.join(file), &bytes).unwrap();
    }
    succeed(cluster(&model).args(["--step", "reduce"]));
    // One process goes on where the steps left off.
    succeed(&mut cluster(&model));
    let whole = plane(folder.path(), "whole");
    succeed(&mut cluster(&whole));
    assert_same(&model, &whole);
}

#[test]
fn the_index_is_the_true_argmin_of_the_stored_centres_and_so_are_the_representatives() {
    let folder = tempfile::tempdir().unwrap();
    let path = plane(folder.path(), "model");
    succeed(&mut cluster(&path));
    let measurement = Measurement::open(&fixture().measurement()).unwrap();
    let description = measurement.description();
    let lights = description.lights.len();
    let weights: Vec<u64> = Arrangement::new(&description.views, lights)
        .cosines()
        .iter()
        .map(|cosine| (cosine * 65536.0).round() as u64)
        .collect();
    let planes: Vec<Vec<u8>> = (0..weights.len())
        .map(|view| measurement.read_luminance(view, description.size.window()).unwrap())
        .collect();
    let model = Model::open(&path).unwrap();
    let clusters = model.read_clusters().unwrap();
    let distance = |texel: usize, cluster: usize| -> u64 {
        let centre = &clusters.centres[cluster * planes.len() * lights..][..planes.len() * lights];
        let views = planes.iter().zip(centre.chunks_exact(lights)).zip(&weights);
        views
            .map(|((plane, centre), weight)| {
                let codes = &plane[texel * lights..][..lights];
                weight * codes.iter().zip(centre).map(|(a, b)| u64::from(a.abs_diff(*b))).sum::<u64>()
            })
            .sum()
    };
    let texels = description.size.texels();
    let mut objective = 0;
    for texel in 0..texels {
        let best = (0..20).min_by_key(|&cluster| (distance(texel, cluster), cluster)).unwrap();
        assert_eq!(usize::from(clusters.index[texel]), best, "texel {texel}");
        objective += distance(texel, best);
    }
    assert_eq!(report(&path).passes.last().unwrap().objective, objective);
    for (cluster, &[row, column]) in clusters.sources.iter().enumerate() {
        let best = (0..texels).min_by_key(|&texel| (distance(texel, cluster), texel)).unwrap();
        assert_eq!(
            [row as usize, column as usize],
            [best / description.size.width, best % description.size.width]
        );
    }
}

#[test]
fn a_sample_and_passes_come_within_a_hundredth_of_all_texels_in_memory() {
    let folder = tempfile::tempdir().unwrap();
    let error = |name: &str, sample: &[&str]| {
        let model = plane(folder.path(), name);
        let measurement = fixture().measurement();
        succeed(btf().arg("cluster").args([&measurement, &model]).args(["--clusters", "24"]).args(sample));
        report(&model).passes.last().unwrap().mean_lightness_error
    };
    let memory = error("memory", &[]);
    let streamed = error("streamed", &["--sample", "900"]);
    assert!(streamed <= memory * 1.01, "{streamed} against {memory}");
}

#[test]
fn the_fewest_clusters_for_an_error_and_the_most_for_a_ratio() {
    let folder = tempfile::tempdir().unwrap();
    let minibatch = ["--sample", "300", "--first", "minibatch"];
    for (name, sample) in
        [("memory", &[][..]), ("streamed", &["--sample", "700"][..]), ("minibatch", &minibatch[..])]
    {
        let model = plane(folder.path(), name);
        let measurement = fixture().measurement();
        succeed(btf().arg("cluster").args([&measurement, &model]).args(["--error", "3"]).args(sample));
        let report = report(&model);
        // Of what is stored; centres leave less.
        assert!(report.representative_lightness_error <= 3.0, "{report:?}");
        assert!(report.passes.last().unwrap().mean_lightness_error < report.representative_lightness_error);
        // What was tried with the next fewer clusters left more.
        let fewer = report.trials.iter().rev().find(|trial| trial.clusters < report.clusters).unwrap();
        assert!(fewer.mean_lightness_error > 3.0 && fewer.clusters * 5 >= report.clusters * 4, "{report:?}");
    }
    // More clusters than the sample has texels cannot be tried.
    for first in FIRSTS {
        let model = plane(folder.path(), &format!("few-{}", first.len()));
        let options = ["--error", "0.5", "--sample", "30"];
        let mut command = btf();
        command.arg("cluster").args([&fixture().measurement(), &model]).args(options).args(first);
        assert!(fail(&mut command, 2).contains("--sample"));
    }
    let model = plane(folder.path(), "ratio");
    succeed(btf().arg("cluster").args([&fixture().measurement(), &model]).args(["--ratio", "50"]));
    let report = report(&model);
    let stored =
        |clusters: u64| report.representative_bytes / report.clusters as u64 * clusters + report.index_bytes;
    let [fits, does_not] = [0, 1].map(|more| stored(report.clusters as u64 + more));
    assert!(fits * 50 <= report.measurement_bytes && does_not * 50 > report.measurement_bytes);
}

#[test]
fn a_tile_takes_the_clusters_of_its_plane() {
    let folder = tempfile::tempdir().unwrap();
    let whole = plane(folder.path(), "plane");
    succeed(&mut cluster(&whole));
    let tile = folder.path().join("tile");
    succeed(btf().arg("tile").args([&fixture().measurement(), &tile]).args(["--tile", "24x24"]));
    let take = |model: &Path, from: &Path| {
        let mut command = btf();
        command.arg("cluster").args([&fixture().measurement(), model]).arg("--clusters-of").arg(from);
        command
    };
    let told = succeed(&mut take(&tile, &whole));
    assert!(told.contains("of plane"), "{told}");
    let [taken, all] = [&tile, &whole].map(|path| Model::open(path).unwrap());
    let (small, large) = (taken.read_clusters().unwrap(), all.read_clusters().unwrap());
    for (source, &cluster) in taken.tile().unwrap().source.iter().zip(&small.index) {
        let [row, column] = source.map(|n| n as usize);
        assert_eq!(cluster, large.index[row * large.size.width + column]);
    }
    assert_eq!((small.centres, small.sources), (large.centres, large.sources));
    // A tile cannot give what it does not hold, and a model of another recipe is not overwritten.
    let other = plane(folder.path(), "other");
    assert!(fail(&mut take(&other, &tile), 2).contains("is not in the tile"));
    fail(&mut cluster(&tile), 65);
}

#[test]
fn time_that_is_over_ends_a_clustering_after_a_pass() {
    let folder = tempfile::tempdir().unwrap();
    for (name, first, sample) in
        [("memory", "sample", "99999"), ("streamed", "sample", "200"), ("minibatch", "minibatch", "200")]
    {
        let model = plane(folder.path(), name);
        let options = ["--clusters", "20", "--first", first, "--sample", sample, "--time", "0"];
        succeed(btf().arg("cluster").args([&fixture().measurement(), &model]).args(options));
        let report = report(&model);
        assert_eq!((report.passes.len(), report.ended), (1, Ended::Time));
    }
}

/// The errors of `btf compare`: mean |dL*| and PSNR.
fn compared(measurement: &Path, model: &Path) -> [f64; 2] {
    let told = succeed(btf().arg("compare").args([measurement, model]).arg("--json"));
    let report: serde_json::Value = serde_json::from_str(&told).unwrap();
    ["lightness", "psnr_db"].map(|name| report["all"][name].as_f64().unwrap())
}

#[test]
fn means_and_medians_stand_for_clusters_whatever_the_samples_threads_and_steps() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for samples in ["u8", "f16"] {
        let store = at(&format!("{samples}.zarr"));
        succeed(btf().arg("import").args([&fixture().archive(), &store]).args(["--samples", samples]));
        let model = |rule: &str, options: &[&str]| {
            let model = at(&format!("{samples}-{rule}{}.model.zarr", options.concat()));
            succeed(btf().arg("tile").args([&store, &model]));
            let rule = ["--clusters", "20", "--representatives", rule];
            succeed(btf().arg("cluster").args([&store, &model]).args(rule).args(options));
            model
        };
        let [texel, mean, median] =
            ["texel", "mean", "median"].map(|rule| compared(&store, &model(rule, &[])));
        // Means have the least squared error, medians the least absolute one.
        assert!(mean[1] > median[1] && median[1] > texel[1] + 0.5, "{texel:?} {mean:?} {median:?}");
        assert!(median[0] < mean[0] && mean[0] < texel[0], "{texel:?} {mean:?} {median:?}");
        // A mean is that of the stored samples of the cluster's texels.
        let mean = model("mean", &["--threads", "3"]);
        assert_same(&at(&format!("{samples}-mean.model.zarr")), &mean);
        let passes = ["--sample", "300"];
        let whole = model("mean", &passes);
        let steps = at("steps.model.zarr");
        succeed(btf().arg("tile").args([&store, &steps]));
        let step = |step: &[&str]| {
            let rule = ["--clusters", "20", "--representatives", "mean", "--sample", "300"];
            succeed(btf().arg("cluster").args([&store, &steps]).args(rule).args(step))
        };
        step(&["--step", "prepare"]);
        for _ in 0..60 {
            step(&["--step", "assign", "--shard", "1/2"]);
            step(&["--step", "assign", "--shard", "0/2"]);
            if step(&["--step", "reduce"]).contains("clusters") {
                break;
            }
        }
        assert_same(&whole, &steps);
        std::fs::remove_dir_all(&steps).unwrap();
        succeed(btf().arg("verify").arg(&whole));
        assert!(succeed(btf().arg("info").arg(&whole)).contains("representatives"));
    }
    let told = fail(
        btf().arg("cluster").args([&at("u8.zarr"), &at("u8-mean.model.zarr")]).args([
            "--clusters-of",
            "x",
            "--representatives",
            "mean",
        ]),
        2,
    );
    assert!(told.contains("--representatives"), "{told}");
}
