//! Runs long work on a separate thread while the calling thread handles Ctrl-C, reports progress,
//! and lets other Python threads run.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
        mpsc::{RecvTimeoutError, channel},
    },
    thread,
    time::Duration,
};

use phylux::transport::Progress;
use pyo3::{exceptions::PyRuntimeError, prelude::*};

use crate::errors::raised;

/// The time between two checks of the calling thread for signals and progress.
const LOOK: Duration = Duration::from_millis(50);
/// The longest time that the calling thread waits for work that it has asked to stop. Work that
/// needs longer ends by itself a little later.
const PATIENCE: Duration = Duration::from_millis(100);

/// The state that the work shares with the calling thread: a request to stop, and the progress.
#[derive(Default)]
pub struct Watch {
    /// Set when the work should end.
    pub stop: Arc<AtomicBool>,
    done: AtomicU64,
    of: AtomicU64,
}

impl Watch {
    /// Says that another part of the work begins, whose progress counts from 0.
    pub fn begin(&self) {
        self.done.store(0, Ordering::Relaxed);
        self.of.store(0, Ordering::Relaxed);
    }

    /// Records progress; it may be called from any thread.
    pub fn note(&self, progress: Progress) {
        self.done.fetch_max(progress.photons, Ordering::Relaxed);
        self.of.store(progress.of.unwrap_or(0), Ordering::Relaxed);
    }
}

/// Does `work` without holding the interpreter. A few times a second, `progress` is called with the
/// amount done and the total (None where it is not known). An exception in `progress` or in the
/// handler of a signal ends the work.
pub fn watched<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Arc<Watch>) -> phylux::Result<T> + Send + 'static,
) -> PyResult<T> {
    let watch = Arc::new(Watch::default());
    let (sender, mut receiver) = channel();
    let of_work = watch.clone();
    let worker = thread::Builder::new().name("phylux".into()).spawn(move || {
        // after Ctrl-C nobody may be listening any more
        let _ = sender.send(work(&of_work));
    })?;
    let mut told = 0;
    let mut tell = |last: bool| -> PyResult<()> {
        let (done, of) = (watch.done.load(Ordering::Relaxed), watch.of.load(Ordering::Relaxed));
        if let Some(progress) = progress.filter(|_| done != told || last) {
            told = done;
            progress.call1((done, (of > 0).then_some(of)))?;
        }
        Ok(())
    };
    let result = loop {
        let found;
        (found, receiver) = py.detach(move || (receiver.recv_timeout(LOOK), receiver));
        match found {
            Ok(result) => break result,
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("phylux broke off; please report this"));
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
        if let Err(exception) = py.check_signals().and_then(|()| tell(false)) {
            watch.stop.store(true, Ordering::Relaxed);
            py.detach(move || {
                if receiver.recv_timeout(PATIENCE).is_ok() {
                    let _ = worker.join();
                }
            });
            return Err(exception);
        }
    };
    py.detach(|| {
        let _ = worker.join();
    });
    if result.is_ok() {
        tell(true)?;
    }
    raised(py, result)
}
