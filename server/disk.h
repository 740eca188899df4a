/* Whole files: what partial reads and writes leave to do, and temporary files. */
#ifndef SRV_DISK_H
#define SRV_DISK_H

#include <limits.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/stat.h>

/* Writes all bytes to a descriptor; false with errno. */
bool srv_write_all(int fd, const void *data, size_t size);

/* Reads up to capacity bytes at an offset, fewer only where the file ends; -1 with errno. */
ptrdiff_t srv_read_at(int fd, void *out, size_t capacity, uint64_t offset);

/* A text file of at most size_max bytes, malloc'ed and terminated; NULL with errno. */
char *srv_read_text(const char *path, size_t size_max);

/* Cuts blanks and ends of lines off both ends of a text. */
char *srv_trim(char *text);

/* Makes an empty file in the folder and opens it for reading and writing. Its name is 128 random bits: other
 * processes, containers and hosts that share the folder never choose it. path: gets its path. -1 with errno.
 */
int srv_create_temporary(const char *folder, char path[PATH_MAX]);
/* The same without a name: it vanishes with its descriptor, however the process ends. */
int srv_create_nameless(const char *folder);

/* Calls take(context, name, facts) for each file in the folders 00 to ff of a folder, until it says false.
 * False then. */
bool srv_each_file(const char *folder,
                   bool (*take)(void *context, const char *name, const struct stat *facts), void *context);

#endif
