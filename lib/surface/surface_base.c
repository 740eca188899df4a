/* From the cage to the base by generic steps: the topologies of points and channels, and all values of
 * vertices except positions. surface_positions.c takes the same steps for positions. */
#include <string.h>

#include "face_varying.h"
#include "limit.h"
#include "open_border.h"
#include "refine.h"
#include "surface_plan.h"
#include "tangent_space.h"

/* ---- at the cage ----------------------------------------------------------------------------- */

/* The arena for values of a level. Values of the base live as long as the surface if rows are read from them.
 * Other values live until the surface is made. */
static tw_arena *values_arena(const tw_surface_builder *b, uint32_t level) {
  bool stays = level == b->levels && b->surface->evaluator->reads_base;
  return stays ? b->surface->arena : b->arena;
}

/* The arena for a topology. The points' topologies between cage and base are kept apart: a movable surface
 * needs them for other positions. */
static tw_arena *topology_arena(const tw_surface_builder *b, uint32_t field, uint32_t level) {
  tw_arena *arena = values_arena(b, level);
  return arena == b->arena && field == 0 ? b->points_arena : arena;
}

/* Fills in one set's values at the cage; until steps are taken they are the values of the base too. indices:
 * the element of `in` at each vertex; NULL: in order. */
static bool start_values(tw_surface_builder *b, tw_values *values, const float *in, const uint32_t *indices) {
  tw_arena *arena = b->surface->options.level == 0 ? b->surface->arena : values_arena(b, 0);
  uint32_t count = b->topologies[values->field].vertex_count;
  values->cage = tw_arena_gather(arena, in, indices, count, values->width * sizeof *in);
  values->base = values->cage;
  return values->cage != NULL;
}

/* Keeps whole numbers as they are at the corners of the cage. */
static bool keep_whole(tw_surface_builder *b, const tw_attribute *from, tw_values *values) {
  const uint32_t *index = from->corners ? from->corners : b->mesh->corners;
  values->at_corners = tw_arena_gather(b->surface->arena, from->values, index, b->mesh->corner_count,
                                       from->width * sizeof *from->values);
  return values->at_corners != NULL;
}

/* values_of: for each field the index of the value at each vertex. */
static tw_status start_attributes(tw_surface_builder *b, uint32_t *const *values_of) {
  const tw_mesh *mesh = b->mesh;
  for (uint32_t i = 0, channel = mesh->uv_set_count; i < mesh->attribute_count; i++) {
    const tw_attribute *from = &mesh->attributes[i];
    tw_values *values = &b->surface->smooth[i];
    *values = (tw_values){.width = from->width};
    if (from->corners) values->field = b->channel_fields[channel++];
    const uint32_t *indices = values->field > 0 ? values_of[values->field] : b->cage.point_of;
    bool is_whole = from->numbers != TW_NUMBERS_REAL;
    if (!(is_whole ? keep_whole(b, from, values) : start_values(b, values, from->values, indices)))
      return TW_NO_MEMORY;
  }
  return TW_OK;
}

/* Starts the sets of attributes, then of displacements. */
static tw_status start_smooth(tw_surface_builder *b, uint32_t *const *values_of) {
  const tw_mesh *mesh = b->mesh;
  tw_surface *s = b->surface;
  s->smooth = tw_arena_alloc(s->arena, tw_smooth_set_count(s), sizeof *s->smooth);
  if (!s->smooth) return TW_NO_MEMORY;
  s->displacements = s->smooth + s->attribute_count;
  tw_status status = start_attributes(b, values_of);
  for (uint32_t i = 0; i < mesh->morph_count && status == TW_OK; i++) {
    tw_values *values = &s->displacements[i];
    values->width = 3;
    if (!start_values(b, values, mesh->morphs[i], b->cage.point_of)) status = TW_NO_MEMORY;
  }
  return status;
}

static tw_status start_influences(tw_surface_builder *b) {
  tw_surface *s = b->surface;
  if (!b->mesh->skin.joints) return TW_OK;
  const uint32_t *point_of = b->cage.point_of;
  uint32_t vertices = b->topologies[0].vertex_count;
  tw_status status = tw_influences_init(&s->influences, b->mesh, point_of, vertices);
  if (status == TW_OK && s->options.level == 0 && b->levels > 0)
    status = tw_influences_init(&s->cage_influences, b->mesh, point_of, vertices);
  return status;
}

/* Makes the topologies of the channels. values_of: receives, for each field, the index of the value at each
 * vertex. */
static tw_status start_channels(tw_surface_builder *b, uint32_t **values_of) {
  tw_surface *s = b->surface;
  uint32_t made = 1;
  for (uint32_t i = 0; i < b->channel_count; i++) {
    uint32_t field = b->channel_fields[i];
    if (field < made) continue; /* shared */
    tw_topology *t = &b->topologies[made++];
    tw_arena *arena = topology_arena(b, field, 0);
    tw_status status = tw_channel_topology(&b->cage.topology, b->channels[i].corners, s->options.uv, arena, t,
                                           &values_of[field]);
    if (status == TW_OK && s->rules.chaikin) status = tw_topology_copy_semi(t, &b->cage.topology, arena);
    if (status == TW_OK) status = tw_parallel_for_status(b->parallel);
    if (status != TW_OK) return status;
    t->polygonal = b->cage.topology.polygonal;
  }
  return TW_OK;
}

static tw_status start_uvs(tw_surface_builder *b, uint32_t *const *values_of) {
  tw_surface *s = b->surface;
  for (uint32_t i = 0; i < b->mesh->uv_set_count; i++) {
    s->uvs[i] = (tw_values){.field = 1 + i, .width = 2, .is_sloped = tw_builder_has_tangents(b)};
    if (!start_values(b, &s->uvs[i], b->mesh->uv_sets[i].values, values_of[1 + i])) return TW_NO_MEMORY;
  }
  return TW_OK;
}

static tw_status start_sources(tw_surface_builder *b) {
  if (b->keeps_all_faces) return TW_OK;
  b->source = tw_arena_alloc(b->arena, b->mesh->face_count, sizeof *b->source);
  if (!b->source) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < b->mesh->face_count; f++) b->source[f] = f;
  return TW_OK;
}

static tw_status start_base(tw_surface_builder *b) {
  b->topologies[0] = b->cage.topology;
  b->surface->steps[0].topology = b->cage.topology;
  uint32_t *values_of[TW_FIELDS_MAX] = {NULL};
  tw_status status = start_channels(b, values_of);
  if (status == TW_OK) status = start_smooth(b, values_of);
  if (status == TW_OK) status = start_influences(b);
  if (status == TW_OK) status = start_uvs(b, values_of);
  for (uint32_t f = 0; f < b->surface->field_count; f++) b->cage_vertices[f] = b->topologies[f].vertex_count;
  return status == TW_OK ? start_sources(b) : status;
}

/* ---- a step ---------------------------------------------------------------------------------- */

/* Changes one set of values that are mixed; context is the function's own. */
typedef tw_status value_change(tw_surface_builder *b, const void *context, tw_values *values);

static tw_status change_values(tw_surface_builder *b, value_change *change, const void *context) {
  tw_surface *s = b->surface;
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < tw_smooth_set_count(s) && status == TW_OK; i++)
    if (!s->smooth[i].at_corners) status = change(b, context, &s->smooth[i]);
  for (uint32_t i = 0; i < b->mesh->uv_set_count && status == TW_OK; i++)
    status = change(b, context, &s->uvs[i]);
  return status;
}

/* Refines a set by one step. context: the topologies of the level above, one for each field. */
static tw_status refine_set(tw_surface_builder *b, const void *context, tw_values *values) {
  const tw_topology *parent = (const tw_topology *)context + values->field;
  size_t before = (size_t)parent->vertex_count * values->width,
         after = (size_t)b->topologies[values->field].vertex_count * values->width;
  double *in = values->exact ? values->exact : tw_arena_alloc_raw(b->arena, before, sizeof *in);
  double *out = tw_arena_alloc_raw(b->arena, after, sizeof *out);
  if (!in || !out) return TW_NO_MEMORY;
  for (size_t i = 0; !values->exact && i < before; i++) in[i] = (double)values->base[i];
  values->exact = out;
  tw_rules rules = tw_builder_rules(b, values->field);
  tw_status status = tw_refine_values(parent, &rules, values->width, in, b->parallel, out);
  return status == TW_OK ? tw_parallel_for_status(b->parallel) : status;
}

/* Cuts a set back to the vertices that are kept. context: for each field, the old numbers of these
 * vertices. */
static tw_status cut_set(tw_surface_builder *b, const void *context, tw_values *values) {
  uint32_t *const *kept = context;
  uint32_t count = b->topologies[values->field].vertex_count;
  tw_gather_rows(values->exact, kept[values->field], count, values->width * sizeof *values->exact,
                 values->exact);
  return TW_OK;
}

static tw_status refine_field(tw_surface_builder *b, const tw_topology *parents, uint32_t field,
                              tw_arena *arena) {
  tw_topology *child = &b->topologies[field];
  tw_rules rules = tw_builder_rules(b, field);
  tw_status status = tw_refine_topology(&parents[field], &rules, arena, b->parallel, child);
  if (status == TW_OK && field > 0 && rules.chaikin)
    status = tw_topology_copy_semi(child, &b->topologies[0], arena);
  return status == TW_OK ? tw_parallel_for_status(b->parallel) : status;
}

static tw_status refine_sources(tw_surface_builder *b, const tw_topology *parent) {
  if (b->keeps_all_faces) return TW_OK;
  uint32_t count = b->topologies[0].face_count, *source = tw_arena_alloc_raw(b->arena, count, sizeof *source);
  if (!source) return TW_NO_MEMORY;
  for (uint32_t q = 0; q < count; q++)
    source[q] = b->source[b->surface->rules.loop ? q / 4 : tw_corner_face(parent, q)];
  b->source = source;
  return TW_OK;
}

/* Keeps the numbers that faces have where no border is cut off. faces: those that are left, in the numbers of
 * the children of the level before. */
static tw_status cut_origins(tw_surface_builder *b, const uint32_t *faces, uint32_t face_count) {
  tw_surface *s = b->surface;
  enum { CHILDREN = 4 }; /* of a face that is itself a child */
  if (!b->has_whole_numbers) return TW_OK;
  uint32_t *origins = tw_arena_alloc_raw(s->arena, face_count, sizeof *origins);
  if (!origins) return TW_NO_MEMORY;
  for (uint32_t q = 0; q < face_count; q++)
    origins[q] = s->origins ? CHILDREN * s->origins[faces[q] / CHILDREN] + faces[q] % CHILDREN : faces[q];
  s->origins = origins;
  return TW_OK;
}

/* Cuts a level back to the faces whose parents all exist, and of the rim's levels to the rim and what touches
 * it. */
static tw_status cut_border(tw_surface_builder *b, const tw_topology *parent, uint32_t level) {
  uint32_t *faces, *kept[TW_FIELDS_MAX] = {NULL};
  const uint8_t *near = b->origins ? tw_rim_vertices(b, parent) : NULL;
  if (b->origins && !near) return TW_NO_MEMORY;
  uint32_t face_count = tw_open_faces(parent, &b->topologies[0], near, b->arena, &faces);
  tw_status status = faces ? TW_OK : TW_NO_MEMORY;
  for (uint32_t f = 0; f < b->surface->field_count && status == TW_OK; f++) {
    tw_topology full = b->topologies[f];
    status = tw_open_cut(&full, faces, face_count, topology_arena(b, f, level), &b->topologies[f], &kept[f]);
  }
  b->surface->steps[level].kept = kept[0];
  if (status == TW_OK) status = change_values(b, cut_set, kept);
  if (status == TW_OK && b->mesh->skin.joints)
    status = tw_influences_keep(&b->surface->influences, kept[0], b->topologies[0].vertex_count);
  for (uint32_t q = 0; !b->keeps_all_faces && q < face_count && status == TW_OK; q++)
    b->source[q] = b->source[faces[q]];
  if (status == TW_OK && b->origins) status = tw_rim_cut(b, faces, face_count);
  return status == TW_OK ? cut_origins(b, faces, face_count) : status;
}

/* Makes the next level. uncut: NULL, or the arena for topologies that the border is cut from. */
static tw_status refine_all(tw_surface_builder *b, uint32_t level, tw_arena *uncut) {
  tw_surface *s = b->surface;
  tw_topology parents[TW_FIELDS_MAX];
  memcpy(parents, b->topologies, sizeof parents);
  tw_status status = TW_OK;
  for (uint32_t f = 0; f < s->field_count && status == TW_OK; f++)
    status = refine_field(b, parents, f, uncut ? uncut : topology_arena(b, f, level));
  if (status == TW_OK) status = change_values(b, refine_set, parents);
  if (status == TW_OK && b->mesh->skin.joints)
    status = tw_influences_refine(&s->influences, &parents[0], &s->rules);
  if (status == TW_OK) status = refine_sources(b, &parents[0]);
  return status == TW_OK && uncut ? cut_border(b, &parents[0], level) : status;
}

static tw_status make_level(tw_surface_builder *b, uint32_t level) {
  tw_surface *s = b->surface;
  bool shrinks = tw_cage_shrinks(&b->cage, &s->options);
  tw_arena *uncut = shrinks ? tw_arena_create() : NULL;
  tw_status status = shrinks && !uncut ? TW_NO_MEMORY : refine_all(b, level, uncut);
  tw_arena_destroy(uncut);
  s->steps[level].topology = b->topologies[0];
  s->step_count = level;
  return status == TW_OK ? tw_parallel_for_status(b->parallel) : status;
}

/* ---- the base -------------------------------------------------------------------------------- */

/* Rounds a set's values at the base to float. context: unused. */
static tw_status round_set(tw_surface_builder *b, const void *context, tw_values *values) {
  size_t count = (size_t)b->topologies[values->field].vertex_count * values->width;
  (void)context;
  if (!values->exact) return TW_OK;
  values->base = tw_arena_alloc_raw(values_arena(b, b->levels), count, sizeof *values->base);
  if (!values->base) return TW_NO_MEMORY;
  for (size_t i = 0; i < count; i++) values->base[i] = (float)values->exact[i];
  values->exact = NULL;
  return TW_OK;
}

tw_status tw_builder_base(tw_surface_builder *b) {
  tw_status status = start_base(b);
  b->surface->base_level = b->levels;
  for (uint32_t level = 1; level <= b->levels && status == TW_OK; level++) {
    if (b->inner && level == b->inner->levels + 1) status = tw_rim_begin(b);
    if (status == TW_OK) status = make_level(b, level);
  }
  return status == TW_OK ? change_values(b, round_set, NULL) : status;
}

tw_status tw_builder_find_frames(tw_surface_builder *b) {
  tw_surface *s = b->surface;
  const uint8_t *sets = b->mesh->tangent_uvs;
  uint32_t faces = b->topologies[0].face_count;
  if (!tw_builder_has_tangents(b)) return TW_OK;
  s->tangent_frames = tw_arena_alloc_raw(s->arena, faces, 1);
  if (!s->tangent_frames) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < faces; f++) {
    uint32_t set = sets ? sets[b->source ? b->source[f] : f] : 0;
    bool mirrored = tw_uv_is_mirrored(&b->topologies[1 + set], s->uvs[set].base, f);
    s->tangent_frames[f] = (uint8_t)(2 * set + mirrored);
  }
  return TW_OK;
}

/* ---- what evaluators ask --------------------------------------------------------------------- */

bool tw_builder_cage_is_base(const tw_surface_builder *b) {
  const tw_topology *cage = &b->cage.topology;
  bool loop = b->surface->rules.loop;
  if (cage->face_size != (loop ? 3 : 4)) return false;
  for (size_t c = 0; !loop && c < cage->corner_count; c += 4) {
    const uint32_t *quad = cage->corner_vertex + c;
    if (quad[0] == quad[2] || quad[1] == quad[3]) return false;
  }
  return true;
}

bool tw_builder_crosses_seams(const tw_surface_builder *b) {
  const tw_mesh *mesh = b->mesh;
  if (b->surface->options.creasing != TW_CREASE_CHAIKIN || b->channel_count == 0) return false;
  for (uint32_t i = 0; i < mesh->crease_count; i++)
    if (tw_is_semi_sharp(mesh->crease_sharpness[i])) return true;
  return false;
}

void tw_builder_need_masks(tw_surface *s, const tw_topology *t) {
  uint32_t capacity = tw_limit_greatest_capacity(t);
  if (capacity > s->mask_capacity) s->mask_capacity = capacity;
}

tw_status tw_builder_fail_fans(tw_error *error) {
  return tw_fail(error, TW_LIMIT,
                 "thousands of faces meet in a point, each with a normal of its own: normals=none without "
                 "limit=true can do without");
}
