//! No file makes the reader panic, hang or need memory without bound.

use profiles::{Profile, Severity};
use proptest::prelude::*;

/// Pieces of files in any order.
fn pieces() -> impl Strategy<Value = String> {
    let piece = prop_oneof![
        "[A-Za-z]{1,12}=",
        "[\\[\\]=;\"\\n $+,.-]{1,4}",
        "(0x|-)?[0-9A-F]{1,40}(h|\\n)?",
        "\\[[0-9A-F]{4}(sub[0-9A-F]{1,2}|Name|Value)?\\]\\n",
        Just("[1018]\n".to_owned()),
        Just("\n[1A00sub1]\nDataType=7\nDefaultValue=0x20000010\n".to_owned()),
        Just("\n[1A00sub0]\nDataType=5\nDefaultValue=255\n".to_owned()),
        Just("\n[1800sub1]\nDataType=7\nDefaultValue=$NODEID+\n".to_owned()),
        Just("\n[2000]\nDataType=0x001B\nPDOMapping=1\nLowLimit=-1\nDefaultValue=".to_owned()),
        Just("CompactSubObj=254\n".to_owned()),
        Just("ObjectType=0x8\n".to_owned()),
        Just("DataType=0x11\nHighLimit=1e400\n".to_owned()),
        Just("SubNumber=255\n".to_owned()),
        Just("[DeviceInfo]\nCompactPDO=63\nNrOfRXPDO=9\nNrOfTXPDO=513\n".to_owned()),
    ];
    prop::collection::vec(piece, 0..60).prop_map(|pieces| pieces.concat())
}

/// It is read, or refused for a reason; what is read makes a data sheet that is read again.
fn check(bytes: &[u8]) {
    let (profile, findings) = Profile::from_data_sheet("any.dcf", bytes);
    let errors = findings.0.iter().filter(|finding| finding.severity == Severity::Error).count();
    assert_eq!(profile.is_none(), errors > 0, "{findings}");
    if let Some(profile) = profile {
        let (again, findings) = Profile::from_data_sheet("again.eds", profile.eds().as_bytes());
        assert!(again.is_some(), "{findings}");
    }
}

#[test]
fn a_file_without_end_is_refused() {
    let (profile, findings) = Profile::from_data_sheet("any.eds", &vec![b'['; 9 << 20]);
    assert!(profile.is_none());
    assert_eq!(findings.to_string(), "any.eds:1:1: error: the file is longer than 8388608 bytes");
}

#[test]
fn endless_objects_are_refused_once() {
    let object = |index| {
        format!(
            "[{index:04X}]\nParameterName=x\nObjectType=8\nCompactSubObj=254\nDataType=5\nAccessType=ro\n"
        )
    };
    let text: String = (0x2000..0x2200).map(object).collect();
    let (profile, findings) = Profile::from_data_sheet("any.eds", text.as_bytes());
    assert!(profile.is_none());
    let errors: Vec<_> = findings.0.iter().filter(|finding| finding.severity == Severity::Error).collect();
    assert_eq!(errors.len(), 1);
    assert!(errors[0].message.contains("65535"));
}

#[test]
fn as_many_pdos_as_there_can_be_need_not_be_described() {
    let text =
        "[DeviceInfo]\nCompactPDO=63\nNrOfRXPDO=512\nNrOfTXPDO=512\n[1001]\nDataType=5\nAccessType=ro\n";
    let (profile, findings) = Profile::from_data_sheet("any.eds", text.as_bytes());
    let profile = profile.unwrap_or_else(|| panic!("{findings}"));
    assert_eq!((profile.rpdos, profile.tpdos), (512, 512));
}

#[test]
fn endless_findings_are_counted() {
    let text = format!("[1000]\nParameterName=x\nDataType=7\nAccessType=ro\n{}", "what\n".repeat(100_000));
    let (_, findings) = Profile::from_data_sheet("any.eds", text.as_bytes());
    assert_eq!(findings.0.len(), 501);
    assert!(findings.to_string().ends_with("more warnings are not listed"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_bytes_are_read_or_refused(bytes in any::<Vec<u8>>()) {
        check(&bytes);
    }

    #[test]
    fn any_pieces_are_read_or_refused(text in pieces()) {
        check(text.as_bytes());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn any_change_to_a_right_file_is_read_or_refused(
        from in 0.0..1.0, length in 0..60_usize, instead in "[ -~\\n]{0,8}",
    ) {
        let text = include_str!("sheets/broken.eds");
        let at = |place: f64| text.floor_char_boundary((place * text.len() as f64) as usize);
        let (start, end) = (at(from), text.floor_char_boundary((at(from) + length).min(text.len())));
        check([&text[..start], &instead, &text[end..]].concat().as_bytes());
    }
}
