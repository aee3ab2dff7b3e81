//! The `axisd` daemon.

use std::process::ExitCode;

fn main() -> ExitCode {
    daemon::cli::main()
}
