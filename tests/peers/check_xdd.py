"""Compares XDD files with EDS files, entry by entry.

Arguments are EDS and XDD files in pairs. python-canopen reads the EDS. The XDD is read as the schema of
CiA 311 v1.1 has it: which elements are in its namespace, their order, and the values of attributes.
"""

import re
import sys
import xml.etree.ElementTree as ET

import canopen
from canopen.objectdictionary import ODArray, ODVariable, datatypes

CO = "{http://www.canopen.org/xml/1.1}"
XSI_TYPE = "{http://www.w3.org/2001/XMLSchema-instance}type"
ATTRIBUTES = {"name", "objectType", "dataType", "lowLimit", "highLimit", "accessType", "defaultValue", "PDOmapping"}
FILE = {XSI_TYPE, "formatName", "formatVersion", "fileName", "fileCreator", "fileCreationDate", "fileVersion",
        "supportedLanguages"}
ACCESS = {"const": "const", "ro": "ro", "wo": "wo", "rw": "rw", "rwr": "rw", "rww": "rw"}
RATES = {f"{rate} Kbps" for rate in (10, 20, 50, 125, 250, 500, 800, 1000)}


def tags(element):
    """The names of the children."""
    return [child.tag for child in element]


def check_profiles(root):
    """The two profiles of a container; their bodies are returned."""
    assert root.tag == CO + "ISO15745ProfileContainer" and tags(root) == [CO + "ISO15745Profile"] * 2
    for profile, kind in zip(root, ["Device", "CommunicationNetwork"]):
        assert tags(profile) == ["ProfileHeader", "ProfileBody"], tags(profile)
        header, body = profile
        assert tags(header) == ["ProfileIdentification", "ProfileRevision", "ProfileName", "ProfileSource",
                                "ProfileClassID", "ISO15745Reference"]
        assert header.find("ProfileClassID").text == kind
        assert tags(header[5]) == ["ISO15745Part", "ISO15745Edition", "ProfileTechnology"]
        assert set(body.attrib) == FILE and body.get(XSI_TYPE) == f"co:ProfileBody_{kind}_CANopen"
        assert re.fullmatch(r"\d{4}-\d\d-\d\d", body.get("fileCreationDate"))
        yield body


def check_device(body, information):
    """What the device is."""
    assert tags(body) == [CO + "DeviceIdentity", CO + "DeviceFunction"]
    texts = [(child.tag.removeprefix(CO), child.text) for child in body[0]]
    version = f"{information.revision_number >> 16}.{information.revision_number & 0xFFFF}"
    assert texts == [
        ("vendorName", information.vendor_name), ("vendorID", f"0x{information.vendor_number:08X}"),
        ("productName", information.product_name), ("productID", f"0x{information.product_number:08X}"),
        ("version", version)], texts


def check_network(body, information):
    """What the device does on the network; its objects are returned."""
    assert tags(body) == ["ApplicationLayers", "TransportLayers", "NetworkManagement"]
    objects, dummies = body[0]
    assert (objects.tag, dummies.tag) == (CO + "CANopenObjectList", "dummyUsage")
    assert [dummy.get("entry") for dummy in dummies] == [f"Dummy{index:04d}=1" for index in range(1, 8)]
    rates = body.findall("TransportLayers/PhysicalLayer/baudRate/supportedBaudRate")
    assert {rate.get("value") for rate in rates} == RATES
    features, master = body[2]
    assert (features.tag, master.tag) == ("CANopenGeneralFeatures", "CANopenMasterFeatures")
    assert features.get("nrOfRxPDO") == str(information.nr_of_RXPDO)
    assert features.get("nrOfTxPDO") == str(information.nr_of_TXPDO)
    assert features.get("groupMessaging") == str(information.group_messaging).lower()
    assert features.get("layerSettingServiceSlave") == "true"
    return objects


def check_objects(objects, dictionary):
    """Every object of one file is in the other, in the same order."""
    known = [entry for entry in dictionary.values() if entry.index >= 0x1000]
    known.sort(key=lambda entry: entry.index)
    assert [int(element.get("index"), 16) for element in objects] == [entry.index for entry in known]
    areas = {"mandatoryObjects": 0, "optionalObjects": 0, "manufacturerObjects": 0}
    entries = 0
    for element, entry in zip(objects, known):
        assert element.tag == "CANopenObject"
        assert re.fullmatch("[0-9A-F]{4}", element.get("index"))
        area = "manufacturer" if 0x2000 <= entry.index < 0x6000 else "optional"
        areas["mandatoryObjects" if entry.index in (0x1000, 0x1001, 0x1018) else area + "Objects"] += 1
        if isinstance(entry, ODVariable):
            assert len(element) == 0
            check_variable(element, entry, {"index"})
            entries += 1
            continue
        assert element.get("name") == entry.name
        assert element.get("objectType") == ("8" if isinstance(entry, ODArray) else "9")
        assert int(element.get("subNumber")) == len(element) == len(entry.subindices)
        for sub, variable in zip(element, entry.values()):
            assert sub.tag == "CANopenSubObject" and int(sub.get("subIndex"), 16) == variable.subindex
            assert re.fullmatch("[0-9A-F]{2}", sub.get("subIndex"))
            check_variable(sub, variable, {"subIndex"})
        entries += len(element)
    assert {area: int(objects.get(area)) for area in areas} == areas
    return entries


def check_variable(element, variable, place):
    """An entry has all that the EDS says of it."""
    where = f"0x{variable.index:04X}:{variable.subindex:02X}"
    assert set(element.attrib) <= ATTRIBUTES | place, (where, element.attrib)
    assert element.get("name") == variable.name and element.get("objectType") == "7", where
    assert int(element.get("dataType"), 16) == variable.data_type, where
    assert element.get("accessType") == ACCESS[variable.access_type], where
    default = getattr(variable, "default_raw", None)
    assert element.get("defaultValue") == default, (where, default)
    limits = [None if text is None else int(text) for text in map(element.get, ("lowLimit", "highLimit"))]
    if variable.data_type in (*datatypes.INTEGER_TYPES,) and variable.min is not None:
        assert limits == [variable.min, variable.max], where
    mapping = element.get("PDOmapping")
    assert mapping in ("no", "optional", "TPDO", "RPDO") and (mapping != "no") == variable.pdo_mappable, where
    expected = {"rwr": "TPDO", "rww": "RPDO"}.get(variable.access_type, mapping)
    assert mapping == expected, (where, mapping)


def main():
    for eds, xdd in zip(sys.argv[1::2], sys.argv[2::2]):
        dictionary = canopen.import_od(eds, node_id=None)
        device, network = check_profiles(ET.parse(xdd).getroot())
        check_device(device, dictionary.device_information)
        objects = check_network(network, dictionary.device_information)
        print(f"{device.get('fileName')}: {check_objects(objects, dictionary)} entries as in the EDS")


main()
