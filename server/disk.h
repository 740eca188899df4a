/* Files: complete reads and writes, small texts, temporary files, the files of a store's folder. */
#ifndef SRV_DISK_H
#define SRV_DISK_H

#include <limits.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/stat.h>

/* Writes all bytes; false with errno. */
bool srv_write_all(int fd, const void *data, size_t size);

/* Reads up to `capacity` bytes at an offset; returns fewer only where the file ends, -1 with errno. */
ptrdiff_t srv_read_at(int fd, void *out, size_t capacity, uint64_t offset);

/* A text file of at most size_max bytes, malloc'ed and terminated; NULL with errno. */
char *srv_read_text(const char *path, size_t size_max);

/* Removes blanks and line ends from both ends of the text, in place. Returns its start. */
char *srv_trim(char *text);

/* Creates an empty file in the folder and opens it for reading and writing. Its name is 128 random bits, so
 * that other processes, containers and hosts that share the folder never choose it. path: receives the file's
 * path. -1 with errno. */
int srv_create_temporary(const char *folder, char path[PATH_MAX]);
/* The same, but the file has no name: it vanishes with its descriptor, however the process ends. */
int srv_create_nameless(const char *folder);

/* Stands for a least free space that depends on the file system's size. */
#define SRV_MIN_FREE_AUTO UINT64_MAX

/* Whether `least` bytes stay free for others on the folder's file system with `size` bytes more. least: 0 for
 * any, SRV_MIN_FREE_AUTO for 1 GiB, or 5 % of a smaller file system. A file system that cannot tell has
 * room. */
bool srv_disk_has_room(const char *folder, uint64_t least, uint64_t size);

/* Calls take(context, name, facts) for each regular file in the subfolders 00 to ff, until it returns false.
 * Returns false then. */
bool srv_each_file(const char *folder,
                   bool (*take)(void *context, const char *name, const struct stat *facts), void *context);

#endif
