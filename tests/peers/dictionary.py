"""Compares what EDS files say of nodes with what the nodes say themselves by SDO, entry by entry.

Each device is given as NAME:NODE-ID:FILE. python-canopen reads the file. Then, for each entry of it,
* an upload gives a value of the size of the data type, and the default if the file has one; one that
  is write-only refuses that;
* a download of a wrong size is refused for its size, or by an entry that is read-only for that.
What the file does not have the node does not have either. The first differences end the script.
"""

import argparse
import socket
import struct

import canopen
from canopen.objectdictionary import ODVariable, datatypes
from canopen.sdo.exceptions import SdoAbortedError

from common import PATIENCE, connected, say

WRITE_ONLY, READ_ONLY = 0x06010001, 0x06010002
NO_OBJECT, NO_SUB_INDEX, NO_DATA = 0x06020000, 0x06090011, 0x08000024
WRONG_SIZES = {0x06070010, 0x06070012, 0x06070013}
STORE_EDS = 0x1021
# Requests that are sent ahead of their answers; each is answered by one message.
BATCH = 64
# Differences that are shown.
SHOWN = 20
# Bytes of a value of each data type that has a size.
SIZES = {number: form.size for number, form in ODVariable.STRUCT_TYPES.items()}
SIZES |= {datatypes.TIME_OF_DAY: 6, datatypes.TIME_DIFFERENCE: 6}
# Indices of which at least some are not in any file.
PROBED = [*range(0x1000, 0x1100), *range(0x1000, 0xA000, 0x155)]


class Bus:
    """A socketcand connection on which SDO requests are answered by one message each."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE)
        self.buffer = b""
        for message in ["", "< open can0 >", "< rawmode >"]:
            self.socket.sendall(message.encode())
            self.next()

    def next(self):
        """The words of the next message."""
        while b">" not in self.buffer:
            data = self.socket.recv(65536)
            assert data, "the daemon has closed the connection"
            self.buffer += data
        message, _, self.buffer = self.buffer.partition(b">")
        return message.decode().split()[1:]

    def ask(self, node_id, requests):
        """The answers of a node to requests of eight bytes, in their order."""
        answers = []
        for start in range(0, len(requests), BATCH):
            batch = requests[start:start + BATCH]
            lines = (f"< send {0x600 + node_id:X} 8 {request.hex(' ')} >" for request in batch)
            self.socket.sendall("".join(lines).encode())
            missing = len(batch)
            while missing:
                match self.next():
                    case ["frame", identifier, _, data] if int(identifier, 16) == 0x580 + node_id:
                        answers.append(bytes.fromhex(data))
                        missing -= 1
        return answers


def upload(index, sub):
    """Initiate an upload."""
    return struct.pack("<BHB4x", 0x40, index, sub)


def download(index, sub, size):
    """Download so many zeros, expedited."""
    return struct.pack("<BHB4x", 0x23 | (4 - size) << 2, index, sub)


def abort_code(answer):
    """The abort code of an answer, if it is one."""
    return struct.unpack("<I", answer[4:])[0] if answer[0] == 0x80 else None


def expedited(answer):
    """The value in the answer to an upload; none if it has another form."""
    return answer[4:8 - (answer[0] >> 2 & 3)] if answer[0] & 0xF3 == 0x43 else None


def variables(dictionary):
    """Every entry of a file."""
    for entry in dictionary.values():
        # Below are the data types by which RPDOs skip bytes.
        if entry.index >= 0x1000:
            yield from [entry] if isinstance(entry, ODVariable) else entry.values()


class Device:
    """A node and its file."""

    def __init__(self, name, node_id, file):
        self.name, self.id, self.differences = name, int(node_id), []
        with open(file, "rb") as sheet:
            self.sheet = sheet.read()
        self.dictionary = canopen.import_od(file, node_id=self.id)
        self.entries = {(v.index, v.subindex): v for v in variables(self.dictionary)}
        self.values, self.reads_sheet = {}, False

    def differ(self, entry, what):
        """Note a difference."""
        self.differences.append(f"{self.name} 0x{entry[0]:04X}:{entry[1]:02X} {what}")

    def read_long(self, network):
        """Let python-canopen read what takes several messages."""
        node = network.add_node(self.id, self.dictionary)
        node.sdo.RESPONSE_TIMEOUT = PATIENCE
        for place, variable in self.entries.items():
            if SIZES.get(variable.data_type, 8) > 4:
                try:
                    self.values[place] = self.upload(node, place)
                except SdoAbortedError as abort:
                    self.values[place] = abort.code

    def upload(self, node, place):
        """Read one entry; the sheet in blocks."""
        if place[0] != STORE_EDS:
            return node.sdo.upload(*place)
        if not self.reads_sheet:
            return self.sheet
        with node.sdo.open(*place, "rb", block_transfer=True) as stream:
            return stream.read()

    def read_short(self, bus):
        """Read all else."""
        short = [place for place in self.entries if place not in self.values]
        answers = bus.ask(self.id, [upload(*place) for place in short])
        self.values |= {place: abort_code(a) or expedited(a) for place, a in zip(short, answers)}

    def compare_values(self):
        """Compare what was read. Returns how many values are the default."""
        places = self.entries.items()
        return sum(self.compare_value(place, variable, self.values[place]) for place, variable in places)

    def compare_value(self, place, variable, value):
        """Compare the bytes of a value, or an abort code, with the file."""
        if variable.access_type == "wo" or value == NO_DATA:
            is_right = value == (WRITE_ONLY if variable.access_type == "wo" else NO_DATA)
            if not is_right or variable.default is not None and value == NO_DATA:
                self.differ(place, f"{variable.name}: {value}")
            return False
        if not isinstance(value, bytes):
            self.differ(place, f"{variable.name}: {value}")
            return False
        if variable.data_type in SIZES and len(value) != SIZES[variable.data_type]:
            self.differ(place, f"{variable.name} has {len(value)} bytes, in the file {variable.data_type}")
        if place[0] == STORE_EDS and value != self.sheet:
            self.differ(place, "is another sheet")
        if variable.default is None:
            return False
        if self.decode(variable, value) != variable.default:
            self.differ(place, f"{variable.name} is {value.hex(' ')}, by default {variable.default}")
        return True

    @staticmethod
    def decode(variable, value):
        """What the bytes mean; python-canopen knows no times."""
        if variable.data_type in (datatypes.TIME_OF_DAY, datatypes.TIME_DIFFERENCE):
            return int.from_bytes(value, "little")
        return variable.decode_raw(value)

    def compare_access(self, bus):
        """Write a wrong size to every entry of a fixed one, and anything to those that are read-only."""
        tried = [v for v in self.entries.values() if v.data_type in SIZES or not v.writable]
        wrong = [3 if SIZES.get(v.data_type) == 4 else 4 for v in tried]
        requests = [download(v.index, v.subindex, size) for v, size in zip(tried, wrong)]
        for variable, answer in zip(tried, bus.ask(self.id, requests)):
            code = abort_code(answer)
            if code not in (WRONG_SIZES if variable.writable else {READ_ONLY}):
                self.differ((variable.index, variable.subindex), f"{variable.access_type}: {code or 0:08X}")

    def compare_gaps(self, bus):
        """Read beside what is in the file. Returns how much that was."""
        indices = {index for index, _ in self.entries}
        near = {index + step for index in indices for step in (-1, 1)}
        gaps = {(index, 0): NO_OBJECT for index in near.union(PROBED) - indices if index >= 0x1000}
        beside = {(index, sub + 1) for index, sub in self.entries} | {(index, 0xFE) for index in indices}
        gaps |= {place: NO_SUB_INDEX for place in beside - set(self.entries)}
        answers = bus.ask(self.id, [upload(*place) for place in gaps])
        for (place, expected), answer in zip(gaps.items(), answers):
            if abort_code(answer) != expected:
                self.differ(place, f"is not in the file: {answer.hex(' ')}")
        return len(gaps)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--port", type=int, required=True)
    parser.add_argument("devices", nargs="+", metavar="NAME:NODE-ID:FILE")
    args = parser.parse_args()
    devices = [Device(*device.split(":", 2)) for device in args.devices]
    # A sheet takes thousands of frames: one is enough.
    min(devices, key=lambda device: len(device.sheet)).reads_sheet = True
    with connected(argparse.Namespace(interface="socketcand", channel="can0", host="127.0.0.1", port=args.port)) as network:
        for device in devices:
            device.read_long(network)
    bus, differences = Bus(args.port), []
    for device in devices:
        device.read_short(bus)
        defaults, gaps = device.compare_values(), device.compare_gaps(bus)
        assert gaps > 100, gaps
        device.compare_access(bus)
        differences += device.differences
        say(f"{device.name}: {len(device.entries)} entries, {defaults} of them with a default, as in the file")
    assert not differences, "\n" + "\n".join(differences[:SHOWN])


main()
