/* Makes a surface from a control mesh: chooses the evaluator, takes generic steps to the base, numbers the
 * rows, and has the evaluator plan what computes the answer from the base. */
#include "surface_plan.h"

#include <string.h>

#include "limit.h"
#include "sorted.h"

/* ---- what outlives the mesh ------------------------------------------------------------------ */

/* Whether the surface needs the cage's topology once it is made: as its base or, where it is movable, to
 * refine other positions to the base and to see whether these make faces concave. levels: generic steps to
 * the base. */
static bool needs_cage(const tw_surface *s, uint32_t levels) {
  if (s->options.movable && (levels > 0 || s->options.level > 0)) return true;
  return levels == 0 && s->evaluator->reads_base;
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
  if (s->rim) forget_sources(s->rim);
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

/* ---- from the base to rows ------------------------------------------------------------------- */

/* What a surface is made of. inner: NULL, or the builder of the part whose rim is made. */
typedef struct surface_source {
  const tw_mesh *mesh;
  const tw_surface_options *options;
  const tw_parallel_for *parallel;
  const tw_surface_builder *inner;
} surface_source;

/* Makes a surface without its positions. *preference: the first evaluator to try, by its place in the table;
 * where the one chosen declined, receives the place after it. */
static tw_status make_plan(const surface_source *from, uint32_t *preference, tw_surface **out,
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
  uint32_t preference = 0;
  const surface_source from = {&mesh, &options, b->parallel, NULL};
  tw_status status = make_plan(&from, &preference, &before, NULL);
  if (status == TW_NO_MEMORY || status == TW_CANCELLED) return status;
  /* There is no such surface, so nobody has its rows: keep the numbers of the level. */
  if (status != TW_OK) return TW_OK;
  b->point_order_count = (uint32_t)tw_surface_row_count(before, TW_DOMAIN_POINTS);
  b->point_order = tw_arena_alloc_raw(b->arena, b->point_order_count, sizeof *b->point_order);
  if (b->point_order) tw_surface_vertices_of_points(before, &s->fields[0].base, b->point_order);
  tw_surface_destroy(before);
  return b->point_order ? TW_OK : TW_NO_MEMORY;
}

/* Orders and numbers the rows that follow from the base. */
static tw_status plan_rows(tw_surface_builder *b) {
  tw_surface *s = b->surface;
  if (s->evaluator->take_base) s->evaluator->take_base(b);
  for (uint32_t f = 0; f < s->field_count; f++) s->fields[f].base = b->topologies[f];
  tw_status status = b->has_rim || b->inner ? tw_rim_part(b) : TW_OK;
  const tw_face_order order = {b->mesh, b->cage.visible, b->source, b->levels + s->evaluator->levels_below,
                               b->part};
  if (status == TW_OK) status = tw_surface_order(s, &order);
  if (status == TW_OK) status = tw_parallel_for_status(b->parallel);
  bool has_details = s->options.level > 0 && s->options.level <= tw_deepest_detail(&s->details);
  if (status == TW_OK && has_details) status = order_points(b);
  if (status == TW_OK) status = tw_builder_number(b);
  return status == TW_OK ? tw_parallel_for_status(b->parallel) : status;
}

/* ---- the plan -------------------------------------------------------------------------------- */

static tw_status make_rim(const tw_surface_builder *b, tw_error *error) {
  tw_surface *s = b->surface;
  if (!b->has_rim) return TW_OK;
  uint32_t preference = 0;
  const surface_source from = {b->mesh, &s->options, b->parallel, b};
  tw_status status = make_plan(&from, &preference, &s->rim, error);
  return status == TW_OK ? tw_rim_join_groups(s) : status;
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
  if (status == TW_OK && s->evaluator->reads_base) status = plan_rows(b);
  if (status == TW_OK) status = s->evaluator->make(b, error);
  if (status == TW_OK) status = make_rim(b, error);
  if (status == TW_OK) status = keep_tags(b);
  if (status == TW_OK) status = tw_surface_start_bounds(s);
  if (status == TW_OK) status = tw_builder_lay_out(b);
  if (status != TW_OK) return status;
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
    b->has_whole_numbers |= mesh->attributes[i].numbers != TW_NUMBERS_REAL;
  s->fields = tw_arena_alloc(s->arena, s->field_count, sizeof *s->fields);
  if (!s->fields) return false;
  s->fields[0].linear = s->rules.linear;
  for (uint32_t f = 1; f < s->field_count; f++)
    s->fields[f].linear = s->rules.linear || s->options.uv == TW_UV_ALL;
  return true;
}

static tw_status make_plan(const surface_source *from, uint32_t *preference, tw_surface **out,
                           tw_error *error) {
  const tw_mesh *mesh = from->mesh;
  const tw_surface_options *options = from->options;
  tw_surface *s = tw_alloc_zero(1, sizeof *s);
  if (!s) return TW_NO_MEMORY;
  tw_surface_builder b = {.mesh = mesh,
                          .surface = s,
                          .parallel = from->parallel,
                          .inner = from->inner,
                          .arena = tw_arena_create(),
                          .points_arena = tw_arena_create(),
                          .preference = *preference,
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
  if (b.declined) *preference = b.preference + 1;
  if (status == TW_OK)
    *out = s;
  else
    tw_surface_destroy(s);
  return status;
}

/* ---- surfaces -------------------------------------------------------------------------------- */

static tw_status create(const tw_mesh *mesh, const tw_surface_options *options,
                        const tw_parallel_for *parallel, uint32_t *preference, tw_surface **out,
                        tw_error *error) {
  tw_surface *s;
  const surface_source from = {mesh, options, parallel, NULL};
  tw_status status = make_plan(&from, preference, &s, error);
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
  uint32_t next = 0, tried;
  do {
    tried = next;
    status = create(mesh, options, parallel, &next, out, error);
  } while (next != tried); /* the evaluator declined */
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
