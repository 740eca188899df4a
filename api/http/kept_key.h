/* What makes out the answer to a call: path, '?' and query. Where a pose is asked for at one time, which is
 * written as a plain number, that stands apart: all who play a clip ask for the same thing at other times. */
#ifndef API_KEPT_KEY_H
#define API_KEPT_KEY_H

#include "call.h"

enum { API_KEPT_KEY = 512 };
typedef struct api_kept_key {
  size_t size; /* bytes, without terminator */
  uint32_t hash;
  bool has_time;           /* and it is not in the text, but a line's end, which no query has, in its place */
  float time;              /* with has_time */
  char text[API_KEPT_KEY]; /* terminated */
} api_kept_key;

/* False when no answer to such a call is kept. The call's offer, if it has one, is its extension's. */
bool api_kept_key_read(const api_call *call, api_kept_key *out);

/* A hash of key and time; not 0. */
uint32_t api_kept_key_asked(const api_kept_key *key);

/* Puts the time, where there is one, into the text. */
void api_kept_key_whole(api_kept_key *key);

#endif
