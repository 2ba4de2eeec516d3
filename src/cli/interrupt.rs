//! Ctrl-C and SIGTERM. A signal ends a command at once, unless the command has something to keep: a
//! run with a checkpoint, and a sweep, then end in an orderly way, and at once at a second signal. No
//! temporary file stays behind either way.

use std::{
    process,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::sleep,
    time::{Duration, Instant},
};

use cpu_time::ProcessTime;

use super::{progress::Heard, terminal};
use phylux_core::error::{Error, Result, lock};
use phylux_studies::desk::{Desk, DeskState};

/// Exit code of a command that was interrupted: 128 plus the number of the signal of Ctrl-C.
pub(super) const EXIT_CODE: u8 = 130;

/// How long a command may take to end in an orderly way, unless it may take as long as it needs: CPU
/// time, or time where it waits for something else.
const PATIENCE: Duration = Duration::from_millis(100);
const WAITING: Duration = Duration::from_secs(10);

/// Makes the desk of a command, whose work signals end from now to the end of the process. Error: the
/// system does not allow it.
pub(super) fn desk() -> Result<Desk> {
    let stop = Arc::new(AtomicBool::new(false));
    let desk = Desk::new(stop.clone(), Arc::new(Heard::default()));
    let current = desk.state();
    ctrlc::set_handler(move || {
        let again = stop.swap(true, Ordering::Relaxed);
        let state = || lock(&current);
        let is_late = |state: &DeskState| state.listening && state.late.is_some();
        if again || !state().listening {
            end(&state());
        }
        let (worked, waited) = (ProcessTime::now(), Instant::now());
        while is_late(&state()) && worked.elapsed() < PATIENCE && waited.elapsed() < WAITING {
            sleep(Duration::from_millis(5));
        }
        let state = state();
        if is_late(&state) {
            end(&state);
        }
    })
    .map_err(|e| Error::run("Ctrl-C", e))?;
    Ok(desk)
}

fn end(state: &DeskState) -> ! {
    let error = state.undo();
    terminal::clear_line();
    terminal::fail(&error);
    process::exit(EXIT_CODE.into())
}
