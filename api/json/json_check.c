/* A scanner of JSON (RFC 8259) that keeps nothing but the way to where it is. */
#include "json_check.h"

#include "tweend/base.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* cJSON copies a number into a buffer of 64 bytes and cuts what does not fit. */
enum { NUMBER_LENGTH_MAX = 63 };

/* An array or object that is open. */
typedef struct json_frame {
  bool is_object;
  uint64_t index;               /* of the element under way */
  size_t key_start, key_length; /* of the member under way, as written */
} json_frame;

typedef struct json_scan {
  const char *text;
  size_t size, at;
  uint64_t values, max_values;
  size_t depth;
  json_frame frames[API_JSON_DEPTH_MAX];
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

static void skip_space(json_scan *scan) {
  while (scan->at < scan->size && memchr(" \t\n\r", scan->text[scan->at], 4)) scan->at++;
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
  if (length > NUMBER_LENGTH_MAX)
    return fail(scan, TW_INVALID, "a number of more than %d characters", NUMBER_LENGTH_MAX);
  double value = 0; /* 63 digits without an exponent stay far below the largest double */
  if (has_exponent) tw_read_double(scan->text + start, length, &value);
  if (!isfinite(value)) return fail(scan, TW_INVALID, "the number is too large");
  return TW_OK;
}

/* Four hex digits at the scan; -1 when they are not. */
static int32_t scan_hex(json_scan *scan) {
  int32_t value = 0;
  for (int i = 0; i < 4; i++, scan->at++) {
    char c = peek(scan);
    int digit = c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
    if (c >= 'A' && c <= 'F') digit = c - 'A' + 10;
    if (digit < 0) return -1;
    value = value * 16 + digit;
  }
  return value;
}

/* Behind "\u". */
static tw_status scan_unicode_escape(json_scan *scan) {
  int32_t code = scan_hex(scan);
  if (code < 0) return fail_here(scan, "a hex digit");
  if (code == 0) return fail(scan, TW_SYNTAX, "U+0000 is not accepted in text");
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
  scan->at++; /* the quote */
  while (scan->at < scan->size) {
    unsigned char byte = (unsigned char)scan->text[scan->at];
    if (byte == '"') {
      scan->at++;
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

static tw_status open_frame(json_scan *scan) {
  if (scan->depth == API_JSON_DEPTH_MAX)
    return fail(scan, TW_SYNTAX, "nested deeper than %d levels", API_JSON_DEPTH_MAX);
  scan->frames[scan->depth++] = (json_frame){.is_object = peek(scan) == '{'};
  scan->at++;
  return TW_OK;
}

/* A key and its colon. */
static tw_status scan_key(json_scan *scan) {
  json_frame *frame = &scan->frames[scan->depth - 1];
  frame->key_start = 0; /* a fault in the key is the object's */
  if (peek(scan) != '"') return fail_here(scan, "a key in quotes");
  size_t start = scan->at + 1;
  tw_status status = scan_string(scan);
  if (status != TW_OK) return status;
  frame->key_start = start;
  frame->key_length = scan->at - 1 - start;
  skip_space(scan);
  if (peek(scan) != ':') return fail_here(scan, "':'");
  scan->at++;
  skip_space(scan);
  return TW_OK;
}

/* A scalar, or the opening of an array or object (*opened). */
static tw_status scan_value(json_scan *scan, bool *opened) {
  *opened = false;
  if (++scan->values > scan->max_values)
    return fail(scan, TW_LIMIT, "more than %llu values", (unsigned long long)scan->max_values);
  switch (peek(scan)) {
  case '{':
  case '[': *opened = true; return open_frame(scan);
  case '"': return scan_string(scan);
  case 't': return scan_word(scan, "true");
  case 'f': return scan_word(scan, "false");
  case 'n': return scan_word(scan, "null");
  default: break;
  }
  if (peek(scan) == '-' || (peek(scan) >= '0' && peek(scan) <= '9')) return scan_number(scan);
  return fail_here(scan, "a value");
}

/* Behind a value: closes what ends here, until a comma or the end of the document. */
static tw_status scan_after_value(json_scan *scan) {
  while (scan->depth > 0) {
    skip_space(scan);
    json_frame *frame = &scan->frames[scan->depth - 1];
    char c = peek(scan);
    if (c == ',') {
      scan->at++;
      skip_space(scan);
      frame->index++;
      return frame->is_object ? scan_key(scan) : TW_OK;
    }
    if (c != (frame->is_object ? '}' : ']'))
      return fail_here(scan, frame->is_object ? "',' or '}'" : "',' or ']'");
    scan->at++;
    scan->depth--;
  }
  return TW_OK;
}

tw_status api_json_check(const char *text, size_t size, uint64_t max_values, tw_error *error) {
  json_scan scan = {.text = text, .size = size, .max_values = max_values, .error = error};
  if (size >= 3 && memcmp(text, "\xEF\xBB\xBF", 3) == 0) scan.at = 3;
  skip_space(&scan);
  do {
    bool opened;
    tw_status status = scan_value(&scan, &opened);
    if (status == TW_OK && opened) {
      skip_space(&scan);
      bool is_object = scan.frames[scan.depth - 1].is_object;
      bool is_empty = peek(&scan) == (is_object ? '}' : ']');
      if (!is_empty && is_object) status = scan_key(&scan);
      if (!is_empty && status == TW_OK) continue; /* its first value */
    }
    if (status == TW_OK) status = scan_after_value(&scan);
    if (status != TW_OK) return status;
  } while (scan.depth > 0);
  skip_space(&scan);
  if (scan.at < size) return fail(&scan, TW_SYNTAX, "there is more behind the end of the JSON document");
  return TW_OK;
}
