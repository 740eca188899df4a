/* The JSON of a glTF answer: what the plan says, and behind it in every object what the file said beyond
 * that. */
#include <stdlib.h>
#include <string.h>

#include "gltf/gltf.h"
#include "tweend/json_text.h"

static const char NGON[] = "FB_ngon_encoding", QUANTIZATION[] = "KHR_mesh_quantization";

/* What stands between the quotes of a JSON string. */
typedef struct json_name {
  const char *text;
  size_t size;
} json_name;

typedef struct json_writer {
  const tw_gltf_plan *plan;
  const tw_scene *scene;
  const tw_gltf_assets *assets;
  tw_text *text;
  size_t (*bounds)[6]; /* of the next accessor that is BOUNDED_LATER */
  /* Extensions that occur in what is written, each at least once. */
  json_name *used;
  size_t used_count, used_capacity;
} json_writer;

/* ---- extensions ---------------------------------------------------------------------------------------- */

static int compare_names(const void *left, const void *right) {
  const json_name *a = left, *b = right;
  int order = memcmp(a->text, b->text, a->size < b->size ? a->size : b->size);
  return order != 0 ? order : (a->size > b->size) - (a->size < b->size);
}

static void note_name(json_writer *writer, const char *text, size_t size) {
  const json_name name = {text, size};
  if (writer->used_count > 0 && compare_names(&writer->used[writer->used_count - 1], &name) == 0) return;
  if (writer->used_count == writer->used_capacity) {
    size_t capacity = 2 * writer->used_capacity + 16;
    json_name *used = realloc(writer->used, capacity * sizeof *used);
    if (!used) {
      writer->text->failed = true;
      return;
    }
    writer->used = used;
    writer->used_capacity = capacity;
  }
  writer->used[writer->used_count++] = name;
}

/* Notes the extensions of an object or array and of all that is in it. Extras are the application's own. */
static void note_extensions(json_writer *writer, const char *container) {
  tw_json_item item;
  for (bool more = tw_json_first(container, &item); more;
       more = tw_json_next(tw_json_skip(item.value), &item)) {
    bool is_object = *item.value == '{';
    if (!is_object && *item.value != '[') continue;
    if (tw_json_key_is(&item, "extras")) continue;
    if (is_object && tw_json_key_is(&item, "extensions")) {
      tw_json_item extension;
      for (bool next = tw_json_first(item.value, &extension); next;
           next = tw_json_next(tw_json_skip(extension.value), &extension))
        note_name(writer, extension.key, extension.key_size);
    }
    note_extensions(writer, item.value);
  }
}

/* Sorts the names, each once. */
static void sort_used(json_writer *writer) {
  size_t count = 0;
  if (writer->used_count > 0) qsort(writer->used, writer->used_count, sizeof *writer->used, compare_names);
  for (size_t i = 0; i < writer->used_count; i++)
    if (count == 0 || compare_names(&writer->used[count - 1], &writer->used[i]) != 0)
      writer->used[count++] = writer->used[i];
  writer->used_count = count;
}

/* The names of a member, each once. */
typedef struct name_list {
  json_writer *writer;
  const char *member; /* of the document */
  bool *done;         /* [used_count] */
  bool is_open;
} name_list;

static void list_name(name_list *list, const json_name *used) {
  json_writer *writer = list->writer;
  if (list->done[used - writer->used]) return;
  list->done[used - writer->used] = true;
  if (!list->is_open) tw_member_open(writer->text, list->member, "[");
  list->is_open = true;
  tw_text_element(writer->text);
  tw_text_add(writer->text, "\"");
  tw_text_bytes(writer->text, used->text, used->size);
  tw_text_add(writer->text, "\"");
}

/* Unless it is not used. */
static void list_if_used(name_list *list, const char *text) {
  const json_writer *writer = list->writer;
  const json_name name = {text, strlen(text)};
  const json_name *found = writer->used_count
                               ? bsearch(&name, writer->used, writer->used_count, sizeof name, compare_names)
                               : NULL;
  if (found) list_name(list, found);
}

/* The listed extensions that are used, in the list's order; then all other ones that are used, or those that
 * the encoding requires. */
static void put_extension_names(json_writer *writer, const char *member, const tw_gltf_objects *listed,
                                bool is_required) {
  name_list list = {writer, member, tw_alloc_zero(writer->used_count, sizeof *list.done), false};
  if (!list.done) {
    writer->text->failed = true;
    return;
  }
  for (uint32_t i = 0; i < listed->count; i++) list_if_used(&list, listed->items[i]);
  for (size_t i = 0; !is_required && i < writer->used_count; i++) list_name(&list, &writer->used[i]);
  if (is_required) {
    list_if_used(&list, QUANTIZATION);
    list_if_used(&list, TW_GLTF_MESHOPT);
  }
  if (list.is_open) tw_text_add(writer->text, "]");
  free(list.done);
}

static void put_extensions(json_writer *writer) {
  const tw_scene *scene = writer->scene;
  if (scene->packs && scene->model->mesh_count > 0) note_name(writer, QUANTIZATION, sizeof QUANTIZATION - 1);
  if (writer->plan->decoded_size > 0) note_name(writer, TW_GLTF_MESHOPT, sizeof TW_GLTF_MESHOPT - 1);
  sort_used(writer);
  put_extension_names(writer, "extensionsUsed", &writer->assets->extensions_used, false);
  put_extension_names(writer, "extensionsRequired", &writer->assets->extensions_required, true);
}

/* ---- parts of objects ---------------------------------------------------------------------------------- */

/* The members of a kept object, behind those that are already there. */
static void put_kept(json_writer *writer, const char *kept) {
  size_t size = kept ? strlen(kept) : 0;
  if (size <= 2) return;
  tw_text_element(writer->text);
  tw_text_bytes(writer->text, kept + 1, size - 2);
  if (strstr(kept, "\"extensions\"")) note_extensions(writer, kept);
}

/* The members of a kept object but for one. object may be NULL. */
static void put_others(json_writer *writer, const char *object, const char *except) {
  tw_json_item item;
  if (!object) return;
  for (bool more = tw_json_first(object, &item); more; more = tw_json_next(tw_json_skip(item.value), &item)) {
    if (tw_json_key_is(&item, except)) continue;
    tw_text_element(writer->text);
    tw_text_bytes(writer->text, item.key - 1, (size_t)(tw_json_skip(item.value) - item.key) + 1);
  }
}

static void put_name(json_writer *writer, const char *name) {
  if (name) tw_member_string(writer->text, "name", name);
}

static void put_indices(json_writer *writer, const char *member, const uint32_t *indices, size_t count) {
  tw_member_open(writer->text, member, "[");
  for (size_t i = 0; i < count; i++) {
    tw_text_element(writer->text);
    tw_text_count(writer->text, indices[i]);
  }
  tw_text_add(writer->text, "]");
}

static void open_object(json_writer *writer) {
  tw_text_element(writer->text);
  tw_text_add(writer->text, "{");
}

static void close_object(json_writer *writer) {
  tw_text_add(writer->text, "}");
}

/* Kept objects as they are. */
static void put_objects(json_writer *writer, const char *member, const tw_gltf_objects *objects) {
  if (objects->count == 0) return;
  tw_member_open(writer->text, member, "[");
  for (uint32_t i = 0; i < objects->count; i++) {
    open_object(writer);
    put_kept(writer, objects->items[i]);
    close_object(writer);
  }
  tw_text_add(writer->text, "]");
}

/* ---- views and accessors ------------------------------------------------------------------------------- */

/* Where the bytes are of which the view is made. */
static void put_compression(json_writer *writer, const tw_gltf_view *view) {
  tw_member_open(writer->text, "extensions", "{");
  tw_member_open(writer->text, TW_GLTF_MESHOPT, "{");
  tw_member_count(writer->text, "buffer", 0);
  if (view->offset) tw_member_count(writer->text, "byteOffset", view->offset);
  tw_member_count(writer->text, "byteLength", view->size);
  tw_member_count(writer->text, "byteStride", view->decoded.stride);
  tw_member_count(writer->text, "count", view->decoded.count);
  tw_member_string(writer->text, "mode", view->decoded.mode);
  tw_text_add(writer->text, "}}");
}

static void put_views(json_writer *writer) {
  if (writer->plan->view_count == 0) return;
  tw_member_open(writer->text, "bufferViews", "[");
  for (uint32_t i = 0; i < writer->plan->view_count; i++) {
    const tw_gltf_view *view = &writer->plan->views[i];
    open_object(writer);
    bool is_compressed = view->decoded.mode;
    uint64_t offset = is_compressed ? view->decoded.offset : view->offset;
    tw_member_count(writer->text, "buffer", is_compressed ? 1 : 0);
    if (offset) tw_member_count(writer->text, "byteOffset", offset);
    tw_member_count(writer->text, "byteLength", is_compressed ? view->decoded.size : view->size);
    if (view->stride) tw_member_count(writer->text, "byteStride", view->stride);
    if (view->target) tw_member_count(writer->text, "target", (uint64_t)view->target);
    if (is_compressed) put_compression(writer, view);
    close_object(writer);
  }
  tw_text_add(writer->text, "]");
}

/* Doubles, as readers compare them with the data. */
static void put_bounds(json_writer *writer, const char *member, const float *bounds, uint32_t count) {
  tw_member_open(writer->text, member, "[");
  for (uint32_t i = 0; i < count; i++) {
    tw_text_element(writer->text);
    tw_text_double(writer->text, (double)bounds[i]);
  }
  tw_text_add(writer->text, "]");
}

/* Three fields of spaces; their places go to fields. */
static void put_later(json_writer *writer, const char *member, size_t fields[3]) {
  char blanks[TW_GLTF_BOUND_TEXT];
  memset(blanks, ' ', sizeof blanks);
  tw_member_open(writer->text, member, "[");
  for (int i = 0; i < 3; i++) {
    tw_text_element(writer->text);
    fields[i] = writer->text->size;
    tw_text_bytes(writer->text, blanks, sizeof blanks);
  }
  tw_text_add(writer->text, "]");
}

static const char *type_name(int width) {
  static const char *const names[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
  return width == 16 ? "MAT4" : names[width - 1];
}

static void put_elements(json_writer *writer, const tw_gltf_elements *elements) {
  tw_member_string(writer->text, "type", elements->type);
  if (elements->normalized) tw_member_open(writer->text, "normalized", "true");
  if (elements->bound_count == 0) return;
  put_bounds(writer, "max", elements->max, elements->bound_count);
  put_bounds(writer, "min", elements->min, elements->bound_count);
}

static void put_accessor(json_writer *writer, const tw_gltf_accessor *accessor) {
  if (accessor->view != TW_NO_INDEX) tw_member_count(writer->text, "bufferView", accessor->view);
  if (accessor->offset) tw_member_count(writer->text, "byteOffset", accessor->offset);
  tw_member_count(writer->text, "componentType", (uint64_t)accessor->component);
  tw_member_count(writer->text, "count", accessor->count);
  if (accessor->elements) {
    put_elements(writer, accessor->elements);
    return;
  }
  tw_member_string(writer->text, "type", type_name(accessor->width));
  if (accessor->is_normalized) tw_member_open(writer->text, "normalized", "true");
  if (accessor->bounds == TW_GLTF_BOUNDED) {
    const float max[3] = {accessor->max, accessor->max, accessor->max},
                min[3] = {accessor->min, accessor->min, accessor->min};
    put_bounds(writer, "max", max, (uint32_t)accessor->width);
    put_bounds(writer, "min", min, (uint32_t)accessor->width);
  } else if (accessor->bounds == TW_GLTF_BOUNDED_LATER) {
    put_later(writer, "max", *writer->bounds);
    put_later(writer, "min", *writer->bounds + 3);
    writer->bounds++;
  }
}

static void put_accessors(json_writer *writer) {
  if (writer->plan->accessor_count == 0) return;
  tw_member_open(writer->text, "accessors", "[");
  for (uint32_t i = 0; i < writer->plan->accessor_count; i++) {
    open_object(writer);
    put_accessor(writer, &writer->plan->accessors[i]);
    close_object(writer);
  }
  tw_text_add(writer->text, "]");
}

/* ---- groups of faces: glTF has none. Cutting primitives at them would cost a draw call each, so they are
 * told as ranges of indices, the form in which three.js has them (BufferGeometry.addGroup). */

static void put_words(json_writer *writer, const char *names) {
  tw_member_open(writer->text, "names", "[");
  for (const char *word = names; *word;) {
    size_t length = strcspn(word, " ");
    if (length > 0) {
      tw_text_element(writer->text);
      tw_text_quoted(writer->text, word, length);
    }
    word += length + (word[length] == ' ');
  }
  tw_text_add(writer->text, "]");
}

/* Triangles of the surface's groups before the first one of `to`. */
static uint64_t triangles_between(const tw_surface_group *from, const tw_surface_group *to) {
  return to->first_corner - from->first_corner - 2 * (to->first_face - from->first_face);
}

/* The extras of a primitive: {"groups": [{"names": [...], "start": n, "count": n}, ...]}, ranges of its
 * indices, in order. Faces in no group are in no range; without any range there are no extras.
 * next_group: the first of the surface's groups among the primitive's; is moved past those that end in it. */
static void put_group_ranges(json_writer *writer, const tw_surface *surface,
                             const tw_gltf_primitive *primitive, uint32_t *next_group) {
  uint64_t begin = primitive->first_triangle, end = begin + primitive->triangle_count, stop = begin;
  bool any = false;
  for (; *next_group < tw_surface_group_count(surface) && stop < end; ++*next_group) {
    const tw_surface_group *group = tw_surface_get_group(surface, *next_group);
    uint64_t start = triangles_between(&primitive->faces, group);
    stop = start + tw_count_triangles(group);
    bool goes_on = stop > end;
    if (group->names != TW_NO_INDEX) {
      if (!any) {
        tw_member_open(writer->text, "extras", "{");
        tw_member_open(writer->text, "groups", "[");
      }
      any = true;
      if (start < begin) start = begin;
      open_object(writer);
      put_words(writer, writer->scene->model->group_names[group->names]);
      tw_member_count(writer->text, "start", 3 * (start - begin));
      tw_member_count(writer->text, "count", 3 * ((goes_on ? end : stop) - start));
      close_object(writer);
    }
    if (goes_on) break;
  }
  if (any) tw_text_add(writer->text, "]}");
}

/* ---- meshes -------------------------------------------------------------------------------------------- */

/* step: accessors a target. */
static void put_targets(json_writer *writer, uint32_t count, uint32_t first, uint32_t step) {
  if (count == 0) return;
  tw_member_open(writer->text, "targets", "[");
  for (uint32_t i = 0; i < count; i++) {
    open_object(writer);
    tw_member_count(writer->text, "POSITION", first + (uint64_t)step * i);
    if (step == 2) tw_member_count(writer->text, "NORMAL", first + (uint64_t)step * i + 1);
    close_object(writer);
  }
  tw_text_add(writer->text, "]");
}

/* The members of a kept object, FB_ngon_encoding among its extensions. */
static void put_kept_and_ngon(json_writer *writer, const char *kept) {
  const char *extensions = tw_json_member(kept, "extensions");
  tw_member_open(writer->text, "extensions", "{");
  tw_member_open(writer->text, NGON, "{}");
  note_name(writer, NGON, sizeof NGON - 1);
  put_others(writer, extensions, "");
  tw_text_add(writer->text, "}");
  put_others(writer, kept, "extensions");
  if (kept) note_extensions(writer, kept);
}

/* What primitives of these faces say. */
static const char *kept_of(const tw_model *model, int32_t face_material) {
  uint32_t slot = (uint32_t)face_material - model->material_count;
  return face_material >= 0 && slot < model->slot_count ? model->slots[slot].kept : NULL;
}

static void put_primitive(json_writer *writer, const tw_gltf_mesh *mesh, const tw_gltf_primitive *primitive) {
  const tw_model *model = writer->scene->model;
  tw_member_open(writer->text, "attributes", "{");
  for (uint32_t i = 0; i < mesh->field_count; i++) {
    tw_text_element(writer->text);
    tw_text_string(writer->text, mesh->fields[i].semantic);
    tw_text_add(writer->text, ":");
    tw_text_count(writer->text, primitive->first_attribute + (uint64_t)i);
  }
  close_object(writer);
  tw_member_count(writer->text, "indices", primitive->indices);
  const int32_t material = tw_model_material(model, primitive->faces.material);
  if (material >= 0) tw_member_count(writer->text, "material", (uint64_t)material);
  put_targets(writer, mesh->target_count, primitive->first_target, mesh->target_step);
  const char *kept = kept_of(model, primitive->faces.material);
  if (writer->scene->polygons == TW_POLYGONS_NGON)
    put_kept_and_ngon(writer, kept);
  else
    put_kept(writer, kept);
}

static void put_primitives(json_writer *writer, uint32_t index) {
  const tw_gltf_mesh *mesh = &writer->plan->meshes[index];
  const tw_surface *surface = writer->scene->surfaces[index];
  uint32_t group = 0;
  for (uint32_t i = 0; i < mesh->primitive_count; i++) {
    open_object(writer);
    put_primitive(writer, mesh, &mesh->primitives[i]);
    if (writer->plan->names_groups) put_group_ranges(writer, surface, &mesh->primitives[i], &group);
    close_object(writer);
  }
}

/* Points and lines as they came; at rest where the mesh was baked. */
static void put_loose(json_writer *writer, const tw_mesh *mesh) {
  tw_json_item item;
  for (bool more = tw_json_first(mesh->loose, &item); more;
       more = tw_json_next(tw_json_skip(item.value), &item)) {
    open_object(writer);
    put_others(writer, item.value, mesh->morph_count > 0 ? "" : "targets");
    close_object(writer);
    note_extensions(writer, item.value);
  }
}

/* What stands for faces where there are none: a mesh keeps its place among the meshes. */
static void put_nothing(json_writer *writer, const tw_gltf_mesh *mesh) {
  open_object(writer);
  tw_member_open(writer->text, "attributes", "{");
  tw_member_count(writer->text, "POSITION", writer->plan->nothing);
  close_object(writer);
  put_targets(writer, mesh->target_count, writer->plan->nothing, 0);
  close_object(writer);
}

/* ---- what a cage says beyond glTF ---- */

static void put_accessor_of(json_writer *writer, const char *member, uint32_t accessor) {
  if (accessor != TW_NO_INDEX) tw_member_count(writer->text, member, accessor);
}

static void put_sharpness(json_writer *writer, const char *member, const char *of, uint32_t elements,
                          uint32_t sharpness) {
  if (elements == TW_NO_INDEX) return;
  tw_member_open(writer->text, member, "{");
  tw_member_count(writer->text, of, elements);
  tw_member_count(writer->text, "sharpness", sharpness);
  close_object(writer);
}

/* The sets of groups have the model's numbers. */
static void put_groups(json_writer *writer, uint32_t faces) {
  const tw_model *model = writer->scene->model;
  if (faces == TW_NO_INDEX) return;
  tw_member_open(writer->text, "groups", "{");
  tw_member_open(writer->text, "names", "[");
  for (uint32_t i = 0; i < model->group_count; i++) {
    tw_text_element(writer->text);
    tw_text_string(writer->text, model->group_names[i]);
  }
  tw_text_add(writer->text, "]");
  tw_member_count(writer->text, "faces", faces);
  close_object(writer);
}

static void put_holes(json_writer *writer, const tw_gltf_mesh *mesh) {
  if (mesh->tags.hole_count == 0) return;
  tw_member_open(writer->text, "holes", "[");
  for (uint32_t i = 0; i < mesh->tags.hole_count; i++) {
    const tw_gltf_primitive *hole = &mesh->primitives[mesh->primitive_count + i];
    int32_t material = tw_model_material(writer->scene->model, hole->faces.material - TW_HOLE_MATERIAL - 1);
    open_object(writer);
    tw_member_count(writer->text, "indices", hole->indices);
    if (material >= 0) tw_member_count(writer->text, "material", (uint64_t)material);
    close_object(writer);
  }
  tw_text_add(writer->text, "]");
}

static void put_details(json_writer *writer, const tw_gltf_tags *tags, const tw_mesh *source) {
  if (tags->detail_count == 0) return;
  tw_member_open(writer->text, "details", "[");
  for (uint32_t i = 0; i < tags->detail_count; i++) {
    open_object(writer);
    tw_member_count(writer->text, "level", source->details[i].level);
    tw_member_count(writer->text, "offsets", tags->details[i]);
    close_object(writer);
  }
  tw_text_add(writer->text, "]");
}

static void put_rules(json_writer *writer, const tw_mesh *mesh) {
  const struct {
    const char *name;
    int value;
  } rules[] = {{"boundary", mesh->tag_boundary},
               {"uv", mesh->tag_uv},
               {"creasing", mesh->tag_creasing},
               {"triangles", mesh->tag_triangles}};
  bool any = false;
  for (size_t i = 0; i < sizeof rules / sizeof *rules; i++) {
    if (rules[i].value == TW_TAG_UNSET) continue;
    if (!any) tw_member_open(writer->text, "rules", "{");
    any = true;
    tw_member_count(writer->text, rules[i].name, (uint64_t)rules[i].value);
  }
  if (any) close_object(writer);
}

static void put_tags(json_writer *writer, const tw_gltf_mesh *mesh, const tw_mesh *source) {
  const tw_gltf_tags *tags = &mesh->tags;
  tw_member_open(writer->text, "tweend", "{");
  put_accessor_of(writer, "points", tags->points);
  put_accessor_of(writer, "faces", tags->faces);
  put_accessor_of(writer, "starts", tags->starts);
  put_sharpness(writer, "creases", "edges", tags->crease_edges, tags->crease_sharpness);
  put_sharpness(writer, "corners", "vertices", tags->corner_vertices, tags->corner_sharpness);
  put_groups(writer, tags->groups);
  put_holes(writer, mesh);
  put_details(writer, tags, source);
  put_rules(writer, source);
  close_object(writer);
}

/* Extras that are no object have no room for tags, and go. */
static void put_kept_and_tags(json_writer *writer, const tw_gltf_mesh *mesh, const tw_mesh *source) {
  const char *extras = source->kept ? tw_json_member(source->kept, "extras") : NULL;
  tw_member_open(writer->text, "extras", "{");
  put_tags(writer, mesh, source);
  if (extras && *extras == '{') put_others(writer, extras, "");
  close_object(writer);
  put_others(writer, source->kept, "extras");
  if (source->kept) note_extensions(writer, source->kept);
}

static void put_meshes(json_writer *writer) {
  const tw_model *model = writer->scene->model;
  if (model->mesh_count == 0) return;
  tw_member_open(writer->text, "meshes", "[");
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    const tw_gltf_mesh *mesh = &writer->plan->meshes[i];
    const tw_mesh *source = &model->meshes[i];
    open_object(writer);
    put_name(writer, source->name);
    tw_member_open(writer->text, "primitives", "[");
    put_primitives(writer, i);
    if (source->loose && model->assets)
      put_loose(writer, source);
    else if (mesh->primitive_count == 0)
      put_nothing(writer, mesh);
    tw_text_add(writer->text, "]");
    if (mesh->target_count && source->morph_weights)
      tw_member_floats(writer->text, "weights", source->morph_weights, mesh->target_count);
    if (mesh->tags.is_cage)
      put_kept_and_tags(writer, mesh, source);
    else
      put_kept(writer, source->kept);
    close_object(writer);
  }
  tw_text_add(writer->text, "]");
}

/* ---- nodes --------------------------------------------------------------------------------------------- */

/* What the JSON needs to know of each node beside the node itself. */
typedef struct node_links {
  uint32_t *first_child, *next_sibling; /* [node_count], TW_NO_INDEX at the end */
  bool *animated;                       /* [node_count]: must not have a matrix */
} node_links;

static bool find_links(json_writer *writer, node_links *links) {
  const tw_scene *scene = writer->scene;
  uint32_t count = scene->model->node_count;
  *links = (node_links){tw_alloc(count, sizeof(uint32_t)), tw_alloc(count, sizeof(uint32_t)),
                        tw_alloc_zero(count, sizeof(bool))};
  if (!links->first_child || !links->next_sibling || !links->animated) return false;
  memset(links->first_child, 0xFF, count * sizeof(uint32_t));
  for (uint32_t i = count; i-- > 0;) {
    uint32_t parent = scene->model->nodes[i].parent;
    if (parent == TW_NO_INDEX) continue;
    links->next_sibling[i] = links->first_child[parent];
    links->first_child[parent] = i;
  }
  for (uint32_t i = 0; i < scene->clip_count; i++)
    for (uint32_t j = 0; j < scene->clips[i].track_count; j++)
      links->animated[scene->clips[i].tracks[j].node] = true;
  return true;
}

static void free_links(node_links *links) {
  free(links->first_child);
  free(links->next_sibling);
  free(links->animated);
}

static void put_floats_unless(json_writer *writer, const char *member, const float *values, size_t count,
                              const float *usual) {
  for (size_t i = 0; i < count; i++) {
    if (values[i] == usual[i]) continue;
    tw_member_floats(writer->text, member, values, count);
    return;
  }
}

static void put_transform(json_writer *writer, uint32_t index, bool animated) {
  const tw_scene *scene = writer->scene;
  const tw_node *node = &scene->model->nodes[index];
  bool moved = animated || (scene->posed_by && tw_clip_moves(scene->posed_by, index));
  if (node->has_matrix && !moved) {
    tw_member_floats(writer->text, "matrix", node->matrix, 16);
    return;
  }
  const tw_trs *local = scene->pose ? &scene->pose[index] : &node->rest, usual = TW_TRS_IDENTITY;
  put_floats_unless(writer, "translation", local->translation, 3, usual.translation);
  put_floats_unless(writer, "rotation", local->rotation, 4, usual.rotation);
  put_floats_unless(writer, "scale", local->scale, 3, usual.scale);
}

/* The mesh of a node, with what goes with it. */
static void put_mesh_of(json_writer *writer, uint32_t index) {
  const tw_scene *scene = writer->scene;
  const tw_node *node = &scene->model->nodes[index];
  tw_member_count(writer->text, "mesh", node->mesh);
  if (tw_gltf_node_is_skinned(scene, node)) tw_member_count(writer->text, "skin", node->skin);
  const float *weights = scene->weights ? scene->weights[index] : NULL;
  if (!weights) weights = node->weights;
  uint32_t count = writer->plan->meshes[node->mesh].target_count;
  if (weights && count > 0) tw_member_floats(writer->text, "weights", weights, count);
}

/* The holder of the node's mesh comes first. */
static void put_children(json_writer *writer, const node_links *links, uint32_t index, uint32_t holder) {
  uint32_t child = links->first_child[index];
  if (child == TW_NO_INDEX && holder == TW_NO_INDEX) return;
  tw_member_open(writer->text, "children", "[");
  if (holder != TW_NO_INDEX) tw_text_count(writer->text, holder);
  for (; child != TW_NO_INDEX; child = links->next_sibling[child]) {
    tw_text_element(writer->text);
    tw_text_count(writer->text, child);
  }
  tw_text_add(writer->text, "]");
}

static void put_node(json_writer *writer, const node_links *links, uint32_t index) {
  const tw_node *node = &writer->scene->model->nodes[index];
  uint32_t holder = tw_gltf_holder_of(writer->plan, index);
  open_object(writer);
  put_name(writer, node->name);
  if (node->mesh != TW_NO_INDEX && holder == TW_NO_INDEX) put_mesh_of(writer, index);
  put_transform(writer, index, links->animated[index]);
  put_children(writer, links, index, holder);
  put_kept(writer, node->kept);
  close_object(writer);
}

/* A node that shows the mesh of another one where its shorts stand for. */
static void put_holder(json_writer *writer, uint32_t index) {
  const tw_grid *grid = &writer->scene->packs[writer->scene->model->nodes[index].mesh]->options.grid;
  const float scale[3] = {grid->scale, grid->scale, grid->scale};
  open_object(writer);
  put_mesh_of(writer, index);
  tw_member_floats(writer->text, "translation", grid->origin, 3);
  tw_member_floats(writer->text, "scale", scale, 3);
  close_object(writer);
}

static void put_nodes(json_writer *writer) {
  const tw_model *model = writer->scene->model;
  if (model->node_count == 0) return;
  node_links links;
  bool found = find_links(writer, &links);
  if (!found) writer->text->failed = true;
  tw_member_open(writer->text, "nodes", "[");
  for (uint32_t i = 0; found && i < model->node_count; i++) put_node(writer, &links, i);
  for (uint32_t i = 0; found && i < writer->plan->holder_count; i++)
    put_holder(writer, writer->plan->holders[i]);
  tw_text_add(writer->text, "]");
  free_links(&links);
}

/* ---- scenes -------------------------------------------------------------------------------------------- */

/* Roots from node `first` on that are shown. */
static void put_roots(json_writer *writer, uint32_t first) {
  const tw_model *model = writer->scene->model;
  for (uint32_t i = first; i < model->node_count; i++) {
    if (model->nodes[i].parent != TW_NO_INDEX || model->nodes[i].is_hidden) continue;
    tw_text_element(writer->text);
    tw_text_count(writer->text, i);
  }
}

/* The file's scenes. Nodes that an answer has beside the file's are in the one that is shown. */
static void put_scene(json_writer *writer, uint32_t index) {
  const tw_gltf_scene *scene = &writer->assets->scenes[index];
  uint32_t file_nodes = writer->assets->node_count;
  bool is_shown = index == (writer->assets->scene == TW_NO_INDEX ? 0 : writer->assets->scene);
  bool has_more = is_shown && writer->scene->model->node_count > file_nodes;
  open_object(writer);
  if (scene->node_count > 0 || has_more) {
    tw_member_open(writer->text, "nodes", "[");
    for (uint32_t i = 0; i < scene->node_count; i++) {
      tw_text_element(writer->text);
      tw_text_count(writer->text, scene->nodes[i]);
    }
    if (has_more) put_roots(writer, file_nodes);
    tw_text_add(writer->text, "]");
  }
  put_kept(writer, scene->kept);
  close_object(writer);
}

static void put_scenes(json_writer *writer) {
  const tw_gltf_assets *assets = writer->assets;
  if (assets->scene_count == 0) {
    if (writer->scene->model->node_count == 0) return;
    tw_member_count(writer->text, "scene", 0);
    tw_text_add(writer->text, ",\"scenes\":[{\"nodes\":[");
    put_roots(writer, 0);
    tw_text_add(writer->text, "]}]");
    return;
  }
  if (assets->scene != TW_NO_INDEX) tw_member_count(writer->text, "scene", assets->scene);
  tw_member_open(writer->text, "scenes", "[");
  for (uint32_t i = 0; i < assets->scene_count; i++) put_scene(writer, i);
  tw_text_add(writer->text, "]");
}

/* ---- skins and animations ------------------------------------------------------------------------------ */

static void put_skins(json_writer *writer) {
  const tw_model *model = writer->scene->model;
  if (model->skin_count == 0) return;
  tw_member_open(writer->text, "skins", "[");
  for (uint32_t i = 0; i < model->skin_count; i++) {
    const tw_skin *skin = &model->skins[i];
    open_object(writer);
    put_name(writer, skin->name);
    put_indices(writer, "joints", skin->joints, skin->joint_count);
    tw_member_count(writer->text, "inverseBindMatrices", writer->plan->skin_matrices[i]);
    if (skin->skeleton != TW_NO_INDEX) tw_member_count(writer->text, "skeleton", skin->skeleton);
    put_kept(writer, skin->kept);
    close_object(writer);
  }
  tw_text_add(writer->text, "]");
}

/* The part of a track's kept object that is called so. */
static void put_part(json_writer *writer, const char *kept, const char *name) {
  const char *part = tw_json_member(kept, name);
  put_others(writer, part, "");
  if (part) note_extensions(writer, part);
}

/* Channels of something else than nodes, or their samplers (`name`), behind those of nodes. */
static void put_loose_channels(json_writer *writer, const char *loose, const char *name, uint32_t sampler) {
  tw_json_item item;
  for (bool more = tw_json_first(loose, &item); more; more = tw_json_next(tw_json_skip(item.value), &item)) {
    open_object(writer);
    if (strcmp(name, "channel") == 0) tw_member_count(writer->text, "sampler", sampler++);
    put_part(writer, item.value, name);
    close_object(writer);
  }
}

static void put_channel(json_writer *writer, const tw_gltf_channel *channel, uint32_t sampler) {
  static const char *const paths[] = {"translation", "rotation", "scale", "weights"};
  open_object(writer);
  tw_member_count(writer->text, "sampler", sampler);
  tw_member_open(writer->text, "target", "{");
  tw_member_count(writer->text, "node", channel->node);
  tw_member_string(writer->text, "path", paths[channel->path]);
  put_part(writer, channel->kept, "target");
  close_object(writer);
  put_part(writer, channel->kept, "channel");
  close_object(writer);
}

static void put_sampler(json_writer *writer, const tw_gltf_channel *channel) {
  static const char *const interpolations[] = {"STEP", "LINEAR", "CUBICSPLINE"};
  open_object(writer);
  tw_member_count(writer->text, "input", channel->input);
  tw_member_string(writer->text, "interpolation", interpolations[channel->interpolation]);
  tw_member_count(writer->text, "output", channel->output);
  put_part(writer, channel->kept, "sampler");
  close_object(writer);
}

static void put_animation(json_writer *writer, const tw_gltf_animation *animation) {
  const tw_clip_keys *clip = &writer->scene->clips[animation->clip];
  const tw_gltf_channel *channels = writer->plan->channels + animation->first_channel;
  open_object(writer);
  put_name(writer, clip->name);
  tw_member_open(writer->text, "channels", "[");
  const char *loose = writer->scene->model->assets ? clip->loose : NULL;
  for (uint32_t i = 0; i < animation->channel_count; i++) put_channel(writer, &channels[i], i);
  if (loose) put_loose_channels(writer, loose, "channel", animation->channel_count);
  tw_text_add(writer->text, "]");
  tw_member_open(writer->text, "samplers", "[");
  for (uint32_t i = 0; i < animation->channel_count; i++) put_sampler(writer, &channels[i]);
  if (loose) put_loose_channels(writer, loose, "sampler", 0);
  tw_text_add(writer->text, "]");
  put_kept(writer, clip->kept);
  close_object(writer);
}

static void put_animations(json_writer *writer) {
  if (writer->plan->animation_count == 0) return;
  tw_member_open(writer->text, "animations", "[");
  for (uint32_t i = 0; i < writer->plan->animation_count; i++)
    put_animation(writer, &writer->plan->animations[i]);
  tw_text_add(writer->text, "]");
}

/* ---- assets -------------------------------------------------------------------------------------------- */

static void put_images(json_writer *writer) {
  if (writer->assets->image_count == 0) return;
  tw_member_open(writer->text, "images", "[");
  for (uint32_t i = 0; i < writer->assets->image_count; i++) {
    const tw_gltf_image *image = &writer->assets->images[i];
    open_object(writer);
    if (image->bytes) {
      tw_member_count(writer->text, "bufferView", writer->plan->image_views[i]);
      if (image->mime_type) tw_member_open(writer->text, "mimeType", image->mime_type);
    }
    put_kept(writer, image->kept);
    close_object(writer);
  }
  tw_text_add(writer->text, "]");
}

/* Without assets: the names that an OBJ gives. */
static void put_materials(json_writer *writer) {
  const tw_model *model = writer->scene->model;
  if (model->assets) {
    put_objects(writer, "materials", &writer->assets->materials);
    return;
  }
  if (model->material_count == 0) return;
  tw_member_open(writer->text, "materials", "[");
  for (uint32_t i = 0; i < model->material_count; i++) {
    open_object(writer);
    put_name(writer, model->material_names[i]);
    close_object(writer);
  }
  tw_text_add(writer->text, "]");
}

static void put_asset(json_writer *writer) {
  tw_member_open(writer->text, "asset", "{");
  tw_member_string(writer->text, "version", "2.0");
  tw_text_add(writer->text, ",\"generator\":\"tweend ");
  tw_text_add(writer->text, tw_version());
  tw_text_add(writer->text, "\"");
  put_kept(writer, writer->assets->asset);
  close_object(writer);
}

/* ---- the whole ----------------------------------------------------------------------------------------- */

static void put_document(json_writer *writer) {
  const tw_gltf_assets *assets = writer->assets;
  tw_text_add(writer->text, "{");
  put_asset(writer);
  put_scenes(writer);
  put_nodes(writer);
  put_meshes(writer);
  put_skins(writer);
  put_animations(writer);
  put_materials(writer);
  put_objects(writer, "textures", &assets->textures);
  put_images(writer);
  put_objects(writer, "samplers", &assets->samplers);
  put_objects(writer, "cameras", &assets->cameras);
  put_accessors(writer);
  put_views(writer);
  put_kept(writer, assets->root);
  put_extensions(writer);
  tw_text_add(writer->text, "}");
}

const tw_gltf_assets *tw_gltf_assets_bare(tw_arena *arena, const tw_gltf_assets *assets) {
  tw_gltf_assets *bare = assets ? tw_arena_alloc(arena, 1, sizeof *bare) : NULL;
  if (bare) *bare = (tw_gltf_assets){.asset = assets->asset, .scene = TW_NO_INDEX};
  return bare;
}

const tw_gltf_assets *tw_gltf_assets_of(const tw_model *model) {
  static const tw_gltf_assets none = {.scene = TW_NO_INDEX};
  return model->assets ? model->assets : &none;
}

tw_status tw_gltf_json_init(tw_gltf_json *json, const tw_gltf_plan *plan, const tw_scene *scene,
                            tw_error *error) {
  *json = (tw_gltf_json){0};
  size_t later = 0;
  for (uint32_t i = 0; i < plan->accessor_count; i++)
    later += plan->accessors[i].bounds == TW_GLTF_BOUNDED_LATER;
  json->bounds = tw_alloc(later, sizeof *json->bounds);
  json_writer writer = {.plan = plan,
                        .scene = scene,
                        .assets = tw_gltf_assets_of(scene->model),
                        .text = &json->text,
                        .bounds = json->bounds};
  if (json->bounds) put_document(&writer);
  free(writer.used);
  if (json->bounds && !json->text.failed) return TW_OK;
  tw_gltf_json_deinit(json);
  return tw_fail(error, TW_NO_MEMORY, "no memory for the JSON of a glTF answer");
}

void tw_gltf_json_deinit(tw_gltf_json *json) {
  tw_text_deinit(&json->text);
  free(json->bounds);
  *json = (tw_gltf_json){0};
}
