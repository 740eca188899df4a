/* Equal and unequal questions of several threads at once. */
#include "loopback.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct asker {
  loopback *loop;
  char target[128];
  reply reply;
} asker;

static void *ask(void *context) {
  asker *a = context;
  a->reply = loopback_get(a->loop, a->target);
  return NULL;
}

TEST(equal_questions_at_once_have_equal_answers) {
  enum { ASKERS = 8 };
  asker askers[ASKERS];
  pthread_t threads[ASKERS];
  api_settings settings = loopback_settings();
  loopback *loop = loopback_start(&settings);
  char id[API_ID_TEXT];
  loopback_upload_sample(loop, "application/json", "tank.json", id);
  for (int i = 0; i < ASKERS; i++) {
    askers[i].loop = loop;
    snprintf(askers[i].target, sizeof askers[i].target, "/v1/models/%s/surface.glb?level=3%s", id,
             i % 2 ? "&clip=drive&at=1" : "");
    assert_int_equal(pthread_create(&threads[i], NULL, ask, &askers[i]), 0);
  }
  for (int i = 0; i < ASKERS; i++) pthread_join(threads[i], NULL);
  for (int i = 0; i < ASKERS; i++) {
    const reply *r = &askers[i].reply, *equal = &askers[i % 2].reply;
    assert_int_equal(r->status, 200);
    assert_int_equal(r->size, equal->size);
    assert_memory_equal(r->body, equal->body, equal->size);
  }
  for (int i = 0; i < ASKERS; i++) reply_free(&askers[i].reply);
  loopback_stop(loop);
}
