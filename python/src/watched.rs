//! Long work on a thread of its own, while the calling thread listens: Ctrl-C, progress, other Python threads.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
        mpsc::{RecvTimeoutError, channel},
    },
    thread,
    time::Duration,
};

use phylux::Progress;
use pyo3::{exceptions::PyRuntimeError, prelude::*};

use crate::errors::raised;

/// How often the calling thread looks for signals and tells of progress.
const LOOK: Duration = Duration::from_millis(50);
/// How long it waits for work that it has told to stop. What takes longer ends by itself a little later.
const PATIENCE: Duration = Duration::from_millis(100);

/// What the work is told, and what it tells.
#[derive(Default)]
pub struct Watch {
    /// Set when it is to end.
    pub stop: AtomicBool,
    done: AtomicU64,
    of: AtomicU64,
}

impl Watch {
    /// Takes note of progress; from any thread.
    pub fn note(&self, progress: Progress) {
        self.done.fetch_max(progress.photons, Ordering::Relaxed);
        self.of.store(progress.of.unwrap_or(0), Ordering::Relaxed);
    }
}

/// Does `work` without holding the interpreter. `progress` is called with how much is done, and of how much (None where
/// that is not known), a few times a second. An exception of it, or of a signal's handler, ends the work.
pub fn watched<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Watch) -> phylux::Result<T> + Send + 'static,
) -> PyResult<T> {
    let watch = Arc::new(Watch::default());
    let (sender, mut receiver) = channel();
    let of_work = watch.clone();
    let worker = thread::Builder::new().name("phylux".into()).spawn(move || {
        // nobody listens any more where Ctrl-C came first
        let _ = sender.send(work(&of_work));
    })?;
    let mut told = 0;
    let mut tell = |last: bool| -> PyResult<()> {
        let (done, of) = (watch.done.load(Ordering::Relaxed), watch.of.load(Ordering::Relaxed));
        if let Some(progress) = progress.filter(|_| done > told || last) {
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
