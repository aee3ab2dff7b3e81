//! The commands in our documents that run on any machine. Those that need CAN or the package are run by `socketcan` and
//! `package`.

use tests::guide::{Place, blocks, tell};

use std::fs;
use std::path::Path;

/// Every document with commands for users.
const DOCUMENTS: [&str; 5] =
    ["README.md", "docs/tutorial.md", "docs/install.md", "docs/troubleshooting.md", "docs/ros2_canopen.md"];

/// What our tests do not do: fetch, build, test, and make what they have been given.
const ELSEWHERE: [&str; 9] = [
    "cargo build ",
    "export PATH=",
    "python3 -m venv ",
    "sudo apt install ",
    "sudo ip link add dev vcan0 type vcan",
    "./scripts/test",
    "scripts/package",
    "sudo ip link set can0 ",
    "sudo modprobe ",
];

#[test]
fn the_tutorial_works() {
    assert!(tell("docs/tutorial.md", Place::Anywhere, None) > 6);
}

#[test]
fn the_readme_works() {
    assert!(tell("README.md", Place::Anywhere, None) > 4);
}

#[test]
fn every_command_says_where_it_is_run() {
    for document in DOCUMENTS {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(document);
        let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{document}: {error}"));
        for block in
            blocks(&text).iter().filter(|block| block.info.iter().any(|word| word == "sh" || word == "bash"))
        {
            let info: Vec<&str> = block.info.iter().map(String::as_str).collect();
            match info[..] {
                ["sh", "run" | "serve"] | ["sh", "run" | "serve", "vcan" | "package"] => {}
                ["sh", "elsewhere"] => {
                    let is_known =
                        |line: &str| ELSEWHERE.iter().any(|known| line.starts_with(known.trim_end()));
                    assert!(block.text.lines().all(is_known), "{document}: {}", block.text);
                }
                _ => panic!("{document}: nobody runs\n{}", block.text),
            }
        }
    }
}
