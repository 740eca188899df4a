/* Level 2 is a generic step over level 1, whose connectivity is written out here: quad c belongs to corner c
 * of the cage, and vertices and edges are those that refine.h numbers. What is sharp at level 1 are the
 * halves of the cage's sharp edges, and the cage's sharp vertices. */
#include "shallow.h"

#include <string.h>

/* ---- numbers -------------------------------------------------------------------------------- */

/* Each step takes 1 away, or more. */
static bool outlasts(float sharpness, uint32_t steps) {
  return tw_is_semi_sharp(sharpness) && sharpness > (float)steps;
}

bool tw_shallow_fits(const tw_topology *mesh, uint32_t steps, const tw_rules *rules, uint32_t level) {
  if (level == 0 || level > 2) return false;
  if (level == 1 || mesh->smooth || rules->linear) return true;
  for (uint32_t e = 0; e < mesh->edge_count; e++)
    if (outlasts(mesh->edge_sharpness[e], steps)) return false;
  for (uint32_t v = 0; v < mesh->vertex_count; v++)
    if (outlasts(mesh->vertex_sharpness[v], steps)) return false;
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

bool tw_shallow_is_remade(const tw_shallow *shallow) {
  enum { FACES_LEAST = 16 }; /* the most that a vector has lanes */
  const tw_topology *t = &shallow->cage;
  return shallow->normals && shallow->level == 2 && t->face_size == 3 && t->face_count >= FACES_LEAST &&
         t->corner_count <= UINT32_MAX / 3;
}

size_t tw_shallow_kept_count(const tw_shallow *shallow) {
  const tw_topology *t = &shallow->cage;
  bool remade = tw_shallow_is_remade(shallow);
  if (shallow->normals && !remade) return tw_shallow_counts(shallow).vertex_count;
  if (shallow->level == 1) return (size_t)t->vertex_count + t->face_count;
  return (remade ? 2 : 1) * (size_t)t->vertex_count + t->edge_count + t->face_count + t->corner_count;
}

size_t tw_shallow_kept_size(const tw_shallow *shallow) {
  return 3 * tw_shallow_kept_count(shallow) + (shallow->normals ? 8 : 2);
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

/* Edges lie anywhere where the cage's faces come in any order: asks for that of a corner farther on. */
enum { AHEAD = 24 };

static void level_2_quads(const tw_topology *t, uint32_t first, uint32_t count, uint32_t *restrict out) {
  tw_topology parent = next_counts(t);
  uint32_t middles = parent.vertex_count, face_points = middles + parent.edge_count, end = first + count;
  while (first < end) {
    uint32_t c = first / 4, stop = end < 4 * c + 4 ? end : 4 * c + 4;
    corner_quad q = quad_of(t, c);
    if (t->corner_count - c > AHEAD) __builtin_prefetch(t->edge_vertices + t->corner_edge[c + AHEAD]);
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
