/* Joint weights on surfaces: every joint's weight is a function that subdivides as positions do, and each
 * row shows its four heaviest. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "built_cage.h"
#include "cage.h"
#include "cube.h"
#include "evaluator.h"

/* ---- meshes ---------------------------------------------------------------------------------- */

enum { SIDE = 5, POINTS = SIDE * SIDE };

/* A grid with a diagonal here and there, an extra face on an inner edge (not manifold), creases, and what
 * each point hangs on. cut: triangles alone. */
typedef struct skinned {
  cage *c;
  tw_mesh mesh; /* the cage's, with the skin */
  uint16_t joints[POINTS][4];
  float weights[POINTS][4];
} skinned;

static skinned *new_skinned(bool creased, bool cut) {
  static const uint32_t edges[6][2] = {{10, 11}, {11, 12}, {12, 13}, {17, 18}, {18, 13}, {12, 17}};
  static const float sharpness[6] = {10, 10, 1.3f, 0.4f, 2.6f, 0.8f};
  skinned *s = calloc(1, sizeof *s);
  assert_non_null(s);
  s->c = new_cage();
  for (uint32_t p = 0; p < POINTS; p++)
    add_point(s->c, (float)(p % SIDE), (float)(p / SIDE), 0.1f * (float)(p * p % 7));
  for (uint32_t y = 0; y + 1 < SIDE; y++)
    for (uint32_t x = 0; x + 1 < SIDE; x++) {
      uint32_t a = y * SIDE + x, quad[4] = {a, a + 1, a + SIDE + 1, a + SIDE};
      add_quad(s->c, quad, cut || (x + 2 * y) % 5 == 0);
    }
  if (creased) add_face(s->c, (uint32_t[]){6, 7, 22}, 3);
  s->mesh = s->c->mesh;
  s->mesh.skin = (tw_skin_weights){.width = 4, .joints = s->joints[0], .weights = s->weights[0]};
  if (!creased) return s;
  s->mesh.crease_count = 6;
  s->mesh.crease_edges = edges[0];
  s->mesh.crease_sharpness = sharpness;
  return s;
}

static void free_skinned(skinned *s) {
  free(s->c);
  free(s);
}

static float noise(uint32_t *seed) {
  *seed = *seed * 1664525 + 1013904223;
  return (float)(*seed >> 8) / (float)(1 << 24);
}

/* Four joints out of `joint_count` for each point, the first ones neighbours. */
static void weigh(skinned *c, uint32_t joint_count) {
  uint32_t seed = joint_count;
  for (uint32_t p = 0; p < POINTS; p++) {
    float sum = 0;
    for (uint32_t k = 0; k < 4; k++) {
      c->joints[p][k] = (uint16_t)((p + k * 3) % joint_count);
      c->weights[p][k] = k < joint_count ? 0.05f + noise(&seed) : 0;
      sum += c->weights[p][k];
    }
    for (uint32_t k = 0; k < 4; k++) c->weights[p][k] /= sum;
  }
}

/* What holds of every row. */
static void assert_four(const rows *r, size_t i, uint32_t joint_count) {
  const float *joints = row_of(r, i) + r->layout->joints, *weights = row_of(r, i) + r->layout->weights;
  double sum = 0;
  for (int k = 0; k < 4; k++) {
    sum += (double)weights[k];
    assert_true(weights[k] >= 0 && weights[k] <= 1);
    assert_true(joints[k] >= 0 && joints[k] < (float)joint_count && joints[k] == floorf(joints[k]));
    if (weights[k] == 0) assert_true(joints[k] == 0);
    for (int before = 0; before < k && weights[k] > 0; before++)
      assert_true(weights[before] >= weights[k] && joints[before] != joints[k]);
  }
  assert_float_equal(sum, 1, 2e-7);
}

static float weight_of(const rows *r, size_t i, uint32_t joint) {
  for (uint32_t k = 0; k < 4; k++)
    if (row_of(r, i)[r->layout->joints + k] == (float)joint && row_of(r, i)[r->layout->weights + k] > 0)
      return row_of(r, i)[r->layout->weights + k];
  return 0;
}

static const tw_surface_options many_options[] = {
    {.level = 0},
    {.level = 0, .limit = true},
    {.level = 1},
    {.level = 1, .limit = true, .normals = true},
    {.level = 2, .normals = true},
    {.level = 3, .creasing = TW_CREASE_CHAIKIN},
    {.level = 3, .limit = true},
    {.level = 4, .triangles = TW_TRIANGLES_SMOOTH, .normals = true},
    {.level = 2, .scheme = TW_BILINEAR, .normals = true},
    {.level = 3, .boundary = TW_BOUNDARY_NONE},
    {.level = 3, .boundary = TW_BOUNDARY_EDGE_ONLY},
};
enum { MANY_OPTIONS = sizeof many_options / sizeof *many_options };

/* ---- weights --------------------------------------------------------------------------------- */

TEST(mesh_on_one_joint_stays_on_it) {
  skinned *c = new_skinned(true, false);
  for (uint32_t p = 0; p < POINTS; p++) {
    c->joints[p][p % 4] = 300;
    c->weights[p][p % 4] = 1;
  }
  for (int o = 0; o < MANY_OPTIONS; o++) {
    rows r = read_rows(&c->mesh, many_options[o]);
    for (size_t i = 0; i < r.count; i++) {
      assert_four(&r, i, 301);
      assert_true(row_of(&r, i)[r.layout->joints] == 300 && row_of(&r, i)[r.layout->weights] == 1);
    }
    free_rows(&r);
  }
  free_skinned(c);
}

TEST(four_joints_weigh_as_four_colours_do) {
  static float colors[POINTS][4];
  skinned *c = new_skinned(true, false);
  weigh(c, 4);
  for (uint32_t p = 0; p < POINTS; p++)
    for (int k = 0; k < 4; k++) colors[p][c->joints[p][k]] = c->weights[p][k];
  const tw_attribute as_colors = {.name = "COLOR_0", .width = 4, .is_color = true, .values = colors[0]};
  c->mesh.attributes = &as_colors;
  c->mesh.attribute_count = 1;
  for (int o = 0; o < MANY_OPTIONS; o++) {
    rows r = read_rows(&c->mesh, many_options[o]);
    for (size_t i = 0; i < r.count; i++) {
      assert_four(&r, i, 4);
      for (uint32_t k = 0; k < 4; k++)
        assert_float_equal(weight_of(&r, i, k), row_of(&r, i)[r.layout->attributes[0].column + k], 2e-6);
    }
    free_rows(&r);
  }
  free_skinned(c);
}

TEST(joints_follow_loop_as_colours_do) {
  static float colors[POINTS][4];
  skinned *c = new_skinned(true, true);
  weigh(c, 4);
  memset(colors, 0, sizeof colors);
  for (uint32_t p = 0; p < POINTS; p++)
    for (int k = 0; k < 4; k++) colors[p][c->joints[p][k]] = c->weights[p][k];
  const tw_attribute as_colors = {.name = "COLOR_0", .width = 4, .is_color = true, .values = colors[0]};
  c->mesh.attributes = &as_colors;
  c->mesh.attribute_count = 1;
  for (uint32_t level = 0; level <= 3; level++)
    for (int limit = 0; limit < 2; limit++) {
      rows r = read_rows(&c->mesh, (tw_surface_options){.level = level, .scheme = TW_LOOP, .limit = limit});
      for (size_t i = 0; i < r.count; i++) {
        assert_four(&r, i, 4);
        for (uint32_t k = 0; k < 4; k++)
          assert_float_equal(weight_of(&r, i, k), row_of(&r, i)[r.layout->attributes[0].column + k], 2e-6);
      }
      free_rows(&r);
    }
  free_skinned(c);
}

static int compare_falling(const void *left, const void *right) {
  float a = *(const float *)left, b = *(const float *)right;
  return a < b ? 1 : a > b ? -1 : 0;
}

/* Each joint's weights subdivided alone, as a displacement. */
TEST(rows_keep_the_four_heaviest_of_many_joints) {
  enum { JOINTS = 36, TARGETS = JOINTS / 3 };
  static float values[TARGETS][POINTS][3];
  const float *morphs[TARGETS];
  skinned *c = new_skinned(true, false);
  weigh(c, JOINTS);
  memset(values, 0, sizeof values);
  for (uint32_t p = 0; p < POINTS; p++)
    for (int k = 0; k < 4; k++) values[c->joints[p][k] / 3][p][c->joints[p][k] % 3] = c->weights[p][k];
  for (int t = 0; t < TARGETS; t++) morphs[t] = values[t][0];
  c->mesh.morph_count = TARGETS;
  c->mesh.morphs = morphs;
  for (int o = 0; o < MANY_OPTIONS; o++) {
    rows r = read_rows(&c->mesh, many_options[o]);
    for (size_t i = 0; i < r.count; i++) {
      assert_four(&r, i, JOINTS);
      const float *all = row_of(&r, i) + r.layout->morphs, *weights = row_of(&r, i) + r.layout->weights;
      float sorted[JOINTS];
      memcpy(sorted, all, sizeof sorted);
      qsort(sorted, JOINTS, sizeof *sorted, compare_falling);
      double sum = 0;
      for (int k = 0; k < 4; k++) sum += sorted[k] > 1e-7f ? (double)sorted[k] : 0;
      for (int k = 0; k < 4; k++) {
        double wanted = sorted[k] > 1e-7f ? (double)sorted[k] / sum : 0;
        assert_float_equal(weights[k], wanted, 5e-6);
        if (weights[k] > 0) {
          size_t joint = (size_t)row_of(&r, i)[r.layout->joints + (uint32_t)k];
          /* It may be one of two that are equal. */
          assert_float_equal(all[joint] / (float)sum, wanted, 5e-6);
        }
      }
    }
    free_rows(&r);
  }
  free_skinned(c);
}

static const tw_evaluator *evaluator_of(const tw_mesh *mesh, uint32_t level) {
  const tw_surface_options options = {.level = level};
  tw_surface *surface;
  assert_int_equal(tw_surface_create(mesh, &options, &surface, NULL), TW_OK);
  const tw_evaluator *evaluator = surface->evaluator;
  tw_surface_destroy(surface);
  return evaluator;
}

static size_t row_at(const rows *r, const float *point) {
  for (size_t i = 0; i < r->count; i++) {
    const float *row = row_of(r, i);
    if (fabsf(row[0] - point[0]) + fabsf(row[1] - point[1]) + fabsf(row[2] - point[2]) < 1e-5f) return i;
  }
  fail();
  return 0;
}

/* Joints over 511 are for patches, whose rows are the same in another order. */
static void assert_as_patches(skinned *c, tw_surface_options options) {
  enum { FAR = TW_SKIN_LEVEL_JOINTS_MAX };
  rows levels = read_rows(&c->mesh, options);
  assert_ptr_equal(evaluator_of(&c->mesh, options.level), &tw_shallow_evaluator);
  for (uint32_t p = 0; p < POINTS; p++)
    for (int k = 0; k < 4; k++) c->joints[p][k] += FAR;
  rows patches = read_rows(&c->mesh, options);
  assert_ptr_not_equal(evaluator_of(&c->mesh, options.level), &tw_shallow_evaluator);
  for (uint32_t p = 0; p < POINTS; p++)
    for (int k = 0; k < 4; k++) c->joints[p][k] -= FAR;
  assert_int_equal(levels.count, patches.count);
  for (size_t i = 0; i < levels.count; i++) {
    const float *row = row_of(&patches, row_at(&patches, row_of(&levels, i))),
                *joints = row + patches.layout->joints, *weights = row + patches.layout->weights;
    assert_four(&levels, i, FAR);
    for (uint32_t k = 0; k < 4; k++) {
      assert_float_equal(row_of(&levels, i)[levels.layout->weights + k], weights[k], 4e-6);
      /* Of two that weigh the same, either may come. */
      float other = weights[k] > 0 ? weight_of(&levels, i, (uint32_t)joints[k] - FAR) : 0;
      if (other > 0) assert_float_equal(other, weights[k], 4e-6);
    }
    if (weights[0] > weights[1] + 1e-5f)
      assert_true(row_of(&levels, i)[levels.layout->joints] == joints[0] - FAR);
  }
  free_rows(&levels);
  free_rows(&patches);
}

/* Joints of which all, some and nearly none are near each other. */
TEST(whole_levels_weigh_as_patches_do) {
  for (uint32_t level = 1; level <= 3; level++)
    for (int limit = 0; limit < 2; limit++)
      for (int creased = 0; creased < 2; creased++) {
        skinned *c = new_skinned(creased, false);
        const tw_surface_options options = {.level = level, .limit = limit};
        weigh(c, 23);
        assert_as_patches(c, options);
        for (uint32_t p = 0; p < POINTS; p++)
          for (uint32_t k = 0; k < 4; k++) c->joints[p][k] = (uint16_t)(2 * (p % SIDE + p / SIDE) + k);
        assert_as_patches(c, options);
        for (uint32_t p = 0; p < POINTS; p++)
          for (uint32_t k = 0; k < 4; k++) c->joints[p][k] = (uint16_t)(7 * p + (k + p) % 2);
        assert_as_patches(c, options);
        free_skinned(c);
      }
}

TEST(sloppy_weights_are_put_right) {
  skinned *c = new_skinned(false, false);
  for (uint32_t p = 0; p < POINTS; p++) { /* a joint twice, a sum of 8, a negative weight; none at all */
    static const uint16_t joints[4] = {2, 5, 2, 1};
    static const float weights[4] = {1, 4, 3, -2};
    memcpy(c->joints[p], joints, sizeof joints);
    if (p != 12) memcpy(c->weights[p], weights, sizeof weights);
  }
  rows r = read_rows(&c->mesh, (tw_surface_options){.level = 0});
  for (size_t i = 0; i < r.count; i++) {
    assert_four(&r, i, 6);
    assert_true(weight_of(&r, i, 2) == (i == 12 ? 0.0f : 0.5f));
    assert_true(weight_of(&r, i, 5) == (i == 12 ? 0.0f : 0.5f));
    assert_true(weight_of(&r, i, 0) == (i == 12 ? 1.0f : 0.0f));
  }
  free_rows(&r);
  r = read_rows(&c->mesh, (tw_surface_options){.level = 3});
  for (size_t i = 0; i < r.count; i++) assert_four(&r, i, 6);
  free_rows(&r);
  free_skinned(c);
}

TEST(weights_that_follow_a_coordinate_stay_with_it) {
  skinned *c = new_skinned(true, false);
  for (uint32_t p = 0; p < POINTS; p++) {
    c->joints[p][0] = 7;
    c->joints[p][1] = 9;
    c->weights[p][0] = c->c->points[p][0] / (SIDE - 1);
    c->weights[p][1] = 1 - c->weights[p][0];
  }
  for (int o = 0; o < MANY_OPTIONS; o++) {
    rows r = read_rows(&c->mesh, many_options[o]);
    for (size_t i = 0; i < r.count; i++)
      assert_float_equal(weight_of(&r, i, 7), row_of(&r, i)[0] / (SIDE - 1), 1e-6);
    free_rows(&r);
  }
  free_skinned(c);
}

TEST(same_weights_come_whatever_the_blocks) {
  skinned *c = new_skinned(true, false);
  weigh(c, 23);
  for (int o = 0; o < MANY_OPTIONS; o++) {
    rows r = read_rows(&c->mesh, many_options[o]);
    assert_same_in_blocks(&r);
    free_rows(&r);
  }
  free_skinned(c);
}

/* Rows that a crease has split are one point, and hang on the same joints to the last bit. */
TEST(split_rows_share_their_weights) {
  skinned *c = new_skinned(true, false);
  weigh(c, 23);
  rows r = read_rows(&c->mesh, (tw_surface_options){.level = 3, .normals = true});
  size_t pairs = 0;
  for (size_t i = 0; i < r.count; i++)
    for (size_t k = i + 1; k < r.count; k++)
      if (memcmp(row_of(&r, i), row_of(&r, k), 3 * sizeof(float)) == 0) {
        assert_memory_equal(row_of(&r, i) + r.layout->joints, row_of(&r, k) + r.layout->joints,
                            8 * sizeof(float));
        pairs++;
      }
  assert_true(pairs > 8);
  free_rows(&r);
  free_skinned(c);
}

TEST(great_polygon_keeps_its_lists_short) {
  enum { RIM = 300 };
  static float points[RIM][3], weights[RIM][4];
  static uint16_t joints[RIM][4];
  static uint32_t corners[RIM];
  static const uint32_t offsets[2] = {0, RIM};
  for (uint32_t p = 0; p < RIM; p++) {
    corners[p] = p;
    points[p][0] = cosf(0.02094395f * (float)p);
    points[p][1] = sinf(0.02094395f * (float)p);
    for (uint32_t k = 0; k < 4; k++) {
      joints[p][k] = (uint16_t)(4 * p + k);
      weights[p][k] = 0.25f;
    }
  }
  tw_mesh mesh = mesh_of(points[0], RIM, corners, offsets, 1);
  mesh.skin = (tw_skin_weights){.width = 4, .joints = joints[0], .weights = weights[0]};
  rows plain = read_rows(&mesh, (tw_surface_options){.level = 1}), r = plain;
  mesh.skin.joints = NULL;
  rows without = read_rows(&mesh, (tw_surface_options){.level = 1});
  /* 601 vertices of at most 64 joints: 6 bytes each, and an offset. */
  assert_true(tw_surface_size(plain.surface) - tw_surface_size(without.surface) < 601 * (64 * 6 + 8 + 32));
  for (size_t i = 0; i < r.count; i++) assert_four(&r, i, 4 * RIM);
  free_rows(&plain);
  free_rows(&without);
}

TEST(open_border_keeps_the_weights_of_what_is_left) {
  skinned *c = new_skinned(false, false);
  for (uint32_t p = 0; p < POINTS; p++) {
    c->joints[p][0] = 1;
    c->weights[p][0] = c->c->points[p][1] / (SIDE - 1);
    c->weights[p][1] = 1 - c->weights[p][0];
  }
  for (uint32_t level = 1; level <= 3; level++) {
    rows r = read_rows(&c->mesh, (tw_surface_options){.level = level, .boundary = TW_BOUNDARY_OPEN});
    assert_true(r.count > 0);
    for (size_t i = 0; i < r.count; i++) {
      assert_four(&r, i, 2);
      assert_float_equal(weight_of(&r, i, 1), row_of(&r, i)[1] / (SIDE - 1), 1e-6);
    }
    free_rows(&r);
  }
  free_skinned(c);
}
