/* Linked with srv_each_file wrapped. */
#include "disk.h"
#include "store_fixture.h"

#include <stdio.h>
#include <string.h>

typedef bool take_file(void *context, const char *name, const struct stat *facts);

static void (*after_walk)(void); /* called once, after the next walk over a folder; NULL: nothing is */

/* The linker's --wrap gives these names.
 * NOLINTBEGIN(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */
bool __real_srv_each_file(const char *folder, take_file *take, void *context);
bool __wrap_srv_each_file(const char *folder, take_file *take, void *context);

bool __wrap_srv_each_file(const char *folder, take_file *take, void *context) {
  bool is_whole = __real_srv_each_file(folder, take, context);
  void (*then)(void) = after_walk;
  after_walk = NULL;
  if (then != NULL) then();
  return is_whole;
}
/* NOLINTEND(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */

#ifdef TWEEND_S3
#include "disk_cache.h"

enum { SIZE = 100000, LIMIT = 10 * SIZE };

static srv_disk_cache *cache;
static unsigned number;

/* Keeps a copy of a model of its own. */
static void put_another(void) {
  static char text[SIZE];
  char id[API_ID_TEXT];
  memset(text, 'x', SIZE);
  text[snprintf(text, 16, "%u", number++)] = ' ';
  make_id(text, SIZE, id);
  srv_disk_cache_put(cache, id, (api_bytes){(const uint8_t *)text, SIZE}, "{}");
}

static bool add_size(void *context, const char *name, const struct stat *facts) {
  (void)name;
  *(uint64_t *)context += (uint64_t)facts->st_size;
  return true;
}

static uint64_t bytes_in(const fixture *f) {
  char objects[96];
  uint64_t bytes = 0;
  snprintf(objects, sizeof objects, "%s/objects", f->path);
  srv_each_file(objects, add_size, &bytes);
  return bytes;
}

TEST_WITH(copies_made_while_others_are_counted_count, set_up_store, tear_down_store) {
  fixture *f = *state;
  cache = srv_disk_cache_create(f->opened, f->path, LIMIT);
  assert_non_null(cache);
  after_walk = put_another;
  while (after_walk != NULL) put_another(); /* until they are over the limit and counted */
  uint64_t there = bytes_in(f);
  assert_in_range(there, LIMIT - 2 * SIZE, LIMIT);
  assert_in_range(srv_disk_cache_look(cache).bytes, there, LIMIT + 2 * SIZE);
  srv_disk_cache_destroy(cache);
}
#endif
