#include "body.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "test.h"

enum { MEBIBYTE = 1 << 20 };

TEST(more_than_the_limit_is_refused) {
  srv_body body;
  srv_body_init(&body, 10, "/no/such/folder");
  assert_int_equal(srv_body_append(&body, "0123456789", 10), SRV_BODY_OK);
  assert_int_equal(srv_body_append(&body, "", 0), SRV_BODY_OK);
  assert_int_equal(srv_body_append(&body, "x", 1), SRV_BODY_TOO_LONG);
  srv_body_deinit(&body);
}

TEST(long_body_without_a_folder_fails) {
  srv_body body;
  srv_body_init(&body, UINT64_MAX, "/no/such/folder");
  char *bytes = calloc(1, MEBIBYTE + 1);
  assert_int_equal(srv_body_append(&body, bytes, MEBIBYTE + 1), SRV_BODY_FAILED);
  srv_body_deinit(&body);
  free(bytes);
}

TEST(empty_body_is_a_view_of_nothing) {
  srv_body body;
  api_bytes view;
  srv_body_init(&body, 10, "/no/such/folder");
  assert_int_equal(srv_body_view(&body, &view), SRV_BODY_OK);
  assert_int_equal(view.size, 0);
  assert_non_null(view.data);
  srv_body_deinit(&body);
}

/* Appends `size` bytes in pieces of `piece` and compares the view. */
static void assert_whole(size_t size, size_t piece) {
  char folder[] = "/tmp/tweend-body-XXXXXX";
  assert_non_null(mkdtemp(folder));
  srv_body body;
  srv_body_init(&body, size, folder);
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
