/* Patches evaluated by splitting alone, for tests of what is faster. */
#ifndef SPLIT_PATCH_H
#define SPLIT_PATCH_H

#include <string.h>

#include "stencil.h"

enum { COMMONS_MAX = 64 };

/* As tw_patch_evaluate, of patches with these shapes. */
static inline void evaluate_split(const tw_patches *patches, const tw_patch_shapes *shapes, uint32_t quad,
                                  const tw_patch_job *job, tw_patch_rect rect) {
  static const tw_stencil *kept[COMMONS_MAX][2][TW_STENCIL_DEPTH_MAX + 1];
  tw_patch *patch = &patches->patches[quad];
  bool summed = patch->summed;
  size_t count = 0;
  for (tw_patch_class *s = tw_patch_shapes_commons(shapes); s; s = s->next_common, count++) {
    memcpy(kept[count], s->stencils, sizeof kept[count]);
    memset(s->stencils, 0, sizeof kept[count]);
  }
  patch->summed = false;
  tw_patch_evaluate(patches, quad, job, rect);
  patch->summed = summed;
  count = 0;
  for (tw_patch_class *s = tw_patch_shapes_commons(shapes); s; s = s->next_common, count++)
    memcpy(s->stencils, kept[count], sizeof kept[count]);
}

#endif
