//! Motion by the control socket: a sequence of reads and writes as long as its client is there.
//!
//! A client that leaves, that says anything but an empty line or, while an axis jogs, that says nothing for too long, has
//! its axis halted before all else is forgotten.

use core::time::Duration;
use std::io;
use std::sync::Arc;

use od::{Address, Instant, Schema};
use profiles::{Profile, error_text};
use serde::{Deserialize, Serialize};
use tokio::io::{AsyncBufReadExt, BufReader};
use tokio::net::UnixStream;
use tokio::time::{MissedTickBehavior, interval, timeout};

use super::errand::{Described, Errand, ObjectError, ObjectOrder};
use super::objects::describe;
use super::orders::Orders;
use super::request::{Request, Response};
use super::server::{ToCore, say};
use crate::core::Authority;
use crate::motion::{Goal, Next, READ, Sequence, Setting, View, is_optional, part};
use crate::objects;

/// How often an axis is looked at.
const PERIOD: Duration = Duration::from_millis(20);
/// Looks between two lines of progress.
const LOOKS_PER_LINE: u32 = 10;
/// How long a client whose axis jogs may give no sign of life.
const LONGEST_SILENCE: Duration = Duration::from_secs(2);
/// How long a client may take to accept a line of progress.
const PATIENCE: Duration = Duration::from_secs(1);
/// Failures to reach the core in a row after which nothing can be done any more.
const MOST_FAILURES: u32 = 5;

/// How far a motion is.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Progress {
    /// Name of the device.
    pub device: String,
    /// Number of the axis, from 1.
    pub axis: usize,
    /// State of the drive.
    pub state: String,
    /// Actual position, in user units.
    pub position: i64,
    /// Actual velocity, in user units, if the device tells it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<i64>,
    /// Distance to the target, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub remaining: Option<i64>,
}

/// How a motion has ended.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ended {
    /// Name of the device.
    pub device: String,
    /// Number of the axis, from 1.
    pub axis: usize,
    /// Actual position, in user units.
    pub position: i64,
    /// What has come of it.
    pub text: String,
}

/// One axis on its way.
struct Mover {
    device: String,
    profile: Arc<Profile>,
    /// From 0.
    axis: u8,
    sequence: Sequence,
    /// What it is for, until the core was told.
    goal: Option<Goal>,
    view: View,
    /// What is to be written at the next look.
    settings: Vec<Setting>,
    failures: u32,
    end: Option<Result<String, String>>,
}

/// What the client is to be told, and whether it is there.
struct Audience<'s> {
    stream: &'s mut BufReader<UnixStream>,
    is_gone: bool,
    /// When it gave its last sign of life.
    heard: Instant,
    /// Whether it is in the middle of a line that is no request.
    is_within_line: bool,
}

/// Does what a request for motion asks, and tells the client until it is over.
pub(super) async fn serve(
    stream: &mut BufReader<UnixStream>,
    to_core: &ToCore,
    request: Request,
) -> io::Result<()> {
    let mut movers = match movers(&to_core.orders, request).await {
        Ok(movers) => movers,
        Err(error) => return say(stream.get_mut(), &Response::Error(error)).await,
    };
    let heard = to_core.clock.now();
    let mut audience = Audience { stream, is_gone: false, heard, is_within_line: false };
    let mut ticks = interval(PERIOD);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut looks = 0;
    while movers.iter().any(|mover| mover.end.is_none()) {
        tokio::select! {
            said_more = audience.listen() => {
                audience.heard = to_core.clock.now();
                if said_more {
                    movers.iter_mut().for_each(|mover| mover.sequence.interrupt());
                }
                continue;
            }
            _ = ticks.tick() => {}
        }
        let now = to_core.clock.now();
        let is_silent = now > audience.heard + LONGEST_SILENCE;
        for mover in movers.iter_mut().filter(|mover| mover.end.is_none()) {
            if is_silent && mover.sequence.is_jog() {
                mover.sequence.interrupt();
            }
            mover.look(now, &to_core.orders).await;
        }
        looks += 1;
        if looks % LOOKS_PER_LINE == 0 && !audience.tell(&movers).await {
            movers.iter_mut().for_each(|mover| mover.sequence.interrupt());
        }
    }
    audience.conclude(&movers).await
}

/// The axes that a request is about.
async fn movers(orders: &Orders, request: Request) -> Result<Vec<Mover>, String> {
    let (device, axis, goal) = match request {
        Request::Move { device, axis, position, relative, velocity, acceleration } => {
            (Some(device), axis, Goal::Move { position, is_relative: relative, velocity, acceleration })
        }
        Request::Jog { device, axis, velocity, acceleration, time_ms } => {
            let time = time_ms.map(Duration::from_millis);
            (Some(device), axis, Goal::Jog { velocity, acceleration, time })
        }
        Request::Home { device, axis, method } => (Some(device), axis, Goal::Home { method }),
        Request::Stop { device, axis } => (device, axis, Goal::Stop),
        Request::Version {}
        | Request::Status {}
        | Request::FaultInject { .. }
        | Request::FaultClear { .. }
        | Request::FaultList { .. }
        | Request::SignalSet { .. }
        | Request::SignalList { .. }
        | Request::Reload {}
        | Request::Log { .. }
        | Request::Audit { .. }
        | Request::OdList { .. }
        | Request::OdRead { .. }
        | Request::OdWrite { .. }
        | Request::OdExport { .. }
        | Request::Claim { .. }
        | Request::Release { .. }
        | Request::Nmt { .. }
        | Request::Lss { .. }
        | Request::Dump { .. } => return Err("that is no motion".to_owned()),
    };
    let is_stop = goal == Goal::Stop;
    let described = match device {
        Some(device) => vec![describe(orders, device).await?],
        None => orders.place(Errand::Describe, None).await??,
    };
    let mut movers = Vec::new();
    for device in described {
        let axes = match axes(&device, axis, is_stop) {
            Ok(axes) => axes,
            Err(_) if is_stop && device.profile.axes() == 0 => continue,
            Err(error) => return Err(error),
        };
        movers.extend(axes.map(|axis| Mover::new(&device, axis, goal)));
    }
    Ok(movers)
}

/// Numbers from 0 of the axes that are meant: one, or to stop all of them.
fn axes(device: &Described, axis: Option<usize>, all: bool) -> Result<core::ops::Range<u8>, String> {
    let (name, count) = (&device.device, device.profile.axes());
    match (count, axis) {
        (0, _) => Err(format!("device `{name}` has no axis")),
        (_, None) if all => Ok(0..count),
        (_, None) => Ok(0..1),
        (_, Some(axis @ 1..)) if axis <= usize::from(count) => Ok(axis as u8 - 1..axis as u8),
        (1, Some(axis)) => Err(format!("device `{name}` has no axis {axis}, only axis 1")),
        (_, Some(axis)) => Err(format!("device `{name}` has no axis {axis}, only 1 to {count}")),
    }
}

impl Mover {
    fn new(device: &Described, axis: u8, goal: Goal) -> Self {
        let (device, profile) = (device.device.clone(), Arc::clone(&device.profile));
        let (sequence, goal, view) = (Sequence::new(goal, axis), Some(goal), View::default());
        Self { device, profile, axis, sequence, goal, view, settings: Vec::new(), failures: 0, end: None }
    }

    /// Writes what is to be written, looks at the axis and thinks about what comes next.
    async fn look(&mut self, now: Instant, orders: &Orders) {
        let writes = match self.encode() {
            Ok(writes) => writes,
            Err(error) => return self.end = Some(Err(error)),
        };
        let reads: Vec<Address> = READ.iter().map(|index| part(*index, self.axis)).collect();
        // What brings the axis to rest the operator may do even if somebody else owns it now.
        let authority = if self.sequence.is_halting() { Authority::Stop } else { Authority::Owner };
        let device = self.device.clone();
        let motion = self.goal.map(|goal| (usize::from(self.axis), goal));
        let order = ObjectOrder { device, node: 0, writes, reads: reads.clone(), authority, motion };
        match orders.place(Errand::Objects, order).await {
            Ok(Ok(values)) => {
                (self.failures, self.goal) = (0, None);
                let number = |(address, value): (&Address, _)| self.number(*address, value);
                let numbers: Vec<Option<i64>> = reads.iter().zip(values).map(number).collect();
                self.settings.clear();
                match View::new(&numbers) {
                    Some(view) => self.think(now, view),
                    None => self.end = Some(Err("the axis does not speak CiA 402".to_owned())),
                }
            }
            Ok(Err(ObjectError::Refused(refused))) => {
                self.end = Some(Err(format!("{}: {}", self.named(refused.address), refused.code)));
            }
            Ok(Err(ObjectError::Unknown(unknown))) => self.end = Some(Err(unknown)),
            // What is to be written still is; whatever happens, the axis is not to run on.
            Err(error) => {
                self.failures += 1;
                self.sequence.interrupt();
                if self.failures >= MOST_FAILURES {
                    self.end = Some(Err(error));
                }
            }
        }
    }

    fn think(&mut self, now: Instant, view: View) {
        self.view = view;
        match self.sequence.next(now, &view) {
            Next::Wait => {}
            Next::Write(settings) => self.settings = settings,
            Next::Done(text) => self.end = Some(Ok(text)),
            Next::Failed(text) if view.error != 0 => {
                let words = error_text(view.error, self.profile.dialect);
                self.end = Some(Err(format!("{text} ({words})")));
            }
            Next::Failed(text) => self.end = Some(Err(text)),
        }
    }

    /// The settings as an SDO carries them.
    fn encode(&self) -> Result<Vec<(Address, Vec<u8>)>, String> {
        let encode = |(address, number): &Setting| {
            let schema = &self.profile.application;
            let entry = schema.slot(*address).and_then(|slot| schema.entry(slot));
            let entry = entry.ok_or_else(|| format!("there is no {address}"))?;
            let bytes = objects::parse(entry.data_type, &number.to_string());
            bytes.map(|bytes| (*address, bytes)).map_err(|error| format!("{}: {error}", self.named(*address)))
        };
        let has = |address: &Address| self.profile.application.slot(*address).is_some();
        let meant =
            self.settings.iter().filter(|(address, _)| has(address) || !is_optional(*address, self.axis));
        meant.map(encode).collect()
    }

    fn number(&self, address: Address, value: Result<od::Value, od::AbortCode>) -> Option<i64> {
        let schema = &self.profile.application;
        let entry = schema.entry(schema.slot(address)?)?;
        i64::try_from(entry.data_type.integer(value.ok()?.raw())).ok()
    }

    fn named(&self, address: Address) -> String {
        let schema: &Schema = &self.profile.application;
        let entry = schema.slot(address).and_then(|slot| schema.entry(slot));
        format!("{address} {}", entry.map_or("", |entry| entry.name.as_str()))
    }

    fn progress(&self) -> Progress {
        Progress {
            device: self.device.clone(),
            axis: usize::from(self.axis) + 1,
            state: self.view.state().name().to_owned(),
            position: self.view.position,
            velocity: self.view.velocity,
            remaining: self.sequence.remaining(&self.view),
        }
    }
}

impl Audience<'_> {
    /// Hears the client. Whether it says that the motion is to end: by leaving, or by any word.
    async fn listen(&mut self) -> bool {
        if self.is_gone {
            return core::future::pending().await;
        }
        let (length, has_words) = match self.stream.fill_buf().await {
            Ok(said) if !said.is_empty() => {
                self.is_within_line = said.last() != Some(&b'\n');
                (said.len(), said.iter().any(|byte| !byte.is_ascii_whitespace()))
            }
            Ok(_) | Err(_) => {
                self.is_gone = true;
                return true;
            }
        };
        self.stream.consume(length);
        has_words
    }

    /// Tells how far the axes are; whether the client takes it.
    async fn tell(&mut self, movers: &[Mover]) -> bool {
        for mover in movers.iter().filter(|mover| mover.end.is_none()) {
            if self.is_gone {
                break;
            }
            let progress = Response::Progress(mover.progress());
            let told = timeout(PATIENCE, say(self.stream.get_mut(), &progress)).await;
            self.is_gone = !matches!(told, Ok(Ok(())));
        }
        !self.is_gone
    }

    /// Tells how it has ended.
    async fn conclude(mut self, movers: &[Mover]) -> io::Result<()> {
        let name = |mover: &Mover| match mover.profile.axes() {
            0 | 1 => mover.device.clone(),
            _ => format!("{}, axis {}", mover.device, mover.axis + 1),
        };
        let failed = |mover: &Mover| match &mover.end {
            Some(Err(error)) => Some(format!("{}: {error}; position {}", name(mover), mover.view.position)),
            Some(Ok(_)) | None => None,
        };
        let failures: Vec<String> = movers.iter().filter_map(failed).collect();
        let ended = |mover: &Mover| Ended {
            device: mover.device.clone(),
            axis: usize::from(mover.axis) + 1,
            position: mover.view.position,
            text: mover.end.clone().and_then(Result::ok).unwrap_or_default(),
        };
        let response = match &*failures {
            [] => Response::Done(movers.iter().map(ended).collect()),
            failures => Response::Error(failures.join("; ")),
        };
        self.skip_line().await?;
        say(self.stream.get_mut(), &response).await
    }

    /// Forgets the rest of a line that has ended the motion.
    async fn skip_line(&mut self) -> io::Result<()> {
        while self.is_within_line && !self.is_gone {
            let said = timeout(PATIENCE, self.stream.fill_buf()).await??;
            let end = said.iter().position(|byte| *byte == b'\n');
            let length = end.map_or(said.len(), |end| end + 1);
            self.is_within_line = end.is_none() && length > 0;
            self.stream.consume(length);
        }
        Ok(())
    }
}
