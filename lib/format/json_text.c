/* The check keeps only the stack of open containers; walking keeps nothing. */
#include "tweend/json_text.h"

#include "word.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* cJSON copies a number into a buffer of 64 bytes. */
enum { NUMBER_LENGTH_MAX = 63 };

/* An array or object that is open. */
typedef struct json_frame {
  bool is_object;
  uint64_t index;               /* of the element being read */
  size_t key_start, key_length; /* of the member being read, undecoded */
} json_frame;

typedef struct json_scan {
  const char *text;
  size_t size, at;
  const tw_json_rules *rules;
  uint64_t values;
  size_t depth;
  json_frame frames[TW_JSON_DEPTH_MAX];
  tw_error *error;
} json_scan;

/* ---- errors ---------------------------------------------------------------------------------- */

/* Appends a reference token to a pointer, escaped as RFC 6901 asks. */
static size_t append_token(char *pointer, size_t length, size_t capacity, const char *token, size_t size) {
  if (length + 1 < capacity) pointer[length++] = '/';
  for (size_t i = 0; i < size && length + 2 < capacity; i++) {
    bool special = token[i] == '~' || token[i] == '/';
    if (special) pointer[length++] = '~';
    pointer[length++] = (char)(token[i] == '~' ? '0' : token[i] == '/' ? '1' : token[i]);
  }
  return length;
}

static void set_pointer(const json_scan *scan) {
  char pointer[512];
  size_t length = 0;
  for (size_t i = 0; i < scan->depth; i++) {
    const json_frame *frame = &scan->frames[i];
    char number[24];
    int digits = snprintf(number, sizeof number, "%llu", (unsigned long long)frame->index);
    if (!frame->is_object)
      length = append_token(pointer, length, sizeof pointer, number, (size_t)digits);
    else if (frame->key_start)
      length =
          append_token(pointer, length, sizeof pointer, scan->text + frame->key_start, frame->key_length);
  }
  pointer[length] = '\0';
  tw_error_at(scan->error, "%s", pointer);
}

static tw_status fail(const json_scan *scan, tw_status status, const char *format, ...) {
  char detail[200];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(detail, sizeof detail, format, arguments);
  va_end(arguments);
  size_t line = 1, column = 1;
  for (size_t i = 0; i < scan->at && i < scan->size; i++) {
    column = scan->text[i] == '\n' ? 1 : column + 1;
    line += scan->text[i] == '\n';
  }
  tw_fail(scan->error, status, "%s (line %zu, column %zu)", detail, line, column);
  set_pointer(scan);
  return status;
}

static tw_status fail_here(const json_scan *scan, const char *expected) {
  if (scan->at >= scan->size) return fail(scan, TW_SYNTAX, "the JSON ends where %s is expected", expected);
  return fail(scan, TW_SYNTAX, "%s is expected", expected);
}

/* ---- scalars --------------------------------------------------------------------------------- */

/* The byte here, 0 at the end (which no grammar rule takes). */
static char peek(const json_scan *scan) {
  return (char)(scan->at < scan->size ? scan->text[scan->at] : '\0');
}

/* Charges the work of reading that many bytes. What calls this cannot end: the caller's next step does. */
static void charge(size_t bytes) {
  enum { BYTES_A_STEP = 8 };
  tw_work(1 + bytes / BYTES_A_STEP);
}

static void skip_blanks(json_scan *scan) {
  size_t start = scan->at;
  while (scan->at < scan->size && tw_json_is_blank(scan->text[scan->at])) scan->at++;
  charge(scan->at - start);
}

static size_t skip_digits(json_scan *scan) {
  size_t start = scan->at;
  while (peek(scan) >= '0' && peek(scan) <= '9') scan->at++;
  return scan->at - start;
}

static tw_status scan_number(json_scan *scan) {
  size_t start = scan->at;
  bool has_exponent = false;
  if (peek(scan) == '-') scan->at++;
  bool leading_zero = peek(scan) == '0';
  size_t digits = skip_digits(scan);
  if (digits == 0 || (leading_zero && digits > 1)) return fail(scan, TW_SYNTAX, "this is no JSON number");
  if (peek(scan) == '.') {
    scan->at++;
    if (skip_digits(scan) == 0) return fail_here(scan, "a digit");
  }
  if (peek(scan) == 'e' || peek(scan) == 'E') {
    has_exponent = true;
    scan->at++;
    if (peek(scan) == '+' || peek(scan) == '-') scan->at++;
    if (skip_digits(scan) == 0) return fail_here(scan, "a digit");
  }
  size_t length = scan->at - start;
  charge(length);
  if (scan->rules->is_for_cjson && length > NUMBER_LENGTH_MAX)
    return fail(scan, TW_INVALID, "a number of more than %d characters", NUMBER_LENGTH_MAX);
  double value = 0; /* up to 63 digits without an exponent stay far below the largest double */
  if (has_exponent || length > NUMBER_LENGTH_MAX) tw_read_double(scan->text + start, length, &value);
  if (!isfinite(value)) return fail(scan, TW_INVALID, "the number is too large");
  return TW_OK;
}

/* Reads four hex digits; -1 if they are none. */
static int32_t scan_hex(json_scan *scan) {
  int32_t value = 0;
  for (int i = 0; i < 4; i++, scan->at++) {
    int digit = tw_hex_digit(peek(scan));
    if (digit < 0) return -1;
    value = value * 16 + digit;
  }
  return value;
}

/* Behind "\u". */
static tw_status scan_unicode_escape(json_scan *scan) {
  int32_t code = scan_hex(scan);
  if (code < 0) return fail_here(scan, "a hex digit");
  if (code == 0 && scan->rules->is_for_cjson) return fail(scan, TW_SYNTAX, "U+0000 is not accepted in text");
  bool is_high = code >= 0xD800 && code <= 0xDBFF, is_low = code >= 0xDC00 && code <= 0xDFFF;
  if (is_high && scan->size - scan->at >= 2 && memcmp(scan->text + scan->at, "\\u", 2) == 0) {
    scan->at += 2;
    code = scan_hex(scan);
    if (code >= 0xDC00 && code <= 0xDFFF) return TW_OK;
  }
  if (is_high || is_low) return fail(scan, TW_SYNTAX, "half of a surrogate pair");
  return TW_OK;
}

static tw_status scan_string(json_scan *scan) {
  size_t start = scan->at++; /* the quote */
  while (scan->at < scan->size) {
    unsigned char byte = (unsigned char)scan->text[scan->at];
    if (byte >= 0x20 && byte < 0x80 && byte != '"' && byte != '\\') {
      scan->at++;
      continue;
    }
    if (byte == '"') {
      scan->at++;
      charge(scan->at - start);
      return TW_OK;
    }
    if (byte < 0x20) return fail(scan, TW_SYNTAX, "a control character in a string must be escaped");
    if (byte == '\\') {
      scan->at++;
      char escape = peek(scan);
      if (escape == '\0' || !strchr("\"\\/bfnrtu", escape)) return fail(scan, TW_SYNTAX, "unknown escape");
      scan->at++;
      if (escape == 'u' && scan_unicode_escape(scan) != TW_OK) return TW_SYNTAX;
      continue;
    }
    size_t length = tw_utf8_length(scan->text + scan->at, scan->size - scan->at);
    if (length == 0) return fail(scan, TW_SYNTAX, "the text is not UTF-8");
    scan->at += length;
  }
  return fail_here(scan, "the end of a string");
}

static tw_status scan_word(json_scan *scan, const char *word) {
  size_t length = strlen(word);
  if (scan->size - scan->at < length || memcmp(scan->text + scan->at, word, length) != 0)
    return fail_here(scan, "a value");
  scan->at += length;
  return TW_OK;
}

/* ---- structure ------------------------------------------------------------------------------- */

/* A key and its colon. */
static tw_status scan_key(json_scan *scan) {
  json_frame *frame = &scan->frames[scan->depth - 1];
  frame->key_start = 0; /* an error in the key points to the object */
  if (peek(scan) != '"') return fail_here(scan, "a key in quotes");
  size_t start = scan->at + 1;
  tw_status status = scan_string(scan);
  if (status != TW_OK) return status;
  frame->key_start = start;
  frame->key_length = scan->at - 1 - start;
  skip_blanks(scan);
  if (peek(scan) != ':') return fail_here(scan, "':'");
  scan->at++;
  skip_blanks(scan);
  return TW_OK;
}

static tw_status scan_value(json_scan *scan);

/* An array or object. */
static tw_status scan_container(json_scan *scan) {
  if (scan->depth == TW_JSON_DEPTH_MAX)
    return fail(scan, TW_SYNTAX, "nested deeper than %d levels", TW_JSON_DEPTH_MAX);
  bool is_object = peek(scan) == '{';
  char closing = is_object ? '}' : ']';
  json_frame *frame = &scan->frames[scan->depth++];
  *frame = (json_frame){.is_object = is_object};
  scan->at++;
  skip_blanks(scan);
  for (bool is_empty = peek(scan) == closing; !is_empty; frame->index++) {
    tw_status status = is_object ? scan_key(scan) : TW_OK;
    if (status == TW_OK) status = scan_value(scan);
    if (status != TW_OK) return status;
    skip_blanks(scan);
    if (peek(scan) != ',') break;
    scan->at++;
    skip_blanks(scan);
  }
  if (peek(scan) != closing) return fail_here(scan, is_object ? "',' or '}'" : "',' or ']'");
  scan->at++;
  scan->depth--;
  return TW_OK;
}

/* Recursion is no deeper than TW_JSON_DEPTH_MAX. */
static tw_status scan_value(json_scan *scan) {
  if (++scan->values > scan->rules->values_max && scan->rules->values_max > 0)
    return fail(scan, TW_LIMIT, "more than %llu values", (unsigned long long)scan->rules->values_max);
  if (!tw_work(1)) return tw_work_status(scan->error);
  switch (peek(scan)) {
  case '{':
  case '[': return scan_container(scan);
  case '"': return scan_string(scan);
  case 't': return scan_word(scan, "true");
  case 'f': return scan_word(scan, "false");
  case 'n': return scan_word(scan, "null");
  default: break;
  }
  if (peek(scan) == '-' || (peek(scan) >= '0' && peek(scan) <= '9')) return scan_number(scan);
  return fail_here(scan, "a value");
}

tw_status tw_json_check(const char *text, size_t size, const tw_json_rules *rules, tw_error *error) {
  json_scan scan = {
      .text = text, .size = size, .at = tw_byte_order_mark(text, size), .rules = rules, .error = error};
  skip_blanks(&scan);
  tw_status status = scan_value(&scan);
  if (status != TW_OK) return status;
  skip_blanks(&scan);
  if (scan.at < size) return fail(&scan, TW_SYNTAX, "there is more behind the end of the JSON document");
  return TW_OK;
}

/* ---- walking --------------------------------------------------------------------------------- */

/* A checked document closes each string, array and object: inside them nothing runs past its end. */

static const char *past_blanks(const char *at) {
  while (tw_json_is_blank(*at)) at++;
  return at;
}

size_t tw_json_string_size(const char *string, size_t most) {
  enum { PIECE = 256 }; /* looked at byte by byte behind an escaped quote, since more of them may follow */
  for (size_t at = 1; at < most;) {
    const char *quote = memchr(string + at, '"', most - at), *before = quote;
    if (!quote) break;
    while (before > string + at && before[-1] == '\\') before--;
    bool is_escaped = (quote - before) % 2 != 0;
    at = (size_t)(quote - string) + 1;
    if (!is_escaped) return at;
    for (size_t end = at + PIECE; at < end && at < most; at++) {
      if (string[at] == '"') return at + 1;
      if (string[at] == '\\') at++;
    }
  }
  return most;
}

/* The string's length is unknown, but memchr stops at the first match (C11, 7.24.5.1), and there is one. */
static const char *past_string(const char *at) {
  return at + tw_json_string_size(at, SIZE_MAX / 4);
}

const char *tw_json_root(const char *text, size_t size) {
  return past_blanks(text + tw_byte_order_mark(text, size));
}

/* Whether the character is part of a number, true, false or null. */
static bool is_scalar(char c) {
  return tw_is_digit(c) || (c >= 'a' && c <= 'z') || c == '-' || c == '+' || c == '.' || c == 'E';
}

static const char *past_value(const char *value) {
  const char *at = value;
  if (*at == '"') return past_string(at);
  if (*at != '{' && *at != '[') {
    while (is_scalar(*at)) at++;
    return at;
  }
  for (size_t depth = 0;;) {
    switch (*at) {
    case '"': at = past_string(at); continue;
    case '{':
    case '[': depth++; break;
    case '}':
    case ']':
      if (--depth == 0) return at + 1;
      break;
    default: break;
    }
    at++;
  }
}

const char *tw_json_skip(const char *value) {
  const char *end = past_value(value);
  charge((size_t)(end - value));
  return end;
}

/* Reads the item that begins at `at`, which is no blank. */
static void read_item(const char *at, bool is_member, tw_json_item *out) {
  *out = (tw_json_item){.value = at};
  if (!is_member) return;
  const char *end = past_string(at);
  out->key = at + 1;
  out->key_size = (size_t)(end - at) - 2;
  out->value = past_blanks(past_blanks(end) + 1);
}

bool tw_json_first(const char *container, tw_json_item *out) {
  const char *at = past_blanks(container + 1);
  bool is_empty = *at == ']' || *at == '}';
  if (is_empty)
    *out = (tw_json_item){.value = at + 1};
  else
    read_item(at, *container == '{', out);
  return !is_empty;
}

bool tw_json_next(const char *end, tw_json_item *item) {
  const char *at = past_blanks(end);
  bool is_last = *at != ',';
  if (is_last)
    *item = (tw_json_item){.value = at + 1};
  else
    read_item(past_blanks(at + 1), item->key != NULL, item);
  return !is_last;
}

bool tw_json_key_is(const tw_json_item *item, const char *name) {
  return item->key_size == strlen(name) && memcmp(item->key, name, item->key_size) == 0;
}

const char *tw_json_member(const char *value, const char *name) {
  tw_json_item item;
  if (!value || *value != '{') return NULL;
  for (bool more = tw_json_first(value, &item); more; more = tw_json_next(tw_json_skip(item.value), &item))
    if (tw_json_key_is(&item, name)) return item.value;
  return NULL;
}

static uint32_t hex4(const char *digits) {
  uint32_t unit = 0;
  for (int i = 0; i < 4; i++) unit = unit << 4 | (uint32_t)tw_hex_digit(digits[i]);
  return unit;
}

static char *put_utf8(char *out, uint32_t code) {
  static const uint32_t leads[] = {0, 0xC0, 0xE0, 0xF0};
  int more = code < 0x80 ? 0 : code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;
  *out++ = (char)(leads[more] | code >> 6 * more);
  while (more-- > 0) *out++ = (char)(0x80 | (code >> 6 * more & 0x3F));
  return out;
}

char *tw_json_unescape(const char *written, size_t size, char *out) {
  static const char letters[] = "bfnrt", meant[] = "\b\f\n\r\t";
  if (size == 0) return out; /* written may be NULL, to which nothing may be added, not even 0 */
  for (const char *c = written, *end = written + size; c < end;) {
    if (*c != '\\') {
      *out++ = *c++;
    } else if (c[1] != 'u') {
      const char *letter = strchr(letters, c[1]);
      *out++ = (char)(letter ? meant[letter - letters] : c[1]);
      c += 2;
    } else {
      uint32_t code = hex4(c + 2);
      c += 6;
      if (code >= 0xD800 && code < 0xDC00) { /* tw_json_check has seen that the other half follows */
        code = 0x10000 + ((code - 0xD800) << 10) + (hex4(c + 2) - 0xDC00);
        c += 6;
      }
      out = put_utf8(out, code);
    }
  }
  return out;
}

uint64_t tw_json_count(const char *array) {
  tw_json_item item;
  uint64_t count = 0;
  for (bool more = tw_json_first(array, &item); more; more = tw_json_next(tw_json_skip(item.value), &item))
    count++;
  return count;
}

const char *tw_json_number(const char *value, double *out) {
  const char *end = tw_json_skip(value);
  tw_read_double(value, (size_t)(end - value), out);
  return end;
}
