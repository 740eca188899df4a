/* Clips of other models: by name, or carried over. */
#include "borrowed_clips.h"

#include "models.h"
#include "near_names.h"
#include "stored.h"

#include <stdio.h>
#include <string.h>

/* ---- finding --------------------------------------------------------------------------------- */

/* What a name may mean that begins as `{model id}/{name}` does, and is none. */
static const char *hint_of(const char *name, size_t length) {
  enum { ID = API_ID_TEXT - 1 };
  bool begins = strspn(name, "0123456789abcdefABCDEF") == ID && (length == ID || name[ID] == '/');
  return begins ? " a clip of another model is {model id}/{name}, the id in lower case;" : "";
}

api_outcome api_clip_fail_absent(api_call *call, const tw_model *model, const char *lender, const char *name,
                                 size_t length) {
  char buffer[24];
  api_near near = {.name = name, .length = length};
  for (uint32_t i = 0; i < model->clip_count; i++)
    api_near_consider(&near, tw_model_clip_name(model, i, buffer));
  char list[160] = "";
  size_t used = 0;
  for (uint32_t i = 0; i < model->clip_count; i++) {
    int more = snprintf(list + used, sizeof list - used, "%s%s", i ? ", " : "",
                        tw_model_clip_name(model, i, buffer));
    if (more < 0 || (size_t)more >= sizeof list - used) break;
    used += (size_t)more;
  }
  list[used] = '\0';
  return api_fail_with(call, 404, "no clip%s%s is called \"%.*s\";%s%s %s%s", lender ? " of model " : "",
                       lender ? lender : "", length < 60 ? (int)length : 60, name, hint_of(name, length),
                       api_near_print(&near, " ").text,
                       model->clip_count ? "there are: " : "the model has no clips", list);
}

api_outcome api_clip_find_borrowed(api_call *call, const char *name, size_t length, api_borrowed *out) {
  *out = (api_borrowed){0};
  memcpy(out->lender, name, API_ID_TEXT - 1);
  name += API_ID_TEXT;
  length -= API_ID_TEXT;
  api_outcome outcome = api_model_look(call, out->lender);
  if (outcome == API_CONTINUE) outcome = api_model_take(call, out->lender, NULL, &out->entry);
  if (outcome != API_DONE) return outcome;
  const tw_model *lender = api_entry_value(out->entry);
  out->index = tw_model_find_clip(lender, name, length);
  if (out->index != TW_NO_INDEX) return API_DONE;
  api_clip_fail_absent(call, lender, out->lender, name, length);
  return API_CONTINUE;
}

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

bool api_note_missing(api_notes *notes, const char *node) {
  tw_text text = {0};
  tw_text_add(&text, "the clip moves a node that the model does not have: ");
  tw_text_add(&text, node);
  const char *kept = api_text_move(&text, notes->arena);
  return kept && api_note(notes, kept);
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
  const char *kept = api_text_move(&text, notes->arena);
  return kept && api_note(notes, kept);
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

static uint32_t node_of_name(const tw_model *lender, uint32_t node, const tw_model *model) {
  char buffer[24];
  const char *name = tw_model_node_name(lender, node, buffer);
  return tw_model_find_node(model, name, strlen(name));
}

/* Adds a track of a lender's to *out, which has room, on the node of its name; a note tells where there is
 * none, or where it is of another kind. False without memory. */
static bool add_track(const tw_model *lender, const tw_track_keys *track, const tw_model *model,
                      uint32_t node, api_notes *notes, tw_track_keys *tracks, uint32_t *count) {
  char buffer[24];
  bool fits;
  if (node == TW_NO_INDEX) return api_note_missing(notes, tw_model_node_name(lender, track->node, buffer));
  if (!api_track_check(notes, model, track, node, &fits)) return false;
  return !fits || copy_track(notes->arena, track, node, &tracks[(*count)++]);
}

/* Copies the name. False without memory. */
static bool copy_name(tw_arena *arena, const char *name, tw_clip_keys *out) {
  out->name = name ? tw_arena_text(arena, name, strlen(name)) : NULL;
  return out->name || !name;
}

/* Tells before all else where a clip moves several nodes and the model has none of these. False without
 * memory. */
static bool note_strangers(const tw_model *lender, const tw_clip_keys *keys, const tw_model *model,
                           api_notes *notes) {
  bool is_any = false, are_several = false;
  for (uint32_t i = 0; i < keys->track_count && !is_any; i++) {
    are_several |= keys->tracks[i].node != keys->tracks[0].node;
    is_any = node_of_name(lender, keys->tracks[i].node, model) != TW_NO_INDEX;
  }
  return is_any || !are_several ||
         api_note(notes, "the model has none of the nodes that the clip moves: retarget=auto carries a clip "
                         "over to another skeleton");
}

bool api_clip_rename(const tw_model *lender, const tw_clip_keys *keys, const tw_model *model,
                     api_notes *notes, tw_clip_keys *out) {
  tw_track_keys *tracks = tw_arena_alloc(notes->arena, keys->track_count, sizeof *tracks);
  bool *is_noted = tw_arena_alloc(notes->arena, lender->node_count, sizeof *is_noted);
  if (!tracks || !is_noted) return false;
  *out = (tw_clip_keys){.tracks = tracks};
  if (!note_strangers(lender, keys, model, notes)) return false;
  for (uint32_t i = 0; i < keys->track_count; i++) {
    const tw_track_keys *track = &keys->tracks[i];
    uint32_t node = node_of_name(lender, track->node, model);
    if (is_noted[track->node]) continue;
    is_noted[track->node] = node == TW_NO_INDEX;
    if (!add_track(lender, track, model, node, notes, tracks, &out->track_count)) return false;
  }
  return copy_name(notes->arena, keys->name, out);
}

/* ---- carried over ---------------------------------------------------------------------------- */

/* Adds the morph weights. False without memory. */
static bool add_weights(const tw_model *lender, const tw_clip_keys *keys, const tw_model *model,
                        api_notes *notes, tw_clip_keys *out) {
  size_t count = (size_t)out->track_count + keys->track_count;
  tw_track_keys *tracks = tw_arena_alloc(notes->arena, count, sizeof *tracks);
  if (!tracks) return false;
  if (out->track_count) memcpy(tracks, out->tracks, out->track_count * sizeof *tracks);
  out->tracks = tracks;
  for (uint32_t i = 0; i < keys->track_count; i++) {
    const tw_track_keys *track = &keys->tracks[i];
    if (track->path != TW_WEIGHTS) continue;
    uint32_t node = node_of_name(lender, track->node, model);
    if (!add_track(lender, track, model, node, notes, tracks, &out->track_count)) return false;
  }
  return true;
}

bool api_clip_carry(const tw_model *lender, const tw_clip_keys *keys, const tw_model *model,
                    const tw_retarget_wish *retarget, uint32_t max_keys, api_notes *notes,
                    const char **report, tw_clip_keys *out, api_fault *fault) {
  api_carried carried;
  if (!api_clip_retarget(lender, keys, model, retarget, max_keys, notes->arena, &carried, fault))
    return false;
  *out = carried.keys;
  bool is_whole = copy_name(notes->arena, keys->name, out) && add_weights(lender, keys, model, notes, out);
  for (uint32_t i = 0; is_whole && i < carried.warning_count; i++)
    is_whole = api_note(notes, carried.warnings[i]);
  *report = carried.report;
  return is_whole || api_fault_without_memory(fault);
}
