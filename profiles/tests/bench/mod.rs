//! A device on virtual time, driven by its objects alone, as a master would.

#![allow(dead_code, reason = "every test file uses its part")]

use std::sync::Arc;
use std::time::Duration;

use axis::{Plant, PlantConfig};
use od::{AbortCode, Address, Bus, Data, Instant, Origin, Write};
use profiles::{Device, DeviceEvent, Profile, Space, State};

const MASTER: Origin = Origin { bus: Bus::CanOpen, link: 0, client: 1 };

pub(crate) struct Bench {
    pub(crate) device: Device,
    pub(crate) now: Instant,
}

impl Bench {
    pub(crate) fn new(profile: &str) -> Self {
        Self::with_plant(profile, |_| {})
    }

    /// With another plant behind the axis.
    pub(crate) fn with_plant(profile: &str, arrange: impl Fn(&mut PlantConfig)) -> Self {
        let profile = Profile::embedded(profile, None).expect("a shipped profile").expect("a valid profile");
        let device = Device::arranged(Arc::new(profile), 1, Instant::ZERO, |_, plant| arrange(plant));
        let mut bench = Self { device, now: Instant::ZERO };
        bench.run(10);
        bench
    }

    /// A JVL motor behind its module.
    pub(crate) fn motor(motor: &str) -> Self {
        Self::motor_with(motor, |_| {})
    }

    /// The same with another plant.
    pub(crate) fn motor_with(motor: &str, arrange: impl Fn(&mut PlantConfig)) -> Self {
        let profile = Profile::embedded("jvl-mac00-fc4", Some(motor)).expect("shipped").expect("valid");
        let device = Device::arranged(Arc::new(profile), 1, Instant::ZERO, |_, plant| arrange(plant));
        let mut bench = Self { device, now: Instant::ZERO };
        bench.run(10);
        bench
    }

    /// Writes motor registers in one batch, as an RPDO does.
    pub(crate) fn write(&mut self, registers: &[(u8, i64)]) {
        let items: Vec<_> = registers.iter().map(|(number, value)| (0x2012, *number, *value)).collect();
        self.batch(&items).unwrap();
    }

    /// What a motor register reads, with its sign.
    pub(crate) fn register(&self, number: u8) -> i32 {
        self.get_sub(0x2012, number) as u32 as i32
    }

    /// Writes the command register of the module, which no CANopen master reaches.
    pub(crate) fn command_module(&mut self, value: u32) -> Result<(), AbortCode> {
        self.write_module(15, value)
    }

    /// Writes any register of the module.
    pub(crate) fn write_module(&mut self, number: u16, value: u32) -> Result<(), AbortCode> {
        let place = self.device.profile().register(Space::Module, number).unwrap().place.unwrap();
        let slot = self.device.dictionary().schema().slot(place).unwrap();
        let write = Write { slot, data: Data::Raw(value.into()) };
        self.device.dictionary_mut().write(MASTER, &[write]).map_err(|refusal| refusal.code)?;
        self.device.apply(self.now);
        Ok(())
    }

    /// Executes a FastMac command.
    pub(crate) fn fastmac(&mut self, number: i64) {
        self.set(0x2013, number);
    }

    /// A device that has not run yet.
    pub(crate) fn powered_on(profile: &str) -> Self {
        Self::of(Profile::embedded(profile, None).expect("a shipped profile").expect("a valid profile"))
    }

    /// A device of any profile that has not run yet.
    pub(crate) fn of(profile: Profile) -> Self {
        Self { device: Device::new(Arc::new(profile), 1, Instant::ZERO), now: Instant::ZERO }
    }

    /// The plant behind the first axis.
    pub(crate) fn plant(&mut self) -> &mut Plant {
        self.device.plant(0, self.now).unwrap()
    }

    /// Writes several objects in one batch, as an RPDO does.
    pub(crate) fn batch(&mut self, items: &[(u16, u8, i64)]) -> Result<(), AbortCode> {
        let dictionary = self.device.dictionary();
        let find = |(index, sub, _): &(u16, u8, i64)| dictionary.find(Address::new(*index, *sub)).unwrap();
        let batch: Vec<Write<'static>> = items
            .iter()
            .map(|item| Write { slot: find(item), data: Data::Raw(item.2.cast_unsigned()) })
            .collect();
        self.device.dictionary_mut().write(MASTER, &batch).map_err(|refusal| refusal.code)?;
        self.device.apply(self.now);
        Ok(())
    }

    pub(crate) fn set(&mut self, index: u16, value: i64) {
        self.batch(&[(index, 0, value)]).unwrap();
    }

    pub(crate) fn set_sub(&mut self, index: u16, sub: u8, value: i64) {
        self.batch(&[(index, sub, value)]).unwrap();
    }

    pub(crate) fn get(&self, index: u16) -> i64 {
        self.get_sub(index, 0)
    }

    pub(crate) fn get_sub(&self, index: u16, sub: u8) -> i64 {
        let dictionary = self.device.dictionary();
        dictionary.integer(dictionary.find(Address::new(index, sub)).unwrap()) as i64
    }

    /// Lets `millis` pass, calling the device exactly when it asks to be.
    pub(crate) fn run(&mut self, millis: u64) {
        let end = self.now + Duration::from_millis(millis);
        while let Some(due) = self.device.poll_timeout().filter(|due| *due <= end) {
            self.now = due;
            self.device.advance(due);
        }
        self.now = end;
    }

    /// Lets time pass until `done`, at most ten seconds.
    pub(crate) fn run_until(&mut self, done: impl Fn(&Self) -> bool) {
        for _ in 0..10_000 {
            if done(self) {
                return;
            }
            self.run(1);
        }
        panic!("never happened; statusword {:04X}, position {}", self.statusword(), self.position());
    }

    pub(crate) fn control(&mut self, word: i64) {
        self.set(0x6040, word);
    }

    /// Takes the drive to OPERATION ENABLED in `mode`.
    pub(crate) fn enable(&mut self, mode: i64) {
        self.set(0x6060, mode);
        for word in [0x06, 0x07, 0x0F] {
            self.control(word);
        }
        self.run_until(|b| b.state() == State::OperationEnabled);
    }

    /// Commands a set-point and takes the new-set-point bit back once it is acknowledged.
    pub(crate) fn move_to(&mut self, target: i64, flags: i64) {
        self.batch(&[(0x6040, 0, 0x0F | flags), (0x607A, 0, target)]).unwrap();
        self.control(0x1F | flags);
        assert!(self.is_set(12), "the set-point is acknowledged at once");
        self.control(0x0F | flags);
    }

    pub(crate) fn fast_profile(&mut self) {
        self.batch(&[(0x6081, 0, 20_000), (0x6083, 0, 100_000), (0x6085, 0, 200_000)]).unwrap();
        if self.device.dictionary().find(Address::new(0x6084, 0)).is_ok() {
            self.set(0x6084, 100_000);
        }
    }

    pub(crate) fn state(&self) -> State {
        self.device.axes().next().unwrap().state
    }

    pub(crate) fn statusword(&self) -> i64 {
        self.get(0x6041)
    }

    pub(crate) fn is_set(&self, bit: u32) -> bool {
        self.statusword() >> bit & 1 == 1
    }

    pub(crate) fn position(&self) -> i64 {
        self.get(0x6064)
    }

    pub(crate) fn velocity(&self) -> i64 {
        self.get(0x606C)
    }

    pub(crate) fn events(&mut self) -> Vec<DeviceEvent> {
        core::iter::from_fn(|| self.device.poll_event()).collect()
    }
}
