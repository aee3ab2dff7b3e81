//! What a device says of its PDOs beside their objects: see [`od::PdoTraits`].

use core::time::Duration;

use od::{Dictionary, Mapping, PdoTraits, Schema, Slot};

/// One PDO on the wire and on its way through the device.
#[derive(Debug, Default)]
pub(crate) struct Shape {
    /// The mapping that comes with reserved bytes.
    mapping: Mapping,
    length: usize,
    time: Duration,
    /// What makes the PDO faster.
    pub(crate) scan: Option<Scan>,
}

/// A value that the device may read all the time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scan {
    /// The value.
    pub(crate) slot: Slot,
    switch: Slot,
    bit: u8,
    time: Duration,
}

impl Shape {
    /// The shape of a PDO with this default mapping; without `takes_time` it has no processing time.
    pub(crate) fn new(traits: &PdoTraits, mapping: Mapping, application: &Schema, takes_time: bool) -> Self {
        let scan = traits.scan.as_ref().filter(|_| takes_time).and_then(|scan| {
            let (slot, switch) = (application.slot(scan.entry)?, application.slot(scan.switch)?);
            Some(Scan { slot, switch, bit: scan.bit, time: scan.time })
        });
        let time = if takes_time { traits.time } else { Duration::ZERO };
        Self { mapping, length: usize::from(traits.length), time, scan }
    }

    /// The bytes of a PDO that has this mapping now: with those reserved, unless a master has mapped it anew.
    pub(crate) fn bytes(&self, mapping: &Mapping) -> usize {
        let own = mapping.bytes();
        if *mapping == self.mapping { own.max(self.length) } else { own }
    }

    /// How long the device takes to process the PDO as things are.
    pub(crate) fn time(&self, application: &Dictionary) -> Duration {
        let scan = self.scan.filter(|scan| scan.is_on(application));
        scan.map_or(self.time, |scan| scan.time)
    }

    /// How long it takes if nothing makes it faster.
    pub(crate) fn longest_time(&self) -> Duration {
        self.time
    }
}

impl Scan {
    /// Whether the value is read all the time.
    pub(crate) fn is_on(&self, application: &Dictionary) -> bool {
        application.raw(self.switch) >> (self.bit % 64) & 1 == 1
    }
}
