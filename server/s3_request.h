/* Requests to a bucket of an S3-compatible store: signed, bounded in time, tried again where that may help.
 */
#ifndef SRV_S3_REQUEST_H
#define SRV_S3_REQUEST_H

#include "config.h"

#include <stdatomic.h>

/* A bucket: where it is, who signs, and the connections that are kept. */
typedef struct srv_s3 srv_s3;

/* Reads s3://BUCKET/PREFIX of --data and the other settings; asks nobody. NULL with one line in error. */
srv_s3 *srv_s3_open(const srv_config *config, srv_error *error);
void srv_s3_close(srv_s3 *s3); /* NULL accepted */

/* The prefix of all keys, "" or with a '/' at its end; lives as long as the bucket. */
const char *srv_s3_prefix(const srv_s3 *s3);

typedef enum srv_s3_method { SRV_S3_HEAD, SRV_S3_GET, SRV_S3_PUT, SRV_S3_DELETE } srv_s3_method;

typedef struct srv_s3_request {
  srv_s3_method method;
  const char *key;          /* below the prefix; NULL: the bucket itself */
  const char *query;        /* sorted, percent-encoded with digits in upper case; NULL: none */
  api_bytes body;           /* of PUT */
  const char *summary;      /* of PUT: stored beside the bytes, unless it is too long for that. May be NULL */
  bool is_new;              /* of PUT: only where nothing has the key, else 412 */
  uint64_t timeout_ms;      /* for all tries together */
  const atomic_bool *stops; /* true: the tries that are left would be in vain. NULL: never */
  /* Takes the bytes of a successful answer: those that begin at `offset`, each once and in order, but that
   * `offset` 0 begins anew. False: enough. NULL: they are dropped. */
  bool (*take)(void *context, uint64_t offset, const uint8_t *data, size_t size);
  void *context;
} srv_s3_request;

enum { SRV_S3_ETAG_SIZE = 128 };

typedef struct srv_s3_answer {
  int status;    /* of HTTP; 0: there is none */
  uint64_t size; /* of the object */
  char etag[SRV_S3_ETAG_SIZE];
  char *summary;    /* malloc'ed; NULL without one */
  srv_error reason; /* where the status is not 2xx, for the log */
  char code[64];    /* the store's word for it, "" without one */
} srv_s3_answer;

/* Sends and waits for the answer. answer: summary is to be freed. */
void srv_s3_send(srv_s3 *s3, const srv_s3_request *request, srv_s3_answer *answer);

/* How many tries were not the first ones. */
uint64_t srv_s3_retries(const srv_s3 *s3);

#endif
