#include "store_fs.h"

#include <fcntl.h>
#include <ftw.h>
#include <pthread.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

typedef struct fixture {
  char path[64];
  srv_store_fs *opened;
  api_store store;
} fixture;

static void open_store(fixture *f) {
  char error[256] = "";
  f->opened = srv_store_fs_open(f->path, error, sizeof error);
  if (f->opened == NULL) fail_msg("%s", error);
  f->store = srv_store_fs_api(f->opened);
}

static int set_up(void **state) {
  fixture *f = calloc(1, sizeof *f);
  snprintf(f->path, sizeof f->path, "/tmp/tweend-store-XXXXXX");
  if (mkdtemp(f->path) == NULL) return -1;
  open_store(f);
  *state = f;
  return 0;
}

static int remove_entry(const char *path, const struct stat *facts, int type, struct FTW *place) {
  (void)facts;
  (void)type;
  (void)place;
  return remove(path);
}

static int tear_down(void **state) {
  fixture *f = *state;
  srv_store_fs_close(f->opened);
  int status = nftw(f->path, remove_entry, 16, FTW_DEPTH | FTW_PHYS);
  free(f);
  return status;
}

static const char ID[] = "0123456789abcdef0123456789abcdef";

static void make_id(unsigned number, char id[API_ID_TEXT]) {
  snprintf(id, API_ID_TEXT, "%08x%08x%016x", number * 2654435761u, number, number);
}

static api_store_status put(fixture *f, const char *id, const char *text, bool *existed) {
  api_bytes bytes = {(const uint8_t *)text, strlen(text)};
  return f->store.put(f->store.context, id, bytes, "{\"n\":1}", existed);
}

static void must_put(fixture *f, const char *id, const char *text) {
  bool existed = true;
  assert_int_equal(put(f, id, text, &existed), API_STORE_OK);
  assert_false(existed);
}

static bool is_stored(fixture *f, const char *id, const char *text) {
  api_blob blob;
  if (f->store.get(f->store.context, id, &blob) != API_STORE_OK) return false;
  bool same = blob.bytes.size == strlen(text) && memcmp(blob.bytes.data, text, blob.bytes.size) == 0;
  blob.release(&blob);
  return same;
}

static void folder_that_cannot_be_used_is_refused(void **state) {
  (void)state;
  char error[256] = "";
  assert_null(srv_store_fs_open("/dev/null", error, sizeof error));
  assert_non_null(strstr(error, "/dev/null"));
  assert_null(srv_store_fs_open("/no/such/parent/folder", error, sizeof error));
}

static void what_is_no_id_names_no_file(void **state) {
  fixture *f = *state;
  static const char *const BAD[] = {"", "abc", "../../../../../../../../etc/passwd",
                                    "0123456789ABCDEF0123456789abcdef", "0123456789abcdef0123456789abcdef0"};
  for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) {
    api_blob blob;
    bool existed;
    assert_int_equal(f->store.get(f->store.context, BAD[i], &blob), API_STORE_ABSENT);
    assert_int_equal(f->store.remove(f->store.context, BAD[i]), API_STORE_ABSENT);
    assert_int_equal(put(f, BAD[i], "x", &existed), API_STORE_UNAVAILABLE);
  }
}

static void absent_model_is_absent(void **state) {
  fixture *f = *state;
  api_blob blob;
  assert_int_equal(f->store.get(f->store.context, ID, &blob), API_STORE_ABSENT);
  assert_int_equal(f->store.remove(f->store.context, ID), API_STORE_ABSENT);
}

static void model_is_got_as_it_was_put_also_by_another_process(void **state) {
  fixture *f = *state;
  must_put(f, ID, "some bytes");
  assert_true(is_stored(f, ID, "some bytes"));
  srv_store_fs_close(f->opened);
  open_store(f);
  assert_true(is_stored(f, ID, "some bytes"));
}

static void empty_model_is_possible(void **state) {
  fixture *f = *state;
  must_put(f, ID, "");
  assert_true(is_stored(f, ID, ""));
}

static void second_put_says_that_it_was_there(void **state) {
  fixture *f = *state;
  must_put(f, ID, "some bytes");
  bool existed = false;
  assert_int_equal(put(f, ID, "some bytes", &existed), API_STORE_OK);
  assert_true(existed);
}

typedef struct racer {
  fixture *f;
  pthread_barrier_t *start;
  bool existed;
  api_store_status status;
} racer;

static void *race(void *context) {
  racer *r = context;
  pthread_barrier_wait(r->start);
  r->status = put(r->f, ID, "some bytes", &r->existed);
  return NULL;
}

static void of_racing_puts_one_is_the_first(void **state) {
  fixture *f = *state;
  enum { RACERS = 8, ROUNDS = 20 };
  for (int round = 0; round < ROUNDS; round++) {
    pthread_barrier_t start;
    pthread_t threads[RACERS];
    racer racers[RACERS];
    pthread_barrier_init(&start, NULL, RACERS);
    for (int i = 0; i < RACERS; i++) {
      racers[i] = (racer){.f = f, .start = &start};
      assert_int_equal(pthread_create(&threads[i], NULL, race, &racers[i]), 0);
    }
    int firsts = 0;
    for (int i = 0; i < RACERS; i++) {
      pthread_join(threads[i], NULL);
      assert_int_equal(racers[i].status, API_STORE_OK);
      firsts += !racers[i].existed;
    }
    pthread_barrier_destroy(&start);
    assert_int_equal(firsts, 1);
    assert_true(is_stored(f, ID, "some bytes"));
    assert_int_equal(f->store.remove(f->store.context, ID), API_STORE_OK);
  }
}

static void removed_model_is_gone_and_its_mapping_stays(void **state) {
  fixture *f = *state;
  must_put(f, ID, "some bytes");
  api_blob blob;
  assert_int_equal(f->store.get(f->store.context, ID, &blob), API_STORE_OK);
  assert_int_equal(f->store.remove(f->store.context, ID), API_STORE_OK);
  assert_false(is_stored(f, ID, "some bytes"));
  assert_memory_equal(blob.bytes.data, "some bytes", 10);
  blob.release(&blob);
  must_put(f, ID, "some bytes");
}

static void lost_summary_is_null_and_made_good_by_the_next_put(void **state) {
  fixture *f = *state;
  must_put(f, ID, "some bytes");
  char path[200];
  snprintf(path, sizeof path, "%s/objects/01/%s.json", f->path, ID);
  assert_int_equal(unlink(path), 0);
  api_listed listed[1];
  size_t count;
  bool more, existed = false;
  assert_int_equal(f->store.list(f->store.context, "", 1, listed, &count, &more), API_STORE_OK);
  assert_null(listed[0].summary);
  assert_int_equal(put(f, ID, "some bytes", &existed), API_STORE_OK);
  assert_true(existed);
  assert_int_equal(f->store.list(f->store.context, "", 1, listed, &count, &more), API_STORE_OK);
  assert_string_equal(listed[0].summary, "{\"n\":1}");
  free(listed[0].summary);
}

static void list_pages_through_all_in_order(void **state) {
  fixture *f = *state;
  enum { MODELS = 60, PAGE = 7 };
  char id[API_ID_TEXT], after[API_ID_TEXT] = "";
  for (unsigned i = 0; i < MODELS; i++) {
    make_id(i, id);
    must_put(f, id, "x");
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
      assert_int_equal(listed[i].size, 1);
      assert_string_equal(listed[i].summary, "{\"n\":1}");
      free(listed[i].summary);
    }
    seen += count;
  }
  assert_int_equal(seen, MODELS);
}

static void full_page_that_is_the_last_says_so(void **state) {
  fixture *f = *state;
  must_put(f, ID, "x");
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

static int make_leftover(const fixture *f, const char *name, char *path, size_t path_size) {
  snprintf(path, path_size, "%s/tmp/%s", f->path, name);
  return open(path, O_CREAT | O_WRONLY, 0600);
}

static void leftovers_of_the_dead_go_at_start_and_those_of_the_living_stay(void **state) {
  fixture *f = *state;
  char dead[128], living[128];
  close(make_leftover(f, "put-1-1", dead, sizeof dead));
  int held = make_leftover(f, "put-2-1", living, sizeof living);
  assert_int_equal(flock(held, LOCK_EX), 0);
  srv_store_fs_close(f->opened);
  open_store(f);
  assert_int_equal(access(dead, F_OK), -1);
  assert_int_equal(access(living, F_OK), 0);
  close(held);
}

/* A process puts one model after another until it is killed; afterwards every model that is listed has all
 * its bytes, and nothing else is left. */
static void kill_at_any_moment_leaves_whole_models(void **state) {
  fixture *f = *state;
  enum { ROUNDS = 12, SIZE = 200000 };
  char *text = malloc(SIZE + 1);
  memset(text, 'x', SIZE);
  text[SIZE] = '\0';
  for (unsigned round = 0; round < ROUNDS; round++) {
    pid_t writer = fork();
    assert_true(writer >= 0);
    if (writer == 0) {
      char id[API_ID_TEXT];
      bool existed;
      for (unsigned i = 0;; i++) {
        make_id(round * 1000 + i, id);
        put(f, id, text, &existed);
      }
    }
    nanosleep(&(struct timespec){.tv_nsec = 3000000L + round * 1700000L}, NULL);
    kill(writer, SIGKILL);
    waitpid(writer, NULL, 0);
  }
  srv_store_fs_close(f->opened);
  open_store(f);
  char after[API_ID_TEXT] = "";
  bool more = true;
  while (more) {
    api_listed listed[1];
    size_t count = 0;
    assert_int_equal(f->store.list(f->store.context, after, 1, listed, &count, &more), API_STORE_OK);
    if (count == 0) break;
    memcpy(after, listed[0].id, sizeof after);
    assert_true(is_stored(f, after, text));
    free(listed[0].summary); /* NULL where the kill came between the model and its summary */
  }
  free(text);
  char temporary[128];
  snprintf(temporary, sizeof temporary, "%s/tmp", f->path);
  assert_int_equal(rmdir(temporary), 0);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(folder_that_cannot_be_used_is_refused),
      cmocka_unit_test_setup_teardown(what_is_no_id_names_no_file, set_up, tear_down),
      cmocka_unit_test_setup_teardown(absent_model_is_absent, set_up, tear_down),
      cmocka_unit_test_setup_teardown(model_is_got_as_it_was_put_also_by_another_process, set_up, tear_down),
      cmocka_unit_test_setup_teardown(empty_model_is_possible, set_up, tear_down),
      cmocka_unit_test_setup_teardown(second_put_says_that_it_was_there, set_up, tear_down),
      cmocka_unit_test_setup_teardown(of_racing_puts_one_is_the_first, set_up, tear_down),
      cmocka_unit_test_setup_teardown(removed_model_is_gone_and_its_mapping_stays, set_up, tear_down),
      cmocka_unit_test_setup_teardown(lost_summary_is_null_and_made_good_by_the_next_put, set_up, tear_down),
      cmocka_unit_test_setup_teardown(list_pages_through_all_in_order, set_up, tear_down),
      cmocka_unit_test_setup_teardown(full_page_that_is_the_last_says_so, set_up, tear_down),
      cmocka_unit_test_setup_teardown(leftovers_of_the_dead_go_at_start_and_those_of_the_living_stay, set_up,
                                      tear_down),
      cmocka_unit_test_setup_teardown(kill_at_any_moment_leaves_whole_models, set_up, tear_down),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
