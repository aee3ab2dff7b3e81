//! Objects written and read from this machine, through the gate and with all that follows from it.

mod common;

use std::sync::Arc;
use std::time::Duration;

use common::{Bench, LINK};
use daemon::core::{Authority, WriteRefused};
use od::{AbortCode, Address, Value};
use profiles::Profile;

const MILLISECOND: Duration = Duration::from_millis(1);

fn drive() -> Bench {
    let profile = Profile::embedded("cia402-servo", None).unwrap().unwrap();
    let mut bench = Bench::of(&Arc::new(profile), &[&[(0, 1)]]);
    bench.run(100 * MILLISECOND);
    bench
}

fn write(bench: &mut Bench, writes: &[(u16, u8, &[u8])]) -> Result<bool, WriteRefused> {
    let writes = writes.iter().map(|(index, sub, bytes)| (Address::new(*index, *sub), bytes.to_vec()));
    let writes: Vec<_> = writes.collect();
    bench.core.write(bench.now, 0, 0, &writes, Authority::Owner)
}

fn read(bench: &Bench, index: u16, sub: u8) -> Result<u64, AbortCode> {
    bench.core.read(0, 0, Address::new(index, sub)).map(|value| value.raw())
}

fn refused(index: u16, sub: u8, code: AbortCode) -> Result<bool, WriteRefused> {
    Err(WriteRefused { address: Address::new(index, sub), code })
}

#[test]
fn an_operator_acts_on_the_axis_and_the_bus_sees_it() {
    let mut bench = drive();
    bench.send("000#0101");
    bench.sent_on(LINK);

    assert_eq!(write(&mut bench, &[(0x6040, 0, &[6, 0])]), Ok(false));

    let sent = bench.sent_on(LINK);
    assert!(sent.iter().any(|frame| frame.starts_with("181#31")), "TPDO 1 with READY TO SWITCH ON: {sent:?}");
    assert_eq!(read(&bench, 0x6041, 0).unwrap() & 0x6F, 0x21);
}

#[test]
fn a_batch_for_the_device_is_written_whole_or_not_at_all() {
    let mut bench = drive();
    let before = read(&bench, 0x6081, 0).unwrap();
    let batch: [(u16, u8, &[u8]); 2] = [(0x6081, 0, &[1, 2, 3, 0]), (0x6060, 0, &[99])];
    assert_eq!(write(&mut bench, &batch), refused(0x6060, 0, AbortCode::InvalidValue));
    assert_eq!(read(&bench, 0x6081, 0), Ok(before));
    assert_eq!(write(&mut bench, &[(0x6081, 0, &[1, 2, 3, 0]), (0x6060, 0, &[3])]), Ok(false));
    assert_eq!((read(&bench, 0x6081, 0), read(&bench, 0x6060, 0)), (Ok(0x0003_0201), Ok(3)));
}

#[test]
fn communication_objects_are_those_of_the_node_and_take_effect() {
    let mut bench = drive();
    assert_eq!(write(&mut bench, &[(0x1017, 0, &[50, 0])]), Ok(false));
    let sent = bench.run(100 * MILLISECOND);
    assert_eq!(sent.iter().filter(|frame| *frame == "701#7F").count(), 2, "{sent:?}");
    assert_eq!(bench.core.read(0, 1, Address::new(0x1017, 0)), Err(AbortCode::NoObject), "no second node");
    assert_eq!(
        bench
            .core
            .write(bench.now, 0, 1, &[(Address::new(0x1017, 0), vec![0, 0])], Authority::Owner)
            .unwrap_err()
            .code,
        AbortCode::NoObject
    );
}

#[test]
fn what_the_gate_refuses_has_the_abort_code_of_the_bus() {
    let mut bench = drive();
    assert_eq!(write(&mut bench, &[(0x6041, 0, &[0, 0])]), refused(0x6041, 0, AbortCode::ReadOnly));
    assert_eq!(write(&mut bench, &[(0x6040, 0, &[0])]), refused(0x6040, 0, AbortCode::TooShort));
    assert_eq!(write(&mut bench, &[(0x6040, 1, &[0, 0])]), refused(0x6040, 1, AbortCode::NoSubIndex));
    assert_eq!(write(&mut bench, &[(0x5000, 0, &[0])]), refused(0x5000, 0, AbortCode::NoObject));
    assert_eq!(read(&bench, 0x5000, 0), Err(AbortCode::NoObject));
}

#[test]
fn parameters_are_stored_by_an_operator_when_they_are_stored() {
    let mut bench = drive();
    write(&mut bench, &[(0x6081, 0, &[7, 0, 0, 0])]).unwrap();
    assert_eq!(write(&mut bench, &[(0x1010, 1, b"save")]), Ok(true));
    assert_eq!(write(&mut bench, &[(0x1010, 1, b"save")]), refused(0x1010, 1, AbortCode::DeviceState));
    let (device, parameters) = bench.core.poll_store().expect("something is to be stored");
    assert!(parameters.application.iter().any(|(address, _)| address == Address::new(0x6081, 0)));
    bench.core.stored(bench.now, device, Ok(()));
    write(&mut bench, &[(0x6081, 0, &[9, 0, 0, 0])]).unwrap();
    bench.send("000#8101");
    assert_eq!(read(&bench, 0x6081, 0), Ok(7));
}

#[test]
fn a_text_is_read_whole() {
    let bench = drive();
    let name = bench.core.read(0, 0, Address::new(0x1008, 0)).unwrap();
    assert!(matches!(name, Value::Bytes(bytes) if !bytes.is_empty()));
}
