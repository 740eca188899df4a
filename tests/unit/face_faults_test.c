/* Faces that keep seams from closing: collapsed and doubled ones, and slivers. What a closed surface is made
 * of is known, so what is added to it has to go again, in every format. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "glb.h"
#include "obj.h"
#include "weld.h"

enum { RINGS = 8, SIDES = 12, POINTS = RINGS * SIDES, TRIANGLES = 2 * POINTS, MOST = 4 * TRIANGLES };

/* Triangles with positions of their own. */
typedef struct loose {
  uint32_t count;
  float at[MOST][3][3];
} loose;

static void add(loose *to, const float *a, const float *b, const float *c) {
  assert_true(to->count < MOST);
  const float *corners[3] = {a, b, c};
  for (int k = 0; k < 3; k++) memcpy(to->at[to->count][k], corners[k], 3 * sizeof(float));
  to->count++;
}

/* A torus about the y axis: POINTS points and no border. */
static void add_torus(loose *to) {
  static float points[RINGS][SIDES][3];
  for (int i = 0; i < RINGS; i++)
    for (int k = 0; k < SIDES; k++) {
      double u = 6.283185307179586 * i / RINGS, v = 6.283185307179586 * k / SIDES, r = 3 + cos(v);
      points[i][k][0] = (float)(r * cos(u));
      points[i][k][1] = (float)sin(v);
      points[i][k][2] = (float)(r * sin(u));
    }
  for (int i = 0; i < RINGS; i++)
    for (int k = 0; k < SIDES; k++) {
      int m = (i + 1) % RINGS, n = (k + 1) % SIDES;
      add(to, points[i][k], points[i][n], points[m][n]);
      add(to, points[i][k], points[m][n], points[m][k]);
    }
}

static uint32_t random_below(uint32_t *state, uint32_t count) {
  *state = *state * 1664525u + 1013904223u;
  return (*state >> 8) % count;
}

/* ---- reading --------------------------------------------------------------------------------- */

static char *print_obj(const loose *of) {
  char *text = malloc(of->count * 200 + 1), *at = text;
  assert_non_null(text);
  *at = '\0';
  for (uint32_t t = 0; t < of->count; t++) {
    for (int k = 0; k < 3; k++)
      at += sprintf(at, "v %.9g %.9g %.9g\n", (double)of->at[t][k][0], (double)of->at[t][k][1],
                    (double)of->at[t][k][2]);
    at += sprintf(at, "f -3 -2 -1\n");
  }
  return text;
}

static char *print_stl(const loose *of) {
  char *text = malloc(of->count * 250 + 40), *at = text;
  assert_non_null(text);
  at += sprintf(at, "solid s\n");
  for (uint32_t t = 0; t < of->count; t++) {
    at += sprintf(at, "facet normal 0 0 0\nouter loop\n");
    for (int k = 0; k < 3; k++)
      at += sprintf(at, "vertex %.9g %.9g %.9g\n", (double)of->at[t][k][0], (double)of->at[t][k][1],
                    (double)of->at[t][k][2]);
    at += sprintf(at, "endloop\nendfacet\n");
  }
  strcpy(at, "endsolid s\n");
  return text;
}

static char *print_ply(const loose *of) {
  char *text = malloc(of->count * 250 + 300), *at = text;
  assert_non_null(text);
  at += sprintf(at,
                "ply\nformat ascii 1.0\nelement vertex %u\nproperty float x\nproperty float y\n"
                "property float z\nelement face %u\nproperty list uchar int vertex_indices\nend_header\n",
                3 * of->count, of->count);
  for (uint32_t t = 0; t < of->count; t++)
    for (int k = 0; k < 3; k++)
      at += sprintf(at, "%.9g %.9g %.9g\n", (double)of->at[t][k][0], (double)of->at[t][k][1],
                    (double)of->at[t][k][2]);
  for (uint32_t t = 0; t < of->count; t++) at += sprintf(at, "3 %u %u %u\n", 3 * t, 3 * t + 1, 3 * t + 2);
  return text;
}

static tw_model *read_glb(const loose *of) {
  char json[400];
  snprintf(json, sizeof json,
           "{'asset':{'version':'2.0'},'buffers':[{'byteLength':%u}],'bufferViews':[{'buffer':0,"
           "'byteLength':%u}],'accessors':[{'bufferView':0,'componentType':5126,'count':%u,'type':'VEC3'}],"
           "'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}]}",
           36 * of->count, 36 * of->count, 3 * of->count);
  return glb_read(json, of->at, 36 * of->count);
}

static tw_model *read_as(tw_format format, const loose *of) {
  if (format == TW_FORMAT_GLB) return read_glb(of);
  char *text = format == TW_FORMAT_OBJ   ? print_obj(of)
               : format == TW_FORMAT_STL ? print_stl(of)
                                         : print_ply(of);
  const uint8_t *bytes = (const uint8_t *)text;
  tw_model *model = NULL;
  tw_status status = format == TW_FORMAT_OBJ ? tw_obj_read(bytes, strlen(text), TW_WELD_AUTO, &model, NULL)
                     : format == TW_FORMAT_STL
                         ? tw_stl_read(bytes, strlen(text), TW_QUADS_NGON, TW_WELD_AUTO, &model, NULL)
                         : tw_ply_read(bytes, strlen(text), TW_WELD_AUTO, &model, NULL);
  free(text);
  assert_int_equal(status, TW_OK);
  return model;
}

static const tw_format formats[] = {TW_FORMAT_OBJ, TW_FORMAT_STL, TW_FORMAT_PLY, TW_FORMAT_GLB};

/* Reads the triangles in all formats; each has to give a closed surface of so many points and faces, and all
 * of the warnings. diagonals: edges of four faces. */
static void assert_closed_but(const loose *of, uint32_t vertices, uint32_t faces, uint32_t diagonals,
                              const char *const *warnings) {
  for (size_t f = 0; f < sizeof formats / sizeof *formats; f++) {
    tw_model *model = read_as(formats[f], of);
    tw_mesh_stats stats;
    assert_int_equal(tw_mesh_check(model->meshes, NULL, NULL), TW_OK);
    assert_int_equal(tw_mesh_describe(model->meshes, &stats, NULL), TW_OK);
    assert_int_equal(stats.vertices, vertices);
    assert_int_equal(stats.faces, faces);
    assert_int_equal(stats.boundary_edges, 0);
    assert_int_equal(stats.nonmanifold_edges, diagonals);
    assert_int_equal(stats.components, 1);
    uint32_t expected = 0;
    for (; warnings[expected]; expected++)
      if (!warns_of(model, warnings[expected]))
        fail_msg("format %d lacks \"%s\"", formats[f], warnings[expected]);
    assert_int_equal(model->warning_count, expected + warns_of(model, "lies so far from the origin"));
    tw_mesh_stats_deinit(&stats);
    tw_model_destroy(model);
  }
}

static void assert_closed(const loose *of, uint32_t vertices, uint32_t faces, const char *const *warnings) {
  assert_closed_but(of, vertices, faces, 0, warnings);
}

/* ---- tests ----------------------------------------------------------------------------------- */

TEST(a_tetrahedron_with_a_facet_twice_is_closed) {
  static const float at[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  static loose of;
  of.count = 0;
  add(&of, at[0], at[2], at[1]);
  add(&of, at[0], at[1], at[3]);
  add(&of, at[0], at[3], at[2]);
  add(&of, at[1], at[2], at[3]);
  add(&of, at[2], at[3], at[1]);
  assert_closed(&of, 4, 4, (const char *const[]){"1 face is left out: it is listed twice", NULL});
}

TEST(a_facet_collapsed_at_a_coordinate_of_almost_0_goes) {
  static const float at[5][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 1e-9f, 0}};
  static loose of;
  of.count = 0;
  add(&of, at[0], at[2], at[1]);
  add(&of, at[0], at[1], at[4]);
  add(&of, at[4], at[1], at[3]);
  add(&of, at[2], at[3], at[1]);
  add(&of, at[0], at[4], at[3]);
  add(&of, at[0], at[3], at[2]);
  assert_closed(&of, 4, 4, (const char *const[]){"left out", NULL});
}

/* A seam of two faces, and a sliver along it whose apex lies beside its middle. */
static void add_sliver(loose *of, uint32_t triangle, int side) {
  const float *a = of->at[triangle][side], *b = of->at[triangle][(side + 1) % 3];
  float middle[3];
  for (int i = 0; i < 3; i++) middle[i] = (a[i] + b[i]) / 2;
  middle[1] = nextafterf(middle[1], 9);
  add(of, a, b, middle);
}

TEST(a_sliver_between_the_two_sides_of_a_seam_goes) {
  static loose of;
  of.count = 0;
  add_torus(&of);
  add_sliver(&of, 17, 1);
  assert_closed(&of, POINTS, TRIANGLES, (const char *const[]){"1 sliver is left out", NULL});
}

/* A sliver that fills the gap between one edge and two shorter ones is needed. */
TEST(a_sliver_that_keeps_a_surface_closed_stays) {
  static loose of;
  of.count = 0;
  add_torus(&of);
  float a[3], b[3], c[3], middle[3];
  memcpy(a, of.at[0][0], sizeof a);
  memcpy(b, of.at[0][1], sizeof b);
  memcpy(c, of.at[0][2], sizeof c);
  for (int i = 0; i < 3; i++) middle[i] = (a[i] + b[i]) / 2;
  memcpy(of.at[0][1], middle, sizeof middle);
  add(&of, middle, b, c);
  add(&of, a, b, middle);
  assert_closed(&of, POINTS + 1, TRIANGLES + 2, (const char *const[]){NULL});
}

/* Whatever is added to a torus of loose triangles, in any order, goes again. */
TEST(faults_at_random_places_of_a_closed_surface_go) {
  static loose of;
  for (uint32_t seed = 1; seed <= 40; seed++) {
    uint32_t state = seed, doubles = 0, slivers = 0;
    of.count = 0;
    add_torus(&of);
    for (uint32_t i = 0; i < 1 + seed / 2; i++) {
      uint32_t t = i * 7 % TRIANGLES, turn = random_below(&state, 3);
      if (random_below(&state, 2)) {
        add(&of, of.at[t][turn], of.at[t][(turn + 1) % 3], of.at[t][(turn + 2) % 3]);
        doubles++;
      } else {
        add_sliver(&of, t, (int)turn);
        slivers++;
      }
    }
    for (uint32_t i = of.count; i-- > 1;) { /* shuffled */
      uint32_t k = random_below(&state, i + 1);
      float kept[3][3];
      memcpy(kept, of.at[i], sizeof kept);
      memmove(of.at[i], of.at[k], sizeof kept);
      memcpy(of.at[k], kept, sizeof kept);
    }
    char twice[60], sliver[60];
    snprintf(twice, sizeof twice,
             doubles == 1 ? "%u face is left out: it is listed twice"
                          : "%u faces are left out: they are listed twice",
             doubles);
    snprintf(sliver, sizeof sliver, slivers == 1 ? "%u sliver is left out" : "%u slivers are left out",
             slivers);
    const char *const both[] = {twice, sliver, NULL}, *const one[] = {doubles ? twice : sliver, NULL};
    assert_closed(&of, POINTS, TRIANGLES, doubles && slivers ? both : one);
  }
}

/* Two by two squares above and below, nearer than a tiny coordinate, with walls between them. At two corners
 * a diagonal joins points of the rim, and has four faces then. */
TEST(a_plate_thinner_than_a_tiny_coordinate_stays_closed) {
  static loose of;
  of.count = 0;
  float at[2][3][3][3];
  for (int side = 0; side < 2; side++)
    for (int i = 0; i < 3; i++)
      for (int k = 0; k < 3; k++) {
        at[side][i][k][0] = (float)i;
        at[side][i][k][1] = (float)side * 1e-7f;
        at[side][i][k][2] = (float)k;
      }
  for (int i = 0; i < 2; i++)
    for (int k = 0; k < 2; k++) {
      add(&of, at[1][i][k], at[1][i][k + 1], at[1][i + 1][k + 1]);
      add(&of, at[1][i][k], at[1][i + 1][k + 1], at[1][i + 1][k]);
      add(&of, at[0][i][k], at[0][i + 1][k + 1], at[0][i][k + 1]);
      add(&of, at[0][i][k], at[0][i + 1][k], at[0][i + 1][k + 1]);
    }
  static const int rim[9][2] = {{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}, {0, 0}};
  for (int w = 0; w < 8; w++) {
    const int *p = rim[w], *q = rim[w + 1];
    add(&of, at[0][p[0]][p[1]], at[1][p[0]][p[1]], at[1][q[0]][q[1]]);
    add(&of, at[0][p[0]][p[1]], at[1][q[0]][q[1]], at[0][q[0]][q[1]]);
  }
  assert_closed_but(&of, 10, 16, 2, (const char *const[]){"left out", NULL});
}

/* Small beside where it lies, not beside its own size. */
TEST(a_shape_far_from_the_origin_keeps_its_small_coordinates) {
  static const float at[4][3] = {{5e6f, 0, 0}, {5e6f + 1, 0, 0}, {5e6f, 1, 0}, {5e6f, 0, 1}};
  static loose of;
  of.count = 0;
  add(&of, at[0], at[2], at[1]);
  add(&of, at[0], at[1], at[3]);
  add(&of, at[0], at[3], at[2]);
  add(&of, at[1], at[2], at[3]);
  assert_closed(&of, 4, 4, (const char *const[]){NULL});
}

TEST(a_seam_where_three_faces_meet_stays_open_with_a_warning) {
  static const float at[5][3] = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}};
  static loose of;
  of.count = 0;
  add(&of, at[0], at[1], at[2]);
  add(&of, at[1], at[0], at[3]);
  add(&of, at[0], at[1], at[4]);
  for (size_t f = 0; f < sizeof formats / sizeof *formats; f++) {
    tw_model *model = read_as(formats[f], &of);
    assert_int_equal(model->meshes->point_count, 9);
    assert_true(warns_of(model, "3 edges lie on one another and stay open seams"));
    tw_model_destroy(model);
  }
}

/* In OBJ and glTF faces share points by index: a double is found there too, but for another material. */
TEST(a_face_twice_over_the_same_points_goes_unless_its_material_differs) {
  static const char points[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  char text[200];
  snprintf(text, sizeof text, "%sf 3 4 2\n", points);
  tw_model *model = read_obj(text);
  assert_int_equal(model->meshes->face_count, 4);
  assert_true(warns_of(model, "1 face is left out: it is listed twice"));
  tw_model_destroy(model);
  snprintf(text, sizeof text, "%susemtl decal\nf 3 4 2\n", points);
  model = read_obj(text);
  assert_int_equal(model->meshes->face_count, 5);
  assert_int_equal(model->warning_count, 0);
  tw_model_destroy(model);
  snprintf(text, sizeof text, "%sf 3 2 4\n", points); /* a back face */
  model = read_obj(text);
  assert_int_equal(model->meshes->face_count, 5);
  tw_model_destroy(model);
}
