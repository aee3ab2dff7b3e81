"""Compares two EDS files as python-canopen reads them, entry by entry, and prints what differs.

A default that the first does not have may be anything in the second.
"""

import logging
import sys

import canopen
from canopen.objectdictionary import ODVariable

NODE_ID = 5
FIRST = 0x1000
COMPARED = ["name", "data_type", "access_type", "pdo_mappable", "default", "min", "max"]


def entries(file):
    """The entries of a file by address."""
    found = {}
    dictionary = canopen.import_od(file, node_id=NODE_ID)
    for index in filter(lambda index: index >= FIRST, dictionary):
        entry = dictionary[index]
        for variable in [entry] if isinstance(entry, ODVariable) else entry.values():
            found[index, variable.subindex] = variable
    return found


def main():
    logging.disable(logging.CRITICAL)
    before, after = entries(sys.argv[1]), entries(sys.argv[2])
    for address in sorted(before.keys() | after.keys()):
        place = "0x{:04X}:{:02X}".format(*address)
        one, other = before.get(address), after.get(address)
        if one is None or other is None:
            print(place, "is in one file only")
            continue
        for key in COMPARED:
            values = getattr(one, key), getattr(other, key)
            if values[0] != values[1] and not (key == "default" and values[0] is None):
                print(place, f"{key}: {values[0]!r} becomes {values[1]!r}")
    print(len(before), "entries")


main()
