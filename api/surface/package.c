/* Open Packaging Conventions (ECMA-376 part 2): content types, a relationship to the model part, and that
 * part. The zip (APPNOTE 6.3) stores the first two and deflates the third, whose sizes are known only when it
 * is packed, so that they stand in a data descriptor behind it. What could come to 4 GiB is refused: it would
 * need zip64. The same model gives the same bytes, so there is no time in it. */
#include "package.h"

#include "tweend/json_print.h"

#include <string.h>
#include <zlib.h>

enum {
  PIECE = 64 << 10, /* of the model part */
  TURN = 256 << 10, /* of the model part, packed at most by one read, as an I/O thread waits for it */
  LEVEL = 1,
  ENTRIES = 3,
  MODEL = 2, /* the entry of the model part */
  STORED = 0,
  DEFLATED = 8,
  VERSION = 20,
  SIZES_FOLLOW = 8, /* flag: sizes stand in a descriptor behind the entry */
  IS_UTF8 = 1 << 11,
  DATE = 1 << 5 | 1 /* 1980-01-01 */
};

typedef struct entry {
  const char *name, *text; /* text NULL: the model part */
  uint32_t offset, checksum, packed, size;
} entry;

static const entry parts[ENTRIES] = {
    {"[Content_Types].xml",
     "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
     "<Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">"
     "<Default Extension=\"rels\" ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>"
     "<Default Extension=\"model\" ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/>"
     "</Types>\n",
     0, 0, 0, 0},
    {"_rels/.rels",
     "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
     "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">"
     "<Relationship Target=\"/3D/3dmodel.model\" Id=\"rel0\" "
     "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>\n",
     0, 0, 0, 0},
    {"3D/3dmodel.model", NULL, 0, 0, 0, 0}};

struct api_package {
  tw_3mf_stream *model;
  z_stream deflate;
  bool can_deflate, has_all_input, is_packed, is_done;
  entry entries[ENTRIES];
  uint32_t offset; /* of the next byte of the package */
  /* Bytes that are not yet read: those of heads, or none. */
  tw_text pending;
  size_t pending_taken;
  uint8_t piece[PIECE];
};

/* ---- memory ---------------------------------------------------------------------------------- */

static voidpf take(voidpf context, uInt count, uInt size) {
  (void)context;
  return tw_alloc(count, size);
}

static void give_back(voidpf context, voidpf memory) {
  (void)context;
  tw_free(memory);
}

/* ---- heads ----------------------------------------------------------------------------------- */

static void put_u16(tw_text *text, uint32_t value) {
  uint8_t bytes[4];
  tw_put_u32(bytes, value);
  tw_text_bytes(text, (const char *)bytes, 2);
}

static void put_u32(tw_text *text, uint32_t value) {
  uint8_t bytes[4];
  tw_put_u32(bytes, value);
  tw_text_bytes(text, (const char *)bytes, sizeof bytes);
}

/* Puts the fields that the local header of an entry and its header in the central directory share. */
static void put_facts(tw_text *text, const entry *e, bool knows_sizes) {
  put_u16(text, VERSION);
  put_u16(text, e->text ? IS_UTF8 : IS_UTF8 | SIZES_FOLLOW);
  put_u16(text, e->text ? STORED : DEFLATED);
  put_u16(text, 0); /* midnight */
  put_u16(text, DATE);
  put_u32(text, knows_sizes ? e->checksum : 0);
  put_u32(text, knows_sizes ? e->packed : 0);
  put_u32(text, knows_sizes ? e->size : 0);
  put_u16(text, (uint32_t)strlen(e->name));
  put_u16(text, 0); /* no extra field */
}

/* The two stored parts, and the head of the model part. */
static void put_begin(api_package *package) {
  tw_text *text = &package->pending;
  for (int i = 0; i < ENTRIES; i++) {
    entry *e = &package->entries[i];
    e->offset = (uint32_t)text->size;
    if (e->text) {
      e->packed = e->size = (uint32_t)strlen(e->text);
      e->checksum = (uint32_t)crc32(crc32(0, NULL, 0), (const Bytef *)e->text, e->size);
    }
    put_u32(text, 0x04034B50);
    put_facts(text, e, e->text);
    tw_text_add(text, e->name);
    if (e->text) tw_text_add(text, e->text);
  }
}

/* The descriptor of the model part, the central directory and its end. */
static void put_end(api_package *package) {
  tw_text *text = &package->pending;
  const entry *model = &package->entries[MODEL];
  tw_text_clear(text);
  package->pending_taken = 0;
  put_u32(text, 0x08074B50);
  put_u32(text, model->checksum);
  put_u32(text, model->packed);
  put_u32(text, model->size);
  uint32_t directory = package->offset + (uint32_t)text->size, begin = (uint32_t)text->size;
  for (int i = 0; i < ENTRIES; i++) {
    const entry *e = &package->entries[i];
    put_u32(text, 0x02014B50);
    put_u16(text, VERSION); /* made by */
    put_facts(text, e, true);
    put_u16(text, 0); /* no comment */
    put_u16(text, 0); /* disk */
    put_u16(text, 0); /* internal attributes */
    put_u32(text, 0); /* external attributes */
    put_u32(text, e->offset);
    tw_text_add(text, e->name);
  }
  uint32_t size = (uint32_t)text->size - begin;
  put_u32(text, 0x06054B50);
  put_u16(text, 0);
  put_u16(text, 0);
  put_u16(text, ENTRIES);
  put_u16(text, ENTRIES);
  put_u32(text, size);
  put_u32(text, directory);
  put_u16(text, 0); /* no comment */
}

/* ---- package --------------------------------------------------------------------------------- */

static tw_status start(api_package *package, const tw_scene *scene, const tw_3mf_options *options,
                       tw_error *error) {
  enum { WINDOW_BITS = -MAX_WBITS, MEMORY_LEVEL = 8 }; /* raw: zip has heads of its own */
  tw_status status = tw_3mf_stream_create(scene, options, &package->model, error);
  if (status != TW_OK) return status;
  uint64_t bound = api_package_bound(package);
  if (bound > UINT32_MAX)
    return tw_fail(error, TW_LIMIT, "a 3MF holds less than 4 GiB: this one could have %llu bytes",
                   (unsigned long long)bound);
  package->deflate.zalloc = take;
  package->deflate.zfree = give_back;
  memcpy(package->entries, parts, sizeof parts);
  package->entries[MODEL].checksum = (uint32_t)crc32(0, NULL, 0);
  package->can_deflate = deflateInit2(&package->deflate, LEVEL, Z_DEFLATED, WINDOW_BITS, MEMORY_LEVEL,
                                      Z_DEFAULT_STRATEGY) == Z_OK;
  put_begin(package);
  if (package->can_deflate && !package->pending.failed) return TW_OK;
  return tw_fail(error, TW_NO_MEMORY, "no memory for a 3MF package");
}

tw_status api_package_create(const tw_scene *scene, const tw_3mf_options *options, api_package **out,
                             tw_error *error) {
  api_package *package = tw_alloc_zero(1, sizeof *package);
  if (!package) return tw_fail(error, TW_NO_MEMORY, "no memory for a 3MF package");
  tw_status status = start(package, scene, options, error);
  if (status == TW_OK)
    *out = package;
  else
    api_package_destroy(package);
  return status;
}

/* What deflate cannot pack takes 5 bytes more for each 16 KiB (zlib's deflateBound at this memory level). */
uint64_t api_package_bound(const api_package *package) {
  enum { HEADS = 4096 };
  uint64_t model = tw_3mf_stream_bound(package->model);
  return model + model / 1024 + HEADS;
}

void api_package_destroy(api_package *package) {
  if (!package) return;
  if (package->can_deflate) deflateEnd(&package->deflate);
  tw_3mf_stream_destroy(package->model);
  tw_text_deinit(&package->pending);
  tw_free(package);
}

bool api_package_origin(const api_package *package, double origin[3]) {
  return tw_3mf_stream_origin(package->model, origin);
}

/* Gives the next piece of the model part to the packer. */
static bool fill_piece(api_package *package) {
  entry *model = &package->entries[MODEL];
  int64_t size = tw_3mf_stream_read(package->model, package->piece, PIECE);
  if (size < 0) return false;
  package->has_all_input = size < PIECE;
  package->deflate.next_in = package->piece;
  package->deflate.avail_in = (uInt)size;
  model->checksum = (uint32_t)crc32(model->checksum, package->piece, (uInt)size);
  model->size += (uint32_t)size;
  return true;
}

/* Packs until there is output, and no longer than a turn. Returns the bytes written, or -1. */
static int64_t pack(api_package *package, uint8_t *out, size_t capacity) {
  z_stream *z = &package->deflate;
  enum { OUTPUT_MAX = 1 << 30 };
  uInt room = capacity < OUTPUT_MAX ? (uInt)capacity : OUTPUT_MAX;
  size_t taken = 0;
  z->next_out = out;
  z->avail_out = room;
  while (z->avail_out > 0 && !package->is_packed && (taken < TURN || z->avail_out == room)) {
    if (z->avail_in == 0 && !package->has_all_input) {
      if (!fill_piece(package)) return -1;
      taken += z->avail_in;
    }
    package->is_packed = deflate(z, package->has_all_input ? Z_FINISH : Z_NO_FLUSH) == Z_STREAM_END;
  }
  size_t written = room - z->avail_out;
  package->entries[MODEL].packed += (uint32_t)written;
  return (int64_t)written;
}

static int64_t take_pending(api_package *package, uint8_t *out, size_t capacity) {
  size_t left = package->pending.size - package->pending_taken, size = left < capacity ? left : capacity;
  memcpy(out, package->pending.data + package->pending_taken, size);
  package->pending_taken += size;
  return (int64_t)size;
}

int64_t api_package_read(api_package *package, uint8_t *out, size_t capacity) {
  int64_t count = 0;
  if (capacity == 0) return 0;
  if (package->pending_taken < package->pending.size)
    count = take_pending(package, out, capacity);
  else if (!package->is_packed)
    count = pack(package, out, capacity);
  if (count == 0 && package->is_packed && !package->is_done) {
    package->is_done = true;
    put_end(package);
    if (package->pending.failed) return -1;
    count = take_pending(package, out, capacity);
  }
  if (count > 0) package->offset += (uint32_t)count;
  return count;
}
