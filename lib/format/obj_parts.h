/* What an OBJ file said, between its text and the model made of it. */
#ifndef TWEEND_OBJ_PARTS_H
#define TWEEND_OBJ_PARTS_H

#include "obj_names.h"
#include "obj_scan.h"
#include "tweend/model.h"

/* The highest index that a statement named, to be compared with the count at the end: elements may
 * be named before they are defined. */
typedef struct obj_highest {
  uint64_t index; /* from 1; 0: none was named */
  uint64_t line;
} obj_highest;

/* Faces from first_face up to the next object's. */
typedef struct obj_object {
  obj_word name; /* length 0: none */
  uint32_t first_face;
} obj_object;

/* A malloc'ed array that grows. */
typedef struct obj_floats {
  float *values;
  size_t count, capacity;
} obj_floats;

typedef struct obj_indices {
  uint32_t *values;
  size_t count, capacity;
} obj_indices;

typedef struct obj_parts {
  obj_floats positions; /* 3 each */
  obj_floats colors;    /* 3 each as in the file, empty or one for each position so far */
  obj_floats uvs;       /* 2 each */
  uint32_t normal_count;

  obj_indices corners;
  obj_indices corner_uvs;  /* empty, or one for each corner so far; OBJ_NO_UV without vt */
  obj_indices face_starts; /* first corner of each face */
  obj_indices materials;   /* empty, or one for each face so far; OBJ_NO_NAME */
  obj_indices groups;      /* likewise: sets of groups */
  obj_object *objects;     /* by ascending first_face */
  size_t object_count, object_capacity;
  obj_word first_group;

  uint32_t material, group; /* of the faces to come */
  obj_names material_names, group_names;

  obj_indices crease_points; /* 2 each */
  obj_floats crease_sharpness;
  obj_indices sharp_points;
  obj_floats point_sharpness;
  obj_indices holes;
  int tag_boundary, tag_uv, tag_creasing, tag_triangles;
  obj_highest tagged_point, tagged_face;

  obj_highest corner_point, corner_uv, corner_normal;
  uint64_t ignored_elements; /* lines, points, free-form */
  uint64_t ignored_tags;
  uint64_t missing_uvs; /* corners without vt */
  uint64_t long_groups; /* `g` with more text than is kept */
} obj_parts;

#define OBJ_NO_UV   UINT32_MAX
#define OBJ_NO_NAME UINT32_MAX

/* Room for `more` elements after count. TW_LIMIT over 32 bits. */
tw_status obj_floats_reserve(obj_floats *floats, size_t more, tw_error *error);
tw_status obj_indices_reserve(obj_indices *indices, size_t more, tw_error *error);
void obj_parts_deinit(obj_parts *parts);

/* A subdivision tag: the text stands behind `t`. */
tw_status obj_read_tag(obj_parts *parts, obj_text *text, tw_error *error);

/* Fills the model's meshes and material names. Indices in parts are in range. */
tw_status obj_build_model(const obj_parts *parts, tw_model *model, tw_error *error);

#endif
