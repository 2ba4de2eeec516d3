//! A page in a Chromium browser without a window, controlled through the DevTools protocol over a
//! pipe.

use std::{
    cell::{Cell, RefCell},
    env,
    io::{BufRead, BufReader, Write},
    path::{Path, PathBuf},
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use serde_json::{Value, json};

/// An open page.
pub struct Page {
    browser: Child,
    to: RefCell<ChildStdin>,
    from: RefCell<BufReader<ChildStdout>>,
    session: String,
    calls: Cell<u64>,
    /// Errors and warnings that the page has written to the console.
    complaints: RefCell<Vec<String>>,
    mouse: Cell<(f64, f64)>,
    _profile: tempfile::TempDir,
}

/// Time that only a hang takes, also on a busy machine without a graphics card.
const PATIENCE: Duration = Duration::from_secs(900);

impl Page {
    /// Opens a file in a new browser.
    pub fn open(path: &Path) -> Self {
        Self::open_at(&format!("file://{}", path.display()))
    }

    /// Opens an address in a new browser.
    pub fn open_at(address: &str) -> Self {
        let program = chromium().expect("install Chromium: none is on the PATH");
        let profile = tempfile::tempdir().expect("a folder");
        // the protocol uses the file descriptors 3 and 4
        let script = r#"exec "$0" "$@" 3<&0 4>&1 0</dev/null 1>/dev/null 2>/dev/null"#;
        let mut browser = Command::new("sh")
            .args(["-c", script])
            .arg(program)
            .args(["--headless", "--no-sandbox", "--remote-debugging-pipe", "--no-first-run"])
            .args(["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
            .args(["--disable-dev-shm-usage", "--window-size=1280,800"])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("a shell");
        let to = RefCell::new(browser.stdin.take().expect("a pipe"));
        let from = RefCell::new(BufReader::new(browser.stdout.take().expect("a pipe")));
        let mut page = Self {
            browser,
            to,
            from,
            session: String::new(),
            calls: Cell::new(0),
            complaints: RefCell::default(),
            mouse: Cell::default(),
            _profile: profile,
        };
        let target = page.call("Target.createTarget", json!({ "url": "about:blank" }));
        let attach = json!({ "targetId": target["targetId"], "flatten": true });
        let session = page.call("Target.attachToTarget", attach);
        page.session = session["sessionId"].as_str().expect("a session").to_string();
        for domain in ["Runtime", "Log", "Page"] {
            page.call(&format!("{domain}.enable"), json!({}));
        }
        page.call("Page.navigate", json!({ "url": address }));
        page
    }

    /// Waits until an expression is true.
    pub fn wait_for(&self, expression: &str) {
        let started = Instant::now();
        while self.evaluate(expression) != true {
            let complaints = self.complaints.borrow();
            assert!(started.elapsed() < PATIENCE, "never: {expression}; {complaints:?}");
            sleep(Duration::from_millis(50));
        }
    }

    /// Returns the value of an expression in the page, or null if it fails.
    pub fn evaluate(&self, expression: &str) -> Value {
        // with the functions of the console, such as getEventListeners
        let arguments = json!({ "expression": expression, "awaitPromise": true,
            "returnByValue": true, "includeCommandLineAPI": true });
        self.call("Runtime.evaluate", arguments)["result"]["value"].clone()
    }

    /// Waits until two more frames are drawn.
    pub fn settle(&self) {
        self.evaluate(
            "new Promise((r) => requestAnimationFrame(() => requestAnimationFrame(() => r(0))))",
        );
    }

    /// Gives the page the size of another screen, in pixels.
    pub fn resize(&self, width: u32, height: u32) {
        let size =
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": true });
        self.call("Emulation.setDeviceMetricsOverride", size);
    }

    /// Sends an event of the mouse at this place of the page, in pixels.
    pub fn mouse(&self, kind: &str, x: f64, y: f64) {
        self.mouse.set((x, y));
        let pressed = if kind == "mouseMoved" { "none" } else { "left" };
        let event = json!({ "type": kind, "x": x, "y": y, "button": pressed, "clickCount": 1 });
        self.call("Input.dispatchMouseEvent", event);
    }

    /// Clicks where the mouse is.
    pub fn click(&self) {
        let (x, y) = self.mouse.get();
        self.mouse("mousePressed", x, y);
        self.mouse("mouseReleased", x, y);
        self.settle();
    }

    /// Presses a key, of which the code is that of Windows.
    pub fn key(&self, key: &str, code: u32) {
        for kind in ["rawKeyDown", "keyUp"] {
            let event = json!({ "type": kind, "key": key, "windowsVirtualKeyCode": code });
            self.call("Input.dispatchKeyEvent", event);
        }
    }

    /// Asserts that the console holds no errors or warnings.
    pub fn no_complaints(&self) {
        let complaints = self.complaints.borrow();
        assert!(complaints.is_empty(), "{complaints:#?}");
    }

    fn call(&self, method: &str, arguments: Value) -> Value {
        let id = self.calls.get() + 1;
        self.calls.set(id);
        let mut call = json!({ "id": id, "method": method, "params": arguments });
        if !self.session.is_empty() {
            call["sessionId"] = self.session.clone().into();
        }
        let mut to = self.to.borrow_mut();
        to.write_all(format!("{call}\0").as_bytes()).and_then(|()| to.flush()).expect("sent");
        let mut from = self.from.borrow_mut();
        loop {
            let mut message = Vec::new();
            from.read_until(0, &mut message).expect("a message");
            assert_eq!(message.pop(), Some(0), "Chromium has gone");
            let message: Value = serde_json::from_slice(&message).expect("JSON");
            if message["id"] == id {
                assert!(message.get("error").is_none(), "{method}: {message}");
                return message["result"].clone();
            }
            self.note(&message);
        }
    }

    fn note(&self, message: &Value) {
        let event = message["method"].as_str().unwrap_or_default();
        let bad = match event {
            "Runtime.exceptionThrown" => true,
            "Runtime.consoleAPICalled" => ["error", "warning", "assert"]
                .contains(&message["params"]["type"].as_str().unwrap_or_default()),
            "Log.entryAdded" => {
                let entry = &message["params"]["entry"];
                let text = entry["text"].as_str().unwrap_or_default();
                // a warning of the graphics driver: reading a pixel waits for the picture
                let about_driver = text.contains("GPU stall due to ReadPixels");
                ["error", "warning"].contains(&entry["level"].as_str().unwrap_or_default())
                    && !about_driver
            }
            _ => false,
        };
        if bad {
            self.complaints.borrow_mut().push(message["params"].to_string());
        }
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        let close = json!({ "id": 0, "method": "Browser.close" });
        let sent = self.to.get_mut().write_all(format!("{close}\0").as_bytes());
        let started = Instant::now();
        while sent.is_ok() && started.elapsed() < Duration::from_secs(5) {
            if matches!(self.browser.try_wait(), Ok(Some(_))) {
                return;
            }
            sleep(Duration::from_millis(20));
        }
        let _ = self.browser.kill();
        let _ = self.browser.wait();
    }
}

fn chromium() -> Option<PathBuf> {
    let folders = env::var_os("PATH")?;
    let names = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];
    env::split_paths(&folders)
        .flat_map(|folder| names.map(|name| folder.join(name)))
        .find(|path| path.is_file())
}
