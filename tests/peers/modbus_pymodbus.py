"""A CiA 402 drive by Modbus TCP, as pymodbus sees it: identification, registers, coils, inputs, and a move.

Arguments: the port, then `NAME=ADDRESS` of the registers it uses.
"""

import sys
import time

from pymodbus.client import ModbusTcpClient
from pymodbus.constants import DeviceInformation
from pymodbus.pdu import ExceptionResponse

UNIT = 1
TARGET = 20000
TOLERANCE = 50
PATIENCE = 30.0
NEW_SET_POINT, TARGET_REACHED = 1 << 4, 1 << 10

at = dict(argument.split("=") for argument in sys.argv[2:])
at = {name: int(address) for name, address in at.items()}
client = ModbusTcpClient("127.0.0.1", port=int(sys.argv[1]), timeout=10)
assert client.connect()


def check(answer):
    assert not answer.isError(), answer
    return answer


def read(name, count=1):
    return check(client.read_holding_registers(at[name], count=count, device_id=UNIT)).registers


def read32(name):
    return client.convert_from_registers(read(name, 2), client.DATATYPE.INT32, word_order="little")


def write32(name, value):
    registers = client.convert_to_registers(value, client.DATATYPE.INT32, word_order="little")
    check(client.write_registers(at[name], registers, device_id=UNIT))


def wait_until(what, condition):
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, f"no {what}"
        time.sleep(0.01)


for level in (DeviceInformation.BASIC, DeviceInformation.REGULAR, DeviceInformation.EXTENDED):
    answer = check(client.read_device_information(read_code=level, device_id=UNIT))
    print(f"identification {level}: {len(answer.information)} objects")
print("name:", check(client.read_device_information(read_code=4, object_id=6, device_id=UNIT)).information[6].decode())
# Unit, and that it runs.
print("server:", check(client.report_device_id(device_id=UNIT)).identifier[:2].hex(" "))
print("echo:", check(client.diag_query_data(b"\xA5\x37", device_id=UNIT)).message)

check(client.write_coil(16, True, device_id=UNIT))
check(client.write_coils(17, [True, False, True], device_id=UNIT))
print("coils:", check(client.read_coils(16, count=5, device_id=UNIT)).bits[:5])
check(client.write_coils(16, [False] * 4, device_id=UNIT))
print("inputs:", len(check(client.read_discrete_inputs(0, count=32, device_id=UNIT)).bits))

write32("velocity", 20000)
write32("acceleration", 200000)
check(client.write_register(at["mode"], 1, device_id=UNIT))
for controlword, state in ((0x06, 0x21), (0x07, 0x23), (0x0F, 0x27)):
    check(client.write_register(at["controlword"], controlword, device_id=UNIT))
    wait_until(f"state {state:02X}", lambda: read("statusword")[0] & 0x6F == state)
print("enabled")
write32("target", TARGET)
mask = client.mask_write_register(address=at["controlword"], and_mask=0xFFFF & ~NEW_SET_POINT, or_mask=NEW_SET_POINT, device_id=UNIT)
check(mask)
wait_until("motion", lambda: read32("position") > 0)
wait_until("arrival", lambda: read("statusword")[0] & TARGET_REACHED and abs(read32("position") - TARGET) < TOLERANCE)
print("moved to the target")
both = client.readwrite_registers(
    read_address=at["position"], read_count=2, write_address=at["controlword"], values=[0x06], device_id=UNIT
)
assert len(check(both).registers) == 2
wait_until("shutdown", lambda: read("statusword")[0] & 0x6F == 0x21)
print("switched off")

for what, answer in (
    ("missing", client.read_holding_registers(0x0FFF, count=1, device_id=UNIT)),
    ("read only", client.write_register(at["statusword"], 0, device_id=UNIT)),
    ("half a value", client.write_register(at["target"], 0, device_id=UNIT)),
    ("nobody", client.read_holding_registers(0, count=1, device_id=99)),
):
    assert isinstance(answer, ExceptionResponse), answer
    print(f"{what}: exception {answer.exception_code}")
client.close()
