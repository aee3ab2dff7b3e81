//! An EDS or DCF: read with a place for each finding or refused, and what is read makes a sheet that is read again.

use profiles::{Profile, Severity};

/// Reads `bytes`.
pub fn run(bytes: &[u8]) {
    let (profile, findings) = Profile::from_data_sheet("fuzzed.dcf", bytes);
    assert_eq!(profile.is_none(), findings.0.iter().any(|finding| finding.severity == Severity::Error));
    if let Some(profile) = profile {
        assert!(Profile::from_data_sheet("again.eds", profile.eds().as_bytes()).0.is_some());
    }
}
