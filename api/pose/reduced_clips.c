/* Reduces or expresses the keys of clips, and keeps the result in the cache. */
#include "reduced_clips.h"

#include <math.h>

/* Immutable. */
typedef struct reduced_clips {
  tw_arena *arena;              /* holds the members below and the struct itself */
  const tw_track_keys **tracks; /* [clips of the source] for tracks that is_reduced; or NULL. Of mixed clips
                                   all tracks */
  uint32_t *track_counts;       /* [clips of the source] */
  tw_tolerance reached;         /* the largest remaining error */
} reduced_clips;

static bool is_reduced(const tw_track_keys *track, const api_reduction *reduction) {
  return !tw_keys_fit_gltf(track) || (reduction->is_wide && track->interpolation == TW_LINEAR);
}

static uint32_t count_reduced(const tw_clip_keys *clip, const api_reduction *reduction) {
  uint32_t count = 0;
  for (uint32_t i = 0; i < clip->track_count; i++) count += is_reduced(&clip->tracks[i], reduction);
  return count;
}

static void destroy_reduced(void *value) {
  tw_arena_destroy(((reduced_clips *)value)->arena); /* holds the struct itself */
}

/* mixed: a clip without keys, or NULL. */
static tw_status reduce_tracks(const api_clips_to_reduce *source, const tw_clip *mixed,
                               const tw_clip_keys *chosen, uint64_t *steps, tw_arena *arena,
                               tw_clip_keys *out, tw_tolerance *reached, tw_error *error) {
  tw_status (*convert)(const tw_clip *, const tw_clip_keys *, tw_tolerance, uint32_t, uint64_t *, tw_arena *,
                       tw_clip_keys *, tw_tolerance *, tw_error *) =
      source->reduction->is_wide ? tw_clip_reduce : tw_clip_express;
  tw_clip *clip = NULL;
  if (mixed)
    return convert(mixed, NULL, source->reduction->tolerance, source->max_keys, steps, arena, out, reached,
                   error);
  tw_status status = tw_clip_create(chosen, source->node_count, -1, &clip, error);
  if (status == TW_OK)
    status = convert(clip, chosen, source->reduction->tolerance, source->max_keys, steps, arena, out, reached,
                     error);
  tw_clip_destroy(clip);
  return status;
}

/* Reduces the tracks of a clip that need it, as a clip of their own. */
static tw_status reduce_clip(const api_clips_to_reduce *source, uint32_t index, uint64_t *steps,
                             reduced_clips *reduced, tw_error *error) {
  const tw_clip_keys *clip = &source->clips[index];
  const tw_clip *mixed = source->mixed[index];
  uint32_t count = count_reduced(clip, source->reduction), filled = 0;
  if (count == 0 && !mixed) return TW_OK;
  tw_track_keys *chosen = tw_alloc(count, sizeof *chosen);
  if (!chosen) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  for (uint32_t i = 0; i < clip->track_count; i++)
    if (is_reduced(&clip->tracks[i], source->reduction)) chosen[filled++] = clip->tracks[i];
  tw_clip_keys keys = {.track_count = count, .tracks = chosen}, out = {0};
  tw_tolerance reached;
  tw_status status = reduce_tracks(source, mixed, &keys, steps, reduced->arena, &out, &reached, error);
  tw_free(chosen);
  if (status != TW_OK) return status;
  reduced->tracks[index] = out.tracks;
  reduced->track_counts[index] = out.track_count;
  reduced->reached.angle = fmax(reduced->reached.angle, reached.angle);
  reduced->reached.distance = fmax(reduced->reached.distance, reached.distance);
  return TW_OK;
}

static tw_status reduce_clips(const api_clips_to_reduce *source, reduced_clips *reduced, tw_error *error) {
  reduced->tracks = tw_arena_alloc(reduced->arena, source->clip_count, sizeof *reduced->tracks);
  reduced->track_counts = tw_arena_alloc(reduced->arena, source->clip_count, sizeof *reduced->track_counts);
  if (!reduced->tracks || !reduced->track_counts) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  tw_status status = TW_OK;
  uint64_t steps = TW_REDUCTION_STEPS;
  for (uint32_t i = 0; i < source->clip_count && status == TW_OK; i++)
    status = reduce_clip(source, i, &steps, reduced, error);
  return status;
}

static bool build_reduced(void *context, api_built *out, api_fault *fault) {
  tw_arena *arena = tw_arena_create();
  reduced_clips *reduced = arena ? tw_arena_alloc(arena, 1, sizeof *reduced) : NULL;
  if (!reduced) {
    tw_arena_destroy(arena);
    return api_fault_without_memory(fault);
  }
  reduced->arena = arena;
  if (reduce_clips(context, reduced, &fault->error) != TW_OK) {
    destroy_reduced(reduced);
    return api_fault_complete(fault);
  }
  *out = (api_built){reduced, tw_arena_size(arena), destroy_reduced, API_CACHED_CLIP};
  return true;
}

bool api_clips_need_reduction(const api_clips_to_reduce *source) {
  for (uint32_t i = 0; i < source->clip_count; i++)
    if (source->mixed[i] || count_reduced(&source->clips[i], source->reduction) > 0) return true;
  return false;
}

/* A copy of the clips with the reduced tracks. NULL without memory. */
static const tw_clip_keys *replace_tracks(tw_arena *arena, const api_clips_to_reduce *source,
                                          const reduced_clips *reduced) {
  tw_clip_keys *out = tw_arena_alloc(arena, source->clip_count, sizeof *out);
  for (uint32_t i = 0; out && i < source->clip_count; i++) {
    const tw_track_keys *fewer = reduced->tracks[i];
    out[i] = source->clips[i];
    if (!fewer) continue;
    if (source->mixed[i]) {
      out[i].tracks = fewer;
      out[i].track_count = reduced->track_counts[i];
      continue;
    }
    tw_track_keys *tracks = tw_arena_alloc(arena, source->clips[i].track_count, sizeof *tracks);
    if (!tracks) return NULL;
    for (uint32_t j = 0; j < source->clips[i].track_count; j++) {
      const tw_track_keys *was = &source->clips[i].tracks[j];
      tracks[j] = is_reduced(was, source->reduction) ? *fewer++ : *was;
      tracks[j].preserved = was->preserved;
    }
    out[i].tracks = tracks;
  }
  return out;
}

api_outcome api_clips_reduce(api_call *call, const char *key, const api_clips_to_reduce *source,
                             api_entry **entry, const tw_clip_keys **out, tw_tolerance *reached) {
  api_clips_to_reduce context = *source;
  api_outcome outcome = api_call_take(call, key, build_reduced, &context, entry);
  if (outcome != API_DONE) return outcome;
  const reduced_clips *reduced = api_entry_value(*entry);
  *out = replace_tracks(call->arena, source, reduced);
  *reached = reduced->reached;
  return *out ? API_DONE : api_fail_without_memory(call);
}
