/* The rules of RFC 9110 and 9112 that decide where a request ends and what its target is. */
#include "framing.h"

#include <ctype.h>
#include <string.h>
#include <strings.h>

static void refuse(srv_framing *framing, int status, const char *detail) {
  if (framing->status != 0) return;
  framing->status = status;
  framing->detail = detail;
}

/* Checks all bytes instead of stopping at the first unsound one: a loop without an early exit can be
 * vectorised. */
static bool all_are(const char *text, size_t size, bool (*is_sound)(unsigned char)) {
  unsigned char unsound = 0;
  for (size_t i = 0; i < size; i++) unsound |= !is_sound((unsigned char)text[i]);
  return unsound == 0;
}

/* ---- the request line ------------------------------------------------------------------------ */

/* Whether each % begins a byte in hexadecimal other than NUL. */
static bool escapes_sound(const char *target) {
  for (const char *at = strchr(target, '%'); at; at = strchr(at + 1, '%')) {
    if (!isxdigit((unsigned char)at[1]) || !isxdigit((unsigned char)at[2])) return false;
    if (at[1] == '0' && at[2] == '0') return false;
  }
  return true;
}

static bool is_target_char(unsigned char c) {
  return c > 0x20 && c < 0x7f && c != '#';
}

bool srv_framing_is_absolute(const char *target) {
  return strncasecmp(target, "http://", 7) == 0 || strncasecmp(target, "https://", 8) == 0;
}

void srv_framing_target(srv_framing *framing, const char *target) {
  size_t size = strlen(target), arguments = 1;
  for (size_t i = 0; i < size; i++) arguments += target[i] == '&';
  framing->seen = size;
  framing->many_arguments = arguments > SRV_ARGUMENTS_MAX;
  if (size > SRV_TARGET_MAX) refuse(framing, 414, "the request target is longer than 8192 bytes");
  if (framing->many_arguments) refuse(framing, 400, "the query has more than 32 arguments");
  if (!all_are(target, size, is_target_char))
    refuse(framing, 400, "the request target holds a character that must be percent-encoded");
  if (!escapes_sound(target))
    refuse(framing, 400, "the request target holds a broken percent-encoding or %00");
  if (target[0] != '/' && strcmp(target, "*") != 0 && !srv_framing_is_absolute(target))
    refuse(framing, 400, "the request target is not a path");
}

void srv_framing_line(srv_framing *framing, const char *method, const char *version) {
  framing->seen += strlen(method) + strlen(version) + strlen("  \r\n");
  if (strcmp(version, "HTTP/1.1") == 0) return;
  framing->http_10 = strcmp(version, "HTTP/1.0") == 0;
  if (!framing->http_10) refuse(framing, 505, "only HTTP/1.1 and HTTP/1.0 are spoken here");
}

/* ---- fields ---------------------------------------------------------------------------------- */

/* tchar of RFC 9110, section 5.6.2. */
static bool is_token_char(unsigned char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '!' ||
         (c >= '#' && c <= '\'') || c == '*' || c == '+' || c == '.' || (c >= '^' && c <= '`') || c == '|' ||
         c == '~';
}

static bool is_field_char(unsigned char c) {
  return (c >= 0x20 && c != 0x7f) || c == '\t';
}

static bool same(const char *text, size_t size, const char *word) {
  return strlen(word) == size && strncasecmp(text, word, size) == 0;
}

static void take_length(srv_framing *framing, const char *value, size_t size) {
  if (framing->has_length) refuse(framing, 400, "Content-Length is there twice");
  framing->has_length = true;
  framing->length = 0;
  /* 18 digits do not overflow, and no body is that long. */
  bool sound = size > 0 && size <= 18;
  for (size_t i = 0; sound && i < size; i++) {
    sound = value[i] >= '0' && value[i] <= '9';
    framing->length = framing->length * 10 + (uint64_t)(unsigned char)(value[i] - '0');
  }
  if (!sound) refuse(framing, 400, "Content-Length is not a plain number");
}

/* Compares the value untrimmed: with blanks after it, the library does not decode the chunks. */
static void take_coding(srv_framing *framing, const char *value, size_t size) {
  if (framing->chunked) refuse(framing, 400, "Transfer-Encoding is there twice");
  framing->chunked = true;
  if (!same(value, size, "chunked")) refuse(framing, 501, "the only transfer coding known here is chunked");
}

static void take_cookies(srv_framing *framing, const char *value, size_t size) {
  framing->cookie_bytes += size;
  framing->fields++;
  for (size_t i = 0; i < size; i++) framing->fields += value[i] == ';' || value[i] == ',';
  if (framing->cookie_bytes > SRV_COOKIES_MAX) refuse(framing, 431, "the cookies are longer than 4096 bytes");
}

/* HOST[:PORT] of RFC 9110, 7.2: a name of RFC 3986 (percent-encodings are left aside: no name has any), or an
 * address in brackets. */
static bool is_host(const char *value, size_t size) {
  static const char name_characters[] =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._~!$&'()*+,;=";
  bool is_address = size > 0 && value[0] == '[';
  size_t at = is_address;
  while (at < size && value[at] != '\0' &&
         strchr(is_address ? "0123456789abcdefABCDEF:." : name_characters, value[at]))
    at++;
  if (at == (size_t)is_address || (is_address && (at == size || value[at++] != ']'))) return false;
  if (at == size) return true;
  if (value[at++] != ':') return false;
  while (at < size && value[at] >= '0' && value[at] <= '9') at++;
  return at == size;
}

void srv_framing_field(srv_framing *framing, const char *name, size_t name_size, const char *value,
                       size_t value_size) {
  framing->fields++;
  framing->seen += (size_t)((uintptr_t)value + value_size - (uintptr_t)name) + strlen("\r\n");
  if (name_size == 0 || !all_are(name, name_size, is_token_char)) {
    refuse(framing, 400, "a field's name holds a character that is not allowed");
    return;
  }
  if (!all_are(value, value_size, is_field_char))
    refuse(framing, 400, "a field's value holds a control character");
  if (same(name, name_size, "Transfer-Encoding")) take_coding(framing, value, value_size);
  if (same(name, name_size, "Cookie")) take_cookies(framing, value, value_size);
  while (value_size > 0 && (value[value_size - 1] == ' ' || value[value_size - 1] == '\t')) value_size--;
  if (same(name, name_size, "Content-Length")) take_length(framing, value, value_size);
  if (same(name, name_size, "Host")) {
    framing->hosts++;
    if (!is_host(value, value_size)) refuse(framing, 400, "Host is not a host with or without a port");
  }
  if (same(name, name_size, "Expect")) {
    framing->continues = true;
    if (!same(value, value_size, "100-continue"))
      refuse(framing, 417, "the only expectation met here is 100-continue");
  }
}

/* ---- the whole ------------------------------------------------------------------------------- */

void srv_framing_end(srv_framing *framing, size_t head_size) {
  if (head_size > SRV_HEAD_MAX) refuse(framing, 431, "the request's head is longer than 16384 bytes");
  if (framing->fields > SRV_FIELDS_MAX) refuse(framing, 431, "there are more than 64 fields and cookies");
  if (framing->has_length && framing->chunked) {
    refuse(framing, 400, "Content-Length and Transfer-Encoding exclude each other");
  }
  if (framing->chunked && framing->http_10) refuse(framing, 400, "HTTP/1.0 knows no Transfer-Encoding");
  if (framing->hosts > 1 || (framing->hosts == 0 && !framing->http_10)) {
    refuse(framing, 400, "a request has one Host field");
  }
}

void srv_framing_whole(srv_framing *framing, size_t head_size) {
  if (framing->seen + strlen("\r\n") == head_size) return;
  refuse(framing, 400,
         "the head holds a zero byte, a field over several lines, a line that ends without CR, or a blank "
         "too many in the request line");
}
