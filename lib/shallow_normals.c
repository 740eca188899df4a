/* Normals of shallow surfaces that are smooth everywhere: the tangents of limit.h at every vertex, over the
 * ring of neighbours that the cage's connectivity tells. Ring and faces between are passed round the vertex
 * counter-clockwise. */
#include <math.h>

#include "normal.h"
#include "shallow.h"

static const double pi = 3.14159265358979323846;

bool tw_shallow_fits_normals(const tw_topology *cage, const tw_rules *rules) {
  if (!cage->smooth || rules->linear) return false;
  for (uint32_t v = 0; v < cage->vertex_count; v++)
    if (cage->fan_offsets[v + 1] - cage->fan_offsets[v] < 3) return false;
  return true;
}

/* ---- tangents ------------------------------------------------------------------------------- */

/* Weights that many vertices have in common. */
enum { VALENCES = 16 };
typedef struct weights {
  bool known[VALENCES];
  float edges[VALENCES][VALENCES], faces[VALENCES][VALENCES];
} weights;

static double edge_weight(uint32_t i, uint32_t n) {
  return 4 * cos(2 * pi * (i % n) / n);
}
static double face_weight(uint32_t i, uint32_t n) {
  double step = 2 * pi / n, cosine = cos(step);
  double lambda = (5 + cosine + cos(step / 2) * sqrt(2 * (9 + cosine))) / 16;
  return (cos(i * step) + cos((i + 1) * step)) / (4 * lambda - 1);
}

static void learn(weights *w, uint32_t n) {
  if (n >= VALENCES || w->known[n]) return;
  for (uint32_t i = 0; i < n; i++) {
    w->edges[n][i] = (float)edge_weight(i, n);
    w->faces[n][i] = (float)face_weight(i, n);
  }
  w->known[n] = true;
}

/* The tangents at a vertex, while its neighbours are added. */
typedef struct tangents {
  const weights *known;
  const float *own, *quad[4]; /* one of the faces, for where there is no tangent plane */
  uint32_t count;
  float along[2][3];
} tangents;

static tangents start(weights *w, const float *own, uint32_t count) {
  learn(w, count);
  return (tangents){.known = w, .own = own, .count = count};
}

/* The ith edge's end and, of the face behind it, the corner opposite. */
static void add(tangents *t, uint32_t i, const float *edge, const float *face) {
  uint32_t n = t->count, before = i > 0 ? i - 1 : n - 1;
  const weights *w = t->known;
  bool known = n < VALENCES;
  float edge1 = known ? w->edges[n][i] : (float)edge_weight(i, n),
        edge2 = known ? w->edges[n][before] : (float)edge_weight(before, n),
        face1 = known ? w->faces[n][i] : (float)face_weight(i, n),
        face2 = known ? w->faces[n][before] : (float)face_weight(before, n);
  for (int c = 0; c < 3; c++) {
    float to_edge = edge[c] - t->own[c], to_face = face[c] - t->own[c];
    t->along[0][c] += edge1 * to_edge + face1 * to_face;
    t->along[1][c] += edge2 * to_edge + face2 * to_face;
  }
  if (i == 0) {
    t->quad[0] = t->own;
    t->quad[1] = edge;
    t->quad[2] = face;
  } else if (i == 1) {
    t->quad[3] = edge;
  }
}

static void finish(const tangents *t, float *normal) {
  tw_normal_from_tangents(t->along[0], t->along[1], t->quad, normal);
}

/* Four edges and faces: most vertices. */
static void regular(const float *own, const float *const edges[4], const float *const faces[4],
                    float *normal) {
  float along[2][3];
  for (int c = 0; c < 3; c++) {
    float rising = faces[0][c] - faces[2][c], falling = faces[3][c] - faces[1][c];
    along[0][c] = 4 * (edges[0][c] - edges[2][c]) + (rising + falling);
    along[1][c] = 4 * (edges[1][c] - edges[3][c]) + (rising - falling);
  }
  const float *quad[4] = {own, edges[0], faces[0], edges[1]};
  tw_normal_from_tangents(along[0], along[1], quad, normal);
}

/* ---- neighbours ----------------------------------------------------------------------------- */

/* A level: its points, and the first of them that are in the middle of an edge and of a face of the level
 * above. */
typedef struct level {
  const tw_topology *cage;
  const float *points;
  uint32_t middles, face_points;
} level;

static const float *middle(const level *l, uint32_t edge) {
  return l->points + 3 * ((size_t)l->middles + edge);
}
static const float *face_point(const level *l, uint32_t face) {
  return l->points + 3 * ((size_t)l->face_points + face);
}
static const float *old_point(const level *l, uint32_t vertex) {
  return l->points + 3 * (size_t)vertex;
}

/* Which half of a corner's edge begins at the corner's vertex. */
static uint32_t half_from(const tw_topology *t, uint32_t corner) {
  uint32_t edge = t->corner_edge[corner];
  return 2 * edge + (t->edge_vertices[edge][0] != t->corner_vertex[corner]);
}

/* Level 1, whose vertices' neighbours are the cage's edges and faces. */

static void level_1_vertex(const level *l, weights *w, uint32_t vertex, float *normal) {
  const tw_topology *t = l->cage;
  uint32_t first = t->fan_offsets[vertex], count = t->fan_offsets[vertex + 1] - first;
  tangents sum = start(w, old_point(l, vertex), count);
  for (uint32_t i = 0; i < count; i++) {
    uint32_t corner = t->fan_corners[first + i];
    add(&sum, i, middle(l, t->corner_edge[corner]), face_point(l, tw_corner_face(t, corner)));
  }
  finish(&sum, normal);
}

static void level_1_middle(const level *l, uint32_t edge, float *normal) {
  const tw_topology *t = l->cage;
  uint32_t one = t->edge_corner[edge], other = t->sibling[one];
  const float *edges[4] = {old_point(l, t->edge_vertices[edge][1]), face_point(l, tw_corner_face(t, one)),
                           old_point(l, t->edge_vertices[edge][0]), face_point(l, tw_corner_face(t, other))};
  const float *faces[4] = {middle(l, t->corner_edge[tw_corner_next(t, one)]),
                           middle(l, t->corner_edge[tw_corner_previous(t, one)]),
                           middle(l, t->corner_edge[tw_corner_next(t, other)]),
                           middle(l, t->corner_edge[tw_corner_previous(t, other)])};
  regular(middle(l, edge), edges, faces, normal);
}

static void level_1_face(const level *l, weights *w, uint32_t face, float *normal) {
  const tw_topology *t = l->cage;
  uint32_t begin = tw_face_begin(t, face), count = tw_face_size(t, face);
  tangents sum = start(w, face_point(l, face), count);
  for (uint32_t i = 0; i < count; i++)
    add(&sum, i, middle(l, t->corner_edge[begin + (i ? i : count) - 1]),
        old_point(l, t->corner_vertex[begin + i]));
  finish(&sum, normal);
}

static void level_1_normal(const level *l, weights *w, uint32_t vertex, float *normal) {
  if (vertex < l->middles)
    level_1_vertex(l, w, vertex, normal);
  else if (vertex < l->face_points)
    level_1_middle(l, vertex - l->middles, normal);
  else
    level_1_face(l, w, vertex - l->face_points, normal);
}

/* Level 2, with the edges and quads of level 1 that refine.h numbers: halves of the cage's edges, spokes. */

static void level_2_vertex(const level *l, weights *w, uint32_t vertex, float *normal) {
  const tw_topology *t = l->cage;
  uint32_t first = t->fan_offsets[vertex], count = t->fan_offsets[vertex + 1] - first;
  tangents sum = start(w, old_point(l, vertex), count);
  for (uint32_t i = 0; i < count; i++) {
    uint32_t corner = t->fan_corners[first + i];
    add(&sum, i, middle(l, half_from(t, corner)), face_point(l, corner));
  }
  finish(&sum, normal);
}

static void level_2_middle(const level *l, uint32_t edge, float *normal) {
  const tw_topology *t = l->cage;
  uint32_t one = t->edge_corner[edge], other = t->sibling[one], spokes = 2 * t->edge_count;
  const float *edges[4] = {middle(l, 2 * edge + 1), middle(l, spokes + one), middle(l, 2 * edge),
                           middle(l, spokes + other)};
  const float *faces[4] = {face_point(l, tw_corner_next(t, one)), face_point(l, one),
                           face_point(l, tw_corner_next(t, other)), face_point(l, other)};
  regular(old_point(l, t->vertex_count + edge), edges, faces, normal);
}

static void level_2_face(const level *l, weights *w, uint32_t face, float *normal) {
  const tw_topology *t = l->cage;
  uint32_t begin = tw_face_begin(t, face), count = tw_face_size(t, face), spokes = 2 * t->edge_count;
  tangents sum = start(w, old_point(l, t->vertex_count + t->edge_count + face), count);
  for (uint32_t i = 0; i < count; i++)
    add(&sum, i, middle(l, spokes + begin + (i ? i : count) - 1), face_point(l, begin + i));
  finish(&sum, normal);
}

/* The quad of a corner of the cage: its sides begin at the cage's vertex, the middle of the corner's edge,
 * the face point, and the middle of the edge before. */
typedef struct quad {
  const float *corners[4], *sides[4], *centre;
} quad;

static quad quad_of(const level *l, uint32_t corner) {
  const tw_topology *t = l->cage;
  uint32_t previous = tw_corner_previous(t, corner), edge = t->corner_edge[corner],
           before = t->corner_edge[previous], middles = t->vertex_count, spokes = 2 * t->edge_count;
  return (quad){{old_point(l, t->corner_vertex[corner]), old_point(l, middles + edge),
                 old_point(l, middles + t->edge_count + tw_corner_face(t, corner)),
                 old_point(l, middles + before)},
                {middle(l, half_from(t, corner)), middle(l, spokes + corner), middle(l, spokes + previous),
                 middle(l, half_from(t, previous) ^ 1)},
                face_point(l, corner)};
}

/* The middle of a side of two quads, which run along it against each other. */
static void level_2_side(const quad *left, uint32_t left_side, const quad *right, uint32_t right_side,
                         float *normal) {
  uint32_t next = (left_side + 1) & 3, previous = (left_side + 3) & 3;
  const float *edges[4] = {left->corners[next], left->centre, left->corners[left_side], right->centre};
  const float *faces[4] = {left->sides[next], left->sides[previous], right->sides[(right_side + 1) & 3],
                           right->sides[(right_side + 3) & 3]};
  regular(left->sides[left_side], edges, faces, normal);
}

static void level_2_half(const level *l, uint32_t half, float *normal) {
  const tw_topology *t = l->cage;
  uint32_t edge = half / 2, one = t->edge_corner[edge], other = t->sibling[one];
  /* The first half begins where `one` does; there `other` ends. */
  bool first = half % 2 == 0;
  quad left = quad_of(l, first ? one : tw_corner_next(t, one)),
       right = quad_of(l, first ? tw_corner_next(t, other) : other);
  level_2_side(&left, first ? 0 : 3, &right, first ? 3 : 0, normal);
}

static void level_2_spoke(const level *l, uint32_t corner, float *normal) {
  quad left = quad_of(l, corner), right = quad_of(l, tw_corner_next(l->cage, corner));
  level_2_side(&left, 1, &right, 2, normal);
}

static void level_2_centre(const level *l, uint32_t corner, float *normal) {
  quad q = quad_of(l, corner);
  const float *faces[4] = {q.corners[1], q.corners[2], q.corners[3], q.corners[0]};
  regular(q.centre, q.sides, faces, normal);
}

static void level_2_normal(const level *l, weights *w, uint32_t vertex, float *normal) {
  const tw_topology *t = l->cage;
  uint32_t spokes = l->middles + 2 * t->edge_count;
  if (vertex < t->vertex_count)
    level_2_vertex(l, w, vertex, normal);
  else if (vertex < t->vertex_count + t->edge_count)
    level_2_middle(l, vertex - t->vertex_count, normal);
  else if (vertex < l->middles)
    level_2_face(l, w, vertex - t->vertex_count - t->edge_count, normal);
  else if (vertex < spokes)
    level_2_half(l, vertex - l->middles, normal);
  else if (vertex < l->face_points)
    level_2_spoke(l, vertex - spokes, normal);
  else
    level_2_centre(l, vertex - l->face_points, normal);
}

void tw_shallow_normals(const tw_shallow *shallow, const float *kept, uint32_t first, uint32_t count,
                        float *out, uint32_t stride) {
  const tw_topology *t = &shallow->cage;
  weights w = {.known = {false}};
  level l = {t, kept, t->vertex_count, t->vertex_count + t->edge_count};
  if (shallow->level == 2) {
    l.middles += t->edge_count + t->face_count;
    l.face_points = l.middles + 2 * t->edge_count + t->corner_count;
  }
  for (uint32_t v = first; v < first + count; v++, out += stride) {
    if (shallow->level == 1)
      level_1_normal(&l, &w, v, out);
    else
      level_2_normal(&l, &w, v, out);
  }
}
