/* Names that a client may have meant, for the sentence that says that there is none of the name that it gave.
 */
#ifndef API_NEAR_NAMES_H
#define API_NEAR_NAMES_H

#include <stddef.h>

enum { API_NEAR_MOST = 3, API_NEAR_TEXT = 64 };

/* A name that is not there, and those of what is there that are nearest to it. Begin with the first two. */
typedef struct api_near {
  const char *name; /* [length], not terminated */
  size_t length;
  size_t considered, count;
  struct {
    size_t distance;
    char name[API_NEAR_TEXT];
  } names[API_NEAR_MOST]; /* [count], the nearest first */
} api_near;

/* Considers a name that is there. Those over 63 bytes, and those after many others, are passed over. */
void api_near_consider(api_near *near, const char *name);

/* " did you mean a, b?", of names that are about as near as the nearest; "" where nothing is near. */
typedef struct api_near_sentence {
  char text[API_NEAR_MOST * (API_NEAR_TEXT + 2) + 16];
} api_near_sentence;
api_near_sentence api_near_print(const api_near *near);

/* The same of names that end with NULL. */
api_near_sentence api_near_of(const char *name, const char *const *names);

#endif
