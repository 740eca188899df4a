/* Bounds of the distance between the triangles of each level and the limit surface.
 * tests/oracle/error_test.cpp compares them with OpenSubdiv's. */
#include <math.h>
#include <stdatomic.h>

#include "cube.h"
#include "host.h"
#include "test.h"
#include "torus_cage.h"

enum { LEVELS = 9 };

static void find_errors(const tw_mesh *mesh, const tw_surface_options *options, double out[LEVELS]) {
  const tw_error_wish wish = {.level_max = LEVELS - 1};
  tw_error error;
  if (tw_surface_errors(mesh, options, &wish, NULL, out, &error) != TW_OK) fail_msg("%s", error.detail);
}

static float flat(float x, float y) {
  return 0 * x * y;
}

/* Points that are moved within the plane, so far that each face is surrounded by very unlike ones, leave the
 * surface as flat as it was. */
TEST(faces_of_unlike_shapes_are_flat_where_the_surface_is) {
  enum { SIDE = 12 };
  cage *c = grid(SIDE, SIDE, false, flat);
  double errors[LEVELS];
  float step = c->points[1][0] - c->points[0][0];
  unsigned random = 7;
  for (int i = 0; i < SIDE * SIDE; i++)
    for (int k = 0; k < 2; k++) {
      bool is_inside = i % SIDE > 0 && i % SIDE < SIDE - 1 && i / SIDE > 0 && i / SIDE < SIDE - 1;
      random = random * 1664525U + 1013904223U;
      if (is_inside) c->points[i][k] += 0.35F * step * ((float)(random >> 16) / 32768 - 1);
    }
  find_errors(&c->mesh, &(tw_surface_options){0}, errors);
  for (int level = 0; level < LEVELS; level++)
    if (!(errors[level] < 1e-5)) fail_msg("level %d: %g, a side is %g", level, errors[level], (double)step);
  free(c);
}

static float bowl(float x, float y) {
  return x * x + y * y;
}

/* Coordinates up to 8 round to floats by 5e-7 at most. */
TEST(flat_grids_are_their_own_limit) {
  for (int bilinear = 0; bilinear < 2; bilinear++) {
    const tw_scheme scheme = bilinear ? TW_BILINEAR : TW_CATMULL_CLARK;
    cage *c = grid(8, 8, false, flat);
    double errors[LEVELS];
    find_errors(&c->mesh, &(tw_surface_options){.scheme = scheme}, errors);
    for (int level = 0; level < LEVELS; level++)
      if (!(errors[level] < 1e-5)) fail_msg("scheme %d, level %d: %g", (int)scheme, level, errors[level]);
    free(c);
  }
}

/* A point of a grid of squares is lifted by a sixth of its two second differences, 2 each along the edges. */
TEST(a_bowl_is_as_far_as_its_second_differences_say) {
  cage *c = grid(8, 8, false, bowl);
  double errors[LEVELS], step = (double)c->points[1][0] - (double)c->points[0][0];
  find_errors(&c->mesh, &(tw_surface_options){0}, errors);
  for (int level = 0; level < 4; level++) {
    double exact = 2 * step * step * 2 / 6 / pow(4, level);
    assert_true(errors[level] >= exact * 0.5); /* along slopes the way to the surface is shorter */
    assert_true(errors[level] <= exact * 2.5);
  }
  free(c);
}

static float waves(float x, float y) {
  float square = (x - 20) * (x - 20) + (y - 20) * (y - 20);
  return 8 * expf(-square / 40) * sinf(1.7f * x) * cosf(1.3f * y);
}

/* Each triangle has an irregular point. There is no room for all levels around all of them, but there is for
 * those that matter. */
TEST(the_farthest_of_too_many_irregular_faces_are_followed) {
  cage *c = grid(41, 41, true, waves);
  double errors[LEVELS];
  find_errors(&c->mesh, &(tw_surface_options){0}, errors);
  if (!(errors[5] < errors[0] / 100)) fail_msg("%g at level 5, %g at level 0", errors[5], errors[0]);
  free(c);
}

/* Regular quads of split triangles have neighbours of unlike shapes, so that points of the limit surface lie
 * far beside their own. They lie over the quads around all the same, and errors fall as distances do. */
TEST(errors_of_a_fine_torus_of_triangles_fall) {
  enum { LONG = 120, ROUND = 30 };
  if (is_sanitized()) skip(); /* cages of every kind, below, take the same ways through the library */
  cage *c = new_cage_for(LONG * ROUND, 2 * LONG * ROUND);
  double errors[LEVELS];
  for (uint32_t i = 0; i < LONG; i++)
    for (uint32_t k = 0; k < ROUND; k++) {
      float along = 6.2831853F * (float)i / LONG, round = 6.2831853F * (float)k / ROUND,
            radius = 3 + cosf(round);
      add_point(c, radius * cosf(along), radius * sinf(along), sinf(round));
    }
  for (uint32_t i = 0; i < LONG; i++)
    for (uint32_t k = 0; k < ROUND; k++) {
      uint32_t after = (i + 1) % LONG * ROUND, up = (k + 1) % ROUND;
      add_quad(c, (const uint32_t[4]){i * ROUND + k, after + k, after + up, i * ROUND + up}, true);
    }
  find_errors(&c->mesh, &(tw_surface_options){0}, errors);
  if (!(errors[2] < errors[0] / 3)) fail_msg("%g at level 2, %g at level 0", errors[2], errors[0]);
  free(c);
}

/* Where no deeper level has room, errors around irregular points still fall from level to level. */
TEST(irregular_faces_without_room_still_come_nearer) {
  for (int limit = 0; limit < 2; limit++) {
    cage *c = torus(TORUS_TURNED_TRIANGLES, NO_GAPS, false);
    const tw_surface_options options = {.limit = limit == 1};
    const tw_error_wish wish = {.level_max = LEVELS - 1, .faces_max = 256};
    double errors[LEVELS], roomy[LEVELS];
    find_errors(&c->mesh, &options, roomy);
    assert_int_equal(tw_surface_errors(&c->mesh, &options, &wish, NULL, errors, NULL), TW_OK);
    for (int level = 3; level < LEVELS; level++)
      if (!(errors[level] < errors[level - 1] / 1.4))
        fail_msg("level %d: %g after %g", level, errors[level], errors[level - 1]);
    for (int level = 0; level < LEVELS; level++)
      if (!(errors[level] < 8 * roomy[level]))
        fail_msg("level %d: %g, %g", level, errors[level], roomy[level]);
    free(c);
  }
}

/* From -1 to 1, different for each i. */
static float noise(uint32_t i) {
  return (float)(i * 2654435761u % 2001) / 1000 - 1;
}

/* A noisy scan with holes has irregular points at borders, of which no measure tells but deeper levels. Where
 * there is no room for all of these at once, levels are told about as closely, down to what is enough. */
TEST(noisy_scans_with_holes_need_no_room_for_all_levels_at_once) {
  enum { SIDE = 24 };
  const tw_error_wish roomy = {.level_max = LEVELS - 1, .enough = 1e-3},
                      tight = {.level_max = LEVELS - 1, .enough = 1e-3, .faces_max = 16384};
  const tw_surface_options options = {0};
  double errors[2][LEVELS];
  cage *c = new_cage_for(SIDE * SIDE, 2 * SIDE * SIDE);
  for (uint32_t i = 0; i < SIDE * SIDE; i++) {
    float along = 6.2831853F / SIDE * ((float)(i % SIDE) + 0.3F * noise(3 * i)),
          round = 6.2831853F / SIDE * ((float)(i / SIDE) + 0.3F * noise(3 * i + 1)),
          width = 0.4F + 0.03F * noise(3 * i + 2), radius = 1 + width * cosf(round);
    add_point(c, radius * cosf(along), radius * sinf(along), width * sinf(round));
  }
  for (uint32_t i = 0; i < SIDE * SIDE; i++) {
    uint32_t x = i % SIDE, y = i / SIDE, right = (x + 1) % SIDE, up = (y + 1) % SIDE * SIDE;
    const uint32_t quad[4] = {i, y * SIDE + right, up + right, up + x};
    const uint32_t turned[4] = {quad[1], quad[2], quad[3], quad[0]};
    if (noise(7 * i) > -0.4F) add_quad(c, noise(11 * i) > 0.2F ? turned : quad, true);
  }
  assert_int_equal(tw_surface_errors(&c->mesh, &options, &roomy, NULL, errors[0], NULL), TW_OK);
  assert_int_equal(tw_surface_errors(&c->mesh, &options, &tight, NULL, errors[1], NULL), TW_OK);
  for (int level = 0; level < LEVELS; level++)
    if (!(errors[1][level] < 2.5 * fmax(errors[0][level], roomy.enough)))
      fail_msg("level %d: %g, %g with room", level, errors[1][level], errors[0][level]);
  free(c);
}

/* A torus of triangles, cut either way, with noise of a third of an edge on its points: irregular throughout.
 */
static cage *noisy_torus(uint32_t length) {
  enum { ROUND = 14 };
  cage *c = new_cage_for(length * ROUND, 2 * length * ROUND);
  for (uint32_t i = 0; i < length * ROUND; i++) {
    float along = 6.2831853F / (float)length * (float)(i / ROUND),
          round = 6.2831853F / ROUND * (float)(i % ROUND), width = 1 + 0.15F * noise(i),
          radius = 3 + width * cosf(round);
    add_point(c, radius * cosf(along), radius * sinf(along), width * sinf(round));
  }
  for (uint32_t i = 0; i < length * ROUND; i++) {
    uint32_t row = i / ROUND * ROUND, after = (i / ROUND + 1) % length * ROUND, up = (i + 1) % ROUND;
    const uint32_t quad[4] = {i, after + i % ROUND, after + up, row + up};
    const uint32_t turned[4] = {quad[1], quad[2], quad[3], quad[0]};
    add_quad(c, noise(11 * i) > 0 ? turned : quad, true);
  }
  return c;
}

TEST(noisy_scans_are_told_as_closely_without_room_as_with_it) {
  const tw_error_wish roomy = {.level_max = LEVELS - 1, .enough = 1e-4, .faces_max = 1 << 24},
                      tight = {.level_max = LEVELS - 1, .enough = 1e-4, .faces_max = 1 << 14};
  const tw_surface_options options = {0};
  double errors[2][LEVELS];
  cage *c = noisy_torus(is_sanitized() ? 10 : 40);
  assert_int_equal(tw_surface_errors(&c->mesh, &options, &roomy, NULL, errors[0], NULL), TW_OK);
  assert_int_equal(tw_surface_errors(&c->mesh, &options, &tight, NULL, errors[1], NULL), TW_OK);
  for (int level = 0; level <= 4; level++)
    if (!(errors[1][level] < 1.4 * errors[0][level]))
      fail_msg("level %d: %g, %g with room", level, errors[1][level], errors[0][level]);
  free(c);
}

/* Wherever the work is called off, it ends, and what was not found is not read. */
TEST(errors_end_when_they_are_no_longer_wanted) {
  const tw_error_wish wish = {.level_max = 2, .enough = 1e-4, .faces_max = 1024};
  const uint32_t closeness = is_sanitized() ? 3 : 16;
  cage *c = noisy_torus(5);
  for (int limit = 0; limit < 2; limit++) {
    const tw_surface_options options = {.limit = limit};
    tw_status status = TW_CANCELLED;
    for (uint32_t asked = 0; status != TW_OK; asked += 1 + asked / closeness) {
      double errors[LEVELS];
      uint32_t left = asked;
      tw_meter meter;
      tw_meter_init(&meter, &(tw_meter_host){.owner = &left, .is_over = wants_no_more}, UINT64_MAX);
      tw_meter *before = tw_meter_use(&meter);
      status = tw_surface_errors(&c->mesh, &options, &wish, NULL, errors, NULL);
      tw_meter_use(before);
      assert_true(asked > 0 || status != TW_OK);
      assert_true(status == TW_OK || atomic_load(&meter.is_over));
    }
  }
  free(c);
}

TEST(each_level_is_nearer_and_deep_ones_four_times) {
  static const tw_surface_options options[] = {
      {0}, {.limit = true}, {.boundary = TW_BOUNDARY_EDGE_ONLY}, {.creasing = TW_CREASE_CHAIKIN}};
  for (size_t i = 0; i < sizeof options / sizeof *options; i++) {
    const tw_mesh mesh = cube();
    double errors[LEVELS];
    find_errors(&mesh, &options[i], errors);
    for (int level = 1; level < LEVELS; level++) assert_true(errors[level] < errors[level - 1] / 1.5);
    assert_true(errors[7] < errors[6] / 3 && errors[6] < errors[5] / 3);
  }
}

/* The corners of a cube of side 2 are 0.8660 away from the limit. */
TEST(a_cube_is_bounded_closely) {
  const tw_mesh mesh = cube();
  double errors[LEVELS];
  find_errors(&mesh, &(tw_surface_options){0}, errors);
  assert_true(errors[0] >= 0.8660 && errors[0] < 1.1);
}

/* Points of a limit surface lie beside the triangles that they come of, and slide to others that are steep. A
 * point 0.2630 away was found by sampling. */
TEST(points_beside_their_triangle_are_not_taken_for_nearer) {
  static const float points[][3] = {
      {1.12F, -0.52F, -0.02F},  {-0.05F, 0.82F, -0.01F}, {-0.32F, 1.02F, 0.36F},  {0.97F, -0.17F, 0.12F},
      {-1.28F, -0.40F, -0.16F}, {-0.91F, -0.05F, 0.28F}, {0.52F, -1.41F, 0.20F},  {-0.35F, -0.90F, 0.50F},
      {0.69F, 0.14F, -0.06F},   {-0.01F, 0.51F, -0.16F}, {-0.60F, 0.16F, 0.14F},  {0.29F, -0.66F, -0.09F},
      {0.17F, 0.83F, -0.44F},   {1.03F, -0.05F, -0.18F}, {-0.96F, 0.36F, -0.29F}, {0.36F, -0.98F, -0.11F}};
  static const uint32_t faces[][3] = {
      {0, 1, 2},    {0, 2, 3},   {1, 4, 5},   {1, 5, 2},   {4, 6, 7},   {4, 7, 5},    {6, 0, 7},
      {0, 3, 7},    {3, 2, 8},   {2, 9, 8},   {2, 5, 9},   {5, 10, 9},  {5, 7, 11},   {5, 11, 10},
      {7, 3, 8},    {7, 8, 11},  {8, 9, 12},  {8, 12, 13}, {9, 10, 12}, {10, 14, 12}, {10, 11, 15},
      {10, 15, 14}, {11, 8, 15}, {8, 13, 15}, {13, 12, 1}, {13, 1, 0},  {12, 14, 4},  {12, 4, 1},
      {14, 15, 6},  {14, 6, 4},  {15, 13, 0}, {15, 0, 6}};
  cage *c = new_cage();
  double errors[LEVELS];
  for (size_t i = 0; i < sizeof points / sizeof *points; i++)
    add_point(c, points[i][0], points[i][1], points[i][2]);
  for (size_t i = 0; i < sizeof faces / sizeof *faces; i++) add_face(c, faces[i], 3);
  find_errors(&c->mesh, &(tw_surface_options){.limit = true}, errors);
  if (!(errors[0] >= 0.2630)) fail_msg("%g", errors[0]);
  free(c);
}

TEST(infinitely_sharp_cubes_are_flat) {
  static const uint32_t edges[12][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                                        {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
  static const float sharpness[12] = {10, 10, 10, 10, 10, 10, 10, 10, 10, 10, 10, 10};
  tw_mesh mesh = cube();
  double errors[LEVELS];
  mesh.crease_count = 12;
  mesh.crease_edges = edges[0];
  mesh.crease_sharpness = sharpness;
  find_errors(&mesh, &(tw_surface_options){0}, errors);
  for (int level = 0; level < LEVELS; level++) assert_true(errors[level] < 1e-5);
}

TEST(semi_sharp_edges_are_told_until_they_have_decayed) {
  static const tw_surface_options options[] = {{0}, {.creasing = TW_CREASE_CHAIKIN}, {.limit = true}};
  for (size_t i = 0; i < sizeof options / sizeof *options; i++) {
    cage *c = torus(TORUS_QUADS, NO_GAPS, false);
    double soft[LEVELS], sharp[LEVELS];
    find_errors(&c->mesh, &options[i], soft);
    crease_some(c, 2.5f);
    find_errors(&c->mesh, &options[i], sharp);
    for (int level = 0; level < LEVELS; level++) assert_true(isfinite(sharp[level]) && sharp[level] > 0);
    assert_true(sharp[8] < sharp[3] / 20 && soft[8] < soft[3] / 200);
    free(c);
  }
}

TEST(semi_sharp_polygons_are_told_at_their_limit_points_too) {
  cage *c = torus(TORUS_MIXED, NO_GAPS, false);
  double errors[LEVELS];
  crease_some(c, 2.5f);
  find_errors(&c->mesh, &(tw_surface_options){.limit = true}, errors);
  assert_true(isfinite(errors[0]) && errors[0] >= errors[1]);
  free(c);
}

TEST(every_kind_of_cage_has_finite_bounds) {
  uint32_t number = 0;
  for (int faces = TORUS_TRIANGLES; faces <= TORUS_QUADS; faces++)
    for (int gaps = NO_GAPS; gaps <= GAPS_THAT_TOUCH; gaps++)
      for (int fin = 0; fin < 2; fin++) {
        if (number++ % test_stride() != 0) continue;
        cage *c = torus((torus_faces)faces, (torus_gaps)gaps, fin == 1);
        double errors[LEVELS];
        find_errors(&c->mesh, &(tw_surface_options){.limit = faces == TORUS_MIXED}, errors);
        for (int level = 0; level < LEVELS; level++) {
          assert_true(isfinite(errors[level]));
          assert_true(level == 0 || errors[level] <= errors[level - 1] + 1e-9);
        }
        free(c);
      }
}

/* What is enough saves levels, not honesty. */
TEST(errors_above_what_is_enough_are_the_same) {
  const tw_mesh mesh = cube();
  double all[LEVELS], some[LEVELS];
  find_errors(&mesh, &(tw_surface_options){0}, all);
  const tw_error_wish wish = {.level_max = LEVELS - 1, .enough = all[3]};
  assert_int_equal(tw_surface_errors(&mesh, &(tw_surface_options){0}, &wish, NULL, some, NULL), TW_OK);
  for (int level = 0; level < 3; level++)
    assert_true(some[level] >= all[level] && some[level] < all[level] * 1.2);
  for (int level = 3; level < LEVELS; level++) assert_true(some[level] >= all[level]);
  assert_true(some[4] <= all[3]);
}

TEST(what_has_no_bound_is_refused) {
  const tw_error_wish wish = {.level_max = 3};
  tw_error error;
  double errors[4];
  cage *c = grid(4, 4, false, flat);
  const tw_surface_options open = {.boundary = TW_BOUNDARY_OPEN}, loop = {.scheme = TW_LOOP};
  assert_int_equal(tw_surface_errors(&c->mesh, &open, &wish, NULL, errors, &error), TW_UNSUPPORTED);
  assert_int_equal(tw_surface_errors(&c->mesh, &loop, &wish, NULL, errors, &error), TW_INVALID);
  const tw_mesh closed = cube();
  assert_int_equal(tw_surface_errors(&closed, &open, &wish, NULL, errors, &error), TW_OK);
  /* Level 0 has the faces at the border that deeper levels leave out. */
  const tw_surface_options none = {.boundary = TW_BOUNDARY_NONE};
  assert_int_equal(tw_surface_errors(&c->mesh, &none, &wish, NULL, errors, &error), TW_OK);
  assert_true(isinf(errors[0]) && errors[1] < 1e-5);
  free(c);
}
