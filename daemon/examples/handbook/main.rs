//! Writes what is made from the command lines and from docs/configuration.md: manual pages and completions for shells.
//!
//! `cargo run --package daemon --example handbook DIRECTORY` fills `DIRECTORY/man` and `DIRECTORY/completions`.

mod markdown;

use std::env;
use std::error::Error;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Command;
use clap_complete::Shell;
use clap_mangen::Man;
use clap_mangen::roff::{Roff, bold, roman};

const CONFIGURATION: &str = include_str!("../../../docs/configuration.md");

/// A program and its section of the manual.
struct Program {
    command: Command,
    section: &'static str,
    /// Sections of the first page after those that are made from the command line.
    more: &'static [(&'static str, &'static [(&'static str, &'static str)])],
}

fn main() -> Result<(), Box<dyn Error>> {
    let directory: PathBuf = env::args_os().nth(1).ok_or("say where: handbook DIRECTORY")?.into();
    let (man, completions) = (directory.join("man"), directory.join("completions"));
    fs::create_dir_all(&man)?;
    fs::create_dir_all(&completions)?;
    for Program { command, section, more } in programs() {
        for shell in [Shell::Bash, Shell::Zsh, Shell::Fish] {
            let name = command.get_name().to_owned();
            clap_complete::generate_to(shell, &mut command.clone(), name, &completions)?;
        }
        let mut command = command.disable_help_subcommand(true);
        command.build();
        write_pages(&command, section, more, &man)?;
    }
    fs::write(man.join("axisd.toml.5"), markdown::to_man("axisd.toml", "5", CONFIGURATION))?;
    Ok(())
}

fn programs() -> [Program; 2] {
    [
        Program {
            command: daemon::cli::command(),
            section: "8",
            more: &[
                (
                    "EXIT STATUS",
                    &[
                        ("0", "It was told to stop by SIGTERM or SIGINT, and its axes have come to rest."),
                        ("1", "Something failed at run time."),
                        ("2", "The command line is wrong."),
                        ("78", "The configuration is wrong; standard error says where."),
                    ],
                ),
                (
                    "ENVIRONMENT",
                    &[
                        ("RUST_LOG", "What is logged, such as debug or warn; info otherwise."),
                        (
                            "NOTIFY_SOCKET, WATCHDOG_USEC",
                            "As in sd_notify(3): the core loop feeds the watchdog.",
                        ),
                        (
                            "RUNTIME_DIRECTORY",
                            "Where the control socket is if the configuration does not say it.",
                        ),
                        ("STATE_DIRECTORY", "Where devices store if the configuration does not say it."),
                    ],
                ),
                (
                    "FILES",
                    &[
                        ("/etc/axisd/axisd.toml", "Configuration of axisd.service; see axisd.toml(5)."),
                        ("/etc/axisd/NAME.toml", "Configuration of axisd@NAME.service."),
                        ("/etc/axisd/devices", "Device profiles of this machine."),
                        ("/var/lib/axisd", "What devices have stored."),
                        ("/run/axisd/control.sock", "The control socket, for members of the group axisd."),
                    ],
                ),
                ("SEE ALSO", &[("axisctl(1), axisd.toml(5), systemctl(1)", "")]),
            ],
        },
        Program {
            command: daemon::axisctl::command(),
            section: "1",
            more: &[
                (
                    "EXIT STATUS",
                    &[
                        ("0", "Done."),
                        ("1", "No daemon answers, or it refuses."),
                        ("2", "The command line is wrong."),
                    ],
                ),
                ("SEE ALSO", &[("axisd(8)", "")]),
            ],
        },
    ]
}

/// The page of a command and, below it, those of its subcommands.
fn write_pages(
    command: &Command,
    section: &str,
    more: &[(&str, &[(&str, &str)])],
    directory: &Path,
) -> Result<(), Box<dyn Error>> {
    for subcommand in command.get_subcommands().filter(|subcommand| !subcommand.is_hide_set()) {
        write_pages(subcommand, section, &[], directory)?;
    }
    let man = Man::new(command.clone()).section(section).manual("axisd");
    let mut file = File::create(directory.join(man.get_filename()))?;
    man.render(&mut file)?;
    let mut roff = Roff::new();
    for (heading, entries) in more {
        roff.control("SH", [*heading]);
        for (term, text) in *entries {
            roff.control("TP", []);
            roff.text([bold(*term)]);
            roff.text([roman(*text)]);
        }
    }
    // Without the macros at its begin, which the page has already.
    file.write_all(roff.to_roff().as_bytes())?;
    Ok(())
}
