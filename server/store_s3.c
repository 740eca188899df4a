/* Layout of the bucket, below the prefix:
 *   objects/ab/ID   the bytes of a model; ab begins ID. The metadata `summary` is the model's summary,
 *                   percent-encoded
 *
 * A store writes an object whole or not at all. An object is replaced only where it is damaged. When several
 * daemons store the same model at once, If-None-Match lets one of them write it; in a store that does not
 * know If-None-Match each writes the same bytes.
 *
 * An object is whole when the hash of its bytes is its ID. This daemon hashes an object once for each ETag:
 * when it stores the object, or when it first reads it; without ETags, whenever it looks at a known object.
 * Copies on the local disk are compared with their own hash; a copy as long as its object is served in place
 * of it.
 *
 * When the bucket fails, requests stop asking it, and a thread tries it once a second until it answers. So an
 * outage holds up only those requests that were waiting for the bucket when it began. Until its end models
 * that have a copy are served from it, and all other requests get API_STORE_UNAVAILABLE at once. */
#include "store_s3.h"

#include "body.h"
#include "log.h"
#include "machine.h"
#include "s3_list.h"
#include "store_verdicts.h"

#include <nettle/base16.h>
#include <nettle/md5.h>
#include <nettle/sha2.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum { KEY_SIZE = 64, PAGE_MAX = 1000, READERS = 16 };

static const uint64_t SHORT_MS = 8000, TRY_MS = 5000;

struct srv_store_s3 {
  srv_s3 *s3;
  char *place;           /* "s3://BUCKET/PREFIX", for the log */
  const char *temporary; /* folder for objects that are being received */
  uint64_t timeout_ms;   /* for reading or storing a model */
  srv_disk_cache *cache;
  srv_verdicts *verdicts;
  atomic_bool is_plain;    /* the store knows no If-None-Match */
  atomic_bool is_down;     /* changed only with the lock held */
  atomic_bool was_reached; /* has answered at least once */
  pthread_t watcher;       /* valid with is_watched */
  pthread_mutex_t lock;    /* guards the members below */
  pthread_cond_t wake;
  bool is_watched, is_closing;
};

static void print_key(const char *id, char key[KEY_SIZE]) {
  snprintf(key, KEY_SIZE, "objects/%.2s/%s", id, id);
}

/* ---- outages --------------------------------------------------------------------------------- */

/* A `take` that ends a listing at its first key. */
static bool is_enough(void *context, const char *key, uint64_t size) {
  (void)context, (void)key, (void)size;
  return false;
}

/* Tries the bucket by listing its first key: the cheapest request that needs the rights for listing. */
static bool try_bucket(srv_s3 *s3, srv_s3_answer *answer) {
  atomic_bool is_once = true;
  srv_s3_list(s3, "objects/", "", 1, TRY_MS, &is_once, is_enough, NULL, answer);
  return answer->status == 200;
}

static void *watch(void *context) {
  srv_store_s3 *store = context;
  pthread_mutex_lock(&store->lock);
  while (!store->is_closing) {
    if (!atomic_load(&store->is_down)) {
      pthread_cond_wait(&store->wake, &store->lock);
      continue;
    }
    pthread_mutex_unlock(&store->lock);
    srv_s3_answer answer;
    bool is_reached = try_bucket(store->s3, &answer);
    pthread_mutex_lock(&store->lock);
    if (is_reached) {
      srv_log(SRV_LOG_INFO, "store: %s can be reached again", store->place);
      atomic_store(&store->was_reached, true);
      atomic_store(&store->is_down, false);
    } else if (!store->is_closing) {
      srv_timed_wait(&store->wake, &store->lock, srv_now_ns() + 1000000000);
    }
  }
  pthread_mutex_unlock(&store->lock);
  return NULL;
}

static void note_outage(srv_store_s3 *store, const char *reason) {
  pthread_mutex_lock(&store->lock);
  bool was_down = atomic_exchange(&store->is_down, store->is_watched);
  if (!was_down) srv_log(SRV_LOG_ERROR, "store: %s cannot be used: %s", store->place, reason);
  pthread_cond_signal(&store->wake);
  pthread_mutex_unlock(&store->lock);
}

/* Whether the bucket refuses for a reason that waiting does not remove. */
static bool is_refusal(const srv_s3_answer *answer) {
  return answer->status >= 300 && answer->status < 500 && answer->status != 408 && answer->status != 429;
}

/* The store status of an answer. Logs refusals and notes outages. Frees the answer's summary unless the
 * result is API_STORE_OK. */
static api_store_status judge(srv_store_s3 *store, srv_s3_answer *answer) {
  if (answer->status >= 200 && answer->status < 300) return API_STORE_OK;
  free(answer->summary);
  answer->summary = NULL;
  if (answer->status == 404 && strcmp(answer->code, "NoSuchBucket") != 0) return API_STORE_ABSENT;
  if (answer->status == 507 || strcmp(answer->code, "QuotaExceeded") == 0) {
    srv_log(SRV_LOG_ERROR, "store: %s is full: %s", store->place, answer->reason.text);
    return API_STORE_FULL;
  }
  if (is_refusal(answer))
    srv_log(SRV_LOG_ERROR, "store: %s refuses: %s", store->place, answer->reason.text);
  else
    note_outage(store, answer->reason.text);
  return API_STORE_UNAVAILABLE;
}

/* Sends the request, unless the bucket is known to fail. */
static api_store_status ask(srv_store_s3 *store, srv_s3_request request, srv_s3_answer *answer) {
  *answer = (srv_s3_answer){0};
  if (atomic_load(&store->is_down)) return API_STORE_UNAVAILABLE;
  request.stops = &store->is_down;
  srv_s3_send(store->s3, &request, answer);
  return judge(store, answer);
}

/* Sends a request for the object of a model, without a body in the request or the answer. */
static api_store_status ask_shortly(srv_store_s3 *store, srv_s3_method method, const char *id,
                                    srv_s3_answer *answer) {
  char key[KEY_SIZE];
  print_key(id, key);
  return ask(store, (srv_s3_request){.method = method, .key = key, .timeout_ms = SHORT_MS}, answer);
}

/* Forgets an object that is gone: its copy must not be served either. */
static void forget(srv_store_s3 *store, const char *id) {
  srv_verdicts_forget(store->verdicts, id);
  srv_disk_cache_forget(store->cache, id);
}

/* ---- reading an object whole ----------------------------------------------------------------- */

/* An object that is being received: stored like a request body, and hashed piece by piece. It owns the bytes
 * of a blob and may outlive the store. */
typedef struct arrival {
  srv_spool spool;
  srv_body body;
  api_bytes bytes; /* view of the whole body */
  struct sha256_ctx hash;
  bool has_failed; /* no memory or disk for the body */
} arrival;

/* Receives a piece. Returns true even without memory or disk for it, since the request to the bucket must not
 * fail for that. Offset 0 starts again. */
static bool take_piece(void *context, uint64_t offset, const uint8_t *data, size_t size) {
  arrival *a = context;
  if (offset == 0) {
    srv_body_deinit(&a->body);
    srv_body_init(&a->body, UINT64_MAX, &a->spool);
    sha256_init(&a->hash);
    a->has_failed = false;
  }
  sha256_update(&a->hash, size, data);
  if (!a->has_failed) a->has_failed = srv_body_append(&a->body, data, size) != SRV_BODY_OK;
  return true;
}

static bool read_arrival(const api_blob *blob, uint64_t offset, uint8_t *out, size_t size) {
  const arrival *a = blob->owner;
  memcpy(out, a->bytes.data + offset, size);
  return true;
}

static void close_arrival(api_blob *blob) {
  arrival *a = blob->owner;
  srv_body_deinit(&a->body);
  free(a);
  *blob = (api_blob){0};
}

static api_store_status fail_locally(const char *id) {
  srv_log(SRV_LOG_ERROR, "store: there is no memory or no room in --cache-dir for model %s", id);
  return API_STORE_UNAVAILABLE;
}

static api_store_status receive(srv_store_s3 *store, const char *id, arrival *a) {
  char key[KEY_SIZE];
  srv_s3_answer answer;
  print_key(id, key);
  sha256_init(&a->hash);
  api_store_status status = ask(store,
                                (srv_s3_request){.method = SRV_S3_GET,
                                                 .key = key,
                                                 .timeout_ms = store->timeout_ms,
                                                 .take = take_piece,
                                                 .context = a},
                                &answer);
  if (status == API_STORE_ABSENT) forget(store, id);
  if (status != API_STORE_OK) return status;
  if (a->has_failed || srv_body_view(&a->body, &a->bytes) != SRV_BODY_OK) {
    status = fail_locally(id);
  } else if (!srv_store_is_hash(&a->hash, id)) {
    srv_log(SRV_LOG_ERROR, "store: model %s is damaged: the %zu bytes of its object are not those uploaded",
            id, a->bytes.size);
    forget(store, id);
    srv_verdicts_note(store->verdicts, id, answer.etag, a->bytes.size, SRV_DAMAGED);
    status = API_STORE_DAMAGED;
  } else {
    srv_verdicts_note(store->verdicts, id, answer.etag, a->bytes.size, SRV_WHOLE);
    srv_disk_cache_put(store->cache, id, a->bytes, answer.summary);
  }
  free(answer.summary);
  return status;
}

/* Reads the object, checks its hash and keeps a copy. */
static api_store_status fetch(srv_store_s3 *store, const char *id, api_blob *out) {
  arrival *a = calloc(1, sizeof *a);
  if (!a) return fail_locally(id);
  a->spool.folder = store->temporary;
  api_store_status status = receive(store, id, a);
  api_blob blob = {.size = a->bytes.size, .owner = a, .read = read_arrival, .close = close_arrival};
  if (status == API_STORE_OK)
    *out = blob;
  else
    close_arrival(&blob);
  return status;
}

/* The same, dropping the bytes. */
static api_store_status judge_bytes(srv_store_s3 *store, const char *id) {
  api_blob blob;
  api_store_status status = fetch(store, id, &blob);
  if (status == API_STORE_OK) blob.close(&blob);
  return status;
}

/* ---- looking and opening --------------------------------------------------------------------- */

/* Asks the bucket for the object's ETag. An object that was judged under another ETag is read and judged
 * again: models and plans made from the earlier bytes may be in memory. */
static api_store_status examine(srv_store_s3 *store, const char *id) {
  srv_s3_answer answer;
  api_store_status status = ask_shortly(store, SRV_S3_HEAD, id, &answer);
  if (status == API_STORE_ABSENT) forget(store, id);
  if (status != API_STORE_OK) return status;
  free(answer.summary);
  const srv_verdict known = srv_verdicts_recall(store->verdicts, id);
  if (known.wholeness == SRV_UNJUDGED || srv_verdict_is_of(&known, answer.etag)) {
    if (known.wholeness == SRV_DAMAGED)
      srv_log(SRV_LOG_ERROR,
              "store: model %s is damaged: the %llu bytes of its object are not those uploaded", id,
              (unsigned long long)answer.size);
    srv_verdicts_note(store->verdicts, id, answer.etag, answer.size, known.wholeness);
    return known.wholeness == SRV_DAMAGED ? API_STORE_DAMAGED : API_STORE_OK;
  }
  return judge_bytes(store, id);
}

/* Asks the bucket at most once a second for each model that exists. */
static api_store_status look(void *context, const char *id, bool may_wait) {
  srv_store_s3 *store = context;
  if (!srv_store_is_id(id)) return API_STORE_ABSENT;
  const srv_verdict known = srv_verdicts_recall(store->verdicts, id);
  if (srv_verdict_is_fresh(&known)) return API_STORE_OK;
  if (atomic_load(&store->is_down)) return API_STORE_UNAVAILABLE;
  return may_wait ? examine(store, id) : API_STORE_UNKNOWN;
}

/* Opens the copy on the local disk. While the bucket is reachable, the copy must be as long as the object,
 * which then counts as whole; otherwise any copy with the right hash will do. */
static bool open_copy(srv_store_s3 *store, const char *id, bool is_reachable, api_blob *out) {
  if (!srv_disk_cache_open(store->cache, id, out)) return false;
  const srv_verdict known = srv_verdicts_recall(store->verdicts, id);
  if (is_reachable && known.wholeness == SRV_UNJUDGED) {
    if (known.size != out->size) {
      out->close(out);
      return false;
    }
    srv_verdicts_note(store->verdicts, id, known.state, known.size, SRV_WHOLE);
  }
  return true;
}

static api_store_status open_object(void *context, const char *id, api_blob *out) {
  srv_store_s3 *store = context;
  api_store_status status = look(store, id, true);
  bool is_reachable = status == API_STORE_OK;
  if (!is_reachable && status != API_STORE_UNAVAILABLE) return status;
  if (open_copy(store, id, is_reachable, out)) return API_STORE_OK;
  return is_reachable ? fetch(store, id, out) : API_STORE_UNAVAILABLE;
}

static char *summary_of(void *context, const char *id) {
  srv_store_s3 *store = context;
  srv_s3_answer answer;
  if (!srv_store_is_id(id)) return NULL;
  api_store_status status = ask_shortly(store, SRV_S3_HEAD, id, &answer);
  return status == API_STORE_UNAVAILABLE ? srv_disk_cache_summary(store->cache, id) : answer.summary;
}

/* ---- storing and removing -------------------------------------------------------------------- */

/* Whether an ETag is the MD5 of the bytes, in quotes, as it is for objects stored in one piece and without
 * encryption. */
static bool is_md5_of(const char *etag, api_bytes bytes) {
  struct md5_ctx hash;
  uint8_t digest[MD5_DIGEST_SIZE];
  char text[2 * MD5_DIGEST_SIZE];
  md5_init(&hash);
  md5_update(&hash, bytes.size, bytes.data);
  md5_digest(&hash, sizeof digest, digest);
  base16_encode_update(text, sizeof digest, digest);
  return strlen(etag) == sizeof text + 2 && etag[0] == '"' && etag[sizeof text + 1] == '"' &&
         memcmp(text, etag + 1, sizeof text) == 0;
}

/* Whether the existing object is whole. */
static api_store_status judge_stored(srv_store_s3 *store, const char *id, api_bytes bytes,
                                     const srv_s3_answer *head) {
  const srv_verdict known = srv_verdicts_recall(store->verdicts, id);
  bool is_known = known.wholeness == SRV_WHOLE && srv_verdict_is_of(&known, head->etag);
  if (head->size != bytes.size) return API_STORE_DAMAGED;
  return is_known || is_md5_of(head->etag, bytes) ? API_STORE_OK : judge_bytes(store, id);
}

/* Uploads the object. API_STORE_ABSENT: nothing was written, because another daemon has stored the model
 * meanwhile. */
static api_store_status send_object(srv_store_s3 *store, const char *id, api_bytes bytes, const char *summary,
                                    bool is_new) {
  char key[KEY_SIZE];
  srv_s3_answer answer = {0};
  print_key(id, key);
  srv_s3_request request = {.method = SRV_S3_PUT,
                            .key = key,
                            .body = bytes,
                            .summary = summary,
                            .is_new = is_new && !atomic_load(&store->is_plain),
                            .timeout_ms = store->timeout_ms,
                            .stops = &store->is_down};
  if (atomic_load(&store->is_down)) return API_STORE_UNAVAILABLE;
  srv_s3_send(store->s3, &request, &answer);
  if (answer.status == 501 && request.is_new) {
    srv_log(SRV_LOG_INFO, "store: %s knows no If-None-Match: racing uploads of a model are all stored",
            store->place);
    atomic_store(&store->is_plain, true);
    request.is_new = false;
    srv_s3_send(store->s3, &request, &answer);
  }
  if (answer.status == 412 && request.is_new) return API_STORE_ABSENT;
  api_store_status status = judge(store, &answer);
  free(answer.summary);
  if (status == API_STORE_ABSENT) status = API_STORE_UNAVAILABLE; /* 404 means nothing for PUT */
  if (status == API_STORE_OK) srv_verdicts_note(store->verdicts, id, answer.etag, bytes.size, SRV_WHOLE);
  return status;
}

static api_store_status put(void *context, const char *id, api_bytes bytes, const char *summary,
                            bool *existed) {
  enum { ROUNDS = 4 }; /* another round each time another daemon stores or removes the model meanwhile */
  srv_store_s3 *store = context;
  api_store_status status = API_STORE_UNAVAILABLE;
  if (!srv_store_is_id(id)) return status;
  for (int round = 0; round < ROUNDS; round++) {
    srv_s3_answer head;
    status = ask_shortly(store, SRV_S3_HEAD, id, &head);
    free(head.summary);
    *existed = status == API_STORE_OK;
    if (status == API_STORE_OK) status = judge_stored(store, id, bytes, &head);
    if (status == API_STORE_DAMAGED) {
      *existed = false;
      status = send_object(store, id, bytes, summary, false);
      if (status == API_STORE_OK)
        srv_log(SRV_LOG_WARN, "store: the damaged object of model %s is replaced by a whole one", id);
    } else if (status == API_STORE_ABSENT) {
      *existed = false;
      status = send_object(store, id, bytes, summary, true);
    } else if (status == API_STORE_OK) {
      srv_verdicts_note(store->verdicts, id, head.etag, bytes.size, SRV_WHOLE);
    }
    if (status != API_STORE_ABSENT) break;
  }
  if (status == API_STORE_ABSENT) return API_STORE_UNAVAILABLE;
  if (status == API_STORE_OK) srv_disk_cache_put(store->cache, id, bytes, summary);
  return status;
}

static api_store_status drop(void *context, const char *id) {
  srv_store_s3 *store = context;
  srv_s3_answer answer;
  if (!srv_store_is_id(id)) return API_STORE_ABSENT;
  /* DELETE does not tell whether the object existed. */
  api_store_status status = ask_shortly(store, SRV_S3_HEAD, id, &answer);
  free(answer.summary);
  if (status == API_STORE_OK) {
    status = ask_shortly(store, SRV_S3_DELETE, id, &answer);
    free(answer.summary);
  }
  if (status == API_STORE_OK || status == API_STORE_ABSENT) forget(store, id);
  return status;
}

/* ---- listing --------------------------------------------------------------------------------- */

/* A page of the listing whose summaries are being read. */
typedef struct listing {
  srv_store_s3 *store;
  api_listed *out;
  size_t limit, count;
  bool more;
  atomic_size_t next; /* index of the next summary to read */
} listing;

/* Takes keys of the form "objects/ab/ID"; skips others. */
static bool take_key(void *context, const char *key, uint64_t size) {
  listing *l = context;
  const char *id = strrchr(key, '/');
  char expected[KEY_SIZE];
  if (!id || !srv_store_is_id(id + 1)) return true;
  print_key(id + 1, expected);
  if (strcmp(expected, key) != 0) return true;
  l->more = l->count == l->limit;
  if (l->more) return false;
  l->out[l->count] = (api_listed){.size = size};
  memcpy(l->out[l->count++].id, id + 1, API_ID_TEXT);
  return true;
}

static void *read_summaries(void *context) {
  listing *l = context;
  for (size_t i = atomic_fetch_add(&l->next, 1); i < l->count; i = atomic_fetch_add(&l->next, 1))
    l->out[i].summary = summary_of(l->store, l->out[i].id);
  return NULL;
}

/* Reads the summaries on several threads, each of which mostly waits for the store. */
static void read_all_summaries(listing *l) {
  pthread_t readers[READERS];
  size_t count = 0;
  while (count < READERS && count + 1 < l->count &&
         pthread_create(&readers[count], NULL, read_summaries, l) == 0)
    count++;
  read_summaries(l);
  while (count > 0) pthread_join(readers[--count], NULL);
}

static api_store_status list(void *context, const char *after, size_t limit, api_listed *out, size_t *count,
                             bool *more) {
  srv_store_s3 *store = context;
  if (after[0] != '\0' && !srv_store_is_id(after)) return API_STORE_UNAVAILABLE;
  if (atomic_load(&store->is_down)) return API_STORE_UNAVAILABLE;
  listing l = {.store = store, .out = out, .limit = limit};
  char key[KEY_SIZE] = "";
  srv_s3_answer answer;
  if (after[0] != '\0') print_key(after, key);
  srv_s3_list(store->s3, "objects/", key, limit < PAGE_MAX ? (unsigned)limit + 1 : PAGE_MAX, SHORT_MS,
              &store->is_down, take_key, &l, &answer);
  api_store_status status = judge(store, &answer);
  if (status == API_STORE_ABSENT) status = API_STORE_UNAVAILABLE;
  if (status != API_STORE_OK) return status;
  read_all_summaries(&l);
  *count = l.count;
  *more = l.more;
  return API_STORE_OK;
}

static api_store_status probe(void *context) {
  srv_store_s3 *store = context;
  return atomic_load(&store->was_reached) ? API_STORE_OK : API_STORE_UNAVAILABLE;
}

/* ---- opening and closing the store ----------------------------------------------------------- */

srv_store_s3 *srv_store_s3_open(const srv_config *config, srv_store_fs *folder, srv_error *error) {
  srv_store_s3 *store = calloc(1, sizeof *store);
  srv_fail(error, "out of memory");
  if (!store) return NULL;
  pthread_mutex_init(&store->lock, NULL);
  srv_timed_init(&store->wake);
  store->place = strdup(config->data);
  store->verdicts = srv_verdicts_create();
  store->cache = srv_disk_cache_create(folder, config->cache_dir, config->cache_size);
  store->temporary = srv_store_fs_temporary(folder);
  store->timeout_ms = config->s3_timeout;
  bool has_memory = store->place && store->verdicts && store->cache;
  store->s3 = has_memory ? srv_s3_open(config, error) : NULL;
  srv_s3_answer answer = {0};
  if (!store->s3) {
    srv_store_s3_close(store);
    return NULL;
  }
  bool is_reached = try_bucket(store->s3, &answer);
  if (!is_reached && is_refusal(&answer)) {
    srv_fail(error, "--data: '%s' cannot be used: %s", config->data, answer.reason.text);
    srv_store_s3_close(store);
    return NULL;
  }
  atomic_store(&store->was_reached, is_reached);
  store->is_watched = pthread_create(&store->watcher, NULL, watch, store) == 0;
  if (!is_reached) note_outage(store, answer.reason.text);
  return store;
}

bool srv_store_s3_check(const srv_config *config, srv_error *error) {
  srv_s3 *s3 = srv_s3_open(config, error);
  if (!s3) return false;
  srv_s3_answer answer;
  bool is_reached = try_bucket(s3, &answer);
  if (!is_reached) srv_fail(error, "--data: '%s' cannot be used: %s", config->data, answer.reason.text);
  srv_s3_close(s3);
  return is_reached;
}

void srv_store_s3_close(srv_store_s3 *store) {
  if (!store) return;
  pthread_mutex_lock(&store->lock);
  store->is_closing = true;
  pthread_cond_signal(&store->wake);
  pthread_mutex_unlock(&store->lock);
  /* When its try hangs, the thread is left running, and what it uses is not freed. */
  if (store->is_watched && !srv_join_soon(store->watcher)) return;
  pthread_mutex_destroy(&store->lock);
  pthread_cond_destroy(&store->wake);
  srv_s3_close(store->s3);
  srv_disk_cache_destroy(store->cache);
  srv_verdicts_destroy(store->verdicts);
  free(store->place);
  free(store);
}

srv_store_s3_load srv_store_s3_look(srv_store_s3 *store) {
  return (srv_store_s3_load){!atomic_load(&store->is_down), srv_s3_retries(store->s3),
                             srv_disk_cache_look(store->cache)};
}

api_store srv_store_s3_api(srv_store_s3 *store) {
  return (api_store){.context = store,
                     .put = put,
                     .open = open_object,
                     .look = look,
                     .remove = drop,
                     .summary = summary_of,
                     .list = list,
                     .probe = probe};
}
