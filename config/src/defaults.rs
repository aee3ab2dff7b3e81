//! `[device.objects]`, `[device.limits]` and `[device.motor_data]`: what a device has otherwise than its profile.

use std::sync::Arc;

use od::Address;
use profiles::reader::{Node, Scalar, Spanned, Table};
use profiles::{Binding, MotorData, OwnDefault, Profile, Report, Span};

/// The limits of an axis by the objects that hold them, in the units of those objects.
pub const LIMITS: [(&str, Binding); 9] = [
    ("min_position", Binding::MinPositionLimit),
    ("max_position", Binding::MaxPositionLimit),
    ("max_profile_velocity", Binding::MaxProfileVelocity),
    ("max_motor_speed_rpm", Binding::MaxMotorSpeed),
    ("max_acceleration", Binding::MaxAcceleration),
    ("max_deceleration", Binding::MaxDeceleration),
    ("max_torque_permille", Binding::MaxTorque),
    ("positive_torque_limit_permille", Binding::PositiveTorqueLimit),
    ("negative_torque_limit_permille", Binding::NegativeTorqueLimit),
];

/// Data of the motor, and where they stand.
pub(crate) struct OwnMotor {
    pub(crate) data: MotorData,
    pub(crate) span: Span,
}

/// Reads `[device.motor_data]`, if it is there.
pub(crate) fn motor_data(device: &mut Table<'_, '_>) -> Option<OwnMotor> {
    let node = device.get::<Node>("motor_data")?;
    let span = device.key_span("motor_data");
    let mut table = node.open(device.report);
    let data = MotorData::read(&mut table);
    table.finish();
    Some(OwnMotor { data, span })
}

/// Reads `[device.limits]` and `[device.objects]`, and gives the profile with what they say and what that is. What an
/// object says for itself comes before a limit.
pub(crate) fn read(
    device: &mut Table<'_, '_>,
    profile: Option<Arc<Profile>>,
) -> (Option<Arc<Profile>>, Vec<OwnDefault>) {
    let limits = device.get::<Node>("limits");
    let objects = device.get::<Node>("objects");
    let Some(profile) = profile else { return (None, Vec::new()) };
    let mut wanted = Vec::new();
    limits.into_iter().for_each(|node| read_limits(node, &profile, &mut wanted, device.report));
    objects.into_iter().for_each(|node| read_objects(&node, &profile, &mut wanted, device.report));
    if wanted.is_empty() {
        return (Some(profile), Vec::new());
    }
    let (own, defaults) = Profile::clone(&profile).with_defaults(&wanted, device.report);
    (Some(Arc::new(own)), defaults)
}

type Wanted<'d> = Vec<(Address, Spanned<Scalar<'d>>)>;

fn read_limits<'d>(node: Node<'d>, profile: &Profile, wanted: &mut Wanted<'d>, report: &mut Report) {
    let mut table = node.open(report);
    for (key, binding) in LIMITS {
        let Some(value) = table.get::<Spanned<Scalar<'d>>>(key) else { continue };
        let before = wanted.len();
        wanted.extend(profile.bound_to(binding).map(|address| (address, value.clone())));
        if wanted.len() == before {
            let message = format!("the profile {} has no such limit", profile.name);
            table.report.error(&table.key_span(key), message, "leave it out".to_owned());
        }
    }
    table.finish();
}

fn read_objects<'d>(node: &Node<'d>, profile: &Profile, wanted: &mut Wanted<'d>, report: &mut Report) {
    let mut named: Vec<Address> = Vec::new();
    for (key, value) in node.values::<Spanned<Scalar<'d>>>(report) {
        match profile.entry_named(key.get_ref()) {
            Ok(address) if named.contains(&address) => {
                report.error(
                    &key.span(),
                    format!("{address} has a value already"),
                    "leave one out".to_owned(),
                );
            }
            Ok(address) => {
                named.push(address);
                wanted.push((address, value));
            }
            Err(no) => report.error(&key.span(), no.message, no.help),
        }
    }
}
