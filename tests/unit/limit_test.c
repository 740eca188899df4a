/* Masks of polygons are those of the quads one generic step below: over meshes that are closed, open, torn,
 * and not manifold, with edges and vertices that are infinitely sharp. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "limit.h"
#include "refine.h"
#include "test.h"

enum { SIDE = 9, FACES_MAX = 3 * SIDE * SIDE, CORNERS_MAX = 9 * SIDE * SIDE };

typedef struct soup {
  uint32_t face_count, offsets[FACES_MAX + 1], corners[CORNERS_MAX];
} soup;

static uint32_t below(uint32_t *seed, uint32_t limit) {
  *seed = *seed * 1664525u + 1013904223u;
  return (*seed >> 8) % limit;
}

static void add(soup *s, uint32_t size, const uint32_t *vertices) {
  uint32_t begin = s->offsets[s->face_count++];
  memcpy(s->corners + begin, vertices, size * sizeof *vertices);
  s->offsets[s->face_count] = begin + size;
}

/* A torus of triangles, quads and hexagons; with `torn` some faces are missing, turned over or doubled. */
static soup torus(bool triangles, bool torn, uint32_t *seed) {
  soup s = {0};
  for (uint32_t y = 0; y < SIDE; y++)
    for (uint32_t x = 0; x < SIDE; x++) {
      uint32_t right = (x + 1) % SIDE, far = (x + 2) % SIDE, low = y * SIDE, high = (y + 1) % SIDE * SIDE;
      uint32_t quad[4] = {low + x, low + right, high + right, high + x},
               six[6] = {low + x, low + right, low + far, high + far, high + right, high + x};
      if (torn && below(seed, 9) == 0) continue;
      if (!triangles && x + 2 < SIDE && below(seed, 4) == 0) {
        add(&s, 6, six);
        x++;
      } else if (!triangles && below(seed, 2) == 0) {
        add(&s, 4, quad);
      } else {
        uint32_t turned[3] = {quad[0], quad[3], quad[2]};
        bool turn = torn && below(seed, 12) == 0;
        add(&s, 3, quad);
        add(&s, 3, turn ? turned : (uint32_t[]){quad[0], quad[2], quad[3]});
        if (torn && below(seed, 12) == 0) add(&s, 3, quad);
      }
    }
  return s;
}

static void sum(const tw_limit_entry *mask, uint32_t count, const double *values, double out[3]) {
  out[0] = out[1] = out[2] = 0;
  for (uint32_t i = 0; i < count; i++) {
    out[0] += (double)mask[i].position * values[mask[i].vertex];
    out[1] += (double)mask[i].tangent1 * values[mask[i].vertex];
    out[2] += (double)mask[i].tangent2 * values[mask[i].vertex];
  }
}

/* Compares the masks at all corners, and returns how many there are. */
static uint32_t compare(const tw_topology *polygons, const tw_topology *quads, const double *values,
                        const double *refined) {
  tw_limit_entry *room = malloc(tw_limit_greatest_capacity(polygons) * sizeof *room),
                 *room_below = malloc(tw_limit_greatest_capacity(quads) * sizeof *room);
  tw_last_mask last = {.entries = malloc(tw_limit_greatest_capacity(polygons) * sizeof *room)};
  for (uint32_t c = 0; c < polygons->corner_count; c++) {
    double own[3], kept[3], step[3];
    sum(room, tw_limit_mask(polygons, false, c, room), values, own);
    sum(room_below, tw_limit_mask(quads, false, 4 * c, room_below), refined, step);
    for (int k = 0; k < 3; k++) assert_float_equal(own[k], step[k], 1e-5);
    sum(last.entries, tw_limit_mask_after(&last, polygons, false, c), values, kept);
    for (int k = 0; k < 3; k++) assert_float_equal(own[k], kept[k], 0);
  }
  free(room);
  free(room_below);
  free(last.entries);
  return polygons->corner_count;
}

static uint32_t try_torus(bool triangles, bool torn, bool sharp, uint32_t *seed) {
  const tw_rules rules = {0};
  soup s = torus(triangles, torn, seed);
  tw_arena *arena = tw_arena_create();
  tw_topology t, child;
  assert_int_equal(tw_topology_build(&t, arena, SIDE * SIDE, s.face_count, triangles ? NULL : s.offsets,
                                     s.offsets[s.face_count], s.corners),
                   TW_OK);
  assert_int_equal(tw_topology_soften(&t, arena), TW_OK);
  for (uint32_t e = 0; sharp && e < t.edge_count; e++)
    if (below(seed, 6) == 0) t.edge_sharpness[e] = TW_SHARPNESS_INFINITE;
  for (uint32_t v = 0; sharp && v < t.vertex_count; v++)
    if (below(seed, 12) == 0) t.vertex_sharpness[v] = TW_SHARPNESS_INFINITE;
  tw_topology_sharpen(&t, false);
  assert_int_equal(tw_refine_topology(&t, &rules, arena, NULL, &child), TW_OK);
  double *values = malloc(t.vertex_count * sizeof *values),
         *refined = malloc(child.vertex_count * sizeof *refined);
  for (uint32_t v = 0; v < t.vertex_count; v++) values[v] = below(seed, 1000) * 0.002 - 1;
  assert_int_equal(tw_refine_values(&t, &rules, 1, values, NULL, refined), TW_OK);
  t.polygonal = true;
  uint32_t compared = compare(&t, &child, values, refined);
  free(values);
  free(refined);
  tw_arena_destroy(arena);
  return compared;
}

TEST(masks_of_polygons_are_those_of_the_quads_below) {
  uint32_t seed = 5, compared = 0;
  for (uint32_t i = 0; i < 64; i++) compared += try_torus(i & 1, i & 2, i & 4, &seed);
  assert_true(compared > 64 * 150);
}
