/* The edges and fans of a mesh that is manifold, found together vertex by vertex: the faces round a vertex,
 * put in order, are its fan, and tell both sides of every edge there. Each edge is numbered at its lower
 * vertex, so that edges come out in the order that tw_topology_build promises.
 *
 * What is not manifold shows at a vertex: as two faces that leave it along the same edge, or as faces that
 * are not one fan. */
#include "topology.h"

#include <stdlib.h>

/* Faces of a greater pole are left to others. */
enum { SPOKES_MAX = 64 };

/* The faces round one vertex, as they come, and their order. */
typedef struct spokes {
  uint32_t vertex, count;
  bool border;                   /* the last face's trailing edge has no other face */
  uint32_t corners[SPOKES_MAX];  /* at the vertex */
  uint32_t before[SPOKES_MAX];   /* corner before that, in the face */
  uint32_t leading[SPOKES_MAX];  /* vertex that the face leaves for */
  uint32_t trailing[SPOKES_MAX]; /* vertex that it comes from */
  uint8_t next[SPOKES_MAX];      /* face that leaves for its trailing vertex; itself where none does */
  uint8_t previous[SPOKES_MAX];  /* the other way round; where none is, nothing */
  uint8_t order[SPOKES_MAX];
  uint32_t upper_count;           /* edges to greater vertices */
  uint32_t upper[SPOKES_MAX + 1]; /* those */
  uint8_t faces[SPOKES_MAX + 1];  /* faces that leave along them; count for the trailing edge of a border */
} spokes;

static void gather(const tw_topology *t, spokes *s, uint8_t *face_to) {
  const uint32_t *fan = t->fan_corners + t->fan_offsets[s->vertex];
  s->upper_count = 0;
  for (uint32_t i = 0; i < s->count; i++) {
    uint32_t before = tw_corner_previous(t, fan[i]), to = t->corner_vertex[tw_corner_next(t, fan[i])];
    s->corners[i] = fan[i];
    s->before[i] = before;
    s->leading[i] = to;
    s->trailing[i] = t->corner_vertex[before];
    face_to[to] = (uint8_t)i;
    /* Written whether it counts or not: which it is nobody could guess. */
    s->upper[s->upper_count] = to;
    s->faces[s->upper_count] = (uint8_t)i;
    s->upper_count += to > s->vertex;
  }
}

/* Finds the face after each. face_to has stale entries, so what it says is looked up. *last: one that none
 * follows. */
static void match(spokes *s, const uint8_t *face_to, uint32_t *last) {
  s->border = false;
  for (uint32_t i = 0; i < s->count; i++) {
    uint8_t next = face_to[s->trailing[i]];
    if (next >= s->count || s->leading[next] != s->trailing[i]) {
      next = (uint8_t)i;
      *last = i;
      s->border = true;
    } else {
      s->previous[next] = (uint8_t)i;
    }
    s->next[i] = next;
  }
}

/* A face that follows none, when none follows `last`. */
static uint32_t find_first(const spokes *s, uint32_t last) {
  uint64_t followed = 0;
  for (uint32_t i = 0; i < s->count; i++)
    if (i != last) followed |= 1ull << s->next[i];
  for (uint32_t i = 0; i < s->count; i++)
    if (!(followed >> i & 1)) return i;
  return 0; /* does not come up: fewer are followed than there are */
}

/* Walks the faces counter-clockwise from the first that came or, on a border, from the one that leads. False
 * when not all are met. */
static bool walk(spokes *s, uint32_t last) {
  uint32_t first = s->border ? find_first(s, last) : 0, at = first;
  uint64_t met = 0;
  for (uint32_t i = 0; i < s->count; i++) {
    s->order[i] = (uint8_t)at;
    met |= 1ull << at;
    at = s->next[at];
  }
  return met == UINT64_MAX >> (64 - s->count) && (s->border || at == first);
}

/* The nth edge to a greater vertex gets the number that its rank among them says. */
static void start_edge(tw_topology *t, const spokes *s, uint32_t n, uint32_t first_face) {
  uint32_t upper = s->upper[n], face = s->faces[n], edge = t->edge_count;
  for (uint32_t i = 0; i < s->upper_count; i++) edge += s->upper[i] < upper;
  bool leaves = face < s->count, arrives = !(s->border && face == first_face);
  uint32_t out = leaves ? s->corners[face] : 0;
  uint32_t in = arrives ? s->before[leaves ? s->previous[face] : s->order[s->count - 1]] : out;
  if (!leaves) out = in;
  bool outward = leaves && out <= in;
  t->edge_vertices[edge][0] = outward ? s->vertex : upper;
  t->edge_vertices[edge][1] = outward ? upper : s->vertex;
  t->edge_corner[edge] = outward ? out : in;
  t->edge_flags[edge] = out == in ? TW_EDGE_BORDER : 0;
  t->corner_edge[out] = t->corner_edge[in] = edge;
  t->sibling[out] = in;
  t->sibling[in] = out;
}

static void start_edges(tw_topology *t, spokes *s) {
  uint32_t trailing = s->trailing[s->order[s->count - 1]];
  if (s->border && trailing > s->vertex) {
    s->upper[s->upper_count] = trailing;
    s->faces[s->upper_count++] = (uint8_t)s->count;
  }
  for (uint32_t n = 0; n < s->upper_count; n++) start_edge(t, s, n, s->order[0]);
  t->edge_count += s->upper_count;
}

static bool link_vertex(tw_topology *t, uint32_t vertex, uint8_t *face_to) {
  spokes s;
  uint32_t first = t->fan_offsets[vertex], ring_first = t->ring_offsets[vertex], last = 0;
  s.vertex = vertex;
  s.count = t->fan_offsets[vertex + 1] - first;
  t->ring_offsets[vertex + 1] = ring_first + s.count;
  t->vertex_flags[vertex] = s.count > 0 ? 0 : TW_VERTEX_NONMANIFOLD; /* as of no fan at all */
  if (s.count == 0) return true;
  if (s.count > SPOKES_MAX) return false;
  gather(t, &s, face_to);
  match(&s, face_to, &last);
  if (!walk(&s, last)) return false;
  start_edges(t, &s);
  uint32_t *fan = t->fan_corners + first, *ring = t->ring_edges + ring_first;
  for (uint32_t i = 0; i < s.count; i++) {
    fan[i] = s.corners[s.order[i]];
    ring[i] = t->corner_edge[fan[i]];
  }
  if (!s.border) return true;
  ring[s.count] = t->corner_edge[s.before[last]];
  t->ring_offsets[vertex + 1]++;
  t->vertex_flags[vertex] = TW_VERTEX_BORDER;
  return true;
}

bool tw_topology_link_manifold(tw_topology *topology) {
  tw_topology *t = topology;
  uint8_t *face_to = tw_alloc_zero(t->vertex_count, 1); /* face of the vertex at hand that leaves for each */
  if (!face_to) return false;
  t->edge_count = 0;
  bool linked = true;
  for (uint32_t v = 0; v < t->vertex_count && linked; v++) linked = link_vertex(t, v, face_to);
  free(face_to);
  return linked;
}
