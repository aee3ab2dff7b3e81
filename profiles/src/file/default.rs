//! Values in profile files: numbers, strings, `$NODEID+n` and `$MOTOR.key`.

use od::{DataType, Initial, Range, Value};

use super::reader::{Scalar, Spanned};
use crate::{Motor, Register, RegisterList, Report, Role, Span};

/// What a default begins with that is a datum of the motor.
const MOTOR: &str = "$MOTOR.";

/// What begins with this is a motor register by its role, or by the first of several that the motor has:
/// `$REGISTER.vf_out|err_stat`.
pub(super) const REGISTER: &str = "$REGISTER.";

/// The register among `registers` that `text` means; `None` if there is none, which is reported.
pub(super) fn register<'l>(
    text: &str,
    span: &Span,
    registers: &'l RegisterList,
    report: &mut Report,
) -> Option<&'l Register> {
    let names = text.strip_prefix(REGISTER).unwrap_or(text);
    let found = roles(names, span, report)?.into_iter().find_map(|role| registers.with_role(role));
    if found.is_none() {
        report.error(span, format!("`{}` has no register `{text}`", registers.name), None);
    }
    found
}

/// The roles in `vf_out|err_stat`; `None` if one of them is none, which is reported.
pub(super) fn roles(names: &str, span: &Span, report: &mut Report) -> Option<Vec<Role>> {
    let role = |name: &str| {
        let role = name.parse().ok();
        if role.is_none() {
            report.unknown(span, "register", name, Role::ALL.iter().map(|role| role.name()));
        }
        role
    };
    names.split('|').map(role).collect()
}

/// Whether the default is a datum of the motor.
pub(super) fn is_motor_datum(default: Scalar<'_>) -> bool {
    matches!(default, Scalar::Text(text) if text.starts_with(MOTOR))
}

/// The `default` of an entry of `data_type`; `None` if it does not suit, which is reported, or if it asks for a
/// motor that could not be read.
pub(crate) fn initial(
    data_type: DataType,
    default: &Spanned<Scalar<'_>>,
    motor: Option<&Motor>,
    report: &mut Report,
) -> Option<Initial> {
    let span = default.span();
    match default.get_ref() {
        Scalar::Text(text) if text.starts_with("$NODEID") => plus_node_id(text, &span, report),
        Scalar::Text(text) if text.starts_with(MOTOR) => {
            let number = motor_datum(text, &span, report)?(motor?);
            value(data_type, Scalar::Integer(number.into()), &span, report).map(Initial::Value)
        }
        scalar => value(data_type, *scalar, &span, report).map(Initial::Value),
    }
}

/// The `range = [min, max]` of an entry of `data_type`.
pub(super) fn range(
    data_type: DataType,
    bounds: &Spanned<Vec<Scalar<'_>>>,
    report: &mut Report,
) -> Option<Range> {
    #[expect(clippy::cast_precision_loss, reason = "the bound of a real is a real")]
    let real = |bound: &Scalar<'_>| match bound {
        Scalar::Integer(number) => Some(*number as f64),
        Scalar::Real(number) => Some(*number),
        Scalar::Bool(_) | Scalar::Text(_) => None,
    };
    let range = match bounds.get_ref().as_slice() {
        [Scalar::Integer(min), Scalar::Integer(max)] if data_type.integer_limits().is_some() => {
            Some(Range::Integer { min: *min, max: *max })
        }
        [min, max] if data_type.is_real() => {
            real(min).zip(real(max)).map(|(min, max)| Range::Real { min, max })
        }
        _ => None,
    };
    if range.is_none() {
        let message = format!("this is no range of {}", data_type.short_name());
        report.error(&bounds.span(), message, "write `[smallest, largest]`".to_owned());
    }
    range
}

fn value(data_type: DataType, scalar: Scalar<'_>, span: &Span, report: &mut Report) -> Option<Value> {
    let value = match scalar {
        Scalar::Bool(on) if data_type == DataType::Boolean => Value::integer(data_type, on.into()),
        #[expect(clippy::cast_precision_loss, reason = "the default of a real is a real")]
        Scalar::Integer(number) if data_type.is_real() => Value::real(data_type, number as f64),
        Scalar::Integer(number) => Value::integer(data_type, number),
        Scalar::Real(number) => Value::real(data_type, number),
        Scalar::Text(text) if takes(data_type, text) => Some(Value::bytes(text)),
        Scalar::Bool(_) | Scalar::Text(_) => None,
    };
    if value.is_none() {
        let message = format!("this is no value of {}", data_type.short_name());
        report.error(span, message, expected(data_type));
    }
    value
}

fn takes(data_type: DataType, text: &str) -> bool {
    match data_type {
        DataType::VisibleString => text.bytes().all(|c| matches!(c, 0x20..=0x7E)),
        other => other == DataType::OctetString,
    }
}

fn expected(data_type: DataType) -> String {
    match (data_type, data_type.integer_limits()) {
        (DataType::Boolean, _) => "write true or false".to_owned(),
        (_, Some((min, max))) => format!("write an integer from {min} to {max}"),
        (DataType::Real32 | DataType::Real64, None) => "write a number".to_owned(),
        (DataType::VisibleString, None) => "write a string of printable ASCII characters".to_owned(),
        (DataType::OctetString, None) => "write a string".to_owned(),
        (_, None) => "leave the default out".to_owned(),
    }
}

fn plus_node_id(text: &str, span: &Span, report: &mut Report) -> Option<Initial> {
    let base = match text.strip_prefix("$NODEID") {
        Some("") => Some(0),
        Some(rest) => rest.strip_prefix('+').and_then(number),
        None => None,
    };
    if base.is_none() {
        let help = "write `$NODEID+` and a number up to 0xFFFFFFFF, such as `$NODEID+0x80`".to_owned();
        report.error(span, format!("`{text}` is no number"), help);
    }
    base.map(Initial::PlusNodeId)
}

/// A decimal number, or a hexadecimal one after `0x`.
pub(super) fn number(text: &str) -> Option<u32> {
    let parsed = match text.strip_prefix("0x") {
        Some(digits) if digits.starts_with('+') => return None,
        Some(digits) => u32::from_str_radix(digits, 16),
        None => text.parse(),
    };
    parsed.ok()
}

fn motor_datum(text: &str, span: &Span, report: &mut Report) -> Option<fn(&Motor) -> u32> {
    const KNOWN: [&str; 4] = ["counts_per_revolution", "max_speed_rpm", "rated_torque_mnm", "type_code"];
    match text.strip_prefix(MOTOR) {
        Some("counts_per_revolution") => Some(|motor| motor.counts_per_revolution),
        Some("max_speed_rpm") => Some(|motor| motor.max_speed_rpm),
        Some("rated_torque_mnm") => Some(|motor| (motor.rated_torque_nm * 1000.0).round() as u32),
        Some("type_code") => Some(|motor| motor.type_code),
        other => {
            report.unknown(span, "motor datum", other.unwrap_or(text), KNOWN);
            None
        }
    }
}
