//! The instructions as data: mnemonic, code and what kind of instruction it is.
//!
//! The User Manual gives four codes (section 7.3: 3 E, 59 MP, 70 WAP, 116 RCP; 1 is none); the others are ours, see
//! `docs/mac4.md`. A parameter is written by its W instruction, whose mnemonic it bears, and read back at the same
//! place.

/// What becomes of an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// It does something; what is written to it does not matter.
    Command,
    /// It chooses the mode that E executes.
    ModeChange,
    /// A system parameter: deinitialised or in the mode "disable" only.
    System,
    /// A parameter of a mode, or of all: E activates it.
    Parameter,
    /// A value that acts at once.
    Live,
    /// It adds to the parameter of this instruction.
    Relative(Instruction),
    /// It is read only.
    Reading,
}

macro_rules! instructions {
    ($($(#[$doc:meta])+ $name:ident = $code:literal $kind:expr,)*) => {
        /// An instruction of the axis controllers; its number is its code, and its sub-index.
        #[expect(non_camel_case_types, reason = "the mnemonics of the manual")]
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u8)]
        pub enum Instruction {
            $($(#[$doc])+ $name = $code,)*
        }

        impl Instruction {
            /// Every instruction, in the order of the codes.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];

            /// Its mnemonic.
            #[must_use]
            pub const fn mnemonic(self) -> &'static str {
                match self { $(Self::$name => stringify!($name),)* }
            }

            pub(crate) const fn kind(self) -> Kind {
                use Kind::{Command, Live, ModeChange, Parameter, Reading, Relative, System};
                match self { $(Self::$name => $kind,)* }
            }
        }
    };
}

instructions! {
    /// Initialise the axis: system parameters act (section 4.9).
    INIT = 2 Command,
    /// Execute: the chosen mode and the parameters act.
    E = 3 Command,
    /// Clear: acknowledge errors (section 6.3).
    C = 4 Command,
    /// Stop, switch off and take the initialisation back.
    DEINIT = 5 Command,
    /// Instructions act at once (section 5.15).
    FLYON = 6 Command,
    /// Instructions wait for each other.
    FLYOFF = 7 Command,
    /// The motor turns as it is wired (section 4.2).
    USN = 8 System,
    /// The motor turns the other way.
    USR = 9 System,
    /// STP: ten times the frequencies, 0 or 1 (section 4.1.3).
    TURBO = 10 System,
    /// `<sh>`: 1 linear, 2 circular, 3 circular-optimised (section 4.3.1).
    UWSH = 20 System,
    /// `<lp>`: positive software limit.
    UWLP = 21 System,
    /// `<ln>`: negative software limit.
    UWLN = 22 System,
    /// `<cr>`: length of a turn.
    UWCR = 23 System,
    /// `<ao>`: axis offset (section 4.3.2).
    UWAO = 24 System,
    /// `<et>`: 0 step counter, 1 relative, 2 absolute, 3 external relative, 4 external absolute (table 4.3).
    UWET = 25 System,
    /// `<ea>`: address of an external sensor; those of table 3.3 are the words of the host.
    UWEA = 26 System,
    /// `<eb>`: significant bits of the sensor.
    UWEB = 27 System,
    /// `<ec>`: counting range of the sensor; zero is all that its bits hold.
    UWEC = 28 System,
    /// `<sc>`: SSI: binary shifts of the sensor's words (section 4.4.2.2).
    UWSC = 29 System,
    /// `<es>`: STP: lines of the encoder (section 4.4.2.3).
    UWES = 30 System,
    /// `<ms>`: STP: motor steps in as many lines.
    UWMS = 31 System,
    /// `<ps>`: positive limit switch: 0 off, 1 active low, 2 active high (section 4.5).
    UWPS = 32 System,
    /// `<ns>`: negative limit switch.
    UWNS = 33 System,
    /// `<rs>`: reference switch.
    UWRS = 34 System,
    /// `<df>`: "drive fault" signal.
    UWSO = 35 System,
    /// `<ki_sc>`: halvings of the integral gain (section 5.16.1).
    UWKISC = 36 System,
    /// `<ssf>`: STP: start/stop frequency (section 4.1.2).
    WSSF = 37 Parameter,
    /// `<bt>`: STP: how long BOOST leads a motion, in ms (section 4.1.4).
    WBT = 38 System,
    /// `<wd>`: how long the host may be silent, in ms; zero for ever (section 4.7).
    WWD = 39 Live,
    /// Vector of interrupt 1, an instruction was read; zero is none (section 4.6).
    WIRQ1 = 41 Live,
    /// Vector of interrupt 2, a response was written.
    WIRQ2 = 42 Live,
    /// Vector of interrupt 3, drive fault.
    WIRQ3 = 43 Live,
    /// Vector of interrupt 4, end of positioning or justification.
    WIRQ4 = 44 Live,
    /// Vector of interrupt 5, emergency stop.
    WIRQ5 = 45 Live,
    /// Vector of interrupt 6, a new command value may be written.
    WIRQ6 = 46 Live,
    /// Reset: brake, then the basic initialisation, for all axes and without E.
    MR = 50 Command,
    /// Mode "disable".
    MD = 51 ModeChange,
    /// Mode "enable".
    ME = 52 ModeChange,
    /// Mode "test".
    UE = 53 ModeChange,
    /// Mode "brake".
    MB = 54 ModeChange,
    /// Mode "search index coarse".
    MC = 55 ModeChange,
    /// Mode "find edge".
    MF = 56 ModeChange,
    /// Mode "home".
    MH = 57 ModeChange,
    /// Mode "search index".
    MI = 58 ModeChange,
    /// Mode "positioning".
    MP = 59 ModeChange,
    /// Mode "speed".
    MS = 60 ModeChange,
    /// Mode "position tracking".
    PT = 61 ModeChange,
    /// Mode "velocity tracking".
    VT = 62 ModeChange,
    /// `<ap>`: target position.
    WAP = 70 Parameter,
    /// Adds to `<ap>`.
    WAP_R = 71 Relative(Self::WAP),
    /// `<pa>`: acceleration of positioning.
    WPA = 72 Parameter,
    /// `<pv>`: its velocity.
    WPV = 73 Parameter,
    /// `<pd>`: its braking ramp.
    WPD = 74 Parameter,
    /// `<tr>`: target radius.
    WTR = 75 Parameter,
    /// `<trt>`: time within the target radius, in ms.
    WTRT = 76 Parameter,
    /// `<stc>`: STP: steps of the creep phase.
    WSTC = 77 Parameter,
    /// `<ca>`: acceleration of the coarse search.
    WCA = 78 Parameter,
    /// `<cv>`: its velocity; the sign is the direction.
    WCV = 79 Parameter,
    /// `<cd>`: its braking ramp.
    WCD = 80 Parameter,
    /// `<ia>`: acceleration of the search for the index.
    WIA = 81 Parameter,
    /// `<iv>`: its velocity; the sign is the direction.
    WIV = 82 Parameter,
    /// `<id>`: its braking ramp.
    WID = 83 Parameter,
    /// `<ha>`: acceleration of homing.
    WHA = 84 Parameter,
    /// `<hv>`: its velocity; the sign is the direction.
    WHV = 85 Parameter,
    /// `<hd>`: its braking ramp.
    WHD = 86 Parameter,
    /// `<fa>`: acceleration of "find edge".
    WFA = 87 Parameter,
    /// `<fv>`: its velocity; the sign is the direction to the reference switch.
    WFV = 88 Parameter,
    /// `<fd>`: its braking ramp.
    WFD = 89 Parameter,
    /// `<dl>`: its switch: 0 reference, 1 negative limit, 2 positive limit.
    WDL = 90 Parameter,
    /// `<sa>`: acceleration of the mode "speed".
    WSA = 91 Parameter,
    /// `<sv>`: its velocity.
    WSV = 92 Parameter,
    /// `<sd>`: its braking ramp.
    WSD = 93 Parameter,
    /// `<vt>`: velocity to follow.
    WVT = 94 Live,
    /// `<at>`: position to follow.
    WAT = 95 Live,
    /// Adds to `<at>`.
    WAT_R = 96 Relative(Self::WAT),
    /// `<da>`: value that the mode "test" puts out.
    WDA = 97 Live,
    /// `<lv>`: justification velocity (section 4.8.3).
    WLV = 98 Parameter,
    /// `<ed>`: emergency braking ramp (section 4.8.2).
    WAA = 99 Parameter,
    /// `<mf>`: maximum following error (section 4.8.1).
    WMF = 100 Parameter,
    /// `<sf>`: binary scaling of velocities and ramps (section 4.8.4).
    WSF = 101 Parameter,
    /// Calls the present position so: sets the axis offset (section 4.3.2).
    WZP = 102 Command,
    /// `<ga>`: gain (section 5.16.1).
    WGA = 104 Parameter,
    /// `<ze>`: zero.
    WZE = 105 Parameter,
    /// `<po>`: pole.
    WPO = 106 Parameter,
    /// `<ki>`: integral gain.
    WKI = 107 Parameter,
    /// `<tl>`: highest output of the controller (section 5.17).
    WTL = 108 Parameter,
    /// Overall status.
    RAS = 110 Reading,
    /// User status.
    RBS = 111 Reading,
    /// System status.
    RSS = 112 Reading,
    /// Version.
    VER = 113 Reading,
    /// Actual velocity in a system sampling period.
    RAV = 114 Reading,
    /// Following error.
    RFE = 115 Reading,
    /// Actual position.
    RCP = 116 Reading,
    /// STP: actual position in increments.
    RCPI = 117 Reading,
    /// Number in the word of the position sensor.
    RCT = 118 Reading,
    /// Word of the position sensor.
    RED = 119 Reading,
    /// Output value.
    ROUT = 120 Reading,
    /// Command velocity in a generator sampling period.
    RPS = 121 Reading,
    /// The mode that the next E executes.
    SEL = 122 Reading,
    /// The mode in which the axis is when all that was executed is done.
    NEXT = 123 Reading,
    /// Executed instructions that wait.
    QUE = 124 Reading,
    /// Fault code of the next response, zero if there is no error.
    ERR = 125 Reading,
    /// Vector of the last interrupt, and in bits 8-15 how many there were.
    IRQ = 126 Reading,
    /// Word of an external sensor that the host supplies (section 3.5.2).
    POS = 127 Live,
    /// Its interlocking flag: 0x8000 has it read, the controller puts zero.
    FLAG = 128 Live,
}

impl Instruction {
    /// The instruction of this code.
    #[must_use]
    pub fn from_code(code: u16) -> Option<Self> {
        Self::ALL.iter().copied().find(|instruction| *instruction as u16 == code)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_codes_of_the_manual_are_kept_and_its_response_codes_are_none() {
        let known = [(3, "E"), (59, "MP"), (70, "WAP"), (116, "RCP")];
        for (code, mnemonic) in known {
            assert_eq!(Instruction::from_code(code).map(Instruction::mnemonic), Some(mnemonic));
        }
        for none in [0, 1, 160, 161, 162, 163, 164, 165, 300] {
            assert_eq!(Instruction::from_code(none), None);
        }
        assert!(Instruction::ALL.is_sorted());
    }
}
