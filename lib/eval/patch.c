/* Makes the patches of a mesh of quads, and evaluates them: regular patches as splines, irregular ones by
 * stencils or by splitting them. */
#include "patch.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "normal.h"
#include "patch_class.h"
#include "stencil.h"

/* ---- planning -------------------------------------------------------------------------------- */

/* The control points of all patches so far. Most patches take 16. */
typedef struct control_list {
  uint32_t *points;
  uint32_t count, capacity;
} control_list;

static tw_status append_controls(control_list *list, const uint32_t *points, uint32_t count) {
  uint64_t need = (uint64_t)list->count + count;
  if (need > list->capacity) {
    uint64_t capacity = need + need / 2;
    if (need > UINT32_MAX) return TW_NO_MEMORY;
    if (capacity > UINT32_MAX) capacity = UINT32_MAX;
    uint32_t *grown = tw_alloc((size_t)capacity, sizeof *grown);
    if (!grown) return TW_NO_MEMORY;
    memcpy(grown, list->points, list->count * sizeof *grown);
    tw_free(list->points);
    list->points = grown;
    list->capacity = (uint32_t)capacity;
  }
  memcpy(list->points + list->count, points, count * sizeof *points);
  list->count += count;
  return TW_OK;
}

/* Patches while they are made. */
typedef struct plan {
  tw_patches *patches;
  tw_patch_classes *classes;
  const tw_parallel_for *parallel;
  tw_collector *collector;
  control_list controls;
} plan;

enum {
  QUADS_AT_ONCE = 4096 /* quads planned between two checks for cancellation */
};

static tw_status classify(plan *p, uint32_t quad, tw_patch_class **class, const uint32_t **points) {
  tw_patches *all = p->patches;
  tw_status status = tw_patch_classify(p->classes, p->collector, 4 * quad, all->depth, class, points);
  if (status == TW_OK) all->scratch_points = tw_patch_classes_scratch(p->classes);
  return status;
}

static tw_status plan_patch(plan *p, uint32_t quad) {
  const tw_topology *base = p->patches->base;
  tw_patch *patch = &p->patches->patches[quad];
  patch->first_control = p->controls.count;
  uint32_t buffer[16], count = 16;
  const uint32_t *points = buffer;
  if (p->patches->linear) {
    points = base->corner_vertex + 4 * (size_t)quad;
    count = 4;
  } else if (!tw_patch_regular(base, 4 * quad, buffer, &patch->reflected)) {
    tw_status status = classify(p, quad, &patch->class, &points);
    if (status != TW_OK) return status;
    count = patch->class->point_count;
  }
  return append_controls(&p->controls, points, count);
}

/* Allocates what the plan needs; on failure the callers free it. TW_NO_MEMORY. */
static tw_status start_plan(plan *p, const tw_rules *rules) {
  tw_patches *all = p->patches;
  const tw_topology *base = all->base;
  all->linear = rules->linear;
  all->splines = tw_spline_tables_create(all->depth);
  all->patches = tw_alloc_zero(base->face_count, sizeof *all->patches);
  p->collector = tw_collector_create(base, rules->chaikin);
  uint64_t capacity = (uint64_t)base->face_count * (all->linear ? 4 : 16) + 16;
  p->controls.capacity = capacity > UINT32_MAX ? UINT32_MAX : (uint32_t)capacity;
  p->controls.points = tw_alloc(p->controls.capacity, sizeof *p->controls.points);
  if (!all->splines || !all->patches || !p->collector || !p->controls.points) return TW_NO_MEMORY;
  return TW_OK;
}

static tw_status plan_all(plan *p, const tw_rules *rules) {
  tw_patches *all = p->patches;
  tw_status status = start_plan(p, rules);
  for (uint32_t quad = 0; status == TW_OK && quad < all->base->face_count; quad++) {
    if (quad % QUADS_AT_ONCE == 0) status = tw_parallel_for_status(p->parallel);
    if (status == TW_OK) status = plan_patch(p, quad);
  }
  all->controls = p->controls.points;
  tw_collector_destroy(p->collector);
  if (status == TW_OK)
    all->size = all->base->face_count * sizeof *all->patches + p->controls.capacity * sizeof *all->controls +
                tw_spline_tables_size(all->depth);
  return status;
}

tw_status tw_patches_create(tw_patches *patches, const tw_topology *base, const tw_rules *rules,
                            uint32_t depth, tw_patch_classes *classes, const tw_parallel_for *parallel) {
  memset(patches, 0, sizeof *patches);
  patches->base = base;
  patches->depth = depth;
  plan p = {.patches = patches, .classes = classes, .parallel = parallel};
  tw_status status = plan_all(&p, rules);
  if (status != TW_OK) tw_patches_deinit(patches);
  return status;
}

void tw_patches_deinit(tw_patches *patches) {
  tw_free(patches->patches);
  tw_free(patches->controls);
  tw_free(patches->splines);
  memset(patches, 0, sizeof *patches);
}

/* ---- what is known of a patch ---------------------------------------------------------------- */

const uint32_t *tw_patch_controls(const tw_patches *patches, uint32_t quad, uint32_t *count) {
  const tw_patch *patch = &patches->patches[quad];
  *count = patch->class ? patch->class->point_count : patches->linear ? 4 : 16;
  return patches->controls + patch->first_control;
}

/* ---- evaluation ------------------------------------------------------------------------------ */

enum { WIDTH_MAX = 4 };

/* Where part of a grid is written in the job's arrays. Point (i, j) of this local grid is point (i + column,
 * j + row) of the patch. */
typedef struct target {
  const tw_patch_job *job;
  const tw_spline *splines; /* by depth */
  tw_patch_rect whole;
  uint32_t column, row;
  const double *origin; /* the place that an irregular patch's points are relative to */
  bool split;           /* split the patch even where its class has a stencil */
} target;

static size_t place_of(const target *to, uint32_t i, uint32_t j) {
  size_t width = to->whole.i1 - to->whole.i0 + 1, height = to->whole.j1 - to->whole.j0 + 1;
  size_t place = (j + to->row - to->whole.j0) * width + (i + to->column - to->whole.i0);
  return (to->job->backwards ? width * height - 1 - place : place) * to->job->stride;
}

/* ---- splines --------------------------------------------------------------------------------- */

/* Evaluates a spline. points: relative to `origin`. */
static void evaluate_spline(const target *to, const tw_point points[16], tw_point origin, uint32_t depth,
                            tw_patch_rect rect) {
  const tw_patch_job *job = to->job;
  const uint32_t n = 1u << depth;
  size_t place = place_of(to, rect.i0, rect.j0);
  ptrdiff_t step = job->backwards ? -(ptrdiff_t)job->stride : (ptrdiff_t)job->stride;
  const tw_spline_job rows = {.spline = &to->splines[depth],
                              .points = points,
                              .origin = origin,
                              .width = job->width,
                              .limit = job->limit,
                              .column = (rect.i0 == 0 || rect.i0 == n) && rect.j0 > 0 && rect.j1 < n,
                              .rect = rect,
                              .values = job->values ? job->values + place : NULL,
                              .normals = job->normals ? job->normals + place : NULL,
                              .derivatives = job->derivatives ? job->derivatives + place : NULL,
                              .step = step,
                              .line_step = step * (ptrdiff_t)(to->whole.i1 - to->whole.i0 + 1)};
  tw_spline_rows(&rows);
}

/* Sets the row (or column) beyond a sharp side to 2 edge - inner. */
static void reflect(tw_point points[16], int outer, int edge, int inner, int step) {
  for (int k = 0; k < 4; k++)
    points[outer + k * step] = 2.0f * points[edge + k * step] - points[inner + k * step];
}

/* Reflects columns first, then whole rows, so that corners are reflected both ways. */
static void reflect_sides(tw_point points[16], uint8_t reflected) {
  if (reflected & 8) reflect(points, 0, 1, 2, 4);
  if (reflected & 2) reflect(points, 3, 2, 1, 4);
  if (reflected & 1) reflect(points, 0, 4, 8, 1);
  if (reflected & 4) reflect(points, 12, 8, 4, 1);
}

static tw_point narrow(const double in[WIDTH_MAX]) {
  return (tw_point){(float)in[0], (float)in[1], (float)in[2], (float)in[3]};
}

/* Evaluates a regular quarter of an irregular patch. Its points are made relative to one of them, so that
 * float keeps their differences however small the quarter is. */
static void evaluate_part(const target *to, const tw_patch_part *part, const double (*points)[WIDTH_MAX],
                          uint32_t depth, tw_patch_rect rect) {
  tw_point origin = {0}, relative[16];
  for (int c = 0; c < WIDTH_MAX; c++) {
    origin[c] = (float)(to->origin[c] + points[part->points[5]][c]);
    double place = (double)origin[c] - to->origin[c];
    for (int i = 0; i < 16; i++) relative[i][c] = (float)(points[part->points[i]][c] - place);
  }
  reflect_sides(relative, part->reflected);
  evaluate_spline(to, relative, origin, depth, rect);
}

/* ---- corners --------------------------------------------------------------------------------- */

/* Derivatives along the sides of a quad at its corner k, from the tangents of the corner's masks. */
static void corner_derivatives(const tw_patch_class *class, const double (*points)[WIDTH_MAX], uint32_t k,
                               const double tangents[2][WIDTH_MAX], float *out) {
  const double *own = points[k], *after = points[(k + 1) % 4], *before = points[(k + 3) % 4];
  const float(*frame)[2] = class->frames[k];
  for (int c = 0; c < WIDTH_MAX; c++) {
    double to_next = after[c] - own[c], to_previous = before[c] - own[c];
    if (class->framed[k]) {
      to_next = (double)frame[0][0] * tangents[0][c] + (double)frame[0][1] * tangents[1][c];
      to_previous = (double)frame[1][0] * tangents[0][c] + (double)frame[1][1] * tangents[1][c];
    }
    double along[4] = {to_next, -to_previous, -to_next, to_previous};
    out[c] = (float)along[k];
    out[WIDTH_MAX + c] = (float)along[(k + 3) % 4];
  }
}

/* Evaluates corner k of an irregular quad of depth 0. place: offset in the job's arrays. */
static void evaluate_corner(const target *to, const tw_patch_class *class, const double (*points)[WIDTH_MAX],
                            uint32_t k, size_t place) {
  double limit[WIDTH_MAX] = {0}, tangents[2][WIDTH_MAX] = {{0}, {0}};
  for (uint32_t e = 0; e < class->mask_counts[k]; e++) {
    const tw_limit_entry *entry = &class->masks[k][e];
    for (int c = 0; c < WIDTH_MAX; c++) {
      /* Masks sum to 1 (position) and 0 (tangents): differences from the vertex itself keep large terms from
       * cancelling. */
      double offset = points[entry->vertex][c] - points[k][c];
      limit[c] += (double)entry->position * offset;
      tangents[0][c] += (double)entry->tangent1 * offset;
      tangents[1][c] += (double)entry->tangent2 * offset;
    }
  }
  for (uint32_t c = 0; to->job->values && c < to->job->width; c++)
    to->job->values[place + c] =
        (float)(to->origin[c] + (to->job->limit ? points[k][c] + limit[c] : points[k][c]));
  const tw_point along[2] = {narrow(tangents[0]), narrow(tangents[1])};
  if (to->job->derivatives && to->job->unframed)
    memcpy(to->job->derivatives + place, along, sizeof along);
  else if (to->job->derivatives)
    corner_derivatives(class, points, k, (const double(*)[WIDTH_MAX])tangents, to->job->derivatives + place);
  if (!to->job->normals) return;
  const tw_point quad[4] = {narrow(points[0]), narrow(points[1]), narrow(points[2]), narrow(points[3])};
  tw_put_normal(along[0], along[1], quad, to->job->normals + place);
}

static void evaluate_corners(const target *to, const tw_patch_class *class, const double (*points)[WIDTH_MAX],
                             tw_patch_rect rect) {
  static const uint32_t columns[4] = {0, 1, 1, 0}, rows[4] = {0, 0, 1, 1};
  for (uint32_t k = 0; k < 4; k++) {
    uint32_t i = columns[k], j = rows[k];
    bool wanted = i >= rect.i0 && i <= rect.i1 && j >= rect.j0 && j <= rect.j1;
    if (wanted) evaluate_corner(to, class, points, k, place_of(to, i, j));
  }
}

/* ---- refining -------------------------------------------------------------------------------- */

static void refine_class(const tw_patch_class *class, const double (*points)[WIDTH_MAX],
                         double (*out)[WIDTH_MAX]) {
  for (uint32_t r = 0; r < class->refined_count; r++) {
    double sum[WIDTH_MAX] = {0};
    for (uint32_t e = class->row_offsets[r]; e < class->row_offsets[r + 1]; e++)
      for (int c = 0; c < WIDTH_MAX; c++) sum[c] += (double)class->weights[e] * points[class->columns[e]][c];
    memcpy(out[r], sum, sizeof sum);
  }
}

/* The part of a rectangle that lies in one quarter, in the quarter's own coordinates. The line between two
 * quarters belongs to the lower one. False when no point lies in the quarter. */
static bool quarter(tw_patch_rect rect, uint32_t half, bool right, bool upper, tw_patch_rect *out) {
  uint32_t i_low = right ? half + 1 : 0, i_high = right ? 2 * half : half;
  uint32_t j_low = upper ? half + 1 : 0, j_high = upper ? 2 * half : half;
  if (rect.i0 > i_high || rect.i1 < i_low || rect.j0 > j_high || rect.j1 < j_low) return false;
  uint32_t di = right ? half : 0, dj = upper ? half : 0;
  out->i0 = (rect.i0 > i_low ? rect.i0 : i_low) - di;
  out->i1 = (rect.i1 < i_high ? rect.i1 : i_high) - di;
  out->j0 = (rect.j0 > j_low ? rect.j0 : j_low) - dj;
  out->j1 = (rect.j1 < j_high ? rect.j1 : j_high) - dj;
  return true;
}

/* ---- stencils -------------------------------------------------------------------------------- */

/* Whether the stencil can give what the job wants. */
static bool has_stencil(const target *to, const tw_stencil *stencil) {
  const tw_patch_job *job = to->job;
  return stencil && !to->split && !job->derivatives && (!job->normals || stencil->tangents);
}

/* ---- splitting ------------------------------------------------------------------------------- */

/* Splits a patch and evaluates its quarters. Recursion is at most TW_LEVEL_MAX deep, as depth falls by one a
 * call. scratch: memory for the rows of this depth and those below. In double: deep down, points lie so close
 * together that float would round tangents away. */
static void evaluate_class(target to, const tw_patch_class *class, const double (*points)[WIDTH_MAX],
                           uint32_t depth, tw_patch_rect rect, double (*scratch)[WIDTH_MAX]) {
  if (depth == 0) {
    evaluate_corners(&to, class, points, rect);
    return;
  }
  refine_class(class, points, scratch);
  const double(*refined)[WIDTH_MAX] = (const double(*)[WIDTH_MAX])scratch;
  uint32_t half = 1u << (depth - 1);
  for (uint32_t k = 0; k < 4; k++) {
    bool right = k == 1 || k == 2, upper = k >= 2;
    tw_patch_rect part_rect;
    if (!quarter(rect, half, right, upper, &part_rect)) continue;
    const tw_patch_part *part = &class->parts[k];
    target part_to = to;
    part_to.column += right ? half : 0;
    part_to.row += upper ? half : 0;
    if (!part->class) {
      evaluate_part(&part_to, part, refined, depth - 1, part_rect);
      continue;
    }
    /* The quarter's points are stored after this depth's rows; its own rows follow them. */
    double(*own)[WIDTH_MAX] = scratch + class->refined_count;
    for (uint32_t i = 0; i < part->class->point_count; i++)
      memcpy(own[i], refined[part->points[i]], sizeof *own);
    evaluate_class(part_to, part->class, (const double(*)[WIDTH_MAX])own, depth - 1, part_rect,
                   own + part->class->point_count);
  }
}

/* ---- one patch ------------------------------------------------------------------------------- */

/* Evaluates an irregular patch with points relative to its first control point. A row's weights sum to 1 up
 * to float rounding only; far from 0 that error would be larger than the differences between points of a
 * small quarter. */
static void evaluate_irregular(target to, const tw_patches *patches, const tw_patch *patch,
                               tw_patch_rect rect) {
  const tw_patch_job *job = to.job;
  double(*points)[WIDTH_MAX] = (double(*)[WIDTH_MAX])job->scratch;
  uint32_t count = patch->class->point_count;
  const uint32_t *controls = patches->controls + patch->first_control;
  double origin[WIDTH_MAX] = {0};
  for (uint32_t c = 0; c < job->width; c++) origin[c] = (double)job->in[(size_t)controls[0] * job->width + c];
  for (uint32_t i = 0; i < count; i++)
    for (uint32_t c = 0; c < WIDTH_MAX; c++)
      points[i][c] = c < job->width ? (double)job->in[(size_t)controls[i] * job->width + c] - origin[c] : 0;
  to.origin = origin;
  evaluate_class(to, patch->class, (const double(*)[WIDTH_MAX])points, patches->depth, rect, points + count);
}

static void evaluate_regular(const target *to, const tw_patches *patches, const tw_patch *patch,
                             tw_patch_rect rect) {
  const tw_patch_job *job = to->job;
  const uint32_t *controls = patches->controls + patch->first_control;
  tw_point points[16];
  for (int i = 0; i < 16; i++)
    points[i] = tw_load_values(job->in + (size_t)controls[i] * job->width, job->width);
  reflect_sides(points, patch->reflected);
  evaluate_spline(to, points, (tw_point){0}, patches->depth, rect);
}

/* Evaluates the quad of four corners. Weights are exact, and summed so that a mirrored quad gives mirrored
 * points to the last bit. */
static void evaluate_linear(const target *to, const tw_patches *patches, const tw_patch *patch,
                            tw_patch_rect rect) {
  const tw_patch_job *job = to->job;
  const uint32_t *controls = patches->controls + patch->first_control;
  tw_point quad[4];
  for (int k = 0; k < 4; k++)
    quad[k] = tw_load_values(job->in + (size_t)controls[k] * job->width, job->width);
  const tw_point sides[4] = {quad[1] - quad[0], quad[2] - quad[3], quad[3] - quad[0], quad[2] - quad[1]};
  const float step = 1.0f / (float)(1u << patches->depth);
  for (uint32_t j = rect.j0; j <= rect.j1; j++)
    for (uint32_t i = rect.i0; i <= rect.i1; i++) {
      size_t place = place_of(to, i, j);
      float u = step * (float)i, v = step * (float)j;
      if (job->values)
        tw_store_values(((1 - u) * (1 - v) * quad[0] + u * v * quad[2]) +
                            (u * (1 - v) * quad[1] + (1 - u) * v * quad[3]),
                        job->width, job->values + place);
      const tw_point tangents[2] = {(1 - v) * sides[0] + v * sides[1], (1 - u) * sides[2] + u * sides[3]};
      if (job->normals) tw_put_normal(tangents[0], tangents[1], quad, job->normals + place);
      if (job->derivatives) memcpy(job->derivatives + place, tangents, sizeof tangents);
    }
}

/* Evaluates an irregular patch by its class's stencil. rect: a corner, the inside of a side, or whole lines
 * of the inside: points that are consecutive in a stencil. Normals for which the stencil is not precise
 * enough are computed again by splitting. */
static void evaluate_by_stencil(const target *to, const tw_patches *patches, const tw_patch *patch,
                                tw_patch_rect rect) {
  const tw_patch_job *job = to->job;
  const uint32_t *controls = patches->controls + patch->first_control;
  uint32_t count = patch->class->point_count, n = 1u << patches->depth;
  size_t place = place_of(to, rect.i0, rect.j0);
  tw_point points[TW_STENCIL_CONTROLS_MAX],
      origin = tw_load_values(job->in + (size_t)controls[0] * job->width, job->width);
  const tw_stencil_job sums = {.stencil = patch->class->stencils[job->limit][patches->depth],
                               .controls = points,
                               .origin = origin,
                               .width = job->width,
                               .values = job->values ? job->values + place : NULL,
                               .normals = job->normals ? job->normals + place : NULL,
                               .step = job->backwards ? -(ptrdiff_t)job->stride : (ptrdiff_t)job->stride};
  for (uint32_t i = 0; i < count; i++)
    points[i] = tw_load_values(job->in + (size_t)controls[i] * job->width, job->width) - origin;
  if (count < sums.stencil->control_count) points[count] = (tw_point){0};
  uint32_t first = tw_stencil_place(n, rect.i0, rect.j0), end = tw_stencil_place(n, rect.i1, rect.j1) + 1;
  assert(end - first == (rect.i1 - rect.i0 + 1) * (rect.j1 - rect.j0 + 1));
  if (tw_stencil_rows(&sums, first, end - first)) return;
  tw_patch_job normals = *job;
  normals.values = NULL;
  evaluate_irregular((target){.job = &normals, .splines = to->splines, .whole = to->whole, .split = true},
                     patches, patch, rect);
}

void tw_patch_evaluate(const tw_patches *patches, uint32_t quad, const tw_patch_job *job,
                       tw_patch_rect rect) {
  const tw_patch *patch = &patches->patches[quad];
  target to = {.job = job, .splines = patches->splines, .whole = rect};
  if (patches->linear) {
    evaluate_linear(&to, patches, patch, rect);
  } else if (patch->class) {
    if (patch->summed && has_stencil(&to, patch->class->stencils[job->limit][patches->depth]))
      evaluate_by_stencil(&to, patches, patch, rect);
    else
      evaluate_irregular(to, patches, patch, rect);
  } else {
    evaluate_regular(&to, patches, patch, rect);
  }
}

/* ---- places ---------------------------------------------------------------------------------- */

tw_patch_rect tw_patch_corner(uint32_t side, uint32_t k) {
  uint32_t i = k == 1 || k == 2 ? side : 0, j = k >= 2 ? side : 0;
  return (tw_patch_rect){i, i, j, j};
}

tw_patch_rect tw_patch_side(uint32_t side, uint32_t k, bool *backwards) {
  uint32_t last = side - 1;
  tw_patch_rect rects[4] = {{1, last, 0, 0}, {side, side, 1, last}, {1, last, side, side}, {0, 0, 1, last}};
  *backwards = k >= 2;
  return rects[k];
}
