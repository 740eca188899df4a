/* How the vertices of an answer lie in a buffer view: columns of a surface's rows, as floats or in fewer
 * bytes. */
#ifndef TWEEND_VERTEX_FORMAT_H
#define TWEEND_VERTEX_FORMAT_H

#include "tweend/subdiv.h"

typedef enum tw_vertex_coding {
  TW_CODED_FLOATS,
  TW_CODED_JOINTS,         /* unsigned shorts; a joint whose weight is 0 is written as 0 */
  TW_CODED_ROUNDED_JOINTS, /* the same beside weights in bytes */
  TW_CODED_SMALL_JOINTS,   /* bytes beside weights in bytes */
  TW_CODED_WEIGHTS,        /* bytes, 255 for 1; their sum is 255 */
  TW_CODED_PLACES,         /* shorts, 32767 for origin + scale: positions and displacements */
  TW_CODED_UNITS,          /* bytes, 127 for 1: unit vectors */
  TW_CODED_FRACTIONS,      /* unsigned shorts, 65535 for 1: numbers from 0 to 1 */
  TW_CODED_INT8,           /* whole numbers, as they are */
  TW_CODED_UINT8,
  TW_CODED_INT16,
  TW_CODED_UINT16
} tw_vertex_coding;

enum {
  TW_VERTEX_FIELDS_MAX = TW_VERTEX_STRIDE_MAX / 4, /* fields that fit in an element */
  TW_DISPLACEMENTS_MAX = TW_VERTEX_STRIDE_MAX / 12 /* vectors of floats that do */
};

/* An attribute: consecutive columns of a surface's row. */
typedef struct tw_vertex_field {
  const char *semantic; /* glTF's name of the attribute, UTF-8 */
  tw_vertex_coding coding;
  uint32_t column, width; /* floats of the row */
  /* Of joints and weights: the set of four that they are, the column of all weights, and how many there are.
   */
  uint32_t set, weights, influences;
  uint32_t offset;        /* bytes in the element, a multiple of 4 */
  float origin[3], scale; /* of TW_CODED_PLACES */
} tw_vertex_field;

/* How each attribute is coded; an application's own are floats, or the whole numbers that they were. */
typedef struct tw_vertex_codings {
  tw_vertex_coding position, normal, tangent, uvs[TW_UV_SETS_MAX], color, joints, weights;
} tw_vertex_codings;

extern const tw_vertex_codings tw_vertex_floats; /* floats for all but joints */

/* The fields of all columns but displacements, without gaps, the position first. Returns how many. */
uint32_t tw_vertex_fields(const tw_surface_layout *layout, const tw_vertex_codings *codings,
                          tw_vertex_field fields[TW_VERTEX_FIELDS_MAX]);

/* The column where displacements begin in rows that hold those of `target_count` targets
 * (tw_surface_reader_turn). */
uint32_t tw_vertex_target_column(const tw_surface_layout *layout, uint32_t target_count);

/* Bytes of a field in an element, a multiple of 4; bytes of an element with these fields. */
uint32_t tw_vertex_field_size(const tw_vertex_field *field);
uint32_t tw_vertex_size(const tw_vertex_field *fields, uint32_t field_count);

/* Whether elements are rows of `stride` floats as they are. */
bool tw_vertex_is_row(const tw_vertex_field *fields, uint32_t field_count, uint32_t stride);

/* glTF's componentType of a coding; and whether its integers stand for fractions (`normalized`). */
int tw_vertex_component(tw_vertex_coding coding);
bool tw_vertex_is_normalized(tw_vertex_coding coding);

/* Writes one element. row: of the surface. Bytes between fields become 0. */
void tw_vertex_write(const tw_vertex_field *fields, uint32_t field_count, const float *row, uint8_t *out);

/* Widens bounds by a field of an element, of at most 3 FLOATS or PLACES, in numbers as they are stored. */
void tw_vertex_widen(const tw_vertex_field *field, const uint8_t *element, float min[3], float max[3]);

#endif
