/* Maps corners of a coarsened cage's surface to those of the mesh, and makes the detail that covers their
 * difference. */
#include "coarse_details.h"

#include <string.h>

#include "level_detail.h"

/* A face of the child, and which of its corners is corner 0 of the same face when the parents are refined. */
typedef struct turned_face {
  uint32_t face, turn;
} turned_face;

/* Finds the child's face that is face `face` of the refined parents: of quads, one for each corner of the
 * parents; of triangles, four for each parent, the fourth in the middle. */
static turned_face child_face(const tw_topology *child, const tw_coarse_faces *parents, uint32_t face) {
  uint32_t size = child->face_size;
  if (size == 4) return (turned_face){parents->origins[face] / 4, parents->origins[face] % 4};
  uint32_t i = face % 4, origin = parents->origins[3 * (face / 4) + (i < 3 ? i : 0)];
  /* The child at corner i of the parent has corner i of its own there. */
  if (i < 3) return (turned_face){origin / 3, (origin + 3 - i) % 3};
  /* The middle triangle lies across the edge of the child at corner 0 that joins the middles of the parent's
   * edges 0 and 2. In the middle triangle, the middle of edge 2 is corner 1. */
  uint32_t across = child->sibling[tw_triangle_next(origin)];
  return (turned_face){across / 3, (across + 2) % 3};
}

/* Renumbers a path for a face whose corners are turned. A path leads from a face of the child down to one of
 * its descendants: which child to take at each level, two bits a level, the first step in the highest bits.
 * In `path` children are counted from the face's corner `turn`, in the result from its corner 0.
 * A child of a quad begins at the quad's corner, so only the first step changes. The children of a triangle
 * keep the numbers of its corners, so every step changes, except steps to the middle child (3). */
static uint32_t turn_path(uint32_t path, uint32_t levels, uint32_t turn, bool triangles) {
  uint32_t out = path;
  for (uint32_t level = triangles ? 0 : levels - 1; level < levels; level++) {
    uint32_t shift = 2 * level, digit = path >> shift & 3;
    if (triangles && digit == 3) continue;
    out = (out & ~(3u << shift)) | (digit + turn) % (triangles ? 3 : 4) << shift;
  }
  return out;
}

tw_status tw_coarse_corners(const tw_topology *child, const tw_coarse_faces *parents, const uint32_t *before,
                            uint32_t levels, tw_arena *arena, const uint32_t **out) {
  bool triangles = child->face_size == 3;
  uint32_t size = child->face_size, faces = child->face_count << 2 * levels, mask = (1u << 2 * levels) - 1;
  uint32_t *corners = tw_arena_alloc_raw(arena, faces, size * sizeof *corners);
  if (!corners) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < faces; f++) {
    turned_face at = child_face(child, parents, f >> 2 * levels);
    uint32_t face =
        (at.face << 2 * levels) + (levels > 0 ? turn_path(f & mask, levels, at.turn, triangles) : 0);
    /* A deeper descendant of a quad has the same first corner either way. */
    bool is_turned = triangles || levels == 0;
    for (uint32_t k = 0; k < size; k++) {
      uint32_t corner = size * face + (is_turned ? (k + at.turn) % size : k);
      corners[size * f + k] = before ? before[corner] : corner;
    }
  }
  *out = corners;
  return TW_OK;
}

tw_status tw_coarse_detail(const tw_mesh *refined, const uint32_t *corners, const tw_surface_options *options,
                           const tw_parallel_for *parallel, tw_arena *arena, tw_mesh *cage, tw_error *error) {
  tw_arena *scratch = tw_arena_create();
  const tw_rules rules = tw_rules_of(options);
  tw_detail_level level;
  tw_detail_frames *frames;
  float *offsets = NULL;
  tw_detail *detail = tw_arena_alloc(arena, 1, sizeof *detail);
  tw_status status = scratch && detail ? TW_OK : TW_NO_MEMORY;
  if (status == TW_OK) status = tw_detail_level_of(cage, options, parallel, scratch, &level, error);
  if (status == TW_OK) status = tw_detail_frames_create(&level, &rules, scratch, &frames);
  if (status == TW_OK) offsets = tw_arena_alloc(arena, level.topology.vertex_count, 3 * sizeof *offsets);
  if (status == TW_OK && !offsets) status = TW_NO_MEMORY;
  for (uint32_t v = 0; status == TW_OK && v < level.topology.vertex_count; v++) {
    const tw_topology *t = &level.topology;
    const float *wanted =
        refined->positions + 3 * (size_t)refined->corners[corners[t->fan_corners[t->fan_offsets[v]]]];
    double by[3];
    for (size_t c = 0; c < 3; c++) by[c] = (double)wanted[c] - level.positions[3 * (size_t)v + c];
    if (!tw_detail_move(frames, v, by, offsets + 3 * (size_t)v))
      status = tw_fail(error, TW_INVALID, "a point is too far from the surface of the cage");
  }
  if (status == TW_OK) {
    *detail = (tw_detail){options->level, level.topology.vertex_count, offsets};
    cage->details = detail;
    cage->detail_count = 1;
  }
  tw_arena_destroy(scratch);
  return status;
}
