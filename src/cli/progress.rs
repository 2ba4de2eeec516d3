//! Progress of a command: a bar on a terminal. Elsewhere, as in the log of a batch job, there is a
//! line after two seconds and then every minute.

use std::{
    io::{self, IsTerminal},
    sync::Mutex,
    time::{Duration, Instant},
};

use indicatif::{
    HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle, TermLike,
};

use super::terminal;
use phylux_core::{
    error::{Result, lock},
    transport::simulate::Progress,
};
use phylux_studies::desk::Listener;

/// Time before the first line where there is no terminal, and between two lines.
const FIRST: Duration = Duration::from_secs(2);
const EVERY: Duration = Duration::from_secs(60);
/// Time between two drawings of a bar of which nothing else is heard.
const TICK: Duration = Duration::from_millis(200);
/// The time that is left is told once this fraction is done.
const TOLD: f32 = 0.05;

/// Makes a progress bar in the form of `template`, which may begin with `{bar:30}`. It may contain
/// `{speed}`, and at its end `{left}` for the time that the rest takes. With `--quiet` it shows nothing.
pub fn terminal_bar(template: &str) -> ProgressBar {
    let is_terminal = io::stderr().is_terminal();
    let target = match (terminal::is_quiet(), is_terminal) {
        (true, _) => ProgressDrawTarget::hidden(),
        (false, true) => ProgressDrawTarget::stderr_with_hz(10),
        (false, false) => {
            let lines = Lines::new(FIRST, EVERY, |line: &str| {
                terminal::complain(&format!("{line}\n"));
            });
            ProgressDrawTarget::term_like_with_hz(Box::new(lines), 1)
        }
    };
    let bar = ProgressBar::with_draw_target(None, target);
    set_form(&bar, template);
    bar.enable_steady_tick(TICK);
    bar
}

/// Gives a bar the form of a template, as [`terminal_bar`] takes it.
fn set_form(bar: &ProgressBar, template: &str) {
    // a bar of block characters says nothing in a log
    let template = match io::stderr().is_terminal() {
        true => template,
        false => template.trim_start_matches("{bar:30} "),
    };
    let Ok(style) = ProgressStyle::with_template(template) else { return };
    let speed = |state: &ProgressState, text: &mut dyn std::fmt::Write| {
        // the speed of late is not known where the bar has just begun to count anew
        let mean = state.pos() as f64 / state.elapsed().as_secs_f64();
        let speed = Some(state.per_sec()).filter(|speed| *speed > 0.0).unwrap_or(mean);
        let _ = match state.pos() {
            0 => write!(text, "planning"),
            _ => write!(text, "{speed:.2e}/s"),
        };
    };
    // how long the rest takes is known once some of it is done
    let left = |state: &ProgressState, text: &mut dyn std::fmt::Write| {
        if state.fraction() >= TOLD {
            let _ = write!(text, ", {:#} left", HumanDuration(state.eta()));
        }
    };
    bar.set_style(style.with_key("speed", speed).with_key("left", left));
}

/// Shows on the terminal what is heard of work at a desk.
#[derive(Default)]
pub struct Heard {
    /// The bar of the part that goes on, and whether it counts.
    bar: Mutex<Option<(ProgressBar, bool)>>,
}

impl Listener for Heard {
    fn begin(&self, part: &str) {
        self.end();
        let bar = terminal_bar("{elapsed} {msg}");
        bar.set_message(part.to_owned());
        *lock(&self.bar) = Some((bar, false));
    }

    fn progress(&self, progress: Progress) {
        let mut bar = lock(&self.bar);
        let Some((bar, counts)) = &mut *bar else { return };
        if !*counts {
            *counts = true;
            set_form(
                bar,
                match progress.of {
                    Some(_) => "{bar:30} {percent}% {human_pos} {msg}, {speed}{left}",
                    None => "{elapsed} {human_pos} {msg}, {speed}",
                },
            );
        }
        show(bar, progress);
    }

    fn end(&self) {
        if let Some((bar, _)) = lock(&self.bar).take() {
            bar.finish_and_clear();
        }
    }

    fn warn(&self, warning: &str) {
        terminal::warn(&[warning.to_owned()]);
    }

    fn note(&self, note: &str) {
        if !terminal::is_quiet() {
            terminal::complain(&format!("{note}\n"));
        }
    }

    fn take_output(&self) -> Result<()> {
        terminal::take_output()
    }
}

/// Shows how far a simulation has come.
pub fn show(bar: &ProgressBar, progress: Progress) {
    if let Some(of) = progress.of {
        bar.set_length(of);
    }
    bar.set_position(progress.photons);
}

/// Stands in for a terminal: of all that a bar draws, it writes one line at most every `every`.
struct Lines<W> {
    every: Duration,
    /// When the next line is due.
    due: Mutex<Instant>,
    write: W,
}

impl<W> Lines<W> {
    fn new(first: Duration, every: Duration, write: W) -> Self {
        Self { every, due: Mutex::new(Instant::now() + first), write }
    }
}

impl<W> std::fmt::Debug for Lines<W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Lines").finish_non_exhaustive()
    }
}

impl<W: Fn(&str) + Send + Sync> TermLike for Lines<W> {
    fn width(&self) -> u16 {
        200
    }
    fn move_cursor_up(&self, _: usize) -> io::Result<()> {
        Ok(())
    }
    fn move_cursor_down(&self, _: usize) -> io::Result<()> {
        Ok(())
    }
    fn move_cursor_right(&self, _: usize) -> io::Result<()> {
        Ok(())
    }
    fn move_cursor_left(&self, _: usize) -> io::Result<()> {
        Ok(())
    }
    fn write_line(&self, line: &str) -> io::Result<()> {
        self.write_str(line)
    }
    fn write_str(&self, text: &str) -> io::Result<()> {
        let mut due = lock(&self.due);
        if !text.trim().is_empty() && Instant::now() >= *due {
            *due = Instant::now() + self.every;
            (self.write)(text.trim_end());
        }
        Ok(())
    }
    fn clear_line(&self) -> io::Result<()> {
        Ok(())
    }
    fn flush(&self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(first: Duration, every: Duration) -> Vec<String> {
        let said = Mutex::new(Vec::new());
        let lines =
            Lines::new(first, every, |line: &str| said.lock().unwrap().push(line.to_string()));
        for text in ["\r", "12 %, 3 min left", "    ", "13 %, 2 min left", "  "] {
            lines.write_str(text).unwrap();
        }
        said.into_inner().unwrap()
    }

    #[test]
    fn a_log_gets_lines_and_nothing_that_only_a_terminal_understands() {
        let zero = Duration::ZERO;
        assert_eq!(lines(zero, zero), ["12 %, 3 min left", "13 %, 2 min left"]);
    }

    #[test]
    fn there_is_no_line_before_its_time() {
        let hour = Duration::from_secs(3600);
        assert_eq!(lines(hour, Duration::ZERO), [""; 0]);
        assert_eq!(lines(Duration::ZERO, hour), ["12 %, 3 min left"]);
    }
}
