//! What was asked for: arguments in, stages run, results told, errors turned into exit codes.

mod appearance;
mod bytes;
mod check;
mod cluster;
mod compare;
mod components;
mod curve;
mod deepzoom;
mod demo;
mod each;
mod enlarge;
mod export;
mod fit;
mod given;
mod help;
mod image;
mod import;
mod info;
mod judge;
mod location;
mod model;
mod normals;
mod number;
mod outputs;
mod pack;
mod progress;
mod render;
mod sample;
mod scene;
mod sharing;
mod slurm;
mod source;
mod status;
mod table;
mod terminal;
mod tile;
mod verify;
mod view;

use std::io::{IsTerminal, Write};
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use btfkit::disk::output::Made;
use btfkit::error::{Error, ErrorKind, Result};
use btfkit::run::budget::{Allowance, cannot_start, expect_stack, return_large_buffers, spare_address_space};
use btfkit::run::progress::{Progress, Silent};
use btfkit::run::{Context, Existing};
use btfkit::text::{escaped, escaped_json, escaped_lines};
use bytes::{bytes_text, part_text};
use clap::{Args, FromArgMatches, Parser, Subcommand, ValueEnum};
use each::Ended;
use given::Given;
use serde_json::Value;

const EXAMPLES: &str = "\
Examples:
  btf demo                                      run the whole method on a synthetic material, with pictures
  btf import UBO_WOOD256.zip wood.zarr          make a store of an archive
  btf model wood.zarr wood.model.zarr           make a model of the store
  btf enlarge wood.model.zarr big.zarr --size 4096x4096
  btf image big.zarr --light 15,0 --view 0,0 --out big.png
Each command has its own help: btf import --help, or man btf-import (see btf man --help).

Exit codes: 0 done; 1 failed; 2 wrong usage; 65 damaged input, or something else has the name of the result;
66 input not there yet; 74 the system refuses to read or write; 75 stopped on request (run the same command again).
The book is in docs/; docs/README.md says where to begin.";

/// Why something could not be written to standard output: the program must not end as if it had been told.
static UNTOLD: OnceLock<std::io::Error> = OnceLock::new();

/// The version, and the commit that the program was built from.
const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), " (", env!("BTF_COMMIT"), ")");
/// More threads than any machine has cores that share a memory.
const MOST_THREADS: i64 = 1024;

/// Turns a measured BTF (bidirectional texture function) into a small model, and the model into surfaces of any size.
#[derive(Parser)]
#[command(name = "btf", version = VERSION, after_help = EXAMPLES, subcommand_help_heading = "Commands")]
struct Cli {
    #[command(flatten)]
    common: Common,
    #[command(subcommand)]
    command: Command,
}

#[derive(Args)]
#[command(next_help_heading = "Common options")]
struct Common {
    /// Threads to use, from 1 to 1024 [default: all cores]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MOST_THREADS))]
    #[arg(allow_negative_numbers = true)]
    threads: Option<u32>,
    /// Memory to use, such as 512MiB, 1.5GiB or 2GB
    #[arg(long, global = true, default_value = "2GiB", value_parser = bytes::parse_bytes, value_name = "SIZE")]
    #[arg(allow_hyphen_values = true)]
    memory: u64,
    /// How to show progress
    #[arg(long, global = true, value_enum, default_value = "auto")]
    progress: ProgressStyle,
    /// Replace results that exist, also those made with other options. Without it, nothing that exists is ever replaced
    #[arg(long, global = true)]
    force: bool,
    /// Print nothing but errors
    #[arg(long, short, global = true)]
    quiet: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ProgressStyle {
    /// Bars on a terminal; elsewhere a line every half minute.
    Auto,
    /// One JSON object per line on standard error, for schedulers; errors too.
    Json,
    /// Nothing.
    None,
}

#[derive(Subcommand)]
enum Command {
    Demo(demo::Demo),
    Sample(sample::Sample),
    Info(info::Info),
    Check(check::Check),
    Import(import::Import),
    Verify(verify::Verify),
    Export(export::Export),
    Model(model::Model),
    Tile(tile::Tile),
    Cluster(cluster::Cluster),
    Curve(curve::Curve),
    Normals(normals::Normals),
    Fit(fit::Fit),
    Appearance(appearance::Appearance),
    Components(components::Components),
    Pack(pack::Pack),
    Unpack(pack::Unpack),
    Compare(compare::Compare),
    Enlarge(enlarge::Enlarge),
    Image(image::Image),
    Render(render::Render),
    View(view::View),
    Judge(judge::Judge),
    Status(status::StatusOf),
    Missing(status::Missing),
    Slurm(slurm::Slurm),
    Completions(help::Completions),
    Man(help::Manual),
}

/// Runs the program.
pub(crate) fn run() -> ExitCode {
    let arguments = match expect_stack().and_then(|()| location::arguments(std::env::args_os())) {
        Ok(arguments) => arguments,
        Err(error) => {
            Console { quiet: false, found: false, brief: false, json: false }.failure(None, &error);
            return ExitCode::from(exit_code(error.kind()));
        }
    };
    let matches = help::command().try_get_matches_from(arguments);
    let cli = matches.and_then(|matches| Ok((Cli::from_arg_matches(&matches)?, Given::of(&matches))));
    let (cli, given) = cli.unwrap_or_else(|error| help::explained(error).exit());
    let threads = cli.common.threads.map_or_else(
        || std::thread::available_parallelism().map_or(1, usize::from),
        |threads| threads as usize,
    );
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        let _ = signal_hook::flag::register_conditional_shutdown(signal, 75, Arc::clone(&stop));
        let _ = signal_hook::flag::register(signal, Arc::clone(&stop));
    }
    explain_ends(cli.common.progress == ProgressStyle::Json);
    // A file that grows beyond its limit is an error of writing, as others are, and no reason to end at once.
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
    let progress: Box<dyn Progress> = match cli.common.progress {
        _ if cli.common.quiet => Box::new(Silent),
        ProgressStyle::None => Box::new(Silent),
        ProgressStyle::Json => Box::new(progress::Lines::default()),
        ProgressStyle::Auto if std::io::stderr().is_terminal() => Box::new(progress::Bars::default()),
        ProgressStyle::Auto => Box::new(progress::Plain::default()),
    };
    let console = Console {
        quiet: cli.common.quiet,
        found: false,
        brief: false,
        json: cli.common.progress == ProgressStyle::Json,
    };
    let memory = Allowance::new(cli.common.memory);
    return_large_buffers();
    if memory.by_system {
        spare_address_space();
    }
    // zarrs decodes chunks on the global pool.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    let result = pool
        .map_err(|error| cannot_start(threads, &error))
        .and_then(|()| Context::new(progress.as_ref(), &stop, threads, memory.bytes))
        .map(|context| {
            let context = context.with_memory(memory);
            context.with_existing(if cli.common.force { Existing::Replace } else { Existing::Keep })
        })
        .inspect(|context| obey_while_computing(&stop, context.computing(), console, cli.command.goes_on()))
        .and_then(|context| {
            // The others say themselves what they need, all of it at once.
            if !cli.command.says_what_it_needs() {
                context.require("the program itself", 0)?;
            }
            cli.command.run(&given, &context, console)
        });
    progress.end();
    let result = result.and_then(|ended| match UNTOLD.get() {
        Some(error) => {
            Err(Error::io("write", Path::new("standard output"), std::io::Error::from(error.kind())))
        }
        None => Ok(ended),
    });
    match result {
        Ok(Ended::Done) => ExitCode::SUCCESS,
        Ok(Ended::Failed(kind)) => ExitCode::from(exit_code(kind)),
        Err(error) => {
            let error =
                if error.kind() == ErrorKind::Stopped { stopped(cli.command.goes_on()) } else { error };
            console.failure(None, &error);
            ExitCode::from(exit_code(error.kind()))
        }
    }
}

/// What a stop means: a command that keeps nothing of what it did does not go on.
fn stopped(goes_on: bool) -> Error {
    match goes_on {
        true => Error::stopped(),
        false => Error::stopped().hint("nothing was left behind: the same command begins from the start"),
    }
}

/// A signal that ends the program where it stands, as an error of ours.
struct End {
    signal: i32,
    exit_code: i32,
    message: &'static str,
    advice: &'static str,
}

/// A failed allocation ends in an abort. Pages of a mapped file that another process has cut, or whose disk fails, are
/// not there when they are read. With an exit code of ours schedulers need not take either for a bug that leaves a core.
const ENDS: [End; 2] = [
    End {
        signal: signal_hook::consts::SIGABRT,
        exit_code: 1,
        message: "ended early, most likely since the system gives no more memory",
        advice: "raise its limit (ulimit -v, or that of the container), or choose fewer --threads or a smaller --memory",
    },
    End {
        signal: signal_hook::consts::SIGBUS,
        exit_code: 74,
        message: "a file could not be read on: it was cut while it was read, or its disk failed",
        advice: "see that nothing else writes to the files that were read, and run the command again: it goes on",
    },
];

/// Tells how the program ends by [`ENDS`]; what is left lies in temporary files and is swept.
#[allow(unsafe_code)]
fn explain_ends(json: bool) {
    for End { signal, exit_code, message, advice } in ENDS {
        let told = if json {
            let line = serde_json::json!({
                "event": "error", "exit_code": exit_code, "message": message, "advice": advice,
            });
            format!("{line}\n")
        } else {
            format!("btf: {message}\n  {advice}\n")
        };
        let explain = move || {
            let _ = std::io::stderr().write_all(told.as_bytes());
            signal_hook::low_level::exit(exit_code);
        };
        // SAFETY: standard error has no buffer, so that nothing is allocated; whoever else holds it goes on and
        // releases it.
        let _ = unsafe { signal_hook::low_level::register(signal, explain) };
    }
}

/// Time between two looks at whether a stop was asked for.
const LOOK: Duration = Duration::from_millis(50);

/// Ends the program at the first signal while it computes what cannot look for one: there is nothing to lose but time.
fn obey_while_computing(stop: &Arc<AtomicBool>, computing: Arc<AtomicBool>, console: Console, goes_on: bool) {
    let stop = Arc::clone(stop);
    // Without a thread for it the second signal ends the program.
    let _ = std::thread::Builder::new().name("signals".to_owned()).spawn(move || {
        loop {
            std::thread::sleep(LOOK);
            if stop.load(Ordering::SeqCst) && computing.load(Ordering::SeqCst) {
                let error = stopped(goes_on);
                console.failure(None, &error);
                std::process::exit(i32::from(exit_code(error.kind())));
            }
        }
    });
}

impl Command {
    /// Whether the command checks the memory for its work, the program's own included.
    fn says_what_it_needs(&self) -> bool {
        !matches!(
            self,
            Self::Demo(_)
                | Self::Info(_)
                | Self::Judge(_)
                | Self::Appearance(_)
                | Self::Status(_)
                | Self::Missing(_)
                | Self::Completions(_)
                | Self::Man(_)
        )
    }

    /// Whether the same command goes on where it was stopped.
    fn goes_on(&self) -> bool {
        match self {
            Self::Import(_) | Self::Model(_) | Self::Cluster(_) | Self::Enlarge(_) | Self::Demo(_) => true,
            Self::Export(command) => command.goes_on(),
            Self::Compare(command) => command.goes_on(),
            Self::Judge(command) => command.goes_on(),
            _ => false,
        }
    }

    fn run(&self, given: &Given, context: &Context<'_>, console: Console) -> Result<Ended> {
        let single = match self {
            Self::Info(command) => return command.run(given, context, console),
            Self::Check(command) => return command.run(given, context, console),
            Self::Import(command) => return command.run(context, console),
            Self::Verify(command) => return command.run(given, context, console),
            Self::Status(command) => return command.run(context, console),
            Self::Missing(command) => command.run(console),
            Self::Slurm(command) => command.run(context, console),
            Self::Model(command) => return command.run(context, console),
            Self::Enlarge(command) => return command.run(given, context, console),
            Self::Demo(command) => command.run(context, console),
            Self::Sample(command) => command.run(context, console),
            Self::Export(command) => command.run(given, context, console),
            Self::Tile(command) => command.run(context, console),
            Self::Cluster(command) => command.run(given, context, console),
            Self::Curve(command) => command.run(context, console),
            Self::Normals(command) => command.run(context, console),
            Self::Fit(command) => command.run(context, console),
            Self::Appearance(command) => command.run(context, console),
            Self::Components(command) => command.run(context, console),
            Self::Pack(command) => command.run(context, console),
            Self::Unpack(command) => command.run(context, console),
            Self::Compare(command) => command.run(context, console),
            Self::Image(command) => command.run(given, context, console),
            Self::Render(command) => command.run(given, context, console),
            Self::View(command) => command.run(context, console),
            Self::Judge(command) => command.run(context, console),
            Self::Completions(command) => command.run(console),
            Self::Man(command) => command.run(console),
        };
        single.map(|()| Ended::Done)
    }
}

fn exit_code(kind: ErrorKind) -> u8 {
    match kind {
        ErrorKind::Internal => 1,
        ErrorKind::Usage => 2,
        ErrorKind::Input | ErrorKind::Recipe => 65,
        ErrorKind::Missing => 66,
        ErrorKind::Io => 74,
        ErrorKind::Stopped => 75,
    }
}

/// Where results are told.
#[derive(Clone, Copy)]
struct Console {
    quiet: bool,
    /// What is told was found done.
    found: bool,
    /// Of each stage one line is told, and what a user should know.
    brief: bool,
    /// Errors are told as JSON, as progress is.
    json: bool,
}

impl Console {
    /// Tells nothing but failures.
    fn silent(self) -> Self {
        Self { quiet: true, ..self }
    }

    /// Tells a stage as one that was found done, if it was.
    fn found(self, found: bool) -> Self {
        Self { found, ..self }
    }

    /// Tells one line of each stage.
    fn brief(self) -> Self {
        Self { brief: true, ..self }
    }

    /// The first line of what is told of a stage.
    fn stage(self, label: &str, text: &str) {
        let found = if self.found { "found done: " } else { "" };
        self.line(format!("{label:<9} {found}{text}"));
    }

    /// One line. Whatever it names cannot end it, or change what the terminal shows.
    fn line(self, text: impl std::fmt::Display) {
        self.print(&escaped(&text.to_string()));
    }

    /// What a user should know of a result, a line each.
    fn notes(self, notes: &[String]) {
        notes.iter().for_each(|note| self.line(format!("note: {note}")));
    }

    /// Lines, of a table say, whose cells are escaped already.
    fn text(self, text: &str) {
        self.print(&escaped_lines(text));
    }

    fn print(self, text: &str) {
        if !self.quiet {
            self.as_it_is(&terminal::wrapped(text, terminal::of_output()));
        }
    }

    /// A line that programs read: it is never wrapped.
    fn as_it_is(self, text: &str) {
        if !self.quiet {
            let mut output = std::io::stdout();
            match writeln!(output, "{text}").and_then(|()| output.flush()) {
                // A closed pipe (`btf info x | head -1`) is no failure.
                Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => drop(UNTOLD.set(error)),
                _ => {}
            }
        }
    }

    /// An error: of one of many inputs by its name, unless the message begins with it.
    fn failure(self, name: Option<&str>, error: &Error) {
        let mut text = error.to_string();
        if let Some(name) = name.filter(|name| !text.starts_with(*name)) {
            text = format!("{name}: {text}");
        }
        if self.json {
            let line = serde_json::json!({
                "event": "error", "exit_code": exit_code(error.kind()), "message": text, "advice": error.guidance(),
            });
            let _ = writeln!(std::io::stderr(), "{}", escaped_json(&line.to_string()));
            return;
        }
        let hint = error.guidance().map(|hint| format!("\n  {hint}")).unwrap_or_default();
        let told = format!("btf: {text}{hint}");
        let text = terminal::wrapped(&escaped_lines(&told), terminal::of_errors());
        let _ = writeln!(std::io::stderr(), "{text}");
    }

    /// The last line of many; beside JSON on standard error.
    fn count(self, beside_json: bool, text: &str) {
        match beside_json {
            true if self.json && !self.quiet => {
                let line = serde_json::json!({"event": "count", "text": text});
                drop(writeln!(std::io::stderr(), "{}", escaped_json(&line.to_string())));
            }
            true if !self.quiet => drop(writeln!(std::io::stderr(), "btf: {}", escaped(text))),
            _ => self.line(text),
        }
    }

    /// JSON as one line.
    fn json_line(self, value: &Value) {
        self.as_it_is(&escaped_json(&value.to_string()));
    }

    fn plan(self, summary: &Value) -> Result<()> {
        let text =
            serde_json::to_string_pretty(summary).map_err(|error| Error::internal(error.to_string()))?;
        self.as_it_is(&escaped_json(&text));
        Ok(())
    }
}

/// A report as JSON.
fn as_json(report: &impl serde::Serialize) -> Result<Value> {
    serde_json::to_value(report).map_err(|error| Error::internal(error.to_string()))
}

/// What a line about a result ends with.
fn found(made: Made) -> &'static str {
    match made {
        Made::Written => "",
        Made::Found => ", found done",
    }
}

#[cfg(test)]
#[path = "../../tests/behaviour/option_effects.rs"]
#[allow(dead_code)] // the behaviour tests read the rest
mod option_effects;

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::collections::BTreeSet;

    use clap::CommandFactory;

    use super::option_effects::{COMMON, Effect, OUTPUTS, READING, RECIPES, Shown, WITHOUT};
    use super::*;

    #[test]
    fn a_stop_says_whether_the_command_goes_on_or_begins_anew() {
        let told = |line: &str| {
            let cli = Cli::try_parse_from(line.split(' ')).unwrap();
            stopped(cli.command.goes_on()).guidance().unwrap().to_owned()
        };
        for line in ["btf import a", "btf model a", "btf enlarge a --size 9x9", "btf export a a.dzi"] {
            assert!(told(line).contains("to go on"), "{line}: {}", told(line));
        }
        for line in ["btf export a a.btf --rank 2", "btf image a --out b.png", "btf judge a --against b"] {
            assert!(told(line).contains("begins from the start"), "{line}: {}", told(line));
        }
    }

    /// An option that is not in the table of effects may be forgotten in a recipe: so it does not pass.
    #[test]
    fn of_every_option_it_is_said_whether_the_result_depends_on_it() {
        let own = |name: &str| {
            name != "help" && name != "version" && !COMMON.iter().any(|(common, _)| *common == name)
        };
        let common: BTreeSet<String> =
            Cli::command().get_arguments().map(|a| a.get_id().to_string()).collect();
        for (name, _) in COMMON {
            assert!(common.contains(*name), "--{name} is no option of all commands");
        }
        assert!(
            common.iter().all(|name| !own(name)),
            "an option of all commands is not in the table: {common:?}"
        );
        for command in Cli::command().get_subcommands() {
            let name = command.get_name();
            if WITHOUT.contains(&name) {
                continue;
            }
            let recipes = RECIPES.iter().filter(|of| of.command == name).flat_map(|of| of.options);
            let outputs = OUTPUTS.iter().filter(|of| of.command == name).flat_map(|of| of.options);
            let reads = OUTPUTS.iter().any(|of| of.command == name && of.reads);
            let reading = if reads { READING } else { &[] };
            let told: BTreeSet<&str> = recipes
                .map(|(option, _)| *option)
                .chain(outputs.map(|(option, _)| *option))
                .chain(reading.iter().copied())
                .collect();
            let found: BTreeSet<&str> =
                command.get_arguments().map(|a| a.get_id().as_str()).filter(|option| own(option)).collect();
            assert_eq!(found, told, "options of btf {name} and their entries in option_effects.rs");
        }
        let reasons = RECIPES.iter().flat_map(|of| of.options).filter_map(|(_, effect)| match effect {
            Effect::Apart(reason) => Some(*reason),
            Effect::Changes(arguments) | Effect::Keeps(arguments) => arguments.first().copied(),
        });
        let unseen = OUTPUTS.iter().flat_map(|of| of.options).filter_map(|(_, shown)| match shown {
            Shown::Unseen(reason) => Some(*reason),
            Shown::Shows(arguments, _) => arguments.first().copied(),
        });
        assert!(
            reasons
                .chain(unseen)
                .chain(COMMON.iter().map(|(_, reason)| *reason))
                .all(|reason| !reason.is_empty())
        );
    }
}
