/* The control points around a regular face, and their second differences. */
#include <string.h>

#include "surface_error.h"

/* Counts the infinitely sharp edges of a vertex; UINT32_MAX where one is semi-sharp. */
static uint32_t count_sharp(const tw_topology *t, uint32_t vertex) {
  uint32_t count = 0;
  if (tw_is_semi_sharp(t->vertex_sharpness[vertex])) return UINT32_MAX;
  for (uint32_t i = t->ring_offsets[vertex]; i < t->ring_offsets[vertex + 1]; i++) {
    float sharpness = t->edge_sharpness[t->ring_edges[i]];
    if (tw_is_semi_sharp(sharpness)) return UINT32_MAX;
    count += sharpness > 0;
  }
  return count;
}

/* The points of the net at a corner: `out` receives those beyond the corner against the next one, against the
 * previous one, and against the opposite one. */
typedef struct corner_net {
  const tw_error_part *p;
  uint32_t corner;
  const double *own, *next, *previous, *opposite;
  double *against_next, *against_previous, *against_opposite;
} corner_net;

static void extrapolate(const double *from, const double *to, double *out) {
  for (int c = 0; c < 3; c++) out[c] = 2 * to[c] - from[c];
}

static bool fill_plain(const corner_net *n) {
  const tw_topology *t = &n->p->topology;
  uint32_t first = t->sibling[tw_quad_previous(n->corner)], second = t->sibling[tw_quad_previous(first)],
           third = t->sibling[tw_quad_previous(second)];
  if (t->sibling[tw_quad_previous(third)] != n->corner || second == n->corner) return false;
  uint32_t next = tw_quad_next(second);
  const double *control = n->p->control;
  memcpy(n->against_next, tw_point_at(control, t->corner_vertex[next]), sizeof(double[3]));
  memcpy(n->against_previous, tw_point_at(control, t->corner_vertex[tw_quad_previous(second)]),
         sizeof(double[3]));
  memcpy(n->against_opposite, tw_point_at(control, t->corner_vertex[tw_quad_next(next)]), sizeof(double[3]));
  return true;
}

/* At a crease of two faces a side, the net goes on beyond it without second differences: the crease rule is
 * that of a cubic spline. is_left: the face's edge to the previous corner is the crease. */
static bool fill_crease(const corner_net *n, bool is_left) {
  const tw_topology *t = &n->p->topology;
  const double *control = n->p->control;
  uint32_t other = is_left ? tw_error_turn_right(t, n->corner) : tw_error_turn_left(t, n->corner);
  if (other == UINT32_MAX ||
      (is_left ? tw_error_turn_right(t, other) : tw_error_turn_left(t, other)) != UINT32_MAX)
    return false;
  uint32_t end = is_left ? tw_quad_next(other) : tw_quad_previous(other);
  const double *far = tw_point_at(control, t->corner_vertex[end]),
               *across = tw_point_at(control, t->corner_vertex[tw_quad_next(tw_quad_next(other))]);
  memcpy(is_left ? n->against_previous : n->against_next, far, sizeof(double[3]));
  extrapolate(is_left ? n->next : n->previous, n->own, is_left ? n->against_next : n->against_previous);
  extrapolate(across, far, n->against_opposite);
  return true;
}

static bool fill_corner(const corner_net *n) {
  extrapolate(n->next, n->own, n->against_next);
  extrapolate(n->previous, n->own, n->against_previous);
  for (int c = 0; c < 3; c++)
    n->against_opposite[c] = 4 * n->own[c] - 2 * n->next[c] - 2 * n->previous[c] + n->opposite[c];
  return true;
}

static bool fill(const corner_net *n) {
  enum { EDGES = 4 };
  const tw_topology *t = &n->p->topology;
  uint32_t vertex = t->corner_vertex[n->corner];
  bool right = tw_is_infinite(t->edge_sharpness[t->corner_edge[n->corner]]),
       left = tw_is_infinite(t->edge_sharpness[t->corner_edge[tw_quad_previous(n->corner)]]);
  if (!left && !right) /* the count first: edges of a vertex with very many are not looked at for each face */
    return t->ring_offsets[vertex + 1] - t->ring_offsets[vertex] == EDGES && tw_error_is_plain(t, vertex) &&
           fill_plain(n);
  uint32_t sharp = count_sharp(t, vertex);
  if (sharp == UINT32_MAX || (t->vertex_flags[vertex] & TW_VERTEX_NONMANIFOLD)) return false;
  bool is_corner = t->vertex_sharpness[vertex] > 0 || sharp > 2;
  if (left && right) return is_corner && fill_corner(n);
  return !is_corner && sharp == 2 && fill_crease(n, left);
}

/* Finds the net of a quad among quads; false where its surface is no single patch. */
bool tw_error_find_net(const tw_error_part *p, uint32_t face, tw_error_net *out) {
  static const int places[4][2] = {{1, 1}, {2, 1}, {2, 2}, {1, 2}}; /* u, v */
  const tw_topology *t = &p->topology;
  const double *own[4];
  if (t->face_size != 4) return false;
  uint32_t begin = tw_face_begin(t, face);
  for (int i = 0; i < 4; i++) {
    own[i] = tw_point_at(p->control, t->corner_vertex[begin + (uint32_t)i]);
    memcpy(out->points[places[i][1]][places[i][0]], own[i], sizeof(double[3]));
  }
  for (int i = 0; i < 4; i++) {
    const int *here = places[i], *next = places[(i + 1) % 4], *previous = places[(i + 3) % 4];
    int nu = next[0] - here[0], nv = next[1] - here[1], pu = previous[0] - here[0],
        pv = previous[1] - here[1];
    const corner_net n = {.p = p,
                          .corner = begin + (uint32_t)i,
                          .own = own[i],
                          .next = own[(i + 1) % 4],
                          .previous = own[(i + 3) % 4],
                          .opposite = own[(i + 2) % 4],
                          .against_next = out->points[here[1] - nv][here[0] - nu],
                          .against_previous = out->points[here[1] - pv][here[0] - pu],
                          .against_opposite = out->points[here[1] - nv - pv][here[0] - nu - pu]};
    if (!fill(&n)) return false;
  }
  return true;
}

/* The differences of a kind: [8] along u or v, [9] mixed. Returns how many. */
int tw_error_find_differences(const tw_error_net *n, int kind, double out[9][3]) {
  int count = 0;
  if (kind == TW_ERROR_MIXED) {
    for (int v = 0; v < 3; v++)
      for (int u = 0; u < 3; u++, count++)
        for (int c = 0; c < 3; c++)
          out[count][c] = n->points[v][u][c] - n->points[v][u + 1][c] - n->points[v + 1][u][c] +
                          n->points[v + 1][u + 1][c];
    return count;
  }
  for (int line = 0; line < 4; line++)
    for (int place = 1; place < 3; place++, count++) {
      const double(*p)[3] = kind == TW_ERROR_ALONG_U ? &n->points[line][place] : &n->points[place][line],
            (*next)[3] = kind == TW_ERROR_ALONG_U ? p + 1 : p + 4,
            (*before)[3] = kind == TW_ERROR_ALONG_U ? p - 1 : p - 4;
      for (int c = 0; c < 3; c++) out[count][c] = (*before)[c] - 2 * (*p)[c] + (*next)[c];
    }
  return count;
}

/* The greatest height along the normal, the greatest slide across it and the greatest length of some vectors.
 * Compares squares, so that three roots are enough. */
tw_offset tw_error_find_greatest(double (*vectors)[3], int count, const double normal[3]) {
  tw_offset squares = {0};
  for (int i = 0; i < count; i++) {
    double along = tw_dot3(vectors[i], normal), across[3];
    for (int c = 0; c < 3; c++) across[c] = vectors[i][c] - along * normal[c];
    tw_offset_widen(&squares,
                    &(tw_offset){along * along, tw_dot3(across, across), tw_dot3(vectors[i], vectors[i])});
  }
  return (tw_offset){sqrt(squares.normal), sqrt(squares.slide), sqrt(squares.whole)};
}

/* The difference between the surface and its triangles, bounded by the lengths of the greatest second
 * differences alone. This bound is the smaller one where their directions vary much. The mixed difference has
 * the weight 1/4 in the middle of a face; of control points, those along u and v then have a quarter of
 * theirs. */
double tw_error_plain_deviation(bool limit, double u, double v, double mixed) {
  if (limit) return (u + v) / 8 + mixed / 4;
  return (u + v) / 6 + (tw_greater(0, mixed - u) + tw_greater(0, mixed - v)) / 8;
}

static void split_line(const double *a, const double *b, const double *c, const double *d, double *out[5]) {
  for (int k = 0; k < 3; k++) {
    out[0][k] = (a[k] + b[k]) / 2;
    out[1][k] = (a[k] + 6 * b[k] + c[k]) / 8;
    out[2][k] = (b[k] + c[k]) / 2;
    out[3][k] = (b[k] + 6 * c[k] + d[k]) / 8;
    out[4][k] = (c[k] + d[k]) / 2;
  }
}

/* The nets of a patch's quarters. */
void tw_error_split_net(const tw_error_net *n, tw_error_net out[4]) {
  double lines[4][5][3], points[5][5][3];
  for (int v = 0; v < 4; v++) {
    double *line[5] = {lines[v][0], lines[v][1], lines[v][2], lines[v][3], lines[v][4]};
    split_line(n->points[v][0], n->points[v][1], n->points[v][2], n->points[v][3], line);
  }
  for (int u = 0; u < 5; u++) {
    double *line[5] = {points[0][u], points[1][u], points[2][u], points[3][u], points[4][u]};
    split_line(lines[0][u], lines[1][u], lines[2][u], lines[3][u], line);
  }
  for (int child = 0; child < 4; child++)
    for (int v = 0; v < 4; v++)
      memcpy(out[child].points[v], points[v + child / 2][child % 2], sizeof out[child].points[v]);
}

double tw_error_of_side(const tw_error_net *n, int side, bool limit) {
  int axis = side % 2, line = side == 0 || side == 3 ? 1 : 2;
  double most = 0, d[3];
  for (int i = 1; i < 3; i++) {
    const double *before = tw_error_net_step(n, axis, line, i - 1), *at = tw_error_net_step(n, axis, line, i),
                 *after = tw_error_net_step(n, axis, line, i + 1);
    for (int c = 0; c < 3; c++) d[c] = before[c] - 2 * at[c] + after[c];
    most = tw_greater(most, tw_length3(d));
  }
  return limit ? most / 8 : most / 6;
}
