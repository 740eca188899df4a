/* Describing control meshes: shapes whose numbers are known. */
#include <stdio.h>
#include <string.h>

#include "cube.h"
#include "obj.h"

typedef struct described {
  tw_model *model;
  tw_mesh_stats facts;
} described;

static described describe(const char *obj) {
  described d = {.model = read_obj(obj)};
  assert_int_equal(d.model->mesh_count, 1);
  assert_int_equal(tw_mesh_describe(&d.model->meshes[0], &d.facts, NULL), TW_OK);
  return d;
}

static void end(described *d) {
  tw_mesh_stats_deinit(&d->facts);
  tw_model_destroy(d->model);
}

typedef struct counts {
  uint32_t vertices, edges, faces, boundary_edges, boundary_loops, components;
  int32_t euler;
  uint32_t nonmanifold_edges, nonmanifold_vertices, extraordinary;
} counts;

static void assert_counts(const char *what, const char *obj, const counts *wanted) {
  described d = describe(obj);
  const tw_mesh_stats *f = &d.facts;
  const counts found = {f->vertices,
                        f->edges,
                        f->faces,
                        f->boundary_edges,
                        f->boundary_loops,
                        f->components,
                        (int32_t)f->euler_characteristic,
                        f->nonmanifold_edges,
                        f->nonmanifold_vertices,
                        f->extraordinary_vertices};
  if (memcmp(&found, wanted, sizeof found) != 0)
    fail_msg("%s: V %u E %u F %u, border %u in %u, %u components, Euler %d, %u and %u not manifold, %u poles",
             what, found.vertices, found.edges, found.faces, found.boundary_edges, found.boundary_loops,
             found.components, found.euler, found.nonmanifold_edges, found.nonmanifold_vertices,
             found.extraordinary);
  end(&d);
}

#define CUBE                                                                                                 \
  "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"                     \
  "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"

/* ---- shapes ---------------------------------------------------------------------------------- */

TEST(a_mesh_of_nothing_is_described) {
  static const uint32_t offsets[1] = {0};
  tw_mesh mesh = mesh_of(NULL, 0, NULL, offsets, 0);
  tw_mesh_stats facts;
  assert_int_equal(tw_mesh_check(&mesh, NULL, NULL), TW_OK);
  assert_int_equal(tw_mesh_describe(&mesh, &facts, NULL), TW_OK);
  assert_int_equal(facts.vertices + facts.edges + facts.faces + facts.components, 0);
  tw_mesh_stats_deinit(&facts);
}

TEST(a_cube_has_eight_corners_of_three_edges) {
  described d = describe(CUBE "v 9 9 9\n");
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
  assert_counts("a disc", text, &(counts){20, 31, 12, 14, 1, 1, 1, 0, 0, 0});
  write_grid(text, 5, 4, true, false);
  assert_counts("a tube", text, &(counts){20, 35, 15, 10, 2, 1, 0, 0, 0, 0});
  write_grid(text, 5, 4, true, true);
  assert_counts("a torus", text, &(counts){20, 40, 20, 0, 0, 1, 0, 0, 0, 0});
}

#define FIN     "v 0 0 0\nv 0 1 0\nv 1 0 0\nv -1 0 0\nv 0 0 1\nf 1 2 3\nf 2 1 4\nf 1 2 5\n"
#define BOW_TIE "v 0 0 0\nv 1 0 0\nv 1 1 0\nv -1 0 0\nv -1 -1 0\nf 1 2 3\nf 1 4 5\n"
#define FLIPPED "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\nf 1 2 5 4\nf 2 5 6 3\n"
#define MOEBIUS                                                                                              \
  "v 0 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\nv 2 0 0\nv 2 1 0\nv 3 0 0\nv 3 1 0\n"                                 \
  "f 1 3 4 2\nf 3 5 6 4\nf 5 7 8 6\nf 7 2 1 8\n"

TEST(shapes_have_the_counts_that_they_have) {
  static const struct {
    const char *what, *obj;
    counts
        counts; /* V, E, F, border edges, loops, components, Euler, edges and vertices not manifold, poles */
  } shapes[] = {
      {"a cube and a point", CUBE "v 9 9 9\n", {8, 12, 6, 0, 0, 1, 2, 0, 0, 8}},
      {"five quads round a point, one of them cut off a corner: border points of two and three edges",
       "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 1\nv -4 2 0\nv -4 0 0\nv -4 -4 0\nv 0 -4 0\nv 2 -4 0\nv 4 -4 0\n"
       "v 5 -2 0\nf 1 2 3 4\nf 1 4 5 6\nf 1 6 7 8\nf 1 8 9 10\nf 1 10 11 2\n",
       {11, 15, 5, 10, 1, 1, 1, 0, 0, 1}},
      {"three faces on an edge", FIN, {5, 7, 3, 6, 1, 1, 1, 1, 2, 0}},
      {"faces that share only a point: two loops", BOW_TIE, {5, 6, 2, 6, 2, 1, 1, 0, 1, 0}},
      {"a flipped neighbour", FLIPPED, {6, 7, 2, 6, 1, 1, 1, 1, 2, 0}},
      {"a Moebius strip: one border, and one edge to turn at", MOEBIUS, {8, 12, 4, 8, 1, 1, 0, 1, 2, 0}},
  };
  for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++)
    assert_counts(shapes[i].what, shapes[i].obj, &shapes[i].counts);
}

/* A fan of three triangles: its point on the border has four edges. */
TEST(the_pole_of_a_fan_has_four_edges) {
  described d = describe("v 0 0 0\nv 1 0 0\nv 1 1 0\nv -1 1 0\nv -1 0 0\nf 1 2 3\nf 1 3 4\nf 1 4 5\n");
  assert_int_equal(d.facts.extraordinary_vertices, 1);
  assert_int_equal(d.facts.valences[0], 4);
  assert_int_equal(d.facts.triangles, 3);
  end(&d);
}

/* ---- where it is not a surface --------------------------------------------------------------- */

TEST(places_that_are_not_manifold_are_listed) {
  static const struct {
    const char *obj;
    uint32_t edge[2], vertex;
  } cases[] = {{FIN, {0, 1}, 0}, {FLIPPED, {1, 4}, 1}, {MOEBIUS, {1, 0}, 0}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    described d = describe(cases[i].obj);
    assert_memory_equal(d.facts.nonmanifold_edge_points[0], cases[i].edge, sizeof cases[i].edge);
    assert_int_equal(d.facts.nonmanifold_vertex_points[0], cases[i].vertex);
    end(&d);
  }
  described d = describe(BOW_TIE);
  assert_int_equal(d.facts.nonmanifold_vertex_points[0], 0);
  end(&d);
}

TEST(the_first_64_places_are_listed) {
  char text[16384], *at = text;
  for (int i = 0; i < 70; i++) {
    at += sprintf(at, "v %d 0 0\nv %d 1 0\nv %d 0 1\n", i, i, i);
    at += sprintf(at, "f -1 -2 -3\nf -1 -2 -3\n");
  }
  strcpy(at, "t interpolateboundary 1/0/0 1\n"); /* a control mesh keeps doubled faces */
  described d = describe(text);
  assert_int_equal(d.facts.components, 70);
  assert_int_equal(d.facts.nonmanifold_edges, 210);
  assert_int_equal(d.facts.nonmanifold_vertices, 210);
  assert_int_equal(d.facts.listed_nonmanifold_edges, 64);
  assert_int_equal(d.facts.listed_nonmanifold_vertices, 64);
  assert_int_equal(d.facts.nonmanifold_vertex_points[63], 63);
  end(&d);
}

/* ---- tags and groups ------------------------------------------------------------------------- */

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
