/* A model: what one upload holds. */
#ifndef TWEEND_MODEL_H
#define TWEEND_MODEL_H

#include "tweend/anim.h"
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
  TW_FORMAT_PLY
} tw_format;
enum { TW_FORMATS = 6 };
extern const char *const tw_format_names[TW_FORMATS];       /* "obj", "tweend", "gltf", "glb", "stl", "ply" */
extern const char *const tw_format_media_types[TW_FORMATS]; /* as in the Content-Type of the source */

/* Which vertices of a file are one point. Each of the first three joins what the one before it joins. */
typedef enum tw_weld {
  TW_WELD_AUTO,     /* the ends of border edges that run along each other (lib/mesh/weld.h) */
  TW_WELD_EXACT,    /* and points at the same place: tw_model_weld */
  TW_WELD_DISTANCE, /* and points within a distance */
  TW_WELD_NONE      /* vertices are points as the file has them */
} tw_weld;

/* Parts that a document may have, more than any exporter writes: without data a part costs a few bytes of
 * text, and hundreds in memory. Readers refuse more (TW_LIMIT). */
enum {
  TW_MESHES_MAX = 65536,
  TW_NODES_MAX = 262144,
  TW_MATERIALS_MAX = 65536,
  TW_CLIPS_MAX = 65536,
  TW_TRACKS_MAX = 262144 /* of all clips */
};

/* What a glTF file holds besides geometry, hierarchy and clips: materials, images, cameras, ...; see gltf.h.
 */
typedef struct tw_gltf_assets tw_gltf_assets;

/* What they say of the file as a whole (its licence), for an answer without the parts that the rest speaks
 * of. NULL for NULL, and without memory. */
const tw_gltf_assets *tw_gltf_assets_bare(tw_arena *arena, const tw_gltf_assets *assets);

/* Faces of one material whose primitives in a glTF file said the same beyond that. */
typedef struct tw_material_slot {
  int32_t material; /* or -1 */
  const char *kept; /* as of a mesh */
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
  const uint32_t *named_nodes; /* [named_node_count] nodes that have a name, by name, then by index */
  uint32_t skin_count;
  tw_skin *skins;
  uint32_t clip_count;
  tw_clip_keys *clips;
  uint32_t material_count;     /* of assets, or of names an OBJ uses */
  uint32_t group_count;        /* sets of groups that faces are in */
  const char **material_names; /* [material_count], entries may be NULL */
  uint32_t slot_count;
  const tw_material_slot *slots; /* [slot_count]: face_materials from material_count on */
  const char **group_names;      /* [group_count] the names of a set, a blank between two */
  const tw_gltf_assets *assets;  /* or NULL */
  uint32_t warning_count;
  const char **warnings; /* [warning_count] sentences */
} tw_model;

tw_model *tw_model_create(void);        /* an empty one with its arena; NULL without memory */
void tw_model_destroy(tw_model *model); /* NULL accepted */

/* Adds a sentence to the warnings. At most 64 are kept; the last then says that there are more.
 * Lost without memory. */
void tw_model_warn(tw_model *model, const char *format, ...) TW_PRINTF(2, 3);

/* Completes and checks what every reader must: every mesh by tw_mesh_check, node indices, names,
 * hierarchy (fills node_order and named_nodes), skins, and each clip as tw_clip_create does.
 * A model with meshes and no node at all gets one node a mesh.
 * Errors bear a pointer in tweend JSON's words ("/meshes/0/faces/3/1"). */
tw_status tw_model_finish(tw_model *model, tw_error *error);

/* What every reader ends with. status TW_OK: finishes the model and hands it out; else, and where it cannot
 * be finished, destroys it (NULL accepted). Returns the status. */
tw_status tw_model_end(tw_model *model, tw_status status, tw_model **out, tw_error *error);

/* Makes one of the points of each mesh within a distance of a first one, 0: at the same place; faces that
 * this leaves with fewer than three points go, with a warning. Of a model that nobody else sees yet. The
 * distance is 1e-12 or more, or 0. TW_NO_MEMORY: some meshes may be welded. O(n log n). */
tw_status tw_model_weld(tw_model *model, double distance, tw_error *error);

/* Bytes the model holds in memory. */
size_t tw_model_size(const tw_model *model);

/* Node of a finished model by name as clients see it ("node_3" for a nameless one), clip likewise ("clip_0");
 * TW_NO_INDEX when there is none. The first of equal names wins. O(log n) for nodes. */
uint32_t tw_model_find_node(const tw_model *model, const char *name, size_t length);
uint32_t tw_model_find_clip(const tw_model *model, const char *name, size_t length);

/* The nodes that bear the same name as `node`, which is one of them: *out [count], ascending. 0 for a
 * nameless one. O(log n + count). */
uint32_t tw_model_namesakes(const tw_model *model, uint32_t node, const uint32_t **out);

/* The material of a value of face_materials, -1 without one. */
int32_t tw_model_material(const tw_model *model, int32_t face_material);

/* The name clients see. buffer: room for a made-up one. */
const char *tw_model_node_name(const tw_model *model, uint32_t node, char buffer[24]);
const char *tw_model_clip_name(const tw_model *model, uint32_t clip, char buffer[24]);

#ifdef __cplusplus
}
#endif
#endif
