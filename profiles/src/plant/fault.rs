//! The text form of plant faults, for configurations and for people at a keyboard: `encoder-break`,
//! `blocked-shaft`, `stuck-switch:home=low`, `drive-fault:over-current`, `supply-dip:10`, `connection-loss`.

use core::fmt;
use core::ops::RangeInclusive;
use core::str::FromStr;

use axis::{DriveFault, Input, Voltage};
use thiserror::Error;

use crate::diagnostics::suggestion;

/// Something of the simulated plant that breaks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantFault(pub axis::PlantFault);

/// What is to be repaired.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Repair {
    /// Everything: `all`.
    All,
    /// This fault, whatever its voltage, level or cause; these may be left out: `supply-dip`, `stuck-switch:home`.
    One(PlantFault),
}

/// A text that is no fault.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{message}{}", help.iter().map(|help| format!("; {help}")).collect::<String>())]
pub struct UnknownFault {
    /// What is wrong.
    pub message: String,
    /// What would be right, if that can be said.
    pub help: Option<String>,
}

const ENCODER_BREAK: &str = "encoder-break";
const BLOCKED_SHAFT: &str = "blocked-shaft";
const STUCK_SWITCH: &str = "stuck-switch";
const DRIVE_FAULT: &str = "drive-fault";
const SUPPLY_DIP: &str = "supply-dip";
const CONNECTION_LOSS: &str = "connection-loss";
const FAULTS: [&str; 6] =
    [ENCODER_BREAK, BLOCKED_SHAFT, STUCK_SWITCH, DRIVE_FAULT, SUPPLY_DIP, CONNECTION_LOSS];
const ALL: &str = "all";

/// What a supply may sink to, in volts.
const VOLTS: RangeInclusive<f64> = 0.0..=1e5;

/// Words and what they mean.
type Words<T> = [(&'static str, T)];

/// The inputs of a drive, as configurations and faults name them.
pub const INPUT_WORDS: &Words<Input> = &[
    ("positive-limit", Input::PositiveLimit),
    ("negative-limit", Input::NegativeLimit),
    ("home", Input::Home),
    ("drive-fault", Input::DriveFault),
    ("emergency-stop", Input::EmergencyStop),
    ("probe-1", Input::Probe1),
    ("probe-2", Input::Probe2),
];

const LEVELS: &Words<bool> = &[("high", true), ("low", false)];

const CAUSES: &Words<DriveFault> = &[
    ("over-current", DriveFault::OverCurrent),
    ("over-voltage", DriveFault::OverVoltage),
    ("under-voltage", DriveFault::UnderVoltage),
    ("over-temperature", DriveFault::OverTemperature),
    ("overload", DriveFault::Overload),
    ("encoder", DriveFault::Encoder),
    ("safe-torque-off", DriveFault::SafeTorqueOff),
    ("internal", DriveFault::Internal),
];

impl FromStr for PlantFault {
    type Err = UnknownFault;

    fn from_str(text: &str) -> Result<Self, UnknownFault> {
        let (word, detail) = text.split_once(':').unzip();
        let fault = match (word.unwrap_or(text), detail) {
            (ENCODER_BREAK, None) => axis::PlantFault::EncoderBreak,
            (BLOCKED_SHAFT, None) => axis::PlantFault::BlockedShaft,
            (CONNECTION_LOSS, None) => axis::PlantFault::ConnectionLoss,
            (STUCK_SWITCH, Some(detail)) => stuck_switch(detail)?,
            (DRIVE_FAULT, Some(cause)) => axis::PlantFault::DriveFault(find("drive fault", CAUSES, cause)?),
            (SUPPLY_DIP, Some(volts)) => axis::PlantFault::SupplyDip(voltage(volts)?),
            (word, _) => return Err(misused(word)),
        };
        Ok(Self(fault))
    }
}

impl fmt::Display for PlantFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            axis::PlantFault::EncoderBreak => f.write_str(ENCODER_BREAK),
            axis::PlantFault::BlockedShaft => f.write_str(BLOCKED_SHAFT),
            axis::PlantFault::StuckSwitch(input, level) => {
                write!(f, "{STUCK_SWITCH}:{}={}", word(INPUT_WORDS, &input), word(LEVELS, &level))
            }
            axis::PlantFault::DriveFault(cause) => write!(f, "{DRIVE_FAULT}:{}", word(CAUSES, &cause)),
            axis::PlantFault::SupplyDip(Voltage(volts)) => write!(f, "{SUPPLY_DIP}:{volts}"),
            axis::PlantFault::ConnectionLoss => f.write_str(CONNECTION_LOSS),
        }
    }
}

impl FromStr for Repair {
    type Err = UnknownFault;

    fn from_str(text: &str) -> Result<Self, UnknownFault> {
        let is_stuck_switch = text.split_once(':').is_some_and(|(word, _)| word == STUCK_SWITCH);
        let text = match text {
            ALL => return Ok(Self::All),
            DRIVE_FAULT => format!("{text}:internal"),
            SUPPLY_DIP => format!("{text}:0"),
            text if is_stuck_switch && !text.contains('=') => format!("{text}=low"),
            text => text.to_owned(),
        };
        text.parse().map(Self::One)
    }
}

fn stuck_switch(detail: &str) -> Result<axis::PlantFault, UnknownFault> {
    let (input, level) = detail.split_once('=').unzip();
    let input = find("input", INPUT_WORDS, input.unwrap_or(detail))?;
    let level = level.ok_or_else(|| misused(STUCK_SWITCH))?;
    Ok(axis::PlantFault::StuckSwitch(input, find("level", LEVELS, level)?))
}

fn voltage(text: &str) -> Result<Voltage, UnknownFault> {
    let volts = text.parse().ok().filter(|volts| VOLTS.contains(volts));
    volts.map(Voltage).ok_or_else(|| UnknownFault {
        message: format!("`{text}` is no voltage"),
        help: Some(format!("write a number from {} to {}", VOLTS.start(), VOLTS.end())),
    })
}

/// What is wrong with a fault that begins with `word`: the word itself, or what follows it.
fn misused(word: &str) -> UnknownFault {
    let right = match word {
        STUCK_SWITCH => "stuck-switch:INPUT=LEVEL, such as `stuck-switch:home=low`",
        DRIVE_FAULT => "drive-fault:CAUSE, such as `drive-fault:over-current`",
        SUPPLY_DIP => "supply-dip:VOLTS, such as `supply-dip:10`",
        ENCODER_BREAK | BLOCKED_SHAFT | CONNECTION_LOSS => {
            return UnknownFault { message: format!("`{word}` stands alone"), help: None };
        }
        _ => return unknown("fault", word, FAULTS),
    };
    UnknownFault { message: format!("`{word}` needs more"), help: Some(format!("write {right}")) }
}

fn find<T: Copy>(what: &str, words: &Words<T>, wanted: &str) -> Result<T, UnknownFault> {
    let found = words.iter().find(|(word, _)| *word == wanted);
    found.map(|(_, value)| *value).ok_or_else(|| unknown(what, wanted, words.iter().map(|(word, _)| *word)))
}

fn unknown(what: &str, word: &str, known: impl IntoIterator<Item = &'static str>) -> UnknownFault {
    UnknownFault { message: format!("unknown {what} `{word}`"), help: suggestion(word, known) }
}

fn word<T: PartialEq>(words: &Words<T>, value: &T) -> &'static str {
    words.iter().find(|(_, known)| known == value).map_or("?", |(word, _)| *word)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn refused(text: &str) -> String {
        text.parse::<PlantFault>().unwrap_err().to_string()
    }

    fn fault() -> impl Strategy<Value = PlantFault> {
        let input = prop::sample::select(INPUT_WORDS).prop_map(|(_, input)| input);
        let cause = prop::sample::select(CAUSES).prop_map(|(_, cause)| cause);
        let fault = prop_oneof![
            Just(axis::PlantFault::EncoderBreak),
            Just(axis::PlantFault::BlockedShaft),
            Just(axis::PlantFault::ConnectionLoss),
            (input, any::<bool>()).prop_map(|(input, level)| axis::PlantFault::StuckSwitch(input, level)),
            cause.prop_map(axis::PlantFault::DriveFault),
            VOLTS.prop_map(|volts| axis::PlantFault::SupplyDip(Voltage(volts))),
        ];
        fault.prop_map(PlantFault)
    }

    #[test]
    fn every_fault_has_its_text() {
        let text = |fault| PlantFault(fault).to_string();
        assert_eq!(text(axis::PlantFault::EncoderBreak), "encoder-break");
        assert_eq!(text(axis::PlantFault::BlockedShaft), "blocked-shaft");
        assert_eq!(text(axis::PlantFault::ConnectionLoss), "connection-loss");
        let stuck = axis::PlantFault::StuckSwitch(Input::PositiveLimit, true);
        assert_eq!(text(stuck), "stuck-switch:positive-limit=high");
        assert_eq!(text(axis::PlantFault::DriveFault(DriveFault::OverCurrent)), "drive-fault:over-current");
        assert_eq!(text(axis::PlantFault::SupplyDip(Voltage(10.0))), "supply-dip:10");
    }

    #[test]
    fn a_text_that_is_no_fault_is_answered_with_what_would_be_right() {
        let known =
            "known: encoder-break, blocked-shaft, stuck-switch, drive-fault, supply-dip, connection-loss";
        assert_eq!(
            refused("blocked-shaf"),
            format!("unknown fault `blocked-shaf`; did you mean `blocked-shaft`? {known}")
        );
        assert_eq!(refused(""), format!("unknown fault ``; {known}"));
        assert_eq!(
            refused("stuck-switch:positve-limit=high"),
            "unknown input `positve-limit`; did you mean `positive-limit`? \
             known: positive-limit, negative-limit, home, drive-fault, emergency-stop, probe-1, probe-2"
        );
        assert_eq!(refused("stuck-switch:home=up"), "unknown level `up`; known: high, low");
        let needs_more =
            "`stuck-switch` needs more; write stuck-switch:INPUT=LEVEL, such as `stuck-switch:home=low`";
        assert_eq!([refused("stuck-switch"), refused("stuck-switch:home")], [needs_more; 2]);
        assert!(refused("drive-fault:over-curent").contains("did you mean `over-current`?"));
        assert!(refused("drive-fault").starts_with("`drive-fault` needs more"));
        for volts in ["", "-1", "nan", "inf", "100001", "ten"] {
            let refused = refused(&format!("supply-dip:{volts}"));
            assert_eq!(refused, format!("`{volts}` is no voltage; write a number from 0 to 100000"));
        }
        assert_eq!(refused("encoder-break:now"), "`encoder-break` stands alone");
    }

    #[test]
    fn a_repair_may_leave_out_what_does_not_matter_for_it() {
        let repair = |text: &str| text.parse::<Repair>().unwrap();
        let one = |text: &str| Repair::One(text.parse().unwrap());
        assert_eq!(repair("all"), Repair::All);
        assert_eq!(repair("supply-dip"), one("supply-dip:0"));
        assert_eq!(repair("drive-fault"), one("drive-fault:internal"));
        assert_eq!(repair("stuck-switch:home"), one("stuck-switch:home=low"));
        assert_eq!(repair("stuck-switch:home=high"), one("stuck-switch:home=high"));
        let refused = |text: &str| text.parse::<Repair>().unwrap_err().message;
        assert_eq!(refused("stuck-switch"), "`stuck-switch` needs more");
        assert_eq!(refused("every"), "unknown fault `every`");
    }

    proptest! {
        #[test]
        fn a_fault_survives_the_way_through_its_text(fault in fault()) {
            prop_assert_eq!(fault.to_string().parse(), Ok(fault));
            prop_assert_eq!(fault.to_string().parse(), Ok(Repair::One(fault)));
        }

        #[test]
        fn any_text_is_read_or_refused(text in "[a-z:=.0-9-]{0,30}|.*") {
            if let Ok(fault) = text.parse::<PlantFault>() {
                prop_assert_eq!(fault.to_string().parse(), Ok(fault));
            }
        }
    }
}
