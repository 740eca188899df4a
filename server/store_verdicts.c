/* A direct-mapped table: each place holds the verdict that was noted there last. */
#include "store_verdicts.h"

#include "machine.h"

#include <nettle/base16.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PLACES = 1 << 14, ID_SIZE = API_ID_TEXT - 1 };

static const uint64_t FRESH_NS = 1000000000;

struct srv_verdicts {
  pthread_mutex_t lock;
  srv_verdict places[PLACES];
};

bool srv_store_is_id(const char *text) {
  return strspn(text, "0123456789abcdef") == ID_SIZE && text[ID_SIZE] == '\0';
}

bool srv_store_is_hash(struct sha256_ctx *hash, const char *id) {
  uint8_t digest[ID_SIZE / 2];
  char text[ID_SIZE];
  sha256_digest(hash, sizeof digest, digest);
  base16_encode_update(text, sizeof digest, digest);
  return memcmp(text, id, sizeof text) == 0;
}

srv_verdicts *srv_verdicts_create(void) {
  srv_verdicts *table = calloc(1, sizeof *table);
  if (table) pthread_mutex_init(&table->lock, NULL);
  return table;
}

void srv_verdicts_destroy(srv_verdicts *table) {
  if (!table) return;
  pthread_mutex_destroy(&table->lock);
  free(table);
}

/* The place of an id, by its first four hex digits. */
static srv_verdict *place_of(srv_verdicts *table, const char *id) {
  const char first[5] = {id[0], id[1], id[2], id[3], '\0'};
  return &table->places[strtoul(first, NULL, 16) % PLACES];
}

srv_verdict srv_verdicts_recall(srv_verdicts *table, const char *id) {
  pthread_mutex_lock(&table->lock);
  srv_verdict verdict = *place_of(table, id);
  pthread_mutex_unlock(&table->lock);
  return strcmp(verdict.id, id) == 0 ? verdict : (srv_verdict){0};
}

bool srv_verdict_is_fresh(const srv_verdict *verdict) {
  return verdict->seen_ns != 0 && srv_now_ns() - verdict->seen_ns < FRESH_NS;
}

bool srv_verdict_is_of(const srv_verdict *verdict, const char *state) {
  return state[0] != '\0' && strcmp(verdict->state, state) == 0;
}

void srv_verdicts_note(srv_verdicts *table, const char *id, const char *state, uint64_t size,
                       srv_wholeness wholeness) {
  srv_verdict verdict = {
      .size = size, .wholeness = wholeness, .seen_ns = wholeness == SRV_DAMAGED ? 0 : srv_now_ns()};
  snprintf(verdict.id, sizeof verdict.id, "%s", id);
  snprintf(verdict.state, sizeof verdict.state, "%s", state);
  pthread_mutex_lock(&table->lock);
  *place_of(table, id) = verdict;
  pthread_mutex_unlock(&table->lock);
}

void srv_verdicts_forget(srv_verdicts *table, const char *id) {
  pthread_mutex_lock(&table->lock);
  srv_verdict *verdict = place_of(table, id);
  if (strcmp(verdict->id, id) == 0) *verdict = (srv_verdict){0};
  pthread_mutex_unlock(&table->lock);
}
