/* The values of a surface from the cage to its base level, in the generic way. */
#include "surface_build.h"

#include <string.h>

#include "loop.h"
#include "open_border.h"

/* ---- at the cage ---------------------------------------------------------------------------- */

void *tw_build_gather(tw_arena *arena, const void *in, const uint32_t *indices, uint32_t count, size_t size) {
  void *out = tw_arena_alloc(arena, count, size);
  if (out) tw_gather_rows(in, indices, count, size, out);
  return out;
}

/* Fills in the cage's values of one set, base for now the same. */
static bool start_values(tw_build *b, tw_values *values, uint32_t field, uint32_t width, const float *in,
                         const uint32_t *indices) {
  values->field = field;
  values->width = width;
  bool stays = (b->levels == 0 && b->surface->loop.levels == 0) || b->surface->options.level == 0;
  tw_arena *arena = stays ? b->surface->arena : b->arena;
  values->cage = tw_build_gather(arena, in, indices, b->topologies[field].vertex_count, width * sizeof *in);
  values->base = values->cage;
  return values->cage != NULL;
}

static tw_status start_points(tw_build *b) {
  const tw_mesh *mesh = b->mesh;
  tw_surface *s = b->surface;
  const uint32_t *point_of = b->cage.point_of;
  bool complete = start_values(b, &s->positions, 0, 3, mesh->positions, point_of);
  if (mesh->colors) complete = complete && start_values(b, &s->colors, 0, 4, mesh->colors, point_of);
  s->morph_count = mesh->morph_count;
  s->morphs = tw_arena_alloc(s->arena, s->morph_count, sizeof *s->morphs);
  complete = complete && s->morphs;
  for (uint32_t m = 0; m < s->morph_count && complete; m++)
    complete = start_values(b, &s->morphs[m], 0, 3, mesh->morphs[m], point_of);
  return complete ? TW_OK : TW_NO_MEMORY;
}

static tw_status start_influences(tw_build *b) {
  tw_surface *s = b->surface;
  if (!b->mesh->skin.joints) return TW_OK;
  const uint32_t *point_of = b->cage.point_of;
  uint32_t vertices = b->topologies[0].vertex_count;
  tw_status status = tw_influences_init(&s->influences, b->mesh, point_of, vertices);
  if (status == TW_OK && s->options.level == 0 && b->levels > 0)
    status = tw_influences_init(&s->cage_influences, b->mesh, point_of, vertices);
  return status;
}

static tw_status start_uvs(tw_build *b) {
  tw_surface *s = b->surface;
  for (uint32_t i = 0; i < b->mesh->uv_set_count; i++) {
    const tw_uv_set *set = &b->mesh->uv_sets[i];
    uint32_t *values_of;
    tw_topology *t = &b->topologies[1 + i];
    tw_arena *arena = b->levels == 0 ? s->arena : b->arena;
    tw_status status = tw_uv_topology(&b->cage.topology, set, s->options.uv, arena, t, &values_of);
    if (status == TW_OK && b->rules.chaikin) status = tw_topology_copy_semi(t, &b->cage.topology, arena);
    if (status != TW_OK) return status;
    s->fields[1 + i].linear = b->rules.linear || s->options.uv == TW_UV_ALL;
    if (!start_values(b, &s->uvs[i], 1 + i, 2, set->values, values_of)) return TW_NO_MEMORY;
  }
  return TW_OK;
}

static tw_status start_sources(tw_build *b) {
  if (b->whole) return TW_OK;
  b->source = tw_arena_alloc(b->arena, b->mesh->face_count, sizeof *b->source);
  if (!b->source) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < b->mesh->face_count; f++) b->source[f] = f;
  return TW_OK;
}

tw_status tw_build_start(tw_build *b) {
  b->topologies[0] = b->cage.topology;
  tw_status status = start_points(b);
  if (status == TW_OK) status = start_influences(b);
  if (status == TW_OK) status = start_uvs(b);
  return status == TW_OK ? start_sources(b) : status;
}

/* ---- refining ------------------------------------------------------------------------------- */

/* Calls `change` for every set of values. */
typedef tw_status value_change(tw_build *b, const void *context, tw_arena *arena, tw_values *values);

static tw_status change_values(tw_build *b, value_change *change, const void *context, tw_arena *arena) {
  tw_surface *s = b->surface;
  tw_status status = change(b, context, arena, &s->positions);
  if (status == TW_OK && s->colors.base) status = change(b, context, arena, &s->colors);
  for (uint32_t m = 0; m < s->morph_count && status == TW_OK; m++)
    status = change(b, context, arena, &s->morphs[m]);
  for (uint32_t i = 0; i < b->mesh->uv_set_count && status == TW_OK; i++)
    status = change(b, context, arena, &s->uvs[i]);
  return status;
}

/* As refine_set, by Loop's scheme, in double. The last level's own are kept for normals alone, which live on
 * differences, and for the rows of Loop's scheme. */
static tw_status refine_exact(tw_build *b, const tw_topology *parents, tw_arena *arena, tw_values *values) {
  const tw_topology *parent = &parents[values->field];
  size_t before = (size_t)parent->vertex_count * values->width,
         after = (size_t)b->topologies[values->field].vertex_count * values->width;
  bool last = arena == b->surface->arena, rows = b->surface->loop.levels > 0,
       kept = values == &b->surface->positions && b->surface->options.normals;
  double *in = values->exact ? values->exact : tw_arena_alloc(b->arena, before, sizeof *in);
  double *out = tw_arena_alloc(last && kept ? arena : b->arena, after, sizeof *out);
  float *rounded = rows ? NULL : tw_arena_alloc(arena, after, sizeof *rounded);
  if (!in || !out || (!rows && !rounded)) return TW_NO_MEMORY;
  for (size_t i = 0; !values->exact && i < before; i++) in[i] = (double)values->base[i];
  tw_rules rules = tw_build_rules(b, values->field);
  tw_loop_values(parent, &rules, values->width, in, b->parallel, out);
  for (size_t i = 0; rounded && i < after; i++) rounded[i] = (float)out[i];
  values->base = rounded;
  values->exact = last && !kept && !rows ? NULL : out;
  return TW_OK;
}

/* context: the topologies of the level above. */
static tw_status refine_set(tw_build *b, const void *context, tw_arena *arena, tw_values *values) {
  const tw_topology *parents = context, *child = &b->topologies[values->field];
  if (tw_build_is_loop(b)) return refine_exact(b, parents, arena, values);
  float *out = tw_arena_alloc(arena, child->vertex_count, values->width * sizeof(float));
  if (!out) return TW_NO_MEMORY;
  tw_rules rules = tw_build_rules(b, values->field);
  tw_refine_values(&parents[values->field], &rules, values->width, values->base, b->parallel, out);
  values->base = out;
  return TW_OK;
}

static bool is_last(const tw_build *b, const tw_arena *arena) {
  return arena == b->surface->arena;
}

/* Where the topology of a field belongs at the level that goes to `arena`. */
static tw_arena *topology_arena(const tw_build *b, uint32_t field, tw_arena *arena) {
  return field == 0 && !is_last(b, arena) ? b->points_arena : arena;
}

static tw_status refine_field(tw_build *b, const tw_topology *parents, uint32_t field,
                              tw_arena *level_arena) {
  tw_arena *arena = topology_arena(b, field, level_arena);
  const tw_topology *parent = &parents[field];
  tw_topology *child = &b->topologies[field];
  tw_rules rules = tw_build_rules(b, field);
  tw_status status = tw_build_is_loop(b) ? tw_loop_topology(parent, &rules, arena, b->parallel, child)
                                         : tw_refine_topology(parent, &rules, arena, b->parallel, child);
  if (status == TW_OK && field > 0 && rules.chaikin)
    status = tw_topology_copy_semi(child, &b->topologies[0], arena);
  return status;
}

/* context: for each field, the old vertices that are kept. */
static tw_status cut_set(tw_build *b, const void *context, tw_arena *arena, tw_values *values) {
  uint32_t *const *kept = context;
  uint32_t count = b->topologies[values->field].vertex_count;
  const uint32_t *rows = kept[values->field];
  values->base = tw_build_gather(arena, values->base, rows, count, values->width * sizeof *values->base);
  bool exact = values->exact;
  if (exact)
    values->exact = tw_build_gather(arena, values->exact, rows, count, values->width * sizeof(double));
  return values->base && (!exact || values->exact) ? TW_OK : TW_NO_MEMORY;
}

/* Cuts the level that tw_build_refine has made back to the faces whose parents all exist. */
static tw_status cut_border(tw_build *b, const tw_topology *parent, tw_arena *arena) {
  uint32_t *faces, *kept[1 + TW_UV_SETS_MAX] = {NULL};
  uint32_t face_count = tw_open_faces(parent, &b->topologies[0], b->arena, &faces);
  tw_status status = faces ? TW_OK : TW_NO_MEMORY;
  for (uint32_t f = 0; f < b->surface->field_count && status == TW_OK; f++) {
    tw_topology full = b->topologies[f];
    tw_arena *own = topology_arena(b, f, arena);
    status = tw_open_cut(&full, faces, face_count, own, &b->topologies[f], &kept[f]);
  }
  tw_surface_step *step = &b->surface->steps[b->surface->step_count - 1];
  step->vertex_count = b->topologies[0].vertex_count;
  step->kept = kept[0];
  if (status == TW_OK) status = change_values(b, cut_set, kept, arena);
  if (status == TW_OK && b->mesh->skin.joints)
    status = tw_influences_keep(&b->surface->influences, kept[0], b->topologies[0].vertex_count);
  for (uint32_t q = 0; !b->whole && q < face_count && status == TW_OK; q++)
    b->source[q] = b->source[faces[q]];
  return status;
}

tw_status tw_build_refine(tw_build *b, tw_arena *arena) {
  tw_surface *s = b->surface;
  tw_topology parents[1 + TW_UV_SETS_MAX];
  memcpy(parents, b->topologies, sizeof parents);
  tw_status status = TW_OK;
  for (uint32_t f = 0; f < s->field_count && status == TW_OK; f++)
    status = refine_field(b, parents, f, arena);
  s->steps[s->step_count++] = (tw_surface_step){parents[0], b->topologies[0].vertex_count, NULL};
  if (status == TW_OK) status = change_values(b, refine_set, parents, arena);
  if (status == TW_OK && b->mesh->skin.joints)
    status = tw_influences_refine(&s->influences, &parents[0], &b->rules, tw_build_is_loop(b));
  if (status != TW_OK) return status;
  if (!b->whole) {
    uint32_t *source = tw_arena_alloc(b->arena, b->topologies[0].face_count, sizeof *source);
    if (!source) return TW_NO_MEMORY;
    for (uint32_t q = 0; q < b->topologies[0].face_count; q++)
      source[q] = b->source[tw_build_is_loop(b) ? q / 4 : tw_corner_face(&parents[0], q)];
    b->source = source;
  }
  return tw_cage_shrinks(&b->cage, &s->options) ? cut_border(b, &parents[0], arena) : TW_OK;
}
