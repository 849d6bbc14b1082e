//! The command line as a whole: commands in groups, a page for each, and completions for shells.

use std::io::Write;
use std::path::{Path, PathBuf};

use btfkit::disk::output::expect_outside_stores;
use btfkit::disk::temporary::write_file;
use btfkit::error::{Error, Result};
use btfkit::text::escaped;
use btfkit::words::counted;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Args, Command, CommandFactory};
use clap_complete::Shell;
use clap_mangen::Man;
use clap_mangen::roff::{Roff, roman};

use super::terminal::{of_output, pieces};
use super::{Cli, Console};

/// Commands by what they are for, in the order of the work.
const GROUPS: [(&str, &[&str]); 8] = [
    ("Try", &["demo", "sample"]),
    ("Convert", &["import", "export"]),
    ("Check", &["info", "check", "verify"]),
    ("Model", &["model", "tile", "cluster", "curve", "normals", "fit", "appearance", "compare"]),
    ("Enlarge", &["enlarge", "judge"]),
    ("Look", &["image", "render", "view"]),
    ("Share work", &["slurm", "status", "missing"]),
    ("Set up", &["completions", "man", "help"]),
];

/// Columns of help where there is no terminal.
const WIDTH: usize = 100;

/// The command line: what the derived one cannot say is added.
pub(super) fn command() -> Command {
    let mut command = Cli::command();
    // Makes the command `help` and gives the global options to all.
    command.build();
    let groups = groups(&command);
    let numbers_may_be_negative = |argument: clap::Arg| {
        let is_option = !argument.is_positional() && argument.get_action().takes_values();
        // A wrong number is then told as a wrong number, not as an option that nobody knows.
        if is_option { argument.allow_negative_numbers(true) } else { argument }
    };
    Cli::command().mut_subcommands(|command| command.mut_args(numbers_may_be_negative)).help_template(
        format!("{{about-with-newline}}\n{{usage-heading}} {{usage}}\n{groups}\n{{options}}{{after-help}}"),
    )
}

/// A refusal of the command line, in words that help where those of the parser do not.
pub(super) fn explained(mut error: clap::Error) -> clap::Error {
    // What would pass a stray negative number on as a name of a file is no way to give one.
    let is_number =
        |value: &ContextValue| matches!(value, ContextValue::String(text) if text.parse::<f64>().is_ok());
    if error.kind() == ErrorKind::UnknownArgument && error.get(ContextKind::InvalidArg).is_some_and(is_number)
    {
        let tip = "a number stands behind the option that it is for, such as --window -500,12345,512,512; with a file of \
                   that name, write ./ before it";
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
        return error;
    }
    // A second name is where most programs have their result.
    let name = match error.get(ContextKind::InvalidArg) {
        Some(ContextValue::String(name)) if !name.starts_with('-') => Some(name.clone()),
        _ => None,
    };
    if let Some(name) = name.filter(|_| error.kind() == ErrorKind::UnknownArgument)
        && error.get(ContextKind::Usage).is_some_and(|usage| usage.to_string().contains("--out <"))
    {
        let out_is_given =
            std::env::args_os().any(|word| word.to_string_lossy().split('=').next() == Some("--out"));
        let tip = match out_is_given {
            true => format!("one store is shown at a time, and --out is given: leave out {}", escaped(&name)),
            false => format!("to write the result there, use --out {}", escaped(&name)),
        };
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
        return error;
    }
    let told = error.render().to_string();
    match told.contains(NO_NUMBER) {
        true => clap::Error::raw(
            error.kind(),
            told.trim_start_matches("error: ").replace(NO_NUMBER, "expected a whole number, 0 or more"),
        ),
        false => error,
    }
}

/// What the standard library says of what is no whole number.
const NO_NUMBER: &str = "invalid digit found in string";

/// The commands by groups, a line or more each.
fn groups(command: &Command) -> String {
    let width = of_output().unwrap_or(WIDTH);
    let mut text = String::new();
    for (group, names) in GROUPS {
        text.push_str(&format!("\n{group}:\n"));
        for name in names {
            let about = command.find_subcommand(name).and_then(Command::get_about);
            let about = about.map(ToString::to_string).unwrap_or_default();
            let room = width.saturating_sub(15).max(20);
            for (number, piece) in pieces(&about, room, room).iter().enumerate() {
                let name = if number == 0 { name } else { "" };
                text.push_str(&format!("  {name:<11}  {piece}\n"));
            }
        }
    }
    text.push_str("\nOptions:");
    text
}

/// Print completions of commands and options for a shell
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf completions bash > ~/.local/share/bash-completion/completions/btf
  btf completions zsh > ~/.zfunc/_btf                 with fpath+=~/.zfunc before compinit in ~/.zshrc
  btf completions fish > ~/.config/fish/completions/btf.fish
  btf completions powershell >> $PROFILE
  btf completions elvish >> ~/.config/elvish/rc.elv")]
pub(super) struct Completions {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

impl Completions {
    pub(super) fn run(&self, console: Console) -> Result<()> {
        let mut text = Vec::new();
        clap_complete::generate(self.shell, &mut command(), "btf", &mut text);
        console.as_it_is(String::from_utf8_lossy(&text).trim_end());
        Ok(())
    }
}

/// Print a manual page, or write all pages into a folder
#[derive(Args)]
#[command(after_help = "\
Examples:
  btf man | man -l -                                  the page of the program
  btf man import | man -l -                           the page of a command
  btf man --out ~/.local/share/man/man1               all pages; then man btf, man btf-import")]
pub(super) struct Manual {
    /// The command whose page to print [default: the program's own page]
    #[arg(conflicts_with = "out", value_name = "COMMAND")]
    page: Option<String>,
    /// Write all pages into a folder: btf.1, btf-import.1 and so on
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl Manual {
    pub(super) fn run(&self, console: Console) -> Result<()> {
        let mut whole = command();
        whole.build();
        if let Some(folder) = &self.out {
            return write_pages(&whole, folder, console);
        }
        let page = match &self.page {
            None => &whole,
            Some(name) => whole.find_subcommand(name).ok_or_else(|| {
                Error::usage(format!("no command is called {name:?}")).hint("btf --help lists them")
            })?,
        };
        console.as_it_is(String::from_utf8_lossy(&rendered(page)?).trim_end());
        Ok(())
    }
}

fn write_pages(whole: &Command, folder: &Path, console: Console) -> Result<()> {
    // Of a folder's parent the rest is known.
    expect_outside_stores(&folder.join("btf.1"))?;
    std::fs::create_dir_all(folder).map_err(|error| Error::io("make", folder, error))?;
    let commands: Vec<&Command> = std::iter::once(whole)
        .chain(whole.get_subcommands().filter(|command| command.get_name() != "help"))
        .collect();
    for command in &commands {
        write_file(&folder.join(format!("{}.1", page_name(command))), &rendered(command)?)?;
    }
    console.line(format!("{}: {}", folder.display(), counted(commands.len(), "page")));
    Ok(())
}

/// `btf-import`.
fn page_name(command: &Command) -> String {
    command.get_display_name().unwrap_or(command.get_name()).to_owned()
}

/// A page in roff. Examples keep their lines.
fn rendered(command: &Command) -> Result<Vec<u8>> {
    let name = page_name(command);
    // A page of a command is called by the name that `man` is asked for.
    let man = Man::new(command.clone()).title(name).date("");
    let mut page = Vec::new();
    let failed = |error: std::io::Error| Error::internal(format!("cannot render a manual page: {error}"));
    man.render_title(&mut page).map_err(failed)?;
    man.render_name_section(&mut page).map_err(failed)?;
    man.render_synopsis_section(&mut page).map_err(failed)?;
    man.render_description_section(&mut page).map_err(failed)?;
    man.render_options_section(&mut page).map_err(failed)?;
    if command.get_subcommands().next().is_some() {
        man.render_subcommands_section(&mut page).map_err(failed)?;
    }
    if let Some(text) = command.get_after_help() {
        let mut roff = Roff::new();
        roff.control("SH", ["EXAMPLES AND NOTES"]);
        roff.control("nf", []);
        for line in text.to_string().lines() {
            roff.text([roman(line)]);
        }
        roff.control("fi", []);
        roff.to_writer(&mut page).map_err(failed)?;
    }
    page.flush().map_err(failed)?;
    Ok(page)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn the_command_line_contradicts_itself_nowhere() {
        command().debug_assert();
    }

    #[test]
    fn every_command_is_in_one_group_and_has_an_example() {
        let mut whole = Cli::command();
        whole.build();
        let mut grouped: Vec<&str> = GROUPS.iter().flat_map(|(_, names)| names.iter().copied()).collect();
        let mut all: Vec<&str> = whole.get_subcommands().map(Command::get_name).collect();
        grouped.sort_unstable();
        all.sort_unstable();
        assert_eq!(grouped, all);
        for command in whole.get_subcommands().filter(|command| command.get_name() != "help") {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            let example = format!("\n  btf {}", command.get_name());
            assert!(
                help.starts_with("Example") || help.contains("\nExample"),
                "{}: {help}",
                command.get_name()
            );
            assert!(help.contains(&example), "{}", command.get_name());
        }
    }

    #[test]
    fn a_page_says_everything_and_keeps_the_lines_of_examples() {
        let mut whole = command();
        whole.build();
        for command in whole.get_subcommands().filter(|command| command.get_name() != "help") {
            let page = String::from_utf8(rendered(command).unwrap()).unwrap();
            for part in [".TH btf-", ".SH NAME", ".SH SYNOPSIS", ".SH OPTIONS", ".nf\nExample"] {
                let found = page.contains(part) || (part == ".nf\nExample" && page.contains("\nExample"));
                assert!(found, "{}: {part}\n{page}", command.get_name());
            }
        }
    }
}
