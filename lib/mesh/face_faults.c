/* Finds faces that keep the seams of a soup from closing. */
#include "face_faults.h"

#include <string.h>

#include "bucket_sort.h"
#include "vector3.h"

/* ---- collapsed faces ------------------------------------------------------------------------- */

static bool has_three_places(const tw_soup *soup, const uint32_t *place, uint32_t face) {
  uint32_t begin = soup->face_offsets[face], end = soup->face_offsets[face + 1];
  const uint32_t *corners = soup->corners + begin;
  uint32_t first = place[corners[0]], second = first;
  if (end - begin == 3) {
    uint32_t third = place[corners[2]];
    second = place[corners[1]];
    return first != second && second != third && third != first;
  }
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
  const uint32_t *faces;  /* those that are sorted, ascending */
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

/* The same for faces with the same places in the same direction: a sum over the sides. */
static uint32_t hash_face(const tw_soup *soup, const uint32_t *place, uint32_t face) {
  uint32_t begin = soup->face_offsets[face], end = soup->face_offsets[face + 1];
  uint64_t hash = 0, from = end > begin ? place[soup->corners[end - 1]] : 0;
  for (uint32_t c = begin; c < end; c++) {
    uint64_t to = place[soup->corners[c]], side = (from << 32 | to) * 0x9E3779B97F4A7C15u;
    hash += side ^ side >> 29;
    from = to;
  }
  return (uint32_t)(hash * 0x9E3779B97F4A7C15u >> 32);
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
  const face_order *faces = context;
  int order = compare_faces(faces, faces->faces[a], faces->faces[b]);
  return order != 0 ? order < 0 : a < b;
}

static uint32_t face_bucket(const void *context, uint32_t i) {
  const face_order *order = context;
  return order->hashes[order->faces[i]] & order->bucket_mask;
}

/* hashes, faces: [face_count] scratch. sorted: as well. */
static tw_status mark_alike(const tw_soup *soup, const uint32_t *place, uint32_t *hashes, uint32_t *faces,
                            uint32_t *sorted, uint8_t *left_out, uint32_t *count, tw_error *error) {
  for (uint32_t face = 0; face < soup->face_count; face++) hashes[face] = hash_face(soup, place, face);
  uint32_t alike, buckets;
  tw_status status = tw_list_alike(hashes, soup->face_count, faces, &alike, error);
  if (status != TW_OK) return status;
  for (buckets = 1; buckets < alike && buckets < 1u << 31;) buckets *= 2;
  const face_order order = {soup, place, hashes, faces, buckets - 1};
  status = tw_sort_in_buckets(face_bucket, alike, buckets, face_less, &order, sorted, error);
  for (uint32_t i = 1; i < alike && status == TW_OK; i++) {
    uint32_t face = faces[sorted[i]], before = faces[sorted[i - 1]];
    bool is_doubled = !left_out[face] && compare_faces(&order, before, face) == 0;
    left_out[face] |= is_doubled;
    *count += is_doubled;
  }
  return status;
}

tw_status tw_mark_doubled(const tw_soup *soup, const uint32_t *place, uint8_t *left_out, uint32_t *count,
                          tw_error *error) {
  size_t faces = soup->face_count;
  uint32_t *scratch = tw_alloc(faces, 3 * sizeof *scratch);
  *count = 0;
  if (!scratch) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  tw_status status =
      mark_alike(soup, place, scratch, scratch + faces, scratch + 2 * faces, left_out, count, error);
  tw_free(scratch);
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
