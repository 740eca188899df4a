/* Prints JSON (and other text) into a growing buffer. Failure sticks: print on, and check `failed` at the
 * end. */
#ifndef TWEEND_JSON_PRINT_H
#define TWEEND_JSON_PRINT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A growing buffer. Zeroed it is empty; deinit frees it. Printing is charged as work (tw_work). */
typedef struct tw_text {
  char *data;
  size_t size, capacity;
  char last;   /* the last byte printed, also after the buffer was emptied */
  bool failed; /* out of memory, or no longer wanted (tw_work): what follows is dropped */
} tw_text;

void tw_text_deinit(tw_text *text);

/* Empties the buffer and keeps its memory, for answers sent piece by piece. */
void tw_text_clear(tw_text *text);

/* Reserves room for `more` bytes, so that appending them does not move the buffer. */
void tw_text_reserve(tw_text *text, size_t more);
/* Releases memory that is reserved and not used. */
void tw_text_fit(tw_text *text);

void tw_text_bytes(tw_text *text, const char *bytes, size_t size);
void tw_text_add(tw_text *text, const char *terminated);

/* Prints a comma, unless a bracket has just been opened: call before each element of an array. */
void tw_text_element(tw_text *text);
/* Prints the comma and `"name":`; the name is not escaped. */
void tw_text_member(tw_text *text, const char *name);

/* A member with its value; tw_member_open: with "[" or "{"; tw_member_words: an array of words that blanks
 * separate. */
void tw_member_string(tw_text *text, const char *name, const char *value);
void tw_member_count(tw_text *text, const char *name, uint64_t value);
void tw_member_float(tw_text *text, const char *name, float value);
void tw_member_floats(tw_text *text, const char *name, const float *values, size_t count);
void tw_member_open(tw_text *text, const char *name, const char *bracket);
void tw_member_words(tw_text *text, const char *name, const char *words);

/* Names, NULL-terminated, as "a, b, c" into out, terminated; cut off where there is no room for more. */
void tw_names_join(const char *const *names, char *out, size_t capacity);

/* A quoted string. Bytes that are not UTF-8 become U+FFFD. */
void tw_text_quoted(tw_text *text, const char *value, size_t length);
/* Prints a terminated string quoted, or null for NULL. */
void tw_text_string(tw_text *text, const char *value);
void tw_text_count(tw_text *text, uint64_t value);
void tw_text_integer(tw_text *text, int64_t value);
void tw_text_float(tw_text *text, float value);
void tw_text_double(tw_text *text, double value);
void tw_text_flag(tw_text *text, bool value);
/* [a,b,c],[d,e,f]: `count` vectors of `width` numbers, each `stride` numbers behind the one before. */
void tw_text_vectors(tw_text *text, const float *values, size_t stride, size_t width, size_t count);

/* Appends room for [count] float32 that the caller fills in; NULL without memory. The text before must have a
 * multiple of four bytes. */
float *tw_text_room(tw_text *text, size_t count);
/* Turns the values, once filled in, into little-endian bytes on any machine. */
void tw_text_room_filled(float *values, size_t count);

#ifdef __cplusplus
}
#endif
#endif
