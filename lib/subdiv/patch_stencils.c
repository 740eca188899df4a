/* Makes stencils: a patch's points are linear in its control points, so that weights are the points of
 * patches in which one control point is 1 and all others are 0. */

#include "patch_stencils.h"

#include <math.h>
#include <string.h>

#include "stencil.h"

enum {
  USES_MIN = 8,             /* patches of a class that make up for the time a stencil takes to make */
  BYTES_MAX = 4 << 20,      /* all stencils of one mesh together, which the processor's cache holds */
  ALL_BYTES_MAX = 64 << 20, /* of all that share classes */
  TOGETHER = 4,             /* control points a patch: the components of its points */
  SLOPE_WIDTH = 8,
  SLOPE_SECOND = 4,
  CACHE_LINE = 64
};

/* In place of a class's uses, once they have proved enough. */
static const uint32_t TAKEN = UINT32_MAX;

static uint32_t control_count_of(const tw_patch_class *shape) {
  return (shape->point_count + 1) & ~1u;
}

/* What stencils are made for. scratch_points and splines: of patches of the depth. */
typedef struct stencil_inputs {
  uint32_t depth, scratch_points;
  tw_spline *splines;
  bool limit, normals;
} stencil_inputs;

/* ---- weights -------------------------------------------------------------------------------- */

/* A class as the only patch there is. */
typedef struct basis {
  tw_patch_class *shape;
  const stencil_inputs *inputs;
  uint32_t points, control_count;
  uint32_t *controls; /* [point_count] */
  float *in;          /* [point_count][TOGETHER] */
  double *scratch;
  float *values, *slopes; /* [points][TOGETHER], [points][SLOPE_WIDTH] */
  float *out, *tangents;  /* as in a stencil */
} basis;

/* Vectors of weights that lie across cache lines take twice as long to read. One that begins amid the last
 * block ends up to a block behind it. */
static float *alloc_blocks(const basis *b, tw_arena *arena, size_t width) {
  enum { LINE_FLOATS = CACHE_LINE / sizeof(float) };
  size_t blocks = tw_section_blocks(1u << b->inputs->depth),
         size = b->control_count * width * TW_STENCIL_BLOCK;
  float *weights = tw_arena_alloc(arena, blocks * size + TW_STENCIL_BLOCK + LINE_FLOATS, sizeof *weights);
  size_t over = (uintptr_t)weights % CACHE_LINE / sizeof *weights;
  return weights && over > 0 ? weights + LINE_FLOATS - over : weights;
}

static bool allocate(basis *b, tw_arena *scratch, tw_arena *arena) {
  uint32_t count = b->shape->point_count;
  b->controls = tw_arena_alloc(scratch, count, sizeof *b->controls);
  b->in = tw_arena_alloc(scratch, count, TOGETHER * sizeof *b->in);
  b->scratch = tw_arena_alloc(scratch, b->inputs->scratch_points, TOGETHER * sizeof *b->scratch);
  b->values = tw_arena_alloc(scratch, b->points, TOGETHER * sizeof *b->values);
  b->slopes = tw_arena_alloc(scratch, b->points, SLOPE_WIDTH * sizeof *b->slopes);
  b->out = alloc_blocks(b, arena, 1);
  if (b->inputs->normals) b->tangents = alloc_blocks(b, arena, 2);
  return b->controls && b->in && b->scratch && b->values && b->slopes && b->out &&
         (!b->inputs->normals || b->tangents);
}

/* The patch of the control points that are set. */
static void evaluate(const basis *b) {
  tw_patch patch = {.shape = b->shape};
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

/* Where a control point's weights of a block begin that are `width` for each of its points. */
static size_t block_at(const basis *b, uint32_t place, uint32_t k, size_t width) {
  return ((size_t)(place / TW_STENCIL_BLOCK) * b->control_count + k) * width * TW_STENCIL_BLOCK;
}

/* Weights of control point k, the nth of those together, at a point of the grid. */
static void store_at(const basis *b, uint32_t k, uint32_t nth, uint32_t point, uint32_t place) {
  uint32_t lane = place % TW_STENCIL_BLOCK;
  b->out[block_at(b, place, k, 1) + lane] = b->values[point * TOGETHER + nth];
  if (!b->inputs->normals) return;
  float *tangents = b->tangents + block_at(b, place, k, 2) + lane;
  for (uint32_t t = 0; t < 2; t++)
    tangents[(size_t)t * TW_STENCIL_BLOCK] = b->slopes[point * SLOPE_WIDTH + t * SLOPE_SECOND + nth];
}

/* The same at all points. */
static void store(const basis *b, uint32_t k, uint32_t nth) {
  uint32_t n = 1u << b->inputs->depth;
  for (uint32_t section = 0; section < TW_SECTIONS; section++) {
    tw_patch_rect rect;
    if (!tw_section_rect(n, section, &rect)) continue;
    uint32_t place = tw_section_first(n, section);
    for (uint32_t j = rect.j0; j <= rect.j1; j++)
      for (uint32_t i = rect.i0; i <= rect.i1; i++) store_at(b, k, nth, j * (n + 1) + i, place++);
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

/* Those of one tangent at one point, by a power of two, which loses nothing. */
static void scale_tangent(const basis *b, float *weights) {
  const size_t apart = 2 * (size_t)TW_STENCIL_BLOCK;
  float sum = 0;
  int exponent;
  for (uint32_t k = 0; k < b->control_count; k++) sum += fabsf(weights[k * apart]);
  frexpf(sum, &exponent);
  for (uint32_t k = 0; k < b->control_count; k++) weights[k * apart] = ldexpf(weights[k * apart], -exponent);
}

static void scale_tangents(const basis *b) {
  uint32_t blocks = tw_section_blocks(1u << b->inputs->depth);
  for (uint32_t block = 0; b->inputs->normals && block < blocks; block++)
    for (size_t lane = 0; lane < 2 * (size_t)TW_STENCIL_BLOCK; lane++)
      scale_tangent(b, b->tangents + block_at(b, block * TW_STENCIL_BLOCK, 0, 2) + lane);
}

/* Makes one that lives in the arena. TW_NO_MEMORY. */
static tw_status make_stencil(tw_patch_class *shape, const stencil_inputs *inputs, tw_arena *arena,
                              tw_stencil *out) {
  uint32_t side = (1u << inputs->depth) + 1;
  basis b = {
      .shape = shape, .inputs = inputs, .points = side * side, .control_count = control_count_of(shape)};
  tw_arena *scratch = tw_arena_create();
  tw_status status = scratch && allocate(&b, scratch, arena) ? TW_OK : TW_NO_MEMORY;
  if (status == TW_OK) {
    for (uint32_t i = 0; i < shape->point_count; i++) b.controls[i] = i;
    for (uint32_t k = 0; k < shape->point_count; k += TOGETHER) weigh(&b, k);
    scale_tangents(&b);
    *out = (tw_stencil){b.control_count, b.out, b.tangents};
  }
  tw_arena_destroy(scratch);
  return status;
}

/* ---- of all patches ------------------------------------------------------------------------- */

static size_t bytes_of(const tw_patch_class *shape, const stencil_inputs *inputs) {
  size_t places = (size_t)tw_section_blocks(1u << inputs->depth) * TW_STENCIL_BLOCK;
  return (inputs->normals ? 3 : 1) * sizeof(float) * control_count_of(shape) * places;
}

/* What the other surfaces of a scene have made serves as well; what they have not asked for is made anew. */
static tw_status need_stencil(tw_patch_class *shape, const stencil_inputs *inputs, tw_arena *arena) {
  const tw_stencil **known = &shape->stencils[inputs->limit][inputs->depth];
  if (*known && (!inputs->normals || (*known)->tangents)) return TW_OK;
  if (tw_arena_size(arena) > ALL_BYTES_MAX) return TW_LIMIT;
  tw_stencil *stencil = tw_arena_alloc(arena, 1, sizeof *stencil);
  tw_status status = stencil ? make_stencil(shape, inputs, arena, stencil) : TW_NO_MEMORY;
  if (status == TW_OK) *known = stencil;
  return status;
}

/* Which patches are summed follows from these patches alone: a surface has the same rows whatever others
 * share its classes. */
tw_status tw_patches_sum(tw_patches *patches, tw_patch_shapes *shapes, bool limit, bool normals) {
  if (patches->depth > TW_STENCIL_DEPTH_MAX) return TW_OK;
  const stencil_inputs inputs = {patches->depth, patches->scratch_points, patches->splines, limit, normals};
  size_t bytes = 0;
  tw_patch *first = patches->patches, *end = first + patches->base->face_count;
  for (tw_patch *patch = first; patch < end; patch++)
    if (patch->shape) patch->shape->uses = 0;
  for (tw_patch *patch = first; patch < end; patch++)
    if (patch->shape) patch->shape->uses++;
  for (tw_patch *patch = first; patch < end; patch++) {
    tw_patch_class *shape = patch->shape;
    patch->summed = false;
    if (!shape || shape->point_count > TW_STENCIL_CONTROLS_MAX || shape->uses < USES_MIN) continue;
    if (shape->uses != TAKEN) {
      bytes += bytes_of(shape, &inputs);
      shape->uses = bytes <= BYTES_MAX ? TAKEN : 0;
      tw_status status =
          shape->uses == TAKEN ? need_stencil(shape, &inputs, tw_patch_shapes_stencils(shapes)) : TW_OK;
      if (status != TW_OK) return status;
    }
    patch->summed = shape->uses == TAKEN;
  }
  return TW_OK;
}
