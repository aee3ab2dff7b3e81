//! What an axis shows of itself: status words and diagnosis (sections 6.1 and 6.2).

use axis::{Motion, Status};
use od::Dictionary;

use super::Controller;
use crate::mac4::drive::SSI_CODING;
use crate::mac4::errors::FaultCode;
use crate::mac4::setup::EncoderType;
use crate::mac4::status::{OverallStatus, SystemStatus, UserStatus};
use crate::mac4::units::Units;
use crate::mac4::{CardType, Instruction, Mode};
use crate::vendor::Scope;

impl Controller {
    /// Shows everything but the overall status, which is that of the card.
    pub(crate) fn show(&self, scope: &mut Scope<'_>) {
        let user = self.user_status(scope.axis.status(), scope.dictionary);
        let system = self.system_status(scope, user);
        let overall = OverallStatus::from_bits_truncate(self.get(scope, Instruction::RAS) as u32);
        let units = self.setup().units(scope);
        let (status, signals) = (*scope.axis.status(), scope.axis.signals());
        let position = if self.is_initialised { status.actual.position } else { axis::Position(0.0) };
        let increments = self.setup().increments(scope.dictionary, position);
        let pending = FaultCode::pending(user, overall).map_or(0, |code| code as i64);
        let next = self.chosen.unwrap_or(self.next);
        let values = [
            (Instruction::RBS, i64::from(user.bits()) | self.mode as i64),
            (Instruction::RSS, i64::from(system.bits())),
            (Instruction::VER, self.version()),
            (Instruction::RAV, units.shown_actual(status.actual.velocity)),
            (Instruction::RFE, Units::shown_position(status.following_error)),
            (Instruction::RCP, Units::shown_position(position)),
            (Instruction::RCPI, increments),
            (Instruction::RCT, i64::from(signals.count)),
            (Instruction::RED, i64::from(signals.word)),
            (Instruction::ROUT, self.output_value(i64::from(signals.output))),
            (Instruction::RPS, units.shown_command(status.demand.velocity)),
            (Instruction::SEL, next as i64),
            (Instruction::NEXT, self.next as i64),
            (Instruction::QUE, self.waiting.len() as i64),
            (Instruction::ERR, pending),
            (Instruction::IRQ, i64::from(self.interrupts) << 8 | i64::from(self.vector)),
        ];
        for (instruction, value) in values {
            self.record.show(scope.dictionary, instruction, value);
        }
    }

    /// RBS without the mode. Switches are told once the axis is initialised (section 4.9).
    fn user_status(&self, status: &Status, dictionary: &Dictionary) -> UserStatus {
        let mut bits = self.errors;
        let switches = if self.is_initialised { status.switches } else { axis::Switches::default() };
        let position = Units::shown_position(status.actual.position);
        let is_linear = self.is_initialised && self.record.get(dictionary, Instruction::UWSH) == 1;
        let is_gray = self.card == CardType::Ssi && SSI_CODING == axis::Coding::Gray;
        bits.set(UserStatus::DR_EN, status.motion != Motion::Off);
        bits.set(UserStatus::REV_O, self.is_reversed);
        bits.set(UserStatus::POS_END, self.pos_end);
        bits.set(UserStatus::JUS_END, self.jus_end);
        bits.set(UserStatus::INIT, self.is_initialised);
        bits.set(UserStatus::DR_F, switches.drive_fault || bits.contains(UserStatus::DR_F));
        bits.set(UserStatus::HWL_N, switches.negative_limit);
        bits.set(UserStatus::HWL_P, switches.positive_limit);
        let negative = self.record.get(dictionary, Instruction::UWLN);
        bits.set(UserStatus::SWL_N, is_linear && position <= negative);
        let positive = self.record.get(dictionary, Instruction::UWLP);
        bits.set(UserStatus::SWL_P, is_linear && position >= positive);
        bits.set(UserStatus::REF, switches.home);
        bits.set(UserStatus::ON_FLY, self.is_on_fly);
        bits.set(UserStatus::GRAY, is_gray);
        bits
    }

    fn system_status(&self, scope: &Scope<'_>, user: UserStatus) -> SystemStatus {
        let (status, signals) = (scope.axis.status(), scope.axis.signals());
        let is_off = status.motion == Motion::Off;
        let mut bits = SystemStatus::empty();
        bits.set(SystemStatus::M_RDY, !user.intersects(UserStatus::ERRORS));
        bits.set(SystemStatus::INIT_WEG_SYS, self.is_initialised);
        if self.card != CardType::Stp {
            bits.set(SystemStatus::DR_DISABLE, is_off);
            return bits;
        }
        let encoder = EncoderType::of(self.get(scope, Instruction::UWET));
        let has_sensor = encoder != EncoderType::StepCounter;
        bits.set(SystemStatus::SERVO_ON, has_sensor && !is_off);
        bits.set(SystemStatus::DIRECTION, status.demand.velocity.0 < 0.0);
        bits.set(SystemStatus::BOOST, signals.boost);
        bits.set(SystemStatus::BOOST_EN, signals.boost_ready);
        bits.set(SystemStatus::BOOST_LOCK, signals.boost && !signals.boost_ready);
        bits.set(SystemStatus::TURBO, signals.turbo);
        bits.set(SystemStatus::IN_POS, self.pos_end);
        bits.set(SystemStatus::LED_FAULT, user.contains(UserStatus::DR_F));
        bits.set(SystemStatus::DR_DISABLE_STP, is_off);
        bits.set(SystemStatus::BRAKE_STOP, self.mode == Mode::Brake);
        bits
    }

    /// ROUT: counts of the converter, or steps in a generator sampling period.
    fn output_value(&self, output: i64) -> i64 {
        if self.card.has_controller() { output } else { output * i64::from(crate::mac4::units::CYCLE) }
    }

    /// VER (table 6.1): release and version of the software, letter of the hardware, card type.
    fn version(&self) -> i64 {
        let (version, release, hardware) = match self.card {
            CardType::Inc => (4, 2, b'D'),
            CardType::Ssi => (4, 2, b'A'),
            CardType::Stp => (2, 2, b'A'),
        };
        i64::from(u32::from_be_bytes([self.card.number(), hardware, version, release]))
    }
}
