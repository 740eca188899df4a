/* Moves the own points of a patch to minimise the sum of squared Laplacians, those at the hole's border
 * included: Kobbelt, Campagna, Vorsatz, Seidel, "Interactive multi-resolution modeling on arbitrary meshes"
 * (1998). Solves the least squares problem by conjugate gradients (CGLS), starting from the current
 * positions. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "hole.h"

enum {
  STEPS_LEAST = 200, /* allowed for every patch; enough for a patch of some hundred points */
  STEPS_MOST = 4000
};

typedef double vector[3];

typedef struct fairing {
  const tw_hole_patch *patch;
  const tw_rings *rings;
  uint32_t (*edges)[2]; /* [edge_count] of the patch, except the loop's */
  uint32_t edge_count, steps_max;
  double *shares;                 /* [point_count] 1 / number of neighbours */
  vector *residuals;              /* [point_count] Laplacians at the current positions */
  vector *gradients, *directions; /* [point_count] of the search */
  vector *laplacians;             /* [point_count] of the search direction */
  vector *displacements;          /* [point_count] of the points: the sum of all steps */
} fairing;

static bool allocate(fairing *f) {
  size_t points = f->patch->point_count;
  f->edges = tw_alloc(3 * (size_t)f->patch->triangle_count, sizeof *f->edges);
  f->shares = tw_alloc_zero(points, sizeof *f->shares);
  f->residuals = tw_alloc(points, sizeof *f->residuals);
  f->gradients = tw_alloc_zero(points, sizeof *f->gradients);
  f->directions = tw_alloc_zero(points, sizeof *f->directions);
  f->laplacians = tw_alloc(points, sizeof *f->laplacians);
  f->displacements = tw_alloc_zero(points, sizeof *f->displacements);
  return f->edges && f->shares && f->residuals && f->gradients && f->directions && f->laplacians &&
         f->displacements;
}

static void fairing_deinit(fairing *f) {
  tw_free(f->edges);
  tw_free(f->shares);
  tw_free(f->residuals);
  tw_free(f->gradients);
  tw_free(f->directions);
  tw_free(f->laplacians);
  tw_free(f->displacements);
}

static void find_edges(fairing *f) {
  const tw_hole_patch *p = f->patch;
  for (uint32_t t = 0; t < p->triangle_count; t++)
    for (uint32_t k = 0; k < 3; k++) {
      if (p->beyond[t][k] == UINT32_MAX || p->beyond[t][k] < t) continue;
      f->edges[f->edge_count][0] = p->triangles[t][k];
      f->edges[f->edge_count++][1] = p->triangles[t][(k + 1) % 3];
    }
}

/* The patch's Laplacians, to which the mesh's neighbours of the loop contribute. */
static void find_residuals(fairing *f) {
  const tw_hole_patch *p = f->patch;
  for (uint32_t i = 0; i < p->point_count; i++) {
    bool is_loop = i < p->loop_count;
    f->shares[i] = is_loop ? f->rings->counts[p->loop[i]] : 0;
    for (int k = 0; k < 3; k++) f->residuals[i][k] = is_loop ? f->rings->sums[p->loop[i]][k] : 0;
  }
  for (uint32_t e = 0; e < f->edge_count; e++)
    for (int end = 0; end < 2; end++) {
      uint32_t at = f->edges[e][end], other = f->edges[e][1 - end];
      f->shares[at]++;
      for (int k = 0; k < 3; k++) f->residuals[at][k] += p->points[other][k];
    }
  for (uint32_t i = 0; i < p->point_count; i++) {
    f->shares[i] = 1 / f->shares[i];
    for (int k = 0; k < 3; k++) f->residuals[i][k] = f->residuals[i][k] * f->shares[i] - p->points[i][k];
  }
}

/* Applies the Laplacian to vectors that are 0 on the loop, or applies its transpose. */
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
  apply(f, true, f->residuals, f->gradients);
  add(f, f->directions, -1, f->gradients);
  double gradient_square = square(f, f->gradients), least = 1e-16 * gradient_square;
  for (uint32_t i = 0; i < f->steps_max && gradient_square > least && status == TW_OK; i++) {
    apply(f, false, f->directions, f->laplacians);
    double by = gradient_square / square(f, f->laplacians), before = gradient_square;
    if (!isfinite(by)) break;
    add(f, f->displacements, by, f->directions);
    add(f, f->residuals, by, f->laplacians);
    apply(f, true, f->residuals, f->gradients);
    gradient_square = square(f, f->gradients);
    for (uint32_t p = 0; p < f->patch->point_count; p++)
      for (int k = 0; k < 3; k++)
        f->directions[p][k] = gradient_square / before * f->directions[p][k] - f->gradients[p][k];
    status = tw_editor_go_on(editor);
  }
  return status;
}

tw_status tw_hole_patch_fair(tw_hole_patch *patch, const tw_editor *editor, const tw_rings *rings,
                             tw_hole_work *budget) {
  if (patch->point_count == patch->loop_count) return TW_OK;
  uint64_t more = budget->steps / patch->point_count;
  if (more > STEPS_MOST - STEPS_LEAST) more = STEPS_MOST - STEPS_LEAST;
  budget->steps -= more * patch->point_count;
  fairing f = {.patch = patch, .rings = rings, .steps_max = STEPS_LEAST + (uint32_t)more};
  tw_status status = allocate(&f) ? TW_OK : tw_editor_no_memory(editor);
  if (status == TW_OK) {
    find_edges(&f);
    find_residuals(&f);
    status = solve(&f, editor);
    add(&f, patch->points, 1, f.displacements);
  }
  fairing_deinit(&f);
  return status;
}
