/* Printing poses: JSON, lines of JSON, CSV, binary rows. */
#ifndef API_POSE_PRINT_H
#define API_POSE_PRINT_H

#include "pose_body.h"

/* Numbers that one node has in a pose. */
size_t api_pose_width(api_pose_as as);

/* The members that say what the answer is; leaves the object open. */
void api_pose_print_heading(const api_pose_query *query, api_text *text);

/* More members, of the binary form's header: where a node's numbers stand in a row. */
void api_pose_print_layout(const api_pose_query *query, api_text *text);

/* Bytes that the times take in a list, counted one by one. */
uint64_t api_pose_measure_times(const api_pose_query *query);

/* CSV's line of column names. */
void api_pose_print_columns(const api_pose_query *query, api_text *text);

/* False without memory. The sample lives as long as the arena. */
bool api_pose_sample_take(const api_pose_query *query, const float *row, tw_arena *arena,
                          api_pose_sample *out);

/* One pose in the query's form. row: [node_count][width]. sample: NULL for none; only JSON uses it. */
void api_pose_print_row(const api_pose_query *query, float time, const float *row,
                        const api_pose_sample *sample, api_text *text);

/* Little-endian, whatever the machine's order. */
void api_pose_print_u32(uint32_t value, api_text *text);

#endif
