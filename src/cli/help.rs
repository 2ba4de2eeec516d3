//! What `--help` says besides the options: the commands in groups by their purpose, examples, and
//! exit codes. The manual pages take these from here too.

use clap::{Command, builder::Styles};

/// The name of a command, and examples of its use.
type Examples = (&'static str, &'static [&'static str]);

/// Titles of the groups, by the purpose of the commands, each with its commands.
pub const GROUPS: &[(&str, &[Examples])] = &[
    (
        "Find the light",
        &[
            (
                "run",
                &[
                    "phylux run scenes/box.json",
                    "phylux run scenes/greenhouse.json --photons 2e7 -o bay.json --csv bay.csv",
                    "phylux run scenes/box.json --tolerance 0.01",
                    "phylux run scenes/box.json -o - | jq .captors[0].front.irradiance",
                    "phylux run scenes/box.json --photons 1e10 --checkpoint box.checkpoint",
                ],
            ),
            (
                "sweep",
                &[
                    "phylux sweep scenes/lamp-height.sweep.json --dry-run",
                    "phylux sweep scenes/lamp-height.sweep.json -o lamps",
                ],
            ),
            (
                "merge",
                &[
                    "phylux merge shard1.json shard2.json shard3.json -o results.json",
                    "phylux merge lamps1 lamps2 -o lamps",
                ],
            ),
            (
                "year",
                &[
                    "phylux year scenes/greenhouse-year.json -o year",
                    "phylux year scenes/greenhouse-year.json --control scenes/lamps.control.json -o lit",
                    "phylux year scenes/greenhouse-year.json --from lit -o unlit",
                ],
            ),
            ("mix", &["phylux mix bay.json --power \"row 1*=0.5,row 2 lamp 1=2\" -o dimmed.json"]),
        ],
    ),
    (
        "Look at a scene and its light",
        &[
            (
                "check",
                &["phylux check scenes/greenhouse.json", "phylux check scene.json --strict --json"],
            ),
            (
                "view",
                &[
                    "phylux view scenes/box.json",
                    "phylux view scenes/box.json --results results.json -o page.html",
                    "phylux view scenes/greenhouse.json --to bench-grid -o bench.html",
                ],
            ),
            (
                "trace",
                &[
                    "phylux trace scenes/box.json --to sensor",
                    "phylux trace scenes/greenhouse.json --to bench-grid -o ways.csv -o ways.vtp",
                ],
            ),
            (
                "render",
                &[
                    "phylux render scenes/greenhouse.json -o bay.png",
                    "phylux render scenes/box.json --show irradiance --range 0:100 -o false.png",
                ],
            ),
            (
                "plot",
                &[
                    "phylux plot results.json -o map.svg",
                    "phylux plot results.json --show profile --band PAR -o profile.png",
                ],
            ),
            (
                "export",
                &[
                    "phylux export scenes/box.json -o box.vtp",
                    "phylux export scenes/box.json --quantity absorbed -o box.glb",
                ],
            ),
        ],
    ),
    (
        "Trust it",
        &[
            (
                "calibrate",
                &[
                    "phylux calibrate scene.json measured.csv",
                    "phylux calibrate scene.json measured.csv --results all.json --model lamps",
                    "phylux calibrate scene.json --even bench --mean 200 -o even.json",
                ],
            ),
            (
                "compare",
                &["phylux compare a.json b.json", "phylux compare a.json b.json --exit-code -q"],
            ),
            (
                "chart",
                &[
                    "phylux chart scenes/box.json -o charts",
                    "phylux chart scenes/box.json -o charts --photons 1e7 --seeds 10",
                ],
            ),
        ],
    ),
    (
        "Set up",
        &[
            ("schema", &["phylux schema > scene.schema.json", "phylux schema results"]),
            (
                "completions",
                &[
                    "phylux completions bash > ~/.local/share/bash-completion/completions/phylux",
                    "phylux completions zsh > ~/.zfunc/_phylux",
                ],
            ),
            ("man", &["phylux man ~/.local/share/man/man1"]),
            ("help", &[]),
        ],
    ),
];

/// Every exit code, and what it means.
pub const EXIT_CODES: &[(u8, &str)] = &[
    (0, "done"),
    (1, "the run failed; results differ (`compare --exit-code`); a warning (`check --strict`)"),
    (2, "wrong usage or input"),
    (3, "the tolerance was not met; the results are written"),
    (130, "interrupted, by Ctrl-C or SIGTERM"),
];

/// Says where the help of a single command is.
const MORE: &str = "`phylux COMMAND --help` says more about a command, with examples.";

/// Adds groups, examples and exit codes to the help of `phylux`.
pub fn add(mut phylux: Command) -> Command {
    let styles = Styles::styled();
    let (header, literal) = (styles.get_header(), styles.get_literal());
    let mut listed = String::new();
    for (title, commands) in GROUPS {
        listed += &format!("{header}{title}:{header:#}\n");
        for (name, examples) in *commands {
            let about = match phylux.find_subcommand(name) {
                Some(command) => command.get_about().cloned().unwrap_or_default().to_string(),
                None => "Print this, or the help of a command".into(),
            };
            listed += &format!("  {literal}{name:<12}{literal:#}{about}\n");
            if !examples.is_empty() {
                let lines = examples.iter().map(|example| format!("\n  {example}"));
                let text = format!("{header}Examples:{header:#}{}", lines.collect::<String>());
                phylux = phylux.mut_subcommand(name, |command| command.after_help(text));
            }
        }
        listed.push('\n');
    }
    let options = format!("{header}Options:{header:#}\n{{options}}{{after-help}}");
    let head = "{about-with-newline}\n{usage-heading} {usage}\n\n";
    let codes = EXIT_CODES.iter().map(|(code, meaning)| format!("\n  {code:<5}{meaning}"));
    let after = format!("{header}Exit codes:{header:#}{}\n\n{MORE}", codes.collect::<String>());
    phylux.help_template(format!("{head}{listed}{options}")).after_help(after)
}

#[cfg(test)]
mod tests {
    use super::{super::command, *};

    fn groups() -> impl Iterator<Item = &'static Examples> {
        GROUPS.iter().flat_map(|(_, commands)| *commands)
    }

    /// Returns the words of a command, without what the shell does with its output.
    fn words(example: &str) -> Vec<String> {
        let own = example.split([';', '|', '>']).next().unwrap_or_default();
        let quoted = own.split('"').enumerate().flat_map(|(i, part)| match i % 2 {
            0 => part.split_whitespace().map(String::from).collect(),
            _ => vec![part.to_string()],
        });
        quoted.collect()
    }

    #[test]
    fn every_command_is_in_one_group() {
        let mut named: Vec<&str> = groups().map(|(name, _)| *name).collect();
        named.sort_unstable();
        let all = command();
        let mut there: Vec<&str> = all.get_subcommands().map(Command::get_name).collect();
        there.push("help");
        there.sort_unstable();
        assert_eq!(named, there);
    }

    #[test]
    fn every_example_is_understood() {
        for (name, examples) in groups().filter(|(name, _)| *name != "help") {
            assert!(!examples.is_empty(), "{name} has no example");
            for example in *examples {
                assert!(example.len() <= 96, "{example}");
                let words = words(example);
                assert_eq!((words[0].as_str(), words[1].as_str()), ("phylux", *name));
                let parsed = command().try_get_matches_from(&words);
                assert!(parsed.is_ok(), "{example}: {}", parsed.unwrap_err());
            }
        }
    }

    /// No line of help is longer than 100 characters, since help is read in terminals of any width
    /// and in logs.
    #[test]
    fn lines_of_help_are_not_longer_than_100() {
        let mut phylux = command().term_width(100);
        phylux.build();
        for command in std::iter::once(phylux.clone()).chain(phylux.get_subcommands().cloned()) {
            let mut command = command.term_width(100);
            let help = command.render_long_help().to_string();
            let longest = help.lines().max_by_key(|line| line.chars().count()).unwrap_or("");
            assert!(longest.chars().count() <= 100, "{}: {longest}", command.get_name());
        }
    }
}
