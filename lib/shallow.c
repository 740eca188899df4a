/* Level 2 is a generic step over level 1, whose connectivity is written out here: quad c belongs to corner c
 * of the cage, and vertices and edges are those that refine.h numbers. What is sharp at level 1 are the
 * halves of the cage's sharp edges, and the cage's sharp vertices. */
#include "shallow.h"

#include <stdlib.h>
#include <string.h>

/* ---- numbers -------------------------------------------------------------------------------- */

bool tw_shallow_fits(const tw_topology *cage, const tw_rules *rules, uint32_t level) {
  if (level == 0 || level > 2) return false;
  if (level == 1 || cage->smooth || rules->linear) return true;
  for (uint32_t e = 0; e < cage->edge_count; e++)
    if (tw_is_semi_sharp(cage->edge_sharpness[e])) return false;
  for (uint32_t v = 0; v < cage->vertex_count; v++)
    if (tw_is_semi_sharp(cage->vertex_sharpness[v])) return false;
  return true;
}

static tw_topology next_counts(const tw_topology *t) {
  return (tw_topology){.vertex_count = t->vertex_count + t->edge_count + t->face_count,
                       .edge_count = 2 * t->edge_count + t->corner_count,
                       .face_count = t->corner_count,
                       .corner_count = 4 * t->corner_count,
                       .face_size = 4};
}

tw_topology tw_shallow_counts(const tw_shallow *shallow) {
  tw_topology t = next_counts(&shallow->cage);
  return shallow->level == 1 ? t : next_counts(&t);
}

size_t tw_shallow_kept_count(const tw_shallow *shallow) {
  const tw_topology *t = &shallow->cage;
  if (shallow->normals) return tw_shallow_counts(shallow).vertex_count;
  if (shallow->level == 1) return (size_t)t->vertex_count + t->face_count;
  return (size_t)t->vertex_count + t->edge_count + t->face_count + t->corner_count;
}

/* ---- points of level 2 ---------------------------------------------------------------------- */

/* Level 1 as numbers and points. */
typedef struct level_1 {
  const tw_topology *cage;
  bool linear;
  uint32_t middles, face_points; /* first vertex in the middle of an edge, of a face */
  const float *points, *quad_points;
} level_1;

static level_1 level_1_of(const tw_shallow *shallow, const float *kept) {
  const tw_topology *t = &shallow->cage;
  uint32_t face_points = t->vertex_count + t->edge_count;
  const float *quad_points = kept + 3 * ((size_t)face_points + t->face_count);
  return (level_1){t, shallow->rules.linear, t->vertex_count, face_points, kept, quad_points};
}

static const float *point(const level_1 *l, uint32_t vertex) {
  return l->points + 3 * (size_t)vertex;
}
static const float *quad_point(const level_1 *l, uint32_t quad) {
  return l->quad_points + 3 * (size_t)quad;
}

typedef struct sum {
  float x[3];
} sum;

static inline sum plus(sum s, const float *in, float weight) {
  for (int i = 0; i < 3; i++) s.x[i] += weight * in[i];
  return s;
}

/* The crease mask between two neighbours. */
static inline sum between(const float *own, const float *a, const float *b) {
  sum s = {{0}};
  return plus(plus(plus(s, a, 0.125f), b, 0.125f), own, 0.75f);
}

static sum middle_of_cage_face(const level_1 *l, uint32_t face) {
  const tw_topology *t = l->cage;
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face);
  float n = (float)size, weight = 1 / (n * n);
  sum s = {{0}};
  for (uint32_t i = 0; i < size; i++) s = plus(s, quad_point(l, begin + i), weight);
  for (uint32_t i = 0; i < size; i++)
    s = plus(s, point(l, l->middles + t->corner_edge[begin + (i ? i : size) - 1]), weight);
  return plus(s, point(l, l->face_points + face), (n - 2) / n);
}

/* A smooth edge has two faces. */
static sum middle_of_smooth_edge(const level_1 *l, uint32_t edge) {
  const tw_topology *t = l->cage;
  uint32_t one = t->edge_corner[edge], other = t->sibling[one];
  const float weight = 1.0f / 16;
  sum s = {{0}};
  s = plus(s, quad_point(l, tw_corner_next(t, one)), weight);
  s = plus(s, quad_point(l, one), weight);
  s = plus(s, quad_point(l, tw_corner_next(t, other)), weight);
  s = plus(s, quad_point(l, other), weight);
  s = plus(s, point(l, t->edge_vertices[edge][1]), weight);
  s = plus(s, point(l, l->face_points + tw_corner_face(t, one)), weight);
  s = plus(s, point(l, t->edge_vertices[edge][0]), weight);
  s = plus(s, point(l, l->face_points + tw_corner_face(t, other)), weight);
  return plus(s, point(l, l->middles + edge), 0.5f);
}

static bool is_sharp(const tw_topology *t, uint32_t edge) {
  return !t->smooth && t->edge_sharpness[edge] > 0;
}

static sum middle_of_cage_edge(const level_1 *l, uint32_t edge) {
  const uint32_t *ends = l->cage->edge_vertices[edge];
  if (!is_sharp(l->cage, edge)) return middle_of_smooth_edge(l, edge);
  return between(point(l, l->middles + edge), point(l, ends[0]), point(l, ends[1]));
}

static sum smooth_cage_vertex(const level_1 *l, uint32_t vertex) {
  const tw_topology *t = l->cage;
  uint32_t first = t->fan_offsets[vertex], end = t->fan_offsets[vertex + 1];
  float n = (float)(end - first), weight = 1 / (n * n);
  sum s = {{0}};
  for (uint32_t i = first; i < end; i++) s = plus(s, quad_point(l, t->fan_corners[i]), weight);
  for (uint32_t i = t->ring_offsets[vertex]; i < t->ring_offsets[vertex + 1]; i++)
    s = plus(s, point(l, l->middles + t->ring_edges[i]), weight);
  return plus(s, point(l, vertex), (n - 2) / n);
}

static sum cage_vertex(const level_1 *l, uint32_t vertex) {
  const tw_topology *t = l->cage;
  uint32_t ends[2] = {0, 0};
  tw_vertex_rule rule = t->smooth ? TW_RULE_SMOOTH : tw_vertex_rule_at(t, vertex, ends);
  if (rule <= TW_RULE_DART) return smooth_cage_vertex(l, vertex);
  const uint32_t *ring = t->ring_edges + t->ring_offsets[vertex];
  const float *own = point(l, vertex);
  if (rule == TW_RULE_CREASE)
    return between(own, point(l, l->middles + ring[ends[0]]), point(l, l->middles + ring[ends[1]]));
  return (sum){{own[0], own[1], own[2]}};
}

static void refine_vertices(const level_1 *l, uint32_t begin, uint32_t end, float *restrict out) {
  if (l->linear) {
    memcpy(out, point(l, begin), 3 * (size_t)(end - begin) * sizeof *out);
    return;
  }
  for (uint32_t v = begin; v < end; v++, out += 3) {
    sum s;
    if (v < l->middles)
      s = cage_vertex(l, v);
    else if (v < l->face_points)
      s = middle_of_cage_edge(l, v - l->middles);
    else
      s = middle_of_cage_face(l, v - l->face_points);
    memcpy(out, s.x, sizeof s.x);
  }
}

static inline void store_edge(const float *a, const float *b, const float *left, const float *right,
                              float *restrict out) {
  for (int i = 0; i < 3; i++) out[i] = 0.25f * (a[i] + b[i]) + 0.25f * (left[i] + right[i]);
}
static inline void store_middle(const float *a, const float *b, float *restrict out) {
  for (int i = 0; i < 3; i++) out[i] = 0.5f * (a[i] + b[i]);
}

/* The quad that lies along the half of a corner's edge at `vertex`. */
static uint32_t quad_at(const tw_topology *t, uint32_t corner, uint32_t vertex) {
  return t->corner_vertex[corner] == vertex ? corner : tw_corner_next(t, corner);
}

/* Halves of the cage's edges. */
static void refine_halves(const level_1 *l, uint32_t begin, uint32_t end, float *restrict out) {
  const tw_topology *t = l->cage;
  for (uint32_t half = begin; half < end; half++, out += 3) {
    uint32_t edge = half / 2, vertex = t->edge_vertices[edge][half % 2];
    const float *a = point(l, vertex), *b = point(l, l->middles + edge);
    if (l->linear || is_sharp(t, edge)) {
      store_middle(a, b, out);
      continue;
    }
    uint32_t corner = t->edge_corner[edge];
    store_edge(a, b, quad_point(l, quad_at(t, corner, vertex)),
               quad_point(l, quad_at(t, t->sibling[corner], vertex)), out);
  }
}

/* Edges from the middles of a face's edges to its face point. */
static void refine_spokes(const level_1 *l, uint32_t begin, uint32_t end, float *restrict out) {
  const tw_topology *t = l->cage;
  for (uint32_t c = begin; c < end; c++, out += 3) {
    const float *a = point(l, l->middles + t->corner_edge[c]),
                *b = point(l, l->face_points + tw_corner_face(t, c));
    if (l->linear)
      store_middle(a, b, out);
    else
      store_edge(a, b, quad_point(l, c), quad_point(l, tw_corner_next(t, c)), out);
  }
}

static uint32_t least(uint32_t a, uint32_t b) {
  return a < b ? a : b;
}

static void level_2_points(const level_1 *l, uint32_t first, uint32_t count, float *out) {
  const tw_topology *t = l->cage;
  uint32_t end = first + count, halves = l->face_points + t->face_count, spokes = halves + 2 * t->edge_count,
           quads = spokes + t->corner_count;
  while (first < end) {
    uint32_t stop = end;
    if (first < halves)
      refine_vertices(l, first, stop = least(end, halves), out);
    else if (first < spokes)
      refine_halves(l, first - halves, (stop = least(end, spokes)) - halves, out);
    else if (first < quads)
      refine_spokes(l, first - spokes, (stop = least(end, quads)) - spokes, out);
    else
      memcpy(out, quad_point(l, first - quads), 3 * (size_t)(end - first) * sizeof *out);
    out += 3 * (size_t)(stop - first);
    first = stop;
  }
}

/* ---- points --------------------------------------------------------------------------------- */

static void average_quads(const level_1 *l, float *restrict out) {
  const tw_topology *t = l->cage;
  for (uint32_t f = 0; f < t->face_count; f++) {
    uint32_t begin = tw_face_begin(t, f), end = begin + tw_face_size(t, f), previous = end - 1;
    const float *middle = point(l, l->face_points + f);
    for (uint32_t c = begin; c < end; previous = c++, out += 3) {
      const float *own = point(l, t->corner_vertex[c]), *after = point(l, l->middles + t->corner_edge[c]),
                  *before = point(l, l->middles + t->corner_edge[previous]);
      for (int i = 0; i < 3; i++) out[i] = (own[i] + after[i] + middle[i] + before[i]) / 4;
    }
  }
}

static void keep_parts(const tw_shallow *shallow, const float *points, float *kept) {
  const tw_topology *t = &shallow->cage;
  if (shallow->level == 1) {
    size_t count = 3 * (size_t)t->vertex_count;
    memcpy(kept, points, count * sizeof *kept);
    tw_refine_face_points(t, points, kept + count);
    return;
  }
  tw_refine_values(t, &shallow->rules, 3, points, kept);
  level_1 l = level_1_of(shallow, kept);
  average_quads(&l, kept + (l.quad_points - l.points));
}

tw_status tw_shallow_keep(const tw_shallow *shallow, const float *points, float *kept) {
  if (!shallow->normals) {
    keep_parts(shallow, points, kept);
    return TW_OK;
  }
  tw_shallow parts = *shallow;
  parts.normals = false;
  float *above = tw_alloc(tw_shallow_kept_count(&parts), 3 * sizeof *above);
  if (!above) return TW_NO_MEMORY;
  keep_parts(&parts, points, above);
  tw_shallow_points(&parts, above, 0, tw_shallow_counts(shallow).vertex_count, kept);
  free(above);
  return TW_OK;
}

void tw_shallow_points(const tw_shallow *shallow, const float *kept, uint32_t first, uint32_t count,
                       float *out) {
  const tw_topology *t = &shallow->cage;
  if (shallow->normals) {
    memcpy(out, kept + 3 * (size_t)first, 3 * (size_t)count * sizeof *out);
  } else if (shallow->level == 1) {
    tw_refine_points(t, &shallow->rules, kept, kept + 3 * (size_t)t->vertex_count, first, count, out);
  } else {
    level_1 l = level_1_of(shallow, kept);
    level_2_points(&l, first, count, out);
  }
}

/* ---- faces ---------------------------------------------------------------------------------- */

/* The quad of a corner at level 1, or its four at level 2. */
typedef struct corner_quad {
  uint32_t vertices[4], edges[4];
} corner_quad;

static inline corner_quad quad_of(const tw_topology *t, uint32_t c) {
  uint32_t previous = tw_corner_previous(t, c), edge = t->corner_edge[c], before = t->corner_edge[previous];
  uint32_t vertex = t->corner_vertex[c], middles = t->vertex_count, halves = 2 * t->edge_count;
  return (corner_quad){
      {vertex, middles + edge, middles + t->edge_count + tw_corner_face(t, c), middles + before},
      {2 * edge + (t->edge_vertices[edge][0] != vertex), halves + c, halves + previous,
       2 * before + (t->edge_vertices[before][0] != vertex)}};
}

static void level_1_quads(const tw_topology *t, uint32_t first, uint32_t count, uint32_t *restrict out) {
  for (uint32_t c = first; c < first + count; c++, out += 4) {
    corner_quad q = quad_of(t, c);
    memcpy(out, q.vertices, sizeof q.vertices);
  }
}

static void level_2_quads(const tw_topology *t, uint32_t first, uint32_t count, uint32_t *restrict out) {
  tw_topology parent = next_counts(t);
  uint32_t middles = parent.vertex_count, face_points = middles + parent.edge_count, end = first + count;
  while (first < end) {
    uint32_t c = first / 4, stop = least(end, 4 * c + 4);
    corner_quad q = quad_of(t, c);
    for (; first < stop; first++, out += 4) {
      uint32_t k = first % 4;
      out[0] = q.vertices[k];
      out[1] = middles + q.edges[k];
      out[2] = face_points + c;
      out[3] = middles + q.edges[(k + 3) % 4];
    }
  }
}

void tw_shallow_quads(const tw_shallow *shallow, uint32_t first, uint32_t count, uint32_t *out) {
  if (shallow->level == 1)
    level_1_quads(&shallow->cage, first, count, out);
  else
    level_2_quads(&shallow->cage, first, count, out);
}
