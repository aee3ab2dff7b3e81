//! Data sheets of running devices by the control socket.

use std::collections::BTreeMap;

use od::{Address, Configuration, Entry, Schema, Value, eds, xdd};
use serde::{Deserialize, Serialize};

use super::objects::{BATCH, Objects};
use super::request::Response;

/// Where a device has its serial number.
const SERIAL_NUMBER: Address = Address::new(0x1018, 4);

/// A data sheet of a device.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DataSheet {
    /// The name that the file is meant to have.
    pub file: String,
    /// What stands in it.
    pub text: String,
}

impl Objects<'_> {
    /// The data sheet in the form that `format` names: `eds` and `xdd` tell what the kind of device is, `dcf` and `xdc`
    /// also how this one is configured now.
    pub(super) async fn export(&self, format: &str) -> Result<Response, String> {
        let (is_configured, form): (bool, fn(&od::Sheet<'_>) -> String) = match format {
            "eds" => (false, eds::write),
            "dcf" => (true, eds::write),
            "xdd" => (false, xdd::write),
            "xdc" => (true, xdd::write),
            unknown => return Err(format!("unknown format `{unknown}`; known: eds, dcf, xdd, xdc")),
        };
        let configuration = if is_configured { Some(self.configuration().await?) } else { None };
        let profile = &self.described.profile;
        let file = format!("{}.{format}", profile.name);
        let text = profile.describe(configuration.as_ref(), form);
        Ok(Response::Sheet(DataSheet { file, text }))
    }

    async fn configuration(&self) -> Result<Configuration, String> {
        let parameters = self.areas().into_iter().flat_map(Schema::entries);
        // What commands an axis is no setting, even where a device stores it.
        let is_shown = |entry: &Entry| entry.is_parameter() && entry.command.is_none() && !entry.is_local;
        let parameters = parameters.filter(|(_, entry)| is_shown(entry)).map(|(address, _)| address);
        let mut values = BTreeMap::new();
        for some in parameters.collect::<Vec<_>>().chunks(BATCH) {
            let read = self.order(Vec::new(), some.to_vec()).await?;
            // What has no value at the moment is not configured.
            values.extend(some.iter().zip(read).filter_map(|(address, value)| Some((*address, value.ok()?))));
        }
        let serial = self.order(Vec::new(), vec![SERIAL_NUMBER]).await?;
        let serial = serial.into_iter().flatten().next().map_or(0, |serial| Value::raw(&serial));
        let place = self.place()?;
        Ok(Configuration {
            node_id: place.node_id,
            node_name: self.described.device.clone(),
            bit_rate: None,
            network: place.network,
            network_name: place.bus.clone(),
            serial_number: u32::try_from(serial).unwrap_or(0),
            values,
        })
    }
}
