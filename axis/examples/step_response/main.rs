//! Draws how controllers and generators answer, as SVG files:
//! `cargo run -p axis --example step_response -- docs/pictures`.

mod chart;
mod responses;

use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(folder) = std::env::args_os().nth(1) else {
        eprintln!("usage: step_response FOLDER");
        return ExitCode::FAILURE;
    };
    match draw(Path::new(&folder)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{}: {error}", folder.to_string_lossy());
            ExitCode::FAILURE
        }
    }
}

fn draw(folder: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    for (name, chart) in responses::pictures() {
        std::fs::write(folder.join(format!("{name}.svg")), chart.svg())?;
    }
    Ok(())
}
