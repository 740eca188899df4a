/* Makes a surface from a control mesh: chooses the method (tw_way), takes generic steps to the base, numbers
 * the rows, and plans the patches, whole levels or Loop's rows that compute the answer from the base. */
#include "surface_plan.h"

#include <stdlib.h>
#include <string.h>

#include "limit.h"
#include "patch_stencils.h"
#include "sorted.h"

/* ---- what outlives the mesh ----------------------------------------------------------------- */

/* Whether the surface needs the cage's topology once it is made: as its base or, where it is movable, to
 * refine other positions to the base. levels: generic steps to the base. */
static bool needs_cage(const tw_surface *s, uint32_t levels) {
  if (levels == 0) return s->way != TW_WAY_LEVELS; /* TW_WAY_LEVELS has tables of its own */
  return s->options.movable;
}

/* Copies the cage's faces, which are the mesh's arrays until then. */
static tw_status keep_cage(tw_surface_builder *b) {
  tw_topology *t = &b->cage.topology;
  tw_arena *arena = b->points_arena;
  t->corner_vertex = tw_arena_gather(arena, t->corner_vertex, NULL, t->corner_count, sizeof(uint32_t));
  if (t->face_offsets)
    t->face_offsets = tw_arena_gather(arena, t->face_offsets, NULL, t->face_count + 1, sizeof(uint32_t));
  return t->corner_vertex && (t->face_size != 0 || t->face_offsets) ? TW_OK : TW_NO_MEMORY;
}

static tw_status keep_details(tw_surface_builder *b) {
  tw_detail_list *list = &b->surface->details;
  tw_detail *details = tw_arena_gather(b->points_arena, list->details, NULL, list->count, sizeof *details);
  if (!details) return TW_NO_MEMORY;
  list->details = details;
  for (uint32_t i = 0; i < list->count; i++) {
    details[i].offsets = tw_arena_gather(b->points_arena, details[i].offsets, NULL, details[i].vertex_count,
                                         3 * sizeof *details[i].offsets);
    if (!details[i].offsets) return TW_NO_MEMORY;
  }
  return TW_OK;
}

static tw_status keep_sources(tw_surface_builder *b) {
  tw_surface *s = b->surface;
  uint32_t vertices = s->cage_vertex_count = b->cage.topology.vertex_count;
  s->point_of = b->cage.point_of;
  if (needs_cage(s, b->levels)) {
    tw_status status = keep_cage(b);
    return status == TW_OK && s->options.movable ? keep_details(b) : status;
  }
  if (!s->point_of || !s->options.movable) return TW_OK;
  s->point_of = tw_arena_gather(s->arena, s->point_of, NULL, vertices, sizeof *s->point_of);
  return s->point_of ? TW_OK : TW_NO_MEMORY;
}

/* Frees what only computing the positions needed. */
static void forget_sources(tw_surface *s) {
  if (!needs_cage(s, s->step_count)) {
    tw_arena_destroy(s->points_arena);
    s->points_arena = NULL;
  }
  if (s->options.movable) return;
  s->point_of = NULL;
  s->steps = NULL;
  s->step_count = 0;
  s->details = (tw_detail_list){0, NULL};
}

/* Keeps creases, corners and the order of the faces for a level 0 that is a cage again. Such a surface has
 * all faces, so its points are numbered as the cage's vertices and the tags' numbers are right as they
 * are. */
static tw_status keep_tags(tw_surface_builder *b) {
  tw_surface *s = b->surface;
  if (!tw_keeps_tags(b->mesh, &s->options)) return TW_OK;
  tw_surface_tags *tags = s->tags = tw_arena_alloc(s->arena, 1, sizeof *tags);
  if (!tags) return TW_NO_MEMORY;
  *tags = b->cage.tags;
  uint32_t creases = tags->crease_count, points = tags->sharp_point_count;
  tags->crease_edges = tw_arena_gather(s->arena, tags->crease_edges, NULL, creases, 2 * sizeof(uint32_t));
  tags->crease_sharpness = tw_arena_gather(s->arena, tags->crease_sharpness, NULL, creases, sizeof(float));
  tags->sharp_points = tw_arena_gather(s->arena, tags->sharp_points, NULL, points, sizeof(uint32_t));
  tags->point_sharpness = tw_arena_gather(s->arena, tags->point_sharpness, NULL, points, sizeof(float));
  uint32_t *faces = tw_arena_alloc(s->arena, s->face_count, sizeof *faces);
  tags->faces = faces;
  bool complete =
      faces && tags->crease_edges && tags->crease_sharpness && tags->sharp_points && tags->point_sharpness;
  for (uint32_t i = 0; complete && i < s->face_count; i++)
    faces[i] = tw_run_of(b->mesh->face_offsets, b->mesh->face_count, s->face_first[i]);
  return complete ? TW_OK : TW_NO_MEMORY;
}

/* ---- from the base to rows ------------------------------------------------------------------ */

static void need_masks(tw_surface *s, const tw_topology *t) {
  uint32_t capacity = tw_limit_greatest_capacity(t);
  if (capacity > s->mask_capacity) s->mask_capacity = capacity;
}

/* Keeps the topology of the level above Loop's rows; their own level has its counts only. */
static void plan_loop_rows(tw_surface_builder *b) {
  tw_surface *s = b->surface;
  s->loop_above = b->topologies[0];
  if (s->options.normals) need_masks(s, &s->loop_above);
  b->topologies[0] = tw_loop_rows_counts(&s->loop_above);
}

/* The cache of patch classes to use; NULL without memory. */
static tw_patch_classes *classes_of(tw_surface *s) {
  if (s->options.classes) return s->options.classes;
  if (!s->classes) s->classes = tw_patch_classes_create();
  return s->classes;
}

static tw_status plan_patches(tw_surface_builder *b) {
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
    if (status == TW_LIMIT) b->next = TW_TRY_STEPS;
    if (status != TW_OK) return status;
    if (field->patches.scratch_points > s->scratch_points) s->scratch_points = field->patches.scratch_points;
  }
  return TW_OK;
}

static tw_status fail_fans(tw_error *error) {
  return tw_fail(error, TW_LIMIT,
                 "thousands of faces meet in a point, each with a normal of its own: normals=none without "
                 "limit=true can do without");
}

/* Refuses rows that would take too long to read. A row has a mask for its normal, two for its tangent, one
 * for each value at the limit, and one on the surface of each target that displaces normals. */
static tw_status check_fans(const tw_surface_builder *b, tw_error *error) {
  const tw_surface *s = b->surface;
  uint32_t masks = (s->options.normals || s->options.limit ? 1u : 0u) + (s->tangent_frames ? 2u : 0u);
  if (s->options.limit) masks += b->mesh->uv_set_count + tw_smooth_set_count(s) + 1;
  if (b->morph_normals) masks += s->morph_count;
  if (s->way != TW_WAY_BASE || masks == 0 || tw_is_quickly_read(&s->fields[0].base, &s->vertices, masks))
    return TW_OK;
  return fail_fans(error);
}

/* Makes a surface without its positions. *attempt: the methods to use; where one of them returned TW_LIMIT,
 * receives the attempt that does without it. */
static tw_status make_plan(const tw_mesh *mesh, const tw_surface_options *options,
                           const tw_parallel_for *parallel, tw_attempt *attempt, tw_surface **out,
                           tw_error *error);

/* Orders points as they are without the details of this level and of deeper ones, so that positions which a
 * client has read from that surface and moved still fit. */
static tw_status order_points(tw_surface_builder *b) {
  tw_surface *s = b->surface, *before;
  tw_mesh mesh = *b->mesh;
  mesh.detail_count = tw_coarser_details(&s->details, s->options.level).count;
  tw_surface_options options = s->options;
  options.classes = NULL;
  options.movable = false;
  tw_attempt attempt = TW_TRY_ALL;
  tw_status status = make_plan(&mesh, &options, b->parallel, &attempt, &before, NULL);
  if (status == TW_NO_MEMORY || status == TW_CANCELLED) return status;
  /* There is no such surface, so nobody has its rows: keep the numbers of the level. */
  if (status != TW_OK) return TW_OK;
  b->point_order_count = (uint32_t)tw_surface_row_count(before, TW_DOMAIN_POINTS);
  b->point_order = tw_arena_alloc_raw(b->arena, b->point_order_count, sizeof *b->point_order);
  if (b->point_order) tw_surface_vertices_of_points(before, &s->fields[0].base, b->point_order);
  tw_surface_destroy(before);
  return b->point_order ? TW_OK : TW_NO_MEMORY;
}

/* Plans rows of the base, of its patches, or of Loop's scheme. */
static tw_status plan_rows(tw_surface_builder *b, tw_error *error) {
  tw_surface *s = b->surface;
  if (s->way == TW_WAY_LOOP) plan_loop_rows(b);
  for (uint32_t f = 0; f < s->field_count; f++) s->fields[f].base = b->topologies[f];
  /* Loop's rows are one level below the base. */
  const tw_face_order order = {b->mesh, b->cage.visible, b->source, b->levels + (s->way == TW_WAY_LOOP)};
  tw_status status = tw_surface_order(s, &order);
  if (status == TW_OK) status = tw_parallel_for_status(b->parallel);
  bool has_details = s->options.level > 0 && s->options.level <= tw_deepest_detail(&s->details);
  if (status == TW_OK && has_details) status = order_points(b);
  if (status == TW_OK) status = tw_builder_number(b);
  if (status == TW_OK) status = tw_parallel_for_status(b->parallel);
  if (status != TW_OK || s->way == TW_WAY_LOOP) return status;
  for (uint32_t f = 0; f < s->field_count; f++) need_masks(s, &s->fields[f].base);
  return s->way == TW_WAY_PATCHES ? plan_patches(b) : check_fans(b, error);
}

/* ---- the plan ------------------------------------------------------------------------------- */

static tw_status plan_levels(tw_surface_builder *b, tw_error *error) {
  bool is_large = false;
  tw_status status = tw_builder_levels(b, &is_large);
  if (is_large) b->next = b->attempt == TW_TRY_ALL ? TW_TRY_WITHOUT_LEVELS : TW_TRY_STEPS;
  return status == TW_LIMIT && !is_large ? fail_fans(error) : status;
}

static tw_status plan(tw_surface_builder *b, tw_error *error) {
  tw_surface *s = b->surface;
  tw_status status = tw_parallel_for_status(b->parallel);
  if (status == TW_OK) status = tw_cage_read(b->mesh, &s->options, b->points_arena, &b->cage);
  b->cage.arena = b->arena; /* from here on only the plan uses what is made of the cage */
  if (status == TW_OK) status = tw_cage_count(&s->options, &b->cage, &s->counts, error);
  if (status == TW_OK) status = tw_details_check(&s->details, &b->cage, &s->options, error);
  if (status == TW_OK) status = tw_parallel_for_status(b->parallel);
  if (status == TW_OK) status = tw_builder_choose(b, error);
  if (status == TW_OK) status = keep_sources(b);
  if (status == TW_OK) status = tw_builder_base(b);
  if (status == TW_OK) status = s->way == TW_WAY_LEVELS ? plan_levels(b, error) : plan_rows(b, error);
  if (status == TW_OK) status = keep_tags(b);
  if (status == TW_OK) status = tw_surface_start_bounds(s);
  if (status != TW_OK) return status;
  tw_builder_lay_out(b);
  if (tw_surface_row_count(s, TW_DOMAIN_VERTICES) >= UINT32_MAX)
    return tw_fail(error, TW_LIMIT,
                   "the surface would have over 4,294,967,294 vertices once its seams are split");
  return TW_OK;
}

/* The field of an attribute's values: that of an earlier channel with the same seams, or a new one. */
static uint32_t field_of_channel(tw_surface_builder *b, uint32_t channel) {
  const tw_channel *own = &b->channels[channel];
  size_t size = b->mesh->corner_count * sizeof *own->corners;
  for (uint32_t i = 0; i < channel; i++) {
    const tw_channel *other = &b->channels[i];
    if (other->value_count == own->value_count && memcmp(other->corners, own->corners, size) == 0)
      return b->channel_fields[i];
  }
  return b->surface->field_count++;
}

/* Gives fields to what has values at corners. Each UV set has its own. False without memory. */
static bool choose_fields(tw_surface_builder *b) {
  tw_surface *s = b->surface;
  const tw_mesh *mesh = b->mesh;
  b->channel_count = tw_mesh_channels(mesh, b->channels);
  s->field_count = 1;
  for (uint32_t i = 0; i < b->channel_count; i++)
    b->channel_fields[i] = i < mesh->uv_set_count ? s->field_count++ : field_of_channel(b, i);
  for (uint32_t i = 0; i < mesh->attribute_count; i++)
    b->has_whole |= mesh->attributes[i].numbers != TW_NUMBERS_REAL;
  s->fields = tw_arena_alloc(s->arena, s->field_count, sizeof *s->fields);
  if (!s->fields) return false;
  s->fields[0].linear = s->rules.linear;
  for (uint32_t f = 1; f < s->field_count; f++)
    s->fields[f].linear = s->rules.linear || s->options.uv == TW_UV_ALL;
  return true;
}

static tw_status make_plan(const tw_mesh *mesh, const tw_surface_options *options,
                           const tw_parallel_for *parallel, tw_attempt *attempt, tw_surface **out,
                           tw_error *error) {
  tw_surface *s = tw_alloc_zero(1, sizeof *s);
  if (!s) return TW_NO_MEMORY;
  tw_surface_builder b = {.mesh = mesh,
                          .surface = s,
                          .parallel = parallel,
                          .arena = tw_arena_create(),
                          .points_arena = tw_arena_create(),
                          .attempt = *attempt,
                          .next = *attempt,
                          .morph_normals = mesh->morph_normals && options->normals && !options->movable};
  s->options = *options;
  s->options.movable |= b.morph_normals && !tw_has_own_normals(mesh, options);
  s->rules = tw_rules_of(options);
  s->details = (tw_detail_list){mesh->detail_count, mesh->details};
  s->arena = tw_arena_create();
  s->points_arena = b.points_arena;
  s->attribute_count = mesh->attribute_count;
  s->morph_count = mesh->morph_count;
  bool has_arenas = s->arena && b.arena && b.points_arena;
  tw_status status = has_arenas && choose_fields(&b) ? plan(&b, error) : TW_NO_MEMORY;
  tw_arena_destroy(b.arena);
  *attempt = b.next;
  s->options.grant = NULL; /* it belongs to the caller and is valid for this call only */
  if (status == TW_OK)
    *out = s;
  else
    tw_surface_destroy(s);
  return status;
}

/* ---- surfaces ------------------------------------------------------------------------------- */

static tw_status create(const tw_mesh *mesh, const tw_surface_options *options,
                        const tw_parallel_for *parallel, tw_attempt *attempt, tw_surface **out,
                        tw_error *error) {
  tw_surface *s;
  tw_status status = make_plan(mesh, options, parallel, attempt, &s, error);
  if (status != TW_OK) return status;
  status = tw_surface_place(s, mesh->positions, parallel);
  if (status == TW_OK && s->layout.morph_width == 6 && !s->own_normals)
    status = tw_surface_morph(s, mesh, parallel);
  forget_sources(s);
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
  tw_surface_options own = *options;
  tw_attempt attempt = TW_TRY_ALL;
  status = create(mesh, &own, parallel, &attempt, out, error);
  bool has_long_lists = attempt == TW_TRY_WITHOUT_LEVELS;
  if (has_long_lists) status = create(mesh, &own, parallel, &attempt, out, error);
  /* The shared cache may be full: try again with a cache of the surface's own. */
  if (attempt == TW_TRY_STEPS && own.classes) {
    own.classes = NULL;
    attempt = TW_TRY_WITHOUT_LEVELS;
    status = create(mesh, &own, parallel, &attempt, out, error);
  }
  /* More irregular classes than there is room for at all: take long lists, or else generic steps. */
  if (attempt == TW_TRY_STEPS && has_long_lists) {
    attempt = TW_TRY_LARGE_LEVELS;
    status = create(mesh, options, parallel, &attempt, out, error);
  }
  if (attempt == TW_TRY_STEPS) status = create(mesh, options, parallel, &attempt, out, error);
  if (status == TW_CANCELLED) tw_fail(error, status, "the surface is not wanted any more");
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
