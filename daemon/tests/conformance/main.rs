//! The cases of the CANopen conformance test tool of CiA, one test each, on the profile `canopen-reference`:
//! `docs/conformance-tool.md` has the list. What the tool reads in the EDS these tests read in the profile.

mod error_control;
mod nmt_and_other;
mod object_dictionary;
mod pdo;
mod sdo;
mod sync_and_emergency;
mod tool;
