/* Rows of Loop's scheme that hold points and normals alone, from all points of the answer's level and the
 * topology of the level above it (loop_rows.h). fields[0].base has the answer's counts only. */
#include "refine.h"
#include "surface_plan.h"
#include "surface_reader.h"

/* ---- the plan -------------------------------------------------------------------------------- */

/* Whether rows hold refined points only, or points and normals. */
static bool is_bare(const tw_surface_builder *b) {
  const tw_mesh *m = b->mesh;
  const tw_surface *s = b->surface;
  bool points_only =
      m->uv_set_count == 0 && tw_smooth_set_count(s) == 0 && !m->skin.joints && s->details.count == 0;
  return points_only && s->options.level > 0 && b->keeps_all_faces && !s->options.limit &&
         !tw_cage_shrinks(&b->cage, &s->options);
}

/* Saves the last generic step. */
static bool fits(const tw_surface_builder *b) {
  const tw_surface *s = b->surface;
  if (s->options.scheme != TW_LOOP || !is_bare(b)) return false;
  return !s->options.normals || tw_loop_rows_fit(&b->cage.topology, &s->rules, s->options.level - 1);
}

static tw_status start(tw_surface_builder *b, tw_error *error) {
  (void)error;
  b->levels = b->surface->options.level - 1;
  return TW_OK;
}

/* Keeps the topology of the level above; the rows' own level has its counts only. */
static void take_base(tw_surface_builder *b) {
  tw_surface *s = b->surface;
  s->loop_above = b->topologies[0];
  if (s->options.normals) tw_builder_need_masks(s, &s->loop_above);
  b->topologies[0] = tw_loop_rows_counts(&s->loop_above);
}

static tw_status make(tw_surface_builder *b, tw_error *error) {
  (void)b;
  (void)error;
  return TW_OK;
}

static tw_status place(tw_surface *s, double **base, const tw_parallel_for *parallel) {
  double *all = s->positions.exact = tw_alloc(s->fields[0].base.vertex_count, 3 * sizeof *all);
  return all ? tw_refine_values(&s->loop_above, &s->rules, 3, *base, parallel, all) : TW_NO_MEMORY;
}

/* ---- rows ------------------------------------------------------------------------------------ */

static void read(tw_surface_reader *r, tw_domain domain, const tw_piece *piece, float *out) {
  const tw_block block = {.first = piece->item, .count = piece->items};
  tw_assemble_rows(r, domain, &block, out);
}

static void points(tw_surface_reader *r, const tw_block *block, float *out, float *normals, uint32_t stride) {
  const tw_surface *s = r->surface;
  const double *all = s->positions.exact, *point = all + 3 * (size_t)block->first;
  for (size_t i = 0; i < block->count; i++, point += 3)
    for (size_t c = 0; c < 3; c++) out[i * stride + c] = (float)point[c];
  if (normals)
    tw_loop_rows_normals(&s->loop_above, all, block->first, block->count, r->mask.entries, normals, stride);
}

static void faces(const tw_surface *s, tw_domain domain, uint64_t first, size_t count, uint32_t *out) {
  (void)domain;
  tw_loop_rows_triangles(&s->loop_above, (uint32_t)first, (uint32_t)count, out);
}

/* Rows have no other columns. */
const tw_evaluator tw_loop_evaluator = {.fits = fits,
                                        .start = start,
                                        .take_base = take_base,
                                        .make = make,
                                        .place = place,
                                        .reads_base = true,
                                        .levels_below = 1,
                                        .read = read,
                                        .points = points,
                                        .faces = faces};
