//! No text makes the reader panic or hang.

use profiles::Profile;
use proptest::prelude::*;

const SHIPPED: [&str; 3] = [
    include_str!("../devices/jvl-mac00-fc4.toml"),
    include_str!("../devices/cia402-servo.toml"),
    include_str!("../devices/canopen-reference.toml"),
];

/// Pieces of valid files in any order.
fn pieces() -> impl Strategy<Value = String> {
    let piece = prop_oneof![
        "[a-z_]{1,12}( = )?",
        "[\\[\\]{},=\\n\" #.$:+-]{1,4}",
        "(0x)?[0-9A-F_]{1,25}",
        Just("[[object]]\n".to_owned()),
        Just("index = 0x6040\n".to_owned()),
        Just("name = \"ü\"\n".to_owned()),
        Just("type = \"U16\"\n".to_owned()),
        Just("array = 254\n".to_owned()),
        Just("entries = [{}, {sub = 254}, {}]\n".to_owned()),
        Just("default = \"$NODEID+0x\"\n".to_owned()),
        Just("range = [1, nan]\n".to_owned()),
        Just("[[tpdo]]\nnumber = 1\nmap = [\"0x6040:00\"]\n".to_owned()),
        Just("[motors.a]\n".to_owned()),
    ];
    prop::collection::vec(piece, 0..40).prop_map(|pieces| pieces.concat())
}

#[test]
fn a_file_with_endless_objects_is_refused_once() {
    let object = "[[object]]\nindex = 0x2000\nname = \"x\"\ntype = \"U8\"\narray = 254\n";
    let wrong = Profile::parse("text", &object.repeat(2000), None).unwrap_err();
    let too_many = wrong.0.iter().filter(|d| d.message.starts_with("a device cannot have more")).count();
    assert_eq!(too_many, 1);
}

proptest! {
    #[test]
    fn any_text_is_read_or_refused(text in any::<String>()) {
        let _ = Profile::parse("text", &text, None);
    }

    #[test]
    fn any_pieces_are_read_or_refused(text in pieces()) {
        if let Err(wrong) = Profile::parse("text", &text, Some("a")) {
            prop_assert!(!wrong.0.is_empty());
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_change_to_a_valid_file_is_read_or_refused(
        which in 0..SHIPPED.len(), from in 0.0..1.0, length in 0..30_usize, instead in "[ -~\\n]{0,8}",
    ) {
        let text = SHIPPED[which];
        let start = text.floor_char_boundary((text.len() as f64 * from) as usize);
        let end = text.ceil_char_boundary((start + length).min(text.len()));
        let changed = [&text[..start], &instead, &text[end..]].concat();
        if let Err(wrong) = Profile::parse("text", &changed, None) {
            let lines = changed.lines().count().max(1) + 1;
            prop_assert!(wrong.0.iter().all(|d| (1..=lines).contains(&d.line)));
        }
    }
}
