/* Error reports. */
#include "tweend/base.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

const char *tw_plural(uint64_t count, const char *one, const char *many) {
  return count == 1 ? one : many;
}

/* Removes the incomplete UTF-8 sequence that truncation may have left at the end of text. */
static void trim_partial_character(char *text) {
  size_t length = strlen(text);
  size_t start = length;
  while (start > 0 && ((unsigned char)text[start - 1] & 0xC0) == 0x80) start--;
  if (start == 0) return;
  unsigned char lead = (unsigned char)text[start - 1];
  size_t need = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : lead >= 0xC0 ? 2 : 1;
  if (length - (start - 1) < need) text[start - 1] = '\0';
}

static tw_status fail(tw_error *error, tw_status status, uint64_t line, const char *format,
                      va_list arguments) {
  if (!error) return status;
  error->status = status;
  error->line = line;
  error->column = 0;
  error->pointer[0] = '\0';
  int length = vsnprintf(error->detail, sizeof error->detail, format, arguments);
  if (length >= (int)sizeof error->detail) trim_partial_character(error->detail);
  return status;
}

tw_status tw_fail(tw_error *error, tw_status status, const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  fail(error, status, 0, format, arguments);
  va_end(arguments);
  return status;
}

tw_status tw_fail_line(tw_error *error, tw_status status, uint64_t line, const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  fail(error, status, line, format, arguments);
  va_end(arguments);
  return status;
}

tw_status tw_error_at(tw_error *error, const char *format, ...) {
  if (!error) return TW_INVALID;
  va_list arguments;
  va_start(arguments, format);
  int length = vsnprintf(error->pointer, sizeof error->pointer, format, arguments);
  va_end(arguments);
  if (length >= (int)sizeof error->pointer) {
    char *slash = strrchr(error->pointer, '/');
    if (slash) *slash = '\0';
  }
  return error->status;
}

void tw_error_before(tw_error *error, const char *format, ...) {
  if (!error) return;
  char place[sizeof error->detail];
  va_list arguments;
  va_start(arguments, format);
  int length = vsnprintf(place, sizeof place, format, arguments);
  va_end(arguments);
  size_t place_size = strnlen(place, sizeof place), room = sizeof error->detail - 1 - place_size;
  if (length < 0) return;
  bool is_cut = strlen(error->detail) > room || (size_t)length > place_size;
  memmove(error->detail + place_size, error->detail, room);
  memcpy(error->detail, place, place_size);
  error->detail[sizeof error->detail - 1] = '\0';
  if (is_cut) trim_partial_character(error->detail);
}
