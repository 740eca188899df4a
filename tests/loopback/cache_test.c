/* The cache: one build a key, references, idle entries, forgetting, failures, promises; many threads. The
 * budget: grants, room that idle entries make, waiting. */
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
  int cancelled; /* so many builds are cancelled, the first ones */
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
  if (number < shop->cancelled) {
    tw_fail(&fault->error, TW_CANCELLED, "the time is over");
    return api_fault_complete(fault);
  }
  if (shop->fails) {
    fault->status = 404;
    return false;
  }
  piece *p = malloc(sizeof *p);
  *p = (piece){shop, number};
  *out = (api_built){p, (size_t)shop->size, destroy_piece, API_CACHED_CLIP};
  return true;
}

/* A cache with a budget of its own. */
static api_cache *open_within(uint64_t idle_max, uint64_t memory, api_budget **budget) {
  *budget = api_budget_create(memory, 2);
  api_cache *cache = api_cache_create(idle_max, *budget);
  assert_non_null(cache);
  return cache;
}

/* All memory has to be given back by now. */
static void close_budget(api_budget *budget) {
  assert_int_equal(api_budget_used(budget), 0);
  api_budget_destroy(budget);
}

static api_budget *usual;

static api_cache *open_cache(uint64_t idle_max) {
  return open_within(idle_max, UINT64_MAX / 2, &usual);
}

static void close_cache(api_cache *cache) {
  api_cache_destroy(cache);
  close_budget(usual);
}

/* Takes as a heavy request would, and waits where it has to. NULL: the fault says why. */
static api_entry *take_by(api_cache *cache, const char *key, api_build build, void *context,
                          api_fault *fault) {
  loopback_ticket *ticket = loopback_ticket_create();
  api_entry *entry;
  for (;;) {
    entry = api_cache_take(cache, key, &ticket->ticket, API_HEAVY, build, context, fault);
    if (entry || fault->stall != API_STALL_ENTRY) break;
    if (api_cache_wait(cache, &ticket->ticket, fault->awaited) == API_WAIT_BEGUN)
      loopback_ticket_await(ticket);
  }
  api_cache_end(cache, &ticket->ticket);
  loopback_ticket_destroy(NULL, ticket);
  return entry;
}

static api_entry *take(api_cache *cache, const char *key, workshop *shop) {
  api_fault fault;
  return take_by(cache, key, build_piece, shop, &fault);
}

TEST(a_key_is_built_once) {
  workshop shop = {.size = 100};
  api_cache *cache = open_cache(10000);
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
  close_cache(cache);
  assert_int_equal(shop.destroyed, 1);
}

TEST(the_least_recently_used_goes_first) {
  workshop shop = {.size = 100000};
  /* Room for three of them and half of a fourth, with what an entry itself takes. */
  api_cache *cache = open_cache(UINT64_MAX);
  api_entry_release(take(cache, "a", &shop));
  uint64_t budget = api_cache_idle_size(cache) * 7 / 2;
  close_cache(cache);
  cache = open_cache(budget);
  api_entry_release(take(cache, "a", &shop));
  api_entry_release(take(cache, "b", &shop));
  api_entry_release(take(cache, "c", &shop));
  api_entry_release(api_cache_peek(cache, "a"));
  api_entry_release(take(cache, "d", &shop));
  assert_null(api_cache_peek(cache, "b"));
  api_entry *kept = api_cache_peek(cache, "a");
  assert_non_null(kept);
  api_entry_release(kept);
  close_cache(cache);
}

TEST(what_is_held_stays_over_the_budget_and_goes_when_released) {
  workshop shop = {.size = 100000};
  api_cache *cache = open_cache(1000);
  api_entry *held = take(cache, "a", &shop);
  assert_int_equal(((piece *)api_entry_value(held))->number, 0);
  assert_int_equal(shop.destroyed, 0);
  api_entry_release(held);
  assert_int_equal(shop.destroyed, 1);
  assert_int_equal(api_cache_idle_size(cache), 0);
  close_cache(cache);
}

TEST(a_failure_is_told_and_not_remembered) {
  workshop shop = {.size = 1, .fails = true};
  api_cache *cache = open_cache(10000);
  api_fault fault;
  assert_null(take_by(cache, "a", build_piece, &shop, &fault));
  assert_int_equal(fault.status, 404);
  shop.fails = false;
  api_entry *entry = take(cache, "a", &shop);
  assert_non_null(entry);
  assert_int_equal(shop.built, 2);
  api_entry_release(entry);
  close_cache(cache);
}

/* Ids of models. */
#define X "0123456789abcdef0123456789abcdef"
#define Y "0123456789abcdef0123456789abcdee"

TEST(forgotten_keys_are_built_anew_and_holders_keep_theirs) {
  workshop shop = {.size = 1};
  api_cache *cache = open_cache(10000);
  api_entry *held = take(cache, X "/model", &shop);
  api_entry_release(take(cache, X "/plan", &shop));
  api_entry_release(take(cache, Y "/clip?clips=" X "/0,", &shop));
  api_entry_release(take(cache, Y "/clip?clips=" X "/0," X "/1,", &shop));
  api_entry_release(take(cache, Y "/clip?force=1" X "/0,", &shop)); /* whatever is before the id */
  api_entry_release(take(cache, Y "/model", &shop));
  api_entry_release(take(cache, Y "/node?" X, &shop)); /* a name */
  api_cache_forget(cache, X);
  assert_int_equal(shop.destroyed, 4);
  assert_null(api_cache_peek(cache, X "/model"));
  assert_int_equal(((piece *)api_entry_value(held))->number, 0);
  for (int i = 0; i < 2; i++) {
    api_entry *kept = api_cache_peek(cache, i == 0 ? Y "/model" : Y "/node?" X);
    assert_non_null(kept);
    api_entry_release(kept);
  }
  api_entry *fresh = take(cache, X "/model", &shop);
  assert_int_equal(((piece *)api_entry_value(fresh))->number, 7);
  api_entry_release(held);
  assert_int_equal(shop.destroyed, 5);
  api_entry_release(fresh);
  close_cache(cache);
  assert_int_equal(shop.destroyed, shop.built);
}

/* Ids share places of the table. */
TEST(of_many_models_those_that_are_there_are_forgotten) {
  enum { KEPT = 20000, ABSENT = 20000 };
  workshop shop = {.size = 1};
  api_cache *cache = open_cache((uint64_t)1 << 30);
  char key[API_ID_TEXT + 8];
  for (unsigned i = 0; i < KEPT; i++) {
    snprintf(key, sizeof key, "%032x/model", i);
    api_entry_release(take(cache, key, &shop));
  }
  for (unsigned i = 0; i < ABSENT; i++) {
    snprintf(key, sizeof key, "%032x", KEPT + i);
    api_cache_forget(cache, key);
  }
  assert_int_equal(shop.destroyed, 0);
  for (unsigned i = 0; i < KEPT; i++) {
    snprintf(key, sizeof key, "%032x", i);
    api_cache_forget(cache, key);
  }
  assert_int_equal(shop.destroyed, KEPT);
  close_cache(cache);
}

TEST(a_value_of_ones_own_is_freed_when_it_is_released) {
  workshop shop = {.size = 1};
  api_built built;
  api_fault fault;
  assert_true(build_piece(&shop, &built, &fault));
  api_cache *cache = open_cache(1000);
  api_entry *entry = api_cache_own(cache, &built);
  assert_int_equal(api_budget_used(usual), 1);
  assert_int_equal(shop.destroyed, 0);
  api_entry_release(entry);
  assert_int_equal(shop.destroyed, 1);
  close_cache(cache);
}

/* ---- promises -------------------------------------------------------------------------------- */

TEST(what_is_larger_than_the_idle_budget_pushes_out_nothing) {
  workshop small = {.size = 100}, large = {.size = 100000};
  api_cache *cache = open_cache(10000);
  api_entry_release(take(cache, "small", &small));
  api_entry *in_use = take(cache, "large", &large);
  api_entry *kept = api_cache_peek(cache, "small");
  assert_non_null(kept);
  api_entry_release(kept);
  api_entry_release(in_use);
  assert_int_equal(large.destroyed, 1);
  assert_int_equal(small.destroyed, 0);
  close_cache(cache);
}

static api_entry *take_once(api_cache *cache, loopback_ticket *ticket, api_effort effort, workshop *shop,
                            api_fault *fault) {
  return api_cache_take(cache, "a", &ticket->ticket, effort, build_piece, shop, fault);
}

TEST(a_light_call_promises_and_others_wait) {
  workshop shop = {.size = 10};
  api_cache *cache = open_cache(1000);
  loopback_ticket *first = loopback_ticket_create(), *second = loopback_ticket_create();
  api_fault fault;
  assert_null(take_once(cache, first, API_LIGHT, &shop, &fault));
  assert_int_equal(fault.stall, API_STALL_THREAD);
  assert_null(take_once(cache, second, API_LIGHT, &shop, &fault));
  assert_int_equal(fault.stall, API_STALL_ENTRY);
  assert_int_equal(api_cache_wait(cache, &second->ticket, fault.awaited), API_WAIT_BEGUN);
  api_entry *built = take_once(cache, first, API_HEAVY, &shop, &fault);
  assert_non_null(built);
  loopback_ticket_await(second);
  api_entry *same = take_once(cache, second, API_LIGHT, &shop, &fault);
  assert_ptr_equal(built, same);
  assert_int_equal(shop.built, 1);
  api_entry_release(built);
  api_entry_release(same);
  api_cache_end(cache, &first->ticket);
  api_cache_end(cache, &second->ticket);
  loopback_ticket_destroy(NULL, first);
  loopback_ticket_destroy(NULL, second);
  close_cache(cache);
}

TEST(a_broken_promise_wakes_who_waits_and_the_next_one_builds) {
  workshop shop = {.size = 10};
  api_cache *cache = open_cache(1000);
  loopback_ticket *first = loopback_ticket_create(), *second = loopback_ticket_create();
  api_fault fault;
  assert_null(take_once(cache, first, API_LIGHT, &shop, &fault));
  assert_null(take_once(cache, second, API_HEAVY, &shop, &fault));
  assert_int_equal(api_cache_wait(cache, &second->ticket, fault.awaited), API_WAIT_BEGUN);
  api_cache_end(cache, &first->ticket);
  loopback_ticket_await(second);
  api_entry *entry = take_once(cache, second, API_HEAVY, &shop, &fault);
  assert_non_null(entry);
  api_entry_release(entry);
  api_cache_end(cache, &second->ticket);
  loopback_ticket_destroy(NULL, first);
  loopback_ticket_destroy(NULL, second);
  close_cache(cache);
}

TEST(a_cancelled_wait_is_not_woken) {
  workshop shop = {.size = 10};
  api_cache *cache = open_cache(1000);
  loopback_ticket *first = loopback_ticket_create(), *second = loopback_ticket_create();
  api_fault fault;
  assert_null(take_once(cache, first, API_LIGHT, &shop, &fault));
  assert_null(take_once(cache, second, API_LIGHT, &shop, &fault));
  assert_int_equal(api_cache_wait(cache, &second->ticket, fault.awaited), API_WAIT_BEGUN);
  assert_true(api_cache_cancel(cache, &second->ticket));
  assert_false(api_cache_cancel(cache, &second->ticket));
  api_entry_release(take_once(cache, first, API_HEAVY, &shop, &fault));
  assert_int_equal(second->woken, 0);
  api_cache_end(cache, &first->ticket);
  api_cache_end(cache, &second->ticket);
  loopback_ticket_destroy(NULL, first);
  loopback_ticket_destroy(NULL, second);
  close_cache(cache);
}

/* A build that asks for more memory than there is, until it is granted. */
typedef struct hungry {
  api_budget *budget;
  api_ticket *ticket;
  workshop shop;
} hungry;

static bool build_hungrily(void *context, api_built *out, api_fault *fault) {
  hungry *h = context;
  if (api_budget_grant(h->budget, h->ticket, 5000000)) return build_piece(&h->shop, out, fault);
  *fault = (api_fault){.stall = API_STALL_MEMORY, .needed = 5000000};
  return false;
}

TEST(a_build_without_memory_stays_promised_while_it_waits) {
  api_budget *budget;
  api_cache *cache = open_within(1000, 8000000, &budget);
  loopback_ticket *owner = loopback_ticket_create(), *first = loopback_ticket_create(),
                  *second = loopback_ticket_create();
  hungry h = {budget, &first->ticket, {.size = 10}};
  api_fault fault;
  assert_true(api_budget_grant(budget, &owner->ticket, 4000000));
  assert_null(api_cache_take(cache, "a", &first->ticket, API_HEAVY, build_hungrily, &h, &fault));
  assert_int_equal(fault.stall, API_STALL_MEMORY);
  assert_int_equal(api_budget_wait(budget, &first->ticket, fault.needed), API_WAIT_BEGUN);
  assert_null(take_once(cache, second, API_HEAVY, &h.shop, &fault));
  assert_int_equal(fault.stall, API_STALL_ENTRY);
  assert_int_equal(api_cache_wait(cache, &second->ticket, fault.awaited), API_WAIT_BEGUN);
  assert_true(api_budget_grant(budget, &owner->ticket, 0));
  loopback_ticket_await(first);
  assert_int_equal(first->ticket.granted, 5000000);
  api_entry_release(api_cache_take(cache, "a", &first->ticket, API_HEAVY, build_hungrily, &h, &fault));
  loopback_ticket_await(second);
  assert_int_equal(h.shop.built, 1);
  for (int i = 0; i < 3; i++) {
    loopback_ticket *t = (loopback_ticket *const[]){owner, first, second}[i];
    api_cache_end(cache, &t->ticket);
    api_budget_grant(budget, &t->ticket, 0);
    loopback_ticket_destroy(NULL, t);
  }
  api_cache_destroy(cache);
  close_budget(budget);
}

/* ---- the budget ------------------------------------------------------------------------------ */

static uint64_t relieve(void *cache, uint64_t bytes) {
  return api_cache_relieve(cache, bytes);
}

TEST(a_grant_makes_room_of_idle_entries_alone) {
  workshop shop = {.size = 3000000};
  api_budget *budget;
  api_cache *cache = open_within(UINT64_MAX, 16000000, &budget);
  api_budget_relieved_by(budget, relieve, cache);
  api_entry *held = take(cache, "held", &shop);
  for (const char *const *key = (const char *const[]){"b", "c", "d", NULL}; *key; key++)
    api_entry_release(take(cache, *key, &shop));
  api_ticket first = {0}, second = {0};
  assert_true(api_budget_grant(budget, &first, 5000000)); /* 12 and 5 MB are over 15: one goes */
  assert_int_equal(shop.destroyed, 1);
  assert_true(api_budget_grant(budget, &second, 6000000));
  assert_int_equal(shop.destroyed, 3);
  assert_false(api_budget_grant(budget, &second, 8000000));
  assert_int_equal(second.granted, 6000000);
  api_entry_release(held);
  assert_true(api_budget_grant(budget, &second, 8000000));
  assert_int_equal(shop.destroyed, 4);
  api_budget_grant(budget, &first, 0);
  api_budget_grant(budget, &second, 0);
  api_cache_destroy(cache);
  close_budget(budget);
}

TEST(a_request_that_is_alone_is_granted_anything_but_the_room_of_small_ones) {
  api_budget *budget = api_budget_create(1600000, 2);
  api_ticket first = {0}, second = {0};
  assert_true(api_budget_grant(budget, &first, 50000000));
  assert_true(api_budget_grant(budget, &first, 70000000));
  assert_int_equal(first.granted, 1500000);
  assert_false(api_budget_grant(budget, &second, 100001));
  assert_true(api_budget_grant(budget, &second, 100000));
  assert_true(api_budget_grant(budget, &first, 0));
  assert_true(api_budget_grant(budget, &second, 2000000));
  api_budget_grant(budget, &second, 0);
  close_budget(budget);
}

TEST(who_reads_a_small_answer_keeps_nobody_from_being_alone) {
  api_budget *budget = api_budget_create(1000000, 2);
  api_ticket reader = {0}, computing = {0};
  loopback_ticket *large = loopback_ticket_create();
  assert_true(api_budget_grant(budget, &reader, 300000));
  assert_true(api_budget_retain(budget, &reader, 100000));
  assert_int_equal(reader.granted, 100000);
  assert_true(api_budget_grant(budget, &computing, 20000));
  assert_int_equal(api_budget_wait(budget, &large->ticket, 50000000), API_WAIT_BEGUN);
  assert_int_equal(large->ticket.granted, 0);
  assert_true(api_budget_retain(budget, &computing, 26000)); /* more than an eighth */
  assert_int_equal(large->ticket.granted, 0);
  assert_true(api_budget_retain(budget, &computing, 25000));
  loopback_ticket_await(large);
  assert_int_equal(large->ticket.granted, 937500 - 100000 - 25000); /* all that is left but a sixteenth */
  assert_false(api_budget_retain(budget, &computing, 200000));
  api_budget_grant(budget, &large->ticket, 0);
  api_budget_grant(budget, &computing, 0);
  api_budget_grant(budget, &reader, 0);
  loopback_ticket_destroy(NULL, large);
  close_budget(budget);
}

TEST(small_requests_find_room_where_large_ones_do_not) {
  api_budget *budget = api_budget_create(160000000, 2);
  api_ticket large = {0}, next = {0}, small = {0};
  assert_true(api_budget_grant(budget, &large, 149000000));
  assert_false(api_budget_grant(budget, &next, 5000000));
  assert_true(api_budget_grant(budget, &small, 4000000));
  api_budget_grant(budget, &large, 0);
  api_budget_grant(budget, &small, 0);
  close_budget(budget);
}

TEST(who_waits_for_memory_is_woken_in_turn_and_few_may_wait) {
  api_budget *budget = api_budget_create(16000000, 2);
  loopback_ticket *t[4];
  for (int i = 0; i < 4; i++) t[i] = loopback_ticket_create();
  assert_true(api_budget_grant(budget, &t[0]->ticket, 10000000));
  assert_int_equal(api_budget_wait(budget, &t[1]->ticket, 9000000), API_WAIT_BEGUN);
  assert_int_equal(api_budget_wait(budget, &t[2]->ticket, 3000000),
                   API_WAIT_BEGUN); /* it fits, but is second */
  assert_int_equal(api_budget_wait(budget, &t[3]->ticket, 3000000), API_WAIT_CROWDED);
  api_budget_grant(budget, &t[0]->ticket, 0);
  loopback_ticket_await(t[1]);
  loopback_ticket_await(t[2]);
  assert_int_equal(t[1]->ticket.granted, 9000000);
  assert_int_equal(t[2]->ticket.granted, 3000000);
  assert_int_equal(api_budget_wait(budget, &t[3]->ticket, 9000000), API_WAIT_BEGUN);
  assert_true(api_budget_cancel(budget, &t[3]->ticket));
  assert_false(api_budget_cancel(budget, &t[3]->ticket));
  for (int i = 0; i < 4; i++) {
    api_budget_grant(budget, &t[i]->ticket, 0);
    loopback_ticket_destroy(NULL, t[i]);
  }
  close_budget(budget);
}

TEST(who_gives_its_grant_back_to_wait_wakes_those_before_it) {
  api_budget *budget = api_budget_create(16000000, 2);
  loopback_ticket *first = loopback_ticket_create(), *second = loopback_ticket_create();
  assert_true(api_budget_grant(budget, &second->ticket, 10000000));
  assert_int_equal(api_budget_wait(budget, &first->ticket, 9000000), API_WAIT_BEGUN);
  assert_int_equal(api_budget_wait(budget, &second->ticket, 12000000), API_WAIT_BEGUN);
  loopback_ticket_await(first);
  assert_int_equal(second->ticket.granted, 0);
  api_budget_grant(budget, &first->ticket, 0);
  loopback_ticket_await(second);
  assert_int_equal(second->ticket.granted, 12000000);
  api_budget_grant(budget, &second->ticket, 0);
  loopback_ticket_destroy(NULL, first);
  loopback_ticket_destroy(NULL, second);
  close_budget(budget);
}

TEST(who_stops_waiting_lets_those_behind_it_pass) {
  api_budget *budget = api_budget_create(16000000, 2);
  api_ticket holder = {0}, large = {0};
  loopback_ticket *behind = loopback_ticket_create();
  assert_true(api_budget_grant(budget, &holder, 10000000));
  assert_int_equal(api_budget_wait(budget, &large, 9000000), API_WAIT_BEGUN);
  assert_int_equal(api_budget_wait(budget, &behind->ticket, 3000000), API_WAIT_BEGUN);
  assert_true(api_budget_cancel(budget, &large));
  loopback_ticket_await(behind);
  assert_int_equal(behind->ticket.granted, 3000000);
  api_budget_grant(budget, &holder, 0);
  api_budget_grant(budget, &behind->ticket, 0);
  loopback_ticket_destroy(NULL, behind);
  close_budget(budget);
}

TEST(who_needs_little_does_not_wait_behind_who_needs_much) {
  api_budget *budget = api_budget_create(16000000, 3);
  api_ticket holder = {0}, large = {0};
  loopback_ticket *small = loopback_ticket_create();
  assert_true(api_budget_grant(budget, &holder, 10000000));
  api_budget_add(budget, 5500000);
  assert_int_equal(api_budget_wait(budget, &large, 9000000), API_WAIT_BEGUN);
  assert_int_equal(api_budget_wait(budget, &small->ticket, 1000000), API_WAIT_BEGUN);
  api_budget_subtract(budget, 1000000);
  loopback_ticket_await(small);
  assert_int_equal(small->ticket.granted, 1000000);
  assert_true(api_budget_cancel(budget, &large));
  api_budget_grant(budget, &holder, 0);
  api_budget_grant(budget, &small->ticket, 0);
  api_budget_subtract(budget, 4500000);
  loopback_ticket_destroy(NULL, small);
  close_budget(budget);
}

TEST(who_waits_for_readers_alone_holds_up_nobody) {
  api_budget *budget = api_budget_create(16000000, 3);
  api_ticket reader = {0}, large = {0}, fresh = {0};
  loopback_ticket *behind = loopback_ticket_create(), *last = loopback_ticket_create();
  assert_true(api_budget_grant(budget, &reader, 9000000));
  assert_int_equal(api_budget_wait(budget, &large, 50000000), API_WAIT_BEGUN);
  assert_int_equal(api_budget_wait(budget, &behind->ticket, 5000000), API_WAIT_BEGUN);
  assert_int_equal(api_budget_wait(budget, &last->ticket, 2000000), API_WAIT_BEGUN);
  assert_int_equal(behind->ticket.granted, 0);
  assert_true(api_budget_retain(budget, &reader, 9000000));
  loopback_ticket_await(behind);
  assert_int_equal(behind->ticket.granted, 5000000);
  assert_int_equal(last->ticket.granted, 0); /* the first one may fit when this is over */
  assert_true(api_budget_retain(budget, &behind->ticket, 3000000));
  loopback_ticket_await(last);
  assert_true(api_budget_retain(budget, &last->ticket, 1000000));
  assert_true(api_budget_grant(budget, &fresh, 1500000)); /* one that comes now, too */
  api_budget_grant(budget, &fresh, 0);
  assert_true(api_budget_cancel(budget, &large));
  api_budget_grant(budget, &reader, 0);
  api_budget_grant(budget, &behind->ticket, 0);
  api_budget_grant(budget, &last->ticket, 0);
  loopback_ticket_destroy(NULL, behind);
  loopback_ticket_destroy(NULL, last);
  close_budget(budget);
}

/* An entry that becomes idle just when the thread that serves the queue has found none. */
typedef struct late_entry {
  api_budget *budget;
  uint64_t size;
  int looks;
} late_entry;

static uint64_t relieve_late(void *context, uint64_t bytes) {
  late_entry *late = context;
  (void)bytes;
  int look = late->looks++;
  if (look < 2) {                                 /* the first one is of the request itself */
    if (look == 1) api_budget_poke(late->budget); /* as another thread does meanwhile */
    return 0;
  }
  uint64_t freed = late->size;
  late->size = 0;
  if (freed > 0) api_budget_subtract(late->budget, freed);
  return freed;
}

TEST(memory_that_becomes_idle_while_others_look_for_some_is_found) {
  api_budget *budget = api_budget_create(16000000, 2);
  late_entry late = {budget, 6000000, 0};
  api_budget_relieved_by(budget, relieve_late, &late);
  api_ticket holder = {0};
  loopback_ticket *waiting = loopback_ticket_create();
  assert_true(api_budget_grant(budget, &holder, 4000000));
  api_budget_add(budget, late.size);
  assert_int_equal(api_budget_wait(budget, &waiting->ticket, 9000000), API_WAIT_BEGUN);
  assert_true(late.looks > 2);
  loopback_ticket_await(waiting);
  assert_int_equal(waiting->ticket.granted, 9000000);
  api_budget_grant(budget, &holder, 0);
  api_budget_grant(budget, &waiting->ticket, 0);
  loopback_ticket_destroy(NULL, waiting);
  close_budget(budget);
}

enum { WAITERS = 6, WAITS = 3000 };

static void *waits_and_holds(void *context) {
  api_budget *budget = context;
  loopback_ticket *t = loopback_ticket_create();
  for (int i = 0; i < WAITS; i++)
    for (uint64_t bytes = 4000000; bytes <= 12000000; bytes += 4000000)
      if (!api_budget_grant(budget, &t->ticket, bytes) &&
          api_budget_wait(budget, &t->ticket, bytes) == API_WAIT_BEGUN)
        loopback_ticket_await(t);
  api_budget_grant(budget, &t->ticket, 0);
  loopback_ticket_destroy(NULL, t);
  return NULL;
}

TEST(no_one_waits_for_ever_beside_others_who_wait) {
  api_budget *budget = api_budget_create(16000000, WAITERS);
  pthread_t threads[WAITERS];
  for (int i = 0; i < WAITERS; i++)
    assert_int_equal(pthread_create(&threads[i], NULL, waits_and_holds, budget), 0);
  for (int i = 0; i < WAITERS; i++) pthread_join(threads[i], NULL);
  close_budget(budget);
}

/* ---- threads --------------------------------------------------------------------------------- */

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
    char key[API_ID_TEXT + 8];
    snprintf(key, sizeof key, "%032x/plan", seed / 65536 % KEYS);
    if (seed / 65536 % 50 == 49) {
      api_cache_forget(c->cache, key); /* which begins with the id */
      continue;
    }
    api_entry *entry = take(c->cache, key, &c->shop);
    if (((piece *)api_entry_value(entry))->shop != &c->shop) abort();
    api_entry_release(entry);
  }
  return NULL;
}

TEST(threads_share_build_forget_and_evict) {
  crowd c = {.shop = {.size = 500}};
  c.cache = open_cache(8000);
  pthread_t threads[THREADS];
  for (int i = 0; i < THREADS; i++) assert_int_equal(pthread_create(&threads[i], NULL, hammer, &c), 0);
  for (int i = 0; i < THREADS; i++) pthread_join(threads[i], NULL);
  assert_true(api_cache_idle_size(c.cache) <= 8000);
  close_cache(c.cache);
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
  api_entry *entry = take_by(c->cache, "one", build_slowly, c, &fault);
  if (!entry && fault.status != 404) abort();
  api_entry_release(entry);
  return NULL;
}

TEST(equal_requests_at_once_build_one) {
  crowd c = {.shop = {.size = 5}};
  c.cache = open_cache(100000);
  pthread_t threads[THREADS];
  for (int i = 0; i < THREADS; i++) assert_int_equal(pthread_create(&threads[i], NULL, ask_for_one, &c), 0);
  for (int i = 0; i < THREADS; i++) pthread_join(threads[i], NULL);
  assert_int_equal(c.shop.built, 1);
  close_cache(c.cache);
  assert_int_equal(c.shop.destroyed, 1);
}

TEST(all_who_wait_for_a_failing_build_hear_why) {
  crowd c = {.shop = {.size = 5, .fails = true}};
  c.cache = open_cache(100000);
  pthread_t threads[THREADS];
  for (int i = 0; i < THREADS; i++) assert_int_equal(pthread_create(&threads[i], NULL, ask_for_one, &c), 0);
  for (int i = 0; i < THREADS; i++) pthread_join(threads[i], NULL);
  assert_int_equal(api_cache_idle_size(c.cache), 0);
  close_cache(c.cache);
}

static void *ask_with_patience(void *context) {
  crowd *c = context;
  api_fault fault;
  c->waiting++;
  api_entry *entry = take_by(c->cache, "one", build_slowly, c, &fault);
  if (!entry && fault.status != 503) abort();
  api_entry_release(entry);
  return entry;
}

TEST(a_build_whose_time_is_over_fails_its_own_request_alone) {
  crowd c = {.shop = {.size = 5, .cancelled = 2}};
  c.cache = open_cache(100000);
  pthread_t threads[THREADS];
  int served = 0;
  for (int i = 0; i < THREADS; i++)
    assert_int_equal(pthread_create(&threads[i], NULL, ask_with_patience, &c), 0);
  for (int i = 0; i < THREADS; i++) {
    void *entry;
    pthread_join(threads[i], &entry);
    served += entry != NULL;
  }
  assert_int_equal(served, THREADS - 2);
  assert_int_equal(c.shop.built, 3);
  close_cache(c.cache);
}

/* Keys that meet in one place of any table of up to 2^14: as many as are asked for. */
static void colliding_key(uint32_t *from, char out[16]) {
  do snprintf(out, 16, "key %u", (*from)++);
  while (api_cache_hash(out) % (1 << 14) != 0);
}

TEST(keys_that_collide_drive_out_each_other) {
  enum { KEYS = 200, HELD = 3 };
  workshop shop = {.size = 1};
  api_cache *cache = open_cache(UINT64_MAX);
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
  close_cache(cache);
  assert_int_equal(shop.destroyed, KEYS);
}

TEST(key_that_is_asked_for_stays_among_those_that_collide) {
  workshop shop = {.size = 1};
  api_cache *cache = open_cache(UINT64_MAX);
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
  close_cache(cache);
}
