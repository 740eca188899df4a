/* What tangents of level 2 of a cage of triangles look at, LANES faces or edges at a time. First it is found
 * where that is, and asked for; a block later it is there. */
#ifndef TWEEND_SHALLOW_TRIANGLES_H
#define TWEEND_SHALLOW_TRIANGLES_H

#include "shallow_lanes.h"

/* Offsets of what the corners of LANES triangles name. */
typedef struct triples {
  uint32_t edges[TRIPLES], vertices[TRIPLES], from[TRIPLES], to[TRIPLES];
} triples;

/* Corners on one side of LANES edges: those beside them in their faces, offsets of what is theirs. */
typedef struct corners {
  uint32_t next[LANES], previous[LANES], own_at[LANES], next_at[LANES];
} corners;

/* Of what is about LANES edges: both sides, both ends by turns, what is beside in the four quads. */
typedef struct pairs {
  corners sides[2];
  uint32_t ends[2 * LANES], beside[4][LANES];
} pairs;

typedef union offsets {
  triples faces;
  pairs edges;
} offsets;

/* Where that is which LANES items from one on look at, which is asked for; and the tangents of their rows. */
typedef void find_from(const tw_shallow_level *l, uint32_t item, offsets *at);
typedef void tangents_from(const tw_shallow_level *l, uint32_t item, const offsets *at, tangents *rows);

/* ---- faces ---------------------------------------------------------------------------------- */

static inline void find_edges(const tw_topology *t, size_t first, triples *out) {
  for (size_t i = 0; i < TRIPLES; i += LANES)
    put_indices(out->edges + i, 3 * load_indices(t->corner_edge + first + i));
}
static inline void find_vertices(const tw_topology *t, size_t first, triples *out) {
  for (size_t i = 0; i < TRIPLES; i += LANES)
    put_indices(out->vertices + i, 3 * load_indices(t->corner_vertex + first + i));
}
/* The half of a corner's edge that begins and that ends at the end of the corner's side. An edge runs as the
 * lower of its corners does. */
static inline void find_halves(const tw_topology *t, size_t first, triples *out) {
  for (size_t i = 0; i < TRIPLES; i += LANES) {
    indices whole = 6 * load_indices(t->corner_edge + first + i);
    indices against = 3 & (indices)(load_indices(t->sibling + first + i) < from_on((uint32_t)(first + i)));
    put_indices(out->from + i, whole + against);
    put_indices(out->to + i, whole + (3 - against));
  }
}

/* The points that three offsets of each name. */
static inline __attribute__((always_inline)) void three_at(const float *base, const uint32_t *offsets,
                                                           coordinates points[3]) {
  for (size_t i = 0; i < 3; i++) points[i] = points_at(base, offsets + i, 3);
}
static inline __attribute__((always_inline)) void three_by(const float *base, coordinates points[3]) {
  for (size_t i = 0; i < 3; i++) points[i] = points_by(base + 3 * i, 9);
}

/* What rows of faces look at lies in turn. */
static inline void find_in_turn(const tw_shallow_level *l, uint32_t face, offsets *at) {
  size_t first = 3 * (size_t)face;
  fetch_on(l->spokes + 3 * first, 3 * TRIPLES);
  fetch_on(l->centres + 3 * first, 3 * TRIPLES);
  fetch_on(l->faces + first, TRIPLES);
  (void)at;
}

static inline __attribute__((always_inline)) void faces_2(const tw_shallow_level *l, uint32_t face,
                                                          const offsets *at, tangents *rows) {
  coordinates spokes[3], centres[3];
  (void)at;
  three_by(l->spokes + 9 * (size_t)face, spokes);
  three_by(l->centres + 9 * (size_t)face, centres);
  const coordinates before[3] = {spokes[2], spokes[0], spokes[1]};
  between_three(l->weights->faces[3][1], before, centres, rows);
}

/* What is about both the spokes and the quads of the faces. */
static inline __attribute__((always_inline)) void find_corners(const tw_shallow_level *l, uint32_t face,
                                                               offsets *at) {
  size_t first = 3 * (size_t)face;
  fetch_on(l->cage.corner_edge + first, TRIPLES);
  fetch_on(l->cage.corner_vertex + first, TRIPLES);
  fetch_on(l->cage.sibling + first, TRIPLES);
  fetch_on(l->spokes + 3 * first, 3 * TRIPLES);
  fetch_on(l->centres + 3 * first, 3 * TRIPLES);
  fetch_on(l->faces + first, TRIPLES);
  find_edges(&l->cage, first, &at->faces);
  find_halves(&l->cage, first, &at->faces);
  find_vertices(&l->cage, first, &at->faces);
  fetch(l->edges, at->faces.edges, TRIPLES);
  fetch(l->halves, at->faces.from, TRIPLES);
}

typedef struct face_points {
  coordinates own, spokes[3], edges[3], from[3], to[3];
} face_points;

static inline __attribute__((always_inline)) void load_faces(const tw_shallow_level *l, uint32_t face,
                                                             const offsets *at, face_points *p) {
  p->own = points_by(l->faces + 3 * (size_t)face, 3);
  three_by(l->spokes + 9 * (size_t)face, p->spokes);
  three_at(l->edges, at->faces.edges, p->edges);
  three_at(l->halves, at->faces.from, p->from);
  three_at(l->halves, at->faces.to, p->to);
}

static inline __attribute__((always_inline)) void spoke_rows(const tw_shallow_level *l, uint32_t face,
                                                             const face_points *p, tangents *rows) {
  coordinates centres[3];
  three_by(l->centres + 9 * (size_t)face, centres);
  for (size_t i = 0; i < 3; i++) {
    size_t next = (i + 1) % 3, previous = (i + 2) % 3;
    between_four(
        (const coordinates *const[4]){&p->own, &centres[i], &p->edges[i], &centres[next]},
        (const coordinates *const[4]){&p->spokes[previous], &p->from[i], &p->to[i], &p->spokes[next]},
        rows + i);
  }
}

static inline __attribute__((always_inline)) void centre_rows(const tw_shallow_level *l, const offsets *at,
                                                              const face_points *p, tangents *rows) {
  coordinates vertices[3];
  three_at(l->vertices, at->faces.vertices, vertices);
  for (size_t i = 0; i < 3; i++) {
    size_t previous = (i + 2) % 3;
    between_four(
        (const coordinates *const[4]){&p->from[i], &p->spokes[i], &p->spokes[previous], &p->to[previous]},
        (const coordinates *const[4]){&p->edges[i], &p->own, &p->edges[previous], &vertices[i]}, rows + i);
  }
}

static inline __attribute__((always_inline)) void spokes_2(const tw_shallow_level *l, uint32_t face,
                                                           const offsets *at, tangents *rows) {
  face_points p;
  load_faces(l, face, at, &p);
  spoke_rows(l, face, &p, rows);
}
static inline __attribute__((always_inline)) void centres_2(const tw_shallow_level *l, uint32_t face,
                                                            const offsets *at, tangents *rows) {
  face_points p;
  load_faces(l, face, at, &p);
  centre_rows(l, at, &p, rows);
}
static inline __attribute__((always_inline)) void corners_2(const tw_shallow_level *l, uint32_t face,
                                                            const offsets *at, tangents *rows) {
  face_points p;
  load_faces(l, face, at, &p);
  spoke_rows(l, face, &p, rows);
  centre_rows(l, at, &p, rows + 3);
}

/* ---- edges ---------------------------------------------------------------------------------- */

static inline void find_beside(indices own, corners *out) {
  indices first = own / 3 * 3, next = own + 1 - (3 & (indices)(own - first == 2)),
          previous = own - 1 + (3 & (indices)(own == first));
  put_indices(out->next, next);
  put_indices(out->previous, previous);
  put_indices(out->own_at, 3 * own);
  put_indices(out->next_at, 3 * next);
}

/* What is on the other side the first corner tells: it is asked for some edges ahead. */
static inline void find_sides(const tw_topology *t, uint32_t edge, corners sides[2]) {
  const uint32_t *one = t->edge_corner + edge;
  uint32_t other[LANES];
  for (size_t k = 0; k < LANES; k++) other[k] = t->sibling[one[k]];
  if (t->edge_count - edge >= 2 * LANES)
    for (size_t k = LANES; k < 2 * LANES; k++) __builtin_prefetch(t->sibling + one[k]);
  find_beside(load_indices(one), &sides[0]);
  find_beside(load_indices(other), &sides[1]);
}

/* Ends of edges, of each first the one, then the other. */
static inline void find_ends(const tw_topology *t, uint32_t edge, uint32_t out[2 * LANES]) {
  put_indices(out, 3 * load_indices(t->edge_vertices[edge]));
  put_indices(out + LANES, 3 * load_indices(t->edge_vertices[edge] + LANES));
}

/* The halves, at some vertices, of the edges at some corners. */
static inline void find_halves_at(const tw_topology *t, const uint32_t *corners, const uint32_t *vertices,
                                  uint32_t *out) {
  for (size_t k = 0; k < LANES; k++) {
    uint32_t edge = t->corner_edge[corners[k]], far = 3 * t->edge_vertices[edge][0] != vertices[2 * k];
    out[k] = 6 * edge + 3 * far;
  }
}

static inline __attribute__((always_inline)) void find_middles(const tw_shallow_level *l, uint32_t edge,
                                                               offsets *at) {
  pairs *p = &at->edges;
  fetch_on(l->cage.edge_corner + edge, LANES);
  fetch_on(l->cage.edge_vertices + edge, 2 * LANES);
  fetch_on(l->edges + 3 * (size_t)edge, 3 * LANES);
  fetch_on(l->halves + 6 * (size_t)edge, 6 * LANES);
  find_sides(&l->cage, edge, p->sides);
  for (size_t s = 0; s < 2; s++) {
    fetch(l->spokes, p->sides[s].own_at, LANES);
    fetch(l->centres, p->sides[s].own_at, LANES);
  }
}

static inline __attribute__((always_inline)) void find_both_halves(const tw_shallow_level *l, uint32_t edge,
                                                                   offsets *at) {
  const tw_topology *t = &l->cage;
  pairs *p = &at->edges;
  find_middles(l, edge, at);
  find_ends(t, edge, p->ends);
  find_halves_at(t, p->sides[0].previous, p->ends, p->beside[0]);
  find_halves_at(t, p->sides[1].next, p->ends, p->beside[1]);
  find_halves_at(t, p->sides[0].next, p->ends + 1, p->beside[2]);
  find_halves_at(t, p->sides[1].previous, p->ends + 1, p->beside[3]);
}

/* What is on both sides: spokes, and the quads at either end of a side. */
typedef struct side_points {
  coordinates spokes[2], near[2], far[2];
} side_points;

static inline __attribute__((always_inline)) void load_sides(const tw_shallow_level *l, const offsets *at,
                                                             side_points *p) {
  for (size_t s = 0; s < 2; s++) {
    const corners *c = &at->edges.sides[s];
    p->spokes[s] = points_at(l->spokes, c->own_at, 1);
    p->near[s] = points_at(l->centres, c->own_at, 1);
    p->far[s] = points_at(l->centres, c->next_at, 1);
  }
}

static inline __attribute__((always_inline)) void middle_rows(const tw_shallow_level *l, uint32_t edge,
                                                              const side_points *p, tangents *rows) {
  const float *halves = l->halves + 6 * (size_t)edge;
  coordinates first = points_by(halves, 6), last = points_by(halves + 3, 6);
  between_four((const coordinates *const[4]){&last, &p->spokes[0], &first, &p->spokes[1]},
               (const coordinates *const[4]){&p->far[0], &p->near[0], &p->far[1], &p->near[1]}, rows);
}

static inline __attribute__((always_inline)) void
half_rows(const tw_shallow_level *l, uint32_t edge, const offsets *at, const side_points *p, tangents *rows) {
  coordinates own = points_by(l->edges + 3 * (size_t)edge, 3),
              start = points_at(l->vertices, at->edges.ends, 2),
              end = points_at(l->vertices, at->edges.ends + 1, 2), halves[4];
  for (size_t i = 0; i < 4; i++) halves[i] = points_at(l->halves, at->edges.beside[i], 1);
  between_four((const coordinates *const[4]){&own, &p->near[0], &start, &p->far[1]},
               (const coordinates *const[4]){&p->spokes[0], &halves[0], &halves[1], &p->spokes[1]}, rows);
  between_four((const coordinates *const[4]){&end, &p->far[0], &own, &p->near[1]},
               (const coordinates *const[4]){&halves[2], &p->spokes[0], &p->spokes[1], &halves[3]}, rows + 1);
}

static inline __attribute__((always_inline)) void edges_2(const tw_shallow_level *l, uint32_t edge,
                                                          const offsets *at, tangents *rows) {
  side_points p;
  load_sides(l, at, &p);
  middle_rows(l, edge, &p, rows);
}
static inline __attribute__((always_inline)) void halves_2(const tw_shallow_level *l, uint32_t edge,
                                                           const offsets *at, tangents *rows) {
  side_points p;
  load_sides(l, at, &p);
  half_rows(l, edge, at, &p, rows);
}
static inline __attribute__((always_inline)) void whole_edges_2(const tw_shallow_level *l, uint32_t edge,
                                                                const offsets *at, tangents *rows) {
  side_points p;
  load_sides(l, at, &p);
  middle_rows(l, edge, &p, rows);
  half_rows(l, edge, at, &p, rows + 1);
}

#endif
