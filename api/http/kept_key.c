/* Keys of answers. Only an extension says what the answer is regardless of Accept, so that only such paths
 * have one. */
#include "kept_key.h"

#include "handlers.h"
#include "pose_request.h"
#include "routes.h"

#include <math.h>
#include <string.h>

static bool is_number_char(char c) {
  return (c >= '0' && c <= '9') || c == '.' || c == '-' || c == 'e';
}

/* The value of the one parameter "at" of a query; NULL when there is none, or two, or it holds more than a
 * plain number does. */
static const char *find_time(const char *query, size_t *length) {
  const char *found = NULL;
  for (const char *place = query; place; place = strchr(place, '&')) {
    if (*place == '&') place++;
    if (strncmp(place, "at=", 3) != 0) continue;
    if (found) return NULL;
    found = place + 3;
  }
  *length = 0;
  while (found && is_number_char(found[*length])) ++*length;
  bool is_whole = found && *length > 0 && (found[*length] == '&' || found[*length] == '\0');
  return is_whole ? found : NULL;
}

static void add(api_kept_key *key, const char *text, size_t size) {
  memcpy(key->text + key->size, text, size);
  key->size += size;
}

/* The query but for its time. */
static void add_query(api_kept_key *key, const char *query, size_t size) {
  double value;
  size_t length;
  const char *time = find_time(query, &length);
  if (time && api_number_read(time, length, &value) && isfinite((float)value)) {
    key->has_time = true;
    key->time = (float)value;
    add(key, query, (size_t)(time - query));
    add(key, "\n", 1);
    size -= (size_t)(time - query) + length;
    query = time + length;
  }
  add(key, query, size);
}

bool api_kept_key_read(const api_call *call, api_kept_key *out) {
  const api_request *request = call->request;
  bool is_read = call->route->takes == API_TAKES_NOTHING && request->body.size == 0;
  if (!is_read || !call->id[0] || !call->offer) return false;
  size_t path = strlen(request->path), query = strlen(request->query);
  /* The time of a whole key stands behind all else. */
  enum { MOST = API_KEPT_KEY - sizeof "?" - sizeof "\n" - API_TIMES_MARK };
  if (path > MOST || query > MOST - path) return false;
  out->size = 0;
  out->has_time = false;
  add(out, request->path, path);
  add(out, "?", 1);
  if (call->route->handle == api_get_pose)
    add_query(out, request->query, query);
  else
    add(out, request->query, query);
  out->text[out->size] = '\0';
  out->hash = api_cache_hash(out->text, out->size);
  return true;
}

uint32_t api_kept_key_asked(const api_kept_key *key) {
  uint32_t bits = 0;
  if (key->has_time) memcpy(&bits, &key->time, sizeof bits);
  uint32_t hash = (key->hash ^ bits) * 0x9E3779B1u;
  hash ^= hash >> 16; /* most times have zeros at the end */
  return hash ? hash : 1;
}

void api_kept_key_whole(api_kept_key *key) {
  if (!key->has_time) return;
  add(key, "\n", 1);
  api_time_mark(key->time, key->text + key->size);
  key->size += strlen(key->text + key->size);
  key->has_time = false;
  key->hash = api_cache_hash(key->text, key->size);
}
