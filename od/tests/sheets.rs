//! What the writers of data sheets make of objects.

use std::collections::BTreeMap;

use od::{
    Access, Address, Configuration, DataType, DeviceInfo, Entry, Initial, Mappable, Object, Range, Schema,
    Sheet, Value, eds, xdd,
};

fn entry(sub: u8, name: &str, data_type: DataType) -> Entry {
    Entry::new(sub, name, data_type, Access::ReadWrite)
}

fn written(objects: Vec<Object>, configuration: Option<&Configuration>) -> [String; 2] {
    let schema = Schema::new(objects).unwrap();
    let info =
        DeviceInfo { name: "a".to_owned(), vendor_name: "B & <C>".to_owned(), ..DeviceInfo::default() };
    let sheet = Sheet { info: &info, schemas: &[&schema], configuration };
    [eds::write(&sheet), xdd::write(&sheet)]
}

#[test]
fn a_configuration_adds_values_of_parameters_and_the_place_of_the_node() {
    let number = Entry { initial: Initial::PlusNodeId(0x180), ..entry(0, "id", DataType::Unsigned32) };
    let objects = vec![Object::var(0x1005, number), Object::var(0x2000, entry(0, "n", DataType::Integer8))];
    let configuration = Configuration {
        node_id: 5,
        node_name: "x\n\"y\"".to_owned(),
        bit_rate: Some(500),
        network: 2,
        network_name: "can1".to_owned(),
        serial_number: 0xABC,
        values: BTreeMap::from([
            (Address::new(0x1005, 0), Value::Fixed(0x185)),
            (Address::new(0x2000, 0), Value::Fixed(0xFF)),
        ]),
    };

    let [dcf, xdc] = written(objects, Some(&configuration));

    for lines in [
        "FileName=a.dcf\n",
        "LastEDS=a.eds\n",
        "[DeviceComissioning]\nNodeID=0x5\nNodeName=x \"y\"\nBaudrate=500\nNetNumber=2\nNetworkName=can1\n\
         CANopenManager=0\nLSS_SerialNumber=0x00000ABC\n\n",
        "DefaultValue=$NODEID+0x180\nParameterValue=0x185\n",
        "DefaultValue=0\nParameterValue=-1\n",
    ] {
        assert!(dcf.contains(lines), "{lines}\n{dcf}");
    }
    for markup in [
        "fileName=\"a.xdc\"",
        "<co:instanceName>x&#10;&quot;y&quot;</co:instanceName>",
        "<deviceCommissioning NodeID=\"5\" nodeName=\"x&#10;&quot;y&quot;\" actualBaudRate=\"500 Kbps\" \
         networkNumber=\"2\" networkName=\"can1\" CANopenManager=\"false\"/>",
        "defaultValue=\"$NODEID+0x180\" actualValue=\"0x185\"",
        "defaultValue=\"0\" actualValue=\"-1\"",
    ] {
        assert!(xdc.contains(markup), "{markup}\n{xdc}");
    }
}

#[test]
fn a_name_is_no_markup_and_no_line() {
    let named =
        Entry { mappable: Mappable::Both, ..entry(0, "<a & \"b\">\r\n[FileInfo]\u{1}", DataType::Boolean) };

    let [eds, xdd] = written(vec![Object::var(0x2000, named)], None);

    assert!(eds.contains("\nParameterName=<a & \"b\">  [FileInfo] \n"), "{eds}");
    assert_eq!(eds.matches("\n[FileInfo]").count() + eds.matches("ParameterName").count(), 1);
    assert!(xdd.contains("<co:vendorName>B &amp; &lt;C&gt;</co:vendorName>"), "{xdd}");
    let name = "name=\"&lt;a &amp; &quot;b&quot;&gt;&#13;&#10;[FileInfo]\u{FFFD}\"";
    assert!(xdd.contains(&format!("index=\"2000\" {name} objectType=\"7\" dataType=\"0001\"")), "{xdd}");
    assert!(xdd.contains("PDOmapping=\"optional\"/>"), "{xdd}");
}

#[test]
fn a_default_that_no_line_can_hold_is_not_told() {
    let text = |index, value: &[u8]| {
        Object::var(index, entry(0, "text", DataType::VisibleString).with_value(Value::bytes(value)))
    };
    let live = Entry { is_live: true, ..entry(0, "state", DataType::Unsigned8) };
    let objects = vec![
        text(0x2000, b"as it is"),
        text(0x2001, b"two\nlines"),
        text(0x2002, b" blank "),
        text(0x2003, &[0xFF]),
        Object::var(0x2004, entry(0, "domain", DataType::Domain).with_value(Value::bytes([1, 2]))),
        Object::var(0x2005, entry(0, "octets", DataType::OctetString).with_value(Value::bytes([1, 0xAB]))),
        Object::var(0x2006, live),
    ];

    let [eds, xdd] = written(objects, None);

    let defaults: Vec<&str> = eds.lines().filter(|line| line.starts_with("DefaultValue")).collect();
    assert_eq!(defaults, ["DefaultValue=as it is", "DefaultValue=01AB"]);
    assert_eq!(xdd.matches("defaultValue").count(), 2);
}

#[test]
fn a_serial_number_is_of_one_device() {
    let member = |sub, name| entry(sub, name, DataType::Unsigned32).with_value(Value::Fixed(7));
    let identity =
        Object::record(0x1018, "Identity", vec![member(1, "Vendor-ID"), member(4, "Serial number")]);

    let [eds, _] = written(vec![identity], None);

    assert!(eds.contains("[1018sub1]\nParameterName=Vendor-ID\nObjectType=0x7\nDataType=0x0007\nAccessType=rw\nDefaultValue=0x7\n"));
    assert!(eds.contains("[1018sub4]\nParameterName=Serial number\nObjectType=0x7\nDataType=0x0007\nAccessType=rw\nPDOMapping=0\n"));
}

#[test]
fn ranges_are_limits_and_process_data_say_their_direction() {
    let bounded = Entry {
        range: Some(Range::Integer { min: -5, max: 5 }),
        mappable: Mappable::Receive,
        ..entry(0, "bounded", DataType::Integer16)
    };

    let [eds, xdd] = written(vec![Object::var(0x6000, bounded)], None);

    assert!(
        eds.contains("AccessType=rww\nDefaultValue=0\nLowLimit=-5\nHighLimit=5\nPDOMapping=1\n"),
        "{eds}"
    );
    let markup = "lowLimit=\"-5\" highLimit=\"5\" accessType=\"rw\" defaultValue=\"0\" PDOmapping=\"RPDO\"/>";
    assert!(xdd.contains(markup), "{xdd}");
}
