/* The HTTP contract as values: a request in, an answer out. Knows no socket and no file; the server
 * (or a test) supplies storage through api_store and moves the bytes. */
#ifndef API_H
#define API_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { API_ID_TEXT = 33 }; /* 32 hex digits and a terminator */

#define API_SIZE_UNKNOWN UINT64_MAX

/* A view of bytes; not terminated unless it says so. */
typedef struct api_bytes {
  const uint8_t *data;
  size_t size;
} api_bytes;

/* ---- what the host supplies ---------------------------------------------------------------- */

typedef enum api_store_status {
  API_STORE_OK,
  API_STORE_ABSENT,
  API_STORE_DAMAGED, /* what is stored is not what was put; a put of the same bytes mends it */
  API_STORE_UNAVAILABLE,
  API_STORE_FULL,   /* of `put` and `remove` alone: there is no room */
  API_STORE_UNKNOWN /* of `look` alone */
} api_store_status;

/* A stored object, open for reading until it is closed. A remove or a put meanwhile does not change it. */
typedef struct api_blob {
  uint64_t size;
  void *owner;
  /* Reads the `size` bytes from `offset` on, which lie within the object. False when they are no longer to be
   * had: the medium failed, or something else than the store changed or cut them. By one thread at a time. */
  bool (*read)(const struct api_blob *blob, uint64_t offset, uint8_t *out, size_t size);
  void (*close)(struct api_blob *blob);
} api_blob;

/* One listed object. */
typedef struct api_listed {
  char id[API_ID_TEXT];
  uint64_t size;
  char *summary; /* as given to put, malloc'ed; NULL when it is lost */
} api_listed;

/* Content-addressed storage: the one vtable of the program. An id is the first 32 hex digits of the SHA-256
 * of the bytes. Every function may be called from many threads at once; all but probe may block. */
typedef struct api_store {
  void *context;
  /* Stores all bytes or nothing; API_STORE_OK: they are whole and durable, also where they were stored
   * before. summary: small JSON text, terminated. *existed: they were there, and whole. */
  api_store_status (*put)(void *context, const char *id, api_bytes bytes, const char *summary, bool *existed);
  /* API_STORE_OK: *out has the bytes of which `id` is the hash. */
  api_store_status (*open)(void *context, const char *id, api_blob *out);
  /* Whether the object is there and whole, as a look of the last second or so found. may_wait false:
   * API_STORE_UNKNOWN where nobody has looked of late. */
  api_store_status (*look)(void *context, const char *id, bool may_wait);
  api_store_status (*remove)(void *context, const char *id);
  /* The summary of the first put, malloc'ed; NULL when it is lost, or the object is not there. */
  char *(*summary)(void *context, const char *id);
  /* Up to `limit` objects with id > after ("" for the first), ascending; *more: others follow. */
  api_store_status (*list)(void *context, const char *after, size_t limit, api_listed *out, size_t *count,
                           bool *more);
  /* Whether models can be stored and read, as a try of the last second or so found. */
  api_store_status (*probe)(void *context);
} api_store;

typedef struct api_limits {
  uint64_t max_upload; /* bytes of a body, before and after decoding */
  uint32_t max_level;
  uint64_t max_faces;  /* of one surface */
  uint64_t max_output; /* bytes of one answer */
  uint64_t max_times;  /* of one pose request */
  uint64_t plan_cache; /* bytes of cached models, plans and clips that no request uses */
  uint64_t max_memory; /* bytes that requests and caches hold together */
  size_t max_waiting;  /* requests that may wait for memory at once */
} api_limits;

/* How loops are shared among threads: run calls part(context, i) once for each i below count, in any order
 * and on any threads, and returns when all calls have. run NULL: there are no threads. is_cancelled: whether
 * the request that the thread works on has had its time, asked between the steps of what takes long: its
 * answer is 503 then. NULL: none ever has. */
typedef struct api_parallel_for {
  void *owner;
  void (*run)(void *owner, uint32_t count, void (*part)(void *context, uint32_t index), void *context);
  bool (*is_cancelled)(void *owner);
} api_parallel_for;

/* What a key allows; added up. */
enum { API_MAY_READ = 1, API_MAY_WRITE = 2, API_MAY_DELETE = 4 };

/* So many requests in so many seconds; count 0: any number. */
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
  const api_key *keys; /* [count]; of a text given twice the first counts */
  size_t count;
  const api_key *url_keys; /* [url_count], whose texts sign URLs; the first one makes new signatures */
  size_t url_count;
} api_keyring;

/* What the host prints for /metrics. */
typedef struct api_metrics {
  void *owner;
  char *(*print)(void *owner, size_t *size); /* malloc'ed; NULL without memory */
} api_metrics;

/* The page at "/": HTML, coded by gzip. It lives as long as the service. */
typedef struct api_page {
  api_bytes gzip;     /* size 0: there is no page */
  const char *hash;   /* tells these bytes from others */
  const char *policy; /* its Content-Security-Policy */
} api_page;

typedef struct api_settings {
  api_limits limits;
  api_store store;
  api_parallel_for parallel;
  api_keyring keyring;
  api_metrics metrics;
  api_page page;
  const char *cors_origins; /* a comma-separated list, "*" in it for all, "" for none */
} api_settings;

/* ---- service: settings and caches, shared by all threads ------------------------------------ */

typedef struct api_service api_service;
api_service *api_service_create(const api_settings *settings); /* copies; NULL without memory */
void api_service_destroy(api_service *service);                /* no request may be under way */

/* While draining /readyz answers 503. */
void api_service_drain(api_service *service);

/* What the host holds memory for. */
typedef enum api_held {
  API_HELD_CONNECTION,
  API_HELD_BODY,  /* of requests, as they arrive */
  API_HELD_BLOCK, /* of answers, ahead of their readers */
  API_HELD_COUNT
} api_held;

/* Memory that the host holds for requests counts against max_memory too. */
void api_service_hold(api_service *service, api_held what, uint64_t bytes);
void api_service_let_go(api_service *service, api_held what, uint64_t bytes);
/* The same for what can be done without: false when it does not fit. */
bool api_service_try_hold(api_service *service, api_held what, uint64_t bytes);

/* What is kept between requests. */
typedef enum api_cached {
  API_CACHED_MODEL,
  API_CACHED_PLAN,
  API_CACHED_CLIP,
  API_CACHED_ANSWER,
  API_CACHED_COUNT
} api_cached;

/* For metrics; counts are those since the start. */
typedef struct api_usage {
  struct {
    uint64_t bytes;     /* kept, or in use by requests */
    uint64_t hits;      /* values that were there */
    uint64_t misses;    /* values that were made */
    uint64_t evictions; /* values that went to make room */
  } cached[API_CACHED_COUNT];
  uint64_t held[API_HELD_COUNT]; /* bytes */
  uint64_t granted;              /* bytes that requests under way may use beside */
  uint64_t faces;                /* of surfaces, as far as their answers were read */
  uint64_t joint_times;          /* nodes of poses and live frames, each at one time */
} api_usage;
void api_service_usage(const api_service *service, api_usage *out); /* any thread */

/* Keys that were in force at a time; they live as long as the service. */
typedef struct api_keys api_keys;

/* Puts other keys in force, as in api_settings. False without memory: then the present ones stay. One thread
 * at a time. */
bool api_service_set_keys(api_service *service, const api_keyring *keyring);
const api_keys *api_service_keys(const api_service *service); /* those in force; any thread */

/* ---- one request ----------------------------------------------------------------------------- */

/* What a request waits for, and the memory that is granted to it. Zeroed but for `wake` and `pauses` before
 * the request's first call; given back by api_ticket_end, when the request and its answer are over. */
typedef struct api_ticket {
  /* What the request waited for is there: call api_handle again. Called once for each API_WAITS, on any
   * thread, perhaps before api_handle has returned; must not block, nor call back into api. */
  void (*wake)(struct api_ticket *ticket);
  /* May be NULL. The call is about to begin a wait; after it `wake` may be called at any time. On the thread
   * of the call. A wait that is over at once goes on in the same call. */
  void (*pauses)(struct api_ticket *ticket);
  /* The rest is api's. */
  struct api_ticket *previous, *next; /* among those that wait for the same */
  struct api_entry *awaited;          /* held: what it waits or waited for */
  struct api_entry *promised;         /* what others wait for this request to make */
  uint64_t granted, needed;           /* bytes; needed: waited for last */
  bool is_waiting_for_memory, is_waiting_for_entry;
  bool is_answered; /* `granted` is what the answer holds */
} api_ticket;

/* Ends a wait from outside (the client is gone, time is up). True when the ticket waited: it will not be
 * woken any more. False: it has been woken, or is about to be. */
bool api_ticket_cancel(api_service *service, api_ticket *ticket);

/* Gives back what the ticket holds. Not while it waits. */
void api_ticket_end(api_service *service, api_ticket *ticket);

/* What arrived. All text is as it came over the wire, terminated, and outlives api_handle. */
typedef struct api_request {
  const char *method;
  const char *path;  /* percent-encoded, without query */
  const char *query; /* without '?', "" when there is none */
  const char *id;    /* X-Request-Id, already checked or made up */
  /* First value of a header, any case; NULL when absent. */
  const char *(*header)(void *context, const char *name);
  void *context;
  api_ticket *ticket;   /* outlives the answer */
  const api_keys *keys; /* in force when it came; NULL: those in force now */
  uint64_t now_s;       /* Unix time when it came */
  bool is_admin;        /* on the listener for probes and metrics, which asks for no key */
  api_bytes body;       /* complete, still content-encoded */
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
} api_body;

enum { API_LIVE_STAMP = 40 }; /* bytes of a stamp, at most */

/* Frames that are sent as their time comes, frame n at n / fps seconds after frame 0. Knows no clock. Whoever
 * holds one destroys it; a zeroed one is none. */
typedef struct api_live {
  const char *key; /* equal keys mean equal frames; lives as long as the context */
  double fps;      /* above 0 */
  uint64_t first;  /* the frame to begin with */
  uint64_t last;   /* the frame to end with; UINT64_MAX: endless */
  bool joins;      /* begins with a later frame where others of the key have got that far */
  bool has_start;
  double start_ms; /* Unix time of frame 0: begins with the frame that is due, or waits. Goes with joins */
  const char *opening, *pulse, *closing; /* sent first, when nothing else is to be sent, and at the end */
  void *context;
  /* The bytes of a frame, malloc'ed for the caller; false without memory. By one thread at a time, and
   * cheapest in ascending order. */
  bool (*frame)(void *context, uint64_t index, api_bytes *out);
  /* Prints what follows a frame's bytes when it is sent, at that Unix time; returns how many bytes. */
  size_t (*stamp)(uint64_t now_ms, char out[API_LIVE_STAMP]);
  void (*destroy)(void *context);
} api_live;

enum { API_HEADERS_MAX = 24 };

/* Why a request is turned away that is not wrong in itself. */
typedef enum api_refusal {
  API_REFUSAL_NONE,
  API_REFUSAL_ACCESS, /* by its key, or by the page that it comes from */
  API_REFUSAL_BODY,   /* too long */
  API_REFUSAL_MEMORY,
  API_REFUSAL_STORE, /* cannot be reached */
  API_REFUSAL_STORE_FULL,
  API_REFUSAL_COUNT
} api_refusal;

typedef struct api_answer {
  int status;
  api_refusal refusal;
  const char *route; /* what api_route_name says of the path; NULL: ask it */
  size_t header_count;
  api_header headers[API_HEADERS_MAX]; /* Content-Type and all others but Content-Length, Date, Connection,
                                          X-Request-Id and Server-Timing, which the server adds */
  /* Either bytes (body.read and live.frame NULL), which live as long as the answer, or a body, or frames.
   * HEAD gives what GET would: the server sends the size and none of it. */
  api_bytes bytes;
  api_body body;
  api_live live; /* the server may take it out of the answer */
  void *memory;  /* what the answer owns */
} api_answer;

/* The stage before the body is read. */
typedef enum api_verdict {
  API_READ_BODY, /* go on: collect up to max_upload bytes, then api_handle */
  API_REFUSED    /* *answer is the refusal (404, 405, 413, 415, 411, 401, 403, pre-flight …) */
} api_verdict;

/* The rate of the configured key that the request bears, count 0 where there is none; id: gets what tells the
 * key from others. */
api_rate api_key_rate(const api_service *service, const api_request *request, uint8_t id[16]);

/* Decides on method, path and headers alone. */
api_verdict api_open(api_service *service, const api_request *request, api_answer *answer);

typedef enum api_effort {
  API_LIGHT, /* may answer only from what is at hand: no parsing of models, no plan, no storage */
  API_LOOK,  /* the same, and looks whether the model is stored, which may block a little */
  API_HEAVY
} api_effort;

typedef enum api_progress {
  API_ANSWERED,        /* *answer is filled */
  API_LOOK_ON_THREAD,  /* nobody has looked of late whether the model is stored: call again with API_LOOK */
  API_AGAIN_ON_THREAD, /* the work is heavy: call again with API_HEAVY on a thread that may take its time */
  API_WAITS            /* the ticket will be woken; until then request and ticket are not to be touched */
} api_progress;

/* Answers a request that api_open let through, or one without a body, which needs no opening. The answer is
 * left alone unless API_ANSWERED. */
api_progress api_handle(api_service *service, const api_request *request, api_effort effort,
                        api_answer *answer);

/* An error answer in the contract's form, for refusals that the server makes itself (400 for broken
 * framing, 408, 413 while reading, 431, 503 for a full queue). retry_after: seconds, 0 for none. */
void api_problem(int status, const char *detail, const char *request_id, unsigned retry_after,
                 api_answer *answer);

/* The same for a request whose headers are there, with the fields that its answers bear (CORS, Vary). */
void api_refuse(api_service *service, const api_request *request, int status, const char *detail,
                unsigned retry_after, api_answer *answer);

void api_answer_deinit(api_answer *answer); /* a zeroed one is fine */

/* The low-cardinality name of a path for logs and metrics, as "/v1/models/{id}/surface". */
const char *api_route_name(const char *path);

/* How many characters are put in, left out or exchanged from name[0..length) to `other`, without regard to
 * case. Of `other` the first 63 count. O(length x 64). */
size_t api_name_distance(const char *name, size_t length, const char *other);

/* Stores a model as POST /v1/models would (the sample models at start). Returns the HTTP status. */
int api_seed(api_service *service, const char *name, const uint8_t *bytes, size_t size);

#endif
