/* The smallest libmicrohttpd server, as a peer for benchmarks of requests. */
#ifndef BENCH_BARE_H
#define BENCH_BARE_H

#include <stdint.h>
#include <sys/types.h>

/* Starts a process that answers every request with `size` bytes, on one thread over epoll. head: an answer's
 * head, whose fields it repeats except those that the library writes itself; "" for none. port: receives the
 * port on 127.0.0.1. Returns the process id; exits on failure. */
pid_t bare_start(uint64_t size, const char *head, uint16_t *port);
void bare_stop(pid_t process);

#endif
