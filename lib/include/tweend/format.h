/* Formats: bytes to models, surfaces to bytes. Readers are safe on untrusted bytes. */
#ifndef TWEEND_FORMAT_H
#define TWEEND_FORMAT_H

#include "tweend/model.h"
#include "tweend/subdiv.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How triangles of glTF and STL, which cannot store polygons, become polygons. NGON: as FB_ngon_encoding
 * marks them. AUTO: the same, and triangles of meshes without such marks are paired into quads, with a
 * warning. OFF: all faces stay triangles. USUAL: AUTO. */
typedef enum tw_quads { TW_QUADS_USUAL, TW_QUADS_NGON, TW_QUADS_AUTO, TW_QUADS_OFF } tw_quads;

/* What USUAL means for a file of a format: AUTO, and NGON where the format has polygons. */
static inline tw_quads tw_quads_of(tw_quads quads, tw_format format) {
  bool has_polygons = format != TW_FORMAT_STL && format != TW_FORMAT_GLTF && format != TW_FORMAT_GLB;
  return quads != TW_QUADS_USUAL ? quads : has_polygons ? TW_QUADS_NGON : TW_QUADS_AUTO;
}

/* The most memory in bytes that reading a document of `size` bytes may take, the document and the model
 * included; readers refuse a document that needs more. At most 64 MiB + 6 * size. */
uint64_t tw_reading_size(tw_format format, uint64_t size);

/* Recognises a format by its bytes: GLB and PLY by their magic, STL by its first word or, if binary, by its
 * facet count, BVH by its first word, JSON by its opening brace (glTF if it has a top-level "asset", or
 * without it "accessors", "buffers", "bufferViews" or "scenes"), anything else is OBJ. */
tw_format tw_format_sniff(const uint8_t *bytes, size_t size);

/* Wavefront OBJ. bytes: [size], UTF-8 or Latin-1, no terminator needed. Errors carry a line.
 * The file becomes one mesh, named after its first `o` or `g`. If no two objects share a point and the file
 * tags no edge, point or face, each object becomes a mesh with a node of its own. The names behind `g` are
 * the set of groups of the faces that follow (none for `default`, for more than 1024 bytes of names, and for
 * new sets beyond 262,144). Faces may name elements that are defined later. Where only some face corners have
 * a `vt`, the others get UV 0 0. Colours behind points, or in comments as ZBrush writes them, are sRGB and
 * become linear. `l` and `p` elements, free-form geometry and MTL files are left out. Normals and smoothing
 * groups are kept. What is left out or changed is told in a warning, here and in all readers. Points that are
 * duplicated along seams are merged, with a warning where faces collapse by it, unless `weld` is TW_WELD_NONE
 * or the file has a subdivision tag. A corner at the same point as the corner before it is dropped; a face
 * left with fewer than three different points is dropped too, with a warning. A file of points alone is a
 * mesh without faces. *out: a finished model (tw_model_finish has run). O(size). */
tw_status tw_obj_read(const uint8_t *bytes, size_t size, tw_weld weld, tw_model **out, tw_error *error);

/* Reads only the points of an OBJ file, all of them, in file order; errors as for tw_obj_read. at: subtracted
 * in double before they are rounded. *out: [*count][3] in the arena. */
tw_status tw_obj_read_points(const uint8_t *bytes, size_t size, const double at[3], tw_arena *arena,
                             float **out, uint32_t *count, tw_error *error);

/* STL, binary or text. All solids become one mesh, named after the first solid that has a name; triangles
 * that share an edge by position share its points (lib/mesh/weld.h), and become quads as `quads` says.
 * Colours of facets (VisCAM, Magics; sRGB) become linear. Facets may carry as many bytes as their attribute
 * says, if the size of the file says so, too. Up to 1024 bytes behind the facets of binary STL, and facets
 * that the count leaves out, are left out. Errors carry a line of text, or name the facet. *out: a finished
 * model. O(n log n). */
tw_status tw_stl_read(const uint8_t *bytes, size_t size, tw_quads quads, tw_weld weld, tw_model **out,
                      tw_error *error);

/* PLY, text or binary in either byte order: positions, normals, colours (sRGB, which become linear) and
 * texture coordinates of vertices, or colours and texture coordinates of faces; faces, and strips of
 * triangles. A warning names other elements and properties. Vertices that were split along seams become one
 * point again. Errors carry a line of text, or name the vertex or face. *out: a finished model. O(n log n).
 */
tw_status tw_ply_read(const uint8_t *bytes, size_t size, tw_weld weld, tw_model **out, tw_error *error);

/* BVH: a hierarchy of joints and its motion. A joint becomes a node at its OFFSET, an End Site a leaf named
 * after its parent with _end (one without a name where the parent has another). The frames become one clip,
 * "motion", with a key a frame, the first at time 0: rotation channels a track of Euler angles in the order
 * of CHANNELS, which axes without a channel follow with an angle of 0; position channels a track of
 * translations, with the OFFSET of axes without a channel. Joints at the outermost level are roots, whether
 * ROOT or JOINT. Keywords may have either case, lines end with LF, CRLF or CR. Channels of scale, the names
 * of end sites, an incomplete last frame and another number of frames than Frames: says are told in warnings.
 * Errors carry a line: TW_SYNTAX for what is no number, TW_INVALID for one that does not fit, TW_UNSUPPORTED
 * for a joint that turns about one axis twice, TW_LIMIT over TW_NODES_MAX joints or 2^23 frames, or where
 * keys would take more than tw_reading_size. *out: a finished model. Takes the memory of the model and of the
 * hierarchy. O(size). */
tw_status tw_bvh_read(const uint8_t *bytes, size_t size, tw_model **out, tw_error *error);

/* glTF 2.0, JSON or GLB, one self-contained file: nothing outside `bytes` is ever opened, and the document is
 * checked before tinygltf parses it. Errors carry a JSON pointer into the glTF document.
 * A glTF mesh is one tw_mesh: its triangles become polygons as `quads` says, vertices that were split for the
 * renderer become one point again (lib/mesh/weld.h), texture coordinates are face-varying with v up. A small
 * file cannot become a large model by naming the same elements many times (TW_LIMIT). json_values: the most
 * JSON values of any kind; 0: any number.
 * *out: a finished model. */
tw_status tw_gltf_read(const uint8_t *bytes, size_t size, tw_quads quads, tw_weld weld, uint64_t json_values,
                       tw_model **out, tw_error *error);

/* A file that was sent together with a glTF. */
typedef struct tw_named_file {
  const char *name; /* as the sender wrote it, with or without folders; compared, never opened */
  const uint8_t *bytes;
  size_t size;
  bool is_used; /* set if the glTF names the file */
} tw_named_file;

/* Joins a glTF, JSON or GLB, and the files that it names into one GLB. files: [file_count] in any order; a
 * uri finds its file by the percent-decoded path, else by the base name if only one file has it. Files of
 * buffers and images go into the BIN chunk, behind what a GLB has there; data URIs, and images at http(s)
 * addresses, stay as they are. TW_INVALID with the pointer of a uri whose file is missing; TW_LIMIT over
 * `json_values` values (0: any number) or max_size bytes. *out: malloc'ed [*out_size]; NULL if the document
 * names no file or is not a JSON object, so that tw_gltf_read takes it as it is. What stands behind the
 * chunks of a GLB is kept. O(size + names log names). */
tw_status tw_gltf_bundle(const uint8_t *bytes, size_t size, tw_named_file *files, uint32_t file_count,
                         uint64_t json_values, uint64_t max_size, uint8_t **out, size_t *out_size,
                         tw_error *error);

/* ---- answers, computed as they are read ------------------------------------------------------ */

typedef enum tw_polygons { TW_POLYGONS_TRIANGLES, TW_POLYGONS_NGON } tw_polygons;

/* How an answer stores vertices and indices. */
typedef enum tw_encoding {
  TW_ENCODING_FLOAT,
  /* KHR_mesh_quantization: 16-bit positions, which a node or the inverse bind matrices of a skin scale back;
   * 8-bit normals and tangents; 16-bit colours, and 16-bit texture coordinates where they lie from 0 to 1;
   * 8-bit weights; primitives of at most 65,534 vertices with 16-bit indices. */
  TW_ENCODING_QUANTIZED,
  TW_ENCODING_MESHOPT /* the same, compressed by EXT_meshopt_compression */
} tw_encoding;

/* How the 16-bit positions of a mesh map to coordinates. */
typedef struct tw_grid {
  bool is_float;          /* positions stay floats, as nothing could scale them back */
  float origin[3], scale; /* 32767 lies at origin + scale */
} tw_grid;

/* Chooses a grid for each mesh of a model. Meshes of one skin share a grid, because the skin's inverse bind
 * matrices scale it back. Floats stay in meshes that EXT_mesh_gpu_instancing draws, meshes that have points
 * or lines, meshes of a node whose weights KHR_animation_pointer moves, and meshes that share a skin with one
 * of these. A grid covers the cage, and so every level of it: a surface stays within the hull of its cage.
 * Where details or Chaikin's rule lead out of the hull, it covers the surface too. surfaces: [mesh_count] of
 * the meshes. parallel: as for tw_surface_create_by. grids: [mesh_count]. O(points + nodes), and
 * tw_surface_bounds_by. TW_CANCELLED, TW_NO_MEMORY. */
tw_status tw_grids_choose(const tw_model *model, const tw_surface *const *surfaces,
                          const tw_parallel_for *parallel, tw_grid *grids);

typedef struct tw_pack_options {
  tw_encoding encoding; /* not TW_ENCODING_FLOAT */
  tw_polygons polygons;
  tw_grid grid;
  bool is_measured; /* true: a pass over all points finds bounds and sizes; false: only the faces are read */
} tw_pack_options;

/* A surface cut into packs, each of which becomes a primitive. Measured packs also know the bounds of the
 * stored values and the sizes of the compressed bytes. Immutable. */
typedef struct tw_packs tw_packs;

/* mesh: the mesh of the surface; not kept. parallel: as for tw_surface_create_by. TW_CANCELLED,
 * TW_NO_MEMORY. */
tw_status tw_packs_create(const tw_mesh *mesh, const tw_surface *surface, const tw_pack_options *options,
                          const tw_parallel_for *parallel, tw_packs **out, tw_error *error);
void tw_packs_destroy(tw_packs *packs);      /* NULL accepted */
size_t tw_packs_size(const tw_packs *packs); /* bytes held */
/* The version of meshoptimizer: another version may compress to other bytes. */
int tw_meshopt_version(void);
/* Bytes that a stream holds to read these packs. */
size_t tw_packs_reading_size(const tw_packs *packs);

/* Marks the holes of a cage that is written as glTF and read back as the cage: a hole of material m is a face
 * of material TW_HOLE_MATERIAL + 1 + m. So holes are groups of their own, the last ones of the surface. */
enum { TW_HOLE_MATERIAL = 1 << 30 };

/* A view of the mesh whose holes are faces with these materials. Its array of materials lives in the arena.
 * O(faces). TW_NO_MEMORY. */
tw_status tw_mesh_open_holes(const tw_mesh *mesh, tw_arena *arena, tw_mesh *out);

typedef struct tw_scene {
  const tw_model *model;             /* outlives the stream */
  const tw_surface *const *surfaces; /* [mesh_count]; outlive the stream */
  const tw_trs *pose;                /* [node_count] local transforms, or NULL for rest */
  const tw_clip *posed_by;           /* the clip of the pose (nodes it moves lose their matrix), or NULL */
  /* [node_count] morph weights of the pose, each [targets of the node's mesh]. NULL, for one node or for all:
   * the model's own weights. */
  const float *const *weights;
  /* [clip_count] become glTF animations in this order, except a clip that moves nothing glTF can animate;
   * outlive the stream. Each has passed tw_clip_create. Keys that glTF does not have (nlerp, squad, Euler and
   * axis-angle) become LINEAR keys, as dense as they need to be. */
  const tw_clip_keys *clips;
  uint32_t clip_count;
  tw_polygons polygons;
  /* [mesh_count] packs of the surfaces, all of one encoding and of `polygons`; outlive the stream. NULL:
   * floats. Packs that are not measured serve tw_gltf_stream_predict alone, and only if quantized without
   * compression. */
  const tw_packs *const *packs;
  bool is_without_details; /* a cage leaves out the details modelled onto its levels */
} tw_scene;

/* A glTF answer: its size is known when it is created, its bytes are computed when they are read.
 * Meshes, nodes, skins, materials, images, scenes and cameras keep the numbers of the model; a surface
 * without faces is one triangle of no size. Each material of a mesh has one primitive for its faces, and
 * further ones for faces whose primitives held more in their file (extras, extensions); points and lines
 * follow. With packs, a material has a primitive for each pack, and nodes that scale positions back follow
 * the model's.
 * Where all surfaces are `tagged` level 0, as floats and n-gons, extras.tweend of each mesh holds what glTF
 * cannot say, so that tw_gltf_read makes the same mesh of it: {"points": the point of each vertex, "faces":
 * the mesh's face that each face of the answer is (left out if they ascend), "starts": the corner of the
 * mesh's face that each face of the answer begins with (left out if all are 0), "polygons": {"triangles": the
 * number of the first triangle of each face that no fan shows, "sizes", "corners": their vertices}, "values":
 * {"TEXCOORD_0", ...} for attributes of corners that are read otherwise without it: of each vertex the number
 * of its value, "creases": {"edges": [][2], "sharpness"}, "corners": {"vertices", "sharpness"}, "groups":
 * {"names": ["a b", ...], the sets that faces of the mesh are in, "faces": the set of each face, an index of
 * names, or 2^32 - 1}, "holes": [{"indices", "material"}], "details": [{"level", "offsets"}] as tw_detail,
 * "rules": {"boundary", "uv", "creasing", "triangles"}, "computed_normals": 1 where the mesh has none,
 * "tangents": 1 where its surfaces have some that neither the file nor a normal map tells of}. All numbers
 * but levels, materials, rules and these two are indices of accessors. No primitive draws a hole. */
typedef struct tw_gltf_stream tw_gltf_stream;

/* container: TW_FORMAT_GLB, or TW_FORMAT_GLTF (one JSON file, buffers as base64 data URIs).
 * TW_LIMIT: over 4 GiB - 1 for a GLB; over 262,144 nodes, materials, accessors and buffer views. */
tw_status tw_gltf_stream_create(const tw_scene *scene, tw_format container, tw_gltf_stream **out,
                                tw_error *error);
void tw_gltf_stream_destroy(tw_gltf_stream *stream); /* NULL accepted */
uint64_t tw_gltf_stream_size(const tw_gltf_stream *stream);

/* Reads the next bytes, at most `capacity`, and returns how many; 0 at the end. The JSON contains the bounds
 * of the surfaces: if they are not known yet and there is no memory to compute them, fewer bytes are read,
 * and 0 before the end. */
size_t tw_gltf_stream_read(tw_gltf_stream *stream, uint8_t *out, size_t capacity);

/* Continues at any offset (Range requests). */
void tw_gltf_stream_seek(tw_gltf_stream *stream, uint64_t offset);

/* The size such a stream would have, without computing a point: exact, because the JSON reserves a
 * fixed width for the bounds. Compressed packs must be measured. Errors as tw_gltf_stream_create. */
tw_status tw_gltf_stream_predict(const tw_scene *scene, tw_format container, uint64_t *size, tw_error *error);

/* What a reader of vertices and triangles, which knows no extras.tweend, makes otherwise of a cage. */
typedef struct tw_cage_changes {
  bool joins_values; /* different values of corners at a point become one */
  bool parts_values; /* one value of corners at a point becomes several */
  bool joins_points; /* points at one place become one */
  bool parts_points; /* one point becomes several */
} tw_cage_changes;

/* Finds how the mesh changes when its surface is written as floats and uploaded, weld=auto. Vertices are read
 * as points and values that edges join; values are told where the points stay. surface: level 0 of the mesh,
 * without `limit`; of other positions it counts as of the mesh's. O(n log n) at worst, and seldom more than
 * O(corners). TW_NO_MEMORY, TW_CANCELLED. */
tw_status tw_find_cage_changes(const tw_surface *surface, const tw_mesh *mesh, tw_polygons polygons,
                               tw_cage_changes *out);

/* How often flat answers and OBJ show the mesh of a node: 0 where it has none or is hidden. */
uint64_t tw_node_times_shown(const tw_model *model, uint32_t node);
/* The places that EXT_mesh_gpu_instancing gives to a node whose mesh is where joints put it, or that baking
 * has left without one: OBJ and flat answers show none of them. */
uint64_t tw_node_lost_instances(const tw_model *model, uint32_t node);

/* Writes the matrices of places at which a node shows its mesh, from `first` on, of tw_node_times_shown: of
 * instances, or the node's own. world: the node's. */
void tw_node_places(const tw_model *model, uint32_t node, const float world[16], uint32_t first,
                    uint32_t count, float (*out)[16]);

/* Where flat answers and OBJ show a mesh. */
typedef struct tw_placement {
  uint32_t node, mesh;
  float world[16];
  double origin[3]; /* the translation of `world` before it was rounded */
  bool is_far;      /* floats would change the shape of the mesh there */
} tw_placement;

/* The first place of a node's mesh at rest; the node shows it at least once, and no joints move it. False
 * without memory. O(nodes + corners). */
bool tw_node_first_place(const tw_model *model, uint32_t node, tw_placement *out);

/* OBJ text: positions, UVs, normals and faces of every mesh, once for each node or instance of a node that
 * shows it, in the world space of the scene's pose (OBJ has no hierarchy), under the name of the node or else
 * the mesh, with a number behind a name that is taken, and the tags of surfaces that were made `tagged`, as
 * tw_obj_read reads them. Colours stand behind the points, as sRGB of six decimals; where faces of a point
 * have different colours, that of one of them. The size is unknown until the end. The scene's clips and
 * `polygons` are ignored: faces stay polygons. TW_LIMIT where coordinates are beyond floats. */
typedef struct tw_obj_stream tw_obj_stream;
tw_status tw_obj_stream_create(const tw_scene *scene, tw_obj_stream **out, tw_error *error);
void tw_obj_stream_destroy(tw_obj_stream *stream); /* NULL accepted */
size_t tw_obj_stream_read(tw_obj_stream *stream, uint8_t *out, size_t capacity);

/* A flat answer: the meshes of a scene in the world space of its pose, as printers and scanners read them, or
 * the points of one mesh. */
typedef enum tw_flat_form { TW_FLAT_STL, TW_FLAT_PLY, TW_FLAT_POINTS } tw_flat_form;

typedef struct tw_flat_options {
  tw_flat_form form;
  double scale;              /* of coordinates, above 0 */
  const char *unit;          /* their unit, as the head of STL and PLY names it; outlives the stream */
  bool has_normals, has_uvs; /* points have these, too; their surface must */
} tw_flat_options;

/* Binary STL or PLY: every mesh once for each node or instance of a node that shows it. The clips of the
 * scene are ignored, as are the polygons of STL, which has triangles alone. Every point of a surface is the
 * same bytes wherever it occurs, and once in PLY. PLY has normals and colours (sRGB) of points, one each, and
 * texture coordinates where they have seams of corners (`texcoord`). Where a node shows its mesh so far from
 * the origin that floats would change its shape, all is moved, as the head tells.
 *
 * TW_FLAT_POINTS, of a scene of one mesh and one node: "TWSB", uint32 1, uint32 length of the JSON that
 * follows, padded with spaces to a multiple of 4; then float32 rows in the order of TW_DOMAIN_POINTS, each a
 * position and, if wanted, a normal and the texture coordinates of the first set (v down). Where faces have
 * different ones at a point, it has those of one of them. All little-endian. */
typedef struct tw_flat_stream tw_flat_stream;

/* TW_LIMIT: over 2^32 - 1 triangles in STL, or points in PLY, or coordinates beyond floats. TW_NO_MEMORY. */
tw_status tw_flat_stream_create(const tw_scene *scene, const tw_flat_options *options, tw_flat_stream **out,
                                tw_error *error);
void tw_flat_stream_destroy(tw_flat_stream *stream); /* NULL accepted */
uint64_t tw_flat_stream_size(const tw_flat_stream *stream);

/* Reads the next bytes, at most `capacity`, and returns how many; 0 at the end. */
size_t tw_flat_stream_read(tw_flat_stream *stream, uint8_t *out, size_t capacity);
void tw_flat_stream_seek(tw_flat_stream *stream, uint64_t offset); /* continues at any offset */

/* Whether all is moved, by minus the origin in the model's unit; it is 0 else. */
bool tw_flat_stream_origin(const tw_flat_stream *stream, double origin[3]);
/* How often a mesh is shown where floats change its shape all the same. */
uint32_t tw_flat_stream_far_count(const tw_flat_stream *stream);

/* The size of such a stream, without computing a point. */
tw_status tw_flat_stream_predict(const tw_scene *scene, const tw_flat_options *options, uint64_t *size,
                                 tw_error *error);

/* The model part of a 3MF package, as XML: each mesh as an object, once as it is and once mirrored where
 * nodes mirror it; an item with a transform for each node or instance of a node that shows a mesh; materials
 * as base materials (sRGB). The scene's clips and polygons are ignored. All is moved where a flat answer
 * would be: readers hold transforms as floats. The size is unknown until the end. */
typedef struct tw_3mf_stream tw_3mf_stream;

typedef struct tw_3mf_options {
  double scale;        /* of coordinates and translations, above 0 */
  const char *unit;    /* one of 3MF's ("millimeter"); outlives the stream */
  const bool *is_open; /* [meshes] those that are no closed shells, whose objects are surfaces and no solids;
                          NULL: none. Outlives the stream */
} tw_3mf_options;

/* TW_LIMIT where coordinates are beyond floats. TW_NO_MEMORY. */
tw_status tw_3mf_stream_create(const tw_scene *scene, const tw_3mf_options *options, tw_3mf_stream **out,
                               tw_error *error);
void tw_3mf_stream_destroy(tw_3mf_stream *stream);                        /* NULL accepted */
uint64_t tw_3mf_stream_bound(const tw_3mf_stream *stream);                /* its size is at most this */
bool tw_3mf_stream_origin(const tw_3mf_stream *stream, double origin[3]); /* as tw_flat_stream_origin */
/* Fills `out`, and less only at the end; -1 where the work is no longer wanted (tw_work). */
int64_t tw_3mf_stream_read(tw_3mf_stream *stream, uint8_t *out, size_t capacity);

/* Which nodes of a model BVH has as joints, with their ancestors. */
typedef enum tw_bvh_choice {
  TW_BVH_MOVED, /* those whose transform the clip moves; all if it moves none */
  TW_BVH_ALL,   /* all; a still leaf that is an only child and named as its parent's end site is that */
  TW_BVH_LISTED
} tw_bvh_choice;

typedef struct tw_bvh_options {
  const tw_model *model; /* outlives the stream, as the clip does */
  const tw_clip *clip;   /* of the model; NULL: at rest */
  tw_bvh_choice choice;
  const bool *is_listed; /* [node_count] for TW_BVH_LISTED; not kept */
  int order;        /* a tw_euler_order; -1: of each joint the order farthest from lock in its worst frame */
  double from, fps; /* frame n shows the clip at from + n / fps seconds; fps is above 0 */
  uint64_t frame_count;
  tw_loop loop;
  double duration; /* as in tw_loop_time */
} tw_bvh_options;

/* BVH text of a moving hierarchy, as tw_bvh_read reads it: its size is unknown until the end, its frames are
 * computed when they are read. Three rotation channels a joint, of angles without jumps; position channels,
 * from an OFFSET of 0, on the root, on joints that the clip moves and where scale above them changes. A joint
 * "root" joins several roots. The End Site of a leaf is the node's child at rest. Joints stand where the
 * model has them; scale of the joints themselves, morph weights, and blanks in names are lost, with warnings.
 */
typedef struct tw_bvh_stream tw_bvh_stream;

/* TW_INVALID: no node is left; TW_CANCELLED; TW_NO_MEMORY. With order -1 computes all frames once. */
tw_status tw_bvh_stream_create(const tw_bvh_options *options, tw_bvh_stream **out, tw_error *error);
void tw_bvh_stream_destroy(tw_bvh_stream *stream); /* NULL accepted */

uint64_t tw_bvh_stream_numbers(const tw_bvh_stream *stream); /* in all frames */
/* *out: [count] sentences of the stream. Returns the count. */
uint32_t tw_bvh_stream_warnings(const tw_bvh_stream *stream, const char *const **out);

/* Reads the next bytes, at most `capacity`, and returns how many; 0 at the end, -1 without memory. */
int64_t tw_bvh_stream_read(tw_bvh_stream *stream, uint8_t *out, size_t capacity);

#ifdef __cplusplus
}
#endif
#endif
