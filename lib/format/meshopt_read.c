/* The decoders of meshoptimizer, with the checks that they leave to their callers; and what
 * KHR_meshopt_compression adds, which meshoptimizer reads from 0.23 on: version 1 of attributes and the
 * filter of colours. */
#include "meshopt_read.h"

#include <string.h>

#include <meshoptimizer.h>

#include "word.h"

static tw_status fail(tw_error *error, const char *detail) {
  return tw_fail(error, TW_INVALID, "%s", detail);
}

/* Whether a filter takes elements of `stride` bytes, a multiple of four. */
static bool fits_filter(tw_meshopt_filter filter, uint64_t stride) {
  switch (filter) {
  case TW_MESHOPT_NONE:
  case TW_MESHOPT_EXPONENTIAL: return true;
  case TW_MESHOPT_OCTAHEDRAL:
  case TW_MESHOPT_COLOR: return stride == 4 || stride == 8;
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

/* ---- version 1 of attributes ----------------------------------------------------------------- */

enum { VERSION_1 = 0xA1, GROUP = 16, BLOCK_MAX = 256, BLOCK_SIZE = 8192, TAIL_MIN = 24 };

/* Bytes that are not read yet. */
typedef struct byte_source {
  const uint8_t *at, *end;
} byte_source;

/* The next bytes; NULL where fewer are left. */
static const uint8_t *take(byte_source *source, size_t count) {
  const uint8_t *bytes = source->at;
  if ((size_t)(source->end - source->at) < count) return NULL;
  source->at += count;
  return bytes;
}

/* Number i of packed numbers of 1, 2 or 4 bits: the least bit of a byte is first, of wider ones the greatest.
 */
static uint8_t packed_number(const uint8_t *packed, uint32_t i, uint32_t bits) {
  uint32_t each = 8 / bits, place = i % each;
  uint32_t shift = bits == 1 ? place : bits * (each - 1 - place);
  return (uint8_t)(packed[i / each] >> shift & ((1u << bits) - 1));
}

/* Reads 16 deltas of some bits. A number of ones alone stands for a byte behind the numbers. */
static bool read_group(byte_source *source, uint32_t bits, uint8_t out[GROUP]) {
  const uint8_t *packed = take(source, (size_t)2 * bits);
  if (!packed) return false;
  if (bits == 0) memset(out, 0, GROUP);
  if (bits == 8) memcpy(out, packed, GROUP);
  for (uint32_t i = 0; bits > 0 && bits < 8 && i < GROUP; i++) {
    out[i] = packed_number(packed, i, bits);
    if (out[i] + 1u < 1u << bits) continue;
    const uint8_t *wide = take(source, 1);
    if (!wide) return false;
    out[i] = *wide;
  }
  return true;
}

/* Reads the deltas of one byte of `count` elements of a block. */
static bool read_column(byte_source *source, uint32_t control, size_t count, uint8_t out[BLOCK_MAX]) {
  static const uint8_t widths[2][4] = {{0, 1, 2, 4}, {1, 2, 4, 8}};
  enum { REPEATED = 2, LITERAL = 3 };
  size_t groups = (count + GROUP - 1) / GROUP;
  if (control == REPEATED) {
    memset(out, 0, count);
    return true;
  }
  const uint8_t *head = take(source, control == LITERAL ? count : (groups + 3) / 4);
  if (!head) return false;
  if (control == LITERAL) {
    memcpy(out, head, count);
    return true;
  }
  for (size_t g = 0; g < groups; g++)
    if (!read_group(source, widths[control][head[g / 4] >> 2 * (g % 4) & 3], out + GROUP * g)) return false;
  return true;
}

static uint32_t from_zigzag(uint32_t v) {
  return (v & 1) ? ~(v >> 1) : v >> 1;
}

/* The four bytes of an element, from those of the element before it and the deltas. mode: of the channel, one
 * that is_mode knows. */
static uint32_t follow(uint32_t before, uint32_t delta, uint8_t mode) {
  uint32_t width = mode == 0 ? 8 : 16, mask = mode == 0 ? 0xFF : 0xFFFF, out = 0, turn = mode >> 4;
  if ((mode & 15) == 2) return before ^ (turn > 0 ? delta >> turn | delta << (32 - turn) : delta);
  for (uint32_t shift = 0; shift < 32; shift += width)
    out |= (((before >> shift) + from_zigzag(delta >> shift & mask)) & mask) << shift;
  return out;
}

static bool is_mode(uint8_t mode) {
  return mode <= 1 || (mode & 15) == 2;
}

/* Reads four columns of a block, which are one channel. out: of its first element. before: the element before
 * that one; receives the last. */
static bool read_channel(byte_source *source, uint8_t control, uint8_t mode, size_t count, size_t stride,
                         uint8_t *before, uint8_t *out) {
  uint8_t deltas[4][BLOCK_MAX];
  uint32_t value = tw_read_u32(before);
  for (uint32_t i = 0; i < 4; i++)
    if (!read_column(source, control >> 2 * i & 3, count, deltas[i])) return false;
  for (size_t e = 0; e < count; e++) {
    const uint8_t delta[4] = {deltas[0][e], deltas[1][e], deltas[2][e], deltas[3][e]};
    value = follow(value, tw_read_u32(delta), mode);
    tw_put_u32(out + stride * e, value);
  }
  tw_put_u32(before, value);
  return true;
}

/* Version 1 of attributes: a header, blocks of elements, and a tail of the element before the first one and
 * the mode of each channel. False where the bytes are damaged. */
static bool decode_attributes(size_t count, size_t stride, const uint8_t *bytes, size_t size, uint8_t *out) {
  size_t channels = stride / 4, tail = stride + channels, padded = tail < TAIL_MIN ? TAIL_MIN : tail;
  size_t block = BLOCK_SIZE / stride / GROUP * GROUP;
  uint8_t before[256];
  if (size < 1 + padded) return false;
  if (block > BLOCK_MAX) block = BLOCK_MAX;
  const uint8_t *modes = bytes + size - channels;
  byte_source source = {bytes + 1, bytes + size - padded};
  memcpy(before, bytes + size - tail, stride);
  for (size_t k = 0; k < channels; k++)
    if (!is_mode(modes[k])) return false;
  for (size_t first = 0; first < count; first += block) {
    size_t elements = count - first < block ? count - first : block;
    const uint8_t *controls = take(&source, channels);
    for (size_t k = 0; k < channels; k++)
      if (!controls || !read_channel(&source, controls[k], modes[k], elements, stride, before + 4 * k,
                                     out + stride * first + 4 * k))
        return false;
  }
  return source.at == source.end;
}

/* ---- the filter of colours --------------------------------------------------------------------- */

/* What of 0 to `most` a colour of 0 to `range` is. */
static uint32_t scale_color(int32_t value, uint32_t range, uint32_t most) {
  if (value <= 0) return 0;
  return (uint32_t)value >= range ? most : ((uint32_t)value * most + range / 2) / range;
}

/* Decodes luma, two chromas and alpha of 8 or 16 bits each, in place. The range of all is told by the bit
 * before alpha's. */
static void decode_colors(uint8_t *bytes, size_t count, size_t stride) {
  size_t width = stride / 4;
  uint32_t most = width == 1 ? 0xFF : 0xFFFF;
  for (size_t i = 0; i < count; i++, bytes += stride) {
    int32_t in[4];
    uint32_t range = 1;
    for (size_t k = 0; k < 4; k++) {
      const uint8_t *at = bytes + width * k;
      uint32_t value = width == 1 ? at[0] : at[0] | (uint32_t)at[1] << 8;
      bool is_signed = k == 1 || k == 2;
      in[k] = (int32_t)value - (is_signed && value > most / 2 ? (int32_t)most + 1 : 0);
    }
    while (range < (uint32_t)in[3]) range = 2 * range + 1;
    int32_t alpha = in[3] & (int32_t)(range >> 1);
    const int32_t out[4] = {in[0] + in[1] - in[2], in[0] + in[2], in[0] - in[1] - in[2],
                            2 * alpha + (alpha & 1)};
    for (size_t k = 0; k < 4; k++) {
      uint32_t value = scale_color(out[k], range, most);
      for (size_t b = 0; b < width; b++) bytes[width * k + b] = (uint8_t)(value >> 8 * b);
    }
  }
}

/* ---- any view ---------------------------------------------------------------------------------- */

static int decode(const tw_meshopt_view *view, const uint8_t *bytes, size_t size, uint8_t *out) {
  size_t count = (size_t)view->count, stride = (size_t)view->stride;
  switch (view->mode) {
  case TW_MESHOPT_ATTRIBUTES:
    if (size > 0 && bytes[0] == VERSION_1) return decode_attributes(count, stride, bytes, size, out) ? 0 : -1;
    return meshopt_decodeVertexBuffer(out, count, stride, bytes, size);
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
  case TW_MESHOPT_COLOR: decode_colors(out, count, stride); break;
  }
  return TW_OK;
}
