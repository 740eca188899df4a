/* Words of text that is read where it stands. */
#ifndef TWEEND_WORD_H
#define TWEEND_WORD_H

#include <math.h>
#include <string.h>
#include <strings.h>

#include "number.h"

/* A piece of a text. */
typedef struct tw_word {
  const char *text;
  size_t length;
} tw_word;

static inline bool tw_word_is(tw_word word, const char *text) {
  return strlen(text) == word.length && memcmp(word.text, text, word.length) == 0;
}

/* What printf makes of a value that is not finite, at the beginning of a text: "nan", "-inf", "-nan(ind)".
 * Its length. */
static inline size_t tw_word_begin_not_finite(tw_word word, double *out) {
  const char *at = word.text, *end = word.text + word.length;
  if (at < end && (*at == '-' || *at == '+')) at++;
  bool is_nan = end - at >= 3 && strncasecmp(at, "nan", 3) == 0;
  if (!is_nan && !(end - at >= 3 && strncasecmp(at, "inf", 3) == 0)) return 0;
  at += 3;
  const char *close = at < end && *at == '(' ? (const char *)memchr(at, ')', (size_t)(end - at)) : NULL;
  *out = is_nan ? NAN : INFINITY;
  return (size_t)((close ? close + 1 : at) - word.text);
}

/* A number at the beginning of a text, or what stands where one is not finite; returns its length, 0 where
 * there is none. */
static inline size_t tw_word_begin_number(tw_word word, double *out) {
  size_t used = tw_read_plain(word.text, word.length, out); /* nearly always, and inline */
  if (used == 0) used = tw_read_double(word.text, word.length, out);
  return used > 0 ? used : tw_word_begin_not_finite(word, out);
}

/* A word that is a number and nothing else. */
static inline bool tw_word_number(tw_word word, double *out) {
  size_t used = tw_word_begin_number(word, out);
  return used > 0 && used == word.length;
}

/* The value of a hexadecimal digit; -1 for any other character. */
static inline int tw_hex_digit(char c) {
  if (tw_is_digit(c)) return c - '0';
  char letter = (char)(c | 0x20);
  return letter >= 'a' && letter <= 'f' ? letter - 'a' + 10 : -1;
}

/* Bytes of a byte order mark, which some editors put before UTF-8. */
static inline size_t tw_byte_order_mark(const void *bytes, size_t size) {
  return size >= 3 && memcmp(bytes, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
}

#endif
