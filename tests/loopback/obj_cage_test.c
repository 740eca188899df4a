/* A cage as OBJ, with its tags, comes back as it was. */
#include "cube_and_tank.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char tagged_scene[] =
    "{'meshes': [{'name': 'box', 'positions': [[9,9,9], [-1,-1,-1], [1,-1,-1], [1,1,-1], [-1,1,-1], [-1,-1,"
    "1], [1,-1,1], [1,1,1], [-1,1,1]], 'faces': [[1,4,3,2], [5,6,7,8], [1,2,6,5], [2,3,7,6], [3,4,8,7], [4,"
    "1,5,8]], 'creases': [{'edge': [1,2], 'sharpness': 2.5}, {'edge': [6,5], 'sharpness': 10}],"
    " 'corners': [{'vertex': 7, 'sharpness': 1.25}]},{'name': 'sheet', 'positions': [[5,0,0], [6,0,0], [7,"
    "0,0], [5,1,0], [6,1,0.5], [7,1,0], [5,2,0], [6,2,1], [7,2,0]], 'faces': [[0,1,4,3], [1,2,5,4], [3,4,7,"
    "6], [4,5,8,7]], 'creases': [{'edge': [4,1], 'sharpness': 1.5}]}],"
    "'nodes': [{'mesh': 'sheet', 'translation': [-5,0,2]}, {'mesh': 'box', 'rotation': [0.5,0.5,0.5,0.5]},"
    " {'mesh': 'box', 'translation': [0,2,0], 'scale': [1,1,-1]}]}";

/* The next line of a text that begins so, from its line feed on. (A sanitizer measures the rest of the text
 * at each strstr.) */
static const char *find_line(const char *at, const char *begin) {
  while ((at = strchr(at, '\n')) && strncmp(at + 1, begin, strlen(begin)) != 0) at++;
  return at;
}

/* The points of an OBJ; freed by the caller. */
static size_t obj_points(const char *text, double (**out)[3]) {
  size_t count = 0;
  *out = malloc((strlen(text) / 8 + 1) * sizeof **out);
  assert_non_null(*out);
  for (const char *line = text; (line = find_line(line, "v ")); line++) {
    char *at = (char *)(uintptr_t)line + 2;
    for (int c = 0; c < 3; c++) (*out)[count][c] = strtod(at, &at);
    count++;
  }
  return count;
}

static size_t count_lines(const char *text, const char *begin) {
  size_t count = 0;
  for (const char *line = text; (line = find_line(line, begin)); line++) count++;
  return count;
}

static int compare_x(const void *left, const void *right) {
  const double *a = left, *b = right;
  return (a[0] > b[0]) - (a[0] < b[0]);
}

/* Each point has one of the other text where it is, within 1e-6 of the model's size: nodes round points.
 * Several meshes come back as one: their order may differ.
 */
static void assert_same_points(const char *left, const char *right) {
  double(*a)[3], (*b)[3];
  size_t count = obj_points(left, &a);
  assert_int_equal(count, obj_points(right, &b));
  const double rounding = 2e-6;
  qsort(a, count, sizeof *a, compare_x);
  qsort(b, count, sizeof *b, compare_x);
  for (size_t i = 0, first = 0; i < count; i++) {
    bool found = false;
    while (first < count && b[first][0] < a[i][0] - rounding) first++;
    for (size_t k = first; !found && k < count && b[k][0] <= a[i][0] + rounding; k++)
      found = fabs(a[i][1] - b[k][1]) <= rounding && fabs(a[i][2] - b[k][2]) <= rounding;
    if (!found) fail_msg("no point is at %g %g %g", a[i][0], a[i][1], a[i][2]);
  }
  free(a);
  free(b);
}

/* The cage under a query, uploaded again, has the surface that the query gives the model. */
static void assert_comes_back(const fixture *f, const char *id, const char *query) {
  static const char *const levels[] = {"level=1", "level=2", "level=2&limit=true"};
  char target[256], again[API_ID_TEXT];
  snprintf(target, sizeof target, "surface.obj?level=0&normals=none%s", query);
  reply cage = model_get_ok(f->loop, id, target);
  loopback_upload(f->loop, "model/obj", cage.body, again);
  reply_free(&cage);
  for (size_t i = 0; i < sizeof levels / sizeof *levels; i++) {
    snprintf(target, sizeof target, "surface.obj?%s&normals=none%s", levels[i], query);
    reply wanted = model_get_ok(f->loop, id, target);
    snprintf(target, sizeof target, "surface.obj?%s&normals=none", levels[i]);
    reply got = model_get_ok(f->loop, again, target);
    assert_int_equal(count_lines(wanted.body, "f "), count_lines(got.body, "f "));
    assert_same_points(wanted.body, got.body);
    reply_free(&wanted);
    reply_free(&got);
  }
}

TEST_WITH(a_cage_with_tags_comes_back_as_obj, setup, fixture_stop) {
  const fixture *f = *state;
  char id[API_ID_TEXT];
  loopback_upload(f->loop, "application/json", tagged_scene, id);
  assert_comes_back(f, id, "");
  assert_comes_back(f, id, "&boundary=edge-only");
  assert_comes_back(f, id, "&boundary=none");
  assert_comes_back(f, id, "&creasing=chaikin");
  assert_comes_back(f, id, "&creases=none");
  assert_comes_back(f, id, "&creases=angle:20&crease_sharpness=1.5");
  assert_comes_back(f, f->cube, "&creases=auto");
  assert_comes_back(f, f->tank, "");
}

TEST_WITH(a_smooth_triangle_comes_back, setup, fixture_stop) {
  const fixture *f = *state;
  char id[API_ID_TEXT];
  loopback_upload(f->loop, "model/obj",
                  "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n", id);
  assert_comes_back(f, id, "&triangles=smooth");
}

TEST_WITH(tags_are_of_level_0_alone_and_of_what_is_tagged, setup, fixture_stop) {
  const fixture *f = *state;
  static const struct {
    const char *query;
    size_t creases;
  } cases[] = {{"level=0", 0},
               {"level=0&creases=auto", 12},
               {"level=0&creases=angle:100", 0},
               {"level=1&creases=auto", 0},
               {"level=0&limit=true&creases=auto", 0}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char target[128];
    snprintf(target, sizeof target, "surface.obj?%s", cases[i].query);
    reply r = model_get_ok(f->loop, f->cube, target);
    assert_int_equal(count_lines(r.body, "t "), cases[i].creases);
    assert_int_equal(count_lines(r.body, "t crease 2/1/0 "), cases[i].creases);
    reply_free(&r);
  }
}
