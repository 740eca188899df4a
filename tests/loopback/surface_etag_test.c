/* Entity tags of surfaces: which requests have the same one. */
#include "cube_and_tank.h"

#include <stdio.h>
#include <string.h>

TEST_WITH(equal_questions_have_one_tag_and_one_answer, setup, fixture_stop) {
  fixture *f = *state;
  static const struct {
    const char *one, *other;
    bool is_same;
  } pairs[] = {
      {"surface", "surface.glb?level=1&scheme=catmull-clark&limit=false&quads=ngon&polygons=triangles", true},
      {"surface", "surface?boundary=edge-and-corner&uv=corners-only&creasing=uniform&triangles=catmull-clark",
       true},
      {"surface", "surface?creasing=chaikin", false},
      {"levels.json", "levels.json?boundary=edge-and-corner&quads=ngon", true},
      {"levels.json", "levels.json?boundary=edge-only", false},
      {"levels.json", "levels.json?clip=drive,aim", true},
      {"levels.json", "levels.json?clip=drive", false},
      {"levels.json", "levels.json?clip=none", false},
      {"levels.json?clip=drive", "levels.json?clip=aim", false},
      {"levels.json?root_motion=hull", "levels.json?root_motion=turret", false},
      {"surface.ply", "surface.ply?unit=m&scale=1", true},
      {"surface?level=auto", "surface?level=auto&error=0.1%25&faces=200000", true},
      {"surface?level=auto", "surface?level=auto&error=0.1%25", false},
      {"surface?level=auto&faces=200000", "surface?level=auto", false},
      {"surface", "surface?influences=4&details=false", true},
      {"surface.stl", "surface.stl?uv=corners-only", true},
      {"surface?clip=drive&at=1", "surface?at=1.0", true},
      {"surface?level=01", "surface?level=1", true},
      {"surface", "surface?level=2", false},
      {"surface", "surface.gltf", false},
      {"surface", "surface?clip=drive", false},
      {"surface?clip=drive", "surface?clip=aim", false},
      {"surface?clip=drive&at=1", "surface?clip=drive&at=2", false},
      {"surface?normals=auto", "surface?normals=limit", true},
      {"surface?level=0&normals=auto", "surface?level=0", true},
      {"surface?level=0&limit=true", "surface?level=0&limit=true&normals=limit", true},
      {"surface?level=0", "surface?level=0&normals=limit", false},
      {"surface", "surface?creases=file&crease_sharpness=infinite", true},
      {"surface?creases=tags", "surface?creases=tags&crease_sharpness=2", true},
      {"surface?creases=auto", "surface?crease_sharpness=infinite&creases=auto", true},
      {"surface?creases=auto&crease_sharpness=10", "surface?creases=auto", true},
      {"surface", "surface?weld=auto", true},
      {"surface?weld=0.5", "surface?weld=0.50", true},
      {"surface?weld=exact", "surface?weld=none", false},
      {"surface?weld=0.5", "surface?weld=0.25", false},
      {"surface", "surface?creases=none", false},
      {"surface?creases=auto", "surface?creases=normals", false},
      {"surface?creases=angle:30", "surface?creases=angle:31", false},
      {"surface?creases=auto", "surface?creases=auto&crease_sharpness=2", false},
      {"surface", "surface?normals=none", false}};
  for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
    reply a = model_get_ok(f->loop, f->tank, pairs[i].one),
          b = model_get_ok(f->loop, f->tank, pairs[i].other);
    bool is_same = strcmp(reply_header(&a, "ETag"), reply_header(&b, "ETag")) == 0;
    if (is_same != pairs[i].is_same) fail_msg("%s, %s", pairs[i].one, pairs[i].other);
    if (is_same) {
      assert_int_equal(a.size, b.size);
      assert_memory_equal(a.body, b.body, a.size);
    }
    char header[128];
    snprintf(header, sizeof header, "If-None-Match: %s\n", reply_header(&a, "ETag"));
    reply c = model_ask(f->loop, "GET", f->tank, pairs[i].one, header);
    assert_int_equal(c.status, 304);
    assert_int_equal(c.size, 0);
    reply_free(&a);
    reply_free(&b);
    reply_free(&c);
  }
}

TEST_WITH(asking_for_what_tags_say_is_not_asking, setup, fixture_stop) {
  fixture *f = *state;
  static const char *const queries[] = {"surface.glb", "surface.glb?boundary=edge-only",
                                        "surface.glb?boundary=none"};
  char id[API_ID_TEXT];
  loopback_upload(f->loop, "model/obj",
                  "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nf 1 2 3 4\nf 2 5 6 3\n"
                  "t interpolateboundary 1/0/0 2\n",
                  id);
  reply replies[3];
  for (int i = 0; i < 3; i++) replies[i] = model_get_ok(f->loop, id, queries[i]);
  assert_string_equal(reply_header(&replies[0], "ETag"), reply_header(&replies[1], "ETag"));
  assert_string_not_equal(reply_header(&replies[0], "ETag"), reply_header(&replies[2], "ETag"));
  for (int i = 0; i < 3; i++) reply_free(&replies[i]);
}
