#include "metrics.h"

#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

#include "test.h"

/* The text of /metrics; free it. */
static char *print(void) {
  static const srv_config config = {0};
  static const srv_gauges gauges = {0};
  size_t size;
  srv_metrics *metrics = srv_metrics_create();
  char *text = srv_metrics_print(metrics, &config, &gauges, &size);
  srv_metrics_destroy(metrics);
  assert_non_null(text);
  return text;
}

TEST(what_cannot_be_counted_without_a_free_descriptor_is_left_out) {
  static const char *const NAMES[] = {"process_resident_memory_bytes", "process_open_fds", "process_threads"};
  struct rlimit usual;
  char *counted = print();
  assert_int_equal(getrlimit(RLIMIT_NOFILE, &usual), 0);
  assert_int_equal(setrlimit(RLIMIT_NOFILE, &(struct rlimit){0, usual.rlim_max}), 0);
  char *uncounted = print();
  assert_int_equal(setrlimit(RLIMIT_NOFILE, &usual), 0);
  for (size_t i = 0; i < sizeof NAMES / sizeof *NAMES; i++) {
    assert_non_null(strstr(counted, NAMES[i]));
    assert_null(strstr(uncounted, NAMES[i]));
  }
  assert_non_null(strstr(uncounted, "\nprocess_max_fds 0\n"));
  free(counted);
  free(uncounted);
}
