/* A model: what one upload holds. */
#ifndef TWEEND_MODEL_H
#define TWEEND_MODEL_H

#include "tweend/face.h"
#include "tweend/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum tw_format {
  TW_FORMAT_OBJ,
  TW_FORMAT_JSON,
  TW_FORMAT_GLTF,
  TW_FORMAT_GLB,
  TW_FORMAT_STL,
  TW_FORMAT_PLY,
  TW_FORMAT_BVH
} tw_format;
enum { TW_FORMATS = 7 };
/* "obj", "tweend", "gltf", "glb", "stl", "ply", "bvh" */
extern const char *const tw_format_names[TW_FORMATS];
extern const char *const tw_format_media_types[TW_FORMATS]; /* Content-Type of a source file */

/* Which vertices of a file become one point. Each of the first three modes joins all that the mode before it
 * joins. */
typedef enum tw_weld {
  TW_WELD_AUTO,     /* vertices at the ends of border edges that coincide (lib/mesh/weld.h) */
  TW_WELD_EXACT,    /* also points at the same place: tw_model_weld */
  TW_WELD_DISTANCE, /* also points within a distance */
  TW_WELD_NONE      /* every vertex of the file is a point */
} tw_weld;

/* Limits on the parts of a document, above what any exporter writes: an empty part takes a few bytes of text,
 * but hundreds in memory. Readers refuse more (TW_LIMIT). */
enum {
  TW_MESHES_MAX = 65536,
  TW_NODES_MAX = 262144,
  TW_MATERIALS_MAX = 65536,
  TW_CLIPS_MAX = 65536,
  TW_TRACKS_MAX = 262144 /* in all clips together */
};

/* What a glTF file holds besides geometry, hierarchy and clips: materials, images, cameras, ...; see gltf.h.
 */
typedef struct tw_gltf_assets tw_gltf_assets;

/* A copy that holds only what the file says of itself as a whole (its licence), for an answer without the
 * elements that the other assets refer to. NULL for NULL, and without memory. */
const tw_gltf_assets *tw_gltf_assets_bare(tw_arena *arena, const tw_gltf_assets *assets);

/* How many materials show their base colour's texture at other coordinates than those of the mesh, by
 * KHR_texture_transform. 0 for NULL. */
uint32_t tw_gltf_moved_textures(const tw_gltf_assets *assets);

/* A material together with what the glTF primitives of its faces held beyond what is read. Primitives that
 * held the same share a slot. */
typedef struct tw_material_slot {
  int32_t material;      /* or -1 */
  const char *preserved; /* JSON text, see tw_mesh */
} tw_material_slot;

/* Built once by a reader, then immutable and shared. All arrays live in `arena`. */
typedef struct tw_model {
  tw_arena *arena;
  tw_format format;
  const char *name; /* or NULL */
  uint32_t mesh_count;
  tw_mesh *meshes;
  uint32_t node_count;
  tw_node *nodes;
  uint32_t *node_order; /* [node_count], parents first */
  uint32_t named_node_count;
  const uint32_t *named_nodes;     /* [named_node_count] nodes that have a name, by name, then by index */
  const uint32_t *humanoid;        /* [TW_BONES] nodes (tweend/retarget.h) or TW_NO_INDEX; NULL: not said */
  const tw_face *face;             /* of a VRM; or NULL */
  const tw_face_nodes *face_nodes; /* of a VRMA; or NULL */
  uint32_t skin_count;
  tw_skin *skins;
  uint32_t clip_count;
  tw_clip_keys *clips;
  uint32_t material_count;     /* materials of `assets`; or names in an OBJ, or colours in tweend JSON */
  uint32_t group_count;        /* sets of groups that faces are in */
  const char **material_names; /* [material_count], entries may be NULL */
  float *material_colors;      /* [material_count][3] linear red, green and blue; NULL: white, or `assets` */
  uint32_t slot_count;
  const tw_material_slot *slots; /* [slot_count]; face_materials of material_count + i name slot i */
  const char **group_names;      /* [group_count] the names of each set, a blank between two */
  const tw_gltf_assets *assets;  /* or NULL */
  uint32_t warning_count;
  const char **warnings;  /* [warning_count] sentences */
  uint32_t *warned_clips; /* [warning_count] the clip that each is about; TW_NO_INDEX: none alone */
  bool warns_of_seams;    /* one of them tells of seams that stay open */
} tw_model;

tw_model *tw_model_create(void);        /* an empty model with its arena; NULL without memory */
void tw_model_destroy(tw_model *model); /* NULL accepted */

/* Adds a sentence to the warnings. So many are kept; the last one then says that there are more. Without
 * memory the warning is lost. */
enum { TW_WARNINGS_MAX = 64 };
void tw_model_warn(tw_model *model, const char *format, ...) TW_PRINTF(2, 3);
/* The same of one clip alone. */
void tw_model_warn_of_clip(tw_model *model, uint32_t clip, const char *format, ...) TW_PRINTF(3, 4);
/* Warns COUNT ONE, or COUNT MANY where the count is not 1; of none: nothing. */
void tw_model_warn_count(tw_model *model, uint64_t count, const char *one, const char *many);

/* Whether a node shows a mesh whose points follow joints. */
static inline bool tw_node_is_skinned(const tw_model *model, const tw_node *node) {
  return node->skin != TW_NO_INDEX && node->mesh != TW_NO_INDEX && model->meshes[node->mesh].skin.joints;
}

/* Completes and checks a model, as every reader must: meshes by tw_mesh_check, node indices, names, the
 * hierarchy (fills node_order and named_nodes), skins, and each clip as tw_clip_create does. A model with
 * meshes but no node gets one node a mesh. Where keys of a track have one time, the value jumps there: the
 * first is moved to the next smaller float or dropped, those between the first and the last are dropped, with
 * a warning. Errors carry a pointer in terms of tweend JSON ("/meshes/0/faces/3/1"). */
tw_status tw_model_finish(tw_model *model, tw_error *error);

/* The last call of every reader. If `status` is TW_OK, finishes the model and stores it in *out; otherwise,
 * or if finishing fails, destroys it (NULL accepted). Returns the status. */
tw_status tw_model_end(tw_model *model, tw_status status, tw_model **out, tw_error *error);

/* Merges the points of each mesh that are within `distance` of a first one; 0: those at the same place. Drops
 * faces that are left with fewer than three points, with a warning. The model must not be shared yet.
 * distance: 0, or 1e-12 or more. After TW_NO_MEMORY some meshes may be welded. O(n log n). */
tw_status tw_model_weld(tw_model *model, double distance, tw_error *error);

/* Bytes the model holds in memory. */
size_t tw_model_size(const tw_model *model);

/* Finds a node of a finished model by the name that clients see ("node_3" for a nameless one), or a clip
 * ("clip_0"); TW_NO_INDEX if there is none. Of equal names the first wins; "clip_N" also names a clip that
 * has a name of its own, unless another one is called so. O(log n) for nodes. */
uint32_t tw_model_find_node(const tw_model *model, const char *name, size_t length);
uint32_t tw_model_find_clip(const tw_model *model, const char *name, size_t length);

/* All nodes that have the name of `node`, itself included: *out [count], ascending. Returns the count, 0 for
 * a nameless node. O(log n + count). */
uint32_t tw_model_namesakes(const tw_model *model, uint32_t node, const uint32_t **out);

/* The material that a value of face_materials stands for; -1: none. */
static inline int32_t tw_model_material(const tw_model *model, int32_t face_material) {
  uint32_t slot = (uint32_t)face_material - model->material_count;
  return face_material >= 0 && slot < model->slot_count ? model->slots[slot].material : face_material;
}

/* The name that clients see. buffer: holds a generated name if there is no other. */
const char *tw_model_node_name(const tw_model *model, uint32_t node, char buffer[24]);
const char *tw_model_clip_name(const tw_model *model, uint32_t clip, char buffer[24]);

#ifdef __cplusplus
}
#endif
#endif
