/* Other daemons may store models in the same folder and remove them, so the folder is counted again once a
 * minute. What this daemon stores and removes is counted at once. */
#include "store_quota.h"

#include "disk.h"
#include "machine.h"

#include <stdio.h>

static const uint64_t RECOUNT_NS = 60000000000;

void srv_store_quota_init(srv_store_quota *quota, const char *folder) {
  *quota = (srv_store_quota){0};
  pthread_mutex_init(&quota->lock, NULL);
  snprintf(quota->folder, sizeof quota->folder, "%s", folder);
}

void srv_store_quota_deinit(srv_store_quota *quota) {
  pthread_mutex_destroy(&quota->lock);
}

static bool add_size(void *context, const char *name, const struct stat *facts) {
  (void)name;
  *(uint64_t *)context += (uint64_t)facts->st_size;
  return true;
}

/* Counts the folder, with the lock held. A model in the folder that is not settled yet counts twice until the
 * next count. */
static void count(srv_store_quota *quota, uint64_t now_ns) {
  uint64_t used = 0;
  srv_each_file(quota->folder, add_size, &used);
  atomic_store(&quota->used, used);
  quota->counted_ns = now_ns;
}

bool srv_store_quota_take(srv_store_quota *quota, uint64_t size) {
  if (quota->limit == 0) return true;
  uint64_t now_ns = srv_now_ns();
  pthread_mutex_lock(&quota->lock);
  bool is_old = quota->counted_ns == 0 || now_ns - quota->counted_ns > RECOUNT_NS;
  if (is_old) count(quota, now_ns);
  uint64_t used = atomic_load(&quota->used) + quota->under_way;
  bool fits = size <= quota->limit && used <= quota->limit - size;
  if (fits) quota->under_way += size;
  pthread_mutex_unlock(&quota->lock);
  return fits;
}

void srv_store_quota_count(srv_store_quota *quota) {
  if (quota->limit == 0) return;
  pthread_mutex_lock(&quota->lock);
  count(quota, srv_now_ns());
  pthread_mutex_unlock(&quota->lock);
}

void srv_store_quota_limit(srv_store_quota *quota, uint64_t limit) {
  quota->limit = limit;
  srv_store_quota_count(quota);
}

void srv_store_quota_settle(srv_store_quota *quota, uint64_t size, bool is_stored) {
  if (quota->limit == 0) return;
  pthread_mutex_lock(&quota->lock);
  quota->under_way -= size;
  if (is_stored) atomic_fetch_add(&quota->used, size);
  pthread_mutex_unlock(&quota->lock);
}

void srv_store_quota_give_back(srv_store_quota *quota, uint64_t size) {
  if (quota->limit == 0) return;
  pthread_mutex_lock(&quota->lock);
  uint64_t used = atomic_load(&quota->used);
  atomic_store(&quota->used, used - (size < used ? size : used));
  pthread_mutex_unlock(&quota->lock);
}

uint64_t srv_store_quota_used(srv_store_quota *quota) {
  return atomic_load(&quota->used);
}
