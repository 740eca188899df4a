/* Normals of shallow surfaces that are smooth everywhere: the tangents of limit.h at every vertex, over the
 * ring of neighbours that the cage's connectivity tells. Ring and faces between are passed round the vertex
 * counter-clockwise. */
#include <math.h>

#include "normal_rows.h"
#include "shallow.h"

static const double pi = 3.14159265358979323846;

bool tw_shallow_fits_normals(const tw_topology *cage, const tw_rules *rules) {
  if (!cage->smooth || rules->linear) return false;
  for (uint32_t v = 0; v < cage->vertex_count; v++)
    if (cage->fan_offsets[v + 1] - cage->fan_offsets[v] < 3) return false;
  return true;
}

/* ---- weights -------------------------------------------------------------------------------- */

/* Weights that many vertices have in common: of the neighbours along an edge and across a face. */
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

/* ---- neighbours ----------------------------------------------------------------------------- */

/* A level: the points at the cage's vertices, in the middle of its edges and of its faces and, of level 2, in
 * the middle of level 1's edges, which are the halves of the cage's and the spokes from a corner's edge to
 * the face point, and in that of its faces. */
typedef struct level {
  tw_topology cage;
  const float *vertices, *edges, *faces, *halves, *spokes, *centres;
  weights *known;
} level;

static inline const float *at(const float *points, size_t index) {
  return points + 3 * index;
}

/* The half of a corner's edge that begins and that ends at the end of the corner's side, and at a vertex. An
 * edge runs as the lower of its corners does. */
static inline const float *half_from(const level *l, size_t corner) {
  return at(l->halves, 2 * (size_t)l->cage.corner_edge[corner] + (l->cage.sibling[corner] < corner));
}
static inline const float *half_to(const level *l, size_t corner) {
  return at(l->halves, 2 * (size_t)l->cage.corner_edge[corner] + (l->cage.sibling[corner] > corner));
}
static inline const float *half_at(const level *l, size_t edge, uint32_t vertex) {
  return at(l->halves, 2 * edge + (l->cage.edge_vertices[edge][0] != vertex));
}
static inline const float *edge_at(const level *l, size_t corner) {
  return at(l->edges, l->cage.corner_edge[corner]);
}

/* A corner with those beside it in the face. */
typedef struct place {
  size_t corner, next, previous, face;
} place;

/* Nobody could guess which of three a corner is: places beside it are read from the bits of a number, 1 2 0
 * and 2 0 1, without a branch. */
static inline place nth_of_triangle(size_t face, size_t n) {
  return (place){3 * face + n, 3 * face + (0x9 >> 2 * n & 3), 3 * face + (0x12 >> 2 * n & 3), face};
}

static inline place place_of(const level *l, uint32_t corner) {
  const tw_topology *t = &l->cage;
  if (t->face_size == 3) return nth_of_triangle(corner / 3, corner % 3);
  return (place){corner, tw_corner_next(t, corner), tw_corner_previous(t, corner), tw_corner_face(t, corner)};
}

/* ---- tangents ------------------------------------------------------------------------------- */

/* Tangents at a vertex, and a face there: the vertex itself, the end of an edge, the corner across, the end
 * of the next edge. */
typedef struct row {
  tw_point along[2];
  const float *quad[4];
} row;

static inline tw_point from_to(const float *from, const float *to) {
  return tw_load_point(to) - tw_load_point(from);
}

/* Between four faces: the ends of the edges and, of the face behind each, the corner across. */
static inline row tangents_of_four(const float *own, const float *const edges[4],
                                   const float *const faces[4]) {
  tw_point rising = from_to(faces[2], faces[0]), falling = from_to(faces[1], faces[3]);
  return (row){{4 * from_to(edges[2], edges[0]) + (rising + falling),
                4 * from_to(edges[3], edges[1]) + (rising - falling)},
               {own, edges[0], faces[0], edges[1]}};
}

/* Between three likewise, as differences of what the weights, each against that across, make of the edges. */
static inline row tangents_of_three(const level *l, const float *own, const float *const edges[3],
                                    const float *const faces[3]) {
  float face = l->known->faces[3][1];
  return (row){{4 * from_to(edges[0], edges[1]) + face * from_to(faces[1], faces[2]),
                4 * from_to(edges[0], edges[2]) + face * from_to(faces[1], faces[0])},
               {own, edges[0], faces[0], edges[1]}};
}

/* Between any number, of which the nth is told likewise. In a cage of triangles the corners across tell
 * nothing new: what the weights make of them is a multiple of what they make of the edges. */
typedef struct neighbour {
  const float *edge, *face;
} neighbour;

typedef neighbour neighbour_of(const level *l, uint32_t index, uint32_t n);

static inline __attribute__((always_inline)) row tangents_of_many(const level *l, const float *own,
                                                                  uint32_t index, uint32_t count,
                                                                  bool edges_alone, neighbour_of *find) {
  bool common = count < VALENCES;
  if (common && !l->known->known[count]) learn(l->known, count);
  const float *edges = l->known->edges[common ? count : 0], *faces = l->known->faces[common ? count : 0];
  tw_point centre = tw_load_point(own);
  float edge2 = common ? edges[count - 1] : (float)edge_weight(count - 1, count),
        face2 = common ? faces[count - 1] : (float)face_weight(count - 1, count);
  row r = {{{0}, {0}}, {own, find(l, index, 0).edge, find(l, index, 0).face, find(l, index, 1).edge}};
  for (uint32_t i = 0; i < count; i++) {
    float edge1 = common ? edges[i] : (float)edge_weight(i, count),
          face1 = common ? faces[i] : (float)face_weight(i, count);
    neighbour n = find(l, index, i);
    tw_point to_edge = tw_load_point(n.edge) - centre;
    r.along[0] += edge1 * to_edge;
    r.along[1] += edge2 * to_edge;
    edge2 = edge1;
    if (edges_alone) continue;
    tw_point to_face = tw_load_point(n.face) - centre;
    r.along[0] += face1 * to_face;
    r.along[1] += face2 * to_face;
    face2 = face1;
  }
  return r;
}

/* ---- vertices of the cage ------------------------------------------------------------------- */

/* Where a vertex's neighbours begin: in fan_corners and ring_edges alike, as nothing has a border. */
static inline uint32_t fan_begin(const level *l, uint32_t vertex) {
  return l->cage.fan_offsets[vertex];
}
static inline uint32_t fan_size(const level *l, uint32_t vertex) {
  return l->cage.fan_offsets[vertex + 1] - l->cage.fan_offsets[vertex];
}

static inline neighbour level_1_at_vertex(const level *l, uint32_t vertex, uint32_t n) {
  size_t i = fan_begin(l, vertex) + n;
  return (neighbour){at(l->edges, l->cage.ring_edges[i]),
                     at(l->faces, tw_corner_face(&l->cage, l->cage.fan_corners[i]))};
}
static inline neighbour level_2_at_vertex(const level *l, uint32_t vertex, uint32_t n) {
  size_t i = fan_begin(l, vertex) + n;
  return (neighbour){half_at(l, l->cage.ring_edges[i], vertex), at(l->centres, l->cage.fan_corners[i])};
}

static inline void level_1_vertex(const level *l, uint32_t vertex, row *rows) {
  rows[0] = tangents_of_many(l, at(l->vertices, vertex), vertex, fan_size(l, vertex), l->cage.face_size == 3,
                             level_1_at_vertex);
}
static inline void level_2_vertex(const level *l, uint32_t vertex, row *rows) {
  rows[0] = tangents_of_many(l, at(l->vertices, vertex), vertex, fan_size(l, vertex), l->cage.face_size == 3,
                             level_2_at_vertex);
}

/* ---- faces of the cage ---------------------------------------------------------------------- */

/* The nth corner of a face, and that before it. */
static inline size_t corner_at(const level *l, size_t face, size_t n) {
  return l->cage.face_size == 3 ? 3 * face + n : l->cage.face_offsets[face] + n;
}
static inline size_t corner_before(const level *l, uint32_t face, uint32_t n) {
  return corner_at(l, face, n ? n : tw_face_size(&l->cage, face)) - 1;
}

static inline neighbour level_1_at_face(const level *l, uint32_t face, uint32_t n) {
  return (neighbour){edge_at(l, corner_before(l, face, n)),
                     at(l->vertices, l->cage.corner_vertex[corner_at(l, face, n)])};
}
static inline neighbour level_2_at_face(const level *l, uint32_t face, uint32_t n) {
  return (neighbour){at(l->spokes, corner_before(l, face, n)), at(l->centres, corner_at(l, face, n))};
}

static inline __attribute__((always_inline)) row face_row(const level *l, uint32_t face, neighbour_of *find) {
  const float *own = at(l->faces, face), *edges[3], *faces[3];
  if (l->cage.face_size != 3)
    return tangents_of_many(l, own, face, tw_face_size(&l->cage, face), false, find);
  for (uint32_t i = 0; i < 3; i++) {
    edges[i] = find(l, face, i).edge;
    faces[i] = find(l, face, i).face;
  }
  return tangents_of_three(l, own, edges, faces);
}

static inline void level_1_face(const level *l, uint32_t face, row *rows) {
  rows[0] = face_row(l, face, level_1_at_face);
}
static inline void level_2_face(const level *l, uint32_t face, row *rows) {
  rows[0] = face_row(l, face, level_2_at_face);
}

/* ---- edges of the cage ---------------------------------------------------------------------- */

static inline void level_1_middle(const level *l, uint32_t edge, row *rows) {
  const tw_topology *t = &l->cage;
  place one = place_of(l, t->edge_corner[edge]), other = place_of(l, t->sibling[one.corner]);
  rows[0] = tangents_of_four(
      at(l->edges, edge),
      (const float *const[4]){at(l->vertices, t->edge_vertices[edge][1]), at(l->faces, one.face),
                              at(l->vertices, t->edge_vertices[edge][0]), at(l->faces, other.face)},
      (const float *const[4]){edge_at(l, one.next), edge_at(l, one.previous), edge_at(l, other.next),
                              edge_at(l, other.previous)});
}

static inline void level_2_middle(const level *l, uint32_t edge, row *rows) {
  const tw_topology *t = &l->cage;
  place one = place_of(l, t->edge_corner[edge]), other = place_of(l, t->sibling[one.corner]);
  const float *half = at(l->halves, 2 * (size_t)edge);
  rows[0] = tangents_of_four(
      at(l->edges, edge),
      (const float *const[4]){half + 3, at(l->spokes, one.corner), half, at(l->spokes, other.corner)},
      (const float *const[4]){at(l->centres, one.next), at(l->centres, one.corner),
                              at(l->centres, other.next), at(l->centres, other.corner)});
}

/* Both halves of an edge, each along the quads of its two faces. The first face runs along the edge, the
 * second one against it. */
static inline void level_2_halves(const level *l, uint32_t edge, row *rows) {
  const tw_topology *t = &l->cage;
  place one = place_of(l, t->edge_corner[edge]), other = place_of(l, t->sibling[one.corner]);
  uint32_t start = t->edge_vertices[edge][0], end = t->edge_vertices[edge][1];
  const float *own = at(l->edges, edge), *half = at(l->halves, 2 * (size_t)edge),
              *left = at(l->spokes, one.corner), *right = at(l->spokes, other.corner);
  rows[0] = tangents_of_four(half,
                             (const float *const[4]){own, at(l->centres, one.corner), at(l->vertices, start),
                                                     at(l->centres, other.next)},
                             (const float *const[4]){left, half_at(l, t->corner_edge[one.previous], start),
                                                     half_at(l, t->corner_edge[other.next], start), right});
  rows[1] = tangents_of_four(half + 3,
                             (const float *const[4]){at(l->vertices, end), at(l->centres, one.next), own,
                                                     at(l->centres, other.corner)},
                             (const float *const[4]){half_at(l, t->corner_edge[one.next], end), left, right,
                                                     half_at(l, t->corner_edge[other.previous], end)});
}

/* ---- corners of the cage -------------------------------------------------------------------- */

static inline row spoke_row(const level *l, place p) {
  return tangents_of_four(at(l->spokes, p.corner),
                          (const float *const[4]){at(l->faces, p.face), at(l->centres, p.corner),
                                                  edge_at(l, p.corner), at(l->centres, p.next)},
                          (const float *const[4]){at(l->spokes, p.previous), half_from(l, p.corner),
                                                  half_to(l, p.corner), at(l->spokes, p.next)});
}

static inline row centre_row(const level *l, place p) {
  return tangents_of_four(at(l->centres, p.corner),
                          (const float *const[4]){half_from(l, p.corner), at(l->spokes, p.corner),
                                                  at(l->spokes, p.previous), half_to(l, p.previous)},
                          (const float *const[4]){edge_at(l, p.corner), at(l->faces, p.face),
                                                  edge_at(l, p.previous),
                                                  at(l->vertices, l->cage.corner_vertex[p.corner])});
}

typedef row row_at(const level *l, place p);

/* All of a triangle, or one. */
static inline __attribute__((always_inline)) void corner_rows(const level *l, uint32_t item, row_at *find,
                                                              row *rows) {
  if (l->cage.face_size == 3) {
    for (uint32_t i = 0; i < 3; i++) rows[i] = find(l, nth_of_triangle(item, i));
  } else {
    rows[0] = find(l, place_of(l, item));
  }
}

static inline void level_2_spokes(const level *l, uint32_t item, row *rows) {
  corner_rows(l, item, spoke_row, rows);
}
static inline void level_2_centres(const level *l, uint32_t item, row *rows) {
  corner_rows(l, item, centre_row, rows);
}

/* ---- levels --------------------------------------------------------------------------------- */

/* The rows of an item. */
typedef void rows_of(const level *l, uint32_t item, row *rows);

/* Some rows of a kind. */
typedef struct rows_job {
  const float *points; /* of the kind's first row */
  uint32_t begin, end;
  float *out;
} rows_job;

/* Rows of which each item has `step`, 1 to 3. */
static inline __attribute__((always_inline)) void fill(const level *l, const rows_job *j, rows_of *find,
                                                       uint32_t step) {
  float *restrict out = j->out;
  tw_normal_batch b;
  for (uint32_t first = j->begin - j->begin % step; first < j->end; first += TW_NORMAL_BATCH) {
    uint32_t from = first < j->begin ? j->begin - first : 0,
             to = j->end - first < TW_NORMAL_BATCH ? j->end - first : TW_NORMAL_BATCH;
    for (uint32_t i = 0; i < to; i += step) {
      row rows[3];
      find(l, (first + i) / step, rows);
      for (uint32_t r = 0; r < step; r++) {
        b.along[0][i + r] = rows[r].along[0];
        b.along[1][i + r] = rows[r].along[1];
      }
    }
    bool sure = tw_normal_put_rows(&b, from, to, j->points + 3 * (size_t)first, out);
    for (uint32_t i = from; i < to; i++, out += TW_NORMAL_ROW) {
      row rows[3];
      if (sure) continue;
      find(l, (first + i) / step, rows);
      tw_normal_look_closer(&b, i, rows[(first + i) % step].quad, out + 3);
    }
  }
}

/* What rows are of. */
typedef enum kind_name {
  LEVEL_1_VERTICES,
  LEVEL_1_MIDDLES,
  LEVEL_1_FACES,
  LEVEL_2_VERTICES,
  LEVEL_2_MIDDLES,
  LEVEL_2_FACES,
  HALVES,
  SPOKES,
  CENTRES
} kind_name;

static inline __attribute__((always_inline)) void fill_kind(const level *l, kind_name kind, bool triangles,
                                                            const rows_job *j) {
  uint32_t corners = triangles ? 3 : 1;
  switch (kind) {
  case LEVEL_1_VERTICES: fill(l, j, level_1_vertex, 1); return;
  case LEVEL_1_MIDDLES: fill(l, j, level_1_middle, 1); return;
  case LEVEL_1_FACES: fill(l, j, level_1_face, 1); return;
  case LEVEL_2_VERTICES: fill(l, j, level_2_vertex, 1); return;
  case LEVEL_2_MIDDLES: fill(l, j, level_2_middle, 1); return;
  case LEVEL_2_FACES: fill(l, j, level_2_face, 1); return;
  case HALVES: fill(l, j, level_2_halves, 2); return;
  case SPOKES: fill(l, j, level_2_spokes, corners); return;
  case CENTRES: fill(l, j, level_2_centres, corners); return;
  }
}

/* Of triangles, to which the compiler then binds all that asks for the size of a face. */
static void fill_triangles(const level *level_at, kind_name kind, const rows_job *j) {
  level l = *level_at; /* which no row that is stored can be taken to change */
  l.cage.face_size = 3;
  l.cage.face_offsets = NULL;
  fill_kind(&l, kind, true, j);
}

static void fill_polygons(const level *level_at, kind_name kind, const rows_job *j) {
  level l = *level_at;
  fill_kind(&l, kind, false, j);
}

/* Kinds as they follow each other in a level. */
typedef struct kind {
  kind_name name;
  uint32_t count;
} kind;

void tw_shallow_normals(const tw_shallow *shallow, const float *kept, uint32_t first, uint32_t count,
                        float *out) {
  const tw_topology *t = &shallow->cage;
  uint32_t V = t->vertex_count, E = t->edge_count, F = t->face_count, C = t->corner_count;
  const kind levels[2][6] = {{{LEVEL_1_VERTICES, V}, {LEVEL_1_MIDDLES, E}, {LEVEL_1_FACES, F}},
                             {{LEVEL_2_VERTICES, V},
                              {LEVEL_2_MIDDLES, E},
                              {LEVEL_2_FACES, F},
                              {HALVES, 2 * E},
                              {SPOKES, C},
                              {CENTRES, C}}};
  weights known = {.known = {false}};
  learn(&known, 3);
  level l = {.cage = *t, .vertices = kept, .known = &known};
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
    rows_job j = {kept + 3 * (size_t)begin, first - begin, stop - begin, out};
    (t->face_size == 3 ? fill_triangles : fill_polygons)(&l, k->name, &j);
    out += TW_NORMAL_ROW * (size_t)(stop - first);
    first = stop;
  }
}
