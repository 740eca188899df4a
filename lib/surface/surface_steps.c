/* Generic steps to the answer's level: rows are values at vertices of the base, and normals by its limit
 * masks. Every surface that is small enough can be made so. */
#include <string.h>

#include "normal.h"
#include "surface_plan.h"
#include "surface_reader.h"

/* ---- the plan -------------------------------------------------------------------------------- */

static bool fits(const tw_surface_builder *b) {
  (void)b;
  return true;
}

/* Whether no row needs a mask: all values are the cage's own, normals too. */
static bool needs_no_masks(const tw_surface_builder *b) {
  const tw_surface_options *options = &b->surface->options;
  return options->level == 0 && !options->limit && !options->movable && b->surface->details.count == 0 &&
         !tw_builder_has_tangents(b) && (!options->normals || tw_has_all_normals(b->mesh, options));
}

static tw_status start(tw_surface_builder *b, tw_error *error) {
  uint32_t level = b->surface->options.level;
  (void)error;
  b->surface->is_unmasked = needs_no_masks(b);
  b->levels = level;
  if (level > 0 || b->surface->is_unmasked || tw_builder_cage_is_base(b)) return TW_OK;
  bool folds = !b->surface->rules.smooth_triangles && !tw_limit_decays(&b->cage.topology);
  b->levels = folds ? 0 : 1;
  b->cage.topology.polygonal = folds;
  return TW_OK;
}

/* Refuses rows that would take too long to read. A row has a mask for its normal, two for its tangent, one
 * for each value at the limit, and one on the surface of each target that displaces normals. */
static tw_status make(tw_surface_builder *b, tw_error *error) {
  tw_surface *s = b->surface;
  if (s->is_unmasked) return TW_OK;
  for (uint32_t f = 0; f < s->field_count; f++) tw_builder_need_masks(s, &s->fields[f].base);
  uint32_t masks = (s->options.normals || s->options.limit ? 1u : 0u) + (s->tangent_frames ? 2u : 0u);
  if (s->options.limit) masks += b->mesh->uv_set_count + tw_smooth_set_count(s) + 1;
  if (b->morph_normals) masks += s->morph_count;
  bool is_quick = masks == 0 || tw_is_quickly_read(&s->fields[0].base, &s->vertices, masks);
  return is_quick ? TW_OK : tw_builder_fail_fans(error);
}

/* ---- values ---------------------------------------------------------------------------------- */

static inline double base_value(const tw_values *values, uint32_t vertex, uint32_t width,
                                uint32_t component) {
  size_t place = (size_t)vertex * width + component;
  return values->exact ? values->exact[place] : (double)values->base[place];
}

/* What a mask gives: the limit, relative to the vertex's own value, and two tangents. */
typedef struct mask_sums {
  double limit[4], tangents[2][4];
} mask_sums;

/* Masks sum to 1 (position) and 0 (tangents): differences from the vertex itself keep large terms from
 * cancelling. */
static inline __attribute__((always_inline)) void sum_mask(const tw_limit_entry *entries, uint32_t count,
                                                           const tw_values *values, uint32_t vertex,
                                                           uint32_t width, mask_sums *out) {
  double own[4];
  for (uint32_t c = 0; c < width; c++) own[c] = base_value(values, vertex, width, c);
  *out = (mask_sums){{0}, {{0}, {0}}};
  for (const tw_limit_entry *e = entries; e < entries + count; e++)
    for (uint32_t c = 0; c < width; c++) {
      double offset = base_value(values, e->vertex, width, c) - own[c];
      out->limit[c] += (double)e->position * offset;
      out->tangents[0][c] += (double)e->tangent1 * offset;
      out->tangents[1][c] += (double)e->tangent2 * offset;
    }
}

/* The vertices of a quad, or of a triangle with its last corner twice: the corner's face or, where that is
 * larger, the corner and those beside it. */
static void quad_of_face(const tw_topology *base, uint32_t corner, uint32_t out[4]) {
  uint32_t face = tw_corner_face(base, corner), size = tw_face_size(base, face),
           before = tw_corner_previous(base, corner),
           at[4] = {corner, tw_corner_next(base, corner), before, before};
  for (uint32_t k = 0; k < 4; k++) {
    if (size <= 4) at[k] = tw_face_begin(base, face) + (k < size ? k : size - 1);
    out[k] = base->corner_vertex[at[k]];
  }
}

static void apply_limit_mask(tw_surface_reader *r, const tw_values *values, uint32_t corner, float *out,
                             float *normal) {
  const tw_surface *s = r->surface;
  const tw_field *field = &s->fields[values->field];
  const tw_topology *base = &field->base;
  uint32_t vertex = base->corner_vertex[corner], width = values->width;
  uint32_t count = tw_limit_mask_after(&r->mask, base, field->linear, corner);
  mask_sums sums;
  if (width == 3) /* points; a known width lets the compiler unroll */
    sum_mask(r->mask.entries, count, values, vertex, 3, &sums);
  else
    sum_mask(r->mask.entries, count, values, vertex, width, &sums);
  for (uint32_t c = 0; out && s->options.limit && c < width; c++)
    out[c] = (float)(base_value(values, vertex, width, c) + sums.limit[c]);
  if (!normal) return;
  tw_point along[2] = {{0}, {0}}, quad[4];
  uint32_t vertices[4];
  for (int k = 0; k < 2; k++)
    for (int c = 0; c < 3; c++) along[k][c] = (float)sums.tangents[k][c];
  quad_of_face(base, corner, vertices);
  for (int k = 0; k < 4; k++) quad[k] = tw_load_values(values->base + (size_t)vertices[k] * width, width);
  tw_put_normal(along[0], along[1], quad, normal);
}

/* Computes a value and its normal. out, normal: NULL where not wanted. */
static void evaluate(tw_surface_reader *r, const tw_values *values, uint32_t corner, float *out,
                     float *normal) {
  const tw_surface *s = r->surface;
  uint32_t vertex = s->fields[values->field].base.corner_vertex[corner], width = values->width;
  if (values->at_corners) {
    memcpy(out, values->at_corners + (size_t)tw_nearest_corner(s, corner) * width, width * sizeof *out);
    return;
  }
  const float *at_level = s->options.level == 0 ? values->cage : values->base;
  if (out) memcpy(out, at_level + (size_t)vertex * width, width * sizeof *out);
  if (normal || s->options.limit) apply_limit_mask(r, values, corner, out, normal);
}

/* ---- columns --------------------------------------------------------------------------------- */

/* Split vertices have the same point to the last bit: all corners of a vertex have its weights. */
static void points(tw_surface_reader *r, const tw_block *block, float *out, float *normals, uint32_t stride) {
  if (r->surface->is_unmasked) normals = NULL; /* the mesh's own follow */
  for (size_t k = 0; k < block->count; k++, out += stride)
    evaluate(r, &r->surface->positions, block->corners[k], out, normals ? normals + k * stride : NULL);
}

static void values(tw_surface_reader *r, const tw_values *values, const tw_block *block, float *out,
                   uint32_t stride) {
  for (uint32_t k = 0; k < block->count; k++, out += stride)
    evaluate(r, values, block->corners[k], out, NULL);
}

static void slopes(tw_surface_reader *r, const tw_block *block) {
  const tw_surface *s = r->surface;
  for (uint32_t k = 0; k < block->count; k++) {
    uint32_t corner = block->corners[k], place = TW_DERIVATIVE_WIDTH * k;
    uint8_t frame = s->tangent_frames[tw_corner_face(&s->fields[0].base, corner)];
    const tw_slope_source points = tw_slopes_of(s, &s->positions), uvs = tw_slopes_of(s, &s->uvs[frame / 2]);
    tw_corner_slopes(&points, corner, &r->mask, r->slopes[0] + place);
    tw_corner_slopes(&uvs, corner, &r->mask, r->slopes[1] + place);
    r->frames[k] = frame;
  }
}

/* The vertex's own influences, or those by its limit mask. */
static void influences(tw_surface_reader *r, const tw_block *block, float *row) {
  const tw_surface *s = r->surface;
  const tw_field *field = &s->fields[0];
  const tw_influences *own = s->cage_influences.offsets ? &s->cage_influences : &s->influences;
  for (uint32_t k = 0; k < block->count; k++, row += s->layout.stride) {
    uint32_t corner = block->corners[k];
    if (s->options.limit) {
      uint32_t count = tw_limit_mask_after(&r->mask, &field->base, field->linear, corner);
      tw_skin_mask_row(&s->influences, r->mask.entries, count, &r->skin, tw_skin_columns_of(s, row));
    } else {
      const tw_limit_entry itself = {field->base.corner_vertex[corner], 1, 0, 0};
      tw_skin_mask_row(own, &itself, 1, &r->skin, tw_skin_columns_of(s, row));
    }
  }
}

/* ---- rows and faces -------------------------------------------------------------------------- */

/* Where attributes need masks, they are assembled row by row, so that those of a row share its mask. */
static void read_block(tw_surface_reader *r, tw_domain domain, const tw_block *block, float *out) {
  const tw_surface *s = r->surface;
  tw_assemble_points(r, domain, block, out);
  if (!tw_has_attributes(s, domain) || !(s->options.limit || s->tangent_frames)) {
    tw_assemble_attributes(r, domain, block, out);
    return;
  }
  for (uint32_t k = 0; k < block->count; k++, out += s->layout.stride) {
    const tw_block row = {.first = block->first + k, .count = 1, .corners = block->corners + k};
    tw_assemble_attributes(r, domain, &row, out);
  }
}

static void read(tw_surface_reader *r, tw_domain domain, const tw_piece *piece, float *out) {
  const tw_numbering *n = tw_numbering_of(r->surface, domain);
  uint32_t corners[TW_BLOCK_ROWS], width = tw_row_width(r->surface, domain);
  for (uint32_t taken, done = 0; done < piece->items; done += taken) {
    taken = piece->items - done < TW_BLOCK_ROWS ? piece->items - done : TW_BLOCK_ROWS;
    const tw_block block = {.first = piece->item + done, .count = taken, .corners = corners};
    for (uint32_t k = 0; k < taken; k++) corners[k] = tw_corner_of_row(n, block.first + k);
    read_block(r, domain, &block, out + (size_t)done * width);
  }
}

static void faces(const tw_surface *s, tw_domain domain, uint64_t first, size_t count, uint32_t *out) {
  const tw_numbering *n = tw_numbering_of(s, domain);
  uint32_t size = s->fields[0].base.face_size;
  for (size_t i = 0; i < count; i++) {
    uint32_t corner = size * tw_base_quad(s, (uint32_t)(first + i));
    for (uint32_t k = 0; k < size; k++) *out++ = tw_row_of_corner(n, corner + k);
  }
}

/* The base is the level itself. */
static uint32_t row_of_child(const tw_surface *s, const tw_numbering *n, uint32_t visible, uint32_t child,
                             uint32_t corner) {
  return tw_row_of_corner(n, s->fields[0].base.face_size * (tw_base_quad(s, visible) + child) + corner);
}

const tw_evaluator tw_steps_evaluator = {.fits = fits,
                                         .start = start,
                                         .make = make,
                                         .place = tw_surface_keep_base,
                                         .reads_base = true,
                                         .read = read,
                                         .points = points,
                                         .values = values,
                                         .slopes = slopes,
                                         .influences = influences,
                                         .faces = faces,
                                         .row_of_child = row_of_child};
