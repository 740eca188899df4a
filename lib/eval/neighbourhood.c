/* Finds what surrounds a quad: 16 control points where it is regular, else the connectivity and sharpness
 * that distinguish its neighbourhood from others. */
#include "neighbourhood.h"

#include <stdlib.h>
#include <string.h>

/* ---- regular quads --------------------------------------------------------------------------- */

static bool side_is_sharp(const tw_topology *t, uint32_t corner) {
  return tw_is_infinite(t->edge_sharpness[t->corner_edge[corner]]);
}

/* Number of infinitely sharp edges at a vertex; UINT32_MAX when an edge is semi-sharp. */
static uint32_t sharp_edges(const tw_topology *t, uint32_t vertex) {
  uint32_t count = 0;
  for (uint32_t i = t->ring_offsets[vertex]; i < t->ring_offsets[vertex + 1]; i++) {
    float sharpness = t->edge_sharpness[t->ring_edges[i]];
    if (tw_is_semi_sharp(sharpness)) return UINT32_MAX;
    count += sharpness > 0;
  }
  return count;
}

static bool corner_is_regular(const tw_topology *t, uint32_t corner) {
  uint32_t vertex = t->corner_vertex[corner], before = tw_quad_previous(corner);
  bool leading = side_is_sharp(t, corner), trailing = side_is_sharp(t, before);
  float sharpness = t->vertex_sharpness[vertex];
  uint32_t sharp = sharp_edges(t, vertex);
  if (leading && trailing) return tw_is_infinite(sharpness) || (sharp > 2 && sharp != UINT32_MAX);
  if (sharpness > 0) return false;
  if (!leading && !trailing)
    return sharp == 0 && !(t->vertex_flags[vertex] & (TW_VERTEX_BORDER | TW_VERTEX_NONMANIFOLD)) &&
           t->fan_offsets[vertex + 1] - t->fan_offsets[vertex] == 4;
  if (sharp != 2) return false;
  /* Of a crease the quad must be one of two faces on this side: the neighbour across the smooth side has the
   * crease on its own other side. */
  if (trailing) return side_is_sharp(t, tw_quad_next(t->sibling[corner]));
  return side_is_sharp(t, tw_quad_previous(t->sibling[before]));
}

/* Index in the 4 x 4 grid of (x, y), -1 to 2 each, in the frame that is place_in_frame so that it begins at
 * corner `turn`. */
static uint32_t place_in_frame(uint32_t turn, int x, int y) {
  for (; turn > 0; turn--) {
    int old = x;
    x = 1 - y;
    y = old;
  }
  return (uint32_t)((y + 1) * 4 + x + 1);
}

/* Finds which sides are sharp, as bits; false when a corner is not regular. */
static bool find_sharp_sides(const tw_topology *t, const uint32_t corners[4], uint8_t *sharp) {
  *sharp = 0;
  for (uint32_t s = 0; s < 4; s++) {
    if (!corner_is_regular(t, corners[s])) return false;
    if (side_is_sharp(t, corners[s])) *sharp |= (uint8_t)(1u << s);
  }
  return true;
}

bool tw_patch_regular(const tw_topology *topology, uint32_t corner, uint32_t points[16], uint8_t *reflected) {
  const tw_topology *t = topology;
  uint32_t corners[4] = {corner, tw_quad_next(corner), tw_quad_next(tw_quad_next(corner)),
                         tw_quad_previous(corner)};
  uint8_t sharp;
  if (!find_sharp_sides(t, corners, &sharp)) return false;
  for (int i = 0; sharp && i < 16; i++) points[i] = t->corner_vertex[corner];
  for (uint32_t s = 0; s < 4; s++) {
    points[place_in_frame(s, 0, 0)] = t->corner_vertex[corners[s]];
    if (sharp >> s & 1) continue;
    /* The quad across side s; `across` is its corner at the far end of the side. */
    uint32_t across = t->sibling[corners[s]], near = tw_quad_next(across);
    points[place_in_frame(s, 0, -1)] = t->corner_vertex[tw_quad_next(near)];
    points[place_in_frame(s, 1, -1)] = t->corner_vertex[tw_quad_previous(across)];
    if (sharp >> ((s + 3) & 3) & 1) continue;
    /* The quad that touches corner s only. */
    uint32_t diagonal = tw_quad_next(t->sibling[near]);
    points[place_in_frame(s, -1, -1)] = t->corner_vertex[tw_quad_next(tw_quad_next(diagonal))];
  }
  *reflected = sharp;
  return true;
}

/* ---- collecting a neighbourhood -------------------------------------------------------------- */

enum { POINTS_MAX = 1024 /* points, and faces, of one neighbourhood: a vertex of about 500 faces */ };

struct tw_collector {
  const tw_topology *topology;
  uint32_t *vertex_marks; /* [vertex_count], all zero between calls */
  uint8_t *face_marks;    /* [face_count], all zero between calls */
  bool chaikin;
  /* The neighbourhood that is being collected. */
  uint32_t points[POINTS_MAX];
  uint32_t face_begins[POINTS_MAX]; /* first corner of each face */
  uint32_t point_count, face_count;
  tw_neighbourhood found;
  uint32_t key[POINTS_MAX * 10 + 4]; /* the arrays of `found` */
};

tw_collector *tw_collector_create(const tw_topology *topology, bool chaikin) {
  tw_collector *c = tw_alloc(1, sizeof *c);
  if (!c) return NULL;
  c->topology = topology;
  c->chaikin = chaikin;
  c->vertex_marks = tw_alloc_zero(topology->vertex_count, sizeof *c->vertex_marks);
  c->face_marks = tw_alloc_zero(topology->face_count, 1);
  if (c->vertex_marks && c->face_marks) return c;
  tw_collector_destroy(c);
  return NULL;
}

void tw_collector_destroy(tw_collector *collector) {
  if (!collector) return;
  tw_free(collector->vertex_marks);
  tw_free(collector->face_marks);
  tw_free(collector);
}

static bool collect_point(tw_collector *c, uint32_t vertex) {
  if (c->vertex_marks[vertex]) return true;
  if (c->point_count == POINTS_MAX) return false;
  c->points[c->point_count++] = vertex;
  c->vertex_marks[vertex] = c->point_count;
  return true;
}

static bool collect_face(tw_collector *c, uint32_t begin) {
  if (c->face_marks[begin / 4]) return true;
  if (c->face_count == POINTS_MAX) return false;
  c->face_marks[begin / 4] = 1;
  c->face_begins[c->face_count++] = begin;
  for (uint32_t i = 0, corner = begin; i < 4; i++, corner = tw_quad_next(corner))
    if (!collect_point(c, c->topology->corner_vertex[corner])) return false;
  return true;
}

/* Fills points and face_begins; false when there are too many. */
static bool collect(tw_collector *c, uint32_t corner) {
  const tw_topology *t = c->topology;
  c->point_count = c->face_count = 0;
  bool fits = collect_face(c, corner);
  for (uint32_t k = 0, own = corner; k < 4 && fits; k++, own = tw_quad_next(own)) {
    uint32_t vertex = t->corner_vertex[own];
    const uint32_t *fan = t->fan_corners + t->fan_offsets[vertex];
    uint32_t count = t->fan_offsets[vertex + 1] - t->fan_offsets[vertex], place = 0;
    while (fan[place] != own) place++;
    for (uint32_t i = 1; i < count && fits; i++) fits = collect_face(c, fan[(place + i) % count]);
  }
  return fits;
}

static void unmark(tw_collector *c) {
  for (uint32_t i = 0; i < c->point_count; i++) c->vertex_marks[c->points[i]] = 0;
  for (uint32_t i = 0; i < c->face_count; i++) c->face_marks[c->face_begins[i] / 4] = 0;
}

/* Size of the key of a neighbourhood. */
static size_t key_size(uint32_t points, uint32_t faces, bool chaikin) {
  size_t size = faces * (sizeof(uint32_t[4]) + sizeof(float[4])) + sizeof(float[4]);
  return chaikin ? size + points * (sizeof(float) + sizeof(uint32_t)) : size;
}

tw_neighbourhood tw_neighbourhood_lay_out(void *key, uint32_t points, uint32_t faces, bool chaikin) {
  tw_neighbourhood n = {.point_count = points,
                        .face_count = faces,
                        .chaikin = chaikin,
                        .key_size = key_size(points, faces, chaikin)};
  n.quads = key;
  n.sharpness = (float(*)[4])(void *)(n.quads + faces);
  n.vertex_sharpness = (float *)(n.sharpness + faces);
  if (chaikin) {
    n.semi_sum = n.vertex_sharpness + 4;
    n.semi_count = (uint32_t *)(void *)(n.semi_sum + points);
  }
  return n;
}

static uint32_t hash_bytes(const void *bytes, size_t size) {
  const uint32_t *words = bytes; /* keys are made of 32-bit words */
  uint32_t hash = 2166136261u;
  for (size_t i = 0; i < size / sizeof *words; i++) hash = (hash ^ words[i]) * 16777619u;
  return hash ^ hash >> 15;
}

static void note_semi_end(tw_neighbourhood *n, const tw_topology *t, uint32_t local, uint32_t vertex) {
  if (!n->semi_sum) return;
  n->semi_sum[local] = t->semi_sum[vertex];
  n->semi_count[local] = t->semi_count[vertex];
}

/* Writes the key of the collected neighbourhood. */
static void describe(tw_collector *collector) {
  const tw_topology *t = collector->topology;
  tw_neighbourhood *n = &collector->found;
  *n = tw_neighbourhood_lay_out(collector->key, collector->point_count, collector->face_count,
                                collector->chaikin);
  memset(collector->key, 0, n->key_size);
  for (uint32_t f = 0; f < n->face_count; f++) {
    for (uint32_t i = 0, c = collector->face_begins[f]; i < 4; i++, c = tw_quad_next(c))
      n->quads[f][i] = collector->vertex_marks[t->corner_vertex[c]] - 1;
    for (uint32_t i = 0, c = collector->face_begins[f]; i < 4; i++, c = tw_quad_next(c)) {
      uint32_t from = n->quads[f][i], to = n->quads[f][(i + 1) % 4];
      if (from > 3 && to > 3) continue;
      float sharpness = t->edge_sharpness[t->corner_edge[c]];
      n->sharpness[f][i] = sharpness;
      if (!tw_is_semi_sharp(sharpness)) continue;
      note_semi_end(n, t, from, collector->points[from]);
      note_semi_end(n, t, to, collector->points[to]);
    }
  }
  for (uint32_t k = 0; k < 4; k++) n->vertex_sharpness[k] = t->vertex_sharpness[collector->points[k]];
  n->hash = hash_bytes(n->quads, n->key_size) ^ n->point_count;
}

const tw_neighbourhood *tw_collector_find(tw_collector *collector, uint32_t corner, const uint32_t **points) {
  bool fits = collect(collector, corner);
  if (fits) describe(collector);
  unmark(collector);
  *points = collector->points;
  return fits ? &collector->found : NULL;
}
