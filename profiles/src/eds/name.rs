//! What a section describes, by its name (CiA 306-1 v1.4, sections 5 to 7).

/// What a section describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Name {
    /// An object: `[1018]`.
    Object(u16),
    /// An entry: `[1018sub1]`.
    Entry(u16, u8),
    /// Names of the entries of an object that is described in one section: `[1016Name]`.
    Names(u16),
    /// Values of such entries: `[1016Value]`.
    Values(u16),
    /// The device or the file as a whole, or what has no meaning for a device: links, tools, modules.
    General,
    /// Something else.
    Unknown,
}

/// Names in lower case that need not be looked at object by object.
const GENERAL: [&str; 14] = [
    "fileinfo",
    "deviceinfo",
    "dummyusage",
    "comments",
    "devicecomissioning",
    "devicecommissioning",
    "mandatoryobjects",
    "optionalobjects",
    "manufacturerobjects",
    "standarddatatypes",
    "supportedmodules",
    "dynamicchannels",
    "tools",
    "connectedmodules",
];

/// What the section with this name in lower case describes.
pub(super) fn of(name: &str) -> Name {
    if GENERAL.contains(&name) || is_of_module(name) || is_tool(name) {
        return Name::General;
    }
    let packed: String = name.chars().filter(|c| !c.is_whitespace()).collect();
    object(packed.strip_prefix("0x").unwrap_or(&packed)).unwrap_or(Name::Unknown)
}

fn object(name: &str) -> Option<Name> {
    const DIGITS: usize = 4;
    let (digits, rest) = name.split_at_checked(DIGITS)?;
    let index = u16::try_from(hexadecimal(digits)?).ok()?;
    if let Some(sub) = rest.strip_prefix("sub") {
        let sub = sub.strip_prefix("0x").unwrap_or(sub);
        return u8::try_from(hexadecimal(sub)?).ok().map(|sub| Name::Entry(index, sub));
    }
    match rest {
        "" => Some(Name::Object(index)),
        "name" => Some(Name::Names(index)),
        "value" => Some(Name::Values(index)),
        "denotation" | "objectlinks" => Some(Name::General),
        _ => None,
    }
}

fn hexadecimal(digits: &str) -> Option<u32> {
    let are_digits = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    u32::from_str_radix(digits, 16).ok().filter(|_| are_digits)
}

/// `[M1ModuleInfo]`, `[M1SubExt6000]` and their likes.
fn is_of_module(name: &str) -> bool {
    let rest = name.strip_prefix('m').map(|rest| rest.trim_start_matches(|c: char| c.is_ascii_digit()));
    let is_numbered = name.len() > rest.map_or(0, str::len) + 1;
    let known = ["moduleinfo", "comments", "fixedobjects", "subextends", "subext"];
    is_numbered && rest.is_some_and(|rest| known.iter().any(|known| rest.starts_with(known)))
}

/// `[Tool1]` and so on.
fn is_tool(name: &str) -> bool {
    name.strip_prefix("tool").is_some_and(|rest| !rest.is_empty() && rest.bytes().all(|b| b.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_are_known_by_their_names() {
        for (name, what) in [
            ("1018", Name::Object(0x1018)),
            ("0x60fe", Name::Object(0x60FE)),
            ("1018sub1", Name::Entry(0x1018, 1)),
            ("1003 sub0a", Name::Entry(0x1003, 10)),
            ("1016name", Name::Names(0x1016)),
            ("1016value", Name::Values(0x1016)),
            ("1016objectlinks", Name::General),
            ("fileinfo", Name::General),
            ("m1subext6000", Name::General),
            ("m12moduleinfo", Name::General),
            ("tool3", Name::General),
            ("tool", Name::Unknown),
            ("moduleinfo", Name::Unknown),
            ("1018sub100", Name::Unknown),
            ("1018sub", Name::Unknown),
            ("6o40", Name::Unknown),
            ("10180", Name::Unknown),
            ("", Name::Unknown),
        ] {
            assert_eq!(of(name), what, "{name}");
        }
    }
}
