/* Cuts the faces of a surface into packs, and computes the bytes of packs: quantized, and compressed by
 * meshoptimizer. */
#ifndef TWEEND_GLTF_PACKS_H
#define TWEEND_GLTF_PACKS_H

#include "triangulator.h"
#include "tweend/format.h"
#include "vertex_format.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
  TW_PACK_VERTICES_MAX = 65534, /* index 65535 is reserved for primitive restart */
  TW_PACK_TRIANGLES_MAX = 1 << 17
};

/* The faces of a material; packs do not reach over runs. */
typedef struct tw_pack_run {
  tw_surface_group faces;
  uint32_t first_group, group_count; /* of the surface */
} tw_pack_run;

/* Consecutive triangles of a material with vertices of their own, in the order in which they are used. */
typedef struct tw_pack {
  uint32_t run; /* of the runs */
  uint64_t first_triangle;
  uint32_t triangle_count, vertex_count;
} tw_pack;

typedef struct tw_pack_bounds {
  float min[3], max[3]; /* of the numbers as they are stored */
} tw_pack_bounds;

/* A pack's bytes come in parts: vertices, then displacements of `targets_a_part` targets at a time, then
 * indices. */
struct tw_packs {
  tw_arena *arena;
  tw_pack_options options;
  uint32_t field_count;
  tw_vertex_field fields[TW_VERTEX_FIELDS_MAX];
  uint32_t target_count, targets_a_part, part_count;
  uint32_t target_step;      /* fields of a target: 1 for its positions, 2 if it moves normals too */
  tw_vertex_field target[2]; /* of the first target of a part */
  uint32_t run_count;
  tw_pack_run *runs; /* [run_count] */
  uint32_t pack_count, pack_capacity;
  tw_pack *packs;                       /* [pack_count], from malloc */
  uint32_t vertices_max, triangles_max; /* of a pack */
  /* Once measured: */
  tw_pack_bounds *bounds; /* [pack_count][1 + target_count]: of positions, then of targets */
  uint32_t *sizes;        /* [pack_count][part_count], of compressed bytes; else NULL */
};

/* What a part holds before it is compressed. */
typedef struct tw_pack_part {
  bool has_vertices; /* else indices */
  uint32_t first_target, target_count;
  uint32_t count, stride; /* elements, bytes of one */
} tw_pack_part;

tw_pack_part tw_packs_part(const tw_packs *packs, uint32_t pack, uint32_t part);

/* Bytes of a part as it is sent. With meshopt only of measured packs. */
uint64_t tw_packs_part_size(const tw_packs *packs, uint32_t pack, uint32_t part);

/* The bounds of a pack's positions (target -1), or of the displacements of a target. Only of measured
 * packs. */
const tw_pack_bounds *tw_packs_bounds(const tw_packs *packs, uint32_t pack, int target);

/* The fields, [target_step], of a target of a part; without their columns. */
void tw_packs_target_fields(const tw_packs *packs, uint32_t target_of_part, tw_vertex_field fields[2]);

/* Computes the bytes of parts; belongs to one stream. */
typedef struct tw_pack_reader tw_pack_reader;

/* For any of the packs of a scene and their surfaces. NULL without memory. */
tw_pack_reader *tw_pack_reader_create(const tw_packs *const *packs, const tw_surface *const *surfaces,
                                      uint32_t count);
void tw_pack_reader_destroy(tw_pack_reader *reader); /* NULL accepted */

/* Reorders triangles so that they compress well. indices: [count], below vertex_count. False without
 * memory. */
bool tw_order_triangles(uint32_t *indices, size_t count, uint32_t vertex_count);

/* The bytes of a part as they are sent, [tw_packs_part_size], valid until the next call. Calls for parts of
 * the same pack in turn are cheap. surface: the surface of the packs. NULL without memory. */
const uint8_t *tw_pack_read(tw_pack_reader *reader, const tw_packs *packs, const tw_surface *surface,
                            uint32_t pack, uint32_t part);

#ifdef __cplusplus
}
#endif
#endif
