/* Checks of clips: what they say of the model, and what is worth a warning. */
#include <stdio.h>
#include <string.h>

#include "clip.h"
#include "mix_check.h"
#include "model_checks.h"
#include "tweend/base.h"

/* Checks that a track of weights has one number for each morph target of its node's mesh. On a node without a
 * mesh it moves nothing. */
static tw_status check_weight_tracks(const tw_model *model, uint32_t index, tw_error *error) {
  const tw_clip_keys *clip = &model->clips[index];
  for (uint32_t i = 0; i < clip->track_count; i++) {
    const tw_track_keys *track = &clip->tracks[i];
    if (track->path != TW_WEIGHTS) continue;
    uint32_t mesh = model->nodes[track->node].mesh;
    if (mesh == TW_NO_INDEX || model->meshes[mesh].morph_count == track->width) continue;
    tw_fail(error, TW_INVALID, "a track of weights does not fit the morph targets of its node's mesh");
    tw_error_at(error, "/clips/%u/tracks/%u", index, i);
    return TW_INVALID;
  }
  return TW_OK;
}

/* Counts the steps of a rotation track that turn by 180 degrees or more. Compiles a window of keys at a time,
 * so that memory does not grow with the track; each window begins with the last key of the one before. */
static tw_status count_turns(const tw_track_keys *track, uint32_t *count, bool *says_angles,
                             tw_error *error) {
  enum { WINDOW = 4096 };
  *count = 0;
  *says_angles = track->interpolation == TW_EULER;
  for (uint32_t key = 0; *says_angles && key + 1 < track->key_count; key++) {
    const double *angles = track->angles + 3 * (size_t)key;
    *count += tw_angles_turn(angles, angles + 3) != TURN_SHORT;
  }
  if (*says_angles) return TW_OK;
  for (uint32_t first = 0; first + 1 < track->key_count; first += WINDOW) {
    tw_track_keys part = *track;
    part.node = 0;
    part.key_count = track->key_count - first < WINDOW + 1 ? track->key_count - first : WINDOW + 1;
    part.times += first;
    if (part.values) part.values += (size_t)first * track->width;
    if (part.angles) part.angles += (size_t)first * track->width;
    tw_clip *clip;
    tw_status status =
        tw_clip_create(&(tw_clip_keys){.track_count = 1, .tracks = &part}, 1, -1, &clip, error);
    if (status != TW_OK) return status;
    for (uint32_t key = 0; key + 1 < part.key_count; key++)
      *count += tw_track_turn(&clip->tracks[0], key) != TURN_SHORT;
    *says_angles = tw_track_says_angles(&clip->tracks[0]);
    tw_clip_destroy(clip);
  }
  return TW_OK;
}

/* Warns of tracks with steps that may not turn as meant: half turns of quaternions, whose way is arbitrary,
 * and steps of recorded angles that go the long way, as where a recorder wraps at 180 degrees. Angles that
 * somebody wrote turn as far as they say. */
static tw_status warn_of_turns(tw_model *model, uint32_t index, tw_error *error) {
  char clip_name[24], node_name[24];
  const tw_clip_keys *clip = &model->clips[index];
  for (uint32_t i = 0; i < clip->track_count; i++) {
    const tw_track_keys *track = &clip->tracks[i];
    bool joins = track->interpolation != TW_STEP && track->interpolation != TW_CUBICSPLINE, says_angles;
    uint32_t count = 0;
    if (track->path != TW_ROTATION || !joins) continue;
    tw_status status = count_turns(track, &count, &says_angles, error);
    if (status != TW_OK) return status;
    if (count == 0 || (says_angles && model->format != TW_FORMAT_BVH)) continue;
    tw_model_warn_of_clip(
        model, index, "%u %s of %s: clip \"%s\", node \"%s\"", count, tw_plural(count, "step", "steps"),
        says_angles ? "180 degrees or more, which quaternions would turn another way"
                    : "exactly 180 degrees, whose way is arbitrary",
        tw_model_clip_name(model, index, clip_name), tw_model_node_name(model, track->node, node_name));
  }
  return TW_OK;
}

/* Counts the quaternions of a track that are off unit length; those of splines stay as they are. */
static uint64_t count_off_unit(const tw_track_keys *track) {
  uint64_t count = 0;
  bool is_scaled = track->form == TW_KEY_QUATERNION && track->interpolation != TW_CUBICSPLINE;
  for (uint32_t i = 0; is_scaled && i < track->key_count; i++) {
    double key[4];
    quat_widen(track->values + 4 * (size_t)i, key);
    count += tw_is_off_unit(tw_length(key, 4));
  }
  return count;
}

/* Warns of splines of rotations whose keys glTF cannot hold as they are. */
static void warn_of_lengths(tw_model *model, uint32_t index) {
  char clip_name[24], node_name[24];
  const tw_clip_keys *clip = &model->clips[index];
  for (uint32_t i = 0; i < clip->track_count; i++) {
    const tw_track_keys *track = &clip->tracks[i];
    if (track->interpolation == TW_CUBICSPLINE && !tw_keys_fit_gltf(track))
      tw_model_warn_of_clip(
          model, index,
          "the spline's quaternions are not of unit length: it moves as they say, and glTF answers have "
          "LINEAR keys within 0.1 degrees of it: clip \"%s\", node \"%s\"",
          tw_model_clip_name(model, index, clip_name), tw_model_node_name(model, track->node, node_name));
  }
}

/* Warns of tracks with several keys at one time. */
static void warn_of_duplicates(tw_model *model, uint32_t index) {
  char clip_name[24], node_name[24];
  const tw_clip_keys *clip = &model->clips[index];
  for (uint32_t i = 0; i < clip->track_count; i++) {
    const tw_track_keys *track = &clip->tracks[i];
    if (track->duplicate_times > 0)
      tw_model_warn_of_clip(
          model, index, "%u %s at the time of the one before, where the %s jump%s: clip \"%s\", node \"%s\"",
          track->duplicate_times, tw_plural(track->duplicate_times, "key", "keys"),
          tw_path_names[track->path], track->path == TW_WEIGHTS ? "" : "s",
          tw_model_clip_name(model, index, clip_name), tw_model_node_name(model, track->node, node_name));
  }
}

static int compare_clip_names(const void *a, const void *b) {
  const tw_clip_keys *left = *(const tw_clip_keys *const *)a, *right = *(const tw_clip_keys *const *)b;
  int order = strcmp(left->name, right->name);
  return order != 0 ? order : (left > right) - (left < right);
}

/* Says of a clip that shares its name with one before it how to ask for it. sorted: [count] by name. */
static void warn_of_namesake(tw_model *model, const tw_clip_keys *clip, const tw_clip_keys *const *sorted,
                             uint32_t count) {
  char by_place[24];
  uint32_t index = (uint32_t)(clip - model->clips), low = 0, high = count;
  snprintf(by_place, sizeof by_place, "clip_%u", index);
  while (low < high) {
    uint32_t middle = low + (high - low) / 2;
    if (strcmp(sorted[middle]->name, by_place) < 0)
      low = middle + 1;
    else
      high = middle;
  }
  bool is_a_name = low < count && strcmp(sorted[low]->name, by_place) == 0;
  tw_model_warn_of_clip(model, index,
                        is_a_name
                            ? "another clip is called %.100s, too, and one is called %s: nothing asks for "
                              "this one"
                            : "another clip is called %.100s, too: %s asks for this one",
                        clip->name, by_place);
}

static tw_status warn_of_namesakes(tw_model *model, tw_error *error) {
  const tw_clip_keys **sorted = tw_alloc(model->clip_count, sizeof *sorted);
  uint32_t count = 0;
  if (!sorted) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  for (uint32_t i = 0; i < model->clip_count; i++)
    if (model->clips[i].name) sorted[count++] = &model->clips[i];
  tw_status status = tw_sort(sorted, count, sizeof *sorted, compare_clip_names);
  for (uint32_t i = 1; status == TW_OK && i < count; i++)
    if (strcmp(sorted[i]->name, sorted[i - 1]->name) == 0) warn_of_namesake(model, sorted[i], sorted, count);
  tw_free(sorted);
  return status == TW_OK ? TW_OK : tw_fail(error, status, "the names of the clips cannot be sorted");
}

tw_status tw_model_check_clips(tw_model *model, tw_error *error) {
  tw_status status = TW_OK;
  uint64_t scaled = 0, empty = 0;
  for (uint32_t i = 0; i < model->clip_count && status == TW_OK; i++) {
    status = tw_model_check_name(&model->clips[i].name, "clips", i, error);
    if (status != TW_OK) return status;
    status = tw_clip_check(&model->clips[i], model->node_count, -1, true, error);
    if (status == TW_OK) status = tw_clip_separate(&model->clips[i], model->arena, error);
    if (status != TW_OK) {
      tw_model_prefix(error, "clips", i);
      return status;
    }
    warn_of_duplicates(model, i);
    warn_of_lengths(model, i);
    status = check_weight_tracks(model, i, error);
    if (status == TW_OK) status = warn_of_turns(model, i, error);
    const tw_clip_keys *clip = &model->clips[i];
    for (uint32_t k = 0; k < clip->track_count; k++) scaled += count_off_unit(&clip->tracks[k]);
    empty += clip->track_count == 0 && clip->layer_count == 0 && !clip->loose;
  }
  tw_model_warn_count(model, scaled, "rotation key is not of unit length: it is scaled to it",
                      "rotation keys are not of unit length: they are scaled to it");
  tw_model_warn_count(model, empty, "clip has no tracks: glTF answers leave it out",
                      "clips have no tracks: glTF answers leave them out");
  if (status == TW_OK) status = tw_clips_check_layers(model->clips, model->clip_count, error);
  return status == TW_OK ? warn_of_namesakes(model, error) : status;
}
