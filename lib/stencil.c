/* Makes stencils: a patch's points are linear in its control points, so that weights are the points of
 * patches in which one control point is 1 and all others are 0. */
#include "stencil.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include "common_shape.h"

enum {
  USES_MIN = 8,             /* patches of a class that make up for the time a stencil takes to make */
  BYTES_MAX = 4 << 20,      /* all stencils of one mesh together, which the processor's cache holds */
  ALL_BYTES_MAX = 64 << 20, /* of all that share classes */
  TOGETHER = 4,             /* control points a patch: the components of its points */
  SLOPE_WIDTH = 8,
  SLOPE_SECOND = 4,
  SECTIONS = 9,
  INSIDE_WIDTH = 7, /* floats of a point of the inside: four of its value, three of its normal */
  INSIDE_MAX = ((1 << TW_STENCIL_DEPTH_MAX) - 1) * ((1 << TW_STENCIL_DEPTH_MAX) - 1)
};

/* In place of a class's uses, once they have proved enough. */
static const uint32_t TAKEN = UINT32_MAX;

/* ---- sections ------------------------------------------------------------------------------- */

/* Rectangle of a section of a grid of n cells: corners 0 to 3, sides 0 to 3, the inside. */
static inline tw_patch_rect section_rect(uint32_t n, uint32_t section) {
  uint32_t i0 = section == 1 || section == 2 || section == 5 ? n : 0,
           j0 = section == 2 || section == 3 || section == 6 ? n : 0;
  tw_patch_rect rect = {i0, i0, j0, j0};
  if (section == 4 || section == 6 || section == 8) rect.i0 = 1, rect.i1 = n - 1;
  if (section == 5 || section >= 7) rect.j0 = 1, rect.j1 = n - 1;
  return rect;
}

static inline uint32_t section_first(uint32_t n, uint32_t section) {
  return section <= 4 ? section : 4 + (section - 4) * (n - 1);
}

/* ---- weights -------------------------------------------------------------------------------- */

/* A class as the only patch there is. */
typedef struct basis {
  tw_patch_class *shape;
  const tw_stencil_wish *wish;
  uint32_t points, apart;
  uint32_t *controls; /* [point_count] */
  float *in;          /* [point_count][TOGETHER] */
  double *scratch;
  float *values, *slopes;   /* [points][TOGETHER], [points][SLOPE_WIDTH] */
  float *out, *tangents[2]; /* as in a stencil */
} basis;

static bool allocate(basis *b, tw_arena *scratch, tw_arena *arena, uint32_t control_count) {
  uint32_t count = b->shape->point_count;
  b->controls = tw_arena_alloc(scratch, count, sizeof *b->controls);
  b->in = tw_arena_alloc(scratch, count, TOGETHER * sizeof *b->in);
  b->scratch = tw_arena_alloc(scratch, b->wish->scratch_points, TOGETHER * sizeof *b->scratch);
  b->values = tw_arena_alloc(scratch, b->points, TOGETHER * sizeof *b->values);
  b->slopes = tw_arena_alloc(scratch, b->points, SLOPE_WIDTH * sizeof *b->slopes);
  size_t size = (size_t)control_count * b->apart;
  b->out = tw_arena_alloc(arena, size, sizeof *b->out);
  bool complete = b->controls && b->in && b->scratch && b->values && b->slopes && b->out;
  for (int t = 0; b->wish->normals && t < 2; t++) {
    b->tangents[t] = tw_arena_alloc(arena, size, sizeof *b->tangents[t]);
    complete = complete && b->tangents[t];
  }
  return complete;
}

/* The patch of the control points that are set. */
static void evaluate(const basis *b) {
  tw_patch patch = {.shape = b->shape};
  tw_patches patches = {.depth = b->wish->depth, .patches = &patch, .controls = b->controls};
  uint32_t n = 1u << b->wish->depth;
  tw_patch_job job = {.in = b->in,
                      .width = TOGETHER,
                      .limit = b->wish->limit,
                      .values = b->values,
                      .stride = TOGETHER,
                      .scratch = b->scratch};
  tw_patch_evaluate(&patches, 0, &job, (tw_patch_rect){0, n, 0, n});
  if (!b->wish->normals) return;
  job.values = NULL;
  job.derivatives = b->slopes;
  job.unframed = true;
  job.stride = SLOPE_WIDTH;
  tw_patch_evaluate(&patches, 0, &job, (tw_patch_rect){0, n, 0, n});
}

/* Weights of control point k, the nth of those together, at all points. */
static void store(const basis *b, uint32_t k, uint32_t nth) {
  uint32_t n = 1u << b->wish->depth;
  size_t place = (size_t)k * b->apart;
  for (uint32_t section = 0; section < SECTIONS; section++) {
    tw_patch_rect rect = section_rect(n, section);
    for (uint32_t j = rect.j0; j <= rect.j1; j++)
      for (uint32_t i = rect.i0; i <= rect.i1; i++, place++) {
        uint32_t point = j * (n + 1) + i;
        b->out[place] = b->values[point * TOGETHER + nth];
        for (uint32_t t = 0; b->wish->normals && t < 2; t++)
          b->tangents[t][place] = b->slopes[point * SLOPE_WIDTH + t * SLOPE_SECOND + nth];
      }
  }
}

/* Weights of the control points from k on. */
static void weigh(const basis *b, uint32_t k) {
  uint32_t count = b->shape->point_count, together = count - k < TOGETHER ? count - k : TOGETHER;
  memset(b->in, 0, (size_t)count * TOGETHER * sizeof *b->in);
  for (uint32_t i = 0; i < together; i++) b->in[(k + i) * TOGETHER + i] = 1;
  evaluate(b);
  for (uint32_t i = 0; i < together; i++) store(b, k + i, i);
}

/* By a power of two, which loses nothing. */
static void scale_tangent(const basis *b, float *weights) {
  assert(weights);
  float sum = 0;
  int exponent;
  for (uint32_t i = 0; i < b->shape->point_count; i++) sum += fabsf(weights[(size_t)i * b->apart]);
  frexpf(sum, &exponent);
  for (uint32_t i = 0; i < b->shape->point_count; i++)
    weights[(size_t)i * b->apart] = ldexpf(weights[(size_t)i * b->apart], -exponent);
}

tw_status tw_stencil_make(tw_patch_class *shape, const tw_stencil_wish *wish, tw_arena *arena,
                          tw_stencil *out) {
  uint32_t side = (1u << wish->depth) + 1, control_count = (shape->point_count + 1) & ~1u;
  basis b = {.shape = shape, .wish = wish, .points = side * side};
  b.apart = b.points + TW_SPLINE_LANES;
  tw_arena *scratch = tw_arena_create();
  tw_status status = scratch && allocate(&b, scratch, arena, control_count) ? TW_OK : TW_NO_MEMORY;
  if (status == TW_OK) {
    for (uint32_t i = 0; i < shape->point_count; i++) b.controls[i] = i;
    for (uint32_t k = 0; k < shape->point_count; k += TOGETHER) weigh(&b, k);
    for (uint32_t p = 0; wish->normals && p < b.points; p++)
      for (int t = 0; t < 2; t++) scale_tangent(&b, b.tangents[t] + p);
    *out = (tw_stencil){control_count, b.apart, b.out, {b.tangents[0], b.tangents[1]}};
  }
  tw_arena_destroy(scratch);
  return status;
}

/* ---- of all patches ------------------------------------------------------------------------- */

static size_t bytes_of(const tw_patch_class *shape, const tw_stencil_wish *wish) {
  size_t side = ((size_t)1 << wish->depth) + 1;
  return (wish->normals ? 3 : 1) * sizeof(float) * shape->point_count * side * side;
}

/* What the other surfaces of a scene have made serves as well; what they have not asked for is made anew. */
static tw_status need_stencil(tw_patch_class *shape, const tw_stencil_wish *wish, tw_arena *arena) {
  const tw_stencil **known = &shape->stencils[wish->limit][wish->depth];
  if (*known && (!wish->normals || (*known)->tangents[0])) return TW_OK;
  if (tw_arena_size(arena) > ALL_BYTES_MAX) return TW_LIMIT;
  tw_stencil *stencil = tw_arena_alloc(arena, 1, sizeof *stencil);
  tw_status status = stencil ? tw_stencil_make(shape, wish, arena, stencil) : TW_NO_MEMORY;
  if (status == TW_OK) *known = stencil;
  return status;
}

/* Which patches are summed follows from these patches alone: a surface has the same rows whatever others
 * share its classes. */
tw_status tw_patches_sum(tw_patches *patches, tw_patch_shapes *shapes, bool limit, bool normals) {
  tw_status status = tw_common_stencils(shapes, limit, normals);
  if (status != TW_OK || patches->depth > TW_STENCIL_DEPTH_MAX) return status;
  const tw_stencil_wish wish = {patches->depth, patches->scratch_points, limit, normals};
  size_t bytes = 0;
  tw_patch *first = patches->patches, *end = first + patches->base->face_count;
  for (tw_patch *patch = first; patch < end; patch++)
    if (patch->shape) patch->shape->uses = 0;
  for (tw_patch *patch = first; patch < end; patch++)
    if (patch->shape) patch->shape->uses++;
  for (tw_patch *patch = first; patch < end; patch++) {
    tw_patch_class *shape = patch->shape;
    patch->summed = shape && shape->common;
    if (!shape || shape->common || shape->point_count > TW_STENCIL_CONTROLS_MAX || shape->uses < USES_MIN)
      continue;
    if (shape->uses != TAKEN) {
      bytes += bytes_of(shape, &wish);
      shape->uses = bytes <= BYTES_MAX ? TAKEN : 0;
      status = shape->uses == TAKEN ? need_stencil(shape, &wish, tw_patch_shapes_stencils(shapes)) : TW_OK;
      if (status != TW_OK) return status;
    }
    patch->summed = shape->uses == TAKEN;
  }
  return TW_OK;
}

/* ---- rectangles ----------------------------------------------------------------------------- */

/* Copies `width` floats of each of some rows. */
static void put_rows(const float *rows, size_t width, size_t from_step, uint32_t count, ptrdiff_t step,
                     float *out) {
  if (step == (ptrdiff_t)width && from_step == width) {
    memcpy(out, rows, count * width * sizeof *out);
    return;
  }
  for (uint32_t i = 0; i < count; i++, rows += from_step, out += step) memcpy(out, rows, width * sizeof *out);
}

/* Lines of the inside of a grid of n cells, which lie elsewhere than the points of the stencil: whole ones
 * are summed up, and then put where they belong. */
static bool sum_lines(const tw_stencil_job *job, uint32_t n, tw_patch_rect rect, ptrdiff_t line_step) {
  float rows[INSIDE_MAX * INSIDE_WIDTH];
  bool joined = job->values && job->normals == job->values + job->width;
  size_t before = job->values ? job->width : 0, width = before + (job->normals ? 3 : 0);
  tw_stencil_job lines = *job;
  uint32_t line = n - 1, count = rect.i1 - rect.i0 + 1;
  lines.first -= rect.i0 - 1;
  lines.count = (rect.j1 - rect.j0 + 1) * line;
  lines.step = (ptrdiff_t)width;
  if (job->values) lines.values = rows;
  if (job->normals) lines.normals = rows + before;
  bool sure = tw_stencil_rows(&lines);
  const float *from = rows + (rect.i0 - 1) * width;
  for (uint32_t j = rect.j0; j <= rect.j1; j++, from += line * width) {
    ptrdiff_t place = (ptrdiff_t)(j - rect.j0) * line_step;
    if (joined) {
      put_rows(from, width, width, count, job->step, job->values + place);
      continue;
    }
    if (job->values) put_rows(from, before, width, count, job->step, job->values + place);
    if (job->normals) put_rows(from + before, 3, width, count, job->step, job->normals + place);
  }
  return sure;
}

/* What a rectangle has of one section. */
static bool sum_section(const tw_stencil_job *job, uint32_t n, uint32_t section, tw_patch_rect rect,
                        ptrdiff_t line_step) {
  tw_patch_rect own = section_rect(n, section);
  uint32_t width = own.i1 - own.i0 + 1, columns = rect.i1 - rect.i0 + 1, lines = rect.j1 - rect.j0 + 1;
  tw_stencil_job run = *job;
  run.first = section_first(n, section) + (rect.j0 - own.j0) * width + rect.i0 - own.i0;
  run.count = columns * lines;
  if (width == 1) run.step = line_step;
  if (width == 1 || lines == 1 || (columns == width && line_step == (ptrdiff_t)width * job->step))
    return tw_stencil_rows(&run);
  return sum_lines(&run, n, rect, line_step);
}

bool tw_stencil_rect(const tw_stencil_job *job, uint32_t depth, tw_patch_rect rect, ptrdiff_t line_step) {
  bool sure = true;
  for (uint32_t section = 0; section < SECTIONS; section++) {
    tw_patch_rect part = section_rect(1u << depth, section);
    if (part.i0 < rect.i0) part.i0 = rect.i0;
    if (part.i1 > rect.i1) part.i1 = rect.i1;
    if (part.j0 < rect.j0) part.j0 = rect.j0;
    if (part.j1 > rect.j1) part.j1 = rect.j1;
    if (part.i0 > part.i1 || part.j0 > part.j1) continue;
    ptrdiff_t place = (ptrdiff_t)(part.j0 - rect.j0) * line_step + (ptrdiff_t)(part.i0 - rect.i0) * job->step;
    tw_stencil_job sums = *job;
    if (job->values) sums.values = job->values + place;
    if (job->normals) sums.normals = job->normals + place;
    if (!sum_section(&sums, 1u << depth, section, part, line_step)) sure = false;
  }
  return sure;
}
