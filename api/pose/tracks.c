/* Diagnostics of a clip's rotation tracks: gimbal lock, wraps, sign flips, steps that slerp would shorten;
 * the key times of all tracks; and a report on the clip as a whole. */
#include "clips.h"
#include "handlers.h"
#include "models.h"
#include "node_names.h"
#include "pose_request.h"
#include "response_cache.h"
#include "tweend/clip_report.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* By tw_key_form; plain values of a rotation are quaternions. */
static const char *const kind_names[] = {"quaternion", "quaternion", "euler", "axis-angle"};
static const char *const axis_names[] = {"x", "y", "z"};

/* Prints a number in single precision, in which every processor's libm agrees. Finite values stay finite: the
 * speed between keys at times 0 and 1e-40 fits no float. */
static void member_number(tw_text *text, const char *name, double value) {
  tw_member_float(text, name, isfinite(value) ? (float)fmin(value, (double)FLT_MAX) : (float)value);
}

/* Prints how near the path comes to gimbal lock, in the track's own order and in every order. */
static void print_gimbal(tw_text *text, const tw_track_report *report) {
  const tw_gimbal *own = &report->gimbals[report->order];
  tw_member_open(text, "gimbal", "{");
  tw_member_string(text, "order", tw_euler_order_names[report->order]);
  member_number(text, "time", own->time);
  member_number(text, "cos_middle", own->cos_middle);
  member_number(text, "amplification", own->amplification);
  tw_member_string(text, "lost_axis", axis_names[report->lost_axis]);
  tw_text_add(text, "}");
  tw_member_open(text, "orders", "{");
  for (int order = 0; order < TW_EULER_ORDERS; order++)
    member_number(text, tw_euler_order_names[order], report->gimbals[order].cos_middle);
  tw_text_add(text, "}");
  tw_member_string(text, "best_order", tw_euler_order_names[report->best_order]);
}

static void print_motion(tw_text *text, const tw_track_report *report) {
  member_number(text, "start", report->start);
  member_number(text, "duration", report->duration);
  member_number(text, "total_degrees", report->total_angle * TW_DEGREES);
  member_number(text, "largest_step_degrees", report->largest_step * TW_DEGREES);
  tw_member_count(text, "largest_step_key", report->largest_key);
  member_number(text, "peak_degrees_per_second", report->peak_velocity * TW_DEGREES);
  member_number(text, "peak_time", report->peak_time);
  tw_member_count(text, "sign_flips", report->sign_flips);
  tw_member_count(text, "non_unit_keys", report->non_unit_keys);
  tw_member_count(text, "duplicate_times", report->duplicate_times);
  tw_member_count(text, "half_turns", report->half_turns);
  tw_member_count(text, "steps_over_180", report->long_steps);
  tw_member_count(text, "euler_wraps", report->euler_wraps);
  if (!report->has_stray) return;
  tw_member_open(text, "slerp_stray", "{");
  member_number(text, "degrees", report->stray_angle * TW_DEGREES);
  member_number(text, "time", report->stray_time);
  tw_text_add(text, "}");
}

/* Prints a track's keys; leaves its object open. */
static void print_keys(tw_text *text, const tw_model *model, const tw_track_keys *keys) {
  tw_text_element(text);
  tw_text_add(text, "{");
  api_node_name_member(text, "node", model, keys->node);
  tw_member_string(text, "path", tw_path_names[keys->path]);
  if (keys->path == TW_ROTATION) tw_member_string(text, "kind", kind_names[keys->form]);
  tw_member_string(text, "interpolation", tw_interpolation_names[keys->interpolation]);
  tw_member_count(text, "keys", keys->key_count);
  tw_member_floats(text, "times", keys->times, keys->key_count);
}

static void print_rotation(tw_text *text, const tw_model *model, const tw_track_keys *keys,
                           const tw_track_report *report) {
  print_keys(text, model, keys);
  print_motion(text, report);
  print_gimbal(text, report);
  tw_member_open(text, "warnings", "[");
  for (uint32_t i = 0; i < report->warning_count; i++) {
    tw_text_element(text);
    tw_text_string(text, report->warnings[i]);
  }
  tw_text_add(text, "]}");
}

/* Steps between two keys, so that following all rotation tracks of a clip takes about a second, however many
 * keys there are. */
static uint32_t steps_most(const tw_clip_keys *clip) {
  enum { ALL_STEPS = 1 << 16, STEPS_LEAST = 2 };
  uint64_t keys = 1;
  for (uint32_t i = 0; i < clip->track_count; i++)
    if (clip->tracks[i].path == TW_ROTATION) keys += clip->tracks[i].key_count;
  uint64_t steps = ALL_STEPS / keys;
  return steps < STEPS_LEAST ? STEPS_LEAST : steps > TW_TRACK_STEPS ? TW_TRACK_STEPS : (uint32_t)steps;
}

/* ---- the clip as a whole --------------------------------------------------------------------- */

typedef struct tracks_source {
  const tw_model *model;
  const tw_clip_keys *clip;
  const tw_clip *made; /* in place of `clip`: one without keys; or NULL */
  uint32_t max_keys;   /* of a track of it */
  const char *name;
  const char *retarget, *layers; /* of a borrowed clip and of layers, as in api_clip; else NULL */
  uint32_t root_node;            /* whose motion is taken out; TW_NO_INDEX: of none */
  unsigned root_axes;
  const uint32_t *feet; /* [foot_count]; NULL: found by their names */
  uint32_t foot_count;
  bool has_feet;   /* the request names them */
  char buffer[24]; /* of a name that is made */
} tracks_source;

static void print_loop_and_root(tw_text *text, const tw_model *model, const tw_clip_report *report) {
  tw_member_open(text, "loop", "{");
  member_number(text, "angle", report->loop.angle * TW_DEGREES);
  member_number(text, "distance", report->loop.distance);
  api_node_name_member(text, "node", model, report->loop.node);
  member_number(text, "speed", report->loop.speed * TW_DEGREES);
  tw_text_add(text, "}");
  tw_member_open(text, "root", "{");
  api_node_name_member(text, "node", model, report->root.node);
  member_number(text, "distance", report->root.distance);
  member_number(text, "speed", report->root.speed);
  member_number(text, "turn", report->root.turn * TW_DEGREES);
  tw_text_add(text, "}");
}

static void print_contacts(tw_text *text, const tw_model *model, const tw_clip_report *report) {
  tw_member_open(text, "contacts", "[");
  for (uint32_t i = 0; i < report->contact_count; i++) {
    const tw_contact *contact = &report->contacts[i];
    tw_text_element(text);
    tw_text_add(text, "{");
    api_node_name_member(text, "node", model, contact->node);
    member_number(text, "from", contact->from);
    member_number(text, "to", contact->to);
    member_number(text, "slide", contact->slide);
    tw_text_add(text, "}");
  }
  tw_text_add(text, "]");
}

static void print_noise_and_pops(tw_text *text, const tracks_source *source, const tw_clip_report *report) {
  const tw_model *model = source->model;
  tw_member_open(text, "noise", "[");
  for (uint32_t i = 0; i < report->noise_count; i++) {
    const tw_track_keys *track = &source->clip->tracks[report->noise[i].track];
    tw_text_element(text);
    tw_text_add(text, "{");
    api_node_name_member(text, "node", model, track->node);
    tw_member_string(text, "path", tw_path_names[track->path]);
    member_number(text, "rms", report->noise[i].rms * (track->path == TW_ROTATION ? TW_DEGREES : 1));
    tw_text_add(text, "}");
  }
  tw_text_add(text, "]");
  tw_member_open(text, "pops", "[");
  for (uint32_t i = 0; i < report->pop_count; i++) {
    tw_text_element(text);
    tw_text_add(text, "{");
    api_node_name_member(text, "node", model, report->pops[i].node);
    member_number(text, "time", report->pops[i].time);
    member_number(text, "angle", report->pops[i].angle * TW_DEGREES);
    tw_text_add(text, "}");
  }
  tw_text_add(text, "]");
}

/* Tells where contacts are not looked for: none are then listed, whatever the clip does. */
static void print_warnings(tw_text *text, const tw_clip_report *report) {
  static const char no_feet[] =
      "contacts are not looked for: the model has no humanoid map with feet, and no node with \"foot\" or "
      "\"ankle\" in its name; feet= names them";
  static const char no_height[] = "contacts are not looked for: all nodes rest at one height";
  const char *warning = report->foot_count == 0 ? no_feet : report->height > 0 ? NULL : no_height;
  tw_member_open(text, "warnings", "[");
  if (warning) tw_text_string(text, warning);
  tw_text_add(text, "]");
}

static tw_status print_whole(tw_text *text, const tracks_source *source, tw_error *error) {
  const tw_model *model = source->model;
  tw_arena *arena = tw_arena_create();
  if (!arena) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  tw_clip_report report;
  bool has_root = source->root_node != TW_NO_INDEX;
  const tw_inspect_job job = {.keys = source->clip,
                              .nodes = model->nodes,
                              .order = model->node_order,
                              .node_count = model->node_count,
                              .foot_count = source->foot_count,
                              .feet = source->feet,
                              .without_root = has_root ? source->made : NULL,
                              .root = source->root_node};
  tw_status status = tw_clip_inspect(&job, arena, &report, error);
  if (status == TW_OK) {
    tw_member_open(text, "report", "{");
    print_loop_and_root(text, model, &report);
    tw_text_member(text, "still");
    api_node_names_print(model, report.still, report.still_count, text);
    tw_text_member(text, "feet");
    api_node_names_print(model, report.feet, report.foot_count, text);
    print_contacts(text, model, &report);
    print_noise_and_pops(text, source, &report);
    print_warnings(text, &report);
    tw_text_add(text, "}");
  }
  tw_arena_destroy(arena);
  return status;
}

/* Prints what the root motion comes to, from the first time to the last. */
static void print_root(tw_text *text, const tracks_source *source) {
  tw_trs end;
  tw_text axes = {0};
  char axis_list[16] = "";
  tw_clip_root_at(source->made, tw_clip_duration(source->made), &end);
  api_root_axes_print(source->root_axes, &axes);
  if (!axes.failed && axes.size < sizeof axis_list) memcpy(axis_list, axes.data, axes.size);
  tw_text_deinit(&axes);
  tw_member_open(text, "root_motion", "{");
  api_node_name_member(text, "node", source->model, source->root_node);
  tw_member_string(text, "axes", axis_list);
  tw_member_floats(text, "translation", end.translation, 3);
  tw_member_floats(text, "rotation", end.rotation, 4);
  tw_text_add(text, "}");
}

static tw_status print_clip(tw_text *text, const tracks_source *source, tw_error *error) {
  const tw_model *model = source->model;
  const tw_clip_keys *clip = source->clip;
  uint32_t steps = steps_most(clip);
  tw_text_add(text, "{");
  tw_member_string(text, "clip", source->name);
  tw_member_open(text, "tracks", "[");
  for (uint32_t i = 0; i < clip->track_count; i++) {
    if (clip->tracks[i].path != TW_ROTATION) continue;
    tw_track_report report;
    tw_status status = tw_track_inspect(&clip->tracks[i], steps, &report, error);
    if (status != TW_OK) return status;
    print_rotation(text, model, &clip->tracks[i], &report);
  }
  tw_text_add(text, "]");
  tw_member_open(text, "other_tracks", "[");
  for (uint32_t i = 0; i < clip->track_count; i++) {
    if (clip->tracks[i].path == TW_ROTATION) continue;
    print_keys(text, model, &clip->tracks[i]);
    tw_text_add(text, "}");
  }
  tw_text_add(text, "]");
  tw_status status = print_whole(text, source, error);
  if (source->root_node != TW_NO_INDEX) print_root(text, source);
  if (source->retarget) {
    tw_text_member(text, "retarget");
    tw_text_add(text, source->retarget);
  }
  if (source->layers) {
    tw_text_member(text, "layers");
    tw_text_add(text, source->layers);
  }
  tw_text_add(text, "}\n");
  return status;
}

/* ---- the answer ------------------------------------------------------------------------------ */

/* Finds keys that follow a clip without keys, and prints those. */
static tw_status print_made(tw_text *out, const tracks_source *source, tw_error *error) {
  tw_arena *arena = tw_arena_create();
  tw_clip_keys keys;
  tw_tolerance reached;
  tw_status status = arena ? api_clip_find_keys(source->made, source->max_keys, arena, &keys, &reached, error)
                           : tw_fail(error, TW_NO_MEMORY, "out of memory");
  tracks_source plain = *source;
  plain.clip = &keys;
  if (status == TW_OK) status = print_clip(out, &plain, error);
  tw_arena_destroy(arena);
  return status;
}

static bool print_report(void *context, tw_text *out, api_fault *fault) {
  const tracks_source *source = context;
  return (source->made ? print_made : print_clip)(out, source, &fault->error) == TW_OK ||
         api_fault_complete(fault);
}

/* The parameters as text; NULL without memory. */
static const char *print_canonical(api_call *call, const api_clip_choices *choices,
                                   const tracks_source *source) {
  tw_text text = {0};
  tw_text_add(&text, "clip=");
  const api_clip_terms *terms = &choices->terms;
  if ((choices->list && choices->list[0].lender[0]) || terms->root.is_on || terms->retarget.is_auto)
    api_clips_print(choices, &text);
  else
    tw_text_count(&text, api_clips_get(choices, 0).index);
  if (source->has_feet) tw_text_add(&text, "&feet=");
  for (uint32_t i = 0; source->has_feet && i < source->foot_count; i++) {
    tw_text_count(&text, source->feet[i]);
    tw_text_add(&text, ",");
  }
  return api_text_move(&text, call->arena);
}

/* The feet that are asked for; else those of the humanoid map. */
static api_outcome choose_feet(api_call *call, const api_clip_terms *terms, tracks_source *source) {
  const tw_model *model = source->model;
  const char *feet = terms->retarget.holds_feet ? NULL : api_query_get(&call->query, "feet");
  source->has_feet = feet;
  if (feet && strcmp(feet, "hold") == 0 && tw_model_find_node(model, feet, strlen(feet)) == TW_NO_INDEX)
    return api_fail_with(call, 400, "feet=hold goes with retarget=auto");
  if (feet) return api_nodes_choose(call, model, feet, &source->feet, &source->foot_count);
  if (!model->humanoid || model->humanoid[TW_BONE_FOOT] == TW_NO_INDEX ||
      model->humanoid[TW_BONE_FOOT + 1] == TW_NO_INDEX)
    return API_DONE;
  source->feet = &model->humanoid[TW_BONE_FOOT];
  source->foot_count = 2;
  return API_DONE;
}

/* Finds the clip: the model's own; or, compiled, which *entry then holds, a mixed or borrowed one. */
static api_outcome take_clip(api_call *call, const api_clip_choices *choices, tracks_source *source,
                             api_entry **entry) {
  const tw_model *model = source->model;
  if (choices->count == 0 && model->clip_count == 0)
    return api_fail_with(call, 404, "the model has no clips");
  if (choices->count != 1) return api_fail_with(call, 400, "the tracks of one clip are inspected");
  api_clip_choice choice = api_clips_get(choices, 0);
  if (!choice.lender[0] && !api_clip_is_mixed(model, choice.index) && !choices->terms.root.is_on) {
    source->clip = &model->clips[choice.index];
    source->name = tw_model_clip_name(model, choice.index, source->buffer);
    return API_DONE;
  }
  api_outcome outcome = api_clip_take(call, model, true, choices, -1, entry);
  if (outcome != API_DONE) return outcome;
  const api_clip *clip = api_entry_value(*entry);
  api_call_warn(call, clip->warnings, clip->warning_count);
  source->made = clip->is_made ? clip->compiled : NULL;
  source->clip = api_clip_keys(clip, model, choice.index);
  source->max_keys = api_clip_keys_max(call);
  source->name = clip->name;
  source->retarget = clip->retarget;
  source->layers = clip->layers;
  source->root_node = clip->has_root ? clip->root_node : TW_NO_INDEX;
  source->root_axes = choices->terms.root.axes;
  return API_DONE;
}

static api_outcome reply(api_call *call, const api_clip_choices *choices, tracks_source *source) {
  const char *canonical = print_canonical(call, choices, source);
  if (!canonical) return api_fail_without_memory(call);
  tw_text key = {0};
  tw_text_add(&key, call->id);
  tw_text_add(&key, "/tracks?");
  tw_text_add(&key, canonical);
  const char *kept = api_text_move(&key, call->arena);
  if (!kept) return api_fail_without_memory(call);
  return api_response_reply(call, kept, "tracks.json", canonical, print_report, source);
}

static api_outcome answer_tracks(api_call *call, const tw_model *model) {
  api_clip_choices choices;
  api_clip_terms terms;
  api_entry *entry = NULL;
  tracks_source source = {.model = model, .root_node = TW_NO_INDEX};
  const char *text = api_query_get(&call->query, "clip");
  api_outcome outcome = api_clip_terms_read(call, true, &terms);
  if (outcome == API_DONE) outcome = api_clips_choose(call, model, text, 1, &terms, &choices);
  if (outcome == API_DONE) outcome = take_clip(call, &choices, &source, &entry);
  if (outcome == API_DONE) outcome = choose_feet(call, &terms, &source);
  if (outcome == API_DONE) outcome = reply(call, &choices, &source);
  api_entry_release(entry);
  return outcome;
}

api_outcome api_get_tracks(api_call *call) {
  api_entry *entry;
  api_outcome outcome = api_model_take(call, call->id, NULL, &entry);
  if (outcome != API_DONE) return outcome;
  outcome = answer_tracks(call, api_entry_value(entry));
  api_entry_release(entry);
  return outcome;
}
