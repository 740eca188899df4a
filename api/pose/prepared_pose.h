/* What of an answer with a pose does not depend on its time, ready for the next one: who plays a clip asks
 * for one time after the other, and for nothing else. */
#ifndef API_PREPARED_POSE_H
#define API_PREPARED_POSE_H

#include "kept_answer.h"
#include "pose_request.h"

/* Answers a call whose route and key are judged, and whose query is one that was prepared for, at any one
 * time. key: the call's. API_LATER: go on with reading the query. */
api_outcome api_prepared_pose(api_call *call, const api_kept_key *key);

/* Offers what has just been answered: a stored model's own clip at one time, printed by `body` in `size`
 * bytes. It is kept when it is small, asked for again, and what a light call may answer, at any time: the
 * pose of one node takes evaluating all of them. */
void api_prepare_pose(const api_call *call, const api_pose_request *request, const api_clip_choice *choice,
                      const api_pose_body *body, size_t size);

#endif
