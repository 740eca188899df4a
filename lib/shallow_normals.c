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

/* Kinds as they follow each other in a level. */
typedef struct kind {
  tw_shallow_kind name;
  uint32_t count;
} kind;

static void fill_level(tw_shallow_fill *fill_kind_rows, const tw_shallow *shallow, const float *kept,
                       uint32_t first, uint32_t count, float *out) {
  const tw_topology *t = &shallow->cage;
  uint32_t V = t->vertex_count, E = t->edge_count, F = t->face_count, C = t->corner_count;
  const kind levels[2][6] = {{{TW_SHALLOW_VERTICES_1, V}, {TW_SHALLOW_EDGES_1, E}, {TW_SHALLOW_FACES_1, F}},
                             {{TW_SHALLOW_VERTICES_2, V},
                              {TW_SHALLOW_EDGES_2, E},
                              {TW_SHALLOW_FACES_2, F},
                              {TW_SHALLOW_HALVES, 2 * E},
                              {TW_SHALLOW_SPOKES, C},
                              {TW_SHALLOW_CENTRES, C}}};
  tw_shallow_weights weights = {.known = {false}};
  tw_shallow_learn(&weights, 3);
  tw_shallow_level l = {.cage = *t, .vertices = kept, .weights = &weights};
  l.edges = at(l.vertices, V);
  l.faces = at(l.edges, E);
  if (shallow->level == 2) {
    l.halves = at(l.faces, F);
    l.spokes = at(l.halves, 2 * (size_t)E);
    l.centres = at(l.spokes, C);
  }
  uint32_t end = first + count, begin = 0;
  for (const kind *k = levels[shallow->level - 1]; first < end; begin += k++->count) {
    uint32_t stop = end - begin < k->count ? end : begin + k->count;
    if (first >= stop) continue;
    fill_kind_rows(&l, &(tw_shallow_rows){k->name, at(kept, begin), first - begin, stop - begin, out});
    out += NORMAL_ROW * (size_t)(stop - first);
    first = stop;
  }
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
