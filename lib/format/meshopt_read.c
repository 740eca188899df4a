/* The decoders of meshoptimizer, with the checks that they leave to their callers. */
#include "meshopt_read.h"

#include <meshoptimizer.h>

static tw_status fail(tw_error *error, const char *detail) {
  return tw_fail(error, TW_INVALID, "%s", detail);
}

/* Whether a filter takes elements of `stride` bytes, a multiple of four. */
static bool fits_filter(tw_meshopt_filter filter, uint64_t stride) {
  switch (filter) {
  case TW_MESHOPT_NONE:
  case TW_MESHOPT_EXPONENTIAL: return true;
  case TW_MESHOPT_OCTAHEDRAL: return stride == 4 || stride == 8;
  case TW_MESHOPT_QUATERNION: return stride == 8;
  }
  return false;
}

tw_status tw_meshopt_check(const tw_meshopt_view *view, uint64_t decoded_size, tw_error *error) {
  if (view->count == 0 || view->count > UINT32_MAX || view->stride == 0 || view->stride > 256)
    return fail(error, "a compressed view needs a count and a stride of 1 to 256 bytes");
  if (view->count * view->stride != decoded_size)
    return fail(error, "count and byteStride do not make the byteLength of the view");
  if (view->mode == TW_MESHOPT_ATTRIBUTES)
    return view->stride % 4 == 0 && fits_filter(view->filter, view->stride)
               ? TW_OK
               : fail(error, "the stride does not fit attributes, or their filter");
  if (view->stride != 2 && view->stride != 4) return fail(error, "indices have 2 or 4 bytes");
  if (view->filter != TW_MESHOPT_NONE) return fail(error, "only attributes have a filter");
  if (view->mode == TW_MESHOPT_TRIANGLES && view->count % 3 != 0)
    return fail(error, "triangles have three indices each");
  return TW_OK;
}

static int decode(const tw_meshopt_view *view, const uint8_t *bytes, size_t size, uint8_t *out) {
  size_t count = (size_t)view->count, stride = (size_t)view->stride;
  switch (view->mode) {
  case TW_MESHOPT_ATTRIBUTES: return meshopt_decodeVertexBuffer(out, count, stride, bytes, size);
  case TW_MESHOPT_TRIANGLES: return meshopt_decodeIndexBuffer(out, count, stride, bytes, size);
  case TW_MESHOPT_INDICES: return meshopt_decodeIndexSequence(out, count, stride, bytes, size);
  }
  return -1;
}

tw_status tw_meshopt_decode(const tw_meshopt_view *view, const uint8_t *bytes, size_t size, uint8_t *out,
                            tw_error *error) {
  tw_status status = tw_meshopt_check(view, view->count * view->stride, error);
  if (status != TW_OK) return status;
  if (decode(view, bytes, size, out) != 0) return fail(error, "the compressed bytes are damaged");
  size_t count = (size_t)view->count, stride = (size_t)view->stride;
  switch (view->filter) {
  case TW_MESHOPT_NONE: break;
  case TW_MESHOPT_OCTAHEDRAL: meshopt_decodeFilterOct(out, count, stride); break;
  case TW_MESHOPT_QUATERNION: meshopt_decodeFilterQuat(out, count, stride); break;
  case TW_MESHOPT_EXPONENTIAL: meshopt_decodeFilterExp(out, count, stride); break;
  }
  return TW_OK;
}
