/* Clips: the tracks of one animation, compiled once and shared. */
#include "clip.h"

#include <stdlib.h>
#include <string.h>

/* Exporters give the joints of a skeleton the same key times, and then one search serves them all. The
 * last timeline with each low hash is kept at hand; one that falls out is only not shared. */
enum { RECENT_TIMELINES = 64 };

static uint64_t hash_times(const float *times, uint32_t count) {
  uint64_t hash = 1469598103934665603u;
  for (uint32_t i = 0; i < count; i++) {
    uint32_t bits;
    memcpy(&bits, &times[i], sizeof bits);
    hash = (hash ^ bits) * 1099511628211u;
  }
  return hash ^ hash >> 32;
}

static tw_status build_timelines(tw_clip *clip, const tw_clip_keys *keys, tw_error *error) {
  uint32_t recent[RECENT_TIMELINES];
  memset(recent, 0xFF, sizeof recent);
  for (uint32_t i = 0; i < keys->track_count; i++) {
    const tw_track_keys *track = &keys->tracks[i];
    uint32_t *slot = &recent[hash_times(track->times, track->key_count) % RECENT_TIMELINES];
    const tw_timeline *found = *slot == TW_NO_INDEX ? NULL : &clip->timelines[*slot];
    if (!found || found->key_count != track->key_count ||
        memcmp(found->times, track->times, track->key_count * sizeof *track->times) != 0) {
      *slot = clip->timeline_count++;
      if (!tw_timeline_init(&clip->timelines[*slot], clip->arena, track->times, track->key_count))
        return tw_fail(error, TW_NO_MEMORY, "no memory for key times");
    }
    clip->tracks[i].timeline_index = *slot;
    float last = track->times[track->key_count - 1];
    if (last > clip->duration) clip->duration = last;
  }
  return TW_OK;
}

static tw_status build_tracks(tw_clip *clip, const tw_clip_keys *keys, int force, tw_error *error) {
  for (uint32_t i = 0; i < keys->track_count; i++) {
    const tw_track_keys *source = &keys->tracks[i];
    tw_track *track = &clip->tracks[i];
    bool forced = force >= 0 && source->path == TW_ROTATION;
    tw_interpolation interpolation = forced ? (tw_interpolation)force : source->interpolation;
    const tw_timeline *timeline = &clip->timelines[track->timeline_index];
    tw_status status = tw_track_build(track, clip->arena, source, interpolation, forced, timeline, error);
    if (status != TW_OK) {
      char inner[sizeof error->pointer];
      if (error) {
        memcpy(inner, error->pointer, sizeof inner);
        tw_error_at(error, "/tracks/%u%s", i, inner);
      }
      return status;
    }
    clip->moves[source->node] |= (uint8_t)(1u << source->path);
  }
  return TW_OK;
}

/* Counting sort: stable, so the order is the same everywhere. */
static tw_status order_tracks(tw_clip *clip, tw_error *error) {
  uint32_t *next = tw_alloc_zero((size_t)clip->timeline_count + 1, sizeof *next);
  if (!next) return tw_fail(error, TW_NO_MEMORY, "no memory for a clip");
  for (uint32_t i = 0; i < clip->track_count; i++) next[clip->tracks[i].timeline_index + 1]++;
  for (uint32_t i = 0; i < clip->timeline_count; i++) next[i + 1] += next[i];
  for (uint32_t i = 0; i < clip->track_count; i++)
    clip->by_timeline[next[clip->tracks[i].timeline_index]++] = i;
  free(next);
  return TW_OK;
}

/* Rotations by slerp, apart from all else that a pose needs. Returns how many they are; one alone gains
 * nothing from a group. */
static uint32_t divide_tracks(tw_clip *clip, uint32_t *arcs) {
  uint32_t arc_count = 0;
  for (uint32_t i = 0; i < clip->track_count; i++) {
    uint32_t index = clip->by_timeline[i];
    const tw_track *track = &clip->tracks[index];
    if (track->kind == TRACK_ARC)
      arcs[arc_count++] = index;
    else if (track->path != TW_WEIGHTS)
      clip->others[clip->other_count++] = index;
  }
  if (arc_count != 1) return arc_count;
  clip->others[clip->other_count++] = arcs[0];
  return 0;
}

static tw_status group_tracks(tw_clip *clip, tw_error *error) {
  uint32_t *arcs = tw_alloc(clip->track_count, sizeof *arcs);
  clip->others = tw_arena_alloc(clip->arena, clip->track_count, sizeof *clip->others);
  bool is_done = arcs && clip->others;
  uint32_t arc_count = is_done ? divide_tracks(clip, arcs) : 0;
  tw_arc_group **end = &clip->groups;
  for (uint32_t done = 0; done < arc_count;) {
    tw_arc_group *group = *end =
        tw_arc_group_create(clip->arena, clip->tracks, arcs + done, arc_count - done);
    is_done = group != NULL;
    if (!is_done) break;
    done += group->track_count;
    end = &group->following;
  }
  free(arcs);
  return is_done ? TW_OK : tw_fail(error, TW_NO_MEMORY, "no memory for a clip");
}

static tw_clip *clip_alloc(const tw_clip_keys *keys, uint32_t node_count) {
  tw_arena *arena = tw_arena_create();
  tw_clip *clip = arena ? tw_arena_alloc(arena, 1, sizeof *clip) : NULL;
  if (!clip) {
    tw_arena_destroy(arena);
    return NULL;
  }
  *clip = (tw_clip){.arena = arena, .node_count = node_count, .track_count = keys->track_count};
  clip->tracks = tw_arena_alloc(arena, keys->track_count, sizeof *clip->tracks);
  clip->timelines = tw_arena_alloc(arena, keys->track_count, sizeof *clip->timelines);
  clip->by_timeline = tw_arena_alloc(arena, keys->track_count, sizeof *clip->by_timeline);
  clip->moves = tw_arena_alloc(arena, node_count, sizeof *clip->moves);
  if (clip->tracks && clip->timelines && clip->by_timeline && clip->moves) return clip;
  tw_arena_destroy(arena);
  return NULL;
}

tw_status tw_clip_create(const tw_clip_keys *keys, uint32_t node_count, int force, tw_clip **out,
                         tw_error *error) {
  tw_status status = tw_clip_check(keys, node_count, force, error);
  if (status != TW_OK) return status;
  tw_clip *clip = clip_alloc(keys, node_count);
  if (!clip) return tw_fail(error, TW_NO_MEMORY, "no memory for a clip");
  status = build_timelines(clip, keys, error);
  if (status == TW_OK) status = build_tracks(clip, keys, force, error);
  if (status == TW_OK) status = order_tracks(clip, error);
  if (status == TW_OK) status = group_tracks(clip, error);
  if (status == TW_OK)
    *out = clip;
  else
    tw_clip_destroy(clip);
  return status;
}

void tw_clip_destroy(tw_clip *clip) {
  if (clip) tw_arena_destroy(clip->arena);
}

float tw_clip_duration(const tw_clip *clip) {
  return clip->duration;
}

size_t tw_clip_size(const tw_clip *clip) {
  return tw_arena_size(clip->arena);
}

bool tw_clip_moves(const tw_clip *clip, uint32_t node) {
  return (clip->moves[node] & ~(1u << TW_WEIGHTS)) != 0;
}

bool tw_clip_changes(const tw_clip *clip, uint32_t node, tw_path path) {
  return (clip->moves[node] & 1u << path) != 0;
}

uint32_t tw_clip_find(const tw_clip *clip, uint32_t node, tw_path path) {
  if (!tw_clip_changes(clip, node, path)) return TW_NO_INDEX;
  uint32_t i = 0;
  while (clip->tracks[i].node != node || clip->tracks[i].path != path) i++;
  return i;
}

uint32_t tw_clip_width(const tw_clip *clip, uint32_t track) {
  return clip->tracks[track].width;
}
