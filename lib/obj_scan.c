/* Walking through OBJ text. */
#include "obj_scan.h"

#include <string.h>

void obj_next_line(obj_text *text) {
  while (text->at < text->end && !obj_is_line_end(*text->at)) text->at++;
  if (text->at == text->end) return;
  text->at += obj_line_end_length(text->at, text->end);
  text->line++;
}

void obj_next_statement(obj_text *text) {
  bool comment = false, continues = false;
  do {
    const uint8_t *start = text->at;
    while (text->at < text->end && !obj_is_line_end(*text->at)) {
      comment = comment || *text->at == '#';
      text->at++;
    }
    if (text->at == text->end) return;
    continues = !comment && text->at > start && text->at[-1] == '\\';
    text->at += obj_line_end_length(text->at, text->end);
    text->line++;
  } while (continues);
}

static bool ends_word(const uint8_t *at, const uint8_t *end) {
  if (*at == ' ' || *at == '\t' || obj_is_line_end(*at)) return true;
  return *at == '\\' && end - at > 1 && obj_is_line_end(at[1]);
}

obj_word obj_read_word(obj_text *text) {
  obj_skip_blanks(text);
  const uint8_t *start = text->at;
  while (text->at < text->end && !ends_word(text->at, text->end)) text->at++;
  return (obj_word){(const char *)start, (size_t)(text->at - start)};
}

obj_word obj_read_rest(obj_text *text) {
  obj_skip_blanks(text);
  const uint8_t *start = text->at;
  while (text->at < text->end && !obj_is_line_end(*text->at)) text->at++;
  const uint8_t *end = text->at;
  while (end > start && (end[-1] == ' ' || end[-1] == '\t')) end--;
  return (obj_word){(const char *)start, (size_t)(end - start)};
}

obj_word obj_read_words(obj_text *text) {
  obj_word all = obj_read_word(text), word = all;
  while (word.length > 0) {
    all.length = (size_t)(word.text + word.length - all.text);
    word = obj_read_word(text);
  }
  return all;
}

bool obj_word_is(obj_word word, const char *text) {
  return strlen(text) == word.length && memcmp(word.text, text, word.length) == 0;
}

/* ---- numbers -------------------------------------------------------------------------------- */

static bool ends_number(const uint8_t *at, const uint8_t *end) {
  return at == end || *at == '#' || ends_word(at, end);
}

/* Plain decimals of up to 15 digits, most of what files hold: digits and power of ten are exact as
 * doubles, so one division rounds correctly. Returns NULL for anything else. */
static const uint8_t *read_plain_number(const uint8_t *at, const uint8_t *end, double *out) {
  static const double powers[16] = {1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                    1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
  bool negative = at < end && *at == '-';
  if (negative) at++;
  const uint8_t *start = at, *stop = end - at > 16 ? at + 16 : end; /* 15 digits and a point */
  uint64_t digits = 0;
  while (at < stop && obj_is_digit(*at)) digits = digits * 10 + (uint64_t)(*at++ - '0');
  size_t count = (size_t)(at - start), decimals = 0;
  if (at < stop && *at == '.') {
    const uint8_t *point = at++;
    while (at < stop && obj_is_digit(*at)) digits = digits * 10 + (uint64_t)(*at++ - '0');
    decimals = (size_t)(at - point) - 1;
    count += decimals;
  }
  if (count == 0 || count > 15 || !ends_number(at, end)) return NULL;
  double value = (double)digits / powers[decimals];
  *out = negative ? -value : value;
  return at;
}

bool obj_read_number(obj_text *text, double *out) {
  obj_skip_blanks(text);
  const uint8_t *after = read_plain_number(text->at, text->end, out);
  if (!after) {
    size_t used = tw_read_double((const char *)text->at, (size_t)(text->end - text->at), out);
    after = text->at + used;
    if (used == 0 || !ends_number(after, text->end)) return false;
  }
  text->at = after;
  return true;
}
