/* How the levels between a mesh and an answer are shared out between generic steps, rows that follow from
 * what those make, and patches: by what each of them can do, and then by what they cost. */
#include "surface_build.h"

#include <string.h>

/* ---- what can be done ----------------------------------------------------------------------- */

/* Where the border eats into the mesh, only one group is sure to stay in place. */
static bool is_whole(const tw_build *b) {
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

/* Nothing but points that stay where they are refined to. */
static bool is_bare(const tw_build *b) {
  const tw_mesh *m = b->mesh;
  const tw_surface_options *options = &b->surface->options;
  bool points_only = m->uv_set_count == 0 && m->morph_count == 0 && !m->colors && !m->skin.joints;
  return points_only && options->level > 0 && b->whole && !options->limit &&
         !tw_cage_shrinks(&b->cage, options);
}

static bool fits_loop_rows(const tw_build *b) {
  const tw_surface_options *options = &b->surface->options;
  if (!tw_build_is_loop(b)) return false;
  return !options->normals || tw_loop_rows_fit_normals(&b->cage.topology, &b->rules, options->level);
}

/* ---- what is worth it ----------------------------------------------------------------------- */

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
static bool fits_levels(const tw_build *b) {
  const tw_mesh *m = b->mesh;
  const tw_surface *s = b->surface;
  const tw_surface_options *options = &s->options;
  const tw_topology *cage = &b->cage.topology;
  if (options->scheme != TW_CATMULL_CLARK || options->level == 0 || options->level > TW_LEVELS_MAX)
    return false;
  if (m->face_count == 0) return false;
  if (b->rules.smooth_triangles && cage->face_size != 4) return false;
  if (memchr(b->cage.visible, 0, cage->face_count) || tw_cage_shrinks(&b->cage, options)) return false;
  if (m->skin.joints && !tw_skin_fits_levels(m)) return false;
  uint32_t uv_copies = options->limit && tw_build_has_tangents(b) ? 2 : 1;
  uint64_t sets = (options->limit && options->normals ? 2u : 1u) + uv_copies * m->uv_set_count +
                  (m->colors ? 1u : 0u) + (m->skin.joints ? 2u : 0u) + m->morph_count;
  if (s->counts.vertices * sets * sizeof(tw_point) > LEVELS_BYTES_MAX || !tw_levels_fit(cage)) return false;
  return options->level < 3 || !is_regular(cage);
}

/* ---- sharing out ---------------------------------------------------------------------------- */

/* Rows of the last levels, in place of as many generic steps. */
static void choose_rows(tw_build *b) {
  tw_surface *s = b->surface;
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
  if (fits_levels(b)) {
    s->way = TW_WAY_LEVELS;
    s->side = s->cage_step = 1;
    return TW_OK;
  }
  bool few = !even && level <= 1;
  generic |= tw_cage_shrinks(&b->cage, &s->options) || loop ||
             (small && (few || crosses_seams(b->mesh, &s->options)));
  b->levels = generic && level > 0 ? level : even ? 0 : 1;
  s->depth = level > b->levels ? level - b->levels : 0;
  s->side = 1u << s->depth;
  s->cage_step = b->levels == 0 ? 1 : 4;
  choose_rows(b);
  s->way = s->loop.levels > 0 ? TW_WAY_LOOP : s->depth > 0 ? TW_WAY_PATCHES : TW_WAY_BASE;
  s->steps = tw_arena_alloc(s->arena, b->levels, sizeof *s->steps);
  return s->steps ? TW_OK : TW_NO_MEMORY;
}
