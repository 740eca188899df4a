/* The kernel's monotonic clocks as integers, and limits of cgroups: proc's list of the process's groups says
 * where they lie; a limit of any parent counts. */
#include "machine.h"

#include <inttypes.h>
#include <limits.h>
#include <malloc.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

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

/* The number in a file of one; UINT64_MAX where it is "max", or there is no such file. */
static uint64_t read_limit(const char *root, const char *hierarchy, const char *group, const char *name) {
  char path[PATH_MAX], text[32] = "";
  int size = snprintf(path, sizeof path, "%s/sys/fs/cgroup%s%s/%s", root, hierarchy, group, name);
  FILE *file = size > 0 && size < (int)sizeof path ? fopen(path, "re") : NULL;
  if (file == NULL) return UINT64_MAX;
  uint64_t limit = UINT64_MAX;
  if (fgets(text, sizeof text, file) != NULL && text[0] >= '0' && text[0] <= '9')
    limit = strtoull(text, NULL, 10);
  fclose(file);
  return limit;
}

/* The least limit of a group and its parents. Cuts group. */
static uint64_t least_limit(const char *root, const char *hierarchy, char *group, const char *name) {
  uint64_t least = UINT64_MAX;
  for (;;) {
    uint64_t limit = read_limit(root, hierarchy, group, name);
    if (limit < least) least = limit;
    char *slash = strrchr(group, '/');
    if (slash == NULL) return least;
    *slash = '\0';
  }
}

/* Whether a comma-separated list names the controller. */
static bool has_controller(const char *list, const char *name) {
  size_t length = strlen(name);
  for (const char *at = list; (at = strstr(at, name)) != NULL; at += length) {
    bool begins = at == list || at[-1] == ',';
    if (begins && (at[length] == ',' || at[length] == '\0')) return true;
  }
  return false;
}

uint64_t srv_machine_memory_limit(const char *root) {
  char path[PATH_MAX], line[PATH_MAX];
  snprintf(path, sizeof path, "%s/proc/self/cgroup", root);
  FILE *file = fopen(path, "re");
  if (file == NULL) return UINT64_MAX;
  uint64_t least = UINT64_MAX;
  /* Lines NUMBER:CONTROLLERS:GROUP; version 2 has no controllers. */
  while (fgets(line, sizeof line, file) != NULL) {
    line[strcspn(line, "\n")] = '\0';
    char *controllers = strchr(line, ':');
    char *group = controllers != NULL ? strchr(controllers + 1, ':') : NULL;
    if (group == NULL) continue;
    *controllers++ = *group++ = '\0';
    uint64_t limit = UINT64_MAX;
    if (*controllers == '\0')
      limit = least_limit(root, "", group, "memory.max");
    else if (has_controller(controllers, "memory"))
      limit = least_limit(root, "/memory", group, "memory.limit_in_bytes");
    if (limit < least) least = limit;
  }
  fclose(file);
  return least;
}

void srv_machine_share_arena(void) {
#ifdef __GLIBC__
  mallopt(M_ARENA_MAX, 1);
#endif
}

void srv_machine_trim(void) {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}
