//! Every command and every file that README.md and the pages of docs/ show works as it is written
//! there, except that runs are made short. CONTRIBUTING.md says how to write an example.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

use serde_json::{Value, json};

use crate::common::binary;

/// The number of photons, paths and stored arrivals of every run here. It is enough for 100 paths
/// from each face of the box.
const PHOTONS: &str = "2000";
/// The endings of the files that phylux reads.
const ENDINGS: [&str; 8] = [".json", ".csv", ".obj", ".mtl", ".stl", ".ies", ".rad", ".xml"];

/// A code block of a page, fenced or indented.
struct Block<'a> {
    /// The number of its first line in the page.
    line: usize,
    /// The last line of prose before it; empty if none follows the previous block.
    before: &'a str,
    /// The word behind the opening fence; `None` for an indented block.
    language: Option<&'a str>,
    lines: Vec<&'a str>,
}

impl<'a> Block<'a> {
    fn all(text: &'a str) -> Vec<Self> {
        let (mut blocks, mut before, mut blank) = (Vec::new(), "", true);
        let mut rest = text.lines().zip(1..).peekable();
        while let Some((start, line)) = rest.next() {
            let (language, lines) = if let Some(language) = start.strip_prefix("```") {
                let inside = rest.by_ref().map(|(text, _)| text);
                (Some(language), inside.take_while(|text| *text != "```").collect())
            } else if blank && start.starts_with("    ") {
                let mut lines = vec![start.trim_start()];
                while let Some((text, _)) = rest.next_if(|(text, _)| text.starts_with("    ")) {
                    lines.push(text.trim_start());
                }
                (None, lines)
            } else {
                blank = start.trim().is_empty();
                if !blank {
                    before = start;
                }
                continue;
            };
            blocks.push(Self { line, before, language, lines });
            before = "";
        }
        blocks
    }

    /// Returns whether a comment before the block says why it is not run.
    fn is_marked(&self) -> bool {
        self.before.starts_with("<!-- not run: ")
    }

    fn commands(&self) -> impl Iterator<Item = &'a str> {
        self.lines.iter().copied().filter(|l| l.starts_with("phylux ") || l.starts_with("cargo "))
    }

    fn is_file(&self) -> bool {
        self.language == Some("json") || self.language.is_some() && self.name().is_some()
    }

    /// Returns the path of the file that the block shows, which is the last file name in the line
    /// before it. A name without a folder belongs to scenes/.
    fn name(&self) -> Option<PathBuf> {
        let names = self.before.split('`').skip(1).step_by(2);
        let is_file = |name: &&str| ENDINGS.iter().any(|ending| name.ends_with(ending));
        let name = Path::new(names.filter(is_file).last()?);
        let alone = name.parent() == Some(Path::new(""));
        Some(if alone { Path::new("scenes").join(name) } else { name.into() })
    }
}

/// A temporary folder with the shipped scenes, which are changed to need few photons.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        let (folder, root) = (tempfile::tempdir().expect("a folder"), root());
        for part in ["scenes", "captors"] {
            fs::create_dir(folder.path().join(part)).expect("a folder");
            for entry in fs::read_dir(root.join(part)).expect("a folder of the repository") {
                let from = entry.expect("an entry").path();
                let to = folder.path().join(part).join(from.file_name().expect("a name"));
                let mut bytes = fs::read(&from).expect("a file");
                if let Some(mut scene) = serde_json::from_slice::<Value>(&bytes).ok()
                    && scene.get("settings").is_some()
                {
                    let few: u64 = PHOTONS.parse().expect("a number");
                    scene["settings"]["photons"] = json!(few);
                    scene["settings"]["map_photons"] = json!(few);
                    if scene["time"] == "year" {
                        let [from, to] = ["2025-06-21T00:00+01:00", "2025-06-22T00:00+01:00"];
                        scene["time"] = json!({ "from": from, "to": to });
                    }
                    bytes = scene.to_string().into();
                }
                fs::write(to, bytes).expect("written");
            }
        }
        fs::create_dir_all(folder.path().join("docs/charts")).expect("a folder");
        Self(folder)
    }

    /// Runs a line in a shell, with few photons. `place` names the page and line for error
    /// messages.
    fn run(&self, place: &str, line: &str) {
        let line = short(line);
        let folders = env::var_os("PATH").unwrap_or_default();
        let own = binary().parent().expect("a folder").to_path_buf();
        let path = env::join_paths([own].into_iter().chain(env::split_paths(&folders)));
        let mut shell = Command::new("sh");
        shell.args(["-c", &line]).env("PATH", path.expect("a search path"));
        let output = shell.current_dir(self.0.path()).output().expect("a shell");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{place}: {line}\n{said}");
    }
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Returns the command without its comment, with few photons and a tolerance that these can meet.
fn short(line: &str) -> String {
    let command = line.split(" #").next().unwrap_or_default().trim_end();
    let mut words: Vec<&str> = command.split(' ').collect();
    for (option, value) in [("--photons", PHOTONS), ("--tolerance", "0.9")] {
        if let Some(at) = words.iter().position(|word| *word == option) {
            words[at + 1] = value;
        }
    }
    match words[1] {
        "render" => {
            for (option, value) in
                [("--map-photons", PHOTONS), ("--width", "60"), ("--height", "45"), ("--rays", "1")]
            {
                match words.iter().position(|word| *word == option) {
                    Some(at) => words[at + 1] = value,
                    None => words.extend([option, value]),
                }
            }
        }
        "chart" if !words[2].ends_with("study.json") => {
            words.extend(["--seeds", "2"]);
            // enough photons for a captor of the growth chamber to be known well enough
            if !command.contains("--photons") {
                words.extend(["--photons", "20000"]);
            }
        }
        _ => {}
    }
    words.join(" ")
}

/// Writes and checks the files of a page, then runs its commands in order. Returns the number of
/// files and of commands.
fn try_page(page: &Path) -> (usize, usize) {
    let text = fs::read_to_string(root().join(page)).expect("a page");
    let blocks = Block::all(&text);
    let folder = Folder::new();
    let (mut files, mut commands) = (Vec::new(), Vec::new());
    for block in &blocks {
        let place = format!("{}:{}", page.display(), block.line);
        let of_block = block.commands().map(|command| (place.clone(), command));
        if block.is_marked() {
            let is_example = block.is_file() || block.commands().next().is_some();
            assert!(is_example, "{place}: marked as not run, but nothing here would be run");
        } else if block.is_file() {
            let name = block.name().unwrap_or_else(|| panic!("{place}: name the file, or mark it"));
            let text = block.lines.join("\n");
            match fs::read_to_string(root().join(&name)) {
                Ok(shipped) => assert_eq!(shipped.trim_end(), text, "{place}: {}", name.display()),
                Err(_) => fs::write(folder.0.path().join(&name), text).expect("written"),
            }
            files.push((place, name));
        } else {
            commands.extend(of_block);
        }
    }
    for (place, name) in &files {
        let path = name.display();
        match name.to_string_lossy() {
            name if name.ends_with(".sweep.json") => {
                folder.run(place, &format!("phylux sweep {path} --dry-run"));
            }
            // a control file is read by a command of the page
            name if name.ends_with(".control.json") => {}
            name if name.ends_with(".json") => {
                folder.run(place, &format!("phylux check {path}"));
                let text = fs::read_to_string(folder.0.path().join(&*name)).expect("a scene");
                if text.contains("\"captor") {
                    let run = format!("phylux run {path} --photons 1 -o of-a-page.json");
                    folder.run(place, &run);
                }
            }
            _ => {}
        }
    }
    for (place, command) in &commands {
        let command = command.replace("cargo run --release -- ", "phylux ");
        assert!(command.starts_with("phylux "), "{place}: {command}: mark it as not run");
        folder.run(place, &command);
    }
    (files.len(), commands.len())
}

/// Returns the files that the text of a page shows, by their names without a folder.
pub fn files_of(text: &str) -> Vec<(String, String)> {
    let shown = |block: &Block| block.name().filter(|_| block.language.is_some());
    let blocks = Block::all(text).into_iter();
    let files = blocks.filter_map(|block| {
        let name = shown(&block)?.file_name()?.to_string_lossy().into_owned();
        Some((name, block.lines.join("\n")))
    });
    files.collect()
}

/// Every example must succeed. The test does not depend on chance.
#[test]
fn examples_of_all_pages_work() {
    let docs =
        ["docs", "docs/notes", "docs/coming-from", "docs/python"].into_iter().flat_map(|folder| {
            let entries = fs::read_dir(root().join(folder)).expect(folder);
            entries.map(move |entry| Path::new(folder).join(entry.expect("an entry").file_name()))
        });
    let docs = docs.filter(|path| path.extension().is_some_and(|ending| ending == "md"));
    let (mut files, mut commands) = (0, 0);
    for page in [PathBuf::from("README.md")].into_iter().chain(docs) {
        let tried = try_page(&page);
        (files, commands) = (files + tried.0, commands + tried.1);
    }
    assert!(files >= 10 && commands >= 25, "found only {files} files and {commands} commands");
}

/// The reader of pages distinguishes commands, files and blocks that are marked as not run.
#[test]
fn blocks_of_a_page() {
    let page = "Text\n\n    phylux check a.json  # first\n    x = 1\n\n`a.json` and `b.sweep.json`:\n\
                ```json\n{}\n```\n<!-- not run: needs Slurm -->\n\n    phylux merge\n```python\n1\n```\n";
    let blocks = Block::all(page);
    let commands: Vec<Vec<&str>> = blocks.iter().map(|block| block.commands().collect()).collect();
    assert_eq!(
        commands,
        [vec!["phylux check a.json  # first"], vec![], vec!["phylux merge"], vec![]]
    );
    assert_eq!(blocks[1].name(), Some("scenes/b.sweep.json".into()));
    assert_eq!(blocks.iter().map(Block::is_file).collect::<Vec<_>>(), [false, true, false, false]);
    assert_eq!(
        blocks.iter().map(Block::is_marked).collect::<Vec<_>>(),
        [false, false, true, false]
    );
    assert_eq!(
        short("phylux run a.json --photons 2e7 -o b  # x"),
        "phylux run a.json --photons 2000 -o b"
    );
}

/// The examples of the library run, and each prints what it is for. They are built by `cargo test`.
/// The test does not depend on chance.
#[test]
fn examples_of_the_library_run() {
    let folder =
        env::current_exe().expect("this program").ancestors().nth(2).map(|at| at.join("examples"));
    for (name, lines, unit) in [
        ("chamber", 5, "umol/m2/s"),
        ("own_tally", 7, "degrees"),
        ("materials", 5, "W/m2"),
        ("field", 5, "m: "),
    ] {
        let program =
            folder.as_ref().expect("a folder").join(format!("{name}{}", env::consts::EXE_SUFFIX));
        let output = Command::new(&program).current_dir(root()).output().unwrap_or_else(|why| {
            panic!(
                "{}: {why}; build it: cargo build --examples, with the profile of this test",
                program.display()
            )
        });
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8_lossy(&output.stdout);
        assert_eq!(text.lines().count(), lines, "{name}: {text}");
        assert!(
            text.contains(unit) && text.contains("+-") && !text.contains("NaN"),
            "{name}: {text}"
        );
    }
}
