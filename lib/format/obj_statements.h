/* What the statements of an OBJ file say, as `obj_read` makes meshes of it. */
#ifndef TWEEND_OBJ_STATEMENTS_H
#define TWEEND_OBJ_STATEMENTS_H

#include "obj_tags.h"
#include "tweend/model.h"

/* Names of materials or of sets of groups, numbered in the order of their first use. A zeroed table is
 * empty. */
typedef struct tw_obj_names {
  tw_word *names; /* [count], in the text, as first written */
  size_t count, capacity;
  uint32_t *slots; /* [2 x capacity], hash table of numbers + 1 */
} tw_obj_names;

#define TW_OBJ_NO_NAME UINT32_MAX

/* Above this the file stays one mesh: a mesh costs much more memory than a line of text. */
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

/* What a file says, as `f`, `v` and the others fill it. */
typedef struct tw_obj_reader {
  tw_arena *arena;
  tw_error *error;
  tw_obj_counts all;  /* of the file */
  tw_obj_counts read; /* so far */

  /* In the arena, [all.X] of the rows that `read` counts; NULL where there are none. */
  float *positions, *colors; /* [3], [4] linear; colors NULL until a point has one */
  float *normals;            /* [3], with room for one more */
  uint32_t *corners;
  uint32_t *corner_uvs, *corner_normals; /* NULL until a corner has one; TW_OBJ_NO_VALUE without */
  uint32_t *face_offsets;                /* with room for one more, and one more an object */
  uint32_t *materials, *groups;          /* of each face; NULL until a face has one; TW_OBJ_NO_NAME */
  uint32_t *smoothing;                   /* of each face; NULL until a face has a group */
  tw_obj_tags tags;

  float *uvs;        /* [2], from malloc */
  uint32_t *dropped; /* [dropped_count], ascending: faces of the file; from malloc */
  size_t dropped_count;
  tw_obj_object *objects; /* from malloc, [TW_OBJ_OBJECTS_MAX + 1 or fewer], by ascending first_face */
  size_t object_count;
  tw_word first_group; /* names of the first `g` */
  tw_word group_words; /* of the faces to come, numbered when one comes; length 0: none */
  uint32_t material, group;
  uint32_t smoothing_group; /* TW_OBJ_NO_VALUE until an `s` */
  tw_obj_names material_names, group_names;

  uint64_t painted_points;                    /* by ZBrush's comments */
  uint64_t ignored_elements;                  /* lines, points, free-form */
  uint64_t first_ignored;                     /* its line */
  bool names_library;                         /* of materials, mtllib */
  uint64_t unknown_statements, first_unknown; /* the line of the first one */
  tw_word unknown_word;                       /* its first word */
  uint64_t missing_uvs, bad_uvs, long_groups, late_groups, bad_normals;
} tw_obj_reader;

/* Reads all statements into a reader that has an arena, perhaps an error, and is zero otherwise. Names point
 * into the bytes. It is deinited after a failure too: TW_SYNTAX, TW_INVALID, TW_LIMIT or TW_NO_MEMORY. */
tw_status tw_obj_read_statements(tw_obj_reader *reader, const uint8_t *bytes, size_t size);

void tw_obj_reader_deinit(tw_obj_reader *reader);

tw_status tw_obj_fail_memory(const tw_obj_reader *reader);

#endif
