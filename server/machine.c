/* The kernel's clocks as integers, and the limits of cgroups. /proc/self/cgroup lists the groups of the
 * process; the limits of all parents of a group apply too. */
#include "machine.h"

#include <inttypes.h>
#include <limits.h>
#include <malloc.h>
#include <sched.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { LINE_SIZE = 64 };

static const uint64_t NS_PER_S = 1000000000, NS_PER_MS = 1000000;

static uint64_t read_ns(clockid_t id) {
  struct timespec now;
  clock_gettime(id, &now);
  return (uint64_t)now.tv_sec * NS_PER_S + (uint64_t)now.tv_nsec;
}

uint64_t srv_now_ns(void) {
  return read_ns(CLOCK_MONOTONIC);
}

uint64_t srv_now_ms(void) {
  return read_ns(CLOCK_MONOTONIC_COARSE) / NS_PER_MS;
}

uint64_t srv_unix_ns(void) {
  return read_ns(CLOCK_REALTIME);
}

void srv_timed_init(pthread_cond_t *condition) {
  pthread_condattr_t monotonic;
  pthread_condattr_init(&monotonic);
  pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
  pthread_cond_init(condition, &monotonic);
  pthread_condattr_destroy(&monotonic);
}

void srv_timed_wait(pthread_cond_t *condition, pthread_mutex_t *lock, uint64_t end_ns) {
  const struct timespec end = {(time_t)(end_ns / NS_PER_S), (long)(end_ns % NS_PER_S)};
  pthread_cond_timedwait(condition, lock, &end);
}

bool srv_join_soon(pthread_t thread) {
  struct timespec end;
  clock_gettime(CLOCK_REALTIME, &end);
  end.tv_sec++;
  return pthread_timedjoin_np(thread, NULL, &end) == 0;
}

/* Reads the first line of a file in a cgroup's folder. */
static bool read_line(const char *folder, const char *name, char text[LINE_SIZE]) {
  char path[PATH_MAX];
  int size = snprintf(path, sizeof path, "%s/%s", folder, name);
  FILE *file = size > 0 && size < (int)sizeof path ? fopen(path, "re") : NULL;
  if (!file) return false;
  bool is_read = fgets(text, LINE_SIZE, file) != NULL;
  fclose(file);
  return is_read;
}

/* The number at the start of a line; UINT64_MAX where the line begins with "max" or -1. *end: the text after
 * the number, NULL without one. */
static uint64_t number_in(const char *text, char **end) {
  *end = NULL;
  return text[0] >= '0' && text[0] <= '9' ? strtoull(text, end, 10) : UINT64_MAX;
}

/* A limit of one cgroup; UINT64_MAX without one. */
typedef uint64_t group_limit(const char *folder, bool is_version_1);

static uint64_t memory_limit(const char *folder, bool is_version_1) {
  char text[LINE_SIZE], *end;
  const char *name = is_version_1 ? "memory.limit_in_bytes" : "memory.max";
  return read_line(folder, name, text) ? number_in(text, &end) : UINT64_MAX;
}

/* Processor time a period, as a number of processors, rounded up. */
static uint64_t cpu_limit(const char *folder, bool is_version_1) {
  char text[LINE_SIZE], *end;
  if (!read_line(folder, is_version_1 ? "cpu.cfs_quota_us" : "cpu.max", text)) return UINT64_MAX;
  uint64_t quota = number_in(text, &end);
  if (quota == UINT64_MAX) return UINT64_MAX;
  if (is_version_1 && !read_line(folder, "cpu.cfs_period_us", text)) return UINT64_MAX;
  uint64_t period = number_in(is_version_1 ? text : end + strspn(end, " "), &end);
  if (period == 0 || period == UINT64_MAX) return UINT64_MAX;
  uint64_t count = quota / period + (quota % period != 0);
  return count == 0 ? 1 : count;
}

/* The least limit of a group and its parents. Truncates `group`. */
static uint64_t least_limit(const char *root, const char *hierarchy, char *group, group_limit *limit_of) {
  uint64_t least = UINT64_MAX;
  for (;;) {
    char folder[PATH_MAX];
    int size = snprintf(folder, sizeof folder, "%s/sys/fs/cgroup%s%s", root, hierarchy, group);
    uint64_t limit =
        size > 0 && size < (int)sizeof folder ? limit_of(folder, hierarchy[0] != '\0') : UINT64_MAX;
    if (limit < least) least = limit;
    char *slash = strrchr(group, '/');
    if (!slash) return least;
    *slash = '\0';
  }
}

/* Whether a comma-separated list names the controller. */
static bool has_controller(const char *list, const char *name) {
  size_t length = strlen(name);
  for (const char *at = list; (at = strstr(at, name)); at += length) {
    bool begins = at == list || at[-1] == ',';
    if (begins && (at[length] == ',' || at[length] == '\0')) return true;
  }
  return false;
}

/* The least limit of all groups of this process. hierarchy: for version 1, "/" and the controller's name. */
static uint64_t limit_of_groups(const char *root, const char *hierarchy, group_limit *limit_of) {
  char path[PATH_MAX], line[PATH_MAX];
  snprintf(path, sizeof path, "%s/proc/self/cgroup", root);
  FILE *file = fopen(path, "re");
  if (!file) return UINT64_MAX;
  uint64_t least = UINT64_MAX;
  /* Lines are NUMBER:CONTROLLERS:GROUP; in version 2 CONTROLLERS is empty. */
  while (fgets(line, sizeof line, file)) {
    line[strcspn(line, "\n")] = '\0';
    char *controllers = strchr(line, ':');
    char *group = controllers ? strchr(controllers + 1, ':') : NULL;
    if (!group) continue;
    *controllers++ = *group++ = '\0';
    uint64_t limit = UINT64_MAX;
    if (*controllers == '\0')
      limit = least_limit(root, "", group, limit_of);
    else if (has_controller(controllers, hierarchy + 1))
      limit = least_limit(root, hierarchy, group, limit_of);
    if (limit < least) least = limit;
  }
  fclose(file);
  return least;
}

uint64_t srv_machine_memory_limit(const char *root) {
  return limit_of_groups(root, "/memory", memory_limit);
}

uint64_t srv_machine_cpus(const char *root) {
  cpu_set_t set;
  long online = sysconf(_SC_NPROCESSORS_ONLN); /* used when there are more processors than the set holds */
  uint64_t cpus = online < 1 ? 1 : (uint64_t)online;
  if (sched_getaffinity(0, sizeof set, &set) == 0) cpus = (uint64_t)CPU_COUNT(&set);
  uint64_t limit = limit_of_groups(root, "/cpu", cpu_limit);
  return limit < cpus ? limit : cpus;
}

void srv_machine_set_malloc(void) {
#ifdef __GLIBC__
  mallopt(M_ARENA_MAX, 1);
  mallopt(M_MMAP_THRESHOLD, 16 << 20);
  mallopt(M_TRIM_THRESHOLD, 32 << 20);
#endif
}

void srv_machine_trim(void) {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}
