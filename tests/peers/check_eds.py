"""Loads an EDS file with python-canopen and prints those of a choice of objects that it describes."""

import sys

import canopen
from canopen.objectdictionary import ODVariable, datatypes

TYPES = {number: name for name, number in vars(datatypes).items() if name.isupper() and isinstance(number, int)}
SHOWN = [0x1000, 0x1001, 0x1017, 0x1018, 0x1400, 0x1600, 0x1800, 0x1A00, *range(0x2001, 0x2010), 0x2100, 0x2101, 0x6040, 0x6041, 0x6060, 0x6061,
         0x6064, 0x606C, 0x607A, 0x6081, 0x6083, 0x6085, 0x60FF, 0x6502]


def show(variable):
    """One line: address, name, type, access, mappable or not."""
    mappable = "pdo" if variable.pdo_mappable else "-"
    print(f"0x{variable.index:04X}:{variable.subindex:02X} {variable.name}",
          TYPES[variable.data_type], variable.access_type, mappable)


def main():
    dictionary = canopen.import_od(sys.argv[1], node_id=1)
    print("product:", dictionary.device_information.product_name)
    for index in filter(dictionary.__contains__, SHOWN):
        entry = dictionary[index]
        for variable in [entry] if isinstance(entry, ODVariable) else entry.values():
            show(variable)


main()
