/* How many bytes models may take together (--store-limit). */
#ifndef SRV_STORE_QUOTA_H
#define SRV_STORE_QUOTA_H

#include <limits.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

typedef struct srv_store_quota {
  pthread_mutex_t lock;      /* held while the folder is counted; guards what follows for changes */
  uint64_t limit;            /* 0: none, and nothing is counted */
  atomic_uint_fast64_t used; /* read without the lock */
  uint64_t under_way;        /* of models that are being stored */
  uint64_t counted_ns;       /* when the folder was counted last, 0: never */
  char folder[PATH_MAX];     /* of objects */
} srv_store_quota;

void srv_store_quota_init(srv_store_quota *quota, const char *folder);
void srv_store_quota_deinit(srv_store_quota *quota);

/* Sets the limit and counts. Before anything is taken. */
void srv_store_quota_limit(srv_store_quota *quota, uint64_t limit);

/* Counts a model that is about to be stored, until it is settled; false where it does not fit. Any thread. */
bool srv_store_quota_take(srv_store_quota *quota, uint64_t size);
void srv_store_quota_settle(srv_store_quota *quota, uint64_t size, bool is_stored);
/* A stored model was removed. */
void srv_store_quota_give_back(srv_store_quota *quota, uint64_t size);
/* Of stored models. Never waits. */
uint64_t srv_store_quota_used(srv_store_quota *quota);

#endif
