/* Counts what readers leave out, by kind. */
#include "losses.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

/* Whether two sentences say the same before their reasons. */
static bool are_one_kind(const char *a, const char *b) {
  size_t length = strcspn(a, ":");
  return strcspn(b, ":") == length && memcmp(a, b, length) == 0;
}

void tw_lose(tw_losses *losses, const char *one, const char *many, uint64_t count, uint64_t line) {
  uint32_t i = 0;
  if (count == 0) return;
  while (i < losses->count && !are_one_kind(losses->items[i].many, many)) i++;
  assert(i < TW_LOSSES_MAX);
  if (i == TW_LOSSES_MAX) i--; /* told as of another kind rather than not at all */
  if (i == losses->count) losses->items[losses->count++] = (tw_loss){.one = one, .many = many, .line = line};
  losses->items[i].count += count;
}

void tw_lose_doubled_corners(tw_losses *losses, uint64_t faces) {
  tw_lose(losses, "face names a point twice in a row: it keeps it once",
          "faces name a point twice in a row: they keep it once", faces, 0);
}

static uint64_t count_blanks(const char *text, size_t length) {
  uint64_t count = 0;
  for (size_t i = 0; i < length; i++) count += text[i] == ' ';
  return count;
}

static bool is_utf8(const char *text, size_t length) {
  size_t at = 0, size = 1;
  for (; at < length && size > 0; at += size) size = tw_utf8_length(text + at, length - at);
  return at == length;
}

const char *tw_take_name(tw_losses *losses, tw_arena *arena, const char *text, size_t length) {
  const char *name = tw_arena_name(arena, text, length);
  if (!name) return NULL;
  tw_lose(losses, "name is not UTF-8: it is read as Latin-1", "names are not UTF-8: they are read as Latin-1",
          !is_utf8(text, length), 0);
  tw_lose(losses, "name has control characters, which become blanks",
          "names have control characters, which become blanks",
          count_blanks(name, strlen(name)) > count_blanks(text, length), 0);
  return name;
}

void tw_losses_tell(const tw_losses *losses, tw_model *model) {
  for (uint32_t i = 0; i < losses->count; i++) {
    const tw_loss *loss = &losses->items[i];
    char place[48] = "";
    if (loss->line > 0)
      snprintf(place, sizeof place, ", %sin line %llu", tw_plural(loss->count, "", "the first "),
               (unsigned long long)loss->line);
    const char *text = tw_plural(loss->count, loss->one, loss->many);
    int length = (int)strcspn(text, ":");
    tw_model_warn(model, "%llu %.*s%s%s", (unsigned long long)loss->count, length, text, place,
                  text + length);
  }
}
