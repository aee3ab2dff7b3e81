//! What is wrong with a profile file is said all at once, with line, column and a way out.

use profiles::Profile;

#[test]
fn everything_that_is_wrong_with_a_file_is_reported_at_once() {
    let wrong = Profile::parse("bad.toml", include_str!("bad.toml"), None).unwrap_err();
    insta::assert_snapshot!(wrong);
}
