/* What of a pose as JSON no time changes: text that is printed once, with room for the rest. */
#ifndef API_POSE_FRAME_H
#define API_POSE_FRAME_H

#include "pose_body.h"

/* The frame of the query's poses after their time, from any one of them; false without memory. It lives as
 * long as the arena. row: [node_count][width]. */
bool api_pose_frame_take(const api_pose_query *query, const float *row, tw_arena *arena, api_pose_frame *out);

/* The pose after its time. */
void api_pose_frame_print(const api_pose_query *query, const api_pose_frame *frame, const float *row,
                          api_text *text);

#endif
