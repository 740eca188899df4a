/* Files that are small by nature (keys, certificates) and bytes that are not. */
#include "disk.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
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

/* Reads up to capacity bytes; -1 with errno. */
static ssize_t read_most(int fd, char *out, size_t capacity) {
  size_t size = 0;
  while (size < capacity) {
    ssize_t got = read(fd, out + size, capacity - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return -1;
    if (got == 0) break;
    size += (size_t)got;
  }
  return (ssize_t)size;
}

char *srv_read_text(const char *path, size_t size_max) {
  int fd = open(path, O_RDONLY | O_CLOEXEC);
  if (fd < 0) return NULL;
  char *text = malloc(size_max + 1);
  ssize_t size = text != NULL ? read_most(fd, text, size_max + 1) : -1;
  close(fd);
  if (size < 0 || (size_t)size > size_max) {
    if (size >= 0) errno = EFBIG;
    free(text);
    return NULL;
  }
  text[size] = '\0';
  return text;
}
