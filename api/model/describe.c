/* Prints the description of a model: its contents and statistics. */
#include "models.h"
#include "node_names.h"
#include "tweend/mix.h"
#include "tweend/retarget.h"

#include <stdio.h>
#include <string.h>

const char *api_model_name(const tw_model *model) {
  if (model->name) return model->name;
  for (uint32_t i = 0; i < model->mesh_count; i++)
    if (model->meshes[i].name) return model->meshes[i].name;
  for (uint32_t i = 0; i < model->node_count; i++)
    if (model->nodes[i].name) return model->nodes[i].name;
  for (uint32_t i = 0; i < model->clip_count; i++)
    if (model->clips[i].name) return model->clips[i].name;
  return NULL;
}

bool api_tell_name(api_call *call, const char *name) {
  call->told_name = name ? tw_arena_text(call->arena, name, strlen(name)) : NULL;
  return !name || call->told_name;
}

void api_model_print_listed(const tw_model *model, tw_text *out) {
  tw_member_string(out, "name", api_model_name(model));
  tw_member_string(out, "format", tw_format_names[model->format]);
}

/* Prints {"3":2,"4":6}: how many there are of each size. */
static void member_histogram(tw_text *out, const char *name, uint32_t count, const uint32_t *sizes,
                             const uint32_t *numbers) {
  tw_member_open(out, name, "{");
  for (uint32_t i = 0; i < count; i++) {
    char size[16];
    snprintf(size, sizeof size, "%u", sizes[i]);
    tw_member_count(out, size, numbers[i]);
  }
  tw_text_add(out, "}");
}

/* The first edges of a kind, each as two points. */
static void member_edges(tw_text *out, const char *name, uint32_t count, const uint32_t (*edges)[2]) {
  tw_member_open(out, name, "[");
  for (uint32_t i = 0; i < count; i++) {
    tw_text_element(out);
    tw_text_add(out, "[");
    for (int end = 0; end < 2; end++) {
      tw_text_element(out);
      tw_text_count(out, edges[i][end]);
    }
    tw_text_add(out, "]");
  }
  tw_text_add(out, "]");
}

/* The first edges and vertices at which the mesh is not manifold, by their points. */
static void member_nonmanifold(tw_text *out, const tw_mesh_stats *facts) {
  tw_member_open(out, "nonmanifold", "{");
  member_edges(out, "edges", facts->listed_nonmanifold_edges,
               (const uint32_t(*)[2])facts->nonmanifold_edge_points);
  tw_member_open(out, "vertices", "[");
  for (uint32_t i = 0; i < facts->listed_nonmanifold_vertices; i++) {
    tw_text_element(out);
    tw_text_count(out, facts->nonmanifold_vertex_points[i]);
  }
  tw_text_add(out, "]}");
}

/* Seams between borders that coincide, and edges whose two faces have opposite winding. */
static void member_seams(tw_text *out, const tw_mesh *mesh, const tw_mesh_stats *facts) {
  uint32_t reversed = facts->reversed_borders + facts->reversed_edges;
  tw_member_count(out, "welded_points", mesh->welded_points);
  tw_member_count(out, "seam_edges", facts->seam_edges);
  tw_member_count(out, "reversed_edges", reversed);
  if (reversed > 0)
    member_edges(out, "reversed", facts->listed_reversed_edges,
                 (const uint32_t(*)[2])facts->reversed_edge_points);
}

static void print_facts(tw_text *out, const tw_mesh *mesh, const tw_mesh_stats *facts) {
  tw_member_count(out, "vertices", facts->vertices);
  tw_member_count(out, "edges", facts->edges);
  tw_member_count(out, "faces", facts->faces);
  member_histogram(out, "face_sizes", facts->face_size_count, facts->face_sizes, facts->face_size_faces);
  tw_member_count(out, "boundary_edges", facts->boundary_edges);
  tw_member_count(out, "boundary_loops", facts->boundary_loops);
  tw_member_count(out, "nonmanifold_edges", facts->nonmanifold_edges);
  tw_member_count(out, "nonmanifold_vertices", facts->nonmanifold_vertices);
  if (facts->nonmanifold_edges + facts->nonmanifold_vertices > 0) member_nonmanifold(out, facts);
  member_seams(out, mesh, facts);
  tw_member_count(out, "extraordinary_vertices", facts->extraordinary_vertices);
  member_histogram(out, "extraordinary_valences", facts->valence_count, facts->valences,
                   facts->valence_vertices);
  tw_member_count(out, "components", facts->components);
  tw_text_member(out, "euler_characteristic");
  tw_text_integer(out, facts->euler_characteristic);
  tw_member_open(out, "bounds", "{");
  tw_member_floats(out, "min", facts->min, 3);
  tw_member_floats(out, "max", facts->max, 3);
  tw_text_add(out, "}");
  tw_member_count(out, "unused_points", facts->unused_points);
  tw_member_count(out, "creases", facts->creases);
  tw_member_count(out, "corners", facts->sharp_points);
  tw_member_count(out, "holes", facts->holes);
  tw_member_open(out, "hard_edges", "{");
  tw_member_count(out, "tags", facts->creases);
  tw_member_count(out, "normals", facts->hard_edges.by_normals);
  tw_member_count(out, "angle_30", facts->hard_edges.by_30_degrees);
  tw_member_count(out, "auto", facts->hard_edges.by_auto);
  tw_member_count(out, "file", facts->hard_edges.by_file);
  tw_text_add(out, "}");
}

static void member_groups(tw_text *out, const tw_model *model, const tw_mesh_stats *facts) {
  enum { LISTED_MAX = 64 };
  tw_member_count(out, "group_count", facts->group_count);
  tw_member_open(out, "groups", "[");
  for (uint32_t i = 0; i < facts->group_count && i < LISTED_MAX; i++) {
    tw_text_element(out);
    tw_text_add(out, "{");
    tw_member_words(out, "names", model->group_names[facts->groups[i]]);
    tw_member_count(out, "faces", facts->group_faces[i]);
    tw_text_add(out, "}");
  }
  tw_text_add(out, "]");
}

/* What a description warns of beside the model's own warnings. */
typedef struct mesh_faults {
  uint64_t reversed_edges; /* between two faces of opposite winding */
  uint64_t seam_edges;     /* open, but not for their winding */
  uint64_t folded_edges;   /* between two sides of one face */
  uint64_t lost_creases, overruled_tags, repeated_tags;
  api_hard hard;
  uint32_t mesh, points[2]; /* of the first lost crease */
} mesh_faults;

static void add_faults(mesh_faults *faults, uint32_t mesh, const tw_mesh_stats *facts) {
  faults->reversed_edges += facts->reversed_edges;
  faults->seam_edges += facts->seam_edges - facts->folded_edges - 2 * (uint64_t)facts->reversed_borders;
  faults->folded_edges += facts->folded_edges;
  if (faults->lost_creases == 0) {
    faults->mesh = mesh;
    memcpy(faults->points, facts->lost_crease, sizeof faults->points);
  }
  faults->lost_creases += facts->lost_creases;
  faults->overruled_tags += facts->overruled_tags;
  faults->repeated_tags += facts->repeated_tags;
  faults->hard.edges += facts->hard_edges.by_file;
  faults->hard.corners += facts->hard_edges.corners_by_file;
}

static tw_status print_mesh(tw_text *out, const tw_model *model, uint32_t index, mesh_faults *faults,
                            tw_error *error) {
  const tw_mesh *mesh = &model->meshes[index];
  tw_mesh_stats facts = {0};
  tw_status status = tw_mesh_describe(mesh, &facts, error);
  if (status != TW_OK) {
    tw_mesh_stats_deinit(&facts);
    return status;
  }
  tw_text_element(out);
  tw_text_add(out, "{");
  tw_member_string(out, "name", mesh->name);
  print_facts(out, mesh, &facts);
  tw_member_count(out, "paired_quads", mesh->joined_quads);
  member_groups(out, model, &facts);
  tw_member_count(out, "uv_sets", mesh->uv_set_count);
  tw_member_count(out, "morph_targets", mesh->morph_count);
  tw_member_open(out, "details", "[");
  for (uint32_t i = 0; i < mesh->detail_count; i++) {
    tw_text_element(out);
    tw_text_count(out, mesh->details[i].level);
  }
  tw_text_add(out, "]");
  tw_text_member(out, "skinned");
  tw_text_flag(out, mesh->skin.joints != NULL);
  tw_text_add(out, "}");
  add_faults(faults, index, &facts);
  tw_mesh_stats_deinit(&facts);
  return TW_OK;
}

/* An index, or null. */
static void member_index(tw_text *out, const char *name, uint32_t index) {
  tw_text_member(out, name);
  if (index == TW_NO_INDEX)
    tw_text_add(out, "null");
  else
    tw_text_count(out, index);
}

static void print_node(tw_text *out, const tw_model *model, uint32_t index) {
  const tw_node *node = &model->nodes[index];
  tw_text_element(out);
  tw_text_add(out, "{");
  api_node_name_member(out, "name", model, index);
  api_node_name_member(out, "parent", model, node->parent);
  member_index(out, "mesh", node->mesh);
  member_index(out, "skin", node->skin);
  tw_member_open(out, "rest", "{");
  tw_member_floats(out, "translation", node->rest.translation, 3);
  tw_member_floats(out, "rotation", node->rest.rotation, 4);
  tw_member_floats(out, "scale", node->rest.scale, 3);
  if (node->has_matrix) tw_member_floats(out, "matrix", node->matrix, 16);
  tw_text_add(out, "}}");
}

/* The humanoid map, {"hips":"node name"}; nothing where the file has none. */
static void member_humanoid(tw_text *out, const tw_model *model) {
  if (!model->humanoid) return;
  tw_member_open(out, "humanoid", "{");
  for (uint32_t i = 0; i < TW_BONES; i++)
    if (model->humanoid[i] != TW_NO_INDEX)
      api_node_name_member(out, tw_bone_names[i], model, model->humanoid[i]);
  tw_text_add(out, "}");
}

static void print_skin(tw_text *out, const tw_model *model, uint32_t index) {
  const tw_skin *skin = &model->skins[index];
  tw_text_element(out);
  tw_text_add(out, "{");
  tw_member_string(out, "name", skin->name);
  api_node_name_member(out, "skeleton", model, skin->skeleton);
  tw_text_member(out, "joints");
  api_node_names_print(model, skin->joints, skin->joint_count, out);
  tw_text_add(out, "}");
}

static void print_layers(tw_text *out, const tw_clip_keys *clip) {
  static const char *const modes[] = {"replace", "additive"};
  tw_member_open(out, "layers", "[");
  for (uint32_t i = 0; i < clip->layer_count; i++) {
    tw_text_element(out);
    tw_text_add(out, "{");
    tw_member_string(out, "clip", clip->layers[i].clip);
    tw_member_string(out, "mode", modes[clip->layers[i].layer.mode == TW_LAYER_ADDITIVE]);
    tw_text_add(out, "}");
  }
  tw_text_add(out, "]");
}

static void print_clip(tw_text *out, const tw_model *model, uint32_t index) {
  const tw_clip_keys *clip = &model->clips[index];
  char buffer[24];
  uint64_t keys = 0;
  for (uint32_t i = 0; i < clip->track_count; i++) keys += clip->tracks[i].key_count;
  tw_text_element(out);
  tw_text_add(out, "{");
  tw_member_string(out, "name", tw_model_clip_name(model, index, buffer));
  if (clip->layer_count > 0 && clip->mixed_duration < 0)
    tw_member_string(out, "duration", NULL); /* clips of other models tell it */
  else
    tw_member_float(out, "duration", tw_keys_duration(clip));
  tw_member_count(out, "tracks", clip->track_count);
  tw_member_count(out, "keys", keys);
  if (clip->layer_count > 0) print_layers(out, clip);
  tw_text_add(out, "}");
}

/* Adds warnings to the array that is open, and to the answer's header. */
static void add_warnings(tw_text *out, const char *const *warnings, uint32_t count, api_call *call) {
  for (uint32_t i = 0; i < count; i++) {
    tw_text_element(out);
    tw_text_string(out, warnings[i]);
  }
  api_call_warn(call, warnings, count);
}

const char *api_hard_warning(api_call *call, api_hard hard) {
  tw_text text = {0};
  if (hard.edges > 0) {
    tw_text_count(&text, hard.edges);
    tw_text_add(&text, tw_plural(hard.edges, " edge", " edges"));
  }
  if (hard.corners > 0) {
    tw_text_add(&text, hard.edges > 0 ? " and " : "");
    tw_text_count(&text, hard.corners);
    tw_text_add(&text, tw_plural(hard.corners, " corner", " corners"));
    tw_text_add(&text, hard.edges > 0 ? "" : tw_plural(hard.corners, " of a border", " of borders"));
  }
  tw_text_add(&text, hard.edges + hard.corners > 1
                         ? " are kept hard as the file shows them: creases=tags rounds them"
                         : " is kept hard as the file shows it: creases=tags rounds it");
  return api_text_move(&text, call->arena);
}

static void add_fault_warnings(tw_text *out, const tw_model *model, const mesh_faults *faults,
                               api_call *call) {
  char text[160];
  const char *const warning = text;
  if (faults->reversed_edges > 0) {
    snprintf(text, sizeof text, "%llu %s two faces are wound against each other",
             (unsigned long long)faults->reversed_edges,
             tw_plural(faults->reversed_edges, "edge is a crease: its", "edges are creases: their"));
    add_warnings(out, &warning, 1, call);
  }
  if (faults->seam_edges > 0 && !model->warns_of_seams) {
    snprintf(text, sizeof text, "%llu %s points apart", (unsigned long long)faults->seam_edges,
             tw_plural(faults->seam_edges, "edge lies on another and stays an open seam: the file keeps its",
                       "edges lie on one another and stay open seams: the file keeps their"));
    add_warnings(out, &warning, 1, call);
  }
  if (faults->folded_edges > 0) {
    snprintf(text, sizeof text,
             "%llu edges have one face on both sides, which names their points twice: they stay open",
             (unsigned long long)faults->folded_edges);
    add_warnings(out, &warning, 1, call);
  }
  if (faults->hard.edges > 0 || faults->hard.corners > 0) {
    const char *hard = api_hard_warning(call, faults->hard);
    if (hard) add_warnings(out, &hard, 1, call);
  }
  if (faults->lost_creases > 0) {
    snprintf(text, sizeof text, "%llu %s left out: no edge joins points %u and %u of mesh %u%s",
             (unsigned long long)faults->lost_creases,
             tw_plural(faults->lost_creases, "crease is", "creases are"), faults->points[0],
             faults->points[1], faults->mesh, faults->lost_creases > 1 ? ", for the first" : "");
    add_warnings(out, &warning, 1, call);
  }
  if (faults->overruled_tags > 0) {
    snprintf(
        text, sizeof text, "%llu %s: an edge or a point has another one with another sharpness behind it",
        (unsigned long long)faults->overruled_tags,
        tw_plural(faults->overruled_tags, "crease or corner is left out", "creases or corners are left out"));
    add_warnings(out, &warning, 1, call);
  }
  if (faults->repeated_tags > 0) {
    snprintf(text, sizeof text, "%llu %s", (unsigned long long)faults->repeated_tags,
             tw_plural(faults->repeated_tags, "crease, corner or hole is listed again: it counts once",
                       "creases, corners or holes are listed again: they count once"));
    add_warnings(out, &warning, 1, call);
  }
}

bool api_describe(const tw_model *model, const char *id, uint64_t size, tw_text *out, api_call *call) {
  tw_text_add(out, "{");
  tw_member_string(out, "id", id);
  tw_member_string(out, "name", api_model_name(model));
  tw_member_string(out, "format", tw_format_names[model->format]);
  tw_member_count(out, "bytes", size);
  tw_member_open(out, "meshes", "[");
  tw_status status = TW_OK;
  mesh_faults faults = {0};
  for (uint32_t i = 0; i < model->mesh_count && status == TW_OK; i++)
    status = print_mesh(out, model, i, &faults, &call->fault.error);
  tw_text_add(out, "]");
  tw_member_open(out, "nodes", "[");
  for (uint32_t i = 0; i < model->node_count; i++) print_node(out, model, i);
  tw_text_add(out, "]");
  member_humanoid(out, model);
  tw_member_open(out, "skins", "[");
  for (uint32_t i = 0; i < model->skin_count; i++) print_skin(out, model, i);
  tw_text_add(out, "]");
  tw_member_open(out, "clips", "[");
  for (uint32_t i = 0; i < model->clip_count; i++) print_clip(out, model, i);
  tw_text_add(out, "]");
  if (status != TW_OK) {
    api_fault_complete(&call->fault);
    return false;
  }
  tw_member_open(out, "warnings", "[");
  add_warnings(out, model->warnings, model->warning_count, call);
  add_fault_warnings(out, model, &faults, call);
  tw_text_add(out, "]}\n");
  return api_tell_name(call, api_model_name(model)) || api_fault_without_memory(&call->fault);
}
