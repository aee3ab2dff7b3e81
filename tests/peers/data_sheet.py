"""A device that is nothing but its EDS, seen by a master with that very file.

Uploads every entry that can be read and compares it with its default, maps and receives a TPDO, sends an RPDO.
"""

import canopen
from canopen.objectdictionary import ODVariable
from common import add_node, arguments, connected, reset, say, wait_until

NODE_ID = 5
# Below are the data types, which python-canopen has among the objects.
FIRST = 0x1000
# The serial number is that of the device, and the error history is empty.
OWN = {(0x1018, 4), (0x1003, 1), (0x1003, 2)}


def entries(dictionary):
    """Every entry, arrays that are described in one section included."""
    for index in filter(lambda index: index >= FIRST, dictionary):
        found = dictionary[index]
        if isinstance(found, ODVariable):
            yield found
        else:
            yield from found.values()


def read(node, entry):
    """What the device has at an entry, as Python sees it."""
    found = node.sdo[entry.index]
    value = found if isinstance(entry.parent, canopen.ObjectDictionary) else found[entry.subindex]
    return value.raw


def main():
    args = arguments(__doc__)
    with connected(args) as network:
        node = add_node(network, canopen.RemoteNode(NODE_ID, args.eds))
        reset(node)
        compared = 0
        for entry in entries(node.object_dictionary):
            if entry.access_type == "wo" or (entry.index, entry.subindex) in OWN:
                continue
            value = read(node, entry)
            if entry.default is not None:
                assert value == entry.default, f"0x{entry.index:04X}:{entry.subindex:02X}: {value}, not {entry.default}"
                compared += 1
        say(f"{compared} entries have their defaults")

        tpdo, rpdo = node.tpdo[2], node.rpdo[1]
        for pdo in (tpdo, rpdo):
            pdo.read()
        tpdo.clear()
        tpdo.add_variable(0x2003)
        tpdo.add_variable(0x6000, 1)
        tpdo.trans_type, tpdo.enabled = 255, True
        tpdo.save()
        received = []
        tpdo.add_callback(lambda pdo: received.append([variable.raw for variable in pdo]))
        node.nmt.state = "OPERATIONAL"
        wait_until("TPDO with the defaults", lambda: [-5, 0xA5] in received)
        node.sdo[0x2003].raw = 42
        wait_until("TPDO after a change", lambda: [42, 0xA5] in received)
        say("TPDO 2 carries what was mapped")

        rpdo[0].raw = 0x81
        rpdo.transmit()
        wait_until("effect of the RPDO", lambda: node.sdo[0x6200][1].raw == 0x81)
        say("RPDO 1 sets the outputs")


main()
