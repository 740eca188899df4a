/* Makes shapes in closed form. Points are computed in double, symmetric ones from the same numbers so that
 * they mirror each other exactly, and then sorted. */
#include "angle.h"
#include "tweend/shape.h"

#include <assert.h>
#include <math.h>

#include "vector3.h"

const char *const tw_shape_names[TW_SHAPES + 1] = {
    "grid", "box", "quad_sphere", "uv_sphere", "icosphere", "ellipsoid", "cylinder", "cone", "torus", NULL};

void tw_shape_init(tw_shape *shape, tw_shape_kind kind) {
  bool is_flat_sided = kind == TW_SHAPE_GRID || kind == TW_SHAPE_BOX;
  uint32_t segments = is_flat_sided ? 1 : 16;
  *shape = (tw_shape){.kind = kind,
                      .size = {1, 1, 1},
                      .radii = {1, 1, 1},
                      .height = 1,
                      .tube = 0.4f,
                      .segments = {segments, segments, segments},
                      .rings = kind == TW_SHAPE_UV_SPHERE ? 8 : 1,
                      .sides = 8,
                      .level = 1,
                      .caps = TW_CAPS_NGON};
}

/* ---- counts ---------------------------------------------------------------------------------- */

static const uint64_t MOST = UINT64_C(1) << 62;

static uint64_t plus(uint64_t a, uint64_t b) {
  return a > MOST - b ? MOST : a + b;
}

static uint64_t times(uint64_t a, uint64_t b) {
  return b > 0 && a > MOST / b ? MOST : a * b;
}

static tw_status check_length(float value, const char *name, int index, tw_error *error) {
  if (value > 0 && value <= TW_COORDINATE_MAX) return TW_OK;
  tw_fail(error, TW_INVALID, "a length must be above 0 and at most 1e18");
  return index < 0 ? tw_error_at(error, "/%s", name) : tw_error_at(error, "/%s/%d", name, index);
}

static tw_status check_parts(uint32_t value, uint32_t least, const char *name, int index, tw_error *error) {
  if (value >= least) return TW_OK;
  tw_fail(error, TW_INVALID, "at least %u are needed, not %u", least, value);
  return index < 0 ? tw_error_at(error, "/%s", name) : tw_error_at(error, "/%s/%d", name, index);
}

/* Checks sizes and segments, naming each by the index that it has in tweend JSON: a grid has no y. */
static tw_status check_sides(const tw_shape *shape, tw_error *error) {
  tw_status status = TW_OK;
  for (int axis = 0, index = 0; axis < 3 && status == TW_OK; axis++) {
    if (shape->kind == TW_SHAPE_GRID && axis == 1) continue;
    status = check_length(shape->size[axis], "size", index, error);
    if (status == TW_OK) status = check_parts(shape->segments[axis], 1, "segments", index, error);
    index++;
  }
  return status;
}

static tw_status check_torus(const tw_shape *shape, tw_error *error) {
  tw_status status = check_length(shape->tube, "tube", -1, error);
  if (status == TW_OK) status = check_parts(shape->sides, 3, "sides", -1, error);
  if (status != TW_OK || shape->tube < shape->radii[0]) return status;
  tw_fail(error, TW_INVALID, "the tube's radius must be less than the radius of the torus");
  return tw_error_at(error, "/tube");
}

static tw_status check_shape(const tw_shape *shape, tw_error *error) {
  tw_shape_kind kind = shape->kind;
  if (kind == TW_SHAPE_GRID || kind == TW_SHAPE_BOX) return check_sides(shape, error);
  tw_status status = TW_OK;
  bool is_ellipsoid = kind == TW_SHAPE_ELLIPSOID, is_boxy = is_ellipsoid || kind == TW_SHAPE_QUAD_SPHERE;
  for (int axis = 0; axis < (is_ellipsoid ? 3 : 1) && status == TW_OK; axis++)
    status =
        check_length(shape->radii[axis], is_ellipsoid ? "radii" : "radius", is_ellipsoid ? axis : -1, error);
  if (status == TW_OK && kind != TW_SHAPE_ICOSPHERE)
    status = check_parts(shape->segments[0], is_boxy ? 1 : 3, "segments", -1, error);
  bool has_height = kind == TW_SHAPE_CYLINDER || kind == TW_SHAPE_CONE;
  if (status == TW_OK && has_height) status = check_length(shape->height, "height", -1, error);
  if (status == TW_OK && (has_height || kind == TW_SHAPE_UV_SPHERE))
    status = check_parts(shape->rings, has_height ? 1 : 2, "rings", -1, error);
  return status == TW_OK && kind == TW_SHAPE_TORUS ? check_torus(shape, error) : status;
}

static tw_shape_counts count_box(uint64_t a, uint64_t b, uint64_t c) {
  uint64_t half = plus(plus(times(a, b), times(b, c)), times(c, a));
  uint64_t faces = times(2, half),
           lines = times(2, plus(plus(times(2, a), times(2, b)), plus(times(2, c), 3)));
  return (tw_shape_counts){
      .points = plus(faces, 2), .faces = faces, .corners = times(4, faces), .uvs = plus(faces, lines)};
}

/* Counts bands of s faces between rings, or between a ring and a pole. */
static tw_shape_counts count_bands(uint64_t s, uint64_t rings, uint64_t poles, uint64_t bands) {
  return (tw_shape_counts){.points = plus(times(s, rings), poles),
                           .faces = times(s, bands),
                           .corners = plus(times(times(4, s), bands - poles), times(times(3, s), poles)),
                           .uvs = plus(times(s + 1, rings), times(s, poles))};
}

/* Adds the caps of `count` openings of s edges each, at the ends of the bands. */
static void count_caps(tw_shape_counts *out, tw_caps caps, uint64_t s, uint64_t count) {
  if (caps == TW_CAPS_NONE) return;
  bool is_fan = caps == TW_CAPS_FAN;
  out->points = plus(out->points, is_fan ? count : 0);
  out->faces = plus(out->faces, times(is_fan ? s : 1, count));
  out->corners = plus(out->corners, times(times(is_fan ? 3 : 1, s), count));
  out->uvs = plus(out->uvs, times(plus(s, is_fan), count));
}

static tw_shape_counts count_icosphere(uint32_t level) {
  uint64_t side = level < 30 ? UINT64_C(1) << level : MOST, parts = times(side, side),
           faces = times(20, parts);
  return (tw_shape_counts){.points = plus(times(10, parts), 2),
                           .faces = faces,
                           .corners = times(3, faces),
                           /* The seam crosses at most 10 * side triangles, whose points get a second UV; a
                            * pole has a UV for each of its triangles. */
                           .uvs = plus(times(10, parts), plus(times(20, side), 14))};
}

static tw_shape_counts count_elements(const tw_shape *shape) {
  uint64_t s = shape->segments[0], r = shape->rings, t = shape->sides;
  tw_shape_counts out = {0};
  switch (shape->kind) {
  case TW_SHAPE_GRID: {
    uint64_t b = shape->segments[2], points = times(s + 1, b + 1), faces = times(s, b);
    return (tw_shape_counts){.points = points, .faces = faces, .corners = times(4, faces), .uvs = points};
  }
  case TW_SHAPE_BOX: return count_box(s, shape->segments[1], shape->segments[2]);
  case TW_SHAPE_QUAD_SPHERE:
  case TW_SHAPE_ELLIPSOID: return count_box(s, s, s);
  case TW_SHAPE_ICOSPHERE: return count_icosphere(shape->level);
  case TW_SHAPE_UV_SPHERE: return count_bands(s, r - 1, 2, r);
  case TW_SHAPE_TORUS: {
    uint64_t faces = times(s, t);
    return (tw_shape_counts){
        .points = faces, .faces = faces, .corners = times(4, faces), .uvs = times(s + 1, t + 1)};
  }
  case TW_SHAPE_CYLINDER:
    out = count_bands(s, r + 1, 0, r);
    count_caps(&out, shape->caps, s, 2);
    return out;
  case TW_SHAPE_CONE:
    out = count_bands(s, r, 1, r);
    count_caps(&out, shape->caps, s, 1);
    return out;
  }
  return out;
}

/* A point's sort keys, and its index before sorting. */
typedef struct sorted_point {
  int32_t y, z, x;
  uint32_t number;
} sorted_point;

tw_status tw_shape_count(const tw_shape *shape, tw_shape_counts *out, tw_error *error) {
  tw_status status = check_shape(shape, error);
  if (status != TW_OK) return status;
  *out = count_elements(shape);
  return TW_OK;
}

/* ---- making ---------------------------------------------------------------------------------- */

/* The mesh being built. Points are numbered in the order they are made, until sort_points renumbers them. */
typedef struct builder {
  const tw_shape *shape;
  double (*points)[3];
  uint32_t point_count, face_count, corner_count, uv_count;
  uint32_t *offsets, *corners, *uv_corners;
  float (*uvs)[2];
} builder;

static uint32_t add_point(builder *b, double x, double y, double z) {
  double *point = b->points[b->point_count];
  point[0] = x;
  point[1] = y;
  point[2] = z;
  return b->point_count++;
}

static uint32_t add_uv(builder *b, double u, double v) {
  b->uvs[b->uv_count][0] = (float)u;
  b->uvs[b->uv_count][1] = (float)v;
  return b->uv_count++;
}

static void add_corner(builder *b, uint32_t point, uint32_t uv) {
  b->corners[b->corner_count] = point;
  b->uv_corners[b->corner_count++] = uv;
}

static void end_face(builder *b) {
  b->offsets[++b->face_count] = b->corner_count;
}

/* Cosine and sine of k / n of a turn, k <= n. The angle is reduced to an eighth of a turn and mirrored back,
 * so that symmetric angles give exactly symmetric values, and exact ones on the axes. */
static void turn(uint32_t k, uint32_t n, double *cosine, double *sine) {
  uint64_t quarters = 4 * (uint64_t)k / n, rest = 4 * (uint64_t)k % n;
  bool is_upper = 2 * rest > n, is_middle = 2 * rest == n;
  double angle = TW_PI / 2 * (double)(is_upper ? n - rest : rest) / n;
  double c = is_middle ? sqrt(0.5) : cos(angle), s = is_middle ? c : sin(angle);
  double x = is_upper ? s : c, y = is_upper ? c : s;
  switch (quarters % 4) {
  case 0: *cosine = x, *sine = y; break;
  case 1: *cosine = -y, *sine = x; break;
  case 2: *cosine = -x, *sine = -y; break;
  default: *cosine = y, *sine = -x; break;
  }
}

/* Maps i = 0 to n onto -length / 2 to length / 2. */
static double along(float length, uint32_t i, uint32_t n) {
  return (double)length * (2.0 * i - n) / (2.0 * n);
}

/* ---- grids and boxes ------------------------------------------------------------------------- */

static void make_grid(builder *b) {
  const tw_shape *shape = b->shape;
  uint32_t columns = shape->segments[0], rows = shape->segments[2];
  for (uint32_t k = 0; k <= rows; k++)
    for (uint32_t i = 0; i <= columns; i++) {
      add_point(b, along(shape->size[0], i, columns), 0, along(shape->size[2], k, rows));
      add_uv(b, (double)i / columns, 1 - (double)k / rows);
    }
  for (uint32_t k = 0; k < rows; k++)
    for (uint32_t i = 0; i < columns; i++) {
      uint32_t first = k * (columns + 1) + i, below = first + columns + 1;
      const uint32_t quad[4] = {first, below, below + 1, first + 1};
      for (int c = 0; c < 4; c++) add_corner(b, quad[c], quad[c]);
      end_face(b);
    }
}

/* The index of a box's point at n[] = {i, j, k}: layers of y from the bottom up, in a layer rows of z, in a
 * row x. Only the first and last layer have all points; of the others only the first and last row do. */
static uint32_t box_point(const uint32_t segments[3], const uint32_t n[3]) {
  uint32_t a = segments[0], c = segments[2];
  bool is_full = n[1] == 0 || n[1] == segments[1];
  uint32_t layer = n[1] == 0 ? 0 : (a + 1) * (c + 1) + (n[1] - 1) * 2 * (a + c);
  if (is_full) return layer + n[2] * (a + 1) + n[0];
  if (n[2] == 0) return layer + n[0];
  uint32_t row = layer + a + 1 + 2 * (n[2] - 1);
  return n[2] == c ? row + n[0] : row + (n[0] == a);
}

/* Adds a point of a box, or of the sphere or ellipsoid made from one, where grid lines are at equal
 * angles. */
static void add_box_point(builder *b, const uint32_t segments[3], const uint32_t n[3]) {
  const tw_shape *shape = b->shape;
  double p[3], square = 0;
  bool is_round = shape->kind != TW_SHAPE_BOX;
  for (int axis = 0; axis < 3; axis++) {
    uint32_t count = segments[axis];
    double t = (2.0 * n[axis] - count) / count; /* from -1 to 1 */
    p[axis] = !is_round     ? along(shape->size[axis], n[axis], count)
              : fabs(t) < 1 ? copysign(tan(TW_PI / 4 * fabs(t)), t)
                            : t;
    square += p[axis] * p[axis];
  }
  for (int axis = 0; is_round && axis < 3; axis++)
    p[axis] *= (double)shape->radii[shape->kind == TW_SHAPE_ELLIPSOID ? axis : 0] / sqrt(square);
  add_point(b, p[0], p[1], p[2]);
}

/* A side of a box, seen from outside: the axis across it and whether it lies at the far end; the axes of u
 * and v and whether they run backwards. */
typedef struct box_side {
  int normal, u, v;
  bool is_far, is_u_back, is_v_back;
} box_side;

static void add_box_side(builder *b, const uint32_t segments[3], const box_side *side) {
  uint32_t columns = segments[side->u], rows = segments[side->v], n[3];
  uint32_t first_uv = b->uv_count;
  for (uint32_t j = 0; j <= rows; j++)
    for (uint32_t i = 0; i <= columns; i++) add_uv(b, (double)i / columns, (double)j / rows);
  n[side->normal] = side->is_far ? segments[side->normal] : 0;
  for (uint32_t j = 0; j < rows; j++)
    for (uint32_t i = 0; i < columns; i++) {
      static const uint32_t steps[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
      for (int c = 0; c < 4; c++) {
        uint32_t u = i + steps[c][0], v = j + steps[c][1];
        n[side->u] = side->is_u_back ? columns - u : u;
        n[side->v] = side->is_v_back ? rows - v : v;
        add_corner(b, box_point(segments, n), first_uv + v * (columns + 1) + u);
      }
      end_face(b);
    }
}

static void make_box(builder *b) {
  static const box_side sides[6] = {{0, 2, 1, true, true, false},  {0, 2, 1, false, false, false},
                                    {1, 0, 2, true, false, true},  {1, 0, 2, false, false, false},
                                    {2, 0, 1, true, false, false}, {2, 0, 1, false, true, false}};
  const uint32_t *given = b->shape->segments;
  bool is_box = b->shape->kind == TW_SHAPE_BOX;
  const uint32_t segments[3] = {given[0], given[is_box ? 1 : 0], given[is_box ? 2 : 0]};
  uint32_t n[3];
  for (n[1] = 0; n[1] <= segments[1]; n[1]++)
    for (n[2] = 0; n[2] <= segments[2]; n[2]++) {
      bool is_full = n[1] == 0 || n[1] == segments[1] || n[2] == 0 || n[2] == segments[2];
      for (n[0] = 0; n[0] <= segments[0]; n[0] += is_full ? 1 : segments[0]) add_box_point(b, segments, n);
    }
  for (int i = 0; i < 6; i++) add_box_side(b, segments, &sides[i]);
}

/* ---- bands about the y axis ------------------------------------------------------------------ */

/* The points once round the axis, counter-clockwise seen from above; or a pole. */
typedef struct ring {
  uint32_t points; /* the first of s */
  uint32_t uvs;    /* the first of s + 1, or of s at a pole */
  bool is_pole;    /* one point in place of s */
} ring;

static void add_ring_corner(builder *b, const ring *r, uint32_t k, uint32_t s, bool is_next) {
  uint32_t at = k + is_next;
  add_corner(b, r->is_pole ? r->points : r->points + at % s, r->uvs + (r->is_pole ? k : at));
}

/* Adds quads between two rings, or triangles between a ring and a pole. */
static void add_band(builder *b, const ring *upper, const ring *lower, uint32_t s) {
  for (uint32_t k = 0; k < s; k++) {
    add_ring_corner(b, upper, k, s, false);
    add_ring_corner(b, lower, k, s, false);
    if (!lower->is_pole) add_ring_corner(b, lower, k, s, true);
    if (!upper->is_pole) add_ring_corner(b, upper, k, s, true);
    end_face(b);
  }
}

static void add_ring_uvs(builder *b, double v, uint32_t s) {
  for (uint32_t k = 0; k <= s; k++) add_uv(b, (double)k / s, v);
}

/* Adds the ring or pole below the first i bands of a sphere, cylinder or cone. */
static ring add_ring(builder *b, uint32_t i) {
  const tw_shape *shape = b->shape;
  bool is_sphere = shape->kind == TW_SHAPE_UV_SPHERE;
  uint32_t s = shape->segments[0], r = shape->rings;
  double y = -along(shape->height, i, r), radius = (double)shape->radii[0], v = 1 - (double)i / r;
  double cosine, sine;
  if (is_sphere) {
    turn(i, 2 * r, &cosine, &sine);
    y = radius * cosine;
    radius *= sine;
  } else if (shape->kind == TW_SHAPE_CONE) {
    radius *= (double)i / r;
  }
  ring out = {.points = b->point_count, .uvs = b->uv_count};
  out.is_pole = (i == 0 && shape->kind != TW_SHAPE_CYLINDER) || (i == r && is_sphere);
  if (out.is_pole) {
    add_point(b, 0, y, 0);
    for (uint32_t k = 0; k < s; k++) add_uv(b, (k + 0.5) / s, v);
    return out;
  }
  for (uint32_t k = 0; k < s; k++) {
    turn(k, s, &cosine, &sine);
    if (is_sphere)
      add_point(b, -radius * cosine, y, radius * sine);
    else
      add_point(b, radius * sine, y, radius * cosine);
  }
  add_ring_uvs(b, v, s);
  return out;
}

static void add_cap(builder *b, const ring *edge, bool is_top) {
  uint32_t s = b->shape->segments[0], first_uv = b->uv_count;
  if (b->shape->caps == TW_CAPS_NONE) return;
  for (uint32_t k = 0; k < s; k++) {
    double cosine, sine;
    turn(k, s, &cosine, &sine);
    add_uv(b, 0.5 + cosine / 2, 0.5 + (is_top ? sine : -sine) / 2);
  }
  if (b->shape->caps == TW_CAPS_NGON) {
    for (uint32_t k = 0; k < s; k++) {
      uint32_t at = is_top ? k : s - 1 - k;
      add_corner(b, edge->points + at, first_uv + at);
    }
    end_face(b);
    return;
  }
  uint32_t centre = add_point(b, 0, b->points[edge->points][1], 0), centre_uv = add_uv(b, 0.5, 0.5);
  for (uint32_t k = 0; k < s; k++) {
    uint32_t next = (k + 1) % s, ends[2] = {is_top ? k : next, is_top ? next : k};
    add_corner(b, centre, centre_uv);
    for (int i = 0; i < 2; i++) add_corner(b, edge->points + ends[i], first_uv + ends[i]);
    end_face(b);
  }
}

static void make_bands(builder *b) {
  const tw_shape *shape = b->shape;
  ring top = add_ring(b, 0), upper = top;
  for (uint32_t i = 1; i <= shape->rings; i++) {
    ring lower = add_ring(b, i);
    add_band(b, &upper, &lower, shape->segments[0]);
    upper = lower;
  }
  if (!top.is_pole) add_cap(b, &top, true);
  if (!upper.is_pole) add_cap(b, &upper, false);
}

static void make_torus(builder *b) {
  const tw_shape *shape = b->shape;
  uint32_t s = shape->segments[0], t = shape->sides;
  double c, d, cosine, sine;
  for (uint32_t j = 0; j < t; j++) {
    turn(j, t, &c, &d);
    double radius = (double)shape->radii[0] + (double)shape->tube * c;
    for (uint32_t k = 0; k < s; k++) {
      turn(k, s, &cosine, &sine);
      add_point(b, radius * cosine, (double)shape->tube * d, -radius * sine);
    }
  }
  for (uint32_t j = 0; j <= t; j++) add_ring_uvs(b, (double)j / t, s);
  for (uint32_t j = 0; j < t; j++) {
    ring lower = {.points = j * s, .uvs = j * (s + 1)},
         upper = {.points = (j + 1) % t * s, .uvs = (j + 1) * (s + 1)};
    add_band(b, &upper, &lower, s);
  }
}

/* ---- icosphere ------------------------------------------------------------------------------- */

enum { ICO_POINTS = 12, ICO_EDGES = 30, ICO_FACES = 20 };

typedef struct icosahedron {
  double points[ICO_POINTS][3];
  uint32_t edge_count, face_count;
  uint32_t edges[ICO_POINTS][ICO_POINTS]; /* index of the edge between two points */
  uint32_t faces[ICO_FACES][3];
} icosahedron;

/* Edges have length 2; other distances exceed 3. */
static bool is_ico_edge(const icosahedron *ico, uint32_t a, uint32_t b) {
  double square = 0;
  for (int axis = 0; axis < 3; axis++) {
    double d = ico->points[a][axis] - ico->points[b][axis];
    square += d * d;
  }
  return a != b && square < 5;
}

/* Places the points at the corners of three golden rectangles; near points form edges, and three near points
 * a face. */
static void make_icosahedron(icosahedron *ico) {
  const double golden = (1 + sqrt(5.0)) / 2;
  *ico = (icosahedron){0};
  for (uint32_t i = 0; i < ICO_POINTS; i++) {
    uint32_t axis = i / 4;
    ico->points[i][axis] = i & 1 ? 1 : -1;
    ico->points[i][(axis + 1) % 3] = i & 2 ? golden : -golden;
  }
  for (uint32_t a = 0; a < ICO_POINTS; a++)
    for (uint32_t b = a + 1; b < ICO_POINTS; b++) {
      if (!is_ico_edge(ico, a, b)) continue;
      ico->edges[a][b] = ico->edges[b][a] = ico->edge_count++;
      for (uint32_t c = b + 1; c < ICO_POINTS; c++) {
        if (!is_ico_edge(ico, a, c) || !is_ico_edge(ico, b, c)) continue;
        bool is_outward = tw_determinant3(ico->points[a], ico->points[b], ico->points[c]) > 0;
        uint32_t *face = ico->faces[ico->face_count++];
        face[0] = a;
        face[1] = is_outward ? b : c;
        face[2] = is_outward ? c : b;
      }
    }
  assert(ico->edge_count == ICO_EDGES && ico->face_count == ICO_FACES);
}

static void add_ico_point(builder *b, const icosahedron *ico, const uint32_t face[3],
                          const uint32_t weights[3]) {
  double p[3], square = 0;
  for (int axis = 0; axis < 3; axis++) {
    p[axis] = 0;
    for (int k = 0; k < 3; k++) p[axis] += weights[k] * ico->points[face[k]][axis];
    square += p[axis] * p[axis];
  }
  double scale = (double)b->shape->radii[0] / sqrt(square);
  add_point(b, p[0] * scale, p[1] * scale, p[2] * scale);
}

/* The index of a face's point with these weights, which sum to n: first the corners, then the points on
 * edges, from each edge's lower corner on, then the points inside faces. */
static uint32_t ico_point(const icosahedron *ico, uint32_t face, const uint32_t weights[3], uint32_t n) {
  const uint32_t *corners = ico->faces[face];
  for (int k = 0; k < 3; k++) {
    uint32_t a = corners[k], b = corners[(k + 1) % 3], to_a = weights[k], to_b = weights[(k + 1) % 3];
    if (to_a == n) return a;
    if (to_a + to_b == n && to_a > 0 && to_b > 0)
      return ICO_POINTS + ico->edges[a][b] * (n - 1) + (a < b ? to_b : to_a) - 1;
  }
  uint32_t row = weights[1] - 1; /* earlier rows hold n - 2, n - 3, ... points */
  uint32_t before = row * (n - 2) - row * (row - 1) / 2;
  return ICO_POINTS + ICO_EDGES * (n - 1) + face * ((n - 1) * (n - 2) / 2) + before + weights[2] - 1;
}

static void add_ico_points(builder *b, const icosahedron *ico, uint32_t n) {
  for (uint32_t i = 0; i < ICO_POINTS; i++)
    add_ico_point(b, ico, (const uint32_t[3]){i, i, i}, (const uint32_t[3]){1, 0, 0});
  for (uint32_t i = 0; i < ICO_POINTS; i++)
    for (uint32_t j = i + 1; j < ICO_POINTS; j++)
      for (uint32_t k = 1; k < n && is_ico_edge(ico, i, j); k++)
        add_ico_point(b, ico, (const uint32_t[3]){i, j, j}, (const uint32_t[3]){n - k, k, 0});
  for (uint32_t f = 0; f < ICO_FACES; f++)
    for (uint32_t i = 1; i < n; i++)
      for (uint32_t j = 1; i + j < n; j++)
        add_ico_point(b, ico, ico->faces[f], (const uint32_t[3]){n - i - j, i, j});
}

static bool is_pole(const double *p) {
  return p[0] == 0 && p[2] == 0;
}

/* The angle from -x towards +z, as a fraction of a turn. */
static double turned(const double *p) {
  double u = atan2(p[2], -p[0]) / (2 * TW_PI);
  return u < 0 ? u + 1 : u;
}

/* Adds a triangle. Across the seam u continues beyond 1; at a pole u is the mean of the other two corners'.
 * wrapped: [point_count] the UV beyond the seam, or UINT32_MAX. */
static void add_ico_triangle(builder *b, const uint32_t points[3], uint32_t *wrapped) {
  double u[3], most = 0;
  int pole = -1;
  for (int k = 0; k < 3; k++) {
    if (is_pole(b->points[points[k]])) pole = k;
    u[k] = turned(b->points[points[k]]);
    if (pole != k && u[k] > most) most = u[k];
  }
  for (int k = 0; k < 3; k++) {
    uint32_t point = points[k], uv = point;
    if (k != pole && most - u[k] > 0.5) {
      u[k] += 1;
      if (wrapped[point] == UINT32_MAX) wrapped[point] = add_uv(b, u[k], (double)b->uvs[point][1]);
      uv = wrapped[point];
    }
    add_corner(b, point, uv);
  }
  if (pole >= 0)
    b->uv_corners[b->corner_count - 3 + (uint32_t)pole] =
        add_uv(b, (u[(pole + 1) % 3] + u[(pole + 2) % 3]) / 2, b->points[points[pole]][1] > 0 ? 1 : 0);
  end_face(b);
}

static tw_status make_icosphere(builder *b) {
  uint32_t n = UINT32_C(1) << b->shape->level;
  icosahedron ico;
  make_icosahedron(&ico);
  add_ico_points(b, &ico, n);
  uint32_t *wrapped = tw_alloc(b->point_count, sizeof *wrapped);
  if (!wrapped) return TW_NO_MEMORY;
  for (uint32_t i = 0; i < b->point_count; i++) {
    const double *p = b->points[i];
    wrapped[i] = UINT32_MAX;
    add_uv(b, turned(p), 0.5 + atan2(p[1], sqrt(p[0] * p[0] + p[2] * p[2])) / TW_PI);
  }
  for (uint32_t f = 0; f < ICO_FACES; f++)
    for (uint32_t i = 0; i < n; i++)
      for (uint32_t j = 0; i + j < n; j++) {
        /* The triangle that points to the first corner (0, 1, 2), and its neighbour that points away (1, 3,
         * 2). */
        const uint32_t at[4][3] = {{n - i - j, i, j},
                                   {n - i - j - 1, i + 1, j},
                                   {n - i - j - 1, i, j + 1},
                                   {n - i - j - 2, i + 1, j + 1}};
        uint32_t points[4];
        for (int k = 0; k < 4; k++) points[k] = k < 3 || i + j + 1 < n ? ico_point(&ico, f, at[k], n) : 0;
        add_ico_triangle(b, points, wrapped);
        if (i + j + 1 < n) add_ico_triangle(b, (const uint32_t[3]){points[1], points[3], points[2]}, wrapped);
      }
  tw_free(wrapped);
  return TW_OK;
}

/* ---- order ----------------------------------------------------------------------------------- */

static int compare_points(const void *a, const void *b) {
  const sorted_point *p = a, *q = b;
  if (p->y != q->y) return p->y < q->y ? -1 : 1;
  if (p->z != q->z) return p->z < q->z ? -1 : 1;
  if (p->x != q->x) return p->x < q->x ? -1 : 1;
  return p->number < q->number ? -1 : p->number > q->number;
}

/* Sorts the points into `positions` and renumbers the corners. The order compares coordinates rounded to
 * 2^-30 of the extent along each axis, so that the last bits of a machine's sine do not affect it. */
static tw_status sort_points(builder *b, float *positions) {
  double extent[3] = {0}, scale[3];
  sorted_point *sorted = tw_alloc(b->point_count, sizeof *sorted);
  uint32_t *rank = tw_alloc(b->point_count, sizeof *rank);
  tw_status status = TW_NO_MEMORY;
  if (sorted && rank) {
    for (uint32_t i = 0; i < b->point_count; i++)
      for (int axis = 0; axis < 3; axis++) extent[axis] = fmax(extent[axis], fabs(b->points[i][axis]));
    for (int axis = 0; axis < 3; axis++)
      scale[axis] = extent[axis] > 0 ? (double)(1 << 30) / extent[axis] : 0;
    for (uint32_t i = 0; i < b->point_count; i++) {
      const double *p = b->points[i];
      sorted[i] = (sorted_point){(int32_t)lrint(p[1] * scale[1]), (int32_t)lrint(p[2] * scale[2]),
                                 (int32_t)lrint(p[0] * scale[0]), i};
    }
    status = tw_sort(sorted, b->point_count, sizeof *sorted, compare_points);
  }
  if (status == TW_OK) {
    for (uint32_t i = 0; i < b->point_count; i++) {
      rank[sorted[i].number] = i;
      for (int axis = 0; axis < 3; axis++)
        positions[3 * (size_t)i + (size_t)axis] = (float)b->points[sorted[i].number][axis] + 0.0f; /* no -0 */
    }
    for (uint32_t c = 0; c < b->corner_count; c++) b->corners[c] = rank[b->corners[c]];
  }
  tw_free(sorted);
  tw_free(rank);
  return status;
}

/* ---- all ------------------------------------------------------------------------------------- */

static tw_status make_elements(builder *b) {
  switch (b->shape->kind) {
  case TW_SHAPE_GRID: make_grid(b); break;
  case TW_SHAPE_BOX:
  case TW_SHAPE_QUAD_SPHERE:
  case TW_SHAPE_ELLIPSOID: make_box(b); break;
  case TW_SHAPE_ICOSPHERE: return make_icosphere(b);
  case TW_SHAPE_UV_SPHERE:
  case TW_SHAPE_CYLINDER:
  case TW_SHAPE_CONE: make_bands(b); break;
  case TW_SHAPE_TORUS: make_torus(b); break;
  }
  return TW_OK;
}

static tw_status allocate(builder *b, const tw_shape_counts *counts, tw_arena *arena) {
  b->points = tw_alloc((size_t)counts->points, sizeof *b->points);
  b->offsets = tw_arena_alloc_raw(arena, (size_t)counts->faces + 1, sizeof *b->offsets);
  b->corners = tw_arena_alloc_raw(arena, (size_t)counts->corners, sizeof *b->corners);
  b->uv_corners = tw_arena_alloc_raw(arena, (size_t)counts->corners, sizeof *b->uv_corners);
  b->uvs = tw_arena_alloc_raw(arena, (size_t)counts->uvs, sizeof *b->uvs);
  if (!b->points || !b->offsets || !b->corners || !b->uv_corners || !b->uvs) return TW_NO_MEMORY;
  b->offsets[0] = 0;
  return TW_OK;
}

tw_status tw_shape_make(const tw_shape *shape, tw_arena *arena, tw_mesh *out, tw_error *error) {
  tw_shape_counts counts;
  tw_status status = tw_shape_count(shape, &counts, error);
  if (status != TW_OK) return status;
  if (counts.corners > INT32_MAX) return tw_fail(error, TW_LIMIT, "the shape is too large");
  builder b = {.shape = shape};
  float *positions = tw_arena_alloc_raw(arena, (size_t)counts.points, 3 * sizeof *positions);
  status = positions ? allocate(&b, &counts, arena) : TW_NO_MEMORY;
  if (status == TW_OK) status = make_elements(&b);
  if (status == TW_OK) status = sort_points(&b, positions);
  tw_free(b.points);
  if (status != TW_OK) return tw_fail(error, status, "out of memory");
  assert(b.point_count == counts.points && b.face_count == counts.faces && b.corner_count == counts.corners);
  assert(b.uv_count <= counts.uvs);
  tw_mesh_init(out);
  out->point_count = b.point_count;
  out->positions = positions;
  out->face_count = b.face_count;
  out->corner_count = b.corner_count;
  out->face_offsets = b.offsets;
  out->corners = b.corners;
  out->uv_set_count = 1;
  out->uv_sets[0] = (tw_uv_set){b.uv_count, (const float *)b.uvs, b.uv_corners};
  return TW_OK;
}
