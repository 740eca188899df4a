/* A clip in a surface: the scene posed at one time, or an animation. */
#include "cube_and_tank.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* The JSON chunk of a GLB. */
static cJSON *glb_json(const reply *r) {
  assert_true(r->size > 20);
  assert_memory_equal(r->body, "glTF", 4);
  const unsigned char *b = (const unsigned char *)r->body + 12;
  size_t length = b[0] | (size_t)b[1] << 8 | (size_t)b[2] << 16 | (size_t)b[3] << 24;
  cJSON *tree = cJSON_ParseWithLength(r->body + 20, length);
  assert_non_null(tree);
  return tree;
}

static const cJSON *find_named(const cJSON *array, const char *name) {
  const cJSON *item;
  cJSON_ArrayForEach(item, array) {
    const char *found = cJSON_GetStringValue(cJSON_GetObjectItem(item, "name"));
    if (found && strcmp(found, name) == 0) return item;
  }
  fail_msg("nothing is called %s", name);
  return NULL;
}

TEST_WITH(one_time_poses_the_nodes, setup, fixture_stop) {
  fixture *f = *state;
  cJSON *poses = model_get_json(f->loop, f->tank, "pose?clip=drive&at=1.7&nodes=turret");
  reply r = model_get_ok(f->loop, f->tank, "surface.glb?clip=drive&at=1.7&level=0");
  cJSON *scene = glb_json(&r);
  assert_null(cJSON_GetObjectItem(scene, "animations"));
  const cJSON *turret = find_named(json_member(scene, "nodes"), "turret");
  const cJSON *expected = json_member(json_member(poses, "poses")->child, "rotation")->child;
  for (int i = 0; i < 4; i++)
    assert_true(fabs(cJSON_GetArrayItem(json_member(turret, "rotation"), i)->valuedouble -
                     cJSON_GetArrayItem(expected, i)->valuedouble) < 1e-6);
  cJSON_Delete(scene);
  cJSON_Delete(poses);
  reply_free(&r);
}

TEST_WITH(a_clip_alone_is_kept_as_animation, setup, fixture_stop) {
  fixture *f = *state;
  reply r = model_get_ok(f->loop, f->tank, "surface.glb?clip=aim&level=0");
  cJSON *scene = glb_json(&r);
  const cJSON *animation = json_member(scene, "animations")->child;
  assert_string_equal(json_member(animation, "name")->valuestring, "aim");
  assert_null(animation->next);
  cJSON_Delete(scene);
  reply_free(&r);
}

TEST_WITH(several_times_are_the_keys_of_the_animation, setup, fixture_stop) {
  fixture *f = *state;
  const char *const queries[] = {"clip=aim&at=0,0.5,2", "clip=aim&from=0&to=1&fps=2"};
  for (int i = 0; i < 2; i++) {
    char rest[96];
    snprintf(rest, sizeof rest, "surface.glb?level=0&%s", queries[i]);
    reply r = model_get_ok(f->loop, f->tank, rest);
    cJSON *scene = glb_json(&r);
    const cJSON *animation = json_member(scene, "animations")->child;
    assert_string_equal(json_member(animation, "name")->valuestring, "aim");
    int input = json_member(json_member(animation, "samplers")->child, "input")->valueint;
    const cJSON *accessor = cJSON_GetArrayItem(json_member(scene, "accessors"), input);
    assert_int_equal(json_member(accessor, "count")->valueint, 3);
    cJSON_Delete(scene);
    reply_free(&r);
  }
  assert_problem(model_get(f->loop, f->tank, "surface.glb?clip=aim&at=1,0"), 422, NULL, NULL);
}

TEST_WITH(a_borrowed_clip_animates_what_it_can, setup, fixture_stop) {
  fixture *f = *state;
  char rest[128];
  snprintf(rest, sizeof rest, "surface.glb?clip=%s/aim&level=0", f->tank);
  reply r = model_get_ok(f->loop, f->cube, rest);
  assert_non_null(reply_header(&r, "X-Tweend-Warning"));
  reply_free(&r);
}
