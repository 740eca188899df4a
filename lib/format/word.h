/* Words and numbers of files that are read in place. */
#ifndef TWEEND_WORD_H
#define TWEEND_WORD_H

#include <math.h>
#include <string.h>

#include "number.h"

/* A part of a text; a view. */
typedef struct tw_word {
  const char *text;
  size_t length;
} tw_word;

static inline bool tw_word_is(tw_word word, const char *text) {
  return strlen(text) == word.length && memcmp(word.text, text, word.length) == 0;
}

/* Whether a word begins with `begin`, in either case. begin: in lower case. */
static inline bool tw_word_begins(tw_word word, const char *begin) {
  size_t length = strlen(begin), i = 0;
  if (word.length < length) return false;
  while (i < length && (word.text[i] | 0x20) == begin[i]) i++;
  return i == length;
}

/* Reads what printf writes for a number that is not finite, at the beginning of a text: "nan", "-inf",
 * "-nan(ind)". Returns its length, 0 if there is none. *out: NAN, or INFINITY for either sign. */
static inline size_t tw_word_begin_not_finite(tw_word word, double *out) {
  size_t sign = word.length > 0 && (word.text[0] == '-' || word.text[0] == '+') ? 1 : 0, used = sign + 3;
  const tw_word name = {word.text + sign, word.length - sign};
  bool is_nan = tw_word_begins(name, "nan");
  if (!is_nan && !tw_word_begins(name, "inf")) return 0;
  bool is_open = used < word.length && word.text[used] == '(';
  const char *close = is_open ? (const char *)memchr(word.text + used, ')', word.length - used) : NULL;
  *out = is_nan ? NAN : INFINITY;
  return close ? (size_t)(close - word.text) + 1 : used;
}

/* Whether a word is what Microsoft's printf wrote for a number that is not finite until 2015: "1.#INF00",
 * "-1.#IND", "1.#QNAN0", and rounded to fewer places "1.#J" or "1.#R". hash: where its # is. */
static inline bool tw_word_is_hashed(tw_word word, size_t hash) {
  if (hash < 2 || word.text[hash - 2] != '1' || word.text[hash - 1] != '.') return false;
  if (hash > 3 || (hash == 3 && word.text[0] != '-' && word.text[0] != '+')) return false;
  size_t at = hash + 1;
  while (at < word.length && word.text[at] >= 'A' && word.text[at] <= 'Z') at++;
  bool has_letters = at > hash + 1;
  while (at < word.length && word.text[at] == '0') at++;
  return has_letters && at == word.length;
}

/* Reads a number at the beginning of a text, or what printf writes for one that is not finite. Returns its
 * length, 0 if there is none. */
static inline size_t tw_word_begin_number(tw_word word, double *out) {
  size_t used = tw_read_plain(word.text, word.length, out); /* nearly always enough, and inline */
  if (used == 0) used = tw_read_double(word.text, word.length, out);
  if (used == 0) return tw_word_begin_not_finite(word, out);
  if (used == word.length || word.text[used] != '#' || !tw_word_is_hashed(word, used)) return used;
  const tw_word kind = {word.text + used + 1, word.length - used - 1};
  *out = tw_word_begins(kind, "inf") ? INFINITY : NAN;
  return word.length;
}

/* Reads a word that is a number and nothing else; false for any other word. */
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

/* A 32-bit number of a binary file, its lowest byte first. */
static inline uint32_t tw_read_u32(const uint8_t *bytes) {
  return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static inline uint32_t tw_read_u16(const uint8_t *bytes) {
  return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8;
}

static inline float tw_read_f32(const uint8_t *bytes) {
  uint32_t bits = tw_read_u32(bytes);
  float value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

/* Bytes of the byte order mark that some editors put before UTF-8; 0 without one. */
static inline size_t tw_byte_order_mark(const void *bytes, size_t size) {
  return size >= 3 && memcmp(bytes, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
}

#endif
