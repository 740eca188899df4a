/* Large answers that shrink from an open border, in two parts. What a level leaves of a mesh are the children
 * of the faces without a vertex on the border, and one line of faces around them: the rim. The inner part is
 * all that the inner faces of the base become: an evaluator computes it when it is read, as without a border.
 * The rim is a surface of its own, by generic steps: below the base each level keeps the faces of the rim and
 * those that touch it, which is all that the next level's rim is made of. So it takes memory by its length.
 *
 * Rows where both meet are the inner part's. */
#include "open_border.h"
#include "surface_plan.h"
#include "surface_reader.h"

/* Fewer take some tens of MB by generic steps. */
enum { FACES_MIN = 1 << 18 };

bool tw_rim_is_worth_it(const tw_surface_builder *b) {
  return !b->inner && b->surface->counts.faces > FACES_MIN;
}

/* ---- the parts ------------------------------------------------------------------------------- */

#define NO_ORIGIN UINT64_MAX /* of the rim's faces */

/* Other faces of a level are descendants of inner faces of the base. Their origin is the face of the base,
 * and their number among what it became, in the bits below. */
tw_status tw_rim_begin(tw_surface_builder *b) {
  const tw_topology *t = &b->topologies[0];
  b->origins = tw_arena_alloc_raw(b->arena, t->face_count, sizeof *b->origins);
  if (!b->origins) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < t->face_count; f++) b->origins[f] = tw_open_is_rim(t, f) ? NO_ORIGIN : f;
  return TW_OK;
}

uint8_t *tw_rim_vertices(const tw_surface_builder *b, const tw_topology *level) {
  uint8_t *flags = tw_arena_alloc(b->arena, level->vertex_count, 1);
  for (uint32_t c = 0; flags && c < level->corner_count; c++)
    if (b->origins[tw_corner_face(level, c)] == NO_ORIGIN) flags[level->corner_vertex[c]] = 1;
  return flags;
}

tw_status tw_rim_cut(tw_surface_builder *b, const uint32_t *faces, uint32_t face_count) {
  uint64_t *origins = tw_arena_alloc_raw(b->arena, face_count, sizeof *origins);
  if (!origins) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < face_count; f++) {
    uint64_t above = b->origins[faces[f] / 4];
    origins[f] = above == NO_ORIGIN ? NO_ORIGIN : 4 * above + faces[f] % 4;
  }
  b->origins = origins;
  return TW_OK;
}

tw_status tw_rim_part(tw_surface_builder *b) {
  const tw_topology *base = &b->topologies[0];
  b->part = tw_arena_alloc_raw(b->arena, base->face_count, 1);
  if (!b->part) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < base->face_count; f++)
    b->part[f] = b->inner ? b->origins[f] == NO_ORIGIN : !tw_open_is_rim(base, f);
  return TW_OK;
}

/* ---- rows ------------------------------------------------------------------------------------ */

/* Replaces the numbers of a domain: rows with a corner in the inner part are that part's, and all others
 * follow them. places: [faces of the inner base] their places among those that are visible. */
static tw_status join_rows(const tw_surface_builder *b, const uint32_t *places, tw_domain domain,
                           tw_numbering *n) {
  const tw_surface *s = b->surface, *inner = b->inner->surface;
  const tw_topology *base = &s->fields[0].base;
  const tw_numbering *of_inner = tw_numbering_of(inner, domain);
  uint32_t shift = 2 * inner->depth, own = 0, first = (uint32_t)tw_own_row_count(inner, domain),
           *rows = tw_arena_alloc_raw(b->arena, n->corner_count, sizeof *rows),
           *corner_row = tw_arena_alloc_raw(s->arena, base->corner_count, sizeof *corner_row),
           *corner_base = tw_arena_alloc_raw(s->arena, n->corner_count, sizeof *corner_base);
  if (!rows || !corner_row || !corner_base) return TW_NO_MEMORY;
  for (uint32_t row = 0; row < n->corner_count; row++) rows[row] = UINT32_MAX;
  for (uint32_t c = 0; c < base->corner_count; c++) {
    uint32_t face = c / base->face_size, row = n->corner_row[c];
    if (row == UINT32_MAX || b->origins[face] == NO_ORIGIN) continue;
    uint32_t child = (uint32_t)(b->origins[face] & (((uint64_t)1 << shift) - 1));
    rows[row] = inner->evaluator->row_of_child(inner, of_inner, places[s->inner_faces[face]], child,
                                               c % base->face_size);
  }
  for (uint32_t row = 0; row < n->corner_count; row++) {
    if (rows[row] != UINT32_MAX) continue;
    corner_base[own] = n->corner_base[row];
    rows[row] = first + own++;
  }
  for (uint32_t c = 0; c < base->corner_count; c++)
    corner_row[c] = n->corner_row[c] == UINT32_MAX ? UINT32_MAX : rows[n->corner_row[c]];
  *n = (tw_numbering){.corner_count = own, .corner_row = corner_row, .corner_base = corner_base};
  return TW_OK;
}

tw_status tw_rim_number(tw_surface_builder *b) {
  tw_surface *s = b->surface;
  const tw_surface *inner = b->inner->surface;
  uint32_t faces = s->fields[0].base.face_count,
           *places = tw_arena_alloc(b->arena, inner->fields[0].base.face_count, sizeof *places);
  s->inner_faces = tw_arena_alloc_raw(s->arena, faces, sizeof *s->inner_faces);
  if (!places || !s->inner_faces) return TW_NO_MEMORY;
  for (uint32_t q = 0; q < inner->quad_count; q++) places[inner->quads[q]] = q;
  for (uint32_t f = 0; f < faces; f++)
    s->inner_faces[f] =
        b->origins[f] == NO_ORIGIN ? UINT32_MAX : (uint32_t)(b->origins[f] >> 2 * inner->depth);
  tw_status status = join_rows(b, places, TW_DOMAIN_VERTICES, &s->vertices);
  if (status == TW_OK) status = join_rows(b, places, TW_DOMAIN_POINTS, &s->points);
  if (status == TW_OK && b->mesh->uv_set_count > 0)
    status = join_rows(b, places, TW_DOMAIN_UVS, &s->uv_points);
  return status;
}

/* ---- groups ---------------------------------------------------------------------------------- */

static int compare_groups(const tw_surface_group *a, const tw_surface_group *b) {
  if (a->material != b->material) return a->material < b->material ? -1 : 1;
  return a->names < b->names ? -1 : a->names > b->names;
}

/* Appends a group with what a part has of it, and takes that from the part; or with nothing. */
static void append(tw_surface_group *groups, uint32_t at, const tw_surface_group *as,
                   const tw_surface_group *part) {
  const tw_surface_group none = {0}, *before = at > 0 ? &groups[at - 1] : &none;
  groups[at] = *as;
  groups[at].first_face = before->first_face + before->face_count;
  groups[at].first_corner = before->first_corner + before->corner_count;
  groups[at].face_count = part ? part->face_count : 0;
  groups[at].corner_count = part ? part->corner_count : 0;
}

tw_status tw_rim_join_groups(tw_surface *s) {
  tw_surface *rim = s->rim;
  uint32_t most = s->group_count + rim->group_count, count = 0, i = 0, k = 0;
  tw_surface_group *all = tw_arena_alloc(s->arena, most, sizeof *all),
                   *of_rim = tw_arena_alloc(rim->arena, most, sizeof *of_rim);
  if (!all || !of_rim) return TW_NO_MEMORY;
  for (; i < s->group_count || k < rim->group_count; count++) {
    const tw_surface_group *own = i < s->group_count ? &s->groups[i] : NULL,
                           *other = k < rim->group_count ? &rim->groups[k] : NULL;
    int order = own && other ? compare_groups(own, other) : own ? -1 : 1;
    const tw_surface_group *first = order <= 0 ? own : other;
    append(all, count, first, order <= 0 ? own : NULL);
    append(of_rim, count, first, order >= 0 ? other : NULL);
    all[count].face_count += of_rim[count].face_count;
    all[count].corner_count += of_rim[count].corner_count;
    i += order <= 0;
    k += order >= 0;
  }
  s->groups = all;
  rim->groups = of_rim;
  s->group_count = rim->group_count = count;
  return TW_OK;
}
