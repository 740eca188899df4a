/* Requests to a bucket of an S3-compatible store: signed, limited in time, and tried again where that may
 * help. */
#ifndef SRV_S3_REQUEST_H
#define SRV_S3_REQUEST_H

#include "config.h"

#include <stdatomic.h>

/* A bucket: its URL, its credentials and its idle connections. */
typedef struct srv_s3 srv_s3;

/* Reads s3://BUCKET/PREFIX from --data, and the other settings and credentials; sends no request. NULL with
 * one line in error. */
srv_s3 *srv_s3_open(const srv_config *config, srv_error *error);
void srv_s3_close(srv_s3 *s3); /* NULL accepted */

/* The prefix of all keys, "" or with a final '/'; lives as long as the bucket. */
const char *srv_s3_prefix(const srv_s3 *s3);

typedef enum srv_s3_method { SRV_S3_HEAD, SRV_S3_GET, SRV_S3_PUT, SRV_S3_DELETE } srv_s3_method;

typedef struct srv_s3_request {
  srv_s3_method method;
  const char *key;          /* without the prefix; NULL: the bucket itself */
  const char *query;        /* sorted, percent-encoded with upper-case digits; NULL: none */
  api_bytes body;           /* of PUT */
  const char *summary;      /* of PUT: stored as metadata unless too long. May be NULL */
  bool is_new;              /* of PUT: fails with 412 when the key exists */
  uint64_t timeout_ms;      /* for all tries together */
  const atomic_bool *stops; /* true: make no further try. May be NULL */
  /* Receives the bytes of a successful answer: `data` begins at `offset`. Pieces come in order, each once,
   * except that offset 0 starts again. Returns false to stop. NULL: the bytes are dropped. */
  bool (*take)(void *context, uint64_t offset, const uint8_t *data, size_t size);
  void *context;
} srv_s3_request;

enum { SRV_S3_ETAG_SIZE = 128 };

typedef struct srv_s3_answer {
  int status;    /* HTTP status; 0: no answer */
  uint64_t size; /* of the object */
  char etag[SRV_S3_ETAG_SIZE];
  char *summary;    /* malloc'ed; NULL without one */
  srv_error reason; /* for the log, when the status is not 2xx */
  char code[64];    /* the store's error code, "" without one */
} srv_s3_answer;

/* Sends the request and waits for the answer. The caller frees answer->summary. */
void srv_s3_send(srv_s3 *s3, const srv_s3_request *request, srv_s3_answer *answer);

/* How many tries were repetitions. */
uint64_t srv_s3_retries(const srv_s3 *s3);

#endif
