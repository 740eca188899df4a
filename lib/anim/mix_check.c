/* The layers of the mixed clips of a file: checked, and measured. */
#include "mix_check.h"

#include <stdio.h>
#include <string.h>

/* How deep and how wide the mixed clips below a clip are. */
typedef struct mixed_size {
  uint32_t depth, clips; /* depth: 0 for a plain clip; clips: those that are played; 0: not known yet */
} mixed_size;

/* What layers tell of the clip's duration. */
typedef struct mixed_times {
  tw_layer layers[TW_LAYERS_MAX];
  float durations[TW_LAYERS_MAX];
} mixed_times;

/* The clips that lie above one another on the way to a clip. */
typedef struct mixed_way {
  tw_clip_keys *all;  /* [clip_count] */
  mixed_size *sizes;  /* [clip_count] */
  mixed_times *times; /* scratch */
  uint32_t clips[TW_LAYER_DEPTH_MAX + 1], count;
} mixed_way;

static tw_status fail_layer(const mixed_way *way, uint32_t layer, tw_status status, const char *fault,
                            tw_error *error) {
  char made[24];
  uint32_t clip = way->clips[way->count - 1];
  const char *name = way->all[way->clips[0]].name;
  snprintf(made, sizeof made, "clip_%u", way->clips[0]);
  tw_fail(error, status, "clip \"%.100s\" %s", name ? name : made, fault);
  return tw_error_at(error, "/clips/%u/layers/%u/clip", clip, layer);
}

static bool is_on_way(const mixed_way *way, uint32_t clip) {
  for (uint32_t i = 0; i < way->count; i++)
    if (way->clips[i] == clip) return true;
  return false;
}

/* Sets the duration of a mixed clip whose layers' clips have theirs: negative where one is another model's.
 */
static tw_status set_duration(const mixed_way *way, tw_clip_keys *clip, tw_error *error) {
  mixed_times *times = way->times;
  clip->mixed_duration = -1;
  for (uint32_t i = 0; i < clip->layer_count; i++) {
    const tw_clip_layer *layer = &clip->layers[i];
    const tw_clip_keys *below = layer->own != TW_NO_INDEX ? &way->all[layer->own] : NULL;
    if (!below || (below->layer_count > 0 && below->mixed_duration < 0)) return TW_OK;
    times->layers[i] = layer->layer;
    times->durations[i] = tw_keys_duration(below);
  }
  return tw_mix_duration(times->layers, times->durations, clip->layer_count, &clip->mixed_duration, error);
}

/* Measures a clip and those below it; recurses no deeper than TW_LAYER_DEPTH_MAX. */
static tw_status measure_mixed(mixed_way *way, uint32_t index, tw_error *error) {
  tw_clip_keys *clip = &way->all[index];
  mixed_size size = {clip->layer_count > 0, clip->layer_count == 0};
  way->clips[way->count++] = index;
  for (uint32_t i = 0; i < clip->layer_count; i++) {
    uint32_t own = clip->layers[i].own;
    mixed_size below = {0, 1};
    if (own != TW_NO_INDEX) {
      if (is_on_way(way, own)) return fail_layer(way, i, TW_INVALID, "is mixed of itself", error);
      if (way->sizes[own].clips == 0 && way->count <= TW_LAYER_DEPTH_MAX) {
        tw_status status = measure_mixed(way, own, error);
        if (status != TW_OK) return status;
      }
      below = way->sizes[own];
    }
    size.clips += below.clips;
    if (below.depth + 1 > size.depth) size.depth = below.depth + 1;
    if (below.clips == 0 || way->count + size.depth - 1 > TW_LAYER_DEPTH_MAX)
      return fail_layer(way, i, TW_LIMIT, "is mixed of clips that lie more than 8 deep", error);
    if (size.clips > TW_LAYER_CLIPS_MAX)
      return fail_layer(way, i, TW_LIMIT, "is mixed of more than 256 clips", error);
  }
  way->count--;
  way->sizes[index] = size;
  return clip->layer_count > 0 ? set_duration(way, clip, error) : TW_OK;
}

tw_status tw_clips_check_layers(tw_clip_keys *clips, uint32_t clip_count, tw_error *error) {
  bool is_any = false;
  for (uint32_t i = 0; i < clip_count; i++)
    for (uint32_t j = 0; j < clips[i].layer_count; j++) {
      is_any = true;
      char inner[sizeof error->pointer];
      tw_status status = tw_layer_check(&clips[i].layers[j].layer, error);
      if (status == TW_OK) continue;
      if (error) memcpy(inner, error->pointer, sizeof inner);
      if (error) tw_error_at(error, "/clips/%u/layers/%u%s", i, j, inner);
      return status;
    }
  if (!is_any) return TW_OK;
  mixed_way way = {.all = clips,
                   .sizes = tw_alloc_zero(clip_count, sizeof *way.sizes),
                   .times = tw_alloc(1, sizeof *way.times)};
  bool has_room = way.sizes && way.times;
  tw_status status = has_room ? TW_OK : tw_fail(error, TW_NO_MEMORY, "out of memory");
  for (uint32_t i = 0; i < clip_count && status == TW_OK; i++)
    if (clips[i].layer_count > 0) status = measure_mixed(&way, i, error);
  tw_free(way.sizes);
  tw_free(way.times);
  return status;
}
