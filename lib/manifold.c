/* The edges and fans of a mesh that is manifold, found together vertex by vertex: the faces round a vertex,
 * put in order, are its fan, and tell both sides of every edge there. Each edge is numbered at its lower
 * vertex, so that edges come out in the order that tw_topology_build promises.
 *
 * Every edge is looked at from its lower vertex, where at most one face may leave along it and at most one
 * arrive: all that is not manifold shows either there or as faces that do not form one fan. */
#include "topology.h"

/* Faces round one vertex: matching them takes time by the square. */
enum { SPOKES_MAX = 64 };

/* The faces round one vertex, in order once they are chained. */
typedef struct spokes {
  uint32_t count;
  bool border;                     /* the last face's trailing edge has no other face */
  uint32_t corners[SPOKES_MAX];    /* of the faces, at the vertex */
  uint32_t leading[SPOKES_MAX];    /* vertex after the corner */
  uint32_t trailing[SPOKES_MAX];   /* vertex before it */
  uint32_t upper[SPOKES_MAX + 1];  /* neighbours of a greater number, ascending */
  uint32_t places[SPOKES_MAX + 1]; /* their places in the ring */
} spokes;

static void gather(const tw_topology *t, uint32_t vertex, spokes *s) {
  const uint32_t *fan = t->fan_corners + t->fan_offsets[vertex];
  for (uint32_t i = 0; i < s->count; i++) {
    s->corners[i] = fan[i];
    s->leading[i] = t->corner_vertex[tw_corner_next(t, fan[i])];
    s->trailing[i] = t->corner_vertex[tw_corner_previous(t, fan[i])];
  }
}

/* Brings face `from` to place `to`, which it swaps with or, when the others are in order, moves behind. */
static void swap_faces(spokes *s, uint32_t from, uint32_t to) {
  uint32_t corner = s->corners[from], leading = s->leading[from], trailing = s->trailing[from];
  s->corners[from] = s->corners[to];
  s->leading[from] = s->leading[to];
  s->trailing[from] = s->trailing[to];
  s->corners[to] = corner;
  s->leading[to] = leading;
  s->trailing[to] = trailing;
}
static void move_to_front(spokes *s, uint32_t from) {
  for (; from > 0; from--) swap_faces(s, from, from - 1);
}

static uint32_t find(const uint32_t *vertices, uint32_t begin, uint32_t end, uint32_t vertex) {
  while (begin < end && vertices[begin] != vertex) begin++;
  return begin;
}

/* Puts the faces in counter-clockwise order from the first of them or, on a border, from the one that leads.
 * False when they are not one fan. */
static bool chain(spokes *s) {
  uint32_t chained = 1;
  for (; chained < s->count; chained++) {
    uint32_t next = find(s->leading, chained, s->count, s->trailing[chained - 1]);
    if (next == s->count) break;
    swap_faces(s, next, chained);
  }
  for (; chained < s->count; chained++) {
    uint32_t before = find(s->trailing, chained, s->count, s->leading[0]);
    if (before == s->count) return false;
    move_to_front(s, before);
  }
  s->border = s->trailing[s->count - 1] != s->leading[0];
  return true;
}

static uint32_t insert_upper(spokes *s, uint32_t count, uint32_t vertex, uint32_t place) {
  uint32_t at = count;
  for (; at > 0 && s->upper[at - 1] > vertex; at--) {
    s->upper[at] = s->upper[at - 1];
    s->places[at] = s->places[at - 1];
  }
  s->upper[at] = vertex;
  s->places[at] = place;
  return count + 1;
}

/* The edge at a place of the ring, whose lower vertex is the ring's. */
static void start_edge(tw_topology *t, const spokes *s, uint32_t vertex, uint32_t upper, uint32_t place) {
  uint32_t edge = t->edge_count++, last = s->count - 1;
  bool leads = place<s->count, trails = place> 0 || !s->border;
  uint32_t out = leads ? s->corners[place] : 0;
  uint32_t in = trails ? tw_corner_previous(t, s->corners[place > 0 ? place - 1 : last]) : out;
  if (!leads) out = in;
  bool outward = leads && out <= in;
  t->edge_vertices[edge][0] = outward ? vertex : upper;
  t->edge_vertices[edge][1] = outward ? upper : vertex;
  t->edge_corner[edge] = outward ? out : in;
  t->edge_flags[edge] = out == in ? TW_EDGE_BORDER : 0;
  t->corner_edge[out] = t->corner_edge[in] = edge;
  t->sibling[out] = in;
  t->sibling[in] = out;
}

/* Numbers the edges to greater vertices; false when two of them are the same. */
static bool start_edges(tw_topology *t, spokes *s, uint32_t vertex) {
  uint32_t count = 0;
  for (uint32_t i = 0; i < s->count; i++)
    if (s->leading[i] > vertex) count = insert_upper(s, count, s->leading[i], i);
  if (s->border && s->trailing[s->count - 1] > vertex)
    count = insert_upper(s, count, s->trailing[s->count - 1], s->count);
  for (uint32_t i = 0; i < count; i++) {
    if (i > 0 && s->upper[i] == s->upper[i - 1]) return false;
    start_edge(t, s, vertex, s->upper[i], s->places[i]);
  }
  return true;
}

static bool link_vertex(tw_topology *t, uint32_t vertex) {
  spokes s;
  uint32_t *fan = t->fan_corners + t->fan_offsets[vertex], *ring = t->ring_edges + t->ring_offsets[vertex];
  s.count = t->fan_offsets[vertex + 1] - t->fan_offsets[vertex];
  t->ring_offsets[vertex + 1] = t->ring_offsets[vertex];
  t->vertex_flags[vertex] = s.count > 0 ? 0 : TW_VERTEX_NONMANIFOLD; /* as of no fan at all */
  if (s.count == 0) return true;
  if (s.count > SPOKES_MAX) return false;
  gather(t, vertex, &s);
  if (!chain(&s) || !start_edges(t, &s, vertex)) return false;
  for (uint32_t i = 0; i < s.count; i++) {
    fan[i] = s.corners[i];
    ring[i] = t->corner_edge[s.corners[i]];
  }
  t->ring_offsets[vertex + 1] += s.count;
  if (!s.border) return true;
  ring[s.count] = t->corner_edge[tw_corner_previous(t, s.corners[s.count - 1])];
  t->ring_offsets[vertex + 1]++;
  t->vertex_flags[vertex] = TW_VERTEX_BORDER;
  return true;
}

bool tw_topology_link_manifold(tw_topology *topology) {
  topology->edge_count = 0;
  for (uint32_t v = 0; v < topology->vertex_count; v++)
    if (!link_vertex(topology, v)) return false;
  return true;
}
