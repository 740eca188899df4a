/* A request body as it arrives: in memory while it is small, then in a file without a name. */
#ifndef SRV_BODY_H
#define SRV_BODY_H

#include "api.h"

typedef enum srv_body_status {
  SRV_BODY_OK,
  SRV_BODY_TOO_LONG, /* over the limit */
  SRV_BODY_FAILED    /* no memory or no disk */
} srv_body_status;

/* A value; a zeroed one may be deinited. */
typedef struct srv_body {
  uint64_t limit;
  const char *folder; /* where the file would be, not owned */
  uint64_t size;
  uint8_t *memory; /* NULL once spooled */
  size_t capacity;
  int file; /* valid when spooled */
  bool spooled;
  void *mapping;
} srv_body;

/* limit: most bytes to take. folder: path of the folder for long bodies, which outlives the body. */
void srv_body_init(srv_body *body, uint64_t limit, const char *folder);
void srv_body_deinit(srv_body *body);

/* After anything but SRV_BODY_OK only deinit may follow. */
srv_body_status srv_body_append(srv_body *body, const void *data, size_t size);

/* The whole body, valid until deinit; call once all has been appended. */
srv_body_status srv_body_view(srv_body *body, api_bytes *out);

#endif
