/* A glTF answer before its bytes: what lies where in the BIN chunk, and the JSON that says so.
 * The plan is made in C (gltf_plan.c), its JSON by tinygltf (gltf/json.cpp). */
#ifndef TWEEND_GLTF_H
#define TWEEND_GLTF_H

#include "tweend/format.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
  TW_GLTF_UNSIGNED_SHORT = 5123,
  TW_GLTF_UNSIGNED_INT = 5125,
  TW_GLTF_FLOAT = 5126,
  TW_GLTF_VERTICES = 34962, /* what a buffer view is for */
  TW_GLTF_INDICES = 34963,
  TW_GLTF_STRIDE_MAX = 252,
  TW_GLTF_ATTRIBUTES_MAX = 6 + TW_UV_SETS_MAX,
  TW_GLTF_BOUND_TEXT = 24 /* bytes kept for each number of bounds that come later */
};

/* Where the bytes of a view come from. */
typedef enum tw_gltf_source {
  TW_GLTF_MEMORY,   /* as they are */
  TW_GLTF_ROWS,     /* columns of TW_DOMAIN_VERTICES */
  TW_GLTF_TRIANGLES /* faces of one material */
} tw_gltf_source;

/* One buffer view, and how to fill it. Views follow each other in the BIN chunk, each at a multiple of
 * 4, zeros between them. */
typedef struct tw_gltf_view {
  uint64_t offset, size;
  uint32_t element_size; /* bytes of a row or triangle; 1 of memory */
  int target;            /* TW_GLTF_VERTICES (element_size is the stride), TW_GLTF_INDICES or 0 */
  tw_gltf_source source;
  const void *memory;
  uint32_t mesh;                       /* ROWS, TRIANGLES: of the model */
  uint32_t first_column, column_count; /* ROWS: floats of the surface's row */
  tw_surface_group faces;              /* TRIANGLES: all of one material, whatever their names */
} tw_gltf_view;

typedef enum tw_gltf_bounds { TW_GLTF_UNBOUNDED, TW_GLTF_BOUNDED, TW_GLTF_BOUNDED_LATER } tw_gltf_bounds;

typedef struct tw_gltf_accessor {
  uint32_t view, offset;
  int component; /* TW_GLTF_UNSIGNED_SHORT, ... */
  int width;     /* 1 to 4, 16 */
  uint64_t count;
  tw_gltf_bounds bounds;
  float min, max; /* BOUNDED, of width 1 */
  uint32_t mesh;  /* BOUNDED_LATER, of width 3: these of tw_surface_bounds */
  int morph;
} tw_gltf_accessor;

typedef struct tw_gltf_attribute {
  const char *semantic;
  uint32_t accessor;
} tw_gltf_attribute;

typedef struct tw_gltf_mesh {
  uint32_t source; /* mesh of the model */
  uint32_t attribute_count;
  tw_gltf_attribute attributes[TW_GLTF_ATTRIBUTES_MAX];
  uint32_t target_count, first_target;     /* accessors of displacements, one after the other */
  uint32_t primitive_count, first_indices; /* accessors, one a material that faces have */
} tw_gltf_mesh;

typedef struct tw_gltf_channel {
  uint32_t node, input, output;
  tw_path path;
  tw_interpolation interpolation; /* STEP, LINEAR, CUBICSPLINE */
} tw_gltf_channel;

typedef struct tw_gltf_animation {
  uint32_t clip; /* of the scene */
  uint32_t first_channel, channel_count;
} tw_gltf_animation;

typedef struct tw_gltf_plan {
  tw_arena *arena;
  uint64_t data_size; /* of the BIN chunk, a multiple of 4 */
  uint32_t view_count, accessor_count, mesh_count, animation_count, channel_count, image_count;
  tw_gltf_view *views;
  tw_gltf_accessor *accessors;
  tw_gltf_mesh *meshes;
  tw_gltf_animation *animations; /* clips of which no channel is left are not among them */
  tw_gltf_channel *channels;     /* of all animations, one animation after the other */
  uint32_t *image_views;   /* [image_count]: TW_NO_INDEX for an image outside the file */
  uint32_t *mesh_numbers;  /* [model's meshes]: in `meshes`, or TW_NO_INDEX when it has no faces */
  uint32_t *skin_numbers;  /* [model's skins]: in the answer, or TW_NO_INDEX when no node uses it */
  uint32_t *skin_matrices; /* [model's skins]: accessors */
  bool names_groups;       /* primitives tell which of their faces are in which groups */
} tw_gltf_plan;

/* Lays out everything that the scene holds. TW_LIMIT: more parts than are written. */
tw_status tw_gltf_plan_init(tw_gltf_plan *plan, const tw_scene *scene, tw_error *error);
void tw_gltf_plan_deinit(tw_gltf_plan *plan); /* a zeroed one is fine */

/* The track with STEP, LINEAR or CUBICSPLINE keys and quaternions of unit length and continuous signs for
 * rotations; a spline has at least two keys. A rotation that glTF does not interpolate as the track does
 * gets as few LINEAR keys as keep it nearer than 0.1 degrees, and no more than max_keys, else TW_LIMIT.
 * The track must have passed tw_clip_create. Arrays of the result are the track's own or the arena's. */
tw_status tw_gltf_keys_of(const tw_track_keys *track, uint32_t max_keys, tw_arena *arena, tw_track_keys *out,
                          tw_error *error);

/* Whether the surface's rows bear joints and this node has a skin for them. */
bool tw_gltf_node_is_skinned(const tw_scene *scene, const tw_node *node);

/* The JSON of a plan, without its buffer: text that begins "{" and goes on with a member.
 * Bounds that come later are fields of TW_GLTF_BOUND_TEXT spaces. */
typedef struct tw_gltf_json {
  char *text; /* [size], from malloc */
  size_t size;
  /* [the plan's accessors that are BOUNDED_LATER][6]: offsets of the fields in text: maximum x y z,
   * minimum x y z; from malloc */
  size_t (*bounds)[6];
} tw_gltf_json;

/* TW_INVALID when text of the model is not UTF-8. */
tw_status tw_gltf_json_init(tw_gltf_json *json, const tw_gltf_plan *plan, const tw_scene *scene,
                            tw_error *error);
void tw_gltf_json_deinit(tw_gltf_json *json); /* a zeroed one is fine */

/* Images of a model's assets; assets may be NULL. size 0: outside the file. */
uint32_t tw_gltf_image_count(const tw_gltf_assets *assets);
const uint8_t *tw_gltf_image_bytes(const tw_gltf_assets *assets, uint32_t image, size_t *size);

#ifdef __cplusplus
}
#endif
#endif
