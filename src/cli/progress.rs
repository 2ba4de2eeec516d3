//! Progress of a command: a bar on a terminal, and a line every minute elsewhere, as in the log of
//! a batch job.

use std::{
    io::{self, IsTerminal},
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle, TermLike};

use super::terminal;
use crate::transport::simulate::Progress;

/// Time between two lines where there is no terminal.
const EVERY: Duration = Duration::from_secs(60);

/// Makes a progress bar in the form of `template`, which may begin with `{bar:30}`. With `--quiet`
/// it shows nothing.
pub fn terminal_bar(template: &str) -> ProgressBar {
    let is_terminal = io::stderr().is_terminal();
    let target = match (terminal::is_quiet(), is_terminal) {
        (true, _) => ProgressDrawTarget::hidden(),
        (false, true) => ProgressDrawTarget::stderr_with_hz(10),
        (false, false) => {
            let lines = Lines::new(EVERY, |line: &str| terminal::complain(&format!("{line}\n")));
            ProgressDrawTarget::term_like_with_hz(Box::new(lines), 1)
        }
    };
    let bar = ProgressBar::with_draw_target(None, target);
    // a bar of block characters says nothing in a log
    let template = if is_terminal { template } else { template.trim_start_matches("{bar:30} ") };
    if let Ok(style) = ProgressStyle::with_template(template) {
        let speed = |state: &ProgressState, text: &mut dyn std::fmt::Write| {
            let _ = write!(text, "{:.2e}/s", state.per_sec());
        };
        bar.set_style(style.with_key("speed", speed));
    }
    bar
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
    last: Mutex<Instant>,
    write: W,
}

impl<W> Lines<W> {
    fn new(every: Duration, write: W) -> Self {
        Self { every, last: Mutex::new(Instant::now()), write }
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
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if !text.trim().is_empty() && last.elapsed() >= self.every {
            *last = Instant::now();
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

    fn lines(every: Duration) -> Vec<String> {
        let said = Mutex::new(Vec::new());
        let lines = Lines::new(every, |line: &str| said.lock().unwrap().push(line.to_string()));
        for text in ["\r", "12 %, 3 min left", "    ", "13 %, 2 min left", "  "] {
            lines.write_str(text).unwrap();
        }
        said.into_inner().unwrap()
    }

    #[test]
    fn a_log_gets_lines_and_nothing_that_only_a_terminal_understands() {
        assert_eq!(lines(Duration::ZERO), ["12 %, 3 min left", "13 %, 2 min left"]);
    }

    #[test]
    fn there_is_no_line_before_its_time() {
        assert_eq!(lines(Duration::from_secs(3600)), [""; 0]);
    }
}
