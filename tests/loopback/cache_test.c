/* The cache: one build a key, references, the budget, forgetting, failures; many threads. */
#include "loopback.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cache.h"

/* What the builds of a test did. */
typedef struct workshop {
  atomic_int built, destroyed;
  int size;
  bool fails;
} workshop;

typedef struct piece {
  workshop *shop;
  int number;
} piece;

static void destroy_piece(void *value) {
  piece *p = value;
  p->shop->destroyed++;
  free(p);
}

static bool build_piece(void *context, api_built *out, api_fault *fault) {
  workshop *shop = context;
  int number = shop->built++;
  if (shop->fails) {
    api_fault_with(fault, 404, "there is none");
    return false;
  }
  piece *p = malloc(sizeof *p);
  *p = (piece){shop, number};
  *out = (api_built){p, (size_t)shop->size, destroy_piece};
  return true;
}

static api_entry *take(api_cache *cache, const char *key, workshop *shop) {
  api_fault fault;
  return api_cache_take(cache, key, build_piece, shop, &fault);
}

static void a_key_is_built_once(void **state) {
  (void)state;
  workshop shop = {.size = 100};
  api_cache *cache = api_cache_create(10000);
  assert_null(api_cache_peek(cache, "a"));
  api_entry *first = take(cache, "a", &shop);
  api_entry *second = take(cache, "a", &shop);
  assert_ptr_equal(first, second);
  assert_int_equal(shop.built, 1);
  api_entry_release(first);
  api_entry_release(second);
  api_entry *third = api_cache_peek(cache, "a");
  assert_ptr_equal(third, first);
  api_entry_release(third);
  api_cache_destroy(cache);
  assert_int_equal(shop.destroyed, 1);
}

static void the_least_recently_used_goes_first(void **state) {
  (void)state;
  workshop shop = {.size = 100000};
  /* Room for three of them and half of a fourth, with what an entry itself takes. */
  api_cache *cache = api_cache_create(UINT64_MAX);
  api_entry_release(take(cache, "a", &shop));
  uint64_t budget = api_cache_size(cache) * 7 / 2;
  api_cache_destroy(cache);
  cache = api_cache_create(budget);
  api_entry_release(take(cache, "a", &shop));
  api_entry_release(take(cache, "b", &shop));
  api_entry_release(take(cache, "c", &shop));
  api_entry_release(api_cache_peek(cache, "a"));
  api_entry_release(take(cache, "d", &shop));
  assert_null(api_cache_peek(cache, "b"));
  api_entry *kept = api_cache_peek(cache, "a");
  assert_non_null(kept);
  api_entry_release(kept);
  api_cache_destroy(cache);
}

static void what_is_held_stays_over_the_budget_and_goes_when_released(void **state) {
  (void)state;
  workshop shop = {.size = 100000};
  api_cache *cache = api_cache_create(1000);
  api_entry *held = take(cache, "a", &shop);
  assert_int_equal(((piece *)api_entry_value(held))->number, 0);
  assert_int_equal(shop.destroyed, 0);
  api_entry_release(held);
  assert_int_equal(shop.destroyed, 1);
  assert_int_equal(api_cache_size(cache), 0);
  api_cache_destroy(cache);
}

static void a_failure_is_told_and_not_remembered(void **state) {
  (void)state;
  workshop shop = {.size = 1, .fails = true};
  api_cache *cache = api_cache_create(10000);
  api_fault fault;
  assert_null(api_cache_take(cache, "a", build_piece, &shop, &fault));
  assert_int_equal(fault.status, 404);
  shop.fails = false;
  api_entry *entry = take(cache, "a", &shop);
  assert_non_null(entry);
  assert_int_equal(shop.built, 2);
  api_entry_release(entry);
  api_cache_destroy(cache);
}

static void forgotten_keys_are_built_anew_and_holders_keep_theirs(void **state) {
  (void)state;
  workshop shop = {.size = 1};
  api_cache *cache = api_cache_create(10000);
  api_entry *held = take(cache, "x/model", &shop);
  api_entry_release(take(cache, "x/plan", &shop));
  api_entry_release(take(cache, "y/clip/x", &shop));
  api_entry_release(take(cache, "z/model", &shop));
  api_cache_forget(cache, "x");
  assert_int_equal(shop.destroyed, 2);
  assert_null(api_cache_peek(cache, "x/model"));
  assert_int_equal(((piece *)api_entry_value(held))->number, 0);
  api_entry *fresh = take(cache, "x/model", &shop);
  assert_int_equal(((piece *)api_entry_value(fresh))->number, 4);
  api_entry_release(held);
  assert_int_equal(shop.destroyed, 3);
  api_entry_release(fresh);
  api_cache_destroy(cache);
  assert_int_equal(shop.destroyed, shop.built);
}

static api_cache_key hashed(const char *text) {
  return (api_cache_key){text, api_cache_hash(text, strlen(text))};
}

static void several_keys_are_looked_up_all_or_none(void **state) {
  (void)state;
  workshop shop = {.size = 100000};
  api_cache *cache = api_cache_create(250000); /* for two */
  const api_cache_key keys[] = {hashed("a"), hashed("b"), hashed("c")};
  api_entry *found[3];
  api_entry_release(take(cache, "a", &shop));
  api_entry_release(take(cache, "b", &shop));
  assert_false(api_cache_peek_all(cache, keys, 3, found));
  assert_true(api_cache_peek_all(cache, keys, 2, found));
  assert_int_equal(((piece *)api_entry_value(found[0]))->number, 0);
  assert_int_equal(((piece *)api_entry_value(found[1]))->number, 1);
  /* Those that are held stay, until they are released. */
  api_entry_release(take(cache, "c", &shop));
  assert_true(api_cache_size(cache) < 250000);
  assert_int_equal(shop.destroyed, 1);
  api_cache_forget(cache, "a");
  assert_int_equal(shop.destroyed, 1);
  for (int i = 0; i < 2; i++) api_entry_release(found[i]);
  assert_int_equal(shop.destroyed, 2);
  assert_false(api_cache_peek_all(cache, keys, 1, found));
  assert_true(api_cache_peek_all(cache, keys + 1, 1, found));
  api_entry_release(found[0]);
  api_cache_destroy(cache);
  assert_int_equal(shop.destroyed, shop.built);
}

static void keys_that_are_looked_up_together_are_used_together(void **state) {
  (void)state;
  workshop shop = {.size = 100000};
  api_cache *cache = api_cache_create(350000); /* for three */
  const api_cache_key keys[] = {hashed("b"), hashed("a")};
  api_entry *found[2];
  for (const char *const *key = (const char *const[]){"a", "b", "c", NULL}; *key; key++)
    api_entry_release(take(cache, *key, &shop));
  assert_true(api_cache_peek_all(cache, keys, 2, found));
  for (int i = 0; i < 2; i++) api_entry_release(found[i]);
  api_entry_release(take(cache, "d", &shop)); /* drives out c */
  assert_null(api_cache_peek(cache, "c"));
  api_entry_release(take(cache, "e", &shop)); /* and b */
  assert_null(api_cache_peek(cache, "b"));
  assert_true(api_cache_peek_all(cache, keys + 1, 1, found));
  api_entry_release(found[0]);
  api_cache_destroy(cache);
}

static void a_value_of_ones_own_is_freed_with_its_last_holder(void **state) {
  (void)state;
  workshop shop = {.size = 1};
  api_built built;
  api_fault fault;
  assert_true(build_piece(&shop, &built, &fault));
  api_entry *entry = api_entry_create(&built);
  api_entry_hold(entry);
  api_entry_release(entry);
  assert_int_equal(shop.destroyed, 0);
  api_entry_release(entry);
  assert_int_equal(shop.destroyed, 1);
}

/* ---- threads ---------------------------------------------------------------------------------- */

enum { THREADS = 8, ROUNDS = 2000, KEYS = 20 };

typedef struct crowd {
  api_cache *cache;
  workshop shop;
  atomic_int waiting;
} crowd;

static void *hammer(void *context) {
  crowd *c = context;
  unsigned seed = 1 + (unsigned)c->waiting++;
  for (int i = 0; i < ROUNDS; i++) {
    seed = seed * 1103515245u + 12345u;
    char key[32];
    snprintf(key, sizeof key, "model%u/plan", seed / 65536 % KEYS);
    if (seed / 65536 % 50 == 49) {
      api_cache_forget(c->cache, key);
      continue;
    }
    api_entry *entry = take(c->cache, key, &c->shop);
    if (((piece *)api_entry_value(entry))->shop != &c->shop) abort();
    api_entry_release(entry);
  }
  return NULL;
}

static void threads_share_build_forget_and_evict(void **state) {
  (void)state;
  crowd c = {.shop = {.size = 500}};
  c.cache = api_cache_create(8000);
  pthread_t threads[THREADS];
  for (int i = 0; i < THREADS; i++) assert_int_equal(pthread_create(&threads[i], NULL, hammer, &c), 0);
  for (int i = 0; i < THREADS; i++) pthread_join(threads[i], NULL);
  assert_true(api_cache_size(c.cache) <= 8000);
  api_cache_destroy(c.cache);
  assert_int_equal(c.shop.built, c.shop.destroyed);
}

/* A build that does not end before all threads have asked. */
static bool build_slowly(void *context, api_built *out, api_fault *fault) {
  crowd *c = context;
  while (c->waiting < THREADS) continue;
  return build_piece(&c->shop, out, fault);
}

static void *ask_for_one(void *context) {
  crowd *c = context;
  api_fault fault;
  c->waiting++;
  api_entry *entry = api_cache_take(c->cache, "one", build_slowly, c, &fault);
  if (!entry && fault.status != 404) abort();
  api_entry_release(entry);
  return NULL;
}

static void equal_requests_at_once_build_one(void **state) {
  (void)state;
  crowd c = {.shop = {.size = 5}};
  c.cache = api_cache_create(100000);
  pthread_t threads[THREADS];
  for (int i = 0; i < THREADS; i++) assert_int_equal(pthread_create(&threads[i], NULL, ask_for_one, &c), 0);
  for (int i = 0; i < THREADS; i++) pthread_join(threads[i], NULL);
  assert_int_equal(c.shop.built, 1);
  api_cache_destroy(c.cache);
  assert_int_equal(c.shop.destroyed, 1);
}

static void all_who_wait_for_a_failing_build_hear_why(void **state) {
  (void)state;
  crowd c = {.shop = {.size = 5, .fails = true}};
  c.cache = api_cache_create(100000);
  pthread_t threads[THREADS];
  for (int i = 0; i < THREADS; i++) assert_int_equal(pthread_create(&threads[i], NULL, ask_for_one, &c), 0);
  for (int i = 0; i < THREADS; i++) pthread_join(threads[i], NULL);
  assert_int_equal(api_cache_size(c.cache), 0);
  api_cache_destroy(c.cache);
}

/* Keys that meet in one place of any table of up to 2^14: as many as are asked for. */
static void colliding_key(uint32_t *from, char out[16]) {
  do snprintf(out, 16, "key %u", (*from)++);
  while (api_cache_hash(out, strlen(out)) % (1 << 14) != 0);
}

static void keys_that_collide_drive_out_each_other(void **state) {
  (void)state;
  enum { KEYS = 200, HELD = 3 };
  workshop shop = {.size = 1};
  api_cache *cache = api_cache_create(UINT64_MAX);
  api_entry *held[HELD];
  char keys[KEYS][16];
  uint32_t from = 0, found = 0;
  for (int i = 0; i < KEYS; i++) {
    colliding_key(&from, keys[i]);
    api_entry *entry = take(cache, keys[i], &shop);
    assert_non_null(entry);
    if (i < HELD)
      held[i] = entry;
    else
      api_entry_release(entry);
  }
  for (int i = 0; i < KEYS; i++) {
    api_entry *entry = api_cache_peek(cache, keys[i]);
    found += entry != NULL;
    assert_true(entry || (i >= HELD && i < KEYS - 1));
    api_entry_release(entry);
  }
  assert_true(found < 100);
  assert_int_equal(shop.destroyed, KEYS - (int)found);
  for (int i = 0; i < HELD; i++) api_entry_release(held[i]);
  api_cache_destroy(cache);
  assert_int_equal(shop.destroyed, KEYS);
}

static void key_that_is_asked_for_stays_among_those_that_collide(void **state) {
  (void)state;
  workshop shop = {.size = 1};
  api_cache *cache = api_cache_create(UINT64_MAX);
  uint32_t from = 0;
  char first[16], key[16];
  colliding_key(&from, first);
  api_entry_release(take(cache, first, &shop));
  for (int i = 0; i < 200; i++) {
    colliding_key(&from, key);
    api_entry_release(take(cache, key, &shop));
    api_entry *entry = api_cache_peek(cache, first);
    assert_non_null(entry);
    api_entry_release(entry);
  }
  assert_true(shop.destroyed > 100);
  api_cache_destroy(cache);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_key_is_built_once),
      cmocka_unit_test(the_least_recently_used_goes_first),
      cmocka_unit_test(what_is_held_stays_over_the_budget_and_goes_when_released),
      cmocka_unit_test(a_failure_is_told_and_not_remembered),
      cmocka_unit_test(forgotten_keys_are_built_anew_and_holders_keep_theirs),
      cmocka_unit_test(several_keys_are_looked_up_all_or_none),
      cmocka_unit_test(keys_that_are_looked_up_together_are_used_together),
      cmocka_unit_test(a_value_of_ones_own_is_freed_with_its_last_holder),
      cmocka_unit_test(threads_share_build_forget_and_evict),
      cmocka_unit_test(equal_requests_at_once_build_one),
      cmocka_unit_test(all_who_wait_for_a_failing_build_hear_why),
      cmocka_unit_test(keys_that_collide_drive_out_each_other),
      cmocka_unit_test(key_that_is_asked_for_stays_among_those_that_collide),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
