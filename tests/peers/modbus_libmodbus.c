/* A CiA 402 drive by Modbus TCP, as libmodbus sees it: registers, coils, inputs, and a move.
 *
 * Arguments: the port, then the addresses of controlword, statusword, mode, position, target, velocity, acceleration. */

#include <errno.h>
#include <modbus.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { UNIT = 1, TARGET = -15000, TOLERANCE = 50, POLLS = 3000, POLL_US = 10000 };
enum { NEW_SET_POINT = 1 << 4, TARGET_REACHED = 1 << 10 };

static modbus_t *bus;

static void need(int done, const char *what)
{
	if (done < 0) {
		fprintf(stderr, "%s: %s\n", what, modbus_strerror(errno));
		exit(1);
	}
}

static uint16_t read16(int address)
{
	uint16_t word;
	need(modbus_read_registers(bus, address, 1, &word), "read");
	return word;
}

/* The low word comes first. */
static int32_t read32(int address)
{
	uint16_t words[2];
	need(modbus_read_input_registers(bus, address, 2, words), "read input registers");
	return (int32_t)((uint32_t)words[1] << 16 | words[0]);
}

static void write16(int address, uint16_t value)
{
	need(modbus_write_register(bus, address, value), "write");
}

static void write32(int address, int32_t value)
{
	uint16_t words[2] = {(uint16_t)value, (uint16_t)((uint32_t)value >> 16)};
	need(modbus_write_registers(bus, address, 2, words), "write registers");
}

static void wait_for(int address, uint16_t mask, uint16_t state)
{
	for (int poll = 0; poll < POLLS; poll++) {
		if ((read16(address) & mask) == state)
			return;
		usleep(POLL_US);
	}
	fprintf(stderr, "no state %04X\n", state);
	exit(1);
}

static void refused(int done, const char *what)
{
	if (done >= 0) {
		fprintf(stderr, "%s is not refused\n", what);
		exit(1);
	}
	printf("%s: %s\n", what, modbus_strerror(errno));
}

int main(int argc, char **argv)
{
	int at[7];
	uint16_t words[2] = {0x06}, seen[2];
	uint8_t bits[32], states[3] = {1, 0, 1};
	if (argc != 9)
		return 2;
	for (int i = 0; i < 7; i++)
		at[i] = atoi(argv[i + 2]);
	int controlword = at[0], statusword = at[1], mode = at[2], position = at[3], target = at[4];
	bus = modbus_new_tcp("127.0.0.1", atoi(argv[1]));
	modbus_set_slave(bus, UNIT);
	modbus_set_response_timeout(bus, 10, 0);
	need(modbus_connect(bus), "connect");

	need(modbus_write_bit(bus, 16, 1), "write bit");
	need(modbus_write_bits(bus, 17, 3, states), "write bits");
	need(modbus_read_bits(bus, 16, 4, bits), "read bits");
	printf("coils: %d%d%d%d\n", bits[0], bits[1], bits[2], bits[3]);
	printf("inputs: %d\n", modbus_read_input_bits(bus, 0, 32, bits));

	write32(at[5], 20000);
	write32(at[6], 200000);
	write16(mode, 1);
	write16(controlword, 0x06);
	wait_for(statusword, 0x6F, 0x21);
	write16(controlword, 0x07);
	wait_for(statusword, 0x6F, 0x23);
	write16(controlword, 0x0F);
	wait_for(statusword, 0x6F, 0x27);
	printf("enabled\n");
	write32(target, TARGET);
	need(modbus_mask_write_register(bus, controlword, (uint16_t)~NEW_SET_POINT, NEW_SET_POINT), "mask write");
	for (int poll = 0; abs(read32(position) - TARGET) > TOLERANCE; poll++) {
		if (poll == POLLS) {
			fprintf(stderr, "stays at %d\n", read32(position));
			return 1;
		}
		usleep(POLL_US);
	}
	wait_for(statusword, TARGET_REACHED, TARGET_REACHED);
	printf("moved to the target\n");
	need(modbus_write_and_read_registers(bus, controlword, 1, words, position, 2, seen), "write and read");
	wait_for(statusword, 0x6F, 0x21);
	printf("switched off\n");

	refused(modbus_read_registers(bus, 0x0FFF, 1, words), "missing");
	refused(modbus_write_register(bus, statusword, 0), "read only");
	refused(modbus_write_register(bus, target, 0), "half a value");
	modbus_set_slave(bus, 99);
	refused(modbus_read_registers(bus, 0, 1, words), "nobody");
	modbus_close(bus);
	modbus_free(bus);
	return 0;
}
