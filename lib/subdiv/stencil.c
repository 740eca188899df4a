/* Sums of stencils: the kernel for every machine, the choice of the best one, and rectangles. */
#include <string.h>

#include "simd.h"
#include "stencil.h"
#include "stencil_kernel.h"

enum {
  JOINED_MAX = (TW_STENCIL_BLOCK / 2 - 1) * (TW_STENCIL_BLOCK / 2 - 1), /* points of lines below a block */
  JOINED_WIDTH = 7 /* floats: four of a value, three of a normal */
};

typedef bool stencil_kernel(const tw_stencil_job *job);

static bool fill_anywhere(const tw_stencil_job *job) {
  return fill_stencil(job);
}

static stencil_kernel *const kernels[TW_SETS] = {fill_anywhere,
#ifdef __x86_64__
                                                 tw_stencil_fill_avx2
#endif
};

bool tw_stencil_rows(const tw_stencil_job *job) {
  return kernels[tw_processor_has(TW_SET_AVX2)](job);
}

/* ---- rectangles ----------------------------------------------------------------------------- */

/* What a rectangle has of a section. False when that is nothing, or lies in another section as well. */
static bool clip_section(uint32_t n, uint32_t section, tw_patch_rect rect, tw_patch_rect *own,
                         tw_patch_rect *part) {
  bool column = tw_sections_reach(n) && rect.i0 == n;
  if (!tw_section_rect(n, section, own)) return false;
  if (tw_sections_reach(n) && section == (column ? TW_SECTION_INSIDE : TW_SECTION_COLUMN)) return false;
  *part = *own;
  if (part->i0 < rect.i0) part->i0 = rect.i0;
  if (part->i1 > rect.i1) part->i1 = rect.i1;
  if (part->j0 < rect.j0) part->j0 = rect.j0;
  if (part->j1 > rect.j1) part->j1 = rect.j1;
  return part->i0 <= part->i1 && part->j0 <= part->j1;
}

/* Copies `width` floats of each of some rows. */
static void put_rows(const float *rows, size_t width, size_t from_step, uint32_t count, ptrdiff_t step,
                     float *out) {
  if (step == (ptrdiff_t)width && from_step == width) {
    memcpy(out, rows, count * width * sizeof *out);
    return;
  }
  for (uint32_t i = 0; i < count; i++, rows += from_step, out += step) memcpy(out, rows, width * sizeof *out);
}

/* Lines that are shorter than a block, of which a vector holds several: summed up as one, with what lies
 * between them, and then put where they belong. */
static bool sum_joined(const tw_stencil_job *run) {
  float rows[JOINED_MAX * JOINED_WIDTH];
  bool joined = run->values && run->normals == run->values + run->width;
  size_t before = run->values ? run->width : 0, width = before + (run->normals ? 3 : 0);
  tw_stencil_job all = *run;
  all.count = (run->lines - 1) * run->apart + run->count;
  all.lines = 1;
  all.step = (ptrdiff_t)width;
  if (run->values) all.values = rows;
  if (run->normals) all.normals = rows + before;
  bool sure = tw_stencil_rows(&all);
  const float *from = rows;
  for (uint32_t line = 0; line < run->lines; line++, from += run->apart * width) {
    ptrdiff_t place = (ptrdiff_t)line * run->line_step;
    size_t first = joined ? width : before;
    if (run->values) put_rows(from, first, width, run->count, run->step, run->values + place);
    if (run->normals && !joined)
      put_rows(from + before, 3, width, run->count, run->step, run->normals + place);
  }
  return sure;
}

/* The part of a rectangle that lies in a section. */
static bool sum_part(const tw_stencil_job *job, uint32_t first, tw_patch_rect own, tw_patch_rect part) {
  tw_stencil_job run = *job;
  run.apart = own.i1 - own.i0 + 1;
  run.count = part.i1 - part.i0 + 1;
  run.lines = part.j1 - part.j0 + 1;
  run.first = first + (part.j0 - own.j0) * run.apart + part.i0 - own.i0;
  if (run.apart == 1) run.step = job->line_step;
  if (run.count == run.apart && (run.count == 1 || run.line_step == (ptrdiff_t)run.count * run.step)) {
    run.count *= run.lines;
    run.lines = 1;
  }
  return run.lines > 1 && run.apart < TW_STENCIL_BLOCK ? sum_joined(&run) : tw_stencil_rows(&run);
}

bool tw_stencil_rect(const tw_stencil_job *job, uint32_t depth, tw_patch_rect rect) {
  uint32_t n = 1u << depth;
  bool sure = true;
  for (uint32_t section = 0; section < TW_SECTIONS; section++) {
    tw_patch_rect own, part;
    if (!clip_section(n, section, rect, &own, &part)) continue;
    ptrdiff_t place =
        (ptrdiff_t)(part.j0 - rect.j0) * job->line_step + (ptrdiff_t)(part.i0 - rect.i0) * job->step;
    tw_stencil_job sums = *job;
    if (job->values) sums.values = job->values + place;
    if (job->normals) sums.normals = job->normals + place;
    if (!sum_part(&sums, tw_section_first(n, section), own, part)) sure = false;
  }
  return sure;
}
