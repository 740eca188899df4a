/* Patches of the base's quads. Rows are at corners, along the insides of edges, over the insides of quads. */
#include <string.h>

#include "patch.h"
#include "patch_stencils.h"
#include "surface_plan.h"
#include "surface_reader.h"

/* ---- the plan ------------------------------------------------------------------------------- */

/* Generic steps from the cage to quads. */
static uint32_t steps_to_base(const tw_surface_builder *b, bool cage_is_base) {
  uint32_t level = b->surface->options.level, deepest = tw_deepest_detail(&b->surface->details),
           levels = level > 0 && level <= deepest ? level
                    : cage_is_base                ? 0
                                                  : 1;
  return deepest < level && deepest > levels ? deepest : levels;
}

static bool fits(const tw_surface_builder *b) {
  if (b->surface->rules.loop || (tw_builder_shrinks(b) && !tw_rim_is_worth_it(b))) return false;
  uint32_t level = b->surface->options.level;
  bool cage_is_base = tw_builder_cage_is_base(b), few = !cage_is_base && level <= 1;
  if (b->cage.refined_faces <= TW_GENERIC_FACES_MAX && (few || tw_builder_crosses_seams(b))) return false;
  return level > steps_to_base(b, cage_is_base);
}

static tw_status start(tw_surface_builder *b, tw_error *error) {
  (void)error;
  b->levels = steps_to_base(b, tw_builder_cage_is_base(b));
  b->surface->depth = b->surface->options.level - b->levels;
  return TW_OK;
}

/* The cache of patch classes to use; NULL without memory. */
static tw_patch_classes *classes_of(tw_surface *s) {
  if (s->options.classes) return s->options.classes;
  if (!s->classes) s->classes = tw_patch_classes_create();
  return s->classes;
}

static tw_status make(tw_surface_builder *b, tw_error *error) {
  (void)error;
  tw_surface *s = b->surface;
  tw_patch_classes *classes = classes_of(s);
  if (!classes) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < s->field_count; f++) {
    tw_field *field = &s->fields[f];
    tw_rules rules = tw_builder_rules(b, f);
    tw_status status =
        tw_patches_create(&field->patches, &field->base, &rules, s->depth, classes, b->parallel);
    if (status == TW_OK)
      status = tw_patches_sum(&field->patches, classes, s->options.limit, s->options.normals && f == 0);
    b->declined = status == TW_LIMIT;
    if (status != TW_OK) return status;
    if (field->patches.scratch_points > s->scratch_points) s->scratch_points = field->patches.scratch_points;
  }
  return TW_OK;
}

/* ---- values --------------------------------------------------------------------------------- */

static tw_patch_job job_for(const tw_surface_reader *r, const tw_values *values, float *out, float *normals,
                            uint32_t stride) {
  return (tw_patch_job){.in = values->base,
                        .width = values->width,
                        .limit = r->surface->options.limit,
                        .values = out,
                        .normals = normals,
                        .stride = stride,
                        .scratch = r->scratch};
}

/* Computes values and normals. out, normals: NULL where not wanted. */
static void evaluate(const tw_surface_reader *r, const tw_values *values, const tw_patch_place *at,
                     float *out, float *normals, uint32_t stride) {
  if (values->at_corners) {
    tw_nearest_values(r->surface, values, at->quad, at->rect, at->backwards, out, stride);
    return;
  }
  tw_patch_job job = job_for(r, values, out, normals, stride);
  job.backwards = at->backwards;
  tw_patch_evaluate(&r->surface->fields[values->field].patches, at->quad, &job, at->rect);
}

/* Points come from the place that represents them, normals from the rows' own place. */
static void points(tw_surface_reader *r, const tw_block *block, float *out, float *normals, uint32_t stride) {
  const tw_patch_place *own = &block->own, *shared = &block->shared;
  const tw_values *positions = &r->surface->positions;
  bool apart = own->quad != shared->quad || own->backwards != shared->backwards ||
               memcmp(&own->rect, &shared->rect, sizeof own->rect) != 0;
  evaluate(r, positions, shared, out, apart ? NULL : normals, stride);
  if (apart && normals) evaluate(r, positions, own, NULL, normals, stride);
}

/* Values of points are shared by the rows of a point. */
static void values(tw_surface_reader *r, const tw_values *values, const tw_block *block, float *out,
                   uint32_t stride) {
  evaluate(r, values, values->field > 0 ? &block->own : &block->shared, out, NULL, stride);
}

static void slopes(tw_surface_reader *r, const tw_block *block) {
  const tw_surface *s = r->surface;
  const tw_patch_place *at = &block->own;
  uint8_t frame = s->tangent_frames[at->quad];
  const tw_slope_source points = tw_slopes_of(s, &s->positions), uvs = tw_slopes_of(s, &s->uvs[frame / 2]);
  tw_patch_slopes(&points, at->quad, at->rect, at->backwards, r->scratch, r->slopes[0]);
  tw_patch_slopes(&uvs, at->quad, at->rect, at->backwards, r->scratch, r->slopes[1]);
  memset(r->frames, frame, block->count);
}

static void influences(tw_surface_reader *r, const tw_block *block, float *row) {
  const tw_surface *s = r->surface;
  const tw_patch_place *at = &block->shared;
  const tw_skin_patch patch = {&s->influences,   &s->fields[0].patches, at->quad,  at->rect,
                               s->options.limit, at->backwards,         r->scratch};
  tw_skin_patch_rows(&patch, &r->skin, tw_skin_columns_of(s, row));
}

/* ---- corners and edges ---------------------------------------------------------------------- */

/* The base corner that represents a corner or an edge of the numbering. */
static uint32_t corner_of(const tw_numbering *n, bool edges, uint32_t item) {
  return edges ? tw_corner_of_edge(n, item) : tw_corner_of_row(n, item);
}

/* The place of a corner, or of the inside of the edge that begins there. against: the edge runs in the
 * opposite direction. */
static tw_patch_place place_at(const tw_surface *s, bool edges, uint32_t corner, bool against) {
  tw_patch_place at = {corner / 4, {0}, false};
  if (!edges) {
    at.rect = tw_patch_corner(s->side, corner % 4);
  } else {
    at.rect = tw_patch_side(s->side, corner % 4, &at.backwards);
    at.backwards = at.backwards != against;
  }
  return at;
}

static void read_items(tw_surface_reader *r, tw_domain domain, bool edges, const tw_piece *piece,
                       float *out) {
  const tw_surface *s = r->surface;
  const tw_numbering *n = tw_numbering_of(s, domain);
  uint32_t rows = edges ? (uint32_t)tw_rows_inside_edge(s) : 1;
  bool split = tw_is_split(s, domain), against = false;
  size_t step = (size_t)tw_row_width(s, domain) * rows;
  for (uint32_t i = 0; i < piece->items; i++, out += step) {
    uint32_t corner = corner_of(n, edges, piece->item + i), shared = corner;
    tw_block block = {.first = piece->item + i, .count = rows, .own = place_at(s, edges, corner, false)};
    if (split) shared = tw_shared_corner(s, edges, corner, &against);
    block.shared = shared != corner || against ? place_at(s, edges, shared, against) : block.own;
    tw_assemble_rows(r, domain, &block, out);
  }
}

/* ---- insides of quads ----------------------------------------------------------------------- */

/* Computes lines j0 to j1 of the inside of a visible quad. */
static void read_lines(tw_surface_reader *r, tw_domain domain, uint32_t visible, uint32_t j0, uint32_t j1,
                       float *out) {
  const tw_surface *s = r->surface;
  const tw_patch_place at = {tw_base_quad(s, visible), {1, s->side - 1, j0, j1}, false};
  const tw_block block = {.count = (s->side - 1) * (j1 - j0 + 1), .own = at, .shared = at};
  tw_assemble_rows(r, domain, &block, out);
}

static void read(tw_surface_reader *r, tw_domain domain, const tw_piece *piece, float *out) {
  const tw_surface *s = r->surface;
  uint32_t last_line = s->side - 1;
  size_t size = tw_rows_inside_face(s) * tw_row_width(s, domain);
  switch (piece->kind) {
  case TW_PIECE_CORNERS: read_items(r, domain, false, piece, out); return;
  case TW_PIECE_EDGES: read_items(r, domain, true, piece, out); return;
  case TW_PIECE_QUADS:
    for (uint32_t i = 0; i < piece->items; i++)
      read_lines(r, domain, piece->item + i, 1, last_line, out + i * size);
    return;
  case TW_PIECE_LINES:
    read_lines(r, domain, piece->item, 1 + piece->line, piece->line + piece->count / last_line, out);
    return;
  }
}

static void widen_box(const tw_surface *s, uint32_t face, tw_point box[2]) {
  uint32_t count;
  const uint32_t *controls = tw_patch_controls(&s->fields[0].patches, face, &count);
  const float *at = s->positions.base;
  for (uint32_t i = 0; i < count; i++) tw_box_widen(box, tw_load_values(at + 3 * (size_t)controls[i], 3));
}

const tw_evaluator tw_patch_evaluator = {.fits = fits,
                                         .start = start,
                                         .make = make,
                                         .place = tw_surface_keep_base,
                                         .reads_base = true,
                                         .read = read,
                                         .points = points,
                                         .values = values,
                                         .slopes = slopes,
                                         .influences = influences,
                                         .widen_box = widen_box,
                                         .faces = tw_patch_faces,
                                         .row_of_child = tw_patch_row_of_child};
