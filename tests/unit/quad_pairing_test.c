/* Quads that exporters split come back: all of a figure's, however it was split, and none of a mesh that has
 * none. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "quad_pairing.h"
#include "test.h"
#include "tweend/format.h"

enum { MOST = 8192 };

/* Triangles, and which quad of the source each is a half of; UINT32_MAX for a triangle of the source. */
typedef struct soup {
  float (*points)[3];
  uint32_t corners[3 * MOST], offsets[MOST + 1], source[MOST];
  float normals[MOST][3];
  uint32_t normal_of[3 * MOST];
  tw_mesh mesh;
} soup;

static soup *new_soup(const float *points, uint32_t count) {
  soup *s = calloc(1, sizeof *s);
  assert_non_null(s);
  tw_mesh_init(&s->mesh);
  s->mesh.point_count = count;
  s->mesh.positions = points;
  s->mesh.corners = s->corners;
  s->mesh.face_offsets = s->offsets;
  return s;
}

static void add_triangle(soup *s, uint32_t a, uint32_t b, uint32_t c, uint32_t source) {
  tw_mesh *m = &s->mesh;
  assert_true(m->face_count < MOST);
  uint32_t corners[3] = {a, b, c};
  memcpy(s->corners + m->corner_count, corners, sizeof corners);
  s->source[m->face_count++] = source;
  s->offsets[m->face_count] = m->corner_count += 3;
}

typedef enum split { FAN, FAN_BUT_CONCAVE, SHORTEST, BACKWARDS } split;

static double distance(const float *points, uint32_t a, uint32_t b) {
  double sum = 0;
  for (uint32_t k = 0; k < 3; k++) sum += pow((double)points[3 * a + k] - (double)points[3 * b + k], 2);
  return sum;
}

static double turn(const float *points, uint32_t a, uint32_t b, uint32_t c, double out[3]) {
  double p[3], q[3];
  for (uint32_t k = 0; k < 3; k++) {
    p[k] = (double)points[3 * b + k] - (double)points[3 * a + k];
    q[k] = (double)points[3 * c + k] - (double)points[3 * a + k];
  }
  for (int k = 0; k < 3; k++) out[k] = p[(k + 1) % 3] * q[(k + 2) % 3] - p[(k + 2) % 3] * q[(k + 1) % 3];
  return out[0] * out[0] + out[1] * out[1] + out[2] * out[2];
}

/* Whether the halves along the first diagonal lie on each other. */
static bool folds(const float *points, const uint32_t q[4]) {
  double a[3], b[3];
  turn(points, q[0], q[1], q[2], a);
  turn(points, q[0], q[2], q[3], b);
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] < 0;
}

/* Whether the halves of the last quad that was added lie side by side along the axis in which their areas
 * together are largest: then level 0 cuts the quad back into them. */
static bool is_cut_back(const soup *s) {
  const uint32_t *c = s->corners + 3 * (s->mesh.face_count - 2);
  double a[3], b[3];
  int axis = 0;
  turn(s->mesh.positions, c[0], c[1], c[2], a);
  turn(s->mesh.positions, c[3], c[4], c[5], b);
  for (int i = 1; i < 3; i++)
    if (fabs(a[i] + b[i]) > fabs(a[axis] + b[axis])) axis = i;
  return a[axis] * b[axis] >= 0;
}

static void add_quad(soup *s, const uint32_t q[4], uint32_t source, split how) {
  const float *p = s->mesh.positions;
  bool other = (how == FAN_BUT_CONCAVE && folds(p, q)) ||
               (how == SHORTEST && distance(p, q[1], q[3]) < distance(p, q[0], q[2]));
  if (other) {
    add_triangle(s, q[0], q[1], q[3], source);
    add_triangle(s, q[1], q[2], q[3], source);
  } else if (how == BACKWARDS) {
    add_triangle(s, q[0], q[1], q[2], source);
    add_triangle(s, q[2], q[3], q[0], source);
  } else {
    add_triangle(s, q[0], q[1], q[2], source);
    add_triangle(s, q[0], q[2], q[3], source);
  }
}

static uint32_t face_size(const tw_mesh *mesh, uint32_t face) {
  return mesh->face_offsets[face + 1] - mesh->face_offsets[face];
}

/* Every polygon of a mesh as an exporter writes it. */
static soup *split_mesh(const tw_mesh *mesh, split how) {
  soup *s = new_soup(mesh->positions, mesh->point_count);
  for (uint32_t f = 0; f < mesh->face_count; f++) {
    const uint32_t *c = mesh->corners + mesh->face_offsets[f];
    if (face_size(mesh, f) == 4) add_quad(s, c, f, how);
    for (uint32_t i = 2; face_size(mesh, f) != 4 && i < face_size(mesh, f); i++)
      add_triangle(s, c[0], c[i - 1], c[i], UINT32_MAX);
  }
  return s;
}

/* The quads that come back, and in *wrong those that never were. */
static uint32_t pair(const soup *s, uint32_t *wrong) {
  tw_arena *arena = tw_arena_create();
  tw_mesh mesh = s->mesh;
  uint32_t right = 0;
  assert_int_equal(tw_pair_triangles(&mesh, arena, NULL), TW_OK);
  assert_int_equal(tw_mesh_check(&mesh, NULL, NULL), TW_OK);
  *wrong = 0;
  for (uint32_t f = 0; f < mesh.face_count; f++) {
    if (face_size(&mesh, f) != 4) continue;
    uint32_t halves = 0, source = UINT32_MAX;
    for (uint32_t t = 0; t < s->mesh.face_count; t++) {
      uint32_t shared = 0;
      for (uint32_t i = 0; i < 3; i++)
        for (uint32_t k = 0; k < 4; k++)
          shared += s->corners[3 * t + i] == mesh.corners[mesh.face_offsets[f] + k];
      if (shared < 3) continue;
      if (halves++ == 0) source = s->source[t];
      if (source != s->source[t]) source = UINT32_MAX;
    }
    if (source != UINT32_MAX && halves == 2)
      right++;
    else
      ++*wrong;
  }
  tw_arena_destroy(arena);
  return right;
}

/* So many quads come back, none but those that were. */
static void assert_pairs(const soup *s, uint32_t expected) {
  uint32_t wrong, right = pair(s, &wrong);
  if (right != expected || wrong > 0) fail_msg("%u of %u quads, and %u others", right, expected, wrong);
}

static tw_model *read_sample(const char *path) {
  char full[512];
  snprintf(full, sizeof full, "%s/%s", TWEEND_SOURCE_DIR, path);
  FILE *file = fopen(full, "rb");
  assert_non_null(file);
  static uint8_t bytes[1 << 20];
  size_t size = fread(bytes, 1, sizeof bytes, file);
  fclose(file);
  tw_model *model = NULL;
  assert_int_equal(tw_obj_read(bytes, size, TW_WELD_AUTO, &model, NULL), TW_OK);
  return model;
}

TEST(all_quads_of_an_octopus_come_back_however_split) {
  tw_model *model = read_sample("server/samples/octopus.obj");
  const tw_mesh *mesh = model->meshes;
  uint32_t quads = 0;
  for (uint32_t f = 0; f < mesh->face_count; f++) quads += face_size(mesh, f) == 4;
  for (int how = FAN; how <= BACKWARDS; how++) {
    soup *s = split_mesh(mesh, (split)how);
    assert_pairs(s, quads);
    free(s);
  }
  tw_model_destroy(model);
}

static float noise(uint32_t *seed) {
  *seed = *seed * 1664525 + 1013904223;
  return (float)(*seed >> 8) / (float)(1 << 24) - 0.5f;
}

/* A sheet of quads whose points are moved about: some are concave, many bent. Where level 0 would cut one
 * along the other diagonal, it stays as it is in the file. */
TEST(bent_and_concave_quads_come_back) {
  enum { SIDE = 24 };
  static float points[SIDE * SIDE][3];
  uint32_t seed = 7, concave = 0, quad = 0, kept = 0;
  for (uint32_t i = 0; i < SIDE * SIDE; i++) {
    points[i][0] = (float)(i % SIDE) + 0.75f * noise(&seed);
    points[i][1] = (float)(i / SIDE) + 0.75f * noise(&seed);
    points[i][2] = 0.8f * noise(&seed);
  }
  soup *s = new_soup(points[0], SIDE * SIDE);
  for (uint32_t y = 0; y + 1 < SIDE; y++)
    for (uint32_t x = 0; x + 1 < SIDE; x++) {
      uint32_t a = y * SIDE + x, q[4] = {a, a + 1, a + SIDE + 1, a + SIDE};
      concave += folds(points[0], q);
      add_quad(s, q, quad++, FAN_BUT_CONCAVE);
      kept += !is_cut_back(s);
    }
  assert_true(concave > 2 && kept > 0);
  assert_pairs(s, quad - kept);
  free(s);
}

/* A sheet of triangles that are nearly equilateral, in strips and by direction. */
TEST(a_mesh_of_triangles_stays_one) {
  enum { SIDE = 20 };
  static float points[SIDE * SIDE][3];
  uint32_t seed = 3;
  for (uint32_t i = 0; i < SIDE * SIDE; i++) {
    float row = (float)(i / SIDE);
    points[i][0] = (float)(i % SIDE) + 0.5f * row + 0.1f * noise(&seed);
    points[i][1] = 0.8660254f * row + 0.1f * noise(&seed);
    points[i][2] = 0.1f * noise(&seed);
  }
  for (int order = 0; order < 2; order++) {
    soup *s = new_soup(points[0], SIDE * SIDE);
    for (uint32_t y = 0; y + 1 < SIDE; y++)
      for (uint32_t i = 0; i < 2 * (SIDE - 1); i++) {
        uint32_t x = order ? i % (SIDE - 1) : i / 2, a = y * SIDE + x;
        bool is_upper = order ? i >= SIDE - 1 : i % 2;
        if (is_upper)
          add_triangle(s, a + 1, a + SIDE + 1, a + SIDE, UINT32_MAX);
        else
          add_triangle(s, a, a + 1, a + SIDE, UINT32_MAX);
      }
    assert_pairs(s, 0);
    free(s);
  }
}

/* A ball of quads with triangles round its poles. */
TEST(fans_round_poles_stay_triangles) {
  enum { ROUND = 24, RINGS = 12, POINTS = ROUND * (RINGS - 1) + 2 };
  static float points[POINTS][3];
  uint32_t quads = 0;
  for (uint32_t r = 1; r < RINGS; r++)
    for (uint32_t i = 0; i < ROUND; i++) {
      double up = 3.14159265358979 * r / RINGS, round = 6.28318530717959 * i / ROUND;
      float *p = points[(r - 1) * ROUND + i];
      p[0] = (float)(sin(up) * cos(round));
      p[1] = (float)cos(up);
      p[2] = (float)(sin(up) * sin(round));
    }
  points[POINTS - 2][1] = 1;
  points[POINTS - 1][1] = -1;
  soup *s = new_soup(points[0], POINTS);
  for (uint32_t i = 0; i < ROUND; i++) add_triangle(s, POINTS - 2, (i + 1) % ROUND, i, UINT32_MAX);
  for (uint32_t r = 0; r + 2 < RINGS; r++)
    for (uint32_t i = 0; i < ROUND; i++) {
      uint32_t a = r * ROUND, b = a + ROUND, next = (i + 1) % ROUND;
      add_quad(s, (uint32_t[4]){a + i, a + next, b + next, b + i}, quads++, FAN);
    }
  uint32_t last = (RINGS - 2) * ROUND;
  for (uint32_t i = 0; i < ROUND; i++)
    add_triangle(s, POINTS - 1, last + i, last + (i + 1) % ROUND, UINT32_MAX);
  assert_pairs(s, quads);
  free(s);
}

/* A rod: its sides are ten times as long as wide, its ends fans. */
TEST(slender_quads_come_back_and_slender_triangles_stay) {
  enum { ROUND = 32, POINTS = 2 * ROUND + 2 };
  static float points[POINTS][3];
  for (uint32_t i = 0; i < 2 * ROUND; i++) {
    double round = 6.28318530717959 * i / ROUND;
    points[i][0] = (float)cos(round);
    points[i][1] = i < ROUND ? 1 : -1;
    points[i][2] = (float)sin(round);
  }
  points[2 * ROUND][1] = 1;
  points[2 * ROUND + 1][1] = -1;
  soup *s = new_soup(points[0], POINTS);
  for (uint32_t i = 0; i < ROUND; i++) {
    uint32_t next = (i + 1) % ROUND;
    add_triangle(s, 2 * ROUND, next, i, UINT32_MAX);
    add_quad(s, (uint32_t[4]){i, next, ROUND + next, ROUND + i}, i, FAN);
    add_triangle(s, 2 * ROUND + 1, ROUND + i, ROUND + next, UINT32_MAX);
  }
  assert_pairs(s, ROUND);
  free(s);
}

/* Every eighth row of quads lists the first triangles of all its quads, then the second ones, so that the two
 * triangles of a quad are not consecutive. */
TEST(halves_that_stand_apart_are_paired_by_shape) {
  enum { SIDE = 12 };
  static float points[SIDE * SIDE][3];
  uint32_t quads = 0;
  for (uint32_t i = 0; i < SIDE * SIDE; i++) {
    points[i][0] = (float)(i % SIDE);
    points[i][1] = 1.3f * (float)(i / SIDE);
  }
  soup *s = new_soup(points[0], SIDE * SIDE);
  for (uint32_t y = 0; y + 1 < SIDE; y++)
    for (uint32_t pass = 0; pass < 3; pass++) /* beside rows of whole pairs */
      for (uint32_t x = 0; x + 1 < SIDE; x++) {
        uint32_t a = y * SIDE + x, q[4] = {a, a + 1, a + SIDE + 1, a + SIDE}, number = y * SIDE + x;
        quads += pass == 0;
        if (y % 8 != 3 && pass == 0) add_quad(s, q, number, FAN);
        if (y % 8 == 3 && pass == 1) add_triangle(s, q[0], q[1], q[2], number);
        if (y % 8 == 3 && pass == 2) add_triangle(s, q[0], q[2], q[3], number);
      }
  assert_pairs(s, quads);
  free(s);
}

TEST(hard_edges_keep_triangles_apart) {
  static float points[18][3];
  for (uint32_t i = 0; i < 18; i++) {
    points[i][0] = (float)(i % 9);
    points[i][1] = (float)(i / 9);
  }
  soup *s = new_soup(points[0], 18);
  for (uint32_t x = 0; x < 8; x++) add_quad(s, (uint32_t[4]){x, x + 1, x + 10, x + 9}, x, FAN);
  for (uint32_t f = 0; f < s->mesh.face_count; f++) {
    s->normals[f][2] = 1;
    for (uint32_t i = 0; i < 3; i++) s->normal_of[3 * f + i] = f;
  }
  s->mesh.normals =
      (tw_corner_normals){.value_count = MOST, .values = s->normals[0], .corners = s->normal_of};
  assert_pairs(s, 8);
  s->normals[5][1] = 0.1f; /* the second half of the third quad */
  assert_pairs(s, 7);
  free(s);
}

TEST(shading_keeps_triangles_apart) {
  static float points[18][3], tangents[MOST][4], moved[MOST][3];
  static const float *const targets[] = {moved[0]};
  for (uint32_t i = 0; i < 18; i++) {
    points[i][0] = (float)(i % 9);
    points[i][1] = (float)(i / 9);
  }
  soup *s = new_soup(points[0], 18);
  for (uint32_t x = 0; x < 8; x++) add_quad(s, (uint32_t[4]){x, x + 1, x + 10, x + 9}, x, FAN);
  for (uint32_t f = 0; f < s->mesh.face_count; f++) {
    s->normals[f][2] = tangents[f][0] = tangents[f][3] = 1;
    for (uint32_t i = 0; i < 3; i++) s->normal_of[3 * f + i] = f;
  }
  s->mesh.normals = (tw_corner_normals){
      .value_count = MOST, .values = s->normals[0], .tangents = tangents[0], .corners = s->normal_of};
  s->mesh.morph_count = 1;
  s->mesh.morphs = targets;
  s->mesh.morph_normals = targets;
  assert_pairs(s, 8);
  moved[5][1] = 0.1f; /* the second half of the third quad */
  assert_pairs(s, 7);
  tangents[9][1] = 0.1f;
  assert_pairs(s, 6);
  tangents[13][3] = -1;
  assert_pairs(s, 5);
  free(s);
}
