/* Walking through OBJ text. */
#include "obj_scan.h"

#include "number.h"

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

bool obj_read_number(obj_text *text, double *out) {
  obj_skip_blanks(text);
  const char *start = (const char *)text->at;
  size_t left = (size_t)(text->end - text->at), used = tw_read_plain(start, left, out);
  if (used == 0) used = tw_read_double(start, left, out);
  if (used == 0 || !ends_number(text->at + used, text->end)) return false;
  text->at += used;
  return true;
}
