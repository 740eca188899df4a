/* Packs of triangles for quantized and compressed answers: what they are, and the parts in which their bytes
 * come. */
#ifndef TWEEND_PACK_LAYOUT_H
#define TWEEND_PACK_LAYOUT_H

#include "triangulator.h"
#include "tweend/format.h"
#include "vertex_format.h"
#include "vertex_set.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { TW_PACK_TRIANGLES_MAX = 1 << 17 };

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
  uint32_t pack_count;
  size_t pack_room;
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

/* Chooses the fields of vertices and targets. False without memory. */
bool tw_packs_choose_fields(tw_packs *packs, const tw_mesh *mesh, const tw_surface_layout *layout);

/* Bytes of one target in an element. */
uint32_t tw_packs_target_size(const tw_packs *packs);

tw_pack_part tw_packs_part(const tw_packs *packs, uint32_t pack, uint32_t part);

/* Bytes of a part as it is sent. With meshopt only of measured packs. */
uint64_t tw_packs_part_size(const tw_packs *packs, uint32_t pack, uint32_t part);

/* The bounds of a pack's positions (target -1), or of the displacements of a target. Only of measured
 * packs. */
const tw_pack_bounds *tw_packs_bounds(const tw_packs *packs, uint32_t pack, int target);

/* The fields, [target_step], of a target of a part; without their columns. */
void tw_packs_target_fields(const tw_packs *packs, uint32_t target_of_part, tw_vertex_field fields[2]);

#ifdef __cplusplus
}
#endif
#endif
