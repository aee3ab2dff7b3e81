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

/// Reads a file.
pub type ReadFile<'r> = &'r dyn Fn(&Path) -> io::Result<Vec<u8>>;

/// Loads each profile once for each motor.
pub(crate) struct Resolver<'r> {
    directory: &'r Path,
    read: ReadFile<'r>,
    sources: HashMap<String, Source>,
    /// What was found in profile files.
    pub(crate) findings: Vec<Diagnostic>,
}

/// A profile file and what was made of it so far.
struct Source {
    file: String,
    text: Arc<str>,
    /// Whether it is an electronic data sheet, which has no motors to choose from.
    is_sheet: bool,
    /// The profile with the default motor, then those with others; empty if the file is wrong.
    loaded: Vec<Arc<Profile>>,
}

impl<'r> Resolver<'r> {
    /// A resolver of paths relative to `directory`.
    pub(crate) fn new(directory: &'r Path, read: ReadFile<'r>) -> Self {
        Self { directory, read, sources: HashMap::new(), findings: Vec::new() }
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
        let Source { file, text, is_sheet, .. } = self.sources.get(*name.get_ref())?;
        let own = own.filter(|_| !is_sheet);
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
        let profile = Arc::new(profile.map_err(|Diagnostics(wrong)| self.findings.extend(wrong)).ok()?);
        source.loaded.push(Arc::clone(&profile));
        Some(profile)
    }

    /// Finds the file of the profile `name` and loads it with its default motor.
    fn open(&mut self, name: &Spanned<&str>, report: &mut Report) -> Option<Source> {
        let (file, bytes) = self.locate(name, report)?;
        if is_data_sheet(name.get_ref()) {
            let (profile, Diagnostics(found)) = Profile::from_data_sheet(&file, &bytes);
            self.findings.extend(found);
            // One character for each byte tells every change, whatever the file is written in.
            let text = bytes.into_iter().map(char::from).collect::<String>().into();
            let loaded = profile.into_iter().map(Arc::new).collect();
            return Some(Source { file, text, is_sheet: true, loaded });
        }
        let Ok(text) = String::from_utf8(bytes) else {
            report.error(&name.span(), format!("{file} is no UTF-8 text"), None);
            return None;
        };
        let default = Profile::parse(&file, &text, None);
        let default = default.map_err(|Diagnostics(wrong)| self.findings.extend(wrong)).ok();
        let loaded = default.into_iter().map(Arc::new).collect();
        Some(Source { file, text: text.into(), is_sheet: false, loaded })
    }

    /// Name and bytes of the file of the profile `name`.
    fn locate(&self, name: &Spanned<&str>, report: &mut Report) -> Option<(String, Vec<u8>)> {
        let word = *name.get_ref();
        let places = self.places(word);
        let mut missing = None;
        for path in &places {
            match (self.read)(path) {
                Ok(bytes) => return Some((path.display().to_string(), bytes)),
                Err(error) if error.kind() == io::ErrorKind::NotFound => missing = Some(error),
                Err(error) => {
                    report.error(&name.span(), format!("cannot read {}: {error}", path.display()), None);
                    return None;
                }
            }
        }
        if let Some(text) = Profile::text(word) {
            return Some((format!("{word}.toml"), text.as_bytes().to_vec()));
        }
        match missing.filter(|_| is_file(word)) {
            Some(error) => {
                let places: Vec<_> = places.iter().map(|path| path.display().to_string()).collect();
                let message = format!("cannot read {}: {error}", places.join(" or "));
                report.error(&name.span(), message, None);
            }
            None => report.unknown(&name.span(), "profile", word, Profile::names()),
        }
        None
    }

    /// Where the file of the profile `word` may be, the first place first.
    fn places(&self, word: &str) -> Vec<PathBuf> {
        let of_machine = Path::new(PROFILE_DIRECTORY);
        if !is_file(word) {
            return vec![of_machine.join(format!("{word}.toml"))];
        }
        let own = self.directory.join(word);
        if is_data_sheet(word) && !word.contains('/') { vec![own, of_machine.join(word)] } else { vec![own] }
    }
}

/// Whether this is the name of a file, not that of a profile.
fn is_file(name: &str) -> bool {
    name.contains('/') || name.ends_with(".toml") || is_data_sheet(name)
}

/// Whether a profile of this name is an electronic data sheet (EDS) or a device configuration file (DCF).
fn is_data_sheet(name: &str) -> bool {
    let ending = Path::new(name).extension().and_then(|ending| ending.to_str());
    ending.is_some_and(|ending| ["eds", "dcf"].iter().any(|known| ending.eq_ignore_ascii_case(known)))
}
