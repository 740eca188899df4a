/* Buffer views compressed by EXT_meshopt_compression or KHR_meshopt_compression:
 * https://github.com/KhronosGroup/glTF, extensions 2.0. */
#ifndef TWEEND_MESHOPT_READ_H
#define TWEEND_MESHOPT_READ_H

#include "tweend/base.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum tw_meshopt_mode {
  TW_MESHOPT_ATTRIBUTES,
  TW_MESHOPT_TRIANGLES,
  TW_MESHOPT_INDICES
} tw_meshopt_mode;
typedef enum tw_meshopt_filter {
  TW_MESHOPT_NONE,
  TW_MESHOPT_OCTAHEDRAL,
  TW_MESHOPT_QUATERNION,
  TW_MESHOPT_EXPONENTIAL,
  TW_MESHOPT_COLOR
} tw_meshopt_filter;

/* A compressed view as the extension describes it: `count` elements of `stride` bytes each. */
typedef struct tw_meshopt_view {
  uint64_t count, stride;
  tw_meshopt_mode mode;
  tw_meshopt_filter filter;
} tw_meshopt_view;

/* The most bytes that one compressed byte stands for: a byte of version 1 that says of four columns of a
 * block of 256 elements that they repeat. */
enum { TW_MESHOPT_EXPANSION_MAX = 1024 };

/* Decodes bytes [size], which may be hostile. out: [count * stride], aligned for floats; undefined after a
 * failure. TW_INVALID if the view breaks a rule of the extension or the bytes are damaged. O(out). */
tw_status tw_meshopt_decode(const tw_meshopt_view *view, const uint8_t *bytes, size_t size, uint8_t *out,
                            tw_error *error);

/* Checks the rules of the extension, and that count * stride is `decoded_size`; for use before `out` is
 * allocated. */
tw_status tw_meshopt_check(const tw_meshopt_view *view, uint64_t decoded_size, tw_error *error);

#ifdef __cplusplus
}
#endif
#endif
