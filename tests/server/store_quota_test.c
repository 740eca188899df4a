#include "store_quota.h"

#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include "test.h"

typedef struct fixture {
  char folder[64];
  srv_store_quota quota;
} fixture;

static int set_up(void **state) {
  fixture *f = calloc(1, sizeof *f);
  snprintf(f->folder, sizeof f->folder, "/tmp/tweend-quota-XXXXXX");
  if (mkdtemp(f->folder) == NULL) return -1;
  srv_store_quota_init(&f->quota, f->folder);
  srv_store_quota_limit(&f->quota, 100);
  *state = f;
  return 0;
}

static int tear_down(void **state) {
  fixture *f = *state;
  srv_store_quota_deinit(&f->quota);
  int status = rmdir(f->folder);
  free(f);
  return status;
}

/* As a minute later. */
static void count_again(fixture *f) {
  f->quota.counted_ns = 0;
  assert_true(srv_store_quota_take(&f->quota, 0));
}

TEST_WITH(models_being_stored_count_before_they_are_in_the_folder, set_up, tear_down) {
  fixture *f = *state;
  assert_true(srv_store_quota_take(&f->quota, 60));
  assert_false(srv_store_quota_take(&f->quota, 60));
  count_again(f);
  assert_false(srv_store_quota_take(&f->quota, 60));
  assert_int_equal(srv_store_quota_used(&f->quota), 0);
  srv_store_quota_settle(&f->quota, 60, true);
  assert_int_equal(srv_store_quota_used(&f->quota), 60);
  assert_false(srv_store_quota_take(&f->quota, 41));
  assert_true(srv_store_quota_take(&f->quota, 40));
  srv_store_quota_settle(&f->quota, 40, true);
}

TEST_WITH(what_was_not_stored_leaves_its_room, set_up, tear_down) {
  fixture *f = *state;
  for (int i = 0; i < 3; i++) {
    assert_true(srv_store_quota_take(&f->quota, 100));
    srv_store_quota_settle(&f->quota, 100, false);
  }
  assert_int_equal(srv_store_quota_used(&f->quota), 0);
}

TEST_WITH(what_others_store_and_remove_counts_when_the_folder_is_counted_again, set_up, tear_down) {
  fixture *f = *state;
  char prefix[80], object[96];
  snprintf(prefix, sizeof prefix, "%s/ab", f->folder);
  snprintf(object, sizeof object, "%s/object", prefix);
  assert_int_equal(mkdir(prefix, 0700), 0);
  FILE *file = fopen(object, "w");
  assert_non_null(file);
  fprintf(file, "%80s", "");
  assert_int_equal(fclose(file), 0);
  assert_true(srv_store_quota_take(&f->quota, 50));
  srv_store_quota_settle(&f->quota, 50, false);
  count_again(f);
  assert_int_equal(srv_store_quota_used(&f->quota), 80);
  assert_false(srv_store_quota_take(&f->quota, 50));
  assert_int_equal(unlink(object), 0);
  assert_int_equal(rmdir(prefix), 0);
  count_again(f);
  assert_true(srv_store_quota_take(&f->quota, 50));
}
