/* Models: their memory and their warnings. */
#include "tweend/model.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "tweend/base.h"

const char *const tw_format_names[TW_FORMATS] = {"obj", "tweend", "gltf", "glb", "stl", "ply", "bvh"};
const char *const tw_format_media_types[TW_FORMATS] = {
    "model/obj", "application/json", "model/gltf+json", "model/gltf-binary",
    "model/stl", "model/ply",        "model/x-bvh"};

tw_model *tw_model_create(void) {
  tw_arena *arena = tw_arena_create();
  if (!arena) return NULL;
  tw_model *model = tw_arena_alloc(arena, 1, sizeof *model);
  if (!model) {
    tw_arena_destroy(arena);
    return NULL;
  }
  model->arena = arena;
  return model;
}

void tw_model_destroy(tw_model *model) {
  if (!model) return;
  tw_arena_destroy(model->arena); /* holds the model itself */
}

size_t tw_model_size(const tw_model *model) {
  return tw_arena_size(model->arena);
}

static void warn(tw_model *model, uint32_t clip, const char *format, va_list arguments) {
  if (model->warning_count == TW_WARNINGS_MAX) {
    model->warnings[TW_WARNINGS_MAX - 1] = "there are more warnings";
    model->warned_clips[TW_WARNINGS_MAX - 1] = TW_NO_INDEX;
    return;
  }
  if (!model->warnings) {
    uint32_t *clips = tw_arena_alloc(model->arena, TW_WARNINGS_MAX, sizeof *clips);
    model->warned_clips = clips;
    if (clips) model->warnings = tw_arena_alloc(model->arena, TW_WARNINGS_MAX, sizeof(char *));
  }
  if (!model->warnings) return;
  tw_error sentence; /* tw_fail cuts the detail between characters */
  char text[sizeof sentence.detail];
  vsnprintf(text, sizeof text, format, arguments);
  tw_fail(&sentence, TW_OK, "%s", text);
  const char *kept = tw_arena_text(model->arena, sentence.detail, strlen(sentence.detail));
  if (!kept) return;
  model->warned_clips[model->warning_count] = clip;
  model->warnings[model->warning_count++] = kept;
}

void tw_model_warn(tw_model *model, const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  warn(model, TW_NO_INDEX, format, arguments);
  va_end(arguments);
}

void tw_model_warn_of_clip(tw_model *model, uint32_t clip, const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  warn(model, clip, format, arguments);
  va_end(arguments);
}

void tw_model_warn_count(tw_model *model, uint64_t count, const char *one, const char *many) {
  if (count > 0) tw_model_warn(model, "%llu %s", (unsigned long long)count, tw_plural(count, one, many));
}
