/* JSON (and other text) into a growing buffer. Failure sticks: print on, look at `failed` at the end. */
#ifndef API_JSON_OUT_H
#define API_JSON_OUT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* A value: zeroed is empty, deinit frees. */
typedef struct api_text {
  char *data;
  size_t size, capacity;
  char last;   /* the last byte printed, also after the buffer was emptied */
  bool failed; /* out of memory: what follows is dropped */
} api_text;

void api_text_deinit(api_text *text);

/* Empties the buffer and keeps its memory, for answers sent piece by piece. */
void api_text_clear(api_text *text);

/* Makes room for `more` bytes, so that they need not be moved as they grow. */
void api_text_reserve(api_text *text, size_t more);
/* Gives back what is reserved and not used. */
void api_text_fit(api_text *text);

void api_text_bytes(api_text *text, const char *bytes, size_t size);
void api_text_add(api_text *text, const char *terminated);

/* A comma unless something has just been opened: call before each element of an array. */
void api_text_element(api_text *text);
/* The comma and `"name":`; the name is written as it stands. */
void api_text_member(api_text *text, const char *name);

/* A member with its value, or with "[" or "{". */
void api_member_string(api_text *text, const char *name, const char *value);
void api_member_count(api_text *text, const char *name, uint64_t value);
void api_member_float(api_text *text, const char *name, float value);
void api_member_floats(api_text *text, const char *name, const float *values, size_t count);
void api_member_open(api_text *text, const char *name, const char *bracket);

/* Names, NULL-terminated, as "a, b, c" into out, terminated; cut off where there is no room for more. */
void api_names_join(const char *const *names, char *out, size_t capacity);

/* A quoted string. Bytes that are not UTF-8 become U+FFFD. */
void api_text_quoted(api_text *text, const char *value, size_t length);
/* The same of a terminated one, or null for NULL. */
void api_text_string(api_text *text, const char *value);
void api_text_count(api_text *text, uint64_t value);
void api_text_integer(api_text *text, int64_t value);
void api_text_float(api_text *text, float value);
void api_text_double(api_text *text, double value);
void api_text_flag(api_text *text, bool value);
/* [a,b,c],[d,e,f]: `count` vectors of `width` numbers, each `stride` numbers behind the one before. */
void api_text_vectors(api_text *text, const float *values, size_t stride, size_t width, size_t count);

/* Room for [count] float32, which are to be filled in; NULL without memory. What is before them ends at a
 * multiple of four bytes. */
float *api_text_room(api_text *text, size_t count);
/* Makes them little-endian, whatever the machine's order. */
void api_text_room_filled(float *values, size_t count);

#endif
