//! `axisctl`, which asks a running `axisd`.

use std::process::ExitCode;

fn main() -> ExitCode {
    daemon::axisctl::main()
}
