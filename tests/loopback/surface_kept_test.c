/* What is built of a surface is kept for the next request. */
#include "cube_and_tank.h"

#include <stdio.h>

TEST_WITH(what_is_built_is_answered_lightly, setup, fixture_stop) {
  fixture *f = *state;
  char target[96];
  snprintf(target, sizeof target, "/v1/models/%s/surface.glb?level=3", f->cube);
  assert_false(loopback_is_light(f->loop, target));
  reply r = loopback_get(f->loop, target);
  reply_free(&r);
  assert_true(loopback_is_light(f->loop, target));
  r = model_ask(f->loop, "DELETE", f->cube, "", NULL);
  reply_free(&r);
  assert_problem(loopback_get(f->loop, target), 404, NULL, NULL);
}

static void count_parts(void *owner, uint32_t count, void (*part)(void *context, uint32_t index),
                        void *context) {
  *(uint32_t *)owner += count;
  for (uint32_t i = 0; i < count; i++) part(context, i);
}

TEST(bounds_are_shared_out_once) {
  uint32_t parts = 0;
  api_settings settings = loopback_settings();
  settings.parallel = (api_parallel_for){.owner = &parts, .run = count_parts};
  loopback *loop = loopback_start(&settings);
  char id[API_ID_TEXT], target[96];
  loopback_upload_sample(loop, "model/obj", "cube.obj", id);
  snprintf(target, sizeof target, "/v1/models/%s/surface.glb?level=7", id);
  for (int i = 0; i < 2; i++) {
    parts = 0;
    reply r = loopback_get(loop, target);
    assert_int_equal(r.status, 200);
    assert_true((parts > 1) == (i == 0));
    reply_free(&r);
  }
  loopback_stop(loop);
}
