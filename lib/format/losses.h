/* What a reader leaves out of a file, or changes, counted by kind. A reader that passes over a part of a file
 * calls tw_lose, and ends with tw_losses_tell; or it warns by tw_model_warn where it says more than how many.
 * So nothing is lost without a warning. */
#ifndef TWEEND_LOSSES_H
#define TWEEND_LOSSES_H

#include "tweend/model.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Things of one kind. what, why: texts that outlive the losses. */
typedef struct tw_loss {
  const char *what; /* a sentence behind the count: "weights of points are left out" */
  const char *why;  /* behind a colon; NULL: nothing to add */
  uint64_t count, line;
} tw_loss;

enum { TW_LOSSES_MAX = 40 }; /* more kinds than a reader has */

typedef struct tw_losses {
  uint32_t count;
  tw_loss items[TW_LOSSES_MAX]; /* by their first occurrence */
} tw_losses;

/* Notes `count` lost things; 0: none. line: of the first of them; 0: not known. Losses with the same `what`
 * are one. O(kinds). */
void tw_lose(tw_losses *losses, const char *what, const char *why, uint64_t count, uint64_t line);

/* Notes that corners which repeat the one before them were merged, in `faces` faces. */
void tw_lose_doubled_corners(tw_losses *losses, uint64_t faces);

/* Warns of each kind: COUNT WHAT[, the first in line LINE][: WHY]. */
void tw_losses_tell(const tw_losses *losses, tw_model *model);

#ifdef __cplusplus
}
#endif
#endif
