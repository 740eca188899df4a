/* The seam between surfaces and what computes their rows and faces.
 *
 * An evaluator gives the columns of a block of rows: points and normals, values, slopes, influences. Which
 * columns a row has, and where they stand, is for surface_assembly.c alone. A surface uses one evaluator,
 * which surface_choose.c takes from its table. An evaluator is a file with a `tw_evaluator`, and a line in
 * that table. */
#ifndef TWEEND_EVALUATOR_H
#define TWEEND_EVALUATOR_H

#include "surface.h"

struct tw_surface_builder;

/* A run of rows that a reader computes at once: `count` rows from number `first` on. */
typedef enum tw_piece_kind { TW_PIECE_CORNERS, TW_PIECE_EDGES, TW_PIECE_QUADS, TW_PIECE_LINES } tw_piece_kind;
typedef struct tw_piece {
  tw_piece_kind kind;
  uint64_t first;
  uint32_t count;
  uint32_t item, items; /* the first corner, edge or visible quad, and how many */
  uint32_t line;        /* of TW_PIECE_LINES: the first line, counted inside the quad */
} tw_piece;

/* Part of a patch's grid. backwards: the points come in the opposite order, from the last to the first. */
typedef struct tw_patch_place {
  uint32_t quad;
  tw_patch_rect rect;
  bool backwards;
} tw_patch_place;

/* Rows that are assembled at once. All but the first two are the evaluator's own. */
typedef struct tw_block {
  uint32_t first, count; /* rows, as many as a piece has at most; `first` is set for rows of corners alone */
  /* Of patches and triangles: where the rows are, and the place that represents their points. */
  tw_patch_place own, shared;
  const uint32_t *corners; /* of steps: [count] the corner of the base that represents each row */
  /* Of shallow levels: the rows' vertices in each field, and the listed rows among them. */
  uint32_t (*vertices)[TW_BLOCK_ROWS];
  uint32_t listed, listed_end;
} tw_block;

struct tw_evaluator {
  /* ---- making a surface ---- */

  /* Whether the evaluator can compute the surface and is worth it. The cage, its counts and the surface's
   * options, rules and details are known. */
  bool (*fits)(const struct tw_surface_builder *b);
  /* Sets the generic steps from the cage to the base, and the depth of patches. TW_LIMIT. */
  tw_status (*start)(struct tw_surface_builder *b, tw_error *error);
  /* Takes what it needs of the base before rows are numbered; or NULL. */
  void (*take_base)(struct tw_surface_builder *b);
  /* Makes the rest of the plan. TW_LIMIT: with b->declined the next evaluator of the table is tried; without
   * it there can be no such surface. TW_NO_MEMORY, TW_CANCELLED. */
  tw_status (*make)(struct tw_surface_builder *b, tw_error *error);
  /* Computes what positions are read from. base: positions at the base, which may be taken (then *base is
   * NULL). TW_NO_MEMORY, TW_CANCELLED. */
  tw_status (*place)(tw_surface *s, double **base, const tw_parallel_for *parallel);
  /* Whether rows follow from the base's topologies and values, which are kept then and numbered by
   * tw_builder_number; false: `make` numbers the rows. */
  bool reads_base;
  uint32_t levels_below; /* levels from the last generic step to the rows that `fields[0].base` counts */

  /* ---- reading rows ---- */

  /* Cuts a piece into blocks, and has each assembled (surface_reader.h). Edges, quads and lines come with a
   * depth alone. */
  void (*read)(tw_surface_reader *r, tw_domain domain, const tw_piece *piece, float *out);
  /* The columns of a block; rows are `stride` floats apart. normals: NULL where not wanted. `values`,
   * `slopes` (for tangents) and `influences` are NULL where `fits` declines all surfaces that have such
   * columns. */
  void (*points)(tw_surface_reader *r, const tw_block *block, float *out, float *normals, uint32_t stride);
  void (*values)(tw_surface_reader *r, const tw_values *values, const tw_block *block, float *out,
                 uint32_t stride);
  /* Writes r->slopes, the derivatives of points and of the UV set of each row's tangent frame, and
   * r->frames. */
  void (*slopes)(tw_surface_reader *r, const tw_block *block);
  /* Joints and weights. row: the first row. */
  void (*influences)(tw_surface_reader *r, const tw_block *block, float *row);

  /* Widens a box (its low and its high corner) by points of which all points of a visible face of the base
   * are convex combinations, so that bounds need not read most rows; with a depth alone. NULL: none are
   * known. */
  void (*widen_box)(const tw_surface *s, uint32_t face, tw_point box[2]);

  /* ---- reading faces ---- */

  /* The vertices of faces [first, first + count). The level is 1 or more, so all faces have the same size.
   * Each keeps its winding, and begins with any corner. */
  void (*faces)(const tw_surface *s, tw_domain domain, uint64_t first, size_t count, uint32_t *out);
  /* The row of a corner of a face that steps make of a visible face of the base. child: the face's number
   * among those that come of that face, as generic steps number them. NULL: points and vertices have the same
   * numbers. */
  uint32_t (*row_of_child)(const tw_surface *s, const tw_numbering *n, uint32_t visible, uint32_t child,
                           uint32_t corner);
};

extern const tw_evaluator tw_shallow_evaluator, tw_patch_evaluator, tw_triangle_evaluator, tw_loop_evaluator,
    tw_steps_evaluator;

#endif
