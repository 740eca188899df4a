/* Faces are cut into packs by a pass over their indices; the bytes of packs are computed a pack at a time, so
 * that memory depends on the size of a pack and not on the answer's. */
#include "gltf_packs.h"

#include <float.h>
#include <math.h>
#include <meshoptimizer.h>
#include <stdlib.h>
#include <string.h>

#include "parallel_for.h"

enum {
  BLOCK = 4096, /* triangles that are read at once */
  ROWS_SCRATCH = 4096,
  GAP = 4, /* rows at most this far apart are read together */
  SLOT_BITS = 17
};

/* EXT_meshopt_compression has these versions of the codec, whatever the library's defaults are. The settings
 * are globals of the library, so a constructor makes them before any thread encodes. */
__attribute__((constructor)) static void choose_codec(void) {
  meshopt_encodeVertexVersion(0);
  meshopt_encodeIndexVersion(1);
}

/* ---- vertices of a pack -------------------------------------------------------------------------------- */

/* The rows of the surface that a pack uses, by their places in the pack. */
typedef struct vertex_set {
  uint32_t count;
  uint32_t *rows;  /* [TW_PACK_VERTICES_MAX] */
  uint32_t *slots; /* [1 << SLOT_BITS] hash table: place + 1, or 0 */
  uint32_t multiplier;
} vertex_set;

/* The sender of a model chooses its rows, and could make them share slots: so the address of the table, which
 * is random, seeds the hash. Places do not depend on it. */
static bool set_init(vertex_set *set) {
  *set = (vertex_set){.rows = tw_alloc(TW_PACK_VERTICES_MAX, sizeof *set->rows),
                      .slots = tw_alloc(1 << SLOT_BITS, sizeof *set->slots)};
  uint64_t mixed = (uint64_t)(uintptr_t)set->slots * 0x9E3779B97F4A7C15u;
  set->multiplier = (uint32_t)(mixed >> 32) | 1;
  return set->rows && set->slots;
}

static void set_deinit(vertex_set *set) {
  tw_free(set->rows);
  tw_free(set->slots);
}

static void set_clear(vertex_set *set) {
  set->count = 0;
  memset(set->slots, 0, sizeof *set->slots << SLOT_BITS);
}

/* The row's place, a new one where it has none yet; TW_NO_INDEX: the pack is full. */
static uint32_t set_add(vertex_set *set, uint32_t row) {
  uint32_t slot = row * set->multiplier >> (32 - SLOT_BITS);
  while (set->slots[slot] > 0) {
    uint32_t place = set->slots[slot] - 1;
    if (set->rows[place] == row) return place;
    slot = (slot + 1) & ((1u << SLOT_BITS) - 1);
  }
  if (set->count == TW_PACK_VERTICES_MAX) return TW_NO_INDEX;
  set->rows[set->count] = row;
  set->slots[slot] = ++set->count;
  return set->count - 1;
}

static bool set_add_triangle(vertex_set *set, const uint32_t rows[3], uint32_t places[3]) {
  for (int i = 0; i < 3; i++) {
    places[i] = set_add(set, rows[i]);
    if (places[i] == TW_NO_INDEX) return false;
  }
  return true;
}

/* ---- how vertices are stored --------------------------------------------------------------------------- */

static bool is_fraction(const tw_uv_set *set) {
  for (size_t i = 0; i < 2 * (size_t)set->value_count; i++)
    if (!(set->values[i] >= 0 && set->values[i] <= 1)) return false;
  return true;
}

static bool has_small_joints(const tw_mesh *mesh) {
  for (size_t i = 0; mesh->skin.joints && i < mesh->skin.width * (size_t)mesh->point_count; i++)
    if (mesh->skin.joints[i] > UINT8_MAX) return false;
  return true;
}

/* Copies the names of attributes: packs may outlive the mesh. False without memory. */
static bool keep_names(tw_packs *packs) {
  for (uint32_t i = 0; i < packs->field_count; i++) {
    const char *name = packs->fields[i].semantic;
    packs->fields[i].semantic = tw_arena_text(packs->arena, name, strlen(name));
    if (!packs->fields[i].semantic) return false;
  }
  return true;
}

static void choose_fields(tw_packs *packs, const tw_mesh *mesh, const tw_surface_layout *layout) {
  tw_vertex_coding places = packs->options.grid.is_float ? TW_CODED_FLOATS : TW_CODED_PLACES;
  tw_vertex_codings codings = {places,
                               TW_CODED_UNITS,
                               TW_CODED_UNITS,
                               {TW_CODED_FLOATS},
                               TW_CODED_FRACTIONS,
                               has_small_joints(mesh) ? TW_CODED_SMALL_JOINTS : TW_CODED_ROUNDED_JOINTS,
                               TW_CODED_WEIGHTS};
  for (uint32_t set = 0; set < layout->uv_count; set++)
    if (is_fraction(&mesh->uv_sets[set])) codings.uvs[set] = TW_CODED_FRACTIONS;
  packs->field_count = tw_vertex_fields(mesh, layout, &codings, packs->fields);
  memcpy(packs->fields->origin, packs->options.grid.origin, sizeof packs->fields->origin);
  packs->fields->scale = packs->options.grid.scale;
  packs->target_count = layout->morph_count;
  packs->target_step = layout->morph_width / 3;
  packs->target[0] = (tw_vertex_field){.coding = places, .width = 3, .scale = packs->fields->scale};
  packs->target[1] = (tw_vertex_field){.width = 3, .offset = tw_vertex_field_size(&packs->target[0])};
  uint32_t most = packs->target_step ? TW_DISPLACEMENTS_MAX / packs->target_step : 0;
  packs->targets_a_part = layout->morph_count < most ? layout->morph_count : most;
  uint32_t target_parts = packs->target_count ? (packs->target_count + most - 1) / most : 0;
  packs->part_count = 1 + target_parts + 1;
}

/* Bytes of one target in an element. */
static uint32_t target_size(const tw_packs *packs) {
  return tw_vertex_size(packs->target, packs->target_step);
}

tw_pack_part tw_packs_part(const tw_packs *packs, uint32_t pack, uint32_t part) {
  const tw_pack *p = &packs->packs[pack];
  if (part == packs->part_count - 1)
    return (tw_pack_part){.count = 3 * p->triangle_count, .stride = sizeof(uint16_t)};
  if (part == 0)
    return (tw_pack_part){.has_vertices = true,
                          .count = p->vertex_count,
                          .stride = tw_vertex_size(packs->fields, packs->field_count)};
  uint32_t first = (part - 1) * packs->targets_a_part;
  uint32_t count = (uint32_t)tw_least(packs->targets_a_part, packs->target_count - first);
  return (tw_pack_part){true, first, count, p->vertex_count, count * target_size(packs)};
}

uint64_t tw_packs_part_size(const tw_packs *packs, uint32_t pack, uint32_t part) {
  if (packs->sizes) return packs->sizes[(size_t)pack * packs->part_count + part];
  const tw_pack_part whole = tw_packs_part(packs, pack, part);
  return (uint64_t)whole.count * whole.stride;
}

const tw_pack_bounds *tw_packs_bounds(const tw_packs *packs, uint32_t pack, int target) {
  return packs->bounds + (size_t)pack * (1 + packs->target_count) + (size_t)(target + 1);
}

void tw_packs_target_fields(const tw_packs *packs, uint32_t target_of_part, tw_vertex_field fields[2]) {
  for (uint32_t i = 0; i < packs->target_step; i++) {
    fields[i] = packs->target[i];
    fields[i].offset += target_of_part * target_size(packs);
  }
}

/* ---- the reader ---------------------------------------------------------------------------------------- */

struct tw_pack_reader {
  tw_surface_reader *reader;
  tw_triangulator triangles;
  vertex_set set;
  uint64_t *order, *sorted; /* [TW_PACK_VERTICES_MAX] row in the upper half, place in the lower; ascending */
  uint32_t *places;         /* [TW_PACK_VERTICES_MAX] of the set's rows */
  uint32_t *indices;        /* [triangles of the largest pack][3] */
  float *rows;              /* [ROWS_SCRATCH] */
  uint8_t *bytes, *encoded; /* [capacity] */
  size_t capacity, encoded_capacity;
  uint32_t block[3 * BLOCK];
  /* What was read last: this part of this pack of these packs. */
  const tw_packs *packs;
  uint32_t pack, part;
  size_t encoded_size;
};

static size_t part_bytes_max(const tw_packs *packs) {
  size_t vertex = tw_vertex_size(packs->fields, packs->field_count),
         target = (size_t)packs->targets_a_part * target_size(packs),
         indices = 3 * sizeof(uint16_t) * (size_t)packs->triangles_max;
  size_t vertices = (vertex > target ? vertex : target) * packs->vertices_max;
  return vertices > indices ? vertices : indices;
}

static size_t encoded_bytes_max(const tw_packs *packs) {
  if (packs->options.encoding != TW_ENCODING_MESHOPT) return 0;
  size_t vertex = tw_vertex_size(packs->fields, packs->field_count),
         target = (size_t)packs->targets_a_part * target_size(packs);
  size_t vertices = meshopt_encodeVertexBufferBound(packs->vertices_max, vertex > target ? vertex : target),
         indices = meshopt_encodeIndexBufferBound(3 * (size_t)packs->triangles_max, packs->vertices_max),
         sequence = meshopt_encodeIndexSequenceBound(3 * (size_t)packs->triangles_max, packs->vertices_max);
  if (indices < sequence) indices = sequence;
  return vertices > indices ? vertices : indices;
}

size_t tw_packs_reading_size(const tw_packs *packs) {
  size_t table = sizeof(uint32_t) << SLOT_BITS, vertex = 2 * sizeof(uint32_t) + 2 * sizeof(uint64_t);
  return sizeof(tw_pack_reader) + table + vertex * TW_PACK_VERTICES_MAX + ROWS_SCRATCH * sizeof(float) +
         3 * sizeof(uint32_t) * (size_t)packs->triangles_max + part_bytes_max(packs) +
         encoded_bytes_max(packs);
}

tw_pack_reader *tw_pack_reader_create(const tw_packs *const *packs, const tw_surface *const *surfaces,
                                      uint32_t count) {
  tw_pack_reader *r = tw_alloc_zero(1, sizeof *r);
  if (!r) return NULL;
  uint32_t triangles_max = 0;
  tw_polygons polygons = count > 0 ? packs[0]->options.polygons : TW_POLYGONS_TRIANGLES; /* of all */
  for (uint32_t i = 0; i < count; i++) {
    size_t bytes = part_bytes_max(packs[i]), encoded = encoded_bytes_max(packs[i]);
    if (bytes > r->capacity) r->capacity = bytes;
    if (encoded > r->encoded_capacity) r->encoded_capacity = encoded;
    if (packs[i]->triangles_max > triangles_max) triangles_max = packs[i]->triangles_max;
  }
  r->reader = tw_surface_reader_create_shared(surfaces, count, TW_DISPLACEMENTS_MAX);
  r->order = tw_alloc(TW_PACK_VERTICES_MAX, sizeof *r->order);
  r->sorted = tw_alloc(TW_PACK_VERTICES_MAX, sizeof *r->sorted);
  r->places = tw_alloc(TW_PACK_VERTICES_MAX, sizeof *r->places);
  r->indices = tw_alloc(triangles_max, 3 * sizeof *r->indices);
  r->rows = tw_alloc(ROWS_SCRATCH, sizeof *r->rows);
  r->bytes = tw_alloc(r->capacity, 1);
  r->encoded = tw_alloc(r->encoded_capacity, 1);
  if (set_init(&r->set) && r->reader && r->order && r->sorted && r->places && r->indices && r->rows &&
      r->bytes && r->encoded && tw_triangulator_init(&r->triangles, surfaces, count, polygons, r->reader))
    return r;
  tw_pack_reader_destroy(r);
  return NULL;
}

void tw_pack_reader_destroy(tw_pack_reader *reader) {
  if (!reader) return;
  tw_triangulator_deinit(&reader->triangles);
  tw_surface_reader_destroy(reader->reader);
  set_deinit(&reader->set);
  tw_free(reader->order);
  tw_free(reader->sorted);
  tw_free(reader->places);
  tw_free(reader->indices);
  tw_free(reader->rows);
  tw_free(reader->bytes);
  tw_free(reader->encoded);
  tw_free(reader);
}

/* ---- cutting ------------------------------------------------------------------------------------------- */

/* The longest pack that begins with triangle `first` of a run. Polygons stay whole: a pack ends where another
 * fan begins, unless one fan alone is too large. */
static tw_pack next_pack(tw_pack_reader *r, const tw_surface *surface, const tw_surface_group *faces,
                         uint32_t run, uint64_t first) {
  uint64_t total = tw_count_triangles(faces), fan_begin = first;
  uint32_t vertices_before_fan = 0, fan_vertex = UINT32_MAX, places[3];
  set_clear(&r->set);
  for (uint64_t from = first; from < total; from += BLOCK) {
    uint32_t count = (uint32_t)tw_least(BLOCK, total - from);
    tw_triangulator_read(&r->triangles, surface, faces, from, count, r->block);
    for (uint32_t i = 0; i < count; i++) {
      uint32_t before = r->set.count;
      uint64_t here = from + i;
      if (r->block[3 * (size_t)i] != fan_vertex) {
        fan_vertex = r->block[3 * (size_t)i];
        fan_begin = here;
        vertices_before_fan = before;
      }
      bool has_room = here - first < TW_PACK_TRIANGLES_MAX;
      if (has_room && set_add_triangle(&r->set, r->block + 3 * (size_t)i, places)) continue;
      if (fan_begin > first) return (tw_pack){run, first, (uint32_t)(fan_begin - first), vertices_before_fan};
      return (tw_pack){run, first, (uint32_t)(here - first), before};
    }
  }
  return (tw_pack){run, first, (uint32_t)(total - first), r->set.count};
}

static bool add_pack(tw_packs *packs, tw_pack pack) {
  if (packs->pack_count == packs->pack_capacity) {
    uint32_t capacity = 2 * packs->pack_capacity + 4;
    tw_pack *grown = tw_resize(packs->packs, capacity * sizeof *grown);
    if (!grown) return false;
    packs->packs = grown;
    packs->pack_capacity = capacity;
  }
  packs->packs[packs->pack_count++] = pack;
  if (pack.vertex_count > packs->vertices_max) packs->vertices_max = pack.vertex_count;
  if (pack.triangle_count > packs->triangles_max) packs->triangles_max = pack.triangle_count;
  return true;
}

static tw_status cut_runs(tw_packs *packs, const tw_surface *surface, tw_pack_reader *r,
                          const tw_parallel_for *parallel) {
  packs->runs = tw_arena_alloc(packs->arena, tw_surface_group_count(surface), sizeof *packs->runs);
  if (!packs->runs) return TW_NO_MEMORY;
  for (uint32_t group = 0; group < tw_surface_group_count(surface);) {
    tw_pack_run *run = &packs->runs[packs->run_count];
    run->first_group = group;
    run->faces = tw_take_material(surface, &group);
    run->group_count = group - run->first_group;
    uint64_t total = tw_count_triangles(&run->faces);
    for (uint64_t first = 0; first < total;) {
      tw_status status = tw_parallel_for_status(parallel);
      if (status != TW_OK) return status;
      tw_pack pack = next_pack(r, surface, &run->faces, packs->run_count, first);
      if (!add_pack(packs, pack)) return TW_NO_MEMORY;
      first += pack.triangle_count;
    }
    packs->run_count++;
  }
  return TW_OK;
}

static tw_status cut(tw_packs *packs, const tw_surface *surface, const tw_parallel_for *parallel) {
  const tw_packs *uncut = packs;
  tw_pack_reader *reader = tw_pack_reader_create(&uncut, &surface, 1);
  tw_status status = reader ? cut_runs(packs, surface, reader, parallel) : TW_NO_MEMORY;
  tw_pack_reader_destroy(reader);
  return status;
}

/* ---- reading ------------------------------------------------------------------------------------------- */

/* Sorts the vertices by row: a radix sort, the lowest byte first. The number of passes is even, so the result
 * is in `order`. */
static void sort_rows(tw_pack_reader *r) {
  uint32_t count = r->set.count;
  for (uint32_t i = 0; i < count; i++) r->order[i] = (uint64_t)r->set.rows[i] << 32 | r->places[i];
  for (int shift = 32; shift < 64; shift += 8) {
    uint32_t ends[257] = {0};
    for (uint32_t i = 0; i < count; i++) ends[(r->order[i] >> shift & 255) + 1]++;
    for (int digit = 0; digit < 255; digit++) ends[digit + 1] += ends[digit];
    for (uint32_t i = 0; i < count; i++) r->sorted[ends[r->order[i] >> shift & 255]++] = r->order[i];
    uint64_t *swapped = r->order;
    r->order = r->sorted;
    r->sorted = swapped;
  }
}

/* Numbers vertices in the order in which the triangles use them, which `reorder` may have changed. */
static void renumber(tw_pack_reader *r, uint32_t index_count) {
  uint32_t count = 0;
  for (uint32_t i = 0; i < r->set.count; i++) r->places[i] = TW_NO_INDEX;
  for (uint32_t i = 0; i < index_count; i++) {
    uint32_t *place = &r->places[r->indices[i]];
    if (*place == TW_NO_INDEX) *place = count++;
    r->indices[i] = *place;
  }
}

/* Puts triangles in an order that compresses well, but only within each of the surface's groups, because the
 * extras of a primitive name groups by ranges of indices. Skips runs of over 4096 groups and groups of under
 * 1024 triangles, where it takes longer than it saves. False without memory. */
static bool reorder(tw_pack_reader *r, const tw_surface *surface, const tw_pack *pack) {
  enum { GROUPS_MOST = 4096, TRIANGLES_LEAST = 1024 };
  const tw_pack_run *run = &r->packs->runs[pack->run];
  uint64_t begin = pack->first_triangle, end = begin + pack->triangle_count, start = 0;
  if (run->group_count > GROUPS_MOST) return true;
  for (uint32_t i = 0; i < run->group_count && start < end; i++) {
    uint64_t stop = start + tw_count_triangles(tw_surface_get_group(surface, run->first_group + i));
    uint64_t from = start > begin ? start : begin, to = stop < end ? stop : end;
    start = stop;
    if (from + TRIANGLES_LEAST > to) continue;
    if (!tw_order_triangles(r->indices + 3 * (from - begin), 3 * (size_t)(to - from), r->set.count))
      return false;
  }
  return true;
}

/* Reads the vertices and indices of the pack that the reader is at. False without memory. */
static bool turn_to_pack(tw_pack_reader *r, const tw_surface *surface) {
  const tw_pack *pack = &r->packs->packs[r->pack];
  const tw_surface_group *faces = &r->packs->runs[pack->run].faces;
  set_clear(&r->set);
  for (uint32_t done = 0; done < pack->triangle_count; done += BLOCK) {
    uint32_t count = (uint32_t)tw_least(BLOCK, pack->triangle_count - done);
    tw_triangulator_read(&r->triangles, surface, faces, pack->first_triangle + done, count, r->block);
    for (uint32_t i = 0; i < count; i++)
      set_add_triangle(&r->set, r->block + 3 * (size_t)i, r->indices + 3 * (size_t)(done + i));
  }
  bool is_free =
      r->packs->options.encoding == TW_ENCODING_MESHOPT &&
      r->packs->options.polygons == TW_POLYGONS_TRIANGLES; /* the triangles of a polygon must stay together */
  if (is_free && !reorder(r, surface, pack)) return false;
  renumber(r, 3 * pack->triangle_count);
  sort_rows(r);
  return true;
}

/* Fills `bytes` with vertices. Rows that are near each other in the surface are read together. */
static void fill_vertices(tw_pack_reader *r, const tw_surface *surface, const tw_pack_part *part,
                          const tw_vertex_field *fields, uint32_t field_count) {
  tw_surface_reader_turn(r->reader, surface, part->first_target, part->target_count);
  uint32_t stride = tw_surface_reader_layout(r->reader)->stride, most = ROWS_SCRATCH / stride;
  for (uint32_t begin = 0, end; begin < part->count; begin = end) {
    uint32_t first = (uint32_t)(r->order[begin] >> 32), last = first;
    for (end = begin + 1; end < part->count; end++) {
      uint32_t row = (uint32_t)(r->order[end] >> 32);
      if (row - last > GAP || row - first >= most) break;
      last = row;
    }
    tw_surface_read_rows(r->reader, TW_DOMAIN_VERTICES, first, last - first + 1, r->rows);
    for (uint32_t i = begin; i < end; i++) {
      const float *row = r->rows + (size_t)((uint32_t)(r->order[i] >> 32) - first) * stride;
      tw_vertex_write(fields, field_count, row, r->bytes + (size_t)(uint32_t)r->order[i] * part->stride);
    }
  }
}

static void fill_targets(tw_pack_reader *r, const tw_surface *surface, const tw_pack_part *part) {
  tw_vertex_field fields[TW_DISPLACEMENTS_MAX];
  uint32_t step = r->packs->target_step, count = step * part->target_count;
  uint32_t column = tw_vertex_target_column(tw_surface_get_layout(surface), part->target_count);
  for (uint32_t i = 0; i < part->target_count; i++)
    tw_packs_target_fields(r->packs, i, fields + (size_t)step * i);
  for (uint32_t i = 0; i < count; i++) fields[i].column = column + 3 * i;
  fill_vertices(r, surface, part, fields, count);
}

static void fill_indices(tw_pack_reader *r, uint32_t count) {
  for (uint32_t i = 0; i < count; i++) {
    uint16_t index = (uint16_t)r->indices[i];
    memcpy(r->bytes + sizeof index * i, &index, sizeof index);
  }
}

static void fill_part(tw_pack_reader *r, const tw_surface *surface, const tw_pack_part *part) {
  if (!part->has_vertices)
    fill_indices(r, part->count);
  else if (part->target_count > 0)
    fill_targets(r, surface, part);
  else
    fill_vertices(r, surface, part, r->packs->fields, r->packs->field_count);
}

/* Compresses `bytes` or indices into `encoded`; returns the size. The triangle codec rotates triangles, which
 * would break the fans of polygons, so these are encoded as a sequence. */
static size_t compress(tw_pack_reader *r, const tw_pack_part *part) {
  if (part->has_vertices)
    return meshopt_encodeVertexBuffer(r->encoded, r->encoded_capacity, r->bytes, part->count, part->stride);
  return r->packs->options.polygons == TW_POLYGONS_NGON
             ? meshopt_encodeIndexSequence(r->encoded, r->encoded_capacity, r->indices, part->count)
             : meshopt_encodeIndexBuffer(r->encoded, r->encoded_capacity, r->indices, part->count);
}

/* Fills `bytes`, and `encoded` where needed, with a part, unless they hold it already. False without
 * memory. */
static bool turn_to_part(tw_pack_reader *r, const tw_packs *packs, const tw_surface *surface, uint32_t pack,
                         uint32_t part) {
  bool is_other = r->packs != packs || r->pack != pack;
  if (!is_other && r->part == part) return true;
  r->packs = packs;
  r->pack = pack;
  r->part = part;
  if (is_other && !turn_to_pack(r, surface)) {
    r->packs = NULL;
    return false;
  }
  const tw_pack_part whole = tw_packs_part(packs, pack, part);
  fill_part(r, surface, &whole);
  if (packs->options.encoding == TW_ENCODING_MESHOPT) r->encoded_size = compress(r, &whole);
  return true;
}

const uint8_t *tw_pack_read(tw_pack_reader *reader, const tw_packs *packs, const tw_surface *surface,
                            uint32_t pack, uint32_t part) {
  if (!turn_to_part(reader, packs, surface, pack, part)) return NULL;
  return packs->options.encoding == TW_ENCODING_MESHOPT ? reader->encoded : reader->bytes;
}

/* ---- measuring ----------------------------------------------------------------------------------------- */

enum { PACKS_AT_ONCE = 64 /* between two checks for cancellation */ };

typedef struct measuring {
  tw_packs *packs;
  const tw_surface *surface;
  uint32_t first; /* the pack that the parallel loop begins with */
  bool failed[TW_PARALLEL_FOR_PARTS_MAX];
} measuring;

static void bound_field(const tw_pack_reader *r, const tw_vertex_field *field, const tw_pack_part *part,
                        tw_pack_bounds *bounds) {
  *bounds = (tw_pack_bounds){{FLT_MAX, FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX, -FLT_MAX}};
  for (uint32_t i = 0; i < part->count; i++)
    tw_vertex_widen(field, r->bytes + (size_t)i * part->stride, bounds->min, bounds->max);
}

static bool measure_part(tw_pack_reader *r, const measuring *m, uint32_t pack, uint32_t part) {
  tw_packs *packs = m->packs;
  const tw_pack_part whole = tw_packs_part(packs, pack, part);
  tw_pack_bounds *bounds = packs->bounds + (size_t)pack * (1 + packs->target_count);
  if (!turn_to_part(r, packs, m->surface, pack, part)) return false;
  if (part == 0) bound_field(r, packs->fields, &whole, bounds);
  for (uint32_t i = 0; i < whole.target_count; i++) {
    tw_vertex_field fields[2];
    tw_packs_target_fields(packs, i, fields);
    bound_field(r, fields, &whole, bounds + 1 + whole.first_target + i);
  }
  if (packs->options.encoding == TW_ENCODING_MESHOPT)
    packs->sizes[(size_t)pack * packs->part_count + part] = (uint32_t)r->encoded_size;
  return true;
}

static void measure_packs(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  measuring *m = context;
  const tw_packs *packs = m->packs;
  tw_pack_reader *r = tw_pack_reader_create(&packs, &m->surface, 1);
  bool done = r;
  for (uint32_t pack = m->first + begin; done && pack < m->first + end; pack++)
    for (uint32_t i = 0; done && i < packs->part_count; i++) done = measure_part(r, m, pack, i);
  m->failed[part] = !done;
  tw_pack_reader_destroy(r);
}

static tw_status measure(tw_packs *packs, const tw_surface *surface, const tw_parallel_for *parallel) {
  measuring m = {.packs = packs, .surface = surface};
  packs->bounds =
      tw_arena_alloc(packs->arena, packs->pack_count, (1 + packs->target_count) * sizeof *packs->bounds);
  if (packs->options.encoding == TW_ENCODING_MESHOPT)
    packs->sizes = tw_arena_alloc(packs->arena, packs->pack_count, packs->part_count * sizeof *packs->sizes);
  if (!packs->bounds || (packs->options.encoding == TW_ENCODING_MESHOPT && !packs->sizes))
    return TW_NO_MEMORY;
  for (uint32_t taken; m.first < packs->pack_count; m.first += taken) {
    tw_status status = tw_parallel_for_status(parallel);
    if (status != TW_OK) return status;
    taken = packs->pack_count - m.first < PACKS_AT_ONCE ? packs->pack_count - m.first : PACKS_AT_ONCE;
    tw_parallel_for_run(parallel, taken, 1, measure_packs, &m);
    for (int i = 0; i < TW_PARALLEL_FOR_PARTS_MAX; i++)
      if (m.failed[i]) return TW_NO_MEMORY;
  }
  return TW_OK;
}

/* ---- the whole ----------------------------------------------------------------------------------------- */

static tw_status build(tw_packs *packs, const tw_mesh *mesh, const tw_surface *surface,
                       const tw_parallel_for *parallel) {
  packs->arena = tw_arena_create();
  if (!packs->arena) return TW_NO_MEMORY;
  choose_fields(packs, mesh, tw_surface_get_layout(surface));
  if (!keep_names(packs)) return TW_NO_MEMORY;
  if (tw_surface_get_counts(surface)->faces == 0) return TW_OK;
  tw_status status = cut(packs, surface, parallel);
  return status == TW_OK && packs->options.is_measured ? measure(packs, surface, parallel) : status;
}

tw_status tw_packs_create(const tw_mesh *mesh, const tw_surface *surface, const tw_pack_options *options,
                          const tw_parallel_for *parallel, tw_packs **out, tw_error *error) {
  tw_packs *packs = tw_alloc_zero(1, sizeof *packs);
  if (packs) packs->options = *options;
  tw_status status = packs ? build(packs, mesh, surface, parallel) : TW_NO_MEMORY;
  if (status == TW_OK) {
    *out = packs;
    return TW_OK;
  }
  tw_packs_destroy(packs);
  if (status == TW_CANCELLED) return tw_fail(error, status, "the packs are not wanted any more");
  return tw_fail(error, status, "no memory for the packs of a surface");
}

void tw_packs_destroy(tw_packs *packs) {
  if (!packs) return;
  tw_arena_destroy(packs->arena);
  tw_free(packs->packs);
  tw_free(packs);
}

size_t tw_packs_size(const tw_packs *packs) {
  return sizeof *packs + tw_arena_size(packs->arena) + packs->pack_capacity * sizeof *packs->packs;
}

int tw_meshopt_version(void) {
  return MESHOPTIMIZER_VERSION;
}
