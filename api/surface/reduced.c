/* Reducing a clip takes far longer than sending it, so what comes of it is worth a place in the cache. */
#include "reduced.h"

#include "service.h"

#include <stdio.h>
#include <stdlib.h>

typedef struct reduced_source {
  const tw_model *model;
  const tw_clip_keys *keys;
  const api_reduction *reduction;
  uint32_t max_keys; /* of a track */
} reduced_source;

/* Whether glTF interpolates between the keys just as the track does. */
static bool is_native(const tw_track_keys *track) {
  if (track->interpolation == TW_LINEAR) return track->form != TW_KEY_AXIS_ANGLE;
  return track->interpolation == TW_STEP || track->interpolation == TW_CUBICSPLINE;
}

static bool is_reduced(const tw_track_keys *track, const api_reduction *reduction) {
  return !is_native(track) || (reduction->is_wide && track->interpolation == TW_LINEAR);
}

static void destroy_reduced(void *value) {
  tw_arena_destroy(((api_reduced *)value)->arena); /* holds the struct itself */
}

/* The tracks to reduce as a clip of their own. */
static bool choose_tracks(const reduced_source *source, api_reduced *reduced, tw_track_keys *chosen) {
  uint32_t *places = tw_arena_alloc(reduced->arena, source->keys->track_count, sizeof *places);
  if (!places) return false;
  for (uint32_t i = 0; i < source->keys->track_count; i++) {
    if (!is_reduced(&source->keys->tracks[i], source->reduction)) continue;
    chosen[reduced->track_count] = source->keys->tracks[i];
    places[reduced->track_count++] = i;
  }
  reduced->places = places;
  return true;
}

static tw_status reduce_tracks(const reduced_source *source, api_reduced *reduced, tw_error *error) {
  tw_track_keys *chosen = tw_alloc(source->keys->track_count, sizeof *chosen);
  if (!chosen || !choose_tracks(source, reduced, chosen)) {
    free(chosen);
    return tw_fail(error, TW_NO_MEMORY, "out of memory");
  }
  tw_clip_keys keys = {.track_count = reduced->track_count, .tracks = chosen}, out = {0};
  tw_clip *clip = NULL;
  tw_status status = tw_clip_create(&keys, source->model->node_count, -1, &clip, error);
  if (status == TW_OK) /* none of the tracks is a spline, which would stay where it is */
    status = tw_clip_reduce(clip, &keys, source->reduction->tolerance, source->max_keys, reduced->arena, &out,
                            &reduced->reached, error);
  reduced->tracks = out.tracks;
  tw_clip_destroy(clip);
  free(chosen);
  return status;
}

static bool build_reduced(void *context, api_built *out, api_fault *fault) {
  tw_arena *arena = tw_arena_create();
  api_reduced *reduced = arena ? tw_arena_alloc(arena, 1, sizeof *reduced) : NULL;
  if (!reduced) {
    tw_arena_destroy(arena);
    api_fault_without_memory(fault);
    return false;
  }
  reduced->arena = arena;
  if (reduce_tracks(context, reduced, &fault->error) != TW_OK) {
    destroy_reduced(reduced);
    api_fault_complete(fault);
    return false;
  }
  *out = (api_built){reduced, tw_arena_size(arena), destroy_reduced};
  return true;
}

api_outcome api_reduced_take(api_call *call, const tw_model *model, bool is_stored,
                             const api_clip_choice *choice, const tw_clip_keys *keys,
                             const api_reduction *reduction, api_entry **out) {
  uint64_t limit = call->service->limits.max_times;
  reduced_source source = {model, keys, reduction, limit < UINT32_MAX ? (uint32_t)limit : UINT32_MAX};
  char key[192];
  snprintf(key, sizeof key, "%s/reduced?from=%s&index=%u&wide=%d&tolerance=%a/%a", call->id, choice->lender,
           choice->index, reduction->is_wide, reduction->tolerance.angle, reduction->tolerance.distance);
  return api_call_take(call, is_stored ? key : NULL, build_reduced, &source, out);
}
