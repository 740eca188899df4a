/* Clips of other models: found, and put on a model's nodes by name or carried over to its skeleton. */
#ifndef API_BORROWED_CLIPS_H
#define API_BORROWED_CLIPS_H

#include "cache.h"
#include "call.h"
#include "tweend/model.h"
#include "tweend/retarget.h"

/* Fails with 404: the model has no clip of that name, but others. lender: the model's id where it is not that
 * of the request, else NULL. */
api_outcome api_clip_fail_absent(api_call *call, const tw_model *model, const char *lender, const char *name,
                                 size_t length);

/* A clip of another stored model. */
typedef struct api_borrowed {
  char lender[API_ID_TEXT];
  api_entry *entry; /* a reference to the model; to be released where it is not NULL */
  uint32_t index;
} api_borrowed;

/* Finds the clip of a name that api_clip_is_borrowed. API_FAILED without such a model; API_CONTINUE without
 * such a clip, with the fault of 404; a light call stalls where the model is not cached. */
api_outcome api_clip_find_borrowed(api_call *call, const char *name, size_t length, api_borrowed *out);

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

/* *fits: whether the model can play a track of another one's on its node `node`; where it cannot, a note
 * tells why. False without memory. */
bool api_track_check(api_notes *notes, const tw_model *model, const tw_track_keys *track, uint32_t node,
                     bool *fits);

/* Puts a clip of the lender on the model's nodes of the same names. Leaves out tracks of nodes that the model
 * lacks, and morph weights whose number differs. All of *out is copied to the notes' arena. False without
 * memory. */
bool api_clip_rename(const tw_model *lender, const tw_clip_keys *keys, const tw_model *model,
                     api_notes *notes, tw_clip_keys *out);

/* How near keys come to a clip that is carried over where they are not its own. */
#define API_CARRYING_TOLERANCE ((tw_tolerance){0.05 / TW_DEGREES, 1e-4})

/* Carries a clip of the lender over to the model's skeleton, but morph weights, which go by the names of
 * nodes. All is copied to the notes' arena. max_keys: of a track. *report: the JSON of `retarget` in the
 * answer to /tracks. False: the fault says why: 422 for a map that names other nodes, and for skeletons that
 * do not match. A VRMA's clip without tracks moves a face alone, and needs no skeleton. */
bool api_clip_carry(const tw_model *lender, const tw_clip_keys *keys, const tw_model *model,
                    const tw_retarget_wish *retarget, uint32_t max_keys, api_notes *notes,
                    const char **report, tw_clip_keys *out, api_fault *fault);

#endif
