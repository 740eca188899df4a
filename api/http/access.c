/* Keys, compared in constant time, and CORS (the fetch standard), without credentials. Without keys only the
 * browser's origin can be checked: pages of origins that --cors-origins does not name may then neither list
 * nor delete models, only use those whose id they know. On a loopback listener, where any page that the user
 * opens can send requests, they may not store either, and only the hosts of this machine are served: a page
 * whose own host name has been made to lead here (DNS rebinding) counts as the daemon's own page for a
 * browser. */
#include "access.h"

#include "service.h"
#include "signed_url.h"

#include <nettle/memops.h>
#include <string.h>
#include <strings.h>

/* ---- keys ------------------------------------------------------------------------------------ */

static const api_keys *keys_of(const api_service *service, const api_request *request) {
  return request->keys ? request->keys : api_service_keys(service);
}

static bool has_keys(const api_call *call) {
  const api_keys *keys = keys_of(call->service, call->request);
  return keys->count > 0 || keys->url_count > 0;
}

bool api_access_asks(const api_call *call) {
  return call->route && call->route->access != API_OPEN && has_keys(call);
}

/* The key in the request, NULL without one. */
static const char *key_text(const api_request *request) {
  const char *authorization = request->header(request->context, "Authorization");
  if (authorization && strncasecmp(authorization, "Bearer ", 7) == 0)
    return authorization + 7 + strspn(authorization + 7, " ");
  return request->header(request->context, "X-API-Key");
}

/* The configured key with this text, NULL for none. */
static const api_service_key *find_key(const api_keys *keys, const char *text) {
  uint8_t digest[API_KEY_DIGEST];
  api_key_digest(text, digest);
  size_t found = keys->count; /* every key is compared, so that the time reveals nothing */
  for (size_t i = keys->count; i-- > 0;)
    if (memeql_sec(digest, keys->keys[i].digest, API_KEY_DIGEST)) found = i;
  return found < keys->count ? &keys->keys[found] : NULL;
}

api_rate api_key_rate(const api_service *service, const api_request *request, uint8_t id[16]) {
  const api_keys *keys = keys_of(service, request);
  const char *text = keys->has_rates ? key_text(request) : NULL;
  const api_service_key *key = text ? find_key(keys, text) : NULL;
  if (!key) return (api_rate){0};
  memcpy(id, key->digest, 16);
  return key->rate;
}

static unsigned right_for(api_access access) {
  switch (access) {
  case API_OPEN: return 0;
  case API_READS:
  case API_READS_ALL: return API_MAY_READ;
  case API_WRITES: return API_MAY_WRITE;
  case API_DELETES: return API_MAY_DELETE;
  }
  return 0;
}

static const char *name_right(unsigned right) {
  return right == API_MAY_READ ? "read" : right == API_MAY_WRITE ? "write" : "delete";
}

static bool refuse_key(api_call *call, const char *text, const api_service_key *key, unsigned right) {
  if (key) {
    api_fail_with(call, 403, "the API key has not the right to %s", name_right(right));
  } else if (text) {
    api_fail_with(call, 403, "the API key is not one of those configured");
  } else {
    api_fail_with(call, 401, "an API key is asked for: Authorization: Bearer KEY, or X-API-Key: KEY");
    call->fault.header = (api_header){"WWW-Authenticate", "Bearer realm=\"tweend\""};
  }
  return false;
}

static bool allows_bearer(api_call *call) {
  const api_keys *keys = keys_of(call->service, call->request);
  unsigned right = right_for(call->route->access);
  const char *text = key_text(call->request);
  const api_service_key *key = text ? find_key(keys, text) : NULL;
  if (key && (key->rights & right)) return true;
  switch (right == API_MAY_READ ? api_signed_url_judge(call, keys) : API_SIGNATURE_NONE) {
  case API_SIGNATURE_GOOD: return true;
  case API_SIGNATURE_BAD: return false;
  case API_SIGNATURE_NONE: break;
  }
  return refuse_key(call, text, key, right);
}

/* ---- origins --------------------------------------------------------------------------------- */

/* Whether the comma-separated list holds text[0..length), in any case. */
static bool lists(const char *list, const char *text, size_t length) {
  while (*list) {
    list += strspn(list, ", \t");
    size_t item = strcspn(list, ", \t");
    if (item > 0 && item == length && strncasecmp(list, text, length) == 0) return true;
    list += item;
  }
  return false;
}

static bool lists_origin(const char *list, const char *origin) {
  return lists(list, origin, strlen(origin));
}

/* The length of the host in HOST[:PORT]; 0 where something else follows it. */
static size_t host_length(const char *text) {
  size_t length = strcspn(text, text[0] == '[' ? "]" : ":");
  length += text[length] == ']';
  const char *rest = text + length;
  bool has_port = *rest == ':' && rest[1 + strspn(rest + 1, "0123456789")] == '\0';
  return *rest == '\0' || has_port ? length : 0;
}

/* Whether the origin is a page that this machine serves, at any port. Names below localhost never leave the
 * machine (RFC 6761, 6.3); a host of digits and dots is an address. */
static bool is_loopback_origin(const char *origin) {
  static const char below[] = ".localhost";
  const size_t tail = sizeof below - 1;
  size_t scheme = strncasecmp(origin, "http://", 7) == 0    ? 7
                  : strncasecmp(origin, "https://", 8) == 0 ? 8
                                                            : 0;
  const char *host = origin + scheme;
  size_t length = scheme ? host_length(host) : 0;
  if (length == 0) return false;
  bool is_below = length > tail && strncasecmp(host + length - tail, below, tail) == 0;
  bool is_address = strncmp(host, "127.", 4) == 0 && strspn(host, "0123456789.") == length;
  return is_below || is_address || lists("localhost, [::1]", host, length);
}

/* Whether the request comes from this daemon's own page: the browser says so, or the origin's host is that of
 * the request. */
static bool is_own(const api_call *call, const char *origin) {
  const char *site = api_call_header(call, "Sec-Fetch-Site"), *host = call->request->host;
  const char *authority = strstr(origin, "://");
  return (site && strcmp(site, "same-origin") == 0) ||
         (host && authority && strcasecmp(authority + 3, host) == 0);
}

/* Whether a page of the request's origin may use the route only when --cors-origins names that origin. */
static bool is_guarded(const api_call *call, const api_route *route) {
  if (!route || has_keys(call)) return false;
  const char *origin = api_call_header(call, "Origin");
  switch (route->access) {
  case API_OPEN:
  case API_READS: return false;
  case API_READS_ALL:
  case API_DELETES: return true;
  case API_WRITES: return call->request->is_local && !(origin && is_loopback_origin(origin));
  }
  return true;
}

/* Which pages may use the route, as the value of Access-Control-Allow-Origin: the request's origin, or "*".
 * NULL where a page of that origin may not. */
static const char *allowed_origin(const api_call *call, const api_route *route) {
  const char *list = call->service->cors_origins, *origin = api_call_header(call, "Origin");
  if (origin && strcmp(origin, "*") != 0 && lists_origin(list, origin)) return origin;
  return lists_origin(list, "*") && !is_guarded(call, route) ? "*" : NULL;
}

bool api_access_varies(const api_call *call) {
  return strcmp(call->service->cors_origins, "*") != 0 || is_guarded(call, call->route);
}

/* Whether the browser says of a request without Origin that a page of another origin causes it. Answers to
 * such requests are kept from the page, so that matters only where the request itself has an effect. */
static bool has_foreign_effect(const api_call *call) {
  const char *site = api_call_header(call, "Sec-Fetch-Site");
  bool is_foreign = site && strcmp(site, "same-origin") != 0 && strcmp(site, "none") != 0;
  return is_foreign && call->route->access != API_READS_ALL;
}

static bool allows_origin(api_call *call) {
  if (!is_guarded(call, call->route)) return true;
  const char *origin = api_call_header(call, "Origin");
  bool is_allowed =
      origin ? is_own(call, origin) || allowed_origin(call, call->route) != NULL : !has_foreign_effect(call);
  if (is_allowed) return true;
  if (call->route->access == API_WRITES)
    api_fail_with(call, 403,
                  "pages of other origins may not store models in a daemon on this machine, unless "
                  "--cors-origins names their origin");
  else
    api_fail_with(call, 403, "pages of other origins than those of --cors-origins may not do this");
  return false;
}

bool api_access_serves_host(api_call *call) {
  static const char own[] = "localhost, 127.0.0.1, [::1]";
  const api_request *request = call->request;
  bool is_checked = request->is_local && (request->is_admin || !has_keys(call));
  const char *host = request->host, *others = call->service->hosts;
  if (!is_checked || !host || lists_origin(others, "*")) return true; /* browsers always send a host */
  size_t length = host_length(host);
  if (length > 0 && (lists(own, host, length) || lists(others, host, length))) return true;
  api_fail_with(call, 421, "the host '%.64s' is neither this machine's own (%s) nor one of --hosts", host,
                own);
  return false;
}

/* Which routes the listener for probes and metrics serves. */
static bool allows_admin(api_call *call) {
  api_outcome (*const served[])(api_call *) = {api_get_health, api_get_ready, api_get_version,
                                               api_get_openapi, api_get_metrics};
  for (size_t i = 0; i < sizeof served / sizeof *served; i++)
    if (call->route->handle == served[i]) return true;
  api_fail_with(call, 404, "this listener has probes, /version, /openapi.json and /metrics alone");
  return false;
}

bool api_access_allowed(api_call *call) {
  if (call->request->is_admin) return allows_admin(call);
  if (call->route->access == API_OPEN) return true;
  return has_keys(call) ? allows_bearer(call) : allows_origin(call);
}

/* ---- headers --------------------------------------------------------------------------------- */

/* Whether the answer refuses the request and tells nothing of what is stored: pages of all origins may read
 * why they are refused. */
static bool is_refusal(int status) {
  static const int statuses[] = {401, 403, 408, 413, 414, 421, 429, 431, 503, 507};
  for (size_t i = 0; i < sizeof statuses / sizeof *statuses; i++)
    if (statuses[i] == status) return true;
  return false;
}

void api_access_headers(api_call *call) {
  const char *origin = allowed_origin(call, call->route);
  if (!origin && is_refusal(call->answer.status)) origin = "*";
  if (!origin) return;
  api_answer_header_copy(&call->answer, "Access-Control-Allow-Origin", origin);
  api_answer_header_copy(&call->answer, "Timing-Allow-Origin", origin);
  api_answer_header(
      &call->answer, "Access-Control-Expose-Headers",
      "Accept-Ranges, Content-Disposition, Content-Length, Content-Range, ETag, Link, Location, "
      "RateLimit, RateLimit-Policy, Retry-After, Server-Timing, X-Request-Id, X-Tweend-Error, "
      "X-Tweend-Level, "
      "X-Tweend-Warning");
}

/* A page of an origin that may read answers at all may send every method: where it may not use the route, the
 * request itself is refused, so that the page can read why. */
void api_access_options(api_call *call, const char *allow) {
  api_answer *answer = &call->answer;
  answer->status = 204;
  api_answer_header(answer, "Allow", allow);
  bool is_preflight =
      api_call_header(call, "Origin") && api_call_header(call, "Access-Control-Request-Method");
  if (!is_preflight || !allowed_origin(call, NULL)) return;
  api_answer_header(answer, "Access-Control-Allow-Methods", allow);
  api_answer_header(answer, "Access-Control-Allow-Headers",
                    "Authorization, Content-Disposition, Content-Encoding, Content-Type, If-Match, "
                    "If-None-Match, If-Range, Last-Event-ID, Range, X-API-Key, X-Request-Id");
  api_answer_header(answer, "Access-Control-Max-Age", "86400");
}
