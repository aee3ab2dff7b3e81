//! The MAC4 cards by their instructions, on virtual time (MACCON MAC4 User Manual).

mod bench;
mod examples;
mod faults;
mod modes;
mod operation;
mod owner;
mod traffic;
