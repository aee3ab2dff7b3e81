//! What is wrong with a profile file or a register list is said all at once, with line, column and a way out.

use profiles::{Behind, Profile, RegisterList};

#[test]
fn everything_that_is_wrong_with_a_file_is_reported_at_once() {
    let wrong = Profile::parse("bad.toml", include_str!("bad.toml"), None).unwrap_err();
    insta::assert_snapshot!(wrong);
}

#[test]
fn everything_that_is_wrong_with_a_register_list_is_reported_at_once() {
    let text = include_str!("bad_registers.toml");
    let wrong = RegisterList::parse("bad_registers.toml", text, Behind::default()).unwrap_err();
    insta::assert_snapshot!(wrong);
}

#[test]
fn everything_that_is_wrong_with_an_extension_is_reported_at_once() {
    let wrong = Profile::parse("bad_extension.toml", include_str!("bad_extension.toml"), None).unwrap_err();
    insta::assert_snapshot!(wrong);
}
