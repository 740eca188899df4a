/* Requests for poses: parameters, the clip and nodes that these name, and the canonical text. */
#ifndef API_POSE_REQUEST_H
#define API_POSE_REQUEST_H

#include "clips.h"
#include "times.h"

typedef enum api_pose_as { API_AS_TRS, API_AS_MATRIX, API_AS_EULER, API_AS_AXIS_ANGLE } api_pose_as;

/* In the order of the route's offers. */
typedef enum api_pose_form { API_POSE_JSON, API_POSE_NDJSON, API_POSE_BIN, API_POSE_CSV } api_pose_form;

typedef struct api_pose_request {
  /* as read */
  const char *clips;     /* as in api_clips_choose; NULL: the first */
  const char *node_list; /* names of nodes; NULL: all */
  api_clip_terms terms;  /* as in api_clips_choose */
  int force;             /* interpolation, as in api_clip_take */
  api_times times;
  api_pose_form form;
  api_pose_as as;
  bool is_world;
  tw_euler_order order;
  bool in_degrees;
  tw_loop loop;
  bool has_order, has_all_nodes, has_moved_nodes; /* of BVH: `order` is given; nodes=all; no `nodes` */
  bool is_skinning; /* joint matrices of all skins, one skin after the other, instead of nodes */
  /* as resolved */
  api_clip_choices choices;
  api_entry *model_entry, *clip_entry; /* references; NULL: none */
  const tw_model *model;
  const api_clip *clip; /* NULL: the rest pose */
  uint32_t node_count;
  const uint32_t *nodes; /* [node_count], in the call's arena; ascending unless is_skinning */
  uint64_t weights;      /* morph weights that a pose tells; in text, names count as about as many numbers */
} api_pose_request;

/* Reads all parameters but times and form; zeroes the rest. */
api_outcome api_pose_request_read(api_call *call, api_pose_request *out);

/* Reads the parameters of BVH but times; zeroes the rest. */
api_outcome api_bvh_request_read(api_call *call, api_pose_request *out);

/* Finds clip and nodes in the model of model_entry, and completes the times; without any, the only time is 0.
 * is_stored as in api_clip_take. 404; 422, also for poses that take too much work each; API_NEEDS_THREAD in a
 * light call when the search for nodes is long; a light call stalls where the clip is not cached. */
api_outcome api_pose_request_resolve(api_call *call, bool is_stored, api_pose_request *request);

/* Chooses the nodes of a list of names separated by commas, or all (NULL), in the file's order. *out:
 * [*count] in the call's arena. 404; API_NEEDS_THREAD in a light call when the search is long. */
api_outcome api_nodes_choose(api_call *call, const tw_model *model, const char *list, const uint32_t **out,
                             uint32_t *count);

/* Releases the entries. */
void api_pose_request_deinit(api_pose_request *request);

/* About the bytes of a number in text. */
enum { API_POSE_NUMBER_BYTES = 10 };

/* Transforms that a pose takes, with morph weights: of all nodes of the model, in each clip that a mixed one
 * plays. */
uint64_t api_pose_transforms(const api_pose_request *request);

/* Numbers, evaluated or printed, that take an I/O thread as long as it may work for one connection. */
enum { API_POSE_LIGHT = 20000 };

/* The place of a node in the answer's nodes; TW_NO_INDEX where they lack it. Not with is_skinning. O(log n).
 */
uint32_t api_pose_place(const api_pose_request *request, uint32_t node);

/* Whether the answer tells the morph weights that a track of the clip moves: all forms do but CSV. */
bool api_pose_tells_weights(const api_pose_request *request, uint32_t track);

/* Warns, in CSV, where the clip moves morph weights of the answer's nodes. */
void api_pose_warn_of_weights(api_call *call, const api_pose_request *request);

/* Whether each pose has the root motion beside it. */
bool api_pose_has_root(const api_pose_request *request);

/* Whether the answer has all nodes of the model, each once. */
bool api_pose_has_all_nodes(const api_pose_request *request);

/* Prints all parameters but form and times, with defaults; call after api_pose_request_resolve. */
void api_pose_request_print(const api_pose_request *request, tw_text *text);

#endif
