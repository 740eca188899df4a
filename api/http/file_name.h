/* File names in Content-Disposition (RFC 6266): read from uploads, suggested by answers. */
#ifndef API_FILE_NAME_H
#define API_FILE_NAME_H

#include "call.h"

/* Reads the file name from the parameters of a Content-Disposition, preferring the decoded filename* to
 * filename; *out is left alone without one. value: what follows the colon. False without memory. */
bool api_file_name_read(api_span value, tw_arena *arena, const char **out);

/* The file's title: the name without folders, at most 255 bytes, as tw_arena_name makes it; NULL where
 * nothing is left, or without memory. */
const char *api_file_name_title(const char *name, tw_arena *arena);

/* Adds Content-Disposition with a model's name, at most 255 bytes of it, its extension replaced by the
 * answer's. name: NULL for none. The query's `download` makes it an attachment. */
api_outcome api_file_name_suggest(api_call *call, const char *name, const char *extension);

#endif
