/* The HTTP contract as values: a request in, an answer out. Knows no socket and no file; the server (or a
 * test) supplies storage through api_store and transfers the bytes. */
#ifndef API_H
#define API_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { API_ID_TEXT = 33 }; /* 32 hex digits and a terminator */

#define API_SIZE_UNKNOWN UINT64_MAX

/* A view of bytes, not terminated unless stated. */
typedef struct api_bytes {
  const uint8_t *data;
  size_t size;
} api_bytes;

/* ---- what the host supplies ------------------------------------------------------------------ */

typedef enum api_store_status {
  API_STORE_OK,
  API_STORE_ABSENT,
  API_STORE_DAMAGED, /* the stored bytes are not those put; putting them again repairs the object */
  API_STORE_UNAVAILABLE,
  API_STORE_FULL,   /* only from put and remove: no room is left */
  API_STORE_UNKNOWN /* only from look */
} api_store_status;

/* A stored object, open for reading until it is closed. A concurrent remove or put does not change what it
 * reads. */
typedef struct api_blob {
  uint64_t size;
  void *owner;
  /* Reads `size` bytes from `offset` on; they lie within the object. False when they cannot be read any more:
   * the medium failed, or something other than the store changed or truncated them. One thread at a time. */
  bool (*read)(const struct api_blob *blob, uint64_t offset, uint8_t *out, size_t size);
  void (*close)(struct api_blob *blob);
} api_blob;

/* One object of a listing. */
typedef struct api_listed {
  char id[API_ID_TEXT];
  uint64_t size;
  char *summary; /* the text given to put, malloc'ed; NULL when it is lost */
} api_listed;

/* Content-addressed storage: the one vtable of the program. An id is the first 32 hex digits of the SHA-256
 * of the bytes. Every function may be called from many threads at once. All may block but probe, room, and
 * look without may_wait. */
typedef struct api_store {
  void *context;
  /* Stores all bytes or none. API_STORE_OK: the bytes are whole and durable, even where they had been stored
   * before. summary: small JSON text, terminated. *existed: whether the bytes were already stored, and
   * whole. */
  api_store_status (*put)(void *context, const char *id, api_bytes bytes, const char *summary, bool *existed);
  /* API_STORE_OK: *out reads the bytes whose hash is `id`. */
  api_store_status (*open)(void *context, const char *id, api_blob *out);
  /* Whether the object is stored and whole; a check in the last second or so counts. may_wait false:
   * API_STORE_UNKNOWN without such a check. */
  api_store_status (*look)(void *context, const char *id, bool may_wait);
  api_store_status (*remove)(void *context, const char *id);
  /* The summary given to the first put, malloc'ed; NULL when it is lost or the object is absent. */
  char *(*summary)(void *context, const char *id);
  /* Up to `limit` objects with id > after ("" to begin), ascending; *more: whether others follow. */
  api_store_status (*list)(void *context, const char *after, size_t limit, api_listed *out, size_t *count,
                           bool *more);
  /* Whether models can be stored and read; an attempt in the last second or so counts. */
  api_store_status (*probe)(void *context);
  /* API_STORE_FULL: there is no room for an object of `size` bytes, as far as can be told at once. NULL:
   * there always is. */
  api_store_status (*room)(void *context, uint64_t size);
} api_store;

typedef struct api_limits {
  uint64_t max_upload; /* bytes of a body, before and after decoding */
  uint32_t max_level;
  uint64_t max_faces;  /* of one surface */
  uint64_t max_output; /* bytes of one answer */
  uint64_t max_times;  /* of one pose request */
  uint64_t plan_cache; /* bytes of cache entries that no request uses */
  uint64_t max_memory; /* bytes that requests and caches hold together */
  size_t max_waiting;  /* requests that may wait for memory at once */
} api_limits;

/* Runs loops on several threads. run calls part(context, i) once for each i below count, in any order and on
 * any threads, and returns when all these calls have returned; NULL: there are no threads. is_cancelled tells
 * whether the calling thread's request is out of time. Long computations ask it between their steps; a
 * cancelled request is answered with 503. NULL: no request is cancelled. */
typedef struct api_parallel_for {
  void *owner;
  void (*run)(void *owner, uint32_t count, void (*part)(void *context, uint32_t index), void *context);
  bool (*is_cancelled)(void *owner);
} api_parallel_for;

/* The rights of a key, combined by |. */
enum { API_MAY_READ = 1, API_MAY_WRITE = 2, API_MAY_DELETE = 4 };

/* At most `count` requests in `period_s` seconds; count 0: no limit. */
typedef struct api_rate {
  uint32_t count, period_s;
} api_rate;

typedef struct api_key {
  const char *text;
  unsigned rights;
  api_rate rate;
} api_key;

/* Both lists empty: everybody may do everything. */
typedef struct api_keyring {
  const api_key *keys; /* [count]; of equal texts the first counts */
  size_t count;
  const api_key *url_keys; /* [url_count], their texts sign URLs; the first signs new ones */
  size_t url_count;
} api_keyring;

/* What the host prints for /metrics. */
typedef struct api_metrics {
  void *owner;
  char *(*print)(void *owner, size_t *size); /* malloc'ed; NULL without memory */
} api_metrics;

/* A page for browsers, or a script of one, compressed. Outlives the service. */
typedef struct api_page {
  api_bytes gzip;     /* size 0: there is no page */
  api_bytes brotli;   /* size 0: gzip alone */
  const char *hash;   /* differs whenever the bytes differ */
  const char *policy; /* its Content-Security-Policy; NULL: it is a script */
} api_page;

typedef struct api_settings {
  api_limits limits;
  api_store store;
  api_parallel_for parallel;
  api_keyring keyring;
  api_metrics metrics;
  api_page page;            /* at "/" */
  api_page docs;            /* the API reference, at "/docs" */
  api_page example;         /* at "/example.html" */
  api_page viewer;          /* the custom element for other pages, at "/viewer.js" */
  const char *cors_origins; /* a comma-separated list, "*" in it for all, "" for none */
  const char
      *hosts; /* served on loopback listeners besides the machine's own, without ports; else as above */
} api_settings;

/* ---- service: settings and caches, shared by all threads ------------------------------------- */

typedef struct api_service api_service;
api_service *api_service_create(const api_settings *settings); /* copies the settings; NULL without memory */
void api_service_destroy(api_service *service);                /* no request may be running */

/* From here on /readyz answers 503. */
void api_service_drain(api_service *service);

/* What the host holds memory for. */
typedef enum api_held {
  API_HELD_CONNECTION,
  API_HELD_BODY,  /* of requests, while they arrive */
  API_HELD_BLOCK, /* of answers, computed ahead of the client */
  API_HELD_LIVE,  /* of live streams: what their frames are printed from, and frames */
  API_HELD_COUNT
} api_held;

/* Memory that the host holds for requests counts against max_memory too. */
void api_service_hold(api_service *service, api_held what, uint64_t bytes);
void api_service_let_go(api_service *service, api_held what, uint64_t bytes);
/* The same for memory that the host can do without: false when it does not fit. */
bool api_service_try_hold(api_service *service, api_held what, uint64_t bytes);
/* The same for live streams, which last: idle cache entries are evicted for them, but they hold no more than
 * half of max_memory together. May free memory, and wake other requests. */
bool api_service_hold_live(api_service *service, uint64_t bytes);

/* The kinds of cached values. */
typedef enum api_cached {
  API_CACHED_MODEL,
  API_CACHED_PLAN,
  API_CACHED_CLIP,
  API_CACHED_ANSWER,
  API_CACHED_COUNT
} api_cached;

/* For metrics; counts begin with the service. */
typedef struct api_usage {
  struct {
    uint64_t bytes;     /* of idle entries and of those in use */
    uint64_t hits;      /* values found */
    uint64_t misses;    /* values built */
    uint64_t evictions; /* values removed to make room */
  } cached[API_CACHED_COUNT];
  uint64_t held[API_HELD_COUNT]; /* bytes */
  uint64_t granted;              /* bytes granted to requests, in addition */
  uint64_t faces;                /* of surfaces, in proportion to what was read of their answers */
  uint64_t joint_times;          /* nodes evaluated for poses and live frames, counted once for each time */
} api_usage;
void api_service_usage(const api_service *service, api_usage *out); /* any thread */

/* The keys in force at one time; lives as long as the service. */
typedef struct api_keys api_keys;

/* Replaces the keys in force. False without memory: the current keys stay. One thread at a time. */
bool api_service_set_keys(api_service *service, const api_keyring *keyring);
const api_keys *api_service_keys(const api_service *service); /* the keys in force; any thread */

/* ---- one request ----------------------------------------------------------------------------- */

/* What a request waits for, and the memory granted to it. The host zeroes it, but for `wake` and `pauses`,
 * before the request's first call, and ends it by api_ticket_end when the request and its answer are over. */
typedef struct api_ticket {
  /* The wait is over: call api_handle again. Called once for each API_WAITS, on any thread, perhaps before
   * api_handle has returned. Must not block, nor call api functions. */
  void (*wake)(struct api_ticket *ticket);
  /* NULL, or called on the thread of api_handle just before it begins a wait; from then on `wake` may be
   * called at any time. If the wait turns out to be over at once, api_handle continues and `wake` is not
   * called. */
  void (*pauses)(struct api_ticket *ticket);
  /* Private to api from here on. */
  struct api_ticket *previous, *next; /* in the queue for the same entry, or for memory */
  struct api_entry *awaited;          /* a reference: the entry it waits for, or waited for last */
  struct api_entry *promised;         /* the entries that this request has promised to build */
  uint64_t granted, needed;           /* bytes; needed: what it waited for last */
  bool is_waiting_for_memory, is_waiting_for_entry;
  bool is_answered; /* `granted` is the memory of the finished answer */
} api_ticket;

/* Ends a wait from outside (the client is gone, time is up). True: the ticket waited, and `wake` will not be
 * called. False: `wake` has been called, or is about to be. */
bool api_ticket_cancel(api_service *service, api_ticket *ticket);

/* Releases what the ticket holds. Not while it waits. */
void api_ticket_end(api_service *service, api_ticket *ticket);

/* A request as it arrived. All text is as on the wire, terminated, and outlives api_handle. */
typedef struct api_request {
  const char *method;
  const char *path;  /* percent-encoded, without query */
  const char *query; /* without '?', "" when there is none */
  const char *id;    /* X-Request-Id, already validated, or a generated one */
  const char *host;  /* HOST[:PORT] that the request is for; NULL where HTTP/1.0 does not tell */
  /* The value of a header, any case; that of several lines joined by ", ". NULL when absent. */
  const char *(*header)(void *context, const char *name);
  void *context;
  api_ticket *ticket;   /* outlives the answer */
  const api_keys *keys; /* in force when the request arrived; NULL: those in force now */
  uint64_t now_s;       /* Unix time of its arrival */
  bool is_admin;        /* on the listener for probes and metrics, which needs no key */
  bool is_local;        /* on a listener that is bound to a loopback address */
  api_bytes body;       /* complete, still content-encoded */
  bool is_body_mapped;  /* its pages become memory of the process as they are read; else the host counts it */
} api_request;

typedef struct api_header {
  const char *name, *value;
} api_header;

/* Bytes computed when they are read. */
typedef struct api_body {
  uint64_t size; /* API_SIZE_UNKNOWN: until read returns 0 */
  void *context;
  /* The next bytes, at most capacity. 0: the end; -1: the answer must be cut off. */
  int64_t (*read)(void *context, uint8_t *out, size_t capacity);
  void (*destroy)(void *context);
  bool is_slow; /* a read may take longer than an I/O thread may work for one connection */
} api_body;

enum { API_LIVE_STAMP = 40 }; /* bytes of a stamp, at most */

/* A stream of frames: frame n is due n / fps seconds after frame 0. The host has the clock. Its owner
 * destroys it; zeroed: no stream. */
typedef struct api_live {
  const char *key; /* equal keys mean equal frames; lives as long as the context */
  double fps;      /* above 0 */
  uint64_t first;  /* the frame to begin with */
  uint64_t last;   /* the frame to end with; UINT64_MAX: endless */
  bool joins; /* may begin later than `first`: with the frame that is due in a running stream of the same key
               */
  bool has_start;
  double start_ms; /* Unix time of frame 0: begins with the frame that is due then, or waits for frame 0.
                      Needs joins */
  const char *opening, *pulse,
      *closing; /* sent first; when nothing else is due, to keep the connection open; and last */
  void *context;
  uint64_t size, frame_size; /* about the bytes that the context holds, and those of a frame */
  /* The bytes of a frame, malloc'ed for the caller; false without memory. One thread at a time; cheapest in
   * ascending order. */
  bool (*frame)(void *context, uint64_t index, api_bytes *out);
  /* Prints the bytes that follow a frame and tell the Unix time of its sending; returns their number. */
  size_t (*stamp)(uint64_t now_ms, char out[API_LIVE_STAMP]);
  void (*destroy)(void *context);
} api_live;

enum { API_HEADERS_MAX = 24 };

/* Why a valid request is refused. */
typedef enum api_refusal {
  API_REFUSAL_NONE,
  API_REFUSAL_ACCESS, /* its key or its page's origin lacks the right, or its host is not served */
  API_REFUSAL_BODY,   /* it is too long */
  API_REFUSAL_MEMORY,
  API_REFUSAL_STORE, /* the store cannot be reached */
  API_REFUSAL_STORE_FULL,
  API_REFUSAL_COUNT
} api_refusal;

typedef struct api_answer {
  int status;
  api_refusal refusal;
  const char *route; /* api_route_name of the path; NULL: not known, call that function */
  size_t header_count;
  api_header headers[API_HEADERS_MAX]; /* Content-Type and all others but Content-Length, Date, Connection,
                                          X-Request-Id and Server-Timing, which the server adds */
  /* One of three: bytes, which the answer owns (body.read and live.frame are NULL); a body; or frames. The
   * answer to HEAD is filled as for GET: the server sends the size and no content. */
  api_bytes bytes;
  api_body body;
  api_live live; /* the server may move it out of the answer */
  void *memory;  /* what the answer owns */
} api_answer;

/* The stage before the body is read. */
typedef enum api_verdict {
  API_READ_BODY, /* go on: collect up to max_upload bytes, then api_handle */
  API_REFUSED    /* *answer is the refusal (404, 405, 413, 415, 411, 401, 403, pre-flight …) */
} api_verdict;

/* The rate of the request's key; count 0 where it has no configured key. id: receives bytes that identify the
 * key. */
api_rate api_key_rate(const api_service *service, const api_request *request, uint8_t id[16]);

/* Decides on method, path and headers alone. */
api_verdict api_open(api_service *service, const api_request *request, api_answer *answer);

typedef enum api_effort {
  API_LIGHT, /* answers only from memory: parses no model, builds no plan, reads no storage */
  API_LOOK,  /* like API_LIGHT, but may ask the store whether the model is there, which may block briefly */
  API_HEAVY
} api_effort;

typedef enum api_progress {
  API_ANSWERED,        /* *answer is filled */
  API_LOOK_ON_THREAD,  /* the store must be asked whether the model is there: call again with API_LOOK */
  API_AGAIN_ON_THREAD, /* the work is heavy: call again with API_HEAVY, on a thread that may block */
  API_WAITS            /* the ticket will be woken; do not touch the request and the ticket until then */
} api_progress;

/* Answers a request that api_open admitted, or one without a body, which does not need api_open. *answer is
 * left alone unless API_ANSWERED. */
api_progress api_handle(api_service *service, const api_request *request, api_effort effort,
                        api_answer *answer);

/* An error answer in the contract's form, for refusals that the server makes itself (400 for broken
 * framing, 408, 413 while reading, 431, 503 for a full queue). retry_after: seconds, 0 for none. */
void api_problem(int status, const char *detail, const char *request_id, unsigned retry_after,
                 api_answer *answer);

/* The same for a request whose headers are known: with the headers that its answers carry (CORS, Vary). */
void api_refuse(api_service *service, const api_request *request, int status, const char *detail,
                unsigned retry_after, api_answer *answer);

void api_answer_deinit(api_answer *answer); /* a zeroed one is fine */

/* Undoes the percent-encodings of unreserved characters in a path, in place: they change nothing (RFC 3986,
 * 6.2.2.2). For the path of an api_request. */
void api_path_normalize(char *path);

/* The low-cardinality name of a path for logs and metrics, such as "/v1/models/{id}/surface". */
const char *api_route_name(const char *path);

/* The edit distance from name[0..length) to `other`: characters inserted, deleted or replaced, ignoring case.
 * Only the first 63 characters of `other` count. O(length x 64). */
size_t api_name_distance(const char *name, size_t length, const char *other);

/* Stores a model as POST /v1/models would (the sample models at start). Returns the HTTP status. */
int api_seed(api_service *service, const char *name, const uint8_t *bytes, size_t size);

#endif
