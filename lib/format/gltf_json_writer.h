/* Prints parts of a glTF answer's JSON that all objects have: members that were preserved of the file, and
 * the list of extensions that occur. Without memory functions set text->failed and go on. */
#ifndef TWEEND_GLTF_JSON_WRITER_H
#define TWEEND_GLTF_JSON_WRITER_H

#include "gltf/gltf.h"
#include "tweend/json_text.h"
#include "word.h"

typedef struct tw_gltf_extension {
  tw_word name; /* the text between the quotes */
  bool is_listed;
} tw_gltf_extension;

typedef struct tw_gltf_writer {
  tw_gltf_plan *plan;
  const tw_scene *scene;
  const tw_gltf_assets *assets;
  tw_text *text;
  /* The extensions that occur in what is written, some more than once; from malloc. */
  tw_gltf_extension *used;
  size_t used_count, used_room;
} tw_gltf_writer;

static inline void tw_gltf_open_object(tw_gltf_writer *writer) {
  tw_text_element(writer->text);
  tw_text_add(writer->text, "{");
}

static inline void tw_gltf_close_object(tw_gltf_writer *writer) {
  tw_text_add(writer->text, "}");
}

static inline void tw_gltf_put_name(tw_gltf_writer *writer, const char *name) {
  if (name) tw_member_string(writer->text, "name", name);
}

/* As tw_json_next behind the item's value. False also where the answer is no longer wanted (tw_work) or has
 * failed. */
bool tw_gltf_next_item(tw_gltf_writer *writer, tw_json_item *item);

/* Prints the members of an object behind those that are already there. object: NULL prints nothing. except:
 * members to leave out, a blank between two; or NULL. */
void tw_gltf_put_members(tw_gltf_writer *writer, const char *object, const char *except);

/* As tw_gltf_put_members, for an object that was preserved of the file; also notes all extensions in it. */
void tw_gltf_put_preserved(tw_gltf_writer *writer, const char *preserved, const char *except);

/* An array of preserved objects; nothing if it is empty. */
void tw_gltf_put_objects(tw_gltf_writer *writer, const char *member, const tw_gltf_objects *objects);

/* An array of indices. */
void tw_gltf_put_indices(tw_gltf_writer *writer, const char *member, const uint32_t *indices, size_t count);

/* Notes that an extension occurs. text: [size], lives as long as the writer. */
void tw_gltf_note_extension(tw_gltf_writer *writer, const char *text, size_t size);

/* Prints extensionsUsed and extensionsRequired, after all else. */
void tw_gltf_put_extensions(tw_gltf_writer *writer);

/* The document's member "meshes" (gltf_json_meshes.c): primitives, the ranges of groups in them, and in
 * extras what a cage says beyond glTF. Nothing if the model has none. */
void tw_gltf_put_meshes(tw_gltf_writer *writer);

#endif
