/* Inside of a reader: scratch memory, the rows of whole items, and the columns that are made of more than one
 * field. */
#ifndef TWEEND_SURFACE_READER_H
#define TWEEND_SURFACE_READER_H

#include "limit.h"
#include "surface.h"
#include "tangent_space.h"

struct tw_surface_reader {
  const tw_surface *surface; /* `narrowed` where rows do not hold all morph targets */
  tw_surface narrowed;
  const tw_surface *whole; /* the caller's */
  uint32_t first_target, target_count;
  bool points_alone;
  double *scratch; /* of patches */
  tw_limit_entry *mask;
  float *slopes[2]; /* derivatives of points and of UVs, [piece_capacity][TW_DERIVATIVE_WIDTH] */
  tw_skin_scratch skin;
  /* The last piece that was asked for in part. */
  float *piece; /* [piece_capacity][stride] */
  float *moved; /* [piece_capacity][6]: positions and normals that a morph target makes */
  tw_domain piece_domain;
  uint64_t piece_first;
  uint32_t piece_count, piece_capacity;
};

/* Of a domain's rows. */
static inline const tw_numbering *tw_numbering_of(const tw_surface *s, tw_domain domain) {
  if (domain == TW_DOMAIN_POINTS) return &s->points;
  return domain == TW_DOMAIN_UVS ? &s->uv_points : &s->vertices;
}

/* Floats of a domain's row. */
static inline uint32_t tw_row_width(const tw_surface *s, tw_domain domain) {
  if (domain == TW_DOMAIN_POINTS) return 3;
  return domain == TW_DOMAIN_UVS ? 2 : s->layout.stride;
}

static inline uint64_t tw_rows_inside_edge(const tw_surface *s) {
  return s->side - 1;
}

static inline uint64_t tw_rows_inside_quad(const tw_surface *s) {
  return (uint64_t)(s->side - 1) * (s->side - 1);
}

/* As tw_surface_reader_turn, to rows of the position, and of one target's displacement of it unless `target`
 * is negative. */
void tw_turn_to_points(tw_surface_reader *reader, const tw_surface *surface, int target);

/* A vertex that no patch covers, at a base corner: its value or limit, and its normal; each NULL where it is
 * not wanted. */
void tw_corner_by_mask(tw_surface_reader *reader, const tw_values *values, uint32_t corner, float *out,
                       float *normal);

#endif
