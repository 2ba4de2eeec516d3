//! Work that ends when its time is up.

use std::{
    sync::{
        atomic::{AtomicBool, Ordering},
        mpsc::{RecvTimeoutError, channel},
    },
    thread,
    time::{Duration, Instant},
};

use super::Control;
use crate::error::{ErrorKind, Result};

/// How often it is looked whether the user stops the work.
const LOOK: Duration = Duration::from_millis(20);

/// Does some work until it is done or, if `until` is given, until then: its `Control` then stops it as
/// the user does. `None` if its time was up. Errors: those of the work; the user stops it.
pub(super) fn within<T>(
    until: Option<Instant>,
    control: &Control,
    work: impl FnOnce(&Control) -> Result<T>,
) -> Result<Option<T>> {
    let Some(until) = until else { return work(control).map(Some) };
    let stop = AtomicBool::new(Instant::now() >= until);
    let done = thread::scope(|scope| {
        let (working, ended) = channel::<()>();
        let stop = &stop;
        let user = control.stop;
        scope.spawn(move || {
            loop {
                let left = until.saturating_duration_since(Instant::now());
                if left.is_zero() || user.load(Ordering::Relaxed) {
                    return stop.store(true, Ordering::Relaxed);
                }
                if ended.recv_timeout(left.min(LOOK)) != Err(RecvTimeoutError::Timeout) {
                    return;
                }
            }
        });
        let done = work(&Control { stop, ..*control });
        drop(working);
        done
    });
    match done {
        Err(e) if e.kind() == ErrorKind::Interrupted && !control.stop.load(Ordering::Relaxed) => {
            Ok(None)
        }
        done => done.map(Some),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::{Error, NOTHING_WRITTEN};

    /// Work that never ends by itself ends when its time is up, or when the user stops it; work that is
    /// done, and work that fails, does not wait.
    #[test]
    fn work_ends_when_its_time_is_up() {
        let endless = |control: &Control| -> Result<()> {
            while !control.stop.load(Ordering::Relaxed) {
                thread::yield_now();
            }
            Err(Error::interrupted("run", NOTHING_WRITTEN))
        };
        let (now, later) = (Instant::now(), Instant::now() + Duration::from_secs(3600));
        assert_eq!(within(Some(now), &Control::default(), endless), Ok(None));
        for until in [None, Some(later)] {
            assert_eq!(within(until, &Control::default(), |_| Ok(1)), Ok(Some(1)));
            let fails = |_: &Control| -> Result<()> { Err(Error::run("run", "fails")) };
            assert!(within(until, &Control::default(), fails).is_err());
        }
        let user = AtomicBool::new(true);
        let stopped = Control { stop: &user, progress: &|_| {} };
        assert!(within(Some(later), &stopped, endless).is_err());
    }
}
