/* Welding vertex buffers into surfaces, and quads out of triangles. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cube.h"
#include "quad_pairing.h"
#include "test.h"
#include "weld.h"

enum { MOST = 64 };

/* Triangles over vertices, each with its own copy of the points that they name. */
static tw_soup split_soup(const float (*points)[3], const uint32_t *corners, uint32_t face_count,
                          float (*positions)[3], uint32_t *offsets, uint32_t *vertices) {
  for (uint32_t c = 0; c < 3 * face_count; c++) {
    memcpy(positions[c], points[corners[c]], sizeof positions[c]);
    vertices[c] = c;
  }
  for (uint32_t f = 0; f <= face_count; f++) offsets[f] = 3 * f;
  return (tw_soup){3 * face_count, positions[0], face_count, 3 * face_count, offsets, vertices,
                   NULL,           NULL,         NULL};
}

static uint32_t weld_soup(const tw_soup *soup, uint32_t *point_of_vertex) {
  tw_welded welded;
  uint8_t *left_out = malloc(soup->face_count);
  assert_non_null(left_out);
  assert_int_equal(tw_weld_points(soup, point_of_vertex, left_out, &welded, NULL), TW_OK);
  free(left_out);
  return welded.point_count;
}

static uint32_t weld(const float (*points)[3], const uint32_t *corners, uint32_t face_count,
                     uint32_t *point_of_vertex) {
  float positions[MOST][3];
  uint32_t offsets[MOST], vertices[MOST];
  tw_soup soup = split_soup(points, corners, face_count, positions, offsets, vertices);
  return weld_soup(&soup, point_of_vertex);
}

static const float octahedron_points[6][3] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                              {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
static const uint32_t octahedron[24] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4,
                                        2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};

TEST(a_closed_surface_of_loose_triangles_closes) {
  uint32_t points[MOST];
  assert_int_equal(weld(octahedron_points, octahedron, 8, points), 6);
  for (int a = 0; a < 24; a++)
    for (int b = 0; b < 24; b++) assert_int_equal(points[a] == points[b], octahedron[a] == octahedron[b]);
}

TEST(points_are_numbered_by_their_first_vertex) {
  uint32_t points[MOST], next = 0;
  weld(octahedron_points, octahedron, 8, points);
  for (int v = 0; v < 24; v++) {
    assert_true(points[v] <= next);
    if (points[v] == next) next++;
  }
}

TEST(surfaces_that_touch_in_a_point_stay_apart) {
  static const float points[5][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}};
  static const uint32_t corners[6] = {0, 1, 2, 0, 3, 4};
  uint32_t out[MOST];
  assert_int_equal(weld(points, corners, 2, out), 6);
}

/* Two closed surfaces with one edge in common: four sides run there. */
TEST(an_edge_of_four_sides_is_not_joined) {
  static const float points[6][3] = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 0, 0}, {1, 1, 0}, {-1, 1, 0}};
  static const uint32_t corners[12] = {0, 1, 2, 1, 0, 4, 0, 1, 3, 1, 0, 5};
  uint32_t out[MOST];
  assert_int_equal(weld(points, corners, 4, out), 12);
}

TEST(sides_that_run_the_same_way_are_not_joined) {
  static const float points[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
  static const uint32_t corners[6] = {0, 1, 2, 0, 1, 3};
  uint32_t out[MOST];
  assert_int_equal(weld(points, corners, 2, out), 6);
}

TEST(negative_zero_is_zero) {
  float positions[6][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, -0.0f, 0}, {-0.0f, 0, -0.0f}, {0, -1, 0}};
  static const uint32_t offsets[3] = {0, 3, 6}, corners[6] = {0, 1, 2, 3, 4, 5};
  tw_soup soup = {6, positions[0], 2, 6, offsets, corners, NULL, NULL, NULL};
  uint32_t out[6];
  assert_int_equal(weld_soup(&soup, out), 4);
}

/* A tube whose every vertex is its own: a seam runs along it that only edges can close. */
TEST(a_tube_of_loose_quads_closes_round) {
  enum { ROUND = 64, LONG = 50, FACES = ROUND * LONG };
  static float positions[4 * FACES][3];
  static uint32_t offsets[FACES + 1], corners[4 * FACES], out[4 * FACES];
  for (uint32_t f = 0; f < FACES; f++) {
    for (uint32_t k = 0; k < 4; k++) {
      uint32_t at = (f % ROUND + (k == 1 || k == 2)) % ROUND, along = f / ROUND + (k >= 2);
      positions[4 * f + k][0] = (float)cos(at * 6.283185307 / ROUND);
      positions[4 * f + k][1] = (float)sin(at * 6.283185307 / ROUND);
      positions[4 * f + k][2] = (float)along;
      corners[4 * f + k] = 4 * f + k;
    }
    offsets[f + 1] = 4 * f + 4;
  }
  tw_soup soup = {4 * FACES, positions[0], FACES, 4 * FACES, offsets, corners, NULL, NULL, NULL};
  assert_int_equal(weld_soup(&soup, out), ROUND * (LONG + 1));
}

/* As generators make it: (round + 1) x (tall + 1) vertices, the last column at an angle of 2 pi, a vertex
 * for each triangle at the poles, sines in 32 bits. */
TEST(a_sphere_closes_at_its_seam_and_poles) {
  enum { ROUND = 32, TALL = 16, VERTICES = (ROUND + 1) * (TALL + 1), FACES = 2 * ROUND * (TALL - 1) };
  static float positions[VERTICES][3];
  static uint32_t offsets[FACES + 1], corners[3 * FACES], out[VERTICES];
  uint32_t count = 0;
  for (uint32_t v = 0; v < VERTICES; v++) {
    uint32_t column = v % (ROUND + 1), row = v / (ROUND + 1);
    float round = (float)column * 6.2831853f / ROUND, down = (float)row * 3.1415927f / TALL;
    positions[v][0] = -5 * cosf(round) * sinf(down);
    positions[v][1] = 5 * cosf(down);
    positions[v][2] = 5 * sinf(round) * sinf(down);
  }
  for (uint32_t y = 0; y < TALL; y++)
    for (uint32_t x = 0; x < ROUND; x++) {
      uint32_t b = y * (ROUND + 1) + x, a = b + 1, c = b + ROUND + 1, d = c + 1;
      const uint32_t upper[3] = {a, b, d}, lower[3] = {b, c, d};
      if (y > 0) memcpy(corners + 3 * count++, upper, sizeof upper);
      if (y + 1 < TALL) memcpy(corners + 3 * count++, lower, sizeof lower);
    }
  for (uint32_t f = 0; f <= FACES; f++) offsets[f] = 3 * f;
  assert_int_equal(count, FACES);
  tw_soup soup = {VERTICES, positions[0], FACES, 3 * FACES, offsets, corners, NULL, NULL, NULL};
  /* Two vertices, the outer ones of the pole rows, are used by no triangle. */
  assert_int_equal(weld_soup(&soup, out), ROUND * (TALL - 1) + 2 + 2);
}

/* Everything in one place: the worst case for anything that hashes. */
TEST(vertices_in_one_place_take_no_longer) {
  enum { FACES = 300000 };
  float *positions = calloc(3 * FACES, 3 * sizeof(float));
  uint32_t *offsets = malloc((FACES + 1) * sizeof *offsets), *corners = malloc(3 * FACES * sizeof *corners);
  uint32_t *out = malloc(3 * FACES * sizeof *out);
  assert_true(positions && offsets && corners && out);
  for (uint32_t c = 0; c < 3 * FACES; c++) corners[c] = c;
  for (uint32_t f = 0; f <= FACES; f++) offsets[f] = 3 * f;
  for (uint32_t f = 0; f < FACES; f++) positions[9 * f + 3] = 1; /* a fan round two places */
  tw_soup soup = {3 * FACES, positions, FACES, 3 * FACES, offsets, corners, NULL, NULL, NULL};
  assert_int_equal(weld_soup(&soup, out), 3 * FACES);
  free(positions);
  free(offsets);
  free(corners);
  free(out);
}

/* ---- texture coordinates --------------------------------------------------------------------- */

/* Two squares side by side, split along their common edge; its texture is continuous or not. */
static uint32_t weld_square_uvs(float shift) {
  static const float positions[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                        {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}};
  static const uint32_t offsets[3] = {0, 4, 8}, corners[8] = {0, 1, 2, 3, 4, 5, 6, 7};
  tw_soup soup = {8, positions[0], 2, 8, offsets, corners, NULL, NULL, NULL};
  uint32_t points[8], values[8], count;
  count = weld_soup(&soup, points);
  assert_int_equal(count, 6);
  float uvs[8][2];
  for (int v = 0; v < 8; v++) {
    uvs[v][0] = positions[v][0];
    uvs[v][1] = positions[v][1];
  }
  uvs[7][0] += shift; /* one end of the common edge */
  assert_int_equal(tw_weld_values(&soup, points, 6, uvs[0], 2, values, &count, NULL), TW_OK);
  assert_int_equal(tw_weld_values(&soup, points, 5, uvs[0], 2, values, &count, NULL), TW_INVALID);
  return count;
}

TEST(a_continuous_texture_has_no_seam) {
  assert_int_equal(weld_square_uvs(0), 6);
}

TEST(an_edge_that_differs_at_one_end_is_a_seam) {
  assert_int_equal(weld_square_uvs(0.5f), 8);
}

/* ---- pairs ----------------------------------------------------------------------------------- */

static tw_mesh triangle_mesh(const float (*points)[3], uint32_t point_count, const uint32_t *corners,
                             uint32_t face_count, uint32_t *offsets) {
  for (uint32_t f = 0; f <= face_count; f++) offsets[f] = 3 * f;
  return mesh_of(points[0], point_count, corners, offsets, face_count);
}

/* Faces after pairing. */
static uint32_t pair(tw_mesh mesh, uint32_t *first_quad) {
  tw_arena *arena = tw_arena_create();
  assert_non_null(arena);
  assert_int_equal(tw_pair_triangles(&mesh, arena, NULL), TW_OK);
  tw_error error;
  assert_int_equal(tw_mesh_check(&mesh, &error, NULL), TW_OK);
  if (first_quad) memcpy(first_quad, mesh.corners, 4 * sizeof *first_quad);
  tw_arena_destroy(arena);
  return mesh.face_count;
}

/* A row of unit squares; each one split along a diagonal. */
static const float row_points[8][3] = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0},
                                       {0, 1, 0}, {1, 1, 0}, {2, 1, 0}, {3, 1, 0}};

TEST(split_quads_are_joined_whatever_their_diagonal) {
  static const uint32_t rows[3][18] = {
      {0, 1, 5, 0, 5, 4, 1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6},
      {0, 1, 4, 1, 5, 4, 1, 2, 5, 2, 6, 5, 2, 3, 6, 3, 7, 6},
      {5, 4, 1, 4, 0, 1, 6, 5, 1, 6, 1, 2, 7, 6, 3, 2, 3, 6},
  };
  uint32_t offsets[MOST], quad[4];
  for (int i = 0; i < 3; i++)
    assert_int_equal(pair(triangle_mesh(row_points, 8, rows[i], 6, offsets), quad), 3);
  pair(triangle_mesh(row_points, 8, rows[0], 6, offsets), quad);
  static const uint32_t first[4] = {0, 1, 5, 4};
  assert_memory_equal(quad, first, sizeof first);
}

/* A triangle in front would throw a greedy pairing out of step. */
TEST(a_lone_triangle_does_not_shift_the_pairs) {
  static const float points[6][3] = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}, {1, 1, 0}, {-0.6f, 0.5f, 0}};
  static const uint32_t corners[9] = {5, 0, 3, 0, 4, 3, 0, 1, 4}; /* triangle, then a square's halves */
  uint32_t offsets[MOST];
  tw_mesh mesh = triangle_mesh(points, 6, corners, 3, offsets);
  tw_arena *arena = tw_arena_create();
  assert_int_equal(tw_pair_triangles(&mesh, arena, NULL), TW_OK);
  assert_int_equal(mesh.face_count, 2);
  assert_int_equal(mesh.face_offsets[1], 3);
  assert_int_equal(mesh.face_offsets[2], 7);
  tw_arena_destroy(arena);
}

TEST(pairs_that_make_no_good_quad_are_left) {
  static const float points[6][3] = {{0, 0, 0},       {1, 0, 0}, {0, 1, 0},
                                     {0.2f, 0.2f, 0}, {1, 1, 0}, {0.5f, 0.5f, 1}};
  static const uint32_t concave[6] = {0, 1, 3, 0, 3, 2}, same_way[6] = {0, 1, 2, 1, 2, 4},
                        bent[6] = {0, 1, 2, 2, 1, 5}, flat[6] = {0, 1, 2, 2, 1, 4};
  uint32_t offsets[MOST];
  assert_int_equal(pair(triangle_mesh(points, 6, flat, 2, offsets), NULL), 1);
  assert_int_equal(pair(triangle_mesh(points, 6, concave, 2, offsets), NULL), 2);
  assert_int_equal(pair(triangle_mesh(points, 6, same_way, 2, offsets), NULL), 2);
  assert_int_equal(pair(triangle_mesh(points, 6, bent, 2, offsets), NULL), 2);
}

TEST(materials_and_seams_keep_triangles_apart) {
  static const uint32_t corners[6] = {0, 1, 5, 0, 5, 4};
  static const int32_t same[2] = {1, 1}, different[2] = {1, 2};
  static const float values[6][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {5, 5}, {6, 6}};
  static const uint32_t continuous[6] = {0, 1, 2, 0, 2, 3}, seam[6] = {0, 1, 2, 4, 5, 3};
  uint32_t offsets[MOST];
  tw_mesh mesh = triangle_mesh(row_points, 8, corners, 2, offsets);
  mesh.face_materials = same;
  assert_int_equal(pair(mesh, NULL), 1);
  mesh.face_materials = different;
  assert_int_equal(pair(mesh, NULL), 2);
  mesh.face_materials = NULL;
  mesh.uv_set_count = 1;
  mesh.uv_sets[0] = (tw_uv_set){6, values[0], continuous};
  assert_int_equal(pair(mesh, NULL), 1);
  mesh.uv_sets[0].corners = seam;
  assert_int_equal(pair(mesh, NULL), 2);
}

/* ---- what moves apart ------------------------------------------------------------------------ */

/* Strips of quads along x, four vertices each, at places of a coarse grid, so that many coincide. */
enum { STRIPS = 60, KINDS = 3 };

static int compare_kinds(const void *kinds, uint32_t a, uint32_t b) {
  const uint8_t *kind = kinds;
  return kind[a] - kind[b];
}

/* Whether quads a and b have opposite sides between the same two places, of the same kinds, and no third quad
 * has a side there: the plain reading of what tw_weld_points promises. */
static void join_plainly(const float (*at)[3], const uint8_t *kinds, uint32_t *point) {
  enum { VERTICES = 4 * STRIPS };
  bool again[STRIPS] = {false}; /* quads that are listed before: they do not count */
  for (uint32_t q = 0; q < STRIPS; q++)
    for (uint32_t o = 0; o < q; o++)
      again[q] |=
          memcmp(at[4 * q], at[4 * o], 4 * sizeof *at) == 0 && memcmp(kinds + 4 * q, kinds + 4 * o, 4) == 0;
  for (uint32_t v = 0; v < VERTICES; v++) point[v] = v;
  for (uint32_t s = 0; s < VERTICES; s++) {
    if (again[s / 4]) continue;
    uint32_t from = s, to = s / 4 * 4 + (s + 1) % 4, partner = UINT32_MAX, sides = 0, partner_end = 0;
    for (uint32_t o = 0; o < VERTICES; o++) {
      if (again[o / 4]) continue;
      uint32_t other_from = o, other_to = o / 4 * 4 + (o + 1) % 4;
#define SAME(a, b) (memcmp(at[a], at[b], sizeof *at) == 0 && kinds[a] == kinds[b])
      bool along = SAME(from, other_from) && SAME(to, other_to),
           against = SAME(from, other_to) && SAME(to, other_from);
#undef SAME
      sides += along || against;
      if (against) partner = other_to, partner_end = other_from;
    }
    if (sides != 2 || partner == UINT32_MAX) continue;
    uint32_t pairs[2][2] = {{from, partner}, {to, partner_end}};
    for (int p = 0; p < 2; p++) {
      uint32_t a = point[pairs[p][0]], b = point[pairs[p][1]], low = a < b ? a : b, high = a < b ? b : a;
      for (uint32_t v = 0; v < VERTICES; v++)
        if (point[v] == high) point[v] = low;
    }
  }
}

TEST(random_parts_that_move_apart_are_welded_as_a_plain_search_does) {
  static float at[4 * STRIPS][3];
  static uint8_t kinds[4 * STRIPS];
  static uint32_t offsets[STRIPS + 1], corners[4 * STRIPS], points[4 * STRIPS], plain[4 * STRIPS];
  uint32_t seed = 7, joined = 0, apart = 0;
  for (int round = 0; round < 200; round++) {
    for (uint32_t q = 0; q < STRIPS; q++) {
      uint32_t x = (seed = seed * 1664525 + 1013904223) >> 29, y = (seed = seed * 1664525 + 1013904223) >> 30,
               kind = ((seed = seed * 1664525 + 1013904223) >> 16) % KINDS;
      const uint32_t corner[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
      offsets[q + 1] = 4 * (q + 1);
      for (uint32_t k = 0; k < 4; k++) {
        corners[4 * q + k] = 4 * q + k;
        at[4 * q + k][0] = (float)(x + corner[k][0]);
        at[4 * q + k][1] = (float)(y + corner[k][1]);
        at[4 * q + k][2] = (float)(q % 5); /* a fifth of them may meet */
        kinds[4 * q + k] = (uint8_t)(round % 2 ? kind : 0);
      }
    }
    tw_soup soup = {4 * STRIPS, at[0], STRIPS, 4 * STRIPS, offsets, corners, compare_kinds, kinds, NULL};
    uint32_t count = weld_soup(&soup, points);
    join_plainly((const float(*)[3])at, kinds, plain);
    for (uint32_t a = 0; a < 4 * STRIPS; a++)
      for (uint32_t b = 0; b < a; b++) assert_int_equal(points[a] == points[b], plain[a] == plain[b]);
    joined += 4 * STRIPS - count;
    soup.compare = NULL;
    apart += weld_soup(&soup, points) != count;
  }
  assert_true(joined > 1000 && apart > 50);
}
