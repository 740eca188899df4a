/* Normals of shallow surfaces that are smooth everywhere: the kernel for every machine, and the choice of the
 * best one. */
#include <math.h>

#include "processor.h"
#include "shallow_normals_kernel.h"

static const double pi = 3.14159265358979323846;

bool tw_shallow_fits_normals(const tw_topology *cage, const tw_rules *rules) {
  if (!cage->smooth || rules->linear) return false;
  for (uint32_t v = 0; v < cage->vertex_count; v++)
    if (cage->fan_offsets[v + 1] - cage->fan_offsets[v] < 3) return false;
  return true;
}

/* ---- weights -------------------------------------------------------------------------------- */

/* Nothing at a quarter turn, where rounding leaves something that points in the same place could not cancel:
 * it would pass for a tangent. */
double tw_shallow_edge_weight(uint32_t i, uint32_t n) {
  uint64_t quarters = 4 * (uint64_t)(i % n);
  return quarters == n || quarters == 3 * (uint64_t)n ? 0 : 4 * cos(2 * pi * (i % n) / n);
}
double tw_shallow_face_weight(uint32_t i, uint32_t n) {
  double step = 2 * pi / n, cosine = cos(step);
  double lambda = (5 + cosine + cos(step / 2) * sqrt(2 * (9 + cosine))) / 16;
  return (cos(i * step) + cos((i + 1) * step)) / (4 * lambda - 1);
}

void tw_shallow_learn(tw_shallow_weights *w, uint32_t n) {
  if (n >= TW_COMMON_VALENCES || w->known[n]) return;
  for (uint32_t i = 0; i < n; i++) {
    w->edges[n][i] = (float)tw_shallow_edge_weight(i, n);
    w->faces[n][i] = (float)tw_shallow_face_weight(i, n);
  }
  w->known[n] = true;
}

/* ---- kernels -------------------------------------------------------------------------------- */

void tw_shallow_fill_anywhere(const tw_shallow_level *level, const tw_shallow_rows *rows) {
  fill_rows(level, rows);
}

static tw_shallow_fill *const kernels[TW_SETS] = {tw_shallow_fill_anywhere,
#ifdef __x86_64__
                                                  tw_shallow_fill_avx2, tw_shallow_fill_avx512
#endif
};

/* ---- levels --------------------------------------------------------------------------------- */

static tw_shallow_level level_of(const tw_shallow *shallow, const float *kept, tw_shallow_weights *weights) {
  const tw_topology *t = &shallow->cage;
  tw_shallow_level l = {.number = shallow->level, .cage = *t, .vertices = kept, .weights = weights};
  l.edges = at(l.vertices, t->vertex_count);
  l.faces = at(l.edges, t->edge_count);
  if (shallow->level == 1) return l;
  if (tw_shallow_is_remade(shallow)) {
    l.centres = at(l.faces, t->face_count) + 1;
    l.remade = at(l.centres, t->corner_count) + 1;
    return l;
  }
  l.halves = at(l.faces, t->face_count);
  l.spokes = at(l.halves, 2 * (size_t)t->edge_count);
  l.centres = at(l.spokes, t->corner_count);
  return l;
}

static void fill_level(tw_shallow_fill *fill_kinds, const tw_shallow *shallow, const float *kept,
                       uint32_t first, uint32_t count, float *out) {
  const tw_topology *t = &shallow->cage;
  const uint32_t counts[TW_SHALLOW_KINDS] = {t->vertex_count,   t->edge_count,   t->face_count,
                                             2 * t->edge_count, t->corner_count, t->corner_count};
  tw_shallow_weights weights = {.known = {false}};
  tw_shallow_learn(&weights, 3);
  tw_shallow_level l = level_of(shallow, kept, &weights);
  tw_shallow_rows rows[TW_SHALLOW_KINDS];
  uint64_t begin = 0, end = (uint64_t)first + count;
  for (uint32_t k = 0; k < TW_SHALLOW_KINDS; begin += counts[k++]) {
    uint64_t start = first > begin ? first : begin, stop = end < begin + counts[k] ? end : begin + counts[k];
    const float *points = !l.remade ? at(kept, begin) : k == TW_SHALLOW_VERTICES ? l.remade : NULL;
    rows[k] = (tw_shallow_rows){.out = out};
    if (start >= stop) continue;
    rows[k] = (tw_shallow_rows){points, (uint32_t)(start - begin), (uint32_t)(stop - begin), out};
    out += NORMAL_ROW * (size_t)(stop - start);
  }
  fill_kinds(&l, rows);
}

void tw_shallow_normals(const tw_shallow *shallow, const float *kept, uint32_t first, uint32_t count,
                        float *out) {
  fill_level(kernels[tw_processor_best()], shallow, kept, first, count, out);
}

bool tw_shallow_normals_by(uint32_t instruction_set, const tw_shallow *shallow, const float *kept,
                           uint32_t first, uint32_t count, float *out) {
  if (!tw_processor_has(instruction_set)) return false;
  fill_level(kernels[instruction_set], shallow, kept, first, count, out);
  return true;
}
