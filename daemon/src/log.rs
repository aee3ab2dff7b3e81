//! The log: lines on standard error or fields to the journal, written by a thread of their own so that nobody waits for the
//! reader.
//!
//! Each line belongs to a module, the target of its event, and names what it is about in fields: `device`, `bus`, `node`
//! and `code`. How much each module says can be changed while the daemon runs ([`Dial`]).

mod journal;
mod limiter;

use std::env;
use std::io::{self, IsTerminal};

use config::{LOG_MODULES, Level, Log, LogFormat};
use thiserror::Error;
use tracing::level_filters::LevelFilter;
use tracing::{Subscriber, warn};
use tracing_appender::non_blocking::{NonBlocking, NonBlockingBuilder, WorkerGuard};
use tracing_subscriber::filter::Targets;
use tracing_subscriber::fmt::format;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::registry::LookupSpan;
use tracing_subscriber::util::SubscriberInitExt;
use tracing_subscriber::{Layer, Registry, fmt, reload};

use journal::{Native, Socket};

pub(crate) use limiter::{Limiter, Subject};

/// Lines that may wait for the reader of the log; more are dropped.
const MAX_WAITING: usize = 1024;

/// The modules of the log, as [`LOG_MODULES`] lists them.
pub(crate) mod module {
    /// Who commanded what: trouble with writing it down.
    pub(crate) const AUDIT: &str = "audit";
    /// Interfaces and their controllers.
    pub(crate) const BUS: &str = "bus";
    /// What devices and their nodes go through.
    pub(crate) const DEVICE: &str = "device";
    /// Where metrics are asked for.
    pub(crate) const METRICS: &str = "metrics";
    /// The daemon itself.
    pub(crate) const SERVICE: &str = "service";
    /// What devices store.
    pub(crate) const STORAGE: &str = "storage";
}

/// Says more or less while the daemon runs.
#[derive(Clone, Debug)]
pub struct Dial(reload::Handle<Targets, Registry>);

/// What the log does not do.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum LogError {
    /// The word is no level.
    #[error("no level `{0}`; there are: off, error, warn, info, debug, trace")]
    Level(String),
    /// The word is no module.
    #[error("no module `{0}`; there are: {list}", list = LOG_MODULES.join(", "))]
    Module(String),
    /// There is no log any more.
    #[error("the log is closed")]
    Closed,
}

/// Starts the log. What waits is written when the guard is dropped.
pub(crate) fn start(log: &Log) -> (WorkerGuard, Dial) {
    let (filter, handle) = reload::Layer::new(targets(log, env::var("RUST_LOG").ok().as_deref()));
    let registry = tracing_subscriber::registry().with(filter);
    let is_journal = match log.format {
        LogFormat::Auto => journal::has_standard_error(),
        LogFormat::Journal => true,
        LogFormat::Plain | LogFormat::Json => false,
    };
    let socket = if is_journal { Socket::open(journal::PLACE) } else { Ok(None) };
    let builder = NonBlockingBuilder::default().buffered_lines_limit(MAX_WAITING).lossy(true);
    let trouble = match socket {
        Ok(Some(socket)) => {
            let (writer, guard) = builder.finish(socket);
            let layer = fmt::layer().event_format(Native).with_ansi(false).with_writer(writer);
            registry.with(layer).init();
            return (guard, Dial(handle));
        }
        Ok(None) => None,
        Err(error) => Some(error),
    };
    let (writer, guard) = builder.finish(io::stderr());
    if log.format == LogFormat::Json {
        registry.with(fmt::layer().json().flatten_event(true).with_writer(writer)).init();
    } else {
        registry.with(plain(writer)).init();
    }
    if let Some(error) = trouble {
        warn!(target: module::SERVICE, "no journal at {}: {error}", journal::PLACE);
    }
    (guard, Dial(handle))
}

/// Lines for people: the message says it all, fields would say it twice.
fn plain<S>(writer: NonBlocking) -> Box<dyn Layer<S> + Send + Sync>
where
    S: Subscriber + for<'s> LookupSpan<'s>,
{
    let message = format::debug_fn(|writer, field, value| match field.name() {
        "message" => write!(writer, "{value:?}"),
        _ => Ok(()),
    });
    let lines = fmt::layer()
        .fmt_fields(message)
        .with_target(false)
        .with_ansi(io::stderr().is_terminal())
        .with_writer(writer);
    // The journal has its own time stamps.
    if env::var_os("JOURNAL_STREAM").is_some() { lines.without_time().boxed() } else { lines.boxed() }
}

/// What is let through: what the environment says, else the configuration.
fn targets(log: &Log, environment: Option<&str>) -> Targets {
    if let Some(targets) = environment.filter(|text| !text.is_empty()).and_then(|text| text.parse().ok()) {
        return targets;
    }
    let modules = log.modules.iter().map(|(module, level)| (*module, filter(*level)));
    Targets::new().with_default(filter(log.level)).with_targets(modules)
}

fn filter(level: Level) -> LevelFilter {
    match level {
        Level::Off => LevelFilter::OFF,
        Level::Error => LevelFilter::ERROR,
        Level::Warn => LevelFilter::WARN,
        Level::Info => LevelFilter::INFO,
        Level::Debug => LevelFilter::DEBUG,
        Level::Trace => LevelFilter::TRACE,
    }
}

impl Dial {
    /// Changes it as `order` says: `LEVEL` for all modules, or `MODULE=LEVEL`.
    ///
    /// # Errors
    /// There is no such level or module; nothing changes then.
    pub fn turn(&self, order: &str) -> Result<(), LogError> {
        let (module, level) = match order.split_once('=') {
            Some((module, level)) => (Some(module.trim()), level.trim()),
            None => (None, order.trim()),
        };
        let level = Level::from_name(level).ok_or_else(|| LogError::Level(level.to_owned()))?;
        let known = module.map(|module| {
            let known = LOG_MODULES.into_iter().find(|known| *known == module);
            known.ok_or_else(|| LogError::Module(module.to_owned()))
        });
        let module = known.transpose()?;
        let change = |targets: &mut Targets| {
            *targets = match module {
                None => Targets::new().with_default(filter(level)),
                Some(module) => targets.clone().with_target(module, filter(level)),
            };
        };
        self.0.modify(change).map_err(|_| LogError::Closed)
    }

    /// Makes it what the configuration says, as far as the environment does not.
    ///
    /// # Errors
    /// There is no log any more.
    pub(crate) fn reset(&self, log: &Log) -> Result<(), LogError> {
        let targets = targets(log, env::var("RUST_LOG").ok().as_deref());
        self.0.reload(targets).map_err(|_| LogError::Closed)
    }

    /// What it says of each module, in words.
    ///
    /// # Errors
    /// There is no log any more.
    pub fn levels(&self) -> Result<Vec<(String, String)>, LogError> {
        let level = |targets: &Targets, module: &str| {
            let own = targets.iter().find(|(target, _)| *target == module).map(|(_, level)| level);
            let level = own.or_else(|| targets.default_level()).unwrap_or(LevelFilter::OFF);
            (module.to_owned(), level.to_string())
        };
        let levels = |targets: &Targets| LOG_MODULES.iter().map(|module| level(targets, module)).collect();
        self.0.with_current(levels).map_err(|_| LogError::Closed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dial(log: &Log) -> (reload::Layer<Targets, Registry>, Dial) {
        let (layer, handle) = reload::Layer::new(targets(log, None));
        (layer, Dial(handle))
    }

    fn of(dial: &Dial, module: &str) -> String {
        dial.levels().unwrap().into_iter().find(|(known, _)| known == module).unwrap().1
    }

    #[test]
    fn modules_have_levels_of_their_own_until_all_get_one() {
        let modules = vec![(module::BUS, Level::Debug), (module::DEVICE, Level::Off)];
        let (_layer, dial) = dial(&Log { level: Level::Warn, modules, ..Log::default() });
        assert_eq!([of(&dial, "bus"), of(&dial, "device"), of(&dial, "audit")], ["debug", "off", "warn"]);
        dial.turn("audit=trace").unwrap();
        assert_eq!([of(&dial, "bus"), of(&dial, "device"), of(&dial, "audit")], ["debug", "off", "trace"]);
        dial.turn("info").unwrap();
        assert_eq!([of(&dial, "bus"), of(&dial, "device"), of(&dial, "audit")], ["info"; 3]);
    }

    #[test]
    fn a_wrong_order_changes_nothing() {
        let (_layer, dial) = dial(&Log::default());
        assert_eq!(dial.turn("loud"), Err(LogError::Level("loud".to_owned())));
        assert_eq!(dial.turn("buses=info"), Err(LogError::Module("buses".to_owned())));
        assert_eq!(dial.turn("bus="), Err(LogError::Level(String::new())));
        assert_eq!(of(&dial, "bus"), "info");
    }

    #[test]
    fn every_module_can_be_configured() {
        let all =
            [module::AUDIT, module::BUS, module::DEVICE, module::METRICS, module::SERVICE, module::STORAGE];
        assert_eq!(all, LOG_MODULES);
    }

    #[test]
    fn the_environment_comes_before_the_configuration() {
        let log = Log { level: Level::Warn, ..Log::default() };
        assert_eq!(targets(&log, Some("device=debug")).default_level(), None);
        assert_eq!(targets(&log, Some("")).default_level(), Some(LevelFilter::WARN));
    }
}
