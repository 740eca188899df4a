/* Whole reads and writes, temporary files, and walks over a store's folders. */
#include "disk.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/statvfs.h>
#include <unistd.h>

bool srv_write_all(int fd, const void *data, size_t size) {
  const char *at = data;
  while (size > 0) {
    ssize_t written = write(fd, at, size);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    at += written;
    size -= (size_t)written;
  }
  return true;
}

/* Reads until the capacity is filled or the file ends. offset: -1 to read from the file position, as pipes
 * need. */
static ssize_t read_most(int fd, char *out, size_t capacity, off_t offset) {
  size_t size = 0;
  while (size < capacity) {
    ssize_t got = offset < 0 ? read(fd, out + size, capacity - size)
                             : pread(fd, out + size, capacity - size, offset + (off_t)size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return -1;
    if (got == 0) break;
    size += (size_t)got;
  }
  return (ssize_t)size;
}

ptrdiff_t srv_read_at(int fd, void *out, size_t capacity, uint64_t offset) {
  return read_most(fd, out, capacity, (off_t)offset);
}

char *srv_read_text(const char *path, size_t size_max) {
  int fd = open(path, O_RDONLY | O_CLOEXEC);
  if (fd < 0) return NULL;
  char *text = malloc(size_max + 1);
  ssize_t size = text ? read_most(fd, text, size_max + 1, -1) : -1;
  close(fd);
  if (size < 0 || (size_t)size > size_max) {
    if (size >= 0) errno = EFBIG;
    free(text);
    return NULL;
  }
  text[size] = '\0';
  char *fitting = realloc(text, (size_t)size + 1);
  return fitting ? fitting : text;
}

char *srv_trim(char *text) {
  static const char blanks[] = " \t\r\n";
  text += strspn(text, blanks);
  size_t size = strlen(text);
  while (size > 0 && strchr(blanks, text[size - 1])) size--;
  text[size] = '\0';
  return text;
}

int srv_create_temporary(const char *folder, char path[PATH_MAX]) {
  uint64_t random[2];
  if (getrandom(random, sizeof random, 0) != (ssize_t)sizeof random) return -1;
  int length = snprintf(path, PATH_MAX, "%s/%016llx%016llx", folder, (unsigned long long)random[0],
                        (unsigned long long)random[1]);
  if (length >= PATH_MAX) {
    errno = ENAMETOOLONG;
    return -1;
  }
  return open(path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
}

int srv_create_nameless(const char *folder) {
  char path[PATH_MAX];
  int file = srv_create_temporary(folder, path);
  if (file >= 0) unlink(path);
  return file;
}

bool srv_each_file(const char *folder,
                   bool (*take)(void *context, const char *name, const struct stat *facts), void *context) {
  bool goes_on = true;
  for (unsigned prefix = 0; prefix <= 0xff && goes_on; prefix++) {
    char path[PATH_MAX + 4];
    snprintf(path, sizeof path, "%s/%02x", folder, prefix);
    DIR *listing = opendir(path);
    if (!listing) continue;
    for (struct dirent *entry = readdir(listing); entry && goes_on; entry = readdir(listing)) {
      struct stat facts;
      bool is_file =
          fstatat(dirfd(listing), entry->d_name, &facts, AT_SYMLINK_NOFOLLOW) == 0 && S_ISREG(facts.st_mode);
      if (is_file) goes_on = take(context, entry->d_name, &facts);
    }
    closedir(listing);
  }
  return goes_on;
}

bool srv_disk_has_room(const char *folder, uint64_t least, uint64_t size) {
  static const uint64_t USUAL = UINT64_C(1) << 30;
  struct statvfs facts;
  if (least == 0 || statvfs(folder, &facts) != 0 || facts.f_blocks == 0) return true;
  uint64_t block = facts.f_frsize, left = facts.f_bavail * block, twentieth = facts.f_blocks / 20 * block;
  if (least == SRV_MIN_FREE_AUTO) least = twentieth < USUAL ? twentieth : USUAL;
  return size <= left && left - size >= least;
}
