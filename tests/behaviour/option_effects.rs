//! What each option of each command does to the recipe of its result. A test of the program demands an entry for every
//! option there is, so none is forgotten; another runs the entries and compares the recipes.

/// What an option does to the recipe.
pub(crate) enum Effect {
    /// Another result: with these arguments, beside those of the command, the recipe is another.
    Changes(&'static [&'static str]),
    /// The same result: with these arguments the recipe is the same.
    Keeps(&'static [&'static str]),
    /// What is to be read, what is to be made, or only what is told; not part of the recipe itself, for this reason.
    Apart(&'static str),
}

/// A command whose result has a recipe.
pub(crate) struct Recipes {
    /// Its name.
    pub(crate) command: &'static str,
    /// Each of its options and arguments, by its name in the program.
    pub(crate) options: &'static [(&'static str, Effect)],
}

/// Options of every command.
pub(crate) const COMMON: &[(&str, &str)] = &[
    ("threads", "bytes are the same whatever the threads"),
    ("memory", "bytes are the same whatever the memory"),
    ("progress", "told, not stored"),
    ("quiet", "told, not stored"),
    ("force", "whether another result is replaced"),
];

/// Commands without options that a result depends on, but for what is made.
pub(crate) const WITHOUT: &[&str] = &["demo", "completions", "man", "help"];

/// What an option does to what a command without a recipe prints or writes.
pub(crate) enum Shown {
    /// Another output, beside the second arguments with the first ones than without.
    Shows(&'static [&'static str], &'static [&'static str]),
    /// Not to be seen here, for this reason.
    Unseen(&'static str),
}

/// A command whose result has no recipe: it is printed, or compared byte by byte with what is there.
pub(crate) struct Outputs {
    /// Its name.
    pub(crate) command: &'static str,
    /// The arguments that it cannot be without; `{archive}`, `{measurement}`, `{model}`, `{enlarged}` and `{new}`, a
    /// folder, stand for places.
    pub(crate) base: &'static [&'static str],
    /// Whether it reads archives, so that it has the options of [`READING`], too.
    pub(crate) reads: bool,
    /// Each of its other options and arguments, by its name in the program; and those of them that are tried here.
    pub(crate) options: &'static [(&'static str, Shown)],
}

use Shown::{Shows, Unseen};

const ITSELF: Shown = Unseen("what the command is about");
const OF_LARGER: Shown = Unseen("of materials larger than the fixture; judging.rs tries it");
const OF_COMPONENTS: Shown =
    Unseen("of a model with components, which the fixture has not; components.rs tries it");
const OF_A_FILE: Shown = Unseen("of a file that a test makes; rendering.rs tries it");

/// The options of every command that reads archives. What they do to the result is seen in the recipes of import; for
/// stores they are refused.
pub(crate) const READING: &[&str] = &[
    "transfer",
    "samples",
    "polar",
    "azimuth",
    "turn",
    "transpose",
    "swap",
    "cosine",
    "pattern",
    "table",
    "order",
    "rows",
    "hdr",
    "drop_view",
    "drop_light",
];

/// All commands whose results have none.
pub(crate) const OUTPUTS: &[Outputs] = &[
    Outputs {
        command: "sample",
        base: &["{new}/s.zip", "--size", "8x8", "--views", "2", "--lights", "2"],
        reads: false,
        options: &[
            ("archive", ITSELF),
            ("material", Shows(&["--material", "wood"], &[])),
            ("size", Shows(&["--size", "8x9"], &[])),
            ("views", Shows(&["--views", "3"], &[])),
            ("lights", Shows(&["--lights", "3"], &[])),
            ("seed", Shows(&["--seed", "2"], &[])),
            ("scale", Shows(&["--scale", "2"], &[])),
        ],
    },
    Outputs {
        command: "info",
        base: &["{archive}"],
        reads: true,
        options: &[
            ("paths", ITSELF),
            ("pieces", Unseen("of archives in pieces")),
            ("transfer", Shows(&["--transfer", "linear"], &[])),
            ("samples", Shows(&["--samples", "f16"], &[])),
            ("swap", Shows(&["--swap"], &[])),
            ("drop_view", Shows(&["--drop-view", "1"], &[])),
            ("directions", Shows(&["--directions"], &[])),
            ("json", Shows(&["--json"], &[])),
        ],
    },
    Outputs {
        command: "check",
        base: &["{archive}"],
        reads: true,
        options: &[
            ("paths", ITSELF),
            ("pieces", Unseen("of archives in pieces")),
            ("picture", Shows(&["--picture", "{new}/p.png"], &[])),
            ("json", Shows(&["--json"], &[])),
        ],
    },
    Outputs {
        command: "view",
        base: &["{model}", "--export", "{new}/p.html"],
        reads: false,
        options: &[
            ("source", ITSELF),
            ("export", ITSELF),
            ("model", Unseen("another model is refused, the right one is found without")),
            ("window", Unseen("of enlargements; viewer.rs tries it")),
            ("port", Unseen("of the server; viewer.rs tries it")),
            ("open", Unseen("starts a browser")),
        ],
    },
    Outputs {
        command: "status",
        base: &["{measurement}"],
        reads: false,
        options: &[("stores", ITSELF), ("json", Shows(&["--json"], &[]))],
    },
    Outputs {
        command: "missing",
        base: &["{measurement}", "--shards", "4"],
        reads: false,
        options: &[
            ("store", ITSELF),
            ("shards", Unseen("nothing is missing; shares::what_is_missing_is_told tries it")),
            ("format", Unseen("nothing is missing; shares::what_is_missing_is_told tries it")),
        ],
    },
    Outputs {
        command: "slurm",
        base: &["{archive}", "--out", "{new}/jobs", "--into", "/stores", "--size", "64x64"],
        reads: false,
        options: &[
            ("inputs", ITSELF),
            ("out", Unseen("the place of the scripts")),
            ("into", Shows(&["--into", "/others"], &[])),
            ("parts", Shows(&["--parts", "3"], &[])),
            ("cluster_parts", Shows(&["--cluster-parts", "3"], &[])),
            ("cpus", Shows(&["--cpus", "3"], &[])),
            ("time", Shows(&["--time", "99"], &[])),
            ("tile", Shows(&["--tile", "none"], &[])),
            ("clusters", Shows(&["--clusters", "3"], &[])),
            ("size", Shows(&["--size", "96x64"], &[])),
            ("method", Shows(&["--method", "tiles"], &[])),
            ("deepzoom", Shows(&["--deepzoom"], &[])),
            ("partition", Shows(&["--partition", "long"], &[])),
            ("account", Shows(&["--account", "lab"], &[])),
            ("sbatch", Shows(&["--sbatch=--qos=low"], &[])),
            ("submit", Unseen("of a cluster; slurm.rs has one of stubs")),
        ],
    },
    Outputs {
        command: "verify",
        base: &["{measurement}"],
        reads: true,
        options: &[
            ("shard", Shows(&["--shard", "0/2"], &[])),
            ("stores", ITSELF),
            ("model", Unseen("another model is refused, the right one is found without")),
            ("archive", Shows(&["--source", "{archive}"], &[])),
            ("json", Shows(&["--json"], &[])),
        ],
    },
    Outputs {
        command: "curve",
        base: &["{measurement}", "{model}", "--most", "4"],
        reads: false,
        options: &[
            ("measurement", ITSELF),
            ("model", ITSELF),
            ("picture", Shows(&["--picture", "{new}/c.png"], &[])),
            ("json", Shows(&["--json"], &[])),
            ("most", Shows(&["--most", "2"], &[])),
            ("seed", Shows(&["--json", "--seed", "9"], &["--json"])),
        ],
    },
    Outputs {
        command: "compare",
        base: &["{model}", "{measurement}"],
        reads: false,
        options: &[
            ("model", ITSELF),
            ("measurement", ITSELF),
            ("picture", Shows(&["--picture", "{new}/p.png"], &[])),
            (
                "light",
                Shows(&["--light", "30,90", "--picture", "{new}/p.png"], &["--picture", "{new}/p.png"]),
            ),
            ("view", Shows(&["--view", "15,0", "--picture", "{new}/p.png"], &["--picture", "{new}/p.png"])),
            ("by", Unseen("the fixture's model has clusters alone; components.rs tries it")),
            ("tile_of", Unseen("of a packed model; packed_sources.rs tries it")),
            ("baselines", Unseen("of a model with components; packed_sources.rs tries it")),
            ("curves", Unseen("of a model with components; packed_sources.rs tries it")),
            ("partial", Shows(&["--partial", "{new}/sums"], &[])),
            ("shard", Shows(&["--partial", "{new}/sums", "--shard", "0/2"], &["--partial", "{new}/sums"])),
            ("reduce", Unseen("another way to the same figures; shares.rs tries it")),
            ("json", Shows(&["--json"], &[])),
        ],
    },
    Outputs {
        command: "pack",
        base: &["{model}", "{new}/m.btfc"],
        reads: false,
        options: &[
            ("model", ITSELF),
            ("output", ITSELF),
            ("quality", OF_COMPONENTS),
            ("licence", OF_COMPONENTS),
            ("texel_mm", OF_COMPONENTS),
            ("json", OF_COMPONENTS),
        ],
    },
    Outputs {
        command: "unpack",
        base: &["{new}/m.btfc", "{new}/m.model.zarr"],
        reads: false,
        options: &[("file", ITSELF), ("model", ITSELF)],
    },
    Outputs {
        command: "image",
        base: &["{model}", "--out", "{new}/i.png"],
        reads: false,
        options: &[
            ("source", ITSELF),
            ("out", Unseen("the name of the result, and its format")),
            ("bits", Shows(&["--bits", "16"], &[])),
            ("quality", Shows(&["--out", "{new}/i.jpg", "--quality", "50"], &["--out", "{new}/i.jpg"])),
            ("what", Shows(&["--what", "index"], &[])),
            ("light", Shows(&["--light", "30,90"], &[])),
            ("view", Shows(&["--view", "15,0"], &[])),
            ("window", Shows(&["--window", "0,0,16,16"], &[])),
            ("exposure", Shows(&["--exposure", "2"], &[])),
            ("values", Shows(&["--values", "measured"], &[])),
            ("measurement", Shows(&["--measurement", "{measurement}"], &[])),
            ("model", Unseen("another model is refused, the right one is found without")),
            ("plane", Shows(&["--plane", "--window", "0,0,16,16"], &["--window", "0,0,16,16"])),
            (
                "seed",
                Shows(
                    &["--plane", "--window", "0,0,16,16", "--seed", "2"],
                    &["--plane", "--window", "0,0,16,16"],
                ),
            ),
            (
                "jitter",
                Shows(
                    &["--plane", "--window", "0,0,64,64", "--jitter", "0"],
                    &["--plane", "--window", "0,0,64,64"],
                ),
            ),
        ],
    },
    Outputs {
        command: "render",
        base: &["{model}", "--out", "{new}/r.png", "--size", "24x20"],
        reads: false,
        options: &[
            ("source", ITSELF),
            ("out", Unseen("the name of the result, and its format")),
            ("size", Shows(&["--size", "25x20"], &[])),
            ("shape", Shows(&["--shape", "cylinder"], &[])),
            ("mesh", OF_A_FILE),
            ("scale", Shows(&["--scale", "2"], &[])),
            ("light", Shows(&["--light", "30,90"], &[])),
            ("point_light", Shows(&["--point-light", "1,2,3"], &[])),
            ("environment", OF_A_FILE),
            ("environment_turn", OF_A_FILE),
            ("environment_lights", OF_A_FILE),
            ("show_environment", OF_A_FILE),
            ("background", Shows(&["--background", "0.5"], &[])),
            ("no_shadows", Shows(&["--shape", "interior", "--no-shadows"], &["--shape", "interior"])),
            ("eye", Shows(&["--eye", "1,2,4"], &[])),
            ("target", Shows(&["--target", "0.5,0,0"], &[])),
            ("up", Shows(&["--up", "1,1,0"], &[])),
            ("fov", Shows(&["--fov", "40"], &[])),
            ("orthographic", Shows(&["--orthographic"], &[])),
            ("samples", Shows(&["--samples", "1"], &[])),
            ("exposure", Shows(&["--exposure", "2"], &[])),
            ("quality", Shows(&["--out", "{new}/r.jpg", "--quality", "50"], &["--out", "{new}/r.jpg"])),
            ("frames", Shows(&["--frames", "2", "--turntable"], &[])),
            ("turntable", Shows(&["--frames", "2", "--turntable"], &["--frames", "2", "--light-sweep"])),
            ("light_sweep", Shows(&["--frames", "2", "--light-sweep"], &["--frames", "2", "--turntable"])),
            (
                "shard",
                Shows(&["--frames", "2", "--turntable", "--shard", "0/2"], &["--frames", "2", "--turntable"]),
            ),
            ("plane", Shows(&["--plane"], &[])),
            ("seed", Shows(&["--plane", "--seed", "2"], &["--plane"])),
            ("jitter", Shows(&["--plane", "--jitter", "0"], &["--plane"])),
            ("model", Unseen("another model is refused, the right one is found without")),
            ("values", Unseen("the fixture's model has clusters alone; packed_sources.rs tries it")),
            ("compare", Shows(&["--compare"], &[])),
        ],
    },
    Outputs {
        command: "judge",
        base: &["{enlarged}", "--against", "{measurement}", "--crop", "16", "--pair", "0,1"],
        reads: false,
        options: &[
            ("subject", ITSELF),
            ("against", ITSELF),
            ("model", Unseen("another model is refused, the right one is found without")),
            ("size", Unseen("of the plane of a model, which has no other size; refused for enlargements")),
            ("pair", OF_LARGER),
            ("crop", OF_LARGER),
            ("json", OF_LARGER),
            ("picture", OF_LARGER),
            ("partial", OF_LARGER),
            ("shard", OF_LARGER),
            ("reduce", OF_LARGER),
        ],
    },
];

/// Command lines with an option that would change nothing, and that option: they are refused, and nothing is written.
pub(crate) const IDLE: &[(&[&str], &str)] = &[
    (&["image", "{model}", "--out", "{new}/x.png", "--what", "index", "--light", "1,0"], "--light"),
    (&["image", "{model}", "--out", "{new}/x.png", "--what", "normals", "--view", "1,0"], "--view"),
    (&["image", "{model}", "--out", "{new}/x.png", "--what", "index", "--exposure", "2"], "--exposure"),
    (&["image", "{model}", "--out", "{new}/x.png", "--what", "index", "--values", "measured"], "--values"),
    (
        &["image", "{model}", "--out", "{new}/x.png", "--values", "model", "--measurement", "{measurement}"],
        "--measurement",
    ),
    (&["image", "{measurement}", "--out", "{new}/x.png", "--values", "model"], "--values"),
    (&["image", "{measurement}", "--out", "{new}/x.png", "--measurement", "{measurement}"], "--measurement"),
    (&["image", "{measurement}", "--out", "{new}/x.png", "--model", "{model}"], "--model"),
    (&["image", "{model}", "--out", "{new}/x.png", "--model", "{model}"], "--model"),
    (&["image", "{model}", "--out", "{new}/x.png", "--quality", "50"], "--quality"),
    (&["image", "{model}", "--out", "{new}/x.exr", "--bits", "8"], "--bits"),
    (&["image", "{model}", "--out", "{new}/x.png", "--seed", "2"], "--plane"),
    (&["image", "{model}", "--out", "{new}/x.png", "--jitter", "1"], "--plane"),
    (&["image", "{measurement}", "--out", "{new}/x.png", "--plane", "--window", "0,0,9,9"], "plane"),
    (&["render", "{model}", "--out", "{new}/r.png", "--quality", "50"], "--quality"),
    (&["render", "{model}", "--out", "{new}/r.png", "--shape", "flat", "--eye", "1,2,3"], "--eye"),
    (&["render", "{model}", "--out", "{new}/r.png", "--shape", "flat", "--background", "0"], "--background"),
    (&["render", "{model}", "--out", "{new}/r.png", "--no-shadows"], "--no-shadows"),
    (&["compare", "{model}", "{measurement}", "--light", "30,0"], "--picture"),
    (&["compare", "{model}", "{measurement}", "--view", "30,0"], "--picture"),
    (&["judge", "{enlarged}", "--against", "{measurement}", "--size", "64x64"], "--size"),
    (&["judge", "{model}", "--against", "{measurement}", "--size", "64x64", "--model", "{model}"], "--model"),
    (&["compare", "{model}", "{measurement}", "--shard", "0/2"], "--partial"),
    (&["compare", "{model}", "{measurement}", "--reduce"], "--partial"),
    (&["judge", "{enlarged}", "--against", "{measurement}", "--shard", "0/2"], "--partial"),
    (&["judge", "{enlarged}", "--against", "{measurement}", "--reduce"], "--partial"),
    (&["slurm", "{archive}", "--out", "{new}/jobs", "--deepzoom"], "--size"),
    (&["slurm", "{archive}", "--out", "{new}/jobs", "--method", "tiles"], "--size"),
    (&["export", "{measurement}", "{new}/e.npy", "--shard", "0/2"], "--shard"),
    (&["verify", "{model}", "--shard", "0/2"], "--shard"),
    (&["verify", "{measurement}", "--transpose"], "--transpose"),
    (&["verify", "{measurement}", "--model", "{model}"], "--model"),
    (&["verify", "{model}", "--model", "{model}"], "--model"),
    (&["verify", "{model}", "--source", "{archive}"], "archive"),
    (&["info", "{measurement}", "--swap"], "--swap"),
    (&["info", "{enlarged}", "--directions"], "--directions"),
    (&["info", "{archive}", "{archive}", "--directions"], "--directions"),
    (&["info", "{archive}", "--hdr", "atrium"], "--hdr"),
    (&["check", "{archive}", "--rows", "reversed"], "--rows"),
    (&["import", "{archive}", "{new}/x.zarr", "--order", "ubo81"], "--order"),
    (&["info", "--pieces", "{measurement}", "{measurement}"], "--pieces"),
    (&["check", "{measurement}", "--azimuth", "mirrored"], "--azimuth"),
    (&["check", "--pieces", "{measurement}", "{archive}"], "--pieces"),
    (&["cluster", "{measurement}", "{model}", "--step", "prepare", "--pass", "0"], "--pass"),
    (&["cluster", "{measurement}", "{model}", "--step", "prepare", "--shard", "0/2"], "--shard"),
    (&["cluster", "{measurement}", "{model}", "--step", "reduce", "--shard", "0/2"], "--shard"),
    (&["cluster", "{measurement}", "{model}", "--shard", "0/2"], "--step"),
    (&["cluster", "{measurement}", "{model}", "--pass", "0"], "--step"),
    (&["cluster", "{measurement}", "{model}", "--clusters-of", "{model}", "--seed", "2"], "--seed"),
    (&["cluster", "{measurement}", "{model}", "--clusters-of", "{model}", "--passes", "2"], "--passes"),
    (
        &["enlarge", "{model}", "{new}/e.zarr", "--size", "64x64", "--method", "paper", "--jitter", "0"],
        "--jitter",
    ),
    (
        &["enlarge", "{model}", "{new}/e.zarr", "--size", "64x64", "--method", "paper", "--no-source"],
        "--no-source",
    ),
    (
        &["enlarge", "{model}", "{new}/e.zarr", "--size", "64x64", "--method", "repeat", "--seed", "2"],
        "--seed",
    ),
    (&["enlarge", "{model}", "{new}/e.zarr", "--size", "64x64", "--tiles", "3"], "--tiles"),
    (&["enlarge", "{model}", "{new}/e.zarr", "--size", "64x64", "--candidates", "3"], "--candidates"),
    (&["enlarge", "{model}", "{new}/e.zarr", "--size", "64x64", "--band", "3"], "--band"),
    (
        &["enlarge", "{model}", "{new}/e.zarr", "--size", "64x64", "--method", "paper", "--shard", "0/2"],
        "--shard",
    ),
    (
        &["enlarge", "{model}", "{new}/e.zarr", "--size", "64x64", "--method", "quilt", "--shard", "0/2"],
        "--shard",
    ),
    (&["export", "{measurement}", "{new}/e.npy", "--rank", "2"], "--rank"),
    (&["export", "{measurement}", "{new}/e.npy", "--quality", "50"], "--quality"),
    (&["export", "{measurement}", "{new}/e.zip", "--light", "1,0"], "--light"),
    (&["export", "{model}", "{new}/e.dzi", "--quality", "50"], "--quality"),
    (&["export", "{model}", "{new}/e.dzi", "--rank", "2"], "--rank"),
    (
        &["export", "{model}", "{new}/e.dzi", "--values", "model", "--measurement", "{measurement}"],
        "--measurement",
    ),
    (&["export", "{measurement}", "{new}/e.dzi", "--values", "measured"], "--values"),
    (&["export", "{model}", "{new}/e.dzi", "--model", "{model}"], "--model"),
];

const PLACE: Effect = Effect::Apart("a place, not what lies there");
const TOLD: Effect = Effect::Apart("told, not stored");

use Effect::{Apart, Changes, Keeps};

/// All commands whose results have recipes.
pub(crate) const RECIPES: &[Recipes] = &[
    Recipes {
        command: "import",
        options: &[
            ("paths", PLACE),
            ("into", PLACE),
            ("transfer", Changes(&["--transfer", "linear"])),
            ("samples", Changes(&["--samples", "u16"])),
            ("polar", Changes(&["--polar", "elevation-lights"])),
            ("azimuth", Changes(&["--azimuth", "mirrored-lights"])),
            ("turn", Changes(&["--turn", "90"])),
            ("transpose", Changes(&["--transpose"])),
            ("swap", Changes(&["--swap"])),
            ("cosine", Changes(&["--cosine", "excluded"])),
            (
                "pattern",
                Apart("the directions and the digest of the images in their order are in the recipe"),
            ),
            ("table", Apart("the directions and the digest of the images in their order are in the recipe")),
            ("order", Apart("refused for pictures; recipes::options_of_some_formats_are_in_the_recipe")),
            ("rows", Apart("refused for pictures; recipes::options_of_some_formats_are_in_the_recipe")),
            ("hdr", Apart("refused for other pictures; recipes::options_of_some_formats_are_in_the_recipe")),
            ("drop_view", Changes(&["--drop-view", "1"])),
            ("drop_light", Changes(&["--drop-light", "1"])),
            ("white", Changes(&["--white", "0.5"])),
            ("codec", Changes(&["--codec", "predictive"])),
            ("shard", Keeps(&["--shard", "0/2"])),
            ("dry_run", TOLD),
        ],
    },
    Recipes {
        command: "tile",
        options: &[
            ("measurement", PLACE),
            ("model", PLACE),
            ("tile", Changes(&["--tile", "none"])),
            ("lattice", Changes(&["--lattice", "none"])),
            ("seed", Changes(&["--seed", "2"])),
            ("dry_run", TOLD),
        ],
    },
    Recipes {
        command: "cluster",
        options: &[
            ("measurement", PLACE),
            ("model", PLACE),
            ("clusters", Changes(&["--clusters", "5"])),
            ("error", Changes(&["--error", "2"])),
            ("ratio", Changes(&["--ratio", "4"])),
            ("centre", Changes(&["--centre", "mean"])),
            ("representatives", Changes(&["--representatives", "mean"])),
            ("passes", Changes(&["--passes", "3"])),
            ("tolerance", Changes(&["--tolerance", "0.5"])),
            ("sample", Changes(&["--sample", "100"])),
            ("first", Changes(&["--first", "minibatch"])),
            ("restarts", Changes(&["--restarts", "2"])),
            ("seed", Changes(&["--seed", "2"])),
            ("time", Apart("ends early by the clock; said to depend on the machine")),
            ("clusters_of", Apart("its digest takes the place of the recipe's settings")),
            ("step", Apart("steps of one clustering have one recipe")),
            ("pass", Apart("of a step")),
            ("shard", Apart("of a step")),
            ("dry_run", TOLD),
        ],
    },
    Recipes {
        command: "normals",
        options: &[
            ("measurement", PLACE),
            ("model", PLACE),
            ("robust", Changes(&["--robust"])),
            ("dry_run", TOLD),
        ],
    },
    Recipes {
        command: "components",
        options: &[
            ("measurement", PLACE),
            ("model", PLACE),
            ("components", Changes(&["--components", "5"])),
            ("dry_run", TOLD),
        ],
    },
    Recipes {
        command: "fit",
        options: &[
            ("model", PLACE),
            ("mrf", Changes(&["--mrf", "2d"])),
            ("levels", Changes(&["--levels", "2"])),
            ("field", Changes(&["--field", "slopes"])),
            ("gains", Changes(&["--gains", "none"])),
            ("marginals", Changes(&["--marginals", "none"])),
            ("report", TOLD),
            ("dry_run", TOLD),
        ],
    },
    Recipes {
        command: "appearance",
        options: &[("model", PLACE), ("lattice", Changes(&["--lattice", "none"])), ("dry_run", TOLD)],
    },
    // All stages in one go, by the same options as theirs.
    Recipes {
        command: "model",
        options: &[
            ("paths", PLACE),
            ("into", PLACE),
            ("tile", Changes(&["--tile", "none"])),
            ("lattice", Changes(&["--lattice", "none"])),
            ("seed", Changes(&["--seed", "2"])),
            ("clusters", Apart("of cluster")),
            ("error", Apart("of cluster")),
            ("ratio", Apart("of cluster")),
            ("centre", Apart("of cluster")),
            ("representatives", Apart("of cluster")),
            ("passes", Apart("of cluster")),
            ("tolerance", Apart("of cluster")),
            ("sample", Apart("of cluster")),
            ("first", Apart("of cluster")),
            ("restarts", Apart("of cluster")),
            ("time", Apart("of cluster")),
            ("clusters_of", Apart("of cluster")),
            ("robust", Apart("of normals")),
            ("mrf", Apart("of fit")),
            ("levels", Apart("of fit")),
            ("field", Apart("of fit")),
            ("gains", Apart("of fit")),
            ("marginals", Apart("of fit")),
            ("dry_run", TOLD),
        ],
    },
    Recipes {
        command: "enlarge",
        options: &[
            ("paths", PLACE),
            ("into", PLACE),
            ("size", Changes(&["--size", "96x64"])),
            ("method", Changes(&["--method", "paper"])),
            ("seed", Changes(&["--seed", "2"])),
            ("tileable", Changes(&["--tileable"])),
            ("shard", Keeps(&["--shard", "0/2"])),
            ("jitter", Changes(&["--jitter", "0.25"])),
            ("no_source", Changes(&["--no-source"])),
            ("keep_normals", Changes(&["--keep-normals"])),
            ("tiles", Changes(&["--method", "tiles", "--tiles", "3"])),
            ("candidates", Changes(&["--method", "paper", "--candidates", "3"])),
            ("band", Apart("rows in work at a time, of --method paper")),
            ("dry_run", TOLD),
        ],
    },
    Recipes {
        command: "export",
        options: &[
            ("store", PLACE),
            ("output", PLACE),
            ("to", Apart("an export is compared byte by byte")),
            ("rank", Apart("an export is compared byte by byte")),
            ("quality", Changes(&["--format", "jpeg", "--quality", "50"])),
            ("deepzoom", Apart("the command itself")),
            ("light", Changes(&["--light", "30,90"])),
            ("view", Changes(&["--view", "15,0"])),
            ("window", Changes(&["--window", "0,0,16,16"])),
            ("exposure", Changes(&["--exposure", "2"])),
            ("values", Changes(&["--values", "measured"])),
            ("measurement", PLACE),
            ("model", PLACE),
            ("plane", Changes(&["--plane", "--window", "0,0,16,16"])),
            ("seed", Changes(&["--plane", "--window", "0,0,16,16", "--seed", "2"])),
            ("jitter", Changes(&["--plane", "--window", "0,0,16,16", "--jitter", "0.25"])),
            ("format", Changes(&["--format", "jpeg"])),
            ("tile_size", Changes(&["--tile-size", "128"])),
            ("overlap", Changes(&["--overlap", "2"])),
            ("shard", Keeps(&["--shard", "0/2"])),
            ("dry_run", TOLD),
            ("json", TOLD),
        ],
    },
];
