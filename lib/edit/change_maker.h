/* The state of a change while its new mesh is made, and what change.c and change_values.c share. */
#ifndef TWEEND_CHANGE_MAKER_H
#define TWEEND_CHANGE_MAKER_H

#include <math.h>

#include "editor.h"

typedef struct tw_change_maker {
  const tw_change *change;
  const tw_mesh *from;
  tw_mesh *to;
  tw_arena *arena;
  const tw_editor *editor;
} tw_change_maker;

static inline uint32_t tw_corner_behind(const tw_change *c, uint32_t face, uint32_t corner) {
  return corner + 1 < c->face_offsets[face + 1] ? corner + 1 : c->face_offsets[face];
}

/* The terms of a parent. before: the count of old points or corners. single: room for the term of a parent
 * that is not a mix. */
static inline const tw_term *tw_terms_of(const tw_change *c, uint32_t parent, uint32_t before,
                                         tw_term *single, uint32_t *count) {
  if (parent < before) {
    *single = (tw_term){parent, 1};
    *count = 1;
    return single;
  }
  const uint32_t *offsets = c->mix_offsets + (parent - before);
  *count = offsets[1] - offsets[0];
  return c->terms + offsets[0];
}

/* Clamps to the coordinate limit: a weighted mean may lie outside its terms. */
static inline float tw_within_limits(double value) {
  return (float)fmax(-(double)TW_COORDINATE_MAX, fmin(value, (double)TW_COORDINATE_MAX));
}

/* The term of the greatest weight, the first of equal ones. */
static inline const tw_term *tw_heaviest_term(const tw_term *terms, uint32_t count) {
  const tw_term *out = terms;
  for (uint32_t i = 1; i < count; i++)
    if (terms[i].weight > out->weight) out = &terms[i];
  return out;
}

/* Makes the values of corners, where the mesh that is made has points, faces and attributes already
 * (change_values.c). False without memory. */
bool tw_change_make_channels(const tw_change_maker *m);

#endif
