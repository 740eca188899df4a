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

/* Bytes of the binary form's header: both of the above, and the times, which are counted one by one.
 * False without memory. */
bool api_pose_measure_header(const api_pose_query *query, uint64_t *size);

/* CSV's line of column names. */
void api_pose_print_columns(const api_pose_query *query, api_text *text);

/* One pose in the query's form. row: [node_count][width]. */
void api_pose_print_row(const api_pose_query *query, float time, const float *row, api_text *text);

/* Little-endian, whatever the machine's order. */
void api_pose_print_u32(uint32_t value, api_text *text);

#endif
