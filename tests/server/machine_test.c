/* Limits of cgroups, read from a made-up file system. */

#include "test.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "machine.h"

/* Makes PATH below the root, with its folders. */
static void make(const char *root, const char *path, const char *text) {
  char command[1024];
  snprintf(command, sizeof command, "mkdir -p \"$(dirname '%s%s')\"", root, path);
  assert_int_equal(system(command), 0);
  snprintf(command, sizeof command, "%s%s", root, path);
  FILE *file = fopen(command, "w");
  assert_non_null(file);
  fputs(text, file);
  fclose(file);
}

static int make_root(void **state) {
  char *root = strdup("/tmp/tweend-machine-XXXXXX");
  assert_non_null(mkdtemp(root));
  *state = root;
  return 0;
}

static int remove_root(void **state) {
  char command[256];
  snprintf(command, sizeof command, "rm -rf '%s'", (char *)*state);
  free(*state);
  return system(command);
}

TEST_WITH(without_cgroups_there_is_no_limit, make_root, remove_root) {
  assert_true(srv_machine_memory_limit(*state) == UINT64_MAX);
  make(*state, "/proc/self/cgroup", "0::/\n");
  assert_true(srv_machine_memory_limit(*state) == UINT64_MAX);
}

TEST_WITH(the_least_limit_of_a_group_and_its_parents_counts, make_root, remove_root) {
  make(*state, "/proc/self/cgroup", "0::/pod/container\n");
  make(*state, "/sys/fs/cgroup/pod/container/memory.max", "max\n");
  assert_true(srv_machine_memory_limit(*state) == UINT64_MAX);
  make(*state, "/sys/fs/cgroup/pod/memory.max", "536870912\n");
  assert_int_equal(srv_machine_memory_limit(*state), 536870912);
  make(*state, "/sys/fs/cgroup/pod/container/memory.max", "268435456\n");
  assert_int_equal(srv_machine_memory_limit(*state), 268435456);
}

TEST_WITH(version_one_has_a_hierarchy_for_memory, make_root, remove_root) {
  make(*state, "/proc/self/cgroup", "5:cpu,cpuacct:/a\n4:hugetlb,memory:/a\n0::/\n");
  make(*state, "/sys/fs/cgroup/memory/a/memory.limit_in_bytes", "100000000\n");
  make(*state, "/sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");
  assert_int_equal(srv_machine_memory_limit(*state), 100000000);
}
