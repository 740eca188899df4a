/* Prints JSON into a growing buffer. Numbers are the shortest that read back as the same value. */
#include "tweend/json_print.h"

#include <assert.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "number.h"

void tw_text_deinit(tw_text *text) {
  tw_free(text->data);
  *text = (tw_text){0};
}

void tw_text_clear(tw_text *text) {
  text->size = 0;
}

/* Charges the work of printing that many bytes. A text that is no longer wanted fails, so the loops that
 * print into it do little from then on. */
static void charge(tw_text *text, size_t bytes) {
  enum { BYTES_A_STEP = 8 };
  if (!tw_work(1 + bytes / BYTES_A_STEP)) text->failed = true;
}

/* Room for `more` bytes after the end, charged as work; NULL without memory, or where the text is no longer
 * wanted. */
static char *reserve(tw_text *text, size_t more) {
  if (!text->failed) charge(text, more);
  if (text->failed) return NULL;
  if (text->capacity - text->size >= more) return text->data + text->size;
  if (more > SIZE_MAX / 2 - text->size) {
    text->failed = true;
    return NULL;
  }
  size_t capacity = 2 * text->capacity, least = text->size + more;
  if (capacity < least) capacity = least;
  if (capacity < 512) capacity = 512;
  char *data = tw_resize(text->data, capacity);
  if (!data) {
    text->failed = true;
    return NULL;
  }
  text->data = data;
  text->capacity = capacity;
  return data + text->size;
}

void tw_text_reserve(tw_text *text, size_t more) {
  reserve(text, more);
}

void tw_text_fit(tw_text *text) {
  char *data = text->size > 0 ? tw_resize(text->data, text->size) : NULL;
  if (!data) return; /* the buffer stays as it is */
  text->data = data;
  text->capacity = text->size;
}

void tw_text_bytes(tw_text *text, const char *bytes, size_t size) {
  char *end = size ? reserve(text, size) : NULL;
  if (!end) return;
  memcpy(end, bytes, size);
  text->size += size;
  text->last = bytes[size - 1];
}

void tw_text_add(tw_text *text, const char *terminated) {
  tw_text_bytes(text, terminated, strlen(terminated));
}

void tw_text_element(tw_text *text) {
  if (text->last != '[' && text->last != '{') tw_text_bytes(text, ",", 1);
}

void tw_text_member(tw_text *text, const char *name) {
  size_t length = strlen(name);
  tw_text_element(text);
  char *end = reserve(text, length + 3);
  if (!end) return;
  *end++ = '"';
  memcpy(end, name, length);
  memcpy(end + length, "\":", 2);
  text->size += length + 3;
  text->last = ':';
}

/* Prints the escape of a byte that a JSON string may not hold unescaped. */
static void escape(tw_text *text, unsigned char byte) {
  char code[8];
  switch (byte) {
  case '"': tw_text_bytes(text, "\\\"", 2); return;
  case '\\': tw_text_bytes(text, "\\\\", 2); return;
  case '\n': tw_text_bytes(text, "\\n", 2); return;
  case '\t': tw_text_bytes(text, "\\t", 2); return;
  default: tw_text_bytes(text, code, (size_t)snprintf(code, sizeof code, "\\u%04x", byte)); return;
  }
}

void tw_text_quoted(tw_text *text, const char *value, size_t length) {
  tw_text_bytes(text, "\"", 1);
  size_t plain = 0; /* start of the run that is printed unchanged */
  for (size_t i = 0; i < length && !text->failed;) {
    unsigned char byte = (unsigned char)value[i];
    size_t width = byte < 0x80 ? 1 : tw_utf8_length(value + i, length - i);
    bool as_it_is = byte >= 0x80 ? width > 0 : byte >= 0x20 && byte != '"' && byte != '\\' && byte != 0x7F;
    if (!as_it_is) {
      tw_text_bytes(text, value + plain, i - plain);
      if (byte < 0x80) {
        escape(text, byte);
      } else {
        tw_text_bytes(text, "\xEF\xBF\xBD", 3);
        width = 1;
      }
      plain = i + width;
    }
    i += width;
  }
  tw_text_bytes(text, value + plain, length - plain);
  tw_text_bytes(text, "\"", 1);
}

void tw_names_join(const char *const *names, char *out, size_t capacity) {
  size_t length = 0;
  *out = '\0';
  for (size_t i = 0; names[i] && length < capacity; i++) {
    int more = snprintf(out + length, capacity - length, "%s%s", i ? ", " : "", names[i]);
    length += more > 0 ? (size_t)more : 0;
  }
}

void tw_text_string(tw_text *text, const char *value) {
  if (value)
    tw_text_quoted(text, value, strlen(value));
  else
    tw_text_bytes(text, "null", 4);
}

void tw_text_count(tw_text *text, uint64_t value) {
  char digits[20];
  tw_text_bytes(text, digits, (size_t)(tw_print_count(digits, value) - digits));
}

void tw_text_integer(tw_text *text, int64_t value) {
  char digits[24];
  tw_text_bytes(text, digits, (size_t)snprintf(digits, sizeof digits, "%" PRId64, value));
}

/* Counts `length` bytes, which were printed after the end, as part of the text. */
static void advance(tw_text *text, size_t length) {
  text->size += length;
  text->last = text->data[text->size - 1];
}

void tw_text_float(tw_text *text, float value) {
  char *end = reserve(text, TW_NUMBER_TEXT);
  if (end) advance(text, tw_print_float(end, value));
}

void tw_text_double(tw_text *text, double value) {
  char *end = reserve(text, TW_NUMBER_TEXT);
  if (end) advance(text, tw_print_double(end, value));
}

void tw_text_flag(tw_text *text, bool value) {
  tw_text_add(text, value ? "true" : "false");
}

void tw_text_vectors(tw_text *text, const float *values, size_t stride, size_t width, size_t count) {
  /* Prints as many vectors at once as surely fit the room there is. Where they do not fit, room for a small
   * piece is requested: most numbers are shorter than the longest. */
  enum { PIECE = 64, BRACKETS = 3 };
  size_t each = width * TW_FLOAT_TEXT + BRACKETS, least = width > 0 && width < PIECE ? PIECE / width : 1;
  for (size_t i = 0, piece; i < count; i += piece) {
    size_t room = text->capacity - text->size;
    piece = room > each * least ? (room - 1) / each : least;
    if (piece > count - i) piece = count - i;
    char *start = reserve(text, piece * each + 1), *end = start;
    if (!start) return;
    if (i > 0) *end++ = ',';
    end += tw_print_vectors(end, &(tw_vectors){values + i * stride, stride, width, piece, NULL});
    advance(text, (size_t)(end - start));
  }
}

float *tw_text_room(tw_text *text, size_t count) {
  if (count > SIZE_MAX / sizeof(float)) text->failed = true;
  char *end = reserve(text, text->failed ? 0 : count * sizeof(float));
  if (!end) return NULL;
  assert(text->size % sizeof(float) == 0);
  text->size += count * sizeof(float);
  return (float *)(void *)end;
}

void tw_text_room_filled(float *values, size_t count) {
  if (__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__) return;
  for (size_t i = 0; i < count; i++) {
    uint32_t bits;
    memcpy(&bits, &values[i], sizeof bits);
    bits = __builtin_bswap32(bits);
    memcpy(&values[i], &bits, sizeof bits);
  }
}

void tw_member_string(tw_text *text, const char *name, const char *value) {
  tw_text_member(text, name);
  tw_text_string(text, value);
}

void tw_member_count(tw_text *text, const char *name, uint64_t value) {
  tw_text_member(text, name);
  tw_text_count(text, value);
}

void tw_member_float(tw_text *text, const char *name, float value) {
  tw_text_member(text, name);
  tw_text_float(text, value);
}

void tw_member_floats(tw_text *text, const char *name, const float *values, size_t count) {
  tw_text_member(text, name);
  tw_text_vectors(text, values, count, count, 1);
}

void tw_member_open(tw_text *text, const char *name, const char *bracket) {
  tw_text_member(text, name);
  tw_text_add(text, bracket);
}

void tw_member_words(tw_text *text, const char *name, const char *words) {
  tw_member_open(text, name, "[");
  for (const char *word = words; *word;) {
    size_t length = strcspn(word, " ");
    if (length > 0) {
      tw_text_element(text);
      tw_text_quoted(text, word, length);
    }
    word += length + (word[length] == ' ');
  }
  tw_text_add(text, "]");
}
