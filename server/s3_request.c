/* libcurl signs requests (AWS Signature Version 4) exactly as it sends them, so paths must hold only
 * unreserved characters, and queries must be sorted and encoded.
 *
 * Each try has a time limit for connecting and one for stalling; all tries together have the request's limit.
 * Tried again are connections that fail or break, and the statuses of may_pass. A broken download continues
 * where it broke, as long as the object is the same. The waits between tries are random, so that daemons that
 * failed together do not try again together. */
#include "s3_request.h"

#include "machine.h"
#include "s3_credentials.h"

#include <curl/curl.h>
#include <inttypes.h>
#include <nettle/base16.h>
#include <nettle/sha2.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/random.h>
#include <time.h>

enum {
  BASE_SIZE = 1024,
  URL_SIZE = 16384,
  TRIES = 5,
  WAIT_MS = 100, /* before the second try, at most; doubled each time */
  CONNECT_MS = 3000,
  STILL_S = 5,       /* a try fails when no byte moves for this long */
  CONFIRM_S = 20,    /* the same for uploads: a store confirms a long one only once all of it is safe */
  CONTINUE_MS = 200, /* how long a long upload waits for the store's 100 Continue or refusal */
  KEPT_MAX = 64,     /* idle handles, each with its connection */
  ERROR_MAX = 1024   /* bytes of an error answer that are kept */
};
static const size_t SUMMARY_MAX = 1900; /* S3 allows 2 KB of metadata */

struct srv_s3 {
  char base[BASE_SIZE];   /* URL of the bucket, without a final '/' */
  char prefix[BASE_SIZE]; /* "" or with a final '/' */
  char signing[128];      /* libcurl's parameter "aws:amz:REGION:s3" */
  char *credentials;      /* --s3-credentials */
  const char *ca_file;    /* AWS_CA_BUNDLE, "": the system's */
  pthread_mutex_t lock;
  CURL *kept[KEPT_MAX]; /* idle handles */
  size_t kept_count;
  atomic_uint_fast64_t retries;
};

/* ---- the place ------------------------------------------------------------------------------- */

static const char unreserved_characters[] =
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._~";

static bool is_name(const char *text, size_t size) {
  bool is_dots = (size == 1 && text[0] == '.') || (size == 2 && memcmp(text, "..", 2) == 0);
  return size > 0 && !is_dots && strspn(text, unreserved_characters) >= size;
}

/* Reads "models/today/" from "/models/today/"; false when the text is not a path of names. */
static bool read_prefix(const char *text, char out[BASE_SIZE]) {
  size_t filled = 0;
  out[0] = '\0';
  if (*text == '/') text++;
  while (*text != '\0') {
    size_t size = strcspn(text, "/");
    if (!is_name(text, size) || filled + size + 2 > BASE_SIZE) return false;
    memcpy(out + filled, text, size);
    filled += size;
    out[filled++] = '/';
    out[filled] = '\0';
    text += size;
    if (*text == '/') text++;
  }
  return true;
}

/* Makes the URL of the bucket. bucket: not terminated. */
static bool read_endpoint(const srv_config *config, const char *region, const char *bucket,
                          size_t bucket_size, char out[BASE_SIZE]) {
  char given[BASE_SIZE];
  bool is_default = config->s3_endpoint[0] == '\0';
  int given_size = is_default ? snprintf(given, sizeof given, "https://s3.%s.amazonaws.com", region)
                              : snprintf(given, sizeof given, "%s", config->s3_endpoint);
  if (given_size >= BASE_SIZE) return false;
  size_t scheme = strncmp(given, "https://", 8) == 0 ? 8 : strncmp(given, "http://", 7) == 0 ? 7 : 0;
  size_t host = strlen(given + scheme);
  if (host > 0 && given[scheme + host - 1] == '/') host--;
  if (scheme == 0 || host == 0 || strcspn(given + scheme, "/?#@ ") < host) return false;
  bool is_virtual = config->s3_style == SRV_S3_VIRTUAL || (config->s3_style == SRV_S3_AUTO && is_default);
  int size = is_virtual ? snprintf(out, BASE_SIZE, "%.*s%.*s.%.*s", (int)scheme, given, (int)bucket_size,
                                   bucket, (int)host, given + scheme)
                        : snprintf(out, BASE_SIZE, "%.*s%.*s/%.*s", (int)scheme, given, (int)host,
                                   given + scheme, (int)bucket_size, bucket);
  return size < BASE_SIZE;
}

static const char *choose_region(const srv_config *config) {
  const char *region = config->s3_region;
  if (region[0] == '\0') region = srv_s3_variable("AWS_REGION");
  if (region[0] == '\0') region = srv_s3_variable("AWS_DEFAULT_REGION");
  return region[0] != '\0' ? region : "us-east-1";
}

static bool read_place(srv_s3 *s3, const srv_config *config, srv_error *error) {
  const char *bucket = config->data + strlen("s3://"), *region = choose_region(config);
  size_t bucket_size = strcspn(bucket, "/");
  if (!is_name(bucket, bucket_size))
    return srv_fail(error, "--data: '%s' is not s3://BUCKET or s3://BUCKET/PREFIX", config->data);
  if (!read_prefix(bucket + bucket_size, s3->prefix))
    return srv_fail(error, "--data: the prefix of '%s' may hold letters, digits, - . _ ~ and single /",
                    config->data);
  if (!is_name(region, strlen(region)) || strlen(region) > 64)
    return srv_fail(error, "--s3-region: '%s' is not a region such as eu-central-1", region);
  if (!read_endpoint(config, region, bucket, bucket_size, s3->base))
    return srv_fail(error, "--s3-endpoint: '%s' is not http[s]://HOST or http[s]://HOST:PORT",
                    config->s3_endpoint);
  snprintf(s3->signing, sizeof s3->signing, "aws:amz:%s:s3", region);
  return true;
}

srv_s3 *srv_s3_open(const srv_config *config, srv_error *error) {
  srv_s3 *s3 = calloc(1, sizeof *s3);
  srv_s3_credentials credentials;
  srv_fail(error, "out of memory");
  if (!s3) return NULL;
  pthread_mutex_init(&s3->lock, NULL);
  s3->credentials = strdup(config->s3_credentials);
  s3->ca_file = srv_s3_variable("AWS_CA_BUNDLE");
  bool is_usable = s3->credentials && curl_global_init(CURL_GLOBAL_DEFAULT) == CURLE_OK &&
                   read_place(s3, config, error) &&
                   srv_s3_credentials_read(s3->credentials, &credentials, error);
  explicit_bzero(&credentials, sizeof credentials);
  if (is_usable) return s3;
  srv_s3_close(s3);
  return NULL;
}

void srv_s3_close(srv_s3 *s3) {
  if (!s3) return;
  for (size_t i = 0; i < s3->kept_count; i++) curl_easy_cleanup(s3->kept[i]);
  pthread_mutex_destroy(&s3->lock);
  free(s3->credentials);
  free(s3);
}

const char *srv_s3_prefix(const srv_s3 *s3) {
  return s3->prefix;
}

uint64_t srv_s3_retries(const srv_s3 *s3) {
  return atomic_load(&s3->retries);
}

/* ---- handles --------------------------------------------------------------------------------- */

/* Takes the handle that was used last: its connection is the most likely to be still open. */
static CURL *take_handle(srv_s3 *s3) {
  pthread_mutex_lock(&s3->lock);
  CURL *handle = s3->kept_count > 0 ? s3->kept[--s3->kept_count] : NULL;
  pthread_mutex_unlock(&s3->lock);
  return handle ? handle : curl_easy_init();
}

static void give_back(srv_s3 *s3, CURL *handle) {
  curl_easy_reset(handle); /* keeps the connection */
  pthread_mutex_lock(&s3->lock);
  bool is_kept = s3->kept_count < KEPT_MAX;
  if (is_kept) s3->kept[s3->kept_count++] = handle;
  pthread_mutex_unlock(&s3->lock);
  if (!is_kept) curl_easy_cleanup(handle);
}

/* ---- one try --------------------------------------------------------------------------------- */

typedef struct transfer {
  const srv_s3_request *request;
  srv_s3_answer *answer;
  uint64_t taken; /* bytes passed to `take`, over all tries */
  uint64_t skips; /* bytes of this try that were passed before */
  uint64_t sent;
  bool is_refused; /* `take` had enough */
  size_t error_size;
  char error[ERROR_MAX + 1]; /* the store's error answer */
} transfer;

static bool is_success(int status) {
  return status >= 200 && status < 300;
}

static size_t send_body(char *out, size_t size, size_t count, void *context) {
  transfer *t = context;
  size_t left = t->request->body.size - (size_t)t->sent, most = size * count;
  if (most > left) most = left;
  memcpy(out, t->request->body.data + t->sent, most);
  t->sent += most;
  return most;
}

/* libcurl calls this when an idle connection turns out to be dead and it starts again on another. */
static int rewind_body(void *context, curl_off_t offset, int origin) {
  transfer *t = context;
  if (origin != SEEK_SET || offset < 0 || (uint64_t)offset > t->request->body.size) return CURL_SEEKFUNC_FAIL;
  t->sent = (uint64_t)offset;
  return CURL_SEEKFUNC_OK;
}

static size_t take_body(char *data, size_t one, size_t size, void *context) {
  (void)one;
  transfer *t = context;
  if (!is_success(t->answer->status)) {
    size_t kept = ERROR_MAX - t->error_size < size ? ERROR_MAX - t->error_size : size;
    memcpy(t->error + t->error_size, data, kept);
    t->error_size += kept;
    t->error[t->error_size] = '\0';
    return size;
  }
  size_t skipped = t->skips < size ? (size_t)t->skips : size, rest = size - skipped;
  t->skips -= skipped;
  if (rest == 0 || !t->request->take) return size;
  if (!t->request->take(t->request->context, t->taken, (const uint8_t *)data + skipped, rest)) {
    t->is_refused = true;
    return 0;
  }
  t->taken += rest;
  return size;
}

/* Copies the value of a header line, terminated; NULL when the line has another name. */
static const char *value_of(const char *line, const char *name, char *out, size_t out_size) {
  size_t name_size = strlen(name);
  if (strncasecmp(line, name, name_size) != 0 || line[name_size] != ':') return NULL;
  const char *value = line + name_size + 1;
  value += strspn(value, " \t");
  size_t size = strcspn(value, "\r\n");
  if (size >= out_size) return NULL;
  memcpy(out, value, size);
  out[size] = '\0';
  return out;
}

static size_t take_head(char *data, size_t one, size_t size, void *context) {
  enum { LINE_MAX_SIZE = 4096 };
  transfer *t = context;
  srv_s3_answer *answer = t->answer;
  char line[LINE_MAX_SIZE], value[LINE_MAX_SIZE];
  (void)one;
  if (size >= sizeof line) return size;
  memcpy(line, data, size);
  line[size] = '\0';
  if (strncmp(line, "HTTP/", 5) == 0) {
    const char *status = strchr(line, ' ');
    answer->status = status ? (int)strtol(status, NULL, 10) : 0;
    if (answer->status == 200) t->skips = t->taken; /* the whole object came, not only its rest */
    free(answer->summary);
    answer->summary = NULL;
    return size;
  }
  if (!is_success(answer->status)) return size;
  if (value_of(line, "Content-Length", value, sizeof value) && answer->status == 200)
    answer->size = strtoull(value, NULL, 10);
  if (value_of(line, "ETag", value, sizeof value) && strlen(value) < sizeof answer->etag)
    memcpy(answer->etag, value, strlen(value) + 1);
  if (value_of(line, "x-amz-meta-summary", value, sizeof value) && !answer->summary) {
    char *text = curl_easy_unescape(NULL, value, 0, NULL);
    answer->summary = text ? strdup(text) : NULL;
    curl_free(text);
  }
  return size;
}

/* Copies the text of an element without children, as of <Code>NoSuchBucket</Code>; "" when it is absent. */
static void copy_element(const char *text, const char *name, char *out, size_t out_size) {
  char opening[32];
  snprintf(opening, sizeof opening, "<%s>", name);
  const char *begin = strstr(text, opening);
  out[0] = '\0';
  if (!begin) return;
  begin += strlen(opening);
  snprintf(out, out_size, "%.*s", (int)strcspn(begin, "<"), begin);
}

static void explain(const transfer *t, CURLcode code, const char *detail) {
  srv_s3_answer *answer = t->answer;
  if (code != CURLE_OK) {
    answer->status = 0;
    srv_fail(&answer->reason, "%s", detail[0] != '\0' ? detail : curl_easy_strerror(code));
    return;
  }
  char message[160];
  copy_element(t->error, "Code", answer->code, sizeof answer->code);
  copy_element(t->error, "Message", message, sizeof message);
  srv_fail(&answer->reason, "status %d%s%s%s%s", answer->status, answer->code[0] != '\0' ? ", " : "",
           answer->code, message[0] != '\0' ? ": " : "", message);
}

/* A list of headers. All are signed, so none may be one that libcurl leaves out. */
typedef struct headers {
  struct curl_slist *list;
  bool has_failed; /* out of memory */
} headers;

static void add_header(headers *h, const char *name, const char *value) {
  char line[SRV_S3_TOKEN_SIZE + 64];
  snprintf(line, sizeof line, "%s: %s", name, value);
  struct curl_slist *longer = curl_slist_append(h->list, line);
  if (!longer)
    h->has_failed = true;
  else
    h->list = longer;
}

static void print_hash(api_bytes bytes, char out[2 * SHA256_DIGEST_SIZE + 1]) {
  struct sha256_ctx hash;
  uint8_t digest[SHA256_DIGEST_SIZE];
  sha256_init(&hash);
  sha256_update(&hash, bytes.size, bytes.data);
  sha256_digest(&hash, sizeof digest, digest);
  base16_encode_update(out, sizeof digest, digest);
  out[2 * sizeof digest] = '\0';
}

/* Adds the summary percent-encoded, since metadata must be ASCII. Leaves it out when it is too long. */
static void add_summary(headers *h, const char *summary) {
  char *text = curl_easy_escape(NULL, summary, 0);
  h->has_failed |= !text;
  if (text && strlen(text) <= SUMMARY_MAX) add_header(h, "x-amz-meta-summary", text);
  curl_free(text);
}

static headers make_headers(const transfer *t, const srv_s3_credentials *credentials,
                            const char *content_hash) {
  const srv_s3_request *request = t->request;
  headers h = {0};
  add_header(&h, "x-amz-content-sha256", content_hash);
  if (credentials->token[0] != '\0') add_header(&h, "x-amz-security-token", credentials->token);
  if (request->method == SRV_S3_PUT) add_header(&h, "Content-Type", "application/octet-stream");
  if (request->method == SRV_S3_PUT && request->is_new) add_header(&h, "If-None-Match", "*");
  if (request->method == SRV_S3_PUT && request->summary) add_summary(&h, request->summary);
  if (t->taken > 0) {
    char range[48];
    snprintf(range, sizeof range, "bytes=%" PRIu64 "-", t->taken);
    add_header(&h, "Range", range);
    add_header(&h, "If-Match", t->answer->etag);
  }
  return h;
}

static void set_options(CURL *handle, const srv_s3 *s3, transfer *t, const srv_s3_credentials *credentials,
                        uint64_t left_ms, char *detail) {
  static const char *const methods[] = {"HEAD", "GET", "PUT", "DELETE"};
  const srv_s3_request *request = t->request;
  char url[URL_SIZE];
  snprintf(url, sizeof url, "%s/%s%s%s%s", s3->base, request->key ? s3->prefix : "",
           request->key ? request->key : "", request->query ? "?" : "", request->query ? request->query : "");
  curl_easy_setopt(handle, CURLOPT_URL, url);
  curl_easy_setopt(handle, CURLOPT_CUSTOMREQUEST, methods[request->method]);
  curl_easy_setopt(handle, CURLOPT_NOBODY, request->method == SRV_S3_HEAD ? 1L : 0L);
  if (request->method == SRV_S3_PUT) {
    curl_easy_setopt(handle, CURLOPT_UPLOAD, 1L);
    curl_easy_setopt(handle, CURLOPT_INFILESIZE_LARGE, (curl_off_t)request->body.size);
    curl_easy_setopt(handle, CURLOPT_READFUNCTION, send_body);
    curl_easy_setopt(handle, CURLOPT_READDATA, t);
    curl_easy_setopt(handle, CURLOPT_SEEKFUNCTION, rewind_body);
    curl_easy_setopt(handle, CURLOPT_SEEKDATA, t);
  }
  curl_easy_setopt(handle, CURLOPT_WRITEFUNCTION, take_body);
  curl_easy_setopt(handle, CURLOPT_WRITEDATA, t);
  curl_easy_setopt(handle, CURLOPT_HEADERFUNCTION, take_head);
  curl_easy_setopt(handle, CURLOPT_HEADERDATA, t);
  curl_easy_setopt(handle, CURLOPT_ERRORBUFFER, detail);
  curl_easy_setopt(handle, CURLOPT_AWS_SIGV4, s3->signing);
  curl_easy_setopt(handle, CURLOPT_USERNAME, credentials->key);
  curl_easy_setopt(handle, CURLOPT_PASSWORD, credentials->secret);
  curl_easy_setopt(handle, CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(handle, CURLOPT_HTTP_VERSION, (long)CURL_HTTP_VERSION_1_1);
  curl_easy_setopt(handle, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(handle, CURLOPT_CONNECTTIMEOUT_MS, (long)CONNECT_MS);
  curl_easy_setopt(handle, CURLOPT_LOW_SPEED_LIMIT, 1L);
  curl_easy_setopt(handle, CURLOPT_LOW_SPEED_TIME,
                   request->method == SRV_S3_PUT ? (long)CONFIRM_S : (long)STILL_S);
  curl_easy_setopt(handle, CURLOPT_TIMEOUT_MS, (long)left_ms);
  curl_easy_setopt(handle, CURLOPT_EXPECT_100_TIMEOUT_MS, (long)CONTINUE_MS);
  if (s3->ca_file[0] != '\0') curl_easy_setopt(handle, CURLOPT_CAINFO, s3->ca_file);
}

static void try_once(srv_s3 *s3, transfer *t, const char *content_hash, uint64_t left_ms) {
  char detail[CURL_ERROR_SIZE] = "";
  srv_s3_credentials credentials;
  srv_s3_answer *answer = t->answer;
  if (!srv_s3_credentials_read(s3->credentials, &credentials, &answer->reason)) {
    answer->status = 0;
    return;
  }
  CURL *handle = take_handle(s3);
  headers h = make_headers(t, &credentials, content_hash);
  CURLcode code = CURLE_OUT_OF_MEMORY;
  t->sent = t->skips = t->error_size = 0;
  t->error[0] = '\0';
  answer->status = 0;
  if (t->taken == 0) answer->etag[0] = '\0';
  if (handle && !h.has_failed) {
    set_options(handle, s3, t, &credentials, left_ms, detail);
    curl_easy_setopt(handle, CURLOPT_HTTPHEADER, h.list);
    code = curl_easy_perform(handle);
  }
  explicit_bzero(&credentials, sizeof credentials);
  if (code != CURLE_OK || !is_success(answer->status)) explain(t, code, detail);
  curl_slist_free_all(h.list);
  if (handle) give_back(s3, handle);
}

/* ---- all tries ------------------------------------------------------------------------------- */

/* Whether a later try may succeed. 409: another daemon is storing the same object. */
static bool may_pass(int status) {
  return status == 0 || status == 408 || status == 409 || status == 429 || status == 500 || status == 502 ||
         status == 503 || status == 504;
}

static uint64_t random_below(uint64_t bound) {
  uint32_t bits;
  return getrandom(&bits, sizeof bits, 0) == (ssize_t)sizeof bits ? bits % bound : bound / 2;
}

void srv_s3_send(srv_s3 *s3, const srv_s3_request *request, srv_s3_answer *answer) {
  transfer t = {.request = request, .answer = answer};
  char content_hash[2 * SHA256_DIGEST_SIZE + 1];
  uint64_t end_ms = srv_now_ms() + request->timeout_ms, now_ms = end_ms - request->timeout_ms;
  *answer = (srv_s3_answer){0};
  print_hash(request->body, content_hash);
  for (uint64_t wait_ms = WAIT_MS, tries = 1;; tries++, wait_ms *= 2) {
    try_once(s3, &t, content_hash, end_ms - now_ms);
    if (!may_pass(answer->status) || t.is_refused || tries == TRIES) return;
    uint64_t pause_ms = random_below(wait_ms);
    bool stops = request->stops && atomic_load(request->stops);
    if (stops || srv_now_ms() + pause_ms >= end_ms) return;
    const struct timespec pause = {(time_t)(pause_ms / 1000), (long)(pause_ms % 1000) * 1000000};
    nanosleep(&pause, NULL);
    now_ms = srv_now_ms();
    if (now_ms >= end_ms) return;
    atomic_fetch_add(&s3->retries, 1);
    /* Start from the beginning for a listing, and for an object without an ETag, which cannot be told from a
     * later one. */
    if (!request->key || answer->etag[0] == '\0') t.taken = 0;
  }
}
