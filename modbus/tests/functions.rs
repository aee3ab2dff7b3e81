//! Every function of the full dialect, on the range of the application dictionary.

mod bench;

use bench::{Bench, hex};
use modbus::{Dialect, Framing, Map, Permissions, WordOrder};

fn full() -> Bench {
    Bench::new(Dialect::Full)
}

fn high_first() -> Bench {
    Bench::with(Dialect::Full, WordOrder::HighFirst, Framing::Tcp, Permissions::default(), None)
}

/// The address of an entry as it stands in a request.
fn at(bench: &Bench, index: u16, sub: u8) -> String {
    hex(&bench.register(index, sub).to_be_bytes())
}

#[test]
fn the_application_dictionary_lies_from_1000_on_in_the_order_of_its_addresses() {
    let bench = full();
    let schema = bench.dictionary.schema();
    let lines = bench.map.listing().filter(|l| (0x1000..0x8000).contains(&l.first)).map(|listed| {
        let entry = schema.entry(listed.slot).unwrap();
        let address = schema.address(listed.slot).unwrap();
        format!(
            "{:04X} {} {address} {} {}",
            listed.first,
            listed.count,
            entry.data_type.short_name(),
            entry.name
        )
    });
    insta::assert_snapshot!(lines.collect::<Vec<_>>().join("\n"));
    assert_eq!(bench.map.left_out(), 0);
}

#[test]
fn what_finds_no_room_is_left_out() {
    let objects = (0..15_000).map(|n: u16| {
        let entry = od::Entry::new(0, "Entry", od::DataType::Unsigned32, od::Access::ReadWrite);
        od::Object::var(0x2000 + n, entry)
    });
    let schema = od::Schema::new(objects.collect()).unwrap();
    let map = Map::new(Dialect::Full, WordOrder::LowFirst).with_application(&schema, &[], &[]);
    assert_eq!(map.listing().count(), 0x7000 / 2);
    assert_eq!(map.listing().last().unwrap().first, 0x7FFE);
    assert_eq!(map.left_out(), 15_000 - 0x7000 / 2);
}

#[test]
fn function_3_reads_a_value_in_the_word_order_of_the_device() {
    let mut bench = full();
    let position = at(&bench, 0x6064, 0);
    assert_eq!(bench.ask(&format!("03 {position} 00 02")), "03 04 56 78 12 34");
    assert_eq!(high_first().ask(&format!("03 {position} 00 02")), "03 04 12 34 56 78");
}

#[test]
fn function_4_reads_what_function_3_reads() {
    let mut bench = full();
    let position = at(&bench, 0x6064, 0);
    assert_eq!(bench.ask(&format!("04 {position} 00 02")), "04 04 56 78 12 34");
    assert_eq!(bench.ask("04 80 06 00 02"), "04 04 64 01 C0 A8");
}

#[test]
fn a_part_of_a_value_may_be_read() {
    let mut bench = full();
    let high = hex(&(bench.register(0x6064, 0) + 1).to_be_bytes());
    assert_eq!(bench.ask(&format!("03 {high} 00 01")), "03 02 12 34");
}

#[test]
fn values_of_64_and_24_and_8_bits_fill_their_registers() {
    let mut bench = full();
    bench.set(0x2100, 0, 0x1122_3344_5566_7788);
    bench.set(0x2105, 0, 0xFF_FFFE);
    bench.set(0x6060, 0, 0xFF);
    let (wide, narrow, mode) = (at(&bench, 0x2100, 0), at(&bench, 0x2105, 0), at(&bench, 0x6060, 0));
    assert_eq!(bench.ask(&format!("03 {wide} 00 04")), "03 08 77 88 55 66 33 44 11 22");
    assert_eq!(bench.ask(&format!("03 {narrow} 00 02")), "03 04 FF FE FF FF");
    assert_eq!(bench.ask(&format!("03 {mode} 00 01")), "03 02 FF FF");
    let mut bench = high_first();
    bench.set(0x2100, 0, 0x1122_3344_5566_7788);
    assert_eq!(bench.ask(&format!("03 {wide} 00 04")), "03 08 11 22 33 44 55 66 77 88");
    bench.ask(&format!("10 {wide} 00 04 08 01 02 03 04 05 06 07 08"));
    assert_eq!(bench.raw(0x2100, 0), 0x0102_0304_0506_0708);
}

#[test]
fn function_6_writes_one_register() {
    let mut bench = full();
    let controlword = at(&bench, 0x6040, 0);
    assert_eq!(bench.ask(&format!("06 {controlword} 00 0F")), format!("06 {controlword} 00 0F"));
    assert_eq!(bench.raw(0x6040, 0), 0x0F);
}

/// Half a target would be another target until the other half comes.
#[test]
fn half_a_value_is_not_written() {
    let mut bench = full();
    bench.set(0x607A, 0, 0x0001_FFFF);
    let low = bench.register(0x607A, 0);
    let (low, high) = (hex(&low.to_be_bytes()), hex(&(low + 1).to_be_bytes()));
    assert_eq!(bench.ask(&format!("06 {low} 00 00")), "86 03");
    assert_eq!(bench.ask(&format!("06 {high} 00 02")), "86 03");
    assert_eq!(bench.ask(&format!("16 {low} 00 00 00 00")), "96 03");
    assert_eq!(bench.ask(&format!("10 {high} 00 02 04 00 00 00 00")), "90 03");
    assert_eq!(bench.raw(0x607A, 0), 0x0001_FFFF);
}

#[test]
fn function_16_writes_neighbours_as_a_whole_or_not_at_all() {
    let mut bench = full();
    // 0x2105 is followed by 0x2106, which takes 1-100.
    let narrow = at(&bench, 0x2105, 0);
    let request = |limited: &str| format!("10 {narrow} 00 03 06 FF FF FF FF {limited}");
    assert_eq!(bench.ask(&request("00 65")), "90 03");
    assert_eq!((bench.raw(0x2105, 0), bench.raw(0x2106, 0)), (0, 1));
    assert_eq!(bench.ask(&request("00 64")), format!("10 {narrow} 00 03"));
    assert_eq!((bench.raw(0x2105, 0), bench.raw(0x2106, 0)), (0xFF_FFFF, 100));
}

#[test]
fn a_value_must_fit_its_entry() {
    let mut bench = full();
    let (mode, narrow) = (at(&bench, 0x6060, 0), at(&bench, 0x2105, 0));
    for (value, taken) in
        [("00 01", true), ("FF FA", true), ("00 FA", true), ("01 00", false), ("FF 7F", false)]
    {
        let answer = bench.ask(&format!("06 {mode} {value}"));
        assert_eq!(answer, if taken { format!("06 {mode} {value}") } else { "86 03".into() });
    }
    assert_eq!(bench.ask(&format!("10 {narrow} 00 02 04 00 00 01 00")), "90 03");
}

#[test]
fn function_22_changes_the_bits_that_the_mask_names() {
    let mut bench = full();
    bench.set(0x6040, 0, 0x12);
    let controlword = at(&bench, 0x6040, 0);
    // The standard's example: 12h with AND F2h and OR 25h is 17h.
    let request = format!("16 {controlword} 00 F2 00 25");
    assert_eq!(bench.ask(&request), request);
    assert_eq!(bench.raw(0x6040, 0), 0x17);
}

#[test]
fn function_23_writes_before_it_reads() {
    let mut bench = full();
    let target = at(&bench, 0x607A, 0);
    let request = format!("17 {target} 00 02 {target} 00 02 04 00 05 00 06");
    assert_eq!(bench.ask(&request), "17 04 00 05 00 06");
}

#[test]
fn function_23_writes_nothing_when_it_cannot_read() {
    let mut bench = full();
    let target = at(&bench, 0x607A, 0);
    assert_eq!(bench.ask(&format!("17 7F 00 00 02 {target} 00 02 04 00 05 00 06")), "97 02");
    assert_eq!(bench.raw(0x607A, 0), 0);
}

#[test]
fn coils_are_the_bits_of_60fe_01() {
    let mut bench = full();
    // Coils 16 and 18 are on.
    assert_eq!(bench.ask("01 00 10 00 0A"), "01 02 05 00");
    assert_eq!(bench.ask("01 00 0F 00 04"), "01 01 0A");
    assert_eq!(bench.ask("05 00 11 FF 00"), "05 00 11 FF 00");
    assert_eq!(bench.ask("05 00 10 00 00"), "05 00 10 00 00");
    assert_eq!(bench.raw(0x60FE, 1), 0x0006_0000);
    assert_eq!(bench.ask("0F 00 00 00 20 04 78 56 34 12"), "0F 00 00 00 20");
    assert_eq!(bench.raw(0x60FE, 1), 0x1234_5678);
    assert_eq!(bench.ask("0F 00 1F 00 01 01 FF"), "0F 00 1F 00 01");
    assert_eq!(bench.raw(0x60FE, 1), 0x9234_5678);
    assert_eq!(bench.ask("01 00 20 00 01"), "81 02");
}

#[test]
fn discrete_inputs_are_the_bits_of_60fd() {
    let mut bench = full();
    assert_eq!(bench.ask("02 00 00 00 20"), "02 04 05 00 03 80");
    assert_eq!(bench.ask("02 00 1F 00 01"), "02 01 01");
    assert_eq!(bench.ask("02 00 1F 00 02"), "82 02");
}

#[test]
fn function_8_sends_the_data_back() {
    assert_eq!(full().ask("08 00 00 A5 37"), "08 00 00 A5 37");
    assert_eq!(full().ask("08 00 00 A5 37 00 01"), "08 00 00 A5 37 00 01");
    assert_eq!(full().ask("08 00 01 00 00"), "88 01");
}

#[test]
fn function_17_tells_the_unit_and_who_it_is() {
    let text = hex(b"Example BENCH 1.0");
    assert_eq!(full().ask("11"), format!("11 13 01 FF {text}"));
}

/// Byte for byte what clients of igus dryve send to read the statusword (0x6041) and to write the controlword (0x6040).
#[test]
fn function_43_13_is_an_sdo() {
    let mut bench = full();
    let answer = bench.exchange("00 00 00 00 00 0D 01 2B 0D 00 00 00 60 41 00 00 00 00 02");
    assert_eq!(answer, "00 00 00 00 00 0F 01 2B 0D 00 00 00 60 41 00 00 00 00 02 16 02");
    let answer = bench.exchange("00 00 00 00 00 0F 01 2B 0D 01 00 00 60 40 00 00 00 00 02 0F 00");
    assert_eq!(answer, "00 00 00 00 00 0D 01 2B 0D 01 00 00 60 40 00 00 00 00 00");
    assert_eq!(bench.raw(0x6040, 0), 0x0F);
}

#[test]
fn an_sdo_by_modbus_reaches_texts_and_the_communication_objects() {
    let mut bench = full();
    let text = hex(b"axis one");
    assert_eq!(
        bench.ask("2B 0D 00 00 00 21 01 00 00 00 00 FF"),
        format!("2B 0D 00 00 00 21 01 00 00 00 00 08 {text}")
    );
    let rest = hex(b"one");
    assert_eq!(
        bench.ask("2B 0D 00 00 00 21 01 00 00 05 00 FF"),
        format!("2B 0D 00 00 00 21 01 00 00 05 00 03 {rest}")
    );
    assert_eq!(
        bench.ask("2B 0D 00 00 00 10 00 00 00 00 00 04"),
        "2B 0D 00 00 00 10 00 00 00 00 00 04 92 01 02 00"
    );
    let name = hex(b"left");
    assert_eq!(
        bench.ask(&format!("2B 0D 01 00 00 21 01 00 00 00 00 04 {name}")),
        "2B 0D 01 00 00 21 01 00 00 00 00 00"
    );
    assert_eq!(
        bench.ask("2B 0D 00 00 00 21 01 00 00 00 00 FF"),
        format!("2B 0D 00 00 00 21 01 00 00 00 00 04 {name}")
    );
}

#[test]
fn an_sdo_by_modbus_is_refused_by_the_exceptions_of_registers() {
    let mut bench = full();
    let cases = [
        // Missing object, missing sub-index, write only, read only, communication object.
        ("2B 0D 00 00 00 20 00 00 00 00 00 02", "AB 02"),
        ("2B 0D 00 00 00 60 40 01 00 00 00 02", "AB 02"),
        ("2B 0D 00 00 00 21 03 00 00 00 00 02", "AB 02"),
        ("2B 0D 01 00 00 60 41 00 00 00 00 02 00 00", "AB 02"),
        ("2B 0D 01 00 00 10 01 00 00 00 00 01 00", "AB 02"),
        // Wrong length to read and to write, a value out of range.
        ("2B 0D 00 00 00 60 41 00 00 00 00 04", "AB 03"),
        ("2B 0D 00 00 00 60 41 00 00 01 00 02", "AB 03"),
        ("2B 0D 01 00 00 60 40 00 00 00 00 04 00 00 00 00", "AB 03"),
        ("2B 0D 01 00 00 21 06 00 00 00 00 02 65 00", "AB 03"),
        // A length that disagrees with what follows, an unknown control, a Node-ID, a reserved byte.
        ("2B 0D 01 00 00 60 40 00 00 00 00 02 0F", "AB 03"),
        ("2B 0D 02 00 00 60 40 00 00 00 00 02", "AB 03"),
        ("2B 0D 00 00 05 60 41 00 00 00 00 02", "AB 03"),
        ("2B 0D 00 01 00 60 41 00 00 00 00 02", "AB 03"),
        ("2B 0D 00 00 00 60 41 00 00 00 00 02 00", "AB 03"),
        ("2B 0D 00 00 00 60 41 00", "AB 03"),
    ];
    for (request, answer) in cases {
        assert_eq!(bench.ask(request), answer, "{request}");
    }
    bench.set(0x2104, 0, 1);
    assert_eq!(bench.ask("2B 0D 01 00 00 60 7A 00 00 00 00 04 00 00 00 00"), "AB 04");
}

#[test]
fn function_43_14_streams_the_basic_and_the_regular_identification() {
    let objects = |objects: &[(u8, &str)]| {
        let text =
            objects.iter().map(|(id, text)| format!("{id:02X} {:02X} {}", text.len(), hex(text.as_bytes())));
        text.collect::<Vec<_>>().join(" ")
    };
    let basic = [(0, "Example"), (1, "BENCH"), (2, "1.0")];
    let regular = [(3, "http://example.org"), (4, "Bench device"), (5, "B1"), (6, "left axis")];
    assert_eq!(full().ask("2B 0E 01 00"), format!("2B 0E 01 83 00 00 03 {}", objects(&basic)));
    let all = [&basic[..], &regular[..]].concat();
    assert_eq!(full().ask("2B 0E 02 00"), format!("2B 0E 02 83 00 00 07 {}", objects(&all)));
    assert_eq!(full().ask("2B 0E 02 05"), format!("2B 0E 02 83 00 00 02 {}", objects(&regular[2..])));
    // A stream that is to begin where no object is begins at the beginning.
    assert_eq!(full().ask("2B 0E 01 04"), format!("2B 0E 01 83 00 00 03 {}", objects(&basic)));
    assert_eq!(full().ask("2B 0E 02 7F"), format!("2B 0E 02 83 00 00 07 {}", objects(&all)));
    assert_eq!(full().ask("2B 0E 04 04"), format!("2B 0E 04 83 00 00 01 {}", objects(&regular[1..2])));
    assert_eq!(full().ask("2B 0E 04 07"), "AB 02");
    assert_eq!(full().ask("2B 0E 00 00"), "AB 03");
    assert_eq!(full().ask("2B 0E 05 00"), "AB 03");
    assert_eq!(full().ask("2B 0F 01 00"), "AB 01");
}

#[test]
fn an_identification_that_is_too_long_goes_on_where_it_says() {
    let mut bench = full();
    let mut seen = Vec::new();
    let mut next = 0;
    loop {
        let answer = bench::bytes(&bench.ask(&format!("2B 0E 03 {next:02X}")));
        assert!(answer.len() <= 253);
        let mut objects = &answer[7..];
        for _ in 0..answer[6] {
            seen.push((objects[0], objects[1]));
            objects = &objects[2 + usize::from(objects[1])..];
        }
        assert!(objects.is_empty());
        if answer[4] == 0 {
            break;
        }
        next = answer[5];
    }
    let ids: Vec<u8> = seen.iter().map(|(id, _)| *id).collect();
    assert_eq!(ids, [0, 1, 2, 3, 4, 5, 6, 0x80, 0x81, 0x82]);
    assert_eq!(seen[8..], [(0x81, 239), (0x82, 240)]);
}
