/* Members that were preserved of the file, and the extensions that occur in an answer. */
#include "gltf_json_writer.h"

#include <stdlib.h>
#include <string.h>

#include "array.h"

static const char QUANTIZATION[] = "KHR_mesh_quantization";

/* ---- extensions ------------------------------------------------------------------------------ */

static int compare_names(const void *left, const void *right) {
  const tw_word *a = &((const tw_gltf_extension *)left)->name, *b = &((const tw_gltf_extension *)right)->name;
  int order = memcmp(a->text, b->text, a->length < b->length ? a->length : b->length);
  return order != 0 ? order : (a->length > b->length) - (a->length < b->length);
}

void tw_gltf_note_extension(tw_gltf_writer *writer, const char *text, size_t size) {
  const tw_gltf_extension extension = {.name = {text, size}};
  if (writer->used_count > 0 && compare_names(&writer->used[writer->used_count - 1], &extension) == 0) return;
  tw_gltf_extension *used = tw_array_grow(writer->used, writer->used_count, sizeof *used, &writer->used_room);
  if (!used) {
    writer->text->failed = true;
    return;
  }
  writer->used = used;
  writer->used[writer->used_count++] = extension;
}

bool tw_gltf_next_item(tw_gltf_writer *writer, tw_json_item *item) {
  if (!tw_work(1)) writer->text->failed = true;
  return !writer->text->failed && tw_json_next(tw_json_skip(item->value), item);
}

/* Notes the extensions of an object or array and of all that is in it. Extras are skipped: they are the
 * application's own. */
static void note_extensions(tw_gltf_writer *writer, const char *container) {
  tw_json_item item;
  for (bool more = tw_json_first(container, &item); more; more = tw_gltf_next_item(writer, &item)) {
    bool is_object = *item.value == '{';
    if (!is_object && *item.value != '[') continue;
    if (tw_json_key_is(&item, "extras")) continue;
    if (is_object && tw_json_key_is(&item, "extensions")) {
      tw_json_item extension;
      for (bool next = tw_json_first(item.value, &extension); next;
           next = tw_gltf_next_item(writer, &extension))
        tw_gltf_note_extension(writer, extension.key, extension.key_size);
    }
    note_extensions(writer, item.value);
  }
}

/* Sorts the names and drops repetitions. */
static void sort_used(tw_gltf_writer *writer) {
  size_t count = 0;
  if (writer->used_count > 0) qsort(writer->used, writer->used_count, sizeof *writer->used, compare_names);
  for (size_t i = 0; i < writer->used_count; i++)
    if (count == 0 || compare_names(&writer->used[count - 1], &writer->used[i]) != 0)
      writer->used[count++] = writer->used[i];
  writer->used_count = count;
}

/* Finds an extension among those that occur; NULL if it does not. */
static tw_gltf_extension *find_used(const tw_gltf_writer *writer, const char *text) {
  const tw_gltf_extension wanted = {.name = {text, strlen(text)}};
  return writer->used_count > 0
             ? bsearch(&wanted, writer->used, writer->used_count, sizeof wanted, compare_names)
             : NULL;
}

/* Prints the name of an extension, once; nothing for NULL. *member: is opened before the first name, and NULL
 * from then on. */
static void list_name(tw_gltf_writer *writer, tw_gltf_extension *extension, const char **member) {
  if (!extension || extension->is_listed) return;
  if (*member) tw_member_open(writer->text, *member, "[");
  *member = NULL;
  extension->is_listed = true;
  tw_text_element(writer->text);
  tw_text_add(writer->text, "\"");
  tw_text_bytes(writer->text, extension->name.text, extension->name.length);
  tw_text_add(writer->text, "\"");
}

/* Prints the extensions of the list that occur, in the list's order; then all others that occur or, if
 * is_required, those that the encoding requires. */
static void put_extension_names(tw_gltf_writer *writer, const char *member, const tw_gltf_objects *listed,
                                bool is_required) {
  for (size_t i = 0; i < writer->used_count; i++) writer->used[i].is_listed = false;
  for (uint32_t i = 0; i < listed->count; i++)
    list_name(writer, find_used(writer, listed->items[i]), &member);
  for (size_t i = 0; !is_required && i < writer->used_count; i++)
    list_name(writer, &writer->used[i], &member);
  if (is_required) {
    list_name(writer, find_used(writer, QUANTIZATION), &member);
    list_name(writer, find_used(writer, TW_GLTF_MESHOPT), &member);
  }
  if (!member) tw_text_add(writer->text, "]");
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

/* ---- parts of objects ------------------------------------------------------------------------ */

/* names: a blank between two; NULL: none. */
static bool is_among(const tw_json_item *item, const char *names) {
  for (size_t length; names && *names; names += length + (names[length] == ' ')) {
    length = strcspn(names, " ");
    if (item->key_size == length && memcmp(item->key, names, length) == 0) return true;
  }
  return false;
}

void tw_gltf_put_members(tw_gltf_writer *writer, const char *object, const char *except) {
  tw_json_item item;
  if (!object) return;
  for (bool more = tw_json_first(object, &item); more; more = tw_gltf_next_item(writer, &item)) {
    if (is_among(&item, except)) continue;
    tw_text_element(writer->text);
    tw_text_bytes(writer->text, item.key - 1, (size_t)(tw_json_skip(item.value) - item.key) + 1);
  }
}

void tw_gltf_put_preserved(tw_gltf_writer *writer, const char *preserved, const char *except) {
  tw_gltf_put_members(writer, preserved, except);
  if (preserved) note_extensions(writer, preserved);
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
    tw_gltf_put_preserved(writer, objects->items[i], NULL);
    tw_gltf_close_object(writer);
  }
  tw_text_add(writer->text, "]");
}
