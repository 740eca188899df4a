/* The limit on the bytes of all models together (--store-limit). */
#ifndef SRV_STORE_QUOTA_H
#define SRV_STORE_QUOTA_H

#include <limits.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

typedef struct srv_store_quota {
  pthread_mutex_t lock;      /* guards changes of the members below; held while counting */
  uint64_t limit;            /* 0: no limit; nothing is counted then */
  atomic_uint_fast64_t used; /* bytes of stored models; read without the lock */
  uint64_t under_way;        /* bytes of models that are being stored */
  uint64_t counted_ns;       /* time of the last count, 0: never */
  char folder[PATH_MAX];     /* of the objects */
} srv_store_quota;

void srv_store_quota_init(srv_store_quota *quota, const char *folder);
void srv_store_quota_deinit(srv_store_quota *quota);

/* Sets the limit and counts the folder. Call before srv_store_quota_take. */
void srv_store_quota_limit(srv_store_quota *quota, uint64_t limit);

/* Reserves the bytes of a model that is about to be stored, until srv_store_quota_settle; false when they do
 * not fit. Any thread. */
bool srv_store_quota_take(srv_store_quota *quota, uint64_t size);
void srv_store_quota_settle(srv_store_quota *quota, uint64_t size, bool is_stored);
/* Call when a stored model was removed. */
void srv_store_quota_give_back(srv_store_quota *quota, uint64_t size);
/* Counts the folder again. Call when a file in it got another size. */
void srv_store_quota_count(srv_store_quota *quota);
/* Bytes of stored models. Never waits. */
uint64_t srv_store_quota_used(srv_store_quota *quota);

#endif
