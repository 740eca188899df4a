/* Chooses the method that computes a surface's rows, and how many generic steps lead to its base. */
#include <string.h>

#include "surface_plan.h"

/* ---- what can be done ----------------------------------------------------------------------- */

/* Whether the answer has all faces in the order of the cage. An open border removes faces; then only a single
 * group is sure to keep its order. */
static bool is_whole(const tw_surface_builder *b) {
  if (b->mesh->tangent_uvs) return false; /* the source of each face must be known */
  uint32_t groups = tw_ordered_groups(b->mesh, b->cage.visible);
  return groups == 1 || (groups > 1 && !tw_cage_shrinks(&b->cage, &b->surface->options));
}

/* Whether patches cannot compute values of corners: Chaikin's rule depends on sharpness across UV seams,
 * which a patch does not see. */
static bool crosses_seams(const tw_surface_builder *b) {
  const tw_mesh *mesh = b->mesh;
  if (b->surface->options.creasing != TW_CREASE_CHAIKIN || b->channel_count == 0) return false;
  for (uint32_t i = 0; i < mesh->crease_count; i++)
    if (tw_is_semi_sharp(mesh->crease_sharpness[i])) return true;
  return false;
}

/* Whether the cage can be the base: it has triangles for Loop's scheme, else quads of four different vertices
 * each. A quad with a vertex twice is refined once, which makes quads of four vertices. */
static bool can_be_base(const tw_topology *cage, bool loop) {
  if (cage->face_size != (loop ? 3 : 4)) return false;
  for (size_t c = 0; !loop && c < cage->corner_count; c += 4) {
    const uint32_t *quad = cage->corner_vertex + c;
    if (quad[0] == quad[2] || quad[1] == quad[3]) return false;
  }
  return true;
}

/* Whether rows hold refined points only, or points and normals. */
static bool is_bare(const tw_surface_builder *b) {
  const tw_mesh *m = b->mesh;
  const tw_surface *s = b->surface;
  bool points_only =
      m->uv_set_count == 0 && tw_smooth_set_count(s) == 0 && !m->skin.joints && s->details.count == 0;
  return points_only && s->options.level > 0 && b->whole && !s->options.limit &&
         !tw_cage_shrinks(&b->cage, &s->options);
}

/* ---- what is worth it ----------------------------------------------------------------------- */

enum { LEVELS_BYTES_MAX = 128 << 20 };

/* Whether nearly all vertices of a level of quads have valence 4. Then patches are faster from three levels
 * below it on. The irregular vertices of a level come from vertices and faces of the cage. */
static bool is_regular(const tw_cage *cage, uint32_t level) {
  const tw_topology *t = &cage->topology;
  if (level == 0 && t->face_size != 4) return false;
  uint64_t vertices = tw_cage_counts_at(cage, false, level).vertices, irregular = 0;
  for (uint32_t v = 0; v < t->vertex_count; v++) irregular += t->fan_offsets[v + 1] - t->fan_offsets[v] != 4;
  for (uint32_t f = 0; f < t->face_count; f++) irregular += tw_face_size(t, f) != 4;
  return vertices - irregular > vertices / 8 * 7;
}

/* Whether TW_WAY_LEVELS can be used: all points of the level fit in memory, and rows can be read from them.
 * Cages with faces that are left out use patches. */
static bool fits_levels(const tw_surface_builder *b) {
  const tw_mesh *m = b->mesh;
  const tw_surface *s = b->surface;
  const tw_surface_options *options = &s->options;
  const tw_topology *cage = &b->cage.topology;
  uint32_t base = tw_deepest_detail(&s->details);
  if (options->scheme != TW_CATMULL_CLARK || options->level <= base || options->level > base + TW_SHALLOW_MAX)
    return false;
  if (m->face_count == 0) return false;
  if (s->rules.smooth_triangles && base == 0 && cage->face_size != 4) return false;
  if (memchr(b->cage.visible, 0, cage->face_count) || tw_cage_shrinks(&b->cage, options)) return false;
  if (m->skin.joints && !tw_skin_fits_levels(m)) return false;
  uint32_t influences = tw_mesh_influences(m, options->influences);
  uint32_t uv_copies = options->limit && tw_builder_has_tangents(b) ? 2 : 1;
  uint64_t sets = (options->limit && options->normals ? 2u : 1u) + uv_copies * m->uv_set_count +
                  influences / 2 /* joints and weights, four to a point */ + tw_smooth_set_count(s) +
                  (b->morph_normals ? (options->limit ? 2u : 1u) * m->morph_count : 0u);
  if (s->counts.vertices * sets * sizeof(tw_point) > LEVELS_BYTES_MAX || !tw_shallow_fit(cage)) return false;
  return options->level < base + 3 || !is_regular(&b->cage, base);
}

/* ---- the choice ----------------------------------------------------------------------------- */

/* Whether TW_WAY_LOOP can be used, which saves the last generic step. */
static bool fits_loop_rows(const tw_surface_builder *b) {
  const tw_surface *s = b->surface;
  if (s->options.scheme != TW_LOOP || !is_bare(b)) return false;
  return !s->options.normals || tw_loop_rows_fit(&b->cage.topology, &s->rules, s->options.level - 1);
}

/* An upper bound, in bytes, of what generic steps need. Levels that have details are not counted here: the
 * caller counts them. The constants are bytes for each face of the last level, measured on cages of
 * triangles. */
static uint64_t steps_size(const tw_surface_builder *b) {
  enum { LOOP_ROWS = 56, LOOP = 180, CATMULL_CLARK = 420 };
  const tw_surface *s = b->surface;
  const tw_mesh *m = b->mesh;
  uint32_t levels = b->levels + (s->way == TW_WAY_LOOP);
  if (levels < 2 || levels <= tw_deepest_detail(&s->details)) return 0;
  uint64_t topology = s->rules.loop ? LOOP : CATMULL_CLARK, values = tw_smooth_set_count(s);
  if (s->way == TW_WAY_LOOP) topology = LOOP_ROWS;
  if (m->skin.joints) values += m->skin.width;
  return tw_cage_counts_at(&b->cage, s->rules.loop, levels).faces * (topology * s->field_count + 32 * values);
}

/* What the topologies of the last level take at least, in bytes. */
static uint64_t least_steps_size(const tw_surface_builder *b) {
  enum { CORNER = 4 * 4, EDGE = 8 + 8 + 4 + 4 + 1, VERTEX = 3 * 4 + 1 }; /* the arrays of tw_topology */
  const tw_surface_counts *c = &b->surface->counts;
  uint64_t last = CORNER * c->corners + EDGE * c->edges + VERTEX * c->vertices;
  return b->surface->field_count * (b->surface->way == TW_WAY_LOOP ? last / 4 : last);
}

/* Asks for the memory of the generic steps. */
static tw_status ask_for_steps(const tw_surface_builder *b, tw_error *error) {
  const tw_grant *grant = b->surface->options.grant;
  uint64_t bytes = steps_size(b), least = bytes > 0 ? least_steps_size(b) : 0;
  if (bytes == 0 || !grant) return TW_OK;
  if (grant->most > 0 && least > grant->most)
    return tw_fail(error, TW_LIMIT,
                   "the surface has %llu faces, made step by step, which takes %llu bytes at least, over the "
                   "limit of %llu (%s)",
                   (unsigned long long)b->surface->counts.faces, (unsigned long long)least,
                   (unsigned long long)grant->most, grant->most_name);
  return grant->take(grant->context, bytes) ? TW_OK : TW_NO_MEMORY;
}

tw_status tw_builder_choose(tw_surface_builder *b, tw_error *error) {
  tw_surface *s = b->surface;
  uint32_t level = s->options.level, deepest = tw_deepest_detail(&s->details);
  b->whole = is_whole(b);
  bool generic = b->attempt == TW_TRY_STEPS, loop = s->rules.loop,
       small = b->cage.refined_faces <= TW_GENERIC_FACES_MAX,
       fits_base = can_be_base(&b->cage.topology, loop);
  if (generic && !small)
    return tw_fail(error, TW_LIMIT,
                   "the mesh is too irregular for level %u: it has great poles, or thousands of "
                   "different sharpness values",
                   level);
  if ((b->attempt == TW_TRY_ALL || b->attempt == TW_TRY_LARGE_LEVELS) && fits_levels(b)) {
    s->way = TW_WAY_LEVELS;
    b->levels = deepest;
  } else {
    bool few = !fits_base && level <= 1;
    generic |= tw_cage_shrinks(&b->cage, &s->options) || loop || (small && (few || crosses_seams(b)));
    b->levels = (generic || level <= deepest) && level > 0 ? level : fits_base ? 0 : 1;
    if (deepest < level && deepest > b->levels) b->levels = deepest;
    s->depth = level > b->levels ? level - b->levels : 0;
    s->way = fits_loop_rows(b) ? TW_WAY_LOOP : s->depth > 0 ? TW_WAY_PATCHES : TW_WAY_BASE;
    if (s->way == TW_WAY_LOOP) b->levels--;
  }
  s->side = 1u << s->depth;
  s->cage_step = b->levels == 0 ? 1 : 4;
  tw_status status = ask_for_steps(b, error);
  if (status != TW_OK) return status;
  s->steps = tw_arena_alloc(s->arena, (size_t)b->levels + 1, sizeof *s->steps);
  return s->steps ? TW_OK : TW_NO_MEMORY;
}
