/* The parts of a reader: scratch memory, and what evaluators need to read rows. */
#ifndef TWEEND_SURFACE_READER_H
#define TWEEND_SURFACE_READER_H

#include "evaluator.h"
#include "limit.h"
#include "surface.h"
#include "tangent_space.h"

enum { TW_MOVED_WIDTH = 6 }; /* positions and normals */

/* What quads of which some may be concave are looked at with. */
enum { TW_QUADS_AT_ONCE = 512 };
typedef struct tw_quad_scratch {
  uint32_t corners[4 * TW_QUADS_AT_ONCE]; /* rows */
  uint32_t same[4 * TW_QUADS_AT_ONCE];    /* the first corner that has the row */
  uint64_t keys[4 * TW_QUADS_AT_ONCE], spare[4 * TW_QUADS_AT_ONCE];
  float points[4 * TW_QUADS_AT_ONCE][3];
  const float *at[4 * TW_QUADS_AT_ONCE];
} tw_quad_scratch;

struct tw_surface_reader {
  /* What rows are computed from: `chosen`, or &narrowed where not all of its columns are wanted. */
  const tw_surface *surface;
  tw_surface narrowed, narrowed_rim;
  const tw_surface *chosen; /* the surface that the caller chose */
  uint32_t first_target, target_count;
  bool points_alone;
  bool is_unsplit; /* rows are of points, with `columns` */
  tw_point_columns columns;
  double *scratch; /* for patches */
  tw_last_mask mask;
  float *slopes[2]; /* derivatives of points and of UVs, [piece_capacity][TW_DERIVATIVE_WIDTH] */
  uint8_t *frames;  /* [piece_capacity] tangent frames */
  tw_skin_scratch skin;
  tw_quad_scratch *quads; /* NULL where no surface has concave ones */
  /* Cache of the last piece that was asked for in part. */
  float *piece; /* [piece_capacity][stride] */
  float *moved; /* [piece_capacity][TW_MOVED_WIDTH] of the surface that a morph target makes */
  tw_domain piece_domain;
  uint64_t piece_first;
  uint32_t piece_count, piece_capacity;
};

static inline const tw_numbering *tw_numbering_of(const tw_surface *s, tw_domain domain) {
  if (domain == TW_DOMAIN_POINTS) return &s->points;
  return domain == TW_DOMAIN_UVS ? &s->uv_points : &s->vertices;
}

/* Floats in a row of a domain. */
static inline uint32_t tw_row_width(const tw_surface *s, tw_domain domain) {
  if (domain == TW_DOMAIN_POINTS) return 3;
  return domain == TW_DOMAIN_UVS ? 2 : s->layout.stride;
}

/* Whether rows hold more than the point and the normal. */
static inline bool tw_has_attributes(const tw_surface *s, tw_domain domain) {
  return domain == TW_DOMAIN_VERTICES && s->layout.stride > (s->layout.normal != UINT32_MAX ? 6 : 3);
}

/* The joints and weights of rows that begin at `row`. */
static inline tw_skin_columns tw_skin_columns_of(const tw_surface *s, float *row) {
  const tw_surface_layout *l = &s->layout;
  return (tw_skin_columns){row + l->joints, row + l->weights, l->influences, l->stride};
}

/* Whether rows of a domain can share their point with other rows. */
static inline bool tw_is_split(const tw_surface *s, tw_domain domain) {
  return domain == TW_DOMAIN_VERTICES &&
         (s->vertices.same_as != s->points.same_as || s->vertices.corner_row != s->points.corner_row);
}

/* The corner that represents the points of a corner, or with `edges` of the edge that begins there: all split
 * vertices take their points from there, so that these are the same to the last bit. *against: that corner's
 * edge runs against this one. */
static inline uint32_t tw_shared_corner(const tw_surface *s, bool edges, uint32_t corner, bool *against) {
  const tw_numbering *n = &s->points;
  *against = false;
  if (!edges) return tw_corner_of_row(n, tw_row_of_corner(n, corner));
  uint32_t edge = tw_row_of_edge(n, corner);
  *against = edge & 1;
  return tw_corner_of_edge(n, edge / 2);
}

static inline tw_slope_source tw_slopes_of(const tw_surface *s, const tw_values *values) {
  const tw_field *field = &s->fields[values->field];
  return (tw_slope_source){&field->base, &field->patches, field->linear, values->base, values->width};
}

/* Rows of a domain but for those of the rim. */
uint64_t tw_own_row_count(const tw_surface *s, tw_domain domain);

static inline uint64_t tw_rows_inside_edge(const tw_surface *s) {
  return s->side - 1;
}

/* Of a face of the base: a quad or a triangle. */
static inline uint64_t tw_rows_inside_face(const tw_surface *s) {
  uint64_t inside = s->side - 1;
  return s->fields[0].base.face_size == 3 ? inside * (inside - 1) / 2 : inside * inside;
}

/* As tw_surface_reader_turn, for rows of the position alone or, where `target` is 0 or more, of the position
 * and that target's displacement of it. */
void tw_turn_to_points(tw_surface_reader *reader, const tw_surface *surface, int target);

/* Assembles the rows of a block: has the surface's evaluator compute every column that they have. First the
 * points and the normals or, where rows are of UVs, these; then all else, also in smaller blocks. */
void tw_assemble_points(tw_surface_reader *reader, tw_domain domain, const tw_block *block, float *out);
void tw_assemble_attributes(tw_surface_reader *reader, tw_domain domain, const tw_block *block, float *out);
void tw_assemble_rows(tw_surface_reader *reader, tw_domain domain, const tw_block *block, float *out);

/* Computes the rows of a piece. */
void tw_read_piece(tw_surface_reader *reader, tw_domain domain, const tw_piece *piece, float *out);

/* Takes columns away from `s`, the copy of a surface that is read. target_count 0: all displacements. Else
 * everything but the points, the normals (also taken away with points_alone) and the displacements of the
 * targets from first_target on. */
void tw_narrow_rows(tw_surface *s, uint32_t first_target, uint32_t target_count, bool points_alone);

/* Takes all columns but these away from `s`, the copy of a surface, whose rows are its points' from then
 * on. */
void tw_unsplit_rows(tw_surface *s, const tw_point_columns *columns);

/* The stride of the layout with that many morph targets. */
uint32_t tw_stride_with(const tw_surface_layout *layout, uint32_t targets);

/* As tw_evaluator.faces of the quads of patches, and as its row_of_child. */
void tw_patch_faces(const tw_surface *s, tw_domain domain, uint64_t first, size_t count, uint32_t *out);
uint32_t tw_patch_row_of_child(const tw_surface *s, const tw_numbering *n, uint32_t visible, uint32_t child,
                               uint32_t corner);

#endif
