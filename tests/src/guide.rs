//! The commands in our documents, run as a reader would run them.
//!
//! A block of code says what is done with it, behind its language:
//!
//! * `sh run`: it is run to its end, which has to be good; if a block `text` follows, that is what it prints, in which `...`
//!   stands for anything and lines may be left out.
//! * `sh serve`: it is a daemon, which serves until the next one or the end of the document.
//! * `sh elsewhere`: it is not run here.
//! * `LANGUAGE file=NAME`: it is a file that the reader writes.
//!
//! `run` and `serve` may name a [`Place`].

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use nix::sys::signal::Signal;

use crate::daemon::binary;
use crate::process::{Line, Process, Stream};
use crate::{PATIENCE, TempDir, Vcan, free_port};

/// How long a block of commands may take.
const BLOCK_PATIENCE: Duration = Duration::from_secs(120);
/// The ports in our documents: of socketcand and of Modbus.
const PORTS: [&str; 2] = ["29536", "5020"];
/// The interface in our documents.
const INTERFACE: &str = "vcan0";

/// Where commands can be run.
#[derive(Debug, Clone, Copy)]
pub enum Place<'a> {
    /// On any machine.
    Anywhere,
    /// Where this interface stands for vcan0.
    Vcan(&'a Vcan),
    /// In a system with systemd, on which the package is or gets installed.
    Package,
}

impl Place<'_> {
    fn word(self) -> &'static str {
        match self {
            Self::Anywhere => "",
            Self::Vcan(_) => "vcan",
            Self::Package => "package",
        }
    }
}

/// One block of code of a document.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Block {
    /// Its language, and what is done with it.
    pub info: Vec<String>,
    /// Its lines, each with its end.
    pub text: String,
}

/// All blocks of code of a document.
#[must_use]
pub fn blocks(document: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut lines = document.lines();
    while let Some(line) = lines.next() {
        if let Some(info) = line.strip_prefix("```") {
            let text =
                lines.by_ref().take_while(|line| *line != "```").map(|line| format!("{line}\n")).collect();
            blocks.push(Block { info: info.split_whitespace().map(str::to_owned).collect(), text });
        }
    }
    blocks
}

/// Runs what a document of this project has to be run at a place; gives the number of blocks. A document that is not about
/// starting a daemon may find one that serves this configuration.
pub fn tell(document: &str, place: Place<'_>, serving: Option<&str>) -> usize {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let text = fs::read_to_string(root.join(document)).unwrap_or_else(|error| panic!("{document}: {error}"));
    let mut reader = Reader::new(&root, place);
    if let Some(config) = serving {
        reader.write("axisd.toml", config);
        reader.serve("axisd run --config axisd.toml");
    }
    let blocks = blocks(&text);
    let mut done = 0;
    for (number, block) in blocks.iter().enumerate() {
        let info: Vec<&str> = block.info.iter().map(String::as_str).collect();
        let is_here = info.get(2).copied().unwrap_or_default() == place.word();
        match info[..] {
            ["sh", "run", ..] if is_here => {
                let expected = blocks.get(number + 1).filter(|next| next.info == ["text"]);
                reader.run(&block.text, expected.map(|expected| expected.text.as_str()));
            }
            ["sh", "serve", ..] if is_here => reader.serve(&block.text),
            [_, file] if file.starts_with("file=") => reader.write(&file["file=".len()..], &block.text),
            _ => continue,
        }
        done += 1;
    }
    done
}

/// Somebody who works through a document, in a directory that looks like a clone of the project.
struct Reader<'a> {
    dir: TempDir,
    place: Place<'a>,
    /// What stands for [`PORTS`] here.
    ports: [String; 2],
    daemon: Option<Process>,
}

impl<'a> Reader<'a> {
    fn new(root: &Path, place: Place<'a>) -> Self {
        let reader =
            Self { dir: TempDir::new(), place, ports: PORTS.map(|_| free_port().to_string()), daemon: None };
        for name in [".venv", "config"] {
            std::os::unix::fs::symlink(root.join(name), reader.dir.path().join(name))
                .expect("link to the project");
        }
        fs::create_dir(reader.dir.path().join("examples")).expect("make a directory");
        if let (Place::Package, Ok(package)) = (place, std::env::var("AXISD_DEB")) {
            let name = Path::new(&package).file_name().expect("it is a file");
            std::os::unix::fs::symlink(&package, reader.dir.path().join(name)).expect("link to the package");
        }
        let example = fs::read_to_string(root.join("examples/move.py")).expect("it is there");
        reader.write("examples/move.py", &example);
        reader
    }

    fn write(&self, name: &str, text: &str) {
        self.dir.write(name, &self.here(text));
    }

    /// Text with what is otherwise here: a port that is free, and an interface of this test.
    fn here(&self, text: &str) -> String {
        let ports = PORTS.into_iter().zip(&self.ports);
        let text = ports.fold(text.to_owned(), |text, (port, own)| text.replace(port, own));
        match self.place {
            Place::Vcan(interface) => text.replace(INTERFACE, interface.name()),
            Place::Anywhere | Place::Package => text,
        }
    }

    /// What bash is to do, with the programs under test as if they were installed.
    fn shell(&self, text: &str) -> Command {
        let [port, _] = &self.ports;
        let demo = format!("run --demo --socketcand 127.0.0.1:{port}");
        let text = self.here(text).replace("cargo run --release -- ", "axisd ").replace("run --demo", &demo);
        let mut command = Command::new("bash");
        // Nobody is asked for a password, and an editor changes nothing.
        let mut prelude =
            "set -euo pipefail\nsudo() { \"$@\"; }\nsudoedit() { test -f \"$1\"; }\n".to_owned();
        // What a reader waits half a second for takes longer on a machine that has a dozen of these to run.
        prelude += "sleep() { command sleep 3; command sleep \"$1\"; }\n";
        if matches!(self.place, Place::Package) {
            command.env("USER", "root");
        } else {
            // A daemon of this machine's owner is not ours.
            prelude += "axisctl() { command axisctl --socket \"$RUNTIME_DIRECTORY/control.sock\" \"$@\"; }\n";
            let path = std::env::var("PATH").unwrap_or_default();
            let programs = binary().parent().expect("it is in a directory");
            command.env("PATH", format!("{}:{path}", programs.display()));
            command.env("RUNTIME_DIRECTORY", self.dir.path().join("run"));
            command.env("STATE_DIRECTORY", self.dir.path().join("state"));
        }
        command.current_dir(self.dir.path()).args(["-c", &format!("{prelude}{text}")]);
        command
    }

    fn run(&self, text: &str, expected: Option<&str>) {
        let mut process = Process::spawn(text.trim_end(), &mut self.shell(text));
        let status = process.wait(BLOCK_PATIENCE);
        if !status.success() {
            process.give_up(&format!("ended with {status}"));
        }
        let printed = process.stdout();
        if let Some(expected) = expected {
            let expected = self.here(expected);
            assert!(prints(&printed, &expected), "{text}prints\n{printed}\nand not\n{expected}");
        }
    }

    fn serve(&mut self, text: &str) {
        self.stop();
        // The signal that ends it is for the daemon, not for a shell around it.
        let mut process = Process::spawn(text.trim_end(), &mut self.shell(&format!("exec {text}")));
        let ready = Line { stream: Stream::Err, text: "axisd ready".to_owned() };
        process.wait_for("line \"axisd ready\"", PATIENCE, |line| *line == ready);
        self.daemon = Some(process);
    }

    fn stop(&mut self) {
        if let Some(mut daemon) = self.daemon.take() {
            daemon.signal(Signal::SIGTERM);
            let status = daemon.wait(PATIENCE);
            if !status.success() {
                daemon.give_up(&format!("ended with {status}"));
            }
        }
    }
}

impl Drop for Reader<'_> {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            self.stop();
        }
    }
}

/// Whether the lines of `expected` come in `printed`, in this order; blanks count once.
fn prints(printed: &str, expected: &str) -> bool {
    let mut lines = printed.lines();
    expected
        .lines()
        .filter(|line| !line.trim().is_empty())
        .all(|wanted| lines.any(|line| is_like(line, wanted)))
}

/// Whether `line` is `wanted`, in which `...` stands for anything.
fn is_like(line: &str, wanted: &str) -> bool {
    let tidy = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let (line, wanted) = (tidy(line), tidy(wanted));
    let mut pieces = wanted.split("...").map(str::trim);
    let Some(mut rest) = pieces.next().and_then(|first| line.strip_prefix(first)) else { return false };
    let mut is_open = false;
    for piece in pieces {
        is_open = true;
        match rest.find(piece) {
            Some(at) => rest = &rest[at + piece.len()..],
            None => return false,
        }
    }
    rest.is_empty() || is_open && wanted.ends_with("...")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_printed_may_have_more_lines_and_other_blanks() {
        assert!(prints("a\nb  c\nd 12 e\n", "b c\nd ... e\n"));
        assert!(prints("(1.5) vcan0 601\n", "... vcan0 601\n"));
        assert!(prints("  Active: yes since\n", "... Active: yes ...\n"));
        assert!(prints("moved from 0 to 10\n", "moved ...\n"));
        assert!(!prints("a\nb\n", "b\na\n"));
        assert!(!prints("moved from 0 to 10\n", "moved from 0 to 1\n"));
        assert!(!prints("moved from 0 to 10\n", "moved ... to 1\n"));
    }

    #[test]
    fn blocks_have_their_marks_and_lines() {
        let found = blocks("text\n```sh run vcan\na\nb\n```\n```\nc\n```\n");
        let block = |info: &[&str], text: &str| Block {
            info: info.iter().map(|&word| word.to_owned()).collect(),
            text: text.to_owned(),
        };
        assert_eq!(found, [block(&["sh", "run", "vcan"], "a\nb\n"), block(&[], "c\n")]);
    }
}
