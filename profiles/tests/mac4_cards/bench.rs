//! A card on virtual time, driven by mnemonics.

use std::sync::Arc;
use std::time::Duration;

use axis::PlantConfig;
use od::{AbortCode, Address, Bus, Data, Instant, Origin, Write};
use profiles::{CardType, Device, DeviceEvent, Instruction, Mac4Mode, Profile, UserStatus};

const MASTER: Origin = Origin { bus: Bus::CanOpen, link: 0, client: 1 };

pub(crate) const CARDS: [CardType; 3] = [CardType::Inc, CardType::Ssi, CardType::Stp];

/// The profile of a card.
pub(crate) fn name(card: CardType) -> &'static str {
    match card {
        CardType::Inc => "maccon-mac4-inc",
        CardType::Ssi => "maccon-mac4-ssi",
        CardType::Stp => "maccon-mac4-stp",
    }
}

/// A card whose bus has one client.
pub(crate) struct Card {
    pub(crate) device: Device,
    pub(crate) now: Instant,
}

/// What a message was answered with.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Response {
    pub(crate) axis: i64,
    pub(crate) code: i64,
    pub(crate) parameter: i64,
}

impl Card {
    pub(crate) fn new(card: CardType) -> Self {
        Self::arranged(card, |_, _| {})
    }

    /// With another plant behind each axis.
    pub(crate) fn arranged(card: CardType, arrange: impl Fn(u8, &mut PlantConfig)) -> Self {
        let profile = Profile::embedded(name(card), None).unwrap().unwrap_or_else(|wrong| panic!("{wrong}"));
        let device = Device::arranged(Arc::new(profile), 1, Instant::ZERO, arrange);
        let mut new = Self { device, now: Instant::ZERO };
        new.run(100);
        new
    }

    /// A card whose first axis is initialised and in the mode "enable".
    pub(crate) fn enabled(card: CardType) -> Self {
        Self::new(card).on()
    }

    pub(crate) fn on(mut self) -> Self {
        self.give(0, "INIT");
        self.enable(0);
        self
    }

    pub(crate) fn enable(&mut self, axis: u8) {
        self.execute(axis, "ME");
        self.run_until(|card| card.has(axis, UserStatus::DR_EN));
    }

    /// The entry of an instruction.
    pub(crate) fn address(&self, axis: u8, mnemonic: &str) -> Option<Address> {
        let instruction = Instruction::ALL.iter().find(|known| known.mnemonic() == mnemonic).unwrap();
        let places = [0x2100, 0x2110, 0x2120, 0x2130]
            .map(|first| Address::new(first + u16::from(axis), *instruction as u8));
        places.into_iter().find(|place| self.device.dictionary().find(*place).is_ok())
    }

    /// Writes as an SDO does: bytes, through the gate.
    pub(crate) fn write(&mut self, address: Address, value: i64) -> Result<(), AbortCode> {
        let dictionary = self.device.dictionary();
        let slot = dictionary.find(address)?;
        let data_type = dictionary.schema().entry(slot).unwrap().data_type;
        let length = data_type.bytes().unwrap_or(1);
        let bytes = value.to_le_bytes();
        let write = Write { slot, data: Data::Bytes(&bytes[..length]) };
        let written = self.device.dictionary_mut().write(MASTER, &[write]);
        self.device.apply(self.now);
        written.map_err(|refusal| refusal.code)
    }

    /// Writes several entries in one batch, as an RPDO does.
    pub(crate) fn batch(&mut self, items: &[(Address, i64)]) -> Result<(), AbortCode> {
        let dictionary = self.device.dictionary();
        let find = |(address, value): &(Address, i64)| Write {
            slot: dictionary.find(*address).unwrap(),
            data: Data::Raw(value.cast_unsigned()),
        };
        let batch: Vec<_> = items.iter().map(find).collect();
        let written = self.device.dictionary_mut().write(MASTER, &batch);
        self.device.apply(self.now);
        written.map_err(|refusal| refusal.code)
    }

    pub(crate) fn try_set(&mut self, axis: u8, mnemonic: &str, value: i64) -> Result<(), AbortCode> {
        let address = self.address(axis, mnemonic).ok_or(AbortCode::NoSubIndex)?;
        self.write(address, value)
    }

    pub(crate) fn try_give(&mut self, axis: u8, mnemonic: &str) -> Result<(), AbortCode> {
        self.try_set(axis, mnemonic, 1)
    }

    pub(crate) fn set(&mut self, axis: u8, mnemonic: &str, value: i64) {
        self.try_set(axis, mnemonic, value).unwrap_or_else(|code| panic!("{mnemonic} {value}: {code}"));
    }

    pub(crate) fn give(&mut self, axis: u8, mnemonic: &str) {
        self.set(axis, mnemonic, 1);
    }

    /// Chooses a mode and executes it.
    pub(crate) fn execute(&mut self, axis: u8, mode: &str) {
        self.give(axis, mode);
        self.give(axis, "E");
    }

    /// A message through 0x2181, and its response.
    pub(crate) fn message(&mut self, axis: i64, code: i64, parameter: i64) -> Response {
        let before = self.object(0x2182, 4);
        let items =
            [(1, axis), (2, code), (3, parameter)].map(|(sub, value)| (Address::new(0x2181, sub), value));
        self.batch(&items).unwrap();
        assert_eq!(self.object(0x2182, 4), (before + 1) % 256, "there is one response");
        let [axis, code, parameter] = [1, 2, 3].map(|sub| self.object(0x2182, sub));
        Response { axis, code, parameter }
    }

    pub(crate) fn object(&self, index: u16, sub: u8) -> i64 {
        let dictionary = self.device.dictionary();
        dictionary.integer(dictionary.find(Address::new(index, sub)).unwrap()) as i64
    }

    pub(crate) fn get(&self, axis: u8, mnemonic: &str) -> i64 {
        let address = self.address(axis, mnemonic).unwrap_or_else(|| panic!("no {mnemonic}"));
        self.object(address.index, address.sub)
    }

    pub(crate) fn mode(&self, axis: u8) -> Mac4Mode {
        Mac4Mode::from_code(self.get(axis, "RBS") & 0xFF).unwrap()
    }

    pub(crate) fn user(&self, axis: u8) -> UserStatus {
        UserStatus::from_bits_truncate(self.get(axis, "RBS") as u32)
    }

    pub(crate) fn has(&self, axis: u8, bits: UserStatus) -> bool {
        self.user(axis).contains(bits)
    }

    pub(crate) fn position(&self, axis: u8) -> i64 {
        self.get(axis, "RCP")
    }

    /// Where the motor of an axis is, in counts of its encoder.
    pub(crate) fn motor(&mut self, axis: u8) -> f64 {
        self.device.plant(usize::from(axis), self.now).unwrap().motor_position().0
    }

    pub(crate) fn run(&mut self, millis: u64) {
        let end = self.now + Duration::from_millis(millis);
        while let Some(due) = self.device.poll_timeout().filter(|due| *due <= end) {
            self.now = due;
            self.device.advance(due);
        }
        self.now = end;
    }

    /// Lets time pass until `done`, at most two minutes.
    pub(crate) fn run_until(&mut self, done: impl Fn(&Self) -> bool) {
        for _ in 0..24_000 {
            if done(self) {
                return;
            }
            self.run(5);
        }
        panic!("never happened: {}", self.describe());
    }

    pub(crate) fn describe(&self) -> String {
        let axis = |axis| {
            let (mode, user) = (self.mode(axis), self.user(axis));
            format!("{axis}: {mode:?} at {} rfe {} {user:?}", self.position(axis), self.get(axis, "RFE"))
        };
        (0..4).map(axis).collect::<Vec<_>>().join("\n")
    }

    pub(crate) fn events(&mut self) -> Vec<DeviceEvent> {
        core::iter::from_fn(|| self.device.poll_event()).collect()
    }
}
