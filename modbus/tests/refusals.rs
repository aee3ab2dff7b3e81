//! Who may not write what, and what the refusal is.

mod bench;

use bench::Bench;
use modbus::{Dialect, Exception, Framing, Permissions, WordOrder};
use od::{AbortCode, Address, Bus, Owner, RefusedCommand};

fn with(permissions: Permissions) -> Bench {
    Bench::with(Dialect::Full, WordOrder::LowFirst, Framing::Tcp, permissions, None)
}

/// Every way to write the controlword (0x6040) or the outputs, and what a refusal of it looks like.
fn writes(bench: &Bench, code: u8) -> Vec<(String, String)> {
    let controlword = bench::hex(&bench.register(0x6040, 0).to_be_bytes());
    let requests = [
        format!("06 {controlword} 00 0F"),
        format!("10 {controlword} 00 01 02 00 0F"),
        format!("16 {controlword} 00 00 00 0F"),
        format!("17 {controlword} 00 01 {controlword} 00 01 02 00 0F"),
        "2B 0D 01 00 00 60 40 00 00 00 00 02 0F 00".to_owned(),
    ];
    let refusal = |request: &str| format!("{:02X} {code:02X}", bench::bytes(request)[0] | 0x80);
    requests.into_iter().map(|request| (request.clone(), refusal(&request))).collect()
}

#[test]
fn the_owner_of_another_bus_is_exception_4_and_everything_can_be_read() {
    let mut bench = Bench::new(Dialect::Full);
    bench.dictionary.set_owner(0, Some(Owner { bus: Bus::CanOpen, link: Some(0) }));
    for (request, refusal) in writes(&bench, 4) {
        assert_eq!(bench.ask(&request), refusal, "{request}");
    }
    assert_eq!(bench.raw(0x6040, 0), 0);
    let controlword = bench::hex(&bench.register(0x6040, 0).to_be_bytes());
    assert_eq!(bench.ask(&format!("03 {controlword} 00 01")), "03 02 00 00");
}

#[test]
fn a_client_that_may_only_read_is_exception_2() {
    let mut bench = with(Permissions { read_only: true, write: Vec::new() });
    for (request, refusal) in writes(&bench, 2) {
        assert_eq!(bench.ask(&request), refusal, "{request}");
    }
    assert_eq!(bench.ask("05 00 10 FF 00"), "85 02");
    assert_eq!(bench.ask("0F 00 10 00 01 01 00"), "8F 02");
    assert_eq!((bench.raw(0x6040, 0), bench.raw(0x60FE, 1)), (0, 0x0005_0000));
    assert_eq!(bench.ask("01 00 10 00 01"), "01 01 01");
}

#[test]
fn a_client_with_write_ranges_writes_there_only() {
    let register = Bench::new(Dialect::Full).register(0x607A, 0);
    let mut bench =
        with(Permissions { read_only: false, write: vec![register..=register + 1, 0x0000..=0x0007] });
    for (request, refusal) in writes(&bench, 2) {
        assert_eq!(bench.ask(&request), refusal, "{request}");
    }
    assert_eq!(bench.ask("05 00 10 FF 00"), "85 02");
    let target = bench::hex(&register.to_be_bytes());
    assert_eq!(bench.ask(&format!("10 {target} 00 02 04 00 01 00 00")), format!("10 {target} 00 02"));
    assert_eq!(
        bench.ask("2B 0D 01 00 00 60 7A 00 00 00 00 04 07 00 00 00"),
        "2B 0D 01 00 00 60 7A 00 00 00 00 00"
    );
    assert_eq!(bench.raw(0x607A, 0), 7);
    // The whole of a request must lie in a range.
    assert_eq!(bench.ask("10 00 06 00 02 04 00 01 00 00"), "10 00 06 00 02");
    assert_eq!(bench.ask("10 00 06 00 04 08 00 02 00 00 00 00 00 00"), "90 02");
    assert_eq!(bench.raw(0x2012, 3), 1);
}

/// Commands that were refused since the last time.
fn refused(bench: &mut Bench) -> Vec<(Address, Option<u64>, AbortCode)> {
    let refused: Vec<RefusedCommand> = std::iter::from_fn(|| bench.dictionary.take_refused()).collect();
    let schema = bench.dictionary.schema();
    assert!(refused.iter().all(|refused| refused.origin == bench::ORIGIN));
    refused.iter().map(|r| (schema.address(r.slot).unwrap(), r.raw, r.code)).collect()
}

#[test]
fn commands_that_a_client_may_not_write_at_all_are_noted_with_their_value() {
    let mut bench = with(Permissions { read_only: true, write: Vec::new() });
    let controlword = (Address::new(0x6040, 0), Some(15), AbortCode::UnsupportedAccess);
    for (request, _) in writes(&bench, 2) {
        bench.ask(&request);
        assert_eq!(refused(&mut bench), [controlword], "{request}");
    }
    // Of a batch the command, wherever it stands; a value that is not whole is none.
    let before = bench.register(0x6040, 0) - 1;
    bench.ask(&format!("10 {} 00 02 04 00 09 00 0F", bench::hex(&before.to_be_bytes())));
    assert_eq!(refused(&mut bench), [controlword]);
    let target = bench::hex(&bench.register(0x607A, 0).to_be_bytes());
    let position = |raw| (Address::new(0x607A, 0), raw, AbortCode::UnsupportedAccess);
    for (request, raw) in [
        (format!("10 {target} 00 02 04 00 01 00 02"), Some(0x2_0001)),
        (format!("06 {target} 00 01"), None),
        ("2B 0D 01 00 00 60 7A 00 00 00 00 04 07 00 00 00".to_owned(), Some(7)),
        ("2B 0D 01 00 00 60 7A 00 00 00 00 02 07 00".to_owned(), None),
    ] {
        bench.ask(&request);
        assert_eq!(refused(&mut bench), [position(raw)], "{request}");
    }
    let outputs = (Address::new(0x60FE, 1), Some(0x0005_0000 | 1 << 17), AbortCode::UnsupportedAccess);
    bench.ask("05 00 11 FF 00");
    assert_eq!(refused(&mut bench), [outputs]);
    // What moves nothing is no command, and who reads gives none.
    let parameter = bench::hex(&bench.register(0x2106, 0).to_be_bytes());
    assert_eq!(bench.ask(&format!("06 {parameter} 00 05")), "86 02");
    bench.ask(&format!("03 {target} 00 02"));
    assert_eq!(refused(&mut bench), []);
}

#[test]
fn commands_of_a_wrong_length_are_noted_without_a_value() {
    let mut bench = Bench::new(Dialect::Full);
    let target = bench::hex(&bench.register(0x607A, 0).to_be_bytes());
    let second = bench::hex(&(bench.register(0x607A, 0) + 1).to_be_bytes());
    let mode = bench::hex(&bench.register(0x6060, 0).to_be_bytes());
    let position = Address::new(0x607A, 0);
    for (request, expected) in [
        (format!("06 {target} 00 01"), (position, None, AbortCode::LengthMismatch)),
        (format!("06 {second} 00 01"), (position, None, AbortCode::LengthMismatch)),
        // More than eight bits.
        (format!("06 {mode} 01 03"), (Address::new(0x6060, 0), None, AbortCode::ValueTooHigh)),
    ] {
        assert_eq!(bench.ask(&request)[3..], *"03", "{request}");
        assert_eq!(refused(&mut bench), [expected], "{request}");
    }
    bench.ask("2B 0D 01 00 00 60 7A 00 00 00 00 02 07 00");
    assert_eq!(refused(&mut bench), [(position, None, AbortCode::TooShort)]);
}

#[test]
fn every_abort_code_has_an_exception() {
    let lines = AbortCode::ALL.iter().map(|code| format!("{code}: {}", Exception::from(*code)));
    insta::assert_snapshot!(lines.collect::<Vec<_>>().join("\n"));
}
