#include "obj_text.h"

static bool is_line_end(uint8_t c) {
  return c == '\n' || c == '\r';
}

/* Control characters are blanks too: some exporters end lines or the file with a zero byte or Ctrl-Z. */
static bool is_blank(uint8_t c) {
  return c <= ' ' && !is_line_end(c);
}

/* Bytes of the line end at `at`: 2 for CRLF. */
static size_t line_end_length(const uint8_t *at, const uint8_t *end) {
  return at[0] == '\r' && end - at > 1 && at[1] == '\n' ? 2 : 1;
}

void tw_obj_skip_blanks(tw_obj_text *text) {
  const uint8_t *at = text->at, *end = text->end;
  for (; at < end; at++) {
    if (is_blank(*at)) continue;
    if (*at != '\\' || end - at < 2 || !is_line_end(at[1])) break;
    at += line_end_length(at + 1, end);
    text->line++;
  }
  text->at = at;
}

bool tw_obj_statement_ends(tw_obj_text *text) {
  tw_obj_skip_blanks(text);
  return text->at == text->end || *text->at == '#';
}

static bool ends_word(const uint8_t *at, const uint8_t *end) {
  if (*at <= ' ') return true;
  return *at == '\\' && end - at > 1 && is_line_end(at[1]);
}

tw_word tw_obj_read_word(tw_obj_text *text) {
  tw_obj_skip_blanks(text);
  const uint8_t *start = text->at;
  while (text->at < text->end && !ends_word(text->at, text->end)) text->at++;
  return (tw_word){(const char *)start, (size_t)(text->at - start)};
}

tw_obj_quote tw_obj_quote_word(tw_word word) {
  static const char more[] = "...";
  tw_obj_quote out = {{0}};
  size_t most = sizeof out.text - sizeof more, length = word.length < most ? word.length : most;
  for (size_t i = 0; i < length; i++)
    out.text[i] = (char)(word.text[i] > ' ' && word.text[i] < 0x7F ? word.text[i] : '?');
  if (length < word.length) memcpy(out.text + length, more, sizeof more);
  return out;
}

tw_status tw_obj_fail_word(const tw_obj_text *text, const char *what, tw_error *error) {
  tw_obj_text from = *text;
  while (from.at > from.first && from.at[-1] > ' ') from.at--;
  uint64_t column = 1;
  for (const uint8_t *c = from.at; c > from.first && !is_line_end(c[-1]); c--)
    column += (c[-1] & 0xC0) != 0x80; /* not of bytes inside a UTF-8 character */
  tw_fail_line(error, TW_SYNTAX, text->line, "\"%s\" is no %s",
               tw_obj_quote_word(tw_obj_read_word(&from)).text, what);
  if (error) error->column = column;
  return TW_SYNTAX;
}

tw_word tw_obj_read_rest(tw_obj_text *text) {
  tw_obj_skip_blanks(text);
  const uint8_t *start = text->at, *end = text->end;
  while (end > start && is_blank(end[-1])) end--;
  text->at = text->end;
  return (tw_word){(const char *)start, (size_t)(end - start)};
}

bool tw_obj_read_number(tw_obj_text *text, double *out) {
  tw_obj_skip_blanks(text);
  size_t left = (size_t)(text->end - text->at);
  size_t used = tw_word_begin_number((tw_word){(const char *)text->at, left}, out);
  const uint8_t *stop = text->at + used;
  if (used == 0 || (stop < text->end && *stop != '#' && !ends_word(stop, text->end))) return false;
  text->at = stop;
  return true;
}

bool tw_obj_read_integer(tw_obj_text *text, int64_t *out) {
  const uint8_t *at = text->at, *end = text->end;
  bool negative = at < end && *at == '-';
  if (at < end && (*at == '-' || *at == '+')) at++;
  const uint8_t *start = at;
  int64_t value = 0;
  while (at < end && tw_is_digit((char)*at) && at - start < 18) value = value * 10 + (*at++ - '0');
  if (at == start || (at < end && tw_is_digit((char)*at))) return false;
  *out = negative ? -value : value;
  text->at = at;
  return true;
}

/* Moves behind the line end, or to the end of the text. */
static void next_line(tw_obj_text *text) {
  while (text->at < text->end && !is_line_end(*text->at)) text->at++;
  if (text->at == text->end) return;
  text->at += line_end_length(text->at, text->end);
  text->line++;
}

/* Moves to the end of the statement, its continuation lines included. Comments do not continue: a path may
 * end with a backslash. */
static const uint8_t *statement_end(tw_obj_text *text) {
  for (bool comment = false;;) {
    const uint8_t *start = text->at;
    while (text->at < text->end && !is_line_end(*text->at)) comment |= *text->at++ == '#';
    const uint8_t *end = text->at;
    bool continues = !comment && end > start && end[-1] == '\\';
    if (end == text->end) return end;
    text->at += line_end_length(end, text->end);
    text->line++;
    if (!continues) return end;
  }
}

static bool begins_colors(const tw_obj_text *text) {
  size_t length = sizeof TW_OBJ_COLORS - 1;
  return (size_t)(text->end - text->at) > length && memcmp(text->at, TW_OBJ_COLORS, length) == 0 &&
         is_blank(text->at[length]);
}

bool tw_obj_next_statement(tw_obj_text *file, tw_word *word, tw_obj_text *statement) {
  for (;; next_line(file)) {
    tw_obj_skip_blanks(file);
    if (file->at == file->end) break;
    if (is_line_end(*file->at) || (*file->at == '#' && !begins_colors(file))) continue;
    *word = tw_obj_read_word(file);
    *statement = *file;
    /* What these name goes to the end of its line, whatever that is. */
    if (tw_word_is(*word, "o") || tw_word_is(*word, "usemtl")) {
      tw_obj_skip_blanks(file);
      statement->end = file->at;
      while (statement->end < file->end && !is_line_end(*statement->end)) statement->end++;
      next_line(file);
    } else {
      statement->end = statement_end(file);
    }
    return true;
  }
  *statement = *file;
  return false;
}

tw_obj_text tw_obj_text_of(tw_word word) {
  const uint8_t *start = (const uint8_t *)word.text;
  return (tw_obj_text){start, start + word.length, 0, NULL};
}

tw_word tw_obj_cut_word(tw_word *name) {
  tw_obj_text text = tw_obj_text_of(*name);
  tw_word word = tw_obj_read_word(&text);
  *name = (tw_word){(const char *)text.at, (size_t)(text.end - text.at)};
  return word;
}

bool tw_obj_take_slash(tw_obj_text *text) {
  if (text->at == text->end || *text->at != '/') return false;
  text->at++;
  return true;
}

uint64_t tw_obj_count_words(tw_obj_text *text) {
  uint64_t count = 0;
  for (; !tw_obj_statement_ends(text); count++)
    while (text->at < text->end && *text->at != '#' && !ends_word(text->at, text->end)) text->at++;
  return count;
}
