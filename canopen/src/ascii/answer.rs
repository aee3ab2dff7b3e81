//! What a command is answered: `[sequence]` and `OK`, a value or `ERROR:` with a code.

use core::fmt;

use od::AbortCode;

/// An error of the gateway itself (CiA 309-1, internal error codes).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub(super) enum GatewayError {
    NotSupported = 100,
    Syntax = 101,
    State = 102,
    TimedOut = 103,
    NoDefaultNet = 104,
    NoDefaultNode = 105,
    UnsupportedNet = 106,
    UnsupportedNode = 107,
    GuardingLost = 200,
    HeartbeatStarted = 202,
    HeartbeatLost = 203,
    PdoLength = 401,
    Lss = 501,
    LssNodeId = 502,
    LssBitRate = 503,
    LssStore = 504,
}

impl GatewayError {
    const fn text(self) -> &'static str {
        match self {
            Self::NotSupported => "request not supported",
            Self::Syntax => "syntax error",
            Self::State => "not processed due to internal state",
            Self::TimedOut => "time-out",
            Self::NoDefaultNet => "no default net set",
            Self::NoDefaultNode => "no default node set",
            Self::UnsupportedNet => "unsupported net",
            Self::UnsupportedNode => "unsupported node",
            Self::GuardingLost => "lost guarding message",
            Self::HeartbeatStarted => "heartbeat started",
            Self::HeartbeatLost => "heartbeat lost",
            Self::PdoLength => "PDO length exceeded",
            Self::Lss => "LSS implementation- or manufacturer-specific error",
            Self::LssNodeId => "LSS node-ID not supported",
            Self::LssBitRate => "LSS bit-rate not supported",
            Self::LssStore => "LSS parameter storing failed",
        }
    }
}

/// The code, and behind it as a comment what it means.
impl fmt::Display for GatewayError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} #{}", *self as u16, self.text())
    }
}

/// How a command has ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Answer {
    Done,
    Value(String),
    Failed(GatewayError),
    /// An SDO transfer was aborted with this code, which need not be one of the standard.
    Aborted(u32),
}

impl Answer {
    /// That a value does not have the type that the client named.
    pub(super) const WRONG_TYPE: Self = Self::Aborted(AbortCode::LengthMismatch.code());
}

impl fmt::Display for Answer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Done => f.write_str("OK"),
            Self::Value(value) => f.write_str(value),
            Self::Failed(error) => write!(f, "ERROR:{error}"),
            Self::Aborted(code) => match AbortCode::from_code(*code) {
                Some(known) => write!(f, "ERROR:0x{code:08X} #{}", known.text()),
                None => write!(f, "ERROR:0x{code:08X}"),
            },
        }
    }
}
