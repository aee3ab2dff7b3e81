//! What concerns the daemon itself: `[log]`, `[realtime]`, `[metrics]` and `[audit]`.

use core::ops::RangeInclusive;
use std::net::SocketAddr;
use std::path::PathBuf;

use profiles::reader::{Node, Spanned, Table};

use crate::gateway::{address, path, section};

/// How much is logged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Nothing.
    Off,
    /// What stops the daemon from doing its work.
    Error,
    /// What somebody should look at.
    Warn,
    /// What changes.
    #[default]
    Info,
    /// What helps to find the cause of trouble.
    Debug,
    /// Everything.
    Trace,
}

impl Level {
    /// Every level, from nothing to everything.
    pub const ALL: [Self; 6] = [Self::Off, Self::Error, Self::Warn, Self::Info, Self::Debug, Self::Trace];

    /// The word for it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Error => "error",
            Self::Warn => "warn",
            Self::Info => "info",
            Self::Debug => "debug",
            Self::Trace => "trace",
        }
    }

    /// The level that this word stands for.
    #[must_use]
    pub fn from_name(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|level| level.name() == word)
    }
}

/// What a line of the log looks like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LogFormat {
    /// As fields to the journal where standard error is connected to it, else as plain lines.
    #[default]
    Auto,
    /// Lines for people on standard error.
    Plain,
    /// A JSON object in each line on standard error.
    Json,
    /// As fields to the journal.
    Journal,
}

impl LogFormat {
    const ALL: [Self; 4] = [Self::Auto, Self::Plain, Self::Json, Self::Journal];

    /// The word for it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Plain => "plain",
            Self::Json => "json",
            Self::Journal => "journal",
        }
    }
}

/// What the log can be told to say more or less of, each a module with lines of its own.
pub const LOG_MODULES: [&str; 6] = ["audit", "bus", "device", "metrics", "service", "storage"];

/// `[log]`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Log {
    /// How much of modules that [`Log::modules`] does not have.
    pub level: Level,
    /// How much of single modules of [`LOG_MODULES`].
    pub modules: Vec<(&'static str, Level)>,
    /// How it looks.
    pub format: LogFormat,
}

/// `[realtime]`: what the thread that moves the axes asks of the operating system.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Realtime {
    /// Priority under `SCHED_FIFO`, 1-99; the usual scheduling without one.
    pub priority: Option<u8>,
    /// The processors that it may run on; all without one.
    pub cpus: Vec<u16>,
    /// Whether the memory of the process stays in RAM.
    pub lock_memory: bool,
}

/// `[audit]`: who commanded what.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Audit {
    /// Whether it is written.
    pub is_on: bool,
    /// The directory of its files; without one they are beside what devices store.
    pub path: Option<PathBuf>,
    /// Size at which a file is full, in KiB.
    pub file_kib: u32,
    /// Files that are kept.
    pub files: u8,
}

impl Default for Audit {
    fn default() -> Self {
        Self { is_on: true, path: None, file_kib: 1024, files: 8 }
    }
}

/// All of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Service {
    /// What is logged.
    pub log: Log,
    /// How the core thread runs.
    pub realtime: Realtime,
    /// Where metrics are served; nowhere without an address.
    pub metrics: Option<SocketAddr>,
    /// What is kept of who commanded what.
    pub audit: Audit,
}

/// Priorities of `SCHED_FIFO` (sched(7)).
const PRIORITIES: RangeInclusive<u8> = 1..=99;
/// Processors that the operating system knows at most (`CPU_SETSIZE`).
const CPUS: RangeInclusive<u16> = 0..=1023;
const FILE_KIB: RangeInclusive<u32> = 16..=1_048_576;
const FILES: RangeInclusive<u8> = 2..=100;

/// Reads the tables that are there.
pub(crate) fn read(file: &mut Table<'_, '_>) -> Service {
    let metrics = |table: &mut Table<'_, '_>| {
        let listen = table.require::<Spanned<&str>>("listen")?;
        address(&listen, "127.0.0.1:9464", table.report)
    };
    Service {
        log: section(file, "log", |table| Some(log(table))).unwrap_or_default(),
        realtime: section(file, "realtime", |table| Some(realtime(table))).unwrap_or_default(),
        metrics: section(file, "metrics", metrics),
        audit: section(file, "audit", |table| Some(audit(table))).unwrap_or_default(),
    }
}

fn log(table: &mut Table<'_, '_>) -> Log {
    let level = table.word("level", Level::from_name, Level::ALL.map(Level::name));
    let parse = |word: &str| LogFormat::ALL.into_iter().find(|format| format.name() == word);
    let format = table.word("format", parse, LogFormat::ALL.map(LogFormat::name));
    let mut modules = Vec::new();
    if let Some(node) = table.get::<Node>("modules") {
        let mut of_modules = node.open(table.report);
        for module in LOG_MODULES {
            let level = of_modules.word(module, Level::from_name, Level::ALL.map(Level::name));
            modules.extend(level.map(|level| (module, level.into_inner())));
        }
        of_modules.finish();
    }
    Log {
        level: level.map(Spanned::into_inner).unwrap_or_default(),
        modules,
        format: format.map(Spanned::into_inner).unwrap_or_default(),
    }
}

fn realtime(table: &mut Table<'_, '_>) -> Realtime {
    let priority = table.get_in("priority", PRIORITIES);
    let cpus: Vec<Spanned<u16>> = table.get("cpus").unwrap_or_default();
    for cpu in cpus.iter().filter(|cpu| !CPUS.contains(cpu.get_ref())) {
        let help = format!("write numbers from {} to {}", CPUS.start(), CPUS.end());
        table.report.error(&cpu.span(), format!("there is no processor {}", cpu.get_ref()), help);
    }
    let cpus = cpus.into_iter().map(Spanned::into_inner).collect();
    Realtime { priority, cpus, lock_memory: table.get("lock_memory").unwrap_or(false) }
}

fn audit(table: &mut Table<'_, '_>) -> Audit {
    let usual = Audit::default();
    let path = if table.has("path") {
        path(table, "path", "audit trail needs a directory", "/var/log/axisd")
    } else {
        table.ignore(&["path"]);
        None
    };
    Audit {
        is_on: table.get("enabled").unwrap_or(usual.is_on),
        path,
        file_kib: table.get_in("file_kib", FILE_KIB).unwrap_or(usual.file_kib),
        files: table.get_in("files", FILES).unwrap_or(usual.files),
    }
}
