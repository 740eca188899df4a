/* What clips of a VRMA move of a face, carried over to VRM characters. */
#include "borrowed_faces.h"

#include "answer.h"

#include <string.h>

/* ---- what is told ---------------------------------------------------------------------------- */

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
  const char *kept = api_text_move(&text, notes->arena);
  return kept && api_note(notes, kept);
}

static bool note_losses(const tw_model *lender, const tw_model *model, const tw_face_carried *found,
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

/* ---- splitting ------------------------------------------------------------------------------- */

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
  return note_losses(lender, model, &found, notes) || api_fault_without_memory(fault);
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
