/* Plans the patches of a mesh of quads and evaluates them. */
#include "patch.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "shape.h"
#include "spline.h"

enum { WIDTH_MAX = 4 };

/* ---- planning ------------------------------------------------------------------------------- */

/* Control points grow as patches are met: most take 16. */
typedef struct control_list {
  uint32_t *points;
  uint32_t count, capacity;
} control_list;

static bool append_controls(control_list *list, const uint32_t *points, uint32_t count) {
  uint64_t need = (uint64_t)list->count + count;
  if (need > list->capacity) {
    uint64_t capacity = need + need / 2;
    if (need > UINT32_MAX) return false;
    if (capacity > UINT32_MAX) capacity = UINT32_MAX;
    uint32_t *grown = realloc(list->points, (size_t)capacity * sizeof *grown);
    if (!grown) return false;
    list->points = grown;
    list->capacity = (uint32_t)capacity;
  }
  memcpy(list->points + list->count, points, count * sizeof *points);
  list->count += count;
  return true;
}

static tw_status plan_patch(tw_patches *p, const tw_rules *rules, const uint8_t *smooth, tw_marks *marks,
                            control_list *list, uint32_t quad) {
  tw_patch *patch = &p->patches[quad];
  patch->first_control = list->count;
  uint32_t regular[16], count = 16;
  const uint32_t *points = regular;
  if (p->linear) {
    points = p->base->corner_vertex + 4 * (size_t)quad;
    count = 4;
  } else if (!tw_patch_regular(p->base, 4 * quad, smooth, regular, &patch->reflected)) {
    if (!p->shapes && !(p->shapes = tw_patch_shapes_create(rules))) return TW_NO_MEMORY;
    tw_status status =
        tw_patch_classify(p->shapes, p->base, marks, 4 * quad, p->depth, &patch->shape, &points);
    if (status != TW_OK) return status;
    count = patch->shape->point_count;
  }
  return append_controls(list, points, count) ? TW_OK : TW_NO_MEMORY;
}

static tw_status plan_all(tw_patches *p, const tw_rules *rules) {
  for (uint32_t depth = 0; depth <= p->depth; depth++)
    if (!tw_spline_table(depth)) return TW_NO_MEMORY;
  p->patches = tw_alloc_zero(p->base->face_count, sizeof *p->patches);
  tw_marks marks = {tw_alloc_zero(p->base->vertex_count, sizeof(uint32_t)),
                    tw_alloc_zero(p->base->face_count, 1)};
  uint8_t *smooth = tw_alloc(p->base->vertex_count, 1);
  for (uint32_t v = 0; smooth && v < p->base->vertex_count; v++)
    smooth[v] = tw_vertex_regular_smooth(p->base, v);
  control_list list = {tw_alloc((size_t)p->base->face_count * 16 + 16, sizeof(uint32_t)), 0, 0};
  uint64_t capacity = (uint64_t)p->base->face_count * 16 + 16;
  list.capacity = capacity > UINT32_MAX ? UINT32_MAX : (uint32_t)capacity;
  tw_status status =
      p->patches && smooth && marks.vertices && marks.faces && list.points ? TW_OK : TW_NO_MEMORY;
  for (uint32_t quad = 0; quad < p->base->face_count && status == TW_OK; quad++)
    status = plan_patch(p, rules, smooth, &marks, &list, quad);
  p->controls = list.points;
  free(smooth);
  free(marks.vertices);
  free(marks.faces);
  if (status != TW_OK) return status;
  p->scratch_points = p->shapes ? tw_patch_shapes_scratch(p->shapes) : 0;
  p->size = (p->shapes ? tw_patch_shapes_size(p->shapes) : 0) + p->base->face_count * sizeof *p->patches +
            list.capacity * sizeof *p->controls;
  return TW_OK;
}

tw_status tw_patches_create(tw_patches *patches, const tw_topology *base, const tw_rules *rules,
                            uint32_t depth) {
  memset(patches, 0, sizeof *patches);
  patches->base = base;
  patches->depth = depth;
  patches->linear = rules->linear;
  tw_status status = plan_all(patches, rules);
  if (status != TW_OK) tw_patches_deinit(patches);
  return status;
}

void tw_patches_deinit(tw_patches *patches) {
  tw_patch_shapes_destroy(patches->shapes);
  free(patches->patches);
  free(patches->controls);
  memset(patches, 0, sizeof *patches);
}

/* ---- normals -------------------------------------------------------------------------------- */

static void cross(const float a[3], const float b[3], float out[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

/* As cross and normalise, in double and scaled, for lengths that float cannot square. */
static bool careful_normal(const float a[3], const float b[3], float out[3]) {
  double scale_a = 0, scale_b = 0;
  for (int i = 0; i < 3; i++) {
    scale_a = fmax(scale_a, fabs((double)a[i]));
    scale_b = fmax(scale_b, fabs((double)b[i]));
  }
  if (!(scale_a > 0) || !(scale_b > 0) || !isfinite(scale_a) || !isfinite(scale_b)) return false;
  double u[3], v[3], n[3], square = 0;
  for (int i = 0; i < 3; i++) {
    u[i] = a[i] / scale_a;
    v[i] = b[i] / scale_b;
  }
  for (int i = 0; i < 3; i++) {
    n[i] = u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3];
    square += n[i] * n[i];
  }
  if (!(square > 1e-12)) return false; /* parallel as far as float can tell */
  for (int i = 0; i < 3; i++) out[i] = (float)(n[i] / sqrt(square));
  return true;
}

static bool quick_normal(const float a[3], const float b[3], float out[3]) {
  float n[3];
  cross(a, b, n);
  float square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
  if (!(square > 1e-24f && square < 1e24f)) return false;
  float lengths = (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]) * (b[0] * b[0] + b[1] * b[1] + b[2] * b[2]);
  if (!(square > 1e-6f * lengths)) return false;
  float scale = 1 / sqrtf(square);
  for (int i = 0; i < 3; i++) out[i] = n[i] * scale;
  return true;
}

void tw_normal_from_tangents(const float tangent1[3], const float tangent2[3], const float *const quad[4],
                             float normal[3]) {
  if (quick_normal(tangent1, tangent2, normal) || careful_normal(tangent1, tangent2, normal)) return;
  float diagonal1[3], diagonal2[3];
  for (int i = 0; i < 3; i++) {
    diagonal1[i] = quad[2][i] - quad[0][i];
    diagonal2[i] = quad[3][i] - quad[1][i];
  }
  if (careful_normal(diagonal1, diagonal2, normal)) return;
  normal[0] = normal[2] = 0;
  normal[1] = 1;
}

/* ---- evaluation ----------------------------------------------------------------------------- */

/* Part of a grid on its way to the job's arrays: the local grid's point (i, j) is the job's point
 * (i + column, j + row). */
typedef struct target {
  const tw_patch_job *job;
  tw_patch_rect whole;
  uint32_t column, row;
} target;

static size_t place_of(const target *to, uint32_t i, uint32_t j) {
  size_t width = to->whole.i1 - to->whole.i0 + 1;
  return ((j + to->row - to->whole.j0) * width + (i + to->column - to->whole.i0)) * to->job->stride;
}

/* out[4][width] = the four columns of control points weighted down each. Summed from both ends, so
 * that a mirrored patch gives mirrored points to the last bit. */
static void weigh_columns(const float points[16][WIDTH_MAX], const float weights[4],
                          float out[4][WIDTH_MAX]) {
  for (int k = 0; k < 4; k++)
    for (int c = 0; c < WIDTH_MAX; c++)
      out[k][c] = (weights[0] * points[k][c] + weights[3] * points[12 + k][c]) +
                  (weights[1] * points[4 + k][c] + weights[2] * points[8 + k][c]);
}

static void weigh_row(const float columns[4][WIDTH_MAX], const float weights[4], float out[WIDTH_MAX]) {
  for (int c = 0; c < WIDTH_MAX; c++)
    out[c] = (weights[0] * columns[0][c] + weights[3] * columns[3][c]) +
             (weights[1] * columns[1][c] + weights[2] * columns[2][c]);
}

static void store(float *out, const float value[WIDTH_MAX], const double *origin, uint32_t width) {
  for (uint32_t c = 0; c < width; c++) out[c] = origin ? (float)(origin[c] + (double)value[c]) : value[c];
}

/* A single column: the rows of control points are weighted across once. */
static void spline_column(const target *to, const float (*weights)[4], const float points[16][WIDTH_MAX],
                          const double *origin, tw_patch_rect rect) {
  float rows[4][WIDTH_MAX], value[WIDTH_MAX];
  for (int k = 0; k < 4; k++) weigh_row(points + 4 * k, weights[rect.i0], rows[k]);
  for (uint32_t j = rect.j0; j <= rect.j1; j++) {
    weigh_row((const float(*)[WIDTH_MAX])rows, weights[j], value);
    store(to->job->values + place_of(to, rect.i0, j), value, origin, to->job->width);
  }
}

static inline void spline_line(const float columns[4][WIDTH_MAX], const float (*weights)[4],
                               const double *origin, uint32_t width, tw_patch_rect rect, uint32_t stride,
                               float *out) {
  float value[WIDTH_MAX];
  for (uint32_t i = rect.i0; i <= rect.i1; i++, out += stride) {
    weigh_row(columns, weights[i], value);
    store(out, value, origin, width);
  }
}

/* origin: what the control points are relative to, or NULL. */
static void spline_values(const target *to, const tw_spline *spline, const float points[16][WIDTH_MAX],
                          const double *origin, tw_patch_rect rect) {
  const float(*weights)[4] = to->job->limit ? spline->limit : spline->point;
  if (rect.i0 == rect.i1) {
    spline_column(to, weights, points, origin, rect);
    return;
  }
  for (uint32_t j = rect.j0; j <= rect.j1; j++) {
    float columns[4][WIDTH_MAX], *out = to->job->values + place_of(to, rect.i0, j);
    weigh_columns(points, weights[j], columns);
    const float(*c)[WIDTH_MAX] = (const float(*)[WIDTH_MAX])columns;
    if (to->job->width == 3 && !origin) /* most of all; known numbers let the compiler unroll */
      spline_line(c, weights, NULL, 3, rect, to->job->stride, out);
    else
      spline_line(c, weights, origin, to->job->width, rect, to->job->stride, out);
  }
}

static void spline_normals(const target *to, const tw_spline *spline, const float points[16][WIDTH_MAX],
                           tw_patch_rect rect) {
  const float *quad[4] = {points[5], points[6], points[10], points[9]};
  for (uint32_t j = rect.j0; j <= rect.j1; j++) {
    float along[4][WIDTH_MAX], across[4][WIDTH_MAX], tangent1[WIDTH_MAX], tangent2[WIDTH_MAX];
    weigh_columns(points, spline->limit[j], along);
    weigh_columns(points, spline->derivative[j], across);
    float *out = to->job->normals + place_of(to, rect.i0, j);
    for (uint32_t i = rect.i0; i <= rect.i1; i++, out += to->job->stride) {
      weigh_row((const float(*)[WIDTH_MAX])along, spline->derivative[i], tangent1);
      weigh_row((const float(*)[WIDTH_MAX])across, spline->limit[i], tangent2);
      tw_normal_from_tangents(tangent1, tangent2, quad, out);
    }
  }
}

/* Against one of the points, so that equal values have a derivative of exactly 0. */
static void spline_derivatives(const target *to, const tw_spline *spline, const float points[16][WIDTH_MAX],
                               tw_patch_rect rect) {
  float relative[16][WIDTH_MAX];
  for (int i = 0; i < 16; i++)
    for (int c = 0; c < WIDTH_MAX; c++) relative[i][c] = points[i][c] - points[5][c];
  for (uint32_t j = rect.j0; j <= rect.j1; j++) {
    float along[4][WIDTH_MAX], across[4][WIDTH_MAX];
    weigh_columns((const float(*)[WIDTH_MAX])relative, spline->limit[j], along);
    weigh_columns((const float(*)[WIDTH_MAX])relative, spline->derivative[j], across);
    float *out = to->job->derivatives + place_of(to, rect.i0, j);
    for (uint32_t i = rect.i0; i <= rect.i1; i++, out += to->job->stride) {
      weigh_row((const float(*)[WIDTH_MAX])along, spline->derivative[i], out);
      weigh_row((const float(*)[WIDTH_MAX])across, spline->limit[i], out + WIDTH_MAX);
    }
  }
}

static void evaluate_spline(const target *to, const float points[16][WIDTH_MAX], const double *origin,
                            uint32_t depth, tw_patch_rect rect) {
  const tw_spline *spline = tw_spline_table(depth);
  if (to->job->values) spline_values(to, spline, points, origin, rect);
  if (to->job->normals) spline_normals(to, spline, points, rect);
  if (to->job->derivatives) spline_derivatives(to, spline, points, rect);
}

/* Row (or column) beyond a sharp side: 2 edge - inner. */
static void reflect(float points[16][WIDTH_MAX], int outer, int edge, int inner, int step) {
  for (int k = 0; k < 4; k++)
    for (int c = 0; c < WIDTH_MAX; c++)
      points[outer + k * step][c] = 2 * points[edge + k * step][c] - points[inner + k * step][c];
}

/* Columns first, then whole rows, so that a corner is reflected both ways. */
static void reflect_sides(float points[16][WIDTH_MAX], uint8_t reflected) {
  if (reflected & 8) reflect(points, 0, 1, 2, 4);
  if (reflected & 2) reflect(points, 3, 2, 1, 4);
  if (reflected & 1) reflect(points, 0, 4, 8, 1);
  if (reflected & 4) reflect(points, 12, 8, 4, 1);
}

static void narrow(float out[WIDTH_MAX], const double in[WIDTH_MAX]) {
  for (int c = 0; c < WIDTH_MAX; c++) out[c] = (float)in[c];
}

/* A regular quarter of a shape. Its points are taken relative to one of them, so that float keeps
 * their differences however small the quarter is. */
static void evaluate_part(const target *to, const tw_patch_part *part, const double (*points)[WIDTH_MAX],
                          uint32_t depth, tw_patch_rect rect) {
  const double *origin = points[part->points[5]];
  float relative[16][WIDTH_MAX];
  for (int i = 0; i < 16; i++)
    for (int c = 0; c < WIDTH_MAX; c++) relative[i][c] = (float)(points[part->points[i]][c] - origin[c]);
  reflect_sides(relative, part->reflected);
  evaluate_spline(to, (const float(*)[WIDTH_MAX])relative, origin, depth, rect);
}

/* Along the sides of a quad, at its corner k, from the tangents of the corner's masks. */
static void corner_derivatives(const tw_patch_class *shape, const double (*points)[WIDTH_MAX], uint32_t k,
                               const double tangents[2][WIDTH_MAX], float *out) {
  const double *own = points[k], *after = points[(k + 1) % 4], *before = points[(k + 3) % 4];
  const float(*frame)[2] = shape->frames[k];
  for (int c = 0; c < WIDTH_MAX; c++) {
    double to_next = after[c] - own[c], to_previous = before[c] - own[c];
    if (shape->framed[k]) {
      to_next = (double)frame[0][0] * tangents[0][c] + (double)frame[0][1] * tangents[1][c];
      to_previous = (double)frame[1][0] * tangents[0][c] + (double)frame[1][1] * tangents[1][c];
    }
    double along[4] = {to_next, -to_previous, -to_next, to_previous};
    out[c] = (float)along[k];
    out[WIDTH_MAX + c] = (float)along[(k + 3) % 4];
  }
}

/* Corner k of an irregular quad that needs no further split, at place (i, j) of the grid. */
static void evaluate_corner(const target *to, const tw_patch_class *shape, const double (*points)[WIDTH_MAX],
                            uint32_t k, size_t place) {
  double limit[WIDTH_MAX] = {0}, tangents[2][WIDTH_MAX] = {{0}, {0}};
  for (uint32_t e = 0; e < shape->mask_counts[k]; e++) {
    const tw_limit_entry *entry = &shape->masks[k][e];
    for (int c = 0; c < WIDTH_MAX; c++) {
      /* Masks sum to 1 and 0: against the vertex itself nothing large cancels. */
      double offset = points[entry->vertex][c] - points[k][c];
      limit[c] += (double)entry->position * offset;
      tangents[0][c] += (double)entry->tangent1 * offset;
      tangents[1][c] += (double)entry->tangent2 * offset;
    }
  }
  for (uint32_t c = 0; to->job->values && c < to->job->width; c++)
    to->job->values[place + c] = (float)(to->job->limit ? points[k][c] + limit[c] : points[k][c]);
  if (to->job->derivatives)
    corner_derivatives(shape, points, k, (const double(*)[WIDTH_MAX])tangents, to->job->derivatives + place);
  if (!to->job->normals) return;
  float tangent1[WIDTH_MAX], tangent2[WIDTH_MAX], corners[4][WIDTH_MAX];
  const float *quad[4] = {corners[0], corners[1], corners[2], corners[3]};
  for (int i = 0; i < 4; i++) narrow(corners[i], points[i]);
  narrow(tangent1, tangents[0]);
  narrow(tangent2, tangents[1]);
  tw_normal_from_tangents(tangent1, tangent2, quad, to->job->normals + place);
}

static void evaluate_corners(const target *to, const tw_patch_class *shape, const double (*points)[WIDTH_MAX],
                             tw_patch_rect rect) {
  static const uint32_t columns[4] = {0, 1, 1, 0}, rows[4] = {0, 0, 1, 1};
  for (uint32_t k = 0; k < 4; k++) {
    uint32_t i = columns[k], j = rows[k];
    bool wanted = i >= rect.i0 && i <= rect.i1 && j >= rect.j0 && j <= rect.j1;
    if (wanted) evaluate_corner(to, shape, points, k, place_of(to, i, j));
  }
}

static void refine_shape(const tw_patch_class *shape, const double (*points)[WIDTH_MAX],
                         double (*out)[WIDTH_MAX]) {
  for (uint32_t r = 0; r < shape->refined_count; r++) {
    double sum[WIDTH_MAX] = {0};
    for (uint32_t e = shape->row_offsets[r]; e < shape->row_offsets[r + 1]; e++)
      for (int c = 0; c < WIDTH_MAX; c++) sum[c] += (double)shape->weights[e] * points[shape->columns[e]][c];
    memcpy(out[r], sum, sizeof sum);
  }
}

/* The part of a rectangle in one quarter, in the quarter's own coordinates. The lower half of each
 * direction owns the line between the two. False when nothing is left. */
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

/* Depth falls by one a call: at most TW_LEVEL_MAX deep. scratch: the rows of this depth and below. In
 * double, because deep down points lie so close together that tangents would drown in rounding. */
static void evaluate_shape(target to, const tw_patch_class *shape, const double (*points)[WIDTH_MAX],
                           uint32_t depth, tw_patch_rect rect, double (*scratch)[WIDTH_MAX]) {
  if (depth == 0) {
    evaluate_corners(&to, shape, points, rect);
    return;
  }
  refine_shape(shape, points, scratch);
  const double(*refined)[WIDTH_MAX] = (const double(*)[WIDTH_MAX])scratch;
  uint32_t half = 1u << (depth - 1);
  for (uint32_t k = 0; k < 4; k++) {
    bool right = k == 1 || k == 2, upper = k >= 2;
    tw_patch_rect part_rect;
    if (!quarter(rect, half, right, upper, &part_rect)) continue;
    const tw_patch_part *part = &shape->parts[k];
    target part_to = to;
    part_to.column += right ? half : 0;
    part_to.row += upper ? half : 0;
    if (!part->shape) {
      evaluate_part(&part_to, part, refined, depth - 1, part_rect);
      continue;
    }
    /* The part's points go behind this depth's rows, its own rows behind those. */
    double(*own)[WIDTH_MAX] = scratch + shape->refined_count;
    for (uint32_t i = 0; i < part->shape->point_count; i++)
      memcpy(own[i], refined[part->points[i]], sizeof *own);
    evaluate_shape(part_to, part->shape, (const double(*)[WIDTH_MAX])own, depth - 1, part_rect,
                   own + part->shape->point_count);
  }
}

/* Bilinear interpolation between the corners. */
static void evaluate_linear(const target *to, const float *const quad[4], uint32_t depth,
                            tw_patch_rect rect) {
  float step = 1.0f / (float)(1u << depth);
  uint32_t width = to->job->width;
  for (uint32_t j = rect.j0; j <= rect.j1; j++)
    for (uint32_t i = rect.i0; i <= rect.i1; i++) {
      float u = (float)i * step, v = (float)j * step;
      size_t place = place_of(to, i, j);
      float tangent1[WIDTH_MAX], tangent2[WIDTH_MAX];
      for (uint32_t c = 0; c < width; c++) {
        float low = (1 - u) * quad[0][c] + u * quad[1][c], high = (1 - u) * quad[3][c] + u * quad[2][c];
        if (to->job->values) to->job->values[place + c] = (1 - v) * low + v * high;
        tangent1[c] = (1 - v) * (quad[1][c] - quad[0][c]) + v * (quad[2][c] - quad[3][c]);
        tangent2[c] = high - low;
      }
      if (to->job->normals) tw_normal_from_tangents(tangent1, tangent2, quad, to->job->normals + place);
      if (!to->job->derivatives) continue;
      memcpy(to->job->derivatives + place, tangent1, width * sizeof *tangent1);
      memcpy(to->job->derivatives + place + WIDTH_MAX, tangent2, width * sizeof *tangent2);
    }
}

static void evaluate_irregular(const target *to, const tw_patches *patches, const tw_patch *patch,
                               tw_patch_rect rect) {
  const tw_patch_job *job = to->job;
  double(*points)[WIDTH_MAX] = (double(*)[WIDTH_MAX])job->scratch;
  uint32_t count = patch->shape->point_count;
  const uint32_t *controls = patches->controls + patch->first_control;
  for (uint32_t i = 0; i < count; i++)
    for (uint32_t c = 0; c < WIDTH_MAX; c++)
      points[i][c] = c < job->width ? (double)job->in[(size_t)controls[i] * job->width + c] : 0;
  evaluate_shape(*to, patch->shape, (const double(*)[WIDTH_MAX])points, patches->depth, rect, points + count);
}

static inline void load(float out[WIDTH_MAX], const float *in, uint32_t width) {
  if (width == 3) { /* most of all; known numbers let the compiler unroll */
    for (int c = 0; c < 3; c++) out[c] = in[c];
    out[3] = 0;
    return;
  }
  for (uint32_t c = 0; c < WIDTH_MAX; c++) out[c] = c < width ? in[c] : 0;
}

static void evaluate_regular(const target *to, const tw_patches *patches, const tw_patch *patch,
                             tw_patch_rect rect) {
  const tw_patch_job *job = to->job;
  const uint32_t *controls = patches->controls + patch->first_control;
  float points[16][WIDTH_MAX];
  for (int i = 0; i < 16; i++) load(points[i], job->in + (size_t)controls[i] * job->width, job->width);
  reflect_sides(points, patch->reflected);
  evaluate_spline(to, (const float(*)[WIDTH_MAX])points, NULL, patches->depth, rect);
}

const uint32_t *tw_patch_controls(const tw_patches *patches, uint32_t quad, uint32_t *count) {
  const tw_patch *patch = &patches->patches[quad];
  *count = patches->linear ? 4 : patch->shape ? patch->shape->point_count : 16;
  return patches->controls + patch->first_control;
}

void tw_patch_evaluate(const tw_patches *patches, uint32_t quad, const tw_patch_job *job,
                       tw_patch_rect rect) {
  const tw_patch *patch = &patches->patches[quad];
  target to = {job, rect, 0, 0};
  if (patches->linear) {
    const uint32_t *controls = patches->controls + patch->first_control;
    const float *corners[4];
    for (int k = 0; k < 4; k++) corners[k] = job->in + (size_t)controls[k] * job->width;
    evaluate_linear(&to, corners, patches->depth, rect);
  } else if (patch->shape) {
    evaluate_irregular(&to, patches, patch, rect);
  } else {
    evaluate_regular(&to, patches, patch, rect);
  }
}
