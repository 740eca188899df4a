/* From a request's body to the bytes of a model, and from these to the model. */
#include "upload.h"

#include "codings.h"
#include "file_name.h"
#include "foreign.h"
#include "json_in.h"
#include "service.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- forms (multipart/form-data, RFC 7578) --------------------------------------------------- */

/* Limits on the header of a part, in bytes, and on the parts. No browser sends more. */
enum { PART_HEAD_MAX = 16384, FORM_PARTS_MAX = 4096 };

/* The place of `mark`, of at least two bytes, in bytes[from..); bytes.size when it is absent. Compares byte
 * by byte: a body cannot be made to slow it down by repetition. */
static size_t find_mark(api_bytes bytes, size_t from, const char *mark) {
  const uint8_t *data = bytes.data, first = (uint8_t)mark[0], second = (uint8_t)mark[1];
  size_t length = strlen(mark);
  for (; bytes.size - from >= length; from++)
    if (data[from] == first && data[from + 1] == second && memcmp(data + from, mark, length) == 0)
      return from;
  return bytes.size;
}

/* Reads the file name from the header of a part, the filename of Content-Disposition. *out is left alone
 * without one. */
static tw_status read_file_name(api_bytes head, tw_arena *arena, const char **out, tw_error *error) {
  for (size_t at = 0; at < head.size;) {
    size_t end = find_mark(head, at, "\r\n");
    api_span line = {(const char *)head.data + at, end - at};
    at = end + 2;
    api_span name = api_span_cut(&line, ':');
    if (api_span_is(name, "Content-Disposition") && !api_file_name_read(line, arena, out))
      return tw_fail(error, TW_NO_MEMORY, "out of memory");
  }
  return TW_OK;
}

static tw_status fail_form(tw_error *error, const char *detail) {
  return tw_fail(error, TW_SYNTAX, "the form %s", detail);
}

/* Adds a file to the form's array, which doubles. */
static tw_named_file *add_file(api_form *form, tw_arena *arena) {
  bool is_full = (form->count & (form->count - 1)) == 0; /* 0, 1, 2, 4, ... */
  if (is_full) {
    tw_named_file *grown = tw_arena_alloc(arena, form->count ? 2 * (size_t)form->count : 1, sizeof *grown);
    if (!grown) return NULL;
    if (form->count) memcpy(grown, form->files, form->count * sizeof *grown);
    form->files = grown;
  }
  return &form->files[form->count++];
}

/* Adds the part if it is a file. */
static tw_status take_part(api_bytes head, api_bytes content, tw_arena *arena, api_form *form,
                           tw_error *error) {
  const char *name = NULL;
  tw_status status = read_file_name(head, arena, &name, error);
  if (status != TW_OK || !name) return status;
  tw_named_file *file = add_file(form, arena);
  if (!file) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  *file = (tw_named_file){.name = name, .bytes = content.data, .size = content.size};
  return TW_OK;
}

tw_status api_form_read(api_bytes body, const char *boundary, tw_arena *arena, api_form *out,
                        tw_error *error) {
  char mark[80];
  size_t length = (size_t)snprintf(mark, sizeof mark, "\r\n--%.70s", boundary);
  *out = (api_form){0};
  /* The first boundary may stand at the very beginning, without a line break. */
  bool at_start = body.size >= length - 2 && memcmp(body.data, mark + 2, length - 2) == 0;
  size_t at = at_start ? length - 2 : find_mark(body, 0, mark) + length;
  for (int part = 0;; part++) {
    if (at > body.size || body.size - at < 2) return fail_form(error, "does not end with its boundary");
    if (memcmp(body.data + at, "--", 2) == 0) break;
    if (part == FORM_PARTS_MAX) return fail_form(error, "has more than 4096 parts");
    size_t head_end = find_mark(body, at, "\r\n\r\n");
    if (memcmp(body.data + at, "\r\n", 2) != 0 || head_end == body.size || head_end - at > PART_HEAD_MAX)
      return fail_form(error, "has a part without a head");
    api_bytes head = {body.data + at + 2, head_end > at ? head_end - at - 2 : 0};
    size_t start = head_end + 4;
    /* In a part without content, the line break that ends the header is also that of the boundary. */
    size_t end = find_mark(body, start - 2, mark);
    if (end == body.size) return fail_form(error, "does not end with its boundary");
    api_bytes content = {body.data + start, end > start ? end - start : 0};
    tw_status status = take_part(head, content, arena, out, error);
    if (status != TW_OK) return status;
    at = end + length;
  }
  return out->count > 0 ? TW_OK : fail_form(error, "has no file: a part with a filename is expected");
}

/* ---- the body -------------------------------------------------------------------------------- */

/* The most values in the JSON of a glTF file: tinygltf takes a kilobyte or more for some of them. */
enum { JSON_VALUES_MAX = 500000 };

uint64_t api_reading_cost(api_upload_type type, api_coding coding, uint64_t size) {
  /* Anything not declared as OBJ may be glTF, which takes most. */
  uint64_t reading =
      tw_reading_size(type == API_TYPE_OBJ || type == API_TYPE_TEXT ? TW_FORMAT_OBJ : TW_FORMAT_GLTF, size);
  uint64_t window = coding == API_CODING_ZSTD ? 1 << API_ZSTD_WINDOW_LOG : 0;
  uint64_t decoding = coding == API_CODING_NONE ? 0 : size / 2 * 5 + window + (1 << 20);
  return reading > decoding ? reading : decoding;
}

void api_upload_deinit(api_upload *upload) {
  tw_free(upload->decoded);
  *upload = (api_upload){0};
}

/* The glTF or GLB among the files; NULL unless there is exactly one. */
static tw_named_file *find_gltf(const api_form *form) {
  tw_named_file *found = NULL;
  for (uint32_t i = 0; i < form->count; i++) {
    tw_named_file *file = &form->files[i];
    tw_format format = tw_format_sniff(file->bytes, file->size);
    if (format != TW_FORMAT_GLTF && format != TW_FORMAT_GLB) continue;
    if (found) return NULL;
    found = file;
  }
  return found;
}

static api_outcome warn_of_unused(api_call *call, const api_form *form) {
  for (uint32_t i = 0; i < form->count; i++) {
    const tw_named_file *file = &form->files[i];
    if (file->is_used || (file->size == 0 && !*file->name)) continue;
    tw_text text = {0};
    tw_text_add(&text, "the glTF does not name the file ");
    tw_text_bytes(&text, file->name, strlen(file->name));
    if (api_call_warn_text(call, &text) != API_DONE) return API_FAILED;
  }
  return API_DONE;
}

/* Makes one GLB of a glTF and the files that it names. */
static api_outcome join_files(api_call *call, const api_form *form, api_upload *upload) {
  tw_named_file *gltf = find_gltf(form);
  if (!gltf)
    return api_fail_with(call, 400,
                         "the form has more than one file: only one glTF and the files that it names may "
                         "come together");
  uint64_t cost = tw_reading_size(TW_FORMAT_GLTF, upload->bytes.size);
  if (!api_grant(call, cost)) return API_FAILED;
  uint8_t *glb;
  size_t size;
  tw_status status = tw_gltf_bundle(gltf->bytes, gltf->size, form->files, form->count, JSON_VALUES_MAX,
                                    call->service->limits.max_upload, &glb, &size, &call->fault.error);
  if (status != TW_OK) return api_fail_in_document(call);
  gltf->is_used = true;
  upload->name = gltf->name;
  upload->bytes = glb ? (api_bytes){glb, size} : (api_bytes){gltf->bytes, gltf->size};
  if (glb) {
    tw_free(upload->decoded);
    upload->decoded = glb;
  }
  return warn_of_unused(call, form);
}

/* Takes the file of a form, or the GLB made of several. */
static api_outcome read_form(api_call *call, const char *content_type, api_upload *upload) {
  char boundary[71];
  api_form form;
  if (!api_multipart_boundary(content_type, boundary))
    return api_fail_with(call, 400, "multipart/form-data needs a boundary");
  if (api_form_read(upload->bytes, boundary, call->arena, &form, &call->fault.error) != TW_OK)
    return api_fail(call);
  if (form.count > 1) return join_files(call, &form, upload);
  upload->bytes = (api_bytes){form.files[0].bytes, form.files[0].size};
  upload->name = form.files[0].name;
  return API_DONE;
}

/* The decoded size assumed for the memory grant, before it is known; max_upload limits the actual size. */
static uint64_t likely_size(uint64_t coded, uint64_t limit) {
  static const uint64_t ratio = 64, least = 1 << 20;
  return coded < (limit > least ? (limit - least) / ratio : 0) ? coded * ratio + least : limit;
}

static api_outcome decode_body(api_call *call, api_coding coding, api_upload *upload) {
  uint64_t limit = call->service->limits.max_upload;
  api_upload_type type = api_upload_type_of(api_call_header(call, "Content-Type"));
  uint64_t cost = api_reading_cost(type, coding, likely_size(upload->bytes.size, limit));
  if (!api_grant(call, cost)) return API_FAILED;
  size_t size;
  tw_status status = api_decode(coding, upload->bytes, call->service->limits.max_upload, &upload->decoded,
                                &size, &call->fault.error);
  if (status == TW_OK) {
    upload->bytes = (api_bytes){upload->decoded, size};
    return API_DONE;
  }
  api_fail(call);
  if (status == TW_LIMIT) call->fault.status = 413;
  return API_FAILED;
}

api_outcome api_upload_read(api_call *call, api_upload *out) {
  const char *content_type = api_call_header(call, "Content-Type");
  api_coding coding = api_coding_of(api_call_header(call, "Content-Encoding"));
  api_upload upload = {.bytes = call->request->body};
  if (upload.bytes.size > call->service->limits.max_upload)
    return api_fail_with(call, 413, "the body is over the limit of %llu %s",
                         (unsigned long long)call->service->limits.max_upload,
                         tw_plural(call->service->limits.max_upload, "byte", "bytes"));
  if (call->request->is_body_mapped && !tw_meter_take(upload.bytes.size)) {
    api_fault_without_memory(&call->fault);
    return API_FAILED;
  }
  api_outcome outcome = coding == API_CODING_NONE ? API_DONE : decode_body(call, coding, &upload);
  if (outcome == API_DONE && api_upload_type_of(content_type) == API_TYPE_MULTIPART)
    outcome = read_form(call, content_type, &upload);
  if (outcome == API_DONE && upload.bytes.size == 0) outcome = api_fail_with(call, 400, "the body is empty");
  if (outcome == API_DONE)
    *out = upload;
  else
    api_upload_deinit(&upload);
  return outcome;
}

api_outcome api_json_read(api_call *call, api_bytes bytes, uint64_t values_max, api_json_reader *read,
                          void *context) {
  api_json json = {call->arena, &call->fault.error, NULL};
  api_value root;
  tw_status status = api_json_open(&json, (const char *)bytes.data, bytes.size, values_max, &root);
  if (status == TW_OK) status = read(context, &root);
  api_json_close(&root);
  if (call->fault.stall != API_STALL_NONE) return API_FAILED;
  return status == TW_OK ? API_DONE : api_fail_in_document(call);
}

api_outcome api_upload_json(api_call *call, uint64_t values_max, api_json_reader *read, void *context) {
  api_upload upload = {0};
  api_outcome outcome = api_upload_read(call, &upload);
  if (outcome == API_DONE) outcome = api_json_read(call, upload.bytes, values_max, read, context);
  api_upload_deinit(&upload);
  return outcome;
}

/* Whether the format is or may be text, and has a beginning of its own. */
static bool is_other_text(tw_format format) {
  return format == TW_FORMAT_STL || format == TW_FORMAT_PLY || format == TW_FORMAT_BVH;
}

/* The format that the declared type asks for: the one that was found where that fits, or where the type asks
 * for none. */
static tw_format declared_format(api_upload_type type, tw_format found) {
  switch (type) {
  case API_TYPE_GLB: return TW_FORMAT_GLB;
  case API_TYPE_GLTF: return TW_FORMAT_GLTF;
  case API_TYPE_OBJ: return TW_FORMAT_OBJ;
  case API_TYPE_STL: return TW_FORMAT_STL;
  case API_TYPE_PLY: return TW_FORMAT_PLY;
  case API_TYPE_BVH: return TW_FORMAT_BVH;
  case API_TYPE_TEXT: return is_other_text(found) ? found : TW_FORMAT_OBJ;
  case API_TYPE_JSON: return found == TW_FORMAT_GLTF ? found : TW_FORMAT_JSON;
  case API_TYPE_BYTES:
  case API_TYPE_MULTIPART:
  case API_TYPE_OTHER: break;
  }
  return found;
}

/* Whether the type names one format. */
static bool names_format(api_upload_type type) {
  return type != API_TYPE_TEXT && type != API_TYPE_BYTES && type != API_TYPE_MULTIPART &&
         type != API_TYPE_OTHER;
}

static api_outcome fail_foreign(api_call *call, const api_foreign *foreign) {
  call->fault.supported = api_upload_types;
  return api_fail_with(call, 415,
                       "the body looks like %s%s%s; a model is GLB, glTF, OBJ, STL, PLY, BVH or tweend JSON",
                       foreign->name, foreign->advice ? ": " : "", foreign->advice ? foreign->advice : "");
}

static api_outcome fail_declared(api_call *call, const char *declared, const char *found,
                                 const char *advice) {
  return api_fail_with(call, 400, "declared as %s, but the bytes look like %s%s%s", declared, found,
                       advice ? ": " : "", advice ? advice : "");
}

/* Bytes that begin like no other format are taken for OBJ, which has no signature. Where they have no line of
 * one, and the type names a format, they lack its signature, or are read as that for its reader's error. */
api_outcome api_upload_format(api_call *call, api_bytes bytes, tw_format *out) {
  static const char *const shown[TW_FORMATS] = {"OBJ or other text",
                                                "tweend JSON (no \"asset\", no \"buffers\")",
                                                "glTF JSON",
                                                "GLB",
                                                "STL",
                                                "PLY",
                                                "BVH"};
  api_upload_type type = api_upload_type_of(api_call_header(call, "Content-Type"));
  tw_format found = tw_format_sniff(bytes.data, bytes.size), declared = declared_format(type, found);
  const char *name = type == API_TYPE_TEXT ? "text/plain" : tw_format_media_types[declared];
  bool is_named = names_format(type), may_be_foreign = found == TW_FORMAT_OBJ || found == TW_FORMAT_GLB;
  api_foreign known = may_be_foreign ? api_foreign_known(bytes) : (api_foreign){0};
  if (known.name)
    return is_named ? fail_declared(call, name, known.name, known.advice) : fail_foreign(call, &known);
  if (found == TW_FORMAT_OBJ) {
    api_foreign other = api_foreign_other(bytes);
    bool has_signature = declared == TW_FORMAT_GLB || declared == TW_FORMAT_PLY || declared == TW_FORMAT_BVH;
    if (other.name && !is_named) return fail_foreign(call, &other);
    if (other.name && has_signature) return fail_declared(call, name, other.name, NULL);
    if (other.name || type == API_TYPE_JSON) found = declared;
  }
  if (declared != found) return fail_declared(call, name, shown[found], NULL);
  *out = found;
  return API_DONE;
}

tw_status api_quads_read(const api_query *query, tw_quads *out, tw_error *error) {
  static const char *const names[] = {"ngon", "auto", "off", NULL};
  int quads = -1;
  tw_status status = api_query_choice(query, "quads", names, &quads, error);
  *out = (tw_quads)(TW_QUADS_USUAL + 1 + quads);
  return status;
}

bool api_model_read(api_bytes bytes, tw_format format, api_reading reading, const api_making *making,
                    tw_model **out, api_fault *fault) {
  tw_model *model = NULL;
  tw_status status = TW_OK;
  switch (format) {
  case TW_FORMAT_OBJ:
    status = tw_obj_read(bytes.data, bytes.size, reading.weld, &model, &fault->error);
    break;
  case TW_FORMAT_STL:
    status = tw_stl_read(bytes.data, bytes.size, reading.quads, reading.weld, &model, &fault->error);
    break;
  case TW_FORMAT_PLY:
    status = tw_ply_read(bytes.data, bytes.size, reading.weld, &model, &fault->error);
    break;
  case TW_FORMAT_BVH: status = tw_bvh_read(bytes.data, bytes.size, &model, &fault->error); break;
  case TW_FORMAT_JSON:
    status = api_model_from_json((const char *)bytes.data, bytes.size, making, &model, &fault->error);
    break;
  case TW_FORMAT_GLTF:
  case TW_FORMAT_GLB:
    status = tw_gltf_read(bytes.data, bytes.size, reading.quads, reading.weld, JSON_VALUES_MAX, &model,
                          &fault->error);
    break;
  }
  bool is_merged = reading.weld == TW_WELD_EXACT || reading.weld == TW_WELD_DISTANCE;
  if (status == TW_OK && is_merged) {
    status = tw_model_weld(model, reading.distance, &fault->error);
    if (status != TW_OK) tw_model_destroy(model);
  }
  if (status == TW_OK) {
    *out = model;
    return true;
  }
  if (fault->stall != API_STALL_NONE) return false;
  api_fault_complete(fault);
  bool is_json = format == TW_FORMAT_JSON || format == TW_FORMAT_GLTF || format == TW_FORMAT_GLB;
  fault->in_document = is_json && status != TW_NO_MEMORY;
  return false;
}
