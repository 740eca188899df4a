/* The buffer in memory doubles up to SPOOL_FROM, so that a connection makes the daemon hold at most twice the
 * bytes that have arrived, or FIRST_CAPACITY. Longer bodies are kept in a file. */
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

void srv_body_deinit(srv_body *body) {
  free(body->memory);
  if (body->mapping) munmap(body->mapping, (size_t)body->size);
  if (body->spooled) close(body->file);
  if (body->taken > 0) atomic_fetch_sub(&body->spool->used, body->taken);
  *body = (srv_body){0};
}

/* Reserves the spool bytes that a body of this size needs beyond those it has. CROWDED: other bodies have
 * them. */
static srv_body_status take(srv_body *body, uint64_t size) {
  if (size <= SPOOL_FROM || size <= body->taken) return SRV_BODY_OK;
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
  return take(body, size);
}

/* Moves the bytes in memory to a file. */
static bool spool(srv_body *body) {
  int file = srv_create_nameless(body->spool->folder);
  if (file < 0) return false;
  body->file = file;
  body->spooled = true;
  if (!srv_write_all(file, body->memory, (size_t)body->size)) return false;
  free(body->memory);
  body->memory = NULL;
  body->capacity = 0;
  return true;
}

/* size is at most SPOOL_FROM. */
static bool reserve(srv_body *body, size_t size) {
  if (size <= body->capacity) return true;
  size_t capacity = body->capacity > 0 ? body->capacity : FIRST_CAPACITY;
  while (capacity < size) capacity *= 2;
  uint8_t *memory = realloc(body->memory, capacity);
  if (!memory) return false;
  body->memory = memory;
  body->capacity = capacity;
  return true;
}

static bool append_memory(srv_body *body, const void *data, size_t size) {
  if (size == 0) return true;
  if (!reserve(body, (size_t)body->size + size)) return false;
  memcpy(body->memory + body->size, data, size);
  return true;
}

srv_body_status srv_body_append(srv_body *body, const void *data, size_t size) {
  if (size > body->limit - body->size) return SRV_BODY_TOO_LONG;
  srv_body_status status = take(body, body->size + size);
  if (status != SRV_BODY_OK) return status;
  if (!body->spooled && body->size + size > SPOOL_FROM && !spool(body)) return SRV_BODY_FAILED;
  if (!(body->spooled ? srv_write_all(body->file, data, size) : append_memory(body, data, size)))
    return SRV_BODY_FAILED;
  body->size += size;
  return SRV_BODY_OK;
}

srv_body_status srv_body_view(srv_body *body, api_bytes *out) {
  if (body->spooled && !body->mapping) {
    if (body->size > SIZE_MAX) return SRV_BODY_FAILED;
    /* The file has no name, so nobody can truncate it under the mapping; all its blocks have been written. */
    void *mapping = mmap(NULL, (size_t)body->size, PROT_READ, MAP_PRIVATE, body->file, 0);
    if (mapping == MAP_FAILED) return SRV_BODY_FAILED;
    body->mapping = mapping;
  }
  const void *bytes = body->spooled ? body->mapping : body->memory;
  *out = (api_bytes){body->size > 0 ? bytes : "", (size_t)body->size};
  return SRV_BODY_OK;
}
