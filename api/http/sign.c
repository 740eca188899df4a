/* POST /v1/sign: gives a URL the right to be read until a time. */
#include "handlers.h"
#include "json_value.h"
#include "service.h"
#include "signed_url.h"
#include "upload.h"

#include <string.h>
#include <strings.h>

enum { SECONDS_DEFAULT = 3600, SECONDS_MOST = 7 * 86400 };

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
  const api_route *route = call->find_route("GET", *path);
  if (!route) return fail_url(call, "nothing is at this path");
  const char *text = start[length] ? start + length + 1 : "";
  tw_error *error = &call->fault.error;
  tw_status status = api_query_read(text, call->arena, query, error);
  if (status == TW_OK) status = api_rules_admit(route->parameters, query, error);
  if (status != TW_OK) {
    strcpy(error->pointer, "/url");
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
  const char *value = api_text_move(&text, call->arena);
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
  char signature[API_SIGNATURE_PADDED];
  api_signed_url_sign(&keys->url_keys[0], "GET", path, &query, signature);
  tw_text url = {0}, text = {0};
  tw_text_add(&url, wanted.url);
  tw_text_add(&url, separator);
  tw_text_add(&url, "exp=");
  tw_text_add(&url, query.parameters[query.count - 1].value);
  tw_text_add(&url, "&sig=");
  tw_text_bytes(&url, signature, API_SIGNATURE_SIZE);
  tw_text_add(&text, "{\"url\":");
  tw_text_quoted(&text, url.failed ? "" : url.data, url.size);
  tw_text_add(&text, "}\n");
  text.failed |= url.failed;
  tw_text_deinit(&url);
  return api_reply(call, &text);
}
