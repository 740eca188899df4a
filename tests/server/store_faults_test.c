/* Every call to the file system fails once, in each way that it can: a model is then stored whole or not at
 * all, the daemon says which, nothing is left behind, and the next upload is stored. Linked with the calls
 * wrapped. */
#include "body.h"
#include "store_fixture.h"
#include "store_fs_layout.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- calls that fail ------------------------------------------------------------------------- */

enum { SHORT = -1 }; /* in place of an errno: half of what was asked for is done */

/* Of the test's own thread: that of the store tries the folder all the while. */
static _Thread_local struct {
  bool is_armed;
  unsigned left; /* calls until one fails */
  int reason;
  bool has_failed;
} fault;

static bool fails(bool can_be_short) {
  if (!fault.is_armed || fault.has_failed || (fault.reason == SHORT && !can_be_short)) return false;
  if (fault.left-- > 0) return false;
  fault.has_failed = true;
  if (fault.reason != SHORT) errno = fault.reason;
  return true;
}

/* The linker's --wrap gives these names.
 * NOLINTBEGIN(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */
ssize_t __real_write(int fd, const void *data, size_t size);
ssize_t __real_pread(int fd, void *out, size_t size, off_t offset);
int __real_open(const char *path, int flags, ...);
int __real_fsync(int fd);
int __real_mkdir(const char *path, mode_t mode);
int __real_rename(const char *from, const char *to);
int __real_renameat2(int from_folder, const char *from, int to_folder, const char *to, unsigned flags);
ssize_t __wrap_write(int fd, const void *data, size_t size);
ssize_t __wrap_pread(int fd, void *out, size_t size, off_t offset);
int __wrap_open(const char *path, int flags, ...);
int __wrap_fsync(int fd);
int __wrap_mkdir(const char *path, mode_t mode);
int __wrap_rename(const char *from, const char *to);
int __wrap_renameat2(int from_folder, const char *from, int to_folder, const char *to, unsigned flags);

ssize_t __wrap_write(int fd, const void *data, size_t size) {
  if (!fails(size > 1)) return __real_write(fd, data, size);
  return fault.reason == SHORT ? __real_write(fd, data, size / 2) : -1;
}

ssize_t __wrap_pread(int fd, void *out, size_t size, off_t offset) {
  if (!fails(size > 1)) return __real_pread(fd, out, size, offset);
  return fault.reason == SHORT ? __real_pread(fd, out, size / 2, offset) : -1;
}

int __wrap_open(const char *path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  mode_t mode = flags & O_CREAT ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  return fails(false) ? -1 : __real_open(path, flags, mode);
}

int __wrap_fsync(int fd) {
  return fails(false) ? -1 : __real_fsync(fd);
}

int __wrap_mkdir(const char *path, mode_t mode) {
  return fails(false) ? -1 : __real_mkdir(path, mode);
}

int __wrap_rename(const char *from, const char *to) {
  return fails(false) ? -1 : __real_rename(from, to);
}

int __wrap_renameat2(int from_folder, const char *from, int to_folder, const char *to, unsigned flags) {
  return fails(false) ? -1 : __real_renameat2(from_folder, from, to_folder, to, flags);
}
/* NOLINTEND(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */

static void arm(unsigned left, int reason) {
  fault.is_armed = true;
  fault.has_failed = false;
  fault.left = left;
  fault.reason = reason;
}

/* Whether a call has failed since. */
static bool disarm(void) {
  fault.is_armed = false;
  return fault.has_failed;
}

/* ---- a store --------------------------------------------------------------------------------- */

static int tear_down(void **state) {
  disarm();
  return tear_down_store(state);
}

enum { SIZE = 300000 };

static void make_model(unsigned number, char text[SIZE], char id[API_ID_TEXT]) {
  memset(text, 'x', SIZE);
  text[snprintf(text, 16, "%u", number)] = ' ';
  make_id(text, SIZE, id);
}

static api_store_status put(fixture *f, const char *id, const char *text) {
  bool existed;
  return f->store.put(f->store.context, id, (api_bytes){(const uint8_t *)text, SIZE}, "{\"n\":1}", &existed);
}

static bool is_whole(fixture *f, const char *id, const char *text) {
  api_blob blob;
  if (f->store.open(f->store.context, id, &blob) != API_STORE_OK) return false;
  char *bytes = malloc(SIZE);
  bool same =
      blob.size == SIZE && blob.read(&blob, 0, (uint8_t *)bytes, SIZE) && memcmp(bytes, text, SIZE) == 0;
  free(bytes);
  blob.close(&blob);
  return same;
}

static size_t leftovers(const fixture *f) {
  size_t count = 0;
  DIR *folder = opendir(srv_store_fs_temporary(f->opened));
  assert_non_null(folder);
  for (const struct dirent *entry; (entry = readdir(folder)) != NULL;) count += entry->d_name[0] != '.';
  closedir(folder);
  return count;
}

static const int REASONS[] = {EIO, ENOSPC, EDQUOT, EROFS, EMFILE, EINTR, SHORT};
enum { REASON_COUNT = sizeof REASONS / sizeof *REASONS };

/* ---- tests ----------------------------------------------------------------------------------- */

TEST_WITH(models_are_stored_whole_or_not_at_all_whichever_call_fails, set_up_store, tear_down) {
  fixture *f = *state;
  static char text[SIZE];
  char id[API_ID_TEXT];
  unsigned number = 0, failures = 0;
  for (size_t r = 0; r < REASON_COUNT; r++) {
    bool has_failed = true;
    for (unsigned n = 0; has_failed; n++) {
      make_model(number++, text, id);
      arm(n, REASONS[r]);
      api_store_status status = put(f, id, text);
      has_failed = disarm();
      failures += has_failed;
      assert_true(status == API_STORE_OK ||
                  (has_failed && (status == API_STORE_UNAVAILABLE || status == API_STORE_FULL)));
      if (REASONS[r] == SHORT) assert_int_equal(status, API_STORE_OK);
      assert_int_equal(leftovers(f), 0);
      /* One that is told of as lost may be there, whole: a later upload of the same bytes is the same model.
       */
      api_store_status found = f->store.look(f->store.context, id, true);
      assert_true(found == API_STORE_OK || found == API_STORE_ABSENT);
      if (status == API_STORE_OK || found == API_STORE_OK) assert_true(is_whole(f, id, text));
      if (found == API_STORE_ABSENT) /* else the next upload would have its name */
        assert_int_not_equal(access(srv_store_summary_path(f->path, id).text, F_OK), 0);
      assert_int_equal(put(f, id, text), API_STORE_OK);
      assert_true(is_whole(f, id, text));
    }
  }
  print_message("%u calls failed\n", failures);
  assert_true(failures > 5 * REASON_COUNT);
}

TEST_WITH(models_are_read_whole_or_not_at_all_whichever_call_fails, set_up_store, tear_down) {
  fixture *f = *state;
  static char text[SIZE];
  char id[API_ID_TEXT];
  unsigned failures = 0;
  for (size_t r = 0; r < REASON_COUNT; r++) {
    bool has_failed = true;
    for (unsigned n = 0; has_failed; n++) {
      make_model(1000 + (unsigned)r * 100 + n, text, id); /* one that nobody has looked at yet */
      assert_int_equal(put(f, id, text), API_STORE_OK);
      char *bytes = malloc(SIZE);
      api_blob blob = {0};
      arm(n, REASONS[r]);
      api_store_status status = f->store.open(f->store.context, id, &blob);
      bool is_read = status == API_STORE_OK && blob.read(&blob, 0, (uint8_t *)bytes, SIZE);
      has_failed = disarm();
      failures += has_failed;
      if (is_read) assert_memory_equal(bytes, text, SIZE);
      if (!has_failed || REASONS[r] == SHORT) assert_true(is_read);
      if (status == API_STORE_OK) blob.close(&blob);
      free(bytes);
      assert_true(is_whole(f, id, text)); /* a fault of the moment is no damage */
    }
  }
  print_message("%u calls failed\n", failures);
  assert_true(failures >= REASON_COUNT);
}

TEST_WITH(bodies_are_whole_or_told_of_whichever_call_fails, set_up_store, tear_down) {
  const fixture *f = *state;
  enum { PIECE = 400000, PIECES = 4 };
  static char piece[PIECE];
  srv_spool spool = {.folder = srv_store_fs_temporary(f->opened)};
  for (size_t r = 0; r < REASON_COUNT; r++) {
    bool has_failed = true;
    for (unsigned n = 0; has_failed; n++) {
      srv_body body;
      api_bytes view = {0};
      srv_body_init(&body, PIECE * PIECES, &spool);
      srv_body_status status = SRV_BODY_OK;
      arm(n, REASONS[r]);
      for (int i = 0; i < PIECES && status == SRV_BODY_OK; i++) {
        memset(piece, 'a' + i, PIECE);
        status = srv_body_append(&body, piece, PIECE);
      }
      if (status == SRV_BODY_OK) status = srv_body_view(&body, &view);
      has_failed = disarm();
      bool may_fail = has_failed && REASONS[r] != SHORT;
      assert_true(status == SRV_BODY_OK || (may_fail && status == SRV_BODY_FAILED));
      for (size_t i = 0; status == SRV_BODY_OK && i < PIECES; i++) {
        memset(piece, 'a' + (int)i, PIECE);
        assert_memory_equal(view.data + i * PIECE, piece, PIECE);
      }
      srv_body_deinit(&body);
      assert_int_equal(spool.used, 0);
      assert_int_equal(leftovers(f), 0);
    }
  }
}
