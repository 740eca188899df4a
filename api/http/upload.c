/* From a request's body to the bytes of one model, and from those to the model. */
#include "upload.h"

#include "json_in.h"
#include "service.h"

#include <stdlib.h>

/* Values in the JSON of a glTF file: tinygltf takes a kilobyte and more for some of them. */
static const tw_read_limits read_limits = {.json_values = 500000};

uint64_t api_reading_cost(api_upload_type type, api_coding coding, uint64_t size) {
  /* What is not declared as OBJ may be glTF, which takes most. */
  uint64_t reading =
      tw_reading_size(type == API_TYPE_OBJ || type == API_TYPE_TEXT ? TW_FORMAT_OBJ : TW_FORMAT_GLTF, size);
  uint64_t window = coding == API_CODING_ZSTD ? 1 << API_ZSTD_WINDOW_LOG : 0;
  uint64_t decoding = coding == API_CODING_NONE ? 0 : size / 2 * 5 + window + (1 << 20);
  return reading > decoding ? reading : decoding;
}

void api_upload_deinit(api_upload *upload) {
  free(upload->decoded);
  *upload = (api_upload){0};
}

/* The file inside a form. */
static api_outcome read_form(api_call *call, const char *content_type, api_upload *upload) {
  char boundary[71];
  if (!api_multipart_boundary(content_type, boundary))
    return api_fail_with(call, 400, "multipart/form-data needs a boundary");
  if (api_multipart_file(upload->bytes, boundary, &upload->bytes, &call->fault.error) != TW_OK)
    return api_fail(call);
  return API_DONE;
}

/* What a body is taken to have decoded, before that is known; its limit holds whatever it has. */
static uint64_t likely_size(uint64_t coded, uint64_t limit) {
  static const uint64_t ratio = 64, least = 1 << 20;
  return coded < (limit > least ? (limit - least) / ratio : 0) ? coded * ratio + least : limit;
}

static api_outcome decode_body(api_call *call, api_coding coding, api_upload *upload) {
  uint64_t limit = call->service->limits.max_upload;
  api_upload_type type = api_upload_type_of(api_call_header(call, "Content-Type"));
  uint64_t cost = api_reading_cost(type, coding, likely_size(upload->bytes.size, limit));
  if (!api_grant(call->service, call->request->ticket, cost, &call->fault)) return API_FAILED;
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
    return api_fail_with(call, 413, "the body is over the limit of %llu bytes",
                         (unsigned long long)call->service->limits.max_upload);
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

api_outcome api_upload_format(api_call *call, api_bytes bytes, tw_format *out) {
  static const char *const shown[TW_FORMATS] = {
      "OBJ or other text", "tweend JSON (no \"asset\")", "glTF JSON", "GLB", "STL", "PLY"};
  tw_format found = tw_format_sniff(bytes.data, bytes.size);
  tw_format declared = found;
  switch (api_upload_type_of(api_call_header(call, "Content-Type"))) {
  case API_TYPE_GLB: declared = TW_FORMAT_GLB; break;
  case API_TYPE_GLTF: declared = TW_FORMAT_GLTF; break;
  case API_TYPE_OBJ: declared = TW_FORMAT_OBJ; break;
  case API_TYPE_STL: declared = TW_FORMAT_STL; break;
  case API_TYPE_PLY: declared = TW_FORMAT_PLY; break;
  case API_TYPE_TEXT:
    if (found != TW_FORMAT_STL && found != TW_FORMAT_PLY) declared = TW_FORMAT_OBJ;
    break;
  case API_TYPE_JSON:
    /* What does not begin like JSON is read as JSON all the same, for an error that says where. */
    if (found == TW_FORMAT_OBJ) declared = found = TW_FORMAT_JSON;
    if (found != TW_FORMAT_JSON && found != TW_FORMAT_GLTF) declared = TW_FORMAT_JSON;
    break;
  case API_TYPE_BYTES:
  case API_TYPE_MULTIPART:
  case API_TYPE_OTHER: break;
  }
  if (declared != found)
    return api_fail_with(call, 400, "declared as %s, but the bytes look like %s",
                         tw_format_media_types[declared], shown[found]);
  *out = found;
  return API_DONE;
}

bool api_model_read(api_bytes bytes, tw_format format, tw_quads quads, tw_model **out, api_fault *fault) {
  tw_status status = TW_OK;
  switch (format) {
  case TW_FORMAT_OBJ: status = tw_obj_read(bytes.data, bytes.size, out, &fault->error); break;
  case TW_FORMAT_STL: status = tw_stl_read(bytes.data, bytes.size, out, &fault->error); break;
  case TW_FORMAT_PLY: status = tw_ply_read(bytes.data, bytes.size, out, &fault->error); break;
  case TW_FORMAT_JSON:
    status = api_model_from_json((const char *)bytes.data, bytes.size, out, &fault->error);
    break;
  case TW_FORMAT_GLTF:
  case TW_FORMAT_GLB:
    status = tw_gltf_read(bytes.data, bytes.size, quads, &read_limits, out, &fault->error);
    break;
  }
  if (status == TW_OK) return true;
  api_fault_complete(fault);
  bool is_json = format == TW_FORMAT_JSON || format == TW_FORMAT_GLTF || format == TW_FORMAT_GLB;
  fault->in_document = is_json && status != TW_NO_MEMORY;
  return false;
}
