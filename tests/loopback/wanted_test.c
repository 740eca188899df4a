/* Long answers ask all the time whether they are still wanted, also while they are printed, and end where
 * they are not. */
#include "loopback.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct asking {
  uint32_t count, most; /* questions so far; behind `most` of them the answer is not wanted */
} asking;

static bool is_cancelled(void *owner) {
  asking *a = owner;
  return ++a->count > a->most;
}

enum { NODES = 40000, TRACKS = 8000 };

/* Names are of quotes, each of which is escaped. */
static char *make_document(void) {
  const uint32_t nodes = NODES / test_stride(), tracks = TRACKS / test_stride();
  char name[201], *text = malloc((size_t)nodes * (2 * sizeof name + 40) + (size_t)tracks * 300), *end = text;
  for (size_t i = 0; i < sizeof name - 1; i++) name[i] = i % 2 ? '"' : '\\';
  name[sizeof name - 1] = '\0';
  end += sprintf(end, "{\"nodes\":[");
  for (uint32_t i = 0; i < nodes; i++) end += sprintf(end, "%s{\"name\":\"%u%s\"}", i ? "," : "", i, name);
  end += sprintf(end, "],\"clips\":[{\"name\":\"c\",\"tracks\":[");
  for (uint32_t i = 0; i < tracks; i++)
    end += sprintf(end,
                   "%s{\"node\":\"%u%s\",\"path\":\"rotation\",\"interpolation\":\"euler\",\"times\":[0,1],"
                   "\"eulers\":[[0,0,0],[1,2,3]]}",
                   i ? "," : "", i, name);
  strcpy(end, "]}]}");
  return text;
}

/* Asks until the answer is wanted long enough, for twice as many questions each time. Returns the answer's
 * size. */
static size_t ask_longer(loopback *loop, const char *target, asking *a) {
  for (uint32_t most = 1;; most *= 2) {
    *a = (asking){.most = most};
    reply r = loopback_get(loop, target);
    bool is_whole = a->count <= most;
    size_t size = r.size;
    assert_int_equal(r.status, is_whole ? 200 : 503);
    if (!is_whole) assert_says(&r, "not wanted any more");
    reply_free(&r);
    if (is_whole) return size;
  }
}

TEST(long_answers_ask_all_the_time_whether_they_are_wanted) {
  static const char *const tails[] = {"", "/tracks", "/surface.glb"};
  enum { PIECE = 1 << 19 }; /* bytes, for each of which there is a question, in a millisecond or two */
  asking a = {.most = UINT32_MAX};
  api_settings settings = loopback_settings();
  settings.limits.max_upload = 128 << 20;
  settings.limits.max_output = 1 << 30;
  settings.limits.max_memory = (uint64_t)2 << 30;
  settings.limits.plan_cache = (uint64_t)1 << 30; /* the model is read once */
  settings.parallel = (api_parallel_for){.owner = &a, .is_cancelled = is_cancelled};
  char id[API_ID_TEXT], target[128], *text = make_document();
  loopback *loop = loopback_start(&settings);
  loopback_upload(loop, "application/json", text, id);
  for (size_t i = 0; i < sizeof tails / sizeof *tails; i++) {
    snprintf(target, sizeof target, "/v1/models/%s%s", id, tails[i]);
    size_t size = ask_longer(loop, target, &a);
    if (a.count < size / PIECE) print_error("%s: %zu bytes, %u questions\n", tails[i], size, a.count);
    assert_true(a.count >= size / PIECE);
  }
  loopback_stop(loop);
  free(text);
}
