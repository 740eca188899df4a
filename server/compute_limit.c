#include "compute_limit.h"

#include "log.h"
#include "machine.h"

#include <stdlib.h>

typedef struct limited_body {
  api_body inner;
  uint64_t left_ns;
} limited_body;

static int64_t read_limited(void *context, uint8_t *out, size_t capacity) {
  limited_body *body = context;
  if (body->left_ns == 0) {
    srv_log(SRV_LOG_WARN, "an answer is cut off: computing it takes longer than --compute-timeout");
    return -1;
  }
  uint64_t began_ns = srv_now_ns();
  int64_t size = body->inner.read(body->inner.context, out, capacity);
  uint64_t took_ns = srv_now_ns() - began_ns;
  body->left_ns -= took_ns < body->left_ns ? took_ns : body->left_ns;
  return size;
}

static void destroy_limited(void *context) {
  limited_body *body = context;
  if (body->inner.destroy != NULL) body->inner.destroy(body->inner.context);
  free(body);
}

bool srv_compute_limit(api_body *body, uint64_t left_ns) {
  limited_body *limited = malloc(sizeof *limited);
  if (limited == NULL) return false;
  *limited = (limited_body){*body, left_ns};
  *body = (api_body){body->size, limited, read_limited, destroy_limited};
  return true;
}

static _Thread_local uint64_t end_of_computing_ns;

void srv_compute_until(uint64_t end_ns) {
  end_of_computing_ns = end_ns;
}

bool srv_compute_is_over(void *owner) {
  (void)owner;
  return end_of_computing_ns != 0 && srv_now_ns() >= end_of_computing_ns;
}
