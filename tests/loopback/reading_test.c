/* What reading a body holds at most, and how long it takes, for ordinary documents and for hostile ones: at
 * most 64 MiB and six times the decoded bytes, themselves included, and 2 s. Every allocation of the program
 * is counted, those of libraries too: malloc and its kin are defined here, before glibc's. */
#include "glb.h"
#include "loopback.h"

#include <malloc.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <zlib.h>
#include <zstd.h>

#include "codings.h"
#include "tweend/base.h"
#include "upload.h"

#if defined(__has_feature)
#define HAS_FEATURE(name) __has_feature(name)
#else
#define HAS_FEATURE(name) 0
#endif
/* The sanitizers count allocations themselves, and slow everything down: there documents are smaller, and
 * only read. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || HAS_FEATURE(address_sanitizer) ||       \
    HAS_FEATURE(thread_sanitizer)
#define MEASURES 0
enum { MEGABYTE = 1 << 15 };
#else
#define MEASURES 1
enum { MEGABYTE = 1 << 20 };
#endif

/* ---- counting -------------------------------------------------------------------------------- */

static size_t held, peak; /* bytes */

#if MEASURES
/* NOLINTBEGIN(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp): glibc's names */
void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *old, size_t size);
void __libc_free(void *memory);
/* NOLINTEND(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */

static void *note(void *memory) {
  if (memory) held += malloc_usable_size(memory) + sizeof(size_t);
  if (held > peak) peak = held;
  return memory;
}

static void forget(void *memory) {
  if (memory) held -= malloc_usable_size(memory) + sizeof(size_t);
}

void *malloc(size_t size) {
  return note(__libc_malloc(size));
}

void *calloc(size_t count, size_t size) {
  return note(__libc_calloc(count, size));
}

/* A block that glibc mapped by itself moves by its pages, which never stand twice; any other that moves
 * stands in both places for a moment. */
void *realloc(void *old, size_t size) {
  size_t before = old ? malloc_usable_size(old) + sizeof(size_t) : 0;
  bool is_mapped = old && (((const size_t *)old)[-1] & 2);
  void *memory = __libc_realloc(old, size);
  if (!memory) return NULL;
  if (is_mapped || memory == old) held -= before;
  note(memory);
  if (!is_mapped && memory != old) held -= before;
  return memory;
}

void free(void *memory) {
  forget(memory);
  __libc_free(memory);
}
#endif

/* ---- documents ------------------------------------------------------------------------------- */

/* Text that stands once, or as often as it takes to fill its part of the document. %u is the number of the
 * repetition, from 0, or of the elements in the BIN chunk where it stands once; %p is one more, %u*7 seven
 * times as many. */
typedef struct piece {
  const char *text;
  double share;
} piece;

typedef enum verdict { READ, REFUSED, EITHER } verdict;

enum { PIECES = 8 };
/* A BIN chunk of as many elements as there is room for. */
typedef struct chunk {
  size_t (*write)(uint8_t *out, size_t elements); /* returns bytes written */
  size_t element_size;
} chunk;

typedef struct document {
  const char *name;
  verdict expected;
  uint32_t megabytes;
  const chunk *bin; /* a GLB: the pieces are its JSON, the chunk is the rest of the megabytes */
  piece pieces[PIECES];
} document;

typedef struct text {
  char *bytes;
  size_t size, capacity;
} text;

static void make_room(text *out, size_t size) {
  size_t wanted = out->size + size;
  if (wanted <= out->capacity) return;
  out->capacity = wanted < 2 * out->capacity ? 2 * out->capacity : wanted;
  out->bytes = realloc(out->bytes, out->capacity);
  assert_non_null(out->bytes);
}

static void add(text *out, const char *bytes, size_t size) {
  make_room(out, size);
  memcpy(out->bytes + out->size, bytes, size);
  out->size += size;
}

/* Adds the same bytes again and again, until at least `least` are added. */
static void add_repeatedly(text *out, const char *bytes, size_t size, size_t least) {
  size_t total = (least + size - 1) / size * size;
  make_room(out, total + size);
  char *begin = out->bytes + out->size;
  memcpy(begin, bytes, size);
  for (size_t done = size; done < total; done *= 2)
    memcpy(begin + done, begin, done < total - done ? done : total - done);
  out->size += total;
}

static void add_with_number(text *out, const char *pattern, size_t number) {
  for (const char *at = pattern; *at;) {
    size_t plain = strcspn(at, "%");
    add(out, at, plain);
    at += plain;
    if (!*at) break;
    char digits[24], *end = (char *)at + 2;
    size_t factor = *end == '*' ? strtoul(end + 1, &end, 10) : 1;
    int length = snprintf(digits, sizeof digits, "%zu", factor * number + (at[1] == 'p'));
    add(out, digits, (size_t)length);
    at = end;
  }
}

static text build_glb(text *json, const chunk *bin, size_t elements) {
  uint8_t *bytes = malloc(elements * bin->element_size + 4096);
  assert_non_null(bytes);
  add(json, "", 1);
  glb_file file = glb_build(json->bytes, bytes, bin->write(bytes, elements));
  free(bytes);
  free(json->bytes);
  return (text){(char *)file.bytes, file.size, file.size};
}

/* The document in about `size` bytes. */
static text build(const document *d, size_t size) {
  text out = {0};
  double rest = (double)size;
  for (size_t i = 0; i < PIECES && d->pieces[i].text; i++) rest -= (double)size * d->pieces[i].share;
  size_t elements = d->bin ? (size_t)rest / d->bin->element_size / 12 * 12 : 0;
  for (size_t i = 0; i < PIECES && d->pieces[i].text; i++) {
    const piece *p = &d->pieces[i];
    if (p->share == 0) {
      add_with_number(&out, p->text, elements);
      continue;
    }
    size_t end = out.size + (size_t)((double)size * p->share), length = strlen(p->text);
    bool is_numbered = strchr(p->text, '%') != NULL;
    if (!is_numbered) add_repeatedly(&out, p->text, length, end - out.size);
    for (size_t number = 0; out.size < end; number++) add_with_number(&out, p->text, number);
  }
  quote_bytes(out.bytes, out.size);
  return d->bin ? build_glb(&out, d->bin, elements) : out;
}

#define ASSET "'asset':{'version':'2.0'}"

/* ---- reading --------------------------------------------------------------------------------- */

/* Of this process's work: other processes may be at work too. */
static double seconds(void) {
  struct timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

typedef struct outcome {
  int status; /* 200, or that of the problem */
  tw_format format;
  size_t peak;
  double seconds;
  tw_error error;
  size_t model_size, model_held;
} outcome;

static const api_making making = {.faces_max = 1000, .bytes_max = 1 << 24};

/* What the upload of a document holds, with `size` bytes of it held already. */
static outcome read_document(api_bytes bytes, api_upload_type type) {
  api_fault fault = {0};
  tw_model *model = NULL;
  size_t before = held;
  peak = held;
  double start = seconds();
  tw_format format = type == API_TYPE_OBJ ? TW_FORMAT_OBJ : tw_format_sniff(bytes.data, bytes.size);
  bool is_read =
      api_model_read(bytes, format, (api_reading){.quads = TW_QUADS_AUTO}, &making, &model, &fault);
  outcome out = {.status = is_read ? 200 : fault.status,
                 .format = format,
                 .peak = peak - before + bytes.size,
                 .seconds = seconds() - start,
                 .error = fault.error};
  out.model_held = held - before;
  if (is_read) out.model_size = tw_model_size(model);
  tw_model_destroy(model);
  return out;
}

/* The bytes again, coded, then decoded and read. */
static outcome read_coded(api_coding coding, const text *t, api_upload_type type) {
  size_t room = t->size + t->size / 100 + (1 << 16), size = 0, before;
  uint8_t *coded = malloc(room), *decoded = NULL;
  assert_non_null(coded);
  if (coding == API_CODING_ZSTD) {
    size = ZSTD_compress(coded, room, t->bytes, t->size, 1);
    assert_false(ZSTD_isError(size));
  } else {
    z_stream stream = {.next_in = (Bytef *)t->bytes, .avail_in = (uInt)t->size, .next_out = coded};
    stream.avail_out = (uInt)room;
    assert_int_equal(deflateInit2(&stream, 1, Z_DEFLATED, MAX_WBITS + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
    assert_int_equal(deflate(&stream, Z_FINISH), Z_STREAM_END);
    size = stream.total_out;
    deflateEnd(&stream);
  }
  before = held;
  peak = held;
  double start = seconds();
  tw_error error;
  api_bytes body = {coded, size};
  assert_int_equal(api_decode(coding, body, UINT32_MAX, &decoded, &size, &error), TW_OK);
  assert_int_equal(size, t->size);
  size_t peak_of_decoding = peak - before;
  double taken = seconds() - start;
  outcome out = read_document((api_bytes){decoded, size}, type);
  if (peak_of_decoding > out.peak) out.peak = peak_of_decoding;
  out.seconds += taken;
  free(decoded);
  free(coded);
  return out;
}

/* ---- BIN chunks ------------------------------------------------------------------------------ */

static size_t put_floats(uint8_t *out, size_t at, const float *values, size_t count) {
  memcpy(out + at, values, count * sizeof *values);
  return at + count * sizeof *values;
}

/* A point of a square grid. */
enum { GRID = 1024 };
static void grid_point(size_t i, float out[3]) {
  out[0] = (float)(i % GRID);
  out[1] = (float)(i / GRID); /* NOLINT(bugprone-integer-division) */
  out[2] = (float)(i % 7) * 0.1f;
}

/* Vertices of triangles one after the other, two in each square of a grid: no two share a vertex. */
static size_t write_triangle_soup(uint8_t *out, size_t vertices) {
  static const size_t corners[6] = {0, 1, GRID + 1, 0, GRID + 1, GRID};
  size_t at = 0;
  for (size_t i = 0; i < vertices; i++) {
    float point[3];
    size_t square = i / 6;
    grid_point(square / (GRID - 1) * GRID + square % (GRID - 1) + corners[i % 6], point);
    at = put_floats(out, at, point, 3);
  }
  return at;
}
static const chunk triangle_soup = {write_triangle_soup, 12};

/* The points of a grid, then six 32-bit indices for each. */
static size_t write_indexed_grid(uint8_t *out, size_t vertices) {
  static const size_t corners[6] = {0, 1, GRID + 1, 0, GRID + 1, GRID};
  size_t at = 0;
  for (size_t i = 0; i < vertices; i++) {
    float point[3];
    grid_point(i, point);
    at = put_floats(out, at, point, 3);
  }
  for (size_t i = 0; i < 6 * vertices; i++, at += 4)
    glb_put_u32(out + at, (uint32_t)((i / 6 + corners[i % 6]) % vertices));
  return at;
}
static const chunk indexed_grid = {write_indexed_grid, 36};

/* 8-bit indices, whose bytes serve as coordinates of 256 points too. */
static size_t write_small_indices(uint8_t *out, size_t count) {
  for (size_t i = 0; i < count; i++) out[i] = (uint8_t)(i * 7 / 3 + i % 3 + i / 768);
  return count;
}
static const chunk small_indices = {write_small_indices, 1};

/* Key times, then as many quaternions of normalised 16-bit integers. */
static size_t write_short_keys(uint8_t *out, size_t keys) {
  size_t at = 0;
  for (size_t i = 0; i < keys; i++) at = put_floats(out, at, (float[]){(float)i}, 1);
  for (size_t i = 0; i < keys; i++, at += 8) {
    memset(out + at, 0, 8);
    out[at + 2 * (i % 4)] = 0xFF;
    out[at + 2 * (i % 4) + 1] = 0x7F;
  }
  return at;
}
static const chunk short_keys = {write_short_keys, 12};

static size_t write_ascending(uint8_t *out, size_t count) {
  for (size_t i = 0; i < count; i++) glb_put_u32(out + 4 * i, (uint32_t)i);
  return 4 * count;
}
static const chunk ascending = {write_ascending, 4};

static size_t write_zeros(uint8_t *out, size_t count) {
  memset(out, 0, count);
  return count;
}
static const chunk zeros = {write_zeros, 1};

/* ---- tweend JSON ----------------------------------------------------------------------------- */

#define MESH   "{'meshes':[{"
#define TRACK  "{'nodes':[{'name':'a'}],'clips':[{'tracks':[{'node':'a','path':'rotation',"
#define POINTS "'positions':[[0,0,0],[1,0,0],[0,1,0]],'faces':[[0,1,2]]"

static const document tweend_documents[] = {
    {"empty meshes", REFUSED, 15, .pieces = {{"{'meshes':[", 0}, {"{},", 1}, {"{}]}", 0}}},
    {"empty nodes", REFUSED, 9, .pieces = {{"{'nodes':[", 0}, {"{},", 1}, {"{}]}", 0}}},
    {"empty clips", REFUSED, 3, .pieces = {{"{'clips':[", 0}, {"{},", 1}, {"{}]}", 0}}},
    {"empty tracks", REFUSED, 3, .pieces = {{"{'clips':[{'tracks':[", 0}, {"{},", 1}, {"{}]}]}", 0}}},
    {"nodes as many as there may be", READ, 1,
     .pieces = {{"{'meshes':[", 0}, {"{},", 0.18}, {"{}],'nodes':[", 0}, {"{},", 0.74}, {"{}]}", 0}}},
    {"named nodes", READ, 7,
     .pieces = {{"{'nodes':[{'name':'x'}", 0}, {",{'name':'n%u','parent':'x'}", 1}, {"]}", 0}}},
    {"a chain of parents", READ, 8,
     .pieces = {{"{'nodes':[{'name':'n0'}", 0}, {",{'name':'n%p','parent':'n%u'}", 1}, {"]}", 0}}},
    {"nodes of one name", READ, 3, .pieces = {{"{'nodes':[", 0}, {"{'name':'same'},", 1}, {"{}]}", 0}}},
    {"positions and faces", READ, 18,
     .pieces = {{MESH "'positions':[", 0},
                {"[0,0,0],", 0.5},
                {"[0,0,0]],'faces':[", 0},
                {"[0,1,2],", 0.5},
                {"[0,1,2]]}]}", 0}}},
    {"uvs", READ, 16,
     .pieces = {{MESH "'positions':[[0,0,0],[1,0,0],[0,1,0]],'faces':[", 0},
                {"[0,1,2],", 0.4},
                {"[0,1,2]],'uvs':[", 0},
                {"[0,0],", 0.2},
                {"[0,0]],'face_uvs':[", 0},
                {"[0,1,2],", 0.4},
                {"[0,1,2]]}]}", 0}}},
    {"empty faces", REFUSED, 16, .pieces = {{MESH "'faces':[", 0}, {"[],", 1}, {"[]]}]}", 0}}},
    {"faces that are numbers", REFUSED, 16, .pieces = {{MESH "'faces':[", 0}, {"0,", 1}, {"0]}]}", 0}}},
    {"creases", READ, 16,
     .pieces = {{MESH POINTS ",'creases':[", 0},
                {"{'edge':[0,1],'sharpness':1},", 1},
                {"{'edge':[0,1],'sharpness':1}]}]}", 0}}},
    {"corners", READ, 16,
     .pieces = {{MESH POINTS ",'corners':[", 0},
                {"{'vertex':0,'sharpness':1},", 1},
                {"{'vertex':0,'sharpness':1}]}]}", 0}}},
    {"holes", READ, 16, .pieces = {{MESH POINTS ",'holes':[", 0}, {"0,", 1}, {"0]}]}", 0}}},
    {"meshes with colours", EITHER, 16,
     .pieces = {{"{'meshes':[", 0}, {"{'color':[0,0,1]},", 1}, {"{}]}", 0}}},
    {"a squad track", EITHER, 24,
     .pieces = {{TRACK "'interpolation':'squad','times':[0", 0},
                {",%p", 0.42},
                {"],'quaternions':[[0,0,0,1]", 0},
                {",[0,0,0,1]", 0.58},
                {"]}]}]}", 0}}},
    {"a name of all but everything", REFUSED, 24,
     .pieces = {{"{'nodes':[{'name':'", 0}, {"0123456789", 1}, {"'}]}", 0}}},
    {"a name of escapes", REFUSED, 24, .pieces = {{"{'nodes':[{'name':'", 0}, {"\\u0041", 1}, {"'}]}", 0}}},
    {"blanks", READ, 64, .pieces = {{"{", 0}, {" ", 1}, {"}", 0}}},
    {"unknown members", REFUSED, 16, .pieces = {{"{'a':0", 0}, {",'a':0", 1}, {"}", 0}}},
    {"members of a node", REFUSED, 16, .pieces = {{"{'nodes':[{'name':0", 0}, {",'m%u':0", 1}, {"}]}", 0}}},
    {"a name that is an array", REFUSED, 8, .pieces = {{"{'nodes':[{'name':[0", 0}, {",0", 1}, {"]}]}", 0}}},
    {"a name of nested objects", REFUSED, 8,
     .pieces = {{"{'nodes':[{'name':{'a':0", 0}, {",'a':{'b':{}}", 1}, {"}}]}", 0}}},
    {"brackets", REFUSED, 16, .pieces = {{"{'nodes':", 0}, {"[", 1}}},
    {"arrays in arrays", REFUSED, 16, .pieces = {{"{'nodes':[", 0}, {"[[[[]]]],", 1}, {"0]}", 0}}},
    {"clips of a track", EITHER, 8,
     .pieces = {{"{'nodes':[{'name':'a'}", 0},
                {",{}", 0.08},
                {"],'clips':[{}", 0},
                {",{'tracks':[{'node':'a','path':'scale','times':[0],'values':[[1,1,1]]}]}", 0.9},
                {"]}", 0}}},
    {"tracks on one node", REFUSED, 8,
     .pieces = {{"{'nodes':[{'name':'a'}],'clips':[{'tracks':[{'node':'a','path':'scale','times':[0],"
                 "'values':[[1,1,1]]}",
                 0},
                {",{'node':'a','path':'scale','times':[0],'values':[[1,1,1]]}", 1},
                {"]}]}", 0}}},
};

/* ---- OBJ ------------------------------------------------------------------------------------- */

#define OBJ_POINTS "v 0 0 0\nv 1 0 0\nv 0 1 0\n"

static const document obj_documents[] = {
    {"points and triangles", READ, 8, .pieces = {{"v 0 0 0\n", 0.5}, {"f 1 2 3\n", 0.5}}},
    {"triangles", READ, 8, .pieces = {{OBJ_POINTS, 0}, {"f 1 2 3\n", 1}}},
    {"triangles with texture", READ, 8,
     .pieces = {{OBJ_POINTS "vt 0\nusemtl a\ng b\n", 0}, {"f 1/1 2/1 3/1\n", 1}}},
    {"one triangle with texture", READ, 8,
     .pieces = {{OBJ_POINTS "vt 0\nusemtl a\ng b\nf 1/1 2 3\n", 0}, {"f 1 2 3\n", 1}}},
    {"points", READ, 8, .pieces = {{"v 0 0 0\n", 1}, {"f 1 2 3\n", 0}}},
    {"one point with a colour", READ, 8,
     .pieces = {{"v 0 0 0 1 1 1\n", 0}, {"v 0 0 0\n", 1}, {"f 1 2 3\n", 0}}},
    {"points with colours", READ, 8, .pieces = {{"v 0 0 0 1 1 1\n", 1}, {"f 1 2 3\n", 0}}},
    {"texture coordinates", READ, 8, .pieces = {{OBJ_POINTS, 0}, {"vt 0\n", 1}, {"f 1/1 2/1 3/1\n", 0}}},
    {"objects that share no point", READ, 4, .pieces = {{"o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -3\n", 1}}},
    {"objects that share a point", READ, 8, .pieces = {{OBJ_POINTS, 0}, {"o a\nf 1 2 3\n", 1}}},
    {"two objects, point by point", READ, 8,
     .pieces = {{"v 0 0 0 1 1 1\no a\n", 0},
                {"v 0 0 0\n", 0.5},
                {"f 1 3 5\n", 0.25},
                {"o b\n", 0},
                {"f 2 4 6\n", 0.25}}},
    {"materials", EITHER, 8, .pieces = {{OBJ_POINTS, 0}, {"usemtl m%u\nf 1 2 3\n", 1}}},
    {"one material again and again", READ, 8, .pieces = {{OBJ_POINTS "f 1 2 3\n", 0}, {"usemtl m\n", 1}}},
    {"groups", EITHER, 8, .pieces = {{OBJ_POINTS, 0}, {"g %u\nf 1 2 3\n", 1}}},
    {"groups without faces", EITHER, 8, .pieces = {{OBJ_POINTS "f 1 2 3\n", 0}, {"g %u\n", 1}}},
    {"one group again and again", READ, 8, .pieces = {{OBJ_POINTS "f 1 2 3\n", 0}, {"g a\n", 1}}},
    {"a huge face", READ, 8, .pieces = {{"v 0 0 0\n", 0.5}, {"f", 0}, {" %p", 0.3}, {"\n", 0}}},
    {"a huge face of one point", READ, 8, .pieces = {{OBJ_POINTS "f", 0}, {" 1", 1}}},
    {"huge faces of one point", READ, 8, .pieces = {{OBJ_POINTS "f", 0}, {" 1", 1}}},
    {"creases", READ, 8, .pieces = {{OBJ_POINTS "f 1 2 3\n", 0}, {"t crease 2/1/0 0 1 1\n", 1}}},
    {"a crease of many edges", EITHER, 8,
     .pieces =
         {{OBJ_POINTS "f 1 2 3\nt crease 2796202/1/0", 0}, {" 0 1", 0.667}, {" 1\n#", 0}, {"#", 0.333}}},
    {"holes", READ, 8, .pieces = {{OBJ_POINTS "f 1 2 3\n", 0}, {"t hole 1/0 0\n", 1}}},
    {"unknown tags", READ, 8, .pieces = {{OBJ_POINTS "f 1 2 3\n", 0}, {"t\n", 1}}},
    {"empty lines", READ, 32, .pieces = {{OBJ_POINTS "f 1 2 3\n", 0}, {"\n", 1}}},
    {"lines that go on", READ, 32, .pieces = {{OBJ_POINTS "f 1 2 3 ", 0}, {"\\\n", 1}, {"\n", 0}}},
};

/* ---- STL ------------------------------------------------------------------------------------- */

#define STL_LOOP "solid a\nfacet normal 0 0 1\nouter loop\n"

static const document stl_documents[] = {
    {"a huge facet at two places", READ, 8,
     .pieces = {{STL_LOOP, 0},
                {"vertex 0 0 0\n", 0.5},
                {"vertex 1 0 0\n", 0.5},
                {"endloop\nendfacet\nendsolid a\n", 0}}},
};

/* ---- glTF ------------------------------------------------------------------------------------ */

#define ONE_VIEW "'buffers':[{'byteLength':%u*12}],'bufferViews':[{'buffer':0,'byteLength':%u*12}],"

/* A BIN chunk of zeros: three points, three 32-bit indices, and as many 8-bit ones as there are bytes. */
#define ZEROS_AS_POINTS                                                                                      \
  "'buffers':[{'byteLength':%u}],'bufferViews':[{'buffer':0,'byteLength':%u}],'accessors':["                 \
  "{'bufferView':0,'componentType':5126,'count':3,'type':'VEC3'},"                                           \
  "{'bufferView':0,'componentType':5125,'count':3,'type':'SCALAR'},"                                         \
  "{'bufferView':0,'componentType':5121,'count':%u,'type':'SCALAR'}]"
/* The same as many points, three points, their indices, and the sharpness of all of them. */
#define ZEROS_AS_CAGE                                                                                        \
  "'buffers':[{'byteLength':%u}],'bufferViews':[{'buffer':0,'byteLength':%u}],'accessors':["                 \
  "{'bufferView':0,'componentType':5126,'count':100001,'type':'VEC3'},"                                      \
  "{'bufferView':0,'componentType':5126,'count':3,'type':'VEC3'},"                                           \
  "{'bufferView':0,'componentType':5125,'count':100001,'type':'SCALAR'},"                                    \
  "{'bufferView':0,'componentType':5121,'count':3,'type':'SCALAR'},"                                         \
  "{'bufferView':0,'componentType':5125,'count':3,'type':'SCALAR'},"                                         \
  "{'bufferView':0,'componentType':5126,'count':100001,'type':'SCALAR'}]"

static const document gltf_documents[] = {
    {"materials", REFUSED, 1, .pieces = {{"{" ASSET ",'materials':[", 0}, {"{},", 1}, {"{}]}", 0}}},
    {"many materials", REFUSED, 12, .pieces = {{"{" ASSET ",'materials':[", 0}, {"{},", 1}, {"{}]}", 0}}},
    {"nodes", REFUSED, 12, .pieces = {{"{" ASSET ",'nodes':[", 0}, {"{},", 1}, {"{}]}", 0}}},
    {"some nodes", READ, 1, .pieces = {{"{" ASSET ",'nodes':[", 0}, {"{},", 0.09}, {"{}]}", 0}}},
    {"meshes", REFUSED, 12, .pieces = {{"{" ASSET ",'meshes':[", 0}, {"{},", 1}, {"{}]}", 0}}},
    {"primitives", REFUSED, 12,
     .pieces = {{"{" ASSET ",'meshes':[{'primitives':[", 0}, {"{'attributes':{}},", 1}, {"{}]}]}", 0}}},
    {"targets", REFUSED, 12,
     .pieces = {{"{" ASSET ",'meshes':[{'primitives':[{'attributes':{},'targets':[", 0},
                {"{'A':0},", 1},
                {"{}]}]}]}", 0}}},
    {"attributes", REFUSED, 12,
     .pieces = {{"{" ASSET ",'meshes':[{'primitives':[{'attributes':{'a':0", 0},
                {",'%u':0", 1},
                {"}}]}]}", 0}}},
    {"accessors", REFUSED, 24,
     .pieces = {{"{" ASSET ",'accessors':[", 0},
                {"{'componentType':5126,'count':1,'type':'VEC3'},", 1},
                {"{'componentType':5126,'count':1,'type':'VEC3'}]}", 0}}},
    {"images", REFUSED, 12,
     .pieces = {{"{" ASSET ",'images':[", 0}, {"{'uri':''},", 1}, {"{'uri':''}]}", 0}}},
    {"an image in text", READ, 24,
     .pieces = {{"{" ASSET ",'images':[{'uri':'data:image/png;base64,", 0}, {"AAAA", 1}, {"'}]}", 0}}},
    {"a buffer in text", EITHER, 24,
     .pieces = {{"{" ASSET ",'buffers':[{'byteLength':18874368,'uri':'data:application/octet-stream;base64,",
                 0},
                {"AAAA", 1},
                {"'}]}", 0}}},
    {"channels", REFUSED, 12,
     .pieces = {{"{" ASSET ",'animations':[{'channels':[", 0},
                {"{'sampler':0},", 1},
                {"{}],'samplers':[]}]}", 0}}},
    {"animations", REFUSED, 12, .pieces = {{"{" ASSET ",'animations':[", 0}, {"{},", 1}, {"{}]}", 0}}},
    {"cameras and lights", EITHER, 12,
     .pieces =
         {{"{" ASSET ",'cameras':[", 0},
          {"{'type':'perspective','perspective':{'yfov':1,'znear':1}},", 0.1},
          {"{'type':'perspective','perspective':{'yfov':1,'znear':1}}],'extensions':{'KHR_lights_punctual':{"
           "'lights':[",
           0},
          {"{},", 0.2},
          {"{}]}}}", 0}}},
    {"extras of the document", EITHER, 6,
     .pieces = {{"{" ASSET ",'extras':[", 0}, {"[],{},", 0.3}, {"0,", 0.05}, {"0]}", 0}}},
    {"extras of a material", REFUSED, 6,
     .pieces = {{"{" ASSET ",'materials':[{'extras':[", 0}, {"[],{},", 0.3}, {"0,", 0.05}, {"0]}]}", 0}}},
    {"extras of nodes", READ, 6,
     .pieces = {{"{" ASSET ",'nodes':[", 0},
                {"{'name':'n%u','extras':{'a':'%u','b':[1,2,3]}},", 0.5},
                {"{}]}", 0}}},
    {"numbers of a material", READ, 6,
     .pieces = {{"{" ASSET ",'materials':[{'a':[", 0}, {"0,", 0.15}, {"0]}]}", 0}}},
    {"scenes and their nodes", READ, 2,
     .pieces = {{"{" ASSET ",'nodes':[{}],'scenes':[{'nodes':[0", 0}, {",0", 0.4}, {"]}]}", 0}}},
    {"extensions of an animation", EITHER, 1,
     .pieces = {{"{" ASSET ",'animations':[{'extensions':{'a':{'b':[0", 0},
                {",0", 0.2},
                {"]}},'channels':[],'samplers':[", 0},
                {"{'input':0,'output':0},", 0.5},
                {"{'input':0,'output':0}]}]}", 0}}},
    {"a triangle soup",
     READ,
     36,
     &triangle_soup,
     {{"{" ASSET "," ONE_VIEW "'accessors':[{'bufferView':0,'componentType':5126,'count':%u,"
       "'type':'VEC3'}],'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}]}",
       0}}},
    {"an indexed grid",
     READ,
     36,
     &indexed_grid,
     {{"{" ASSET ",'buffers':[{'byteLength':%u*36}],'bufferViews':[{'buffer':0,'byteLength':%u*12},"
       "{'buffer':0,'byteOffset':%u*12,'byteLength':%u*24}],'accessors':[{'bufferView':0,"
       "'componentType':5126,'count':%u,'type':'VEC3'},{'bufferView':1,'componentType':5125,"
       "'count':%u*6,'type':'SCALAR'}],'meshes':[{'primitives':[{'attributes':{'POSITION':0},"
       "'indices':1}]}]}",
       0}}},
    {"8-bit indices",
     EITHER,
     36,
     &small_indices,
     {{"{" ASSET ",'buffers':[{'byteLength':%u}],'bufferViews':[{'buffer':0,'byteLength':%u}],"
       "'accessors':[{'bufferView':0,'componentType':5121,'count':256,'type':'VEC3'},"
       "{'bufferView':0,'componentType':5121,'count':%u,'type':'SCALAR'}],"
       "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':1}]}]}",
       0}}},
    {"a track of 16-bit keys",
     READ,
     36,
     &short_keys,
     {{"{" ASSET ",'buffers':[{'byteLength':%u*12}],'bufferViews':[{'buffer':0,'byteLength':%u*4},"
       "{'buffer':0,'byteOffset':%u*4,'byteLength':%u*8}],'accessors':[{'bufferView':0,"
       "'componentType':5126,'count':%u,'type':'SCALAR'},{'bufferView':1,'componentType':5122,"
       "'normalized':true,'count':%u,'type':'VEC4'}],'nodes':[{}],"
       "'animations':[{'samplers':[{'input':0,'output':1}],'channels':[{'sampler':0,"
       "'target':{'node':0,'path':'rotation'}}]}]}",
       0}}},
    {"one soup in many meshes",
     REFUSED,
     8,
     &triangle_soup,
     {{"{" ASSET "," ONE_VIEW "'accessors':[{'bufferView':0,'componentType':5126,'count':%u,"
       "'type':'VEC3'}],'meshes':[",
       0},
      {"{'primitives':[{'attributes':{'POSITION':0}}]},", 0.1},
      {"{}]}", 0}}},
    {"one point in many meshes",
     REFUSED,
     8,
     &zeros,
     {{"{" ASSET ",'buffers':[{'byteLength':%u}],'bufferViews':[{'buffer':0,'byteLength':%u}],"
       "'accessors':[{'bufferView':0,'componentType':5126,'count':500001,'type':'VEC3'}],"
       "'meshes':[",
       0},
      {"{'primitives':[{'attributes':{'POSITION':0}}]},", 0.1},
      {"{}]}", 0}}},
    {"points that share their indices",
     REFUSED,
     2,
     &zeros,
     {{"{" ASSET "," ZEROS_AS_POINTS ",'meshes':[{'primitives':[", 0},
      {"{'mode':0,'attributes':{'POSITION':0},'indices':2},", 0.2},
      {"{'mode':0,'attributes':{'POSITION':0},'indices':2}]}]}", 0}}},
    {"holes that share their indices",
     READ,
     2,
     &zeros,
     {{"{" ASSET "," ZEROS_AS_POINTS ",'meshes':[{'primitives':[{'attributes':{'POSITION':0}}],"
       "'extras':{'tweend':{'points':1,'holes':[",
       0},
      {"{'indices':2},", 0.1},
      {"{'indices':2}]}}}]}", 0}}},
    {"holes of a triangle",
     READ,
     3,
     &zeros,
     {{"{" ASSET "," ZEROS_AS_POINTS ",'meshes':[{'primitives':[{'attributes':{'POSITION':0}}],"
       "'extras':{'tweend':{'points':1,'holes':[",
       0},
      {"{'indices':1},", 0.9},
      {"{'indices':1}]}}}]}", 0}}},
    {"cages that share their points",
     READ,
     2,
     &zeros,
     {{"{" ASSET "," ZEROS_AS_CAGE ",'meshes':[", 0},
      {"{'primitives':[{'attributes':{'POSITION':0},'indices':3}],'extras':{'tweend':{'points':2}}},", 0.2},
      {"{'primitives':[{'attributes':{'POSITION':0},'indices':3}]}]}", 0}}},
    {"cages that share their creases",
     READ,
     2,
     &zeros,
     {{"{" ASSET "," ZEROS_AS_CAGE ",'meshes':[", 0},
      {"{'primitives':[{'attributes':{'POSITION':1},'indices':3}],'extras':{'tweend':{'points':4,"
       "'corners':{'vertices':2,'sharpness':5}}}},",
       0.2},
      {"{'primitives':[{'attributes':{'POSITION':0},'indices':3}]}]}", 0}}},
    {"sparse indices in many accessors",
     EITHER,
     8,
     &ascending,
     {{"{" ASSET ",'buffers':[{'byteLength':%u*4}],'bufferViews':[{'buffer':0,'byteLength':%u*4}],"
       "'meshes':[{'primitives':[",
       0},
      {"{'mode':5,'attributes':{'POSITION':%u}},", 0.02},
      {"{'attributes':{'POSITION':0}}]}],'accessors':[", 0},
      {"{'bufferView':0,'componentType':5121,'count':600000,'type':'VEC3','sparse':{'count':600000,"
       "'indices':{'bufferView':0,'componentType':5125},'values':{'bufferView':0}}},",
       0.15},
      {"{'componentType':5126,'count':1,'type':'VEC3'}]}", 0}}},
    {"primitives with polygons",
     EITHER,
     8,
     &triangle_soup,
     {{"{" ASSET "," ONE_VIEW "'extensionsUsed':['FB_ngon_encoding'],'accessors':[{'bufferView':0,"
       "'componentType':5126,'count':3,'type':'VEC3'}],'meshes':[{'primitives':[",
       0},
      {"{'attributes':{'POSITION':0,'A%u':0}},", 0.25},
      {"{'attributes':{'POSITION':0}}]}]}", 0}}},
};

/* ---- tests ----------------------------------------------------------------------------------- */

/* slowest: seconds that it may take. */
static bool judge(const document *d, api_upload_type type, api_coding coding, size_t size, verdict expected,
                  double slowest, const outcome *out) {
  static const char *const codings[] = {"plain", "gzip", "zstd"};
  uint64_t most =
      coding == API_CODING_NONE ? tw_reading_size(out->format, size) : api_reading_cost(type, coding, size);
  bool is_fit = !MEASURES || expected == EITHER || (out->status == 200) == (expected == READ);
  bool is_small = out->peak <= most && most <= ((uint64_t)64 << 20) + 6 * size,
       is_quick = out->seconds <= slowest;
  bool is_told = out->status != 200 || fabs((double)out->model_size - (double)out->model_held) <=
                                           0.08 * (double)out->model_held + 4096;
  if (MEASURES) /* what a table of them is made of */
    print_message("%-6s %-34s %6.1f MB, %d: holds %6.1f of %6.1f MB, %.2f s  %s %s\n", codings[coding],
                  d->name, (double)size / 1e6, out->status, (double)out->peak / 1e6, (double)most / 1e6,
                  out->seconds, out->error.pointer, out->status == 200 ? "" : out->error.detail);
  if (!is_fit) print_error("%s: %d was not expected\n", d->name, out->status);
  if (MEASURES && !is_small) print_error("%s: this is too much\n", d->name);
  if (MEASURES && !is_quick) print_error("%s: this is too slow\n", d->name);
  if (MEASURES && !is_told)
    print_error("%s: the model says %zu bytes and holds %zu\n", d->name, out->model_size, out->model_held);
  return is_fit && (!MEASURES || (is_small && is_quick && is_told));
}

/* How many times as long a document may take as one of a 16th of its size: on a busy machine seconds alone
 * would say nothing. What no cache holds any more takes some three times as long a byte. */
enum { TIMES_AS_LONG = 6 * 16 };

static void check_documents(api_upload_type text_type, const document *documents, size_t count) {
  size_t failures = 0;
  for (size_t i = 0; i < count; i++) {
    const document *d = &documents[i];
    api_upload_type type = d->bin ? API_TYPE_GLB : text_type;
    double slowest = 2;
    /* Under a sanitizer most are read in part alone. */
    for (size_t part = 256, least = i % test_stride() ? 16 : 1; part >= least; part /= 16) {
      /* What is too large may be read when it is smaller, and then it too holds no more. */
      verdict expected = part > 1 ? EITHER : d->expected;
      text t = build(d, (size_t)d->megabytes * MEGABYTE / part);
      outcome out = read_document((api_bytes){(const uint8_t *)t.bytes, t.size}, type);
      failures += !judge(d, type, API_CODING_NONE, t.size, expected, slowest, &out);
      slowest = fmax(2, TIMES_AS_LONG * out.seconds);
      api_coding coding = i % 2 ? API_CODING_ZSTD : API_CODING_GZIP;
      if (part == 16) {
        out = read_coded(coding, &t, type);
        failures += !judge(d, type, coding, t.size, expected, 2, &out);
      }
      free(t.bytes);
    }
  }
  assert_int_equal(failures, 0);
}

TEST(tweend_json_is_read_in_little_memory_and_time) {
  check_documents(API_TYPE_JSON, tweend_documents, sizeof tweend_documents / sizeof *tweend_documents);
}

TEST(obj_is_read_in_little_memory_and_time) {
  check_documents(API_TYPE_OBJ, obj_documents, sizeof obj_documents / sizeof *obj_documents);
}

TEST(stl_is_read_in_little_memory_and_time) {
  check_documents(API_TYPE_STL, stl_documents, sizeof stl_documents / sizeof *stl_documents);
}

TEST(gltf_is_read_in_little_memory_and_time) {
  check_documents(API_TYPE_GLTF, gltf_documents, sizeof gltf_documents / sizeof *gltf_documents);
}

/* ---- what bodies come in --------------------------------------------------------------------- */

/* Empty members of a gzip file, and empty or skippable frames of a zstd file: each costs its own start. */
TEST(many_small_members_and_frames_are_refused) {
  static const uint8_t member[20] = {0x1F, 0x8B, 8, 0, 0, 0, 0, 0, 0, 3, 3};
  static const uint8_t frame[9] = {0x28, 0xB5, 0x2F, 0xFD, 0x20, 0, 1, 0, 0};
  static const uint8_t skippable[8] = {0x50, 0x2A, 0x4D, 0x18};
  static const struct {
    api_coding coding;
    const uint8_t *part;
    size_t size;
  } cases[] = {{API_CODING_GZIP, member, sizeof member},
               {API_CODING_ZSTD, frame, sizeof frame},
               {API_CODING_ZSTD, skippable, sizeof skippable}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
    for (size_t count = 65536; count <= 65537; count++) {
      text body = {0};
      add_repeatedly(&body, (const char *)cases[i].part, cases[i].size, count * cases[i].size);
      uint8_t *decoded = NULL;
      size_t size = 0;
      tw_error error;
      tw_status status = api_decode(cases[i].coding, (api_bytes){(const uint8_t *)body.bytes, body.size}, 100,
                                    &decoded, &size, &error);
      assert_int_equal(status, count == 65536 ? TW_OK : TW_LIMIT);
      free(decoded);
      free(body.bytes);
    }
}

/* The window is what a decoder has to keep, whatever comes out. */
TEST(a_zstd_window_of_8_mib_is_enough) {
  for (int log = API_ZSTD_WINDOW_LOG; log <= API_ZSTD_WINDOW_LOG + 1; log++) {
    ZSTD_CCtx *context = ZSTD_createCCtx();
    ZSTD_CCtx_setParameter(context, ZSTD_c_windowLog, log);
    ZSTD_CCtx_setParameter(context, ZSTD_c_contentSizeFlag, 0);
    uint8_t coded[256], *decoded = NULL;
    ZSTD_outBuffer out = {coded, sizeof coded, 0};
    ZSTD_inBuffer in = {"v 0 0 0", 7, 0};
    assert_int_equal(ZSTD_compressStream2(context, &out, &in, ZSTD_e_flush),
                     0); /* its size is not known yet */
    assert_int_equal(ZSTD_compressStream2(context, &out, &in, ZSTD_e_end), 0);
    ZSTD_freeCCtx(context);
    size_t size;
    tw_error error;
    peak = held;
    size_t before = held;
    tw_status status = api_decode(API_CODING_ZSTD, (api_bytes){coded, out.pos}, 100, &decoded, &size, &error);
    if (log == API_ZSTD_WINDOW_LOG) {
      assert_int_equal(status, TW_OK);
      assert_memory_equal(decoded, "v 0 0 0", 7);
      free(decoded);
    } else {
      assert_int_equal(status, TW_UNSUPPORTED);
      assert_non_null(strstr(error.detail, "8 MiB"));
    }
    assert_true(peak - before <= api_reading_cost(API_TYPE_OBJ, API_CODING_ZSTD, 100));
  }
}

TEST(forms_made_to_be_slow_are_read_in_little_time) {
  static const struct {
    const char *name, *part;
    tw_status status;
  } cases[] = {{"line breaks", "\r", TW_SYNTAX},
               {"line ends", "\r\n", TW_SYNTAX},
               {"beginnings of the mark", "\r\n--bbbbbbbbbbbbbbbbbbb", TW_SYNTAX},
               {"parts", "\r\n--bbbbbbbbbbbbbbbbbbbb\r\n\r\n", TW_SYNTAX}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    text body = {0};
    add_repeatedly(&body, cases[i].part, strlen(cases[i].part), (size_t)256 * MEGABYTE);
    api_form form;
    tw_arena *arena = tw_arena_create();
    tw_error error;
    double start = seconds();
    tw_status status = api_form_read((api_bytes){(const uint8_t *)body.bytes, body.size},
                                     "bbbbbbbbbbbbbbbbbbbb", arena, &form, &error);
    double taken = seconds() - start;
    print_message("%s: %zu bytes, %.2f s\n", cases[i].name, body.size, taken);
    assert_int_equal(status, cases[i].status);
    if (MEASURES) assert_true(taken < 2);
    tw_arena_destroy(arena);
    free(body.bytes);
  }
}

/* A borrowed clip looks up a node for each of its tracks. */
TEST(all_nodes_are_found_by_their_names_in_little_time) {
  enum { NODES = MEASURES ? TW_NODES_MAX : 1000 };
  text t = {0};
  add(&t, "{'nodes':[", 10);
  for (size_t i = 0; i < NODES; i++)
    add_with_number(&t,
                    i == 0  ? "{}"
                    : i % 2 ? ",{'name':'a name that begins like all others %u'}"
                            : ",{}",
                    i);
  add(&t, "]}", 2);
  quote_bytes(t.bytes, t.size);
  tw_model *model = NULL;
  api_fault fault;
  assert_true(api_model_read((api_bytes){(const uint8_t *)t.bytes, t.size}, TW_FORMAT_JSON, (api_reading){0},
                             &making, &model, &fault));
  double start = seconds();
  for (uint32_t i = 0; i < NODES; i++) {
    char buffer[24];
    const char *name = tw_model_node_name(model, i, buffer);
    assert_int_equal(tw_model_find_node(model, name, strlen(name)), i);
  }
  if (MEASURES) assert_true(seconds() - start < 2);
  tw_model_destroy(model);
  free(t.bytes);
}
