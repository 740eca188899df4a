/* The faces round features (vertices that the loops of shallow_levels.h get wrong, and what UV seams split)
 * are cut out of the cage as a mesh of their own, the feature mesh, for the points and for each UV set.
 * Generic steps refine it. After each step it is cut back to the faces round vertices that are still
 * features, so that the cost is in proportion to the length of borders, creases and seams. Only features have
 * all of their faces in the feature mesh; masks of its other vertices would be wrong and are not used. */
#ifndef TWEEND_FEATURE_MESH_H
#define TWEEND_FEATURE_MESH_H

#include "array.h"
#include "refine.h"
#include "shallow_levels.h"

/* A feature mesh, with the numbers that its vertices, edges and corners have in the whole level. */
typedef struct tw_feature_mesh {
  tw_topology fields[TW_FIELDS_MAX];
  uint32_t *vertices[TW_FIELDS_MAX]; /* [vertices of the field] */
  /* [edges of the field] 2 x edge, + 1 where the level's edge runs the other way. */
  uint32_t *edges[TW_FIELDS_MAX];
  uint32_t *corners; /* [corners] */
  /* [vertices of the field] the loops get the vertex wrong; meaningful where its point is a feature. */
  uint8_t *exceptional[TW_FIELDS_MAX];
  /* [vertices of the points] the point is exceptional in some field, or its faces have several tangent
   * frames. */
  uint8_t *is_feature;
  uint8_t *frames; /* [faces] tangent frames; NULL: no tangents */
} tw_feature_mesh;

/* The listing of exceptions. */
typedef struct tw_exceptions {
  const tw_shallow_inputs *inputs;
  tw_arena *arena; /* memory of the plan */
  tw_arena *scratch;
  tw_shallow *levels;
  tw_shallow_rows *rows;
} tw_exceptions;

/* The rules of a field. */
tw_rules tw_exceptions_rules(const tw_exceptions *l, uint32_t field);

bool tw_is_exceptional_edge(const tw_topology *t, uint32_t edge);

/* Marks features: points that are exceptional in some field, or whose faces have different tangent frames.
 * Where a seam splits a point, its values in the UV set have a border and so are exceptional. candidates:
 * [vertices] points that can be features; NULL: all. TW_NO_MEMORY. */
tw_status tw_feature_mesh_mark(const tw_exceptions *l, tw_feature_mesh *s, const uint8_t *candidates);

/* About how many bytes listing the exceptions takes. It chooses the evaluator, and is no limit: the meter
 * counts what is taken. */
uint64_t tw_exceptions_size(const tw_exceptions *l, const tw_feature_mesh *cage);

/* Cuts the faces round features out of `s`, which may be the cage. TW_NO_MEMORY. */
tw_status tw_feature_mesh_cut(const tw_exceptions *l, const tw_feature_mesh *s, tw_feature_mesh *out);

/* Refines a feature mesh by one step. TW_NO_MEMORY. */
tw_status tw_feature_mesh_refine(const tw_exceptions *l, const tw_feature_mesh *s, uint32_t step,
                                 tw_feature_mesh *out);

/* The number in the whole level of a feature mesh's vertex: a vertex of the step's own level, or a face point
 * of the next. */
uint32_t tw_feature_mesh_share(const tw_exceptions *l, const tw_feature_mesh *s, uint32_t field,
                               uint32_t step, uint32_t v);

/* Room for the largest limit mask at a feature, of any field; for tw_free. NULL without memory. */
tw_limit_entry *tw_feature_mask_room(const tw_exceptions *l, const tw_feature_mesh *s);

/* Appends the nonzero entries of a corner's limit mask, of its tangents or of its position. */
void tw_push_limit_entries(const tw_exceptions *l, const tw_feature_mesh *s, uint32_t field, uint32_t corner,
                           bool tangents, tw_last_mask *mask, tw_list *out);

#endif
