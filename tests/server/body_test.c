#include "body.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "test.h"

enum { MEBIBYTE = 1 << 20 };

static srv_spool nowhere = {.folder = "/no/such/folder"};

TEST(more_than_the_limit_is_refused) {
  srv_body body;
  srv_body_init(&body, 10, &nowhere);
  assert_int_equal(srv_body_append(&body, "0123456789", 10), SRV_BODY_OK);
  assert_int_equal(srv_body_append(&body, "", 0), SRV_BODY_OK);
  assert_int_equal(srv_body_append(&body, "x", 1), SRV_BODY_TOO_LONG);
  srv_body_deinit(&body);
}

TEST(long_body_without_a_folder_fails) {
  srv_body body;
  srv_body_init(&body, UINT64_MAX, &nowhere);
  char *bytes = calloc(1, MEBIBYTE + 1);
  assert_int_equal(srv_body_append(&body, bytes, MEBIBYTE + 1), SRV_BODY_FAILED);
  srv_body_deinit(&body);
  free(bytes);
}

TEST(empty_body_is_a_view_of_nothing) {
  srv_body body;
  api_bytes view;
  srv_body_init(&body, 10, &nowhere);
  assert_int_equal(srv_body_view(&body, &view), SRV_BODY_OK);
  assert_int_equal(view.size, 0);
  assert_non_null(view.data);
  srv_body_deinit(&body);
}

/* Appends `size` bytes in pieces of `piece` and compares the view. */
static void assert_whole(size_t size, size_t piece) {
  char folder[] = "/tmp/tweend-body-XXXXXX";
  assert_non_null(mkdtemp(folder));
  srv_spool spool = {.folder = folder};
  srv_body body;
  srv_body_init(&body, size, &spool);
  uint8_t *bytes = malloc(size);
  for (size_t i = 0; i < size; i++) bytes[i] = (uint8_t)(i * 7 % 255);
  for (size_t i = 0; i < size; i += piece) {
    assert_int_equal(srv_body_append(&body, bytes + i, size - i < piece ? size - i : piece), SRV_BODY_OK);
  }
  api_bytes view;
  assert_int_equal(srv_body_view(&body, &view), SRV_BODY_OK);
  assert_int_equal(view.size, size);
  assert_memory_equal(view.data, bytes, size);
  assert_int_equal(body.spooled, size > MEBIBYTE);
  assert_int_equal(rmdir(folder), 0); /* the file has no name */
  srv_body_deinit(&body);
  free(bytes);
}

TEST(pieces_join_in_memory_and_in_a_file) {
  assert_whole(1, 1);
  assert_whole(16385, 1000);
  assert_whole(MEBIBYTE, 32768);
  assert_whole(MEBIBYTE + 1, 32768);
  assert_whole(3 * MEBIBYTE, 70001);
  assert_whole(3 * MEBIBYTE, 3 * MEBIBYTE);
}

enum { LONG = 2 * MEBIBYTE };

/* Appends zeros. */
static srv_body_status append(srv_body *body, size_t size) {
  uint8_t *bytes = calloc(1, size);
  srv_body_status status = srv_body_append(body, bytes, size);
  free(bytes);
  return status;
}

/* The first buffer of a body is its own; what others have leaves the second one no room. */
TEST(bodies_go_to_files_early_while_others_fill_the_memory) {
  srv_spool spool = {.folder = "/tmp", .memory_limit = MEBIBYTE};
  srv_body large, small;
  api_bytes view;
  srv_body_init(&large, MEBIBYTE, &spool);
  srv_body_init(&small, MEBIBYTE, &spool);
  assert_int_equal(append(&large, MEBIBYTE), SRV_BODY_OK);
  assert_int_equal(append(&small, 16384), SRV_BODY_OK);
  assert_false(large.spooled || small.spooled);
  assert_int_equal(spool.memory, MEBIBYTE + 16384);
  assert_int_equal(append(&small, 1), SRV_BODY_OK);
  assert_true(small.spooled);
  assert_int_equal(spool.memory, MEBIBYTE);
  assert_int_equal(spool.used, 16385);
  assert_int_equal(srv_body_view(&small, &view), SRV_BODY_OK);
  assert_int_equal(view.size, 16385);
  srv_body_deinit(&large);
  srv_body_deinit(&small);
  assert_int_equal(spool.memory, 0);
  assert_int_equal(spool.used, 0);
}

TEST(short_bodies_take_nothing_of_the_spool) {
  srv_spool spool = {.folder = "/tmp", .limit = 1};
  srv_body body;
  srv_body_init(&body, MEBIBYTE, &spool);
  assert_int_equal(srv_body_expect(&body, MEBIBYTE), SRV_BODY_OK);
  assert_int_equal(append(&body, MEBIBYTE), SRV_BODY_OK);
  assert_int_equal(spool.used, 0);
  srv_body_deinit(&body);
  assert_int_equal(spool.used, 0);
}

TEST(bodies_expected_or_not_share_the_spool_and_leave_it) {
  srv_spool spool = {.folder = "/tmp", .limit = 2 * LONG};
  srv_body announced, grown, refused;
  for (int round = 0; round < 3; round++) {
    srv_body_init(&announced, LONG, &spool);
    srv_body_init(&grown, 2 * LONG, &spool);
    srv_body_init(&refused, LONG, &spool);
    assert_int_equal(srv_body_expect(&announced, LONG), SRV_BODY_OK);
    assert_int_equal(spool.used, LONG);
    assert_int_equal(append(&grown, LONG), SRV_BODY_OK);
    assert_int_equal(spool.used, 2 * LONG);
    assert_int_equal(srv_body_expect(&refused, MEBIBYTE + 1), SRV_BODY_CROWDED);
    assert_int_equal(append(&grown, 1), SRV_BODY_CROWDED);
    assert_int_equal(append(&announced, LONG), SRV_BODY_OK); /* what it was promised */
    assert_int_equal(spool.used, 2 * LONG);
    srv_body_deinit(&refused);
    srv_body_deinit(&grown);
    assert_int_equal(spool.used, LONG);
    srv_body_deinit(&announced);
    assert_int_equal(spool.used, 0);
  }
}

TEST(body_that_never_comes_leaves_the_spool) {
  srv_spool spool = {.folder = "/tmp", .limit = LONG};
  srv_body body;
  srv_body_init(&body, LONG, &spool);
  assert_int_equal(srv_body_expect(&body, LONG), SRV_BODY_OK);
  srv_body_deinit(&body);
  assert_int_equal(spool.used, 0);
}

/* Of which no disk has so much free. */
TEST(long_bodies_leave_the_least_free_space) {
  srv_spool spool = {.folder = "/tmp", .min_free = UINT64_C(1) << 60};
  srv_body body;
  srv_body_init(&body, 2 * LONG, &spool);
  assert_int_equal(srv_body_expect(&body, MEBIBYTE), SRV_BODY_OK); /* stays in memory */
  assert_int_equal(srv_body_expect(&body, MEBIBYTE + 1), SRV_BODY_NO_DISK);
  assert_int_equal(append(&body, MEBIBYTE), SRV_BODY_OK);
  assert_int_equal(append(&body, 1), SRV_BODY_NO_DISK);
  assert_int_equal(spool.used, 0);
  srv_body_deinit(&body);
}

TEST(spool_without_a_limit_counts_too) {
  srv_spool spool = {.folder = "/tmp"};
  srv_body body;
  srv_body_init(&body, LONG, &spool);
  assert_int_equal(append(&body, LONG), SRV_BODY_OK);
  assert_int_equal(spool.used, LONG);
  srv_body_deinit(&body);
  assert_int_equal(spool.used, 0);
}
