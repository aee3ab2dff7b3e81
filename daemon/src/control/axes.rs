//! The axes that an order is about, changed and told of.

use core::ops::Range;

use profiles::Device;

use crate::core::Core;

/// The position of the device of this name.
pub(crate) fn find(core: &Core, device: &str) -> Result<usize, String> {
    core.find(device).ok_or_else(|| {
        let known: Vec<&str> = core.names().map(|(_, name)| name).collect();
        format!("no device `{device}`; there are: {}", known.join(", "))
    })
}

/// Has `act` change one axis of a device, by its number from 1, or without `axis` each of them. It is given the position of
/// the device and the number of the axis from 0.
pub(super) fn change<E: ToString>(
    core: &mut Core,
    device: &str,
    axis: Option<usize>,
    act: impl Fn(&mut Core, usize, usize) -> Result<(), E>,
) -> Result<(), String> {
    let number = find(core, device)?;
    for axis in meant(core, number, device, axis)? {
        act(core, number, axis).map_err(|error| error.to_string())?;
    }
    Ok(())
}

/// What `tell` says of each axis, by its number from 0: of one device, or of all.
pub(super) fn list<T>(
    core: &Core,
    device: Option<&str>,
    tell: impl Fn(&str, &Device, usize) -> Option<T>,
) -> Result<Vec<T>, String> {
    let only = device.map(|name| find(core, name)).transpose()?;
    let mut told = Vec::new();
    for (number, name) in core.names().filter(|(number, _)| only.is_none_or(|only| only == *number)) {
        let Some(device) = core.device(number) else { continue };
        told.extend((0..device.axes().count()).filter_map(|axis| tell(name, device, axis)));
    }
    Ok(told)
}

/// The numbers from 0 of the axes that are meant.
fn meant(core: &Core, number: usize, device: &str, axis: Option<usize>) -> Result<Range<usize>, String> {
    let count = core.device(number).map_or(0, |device| device.axes().count());
    match (count, axis) {
        (0, _) => Err(format!("device `{device}` has no axis")),
        (_, None) => Ok(0..count),
        (_, Some(axis @ 1..)) if axis <= count => Ok(axis - 1..axis),
        (1, Some(axis)) => Err(format!("device `{device}` has no axis {axis}, only axis 1")),
        (_, Some(axis)) => Err(format!("device `{device}` has no axis {axis}, only 1 to {count}")),
    }
}
