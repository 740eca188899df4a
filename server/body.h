/* A request body as it arrives: in memory while it is small, then in a file without a name. */
#ifndef SRV_BODY_H
#define SRV_BODY_H

#include "api.h"

#include <stdatomic.h>

typedef enum srv_body_status {
  SRV_BODY_OK,
  SRV_BODY_TOO_LONG, /* over the limit */
  SRV_BODY_CROWDED,  /* other bodies leave no room in the spool */
  SRV_BODY_NO_DISK,  /* less disk than the spool's min_free would stay free */
  SRV_BODY_FAILED    /* no memory or no disk */
} srv_body_status;

/* Where all threads keep long bodies, and what all bodies take. */
typedef struct srv_spool {
  const char *folder;        /* path, not owned */
  uint64_t limit;            /* bytes of all bodies together, 0: no limit */
  uint64_t min_free;         /* as in srv_disk_has_room */
  atomic_uint_fast64_t used; /* includes bytes that are expected and have not arrived */
  uint64_t memory_limit; /* bytes that bodies have in memory; further ones go to files early; 0: no limit */
  atomic_uint_fast64_t memory;
} srv_spool;

/* A value that stays where it is; a zeroed one may be deinited. */
typedef struct srv_body {
  uint64_t limit;
  srv_spool *spool; /* not owned */
  uint64_t taken;   /* bytes reserved in the spool */
  uint64_t size;
  uint8_t *memory; /* NULL once spooled */
  size_t capacity;
  int file; /* valid when spooled */
  bool spooled;
  void *mapping; /* [size], or NULL */
} srv_body;

/* limit: bytes, at most. spool: outlives the body. */
void srv_body_init(srv_body *body, uint64_t limit, srv_spool *spool);
void srv_body_deinit(srv_body *body);

/* Reserves spool bytes for a body of known size. Call before the first byte. OK, CROWDED or NO_DISK. */
srv_body_status srv_body_expect(srv_body *body, uint64_t size);

/* After any status but SRV_BODY_OK, only srv_body_deinit may be called. */
srv_body_status srv_body_append(srv_body *body, const void *data, size_t size);

/* The whole body, valid until srv_body_deinit. Call once everything has been appended. */
srv_body_status srv_body_view(srv_body *body, api_bytes *out);

#endif
