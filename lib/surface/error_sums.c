/* Distances added up over levels. A face is compared with its descendants some levels deeper, and only the
 * distance between those and the limit is added. A sum over all levels in between would count each of their
 * steps in full, though these are not greatest at one place.
 *
 * Each triangle of a descendant lies over one triangle of the face. The distance from the face's triangle is
 * a convex function, so a descendant's triangle is farthest at its corners. That bounds the way from
 * descendants to the face; the way back has the same bound, as descendants cover the face, edges over edges.
 *
 * Faces that are farther than what is known are looked at again, by bounds that cost more. Each holds by
 * itself, so the lesser one counts: planes and hulls (error_gap.c), and the two below.
 *
 * Turned views. Where faces around a corner are folded, so that nothing may slide there, the face is looked
 * at along another direction, from which these lean least: what is said above of a face's normal holds for
 * any direction.
 *
 * Limit points. A piece around which all is regular is known without its descendants: its limit points are,
 * by its net of control points, and the limit is as near to their triangles as second differences say. So
 * limit points all over it stand in for it, each at the place that a descendant's corner would have. A piece
 * that a ring told of is known likewise, where answers have limit points: some levels deeper, all of it but a
 * small face at the irregular point is such patches (error_rings.c). Points of the limit over other pieces
 * may slide onto descendants of a patch: as far as these are from their limit, and the others from what they
 * slide on, is added where they are beside each other. */
#include <string.h>

#include "sorted.h"
#include "surface_error.h"

enum {
  FACES_AT_ONCE = 1024,           /* between two charges of work */
  LOOK_WORK = 4096,               /* of a face that is looked at again */
  PATCH_WORK = 1024,              /* of a piece, by its limit points */
  OPEN_DEPTH = TW_ERROR_DEPTH + 2 /* of pieces around an irregular point: one in four at each level */
};

/* A face of a level, and the place of its corners over the face that it comes of. */
typedef struct piece {
  uint32_t level, face;
  uint8_t places[4]; /* bits */
} piece;

/* A face that is compared with its pieces. */
typedef struct compared {
  const tw_measuring *m;
  const tw_level_errors *levels;
  uint32_t depth;
  tw_error_base base;
  uint32_t *patches;   /* counts pieces whose limit points are looked at; NULL: none are */
  uint32_t open_level; /* the first level of descendants that are neither patches nor refined */
  double slides;       /* how far the limit over these may be from what is around them */
} compared;

static uint32_t size_of(const tw_level_errors *l, uint32_t face) {
  return l->begins[face + 1] - l->begins[face];
}

/* The distance of a piece from the face, and its own from the limit: of that, what the pieces beside it have,
 * as points may slide there, or its own if they do not. */
static double piece_error(const compared *c, const piece *own) {
  const tw_level_errors *l = &c->levels[own->level];
  tw_error_gap g = tw_error_gap_over(&c->base);
  double beside = 0;
  for (uint32_t i = 0; i < size_of(l, own->face); i++) {
    uint32_t vertex = l->corners[l->begins[own->face] + i];
    tw_error_take_point(&c->base, &g, own->places[i], tw_point_at(l->points, vertex));
    beside = tw_greater(beside, l->around[vertex]);
  }
  return tw_error_gap_size(&c->base, &g) + tw_lesser(beside, l->wholes[own->face]);
}

/* A corner of a face at a vertex of four quads: the corners beyond it are those of the net around the face.
 */
typedef struct net_corner {
  const tw_level_errors *level;
  uint32_t face, corner, next, previous; /* the face's corner, and the vertices beside it */
  double *against_next, *against_previous, *against_opposite;
} net_corner;

static bool fill_corner(const net_corner *n) {
  const tw_level_errors *l = n->level;
  uint32_t vertex = l->corners[l->begins[n->face] + n->corner], filled = 0;
  for (uint32_t k = l->fan_begins[vertex]; k < l->fan_begins[vertex + 1]; k++) {
    const uint32_t *quad = l->corners + l->begins[l->fan_faces[k]];
    uint32_t i = 0;
    if (l->fan_faces[k] == n->face) continue;
    while (i < 3 && quad[i] != vertex) i++;
    uint32_t next = quad[(i + 1) % 4], opposite = quad[(i + 2) % 4], previous = quad[(i + 3) % 4];
    int side = previous == n->next ? 0 : next == n->previous ? 1 : 2;
    memcpy(side == 0   ? n->against_previous
           : side == 1 ? n->against_next
                       : n->against_opposite,
           tw_point_at(l->control, side == 0   ? next
                                   : side == 1 ? previous
                                               : opposite),
           sizeof(double[3]));
    filled |= 1u << side;
  }
  return filled == 7 && l->fan_begins[vertex + 1] - l->fan_begins[vertex] == 4;
}

/* The net of a patch around which nothing is a rim, as error_patch.c finds it. */
static bool find_net(const tw_level_errors *l, uint32_t face, tw_error_net *out) {
  static const int places[4][2] = {{1, 1}, {1, 2}, {2, 2}, {2, 1}}; /* v, u */
  const uint32_t *quad = l->corners + l->begins[face];
  for (uint32_t i = 0; i < 4; i++) {
    const int *here = places[i], *next = places[(i + 1) % 4], *previous = places[(i + 3) % 4];
    int nv = next[0] - here[0], nu = next[1] - here[1], pv = previous[0] - here[0],
        pu = previous[1] - here[1];
    memcpy(out->points[here[0]][here[1]], tw_point_at(l->control, quad[i]), sizeof(double[3]));
    if (!fill_corner(&(net_corner){.level = l,
                                   .face = face,
                                   .corner = i,
                                   .next = quad[(i + 1) % 4],
                                   .previous = quad[(i + 3) % 4],
                                   .against_next = out->points[here[0] - nv][here[1] - nu],
                                   .against_previous = out->points[here[0] - pv][here[1] - pu],
                                   .against_opposite = out->points[here[0] - nv - pv][here[1] - nu - pu]}))
      return false;
  }
  return true;
}

/* The distance of a piece that is a patch, by its limit points; INFINITY for others. */
static double patch_error(const compared *c, const piece *own) {
  const tw_level_errors *l = &c->levels[own->level];
  tw_error_net n;
  if (!l->is_plain[own->face] || own->level >= c->open_level || !find_net(l, own->face, &n)) return INFINITY;
  ++*c->patches;
  double error = tw_error_of_limits(&c->base, &n, own->places);
  if (c->slides == 0) return error;
  double lift =
      l->control == l->points ? ldexp(l->wholes[own->face], -2 * (int)(c->open_level - own->level)) : 0;
  return error + lift + c->slides;
}

/* The corner of a face at a vertex; 4: it has none. */
static uint32_t corner_at(const tw_level_errors *l, uint32_t face, uint32_t vertex) {
  const uint32_t *quad = l->corners + l->begins[face];
  uint32_t i = 0;
  while (i < 4 && quad[i] != vertex) i++;
  return i;
}

static void take_control(const tw_level_errors *l, uint32_t face, uint32_t corner, double out[3]) {
  memcpy(out, tw_point_at(l->control, l->corners[l->begins[face] + corner % 4]), sizeof(double[3]));
}

/* Finds the four points of the second row beyond a face at an irregular vertex: they are corners of the three
 * other faces at the face's opposite corner. corner: the face's corner at the irregular vertex. */
static bool find_beyond(const tw_level_errors *l, uint32_t face, uint32_t corner, double (*out)[3]) {
  const uint32_t *quad = l->corners + l->begins[face];
  uint32_t next = quad[(corner + 1) % 4], opposite = quad[(corner + 2) % 4],
           previous = quad[(corner + 3) % 4], filled = 0;
  for (uint32_t k = l->fan_begins[opposite]; k < l->fan_begins[opposite + 1]; k++) {
    uint32_t beside = l->fan_faces[k], i = corner_at(l, beside, opposite);
    const uint32_t *other = l->corners + l->begins[beside];
    if (beside == face) continue;
    if (other[(i + 1) % 4] == next) {
      take_control(l, beside, i + 2, out[0]);
      take_control(l, beside, i + 3, out[1]);
      filled |= 1;
    } else if (other[(i + 3) % 4] == previous) {
      take_control(l, beside, i + 2, out[3]);
      filled |= 2;
    } else {
      take_control(l, beside, i + 2, out[2]);
      filled |= 4;
    }
  }
  return filled == 7;
}

/* Finds the control points of two rows around a vertex, from a face at it on; that face is sector 0. */
static bool find_rows(const tw_level_errors *l, uint32_t face, uint32_t vertex, uint32_t valence,
                      double (*out)[3]) {
  memcpy(out[0], tw_point_at(l->control, vertex), sizeof *out);
  for (uint32_t s = 0; s < valence; s++) {
    uint32_t corner = corner_at(l, face, vertex), turned = UINT32_MAX;
    const uint32_t *quad = l->corners + l->begins[face];
    double(*row)[3] = out + 1 + (size_t)TW_ERROR_ROW * s,
    (*second)[3] = out + 1 + (size_t)TW_ERROR_ROW * valence + (size_t)(TW_ERROR_ROWS - TW_ERROR_ROW) * s;
    take_control(l, face, corner + 1, row[0]);
    take_control(l, face, corner + 2, row[1]);
    if (!find_beyond(l, face, corner, second)) return false;
    for (uint32_t k = l->fan_begins[vertex]; k < l->fan_begins[vertex + 1]; k++) {
      uint32_t beside = l->fan_faces[k], i = corner_at(l, beside, vertex);
      if (l->corners[l->begins[beside] + (i + 1) % 4] == quad[(corner + 3) % 4]) turned = beside;
    }
    if (turned == UINT32_MAX) return false;
    face = turned;
  }
  return true;
}

/* The same of a piece that a ring told of, by limit points of what comes of it. */
static double sector_error(const compared *c, const piece *own) {
  enum { PATCHES = 16 }; /* that take as long */
  const tw_level_errors *l = &c->levels[own->level];
  const uint32_t *quad = l->corners + l->begins[own->face];
  double points[1 + TW_ERROR_ROWS * TW_ERROR_VALENCE_MAX][3];
  if (!(l->ring_rests[own->face] >= 0) || l->control == l->points || own->level >= c->open_level)
    return INFINITY;
  for (uint32_t i = 0; i < 4; i++) {
    uint32_t valence = l->fan_begins[quad[i] + 1] - l->fan_begins[quad[i]];
    const uint8_t places[4] = {own->places[i], own->places[(i + 1) % 4], own->places[(i + 2) % 4],
                               own->places[(i + 3) % 4]};
    if (valence == 4) continue;
    if (valence > TW_ERROR_VALENCE_MAX || !find_rows(l, own->face, quad[i], valence, points)) return INFINITY;
    *c->patches += PATCHES;
    return tw_error_of_sector(c->m, &c->base, points, valence, places, l->ring_rests[own->face]) + c->slides;
  }
  return INFINITY;
}

/* The index in l->made of a face from which the next level was made; UINT32_MAX for other faces. */
static uint32_t find_left(const tw_level_errors *l, uint32_t face) {
  uint32_t left = tw_lower_bound(l->made, l->left_count, face);
  return left < l->left_count && l->made[left] == face ? left : UINT32_MAX;
}

/* Child `i` of a piece, as tw_refine_topology makes it. */
static piece child_of(const compared *c, const piece *parent, uint32_t size, uint32_t first, uint32_t i) {
  const uint8_t *at = parent->places;
  piece out = {.level = parent->level + 1, .face = first + i};
  if (c->m->rules.loop) {
    for (uint32_t k = 0; k < 3; k++)
      out.places[k] = i == 3 ? at[(k + 1) % 3] & at[(k + 2) % 3] : at[i] & at[k];
    return out;
  }
  uint8_t middle = size == 4 ? (at[0] & at[2]) | (at[1] & at[3]) : at[0] & at[1] & at[2];
  out.places[0] = at[i];
  out.places[1] = at[i] & at[(i + 1) % size];
  out.places[2] = middle;
  out.places[3] = at[i] & at[(i + size - 1) % size];
  return out;
}

/* Whether all pieces that touch a piece are at least as deep as it: so it is where the piece has a corner of
 * the face and is not itself a child of the face, as the pieces around it come of the same child then. */
static bool is_apart(const compared *c, const piece *own) {
  for (uint32_t i = 0; i < c->base.size && own->level >= 2; i++) {
    uint8_t corner =
        (uint8_t)(TW_ERROR_ON_EDGE << i | TW_ERROR_ON_EDGE << (i + c->base.size - 1) % c->base.size);
    for (uint32_t k = 0; k < 4; k++)
      if ((own->places[k] & corner) == corner) return true;
  }
  return false;
}

/* Raises c->slides to the distances around descendants that are neither patches nor refined, where limit
 * points over these may slide onto patches. */
static void find_slides(compared *c, const piece *own) {
  const tw_level_errors *l = &c->levels[own->level];
  uint32_t left = own->level < OPEN_DEPTH && own->level < c->depth ? find_left(l, own->face) : UINT32_MAX;
  if (l->is_plain[own->face]) return;
  if (left != UINT32_MAX && l->steps[left] >= 0) {
    for (uint32_t i = l->children[left]; i < l->children[left + 1]; i++) {
      piece child = child_of(c, own, size_of(l, own->face), l->children[left], i - l->children[left]);
      find_slides(c, &child);
    }
    return;
  }
  bool is_ring = l->control != l->points && l->ring_rests[own->face] >= 0, apart = is_apart(c, own);
  uint32_t open = own->level + (is_ring ? TW_ERROR_DEPTH : 0);
  if (open < c->open_level) c->open_level = open;
  if (is_ring && !apart) c->slides = tw_greater(c->slides, l->ring_rests[own->face]);
  for (uint32_t i = 0; i < size_of(l, own->face) && !is_ring && !apart; i++)
    c->slides = tw_greater(c->slides, l->around[l->corners[l->begins[own->face] + i]]);
}

/* The distance of a piece's part of the limit from the face. What is at most `enough` is looked at no
 * further. */
static double find_least(const compared *c, const piece *own, double enough) {
  const tw_level_errors *l = &c->levels[own->level];
  double error = own->level > 0 ? piece_error(c, own) : INFINITY, most = 0;
  if (error > enough && own->level > 0 && c->patches)
    error = tw_lesser(error, l->is_plain[own->face] ? patch_error(c, own) : sector_error(c, own));
  uint32_t deepest = l->is_plain[own->face] ? TW_ERROR_DEPTH : OPEN_DEPTH;
  if (error <= enough || own->level >= deepest || own->level == c->depth) return error;
  uint32_t left = find_left(l, own->face), size = size_of(l, own->face);
  if (left == UINT32_MAX || l->steps[left] < 0) return error;
  uint32_t first = l->children[left], count = l->children[left + 1] - first;
  for (uint32_t i = 0; i < count && most < error; i++) {
    piece child = child_of(c, own, size, first, i);
    most = tw_greater(most, find_least(c, &child, tw_greater(most, enough)));
  }
  return tw_lesser(error, most);
}

static compared start(const tw_measuring *m, const tw_level_errors *levels, uint32_t depth, uint32_t left,
                      piece *whole) {
  uint32_t face = levels->made[left], begin = levels->begins[face];
  compared c = {.m = m,
                .levels = levels,
                .depth = depth,
                .open_level = UINT32_MAX,
                .base = {.size = size_of(levels, face), .frame = &levels->frames[left]}};
  *whole = (piece){.face = face};
  for (uint32_t i = 0; i < c.base.size; i++)
    c.base.corners[i] = tw_point_at(levels->points, levels->corners[begin + i]);
  tw_error_begin_base(&c.base, whole->places);
  tw_corners_normal(levels->points, levels->corners + begin, c.base.size, c.base.normal);
  return c;
}

/* Lists the faces of each vertex. */
static tw_status find_fans(tw_arena *arena, tw_level_errors *l) {
  l->fan_begins = tw_arena_alloc(arena, (size_t)l->vertex_count + 2, sizeof *l->fan_begins);
  l->fan_faces = tw_arena_alloc_raw(arena, l->begins[l->face_count], sizeof *l->fan_faces);
  if (!l->fan_begins || !l->fan_faces) return TW_NO_MEMORY;
  uint32_t *ends = l->fan_begins + 1; /* at first the begins: each moves to its end while faces are listed */
  for (uint32_t f = 0; f < l->face_count; f++) {
    if (f % FACES_AT_ONCE == 0 && !tw_work(FACES_AT_ONCE)) return TW_CANCELLED;
    for (uint32_t c = l->begins[f]; c < l->begins[f + 1]; c++) ends[l->corners[c] + 1]++;
  }
  for (uint32_t v = 0; v < l->vertex_count; v++) ends[v + 1] += ends[v];
  for (uint32_t f = 0; f < l->face_count; f++) {
    if (f % FACES_AT_ONCE == 0 && !tw_work(FACES_AT_ONCE)) return TW_CANCELLED;
    for (uint32_t c = l->begins[f]; c < l->begins[f + 1]; c++) l->fan_faces[ends[l->corners[c]]++] = f;
  }
  return TW_OK;
}

/* The normal of the triangle that a corner and its two neighbours span, as long as twice its area. */
static void corner_normal(const tw_level_errors *l, uint32_t face, uint32_t corner, double out[3]) {
  uint32_t size = size_of(l, face);
  const uint32_t *corners = l->corners + l->begins[face];
  const double *own = tw_point_at(l->points, corners[corner]);
  double next[3], previous[3];
  tw_difference3(tw_point_at(l->points, corners[(corner + 1) % size]), own, next);
  tw_difference3(tw_point_at(l->points, corners[(corner + size - 1) % size]), own, previous);
  tw_cross3(next, previous, out);
}

/* The planes of the triangles of a vertex's faces, of quads by either diagonal. Returns how many; 0 where
 * there is no room for all. */
static uint32_t find_planes(const tw_level_errors *l, uint32_t vertex, const double along[3],
                            double out[TW_AROUND_MAX][3]) {
  uint32_t count = 0;
  for (uint32_t k = l->fan_begins[vertex]; k < l->fan_begins[vertex + 1]; k++) {
    uint32_t face = l->fan_faces[k], triangles = size_of(l, face) == 3 ? 1 : size_of(l, face);
    for (uint32_t i = 0; i < triangles; i++) {
      double normal[3];
      corner_normal(l, face, i, normal);
      double height = tw_dot3(normal, along);
      if (!(height > 0)) continue; /* it has no area: others lean less (TW_LEAST_COSINE) */
      if (count == TW_AROUND_MAX) return 0;
      for (int c = 0; c < 3; c++) out[count][c] = normal[c] / height;
      count++;
    }
  }
  return count;
}

/* The least cosine between a direction and the normals of a face's corners. worst: receives that normal. */
static double face_cosine(const tw_level_errors *l, uint32_t face, const double along[3], double worst[3]) {
  double least = 1, normal[3];
  for (uint32_t i = 0; i < size_of(l, face); i++) {
    corner_normal(l, face, i, normal);
    if (!(tw_unit3(normal) > 0) || tw_dot3(normal, along) >= least) continue;
    least = tw_dot3(normal, along);
    memcpy(worst, normal, sizeof normal);
  }
  return least;
}

/* The same of all faces at a vertex. */
static double fan_cosine(const tw_level_errors *l, uint32_t vertex, const double along[3], double worst[3]) {
  double least = 1, own[3] = {0};
  for (uint32_t k = l->fan_begins[vertex]; k < l->fan_begins[vertex + 1]; k++) {
    double cosine = face_cosine(l, l->fan_faces[k], along, own);
    if (cosine >= least) continue;
    least = cosine;
    memcpy(worst, own, sizeof own);
  }
  return least;
}

/* The direction that leans least from the normals at the corners of a face where the surface is folded: its
 * end comes nearer to the middle of the least ball around these (Badoiu and Clarkson 2003, "Smaller core-sets
 * for balls"). False where there is none. */
static bool turn(const tw_level_errors *l, uint32_t face, const tw_error_frame *frame, double along[3]) {
  enum { STEPS = 24 };
  const uint32_t *corners = l->corners + l->begins[face];
  double middle[3] = {along[0], along[1], along[2]};
  for (int step = 1; step <= STEPS; step++) {
    double least = 1, worst[3] = {0}, own[3] = {0};
    for (uint32_t i = 0; i < size_of(l, face); i++) {
      if ((double)frame->corners[i] >= TW_LEAST_COSINE || (double)frame->corners[i] <= -1) continue;
      double cosine = fan_cosine(l, corners[i], along, own);
      if (cosine >= least) continue;
      least = cosine;
      memcpy(worst, own, sizeof own);
    }
    if (least == 1) return false;
    for (int c = 0; c < 3; c++) along[c] = middle[c] += (worst[c] - middle[c]) / (step + 1);
    if (!(tw_unit3(along) > 0)) return false;
  }
  return true;
}

/* The frame of a face for another direction than its normal. */
static tw_error_frame turned_frame(const tw_level_errors *l, uint32_t face, const tw_error_frame *frame,
                                   const double along[3]) {
  const uint32_t *corners = l->corners + l->begins[face];
  double unused[3];
  uint32_t size = size_of(l, face);
  tw_error_frame out = {.own = tw_error_rounded_down(face_cosine(l, face, along, unused)),
                        .reach = frame->reach};
  for (uint32_t i = 0; i < size; i++)
    out.corners[i] = (double)frame->corners[i] <= -1
                         ? -1
                         : tw_error_rounded_down(fan_cosine(l, corners[i], along, unused));
  for (uint32_t i = 0; i < size; i++) /* the faces of an edge are among those of its ends */
    out.edges[i] = (double)frame->edges[i] <= -1
                       ? -1
                       : (float)tw_greater((double)out.corners[i], (double)out.corners[(i + 1) % size]);
  return out;
}

/* Looks at a face again, by planes, by limit points of patches and by its hull. */
static void look_again(const compared *by, const piece *whole, double enough, double *error) {
  const tw_level_errors *l = by->levels;
  compared c = *by;
  tw_error_planes planes;
  c.base.around = 1;
  for (uint32_t i = 0; i < c.base.size; i++) {
    double cosine = (double)c.base.frame->corners[i];
    uint32_t vertex = l->corners[l->begins[whole->face] + i];
    c.base.around = tw_lesser(c.base.around, cosine);
    planes.counts[i] =
        cosine >= TW_LEAST_COSINE ? find_planes(l, vertex, c.base.normal, planes.normals[i]) : 0;
  }
  c.base.planes = &planes;
  *error = tw_lesser(*error, find_least(&c, whole, enough));
  if (*error <= enough || c.base.size < 4) return;
  const tw_error_hull hull = tw_error_find_hull(c.base.corners);
  c.base.hull = &hull;
  *error = tw_lesser(*error, find_least(&c, whole, enough));
}

/* Compares an open face with what comes of it. */
static tw_status refine_error(const tw_measuring *m, tw_arena *scratch, tw_level_errors *levels,
                              uint32_t depth, uint32_t left, double enough) {
  uint32_t face = levels->made[left], patches = 0;
  double *error = &levels->errors[face];
  piece whole;
  if (size_of(levels, face) > 4) return TW_OK;
  compared c = start(m, levels, depth, left, &whole);
  *error = tw_lesser(*error, find_least(&c, &whole, enough));
  if (*error <= enough) return TW_OK;
  for (uint32_t i = 0; i <= depth && i <= OPEN_DEPTH; i++) {
    tw_status status = levels[i].fan_begins ? TW_OK : find_fans(scratch, &levels[i]);
    if (status != TW_OK) return status;
  }
  if (!tw_work(LOOK_WORK)) return TW_CANCELLED;
  find_slides(&c, &whole);
  c.patches = &patches;
  look_again(&c, &whole, enough, error);
  if (*error > enough && turn(levels, face, c.base.frame, c.base.normal)) {
    tw_error_frame turned = turned_frame(levels, face, c.base.frame, c.base.normal);
    c.base.frame = &turned;
    look_again(&c, &whole, enough, error);
  }
  return tw_work((uint64_t)PATCH_WORK * patches) ? TW_OK : TW_CANCELLED;
}

static tw_status find_around(tw_arena *arena, tw_level_errors *l) {
  l->around = tw_arena_alloc(arena, l->vertex_count, sizeof *l->around);
  if (!l->around) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < l->face_count; f++) {
    if (f % FACES_AT_ONCE == 0 && !tw_work(FACES_AT_ONCE)) return TW_CANCELLED;
    for (uint32_t i = l->begins[f]; i < l->begins[f + 1]; i++) {
      double *greatest = &l->around[l->corners[i]];
      *greatest = tw_greater(*greatest, l->errors[f]);
    }
  }
  return TW_OK;
}

tw_status tw_error_sum_up(const tw_measuring *m, tw_arena *scratch, tw_level_errors *levels, uint32_t depth,
                          double *most) {
  tw_level_errors *below = &levels[1];
  tw_status status = find_around(scratch, below);
  if (status != TW_OK) return status;
  uint32_t farthest = UINT32_MAX;
  for (uint32_t f = 0; f < levels->left_count; f++) {
    double greatest = 0;
    if (levels->steps[f] < 0) continue;
    for (uint32_t c = below->begins[levels->children[f]]; c < below->begins[levels->children[f + 1]]; c++)
      greatest = tw_greater(greatest, below->around[below->corners[c]]);
    levels->errors[levels->made[f]] = levels->steps[f] + greatest;
    if (farthest == UINT32_MAX || levels->errors[levels->made[f]] > levels->errors[levels->made[farthest]])
      farthest = f;
  }
  /* The farthest face first: it tells what of others does not matter. */
  if (farthest != UINT32_MAX) {
    status = refine_error(m, scratch, levels, depth, farthest, *most);
    if (status != TW_OK) return status;
    *most = tw_greater(*most, levels->errors[levels->made[farthest]]);
  }
  for (uint32_t f = 0; f < levels->left_count; f++) {
    if (f % FACES_AT_ONCE == 0 && !tw_work(FACES_AT_ONCE)) return TW_CANCELLED;
    if (levels->steps[f] < 0 || levels->errors[levels->made[f]] <= *most) continue;
    status = refine_error(m, scratch, levels, depth, f, *most);
    if (status != TW_OK) return status;
    *most = tw_greater(*most, levels->errors[levels->made[f]]);
  }
  return TW_OK;
}
