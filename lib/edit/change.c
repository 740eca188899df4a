/* Changes, recorded as parents of new elements, and the mesh made from one: one rule each for the data of
 * points, corners, faces and edges. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "change_maker.h"
#include "sorted.h"

static uint64_t most(uint64_t a, uint64_t b) {
  return a > b ? a : b;
}

static bool allocate(tw_change *c, tw_arena *arena, const tw_change_size *size) {
  c->point_parents = tw_arena_alloc_raw(arena, size->points, sizeof(uint32_t));
  c->point_flags = tw_arena_alloc_raw(arena, size->points, 1);
  c->face_offsets = tw_arena_alloc(arena, size->faces + 1, sizeof(uint32_t));
  c->face_parents = tw_arena_alloc_raw(arena, size->faces, sizeof(uint32_t));
  c->face_flags = tw_arena_alloc_raw(arena, size->faces, 1);
  c->corners = tw_arena_alloc_raw(arena, size->corners, sizeof(uint32_t));
  c->corner_parents = tw_arena_alloc_raw(arena, size->corners, sizeof(uint32_t));
  c->corner_edges = tw_arena_alloc_raw(arena, size->corners, sizeof(uint32_t));
  c->corner_flags = tw_arena_alloc_raw(arena, size->corners, 1);
  c->mix_offsets = tw_arena_alloc(arena, size->mixes + 1, sizeof(uint32_t));
  c->terms = tw_arena_alloc_raw(arena, size->terms, sizeof(tw_term));
  return c->point_parents && c->point_flags && c->face_offsets && c->face_parents && c->face_flags &&
         c->corners && c->corner_parents && c->corner_edges && c->corner_flags && c->mix_offsets && c->terms;
}

tw_status tw_change_init(tw_change *change, const tw_editor *editor, const tw_change_size *size) {
  const tw_edit_limits *limits = editor->limits;
  const tw_mesh *mesh = &editor->mesh;
  *change = (tw_change){.editor = editor};
  bool is_over =
      size->points > limits->points || size->faces > limits->faces || size->corners > limits->corners;
  /* Parents number mixes after the old points or corners. */
  uint64_t widest = most(most(size->points, size->faces), most(size->corners, size->terms)) + size->mixes +
                    most(mesh->point_count, mesh->corner_count);
  if (is_over || widest >= UINT32_MAX)
    return tw_editor_fail(editor, TW_LIMIT, "",
                          "there would be up to %llu points, %llu faces and %llu corners: more than allowed",
                          (unsigned long long)size->points, (unsigned long long)size->faces,
                          (unsigned long long)size->corners);
  return allocate(change, editor->scratch, size) ? TW_OK : tw_editor_no_memory(editor);
}

uint32_t tw_change_mix(tw_change *change, const tw_term *terms, uint32_t count) {
  memcpy(change->terms + change->term_count, terms, count * sizeof *terms);
  change->term_count += count;
  change->mix_offsets[change->mix_count + 1] = change->term_count;
  return change->mix_count++;
}

uint32_t tw_change_point(tw_change *change, uint32_t parent, uint8_t flags) {
  change->point_parents[change->point_count] = parent;
  change->point_flags[change->point_count] = flags;
  return change->point_count++;
}

void tw_change_corner(tw_change *change, uint32_t point, uint32_t parent, uint32_t edge, uint8_t flags) {
  uint32_t corner = change->corner_count++;
  change->corners[corner] = point;
  change->corner_parents[corner] = parent;
  change->corner_edges[corner] = edge;
  change->corner_flags[corner] = flags;
}

void tw_change_face(tw_change *change, uint32_t parent, uint8_t flags) {
  uint32_t face = change->face_count++;
  change->face_parents[face] = parent;
  change->face_flags[face] = flags;
  change->face_offsets[face + 1] = change->corner_count;
}

void tw_change_keep_points(tw_change *change) {
  for (uint32_t p = 0; p < change->editor->mesh.point_count; p++) tw_change_point(change, p, 0);
}

void tw_change_keep_face(tw_change *change, uint32_t face, const uint32_t *point_of, uint8_t flags) {
  const tw_mesh *mesh = &change->editor->mesh;
  for (uint32_t c = mesh->face_offsets[face]; c < mesh->face_offsets[face + 1]; c++) {
    uint32_t point = mesh->corners[c];
    tw_change_corner(change, point_of ? point_of[point] : point, c, change->editor->topology->corner_edge[c],
                     0);
  }
  tw_change_face(change, face, flags);
}

void tw_change_turn_face(tw_change *change, uint32_t face, const uint32_t *point_of, uint8_t flags) {
  const tw_topology *t = change->editor->topology;
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face);
  for (uint32_t i = 0; i < size; i++) {
    uint32_t corner = begin + (size - i) % size, point = t->corner_vertex[corner];
    tw_change_corner(change, point_of ? point_of[point] : point, corner,
                     t->corner_edge[tw_corner_previous(t, corner)], 0);
  }
  tw_change_face(change, face, flags);
}

/* ---- the mesh that is made ----------------------------------------------------------------------------- */

/* Mixes rows of `width` numbers, one row for each old point. NULL without memory. */
static float *mix_points(const tw_change_maker *m, const float *rows, uint32_t width) {
  const tw_change *c = m->change;
  float *out = tw_arena_alloc_raw(m->arena, (size_t)c->point_count * width, sizeof *out);
  for (uint32_t p = 0; out && p < c->point_count; p++) {
    uint32_t count;
    tw_term single;
    const tw_term *terms = tw_terms_of(c, c->point_parents[p], m->from->point_count, &single, &count);
    for (uint32_t k = 0; k < width; k++) {
      double sum = 0;
      for (uint32_t i = 0; i < count; i++)
        sum += terms[i].weight * (double)rows[(size_t)width * terms[i].index + k];
      out[(size_t)width * p + k] = tw_within_limits(sum);
    }
  }
  return out;
}

/* Mixes the values of an attribute of points; whole numbers are those of the heaviest term. NULL without
 * memory. */
static float *mix_attribute(const tw_change_maker *m, const tw_attribute *from) {
  const tw_change *c = m->change;
  uint32_t width = from->width;
  if (from->numbers == TW_NUMBERS_REAL) return mix_points(m, from->values, width);
  float *out = tw_arena_alloc_raw(m->arena, (size_t)c->point_count * width, sizeof *out);
  for (uint32_t p = 0; out && p < c->point_count; p++) {
    uint32_t count;
    tw_term single;
    const tw_term *terms = tw_terms_of(c, c->point_parents[p], m->from->point_count, &single, &count);
    memcpy(out + (size_t)width * p, from->values + (size_t)width * tw_heaviest_term(terms, count)->index,
           width * sizeof *out);
  }
  return out;
}

/* ---- skin weights -------------------------------------------------------------------------------------- */

typedef struct pull {
  uint32_t joint;
  double weight;
} pull;

/* Weights of one joint that cancel out may leave so much. */
#define ROUNDED 1e-9

static int compare_joints(const void *left, const void *right) {
  const pull *a = left, *b = right;
  return a->joint < b->joint ? -1 : a->joint > b->joint;
}

static int compare_weights(const void *left, const void *right) {
  const pull *a = left, *b = right;
  if (a->weight != b->weight) return a->weight > b->weight ? -1 : 1;
  return compare_joints(left, right);
}

/* Keeps the `most` joints of the largest weights above `least`, normalised. pulls: [count], overwritten. */
static void keep_heaviest(pull *pulls, uint32_t count, uint32_t most, double least, uint16_t *joints,
                          float *weights) {
  uint32_t different = 0;
  qsort(pulls, count, sizeof *pulls, compare_joints);
  for (uint32_t i = 0; i < count; i++)
    if (different > 0 && pulls[different - 1].joint == pulls[i].joint)
      pulls[different - 1].weight += pulls[i].weight;
    else
      pulls[different++] = pulls[i];
  qsort(pulls, different, sizeof *pulls, compare_weights);
  double sum = 0;
  if (different > most) different = most;
  while (different > 0 && !(pulls[different - 1].weight > least)) different--;
  for (uint32_t i = 0; i < different; i++) sum += pulls[i].weight;
  for (uint32_t i = 0; i < most; i++) {
    joints[i] = i < different ? (uint16_t)pulls[i].joint : 0;
    weights[i] = i < different && sum > 0 ? (float)(pulls[i].weight / sum) : 0;
  }
}

static bool mix_skin(const tw_change_maker *m) {
  const tw_change *c = m->change;
  const tw_skin_weights *skin = &m->from->skin;
  if (!skin->joints) return true;
  size_t width = skin->width;
  uint16_t *joints = tw_arena_alloc(m->arena, c->point_count, width * sizeof *joints);
  float *weights = tw_arena_alloc(m->arena, c->point_count, width * sizeof *weights);
  pull *pulls = tw_alloc((size_t)c->term_count + 1, width * sizeof *pulls);
  bool has_room = joints && weights && pulls;
  for (uint32_t p = 0; has_room && p < c->point_count; p++) {
    uint32_t count, pull_count = 0;
    tw_term single;
    const tw_term *terms = tw_terms_of(c, c->point_parents[p], m->from->point_count, &single, &count);
    if (count == 1) {
      memcpy(joints + width * p, skin->joints + width * terms->index, width * sizeof *joints);
      memcpy(weights + width * p, skin->weights + width * terms->index, width * sizeof *weights);
      continue;
    }
    double least = 0;
    for (size_t i = 0; i < width * count; i++) {
      size_t at = width * terms[i / width].index + i % width;
      double weight = terms[i / width].weight * (double)skin->weights[at];
      if (weight < 0) least = ROUNDED;
      if (weight != 0) pulls[pull_count++] = (pull){skin->joints[at], weight};
    }
    keep_heaviest(pulls, pull_count, skin->width, least, joints + width * p, weights + width * p);
  }
  tw_free(pulls);
  m->to->skin = (tw_skin_weights){skin->width, joints, weights};
  return has_room;
}

/* ---- points -------------------------------------------------------------------------------------------- */

static bool make_points(const tw_change_maker *m) {
  const tw_mesh *from = m->from;
  tw_mesh *to = m->to;
  to->point_count = m->change->point_count;
  to->positions = mix_points(m, from->positions, 3);
  tw_attribute *attributes = tw_arena_alloc(m->arena, from->attribute_count, sizeof *attributes);
  const float **morphs = tw_arena_alloc(m->arena, from->morph_count, sizeof *morphs);
  bool has_room = to->positions && attributes && morphs && mix_skin(m);
  for (uint32_t i = 0; has_room && i < from->attribute_count; i++) {
    attributes[i] = from->attributes[i];
    if (attributes[i].corners) continue; /* make_channels makes these */
    attributes[i].values = mix_attribute(m, &from->attributes[i]);
    has_room = attributes[i].values != NULL;
  }
  for (uint32_t i = 0; has_room && i < from->morph_count; i++) {
    morphs[i] = mix_points(m, from->morphs[i], 3);
    has_room = morphs[i] != NULL;
  }
  to->attributes = attributes;
  to->morphs = morphs;
  return has_room;
}

/* ---- faces --------------------------------------------------------------------------------------------- */

static bool make_faces(const tw_change_maker *m) {
  const tw_change *c = m->change;
  const tw_mesh *from = m->from;
  tw_mesh *to = m->to;
  uint32_t *offsets = tw_arena_alloc_raw(m->arena, (size_t)c->face_count + 1, sizeof *offsets);
  uint32_t *corners = tw_arena_alloc_raw(m->arena, c->corner_count, sizeof *corners);
  if (!offsets || !corners) return false;
  memcpy(offsets, c->face_offsets, ((size_t)c->face_count + 1) * sizeof *offsets);
  if (c->corner_count > 0) memcpy(corners, c->corners, c->corner_count * sizeof *corners);
  to->face_count = c->face_count;
  to->corner_count = c->corner_count;
  to->face_offsets = offsets;
  to->corners = corners;
  return tw_mesh_take_faces(to, from, c->face_parents, c->face_count, m->arena) == TW_OK;
}

/* ---- tags ---------------------------------------------------------------------------------------------- */

typedef struct crease {
  uint32_t ends[2]; /* the lesser first */
  float sharpness;
} crease;

static int compare_creases(const void *left, const void *right) {
  const crease *a = left, *b = right;
  for (int k = 0; k < 2; k++)
    if (a->ends[k] != b->ends[k]) return a->ends[k] < b->ends[k] ? -1 : 1;
  return a->sharpness > b->sharpness ? -1 : a->sharpness < b->sharpness;
}

/* Lists the new edges that are part of a sharp old edge. sharpness: [old edge_count]. creases: NULL only
 * counts them. */
static uint32_t list_creases(const tw_change *c, const float *sharpness, crease *creases) {
  uint32_t count = 0;
  for (uint32_t f = 0; f < c->face_count; f++)
    for (uint32_t i = c->face_offsets[f]; i < c->face_offsets[f + 1]; i++) {
      uint32_t edge = c->corner_edges[i];
      if (edge == UINT32_MAX || !(sharpness[edge] > 0)) continue;
      uint32_t a = c->corners[i], b = c->corners[tw_corner_behind(c, f, i)];
      if (creases) creases[count] = (crease){{a < b ? a : b, a < b ? b : a}, sharpness[edge]};
      count++;
    }
  return count;
}

static bool store_creases(const tw_change_maker *m, crease *creases, uint32_t count) {
  uint32_t kept = 0;
  if (tw_sort(creases, count, sizeof *creases, compare_creases) != TW_OK) return false;
  for (uint32_t i = 0; i < count; i++)
    if (i == 0 || memcmp(creases[i].ends, creases[i - 1].ends, sizeof creases->ends) != 0)
      creases[kept++] = creases[i];
  uint32_t *edges = tw_arena_alloc_raw(m->arena, kept, sizeof(uint32_t[2]));
  float *sharpness = tw_arena_alloc_raw(m->arena, kept, sizeof *sharpness);
  if (!edges || !sharpness) return false;
  for (uint32_t i = 0; i < kept; i++) {
    memcpy(edges + 2 * (size_t)i, creases[i].ends, sizeof creases->ends);
    sharpness[i] = creases[i].sharpness;
  }
  m->to->crease_count = kept;
  m->to->crease_edges = edges;
  m->to->crease_sharpness = sharpness;
  return true;
}

static bool carry_creases(const tw_change_maker *m) {
  const tw_topology *t = m->editor->topology;
  if (m->from->crease_count == 0) return true;
  float *sharpness = tw_alloc_zero(t->edge_count, sizeof *sharpness);
  for (uint32_t i = 0; sharpness && i < m->from->crease_count; i++) {
    const uint32_t *ends = m->from->crease_edges + 2 * (size_t)i;
    uint32_t edge = tw_topology_find_edge(t, ends[0], ends[1]);
    if (edge != UINT32_MAX) sharpness[edge] = m->from->crease_sharpness[i];
  }
  uint32_t count = sharpness ? list_creases(m->change, sharpness, NULL) : 0;
  crease *creases = tw_alloc(count, sizeof *creases);
  bool has_room = sharpness && creases;
  if (has_room) {
    list_creases(m->change, sharpness, creases);
    has_room = store_creases(m, creases, count);
  }
  tw_free(creases);
  tw_free(sharpness);
  return has_room;
}

/* A new point whose parent is an old point keeps its sharpness. Of points that are merged the greatest
 * sharpness stays, as that of edges does. before, after: of the old points and, zeroed, of the new ones. */
static void carry_sharpness(const tw_change_maker *m, const float *before, float *after) {
  const tw_change *c = m->change;
  for (uint32_t p = 0; p < c->point_count; p++)
    if (c->point_parents[p] < m->from->point_count) after[p] = before[c->point_parents[p]];
  for (uint32_t p = 0; c->joins && p < m->from->point_count; p++)
    if (c->joins[p] != UINT32_MAX && before[p] > after[c->joins[p]]) after[c->joins[p]] = before[p];
}

static bool carry_sharp_points(const tw_change_maker *m) {
  const tw_change *c = m->change;
  tw_mesh *to = m->to;
  if (m->from->sharp_point_count == 0) return true;
  float *before = tw_alloc_zero(m->from->point_count, sizeof *before);
  float *after = tw_alloc_zero(c->point_count, sizeof *after);
  uint8_t *is_sharp = tw_alloc_zero(c->point_count, 1);
  bool has_room = before && after && is_sharp;
  for (uint32_t i = 0; has_room && i < m->from->sharp_point_count; i++)
    before[m->from->sharp_points[i]] = m->from->point_sharpness[i];
  if (has_room) carry_sharpness(m, before, after);
  for (uint32_t p = 0; has_room && p < c->point_count; p++) is_sharp[p] = after[p] > 0;
  if (has_room)
    to->sharp_points = tw_list_flagged(m->arena, is_sharp, 1, c->point_count, &to->sharp_point_count);
  has_room = has_room && to->sharp_points;
  float *sharpness = has_room ? tw_arena_alloc_raw(m->arena, to->sharp_point_count, sizeof *sharpness) : NULL;
  for (uint32_t i = 0; sharpness && i < to->sharp_point_count; i++) sharpness[i] = after[to->sharp_points[i]];
  to->point_sharpness = sharpness;
  tw_free(before);
  tw_free(after);
  tw_free(is_sharp);
  return sharpness;
}

/* A part of a hole is a hole. */
static bool carry_holes(const tw_change_maker *m) {
  const tw_change *c = m->change;
  if (m->from->hole_count == 0) return true;
  uint8_t *before = tw_alloc_zero(m->from->face_count, 1), *is_hole = tw_alloc_zero(c->face_count, 1);
  bool has_room = before && is_hole;
  for (uint32_t i = 0; has_room && i < m->from->hole_count; i++) before[m->from->holes[i]] = 1;
  for (uint32_t f = 0; has_room && f < c->face_count; f++)
    is_hole[f] = before[c->face_parents[f]] && !(c->face_flags[f] & TW_CHANGE_NEW);
  if (has_room) m->to->holes = tw_list_flagged(m->arena, is_hole, 1, c->face_count, &m->to->hole_count);
  tw_free(before);
  tw_free(is_hole);
  return has_room && m->to->holes;
}

/* ---- names --------------------------------------------------------------------------------------------- */

/* The new elements that each old one became. */
typedef struct heirs {
  uint32_t *offsets; /* [old count + 1] */
  uint32_t *items;   /* ascending in each run */
} heirs;

/* Lists the new elements by their parent. parents, flags: [count]. Skips parents from `before`, the old
 * count, on (mixes and UINT32_MAX), and elements flagged NEW. */
static bool find_heirs(const uint32_t *parents, const uint8_t *flags, uint32_t count, uint32_t before,
                       heirs *out) {
  out->offsets = tw_alloc_zero((size_t)before + 2, sizeof *out->offsets);
  out->items = tw_alloc(count, sizeof *out->items);
  if (!out->offsets || !out->items) return false;
  for (int pass = 0; pass < 2; pass++) {
    for (uint32_t i = 0; i < count; i++) {
      if (parents[i] >= before || (flags[i] & TW_CHANGE_NEW)) continue;
      if (pass == 0)
        out->offsets[parents[i] + 2]++;
      else
        out->items[out->offsets[parents[i] + 1]++] = i;
    }
    if (pass == 0)
      for (uint32_t i = 0; i < before; i++) out->offsets[i + 2] += out->offsets[i + 1];
  }
  return true;
}

static void heirs_deinit(heirs *h) {
  tw_free(h->offsets);
  tw_free(h->items);
}

static int compare_pairs(const void *left, const void *right) {
  const uint32_t *a = left, *b = right;
  if (a[0] != b[0]) return a[0] < b[0] ? -1 : 1;
  return a[1] < b[1] ? -1 : a[1] > b[1];
}

static bool carry_list(const tw_change_maker *m, const heirs *h, uint32_t **items, uint32_t *count) {
  uint64_t total = 0;
  for (uint32_t i = 0; i < *count; i++) total += h->offsets[(*items)[i] + 1] - h->offsets[(*items)[i]];
  uint32_t *out = tw_arena_alloc_raw(m->arena, total, sizeof *out), next = 0;
  if (!out) return false;
  for (uint32_t i = 0; i < *count; i++)
    for (uint32_t k = h->offsets[(*items)[i]]; k < h->offsets[(*items)[i] + 1]; k++)
      out[next++] = h->items[k];
  if (tw_sort(out, next, sizeof *out, tw_compare_uint32) != TW_OK) return false;
  *items = out;
  *count = next;
  return true;
}

/* Points that are merged are the one that they become. */
static bool carry_points(const tw_change_maker *m, const heirs *h, tw_named *named) {
  const uint32_t *joins = m->change->joins;
  if (!joins) return carry_list(m, h, &named->points, &named->point_count);
  uint32_t *out = tw_arena_alloc_raw(m->arena, named->point_count, sizeof *out), count = 0, kept = 0;
  if (!out) return false;
  for (uint32_t i = 0; i < named->point_count; i++)
    if (joins[named->points[i]] != UINT32_MAX) out[count++] = joins[named->points[i]];
  if (tw_sort(out, count, sizeof *out, tw_compare_uint32) != TW_OK) return false;
  for (uint32_t i = 0; i < count; i++)
    if (kept == 0 || out[i] != out[kept - 1]) out[kept++] = out[i];
  named->points = out;
  named->point_count = kept;
  return true;
}

/* Sorts pairs of points and drops repeated ones. kept: how many stay. */
static bool sort_pairs(uint32_t (*pairs)[2], uint32_t count, uint32_t *kept) {
  if (tw_sort(pairs, count, sizeof *pairs, compare_pairs) != TW_OK) return false;
  *kept = 0;
  for (uint32_t i = 0; i < count; i++)
    if (i == 0 || memcmp(pairs[i], pairs[i - 1], sizeof *pairs) != 0)
      memmove(pairs[(*kept)++], pairs[i], sizeof *pairs);
  return true;
}

static void put_pair(const tw_change *c, uint32_t corner, uint32_t behind, uint32_t out[2]) {
  uint32_t a = c->corners[corner], b = c->corners[behind];
  out[0] = a < b ? a : b;
  out[1] = a < b ? b : a;
}

/* next: [corner_count] the next corner in its face. */
static bool carry_edges(const tw_change_maker *m, const heirs *h, const uint32_t *next, tw_named *named) {
  const tw_topology *t = m->editor->topology;
  uint32_t *edges = tw_alloc(named->edge_count, sizeof *edges), count = 0;
  uint64_t total = 0;
  if (!edges) return false;
  for (uint32_t i = 0; i < named->edge_count; i++) {
    edges[i] = tw_topology_find_edge(t, named->edges[i][0], named->edges[i][1]);
    if (edges[i] != UINT32_MAX) total += h->offsets[edges[i] + 1] - h->offsets[edges[i]];
  }
  uint32_t(*pairs)[2] = tw_arena_alloc_raw(m->arena, total, sizeof *pairs);
  for (uint32_t i = 0; pairs && i < named->edge_count; i++) {
    if (edges[i] == UINT32_MAX) continue;
    for (uint32_t k = h->offsets[edges[i]]; k < h->offsets[edges[i] + 1]; k++)
      put_pair(m->change, h->items[k], next[h->items[k]], pairs[count++]);
  }
  tw_free(edges);
  if (!pairs) return false;
  named->edges = pairs;
  return sort_pairs(pairs, count, &named->edge_count);
}

static bool carry_named(const tw_change_maker *m, tw_named *named, uint32_t named_count) {
  const tw_change *c = m->change;
  heirs faces = {0}, points = {0}, edges = {0};
  uint32_t *next = tw_alloc(c->corner_count, sizeof *next);
  bool has_room =
      next && find_heirs(c->face_parents, c->face_flags, c->face_count, m->from->face_count, &faces) &&
      find_heirs(c->point_parents, c->point_flags, c->point_count, m->from->point_count, &points) &&
      find_heirs(c->corner_edges, c->corner_flags, c->corner_count, m->editor->topology->edge_count, &edges);
  for (uint32_t f = 0; has_room && f < c->face_count; f++)
    for (uint32_t i = c->face_offsets[f]; i < c->face_offsets[f + 1]; i++)
      next[i] = tw_corner_behind(c, f, i);
  for (uint32_t i = 0; has_room && i < named_count; i++)
    has_room = carry_list(m, &faces, &named[i].faces, &named[i].face_count) &&
               carry_points(m, &points, &named[i]) && carry_edges(m, &edges, next, &named[i]);
  heirs_deinit(&faces);
  heirs_deinit(&points);
  heirs_deinit(&edges);
  tw_free(next);
  return has_room;
}

static bool name_made(const tw_change_maker *m, tw_named *named) {
  const tw_change *c = m->change;
  named->faces = tw_list_flagged(m->arena, c->face_flags, TW_CHANGE_MADE, c->face_count, &named->face_count);
  named->points =
      tw_list_flagged(m->arena, c->point_flags, TW_CHANGE_MADE, c->point_count, &named->point_count);
  uint32_t count = 0;
  for (uint32_t i = 0; i < c->corner_count; i++) count += (c->corner_flags[i] & TW_CHANGE_MADE) != 0;
  named->edges = tw_arena_alloc_raw(m->arena, count, sizeof *named->edges);
  if (!named->faces || !named->points || !named->edges) return false;
  count = 0;
  for (uint32_t f = 0; f < c->face_count; f++)
    for (uint32_t i = c->face_offsets[f]; i < c->face_offsets[f + 1]; i++)
      if (c->corner_flags[i] & TW_CHANGE_MADE)
        put_pair(c, i, tw_corner_behind(c, f, i), named->edges[count++]);
  return sort_pairs(named->edges, count, &named->edge_count);
}

/* ---- all of it ----------------------------------------------------------------------------------------- */

static bool make_mesh(const tw_change_maker *m) {
  *m->to = *m->from;
  tw_mesh_drop_normals(m->to);
  return make_points(m) && make_faces(m) && tw_change_make_channels(m) && carry_creases(m) &&
         carry_sharp_points(m) && carry_holes(m);
}

static tw_status shift_points(const tw_change_maker *m) {
  float *positions = (float *)m->to->positions;
  for (uint32_t p = 0; m->change->shifts && p < m->to->point_count; p++)
    for (uint32_t i = 0; i < 3; i++) {
      double to = (double)positions[3 * (size_t)p + i] + m->change->shifts[p][i];
      if (!(fabs(to) <= (double)TW_COORDINATE_MAX))
        return tw_editor_fail(m->editor, TW_INVALID, "", "the edit moves a point beyond 1e18");
      positions[3 * (size_t)p + i] = (float)to;
    }
  return TW_OK;
}

/* Frees what the mesh before a change was made of. */
static void drop_before(tw_editor *editor) {
  for (uint32_t i = 0; i < editor->named_count; i++) {
    tw_arena_destroy(editor->named[i].arena);
    editor->named[i].arena = NULL;
  }
  for (int i = 0; i < 3; i++) {
    tw_arena_destroy(editor->tags[i]);
    editor->tags[i] = NULL;
  }
  tw_arena_destroy(editor->arena);
  editor->topology = NULL;
}

tw_status tw_editor_apply(tw_editor *editor, const tw_change *change) {
  tw_mesh mesh;
  tw_change_maker m = {change, &editor->mesh, &mesh, tw_arena_create(), editor};
  tw_named *named = tw_editor_name(editor);
  uint32_t older = named ? editor->named_count - 1 : editor->named_count;
  bool has_room = m.arena && make_mesh(&m);
  if (has_room && older > 0) has_room = carry_named(&m, editor->named, older);
  if (has_room && named) has_room = name_made(&m, named);
  tw_status status = has_room ? shift_points(&m) : tw_editor_no_memory(editor);
  if (status != TW_OK) {
    tw_arena_destroy(m.arena);
    return status;
  }
  drop_before(editor);
  editor->mesh = mesh;
  editor->arena = m.arena;
  editor->is_loose = editor->has_loose_targets = true;
  return tw_editor_clear_scratch(editor);
}

tw_status tw_editor_copy(tw_editor *editor, tw_arena *arena, tw_mesh *out) {
  const tw_mesh *mesh = &editor->mesh;
  const tw_change_size size = {
      .points = mesh->point_count, .faces = mesh->face_count, .corners = mesh->corner_count};
  tw_change change = {.editor = editor};
  tw_mesh made;
  tw_status status = tw_editor_need_topology(editor);
  if (status != TW_OK) return status;
  if (!allocate(&change, editor->scratch, &size)) return tw_editor_no_memory(editor);
  tw_change_keep_points(&change);
  for (uint32_t f = 0; f < mesh->face_count; f++) tw_change_keep_face(&change, f, NULL, 0);
  tw_change_maker m = {&change, mesh, &made, arena, editor};
  if (!make_mesh(&m)) return tw_editor_no_memory(editor);
  made.normals = mesh->normals;
  made.morph_normals = mesh->morph_normals;
  *out = made;
  return TW_OK;
}
