#include "store_fs_list.h"

#include "store_fs_layout.h"
#include "store_verdicts.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* The smallest ids so far, ascending. Memory depends on the page, not on the store. */
typedef struct page {
  char (*ids)[API_ID_TEXT];
  size_t count, capacity;
} page;

static void page_insert(page *p, const char *id) {
  size_t at = p->count;
  while (at > 0 && strcmp(p->ids[at - 1], id) > 0) at--;
  if (at == p->capacity) return;
  size_t kept = p->count < p->capacity ? p->count : p->capacity - 1;
  memmove(p->ids + at + 1, p->ids + at, (kept - at) * sizeof *p->ids);
  memcpy(p->ids[at], id, sizeof *p->ids);
  p->count = kept + 1;
}

/* Adds the ids of one prefix folder that follow `after`. */
static api_store_status collect(const char *root, unsigned prefix, const char *after, page *p) {
  char digits[3];
  snprintf(digits, sizeof digits, "%02x", prefix);
  srv_path folder = srv_store_prefix_path(root, "objects", digits);
  DIR *listing = opendir(folder.text);
  if (!listing) return errno == ENOENT ? API_STORE_OK : srv_store_unavailable("cannot list");
  for (struct dirent *entry = readdir(listing); entry; entry = readdir(listing)) {
    if (srv_store_is_id(entry->d_name) && strcmp(entry->d_name, after) > 0) page_insert(p, entry->d_name);
  }
  closedir(listing);
  return API_STORE_OK;
}

static unsigned first_prefix(const char *after) {
  char folder[3] = {0};
  if (after[0] == '\0') return 0;
  memcpy(folder, after, 2);
  return (unsigned)strtoul(folder, NULL, 16);
}

/* Collects the ids of a page, one more than its limit, which tells whether others follow. */
static api_store_status list_ids(const char *root, const char *after, page *p) {
  api_store_status status = API_STORE_OK;
  for (unsigned prefix = first_prefix(after);
       prefix <= 0xff && p->count < p->capacity && status == API_STORE_OK; prefix++) {
    status = collect(root, prefix, after, p);
  }
  if (status != API_STORE_OK || p->count > 0) return status;
  return srv_store_not_found(root) == API_STORE_ABSENT ? API_STORE_OK : API_STORE_UNAVAILABLE;
}

static size_t describe(const char *root, const page *p, size_t limit, api_listed *out) {
  size_t count = 0;
  for (size_t i = 0; i < p->count && i < limit; i++) {
    srv_path name = srv_store_object_path(root, p->ids[i]);
    struct stat facts;
    if (stat(name.text, &facts) != 0) continue; /* removed meanwhile */
    out[count] =
        (api_listed){.size = (uint64_t)facts.st_size, .summary = srv_store_read_summary(root, p->ids[i])};
    memcpy(out[count].id, p->ids[i], API_ID_TEXT);
    count++;
  }
  return count;
}

api_store_status srv_store_fs_list(const char *root, const char *after, size_t limit, api_listed *out,
                                   size_t *count, bool *more) {
  if (after[0] != '\0' && !srv_store_is_id(after)) return API_STORE_UNAVAILABLE;
  if (limit == 0 || limit >= SIZE_MAX / API_ID_TEXT) return API_STORE_UNAVAILABLE;
  page p = {.ids = calloc(limit + 1, API_ID_TEXT), .capacity = limit + 1};
  if (!p.ids) return API_STORE_UNAVAILABLE;
  char last[API_ID_TEXT];
  snprintf(last, sizeof last, "%s", after);
  api_store_status status;
  do { /* another round when all models of the page were removed meanwhile: an empty page ends the list */
    p.count = 0;
    status = list_ids(root, last, &p);
    if (status != API_STORE_OK) break;
    *more = p.count > limit;
    *count = describe(root, &p, limit, out);
    if (*more) memcpy(last, p.ids[limit - 1], sizeof last);
  } while (*more && *count == 0);
  free(p.ids);
  return status;
}
