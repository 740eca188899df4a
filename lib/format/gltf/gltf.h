/* Shared by reading and writing glTF: what is kept of a file for answers, and the plan of a glTF answer
 * before its bytes: what lies where in the BIN chunk (gltf_plan.c), and the JSON that says so
 * (gltf_json.c). */
#ifndef TWEEND_GLTF_H
#define TWEEND_GLTF_H

#include "pack_reader.h"
#include "tweend/json_print.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- what is kept of a file for answers -----------------------------------------------------------------
 * Objects are JSON text without blanks, checked by tw_json_check, whole or without the members that an answer
 * writes itself. All of it lives in the model's arena. */

typedef struct tw_gltf_objects {
  uint32_t count;
  const char **items; /* [count] */
} tw_gltf_objects;

/* The elements of an accessor that passes through to answers as it is, with sparse elements applied. */
typedef struct tw_gltf_elements {
  const uint8_t *bytes; /* [count][stride] */
  uint32_t count, stride;
  int component;    /* 5120 to 5126 */
  const char *type; /* "SCALAR", ... */
  bool normalized;
  int target;           /* of the buffer view: TW_GLTF_VERTICES, TW_GLTF_INDICES or 0 */
  uint32_t bound_count; /* 0: without bounds */
  float min[4], max[4]; /* [bound_count] */
} tw_gltf_elements;

typedef struct tw_gltf_image {
  const char *preserved; /* whole, or if `bytes` is set without bufferView, uri and mimeType */
  const char *mime_type; /* of the bytes, as a quoted JSON string; NULL where unknown */
  const uint8_t *bytes;  /* [size] the encoded file (PNG, JPEG, KTX2, ...), NULL: outside the file */
  size_t size;
} tw_gltf_image;

typedef struct tw_gltf_scene {
  const char *preserved; /* without nodes; NULL: nothing */
  uint32_t node_count;
  const uint32_t *nodes; /* [node_count] */
} tw_gltf_scene;

/* The children of a node in the file's order. */
typedef struct tw_gltf_children {
  uint32_t node, count;
  const uint32_t *nodes; /* [count] */
} tw_gltf_children;

/* Texture references of materials, and samplers and images of textures, are checked to be in range. */
struct tw_gltf_assets {
  const char *root, *asset; /* members that an answer does not write itself; NULL: none */
  tw_gltf_objects materials, textures, samplers, cameras;
  uint32_t image_count;
  tw_gltf_image *images; /* [image_count] */
  uint32_t scene_count;
  tw_gltf_scene *scenes; /* [scene_count] */
  uint32_t scene;        /* the default one, TW_NO_INDEX: not said */
  uint32_t node_count;   /* of the file: an answer may have more */
  uint32_t reordered_count;
  const tw_gltf_children *reordered; /* [reordered_count] by node: those whose children do not ascend */
  /* The first accessors of an answer, in this order: kept text names them by these numbers. */
  uint32_t element_count;
  const tw_gltf_elements *elements; /* [element_count] */
  /* As the file lists them: what stands between the quotes. */
  tw_gltf_objects extensions_used, extensions_required;
};

/* ---- an answer ------------------------------------------------------------------------------- */

#define TW_GLTF_MESHOPT "EXT_meshopt_compression"

enum {
  TW_GLTF_UNSIGNED_SHORT = 5123,
  TW_GLTF_UNSIGNED_INT = 5125,
  TW_GLTF_FLOAT = 5126,
  TW_GLTF_VERTICES = 34962, /* what a buffer view is for */
  TW_GLTF_INDICES = 34963,
  TW_GLTF_BOUND_TEXT = 24 /* bytes kept for each number of bounds that come later */
};

/* tw_glb_put_head writes the header of a GLB and of its JSON chunk, tw_glb_put_bin_head the header of its BIN
 * chunk; both return the end. json_size: a multiple of 4. data_size 0: there is no BIN chunk. */
uint8_t *tw_glb_put_head(uint8_t *out, uint64_t json_size, uint64_t data_size);
uint8_t *tw_glb_put_bin_head(uint8_t *out, uint64_t data_size);

/* Where the bytes of a view come from. */
typedef enum tw_gltf_source {
  TW_GLTF_MEMORY,    /* as they are */
  TW_GLTF_ROWS,      /* columns of TW_DOMAIN_VERTICES */
  TW_GLTF_TRIANGLES, /* faces of one material */
  TW_GLTF_PACK       /* a part of a pack */
} tw_gltf_source;

/* What a compressed view decodes to: its place in a buffer that has no bytes. */
typedef struct tw_gltf_decoded {
  const char *mode; /* EXT_meshopt_compression's; NULL: the view is as it is */
  uint64_t offset, size;
  uint32_t count, stride; /* elements, bytes of one */
} tw_gltf_decoded;

/* One buffer view, and how to fill it. Views follow each other in the BIN chunk, each at a multiple of
 * 4, zeros between them. */
typedef struct tw_gltf_view {
  uint64_t offset, size;
  uint32_t element_size; /* bytes of a row or triangle; 1 of memory and packs */
  uint32_t stride;       /* of vertices; else 0 */
  int target;            /* TW_GLTF_VERTICES, TW_GLTF_INDICES or 0 */
  tw_gltf_source source;
  const void *memory;
  uint32_t mesh; /* ROWS, TRIANGLES, PACK: of the model */
  /* ROWS: fields of rows that hold the displacements of these targets */
  const tw_vertex_field *fields; /* [field_count] */
  uint32_t field_count, first_target, target_count;
  tw_surface_group faces; /* TRIANGLES: all faces of one material, whatever their groups */
  uint32_t pack, part;    /* PACK */
  tw_gltf_decoded decoded;
} tw_gltf_view;

typedef struct tw_gltf_accessor {
  uint32_t view; /* TW_NO_INDEX: all zero */
  uint32_t offset;
  int component; /* TW_GLTF_UNSIGNED_SHORT, ... */
  bool is_normalized;
  const char *type; /* "SCALAR", ... */
  uint64_t count;
  uint32_t bound_count; /* 0: without bounds, or they come later */
  float min[4], max[4]; /* [bound_count] */
  /* If set, the bounds have three numbers, and tw_surface_bounds or a pack of the mesh has them. */
  bool is_bounded_later;
  uint32_t mesh, pack; /* pack: or TW_NO_INDEX */
  int morph;
  size_t max_text, min_text; /* where the JSON has room for them: three fields, a comma between two */
} tw_gltf_accessor;

/* Faces of one material. */
typedef struct tw_gltf_primitive {
  uint32_t first_attribute;                /* accessor of the mesh's first field; the others follow */
  uint32_t first_target;                   /* accessors of displacements, one target after the other */
  uint32_t indices;                        /* accessor */
  tw_surface_group faces;                  /* all of the material */
  uint64_t first_triangle, triangle_count; /* of these faces */
} tw_gltf_primitive;

typedef struct tw_gltf_mesh {
  uint32_t field_count;
  const tw_vertex_field *fields;      /* [field_count] attributes */
  uint32_t target_count, target_step; /* accessors of a target: 1, or 2 if it moves normals */
  uint32_t primitive_count; /* without faces 0; then one is written that draws nothing. If all faces are holes
                               1, which draws nothing either */
  uint32_t hole_count;      /* of a cage: primitives behind those, written as indices and material */
  tw_gltf_primitive *primitives;
  const char *tags; /* of a cage: extras.tweend, a JSON object; else NULL */
} tw_gltf_mesh;

typedef struct tw_gltf_channel {
  uint32_t node, input, output;
  tw_path path;
  tw_interpolation interpolation; /* STEP, LINEAR, CUBICSPLINE */
  const char *preserved;          /* the track's */
} tw_gltf_channel;

typedef struct tw_gltf_animation {
  uint32_t clip; /* of the scene */
  uint32_t first_channel, channel_count;
} tw_gltf_animation;

typedef struct tw_gltf_plan {
  tw_arena *arena;
  uint64_t data_size; /* of the BIN chunk, a multiple of 4 */
  uint32_t view_count, accessor_count, animation_count, channel_count;
  tw_gltf_view *views; /* from malloc, as are the accessors */
  tw_gltf_accessor *accessors;
  uint64_t part_count; /* views and accessors (also those that found no room), nodes and materials */
  bool lacks_memory;
  tw_gltf_mesh *meshes;          /* [the model's meshes] */
  tw_gltf_animation *animations; /* without clips that have no channel left */
  tw_gltf_channel *channels;     /* of all animations, one animation after the other */
  uint32_t *image_views;         /* [the assets' images]: TW_NO_INDEX for an image outside the file */
  uint32_t *skin_matrices;       /* [the model's skins]: accessors */
  /* [holder_count] nodes whose mesh moves to an added child, which turns 16-bit positions into coordinates.
   * The child of holders[i] is node first_holder + i, behind the model's nodes. */
  uint32_t holder_count, first_holder;
  uint32_t *holders;
  uint64_t decoded_size; /* bytes that compressed views decode to */
  uint32_t nothing;  /* accessor of three points at the origin, for meshes without faces; or TW_NO_INDEX */
  bool names_groups; /* primitives tell which of their faces are in which groups */
} tw_gltf_plan;

/* ---- gltf_accessors.c: the plan notes where there is no room; check_parts fails then --------- */

uint32_t tw_gltf_add_view(tw_gltf_plan *plan, tw_gltf_view view);
uint32_t tw_gltf_add_accessor(tw_gltf_plan *plan, tw_gltf_accessor accessor);
/* A view of memory that outlives the plan. */
uint32_t tw_gltf_add_memory(tw_gltf_plan *plan, const void *memory, uint64_t size);
/* Adds numbers of four bytes, `width` to an element, as an accessor with a view of its own; returns the
 * accessor. values: outlive the plan. */
uint32_t tw_gltf_add_numbers(tw_gltf_plan *plan, const void *values, uint64_t count, int component,
                             int width);
uint32_t tw_gltf_add_floats(tw_gltf_plan *plan, const float *values, uint64_t count, int width);
/* "VEC3" for 3 numbers, "MAT4" for 16. */
const char *tw_gltf_type_of(int width);
/* TW_LIMIT: too many parts. TW_NO_MEMORY: one found none. */
tw_status tw_gltf_check_parts(const tw_gltf_plan *plan, tw_error *error);

/* Makes the tags of a mesh whose primitives are planned, if it is a cage (gltf_cage.c). False without
 * memory. */
bool tw_gltf_add_cage_tags(tw_gltf_plan *plan, const tw_scene *scene, uint32_t index);

static inline tw_status tw_gltf_no_memory(tw_error *error) {
  return tw_fail(error, TW_NO_MEMORY, "no memory for the plan of a glTF answer");
}

/* Lays out everything that the scene holds. TW_LIMIT: too many parts, or keys that would have to be added. A
 * failed plan is deinited. */
tw_status tw_gltf_plan_init(tw_gltf_plan *plan, const tw_scene *scene, tw_error *error);
void tw_gltf_plan_deinit(tw_gltf_plan *plan); /* a zeroed one is fine */

/* The track with STEP, LINEAR or CUBICSPLINE keys, and quaternions for rotations: of unit length and
 * continuous signs, but as they stand in splines. A spline has at least two keys. A rotation that glTF does
 * not interpolate as the track does gets LINEAR keys that keep it nearer than 0.1 degrees and turn as it
 * does: Euler angles keep their own keys and get no more than max_keys besides, others get as few as
 * possible, and no more than max_keys, else TW_LIMIT; steps: as in tw_clip_reduce. The track must have passed
 * tw_clip_create. Arrays of the result are the track's own or the arena's. */
tw_status tw_gltf_keys_of(const tw_track_keys *track, uint32_t max_keys, uint64_t *steps, tw_arena *arena,
                          tw_track_keys *out, tw_error *error);

/* Whether the surface's rows have joints and this node has a skin for them. */
bool tw_gltf_node_is_skinned(const tw_scene *scene, const tw_node *node);

/* The child that holds the node's mesh; TW_NO_INDEX: the node itself does. O(log holders). */
uint32_t tw_gltf_holder_of(const tw_gltf_plan *plan, uint32_t node);

/* The channels of a clip that animate something other than nodes; NULL without any, and where the assets are
 * bare: they name accessors of these. */
const char *tw_gltf_loose_of(const tw_scene *scene, const tw_clip_keys *clip);

/* The model's assets; empty ones if it has none. */
const tw_gltf_assets *tw_gltf_assets_of(const tw_model *model);

/* Prints all members of an answer's JSON but its buffers, and the closing brace. Bounds that come later are
 * fields of TW_GLTF_BOUND_TEXT spaces, whose places go to the plan. Without memory text->failed is set. */
void tw_gltf_put_json(tw_text *text, tw_gltf_plan *plan, const tw_scene *scene);

#ifdef __cplusplus
}
#endif
#endif
