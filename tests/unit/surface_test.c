/* Subdivision surfaces: closed forms and invariants. OpenSubdiv's opinion is asked in tests/oracle. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "built_cage.h"
#include "cube.h"
#include "host.h"

static void assert_counts(const tw_mesh *mesh, tw_surface_options options, uint64_t v, uint64_t e,
                          uint64_t f) {
  tw_surface_counts counts;
  assert_int_equal(tw_surface_count(mesh, &options, &counts, NULL), TW_OK);
  assert_int_equal(counts.vertices, v);
  assert_int_equal(counts.edges, e);
  assert_int_equal(counts.faces, f);
}

/* ---- bad input ------------------------------------------------------------------------------- */

TEST(loop_refuses_a_quad_and_names_the_face) {
  tw_mesh mesh = cube();
  tw_surface_options options = {.level = 1, .scheme = TW_LOOP};
  tw_surface_counts counts;
  tw_error error;
  assert_int_equal(tw_surface_count(&mesh, &options, &counts, &error), TW_INVALID);
  assert_string_equal(error.pointer, "/faces/0");
}

TEST(counts_over_32_bits_are_refused) {
  tw_mesh mesh = cube();
  tw_surface_options options = {.level = 15};
  tw_surface_counts counts;
  assert_int_equal(tw_surface_count(&mesh, &options, &counts, NULL), TW_LIMIT);
  options.level = 17;
  assert_int_equal(tw_surface_count(&mesh, &options, &counts, NULL), TW_LIMIT);
}

/* Each of their corners is a row, and each row looks at them all. */
TEST(a_great_many_faces_on_the_same_points_have_no_normals) {
  enum { FACES = 20000 };
  static const float points[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  static uint32_t corners[3 * FACES], offsets[FACES + 1];
  for (uint32_t c = 0; c < 3 * FACES; c++) corners[c] = c % 3;
  for (uint32_t f = 0; f <= FACES; f++) offsets[f] = 3 * f;
  tw_mesh mesh = mesh_of(points[0], 3, corners, offsets, FACES);
  tw_surface *surface = NULL;
  tw_error error;
  tw_surface_options options = {.level = 0, .normals = true};
  assert_int_equal(tw_surface_create(&mesh, &options, &surface, &error), TW_LIMIT);
  assert_null(surface);
  options.normals = false;
  assert_int_equal(tw_surface_create(&mesh, &options, &surface, &error), TW_OK);
  tw_surface_destroy(surface);
  options.normals = true;
  mesh = mesh_of(points[0], 3, corners, offsets, FACES / 10);
  assert_int_equal(tw_surface_create(&mesh, &options, &surface, &error), TW_OK);
  tw_surface_destroy(surface);
}

TEST(a_mesh_without_faces_gives_an_empty_surface) {
  static const uint32_t offsets[1] = {0};
  tw_mesh mesh = mesh_of(cube_points[0], 2, NULL, offsets, 0);
  for (uint32_t level = 0; level < 3; level++) {
    tw_surface *surface = surface_of(&mesh, (tw_surface_options){.level = level, .normals = true});
    assert_int_equal(tw_surface_row_count(surface, TW_DOMAIN_VERTICES), 0);
    float min[3], max[3];
    assert_int_equal(tw_surface_bounds(surface, -1, min, max), TW_OK);
    tw_surface_destroy(surface);
  }
}

/* ---- closed forms ---------------------------------------------------------------------------- */

TEST(cube_has_26_then_98_vertices) {
  tw_mesh mesh = cube();
  assert_counts(&mesh, (tw_surface_options){.level = 0}, 8, 12, 6);
  assert_counts(&mesh, (tw_surface_options){.level = 1}, 26, 48, 24);
  assert_counts(&mesh, (tw_surface_options){.level = 2}, 98, 192, 96);
  assert_counts(&mesh, (tw_surface_options){.level = 9}, 1572866, 3145728, 1572864);
}

TEST(cube_corner_moves_to_five_ninths) {
  tw_mesh mesh = cube();
  rows r = read_rows(&mesh, (tw_surface_options){.level = 1});
  assert_int_equal(r.count, 26);
  for (int c = 0; c < 3; c++) assert_float_equal(r.values[c], -5.0f / 9, 1e-6);
  free_rows(&r);
}

/* ---- invariants ------------------------------------------------------------------------------ */

static float saddle(float x, float y) {
  return 0.2f * (x - 3) * (y - 2);
}

/* Two octahedra: in each, opposite points of the ring meet, so that tangents at the tips are parallel. */
TEST(tips_of_folds_have_one_normal_whatever_the_way) {
  enum { POINTS = 6, FACES = 8, COPIES = 2, LEVEL = 2 };
  static const float folded[POINTS][3] = {{0, 3, 0},     {0, -3, 1.5F},     {3, 1.5F, 0},
                                          {0, -1.5F, 3}, {-3, 1.5F, -1.5F}, {0, -1.5F, 3}};
  float points[COPIES * POINTS][3], colors[COPIES * POINTS][4];
  uint32_t corners[COPIES * FACES * 3], offsets[COPIES * FACES + 1] = {0}, *corner = corners;
  for (uint32_t copy = 0; copy < COPIES; copy++) {
    memcpy(points[copy * POINTS], folded, sizeof folded);
    for (uint32_t f = 0; f < FACES; f++) {
      uint32_t one = 2 + f % 4, next = 2 + (f + 1) % 4;
      *corner++ = copy * POINTS + f / 4;
      *corner++ = copy * POINTS + (f < 4 ? one : next);
      *corner++ = copy * POINTS + (f < 4 ? next : one);
    }
  }
  for (uint32_t f = 0; f <= COPIES * FACES; f++) offsets[f] = 3 * f;
  for (uint32_t p = 0; p < COPIES * POINTS; p++)
    for (int c = 0; c < 4; c++) colors[p][c] = 1;
  tw_mesh mesh = mesh_of(points[0], COPIES * POINTS, corners, offsets, COPIES * FACES);
  rows bare = read_rows(&mesh, (tw_surface_options){.level = LEVEL, .normals = true});
  mesh.attributes = &(tw_attribute){.name = "COLOR_0", .width = 4, .values = colors[0]};
  mesh.attribute_count = 1; /* which makes it refine in the generic way */
  rows coloured = read_rows(&mesh, (tw_surface_options){.level = LEVEL, .normals = true});
  assert_int_equal(bare.count, coloured.count);
  for (uint32_t p = 0; p < 2; p++)
    for (int c = 3; c < 6; c++) assert_float_equal(row_of(&bare, p)[c], row_of(&coloured, p)[c], 1e-5);
  free_rows(&bare);
  free_rows(&coloured);
}

TEST(faces_use_every_row_and_no_other) {
  cage *c = grid(5, 4, false, saddle);
  static const uint32_t holes[2] = {0, 7};
  c->mesh.holes = holes;
  c->mesh.hole_count = 2;
  for (uint32_t level = 0; level <= 4; level++) {
    rows r = read_rows(&c->mesh, (tw_surface_options){.level = level});
    const tw_surface_counts *counts = tw_surface_get_counts(r.surface);
    assert_int_equal(r.count, counts->vertices);
    uint32_t *corners = malloc((size_t)counts->corners * sizeof *corners);
    uint8_t *used = calloc(r.count, 1);
    tw_surface_reader *reader = tw_surface_reader_create(r.surface);
    size_t taken = 0;
    for (uint64_t face = 0; face < counts->faces; face += 3) {
      size_t step = counts->faces - face < 3 ? (size_t)(counts->faces - face) : 3;
      taken += tw_surface_read_faces(reader, TW_DOMAIN_VERTICES, face, step, NULL, corners + taken);
    }
    assert_int_equal(taken, counts->corners);
    for (size_t i = 0; i < taken; i++) {
      assert_true(corners[i] < r.count);
      used[corners[i]] = 1;
    }
    for (size_t i = 0; i < r.count; i++) assert_int_equal(used[i], 1);
    tw_surface_reader_destroy(reader);
    free(corners);
    free(used);
    free_rows(&r);
  }
  free(c);
}

TEST(a_plane_stays_a_plane_with_its_normal) {
  cage *c = grid(6, 6, false, NULL);
  for (uint32_t level = 0; level <= 4; level++) {
    rows r = read_rows(&c->mesh, (tw_surface_options){.level = level, .normals = true});
    for (size_t i = 0; i < r.count; i++) {
      assert_true(row_of(&r, i)[2] == 0);
      assert_float_equal(row_of(&r, i)[5], 1, 1e-6);
    }
    free_rows(&r);
  }
  free(c);
}

TEST(scaling_by_two_scales_the_surface_exactly) {
  cage *c = grid(6, 5, false, saddle);
  rows one = read_rows(&c->mesh, (tw_surface_options){.level = 4});
  for (uint32_t i = 0; i < c->mesh.point_count; i++)
    for (int k = 0; k < 3; k++) c->points[i][k] *= 2;
  rows two = read_rows(&c->mesh, (tw_surface_options){.level = 4});
  for (size_t i = 0; i < one.count * one.layout->stride; i++) assert_true(2 * one.values[i] == two.values[i]);
  free_rows(&one);
  free_rows(&two);
  free(c);
}

TEST(a_face_inside_an_infinite_crease_stays_flat_and_sharp) {
  tw_mesh mesh = cube();
  static const uint32_t creases[8] = {4, 5, 5, 6, 6, 7, 7, 4};
  static const float sharpness[4] = {10, 10, 10, 10};
  mesh.crease_count = 4;
  mesh.crease_edges = creases;
  mesh.crease_sharpness = sharpness;
  rows r = read_rows(&mesh, (tw_surface_options){.level = 4, .normals = true});
  size_t flat = 0;
  for (size_t i = 0; i < r.count; i++) flat += row_of(&r, i)[2] == 1 && row_of(&r, i)[5] > 0.9999f;
  /* 17 x 17 points, the crease's 64 among them once more with the normal of the other side. */
  assert_int_equal(flat, 17 * 17);
  assert_int_equal(r.count, tw_surface_get_counts(r.surface)->vertices + 64);
  free_rows(&r);
}

TEST(normals_of_a_cube_point_outward) {
  tw_mesh mesh = cube();
  rows r = read_rows(&mesh, (tw_surface_options){.level = 3, .normals = true});
  for (size_t i = 0; i < r.count; i++) {
    const float *p = row_of(&r, i);
    assert_float_equal(p[3] * p[3] + p[4] * p[4] + p[5] * p[5], 1, 1e-5);
    assert_true(p[0] * p[3] + p[1] * p[4] + p[2] * p[5] > 0.5f);
  }
  free_rows(&r);
}

TEST(bounds_are_those_of_the_rows) {
  static const uint32_t creases[4] = {8, 9, 9, 16};
  static const float sharpness[2] = {1.5f, 10};
  static const uint32_t holes[2] = {0, 7};
  for (uint32_t level = 0; level <= 5; level++)
    for (int boundary = TW_BOUNDARY_EDGE_AND_CORNER; boundary <= TW_BOUNDARY_OPEN; boundary++)
      for (int flags = 0; flags < 8; flags++) {
        cage *c = flags & 4 ? grid(9, 8, false, saddle) : NULL;
        tw_mesh mesh = c ? c->mesh : cube();
        if (flags & 4) {
          mesh.crease_count = 2;
          mesh.crease_edges = creases;
          mesh.crease_sharpness = sharpness;
          mesh.holes = holes;
          mesh.hole_count = 2;
        }
        rows r = read_rows(
            &mesh, (tw_surface_options){.level = level,
                                        .boundary = (tw_boundary)boundary,
                                        .limit = flags & 1,
                                        .normals = true,
                                        .creasing = flags & 2 ? TW_CREASE_CHAIKIN : TW_CREASE_UNIFORM});
        assert_exact_bounds(&r);
        free_rows(&r);
        free(c);
      }
}

TEST(bounds_do_not_depend_on_who_takes_which_part) {
  for (int flags = 0; flags < 8; flags++) {
    cage *c = flags & 1 ? grid(9, 8, false, saddle) : NULL;
    tw_mesh mesh = c ? c->mesh : cube();
    tw_surface_options options = {.level = flags & 1 ? 6 : 7,
                                  .limit = flags & 2,
                                  .creasing = flags & 4 ? TW_CREASE_CHAIKIN : TW_CREASE_UNIFORM};
    tw_surface *alone = surface_of(&mesh, options), *shared = surface_of(&mesh, options);
    uint32_t parts = 0;
    const tw_parallel_for parallel = {.owner = &parts, .run = run_backwards};
    float bounds[2][2][3];
    assert_int_equal(tw_surface_bounds(alone, -1, bounds[0][0], bounds[0][1]), TW_OK);
    assert_int_equal(tw_surface_bounds_by(shared, -1, &parallel, bounds[1][0], bounds[1][1]), TW_OK);
    assert_memory_equal(bounds[0], bounds[1], sizeof bounds[0]);
    assert_true(parts > 1);
    parts = 0;
    assert_int_equal(tw_surface_bounds_by(shared, -1, &parallel, bounds[1][0], bounds[1][1]), TW_OK);
    assert_int_equal(parts, 0); /* remembered */
    tw_surface_destroy(alone);
    tw_surface_destroy(shared);
    free(c);
  }
}
