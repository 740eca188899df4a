/* The subdivision tags of OpenSubdiv's tools in an OBJ file: lines `t NAME INTS/FLOATS/STRINGS values...`,
 * with indices from 0. Like all of the file, tags are counted first and then read into arrays of that
 * size. */
#ifndef TWEEND_OBJ_TAGS_H
#define TWEEND_OBJ_TAGS_H

#include "losses.h"
#include "obj_text.h"

typedef struct tw_obj_tag_counts {
  uint64_t crease_points, sharp_points, holes;
} tw_obj_tag_counts;

/* The tags of a file. */
typedef struct tw_obj_tags {
  uint64_t point_count, face_count; /* of the file, above every index */
  tw_obj_tag_counts all;            /* how many there are at most */
  tw_obj_tag_counts read;           /* so far */

  /* Of the caller: [all.X], crease_sharpness one for each pair of points; NULL if there are none. */
  uint32_t *crease_points, *sharp_points, *holes;
  float *crease_sharpness, *point_sharpness;

  bool any;                              /* the file has a `t` */
  int boundary, uv, creasing, triangles; /* TW_TAG_UNSET without a tag */
} tw_obj_tags;

/* Adds the most elements that the tag behind a `t` can hold: as many as it says, but no more than its text
 * has room for. */
void tw_obj_count_tag(tw_obj_tag_counts *all, tw_obj_text *text);

/* Reads the tag behind a `t`, and notes what of it is left out. TW_SYNTAX, TW_INVALID. */
tw_status tw_obj_read_tag(tw_obj_tags *tags, tw_obj_text *text, tw_losses *losses, tw_error *error);

#endif
