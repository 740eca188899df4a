/* What requests for poses have in common: parameters, nodes, and the text that makes them out. */
#ifndef API_POSE_REQUEST_H
#define API_POSE_REQUEST_H

#include "call.h"
#include "pose_body.h"

/* Parameters as read, before the model is known. */
typedef struct api_pose_request {
  const char *clip_name;
  const char *nodes; /* NULL: all */
  int force;
  api_pose_query query; /* without model, clip, times, form and nodes */
} api_pose_request;

/* All parameters but the times. */
api_outcome api_pose_request_read(api_call *call, api_pose_request *out);

/* Fills query.nodes, in the call's arena: those named, in the file's order, or the joints of all skins. 404,
 * 422; API_NEEDS_THREAD in a light call when finding them takes long. */
api_outcome api_pose_choose_nodes(api_call *call, const tw_model *model, api_pose_request *request);

/* Prints all parameters but the times with their defaults, once the nodes are chosen. */
void api_pose_request_print(const api_pose_request *request, const api_clip_choice *choice, api_text *text);

/* What entity tags of answers to the call stand for beside times; false without memory. */
bool api_pose_request_stamp(const api_call *call, const api_pose_request *request,
                            const api_clip_choice *choice, api_stamp *out);

/* What such a tag says of times: of one its bits, as long and as cheap for each, of several a digest.
 * Terminated; false without memory. */
enum { API_TIMES_MARK = 2 * API_STAMP_DIGEST + 1 };
void api_time_mark(float time, char out[API_TIMES_MARK]);
bool api_times_mark(const api_times *times, char out[API_TIMES_MARK]);

#endif
