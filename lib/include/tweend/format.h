/* Formats: bytes to models, surfaces to bytes. Safe on untrusted bytes throughout. */
#ifndef TWEEND_FORMAT_H
#define TWEEND_FORMAT_H

#include "tweend/model.h"
#include "tweend/subdiv.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How glTF triangles become polygons. */
typedef enum tw_quads { TW_QUADS_NGON, TW_QUADS_AUTO, TW_QUADS_OFF } tw_quads;

/* The most bytes that reading a document of `size` bytes holds at a time, the document and the model
 * included: documents that would take more are refused. Never over 64 MiB and six times the size. */
uint64_t tw_reading_size(tw_format format, uint64_t size);

/* The format that the bytes themselves show: GLB and PLY by their magic, STL by its first word or, where it
 * is binary, by its count of facets, JSON by its first brace (glTF when it has a top-level "asset"), else
 * OBJ. */
tw_format tw_format_sniff(const uint8_t *bytes, size_t size);

/* Wavefront OBJ. bytes: [size], UTF-8 or Latin-1, no terminator needed. Errors bear a line.
 * The file is one mesh with the name of its first `o` or `g`; objects that share no points (and a file
 * without tags) are a mesh and a node each. The names behind `g` are the set of groups of the faces that
 * follow (none for `default`, for more than 1024 bytes of them, and for new sets beyond 262,144). Elements
 * may be named before they are defined. Face corners without `vt` among others that have one get 0 0. Colours
 * behind points, or in comments as ZBrush writes them, are sRGB and become linear. Lines, points, free-form
 * geometry and MTL files are read over. Normals and smoothing groups are kept. Unless `weld` is TW_WELD_NONE
 * or the file has tags of edges, points or faces, points that were written twice along seams become one, with
 * a warning where faces go by it. A corner at the point of the one before it goes; a face that is left with
 * fewer than three different points goes too, with a warning. A file of points alone is a mesh without faces.
 * *out: a finished model (tw_model_finish has run). O(size). */
tw_status tw_obj_read(const uint8_t *bytes, size_t size, tw_weld weld, tw_model **out, tw_error *error);

/* The points of OBJ text alone, all of them in the order of the file; errors as for tw_obj_read. *out:
 * [*count][3] in the arena. */
tw_status tw_obj_read_points(const uint8_t *bytes, size_t size, tw_arena *arena, float **out, uint32_t *count,
                             tw_error *error);

/* STL, binary or text. All solids are one mesh, its name the first solid's; triangles that share an edge by
 * position share its points (lib/mesh/weld.h). Up to 1024 bytes behind the facets of binary STL are read
 * over. Errors bear a line, or name the facet. *out: a finished model. O(n log n). */
tw_status tw_stl_read(const uint8_t *bytes, size_t size, tw_weld weld, tw_model **out, tw_error *error);

/* PLY, text or binary in either byte order: positions, normals, faces, colours (sRGB, they become linear),
 * texture coordinates of vertices; a warning names other elements and properties. Vertices that were split
 * along seams become one point again. Errors bear a line of text, or name the vertex or face. *out: a
 * finished model. O(n log n). */
tw_status tw_ply_read(const uint8_t *bytes, size_t size, tw_weld weld, tw_model **out, tw_error *error);

/* glTF 2.0, JSON or GLB, one self-contained file: nothing outside `bytes` is ever opened. Guards
 * run before tinygltf sees a byte. Errors bear a pointer into the glTF document.
 * A glTF mesh is one tw_mesh: its triangles become polygons as `quads` says, vertices that were split for
 * the renderer become one point again (lib/weld.h), texture coordinates face-varying with v up. Elements
 * that are named over and over may not make a small file a large model (TW_LIMIT). json_values: the most that
 * its JSON may hold, of any kind; 0: any number.
 * *out: a finished model. */
tw_status tw_gltf_read(const uint8_t *bytes, size_t size, tw_quads quads, tw_weld weld, uint64_t json_values,
                       tw_model **out, tw_error *error);

/* A file that came along with a glTF. */
typedef struct tw_named_file {
  const char *name; /* as the sender wrote it, with or without folders; compared, never opened */
  const uint8_t *bytes;
  size_t size;
  bool is_used; /* set where the glTF names it */
} tw_named_file;

/* The GLB that a JSON glTF and the files it names make: files [file_count] in any order, found by the path of
 * the uri (percent-decoded), else by its base name where only one file has that. Files of buffers and images
 * become the BIN chunk; data URIs, and images behind http(s) addresses, stay. TW_INVALID with the pointer of
 * a uri whose file is not there; TW_LIMIT over `json_values` values (0: any number) or max_size bytes. *out:
 * malloc'ed [*out_size]; NULL where the document names no file, or is none: then it is complete, or a fault
 * that tw_gltf_read tells. O(size + names log names). */
tw_status tw_gltf_bundle(const uint8_t *bytes, size_t size, tw_named_file *files, uint32_t file_count,
                         uint64_t json_values, uint64_t max_size, uint8_t **out, size_t *out_size,
                         tw_error *error);

/* ---- answers, pulled ---------------------------------------------------------------------- */

typedef enum tw_polygons { TW_POLYGONS_TRIANGLES, TW_POLYGONS_NGON } tw_polygons;

/* How an answer holds what it draws. */
typedef enum tw_encoding {
  TW_ENCODING_FLOAT,
  /* KHR_mesh_quantization: positions in 16 bits, which a node or the matrices of a skin undo, normals and
   * tangents in 8, texture coordinates and colours in 16 where they are from 0 to 1, weights in 8; in
   * primitives of at most 65,534 vertices with indices of 16 bits. */
  TW_ENCODING_QUANTIZED,
  TW_ENCODING_MESHOPT /* the same by EXT_meshopt_compression */
} tw_encoding;

/* What the shorts of a mesh's positions stand for. */
typedef struct tw_grid {
  bool is_float;          /* nothing would undo them */
  float origin[3], scale; /* 32767 lies at origin + scale */
} tw_grid;

/* The grids of a model's meshes: each has its own, but those of one skin share one, which its matrices undo.
 * Meshes that EXT_mesh_gpu_instancing shows, that have points or lines, or whose node's weights
 * KHR_animation_pointer moves stay floats, and those that share a skin with them. The same whatever the
 * level: a surface stays within the hull of its cage. grids: [mesh_count]. O(points + nodes). TW_NO_MEMORY.
 */
tw_status tw_grids_choose(const tw_model *model, tw_grid *grids);

typedef struct tw_pack_options {
  tw_encoding encoding; /* but FLOAT */
  tw_polygons polygons;
  tw_grid grid;
  bool is_measured; /* by a pass over all points; else by one over faces alone */
} tw_pack_options;

/* A surface as an encoding has it: which faces are a primitive; when it is measured, the bounds of what is
 * stored, and the sizes of what is compressed. Immutable. */
typedef struct tw_packs tw_packs;

/* mesh: what the surface is of. parallel as of tw_surface_create_by. TW_CANCELLED, TW_NO_MEMORY. */
tw_status tw_packs_create(const tw_mesh *mesh, const tw_surface *surface, const tw_pack_options *options,
                          const tw_parallel_for *parallel, tw_packs **out, tw_error *error);
void tw_packs_destroy(tw_packs *packs);      /* NULL accepted */
size_t tw_packs_size(const tw_packs *packs); /* bytes held */
/* Of the library that compresses: another version may compress to other bytes. */
int tw_meshopt_version(void);
/* What making a surface's packs holds at most. */
uint64_t tw_packs_building_size(const tw_surface *surface);
/* What a stream holds to read them. */
size_t tw_packs_reading_size(const tw_packs *packs);

/* Holes of a cage, for a surface from which a glTF is written that reads back as the cage: they are faces of
 * materials of their own, TW_HOLE_MATERIAL + 1 and their material, which come last. */
enum { TW_HOLE_MATERIAL = 1 << 30 };

/* A view of the mesh with its holes as faces like that. Its array of materials lives in the arena. O(faces).
 * TW_NO_MEMORY. */
tw_status tw_mesh_open_holes(const tw_mesh *mesh, tw_arena *arena, tw_mesh *out);

typedef struct tw_scene {
  const tw_model *model;             /* outlives the stream */
  const tw_surface *const *surfaces; /* [mesh_count]; outlive the stream */
  const tw_trs *pose;                /* [node_count] local transforms, or NULL for rest */
  const tw_clip *posed_by;           /* the clip of the pose (its nodes lose their matrix), or NULL */
  /* [node_count] morph weights of the pose, as many as the node's mesh has targets; NULL, for a node or for
   * all: the mesh's own. */
  const float *const *weights;
  /* [clip_count] kept as glTF animations in this order, but for one that moves nothing that is shown; outlive
   * the stream. Each has passed tw_clip_create. What glTF does not know (nlerp, squad, Euler and axis-angle
   * keys) becomes LINEAR keys, as dense as they need. */
  const tw_clip_keys *clips;
  uint32_t clip_count;
  tw_polygons polygons;
  /* [mesh_count] of the surfaces, all of one encoding and these polygons; outlive the stream. NULL: floats.
   * Packs that are not measured serve tw_gltf_stream_predict alone, and only quantized ones. */
  const tw_packs *const *packs;
  bool is_without_details; /* a cage does not say what is modelled onto its levels */
} tw_scene;

/* A glTF answer: its size is known when it is created, its bytes are computed when they are read.
 * Meshes, nodes, skins, materials, images, scenes and cameras have the numbers of the model; a surface
 * without faces is one triangle of no size. One primitive for the faces of a material, further ones for those
 * whose primitives said more in their file, then points and lines. With packs a material has a primitive for
 * each pack; nodes and skins that undo the shorts come after the model's.
 * Where all surfaces are `tagged` level 0, as floats and n-gons, extras.tweend of each mesh says what glTF
 * has no words for, so that tw_gltf_read makes the same mesh of it: {"points": which vertices are one point,
 * "faces": the mesh's faces in the order of the file (not where it is theirs), "starts": the corner of
 * the mesh's face that each begins with (not where all are the first), "creases": {"edges": [][2],
 * "sharpness"}, "corners": {"vertices", "sharpness"}, "groups": {"names": ["a b", ...], "faces": which, or
 * 2^32 - 1}, "holes": [{"indices", "material"}], "details": [{"level", "offsets"}] as tw_detail, "rules":
 * {"boundary", "uv", "creasing", "triangles"}}; numbers but those of levels, materials and rules are
 * accessors. Holes are drawn by no primitive. */
typedef struct tw_gltf_stream tw_gltf_stream;

/* container: TW_FORMAT_GLB, or TW_FORMAT_GLTF (one JSON file, buffers as base64 data URIs).
 * TW_LIMIT: over 4 GiB - 1 for a GLB; over 262,144 nodes, materials, accessors and buffer views. */
tw_status tw_gltf_stream_create(const tw_scene *scene, tw_format container, tw_gltf_stream **out,
                                tw_error *error);
void tw_gltf_stream_destroy(tw_gltf_stream *stream); /* NULL accepted */
uint64_t tw_gltf_stream_size(const tw_gltf_stream *stream);

/* The next bytes, at most `capacity`; 0 at the end. Reading the JSON asks for the surfaces' bounds:
 * where they are not known yet and there is no memory to compute them with, less is read, and 0 before
 * the end. */
size_t tw_gltf_stream_read(tw_gltf_stream *stream, uint8_t *out, size_t capacity);

/* Continues at any offset (Range requests). */
void tw_gltf_stream_seek(tw_gltf_stream *stream, uint64_t offset);

/* The size such a stream would have, without computing a point: exact, because the JSON reserves a
 * fixed width for the bounds. Compressed packs must be measured. Errors as tw_gltf_stream_create. */
tw_status tw_gltf_stream_predict(const tw_scene *scene, tw_format container, uint64_t *size, tw_error *error);

/* OBJ text: positions, UVs, normals and faces of every mesh, once for each node that shows it, in the
 * world space of the scene's pose (OBJ has no hierarchy), and the tags of surfaces that were made `tagged`,
 * as tw_obj_read reads them. Size unknown until the end. The scene's clips and polygons play no part: faces
 * stay as they are. */
typedef struct tw_obj_stream tw_obj_stream;
tw_status tw_obj_stream_create(const tw_scene *scene, tw_obj_stream **out, tw_error *error);
void tw_obj_stream_destroy(tw_obj_stream *stream); /* NULL accepted */
size_t tw_obj_stream_read(tw_obj_stream *stream, uint8_t *out, size_t capacity);

#ifdef __cplusplus
}
#endif
#endif
