/* A model whose stored bytes are damaged. */
#include "stored_models.h"

#include <stdio.h>
#include <string.h>

static const char *const tails[] = {"",
                                    "/source",
                                    "/surface.obj?level=1",
                                    "/surface.json?level=3",
                                    "/pose.json?at=0.5",
                                    "/tracks",
                                    "/live?fps=10&loop=clamp"};

/* Asks for all that there is of a model, each afresh. */
static void assert_all_damaged(loopback *loop, const char *id) {
  for (size_t i = 0; i < sizeof tails / sizeof *tails; i++) {
    char path[128];
    snprintf(path, sizeof path, "/v1/models/%s%s", id, tails[i]);
    assert_problem(loopback_get(loop, path), 500, NULL, "the stored bytes are damaged; upload them again");
  }
}

TEST_WITH(a_damaged_model_is_500_until_it_is_uploaded_again, loopback_setup, loopback_teardown) {
  loopback *loop = *state;
  char id[API_ID_TEXT], path[128];
  loopback_upload(loop, "application/json", turning, id);
  loopback_store_damage(loop, id);
  snprintf(path, sizeof path, "/v1/models/%s/source", id);
  /* The model is in the cache: the first to read the store says so for all. */
  assert_problem(loopback_get(loop, path), 500, NULL, "damaged");
  assert_all_damaged(loop, id);
  reply r = loopback_post(loop, "/v1/models", "application/json", turning);
  assert_int_equal(r.status, 201);
  reply_free(&r);
  for (size_t i = 0; i < sizeof tails / sizeof *tails; i++) {
    snprintf(path, sizeof path, "/v1/models/%s%s", id, tails[i]);
    if (strstr(path, "/live")) continue; /* its frames are for live_poses_test */
    r = loopback_get(loop, path);
    assert_int_equal(r.status, 200);
    reply_free(&r);
  }
}

TEST_WITH(a_description_is_not_told_of_a_damaged_model, loopback_setup, loopback_teardown) {
  loopback *loop = *state;
  char id[API_ID_TEXT], path[64];
  loopback_upload(loop, "application/json", turning, id); /* which leaves the model in the cache */
  loopback_store_damage(loop, id);
  snprintf(path, sizeof path, "/v1/models/%s", id);
  assert_problem(loopback_get(loop, path), 500, NULL, "damaged");
}

TEST_WITH(what_is_cached_of_a_damaged_model_is_not_answered, loopback_setup, loopback_teardown) {
  loopback *loop = *state;
  char id[API_ID_TEXT], path[96];
  loopback_upload(loop, "model/obj", triangle, id);
  snprintf(path, sizeof path, "/v1/models/%s/surface.glb", id);
  reply r = loopback_get(loop, path);
  assert_int_equal(r.status, 200);
  reply_free(&r);
  assert_true(loopback_is_light(loop, path));
  loopback_store_damage(loop, id);
  assert_problem(loopback_get(loop, path), 500, NULL, "damaged");
  r = loopback_post(loop, "/v1/models", "model/obj", triangle);
  assert_int_equal(r.status, 201);
  reply_free(&r);
  r = loopback_get(loop, path);
  assert_int_equal(r.status, 200);
  reply_free(&r);
}
