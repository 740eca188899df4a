/* From a control mesh to a surface that can be read at any place: refine to the base level in the
 * generic way, number what the answer will hold, plan patches for the rest. */
#include "surface_build.h"

#include <stdlib.h>

#include "limit.h"
#include "patch_stencils.h"

/* ---- building ------------------------------------------------------------------------------- */

static void need_masks(tw_surface *s, const tw_topology *t) {
  for (uint32_t v = 0; v < t->vertex_count; v++) {
    uint32_t capacity = tw_limit_capacity(t, v);
    if (capacity > s->mask_capacity) s->mask_capacity = capacity;
  }
}

/* The cage outlives the mesh where it is the base, and where it is what positions are refined by. */
static tw_status keep_cage(tw_build *b) {
  tw_surface *s = b->surface;
  if (s->way == TW_WAY_LEVELS) {
    s->point_of = b->cage.point_of;
    if (!s->point_of || !s->options.movable) return TW_OK;
    s->point_of =
        tw_build_gather(s->arena, s->point_of, NULL, b->cage.topology.vertex_count, sizeof(uint32_t));
    return s->point_of ? TW_OK : TW_NO_MEMORY;
  }
  if (b->levels > 0 && !s->options.movable) return TW_OK;
  tw_topology *t = &b->cage.topology;
  s->points_arena = b->points_arena;
  s->rules = b->rules;
  s->point_of = b->cage.point_of;
  t->corner_vertex =
      tw_build_gather(b->points_arena, t->corner_vertex, NULL, t->corner_count, sizeof(uint32_t));
  if (t->face_offsets)
    t->face_offsets =
        tw_build_gather(b->points_arena, t->face_offsets, NULL, t->face_count + 1, sizeof(uint32_t));
  bool complete = t->corner_vertex && (t->face_size != 0 || t->face_offsets);
  return complete ? TW_OK : TW_NO_MEMORY;
}

/* Values of one set, of a mesh that is read whole. */
static tw_status level_values(tw_build *b, uint32_t field, uint32_t width, const float *in,
                              const uint32_t *of, tw_values *values) {
  *values = (tw_values){.field = field, .width = width};
  return tw_surface_refine_levels(b->surface, in, of, b->parallel, values);
}

static tw_status level_frames(tw_build *b, uint32_t *const uv_values[]) {
  const float *uvs[TW_UV_SETS_MAX];
  if (!tw_build_has_tangents(b)) return TW_OK;
  for (uint32_t i = 0; i < b->mesh->uv_set_count; i++) {
    uvs[i] = tw_build_gather(b->arena, b->mesh->uv_sets[i].values, uv_values[i],
                             b->topologies[1 + i].vertex_count, 2 * sizeof(float));
    if (!uvs[i]) return TW_NO_MEMORY;
  }
  return tw_build_find_frames(b, uvs);
}

static tw_status plan_levels(tw_build *b, uint32_t *uv_values[]) {
  tw_surface *s = b->surface;
  tw_levels_wish wish = {.level = s->options.level,
                         .field_count = s->field_count,
                         .rules = b->rules,
                         .limit = s->options.limit,
                         .normals = s->options.normals,
                         .parallel = b->parallel};
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < b->mesh->uv_set_count && status == TW_OK; i++) {
    s->fields[1 + i].linear = s->options.uv == TW_UV_ALL;
    status = tw_uv_topology(&b->cage.topology, &b->mesh->uv_sets[i], s->options.uv, b->arena,
                            &b->topologies[1 + i], &uv_values[i]);
    if (status == TW_OK && b->rules.chaikin)
      status = tw_topology_copy_semi(&b->topologies[1 + i], &b->cage.topology, b->arena);
  }
  b->topologies[0] = b->cage.topology;
  for (uint32_t f = 0; f < s->field_count; f++) {
    wish.fields[f] = &b->topologies[f];
    wish.linear[f] = s->fields[f].linear;
  }
  s->levels = tw_arena_alloc(s->arena, s->field_count, sizeof *s->levels);
  if (!s->levels) return TW_NO_MEMORY;
  if (status == TW_OK) status = level_frames(b, uv_values);
  wish.frames = s->tangent_frames;
  return status == TW_OK ? tw_levels_plan(&wish, s->arena, s->levels, &s->level_rows) : status;
}

static tw_status level_skin(tw_build *b) {
  tw_surface *s = b->surface;
  tw_influences cage;
  if (!b->mesh->skin.joints) return TW_OK;
  tw_status status = tw_influences_init(&cage, b->mesh, b->cage.point_of, b->cage.topology.vertex_count);
  if (status != TW_OK) return status;
  status = tw_skin_refine_levels(&s->levels[0], &cage, s->options.limit, b->parallel, &s->skin_rows);
  tw_influences_deinit(&cage);
  return status;
}

/* All of the last level. */
static tw_status build_levels(tw_build *b) {
  tw_surface *s = b->surface;
  const tw_mesh *mesh = b->mesh;
  const uint32_t *of = b->cage.point_of;
  uint32_t *uv_values[TW_UV_SETS_MAX] = {NULL};
  tw_status status = plan_levels(b, uv_values);
  if (status == TW_OK) status = level_values(b, 0, 3, mesh->positions, of, &s->positions);
  if (status == TW_OK && mesh->colors) status = level_values(b, 0, 4, mesh->colors, of, &s->colors);
  for (uint32_t i = 0; i < mesh->uv_set_count && status == TW_OK; i++)
    status = level_values(b, 1 + i, 2, mesh->uv_sets[i].values, uv_values[i], &s->uvs[i]);
  s->morphs = tw_arena_alloc(s->arena, mesh->morph_count, sizeof *s->morphs);
  if (!s->morphs) return TW_NO_MEMORY;
  s->morph_count = mesh->morph_count;
  for (uint32_t m = 0; m < mesh->morph_count && status == TW_OK; m++)
    status = level_values(b, 0, 3, mesh->morphs[m], of, &s->morphs[m]);
  if (status == TW_OK) status = level_skin(b);
  if (status != TW_OK) return status;
  const tw_level *last = &s->levels[0].at[s->options.level];
  s->fields[0].base = (tw_topology){.vertex_count = last->vertex_count,
                                    .edge_count = last->edge_count,
                                    .face_count = last->face_count,
                                    .corner_count = last->corner_count,
                                    .face_size = 4};
  s->points = (tw_numbering){.corner_count = last->vertex_count};
  s->vertices = (tw_numbering){.corner_count = s->level_rows.row_count};
  if (s->field_count > 1) s->uv_points = (tw_numbering){.corner_count = tw_levels_points(&s->levels[1])};
  tw_face_order order = {mesh, b->cage.visible, NULL, s->options.level};
  return tw_surface_order(s, &order);
}

/* Goes on from the base to what the rows of Loop's scheme are computed from. */
static tw_status keep_loop(tw_build *b) {
  tw_surface *s = b->surface;
  tw_values *positions = &s->positions;
  s->loop.above = b->topologies[0];
  s->loop.rules = b->rules;
  size_t count = 3 * (size_t)s->loop.above.vertex_count;
  double *points = positions->exact ? positions->exact : tw_arena_alloc(b->arena, count, sizeof *points),
         *kept = tw_arena_alloc(s->arena, tw_loop_rows_kept_count(&s->loop), 3 * sizeof *kept);
  if (!points || !kept) return TW_NO_MEMORY;
  for (size_t i = 0; !positions->exact && i < count; i++) points[i] = (double)positions->base[i];
  *positions = (tw_values){.width = 3, .exact = kept};
  if (s->loop.normals) need_masks(s, &s->loop.above);
  b->topologies[0] = tw_loop_rows_counts(&s->loop);
  return tw_loop_rows_keep(&s->loop, points, b->parallel, kept);
}

/* NULL without memory. */
static tw_patch_shapes *shapes_of(tw_surface *s) {
  if (s->options.shapes) return s->options.shapes;
  if (!s->shapes) s->shapes = tw_patch_shapes_create();
  return s->shapes;
}

static tw_status plan_patches(tw_build *b) {
  tw_surface *s = b->surface;
  for (uint32_t f = 0; f < s->field_count; f++) {
    tw_field *field = &s->fields[f];
    if (s->way == TW_WAY_LOOP) continue;
    need_masks(s, &field->base);
    if (s->depth == 0) continue;
    tw_rules rules = tw_build_rules(b, f);
    tw_patch_shapes *shapes = shapes_of(s);
    if (!shapes) return TW_NO_MEMORY;
    tw_status status = tw_patches_create(&field->patches, &field->base, &rules, s->depth, shapes);
    if (status == TW_OK)
      status = tw_patches_sum(&field->patches, shapes, s->options.limit, s->options.normals && f == 0);
    b->too_irregular = status == TW_LIMIT;
    if (status != TW_OK) return status;
    if (field->patches.scratch_points > s->scratch_points) s->scratch_points = field->patches.scratch_points;
  }
  return TW_OK;
}

static tw_status prepare_bounds(tw_surface *s) {
  s->bounds_ready = tw_arena_alloc(s->arena, (size_t)s->morph_count + 1, sizeof *s->bounds_ready);
  s->bounds = tw_arena_alloc(s->arena, (size_t)s->morph_count + 1, sizeof *s->bounds);
  return s->bounds_ready && s->bounds ? TW_OK : TW_NO_MEMORY;
}

/* A row at a vertex that no patch covers costs as much as the vertex has faces: many rows at a vertex of very
 * many faces would cost their product. */
static tw_status check_fans(const tw_surface *s, tw_error *error) {
  enum { GREAT = 4096, WORK_MAX = 1 << 28 };
  bool masked = s->depth == 0 && (s->options.normals || s->options.limit);
  if (!masked || s->way == TW_WAY_LOOP || s->mask_capacity < GREAT) return TW_OK;
  const tw_topology *t = &s->fields[0].base;
  uint64_t work = 0;
  for (uint32_t row = 0; row < s->vertices.corner_count && work <= WORK_MAX; row++) {
    uint32_t vertex = t->corner_vertex[tw_corner_of_row(&s->vertices, row)];
    work += t->fan_offsets[vertex + 1] - t->fan_offsets[vertex];
  }
  if (work <= WORK_MAX) return TW_OK;
  return tw_fail(error, TW_LIMIT,
                 "thousands of faces meet in a point, each with a normal of its own: normals=none without "
                 "limit=true can do without");
}

/* Refines to the base and numbers its rows. */
static tw_status build_base(tw_build *b) {
  tw_surface *s = b->surface;
  tw_status status = tw_build_start(b);
  uint32_t cage_vertices[1 + TW_UV_SETS_MAX] = {0};
  for (uint32_t f = 0; f < s->field_count; f++) cage_vertices[f] = b->topologies[f].vertex_count;
  for (uint32_t level = 1; level <= b->levels && status == TW_OK; level++)
    status = tw_build_refine(b, level == b->levels ? s->arena : b->arena);
  if (status == TW_OK && s->loop.levels > 0) status = keep_loop(b);
  for (uint32_t f = 0; f < s->field_count; f++) s->fields[f].base = b->topologies[f];
  tw_face_order order = {b->mesh, b->cage.visible, b->source, s->loop.levels + b->levels};
  if (status == TW_OK) status = tw_surface_order(s, &order);
  if (status == TW_OK) status = tw_build_number(b, cage_vertices);
  return status == TW_OK ? plan_patches(b) : status;
}

static tw_status build_surface(tw_build *b, bool generic, tw_error *error) {
  tw_surface *s = b->surface;
  tw_status status = tw_cage_read(b->mesh, &s->options, b->points_arena, &b->cage);
  b->cage.arena = b->arena;
  if (status == TW_OK) status = tw_cage_count(&s->options, &b->cage, &s->counts, error);
  if (status != TW_OK) return status;
  status = tw_build_choose(b, generic, error);
  if (status == TW_OK) status = keep_cage(b);
  if (status == TW_OK) status = s->way == TW_WAY_LEVELS ? build_levels(b) : build_base(b);
  if (status == TW_OK) status = prepare_bounds(s);
  if (status == TW_OK) status = check_fans(s, error);
  if (status != TW_OK) return status;
  tw_build_lay_out(b);
  if (tw_surface_row_count(s, TW_DOMAIN_VERTICES) < UINT32_MAX) return TW_OK;
  return tw_fail(error, TW_LIMIT,
                 "the surface would have over 4,294,967,294 vertices once its seams are split");
}

/* *too_irregular: patches were tried and gave up. */
static tw_status create(const tw_mesh *mesh, const tw_surface_options *options,
                        const tw_parallel_for *parallel, bool generic, tw_surface **out, bool *too_irregular,
                        tw_error *error) {
  tw_surface *s = tw_alloc_zero(1, sizeof *s);
  if (!s) return TW_NO_MEMORY;
  s->options = *options;
  s->arena = tw_arena_create();
  s->field_count = 1 + mesh->uv_set_count;
  s->fields[0].linear = options->scheme == TW_BILINEAR;
  tw_build b = {.mesh = mesh,
                .surface = s,
                .parallel = parallel,
                .arena = tw_arena_create(),
                .points_arena = tw_arena_create()};
  b.rules = (tw_rules){.linear = options->scheme == TW_BILINEAR,
                       .chaikin = options->creasing == TW_CREASE_CHAIKIN,
                       .smooth_triangles = options->triangles == TW_TRIANGLES_SMOOTH};
  bool ready = s->arena && b.arena && b.points_arena;
  tw_status status = ready ? build_surface(&b, generic, error) : TW_NO_MEMORY;
  tw_arena_destroy(b.arena);
  if (!s->points_arena) {
    tw_arena_destroy(b.points_arena);
    s->step_count = 0;
  }
  *too_irregular = b.too_irregular;
  if (status == TW_OK)
    *out = s;
  else
    tw_surface_destroy(s);
  return status;
}

tw_status tw_surface_create_by(const tw_mesh *mesh, const tw_surface_options *options,
                               const tw_parallel_for *parallel, tw_surface **out, tw_error *error) {
  tw_status status = tw_cage_check_options(mesh, options, error);
  if (status != TW_OK) return status;
  bool too_irregular = false;
  status = create(mesh, options, parallel, false, out, &too_irregular, error);
  if (too_irregular && options->shapes) { /* those of others may leave no room */
    tw_surface_options own = *options;
    own.shapes = NULL;
    status = create(mesh, &own, parallel, false, out, &too_irregular, error);
  }
  if (too_irregular) status = create(mesh, options, parallel, true, out, &too_irregular, error);
  return status == TW_NO_MEMORY ? tw_fail(error, status, "out of memory") : status;
}

tw_status tw_surface_create(const tw_mesh *mesh, const tw_surface_options *options, tw_surface **out,
                            tw_error *error) {
  return tw_surface_create_by(mesh, options, NULL, out, error);
}

tw_status tw_surface_count(const tw_mesh *mesh, const tw_surface_options *options, tw_surface_counts *out,
                           tw_error *error) {
  tw_status status = tw_cage_check_options(mesh, options, error);
  if (status != TW_OK) return status;
  tw_arena *arena = tw_arena_create();
  tw_cage cage;
  tw_surface_counts counts = {0, 0, 0, 0};
  status = arena ? tw_cage_read(mesh, options, arena, &cage) : TW_NO_MEMORY;
  if (status == TW_OK) status = tw_cage_count(options, &cage, &counts, error);
  tw_arena_destroy(arena);
  if (status == TW_OK || status == TW_LIMIT) *out = counts;
  return status == TW_NO_MEMORY ? tw_fail(error, status, "out of memory") : status;
}

void tw_surface_destroy(tw_surface *surface) {
  if (!surface) return;
  if (surface->plan) {
    tw_surface_free_moved(surface);
    return;
  }
  for (uint32_t f = 0; f < surface->field_count; f++) tw_patches_deinit(&surface->fields[f].patches);
  tw_values_free_points(&surface->positions);
  tw_values_free_points(&surface->colors);
  for (uint32_t i = 0; i < TW_UV_SETS_MAX; i++) tw_values_free_points(&surface->uvs[i]);
  for (uint32_t m = 0; m < surface->morph_count; m++) tw_values_free_points(&surface->morphs[m]);
  tw_patch_shapes_destroy(surface->shapes);
  tw_influences_deinit(&surface->cage_influences);
  tw_influences_deinit(&surface->influences);
  free(surface->skin_rows);
  tw_arena_destroy(surface->points_arena);
  tw_arena_destroy(surface->arena);
  free(surface);
}

size_t tw_surface_size(const tw_surface *surface) {
  if (surface->plan) return tw_surface_size_moved(surface);
  size_t size = sizeof *surface + tw_arena_size(surface->arena) +
                tw_influences_size(&surface->cage_influences) + tw_influences_size(&surface->influences);
  if (surface->points_arena) size += tw_arena_size(surface->points_arena);
  if (surface->skin_rows) size += tw_levels_points(&surface->levels[0]) * sizeof *surface->skin_rows;
  size +=
      tw_values_points_size(surface, &surface->positions) + tw_values_points_size(surface, &surface->colors);
  for (uint32_t i = 0; i < TW_UV_SETS_MAX; i++) size += tw_values_points_size(surface, &surface->uvs[i]);
  for (uint32_t m = 0; m < surface->morph_count; m++)
    size += tw_values_points_size(surface, &surface->morphs[m]);
  for (uint32_t f = 0; f < surface->field_count; f++) size += surface->fields[f].patches.size;
  if (surface->shapes) size += tw_patch_shapes_size(surface->shapes);
  return size;
}

const tw_surface_counts *tw_surface_get_counts(const tw_surface *surface) {
  return &surface->counts;
}
const tw_surface_layout *tw_surface_get_layout(const tw_surface *surface) {
  return &surface->layout;
}
uint32_t tw_surface_group_count(const tw_surface *surface) {
  return surface->group_count;
}
const tw_surface_group *tw_surface_get_group(const tw_surface *surface, uint32_t group) {
  return &surface->groups[group];
}
