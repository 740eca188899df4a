/* What a reader leaves out of a file, or changes, counted by kind. A reader that passes over a part of a file
 * calls tw_lose, takes names by tw_take_name, and ends with tw_losses_tell; or it warns by tw_model_warn
 * where it says more than how many. So nothing is lost without a warning. */
#ifndef TWEEND_LOSSES_H
#define TWEEND_LOSSES_H

#include "tweend/model.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Things of one kind. one, many: texts that outlive the losses, sentences behind the count, with a reason
 * behind a colon or without: "weight of a point is left out: it belongs to a curve", "weights of points are
 * left out: they belong to curves". */
typedef struct tw_loss {
  const char *one, *many;
  uint64_t count, line;
} tw_loss;

enum { TW_LOSSES_MAX = 64 }; /* more kinds than a reader has */

typedef struct tw_losses {
  uint32_t count;
  tw_loss items[TW_LOSSES_MAX]; /* by their first occurrence */
} tw_losses;

/* Notes `count` lost things; 0: none. line: of the first of them; 0: not known. Losses with the same
 * `many` before its reason are one, told with the first reason. O(kinds). */
void tw_lose(tw_losses *losses, const char *one, const char *many, uint64_t count, uint64_t line);

/* Normals that point nowhere. */
#define TW_ZERO_NORMAL  "normal is 0 0 0, and computed in its place"
#define TW_ZERO_NORMALS "normals are 0 0 0, and computed in their place"

/* Notes that corners which repeat the one before them were merged, in `faces` faces. */
void tw_lose_doubled_corners(tw_losses *losses, uint64_t faces);

/* Copies text as a name, as tw_arena_name does, and notes what it changes. NULL without memory. */
const char *tw_take_name(tw_losses *losses, tw_arena *arena, const char *text, size_t length);

/* Warns of each kind: COUNT SENTENCE[, the first in line LINE][: REASON]. */
void tw_losses_tell(const tw_losses *losses, tw_model *model);

#ifdef __cplusplus
}
#endif
#endif
