//! What the fuzz targets do, one function each. The main workspace replays `seeds` with them, so they are no part of it and
//! need no fuzzer.

pub mod ascii_gateway;
pub mod concise_dcf;
pub mod control_request;
pub mod dump;
pub mod eds;
pub mod gateway_toml;
pub mod lss_master;
pub mod modbus;
pub mod nmt_master;
pub mod parameter_file;
pub mod profile_toml;
pub mod sdo_client;
pub mod socketcand_line;
pub mod story;
pub mod wire_format;

/// A target.
pub type Target = fn(&[u8]);

/// Every target and its name, which the folder with its seeds has, too.
pub const TARGETS: [(&str, Target); 16] = [
    ("ascii_gateway", ascii_gateway::run),
    ("concise_dcf", concise_dcf::run),
    ("control_request", control_request::run),
    ("dump", dump::run),
    ("eds", eds::run),
    ("gateway_toml", gateway_toml::run),
    ("lss_master", lss_master::run),
    ("modbus", modbus::run),
    ("nmt_master", nmt_master::run),
    ("node", story::tell),
    ("parameter_file", parameter_file::run),
    ("profile_toml", profile_toml::run),
    ("sdo", story::request),
    ("sdo_client", sdo_client::run),
    ("socketcand_line", socketcand_line::run),
    ("wire_format", wire_format::run),
];
