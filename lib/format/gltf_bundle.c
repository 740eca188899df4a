/* A glTF document and the files that it names as one GLB: the files become the BIN chunk, in the order in
 * which buffers and images name them, so that the same files make the same bytes in whatever order they came.
 * Of the JSON only what says where bytes are changes: buffers, images[].uri, and the buffer and byteOffset of
 * bufferViews and of their meshopt extensions; all else is copied as it stands. Names of files are compared,
 * nothing is opened. */
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "tweend/format.h"
#include "tweend/json_print.h"
#include "tweend/json_text.h"

/* A name that finds a file. */
typedef struct file_name {
  const char *text;
  uint32_t file;
} file_name;

/* Where the bytes of a buffer of the document are in the GLB. */
typedef struct placed_buffer {
  uint32_t index;
  uint64_t offset; /* in the BIN chunk */
  uint64_t length; /* as declared; UINT64_MAX where that is no number, which the reader refuses */
} placed_buffer;

/* Members of the document; NULL where it has none. */
typedef struct document_parts {
  const char *buffers, *views, *images;
} document_parts;

typedef struct bundle {
  tw_arena *arena;
  tw_named_file *files;
  uint32_t file_count;
  file_name *paths, *bases; /* [file_count], sorted */
  uint64_t *offsets;        /* [file_count] in the BIN chunk; UINT64_MAX: not in it */
  uint32_t *image_views;    /* [file_count] buffer views of images; TW_NO_INDEX: none */
  uint64_t bin_size;
  uint64_t buffer_count, view_count;
  placed_buffer *buffers;
  uint64_t merged_count; /* buffers that came as files */
  const char *merged;    /* the last of them */
  uint32_t *added_views; /* [added_count] files of images */
  uint32_t added_count;
  tw_error *error;
} bundle;

static tw_status no_memory(tw_error *error) {
  return tw_fail(error, TW_NO_MEMORY, "no memory to join a glTF and its files");
}

/* ---- names --------------------------------------------------------------------------------------------- */

static int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

/* The text of a checked JSON string. NULL without memory. */
static char *read_string(tw_arena *arena, const char *quoted) {
  size_t size = (size_t)(tw_json_skip(quoted) - quoted) - 2;
  char *text = tw_arena_alloc_raw(arena, size + 1, 1);
  if (text) *tw_json_unescape(quoted + 1, size, text) = '\0';
  return text;
}

/* Undoes percent-encoding in place; what is no escape stays. */
static void decode_percent(char *text) {
  char *out = text;
  for (const char *c = text; *c; c++) {
    bool is_escape = c[0] == '%' && hex_digit(c[1]) >= 0 && hex_digit(c[2]) >= 0;
    *out++ = (char)(is_escape ? hex_digit(c[1]) << 4 | hex_digit(c[2]) : *c);
    if (is_escape) c += 2;
  }
  *out = '\0';
}

/* Slashes between the steps of a path, no "." among them, in place. */
static char *simplify_path(char *path) {
  char *out = path;
  for (char *c = path; *c; c++)
    if (*c == '\\') *c = '/';
  for (const char *step = path; *step;) {
    size_t length = strcspn(step, "/");
    bool is_empty = length == 0 || (length == 1 && *step == '.'), more = step[length] == '/';
    if (!is_empty) {
      memmove(out, step, length);
      out += length;
      if (more) *out++ = '/';
    }
    step += length + more;
  }
  *out = '\0';
  return path;
}

static const char *base_of(const char *path) {
  const char *slash = strrchr(path, '/');
  return slash ? slash + 1 : path;
}

static int compare_names(const void *a, const void *b) {
  const file_name *left = a, *right = b;
  int order = strcmp(left->text, right->text);
  return order ? order : left->file < right->file ? -1 : left->file > right->file;
}

static tw_status sort_names(bundle *b) {
  b->paths = tw_arena_alloc(b->arena, b->file_count, sizeof *b->paths);
  b->bases = tw_arena_alloc(b->arena, b->file_count, sizeof *b->bases);
  if (!b->paths || !b->bases) return no_memory(b->error);
  for (uint32_t i = 0; i < b->file_count; i++) {
    char *path = tw_arena_text(b->arena, b->files[i].name, strlen(b->files[i].name));
    if (!path) return no_memory(b->error);
    simplify_path(path);
    b->paths[i] = (file_name){path, i};
    b->bases[i] = (file_name){base_of(path), i};
  }
  qsort(b->paths, b->file_count, sizeof *b->paths, compare_names);
  qsort(b->bases, b->file_count, sizeof *b->bases, compare_names);
  return TW_OK;
}

/* How many names are `text`; *first: where they begin. O(log n + count). */
static uint32_t find_name(const file_name *names, uint32_t count, const char *text, uint32_t *first) {
  uint32_t low = 0, high = count;
  while (low < high) {
    uint32_t middle = low + (high - low) / 2;
    if (strcmp(names[middle].text, text) < 0)
      low = middle + 1;
    else
      high = middle;
  }
  *first = low;
  while (high < count && high - low < 2 && strcmp(names[high].text, text) == 0) high++;
  return high - low;
}

/* The file that a uri means: by its path, else by its base name where only one file has that. */
static tw_status find_file(const bundle *b, char *uri, uint32_t *out) {
  decode_percent(uri);
  const char *path = simplify_path(uri);
  uint32_t first, count = find_name(b->paths, b->file_count, path, &first);
  const file_name *names = b->paths;
  if (count == 0) {
    names = b->bases;
    count = find_name(names, b->file_count, base_of(path), &first);
  }
  if (count == 0) return tw_fail(b->error, TW_INVALID, "the file \"%.100s\" was not sent", path);
  if (count > 1)
    return tw_fail(b->error, TW_INVALID, "several files are called \"%.100s\"", names[first].text);
  *out = names[first].file;
  return TW_OK;
}

/* ---- placing ------------------------------------------------------------------------------------------- */

static uint64_t place_file(bundle *b, uint32_t file) {
  if (b->offsets[file] == UINT64_MAX) {
    b->offsets[file] = b->bin_size;
    b->bin_size = (b->bin_size + b->files[file].size + 3) / 4 * 4;
    b->files[file].is_used = true;
  }
  return b->offsets[file];
}

/* A whole number that JSON and a double hold alike; false for any other value. */
static bool read_count(const char *value, uint64_t *out) {
  double number;
  if (!tw_json_is_number(value)) return false;
  tw_json_number(value, &number);
  if (!(number >= 0 && number <= 9007199254740992.0) || number != (double)(uint64_t)number) return false;
  *out = (uint64_t)number;
  return true;
}

static bool starts_with(const char *text, const char *scheme) {
  for (; *scheme; text++, scheme++)
    if ((*text >= 'A' && *text <= 'Z' ? *text + 32 : *text) != *scheme) return false;
  return true;
}

/* The uri of a buffer or an image as a text of the arena; NULL where it has none, or the bytes are in it. */
static tw_status read_uri(const bundle *b, const char *object, char **out) {
  const char *uri = tw_json_member(object, "uri");
  *out = NULL;
  if (!uri || *uri != '"' || starts_with(uri + 1, "data:")) return TW_OK;
  *out = read_string(b->arena, uri);
  return *out ? TW_OK : no_memory(b->error);
}

static uint64_t declared_length(const char *object) {
  const char *value = tw_json_member(object, "byteLength");
  uint64_t length;
  return value && read_count(value, &length) ? length : UINT64_MAX;
}

static tw_status place_buffer(bundle *b, const char *object, uint64_t index) {
  placed_buffer *placed = &b->buffers[index];
  char *uri;
  tw_status status = read_uri(b, object, &uri);
  placed->length = declared_length(object);
  if (status != TW_OK || !uri) return status;
  uint32_t file;
  if (find_file(b, uri, &file) != TW_OK) return tw_error_at(b->error, "/buffers/%" PRIu64 "/uri", index);
  if (placed->length > b->files[file].size) {
    tw_fail(b->error, TW_INVALID, "the file of the buffer has only %zu bytes", b->files[file].size);
    return tw_error_at(b->error, "/buffers/%" PRIu64 "/byteLength", index);
  }
  placed->offset = place_file(b, file);
  placed->index = TW_NO_INDEX; /* until all are known */
  b->merged = object;
  b->merged_count++;
  return TW_OK;
}

static tw_status place_image(bundle *b, const char *object, uint64_t index) {
  char *uri;
  tw_status status = read_uri(b, object, &uri);
  if (status != TW_OK || !uri || starts_with(uri, "http://") || starts_with(uri, "https://")) return status;
  uint32_t file;
  if (find_file(b, uri, &file) != TW_OK) return tw_error_at(b->error, "/images/%" PRIu64 "/uri", index);
  place_file(b, file);
  if (b->image_views[file] != TW_NO_INDEX) return TW_OK;
  b->image_views[file] = (uint32_t)b->view_count + b->added_count;
  b->added_views[b->added_count++] = file;
  return TW_OK;
}

static tw_status place_all(bundle *b, const char *array,
                           tw_status (*place)(bundle *b, const char *object, uint64_t index)) {
  tw_json_item item;
  tw_status status = TW_OK;
  uint64_t index = 0;
  for (bool more = array && tw_json_first(array, &item); more && status == TW_OK;
       more = tw_json_next(tw_json_skip(item.value), &item))
    status = place(b, item.value, index++);
  return status;
}

/* The BIN chunk is buffer 0, the others follow it. */
static void number_buffers(bundle *b) {
  uint32_t next = b->bin_size > 0;
  for (uint64_t i = 0; i < b->buffer_count; i++)
    b->buffers[i].index = b->buffers[i].index == TW_NO_INDEX ? 0 : next++;
}

/* ---- printing ------------------------------------------------------------------------------------------ */

static void put_key(tw_text *text, const tw_json_item *item) {
  tw_text_element(text);
  tw_text_add(text, "\"");
  tw_text_bytes(text, item->key, item->key_size);
  tw_text_add(text, "\":");
}

static void put_value(tw_text *text, const char *value) {
  tw_text_bytes(text, value, (size_t)(tw_json_skip(value) - value));
}

static void put_member(tw_text *text, const tw_json_item *item) {
  put_key(text, item);
  put_value(text, item->value);
}

static bool says_where(const tw_json_item *item) {
  return tw_json_key_is(item, "buffer") || tw_json_key_is(item, "byteOffset");
}

static tw_status put_view(const bundle *b, const char *object, uint64_t index, tw_text *text);

/* The extensions of a buffer view: those of meshopt name a buffer too. */
static tw_status put_extensions(const bundle *b, const char *object, uint64_t index, tw_text *text) {
  tw_json_item item;
  tw_status status = TW_OK;
  tw_text_add(text, "{");
  for (bool more = tw_json_first(object, &item); more && status == TW_OK;
       more = tw_json_next(tw_json_skip(item.value), &item)) {
    bool is_meshopt =
        tw_json_key_is(&item, "EXT_meshopt_compression") || tw_json_key_is(&item, "KHR_meshopt_compression");
    put_key(text, &item);
    if (is_meshopt)
      status = put_view(b, item.value, index, text);
    else
      put_value(text, item.value);
  }
  tw_text_add(text, "}");
  return status;
}

/* A view, or the extension of one, which say alike where their bytes are. What goes past the end of its file
 * would read the next one. */
static tw_status put_view(const bundle *b, const char *object, uint64_t index, tw_text *text) {
  if (*object != '{') {
    put_value(text, object); /* which the reader refuses */
    return TW_OK;
  }
  const char *number = tw_json_member(object, "buffer"), *begin = tw_json_member(object, "byteOffset");
  uint64_t buffer = UINT64_MAX, offset = 0, length = declared_length(object);
  bool is_read = number && read_count(number, &buffer) && (!begin || read_count(begin, &offset));
  const placed_buffer *placed = is_read && buffer < b->buffer_count ? &b->buffers[buffer] : NULL;
  if (!placed || offset > placed->length || length > placed->length - offset) {
    tw_fail(b->error, TW_INVALID, "the buffer view does not lie within a buffer");
    return tw_error_at(b->error, "/bufferViews/%" PRIu64, index);
  }
  tw_json_item item;
  tw_status status = TW_OK;
  tw_text_add(text, "{");
  tw_member_count(text, "buffer", placed->index);
  tw_member_count(text, "byteOffset", placed->offset + offset);
  for (bool more = tw_json_first(object, &item); more && status == TW_OK;
       more = tw_json_next(tw_json_skip(item.value), &item)) {
    if (says_where(&item)) continue;
    put_key(text, &item);
    if (tw_json_key_is(&item, "extensions") && *item.value == '{')
      status = put_extensions(b, item.value, index, text);
    else
      put_value(text, item.value);
  }
  tw_text_add(text, "}");
  return status;
}

/* The elements of an array by `put`. */
static tw_status put_each(const bundle *b, const char *array,
                          tw_status (*put)(const bundle *b, const char *value, uint64_t index, tw_text *text),
                          tw_text *text) {
  tw_json_item item;
  tw_status status = TW_OK;
  uint64_t index = 0;
  for (bool more = array && tw_json_first(array, &item); more && status == TW_OK;
       more = tw_json_next(tw_json_skip(item.value), &item)) {
    tw_text_element(text);
    status = put(b, item.value, index++, text);
  }
  return status;
}

/* Views of images that came as files. */
static void put_added_views(const bundle *b, tw_text *text) {
  for (uint32_t i = 0; i < b->added_count; i++) {
    uint32_t file = b->added_views[i];
    tw_text_element(text);
    tw_text_add(text, "{");
    tw_member_count(text, "buffer", 0);
    tw_member_count(text, "byteOffset", b->offsets[file]);
    tw_member_count(text, "byteLength", b->files[file].size);
    tw_text_add(text, "}");
  }
}

/* The buffer that all files become. Where there was one, it keeps its name, extras and extensions. */
static void put_buffers(const bundle *b, const char *array, tw_text *text) {
  tw_json_item item;
  tw_text_add(text, "[{");
  tw_member_count(text, "byteLength", b->bin_size);
  for (bool more = b->merged_count == 1 && tw_json_first(b->merged, &item); more;
       more = tw_json_next(tw_json_skip(item.value), &item))
    if (!tw_json_key_is(&item, "byteLength") && !tw_json_key_is(&item, "uri")) put_member(text, &item);
  tw_text_add(text, "}");
  uint64_t index = 0;
  for (bool more = array && tw_json_first(array, &item); more;
       more = tw_json_next(tw_json_skip(item.value), &item)) {
    if (b->buffers[index++].index == 0) continue;
    tw_text_element(text);
    put_value(text, item.value);
  }
  tw_text_add(text, "]");
}

/* The type that the bytes show; NULL for another one, which the reader judges. */
static const char *image_type(const tw_named_file *file) {
  static const struct {
    const char *type, *magic;
    size_t size;
  } known[] = {{"image/png", "\x89PNG\r\n\x1A\n", 8},
               {"image/jpeg", "\xFF\xD8\xFF", 3},
               {"image/ktx2", "\xABKTX 20\xBB\r\n\x1A\n", 12},
               {"image/vnd-ms.dds", "DDS ", 4}};
  for (size_t i = 0; i < sizeof known / sizeof *known; i++)
    if (file->size >= known[i].size && memcmp(file->bytes, known[i].magic, known[i].size) == 0)
      return known[i].type;
  bool is_webp =
      file->size >= 12 && memcmp(file->bytes, "RIFF", 4) == 0 && memcmp(file->bytes + 8, "WEBP", 4) == 0;
  bool is_avif = file->size >= 12 && memcmp(file->bytes + 4, "ftypavif", 8) == 0;
  return is_webp ? "image/webp" : is_avif ? "image/avif" : NULL;
}

static tw_status put_image(const bundle *b, const char *object, uint64_t index, tw_text *text) {
  char *uri;
  uint32_t file = 0;
  tw_status status = read_uri(b, object, &uri);
  if (status != TW_OK) return status;
  bool is_file = uri && !starts_with(uri, "http://") && !starts_with(uri, "https://");
  if (!is_file) {
    put_value(text, object);
    return TW_OK;
  }
  find_file(b, uri, &file); /* place_image found it */
  bool has_type = false;
  tw_json_item item;
  tw_text_add(text, "{");
  for (bool more = tw_json_first(object, &item); more; more = tw_json_next(tw_json_skip(item.value), &item)) {
    has_type |= tw_json_key_is(&item, "mimeType");
    if (!tw_json_key_is(&item, "uri")) put_member(text, &item);
  }
  const char *type = image_type(&b->files[file]);
  if (!has_type && !type) {
    tw_fail(b->error, TW_UNSUPPORTED, "the file is neither PNG, JPEG, WebP, KTX2, AVIF nor DDS");
    return tw_error_at(b->error, "/images/%" PRIu64 "/uri", index);
  }
  if (!has_type) tw_member_string(text, "mimeType", type);
  tw_member_count(text, "bufferView", b->image_views[file]);
  tw_text_add(text, "}");
  return TW_OK;
}

static tw_status put_document(const bundle *b, const char *root, const document_parts *parts, tw_text *text) {
  tw_json_item item;
  tw_text_add(text, "{");
  for (bool more = tw_json_first(root, &item); more; more = tw_json_next(tw_json_skip(item.value), &item))
    if (item.value != parts->buffers && item.value != parts->views && item.value != parts->images)
      put_member(text, &item);
  tw_text_member(text, "buffers");
  put_buffers(b, parts->buffers, text);
  tw_member_open(text, "bufferViews", "[");
  tw_status status = put_each(b, parts->views, put_view, text);
  put_added_views(b, text);
  tw_text_add(text, "]");
  if (status == TW_OK && parts->images) {
    tw_member_open(text, "images", "[");
    status = put_each(b, parts->images, put_image, text);
    tw_text_add(text, "]");
  }
  tw_text_add(text, "}");
  return status;
}

static uint8_t *put_u32(uint8_t *out, uint64_t value) {
  for (int i = 0; i < 4; i++) *out++ = (uint8_t)(value >> 8 * i);
  return out;
}

/* Header, JSON chunk padded with blanks, BIN chunk padded with zeros. */
static tw_status make_glb(const bundle *b, const tw_text *text, uint64_t max_size, uint8_t **out,
                          size_t *out_size) {
  uint64_t json_size = ((uint64_t)text->size + 3) / 4 * 4, size = 28 + json_size + b->bin_size;
  if (size > max_size || size > UINT32_MAX)
    return tw_fail(b->error, TW_LIMIT, "together the files would have %" PRIu64 " bytes, over the limit",
                   size);
  uint8_t *glb = tw_alloc_zero((size_t)size, 1), *end = glb;
  if (!glb) return no_memory(b->error);
  memcpy(end, "glTF", 4);
  end = put_u32(put_u32(end + 4, 2), size);
  end = put_u32(end, json_size);
  memcpy(end, "JSON", 4);
  memset(end + 4, ' ', (size_t)json_size);
  memcpy(end + 4, text->data, text->size);
  end = put_u32(end + 4 + json_size, b->bin_size);
  memcpy(end, "BIN", 4); /* and its terminator */
  end += 4;
  for (uint32_t i = 0; i < b->file_count; i++)
    if (b->offsets[i] != UINT64_MAX && b->files[i].size > 0)
      memcpy(end + b->offsets[i], b->files[i].bytes, b->files[i].size);
  *out = glb;
  *out_size = (size_t)size;
  return TW_OK;
}

/* ---- the whole ----------------------------------------------------------------------------------------- */

static const char *find_array(const char *root, const char *name) {
  const char *value = tw_json_member(root, name);
  return value && *value == '[' ? value : NULL;
}

static tw_status allocate(bundle *b, const document_parts *parts) {
  b->buffer_count = parts->buffers ? tw_json_count(parts->buffers) : 0;
  b->view_count = parts->views ? tw_json_count(parts->views) : 0;
  b->buffers = tw_arena_alloc(b->arena, (size_t)b->buffer_count, sizeof *b->buffers);
  b->offsets = tw_arena_alloc(b->arena, b->file_count, sizeof *b->offsets);
  b->image_views = tw_arena_alloc(b->arena, b->file_count, sizeof *b->image_views);
  b->added_views = tw_arena_alloc(b->arena, b->file_count, sizeof *b->added_views);
  if (!b->buffers || !b->offsets || !b->image_views || !b->added_views) return no_memory(b->error);
  for (uint32_t i = 0; i < b->file_count; i++) {
    b->offsets[i] = UINT64_MAX;
    b->image_views[i] = TW_NO_INDEX;
  }
  return sort_names(b);
}

static tw_status join(bundle *b, const char *root, uint64_t max_size, uint8_t **out, size_t *out_size) {
  const document_parts parts = {.buffers = find_array(root, "buffers"),
                                .views = find_array(root, "bufferViews"),
                                .images = find_array(root, "images")};
  tw_status status = allocate(b, &parts);
  if (status == TW_OK) status = place_all(b, parts.buffers, place_buffer);
  if (status == TW_OK) status = place_all(b, parts.images, place_image);
  if (status != TW_OK || b->bin_size == 0) return status;
  number_buffers(b);
  tw_text text = {0};
  status = put_document(b, root, &parts, &text);
  if (status == TW_OK && text.failed) status = no_memory(b->error);
  if (status == TW_OK) status = make_glb(b, &text, max_size, out, out_size);
  tw_text_deinit(&text);
  return status;
}

tw_status tw_gltf_bundle(const uint8_t *bytes, size_t size, tw_named_file *files, uint32_t file_count,
                         uint64_t json_values, uint64_t max_size, uint8_t **out, size_t *out_size,
                         tw_error *error) {
  const tw_json_rules rules = {.values_max = json_values};
  *out = NULL;
  tw_status status = tw_json_check((const char *)bytes, size, &rules, error);
  const char *root = status == TW_OK ? tw_json_root((const char *)bytes, size) : NULL;
  if (status != TW_OK || *root != '{') return status;
  bundle b = {.arena = tw_arena_create(), .files = files, .file_count = file_count, .error = error};
  status = b.arena ? join(&b, root, max_size, out, out_size) : no_memory(error);
  tw_arena_destroy(b.arena);
  return status;
}
