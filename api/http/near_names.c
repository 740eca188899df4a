/* Names are near if few edits lead to them (Levenshtein 1966), or if they begin with the unknown name. */
#include "near_names.h"

#include "api.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

enum { CONSIDERED_MOST = 1024 }; /* bounds the time of an error */

static size_t least(size_t a, size_t b) {
  return a < b ? a : b;
}

static char fold(char c) {
  return (char)(c >= 'A' && c <= 'Z' ? c + ('a' - 'A') : c);
}

/* Keeps one row of the table: row[j] is the distance from the characters of `name` seen so far to the first j
 * of `other`. */
size_t api_name_distance(const char *name, size_t length, const char *other) {
  size_t row[API_NEAR_TEXT], width = least(strlen(other), API_NEAR_TEXT - 1);
  for (size_t j = 0; j <= width; j++) row[j] = j;
  for (size_t i = 1; i <= length; i++) {
    size_t diagonal = row[0];
    row[0] = i;
    for (size_t j = 1; j <= width; j++) {
      size_t exchanged = diagonal + (fold(name[i - 1]) != fold(other[j - 1]));
      diagonal = row[j];
      row[j] = least(exchanged, least(row[j], row[j - 1]) + 1);
    }
  }
  return row[width];
}

void api_near_consider(api_near *near, const char *name) {
  enum { EDITS_MOST = 3, BEGINNING_LEAST = 3 };
  if (near->considered++ >= CONSIDERED_MOST) return;
  if (near->length >= API_NEAR_TEXT || strnlen(name, API_NEAR_TEXT) == API_NEAR_TEXT) return;
  size_t most = least(EDITS_MOST, (near->length + 2) / 3);
  size_t distance = api_name_distance(near->name, near->length, name);
  bool begins = near->length >= BEGINNING_LEAST && strncasecmp(name, near->name, near->length) == 0;
  if (begins) distance = least(distance, most);
  if (distance > most) return;
  for (size_t i = 0; i < near->count; i++)
    if (strcmp(near->names[i].name, name) == 0) return;
  size_t at = near->count;
  while (at > 0 && near->names[at - 1].distance > distance) at--;
  if (at == API_NEAR_MOST) return;
  near->count = least(near->count + 1, API_NEAR_MOST);
  memmove(&near->names[at + 1], &near->names[at], (near->count - 1 - at) * sizeof *near->names);
  near->names[at].distance = distance;
  snprintf(near->names[at].name, API_NEAR_TEXT, "%s", name);
}

api_near_sentence api_near_print(const api_near *near, const char *before) {
  api_near_sentence out = {{0}};
  size_t length = 0;
  for (size_t i = 0; i < near->count && near->names[i].distance <= near->names[0].distance + 1; i++)
    length += (size_t)snprintf(out.text + length, sizeof out.text - length, "%s%s%s", i ? ", " : before,
                               i ? "" : "did you mean ", near->names[i].name);
  if (length) out.text[length] = '?'; /* the rest is zero */
  return out;
}

api_near_sentence api_near_of(const char *name, const char *const *names) {
  api_near near = {.name = name, .length = strlen(name)};
  for (; *names; names++) api_near_consider(&near, *names);
  return api_near_print(&near, " ");
}
