/* What all objects of a glTF answer's JSON are written by: members that the file said beyond the plan, and
 * the extensions that occur in them. Out of memory, functions set text->failed and go on. */
#ifndef TWEEND_GLTF_JSON_WRITER_H
#define TWEEND_GLTF_JSON_WRITER_H

#include "gltf/gltf.h"
#include "tweend/json_text.h"
#include "word.h"

typedef struct tw_gltf_extension {
  tw_word name; /* as it stands in quotes */
  bool is_listed;
} tw_gltf_extension;

typedef struct tw_gltf_writer {
  tw_gltf_plan *plan;
  const tw_scene *scene;
  const tw_gltf_assets *assets;
  tw_text *text;
  /* Extensions that occur in what is written, each at least once; from malloc. */
  tw_gltf_extension *used;
  size_t used_count, used_capacity;
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

/* The members of an object, behind those that are already there. except: a member that is not put, or NULL.
 * object may be NULL. */
void tw_gltf_put_members(tw_gltf_writer *writer, const char *object, const char *except);

/* As tw_gltf_put_members, of an object that was kept as text; all extensions in it join the file's list. */
void tw_gltf_put_kept(tw_gltf_writer *writer, const char *kept, const char *except);

/* Kept objects as they are. */
void tw_gltf_put_objects(tw_gltf_writer *writer, const char *member, const tw_gltf_objects *objects);

/* A member with indices. */
void tw_gltf_put_indices(tw_gltf_writer *writer, const char *member, const uint32_t *indices, size_t count);

/* The text must live as long as the writer. */
void tw_gltf_note_extension(tw_gltf_writer *writer, const char *text, size_t size);

/* extensionsUsed and extensionsRequired, when all else is written. */
void tw_gltf_put_extensions(tw_gltf_writer *writer);

/* The document's member "meshes" (gltf_json_meshes.c): primitives, the ranges of groups in them, and in
 * extras what a cage says beyond glTF. Nothing where the model has none. */
void tw_gltf_put_meshes(tw_gltf_writer *writer);

#endif
