//! The command line as people meet it: help in groups, completions, manual pages, numbers with a sign, widths.

use std::path::Path;
use std::process::{Command, Stdio};

use crate::fixture::{btf, copy, fail, fixture, succeed};

/// Names of all commands, as the general help lists them in its groups.
fn commands() -> Vec<String> {
    let help = succeed(btf().arg("--help"));
    let groups = ["Try:", "Convert:", "Check:", "Model:", "Enlarge:", "Look:", "Set up:"];
    let places: Vec<usize> = groups.map(|group| help.find(&format!("\n{group}\n")).expect(group)).to_vec();
    assert!(places.is_sorted(), "{help}");
    let list = &help[places[0]..help.find("\nOptions:").unwrap()];
    let name = |line: &str| {
        let rest = line.strip_prefix("  ")?;
        let name = rest.split(' ').next()?;
        (!name.is_empty() && rest.starts_with(name)).then(|| name.to_owned())
    };
    list.lines().filter_map(name).collect()
}

fn is_there(program: &str) -> bool {
    let found = Command::new(program).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    if found.is_err() {
        println!("skipped: no {program}");
    }
    found.is_ok()
}

#[test]
fn every_command_explains_itself_with_an_example_and_common_options_last() {
    let commands = commands();
    assert!(commands.len() > 18, "{commands:?}");
    for command in commands.iter().filter(|command| *command != "help") {
        let help = succeed(btf().args([command, "--help"]));
        assert!(help.contains(&format!("  btf {command}")), "{command}: {help}");
        let common = help.find("\nCommon options:").expect(command);
        let headings = help.match_indices(":\n\n").count();
        assert!(headings < 20 && help.find("\nOptions:").is_none_or(|own| own < common), "{command}: {help}");
        assert!(help[common..].contains("--memory") && help[common..].contains("--threads"), "{command}");
        assert!(help.find("--memory").is_none_or(|first| first > common), "{command}: {help}");
    }
}

#[test]
fn the_version_names_the_commit() {
    let told = succeed(btf().arg("--version"));
    let commit = told.trim().strip_prefix("btf 0.1.0 (").unwrap().strip_suffix(')').unwrap().to_owned();
    let is_hash = commit.len() == 12 && commit.chars().all(|c| c.is_ascii_hexdigit());
    assert!(is_hash || commit == "unknown", "{told}");
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    if here.join(".git").exists() && is_there("git") {
        let head = Command::new("git").args(["rev-parse", "HEAD"]).current_dir(here).output().unwrap();
        let head = String::from_utf8(head.stdout).unwrap();
        assert!(head.trim().is_empty() || head.starts_with(&commit), "{told} {head}");
    }
}

#[test]
fn completions_are_made_for_every_shell_and_bash_completes_with_them() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = succeed(btf().args(["completions", shell]));
        for word in ["enlarge", "completions", "tileable", "memory"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    if !is_there("bash") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("btf.bash");
    std::fs::write(&script, succeed(btf().args(["completions", "bash"]))).unwrap();
    let complete = |words: &[&str]| {
        let line: Vec<String> = words.iter().map(|word| format!("'{word}'")).collect();
        let program = format!(
            "source '{}' && COMP_WORDS=({}) COMP_CWORD={} && _btf btf '{}' '{}' && printf '%s\\n' \"${{COMPREPLY[@]}}\"",
            script.display(),
            line.join(" "),
            words.len() - 1,
            words[words.len() - 1],
            words[words.len() - 2],
        );
        succeed(Command::new("bash").args(["--norc", "-c", &program]))
    };
    assert_eq!(complete(&["btf", "enl"]).trim(), "enlarge");
    let options = complete(&["btf", "enlarge", "--t"]);
    let mut options: Vec<&str> = options.split_whitespace().collect();
    options.sort_unstable();
    assert_eq!(options, ["--threads", "--tileable", "--tiles"]);
    let methods = complete(&["btf", "enlarge", "--method", ""]);
    assert!(methods.contains("coherent") && methods.contains("quilt"), "{methods}");
}

#[test]
fn there_is_a_manual_page_for_every_command_and_it_is_sound() {
    let folder = tempfile::tempdir().unwrap();
    let told = succeed(btf().arg("man").arg("--out").arg(folder.path()));
    let mut expected: Vec<String> = commands()
        .iter()
        .filter(|command| *command != "help")
        .map(|command| format!("btf-{command}.1"))
        .collect();
    expected.push("btf.1".to_owned());
    expected.sort();
    let mut found: Vec<String> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    found.sort();
    assert_eq!(found, expected);
    assert!(told.contains(&format!("{} pages", expected.len())), "{told}");
    for name in &found {
        let page = std::fs::read_to_string(folder.path().join(name)).unwrap();
        let title = name.trim_end_matches(".1");
        assert!(page.contains(&format!(".TH {title} 1")), "{name}: {page}");
        let sections: Vec<&str> = page.lines().filter_map(|line| line.strip_prefix(".SH ")).collect();
        assert!(sections.len() >= 4 && sections[0] == "NAME", "{name}: {sections:?}");
        // Requests begin lines; nothing else may look like one, and what is not filled is filled again.
        let known =
            [".TH", ".SH", ".SS", ".TP", ".RS", ".RE", ".br", ".nf", ".fi", ".ie", ".el", ".IP", ".PP"];
        for line in page.lines().filter(|line| line.starts_with(['.', '\''])) {
            assert!(known.iter().any(|request| line.starts_with(request)), "{name}: {line}");
        }
        assert_eq!(page.matches("\n.nf").count(), page.matches("\n.fi").count(), "{name}");
        let of_one = succeed(btf().args(if name == "btf.1" {
            vec!["man"]
        } else {
            vec!["man", title.trim_start_matches("btf-")]
        }));
        assert_eq!(of_one.trim_end(), page.trim_end(), "{name}");
    }
    // An example keeps its line.
    let page = std::fs::read_to_string(folder.path().join("btf-import.1")).unwrap();
    assert!(page.lines().any(|line| line.contains("btf import") && line.contains("many archives")), "{page}");
    if is_there("mandoc") {
        let mut lint = Command::new("mandoc");
        lint.args(["-Tlint", "-Wunsupp"]).args(found.iter().map(|name| folder.path().join(name)));
        let told = String::from_utf8_lossy(&lint.output().unwrap().stdout).into_owned();
        assert!(!told.contains("ERROR") && !told.contains("UNSUPP"), "{told}");
    }
    fail(btf().args(["man", "nothing"]), 2);
}

#[test]
fn numbers_with_a_sign_are_read_or_refused_as_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let image = |arguments: &[&str]| {
        let mut command = btf();
        command.arg("image").arg(fixture().model()).args(arguments);
        command.arg("--out").arg(folder.path().join("a.png"));
        command
    };
    succeed(&mut image(&["--plane", "--window", "-5,-3,8,8"]));
    for (arguments, expected) in [
        (["--view", "-10,0"], "theta 0 to 90"),
        (["--light", "-1,5"], "theta 0 to 90"),
        (["--exposure", "-2"], "above 0"),
        (["--memory", "-1GiB"], "expected a size"),
        (["--window", "-1,0,5,5"], "does not lie within"),
        (["--window", "0,0,-5,5"], "from 1 to 2147483648"),
        (["--threads", "-2"], "-2"),
    ] {
        let told = fail(&mut image(&arguments), 2);
        assert!(told.contains(expected) && !told.contains("unexpected argument"), "{arguments:?}: {told}");
    }
    // A negative azimuth is one.
    succeed(image(&["--light", "15,-90"]).arg("--force"));
    for (command, names, size, expected) in [
        ("enlarge", &["a", "b"][..], "-5x5", "each from 1 to 16777216,"),
        ("sample", &["a"][..], "5x-5", "each from 1 to 65536,"),
        ("enlarge", &["a", "b"][..], "99999999x5", "each from 1 to 16777216,"),
    ] {
        let told = fail(btf().arg(command).args(names).args(["--size", size]), 2);
        assert!(told.contains(expected), "{command}: {told}");
    }
    let help = succeed(btf().args(["enlarge", "--help"]));
    assert!(help.contains("from 1 to 16777216"), "{help}");
}

#[test]
fn memory_is_given_in_powers_of_1024_or_of_1000_and_with_decimals() {
    let image = |memory: &str| {
        let mut command = btf();
        command.arg("info").arg(fixture().model()).args(["--memory", memory]);
        command
    };
    for memory in ["512MiB", "1.5GiB", "2GB", "700MB", "0.5g", "1000000000"] {
        succeed(&mut image(memory));
    }
    let told = fail(&mut image("2 gigs"), 2);
    assert!(told.contains("powers of 1024") && told.contains("of 1000"), "{told}");
}

/// Runs a command on a terminal of so many columns, by util-linux's `script`.
fn on_terminal(columns: usize, command: &Command) -> Option<String> {
    if !is_there("script") {
        return None;
    }
    let quoted = |text: &std::ffi::OsStr| format!("'{}'", text.to_string_lossy());
    let words: Vec<String> =
        std::iter::once(command.get_program()).chain(command.get_args()).map(quoted).collect();
    let line = format!("stty cols {columns} rows 40; {}", words.join(" "));
    let output =
        Command::new("script").args(["-qec", &line, "/dev/null"]).stdin(Stdio::null()).output().unwrap();
    Some(String::from_utf8_lossy(&output.stdout).replace('\r', ""))
}

#[test]
fn tables_and_errors_are_wrapped_on_a_terminal_and_nowhere_else() {
    let long = "a name that no table has room for because it is as long as this/".repeat(3);
    for (columns, arguments) in [(60, ["info"]), (60, ["check"])] {
        let mut command = btf();
        command.args(arguments).arg(fixture().measurement()).args(["--progress", "none"]);
        let plain = succeed(&mut command);
        let Some(told) = on_terminal(columns, &command) else { return };
        assert!(
            told.lines().all(|line| line.chars().count() <= columns || !line.trim().contains(' ')),
            "{told}"
        );
        let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        let (mut a, mut b) = (words(&plain), words(&told));
        a.sort();
        b.sort();
        assert_eq!(a, b);
    }
    let mut command = btf();
    command.args(["info", &long]);
    let Some(told) = on_terminal(70, &command) else { return };
    assert!(told.lines().count() > 2 && told.starts_with("btf: "), "{told}");
    assert!(told.lines().skip(1).all(|line| line.starts_with("  ")), "{told}");
    let plain = fail(&mut command, 66);
    assert!(plain.lines().next().unwrap().len() > 150, "{plain}");
}

#[test]
fn a_model_is_made_in_stages_that_are_counted_and_found_done_the_next_time() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("a.model.zarr");
    let mut command = crate::fixture::model_of(&fixture().measurement(), &model);
    command.args(["--progress", "json"]);
    let run = |command: &mut Command| {
        let output = command.output().unwrap();
        assert!(output.status.success());
        (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap())
    };
    let (told, events) = run(&mut command);
    let events: Vec<serde_json::Value> =
        events.lines().map(|line| serde_json::from_str(line).expect(line)).collect();
    let stages: Vec<(u64, u64, &str)> = events
        .iter()
        .filter(|event| event["event"] == "stage")
        .map(|event| {
            let stage = &event["stage"];
            (
                stage["number"].as_u64().unwrap(),
                stage["of"].as_u64().unwrap(),
                stage["name"].as_str().unwrap(),
            )
        })
        .collect();
    let names = ["tile", "cluster", "normals", "fit", "appearance"];
    let expected: Vec<(u64, u64, &str)> = (1..).zip(names).map(|(number, name)| (number, 5, name)).collect();
    assert_eq!(stages, expected);
    // Every step says which stage it is of.
    for event in events.iter().filter(|event| event["event"] == "begin") {
        assert!(names.contains(&event["stage"]["name"].as_str().unwrap()), "{event}");
    }
    assert!(!told.contains("found done"), "{told}");
    let (told, _) = run(&mut command);
    let found: Vec<&str> = told.lines().filter(|line| line.contains("found done: ")).collect();
    assert_eq!(found.len(), 5, "{told}");
    for (line, label) in found.iter().zip(["tile", "clusters", "normals", "field", "exemplar"]) {
        assert!(line.starts_with(label), "{line}");
    }
    // One stage alone says so too.
    let told = succeed(btf().arg("normals").args([&fixture().measurement(), &model]));
    assert!(told.contains("found done: "), "{told}");
}

#[test]
fn the_passes_of_a_factorisation_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let output = btf()
        .arg("export")
        .arg(fixture().measurement())
        .arg(folder.path().join("a.btf"))
        .args(["--rank", "3", "--progress", "json"])
        .output()
        .unwrap();
    assert!(output.status.success());
    let events = String::from_utf8(output.stderr).unwrap();
    let numbers: Vec<u64> = events
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap())
        .filter(|event| event["event"] == "stage")
        .map(|event| {
            assert_eq!(event["stage"]["of"], 18);
            event["stage"]["number"].as_u64().unwrap()
        })
        .collect();
    assert_eq!(numbers, (1..=18).collect::<Vec<u64>>());
    let told = fail(
        btf()
            .arg("export")
            .arg(fixture().measurement())
            .arg(folder.path().join("b.btf"))
            .args(["--rank", "99999"]),
        2,
    );
    assert!(told.contains("got --rank 99999"), "{told}");
}

#[test]
fn the_model_of_an_enlargement_is_found_from_any_folder_and_after_both_are_moved() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("project");
    let model = root.join("models/a.model.zarr");
    copy(&fixture().model(), &model);
    std::fs::create_dir_all(root.join("out/deep")).unwrap();
    // Made by relative names from within the project.
    succeed(btf().current_dir(&root).args([
        "enlarge",
        "models/a.model.zarr",
        "out/deep/big.zarr",
        "--size",
        "32x24",
    ]));
    let image = |at: &Path, index: &str, name: &str| {
        let mut command = btf();
        command.current_dir(at).args(["image", index, "--force", "--out"]).arg(folder.path().join(name));
        command
    };
    succeed(&mut image(&root, "out/deep/big.zarr", "a.png"));
    succeed(&mut image(&root.join("out"), "deep/big.zarr/", "b.png"));
    succeed(&mut image(&root.join("out/deep/big.zarr"), ".", "b.png"));
    // The whole project elsewhere.
    let moved = folder.path().join("elsewhere");
    std::fs::rename(&root, &moved).unwrap();
    succeed(&mut image(folder.path(), "elsewhere/out/deep/big.zarr", "c.png"));
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(read("a.png") == read("b.png") && read("a.png") == read("c.png"));
    // The model beside it, under its name.
    std::fs::rename(moved.join("models/a.model.zarr"), moved.join("out/deep/a.model.zarr")).unwrap();
    succeed(&mut image(folder.path(), "elsewhere/out/deep/big.zarr", "c.png"));
    // Another model in the place is passed over for the right one, and told where there is none.
    copy(&fixture().model(), &moved.join("models/a.model.zarr"));
    let zarr = moved.join("models/a.model.zarr/zarr.json");
    let text = std::fs::read_to_string(&zarr).unwrap();
    std::fs::write(&zarr, text.replace("\"robust\":false", "\"robust\":true")).unwrap();
    succeed(&mut image(folder.path(), "elsewhere/out/deep/big.zarr", "c.png"));
    // Gone: what was looked for, and what to do.
    for place in ["models", "out/deep/a.model.zarr"] {
        std::fs::remove_dir_all(moved.join(place)).unwrap();
    }
    let told = fail(&mut image(folder.path(), "elsewhere/out/deep/big.zarr", "d.png"), 66);
    assert!(told.contains("models/a.model.zarr") && told.contains("deep/a.model.zarr"), "{told}");
    assert!(told.contains("--model"), "{told}");
    let mut named = image(folder.path(), "elsewhere/out/deep/big.zarr", "d.png");
    succeed(named.arg("--model").arg(fixture().model()));
}

#[test]
fn what_a_model_lacks_is_told_with_the_command_that_makes_it() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("a.model.zarr");
    succeed(btf().arg("tile").args([&fixture().measurement(), &model]).args(["--tile", "cut"]));
    let image = |more: &[&str]| {
        let mut command = btf();
        command.arg("image").arg(&model).args(more).arg("--out").arg(folder.path().join("a.png"));
        command
    };
    for (more, expected) in [
        (&[][..], "btf cluster"),
        (&["--what", "index"][..], "btf cluster"),
        (&["--what", "normals"][..], "btf normals"),
        (&["--plane", "--window", "0,0,8,8"][..], "btf cluster"),
    ] {
        let told = fail(&mut image(more), 66);
        assert!(told.contains(expected), "{more:?}: {told}");
    }
    succeed(btf().arg("cluster").args([&fixture().measurement(), &model]).args(["--clusters", "8"]));
    let told = fail(&mut image(&["--plane", "--window", "0,0,8,8"]), 66);
    assert!(told.contains("btf appearance"), "{told}");
    let told =
        fail(btf().arg("enlarge").arg(&model).arg(folder.path().join("b.zarr")).args(["--size", "8x8"]), 66);
    assert!(told.contains("btf appearance"), "{told}");
    succeed(btf().arg("appearance").arg(&model));
    std::fs::remove_dir_all(model.join("appearance")).unwrap();
    let told =
        fail(btf().arg("enlarge").arg(&model).arg(folder.path().join("b.zarr")).args(["--size", "8x8"]), 66);
    assert!(told.contains("btf appearance"), "{told}");
    // A wrong measurement is not answered by the advice to name one.
    let other = folder.path().join("other.zarr");
    let told = fail(&mut image(&["--values", "measured", "--measurement", other.to_str().unwrap()]), 66);
    assert!(!told.contains("name the measurement with"), "{told}");
    // Where it lay is not known any more.
    std::fs::remove_file(model.join("measurement-path")).unwrap();
    let told = fail(&mut image(&["--values", "measured"]), 66);
    assert!(told.contains("name the measurement with --measurement"), "{told}");
}

#[test]
fn errors_are_json_where_progress_is_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("none.zarr");
    let told = fail(btf().arg("verify").arg(&missing).args(["--progress", "json"]), 66);
    let lines: Vec<serde_json::Value> =
        told.lines().map(|line| serde_json::from_str(line).expect(line)).collect();
    let error = lines.last().unwrap();
    assert_eq!((&error["event"], &error["exit_code"]), (&"error".into(), &66.into()));
    assert!(error["message"].as_str().unwrap().contains("none.zarr"), "{error}");
    // Beside reports of many as JSON, too.
    let told = fail(
        btf().arg("verify").args([&missing, &fixture().measurement()]).args(["--json", "--progress", "json"]),
        66,
    );
    let lines: Vec<serde_json::Value> =
        told.lines().map(|line| serde_json::from_str(line).expect(line)).collect();
    assert!(lines.iter().any(|line| line["event"] == "error"));
    assert_eq!(lines.last().unwrap()["event"], "count", "{told}");
    // With advice, where there is any.
    let mut command = btf();
    command.args(["image", "--plane"]).arg(fixture().measurement()).args([
        "--out",
        "a.gif",
        "--progress",
        "json",
    ]);
    let told = fail(&mut command, 2);
    let error: serde_json::Value = serde_json::from_str(told.lines().last().unwrap()).unwrap();
    assert!(error.as_object().unwrap().contains_key("advice"), "{error}");
}

#[test]
fn numbers_that_no_option_takes_are_told_in_words_that_help() {
    for arguments in [&["info", "-1"][..], &["enlarge", "m", "o", "--size", "64x64", "-2.5"]] {
        let told = fail(btf().args(arguments), 2);
        assert!(told.contains("behind the option that it is for") && !told.contains("use '-- -"), "{told}");
    }
    for arguments in [
        &["cluster", "s", "m", "--clusters", "-5"][..],
        &["cluster", "s", "m", "--seed", "1.5"],
        &["fit", "m", "--levels", "x"],
        &["import", "a", "--drop-view", "-1"],
    ] {
        let told = fail(btf().args(arguments), 2);
        assert!(
            told.contains("expected a whole number, ") && told.starts_with("error: invalid value"),
            "{told}"
        );
    }
}

#[test]
fn options_that_a_format_has_no_use_for_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (name, options) in [
        ("a.npy", &["--rank", "3"][..]),
        ("a.npy", &["--quality", "20"]),
        ("a.npy", &["--tile-size", "100"]),
        ("a.zip", &["--light", "15,0"]),
        ("a.zip", &["--rank", "3"]),
        ("a.btf", &["--quality", "20"]),
        ("a.dzi", &["--rank", "3"]),
        ("a.dzi", &["--quality", "20"]),
        ("a.dzi", &["--to", "png"]),
        ("a", &["--to", "exr", "--json"]),
    ] {
        let place = folder.path().join(name);
        let mut export = btf();
        export.arg("export").args([&fixture().measurement(), &place]).args(options);
        fail(&mut export, 2);
        assert!(!place.exists(), "{name} {options:?}");
    }
    let mut export = btf();
    let place = folder.path().join("a.dzi");
    export.arg("export").args([&fixture().measurement(), &place]).args([
        "--format",
        "jpeg",
        "--quality",
        "20",
    ]);
    succeed(&mut export);
}

#[test]
fn names_in_the_wrong_order_begin_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let measurement = folder.path().join("there.zarr");
    crate::fixture::copy(&fixture().measurement(), &measurement);
    let archive = folder.path().join("there.zip");
    std::fs::copy(fixture().archive(), &archive).unwrap();
    let before = crate::fixture::tree(folder.path());
    for arguments in [
        &["import", "new.zarr", "there.zip"][..],
        &["enlarge", "there.zarr", "absent.model.zarr", "--size", "16x16"],
    ] {
        let told = fail(btf().current_dir(folder.path()).args(arguments), 66);
        assert!(told.contains("no such"), "{told}");
        assert_eq!(crate::fixture::tree(folder.path()), before, "{arguments:?}");
    }
}
