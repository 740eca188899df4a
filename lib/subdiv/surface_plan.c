/* From a control mesh to a surface that can be read at any place: refine to the base level in the
 * generic way, number what the answer will hold, plan patches for the rest. */
#include "surface.h"

#include <stdlib.h>
#include <string.h>

#include "cage.h"
#include "limit.h"
#include "open_border.h"
#include "patch_stencils.h"
#include "refine.h"
#include "tangent_space.h"

/* What only the next level needs lives in `arena`. */
typedef struct build {
  const tw_mesh *mesh;
  tw_surface *surface;
  const tw_parallel_for *parallel;
  tw_rules rules;
  tw_detail_list details;
  tw_arena *arena;
  tw_arena *points_arena; /* the cage, and the points' topologies between it and the base */
  tw_cage cage;
  uint32_t levels;    /* from the cage to the base */
  bool whole;         /* the answer holds all faces in the order of the cage */
  bool morph_normals; /* targets displace normals */
  bool too_irregular; /* patches gave up */
  tw_topology topologies[1 + TW_UV_SETS_MAX];
  uint32_t *source; /* [faces] cage face of each face */
} build;

static bool is_loop(const build *b) {
  return b->surface->options.scheme == TW_LOOP;
}

static tw_rules rules_of(const build *b, uint32_t field) {
  tw_rules rules = b->rules;
  rules.linear = b->surface->fields[field].linear;
  return rules;
}

/* Tangents are for normal maps, which need normals and UVs. */
static bool has_tangents(const build *b) {
  return b->mesh->has_tangents && b->mesh->uv_set_count > 0 && b->surface->options.normals;
}

/* Attributes, then displacements. */
static uint32_t smooth_count(const tw_mesh *mesh) {
  return mesh->attribute_count + mesh->morph_count;
}

/* Says of them what needs no values. */
static tw_status begin_smooth(build *b) {
  const tw_mesh *mesh = b->mesh;
  tw_surface *s = b->surface;
  s->smooth = tw_arena_alloc(s->arena, smooth_count(mesh), sizeof *s->smooth);
  if (!s->smooth) return TW_NO_MEMORY;
  s->attribute_count = mesh->attribute_count;
  s->morph_count = mesh->morph_count;
  for (uint32_t i = 0; i < smooth_count(mesh); i++) {
    bool is_morph = i >= mesh->attribute_count;
    s->smooth[i].width = is_morph ? 3 : mesh->attributes[i].width;
    s->smooth[i].is_color = !is_morph && mesh->attributes[i].is_color;
  }
  return TW_OK;
}

/* Their values at the mesh's points. */
static const float *smooth_source(const tw_mesh *mesh, uint32_t i) {
  uint32_t attributes = mesh->attribute_count;
  return i < attributes ? mesh->attributes[i].values : mesh->morphs[i - attributes];
}

/* ---- sharing out the levels: what can be done
 * ----------------------------------------------------------------------- */

/* An open border removes faces: only a single group is sure to keep its order. */
static bool is_whole(const build *b) {
  if (b->mesh->tangent_uvs) return false; /* which face a quad comes from has to be known */
  uint32_t groups = tw_ordered_groups(b->mesh, b->cage.visible);
  return groups == 1 || (groups > 1 && !tw_cage_shrinks(&b->cage, &b->surface->options));
}

/* Chaikin's rule looks across UV seams at the sharpness beyond them, which a patch does not see. */
static bool crosses_seams(const tw_mesh *mesh, const tw_surface_options *options) {
  if (options->creasing != TW_CREASE_CHAIKIN || mesh->uv_set_count == 0) return false;
  for (uint32_t i = 0; i < mesh->crease_count; i++)
    if (tw_is_semi_sharp(mesh->crease_sharpness[i])) return true;
  return false;
}

/* Whether rows hold refined points, at most with normals. */
static bool is_bare(const build *b) {
  const tw_mesh *m = b->mesh;
  const tw_surface_options *options = &b->surface->options;
  bool points_only = m->uv_set_count == 0 && smooth_count(m) == 0 && !m->skin.joints && b->details.count == 0;
  return points_only && options->level > 0 && b->whole && !options->limit &&
         !tw_cage_shrinks(&b->cage, options);
}

static bool fits_loop_rows(const build *b) {
  const tw_surface_options *options = &b->surface->options;
  if (!is_loop(b)) return false;
  return !options->normals || tw_loop_rows_fit_normals(&b->cage.topology, &b->rules, options->level);
}

/* ---- sharing out the levels: what is worth it
 * ----------------------------------------------------------------------- */

enum { LEVELS_BYTES_MAX = 128 << 20 };

/* Whether nearly all vertices of a mesh of quads have four faces: patches are then quicker from level 3 on.
 */
static bool is_regular(const tw_topology *t) {
  uint32_t regular = 0;
  for (uint32_t v = 0; v < t->vertex_count; v++)
    if (t->fan_offsets[v + 1] - t->fan_offsets[v] == 4) regular++;
  return t->face_size == 4 && regular > t->vertex_count / 8 * 7;
}

/* Whether all points of the level can be kept and rows read from them. Faces that are left out are for
 * patches. */
static bool fits_levels(const build *b) {
  const tw_mesh *m = b->mesh;
  const tw_surface *s = b->surface;
  const tw_surface_options *options = &s->options;
  const tw_topology *cage = &b->cage.topology;
  if (options->scheme != TW_CATMULL_CLARK || options->level == 0 || options->level > TW_LEVELS_MAX)
    return false;
  if (m->face_count == 0 || b->details.count > 0) return false;
  if (b->rules.smooth_triangles && cage->face_size != 4) return false;
  if (memchr(b->cage.visible, 0, cage->face_count) || tw_cage_shrinks(&b->cage, options)) return false;
  if (m->skin.joints && !tw_skin_fits_levels(m)) return false;
  uint32_t uv_copies = options->limit && has_tangents(b) ? 2 : 1;
  uint64_t sets = (options->limit && options->normals ? 2u : 1u) + uv_copies * m->uv_set_count +
                  (m->skin.joints ? 2u : 0u) + smooth_count(m) +
                  (b->morph_normals ? (options->limit ? 2u : 1u) * m->morph_count : 0u);
  if (s->counts.vertices * sets * sizeof(tw_point) > LEVELS_BYTES_MAX || !tw_levels_fit(cage)) return false;
  return options->level < 3 || !is_regular(cage);
}

/* ---- sharing out the levels ------------------------------------------------------------------ */

/* Rows of the last levels, in place of as many generic steps. */
static void choose_rows(build *b) {
  tw_surface *s = b->surface;
  if (!is_bare(b) || !fits_loop_rows(b)) return;
  s->loop.levels = tw_loop_rows_fit(&b->cage.topology, &b->rules, s->options.level);
  s->loop.normals = s->options.normals;
  b->levels -= s->loop.levels;
}

static tw_status choose(build *b, bool generic, tw_error *error) {
  tw_surface *s = b->surface;
  uint32_t level = s->options.level, deepest = tw_deepest_detail(&b->details);
  b->whole = is_whole(b);
  bool small = b->cage.refined_faces <= TW_GENERIC_FACES_MAX, loop = is_loop(b),
       even = b->cage.topology.face_size == (loop ? 3 : 4);
  if (generic && !small)
    return tw_fail(error, TW_LIMIT,
                   "the mesh is too irregular for level %u: it has great poles, or thousands of "
                   "different sharpness values",
                   level);
  if (fits_levels(b)) {
    s->way = TW_WAY_LEVELS;
    s->side = s->cage_step = 1;
    return TW_OK;
  }
  bool few = !even && level <= 1;
  generic |= tw_cage_shrinks(&b->cage, &s->options) || loop ||
             (small && (few || crosses_seams(b->mesh, &s->options)));
  b->levels = (generic || level <= deepest) && level > 0 ? level : even ? 0 : 1;
  if (deepest < level && deepest > b->levels) b->levels = deepest;
  s->depth = level > b->levels ? level - b->levels : 0;
  s->side = 1u << s->depth;
  s->cage_step = b->levels == 0 ? 1 : 4;
  choose_rows(b);
  s->way = s->loop.levels > 0 ? TW_WAY_LOOP : s->depth > 0 ? TW_WAY_PATCHES : TW_WAY_BASE;
  s->steps = tw_arena_alloc(s->arena, b->levels, sizeof *s->steps);
  return s->steps ? TW_OK : TW_NO_MEMORY;
}

/* ---- at the cage ----------------------------------------------------------------------------- */

static void *gather(tw_arena *arena, const void *in, const uint32_t *indices, uint32_t count, size_t size) {
  void *out = tw_arena_alloc(arena, count, size);
  if (out) tw_gather_rows(in, indices, count, size, out);
  return out;
}

/* At the level that is being made. */
static tw_detail_step detail_step(const build *b) {
  const tw_surface *s = b->surface;
  return (tw_detail_step){&b->details, &b->topologies[0], &b->rules, s->step_count, s->options.level};
}

/* Fills in the cage's values of one set, base for now the same. */
static bool start_values(build *b, tw_values *values, const float *in, const uint32_t *indices) {
  bool stays = (b->levels == 0 && b->surface->loop.levels == 0) || b->surface->options.level == 0;
  tw_arena *arena = stays ? b->surface->arena : b->arena;
  uint32_t count = b->topologies[values->field].vertex_count;
  values->cage = gather(arena, in, indices, count, values->width * sizeof *in);
  values->base = values->cage;
  return values->cage != NULL;
}

static tw_status start_points(build *b) {
  const tw_mesh *mesh = b->mesh;
  tw_surface *s = b->surface;
  const uint32_t *point_of = b->cage.point_of;
  s->positions.width = 3;
  const tw_detail_step step = detail_step(b);
  bool complete = start_values(b, &s->positions, mesh->positions, point_of);
  for (uint32_t i = 0; i < smooth_count(mesh) && complete; i++)
    complete = start_values(b, &s->smooth[i], smooth_source(mesh, i), point_of);
  return complete ? tw_details_add_floats(&step, b->parallel, s->positions.base) : TW_NO_MEMORY;
}

static tw_status start_influences(build *b) {
  tw_surface *s = b->surface;
  if (!b->mesh->skin.joints) return TW_OK;
  const uint32_t *point_of = b->cage.point_of;
  uint32_t vertices = b->topologies[0].vertex_count;
  tw_status status = tw_influences_init(&s->influences, b->mesh, point_of, vertices);
  if (status == TW_OK && s->options.level == 0 && b->levels > 0)
    status = tw_influences_init(&s->cage_influences, b->mesh, point_of, vertices);
  return status;
}

static tw_status start_uvs(build *b) {
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
    s->uvs[i].field = 1 + i;
    s->uvs[i].width = 2;
    if (!start_values(b, &s->uvs[i], set->values, values_of)) return TW_NO_MEMORY;
  }
  return TW_OK;
}

static tw_status start_sources(build *b) {
  if (b->whole) return TW_OK;
  b->source = tw_arena_alloc(b->arena, b->mesh->face_count, sizeof *b->source);
  if (!b->source) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < b->mesh->face_count; f++) b->source[f] = f;
  return TW_OK;
}

static tw_status start_base(build *b) {
  b->topologies[0] = b->cage.topology;
  tw_status status = start_points(b);
  if (status == TW_OK) status = start_influences(b);
  if (status == TW_OK) status = start_uvs(b);
  return status == TW_OK ? start_sources(b) : status;
}

/* ---- refining -------------------------------------------------------------------------------- */

/* Calls `change` for every set of values. */
typedef tw_status value_change(build *b, const void *context, tw_arena *arena, tw_values *values);

static tw_status change_values(build *b, value_change *change, const void *context, tw_arena *arena) {
  tw_surface *s = b->surface;
  tw_status status = change(b, context, arena, &s->positions);
  for (uint32_t i = 0; i < smooth_count(b->mesh) && status == TW_OK; i++)
    status = change(b, context, arena, &s->smooth[i]);
  for (uint32_t i = 0; i < b->mesh->uv_set_count && status == TW_OK; i++)
    status = change(b, context, arena, &s->uvs[i]);
  return status;
}

/* context: the topologies of the level above. The last level's own doubles are kept for the normals of masks
 * alone, which live on differences, and for the rows of Loop's scheme. */
static tw_status refine_set(build *b, const void *context, tw_arena *arena, tw_values *values) {
  const tw_topology *parent = (const tw_topology *)context + values->field;
  const tw_surface *s = b->surface;
  size_t before = (size_t)parent->vertex_count * values->width,
         after = (size_t)b->topologies[values->field].vertex_count * values->width;
  bool last = arena == s->arena, rows = s->loop.levels > 0,
       kept = values == &s->positions && s->options.normals && s->depth == 0;
  double *in = values->exact ? values->exact : tw_arena_alloc(b->arena, before, sizeof *in);
  double *out = tw_arena_alloc(last && kept ? arena : b->arena, after, sizeof *out);
  float *rounded = rows ? NULL : tw_arena_alloc(arena, after, sizeof *rounded);
  if (!in || !out || (!rows && !rounded)) return TW_NO_MEMORY;
  for (size_t i = 0; !values->exact && i < before; i++) in[i] = (double)values->base[i];
  tw_rules rules = rules_of(b, values->field);
  tw_status status = tw_refine_values(parent, &rules, values->width, in, b->parallel, out);
  const tw_detail_step step = detail_step(b);
  if (status == TW_OK && values == &s->positions) status = tw_details_add(&step, b->parallel, out);
  for (size_t i = 0; rounded && i < after; i++) rounded[i] = (float)out[i];
  values->base = rounded;
  values->exact = last && !kept && !rows ? NULL : out;
  return status;
}

static bool is_last(const build *b, const tw_arena *arena) {
  return arena == b->surface->arena;
}

/* Where the topology of a field belongs at the level that goes to `arena`. */
static tw_arena *topology_arena(const build *b, uint32_t field, tw_arena *arena) {
  return field == 0 && !is_last(b, arena) ? b->points_arena : arena;
}

static tw_status refine_field(build *b, const tw_topology *parents, uint32_t field, tw_arena *level_arena) {
  tw_arena *arena = topology_arena(b, field, level_arena);
  const tw_topology *parent = &parents[field];
  tw_topology *child = &b->topologies[field];
  tw_rules rules = rules_of(b, field);
  tw_status status = tw_refine_topology(parent, &rules, arena, b->parallel, child);
  if (status == TW_OK && field > 0 && rules.chaikin)
    status = tw_topology_copy_semi(child, &b->topologies[0], arena);
  return status;
}

/* context: for each field, the old vertices that are kept. */
static tw_status cut_set(build *b, const void *context, tw_arena *arena, tw_values *values) {
  uint32_t *const *kept = context;
  uint32_t count = b->topologies[values->field].vertex_count;
  const uint32_t *rows = kept[values->field];
  values->base = gather(arena, values->base, rows, count, values->width * sizeof *values->base);
  bool exact = values->exact;
  if (exact) values->exact = gather(arena, values->exact, rows, count, values->width * sizeof(double));
  return values->base && (!exact || values->exact) ? TW_OK : TW_NO_MEMORY;
}

/* Cuts the level that refine_level has made back to the faces whose parents all exist. */
static tw_status cut_border(build *b, const tw_topology *parent, tw_arena *arena) {
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

static tw_status refine_level(build *b, tw_arena *arena) {
  tw_surface *s = b->surface;
  tw_topology parents[1 + TW_UV_SETS_MAX];
  memcpy(parents, b->topologies, sizeof parents);
  tw_status status = TW_OK;
  for (uint32_t f = 0; f < s->field_count && status == TW_OK; f++)
    status = refine_field(b, parents, f, arena);
  s->steps[s->step_count++] = (tw_surface_step){parents[0], b->topologies[0].vertex_count, NULL};
  if (status == TW_OK) status = change_values(b, refine_set, parents, arena);
  if (status == TW_OK && b->mesh->skin.joints)
    status = tw_influences_refine(&s->influences, &parents[0], &b->rules);
  if (status != TW_OK) return status;
  if (!b->whole) {
    uint32_t *source = tw_arena_alloc(b->arena, b->topologies[0].face_count, sizeof *source);
    if (!source) return TW_NO_MEMORY;
    for (uint32_t q = 0; q < b->topologies[0].face_count; q++)
      source[q] = b->source[is_loop(b) ? q / 4 : tw_corner_face(&parents[0], q)];
    b->source = source;
  }
  return tw_cage_shrinks(&b->cage, &s->options) ? cut_border(b, &parents[0], arena) : TW_OK;
}

/* ---- rows of the base ------------------------------------------------------------------------ */

/* Rows that stand for vertices of the cage: they come first in every numbering. */
static uint32_t rows_of_cage(const tw_numbering *n, const tw_topology *base, uint32_t cage_vertices) {
  if (n->same_as) return cage_vertices;
  uint32_t count = 0;
  while (count < n->corner_count && base->corner_vertex[n->corner_base[count]] < cage_vertices) count++;
  return count;
}

static bool needs_splits(const build *b, bool split_normals) {
  if (b->mesh->uv_set_count > 0 || tw_has_own_normals(b->mesh, &b->surface->options)) return true;
  return split_normals && (b->rules.linear || tw_topology_parts_normals(&b->topologies[0]));
}

static tw_status find_frames(build *b, const float *const uvs[]) {
  tw_surface *s = b->surface;
  const uint8_t *sets = b->mesh->tangent_uvs;
  uint32_t faces = b->topologies[0].face_count;
  s->tangent_frames = tw_arena_alloc(s->arena, faces, 1);
  if (!s->tangent_frames) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < faces; f++) {
    uint32_t set = sets ? sets[b->source ? b->source[f] : f] : 0;
    bool mirrored = tw_uv_is_mirrored(&b->topologies[1 + set], uvs[set], f);
    s->tangent_frames[f] = (uint8_t)(2 * set + mirrored);
  }
  return TW_OK;
}

static tw_status split_vertices(build *b, const uint8_t *visible, uint32_t cage_vertices) {
  tw_surface *s = b->surface;
  const tw_topology *base = &s->fields[0].base;
  bool has_own = tw_has_own_normals(b->mesh, &s->options);
  tw_own_normals own = {.tangents = has_tangents(b), .morphs = b->morph_normals};
  tw_splits splits = {.uv_count = b->mesh->uv_set_count, .normals = s->options.normals};
  const float *uvs[TW_UV_SETS_MAX];
  for (uint32_t i = 0; i < splits.uv_count; i++) {
    splits.uv_bases[i] = &s->fields[1 + i].base;
    uvs[i] = s->uvs[i].base;
  }
  /* Of a bilinear surface every edge of the cage is sharp: at each level their parts come first. */
  splits.sharp_below = b->rules.linear ? b->cage.topology.edge_count << b->levels : 0;
  tw_status status = has_tangents(b) ? find_frames(b, uvs) : TW_OK;
  splits.tangent_frames = s->tangent_frames;
  if (status == TW_OK && has_own) {
    status = tw_own_normals_read(s, b->mesh, b->arena, &own);
    splits.own_normals = own.splits;
    splits.normals &= !own.is_whole; /* they alone say what parts */
  }
  if (status == TW_OK) status = tw_number_vertices(base, &splits, visible, s->arena, &s->vertices);
  if (status == TW_OK && has_own)
    status = tw_own_normals_keep(s, b->mesh, &own, rows_of_cage(&s->vertices, base, cage_vertices));
  return status;
}

static tw_status create(const tw_mesh *mesh, const tw_surface_options *options,
                        const tw_parallel_for *parallel, bool generic, tw_surface **out, bool *too_irregular,
                        tw_error *error);

/* Gives points the order that they have without what is modelled onto this level and deeper ones, so that the
 * rows that somebody took from it and moved still fit. */
static tw_status order_points(build *b) {
  tw_surface *s = b->surface, *before;
  const tw_topology *base = &s->fields[0].base;
  tw_mesh mesh = *b->mesh;
  mesh.detail_count = tw_coarser_details(&b->details, s->options.level).count;
  tw_surface_options options = s->options;
  options.shapes = NULL;
  options.movable = false;
  bool too_irregular = false;
  tw_status status = create(&mesh, &options, b->parallel, false, &before, &too_irregular, NULL);
  if (status == TW_NO_MEMORY || status == TW_CANCELLED) return status;
  if (status != TW_OK) return TW_OK; /* there are no such rows: the numbers of the level serve */
  uint32_t rows = (uint32_t)tw_surface_row_count(before, TW_DOMAIN_POINTS);
  uint32_t *vertices = tw_arena_alloc_raw(b->arena, rows, sizeof *vertices);
  if (vertices) tw_surface_vertices_of_points(before, base, vertices);
  status = vertices ? tw_number_vertices_as(base, vertices, rows, s->arena, &s->points) : TW_NO_MEMORY;
  tw_surface_destroy(before);
  return status;
}

static tw_status number_base(build *b, const uint32_t *cage_vertices) {
  tw_surface *s = b->surface;
  const tw_topology *base = &s->fields[0].base;
  uint8_t *visible = NULL;
  if (!b->whole) {
    visible = tw_alloc(base->face_count, 1);
    if (!visible) return TW_NO_MEMORY;
    for (uint32_t q = 0; q < base->face_count; q++) visible[q] = b->cage.visible[b->source[q]];
  }
  tw_status status = tw_number_field(base, visible, s->arena, &s->points);
  if (status == TW_OK && s->options.level > 0 && s->options.level <= tw_deepest_detail(&b->details))
    status = order_points(b);
  s->cage_points = rows_of_cage(&s->points, base, cage_vertices[0]);
  if (status == TW_OK && b->mesh->uv_set_count > 0) {
    status = tw_number_field(&s->fields[1].base, visible, s->arena, &s->uv_points);
    s->cage_uv_points = rows_of_cage(&s->uv_points, &s->fields[1].base, cage_vertices[1]);
  }
  s->vertices = s->points;
  if (status == TW_OK && s->way != TW_WAY_LOOP && needs_splits(b, s->options.normals))
    status = split_vertices(b, visible, cage_vertices[0]);
  s->cage_vertices = rows_of_cage(&s->vertices, base, cage_vertices[0]);
  free(visible);
  return status;
}

static void lay_out(build *b) {
  tw_surface *s = b->surface;
  tw_surface_layout *l = &s->layout;
  uint32_t stride = 3;
  l->normal = l->tangent = l->joints = l->weights = l->morphs = UINT32_MAX;
  if (s->options.normals) {
    l->normal = stride;
    stride += 3;
  }
  if (s->tangent_frames) {
    l->tangent = stride;
    stride += 4;
  }
  l->uv_count = b->mesh->uv_set_count;
  for (uint32_t i = 0; i < l->uv_count; i++, stride += 2) l->uvs[i] = stride;
  l->attribute_count = s->attribute_count;
  for (uint32_t i = 0; i < l->attribute_count; stride += s->smooth[i++].width) l->attributes[i] = stride;
  if (b->mesh->skin.joints) {
    l->joints = stride;
    l->weights = stride + 4;
    stride += 8;
  }
  l->morph_count = s->morph_count;
  l->morph_width = b->morph_normals ? 6 : 3;
  if (s->morph_count > 0) {
    l->morphs = stride;
    stride += l->morph_width * s->morph_count;
  }
  l->stride = stride;
}

/* ---- building -------------------------------------------------------------------------------- */

static void need_masks(tw_surface *s, const tw_topology *t) {
  uint32_t capacity = tw_limit_greatest_capacity(t);
  if (capacity > s->mask_capacity) s->mask_capacity = capacity;
}

static bool keep_details(build *b) {
  uint32_t count = b->details.count;
  tw_detail *details = gather(b->points_arena, b->details.details, NULL, count, sizeof *details);
  for (uint32_t i = 0; details && i < count; i++) {
    details[i].offsets = gather(b->points_arena, details[i].offsets, NULL, details[i].vertex_count,
                                3 * sizeof *details[i].offsets);
    if (!details[i].offsets) return false;
  }
  b->surface->details = (tw_detail_list){count, details};
  return details;
}

/* The cage outlives the mesh where it is the base, and where it is what positions are refined by. */
static tw_status keep_cage(build *b) {
  tw_surface *s = b->surface;
  if (s->way == TW_WAY_LEVELS) {
    s->point_of = b->cage.point_of;
    if (!s->point_of || !s->options.movable) return TW_OK;
    s->point_of = gather(s->arena, s->point_of, NULL, b->cage.topology.vertex_count, sizeof(uint32_t));
    return s->point_of ? TW_OK : TW_NO_MEMORY;
  }
  if (b->levels > 0 && !s->options.movable) return TW_OK;
  tw_topology *t = &b->cage.topology;
  s->points_arena = b->points_arena;
  s->rules = b->rules;
  if (s->options.movable && !keep_details(b)) return TW_NO_MEMORY;
  s->point_of = b->cage.point_of;
  t->corner_vertex = gather(b->points_arena, t->corner_vertex, NULL, t->corner_count, sizeof(uint32_t));
  if (t->face_offsets)
    t->face_offsets = gather(b->points_arena, t->face_offsets, NULL, t->face_count + 1, sizeof(uint32_t));
  bool complete = t->corner_vertex && (t->face_size != 0 || t->face_offsets);
  return complete ? TW_OK : TW_NO_MEMORY;
}

static tw_status level_frames(build *b, uint32_t *const uv_values[]) {
  const float *uvs[TW_UV_SETS_MAX];
  if (!has_tangents(b)) return TW_OK;
  for (uint32_t i = 0; i < b->mesh->uv_set_count; i++) {
    uvs[i] = gather(b->arena, b->mesh->uv_sets[i].values, uv_values[i], b->topologies[1 + i].vertex_count,
                    2 * sizeof(float));
    if (!uvs[i]) return TW_NO_MEMORY;
  }
  return find_frames(b, uvs);
}

static tw_status plan_levels(build *b, uint32_t *uv_values[]) {
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

static tw_status level_skin(build *b) {
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
static tw_status build_levels(build *b) {
  tw_surface *s = b->surface;
  const tw_mesh *mesh = b->mesh;
  const uint32_t *of = b->cage.point_of;
  uint32_t *uv_values[TW_UV_SETS_MAX] = {NULL};
  tw_status status = plan_levels(b, uv_values);
  s->positions.width = 3;
  if (status == TW_OK) status = tw_surface_refine_levels(s, mesh->positions, of, b->parallel, &s->positions);
  for (uint32_t i = 0; i < mesh->uv_set_count && status == TW_OK; i++) {
    s->uvs[i] = (tw_values){.field = 1 + i, .width = 2};
    status = tw_surface_refine_levels(s, mesh->uv_sets[i].values, uv_values[i], b->parallel, &s->uvs[i]);
  }
  for (uint32_t i = 0; i < smooth_count(mesh) && status == TW_OK; i++)
    status = tw_surface_refine_levels(s, smooth_source(mesh, i), of, b->parallel, &s->smooth[i]);
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
static tw_status keep_loop(build *b) {
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

static tw_status plan_patches(build *b) {
  tw_surface *s = b->surface;
  for (uint32_t f = 0; f < s->field_count; f++) {
    tw_field *field = &s->fields[f];
    if (s->way == TW_WAY_LOOP) continue;
    need_masks(s, &field->base);
    if (s->depth == 0) continue;
    tw_rules rules = rules_of(b, f);
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
static tw_status build_base(build *b) {
  tw_surface *s = b->surface;
  tw_status status = start_base(b);
  uint32_t cage_vertices[1 + TW_UV_SETS_MAX] = {0};
  for (uint32_t f = 0; f < s->field_count; f++) cage_vertices[f] = b->topologies[f].vertex_count;
  for (uint32_t level = 1; level <= b->levels && status == TW_OK; level++) {
    status = refine_level(b, level == b->levels ? s->arena : b->arena);
    if (status == TW_OK) status = tw_parallel_for_status(b->parallel);
  }
  if (status == TW_OK && s->loop.levels > 0) status = keep_loop(b);
  for (uint32_t f = 0; f < s->field_count; f++) s->fields[f].base = b->topologies[f];
  tw_face_order order = {b->mesh, b->cage.visible, b->source, s->loop.levels + b->levels};
  if (status == TW_OK) status = tw_surface_order(s, &order);
  if (status == TW_OK) status = number_base(b, cage_vertices);
  return status == TW_OK ? plan_patches(b) : status;
}

static uint32_t face_of_corner(const tw_mesh *mesh, uint32_t corner) {
  uint32_t low = 0, high = mesh->face_count;
  while (high - low > 1) {
    uint32_t middle = low + (high - low) / 2;
    if (mesh->face_offsets[middle] <= corner)
      low = middle;
    else
      high = middle;
  }
  return low;
}

/* All faces are visible: the rows of the points are the vertices of the cage. */
static tw_status keep_tags(build *b) {
  tw_surface *s = b->surface;
  if (!tw_keeps_tags(b->mesh, &s->options)) return TW_OK;
  tw_surface_tags *tags = s->tags = tw_arena_alloc(s->arena, 1, sizeof *tags);
  if (!tags) return TW_NO_MEMORY;
  *tags = b->cage.tags;
  uint32_t creases = tags->crease_count, points = tags->sharp_point_count;
  tags->crease_edges = gather(s->arena, tags->crease_edges, NULL, creases, 2 * sizeof(uint32_t));
  tags->crease_sharpness = gather(s->arena, tags->crease_sharpness, NULL, creases, sizeof(float));
  tags->sharp_points = gather(s->arena, tags->sharp_points, NULL, points, sizeof(uint32_t));
  tags->point_sharpness = gather(s->arena, tags->point_sharpness, NULL, points, sizeof(float));
  uint32_t *faces = tw_arena_alloc(s->arena, s->face_count, sizeof *faces);
  tags->faces = faces;
  bool complete =
      faces && tags->crease_edges && tags->crease_sharpness && tags->sharp_points && tags->point_sharpness;
  for (uint32_t i = 0; complete && i < s->face_count; i++)
    faces[i] = face_of_corner(b->mesh, s->face_first[i]);
  return complete ? TW_OK : TW_NO_MEMORY;
}

static tw_status build_surface(build *b, bool generic, tw_error *error) {
  tw_surface *s = b->surface;
  tw_status status = tw_cage_read(b->mesh, &s->options, b->points_arena, &b->cage);
  b->cage.arena = b->arena;
  if (status == TW_OK) status = tw_cage_count(&s->options, &b->cage, &s->counts, error);
  if (status == TW_OK) status = tw_details_check(&b->details, &b->cage, &s->options, error);
  if (status != TW_OK) return status;
  status = tw_parallel_for_status(b->parallel);
  if (status == TW_OK) status = choose(b, generic, error);
  if (status == TW_OK) status = keep_cage(b);
  if (status == TW_OK) status = begin_smooth(b);
  if (status == TW_OK) status = s->way == TW_WAY_LEVELS ? build_levels(b) : build_base(b);
  if (status == TW_OK) status = keep_tags(b);
  if (status == TW_OK) status = prepare_bounds(s);
  if (status == TW_OK) status = check_fans(s, error);
  if (status != TW_OK) return status;
  lay_out(b);
  if (tw_surface_row_count(s, TW_DOMAIN_VERTICES) >= UINT32_MAX)
    return tw_fail(error, TW_LIMIT,
                   "the surface would have over 4,294,967,294 vertices once its seams are split");
  return b->morph_normals && !s->own_normals ? tw_surface_morph(s, b->mesh, b->parallel) : TW_OK;
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
  build b = {.mesh = mesh,
             .surface = s,
             .parallel = parallel,
             .arena = tw_arena_create(),
             .points_arena = tw_arena_create(),
             .morph_normals = mesh->morph_normals && options->normals && !options->movable};
  s->options.movable |= b.morph_normals && !tw_has_own_normals(mesh, options);
  b.rules = tw_rules_of(options);
  b.details = (tw_detail_list){mesh->detail_count, mesh->details};
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

void tw_surface_destroy(tw_surface *surface) {
  if (!surface) return;
  if (surface->plan) {
    tw_surface_free_moved(surface);
    return;
  }
  for (uint32_t m = 0; surface->morphed && m < surface->morph_count; m++)
    tw_surface_destroy(surface->morphed[m]);
  for (uint32_t f = 0; f < surface->field_count; f++) tw_patches_deinit(&surface->fields[f].patches);
  tw_values_free_points(&surface->positions);
  for (uint32_t i = 0; i < TW_UV_SETS_MAX; i++) tw_values_free_points(&surface->uvs[i]);
  for (uint32_t i = 0; i < surface->attribute_count + surface->morph_count; i++)
    tw_values_free_points(&surface->smooth[i]);
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
  size += tw_values_points_size(surface, &surface->positions);
  for (uint32_t i = 0; i < TW_UV_SETS_MAX; i++) size += tw_values_points_size(surface, &surface->uvs[i]);
  for (uint32_t i = 0; i < surface->attribute_count + surface->morph_count; i++)
    size += tw_values_points_size(surface, &surface->smooth[i]);
  for (uint32_t m = 0; surface->morphed && m < surface->morph_count; m++)
    size += tw_surface_size(surface->morphed[m]);
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
