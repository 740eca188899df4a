/* Who touches whom: every array of a topology against its definition, over meshes that are closed, open,
 * torn, and not manifold. */
#include <stdlib.h>
#include <string.h>

#include "test.h"
#include "topology.h"

/* ---- meshes ---------------------------------------------------------------------------------- */

enum { FACES_MAX = 256, CORNERS_MAX = 1024, POLE = 100 };

typedef struct soup {
  uint32_t vertex_count, face_count;
  uint32_t offsets[FACES_MAX + 1], corners[CORNERS_MAX];
} soup;

static void add_face(soup *s, uint32_t size, const uint32_t *vertices) {
  uint32_t begin = s->offsets[s->face_count++];
  memcpy(s->corners + begin, vertices, size * sizeof *vertices);
  s->offsets[s->face_count] = begin + size;
}

static uint32_t below(uint32_t *seed, uint32_t limit) {
  *seed = *seed * 1664525u + 1013904223u;
  return (*seed >> 8) % limit;
}

/* A torus of side x side squares, split into triangles when sizes is 3, when 0 here and there. One face in
 * `missing` is left out, one in `turned` runs the other way, one in `doubled` comes twice (0: none). */
static soup torus(uint32_t side, uint32_t sizes, uint32_t missing, uint32_t turned, uint32_t doubled,
                  uint32_t seed) {
  soup s = {.vertex_count = side * side};
  for (uint32_t y = 0; y < side; y++)
    for (uint32_t x = 0; x < side; x++) {
      uint32_t right = (x + 1) % side, up = (y + 1) % side;
      uint32_t q[4] = {y * side + x, y * side + right, up * side + right, up * side + x};
      if (missing && below(&seed, missing) == 0) continue;
      if (turned && below(&seed, turned) == 0) {
        uint32_t swap = q[1];
        q[1] = q[3];
        q[3] = swap;
      }
      uint32_t first = below(&seed, 4), turn[4];
      for (uint32_t k = 0; k < 4; k++) turn[k] = q[(k + first) % 4];
      for (uint32_t times = doubled && below(&seed, doubled) == 0 ? 2 : 1; times > 0; times--) {
        if (sizes == 4 || (sizes == 0 && below(&seed, 2))) {
          add_face(&s, 4, turn);
          continue;
        }
        add_face(&s, 3, turn);
        add_face(&s, 3, (uint32_t[]){turn[0], turn[2], turn[3]});
      }
    }
  return s;
}

/* ---- definitions ----------------------------------------------------------------------------- */

static uint32_t next_of(const soup *s, uint32_t face, uint32_t corner) {
  return corner + 1 < s->offsets[face + 1] ? corner + 1 : s->offsets[face];
}

static uint32_t face_of(const soup *s, uint32_t corner) {
  uint32_t face = 0;
  while (s->offsets[face + 1] <= corner) face++;
  return face;
}

static void check_corners(const soup *s, const tw_topology *t) {
  for (uint32_t f = 0; f < s->face_count; f++)
    for (uint32_t c = s->offsets[f]; c < s->offsets[f + 1]; c++) {
      const uint32_t *ends = t->edge_vertices[t->corner_edge[c]];
      uint32_t a = s->corners[c], b = s->corners[next_of(s, f, c)];
      assert_true((ends[0] == a && ends[1] == b) || (ends[0] == b && ends[1] == a));
      assert_int_equal(tw_corner_face(t, c), f);
    }
}

static void check_edge(const soup *s, const tw_topology *t, uint32_t edge) {
  uint32_t count = 0, along = 0, first = UINT32_MAX;
  for (uint32_t c = 0; c < t->corner_count; c++) {
    if (t->corner_edge[c] != edge) continue;
    if (count++ == 0) first = c;
    along += s->corners[c] == t->edge_vertices[edge][0];
  }
  assert_int_equal(t->edge_corner[edge], first);
  assert_int_equal(s->corners[first], t->edge_vertices[edge][0]);
  uint32_t ring = 0, corner = first;
  do {
    assert_int_equal(t->corner_edge[corner], edge);
    corner = t->sibling[corner];
    ring++;
  } while (corner != first && ring <= count);
  assert_int_equal(ring, count);
  bool nonmanifold = count > 2 || along > 1;
  assert_int_equal(t->edge_flags[edge],
                   (count == 1 ? TW_EDGE_BORDER : 0) | (nonmanifold ? TW_EDGE_NONMANIFOLD : 0));
}

/* By lower vertex, then upper. */
static void check_order(const tw_topology *t) {
  uint64_t before = 0;
  for (uint32_t e = 0; e < t->edge_count; e++) {
    uint32_t a = t->edge_vertices[e][0], b = t->edge_vertices[e][1];
    uint64_t key = a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;
    assert_true(e == 0 || key > before);
    before = key;
    assert_int_equal(tw_topology_find_edge(t, b, a), e);
  }
}

/* Whether the faces at a vertex can be walked from one to the next across its edges, all of which have one
 * or two faces. */
static bool is_one_fan(const tw_topology *t, uint32_t vertex) {
  uint32_t fan = t->fan_offsets[vertex], count = t->fan_offsets[vertex + 1] - fan, reached = 1;
  bool seen[CORNERS_MAX] = {false};
  if (count == 0) return false;
  seen[t->fan_corners[fan]] = true;
  for (uint32_t round = 0; round < count; round++)
    for (uint32_t i = 0; i < count; i++) {
      uint32_t corner = t->fan_corners[fan + i], back = tw_corner_previous(t, corner);
      if ((t->edge_flags[t->corner_edge[corner]] | t->edge_flags[t->corner_edge[back]]) & TW_EDGE_NONMANIFOLD)
        return false;
      uint32_t other = t->sibling[back];
      if (other == back || seen[corner] == seen[other]) continue;
      seen[corner] = seen[other] = true;
      reached++;
    }
  return reached == count;
}

static void check_vertex(const soup *s, const tw_topology *t, uint32_t vertex) {
  uint32_t corners = 0, edges = 0, border = UINT32_MAX, lowest = UINT32_MAX;
  const uint32_t *fan = t->fan_corners + t->fan_offsets[vertex],
                 *ring = t->ring_edges + t->ring_offsets[vertex];
  uint32_t fan_count = t->fan_offsets[vertex + 1] - t->fan_offsets[vertex],
           ring_count = t->ring_offsets[vertex + 1] - t->ring_offsets[vertex];
  for (uint32_t c = 0; c < t->corner_count; c++) {
    if (s->corners[c] != vertex) continue;
    if (corners++ == 0) lowest = c;
    if (t->edge_flags[t->corner_edge[c]] & TW_EDGE_BORDER) border = c;
    uint32_t times = 0;
    for (uint32_t i = 0; i < fan_count; i++) times += fan[i] == c;
    assert_int_equal(times, 1);
  }
  for (uint32_t e = 0; e < t->edge_count; e++) {
    bool touches = t->edge_vertices[e][0] == vertex || t->edge_vertices[e][1] == vertex;
    uint32_t times = 0;
    for (uint32_t i = 0; i < ring_count; i++) times += ring[i] == e;
    assert_int_equal(times, touches);
    edges += touches;
  }
  assert_int_equal(fan_count, corners);
  assert_int_equal(ring_count, edges);
  assert_int_equal((t->vertex_flags[vertex] & TW_VERTEX_NONMANIFOLD) == 0, is_one_fan(t, vertex));
  if (t->vertex_flags[vertex] & TW_VERTEX_NONMANIFOLD) return;
  assert_int_equal(t->vertex_flags[vertex] & TW_VERTEX_BORDER, edges > corners ? TW_VERTEX_BORDER : 0);
  assert_int_equal(fan[0], edges > corners ? border : lowest);
  for (uint32_t i = 0; i < fan_count; i++) {
    assert_int_equal(ring[i], t->corner_edge[fan[i]]);
    assert_int_equal(ring[i + 1 < ring_count ? i + 1 : 0], t->corner_edge[tw_corner_previous(t, fan[i])]);
  }
}

static void check(const soup *s) {
  tw_arena *arena = tw_arena_create();
  tw_topology t;
  uint32_t corner_count = s->offsets[s->face_count], size = s->offsets[1];
  bool even = size < 5 && corner_count == size * s->face_count;
  for (uint32_t f = 0; f < s->face_count && even; f++) even = s->offsets[f + 1] == size * (f + 1);
  assert_int_equal(tw_topology_build(&t, arena, s->vertex_count, s->face_count, even ? NULL : s->offsets,
                                     corner_count, s->corners),
                   TW_OK);
  for (uint32_t c = 0; c < corner_count; c++)
    assert_int_equal(tw_corner_next(&t, c), next_of(s, face_of(s, c), c));
  check_corners(s, &t);
  check_order(&t);
  for (uint32_t e = 0; e < t.edge_count; e++) check_edge(s, &t, e);
  for (uint32_t v = 0; v < t.vertex_count; v++) check_vertex(s, &t, v);
  tw_arena_destroy(arena);
}

/* ---- tests ----------------------------------------------------------------------------------- */

TEST(closed_meshes_have_closed_fans) {
  for (uint32_t seed = 0; seed < 4; seed++)
    for (uint32_t sizes = 0; sizes <= 4; sizes += sizes ? 1 : 3) {
      soup s = torus(5, sizes, 0, 0, 0, seed);
      check(&s);
    }
}

TEST(missing_faces_leave_borders_and_pinched_vertices) {
  for (uint32_t seed = 0; seed < 24; seed++) {
    soup s = torus(5, seed % 3 == 0 ? 0 : 2 + seed % 3, 2 + seed % 7, 0, 0, seed);
    check(&s);
  }
}

TEST(turned_and_doubled_faces_are_not_manifold) {
  for (uint32_t seed = 0; seed < 24; seed++) {
    soup turned = torus(4, seed % 2 ? 3 : 0, seed % 5, 6, 0, seed);
    check(&turned);
    soup doubled = torus(4, seed % 2 ? 3 : 4, seed % 5, 0, 6, seed);
    check(&doubled);
    soup both = torus(4, 0, 7, 5, 5, seed);
    check(&both);
  }
}

/* A third face on one edge, whichever of the edge's ends has the lower number and however the face runs. */
TEST(a_fin_shows_at_both_ends_of_its_edge) {
  for (uint32_t v = 0; v < 16; v++)
    for (uint32_t way = 0; way < 4; way++) {
      soup s = torus(4, 3, 0, 0, 0, v);
      uint32_t other = way & 1 ? v / 4 * 4 + (v + 1) % 4 : (v + 4) % 16;
      s.vertex_count = 17;
      add_face(&s, 3, way & 2 ? (uint32_t[]){v, other, 16} : (uint32_t[]){other, v, 16});
      check(&s);
    }
}

TEST(soup_without_any_order_keeps_to_the_definitions) {
  for (uint32_t seed = 0; seed < 64; seed++) {
    uint32_t random = seed, vertices = 4 + seed % 9;
    soup s = {.vertex_count = vertices};
    for (uint32_t f = 0; f < 3 + seed % 14; f++) {
      uint32_t first = below(&random, vertices), size = 3 + below(&random, 2), face[4];
      for (uint32_t i = 0; i < size; i++) face[i] = (first + i * (1 + (f & 1))) % vertices;
      if (size == 4 && face[3] == face[1]) size = 3;
      if (face[2] != face[0] && face[size - 1] != face[0]) add_face(&s, size, face);
    }
    if (s.face_count > 0) check(&s);
  }
}

/* Two tetrahedra on one edge, their faces in any order: for some, a walk round either end of the edge passes
 * from one to the other and back. */
TEST(closed_meshes_that_share_an_edge_are_not_manifold) {
  static const uint32_t faces[8][3] = {{0, 1, 2}, {1, 0, 3}, {2, 1, 3}, {0, 2, 3},
                                       {0, 1, 4}, {1, 0, 5}, {4, 1, 5}, {0, 4, 5}};
  for (uint32_t seed = 0; seed < 200; seed++) {
    uint32_t random = seed, order[8] = {0, 1, 2, 3, 4, 5, 6, 7};
    soup s = {.vertex_count = 6};
    for (uint32_t left = 8; left > 0; left--) {
      uint32_t pick = below(&random, left);
      add_face(&s, 3, faces[order[pick]]);
      order[pick] = order[left - 1];
    }
    check(&s);
  }
}

TEST(great_poles_are_fans_like_all_others) {
  for (uint32_t open = 0; open < 2; open++) {
    soup s = {.vertex_count = POLE + 1};
    for (uint32_t i = 0; i + open < POLE; i++)
      add_face(&s, 3, (uint32_t[]){POLE, i * 7 % POLE, (i * 7 + 1) % POLE});
    check(&s);
  }
}

TEST(two_triangles_back_to_back_are_closed_and_a_third_is_one_too_many) {
  soup s = {.vertex_count = 4}; /* vertex 3 is not used */
  add_face(&s, 3, (uint32_t[]){0, 1, 2});
  add_face(&s, 3, (uint32_t[]){2, 1, 0});
  check(&s);
  add_face(&s, 3, (uint32_t[]){0, 1, 2});
  check(&s);
}
