#include "gltf_json_writer.h"

#include <stdlib.h>
#include <string.h>

static const char QUANTIZATION[] = "KHR_mesh_quantization";

/* ---- extensions ---------------------------------------------------------------------------------------- */

static int compare_names(const void *left, const void *right) {
  const tw_word *a = left, *b = right;
  int order = memcmp(a->text, b->text, a->length < b->length ? a->length : b->length);
  return order != 0 ? order : (a->length > b->length) - (a->length < b->length);
}

void tw_gltf_note_extension(tw_gltf_writer *writer, const char *text, size_t size) {
  const tw_word name = {text, size};
  if (writer->used_count > 0 && compare_names(&writer->used[writer->used_count - 1], &name) == 0) return;
  if (writer->used_count == writer->used_capacity) {
    size_t capacity = 2 * writer->used_capacity + 16;
    tw_word *used = realloc(writer->used, capacity * sizeof *used);
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
static void note_extensions(tw_gltf_writer *writer, const char *container) {
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
        tw_gltf_note_extension(writer, extension.key, extension.key_size);
    }
    note_extensions(writer, item.value);
  }
}

/* Sorts the names, each once. */
static void sort_used(tw_gltf_writer *writer) {
  size_t count = 0;
  if (writer->used_count > 0) qsort(writer->used, writer->used_count, sizeof *writer->used, compare_names);
  for (size_t i = 0; i < writer->used_count; i++)
    if (count == 0 || compare_names(&writer->used[count - 1], &writer->used[i]) != 0)
      writer->used[count++] = writer->used[i];
  writer->used_count = count;
}

/* The names of a member, each once. */
typedef struct name_list {
  tw_gltf_writer *writer;
  const char *member; /* of the document */
  bool *done;         /* [used_count] */
  bool is_open;
} name_list;

static void list_name(name_list *list, const tw_word *used) {
  tw_gltf_writer *writer = list->writer;
  if (list->done[used - writer->used]) return;
  list->done[used - writer->used] = true;
  if (!list->is_open) tw_member_open(writer->text, list->member, "[");
  list->is_open = true;
  tw_text_element(writer->text);
  tw_text_add(writer->text, "\"");
  tw_text_bytes(writer->text, used->text, used->length);
  tw_text_add(writer->text, "\"");
}

/* Unless it is not used. */
static void list_if_used(name_list *list, const char *text) {
  const tw_gltf_writer *writer = list->writer;
  const tw_word name = {text, strlen(text)};
  const tw_word *found = writer->used_count
                             ? bsearch(&name, writer->used, writer->used_count, sizeof name, compare_names)
                             : NULL;
  if (found) list_name(list, found);
}

/* The listed extensions that are used, in the list's order; then all other ones that are used, or those that
 * the encoding requires. */
static void put_extension_names(tw_gltf_writer *writer, const char *member, const tw_gltf_objects *listed,
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

void tw_gltf_put_extensions(tw_gltf_writer *writer) {
  const tw_scene *scene = writer->scene;
  if (scene->packs && scene->model->mesh_count > 0)
    tw_gltf_note_extension(writer, QUANTIZATION, sizeof QUANTIZATION - 1);
  if (writer->plan->decoded_size > 0)
    tw_gltf_note_extension(writer, TW_GLTF_MESHOPT, sizeof TW_GLTF_MESHOPT - 1);
  sort_used(writer);
  put_extension_names(writer, "extensionsUsed", &writer->assets->extensions_used, false);
  put_extension_names(writer, "extensionsRequired", &writer->assets->extensions_required, true);
}

/* ---- parts of objects ---------------------------------------------------------------------------------- */

void tw_gltf_put_members(tw_gltf_writer *writer, const char *object, const char *except) {
  tw_json_item item;
  if (!object) return;
  for (bool more = tw_json_first(object, &item); more; more = tw_json_next(tw_json_skip(item.value), &item)) {
    if (except && tw_json_key_is(&item, except)) continue;
    tw_text_element(writer->text);
    tw_text_bytes(writer->text, item.key - 1, (size_t)(tw_json_skip(item.value) - item.key) + 1);
  }
}

void tw_gltf_put_kept(tw_gltf_writer *writer, const char *kept, const char *except) {
  tw_gltf_put_members(writer, kept, except);
  if (kept) note_extensions(writer, kept);
}

void tw_gltf_put_indices(tw_gltf_writer *writer, const char *member, const uint32_t *indices, size_t count) {
  tw_member_open(writer->text, member, "[");
  for (size_t i = 0; i < count; i++) {
    tw_text_element(writer->text);
    tw_text_count(writer->text, indices[i]);
  }
  tw_text_add(writer->text, "]");
}

void tw_gltf_put_objects(tw_gltf_writer *writer, const char *member, const tw_gltf_objects *objects) {
  if (objects->count == 0) return;
  tw_member_open(writer->text, member, "[");
  for (uint32_t i = 0; i < objects->count; i++) {
    tw_gltf_open_object(writer);
    tw_gltf_put_kept(writer, objects->items[i], NULL);
    tw_gltf_close_object(writer);
  }
  tw_text_add(writer->text, "]");
}
