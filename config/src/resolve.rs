//! Finds the profiles that devices name.

use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::defaults::OwnMotor;
use profiles::reader::Spanned;
use profiles::{Diagnostic, Diagnostics, Profile, Report};

/// Where profile files of this machine are looked for before the shipped ones.
pub const PROFILE_DIRECTORY: &str = "/etc/axisd/devices";

/// Reads a file as text.
pub type ReadFile<'r> = &'r dyn Fn(&Path) -> io::Result<String>;

/// Loads each profile once for each motor.
pub(crate) struct Resolver<'r> {
    directory: &'r Path,
    read: ReadFile<'r>,
    sources: HashMap<String, Source>,
    /// What is wrong with profile files.
    pub(crate) wrong: Vec<Diagnostic>,
}

/// A profile file and what was made of it so far.
struct Source {
    file: String,
    text: Arc<str>,
    /// The profile with the default motor, then those with others; empty if the file is wrong.
    loaded: Vec<Arc<Profile>>,
}

impl<'r> Resolver<'r> {
    /// A resolver of paths relative to `directory`.
    pub(crate) fn new(directory: &'r Path, read: ReadFile<'r>) -> Self {
        Self { directory, read, sources: HashMap::new(), wrong: Vec::new() }
    }

    /// The profile `name` with `motor` or its default one, which may have other data, and the text of its file; `None` if
    /// there is none, which is reported.
    pub(crate) fn find(
        &mut self,
        name: &Spanned<&str>,
        motor: Option<&Spanned<&str>>,
        own: Option<&OwnMotor>,
        report: &mut Report,
    ) -> Option<(Arc<Profile>, Arc<str>)> {
        let profile = self.shared(name, motor, report)?;
        let Source { file, text, .. } = self.sources.get(*name.get_ref())?;
        let Some(OwnMotor { data, span }) = own else { return Some((profile, Arc::clone(text))) };
        let wanted = profile.motor.as_ref().map(|motor| motor.name.as_str());
        match Profile::parse_with(file, text, wanted, data) {
            Ok(own) => Some((Arc::new(own), Arc::clone(text))),
            Err(Diagnostics(wrong)) => {
                // The file is good, so it is the data that it does not take.
                let first = wrong.first().map_or("", |wrong| wrong.message.as_str());
                report.error(span, format!("the profile does not take these data: {first}"), None);
                None
            }
        }
    }

    /// The profile that all devices share which have nothing of their own.
    fn shared(
        &mut self,
        name: &Spanned<&str>,
        motor: Option<&Spanned<&str>>,
        report: &mut Report,
    ) -> Option<Arc<Profile>> {
        if !self.sources.contains_key(*name.get_ref()) {
            let source = self.open(name, report)?;
            self.sources.insert((*name.get_ref()).to_owned(), source);
        }
        let source = self.sources.get_mut(*name.get_ref())?;
        let default = source.loaded.first()?;
        let Some(motor) = motor else { return Some(Arc::clone(default)) };
        let wanted = *motor.get_ref();
        let has_wanted = |profile: &&Arc<Profile>| profile.motor.as_ref().is_some_and(|m| m.name == wanted);
        if let Some(loaded) = source.loaded.iter().find(has_wanted) {
            return Some(Arc::clone(loaded));
        }
        if !default.motors.iter().any(|known| known == wanted) {
            report.unknown(&motor.span(), "motor", wanted, default.motors.iter().map(String::as_str));
            return None;
        }
        let profile = Profile::parse(&source.file, &source.text, Some(wanted));
        let profile = Arc::new(profile.map_err(|Diagnostics(wrong)| self.wrong.extend(wrong)).ok()?);
        source.loaded.push(Arc::clone(&profile));
        Some(profile)
    }

    /// Finds the file of the profile `name` and loads it with its default motor.
    fn open(&mut self, name: &Spanned<&str>, report: &mut Report) -> Option<Source> {
        let (file, text) = self.locate(name, report)?;
        let default = Profile::parse(&file, &text, None);
        let default = default.map_err(|Diagnostics(wrong)| self.wrong.extend(wrong)).ok();
        Some(Source { file, text: text.into(), loaded: default.into_iter().map(Arc::new).collect() })
    }

    /// Name and text of the file of the profile `name`.
    fn locate(&self, name: &Spanned<&str>, report: &mut Report) -> Option<(String, String)> {
        let word = *name.get_ref();
        let is_path = word.contains('/') || word.ends_with(".toml");
        let path = if is_path { self.directory.join(word) } else { local(word) };
        match (self.read)(&path) {
            Ok(text) => return Some((path.display().to_string(), text)),
            Err(e) if !is_path && e.kind() == io::ErrorKind::NotFound => {}
            Err(e) => {
                report.error(&name.span(), format!("cannot read {}: {e}", path.display()), None);
                return None;
            }
        }
        let text = Profile::text(word);
        if text.is_none() {
            report.unknown(&name.span(), "profile", word, Profile::names());
        }
        text.map(|text| (format!("{word}.toml"), text.to_owned()))
    }
}

/// Where this machine would have the profile `name`.
fn local(name: &str) -> PathBuf {
    Path::new(PROFILE_DIRECTORY).join(format!("{name}.toml"))
}
