/* How far the triangles of each level are from the limit surface: bounds, proved from the cage and a few
 * levels.
 *
 * Two steps lead there. Both compare surfaces over one set of faces, so that a point of the one has a partner
 * on the other, and both directions of the Hausdorff distance are bounded at once.
 *
 * 1. Faces around which nothing is irregular, at sharp creases and borders too, are patches of 16 control
 * points. There second differences shrink by four with each step, and the surface differs from the bilinear
 * quads of control points by ((1 - u)^3 + u^3) / 6 of those along u, and as much of those along v; from quads
 * of limit points by at most u (1 - u) / 2 of them (Filip, Magedson and Markot 1986, "Surface algorithms
 * using bounds on derivatives"; Lutterkort and Peters 2001, "Optimized refinable enclosures"). Triangles
 * differ from the bilinear quad by the mixed difference times at most min(u (1 - v), v (1 - u)). So such a
 * face is measured once, for its own level and all deeper ones.
 * 2. Other faces are compared with their children, level by level. Both are triangles, and where the
 * children's diagonals meet in the face point, each of them lies over one triangle of the parent, whichever
 * way that is cut. The difference is then greatest at vertices. Around irregular points, where distances
 * shrink more slowly and no second difference tells how, the levels themselves are made, on the few faces
 * around them, and a face is compared with what comes of it up to three levels deeper (error_sums.c).
 * 3. Where these are too many, faces whose only irregular point is smooth are measured once too, by the
 * points of two rows around it (error_rings.c). After two steps no face has a second such point, so those
 * steps are made for a batch of faces at a time, and so are deeper ones that have no room at once.
 * 4. Where measured faces are far and their children have no room, limit points all over them are compared
 * with the triangle that each comes from (error_patch.c); likewise regular faces around an irregular point,
 * where they make a ring farther than what is known, and regular descendants of faces that are summed up.
 * Each of these is a bound by itself, so the lesser one holds. Each tells of one level: a deeper one may be
 * told farther than the one before, where less is known of it.
 *
 * After the last step, what is left follows from the convex hull of the control points around a face, in
 * which all deeper levels and the limit lie, as masks have no negative weights.
 *
 * A point's partner is the one with its parameters, or one that is nearer. Along an edge or a diagonal it is
 * the nearest of that edge. Elsewhere points slide along the surface more than they leave it, so a difference
 * is split into a part d along the face's normal and a slide s across it, and counts as |d| + tau |s|: seen
 * along the normal, the faces that the slide can reach are a graph whose slope is at most tau, so that
 * something lies that near under the point. This holds while slides are short beside the faces. The farthest
 * faces are looked at again, by the planes that a point slides over (error_gap.c). Where the
 * surface ends (borders, faces that are left out) nothing may slide, and the whole difference counts; as it
 * does where no normal serves, as at infinitely sharp edges that are folded much. */
#include "surface_error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  FACES_MAX = 1 << 18,  /* of a level that is made, from the second on */
  SMALL_PART = 8,       /* of what is enough: faces with less than that are not refined */
  FACES_AT_ONCE = 1024, /* between two charges of work */
  FACE_WORK = 256,
  RINGS_AT_ONCE = 64,
  RING_WORK = 16384,
  LOOK_WORK = 65536,
  PARTS_OF_SIZE = 3000000 /* floats round to fewer than this many parts of a coordinate, masks too */
};

enum { LEVELS_MAX = TW_LEVEL_MAX + TW_ERROR_FURTHER_LEVELS };

/* What each level was found to be. */
typedef struct findings {
  tw_arena *arena;
  tw_level_errors levels[LEVELS_MAX + 1];
  double settled[LEVELS_MAX + 1]; /* the distance of measured faces from the limit, on this level or before */
  double rests[LEVELS_MAX + 1];   /* of those given up, on this level or before */
  double small;                   /* distances of less are not told apart */
  double step;                    /* of open faces at the level before the last from their children */
  uint32_t first, last;
} findings;

/* Raises the settled distances to those of a measured face, from a level on. After the levels that were
 * looked at, the distance of the face falls to a quarter with each step. */
static void settle_at(findings *found, uint32_t level, const double errors[TW_ERROR_LOOKED]) {
  double error = 0;
  for (uint32_t i = 0; level <= LEVELS_MAX; level++, i++) {
    error = i < TW_ERROR_LOOKED ? errors[i] : error / 4;
    found->settled[level] = tw_greater(found->settled[level], error);
  }
}

/* ---- loops over faces ----------------------------------------------------------------------------- */

/* A pass over the open faces of a level. */
typedef struct pass {
  const tw_measuring *m;
  tw_error_part *p;
  enum { PASS_SETTLED, PASS_CLOSELY, PASS_ALL_OVER, PASS_STEP, PASS_REST } kind;
  const double *next;              /* of steps */
  const double *radii;             /* of the rest */
  double *rests;                   /* [faces] of open ones */
  double *steps;                   /* [faces] of open ones */
  tw_error_frame *frames;          /* [faces] of open ones */
  tw_face_measure *of_face;        /* [faces] of open ones */
  double allowed[TW_ERROR_LOOKED]; /* what is more is looked at closely */
  double limit;                    /* faces that are farther are left to their children */
  tw_share *shares[TW_PARALLEL_FOR_PARTS_MAX];
  double most[TW_PARALLEL_FOR_PARTS_MAX];
} pass;

/* Whether a face's children would tell more. */
static bool tells_more(const tw_error_part *p, uint32_t face, const tw_face_measure *own, double allowed) {
  bool is_measured = p->states[face] >= TW_FACE_OPEN && own->errors[0] >= 0 && own->usual < INFINITY;
  return is_measured && p->states[face] < TW_FACE_LAST && own->errors[0] > allowed;
}

static double measure_face(pass *s, uint32_t index, uint32_t face) {
  if (s->kind == PASS_STEP) {
    s->steps[face] = tw_error_of_step(s->m, s->p, s->next, face, &s->frames[face]);
    return tw_face_size(&s->p->topology, face) > 4 ? 0 : s->steps[face]; /* the cut of polygons is loose */
  }
  if (s->kind == PASS_REST)
    return s->rests[face] = tw_error_of_rest(s->m, s->p, s->radii, face, s->shares[index]);
  if (s->kind == PASS_CLOSELY || s->kind == PASS_ALL_OVER) {
    tw_face_measure *own = &s->of_face[face];
    if (!(own->errors[0] > s->allowed[0])) return 0;
    if (s->kind == PASS_CLOSELY)
      tw_error_look_closely(s->p, face, s->allowed[0], own);
    else if (!tells_more(s->p, face, own, s->limit))
      tw_error_look_all_over(s->p, face, s->allowed, own);
    return 0;
  }
  s->of_face[face] = tw_error_of_patch(s->m, s->p, face);
  return s->of_face[face].usual < INFINITY ? s->of_face[face].usual : 0;
}

static void measure_faces(void *context, uint32_t index, uint32_t begin, uint32_t end) {
  pass *s = context;
  for (uint32_t f = begin; f < end; f++) {
    if ((f - begin) % FACES_AT_ONCE == 0 && !tw_work((uint64_t)FACES_AT_ONCE * FACE_WORK)) return;
    if (s->p->states[f] >= TW_FACE_OPEN)
      s->most[index] = tw_greater(s->most[index], measure_face(s, index, f));
  }
}

/* Runs a pass. *most: the greatest distance of an open face. */
static tw_status run(pass *s, double *most) {
  const tw_parallel_for *parallel = s->m->parallel;
  uint32_t faces = s->p->topology.face_count, parts = tw_parallel_for_parts(parallel, faces, FACES_AT_ONCE);
  tw_status status = s->p->normals ? TW_OK : tw_error_find_normals(parallel, s->p);
  if (status != TW_OK) return status;
  tw_parallel_for_run(parallel, faces, FACES_AT_ONCE, measure_faces, s);
  *most = 0;
  for (uint32_t i = 0; i < parts; i++) *most = tw_greater(*most, s->most[i]);
  status = tw_parallel_for_status(parallel);
  return status == TW_OK ? tw_work_status(NULL) : status;
}

static uint64_t count_children(const tw_measuring *m, const tw_error_part *p) {
  return m->rules.loop ? 4 * (uint64_t)p->topology.face_count : p->topology.corner_count;
}

static bool is_too_large(const tw_measuring *m, const tw_error_part *p) {
  bool must = p->level == 0 || p->level < tw_deepest_detail(&m->details);
  return count_children(m, p) > (must ? TW_GENERIC_FACES_MAX : m->faces_max);
}

/* Raises what is allowed until the faces whose children would tell more have room beside the irregular ones.
 */
static double leave_room(const tw_measuring *m, const tw_error_part *p, const tw_face_measure *of_face,
                         double allowed) {
  enum { PLACES = 48 }; /* of a face: twice its children, and those beside it that are made for these */
  for (;;) {
    uint64_t count = 0;
    double least = INFINITY;
    for (uint32_t f = 0; f < p->topology.face_count; f++) {
      if (!tells_more(p, f, &of_face[f], allowed)) continue;
      count++;
      least = tw_lesser(least, of_face[f].errors[0]);
    }
    if (count * PLACES <= m->faces_max) return allowed;
    allowed = 1.5 * least;
  }
}

/* Measures the faces whose deeper levels follow from them: these are not open any more, unless their children
 * would tell more of what is the greatest and have room. */
static tw_status settle(const tw_measuring *m, tw_error_part *p, const tw_error_wish *wish, findings *found) {
  const double loose = 1.05, next = 0.4; /* what the next level has of a distance that falls slowly */
  uint32_t faces = p->topology.face_count;
  pass s = {.m = m,
            .p = p,
            .kind = PASS_SETTLED,
            .of_face = tw_arena_alloc_raw(p->arena, faces, sizeof *s.of_face)};
  double usual, others;
  if (!s.of_face) return TW_NO_MEMORY;
  tw_status status = run(&s, &usual);
  if (status != TW_OK) return status;
  others = tw_greater(found->settled[p->level], found->step / 4);
  double allowed = tw_greater(loose * tw_greater(usual, others), wish->enough / SMALL_PART);
  s.allowed[0] = allowed;
  for (int i = 1; i < TW_ERROR_LOOKED; i++) s.allowed[i] = next * s.allowed[i - 1];
  if (!m->rules.linear && !m->options->limit) {
    s.kind = PASS_CLOSELY;
    status = run(&s, &usual);
    if (status != TW_OK) return status;
  }
  if (is_too_large(m, p)) {
    s.limit = allowed = leave_room(m, p, s.of_face, allowed);
    if (!m->rules.linear) {
      s.kind = PASS_ALL_OVER;
      status = run(&s, &usual);
    }
    if (status != TW_OK) return status;
  }
  for (uint32_t f = 0; f < faces; f++) {
    const double *errors = s.of_face[f].errors;
    if (p->states[f] < TW_FACE_OPEN || errors[0] < 0) continue;
    p->wholes[f] = s.of_face[f].whole;
    found->levels[p->level].is_plain[f] = s.of_face[f].is_plain;
    p->errors[f] = errors[0];
    p->nexts[f] = errors[1];
    p->afters[f] = errors[2]; /* of which deeper levels have quarters */
    if (tells_more(p, f, &s.of_face[f], allowed)) {
      p->states[f]++; /* the error holds where it is given up */
      continue;
    }
    settle_at(found, p->level, errors);
    p->states[f] = TW_FACE_AROUND;
    p->open_count--;
  }
  return TW_OK;
}

/* The open faces around a vertex: how far they are from the limit, on their level and on deeper ones. */
typedef struct ring {
  uint32_t vertex, count; /* of errors, of which the last one holds on; 0: it is no ring */
  bool is_close;          /* looked at closely */
  double errors[TW_ERROR_RING_LEVELS];
} ring;

typedef struct rings_pass {
  const tw_measuring *m;
  const tw_error_part *p;
  double enough;
  const double *known; /* [TW_ERROR_RING_LEVELS + 1] what is farther is looked at closely; NULL: nothing is */
  ring *rings;
} rings_pass;

static double error_of(const ring *r, uint32_t step) {
  return r->errors[step < r->count ? step : r->count - 1];
}

/* Whether a ring is farther than what is known, on a level that is asked for. */
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
    if ((i - begin) % RINGS_AT_ONCE == 0 && !tw_work((uint64_t)RINGS_AT_ONCE * RING_WORK)) return;
    r->is_close = s->known && is_farther(s, r);
    if (s->known && !r->is_close) continue;
    if (r->is_close && !tw_work(LOOK_WORK)) return;
    r->count = tw_error_of_ring(s->m, s->p, r->vertex, s->enough, s->known, r->errors);
  }
}

static tw_status run_rings(rings_pass *s, uint32_t count) {
  tw_parallel_for_run(s->m->parallel, count, RINGS_AT_ONCE, measure_rings, s);
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
static tw_status find_rings(rings_pass *s, uint32_t *count) {
  const tw_error_part *p = s->p;
  *count = 0;
  tw_status status = tw_error_find_wheels(s->m, &p->topology);
  for (uint32_t v = 0; v < p->topology.vertex_count; v++) *count += may_be_ring(p, v);
  s->rings = tw_arena_alloc_raw(p->arena, *count, sizeof *s->rings);
  if (status != TW_OK || !s->rings) return status == TW_OK ? TW_NO_MEMORY : status;
  for (uint32_t v = 0, i = 0; v < p->topology.vertex_count; v++)
    if (may_be_ring(p, v)) s->rings[i++].vertex = v;
  return run_rings(s, *count);
}

static double distance_of(const ring *r) {
  return r->count > 0 ? r->errors[0] : 0;
}

static int farthest_first(const void *a, const void *b) {
  const ring *first = a, *second = b;
  double x = distance_of(first), y = distance_of(second);
  if (x != y) return x < y ? 1 : -1;
  return first->vertex < second->vertex ? -1 : 1;
}

/* Looks closely at rings whose distance is above what is known and at most `limit`. The farthest come first,
 * in rounds: what is found of them tells which other rings cannot matter. */
static tw_status look_at_rings(rings_pass s, uint32_t count, double limit, const double *settled) {
  enum { FIRST = 16, SMALL_ONES = 5 }; /* distances of less than this many small ones are not looked at */
  double known[TW_ERROR_RING_LEVELS + 1];
  tw_status status = TW_OK;
  uint32_t levels = LEVELS_MAX + 1 - s.p->level;
  for (uint32_t l = 0; l <= TW_ERROR_RING_LEVELS; l++)
    known[l] = l < levels ? tw_greater(settled[l], SMALL_ONES * s.enough) : INFINITY;
  s.known = known;
  qsort(s.rings, count, sizeof *s.rings, farthest_first);
  for (; count > 0 && distance_of(s.rings) > limit; count--) s.rings++;
  for (uint32_t some = FIRST; count > 0 && status == TW_OK; count -= some, s.rings += some, some *= 2) {
    some = some < count ? some : count;
    status = run_rings(&s, some);
    for (uint32_t i = 0; i < some && status == TW_OK; i++) /* cancelled ones have no errors */
      for (uint32_t l = 0; s.rings[i].is_close && l < levels; l++)
        known[l] = tw_greater(known[l], error_of(&s.rings[i], l));
  }
  return status;
}

/* The distance up to which rings are settled: deeper levels, of which there is room for some, tell of the
 * others more closely. */
static double find_ring_room(const tw_measuring *m, const ring *rings, uint32_t count) {
  const uint32_t room = m->faces_max / 4 / 96; /* each step makes about 96 faces of a ring */
  const double step = 0.9, loose = 4;          /* how much less the deeper levels may tell */
  double limit = 0, least;
  for (uint32_t i = 0; i < count; i++)
    if (rings[i].count > 0) limit = tw_greater(limit, rings[i].errors[0]);
  for (least = limit / loose; limit > least; limit *= step) {
    uint32_t more = 0;
    for (uint32_t i = 0; i < count; i++) more += rings[i].count > 0 && rings[i].errors[0] > limit * step;
    if (more > room) break;
  }
  return limit;
}

static void settle_ring(tw_error_part *p, const ring *r, findings *found) {
  const tw_topology *t = &p->topology;
  double next = error_of(r, 1), fall = r->count > 2 && next > 0 ? 0 : 1;
  for (uint32_t i = 2; i < r->count && next > 0;
       i++) /* the least that all steps after the first are within */
    fall = tw_greater(fall, pow(r->errors[i] / next, 1.0 / (i - 1)));
  for (uint32_t l = p->level; l <= LEVELS_MAX; l++)
    found->settled[l] = tw_greater(found->settled[l], error_of(r, l - p->level));
  for (uint32_t i = t->fan_offsets[r->vertex]; i < t->fan_offsets[r->vertex + 1]; i++) {
    uint32_t face = tw_corner_face(t, t->fan_corners[i]), made = tw_error_as_made(p, face);
    if (p->states[face] < TW_FACE_OPEN) continue;
    p->errors[made] = r->errors[0];
    found->levels[p->level].ring_rests[made] = error_of(r, TW_ERROR_DEPTH);
    p->falls[made] = (float)fall + 1e-6F;
    p->nexts[made] = next;
    p->afters[made] = (double)p->falls[made] * next;
    p->states[face] = TW_FACE_AROUND;
    p->open_count--;
  }
}

/* Whether a ring is on no level farther than what is settled already. */
static bool is_known(const ring *r, const findings *found, uint32_t level) {
  bool is = r->count > 0;
  for (uint32_t i = 0; i < r->count && level + i <= LEVELS_MAX; i++)
    is = is && r->errors[i] <= found->settled[level + i];
  return is;
}

/* Measures open faces around one irregular vertex, and settles them: all, or those that are not among the
 * farthest. */
static tw_status settle_rings(const tw_measuring *m, tw_error_part *p, bool all, findings *found) {
  rings_pass s = {.m = m, .p = p, .enough = found->small};
  uint32_t count;
  tw_status status = find_rings(&s, &count);
  if (status != TW_OK) return status;
  ring *rings = s.rings;
  double limit = all ? INFINITY : find_ring_room(m, rings, count);
  status = look_at_rings(s, count, limit, found->settled + p->level);
  if (status != TW_OK) return status;
  for (uint32_t i = 0; i < count; i++) {
    bool settles = rings[i].count > 0 && rings[i].errors[0] <= limit;
    if (settles || is_known(&rings[i], found, p->level)) settle_ring(p, &rings[i], found);
  }
  return TW_OK;
}

/* Settles a measured face. */
static void settle_face(tw_error_part *p, uint32_t face, findings *found) {
  uint32_t made = tw_error_as_made(p, face);
  settle_at(found, p->level,
            (const double[TW_ERROR_LOOKED]){p->errors[made], p->nexts[made], p->afters[made]});
  p->states[face] = TW_FACE_AROUND;
  p->open_count--;
}

/* Settles the measured faces that were left to their children. */
static void settle_measured(tw_error_part *p, findings *found) {
  for (uint32_t f = 0; f < p->topology.face_count; f++)
    if (p->states[f] >= TW_FACE_OPEN && p->errors[tw_error_as_made(p, f)] > 0) settle_face(p, f, found);
}

/* Finds what is left of each open face: *rests, in the part's arena. */
static tw_status find_rests(const tw_measuring *m, tw_error_part *p, double **rests, double *most) {
  pass s = {.m = m, .p = p, .kind = PASS_REST, .radii = tw_error_find_radii(p)};
  uint32_t faces = p->topology.face_count, parts = tw_parallel_for_parts(m->parallel, faces, FACES_AT_ONCE),
           capacity = tw_refine_mask_capacity(&p->topology);
  s.rests = *rests = tw_arena_alloc_raw(p->arena, faces, sizeof *s.rests);
  for (uint32_t i = 0; i < parts && s.radii && s.rests; i++) {
    s.shares[i] = tw_arena_alloc_raw(p->arena, capacity, sizeof **s.shares);
    if (!s.shares[i]) return TW_NO_MEMORY;
  }
  return s.radii && s.rests ? run(&s, most) : TW_NO_MEMORY;
}

/* Gives up open faces of which at most so much is left, so that no deeper level of them is made. A measured
 * one may be nearer by its own measure, which shrinks with each level. */
static void give_up(tw_error_part *p, const double *rests, double limit, findings *found) {
  for (uint32_t f = 0; f < p->topology.face_count; f++) {
    if (p->states[f] < TW_FACE_OPEN || !(rests[f] <= limit)) continue;
    uint32_t made = tw_error_as_made(p, f);
    if (p->errors[made] > 0 && p->errors[made] <= rests[f]) {
      settle_face(p, f, found);
      continue;
    }
    p->errors[made] = p->nexts[made] = p->afters[made] = rests[f];
    p->falls[made] = 1;
    found->rests[p->level] = tw_greater(found->rests[p->level], rests[f]);
    p->states[f] = TW_FACE_GIVEN_UP;
    p->open_count--;
  }
}

/* ---- levels --------------------------------------------------------------------------------------- */

static tw_status measure_batches(const tw_measuring *m, tw_error_part *p, const tw_error_wish *wish,
                                 findings *found);

/* A limit for what is left of a face: the children of the faces with more than that have room. most: the
 * greatest of the rests. */
static double find_room(const tw_measuring *m, const tw_error_part *p, const double *rests, double most) {
  const double step = 0.9, least = most / 1000;
  uint64_t room = (uint64_t)p->open_count * m->faces_max / count_children(m, p) / 4 * 3, count = 0;
  double limit = most / step;
  while (limit > least && count <= room) {
    limit *= step;
    count = 0;
    for (uint32_t f = 0; f < p->topology.face_count; f++)
      count += p->states[f] >= TW_FACE_OPEN && rests[f] > step * limit;
  }
  return limit;
}

/* Whether very many faces meet in a vertex: each batch that has one of these faces would have all of them. */
static bool has_wide_fan(const tw_topology *t) {
  enum { WIDE = 8192 };
  uint32_t v = 0;
  while (v < t->vertex_count && t->fan_offsets[v + 1] - t->fan_offsets[v] < WIDE) v++;
  return v < t->vertex_count;
}

/* Whether open faces may be measured in batches. After two steps no face has a second irregular point, so
 * that patches and rings tell of faces, and a batch ends; Loop's scheme has neither. A batch that is too
 * large on its own first level is not cut into batches again. */
static bool can_batch(const tw_measuring *m, const tw_error_part *p) {
  return p->level > 0 && p->batch_level != p->level && !m->rules.loop && tw_error_can_cut(m, p) &&
         !has_wide_fan(&p->topology);
}

/* Leaves the faces from which deeper levels are made: those of which more is left than a small part of what
 * is enough and, where these are too many, measures them in batches. Where a batch has too many, they are
 * those that no measure tells of, or of these the ones of which most is left. None at the last level. */
static tw_status narrow(const tw_measuring *m, tw_error_part *p, const tw_error_wish *wish, findings *found) {
  enum { SMALL_ONES, MEASURED, RINGS, ROOM, ATTEMPTS = 6 };
  bool is_last = p->level == wish->level_max + TW_ERROR_FURTHER_LEVELS,
       is_narrowed = p->level >= tw_deepest_detail(&m->details),
       has_rings = is_narrowed && p->topology.face_size == 4;
  double limit = is_last ? INFINITY : is_narrowed ? wish->enough / SMALL_PART : 0;
  tw_status status = TW_OK;
  /* Where level 2 fills half of the room, what is around its irregular points may be too large on level 3. */
  if (p->level == 1 && 2 * count_children(m, p) > m->faces_max && can_batch(m, p))
    return measure_batches(m, p, wish, found);
  if (has_rings && (p->batch_level > 0 || is_too_large(m, p))) status = settle_rings(m, p, false, found);
  /* The faces of a batch of level 1 stay together for the rings of level 2. */
  if (p->batch_level == 1 && p->level == 1) return status;
  for (int attempt = SMALL_ONES; p->open_count > 0 && status == TW_OK; attempt++) {
    double *rests = NULL, most = 0;
    if (attempt == MEASURED) settle_measured(p, found);
    if (attempt == RINGS && has_rings) status = settle_rings(m, p, true, found);
    if (attempt >= ROOM || (attempt == SMALL_ONES && limit > 0)) status = find_rests(m, p, &rests, &most);
    if (status != TW_OK) return status;
    if (attempt >= ROOM)
      limit = p->level > 0 && is_narrowed && attempt < ATTEMPTS ? find_room(m, p, rests, most) : INFINITY;
    if (rests) give_up(p, rests, limit, found);
    if (p->open_count > 0 && p->level > 0) status = tw_error_cut(m, p);
    if (status != TW_OK || !is_too_large(m, p)) return status;
    if (attempt == SMALL_ONES && can_batch(m, p)) return measure_batches(m, p, wish, found);
  }
  return status;
}

static tw_status keep_points(findings *found, const tw_error_part *p) {
  tw_level_errors *kept = &found->levels[p->level];
  if (!p->shown) return TW_OK; /* the next level tells them */
  kept->points = tw_arena_alloc_raw(found->arena, kept->vertex_count, sizeof(double[3]));
  if (!kept->points) return TW_NO_MEMORY;
  memcpy(kept->points, p->shown, kept->vertex_count * sizeof(double[3]));
  kept->control = kept->points;
  if (p->shown == p->control) return TW_OK;
  kept->control = tw_arena_alloc_raw(found->arena, kept->vertex_count, sizeof(double[3]));
  if (!kept->control) return TW_NO_MEMORY;
  memcpy(kept->control, p->control, kept->vertex_count * sizeof(double[3]));
  return TW_OK;
}

/* Begins to keep what is known of a level that was just made. */
static tw_status keep_made(findings *found, tw_error_part *p) {
  const tw_topology *t = &p->topology;
  tw_level_errors *kept = &found->levels[p->level];
  kept->face_count = t->face_count;
  kept->vertex_count = t->vertex_count;
  kept->errors = p->errors = tw_arena_alloc(found->arena, t->face_count, sizeof *p->errors);
  kept->wholes = p->wholes = tw_arena_alloc_raw(found->arena, t->face_count, sizeof *p->wholes);
  kept->begins = tw_arena_alloc_raw(found->arena, (size_t)t->face_count + 1, sizeof *kept->begins);
  kept->corners = tw_arena_alloc_raw(found->arena, t->corner_count, sizeof *kept->corners);
  p->nexts = tw_arena_alloc(found->arena, t->face_count, sizeof *p->nexts);
  p->afters = tw_arena_alloc(found->arena, t->face_count, sizeof *p->afters);
  p->falls = tw_arena_alloc_raw(found->arena, t->face_count, sizeof *p->falls);
  kept->is_plain = tw_arena_alloc(found->arena, t->face_count, sizeof *kept->is_plain);
  kept->ring_rests = tw_arena_alloc_raw(found->arena, t->face_count, sizeof *kept->ring_rests);
  if (!p->errors || !p->wholes || !p->nexts || !p->afters || !p->falls || !kept->is_plain ||
      !kept->ring_rests || !kept->begins || !kept->corners)
    return TW_NO_MEMORY;
  for (uint32_t f = 0; f < t->face_count; f++) {
    kept->begins[f] = tw_face_begin(t, f);
    p->wholes[f] = INFINITY;
    p->falls[f] = 0.25F;
    kept->ring_rests[f] = -1;
  }
  kept->begins[t->face_count] = t->corner_count;
  memcpy(kept->corners, t->corner_vertex, t->corner_count * sizeof *kept->corners);
  return keep_points(found, p);
}

/* Keeps what is left of a level whose children are made. */
static tw_status keep_left(const tw_measuring *m, findings *found, const tw_error_part *p,
                           const tw_error_part *child) {
  const tw_topology *t = &p->topology;
  tw_level_errors *kept = &found->levels[p->level];
  kept->left_count = t->face_count;
  kept->made = tw_arena_alloc_raw(found->arena, t->face_count, sizeof *kept->made);
  kept->children = tw_arena_alloc_raw(found->arena, (size_t)t->face_count + 1, sizeof *kept->children);
  kept->steps = tw_arena_alloc_raw(found->arena, t->face_count, sizeof *kept->steps);
  kept->frames = tw_arena_alloc_raw(found->arena, t->face_count, sizeof *kept->frames);
  if (!kept->made || !kept->children || !kept->steps || !kept->frames) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < t->face_count; f++) {
    bool is_known = p->states[f] == TW_FACE_AROUND || p->states[f] == TW_FACE_GIVEN_UP;
    uint32_t made = kept->made[f] = tw_error_as_made(p, f);
    kept->steps[f] = -1;
    kept->children[f] = m->rules.loop ? 4 * f : tw_face_begin(t, f);
    kept->children[f + 1] = m->rules.loop ? 4 * f + 4 : kept->children[f] + tw_face_size(t, f);
    for (uint32_t c = kept->children[f]; is_known && c < kept->children[f + 1]; c++) {
      child->falls[c] = p->falls[made];
      child->errors[c] = tw_greater(p->nexts[made], found->small);
      child->nexts[c] = tw_greater(p->afters[made], (double)p->falls[made] * found->small);
      child->afters[c] = (double)p->falls[made] * child->nexts[c];
    }
  }
  return TW_OK;
}

/* Compares a level with the next, which replaces it. */
static tw_status step(const tw_measuring *m, tw_error_part *p, findings *found) {
  tw_error_part child;
  tw_status status = tw_error_refine(m, p, &child);
  if (status == TW_OK) status = keep_made(found, &child);
  if (status == TW_OK) status = keep_left(m, found, p, &child);
  if (status == TW_OK && !p->shown) {
    p->shown = tw_error_copy_points(p, child.shown); /* vertices keep their numbers and limits */
    status = p->shown ? keep_points(found, p) : TW_NO_MEMORY;
  }
  tw_level_errors *kept = &found->levels[p->level];
  pass s = {
      .m = m, .p = p, .kind = PASS_STEP, .next = child.shown, .steps = kept->steps, .frames = kept->frames};
  if (status == TW_OK) status = run(&s, &found->step);
  tw_arena_destroy(p->arena);
  *p = child;
  return status;
}

static tw_status measure(const tw_measuring *m, tw_error_part *p, const tw_error_wish *wish, findings *out) {
  uint32_t deepest = tw_deepest_detail(&m->details);
  out->small = tw_greater(wish->enough / SMALL_PART, m->size / PARTS_OF_SIZE);
  for (;; out->last++) {
    bool can_settle = p->shown && p->level >= deepest;
    tw_status status = can_settle ? settle(m, p, wish, out) : TW_OK;
    if (status != TW_OK) return status;
    out->rests[out->last] = out->last > 0 ? out->rests[out->last - 1] : 0;
    if (p->open_count > 0) status = p->shown ? narrow(m, p, wish, out) : TW_OK;
    if (p->open_count == 0 || status != TW_OK) return status;
    status = step(m, p, out);
    if (status != TW_OK) return status;
  }
}

/* Adds up the distances. Levels below the last one lie in the hulls that the rest was found by. */
static tw_status sum_up(const tw_measuring *m, findings *found, uint32_t level_max, double rounding,
                        double *out) {
  for (uint32_t level = found->last; level <= level_max; level++)
    out[level] = rounding + tw_greater(found->settled[level], found->rests[found->last]);
  for (uint32_t level = found->last; level-- > found->first;) {
    double most = tw_greater(found->settled[level], found->rests[level]);
    tw_status status = tw_error_sum_up(m, found->arena, &found->levels[level], found->last - level, &most);
    if (status != TW_OK) return status;
    if (level <= level_max) out[level] = most + rounding;
  }
  return TW_OK;
}

/* ---- batches -------------------------------------------------------------------------------------- */

/* Lists open faces: neighbours in the mesh are near each other in the list. */
static uint32_t *list_open(const tw_error_part *p) {
  const tw_topology *t = &p->topology;
  uint8_t *listed = tw_arena_alloc(p->arena, t->face_count, 1);
  uint32_t *out = tw_arena_alloc_raw(p->arena, p->open_count, sizeof *out), count = 0, done = 0;
  for (uint32_t f = 0; out && listed && f < t->face_count; f++) {
    if (p->states[f] < TW_FACE_OPEN || listed[f]) continue;
    listed[f] = 1;
    for (out[count++] = f; done < count; done++)
      for (uint32_t i = 0; i < t->face_size; i++) {
        uint32_t beside = tw_corner_face(t, t->sibling[t->face_size * out[done] + i]);
        if (p->states[beside] < TW_FACE_OPEN || listed[beside]) continue;
        listed[beside] = 1;
        out[count++] = beside;
      }
  }
  return listed ? out : NULL;
}

/* Measures the part around the open faces, which are a batch, by itself. bounds: raised, of all levels. */
static tw_status measure_batch(const tw_measuring *m, tw_error_part *p, const tw_error_wish *wish,
                               double bounds[LEVELS_MAX + 1]) {
  uint32_t count, *corners = tw_error_list_corners(p, p->level == 1 ? 2 : 1, &count),
                  size = p->topology.face_size;
  double own[LEVELS_MAX + 1];
  tw_error_part part = {.batch_level = p->level, .level = p->level, .open_count = p->open_count};
  findings found = {.arena = tw_arena_create(), .first = p->level, .last = p->level};
  tw_status status = corners && found.arena ? tw_error_cut_out(m, p, corners, count, &part) : TW_NO_MEMORY;
  part.made = NULL; /* a batch begins anew: its faces are numbered as they are made */
  /* Distances of at most those of earlier batches need no closer look. */
  memcpy(found.settled, bounds, sizeof found.settled);
  if (status == TW_OK) status = keep_made(&found, &part);
  if (status == TW_OK) status = measure(m, &part, wish, &found);
  if (status == TW_OK) status = sum_up(m, &found, LEVELS_MAX, 0, own);
  for (uint32_t l = p->level; status == TW_OK && l <= LEVELS_MAX; l++)
    bounds[l] = tw_greater(bounds[l], own[l]);
  for (uint32_t i = 0; status == TW_OK && i < count / size; i++) {
    uint32_t face = corners[(size_t)size * i] / size;
    if (p->states[face] < TW_FACE_OPEN) continue;
    uint32_t made = tw_error_as_made(p, face);
    p->errors[made] = p->nexts[made] = p->afters[made] = found.levels[p->level].errors[i];
    p->falls[made] = 1;
  }
  tw_arena_destroy(part.arena);
  tw_arena_destroy(found.arena);
  return status;
}

/* Measures open faces whose children are too many, some after the others. None is open then. */
static tw_status measure_batches(const tw_measuring *m, tw_error_part *p, const tw_error_wish *wish,
                                 findings *found) {
  /* Open faces of deeper levels lie apart, and each needs the faces around it. */
  const uint32_t part = p->level == 1 ? 8 : 32, batch = m->faces_max / part + 1;
  uint32_t *open = list_open(p), count = p->open_count;
  tw_status status = open ? TW_OK : TW_NO_MEMORY;
  for (uint32_t i = 0; i < count && open; i++) p->states[open[i]] = TW_FACE_AROUND;
  for (uint32_t begin = 0; begin < count && status == TW_OK; begin += batch) {
    p->open_count = count - begin < batch ? count - begin : batch;
    for (uint32_t i = 0; i < p->open_count; i++) p->states[open[begin + i]] = TW_FACE_OPEN;
    status = measure_batch(m, p, wish, found->settled);
    for (uint32_t i = 0; i < p->open_count; i++) p->states[open[begin + i]] = TW_FACE_AROUND;
  }
  p->open_count = 0;
  return status;
}

/* ---- the whole ------------------------------------------------------------------------------------ */

static bool has_border(const tw_topology *t) {
  for (uint32_t e = 0; e < t->edge_count; e++)
    if (t->edge_flags[e] & TW_EDGE_BORDER) return true;
  return false;
}

/* Whether the error of level 0 is not known: it has faces that deeper levels leave out, or polygons at the
 * limit, whose points the next level tells with its details. */
static bool is_odd_cage(const tw_measuring *m, const tw_error_part *cage) {
  const tw_topology *t = &cage->topology;
  uint32_t hidden = 0;
  for (uint32_t f = 0; f < t->face_count; f++) hidden += cage->states[f] == TW_FACE_HIDDEN;
  return hidden > m->mesh->hole_count || (!cage->shown && m->details.count > 0);
}

tw_status tw_surface_errors(const tw_mesh *mesh, const tw_surface_options *options, const tw_error_wish *wish,
                            const tw_parallel_for *parallel, double *out, tw_error *error) {
  tw_measuring m = {.mesh = mesh,
                    .options = options,
                    .parallel = parallel,
                    .rules = tw_rules_of(options),
                    .details = {mesh->detail_count, mesh->details},
                    .level_max = wish->level_max,
                    .faces_max = wish->faces_max > 0 ? wish->faces_max : FACES_MAX};
  tw_status status = tw_cage_check_options(mesh, options, error);
  if (status != TW_OK) return status;
  tw_error_part p = {0};
  findings found = {.arena = tw_arena_create()};
  m.arena = found.arena;
  status = found.arena ? tw_error_make_wheels(&m) : TW_NO_MEMORY;
  if (status == TW_OK) status = tw_error_begin(&m, &p);
  if (status == TW_OK) status = keep_made(&found, &p);
  bool is_odd = status == TW_OK && is_odd_cage(&m, &p);
  if (status == TW_OK && options->boundary == TW_BOUNDARY_OPEN && has_border(&p.topology))
    status = tw_fail(error, TW_UNSUPPORTED, "with boundary=open each level is smaller than the one before");
  if (status == TW_OK) status = measure(&m, &p, wish, &found);
  tw_arena_destroy(p.arena);
  if (status == TW_OK) status = sum_up(&m, &found, wish->level_max, m.size / PARTS_OF_SIZE, out);
  tw_arena_destroy(found.arena);
  if (status == TW_OK && is_odd) out[0] = INFINITY;
  if (status == TW_CANCELLED) return tw_fail(error, status, "the distances are not wanted any more");
  return status == TW_NO_MEMORY ? tw_fail(error, status, "out of memory") : status;
}
