//! `axisctl od`.

use super::client::Client;
use super::command_line::Od;
use super::{Output, refusal};
use crate::cli::Failure;
use crate::control::{ObjectValue, Request, Response};
use crate::status::table;

/// The longest value in a list, in characters.
const LONGEST_VALUE: usize = 48;

pub(super) fn run(client: &Client, output: Output, od: Od) -> Result<(), Failure> {
    let is_list = matches!(od, Od::List { .. });
    let request = match od {
        Od::List { device, filter, bus } => Request::OdList { device, bus, filter },
        Od::Read { device, object, bus } => Request::OdRead { device, object, bus },
        Od::Write { device, object, value, bus } => Request::OdWrite { device, object, value, bus },
        Od::Export { device, format, bus } => {
            let format = format.word().to_owned();
            Request::OdExport { device, format, bus }
        }
    };
    match client.ask(&request)? {
        Response::Objects(objects) => output.print(&objects, |objects| text(objects, is_list)),
        Response::Sheet(sheet) => output.print(&sheet, |sheet| sheet.text.clone()),
        other => Err(refusal(other)),
    }
}

/// Objects as a table; a list has its long values cut.
fn text(objects: &[ObjectValue], is_list: bool) -> String {
    let row = |object: &ObjectValue| {
        let ObjectValue { object, name, data_type, access, text, .. } = object.clone();
        let is_cut = is_list && text.chars().count() > LONGEST_VALUE;
        let cut = || text.chars().take(LONGEST_VALUE).chain("...".chars()).collect();
        let text = if is_cut { cut() } else { text };
        [object, data_type, access, text, name]
    };
    table(&["OBJECT", "TYPE", "ACCESS", "VALUE", "NAME"], &objects.iter().map(row).collect::<Vec<_>>())
}
