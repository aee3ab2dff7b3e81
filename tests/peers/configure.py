"""Lets python-canopen configure a node by a DCF and reads what the node then has."""

import canopen
from canopen.objectdictionary import ODVariable

from common import arguments, connected, add_node, say


def main():
    args = arguments(__doc__)
    # Without a Node-ID of ours it is the one of the file.
    dictionary = canopen.import_od(args.eds)
    with connected(args) as network:
        node = add_node(network, canopen.RemoteNode(dictionary.node_id, dictionary))
        node.load_configuration()
        values = 0
        for entry in dictionary.values():
            for variable in [entry] if isinstance(entry, ODVariable) else entry.values():
                if variable.value is not None:
                    value = variable.decode_raw(node.sdo.upload(variable.index, variable.subindex))
                    assert value == variable.value, f"0x{variable.index:04X}:{variable.subindex:02X} is {value}"
                    values += 1
    assert values > 100, values
    say(f"node {dictionary.node_id} has all values of the file")


main()
