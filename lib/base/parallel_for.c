/* Splits loops into parts of equal length. */
#include "parallel_for.h"

uint32_t tw_parallel_for_parts(const tw_parallel_for *parallel, uint32_t count, uint32_t least) {
  uint32_t parts = count / least;
  if (!parallel || parts < 2) return 1;
  return parts < TW_PARALLEL_FOR_PARTS_MAX ? parts : TW_PARALLEL_FOR_PARTS_MAX;
}

typedef struct loop {
  uint32_t count, parts;
  tw_parallel_for_body *body;
  void *context;
  tw_meter *meter; /* of the caller */
} loop;

static void run_part(void *context, uint32_t part) {
  const loop *l = context;
  uint64_t begin = (uint64_t)l->count * part / l->parts, end = (uint64_t)l->count * (part + 1) / l->parts;
  tw_meter *before = tw_meter_use(l->meter);
  l->body(l->context, part, (uint32_t)begin, (uint32_t)end);
  tw_meter_use(before);
}

void tw_parallel_for_run(const tw_parallel_for *parallel, uint32_t count, uint32_t least,
                         tw_parallel_for_body *body, void *context) {
  loop l = {count, tw_parallel_for_parts(parallel, count, least), body, context, tw_meter_current()};
  if (l.parts > 1)
    parallel->run(parallel->owner, l.parts, run_part, &l);
  else
    body(context, 0, 0, count);
}

tw_status tw_parallel_for_status(const tw_parallel_for *parallel) {
  bool is_cancelled = parallel && parallel->is_cancelled && parallel->is_cancelled(parallel->owner);
  return is_cancelled ? TW_CANCELLED : tw_work_status(NULL);
}
