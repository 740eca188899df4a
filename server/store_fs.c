/* Layout of the folder:
 *   objects/ab/ID      the bytes of a model, unchanged; ab is the start of ID
 *   summaries/ab/REST  its summary; REST is ID without ab. The api makes a lost summary again
 *   tmp/               files that are being written
 *
 * A model exists exactly when its object does. An object is written in tmp/, synced, and renamed into place;
 * then the folders are synced. So a kill or a power failure at any moment leaves either nothing or the whole
 * model. Only `drop` unlinks an object that may have been confirmed: `put` replaces a damaged object by
 * renaming a whole one over it.
 *
 * The summary of a new model is written before its object: another process that finds the object finds the
 * name that the model was stored under, and does not make a summary without it.
 *
 * Processes, containers and hosts may share the folder. They need no locks: names in tmp/ are random, and a
 * rename either creates a name or finds that it exists. Within this process an object and its summary are
 * written, and removed, under a lock: of uploads of a model at once, the first one's summary counts.
 *
 * Everything created below the folder gives the folder's group the rights that it has on the folder, so that
 * processes of several users can share it.
 *
 * Each call looks its paths up, so that a folder that vanished and came back is used again. */
#include "store_fs.h"

#include "disk.h"
#include "log.h"
#include "machine.h"
#include "store_fs_layout.h"
#include "store_fs_list.h"
#include "store_prober.h"
#include "store_quota.h"
#include "store_verdicts.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <nettle/sha2.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum {
  PIECE = 64 << 10,
  LOCKS = 64,
  LEFTOVER_AGE_S = 3600 /* longer than any upload writes, even on hosts with inexact clocks */
};

struct srv_store_fs {
  char root[SRV_STORE_ROOT_MAX];
  char temporary[PATH_MAX];
  dev_t device;      /* file system of the root */
  mode_t group_mode; /* the group's rights on the root, given to everything below it */
  srv_store_quota quota;
  uint64_t min_free; /* see srv_store_fs_limit */
  srv_verdicts *verdicts;
  pthread_mutex_t changing[LOCKS]; /* by id: held while a model is stored or removed */
  srv_prober prober;
};

/* ---- folders --------------------------------------------------------------------------------- */

static bool sync_folder(const char *folder) {
  int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return false;
  bool synced = fsync(fd) == 0;
  close(fd);
  return synced;
}

/* Creates a folder with the group's rights of the root, whatever the umask. True when it exists already. */
static bool make_folder(const srv_store_fs *store, const char *folder) {
  if (mkdir(folder, 0700) != 0) return errno == EEXIST;
  return store->group_mode == 0 || chmod(folder, 0700 | store->group_mode) == 0;
}

/* Creates the missing subfolders of the root, but only on the file system that the root was first on: where a
 * volume was unmounted, models would be stored in the folder that it covered. */
static bool make_folders(const srv_store_fs *store) {
  static const char *const folders[] = {"objects", "summaries", "tmp"};
  struct stat root;
  bool made = false;
  if (stat(store->root, &root) != 0) return false;
  for (size_t i = 0; i < sizeof folders / sizeof *folders; i++) {
    srv_path folder = srv_store_folder_path(store->root, folders[i]);
    if (access(folder.text, F_OK) == 0) continue;
    if (root.st_dev != store->device || !make_folder(store, folder.text)) return false;
    made = true;
  }
  return !made || sync_folder(store->root);
}

/* Tries the folder: writes a file and removes it. now: receives the time by the file system's clock, which
 * may be that of another host. False with errno. */
static bool try_folder(const srv_store_fs *store, time_t *now) {
  char temporary[PATH_MAX];
  struct stat facts;
  srv_path objects = srv_store_folder_path(store->root, "objects/.");
  if (!make_folders(store) || access(objects.text, R_OK | W_OK | X_OK) != 0) return false;
  int fd = srv_create_temporary(store->temporary, temporary);
  if (fd < 0) return false;
  bool written = srv_write_all(fd, "tweend", 6) && fstat(fd, &facts) == 0;
  int reason = errno;
  close(fd);
  unlink(temporary);
  errno = reason;
  if (written) *now = facts.st_mtime;
  return written;
}

static bool is_usable(void *store) {
  time_t now;
  return try_folder(store, &now);
}

static api_store_status probe(void *context) {
  srv_store_fs *store = context;
  return srv_prober_ask(&store->prober) ? API_STORE_OK : API_STORE_UNAVAILABLE;
}

/* ---- opening --------------------------------------------------------------------------------- */

/* Removes temporary files of killed uploads. Younger files may belong to another process. */
static void remove_leftovers(const srv_store_fs *store, time_t now) {
  DIR *listing = opendir(store->temporary);
  if (!listing) return;
  for (struct dirent *entry = readdir(listing); entry; entry = readdir(listing)) {
    struct stat facts;
    bool old = fstatat(dirfd(listing), entry->d_name, &facts, AT_SYMLINK_NOFOLLOW) == 0 &&
               S_ISREG(facts.st_mode) && facts.st_mtime < now - LEFTOVER_AGE_S;
    if (old && unlinkat(dirfd(listing), entry->d_name, 0) == 0) {
      srv_log(SRV_LOG_INFO, "store: removed %s, left by a killed upload", entry->d_name);
    }
  }
  closedir(listing);
}

/* Creates the folder and its missing parents. False with errno. */
static bool make_path(const char *folder) {
  srv_path made;
  snprintf(made.text, sizeof made.text, "%s", folder);
  for (char *end = made.text + 1;; end++) {
    end += strcspn(end, "/");
    char separator = *end;
    *end = '\0';
    if (mkdir(made.text, 0700) == 0) {
      srv_path parent;
      snprintf(parent.text, sizeof parent.text, "%.*s/..", SRV_STORE_ROOT_MAX, made.text);
      if (!sync_folder(parent.text)) return false;
    } else if (errno != EEXIST && access(made.text, F_OK) != 0) {
      return false;
    }
    if (separator == '\0') return true;
    *end = separator;
  }
}

/* Creates the root and records its device and its group's rights. False with errno. */
static bool prepare_root(srv_store_fs *store) {
  struct stat root;
  if (!make_path(store->root)) return false;
  if (stat(store->root, &root) != 0) return false;
  store->device = root.st_dev;
  store->group_mode = root.st_mode & (S_ISGID | S_IRWXG);
  return true;
}

static void destroy(srv_store_fs *store) {
  for (size_t i = 0; i < LOCKS; i++) pthread_mutex_destroy(&store->changing[i]);
  srv_store_quota_deinit(&store->quota);
  srv_verdicts_destroy(store->verdicts);
  free(store);
}

static bool fits(const char *flag, const char *root, srv_error *error) {
  if (strlen(root) < SRV_STORE_ROOT_MAX) return true;
  return srv_fail(error, "%s: the path is longer than %d bytes", flag, SRV_STORE_ROOT_MAX - 1);
}

srv_store_fs *srv_store_fs_open(const char *flag, const char *root, srv_error *error) {
  if (!fits(flag, root, error)) return NULL;
  srv_store_fs *store = calloc(1, sizeof *store);
  srv_verdicts *verdicts = srv_verdicts_create();
  if (!store || !verdicts) {
    srv_fail(error, "%s: out of memory", flag);
    free(store);
    srv_verdicts_destroy(verdicts);
    return NULL;
  }
  store->verdicts = verdicts;
  for (size_t i = 0; i < LOCKS; i++) pthread_mutex_init(&store->changing[i], NULL);
  strcpy(store->root, root);
  srv_path temporary = srv_store_folder_path(store->root, "tmp");
  memcpy(store->temporary, temporary.text, sizeof store->temporary);
  srv_path objects = srv_store_folder_path(store->root, "objects");
  srv_store_quota_init(&store->quota, objects.text);
  time_t now;
  if (!prepare_root(store) || !try_folder(store, &now)) {
    srv_fail(error, "%s: cannot use folder '%s': %s", flag, root, strerror(errno));
    destroy(store);
    return NULL;
  }
  remove_leftovers(store, now);
  store->prober = (srv_prober){.folder = store->root, .attempt = is_usable, .context = store};
  srv_prober_init(&store->prober);
  return store;
}

bool srv_store_fs_check(const char *flag, const char *root, srv_error *error) {
  srv_path nearest;
  if (!fits(flag, root, error)) return false;
  snprintf(nearest.text, sizeof nearest.text, "%s", root);
  while (access(nearest.text, F_OK) != 0 && errno == ENOENT) {
    char *end = strrchr(nearest.text, '/');
    if (end == nearest.text) end++;
    if (!end) strcpy(nearest.text, ".");
    if (!end || *end == '\0') break;
    *end = '\0';
  }
  struct stat facts;
  bool is_folder = stat(nearest.text, &facts) == 0 && (S_ISDIR(facts.st_mode) || (errno = ENOTDIR, false));
  if (is_folder && access(nearest.text, R_OK | W_OK | X_OK) == 0) return true;
  return srv_fail(error, "%s: cannot use folder '%s': %s", flag, root, strerror(errno));
}

void srv_store_fs_close(srv_store_fs *store) {
  if (store && srv_prober_stop(&store->prober)) destroy(store);
}

void srv_store_fs_limit(srv_store_fs *store, uint64_t bytes, uint64_t min_free) {
  srv_store_quota_limit(&store->quota, bytes);
  store->min_free = min_free;
}

uint64_t srv_store_fs_used(srv_store_fs *store) {
  return srv_store_quota_used(&store->quota);
}

const char *srv_store_fs_temporary(const srv_store_fs *store) {
  return store->temporary;
}

/* ---- writing --------------------------------------------------------------------------------- */

typedef enum placed { PLACED, PLACED_BEFORE, PLACE_FAILED } placed;

/* Renames without replacing: of several writers of one name, one succeeds; the others get PLACED_BEFORE. */
static placed rename_new(const char *temporary, const char *name) {
  if (renameat2(AT_FDCWD, temporary, AT_FDCWD, name, RENAME_NOREPLACE) == 0) return PLACED;
  if (errno == EEXIST) return PLACED_BEFORE;
  /* Some file systems cannot refuse to replace. Replacing does no harm, as the bytes are the same. */
  bool unable = errno == EINVAL || errno == ENOSYS;
  return unable && rename(temporary, name) == 0 ? PLACED : PLACE_FAILED;
}

/* Writes the bytes to the file `name`; durable once the folder is synced too. Failure sets errno. */
static placed place(const srv_store_fs *store, const char *name, api_bytes bytes, bool replaces) {
  char temporary[PATH_MAX];
  int fd = srv_create_temporary(store->temporary, temporary);
  if (fd < 0) return PLACE_FAILED;
  placed outcome = PLACE_FAILED;
  bool is_open = store->group_mode == 0 || fchmod(fd, 0600 | (store->group_mode & 0060)) == 0;
  if (is_open && srv_write_all(fd, bytes.data, bytes.size) && fsync(fd) == 0) {
    if (!replaces)
      outcome = rename_new(temporary, name);
    else if (rename(temporary, name) == 0)
      outcome = PLACED;
  }
  int reason = errno;
  if (outcome != PLACED) unlink(temporary);
  close(fd);
  errno = reason;
  return outcome;
}

static bool holds(int fd, api_bytes bytes) {
  uint8_t piece[PIECE];
  struct stat facts;
  if (fstat(fd, &facts) != 0 || (uint64_t)facts.st_size != bytes.size) return false;
  for (size_t at = 0; at < bytes.size; at += sizeof piece) {
    size_t size = bytes.size - at < sizeof piece ? bytes.size - at : sizeof piece;
    if (srv_read_at(fd, piece, size, at) != (ptrdiff_t)size) return false;
    if (memcmp(piece, bytes.data + at, size) != 0) return false;
  }
  return true;
}

typedef enum found { NOTHING, WHOLE_BEFORE, DAMAGED_BEFORE, FIND_FAILED } found;

/* Whether the object holds these bytes. Syncs it, since another writer may not have done so yet. */
static found find_object(const char *name, api_bytes bytes) {
  int fd = open(name, O_RDONLY | O_CLOEXEC);
  if (fd < 0) return errno == ENOENT ? NOTHING : FIND_FAILED;
  bool whole = holds(fd, bytes) && fsync(fd) == 0;
  close(fd);
  return whole ? WHOLE_BEFORE : DAMAGED_BEFORE;
}

/* The lock for changing a model. Ids are hashes, so their first digits spread models evenly over the locks.
 */
static pthread_mutex_t *lock_of(srv_store_fs *store, const char *id) {
  const char first[] = {id[0], id[1], '\0'};
  return &store->changing[strtoul(first, NULL, 16) % LOCKS];
}

static char *summary_of(void *context, const char *id) {
  srv_store_fs *store = context;
  if (!srv_store_is_id(id)) return NULL;
  srv_path name = srv_store_object_path(store->root, id);
  if (access(name.text, F_OK) != 0) return NULL;
  char *text = srv_store_read_summary(store->root, id);
  if (text) return text;
  /* Of a model whose summary is lost, one that is being written is there before the lock is free. */
  pthread_mutex_lock(lock_of(store, id));
  text = srv_store_read_summary(store->root, id);
  pthread_mutex_unlock(lock_of(store, id));
  return text;
}

/* Writes the summary if there is none: over a lost one, but not over one that another process has written
 * meanwhile. A failure is only logged: the model is stored without it. Returns whether it wrote one. */
static bool put_summary(const srv_store_fs *store, const char *id, const char *summary) {
  srv_path folder = srv_store_prefix_path(store->root, "summaries", id),
           name = srv_store_summary_path(store->root, id);
  char *known = srv_store_read_summary(store->root, id);
  api_bytes text = {(const uint8_t *)summary, strlen(summary)};
  bool is_lost = !known && access(name.text, F_OK) == 0;
  placed outcome = PLACED_BEFORE;
  if (!known)
    outcome = make_folder(store, folder.text) ? place(store, name.text, text, is_lost) : PLACE_FAILED;
  if (outcome == PLACE_FAILED)
    srv_log(SRV_LOG_WARN, "store: cannot write the summary of model %s: %s", id, strerror(errno));
  free(known);
  return outcome == PLACED;
}

/* Removes the summary of a model whose object could not be written, unless another process wrote the object.
 */
static void take_summary_back(const srv_store_fs *store, const char *id) {
  srv_path object = srv_store_object_path(store->root, id), summary = srv_store_summary_path(store->root, id);
  int problem = errno;
  if (access(object.text, F_OK) != 0) unlink(summary.text);
  errno = problem;
}

/* Whether --min-free stays free. */
static api_store_status room(void *context, uint64_t size) {
  const srv_store_fs *store = context;
  return srv_disk_has_room(store->root, store->min_free, size) ? API_STORE_OK : API_STORE_FULL;
}

static api_store_status put_locked(srv_store_fs *store, const char *id, api_bytes bytes, const char *summary,
                                   bool *existed) {
  srv_path objects = srv_store_folder_path(store->root, "objects"),
           folder = srv_store_prefix_path(store->root, "objects", id);
  srv_path name = srv_store_object_path(store->root, id);
  if (!make_folders(store) || !make_folder(store, folder.text))
    return srv_store_unavailable("cannot make a folder");
  found before = find_object(name.text, bytes);
  if (before == FIND_FAILED) return srv_store_unavailable("cannot open a model");
  if (before == NOTHING && room(store, bytes.size) == API_STORE_FULL) return API_STORE_FULL;
  if (before == NOTHING && !srv_store_quota_take(&store->quota, bytes.size)) return API_STORE_FULL;
  bool has_summarised = put_summary(store, id, summary);
  placed outcome =
      before == WHOLE_BEFORE ? PLACED_BEFORE : place(store, name.text, bytes, before == DAMAGED_BEFORE);
  if (outcome == PLACE_FAILED && has_summarised) take_summary_back(store, id);
  if (before == NOTHING) srv_store_quota_settle(&store->quota, bytes.size, outcome == PLACED);
  if (outcome == PLACE_FAILED) return srv_store_unavailable("cannot write a model");
  /* Sync files that other processes made as well: they may be killed before they do. */
  if (!sync_folder(folder.text) || !sync_folder(objects.text)) return srv_store_unavailable("cannot sync");
  if (before == DAMAGED_BEFORE) {
    srv_log(SRV_LOG_WARN, "store: the damaged file of model %s is replaced by a whole one", id);
    srv_store_quota_count(&store->quota); /* whether the last count saw the damaged size is unknown */
  }
  const srv_verdict known = srv_verdicts_recall(store->verdicts, id);
  srv_verdicts_note(store->verdicts, id, known.wholeness == SRV_WHOLE ? known.state : "", bytes.size,
                    SRV_WHOLE);
  *existed = outcome == PLACED_BEFORE;
  return API_STORE_OK;
}

static api_store_status put(void *context, const char *id, api_bytes bytes, const char *summary,
                            bool *existed) {
  srv_store_fs *store = context;
  if (!srv_store_is_id(id)) return API_STORE_UNAVAILABLE;
  pthread_mutex_lock(lock_of(store, id));
  api_store_status status = put_locked(store, id, bytes, summary, existed);
  pthread_mutex_unlock(lock_of(store, id));
  return status;
}

static api_store_status drop_locked(srv_store_fs *store, const char *id) {
  srv_path folder = srv_store_prefix_path(store->root, "objects", id),
           object = srv_store_object_path(store->root, id);
  srv_path summary = srv_store_summary_path(store->root, id);
  struct stat facts = {0};
  bool is_sized = stat(object.text, &facts) == 0;
  if (unlink(object.text) != 0)
    return errno == ENOENT ? srv_store_not_found(store->root)
                           : srv_store_unavailable("cannot remove a model");
  if (is_sized) srv_store_quota_give_back(&store->quota, (uint64_t)facts.st_size);
  unlink(summary.text);
  srv_verdicts_forget(store->verdicts, id);
  return sync_folder(folder.text) ? API_STORE_OK : srv_store_unavailable("cannot sync");
}

static api_store_status drop(void *context, const char *id) {
  srv_store_fs *store = context;
  if (!srv_store_is_id(id)) return API_STORE_ABSENT;
  pthread_mutex_lock(lock_of(store, id));
  api_store_status status = drop_locked(store, id);
  pthread_mutex_unlock(lock_of(store, id));
  return status;
}

/* ---- judging files --------------------------------------------------------------------------- */

/* Prints a state that differs after each change of the file: its inode, size and times. */
static void print_state(const struct stat *facts, char out[SRV_STATE_SIZE]) {
  snprintf(out, SRV_STATE_SIZE, "%jx %jx %jx %jd.%09ld %jd.%09ld", (uintmax_t)facts->st_dev,
           (uintmax_t)facts->st_ino, (uintmax_t)facts->st_size, (intmax_t)facts->st_mtim.tv_sec,
           facts->st_mtim.tv_nsec, (intmax_t)facts->st_ctim.tv_sec, facts->st_ctim.tv_nsec);
}

/* Whether a file that was changed at `changed` would get another state by a change from `now` on: file times
 * advance in ticks of the kernel. */
static bool is_settled(const struct timespec *changed, const struct timespec *now) {
  static const int64_t TICK_NS = 100000000;
  return (int64_t)(now->tv_sec - changed->tv_sec) * 1000000000 + now->tv_nsec - changed->tv_nsec >= TICK_NS;
}

/* Whether the file's hash is its id. False when the file cannot be read. */
static bool hash_matches(int fd, const char *id, uint64_t size, bool *matches) {
  struct sha256_ctx hash;
  uint8_t piece[PIECE];
  sha256_init(&hash);
  for (uint64_t at = 0; at < size; at += sizeof piece) {
    ptrdiff_t got = srv_read_at(fd, piece, sizeof piece, at);
    if (got < 0) return false;
    sha256_update(&hash, (size_t)got, piece);
  }
  *matches = srv_store_is_hash(&hash, id);
  return true;
}

/* Whether the file holds the bytes whose hash is its id. Hashes the file once for each of its states. False
 * when it cannot be read. */
static bool judge(srv_store_fs *store, int fd, const char *id, const struct stat *facts, bool *whole) {
  const srv_verdict known = srv_verdicts_recall(store->verdicts, id);
  char state[SRV_STATE_SIZE];
  struct timespec now;
  print_state(facts, state);
  clock_gettime(CLOCK_REALTIME, &now);
  *whole = known.wholeness == SRV_WHOLE;
  if (!srv_verdict_is_of(&known, state)) {
    if (!hash_matches(fd, id, (uint64_t)facts->st_size, whole)) return false;
    if (!is_settled(&facts->st_ctim, &now)) state[0] = '\0';
  }
  srv_verdicts_note(store->verdicts, id, state, (uint64_t)facts->st_size, *whole ? SRV_WHOLE : SRV_DAMAGED);
  return true;
}

/* ---- reading --------------------------------------------------------------------------------- */

typedef struct object {
  int fd;
  char id[API_ID_TEXT];
  struct stat facts;
} object;

/* Reads without mmap: a file that is truncated meanwhile would raise SIGBUS and end the process. */
static bool read_object(const api_blob *blob, uint64_t offset, uint8_t *out, size_t size) {
  const object *o = blob->owner;
  struct stat facts;
  bool is_read = srv_read_at(o->fd, out, size, offset) == (ptrdiff_t)size && fstat(o->fd, &facts) == 0;
  if (is_read && facts.st_size == o->facts.st_size &&
      memcmp(&facts.st_mtim, &o->facts.st_mtim, sizeof facts.st_mtim) == 0)
    return true;
  srv_log(SRV_LOG_ERROR, "store: the file of model %s was changed or failed while it was read", o->id);
  return false;
}

static void close_object(api_blob *blob) {
  object *o = blob->owner;
  close(o->fd);
  free(o);
  *blob = (api_blob){0};
}

static api_store_status open_file(srv_store_fs *store, int fd, const char *id, api_blob *out) {
  object *o = malloc(sizeof *o);
  bool whole;
  if (o && fstat(fd, &o->facts) == 0 && judge(store, fd, id, &o->facts, &whole)) {
    if (whole) {
      o->fd = fd;
      memcpy(o->id, id, sizeof o->id);
      *out = (api_blob){
          .size = (uint64_t)o->facts.st_size, .owner = o, .read = read_object, .close = close_object};
      return API_STORE_OK;
    }
    srv_log(SRV_LOG_ERROR, "store: model %s is damaged: the %llu bytes of its file are not those uploaded",
            id, (unsigned long long)o->facts.st_size);
    free(o);
    return API_STORE_DAMAGED;
  }
  free(o);
  return srv_store_unavailable("cannot read a model");
}

static api_store_status open_object(void *context, const char *id, api_blob *out) {
  srv_store_fs *store = context;
  if (!srv_store_is_id(id)) return API_STORE_ABSENT;
  srv_path name = srv_store_object_path(store->root, id);
  int fd = open(name.text, O_RDONLY | O_CLOEXEC);
  if (fd < 0 && errno == ENOENT) {
    srv_verdicts_forget(store->verdicts, id);
    return srv_store_not_found(store->root);
  }
  if (fd < 0) return srv_store_unavailable("cannot open a model");
  api_store_status status = open_file(store, fd, id, out);
  if (status != API_STORE_OK) close(fd);
  return status;
}

/* Checks a model that exists and is whole at most once a second. */
static api_store_status look(void *context, const char *id, bool may_wait) {
  srv_store_fs *store = context;
  if (!srv_store_is_id(id)) return API_STORE_ABSENT;
  const srv_verdict known = srv_verdicts_recall(store->verdicts, id);
  if (srv_verdict_is_fresh(&known)) return API_STORE_OK;
  if (!may_wait) return API_STORE_UNKNOWN;
  api_blob blob;
  api_store_status status = open_object(store, id, &blob);
  if (status == API_STORE_OK) blob.close(&blob);
  return status;
}

/* ---- the store ------------------------------------------------------------------------------- */

static api_store_status list(void *context, const char *after, size_t limit, api_listed *out, size_t *count,
                             bool *more) {
  return srv_store_fs_list(((const srv_store_fs *)context)->root, after, limit, out, count, more);
}

api_store srv_store_fs_api(srv_store_fs *store) {
  return (api_store){.context = store,
                     .put = put,
                     .open = open_object,
                     .remove = drop,
                     .summary = summary_of,
                     .look = look,
                     .list = list,
                     .probe = probe,
                     .room = room};
}
