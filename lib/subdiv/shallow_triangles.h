/* Rows of level 2 of a cage of triangles, LANES faces or edges at a time, from points of level 1. First it is
 * found where those are, and asked for; a block later they are there. Points are those that shallow_points.c
 * gives, to the last bit; of what lies about them, what is of no row of the item is made again. */
#ifndef TWEEND_SHALLOW_TRIANGLES_H
#define TWEEND_SHALLOW_TRIANGLES_H

#include "shallow_lanes.h"

/* Offsets of what the corners of LANES triangles name: edges and vertices; of the face beyond the edge, it
 * and its quads at the ends of the edge, that at the end of the corner's side first. */
typedef struct triples {
  uint32_t edges[TRIPLES], vertices[TRIPLES], faces[TRIPLES], far[TRIPLES], near[TRIPLES];
} triples;

/* Of LANES edges, on one side: the corners beside it in the face; offsets of the face and of its quads at the
 * beginning and the end of the side. */
typedef struct corners {
  uint32_t next[LANES], previous[LANES], face[LANES], own_at[LANES], next_at[LANES];
} corners;

/* Of what is about LANES edges: both sides, both ends by turns, and of the four edges beside: they, and the
 * quads beyond them. */
typedef struct pairs {
  corners sides[2];
  uint32_t ends[2 * LANES], beside[4][LANES], beyond[4][LANES];
} pairs;

typedef union offsets {
  triples faces;
  pairs edges;
} offsets;

/* Points of level 2 on and about LANES triangles: in the middle; by sides, spokes, middles of edges, and
 * their halves at the beginning and at the end of the side; by corners, quads and vertices. */
typedef struct face_points {
  coordinates own, spokes[3], edges[3], from[3], to[3], quads[3], vertices[3];
} face_points;

/* And on and about LANES edges: in the middle, both halves, both ends; by sides, spokes, and quads at the
 * beginning and the end; halves of the edges beside. */
typedef struct edge_points {
  coordinates own, halves[2], ends[2], spokes[2], near[2], far[2], beside[4];
} edge_points;

typedef union points_about {
  face_points faces;
  edge_points edges;
} points_about;

/* Where that is which LANES items from one on are made of, which is asked for; and their rows, with the
 * points that those name. */
typedef void find_from(const tw_shallow_level *l, uint32_t item, offsets *at);
typedef void rows_from(const tw_shallow_level *l, uint32_t item, const offsets *at, points_about *about,
                       lane_row *rows);

/* ---- corners -------------------------------------------------------------------------------- */

/* The first corner of a corner's face, which is the face's offset as well; and the next one in it. */
static inline indices first_beside(indices corners) {
  return corners / 3 * 3;
}
static inline indices next_to(indices corners, indices first) {
  return corners + 1 - (3 & (indices)(corners - first == 2));
}

/* ---- faces ---------------------------------------------------------------------------------- */

static inline void find_edges(const tw_topology *t, size_t first, triples *out) {
  for (size_t i = 0; i < TRIPLES; i += LANES)
    put_indices(out->edges + i, 3 * load_indices(t->corner_edge + first + i));
}
static inline void find_vertices(const tw_topology *t, size_t first, triples *out) {
  for (size_t i = 0; i < TRIPLES; i += LANES)
    put_indices(out->vertices + i, 3 * load_indices(t->corner_vertex + first + i));
}
/* The face beyond runs along the edge the other way round. */
static inline void find_beyond(const tw_topology *t, size_t first, triples *out) {
  for (size_t i = 0; i < TRIPLES; i += LANES) {
    indices other = load_indices(t->sibling + first + i), face = first_beside(other);
    put_indices(out->faces + i, face);
    put_indices(out->far + i, 3 * other);
    put_indices(out->near + i, 3 * next_to(other, face));
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

static inline __attribute__((always_inline)) void find_middle(const tw_shallow_level *l, uint32_t face,
                                                              offsets *at) {
  size_t first = 3 * (size_t)face;
  fetch_on(l->cage.corner_edge + first, TRIPLES);
  fetch_on(l->centres + 3 * first, 3 * (size_t)TRIPLES);
  fetch_on(l->faces + first, TRIPLES);
  find_edges(&l->cage, first, &at->faces);
  fetch(l->edges, at->faces.edges, TRIPLES);
}

static inline __attribute__((always_inline)) void find_corners(const tw_shallow_level *l, uint32_t face,
                                                               offsets *at) {
  size_t first = 3 * (size_t)face;
  find_middle(l, face, at);
  fetch_on(l->cage.corner_vertex + first, TRIPLES);
  fetch_on(l->cage.sibling + first, TRIPLES);
  find_vertices(&l->cage, first, &at->faces);
  find_beyond(&l->cage, first, &at->faces);
  fetch(l->vertices, at->faces.vertices, TRIPLES);
  fetch(l->remade, at->faces.vertices, TRIPLES);
  fetch(l->faces, at->faces.faces, TRIPLES);
  fetch(l->centres, at->faces.faces, TRIPLES);
}

/* What a face knows by itself; hands out points of level 1 in its middle and on its edges. */
static inline __attribute__((always_inline)) void load_inside(const tw_shallow_level *l, uint32_t face,
                                                              const offsets *at, face_points *p,
                                                              coordinates *middle, coordinates edges[3]) {
  *middle = points_by(l->faces + 3 * (size_t)face, 3);
  three_at(l->edges, at->faces.edges, edges);
  three_by(l->centres + 9 * (size_t)face, p->quads);
  p->own = between_corners(middle, edges, p->quads);
  for (size_t i = 0; i < 3; i++)
    p->spokes[i] = middle_of(&edges[i], middle, &p->quads[i], &p->quads[(i + 1) % 3]);
}

static inline __attribute__((always_inline)) void load_faces(const tw_shallow_level *l, uint32_t face,
                                                             const offsets *at, face_points *p) {
  const triples *o = &at->faces;
  coordinates middle, edges[3], vertices[3];
  load_inside(l, face, at, p, &middle, edges);
  three_at(l->vertices, o->vertices, vertices);
  for (size_t i = 0; i < 3; i++) {
    size_t next = (i + 1) % 3;
    coordinates other = points_at(l->faces, o->faces + i, 3), far = points_at(l->centres, o->far + i, 3),
                near = points_at(l->centres, o->near + i, 3);
    p->from[i] = middle_of(&vertices[i], &edges[i], &p->quads[i], &near);
    p->to[i] = middle_of(&vertices[next], &edges[i], &p->quads[next], &far);
    p->edges[i] = between_quads(&edges[i], &vertices[i], &vertices[next],
                                (const coordinates *const[2]){&middle, &other},
                                (const coordinates *const[4]){&p->quads[next], &p->quads[i], &near, &far});
  }
}

static inline __attribute__((always_inline)) void middle_rows(const tw_shallow_level *l, const face_points *p,
                                                              lane_row *rows) {
  between_three(&p->own, l->weights->faces[3][1],
                (const coordinates *const[3]){&p->spokes[2], &p->spokes[0], &p->spokes[1]},
                (const coordinates *const[3]){&p->quads[0], &p->quads[1], &p->quads[2]}, rows);
}

static inline __attribute__((always_inline)) void spoke_rows(const face_points *p, lane_row *rows) {
  for (size_t i = 0; i < 3; i++) {
    size_t next = (i + 1) % 3, previous = (i + 2) % 3;
    between_four(
        &p->spokes[i], (const coordinates *const[4]){&p->own, &p->quads[i], &p->edges[i], &p->quads[next]},
        (const coordinates *const[4]){&p->spokes[previous], &p->from[i], &p->to[i], &p->spokes[next]},
        rows + i);
  }
}

static inline __attribute__((always_inline)) void centre_rows(const tw_shallow_level *l, const offsets *at,
                                                              face_points *p, lane_row *rows) {
  three_at(l->remade, at->faces.vertices, p->vertices);
  for (size_t i = 0; i < 3; i++) {
    size_t previous = (i + 2) % 3;
    between_four(
        &p->quads[i],
        (const coordinates *const[4]){&p->from[i], &p->spokes[i], &p->spokes[previous], &p->to[previous]},
        (const coordinates *const[4]){&p->edges[i], &p->own, &p->edges[previous], &p->vertices[i]}, rows + i);
  }
}

static inline __attribute__((always_inline)) void
faces_2(const tw_shallow_level *l, uint32_t face, const offsets *at, points_about *about, lane_row *rows) {
  coordinates middle, edges[3];
  load_inside(l, face, at, &about->faces, &middle, edges);
  middle_rows(l, &about->faces, rows);
}
static inline __attribute__((always_inline)) void
spokes_2(const tw_shallow_level *l, uint32_t face, const offsets *at, points_about *about, lane_row *rows) {
  load_faces(l, face, at, &about->faces);
  spoke_rows(&about->faces, rows);
}
static inline __attribute__((always_inline)) void
centres_2(const tw_shallow_level *l, uint32_t face, const offsets *at, points_about *about, lane_row *rows) {
  load_faces(l, face, at, &about->faces);
  centre_rows(l, at, &about->faces, rows);
}
static inline __attribute__((always_inline)) void
corners_2(const tw_shallow_level *l, uint32_t face, const offsets *at, points_about *about, lane_row *rows) {
  load_faces(l, face, at, &about->faces);
  spoke_rows(&about->faces, rows);
  centre_rows(l, at, &about->faces, rows + 3);
}

/* ---- edges ---------------------------------------------------------------------------------- */

static inline void find_side(indices own, corners *out) {
  indices first = first_beside(own), next = next_to(own, first), previous = 3 * first + 3 - own - next;
  put_indices(out->next, next);
  put_indices(out->previous, previous);
  put_indices(out->face, first);
  put_indices(out->own_at, 3 * own);
  put_indices(out->next_at, 3 * next);
}

/* What is on the other side the first corner tells: it is asked for some edges ahead. */
static inline void find_sides(const tw_topology *t, uint32_t edge, corners sides[2]) {
  const uint32_t *one = t->edge_corner + edge;
  uint32_t other[LANES];
  for (size_t k = 0; k < LANES; k++) other[k] = t->sibling[one[k]];
  if (t->edge_count - edge >= 2 * LANES)
    for (size_t k = LANES; k < 2 * (size_t)LANES; k++) __builtin_prefetch(t->sibling + one[k]);
  find_side(load_indices(one), &sides[0]);
  find_side(load_indices(other), &sides[1]);
}

/* Ends of edges, of each first the one, then the other. */
static inline void find_ends(const tw_topology *t, uint32_t edge, uint32_t out[2 * LANES]) {
  put_indices(out, 3 * load_indices(t->edge_vertices[edge]));
  put_indices(out + LANES, 3 * load_indices(t->edge_vertices[edge] + LANES));
}

/* The edges at some corners, and the quads beyond them where they begin, or where they end. */
static inline __attribute__((always_inline)) void find_beside(const tw_shallow_level *l,
                                                              const uint32_t *corners, bool begin,
                                                              uint32_t *edges, uint32_t *beyond) {
  for (size_t k = 0; k < LANES; k++) {
    edges[k] = 3 * l->cage.corner_edge[corners[k]];
    beyond[k] = l->cage.sibling[corners[k]];
  }
  indices other = load_indices(beyond);
  put_indices(beyond, 3 * (begin ? next_to(other, first_beside(other)) : other));
  fetch(l->edges, edges, LANES);
  fetch(l->centres, beyond, LANES);
}

static inline __attribute__((always_inline)) void find_inside(const tw_shallow_level *l, uint32_t edge,
                                                              offsets *at) {
  pairs *p = &at->edges;
  fetch_on(l->cage.edge_corner + edge, LANES);
  fetch_on(l->cage.edge_vertices + edge, 2 * (size_t)LANES);
  fetch_on(l->edges + 3 * (size_t)edge, 3 * (size_t)LANES);
  find_sides(&l->cage, edge, p->sides);
  find_ends(&l->cage, edge, p->ends);
  for (size_t s = 0; s < 2; s++) {
    fetch(l->centres, p->sides[s].face, LANES);
    fetch(l->faces, p->sides[s].face, LANES);
  }
}

static inline __attribute__((always_inline)) void find_about(const tw_shallow_level *l, uint32_t edge,
                                                             offsets *at) {
  pairs *p = &at->edges;
  find_inside(l, edge, at);
  find_beside(l, p->sides[0].previous, false, p->beside[0], p->beyond[0]);
  find_beside(l, p->sides[1].next, true, p->beside[1], p->beyond[1]);
  find_beside(l, p->sides[0].next, true, p->beside[2], p->beyond[2]);
  find_beside(l, p->sides[1].previous, false, p->beside[3], p->beyond[3]);
}

/* What is between the ends of an edge and the middles of its faces; hands out its ends at level 1. */
static inline __attribute__((always_inline)) void load_between(const tw_shallow_level *l, uint32_t edge,
                                                               const offsets *at, edge_points *p,
                                                               coordinates ends[2]) {
  coordinates own = points_by(l->edges + 3 * (size_t)edge, 3), faces[2];
  for (size_t s = 0; s < 2; s++) {
    const corners *c = &at->edges.sides[s];
    ends[s] = points_at(l->vertices, at->edges.ends + s, 2);
    faces[s] = points_at(l->faces, c->face, 1);
    p->near[s] = points_at(l->centres, c->own_at, 1);
    p->far[s] = points_at(l->centres, c->next_at, 1);
    p->spokes[s] = middle_of(&own, &faces[s], &p->near[s], &p->far[s]);
  }
  p->halves[0] = middle_of(&ends[0], &own, &p->near[0], &p->far[1]);
  p->halves[1] = middle_of(&ends[1], &own, &p->far[0], &p->near[1]);
  p->own = between_quads(&own, &ends[0], &ends[1], (const coordinates *const[2]){&faces[0], &faces[1]},
                         (const coordinates *const[4]){&p->far[0], &p->near[0], &p->far[1], &p->near[1]});
}

static inline __attribute__((always_inline)) void edge_rows(const edge_points *p, lane_row *rows) {
  between_four(&p->own,
               (const coordinates *const[4]){&p->halves[1], &p->spokes[0], &p->halves[0], &p->spokes[1]},
               (const coordinates *const[4]){&p->far[0], &p->near[0], &p->far[1], &p->near[1]}, rows);
}

static inline __attribute__((always_inline)) void half_rows(const tw_shallow_level *l, const offsets *at,
                                                            const coordinates ends[2], edge_points *p,
                                                            lane_row *rows) {
  const coordinates *quads[4] = {&p->near[0], &p->far[1], &p->far[0], &p->near[1]};
  for (size_t s = 0; s < 2; s++) p->ends[s] = points_at(l->remade, at->edges.ends + s, 2);
  for (size_t i = 0; i < 4; i++) {
    coordinates edges = points_at(l->edges, at->edges.beside[i], 1),
                beyond = points_at(l->centres, at->edges.beyond[i], 1);
    p->beside[i] = middle_of(&ends[i / 2], &edges, quads[i], &beyond);
  }
  between_four(&p->halves[0], (const coordinates *const[4]){&p->own, &p->near[0], &p->ends[0], &p->far[1]},
               (const coordinates *const[4]){&p->spokes[0], &p->beside[0], &p->beside[1], &p->spokes[1]},
               rows);
  between_four(&p->halves[1], (const coordinates *const[4]){&p->ends[1], &p->far[0], &p->own, &p->near[1]},
               (const coordinates *const[4]){&p->beside[2], &p->spokes[0], &p->spokes[1], &p->beside[3]},
               rows + 1);
}

static inline __attribute__((always_inline)) void
edges_2(const tw_shallow_level *l, uint32_t edge, const offsets *at, points_about *about, lane_row *rows) {
  coordinates ends[2];
  load_between(l, edge, at, &about->edges, ends);
  edge_rows(&about->edges, rows);
}
static inline __attribute__((always_inline)) void
halves_2(const tw_shallow_level *l, uint32_t edge, const offsets *at, points_about *about, lane_row *rows) {
  coordinates ends[2];
  load_between(l, edge, at, &about->edges, ends);
  half_rows(l, at, ends, &about->edges, rows);
}
static inline __attribute__((always_inline)) void whole_edges_2(const tw_shallow_level *l, uint32_t edge,
                                                                const offsets *at, points_about *about,
                                                                lane_row *rows) {
  coordinates ends[2];
  load_between(l, edge, at, &about->edges, ends);
  edge_rows(&about->edges, rows);
  half_rows(l, at, ends, &about->edges, rows + 1);
}

#endif
