//! Progress for people (bars with rate and time left) and for schedulers (JSON lines).

use std::io::Write;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use btfkit::run::progress::{Counted, Progress, Stage};
use btfkit::text::{escaped, escaped_json};
use indicatif::{ProgressBar, ProgressState, ProgressStyle};

/// Least time between two JSON lines.
const LINE_INTERVAL: Duration = Duration::from_secs(1);

/// Least time between two lines for people, and before the first one.
const PLAIN_INTERVAL: Duration = Duration::from_secs(30);

/// Stages of one name that follow each other, as the passes of one computation do: what one takes, the next takes too.
#[derive(Default)]
struct Alike(Mutex<Option<(Stage, Instant)>>);

impl Alike {
    /// Takes note of a stage that begins; seconds that are left for it and all that follow, if that can be told.
    fn left(&self, stage: Stage) -> Option<f64> {
        let mut first = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match *first {
            Some((begun, at))
                if begun.name == stage.name && begun.of == stage.of && begun.number < stage.number =>
            {
                Some(rest(at.elapsed().as_secs_f64(), begun, stage))
            }
            _ => {
                *first = Some((stage, Instant::now()));
                None
            }
        }
    }
}

/// Seconds that a stage and those after it take, where those from `begun` on took `elapsed`.
fn rest(elapsed: f64, begun: Stage, stage: Stage) -> f64 {
    let done = stage.number.saturating_sub(begun.number).max(1);
    elapsed / done as f64 * (stage.of + 1).saturating_sub(stage.number) as f64
}

/// A time for people: `50 s`, `4 min`.
fn duration(seconds: f64) -> String {
    if seconds < 100.0 { format!("{seconds:.0} s") } else { format!("{:.0} min", seconds / 60.0) }
}

/// `stage 2 of 18: factorise, about 4 min left in all`.
fn with_left(stage: Stage, left: Option<f64>) -> String {
    let left = left.map_or(String::new(), |left| format!(", about {} left in all", duration(left)));
    format!("{stage}{left}")
}

/// A bar on the terminal for the step under way.
#[derive(Default)]
pub(super) struct Bars {
    bar: Mutex<Option<ProgressBar>>,
    stage: Mutex<Option<(Stage, String)>>,
    alike: Alike,
}

impl Bars {
    fn with(&self, act: impl FnOnce(&ProgressBar)) {
        if let Some(bar) = &*self.bar.lock().unwrap_or_else(PoisonError::into_inner) {
            act(bar);
        }
    }

    fn show(&self, bar: ProgressBar) {
        bar.enable_steady_tick(Duration::from_millis(200));
        *self.bar.lock().unwrap_or_else(PoisonError::into_inner) = Some(bar);
    }
}

impl Progress for Bars {
    fn begin(&self, title: &str, total: u64, counted: Counted) {
        let template = match counted {
            Counted::Items(_) => {
                "{prefix:>20} {bar:32} {human_pos}/{human_len} ({rate}, {eta} left) {wide_msg}"
            }
            Counted::Bytes => {
                "{prefix:>20} {bar:32} {bytes}/{total_bytes} ({bytes_per_sec}, {eta} left) {wide_msg}"
            }
        };
        let stage = self.stage.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let prefix = match stage {
            Some((stage, told)) if stage.name == title => told,
            Some((_, told)) => format!("{told}, {title}"),
            None => title.to_owned(),
        };
        self.end();
        let bar = ProgressBar::new(total).with_prefix(escaped(&prefix).into_owned());
        let rate = |state: &ProgressState, to: &mut dyn std::fmt::Write| {
            let _ = write!(to, "{:.0}/s", state.per_sec());
        };
        let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        bar.set_style(style.with_key("rate", rate));
        if let Counted::Items(name) = counted {
            bar.set_message(name);
        }
        self.show(bar);
    }

    fn stage(&self, stage: Option<Stage>) {
        self.end();
        let told = stage.map(|stage| (stage, with_left(stage, self.alike.left(stage))));
        self.stage.lock().unwrap_or_else(PoisonError::into_inner).clone_from(&told);
        // Until its first step begins, and where it has none.
        let Some((_, told)) = told else { return };
        let style = ProgressStyle::with_template("{prefix} {spinner}");
        let style = style.unwrap_or_else(|_| ProgressStyle::default_spinner());
        self.show(ProgressBar::new_spinner().with_style(style).with_prefix(told));
    }

    fn advance(&self, count: u64) {
        self.with(|bar| bar.inc(count));
    }

    fn remark(&self, text: &str) {
        self.with(|bar| bar.set_message(escaped(text).into_owned()));
    }

    fn end(&self) {
        if let Some(bar) = self.bar.lock().unwrap_or_else(PoisonError::into_inner).take() {
            bar.finish_and_clear();
        }
    }

    fn notice(&self, text: &str) {
        self.pause(&mut || {
            let _ = writeln!(std::io::stderr(), "btf: {}", escaped(text));
        });
    }

    fn pause(&self, act: &mut dyn FnMut()) {
        match &*self.bar.lock().unwrap_or_else(PoisonError::into_inner) {
            Some(bar) => bar.suspend(act),
            None => act(),
        }
    }
}

/// Lines for people where standard error is no terminal, in a log say: how far the step under way is, every half minute.
/// What ends sooner tells nothing.
#[derive(Default)]
pub(super) struct Plain {
    step: Mutex<Option<Step>>,
    stage: Mutex<Option<Stage>>,
    alike: Alike,
    left: Mutex<Option<f64>>,
    told: Mutex<Option<Instant>>,
}

impl Plain {
    /// Tells the step under way, unless a line was told just now.
    fn tell(&self) {
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        if told.get_or_insert_with(Instant::now).elapsed() < PLAIN_INTERVAL {
            return;
        }
        *told = Some(Instant::now());
        if let Some(step) = &*self.step.lock().unwrap_or_else(PoisonError::into_inner) {
            let left = *self.left.lock().unwrap_or_else(PoisonError::into_inner);
            let left = left.map_or(String::new(), |left| format!("; about {} left in all", duration(left)));
            let _ = writeln!(std::io::stderr(), "btf: {}{left}", escaped(&step.in_words()));
        }
    }
}

impl Progress for Plain {
    fn begin(&self, title: &str, total: u64, counted: Counted) {
        let stage = *self.stage.lock().unwrap_or_else(PoisonError::into_inner);
        *self.step.lock().unwrap_or_else(PoisonError::into_inner) =
            Some(Step::new(title, total, counted, stage));
        self.tell();
    }

    fn advance(&self, count: u64) {
        if let Some(step) = &mut *self.step.lock().unwrap_or_else(PoisonError::into_inner) {
            step.done += count;
        }
        self.tell();
    }

    fn remark(&self, text: &str) {
        if let Some(step) = &mut *self.step.lock().unwrap_or_else(PoisonError::into_inner) {
            step.remark = Some(text.to_owned());
        }
    }

    fn end(&self) {
        *self.step.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }

    fn stage(&self, stage: Option<Stage>) {
        *self.left.lock().unwrap_or_else(PoisonError::into_inner) =
            stage.and_then(|stage| self.alike.left(stage));
        *self.stage.lock().unwrap_or_else(PoisonError::into_inner) = stage;
    }

    fn notice(&self, text: &str) {
        let _ = writeln!(std::io::stderr(), "btf: {}", escaped(text));
    }
}

/// A JSON object a line on standard error: when a step begins, about once a second, and when it ends.
#[derive(Default)]
pub(super) struct Lines {
    step: Mutex<Option<Step>>,
    stage: Mutex<Option<Stage>>,
}

struct Step {
    title: String,
    unit: &'static str,
    done: u64,
    total: u64,
    began: Instant,
    told: Instant,
    remark: Option<String>,
    stage: Option<Stage>,
}

impl Step {
    fn new(title: &str, total: u64, counted: Counted, stage: Option<Stage>) -> Self {
        let unit = match counted {
            Counted::Items(name) => name,
            Counted::Bytes => "bytes",
        };
        let now = Instant::now();
        Self { title: title.to_owned(), unit, done: 0, total, began: now, told: now, remark: None, stage }
    }

    /// Seconds since it began, counts in a second, and seconds left where that can be told.
    fn pace(&self) -> (f64, f64, Option<f64>) {
        let seconds = self.began.elapsed().as_secs_f64();
        let rate = self.done as f64 / seconds.max(1e-9);
        let left = (self.done > 0).then(|| self.total.saturating_sub(self.done) as f64 / rate);
        (seconds, rate, left)
    }

    /// `stage 2 of 18: factorise, export: 40 of 81 views, 12 s left`.
    fn in_words(&self) -> String {
        let stage = match self.stage {
            Some(stage) if stage.name == self.title => stage.to_string(),
            Some(stage) => format!("{stage}, {}", self.title),
            None => self.title.clone(),
        };
        let left = self.pace().2.map_or(String::new(), |left| format!(", {left:.0} s left"));
        let remark = self.remark.as_ref().map_or(String::new(), |remark| format!(", {remark}"));
        format!("{stage}: {} of {} {}{left}{remark}", self.done, self.total, self.unit)
    }

    fn tell(&self, event: &str) {
        let (seconds, rate, left) = self.pace();
        let line = serde_json::json!({
            "event": event, "step": self.title, "done": self.done, "total": self.total, "unit": self.unit,
            "seconds": seconds, "per_second": rate, "seconds_left": left, "remark": self.remark,
            "stage": self.stage.map(as_json),
        });
        write_line(&line);
    }
}

fn write_line(line: &serde_json::Value) {
    let _ = writeln!(std::io::stderr(), "{}", escaped_json(&line.to_string()));
}

fn as_json(stage: Stage) -> serde_json::Value {
    serde_json::json!({"number": stage.number, "of": stage.of, "name": stage.name})
}

impl Progress for Lines {
    fn begin(&self, title: &str, total: u64, counted: Counted) {
        let stage = *self.stage.lock().unwrap_or_else(PoisonError::into_inner);
        let step = Step::new(title, total, counted, stage);
        step.tell("begin");
        *self.step.lock().unwrap_or_else(PoisonError::into_inner) = Some(step);
    }

    fn advance(&self, count: u64) {
        if let Some(step) = &mut *self.step.lock().unwrap_or_else(PoisonError::into_inner) {
            step.done += count;
            if step.told.elapsed() >= LINE_INTERVAL {
                step.told = Instant::now();
                step.tell("progress");
            }
        }
    }

    fn remark(&self, text: &str) {
        if let Some(step) = &mut *self.step.lock().unwrap_or_else(PoisonError::into_inner) {
            step.remark = Some(text.to_owned());
        }
    }

    fn end(&self) {
        if let Some(step) = self.step.lock().unwrap_or_else(PoisonError::into_inner).take() {
            step.tell("end");
        }
    }

    fn stage(&self, stage: Option<Stage>) {
        self.end();
        *self.stage.lock().unwrap_or_else(PoisonError::into_inner) = stage;
        if let Some(stage) = stage {
            write_line(&serde_json::json!({"event": "stage", "stage": as_json(stage)}));
        }
    }

    fn notice(&self, text: &str) {
        write_line(&serde_json::json!({"event": "notice", "text": text}));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_that_are_alike_tell_what_is_left_of_all_of_them() {
        let alike = Alike::default();
        let stage = |number, name| Stage { number, of: 4, name };
        assert!(alike.left(stage(1, "factorise")).is_none());
        assert!(alike.left(stage(2, "factorise")).is_some());
        assert!((rest(10.0, stage(1, "factorise"), stage(2, "factorise")) - 30.0).abs() < 1e-9);
        assert_eq!(
            with_left(stage(2, "factorise"), Some(120.0)),
            "stage 2 of 4: factorise, about 2 min left in all"
        );
        // Stages of other work take other times.
        assert!(alike.left(stage(3, "cluster")).is_none());
    }

    #[test]
    fn a_line_says_which_part_of_what_is_done() {
        let stage = Stage { number: 2, of: 18, name: "factorise" };
        let mut step = Step::new("export", 81, Counted::Items("views"), Some(stage));
        assert_eq!(step.in_words(), "stage 2 of 18: factorise, export: 0 of 81 views");
        step.done = 81;
        step.remark = Some("b.zip".to_owned());
        assert!(step.in_words().ends_with("81 of 81 views, 0 s left, b.zip"), "{}", step.in_words());
    }
}
