/* Level 0 with the normals and tangents that a file has. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "built_cage.h"
#include "cube.h"

static const tw_surface_options own = {.normals = true, .own_normals = true};

/* A cube whose sides have a normal each, not all of them unit. */
static const float side_normals[6][3] = {{0, 0, -2},      {0, 0, 1}, {0, -1, 0},
                                         {0.6f, 0, 0.8f}, {0, 3, 0}, {-1, 0, 0}};
static uint32_t side_of_corner[24];

static tw_mesh flat_cube(void) {
  tw_mesh mesh = cube();
  for (uint32_t c = 0; c < 24; c++) side_of_corner[c] = c / 4;
  mesh.normals = (tw_corner_normals){.value_count = 6, .values = side_normals[0], .corners = side_of_corner};
  return mesh;
}

TEST(each_side_of_a_cube_has_its_own_normal) {
  tw_mesh mesh = flat_cube();
  rows r = read_rows(&mesh, own);
  uint32_t *faces = faces_of(&r, TW_DOMAIN_VERTICES);
  assert_int_equal(r.count, 24);
  for (uint32_t c = 0; c < 24; c++) {
    const float *row = row_of(&r, faces[c]), *normal = row + r.layout->normal, *given = side_normals[c / 4];
    float length = sqrtf(given[0] * given[0] + given[1] * given[1] + given[2] * given[2]);
    assert_memory_equal(row, cube_points[cube_corners[c]], 12);
    for (int i = 0; i < 3; i++) assert_true(fabsf(normal[i] - given[i] / length) < 1e-7f);
  }
  assert_memory_equal(row_of(&r, faces[12]) + r.layout->normal, side_normals[3], 12); /* to the bit */
  free(faces);
  free_rows(&r);
}

TEST(limits_levels_and_moves_have_no_use_for_them) {
  tw_mesh mesh = flat_cube(), bare = cube();
  const tw_surface_options cases[] = {{.normals = true},
                                      {.normals = true, .own_normals = true, .limit = true},
                                      {.normals = true, .own_normals = true, .movable = true},
                                      {.normals = true, .own_normals = true, .level = 1},
                                      {.own_normals = true}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    rows a = read_rows(&mesh, cases[i]), b = read_rows(&bare, cases[i]);
    assert_int_equal(a.count, b.count);
    assert_memory_equal(a.values, b.values, a.count * a.layout->stride * sizeof(float));
    free_rows(&a);
    free_rows(&b);
  }
}

TEST(equal_normals_share_a_vertex_whatever_their_index) {
  float same[24][3];
  uint32_t each[24];
  for (uint32_t c = 0; c < 24; c++) {
    memcpy(same[c], cube_points[cube_corners[c]], sizeof same[c]);
    each[c] = c;
  }
  tw_mesh mesh = cube();
  mesh.normals = (tw_corner_normals){.value_count = 24, .values = same[0], .corners = each};
  rows r = read_rows(&mesh, own);
  assert_int_equal(r.count, 8);
  same[5][0] = 0.5f; /* one corner of its own */
  rows split = read_rows(&mesh, own);
  assert_int_equal(split.count, 9);
  free_rows(&split);
  free_rows(&r);
}

TEST(a_corner_without_a_normal_has_that_of_the_limit) {
  tw_mesh mesh = flat_cube(), bare = cube();
  float values[6][3];
  memcpy(values, side_normals, sizeof values);
  memset(values[0], 0, sizeof values[0]);
  mesh.normals.values = values[0];
  rows r = read_rows(&mesh, own), limit = read_rows(&bare, own);
  uint32_t *faces = faces_of(&r, TW_DOMAIN_VERTICES), *limit_faces = faces_of(&limit, TW_DOMAIN_VERTICES);
  for (uint32_t c = 0; c < 24; c++) {
    const float *normal = row_of(&r, faces[c]) + r.layout->normal;
    if (c < 4)
      assert_memory_equal(normal, row_of(&limit, limit_faces[c]) + limit.layout->normal, 12);
    else
      assert_true(fabsf(normal[0] * values[c / 4][0] + normal[1] * values[c / 4][1] +
                        normal[2] * values[c / 4][2]) > 0.999f);
  }
  free(faces);
  free(limit_faces);
  free_rows(&r);
  free_rows(&limit);
}

/* A face of five corners, a triangle and quads, one of which is a hole, and a point that no face uses. */
TEST(faces_of_all_sizes_have_their_corners_normals) {
  cage *c = grid(4, 3, false, NULL);
  static const uint32_t triangle[3] = {0, 1, 12}, five[5] = {2, 3, 14, 15, 16}, hole = 2;
  static float values[64][3];
  static uint32_t corners[64];
  for (int i = 0; i < 6; i++) add_point(c, (float)i, -2 + 0.3f * (float)(i % 3), (float)i);
  add_face(c, triangle, 3);
  add_face(c, five, 5);
  c->mesh.hole_count = 1;
  c->mesh.holes = &hole;
  for (uint32_t i = 0; i < c->mesh.corner_count; i++) {
    values[i][i % 3] = 1;
    corners[i] = i;
  }
  c->mesh.normals = (tw_corner_normals){.value_count = 64, .values = values[0], .corners = corners};
  rows r = read_rows(&c->mesh, own);
  uint32_t *faces = faces_of(&r, TW_DOMAIN_VERTICES), written = 0;
  for (uint32_t f = 0; f < c->mesh.face_count; f++)
    for (uint32_t i = c->offsets[f]; i < c->offsets[f + 1] && f != hole; i++) {
      const float *row = row_of(&r, faces[written++]);
      assert_memory_equal(row, c->points[c->corners[i]], 12);
      assert_memory_equal(row + r.layout->normal, values[i], 12);
    }
  assert_int_equal(written, tw_surface_get_counts(r.surface)->corners);
  free(faces);
  free_rows(&r);
  free(c);
}

static int64_t peak_of(const tw_mesh *mesh, const tw_surface_options *options) {
  tw_meter meter;
  tw_surface *surface;
  tw_meter_init(&meter, &(tw_meter_host){0}, UINT64_MAX);
  tw_meter *before = tw_meter_use(&meter);
  assert_int_equal(tw_surface_create(mesh, options, &surface, NULL), TW_OK);
  tw_surface_destroy(surface);
  tw_meter_use(before);
  return atomic_load(&meter.peak);
}

/* Only OpenSubdiv's weights beside triangles need the first level, which has several times as many faces. */
TEST(a_level_0_needs_no_further_level) {
  enum { SIDE = 100 };
  static const float up[3] = {0, 0, 1};
  static uint32_t corners[6 * SIDE * SIDE];
  cage *c = new_cage_for((SIDE + 1) * (SIDE + 1), 2 * SIDE * SIDE);
  for (int i = 0; i < (SIDE + 1) * (SIDE + 1); i++)
    add_point(c, (float)(i % (SIDE + 1)), (float)(i / (SIDE + 1)), 0);
  for (uint32_t i = 0; i < SIDE * SIDE; i++) {
    uint32_t a = i / SIDE * (SIDE + 1) + i % SIDE;
    add_quad(c, (const uint32_t[4]){a, a + 1, a + SIDE + 2, a + SIDE + 1}, true);
  }
  c->mesh.normals = (tw_corner_normals){.value_count = 1, .values = up, .corners = corners};
  const tw_surface_options limit = {.normals = true}, bare = {.normals = false},
                           stepped = {.normals = true, .triangles = TW_TRIANGLES_SMOOTH};
  int64_t most = peak_of(&c->mesh, &stepped);
  assert_true(2 * peak_of(&c->mesh, &limit) < most);
  assert_true(2 * peak_of(&c->mesh, &own) < most);
  assert_true(3 * peak_of(&c->mesh, &bare) < most);
  free(c);
}

TEST(tangents_come_out_as_they_went_in) {
  static const float uvs[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  static const uint32_t all[4] = {0, 1, 2, 3};
  static const float normals[4][3] = {{0, 0, 1}, {0, 0, 1}, {0, 0.6f, 0.8f}, {0, 0, 1}};
  static const float tangents[4][4] = {{1, 0, 0, 1}, {0, 4, 0, -1}, {1, 0, 0, -0.5f}, {0, 0, 0, 1}};
  cage *c = grid(2, 2, false, NULL);
  c->mesh.uv_set_count = 1;
  c->mesh.uv_sets[0] = (tw_uv_set){4, uvs[0], all};
  c->mesh.has_tangents = true;
  c->mesh.normals =
      (tw_corner_normals){.value_count = 4, .values = normals[0], .tangents = tangents[0], .corners = all};
  rows r = read_rows(&c->mesh, own);
  uint32_t *faces = faces_of(&r, TW_DOMAIN_VERTICES);
  static const float expected[4][4] = {{1, 0, 0, 1}, {0, 1, 0, -1}, {1, 0, 0, -1}, {1, 0, 0, 1}};
  for (uint32_t i = 0; i < 4; i++) {
    const float *row = row_of(&r, faces[i]);
    assert_memory_equal(row + r.layout->normal, normals[i], 12);
    for (int k = 0; k < 4; k++)
      assert_true(fabsf(row[r.layout->tangent + (uint32_t)k] - expected[i][k]) < 1e-6f);
  }
  free(faces);
  free_rows(&r);
  free(c);
}
