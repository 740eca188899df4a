/* Recognises formats by how their files begin, as file(1) does. */
#include "foreign.h"

#include "codings.h"

#include <string.h>
#include <strings.h>

static const char export_it[] = "export it as GLB";

typedef struct mark {
  size_t offset;
  const char *text;
  api_foreign is;
} mark;

static const mark marks[] = {
    {0, "Kaydara FBX Binary", {"FBX (binary)", export_it}},
    {0, "; FBX", {"FBX (text)", export_it}},
    {0, "BLENDER", {"Blender's own format", export_it}},
    {0, "PXR-USDC", {"USD (binary)", export_it}},
    {0, "#usda", {"USD (text)", export_it}},
    {0, "OFF\n", {"OFF", "export it as OBJ or PLY"}},
    {0, "OFF\r", {"OFF", "export it as OBJ or PLY"}},
    {0, "#VRML", {"VRML", export_it}},
    {0, "ISO-10303-21", {"STEP", export_it}},
    {0, "DRACO", {"Draco", "send a GLB without compression, or with EXT_meshopt_compression"}},
    {0, "Ogawa", {"Alembic", export_it}},
    {0, "version https://git-lfs", {"a pointer of Git LFS", "fetch the file itself, with git lfs pull"}},
    {0, "\x89PNG", {"PNG", NULL}},
    {0, "\xFF\xD8\xFF", {"JPEG", NULL}},
    {0, "GIF8", {"GIF", NULL}},
    {8, "WEBP", {"WebP", NULL}},
    {0, "%PDF", {"PDF", NULL}},
    {0, "\xFF\xFE", {"text in UTF-16", "save it as UTF-8"}},
    {0, "\xFE\xFF", {"text in UTF-16", "save it as UTF-8"}},
    {0, "plyformat", {"a PLY without its line ends", "curl -d drops them, --data-binary keeps them"}},
};

static bool begins(api_bytes bytes, size_t offset, const char *text) {
  size_t length = strlen(text);
  return bytes.size >= offset + length && memcmp(bytes.data + offset, text, length) == 0;
}

/* Whether the first kilobyte contains the text, in any case. */
static bool holds(api_bytes bytes, const char *text) {
  enum { LOOKED_AT = 1024 };
  size_t length = strlen(text), size = bytes.size < LOOKED_AT ? bytes.size : LOOKED_AT;
  for (size_t i = 0; i + length <= size; i++)
    if (strncasecmp((const char *)bytes.data + i, text, length) == 0) return true;
  return false;
}

/* ---- compressed files ------------------------------------------------------------------------ */

/* A .blend file may be compressed; other gzip and zstd files only lack a Content-Encoding header. name NULL:
 * not compressed. */
static api_foreign recognise_compressed(api_bytes bytes) {
  bool is_gzip = begins(bytes, 0, "\x1F\x8B"), is_zstd = begins(bytes, 0, "\x28\xB5\x2F\xFD");
  if ((is_gzip && api_decodes_to(API_CODING_GZIP, bytes, "BLENDER")) ||
      (is_zstd && api_decodes_to(API_CODING_ZSTD, bytes, "BLENDER")))
    return (api_foreign){"Blender's own format, packed", export_it};
  if (is_gzip) return (api_foreign){"gzip", "send it with Content-Encoding: gzip"};
  if (is_zstd) return (api_foreign){"zstd", "send it with Content-Encoding: zstd"};
  if (!begins(bytes, 0, "PK\3\4")) return (api_foreign){0};
  if (holds(bytes, ".usd")) return (api_foreign){"USDZ", export_it};
  if (holds(bytes, "3D/")) return (api_foreign){"3MF", export_it};
  return (api_foreign){"ZIP", "send the model that is in it"};
}

/* ---- XML and HTML ---------------------------------------------------------------------------- */

static api_foreign recognise_markup(api_bytes bytes) {
  size_t at = begins(bytes, 0, "\xEF\xBB\xBF") ? 3 : 0;
  while (at < bytes.size && bytes.data[at] <= ' ') at++;
  if (at == bytes.size || bytes.data[at] != '<') return (api_foreign){0};
  if (holds(bytes, "<COLLADA")) return (api_foreign){"COLLADA", export_it};
  if (holds(bytes, "<X3D")) return (api_foreign){"X3D", export_it};
  if (holds(bytes, "<html") || holds(bytes, "<!DOCTYPE html")) return (api_foreign){"a web page", NULL};
  return (api_foreign){"XML", NULL};
}

/* ---- files damaged in transit ---------------------------------------------------------------- */

/* An OBJ whose line ends were dropped has points right behind the word or number before them. */
static bool is_stripped_obj(api_bytes bytes) {
  if (memchr(bytes.data, '\n', bytes.size) || memchr(bytes.data, '\r', bytes.size)) return false;
  int points = 0;
  for (size_t i = 1; i + 2 < bytes.size && points < 2; i++) {
    const uint8_t *c = bytes.data + i;
    bool is_number = (c[2] >= '0' && c[2] <= '9') || c[2] == '-' || c[2] == '.';
    points += c[0] == 'v' && c[1] == ' ' && c[-1] > ' ' && is_number;
  }
  return points == 2;
}

/* The version of a GLB is a number of four bytes, three of them zero. */
static bool is_stripped_glb(api_bytes bytes) {
  return begins(bytes, 0, "glTF\2") && bytes.size >= 8 &&
         (bytes.data[5] | bytes.data[6] | bytes.data[7]) != 0;
}

static bool is_utf16_without_mark(api_bytes bytes) {
  if (bytes.size < 4) return false;
  const uint8_t *b = bytes.data;
  return (b[0] && !b[1] && b[2] && !b[3]) || (!b[0] && b[1] && !b[2] && b[3]);
}

/* The first chunk is as long as the file. */
static bool is_3ds(api_bytes bytes) {
  if (!begins(bytes, 0, "MM") || bytes.size < 16) return false;
  const uint8_t *b = bytes.data;
  uint32_t length = b[2] | (uint32_t)b[3] << 8 | (uint32_t)b[4] << 16 | (uint32_t)b[5] << 24;
  return length == bytes.size;
}

/* The first material may follow comment lines. */
static bool is_mtl(api_bytes bytes) {
  size_t at = 0;
  while (at < bytes.size && (bytes.data[at] == '#' || bytes.data[at] <= ' ')) {
    const uint8_t *end = memchr(bytes.data + at, '\n', bytes.size - at);
    at = end ? (size_t)(end - bytes.data) + 1 : bytes.size;
  }
  return begins(bytes, at, "newmtl ");
}

api_foreign api_foreign_known(api_bytes bytes) {
  for (size_t i = 0; i < sizeof marks / sizeof *marks; i++)
    if (begins(bytes, marks[i].offset, marks[i].text)) return marks[i].is;
  api_foreign found = recognise_compressed(bytes);
  if (!found.name) found = recognise_markup(bytes);
  if (found.name) return found;
  if (is_mtl(bytes)) return (api_foreign){"MTL, the materials of an OBJ", "send the OBJ itself"};
  if (is_3ds(bytes)) return (api_foreign){"3DS", export_it};
  if (is_utf16_without_mark(bytes)) return (api_foreign){"text in UTF-16", "save it as UTF-8"};
  if (is_stripped_obj(bytes))
    return (api_foreign){"an OBJ without its line ends", "curl -d drops them, --data-binary keeps them"};
  if (is_stripped_glb(bytes))
    return (api_foreign){"a GLB without its zero bytes", "curl -d drops them, --data-binary keeps them"};
  return (api_foreign){0};
}

/* ---- anything else --------------------------------------------------------------------------- */

/* Whether the line begins with a keyword of OBJ. */
static bool is_obj_line(const uint8_t *line, size_t size) {
  static const char *const words[] = {"v", "vt", "vn", "f", "fo", "o", "g", "usemtl", "mtllib"};
  while (size > 0 && *line <= ' ') line++, size--;
  size_t length = 0;
  while (length < size && line[length] > ' ' && line[length] != '\\') length++;
  for (size_t i = 0; i < sizeof words / sizeof *words; i++)
    if (strlen(words[i]) == length && memcmp(words[i], line, length) == 0) return true;
  return false;
}

api_foreign api_foreign_other(api_bytes bytes) {
  enum { LOOKED_AT = 1024 };
  size_t mark = begins(bytes, 0, "\xEF\xBB\xBF") ? 3 : 0;
  for (size_t start = mark, at = mark; at <= bytes.size; at++) {
    if (at < bytes.size && bytes.data[at] != '\n' && bytes.data[at] != '\r') continue;
    if (is_obj_line(bytes.data + start, at - start)) return (api_foreign){0};
    start = at + 1;
  }
  bool is_text = !memchr(bytes.data, '\0', bytes.size < LOOKED_AT ? bytes.size : LOOKED_AT);
  return (api_foreign){is_text ? "text that is no OBJ" : "data of an unknown kind", NULL};
}
