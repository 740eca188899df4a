/* Warnings of surfaces: those of the model, and what a form is without. */
#include "cube_and_tank.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The file has one, and the borrowed clip moves two nodes that are not there. */
TEST_WITH(a_surface_tells_the_warnings_of_its_model, setup, fixture_stop) {
  fixture *f = *state;
  static const char text[] = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nf 1 1 2\n";
  char id[API_ID_TEXT], rest[128];
  loopback_upload(f->loop, "model/obj", text, id);
  static const char *const forms[] = {"surface.glb", "surface.gltf", "surface.obj", "surface.json"};
  char first[400];
  for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
    reply r = model_get_ok(f->loop, id, forms[i]);
    const char *warning = reply_header(&r, "X-Tweend-Warning");
    assert_memory_equal(warning, "1; ", 3);
    snprintf(first, sizeof first, "%s", warning + 3);
    reply_free(&r);
  }
  reply given = loopback_post(f->loop, "/v1/surface.glb", "model/obj", text);
  assert_string_equal(reply_header(&given, "X-Tweend-Warning") + 3, first);
  reply_free(&given);
  snprintf(rest, sizeof rest, "surface.glb?clip=%s/aim&level=0", f->tank);
  reply r = model_get_ok(f->loop, id, rest);
  int count = atoi(reply_header(&r, "X-Tweend-Warning"));
  assert_true(count > 1);
  assert_string_equal(strchr(reply_header(&r, "X-Tweend-Warning"), ' ') + 1, first);
  reply_free(&r);
}

TEST_WITH(polygons_without_a_fan_are_told, setup, fixture_stop) {
  const fixture *f = *state;
  char id[API_ID_TEXT];
  loopback_upload(f->loop, "model/obj",
                  "v 0 0 0\nv 6 0 0\nv 5 4 0\nv 4 1 0\nv 3 4 0\nv 2 1 0\nv 1 4 0\nf 1 2 3 4 5 6 7\n", id);
  const struct {
    const char *rest, *says;
  } cases[] = {{"surface.glb?level=0&polygons=ngon", "joined%20when%20the%20file"},
               {"surface.glb?level=0&polygons=ngon&encoding=quantized", "split%20into%20triangles"},
               {"surface.glb?level=0", NULL},
               {"surface.glb?level=1&polygons=ngon", NULL}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    reply r = model_get_ok(f->loop, id, cases[i].rest);
    const char *warning = reply_header(&r, "X-Tweend-Warning");
    if (cases[i].says)
      assert_true(warning && strstr(warning, "1%20concave%20polygon%20is") && strstr(warning, cases[i].says));
    else
      assert_null(warning);
    reply_free(&r);
  }
}

/* The first warning of an answer; "" without. */
static void read_warning(const reply *r, char *out, size_t size) {
  const char *text = reply_header(r, "X-Tweend-Warning");
  size_t count = 0;
  unsigned byte;
  while (text && *text && count + 1 < size) {
    bool is_coded = *text == '%' && sscanf(text + 1, "%2x", &byte) == 1;
    out[count++] = (char)(is_coded ? (int)byte : *text);
    text += is_coded ? 3 : 1;
  }
  out[count] = 0;
}

/* A parameter that a form has no use for is told, unless its value says what the form does anyway. */
TEST_WITH(what_a_form_cannot_follow_is_told, setup, fixture_stop) {
  const fixture *f = *state;
  static const struct {
    const char *form, *query, *idle;
  } cases[] = {
      {"stl", "unit=mm&encoding=meshopt", "encoding=meshopt"},
      {"3mf", "encoding=quantized", "encoding=quantized"},
      {"ply", "encoding=meshopt&influences=4", "encoding=meshopt, influences=4"},
      {"obj", "encoding=meshopt&polygons=triangles", "encoding=meshopt, polygons=triangles"},
      {"bin", "encoding=quantized&polygons=ngon&normals=limit&uv=all",
       "encoding=quantized, polygons=ngon, normals=limit, uv=all"},
      {"bin", "normals=limit&with=normals", NULL},
      {"stl", "unit=mm&polygons=ngon&normals=none&uv=all&skin=keep",
       "polygons=ngon, normals=none, uv=all, skin=keep"},
      {"stl", "unit=mm&encoding=float&polygons=triangles&normals=auto&influences=all&skin=bake&clip=none",
       NULL},
      {"obj", "polygons=ngon&normals=none&uv=all&skin=bake", NULL},
      {"ply", "polygons=ngon&normals=limit&uv=all", NULL},
      {"json", "scale=2", "scale=2"},
      {"json", "unit=mm&scale=2&shells=true", NULL},
      {"obj", "in_place=true", "in_place=true"},
      {"bin", "root_motion=auto", "root_motion=auto"},
      {"json", "encoding=meshopt&polygons=ngon&influences=4", NULL},
      {"glb", "encoding=meshopt&normals=none&uv=all", NULL},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char rest[200], target[240], wanted[200], told[400];
    snprintf(rest, sizeof rest, "surface.%s?%s", cases[i].form, cases[i].query);
    reply r = model_get_ok(f->loop, f->cube, rest);
    snprintf(target, sizeof target, "surface.%s%s", cases[i].form,
             strcmp(cases[i].form, "stl") == 0 ? "?unit=mm" : "");
    reply plain = model_get_ok(f->loop, f->cube, target);
    read_warning(&r, told, sizeof told);
    snprintf(wanted, sizeof wanted, "1; surface.%s is the same without %s", cases[i].form, cases[i].idle);
    if (strcmp(told, cases[i].idle ? wanted : "") != 0) fail_msg("%s: %s", rest, told);
    if (cases[i].idle) {
      assert_int_equal(plain.size, r.size);
      assert_memory_equal(plain.body, r.body, r.size);
      assert_string_not_equal(reply_header(&r, "ETag"), reply_header(&plain, "ETag"));
    }
    reply_free(&r);
    reply_free(&plain);
  }
}

/* A hole is no face of an OBJ, and tags beside it would make another surface. Deeper levels are no cages. */
TEST_WITH(holes_that_an_obj_is_without_are_told, setup, fixture_stop) {
  const fixture *f = *state;
  char id[API_ID_TEXT], told[400];
  loopback_upload(f->loop, "model/obj",
                  "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\nf 1 2 5 4\nf 2 3 6 5\n"
                  "t crease 2/1/0 0 1 2\nt hole 1/0/0 1\n",
                  id);
  for (int level = 0; level < 2; level++) {
    char rest[40];
    snprintf(rest, sizeof rest, "surface.obj?level=%d", level);
    reply r = model_get_ok(f->loop, id, rest);
    read_warning(&r, told, sizeof told);
    assert_string_equal(told, level == 0
                                  ? "1; surface.obj is without the holes, creases and corners of 1 mesh "
                                    "that has holes"
                                  : "");
    assert_null(strstr(r.body, "t crease"));
    reply_free(&r);
  }
}
