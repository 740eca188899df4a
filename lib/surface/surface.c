/* A surface as a whole: what it frees, how large it is, what it tells of itself. */
#include "surface.h"

#include "loop_lattice.h"

float *tw_surface_round_positions(const double *positions, size_t vertices) {
  float *rounded = tw_alloc(vertices, 3 * sizeof *rounded);
  for (size_t i = 0; rounded && i < 3 * vertices; i++) rounded[i] = (float)positions[i];
  return rounded;
}

tw_status tw_surface_keep_base(tw_surface *s, double **base, const tw_parallel_for *parallel) {
  (void)parallel;
  tw_values *out = &s->positions;
  bool is_cage = s->step_count == 0 && s->options.level == 0;
  out->base = is_cage ? out->cage : tw_surface_round_positions(*base, s->fields[0].base.vertex_count);
  if (!out->base) return TW_NO_MEMORY;
  if (s->step_count == 0 || !s->options.normals || s->depth > 0) return TW_OK;
  out->exact = *base;
  *base = NULL;
  return TW_OK;
}

static void free_points(tw_values *values) {
  if (values->points != values->refined) tw_free(values->points);
  tw_free(values->refined);
}

static void free_positions(tw_surface *surface) {
  tw_values *positions = &surface->positions;
  if (positions->cage != positions->base) tw_free(positions->cage);
  tw_free(positions->base);
  tw_free(positions->exact);
  tw_free(positions->kept);
  free_points(positions);
  tw_free(surface->cuts);
  tw_free(surface->cut_triangles);
  tw_free(surface->near_concave);
}

static void free_plan(tw_surface *s) {
  for (uint32_t m = 0; s->morphed && m < s->morph_count; m++) tw_surface_destroy(s->morphed[m]);
  for (uint32_t f = 0; s->fields && f < s->field_count; f++) tw_patches_deinit(&s->fields[f].patches);
  for (uint32_t i = 0; i < TW_UV_SETS_MAX; i++) free_points(&s->uvs[i]);
  for (uint32_t i = 0; s->smooth && i < tw_smooth_set_count(s); i++) free_points(&s->smooth[i]);
  tw_patch_classes_destroy(s->classes);
  tw_influences_deinit(&s->cage_influences);
  tw_influences_deinit(&s->influences);
  tw_free(s->skin_rows);
  tw_arena_destroy(s->points_arena);
  tw_arena_destroy(s->arena);
}

void tw_surface_destroy(tw_surface *surface) {
  if (!surface) return;
  tw_surface_destroy(surface->rim);
  free_positions(surface);
  tw_free(surface->bounds_ready);
  tw_free(surface->bounds);
  if (!surface->plan) free_plan(surface);
  tw_free(surface);
}

static size_t points_size(const tw_surface *s, const tw_values *values) {
  size_t size = values->refined ? tw_shallow_points(&s->levels[values->field]) * sizeof *values->points : 0;
  return values->points != values->refined ? 2 * size : size;
}

static size_t positions_size(const tw_surface *surface) {
  const tw_values *positions = &surface->positions;
  size_t size = points_size(surface, positions);
  if (positions->base) size += 3 * (size_t)surface->fields[0].base.vertex_count * sizeof *positions->base;
  if (positions->exact) size += 3 * (size_t)surface->fields[0].base.vertex_count * sizeof *positions->exact;
  if (positions->cage && positions->cage != positions->base)
    size += 3 * (size_t)surface->cage_vertex_count * sizeof *positions->cage;
  if (positions->kept)
    size += surface->fields[0].kept_face_count * (size_t)tw_lattice_points(surface->side) *
            (surface->options.normals ? 6 : 3) * sizeof *positions->kept;
  size += surface->cut_count * sizeof *surface->cuts +
          (size_t)surface->cut_triangle_count * sizeof *surface->cut_triangles;
  if (surface->near_concave)
    size += surface->levels ? surface->levels[0].at[0].face_count : surface->fields[0].base.face_count;
  return size;
}

static size_t plan_size(const tw_surface *s) {
  size_t size =
      tw_arena_size(s->arena) + tw_influences_size(&s->cage_influences) + tw_influences_size(&s->influences);
  if (s->points_arena) size += tw_arena_size(s->points_arena);
  if (s->skin_rows) size += tw_skin_level_size(&s->levels[0], s->layout.influences);
  for (uint32_t i = 0; i < TW_UV_SETS_MAX; i++) size += points_size(s, &s->uvs[i]);
  for (uint32_t i = 0; i < tw_smooth_set_count(s); i++) size += points_size(s, &s->smooth[i]);
  for (uint32_t m = 0; s->morphed && m < s->morph_count; m++) size += tw_surface_size(s->morphed[m]);
  for (uint32_t f = 0; f < s->field_count; f++) size += s->fields[f].patches.size;
  return s->classes ? size + tw_patch_classes_size(s->classes) : size;
}

size_t tw_surface_size(const tw_surface *surface) {
  size_t bounds =
      tw_surface_bounds_count(surface) * (sizeof *surface->bounds_ready + sizeof *surface->bounds);
  return sizeof *surface + positions_size(surface) + bounds + (surface->plan ? 0 : plan_size(surface)) +
         (surface->rim ? tw_surface_size(surface->rim) : 0);
}

const tw_surface_counts *tw_surface_get_counts(const tw_surface *surface) {
  return &surface->counts;
}
const tw_surface_layout *tw_surface_get_layout(const tw_surface *surface) {
  return &surface->layout;
}
const tw_surface_tags *tw_surface_get_tags(const tw_surface *surface) {
  return surface->tags;
}
const tw_surface_options *tw_surface_get_options(const tw_surface *surface) {
  return &surface->options;
}
uint32_t tw_surface_group_count(const tw_surface *surface) {
  return surface->group_count;
}
const tw_surface_group *tw_surface_get_group(const tw_surface *surface, uint32_t group) {
  return &surface->groups[group];
}
