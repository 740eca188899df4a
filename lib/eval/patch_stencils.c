/* Makes stencils. A patch's points are linear in its control points, so the weights of a control point are
 * the points of a patch in which that control point is 1 and all others are 0. */

#include "patch_stencils.h"

#include <math.h>
#include <string.h>

#include "stencil.h"

enum {
  /* Patches of a class from which a stencil saves more time than making it takes. */
  USES_MIN = 8,
  BYTES_MAX = 4 << 20,      /* all stencils of one mesh together: they fit in the processor's cache */
  ALL_BYTES_MAX = 64 << 20, /* all stencils of all meshes that share classes */
  /* Control points whose weights are computed at once: one in each component of a point. */
  TOGETHER = 4,
  SLOPE_WIDTH = 8,
  SLOPE_SECOND = 4
};

/* By depth: floats from the weights of one control point to those of the next. All points of the grid,
 * rounded up to whole cache lines (16 floats). */
static const uint32_t strides[TW_STENCIL_DEPTH_MAX + 1] = {16, 32, 48, 112, 336};

/* Value of a class's `uses` once it has been chosen to have a stencil. */
static const uint32_t TAKEN = UINT32_MAX;

static uint32_t control_count_of(const tw_patch_class *class) {
  return (class->point_count + 1) & ~1u;
}

/* What stencils are made for. scratch_points and splines: from patches of the depth. */
typedef struct stencil_inputs {
  uint32_t depth, scratch_points;
  tw_spline *splines;
  bool limit, normals;
} stencil_inputs;

/* ---- weights --------------------------------------------------------------------------------- */

/* A patch of the class whose stencil is being made, and its arrays. */
typedef struct basis {
  tw_patch_class *class;
  const stencil_inputs *inputs;
  uint32_t points, control_count, stride;
  uint32_t *controls; /* [point_count] */
  float *in;          /* [point_count][TOGETHER] */
  double *scratch;
  float *values, *slopes; /* [points][TOGETHER], [points][SLOPE_WIDTH] */
  float *out, *tangents;  /* values and tangents as in tw_stencil */
} basis;

static bool allocate(basis *b, tw_arena *scratch, tw_arena *arena) {
  uint32_t count = b->class->point_count;
  b->controls = tw_arena_alloc(scratch, count, sizeof *b->controls);
  b->in = tw_arena_alloc(scratch, count, TOGETHER * sizeof *b->in);
  b->scratch = tw_arena_alloc(scratch, b->inputs->scratch_points, TOGETHER * sizeof *b->scratch);
  b->values = tw_arena_alloc(scratch, b->points, TOGETHER * sizeof *b->values);
  b->slopes = tw_arena_alloc(scratch, b->points, SLOPE_WIDTH * sizeof *b->slopes);
  size_t weights = (size_t)b->stride * b->control_count;
  b->out = tw_arena_alloc(arena, weights, sizeof *b->out);
  if (b->inputs->normals) b->tangents = tw_arena_alloc(arena, weights, 2 * sizeof *b->tangents);
  return b->controls && b->in && b->scratch && b->values && b->slopes && b->out &&
         (!b->inputs->normals || b->tangents);
}

/* Evaluates the patch for the control points that `in` has. */
static void evaluate(const basis *b) {
  tw_patch patch = {.class = b->class};
  tw_patches patches = {
      .depth = b->inputs->depth, .patches = &patch, .controls = b->controls, .splines = b->inputs->splines};
  uint32_t n = 1u << b->inputs->depth;
  tw_patch_job job = {.in = b->in,
                      .width = TOGETHER,
                      .limit = b->inputs->limit,
                      .values = b->values,
                      .stride = TOGETHER,
                      .scratch = b->scratch};
  tw_patch_evaluate(&patches, 0, &job, (tw_patch_rect){0, n, 0, n});
  if (!b->inputs->normals) return;
  job.values = NULL;
  job.derivatives = b->slopes;
  job.unframed = true;
  job.stride = SLOPE_WIDTH;
  tw_patch_evaluate(&patches, 0, &job, (tw_patch_rect){0, n, 0, n});
}

/* Stores the weights of control point k, which is component `nth` of the evaluated points, at all points. */
static void store(const basis *b, size_t k, uint32_t nth) {
  uint32_t n = 1u << b->inputs->depth;
  for (uint32_t point = 0; point < b->points; point++) {
    uint32_t place = tw_stencil_place(n, point % (n + 1), point / (n + 1));
    b->out[k * b->stride + place] = b->values[point * TOGETHER + nth];
    for (size_t t = 0; b->tangents && t < 2; t++)
      b->tangents[(2 * k + t) * b->stride + place] =
          b->slopes[(size_t)point * SLOPE_WIDTH + t * SLOPE_SECOND + nth];
  }
}

/* Computes the weights of control points k to k + TOGETHER - 1. */
static void weigh(const basis *b, uint32_t k) {
  uint32_t count = b->class->point_count, together = count - k < TOGETHER ? count - k : TOGETHER;
  memset(b->in, 0, (size_t)count * TOGETHER * sizeof *b->in);
  for (uint32_t i = 0; i < together; i++) b->in[(k + i) * TOGETHER + i] = 1;
  evaluate(b);
  for (uint32_t i = 0; i < together; i++) store(b, k + i, i);
}

/* Scales the weights of one tangent at one point by a power of two, which is exact, so that their absolute
 * values sum to less than 1. */
static void scale_tangent(const basis *b, float *weights) {
  const size_t apart = 2 * (size_t)b->stride;
  float sum = 0;
  int exponent;
  for (uint32_t k = 0; k < b->control_count; k++) sum += fabsf(weights[k * apart]);
  frexpf(sum, &exponent);
  for (uint32_t k = 0; k < b->control_count; k++) weights[k * apart] = ldexpf(weights[k * apart], -exponent);
}

static void scale_tangents(const basis *b) {
  for (size_t at = 0; b->tangents && at < 2 * (size_t)b->stride; at++) scale_tangent(b, b->tangents + at);
}

/* Makes a stencil in the arena. TW_NO_MEMORY. */
static tw_status make_stencil(tw_patch_class *class, const stencil_inputs *inputs, tw_arena *arena,
                              tw_stencil *out) {
  uint32_t side = (1u << inputs->depth) + 1;
  basis b = {.class = class,
             .inputs = inputs,
             .points = side * side,
             .control_count = control_count_of(class),
             .stride = strides[inputs->depth]};
  tw_arena *scratch = tw_arena_create();
  tw_status status = scratch && allocate(&b, scratch, arena) ? TW_OK : TW_NO_MEMORY;
  if (status == TW_OK) {
    for (uint32_t i = 0; i < class->point_count; i++) b.controls[i] = i;
    for (uint32_t k = 0; k < class->point_count; k += TOGETHER) weigh(&b, k);
    scale_tangents(&b);
    *out = (tw_stencil){b.control_count, b.stride, b.out, b.tangents};
  }
  tw_arena_destroy(scratch);
  return status;
}

/* ---- of all patches -------------------------------------------------------------------------- */

static size_t bytes_of(const tw_patch_class *class, const stencil_inputs *inputs) {
  return (inputs->normals ? 3 : 1) * sizeof(float) * control_count_of(class) * strides[inputs->depth];
}

/* Makes the stencil that a class needs, unless another surface that shares the class has made it. A stencil
 * without the tangents that are needed now is made again with them. */
static tw_status need_stencil(tw_patch_class *class, const stencil_inputs *inputs, tw_arena *arena) {
  const tw_stencil **known = &class->stencils[inputs->limit][inputs->depth];
  if (*known && (!inputs->normals || (*known)->tangents)) return TW_OK;
  if (tw_arena_size(arena) > ALL_BYTES_MAX) return TW_LIMIT;
  tw_stencil *stencil = tw_arena_alloc(arena, 1, sizeof *stencil);
  tw_status status = stencil ? make_stencil(class, inputs, arena, stencil) : TW_NO_MEMORY;
  if (status == TW_OK) *known = stencil;
  return status;
}

/* Which patches are summed depends on these patches alone, so that a surface has the same rows whatever other
 * surfaces share its classes. */
tw_status tw_patches_sum(tw_patches *patches, tw_patch_classes *classes, bool limit, bool normals) {
  if (patches->depth > TW_STENCIL_DEPTH_MAX) return TW_OK;
  const stencil_inputs inputs = {patches->depth, patches->scratch_points, patches->splines, limit, normals};
  size_t bytes = 0;
  tw_patch *first = patches->patches, *end = first + patches->base->face_count;
  for (tw_patch *patch = first; patch < end; patch++)
    if (patch->class) patch->class->uses = 0;
  for (tw_patch *patch = first; patch < end; patch++)
    if (patch->class) patch->class->uses++;
  for (tw_patch *patch = first; patch < end; patch++) {
    tw_patch_class *class = patch->class;
    patch->summed = false;
    if (!class || class->point_count > TW_STENCIL_CONTROLS_MAX || class->uses < USES_MIN) continue;
    if (class->uses != TAKEN) {
      bytes += bytes_of(class, &inputs);
      class->uses = bytes <= BYTES_MAX ? TAKEN : 0;
      tw_status status =
          class->uses == TAKEN ? need_stencil(class, &inputs, tw_patch_classes_stencils(classes)) : TW_OK;
      if (status != TW_OK) return status;
    }
    patch->summed = class->uses == TAKEN;
  }
  return TW_OK;
}
