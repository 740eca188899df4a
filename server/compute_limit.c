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
  if (body->inner.destroy) body->inner.destroy(body->inner.context);
  free(body);
}

bool srv_compute_limit(api_body *body, uint64_t left_ns) {
  limited_body *limited = malloc(sizeof *limited);
  if (!limited) return false;
  *limited = (limited_body){*body, left_ns};
  *body = (api_body){body->size, limited, read_limited, destroy_limited, body->is_slow};
  return true;
}

/* What this thread computes at present. asked_ns: when the client was last looked for. */
static _Thread_local struct {
  uint64_t end_ns, asked_ns;
  bool (*is_wanted)(void *context);
  void *context;
} present;

void srv_compute_begin(uint64_t end_ns, bool (*is_wanted)(void *context), void *context) {
  present.end_ns = end_ns;
  present.asked_ns = is_wanted ? srv_now_ns() : 0;
  present.is_wanted = is_wanted;
  present.context = context;
}

void srv_compute_end(void) {
  srv_compute_begin(0, NULL, NULL);
}

bool srv_compute_is_over(void *owner) {
  static const uint64_t BETWEEN_NS = 200000000;
  (void)owner;
  if (present.end_ns == 0 && !present.is_wanted) return false;
  uint64_t now_ns = srv_now_ns();
  if (present.end_ns != 0 && now_ns >= present.end_ns) return true;
  if (!present.is_wanted || now_ns - present.asked_ns < BETWEEN_NS) return false;
  present.asked_ns = now_ns;
  return !present.is_wanted(present.context);
}
