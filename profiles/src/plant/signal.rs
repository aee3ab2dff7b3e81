//! What comes to an axis from outside of its machine, in text form: `analog-input:2.5`, `external-encoder:-1000`.

use core::fmt;
use core::ops::RangeInclusive;
use core::str::FromStr;

use axis::{Velocity, Voltage};
use thiserror::Error;

use crate::diagnostics::suggestion;

/// Voltages of either sign that an analogue input stands, in V.
pub const ANALOG_INPUT_V: RangeInclusive<f64> = -32.0..=32.0;
/// Speeds of either direction that an external encoder may turn at, in counts/s.
pub const EXTERNAL_ENCODER_COUNTS_PER_S: RangeInclusive<f64> = -1e9..=1e9;

/// A signal and what it is to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Signal {
    /// Voltage at the analogue input.
    AnalogInput(Voltage),
    /// Speed of the encoder that gear modes follow.
    ExternalEncoder(Velocity),
}

/// A text that is no signal.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct UnknownSignal(String);

const ANALOG_INPUT: &str = "analog-input";
const EXTERNAL_ENCODER: &str = "external-encoder";
const SIGNALS: [&str; 2] = [ANALOG_INPUT, EXTERNAL_ENCODER];

impl FromStr for Signal {
    type Err = UnknownSignal;

    fn from_str(text: &str) -> Result<Self, UnknownSignal> {
        let (word, value) = text.split_once(':').unzip();
        match word.unwrap_or(text) {
            ANALOG_INPUT => number(ANALOG_INPUT, value, ANALOG_INPUT_V).map(Voltage).map(Self::AnalogInput),
            EXTERNAL_ENCODER => number(EXTERNAL_ENCODER, value, EXTERNAL_ENCODER_COUNTS_PER_S)
                .map(Velocity)
                .map(Self::ExternalEncoder),
            unknown => {
                let help = suggestion(unknown, SIGNALS).map(|help| format!("; {help}")).unwrap_or_default();
                Err(UnknownSignal(format!("unknown signal `{unknown}`{help}")))
            }
        }
    }
}

impl fmt::Display for Signal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AnalogInput(Voltage(volts)) => write!(f, "{ANALOG_INPUT}:{volts}"),
            Self::ExternalEncoder(Velocity(speed)) => write!(f, "{EXTERNAL_ENCODER}:{speed}"),
        }
    }
}

fn number(word: &str, value: Option<&str>, range: RangeInclusive<f64>) -> Result<f64, UnknownSignal> {
    let number = value.and_then(|value| value.parse().ok()).filter(|number| range.contains(number));
    number.ok_or_else(|| {
        let (min, max) = (range.start(), range.end());
        UnknownSignal(format!("write {word}:NUMBER with a number from {min} to {max}"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_is_a_word_and_a_number_in_its_range() {
        for text in ["analog-input:2.5", "analog-input:-32", "external-encoder:-1000"] {
            assert_eq!(text.parse::<Signal>().unwrap().to_string(), text);
        }
        let refused = |text: &str| text.parse::<Signal>().unwrap_err().to_string();
        assert!(
            refused("analog-inptu:1")
                .starts_with("unknown signal `analog-inptu`; did you mean `analog-input`?")
        );
        let wrong = "write analog-input:NUMBER with a number from -32 to 32";
        for text in ["analog-input", "analog-input:", "analog-input:x", "analog-input:33", "analog-input:NaN"]
        {
            assert_eq!(refused(text), wrong);
        }
    }
}
