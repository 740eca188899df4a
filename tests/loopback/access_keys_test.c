/* How a key is sent, and what is answered without one. */
#include "stored_models.h"

static int start_with_keys(void **state) {
  static const api_key keys[] = {{"alpha", ALL_RIGHTS, {0}}, {"beta", ALL_RIGHTS, {0}}};
  api_settings settings = loopback_settings();
  settings.keyring = (api_keyring){.keys = keys, .count = 2};
  *state = loopback_start(&settings);
  return 0;
}

TEST_WITH(models_ask_for_a_key_where_keys_are_configured, start_with_keys, loopback_teardown) {
  reply r = loopback_get(*state, "/v1/models");
  assert_true(r.refused);
  assert_string_equal(reply_header(&r, "WWW-Authenticate"), "Bearer realm=\"tweend\"");
  assert_problem(r, 401, NULL, NULL);
  const char *const wrong[] = {"X-API-Key: alph\n", "X-API-Key: alphaa\n", "X-API-Key: \n",
                               "Authorization: Bearer gamma\n"};
  for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
    assert_problem(get_with(*state, "/v1/models", wrong[i]), 403, NULL, NULL);
  assert_problem(get_with(*state, "/v1/models", "Authorization: Basic YWxwaGE=\n"), 401, NULL, NULL);
  const char *const right[] = {"X-API-Key: alpha\n", "Authorization: bearer beta\n", "X-API-Key: beta\n"};
  for (size_t i = 0; i < sizeof right / sizeof *right; i++) {
    r = get_with(*state, "/v1/models", right[i]);
    assert_int_equal(r.status, 200);
    reply_free(&r);
  }
  r = loopback_ask(*state, "OPTIONS", "/v1/models", NULL, NULL, 0);
  assert_int_equal(r.status, 204);
  reply_free(&r);
}

TEST_WITH(operations_are_open_without_a_key, start_with_keys, loopback_teardown) {
  reply r = loopback_get(*state, "/healthz");
  assert_int_equal(r.status, 200);
  reply_free(&r);
}
