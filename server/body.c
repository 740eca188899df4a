/* The buffer in memory doubles up to SPOOL_FROM, so that a connection makes the daemon hold at most twice the
 * bytes that have arrived, or FIRST_CAPACITY. Longer bodies are kept in a file, and shorter ones too while
 * all buffers together have as much as they may: clients that send slowly could fill any memory. */
#include "body.h"

#include "disk.h"

#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

enum { FIRST_CAPACITY = 16 << 10, SPOOL_FROM = 1 << 20 };

void srv_body_init(srv_body *body, uint64_t limit, srv_spool *spool) {
  *body = (srv_body){.limit = limit, .spool = spool};
}

static void free_memory(srv_body *body) {
  if (body->capacity > 0) atomic_fetch_sub(&body->spool->memory, body->capacity);
  free(body->memory);
  body->memory = NULL;
  body->capacity = 0;
}

void srv_body_deinit(srv_body *body) {
  free_memory(body);
  if (body->spooled) {
    if (body->mapping) munmap(body->mapping, (size_t)body->size);
    close(body->file);
  }
  if (body->taken > 0) atomic_fetch_sub(&body->spool->used, body->taken);
  *body = (srv_body){0};
}

/* Reserves the spool bytes that a body of this size needs beyond those it has. CROWDED: other bodies have
 * them. */
static srv_body_status take(srv_body *body, uint64_t size) {
  if (size <= body->taken) return SRV_BODY_OK;
  srv_spool *spool = body->spool;
  uint64_t more = size - body->taken, used = atomic_load(&spool->used);
  if (!srv_disk_has_room(spool->folder, spool->min_free, more)) return SRV_BODY_NO_DISK;
  do {
    if (spool->limit > 0 && more > spool->limit - used) return SRV_BODY_CROWDED;
  } while (!atomic_compare_exchange_weak(&spool->used, &used, used + more));
  body->taken = size;
  return SRV_BODY_OK;
}

srv_body_status srv_body_expect(srv_body *body, uint64_t size) {
  return size > SPOOL_FROM ? take(body, size) : SRV_BODY_OK;
}

/* Moves the bytes in memory to a file. */
static bool spool(srv_body *body) {
  int file = srv_create_nameless(body->spool->folder);
  if (file < 0) return false;
  body->file = file;
  body->spooled = true;
  if (!srv_write_all(file, body->memory, (size_t)body->size)) return false;
  free_memory(body);
  return true;
}

/* Counts a buffer that grows. Every body may have its first one. */
static bool count_memory(srv_body *body, size_t capacity) {
  srv_spool *spool = body->spool;
  uint64_t more = capacity - body->capacity, before = atomic_fetch_add(&spool->memory, more);
  if (spool->memory_limit == 0 || body->capacity == 0 || before + more <= spool->memory_limit) return true;
  atomic_fetch_sub(&spool->memory, more);
  return false;
}

/* Makes room in memory. size: at most SPOOL_FROM. False: the body has to go to a file. */
static bool reserve(srv_body *body, size_t size) {
  if (size <= body->capacity) return true;
  size_t capacity = body->capacity > 0 ? body->capacity : FIRST_CAPACITY;
  while (capacity < size) capacity *= 2;
  if (!count_memory(body, capacity)) return false;
  uint8_t *memory = realloc(body->memory, capacity);
  if (!memory) {
    atomic_fetch_sub(&body->spool->memory, capacity - body->capacity);
    return false;
  }
  body->memory = memory;
  body->capacity = capacity;
  return true;
}

static srv_body_status append_file(srv_body *body, const void *data, size_t size) {
  srv_body_status status = take(body, body->size + size);
  if (status != SRV_BODY_OK) return status;
  if (!body->spooled && !spool(body)) return SRV_BODY_FAILED;
  return srv_write_all(body->file, data, size) ? SRV_BODY_OK : SRV_BODY_FAILED;
}

srv_body_status srv_body_append(srv_body *body, const void *data, size_t size) {
  if (size > body->limit - body->size) return SRV_BODY_TOO_LONG;
  if (size == 0) return SRV_BODY_OK;
  uint64_t whole = body->size + size;
  bool is_long = body->spooled || whole > SPOOL_FROM || !reserve(body, (size_t)whole);
  srv_body_status status = is_long ? append_file(body, data, size) : SRV_BODY_OK;
  if (status != SRV_BODY_OK) return status;
  if (!is_long) memcpy(body->memory + body->size, data, size);
  body->size += size;
  return SRV_BODY_OK;
}

srv_body_status srv_body_view(srv_body *body, api_bytes *out) {
  if (body->spooled && !body->mapping) {
    if (body->size > SIZE_MAX) return SRV_BODY_FAILED;
    /* The file has no name, so nobody can truncate it under the mapping; all its blocks have been written. */
    void *start = mmap(NULL, (size_t)body->size, PROT_READ, MAP_PRIVATE, body->file, 0);
    if (start == MAP_FAILED) return SRV_BODY_FAILED;
    body->mapping = start;
  }
  const void *bytes = body->spooled ? body->mapping : body->memory;
  *out = (api_bytes){body->size > 0 ? bytes : "", (size_t)body->size};
  return SRV_BODY_OK;
}
