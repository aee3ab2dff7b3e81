/* A server of libmodbus with 65536 registers, to compare axisd with: `modbus_libmodbus_server PORT`. */

#include <modbus.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

enum { REGISTERS = 65536, EVENTS = 64 };

int main(int argc, char **argv)
{
	if (argc != 2)
		return 2;
	modbus_t *bus = modbus_new_tcp("127.0.0.1", atoi(argv[1]));
	modbus_mapping_t *map = modbus_mapping_new(0, 0, REGISTERS, 0);
	int listener = modbus_tcp_listen(bus, 128), poll = epoll_create1(0), one = 1;
	struct epoll_event event = {.events = EPOLLIN, .data.fd = listener}, events[EVENTS];
	if (!map || listener < 0 || poll < 0) {
		perror("modbus_libmodbus_server");
		return 1;
	}
	epoll_ctl(poll, EPOLL_CTL_ADD, listener, &event);
	for (;;) {
		int count = epoll_wait(poll, events, EVENTS, -1);
		for (int i = 0; i < count; i++) {
			int fd = events[i].data.fd;
			if (fd == listener) {
				fd = accept(listener, NULL, NULL);
				setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
				event.data.fd = fd;
				epoll_ctl(poll, EPOLL_CTL_ADD, fd, &event);
				continue;
			}
			uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
			modbus_set_socket(bus, fd);
			int length = modbus_receive(bus, query);
			if (length > 0)
				modbus_reply(bus, query, length, map);
			else if (length < 0)
				close(fd);
		}
	}
}
