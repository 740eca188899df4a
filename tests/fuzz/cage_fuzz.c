/* Breaks numbers of a GLB that holds a cage: texture coordinates, groups, holes, creases, corners, details,
 * points that no face uses. Any bytes are read as the cage, and as which numbers to break and how. The file
 * is read or refused, in time that its size explains; what is read can be used. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "mesh_of_bytes.h"
#include "spent.h"
#include "tweend/detail.h"
#include "use_model.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

enum { BREAKS = 3, HEAD = 20, CHUNK = 8 };

/* ---- the cage -------------------------------------------------------------------------------- */

/* Moves some vertices of level 1 off the surface, which gives the mesh details. */
static void sculpt(source *s, tw_mesh *mesh, tw_arena *arena) {
  const tw_surface_options options = {.level = 1};
  tw_surface *surface;
  tw_mesh sculpted;
  if (tw_surface_create(mesh, &options, &surface, NULL) != TW_OK) return;
  uint64_t count = tw_surface_get_counts(surface)->vertices;
  float *positions = tw_arena_alloc(arena, count, sizeof(float[3]));
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  if (positions && reader) {
    tw_surface_read_rows(reader, TW_DOMAIN_POINTS, 0, count, positions);
    for (uint64_t i = 0; i < 3 * count; i += 1 + take(s, 8)) positions[i] += take_number(s);
    if (tw_mesh_sculpt(mesh, &options, positions, NULL, NULL, arena, &sculpted, NULL) == TW_OK)
      *mesh = sculpted;
  }
  tw_surface_reader_destroy(reader);
  tw_surface_destroy(surface);
}

/* Writes the cage as an edit would store it, malloc'ed [*size]; NULL where it cannot be written. */
static uint8_t *write_cage(const tw_model *model, tw_arena *arena, size_t *size) {
  tw_mesh open;
  tw_surface *surface = NULL;
  tw_gltf_stream *stream = NULL;
  uint8_t *out = NULL;
  const tw_surface_options options = {.tagged = true};
  if (tw_mesh_open_holes(&model->meshes[0], arena, &open) != TW_OK) return NULL;
  open.detail_count = 0; /* the file has the details in extras */
  if (tw_surface_create(&open, &options, &surface, NULL) != TW_OK) return NULL;
  const tw_scene scene = {
      .model = model, .surfaces = (const tw_surface *const *)&surface, .polygons = TW_POLYGONS_NGON};
  if (tw_gltf_stream_create(&scene, TW_FORMAT_GLB, &stream, NULL) == TW_OK) {
    *size = (size_t)tw_gltf_stream_size(stream);
    out = malloc(*size);
    if (!out || tw_gltf_stream_read(stream, out, *size) != *size) abort();
    tw_gltf_stream_destroy(stream);
  }
  tw_surface_destroy(surface);
  return out;
}

static uint8_t *take_cage(source *s, size_t *size) {
  static storage own;
  static const char *groups[] = {"a", "b c", "d"};
  tw_mesh mesh;
  tw_node node = {.rest = {{0, 0, 0, 1}, {0, 0, 0}, {1, 1, 1}}, .parent = TW_NO_INDEX, .skin = TW_NO_INDEX};
  uint32_t order = 0;
  bool is_sculpted = take(s, 2) == 1;
  take_mesh(s, &own, &mesh);
  mesh.skin = (tw_skin_weights){0};
  if (tw_mesh_check(&mesh, NULL, NULL) != TW_OK) return NULL;
  tw_arena *arena = tw_arena_create();
  if (is_sculpted) sculpt(s, &mesh, arena);
  take_corner_values(s, &own, &mesh);
  const tw_model model = {.mesh_count = 1,
                          .meshes = &mesh,
                          .node_count = 1,
                          .nodes = &node,
                          .node_order = &order,
                          .group_count = sizeof groups / sizeof *groups,
                          .group_names = groups};
  uint8_t *out = write_cage(&model, arena, size);
  tw_arena_destroy(arena);
  return out;
}

/* ---- breaking -------------------------------------------------------------------------------- */

static uint32_t get_u32(const uint8_t *at) {
  return (uint32_t)at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

static void put_u32(uint32_t value, uint8_t *at) {
  for (int i = 0; i < 4; i++) at[i] = (uint8_t)(value >> 8 * i);
}

static bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

/* Whether a number of the JSON, which holds no escapes nor digits in names but after letters, begins here. */
static bool begins_number(const char *text, size_t at) {
  return is_digit(text[at]) && at > 0 && strchr("[:,-", text[at - 1]);
}

/* Replaces the digits of a number by those of another of the same length, so that nothing moves. */
static void break_number(source *s, char *at) {
  size_t length = strspn(at, "0123456789");
  uint32_t how = take(s, 6), digit = take(s, 10);
  for (size_t i = 0; i < length; i++) {
    if (how == 0) at[i] = '0';
    if (how == 1) at[i] = '9';
  }
  if (how == 2 && at[length - 1] < '9') at[length - 1]++;
  if (how == 3 && at[length - 1] > '0' && (length == 1 || at[length - 1] > '1')) at[length - 1]--;
  if (how >= 4) at[how == 4 ? length - 1 : 0] = (char)('0' + (length > 1 && digit == 0 ? 1 : digit));
}

static void break_word(source *s, uint8_t *at) {
  static const uint32_t values[] = {0,          1,          2,          UINT32_MAX, INT32_MAX, 0x7f800000,
                                    0x7fc00000, 0xff7fffff, 0x3f800000, 0x00010000, 0xffff};
  enum { VALUES = sizeof values / sizeof *values };
  uint32_t how = take(s, VALUES + 3), value = get_u32(at);
  if (how < VALUES) value = values[how];
  if (how == VALUES) value++;
  if (how == VALUES + 1) value--;
  if (how == VALUES + 2) value ^= 1u << take(s, 32);
  put_u32(value, at);
}

/* Breaks a number of the JSON, or a word of the binary chunk. */
static void break_one(source *s, uint8_t *file, size_t size) {
  char *text = (char *)file + HEAD;
  uint32_t length = get_u32(file + 12), which = take(s, 256) | take(s, 256) << 8;
  size_t data = HEAD + length + CHUNK;
  if (take(s, 2) == 1 && data + 4 <= size) {
    break_word(s, file + data + which % ((size - data) / 4) * 4);
    return;
  }
  uint32_t count = 0;
  for (uint32_t i = 0; i < length; i++) count += begins_number(text, i);
  which = count ? which % count : 0;
  for (uint32_t i = 0; i < length; i++) {
    if (!begins_number(text, i) || which-- > 0) continue;
    break_number(s, text + i);
    return;
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
  source s = {bytes, bytes + size};
  uint8_t how[BREAKS * 8];
  for (size_t i = 0; i < sizeof how; i++) how[i] = (uint8_t)take(&s, 256);
  size_t file_size = 0;
  uint8_t *file = take_cage(&s, &file_size);
  if (!file) return 0;
  source breaks = {how, how + sizeof how};
  for (uint32_t count = take(&breaks, BREAKS + 1); count > 0; count--) break_one(&breaks, file, file_size);
  tw_model *model = NULL;
  double began = spent_now();
  tw_status status = tw_gltf_read(file, file_size, TW_QUADS_NGON, TW_WELD_AUTO, 100000, &model, NULL);
  double spent = spent_now() - began;
  if (spent_too_much(spent, file_size)) spent_give_up(spent, file_size);
  if (status == TW_OK) use_model(model);
  free(file);
  return 0;
}
