/* How the levels between a mesh and an answer are shared out between generic steps, rows that follow from
 * what those make, and patches: by what each of them can do, and then by what they cost. */
#include "patch_cost.h"
#include "surface_build.h"

/* ---- what can be done ----------------------------------------------------------------------- */

/* Where the border eats into the mesh, only one group is sure to stay in place. */
static bool is_whole(const tw_build *b) {
  if (b->mesh->tangent_uvs) return false; /* which face a quad comes from has to be known */
  uint32_t groups = tw_ordered_groups(b->mesh, b->cage.visible);
  return groups == 1 || (groups > 1 && !tw_cage_shrinks(&b->cage, &b->surface->options));
}

/* Up to this level float keeps what normals live on. */
enum { FLOAT_LEVEL = 2 };

/* Chaikin's rule looks across UV seams at the sharpness beyond them, which a patch does not see. */
static bool crosses_seams(const tw_mesh *mesh, const tw_surface_options *options) {
  if (options->creasing != TW_CREASE_CHAIKIN || mesh->uv_set_count == 0) return false;
  for (uint32_t i = 0; i < mesh->crease_count; i++)
    if (tw_is_semi_sharp(mesh->crease_sharpness[i])) return true;
  return false;
}

/* Nothing but points that stay where they are refined to. */
static bool is_bare(const tw_build *b) {
  const tw_mesh *m = b->mesh;
  const tw_surface_options *options = &b->surface->options;
  bool points_only = m->uv_set_count == 0 && m->morph_count == 0 && !m->colors && !m->skin.joints;
  return points_only && options->level > 0 && b->whole && !options->limit &&
         !tw_cage_shrinks(&b->cage, options);
}

/* Of a cage of quads, patches find normals from exact differences. */
static bool fits_shallow_normals(const tw_build *b) {
  const tw_topology *cage = &b->cage.topology;
  return b->surface->options.level <= FLOAT_LEVEL && cage->face_size != 4 &&
         tw_shallow_fits_normals(cage, &b->rules);
}

static bool fits_loop_rows(const tw_build *b) {
  const tw_surface_options *options = &b->surface->options;
  if (!tw_build_is_loop(b)) return false;
  return !options->normals || tw_loop_rows_fit_normals(&b->cage.topology, &b->rules, options->level);
}

/* ---- what is worth it ----------------------------------------------------------------------- */

enum {
  SHALLOW_LEVEL_MAX = 4,
  SHALLOW_FACES_MAX = 16 * 1024 /* of the mesh that rows are made of */
};

/* Whether so few quads come of the cage that patches would not pay. At level 4 the memory of the steps, which
 * is a part of the answer's, has to pay as well. */
static bool patches_cost_more(const tw_build *b, uint32_t shallow) {
  uint32_t level = b->surface->options.level;
  uint64_t quads = b->cage.refined_faces;
  if (b->rules.linear || level > SHALLOW_LEVEL_MAX || quads >> 2 * shallow > SHALLOW_FACES_MAX) return false;
  return quads << (level - 3) < tw_patch_cost(&b->cage.topology);
}

/* Whether a mesh of quads is better refined to the end, vertex by vertex, than in patches. Other meshes are
 * at level 1 alone, where patches have nothing to do. Displacements and joints would take many times the
 * memory; whether tangents are mirrored is for the cage's faces to tell. */
static bool few_quads_pay(const tw_build *b) {
  enum { MASKS_COST = 30 }; /* of a quad's share of vertices, as tw_patch_cost counts */
  uint32_t level = b->surface->options.level;
  uint64_t quads = b->cage.refined_faces;
  if (b->rules.linear || level == 0 || level > 2 || quads > SHALLOW_FACES_MAX) return false;
  if (b->mesh->morph_count > 0 || b->mesh->skin.joints || b->mesh->has_tangents) return false;
  return quads * MASKS_COST < tw_patch_cost(&b->cage.topology);
}

/* How many levels of a bare surface, the last ones, are rows that follow from the mesh above; 0: none. The
 * first two levels are made so wherever that can be done. */
static uint32_t shallow_levels(const tw_build *b, bool generic) {
  const tw_surface_options *options = &b->surface->options;
  const tw_topology *cage = &b->cage.topology;
  uint32_t level = options->level, steps = level > 2 ? level - 2 : 0,
           last = level >= 2 && tw_shallow_fits(cage, steps, &b->rules, 2) ? 2 : 1;
  if (tw_build_is_loop(b) || (options->normals && !fits_shallow_normals(b))) return 0;
  return level <= 2 || generic || patches_cost_more(b, last) ? last : 0;
}

/* ---- sharing out ---------------------------------------------------------------------------- */

/* Rows of the last levels, in place of as many generic steps. */
static void choose_rows(tw_build *b, uint32_t shallow) {
  tw_surface *s = b->surface;
  s->shallow.level = shallow;
  s->shallow.normals = shallow > 0 && s->options.normals;
  b->levels -= shallow;
  if (!is_bare(b) || !fits_loop_rows(b)) return;
  s->loop.levels = tw_loop_rows_fit(&b->cage.topology, &b->rules, s->options.level);
  s->loop.normals = s->options.normals;
  b->levels -= s->loop.levels;
}

tw_status tw_build_choose(tw_build *b, bool generic, tw_error *error) {
  tw_surface *s = b->surface;
  uint32_t level = s->options.level;
  b->whole = is_whole(b);
  bool small = b->cage.refined_faces <= TW_GENERIC_FACES_MAX, loop = tw_build_is_loop(b),
       even = b->cage.topology.face_size == (loop ? 3 : 4);
  if (generic && !small)
    return tw_fail(error, TW_LIMIT,
                   "the mesh is too irregular for level %u: it has great poles, or thousands of "
                   "different sharpness values",
                   level);
  uint32_t shallow = small && is_bare(b) ? shallow_levels(b, generic) : 0;
  bool few = shallow > 0 || (!even && level <= 1), masks = even && !loop && !few && few_quads_pay(b);
  generic |= tw_cage_shrinks(&b->cage, &s->options) || loop ||
             (small && (few || masks || crosses_seams(b->mesh, &s->options)));
  b->levels = generic && level > 0 ? level : even ? 0 : 1;
  s->depth = level > b->levels ? level - b->levels : 0;
  s->side = 1u << s->depth;
  s->cage_step = b->levels == 0 ? 1 : 4;
  bool bare = generic && is_bare(b);
  choose_rows(b, shallow);
  s->plain = bare && (s->shallow.level > 0 || s->loop.levels > 0 || !s->options.normals);
  /* Normals live on differences, which float loses the more the closer points come together. */
  s->exact = loop || ((masks || b->levels > FLOAT_LEVEL) && s->options.normals && !b->rules.linear);
  s->steps = tw_arena_alloc(s->arena, b->levels, sizeof *s->steps);
  return s->steps ? TW_OK : TW_NO_MEMORY;
}
