/* Faces around one irregular point, all else around them being regular and smooth: measured once, for their
 * own level and all deeper ones, as regular faces are (surface_error.c, 1).
 *
 * Two rows of control points around such a point tell everything near it: a step takes them to three rows of
 * the next level, of which two are the same again, so all steps are one matrix, whose masks a wheel holds
 * (Stam 1998, "Exact evaluation of Catmull-Clark subdivision surfaces at arbitrary parameter values"). Points
 * are looked at along the normal of the limit surface at the irregular point. Their heights over the tangent
 * plane have no part of the eigenvalues 1 and lambda, as the limit point and its tangents are what masks of
 * the left eigenvectors say, so heights shrink faster than faces do, and slopes with them (Reif 1995, "A
 * unified approach to subdivision algorithms near extraordinary vertices"; Peters and Reif 2008, "Subdivision
 * surfaces", chapter 4).
 *
 * Each step leaves faces between the rows that are regular: they are measured as such (Wu and Peters 2005,
 * "An accurate error measure for adaptive subdivision surfaces", go the same way). The faces at the point are
 * compared with their children, until they lie in a hull that is thin enough. Steps of a few points cost
 * little, so that nothing but these is made of deeper levels. */
#include <string.h>

#include "limit.h"
#include "surface_error.h"

enum {
  VALENCE_MAX = TW_ERROR_VALENCE_MAX,
  ROWS = 3,
  POINTS_MAX = 1 + 12 * VALENCE_MAX, /* of three rows */
  PLAIN_VALENCE = 4,
  COMPARE_WORK = 8192 /* of a sector that is compared with a deeper level */
};

/* A term of a sum of a wheel's points. */
typedef struct term {
  uint32_t from;
  double weight;
} term;

typedef struct sums {
  uint32_t *begins; /* [sums + 1] */
  term *terms;
} sums;

/* What is the same around all irregular points of a valence. Points go from the middle outward, row by row;
 * point a, b of a sector is a steps along its own spoke and b along the next. */
struct tw_error_wheel {
  uint32_t valence, two_rows, three_rows; /* the points of two rows, and of three */
  sums step;                              /* [three_rows] of two rows */
  sums limit;                             /* [two_rows] of three rows: the limit point of each */
  double (*tangents)[2];                  /* [two_rows] at the middle */
  uint32_t (*nets)[16];                   /* [3 valence] of three rows: of faces that a step makes regular */
  uint32_t (*quads)[4];                   /* [4 valence] of two rows */
};

/* ---- wheels -------------------------------------------------------------------------------------- */

/* The point of a sector of quads; rows beyond its spokes are those of the sectors beside it. */
static uint32_t point_of(uint32_t valence, uint32_t sector, int a, int b) {
  for (;; sector++) {
    int turned = a;
    if (a == 0 && b == 0) return 0;
    if (a > 0 && b >= 0) break;
    if (b < 0) {
      a = -b;
      b = turned;
      sector += valence - 2; /* the one before */
    } else {
      a = b;
      b = -turned;
    }
  }
  uint32_t row = (uint32_t)(a > b ? a : b), place = a >= b ? (uint32_t)b : row + (row - (uint32_t)a);
  return 1 + valence * row * (row - 1) + sector % valence * 2 * row + place;
}

/* The faces of three rows, of which those of the first two come first. */
static tw_status build_topology(uint32_t valence, tw_arena *arena, tw_topology *out) {
  uint32_t *corners = tw_arena_alloc_raw(arena, (size_t)valence * ROWS * ROWS, 4 * sizeof *corners),
           count = 0;
  if (!corners) return TW_NO_MEMORY;
  for (int row = 0; row < ROWS; row++)
    for (uint32_t s = 0; s < valence; s++)
      for (int place = 0; place < 2 * row + 1; place++) {
        int a = place <= row ? row : 2 * row - place, b = place <= row ? place : row;
        uint32_t quad[4] = {point_of(valence, s, a, b), point_of(valence, s, a + 1, b),
                            point_of(valence, s, a + 1, b + 1), point_of(valence, s, a, b + 1)};
        memcpy(corners + count, quad, sizeof quad);
        count += 4;
      }
  tw_status status =
      tw_topology_build(out, arena, 1 + 12 * valence, valence * ROWS * ROWS, NULL, count, corners);
  if (status == TW_OK) status = tw_topology_soften(out, arena);
  if (status == TW_OK) tw_topology_sharpen(out, false);
  return status;
}

/* The child's vertex at a point of three rows. */
static uint32_t child_at(const tw_topology *t, uint32_t valence, uint32_t sector, int a, int b) {
  uint32_t low = point_of(valence, sector, a / 2, b / 2);
  if (a % 2 == 0 && b % 2 == 0) return low;
  if (a % 2 == 0 || b % 2 == 0)
    return t->vertex_count +
           tw_topology_find_edge(t, low, point_of(valence, sector, (a + 1) / 2, (b + 1) / 2));
  int row = a > b ? a / 2 : b / 2, place = a >= b ? b / 2 : 2 * row - a / 2;
  return t->vertex_count + t->edge_count + valence * (uint32_t)(row * row) +
         sector * (uint32_t)(2 * row + 1) + (uint32_t)place;
}

/* Adds a sum: dense weights, which it clears. */
static void add_sum(sums *to, uint32_t index, double *dense, uint32_t count) {
  uint32_t end = to->begins[index];
  for (uint32_t i = 0; i < count; i++) {
    if (dense[i] != 0) to->terms[end++] = (term){i, dense[i]};
    dense[i] = 0;
  }
  to->begins[index + 1] = end;
}

static void add_step(tw_error_wheel *w, const tw_topology *t, const tw_rules *rules, uint32_t index,
                     uint32_t child, tw_share *shares, double *dense) {
  uint32_t count = tw_refine_mask(t, rules, child, shares);
  for (uint32_t i = 0; i < count; i++) {
    if (shares[i].vertex < t->vertex_count) {
      dense[shares[i].vertex] += (double)shares[i].weight;
      continue;
    }
    uint32_t face = shares[i].vertex - t->vertex_count - t->edge_count;
    for (uint32_t k = 0; k < 4; k++) dense[t->corner_vertex[4 * face + k]] += (double)shares[i].weight / 4;
  }
  add_sum(&w->step, index, dense, w->three_rows);
}

static void add_steps(tw_error_wheel *w, const tw_topology *t, const tw_rules *rules, tw_share *shares,
                      double *dense) {
  add_step(w, t, rules, 0, 0, shares, dense);
  for (int row = 1; row <= ROWS; row++)
    for (uint32_t s = 0; s < w->valence; s++)
      for (int place = 0; place < 2 * row; place++) {
        int a = place <= row ? row : 2 * row - place, b = place <= row ? place : row;
        add_step(w, t, rules, point_of(w->valence, s, a, b), child_at(t, w->valence, s, a, b), shares, dense);
      }
}

static void add_limits(tw_error_wheel *w, const tw_topology *t, tw_limit_entry *mask, double *dense) {
  for (uint32_t v = 0; v < w->two_rows; v++) {
    uint32_t count = tw_limit_mask(t, false, t->fan_corners[t->fan_offsets[v]], mask);
    dense[v] = 1;
    for (uint32_t i = 0; i < count; i++) {
      dense[mask[i].vertex] += (double)mask[i].position;
      dense[v] -= (double)mask[i].position;
      if (v > 0) continue;
      w->tangents[mask[i].vertex][0] += (double)mask[i].tangent1;
      w->tangents[mask[i].vertex][1] += (double)mask[i].tangent2;
    }
    add_sum(&w->limit, v, dense, w->three_rows);
  }
}

/* The faces of a sector that a step makes regular: a, b of their first point. */
static const int regular_cells[3][2] = {{1, 0}, {1, 1}, {0, 1}};

static void add_faces(tw_error_wheel *w, const tw_topology *t) {
  for (uint32_t s = 0; s < w->valence; s++)
    for (uint32_t i = 0; i < 3; i++)
      for (int k = 0; k < 16; k++)
        w->nets[3 * s + i][k] =
            point_of(w->valence, s, regular_cells[i][0] + k % 4 - 1, regular_cells[i][1] + k / 4 - 1);
  memcpy(w->quads, t->corner_vertex, 4 * (size_t)w->valence * sizeof *w->quads);
}

static tw_error_wheel *create_wheel(const tw_rules *rules, uint32_t valence, tw_arena *arena) {
  tw_error_wheel *w = tw_arena_alloc(arena, 1, sizeof *w);
  tw_topology t;
  if (!w || build_topology(valence, arena, &t) != TW_OK) return NULL;
  *w = (tw_error_wheel){.valence = valence, .two_rows = 1 + 6 * valence, .three_rows = 1 + 12 * valence};
  size_t terms = 9 * (size_t)w->three_rows + 2 * (size_t)valence;
  w->step.begins = tw_arena_alloc(arena, w->three_rows + 1, sizeof *w->step.begins);
  w->step.terms = tw_arena_alloc_raw(arena, terms, sizeof *w->step.terms);
  w->limit.begins = tw_arena_alloc(arena, w->two_rows + 1, sizeof *w->limit.begins);
  w->limit.terms = tw_arena_alloc_raw(arena, terms, sizeof *w->limit.terms);
  w->tangents = tw_arena_alloc(arena, w->three_rows, sizeof *w->tangents);
  w->nets = tw_arena_alloc_raw(arena, 3 * (size_t)valence, sizeof *w->nets);
  w->quads = tw_arena_alloc_raw(arena, 4 * (size_t)valence, sizeof *w->quads);
  double *dense = tw_arena_alloc(arena, w->three_rows, sizeof *dense);
  tw_share *shares = tw_arena_alloc_raw(arena, tw_refine_mask_capacity(&t), sizeof *shares);
  tw_limit_entry *mask = tw_arena_alloc_raw(arena, tw_limit_greatest_capacity(&t), sizeof *mask);
  if (!w->step.begins || !w->step.terms || !w->limit.begins || !w->limit.terms || !w->tangents || !w->nets ||
      !w->quads || !dense || !shares || !mask)
    return NULL;
  add_steps(w, &t, rules, shares, dense);
  add_limits(w, &t, mask, dense);
  add_faces(w, &t);
  return w;
}

uint32_t tw_error_wheel_valence(const tw_topology *t, uint32_t vertex) {
  uint32_t valence = t->fan_offsets[vertex + 1] - t->fan_offsets[vertex];
  return valence > 2 && valence <= VALENCE_MAX && valence != PLAIN_VALENCE ? valence : 0;
}

tw_status tw_error_make_wheels(tw_measuring *m) {
  m->wheels = tw_arena_alloc(m->arena, VALENCE_MAX + 1, sizeof *m->wheels);
  return m->wheels ? TW_OK : TW_NO_MEMORY;
}

tw_status tw_error_find_wheels(const tw_measuring *m, const tw_topology *t) {
  if (m->rules.loop || m->rules.linear || t->face_size != 4) return TW_OK;
  for (uint32_t v = 0; v < t->vertex_count; v++) {
    uint32_t valence = tw_error_wheel_valence(t, v);
    if (valence == 0 || m->wheels[valence]) continue;
    m->wheels[valence] = create_wheel(&m->rules, valence, m->arena);
    if (!m->wheels[valence]) return TW_NO_MEMORY;
  }
  return TW_OK;
}

/* ---- the points around a vertex ------------------------------------------------------------------ */

/* Points of a level around an irregular one, seen along the normal there, which is the third axis. */
typedef struct ring {
  double control[POINTS_MAX][3], at_limit[POINTS_MAX][3];
  double (*shown)[3]; /* either */
  double normals[4 * VALENCE_MAX][4][3];
  uint32_t count; /* of control */
} ring;

/* Lists the vertices of two rows. False where more than the middle is irregular or sharp, or the surface
 * ends.
 */
static bool list_points(const tw_error_part *p, uint32_t vertex, uint32_t valence, uint32_t *out) {
  const tw_topology *t = &p->topology;
  uint32_t corner = t->fan_corners[t->fan_offsets[vertex]];
  if (!tw_error_is_plain(t, vertex)) return false;
  out[0] = vertex;
  for (uint32_t s = 0; s < valence; s++) {
    uint32_t next = tw_quad_next(corner), far = tw_quad_next(next), beyond = t->sibling[next],
             past = t->sibling[far];
    for (uint32_t c = next;; c = far) {
      uint32_t beside = t->corner_vertex[c];
      if (t->fan_offsets[beside + 1] - t->fan_offsets[beside] != PLAIN_VALENCE ||
          !tw_error_is_plain(t, beside))
        return false;
      if (c == far) break;
    }
    uint32_t diagonal = t->sibling[tw_quad_previous(beyond)];
    if (p->states[corner / 4] == TW_FACE_HIDDEN || p->states[beyond / 4] == TW_FACE_HIDDEN ||
        p->states[past / 4] == TW_FACE_HIDDEN || p->states[diagonal / 4] == TW_FACE_HIDDEN)
      return false;
    uint32_t *row = out + 1 + 2 * (size_t)s, *second = out + 1 + 2 * (size_t)valence + 4 * (size_t)s;
    row[0] = t->corner_vertex[next];
    row[1] = t->corner_vertex[far];
    second[0] = t->corner_vertex[tw_quad_previous(tw_quad_previous(beyond))];
    second[1] = t->corner_vertex[tw_quad_previous(beyond)];
    second[2] = t->corner_vertex[tw_quad_next(tw_quad_next(diagonal))];
    second[3] = t->corner_vertex[tw_quad_previous(tw_quad_previous(past))];
    corner = t->sibling[tw_quad_previous(corner)];
  }
  return corner == t->fan_corners[t->fan_offsets[vertex]];
}

static void take_sum(const sums *by, uint32_t index, double (*from)[3], double out[3]) {
  double x = 0, y = 0, z = 0;
  for (uint32_t i = by->begins[index]; i < by->begins[index + 1]; i++) {
    const double *at = from[by->terms[i].from];
    x += by->terms[i].weight * at[0];
    y += by->terms[i].weight * at[1];
    z += by->terms[i].weight * at[2];
  }
  out[0] = x;
  out[1] = y;
  out[2] = z;
}

/* Finds axes: the normal is the last. False where the tangents are parallel. */
static bool find_axes(const tw_error_wheel *w, double (*points)[3], double axes[3][3]) {
  double tangents[2][3] = {{0}};
  for (uint32_t i = 0; i < w->two_rows; i++)
    for (int k = 0; k < 2; k++)
      for (int c = 0; c < 3; c++) tangents[k][c] += w->tangents[i][k] * points[i][c];
  tw_cross3(tangents[0], tangents[1], axes[2]);
  double area = tw_length3(axes[2]),
         longest = tw_dot3(tangents[0], tangents[0]) + tw_dot3(tangents[1], tangents[1]);
  if (!(area > 1e-9 * longest)) return false;
  tw_unit3(axes[2]);
  memcpy(axes[0], tangents[0], sizeof axes[0]);
  tw_unit3(axes[0]);
  tw_cross3(axes[2], axes[0], axes[1]);
  return true;
}

static bool gather(const tw_error_part *p, const tw_error_wheel *w, uint32_t vertex, ring *out) {
  uint32_t vertices[POINTS_MAX];
  double axes[3][3], origin[3], to[3];
  if (!list_points(p, vertex, w->valence, vertices)) return false;
  for (uint32_t i = 0; i < w->two_rows; i++)
    tw_difference3(tw_point_at(p->control, vertices[i]), tw_point_at(p->control, vertex), out->at_limit[i]);
  if (!find_axes(w, out->at_limit, axes)) return false;
  take_sum(&w->limit, 0, out->at_limit, origin);
  for (uint32_t i = 0; i < w->two_rows; i++) {
    tw_difference3(out->at_limit[i], origin, to);
    for (int c = 0; c < 3; c++) out->control[i][c] = tw_dot3(axes[c], to);
  }
  for (uint32_t i = 0; p->shown != p->control && i < w->two_rows; i++) {
    tw_difference3(tw_point_at(p->shown, vertices[i]), tw_point_at(p->control, vertex), to);
    tw_difference3(to, origin, to);
    for (int c = 0; c < 3; c++) out->at_limit[i][c] = tw_dot3(axes[c], to);
  }
  out->shown = p->shown != p->control ? out->at_limit : out->control;
  out->count = w->two_rows;
  return true;
}

/* Finds the unit normal of the triangle that each corner of two rows' faces spans; NAN where it has none. */
static void find_normals(const tw_error_wheel *w, ring *r) {
  for (uint32_t q = 0; q < 4 * w->valence; q++)
    for (uint32_t i = 0; i < 4; i++) {
      const uint32_t *quad = w->quads[q];
      double a[3], b[3], *normal = r->normals[q][i];
      tw_difference3(r->shown[quad[(i + 1) % 4]], r->shown[quad[i]], a);
      tw_difference3(r->shown[quad[(i + 3) % 4]], r->shown[quad[i]], b);
      tw_cross3(a, b, normal);
      if (!(tw_unit3(normal) > 0)) normal[0] = NAN;
    }
}

static void step_ring(const tw_error_wheel *w, ring *from, bool limit, ring *to) {
  for (uint32_t i = 0; i < w->three_rows; i++) take_sum(&w->step, i, from->control, to->control[i]);
  for (uint32_t i = 0; limit && i < w->two_rows; i++) take_sum(&w->limit, i, to->control, to->at_limit[i]);
  to->shown = limit ? to->at_limit : to->control;
  to->count = w->three_rows;
}

/* The net of a face that the last step made regular: regular_cells[i] of a sector. */
static void find_cell(const tw_error_wheel *w, const ring *r, uint32_t sector, uint32_t i,
                      tw_error_net *out) {
  for (int k = 0; k < 16; k++)
    memcpy(out->points[k / 4][k % 4], r->control[w->nets[3 * sector + i][k]], sizeof(double[3]));
}

/* ---- measures ------------------------------------------------------------------------------------ */

static double least_cosine(const ring *r, uint32_t begin, uint32_t end, const double normal[3]) {
  double least = 1;
  for (uint32_t q = begin; q < end; q++)
    for (uint32_t i = 0; i < 4; i++) {
      double cosine = tw_dot3(r->normals[q][i], normal);
      if (cosine < least) least = cosine; /* false for NAN */
    }
  return least;
}

/* The least cosine between the normal of a face at the middle and those of the faces around it. */
static double cosine_around(const tw_error_wheel *w, const ring *r, uint32_t sector, const double normal[3]) {
  uint32_t n = w->valence, own = n + 3 * sector, before = n + 3 * ((sector + n - 1) % n) + 2,
           after = n + 3 * ((sector + 1) % n);
  double least = least_cosine(r, 0, n, normal);
  least = tw_lesser(least, least_cosine(r, own, own + 3, normal));
  least = tw_lesser(least, least_cosine(r, before, before + 1, normal));
  return tw_lesser(least, least_cosine(r, after, after + 1, normal));
}

/* Whether the faces are a graph, seen along the normal at the middle. */
static bool is_graph(const tw_error_wheel *w, const ring *r) {
  static const double axis[3] = {0, 0, 1};
  return least_cosine(r, 0, 4 * w->valence, axis) >= TW_LEAST_COSINE;
}

/* How far apart surfaces may be that lie in the hull of the points: along the normal, where they are graphs.
 */
static double hull_of(const ring *r, bool graph) {
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, size[3];
  for (uint32_t i = 0; i < r->count; i++)
    for (int c = 0; c < 3; c++) {
      low[c] = tw_lesser(low[c], r->control[i][c]);
      high[c] = tw_greater(high[c], r->control[i][c]);
    }
  tw_difference3(high, low, size);
  return graph ? size[2] : tw_length3(size);
}

/* The difference between the faces at the middle and their children. */
static double step_error(const tw_error_wheel *w, const ring *r, const ring *next) {
  double most = 0;
  for (uint32_t s = 0; s < w->valence; s++) {
    uint32_t side = 1 + 2 * s, other = 1 + 2 * ((s + 1) % w->valence), row = 1 + 2 * w->valence + 4 * s,
             last = 1 + 2 * w->valence + 4 * ((s + 1) % w->valence);
    const uint32_t corners[4] = {0, side, side + 1, other},
                   children[9] = {0, side, row, row + 1, row + 2, row + 3, last, other, side + 1};
    double own[4][3], below[9][3], normal[3];
    for (int i = 0; i < 4; i++) memcpy(own[i], r->shown[corners[i]], sizeof own[i]);
    for (int i = 0; i < 9; i++) memcpy(below[i], next->shown[children[i]], sizeof below[i]);
    tw_corners_normal(r->shown[0], corners, 4, normal);
    most = tw_greater(most,
                      tw_error_of_quad(own, below, normal, tw_error_slope(cosine_around(w, r, s, normal))));
  }
  return most;
}

/* A regular face that a step made. error: the distance between its points and those of the limit at the same
 * parameters; hull: an upper bound of that distance for the face and all its children. */
typedef struct born {
  tw_error_net net;
  double error, hull;
} born;

/* Lists the regular faces that the last step made. farthest_first: in that order. */
static void list_regular(const tw_error_wheel *w, const ring *r, bool limit, bool graph, bool farthest_first,
                         born *out, const born **order) {
  for (uint32_t i = 0, place = 0; i < 3 * w->valence; place = ++i) {
    born *own = &out[i];
    find_cell(w, r, i / 3, i % 3, &own->net);
    own->error = tw_error_of_net(&own->net, limit, &own->hull);
    if (!graph) own->hull = INFINITY;
    for (; farthest_first && place > 0 && order[place - 1]->error < own->error; place--)
      order[place] = order[place - 1];
    order[place] = own;
  }
}

/* Whether a regular face is farther than some distances on some level. */
static bool is_farther(const born *b, const double *known, const double *errors, uint32_t count) {
  double error = b->error;
  for (uint32_t k = 0; k < count; k++, error /= 4) {
    double most = tw_greater(known[k], errors[k]);
    if (tw_lesser(error, b->hull) > most) return true;
    if (error <= most) return false;
  }
  return false;
}

/* The distance of the regular faces that the last step made, on their level and on `count` in all. */
static void take_regular(const tw_error_wheel *w, const ring *r, bool limit, bool graph, const double *known,
                         double *errors, uint32_t count) {
  born all[3 * VALENCE_MAX];
  const born *order[3 * VALENCE_MAX];
  list_regular(w, r, limit, graph, known != NULL, all, order);
  for (uint32_t i = 0; i < 3 * w->valence; i++) {
    double error = order[i]->error, each[TW_ERROR_LOOKED] = {error, error / 4, error / 16},
           enough[TW_ERROR_LOOKED];
    if (known && is_farther(order[i], known, errors, count)) {
      for (uint32_t k = 0; k < TW_ERROR_LOOKED; k++)
        enough[k] = k < count ? tw_greater(known[k], errors[k]) : INFINITY;
      tw_error_look_at_net(&order[i]->net, limit, enough, each);
    }
    for (uint32_t k = 0; k < count; k++) {
      error = k < TW_ERROR_LOOKED ? each[k] : error / 4;
      errors[k] = tw_greater(errors[k], tw_lesser(error, order[i]->hull));
      if (k >= TW_ERROR_LOOKED && error <= order[i]->hull) break; /* a quarter from there on */
    }
  }
}

/* ---- a closer look at the faces at the middle ------------------------------------------------------
 *
 * A sum over all levels counts each step in full. So these faces are compared with what comes of them some
 * levels deeper (error_sums.c): with limit points of the regular faces that the steps between made, and with
 * the faces of the last of these levels, of which the distance from the limit is added. Points of the limit
 * may slide from the faces at the middle to those around them, so these count too. It takes long, and is done
 * for limit points alone: the sum is near for control points, of which those at the middle move at each step.
 */

enum { ON_TRIANGLES, OVER_HULLS, WAYS };

/* What is found of the faces at the middle of a level, each way. */
typedef struct closer {
  double regular[WAYS]; /* their distance from the limit of regular faces */
  double deeper[WAYS];  /* from faces as many levels deeper as were compared */
} closer;

/* The face of a sector at the middle, over which its points slide as all faces around it allow. places: of
 * its corners. */
static tw_error_base base_of(const tw_error_wheel *w, const ring *r, uint32_t sector, tw_error_frame *frame,
                             uint8_t places[4]) {
  tw_error_base out = {.size = 4, .frame = frame};
  const uint32_t *quad = w->quads[sector];
  double length = 0, side[3];
  for (int i = 0; i < 4; i++) {
    out.corners[i] = r->shown[quad[i]];
    tw_difference3(r->shown[quad[(i + 1) % 4]], r->shown[quad[i]], side);
    length += tw_length3(side);
  }
  tw_corners_normal(r->shown[0], quad, 4, out.normal);
  float around = tw_error_rounded_down(cosine_around(w, r, sector, out.normal));
  *frame = (tw_error_frame){.corners = {around, around, around, around},
                            .edges = {around, around, around, around},
                            .own = around,
                            .reach = (float)(length / 8 * (1 - 1e-6))};
  tw_error_begin_base(&out, places);
  return out;
}

/* Finds the places of a sector's four faces at the irregular vertex after some steps: of the irregular face
 * first, then of those of regular_cells. at[0]: at first the places of the sector's own corners. */
static void find_quarters(uint32_t steps, uint8_t at[4][4]) {
  while (steps-- > 0) tw_error_split_places(at[0], at);
}

/* Compares the face of a sector with faces of a deeper level, by their corners. */
static void compare_corners(const tw_error_wheel *w, const tw_error_base *base, const ring *to,
                            uint32_t sector, uint8_t at[4][4], double *deeper) {
  static const int cells[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (int i = 0; i < 4; i++) {
    tw_error_gap gap = tw_error_gap_over(base);
    for (int k = 0; k < 4; k++) {
      int a = cells[i][0] + cells[k][0], b = cells[i][1] + cells[k][1];
      tw_error_take_point(base, &gap, at[i][k], to->shown[point_of(w->valence, sector, a, b)]);
    }
    *deeper = tw_greater(*deeper, tw_error_gap_size(base, &gap));
  }
}

/* The same with the limit of the faces that the last step made regular. */
static double compare_regular(const tw_error_wheel *w, const tw_error_base *base, const ring *to,
                              uint32_t sector, uint8_t at[4][4]) {
  double most = 0;
  for (uint32_t i = 0; i < 3; i++) {
    tw_error_net net;
    find_cell(w, to, sector, i, &net);
    most = tw_greater(most, tw_error_of_limits(base, &net, at[i + 1]));
  }
  return most;
}

static void compare_sectors(const tw_error_wheel *w, const ring *from, const ring *to, uint32_t steps,
                            int way, closer *out) {
  out->deeper[way] = 0;
  for (uint32_t s = 0; s < w->valence; s++) {
    tw_error_frame frame;
    uint8_t at[4][4];
    tw_error_base base = base_of(w, from, s, &frame, at[0]);
    const tw_error_hull hull = tw_error_find_hull(base.corners);
    base.hull = way == OVER_HULLS ? &hull : NULL;
    find_quarters(steps, at);
    compare_corners(w, &base, to, s, at, &out->deeper[way]);
    out->regular[way] = tw_greater(out->regular[way], compare_regular(w, &base, to, s, at));
  }
}

/* Over hulls as long as triangles tell more than is known. False: the result is not wanted any more. */
static bool compare_middle(const tw_error_wheel *w, const ring *from, const ring *to, uint32_t steps,
                           double known, closer *out) {
  compare_sectors(w, from, to, steps, ON_TRIANGLES, out);
  if (tw_greater(out->regular[ON_TRIANGLES], out->deeper[ON_TRIANGLES]) > known)
    compare_sectors(w, from, to, steps, OVER_HULLS, out);
  else
    out->regular[OVER_HULLS] = INFINITY;
  return tw_work((uint64_t)COMPARE_WORK * w->valence);
}

/* Lowers the distance of the faces at the middle. below: that of the faces they were compared with. */
static double lower_middle(const closer *c, double below, double error) {
  for (int i = 0; i < WAYS; i++) error = tw_lesser(error, tw_greater(c->regular[i], c->deeper[i] + below));
  return error;
}

static bool is_compared(const tw_measuring *m, const tw_error_part *p, uint32_t step, const double *known,
                        const double *found) {
  return m->options->limit && p->level + step <= m->level_max && found[step] > known[step];
}

uint32_t tw_error_of_ring(const tw_measuring *m, const tw_error_part *p, uint32_t vertex, double enough,
                          const double *known, double *out) {
  const tw_topology *t = &p->topology;
  uint32_t valence = tw_error_wheel_valence(t, vertex), depth = 0,
           deepest = m->level_max + TW_ERROR_FURTHER_LEVELS - p->level;
  ring rings[TW_ERROR_DEPTH + 1];
  if (valence == 0 || !m->wheels[valence] || !gather(p, m->wheels[valence], vertex, &rings[0])) return 0;
  const tw_error_wheel *w = m->wheels[valence];
  double steps[TW_ERROR_RING_LEVELS], regular[TW_ERROR_RING_LEVELS + 1] = {0};
  closer closely[TW_ERROR_RING_LEVELS] = {{{0}, {0}}};
  find_normals(w, &rings[0]);
  double rest = hull_of(&rings[0], is_graph(w, &rings[0]));
  for (; rest > enough && depth < deepest; depth++) {
    ring *own = &rings[depth % (TW_ERROR_DEPTH + 1)], *next = &rings[(depth + 1) % (TW_ERROR_DEPTH + 1)];
    step_ring(w, own, m->options->limit, next);
    find_normals(w, next);
    bool graph = is_graph(w, next);
    steps[depth] = step_error(w, own, next);
    take_regular(w, next, m->options->limit, graph, known ? known + depth + 1 : NULL, regular + depth + 1,
                 TW_ERROR_RING_LEVELS - depth);
    for (uint32_t i = depth < TW_ERROR_DEPTH ? 0 : depth + 1 - TW_ERROR_DEPTH; known && i <= depth; i++)
      if (is_compared(m, p, i, known, out) &&
          !compare_middle(w, &rings[i % (TW_ERROR_DEPTH + 1)], next, depth + 1 - i, known[i], &closely[i]))
        return 0;
    rest = hull_of(next, graph);
  }
  out[depth] = rest;
  for (uint32_t i = 1; i <= depth; i++) regular[i] = tw_greater(regular[i], regular[i - 1] / 4);
  for (uint32_t i = depth; i-- > 0;) {
    bool is_close = known && is_compared(m, p, i, known, out);
    out[i] = steps[i] + tw_greater(regular[i + 1], out[i + 1]);
    if (!is_close) continue;
    uint32_t deeper = i + TW_ERROR_DEPTH < depth ? i + TW_ERROR_DEPTH : depth;
    out[i] = lower_middle(&closely[i], tw_greater(regular[deeper], out[deeper]), out[i]);
  }
  for (uint32_t i = 0; i <= depth; i++) out[i] = tw_greater(out[i], regular[i]);
  return depth + 1;
}

/* ---- over faces of earlier levels ----------------------------------------------------------------- */

double tw_error_of_sector(const tw_measuring *m, const tw_error_base *b, double (*points)[3],
                          uint32_t valence, const uint8_t places[4], double rest) {
  enum { SECTOR = 0 };
  const tw_error_wheel *w = valence <= VALENCE_MAX ? m->wheels[valence] : NULL;
  ring rings[2];
  uint8_t at[4][4];
  double most = 0;
  if (!w) return INFINITY;
  memcpy(rings[0].control, points, w->two_rows * sizeof *points);
  memcpy(at[0], places, sizeof at[0]);
  for (uint32_t step = 0; step < TW_ERROR_DEPTH; step++) {
    ring *to = &rings[(step + 1) % 2];
    step_ring(w, &rings[step % 2], true, to);
    find_quarters(1, at);
    double beside = step + 1 < TW_ERROR_DEPTH ? 0 : rest; /* limit points may slide from the middle there */
    most = tw_greater(most, compare_regular(w, b, to, SECTOR, at) + beside);
  }
  tw_error_gap gap = tw_error_gap_over(b);
  for (uint32_t i = 0; i < 4; i++)
    tw_error_take_point(b, &gap, at[0][i], rings[TW_ERROR_DEPTH % 2].at_limit[w->quads[SECTOR][i]]);
  return tw_greater(most, tw_error_gap_size(b, &gap) + rest);
}
