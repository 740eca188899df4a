/* Surfaces by default: hard edges and quads as the file shows them, told in warnings, one answer for one
 * question. */
#include <stdio.h>
#include <string.h>

#include "loopback.h"

/* Stores a file; id receives its id. Returns the description, which the caller frees. */
static reply store(loopback *l, const char *type, const char *text, char id[API_ID_TEXT]) {
  reply r = loopback_post(l, "/v1/models", type, text);
  assert_int_equal(r.status, 201);
  snprintf(id, API_ID_TEXT, "%.*s", API_ID_TEXT - 1, strstr(r.body, "\"id\":\"") + strlen("\"id\":\""));
  return r;
}

#define POINTS "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
#define FACES  "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"

/* The greatest coordinate of an OBJ. */
static double reach(loopback *l, const char *id, const char *what) {
  reply r = model_get_ok(l, id, what);
  double most = 0;
  for (const char *at = strstr(r.body, "\nv "); at; at = strstr(at + 1, "\nv ")) {
    double x = 0;
    assert_int_equal(sscanf(at, "\nv %lf", &x), 1);
    if (x > most) most = x;
  }
  reply_free(&r);
  return most;
}

TEST_WITH(corners_of_borders_are_told, loopback_setup, loopback_teardown) {
  static const char points[] = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\nv 0 2 0\nv 1 2 0\n",
                    faces[] = "f 1 2 5 4\nf 2 3 6 5\nf 4 5 8 7\n";
  char id[API_ID_TEXT], text[256];
  snprintf(text, sizeof text, "%s%s", points, faces);
  reply r = store(*state, "model/obj", text, id);
  assert_null(strstr(r.body, "kept hard"));
  reply_free(&r);
  snprintf(text, sizeof text, "%ss 1\n%s", points, faces);
  r = store(*state, "model/obj", text, id);
  assert_non_null(
      strstr(r.body, "1 corner of a border is kept hard as the file shows it: creases=tags rounds it"));
  reply_free(&r);
  r = model_get_ok(*state, id, "surface.obj");
  assert_non_null(strstr(r.body, "v 1 1 0\n"));
  assert_non_null(strstr(reply_header(&r, "X-Tweend-Warning"), "1%20corner%20of%20a%20border"));
  reply_free(&r);
  r = model_get_ok(*state, id, "surface.obj?boundary=edge-only");
  assert_null(reply_header(&r, "X-Tweend-Warning"));
  reply_free(&r);
}

TEST_WITH(a_cube_without_normals_rounds_and_one_that_shows_its_edges_stays, loopback_setup,
          loopback_teardown) {
  char plain[API_ID_TEXT], flat[API_ID_TEXT];
  reply r = store(*state, "model/obj", POINTS FACES, plain);
  assert_null(strstr(r.body, "kept hard"));
  reply_free(&r);
  r = store(*state, "model/obj", POINTS "s off\n" FACES, flat);
  assert_non_null(strstr(r.body, "\"file\":12"));
  assert_non_null(strstr(r.body, "12 edges are kept hard as the file shows them: creases=tags rounds them"));
  assert_non_null(strstr(reply_header(&r, "X-Tweend-Warning"), "12%20edges%20are%20kept%20hard"));
  reply_free(&r);
  assert_true(reach(*state, plain, "surface.obj?level=3") < 0.9);
  assert_true(reach(*state, flat, "surface.obj?level=3") == 1);
  assert_true(reach(*state, flat, "surface.obj?level=3&creases=tags") < 0.9);
  r = model_get_ok(*state, flat, "surface.json");
  assert_non_null(strstr(reply_header(&r, "X-Tweend-Warning"), "creases%3Dtags%20rounds%20them"));
  reply_free(&r);
  r = model_get_ok(*state, flat, "surface.json?creases=auto");
  assert_null(reply_header(&r, "X-Tweend-Warning"));
  reply_free(&r);
}

/* A made model has as tags what its source only shows. */
TEST_WITH(edges_stay_hard_where_a_model_is_edited, loopback_setup, loopback_teardown) {
  char flat[API_ID_TEXT], path[96], made[API_ID_TEXT];
  reply r = store(*state, "model/obj", POINTS "s off\n" FACES, flat);
  reply_free(&r);
  snprintf(path, sizeof path, "/v1/models/%s/edits", flat);
  r = loopback_post(*state, path, "application/json",
                    "{\"edits\":[{\"edit\":\"scale\",\"vertices\":\"all\",\"by\":[2,2,2]}]}");
  assert_int_equal(r.status, 201);
  snprintf(made, sizeof made, "%.*s", API_ID_TEXT - 1, strstr(r.body, "\"id\":\"") + strlen("\"id\":\""));
  assert_non_null(strstr(r.body, "\"creases\":12"));
  reply_free(&r);
  assert_true(reach(*state, made, "surface.obj?level=3") == 2);
}

/* Two triangles of a plain exporter's quad. */
TEST_WITH(stl_is_of_quads_by_default_which_is_told, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT];
  static const char square[] = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 2 0 0\n"
                               "vertex 2 1 0\nendloop\nendfacet\nfacet normal 0 0 1\nouter loop\n"
                               "vertex 0 0 0\nvertex 2 1 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n";
  reply r = store(*state, "model/stl", square, id);
  assert_non_null(strstr(r.body, "\"faces\":1,"));
  assert_non_null(strstr(r.body, "\"paired_quads\":1,"));
  assert_non_null(
      strstr(r.body, "1 pair of triangles is joined into a quad: quads=ngon keeps the triangles"));
  reply_free(&r);
  static const struct {
    const char *one, *other;
    bool is_same;
  } pairs[] = {{"surface", "surface?quads=auto", true},
               {"surface", "surface?creases=file", true},
               {"surface", "surface?quads=ngon", false}};
  for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
    reply a = model_get_ok(*state, id, pairs[i].one), b = model_get_ok(*state, id, pairs[i].other);
    assert_int_equal(strcmp(reply_header(&a, "ETag"), reply_header(&b, "ETag")) == 0, pairs[i].is_same);
    reply_free(&a);
    reply_free(&b);
  }
  r = model_get_ok(*state, id, "surface.json?level=1&quads=ngon");
  assert_non_null(strstr(r.body, "\"faces\":6,"));
  reply_free(&r);
}
