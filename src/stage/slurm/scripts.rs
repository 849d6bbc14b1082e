//! The texts of the scripts.

use super::estimate::{Need, Needs};
use crate::stage::enlarge::By;

use super::shell::{long_list, short_list, variable};
use super::{Job, Material, Options, Parts, Script};

/// How often a task is run again after it was stopped.
const REQUEUES: u32 = 10;

/// Seconds that a task waits before it looks once more for what is not there yet.
const PATIENCE: u32 = 60;

/// Seconds before the end of its time that a task is told to stop. Slurm may tell it a minute earlier.
const NOTICE: u32 = 300;

/// Passes of a clustering that many jobs share; the job after them makes the rest, if there is any.
const PASSES: u32 = 12;

const STEPS: &str = include_str!("scripts/steps.sh");
const SUBMIT: &str = include_str!("scripts/submit-begin.sh");
const STATUS: &str = include_str!("scripts/status.sh");

/// All scripts of a folder, and the jobs among them in their order.
pub(super) fn write(
    options: &Options,
    materials: &[Material],
    parts: Parts,
    needs: &Needs,
) -> (Vec<Script>, Vec<Job>) {
    let jobs = jobs(options, materials, parts, needs);
    let mut scripts = vec![
        Script { name: "settings.sh", text: settings(options, materials, &jobs), is_run: false },
        Script { name: "steps.sh", text: STEPS.as_bytes().to_vec(), is_run: false },
        Script { name: "submit.sh", text: submit(options, &jobs).into_bytes(), is_run: true },
        Script { name: "status.sh", text: status(options).into_bytes(), is_run: true },
    ];
    let of_job =
        |job: &Job| Script { name: job.script, text: script(options, job).into_bytes(), is_run: true };
    scripts.extend(jobs.iter().map(of_job));
    (scripts, jobs)
}

fn jobs(options: &Options, materials: &[Material], parts: Parts, needs: &Needs) -> Vec<Job> {
    let mut jobs = Vec::new();
    // Where an array goes over materials, its tasks are no parts of one.
    let in_parts = options.in_parts();
    let mut add = |script, what, command: &str, tasks, parts: Option<&'static str>, need: Need| {
        let parts = parts.filter(|_| in_parts);
        let shard = parts.map(|parts| format!(" --shard \"$part/${parts}\"")).unwrap_or_default();
        let command = format!("{command}{shard}");
        jobs.push(Job { script, what, command, tasks, parts, need });
    };
    if materials.iter().any(|material| material.archive.is_some()) {
        add(
            "import.sh",
            "Imports an archive, or one part of its views.",
            "[ -n \"${archives[material]}\" ] || finish 0\n\
             run import \"${import_options[@]}\" \"${archives[material]}\" \"${measurements[material]}\"",
            parts.import,
            Some("import_parts"),
            needs.import,
        );
    }
    if options.cluster_parts > 1 {
        add(
            "tile.sh",
            "Begins the model of a material with its tile.",
            "run tile \"${tile_options[@]}\" \"${measurements[material]}\" \"${models[material]}\"",
            1,
            None,
            needs.tile,
        );
        add(
            "prepare.sh",
            "Finds the first centres of the clusters of a material.",
            "run cluster \"${cluster_options[@]}\" \"${measurements[material]}\" \"${models[material]}\" --step prepare",
            1,
            None,
            needs.model,
        );
        add(
            "assign.sh",
            "Assigns one part of the texels to their clusters, in one pass. Nothing is left to do if the clustering has\n\
             # ended before.",
            "run cluster \"${cluster_options[@]}\" \"${measurements[material]}\" \"${models[material]}\" \
             --step assign --pass \"$BTF_PASS\"",
            parts.cluster,
            Some("cluster_parts"),
            needs.assign,
        );
        add(
            "reduce.sh",
            "Puts the parts of a pass together. Ends with 66 if one of them is missing.",
            "run cluster \"${cluster_options[@]}\" \"${measurements[material]}\" \"${models[material]}\" \
             --step reduce --pass \"$BTF_PASS\"",
            1,
            None,
            needs.assign,
        );
    }
    add(
        "model.sh",
        "Makes all stages of a model that are not there yet: tile, clusters, normals, field, appearance.",
        "run model \"${tile_options[@]}\" \"${cluster_options[@]}\" \"${model_options[@]}\" \
         \"${measurements[material]}\" \"${models[material]}\"",
        1,
        None,
        needs.model,
    );
    if let Some(surface) = &options.surface {
        let command = "run enlarge \"${enlarge_options[@]}\" \"${models[material]}\" \"${planes[material]}\"";
        let shared = match surface.by {
            By::Paper(_) | By::Quilt(_) => None,
            By::Coherent(_) | By::Patches(_) => Some("enlarge_parts"),
        };
        let what = "Enlarges the model of a material, or makes one part of the enlargement.";
        add("enlarge.sh", what, command, parts.enlarge, shared, needs.enlarge);
    }
    if options.pyramids {
        add(
            "deepzoom.sh",
            "Makes a Deep Zoom pyramid of an enlargement, or one part of its tiles.",
            "run export \"${deepzoom_options[@]}\" \"${planes[material]}\" \"${pyramids[material]}\" --deepzoom",
            parts.pyramid,
            Some("deepzoom_parts"),
            needs.pyramid,
        );
    }
    jobs
}

fn settings(options: &Options, materials: &[Material], jobs: &[Job]) -> Vec<u8> {
    let mut text = Vec::new();
    let mut say = |comment: &str, lines: Vec<u8>| {
        for line in comment.lines() {
            text.extend_from_slice(format!("# {line}\n").as_bytes());
        }
        text.extend(lines);
        text.push(b'\n');
    };
    say(
        "What the jobs of this folder work on, and how. Edit it before ./submit.sh; memory and time of a job stand in its\n\
         own script. Options of a result that is there already cannot be changed: choose other names, or remove it.",
        Vec::new(),
    );
    say("The program; every node must see it here.", variable("btf", &options.program));
    let none = std::path::Path::new("");
    let archives = materials.iter().map(|material| material.archive.as_deref().unwrap_or(none));
    say(
        "One material a line: its archive ('' if it is imported already), and the stores to make of it.",
        [
            long_list("archives", archives),
            long_list("measurements", materials.iter().map(|material| &material.measurement)),
            long_list("models", materials.iter().map(|material| &material.model)),
            long_list("planes", materials.iter().filter_map(|material| material.plane.as_ref())),
            long_list("pyramids", materials.iter().filter_map(|material| material.pyramid.as_ref())),
        ]
        .concat(),
    );
    let nothing: [&str; 0] = [];
    say("Options of btf import, such as --samples f16.", short_list("import_options", nothing));
    let tile: Vec<String> =
        options.tile.iter().flat_map(|choice| ["--tile".to_owned(), choice.to_string()]).collect();
    let clusters: Vec<String> =
        options.clusters.iter().flat_map(|count| ["--clusters".to_owned(), count.to_string()]).collect();
    say(
        "Options of btf model: of its tile, of its clusters, of the rest.",
        [
            short_list("tile_options", tile),
            short_list("cluster_options", clusters),
            short_list("model_options", nothing),
        ]
        .concat(),
    );
    if let Some(surface) = &options.surface {
        let size = surface.size.to_string();
        let words = ["--size", &size, "--method", &surface.method];
        say("Options of btf enlarge.", short_list("enlarge_options", words));
    }
    if options.pyramids {
        let comment = "Options of btf export --deepzoom, such as --format jpeg or --light 60,90.";
        say(comment, short_list("deepzoom_options", nothing));
    }
    let parts: Vec<String> =
        jobs.iter().filter_map(|job| Some(format!("{}={}\n", job.parts?, job.tasks))).collect();
    if !parts.is_empty() {
        let comment = "Parts that the work on one material is divided into. Any number gives the same bytes.";
        say(comment, parts.concat().into_bytes());
    }
    if options.cluster_parts > 1 {
        say(
            "Passes of a clustering that are shared between jobs; the job `model` makes the rest, if there is any.",
            format!("passes={PASSES}\n").into_bytes(),
        );
    }
    say(
        "Options of sbatch for all jobs, such as --partition=long or --account=lab.",
        short_list("sbatch_options", &options.sbatch),
    );
    say(
        "The most tasks of a job that run at once; empty: as many as there is room for.",
        b"at_once=\n".to_vec(),
    );
    say("How often a task that was stopped is run again.", format!("requeues={REQUEUES}\n").into_bytes());
    say(
        "Seconds to wait before looking once more for what is not there yet.",
        format!("patience={PATIENCE}\n").into_bytes(),
    );
    text.pop();
    text
}

fn script(options: &Options, job: &Job) -> String {
    let Job { what, command, need, .. } = job;
    let name = job.name();
    let Need { memory_mib, slurm_mib, seconds, minutes } = need;
    let cpus = options.cpus;
    format!(
        "#!/bin/bash\n\
         # {what} Submitted by submit.sh from this folder.\n\
         #SBATCH --job-name=btf-{name}\n\
         #SBATCH --output=logs/%x.%A_%a.log\n\
         #SBATCH --open-mode=append\n\
         # After a node was lost or is needed for other jobs, Slurm runs the task again, and it goes on.\n\
         #SBATCH --requeue\n\
         # Time that is nearly over is told {NOTICE} seconds before, give or take a minute.\n\
         #SBATCH --signal=B:TERM@{NOTICE}\n\
         #SBATCH --cpus-per-task={cpus}\n\
         # The program uses {memory_mib} MiB; Slurm may also count what it maps and what waits to be written.\n\
         #SBATCH --mem={slurm_mib}M\n\
         # Minutes. The work is estimated at {seconds} s; a task that needs longer is stopped, and goes on.\n\
         #SBATCH --time={minutes}\n\
         \n\
         memory={memory_mib}MiB\n\
         . ./settings.sh && . ./steps.sh || exit 66\n\
         \n\
         {command}\n\
         finish $?\n"
    )
}

fn submit(options: &Options, jobs: &[Job]) -> String {
    let mut text = SUBMIT.to_owned();
    let in_parts = options.in_parts();
    let tasks = |job: &Job| match (in_parts, job.parts) {
        (false, _) => "\"${#measurements[@]}\"".to_owned(),
        (true, Some(name)) => format!("\"${name}\""),
        (true, None) => "1".to_owned(),
    };
    let indent = if in_parts { "    " } else { "" };
    if in_parts {
        text.push_str(
            "waits=afterok\n\
             for ((material = 0; material < ${#measurements[@]}; material++)); do\n    \
                 echo \"material $material: ${measurements[material]}\"\n    \
                 export BTF_MATERIAL=$material\n    \
                 last=''\n",
        );
    } else {
        text.push_str("# One array over all materials; a material that fails does not stop the others.\nwaits=aftercorr\nlast=''\n");
    }
    for job in jobs {
        let line = format!("job {} {}\n", job.script, tasks(job));
        match job.script {
            "import.sh" if in_parts => {
                text.push_str(&format!("{indent}[ -z \"${{archives[material]}}\" ] || {line}"));
            }
            "assign.sh" => text.push_str(&format!(
                "{indent}for ((pass = 0; pass < passes; pass++)); do\n\
                 {indent}    export BTF_PASS=$pass\n\
                 {indent}    {line}"
            )),
            "reduce.sh" => text.push_str(&format!("{indent}    {line}{indent}done\n")),
            _ => text.push_str(&format!("{indent}{line}")),
        }
    }
    if in_parts {
        text.push_str("done\n");
    }
    text.push_str("echo \"how far they are: squeue --me, and status.sh; to cancel them: $cancel\"\n");
    text
}

fn status(options: &Options) -> String {
    let planes = if options.surface.is_some() { " \"${planes[@]}\"" } else { "" };
    let pyramids = if options.pyramids { " \"${pyramids[@]}\"" } else { "" };
    format!("{STATUS}exec \"$btf\" status \"${{measurements[@]}}\" \"${{models[@]}}\"{planes}{pyramids}\n")
}
