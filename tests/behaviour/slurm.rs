//! Job scripts for Slurm, run by a Slurm of stubs: sbatch runs every task of an array at once, one after the other.
//! `scripts/slurm` runs them on a real one.

use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::fixture::{assert_same, btf, fail, fixture, succeed};

/// A folder of stubs, and of what they were asked for.
struct Stubs {
    folder: tempfile::TempDir,
}

impl Stubs {
    fn new() -> Self {
        let stubs = Self { folder: tempfile::tempdir().unwrap() };
        // Tasks run in the folder that they are submitted from; a failed one fails the submission, to be seen here.
        stubs.program(
            "sbatch",
            r#"echo "$*" >>"$LOG"
for word in "$@"; do
    case $word in --array=*) array=${word#--array=} ;; esac
    script=$word
done
export SLURM_ARRAY_JOB_ID=$(wc -l <"$LOG")
for ((task = ${array%-*}; task <= ${array#*-}; task++)); do
    SLURM_ARRAY_TASK_ID=$task SLURM_CPUS_PER_TASK=2 bash "$script" >>"$LOG.out" 2>&1 || echo "task $task: $?" >>"$LOG.codes"
done
echo "$SLURM_ARRAY_JOB_ID""#,
        );
        stubs.program("squeue", "echo ${STATE-RUNNING}");
        stubs.program("scontrol", r#"echo "$*" >>"$LOG.scontrol""#);
        stubs
    }

    fn program(&self, name: &str, text: &str) -> PathBuf {
        let path = self.folder.path().join(name);
        std::fs::write(&path, format!("#!/bin/bash\n{text}\n")).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
        path
    }

    /// A command that finds the stubs before anything else.
    fn with(&self, mut command: Command) -> Command {
        let path = std::env::var("PATH").unwrap_or_default();
        command.env("PATH", format!("{}:{path}", self.folder.path().display()));
        command.env("LOG", self.folder.path().join("log"));
        command
    }

    fn read(&self, ending: &str) -> String {
        std::fs::read_to_string(self.folder.path().join(format!("log{ending}"))).unwrap_or_default()
    }
}

/// Sets a variable of settings.sh, or of a script, to something else.
fn set(script: &Path, name: &str, value: &str) {
    let text = std::fs::read_to_string(script).unwrap();
    assert!(text.lines().any(|line| line.starts_with(&format!("{name}="))), "{name}: {text}");
    let lines = text.lines().map(|line| match line.starts_with(&format!("{name}=")) {
        true => format!("{name}={value}"),
        false => line.to_owned(),
    });
    let text: String = lines.map(|line| line + "\n").collect();
    std::fs::write(script, text).unwrap();
}

fn slurm(inputs: &[&Path], out: &Path, more: &[&str]) -> Command {
    let mut command = btf();
    command.arg("slurm").args(inputs).arg("--out").arg(out).args(more);
    command
}

/// Jobs for the archive of the fixture, run by a program of this text instead of btf.
fn jobs_of(stubs: &Stubs, jobs: &Path, program: &str) {
    succeed(&mut slurm(&[&fixture().archive()], jobs, &[]));
    let program = stubs.program("program", program);
    set(&jobs.join("settings.sh"), "btf", program.to_str().unwrap());
}

#[test]
fn jobs_for_a_material_with_an_awkward_name_make_what_one_process_makes() {
    let stubs = Stubs::new();
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().join("it's \"a\" $(touch x)\n`*` place ");
    std::fs::create_dir(&place).unwrap();
    let archive = place.join("-wood ;& 'é.zip");
    std::fs::copy(fixture().archive(), &archive).unwrap();
    let jobs = place.join("jobs\n");
    let more = ["--tile", "cut", "--clusters", "24", "--size", "700x530", "--deepzoom", "--parts", "3"];
    let more =
        [&more[..], &["--cluster-parts", "2", "--sbatch", "--comment=it's a\ntest", "--account", "lab"]]
            .concat();
    let mut write = slurm(&[&archive], &jobs, &more);
    write.arg("--into").arg(place.join("stores"));
    succeed(&mut write);
    assert!(succeed(&mut write).contains("found done"));
    set(&jobs.join("settings.sh"), "passes", "2");
    set(&jobs.join("settings.sh"), "patience", "0");
    succeed(&mut stubs.with(Command::new(jobs.join("submit.sh"))));
    assert_eq!(stubs.read(".codes"), "", "{}", stubs.read(".out"));
    let store = |ending: &str| place.join("stores").join(format!("-wood ;& 'é{ending}"));
    assert_same(&store(".zarr"), &fixture().measurement());
    assert_same(&store(".model.zarr"), &fixture().model());
    let whole = folder.path().join("whole.zarr");
    succeed(btf().arg("enlarge").args([store(".model.zarr"), whole.clone()]).args(["--size", "700x530"]));
    assert_same(&store(".enlarged.zarr"), &whole);
    assert!(store(".dzi").is_file() && store(".html").is_file());
    succeed(&mut Command::new(jobs.join("status.sh")));
    // Nothing was made that a name asked a shell for.
    assert!(!jobs.join("x").exists() && !Path::new("x").exists());
    let asked = stubs.read("");
    let told: Vec<&str> = asked.lines().filter(|line| line.contains("--array")).collect();
    // Of the second line of each, since the comment has two.
    let scripts: Vec<&str> = told.iter().filter_map(|line| line.split(' ').next_back()).collect();
    let passes = ["assign.sh", "reduce.sh", "assign.sh", "reduce.sh"];
    let all =
        [&["import.sh", "tile.sh", "prepare.sh"][..], &passes, &["model.sh", "enlarge.sh", "deepzoom.sh"]]
            .concat();
    assert_eq!(scripts, all, "{asked}");
    assert_eq!(asked.matches("--dependency=afterok:").count(), all.len() - 1);
    assert_eq!(asked.matches("--kill-on-invalid-dep=yes").count(), all.len() - 1);
    assert_eq!(asked.matches("--account=lab --comment=it's a\n").count(), all.len());
    // Import and pyramid in parts; the enlargement is one block.
    assert_eq!(asked.matches("--array=0-2 ").count(), 2, "{asked}");
    assert!(asked.contains("--array=0-0 enlarge.sh"), "{asked}");
    // A pyramid that is not whole is told too, and its part is named.
    let tile = store("_files").join("10/2_1.png");
    assert!(tile.is_file());
    std::fs::remove_file(&tile).unwrap();
    let told = fail(&mut Command::new(jobs.join("status.sh")), 66);
    assert!(told.contains("deepzoom, 21 of 22 tiles"), "{told}");
    let left = succeed(btf().arg("missing").arg(store(".dzi")).args(["--shards", "3"]));
    assert_eq!(left, "1\n");
    // Once more, everything is found done.
    succeed(stubs.with(Command::new("bash")).arg("submit.sh").current_dir(&jobs));
    assert_eq!(stubs.read(".codes"), "");
    assert_same(&store(".model.zarr"), &fixture().model());
}

#[test]
fn of_many_materials_each_stage_is_one_array_and_a_broken_one_does_not_stop_the_others() {
    let stubs = Stubs::new();
    let folder = tempfile::tempdir().unwrap();
    let [good, bad] = ["good.zip", "bad.zip"].map(|name| folder.path().join(name));
    let bytes = std::fs::read(fixture().archive()).unwrap();
    std::fs::write(&good, &bytes).unwrap();
    std::fs::write(&bad, &bytes[..bytes.len() / 2]).unwrap();
    let measured = folder.path().join("measured.zarr");
    crate::fixture::copy(&fixture().measurement(), &measured);
    let jobs = folder.path().join("jobs");
    let mut write = slurm(&[&good, &bad, &measured], &jobs, &["--tile", "cut", "--clusters", "24"]);
    write.arg("--into").arg(folder.path().join("stores"));
    let told = succeed(&mut write);
    assert!(
        told.contains("for 3 materials") && told.contains("note: ") && told.contains("bad.zip"),
        "{told}"
    );
    // The tasks of the broken one look twice, a minute apart.
    stubs.program("sleep", "exit 0");
    let mut submit = write;
    submit.arg("--submit");
    succeed(&mut stubs.with(submit));
    let codes = stubs.read(".codes");
    assert_eq!(codes, "task 1: 65\ntask 1: 66\n", "{}", stubs.read(".out"));
    let asked = stubs.read("");
    assert!(asked.lines().all(|line| line.contains("--array=0-2")), "{asked}");
    assert!(asked.contains("--dependency=aftercorr:1"), "{asked}");
    let store = |name: &str| folder.path().join("stores").join(name);
    assert_same(&store("good.zarr"), &fixture().measurement());
    assert_same(&store("good.model.zarr"), &fixture().model());
    assert_same(&store("measured.model.zarr"), &fixture().model());
    assert!(!store("measured.zarr").exists() && !store("bad.model.zarr").exists());
}

#[test]
fn only_a_task_that_was_stopped_is_run_again_and_not_for_ever() {
    let stubs = Stubs::new();
    let folder = tempfile::tempdir().unwrap();
    let jobs = folder.path().join("jobs");
    // Ends with each of these in turn, the last one for good.
    jobs_of(
        &stubs,
        &jobs,
        r#"read -r code rest <"$CODES"; [ -z "$rest" ] || echo "$rest" >"$CODES"; exit "$code""#,
    );
    set(&jobs.join("settings.sh"), "patience", "0");
    let codes = folder.path().join("codes");
    let run = |listed: &str, state: &str, restarts: &str| {
        std::fs::write(&codes, format!("{listed}\n")).unwrap();
        let _ = std::fs::remove_file(stubs.folder.path().join("log.scontrol"));
        let mut task = stubs.with(Command::new("bash"));
        task.arg("import.sh").current_dir(&jobs).env("CODES", &codes).env("STATE", state);
        task.env("SLURM_ARRAY_JOB_ID", "40").env("SLURM_ARRAY_TASK_ID", "3").env("BTF_MATERIAL", "0");
        task.env("SLURM_JOB_ID", "40").env("SLURM_RESTART_COUNT", restarts);
        let code = task.output().unwrap().status.code().unwrap();
        (code, stubs.read(".scontrol"))
    };
    let again = "requeue 40_3\n".to_owned();
    assert_eq!(run("75", "RUNNING", "0"), (75, again.clone()));
    assert_eq!(run("75", "RUNNING", "9"), (75, again));
    for (listed, state, restarts, code) in [
        ("75", "RUNNING", "10", 75),
        // Cancelled, or put back by Slurm.
        ("75", "COMPLETING", "0", 75),
        ("75", "", "0", 75),
        ("74", "RUNNING", "0", 74),
        ("65", "RUNNING", "0", 65),
        ("0", "RUNNING", "0", 0),
        // What is not there yet is looked for once more.
        ("66 0", "RUNNING", "0", 0),
        ("66 66 0", "RUNNING", "0", 66),
        ("66 1", "RUNNING", "0", 1),
    ] {
        assert_eq!(run(listed, state, restarts), (code, String::new()), "{listed} {state} {restarts}");
    }
}

#[test]
fn a_task_that_is_told_to_stop_tells_its_program_and_waits_for_it() {
    let stubs = Stubs::new();
    let folder = tempfile::tempdir().unwrap();
    let jobs = folder.path().join("jobs");
    // Ends only after it was told, and some time after that.
    jobs_of(
        &stubs,
        &jobs,
        r#"trap 'sleep 0.2; echo told >>"$CODES"; exit 75' TERM; echo begun >>"$CODES"; while :; do sleep 0.05; done"#,
    );
    let codes = folder.path().join("codes");
    let mut task = stubs.with(Command::new("bash"));
    task.arg("import.sh").current_dir(&jobs).env("CODES", &codes);
    task.env("SLURM_ARRAY_JOB_ID", "7").env("SLURM_ARRAY_TASK_ID", "0").env("BTF_MATERIAL", "0");
    let mut task = task.stdout(std::process::Stdio::null()).spawn().unwrap();
    let told = || std::fs::read_to_string(&codes).unwrap_or_default();
    while !told().contains("begun") {
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    // Twice, as Slurm may.
    for _ in 0..2 {
        succeed(Command::new("kill").args(["-TERM", &task.id().to_string()]));
    }
    assert_eq!(task.wait().unwrap().code(), Some(75));
    assert_eq!((told().as_str(), stubs.read(".scontrol").as_str()), ("begun\ntold\n", "requeue 7_0\n"));
}

#[test]
fn what_cannot_be_meant_is_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let jobs = folder.path().join("jobs");
    let archive = fixture().archive();
    let refused = |inputs: &[&Path], more: &[&str], code: i32, what: &str| {
        let told = fail(&mut slurm(inputs, &jobs, more), code);
        assert!(told.contains(what), "{told}");
        assert!(!jobs.exists(), "{told}");
    };
    refused(&[&archive, &archive], &[], 2, "two materials would both become");
    refused(&[&folder.path().join("none.zip")], &[], 66, "none.zip");
    refused(&[&fixture().model()], &[], 2, "expected an archive or a measurement");
    refused(&[&archive], &["--parts", "1001"], 2, "at most 1000");
    refused(&[&archive], &["--time", "9"], 2, "10..");
    refused(&[&archive], &["--cpus", "0"], 2, "1..");
    let many: Vec<PathBuf> = (0..1001).map(|number| folder.path().join(format!("{number}.zip"))).collect();
    many.iter().for_each(|path| std::fs::write(path, "no archive").unwrap());
    let many: Vec<&Path> = many.iter().map(PathBuf::as_path).collect();
    refused(&many, &[], 2, "an array of 1001 tasks");
    // Where there are scripts of other jobs, they stay.
    succeed(&mut slurm(&[&archive], &jobs, &[]));
    let told = fail(&mut slurm(&[&archive], &jobs, &["--clusters", "9"]), 65);
    assert!(told.contains("settings.sh") && told.contains("--out") && told.contains("--force"), "{told}");
    let told = fail(Command::new("/bin/bash").arg(jobs.join("submit.sh")).env("PATH", "/nowhere"), 66);
    assert!(told.contains("no sbatch here"), "{told}");
    // What sbatch refuses is told.
    let stubs = Stubs::new();
    stubs.program("sbatch", "echo 'no such partition' >&2; exit 1");
    let told = fail(&mut stubs.with(slurm(&[&archive], &jobs, &["--submit"])), 74);
    assert!(told.contains("no such partition") && told.contains("nothing was submitted"), "{told}");
}

#[test]
fn slurm_is_asked_for_what_the_plans_say_and_for_room() {
    let folder = tempfile::tempdir().unwrap();
    let jobs = folder.path().join("jobs");
    succeed(&mut slurm(&[&fixture().archive()], &jobs, &["--memory", "20MiB", "--clusters", "24"]));
    let number = |script: &str, of: &str| -> u64 {
        let text = std::fs::read_to_string(jobs.join(script)).unwrap();
        let at = text.find(of).unwrap_or_else(|| panic!("{text}"));
        text[at + of.len()..].chars().take_while(char::is_ascii_digit).collect::<String>().parse().unwrap()
    };
    let [import, model] = ["import.sh", "model.sh"].map(|script| number(script, "\nmemory="));
    assert!(import == 20 && model > 64, "{import} {model}");
    for (script, memory) in [("import.sh", import), ("model.sh", model)] {
        assert_eq!(number(script, "#SBATCH --mem="), memory + memory / 4 + 64);
        assert!(number(script, "#SBATCH --time=") >= 10);
    }
    // What is asked for is enough.
    let made = folder.path().join("made.zarr");
    let mut command = btf();
    command.arg("model").args([fixture().measurement(), made]).args(["--clusters", "24"]);
    succeed(command.args(["--threads", "4", "--memory", &format!("{model}MiB")]));
}

/// The tasks of each script of a folder of jobs, as they are submitted.
fn tasks(stubs: &Stubs, jobs: &Path) -> Vec<String> {
    stubs.program(
        "sbatch",
        r#"for word in "$@"; do case $word in --array=*) array=$word ;; esac; script=$word; done; echo "$array $script" >>"$LOG"; echo 7"#,
    );
    succeed(&mut stubs.with(Command::new(jobs.join("submit.sh"))));
    stubs.read("").lines().map(|line| line.trim_start_matches("--array=").to_owned()).collect()
}

#[test]
fn no_part_is_without_work_and_a_list_has_no_parts_to_edit() {
    let folder = tempfile::tempdir().unwrap();
    let [jobs, list] = ["jobs", "list"].map(|name| folder.path().join(name));
    // Nine views; one block; two rows of tiles.
    let more = ["--size", "900x400", "--deepzoom", "--parts", "40"];
    succeed(&mut slurm(&[&fixture().archive()], &jobs, &more));
    assert_eq!(
        tasks(&Stubs::new(), &jobs),
        ["0-8 import.sh", "0-0 model.sh", "0-0 enlarge.sh", "0-1 deepzoom.sh"]
    );
    let other = folder.path().join("other.zip");
    std::fs::copy(fixture().archive(), &other).unwrap();
    succeed(&mut slurm(&[&fixture().archive(), &other], &list, &["--size", "900x400", "--deepzoom"]));
    let texts = ["settings.sh", "import.sh", "enlarge.sh", "deepzoom.sh"]
        .map(|name| std::fs::read_to_string(list.join(name)).unwrap());
    for text in texts {
        assert!(!text.contains("_parts") && !text.contains("--shard"), "{text}");
    }
    assert!(tasks(&Stubs::new(), &list).iter().all(|task| task.starts_with("0-1 ")));
}

#[test]
fn memory_for_surfaces_grows_with_what_their_methods_hold() {
    let folder = tempfile::tempdir().unwrap();
    let asked = |name: &str, size: &str, method: &str| {
        let jobs = folder.path().join(name);
        let more = ["--memory", "16MiB", "--size", size, "--method", method, "--deepzoom"];
        succeed(&mut slurm(&[&fixture().archive()], &jobs, &more));
        ["enlarge.sh", "deepzoom.sh"].map(|script| {
            let text = std::fs::read_to_string(jobs.join(script)).unwrap();
            let (_, after) = text.split_once("\nmemory=").unwrap();
            after.split_once("MiB").unwrap().0.parse::<u64>().unwrap()
        })
    };
    // What is asked for is enough for the commands, and not far from what they take at least.
    for (name, method) in ["coherent", "paper", "repeat", "tiles", "roller", "quilt"].map(|name| (name, name))
    {
        let [enlarge, pyramid] = asked(name, "3000x700", method);
        let plane = folder.path().join(format!("{name}.zarr"));
        let with = |command: &mut Command, mib: u64| {
            command.args(["--threads", "4", "--memory", &format!("{mib}MiB")]).output().unwrap().status.code()
        };
        let enlarged = |mib: u64| {
            let mut command = btf();
            command.arg("enlarge").args([&fixture().model(), &plane]).args(["--size", "3000x700"]);
            with(command.args(["--method", method]), mib)
        };
        assert_eq!(enlarged(enlarge), Some(0), "{method} {enlarge}");
        let _ = std::fs::remove_dir_all(&plane);
        assert_eq!(enlarged(enlarge / 3), Some(2), "{method} {enlarge}");
        assert_eq!(enlarged(enlarge), Some(0), "{method} {enlarge}");
        let picture = |mib: u64| {
            let mut command = btf();
            let output = folder.path().join(format!("{name}.dzi"));
            with(command.arg("export").args([&plane, &output]).arg("--model").arg(fixture().model()), mib)
        };
        assert_eq!(picture(pyramid / 3), Some(2), "{method} {pyramid}");
        assert_eq!(picture(pyramid), Some(0), "{method} {pyramid}");
    }
    // A plane far wider than high: rows of it are held by some, the plane by none.
    let wide = |method: &str| asked(&format!("wide {method}"), "1000000x100000", method);
    let [coherent, pyramid] = wide("coherent");
    assert!(coherent < 64, "{coherent}");
    assert!((1000..3000).contains(&pyramid), "{pyramid}");
    let [quilt, _] = wide("quilt");
    assert!((2000..6000).contains(&quilt), "{quilt}");
}

#[test]
fn what_was_submitted_before_stays_known_and_nothing_is_cancelled_that_was_not_submitted() {
    let folder = tempfile::tempdir().unwrap();
    let jobs = folder.path().join("jobs");
    succeed(&mut slurm(&[&fixture().archive()], &jobs, &[]));
    let stubs = Stubs::new();
    let submit = || stubs.with(Command::new(jobs.join("submit.sh")));
    stubs.program("sbatch", r#"echo "$RANDOM$RANDOM""#);
    succeed(&mut submit());
    let first = std::fs::read_to_string(jobs.join("jobs")).unwrap();
    let told = succeed(&mut submit());
    let both = std::fs::read_to_string(jobs.join("jobs")).unwrap();
    assert!(both.starts_with(&first) && both.lines().count() == 4, "{both}");
    assert!(told.contains("scancel --quiet $(cat"), "{told}");
    stubs.program("sbatch", "echo refused >&2; exit 1");
    let told = fail(&mut submit(), 1);
    assert!(told.contains("nothing was submitted") && !told.contains("scancel"), "{told}");
    assert_eq!(std::fs::read_to_string(jobs.join("jobs")).unwrap(), both);
    // The second one is refused.
    stubs.program("sbatch", r#"case "$*" in *import.sh) echo 5 ;; *) exit 1 ;; esac"#);
    let told = fail(&mut submit(), 1);
    assert!(told.contains("not all were submitted") && told.contains("scancel --quiet"), "{told}");
}
