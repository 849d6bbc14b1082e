//! One command over many inputs: a line each, failures told when they happen while the rest goes on, and a count at
//! the end.

use btfkit::error::{Error, ErrorKind, Result};
use btfkit::run::Context;
use serde_json::{Map, Value, json};

use super::Console;

/// How a command ended whose failures have been told as they happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ended {
    Done,
    /// What the worst failure was.
    Failed(ErrorKind),
}

/// What is told of an input.
pub(super) enum Line {
    /// Behind its name.
    Text(String),
    /// Beside its path, as one line.
    Json(Value),
}

/// An input that was worked on: its line, and what is wrong with it.
pub(super) type Outcome = (Line, Option<Error>);

/// Works on one input after another. A failure is told and the next one goes on; only a stop ends the work early.
///
/// `as_json` says how the failures of inputs are told that have no line of their own.
///
/// # Errors
/// [`ErrorKind::Stopped`] alone; what became of the inputs before it has been told.
pub(super) fn each<I>(
    inputs: &[I],
    name: impl Fn(&I) -> String,
    as_json: bool,
    context: &Context<'_>,
    console: Console,
    mut work: impl FnMut(&I) -> Result<Outcome>,
) -> Result<Ended> {
    let mut failed: Vec<String> = Vec::new();
    let mut worst: Option<ErrorKind> = None;
    for (number, input) in inputs.iter().enumerate() {
        let name = name(input);
        let stopped = |error: Error| {
            console.count(as_json, &format!("{}, stopped before {name}", count(number, &failed)));
            Err(error)
        };
        if let Err(error) = context.check_stop() {
            return stopped(error);
        }
        let (line, error) = match work(input) {
            Ok((line, error)) => (Some(line), error),
            Err(error) if error.kind() == ErrorKind::Stopped => return stopped(error),
            Err(error) => (None, Some(error)),
        };
        context.progress.pause(&mut || {
            match (&line, &error) {
                (Some(Line::Text(text)), None) => console.line(format!("{name}: {text}")),
                (Some(Line::Json(value)), _) => {
                    console.json_line(&of_json(&name, Some(value), error.as_ref()));
                }
                (None, Some(_)) if as_json => console.json_line(&of_json(&name, None, error.as_ref())),
                _ => {}
            }
            if let Some(error) = &error {
                console.failure(Some(&name), error);
            }
        });
        if let Some(error) = error {
            worst = Some(worst.map_or(error.kind(), |kind| worse(kind, error.kind())));
            failed.push(name);
        }
    }
    context.progress.end();
    console.count(as_json, &count(inputs.len(), &failed));
    Ok(worst.map_or(Ended::Done, Ended::Failed))
}

/// `11 done, 1 failed: wood.zarr`, of so many that were worked on.
fn count(worked_on: usize, failed: &[String]) -> String {
    let done = format!("{} done", worked_on - failed.len());
    if failed.is_empty() { done } else { format!("{done}, {} failed: {}", failed.len(), failed.join(", ")) }
}

/// The line of an input as JSON: what is known of it, and what is wrong.
fn of_json(name: &str, value: Option<&Value>, error: Option<&Error>) -> Value {
    let mut line = Map::new();
    line.insert("path".to_owned(), json!(name));
    match value {
        Some(Value::Object(entries)) => line.extend(entries.clone()),
        Some(value) => drop(line.insert("report".to_owned(), value.clone())),
        None => {}
    }
    if let Some(error) = error {
        line.insert("error".to_owned(), json!(error.to_string()));
        line.insert("advice".to_owned(), json!(error.guidance()));
    }
    Value::Object(line)
}

/// Of two kinds of failure the one that a caller has to know of: trouble with the machine or the program comes before
/// trouble with an input, and that before what was not meant or is not there.
fn worse(a: ErrorKind, b: ErrorKind) -> ErrorKind {
    const ORDER: [ErrorKind; 7] = [
        ErrorKind::Usage,
        ErrorKind::Missing,
        ErrorKind::Recipe,
        ErrorKind::Input,
        ErrorKind::Io,
        ErrorKind::Internal,
        ErrorKind::Stopped,
    ];
    let place = |kind: ErrorKind| ORDER.iter().position(|&other| other == kind);
    if place(a) >= place(b) { a } else { b }
}
