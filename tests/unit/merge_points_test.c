/* Points that become one: seams of OBJ files, points at the same place, points near each other. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "merge_points.h"
#include "obj.h"
#include "weld.h"

static tw_mesh_stats stats_of(const tw_mesh *mesh) {
  tw_mesh_stats stats;
  assert_int_equal(tw_mesh_check(mesh, NULL, NULL), TW_OK);
  assert_int_equal(tw_mesh_describe(mesh, &stats, NULL), TW_OK);
  return stats;
}

static void assert_points(const char *obj, tw_weld weld, uint32_t points, uint32_t borders) {
  tw_model *model = read_obj_with(obj, weld);
  tw_mesh_stats stats = stats_of(model->meshes);
  assert_int_equal(stats.vertices, points);
  assert_int_equal(stats.boundary_edges, borders);
  tw_mesh_stats_deinit(&stats);
  tw_model_destroy(model);
}

/* Each triangle of a tetrahedron with points of its own. */
#define TETRAHEDRON                                                                                          \
  "v 0 0 0\nv 0 1 0\nv 1 0 0\nf 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 0 1\nf 4 5 6\n"                                 \
  "v 0 0 0\nv 0 0 1\nv 0 1 0\nf 7 8 9\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 10 11 12\n"

/* Two squares side by side, each with its own points of the edge between them. */
#define SQUARES "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\n"

TEST(loose_triangles_close) {
  assert_points(TETRAHEDRON, TW_WELD_AUTO, 4, 0);
  assert_points(TETRAHEDRON, TW_WELD_NONE, 12, 12);
  tw_model *model = read_obj(TETRAHEDRON);
  assert_int_equal(model->meshes->welded_points, 8);
  assert_int_equal(model->warning_count, 0);
  tw_model_destroy(model);
}

TEST(a_seam_closes_and_a_tagged_file_stays) {
  assert_points(SQUARES "f 1 2 3 4\nf 5 6 7 8\n", TW_WELD_AUTO, 6, 6);
  assert_points(SQUARES "f 1 2 3 4\nf 5 6 7 8\nt interpolateboundary 1/0/0 1\n", TW_WELD_AUTO, 8, 8);
}

TEST(a_face_that_comes_to_a_point_twice_stays) {
  tw_model *model = read_obj(SQUARES "v 2 0 0\nv 3 0 0\nv 3 1 0\nv 1 -1 0\nv 2 -1 0\nf 1 2 3 4\nf 5 6 7 8\n"
                                     "f 9 10 11 9 12 13\n");
  assert_int_equal(model->meshes->welded_points, 2);
  assert_int_equal(model->meshes->face_count, 3);
  assert_int_equal(model->meshes->corner_count, 14);
  assert_int_equal(model->warning_count, 0);
  tw_model_destroy(model);
}

TEST(objects_stay_apart) {
  tw_model *model = read_obj("o a\n" SQUARES "f 1 2 3 4\no b\nf 5 6 7 8\n");
  assert_int_equal(model->mesh_count, 2);
  assert_int_equal(model->meshes[0].point_count + model->meshes[1].point_count, 8);
  tw_model_destroy(model);
}

TEST(sheets_that_merely_touch_stay_two) {
  /* In a point; then along an edge that is inside of one of them. */
  assert_points("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nv -1 0 0\nv 0 -1 0\nf 1 2 3\nf 4 5 6\n", TW_WELD_AUTO, 6,
                6);
  assert_points("v 0 0 0\nv 0 1 0\nv 1 0 0\nv -1 0 0\nf 1 2 4\nf 2 1 3\nv 0 0 0\nv 0 1 0\nv 0 0 1\nf 5 6 7\n",
                TW_WELD_AUTO, 7, 7);
}

TEST(faces_wound_against_each_other_stay_apart_with_a_warning) {
  tw_model *model = read_obj(SQUARES "f 1 2 3 4\nf 8 7 6 5\n");
  tw_mesh_stats stats = stats_of(model->meshes);
  assert_int_equal(stats.vertices, 8);
  assert_int_equal(stats.seam_edges, 2);
  assert_int_equal(stats.reversed_borders, 1);
  assert_int_equal(stats.listed_reversed_edges, 1);
  assert_memory_equal(stats.reversed_edge_points[0], ((uint32_t[2]){1, 2}), 8);
  assert_int_equal(model->warning_count, 1);
  assert_non_null(strstr(model->warnings[0], "1 edge is between faces that are wound the other way"));
  tw_mesh_stats_deinit(&stats);
  tw_model_destroy(model);
}

TEST(a_reversed_neighbour_with_the_same_points_is_counted) {
  tw_model *model = read_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 3 4\n");
  tw_mesh_stats stats = stats_of(model->meshes);
  assert_int_equal(stats.reversed_edges, 1);
  assert_int_equal(stats.reversed_borders + stats.seam_edges, 0);
  assert_memory_equal(stats.reversed_edge_points[0], ((uint32_t[2]){1, 2}), 8);
  tw_mesh_stats_deinit(&stats);
  tw_model_destroy(model);
}

TEST(a_face_as_thin_as_a_line_goes_with_a_warning) {
  tw_model *model = read_obj("v 1 0 0\nv 0 1e-30 0\nv 0 0 0\nf 1 2 3\n");
  assert_int_equal(model->meshes->face_count, 0);
  assert_int_equal(model->warning_count, 1);
  assert_non_null(strstr(model->warnings[0], "1 face with fewer than three different points is left out"));
  tw_model_destroy(model);
}

/* Groups and materials follow their faces. Points and equal texture coordinates that become one are those of
 * the first; colours that differ there are of corners. */
TEST(what_points_and_faces_bear_follows_them) {
  tw_model *model =
      read_obj("v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\n"
               "v 1 0 0 0.5 0.5 0.5\nv 2 0 0 1 1 0\nv 2 1 0 0 1 1\nv 1 1 0 0.5 0 0\n"
               "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt 1 0\nvt 2 0\nvt 2 1\nvt 1 1\nvn 0 0 1\nvn 0 1 0\n"
               "usemtl a\ng one\ns 1\nf 1/1/1 2/2/1 3/3/1 4/4/1\n"
               "usemtl b\ng two\ns 2\nf 5/5/2 6/6/2 7/7/2 8/8/2\n");
  const tw_mesh *m = model->meshes;
  static const uint32_t corners[8] = {0, 1, 2, 3, 1, 4, 5, 2}, uvs[8] = {0, 1, 2, 3, 1, 5, 6, 2};
  assert_int_equal(m->point_count, 6);
  assert_memory_equal(m->corners, corners, sizeof corners);
  assert_memory_equal(m->uv_sets[0].corners, uvs, sizeof uvs);
  const tw_attribute *colors = m->attributes;
  static const float reds[8] = {1, 0, 0, 1, 0.21404114f, 1, 0, 0.21404114f}; /* linear of 0.5 */
  assert_true(m->positions[3 * 4] == 2 && colors->value_count == 8 && colors->corners);
  for (uint32_t c = 0; c < 8; c++) assert_float_equal(colors->values[4 * colors->corners[c]], reds[c], 1e-6);
  assert_int_equal(m->face_materials[1], 1);
  assert_int_equal(m->face_groups[1], 1);
  assert_int_equal(m->face_smoothing[1], 2);
  assert_int_equal(m->normals.corners[4], 1);
  tw_model_destroy(model);
}

/* ---- within a distance ----------------------------------------------------------------------- */

TEST(points_at_the_same_place_become_one_exactly) {
  /* Two triangles that touch in a point, and a point that no face uses there. */
  tw_model *model =
      read_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nv -0 0 0\nv -1 0 0\nv 0 -1 0\nv 0 0 0\nf 1 2 3\nf 4 5 6\n");
  assert_int_equal(model->meshes->point_count, 7);
  assert_int_equal(tw_model_weld(model, 0, NULL), TW_OK);
  assert_int_equal(model->meshes->point_count, 5);
  assert_int_equal(model->meshes->welded_points, 2);
  assert_int_equal(model->meshes->corners[3], 0);
  tw_model_destroy(model);
}

TEST(points_within_a_distance_become_their_first) {
  static const char obj[] =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0.09 0 0\nv 0.18 0 0\nv 1 1 0.5\nf 1 2 3\nf 4 2 6\nf 5 3 6\n";
  tw_model *model = read_obj(obj);
  assert_int_equal(tw_model_weld(model, 0.1, NULL), TW_OK);
  /* 0.18 is near 0.09, but not near 0, which took that one. */
  static const uint32_t corners[9] = {0, 1, 2, 0, 1, 4, 3, 2, 4};
  assert_int_equal(model->meshes->point_count, 5);
  assert_memory_equal(model->meshes->corners, corners, sizeof corners);
  assert_true(model->meshes->positions[3 * 4 + 2] == 0.5f);
  tw_model_destroy(model);
}

TEST(faces_that_close_up_go_and_tags_follow) {
  static const char obj[] = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1.05 0 0\nv 2 0 0\nv 2 1 0\n"
                            "f 1 2 3 4\nf 2 5 3\nf 2 5 6 7 3\nt crease 6/3/0 0 1 1 4 4 5 1 2 3\n"
                            "t corner 1/1/0 4 7\nt hole 2/0/0 1 2\n";
  tw_model *model = read_obj(obj);
  assert_int_equal(tw_model_weld(model, 0.1, NULL), TW_OK);
  const tw_mesh *m = model->meshes;
  static const uint32_t corners[8] = {0, 1, 2, 3, 1, 4, 5, 2}, creases[4] = {0, 1, 1, 4}, hole = 1, sharp = 1;
  assert_int_equal(m->face_count, 2);
  assert_memory_equal(m->corners, corners, sizeof corners);
  assert_int_equal(m->crease_count, 2);
  assert_memory_equal(m->crease_edges, creases, sizeof creases);
  assert_true(m->crease_sharpness[1] == 3);
  assert_memory_equal(m->sharp_points, &sharp, sizeof sharp);
  assert_int_equal(m->hole_count, 1);
  assert_memory_equal(m->holes, &hole, sizeof hole);
  assert_non_null(strstr(model->warnings[model->warning_count - 2],
                         "1 face with fewer than three different points is left out: welding"));
  assert_string_equal(model->warnings[model->warning_count - 1],
                      "1 face names a point twice in a row: it keeps it once");
  assert_int_equal(tw_mesh_check(m, NULL, NULL), TW_OK);
  tw_model_destroy(model);
}

/* Beside the obvious way, over points of all sizes of coordinates. */
TEST(near_points_are_those_that_a_search_finds) {
  enum { COUNT = 400 };
  static float positions[COUNT][3];
  uint32_t found[COUNT], expected[COUNT], count, next = 0;
  uint32_t seed = 1;
  for (int i = 0; i < COUNT; i++)
    for (int k = 0; k < 3; k++) {
      seed = seed * 1664525 + 1013904223;
      positions[i][k] = ((float)(seed >> 8) / (float)(1 << 23) - 1) * (i % 2 ? 1.0f : 3.0f);
    }
  static const double distances[] = {0.05, 0.115, 0.26, 0.6, 1.4};
  for (size_t d = 0; d < sizeof distances / sizeof *distances; d++) {
    double distance = distances[d];
    assert_int_equal(tw_weld_within(positions[0], COUNT, distance, found, &count, NULL), TW_OK);
    uint32_t first[COUNT];
    next = 0;
    for (uint32_t i = 0; i < COUNT; i++) first[i] = i;
    for (uint32_t i = 0; i < COUNT; i++)
      for (uint32_t j = i + 1; first[i] == i && j < COUNT; j++) {
        double square = 0;
        for (int k = 0; k < 3; k++) {
          double side = (double)positions[i][k] - (double)positions[j][k];
          square += side * side;
        }
        if (first[j] == j && square <= distance * distance) first[j] = i;
      }
    for (uint32_t i = 0; i < COUNT; i++) expected[i] = first[i] == i ? next++ : expected[first[i]];
    assert_int_equal(count, next);
    assert_true(count < COUNT || distance < 0.2);
    assert_memory_equal(found, expected, sizeof found);
  }
}

/* Faces of which one point, and of which two are left. */
TEST(points_of_collapsed_faces_go_with_them) {
  static const char *const faces[] = {"f 4 5 6\n", "f 4 5 7\n", "f 4 5 6\nf 4 5 7\n"};
  for (size_t i = 0; i < sizeof faces / sizeof *faces; i++) {
    char text[256];
    snprintf(text, sizeof text, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nv 5 5 5\nv 5 5 5\nv 5 5 5\nv 6 6 6\n%s",
             faces[i]);
    tw_model *model = read_obj(text);
    assert_int_equal(model->meshes->face_count, 1);
    /* Points that no face of the file names stay. */
    assert_int_equal(model->meshes->point_count, i < 2 ? 4 : 3);
    assert_true(model->warning_count > 0);
    tw_model_destroy(model);
  }
}

/* All in one place, or a few cells: no search goes through all points for each. */
TEST(a_hundred_thousand_points_in_one_place_take_no_longer) {
  enum { COUNT = 100000 };
  float *positions = calloc(3 * COUNT, sizeof *positions);
  uint32_t *found = malloc(COUNT * sizeof *found), count;
  assert_true(positions && found);
  for (uint32_t i = 0; i < COUNT; i++) positions[3 * i] = (float)(i % 1000) * 1e-6f;
  assert_int_equal(tw_weld_within(positions, COUNT, 1, found, &count, NULL), TW_OK);
  assert_int_equal(count, 1);
  free(positions);
  free(found);
}

/* Point 3 is at the place of point 0; what stays moves up with all its joints. */
TEST(merged_points_keep_all_their_joints) {
  float positions[5][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}, {1, 1, 0}}, weights[5][8];
  uint16_t joints[5][8];
  uint32_t offsets[3] = {0, 3, 6}, corners[6] = {0, 1, 2, 3, 4, 2};
  for (int p = 0; p < 5; p++)
    for (int k = 0; k < 8; k++) {
      joints[p][k] = (uint16_t)(10 * p + k);
      weights[p][k] = (float)(k + 1) / 36;
    }
  tw_mesh mesh;
  tw_merged merged;
  tw_mesh_init(&mesh);
  mesh.point_count = 5;
  mesh.positions = positions[0];
  mesh.face_count = 2;
  mesh.corner_count = 6;
  mesh.face_offsets = offsets;
  mesh.corners = corners;
  mesh.skin = (tw_skin_weights){8, joints[0], weights[0]};
  tw_arena *arena = tw_arena_create();
  assert_non_null(arena);
  assert_int_equal(tw_mesh_merge_within(&mesh, 0, arena, &merged, NULL), TW_OK);
  assert_int_equal(mesh.point_count, 4);
  static const int from[4] = {0, 1, 2, 4};
  for (int p = 0; p < 4; p++)
    for (int k = 0; k < 8; k++) {
      assert_int_equal(mesh.skin.joints[8 * p + k], 10 * from[p] + k);
      assert_true(mesh.skin.weights[8 * p + k] == (float)(k + 1) / 36);
    }
  assert_int_equal(merged.bent, 1);
  tw_arena_destroy(arena);
}

/* The first point and the fourth are at one place. */
TEST(points_that_move_otherwise_are_counted_where_they_become_one) {
  for (int differ = 0; differ < 2; differ++)
    for (int is_skinned = 0; is_skinned < 2; is_skinned++) {
      float positions[5][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}, {1, 1, 0}}, moves[5][3] = {{0}},
            weights[5][4] = {{1}, {1}, {1}, {1}, {1}};
      uint16_t joints[5][4] = {{0}};
      uint32_t offsets[3] = {0, 3, 6}, corners[6] = {0, 1, 2, 3, 4, 2};
      if (differ) moves[3][1] = 1, joints[3][0] = 2;
      float *const morphs[] = {moves[0]};
      tw_mesh mesh;
      tw_merged merged;
      tw_mesh_init(&mesh);
      mesh.point_count = 5;
      mesh.positions = positions[0];
      mesh.face_count = 2;
      mesh.corner_count = 6;
      mesh.face_offsets = offsets;
      mesh.corners = corners;
      if (is_skinned)
        mesh.skin = (tw_skin_weights){4, joints[0], weights[0]};
      else
        mesh.morphs = (const float *const *)morphs, mesh.morph_count = 1;
      tw_arena *arena = tw_arena_create();
      assert_non_null(arena);
      assert_int_equal(tw_mesh_merge_within(&mesh, 0, arena, &merged, NULL), TW_OK);
      assert_int_equal(merged.points, 1);
      assert_int_equal(merged.bent, differ);
      tw_arena_destroy(arena);
    }
}
