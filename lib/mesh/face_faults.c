/* Finds faces that keep the seams of a soup from closing. */
#include "face_faults.h"

#include <string.h>

#include "bucket_sort.h"
#include "vector3.h"

/* ---- collapsed faces ------------------------------------------------------------------------- */

static bool has_three_places(const tw_soup *soup, const uint32_t *place, uint32_t face) {
  uint32_t begin = soup->face_offsets[face], end = soup->face_offsets[face + 1];
  uint32_t first = place[soup->corners[begin]], second = first;
  for (uint32_t c = begin + 1; c < end; c++) {
    uint32_t other = place[soup->corners[c]];
    if (other == first || other == second) continue;
    if (second != first) return true;
    second = other;
  }
  return false;
}

uint32_t tw_mark_collapsed(const tw_soup *soup, const uint32_t *place, uint8_t *left_out) {
  uint32_t count = 0;
  for (uint32_t face = 0; face < soup->face_count; face++) {
    if (has_three_places(soup, place, face)) continue;
    left_out[face] = 1;
    count++;
  }
  return count;
}

/* ---- doubled faces --------------------------------------------------------------------------- */

typedef struct face_order {
  const tw_soup *soup;
  const uint32_t *place;
  const uint32_t *hashes; /* [face_count] */
  uint32_t bucket_mask;
} face_order;

/* The corners of a face, from the first one at its least place on. */
typedef struct face_round {
  const uint32_t *corners; /* [size] */
  uint32_t size, start;
} face_round;

static face_round round_of(const face_order *order, uint32_t face) {
  uint32_t begin = order->soup->face_offsets[face];
  face_round out = {order->soup->corners + begin, order->soup->face_offsets[face + 1] - begin, 0};
  for (uint32_t k = 1; k < out.size; k++)
    if (order->place[out.corners[k]] < order->place[out.corners[out.start]]) out.start = k;
  return out;
}

static uint32_t place_at(const face_order *order, const face_round *round, uint32_t k) {
  uint32_t at = round->start + k;
  return order->place[round->corners[at < round->size ? at : at - round->size]];
}

static int32_t material_of(const face_order *order, uint32_t face) {
  return order->soup->face_materials ? order->soup->face_materials[face] : 0;
}

static uint32_t hash_face(const face_order *order, uint32_t face) {
  const face_round round = round_of(order, face);
  uint64_t hash = round.size;
  for (uint32_t k = 0; k < round.size; k++) {
    hash = (hash ^ place_at(order, &round, k)) * 0x9E3779B97F4A7C15u;
    hash ^= hash >> 32;
  }
  return (uint32_t)hash;
}

/* By hashes first, which are at hand. */
static int compare_faces(const face_order *order, uint32_t a, uint32_t b) {
  if (order->hashes[a] != order->hashes[b]) return order->hashes[a] < order->hashes[b] ? -1 : 1;
  const face_round left = round_of(order, a), right = round_of(order, b);
  if (left.size != right.size) return left.size < right.size ? -1 : 1;
  for (uint32_t k = 0; k < left.size; k++) {
    uint32_t p = place_at(order, &left, k), q = place_at(order, &right, k);
    if (p != q) return p < q ? -1 : 1;
  }
  int32_t p = material_of(order, a), q = material_of(order, b);
  return p < q ? -1 : p > q;
}

static bool face_less(const void *context, uint32_t a, uint32_t b) {
  int order = compare_faces(context, a, b);
  return order != 0 ? order < 0 : a < b;
}

static uint32_t face_bucket(const void *context, uint32_t face) {
  const face_order *order = context;
  return order->hashes[face] & order->bucket_mask;
}

tw_status tw_mark_doubled(const tw_soup *soup, const uint32_t *place, uint8_t *left_out, uint32_t *count,
                          tw_error *error) {
  uint32_t bucket_count = 1, faces = soup->face_count;
  while (bucket_count < faces && bucket_count < 1u << 31) bucket_count *= 2;
  uint32_t *hashes = tw_alloc(faces, 2 * sizeof *hashes);
  if (!hashes) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  uint32_t *sorted = hashes + faces;
  const face_order order = {soup, place, hashes, bucket_count - 1};
  for (uint32_t face = 0; face < faces; face++) hashes[face] = hash_face(&order, face);
  tw_status status = tw_sort_in_buckets(face_bucket, faces, bucket_count, face_less, &order, sorted, error);
  *count = 0;
  for (uint32_t i = 1; i < faces && status == TW_OK; i++) {
    uint32_t face = sorted[i], before = sorted[i - 1];
    bool is_doubled = !left_out[face] && compare_faces(&order, before, face) == 0;
    left_out[face] |= is_doubled;
    *count += is_doubled;
  }
  tw_free(hashes);
  return status;
}

/* ---- slivers --------------------------------------------------------------------------------- */

/* The corner of a face that lies farthest from a point. */
static const float *farthest_from(const tw_soup *soup, uint32_t face, const float *from) {
  const float *farthest = from;
  double most = 0, side[3];
  for (uint32_t c = soup->face_offsets[face]; c < soup->face_offsets[face + 1]; c++) {
    const float *corner = soup->positions + 3 * (size_t)soup->corners[c];
    tw_side3(from, corner, side);
    double square = tw_dot3(side, side);
    if (square > most) {
      most = square;
      farthest = corner;
    }
  }
  return farthest;
}

bool tw_is_sliver(const tw_soup *soup, uint32_t face, double height) {
  const float *a = soup->positions + 3 * (size_t)soup->corners[soup->face_offsets[face]];
  const float *b = farthest_from(soup, face, a);
  a = farthest_from(soup, face, b);
  double along[3], side[3], across[3];
  tw_side3(a, b, along);
  double length = tw_length3(along);
  for (uint32_t c = soup->face_offsets[face]; c < soup->face_offsets[face + 1]; c++) {
    tw_side3(a, soup->positions + 3 * (size_t)soup->corners[c], side);
    tw_cross3(along, side, across);
    if (!(tw_length3(across) < height * length)) return false;
  }
  return true;
}
