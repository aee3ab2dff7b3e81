//! What is wrong with a file is told with line, column and reason, and the rest of it is served.

use insta::assert_snapshot;
use profiles::Profile;

use crate::{findings, read, var, with};

#[test]
fn every_kind_of_mistake_has_a_finding() {
    let (profile, findings) = read(include_str!("sheets/broken.eds"));
    assert_snapshot!(findings);
    assert_eq!((profile.vendor.as_str(), profile.product.as_str()), ("Quoted", "Broken again"));
}

#[test]
fn what_only_looks_different_is_read_without_a_word() {
    let strange = with(&var(0x2000, "DataType=0x6, AccessType=rw, DefaultValue=5"))
        .replace("DefaultValue=5", "  default VALUE =\t\"5\"  ; a comment")
        .replace("default VALUE", "defaultVALUE")
        .replace("[2000]", "  [ 0x2000 ]  ; a section")
        .replace("OptionalObjects", "OPTIONALOBJECTS")
        .replace('\n', "\r\n");
    let (profile, findings) = read(&format!("\u{FEFF}{strange}\u{1A}"));
    assert!(findings.0.is_empty(), "{findings}");
    assert_eq!(crate::number(&profile, 0x2000, 0), 5);
    assert!(read(&strange.replace("\r\n", "\r")).1.0.is_empty());
}

#[test]
fn a_file_that_is_no_utf_8_is_read_as_windows_1252() {
    let text = with(&var(0x2000, "DataType=0x6, AccessType=rw")).replace("Object\n", "Temperatur in ?C\n");
    let bytes: Vec<u8> = text.bytes().map(|byte| if byte == b'?' { 0xB0 } else { byte }).collect();
    let (profile, findings) = Profile::from_data_sheet("device.eds", &bytes);
    let line = text.lines().position(|line| line.contains('?')).unwrap() + 1;
    let said = format!("device.eds:{line}:29: warning: this is no UTF-8: the file is read as Windows-1252");
    assert_eq!(findings.to_string(), said);
    assert_eq!(crate::entry(&profile.unwrap(), 0x2000, 0).name, "Temperatur in \u{B0}C");
}

#[test]
fn a_file_without_objects_is_an_error() {
    for text in ["", "hello", "[FileInfo]\nFileName=x\n", "[0005]\nParameterName=A type\n", "\0\u{FFFD}["] {
        let (profile, findings) = Profile::from_data_sheet("device.eds", text.as_bytes());
        assert!(profile.is_none());
        assert!(
            findings.to_string().contains("device.eds:1:1: error: the file describes no object"),
            "{findings}"
        );
    }
}

#[test]
fn the_objects_of_every_device_are_supplied() {
    let (profile, findings) = read("[2000]\nParameterName=Byte\nDataType=5\nAccessType=ro\n");
    assert_snapshot!(findings);
    assert_eq!(crate::number(&profile, 0x1018, 0), 4);
    assert!(crate::entry(&profile, 0x1001, 0).access.is_readable());
}

#[test]
fn a_warning_names_its_line() {
    let said = findings(&var(0x2000, "DataType=0x6, AccessType=rw, DefaultValue=x"));
    assert_eq!(said, ["`DefaultValue`: `x` is no value of UNSIGNED16 and is left out"]);
}
