/* Quads out of the triangles that an exporter split them into. Exporters keep the halves next to each
 * other, so only neighbours in the file are tried; which neighbours is a best path along the faces. */
#include "quad_pairing.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const float *corner_position(const tw_mesh *mesh, uint32_t corner) {
  return mesh->positions + 3 * (size_t)mesh->corners[corner];
}

static uint32_t face_size(const tw_mesh *mesh, uint32_t face) {
  return mesh->face_offsets[face + 1] - mesh->face_offsets[face];
}

/* (b - a) x (c - a): twice the triangle's area as a vector. */
static void normal_of(const float *a, const float *b, const float *c, double out[3]) {
  double p[3], q[3];
  for (int i = 0; i < 3; i++) {
    p[i] = (double)b[i] - (double)a[i];
    q[i] = (double)c[i] - (double)a[i];
  }
  for (int i = 0; i < 3; i++) out[i] = p[(i + 1) % 3] * q[(i + 2) % 3] - p[(i + 2) % 3] * q[(i + 1) % 3];
}

static double dot(const double *a, const double *b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Corners of the quad that two triangles make, or false when they share no whole edge. */
static bool shared_edge(const tw_mesh *mesh, uint32_t first, uint32_t second, uint32_t quad[4]) {
  for (uint32_t i = 0; i < 3; i++)
    for (uint32_t j = 0; j < 3; j++) {
      uint32_t a = first + i, b = first + (i + 1) % 3, c = second + j, d = second + (j + 1) % 3;
      if (mesh->corners[a] != mesh->corners[d] || mesh->corners[b] != mesh->corners[c]) continue;
      for (uint32_t set = 0; set < mesh->uv_set_count; set++) {
        const uint32_t *uvs = mesh->uv_sets[set].corners;
        if (uvs[a] != uvs[d] || uvs[b] != uvs[c]) return false;
      }
      uint32_t apex = second + (j + 2) % 3;
      if (mesh->corners[apex] == mesh->corners[first + (i + 2) % 3]) return false;
      /* From the end of the shared edge round to its beginning, then the other triangle's apex. */
      quad[0] = b;
      quad[1] = first + (i + 2) % 3;
      quad[2] = a;
      quad[3] = apex;
      return true;
    }
  return false;
}

/* 0 for a quad that is not convex or bent by more than 60 degrees, else up to 1 for a flat rectangle. */
static double shape_quality(const tw_mesh *mesh, const uint32_t quad[4]) {
  const float *p[4];
  double turns[4][3], sum[3] = {0, 0, 0}, quality = 1;
  for (int i = 0; i < 4; i++) p[i] = corner_position(mesh, quad[i]);
  for (int i = 0; i < 4; i++) {
    normal_of(p[i], p[(i + 1) % 4], p[(i + 3) % 4], turns[i]);
    for (int k = 0; k < 3; k++) sum[k] += turns[i][k];
  }
  /* The halves lie at corners 1 and 3: the shared edge joins 0 and 2. */
  double lengths = sqrt(dot(turns[1], turns[1]) * dot(turns[3], turns[3]));
  double flatness = lengths > 0 ? dot(turns[1], turns[3]) / lengths : 0;
  if (flatness < 0.5) return 0;
  for (int i = 0; i < 4; i++) {
    const float *before = p[(i + 3) % 4], *after = p[(i + 1) % 4];
    double p2 = 0, q2 = 0;
    for (int k = 0; k < 3; k++) {
      double b = (double)before[k] - (double)p[i][k], a = (double)after[k] - (double)p[i][k];
      p2 += b * b;
      q2 += a * a;
    }
    double turn = dot(turns[i], sum) / sqrt(dot(sum, sum) * p2 * q2); /* sine of the corner's angle */
    if (!(turn > 0.02)) return 0;
    quality = fmin(quality, turn);
  }
  return quality * flatness;
}

/* What joining faces `face` and `face + 1` is worth, 0 when they can't be. Exporters split a quad
 * a b c d into a b c and a c d: that order is worth more than any shape. */
static double pair_worth(const tw_mesh *mesh, uint32_t face, uint32_t quad[4]) {
  if (face_size(mesh, face) != 3 || face_size(mesh, face + 1) != 3) return 0;
  if (mesh->face_materials && mesh->face_materials[face] != mesh->face_materials[face + 1]) return 0;
  uint32_t first = mesh->face_offsets[face], second = mesh->face_offsets[face + 1];
  if (!shared_edge(mesh, first, second, quad)) return 0;
  double quality = shape_quality(mesh, quad);
  if (quality == 0) return 0;
  bool fan = quad[0] == first && quad[3] == second + 2;
  return quality + (fan ? 2 : 1);
}

/* pairs[f]: f and f + 1 are joined. Of all ways to pair neighbours the one with the best sum: forward,
 * pairs[f] says whether the best way through the first f + 2 faces ends with that pair; backward, only
 * the pairs on the best way through all of them stay. best: [face_count + 1]. */
static void choose_pairs(const tw_mesh *mesh, double *best, bool *pairs) {
  uint32_t quad[4];
  best[0] = 0;
  for (uint32_t end = 1; end <= mesh->face_count; end++) {
    best[end] = best[end - 1];
    pairs[end - 1] = false;
    double worth = end > 1 ? pair_worth(mesh, end - 2, quad) : 0;
    if (worth == 0 || best[end - 2] + worth <= best[end]) continue;
    best[end] = best[end - 2] + worth;
    pairs[end - 2] = true;
  }
  for (uint32_t end = mesh->face_count; end > 0;) {
    pairs[end - 1] = false;
    end -= end > 1 && pairs[end - 2] ? 2 : 1;
  }
}

/* The faces after joining, written over new arrays of at most the old sizes. */
typedef struct joined_faces {
  uint32_t face_count, corner_count;
  uint32_t *offsets, *corners, *normals, *uvs[TW_UV_SETS_MAX];
  int32_t *materials;
} joined_faces;

static void add_corner(const tw_mesh *mesh, joined_faces *out, uint32_t corner) {
  for (uint32_t set = 0; set < mesh->uv_set_count; set++)
    out->uvs[set][out->corner_count] = mesh->uv_sets[set].corners[corner];
  if (mesh->normals.corners) out->normals[out->corner_count] = mesh->normals.corners[corner];
  out->corners[out->corner_count++] = mesh->corners[corner];
}

static void write_faces(const tw_mesh *mesh, const bool *pairs, joined_faces *out) {
  for (uint32_t face = 0; face < mesh->face_count; face++) {
    if (mesh->face_materials) out->materials[out->face_count] = mesh->face_materials[face];
    uint32_t quad[4];
    if (pairs[face] && shared_edge(mesh, mesh->face_offsets[face], mesh->face_offsets[face + 1], quad)) {
      for (int i = 0; i < 4; i++) add_corner(mesh, out, quad[i]);
      face++;
    } else {
      for (uint32_t c = mesh->face_offsets[face]; c < mesh->face_offsets[face + 1]; c++)
        add_corner(mesh, out, c);
    }
    out->offsets[++out->face_count] = out->corner_count;
  }
}

static tw_status reserve_faces(const tw_mesh *mesh, tw_arena *arena, uint32_t pair_count, joined_faces *out,
                               tw_error *error) {
  size_t faces = mesh->face_count - pair_count, corners = mesh->corner_count - 2 * (size_t)pair_count;
  bool enough = true;
  out->offsets = tw_arena_alloc(arena, faces + 1, sizeof *out->offsets);
  out->corners = tw_arena_alloc(arena, corners, sizeof *out->corners);
  for (uint32_t set = 0; set < mesh->uv_set_count; set++) {
    out->uvs[set] = tw_arena_alloc(arena, corners, sizeof *out->uvs[set]);
    enough &= out->uvs[set] != NULL;
  }
  out->normals = tw_arena_alloc(arena, mesh->normals.corners ? corners : 0, sizeof *out->normals);
  out->materials = tw_arena_alloc(arena, mesh->face_materials ? faces : 0, sizeof *out->materials);
  enough &= out->offsets && out->corners && out->normals && out->materials;
  return enough ? TW_OK : tw_fail(error, TW_NO_MEMORY, "out of memory");
}

static tw_status pair(tw_mesh *mesh, tw_arena *arena, double *best, bool *pairs, tw_error *error) {
  choose_pairs(mesh, best, pairs);
  uint32_t pair_count = 0;
  for (uint32_t face = 0; face < mesh->face_count; face++) pair_count += pairs[face];
  if (pair_count == 0) return TW_OK;
  joined_faces out = {0};
  tw_status status = reserve_faces(mesh, arena, pair_count, &out, error);
  if (status != TW_OK) return status;
  write_faces(mesh, pairs, &out);
  mesh->face_count = out.face_count;
  mesh->corner_count = out.corner_count;
  mesh->face_offsets = out.offsets;
  mesh->corners = out.corners;
  for (uint32_t set = 0; set < mesh->uv_set_count; set++) mesh->uv_sets[set].corners = out.uvs[set];
  if (mesh->normals.corners) mesh->normals.corners = out.normals;
  if (mesh->face_materials) mesh->face_materials = out.materials;
  return TW_OK;
}

tw_status tw_pair_triangles(tw_mesh *mesh, tw_arena *arena, tw_error *error) {
  double *best = tw_alloc((size_t)mesh->face_count + 1, sizeof *best);
  bool *pairs = tw_alloc(mesh->face_count, sizeof *pairs);
  tw_status status =
      best && pairs ? pair(mesh, arena, best, pairs, error) : tw_fail(error, TW_NO_MEMORY, "out of memory");
  free(best);
  free(pairs);
  return status;
}

size_t tw_pair_size(const tw_mesh *mesh) {
  size_t faces = mesh->face_count, corners = mesh->corner_count;
  return faces * (sizeof(double) + sizeof(bool) + 2 * sizeof(uint32_t)) +
         corners * (2 + mesh->uv_set_count) * sizeof(uint32_t) + 256;
}
