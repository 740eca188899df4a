/* Describing control meshes: shapes whose numbers are known. */
#include <stdio.h>
#include <string.h>

#include "test.h"
#include "tweend/format.h"

typedef struct described {
  tw_model *model;
  tw_mesh_stats facts;
} described;

static described describe(const char *obj) {
  described d = {0};
  tw_error error;
  if (tw_obj_read((const uint8_t *)obj, strlen(obj), TW_WELD_AUTO, &d.model, &error) != TW_OK)
    fail_msg("line %u: %s", (unsigned)error.line, error.detail);
  assert_int_equal(d.model->mesh_count, 1);
  assert_int_equal(tw_mesh_describe(&d.model->meshes[0], &d.facts, &error), TW_OK);
  return d;
}

static void end(described *d) {
  tw_mesh_stats_deinit(&d->facts);
  tw_model_destroy(d->model);
}

typedef struct counts {
  uint32_t vertices, edges, faces, boundary_edges, boundary_loops, components;
  int64_t euler;
  uint32_t nonmanifold_edges, nonmanifold_vertices, extraordinary;
} counts;

static void assert_counts(const tw_mesh_stats *f, counts wanted) {
  assert_int_equal(f->vertices, wanted.vertices);
  assert_int_equal(f->edges, wanted.edges);
  assert_int_equal(f->faces, wanted.faces);
  assert_int_equal(f->boundary_edges, wanted.boundary_edges);
  assert_int_equal(f->boundary_loops, wanted.boundary_loops);
  assert_int_equal(f->components, wanted.components);
  assert_int_equal(f->euler_characteristic, wanted.euler);
  assert_int_equal(f->nonmanifold_edges, wanted.nonmanifold_edges);
  assert_int_equal(f->nonmanifold_vertices, wanted.nonmanifold_vertices);
  assert_int_equal(f->extraordinary_vertices, wanted.extraordinary);
}

#define CUBE                                                                                                 \
  "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"                     \
  "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"

/* ---- shapes ----------------------------------------------------------------------------------- */

TEST(a_mesh_of_nothing_is_described) {
  static const uint32_t offsets[1] = {0};
  tw_mesh mesh;
  tw_mesh_init(&mesh);
  mesh.face_offsets = offsets;
  tw_mesh_stats facts;
  assert_int_equal(tw_mesh_check(&mesh, NULL, NULL), TW_OK);
  assert_int_equal(tw_mesh_describe(&mesh, &facts, NULL), TW_OK);
  assert_int_equal(facts.vertices + facts.edges + facts.faces + facts.components, 0);
  tw_mesh_stats_deinit(&facts);
}

TEST(a_cube_is_a_sphere_with_eight_corners_of_three_edges) {
  described d = describe(CUBE "v 9 9 9\n");
  assert_counts(
      &d.facts,
      (counts){.vertices = 8, .edges = 12, .faces = 6, .components = 1, .euler = 2, .extraordinary = 8});
  assert_int_equal(d.facts.unused_points, 1);
  assert_int_equal(d.facts.valence_count, 1);
  assert_int_equal(d.facts.valences[0], 3);
  assert_int_equal(d.facts.valence_vertices[0], 8);
  assert_int_equal(d.facts.quads, 6);
  assert_int_equal(d.facts.face_size_count, 1);
  assert_true(d.facts.min[0] == -1 && d.facts.max[2] == 1); /* without the unused point */
  end(&d);
}

/* Rows of `columns` points; across a seam the last column or row is joined to the first. */
static void write_grid(char *text, int columns, int rows, bool round, bool closed) {
  int across = round ? columns : columns - 1, up = closed ? rows : rows - 1;
  for (int i = 0; i < columns * rows; i++) text += sprintf(text, "v %d %d 0\n", i % columns, i / columns);
  for (int y = 0; y < up; y++)
    for (int x = 0; x < across; x++) {
      int right = (x + 1) % columns, above = (y + 1) % rows;
      text += sprintf(text, "f %d %d %d %d\n", y * columns + x + 1, y * columns + right + 1,
                      above * columns + right + 1, above * columns + x + 1);
    }
}

TEST(a_grid_is_a_disc_a_tube_or_a_torus) {
  char text[4096];
  write_grid(text, 5, 4, false, false);
  described d = describe(text);
  assert_counts(&d.facts, (counts){.vertices = 20,
                                   .edges = 31,
                                   .faces = 12,
                                   .boundary_edges = 14,
                                   .boundary_loops = 1,
                                   .components = 1,
                                   .euler = 1});
  end(&d);
  write_grid(text, 5, 4, true, false);
  d = describe(text);
  assert_counts(&d.facts, (counts){.vertices = 20,
                                   .edges = 35,
                                   .faces = 15,
                                   .boundary_edges = 10,
                                   .boundary_loops = 2,
                                   .components = 1});
  end(&d);
  write_grid(text, 5, 4, true, true);
  d = describe(text);
  assert_counts(&d.facts, (counts){.vertices = 20, .edges = 40, .faces = 20, .components = 1});
  end(&d);
}

TEST(valences_count_edges_inside_and_on_borders) {
  /* Five quads round a point, one of them cut off a corner: the pole, and border points of 2 and 3 edges. */
  described d = describe("v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 1\nv -4 2 0\nv -4 0 0\nv -4 -4 0\nv 0 -4 0\n"
                         "v 2 -4 0\nv 4 -4 0\nv 5 -2 0\n"
                         "f 1 2 3 4\nf 1 4 5 6\nf 1 6 7 8\nf 1 8 9 10\nf 1 10 11 2\n");
  assert_counts(&d.facts, (counts){.vertices = 11,
                                   .edges = 15,
                                   .faces = 5,
                                   .boundary_edges = 10,
                                   .boundary_loops = 1,
                                   .components = 1,
                                   .euler = 1,
                                   .extraordinary = 1});
  assert_int_equal(d.facts.valences[0], 5);
  end(&d);
  /* A fan of three triangles: its point on the border has four edges. */
  d = describe("v 0 0 0\nv 1 0 0\nv 1 1 0\nv -1 1 0\nv -1 0 0\nf 1 2 3\nf 1 3 4\nf 1 4 5\n");
  assert_int_equal(d.facts.extraordinary_vertices, 1);
  assert_int_equal(d.facts.valences[0], 4);
  assert_int_equal(d.facts.triangles, 3);
  end(&d);
}

/* ---- where it is not a surface ---------------------------------------------------------------- */

TEST(three_faces_on_an_edge_are_found) {
  described d = describe("v 0 0 0\nv 0 1 0\nv 1 0 0\nv -1 0 0\nv 0 0 1\nf 1 2 3\nf 2 1 4\nf 1 2 5\n");
  assert_counts(&d.facts, (counts){.vertices = 5,
                                   .edges = 7,
                                   .faces = 3,
                                   .boundary_edges = 6,
                                   .boundary_loops = 1,
                                   .components = 1,
                                   .euler = 1,
                                   .nonmanifold_edges = 1,
                                   .nonmanifold_vertices = 2});
  assert_int_equal(d.facts.nonmanifold_edge_points[0][0], 0);
  assert_int_equal(d.facts.nonmanifold_edge_points[0][1], 1);
  assert_int_equal(d.facts.nonmanifold_vertex_points[0], 0);
  assert_int_equal(d.facts.nonmanifold_vertex_points[1], 1);
  end(&d);
}

TEST(faces_that_share_only_a_point_are_a_bow_tie_of_two_loops) {
  described d = describe("v 0 0 0\nv 1 0 0\nv 1 1 0\nv -1 0 0\nv -1 -1 0\nf 1 2 3\nf 1 4 5\n");
  assert_counts(&d.facts, (counts){.vertices = 5,
                                   .edges = 6,
                                   .faces = 2,
                                   .boundary_edges = 6,
                                   .boundary_loops = 2,
                                   .components = 1,
                                   .euler = 1,
                                   .nonmanifold_vertices = 1});
  assert_int_equal(d.facts.nonmanifold_vertex_points[0], 0);
  end(&d);
}

TEST(a_flipped_neighbour_is_found) {
  described d = describe("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\nf 1 2 5 4\nf 2 5 6 3\n");
  assert_counts(&d.facts, (counts){.vertices = 6,
                                   .edges = 7,
                                   .faces = 2,
                                   .boundary_edges = 6,
                                   .boundary_loops = 1,
                                   .components = 1,
                                   .euler = 1,
                                   .nonmanifold_edges = 1,
                                   .nonmanifold_vertices = 2});
  assert_int_equal(d.facts.nonmanifold_edge_points[0][0], 1);
  assert_int_equal(d.facts.nonmanifold_edge_points[0][1], 4);
  end(&d);
}

/* One border, and nowhere to turn from the inside to the outside but at one edge. */
TEST(a_moebius_strip_has_one_loop_and_one_edge_to_turn_at) {
  described d = describe("v 0 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\nv 2 0 0\nv 2 1 0\nv 3 0 0\nv 3 1 0\n"
                         "f 1 3 4 2\nf 3 5 6 4\nf 5 7 8 6\nf 7 2 1 8\n");
  assert_counts(&d.facts, (counts){.vertices = 8,
                                   .edges = 12,
                                   .faces = 4,
                                   .boundary_edges = 8,
                                   .boundary_loops = 1,
                                   .components = 1,
                                   .euler = 0,
                                   .nonmanifold_edges = 1,
                                   .nonmanifold_vertices = 2});
  assert_int_equal(d.facts.nonmanifold_edge_points[0][0] + d.facts.nonmanifold_edge_points[0][1], 1);
  end(&d);
}

TEST(the_first_64_places_are_listed) {
  char text[16384], *at = text;
  for (int i = 0; i < 70; i++) {
    at += sprintf(at, "v %d 0 0\nv %d 1 0\nv %d 0 1\n", i, i, i);
    at += sprintf(at, "f -1 -2 -3\nf -1 -2 -3\n");
  }
  described d = describe(text);
  assert_int_equal(d.facts.components, 70);
  assert_int_equal(d.facts.nonmanifold_edges, 210);
  assert_int_equal(d.facts.nonmanifold_vertices, 210);
  assert_int_equal(d.facts.listed_nonmanifold_edges, 64);
  assert_int_equal(d.facts.listed_nonmanifold_vertices, 64);
  assert_int_equal(d.facts.nonmanifold_vertex_points[63], 63);
  end(&d);
}

/* ---- tags and groups -------------------------------------------------------------------------- */

TEST(tags_count_where_they_are_in_force) {
  described d =
      describe(CUBE "v 9 9 9\nt crease 2/1/0 0 1 2\nt crease 2/1/0 1 0 3\nt crease 2/1/0 1 2 0\n"
                    "t crease 2/1/0 0 6 5\nt crease 2/1/0 2 3 10\n"
                    "t corner 1/1/0 4 1\nt corner 1/1/0 5 2\nt corner 1/1/0 5 0\nt corner 1/1/0 8 2\n"
                    "t hole 2/0/0 3 3\n");
  assert_int_equal(d.facts.creases, 2);      /* 0 1 twice and 2 3; 1 2 is smooth, 0 6 is no edge */
  assert_int_equal(d.facts.sharp_points, 1); /* 4; 5 was taken back, no face uses 8 */
  assert_int_equal(d.facts.holes, 1);
  end(&d);
}

TEST(groups_are_counted_in_the_order_of_the_file) {
  described d = describe("g one\n" CUBE "g two\nf 1 2 3\ng none\ng one\nf 3 2 1\ng\nf 1 3 4\n");
  assert_int_equal(d.facts.group_count, 2);
  assert_int_equal(d.facts.groups[0], 0);
  assert_int_equal(d.facts.group_faces[0], 7);
  assert_int_equal(d.facts.groups[1], 1);
  assert_int_equal(d.facts.group_faces[1], 1);
  end(&d);
}
