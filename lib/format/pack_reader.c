/* The bytes of packs are computed a pack at a time, so that memory depends on the size of a pack and not on
 * the answer's. */
#include "pack_reader.h"

#include <meshoptimizer.h>
#include <stdlib.h>
#include <string.h>

enum {
  BLOCK = 4096, /* triangles that are read at once */
  ROWS_SCRATCH = 4096,
  GAP = 4 /* rows at most this far apart are read together */
};

/* EXT_meshopt_compression has these versions of the codec, whatever the library's defaults are. The settings
 * are globals of the library, so a constructor makes them before any thread encodes. */
__attribute__((constructor)) static void choose_codec(void) {
  meshopt_encodeVertexVersion(0);
  meshopt_encodeIndexVersion(1);
}

int tw_meshopt_version(void) {
  return MESHOPTIMIZER_VERSION;
}

struct tw_pack_reader {
  tw_surface_reader *reader;
  tw_triangulator triangles;
  tw_vertex_set set;
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
         target = (size_t)packs->targets_a_part * tw_packs_target_size(packs),
         indices = 3 * sizeof(uint16_t) * (size_t)packs->triangles_max;
  size_t vertices = (vertex > target ? vertex : target) * packs->vertices_max;
  return vertices > indices ? vertices : indices;
}

static size_t encoded_bytes_max(const tw_packs *packs) {
  if (packs->options.encoding != TW_ENCODING_MESHOPT) return 0;
  size_t vertex = tw_vertex_size(packs->fields, packs->field_count),
         target = (size_t)packs->targets_a_part * tw_packs_target_size(packs);
  size_t vertices = meshopt_encodeVertexBufferBound(packs->vertices_max, vertex > target ? vertex : target),
         indices = meshopt_encodeIndexBufferBound(3 * (size_t)packs->triangles_max, packs->vertices_max),
         sequence = meshopt_encodeIndexSequenceBound(3 * (size_t)packs->triangles_max, packs->vertices_max);
  if (indices < sequence) indices = sequence;
  return vertices > indices ? vertices : indices;
}

size_t tw_packs_reading_size(const tw_packs *packs) {
  size_t table = sizeof(uint32_t) << TW_VERTEX_SLOT_BITS,
         vertex = 2 * sizeof(uint32_t) + 2 * sizeof(uint64_t);
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
  if (tw_vertex_set_init(&r->set) && r->reader && r->order && r->sorted && r->places && r->indices &&
      r->rows && r->bytes && r->encoded &&
      tw_triangulator_init(&r->triangles, surfaces, count, polygons, r->reader))
    return r;
  tw_pack_reader_destroy(r);
  return NULL;
}

void tw_pack_reader_destroy(tw_pack_reader *reader) {
  if (!reader) return;
  tw_triangulator_deinit(&reader->triangles);
  tw_surface_reader_destroy(reader->reader);
  tw_vertex_set_deinit(&reader->set);
  tw_free(reader->order);
  tw_free(reader->sorted);
  tw_free(reader->places);
  tw_free(reader->indices);
  tw_free(reader->rows);
  tw_free(reader->bytes);
  tw_free(reader->encoded);
  tw_free(reader);
}

/* ---- reading --------------------------------------------------------------------------------- */

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
  tw_vertex_set_clear(&r->set);
  for (uint32_t done = 0; done < pack->triangle_count; done += BLOCK) {
    uint32_t count = (uint32_t)tw_least(BLOCK, pack->triangle_count - done);
    tw_triangulator_read(&r->triangles, surface, faces, pack->first_triangle + done, count, r->block);
    for (uint32_t i = 0; i < count; i++)
      tw_vertex_set_add_triangle(&r->set, r->block + 3 * (size_t)i, r->indices + 3 * (size_t)(done + i));
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

bool tw_pack_reader_turn(tw_pack_reader *r, const tw_packs *packs, const tw_surface *surface, uint32_t pack,
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
  if (!tw_pack_reader_turn(reader, packs, surface, pack, part)) return NULL;
  return packs->options.encoding == TW_ENCODING_MESHOPT ? reader->encoded : reader->bytes;
}

const uint8_t *tw_pack_reader_bytes(const tw_pack_reader *reader) {
  return reader->bytes;
}

size_t tw_pack_reader_encoded_size(const tw_pack_reader *reader) {
  return reader->encoded_size;
}
