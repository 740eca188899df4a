/* Mapped files: what is read of them does not stay resident over the limit. */
#include "test.h"

#include "disk.h"
#include "mapped.h"

#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

enum { PAGES = 1024 };

static int file_of(size_t size) {
  int file = srv_create_nameless("/tmp");
  uint8_t *bytes = malloc(size);
  assert_true(file >= 0 && bytes);
  for (size_t i = 0; i < size; i++) bytes[i] = (uint8_t)(i * 7 % 251);
  assert_true(srv_write_all(file, bytes, size));
  free(bytes);
  return file;
}

static size_t sum_of(const uint8_t *bytes, size_t size) {
  size_t sum = 0;
  for (size_t i = 0; i < size; i++) sum += bytes[i];
  return sum;
}

/* How often pages have been unmapped, at the latest once they have been `least` times, or after ten seconds.
 */
static uint64_t dropped(srv_mapped *mapped, uint64_t least) {
  uint64_t count = 0;
  for (int tries = 0; tries < 10000; tries++) {
    pthread_mutex_lock(&mapped->lock);
    count = mapped->dropped;
    pthread_mutex_unlock(&mapped->lock);
    if (count >= least) break;
    nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
  }
  return count;
}

TEST(pages_over_the_limit_are_unmapped_and_can_be_read_again) {
  size_t size = PAGES * (size_t)sysconf(_SC_PAGESIZE);
  srv_mapped mapped;
  srv_mapping one = {0}, other = {0};
  int file = file_of(size);
  srv_mapped_init(&mapped, 0); /* always over it */
  const uint8_t *bytes = srv_mapped_add(&mapped, &one, file, size);
  const uint8_t *again = srv_mapped_add(&mapped, &other, file, size / 2);
  assert_true(bytes && again);
  size_t sum = sum_of(bytes, size), half = sum_of(again, size / 2);
  for (uint64_t round = 1; round < 4; round++) {
    assert_true(dropped(&mapped, dropped(&mapped, 0) + 1) >= round);
    assert_int_equal(sum_of(bytes, size), sum);
    assert_int_equal(sum_of(again, size / 2), half);
  }
  srv_mapped_remove(&mapped, &one);
  assert_null(one.start);
  assert_int_equal(sum_of(again, size / 2), half);
  srv_mapped_remove(&mapped, &other);
  srv_mapped_remove(&mapped, &other);
  srv_mapped_deinit(&mapped);
  close(file);
}

TEST(pages_under_the_limit_stay) {
  size_t size = PAGES * (size_t)sysconf(_SC_PAGESIZE);
  srv_mapped mapped;
  srv_mapping one = {0};
  int file = file_of(size);
  srv_mapped_init(&mapped, UINT64_MAX);
  const uint8_t *bytes = srv_mapped_add(&mapped, &one, file, size);
  assert_non_null(bytes);
  sum_of(bytes, size);
  nanosleep(&(struct timespec){.tv_nsec = 50000000}, NULL);
  assert_int_equal(dropped(&mapped, 0), 0);
  srv_mapped_remove(&mapped, &one);
  srv_mapped_deinit(&mapped);
  close(file);
}

TEST(a_file_that_cannot_be_mapped_is_told) {
  srv_mapped mapped;
  srv_mapping one = {0};
  srv_mapped_init(&mapped, 0);
  assert_null(srv_mapped_add(&mapped, &one, -1, 1));
  srv_mapped_remove(&mapped, &one);
  srv_mapped_deinit(&mapped);
}
