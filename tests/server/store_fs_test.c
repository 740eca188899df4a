#include "store_fixture.h"

#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static const char TEXT[] = "some bytes";
static const char ID[] = "0d22cdcc10e6d049dbe1af5123d50873"; /* of TEXT */

/* A text of its own for each number, of about `size` bytes; free it. */
static char *make_text(unsigned number, size_t size) {
  char *text = malloc(size + 16);
  int length = snprintf(text, 16, "%u ", number);
  memset(text + length, 'x', size);
  text[(size_t)length + size] = '\0';
  return text;
}

/* Of a stored file. */
static void make_path(const fixture *f, const char *id, char path[128]) {
  snprintf(path, 128, "%s/objects/%.2s/%s", f->path, id, id);
}

static api_store_status put_as(fixture *f, const char *id, const char *text, bool *existed) {
  api_bytes bytes = {(const uint8_t *)text, strlen(text)};
  return f->store.put(f->store.context, id, bytes, "{\"n\":1}", existed);
}

static api_store_status put(fixture *f, const char *text, bool *existed) {
  char id[API_ID_TEXT];
  make_id(text, strlen(text), id);
  return put_as(f, id, text, existed);
}

static void must_put(fixture *f, const char *text) {
  bool existed = true;
  assert_int_equal(put(f, text, &existed), API_STORE_OK);
  assert_false(existed);
}

static api_store_status open_status(fixture *f, const char *id) {
  api_blob blob;
  api_store_status status = f->store.open(f->store.context, id, &blob);
  if (status == API_STORE_OK) blob.close(&blob);
  return status;
}

static bool is_stored(fixture *f, const char *text) {
  char id[API_ID_TEXT];
  api_blob blob;
  make_id(text, strlen(text), id);
  if (f->store.open(f->store.context, id, &blob) != API_STORE_OK) return false;
  char *bytes = malloc(blob.size + 1);
  bool same = blob.size == strlen(text) && blob.read(&blob, 0, (uint8_t *)bytes, blob.size) &&
              memcmp(bytes, text, blob.size) == 0;
  free(bytes);
  blob.close(&blob);
  return same;
}

static void pause_ms(long ms) {
  nanosleep(&(struct timespec){.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000}, NULL);
}

TEST(folder_that_cannot_be_used_is_refused) {
  srv_error error = {""};
  assert_null(srv_store_fs_open("--data", "/dev/null", &error));
  assert_non_null(strstr(error.text, "/dev/null"));
  assert_null(srv_store_fs_open("--data", "/dev/null/folder", &error));
}

TEST_WITH(what_is_no_id_names_no_file, set_up_store, tear_down_store) {
  fixture *f = *state;
  static const char *const BAD[] = {"", "abc", "../../../../../../../../etc/passwd",
                                    "0123456789ABCDEF0123456789abcdef", "0123456789abcdef0123456789abcdef0"};
  for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) {
    bool existed;
    assert_int_equal(open_status(f, BAD[i]), API_STORE_ABSENT);
    assert_int_equal(f->store.remove(f->store.context, BAD[i]), API_STORE_ABSENT);
    assert_int_equal(put_as(f, BAD[i], "x", &existed), API_STORE_UNAVAILABLE);
  }
}

TEST_WITH(absent_model_is_absent, set_up_store, tear_down_store) {
  fixture *f = *state;
  assert_int_equal(open_status(f, ID), API_STORE_ABSENT);
  assert_int_equal(f->store.remove(f->store.context, ID), API_STORE_ABSENT);
}

TEST_WITH(model_is_got_as_it_was_put_also_by_another_process, set_up_store, tear_down_store) {
  fixture *f = *state;
  must_put(f, TEXT);
  assert_true(is_stored(f, TEXT));
  srv_store_fs_close(f->opened);
  open_store(f);
  assert_true(is_stored(f, TEXT));
}

TEST_WITH(any_part_of_a_model_is_read, set_up_store, tear_down_store) {
  fixture *f = *state;
  must_put(f, TEXT);
  api_blob blob;
  uint8_t part[4];
  assert_int_equal(f->store.open(f->store.context, ID, &blob), API_STORE_OK);
  assert_int_equal(blob.size, strlen(TEXT));
  assert_true(blob.read(&blob, 3, part, sizeof part));
  assert_memory_equal(part, TEXT + 3, sizeof part);
  blob.close(&blob);
}

static unsigned paths_with_id;

static int count_path(const char *path, const struct stat *facts, int type, struct FTW *place) {
  (void)facts;
  (void)type;
  (void)place;
  paths_with_id += strstr(path, ID) != NULL;
  return 0;
}

TEST_WITH(bytes_lie_as_they_are_in_the_one_file_whose_path_holds_the_id, set_up_store, tear_down_store) {
  fixture *f = *state;
  must_put(f, TEXT);
  char path[128], bytes[64];
  paths_with_id = 0;
  assert_int_equal(nftw(f->path, count_path, 16, FTW_PHYS), 0);
  assert_int_equal(paths_with_id, 1);
  make_path(f, ID, path);
  int file = open(path, O_RDONLY);
  assert_int_equal(read(file, bytes, sizeof bytes), strlen(TEXT));
  assert_memory_equal(bytes, TEXT, strlen(TEXT));
  close(file);
}

TEST_WITH(empty_model_is_possible, set_up_store, tear_down_store) {
  fixture *f = *state;
  must_put(f, "");
  assert_true(is_stored(f, ""));
}

TEST_WITH(second_put_says_that_it_was_there, set_up_store, tear_down_store) {
  fixture *f = *state;
  must_put(f, TEXT);
  bool existed = false;
  assert_int_equal(put(f, TEXT, &existed), API_STORE_OK);
  assert_true(existed);
}

/* ---- races ----------------------------------------------------------------------------------- */

typedef struct racer {
  fixture *f;
  pthread_barrier_t *start;
  bool existed;
  api_store_status status;
  char summary[16];
} racer;

static void *race(void *context) {
  racer *r = context;
  pthread_barrier_wait(r->start);
  api_bytes bytes = {(const uint8_t *)TEXT, strlen(TEXT)};
  r->status = r->f->store.put(r->f->store.context, ID, bytes, r->summary, &r->existed);
  return NULL;
}

TEST_WITH(of_racing_puts_one_is_the_first, set_up_store, tear_down_store) {
  fixture *f = *state;
  enum { RACERS = 8, ROUNDS = 20 };
  for (int round = 0; round < ROUNDS; round++) {
    pthread_barrier_t start;
    pthread_t threads[RACERS];
    racer racers[RACERS];
    pthread_barrier_init(&start, NULL, RACERS);
    for (int i = 0; i < RACERS; i++) {
      racers[i] = (racer){.f = f, .start = &start};
      snprintf(racers[i].summary, sizeof racers[i].summary, "{\"n\":%d}", i);
      assert_int_equal(pthread_create(&threads[i], NULL, race, &racers[i]), 0);
    }
    int firsts = 0;
    char *summary = NULL;
    for (int i = 0; i < RACERS; i++) pthread_join(threads[i], NULL);
    summary = f->store.summary(f->store.context, ID);
    assert_non_null(summary);
    for (int i = 0; i < RACERS; i++) {
      assert_int_equal(racers[i].status, API_STORE_OK);
      firsts += !racers[i].existed;
      if (!racers[i].existed) assert_string_equal(summary, racers[i].summary);
    }
    free(summary);
    pthread_barrier_destroy(&start);
    assert_int_equal(firsts, 1);
    assert_true(is_stored(f, TEXT));
    assert_int_equal(f->store.remove(f->store.context, ID), API_STORE_OK);
  }
}

static void *race_removing(void *context) {
  racer *r = context;
  pthread_barrier_wait(r->start);
  do r->status = r->f->store.remove(r->f->store.context, ID);
  while (r->status == API_STORE_ABSENT);
  return NULL;
}

TEST_WITH(a_model_that_is_removed_while_it_is_stored_leaves_no_summary, set_up_store, tear_down_store) {
  fixture *f = *state;
  enum { ROUNDS = 40 };
  for (int round = 0; round < ROUNDS; round++) {
    pthread_barrier_t start;
    pthread_t threads[2];
    racer racers[2] = {{.f = f, .start = &start, .summary = "{\"n\":1}"}, {.f = f, .start = &start}};
    pthread_barrier_init(&start, NULL, 2);
    assert_int_equal(pthread_create(&threads[0], NULL, race, &racers[0]), 0);
    assert_int_equal(pthread_create(&threads[1], NULL, race_removing, &racers[1]), 0);
    for (int i = 0; i < 2; i++) pthread_join(threads[i], NULL);
    pthread_barrier_destroy(&start);
    assert_int_equal(racers[0].status, API_STORE_OK);
    assert_int_equal(racers[1].status, API_STORE_OK);
    snprintf(racers[0].summary, sizeof racers[0].summary, "{\"n\":2}");
    pthread_barrier_init(&start, NULL, 1);
    race(&racers[0]); /* the next upload's summary counts */
    pthread_barrier_destroy(&start);
    char *summary = f->store.summary(f->store.context, ID);
    assert_non_null(summary);
    assert_string_equal(summary, "{\"n\":2}");
    free(summary);
    assert_int_equal(f->store.remove(f->store.context, ID), API_STORE_OK);
  }
}

enum { PROCESSES = 8, RACED = 40, RACED_SIZE = 50000 };

/* What each of the racing processes does: as many starts as uploads. Returns how many uploads failed. */
static int race_alone(fixture *f, int start) {
  char byte;
  int failed = 0;
  if (read(start, &byte, 1) != 0) return 1;
  for (unsigned i = 0; i < RACED; i++) {
    char *text = make_text(i, RACED_SIZE);
    bool existed;
    open_store(f);
    failed += put(f, text, &existed) != API_STORE_OK;
    srv_store_fs_close(f->opened);
    free(text);
  }
  return failed;
}

/* Runs in a process that is PID 1, as daemons in containers are, where the system lets it. */
static int race_as_first(fixture *f, int start) {
  if (unshare(CLONE_NEWPID) != 0 && unshare(CLONE_NEWUSER | CLONE_NEWPID) != 0) return race_alone(f, start);
  pid_t first = fork();
  if (first == 0) _exit(race_alone(f, start));
  int status = -1;
  return waitpid(first, &status, 0) == first && WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

TEST_WITH(processes_that_race_all_store_the_model, set_up_store, tear_down_store) {
  fixture *f = *state;
  int start[2];
  pid_t racers[PROCESSES];
  assert_int_equal(pipe(start), 0);
  for (int i = 0; i < PROCESSES; i++) {
    racers[i] = fork();
    assert_true(racers[i] >= 0);
    if (racers[i] == 0) {
      close(start[1]);
      _exit(race_as_first(f, start[0]));
    }
  }
  close(start[0]);
  close(start[1]); /* they go */
  for (int i = 0; i < PROCESSES; i++) {
    int status = -1;
    assert_int_equal(waitpid(racers[i], &status, 0), racers[i]);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
  }
  for (unsigned i = 0; i < RACED; i++) {
    char *text = make_text(i, RACED_SIZE);
    assert_true(is_stored(f, text));
    free(text);
  }
}

/* ---- removal, lists -------------------------------------------------------------------------- */

TEST_WITH(removed_model_is_gone_but_for_who_has_it_open, set_up_store, tear_down_store) {
  fixture *f = *state;
  must_put(f, TEXT);
  api_blob blob;
  uint8_t bytes[sizeof TEXT];
  assert_int_equal(f->store.open(f->store.context, ID, &blob), API_STORE_OK);
  assert_int_equal(f->store.remove(f->store.context, ID), API_STORE_OK);
  assert_false(is_stored(f, TEXT));
  assert_true(blob.read(&blob, 0, bytes, strlen(TEXT)));
  assert_memory_equal(bytes, TEXT, strlen(TEXT));
  blob.close(&blob);
  must_put(f, TEXT);
}

static void assert_summary(fixture *f, const char *summary) {
  api_listed listed[1];
  size_t count;
  bool more;
  assert_int_equal(f->store.list(f->store.context, "", 1, listed, &count, &more), API_STORE_OK);
  assert_int_equal(count, 1);
  if (summary == NULL)
    assert_null(listed[0].summary);
  else
    assert_string_equal(listed[0].summary, summary);
  free(listed[0].summary);
}

TEST_WITH(lost_summary_is_null_and_made_good_by_the_next_put, set_up_store, tear_down_store) {
  fixture *f = *state;
  must_put(f, TEXT);
  char path[128];
  bool existed = false;
  snprintf(path, sizeof path, "%s/summaries/%.2s/%s", f->path, ID, ID + 2);
  for (int round = 0; round < 2; round++) {
    assert_summary(f, "{\"n\":1}");
    assert_int_equal(round == 0 ? unlink(path) : truncate(path, 0), 0);
    assert_summary(f, NULL);
    assert_int_equal(put(f, TEXT, &existed), API_STORE_OK);
    assert_true(existed);
  }
  assert_summary(f, "{\"n\":1}");
}

TEST_WITH(removed_model_leaves_no_summary_to_the_next, set_up_store, tear_down_store) {
  fixture *f = *state;
  must_put(f, TEXT);
  assert_int_equal(f->store.remove(f->store.context, ID), API_STORE_OK);
  bool existed;
  api_bytes bytes = {(const uint8_t *)TEXT, strlen(TEXT)};
  assert_int_equal(f->store.put(f->store.context, ID, bytes, "{\"n\":2}", &existed), API_STORE_OK);
  assert_summary(f, "{\"n\":2}");
}

TEST_WITH(list_pages_through_all_in_order, set_up_store, tear_down_store) {
  fixture *f = *state;
  enum { MODELS = 60, PAGE = 7 };
  char after[API_ID_TEXT] = "";
  for (unsigned i = 0; i < MODELS; i++) {
    char *text = make_text(i + 10, 1);
    must_put(f, text);
    free(text);
  }
  size_t seen = 0;
  bool more = true;
  while (more) {
    api_listed listed[PAGE];
    size_t count = 0;
    assert_int_equal(f->store.list(f->store.context, after, PAGE, listed, &count, &more), API_STORE_OK);
    assert_true(count == PAGE || (!more && count > 0));
    for (size_t i = 0; i < count; i++) {
      assert_true(strcmp(after, listed[i].id) < 0);
      memcpy(after, listed[i].id, sizeof after);
      assert_int_equal(listed[i].size, 4);
      assert_string_equal(listed[i].summary, "{\"n\":1}");
      free(listed[i].summary);
    }
    seen += count;
  }
  assert_int_equal(seen, MODELS);
}

TEST_WITH(full_page_that_is_the_last_says_so, set_up_store, tear_down_store) {
  fixture *f = *state;
  must_put(f, TEXT);
  api_listed listed[1];
  size_t count;
  bool more = true;
  assert_int_equal(f->store.list(f->store.context, "", 1, listed, &count, &more), API_STORE_OK);
  assert_int_equal(count, 1);
  assert_false(more);
  free(listed[0].summary);
  assert_int_equal(f->store.list(f->store.context, ID, 1, listed, &count, &more), API_STORE_OK);
  assert_int_equal(count, 0);
}

/* A link to nothing is listed, but has no facts: as a model that is removed after it was listed. */
TEST_WITH(list_goes_on_behind_models_that_vanish_meanwhile, set_up_store, tear_down_store) {
  fixture *f = *state;
  char path[128];
  must_put(f, TEXT);
  snprintf(path, sizeof path, "%s/objects/00", f->path);
  assert_int_equal(mkdir(path, 0700), 0);
  for (int i = 0; i < 5; i++) {
    snprintf(path, sizeof path, "%s/objects/00/%032d", f->path, i);
    assert_int_equal(symlink("nothing", path), 0);
  }
  for (size_t limit = 1; limit <= 5; limit++) {
    api_listed listed[5];
    size_t count = 0;
    bool more = true;
    assert_int_equal(f->store.list(f->store.context, "", limit, listed, &count, &more), API_STORE_OK);
    assert_int_equal(count, 1);
    assert_false(more);
    assert_string_equal(listed[0].id, ID);
    free(listed[0].summary);
  }
}

/* ---- damage ---------------------------------------------------------------------------------- */

typedef struct damage {
  off_t cut;        /* to this size; -1: not */
  off_t at;         /* one byte is written here; -1: none is */
  bool keeps_times; /* of access and change of the bytes */
} damage;

static void do_damage(const char *path, damage d) {
  struct stat facts;
  int file = open(path, O_WRONLY);
  assert_true(file >= 0);
  assert_int_equal(fstat(file, &facts), 0);
  if (d.cut >= 0) assert_int_equal(ftruncate(file, d.cut), 0);
  if (d.at >= 0) assert_int_equal(pwrite(file, "X", 1, d.at), 1);
  struct timespec times[] = {facts.st_atim, facts.st_mtim};
  if (d.keeps_times) assert_int_equal(futimens(file, times), 0);
  close(file);
}

/* Each kind, on a file that was just written and on one that has been hashed and found whole. */
TEST_WITH(damaged_model_is_noticed_and_mended_by_the_next_put, set_up_store, tear_down_store) {
  fixture *f = *state;
  static const damage KINDS[] = {
      {5, -1, false}, {0, -1, false}, {-1, 3, false}, {-1, 10, false}, {-1, 3, true}};
  char path[128];
  must_put(f, TEXT);
  make_path(f, ID, path);
  for (size_t i = 0; i < sizeof KINDS / sizeof *KINDS; i++) {
    for (int known = 0; known < 2; known++) {
      if (known) {
        pause_ms(150); /* until the verdict is remembered, see TICK_NS */
        assert_true(is_stored(f, TEXT));
      }
      do_damage(path, KINDS[i]);
      assert_int_equal(open_status(f, ID), API_STORE_DAMAGED);
      pause_ms(known ? 150 : 0);
      assert_int_equal(open_status(f, ID), API_STORE_DAMAGED);
      assert_int_equal(open_status(f, ID), API_STORE_DAMAGED);
      must_put(f, TEXT);
      assert_true(is_stored(f, TEXT));
    }
  }
}

static api_store_status look(fixture *f, bool may_wait) {
  return f->store.look(f->store.context, ID, may_wait);
}

TEST_WITH(look_of_late_is_told_without_waiting, set_up_store, tear_down_store) {
  fixture *f = *state;
  char path[128];
  assert_int_equal(look(f, false), API_STORE_UNKNOWN);
  assert_int_equal(look(f, true), API_STORE_ABSENT);
  assert_int_equal(look(f, false), API_STORE_UNKNOWN);
  must_put(f, TEXT);
  assert_int_equal(look(f, false), API_STORE_OK);
  make_path(f, ID, path);
  do_damage(path, (damage){5, -1, false});
  assert_int_equal(look(f, true), API_STORE_OK); /* of this second */
  pause_ms(1100);
  assert_int_equal(look(f, false), API_STORE_UNKNOWN);
  assert_int_equal(look(f, true), API_STORE_DAMAGED);
  must_put(f, TEXT);
  assert_int_equal(look(f, false), API_STORE_OK);
}

static uint64_t processor_ns(void) {
  struct timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return (uint64_t)now.tv_sec * 1000000000 + (uint64_t)now.tv_nsec;
}

TEST_WITH(unchanged_file_is_hashed_once, set_up_store, tear_down_store) {
  fixture *f = *state;
  char *text = make_text(1, 20 << 20), id[API_ID_TEXT];
  make_id(text, strlen(text), id);
  must_put(f, text);
  pause_ms(150);
  uint64_t times[3] = {processor_ns()};
  for (int i = 1; i < 3; i++) {
    assert_int_equal(open_status(f, id), API_STORE_OK);
    times[i] = processor_ns();
  }
  assert_true(times[2] - times[1] < (times[1] - times[0]) / 10);
  free(text);
}

TEST_WITH(file_that_is_cut_or_changed_while_it_is_open_cannot_be_read_on, set_up_store, tear_down_store) {
  fixture *f = *state;
  static const damage KINDS[] = {{5, -1, false}, {0, -1, false}, {-1, 9, false}};
  char path[128];
  must_put(f, TEXT);
  make_path(f, ID, path);
  for (size_t i = 0; i < sizeof KINDS / sizeof *KINDS; i++) {
    api_blob blob;
    uint8_t bytes[4];
    assert_int_equal(f->store.open(f->store.context, ID, &blob), API_STORE_OK);
    assert_true(blob.read(&blob, 0, bytes, 4));
    pause_ms(20);
    do_damage(path, KINDS[i]);
    assert_false(blob.read(&blob, 4, bytes, 4));
    blob.close(&blob);
    must_put(f, TEXT);
  }
}

TEST_WITH(mending_leaves_alone_who_has_the_model_open, set_up_store, tear_down_store) {
  fixture *f = *state;
  must_put(f, TEXT);
  api_blob blob;
  uint8_t bytes[4];
  char path[128];
  bool existed;
  assert_int_equal(f->store.open(f->store.context, ID, &blob), API_STORE_OK);
  make_path(f, ID, path);
  assert_int_equal(unlink(path), 0); /* and other bytes under its name */
  close(open(path, O_CREAT | O_WRONLY, 0600));
  assert_int_equal(put(f, TEXT, &existed), API_STORE_OK);
  assert_true(blob.read(&blob, 0, bytes, 4));
  assert_memory_equal(bytes, TEXT, 4);
  blob.close(&blob);
  assert_true(is_stored(f, TEXT));
}

/* ---- the folder ------------------------------------------------------------------------------ */

/* Once the folder was tried again. */
static void assert_probed(fixture *f, api_store_status expected) {
  for (int i = 0; i < 3000 && f->store.probe(f->store.context) != expected; i++) pause_ms(10);
  assert_int_equal(f->store.probe(f->store.context), expected);
}

static api_store_status list_status(fixture *f) {
  api_listed listed[1];
  size_t count = 0;
  bool more;
  api_store_status status = f->store.list(f->store.context, "", 1, listed, &count, &more);
  if (status == API_STORE_OK && count == 1) free(listed[0].summary);
  return status;
}

static void assert_unusable(fixture *f) {
  bool existed;
  assert_probed(f, API_STORE_UNAVAILABLE);
  assert_int_equal(open_status(f, ID), API_STORE_UNAVAILABLE);
  assert_int_equal(f->store.remove(f->store.context, ID), API_STORE_UNAVAILABLE);
  assert_int_equal(list_status(f), API_STORE_UNAVAILABLE);
  assert_int_equal(put(f, "other bytes", &existed), API_STORE_UNAVAILABLE);
}

TEST_WITH(folder_that_vanished_is_told_and_used_again_when_it_is_back, set_up_store, tear_down_store) {
  fixture *f = *state;
  char away[128];
  snprintf(away, sizeof away, "%s-away", f->path);
  must_put(f, TEXT);
  assert_probed(f, API_STORE_OK);
  assert_int_equal(rename(f->path, away), 0);
  assert_unusable(f);
  close(open(f->path, O_CREAT | O_WRONLY, 0600)); /* a file in its place */
  assert_unusable(f);
  assert_int_equal(unlink(f->path), 0);
  assert_int_equal(rename(away, f->path), 0);
  assert_probed(f, API_STORE_OK);
  assert_true(is_stored(f, TEXT));
}

TEST_WITH(folder_that_was_made_anew_is_used, set_up_store, tear_down_store) {
  fixture *f = *state;
  must_put(f, TEXT);
  assert_int_equal(remove_folder(f->path), 0);
  assert_unusable(f);
  assert_int_equal(mkdir(f->path, 0700), 0);
  must_put(f, TEXT);
  assert_true(is_stored(f, TEXT));
  assert_probed(f, API_STORE_OK);
}

/* Fills the file system that the folder is on. */
static void fill(const char *path) {
  static const char block[4096];
  int file = open(path, O_CREAT | O_WRONLY, 0600);
  while (write(file, block, sizeof block) > 0) continue;
  assert_int_equal(errno, ENOSPC);
  close(file);
}

TEST_WITH(full_disk_is_told_and_leaves_nothing_half_made, set_up_store, tear_down_store) {
  fixture *f = *state;
  char filler[128], temporary[128];
  bool existed;
  srv_store_fs_close(f->opened);
  assert_int_equal(remove_folder(f->path), 0);
  assert_int_equal(mkdir(f->path, 0700), 0);
  bool is_mounted = mount("tmpfs", f->path, "tmpfs", 0, "size=1m") == 0;
  open_store(f);
  if (!is_mounted) {
    print_message("skipped: a file system cannot be mounted here\n");
    skip();
  }
  must_put(f, TEXT);
  snprintf(filler, sizeof filler, "%s/filler", f->path);
  fill(filler);
  assert_probed(f, API_STORE_UNAVAILABLE);
  assert_int_equal(put(f, "other bytes", &existed), API_STORE_FULL);
  assert_true(is_stored(f, TEXT));
  assert_int_equal(put(f, TEXT, &existed), API_STORE_OK);
  snprintf(temporary, sizeof temporary, "%s/tmp", f->path);
  assert_int_equal(rmdir(temporary), 0); /* it is empty */
  assert_int_equal(unlink(filler), 0);
  assert_probed(f, API_STORE_OK);
  must_put(f, "other bytes");
  assert_int_equal(umount(f->path), 0);
  assert_unusable(f);
  assert_int_equal(rmdir(f->path), 0); /* nothing was made in the folder that the volume covered */
  assert_int_equal(mkdir(f->path, 0700), 0);
}

TEST_WITH(models_over_the_limit_are_refused_until_others_go, set_up_store, tear_down_store) {
  fixture *f = *state;
  bool existed;
  srv_store_fs_limit(f->opened, strlen(TEXT) + 5, 0);
  must_put(f, TEXT);
  assert_int_equal(put(f, "123456", &existed), API_STORE_FULL);
  assert_int_equal(put(f, "12345", &existed), API_STORE_OK);
  assert_int_equal(put(f, TEXT, &existed), API_STORE_OK); /* it takes no more room */
  assert_true(existed);
  assert_int_equal(put(f, "1", &existed), API_STORE_FULL);
  assert_int_equal(f->store.remove(f->store.context, ID), API_STORE_OK);
  must_put(f, "1234567890");
}

TEST_WITH(models_that_leave_too_little_disk_are_refused, set_up_store, tear_down_store) {
  fixture *f = *state;
  bool existed;
  must_put(f, TEXT);
  srv_store_fs_limit(f->opened, 0, UINT64_C(1) << 60);
  assert_int_equal(f->store.room(f->store.context, 0), API_STORE_FULL);
  assert_int_equal(put(f, "123456", &existed), API_STORE_FULL);
  assert_int_equal(put(f, TEXT, &existed), API_STORE_OK); /* it takes no more room */
  srv_store_fs_limit(f->opened, 0, 1);
  assert_int_equal(f->store.room(f->store.context, 0), API_STORE_OK);
  assert_int_equal(f->store.room(f->store.context, UINT64_C(1) << 60), API_STORE_FULL);
  srv_store_fs_limit(f->opened, 0, 0);
  assert_int_equal(f->store.room(f->store.context, UINT64_C(1) << 60), API_STORE_OK);
  must_put(f, "123456");
}

TEST_WITH(what_other_daemons_stored_counts_from_the_start, set_up_store, tear_down_store) {
  fixture *f = *state;
  bool existed;
  must_put(f, TEXT);
  srv_store_fs_close(f->opened);
  open_store(f);
  srv_store_fs_limit(f->opened, strlen(TEXT) + 5, 0);
  assert_int_equal(put(f, "123456", &existed), API_STORE_FULL);
  must_put(f, "12345");
}

/* Whether the file was cut before the models were counted or after. */
TEST_WITH(model_that_replaces_a_cut_one_counts_whole, set_up_store, tear_down_store) {
  fixture *f = *state;
  char path[128];
  bool existed;
  must_put(f, TEXT);
  make_path(f, ID, path);
  for (int round = 0; round < 2; round++) {
    if (round == 0) srv_store_fs_limit(f->opened, 1000, 0);
    assert_int_equal(truncate(path, 2), 0);
    if (round == 1) srv_store_fs_limit(f->opened, 1000, 0);
    assert_int_equal(put(f, TEXT, &existed), API_STORE_OK);
    assert_false(existed);
    assert_int_equal(srv_store_fs_used(f->opened), strlen(TEXT));
  }
}

TEST_WITH(folders_on_the_way_are_made, set_up_store, tear_down_store) {
  fixture *f = *state;
  char path[96];
  srv_error error;
  snprintf(path, sizeof path, "%s/a/b//c/", f->path);
  srv_store_fs *deep = srv_store_fs_open("--data", path, &error);
  assert_non_null(deep);
  assert_int_equal(access(path, W_OK), 0);
  srv_store_fs_close(deep);
  snprintf(path, sizeof path, "%s/file", f->path);
  close(open(path, O_CREAT | O_WRONLY, 0600));
  strcat(path, "/below");
  assert_null(srv_store_fs_open("--data", path, &error));
  assert_non_null(strstr(error.text, "Not a directory"));
}

static void make_leftover(const fixture *f, const char *name, time_t age_s, char path[128]) {
  snprintf(path, 128, "%s/tmp/%s", f->path, name);
  int file = open(path, O_CREAT | O_WRONLY, 0600);
  struct timespec times[] = {{.tv_sec = time(NULL) - age_s}, {.tv_sec = time(NULL) - age_s}};
  assert_int_equal(futimens(file, times), 0);
  close(file);
}

TEST_WITH(leftovers_of_the_dead_go_at_start_and_those_of_the_living_stay, set_up_store, tear_down_store) {
  fixture *f = *state;
  char dead[128], living[128];
  make_leftover(f, "dead", 3700, dead);
  make_leftover(f, "living", 3500, living);
  srv_store_fs_close(f->opened);
  open_store(f);
  assert_int_equal(access(dead, F_OK), -1);
  assert_int_equal(access(living, F_OK), 0);
}

/* ---- summaries ------------------------------------------------------------------------------- */

enum { WATCHED = 100 };

typedef struct watched {
  fixture *f;
  char id[API_ID_TEXT];
  bool was_bare; /* its object was there, and its summary was not */
} watched;

/* Asks for the summary as soon as the object is there. */
static void *watch(void *argument) {
  watched *w = argument;
  char path[128];
  make_path(w->f, w->id, path);
  while (access(path, F_OK) != 0) sched_yield();
  char *summary = w->f->store.summary(w->f->store.context, w->id);
  w->was_bare = !summary;
  free(summary);
  return NULL;
}

/* Stores models one after another while a thread asks another store for the summary of each as soon as its
 * object is there. */
static void store_watched(fixture *writer, fixture *reader) {
  for (unsigned i = 0; i < WATCHED; i++) {
    char *text = make_text(i, 100);
    watched w = {.f = reader};
    make_id(text, strlen(text), w.id);
    pthread_t thread;
    assert_int_equal(pthread_create(&thread, NULL, watch, &w), 0);
    must_put(writer, text);
    pthread_join(thread, NULL);
    assert_false(w.was_bare);
    free(text);
  }
}

TEST_WITH(model_that_is_being_stored_has_its_summary, set_up_store, tear_down_store) {
  fixture *f = *state;
  store_watched(f, f);
}

/* Another process has locks of its own: it finds the summary all the same, or it would make one without the
 * name. */
TEST_WITH(model_that_another_process_stores_has_its_summary, set_up_store, tear_down_store) {
  fixture *f = *state, other = *f;
  open_store(&other);
  store_watched(f, &other);
  srv_store_fs_close(other.opened);
}

/* ---- kill ------------------------------------------------------------------------------------ */

enum { KILLS = 20, KILLED_SIZE = 200000 };

/* Puts one model after another, and tells the number of each that was stored. */
static void put_for_ever(fixture *f, unsigned first, int stored) {
  for (unsigned i = first;; i++) {
    char *text = make_text(i, KILLED_SIZE);
    bool existed;
    if (put(f, text, &existed) != API_STORE_OK || write(stored, &i, sizeof i) != (ssize_t)sizeof i) _exit(1);
    free(text);
  }
}

/* Returns how many models are listed, each of which is whole. */
static unsigned list_whole_models(fixture *f) {
  char after[API_ID_TEXT] = "";
  unsigned listed_count = 0;
  bool more = true;
  while (more) {
    api_listed listed[1];
    size_t count = 0;
    assert_int_equal(f->store.list(f->store.context, after, 1, listed, &count, &more), API_STORE_OK);
    if (count == 0) break;
    memcpy(after, listed[0].id, sizeof after);
    assert_int_equal(open_status(f, after), API_STORE_OK);
    free(listed[0].summary); /* NULL where the kill came between the model and its summary */
    listed_count++;
  }
  return listed_count;
}

TEST_WITH(kill_at_any_moment_leaves_whole_models_and_all_that_were_stored, set_up_store, tear_down_store) {
  fixture *f = *state;
  unsigned stored_count = 0;
  for (unsigned round = 0; round < KILLS; round++) {
    int stored[2];
    assert_int_equal(pipe(stored), 0);
    pid_t writer = fork();
    assert_true(writer >= 0);
    if (writer == 0) put_for_ever(f, round * 1000, stored[1]);
    close(stored[1]);
    pause_ms(10 + round * 3);
    kill(writer, SIGKILL);
    waitpid(writer, NULL, 0);
    for (unsigned number; read(stored[0], &number, sizeof number) == (ssize_t)sizeof number; stored_count++) {
      char *text = make_text(number, KILLED_SIZE);
      assert_true(is_stored(f, text));
      free(text);
    }
    close(stored[0]);
  }
  srv_store_fs_close(f->opened);
  open_store(f);
  assert_true(stored_count > 0);
  assert_true(list_whole_models(f) >= stored_count);
}
