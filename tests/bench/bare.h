/* The least that a libmicrohttpd server can do: the peer of requests. */
#ifndef BENCH_BARE_H
#define BENCH_BARE_H

#include <stdint.h>
#include <sys/types.h>

/* Starts a process that answers every request with `size` bytes, on one thread over epoll. head: the lines of
 * an answer whose fields it repeats but for those that the library writes itself; "" for none. Returns its id
 * and *port of 127.0.0.1; ends the program on failure. */
pid_t bare_start(uint64_t size, const char *head, uint16_t *port);
void bare_stop(pid_t process);

#endif
