/* Clips of other models: put on a model's nodes by name or carried over to its skeleton, and what VRMAs move
 * of a face (tweend/face.h). */
#ifndef API_BORROWED_CLIPS_H
#define API_BORROWED_CLIPS_H

#include "call.h"
#include "tweend/model.h"
#include "tweend/retarget.h"

/* Sentences about a clip, each once; zeroed but for the arena. */
typedef struct api_notes {
  tw_arena *arena; /* holds them */
  uint32_t count, room;
  const char **list; /* [count] */
} api_notes;

/* Adds a sentence that lives as long as the arena. False without memory. */
bool api_note(api_notes *notes, const char *sentence);
/* Notes that a clip moves a node that the model lacks. */
bool api_note_missing(api_notes *notes, const char *node);

/* Takes what a track moves: its path of a node, which is a bit of moved[node]. *is_free: whether no track has
 * taken it; else a note tells of the nodes of one name. name: of the node. False without memory. */
bool api_track_take(api_notes *notes, uint8_t *moved, const tw_track_keys *track, uint32_t node,
                    const char *name, bool *is_free);

/* *fits: whether the model can play a track of another one's on its node `node`; where it cannot, a note
 * tells why. False without memory. */
bool api_track_check(api_notes *notes, const tw_model *model, const tw_track_keys *track, uint32_t node,
                     bool *fits);

/* Puts a clip of the lender on the model's nodes: its face by expressions (api_face_split_off), all else
 * carried over (api_clip_carry) or, without retarget->is_auto, on the nodes of the same names
 * (api_nodes_by_name). The latter leaves out tracks of nodes that the model lacks, and morph weights whose
 * number differs. All of *out is in the notes' arena. *report: as of api_clip_carry, else left alone. False:
 * the fault says why. */
bool api_clip_bring(const tw_model *lender, const tw_clip_keys *keys, const tw_model *model,
                    const tw_retarget_wish *retarget, uint32_t max_keys, api_notes *notes,
                    const char **report, tw_clip_keys *out, api_fault *fault);

/* How near keys come to a clip that is carried over where they are not its own. */
#define API_CARRYING_TOLERANCE ((tw_tolerance){0.05 / TW_DEGREES, 1e-4})

/* Carries a clip of the lender over to the model's skeleton, but morph weights, which go by the names of
 * nodes. All is copied to the notes' arena. max_keys: of a track. *report: the JSON of `retarget` in the
 * answer to /tracks. False: the fault says why: 422 for a map that names other nodes, and for skeletons that
 * do not match. A VRMA's clip without tracks moves a face alone, and needs no skeleton. */
bool api_clip_carry(const tw_model *lender, const tw_clip_keys *keys, const tw_model *model,
                    const tw_retarget_wish *retarget, uint32_t max_keys, api_notes *notes,
                    const char **report, tw_clip_keys *out, api_fault *fault);

/* ---- faces ---------------------------------------------------------------------------------- */

/* A clip of another model, in two parts. */
typedef struct api_face_split {
  tw_clip_keys others; /* of the lender: without what moves its face, where the model has one. A view */
  tw_clip_keys face;   /* of the model; all of it lives in the notes' arena */
} api_face_split;

/* Splits the clip. Notes what the model's face does not show of it. max_keys: of a track. False: the fault
 * says why. */
bool api_face_split_off(const tw_model *lender, const tw_clip_keys *keys, const tw_model *model,
                        uint32_t max_keys, api_notes *notes, api_face_split *out, api_fault *fault);

/* Adds the tracks of a face to *keys, whose own tracks of the same parts they replace. Both move nodes of one
 * model, which has node_count. False without memory. */
bool api_face_add(const tw_clip_keys *face, uint32_t node_count, tw_arena *arena, tw_clip_keys *keys);

/* The morph weights of the model's nodes at rest, [nodes]; NULL in it: 0. NULL without memory. */
const float **api_rest_weights(const tw_model *model, tw_arena *arena);

#endif
