//! Commands that tests start, watch, interrupt and kill. A test waits until something has happened,
//! so nothing depends on the speed of the machine: the one limit on time is reached by a hang alone.

#![cfg(unix)]

use std::{
    path::Path,
    process::{Child, Command, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use crate::common::{binary, stderr};

/// Time that only a hang takes.
const PATIENCE: Duration = Duration::from_secs(900);

/// Starts a command, whose arguments are separated by spaces, in a folder.
pub fn start(folder: &Path, line: &str) -> Child {
    let mut command = Command::new(binary());
    command.args(line.split(' ')).current_dir(folder);
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("phylux starts")
}

/// Starts a command whose work has no end, and waits until something has happened.
pub fn start_until(folder: &Path, line: &str, happened: impl Fn() -> bool) -> Child {
    let mut child = start(folder, line);
    if !happens(&mut child, happened) {
        let output = child.wait_with_output().expect("an end");
        panic!("{line}: ended: {}", stderr(&output));
    }
    child
}

/// Waits until something has happened, or a command has ended. Returns whether the command was still
/// at work.
pub fn happens(child: &mut Child, happened: impl Fn() -> bool) -> bool {
    let mut at_work = true;
    wait_for("an end of a command", || {
        at_work = child.try_wait().expect("a state").is_none();
        !at_work || happened()
    });
    at_work
}

/// Waits until something has happened.
pub fn wait_for(what: &str, mut happened: impl FnMut() -> bool) {
    let started = Instant::now();
    while !happened() {
        assert!(started.elapsed() < PATIENCE, "waited in vain for {what}");
        sleep(Duration::from_millis(1));
    }
}

/// Calls `work` with a number of photons, and with twice as many each time it returns false because
/// a command ended before it could be stopped. Returns the number that was enough.
pub fn enough(photons: u64, work: impl Fn(u64) -> bool) -> u64 {
    let numbers = std::iter::successors(Some(photons), |photons| Some(2 * photons)).take(20);
    numbers.into_iter().find(|photons| work(*photons)).expect("no command can be stopped")
}

/// Sends a signal, such as `-INT`.
pub fn signal(child: &Child, name: &str) {
    let id = child.id().to_string();
    assert!(Command::new("kill").args([name, &id]).status().expect("kill").success());
}

/// Kills a command, and waits for its end. Returns whether it had not ended before.
pub fn kill(mut child: Child) -> bool {
    child.kill().expect("a kill");
    child.wait().expect("an end").code().is_none()
}
