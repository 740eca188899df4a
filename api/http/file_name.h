/* Names of files in Content-Disposition (RFC 6266): those that uploads bear and those that answers suggest.
 */
#ifndef API_FILE_NAME_H
#define API_FILE_NAME_H

#include "call.h"

/* The file name among the parameters of a Content-Disposition, the decoded filename* before filename; *out
 * stays where it has none. value: what follows the colon. False without memory. */
bool api_file_name_read(api_span value, tw_arena *arena, const char **out);

/* What a person calls the file: the name without folders; NULL where that is no text to show, or without
 * memory. */
const char *api_file_name_title(const char *name, tw_arena *arena);

/* Adds Content-Disposition with the name of a model, its extension replaced by that of the answer. name: NULL
 * for none. The query's `download` makes it an attachment. */
api_outcome api_file_name_suggest(api_call *call, const char *name, const char *extension);

#endif
