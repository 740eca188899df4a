/* A signature is the HMAC-SHA256 (RFC 2104), as unpadded base64url (RFC 4648), of three lines: METHOD, PATH
 * and QUERY. QUERY is every parameter but sig as name=value, percent-encoded, sorted by name, joined by
 * '&'. */
#include "signed_url.h"

#include "service.h"

#include <nettle/base64.h>
#include <nettle/memops.h>
#include <string.h>

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

void api_signed_url_sign(const struct hmac_sha256_ctx *key, const char *method, const char *path,
                         const api_query *query, char out[API_SIGNATURE_PADDED]) {
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
    char expected[API_SIGNATURE_PADDED];
    api_signed_url_sign(&keys->url_keys[i], method, path, query, expected);
    found |= memeql_sec(expected, signature, API_SIGNATURE_SIZE);
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
                 api_query_read(request->query, call->arena, &query, &unread.error) == TW_OK;
  const char *signature = is_read ? api_query_get(&query, "sig") : NULL;
  if (!signature) return API_SIGNATURE_NONE;
  uint64_t end_s = 0;
  bool has_end =
      api_query_get(&query, "exp") && api_query_count(&query, "exp", &end_s, &unread.error) == TW_OK;
  /* A signature for GET is also valid for HEAD. */
  bool fits = strlen(signature) == API_SIGNATURE_SIZE &&
              (is_signed(keys, request->method, request->path, &query, signature) ||
               (call->is_head && is_signed(keys, "GET", request->path, &query, signature)));
  if (!has_end || !fits) return refuse(call, "the signature does not fit the URL");
  if (request->now_s >= end_s) return refuse(call, "the time of the signed URL is over");
  return API_SIGNATURE_GOOD;
}
