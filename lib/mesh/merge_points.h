/* Merges points of a mesh, in place. */
#ifndef TWEEND_MERGE_POINTS_H
#define TWEEND_MERGE_POINTS_H

#include "weld.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Behind tw_merged.faces in a warning. */
#define TW_WELD_DROPPED_FACE  TW_COLLAPSED_FACE ": welding brings its corners together"
#define TW_WELD_DROPPED_FACES TW_COLLAPSED_FACES ": welding brings their corners together"

/* What a merge removed. */
typedef struct tw_merged {
  uint32_t points;    /* merged into another point */
  uint32_t faces;     /* dropped: fewer than three different points were left */
  uint32_t shortened; /* faces that stay without corners whose points became one with the corner's before */
  uint32_t bent; /* of tw_mesh_merge_within: points that moved otherwise than the point which they became */
} tw_merged;

/* Gives attributes of points values of corners where they differ at points that become one. point_of:
 * [point_count] the points with one number become one; numbers are below `count`. Arrays live in the arena.
 * parted: [attribute_count] receives which attributes these are. TW_NO_MEMORY: the mesh is unchanged. */
tw_status tw_mesh_part_attributes(tw_mesh *mesh, const uint32_t *point_of, uint32_t count, tw_arena *arena,
                                  bool *parted, tw_error *error);

/* Joins border edges of a checked mesh as tw_weld_points does, and drops the faces that it leaves out.
 * Nothing else may refer to the mesh yet, and it must have no tags on edges, points or faces. Attributes that
 * differ at points which become one get values of corners, whose arrays live in the arena; equal texture
 * coordinates become one value. Points that only faces left out had go with them. out->faces counts the
 * collapsed ones alone; warning about what `welded` tells is the caller's task. O(n log n) at worst.
 * TW_NO_MEMORY: the mesh is unchanged. */
tw_status tw_mesh_close_seams(tw_mesh *mesh, tw_arena *arena, tw_merged *out, tw_welded *welded,
                              tw_error *error);

/* Removes the points that have lost their faces. had_face: [point_count] not 0 for each point that had a
 * face; receives the new index of each point, UINT32_MAX for those removed. Points with tags stay. The mesh's
 * arrays are written to. O(points + corners). */
void tw_mesh_drop_points(tw_mesh *mesh, uint32_t *had_face);

/* Whether a channel of the mesh has a seam between equal values: two values at a point that
 * tw_mesh_close_seams makes one. O(corners + n log n) with n corners at seams. TW_NO_MEMORY. */
tw_status tw_mesh_has_equal_seams(const tw_mesh *mesh, const tw_channel *channel, bool *out);

/* Whether two points have the same joints, weights and displacements. */
bool tw_mesh_points_move_alike(const tw_mesh *mesh, uint32_t a, uint32_t b);

/* Merges points within a distance of each other as tw_weld_within does; 0 merges points at the same place.
 * Tags follow their points and faces; attributes and texture coordinates as in tw_mesh_close_seams, but equal
 * ones become one only at points that several old points become. */
tw_status tw_mesh_merge_within(tw_mesh *mesh, double distance, tw_arena *arena, tw_merged *out,
                               tw_error *error);

#ifdef __cplusplus
}
#endif
#endif
