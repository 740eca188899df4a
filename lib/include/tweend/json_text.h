/* JSON text (RFC 8259), read in place: checked as a whole once, then walked. No tree, no allocation. */
#ifndef TWEEND_JSON_TEXT_H
#define TWEEND_JSON_TEXT_H

#include "tweend/base.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { TW_JSON_DEPTH_MAX = 64 };

/* Limits on a document, beyond the grammar. */
typedef struct tw_json_rules {
  uint64_t values_max; /* values of any kind; 0: any number */
  bool is_for_cjson;   /* no U+0000 in strings, which cJSON terminates, and no number of over 63 characters,
                          which it cuts */
} tw_json_rules;

/* Checks one document: grammar, well-formed UTF-8, no control characters, no half surrogate pairs, numbers
 * within a double's range, depth, number of values. TW_SYNTAX, TW_INVALID (a number) or TW_LIMIT (too many
 * values), with the pointer of the value at fault, and line and column in the detail. O(size). */
tw_status tw_json_check(const char *text, size_t size, const tw_json_rules *rules, tw_error *error);

/* Bytes of the string that opens here, quotes included; `most`, of which all are read then, where it does not
 * close before. Takes any text. */
size_t tw_json_string_size(const char *string, size_t most);

/* ---- walking: everything below takes text that tw_json_check has passed, and no other -------- */

/* The document's value, behind blanks and a byte order mark. Only an object or array may be walked: no other
 * value shows where it ends. */
const char *tw_json_root(const char *text, size_t size);

/* Just past the value that begins here. */
const char *tw_json_skip(const char *value);

/* An element of an array, or a member of an object. */
typedef struct tw_json_item {
  const char *key; /* of a member: the bytes between the quotes, escapes undecoded; NULL for an element */
  size_t key_size;
  const char *value;
} tw_json_item;

/* The first item of an array or object. False where it is empty: out->value is then just past it. */
bool tw_json_first(const char *container, tw_json_item *out);
/* The item after `item`, whose value ends at `end`. False where it was the last one: item->value is then just
 * past the array or object. */
bool tw_json_next(const char *end, tw_json_item *item);

/* Whether a member has this name; escapes in its key are not decoded. */
bool tw_json_key_is(const tw_json_item *item, const char *name);

/* The value of the member of that name; NULL without one, and where `value` is NULL or no object. */
const char *tw_json_member(const char *value, const char *name);

/* Elements of an array. */
uint64_t tw_json_count(const char *array);

/* Decodes the escapes in the `size` bytes between the quotes of a string. The result is never longer, and may
 * contain U+0000. Returns its end in `out`. written: may be NULL where size is 0. */
char *tw_json_unescape(const char *written, size_t size, char *out);

/* Whether a character is a blank between values (RFC 8259, section 2). */
static inline bool tw_json_is_blank(char c) {
  return c == ' ' || c == '\n' || c == '\t' || c == '\r';
}

/* Whether the value is a number. */
static inline bool tw_json_is_number(const char *value) {
  return *value == '-' || (*value >= '0' && *value <= '9');
}

/* Reads a number; returns its end. */
const char *tw_json_number(const char *value, double *out);

#ifdef __cplusplus
}
#endif
#endif
