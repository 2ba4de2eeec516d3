//! Sentences that name settings and commands. The names are data, so that each interface spells them
//! in its own way: the command line says `--max-time 60`, Python `max_time=60`.

use std::{borrow::Cow, fmt};

/// A sentence, or a part of one. It is shown as the command line spells it, or in another
/// [`Spelling`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Words(Vec<Word>);

#[derive(Clone, Debug, PartialEq, Eq)]
enum Word {
    Text(String),
    Setting(Setting),
    Call(Call),
}

/// A setting or an option, by the name that it has as a key of files, and perhaps with a value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// The name, such as `max_time`.
    pub name: &'static str,
    /// What is said of its value.
    pub value: SettingValue,
}

/// What a sentence says of the value of a [`Setting`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SettingValue {
    /// Nothing.
    Unsaid,
    /// That it is switched on.
    On,
    /// The value itself.
    Is(Cow<'static, str>),
}

/// A command, with settings of it that are named.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Call {
    /// The name of the command, such as `year`.
    pub command: &'static str,
    /// The settings.
    pub settings: Vec<Setting>,
}

/// Names a setting.
pub fn setting(name: &'static str) -> Setting {
    Setting { name, value: SettingValue::Unsaid }
}

/// Names a command.
pub fn call(command: &'static str) -> Call {
    Call { command, settings: Vec::new() }
}

impl Setting {
    /// The same, switched on.
    pub fn on(self) -> Self {
        Self { value: SettingValue::On, ..self }
    }

    /// The same with a value.
    pub fn is(self, value: impl Into<Cow<'static, str>>) -> Self {
        Self { value: SettingValue::Is(value.into()), ..self }
    }
}

impl Call {
    /// The same with a setting.
    pub fn with(mut self, setting: Setting) -> Self {
        self.settings.push(setting);
        self
    }
}

/// How an interface spells the names of settings and commands.
pub trait Spelling {
    /// A setting in a sentence.
    fn setting(&self, setting: &Setting) -> String;
    /// A command in a sentence.
    fn call(&self, call: &Call) -> String;
    /// A setting as the place of an error.
    fn place(&self, setting: &Setting) -> String {
        self.setting(setting)
    }
}

/// The spelling of the command line.
#[derive(Clone, Copy, Debug)]
pub struct CommandLine;

impl Spelling for CommandLine {
    fn setting(&self, Setting { name, value }: &Setting) -> String {
        let option = format!("--{}", name.replace('_', "-"));
        match value {
            SettingValue::Is(value) => format!("{option} {value}"),
            SettingValue::Unsaid | SettingValue::On => option,
        }
    }

    fn call(&self, Call { command, settings }: &Call) -> String {
        let options: String = settings.iter().map(|of| format!(" {}", self.setting(of))).collect();
        format!("`phylux {command}{options}`")
    }
}

impl Words {
    /// Joins parts of a sentence; the macro `words!` is shorter.
    pub fn joined(parts: impl IntoIterator<Item = Self>) -> Self {
        Self(parts.into_iter().flat_map(|part| part.0).collect())
    }

    /// Returns the sentence in this spelling.
    pub fn spelled(&self, spelling: &dyn Spelling) -> String {
        let spelled = self.0.iter().map(|word| match word {
            Word::Text(text) => text.clone(),
            Word::Setting(setting) => spelling.setting(setting),
            Word::Call(call) => spelling.call(call),
        });
        spelled.collect()
    }

    /// Returns the words as the place of an error in this spelling.
    pub(super) fn place(&self, spelling: &dyn Spelling) -> Cow<'_, str> {
        match self.0.as_slice() {
            [Word::Text(place)] => place.into(),
            [Word::Setting(setting)] => spelling.place(setting).into(),
            _ => self.spelled(spelling).into(),
        }
    }
}

/// What can be a part of a sentence: whatever has a text, and the names of settings and commands.
pub trait ToWords {
    /// Makes words of it.
    fn to_words(self) -> Words;
}

impl<T: fmt::Display> ToWords for T {
    fn to_words(self) -> Words {
        Words(vec![Word::Text(self.to_string())])
    }
}

// These have no `Display`, so that a name does not become text by chance.

impl ToWords for Words {
    fn to_words(self) -> Words {
        self
    }
}

impl ToWords for Setting {
    fn to_words(self) -> Words {
        Words(vec![Word::Setting(self)])
    }
}

impl ToWords for Call {
    fn to_words(self) -> Words {
        Words(vec![Word::Call(self)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::words;

    /// An interface that shouts.
    struct Loud;

    impl Spelling for Loud {
        fn setting(&self, setting: &Setting) -> String {
            format!("{}!", setting.name)
        }

        fn call(&self, call: &Call) -> String {
            call.command.to_uppercase()
        }
    }

    #[test]
    fn each_interface_spells_names_in_its_way() {
        let words = words![
            "run it with ",
            setting("by_light").on(),
            format!(" or {} ", 2),
            setting("max_time").is("60"),
            ": ",
            call("year").with(setting("hours").is("groups")).with(setting("csv")),
        ];
        let said = "run it with --by-light or 2 --max-time 60: `phylux year --hours groups --csv`";
        assert_eq!(words.spelled(&CommandLine), said);
        assert_eq!(words.spelled(&Loud), "run it with by_light! or 2 max_time!: YEAR");
    }
}
