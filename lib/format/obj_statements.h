/* Reads the statements of an OBJ file into arrays, of which `obj_read` makes meshes. */
#ifndef TWEEND_OBJ_STATEMENTS_H
#define TWEEND_OBJ_STATEMENTS_H

#include "losses.h"
#include "obj_tags.h"
#include "tweend/model.h"

/* Names of materials or of sets of groups, numbered in the order of their first use. A zeroed table is
 * empty. */
typedef struct tw_obj_names {
  tw_word *names; /* [count] views of the text, as first written */
  size_t count, capacity;
  uint32_t *slots; /* [2 x capacity] hash table: number + 1, or 0 */
} tw_obj_names;

#define TW_OBJ_NO_NAME UINT32_MAX

/* A file with more objects stays one mesh: a mesh costs much more memory than a line of text. Sets of groups
 * beyond the limit are left out. */
enum { TW_OBJ_OBJECTS_MAX = TW_MESHES_MAX, TW_OBJ_GROUPS_MAX = 262144 };

#define TW_OBJ_NO_VALUE UINT32_MAX /* of a corner without vt or vn */

typedef struct tw_obj_counts {
  uint64_t points, uvs, normals, faces, corners, objects;
} tw_obj_counts;

/* Faces from first_face up to the next object's. */
typedef struct tw_obj_object {
  tw_word name; /* length 0: none */
  uint32_t first_face;
} tw_obj_object;

/* The contents of a file while its statements are read. */
typedef struct tw_obj_reader {
  tw_arena *arena;
  tw_error *error;
  tw_obj_counts all;  /* of the file */
  tw_obj_counts read; /* so far */

  /* In the arena, with room for [all.X] rows, of which [read.X] are filled; NULL if all.X is 0. */
  double *exact;             /* [3], from malloc: the positions in double, where they may be far; else NULL */
  float *positions, *colors; /* [3], [4] linear; colors NULL until a point has one */
  float *normals;            /* [3], with room for one more */
  uint32_t *corners;
  uint32_t *corner_uvs, *corner_normals; /* NULL until a corner has one; TW_OBJ_NO_VALUE without */
  uint32_t *face_offsets;                /* with room for one more, and for one more an object */
  uint32_t *materials, *groups;          /* of each face; NULL until a face has one; TW_OBJ_NO_NAME: none */
  uint32_t *smoothing;                   /* of each face; NULL until a face has a group */
  tw_obj_tags tags;

  float *uvs;        /* [2], from malloc */
  uint32_t *dropped; /* [dropped_count], ascending: faces of the file; from malloc */
  size_t dropped_count, dropped_room;
  tw_obj_object *objects; /* from malloc, [TW_OBJ_OBJECTS_MAX + 1 or fewer], by ascending first_face */
  size_t object_count;
  tw_word first_group; /* the names behind the first `g` */
  tw_word group_words; /* groups of the faces that follow, until they are numbered as `group`; length 0:
                          nothing to number */
  uint32_t material, group;
  uint32_t smoothing_group; /* TW_OBJ_NO_VALUE until an `s` */
  tw_obj_names material_names, group_names;
  tw_obj_names idle_groups; /* that no face follows where they stand */

  uint64_t painted_points;                    /* coloured by ZBrush's comments */
  bool names_library;                         /* the file has an `mtllib` */
  uint64_t unknown_statements, first_unknown; /* the line of the first one */
  tw_word unknown_word;                       /* its first word */
  tw_losses losses;
} tw_obj_reader;

/* Reads all statements. reader: zero but for its arena and perhaps its error; deinit it after a failure too.
 * Names point into the bytes. TW_SYNTAX, TW_INVALID, TW_LIMIT or TW_NO_MEMORY. */
tw_status tw_obj_read_statements(tw_obj_reader *reader, const uint8_t *bytes, size_t size);

void tw_obj_reader_deinit(tw_obj_reader *reader);

/* Reads the positions of all points again. bytes: whose statements were read without an error. out:
 * [points][3] */
void tw_obj_read_exact(const uint8_t *bytes, size_t size, double *out);

tw_status tw_obj_fail_memory(const tw_obj_reader *reader);

#endif
