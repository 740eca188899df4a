/* Lines of regular patches: the kernel for every machine, and the choice of the best one. */
#include "processor.h"
#include "spline_kernel.h"

/* At place i, by the arithmetic of the kernel. */
static float weighted_three(const float (*slopes)[WIDTH_MAX], size_t c, const float *const table[3],
                            size_t i) {
  return (table[0][i] * slopes[0][c] + table[2][i] * slopes[2][c]) + table[1][i] * slopes[1][c];
}

static float weighted_four(const float (*slopes)[WIDTH_MAX], size_t c, const float *const table[4],
                           size_t i) {
  return (table[0][i] * slopes[0][c] + table[3][i] * slopes[3][c]) +
         (table[1][i] * slopes[1][c] + table[2][i] * slopes[2][c]);
}

void tw_spline_look_closer(const tw_spline_job *job, size_t first, size_t count, size_t j, bool transposed,
                           float *out) {
  const float *corners[4] = {job->points[5], job->points[transposed ? 9 : 6], job->points[10],
                             job->points[transposed ? 6 : 9]};
  slopes slopes;
  line_slopes line;
  find_slopes(job->points, &slopes);
  weigh_slopes(&slopes, job->spline, j, &line);
  for (size_t i = first; i < first + count; i++, out += job->step) {
    float tangents[2][3];
    for (size_t c = 0; c < 3; c++) {
      tangents[transposed][c] =
          weighted_three((const float(*)[WIDTH_MAX])line.along, c, job->spline->slope, i);
      tangents[!transposed][c] =
          weighted_four((const float(*)[WIDTH_MAX])line.across, c, job->spline->limit, i);
    }
    tw_normal_from_tangents(tangents[0], tangents[1], corners, out);
  }
}

static void fill_anywhere(const tw_spline_job *job, bool transposed) {
  fill_job(job, transposed);
}

typedef void fill_kernel(const tw_spline_job *job, bool transposed);

static fill_kernel *const kernels[TW_SETS] = {fill_anywhere,
#ifdef __x86_64__
                                              tw_spline_fill_avx2
#endif
};

/* A single column runs along i once i and j have changed places. */
static void run(fill_kernel *kernel, const tw_spline_job *job) {
  bool column = job->column || job->rect.j0 != job->rect.j1;
  if (job->rect.i0 != job->rect.i1 || !column) {
    kernel(job, false);
    return;
  }
  float points[16][WIDTH_MAX];
  for (size_t r = 0; r < 4; r++)
    for (size_t k = 0; k < 4; k++) memcpy(points[4 * r + k], job->points[4 * k + r], sizeof points[0]);
  tw_spline_job turned = *job;
  turned.points = (const float(*)[WIDTH_MAX])points;
  turned.rect = (tw_patch_rect){job->rect.j0, job->rect.j1, job->rect.i0, job->rect.i1};
  turned.step = job->line_step;
  turned.line_step = job->step;
  kernel(&turned, true);
}

void tw_spline_rows(const tw_spline_job *job) {
  run(kernels[tw_processor_has(TW_SET_AVX2)], job);
}
