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
 * Processes, containers and hosts may share the folder. They need no locks: names in tmp/ are random, and a
 * rename either creates a name or finds that it exists.
 *
 * Everything created below the folder gives the folder's group the rights that it has on the folder, so that
 * processes of several users can share it.
 *
 * Each call looks its paths up, so that a folder that vanished and came back is used again. */
#include "store_fs.h"

#include "disk.h"
#include "log.h"
#include "machine.h"
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
  ROOT_MAX = PATH_MAX - 128, /* leaves room for the names below the root */
  SUMMARY_MAX = 1 << 20,
  PIECE = 64 << 10,
  LEFTOVER_AGE_S = 3600 /* longer than any upload writes, even on hosts with inexact clocks */
};

/* The prober tries the folder every PROBE_NS, until no probe has been asked for during QUIET_NS. A try that
 * takes longer than HANG_NS counts as failed. */
static const uint64_t PROBE_NS = 1000000000, QUIET_NS = 60000000000, HANG_NS = 5000000000;

struct srv_store_fs {
  char root[ROOT_MAX];
  char temporary[PATH_MAX];
  dev_t device;      /* file system of the root */
  mode_t group_mode; /* the group's rights on the root, given to everything below it */
  srv_store_quota quota;
  uint64_t min_free; /* see srv_store_fs_limit */
  srv_verdicts *verdicts;
  pthread_t prober;           /* valid with is_probed */
  pthread_mutex_t probe_lock; /* guards the members below */
  pthread_cond_t probe_wake;
  uint64_t asked_ns, trying_ns; /* time of the last probe call; start of the present try, 0: none */
  bool is_usable;               /* result of the last try */
  bool is_probed;               /* the prober was started */
  bool is_closing;
};

static api_store_status unavailable(const char *what) {
  bool is_full = errno == ENOSPC || errno == EDQUOT;
  srv_log(SRV_LOG_ERROR, "store: %s: %s", what, strerror(errno));
  return is_full ? API_STORE_FULL : API_STORE_UNAVAILABLE;
}

/* ---- paths ----------------------------------------------------------------------------------- */

/* A path below the root: always fits, see ROOT_MAX. */
typedef struct path {
  char text[PATH_MAX];
} path;

static path folder_path(const srv_store_fs *store, const char *name) {
  path p;
  snprintf(p.text, sizeof p.text, "%s/%s", store->root, name);
  return p;
}

/* objects/ab or summaries/ab */
static path prefix_path(const srv_store_fs *store, const char *kind, const char *id) {
  path p;
  snprintf(p.text, sizeof p.text, "%s/%s/%.2s", store->root, kind, id);
  return p;
}

static path object_path(const srv_store_fs *store, const char *id) {
  path p;
  snprintf(p.text, sizeof p.text, "%s/objects/%.2s/%s", store->root, id, id);
  return p;
}

static path summary_path(const srv_store_fs *store, const char *id) {
  path p;
  snprintf(p.text, sizeof p.text, "%s/summaries/%.2s/%s", store->root, id, id + 2);
  return p;
}

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
  static const char *const NAMES[] = {"objects", "summaries", "tmp"};
  struct stat root;
  bool made = false;
  if (stat(store->root, &root) != 0) return false;
  for (size_t i = 0; i < sizeof NAMES / sizeof *NAMES; i++) {
    path folder = folder_path(store, NAMES[i]);
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
  path objects = folder_path(store, "objects/.");
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

/* The status after ENOENT: absent if objects/ exists, else unavailable. */
static api_store_status not_found(const srv_store_fs *store) {
  path objects = folder_path(store, "objects/.");
  return access(objects.text, F_OK) == 0 ? API_STORE_ABSENT : unavailable("cannot find the folder of models");
}

/* ---- probing --------------------------------------------------------------------------------- */

/* Tries the folder once. Called with the lock held; releases it meanwhile. */
static void try_once(srv_store_fs *store) {
  time_t now;
  store->trying_ns = srv_now_ns();
  pthread_mutex_unlock(&store->probe_lock);
  bool is_usable = try_folder(store, &now);
  int reason = errno;
  pthread_mutex_lock(&store->probe_lock);
  if (store->is_usable && !is_usable)
    srv_log(SRV_LOG_ERROR, "store: cannot use folder '%s': %s", store->root, strerror(reason));
  if (!store->is_usable && is_usable)
    srv_log(SRV_LOG_INFO, "store: folder '%s' can be used again", store->root);
  store->is_usable = is_usable;
  store->trying_ns = 0;
}

/* The prober's thread. It is separate so that a file system that hangs blocks no other thread. */
static void *run_probes(void *context) {
  srv_store_fs *store = context;
  pthread_mutex_lock(&store->probe_lock);
  while (!store->is_closing) {
    uint64_t now_ns = srv_now_ns();
    if (store->asked_ns == 0 || now_ns - store->asked_ns > QUIET_NS) {
      pthread_cond_wait(&store->probe_wake, &store->probe_lock);
    } else {
      try_once(store);
      if (!store->is_closing) srv_timed_wait(&store->probe_wake, &store->probe_lock, now_ns + PROBE_NS);
    }
  }
  pthread_mutex_unlock(&store->probe_lock);
  return NULL;
}

static void init_probes(srv_store_fs *store) {
  pthread_mutex_init(&store->probe_lock, NULL);
  srv_timed_init(&store->probe_wake);
  store->is_usable = true;
}

/* Stops the prober. False when its try hangs: the thread then goes on using the store. */
static bool stop_probes(srv_store_fs *store) {
  pthread_mutex_lock(&store->probe_lock);
  store->is_closing = true;
  pthread_cond_signal(&store->probe_wake);
  pthread_mutex_unlock(&store->probe_lock);
  if (store->is_probed && !srv_join_soon(store->prober)) return false;
  pthread_mutex_destroy(&store->probe_lock);
  pthread_cond_destroy(&store->probe_wake);
  return true;
}

static api_store_status probe(void *context) {
  srv_store_fs *store = context;
  pthread_mutex_lock(&store->probe_lock);
  uint64_t now_ns = srv_now_ns();
  bool rested = now_ns - store->asked_ns > QUIET_NS;
  if (rested) pthread_cond_signal(&store->probe_wake);
  store->asked_ns = now_ns;
  int reason = store->is_probed ? 0 : pthread_create(&store->prober, NULL, run_probes, store);
  if (reason != 0) srv_log(SRV_LOG_ERROR, "store: no thread to try the folder: %s", strerror(reason));
  store->is_probed = reason == 0;
  bool hangs = store->trying_ns != 0 && now_ns - store->trying_ns > HANG_NS;
  bool is_usable = store->is_probed && store->is_usable && !hangs;
  pthread_mutex_unlock(&store->probe_lock);
  return is_usable ? API_STORE_OK : API_STORE_UNAVAILABLE;
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
  path made;
  snprintf(made.text, sizeof made.text, "%s", folder);
  for (char *end = made.text + 1;; end++) {
    end += strcspn(end, "/");
    char separator = *end;
    *end = '\0';
    if (mkdir(made.text, 0700) == 0) {
      path parent;
      snprintf(parent.text, sizeof parent.text, "%.*s/..", ROOT_MAX, made.text);
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
  srv_store_quota_deinit(&store->quota);
  srv_verdicts_destroy(store->verdicts);
  free(store);
}

static bool fits(const char *flag, const char *root, srv_error *error) {
  if (strlen(root) < ROOT_MAX) return true;
  return srv_fail(error, "%s: the path is longer than %d bytes", flag, ROOT_MAX - 1);
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
  strcpy(store->root, root);
  path temporary = folder_path(store, "tmp");
  memcpy(store->temporary, temporary.text, sizeof store->temporary);
  path objects = folder_path(store, "objects");
  srv_store_quota_init(&store->quota, objects.text);
  time_t now;
  if (!prepare_root(store) || !try_folder(store, &now)) {
    srv_fail(error, "%s: cannot use folder '%s': %s", flag, root, strerror(errno));
    destroy(store);
    return NULL;
  }
  remove_leftovers(store, now);
  init_probes(store);
  return store;
}

bool srv_store_fs_check(const char *flag, const char *root, srv_error *error) {
  path nearest;
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
  if (store && stop_probes(store)) destroy(store);
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

/* The summary; NULL when it is lost or empty, as a power failure may leave it. */
static char *read_summary(const srv_store_fs *store, const char *id) {
  path name = summary_path(store, id);
  char *text = srv_read_text(name.text, SUMMARY_MAX);
  if (text && text[0] != '\0') return text;
  free(text);
  return NULL;
}

static char *summary_of(void *context, const char *id) {
  const srv_store_fs *store = context;
  path name = object_path(store, id);
  return srv_store_is_id(id) && access(name.text, F_OK) == 0 ? read_summary(store, id) : NULL;
}

/* Writes the summary if there is none. A failure is only logged: the model is stored without it. */
static void put_summary(const srv_store_fs *store, const char *id, const char *summary) {
  path folder = prefix_path(store, "summaries", id), name = summary_path(store, id);
  char *known = read_summary(store, id);
  api_bytes text = {(const uint8_t *)summary, strlen(summary)};
  if (!known && (!make_folder(store, folder.text) || place(store, name.text, text, true) != PLACED))
    srv_log(SRV_LOG_WARN, "store: cannot write the summary of model %s: %s", id, strerror(errno));
  free(known);
}

/* Whether --min-free stays free. */
static api_store_status room(void *context, uint64_t size) {
  const srv_store_fs *store = context;
  return srv_disk_has_room(store->root, store->min_free, size) ? API_STORE_OK : API_STORE_FULL;
}

static api_store_status put(void *context, const char *id, api_bytes bytes, const char *summary,
                            bool *existed) {
  srv_store_fs *store = context;
  if (!srv_store_is_id(id)) return API_STORE_UNAVAILABLE;
  path objects = folder_path(store, "objects"), folder = prefix_path(store, "objects", id);
  path name = object_path(store, id);
  if (!make_folders(store) || !make_folder(store, folder.text)) return unavailable("cannot make a folder");
  found before = find_object(name.text, bytes);
  if (before == FIND_FAILED) return unavailable("cannot open a model");
  if (before == NOTHING && room(store, bytes.size) == API_STORE_FULL) return API_STORE_FULL;
  if (before == NOTHING && !srv_store_quota_take(&store->quota, bytes.size)) return API_STORE_FULL;
  placed outcome =
      before == WHOLE_BEFORE ? PLACED_BEFORE : place(store, name.text, bytes, before == DAMAGED_BEFORE);
  if (before == NOTHING) srv_store_quota_settle(&store->quota, bytes.size, outcome == PLACED);
  if (outcome == PLACE_FAILED) return unavailable("cannot write a model");
  /* Sync files that other processes made as well: they may be killed before they do. */
  if (!sync_folder(folder.text) || !sync_folder(objects.text)) return unavailable("cannot sync");
  if (before == DAMAGED_BEFORE) {
    srv_log(SRV_LOG_WARN, "store: the damaged file of model %s is replaced by a whole one", id);
    srv_store_quota_count(&store->quota); /* whether the last count saw the damaged size is unknown */
  }
  put_summary(store, id, summary);
  const srv_verdict known = srv_verdicts_recall(store->verdicts, id);
  srv_verdicts_note(store->verdicts, id, known.wholeness == SRV_WHOLE ? known.state : "", bytes.size,
                    SRV_WHOLE);
  *existed = outcome == PLACED_BEFORE;
  return API_STORE_OK;
}

static api_store_status drop(void *context, const char *id) {
  srv_store_fs *store = context;
  if (!srv_store_is_id(id)) return API_STORE_ABSENT;
  path folder = prefix_path(store, "objects", id), object = object_path(store, id);
  path summary = summary_path(store, id);
  struct stat facts = {0};
  bool is_sized = stat(object.text, &facts) == 0;
  if (unlink(object.text) != 0)
    return errno == ENOENT ? not_found(store) : unavailable("cannot remove a model");
  if (is_sized) srv_store_quota_give_back(&store->quota, (uint64_t)facts.st_size);
  unlink(summary.text);
  srv_verdicts_forget(store->verdicts, id);
  return sync_folder(folder.text) ? API_STORE_OK : unavailable("cannot sync");
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
  return unavailable("cannot read a model");
}

static api_store_status open_object(void *context, const char *id, api_blob *out) {
  srv_store_fs *store = context;
  if (!srv_store_is_id(id)) return API_STORE_ABSENT;
  path name = object_path(store, id);
  int fd = open(name.text, O_RDONLY | O_CLOEXEC);
  if (fd < 0 && errno == ENOENT) {
    srv_verdicts_forget(store->verdicts, id);
    return not_found(store);
  }
  if (fd < 0) return unavailable("cannot open a model");
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

/* ---- listing --------------------------------------------------------------------------------- */

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
static api_store_status collect(const srv_store_fs *store, unsigned prefix, const char *after, page *p) {
  char digits[3];
  snprintf(digits, sizeof digits, "%02x", prefix);
  path folder = prefix_path(store, "objects", digits);
  DIR *listing = opendir(folder.text);
  if (!listing) return errno == ENOENT ? API_STORE_OK : unavailable("cannot list");
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
static api_store_status list_ids(const srv_store_fs *store, const char *after, page *p) {
  api_store_status status = API_STORE_OK;
  for (unsigned prefix = first_prefix(after);
       prefix <= 0xff && p->count < p->capacity && status == API_STORE_OK; prefix++) {
    status = collect(store, prefix, after, p);
  }
  if (status != API_STORE_OK || p->count > 0) return status;
  return not_found(store) == API_STORE_ABSENT ? API_STORE_OK : API_STORE_UNAVAILABLE;
}

static size_t describe(const srv_store_fs *store, const page *p, size_t limit, api_listed *out) {
  size_t count = 0;
  for (size_t i = 0; i < p->count && i < limit; i++) {
    path name = object_path(store, p->ids[i]);
    struct stat facts;
    if (stat(name.text, &facts) != 0) continue; /* removed meanwhile */
    out[count] = (api_listed){.size = (uint64_t)facts.st_size, .summary = read_summary(store, p->ids[i])};
    memcpy(out[count].id, p->ids[i], API_ID_TEXT);
    count++;
  }
  return count;
}

static api_store_status list(void *context, const char *after, size_t limit, api_listed *out, size_t *count,
                             bool *more) {
  srv_store_fs *store = context;
  if (after[0] != '\0' && !srv_store_is_id(after)) return API_STORE_UNAVAILABLE;
  if (limit == 0 || limit >= SIZE_MAX / API_ID_TEXT) return API_STORE_UNAVAILABLE;
  page p = {.ids = calloc(limit + 1, API_ID_TEXT), .capacity = limit + 1};
  if (!p.ids) return API_STORE_UNAVAILABLE;
  char last[API_ID_TEXT];
  snprintf(last, sizeof last, "%s", after);
  api_store_status status;
  do { /* another round when all models of the page were removed meanwhile: an empty page ends the list */
    p.count = 0;
    status = list_ids(store, last, &p);
    if (status != API_STORE_OK) break;
    *more = p.count > limit;
    *count = describe(store, &p, limit, out);
    if (*more) memcpy(last, p.ids[limit - 1], sizeof last);
  } while (*more && *count == 0);
  free(p.ids);
  return status;
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
