#include "mapped.h"

#include "log.h"
#include "machine.h"

#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

/* A thread that reads pages which the system has cached gets through some MB meanwhile. */
static const uint64_t STEP_NS = 2000000;

/* Bytes that the process has resident; 0 where the system does not tell. statm: /proc/self/statm. */
static uint64_t resident(int statm) {
  char text[128];
  unsigned long long pages = 0;
  ssize_t size = pread(statm, text, sizeof text - 1, 0);
  text[size > 0 ? size : 0] = '\0';
  if (sscanf(text, "%*u %llu", &pages) != 1) return 0;
  return pages * (uint64_t)sysconf(_SC_PAGESIZE);
}

static void drop_pages(srv_mapped *mapped) {
  for (const srv_mapping *m = mapped->first; m; m = m->next) madvise(m->start, m->size, MADV_DONTNEED);
  mapped->dropped++;
}

static void *watch(void *context) {
  srv_mapped *mapped = context;
  int statm = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  pthread_mutex_lock(&mapped->lock);
  while (!mapped->is_closing) {
    if (!mapped->first || statm < 0) {
      pthread_cond_wait(&mapped->wake, &mapped->lock);
      continue;
    }
    if (resident(statm) > mapped->resident_max) drop_pages(mapped);
    srv_timed_wait(&mapped->wake, &mapped->lock, srv_now_ns() + STEP_NS);
  }
  pthread_mutex_unlock(&mapped->lock);
  if (statm >= 0) close(statm);
  return NULL;
}

void srv_mapped_init(srv_mapped *mapped, uint64_t resident_max) {
  *mapped = (srv_mapped){.resident_max = resident_max};
  pthread_mutex_init(&mapped->lock, NULL);
  srv_timed_init(&mapped->wake);
}

void srv_mapped_deinit(srv_mapped *mapped) {
  pthread_mutex_lock(&mapped->lock);
  mapped->is_closing = true;
  pthread_cond_signal(&mapped->wake);
  pthread_mutex_unlock(&mapped->lock);
  if (mapped->is_started) pthread_join(mapped->thread, NULL);
  pthread_mutex_destroy(&mapped->lock);
  pthread_cond_destroy(&mapped->wake);
}

static void link_mapping(srv_mapped *mapped, srv_mapping *mapping) {
  pthread_mutex_lock(&mapped->lock);
  mapping->next = mapped->first;
  mapping->link = &mapped->first;
  if (mapping->next) mapping->next->link = &mapping->next;
  mapped->first = mapping;
  int reason = mapped->is_started ? 0 : pthread_create(&mapped->thread, NULL, watch, mapped);
  mapped->is_started = reason == 0;
  if (!mapping->next) pthread_cond_signal(&mapped->wake);
  pthread_mutex_unlock(&mapped->lock);
  if (reason != 0) srv_log(SRV_LOG_ERROR, "no thread to watch resident memory: %s", strerror(reason));
}

const void *srv_mapped_add(srv_mapped *mapped, srv_mapping *mapping, int file, size_t size) {
  void *start = mmap(NULL, size, PROT_READ, MAP_PRIVATE, file, 0);
  if (start == MAP_FAILED) return NULL;
  *mapping = (srv_mapping){.start = start, .size = size};
  if (mapped) link_mapping(mapped, mapping);
  return start;
}

void srv_mapped_remove(srv_mapped *mapped, srv_mapping *mapping) {
  if (!mapping->start) return;
  if (mapping->link) {
    pthread_mutex_lock(&mapped->lock);
    *mapping->link = mapping->next;
    if (mapping->next) mapping->next->link = mapping->link;
    pthread_mutex_unlock(&mapped->lock);
  }
  munmap(mapping->start, mapping->size);
  *mapping = (srv_mapping){0};
}
