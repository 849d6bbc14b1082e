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

/// Commands whose results have no recipe: what lies there is compared byte by byte, or nothing is stored.
pub(crate) const WITHOUT: &[&str] = &[
    "demo",
    "sample",
    "info",
    "check",
    "verify",
    "curve",
    "compare",
    "image",
    "judge",
    "completions",
    "man",
    "help",
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
            ("hdr", Changes(&["--hdr", "atrium"])),
            ("drop_view", Changes(&["--drop-view", "1"])),
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
            ("dry_run", TOLD),
            ("json", TOLD),
        ],
    },
];
