/* Names that a client may have meant, for error messages about unknown names. */
#ifndef API_NEAR_NAMES_H
#define API_NEAR_NAMES_H

#include <stddef.h>

enum { API_NEAR_MOST = 3, API_NEAR_TEXT = 64 };

/* An unknown name, and the known names nearest to it. Set the first two members, zero the rest. */
typedef struct api_near {
  const char *name; /* [length], not terminated */
  size_t length;
  size_t considered, count;
  struct {
    size_t distance;
    char name[API_NEAR_TEXT];
  } names[API_NEAR_MOST]; /* [count], nearest first */
} api_near;

/* Considers a known name. Ignores names of over 63 bytes, and all after the first 1024. */
void api_near_consider(api_near *near, const char *name);

/* "did you mean a, b?" behind `before`, with the names whose distance is at most 1 over the nearest; ""
 * without any. before: " " or "; ". */
typedef struct api_near_sentence {
  char text[API_NEAR_MOST * (API_NEAR_TEXT + 2) + 16];
} api_near_sentence;
api_near_sentence api_near_print(const api_near *near, const char *before);

/* The same for an array of known names that ends with NULL, behind a blank. */
api_near_sentence api_near_of(const char *name, const char *const *names);

#endif
