/* Exact bounds of the points of an answer, which are not stored.
 *
 * Every point of a patch is a convex combination of its control points. So after evaluating the patches that
 * reach farthest, most other patches cannot widen the bounds and are skipped: the pass costs as much as the
 * cage, not as the answer, except where many patches touch the bounds (a flat side). */
#include <math.h>
#include <string.h>

#include "evaluator.h"
#include "parallel_for.h"
#include "surface_reader.h"

enum {
  BLOCK_ROWS = 2048,
  PART_ROWS = 1 << 15,   /* fewer rows are not worth another thread */
  AT_ONCE_ROWS = 1 << 20 /* rows between two checks for cancellation */
};

/* A pass over points, or a thread's part of one. The order of points does not change the bounds. */
typedef struct pass {
  const tw_surface *s;
  tw_domain domain;
  uint32_t width, offset; /* width of the rows, and offset of the points in them */
  int morph;              /* the target whose displacements are bounded; -1: positions */
  bool convex;            /* patch by patch, as the head of this file explains; false: row by row */
  tw_surface_reader *reader;
  float *block; /* [BLOCK_ROWS][width] */
  bool started;
  float bounds[2][3];
} pass;

static void widen(pass *p, const float *point) {
  for (int c = 0; c < 3; c++) {
    if (!p->started || point[c] < p->bounds[0][c]) p->bounds[0][c] = point[c];
    if (!p->started || point[c] > p->bounds[1][c]) p->bounds[1][c] = point[c];
  }
  p->started = true;
}

static void take_rows(pass *p, uint64_t first, uint64_t count) {
  while (count > 0) {
    size_t taken = count < BLOCK_ROWS ? (size_t)count : BLOCK_ROWS;
    tw_surface_read_rows(p->reader, p->domain, first, taken, p->block);
    for (size_t i = 0; i < taken; i++) widen(p, p->block + i * p->width + p->offset);
    first += taken;
    count -= taken;
  }
}

/* Widens the bounds by all rows at a face of the base. They are read as the answer has them, so that bounds
 * are exact. */
static void take_face(pass *p, uint32_t visible, uint32_t face) {
  const tw_surface *s = p->s;
  const tw_numbering *n = &s->points;
  uint64_t line = s->side - 1, edges_begin = n->corner_count, inside = tw_rows_inside_face(s);
  uint32_t size = s->fields[0].base.face_size;
  for (uint32_t k = 0; k < size; k++) {
    take_rows(p, tw_row_of_corner(n, size * face + k), 1);
    take_rows(p, edges_begin + (tw_row_of_edge(n, size * face + k) >> 1) * line, line);
  }
  take_rows(p, edges_begin + n->edge_count * line + visible * inside, inside);
}

static void control_box(const tw_surface *s, uint32_t face, float box[2][3]) {
  tw_point corners[2] = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
  s->evaluator->widen_box(s, face, corners);
  for (int c = 0; c < 3; c++) {
    box[0][c] = corners[0][c];
    box[1][c] = corners[1][c];
  }
}

/* Whether no point in the box can widen the bounds, even with the rounding on the way to a point. */
static bool lies_within(const pass *p, const float box[2][3]) {
  const float rounding = 1e-5f;
  for (int c = 0; c < 3; c++) {
    float margin = rounding * fmaxf(fabsf(box[0][c]), fabsf(box[1][c]));
    if (box[0][c] - margin <= p->bounds[0][c] || box[1][c] + margin >= p->bounds[1][c]) return false;
  }
  return p->started;
}

/* Finds the six patches whose boxes have the farthest centres along the axes. */
static void find_farthest(const tw_surface *s, uint32_t farthest[6]) {
  float reach[6] = {0}, box[2][3] = {{0}};
  for (uint32_t v = 0; v < s->quad_count; v++) {
    control_box(s, tw_base_quad(s, v), box);
    for (int c = 0; c < 3; c++) {
      float middle = box[0][c] / 2 + box[1][c] / 2;
      if (v == 0 || middle < reach[c]) {
        reach[c] = middle;
        farthest[c] = v;
      }
      if (v == 0 || middle > reach[3 + c]) {
        reach[3 + c] = middle;
        farthest[3 + c] = v;
      }
    }
  }
}

/* Makes the pass's own reader and block; either is NULL where this fails. */
static bool open_pass(pass *p) {
  p->block = NULL; /* a part begins as a copy of a pass that is closed */
  p->reader = tw_surface_reader_create_shared(&p->s, 1, 1);
  if (!p->reader) return false;
  tw_turn_to_points(p->reader, p->s, p->morph);
  const tw_surface_layout *layout = tw_surface_reader_layout(p->reader);
  p->width = p->morph < 0 ? 3 : layout->stride;
  p->offset = p->morph < 0 ? 0 : layout->morphs;
  p->block = tw_alloc(BLOCK_ROWS, p->width * sizeof *p->block);
  return p->block;
}

static void close_pass(pass *p) {
  tw_surface_reader_destroy(p->reader);
  tw_free(p->block);
}

/* Finds the bounds that all parts start with: the wider they are, the fewer patches are evaluated. */
static void take_farthest(pass *p) {
  uint32_t farthest[6] = {0};
  find_farthest(p->s, farthest);
  for (int i = 0; i < 6; i++) take_face(p, farthest[i], tw_base_quad(p->s, farthest[i]));
}

static void take_patches(pass *p, uint32_t first, uint32_t end) {
  for (uint32_t v = first; v < end; v++) {
    float box[2][3] = {{0}};
    control_box(p->s, tw_base_quad(p->s, v), box);
    if (!lies_within(p, (const float(*)[3])box)) take_face(p, v, tw_base_quad(p->s, v));
  }
}

/* A pass and its parts on several threads. Parts that were not run stay empty. */
typedef struct shared_pass {
  pass start;
  uint32_t first; /* the quad or row that the current loop begins with */
  pass parts[TW_PARALLEL_FOR_PARTS_MAX];
  bool failed[TW_PARALLEL_FOR_PARTS_MAX];
} shared_pass;

/* Takes quads or rows [first + begin, first + end). */
static void take_part(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  shared_pass *shared = context;
  pass *p = &shared->parts[part];
  *p = shared->start;
  bool ready = open_pass(p);
  shared->failed[part] = !ready;
  if (ready && p->convex)
    take_patches(p, shared->first + begin, shared->first + end);
  else if (ready)
    take_rows(p, shared->first + begin, end - begin);
  close_pass(p);
}

/* Widens the bounds that later parts start with by what the parts have found. */
static tw_status gather(shared_pass *shared) {
  for (uint32_t i = 0; i < TW_PARALLEL_FOR_PARTS_MAX; i++) {
    if (shared->failed[i]) return TW_NO_MEMORY;
    if (!shared->parts[i].started) continue;
    widen(&shared->start, shared->parts[i].bounds[0]);
    widen(&shared->start, shared->parts[i].bounds[1]);
  }
  return TW_OK;
}

static tw_status run_pass(shared_pass *shared, const tw_parallel_for *parallel, float bounds[2][3]) {
  pass *all = &shared->start;
  uint32_t rows = (uint32_t)tw_own_row_count(all->s, all->domain), quads = all->s->quad_count,
           count = all->convex ? quads : rows, rows_each = all->convex ? rows / quads : 1,
           most = 1 + AT_ONCE_ROWS / rows_each;
  if (all->convex) {
    bool ready = open_pass(all);
    if (ready) take_farthest(all);
    close_pass(all);
    if (!ready) return TW_NO_MEMORY;
  }
  tw_status status = TW_OK;
  for (uint32_t taken; shared->first < count && status == TW_OK; shared->first += taken) {
    status = tw_parallel_for_status(parallel);
    taken = count - shared->first < most ? count - shared->first : most;
    if (status != TW_OK) return status;
    tw_parallel_for_run(parallel, taken, 1 + PART_ROWS / rows_each, take_part, shared);
    status = gather(shared);
  }
  memcpy(bounds, all->bounds, sizeof all->bounds);
  return status;
}

/* Computes the bounds. Split vertices repeat their points, so the bounds of TW_DOMAIN_POINTS serve for
 * positions; displacements of morph targets are in rows of TW_DOMAIN_VERTICES alone. Under Chaikin's rule
 * masks are not always convex. */
static tw_status compute(const tw_surface *s, int morph, const tw_parallel_for *parallel,
                         float bounds[2][3]) {
  shared_pass *shared = tw_alloc_zero(1, sizeof *shared);
  if (!shared) return TW_NO_MEMORY;
  shared->start = (pass){.s = s, .domain = morph < 0 ? TW_DOMAIN_POINTS : TW_DOMAIN_VERTICES, .morph = morph};
  shared->start.convex = morph < 0 && s->evaluator->widen_box && s->depth > 0 &&
                         s->options.creasing != TW_CREASE_CHAIKIN && s->quad_count > 0;
  tw_status status = run_pass(shared, parallel, bounds);
  if (s->rim) {
    shared->start.s = s->rim;
    shared->start.convex = false;
    shared->first = 0;
    if (status == TW_OK) status = run_pass(shared, parallel, bounds);
  }
  tw_free(shared);
  return status;
}

enum { BOUNDS_UNKNOWN, BOUNDS_BEING_WRITTEN, BOUNDS_KNOWN };

tw_status tw_surface_start_bounds(tw_surface *surface) {
  size_t count = tw_surface_bounds_count(surface);
  surface->bounds_ready = tw_alloc_zero(count, sizeof *surface->bounds_ready);
  surface->bounds = tw_alloc_zero(count, sizeof *surface->bounds);
  return surface->bounds_ready && surface->bounds ? TW_OK : TW_NO_MEMORY;
}

tw_status tw_surface_bounds_by(const tw_surface *surface, int morph, const tw_parallel_for *parallel,
                               float min[3], float max[3]) {
  /* Displacements belong to the plan, and so do their bounds. */
  if (morph >= 0 && surface->plan) return tw_surface_bounds_by(surface->plan, morph, parallel, min, max);
  size_t slot = morph < 0 ? 0 : (size_t)morph + 1;
  float bounds[2][3];
  if (atomic_load(&surface->bounds_ready[slot]) == BOUNDS_KNOWN) {
    memcpy(bounds, surface->bounds[slot], sizeof bounds);
  } else {
    tw_status status = compute(surface, morph, parallel, bounds);
    if (status != TW_OK) return status;
    /* Two threads may both have computed the same bounds; one of them stores its result. */
    int expected = BOUNDS_UNKNOWN;
    if (atomic_compare_exchange_strong(&surface->bounds_ready[slot], &expected, BOUNDS_BEING_WRITTEN)) {
      memcpy(surface->bounds[slot], bounds, sizeof bounds);
      atomic_store(&surface->bounds_ready[slot], BOUNDS_KNOWN);
    }
  }
  memcpy(min, bounds[0], sizeof bounds[0]);
  memcpy(max, bounds[1], sizeof bounds[1]);
  return TW_OK;
}

tw_status tw_surface_bounds(const tw_surface *surface, int morph, float min[3], float max[3]) {
  return tw_surface_bounds_by(surface, morph, NULL, min, max);
}
