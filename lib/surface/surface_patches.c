/* Rows of TW_WAY_PATCHES: at corners, along the insides of edges, over the insides of quads. */
#include "patch.h"
#include "surface_reader.h"

/* Part of a patch's grid. backwards: from its last point to its first. */
typedef struct place {
  uint32_t quad;
  tw_patch_rect rect;
  bool backwards;
} place;

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
static void evaluate(const tw_surface_reader *r, const tw_values *values, const place *at, float *out,
                     float *normals, uint32_t stride) {
  if (values->at_corners) {
    tw_nearest_values(r->surface, values, at->quad, at->rect, at->backwards, out, stride);
    return;
  }
  tw_patch_job job = job_for(r, values, out, normals, stride);
  job.backwards = at->backwards;
  tw_patch_evaluate(&r->surface->fields[values->field].patches, at->quad, &job, at->rect);
}

/* ---- what a vertex has besides point and normal ------------------------------------------ */

static void tangents(tw_surface_reader *r, const place *at, float *out) {
  const tw_surface *s = r->surface;
  uint8_t frame = s->tangent_frames[at->quad];
  const tw_slope_source points = tw_slopes_of(s, &s->positions), uvs = tw_slopes_of(s, &s->uvs[frame / 2]);
  size_t count = (size_t)(at->rect.i1 - at->rect.i0 + 1) * (at->rect.j1 - at->rect.j0 + 1);
  tw_patch_slopes(&points, at->quad, at->rect, r->scratch, r->slopes[0]);
  tw_patch_slopes(&uvs, at->quad, at->rect, r->scratch, r->slopes[1]);
  tw_write_tangents(r->slopes[0], r->slopes[1], count, at->backwards, frame % 2,
                    tw_tangent_columns_of(s, out));
}

static void weights(tw_surface_reader *r, const place *at, float *out) {
  const tw_surface *s = r->surface;
  const tw_skin_patch patch = {&s->influences,   &s->fields[0].patches, at->quad,  at->rect,
                               s->options.limit, at->backwards,         r->scratch};
  tw_skin_patch_rows(&patch, &r->skin, tw_skin_columns_of(s, out));
}

/* own: where the rows are; shared: the place that represents their points. */
static void attributes(tw_surface_reader *r, const place *own, const place *shared, float *out) {
  const tw_surface *s = r->surface;
  const tw_surface_layout *l = &s->layout;
  if (l->tangent != UINT32_MAX) tangents(r, own, out);
  for (uint32_t i = 0; i < l->uv_count; i++) evaluate(r, &s->uvs[i], own, out + l->uvs[i], NULL, l->stride);
  for (uint32_t i = 0; i < tw_smooth_count(l); i++)
    evaluate(r, &s->smooth[i], s->smooth[i].field > 0 ? own : shared, out + tw_smooth_column(l, i), NULL,
             l->stride);
  if (l->joints != UINT32_MAX) weights(r, shared, out);
}

/* ---- corners and edges ---------------------------------------------------------------------- */

/* The base corner that represents a corner or an edge of the numbering. */
static uint32_t corner_of(const tw_numbering *n, tw_patch_piece piece, uint32_t item) {
  return piece == TW_PATCH_CORNER ? tw_corner_of_row(n, item) : tw_corner_of_edge(n, item);
}

/* The place of a corner, or of the inside of the edge that begins there. against: the edge runs in the
 * opposite direction. */
static place place_at(const tw_surface *s, tw_patch_piece piece, uint32_t corner, bool against) {
  place at = {corner / 4, {0}, false};
  if (piece == TW_PATCH_CORNER) {
    at.rect = tw_patch_corner(s->side, corner % 4);
  } else {
    at.rect = tw_patch_side(s->side, corner % 4, &at.backwards);
    at.backwards = at.backwards != against;
  }
  return at;
}

/* The corner that represents the points of a corner or edge: all split vertices take their points from there,
 * so that these are the same to the last bit. *against: that corner's edge runs against this one. */
static uint32_t shared_corner(const tw_surface *s, tw_patch_piece piece, uint32_t corner, bool *against) {
  *against = false;
  if (piece == TW_PATCH_CORNER) return tw_shared_corner(s, corner);
  uint32_t edge = tw_row_of_edge(&s->points, corner);
  *against = edge & 1;
  return tw_corner_of_edge(&s->points, edge / 2);
}

void tw_patch_read_items(tw_surface_reader *reader, tw_domain domain, tw_patch_piece piece, uint32_t first,
                         uint32_t count, float *out) {
  const tw_surface *s = reader->surface;
  const tw_numbering *n = tw_numbering_of(s, domain);
  uint32_t width = tw_row_width(s, domain);
  bool has_attributes = tw_has_attributes(s, domain), split = tw_is_split(s, domain), against = false;
  size_t step = width * (piece == TW_PATCH_CORNER ? 1 : tw_rows_inside_edge(s));
  for (uint32_t i = 0; i < count; i++, out += step) {
    uint32_t corner = corner_of(n, piece, first + i), shared = corner;
    const place own = place_at(s, piece, corner, false);
    if (domain == TW_DOMAIN_UVS) {
      evaluate(reader, &s->uvs[0], &own, out, NULL, width);
      continue;
    }
    if (split) shared = shared_corner(s, piece, corner, &against);
    const place from = place_at(s, piece, shared, against);
    float *normals = tw_normal_in(s, domain, out);
    bool apart = shared != corner || against;
    evaluate(reader, &s->positions, &from, out, apart ? NULL : normals, width);
    if (apart && normals) evaluate(reader, &s->positions, &own, NULL, normals, width);
    if (has_attributes) attributes(reader, &own, &from, out);
  }
}

/* ---- insides of quads ----------------------------------------------------------------------- */

void tw_patch_read_lines(tw_surface_reader *reader, tw_domain domain, uint32_t visible, uint32_t j0,
                         uint32_t j1, float *out) {
  const tw_surface *s = reader->surface;
  const tw_values *values = domain == TW_DOMAIN_UVS ? &s->uvs[0] : &s->positions;
  const place at = {tw_base_quad(s, visible), {1, s->side - 1, j0, j1}, false};
  evaluate(reader, values, &at, out, tw_normal_in(s, domain, out), tw_row_width(s, domain));
  if (tw_has_attributes(s, domain)) attributes(reader, &at, &at, out);
}
