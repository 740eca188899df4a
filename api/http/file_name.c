#include "file_name.h"

#include <string.h>
#include <strings.h>

enum { NAME_MOST = 255 }; /* bytes, the usual limit of file systems */

/* The most of the name's `length` bytes that are whole characters and not over the limit. */
static size_t cut_length(const char *name, size_t length) {
  if (length <= NAME_MOST) return length;
  length = NAME_MOST;
  while (length > 0 && (name[length] & 0xC0) == 0x80) length--; /* UTF-8: not the first byte of a character */
  return length;
}

/* ---- reading --------------------------------------------------------------------------------- */

/* A parameter's value without quotes and the backslashes of escapes. NULL without memory. */
static char *unquote(tw_arena *arena, api_span value) {
  char *text = tw_arena_text(arena, value.text, value.length), *out = text;
  if (!text || *text != '"') return text;
  for (const char *c = text + 1; *c && *c != '"'; c++) {
    if (*c == '\\' && (c[1] == '"' || c[1] == '\\')) c++;
    *out++ = *c;
  }
  *out = '\0';
  return text;
}

/* Decodes UTF-8''na%C3%AFve (RFC 8187; RFC 5987 also has ISO-8859-1) in place; invalid escapes stay as they
 * are. */
static char *decode_extended(char *text) {
  char *charset_end = strchr(text, '\''), *language = charset_end ? strchr(charset_end + 1, '\'') : NULL;
  if (!language) return text;
  char *out = text;
  for (const char *c = language + 1; *c; c++) {
    int high = *c == '%' ? api_hex_digit(c[1]) : -1, low = high >= 0 ? api_hex_digit(c[2]) : -1;
    *out++ = (char)(low >= 0 ? high * 16 + low : *c);
    if (low >= 0) c += 2;
  }
  *out = '\0';
  return text;
}

bool api_file_name_read(api_span value, tw_arena *arena, const char **out) {
  bool is_extended = false;
  while (value.length > 0) {
    api_span parameter = api_span_cut(&value, ';');
    bool extends = api_span_starts(parameter, "filename*=");
    if (!extends && !api_span_starts(parameter, "filename=")) continue;
    api_span_cut(&parameter, '=');
    char *name = unquote(arena, parameter);
    if (!name) return false;
    if (extends || !is_extended) *out = extends ? decode_extended(name) : name;
    is_extended |= extends;
  }
  return true;
}

const char *api_file_name_title(const char *name, tw_arena *arena) {
  for (const char *c = name; *c; c++)
    if (*c == '/' || *c == '\\') name = c + 1;
  char *title = *name ? tw_arena_name(arena, name, strlen(name)) : NULL;
  if (title) title[cut_length(title, strlen(title))] = '\0';
  return title;
}

/* ---- writing --------------------------------------------------------------------------------- */

/* The length of the name without the extension of a file that is uploaded or answered. */
static size_t stem_length(const char *name) {
  static const char *const extensions[] = {".glb", ".gltf", ".vrm", ".vrma", ".obj",
                                           ".stl", ".ply",  ".3mf", ".json", ".bvh"};
  size_t length = strlen(name);
  for (size_t i = 0; i < sizeof extensions / sizeof *extensions; i++) {
    size_t tail = strlen(extensions[i]);
    if (length > tail && strcasecmp(name + length - tail, extensions[i]) == 0) return length - tail;
  }
  return length;
}

/* For clients that do not know filename*: other than plain characters become '_'. */
static void add_fallback(tw_text *text, const char *stem, size_t length) {
  for (size_t i = 0; i < length; i++)
    tw_text_bytes(text, api_is_unreserved(stem[i]) || stem[i] == ' ' ? &stem[i] : "_", 1);
}

static void add_extended(tw_text *text, const char *stem, size_t length) {
  for (size_t i = 0; i < length; i++) {
    char escape[3] = {'%'};
    api_hex((const uint8_t *)&stem[i], 1, escape + 1);
    tw_text_bytes(text, api_is_unreserved(stem[i]) ? &stem[i] : escape, api_is_unreserved(stem[i]) ? 1 : 3);
  }
}

api_outcome api_file_name_suggest(api_call *call, const char *name, const char *extension) {
  static const char *const choices[] = {"0", "1", NULL};
  int download = 0;
  if (api_query_choice(&call->query, "download", choices, &download, &call->fault.error) != TW_OK)
    return api_fail(call);
  const char *stem = name && *name ? name : "model";
  size_t length = cut_length(stem, stem_length(stem));
  tw_text text = {0};
  tw_text_add(&text, download ? "attachment" : "inline");
  tw_text_add(&text, "; filename=\"");
  add_fallback(&text, stem, length);
  tw_text_add(&text, ".");
  tw_text_add(&text, extension);
  tw_text_add(&text, "\"; filename*=UTF-8''");
  add_extended(&text, stem, length);
  tw_text_add(&text, ".");
  tw_text_add(&text, extension);
  const char *value = api_text_move(&text, call->arena);
  if (!value) return api_fail_without_memory(call);
  api_answer_header(&call->answer, "Content-Disposition", value);
  return API_DONE;
}
