/* A load generator: one thread with keep-alive connections to 127.0.0.1, one request at a time on each. */
#ifndef BENCH_LOAD_H
#define BENCH_LOAD_H

#include <stddef.h>
#include <stdint.h>

enum { LOAD_REQUEST_SIZE = 1024, LOAD_HEAD_MAX = 4096 };

/* Writes the complete n-th request and returns its length. */
typedef size_t (*load_request)(const void *context, uint64_t n, char out[LOAD_REQUEST_SIZE]);

typedef struct load {
  uint16_t port;
  load_request request;
  const void *context;
  uint64_t sent; /* requests sent so far, over all calls */
  /* The last answer: size of head and body, and its head, terminated. */
  uint64_t answer_size;
  char head[LOAD_HEAD_MAX + 1];
} load;

/* A socket that is connected to 127.0.0.1. Exits when there is none. */
int load_connect(uint16_t port);

/* Returns requests a second, measured over about `seconds`. Exits on an answer that is not 200 or has no
 * length. */
double load_run(load *l, int connections, double seconds);

#endif
