/* Counts what readers leave out, by kind. */
#include "losses.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

void tw_lose(tw_losses *losses, const char *what, const char *why, uint64_t count, uint64_t line) {
  uint32_t i = 0;
  if (count == 0) return;
  while (i < losses->count && strcmp(losses->items[i].what, what) != 0) i++;
  assert(i < TW_LOSSES_MAX);
  if (i == TW_LOSSES_MAX) i--; /* told as of another kind rather than not at all */
  if (i == losses->count) losses->items[losses->count++] = (tw_loss){.what = what, .why = why, .line = line};
  losses->items[i].count += count;
}

void tw_lose_doubled_corners(tw_losses *losses, uint64_t faces) {
  tw_lose(losses, "faces name a point twice in a row", "they keep it once", faces, 0);
}

void tw_losses_tell(const tw_losses *losses, tw_model *model) {
  for (uint32_t i = 0; i < losses->count; i++) {
    const tw_loss *loss = &losses->items[i];
    char place[48] = "";
    if (loss->line > 0)
      snprintf(place, sizeof place, ", the first in line %llu", (unsigned long long)loss->line);
    tw_model_warn(model, "%llu %s%s%s%s", (unsigned long long)loss->count, loss->what, place,
                  loss->why ? ": " : "", loss->why ? loss->why : "");
  }
}
