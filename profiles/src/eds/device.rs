//! What a file says of the device as a whole: who it is, and where it was put into service (CiA 306-1 v1.4, sections 5
//! and 7).

use super::ini::{Ini, Section, Text};
use super::number;
use crate::profile::Commissioning;
use crate::{Report, Span};

/// Most PDOs of one direction.
const MOST_PDOS: u32 = 512;

/// `[FileInfo]`, `[DeviceInfo]` and `[DeviceComissioning]`.
#[derive(Debug, Default)]
pub(super) struct Sheet {
    pub(super) description: Option<String>,
    pub(super) vendor: Option<String>,
    pub(super) product: Option<String>,
    /// Vendor-ID, product code and revision number.
    identity: [Option<u32>; 3],
    /// How many RPDOs there are, and where that stands.
    pub(super) rpdos: Option<(u16, Span)>,
    /// The same of TPDOs.
    pub(super) tpdos: Option<(u16, Span)>,
    /// Which sub-indices PDOs have that are not described.
    pub(super) compact_pdo: Option<u8>,
    pub(super) commissioning: Commissioning,
    /// Where the device is described.
    pub(super) span: Span,
}

impl Sheet {
    pub(super) fn read(ini: &Ini<'_>, report: &mut Report) -> Self {
        let text = |section: Option<&Section<'_>>, key: &str| {
            section.and_then(|section| section.get(key)).map(|text| text.text.to_owned())
        };
        let (file, device) = (ini.get("fileinfo"), ini.get("deviceinfo"));
        if device.is_none() {
            report.warn(&(0..0), "there is no section [DeviceInfo]", None);
        }
        let mut number = |key, highest| {
            let text = device.and_then(|section| section.get(key))?;
            Some((integer(text, highest, report)?, text.span.clone()))
        };
        let identity = ["vendornumber", "productnumber", "revisionnumber"];
        let identity = identity.map(|key| number(key, u32::MAX).map(|(number, _)| number));
        let pdos = ["nrofrxpdo", "nroftxpdo"].map(|key| number(key, MOST_PDOS));
        let [rpdos, tpdos] = pdos.map(|pdos| pdos.map(|(number, span)| (number as u16, span)));
        let compact_pdo = number("compactpdo", u8::MAX.into()).map(|(mask, _)| mask as u8);
        report_modules(ini, report);
        Self {
            description: text(file, "description"),
            vendor: text(device, "vendorname"),
            product: text(device, "productname"),
            identity,
            rpdos,
            tpdos,
            compact_pdo,
            commissioning: commissioning(ini, report),
            span: device.or(file).map_or(0..0, |section| section.span.clone()),
        }
    }

    /// What `[DeviceInfo]` says of 0x1018:`sub`.
    pub(super) fn identity(&self, sub: u8) -> Option<u32> {
        self.identity.get(usize::from(sub).checked_sub(1)?).copied().flatten()
    }
}

/// The number that `text` is; none if it exceeds `highest` or is no number, which is reported.
fn integer(text: &Text<'_>, highest: u32, report: &mut Report) -> Option<u32> {
    let number = number::plain(text.text).and_then(|number| u32::try_from(number.value).ok());
    let number = number.filter(|number| *number <= highest);
    if number.is_none() {
        let message = format!("`{}`: `{}` is no number from 0 to {highest}", text.key.0, text.text);
        report.warn(&text.span, message, None);
    }
    number
}

/// The section about where the device of a DCF was put into service. Both spellings are in use.
pub(super) fn commissioned<'i, 't>(ini: &'i Ini<'t>) -> Option<&'i Section<'t>> {
    ini.get("devicecomissioning").or_else(|| ini.get("devicecommissioning"))
}

fn commissioning(ini: &Ini<'_>, report: &mut Report) -> Commissioning {
    let Some(section) = commissioned(ini) else { return Commissioning::default() };
    const HIGHEST_NODE_ID: u32 = 127;
    let mut number = |key, highest| section.get(key).and_then(|text| integer(text, highest, report));
    Commissioning {
        node_id: number("nodeid", HIGHEST_NODE_ID)
            .filter(|node_id| *node_id > 0)
            .map(|node_id| node_id as u8),
        bit_rate_kbit_s: number("baudrate", 1000).filter(|rate| *rate > 0).map(|rate| rate as u16),
    }
}

/// Modules that can be plugged in are objects that come and go, which no device here has.
fn report_modules(ini: &Ini<'_>, report: &mut Report) {
    for (section, key, what) in [
        (
            "supportedmodules",
            "nrofentries",
            "modules that can be plugged in are not served: the device is without any",
        ),
        ("dynamicchannels", "nrofseg", "variables of a program (dynamic channels) are not served"),
    ] {
        let text = ini.get(section).and_then(|section| section.get(key));
        let number = text.and_then(|text| number::plain(text.text)).map_or(0, |number| number.value);
        if let Some(text) = text.filter(|_| number > 0) {
            report.warn(&text.span, what, None);
        }
    }
}
