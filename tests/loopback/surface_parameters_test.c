/* Parameters of surfaces: which are refused, and what those of creases, borders and welding do. */
#include "cube_and_tank.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

TEST_WITH(bad_parameters_are_400, setup, fixture_stop) {
  fixture *f = *state;
  const char *const bad[] = {"level=x",
                             "level=-1",
                             "level=1.5",
                             "level=",
                             "level=1&level=1",
                             "level=%31%",
                             "scheme=doo-sabin",
                             "boundary=",
                             "uv=smooth",
                             "creasing=x",
                             "triangles=x",
                             "quads=yes",
                             "limit=1",
                             "normals=flat",
                             "skin=no",
                             "encoding=x",
                             "polygons=quads",
                             "levl=1",
                             "at=x&clip=drive",
                             "from=0",
                             "at=1&fps=2",
                             "fps=0&clip=drive",
                             "level=1e1",
                             "level=+1",
                             "limit=TRUE",
                             "creases=x",
                             "creases=angle",
                             "creases=angle:",
                             "creases=angle:x",
                             "creases=angle:-1",
                             "creases=angle:181",
                             "weld=x",
                             "weld=0",
                             "weld=-1",
                             "weld=1e19",
                             "weld=",
                             "crease_sharpness=x",
                             "crease_sharpness=-1",
                             "crease_sharpness=10.5"};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    char rest[128];
    snprintf(rest, sizeof rest, "surface.glb?%s", bad[i]);
    reply r = model_get(f->loop, f->tank, rest);
    if (r.status != 400) fail_msg("%s: %d %s", bad[i], r.status, r.body);
    assert_problem(r, 400, NULL, NULL);
  }
  assert_problem(model_get(f->loop, f->cube, "surface.glb?levl=1"), 400, NULL, "creasing");
}

TEST_WITH(what_this_version_lacks_is_422, setup, fixture_stop) {
  fixture *f = *state;
  assert_problem(model_get(f->loop, f->cube, "surface.obj?scheme=loop"), 422, NULL, "triangles");
}

TEST_WITH(names_that_are_not_there_are_404, setup, fixture_stop) {
  fixture *f = *state;
  assert_problem(model_get(f->loop, f->tank, "surface?clip=dance"), 404, NULL, "drive");
  assert_problem(model_get(f->loop, f->cube, "surface?clip=drive"), 404, NULL, "no clips");
  assert_problem(model_get(f->loop, f->cube, "surface?at=1"), 404, NULL, "no clips");
  assert_problem(model_get(f->loop, f->cube, "surface.fbx"), 404, NULL, NULL);
  assert_problem(model_get(f->loop, "00000000000000000000000000000000", "surface"), 404, NULL, NULL);
}

/* The greatest coordinate of an answer's points. */
static double reach(const fixture *f, const char *rest) {
  reply r = model_get_ok(f->loop, f->cube, rest);
  double greatest = 0;
  for (const char *line = r.body; line; line = strchr(line, '\n')) {
    double p[3];
    if (*line == '\n') line++;
    if (sscanf(line, "v %lf %lf %lf", &p[0], &p[1], &p[2]) != 3) continue;
    for (int i = 0; i < 3; i++) greatest = fmax(greatest, fabs(p[i]));
  }
  reply_free(&r);
  return greatest;
}

TEST_WITH(creases_hold_the_corners_of_a_cube, setup, fixture_stop) {
  fixture *f = *state;
  double smooth = reach(f, "surface.obj?level=3");
  assert_true(smooth < 0.85);
  assert_true(reach(f, "surface.obj?level=3&creases=none") == smooth);
  assert_true(reach(f, "surface.obj?level=3&creases=normals") == smooth); /* the file has none */
  assert_true(reach(f, "surface.obj?level=3&creases=auto") == 1);
  assert_true(reach(f, "surface.obj?level=3&creases=angle:89") == 1);
  assert_true(reach(f, "surface.obj?level=3&creases=angle:91") == smooth);
  double soft = reach(f, "surface.obj?level=3&creases=angle:30&crease_sharpness=0.5");
  assert_true(soft > smooth && soft < 1);
}

/* Two squares that are cut apart, and a third one a hand's breadth away. */
TEST_WITH(welding_joins_what_it_is_told_to, setup, fixture_stop) {
  static const char obj[] =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 2.1 0 0\n"
      "v 3 0 0\nv 3 1 0\nv 2.1 1 0\nv 0 0 0\nv -1 0 0\nv 0 -1 0\nf 1 2 3 4\nf 5 6 7 8\n"
      "f 9 10 11 12\nf 13 14 15\n"; /* the triangle touches in a point */
  static const struct {
    const char *weld;
    int vertices;
  } cases[] = {{"", 13}, {"&weld=auto", 13}, {"&weld=exact", 12}, {"&weld=0.2", 10}, {"&weld=none", 15}};
  fixture *f = *state;
  char id[API_ID_TEXT];
  loopback_upload(f->loop, "model/obj", obj, id);
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char rest[64];
    snprintf(rest, sizeof rest, "surface.json?level=0%s", cases[i].weld);
    cJSON *counts = model_get_json(f->loop, id, rest);
    assert_int_equal(json_member(counts, "vertices")->valueint, cases[i].vertices);
    cJSON_Delete(counts);
  }
}

/* The same squares, each point with a texture coordinate of its own: points become one, these do not. */
TEST_WITH(welding_leaves_texture_coordinates_of_points, setup, fixture_stop) {
  static const char model[] =
      "{'meshes':[{'positions':[[0,0,0],[1,0,0],[1,1,0],[0,1,0],[1,0,0],[2,0,0],[2,1,0],[1,1,0]],"
      "'faces':[[0,1,2,3],[4,5,6,7]],'uvs':[[0,0],[0.5,0],[0.5,1],[0,1],[0.6,0],[1,0],[1,1],[0.6,1]]}]}";
  fixture *f = *state;
  char id[API_ID_TEXT];
  loopback_upload(f->loop, "application/json", model, id);
  reply r = model_get_ok(f->loop, id, "surface.obj?level=0&weld=exact&normals=none");
  assert_says(&r, "\nf 1/1 2/2 3/4 4/6\nf 2/3 5/7 6/8 3/5\n");
  reply_free(&r);
}

TEST_WITH(a_tag_counts_until_the_query_says_otherwise, setup, fixture_stop) {
  fixture *f = *state;
  char id[API_ID_TEXT];
  loopback_upload(f->loop, "model/obj",
                  "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nt interpolateboundary 1/0/0 2\n", id);
  reply tagged = model_get_ok(f->loop, id, "surface.obj?level=1");
  reply same = model_get_ok(f->loop, id, "surface.obj?level=1&boundary=edge-only");
  reply other = model_get_ok(f->loop, id, "surface.obj?level=1&boundary=edge-and-corner");
  assert_string_equal(tagged.body, same.body);
  assert_string_not_equal(tagged.body, other.body);
  assert_says(&other, "v 0 0 0\n");
  reply_free(&tagged);
  reply_free(&same);
  reply_free(&other);
}
