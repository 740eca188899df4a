/* Moves the points of a patch so that the sum of its squared Laplacians, those of the hole's border included,
 * is least: Kobbelt, Campagna, Vorsatz, Seidel, "Interactive multi-resolution modeling on arbitrary meshes"
 * (1998). Least squares by conjugate gradients (CGLS), which begin at the patch as it is. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "hole.h"

enum {
  STEPS_LEAST = 200, /* for every patch; one of some hundred points is done then */
  STEPS_MOST = 4000
};

typedef double vector[3];

typedef struct fairing {
  const tw_patch *patch;
  const tw_rings *rings;
  uint32_t (*edges)[2]; /* [edge_count] of the patch, but the loop's */
  uint32_t edge_count, steps_max;
  double *shares;                        /* [point_count] 1 by the number of neighbours */
  vector *rests;                         /* [point_count] Laplacians */
  vector *slopes, *ways, *steps, *moved; /* [point_count] */
} fairing;

static bool allocate(fairing *f) {
  size_t points = f->patch->point_count;
  f->edges = tw_alloc(3 * (size_t)f->patch->triangle_count, sizeof *f->edges);
  f->shares = tw_alloc_zero(points, sizeof *f->shares);
  f->rests = tw_alloc(points, sizeof *f->rests);
  f->slopes = tw_alloc_zero(points, sizeof *f->slopes);
  f->ways = tw_alloc_zero(points, sizeof *f->ways);
  f->steps = tw_alloc(points, sizeof *f->steps);
  f->moved = tw_alloc_zero(points, sizeof *f->moved);
  return f->edges && f->shares && f->rests && f->slopes && f->ways && f->steps && f->moved;
}

static void fairing_deinit(fairing *f) {
  free(f->edges);
  free(f->shares);
  free(f->rests);
  free(f->slopes);
  free(f->ways);
  free(f->steps);
  free(f->moved);
}

static void find_edges(fairing *f) {
  const tw_patch *p = f->patch;
  for (uint32_t t = 0; t < p->triangle_count; t++)
    for (uint32_t k = 0; k < 3; k++) {
      if (p->beyond[t][k] == UINT32_MAX || p->beyond[t][k] < t) continue;
      f->edges[f->edge_count][0] = p->triangles[t][k];
      f->edges[f->edge_count++][1] = p->triangles[t][(k + 1) % 3];
    }
}

/* The Laplacians of the patch, with the mesh's neighbours of the loop. */
static void find_rests(fairing *f) {
  const tw_patch *p = f->patch;
  for (uint32_t i = 0; i < p->point_count; i++) {
    bool is_loop = i < p->loop_count;
    f->shares[i] = is_loop ? f->rings->counts[p->loop[i]] : 0;
    for (int k = 0; k < 3; k++) f->rests[i][k] = is_loop ? f->rings->sums[p->loop[i]][k] : 0;
  }
  for (uint32_t e = 0; e < f->edge_count; e++)
    for (int end = 0; end < 2; end++) {
      uint32_t at = f->edges[e][end], other = f->edges[e][1 - end];
      f->shares[at]++;
      for (int k = 0; k < 3; k++) f->rests[at][k] += p->points[other][k];
    }
  for (uint32_t i = 0; i < p->point_count; i++) {
    f->shares[i] = 1 / f->shares[i];
    for (int k = 0; k < 3; k++) f->rests[i][k] = f->rests[i][k] * f->shares[i] - p->points[i][k];
  }
}

/* The Laplacians of what is 0 on the loop, or the transpose of that. */
static void apply(const fairing *f, bool is_transposed, vector *from, vector *to) {
  for (uint32_t i = 0; i < f->patch->point_count; i++)
    for (int k = 0; k < 3; k++) to[i][k] = -from[i][k];
  for (uint32_t e = 0; e < f->edge_count; e++) {
    uint32_t a = f->edges[e][0], b = f->edges[e][1];
    double share_a = f->shares[is_transposed ? b : a], share_b = f->shares[is_transposed ? a : b];
    for (int k = 0; k < 3; k++) {
      to[a][k] += share_a * from[b][k];
      to[b][k] += share_b * from[a][k];
    }
  }
  if (is_transposed) memset(to, 0, f->patch->loop_count * sizeof *to);
}

static double square(const fairing *f, vector *of) {
  double sum = 0;
  for (uint32_t i = 0; i < f->patch->point_count; i++) sum += tw_dot3(of[i], of[i]);
  return sum;
}

static void add(const fairing *f, vector *to, double factor, vector *what) {
  for (uint32_t i = 0; i < f->patch->point_count; i++)
    for (int k = 0; k < 3; k++) to[i][k] += factor * what[i][k];
}

static tw_status solve(fairing *f, const tw_editor *editor) {
  tw_status status = TW_OK;
  apply(f, true, f->rests, f->slopes);
  add(f, f->ways, -1, f->slopes);
  double slope = square(f, f->slopes), least = 1e-16 * slope;
  for (uint32_t i = 0; i < f->steps_max && slope > least && status == TW_OK; i++) {
    apply(f, false, f->ways, f->steps);
    double by = slope / square(f, f->steps), before = slope;
    if (!isfinite(by)) break;
    add(f, f->moved, by, f->ways);
    add(f, f->rests, by, f->steps);
    apply(f, true, f->rests, f->slopes);
    slope = square(f, f->slopes);
    for (uint32_t p = 0; p < f->patch->point_count; p++)
      for (int k = 0; k < 3; k++) f->ways[p][k] = slope / before * f->ways[p][k] - f->slopes[p][k];
    status = tw_editor_go_on(editor);
  }
  return status;
}

tw_status tw_patch_fair(tw_patch *patch, const tw_editor *editor, const tw_rings *rings,
                        tw_hole_budget *budget) {
  if (patch->point_count == patch->loop_count) return TW_OK;
  uint64_t more = budget->steps / patch->point_count;
  if (more > STEPS_MOST - STEPS_LEAST) more = STEPS_MOST - STEPS_LEAST;
  budget->steps -= more * patch->point_count;
  fairing f = {.patch = patch, .rings = rings, .steps_max = STEPS_LEAST + (uint32_t)more};
  tw_status status = allocate(&f) ? TW_OK : tw_editor_no_memory(editor);
  if (status == TW_OK) {
    find_edges(&f);
    find_rests(&f);
    status = solve(&f, editor);
    add(&f, patch->points, 1, f.moved);
  }
  fairing_deinit(&f);
  return status;
}
