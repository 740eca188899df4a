/* Printing poses: JSON, lines of JSON, CSV, binary rows. */
#ifndef API_POSE_PRINT_H
#define API_POSE_PRINT_H

#include "pose_body.h"

/* What a pose says of each node. */
typedef struct api_pose_part {
  const char *name;
  uint32_t offset, width; /* floats, from the node's first */
  tw_path path;           /* of the tracks that change it; of a matrix any may */
  const char *columns;    /* of CSV */
} api_pose_part;

/* In the order of the answer; the last has no name. */
const api_pose_part *api_pose_parts(api_pose_as as);

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

/* The pose at one of the query's times in its form. row: [node_count][width]. frame: NULL for none; only JSON
 * uses it. */
void api_pose_print_row(const api_pose_query *query, uint64_t index, const float *row,
                        const api_pose_frame *frame, api_text *text);

/* Little-endian, whatever the machine's order. */
void api_pose_print_u32(uint32_t value, api_text *text);

#endif
