/* The text of OBJ files: statements, words and numbers. */
#include "obj_text.h"

#include <string.h>

/* Bytes of the line end at `at`: 2 for CRLF, else 1. */
static size_t line_end_length(const uint8_t *at, const uint8_t *end) {
  return at[0] == '\r' && end - at > 1 && at[1] == '\n' ? 2 : 1;
}

/* Looks in pieces: a file may have one kind of line end alone, and long lines. */
static const uint8_t *find_line_end(const uint8_t *at, const uint8_t *end) {
  enum { PIECE = 128 };
  while (at < end && !tw_obj_is_line_end(*at)) {
    size_t size = end - at < PIECE ? (size_t)(end - at) : PIECE;
    const uint8_t *feed = memchr(at, '\n', size), *stop = feed ? feed : at + size,
                  *ret = memchr(at, '\r', (size_t)(stop - at));
    at = ret ? ret : stop;
  }
  return at;
}

void tw_obj_skip_continuations(tw_obj_text *text) {
  const uint8_t *at = text->at, *end = text->end;
  while (end - at > 1 && *at == '\\' && tw_obj_is_line_end(at[1])) {
    at += 1 + line_end_length(at + 1, end);
    text->line++;
    while (at < end && tw_obj_is_blank(*at)) at++;
  }
  text->at = at;
}

static bool ends_word(const uint8_t *at, const uint8_t *end) {
  if (*at <= ' ') return true;
  return *at == '\\' && end - at > 1 && tw_obj_is_line_end(at[1]);
}

tw_word tw_obj_read_word(tw_obj_text *text) {
  tw_obj_skip_blanks(text);
  const uint8_t *start = text->at, *at = start, *end = text->end;
  while (at < end && !ends_word(at, end)) at++;
  text->at = at;
  return (tw_word){(const char *)start, (size_t)(at - start)};
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
  for (const uint8_t *c = from.at; c > from.first && !tw_obj_is_line_end(c[-1]); c--)
    column += (c[-1] & 0xC0) != 0x80; /* bytes inside a UTF-8 character do not count */
  tw_fail_line(error, TW_SYNTAX, text->line, "\"%s\" is no %s",
               tw_obj_quote_word(tw_obj_read_word(&from)).text, what);
  if (error) error->column = column;
  return TW_SYNTAX;
}

tw_word tw_obj_read_line(tw_obj_text *text) {
  tw_obj_skip_blanks(text);
  const uint8_t *start = text->at, *end = find_line_end(start, text->end);
  text->at = end;
  while (end > start && tw_obj_is_blank(end[-1])) end--;
  return (tw_word){(const char *)start, (size_t)(end - start)};
}

bool tw_obj_read_number(tw_obj_text *text, double *out) {
  tw_obj_skip_blanks(text);
  size_t used = tw_read_plain((const char *)text->at, (size_t)(text->end - text->at), out);
  bool is_whole = used > 0 && (text->at + used == text->end || text->at[used] != '#');
  if (!is_whole) {
    tw_obj_text word = *text; /* limits the search for the ")" of "nan(" to this word */
    used = tw_word_begin_number(tw_obj_read_word(&word), out);
  }
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

static bool begins_colors(const tw_obj_text *text) {
  size_t length = sizeof TW_OBJ_COLORS - 1;
  return (size_t)(text->end - text->at) > length && memcmp(text->at, TW_OBJ_COLORS, length) == 0 &&
         tw_obj_is_blank(text->at[length]);
}

/* Charges the lines up to `at`, once they are enough to take some microseconds. What reads a long line
 * charges its words. */
static bool charge(tw_obj_text *file) {
  enum { BYTES = 1 << 12, STEPS = 2 * BYTES };
  if (file->at - file->charged < BYTES) return true;
  file->charged = file->at;
  return tw_work(STEPS);
}

bool tw_obj_next_statement(tw_obj_text *file, tw_word *word) {
  do {
    tw_obj_skip_blanks(file);
    if (file->at == file->end) return false;
    if (*file->at > '#') {
      *word = tw_obj_read_word(file);
      return true;
    }
    if (*file->at == '#' && !begins_colors(file)) tw_obj_end_statement(file);
    if (file->at == file->end) return false;
    if (!tw_obj_is_line_end(*file->at)) {
      *word = tw_obj_read_word(file);
      return true;
    }
    file->at += line_end_length(file->at, file->end);
    file->line++;
  } while (charge(file));
  return false;
}

/* A backslash at the end of a comment does not continue the line: it may belong to a path. */
void tw_obj_end_statement(tw_obj_text *file) {
  for (;;) {
    const uint8_t *start = file->at, *end = find_line_end(start, file->end);
    file->at = end;
    bool continues = end > start && end[-1] == '\\' && end < file->end;
    if (!continues || memchr(start, '#', (size_t)(end - start))) return;
    file->at += line_end_length(end, file->end);
    file->line++;
  }
}

tw_obj_text tw_obj_statement(const tw_obj_text *file) {
  tw_obj_text text = *file, behind = text;
  tw_obj_end_statement(&behind);
  text.end = behind.at;
  return text;
}

tw_obj_text tw_obj_text_of(tw_word word) {
  const uint8_t *start = (const uint8_t *)word.text;
  return (tw_obj_text){.at = start, .end = start + word.length};
}

tw_obj_text tw_obj_text_of_file(const uint8_t *bytes, size_t size) {
  const uint8_t *first = bytes + tw_byte_order_mark(bytes, size);
  return (tw_obj_text){.at = first, .end = bytes + size, .line = 1, .first = first, .charged = first};
}

tw_word tw_obj_cut_word(tw_word *name) {
  tw_obj_text text = tw_obj_text_of(*name);
  tw_word word = tw_obj_read_word(&text);
  *name = (tw_word){(const char *)text.at, (size_t)(text.end - text.at)};
  return word;
}

uint64_t tw_obj_count_words(tw_obj_text *text) {
  uint64_t count = 0;
  for (; !tw_obj_statement_ends(text); count++) {
    const uint8_t *at = text->at, *end = text->end;
    while (at < end && ((*at > '#' && *at != '\\') || (*at != '#' && !ends_word(at, end)))) at++;
    text->at = at;
  }
  return count;
}
