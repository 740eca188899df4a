/* Tangents of surfaces for normal maps: planes and cylinders, mirrored maps, maps that are none. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "evaluator.h"
#include "surface_rows.h"
#include "tangent_space.h"
#include "test.h"
#include "tweend/subdiv.h"

/* ---- meshes ---------------------------------------------------------------------------------- */

enum { POINTS_MAX = 200, CORNERS_MAX = 800 };

/* A mesh with one UV set, in arrays of its own. */
typedef struct sheet {
  tw_mesh mesh;
  float points[POINTS_MAX][3], uvs[CORNERS_MAX][2];
  uint32_t corners[CORNERS_MAX], uv_corners[CORNERS_MAX], offsets[CORNERS_MAX];
} sheet;

static sheet *new_sheet(void) {
  sheet *s = calloc(1, sizeof *s);
  assert_non_null(s);
  tw_mesh_init(&s->mesh);
  s->mesh.positions = s->points[0];
  s->mesh.corners = s->corners;
  s->mesh.face_offsets = s->offsets;
  s->mesh.uv_set_count = 1;
  s->mesh.uv_sets[0] = (tw_uv_set){0, s->uvs[0], s->uv_corners};
  s->mesh.has_tangents = true;
  return s;
}

static uint32_t add_point(sheet *s, float x, float y, float z) {
  float *point = s->points[s->mesh.point_count];
  point[0] = x;
  point[1] = y;
  point[2] = z;
  return s->mesh.point_count++;
}

static uint32_t add_uv(sheet *s, float u, float v) {
  float *uv = s->uvs[s->mesh.uv_sets[0].value_count];
  uv[0] = u;
  uv[1] = v;
  return s->mesh.uv_sets[0].value_count++;
}

static void add_face(sheet *s, uint32_t size, const uint32_t *points, const uint32_t *uvs) {
  memcpy(s->corners + s->mesh.corner_count, points, size * sizeof *points);
  memcpy(s->uv_corners + s->mesh.corner_count, uvs, size * sizeof *uvs);
  s->mesh.corner_count += size;
  s->offsets[++s->mesh.face_count] = s->mesh.corner_count;
}

/* u = m[0] x + m[1] y, v = m[2] x + m[3] y. */
static void map_affinely(sheet *s, const float m[4]) {
  for (uint32_t p = 0; p < s->mesh.point_count; p++) {
    const float *at = s->points[p];
    add_uv(s, m[0] * at[0] + m[1] * at[1], m[2] * at[0] + m[3] * at[1]);
  }
}

/* A plane of triangles, quads and a hexagon, with inner points of valence 3, 5 and 6. */
static sheet *patchwork(const float map[4]) {
  static const float points[14][2] = {{0, 0},    {2, 0.2f}, {4, 0},       {0.1f, 2},   {2, 2},
                                      {4.2f, 2}, {0, 4},    {2, 4.1f},    {4, 4},      {1, 1},
                                      {3, 3.2f}, {6, 1},    {6.1f, 3.4f}, {5.2f, 4.4f}};
  static const uint32_t faces[][7] = {
      {3, 0, 1, 9},    {3, 1, 4, 9},  {3, 4, 3, 9},  {3, 3, 0, 9},     {4, 1, 2, 5, 4},
      {4, 3, 4, 7, 6}, {3, 4, 5, 10}, {3, 5, 8, 10}, {4, 4, 10, 8, 7}, {6, 2, 11, 12, 13, 8, 5}};
  sheet *s = new_sheet();
  for (int i = 0; i < 14; i++) add_point(s, points[i][0], points[i][1], 0);
  for (size_t f = 0; f < sizeof faces / sizeof *faces; f++)
    add_face(s, faces[f][0], faces[f] + 1, faces[f] + 1);
  map_affinely(s, map);
  return s;
}

/* A tube round the z axis with a seam: u runs once round, v along. */
static sheet *tube(uint32_t sides, uint32_t rings) {
  sheet *s = new_sheet();
  for (uint32_t r = 0; r < rings; r++)
    for (uint32_t i = 0; i < sides; i++) {
      double angle = 2 * 3.14159265358979 * i / sides;
      add_point(s, (float)cos(angle), (float)sin(angle), (float)r);
    }
  for (uint32_t r = 0; r < rings; r++)
    for (uint32_t i = 0; i <= sides; i++) add_uv(s, (float)i / (float)sides, (float)r / (float)rings);
  for (uint32_t r = 0; r + 1 < rings; r++)
    for (uint32_t i = 0; i < sides; i++) {
      uint32_t a = r * sides + i, b = r * sides + (i + 1) % sides, u = r * (sides + 1) + i;
      add_face(s, 4, (uint32_t[]){a, b, b + sides, a + sides},
               (uint32_t[]){u, u + 1, u + sides + 2, u + sides + 1});
    }
  return s;
}

/* Two quads deep, six wide, u = |x|: both halves share the middle's UVs. */
static sheet *folded(void) {
  sheet *s = new_sheet();
  for (int y = 0; y < 3; y++)
    for (int x = -3; x <= 3; x++) {
      add_point(s, (float)x, (float)y, 0);
      add_uv(s, fabsf((float)x) / 3, (float)y / 3);
    }
  for (uint32_t y = 0; y < 2; y++)
    for (uint32_t x = 0; x < 6; x++) {
      uint32_t a = 7 * y + x, face[4] = {a, a + 1, a + 8, a + 7};
      add_face(s, 4, face, face);
    }
  return s;
}

/* ---- reading --------------------------------------------------------------------------------- */

static rows read_sheet(const sheet *s, tw_surface_options options) {
  options.normals = true;
  return read_rows(&s->mesh, options);
}

static double dot(const float a[3], const float b[3]) {
  return (double)a[0] * b[0] + (double)a[1] * b[1] + (double)a[2] * b[2];
}

/* What holds of any tangent. */
static void assert_frame(const rows *r, size_t i) {
  const float *normal = row_of(r, i) + r->layout->normal, *tangent = row_of(r, i) + r->layout->tangent;
  assert_float_equal(dot(tangent, tangent), 1, 1e-6);
  assert_float_equal(dot(tangent, normal), 0, 1e-6);
  assert_true(tangent[3] == 1 || tangent[3] == -1);
}

/* ---- one tangent ----------------------------------------------------------------------------- */

TEST(tangent_of_a_map_that_stands_still_is_along_the_face) {
  static const float normal[3] = {0, 0, 1}, points[8] = {2, 0, 1, 0, 0, 3, 0, 0}, none[8] = {0};
  float out[4];
  tw_tangent_from_derivatives(normal, points, none, false, out);
  assert_true(out[0] == 1 && out[1] == 0 && out[2] == 0 && out[3] == 1);
  tw_tangent_from_derivatives(normal, none, none, true, out);
  assert_float_equal(dot(out, out), 1, 1e-6);
  assert_float_equal(dot(out, normal), 0, 1e-6);
  assert_true(out[3] == -1);
}

TEST(tangent_of_a_map_without_v_is_along_growing_u) {
  static const float normal[3] = {0, 0, 1}, points[8] = {2, 0, 0, 0, 0, 2, 0, 0}, uvs[8] = {1, 0, 0, 0, -1};
  float out[4];
  tw_tangent_from_derivatives(normal, points, uvs, false, out);
  assert_float_equal(out[0], sqrt(0.5), 1e-6);
  assert_float_equal(out[1], -sqrt(0.5), 1e-6);
}

TEST(tangent_survives_any_scale) {
  static const float normal[3] = {0, 0, 1}, unit_points[8] = {1, 1, 0, 0, -1, 1},
                     unit_uvs[8] = {3, 1, 0, 0, -1, 3};
  float wanted[4], out[4], points[8], uvs[8];
  tw_tangent_from_derivatives(normal, unit_points, unit_uvs, false, wanted);
  for (int exponent = -100; exponent <= 60; exponent += 10) {
    for (int i = 0; i < 8; i++) {
      points[i] = ldexpf(unit_points[i], exponent);
      uvs[i] = ldexpf(unit_uvs[i], -exponent);
    }
    tw_tangent_from_derivatives(normal, points, uvs, false, out);
    assert_memory_equal(out, wanted, sizeof out);
  }
}

TEST(tangent_along_the_normal_gives_way) {
  static const float points[8] = {0, 0, 1, 0, 0, 0, 2}, uvs[8] = {1, 0, 0, 0, 0, 1};
  for (int axis = 0; axis < 3; axis++) {
    float normal[3] = {0, 0, 0}, out[4];
    normal[axis] = -1;
    tw_tangent_from_derivatives(normal, points, uvs, false, out);
    assert_float_equal(dot(out, out), 1, 1e-6);
    assert_float_equal(dot(out, normal), 0, 1e-6);
  }
}

/* ---- surfaces -------------------------------------------------------------------------------- */

TEST(tangents_come_only_where_they_are_asked_for) {
  sheet *s = tube(6, 4);
  tw_surface_options options = {.level = 1};
  tw_surface *surface = NULL;
  assert_int_equal(tw_surface_create(&s->mesh, &options, &surface, NULL), TW_OK);
  assert_int_equal(tw_surface_get_layout(surface)->tangent, UINT32_MAX); /* no normals */
  tw_surface_destroy(surface);
  options.normals = true;
  s->mesh.has_tangents = false;
  assert_int_equal(tw_surface_create(&s->mesh, &options, &surface, NULL), TW_OK);
  assert_int_equal(tw_surface_get_layout(surface)->tangent, UINT32_MAX); /* the source had none */
  tw_surface_destroy(surface);
  s->mesh.has_tangents = true;
  s->mesh.uv_set_count = 0;
  assert_int_equal(tw_surface_create(&s->mesh, &options, &surface, NULL), TW_OK);
  assert_int_equal(tw_surface_get_layout(surface)->tangent, UINT32_MAX); /* no UVs */
  tw_surface_destroy(surface);
  free(s);
}

TEST(plane_has_the_tangent_of_its_map_at_every_point) {
  static const float maps[][4] = {
      {1, 0, 0, 1}, {0.6f, 0.8f, -0.8f, 0.6f}, {1, 0.5f, 0, 2}, {-1, 0, 0, 1}, {0.3f, 1, 1, 0.2f}};
  for (size_t m = 0; m < sizeof maps / sizeof *maps; m++) {
    const float *map = maps[m];
    /* Where v = m2 x + m3 y stands still and u grows: (m3, -m2), turned by the sign of the area. */
    double area = (double)map[0] * map[3] - (double)map[1] * map[2], sign = area > 0 ? 1 : -1;
    double length = hypot(map[2], map[3]), wanted[2] = {sign * map[3] / length, -sign * map[2] / length};
    sheet *s = patchwork(map);
    for (uint32_t level = 0; level <= 4; level++)
      for (int limit = 0; limit < 2; limit++) {
        rows r = read_sheet(s, (tw_surface_options){.level = level, .limit = limit});
        for (size_t i = 0; i < r.count; i++) {
          const float *tangent = row_of(&r, i) + r.layout->tangent;
          assert_frame(&r, i);
          assert_float_equal(tangent[0], wanted[0], 2e-5);
          assert_float_equal(tangent[1], wanted[1], 2e-5);
          assert_true(tangent[3] == (float)sign);
        }
        free_rows(&r);
      }
    free(s);
  }
}

/* A regular grid, on which surfaces are as linear as their UVs. */
TEST(linear_uvs_have_the_tangent_of_their_map) {
  static const float map[4] = {1, 0.5f, -0.25f, 0.75f};
  const float length = hypotf(0.25f, 0.75f);
  sheet *s = folded();
  s->mesh.uv_sets[0].value_count = 0;
  map_affinely(s, map);
  for (uint32_t level = 0; level <= 4; level++) {
    rows r = read_sheet(s, (tw_surface_options){.level = level, .uv = TW_UV_ALL});
    for (size_t i = 0; i < r.count; i++) {
      const float *tangent = row_of(&r, i) + r.layout->tangent;
      assert_float_equal(tangent[0], 0.75f / length, 1e-5);
      assert_float_equal(tangent[1], 0.25f / length, 1e-5);
    }
    free_rows(&r);
  }
  free(s);
}

TEST(tube_has_tangents_round_its_axis) {
  static const tw_uv_rule rules[] = {TW_UV_CORNERS_ONLY, TW_UV_CORNERS_PLUS2, TW_UV_BOUNDARIES, TW_UV_ALL};
  sheet *s = tube(7, 5);
  for (size_t rule = 0; rule < sizeof rules / sizeof *rules; rule++)
    for (uint32_t level = 0; level <= 5; level++) {
      rows r = read_sheet(s, (tw_surface_options){.level = level, .limit = true, .uv = rules[rule]});
      for (size_t i = 0; i < r.count; i++) {
        const float *normal = row_of(&r, i) + r.layout->normal, *tangent = row_of(&r, i) + r.layout->tangent;
        assert_frame(&r, i);
        assert_float_equal(normal[2], 0, 1e-5);
        assert_float_equal(tangent[0], -normal[1], 1e-4);
        assert_float_equal(tangent[1], normal[0], 1e-4);
        assert_true(tangent[3] == 1);
      }
      free_rows(&r);
    }
  free(s);
}

TEST(map_folded_over_splits_its_middle_and_keeps_both_sides_whole) {
  sheet *s = folded();
  for (uint32_t level = 0; level <= 4; level++) {
    rows r = read_sheet(s, (tw_surface_options){.level = level});
    size_t middle = (size_t)1 + (2u << level);
    assert_int_equal(r.count, tw_surface_get_counts(r.surface)->vertices + middle);
    size_t on_middle[2] = {0, 0};
    for (size_t i = 0; i < r.count; i++) {
      const float *row = row_of(&r, i), *tangent = row + r.layout->tangent;
      assert_frame(&r, i);
      assert_float_equal(tangent[0], tangent[3], 1e-5); /* u grows outward on both sides */
      if (row[0] == 0)
        on_middle[tangent[3] > 0]++;
      else
        assert_true((row[0] > 0) == (tangent[3] > 0));
    }
    assert_int_equal(on_middle[0], middle);
    assert_int_equal(on_middle[1], middle);
    free_rows(&r);
  }
  free(s);
}

TEST(every_triangle_has_one_handedness) {
  sheet *s = folded();
  rows r = read_sheet(s, (tw_surface_options){.level = 3});
  const tw_surface_counts *counts = tw_surface_get_counts(r.surface);
  uint32_t *corners = faces_of(&r, TW_DOMAIN_VERTICES);
  for (size_t c = 0; c < counts->corners; c++)
    assert_true(row_of(&r, corners[c])[r.layout->tangent + 3] ==
                row_of(&r, corners[c / 4 * 4])[r.layout->tangent + 3]);
  free(corners);
  free_rows(&r);
  free(s);
}

/* Two maps of one plane, the second turned by a quarter; groups tell which faces follow which. */
TEST(each_face_follows_its_own_uv_set) {
  static const float map[4] = {1, 0, 0, 1};
  static const uint8_t sets[10] = {0, 1, 1, 0, 0, 1, 0, 0, 1, 1};
  static const float along[2][2] = {{1, 0}, {0, 1}};
  sheet *s = patchwork(map);
  float turned[POINTS_MAX][2];
  for (uint32_t p = 0; p < s->mesh.point_count; p++) {
    turned[p][0] = s->points[p][1];
    turned[p][1] = -s->points[p][0];
  }
  uint32_t groups[10];
  for (int f = 0; f < 10; f++) groups[f] = sets[f];
  s->mesh.uv_set_count = 2;
  s->mesh.uv_sets[1] = (tw_uv_set){s->mesh.point_count, turned[0], s->corners};
  s->mesh.face_groups = groups;
  s->mesh.tangent_uvs = sets;
  for (uint32_t level = 0; level <= 3; level++) {
    rows r = read_sheet(s, (tw_surface_options){.level = level});
    tw_surface_reader *reader = tw_surface_reader_create(r.surface);
    assert_int_equal(tw_surface_group_count(r.surface), 2);
    for (uint32_t set = 0; set < 2; set++) {
      const tw_surface_group *group = tw_surface_get_group(r.surface, set);
      for (uint64_t face = group->first_face; face < group->first_face + group->face_count; face++) {
        uint32_t corners[8], size;
        tw_surface_read_faces(reader, TW_DOMAIN_VERTICES, face, 1, &size, corners);
        for (uint32_t c = 0; c < size; c++) {
          const float *tangent = row_of(&r, corners[c]) + r.layout->tangent;
          assert_frame(&r, corners[c]);
          for (int i = 0; i < 2; i++) assert_float_equal(tangent[i], along[set][i], 2e-5);
          assert_true(tangent[3] == 1);
        }
      }
    }
    tw_surface_reader_destroy(reader);
    free_rows(&r);
  }
  free(s);
}

static bool is_near(const float *a, const float *b, uint32_t width, float tolerance) {
  for (uint32_t c = 0; c < width; c++)
    if (!(fabsf(a[c] - b[c]) <= tolerance)) return false;
  return true;
}

/* Whether a row stands among others: its point, normal, tangent and UVs. */
static bool stands_among(const rows *r, size_t i, const rows *others) {
  const tw_surface_layout *l = r->layout, *o = others->layout;
  for (size_t k = 0; k < others->count; k++)
    if (is_near(row_of(r, i), row_of(others, k), 3, 1e-5f) &&
        is_near(row_of(r, i) + l->normal, row_of(others, k) + o->normal, 3, 1e-4f) &&
        is_near(row_of(r, i) + l->uvs[0], row_of(others, k) + o->uvs[0], 2, 1e-5f) &&
        is_near(row_of(r, i) + l->tangent, row_of(others, k) + o->tangent, 4, 1e-3f))
      return true;
  return false;
}

/* A joint over 511 is for patches. */
static void assert_as_patches(sheet *s, tw_surface_options options) {
  static uint16_t joints[POINTS_MAX][4];
  static float weights[POINTS_MAX][4];
  rows levels = read_sheet(s, options);
  assert_ptr_equal(levels.surface->evaluator, &tw_shallow_evaluator);
  for (int p = 0; p < POINTS_MAX; p++) joints[p][0] = TW_SKIN_LEVEL_JOINTS_MAX;
  s->mesh.skin = (tw_skin_weights){.width = 4, .joints = joints[0], .weights = weights[0]};
  rows patches = read_sheet(s, options);
  assert_ptr_not_equal(patches.surface->evaluator, &tw_shallow_evaluator);
  s->mesh.skin = (tw_skin_weights){0};
  assert_int_equal(levels.count, patches.count);
  for (size_t i = 0; i < levels.count; i++) assert_true(stands_among(&levels, i, &patches));
  free_rows(&levels);
  free_rows(&patches);
}

/* Curved, with a seam, a crease, a fold of the map. (Slopes of linear UVs, and at sharp corners, are those
 * of any one face.) */
TEST(whole_levels_have_the_tangents_of_patches) {
  static const float sheared[4] = {1, 0.3f, -0.2f, 0.7f};
  static const tw_uv_rule rules[] = {TW_UV_NONE, TW_UV_CORNERS_ONLY, TW_UV_CORNERS_PLUS1};
  for (int shape = 0; shape < 3; shape++) {
    sheet *s = shape == 0 ? tube(7, 4) : shape == 1 ? folded() : patchwork(sheared);
    float sharpness[2] = {10, 1.5f};
    s->mesh.crease_count = 2;
    s->mesh.crease_edges = s->corners + 4;
    s->mesh.crease_sharpness = sharpness;
    for (uint32_t p = 0; p < s->mesh.point_count; p++) s->points[p][2] += 0.1f * (float)(p * p % 7);
    for (uint32_t v = 0; v < s->mesh.uv_sets[0].value_count; v++) s->uvs[v][1] += 0.02f * (float)(v * v % 5);
    for (uint32_t level = 1; level <= 3; level++)
      for (int limit = 0; limit < 2; limit++)
        for (int rule = 0; rule < 3; rule++) {
          bool regular = level == 3 && shape < 2; /* for patches as it is */
          if (!regular)
            assert_as_patches(s, (tw_surface_options){.level = level, .limit = limit, .uv = rules[rule]});
        }
    free(s);
  }
}

TEST(tangents_stay_frames_on_any_mesh) {
  uint32_t seed = 1;
  for (int round = 0; round < 60; round++) {
    static const float identity[4] = {1, 0, 0, 1};
    sheet *s = round % 2 ? tube(5, 4) : patchwork(identity);
    for (uint32_t c = 0; c < s->mesh.corner_count; c++) { /* seams and twisted maps everywhere */
      seed = seed * 1664525 + 1013904223;
      if (seed >> 24 < 60) s->uv_corners[c] = (seed >> 8) % s->mesh.uv_sets[0].value_count;
    }
    for (uint32_t p = 0; p < s->mesh.point_count; p++)
      for (int c = 0; c < 3; c++) {
        seed = seed * 1664525 + 1013904223;
        s->points[p][c] += (float)(seed >> 20) / 4096;
      }
    uint32_t edges[4] = {s->corners[0], s->corners[1], s->corners[1], s->corners[2]};
    float sharpness[2] = {round % 3 ? 10 : 1.5f, 0.7f};
    s->mesh.crease_count = 2;
    s->mesh.crease_edges = edges;
    s->mesh.crease_sharpness = sharpness;
    rows r = read_sheet(s, (tw_surface_options){.level = (uint32_t)round % 4,
                                                .limit = round % 5 == 0,
                                                .scheme = round % 7 == 0 ? TW_BILINEAR : TW_CATMULL_CLARK,
                                                .uv = (tw_uv_rule)(round % 6)});
    for (size_t i = 0; i < r.count; i++) assert_frame(&r, i);
    free_rows(&r);
    free(s);
  }
}

TEST(same_tangents_come_whatever_the_blocks) {
  sheet *s = tube(7, 4);
  for (uint32_t level = 0; level <= 4; level++) {
    rows r = read_sheet(s, (tw_surface_options){.level = level});
    assert_same_in_blocks(&r);
    free_rows(&r);
  }
  free(s);
}
