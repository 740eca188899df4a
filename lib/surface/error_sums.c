/* Distances added up over levels. A face is compared with its descendants some levels deeper, and only the
 * distance between those and the limit is added. A sum over all levels in between would count each of their
 * steps in full, though these are not greatest at one place.
 *
 * Each triangle of a descendant lies over one triangle of the face. The distance from the face's triangle is
 * a convex function, so a descendant's triangle is farthest at its corners. That bounds the way from
 * descendants to the face; the way back has the same bound, as descendants cover the face, edges over edges.
 */
#include "sorted.h"
#include "surface_error.h"

enum {
  DEPTH = 3,            /* how many levels deeper a face is compared */
  FACES_AT_ONCE = 1024, /* between two charges of work */
  ON_EDGE = TW_ERROR_ON_EDGE,
  IN_TRIANGLE = TW_ERROR_IN_TRIANGLE
};

/* The corners of a quad's triangles. The first two are on both sides of one diagonal, the others of the
 * other. */
static const uint8_t quad_triangles[4][3] = {{0, 1, 2}, {0, 2, 3}, {1, 2, 3}, {0, 1, 3}};

/* A face of a level, and the place of its corners over the face that it comes of. */
typedef struct piece {
  uint32_t level, face;
  uint8_t places[4]; /* bits */
} piece;

/* A face that is compared with its pieces. */
typedef struct compared {
  const tw_level_errors *levels;
  uint32_t depth;
  bool loop;
  tw_error_base base;
} compared;

static uint32_t size_of(const tw_level_errors *l, uint32_t face) {
  return l->begins[face + 1] - l->begins[face];
}

/* The point of a triangle nearest to another: Ericson 2005, "Real-Time Collision Detection", 5.1.5. */
static void nearest_on_triangle(const double *a, const double *b, const double *c, const double *to,
                                double out[3]) {
  double ab[3], ac[3], at[3], normal[3], inside[3], best = INFINITY;
  const double *corners[3] = {a, b, c};
  tw_difference3(b, a, ab);
  tw_difference3(c, a, ac);
  tw_difference3(to, a, at);
  tw_cross3(ab, ac, normal);
  double square = tw_dot3(normal, normal);
  tw_cross3(at, ac, inside);
  double second = tw_dot3(inside, normal);
  tw_cross3(ab, at, inside);
  double third = tw_dot3(inside, normal);
  if (square > 0 && second >= 0 && third >= 0 && second + third <= square) {
    for (int i = 0; i < 3; i++) out[i] = a[i] + second / square * ab[i] + third / square * ac[i];
    return;
  }
  for (int i = 0; i < 3; i++) {
    double foot[3], moved[3];
    tw_error_nearest_on(corners[i], corners[(i + 1) % 3], to, foot);
    tw_difference3(to, foot, moved);
    double distance = tw_dot3(moved, moved);
    if (distance >= best) continue;
    best = distance;
    for (int k = 0; k < 3; k++) out[k] = foot[k];
  }
}

/* A point over the inside of a triangle, or beside it: then it slides over the faces around. */
static void take_inner(const tw_error_base *b, tw_error_gap *g, const uint8_t triangle[3],
                       const double *point) {
  double foot[3];
  nearest_on_triangle(b->corners[triangle[0]], b->corners[triangle[1]], b->corners[triangle[2]], point, foot);
  tw_error_gap_take(g, point, foot, b->around);
}

static void take_on_edge(const tw_error_base *b, tw_error_gap *g, uint32_t edge, const double *point) {
  double foot[3];
  tw_error_nearest_on(b->corners[edge], b->corners[(edge + 1) % b->size], point, foot);
  tw_error_gap_take(g, point, foot, (double)b->frame->edges[edge]);
}

void tw_error_take_point(const tw_error_base *b, tw_error_gap *g, uint8_t place, const double *point) {
  double own = (double)b->frame->own, foot[3];
  for (uint32_t i = 0; i < b->size; i++) {
    uint32_t before = (i + b->size - 1) % b->size;
    if (!(place & ON_EDGE << i)) continue;
    if (place & ON_EDGE << before) {
      tw_error_gap_take(g, point, b->corners[i], (double)b->frame->corners[i]);
      return;
    }
    if (place & ON_EDGE << (i + 1) % b->size) continue; /* the next corner */
    take_on_edge(b, g, i, point);
    return;
  }
  if (b->size == 3) {
    take_inner(b, g, quad_triangles[0], point);
    return;
  }
  for (uint32_t diagonal = 0; diagonal < 2; diagonal++) {
    uint32_t first = 2 * diagonal;
    bool is_in[2] = {place & IN_TRIANGLE << first, place & IN_TRIANGLE << (first + 1)};
    if (is_in[0] && is_in[1]) {
      tw_error_nearest_on(b->corners[diagonal], b->corners[diagonal + 2], point, foot);
      tw_error_gap_take(g, point, foot, own);
    } else {
      take_inner(b, g, quad_triangles[is_in[0] ? first : first + 1], point);
    }
  }
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
  return g.size + tw_lesser(beside, l->wholes[own->face]);
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
  if (c->loop) {
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

/* The distance of a piece's part of the limit from the face. What is at most `enough` is looked at no
 * further. */
static double find_least(const compared *c, const piece *own, double enough) {
  const tw_level_errors *l = &c->levels[own->level];
  double error = own->level > 0 ? piece_error(c, own) : INFINITY, most = 0;
  if (error <= enough || own->level == DEPTH || own->level == c->depth) return error;
  uint32_t left = find_left(l, own->face), size = size_of(l, own->face);
  if (left == UINT32_MAX || l->steps[left] < 0) return error;
  uint32_t first = l->children[left], count = l->children[left + 1] - first;
  for (uint32_t i = 0; i < count && most < error; i++) {
    piece child = child_of(c, own, size, first, i);
    most = tw_greater(most, find_least(c, &child, tw_greater(most, enough)));
  }
  return tw_lesser(error, most);
}

static compared start(const tw_level_errors *levels, uint32_t depth, bool loop, uint32_t left, piece *whole) {
  uint32_t face = levels->made[left], begin = levels->begins[face];
  compared c = {
      levels, depth, loop, {.size = size_of(levels, face), .around = 1, .frame = &levels->frames[left]}};
  tw_error_base *base = &c.base;
  *whole = (piece){.face = face};
  for (uint32_t i = 0; i < base->size; i++) {
    base->corners[i] = tw_point_at(levels->points, levels->corners[begin + i]);
    base->around = tw_lesser(base->around, (double)base->frame->corners[i]);
    whole->places[i] = (uint8_t)(ON_EDGE << i | ON_EDGE << (i + base->size - 1) % base->size);
    for (uint32_t k = 0; k < 4; k++)
      for (uint32_t j = 0; j < 3; j++)
        if (base->size == 3 || quad_triangles[k][j] == i) whole->places[i] |= (uint8_t)(IN_TRIANGLE << k);
  }
  tw_corners_normal(levels->points, levels->corners + begin, base->size, base->normal);
  return c;
}

/* Compares an open face with what comes of it. */
static void refine_error(tw_level_errors *levels, uint32_t depth, bool loop, uint32_t left, double enough) {
  uint32_t face = levels->made[left];
  double *error = &levels->errors[face];
  piece whole;
  if (size_of(levels, face) > 4) return;
  const compared c = start(levels, depth, loop, left, &whole);
  *error = tw_lesser(*error, find_least(&c, &whole, enough));
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

tw_status tw_error_sum_up(tw_arena *scratch, tw_level_errors *levels, uint32_t depth, bool loop,
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
    refine_error(levels, depth, loop, farthest, *most);
    *most = tw_greater(*most, levels->errors[levels->made[farthest]]);
  }
  for (uint32_t f = 0; f < levels->left_count; f++) {
    if (f % FACES_AT_ONCE == 0 && !tw_work(FACES_AT_ONCE)) return TW_CANCELLED;
    if (levels->steps[f] < 0 || levels->errors[levels->made[f]] <= *most) continue;
    refine_error(levels, depth, loop, f, *most);
    *most = tw_greater(*most, levels->errors[levels->made[f]]);
  }
  return TW_OK;
}
