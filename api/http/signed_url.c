/* A signature is the HMAC-SHA256 (RFC 2104), as unpadded base64url (RFC 4648), of three lines: METHOD, PATH
 * and QUERY. QUERY is every parameter but sig as name=value, percent-encoded, sorted by name, joined by
 * '&'. */
#include "signed_url.h"

#include "handlers.h"
#include "json_value.h"
#include "service.h"
#include "upload.h"

#include <nettle/base64.h>
#include <nettle/memops.h>
#include <string.h>
#include <strings.h>

/* 32 bytes as base64url, without and with the padding that nettle writes */
enum { SIGNATURE_SIZE = 43, PADDED_SIZE = 48, SECONDS_DEFAULT = 3600, SECONDS_MOST = 7 * 86400 };

static void add_text(struct hmac_sha256_ctx *hash, const char *text) {
  hmac_sha256_update(hash, strlen(text), (const uint8_t *)text);
}

/* Adds the text with all but the unreserved characters (RFC 3986) as %XX. */
static void add_encoded(struct hmac_sha256_ctx *hash, const char *text) {
  static const char digits[] = "0123456789ABCDEF";
  for (; *text; text++) {
    char c = *text;
    bool is_plain = api_is_unreserved(c);
    const uint8_t bytes[] = {'%', (uint8_t)digits[(uint8_t)c >> 4], (uint8_t)digits[(uint8_t)c & 15]};
    hmac_sha256_update(hash, is_plain ? 1 : 3, is_plain ? (const uint8_t *)text : bytes);
  }
}

/* The parameter after `before` by name, leaving out sig; NULL: none. Names are unique. */
static const api_parameter *next_by_name(const api_query *query, const api_parameter *before) {
  const api_parameter *next = NULL;
  for (size_t i = 0; i < query->count; i++) {
    const api_parameter *p = &query->parameters[i];
    bool is_behind = !before || strcmp(p->name, before->name) > 0;
    if (is_behind && strcmp(p->name, "sig") != 0 && (!next || strcmp(p->name, next->name) < 0)) next = p;
  }
  return next;
}

/* out: the first SIGNATURE_SIZE characters are the signature, nettle's padding follows. */
static void sign(const struct hmac_sha256_ctx *key, const char *method, const char *path,
                 const api_query *query, char out[PADDED_SIZE]) {
  struct hmac_sha256_ctx hash = *key;
  add_text(&hash, method);
  add_text(&hash, "\n");
  add_text(&hash, path);
  add_text(&hash, "\n");
  const api_parameter *first = next_by_name(query, NULL);
  for (const api_parameter *p = first; p; p = next_by_name(query, p)) {
    if (p != first) add_text(&hash, "&");
    add_encoded(&hash, p->name);
    add_text(&hash, "=");
    add_encoded(&hash, p->value);
  }
  uint8_t digest[SHA256_DIGEST_SIZE];
  hmac_sha256_digest(&hash, sizeof digest, digest);
  struct base64_encode_ctx encoder;
  base64url_encode_init(&encoder);
  size_t size = base64_encode_update(&encoder, out, sizeof digest, digest);
  base64_encode_final(&encoder, out + size);
}

static bool is_signed(const api_keys *keys, const char *method, const char *path, const api_query *query,
                      const char *signature) {
  int found = 0; /* every key is tried, so that the time reveals nothing */
  for (size_t i = 0; i < keys->url_count; i++) {
    char expected[PADDED_SIZE];
    sign(&keys->url_keys[i], method, path, query, expected);
    found |= memeql_sec(expected, signature, SIGNATURE_SIZE);
  }
  return found != 0;
}

static api_signature refuse(api_call *call, const char *detail) {
  api_fail_with(call, 403, "%s", detail);
  return API_SIGNATURE_BAD;
}

api_signature api_signed_url_judge(api_call *call, const api_keys *keys) {
  const api_request *request = call->request;
  api_query query;
  /* A query that cannot be read counts as unsigned here; its error is reported after the client's rights are
   * checked. */
  api_fault unread = {0};
  bool is_read = strstr(request->query, "sig=") &&
                 api_query_read(request->query, NULL, call->arena, &query, &unread.error) == TW_OK;
  const char *signature = is_read ? api_query_get(&query, "sig") : NULL;
  if (!signature) return API_SIGNATURE_NONE;
  uint64_t end_s = 0;
  bool has_end =
      api_query_get(&query, "exp") && api_query_count(&query, "exp", &end_s, &unread.error) == TW_OK;
  /* A signature for GET is also valid for HEAD. */
  bool fits = strlen(signature) == SIGNATURE_SIZE &&
              (is_signed(keys, request->method, request->path, &query, signature) ||
               (call->is_head && is_signed(keys, "GET", request->path, &query, signature)));
  if (!has_end || !fits) return refuse(call, "the signature does not fit the URL");
  if (request->now_s >= end_s) return refuse(call, "the time of the signed URL is over");
  return API_SIGNATURE_GOOD;
}

/* ---- POST /v1/sign --------------------------------------------------------------------------- */

typedef struct sign_request {
  const char *url;
  uint32_t seconds;
} sign_request;

static tw_status read_document(void *context, const api_value *root) {
  sign_request *out = context;
  static const char *const names[] = {"url", "seconds", NULL};
  api_value values[2];
  tw_status status = api_json_members(root, names, values);
  if (status == TW_OK && !values[0].item) return api_json_fail(root, TW_SYNTAX, "\"url\" is missing");
  if (status == TW_OK) status = api_json_text(&values[0], &out->url);
  if (status == TW_OK) status = api_json_index(&values[1], &out->seconds);
  if (status == TW_OK && (out->seconds < 1 || out->seconds > SECONDS_MOST))
    return api_json_fail(&values[1], TW_INVALID, "1 to %d seconds (seven days) are expected", SECONDS_MOST);
  return status;
}

static api_outcome fail_url(api_call *call, const char *detail) {
  tw_fail(&call->fault.error, TW_INVALID, "%s", detail);
  strcpy(call->fault.error.pointer, "/url");
  return api_fail_in_document(call);
}

/* The path of a URL, absolute or not; NULL where it has none. */
static const char *path_of(const char *url) {
  size_t scheme = strncasecmp(url, "http://", 7) == 0 ? 7 : strncasecmp(url, "https://", 8) == 0 ? 8 : 0;
  size_t host = scheme > 0 ? strcspn(url + scheme, "/?#") : 0;
  const char *path = url + scheme + host;
  return *path == '/' && (scheme == 0 || host > 0) ? path : NULL;
}

/* Whether all characters may stand in the target of a request: those of ASCII that are visible. */
static bool is_encoded(const char *url) {
  while (*url > ' ' && *url < 0x7F) url++;
  return *url == '\0';
}

/* Reads the URL's path and parameters, as those of a GET. */
static api_outcome read_url(api_call *call, const char *url, const char **path, api_query *query) {
  const char *start = path_of(url);
  if (!start || strchr(start, '#'))
    return fail_url(call, "a URL with a path and without a fragment is expected");
  if (!is_encoded(url)) return fail_url(call, "the URL has a character that must be percent-encoded");
  size_t length = strcspn(start, "?");
  char *copy = tw_arena_text(call->arena, start, length);
  if (!copy) return api_fail_without_memory(call);
  api_path_normalize(copy);
  *path = copy;
  const api_route *route = api_route_find("GET", *path);
  if (!route) return fail_url(call, "nothing is at this path");
  const char *text = start[length] ? start + length + 1 : "";
  if (api_query_read(text, route->parameters, call->arena, query, &call->fault.error) != TW_OK) {
    strcpy(call->fault.error.pointer, "/url");
    return api_fail_in_document(call);
  }
  if (api_query_get(query, "exp") || api_query_get(query, "sig"))
    return fail_url(call, "the URL is signed already");
  return API_DONE;
}

/* Adds exp to the query. False without memory. */
static bool add_end(api_call *call, uint64_t end_s, api_query *query) {
  tw_text text = {0};
  tw_text_count(&text, end_s);
  const char *value = api_text_keep(&text, call->arena);
  api_parameter *more = tw_arena_alloc(call->arena, query->count + 1, sizeof *more);
  if (!value || !more) return false;
  if (query->count) memcpy(more, query->parameters, query->count * sizeof *more);
  more[query->count] = (api_parameter){"exp", value};
  *query = (api_query){query->count + 1, more};
  return true;
}

api_outcome api_post_sign(api_call *call) {
  const api_keys *keys = api_service_keys(call->service);
  if (keys->url_count == 0)
    return api_fail_with(call, 404, "no --url-keys are configured: nothing is signed");
  enum { VALUES_MAX = 8 };
  sign_request wanted = {.seconds = SECONDS_DEFAULT};
  const char *path = NULL;
  api_query query;
  api_outcome outcome = api_upload_json(call, VALUES_MAX, read_document, &wanted);
  if (outcome == API_DONE) outcome = read_url(call, wanted.url, &path, &query);
  if (outcome != API_DONE) return outcome;
  const char *separator = query.count ? "&" : strchr(wanted.url, '?') ? "" : "?";
  if (!add_end(call, call->request->now_s + wanted.seconds, &query)) return api_fail_without_memory(call);
  char signature[PADDED_SIZE];
  sign(&keys->url_keys[0], "GET", path, &query, signature);
  tw_text url = {0}, text = {0};
  tw_text_add(&url, wanted.url);
  tw_text_add(&url, separator);
  tw_text_add(&url, "exp=");
  tw_text_add(&url, query.parameters[query.count - 1].value);
  tw_text_add(&url, "&sig=");
  tw_text_bytes(&url, signature, SIGNATURE_SIZE);
  tw_text_add(&text, "{\"url\":");
  tw_text_quoted(&text, url.failed ? "" : url.data, url.size);
  tw_text_add(&text, "}\n");
  text.failed |= url.failed;
  tw_text_deinit(&url);
  return api_reply(call, &text);
}
