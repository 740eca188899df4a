/* Layout: objects/ab/ID and objects/ab/ID.json (the summary), where ab begins ID, and tmp/.
 *
 * Every file is written under tmp/, synced, renamed into place, and then the folder is synced. A model
 * exists exactly when the object's name does: a kill at any moment leaves either nothing or the whole
 * model. Its summary follows; one that a kill kept from following is lost, which api makes good, and no
 * summary is ever left without its model. What is left in tmp/ is removed at the next start; a writer
 * holds a lock on its file, so that several daemons may share one folder. */
#include "store_fs.h"

#include "disk.h"
#include "log.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

enum { ID_SIZE = API_ID_TEXT - 1, NAME_SIZE = 64, SUMMARY_MAX = 1 << 20 };

struct srv_store_fs {
  int objects, temporary; /* descriptors of the two folders */
  atomic_uint serial;
};

static api_store_status unavailable(const char *what) {
  srv_log(SRV_LOG_ERROR, "store: %s: %s", what, strerror(errno));
  return API_STORE_UNAVAILABLE;
}

static bool is_id(const char *text) {
  return strspn(text, "0123456789abcdef") == ID_SIZE && text[ID_SIZE] == '\0';
}

static void object_name(const char *id, char name[NAME_SIZE]) {
  snprintf(name, NAME_SIZE, "%.2s/%s", id, id);
}

static void summary_name(const char *id, char name[NAME_SIZE]) {
  snprintf(name, NAME_SIZE, "%.2s/%s.json", id, id);
}

/* ---- opening --------------------------------------------------------------------------------- */

static int open_folder(int parent, const char *name) {
  if (mkdirat(parent, name, 0700) != 0 && errno != EEXIST) return -1;
  return openat(parent, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
}

/* A fresh stream over a folder whose descriptor stays usable. */
static DIR *open_listing(int parent, const char *name) {
  int fd = openat(parent, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return NULL;
  DIR *listing = fdopendir(fd);
  if (listing == NULL) close(fd);
  return listing;
}

/* Removes the files that no living writer has locked. */
static void remove_leftovers(int temporary) {
  DIR *listing = open_listing(temporary, ".");
  if (listing == NULL) return;
  for (struct dirent *entry = readdir(listing); entry != NULL; entry = readdir(listing)) {
    int fd = openat(temporary, entry->d_name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    struct stat facts;
    bool dead =
        fd >= 0 && fstat(fd, &facts) == 0 && S_ISREG(facts.st_mode) && flock(fd, LOCK_EX | LOCK_NB) == 0;
    if (dead && unlinkat(temporary, entry->d_name, 0) == 0) {
      srv_log(SRV_LOG_INFO, "store: removed %s, left by a killed upload", entry->d_name);
    }
    if (fd >= 0) close(fd);
  }
  closedir(listing);
}

srv_store_fs *srv_store_fs_open(const char *path, char *error, size_t error_size) {
  srv_store_fs *store = malloc(sizeof *store);
  if (store == NULL) {
    snprintf(error, error_size, "--data: out of memory");
    return NULL;
  }
  *store = (srv_store_fs){.objects = -1, .temporary = -1};
  int root = open_folder(AT_FDCWD, path);
  if (root >= 0) {
    store->objects = open_folder(root, "objects");
    store->temporary = open_folder(root, "tmp");
  }
  bool usable = store->objects >= 0 && store->temporary >= 0 &&
                faccessat(store->temporary, ".", W_OK, 0) == 0 &&
                faccessat(store->objects, ".", W_OK, 0) == 0;
  if (!usable) snprintf(error, error_size, "--data: cannot use folder '%s': %s", path, strerror(errno));
  if (root >= 0) close(root);
  if (!usable) {
    srv_store_fs_close(store);
    return NULL;
  }
  remove_leftovers(store->temporary);
  return store;
}

void srv_store_fs_close(srv_store_fs *store) {
  if (store == NULL) return;
  if (store->objects >= 0) close(store->objects);
  if (store->temporary >= 0) close(store->temporary);
  free(store);
}

int srv_store_fs_temporary(const srv_store_fs *store) {
  return store->temporary;
}

/* ---- writing --------------------------------------------------------------------------------- */

typedef enum placed { PLACED, PLACED_BEFORE, PLACE_FAILED } placed;

/* Of several writers of one name, one places it; the others learn that it was there before. */
static placed rename_into(const srv_store_fs *store, const char *temporary, const char *name) {
  if (renameat2(store->temporary, temporary, store->objects, name, RENAME_NOREPLACE) == 0) return PLACED;
  if (errno == EEXIST) return PLACED_BEFORE;
  /* Not every file system can refuse to replace; the bytes are the same, so it does no harm. */
  bool unable = errno == EINVAL || errno == ENOSYS;
  return unable && renameat(store->temporary, temporary, store->objects, name) == 0 ? PLACED : PLACE_FAILED;
}

/* Makes `name` under objects/ hold these bytes, durably but for the folder's own sync. errno says why not. */
static placed place(srv_store_fs *store, const char *name, api_bytes bytes) {
  char temporary[NAME_SIZE];
  snprintf(temporary, sizeof temporary, "put-%ld-%u", (long)getpid(), atomic_fetch_add(&store->serial, 1));
  int fd = openat(store->temporary, temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (fd < 0) return PLACE_FAILED;
  bool written = flock(fd, LOCK_EX) == 0 && srv_write_all(fd, bytes.data, bytes.size) && fsync(fd) == 0;
  placed outcome = written ? rename_into(store, temporary, name) : PLACE_FAILED;
  int reason = errno;
  if (outcome != PLACED) unlinkat(store->temporary, temporary, 0);
  close(fd);
  errno = reason;
  return outcome;
}

static bool sync_folder(int parent, const char *name) {
  int fd = openat(parent, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return false;
  bool synced = fsync(fd) == 0;
  close(fd);
  return synced;
}

static bool is_there(const srv_store_fs *store, const char *name) {
  return faccessat(store->objects, name, F_OK, 0) == 0;
}

static bool make_prefix_folder(const srv_store_fs *store, const char *folder) {
  if (mkdirat(store->objects, folder, 0700) != 0) return errno == EEXIST;
  return sync_folder(store->objects, ".");
}

static api_store_status put(void *context, const char *id, api_bytes bytes, const char *summary,
                            bool *existed) {
  srv_store_fs *store = context;
  if (!is_id(id)) return API_STORE_UNAVAILABLE;
  char folder[3] = {id[0], id[1], '\0'}, object[NAME_SIZE], beside[NAME_SIZE];
  object_name(id, object);
  summary_name(id, beside);
  bool object_there = is_there(store, object);
  if (object_there && is_there(store, beside)) {
    *existed = true;
    return API_STORE_OK;
  }
  api_bytes text = {(const uint8_t *)summary, strlen(summary)};
  if (!make_prefix_folder(store, folder)) return unavailable("cannot make a folder");
  placed outcome = object_there ? PLACED_BEFORE : place(store, object, bytes);
  if (outcome == PLACE_FAILED) return unavailable("cannot write a model");
  if (place(store, beside, text) == PLACE_FAILED) {
    int reason = errno;
    if (outcome == PLACED) unlinkat(store->objects, object, 0);
    errno = reason;
    return unavailable("cannot write a summary");
  }
  if (!sync_folder(store->objects, folder)) return unavailable("cannot sync");
  *existed = outcome == PLACED_BEFORE;
  return API_STORE_OK;
}

static api_store_status drop(void *context, const char *id) {
  srv_store_fs *store = context;
  if (!is_id(id)) return API_STORE_ABSENT;
  char folder[3] = {id[0], id[1], '\0'}, object[NAME_SIZE], beside[NAME_SIZE];
  object_name(id, object);
  summary_name(id, beside);
  if (unlinkat(store->objects, object, 0) != 0) {
    return errno == ENOENT ? API_STORE_ABSENT : unavailable("cannot remove a model");
  }
  if (unlinkat(store->objects, beside, 0) != 0 && errno != ENOENT)
    return unavailable("cannot remove a summary");
  return sync_folder(store->objects, folder) ? API_STORE_OK : unavailable("cannot sync");
}

/* ---- reading --------------------------------------------------------------------------------- */

static void unmap(api_blob *blob) {
  if (blob->owner != NULL) munmap(blob->owner, blob->bytes.size);
  *blob = (api_blob){0};
}

static api_store_status map(int fd, api_blob *out) {
  struct stat facts;
  if (fstat(fd, &facts) != 0 || (uint64_t)facts.st_size > SIZE_MAX) return unavailable("cannot read a model");
  size_t size = (size_t)facts.st_size;
  void *mapping = NULL;
  if (size > 0) {
    mapping = mmap(NULL, size, PROT_READ, MAP_PRIVATE, fd, 0);
    if (mapping == MAP_FAILED) return unavailable("cannot map a model");
  }
  *out = (api_blob){.bytes = {size > 0 ? mapping : "", size}, .owner = mapping, .release = unmap};
  return API_STORE_OK;
}

static api_store_status get(void *context, const char *id, api_blob *out) {
  srv_store_fs *store = context;
  if (!is_id(id)) return API_STORE_ABSENT;
  char name[NAME_SIZE];
  object_name(id, name);
  int fd = openat(store->objects, name, O_RDONLY | O_CLOEXEC);
  if (fd < 0) return errno == ENOENT ? API_STORE_ABSENT : unavailable("cannot open a model");
  api_store_status status = map(fd, out);
  close(fd);
  return status;
}

/* NULL when it is lost. */
static char *read_summary(const srv_store_fs *store, const char *id) {
  char name[NAME_SIZE];
  summary_name(id, name);
  int fd = openat(store->objects, name, O_RDONLY | O_CLOEXEC);
  if (fd < 0) return NULL;
  struct stat facts;
  char *text = NULL;
  if (fstat(fd, &facts) == 0 && facts.st_size >= 0 && facts.st_size <= SUMMARY_MAX) {
    size_t size = (size_t)facts.st_size;
    text = malloc(size + 1);
    if (text != NULL && read(fd, text, size) != (ssize_t)size) {
      free(text);
      text = NULL;
    }
    if (text != NULL) text[size] = '\0';
  }
  close(fd);
  return text;
}

/* ---- listing --------------------------------------------------------------------------------- */

/* The smallest ids seen so far, ascending: memory depends on the page, not on the store. */
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
static bool collect(const srv_store_fs *store, unsigned prefix, const char *after, page *p) {
  char folder[3];
  snprintf(folder, sizeof folder, "%02x", prefix);
  DIR *listing = open_listing(store->objects, folder);
  if (listing == NULL) return errno == ENOENT;
  for (struct dirent *entry = readdir(listing); entry != NULL; entry = readdir(listing)) {
    if (is_id(entry->d_name) && strcmp(entry->d_name, after) > 0) page_insert(p, entry->d_name);
  }
  closedir(listing);
  return true;
}

static unsigned first_prefix(const char *after) {
  char folder[3] = {0};
  if (after[0] == '\0') return 0;
  memcpy(folder, after, 2);
  return (unsigned)strtoul(folder, NULL, 16);
}

/* Collects one more than asked for, to know whether others follow. */
static api_store_status list_ids(const srv_store_fs *store, const char *after, page *p) {
  for (unsigned prefix = first_prefix(after); prefix <= 0xff && p->count < p->capacity; prefix++) {
    if (!collect(store, prefix, after, p)) return unavailable("cannot list");
  }
  return API_STORE_OK;
}

static size_t describe(const srv_store_fs *store, const page *p, size_t limit, api_listed *out) {
  size_t count = 0;
  for (size_t i = 0; i < p->count && i < limit; i++) {
    char name[NAME_SIZE];
    struct stat facts;
    object_name(p->ids[i], name);
    if (fstatat(store->objects, name, &facts, 0) != 0) continue; /* removed since */
    out[count] = (api_listed){.size = (uint64_t)facts.st_size, .summary = read_summary(store, p->ids[i])};
    memcpy(out[count].id, p->ids[i], API_ID_TEXT);
    count++;
  }
  return count;
}

static api_store_status list(void *context, const char *after, size_t limit, api_listed *out, size_t *count,
                             bool *more) {
  srv_store_fs *store = context;
  if (after[0] != '\0' && !is_id(after)) return API_STORE_UNAVAILABLE;
  if (limit >= SIZE_MAX / API_ID_TEXT) return API_STORE_UNAVAILABLE;
  page p = {.ids = calloc(limit + 1, API_ID_TEXT), .capacity = limit + 1};
  if (p.ids == NULL) return API_STORE_UNAVAILABLE;
  api_store_status status = list_ids(store, after, &p);
  if (status == API_STORE_OK) {
    *more = p.count > limit;
    *count = describe(store, &p, limit, out);
  }
  free(p.ids);
  return status;
}

api_store srv_store_fs_api(srv_store_fs *store) {
  return (api_store){.context = store, .put = put, .get = get, .remove = drop, .list = list};
}
