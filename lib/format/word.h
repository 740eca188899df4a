/* Words of text that is read where it stands. */
#ifndef TWEEND_WORD_H
#define TWEEND_WORD_H

#include <string.h>

#include "number.h"

/* A piece of a text. */
typedef struct tw_word {
  const char *text;
  size_t length;
} tw_word;

static inline bool tw_word_is(tw_word word, const char *text) {
  return strlen(text) == word.length && memcmp(word.text, text, word.length) == 0;
}

/* A number at the beginning of a text; returns its length, 0 where there is none. */
static inline size_t tw_word_begin_number(tw_word word, double *out) {
  size_t used = tw_read_plain(word.text, word.length, out); /* nearly always, and inline */
  return used > 0 ? used : tw_read_double(word.text, word.length, out);
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
