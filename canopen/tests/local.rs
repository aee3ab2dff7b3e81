//! Communication objects written from this machine: by the rules of the bus, and with its effects.

mod bench;

use bench::Bench;
use canopen::{Event, Order};
use od::{AbortCode, Access, Address, Bus, DataType, Entry, Group, Object, Origin, Value};

const LOCAL: Origin = Origin { bus: Bus::Local, link: 0, client: 0 };

fn write(bench: &mut Bench, index: u16, sub: u8, bytes: &[u8]) -> Result<bool, AbortCode> {
    let Bench { node, device, now } = bench;
    node.write(*now, LOCAL, Address::new(index, sub), bytes, device)
}

#[test]
fn what_is_written_here_acts_as_if_it_came_from_the_bus() {
    let mut bench = Bench::operational();
    // Heartbeat every 100 ms.
    assert_eq!(write(&mut bench, 0x1017, 0, &[100, 0]), Ok(false));
    bench.talk("+ 100ms\n< 701#05\n> 601#4017100000000000\n< 581#4B17100064000000");
}

#[test]
fn a_pdo_moves_to_where_it_is_put_from_here() {
    let mut bench = Bench::operational();
    assert_eq!(write(&mut bench, 0x1400, 1, &[0x00, 0x02, 0, 0x80]), Ok(false));
    assert_eq!(write(&mut bench, 0x1400, 1, &[0x2A, 0x02, 0, 0]), Ok(false));
    assert!(bench.node.subscriptions().any(|id| id == canopen::Id::Standard(0x22A)));
    assert!(!bench.node.subscriptions().any(|id| id == canopen::Id::Standard(0x201)));
}

#[test]
fn what_the_bus_may_not_write_may_nobody_and_nothing_changes() {
    let mut bench = Bench::operational();
    for (index, sub, bytes, code) in [
        (0x1000, 0, &[0; 4][..], AbortCode::ReadOnly),
        (0x1234, 0, &[0; 4], AbortCode::NoObject),
        (0x1018, 9, &[0; 4], AbortCode::NoSubIndex),
        (0x1017, 0, &[0; 4], AbortCode::TooLong),
        // The mapping of a PDO that is valid.
        (0x1600, 1, &[8, 1, 0, 0x62], AbortCode::UnsupportedAccess),
        // A COB-ID that is not to be configured.
        (0x1005, 0, &[1, 6, 0, 0], AbortCode::InvalidValue),
        // Not of the communication area.
        (0x2107, 0, &[1, 0], AbortCode::NoObject),
    ] {
        let before = bench.node.communication().revision();
        assert_eq!(write(&mut bench, index, sub, bytes), Err(code), "{index:04X}:{sub:02X}");
        assert_eq!(bench.node.communication().revision(), before, "{index:04X}:{sub:02X}");
    }
}

#[test]
fn what_is_read_here_is_what_the_bus_reads() {
    let bench = Bench::operational();
    let read = |index, sub| bench.node.read(Address::new(index, sub)).map(|(_, value)| value.clone());
    assert_eq!(read(0x1018, 4), Ok(Value::Fixed(0x2A)));
    assert_eq!(read(0x1003, 0), Ok(Value::Fixed(0)));
    assert_eq!(read(0x1003, 1), Err(AbortCode::NoData));
    assert_eq!(read(0x6000, 1), Err(AbortCode::NoObject));
}

#[test]
fn parameters_are_stored_by_order_from_here_and_nobody_on_the_bus_is_answered() {
    let entry = Entry::new(1, "Save all parameters", DataType::Unsigned32, Access::ReadWrite);
    let all = Entry { is_volatile: true, ..entry.with_value(Value::Fixed(1)) };
    let mut bench = Bench::off_with(vec![Object::array(0x1010, "Store parameters", vec![all])]).started();
    bench.events();
    assert_eq!(write(&mut bench, 0x1010, 1, b"evas"), Err(AbortCode::CannotStore));
    assert_eq!(write(&mut bench, 0x1010, 1, b"save"), Ok(true));
    assert_eq!(bench.events(), [Event::Storage(Order::Save(Group::All))]);
    // One at a time.
    assert_eq!(write(&mut bench, 0x1010, 1, b"save"), Err(AbortCode::DeviceState));
    bench.node.stored(bench.now, Ok(()));
    assert!(bench.settle().is_empty());
    assert_eq!(write(&mut bench, 0x1010, 1, b"save"), Ok(true));
}
