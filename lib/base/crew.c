/* Loops in parts, as even as can be. */
#include "crew.h"

uint32_t tw_crew_parts(const tw_crew *crew, uint32_t count, uint32_t least) {
  uint32_t parts = count / least;
  if (!crew || parts < 2) return 1;
  return parts < TW_CREW_PARTS_MAX ? parts : TW_CREW_PARTS_MAX;
}

typedef struct loop {
  uint32_t count, parts;
  tw_crew_body *body;
  void *context;
} loop;

static void run_part(void *context, uint32_t part) {
  const loop *l = context;
  uint64_t begin = (uint64_t)l->count * part / l->parts, end = (uint64_t)l->count * (part + 1) / l->parts;
  l->body(l->context, part, (uint32_t)begin, (uint32_t)end);
}

void tw_crew_loop(const tw_crew *crew, uint32_t count, uint32_t least, tw_crew_body *body, void *context) {
  loop l = {count, tw_crew_parts(crew, count, least), body, context};
  if (l.parts > 1)
    crew->run(crew->owner, l.parts, run_part, &l);
  else
    body(context, 0, 0, count);
}
