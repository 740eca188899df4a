/* The rings of a level: measured, the farthest looked at closely, and settled. */
#include <string.h>

#include "surface_error.h"

enum { RINGS_AT_ONCE = 64, RING_WORK = 16384, LOOK_WORK = 65536, SETTLED = TW_ERROR_RING_LEVELS };

/* The open faces around a vertex: how far they are from the limit, on their level and on deeper ones. */
typedef struct ring {
  uint32_t vertex, count; /* of errors, of which the last one holds on; 0: it is no ring */
  bool is_close;          /* looked at closely */
  double errors[TW_ERROR_RING_LEVELS];
} ring;

typedef struct rings_pass {
  const tw_measuring *m;
  const tw_error_part *p;
  double small;
  const double *known; /* NULL: no closer look */
  double least;        /* with a closer look: rings of at most this distance are left as they are */
  ring *rings;
  uint32_t count;
} rings_pass;

static double error_at(const ring *r, uint32_t level) {
  return r->errors[level < r->count ? level : r->count - 1];
}

/* Whether a ring is farther than what is known, on some level that is told of. */
static bool is_farther(const rings_pass *s, const ring *r) {
  bool is = false;
  for (uint32_t i = 0; i < r->count && s->p->level + i <= s->m->level_max; i++)
    is |= r->errors[i] > s->known[i];
  return is;
}

static void measure_rings(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  rings_pass *s = context;
  (void)part;
  for (uint32_t i = begin; i < end; i++) {
    ring *r = &s->rings[i];
    if ((i - begin) % RINGS_AT_ONCE == 0 && !tw_work(RINGS_AT_ONCE * RING_WORK)) return;
    if (s->known) {
      if (r->count == 0 || r->is_close || r->errors[0] <= s->least || !is_farther(s, r)) continue;
      if (!tw_work(LOOK_WORK)) return;
      r->is_close = true;
    }
    r->count = tw_error_of_ring(s->m, s->p, r->vertex, s->small, s->known, r->errors);
  }
}

static tw_status run(rings_pass *s) {
  tw_parallel_for_run(s->m->parallel, s->count, RINGS_AT_ONCE, measure_rings, s);
  tw_status status = tw_parallel_for_status(s->m->parallel);
  return status == TW_OK ? tw_work_status(NULL) : status;
}

/* Whether some of a vertex's faces are open, and the points of two rows around it are right: where a part was
 * cut out, those around open faces alone are after a step; a batch has another row. */
static bool may_be_ring(const tw_error_part *p, uint32_t vertex) {
  const tw_topology *t = &p->topology;
  uint32_t open = 0, valence = tw_error_wheel_valence(t, vertex);
  for (uint32_t i = 0; i < valence; i++)
    open += p->states[tw_corner_face(t, t->fan_corners[t->fan_offsets[vertex] + i])] >= TW_FACE_OPEN;
  return open > 0 && (open == valence || (p->batch_level == 1 && p->level <= 2));
}

/* Lists the vertices that may have rings, and measures these. */
static tw_status find_rings(rings_pass *s) {
  const tw_topology *t = &s->p->topology;
  tw_status status = tw_error_find_wheels(s->m, t);
  for (uint32_t v = 0; v < t->vertex_count; v++) s->count += may_be_ring(s->p, v);
  s->rings = tw_arena_alloc(s->p->arena, s->count, sizeof *s->rings);
  if (status != TW_OK || !s->rings) return status == TW_OK ? TW_NO_MEMORY : status;
  for (uint32_t v = 0, i = 0; v < t->vertex_count; v++)
    if (may_be_ring(s->p, v)) s->rings[i++].vertex = v;
  return run(s);
}

/* Looks closely at rings that are farther than what is known, the farthest first: they tell what of others
 * does not matter. */
static tw_status look_closely(rings_pass *s, const double *settled) {
  enum { ROUNDS = 12, SMALL_ONES = 4 }; /* distances of less than this many small ones are not looked at */
  const double step = 0.8;
  double known[SETTLED] = {0};
  tw_status status = TW_OK;
  for (uint32_t i = 0; s->p->level + i < SETTLED; i++)
    known[i] = tw_greater(settled[s->p->level + i], SMALL_ONES * s->small);
  s->known = known;
  for (uint32_t i = 0; i < s->count; i++)
    if (s->rings[i].count > 0) s->least = tw_greater(s->least, s->rings[i].errors[0]);
  for (int round = 1; round <= ROUNDS && status == TW_OK; round++) {
    s->least = round < ROUNDS ? step * s->least : 0;
    status = run(s);
    for (uint32_t i = 0; i < s->count; i++)
      for (uint32_t k = 0; s->rings[i].is_close && k < SETTLED; k++)
        known[k] = tw_greater(known[k], error_at(&s->rings[i], k));
  }
  return status;
}

/* The distance up to which rings are settled: deeper levels, of which there is room for some, tell of the
 * others more closely. */
static double find_room(const rings_pass *s) {
  const uint32_t room = s->m->faces_max / 4 / 96; /* each step makes about 96 faces of a ring */
  const double step = 0.9, loose = 4;             /* how much less the deeper levels may tell */
  double limit = 0, least;
  for (uint32_t i = 0; i < s->count; i++)
    if (s->rings[i].count > 0) limit = tw_greater(limit, s->rings[i].errors[0]);
  for (least = limit / loose; limit > least; limit *= step) {
    uint32_t more = 0;
    for (uint32_t i = 0; i < s->count; i++)
      more += s->rings[i].count > 0 && s->rings[i].errors[0] > limit * step;
    if (more > room) break;
  }
  return limit;
}

static void settle_ring(tw_error_part *p, const ring *r, double *settled) {
  const tw_topology *t = &p->topology;
  double fall = r->count > 1 ? 0 : 1;
  for (uint32_t i = 1; i < r->count; i++) fall = tw_greater(fall, r->errors[i] / r->errors[i - 1]);
  for (uint32_t i = 0; p->level + i < SETTLED; i++)
    settled[p->level + i] = tw_greater(settled[p->level + i], error_at(r, i));
  for (uint32_t i = t->fan_offsets[r->vertex]; i < t->fan_offsets[r->vertex + 1]; i++) {
    uint32_t face = tw_corner_face(t, t->fan_corners[i]), made = tw_error_as_made(p, face);
    if (p->states[face] < TW_FACE_OPEN) continue;
    p->errors[made] = r->errors[0];
    p->falls[made] = (float)fall + 1e-6F;
    p->states[face] = TW_FACE_AROUND;
    p->open_count--;
  }
}

/* Whether a ring is on no level farther than what is settled already. */
static bool is_known(const ring *r, const double *settled, uint32_t level) {
  bool is = r->count > 0;
  for (uint32_t i = 0; i < r->count && level + i < SETTLED; i++)
    is = is && r->errors[i] <= settled[level + i];
  return is;
}

tw_status tw_error_settle_rings(const tw_measuring *m, tw_error_part *p, bool all, double small,
                                double *settled) {
  rings_pass s = {.m = m, .p = p, .small = small};
  bool looks = !m->options->limit && p->level <= m->level_max;
  tw_status status = find_rings(&s);
  if (status == TW_OK && looks) status = look_closely(&s, settled);
  if (status != TW_OK) return status;
  double limit = all || looks ? INFINITY : find_room(&s);
  for (uint32_t i = 0; i < s.count; i++) {
    bool settles = s.rings[i].count > 0 && s.rings[i].errors[0] <= limit;
    if (settles || is_known(&s.rings[i], settled, p->level)) settle_ring(p, &s.rings[i], settled);
  }
  return TW_OK;
}
