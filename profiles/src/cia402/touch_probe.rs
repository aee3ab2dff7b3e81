//! The two touch probes (IEC 61800-7-201, 0x60B8-0x60BD, 0x60D0, 0x60D5-0x60D8): positions caught at an edge.
//!
//! The hardware latches the exact count of every edge. Of several edges of one kind in one raster step the last one
//! counts. The zero impulse has no width: it is a positive and a negative edge in one.

use axis::{Edges, Latches, Position, Status};
use bitflags::bitflags;
use od::{AbortCode, Dictionary, Slot};

use crate::Binding;
use crate::slots::{Parameters, Slots};

bitflags! {
    /// One byte of 0x60B8: the first probe has the lower one.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    struct Function: u8 {
        /// The probe is on.
        const ENABLE = 1 << 0;
        /// Every edge is caught, not only the first one.
        const CONTINUOUS = 1 << 1;
        /// The zero impulse instead of the input of the probe.
        const ZERO_IMPULSE = 1 << 2;
        /// What 0x60D0 says instead of either.
        const BY_SOURCE = 1 << 3;
        /// Positive edges are sampled.
        const POSITIVE = 1 << 4;
        /// Negative edges are sampled.
        const NEGATIVE = 1 << 5;
    }
}

/// Where a probe gets its edges from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    Probe1,
    Probe2,
    ZeroImpulse,
}

impl Source {
    /// By the numbers of 0x60D0.
    fn from_code(code: i64) -> Option<Self> {
        match code {
            1 => Some(Self::Probe1),
            2 => Some(Self::Probe2),
            5 => Some(Self::ZeroImpulse),
            _ => None,
        }
    }

    fn edges(self, latches: &Latches) -> Edges {
        match self {
            Self::Probe1 => latches.probe_1,
            Self::Probe2 => latches.probe_2,
            Self::ZeroImpulse => Edges { rising: latches.index, falling: latches.index },
        }
    }
}

/// The objects of one probe.
struct Objects {
    source: Binding,
    positive: [Binding; 2],
    negative: [Binding; 2],
}

const OBJECTS: [Objects; 2] = [
    Objects {
        source: Binding::TouchProbe1Source,
        positive: [Binding::TouchProbe1Positive, Binding::TouchProbe1PositiveCounter],
        negative: [Binding::TouchProbe1Negative, Binding::TouchProbe1NegativeCounter],
    },
    Objects {
        source: Binding::TouchProbe2Source,
        positive: [Binding::TouchProbe2Positive, Binding::TouchProbe2PositiveCounter],
        negative: [Binding::TouchProbe2Negative, Binding::TouchProbe2NegativeCounter],
    },
];

/// What has been caught at one kind of edge.
#[derive(Clone, Copy, Debug, Default)]
struct Catch {
    is_stored: bool,
    position: Position,
    count: u16,
}

impl Catch {
    /// Sampling is off: what was caught is no longer valid, the value stays.
    fn release(&mut self, is_sampled: bool) {
        self.is_stored &= is_sampled;
    }

    fn take(&mut self, edge: Option<Position>, is_continuous: bool) {
        if let Some(position) = edge.filter(|_| is_continuous || !self.is_stored) {
            *self = Self { is_stored: true, position, count: self.count.wrapping_add(1) };
        }
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct Probe {
    function: Function,
    positive: Catch,
    negative: Catch,
}

impl Probe {
    /// Takes over its byte of 0x60B8.
    fn set(&mut self, function: Function) {
        self.function = function;
        let samples = |edge| function.contains(Function::ENABLE | edge);
        self.positive.release(samples(Function::POSITIVE));
        self.negative.release(samples(Function::NEGATIVE));
    }

    fn step(&mut self, source: Source, latches: &Latches) {
        let samples = |edge| self.function.contains(Function::ENABLE | edge);
        let is_continuous = self.function.contains(Function::CONTINUOUS);
        let edges = source.edges(latches);
        self.positive.take(edges.rising.filter(|_| samples(Function::POSITIVE)), is_continuous);
        self.negative.take(edges.falling.filter(|_| samples(Function::NEGATIVE)), is_continuous);
    }

    /// Its byte of 0x60B9.
    fn status(&self) -> u8 {
        u8::from(self.function.contains(Function::ENABLE))
            | u8::from(self.positive.is_stored) << 1
            | u8::from(self.negative.is_stored) << 2
    }

    /// Where it gets its edges from; `own` is its input.
    fn source(&self, own: Source, code: i64) -> Source {
        if self.function.contains(Function::BY_SOURCE) {
            Source::from_code(code).unwrap_or(own)
        } else if self.function.contains(Function::ZERO_IMPULSE) {
            Source::ZeroImpulse
        } else {
            own
        }
    }
}

/// Both probes of an axis. They work in every state of the drive.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TouchProbe {
    probes: [Probe; 2],
}

impl TouchProbe {
    /// Acts on 0x60B8.
    pub(crate) fn update(&mut self, parameters: Parameters<'_>) {
        let function = parameters.or(Binding::TouchProbeFunction, 0) as u16;
        for (probe, byte) in self.probes.iter_mut().zip(function.to_le_bytes()) {
            probe.set(Function::from_bits_truncate(byte));
        }
    }

    /// Looks at the latches after a raster step.
    pub(crate) fn step(&mut self, parameters: Parameters<'_>, status: &Status) {
        let inputs = [Source::Probe1, Source::Probe2];
        for ((probe, objects), own) in self.probes.iter_mut().zip(&OBJECTS).zip(inputs) {
            let source = probe.source(own, parameters.or(objects.source, 0));
            probe.step(source, &status.latches);
        }
    }

    /// Shows status, positions and counters.
    pub(crate) fn show(&self, dictionary: &mut Dictionary, slots: &Slots, shown: impl Fn(Position) -> i64) {
        let [first, second] = self.probes.map(|probe| probe.status());
        let status = i64::from(u16::from_le_bytes([first, second]));
        slots.show(dictionary, Binding::TouchProbeStatus, status);
        for (probe, objects) in self.probes.iter().zip(&OBJECTS) {
            for (caught, bindings) in [(probe.positive, objects.positive), (probe.negative, objects.negative)]
            {
                let [position, counter] = bindings;
                if slots.get(position).is_some() {
                    slots.show(dictionary, position, shown(caught.position));
                }
                slots.show(dictionary, counter, i64::from(caught.count));
            }
        }
    }
}

/// Whether a probe can have the source `raw` of 0x60D0.
pub(crate) fn check_source(_: &Dictionary, _: Slot, raw: u64) -> Result<(), AbortCode> {
    let code = i64::from(raw as u16 as i16);
    Source::from_code(code).map(|_| ()).ok_or(AbortCode::InvalidValue)
}

/// Whether 0x60B8 can be `raw`: both bits of a source are reserved together.
pub(crate) fn check_function(_: &Dictionary, _: Slot, raw: u64) -> Result<(), AbortCode> {
    let is_reserved =
        |byte: u8| Function::from_bits_truncate(byte).contains(Function::ZERO_IMPULSE | Function::BY_SOURCE);
    if (raw as u16).to_le_bytes().into_iter().any(is_reserved) {
        Err(AbortCode::InvalidValue)
    } else {
        Ok(())
    }
}
