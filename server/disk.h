/* Whole files: what partial reads and writes leave to do. */
#ifndef SRV_DISK_H
#define SRV_DISK_H

#include <stdbool.h>
#include <stddef.h>

/* Writes all bytes to a descriptor; false with errno. */
bool srv_write_all(int fd, const void *data, size_t size);

/* A text file of at most size_max bytes, malloc'ed and terminated; NULL with errno. */
char *srv_read_text(const char *path, size_t size_max);

#endif
