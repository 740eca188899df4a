/* Limits of cgroups, read from a made-up file system, and the affinity. */

#include "test.h"
#include <sched.h>
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

/* On one processor the affinity is least, whatever the quotas. */
static void assert_cpus(const char *root, uint64_t limit) {
  uint64_t all = srv_machine_cpus("/nowhere");
  assert_int_equal(srv_machine_cpus(root), limit < all ? limit : all);
}

TEST_WITH(processors_are_those_of_the_affinity, make_root, remove_root) {
  cpu_set_t all, one;
  assert_int_equal(sched_getaffinity(0, sizeof all, &all), 0);
  assert_int_equal(srv_machine_cpus(*state), CPU_COUNT(&all));
  CPU_ZERO(&one);
  for (size_t i = 0; i < CPU_SETSIZE && CPU_COUNT(&one) == 0; i++)
    if (CPU_ISSET(i, &all)) CPU_SET(i, &one);
  assert_int_equal(sched_setaffinity(0, sizeof one, &one), 0);
  uint64_t pinned = srv_machine_cpus(*state);
  assert_int_equal(sched_setaffinity(0, sizeof all, &all), 0);
  assert_int_equal(pinned, 1);
}

TEST_WITH(the_least_quota_of_a_group_and_its_parents_is_rounded_up, make_root, remove_root) {
  static const char leaf[] = "/sys/fs/cgroup/pod/container/cpu.max";
  make(*state, "/proc/self/cgroup", "0::/pod/container\n");
  make(*state, leaf, "max 100000\n");
  assert_cpus(*state, UINT64_MAX);
  make(*state, leaf, "150000 100000\n");
  assert_cpus(*state, 2);
  make(*state, leaf, "10000 100000\n");
  assert_cpus(*state, 1);
  make(*state, leaf, "100000 50000\n");
  assert_cpus(*state, 2);
  make(*state, "/sys/fs/cgroup/pod/cpu.max", "50000 50000\n");
  assert_cpus(*state, 1);
  make(*state, "/sys/fs/cgroup/pod/cpu.max", "50000\n"); /* without a period */
  assert_cpus(*state, 2);
}

TEST_WITH(a_container_sees_the_quota_at_the_root_of_its_namespace, make_root, remove_root) {
  make(*state, "/proc/self/cgroup", "0::/\n");
  make(*state, "/sys/fs/cgroup/cpu.max", "100000 100000\n");
  assert_cpus(*state, 1);
}

TEST_WITH(version_one_has_a_hierarchy_for_processors, make_root, remove_root) {
  make(*state, "/proc/self/cgroup", "5:cpu,cpuacct:/docker/a\n4:cpuset,memory:/docker/a\n");
  make(*state, "/sys/fs/cgroup/cpu/cpu.cfs_quota_us", "-1\n");
  make(*state, "/sys/fs/cgroup/cpu/cpu.cfs_period_us", "100000\n");
  assert_cpus(*state, UINT64_MAX);
  make(*state, "/sys/fs/cgroup/cpu/cpu.cfs_quota_us", "50000\n");
  assert_cpus(*state, 1);
}
