/* API keys, compared in constant time, and CORS (the fetch standard), without credentials. */
#include "access.h"

#include <nettle/memops.h>
#include <string.h>
#include <strings.h>

/* The key that the request bears, NULL when it bears none. */
static const char *key_of(const api_call *call) {
  const char *authorization = api_call_header(call, "Authorization");
  if (authorization && strncasecmp(authorization, "Bearer ", 7) == 0)
    return authorization + 7 + strspn(authorization + 7, " ");
  return api_call_header(call, "X-API-Key");
}

bool api_access_allowed(api_call *call) {
  const api_keys *keys = call->request->keys;
  if (!keys) keys = api_service_keys(call->service);
  if (keys->count == 0) return true;
  const char *key = key_of(call);
  if (!key) {
    api_fail_with(call, 401, "an API key is asked for: Authorization: Bearer KEY, or X-API-Key: KEY");
    call->fault.header = (api_header){"WWW-Authenticate", "Bearer realm=\"tweend\""};
    return false;
  }
  uint8_t digest[API_KEY_DIGEST];
  api_key_digest(key, digest);
  int found = 0; /* every key is looked at, so that the time tells nothing */
  for (size_t i = 0; i < keys->count; i++) found |= memeql_sec(digest, keys->digests[i], API_KEY_DIGEST);
  if (!found) api_fail_with(call, 403, "the API key is not one of those configured");
  return found != 0;
}

/* Whether the comma-separated list holds the origin. */
static bool lists_origin(const char *list, const char *origin) {
  size_t length = strlen(origin);
  while (*list) {
    list += strspn(list, ", \t");
    size_t item = strcspn(list, ", \t");
    if (item > 0 && item == length && strncasecmp(list, origin, length) == 0) return true;
    list += item;
  }
  return false;
}

static bool is_any(const api_service *service) {
  return strcmp(service->cors_origins, "*") == 0;
}

/* The value of Access-Control-Allow-Origin, NULL for none. */
static const char *allowed_origin(const api_service *service, const api_request *request) {
  if (is_any(service)) return "*";
  const char *origin = request->header(request->context, "Origin");
  return origin && lists_origin(service->cors_origins, origin) ? origin : NULL;
}

void api_cors_headers(const api_service *service, const api_request *request, api_answer *answer) {
  const char *origin = allowed_origin(service, request);
  if (!origin) return;
  if (origin[0] == '*') {
    api_answer_header(answer, "Access-Control-Allow-Origin", "*");
  } else {
    char *copy = answer->memory ? tw_arena_text(answer->memory, origin, strlen(origin)) : NULL;
    if (!copy) return;
    api_answer_header(answer, "Access-Control-Allow-Origin", copy);
  }
  api_answer_header(answer, "Access-Control-Expose-Headers",
                    "Accept-Ranges, Content-Length, Content-Range, ETag, Link, Location, Retry-After, "
                    "Server-Timing, X-Request-Id, X-Tweend-Error, X-Tweend-Warning");
}

void api_cors_options(api_call *call, const char *allow) {
  api_answer *answer = &call->answer;
  answer->status = 204;
  api_answer_header(answer, "Allow", allow);
  bool is_preflight =
      api_call_header(call, "Origin") && api_call_header(call, "Access-Control-Request-Method");
  if (!is_preflight || !allowed_origin(call->service, call->request)) return;
  api_answer_header(answer, "Access-Control-Allow-Methods", allow);
  api_answer_header(answer, "Access-Control-Allow-Headers",
                    "Authorization, Content-Encoding, Content-Type, If-Match, If-None-Match, If-Range, "
                    "Last-Event-ID, Range, X-API-Key, X-Request-Id");
  api_answer_header(answer, "Access-Control-Max-Age", "86400");
}
