//! The pages that users read: the README, and the book in `docs/`.
//!
//! Every command that they show runs here, as it stands there, on a smaller sample. A command is a line that begins
//! with `btf`, in a block that is indented by four spaces or fenced (as `sh`, or without a language). Commands that
//! cannot run here, because they need an archive of the reader's or a cluster of machines, stand in a fence with the
//! language `text`; few may.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;

use crate::fixture::{btf, succeed};

/// What a page's folder holds at the start, unless the page makes its own: what the tutorial makes.
const TUTORIAL: [&str; 4] = [
    "btf sample wood.zip --material wood --size 256x256",
    "btf import wood.zip wood.zarr",
    "btf model wood.zarr wood.model.zarr",
    "btf enlarge wood.model.zarr big.zarr --size 1024x1024",
];

/// Views and lights of the samples, so that the test takes a minute.
const FEWER: &str = "--views 9 --lights 13";

/// Most commands of all pages that stand in a fence of `text`.
const MOST_UNTRIED: usize = 20;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// README.md, CONTRIBUTING.md, and all pages of the book in order of their paths, each with its text.
fn pages() -> Vec<(PathBuf, String)> {
    let mut pages = vec![root().join("README.md"), root().join("CONTRIBUTING.md")];
    let mut folders = vec![root().join("docs")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "md") {
                pages.push(path);
            }
        }
    }
    pages.sort();
    let read = |path: PathBuf| {
        let text = fs::read_to_string(&path).unwrap();
        (path, text)
    };
    pages.into_iter().map(read).collect()
}

/// Lines of prose, and lines of code with the language of their block.
enum Line<'a> {
    Prose(&'a str),
    Code(&'a str, &'a str),
}

fn lines(text: &str) -> Vec<Line<'_>> {
    let mut fence = None;
    let mut lines = Vec::new();
    for line in text.lines() {
        match (fence, line.strip_prefix("```")) {
            (None, Some(language)) => fence = Some(language),
            (Some(_), Some(_)) => fence = None,
            (Some(language), None) => lines.push(Line::Code(language, line)),
            (None, None) => lines.push(match line.strip_prefix("    ") {
                Some(code) => Line::Code("", code),
                None => Line::Prose(line),
            }),
        }
    }
    lines
}

/// Commands of a page: those to run, and the number of those that cannot be.
fn commands(text: &str) -> (Vec<String>, usize) {
    let (mut commands, mut untried) = (Vec::<String>::new(), 0);
    for line in lines(text) {
        // What only begins with the letters `btf` is a command misspelt, and fails.
        let Line::Code(language, line) = line else { continue };
        match (language, commands.last_mut()) {
            ("text", _) => untried += usize::from(line.trim_start().starts_with("btf ")),
            ("" | "sh", Some(last)) if last.ends_with('\\') => {
                last.pop();
                last.push_str(line);
            }
            ("" | "sh", _) if line.starts_with("btf") => commands.push(line.to_owned()),
            _ => {}
        }
    }
    (commands, untried)
}

/// The same command at half of all sizes, and of windows.
fn smaller(command: &str) -> String {
    let half = |word: &str, separator: char| {
        let numbers: Option<Vec<i64>> = word.split(separator).map(|number| number.parse().ok()).collect();
        let numbers = numbers.filter(|numbers| numbers.len() > 1)?;
        Some(numbers.iter().map(|n| (n / 2).to_string()).collect::<Vec<_>>().join(&separator.to_string()))
    };
    let mut before = "";
    let words = command.split(' ').map(|word| {
        let small = if before == "--window" { half(word, ',') } else { half(word, 'x') };
        before = word;
        small.unwrap_or_else(|| word.to_owned())
    });
    let command = words.collect::<Vec<_>>().join(" ");
    match command.strip_prefix("btf sample ") {
        Some(options) if !options.contains("--views") => format!("btf sample {FEWER} {options}"),
        _ => command,
    }
}

/// Runs a command by the shell, as a reader does.
fn run(folder: &Path, command: &str) -> Result<(), String> {
    let program = Path::new(env!("CARGO_BIN_EXE_btf")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap_or_default());
    let mut shell = std::process::Command::new("sh");
    shell.args(["-e", "-c", &smaller(command)]).current_dir(folder).env("PATH", path).stdin(Stdio::null());
    let output = shell.output().unwrap();
    if output.status.success() {
        return Ok(());
    }
    Err(format!("{command}\n{}: {}", output.status, String::from_utf8_lossy(&output.stderr)))
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let to = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &to);
        } else {
            fs::copy(entry.path(), to).unwrap();
        }
    }
}

#[test]
fn every_command_of_the_pages_runs() {
    let folder = tempfile::tempdir().unwrap();
    let tutorial = folder.path().join("tutorial");
    fs::create_dir(&tutorial).unwrap();
    for command in TUTORIAL {
        run(&tutorial, command).unwrap();
    }
    let (mut failed, mut count, mut untried) = (Vec::new(), 0, 0);
    for (number, (path, text)) in pages().iter().enumerate() {
        let (commands, not_tried) = commands(text);
        untried += not_tried;
        if commands.is_empty() {
            continue;
        }
        let scratch = folder.path().join(number.to_string());
        if commands.iter().any(|command| command.starts_with("btf sample wood.zip")) {
            fs::create_dir(&scratch).unwrap();
        } else {
            copy(&tutorial, &scratch);
        }
        count += commands.len();
        for command in &commands {
            if let Err(error) = run(&scratch, command) {
                failed.push(format!("{}: {error}", path.display()));
            }
        }
        fs::remove_dir_all(scratch).unwrap();
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
    assert!(count > 80, "only {count} commands were found");
    assert!(untried <= MOST_UNTRIED, "{untried} commands are not tried, at most {MOST_UNTRIED} should be");
}

#[test]
fn a_misspelt_command_of_a_page_fails() {
    let page = "A page.\n\n    btf inf wood.zip\n    btfinfo wood.zip\n\n```sh\nbtf info --jsn \\\n    wood.zip\n```\n\n\
                ```text\nbtf info of-yours.zip\n```\n";
    let (commands, untried) = commands(page);
    assert_eq!(commands, ["btf inf wood.zip", "btfinfo wood.zip", "btf info --jsn     wood.zip"]);
    assert_eq!(untried, 1);
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), "btf sample wood.zip --size 16x16 --views 1 --lights 3").unwrap();
    run(folder.path(), "btf info wood.zip").unwrap();
    for command in commands {
        assert!(run(folder.path(), &command).unwrap_err().contains(&command));
    }
}

/// Options that pages name in prose, such as `--size`.
fn options_named(text: &str) -> BTreeSet<String> {
    let words = text.split(|c: char| !c.is_ascii_alphanumeric() && c != '-');
    words.filter(|word| word.starts_with("--") && word.len() > 3).map(str::to_owned).collect()
}

#[test]
fn every_option_that_a_page_names_exists() {
    let help = succeed(btf().arg("--help"));
    // The list of commands stands before the options; its lines that go on have more spaces.
    let list = help.split("\nOptions:").next().unwrap();
    let commands = list.lines().filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    let commands = commands.filter(|name| !name.is_empty());
    let mut known = options_named(&help);
    for command in commands {
        known.extend(options_named(&succeed(btf().args(["help", command]))));
    }
    assert!(known.contains("--tileable") && known.contains("--azimuth"), "{known:?}");
    for (path, text) in pages().iter().filter(|(path, _)| !path.ends_with("CONTRIBUTING.md")) {
        for line in lines(text) {
            // Commands that do not run are looked at here; the others fail by themselves.
            let code: Vec<&str> = match line {
                Line::Prose(line) => line.split('`').skip(1).step_by(2).collect(),
                Line::Code("text", line) if line.starts_with("btf ") => vec![line],
                Line::Code(..) => continue,
            };
            let ours = code.into_iter().filter(|code| !code.starts_with("cargo "));
            for option in ours.flat_map(options_named) {
                assert!(known.contains(&option), "{}: there is no option {option}", path.display());
            }
        }
    }
}

#[test]
fn every_link_of_a_page_leads_somewhere() {
    let heading = |line: &str| {
        let text = line.trim_start_matches('#').trim().to_lowercase();
        let kept = text.chars().filter(|c| c.is_alphanumeric() || [' ', '-', '_'].contains(c));
        kept.map(|c| if c == ' ' { '-' } else { c }).collect::<String>()
    };
    let mut count = 0;
    for (path, text) in pages() {
        // A link may stand on two lines.
        let prose = |line| if let Line::Prose(prose) = line { prose } else { "" };
        let prose = lines(&text).into_iter().map(prose).collect::<Vec<_>>().join(" ");
        for link in prose.split("](").skip(1) {
            let link = link.split(')').next().unwrap();
            if link.contains("://") {
                continue;
            }
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let target = if file.is_empty() { path.clone() } else { path.parent().unwrap().join(file) };
            assert!(target.exists(), "{}: {link} leads nowhere", path.display());
            if !anchor.is_empty() {
                let there = fs::read_to_string(&target).unwrap();
                let found =
                    there.lines().filter(|line| line.starts_with('#')).any(|line| heading(line) == anchor);
                assert!(found, "{}: {link}: no such heading", path.display());
            }
            count += 1;
        }
    }
    assert!(count > 50, "only {count} links were found");
}

#[test]
fn lines_of_pages_break_at_120() {
    for (path, text) in pages() {
        for line in lines(&text) {
            let (Line::Prose(line) | Line::Code(_, line)) = line;
            let table = line.starts_with('|');
            assert!(table || line.chars().count() <= 120, "{}: a long line: {line}", path.display());
        }
    }
}
