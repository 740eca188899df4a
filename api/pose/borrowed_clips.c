/* Clips of other models: by name, or carried over; faces of VRMAs. */
#include "borrowed_clips.h"

#include "answer.h"
#include "models.h"
#include "near_names.h"
#include "node_names.h"
#include "stored.h"
#include "tweend/json_print.h"

#include <stdio.h>
#include <string.h>

/* ---- notes ----------------------------------------------------------------------------------- */

bool api_note(api_notes *notes, const char *sentence) {
  enum { NOTES_MOST = 256 };
  static const char more[] = "there are more warnings of this kind";
  if (notes->count == NOTES_MOST) return true;
  for (uint32_t i = 0; i < notes->count; i++)
    if (strcmp(notes->list[i], sentence) == 0) return true;
  if (notes->count == notes->room) {
    uint32_t room = notes->room ? 2 * notes->room : 4;
    const char **list = tw_arena_alloc(notes->arena, room, sizeof *list);
    if (!list) return false;
    if (notes->count) memcpy(list, notes->list, notes->count * sizeof *list);
    notes->list = list;
    notes->room = room;
  }
  notes->list[notes->count] = notes->count + 1 < NOTES_MOST ? sentence : more;
  notes->count++;
  return true;
}

/* Adds a sentence, and frees the text. False without memory. */
static bool note_text(api_notes *notes, tw_text *text) {
  const char *kept = api_text_move(text, notes->arena);
  return kept && api_note(notes, kept);
}

bool api_note_missing(api_notes *notes, const char *node) {
  tw_text text = {0};
  tw_text_add(&text, "the clip moves a node that the model does not have: ");
  tw_text_add(&text, node);
  return note_text(notes, &text);
}

bool api_track_take(api_notes *notes, uint8_t *moved, const tw_track_keys *track, uint32_t node,
                    const char *name, bool *is_free) {
  uint8_t path = (uint8_t)(1 << track->path);
  *is_free = !(moved[node] & path);
  moved[node] |= path;
  if (*is_free) return true;
  tw_text text = {0};
  tw_text_add(&text, "the clip moves more nodes of one name than the model has: ");
  tw_text_add(&text, name);
  return note_text(notes, &text);
}

/* ---- by name --------------------------------------------------------------------------------- */

bool api_track_check(api_notes *notes, const tw_model *model, const tw_track_keys *track, uint32_t node,
                     bool *fits) {
  uint32_t mesh = model->nodes[node].mesh,
           targets = mesh == TW_NO_INDEX ? 0 : model->meshes[mesh].morph_count;
  *fits = track->path != TW_WEIGHTS || targets == track->width;
  if (*fits) return true;
  char buffer[24];
  tw_text text = {0};
  tw_text_add(&text, "the clip moves ");
  tw_text_count(&text, track->width);
  tw_text_add(&text, tw_plural(track->width, " morph weight of ", " morph weights of "));
  tw_text_add(&text, tw_model_node_name(model, node, buffer));
  tw_text_add(&text, ", which has ");
  tw_text_count(&text, targets);
  tw_text_add(&text, " in the model: left out");
  return note_text(notes, &text);
}

/* Copies an array of a borrowed clip, so that the lender may be released. NULL stays NULL. */
static const void *copy_array(tw_arena *arena, const void *array, size_t count, size_t size) {
  void *copy = array ? tw_arena_alloc(arena, count, size) : NULL;
  if (copy && count) memcpy(copy, array, count * size);
  return copy;
}

static bool copy_track(tw_arena *arena, const tw_track_keys *from, uint32_t node, tw_track_keys *to) {
  *to = *from;
  to->node = node;
  to->preserved = NULL; /* it may refer to other parts of the lender's file */
  size_t parts = from->interpolation == TW_CUBICSPLINE ? 3 : 1;
  to->times = copy_array(arena, from->times, from->key_count, sizeof *from->times);
  to->values = copy_array(arena, from->values, from->key_count, parts * from->width * sizeof *from->values);
  to->angles = copy_array(arena, from->angles, from->key_count, from->width * sizeof *from->angles);
  return (!from->times || to->times) && (!from->values || to->values) && (!from->angles || to->angles);
}

/* Tracks of a clip on their way to the nodes of another model. */
typedef struct renaming {
  const tw_model *lender, *model;
  const uint32_t *map; /* as of api_nodes_by_name */
  uint8_t *moved;      /* as of api_track_take */
  api_notes *notes;
  tw_track_keys *tracks; /* [count], with room */
  uint32_t count;
} renaming;

/* Begins with the tracks of *out, and room for as many more. False without memory. */
static bool renaming_init(renaming *r, const tw_model *lender, const tw_model *model, uint32_t more,
                          const tw_clip_keys *out, api_notes *notes) {
  *r = (renaming){lender,
                  model,
                  api_nodes_by_name(lender, model, notes->arena),
                  tw_arena_alloc(notes->arena, model->node_count, 1),
                  notes,
                  tw_arena_alloc(notes->arena, (size_t)out->track_count + more, sizeof *r->tracks),
                  out->track_count};
  if (!r->map || !r->moved || !r->tracks) return false;
  if (r->count) memcpy(r->tracks, out->tracks, r->count * sizeof *r->tracks);
  return true;
}

/* Adds a track on the node of its name; a note tells where there is none, or where it is of another kind.
 * False without memory. */
static bool add_track(renaming *r, const tw_track_keys *track) {
  char buffer[24];
  uint32_t node = r->map[track->node];
  const char *name = tw_model_node_name(r->lender, track->node, buffer);
  bool fits, is_free = true;
  if (node == TW_NO_INDEX) return api_note_missing(r->notes, name);
  if (!api_track_check(r->notes, r->model, track, node, &fits)) return false;
  if (fits && !api_track_take(r->notes, r->moved, track, node, name, &is_free)) return false;
  return !fits || !is_free || copy_track(r->notes->arena, track, node, &r->tracks[r->count++]);
}

/* Copies the name. False without memory. */
static bool copy_name(tw_arena *arena, const char *name, tw_clip_keys *out) {
  out->name = name ? tw_arena_text(arena, name, strlen(name)) : NULL;
  return out->name || !name;
}

/* Tells before all else where a clip moves several nodes and the model has none of these. False without
 * memory. */
static bool note_strangers(const renaming *r, const tw_clip_keys *keys) {
  bool is_any = false, are_several = false;
  for (uint32_t i = 0; i < keys->track_count && !is_any; i++) {
    are_several |= keys->tracks[i].node != keys->tracks[0].node;
    is_any = r->map[keys->tracks[i].node] != TW_NO_INDEX;
  }
  return is_any || !are_several ||
         api_note(r->notes,
                  "the model has none of the nodes that the clip moves: retarget=auto carries a clip "
                  "over to another skeleton");
}

/* Puts a clip on the nodes of the same names. False without memory. */
static bool rename_nodes(const tw_model *lender, const tw_clip_keys *keys, const tw_model *model,
                         api_notes *notes, tw_clip_keys *out) {
  renaming r;
  bool *is_noted = tw_arena_alloc(notes->arena, lender->node_count, sizeof *is_noted);
  *out = (tw_clip_keys){0};
  if (!is_noted || !renaming_init(&r, lender, model, keys->track_count, out, notes)) return false;
  if (!note_strangers(&r, keys)) return false;
  for (uint32_t i = 0; i < keys->track_count; i++) {
    const tw_track_keys *track = &keys->tracks[i];
    if (is_noted[track->node]) continue;
    is_noted[track->node] = r.map[track->node] == TW_NO_INDEX;
    if (!add_track(&r, track)) return false;
  }
  out->tracks = r.tracks;
  out->track_count = r.count;
  return copy_name(notes->arena, keys->name, out);
}

/* ---- carried over: the job ------------------------------------------------------------------- */

/* Marks the joints of skins and the bones of the humanoid map. *out stays NULL where the model has neither:
 * then any node is a bone. False without memory. */
static bool mark_bones(const tw_model *model, tw_arena *arena, const bool **out) {
  *out = NULL;
  if (model->skin_count == 0 && !model->humanoid) return true;
  bool *is_bone = tw_arena_alloc(arena, model->node_count, sizeof *is_bone);
  if (!is_bone) return false;
  for (uint32_t i = 0; i < model->skin_count; i++)
    for (uint32_t j = 0; j < model->skins[i].joint_count; j++) is_bone[model->skins[i].joints[j]] = true;
  for (uint32_t i = 0; model->humanoid && i < TW_BONES; i++)
    if (model->humanoid[i] != TW_NO_INDEX) is_bone[model->humanoid[i]] = true;
  *out = is_bone;
  return true;
}

static bool make_skeleton(const tw_model *model, tw_arena *arena, tw_skeleton *out) {
  *out = (tw_skeleton){.nodes = model->nodes,
                       .order = model->node_order,
                       .node_count = model->node_count,
                       .humanoid = model->humanoid};
  return mark_bones(model, arena, &out->is_bone);
}

static bool find_mapped(const tw_model *model, const char *name, const char *whose, uint32_t *out,
                        tw_error *error) {
  *out = tw_model_find_node(model, name, strlen(name));
  if (*out != TW_NO_INDEX) return true;
  tw_fail(error, TW_INVALID, "map: no node of %s is called \"%.60s\"%s", whose, name,
          api_node_names_near(model, name, strlen(name)).text);
  return false;
}

static bool find_pairs(const tw_model *lender, const tw_model *model, const tw_retarget_wish *retarget,
                       tw_bone_pair *out, tw_error *error) {
  for (uint32_t i = 0; i < retarget->pair_count; i++) {
    const tw_bone_names_pair *pair = &retarget->pairs[i];
    out[i].target = TW_NO_INDEX;
    if (!find_mapped(lender, pair->source, "the clip's model", &out[i].source, error)) return false;
    if (pair->target && !find_mapped(model, pair->target, "the model", &out[i].target, error)) return false;
  }
  return true;
}

/* Adds the morph weights. False without memory. */
static bool add_weights(const tw_model *lender, const tw_clip_keys *keys, const tw_model *model,
                        api_notes *notes, tw_clip_keys *out) {
  renaming r;
  uint32_t count = 0;
  for (uint32_t i = 0; i < keys->track_count; i++) count += keys->tracks[i].path == TW_WEIGHTS;
  if (count == 0) return true;
  if (!renaming_init(&r, lender, model, count, out, notes)) return false;
  for (uint32_t i = 0; i < keys->track_count; i++)
    if (keys->tracks[i].path == TW_WEIGHTS && !add_track(&r, &keys->tracks[i])) return false;
  out->tracks = r.tracks;
  out->track_count = r.count;
  return true;
}

/* ---- carried over: what is told -------------------------------------------------------------- */

static const char *print_report(const tw_model *lender, const tw_model *model, const tw_retargeted *found,
                                tw_arena *arena) {
  tw_text text = {0};
  tw_text_add(&text, "{");
  tw_member_open(&text, "bones", "[");
  for (uint32_t i = 0; i < found->bone_count; i++) {
    const tw_matched_bone *bone = &found->bones[i];
    tw_text_element(&text);
    tw_text_add(&text, "{");
    api_node_name_member(&text, "source", lender, bone->source);
    api_node_name_member(&text, "target", model, bone->target);
    tw_member_string(&text, "by", tw_match_names[bone->by]);
    tw_member_float(&text, "aligned", (float)(bone->aligned * TW_DEGREES));
    tw_text_add(&text, "}");
  }
  tw_text_add(&text, "]");
  tw_member_float(&text, "scale", (float)found->scale);
  tw_text_member(&text, "without_target");
  api_node_names_print(lender, found->without_target, found->without_target_count, &text);
  tw_text_member(&text, "without_source");
  api_node_names_print(model, found->without_source, found->without_source_count, &text);
  tw_text_add(&text, "}");
  return api_text_move(&text, arena);
}

/* The first names, and how many more there are. */
static void add_names(tw_text *text, const tw_model *model, const uint32_t *nodes, uint32_t count) {
  enum { NAMES_SHOWN = 4 };
  char buffer[24];
  uint32_t shown = count <= NAMES_SHOWN + 1 ? count : NAMES_SHOWN;
  for (uint32_t i = 0; i < shown; i++) {
    if (i > 0) tw_text_add(text, ", ");
    tw_text_add(text, tw_model_node_name(model, nodes[i], buffer));
  }
  if (shown == count) return;
  tw_text_add(text, " and ");
  tw_text_count(text, count - shown);
  tw_text_add(text, " more, which /tracks names (retarget.without_target)");
}

/* False without memory. */
static bool note_losses(const tw_model *lender, const tw_retargeted *found, bool holds_feet,
                        api_notes *notes) {
  bool is_noted = true;
  if (found->without_target_count > 0) {
    tw_text text = {0};
    tw_text_add(&text, "the clip moves bones that have no counterpart in the model: ");
    add_names(&text, lender, found->without_target, found->without_target_count);
    is_noted = note_text(notes, &text);
  }
  if (found->stance_time >= 0) {
    tw_text text = {0};
    tw_text_add(&text, "the clip's model rests folded: its pose at ");
    tw_text_float(&text, found->stance_time);
    tw_text_add(&text, " s counts as its rest pose");
    is_noted = note_text(notes, &text) && is_noted;
  }
  if (found->lost_count > 0) {
    tw_text text = {0};
    tw_text_count(&text, found->lost_count);
    tw_text_add(
        &text,
        tw_plural(
            found->lost_count,
            " translation or scale of a bone is not carried over: the bone rests otherwise in the model",
            " translations and scales of bones are not carried over: the bones rest otherwise in "
            "the model"));
    is_noted = note_text(notes, &text) && is_noted;
  }
  if (holds_feet && found->held_count == 0) {
    tw_text text = {0};
    tw_text_add(&text, "feet=hold held none: no leg has matched bones down to the foot, or no foot of the "
                       "clip touches the ground");
    is_noted = note_text(notes, &text) && is_noted;
  }
  return is_noted;
}

bool api_clip_carry(const tw_model *lender, const tw_clip_keys *keys, const tw_model *model,
                    const tw_retarget_wish *retarget, uint32_t max_keys, api_notes *notes,
                    const char **report, tw_clip_keys *out, api_fault *fault) {
  tw_arena *arena = notes->arena;
  tw_bone_pair *map = tw_arena_alloc(arena, retarget->pair_count, sizeof *map);
  tw_retarget_job job = {.keys = keys,
                         .map_count = retarget->pair_count,
                         .map = map,
                         .tolerance = API_CARRYING_TOLERANCE,
                         .max_keys = max_keys,
                         .holds_feet = retarget->holds_feet};
  if (!map || !make_skeleton(lender, arena, &job.source) || !make_skeleton(model, arena, &job.target))
    return api_fault_without_memory(fault);
  tw_retargeted found = {.scale = 1};
  if (!find_pairs(lender, model, retarget, map, &fault->error)) return api_fault_complete(fault);
  bool is_face_alone = lender->face_nodes && keys->track_count == 0;
  if (!is_face_alone && tw_retarget_run(&job, arena, &found, &fault->error) != TW_OK)
    return api_fault_complete(fault);
  *out = found.keys;
  *report = print_report(lender, model, &found, arena);
  return (*report && copy_name(arena, keys->name, out) && add_weights(lender, keys, model, notes, out) &&
          (is_face_alone || note_losses(lender, &found, retarget->holds_feet, notes))) ||
         api_fault_without_memory(fault);
}

/* ---- faces: what is told --------------------------------------------------------------------- */

typedef const char *name_at(const void *of, uint32_t index);

static const char *source_name(const void *face, uint32_t index) {
  return ((const tw_face_nodes *)face)->expressions[index].name;
}

static const char *target_name(const void *face, uint32_t index) {
  return ((const tw_face *)face)->expressions[index].name;
}

/* Notes what is lost of expressions, by their names; none: nothing. False without memory. */
static bool note_named(api_notes *notes, const char *sentence, name_at *name, const void *face,
                       const uint32_t *indices, uint32_t count) {
  if (count == 0) return true;
  tw_text text = {0};
  tw_text_add(&text, sentence);
  for (uint32_t i = 0; i < count; i++) {
    if (i > 0) tw_text_add(&text, ", ");
    tw_text_add(&text, name(face, indices[i]));
  }
  return note_text(notes, &text);
}

static bool note_lost_of_face(const tw_model *lender, const tw_model *model, const tw_face_carried *found,
                              api_notes *notes) {
  return note_named(notes, "the clip moves expressions that the model does not have: ", source_name,
                    lender->face_nodes, found->missing, found->missing_count) &&
         note_named(notes,
                    "colours and textures of materials do not follow these expressions, only morph weights: ",
                    target_name, model->face, found->materials, found->material_count) &&
         (!found->has_gaze || found->moves_gaze ||
          api_note(notes,
                   "the clip moves the gaze: the model says of no eyes and no expressions that follow"));
}

/* ---- faces: splitting ------------------------------------------------------------------------ */

const float **api_rest_weights(const tw_model *model, tw_arena *arena) {
  const float **weights = tw_arena_alloc(arena, model->node_count, sizeof *weights);
  for (uint32_t i = 0; weights && i < model->node_count; i++) {
    const tw_node *node = &model->nodes[i];
    weights[i] =
        node->weights || node->mesh == TW_NO_INDEX ? node->weights : model->meshes[node->mesh].morph_weights;
  }
  return weights;
}

/* How many morph targets each node has. NULL without memory. */
static const uint32_t *count_targets(const tw_model *model, tw_arena *arena) {
  uint32_t *counts = tw_arena_alloc(arena, model->node_count, sizeof *counts);
  for (uint32_t i = 0; counts && i < model->node_count; i++)
    if (model->nodes[i].mesh != TW_NO_INDEX) counts[i] = model->meshes[model->nodes[i].mesh].morph_count;
  return counts;
}

/* The tracks of nodes that do not stand for the face. False without memory. */
static bool take_others(const tw_model *lender, const tw_clip_keys *keys, tw_arena *arena,
                        tw_clip_keys *out) {
  tw_track_keys *tracks = tw_arena_alloc_raw(arena, keys->track_count, sizeof *tracks);
  *out = *keys;
  out->tracks = tracks;
  out->track_count = 0;
  for (uint32_t i = 0; tracks && i < keys->track_count; i++)
    if (!tw_face_has_node(lender->face_nodes, keys->tracks[i].node))
      tracks[out->track_count++] = keys->tracks[i];
  return tracks;
}

bool api_face_split_off(const tw_model *lender, const tw_clip_keys *keys, const tw_model *model,
                        uint32_t max_keys, api_notes *notes, api_face_split *out, api_fault *fault) {
  *out = (api_face_split){.others = *keys};
  if (!lender->face_nodes || !model->face || lender == model || keys->layer_count > 0) return true;
  tw_face_job job = {.keys = keys,
                     .source_node_count = lender->node_count,
                     .source = lender->face_nodes,
                     .target = model->face,
                     .skeleton = {.nodes = model->nodes,
                                  .order = model->node_order,
                                  .node_count = model->node_count,
                                  .humanoid = model->humanoid},
                     .morph_counts = count_targets(model, notes->arena),
                     .rest_weights = api_rest_weights(model, notes->arena),
                     .tolerance = API_CARRYING_TOLERANCE,
                     .max_keys = max_keys};
  tw_face_carried found;
  if (!job.morph_counts || !job.rest_weights || !take_others(lender, keys, notes->arena, &out->others))
    return api_fault_without_memory(fault);
  if (tw_face_carry(&job, notes->arena, &found, &fault->error) != TW_OK) return api_fault_complete(fault);
  out->face = found.keys;
  return note_lost_of_face(lender, model, &found, notes) || api_fault_without_memory(fault);
}

bool api_face_add(const tw_clip_keys *face, uint32_t node_count, tw_arena *arena, tw_clip_keys *keys) {
  if (face->track_count == 0) return true;
  size_t most = (size_t)keys->track_count + face->track_count;
  tw_track_keys *tracks = tw_arena_alloc_raw(arena, most, sizeof *tracks);
  uint8_t *moved = tw_arena_alloc(arena, node_count, 1); /* a bit a path */
  if (!tracks || !moved) return false;
  for (uint32_t i = 0; i < face->track_count; i++) {
    uint8_t *paths = &moved[face->tracks[i].node];
    *paths = (uint8_t)(*paths | 1 << face->tracks[i].path);
  }
  uint32_t count = 0;
  for (uint32_t i = 0; i < keys->track_count; i++)
    if (!(moved[keys->tracks[i].node] & 1 << keys->tracks[i].path)) tracks[count++] = keys->tracks[i];
  memcpy(tracks + count, face->tracks, face->track_count * sizeof *tracks);
  keys->tracks = tracks;
  keys->track_count = count + face->track_count;
  return true;
}

/* ---- how long a clip lasts ------------------------------------------------------------------- */

/* Copies rows of an array behind which the last one stands again. NULL stays NULL; false without memory. */
static bool repeat_last(tw_arena *arena, const void *rows, size_t row_size, uint32_t count, void **out) {
  char *copy = rows ? tw_arena_alloc_raw(arena, (size_t)count + 1, row_size) : NULL;
  *out = copy;
  if (!copy) return !rows;
  memcpy(copy, rows, count * row_size);
  memcpy(copy + count * row_size, (const char *)rows + (count - 1) * row_size, row_size);
  return true;
}

/* Adds a key at a time behind the last one, so that the track stands still until then. */
static bool hold_until(tw_arena *arena, float time, tw_track_keys *track) {
  bool is_cubic = track->interpolation == TW_CUBICSPLINE;
  size_t width = track->width, value_size = width * (is_cubic ? 3 : 1) * sizeof *track->values;
  void *times, *values, *angles;
  if (!repeat_last(arena, track->times, sizeof *track->times, track->key_count, &times) ||
      !repeat_last(arena, track->values, value_size, track->key_count, &values) ||
      !repeat_last(arena, track->angles, width * sizeof *track->angles, track->key_count, &angles))
    return false;
  float *last = is_cubic ? (float *)values + 3 * width * track->key_count : NULL;
  if (is_cubic) memset(last - width, 0, 2 * width * sizeof *last); /* the tangents between the two */
  ((float *)times)[track->key_count++] = time;
  track->times = times;
  track->values = values;
  track->angles = angles;
  return true;
}

/* Lets the clip last as long as it does in its own model, where tracks that last longer are left out: glTF
 * tells it by keys alone. Another key would change the way of SQUAD. False without memory. */
static bool last_until(float time, tw_arena *arena, tw_clip_keys *keys) {
  tw_track_keys *tracks = (tw_track_keys *)(uintptr_t)keys->tracks, *longest = NULL; /* made here */
  if (tw_keys_duration(keys) >= time) return true;
  for (uint32_t i = 0; i < keys->track_count; i++) {
    tw_track_keys *track = &tracks[i];
    if (track->interpolation == TW_SQUAD) continue;
    if (!longest || track->times[track->key_count - 1] > longest->times[longest->key_count - 1])
      longest = track;
  }
  return !longest || hold_until(arena, time, longest);
}

/* ---- all of a clip ---------------------------------------------------------------------------- */

bool api_clip_bring(const tw_model *lender, const tw_clip_keys *keys, const tw_model *model,
                    const tw_retarget_wish *retarget, uint32_t max_keys, api_notes *notes,
                    const char **report, tw_clip_keys *out, api_fault *fault) {
  api_face_split split;
  if (!api_face_split_off(lender, keys, model, max_keys, notes, &split, fault)) return false;
  if (retarget->is_auto) {
    if (!api_clip_carry(lender, &split.others, model, retarget, max_keys, notes, report, out, fault))
      return false;
  } else if (!rename_nodes(lender, &split.others, model, notes, out)) {
    return api_fault_without_memory(fault);
  }
  return (api_face_add(&split.face, model->node_count, notes->arena, out) &&
          last_until(tw_keys_duration(keys), notes->arena, out)) ||
         api_fault_without_memory(fault);
}
