/* Hard edges: those that normals, smoothing groups and angles tell of, and what surfaces make of them. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cube.h"
#include "obj.h"
#include "surface_rows.h"
#include "tweend/format.h"

/* ---- models as text -------------------------------------------------------------------------- */

enum { TEXT_MAX = 1 << 16 };

typedef struct text {
  char bytes[TEXT_MAX];
  size_t size;
} text;

static TW_PRINTF(2, 3) void put(text *t, const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  int size = vsnprintf(t->bytes + t->size, TEXT_MAX - t->size, format, arguments);
  va_end(arguments);
  assert_true(size >= 0 && t->size + (size_t)size < TEXT_MAX);
  t->size += (size_t)size;
}

#define CUBE_POINTS  "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
#define CUBE_NORMALS "vn 0 0 -1\nvn 0 0 1\nvn 0 -1 0\nvn 1 0 0\nvn 0 1 0\nvn -1 0 0\n"

static const char flat_cube[] =
    CUBE_POINTS CUBE_NORMALS "f 1//1 4//1 3//1 2//1\nf 5//2 6//2 7//2 8//2\nf 1//3 2//3 6//3 5//3\n"
                             "f 2//4 3//4 7//4 6//4\nf 3//5 4//5 8//5 7//5\nf 4//6 1//6 5//6 8//6\n";

/* A ball of n x n quads a side, each with a normal of its own or, smooth, with those of its points; its first
 * column of texture coordinates is a seam where normals are written twice. */
static void put_ball(text *t, int segments, int rings, bool is_smooth) {
  for (int r = 0; r <= rings; r++)
    for (int s = 0; s <= segments; s++) {
      double up = 3.14159265358979 * r / rings, round = 6.28318530717959 * s / segments;
      double p[3] = {sin(up) * cos(round), cos(up), sin(up) * sin(round)};
      if (s < segments && r > 0 && r < rings) put(t, "v %.9g %.9g %.9g\n", p[0], p[1], p[2]);
      put(t, "vt %.9g %.9g\nvn %.5f %.5f %.5f\n", s / (double)segments, r / (double)rings, p[0], p[1], p[2]);
    }
  put(t, "v 0 1 0\nv 0 -1 0\n");
  int north = segments * (rings - 1) + 1, face = (segments + 1) * (rings + 1);
  for (int r = 0; r < rings; r++)
    for (int s = 0; s < segments; s++) {
      double up = 3.14159265358979 * (r + 0.5) / rings, round = 6.28318530717959 * (s + 0.5) / segments;
      if (!is_smooth) put(t, "vn %.5f %.5f %.5f\n", sin(up) * cos(round), cos(up), sin(up) * sin(round));
      face++;
      put(t, "f");
      for (int k = 0; k < 4; k++) {
        int ds = k == 1 || k == 2, dr = k >= 2, row = r + dr; /* seen from outside: round, then down */
        if ((r == 0 && k == 1) || (row == rings && k == 2)) continue;
        int point = row == 0       ? north
                    : row == rings ? north + 1
                                   : (row - 1) * segments + (s + ds) % segments + 1;
        int corner = row * (segments + 1) + s + ds + 1;
        put(t, " %d/%d/%d", point, corner, is_smooth ? corner : face);
      }
      put(t, "\n");
    }
}

/* A machine's part: a tube wall that is shaded round between two flat lids. */
static void put_drum(text *t, int sides) {
  put(t, "vn 0 1 0\nvn 0 -1 0\n");
  for (int s = 0; s < sides; s++) {
    double round = 6.28318530717959 * s / sides;
    put(t, "v %.9g 1 %.9g\nv %.9g -1 %.9g\n", cos(round), sin(round), cos(round), sin(round));
    put(t, "vn %.4f 0 %.4f\n", cos(round), sin(round));
  }
  for (int s = 0; s < sides; s++) {
    int next = (s + 1) % sides;
    put(t, "f %d//%d %d//%d %d//%d %d//%d\n", 2 * s + 1, s + 3, 2 * next + 1, next + 3, 2 * next + 2,
        next + 3, 2 * s + 2, s + 3);
  }
  for (int lid = 0; lid < 2; lid++) {
    put(t, "f");
    for (int s = 0; s < sides; s++) put(t, " %d//%d", lid ? 2 * s + 2 : 2 * (sides - 1 - s) + 1, lid + 1);
    put(t, "\n");
  }
}

static tw_hard_edge_counts counts_of(const tw_mesh *mesh) {
  tw_mesh_stats stats;
  assert_int_equal(tw_mesh_describe(mesh, &stats, NULL), TW_OK);
  tw_hard_edge_counts counts = stats.hard_edges;
  tw_mesh_stats_deinit(&stats);
  return counts;
}

static void assert_counts(const char *obj, uint32_t by_normals, uint32_t by_30_degrees, uint32_t by_auto) {
  tw_model *model = read_obj(obj);
  tw_hard_edge_counts counts = counts_of(model->meshes);
  assert_int_equal(counts.by_normals, by_normals);
  assert_int_equal(counts.by_30_degrees, by_30_degrees);
  assert_int_equal(counts.by_auto, by_auto);
  tw_model_destroy(model);
}

/* ---- what is found --------------------------------------------------------------------------- */

TEST(edges_of_a_flat_shaded_box_are_hard) {
  assert_counts(flat_cube, 12, 12, 12);
}

TEST(a_flat_shaded_ball_is_round_by_auto_alone) {
  text t = {.size = 0};
  put_ball(&t, 16, 8, false);
  assert_counts(t.bytes, 16 * 7 + 16 * 8, 0, 0);
}

TEST(normals_that_are_equal_across_a_seam_part_nothing) {
  text t = {.size = 0};
  put_ball(&t, 16, 8, true);
  tw_model *model = read_obj(t.bytes);
  assert_int_equal(model->meshes->uv_set_count, 1);
  assert_int_equal(model->meshes->normals.value_count, 17 * 9 + 1);
  tw_model_destroy(model);
  assert_counts(t.bytes, 0, 0, 0);
}

TEST(rims_of_a_drum_are_hard_and_its_wall_is_not) {
  text t = {.size = 0};
  put_drum(&t, 8); /* walls that turn by 45 degrees each */
  assert_counts(t.bytes, 16, 24, 16);
}

TEST(a_flat_piece_beside_a_smooth_one_is_judged_by_its_angles) {
  text t = {.size = 0};
  put_drum(&t, 8);
  put(&t, "v 9 0 0\nv 10 0 0\nv 9 1 0\nv 9 0 0.2\nvn 0 0 1\nvn 0 0.2 -1\n");
  put(&t, "f -4//-2 -3//-2 -2//-2\nf -3//-1 -4//-1 -1//-1\n"); /* at an edge of some 100 degrees */
  assert_counts(t.bytes, 17, 25, 17);
  put(&t, "v 20 0 0\nv 21 0 0\nv 20 1 0\nv 20 -1 0.5\nvn 0 0 1\nvn 0 0.5 1\n");
  put(&t, "f -4//-2 -3//-2 -2//-2\nf -3//-1 -4//-1 -1//-1\n"); /* of 27 degrees */
  assert_counts(t.bytes, 18, 25, 17);
}

TEST(faces_of_two_smoothing_groups_part_at_their_edge) {
  assert_counts(CUBE_POINTS "s 1\nf 1 4 3 2\nf 5 6 7 8\ns 7\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n", 8,
                12, 8);
  assert_counts(CUBE_POINTS "s 1\nf 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n", 0, 12,
                0);
}

TEST(without_smoothing_all_edges_part_and_angles_decide) {
  static const char bent[] =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 -1 %s\nv 1 -1 %s\n%sf 1 2 3 4\nf 2 1 5 6\n";
  char obj[200];
  snprintf(obj, sizeof obj, bent, "0.5", "0.5", "s off\n");
  assert_counts(obj, 1, 0, 0);
  snprintf(obj, sizeof obj, bent, "0.5", "0.5", "s 0\n");
  assert_counts(obj, 1, 0, 0);
  snprintf(obj, sizeof obj, bent, "2", "2", "s off\n");
  assert_counts(obj, 1, 1, 1);
  snprintf(obj, sizeof obj, bent, "2", "2", "s what\n"); /* as good as no statement */
  assert_counts(obj, 0, 1, 1);
}

TEST(normals_win_over_smoothing_groups) {
  assert_counts("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 -1 1\nv 1 -1 1\nvn 0 0 1\nvn 0 1 1\nvn 0 0.5 1\n"
                "s off\nf 1//3 2//3 3//1 4//1\nf 2//3 1//3 5//2 6//2\n",
                0, 1, 0);
}

/* As Blender writes a sharp edge that ends in the middle of a smooth face. */
TEST(a_crease_that_runs_out_is_hard_to_its_end) {
  assert_counts("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 -1 1\nv 1 -1 1\nvn 0 0 1\nvn 0 1 1\nvn 0 0.5 1\n"
                "f 1//3 2//1 3//1 4//1\nf 2//2 1//3 5//2 6//2\n",
                1, 1, 1);
}

TEST(a_normal_that_is_none_says_nothing) {
  static const char obj[] = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 -1 1\nv 1 -1 1\nvn 0 0 1\nvn nan 0 0\n"
                            "vn 0 0 0\nf 1//1 2//1 3//1 4//1\nf 2//2 1//3 5 6//2\n";
  assert_counts(obj, 0, 1, 0);
  tw_model *model = read_obj(obj);
  assert_int_equal(model->warning_count, 2);
  assert_non_null(strstr(model->warnings[0], "1 normal is left out"));
  assert_non_null(strstr(model->warnings[1], "1 normal is 0 0 0"));
  tw_model_destroy(model);
}

TEST(faces_without_area_are_bent_nowhere) {
  assert_counts("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 1 1 0\nf 1 2 3\nf 2 1 4\n", 0, 0, 0);
}

TEST(borders_and_edges_of_three_faces_are_not_counted) {
  assert_counts("v 0 0 0\nv 0 1 0\nv 1 0 0\nv -1 0 0\nv 0 0 1\nf 1 2 3\nf 2 1 4\nf 1 2 5\n", 0, 0, 0);
  assert_counts("v 0 0 0\nv 0 1 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n", 0, 0, 0);
}

TEST(objects_have_the_normals_of_their_own_corners) {
  text t = {.size = 0};
  put(&t, "o one\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\no two\n");
  put(&t, "v 5 0 0\nv 6 0 0\nv 6 1 0\nv 5 1 0\nv 5 -1 0\nv 6 -1 0\nvn 0 0 1\nvn 0 1 1\n");
  put(&t, "f 4//1 5//1 6//1 7//1\nf 5//2 4//2 8//2 9//2\n");
  tw_model *model = read_obj(t.bytes);
  assert_int_equal(model->mesh_count, 2);
  assert_null(model->meshes[0].normals.corners);
  assert_int_equal(counts_of(&model->meshes[1]).by_normals, 1);
  tw_model_destroy(model);
}

TEST(a_corner_that_is_dropped_takes_its_normal_with_it) {
  tw_model *model = read_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 1 0 0\nvn 0 1 0\nvn 0 0 1\n"
                             "f 1//1 2//2 2//3 3//3\n");
  const tw_corner_normals *normals = &model->meshes[0].normals;
  assert_int_equal(model->meshes[0].corner_count, 3);
  for (uint32_t c = 0; c < 3; c++) assert_int_equal(normals->corners[c], c);
  assert_true(normals->values[8] == 1);
  tw_model_destroy(model);
}

TEST(normals_of_ply_are_those_of_its_vertices) {
  static const char ply[] = "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
                            "property float z\nproperty float nx\nproperty float ny\nproperty float nz\n"
                            "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
                            "0 0 0 0 0 1\n1 0 0 0 0 1\n1 1 0 0 0 1\n0 1 0 0 0 1\n"
                            "0 0 0 0 1 1\n1 0 0 0 1 1\n1 -1 1 0 1 1\n0 -1 1 0 1e39 1\n"
                            "4 0 1 2 3\n4 5 4 7 6\n";
  tw_model *model = NULL;
  tw_error error = {0};
  assert_int_equal(tw_ply_read((const uint8_t *)ply, strlen(ply), TW_WELD_AUTO, &model, &error), TW_OK);
  const tw_mesh *mesh = model->meshes;
  assert_int_equal(mesh->point_count, 6); /* the seam is closed */
  assert_int_equal(mesh->normals.value_count, 8);
  assert_true(mesh->normals.values[3 * mesh->normals.corners[5] + 1] == 1);
  assert_true(mesh->normals.values[3 * 7 + 2] == 0);
  assert_int_equal(counts_of(mesh).by_normals, 1);
  tw_model_destroy(model);
}

/* ---- what is made of it ---------------------------------------------------------------------- */

typedef struct creased {
  tw_arena *arena;
  tw_mesh mesh;
} creased;

static creased crease(const tw_mesh *mesh, tw_creases creases, double degrees, float sharpness) {
  creased c = {.arena = tw_arena_create()};
  assert_non_null(c.arena);
  assert_int_equal(tw_mesh_with_creases(mesh, creases, degrees, sharpness, true, c.arena, &c.mesh, NULL),
                   TW_OK);
  assert_int_equal(tw_mesh_check(&c.mesh, NULL, NULL), TW_OK);
  return c;
}

TEST(edges_bent_by_more_than_the_angle_are_creases) {
  const struct {
    double degrees;
    uint32_t count;
  } cases[] = {{0, 12}, {89.9, 12}, {90.1, 0}, {180, 0}};
  tw_mesh mesh = cube();
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    creased c = crease(&mesh, TW_CREASES_ANGLE, cases[i].degrees, 3.5f);
    assert_int_equal(c.mesh.crease_count, cases[i].count);
    for (uint32_t e = 0; e < c.mesh.crease_count; e++) assert_true(c.mesh.crease_sharpness[e] == 3.5f);
    tw_arena_destroy(c.arena);
  }
}

TEST(a_face_folded_onto_another_is_bent_by_180_degrees) {
  static const float points[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.25f, 1, 0}};
  static const uint32_t corners[6] = {0, 1, 2, 1, 0, 3}, offsets[3] = {0, 3, 6};
  static const double degrees[] = {0, 90, 179, 180};
  tw_mesh mesh = mesh_of(points[0], 4, corners, offsets, 2);
  for (size_t i = 0; i < sizeof degrees / sizeof *degrees; i++) {
    creased c = crease(&mesh, TW_CREASES_ANGLE, degrees[i], 1);
    assert_int_equal(c.mesh.crease_count, degrees[i] < 180);
    tw_arena_destroy(c.arena);
  }
}

TEST(an_edge_that_the_file_tags_keeps_its_sharpness) {
  static const uint32_t edges[3][2] = {{1, 0}, {2, 3}, {0, 6}}; /* the last is no edge */
  static const float sharpness[3] = {0.5f, 0, 7};
  tw_mesh mesh = cube();
  mesh.crease_count = 3;
  mesh.crease_edges = edges[0];
  mesh.crease_sharpness = sharpness;
  creased c = crease(&mesh, TW_CREASES_ANGLE, 30, TW_SHARPNESS_INFINITE);
  assert_int_equal(c.mesh.crease_count, 3 + 10);
  assert_memory_equal(c.mesh.crease_edges, edges, sizeof edges);
  assert_memory_equal(c.mesh.crease_sharpness, sharpness, sizeof sharpness);
  for (uint32_t i = 3; i < c.mesh.crease_count; i++) {
    uint32_t a = c.mesh.crease_edges[2 * i], b = c.mesh.crease_edges[2 * i + 1];
    assert_false((a < 2 && b < 2) || (a + b == 5 && (a == 2 || b == 2)));
  }
  tw_arena_destroy(c.arena);
}

TEST(none_leaves_neither_creases_nor_corners) {
  static const uint32_t edge[2] = {0, 1}, point = 6;
  static const float sharpness = 10;
  tw_mesh mesh = cube();
  mesh.crease_count = mesh.sharp_point_count = 1;
  mesh.crease_edges = edge;
  mesh.sharp_points = &point;
  mesh.crease_sharpness = mesh.point_sharpness = &sharpness;
  creased none = crease(&mesh, TW_CREASES_NONE, 0, 0), tags = crease(&mesh, TW_CREASES_TAGS, 0, 0);
  assert_int_equal(none.mesh.crease_count + none.mesh.sharp_point_count, 0);
  assert_memory_equal(&tags.mesh, &mesh, sizeof mesh);
  tw_arena_destroy(none.arena);
  tw_arena_destroy(tags.arena);
}

TEST(a_box_with_split_normals_keeps_its_silhouette) {
  tw_model *model = read_obj(flat_cube);
  creased c = crease(model->meshes, TW_CREASES_AUTO, 0, TW_SHARPNESS_INFINITE);
  rows r = read_rows(&c.mesh, (tw_surface_options){.level = 3, .limit = true, .normals = true});
  assert_int_equal(r.count, 6 * 81); /* each side on its own: normals are split */
  for (size_t i = 0; i < r.count; i++) {
    const float *p = row_of(&r, i), *n = p + r.layout->normal;
    float outmost = fmaxf(fabsf(p[0]), fmaxf(fabsf(p[1]), fabsf(p[2])));
    assert_true(fabsf(outmost - 1) < 1e-6f);
    assert_true(fabsf(fabsf(n[0]) + fabsf(n[1]) + fabsf(n[2]) - 1) < 1e-6f);
  }
  free_rows(&r);
  tw_arena_destroy(c.arena);
  tw_model_destroy(model);
}

/* Distance from the middle, least and greatest. */
static void find_radii(const char *obj, tw_creases creases, float radii[2]) {
  tw_model *model = read_obj(obj);
  creased c = crease(model->meshes, creases, 0, TW_SHARPNESS_INFINITE);
  rows r = read_rows(&c.mesh, (tw_surface_options){.level = 3, .limit = true});
  radii[0] = INFINITY;
  radii[1] = 0;
  for (size_t i = 0; i < r.count; i++) {
    const float *p = row_of(&r, i);
    float radius = sqrtf(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    radii[0] = fminf(radii[0], radius);
    radii[1] = fmaxf(radii[1], radius);
  }
  free_rows(&r);
  tw_arena_destroy(c.arena);
  tw_model_destroy(model);
}

TEST(balls_become_round_by_auto) {
  float flat[2], smooth[2], plain[2], faceted[2];
  text t = {.size = 0};
  put_ball(&t, 16, 8, false);
  find_radii(t.bytes, TW_CREASES_AUTO, flat);
  find_radii(t.bytes, TW_CREASES_TAGS, plain);
  find_radii(t.bytes, TW_CREASES_NORMALS, faceted);
  t.size = 0;
  put_ball(&t, 16, 8, true);
  find_radii(t.bytes, TW_CREASES_AUTO, smooth);
  assert_memory_equal(flat, plain, sizeof flat);
  assert_memory_equal(smooth, plain, sizeof smooth);
  assert_true(flat[1] < 0.985f);
  assert_true(faceted[1] > 0.999999f); /* all corners of the cage stick out */
}

/* ---- what a file shows ----------------------------------------------------------------------- */

static void assert_found(const tw_mesh *mesh, tw_creases creases, uint32_t edges, uint32_t corners) {
  creased c = crease(mesh, creases, 0, TW_SHARPNESS_INFINITE);
  assert_int_equal(c.mesh.crease_count, edges);
  assert_int_equal(c.mesh.sharp_point_count, corners);
  if (creases == TW_CREASES_FILE) assert_int_equal(counts_of(mesh).by_file, edges - mesh->crease_count);
  tw_arena_destroy(c.arena);
}

static void assert_file_finds(const char *obj, uint32_t edges) {
  tw_model *model = read_obj(obj);
  assert_found(model->meshes, TW_CREASES_FILE, edges, 0);
  tw_model_destroy(model);
}

#define CUBE_FACES "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"

TEST(a_file_shows_hard_edges_by_normals_and_groups_alone) {
  assert_file_finds(flat_cube, 12);
  assert_file_finds(CUBE_POINTS CUBE_FACES, 0); /* a cage without normals rounds */
  assert_file_finds(CUBE_POINTS "s off\n" CUBE_FACES, 12);
  assert_file_finds(CUBE_POINTS "s 1\n" CUBE_FACES, 0);
  text t = {.size = 0};
  put_ball(&t, 16, 8, false);
  assert_file_finds(t.bytes, 0);
  t.size = 0;
  put_ball(&t, 16, 8, true);
  assert_file_finds(t.bytes, 0);
}

TEST(a_file_with_any_tag_means_its_tags) {
  tw_model *model = read_obj(flat_cube);
  tw_mesh mesh = *model->meshes;
  static const uint32_t edge[2] = {0, 1}, face[1] = {0};
  static const float sharpness = 2;
  mesh.crease_count = 1;
  mesh.crease_edges = edge;
  mesh.crease_sharpness = &sharpness;
  assert_false(tw_mesh_tells_hard_edges(&mesh));
  assert_found(&mesh, TW_CREASES_FILE, 1, 0);
  mesh = *model->meshes;
  mesh.hole_count = 1;
  mesh.holes = face;
  assert_false(tw_mesh_tells_hard_edges(&mesh));
  mesh = *model->meshes;
  mesh.tag_boundary = 0;
  assert_false(tw_mesh_tells_hard_edges(&mesh));
  tw_model_destroy(model);
}

/* Of two pieces one has normals. */
TEST(a_piece_of_which_the_file_says_nothing_rounds) {
  text t = {.size = 0};
  put(&t, "%s", flat_cube);
  put(&t, "v 5 -1 -1\nv 7 -1 -1\nv 7 1 -1\nv 5 1 -1\nv 5 -1 1\nv 7 -1 1\nv 7 1 1\nv 5 1 1\n"
          "f 9 12 11 10\nf 13 14 15 16\nf 9 10 14 13\nf 10 11 15 14\nf 11 12 16 15\nf 12 9 13 16\n");
  tw_model *model = read_obj(t.bytes);
  assert_found(model->meshes, TW_CREASES_FILE, 12, 0);
  assert_found(model->meshes, TW_CREASES_AUTO, 24, 0);
  tw_model_destroy(model);
}

/* A square of four triangles round its middle, and the same with its corners cut to eight of 45 degrees. */
TEST(a_border_that_turns_sharply_makes_corners) {
  static const char square[] = "vn 0 0 1\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 0\n"
                               "f 1//1 2//1 5//1\nf 2//1 3//1 5//1\nf 3//1 4//1 5//1\nf 4//1 1//1 5//1\n";
  tw_model *model = read_obj(square);
  assert_found(model->meshes, TW_CREASES_FILE, 0, 4);
  assert_found(model->meshes, TW_CREASES_AUTO, 0, 4);
  assert_found(model->meshes, TW_CREASES_NORMALS, 0, 0);
  creased c = crease(model->meshes, TW_CREASES_FILE, 0, 2);
  assert_true(c.mesh.point_sharpness[0] == TW_SHARPNESS_INFINITE);
  tw_mesh edge_only;
  assert_int_equal(
      tw_mesh_with_creases(model->meshes, TW_CREASES_FILE, 0, 2, false, c.arena, &edge_only, NULL), TW_OK);
  assert_int_equal(edge_only.sharp_point_count, 0);
  tw_arena_destroy(c.arena);
  tw_model_destroy(model);
  text t = {.size = 0};
  for (int sides = 6; sides <= 9; sides++) { /* 60, 51, 45 and 40 degrees */
    t.size = 0;
    put(&t, "vn 0 0 1\nv 0 0 0\n");
    for (int k = 0; k < sides; k++)
      put(&t, "v %.9g %.9g 0\n", cos(6.28318530717959 * k / sides), sin(6.28318530717959 * k / sides));
    for (int k = 0; k < sides; k++) put(&t, "f 1//1 %d//1 %d//1\n", k + 2, (k + 1) % sides + 2);
    model = read_obj(t.bytes);
    assert_found(model->meshes, TW_CREASES_FILE, 0, 360 > 50 * sides ? (uint32_t)sides : 0);
    tw_model_destroy(model);
  }
}

/* A square that is bent up all round from a larger one: its rim is a crease with two edges at each corner. */
TEST(a_crease_that_turns_sharply_makes_corners) {
  static const char raised[] =
      "v 0 0 0\nv 3 0 0\nv 3 3 0\nv 0 3 0\nv 1 1 0\nv 2 1 0\nv 2 2 0\nv 1 2 0\nv 1.5 1.5 3\n"
      "s 1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\ns 2\nf 5 6 9\nf 6 7 9\nf 7 8 9\nf 8 5 9\n";
  tw_model *model = read_obj(raised);
  creased c = crease(model->meshes, TW_CREASES_FILE, 0, 3);
  assert_int_equal(c.mesh.crease_count, 4);
  assert_int_equal(c.mesh.sharp_point_count, 8); /* those of the border, too */
  for (uint32_t i = 0; i < 8; i++) {
    uint32_t point = c.mesh.sharp_points[i];
    assert_true(c.mesh.point_sharpness[i] == (point < 4 ? TW_SHARPNESS_INFINITE : 3.0f));
  }
  tw_arena_destroy(c.arena);
  tw_model_destroy(model);
}
