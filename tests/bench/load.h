/* A load generator: keep-alive connections to 127.0.0.1 from one thread, one request at a time on each. */
#ifndef BENCH_LOAD_H
#define BENCH_LOAD_H

#include <stddef.h>
#include <stdint.h>

enum { LOAD_REQUEST_SIZE = 1024, LOAD_HEAD_MAX = 4096 };

/* Writes the n-th request, complete, and returns its length. */
typedef size_t (*load_request)(const void *context, uint64_t n, char out[LOAD_REQUEST_SIZE]);

typedef struct load {
  uint16_t port;
  load_request request;
  const void *context;
  uint64_t sent; /* goes on from call to call */
  /* Of the last answer: bytes of head and body, and its head, terminated. */
  uint64_t answer_size;
  char head[LOAD_HEAD_MAX + 1];
} load;

/* Requests a second over about `seconds`; ends the program on an answer other than 200 with a length. */
double load_run(load *l, int connections, double seconds);

#endif
